// Charts of curved space against its algebra in four dimensions, and that against closed forms.

#include "base/hash.h"
#include "space/isometry.h"
#include "tests/test.h"

static double draw(uint32_t *seed) { return 2 * (double)unit_float(hash_u32(++*seed)) - 1; }

static void draw_axis(uint32_t *seed, double n[3])
{
  double length = 0;
  do {
    for (int k = 0; k < 3; k++) n[k] = draw(seed);
    length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  } while (length > 1 || length < 0.1);
  for (int k = 0; k < 3; k++) n[k] /= length;
}

static Mat4_d draw_move(int kappa, uint32_t *seed)
{
  double n[3];
  draw_axis(seed, n);
  const Mat4_d move = isometry_move(kappa, n, 1.2 * draw(seed));
  draw_axis(seed, n);
  const Mat4_d turn = isometry_turn(n, 3 * draw(seed));
  return isometry_product(&move, &turn);
}

static Vec4_d column(const Mat4_d *m, int j) { return (Vec4_d){{m->m[0][j], m->m[1][j], m->m[2][j], m->m[3][j]}}; }

TEST(moves_turns_and_mirrors_keep_the_product)
{
  uint32_t seed = 1;
  for (int i = 0; i < 300; i++) {
    const int kappa = i % 3 - 1;
    const Mat4_d m = draw_move(kappa, &seed), back = isometry_inverse(kappa, &m), one = isometry_identity();
    const Mat4_d there_and_back = isometry_product(&m, &back);
    CHECK(isometry_distance(&there_and_back, &one) < 1e-13);
    for (int a = 0; a < 3; a++)
      for (int b = 0; b < 3; b++) {
        const Vec4_d x = column(&m, a), y = column(&m, b);
        CHECK_NEAR(dot4_d(kappa, &x, &y), a == b, 1e-13);
      }
    const Vec4_d p = column(&m, 3), n = column(&m, 0), plane = plane_through(kappa, &p, &n);
    const Mat4_d mirror = isometry_mirror(kappa, &plane), twice = isometry_product(&mirror, &mirror);
    CHECK(isometry_distance(&twice, &one) < 1e-11);
    const Vec4_d image = mat4_apply_d(&mirror, &p);
    CHECK(point_distance(kappa, &image, &p) < 1e-7);
  }
}

TEST(orthonormal_again)
{
  uint32_t seed = 2;
  for (int i = 0; i < 90; i++) {
    const int kappa = i % 3 - 1;
    const Mat4_d m = draw_move(kappa, &seed);
    Mat4_d worn = m;
    for (int a = 0; a < 3; a++)
      for (int b = 0; b < 4; b++) worn.m[a][b] += 1e-7 * draw(&seed);
    isometry_mend(kappa, &worn);
    CHECK(isometry_distance(&worn, &m) < 1e-5);
    const Mat4_d back = isometry_inverse(kappa, &worn), one = isometry_identity();
    const Mat4_d product = isometry_product(&worn, &back);
    CHECK(isometry_distance(&product, &one) < 1e-13);
  }
}

TEST(geodesics_go_their_length)
{
  uint32_t seed = 3;
  for (int i = 0; i < 300; i++) {
    const int kappa = i % 3 - 1;
    const Mat4_d m = draw_move(kappa, &seed);
    Geodesic_d g = {column(&m, 3), column(&m, 1)};
    const Vec4_d start = g.p;
    const double length = 1.5 * fabs(draw(&seed)) + 0.01;
    geodesic_go(kappa, length, &g);
    CHECK_NEAR(point_distance(kappa, &start, &g.p), length, 1e-12);
    const Geodesic_d again = geodesic_between(kappa, &start, &g.p);
    const Vec4_d v = column(&m, 1);
    for (int k = 0; k < 4; k++) CHECK_NEAR(again.v.v[k], v.v[k], 1e-11);
  }
}

// What the law of cosines says of right angles: hyperbolic triangles have less than pi, and their area is what lacks.
TEST(angle_sums)
{
  for (int kappa = -1; kappa <= 1; kappa++) {
    const double x[3] = {1, 0, 0}, y[3] = {0, 1, 0}, leg = kappa > 0 ? M_PI / 2 : 2.5;
    const Mat4_d a = isometry_move(kappa, x, leg), b = isometry_move(kappa, y, leg), one = isometry_identity();
    const Vec4_d corner[3] = {column(&one, 3), column(&a, 3), column(&b, 3)};
    double sum = 0;
    for (int i = 0; i < 3; i++) {
      const Geodesic_d left = geodesic_between(kappa, &corner[i], &corner[(i + 1) % 3]);
      const Geodesic_d right = geodesic_between(kappa, &corner[i], &corner[(i + 2) % 3]);
      sum += acos(dot4_d(kappa, &left.v, &right.v));
    }
    // A right triangle with equal legs has tan(angle) = 1 / cosh(leg), 1 / cos(leg), 1.
    const double other = kappa > 0 ? M_PI / 2 : kappa < 0 ? atan(1 / cosh(leg)) : M_PI / 4;
    CHECK_NEAR(sum, M_PI / 2 + 2 * other, 1e-12);
    if (kappa > 0) CHECK_NEAR(sum, 1.5 * M_PI, 1e-12);
    if (kappa < 0) CHECK(sum < M_PI - 1);
  }
}

// Half of the ways from the centre that meet a ball's tangent cone: the share is that of the circle S(r) to S(d), so a
// ball's shadow on a sphere of radius d counts the sphere's area.
TEST(areas_of_spheres)
{
  for (int kappa = -1; kappa <= 1; kappa++) {
    const double n[3] = {1, 0, 0}, distance = 1.1, radius = 0.3;
    const Mat4_d there = isometry_move(kappa, n, distance);
    const Vec4_d centre = column(&there, 3);
    int hits = 0;
    const int count = 400000 / (TEST_IS_SLOW ? 8 : 1);
    for (int i = 0; i < count; i++) {
      const double z = 2 * (i + 0.5) / count - 1, turn = 2.399963229728653 * i, across = sqrt(1 - z * z);
      const Vec4_d v = {{z, across * cos(turn), across * sin(turn), 0}};
      // The nearest place to the ball's centre on the way: where P.C c + V.C s has its extremum.
      const Vec4_d p = {{0, 0, 0, 1}};
      Geodesic_d g = {p, v};
      const double along = dot4_d(kappa, &v, &centre), up = dot4_d(kappa, &p, &centre);
      if (along <= 0) continue;
      geodesic_go(kappa, kappa > 0 ? atan2(along, up) : kappa < 0 ? atanh(-along / up) : along, &g);
      hits += point_distance(kappa, &g.p, &centre) < radius;
    }
    const double s_r = kappa > 0 ? sin(radius) : kappa < 0 ? sinh(radius) : radius;
    const double s_d = kappa > 0 ? sin(distance) : kappa < 0 ? sinh(distance) : distance;
    const double share = 0.5 * (1 - sqrt(1 - s_r * s_r / (s_d * s_d)));
    CHECK_NEAR((double)hits / count / share, 1, 2e-3);
  }
}

// An octant of the sphere walked around: an arrow carried along comes home turned by a right angle (worlds.md, 2.10).
TEST(holonomy_of_an_octant)
{
  Geodesic_d g = {{{0, 0, 0, 1}}, {{1, 0, 0, 0}}};
  Vec4_d arrow = {{0, 0, 1, 0}}, side = {{1, 0, 0, 0}};
  const Vec4_d corners[3] = {{{1, 0, 0, 0}}, {{0, 0, 1, 0}}, {{0, 0, 0, 1}}};
  for (int leg = 0; leg < 3; leg++) {
    g = geodesic_between(1, &g.p, &corners[leg]);
    const double along = dot4_d(1, &arrow, &g.v), across = dot4_d(1, &side, &g.v);
    const Vec4_d a = mix4_d(1, &arrow, -along, &g.v), s = mix4_d(1, &side, -across, &g.v);
    geodesic_go(1, M_PI / 2, &g);
    arrow = mix4_d(1, &a, along, &g.v); // what is across stays as it is
    side = mix4_d(1, &s, across, &g.v);
  }
  CHECK_NEAR(g.p.v[3], 1, 1e-14);
  CHECK_NEAR(fabs(arrow.v[0]), 1, 1e-14);
  CHECK_NEAR(arrow.v[2], 0, 1e-14);
}

// --- the affine chart -----------------------------------------------------------------------------

// A place of the chart within the cell, and a unit vector at it.
static void draw_ray(float kappa, uint32_t *seed, Vec3 *k, Vec3 *v)
{
  double n[3];
  const double rho = 1 / sqrt(fabs((double)kappa));
  draw_axis(seed, n);
  *k = v3((float)n[0], (float)n[1], (float)n[2]) * (float)(0.9 * rho * fabs(draw(seed)));
  draw_axis(seed, n);
  *v = v3((float)n[0], (float)n[1], (float)n[2]);
}

static Geodesic_d lift(float kappa, Vec3 k, Vec3 v)
{
  const int sign = kappa > 0 ? 1 : -1;
  const double root = sqrt(fabs((double)kappa));
  double square = 0, along = 0;
  for (int i = 0; i < 3; i++) square += root * root * (double)(k[i] * k[i]);
  const double w = 1 / sqrt(1 + sign * square);
  Geodesic_d g = {{{root * k[0] * w, root * k[1] * w, root * k[2] * w, w}}, {{v[0], v[1], v[2], 0}}};
  for (int i = 0; i < 3; i++) along += g.p.v[i] * (double)v[i];
  for (int i = 0; i < 3; i++) g.v.v[i] -= sign * along / (1 + w) * g.p.v[i];
  g.v.v[3] = -sign * along;
  return g;
}

TEST(chart_rays_are_geodesics)
{
  uint32_t seed = 4;
  for (int i = 0; i < 3000; i++) {
    const float kappa = (i & 1 ? 1.0f : -1.0f) / (i % 3 ? 1.0f : 49.0f);
    const int sign = kappa > 0 ? 1 : -1;
    const double rho = 1 / sqrt(fabs((double)kappa)), t = (sign > 0 ? 0.6 : 1.0) * rho * (0.01 + fabs(draw(&seed)));
    Vec3 k, v;
    draw_ray(kappa, &seed, &k, &v);
    Geodesic_d g = lift(kappa, k, v);
    geodesic_go(sign, t / rho, &g);
    if (g.p.v[3] < 0.3) continue; // near the end of the chart
    const Vec3 d = v3_normalize(chart_from_local(kappa, k, v));
    const Vec3 back = v3_normalize(chart_to_local(kappa, k, d));
    CHECK(v3_length(back - v) < 2e-6f);
    const float s = chart_along(kappa, k, d, (float)t);
    const Vec3 there = k + s * d;
    const float near = (float)(4e-6 * rho / (g.p.v[3] * g.p.v[3])) + 1e-5f * v3_length(there);
    for (int c = 0; c < 3; c++) CHECK_NEAR(there[c], rho * g.p.v[c] / g.p.v[3], near);
    const ChartLength span = chart_span(kappa, k, d, s);
    CHECK_NEAR(chart_length(kappa, span), t, 2e-5 * (t + rho));
    const double spread = rho * (sign > 0 ? sin(t / rho) : sinh(t / rho));
    CHECK_NEAR(chart_spread(kappa, span), spread, 4e-5 * (spread + rho));
    // The vector arrives as it does in four dimensions.
    const Vec3 at_end = v3_normalize(chart_to_local(kappa, there, d));
    const Geodesic_d end = lift(kappa, there, at_end);
    for (int c = 0; c < 4; c++) CHECK_NEAR(end.v.v[c], g.v.v[c], 1e-4 * (1 + fabs(g.v.v[c])));
  }
}

TEST(flat_charts_are_flat)
{
  const Vec3 k = v3(3, -2, 5), d = v3_normalize(v3(1, 2, -0.5f));
  CHECK(v3_length(chart_from_local(0, k, d) - d) == 0);
  CHECK(v3_length(chart_to_local(0, k, d) - d) == 0);
  CHECK(chart_solid_angle(0, k, v3(0, 1, 0)) == 1);
  CHECK_NEAR(chart_along(0, k, d, 7), 7, 1e-6);
  CHECK_NEAR(chart_length(0, chart_span(0, k, d, 7)), 7, 1e-6);
  CHECK_NEAR(chart_spread(0, chart_span(0, k, d, 7)), 7, 1e-6);
}

// All directions of the chart are all directions: the densities sum to the whole sphere.
TEST(solid_angles_sum)
{
  uint32_t seed = 5;
  for (int kappa = -1; kappa <= 1; kappa += 2) {
    Vec3 k, v;
    draw_ray((float)kappa, &seed, &k, &v);
    k = v3_normalize(k) * 0.6f;
    double sum = 0;
    const int count = 20000;
    for (int i = 0; i < count; i++) {
      const float z = 2 * ((float)i + 0.5f) / (float)count - 1, turn = 2.39996323f * (float)(i % 8192), a = sqrtf(1 - z * z);
      sum += (double)chart_solid_angle((float)kappa, k, v3(a * f_cos(turn), a * f_sin(turn), z));
    }
    CHECK_NEAR(sum / count, 1, 2e-3);
  }
}

// The normal of a plane in the chart is the vector of its covector, and a map takes ray and normal alike.
TEST(normals_and_maps)
{
  uint32_t seed = 6;
  for (int i = 0; i < 500; i++) {
    const int sign = i & 1 ? 1 : -1;
    const float kappa = (float)sign / 9, rho = 3;
    Vec3 k, v;
    draw_ray(kappa, &seed, &k, &v);
    const Geodesic_d g = lift(kappa, k, v); // here v is the normal
    const Vec4_d plane = plane_through(sign, &g.p, &g.v);
    const Vec3 n = v3((float)plane.v[0], (float)plane.v[1], (float)plane.v[2]);
    CHECK(v3_length(chart_normal(kappa, k, n) - v) < 2e-5f);
    const Mat4_d m = draw_move(sign, &seed);
    Mat4_f mf;
    for (int a = 0; a < 4; a++)
      for (int b = 0; b < 4; b++) mf.m[a][b] = (float)m.m[a][b];
    const Geodesic_d there = {mat4_apply_d(&m, &g.p), mat4_apply_d(&m, &g.v)};
    if (there.p.v[3] < 0.3) continue;
    chart_map(kappa, &mf, &k, &v);
    for (int c = 0; c < 3; c++) CHECK_NEAR(k[c], (double)rho * there.p.v[c] / there.p.v[3], 1e-4 * (1 + fabs((double)k[c])));
    const Geodesic_d end = lift(kappa, k, v);
    for (int c = 0; c < 4; c++) CHECK_NEAR(end.v.v[c], there.v.v[c], 4e-4 * (1 + fabs(there.v.v[c])));
  }
}

// Weights of corners do not change when the chart is centred elsewhere; the chart's own do.
TEST(weights_are_the_same_from_everywhere)
{
  uint32_t seed = 7;
  for (int i = 0; i < 200; i++) {
    const int sign = i & 1 ? 1 : -1;
    const float kappa = (float)sign;
    Vec3 a[3], b[3], v;
    for (int c = 0; c < 3; c++) draw_ray(kappa, &seed, &a[c], &v);
    for (int c = 0; c < 3; c++) a[c] = a[c] * 0.5f;
    double n[3];
    draw_axis(&seed, n);
    const Mat4_d m = isometry_move(sign, n, 0.4);
    Mat4_f mf;
    for (int r = 0; r < 4; r++)
      for (int c = 0; c < 4; c++) mf.m[r][c] = (float)m.m[r][c];
    float here[3] = {0.2f, 0.5f, 0.3f}, there[3];
    Vec3 p = here[0] * a[0] + here[1] * a[1] + here[2] * a[2];
    v = v3(1, 0, 0);
    Vec3 unused = v;
    chart_map(kappa, &mf, &p, &unused);
    for (int c = 0; c < 3; c++) {
      b[c] = a[c];
      unused = v;
      chart_map(kappa, &mf, &b[c], &unused);
    }
    const Vec3 normal = v3_cross(b[1] - b[0], b[2] - b[0]);
    const float area = v3_dot(normal, normal);
    if (area < 1e-3f) continue;
    there[0] = v3_dot(normal, v3_cross(b[1] - p, b[2] - p)) / area;
    there[1] = v3_dot(normal, v3_cross(b[2] - p, b[0] - p)) / area;
    there[2] = 1 - there[0] - there[1];
    chart_weights(kappa, a, here);
    chart_weights(kappa, b, there);
    for (int c = 0; c < 3; c++) CHECK_NEAR(here[c], there[c], 2e-3);
  }
}

TEST_MAIN
