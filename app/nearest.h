// Nearest: which of the known names a mistyped one was meant to be.

#ifndef RAYFOLD_APP_NEAREST_H
#define RAYFOLD_APP_NEAREST_H

#include <stddef.h>

typedef struct Nearest {
  const char *word; // what was typed
  const char *best; // the nearest name so far; NULL: none is near enough to be meant
  size_t distance;  // of best
} Nearest;

Nearest nearest_begin(const char *word);
void nearest_try(Nearest *n, const char *candidate);

// "; did you mean "x"?" or "" when nothing is near. Returns out.
const char *nearest_hint(const Nearest *n, const char *prefix, char out[160]);

#endif
