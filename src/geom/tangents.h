// Tangents of a mesh that brings none, as MikkTSpace makes them (Mikkelsen 2008, "Simulation of Wrinkled Surfaces
// Revisited", section 3.7 and appendix; the convention glTF and the programs that bake normal maps agree on), from its
// published rules:
//
//   - vertices alike in position, normal and uv are one vertex
//   - around a vertex, triangles that share an edge there and have uv of the same handedness are one group
//   - a group's tangent is the mean of the triangles' directions of growing u, in the plane of the vertex's normal,
//     weighed by the angle each triangle has there; the sign says whether uv is mirrored
//   - triangles whose uv have no area take part in a group and give it nothing
//
// Tangents are kept a corner, not a vertex: where a vertex has several groups (a seam where uv is mirrored) the same
// vertex has several tangents, and a file that stores one a vertex would have to split it. Meshes without normals are
// flat, and each triangle's own direction serves there.

#ifndef RAYFOLD_GEOM_TANGENTS_H
#define RAYFOLD_GEOM_TANGENTS_H

#include "base/jobs.h"
#include "geom/surface.h"

typedef struct Tangents {
  atomic_int users;
  int set;             // of the texture coordinates they follow
  size_t count, size;  // tangents; bytes of both arrays
  uint32_t *of_corner; // 3 a triangle: index of its tangent
  float *tangents;     // 4 each: unit tangent and the bitangent's sign
} Tangents;

// The mesh must have normals and this set of texture coordinates. NULL when memory is out or cancelled.
Tangents *tangents_make(const TriangleMesh *m, size_t vertex_count, size_t triangle_count, int set, Jobs *jobs,
                        const Cancel *cancel, Err *err);
Tangents *tangents_share(Tangents *t); // accepts NULL
void tangents_release(Tangents *t);    // accepts NULL

#endif
