// Kept film: the film of `render --film`. Opened if it is there and of the same picture, written as the render goes.
//
// The note in it says whose picture it is: the scene as it was named, a newline, and the scene's develop settings as
// JSON, so that `merge` develops as the render would have.

#ifndef RAYFOLD_APP_KEPT_FILM_H
#define RAYFOLD_APP_KEPT_FILM_H

#include "say.h"

#define KEPT_SECONDS 30 // from one writing to the next

typedef struct KeptFilm {
  const char *path;
  uint64_t key;
  char *note; // owned
  int lock;   // of PATH.lock, held while the render runs; 0: none
} KeptFilm;

typedef struct Range {
  int first, end; // [first, end)
} Range;

// *film: the one in the file, or a new one if there is no file. Says why not when it is of another picture or lacks a
// plane, or another render is at work on the file.
ExitCode kept_film_open(KeptFilm *k, rf_film **film, rf_engine *engine, rf_scene *scene,
                        const rf_world *world, const rf_eye *eye, const char *scene_name, unsigned planes,
                        bool is_quiet);
ExitCode kept_film_write(const KeptFilm *k, rf_engine *engine, const rf_film *film);
void kept_film_finish(KeptFilm *k); // accepts zero

int film_sample_count(const rf_film *film); // the most that a pixel can have

// "castle.json" of a note.
int note_scene_length(const char *note);

#endif
