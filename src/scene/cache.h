// The cache beside a model: "bunny.obj.rfm" is bunny.obj as a saved model, taken in its place as long as it fits. It
// fits when the bytes of every file the model was made of (its .mtl and .bin files too) have the same hash as then,
// the textures it found or missed are still there or still missing, and it was loaded with the same options. Nothing
// goes by times of files. A cache that does not fit, of another version or damaged, is written anew without a word.

#ifndef RAYFOLD_SCENE_CACHE_H
#define RAYFOLD_SCENE_CACHE_H

#include "base/text.h"
#include "scene/scene.h"

// Where the cache of a model lies, into out (cleared first).
void cache_path(Text *out, const char *model_path);

// A number of the options a model was loaded with, as far as they decide what becomes of it; never 0.
uint64_t cache_key(const char *model_path, const LoadOptions *options);

// Fills the scene from the cache of the model at path. False: there is none that fits, and the scene may be half full.
bool cache_load(Scene *s, const char *path, const LoadOptions *options);

// Importers call these for every file beside the model's own: what was read (NULL: it could not be), and what was only
// looked for. Without options->use_cache they do nothing. False on no memory.
bool cache_add_content(Scene *s, const char *file, const FileBytes *bytes, const LoadOptions *options);
bool cache_add_name(Scene *s, const char *file, const LoadOptions *options);

#endif
