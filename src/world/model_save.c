// See model_save.h.

#include "world/model_save.h"

#include "accel/saved_tree.h"
#include "scene/cache.h"
#include "scene/rfm.h"
#include "world/parts.h"

#include <sys/stat.h>
#include <unistd.h>

// What goes into a file besides the scene: for each mesh the bytes of its tree.
typedef struct SavedTrees {
  WorldParts parts;
  TreeHead *heads;
  SavedTree *trees;
} SavedTrees;

static void trees_finish(SavedTrees *t)
{
  parts_finish(&t->parts);
  mem_free(t->heads);
  mem_free(t->trees);
}

static bool make_trees(SavedTrees *t, const Scene *s, Jobs *jobs, const Cancel *cancel, Err *err)
{
  const size_t count = s->meshes.count;
  if (!count) return true;
  t->parts.tree_options.quality = s->render.tree == SCENE_TREE_BEST ? TREE_BEST : TREE_FAST;
  t->heads = mem_zero(count, sizeof *t->heads);
  t->trees = mem_zero(count, sizeof *t->trees);
  bool ok = t->heads && t->trees;
  for (size_t i = 0; ok && i < count; i++) ok = parts_add_mesh(&t->parts, NULL, s->meshes.items[i].data) >= 0;
  if (!ok) return err_memory(err, "the trees to save", count * sizeof *t->trees);
  if (!parts_make(&t->parts, jobs, cancel, err)) return false;
  for (size_t i = 0; i < count; i++) {
    const int32_t part = parts_add_mesh(&t->parts, NULL, s->meshes.items[i].data); // known by now
    t->trees[i] = mesh_tree_save(t->parts.meshes.items[part].tree, &t->heads[i]);
  }
  return true;
}

// A scene that took the place of a model it shows would show itself.
static bool check_models(const Scene *s, const char *path, Err *err)
{
  struct stat own, model;
  for (size_t i = 0; i < s->models.count; i++)
    if (!stat(path, &own) && !stat(s->models.items[i].file, &model) && own.st_dev == model.st_dev &&
        own.st_ino == model.st_ino)
      return err_set(err, ERR_BAD_ARGUMENT,
                     "%s: the scene itself shows this file; save it under another name", path);
  return true;
}

bool model_save(const Scene *s, const char *path, Jobs *jobs, const Cancel *cancel, Err *err)
{
  SavedTrees t = {0};
  Scene *moved = check_models(s, path, err) ? scene_move(s, path, err) : NULL;
  const bool ok =
      moved && make_trees(&t, moved, jobs, cancel, err) && rfm_write(moved, t.trees, false, 0, path, err);
  trees_finish(&t);
  scene_destroy(moved);
  return ok;
}

// Asked before the trees are built: without a place for them that would be work for nothing.
static bool can_write_beside(const char *path, Err *err)
{
  Text folder = {0};
  path_folder(&folder, path);
  const bool ok = !access(text_get(&folder), W_OK) ||
                  err_set(err, ERR_IO, "the folder \"%s\" cannot be written to", text_get(&folder));
  text_finish(&folder);
  return ok;
}

static bool save_cache(const Scene *s, const LoadOptions *options, const Cancel *cancel, Err *err)
{
  SavedTrees t = {0};
  Text path = {0};
  cache_path(&path, s->path);
  LoadOptions own = *options; // as this model was loaded, which may be by another scene
  own.root = s->root;
  own.allow_outside = s->allow_outside;
  const bool ok = can_write_beside(s->path, err) && make_trees(&t, s, options->jobs, cancel, err) &&
                  rfm_write(s, t.trees, true, cache_key(s->path, &own), text_get(&path), err);
  trees_finish(&t);
  text_finish(&path);
  return ok;
}

// Scenes nest at most 16 deep, so this may call itself.
static bool save_caches(Scene *s, const LoadOptions *options, const Cancel *cancel, Notes *notes)
{
  Err err = {0};
  bool is_any = s->wants_cache && save_cache(s, options, cancel, &err);
  if (err.kind && err.kind != ERR_CANCELLED)
    note_once(notes, "%s: no cache is kept: %.900s", s->path, err.text);
  for (size_t i = 0; i < s->models.count; i++)
    is_any |= save_caches(s->models.items[i].scene, options, cancel, notes);
  return is_any;
}

bool model_save_caches(Scene *s, const LoadOptions *options, const Cancel *cancel)
{
  return save_caches(s, options, cancel, &s->notes);
}
