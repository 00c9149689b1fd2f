// Objects in curved cells: distances, planes and balls are what they were before they were moved.

#include "base/hash.h"
#include "tests/test.h"
#include "world/bend.h"

static float draw(uint32_t *seed) { return 2 * unit_float(hash_u32(++*seed)) - 1; }

static Frame draw_pose(uint32_t *seed, float far)
{
  Frame f = frame_around(v3_normalize(v3(draw(seed), draw(seed), draw(seed) + 0.01f)));
  f.p = far * v3(draw(seed), draw(seed), draw(seed));
  return f;
}

static double distance(float kappa, Vec3 a, Vec3 b)
{
  const Vec3 d = b - a;
  const float s = v3_length(d);
  return s > 0 ? (double)chart_length(kappa, chart_span(kappa, a, d / s, s)) : 0;
}

TEST(distances_stay)
{
  uint32_t seed = 1;
  for (int i = 0; i < 400; i++) {
    const float kappa = i & 1 ? 0.25f : -0.25f;
    const Frame pose = draw_pose(&seed, 1);
    Bend b;
    CHECK(bend_at(kappa, &pose, &b));
    const Vec3 p = 0.8f * v3(draw(&seed), draw(&seed), draw(&seed)), q = 0.8f * v3(draw(&seed), draw(&seed), draw(&seed));
    Vec3 p2, q2;
    if (!bend_point(&b, p, &p2) || !bend_point(&b, q, &q2)) continue;
    CHECK_NEAR(distance(kappa, p2, q2), distance(kappa, p, q), 4e-5);
  }
  Bend b;
  const Frame far = {v3(1, 0, 0), v3(0, 1, 0), v3(0, 0, 1), v3(3, 0, 0)};
  CHECK(!bend_at(-0.25f, &far, &b)); // beyond the end of the chart, at 2
}

// A point is on the ellipsoid exactly when it is at the ball's radius from its centre.
TEST(balls_are_ellipsoids)
{
  uint32_t seed = 2;
  int count = 0;
  for (int i = 0; i < 400; i++) {
    const float kappa = i & 1 ? 1.0f : -1.0f, radius = 0.05f + 0.4f * unit_float(hash_u32(++seed));
    const Frame pose = draw_pose(&seed, 0.5f);
    Bend b;
    Frame f;
    const Vec3 own = 0.2f * v3(draw(&seed), draw(&seed), draw(&seed));
    Vec3 centre;
    if (!bend_at(kappa, &pose, &b) || !bend_sphere(&b, own, radius, &f)) continue;
    CHECK(bend_point(&b, own, &centre));
    count++;
    for (int k = 0; k < 20; k++) {
      const Vec3 on = frame_point(&f, v3_normalize(v3(draw(&seed), draw(&seed), draw(&seed))));
      CHECK_NEAR(distance(kappa, centre, on), radius, 2e-5);
    }
  }
  CHECK(count > 300);
}

// Flat stays flat, and normals stay normal to it.
TEST(planes_stay_planes)
{
  uint32_t seed = 3;
  const Frame own = {v3(1, 0, 0), v3(0, -1, 0), v3(0, 0, 1), v3(0.1f, 0, 0.2f)}; // mirrors
  for (int i = 0; i < 50; i++) {
    const float kappa = i & 1 ? 1.0f : -1.0f;
    const Frame pose = draw_pose(&seed, 0.4f);
    Bend b;
    CHECK(bend_at(kappa, &pose, &b));
    MeshData *disk = bend_disk(0.3f);
    disk->normals = calloc(disk->vertex_count, 3 * sizeof(float));
    for (size_t v = 0; v < disk->vertex_count; v++) disk->normals[3 * v + 2] = 1;
    Err err = {0};
    MeshData *m = bend_mesh(&b, disk, &own, &err);
    CHECK(m != NULL);
    Vec3 p[3];
    for (int k = 0; k < 3; k++) p[k] = v3_load(m->positions + 3 * m->triangles[k]);
    const Vec3 n = v3_normalize(v3_cross(p[1] - p[0], p[2] - p[0]));
    for (size_t v = 0; v < m->vertex_count; v++) {
      CHECK_NEAR(v3_dot(n, v3_load(m->positions + 3 * v) - p[0]), 0, 2e-6);
      CHECK_NEAR(v3_dot(n, v3_load(m->normals + 3 * v)), 1, 1e-5); // winding and normal agree in spite of the mirror
    }
    mesh_data_release(m);
    mesh_data_release(disk);
  }
}

// A lamp of triangles is as far from its middle as it says, and faces outward.
TEST(balls_of_triangles)
{
  for (int kappa = -1; kappa <= 1; kappa += 2) {
    MeshData *m = bend_ball((float)kappa, 0.5f);
    for (size_t t = 0; t < m->triangle_count; t++) {
      Vec3 p[3];
      for (int k = 0; k < 3; k++) p[k] = v3_load(m->positions + 3 * m->triangles[3 * t + (size_t)k]);
      CHECK(v3_dot(v3_cross(p[1] - p[0], p[2] - p[0]), p[0] + p[1] + p[2]) > -1e-7f);
      CHECK_NEAR(distance((float)kappa, v3_all(0), p[1]), 0.5, 1e-5);
    }
    mesh_data_release(m);
  }
}

TEST_MAIN
