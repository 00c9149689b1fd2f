// MTL: the material libraries of OBJ files, with the PBR extension (Pr, Pm, Pc, norm, ...) that Blender writes.

#ifndef RAYFOLD_SCENE_IMPORT_MTL_H
#define RAYFOLD_SCENE_IMPORT_MTL_H

#include "base/file.h"
#include "scene/names.h"
#include "scene/scene.h"

// Adds those materials of the library that are wanted and not found yet, and puts their indices into found (one a
// name, -1 where there is none). What the renderer cannot show is a note; only memory running out is an error.
bool import_mtl(Scene *s, const char *obj_path, const char *mtl_path, const FileBytes *file,
                const Names *wanted, int32_t *found, const LoadOptions *options, Err *err);

#endif
