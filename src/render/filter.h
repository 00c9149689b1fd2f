// Filter: the shape of a pixel. Samples are placed with the filter's own density and then count fully (filter
// importance sampling, Ernst, Stamminger and Greiner 2006), so each belongs to exactly one pixel and films merge
// without borders. The filters are products of one curve in x and y, held as that curve's inverse distribution.

#ifndef RAYFOLD_RENDER_FILTER_H
#define RAYFOLD_RENDER_FILTER_H

#include "base/vec.h"
#include "scene/scene.h"

enum { FILTER_STEPS = 512 };

typedef struct Filter {
  float place[FILTER_STEPS +
              1]; // pixels from the middle: place[i] has i / FILTER_STEPS of the weight on its left
} Filter;

// width in pixels; 0 is the usual one: 1 for box, 3 for the others.
void filter_build(Filter *out, FilterKind kind, float width);

static inline float filter_place(const Filter *f, float u)
{
  const float s = u * FILTER_STEPS;
  const int i = (int)s;
  const float t = s - (float)i;
  return f->place[i] + t * (f->place[i + 1] - f->place[i]);
}

static inline Vec2 filter_sample(const Filter *f, Vec2 u)
{
  return (Vec2){filter_place(f, u.x), filter_place(f, u.y)};
}

#endif
