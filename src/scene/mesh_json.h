// Meshes given inside a scene file: "positions", "triangles", "normals" and "texcoords" of a mesh shape, each a flat
// list of numbers or a list of small lists. Other mesh data (colours, tangents, material slots) has no form here.

#ifndef RAYFOLD_SCENE_MESH_JSON_H
#define RAYFOLD_SCENE_MESH_JSON_H

#include "scene/json.h"
#include "scene/scene.h"

typedef struct MeshKey {
  const char *name;
  int per; // numbers an entry
  bool is_required, is_index;
  const char *sentence; // for the manual
} MeshKey;

enum { MESH_KEY_COUNT = 4 };
extern const MeshKey mesh_keys[MESH_KEY_COUNT];

bool mesh_json_is_key(const char *name);
bool mesh_json_is_given(const Json *shape); // has any of the keys

// Reads the keys of a shape into a new mesh of the scene, *mesh_i. Errors have their place in doc.
bool mesh_json_read(Scene *s, const JsonDoc *doc, const Json *shape, const char *name, int32_t *mesh_i,
                    Err *err);

// Appends the mesh as members, a comma before each.
void mesh_json_write(const MeshData *m, Text *out, bool *is_finite);

#endif
