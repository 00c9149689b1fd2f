// The tree against testing everything, bit by bit, over scenes made to be nasty; closed meshes have no holes; things
// that are broken hit nothing and break nothing.

#include "tests/test.h"

#include "accel/brute.h"
#include "accel/traverse.h"
#include "base/hash.h"
#include "base/mem.h"
#include "geom/offset.h"
#include "geom/surface.h"

typedef struct Random {
  uint32_t state;
} Random;

static float rnd(Random *r) { return unit_float(hash_u32(r->state++)); }
static float rnd_in(Random *r, float lo, float hi) { return lo + (hi - lo) * rnd(r); }
static Vec3 rnd_vec(Random *r) { return v3(rnd_in(r, -1, 1), rnd_in(r, -1, 1), rnd_in(r, -1, 1)); }

typedef struct Soup {
  float *positions;
  uint32_t *triangles;
  size_t vertex_count, triangle_count;
} Soup;

static Soup soup_create(size_t triangles)
{
  Soup s = {mem_zero(triangles * 9, sizeof(float)), mem_zero(triangles * 3, sizeof(uint32_t)), triangles * 3, triangles};
  for (size_t i = 0; i < s.vertex_count; i++) s.triangles[i] = (uint32_t)i;
  return s;
}

static void soup_finish(Soup *s)
{
  mem_free(s->positions);
  mem_free(s->triangles);
}

typedef enum Nasty { RANDOM, NEEDLES, COPLANAR, DUPLICATES, DUST, FAR_AWAY, TINY, DEGENERATE, NASTY_COUNT } Nasty;

static Vec3 nasty_vertex(Nasty kind, Random *r, size_t t, int corner, Vec3 middle)
{
  switch (kind) {
  case RANDOM: return middle + 0.1f * rnd_vec(r);
  case NEEDLES: return middle + rnd_vec(r) * v3(corner == 2 ? 1.5f : 1e-4f, 1e-4f, 1e-4f);
  case COPLANAR: return v3((float)(t % 20) + (float)(corner == 1), (float)(t / 20 % 20) + (float)(corner == 2), 0) / 10;
  case DUPLICATES: return v3((float)(corner == 1), (float)(corner == 2), (float)(t % 3));
  case DUST: return t == 0 ? 3 * v3((float)(corner == 1), (float)(corner == 2), 0.1f) : middle + 1e-3f * rnd_vec(r);
  case FAR_AWAY: return v3(148376, 1234, -223423) + middle * 10 + rnd_vec(r);
  case TINY: return 1e-6f * (middle + 0.2f * rnd_vec(r));
  case DEGENERATE: return corner == 2 && t % 2 ? middle : middle + (t % 5 ? 0.2f : 1e-30f) * rnd_vec(r);
  case NASTY_COUNT: break;
  }
  return v3_all(0);
}

static Soup nasty_soup(Nasty kind, size_t count)
{
  Soup s = soup_create(count);
  Random r = {1000u * (uint32_t)kind};
  for (size_t t = 0; t < count; t++) {
    const Vec3 middle = rnd_vec(&r);
    for (int k = 0; k < 3; k++) v3_store(s.positions + 9 * t + 3 * k, nasty_vertex(kind, &r, t, k, middle));
  }
  return s;
}

static Accel *accel_of(const Soup *s, bool many)
{
  MeshTree *tree = mesh_tree_build(s->positions, s->vertex_count, s->triangles, s->triangle_count, NULL, NULL, NULL);
  CHECK(tree != NULL);
  Instance instances[12] = {0};
  Random r = {77};
  const int count = many ? 12 : 1;
  for (int i = 0; i < count; i++) {
    Frame f = frame_identity();
    if (i > 0) f = (Frame){rnd_vec(&r), rnd_vec(&r), rnd_vec(&r), 2 * rnd_vec(&r)}; // sheared, scaled, mirrored
    instances[i] = (Instance){.world_from_object = f, .object_from_world = frame_inverse(&f), .mesh = tree,
                              .size = {0.4f, 0.3f}, .kind = (uint8_t)(i < 6 ? INSTANCE_MESH : INSTANCE_SPHERE + i % 3),
                              .mask = RAY_ALL, .is_identity = i == 0};
  }
  Accel *a = accel_build(instances, (size_t)count, NULL, NULL, NULL);
  CHECK(a != NULL);
  mesh_tree_release(tree);
  return a;
}

// Towards the scene from outside and inside, along axes, from vertices, with zeros in the direction.
static Ray nasty_ray(const Accel *a, const Soup *s, Random *r, int i)
{
  float lo[3], hi[3];
  accel_bounds(a, lo, hi);
  const Vec3 l = v3_load(lo), extent = v3_load(hi) - l;
  const Vec3 size = v3_max(extent, v3_all(0.1f * v3_max_lane(extent))); // a flat scene is looked at from outside
  Vec3 o = l + size * (0.5f * rnd_vec(r) + v3_all(0.5f)), to = l + size * (0.5f * rnd_vec(r) + v3_all(0.5f));
  if (i % 3 == 0) o += 2 * size * rnd_vec(r);
  if (i % 5 == 0) to = v3_load(s->positions + 3 * (hash_u32((uint32_t)i) % s->vertex_count));
  if (i % 7 == 0) o = v3_load(s->positions + 3 * (hash_u32((uint32_t)i + 9) % s->vertex_count));
  Vec3 d = to - o;
  if (i % 11 == 0) d = v3(0, d[1], d[2]);
  if (i % 13 == 0) d = v3(0, 0, i % 2 ? 1 : -1);
  return (Ray){o, d, 0, i % 4 ? INFINITY : rnd(r) * 2};
}

// G2, G3: same primitive, t, u, v to the last bit; any-hit says the same.
TEST(the_tree_equals_brute_force)
{
  for (int kind = 0; kind < 2 * NASTY_COUNT; kind++) {
    const bool many = kind >= NASTY_COUNT;
    Soup s = nasty_soup((Nasty)(kind % NASTY_COUNT), many ? 150 : 600);
    Accel *a = accel_of(&s, many);
    Random r = {5u + (uint32_t)kind};
    int hits = 0, wrong = 0;
    for (int i = 0; i < 4000; i++) {
      RayCounters c = {0};
      const Ray ray = nasty_ray(a, &s, &r, i);
      Hit tree, brute;
      const bool hit = accel_closest(a, &ray, RAY_ALL, NULL, NULL, &c, &tree);
      const bool expected = accel_closest_brute(a, &ray, RAY_ALL, NULL, NULL, &c, &brute);
      const bool any = accel_any(a, &ray, RAY_ALL, NULL, NULL, &c);
      wrong += hit != expected || any != expected;
      wrong += expected && (tree.instance != brute.instance || tree.prim != brute.prim || memcmp(&tree.t, &brute.t, 4) ||
                            memcmp(&tree.u, &brute.u, 4) || memcmp(&tree.v, &brute.v, 4));
      hits += expected;
    }
    CHECK_MSG(wrong == 0, "scene %d: %d of %d hits differ", kind, wrong, hits);
    if (kind != TINY + NASTY_COUNT) CHECK_MSG(hits > 20, "scene %d: only %d hits", kind, hits);
    accel_destroy(a);
    soup_finish(&s);
  }
}

static Soup ball(int around, int down, float radius, Vec3 centre)
{
  const size_t rows = (size_t)down + 1, columns = (size_t)around;
  Soup s = {mem_zero(rows * columns * 3, sizeof(float)), mem_zero(2 * columns * (size_t)down * 3, sizeof(uint32_t)),
            rows * columns, 0};
  for (int j = 0; j <= down; j++)
    for (int i = 0; i < around; i++) {
      const double theta = 3.14159265358979 * j / down, phi = 2 * 3.14159265358979 * i / around;
      const Vec3 n = v3((float)(sin(theta) * cos(phi)), (float)cos(theta), (float)(sin(theta) * sin(phi)));
      const bool pole = j == 0 || j == down; // all corners of a pole must be one point
      v3_store(s.positions + 3 * ((size_t)j * columns + (size_t)i), centre + radius * (pole ? v3(0, n[1], 0) : n));
    }
  for (size_t j = 0; j < (size_t)down; j++)
    for (size_t i = 0; i < columns; i++) {
      const uint32_t p = (uint32_t)(j * columns + i), q = (uint32_t)(j * columns + (i + 1) % columns);
      const uint32_t six[6] = {p, q, p + (uint32_t)columns, q, q + (uint32_t)columns, p + (uint32_t)columns};
      memcpy(s.triangles + 3 * s.triangle_count, six, sizeof six);
      s.triangle_count += 2;
    }
  return s;
}

// G1: rays from inside at vertices and points of edges never escape, at any scale and far from the origin.
TEST(a_closed_mesh_has_no_holes)
{
  const Vec3 centres[] = {v3(0, 0, 0), v3(1000, 37, -2000), v3(148376, 1234, -223423)};
  const float radii[] = {2, 2, 2, 1e-6f, 1e6f};
  for (int k = 0; k < 5; k++) {
    const Vec3 centre = k < 3 ? centres[k] : v3_all(0);
    Soup s = ball(100, 50, radii[k], centre);
    Accel *a = accel_of(&s, false);
    Random r = {31u + (uint32_t)k};
    int missed = 0;
    for (int i = 0; i < 40000; i++) {
      const uint32_t *t = s.triangles + 3 * (hash_u32((uint32_t)i) % s.triangle_count);
      const Vec3 p = v3_load(s.positions + 3 * (size_t)t[0]), q = v3_load(s.positions + 3 * (size_t)t[1]);
      const Vec3 o = centre + 0.3f * radii[k] * rnd_vec(&r), to = i % 4 ? v3_mix(p, q, rnd(&r)) : p;
      const Ray ray = {o, to - o, 0, INFINITY};
      RayCounters c = {0};
      Hit hit;
      missed += !accel_closest(a, &ray, RAY_ALL, NULL, NULL, &c, &hit);
    }
    CHECK_MSG(missed == 0, "ball %d: %d of 40000 rays escaped", k, missed);
    accel_destroy(a);
    soup_finish(&s);
  }
}

// G8: a broken ray hits nothing, and soon.
TEST(broken_rays_hit_nothing)
{
  Soup s = nasty_soup(RANDOM, 500);
  Accel *a = accel_of(&s, true);
  const float odd[] = {NAN, INFINITY, -INFINITY, 0};
  for (int i = 0; i < 4; i++)
    for (int k = 0; k < 7; k++) {
      Ray ray = {v3(0.1f, 0.2f, 3), v3(0, 0, -1), 0, INFINITY};
      if (k < 3) ray.o[k] = odd[i];
      else if (k < 6) ray.d[k - 3] = odd[i];
      else ray.d = v3_all(0);
      const bool is_broken = !v3_is_finite(ray.o) || !v3_is_finite(ray.d) || v3_is_zero(ray.d);
      RayCounters c = {0};
      Hit hit;
      const bool found = accel_closest(a, &ray, RAY_ALL, NULL, NULL, &c, &hit);
      CHECK(!is_broken || !found);
      CHECK(c.nodes + c.prims < 10000);
    }
  accel_destroy(a);
  soup_finish(&s);
}

TEST(threads_build_the_same_tree_and_failures_are_clean)
{
  Soup s = nasty_soup(RANDOM, 20000);
  Jobs *jobs = jobs_create(3, NULL);
  MeshTree *one = mesh_tree_build(s.positions, s.vertex_count, s.triangles, s.triangle_count, NULL, NULL, NULL);
  MeshTree *three = mesh_tree_build(s.positions, s.vertex_count, s.triangles, s.triangle_count, jobs, NULL, NULL);
  CHECK(one && three && one->node_count == three->node_count && one->block_count == three->block_count);
  CHECK(!memcmp(one->nodes, three->nodes, one->node_count * sizeof *one->nodes));
  mesh_tree_release(one);
  mesh_tree_release(three);
  for (long n = 1; n < 200; n++) {
    Err err = {0};
    mem_fail_after(n);
    MeshTree *t = mesh_tree_build(s.positions, s.vertex_count, s.triangles, 300, NULL, NULL, &err);
    mem_fail_after(0);
    mesh_tree_release(t);
    if (t) break;
    CHECK(err.kind == ERR_NO_MEMORY);
  }
  MeshTree *empty = mesh_tree_build(s.positions, s.vertex_count, s.triangles, 0, NULL, NULL, NULL);
  CHECK(empty != NULL);
  mesh_tree_release(empty);
  jobs_destroy(jobs);
  soup_finish(&s);
}

TEST_MAIN
