// Keys: the values of one track in time, as the scene file has them. Reads, checks and writes their form; which values
// a field can take is known to track.c alone, so they are kept here as JSON.

#ifndef RAYFOLD_SCENE_KEYS_H
#define RAYFOLD_SCENE_KEYS_H

#include "scene/json.h"
#include "scene/scene.h"

// How one key goes on to the next: an Easing, or
enum { KEY_AS_TRACK = -1, KEY_BEZIER = -2, KEY_SPLINE = -3 };

typedef struct Key {
  float time;               // s; later than that of the key before
  int32_t easing;           // Easing, or KEY_...
  float bezier[4];          // of KEY_BEZIER: x1, y1, x2, y2 as CSS has them; x in 0..1
  const char *value;        // JSON
  const char *in, *out;     // JSON; NULL but for splines: the field's change a second, before and after the key
} Key;

typedef struct Keys { // immutable once read
  size_t count;       // at least 1
  Key items[];
} Keys;

typedef struct KeyMember {
  const char *name;
  const char *schema; // the inside of its JSON schema, "" for anything
  const char *sentence;
} KeyMember;
enum { KEY_MEMBER_COUNT = 5 };
extern const KeyMember key_members[KEY_MEMBER_COUNT];

// Reads a list of keys into the scene's arena. On failure *item is the key at fault (or -1) and *member the member of
// it (or NULL).
const Keys *keys_read(Scene *s, const Json *list, int *item, const char **member, Err *err);
void keys_write(const Keys *k, Text *out);

#endif
