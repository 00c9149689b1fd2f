// Tracks: fields that move. A track's keys are checked against the field its path leads to when the track is read, and
// from then on a moment's value is a function of the keys alone. To show a moment is to set fields, as edits do, but
// without history: whoever looks at the scene afterwards sees what the moment shows and nothing else.

#ifndef RAYFOLD_SCENE_TRACK_H
#define RAYFOLD_SCENE_TRACK_H

#include "scene/keys.h"

// Gives the track its values. On failure *item is the key at fault or -1, *member the member of that key or the
// track's field to blame.
bool track_bind(Scene *s, Track *t, int *item, const char **member, Err *err);

// What the moment changed.
typedef enum Moved {
  MOVED_CAMERA = 1 << 0, // only where it is seen from
  MOVED_WORLD = 1 << 1,  // what there is to see
} Moved;

// Sets every field that a track moves, and all that the clip moves, in the scene and its models, to the moment. Fails
// where a path leads nowhere any more, or a value cannot be (a camera in its own target): some fields have moved then.
// moved (may be NULL) gets bits of Moved.
bool scene_set_time(Scene *s, double seconds, unsigned *moved, Err *err);

// Models inside scenes play the scene's clip where they have one of that name, else their first.

// First and last moment of the timeline, or of all keys and clips. False: nothing moves.
bool scene_time_range(const Scene *s, double *start, double *end);

#endif
