// Rendering in several threads: that a picture depends on nothing but the world, the eye, the settings and the seed,
// and that a render stops when and as it is told. Runs under the thread sanitizer, too, so its pictures are small.

#include "tests/render_sample.h"

#include "base/hash.h"
#include "rayfold/rayfold.h"
#include "scene/kinds.h"

#include <pthread.h>
#include <time.h>
#include <unistd.h>

#define RICH_HASH 0x9901031d435e6f41ull

// --- determinism --------------------------------------------------------------------------------

// A picture to be made in many ways.
typedef struct Subject {
  const char *name;
  Scene *scene;
  World *world;
  Eye eye;
  RenderSettings settings;
} Subject;

// How it is made. Zeros are one thread, the plain level, the usual tiles and the samples 0 to SPP.
typedef struct Through {
  int threads;
  IsaLevel level;
  uint32_t tile_size, first, end;
} Through;

enum { WIDTH = 29, HEIGHT = 23, SPP = 4 };

static Film *film_of(const Subject *s, Through way)
{
  Film *f = film_create(WIDTH, HEIGHT, ALL_PLANES, NULL);
  const RenderJob job = {.world = s->world,
                         .eye = s->eye,
                         .settings = s->settings,
                         .seed = 1,
                         .film = f,
                         .first_sample = way.first,
                         .end_sample = way.end ? way.end : SPP,
                         .tile_size = way.tile_size};
  Jobs *jobs = way.threads > 1 ? jobs_create(way.threads, NULL) : NULL;
  RenderStats stats;
  CHECK(render_run(&job, jobs, hot_table(way.level), NULL, &stats, NULL));
  CHECK(stats.bad_samples == 0);
  jobs_destroy(jobs);
  return f;
}

static uint64_t hash_of(const Subject *s, Through way)
{
  Film *f = film_of(s, way);
  const uint64_t h = film_hash(f);
  film_destroy(f);
  return h;
}

static Subject rich_subject(void)
{
  Subject s = {.name = "rich", .scene = rich_scene()};
  s.world = world_of(s.scene);
  s.eye = pinhole(0, 0.6f, 4, 0, -0.3f, 0, 40);
  s.settings = s.scene->render;
  s.settings.filter = FILTER_BLACKMAN_HARRIS;
  return s;
}

static Subject file_subject(const char *path)
{
  Err err = {0};
  Subject s = {.name = path, .scene = scene_load(path, NULL, &err)};
  CHECK_MSG(s.scene && eye_from_camera(&s.scene->camera, &s.eye, &err), "%s", err.text);
  s.world = world_of(s.scene);
  s.settings = s.scene->render;
  s.settings.max_depth = s.settings.max_depth < 8 ? s.settings.max_depth : 8;
  s.settings.roulette_depth = 3;
  return s;
}

enum { SUBJECT_COUNT = 11 };

static Subject subject(int i)
{
  static const char *const files[] = {"scenes/cornell.json", "scenes/furnace.json", "scenes/materials.json",
                                      "scenes/showcase.json", "scenes/textures.json", "scenes/tests/tiny.json"};
  if (i >= 5) return file_subject(files[i - 5]);
  Subject s = rich_subject();
  if (i == 1) { // a lens with blades
    s.name = "rich, lens";
    s.eye.aperture = 0.1f;
    s.eye.focus = 4;
    s.eye.blades = 5;
    s.settings.filter = FILTER_GAUSSIAN;
  } else if (i == 2) {
    s.name = "rich, orthographic";
    s.eye = parallel(3, 2, 4, 0, -0.3f, 0, 3);
    s.settings.filter = FILTER_BOX;
  } else if (i == 3) {
    s.name = "rich, panoramic";
    s.eye.kind = EYE_PANORAMIC;
    s.eye.span = 2 * PI;
    s.settings.transparent = true;
  } else if (i == 4) {
    s.name = "rich, long clamped paths";
    s.settings.max_depth = 60;
    s.settings.clamp = 0.5f;
  }
  return s;
}

static void subject_finish(Subject *s)
{
  world_release(s->world);
  scene_destroy(s->scene);
}

// D1: on any number of threads, again and again.
static void check_threads(const Subject *s, uint64_t truth)
{
  static const int threads[] = {1, 2, 3, 5, 8};
  for (int k = 0; k < 5; k++)
    for (int run = 0; run < 3; run++) {
      const Through way = {.threads = threads[k], .level = cpu_best_isa()};
      CHECK_MSG(hash_of(s, way) == truth, "%s, %d threads, run %d", s->name, threads[k], run);
    }
}

static void check_levels(const Subject *s, uint64_t truth)
{
  for (int level = ISA_REF; level <= (int)cpu_best_isa(); level++) {
    CHECK(!strcmp(hot_table((IsaLevel)level)->name, isa_names[level])); // not a lower one in its place
    CHECK_MSG(hash_of(s, (Through){.level = (IsaLevel)level, .threads = 2}) == truth, "%s, level %s", s->name,
              isa_names[level]);
  }
}

// D2: in tiles of any size.
static void check_tiles(const Subject *s, uint64_t truth)
{
  static const uint32_t sizes[] = {1, 7, 16, 64, 128};
  for (int k = 0; k < 5; k++) {
    const Through way = {.threads = 2, .level = cpu_best_isa(), .tile_size = sizes[k]};
    CHECK_MSG(hash_of(s, way) == truth, "%s, tiles of %u", s->name, sizes[k]);
  }
}

// D2: the samples in three parts, merged in every order.
static void check_splits(const Subject *s, uint64_t truth)
{
  static const uint32_t ends[] = {0, 1, 3, SPP};
  static const int orders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  Film *parts[3];
  for (int k = 0; k < 3; k++)
    parts[k] = film_of(s, (Through){.level = cpu_best_isa(), .first = ends[k], .end = ends[k + 1]});
  for (int o = 0; o < 6; o++) {
    Film *sum = film_create(WIDTH, HEIGHT, ALL_PLANES, NULL);
    for (int k = 0; k < 3; k++) CHECK(film_merge(sum, parts[orders[o][k]], NULL));
    CHECK_MSG(film_hash(sum) == truth, "%s, parts merged in order %d", s->name, o);
    film_destroy(sum);
  }
  // Pairs first: merging is associative, too.
  CHECK(film_merge(parts[2], parts[1], NULL) && film_merge(parts[0], parts[2], NULL));
  CHECK_MSG(film_hash(parts[0]) == truth, "%s, pairs merged first", s->name);
  for (int k = 0; k < 3; k++) film_destroy(parts[k]);
}

TEST(a_picture_is_the_same_however_it_is_made)
{
  uint64_t hashes[SUBJECT_COUNT];
  for (int i = 0; i < (TEST_IS_SLOW ? 1 : SUBJECT_COUNT); i++) {
    Subject s = subject(i);
    hashes[i] = hash_of(&s, (Through){.level = ISA_REF});
    check_levels(&s, hashes[i]);
    check_threads(&s, hashes[i]);
    check_tiles(&s, hashes[i]);
    check_splits(&s, hashes[i]);
    for (int k = 0; k < i; k++) CHECK_MSG(hashes[k] != hashes[i], "%s is another subject's picture", s.name);
    subject_finish(&s);
  }
}

// D6. A new number belongs into the commit that means to change the picture.
TEST(the_picture_has_not_changed)
{
  Subject s = rich_subject();
  const uint64_t hash = hash_of(&s, (Through){.level = ISA_REF});
  CHECK_MSG(hash == RICH_HASH, "it is %#llx", (unsigned long long)hash);
  subject_finish(&s);
}

// D3, as far as films in memory go: going on where a film stopped is the same as never having stopped.
TEST(a_film_goes_on_where_it_stopped)
{
  Subject s = rich_subject();
  const uint64_t truth = hash_of(&s, (Through){.level = ISA_REF});
  Film *f = film_of(&s, (Through){.level = cpu_best_isa(), .end = 2});
  RenderJob job = {
      .world = s.world, .eye = s.eye, .settings = s.settings, .seed = 1, .film = f, .end_sample = SPP};
  RenderStats stats;
  CHECK(render_run(&job, NULL, hot_table(ISA_REF), NULL, &stats, NULL) && film_hash(f) == truth);
  CHECK(stats.samples == SPP - 2 && stats.is_complete);
  CHECK(render_run(&job, NULL, hot_table(ISA_REF), NULL, &stats, NULL) && film_hash(f) == truth);
  CHECK(stats.samples == 0 && stats.is_complete);
  film_clear(f);
  job.first_sample = 0;
  job.seed = 2;
  CHECK(render_run(&job, NULL, hot_table(ISA_REF), NULL, NULL, NULL) && film_hash(f) != truth);
  film_destroy(f);
  subject_finish(&s);
}

TEST(views_are_pictures_too)
{
  Scene *s = rich_scene();
  World *w = world_of(s);
  for (int view = INTEGRATOR_NORMAL; view <= INTEGRATOR_COST; view++) {
    uint64_t hash[2];
    for (int k = 0; k < 2; k++) {
      Film *f = film_create(40, 30, ALL_PLANES, NULL);
      RenderJob job = job_of(s, w, pinhole(0, 0.6f, 4, 0, -0.3f, 0, 40), f, 2);
      job.settings.integrator = view;
      Jobs *jobs = jobs_create(1 + 2 * k, NULL);
      CHECK(render_run(&job, jobs, hot_table(k ? cpu_best_isa() : ISA_REF), NULL, NULL, NULL));
      const Picture p = summarize(f);
      CHECK_MSG(p.most > p.least && p.least >= 0 && p.most <= 1, "view %d: %g to %g", view, (double)p.least,
                (double)p.most);
      hash[k] = film_hash(f);
      jobs_destroy(jobs);
      film_destroy(f);
    }
    CHECK_MSG(hash[0] == hash[1], "view %d", view);
  }
  world_release(w);
  scene_destroy(s);
}

// --- stopping -----------------------------------------------------------------------------------

static RenderGo stop_at_third(void *user, const RenderProgress *p)
{
  double *seen = user;
  if (p->samples >= 4) *seen = p->samples;
  return p->samples >= 4 ? RENDER_STOP_AFTER_PASS : RENDER_GO_ON;
}

static RenderGo stop_now(void *user, const RenderProgress *p)
{
  *(double *)user = p->done;
  return RENDER_STOP_NOW;
}

static void *cancel_soon(void *user)
{
  usleep(100 * 1000);
  Cancel *c = user;
  atomic_store(&c->requested, true);
  return NULL;
}

static double now(void)
{
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

TEST(stopping_leaves_a_film_that_is_right)
{
  Scene *s = rich_scene();
  World *w = world_of(s);
  const Eye eye = pinhole(0, 0.6f, 4, 0, -0.3f, 0, 40);
  double seen = 0;
  Film *f = film_create(40, 30, ALL_PLANES, NULL);
  RenderJob job = job_of(s, w, eye, f, 4096);
  job.progress = stop_at_third;
  job.user = &seen;
  RenderStats stats;
  CHECK(render_run(&job, NULL, hot_table(ISA_REF), NULL, &stats, NULL));
  CHECK(stats.samples >= 4 && stats.samples < 64 && seen >= 4 && !f->is_partial);
  CHECK(f->ranges.count == film_cells(f) && f->ranges.items[0].end == stats.samples);
  for (int i = 0; i < 40 * 30; i++) CHECK(f->count[i] == stats.samples);

  film_clear(f);
  job.progress = NULL;
  job.budget_seconds = 0.2;
  const double begun = now();
  CHECK(render_run(&job, NULL, hot_table(cpu_best_isa()), NULL, &stats, NULL));
  CHECK_MSG(stats.samples < 4096 && now() - begun < 3, "%u samples, %.2f s", stats.samples, now() - begun);

  film_clear(f);
  job.budget_seconds = 0;
  job.noise_target = 0.2;
  CHECK(render_run(&job, NULL, hot_table(cpu_best_isa()), NULL, &stats, NULL));
  CHECK(film_noise(f, NULL) <= 0.2 && stats.samples < 4096 && stats.is_complete && stats.quiet == 1);
  film_destroy(f);

  Film *large = film_create(500, 400, 0, NULL);
  job = job_of(s, w, eye, large, 100000);
  Cancel cancel = {0};
  pthread_t thread;
  CHECK(!pthread_create(&thread, NULL, cancel_soon, &cancel));
  Jobs *jobs = jobs_create(2, NULL);
  Err err = {0};
  CHECK(!render_run(&job, jobs, hot_table(cpu_best_isa()), &cancel, &stats, &err));
  pthread_join(thread, NULL);
  CHECK(err.kind == ERR_CANCELLED && large->is_partial);
  CHECK_MSG(stats.seconds < 1, "%.3f s", stats.seconds);
  bool has_range = true;
  for (size_t i = 0; i < 500 * 400; i++)
    has_range = has_range && large->count[i] <= large->ranges.items[0].end;
  CHECK(has_range);
  film_clear(large);
  job.progress = stop_now;
  job.user = &seen;
  Err now_err = {0};
  CHECK(!render_run(&job, jobs, hot_table(cpu_best_isa()), NULL, &stats, &now_err));
  CHECK(now_err.kind == ERR_CANCELLED && seen < 1);
  jobs_destroy(jobs);
  film_destroy(large);
  world_release(w);
  scene_destroy(s);
}

// --- several at once ----------------------------------------------------------------------------

// Renders one world, again and again, while others are made beside it from its parts.
typedef struct Watcher {
  World *world; // one use, the watcher's own
  Jobs *jobs;   // may be another watcher's, too
  uint64_t hash[3];
} Watcher;

static void *watch(void *user)
{
  Watcher *w = user;
  for (int k = 0; k < 3; k++) {
    Film *f = film_create(24, 16, ALL_PLANES, NULL);
    RenderJob job = {
        .world = w->world, .eye = pinhole(0, 0.6f, 4, 0, -0.3f, 0, 40), .film = f, .end_sample = 2};
    group_default(&group_render, 0, &job.settings);
    CHECK(render_run(&job, w->jobs, hot_table(cpu_best_isa()), NULL, NULL, NULL));
    w->hash[k] = film_hash(f);
    film_destroy(f);
  }
  world_release(w->world);
  return NULL;
}

TEST(worlds_come_and_go_while_others_render)
{
  enum { STEPS = 4 };
  Scene *s = rich_scene();
  Jobs *jobs = jobs_create(3, NULL), *shared = jobs_create(2, NULL);
  Watcher watchers[2 * STEPS];
  pthread_t threads[2 * STEPS];
  World *newest = NULL;
  for (int step = 0; step < STEPS; step++) {
    s->objects.items[1].common.translate[0] += 0.3f;
    s->materials.items[1].pbr.roughness = 0.2f * (float)(step + 1);
    World *next = world_prepare(s, newest, NULL, jobs, NULL, NULL);
    CHECK(next);
    world_release(newest);
    newest = next;
    for (int k = 0; k < 2; k++) {
      Watcher *w = &watchers[2 * step + k];
      *w = (Watcher){.world = world_share(newest), .jobs = k ? shared : NULL};
      CHECK(!pthread_create(&threads[2 * step + k], NULL, watch, w));
    }
  }
  world_release(newest);
  for (int i = 0; i < 2 * STEPS; i++) pthread_join(threads[i], NULL);
  for (int i = 0; i < 2 * STEPS; i++) {
    const uint64_t *h = watchers[i].hash, expected = watchers[i & ~1].hash[0];
    CHECK_MSG(h[0] == expected && h[1] == expected && h[2] == expected, "watcher %d", i);
    CHECK(i < 2 || h[0] != watchers[i - 2].hash[0]);
  }
  jobs_destroy(jobs);
  jobs_destroy(shared);
  scene_destroy(s);
}

// Hills of 2 x side x side triangles.
static MeshData *hills(uint32_t side)
{
  MeshData *m = mesh_data_create();
  m->vertex_count = (size_t)(side + 1) * (side + 1);
  m->triangle_count = (size_t)2 * side * side;
  m->positions = mem_alloc(m->vertex_count, 3 * sizeof *m->positions);
  m->triangles = mem_alloc(m->triangle_count, 3 * sizeof *m->triangles);
  float *p = m->positions;
  for (uint32_t i = 0; i < m->vertex_count; i++, p += 3)
    set3(p, 6 * (float)(i % (side + 1)) / (float)side - 3, 0.2f * unit_float(hash_u32(i)) - 0.9f,
         6 * (float)(i / (side + 1)) / (float)side - 3);
  uint32_t *t = m->triangles;
  for (uint32_t i = 0; i < side * side; i++, t += 6) {
    const uint32_t a = i / side * (side + 1) + i % side, b = a + side + 1;
    const uint32_t six[6] = {a, b, a + 1, a + 1, b, b + 1};
    memcpy(t, six, sizeof six);
  }
  return m;
}

TEST(large_meshes_are_prepared_by_all_threads)
{
  enum { SIDE = 200 }; // 80,000 triangles; above 65,536 all threads work on one tree
  uint64_t hash[2];
  Scene *s = rich_scene();
  const int32_t mesh = scene_add_mesh(s, "hills", hills(SIDE)),
                object = scene_add_object(s, SHAPE_MESH, NULL);
  s->objects.items[object].shape.mesh_i = mesh;
  for (int k = 0; k < 2; k++) {
    Jobs *jobs = jobs_create(1 + 2 * k, NULL);
    World *w = world_prepare(s, NULL, NULL, jobs, NULL, NULL);
    CHECK(w);
    const Subject subject_k = {
        .world = w, .eye = pinhole(0, 0.6f, 4, 0, -0.3f, 0, 40), .settings = s->render};
    hash[k] = hash_of(&subject_k, (Through){.threads = 3, .level = cpu_best_isa(), .end = 1});
    world_release(w);
    jobs_destroy(jobs);
  }
  CHECK(hash[0] == hash[1]);
  scene_destroy(s);
}

// A whole life of the library: engine, scene, world, film, and a mistake whose message must be this thread's own.
static void *use_library(void *user)
{
  rf_engine_def def = rf_default_engine_def();
  def.threads = 2;
  rf_engine *e = rf_engine_create(&def);
  rf_scene *s = rf_scene_load(e, "scenes/cornell.json", NULL);
  const char *text;
  CHECK(!rf_set(s, "render.nothing", "1") && rf_error(e, &text) == RF_BAD_SCENE);
  CHECK_TEXT(text, "nothing");
  rf_world *w = rf_prepare(s, NULL);
  rf_eye eye;
  CHECK(rf_camera(s, w, NULL, 1.5f, &eye));
  rf_film *f = rf_film_create(e, 24, 16, RF_ALL_PLANES);
  rf_render_def render = rf_scene_render_def(s, NULL, NULL);
  render.end_sample = 2;
  CHECK(rf_render(w, &eye, &render, f, NULL) == RF_OK);
  CHECK(rf_error(e, &text) == RF_OK);
  *(uint64_t *)user = rf_film_hash(f);
  rf_film_destroy(f);
  rf_world_destroy(w);
  rf_scene_destroy(s);
  rf_engine_destroy(e);
  return NULL;
}

TEST(engines_never_meet)
{
  pthread_t threads[3];
  uint64_t hash[3] = {0};
  for (int i = 0; i < 3; i++) CHECK(!pthread_create(&threads[i], NULL, use_library, &hash[i]));
  for (int i = 0; i < 3; i++) pthread_join(threads[i], NULL);
  CHECK(hash[0] && hash[0] == hash[1] && hash[0] == hash[2]);
}

TEST_MAIN
