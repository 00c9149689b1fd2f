// MTL: the material libraries of OBJ files, with the PBR extension (Pr, Pm, Pc, norm, ...) that Blender writes.

#ifndef RAYFOLD_SCENE_IMPORT_MTL_H
#define RAYFOLD_SCENE_IMPORT_MTL_H

#include "base/file.h"
#include "scene/names.h"
#include "scene/scene.h"

// What an OBJ file wants of its libraries, and what has been found so far.
typedef struct MtlWants {
  Scene *scene;
  const char *obj_path;
  const LoadOptions *options;
  const Names *names; // of materials
  int32_t *found;     // one a name: the material's index, -1 where there is none
  Table textures;     // hash of a picture and its use -> texture of the scene; the caller's to finish
} MtlWants;

// Adds those materials of the library that are wanted and not found yet. What the renderer cannot show is a note;
// only memory running out is an error.
bool import_mtl(MtlWants *wants, const char *mtl_path, const FileBytes *file, Err *err);

#endif
