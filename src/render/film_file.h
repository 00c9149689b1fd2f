// Films in files (.rff), so that a render survives the end of the program and parts of one picture made on many
// machines can be put together. All numbers are little-endian; a film's sums are integers, so what comes back is
// what went in.
//
//   head (FilmHead) | sample ranges, 3 x u32 each | note | arrays, one after another, as in film.h
//
// Ranges and note are padded to 8 bytes.
//
// Whoever writes keeps the file of before under the name PATH~, and whoever reads takes that if PATH is damaged.

#ifndef RAYFOLD_RENDER_FILM_FILE_H
#define RAYFOLD_RENDER_FILM_FILE_H

#include "base/text.h"
#include "render/film.h"

enum { FILM_MOST_NOTE = 1 << 20 }; // bytes

// What goes with a film: which picture it is of (0: not said), and what else its maker wants to know again.
typedef struct FilmLabel {
  uint64_t key;
  Text note;
} FilmLabel; // zero is empty; text_finish(&note)

// Whole samples only: ERR_BAD_ARGUMENT for a film whose pass was broken off.
bool film_write(const Film *f, uint64_t key, const char *note, const char *path, Err *err);

// NULL and why: ERR_NOT_FOUND, or ERR_BAD_SCENE for a file that is no film, damaged, or of another version.
// *is_older: PATH is damaged, and this is the one before it.
Film *film_read(const char *path, FilmLabel *label, bool *is_older, Err *err);

#endif
