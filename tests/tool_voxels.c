// How many rays a second does one core follow through a scene, of voxels above all? Not a test: a tool to run by hand.
//
//   tool_voxels [-i ISA] [-s WxH] [-r REPEATS] SCENE...
//
// Rays of a camera in blocks of 8 x 8 pixels, from three places around the scene; then rays from what they hit towards one
// light, and from there in all directions. No camera, film or material takes part: what is measured is rf_intersect_n() and
// rf_occluded_n(). Times are the least user time of REPEATS. One line a scene:
//
//   voxels,SCENE,ISA,HIT %,CAMERA Mrays/s,SHADOW Mrays/s,BOUNCE Mrays/s,SUM of all answers

#include "rayfold/rayfold.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

enum { VIEWS = 3 };

typedef struct Options {
  int width, height, repeats;
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
    const rf_vec3 way = is_shadow ? unit((rf_vec3){0.4f, 0.7f, 0.3f}) : (rf_vec3){s * cosf(a), z, s * sinf(a)};
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
  double all = 0;
  size_t met = 0, ignored = 0;
  const double per_camera = measure(w, &camera, 0, o->repeats, &all, &met);
  add_second(&camera, &shadow, 1);
  add_second(&camera, &bounce, 0);
  const double per_shadow = measure(w, &shadow, 1, o->repeats, &all, &ignored);
  const double per_bounce = measure(w, &bounce, 0, o->repeats, &all, &ignored);
  printf("voxels,%s,%s,%.1f,%.2f,%.2f,%.2f,%.9g\n", path, rf_engine_isa(engine), 100 * (double)met / (double)camera.count, per_camera,
         per_shadow, per_bounce, all);
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
  for (int c; (c = getopt(argc, argv, "i:s:r:")) != -1;) {
    switch (c) {
    case 'i': o.isa = optarg; break;
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
