// Polygons into triangles: fans where the polygon is convex, ear clipping where it is not, in bounded time. The
// triangles keep the polygon's direction. Holes and self-crossing polygons come out as something, not as an error.

#ifndef RAYFOLD_SCENE_TRIANGULATE_H
#define RAYFOLD_SCENE_TRIANGULATE_H

#include "base/array.h"

#include <stdint.h>

// Scratch memory, and the work left: ear clipping is quadratic, so a file gets a fixed number of point tests in all
// and its later concave polygons become fans.
typedef struct Triangulator {
  ARRAY(double) points; // x, y a corner: the polygon seen along its normal
  ARRAY(uint32_t) ring; // previous and next corner of each corner not yet cut off
  size_t tests_left;
  size_t fan_count; // concave polygons that were fanned for want of work or because no ear was found
} Triangulator;

void triangulator_init(Triangulator *t);
void triangulator_finish(Triangulator *t);

// A polygon of n >= 3 corners, 3 floats each, into n - 2 triangles: 3 corner numbers each in out. False when memory
// is out.
bool triangulate(Triangulator *t, const float *corners, uint32_t n, uint32_t *out);

#endif
