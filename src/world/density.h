// Density parts: what media that are not the same everywhere share between worlds. See density.c.

#ifndef RAYFOLD_WORLD_DENSITY_H
#define RAYFOLD_WORLD_DENSITY_H

#include "world/prepare.h"

// The density of a medium of any kind but homogeneous, owned by the world's parts; NULL on failure.
const Density *prepare_density(Prepare *p, const Scene *s, const Medium *m);

// The part of this key, its density still to be made if it is not; NULL: no memory.
DensityPart *prepare_density_part(Prepare *p, uint64_t key, bool *is_made);

// Voxels as a density, 1 in filled cells, with the colours and the shine of their palette; a cell is one unit wide. Of the
// same voxels the same. NULL on failure. See voxel_smoke.c.
const Density *prepare_voxel_density(Prepare *p, Voxels *v);

#endif
