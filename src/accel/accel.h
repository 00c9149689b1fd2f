// Accel: everything a ray can hit, as two levels of trees. The lower level is one MeshTree a mesh, shared by all its
// instances and by successive worlds; the upper level is one tree over the instances' boxes. Immutable once built.
//
//   Accel: top tree -> Instance (map, mask) -> MeshTree: Node8 -> Tri8 blocks, or the same made compact
//                                           or a shape: sphere, quad, disk, solid, body of solids, voxels, distance
//                                           field
//
// Instances without ends (planes, cylinders and cones that go on for ever) stand in a list of their own, which every ray
// walks first: their boxes would cover every node of the tree.
//
// This header is the cold side (building, owning). accel/traverse.h is the hot side: closest hit and any hit.

#ifndef RAYFOLD_ACCEL_ACCEL_H
#define RAYFOLD_ACCEL_ACCEL_H

#include "base/err.h"
#include "base/jobs.h"
#include "base/ray.h"
#include "geom/csg.h"
#include "geom/voxel_walk.h"
#include "geom/sdf.h"

#include <stddef.h>

typedef struct MeshTree MeshTree; // counted

// Fast: splits between triangles. Best: triangles may also be cut in pieces; two to seven times the building time, up
// to a fifth more memory, the same hits, and in rooms, where large triangles lie beside small ones, faster rays.
typedef enum TreeQuality { TREE_FAST, TREE_BEST } TreeQuality;
// How a mesh's tree is laid out. Both give the same hits, bit for bit.
typedef enum TreeLayout {
  TREE_FLOAT,   // the fastest to trace: boxes and vertices as floats, about 54 bytes a triangle
  TREE_COMPACT, // boxes in bytes, vertices left where they are: about 7 bytes; see accel/compact.h
} TreeLayout;

typedef struct TreeOptions { // zero is a good default
  TreeLayout layout;
  TreeQuality quality;
} TreeOptions;

// Builds the tree of an indexed triangle list (3 floats a vertex, 3 indices a triangle, all in range, positions
// finite). TREE_FLOAT keeps no pointer to the arrays. TREE_COMPACT reads both while rays are traced: they stay the
// caller's, and must neither change nor go before the tree's last user. Triangles of zero area are kept out:
// nothing can hit them. jobs may be NULL. The result does not depend on the number of threads. NULL on no memory
// or cancel.
MeshTree *mesh_tree_build(const float *positions, size_t vertex_count, const uint32_t *triangles,
                          size_t triangle_count, TreeOptions options, Jobs *jobs, const Cancel *cancel,
                          Err *err);

// The next tree of a mesh whose vertices moved: hits are those of a built one, made in a fourth to a seventh of the
// time from the tree of the same triangles (same indices in the same order) at other positions. Parts that have become
// slow to trace are built anew, and where that is most of it, the whole. `old` stays as it is.
MeshTree *mesh_tree_refit(const MeshTree *old, const float *positions, size_t vertex_count, const uint32_t *triangles,
                          size_t triangle_count, Jobs *jobs, const Cancel *cancel, Err *err);
MeshTree *mesh_tree_share(MeshTree *t);
void mesh_tree_release(MeshTree *t); // accepts NULL
size_t mesh_tree_bytes(const MeshTree *t); // without the mesh's own arrays
void mesh_tree_bounds(const MeshTree *t, float lo[3], float hi[3]); // lo > hi when it is empty

typedef enum InstanceKind {
  INSTANCE_MESH,
  INSTANCE_SPHERE,
  INSTANCE_QUAD,
  INSTANCE_DISK,
  INSTANCE_SOLID,
  INSTANCE_CSG,
  INSTANCE_VOXELS,
  INSTANCE_SDF,
} InstanceKind;

// A placed shape. In object space a sphere has radius size[0] about the origin, a quad spans
// [-size[0], size[0]] x [-size[1], size[1]] in the plane z = 0, a disk has radius size[0] there; both face +z.
// A solid is as geom/solid.h says; a body of solids has its leaves placed in the world, and the identity for a map. Of voxels
// a cell is 1 wide, and the grid begins at the origin.
typedef struct Instance {
  Frame world_from_object, object_from_world;
  MeshTree *mesh;     // of INSTANCE_MESH; shared
  union {
    const Solid *solid; // of INSTANCE_SOLID; must outlive the tree
    const Csg *csg;     // of INSTANCE_CSG; likewise
    const VoxelBody *voxels; // of INSTANCE_VOXELS; likewise
    const Sdf *sdf;     // of INSTANCE_SDF; likewise
  };
  float size[2];
  uint8_t kind;       // InstanceKind
  uint8_t mask;       // RayMask bits of the rays that see it
  bool has_filter;    // hits must be asked about (alpha, single-sided surfaces)
  bool is_identity;   // the map is exactly the identity: the ray need not be transformed
} Instance;

typedef struct Accel Accel;

// Takes a copy of the instances and shares their meshes. Instances with a singular map hit nothing.
Accel *accel_build(const Instance *instances, size_t count, Jobs *jobs, const Cancel *cancel, Err *err);
// Several trees over one list: out[k] has in it the instances whose cell_of is k, and all know all instances by the same
// numbers. The first owns the list and must be destroyed last. False: out is all NULL.
bool accel_build_cells(const Instance *instances, const uint32_t *cell_of, size_t count, Accel **out, size_t cell_count,
                       Jobs *jobs, const Cancel *cancel, Err *err);
void accel_destroy(Accel *a); // accepts NULL
void accel_bounds(const Accel *a, float lo[3], float hi[3]); // of all that has ends; lo > hi when there is nothing
// The box in the world of a box in object space, with what rounding may do to a ray on its way there. Not finite where
// the box is not.
Bounds accel_world_bounds(const Frame *world_from_object, const Bounds *b);
size_t accel_bytes(const Accel *a); // upper level only
size_t accel_instance_count(const Accel *a);
const Instance *accel_instances(const Accel *a);

// Asked for every hit on an instance with has_filter: false lets the ray pass. Must be a pure function of its
// arguments, so that the answer does not depend on the order of traversal.
typedef bool HitFilter(const void *user, const Ray *ray, const Hit *candidate);

#endif
