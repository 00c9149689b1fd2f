// Kinds: the index of every field table, grouped as the scene file groups them. Reader, writer, schema, manual and
// edits walk these and know no material or light by heart.

#ifndef RAYFOLD_SCENE_KINDS_H
#define RAYFOLD_SCENE_KINDS_H

#include "base/text.h"
#include "scene/scene.h"

// One kind of a group: a case of its union.
typedef struct Kind {
  const char *name;     // in files
  const Field *fields;
  size_t field_count;
  const char *sentence; // for the manual
} Kind;

// A group of kinds that share one struct: { name?, kind?, common fields, union of kinds, nested group? }.
typedef struct Group Group;
struct Group {
  const char *name;       // "materials", "camera", ...
  const char *noun;       // "material", for messages
  size_t size;            // of the struct
  bool has_name;          // the struct begins with its name, a const char *
  bool has_kind;          // false: one kind, no "kind" key
  bool kind_optional;     // a file may leave "kind" out and means kind 0
  size_t kind_offset;     // int32_t
  size_t union_offset;    // where the kinds' fields count from
  const Field *common;    // fields all kinds have, may be empty
  size_t common_count, common_offset;
  const Kind *kinds;
  size_t kind_count;
  const Group *nested;    // a group inside this one, its key is nested->name; NULL: none
  size_t nested_offset;
  const char *sentence;
};

extern const Group group_about, group_render, group_whitted, group_develop, group_camera, group_cameras, group_sky, group_skies,
    group_cell, group_gate, group_texture, group_material, group_medium, group_object, group_shape, group_light,
    group_timeline, group_track, group_voxel, group_voxel_step;

// Sets kind and all fields to their defaults, the nested group to its kind 0; everything else in the struct is
// cleared, and indices of bulk data are -1.
void group_default(const Group *g, int32_t kind, void *object);

// The object's kind, or kind 0's entry for groups without a kind.
const Kind *group_kind(const Group *g, const void *object);

// The index of a kind's name; -1 if there is none.
int32_t group_find_kind(const Group *g, const char *name);

// The i-th field of an object of this group, common ones first, and where it lies; NULL past the last.
const Field *group_field_at(const Group *g, const void *object, size_t i, void **at);

// The same by name; NULL if the object's kind has no such field.
const Field *group_find_field(const Group *g, const void *object, const char *name, void **at);

// The nested group's struct inside object; NULL if there is none.
void *group_nested(const Group *g, const void *object);

// Where an object's name is kept; NULL for groups without names.
const char **group_name(const Group *g, const void *object);

// Do its objects stand in a list, each with a name of its own as a member?
bool group_is_listed(const Group *g);

// Where a field lies in the struct; is_common says which of the two tables it is from.
void *group_field(const Group *g, const void *object, const Field *f, bool is_common);

// The i-th of a choice's names ("a|b|c") copied into out (of 40 bytes); false past the last.
bool choice_name(const Field *f, int32_t i, char out[40]);

// --- where each group sits in a scene -------------------------------------------------------------
typedef enum SectionForm {
  SECTION_ONE,     // one struct
  SECTION_BY_NAME, // an array; in files a dictionary by name
  SECTION_LIST,    // an array; in files a list
} SectionForm;

typedef struct Section {
  const Group *group;  // its name is the section's key in a file
  SectionForm form;
  size_t offset;       // in Scene: of the struct, or of the ARRAY
  bool has_given;      // Scene holds a bool that says whether a file or an edit gave it
  size_t given_offset;
} Section;

enum { SECTION_COUNT = 17 };
extern const Section scene_sections[SECTION_COUNT]; // in the order of the scene file

const Section *section_find(const char *name); // NULL: none of that name
size_t section_count(const Scene *s, const Section *c);
void *section_at(const Scene *s, const Section *c, size_t i);                  // i < section_count()
int32_t section_index(const Scene *s, const Section *c, const char *name);     // the first of that name, -1: none
int32_t scene_find_model(const Scene *s, const char *file);                    // its path, as resolved; -1: none
bool *section_given(const Scene *s, const Section *c);                         // NULL: always counts as given

// Names are found by a table, which must hear of every change but elements that join at the end.
void section_names_changed(Scene *s, const Section *c);
void section_names_finish(Scene *s);

// A name nobody in the section has, in the scene's arena: the wanted one (NULL: the section's noun), or the first free
// of "wanted.2", "wanted.3", ... NULL when memory is out.
const char *section_free_name(Scene *s, const Section *c, const char *wanted);

// Puts a copy of element in front of the i-th (or last); references to those behind it move along. False when
// memory is out or the section is full. Not for SECTION_ONE.
bool section_insert(Scene *s, const Section *c, size_t i, const void *element);

// Takes the i-th out; references to those behind it move along, mesh slots that name it become none.
void section_remove(Scene *s, const Section *c, size_t i);

// What refers to the i-th element, as "materials.gold"; false if nothing does.
bool section_user(const Scene *s, const Section *c, size_t i, Text *who);

// The path of an element, its name quoted where needed: materials."my mat", objects[3].
void section_path(const Scene *s, const Section *c, size_t i, Text *out);

// The section that fields of this type refer to; NULL for types that refer to nothing.
const Section *section_of_reference(FieldType type);

#endif
