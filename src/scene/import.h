// What the importers of bare model files share: how a finished mesh gets into the scene, and where a texture's file
// lies. One file becomes one mesh with a material slot a triangle, and one object that shows it.

#ifndef RAYFOLD_SCENE_IMPORT_H
#define RAYFOLD_SCENE_IMPORT_H

#include "base/text.h"
#include "scene/scene.h"

// Checks data and adds mesh and object; takes over one use of data, also on failure. path is for messages; name
// NULL or empty takes the file's name without extension. slots (may be NULL) are copied.
bool import_add_mesh(Scene *s, const char *path, const char *name, MeshData *data, const int32_t *slots,
                     size_t slot_count, Err *err);

// Finds a picture named in owner_path (the model or its material file), and gives its path relative to the folder
// of `path`, the scene's file, as FIELD_file wants it. A path from another machine's disk is tried by its last
// part. NULL when it is missing or must not be read, with a note saying so.
const char *import_find_file(Scene *s, const char *path, const char *owner_path, const char *name,
                             const LoadOptions *options);

// An image texture of this file with all else default; -1 when memory is out.
int32_t import_add_image(Scene *s, const char *file);

// A scene file's content that lies in memory; path is for messages.
bool import_json_text(Scene *s, const char *path, const char *text, size_t size, const LoadOptions *options, Err *err);

// A file of one of NoEucRT's elements, which options->element names. Bad ones are refused with file and line.
bool import_element(Scene *s, const char *path, const LoadOptions *options, Err *err);

#endif
