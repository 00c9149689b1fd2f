// Progress: how far the render is, on stderr. On a terminal one line that is redrawn; elsewhere one line
// "progress 0.42 eta 31" a second; nothing when quiet. It shows, and decides nothing.

#ifndef RAYFOLD_APP_PROGRESS_H
#define RAYFOLD_APP_PROGRESS_H

#include <rayfold/rayfold.h>

#include <stdbool.h>

typedef enum ProgressManner { PROGRESS_NONE, PROGRESS_LINES, PROGRESS_BAR } ProgressManner;

typedef struct Progress {
  ProgressManner manner;
  bool has_blocks, has_colour; // what the terminal shows
  bool is_drawn;               // a line stands there
  double next_line;            // seconds since the start; PROGRESS_LINES
  char label[32];              // in front of the numbers, "frame 12"; may be empty
} Progress;

Progress progress_begin(bool is_quiet);
void progress_stage(Progress *p, const char *what, const char *name);           // "loading castle.json"
void progress_show(Progress *p, const rf_progress *now, double samples_wanted); // 0: as many as time allows
void progress_clear(Progress *p); // before anything else is said, and at the end

#endif
