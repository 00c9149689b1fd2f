// Tangents: closed cases of MikkTSpace's rules, against the analytic derivative of a sphere, and many random heaps.

#include "tests/test.h"

#include "base/fmath.h"
#include "base/hash.h"
#include "base/mem.h"
#include "geom/tangents.h"

typedef struct Vertex {
  float p[3], n[3], uv[2];
} Vertex;

enum { MOST = 40000 };
static float positions[3 * MOST], normals[3 * MOST], texcoords[2 * MOST];
static uint32_t triangles[6 * MOST];

static Tangents *tangents_of(size_t vertex_count, size_t triangle_count)
{
  const TriangleMesh m = {
      .positions = positions, .normals = normals, .texcoords = {texcoords, NULL}, .triangles = triangles};
  Tangents *t = tangents_make(&m, vertex_count, triangle_count, 0, NULL, NULL, NULL);
  CHECK(t);
  if (!t) exit(1);
  return t;
}

static Tangents *tangents_of_list(const Vertex *v, size_t vertex_count, const uint32_t *index, size_t triangle_count)
{
  for (size_t i = 0; i < vertex_count; i++) {
    memcpy(positions + 3 * i, v[i].p, sizeof v[i].p);
    memcpy(normals + 3 * i, v[i].n, sizeof v[i].n);
    memcpy(texcoords + 2 * i, v[i].uv, sizeof v[i].uv);
  }
  memcpy(triangles, index, 3 * triangle_count * sizeof *index);
  return tangents_of(vertex_count, triangle_count);
}

static bool corner_is(const Tangents *t, size_t corner, float x, float y, float z, float sign)
{
  const float *a = t->tangents + 4 * (size_t)t->of_corner[corner];
  return fabsf(a[0] - x) < 1e-6f && fabsf(a[1] - y) < 1e-6f && fabsf(a[2] - z) < 1e-6f && a[3] == sign;
}

TEST(a_quad_points_along_u)
{
  const Vertex v[] = {{{0, 0, 0}, {0, 0, 1}, {0, 0}},
                      {{2, 0, 0}, {0, 0, 1}, {0, 1}}, // u along y, v along x: mirrored
                      {{2, 2, 0}, {0, 0, 1}, {1, 1}},
                      {{0, 2, 0}, {0, 0, 1}, {1, 0}}};
  const uint32_t index[] = {0, 1, 2, 0, 2, 3};
  Tangents *t = tangents_of_list(v, 4, index, 2);
  CHECK(t->count == 4);
  for (size_t i = 0; i < 6; i++) CHECK(corner_is(t, i, 0, 1, 0, -1));
  tangents_release(t);
}

// Left half uv as they are, right half mirrored about x = 0: the vertices on the seam have two tangents each.
TEST(a_mirrored_seam_splits_its_vertices)
{
  const Vertex v[] = {{{-1, 0, 0}, {0, 0, 1}, {1, 0}}, {{0, 0, 0}, {0, 0, 1}, {0, 0}}, {{1, 0, 0}, {0, 0, 1}, {1, 0}},
                      {{-1, 1, 0}, {0, 0, 1}, {1, 1}}, {{0, 1, 0}, {0, 0, 1}, {0, 1}}, {{1, 1, 0}, {0, 0, 1}, {1, 1}}};
  const uint32_t index[] = {0, 1, 4, 0, 4, 3, 1, 2, 5, 1, 5, 4};
  Tangents *t = tangents_of_list(v, 6, index, 4);
  CHECK(t->count == 8);
  for (size_t i = 0; i < 6; i++) CHECK(corner_is(t, i, -1, 0, 0, -1));
  for (size_t i = 6; i < 12; i++) CHECK(corner_is(t, i, 1, 0, 0, 1));
  tangents_release(t);
}

// A vertex between a triangle with 90 and one with 45 degrees there, whose u lie 90 degrees apart.
TEST(angles_are_weights)
{
  const Vertex v[] = {{{0, 0, 0}, {0, 0, 1}, {0, 0}}, {{1, 0, 0}, {0, 0, 1}, {1, 0}}, {{0, 1, 0}, {0, 0, 1}, {0, 1}},
                      {{-1, 1, 0}, {0, 0, 1}, {-1, 1}}};
  // The second triangle: u grows along -x + ... so that dp/du is (-y) with these coordinates.
  Vertex w[4];
  memcpy(w, v, sizeof v);
  w[3].uv[0] = -1, w[3].uv[1] = 0; // e1 = (0,1) has uv (0,1); e2 = (-1,1) has (-1,0): dp/du = (1,-1)
  const uint32_t index[] = {0, 1, 2, 0, 2, 3};
  Tangents *t = tangents_of_list(w, 4, index, 2);
  const double half = sqrt(0.5), a = 2, b = 1; // angles 90 : 45
  const double x = a + b * half, y = -b * half, length = sqrt(x * x + y * y);
  CHECK(corner_is(t, 0, (float)(x / length), (float)(y / length), 0, 1));
  CHECK(t->of_corner[0] == t->of_corner[3]);
  tangents_release(t);
}

// The same surface with every triangle's corners of its own gives the same: vertices are welded first.
TEST(welded_or_not_a_sphere_has_its_derivative)
{
  enum { AROUND = 96, DOWN = 48 };
  size_t n = 0, vertex_count = 0;
  for (uint32_t y = 0; y <= DOWN; y++)
    for (uint32_t x = 0; x <= AROUND; x++, vertex_count++) {
      const float u = (float)x / AROUND, v = (float)y / DOWN, a = 2 * PI * (x == AROUND ? 0 : u), b = PI * v;
      const float p[3] = {f_sin(b) * f_cos(a), -f_cos(b), -f_sin(b) * f_sin(a)};
      memcpy(positions + 3 * vertex_count, p, sizeof p);
      memcpy(normals + 3 * vertex_count, p, sizeof p);
      texcoords[2 * vertex_count] = u;
      texcoords[2 * vertex_count + 1] = v;
    }
  for (uint32_t y = 0; y < DOWN; y++)
    for (uint32_t x = 0; x < AROUND; x++) {
      const uint32_t a = y * (AROUND + 1) + x, b = a + 1, c = b + AROUND + 1, d = c - 1;
      const uint32_t two[6] = {a, b, c, a, c, d};
      memcpy(triangles + n, two, sizeof two);
      n += 6;
    }
  Tangents *t = tangents_of(vertex_count, n / 3);
  double worst = 1;
  for (size_t i = 0; i < n; i++) {
    const float *p = positions + 3 * (size_t)triangles[i], *q = t->tangents + 4 * (size_t)t->of_corner[i];
    const double around = sqrt((double)(p[0] * p[0] + p[2] * p[2]));
    CHECK(q[3] == 1);
    CHECK_NEAR(p[0] * q[0] + p[1] * q[1] + p[2] * q[2], 0, 1e-5);
    if (around < 0.2) continue; // near the poles the triangles are what they are
    const size_t column = triangles[i] % (AROUND + 1);
    const double along = ((double)p[2] * (double)q[0] - (double)p[0] * (double)q[2]) / around;
    // At the seam a fan is cut in half, and its mean is a little aside.
    if (column != 0 && column != AROUND) worst = fmin(worst, along);
  }
  CHECK_MSG(worst > 0.9999, "%g", worst);
  static float soup[4 * 6 * MOST];
  for (size_t i = 0; i < n; i++) memcpy(soup + 4 * i, t->tangents + 4 * (size_t)t->of_corner[i], 16);
  tangents_release(t);
  if (n <= MOST) {
    static float p[3 * MOST], m[3 * MOST], uv[2 * MOST];
    for (size_t i = 0; i < n; i++) {
      memcpy(p + 3 * i, positions + 3 * (size_t)triangles[i], 12);
      memcpy(m + 3 * i, normals + 3 * (size_t)triangles[i], 12);
      memcpy(uv + 2 * i, texcoords + 2 * (size_t)triangles[i], 8);
    }
    memcpy(positions, p, sizeof p), memcpy(normals, m, sizeof m), memcpy(texcoords, uv, sizeof uv);
    for (size_t i = 0; i < n; i++) triangles[i] = (uint32_t)i;
    t = tangents_of(n, n / 3);
    for (size_t i = 0; i < n; i++)
      for (size_t k = 0; k < 4; k++) CHECK_NEAR(t->tangents[4 * (size_t)t->of_corner[i] + k], soup[4 * i + k], 2e-6);
    tangents_release(t);
  }
}

TEST(heaps_of_anything_give_unit_tangents)
{
  for (uint32_t round = 0; round < 60; round++) {
    const uint32_t vertex_count = 3 + round / 4, triangle_count = 5 + 20 * round;
    for (uint32_t i = 0; i < 3 * vertex_count; i++) {
      positions[i] = (float)(hash_combine(round, i) % 3);
      normals[i] = (float)(hash_combine(round + 100, i) % 3) - 1;
    }
    for (uint32_t i = 0; i < 2 * vertex_count; i++) texcoords[i] = (float)(hash_combine(round + 200, i) % 2);
    for (uint32_t i = 0; i < 3 * triangle_count; i++) triangles[i] = hash_combine(round + 300, i) % vertex_count;
    Tangents *t = tangents_of(vertex_count, triangle_count);
    for (uint32_t i = 0; i < 3 * triangle_count; i++) {
      CHECK(t->of_corner[i] < t->count);
      const float *a = t->tangents + 4 * (size_t)t->of_corner[i];
      CHECK_NEAR(a[0] * a[0] + a[1] * a[1] + a[2] * a[2], 1, 1e-4);
      CHECK(fabsf(a[3]) == 1);
    }
    tangents_release(t);
  }
}

TEST(no_memory_is_said)
{
  const Vertex v[] = {{{0, 0, 0}, {0, 0, 1}, {0, 0}}, {{1, 0, 0}, {0, 0, 1}, {1, 0}}, {{0, 1, 0}, {0, 0, 1}, {0, 1}}};
  const uint32_t index[] = {0, 1, 2};
  tangents_release(tangents_of_list(v, 3, index, 1));
  const TriangleMesh m = {
      .positions = positions, .normals = normals, .texcoords = {texcoords, NULL}, .triangles = triangles};
  for (long n = 1; n < 10; n++) {
    Err err = {0};
    mem_fail_after(n);
    Tangents *t = tangents_make(&m, 3, 1, 0, NULL, NULL, &err);
    mem_fail_after(0);
    CHECK(t || err.kind == ERR_NO_MEMORY);
    tangents_release(t);
  }
}

TEST_MAIN
