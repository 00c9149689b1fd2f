// Notes: things the user should know that are not errors ("KHR_materials_sheen is ignored"). Each is kept once, in
// the order it came up. Not for two threads at once.

#ifndef RAYFOLD_BASE_NOTES_H
#define RAYFOLD_BASE_NOTES_H

#include "base/array.h"

typedef struct Notes {
  ARRAY(char *) lines; // owned
} Notes;               // zero is no notes

// Adds the line unless it is there already. notes may be NULL. At most 200 lines are kept.
void note_once(Notes *notes, const char *format, ...) __attribute__((format(printf, 2, 3)));
void notes_finish(Notes *notes);

#endif
