// Splits a mesh with several materials into meshes with one each, for files that know no material slots.

#ifndef RAYFOLD_SCENE_MESH_SPLIT_H
#define RAYFOLD_SCENE_MESH_SPLIT_H

#include "scene/scene.h"

typedef struct MeshPart {
  MeshData *data;   // one use of it, owned
  int32_t material; // of all its triangles, -1: none
} MeshPart;

typedef struct MeshParts {
  ARRAY(MeshPart) list;
} MeshParts; // zero is no parts

// One part for each material that a triangle has, in the order of the scene's materials, none first. Vertices that no
// triangle uses are left out, except of a large mesh with one material, which is shared, not copied.
bool mesh_split(const Mesh *mesh, size_t material_count, MeshParts *out, Err *err);
void mesh_parts_finish(MeshParts *p); // accepts zero

#endif
