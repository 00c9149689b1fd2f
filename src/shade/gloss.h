// Gloss: the highlights of older tracers as BRDFs that can be sampled and that lose no reciprocity and gain no energy.
// Hot. Directions are local, z the shading normal.
//
//   phong          (n + 2) / 2 pi cos^n of the angle to the mirror's direction (Lafortune and Willems, "Using the
//                  modified Phong reflectance model for physically based rendering", 1994)
//   beckmann       F D G / (4 cos cos) with Beckmann's distribution of facets and the geometry term min(1, ...) of
//   gaussian       Cook and Torrance ("A reflectance model for computer graphics", 1982); the latter with their
//                  Gaussian c exp(-(angle / m)^2)
//
// The textbook's 1 / pi is a 1 / 4 here, which is what makes facets that reflect all reflect no more than all. Light that
// facets throw at each other is lost.

#ifndef RAYFOLD_SHADE_GLOSS_H
#define RAYFOLD_SHADE_GLOSS_H

#include "base/fmath.h"
#include "shade/fresnel.h"

typedef enum GlossKind { GLOSS_NONE, GLOSS_PHONG, GLOSS_BECKMANN, GLOSS_GAUSSIAN } GlossKind;

typedef struct Gloss {
  uint8_t kind; // GlossKind
  float width;  // of phong the exponent n, of the others the slope or the angle m
  float c;      // of gaussian: the height of its distribution
  Vec3 f0, f90; // reflectance, weight included
} Gloss;

// cos^n of the angle to the mirror's direction: from the distance of the two, or a sharp lobe would have no digits.
static inline float phong_power(Vec3 wo, Vec3 wl, float n)
{
  const double x = (double)wl[0] + (double)wo[0], y = (double)wl[1] + (double)wo[1], z = (double)wl[2] - (double)wo[2];
  const double cos = 1 - (x * x + y * y + z * z) / 2;
  return cos > 0 ? (float)fmath_exp((double)n * fmath_log(cos)) : 0;
}

static inline float facet_angle(Vec3 h)
{
  return f_atan2(sqrtf(h[0] * h[0] + h[1] * h[1]), h[2]);
}

// Density of facets around h, of a total cosine of 1 (Gaussian: at most).
static inline float gloss_d(const Gloss *g, Vec3 h)
{
  const float m2 = g->width * g->width, z2 = h[2] * h[2];
  if (g->kind == GLOSS_GAUSSIAN) return g->c * f_exp(-sqr_f(facet_angle(h)) / m2);
  return f_exp(-(h[0] * h[0] + h[1] * h[1]) / (z2 * m2)) / (PI * m2 * z2 * z2);
}

// Density with which gloss_sample() gives h.
static inline float gloss_facet_pdf(const Gloss *g, Vec3 h)
{
  if (g->kind != GLOSS_GAUSSIAN) return gloss_d(g, h) * h[2];
  const float m2 = g->width * g->width, angle = facet_angle(h);
  const float sine = sqrtf(h[0] * h[0] + h[1] * h[1]);
  const float around = sine > 1e-6f ? angle / sine : 1;
  return around * f_exp(-angle * angle / m2) / (PI * m2 * (1 - f_exp(-sqr_f(PI / 2) / m2)));
}

// f |cos|, and the density of sampling wl by it.
static inline Vec3 gloss_eval(const Gloss *g, Vec3 wo, Vec3 wl, float *pdf)
{
  if (g->kind == GLOSS_PHONG) {
    const float lobe = phong_power(wo, wl, g->width) / (2 * PI);
    *pdf = (g->width + 1) * lobe;
    return g->f0 * ((g->width + 2) * lobe * wl[2]);
  }
  const Vec3 h = v3_normalize(wo + wl);
  const float cos = max_f(safe_sqrt((1 + v3_dot(wo, wl)) / 2), 1e-6f), x = fresnel_schlick(cos);
  const float masked = min_f(1, 2 * h[2] * min_f(wo[2], wl[2]) / cos);
  *pdf = gloss_facet_pdf(g, h) / (4 * cos);
  return (g->f0 * (1 - x) + g->f90 * x) * (gloss_d(g, h) * masked / (4 * wo[2]));
}

// A direction about z: its cosine to z and an even turn.
static inline Vec3 direction_about(float cosine, float sine, float turn)
{
  float s, c;
  f_sincos(2 * PI * turn, &s, &c);
  return v3(sine * c, sine * s, cosine);
}

// A facet, by the inverse of the distribution in its angle: Walter et al. 2007, equation 28, for Beckmann's.
static inline Vec3 gloss_facet(const Gloss *g, Vec2 u)
{
  const float m2 = g->width * g->width;
  if (g->kind == GLOSS_GAUSSIAN) {
    const float whole = 1 - f_exp(-sqr_f(PI / 2) / m2);
    float s, c;
    f_sincos(safe_sqrt(-m2 * f_log(1 - u.y * whole)), &s, &c);
    return direction_about(max_f(c, 0), s, u.x);
  }
  const float tan2 = -m2 * f_log(1 - u.y), cosine = 1 / sqrtf(1 + tan2);
  return direction_about(cosine, cosine * safe_sqrt(tan2), u.x);
}

// May point below the surface; then nothing is reflected.
static inline Vec3 gloss_sample(const Gloss *g, Vec3 wo, Vec2 u)
{
  if (g->kind != GLOSS_PHONG) return v3_reflect(wo, gloss_facet(g, u));
  const double cosine = fmath_exp(fmath_log(1 - (double)u.y) / ((double)g->width + 1));
  const Frame mirror = frame_around(v3(-wo[0], -wo[1], wo[2]));
  return frame_vector(&mirror, direction_about((float)cosine, (float)sqrt((1 - cosine) * (1 + cosine)), u.x));
}

#endif
