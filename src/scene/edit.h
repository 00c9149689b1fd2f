// The edit language: every field of a scene has a path, every value is JSON, and an edit is `path = value`. The
// command line, the studio, undo, recordings and tests all speak it.
//
//   render.spp   camera.position   camera.position.1   materials.gold.roughness   materials."my mat".color
//   objects.bunny.shape.radius   objects[3].translate   materials.gold.kind   objects[0].name
//
// A whole thing set to a dictionary is replaced, or added under a new name (objects[count] adds, too); set to null it
// is removed, unless something still uses it. A field set to null gets its default. Text that is not JSON is taken
// as a text, so that materials.gold.base_color=#ff0000 needs no quotes. An edit that fails changes nothing.

#ifndef RAYFOLD_SCENE_EDIT_H
#define RAYFOLD_SCENE_EDIT_H

#include "scene/kinds.h"

bool scene_set(Scene *s, const char *path, const char *json, Err *err);

// Appends the value as compact JSON; what scene_set() accepts back. "" is the whole scene, as scene_write() has it.
// A mesh of more than 64 triangles appears as "mesh": N, its index in the scene.
bool scene_get(const Scene *s, const char *path, Text *out, Err *err);

// --- undo -----------------------------------------------------------------------------------------
// An element as it was, or its absence. References are kept by name, so that they survive other edits.
typedef struct Snapshot {
  void *bytes;        // owned; NULL: it was not there
  const char **names; // owned; of what it refers to, in the order of its fields
  bool is_given;      // of a section that may be absent
} Snapshot;

typedef struct Change {
  char *path; // owned; as the edit named it
  const Section *section;
  size_t index;
  Snapshot before, after;
  ARRAY(int32_t *) slots; // of meshes no object shows, which named the removed material
} Change;

typedef struct History {
  ARRAY(Change) changes; // at most 1000, the oldest are forgotten
  size_t done;           // how many of them are in effect; the rest can be redone
} History;               // zero is no history

// All edits of a scene with a history should go through it.
bool history_set(History *h, Scene *s, const char *path, const char *json, Err *err);
bool history_undo(History *h, Scene *s, Err *err); // false and a message if there is nothing to undo
bool history_redo(History *h, Scene *s, Err *err);
void history_finish(History *h);

#endif
