// Albedo: what a medium must scatter of the light it meets to look, where nothing is seen behind it, as a matt surface of a
// colour does, and back. By van de Hulst's approximation for light from all sides onto a medium without an end that scatters all
// ways alike, and its inverse (Kulla and Conty, "Revisiting physically based shading at Imageworks", SIGGRAPH course 2017).

#ifndef RAYFOLD_SHADE_ALBEDO_H
#define RAYFOLD_SHADE_ALBEDO_H

#include "base/fmath.h"
#include "base/vec.h"

static inline float albedo_of_reflectance(float a)
{
  const float s = 4.09712f + 4.20863f * a - sqrtf(9.59217f + 41.6808f * a + 17.7126f * a * a);
  return clamp_f(1 - s * s, 0, 1);
}

static inline float reflectance_of_albedo(float albedo)
{
  const float s = safe_sqrt(1 - albedo);
  return (1 - s) * (1 - 0.139f * s) / (1 + 1.17f * s);
}

static inline Vec3 albedo_of_color(Vec3 color)
{
  return v3(albedo_of_reflectance(color[0]), albedo_of_reflectance(color[1]), albedo_of_reflectance(color[2]));
}

static inline Vec3 color_of_albedo(Vec3 albedo)
{
  return v3(reflectance_of_albedo(albedo[0]), reflectance_of_albedo(albedo[1]), reflectance_of_albedo(albedo[2]));
}

#endif
