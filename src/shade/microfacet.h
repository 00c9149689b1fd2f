// The GGX distribution of microfacets (Trowbridge and Reitz 1975; Walter et al. 2007) with Smith's masking. Hot.
// Directions are local: z is the shading normal. alpha is the width, the square of the material's roughness.

#ifndef RAYFOLD_SHADE_MICROFACET_H
#define RAYFOLD_SHADE_MICROFACET_H

#include "base/fmath.h"
#include "base/vec.h"

// Density of microfacet normals (Walter et al. 2007, equation 33). Written in the components of h across the normal:
// 1 - h.z^2 would lose all its digits in a narrow lobe.
static inline float ggx_d(Vec3 h, float alpha)
{
  const float alpha2 = alpha * alpha, t = h[0] * h[0] + h[1] * h[1] + alpha2 * h[2] * h[2];
  return alpha2 / (PI * t * t);
}

// cos * sqrt(1 + alpha^2 tan^2): Smith's Lambda is (this / cos - 1) / 2 (Heitz, "Understanding the masking-shadowing
// function", JCGT 2014, equation 72).
static inline float ggx_slope(float cos, float alpha)
{
  return sqrtf(alpha * alpha + (1 - alpha) * (1 + alpha) * cos * cos);
}

// Height-correlated masking and shadowing over 4 cos_o cos_l (Heitz 2014, equation 99; the same form as glTF 2.0,
// appendix B.3.2). Cosines are positive; for transmission take their absolute values.
static inline float ggx_visibility(float cos_o, float cos_l, float alpha)
{
  return 0.5f / (cos_l * ggx_slope(cos_o, alpha) + cos_o * ggx_slope(cos_l, alpha));
}

// G1 over cos_o: with D (wo.h) the density of visible normals.
static inline float ggx_g1_over_cos(float cos_o, float alpha)
{
  return 2 / (cos_o + ggx_slope(cos_o, alpha));
}

// A normal visible from wo, with density D G1 (wo.h) / cos_o (Dupuy and Benyoub, "Sampling visible GGX normals with
// spherical caps", HPG 2023, listing 3).
static inline Vec3 ggx_sample(Vec3 wo, float alpha, Vec2 u)
{
  const Vec3 flat = v3_normalize(v3(alpha * wo[0], alpha * wo[1], wo[2]));
  const float z = (1 - u.y) * (1 + flat[2]) - flat[2], r = safe_sqrt((1 - z) * (1 + z));
  float sine, cosine;
  f_sincos(2 * PI * u.x, &sine, &cosine);
  const Vec3 h = v3(r * cosine, r * sine, z) + flat;
  return v3_normalize(v3(alpha * h[0], alpha * h[1], max_f(h[2], 0)));
}

// --- the same with two widths ---------------------------------------------------------------------
// Bumps stretched along y, as brushing leaves them: width.x along x, width.y along y (Heitz 2014, equations 85 and 86).
static inline float ellipse_d(Vec3 h, Vec2 width)
{
  const float t = sqr_f(h[0] / width.x) + sqr_f(h[1] / width.y) + h[2] * h[2];
  return 1 / (PI * width.x * width.y * t * t);
}

static inline float ellipse_slope(Vec3 w, Vec2 width)
{
  return sqrtf(sqr_f(width.x * w[0]) + sqr_f(width.y * w[1]) + w[2] * w[2]);
}

static inline float ellipse_visibility(Vec3 wo, Vec3 wl, Vec2 width)
{
  const float cos_o = fabsf(wo[2]), cos_l = fabsf(wl[2]);
  return 0.5f / (cos_l * ellipse_slope(wo, width) + cos_o * ellipse_slope(wl, width));
}

static inline float ellipse_g1_over_cos(Vec3 wo, Vec2 width)
{
  return 2 / (wo[2] + ellipse_slope(wo, width));
}

static inline Vec3 ellipse_sample(Vec3 wo, Vec2 width, Vec2 u)
{
  const Vec3 flat = v3_normalize(v3(width.x * wo[0], width.y * wo[1], wo[2]));
  const float z = (1 - u.y) * (1 + flat[2]) - flat[2], r = safe_sqrt((1 - z) * (1 + z));
  float sine, cosine;
  f_sincos(2 * PI * u.x, &sine, &cosine);
  const Vec3 h = v3(r * cosine, r * sine, z) + flat;
  return v3_normalize(v3(width.x * h[0], width.y * h[1], max_f(h[2], 0)));
}

#endif
