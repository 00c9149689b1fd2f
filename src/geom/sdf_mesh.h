// Sdf mesh: the surface of a field as triangles, by dual contouring (Ju et al., "Dual Contouring of Hermite Data", SIGGRAPH
// 2002): a vertex in each cell of a grid that the surface goes through, where the planes of the surface about it meet best,
// and a quad across each edge of the grid that it crosses. Closed by construction; parts thinner than a cell may be
// missing. Cold.

#ifndef RAYFOLD_GEOM_SDF_MESH_H
#define RAYFOLD_GEOM_SDF_MESH_H

#include "base/array.h"
#include "base/err.h"
#include "geom/sdf.h"

enum { SDF_MESH_SIDE = 128, SDF_MESH_MOST = 512 }; // cells along the longest side: as exporters take it, and at most

typedef struct SdfMeshVertex {
  float p[3], n[3]; // n: of length one
} SdfMeshVertex;

typedef struct SdfMesh {
  ARRAY(SdfMeshVertex) vertices;
  ARRAY(uint32_t) triangles; // three a triangle, anticlockwise seen from outside
} SdfMesh; // zero is empty

void sdf_mesh_finish(SdfMesh *m); // accepts zero

// Appends the surface to an empty mesh. The field must have ends.
bool sdf_mesh_make(SdfMesh *m, const Sdf *f, uint32_t side, Err *err);

#endif
