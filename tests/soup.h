// Soup: triangles made to be nasty, worlds of many instances of them, and rays that ask for trouble.

#ifndef RAYFOLD_TESTS_SOUP_H
#define RAYFOLD_TESTS_SOUP_H

#include "tests/test.h"

#include "accel/accel.h"
#include "base/hash.h"
#include "base/mem.h"

typedef struct Random {
  uint32_t state;
} Random;

static inline float rnd(Random *r) { return unit_float(hash_u32(r->state++)); }
static inline float rnd_in(Random *r, float lo, float hi) { return lo + (hi - lo) * rnd(r); }
static inline Vec3 rnd_vec(Random *r) { return v3(rnd_in(r, -1, 1), rnd_in(r, -1, 1), rnd_in(r, -1, 1)); }

typedef struct Soup {
  float *positions;
  uint32_t *triangles;
  size_t vertex_count, triangle_count;
} Soup;

static inline Soup soup_create(size_t triangles)
{
  Soup s = {mem_zero(triangles * 9, sizeof(float)), mem_zero(triangles * 3, sizeof(uint32_t)), triangles * 3, triangles};
  for (size_t i = 0; i < s.vertex_count; i++) s.triangles[i] = (uint32_t)i;
  return s;
}

static inline void soup_finish(Soup *s)
{
  mem_free(s->positions);
  mem_free(s->triangles);
}

typedef enum Nasty { RANDOM, NEEDLES, COPLANAR, DUPLICATES, DUST, FAR_AWAY, TINY, DEGENERATE, NASTY_COUNT } Nasty;

static inline Vec3 nasty_vertex(Nasty kind, Random *r, size_t t, int corner, Vec3 middle)
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

static inline Soup nasty_soup(Nasty kind, size_t count)
{
  Soup s = soup_create(count);
  Random r = {1000u * (uint32_t)kind};
  for (size_t t = 0; t < count; t++) {
    const Vec3 middle = rnd_vec(&r);
    for (int k = 0; k < 3; k++) v3_store(s.positions + 9 * t + 3 * k, nasty_vertex(kind, &r, t, k, middle));
  }
  return s;
}

// Long thin triangles in pairs that share a diagonal, across each other and through a floor of two large ones, among
// small things; all of it away from the origin by so much.
static inline Soup boards(size_t count, size_t small_count, Vec3 away)
{
  Soup s = soup_create(2 * count + small_count);
  Random r = {99};
  for (size_t i = 2 * count; i < s.triangle_count; i++) {
    const Vec3 middle = away + rnd_vec(&r);
    for (size_t k = 0; k < 3; k++) v3_store(s.positions + 9 * i + 3 * k, middle + 0.03f * rnd_vec(&r));
  }
  for (size_t i = 0; i < count; i++) {
    const bool is_floor = i == 0;
    const Vec3 middle = away + (is_floor ? v3_all(0) : rnd_vec(&r));
    const Vec3 along = is_floor ? v3(2, 2, 0) : v3(rnd_in(&r, 0.5f, 1), rnd_in(&r, 0.5f, 1), rnd_in(&r, -0.5f, 0.5f));
    const Vec3 across = is_floor ? v3(2, -2, 0) : 0.01f * rnd_vec(&r);
    const Vec3 corners[4] = {middle - along - across, middle + along - across, middle + along + across,
                             middle - along + across};
    const int order[6] = {0, 1, 2, 0, 2, 3};
    for (size_t k = 0; k < 6; k++) v3_store(s.positions + 18 * i + 3 * k, corners[order[k]]);
  }
  return s;
}

static inline MeshTree *soup_tree(const Soup *s, TreeOptions options, Jobs *jobs)
{
  return mesh_tree_build(s->positions, s->vertex_count, s->triangles, s->triangle_count, options, jobs, NULL, NULL);
}

static inline Accel *accel_of(const Soup *s, TreeOptions options, bool many)
{
  MeshTree *tree = soup_tree(s, options, NULL);
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
static inline Ray nasty_ray(const Accel *a, const Soup *s, Random *r, int i)
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

#endif
