// How many rays a second does one core follow through a scene, of voxels above all? Not a test: a tool to run by hand.
//
//   tool_voxels [-i ISA] [-s WxH] [-r REPEATS] [-m] SCENE...
//
// -m: instead, pictures of the first object's grid with shadows beside the way of NoEucRT, in C: cells of 44 bytes, 1024 equal
// steps between the ends of the box up to the first one that is solid, and from there as many towards the light.
//
// Rays of a camera in blocks of 8 x 8 pixels, from three places around the scene; then rays from what they hit towards one
// light, and from there in all directions. No camera, film or material takes part: what is measured is rf_intersect_n() and
// rf_occluded_n(). Times are the least user time of REPEATS. One line a scene:
//
//   voxels,SCENE,ISA,HIT %,CAMERA Mrays/s,SHADOW Mrays/s,BOUNCE Mrays/s,SUM of all answers
//   marched,SCENE,ISA,HIT %,Mpixels/s,MARCHED Mpixels/s,TIMES as many,PIXELS where one way meets something and the other not %

#include "accel/place.h"
#include "api/api.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

enum { VIEWS = 3 };

static const rf_vec3 LIGHT = {0.4650f, 0.8137f, 0.3487f}; // towards it, of unit length

typedef struct Options {
  int width, height, repeats;
  bool marches;
  const char *isa;
} Options;

typedef struct Rays {
  rf_ray *rays;
  rf_hit *hits;
  uint8_t *blocked;
  size_t count;
} Rays;

static void die(const char *what)
{
  const char *text = "";
  rf_error(NULL, &text);
  fprintf(stderr, "tool_voxels: %s %s\n", what, text);
  exit(70);
}

static double user(void)
{
  struct rusage r;
  getrusage(RUSAGE_SELF, &r);
  return (double)r.ru_utime.tv_sec + 1e-6 * (double)r.ru_utime.tv_usec;
}

static rf_vec3 sum(rf_vec3 a, float s, rf_vec3 b) { return (rf_vec3){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z}; }
static rf_vec3 cross(rf_vec3 a, rf_vec3 b) { return (rf_vec3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
static rf_vec3 unit(rf_vec3 a)
{
  const float l = sqrtf(a.x * a.x + a.y * a.y + a.z * a.z);
  return (rf_vec3){a.x / l, a.y / l, a.z / l};
}

// The scene fills the height of a camera of 40 degrees, seen from somewhat above.
static rf_eye eye_of(const rf_world *w, int view)
{
  static const rf_vec3 from[VIEWS] = {{0.3f, 0.25f, 1}, {1, 0.5f, -0.4f}, {-0.7f, 0.9f, 0.5f}};
  rf_vec3 lo, hi;
  if (!rf_world_bounds(w, &lo, &hi)) die("nothing in the scene");
  const rf_vec3 middle = {0.5f * (lo.x + hi.x), 0.5f * (lo.y + hi.y), 0.5f * (lo.z + hi.z)}, size = sum(hi, -1, lo);
  const float height = fmaxf(size.y, 0.6f * fmaxf(size.x, size.z));
  rf_eye e = {.fov = 0.7f, .focus = 1, .lens = RF_PERSPECTIVE};
  e.frame.z = unit(from[view]);
  e.frame.x = unit(cross((rf_vec3){0, 1, 0}, e.frame.z));
  e.frame.y = cross(e.frame.z, e.frame.x);
  e.frame.p = sum(middle, 0.4f * height / tanf(0.35f) + 0.25f * fmaxf(size.x, size.z), e.frame.z);
  return e;
}

static Rays rays_of(size_t most)
{
  Rays r = {malloc(most * sizeof *r.rays), malloc(most * sizeof *r.hits), malloc(most), 0};
  if (!r.rays || !r.hits || !r.blocked) die("memory");
  return r;
}

static void add_view(Rays *r, const rf_eye *e, const Options *o)
{
  for (int y = 0; y < o->height; y += 8)
    for (int x = 0; x < o->width; x += 8)
      for (int i = 0; i < 64; i++)
        r->rays[r->count++] = rf_eye_ray(e, (float)o->width, (float)o->height, (float)(x + i % 8) + 0.5f, (float)(y + i / 8) + 0.5f);
}

static float random_unit(uint32_t *state)
{
  *state = *state * 1664525u + 1013904223u;
  return (float)(*state >> 8) * 0x1p-24f;
}

// From a little before each hit: to a far light, or anywhere.
static void add_second(const Rays *first, Rays *out, int is_shadow)
{
  uint32_t state = 1;
  for (size_t i = 0; i < first->count; i++) {
    const rf_ray *r = &first->rays[i];
    if (!first->hits[i].object.id) continue;
    const float z = 2 * random_unit(&state) - 1, a = 6.2831853f * random_unit(&state), s = sqrtf(1 - z * z);
    const rf_vec3 way = is_shadow ? LIGHT : (rf_vec3){s * cosf(a), z, s * sinf(a)};
    out->rays[out->count++] = (rf_ray){sum(r->origin, first->hits[i].t * 0.99999f, r->direction), 0, way, INFINITY};
  }
}

// Millions a second. *all: of the answers.
static double measure(const rf_world *w, const Rays *r, int is_shadow, int repeats, double *all, size_t *met)
{
  double best = 1e9;
  for (int i = 0; i < repeats; i++) {
    const double from = user();
    if (is_shadow) rf_occluded_n(w, r->rays, r->blocked, r->count);
    else rf_intersect_n(w, r->rays, r->hits, r->count);
    best = fmin(best, user() - from);
  }
  for (size_t i = 0; i < r->count; i++) {
    const int is_met = is_shadow ? r->blocked[i] : r->hits[i].object.id != 0;
    *met += (size_t)is_met;
    *all += is_met && !is_shadow ? (double)r->hits[i].t + r->hits[i].part % 1009 + (double)(r->hits[i].u + r->hits[i].v) : is_met;
  }
  return 1e-6 * (double)r->count / best;
}

// --- as it was done before ------------------------------------------------------------------------------------------
typedef struct OldCell {
  float position[3], solid[4], smoke[4];
} OldCell;
_Static_assert(sizeof(OldCell) == 44, "as large as the original's");

static OldCell *old_grid(const Voxels *v)
{
  OldCell *cells = calloc((size_t)v->size[0] * (size_t)v->size[1] * (size_t)v->size[2], sizeof *cells), *c = cells;
  if (!cells) die("memory");
  for (int32_t z = 0; z < v->size[2]; z++)
    for (int32_t y = 0; y < v->size[1]; y++)
      for (int32_t x = 0; x < v->size[0]; x++) (c++)->solid[3] = voxels_entry(v, x, y, z) ? 255 : 0;
  return cells;
}

enum { OLD_STEPS = 1024 };

static bool old_steps(const OldCell *cells, const int32_t size[3], Vec3 *p, Vec3 step)
{
  for (int i = 0; i < OLD_STEPS; i++, *p += step) {
    const int32_t x = (int32_t)(*p)[0], y = (int32_t)(*p)[1], z = (int32_t)(*p)[2];
    if ((uint32_t)x >= (uint32_t)size[0] || (uint32_t)y >= (uint32_t)size[1] || (uint32_t)z >= (uint32_t)size[2]) continue;
    if (cells[x + size[0] * (y + size[1] * z)].solid[3] != 0) return true;
  }
  return false;
}

// 0: nothing; 1: something, 2: in shadow.
static uint8_t march(const OldCell *cells, const int32_t size[3], Vec3 o, Vec3 d, Vec3 light)
{
  float from = 0, to = INFINITY;
  for (int k = 0; k < 3; k++) {
    const float a = -o[k] / d[k], b = ((float)size[k] - o[k]) / d[k];
    from = fmaxf(from, fminf(a, b));
    to = fminf(to, fmaxf(a, b));
  }
  Vec3 p = o + from * d;
  if (!(from < to) || !old_steps(cells, size, &p, d * ((to - from) / OLD_STEPS))) return 0;
  p += 2 * light; // out of its own cell
  return old_steps(cells, size, &p, light * ((float)(size[0] + size[1] + size[2]) / (2 * OLD_STEPS))) ? 2 : 1;
}

static double marched_seconds(const Options *o, const Instance *in, Rays *camera)
{
  const Voxels *v = in->voxels->grid;
  const Vec3 light = v3_normalize(frame_vector(&in->object_from_world, v3(LIGHT.x, LIGHT.y, LIGHT.z)));
  OldCell *cells = old_grid(v);
  double best = 1e9;
  for (int r = 0; r < o->repeats; r++) {
    const double from = user();
    for (size_t i = 0; i < camera->count; i++) {
      const rf_ray *ray = &camera->rays[i];
      const Vec3 p = v3(ray->origin.x, ray->origin.y, ray->origin.z), d = v3(ray->direction.x, ray->direction.y, ray->direction.z);
      camera->blocked[i] = march(cells, v->size, frame_point(&in->object_from_world, p), frame_vector(&in->object_from_world, d), light);
    }
    best = fmin(best, user() - from);
  }
  free(cells);
  return best;
}

static void run_marched(const Options *o, const char *path, const rf_world *w, Rays *camera, Rays *shadow)
{
  const Instance *in = accel_instances(w->world->accel);
  if (in->kind != INSTANCE_VOXELS) die("not a grid of voxels first");
  double all = 0;
  size_t met = 0, ignored = 0, differ = 0;
  const double count = (double)camera->count, per_camera = measure(w, camera, 0, o->repeats, &all, &met);
  add_second(camera, shadow, 1);
  const double ours = count / per_camera + (double)shadow->count / measure(w, shadow, 1, o->repeats, &all, &ignored);
  const double marched = 1e6 * marched_seconds(o, in, camera);
  for (size_t i = 0; i < camera->count; i++) differ += (camera->blocked[i] != 0) != (camera->hits[i].object.id != 0);
  printf("marched,%s,%s,%.1f,%.2f,%.3f,%.1f,%.2f\n", path, w->engine->hot->name, 100 * (double)met / count, count / ours,
         count / marched, marched / ours, 100 * (double)differ / count);
}

// --- a scene --------------------------------------------------------------------------------------------------------
static void run_second(const Options *o, const char *path, const rf_world *w, Rays *camera, Rays *shadow, Rays *bounce)
{
  double all = 0;
  size_t met = 0, ignored = 0;
  const double per_camera = measure(w, camera, 0, o->repeats, &all, &met);
  add_second(camera, shadow, 1);
  add_second(camera, bounce, 0);
  const double per_shadow = measure(w, shadow, 1, o->repeats, &all, &ignored);
  const double per_bounce = measure(w, bounce, 0, o->repeats, &all, &ignored);
  printf("voxels,%s,%s,%.1f,%.2f,%.2f,%.2f,%.9g\n", path, w->engine->hot->name, 100 * (double)met / (double)camera->count,
         per_camera, per_shadow, per_bounce, all);
}

static void run(const Options *o, const char *path)
{
  rf_engine_def def = rf_default_engine_def();
  def.threads = 1;
  def.isa = o->isa;
  rf_engine *engine = rf_engine_create(&def);
  rf_scene *scene = engine ? rf_scene_load(engine, path, NULL) : NULL;
  rf_world *w = scene ? rf_prepare(scene, NULL) : NULL;
  if (!w) die(path);
  const size_t most = (size_t)VIEWS * (size_t)o->width * (size_t)o->height;
  Rays camera = rays_of(most), shadow = rays_of(most), bounce = rays_of(most);
  for (int i = 0; i < VIEWS; i++) {
    const rf_eye e = eye_of(w, i);
    add_view(&camera, &e, o);
  }
  if (o->marches) run_marched(o, path, w, &camera, &shadow);
  else run_second(o, path, w, &camera, &shadow, &bounce);
  fflush(stdout);
  for (int i = 0; i < 3; i++) {
    const Rays *r = (const Rays *[]){&camera, &shadow, &bounce}[i];
    free(r->rays);
    free(r->hits);
    free(r->blocked);
  }
  rf_world_destroy(w);
  rf_scene_destroy(scene);
  rf_engine_destroy(engine);
}

int main(int argc, char **argv)
{
  Options o = {.width = 640, .height = 480, .repeats = 5, .isa = "auto"};
  for (int c; (c = getopt(argc, argv, "i:s:r:m")) != -1;) {
    switch (c) {
    case 'i': o.isa = optarg; break;
    case 'm': o.marches = true; break;
    case 'r': o.repeats = atoi(optarg); break;
    case 's':
      if (sscanf(optarg, "%dx%d", &o.width, &o.height) != 2) return 64;
      o.width &= ~7;
      o.height &= ~7;
      break;
    default: return 64;
    }
  }
  if (optind == argc) return 64;
  for (int i = optind; i < argc; i++) run(&o, argv[i]);
  return 0;
}
