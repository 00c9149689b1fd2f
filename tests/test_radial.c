// Bubbles, wormholes and black holes: closed forms and tables against geodesics integrated step by step.

#include "base/hash.h"
#include "space/isometry.h"
#include "space/radial.h"
#include "tests/test.h"

// --- bubbles --------------------------------------------------------------------------------------

// The same way in four dimensions, in the ball around (0, 0, 0, 1): in at one point of the sphere, out at the other.
static void walk_ball(int kappa, double r, double alpha, double *angle, double *length)
{
  const double x[3] = {1, 0, 0};
  const Mat4_d there = isometry_move(kappa, x, r);
  Geodesic_d g = {{{there.m[0][3], 0, 0, there.m[3][3]}}, {{0}}};
  for (int k = 0; k < 4; k++) g.v.v[k] = -cos(alpha) * there.m[k][0];
  g.v.v[1] = sin(alpha);
  // P c + V s is at r again when its w is P's: w (c - 1) = -Vw s, so the half length has tan (tanh) -+ Vw / w.
  const double w = g.p.v[3], vw = g.v.v[3];
  *length = 2 * (kappa > 0 ? atan2(vw, w) : kappa < 0 ? atanh(-vw / w) : r * cos(alpha));
  geodesic_go(kappa, *length, &g);
  *angle = atan2(g.p.v[1], g.p.v[0]);
}

TEST(bubbles_are_walks)
{
  double worst = 0;
  for (int kappa = -1; kappa <= 1; kappa++)
    for (int i = 1; i < 40; i++)
      for (int j = 1; j < 40; j++) {
        const double r = i * 0.075, alpha = j * 0.0385;
        double angle, length;
        walk_ball(kappa, r, alpha, &angle, &length);
        if (angle < 0) angle += 2 * M_PI;
        const float c = (float)cos(alpha), s = (float)sin(alpha);
        CHECK_NEAR(bubble_angle((float)kappa, (float)r, s, c), angle, 1e-5);
        CHECK_NEAR(bubble_length((float)kappa, (float)r, c), length, 2e-5);
        // The form itself, in double: 2 atan2(1, C tan alpha).
        const double form = 2 * atan2(1, (kappa > 0 ? cos(r) : kappa < 0 ? cosh(r) : 1) * tan(alpha));
        worst = fmax(worst, fabs(form - angle));
      }
  CHECK_MSG(worst < 1e-12, "%g", worst);
}

TEST(bigger_inside)
{
  // A ball of 2.8 radii of curvature: a small door and 124 times the room (worlds.md, section 2.7).
  const double r = 2.8, outside = sin(r), inside = M_PI * (2 * r - sin(2 * r));
  CHECK_NEAR(outside, 0.335, 5e-4);
  CHECK_NEAR(inside / (4 * M_PI / 3 * outside * outside * outside), 124, 0.5);
}

// --- wormholes ------------------------------------------------------------------------------------

typedef struct Throat {
  double throat, half_length, lensing;
} Throat;

static void throat_f(const Throat *w, double r, double *f, double *slope)
{
  if (w->lensing == 0) {
    *f = sqrt(r * r + w->throat * w->throat);
    *slope = r / *f;
    return;
  }
  const double over = fmax(fabs(r) - w->half_length, 0), x = 2 * over / (M_PI * w->lensing);
  *f = w->throat + w->lensing * (x * atan(x) - 0.5 * log(1 + x * x));
  *slope = copysign(2 / M_PI * atan(x), r);
}

typedef struct Motion {
  double r, angle, dr, da;
} Motion;

// The geodesic of dr^2 + f^2 d angle^2: r'' = f f' angle'^2, angle'' = -2 f'/f r' angle'.
static Motion motion_rate(const Throat *w, const Motion *m)
{
  double f, slope;
  throat_f(w, m->r, &f, &slope);
  return (Motion){m->dr, m->da, f * slope * m->da * m->da, -2 * slope / f * m->dr * m->da};
}

static Motion motion_add(const Motion *m, const Motion *rate, double s)
{
  return (Motion){m->r + s * rate->r, m->angle + s * rate->angle, m->dr + s * rate->dr, m->da + s * rate->da};
}

static void motion_step(const Throat *w, double step, Motion *m)
{
  const Motion k1 = motion_rate(w, m), m2 = motion_add(m, &k1, step / 2), k2 = motion_rate(w, &m2);
  const Motion m3 = motion_add(m, &k2, step / 2), k3 = motion_rate(w, &m3), m4 = motion_add(m, &k3, step);
  const Motion k4 = motion_rate(w, &m4);
  *m = motion_add(m, &k1, step / 6);
  *m = motion_add(m, &k2, step / 3);
  *m = motion_add(m, &k3, step / 3);
  *m = motion_add(m, &k4, step / 6);
}

static RadialWay throat_walk(const Throat *w, double radius, double reach, double h, double *drift)
{
  Motion m = {reach, 0, -sqrt(1 - h * h / (radius * radius)), h / (radius * radius)}, before = m;
  double left = 1;
  for (int i = 0; i < 400000; i++) {
    before = m;
    motion_step(w, 1e-3, &m);
    if (fabs(m.r) > reach && (i > 2 || m.r < 0)) break;
  }
  left = (reach - fabs(before.r)) / (fabs(m.r) - fabs(before.r));
  double f, slope;
  throat_f(w, m.r, &f, &slope);
  *drift = fmax(*drift, fabs(f * f * m.da - h));
  return (RadialWay){(float)(before.angle + left * (m.angle - before.angle)), m.r < 0};
}

static void check_wormhole(const Throat *w, float radius, double reach, const Radial *table)
{
  double worst = 0, drift = 0;
  for (int i = 1; i < 60; i++) {
    const double h = (double)radius * i / 60.0;
    if (fabs(h - w->throat) < 0.01) continue; // where the way winds for ever
    const RadialWay way = radial_way(table, (float)h), walk = throat_walk(w, (double)radius, reach, h, &drift);
    CHECK(way.is_passed == walk.is_passed);
    worst = fmax(worst, (double)fabsf(way.angle - walk.angle));
  }
  CHECK_MSG(worst < 2e-5, "off by %g", worst);
  CHECK_MSG(drift < 1e-5, "b drifts by %g", drift);
}

TEST(ellis_wormhole)
{
  Radial table;
  CHECK(radial_ellis(2, 1, &table));
  check_wormhole(&(Throat){1, 0, 0}, 2, sqrt(3), &table);
  CHECK(!radial_ellis(1, 1, &table));
}

TEST(dngr_wormhole)
{
  Radial table;
  CHECK(radial_dngr(2, 1, 0.3f, 0.4f, &table));
  const Throat w = {1, 0.3, 0.4};
  double low = 0.3, high = 10, f, slope;
  while (high - low > 1e-12) {
    throat_f(&w, 0.5 * (low + high), &f, &slope);
    *(f < 2 ? &low : &high) = 0.5 * (low + high);
  }
  check_wormhole(&w, 2, low, &table);
}

// --- black holes ----------------------------------------------------------------------------------

// x'' = -3/2 rs h^2 x / |x|^5, from the ball's surface; until it is out, or in.
static RadialWay hole_walk(double rs, double radius, double h, double at, double *u_at, double *drift)
{
  double x[2] = {radius, 0}, v[2] = {-sqrt(1 - h * h / (radius * radius)), h / radius}, angle = 0;
  RadialWay way = {0, false};
  *u_at = 0;
  for (int i = 0; i < 400000; i++) {
    const double r = sqrt(x[0] * x[0] + x[1] * x[1]), step = 2e-3 * r;
    double kx[4][2], kv[4][2];
    for (int k = 0; k < 4; k++) {
      const double share = k == 0 ? 0 : k == 3 ? step : step / 2;
      double p[2];
      for (int c = 0; c < 2; c++) {
        p[c] = x[c] + (k ? share * kx[k - 1][c] : 0);
        kx[k][c] = v[c] + (k ? share * kv[k - 1][c] : 0);
      }
      const double q = p[0] * p[0] + p[1] * p[1], pull = -1.5 * rs * h * h / (q * q * sqrt(q));
      for (int c = 0; c < 2; c++) kv[k][c] = pull * p[c];
    }
    const double from[2] = {x[0], x[1]};
    for (int c = 0; c < 2; c++) {
      x[c] += step / 6 * (kx[0][c] + 2 * kx[1][c] + 2 * kx[2][c] + kx[3][c]);
      v[c] += step / 6 * (kv[0][c] + 2 * kv[1][c] + 2 * kv[2][c] + kv[3][c]);
    }
    const double turn = atan2(from[0] * x[1] - from[1] * x[0], from[0] * x[0] + from[1] * x[1]);
    const double now = sqrt(x[0] * x[0] + x[1] * x[1]);
    if (angle < at && angle + turn >= at) {
      const double f = (at - angle) / turn;
      *u_at = (1 - f) / r + f / now;
    }
    *drift = fmax(*drift, fabs(x[0] * v[1] - x[1] * v[0] - h));
    if (now > radius && i > 2) {
      way.angle = (float)(angle + turn * (radius - r) / (now - r));
      return way;
    }
    angle += turn;
    if (now < rs) break;
  }
  way.is_passed = true;
  way.angle = (float)angle;
  return way;
}

TEST(black_hole)
{
  static RadialOrbits orbits;
  Radial table;
  const float rs = 1, radius = 12;
  CHECK(radial_hole(radius, rs, &orbits, &table));
  CHECK(!radial_hole(1.5f, 1, &orbits, &table));
  CHECK(radial_hole(radius, rs, &orbits, &table));
  CHECK_NEAR(hole_impact(rs, radius, table.critical), 1.5 * sqrt(3), 1e-4);
  double worst = 0, mean = 0, drift = 0, worst_u = 0;
  int count = 0;
  for (int i = 1; i < 120; i++) {
    const double h = (double)radius * i / 120.0, at = 0.2 + 0.05 * (i % 50);
    if (fabs(h / (double)table.critical - 1) < 0.02) continue;
    double u;
    const RadialWay way = radial_way(&table, (float)h), walk = hole_walk(1, 12, h, at, &u, &drift);
    CHECK(way.is_passed == walk.is_passed);
    float total;
    const float orbit = radial_orbit(&table, (float)h, (float)at, &total);
    CHECK_NEAR(total, walk.angle, 4e-3);
    if (u > 0 && fabs((double)total - at) > 0.01) worst_u = fmax(worst_u, fabs((double)orbit - u));
    if (way.is_passed) continue;
    const double off = (double)fabsf(way.angle - walk.angle);
    worst = fmax(worst, off);
    mean += off;
    count++;
  }
  CHECK_MSG(worst < 3e-5 && mean / count < 1e-5, "worst %g, mean %g", worst, mean / count);
  CHECK_MSG(worst_u < 2e-4, "1/r off by %g", worst_u);
  CHECK_MSG(drift < 1e-5, "h drifts by %g", drift);
}

// Far away: 2 rs / b (Einstein 1916), and 15 pi / 16 (rs / b)^2 more.
TEST(light_bends_at_the_sun)
{
  static RadialOrbits orbits;
  Radial table;
  const float radius = 3000;
  CHECK(radial_hole(radius, 1, &orbits, &table));
  const double h = 100, sine = h / (double)radius, flat = M_PI - 2 * asin(sine);
  const double inside = (double)radial_way(&table, (float)h).angle - flat;
  // What bends outside of the ball is not in it: of 2 / b the part beyond sin(90 - ...).
  CHECK_NEAR(inside, 2 / h * cos(asin(sine)) + 15 * M_PI / 16 / (h * h), 4e-4);
}

TEST(ways_lie_in_their_plane)
{
  const Vec3 n = v3_normalize(v3(1, 2, -0.5f)), d = v3_normalize(v3(-1, -1, 0.1f));
  const RadialPlane p = radial_plane(2, n, d);
  Vec3 out, way;
  radial_leave(&p, 2, 0, &out, &way); // no angle: reflected
  CHECK(v3_length(out - n) < 1e-6f);
  CHECK_NEAR(v3_dot(way, n), -v3_dot(d, n), 1e-6);
  const float alpha = f_acos(p.inward); // the flat ball: straight through
  radial_leave(&p, 2, PI - 2 * alpha, &out, &way);
  CHECK(v3_length(way - d) < 1e-5f);
  CHECK(v3_length(2 * out - (2 * n + 4 * p.inward * d)) < 1e-5f);
}

// Matter that comes is brighter than matter that goes; none on the axis differs.
TEST(kepler_disk)
{
  CHECK(kepler_shift(1, 6, 5, 1) > 1 && kepler_shift(1, 6, 5, -1) < kepler_shift(1, 6, 5, 0));
  CHECK_NEAR(kepler_shift(1, 6, 5, 0), sqrt(0.75), 1e-6);
}

TEST_MAIN
