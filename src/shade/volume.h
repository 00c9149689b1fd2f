// Volumes: media ready for light. Coefficients are per metre in the world, whatever the object's size. world/ fills them
// in from a scene's media; render/media.h follows light through them. Does not know where a medium is.

#ifndef RAYFOLD_SHADE_VOLUME_H
#define RAYFOLD_SHADE_VOLUME_H

#include "shade/density.h"
#include "shade/phase.h"
#include "shade/spectrum.h"

typedef struct Volume {
  Vec3 scattering, extinction; // per metre; extinction is scattering and absorption together
  Vec3 emission;               // radiance a metre adds
  Phase phase;
  const Density *density; // multiplies all three; not owned; NULL: 1 everywhere
  const BlackBody *black_body; // NULL: none of heat that differs from place to place
  Vec3 hot;                // what absorbs, times how bright a black body is taken
  float kelvin, coldest;   // of heat 1 more; the heat of 0 K
  float most;             // bounds extinction in all channels: how often light is looked for, per metre at density 1
} Volume;

// What it scatters and what it adds at a place in its density's space, were that 1 there.
static inline Vec3 volume_scattering(const Volume *v, Vec3 p)
{
  return v->density && v->density->has_tint ? v->scattering * density_tint(v->density, p) : v->scattering;
}

static inline bool volume_shines(const Volume *v)
{
  return !v3_is_zero(v->emission) || v->black_body || (v->density && v->density->has_glow);
}

static inline Vec3 volume_emission(const Volume *v, Vec3 p)
{
  Vec3 sum = v->emission;
  if (v->black_body) sum += v->hot * black_body_at(v->black_body, (density_heat(v->density, p) - v->coldest) * v->kelvin);
  if (v->density && v->density->has_glow) sum += v->extinction * density_glow(v->density, p);
  return sum;
}

#endif
