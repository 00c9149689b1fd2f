// Merge: every surface of a world as one triangle mesh in world space, for programs that know nothing else. Spheres, cylinders, cones, tori
// and disks become facets, distance fields what geom/sdf_mesh.h makes of them; materials and the sharing of instances are lost.

#ifndef RAYFOLD_WORLD_MERGE_H
#define RAYFOLD_WORLD_MERGE_H

#include "world/world.h"

// A new mesh (one user, the caller). Area lights are left out. NULL when there are no triangles, more vertices than
// an index can name, or no memory.
MeshData *world_merge(const World *w, Err *err);

#endif
