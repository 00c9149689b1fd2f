// Rendering in several threads: that a picture depends on nothing but the world, the eye, the settings and the seed,
// and that a render stops when and as it is told. Runs under the thread sanitizer, too, so its pictures are small.

#include "tests/render_sample.h"

#include "base/hash.h"
#include "rayfold/rayfold.h"
#include "scene/kinds.h"

#include <pthread.h>
#include <time.h>
#include <unistd.h>

#define RICH_HASH 0x5dd6f5367ec7efbeull

// --- determinism --------------------------------------------------------------------------------

typedef struct RichRun {
  int threads;
  IsaLevel level;
  uint32_t tile_size, first, end;
  bool reversed; // keep the film's halves in the other order
} RichRun;

static Film *rich_film(const World *w, const Scene *s, RichRun run)
{
  Film *f = film_create(53, 41, ALL_PLANES, NULL);
  RenderJob job = job_of(s, w, pinhole(0, 0.6f, 4, 0, -0.3f, 0, 40), f, run.end);
  job.first_sample = run.first;
  job.tile_size = run.tile_size;
  job.settings.filter = FILTER_BLACKMAN_HARRIS;
  Jobs *jobs = run.threads > 1 ? jobs_create(run.threads, NULL) : NULL;
  RenderStats stats;
  CHECK(render_run(&job, jobs, hot_table(run.level), NULL, &stats, NULL));
  CHECK(stats.bad_samples == 0);
  jobs_destroy(jobs);
  return f;
}

static uint64_t rich_hash(const World *w, const Scene *s, RichRun run)
{
  Film *f = rich_film(w, s, run);
  const uint64_t h = film_hash(f);
  film_destroy(f);
  return h;
}

TEST(one_hash_for_any_threads_tiles_levels_and_splits)
{
  Scene *s = rich_scene();
  World *w = world_of(s);
  const uint64_t truth = rich_hash(w, s, (RichRun){1, ISA_REF, 16, 0, 6, false});
  for (int t = 2; t <= 5; t += 1 + (t == 3)) {
    CHECK_MSG(rich_hash(w, s, (RichRun){t, ISA_REF, 0, 0, 6, false}) == truth, "%d threads", t);
  }
  const uint32_t tiles[4] = {1, 7, 64, 128};
  for (int k = 0; k < 4; k++) {
    CHECK_MSG(rich_hash(w, s, (RichRun){2, ISA_REF, tiles[k], 0, 6, false}) == truth, "tile %u", tiles[k]);
  }
  for (int level = ISA_V2; level <= (int)cpu_best_isa(); level++) {
    CHECK_MSG(rich_hash(w, s, (RichRun){1, (IsaLevel)level, 0, 0, 6, false}) == truth, "level %s",
              isa_names[level]);
  }
  Film *a = rich_film(w, s, (RichRun){1, cpu_best_isa(), 0, 0, 2, false});
  Film *b = rich_film(w, s, (RichRun){1, cpu_best_isa(), 0, 2, 5, false});
  Film *c = rich_film(w, s, (RichRun){1, cpu_best_isa(), 0, 5, 6, false});
  CHECK(film_merge(c, a, NULL) && film_merge(c, b, NULL) && film_hash(c) == truth);
  film_destroy(a);
  film_destroy(b);
  film_destroy(c);
  // Going on where a film stopped is the same as never having stopped.
  Film *f = rich_film(w, s, (RichRun){1, cpu_best_isa(), 0, 0, 2, false});
  RenderJob job = job_of(s, w, pinhole(0, 0.6f, 4, 0, -0.3f, 0, 40), f, 6);
  job.settings.filter = FILTER_BLACKMAN_HARRIS;
  Err err = {0};
  CHECK(!render_run(&job, NULL, hot_table(ISA_REF), NULL, NULL, &err));
  CHECK_TEXT(err.text, "in the film already");
  job.first_sample = 2;
  CHECK(render_run(&job, NULL, hot_table(ISA_REF), NULL, NULL, NULL) && film_hash(f) == truth);
  film_destroy(f);
  job.seed = 2;
  CHECK_MSG(truth == RICH_HASH, "the picture has changed: %#llx", (unsigned long long)truth);
  world_release(w);
  scene_destroy(s);
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
  CHECK(f->ranges.count == 1 && f->ranges.items[0].end == stats.samples);
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
  CHECK(film_noise(f) <= 0.2 && stats.samples < 4096);
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
    hash[k] = rich_hash(w, s, (RichRun){3, cpu_best_isa(), 0, 0, 1, false});
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
