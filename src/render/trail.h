// The trail of a moving eye: what its last frames saw, carried on into the next. Every pixel of a new frame knows how
// far it sees; from where the eye was before, that point lies somewhere in the last picture, and if the same surface
// was there, its colour counts as further samples. What was hidden then is the new frame's alone, so no holes arise.
// Reflections move otherwise than the surface they are seen in; as few frames count, they lag by little. Works for
// perspective eyes; others have no trail.

#ifndef RAYFOLD_RENDER_TRAIL_H
#define RAYFOLD_RENDER_TRAIL_H

#include "base/err.h"
#include "base/jobs.h"
#include "render/camera.h"

enum { TRAIL_MOST = 8 }; // frames that count: more lag visibly in mirrors at 30 frames a second, fewer leave noise

typedef struct TrailFrame {
  uint32_t width, height;
  float *color; // r, g, b and how many frames it stands for
  float *depth; // metres along the view axis, 0: the sky
  size_t room;  // pixels that fit
  Eye eye;
} TrailFrame;

typedef struct Trail { // zero is an empty one
  TrailFrame last, next;
} Trail;

void trail_finish(Trail *t);
void trail_forget(Trail *t); // after a cut, or when the scene has changed

// Blends the trail into the frame's colours (rgba; alpha stays), each new pixel counting as `weight` frames. If `keeps`,
// the result is the trail of the next frame.
bool trail_blend(Trail *t, const Eye *eye, uint32_t width, uint32_t height, float *rgba, const float *depth,
                 float weight, bool keeps, Jobs *jobs, Err *err);

#endif
