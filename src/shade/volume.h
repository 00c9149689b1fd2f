// Volumes: media ready for light. Coefficients are per metre in the world, whatever the object's size. world/ fills them
// in from a scene's media; render/media.h follows light through them. Does not know where a medium is.

#ifndef RAYFOLD_SHADE_VOLUME_H
#define RAYFOLD_SHADE_VOLUME_H

#include "shade/density.h"
#include "shade/phase.h"

typedef struct Volume {
  Vec3 scattering, extinction; // per metre; extinction is scattering and absorption together
  Vec3 emission;               // radiance a metre adds
  Phase phase;
  const Density *density; // multiplies all three; not owned; NULL: 1 everywhere
  float most;             // bounds extinction in all channels: how often light is looked for, per metre at density 1
} Volume;

#endif
