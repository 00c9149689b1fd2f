// Values: one field between JSON and memory. Checks type, range, choice and reference; says in plain words what is
// wrong, and leaves the place to the caller (a file's line, or the path of an edit). Knows no field by heart.

#ifndef RAYFOLD_SCENE_VALUE_H
#define RAYFOLD_SCENE_VALUE_H

#include "scene/json.h"
#include "scene/kinds.h"

enum { LONGEST_TEXT = 4096 }; // bytes of a text, name or file name in a scene

// Reads v into the field at `at`, which stays as it was on failure. References are looked up in the scene, texts kept
// in its arena. *item is the list item at fault on failure, or -1.
bool value_read(Scene *s, const Field *f, const Json *v, void *at, int *item, Err *err);

// Appends the field's value as compact JSON. A number that is not finite comes out as null and sets *is_finite to
// false (may be NULL).
void value_write(const Scene *s, const Field *f, const void *at, Text *out, bool *is_finite);

bool value_is_default(const Field *f, const void *at);

// One component of a field of several numbers, as a field of its own; false past the last.
bool value_component(const Field *f, int i, Field *component);

size_t value_size(const Field *f); // bytes in memory

// "between 0 and 1", "at least 1e-06 m", ...; empty when only the float's own range limits it.
void value_range(const Field *f, Text *out);

#endif
