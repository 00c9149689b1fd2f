// Saved models from the world's side: the trees are built here and go with the scene into the file (scene/rfm.h).

#ifndef RAYFOLD_WORLD_MODEL_SAVE_H
#define RAYFOLD_WORLD_MODEL_SAVE_H

#include "base/jobs.h"
#include "scene/scene.h"

// The scene as a saved model at path, which stands for itself: a picture that does not lie in path's folder or below it
// goes inside. Models that the scene names stay files of their own. The whole file or none.
bool model_save(const Scene *s, const char *path, Jobs *jobs, const Cancel *cancel, Err *err);

// Writes the caches that are missing or stale: of a scene just loaded with options->use_cache, not yet edited, and of
// the models it names. True if any was written; loading the scene again then takes them. One that cannot be written
// costs a note.
bool model_save_caches(Scene *s, const LoadOptions *options, const Cancel *cancel);

#endif
