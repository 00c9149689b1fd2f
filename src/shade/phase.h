// Phase: into which direction a medium scatters. One or two lobes of Henyey and Greenstein ("Diffuse radiation in the
// galaxy", 1941), whose g is the mean cosine: 0 all ways alike, towards 1 straight on, towards -1 back. Densities are
// per solid angle and are also what is scattered there, so a sample's weight is one. Hot.

#ifndef RAYFOLD_SHADE_PHASE_H
#define RAYFOLD_SHADE_PHASE_H

#include "base/fmath.h"
#include "base/vec.h"

typedef struct Phase {
  float g, second_g;
  float second_part; // of the light, by the second lobe
} Phase;             // zero is isotropic

// cosine: between the directions light travels in before and after.
static inline float phase_lobe(float g, float cosine)
{
  const float d = max_f(1 + g * g - 2 * g * cosine, 1e-12f);
  return (1 - g * g) / (4 * PI * d * sqrtf(d));
}

// The lobe's distribution inverted (pbrt-v4, equation 11.25). Under |g| = 0.001 it is flat to a float's last digits, and
// the inverse loses them.
static inline float phase_lobe_cosine(float g, float u)
{
  if (fabsf(g) < 1e-3f) return 1 - 2 * u;
  const float q = (1 - g * g) / (1 + g - 2 * g * u);
  return clamp_f((1 + g * g - q * q) / (2 * g), -1, 1);
}

// travel: unit, as the light that is followed goes on (-wo); wl: unit, after scattering.
static inline float phase_pdf(const Phase *p, Vec3 travel, Vec3 wl)
{
  const float cosine = v3_dot(travel, wl);
  const float first = phase_lobe(p->g, cosine);
  return p->second_part > 0 ? mix_f(first, phase_lobe(p->second_g, cosine), p->second_part) : first;
}

static inline Vec3 phase_sample(const Phase *p, Vec3 travel, Vec2 u, float *pdf)
{
  const bool is_second = u.x < p->second_part;
  const float part = is_second ? p->second_part : 1 - p->second_part;
  const float rest = min_f((is_second ? u.x : u.x - p->second_part) / part, 0x1.fffffep-1f);
  const float cosine = phase_lobe_cosine(is_second ? p->second_g : p->g, rest);
  const float sine = safe_sqrt(1 - cosine * cosine);
  const Frame f = frame_around(travel);
  float s, c;
  f_sincos(2 * PI * u.y, &s, &c);
  const Vec3 wl = v3_normalize(sine * c * f.x + sine * s * f.y + cosine * f.z);
  *pdf = phase_pdf(p, travel, wl);
  return wl;
}

#endif
