// Round places that bend light: bubbles of other curvature, wormholes, black holes. Each is a ball that a straight ray
// enters; what comes out follows from one number, its distance h from the centre had it gone straight on: the angle
// swept about the centre, and on which side it leaves. The way lies in a plane and is the same in and out
// (worlds.md, sections 2.7 and 2.8).
//
// Bubbles are closed forms. The others have tables (radial.c) of the swept angle without its logarithm at the critical h,
//   angle = g(v) - k ln x - c / sqrt x,   x = |h - hc| / (its greatest),   x = (v (2 - v))^4,
// spaced in v, so that nodes are dense at the critical h, where ways wind, and where rays graze the ball.
//
// Lengths in metres. Does not know what is on the other side.

#ifndef RAYFOLD_SPACE_RADIAL_H
#define RAYFOLD_SPACE_RADIAL_H

#include <math.h>
#include <stdbool.h>

#include "base/fmath.h"
#include "base/vec.h"

enum { RADIAL_NODES = 512, RADIAL_ROWS = 256, RADIAL_COLUMNS = 128 };

typedef struct RadialBranch {
  float log_part;  // k
  float root_part; // c: the windings around a throat that is a tube
  float nodes[RADIAL_NODES + 1];
} RadialBranch;

// Ways around a black hole: 1 / r after a share of the angle, for each of the branches; rows in v, columns in
// share. Ways that come out are the same from both ends and kept up to the nearest place.
typedef struct RadialOrbits {
  float u[2][RADIAL_ROWS + 1][RADIAL_COLUMNS + 1];
  float total[RADIAL_ROWS + 1]; // swept up to the horizon, of ways that end there
} RadialOrbits;

typedef struct Radial {
  float radius;        // of the ball
  float critical;      // hc
  RadialBranch passed; // h < hc: through to the other side; unused by a black hole, which keeps what comes so near
  RadialBranch turned; // h > hc: back out on the same side
  const RadialOrbits *orbits; // of a black hole; else NULL
} Radial;

typedef struct RadialWay {
  float angle;
  bool is_passed; // to the other side, or into the hole, where there is no angle
} RadialWay;

static inline float radial_v(float x)
{
  const float quarter = sqrtf(sqrtf(x));
  return 1 - sqrtf(max_f(1 - quarter, 0));
}

static inline float radial_angle(const RadialBranch *b, float x)
{
  x = clamp_f(x, 1e-9f, 1);
  const float at = radial_v(x) * RADIAL_NODES;
  const int i = at < RADIAL_NODES ? (int)at : RADIAL_NODES - 1;
  return mix_f(b->nodes[i], b->nodes[i + 1], at - (float)i) - b->log_part * f_log(x) + b->root_part / sqrtf(x);
}

static inline RadialWay radial_way(const Radial *r, float h)
{
  RadialWay way = {0, h < r->critical};
  if (!way.is_passed)
    way.angle = radial_angle(&r->turned, (h - r->critical) / (r->radius - r->critical));
  else if (!r->orbits)
    way.angle = radial_angle(&r->passed, (r->critical - h) / r->critical);
  return way;
}

// 1 / r of a black hole's way after `angle`; 0: it has ended or is out again. *total: how long the way is.
static inline float radial_orbit(const Radial *r, float h, float angle, float *total)
{
  const bool is_in = h < r->critical;
  const float x = is_in ? (r->critical - h) / r->critical : (h - r->critical) / (r->radius - r->critical);
  const float at = radial_v(clamp_f(x, 1e-9f, 1)) * RADIAL_ROWS;
  const int i = at < RADIAL_ROWS ? (int)at : RADIAL_ROWS - 1;
  const float f = at - (float)i;
  *total = is_in ? mix_f(r->orbits->total[i], r->orbits->total[i + 1], f) : radial_angle(&r->turned, x);
  if (angle < 0 || angle >= *total) return 0;
  float share = angle / *total;
  if (!is_in) share = 2 * min_f(share, 1 - share);
  const float column = share * RADIAL_COLUMNS;
  const int j = column < RADIAL_COLUMNS ? (int)column : RADIAL_COLUMNS - 1;
  const float(*u)[RADIAL_COLUMNS + 1] = r->orbits->u[is_in];
  return mix_f(mix_f(u[i][j], u[i][j + 1], column - (float)j), mix_f(u[i + 1][j], u[i + 1][j + 1], column - (float)j), f);
}

// The plane of a way: e1 from the centre to where it enters, e2 the way it goes round. h is as above.
typedef struct RadialPlane {
  Vec3 e1, e2;
  float h, inward; // the direction is -inward e1 + h / radius e2
} RadialPlane;

static inline RadialPlane radial_plane(float radius, Vec3 n, Vec3 d)
{
  RadialPlane p = {.e1 = n, .inward = -v3_dot(n, d)};
  const Vec3 across = d + p.inward * n;
  const float sine = v3_length(across);
  p.e2 = sine > 1e-7f ? across / sine : frame_around(n).x;
  p.h = radius * min_f(sine, 1);
  return p;
}

// Where the way is after an angle, and how it leaves the ball there.
static inline void radial_leave(const RadialPlane *p, float radius, float angle, Vec3 *n, Vec3 *d)
{
  float s, c;
  f_sincos(angle, &s, &c);
  *n = c * p->e1 + s * p->e2;
  *d = p->inward * *n + (p->h / radius) * (c * p->e2 - s * p->e1);
}

// A ball of curvature kappa (per square metre) and geodesic radius r, empty: the angle swept and the way's length. Its
// boundary has the radius S(r) outside; more than a half sphere may be in it. alpha is the angle of entry from the normal.
static inline float bubble_angle(float kappa, float r, float sine_alpha, float cosine_alpha)
{
  if (kappa == 0) return 2 * f_atan2(cosine_alpha, sine_alpha);
  const float root = sqrtf(fabsf(kappa)) * r;
  const float c = kappa > 0 ? f_cos(root) : 0.5f * (f_exp(root) + f_exp(-root));
  return 2 * f_atan2(cosine_alpha, c * sine_alpha);
}

static inline float bubble_length(float kappa, float r, float cosine_alpha)
{
  if (kappa == 0) return 2 * r * cosine_alpha;
  const float root = sqrtf(fabsf(kappa)), x = root * r;
  if (kappa > 0) {
    float s, c;
    f_sincos(x, &s, &c);
    return 2 * f_atan2(s * cosine_alpha, c) / root;
  }
  const float e = f_exp(2 * x), t = (e - 1) / (e + 1) * cosine_alpha;
  return f_log((1 + t) / (1 - t)) / root;
}

// Colour and brightness of matter that circles a hole of radius rs in the plane across `axis`, at r, where light leaves
// it whose orbit has the unit normal m and impact parameter b: frequency here over frequency there (Luminet 1979,
// equation 19). A blackbody is seen hotter by it, and brighter by its fourth power.
static inline float kepler_shift(float rs, float r, float b, float cosine)
{
  const float around = sqrtf(rs / (2 * r * r * r));
  return sqrtf(max_f(1 - 1.5f * rs / r, 0)) / (1 - around * b * cosine);
}

// What is kept is h; far from the hole the way has the impact parameter b (worlds.md, section 2.8).
static inline float hole_impact(float rs, float radius, float h)
{
  const float inverse = 1 / (h * h) - rs / (radius * radius * radius);
  return inverse > 0 ? 1 / sqrtf(inverse) : INFINITY;
}

// Tables. False: the ball is not larger than the throat, or not twice as large as the hole. Built in milliseconds; worst
// errors against Runge and Kutta of the geodesics are in tests/test_radial.c.
bool radial_ellis(float radius, float throat, Radial *out);
bool radial_dngr(float radius, float throat, float half_length, float lensing, Radial *out);
bool radial_hole(float radius, float rs, RadialOrbits *orbits, Radial *out);

#endif
