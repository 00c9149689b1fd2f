// Frames: which pictures of a moving scene are wanted, and the names of their files.

#ifndef RAYFOLD_APP_FRAMES_H
#define RAYFOLD_APP_FRAMES_H

#include "options.h"

#include <limits.h>

typedef struct Frames {
  bool is_wanted;        // several pictures; false: one, at `at`
  long first, end, step; // [first, end); frame N shows the moment N / fps
  double at;             // s
} Frames;

// Reads --frames as far as it can be read without the scene: *is_all says that it is "all".
ExitCode frames_read(const Args *a, Frames *out, bool *is_all);

// "all": from the first moment to the last, without the last, which a loop would show twice.
void frames_take_all(Frames *f, double start, double end, double fps);

long frames_count(const Frames *f);

enum { FRAME_NONE = INT_MIN };
// The file of a frame: a run of # in the name becomes the number, so many digits wide; without one, the number comes
// before the extension, four digits wide. FRAME_NONE, and outputs that are no picture files: the name as it is.
void frame_name(char out[PATH_MAX], const char *output, long frame);

#endif
