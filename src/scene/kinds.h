// Kinds: the index of every field table, grouped as the scene file groups them. Reader, writer, schema, manual and
// edits walk these and know no material or light by heart.

#ifndef RAYFOLD_SCENE_KINDS_H
#define RAYFOLD_SCENE_KINDS_H

#include "scene/scene.h"

// One kind of a group: a case of its union.
typedef struct Kind {
  const char *name;     // in files
  const Field *fields;
  size_t field_count;
  const char *sentence; // for the manual
} Kind;

// A group of kinds that share one struct: { name?, kind?, common fields, union of kinds }.
typedef struct Group {
  const char *name;       // "materials", "camera", ...
  const char *noun;       // "material", for messages
  size_t size;            // of the struct
  bool has_kind;          // false: one kind, no "kind" key
  size_t kind_offset;     // int32_t
  size_t union_offset;    // where the kinds' fields count from
  const Field *common;    // fields all kinds have, may be empty
  size_t common_count, common_offset;
  const Kind *kinds;
  size_t kind_count;
  const char *sentence;
} Group;

extern const Group group_render, group_develop, group_camera, group_sky, group_texture, group_material,
    group_object, group_shape, group_light;

// Sets kind and all fields to their defaults; everything else in the struct to zero.
void group_default(const Group *g, int32_t kind, void *object);

// The object's kind, or kind 0's entry for groups without a kind.
const Kind *group_kind(const Group *g, const void *object);

// The index of a kind's name; -1 if there is none.
int32_t group_find_kind(const Group *g, const char *name);

// Where a field lies in the struct; is_common says which of the two tables it is from.
void *group_field(const Group *g, const void *object, const Field *f, bool is_common);

// The i-th of a choice's names ("a|b|c") copied into out (of 40 bytes); false past the last.
bool choice_name(const Field *f, int32_t i, char out[40]);

#endif
