// Targets: what the path of an edit names (see edit.h for the language). Private to the edit language.

#ifndef RAYFOLD_SCENE_TARGET_H
#define RAYFOLD_SCENE_TARGET_H

#include "scene/value.h"

typedef enum TargetPart {
  TARGET_SCENE,   // ""
  TARGET_SECTION, // "materials": a whole section of many
  TARGET_WHOLE,   // "camera", "materials.gold", "objects.bunny.shape"
  TARGET_KIND,
  TARGET_NAME,
  TARGET_FIELD,
  TARGET_STROKE, // "objects.castle.shape.stroke": no field, but what edits voxels
} TargetPart;

typedef struct Target {
  TargetPart part;
  const Section *section;
  size_t index; // of the element; the section's count when it is new
  bool is_new;
  Text name;          // of a new element, owned; empty: none
  const Group *group; // of the innermost thing: the element's, or the one nested in it
  bool is_nested;
  Field field;    // of TARGET_FIELD: the field, or one component of it
  bool is_common; // its offset counts from the common fields
} Target;

// False with a message that names the path and the nearest name there is. Finish it in any case.
bool target_find(const Scene *s, const char *path, Target *t, Err *err);
void target_finish(Target *t);

// Where the target's group and field lie in (a copy of) the element.
void *target_group(const Target *t, void *element);
void *target_field(const Target *t, void *element);

#endif
