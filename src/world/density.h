// Density parts: what media that are not the same everywhere share between worlds. See density.c.

#ifndef RAYFOLD_WORLD_DENSITY_H
#define RAYFOLD_WORLD_DENSITY_H

#include "world/prepare.h"

// The density of a medium of any kind but homogeneous, owned by the world's parts; NULL on failure.
const Density *prepare_density(Prepare *p, const Scene *s, const Medium *m);

#endif
