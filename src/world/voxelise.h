// Voxelise: all surfaces of a world as one grid of voxels, with the colours of their materials and textures.

#ifndef RAYFOLD_WORLD_VOXELISE_H
#define RAYFOLD_WORLD_VOXELISE_H

#include "image/voxels.h"
#include "world/world.h"

// side: cells along the longest side of what is there. Every cell that a triangle touches is filled, and every one that
// rays through the middles of cells meet a surface in, for shapes without triangles; is_solid fills what lies behind the
// front and before the back of a surface, which is the inside of what is closed. Media fill cells in whose middles their
// density is at least `density`, 0: none do. side 0: cells as small as those of the media's grids. cell: the side of a cell in
// metres; corner: where the grid's first corner lies.
Voxels *world_voxelise(const World *w, int32_t side, bool is_solid, float density, float *cell, float corner[3], Err *err);

#endif
