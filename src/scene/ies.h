// Ies: a lamp's measured distribution of light, from an IES file (IESNA LM-63-1991, -1995 and -2002), type C: planes
// around the lamp's axis. Files that give a quarter or a half by symmetry are unfolded to the whole turn.
//
// Not read: TILT other than NONE, types A and B, and the size of the lamp, which stays a point.

#ifndef RAYFOLD_SCENE_IES_H
#define RAYFOLD_SCENE_IES_H

#include "base/err.h"

#include <stddef.h>
#include <stdint.h>

// Angles in degrees, ascending: vertical from the axis (down for a hanging lamp), horizontal from 0 to 360, or one of 0
// where all planes are alike.
typedef struct Ies {
  uint32_t vertical_count, horizontal_count;
  float *vertical, *horizontal; // owned
  float *candela;               // owned; a row of all vertical angles for each horizontal one; multipliers applied
  float peak;                   // the largest of them, above 0
} Ies;                          // zero is none

bool ies_read(Ies *out, const char *name, const void *bytes, size_t size, Err *err); // name is for messages
void ies_finish(Ies *i); // accepts zero

#endif
