// Voxels inside a scene file: "size", "palette", "cells" and "fill" of a shape of kind voxels.

#ifndef RAYFOLD_SCENE_VOXELS_JSON_H
#define RAYFOLD_SCENE_VOXELS_JSON_H

#include "image/voxels.h"
#include "scene/element.h"

typedef struct VoxelKey {
  const char *name, *type, *schema; // of its JSON, and what its schema says besides
  const char *sentence;    // for the manual
} VoxelKey;

enum { VOXEL_KEY_COUNT = 4 };
extern const VoxelKey voxel_keys[VOXEL_KEY_COUNT];

bool voxels_json_is_key(const char *name);

// After the shape's fields, and its file: makes shape->voxels_i from its keys. Errors have their place in r->doc.
bool voxels_json_read(const ElementReader *r, const Json *dict, ElementPlace place, Shape *shape);

// Appends them as members, a comma before each.
void voxels_json_write(const Scene *s, const Shape *shape, Text *out);

// The shape's voxels after one more step or a list of them, a document of its own, as a new element of scene.voxels, whose
// index is *voxels_i.
bool voxels_json_strokes(const ElementReader *r, const Shape *shape, int32_t *voxels_i);

#endif
