// Writes one mesh to the formats every program reads. Geometry only: materials, the scene's other objects and
// second texture coordinates are not written. The mesh must have passed mesh_data_check(). Each writes the file whole
// or not at all; false and ERR_IO when it cannot be written.

#ifndef RAYFOLD_SCENE_EXPORT_MESH_H
#define RAYFOLD_SCENE_EXPORT_MESH_H

#include "scene/scene.h"

// Binary, little endian: positions, normals, texture coordinates (s, t), colours (8 bit sRGB and alpha).
bool export_ply(const MeshData *m, const char *path, Err *err);

// Text that reads back as the same floats: positions with sRGB colours, texture coordinates, normals. A mesh with
// material slots gets "usemtl slot_N" lines, which name no library.
bool export_obj(const MeshData *m, const char *path, Err *err);

// Binary: positions only, loose triangles. At most 4294967295 of them (ERR_BAD_ARGUMENT).
bool export_stl(const MeshData *m, const char *path, Err *err);

#endif
