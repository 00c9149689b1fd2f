// Elements: one material, light, object, ... between JSON and its struct, by its group's tables. The scene file's
// reader and the edit language both read through here, so that they accept the same things.

#ifndef RAYFOLD_SCENE_ELEMENT_H
#define RAYFOLD_SCENE_ELEMENT_H

#include "scene/value.h"

typedef struct ElementReader {
  Scene *scene; // where names are looked up and texts and meshes go
  const JsonDoc *doc;
  const LoadOptions *options;
  bool is_edit; // "mesh": N names a mesh the scene holds already
  Err *err;
} ElementReader;

// Where a dictionary stands in its document: member `key` of container, or item `index` of it.
typedef struct ElementPlace {
  const Json *container; // NULL: the document's root
  const char *key;
  size_t index;
} ElementPlace;

// Fills out (the group's struct) from a dictionary: defaults first, then its members, then element_check(), and the
// nested group likewise. out holds a valid or cleared struct before: its name, id and embedded picture stay unless
// the dictionary says otherwise. It is garbage on failure.
bool element_read(const ElementReader *r, const Group *g, const Json *dict, ElementPlace place, void *out);

// What ranges cannot say: a camera that looks nowhere, a scale of zero, a file that is missing. *field is the name
// of the field at fault, or NULL. Looks at one group, not at the nested one.
bool element_check(const Group *g, const void *element, const char **field, Err *err);

// Lets go of an embedded picture that a file or another kind has replaced.
void element_drop_unused(const Group *g, void *element);

// Loads the file of a mesh shape (g may be any group; others have nothing to load) unless that was done.
bool element_load_model(Scene *s, const Group *g, void *element, const LoadOptions *options, Err *err);

// Appends the element as compact JSON, only what differs from defaults. as_list_item adds the name as a member.
// mesh_limit: meshes of more triangles are written as "mesh": N, which only edits can read back.
void element_write(const Scene *s, const Group *g, const void *element, bool as_list_item, size_t mesh_limit,
                   Text *out, bool *is_finite);

// The key of element_write()'s mesh reference.
extern const char element_mesh_key[];

#endif
