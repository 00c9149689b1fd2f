// Text: a string being built, plus the small questions asked of names. A Text that ran out of memory stays valid
// and says so in `failed`; test it once at the end.

#ifndef RAYFOLD_BASE_TEXT_H
#define RAYFOLD_BASE_TEXT_H

#include <stdbool.h>
#include <stddef.h>

typedef struct Text {
  char *data; // owned, always terminated once something was added; NULL when empty
  size_t length, capacity;
  bool failed;
} Text; // zero is the empty text

void text_add(Text *t, const char *format, ...) __attribute__((format(printf, 2, 3)));
void text_add_n(Text *t, const char *bytes, size_t n);
void text_clear(Text *t);             // empty, memory kept
void text_finish(Text *t);            // frees
const char *text_get(const Text *t);  // never NULL

bool text_equal(const char *a, const char *b);     // NULL equals only NULL
bool text_ends(const char *s, const char *suffix); // ASCII case ignored

// The candidate nearest to name by edit distance, or NULL if none is near enough to be meant.
const char *text_nearest(const char *name, const char *const *candidates, size_t count);

// "; did you mean "x"?" into out, or "" when nothing is near. Returns out.
const char *text_hint(char out[120], const char *name, const char *const *candidates, size_t count);

// Turns what a terminal would obey instead of show (control characters, C0 but \n and, in UTF-8, C1) into '?': names
// in hostile files end up in messages.
void text_disarm(char *s);

// The path's last component, and its extension with the dot, lower case not applied ("" when there is none).
const char *path_base(const char *path);
const char *path_extension(const char *path);

#endif
