// How much light a smooth boundary reflects, and where the rest goes. Hot.

#ifndef RAYFOLD_SHADE_FRESNEL_H
#define RAYFOLD_SHADE_FRESNEL_H

#include "base/vec.h"

// Reflectance at normal incidence of a boundary with relative index eta (the same from both sides).
static inline float fresnel_f0(float eta)
{
  return sqr_f((eta - 1) / (eta + 1));
}

// Unpolarised reflectance of a boundary between two dielectrics by the cosines on both sides (Born and Wolf,
// "Principles of Optics", 1.5.2), eta = the index on t's side over the index on i's.
static inline float fresnel_by_cosines(double i, double t, double eta)
{
  const double s = (i - eta * t) / (i + eta * t), p = (eta * i - t) / (eta * i + t);
  return (float)((s * s + p * p) / 2);
}

// The same from cos_i >= 0 alone; gives the cosine behind, 0 for total reflection. In double: near the critical angle
// that cosine is the root of a small difference.
static inline float fresnel_dielectric(float cos_i, float eta, float *cos_t)
{
  const double i = cos_i, n = eta, cos2_t = 1 - (1 - i) * (1 + i) / (n * n);
  *cos_t = 0;
  if (!(cos2_t > 0)) return 1;
  const double t = sqrt(cos2_t);
  *cos_t = (float)t;
  return fresnel_by_cosines(i, t, n);
}

// The weight of f90 against f0 (Schlick, "An inexpensive BRDF model", 1994, equation 15).
static inline float fresnel_schlick(float cos)
{
  const float x = clamp_f(1 - cos, 0, 1), x2 = x * x;
  return x2 * x2 * x;
}

// The refracted direction: wo on the side of h, the result on the other (Snell's law in the form of Walter et al.,
// "Microfacet models for refraction", 2007, equation 40). cos_i = wo.h, cos_t from fresnel_dielectric().
static inline Vec3 refract(Vec3 wo, Vec3 h, float eta, float cos_i, float cos_t)
{
  return h * (cos_i / eta - cos_t) - wo / eta;
}

#endif
