// Charts of spaces of constant curvature, where straight lines are geodesics.
//
// The first part is the algebra of 4 x 4 matrices (real4.h). The second is what rays are traced in: the affine chart
// k = rho (x, y, z) / w, which is the gnomonic picture of spherical and Klein's of hyperbolic space, in metres near its
// centre. Trees, boxes and triangles are those of flat space in it. A vector at a point is kept as three numbers: what it
// becomes when it is carried to the centre along the straight line there (parallel transport), so lengths and angles
// of vectors at one point are those of ordinary vectors, and shading knows nothing of curvature. Here kappa is
// curvature per square metre: 1 / rho^2 in spherical, -1 / rho^2 in hyperbolic space, 0 in flat space, where every
// function is the identity that it should be.
//
//   X = (k, 1) w, w = 1 / sqrt(1 + kappa k.k)             a point's place in four dimensions, times 1 / rho
//   d = v + a (k.v) k, a = kappa w / (1 + w)              which way a vector v at k points in the chart
//
// A chart of spherical space ends at a quarter of the way around it, that of hyperbolic space at k = rho.

#ifndef RAYFOLD_SPACE_CHART_H
#define RAYFOLD_SPACE_CHART_H

#include <math.h>
#include <stdbool.h>

#include "base/fmath.h"
#include "base/vec.h"

#define REAL float
#define REAL_SQRT sqrtf
#define R(name) name##_f
#include "space/real4.h"
#undef REAL
#undef REAL_SQRT
#undef R
#define REAL double
#define REAL_SQRT sqrt
#define R(name) name##_d
#include "space/real4.h"
#undef REAL
#undef REAL_SQRT
#undef R

// w of a point of the chart: the factor of lengths across the way to the centre; w^2 is that of lengths along it.
static inline float chart_w(float kappa, Vec3 k) { return 1 / sqrtf(1 + kappa * v3_dot(k, k)); }

static inline bool chart_holds(float kappa, Vec3 k) { return 1 + kappa * v3_dot(k, k) > 0; }

// The direction in the chart of a vector at k, not of unit length.
static inline Vec3 chart_from_local(float kappa, Vec3 k, Vec3 v)
{
  const float w = chart_w(kappa, k);
  return v + (kappa * w / (1 + w) * v3_dot(k, v)) * k;
}

// The vector at k of a direction in the chart, not of unit length.
static inline Vec3 chart_to_local(float kappa, Vec3 k, Vec3 d)
{
  const float w = chart_w(kappa, k);
  return d - (kappa * w * w / (1 + w) * v3_dot(k, d)) * k;
}

// The unit normal at k of a surface whose normal in the chart is n.
static inline Vec3 chart_normal(float kappa, Vec3 k, Vec3 n)
{
  return v3_normalize(chart_from_local(kappa, k, n)); // the map is its own transpose
}

// Solid angle in the chart that unit solid angle around the unit vector v at k takes up: a density per solid angle of
// the chart times this is the density per solid angle at k. From the linear map's determinant 1 / w.
static inline float chart_solid_angle(float kappa, Vec3 k, Vec3 v)
{
  const Vec3 d = chart_from_local(kappa, k, v);
  const float n = v3_dot(d, d);
  return 1 / (chart_w(kappa, k) * n * sqrtf(n));
}

// A length along a geodesic by what it is measured with: sine = rho sin(t / rho), cosine = cos(t / rho), up to a common
// positive factor; sinh and cosh in hyperbolic space.
typedef struct ChartLength {
  float sine, cosine;
} ChartLength;

// How far s is along the ray k + s d, d a unit vector of the chart (worlds.md, section 2.2: tau = s Pw / (1 - s Vw)).
static inline ChartLength chart_span(float kappa, Vec3 k, Vec3 d, float s)
{
  const Vec3 v = chart_to_local(kappa, k, d);
  const float w = chart_w(kappa, k);
  return (ChartLength){s * sqrtf(v3_dot(v, v)) * w, 1 + kappa * w * w * v3_dot(k, d) * s};
}

static inline float chart_length(float kappa, ChartLength l)
{
  if (kappa == 0) return l.sine / l.cosine;
  const float root = sqrtf(fabsf(kappa)), x = root * l.sine;
  if (kappa > 0) return f_atan2(x, l.cosine) / root;
  return 0.5f * f_log((l.cosine + x) / max_f(l.cosine - x, 1e-30f)) / root;
}

// S(t): the radius of a circle of geodesic radius t, over 2 pi; light of a small lamp thins out with its square.
static inline float chart_spread(float kappa, ChartLength l)
{
  return l.sine / sqrtf(max_f(l.cosine * l.cosine + kappa * l.sine * l.sine, 1e-30f));
}

// How far on the ray k + s d (d a unit vector of the chart) the length t is: s of chart_span()'s. Infinity: at or
// beyond the chart's end.
static inline float chart_along(float kappa, Vec3 k, Vec3 d, float t)
{
  const Vec3 v = chart_to_local(kappa, k, d);
  const float w = chart_w(kappa, k), n = sqrtf(v3_dot(v, v));
  if (kappa == 0) return t / n;
  const float root = sqrtf(fabsf(kappa));
  float sine, cosine;
  if (kappa > 0) {
    if (root * t >= 3.14159265f) return INFINITY; // every line ends there before half the way round
    f_sincos(root * t, &sine, &cosine);
  } else {
    const float e = f_exp(root * t);
    sine = 0.5f * (e - 1 / e);
    cosine = 0.5f * (e + 1 / e);
  }
  const float below = root * n * w * cosine - kappa * w * w * v3_dot(k, d) * sine;
  return below > 0 ? sine / below : INFINITY;
}

// A place of the chart and a vector at it, in four dimensions and of unit curvature (rho is 1 / sqrt |kappa|).
static inline Geodesic_f chart_lift(float kappa, Vec3 k, Vec3 v)
{
  const float root = sqrtf(fabsf(kappa)), unit = root > 0 ? root : 1;
  const float sign = kappa > 0 ? 1.0f : kappa < 0 ? -1.0f : 0.0f;
  const float w = chart_w(kappa, k);
  const Vec3 x = k * (unit * w);
  const float along = v3_dot(x, v);
  const Vec3 tangent = v - (sign * along / (1 + w)) * x;
  return (Geodesic_f){{{x[0], x[1], x[2], w}}, {{tangent[0], tangent[1], tangent[2], -sign * along}}};
}

// The vector that a tangent is in the chart.
static inline Vec3 chart_lower(const Geodesic_f *g)
{
  const float part = g->v.v[3] / (1 + g->p.v[3]);
  return v3(g->v.v[0] - part * g->p.v[0], g->v.v[1] - part * g->p.v[1], g->v.v[2] - part * g->p.v[2]);
}

// Where k and the vector v at it are after a map of the space. The tangent goes on with the map; what comes out is
// again a place in the chart and a vector at it.
static inline void chart_map(float kappa, const Mat4_f *m, Vec3 *k, Vec3 *v)
{
  const float root = sqrtf(fabsf(kappa)), unit = root > 0 ? root : 1;
  const Geodesic_f from = chart_lift(kappa, *k, *v);
  Geodesic_f g = {mat4_apply_f(m, &from.p), mat4_apply_f(m, &from.v)};
  geodesic_mend_f(kappa > 0 ? 1 : kappa < 0 ? -1 : 0, &g);
  *k = v3(g.p.v[0], g.p.v[1], g.p.v[2]) / (g.p.v[3] * unit);
  *v = chart_lower(&g);
}

// What the vector v at k becomes when it is carried along the straight line to another place of the chart: parallel
// transport, T - s <Q, T> / (1 + s <P, Q>) (P + Q) in four dimensions, s the sign of the curvature.
static inline Vec3 chart_carry(float kappa, Vec3 k, Vec3 to, Vec3 v)
{
  if (kappa == 0) return v;
  const int sign = kappa > 0 ? 1 : -1;
  const Geodesic_f from = chart_lift(kappa, k, v), end = chart_lift(kappa, to, v3_all(0));
  const float s = (float)sign, part = -s * dot4_f(sign, &end.p, &from.v) / (1 + s * dot4_f(sign, &from.p, &end.p));
  const Vec4_f both = mix4_f(1, &from.p, 1, &end.p);
  const Geodesic_f g = {end.p, mix4_f(1, &from.v, part, &both)};
  return chart_lower(&g);
}

// Weights of a triangle's corners that do not depend on where the chart is centred, from those of the chart: the
// coefficients of the point in the corners' places in four dimensions (worlds.md, section 2.2).
static inline void chart_weights(float kappa, const Vec3 corners[3], float b[3])
{
  float sum = 0;
  for (int i = 0; i < 3; i++) sum += b[i] /= chart_w(kappa, corners[i]);
  for (int i = 0; i < 3; i++) b[i] /= sum;
}

#endif
