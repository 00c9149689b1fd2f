// Distance fields: every primitive and join against its closed form, values as bounds of what is free, rays against dense
// marching, thin sheets, the same answers from every walk and instruction set, leaving without being hit again, and what
// is refused; their meshes and how they are lit.

#include "tests/test.h"

#include "accel/brute.h"
#include "accel/place.h"
#include "geom/offset.h"
#include "geom/sdf_mesh.h"
#include "rayfold/rayfold.h"
#include "render/hot.h"
#include "tests/random.h"
#include "world/world.h"

#include <unistd.h>

static int samples(int n)
{
  const double all = n * test_intensity() / (TEST_IS_SLOW ? 8 : 1);
  return all < 2e9 ? (int)all : 2000000000;
}

// --- scenes -------------------------------------------------------------------------------------------
typedef struct Built {
  Scene *scene;
  World *world;
  const Sdf *sdf; // of the first instance
} Built;

static Scene *scene_of(const char *objects, Err *err)
{
  char path[100];
  snprintf(path, sizeof path, "/tmp/rayfold-fields-%d.json", (int)getpid());
  FILE *f = fopen(path, "w");
  if (!f) return NULL;
  fprintf(f, "{\"rayfold\": 1, \"objects\": [%s]}", objects);
  fclose(f);
  Scene *s = scene_load(path, NULL, err);
  remove(path);
  return s;
}

static Built build(const char *objects)
{
  Err err = {0};
  Built b = {scene_of(objects, &err), NULL, NULL};
  if (b.scene) b.world = world_prepare(b.scene, NULL, NULL, NULL, NULL, &err);
  CHECK_MSG(b.world && accel_instances(b.world->accel)[0].kind == INSTANCE_SDF, "%s: %s", objects, err.text);
  if (b.world) b.sdf = accel_instances(b.world->accel)[0].sdf;
  return b;
}

static void finish(Built *b)
{
  world_release(b->world);
  scene_destroy(b->scene);
}

static double value_at(const Sdf *f, Vec3 p)
{
  const double at[3] = {(double)p[0], (double)p[1], (double)p[2]};
  return sdf_value_at(f, at);
}

#define SHAPE(rest)     "{\"shape\": {\"kind\": " rest "}}"
#define FIELD(rest)     "{\"name\": \"f\", \"shape\": {\"kind\": \"field\" " rest "}}"
#define PART(more, rest) ",{\"part_of\": \"f\", " more " \"shape\": {\"kind\": " rest "}}"
#define BALLS PART("\"translate\": [-0.4, 0, 0],", "\"sphere\", \"radius\": 0.7") PART("\"translate\": [0.5, 0.2, 0],", "\"sphere\", \"radius\": 0.5")

// --- closed forms -------------------------------------------------------------------------------------
static double sq(double x) { return x * x; }
static double len3(double x, double y, double z) { return sqrt(x * x + y * y + z * z); }

// Distance to a segment, and to a convex polygon around the origin in a half-plane x >= 0, by its corners.
static double segment(double x, double y, const double a[2], const double b[2])
{
  const double dx = b[0] - a[0], dy = b[1] - a[1], t = fmin(fmax(((x - a[0]) * dx + (y - a[1]) * dy) / (dx * dx + dy * dy), 0), 1);
  return sqrt(sq(x - a[0] - t * dx) + sq(y - a[1] - t * dy));
}

// Of a solid of revolution: its outline from the axis below to the axis above, anticlockwise.
static double turned(double x, double y, const double (*corner)[2], int count)
{
  double d = INFINITY;
  bool inside = true;
  for (int i = 0; i + 1 < count; i++) {
    const double *a = corner[i], *b = corner[i + 1];
    if (a[0] == b[0] && a[1] == b[1]) continue;
    d = fmin(d, segment(x, y, a, b));
    inside &= (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]) >= 0;
  }
  return inside ? -d : d;
}

static double box_form(Vec3 p, double x, double y, double z)
{
  const double q[3] = {fabs((double)p[0]) - x, fabs((double)p[1]) - y, fabs((double)p[2]) - z};
  const double most = fmax(q[0], fmax(q[1], q[2]));
  return most < 0 ? most : len3(fmax(q[0], 0), fmax(q[1], 0), fmax(q[2], 0));
}

// To the nearest of points of the octahedron's face in the first octant: by steps along both edges, then finer.
static double octahedron_form(Vec3 p, double r)
{
  const double x = fabs((double)p[0]), y = fabs((double)p[1]), z = fabs((double)p[2]), m = x + y + z - r;
  if (m < 0) return m / sqrt(3);
  double best = INFINITY, u0 = 0.5, v0 = 0.5, reach = 0.5;
  for (int round = 0; round < 24; round++, reach *= 0.62) {
    double bu = u0, bv = v0;
    for (int i = -4; i <= 4; i++)
      for (int j = -4; j <= 4; j++) {
        const double u = fmin(fmax(u0 + reach * i / 4, 0), 1), v = fmin(fmax(v0 + reach * j / 4, 0), 1 - u);
        const double d = len3(x - r * u, y - r * v, z - r * (1 - u - v));
        if (d < best) best = d, bu = u, bv = v;
      }
    u0 = bu, v0 = bv;
  }
  return best;
}

enum { FORMS = 11 };
static const char *const form_scenes[FORMS] = {
    SHAPE("\"round_box\", \"size\": [2, 1, 1.5], \"round\": 0.2"),
    SHAPE("\"capsule\", \"radius\": 0.4, \"height\": 1.2"),
    SHAPE("\"octahedron\", \"radius\": 1.1"),
    FIELD("") PART("", "\"sphere\", \"radius\": 0.9"),
    FIELD("") PART("", "\"box\", \"size\": [2, 1, 1.5]"),
    FIELD("") PART("", "\"torus\", \"radius\": 0.9, \"tube_radius\": 0.3"),
    FIELD("") PART("", "\"cylinder\", \"radius\": 0.6, \"height\": 1.4"),
    FIELD("") PART("", "\"cone\", \"radius\": 0.9, \"height\": 1.4"),
    FIELD("") PART("", "\"cone\", \"radius\": 0.3, \"top_radius\": 0.8, \"height\": 1"),
    FIELD("") PART("", "\"plane\""),
    SHAPE("\"formula\", \"formula\": \"q = length(x, z) - 0.9; length(q, y) - 0.3\", \"size\": [4, 4, 4]"),
};

static double form(int i, Vec3 p)
{
  const double x = (double)p[0], y = (double)p[1], z = (double)p[2], across = sqrt(x * x + z * z);
  switch (i) {
  case 0: return box_form(p, 0.8, 0.3, 0.55) - 0.2;
  case 1: return len3(x, y - fmin(fmax(y, -0.6), 0.6), z) - 0.4;
  case 2: return octahedron_form(p, 1.1);
  case 3: return len3(x, y, z) - 0.9;
  case 4: return box_form(p, 1, 0.5, 0.75);
  case 5:
  case 10: return sqrt(sq(across - 0.9) + y * y) - 0.3;
  case 6: return turned(across, y, (const double[][2]){{0, -0.7}, {0.6, -0.7}, {0.6, 0.7}, {0, 0.7}}, 4);
  case 7: return turned(across, y, (const double[][2]){{0, -0.7}, {0.9, -0.7}, {0, 0.7}}, 3);
  case 8: return turned(across, y, (const double[][2]){{0, -0.5}, {0.3, -0.5}, {0.8, 0.5}, {0, 0.5}}, 4);
  default: return z;
  }
}

TEST(primitives_are_their_closed_forms)
{
  for (int i = 0; i < FORMS; i++) {
    Built b = build(form_scenes[i]);
    if (!b.sdf) continue;
    double worst = 0, worst_float = 0;
    const int count = samples(i == 2 ? 4000 : 100000);
    for (int n = 0; n < count; n++) {
      const Vec3 p = rnd_between(0, 1.9f) * rnd_direction();
      const double wanted = form(i, p);
      worst = fmax(worst, fabs(value_at(b.sdf, p) - wanted));
      if (n % 8) continue;
      const wx at[3] = {wx_set(p[0]), wx_set(p[1]), wx_set(p[2])};
      float lanes[WIDEST];
      wx_store(lanes, sdf_run_f(b.sdf, b.sdf->codes, b.sdf->leaves->count, at, NULL));
      worst_float = fmax(worst_float, fabs((double)lanes[0] - wanted));
    }
    CHECK_MSG(worst < (i == 2 ? 1e-4 : 3e-7), "%s: off by %g", form_scenes[i], worst);
    CHECK_MSG(worst_float < (i == 2 ? 1e-4 : 2e-6), "%s: off by %g in floats", form_scenes[i], worst_float);
    finish(&b);
  }
}

// The sponge by the digits of a place, to the base of three.
TEST(the_sponge_is_mengers)
{
  Built b = build(SHAPE("\"menger\", \"size\": 2, \"levels\": 4"));
  int wrong = 0;
  for (int n = 0; n < samples(100000); n++) {
    const Vec3 p = v3(rnd_between(-1, 1), rnd_between(-1, 1), rnd_between(-1, 1));
    double at[3] = {((double)p[0] + 1) / 2, ((double)p[1] + 1) / 2, ((double)p[2] + 1) / 2}, margin = 1;
    bool inside = true;
    for (int level = 0; level < 4; level++) {
      int middles = 0;
      for (int k = 0; k < 3; k++) {
        at[k] = 3 * (at[k] - floor(at[k]));
        middles += at[k] >= 1 && at[k] < 2;
        margin = fmin(margin, fmin(fabs(at[k] - 1), fabs(at[k] - 2)));
      }
      inside &= middles < 2;
    }
    wrong += margin > 1e-4 && inside != (value_at(b.sdf, p) < 0);
  }
  CHECK_MSG(wrong == 0, "%d", wrong);
  finish(&b);
}

// --- joins --------------------------------------------------------------------------------------------
static double smooth_min(double a, double b, double k)
{
  const double h = fmax(k - fabs(a - b), 0) / k;
  return fmin(a, b) - h * h * h * k / 6;
}

static double joined(int operation, double a, double b, double k)
{
  switch (operation) {
  case 0: return k > 0 ? smooth_min(a, b, k) : fmin(a, b);
  case 1: return k > 0 ? -smooth_min(-a, -b, k) : fmax(a, b);
  case 2: return k > 0 ? -smooth_min(-a, b, k) : fmax(a, -b);
  default: return k > 0 ? fmax(a, b) + k * log(1 + exp(-fabs(a - b) / k)) : fmax(a, b);
  }
}

TEST(joins_are_their_closed_forms_and_symmetric)
{
  static const char *const names[] = {"union", "intersection", "difference", "soft_maximum"};
  static const double smooth[] = {0, 0.25, 1};
  for (int i = 0; i < 12; i++) {
    char one[900], other[900];
    const double k = smooth[i % 3];
    snprintf(one, sizeof one, FIELD(", \"operation\": \"%s\", \"smooth\": %g") BALLS, names[i / 3], k);
    snprintf(other, sizeof other, FIELD(", \"operation\": \"%s\", \"smooth\": %g")
             PART("\"translate\": [0.5, 0.2, 0],", "\"sphere\", \"radius\": 0.5") PART("\"translate\": [-0.4, 0, 0],", "\"sphere\", \"radius\": 0.7"),
             names[i / 3], k);
    Built a = build(one), b = build(other);
    double worst = 0, asymmetry = 0;
    for (int n = 0; a.sdf && b.sdf && n < samples(100000); n++) {
      const Vec3 p = rnd_between(0, 2) * rnd_direction();
      const double x = (double)p[0], y = (double)p[1], z = (double)p[2];
      const double first = len3(x + (double)0.4f, y, z) - (double)0.7f, second = len3(x - 0.5, y - (double)0.2f, z) - 0.5;
      const double v = value_at(a.sdf, p);
      worst = fmax(worst, fabs(v - joined(i / 3, first, second, k)));
      asymmetry = fmax(asymmetry, fabs(v - value_at(b.sdf, p)));
    }
    CHECK_MSG(worst < 1e-7, "%s %g: off by %g", names[i / 3], k, worst);
    CHECK_MSG(i / 3 == 2 ? asymmetry > 0.1 : asymmetry == 0, "%s %g: %g", names[i / 3], k, asymmetry);
    finish(&a);
    finish(&b);
  }
}

// --- what is free -------------------------------------------------------------------------------------
static const char *const nasty[] = {
    FIELD(", \"smooth\": 0.3") BALLS,
    FIELD(", \"twist\": 120, \"round\": 0.02") PART("", "\"box\", \"size\": [0.8, 2, 0.8]"),
    FIELD(", \"bend\": 60") PART("", "\"capsule\", \"radius\": 0.2, \"height\": 0.6") PART("\"rotate\": [0, 0, 90],", "\"capsule\", \"radius\": 0.15, \"height\": 2"),
    FIELD(", \"repeat\": [0.5, 0, 0.6], \"copies\": [4, 1, 3]") PART("\"translate\": [0.05, 0, 0],", "\"sphere\", \"radius\": 0.15") PART("\"rotate\": [0, 30, 0],", "\"box\", \"size\": [0.1, 0.5, 0.3]"),
    FIELD(", \"repeat\": 0.5, \"copies\": 3, \"mirrored\": true") PART("\"translate\": [0.1, 0, 0],", "\"octahedron\", \"radius\": 0.25"),
    FIELD(", \"onion\": 0.1, \"operation\": \"difference\", \"smooth\": 0.1") PART("", "\"sphere\"") PART("\"translate\": [0, 1, 0],", "\"box\", \"size\": 1"),
    FIELD(", \"noise\": 0.1, \"noise_size\": 0.3") PART("", "\"sphere\""),
    FIELD(", \"elongate\": [0, 0.3, 0.2], \"operation\": \"intersection\", \"smooth\": 0.2") BALLS,
    FIELD(", \"operation\": \"soft_maximum\", \"smooth\": 0.1") BALLS,
    SHAPE("\"ellipsoid\", \"radius\": [1, 0.3, 0.6]"),
    SHAPE("\"menger\", \"levels\": 3"),
    SHAPE("\"formula\", \"formula\": \"sin(4*x)*sin(4*y)*sin(4*z) + 0.2\""),
    SHAPE("\"formula\", \"formula\": \"a = x; b = y; repeat 3 { a = abs(a*1.5) - 0.5; b = abs(b*1.5) - 0.5; } length(a, b, z*3) - 0.6\""),
    FIELD(", \"smooth\": 0.2") PART("\"rotate\": [20, 30, 40], \"scale\": [1, 0.4, 0.7],", "\"torus\"") PART("\"matrix\": [0.5,0.2,0,0, 0,0.5,0,0, 0,0.3,0.5,0, 0.5,0.6,0,1],", "\"box\", \"size\": 1"),
    SHAPE("\"mandelbulb\", \"radius\": 1.2, \"rounds\": 4"),
};
enum { NASTY = sizeof nasty / sizeof *nasty };

static void cell_values(const Sdf *f, Vec3 p, double *exact, float *seen, float *flat)
{
  const float at[3] = {p[0], p[1], p[2]};
  SdfPlace place;
  sdf_place(f, at, &place);
  *exact = value_at(f, p);
  sdf_values(f, &at, 1, seen);
  *flat = place.leaf ? place.leaf->flat : 0;
}

// Lipschitz: nowhere does the value change by more than its steepness. Then what a ray takes for free is free. In cells,
// by the steepness of the cell for two places in one cell; and shortened tapes give the value of the whole.
TEST(values_bound_what_is_free)
{
  for (int i = 0; i < NASTY; i++) {
    Built b = build(nasty[i]);
    const Sdf *f = b.sdf;
    if (!f) continue;
    const Vec3 size = f->bounds.hi - f->bounds.lo;
    const bool is_estimate = strstr(nasty[i], "mandelbulb");
    double steepest = 0, steepest_in_cell = 0, off = 0;
    int wrong = 0;
    for (int n = 0; n < samples(20000); n++) {
      const Vec3 p = f->bounds.lo + v3(rnd(), rnd(), rnd()) * size;
      const float away = 0.3f * powf(10, -4 * rnd()) * v3_max_lane(size);
      const Vec3 q = v3_max(v3_min(p + away * rnd_direction(), f->bounds.hi), f->bounds.lo);
      double exact, other;
      float seen, flat, other_seen, other_flat;
      cell_values(f, p, &exact, &seen, &flat);
      cell_values(f, q, &other, &other_seen, &other_flat);
      const double apart = (double)v3_length(p - q);
      if (!(apart > 1e-5)) continue;
      steepest = fmax(steepest, (fabs(exact - other) - 1e-7) / apart * (double)f->leaves->flat);
      if (flat > 0) off = fmax(off, fabs((double)seen - exact));
      if (flat == 0) wrong += (double)seen * exact < 0 || fabs((double)seen) > fabs(exact) + 1e-6 + 1e-3 * (double)f->cell;
      const float at[3] = {p[0], p[1], p[2]}, to[3] = {q[0], q[1], q[2]};
      SdfPlace pp, qp;
      sdf_place(f, at, &pp);
      sdf_place(f, to, &qp);
      if (pp.leaf && pp.leaf == qp.leaf && pp.width == qp.width && !memcmp(pp.lo, qp.lo, sizeof pp.lo))
        steepest_in_cell = fmax(steepest_in_cell, (fabs(exact - other) - 1e-7) / apart * (double)pp.leaf->flat);
    }
    CHECK_MSG(is_estimate || steepest <= 1.0001, "%s: %g times as steep", nasty[i], steepest);
    CHECK_MSG(is_estimate || steepest_in_cell <= 1.0001, "%s: %g times as steep in a cell", nasty[i], steepest_in_cell);
    CHECK_MSG(off < (is_estimate ? 1e-3 : 1e-5), "%s: %g off", nasty[i], off);
    CHECK_MSG(is_estimate || wrong == 0, "%s: %d of empty cells", nasty[i], wrong);
    finish(&b);
  }
}

// Where a ray first goes inside, by many small steps in double.
static double march_densely(const Sdf *f, const Ray *r, double from, double to, double step)
{
  double before = from;
  const double side = value_at(f, r->o + (float)from * r->d) < 0 ? -1 : 1;
  while (before < to) {
    double p[4][3];
    Num4 at[3];
    for (int l = 0; l < 4; l++)
      for (int k = 0; k < 3; k++) at[k][l] = p[l][k] = (double)r->o[k] + (before + step * (l + 1)) * (double)r->d[k];
    const Num4 v = sdf_run_d(f, f->codes, f->leaves->count, at, NULL);
    for (int l = 0; l < 4; l++)
      if (v[l] * side < 0) return before + step * (l + 1);
    before += 4 * step;
  }
  return INFINITY;
}

TEST(rays_meet_what_dense_marching_meets)
{
  int met = 0, missed = 0, early = 0, thin = 0;
  RayCounters unused = {0};
  for (int i = 0; i < NASTY; i++) {
    Built b = build(nasty[i]);
    const Sdf *f = b.sdf;
    if (!f) continue;
    const Vec3 middle = (f->bounds.lo + f->bounds.hi) / 2, half = (f->bounds.hi - f->bounds.lo) / 2;
    const double step = (double)f->detail / 2;
    const bool is_estimate = strstr(nasty[i], "mandelbulb"); // of 26 000 rays five go through more, two are stopped before
    for (int n = 0; n < samples(160); n++) {
      const Vec3 d = rnd_direction(), target = middle + 0.8f * half * v3(rnd_between(-1, 1), rnd_between(-1, 1), rnd_between(-1, 1));
      const Ray r = {target - (n % 4 ? 3 * v3_length(half) : 0) * d, d, 0, INFINITY};
      Hit hit;
      const bool found = accel_closest(b.world->accel, &r, RAY_ALL, NULL, NULL, &unused, &hit);
      CHECK(found == accel_any(b.world->accel, &r, RAY_ALL, NULL, NULL, &unused));
      const double from = n % 4 ? 1.9 * (double)v3_length(half) : 0, to = n % 4 ? 4.1 * (double)v3_length(half) : 2.1 * (double)v3_length(half);
      const double wanted = march_densely(f, &r, from, to, step);
      met += wanted < INFINITY;
      if (wanted < INFINITY && !(found && (double)hit.t < wanted + 2 * step)) {
        // Missed: only allowed where the ray is inside for less than the detail.
        const double side = value_at(f, r.o + (float)(wanted - step) * d) < 0 ? -1 : 1;
        double end = wanted;
        while (end < wanted + 4 * step && value_at(f, r.o + (float)end * d) * side < 0) end += step / 4;
        end - wanted < 2 * step || is_estimate ? thin++ : missed++;
      }
      if (found && (double)hit.t < wanted - 2 * step) { // met first: there must be a change of sign
        const double before = value_at(f, r.o + (hit.t * (1 - 1e-5f) - 1e-5f) * d), after = value_at(f, r.o + (hit.t * (1 + 1e-5f) + 1e-5f) * d);
        const double at = value_at(f, r.o + hit.t * d);
        early += !is_estimate && !(before * after <= 0 || fabs(at) < 2 * (double)f->detail);
      }
    }
    finish(&b);
  }
  CHECK_MSG(met > samples(160) * NASTY / 4, "%d", met);
  CHECK_MSG(missed == 0, "%d of %d missed, %d thin ones", missed, met, thin);
  CHECK_MSG(early == 0, "%d of %d where nothing is", early, met);
}

// A sheet as thick as the detail is met by every ray that goes through it; so is one a tenth of that by nearly none less.
TEST(no_sheet_is_too_thin)
{
  RayCounters unused = {0};
  for (int kind = 0; kind < 2; kind++) {
    Built b = build(kind ? FIELD(", \"detail\": 0.001, \"onion\": 0.001") PART("", "\"sphere\"")
                         : FIELD(", \"detail\": 0.001") PART("", "\"box\", \"size\": [2, 2, 0.001]"));
    int missed = 0, met = 0;
    for (int n = 0; b.sdf && n < samples(60000); n++) {
      const Vec3 target = kind ? 0.99f * sqrtf(rnd()) * rnd_direction() : v3(rnd_between(-0.99f, 0.99f), rnd_between(-0.99f, 0.99f), 0);
      const Vec3 d = rnd_direction();
      if (!kind && fabsf(d[2]) < 0.02f) continue; // may leave by the side before it is through
      const Ray r = {target - rnd_between(kind ? 2.1f : 0.1f, 5) * d, d, 0, INFINITY};
      met++;
      missed += !accel_any(b.world->accel, &r, RAY_ALL, NULL, NULL, &unused);
    }
    CHECK_MSG(missed == 0, "%d of %d", missed, met);
    finish(&b);
  }
}

// What leaves goes free, if the field's own values say so: no ray is stopped before it is an ulp or two away.
TEST(nothing_hits_where_it_left)
{
  RayCounters unused = {0};
  int met = 0, again = 0, again_dust = 0, leaked = 0;
  for (int i = 0; i < NASTY; i++) {
    Built b = build(nasty[i]);
    for (int scaled = 0; b.sdf && scaled < 3; scaled++) {
      Instance in = accel_instances(b.world->accel)[0];
      const float scale = scaled == 0 ? 1e-3f : scaled == 1 ? 1 : 1e3f;
      in.world_from_object = frame_around(rnd_direction());
      in.world_from_object.x *= scale;
      in.world_from_object.y *= scale;
      in.world_from_object.z *= scale;
      in.world_from_object.p = 2 * scale * rnd_direction();
      in.object_from_world = frame_inverse(&in.world_from_object);
      in.is_identity = false;
      Accel *a = accel_build(&in, 1, NULL, NULL, NULL);
      const Sdf *f = b.sdf;
      for (int n = 0; n < samples(300); n++) {
        const Vec3 d = rnd_direction(), half = (f->bounds.hi - f->bounds.lo) / 2;
        const Vec3 target = frame_point(&in.world_from_object, (f->bounds.lo + f->bounds.hi) / 2 + 0.7f * half * rnd_direction());
        Ray r = {target - 5 * scale * d, d, 0, INFINITY};
        Hit hit;
        if (!accel_closest(a, &r, RAY_ALL, NULL, NULL, &unused, &hit)) continue;
        const SurfacePoint s = accel_surface(a, NULL, &r, &hit);
        CHECK_NEAR(v3_length(s.ng), 1, 1e-5);
        CHECK_NEAR(v3_dot(s.n, s.tangent), 0, 1e-5);
        const Vec3 w = v3_dot(d, s.ng) < 0 ? v3_reflect(-d, s.ng) : -d;
        r = (Ray){offset_origin(&s, w), w, 0, INFINITY};
        met++;
        const bool found = accel_closest(a, &r, RAY_ALL, NULL, NULL, &unused, &hit);
        const Vec3 back = frame_vector(&in.object_from_world, w * hit.t);
        if (found && v3_length(back) < 1e-5f) strstr(nasty[i], "mandelbulb") ? again_dust++ : again++;
        const Vec3 in_d = -s.ng; // and what goes straight in comes out
        r = (Ray){offset_origin(&s, in_d), in_d, 0, INFINITY};
        leaked += !accel_any(a, &r, RAY_ALL, NULL, NULL, &unused);
      }
      accel_destroy(a);
    }
    finish(&b);
  }
  CHECK_MSG(again == 0, "%d of %d met again", again, met);
  CHECK_MSG(again_dust <= met / 2000, "%d of %d met again", again_dust, met); // the mandelbulb has dust of any size: 24 of 220 000
  CHECK_MSG(leaked == 0, "%d of %d leaked", leaked, met);
  CHECK_MSG(met > samples(300) * NASTY, "%d", met);
}

// --- as triangles -------------------------------------------------------------------------------------
static int compare_edges(const void *a, const void *b)
{
  const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
  return (x > y) - (x < y);
}

// Edges, from corner to corner, that are not there exactly once with exactly one back.
static size_t open_edges(const SdfMesh *m)
{
  const size_t count = m->triangles.count;
  const uint32_t *t = m->triangles.items;
  uint64_t *edges = mem_alloc(count, sizeof *edges);
  size_t open = 0;
  for (size_t i = 0; i < count; i++) edges[i] = (uint64_t)t[i] << 32 | t[i % 3 == 2 ? i - 2 : i + 1];
  qsort(edges, count, sizeof *edges, compare_edges);
  for (size_t i = 0; i < count; i++) {
    const uint64_t back = edges[i] << 32 | edges[i] >> 32;
    open += (i > 0 && edges[i - 1] == edges[i]) || !bsearch(&back, edges, count, sizeof *edges, compare_edges);
  }
  mem_free(edges);
  return open;
}

static double volume_of(const SdfMesh *m) // by the divergence theorem
{
  double six = 0;
  for (size_t i = 0; i < m->triangles.count; i += 3) {
    double p[3][3];
    for (int c = 0; c < 3; c++)
      for (int k = 0; k < 3; k++) p[c][k] = (double)m->vertices.items[m->triangles.items[i + (size_t)c]].p[k];
    six += p[0][0] * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) + p[0][1] * (p[1][2] * p[2][0] - p[1][0] * p[2][2]) +
           p[0][2] * (p[1][0] * p[2][1] - p[1][1] * p[2][0]);
  }
  return six / 6;
}

// Of two melted balls: around the line through their middles it is a solid of revolution, whose radius is where the
// closed form is 0.
static double melted_volume(double apart, double r1, double r2, double k)
{
  enum { SLICES = 2000 };
  const double from = -r1 - k, step = (apart + r1 + r2 + 2 * k) / SLICES;
  double volume = 0;
  for (int i = 0; i < SLICES; i++) {
    const double s = from + (i + 0.5) * step;
    double in = 0, out = 3;
    for (int n = 0; n < 40; n++) {
      const double y = (in + out) / 2;
      *(smooth_min(len3(s, y, 0) - r1, len3(s - apart, y, 0) - r2, k) < 0 ? &in : &out) = y;
    }
    volume += 3.14159265358979 * in * in * step;
  }
  return volume;
}

TEST(the_mesh_of_a_field_is_closed_and_as_large)
{
  static const char *const scenes[] = {FIELD("") PART("", "\"sphere\", \"radius\": 0.9"), FIELD(", \"smooth\": 0.3") BALLS};
  const double wanted[] = {4.0 / 3 * 3.14159265358979 * 0.9 * 0.9 * 0.9, melted_volume(sqrt(0.81 + 0.04), 0.7, 0.5, 0.3)};
  for (int i = 0; i < 2; i++) {
    Built b = build(scenes[i]);
    SdfMesh m = {0};
    Err err = {0};
    CHECK_MSG(b.sdf && sdf_mesh_make(&m, b.sdf, 48, &err), "%s", err.text);
    CHECK_MSG(m.triangles.count > 5000 && open_edges(&m) == 0, "%zu of %zu edges", open_edges(&m), m.triangles.count);
    CHECK_NEAR(volume_of(&m) / wanted[i], 1, 0.01);
    sdf_mesh_finish(&m);
    finish(&b);
  }
}

// --- light --------------------------------------------------------------------------------------------
// What shines 1/2 and scatters 1/2 of the light 1 around it is as bright as that, everywhere: nothing is lost or won by
// starting next to the surface.
TEST(a_field_in_a_furnace_cannot_be_seen)
{
  char path[100];
  snprintf(path, sizeof path, "/tmp/rayfold-furnace-%d.json", (int)getpid());
  FILE *f = fopen(path, "w");
  CHECK(f && fprintf(f, "{\"rayfold\": 1, \"sky\": {\"kind\": \"constant\", \"color\": 1}, \"materials\": {\"f\": {\"kind\": \"pbr\","
                        "\"base_color\": 0.5, \"specular\": 0, \"roughness\": 1, \"emissive\": 0.5}}, \"objects\": ["
                        "{\"name\": \"f\", \"material\": \"f\", \"shape\": {\"kind\": \"field\", \"smooth\": 0.1, \"operation\": \"difference\"}}"
                        PART("", "\"sphere\"") PART("\"translate\": [0, 0.6, 0.8],", "\"sphere\", \"radius\": 0.7") "]}") > 0);
  if (f) fclose(f);
  rf_engine *e = rf_engine_create(NULL);
  rf_scene *s = rf_scene_load(e, path, NULL);
  remove(path);
  rf_world *w = rf_prepare(s, NULL);
  rf_eye eye;
  rf_render_def def = rf_scene_render_def(s, NULL, NULL);
  rf_film *film = rf_film_create(e, 12, 12, RF_BEAUTY);
  rf_image img = {0};
  def.end_sample = 32;
  def.max_depth = def.roulette_depth = 64;
  CHECK(w && rf_camera(s, NULL, NULL, 1, &eye) && rf_render(w, &eye, &def, film, NULL) == RF_OK && rf_film_plane(film, RF_BEAUTY, &img));
  double sum = 0;
  for (int i = 0; i < img.width * img.height; i++)
    for (int k = 0; k < 3; k++) sum += (double)img.pixels[i * img.channels + k] / (3.0 * img.width * img.height);
  CHECK_NEAR(sum, 1, 2e-3);
  rf_image_free(&img);
  rf_film_destroy(film);
  rf_world_destroy(w);
  rf_scene_destroy(s);
  rf_engine_destroy(e);
}

// --- the same from all sides ----------------------------------------------------------------------------
TEST(all_walks_and_levels_agree)
{
  enum { RAYS = 512 };
  static PackedRay rays[RAYS];
  static Hit hits[RAYS], first[RAYS];
  static uint8_t blocked[RAYS];
  for (int i = 0; i < NASTY; i++) {
    Built b = build(nasty[i]);
    if (!b.sdf) continue;
    const Vec3 half = (b.sdf->bounds.hi - b.sdf->bounds.lo) / 2, eye = 4 * v3_length(half) * rnd_direction();
    for (int n = 0; n < RAYS; n++) {
      const Vec3 target = half * v3(rnd_between(-1, 1), rnd_between(-1, 1), rnd_between(-1, 1));
      const Vec3 from = n < RAYS / 2 ? eye : eye + half * rnd_direction();
      const Ray r = {from, v3_normalize(target - from), 0, n % 7 ? INFINITY : 4 * v3_length(half)};
      rays[n] = ray_pack(&r);
    }
    for (int level = ISA_REF; level < ISA_COUNT; level++) {
      const HotTable *t = hot_table((IsaLevel)level);
      if (!t || (IsaLevel)level > cpu_best_isa()) continue;
      memset(hits, 0, sizeof hits);
      t->closest_n(b.world->accel, rays, hits, RAYS);
      t->any_n(b.world->accel, rays, blocked, RAYS);
      if (level == ISA_REF) memcpy(first, hits, sizeof first);
      int differ = 0, differ_single = 0, differ_any = 0;
      for (int n = 0; n < RAYS; n++) {
        Hit one;
        memset(&one, 0, sizeof one);
        t->closest_n(b.world->accel, &rays[n], &one, 1);
        differ += memcmp(&hits[n], &first[n], 20) != 0;
        differ_single += memcmp(&hits[n], &one, 20) != 0;
        differ_any += blocked[n] != (hits[n].instance != NO_HIT);
      }
      CHECK_MSG(!differ && !differ_single && !differ_any, "%s at level %d: %d, %d, %d", nasty[i], level, differ, differ_single, differ_any);
    }
    finish(&b);
  }
}

// --- what is refused --------------------------------------------------------------------------------------
static void check_refused(const char *objects, const char *why)
{
  Err err = {0};
  Scene *s = scene_of(objects, &err);
  World *w = s ? world_prepare(s, NULL, NULL, NULL, NULL, &err) : NULL;
  CHECK(!w);
  CHECK_TEXT(err.text, why);
  world_release(w);
  scene_destroy(s);
}

TEST(what_makes_no_sense_is_refused)
{
  check_refused(FIELD(""), "without parts");
  check_refused(FIELD("") PART("", "\"quad\""), "cannot be part of a field");
  check_refused(FIELD("") PART("", "\"csg\""), "cannot be part of a field");
  check_refused(FIELD("") PART("", "\"cylinder\", \"capped\": false"), "capped");
  check_refused(FIELD(", \"repeat\": 1") PART("", "\"sphere\", \"radius\": 0.6"), "farther apart");
  check_refused(FIELD(", \"twist\": 10") PART("", "\"plane\""), "for ever");
  check_refused(FIELD(", \"smooth\": -1") PART("", "\"sphere\""), "smooth must be at least 0");
  check_refused(SHAPE("\"formula\", \"formula\": \"1/0\""), "column 2: division by zero");
  check_refused(SHAPE("\"formula\", \"formula\": \"repeat 1000 { repeat 1000 { } } x\""), "too many rounds");
  check_refused(SHAPE("\"formula\", \"formula\": \"repeat 1000 { x = x * x; } x\""), "too long");
  check_refused(SHAPE("\"formula\", \"formula\": \"x + system(y)\""), "column 5: there is no function \"system\"");
  check_refused(SHAPE("\"formula\", \"formula\": \"\""), "column 1");
}

// Formulas that divide by zero, overflow and take roots of what has none have some value everywhere, and end.
TEST(formulas_are_harmless)
{
  static const char *const texts[] = {"1 / x", "sqrt(-1 - x*x)", "x / (y - y)", "exp(exp(exp(x*100)))", "mod(x, 0)", "mod(y, z)",
                                      "repeat 20 { x = x*x + 7; } x - x", "sin(1e30 * x)", "noise(1e20*x, y, 1/z)", "atan2(0*x, 0*y)", "smoothmin(x, y, 0)",
                                      "smoothmin(x, y, -1)", "floor(x * 1e9)", "clamp(x, 1, -1)", "(x^16)^16"};
  RayCounters unused = {0};
  for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
    char objects[300];
    snprintf(objects, sizeof objects, SHAPE("\"formula\", \"formula\": \"%s\""), texts[i]);
    Built b = build(objects);
    for (int n = 0; b.sdf && n < 500; n++) {
      const Vec3 p = rnd_between(0, 2) * rnd_direction();
      const float at[3] = {p[0], p[1], p[2]};
      float seen;
      sdf_values(b.sdf, &at, 1, &seen);
      CHECK_MSG(isfinite(seen) && isfinite(value_at(b.sdf, p)), "%s: %g %g", texts[i], (double)seen, value_at(b.sdf, p));
      const Ray r = {3 * rnd_direction(), rnd_direction(), 0, INFINITY};
      Hit hit;
      accel_closest(b.world->accel, &r, RAY_ALL, NULL, NULL, &unused, &hit);
    }
    finish(&b);
  }
}

TEST_MAIN
