// Display: a picture of display-linear colours as the pixels of a window of any size. Pictures smaller than the window
// are enlarged by Catmull-Rom splines held to the two nearest values, so that edges stay sharp and get no halo; that
// happens on the colours' square roots, which is close to how the eye divides light and to what sRGB stores. A
// picture of the window's size goes straight through the exact sRGB tables: what is seen is what a PNG would hold.

#ifndef RAYFOLD_POST_DISPLAY_H
#define RAYFOLD_POST_DISPLAY_H

#include "base/err.h"
#include "base/jobs.h"

#include <stdint.h>

typedef struct DisplayTap { // of one output column or row: four neighbours and their weights
  uint32_t at[4];
  float weight[4];
} DisplayTap;

typedef struct Display {
  uint32_t from_width, from_height, width, height;
  DisplayTap *columns, *rows; // owned; NULL when both sizes are one
  float *lines;               // owned: a line of four floats a pixel for each worker
} Display;

// Makes ready for pictures of these sizes; does nothing if it is already. Zero is a Display of no size.
bool display_fit(Display *d, uint32_t from_width, uint32_t from_height, uint32_t width, uint32_t height, Jobs *jobs,
                 Err *err);
void display_finish(Display *d);

// rgba: from_width x from_height pixels of 0..1, which are overwritten. out: width x height of 0xffrrggbb.
void display_show(const Display *d, float *rgba, uint32_t *out, Jobs *jobs);

#endif
