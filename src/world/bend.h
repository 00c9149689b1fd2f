// Bend: objects into the chart of a curved cell. An object is made in the chart around its own place, where it is as large
// as it says near its middle and where what is flat is flat; carried to where the cell has it, it stays made of
// planes and straight edges, so a mesh is one again and a ball is an ellipsoid. Cold.

#ifndef RAYFOLD_WORLD_BEND_H
#define RAYFOLD_WORLD_BEND_H

#include "scene/scene.h"
#include "space/isometry.h"

typedef struct Bend {
  int kappa;    // 1 or -1
  double rho;   // metres
  Mat4_d place; // from the chart around the object's place to the cell's
} Bend;

// pose: turned axes of unit length, and the place in the cell's chart. False: it is outside of the chart.
bool bend_at(float kappa, const Frame *pose, Bend *out);

// A point of the object's chart, in the cell's; false: outside of either.
bool bend_point(const Bend *b, Vec3 p, Vec3 *out);

// The mesh, moved by `own` within its chart and then into the cell's. NULL: out of memory, or a vertex is outside.
MeshData *bend_mesh(const Bend *b, const MeshData *m, const Frame *own, Err *err);

// Those shapes as meshes in their own chart.
MeshData *bend_quad(float half_x, float half_y);
MeshData *bend_disk(float radius);
MeshData *bend_ball(float kappa, float radius); // for lamps, which must be of parts that can be aimed at

// What makes the ellipsoid of a ball of unit radius in the object's own chart around the origin: a ball of `radius`
// metres around `centre` there. False: not all of it is in the cell's chart.
bool bend_sphere(const Bend *b, Vec3 centre, float radius, Frame *world_from_object);

// Half of the extent that a length of so many metres from the middle has in the chart.
float bend_extent(float kappa, float length);

#endif
