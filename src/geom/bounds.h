// Bounds: axis-parallel boxes. An empty box has lo = +inf and hi = -inf, so that adding to it needs no case. The
// fourth lanes of both corners are free for their owner's use and take part in nothing here.

#ifndef RAYFOLD_GEOM_BOUNDS_H
#define RAYFOLD_GEOM_BOUNDS_H

#include "base/vec.h"
#include "base/wide.h"

typedef struct Bounds {
  Vec3 lo, hi;
} Bounds;

static inline Bounds bounds_empty(void)
{
  return (Bounds){{INFINITY, INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY, -INFINITY}};
}

static inline void bounds_add_point(Bounds *b, Vec3 p)
{
  b->lo = lanes_min(p, b->lo);
  b->hi = lanes_max(p, b->hi);
}

static inline void bounds_add(Bounds *b, const Bounds *other)
{
  b->lo = lanes_min(other->lo, b->lo);
  b->hi = lanes_max(other->hi, b->hi);
}

static inline bool bounds_is_empty(const Bounds *b)
{
  return !(b->lo[0] <= b->hi[0] && b->lo[1] <= b->hi[1] && b->lo[2] <= b->hi[2]);
}

static inline bool bounds_is_finite(const Bounds *b) { return v3_is_finite(b->lo) && v3_is_finite(b->hi); }

// Half the surface, in double because scenes of 1e30 metres must not overflow. 0 for an empty box.
static inline double bounds_half_area(const Bounds *b)
{
  if (bounds_is_empty(b)) return 0;
  const double x = (double)b->hi[0] - b->lo[0], y = (double)b->hi[1] - b->lo[1], z = (double)b->hi[2] - b->lo[2];
  return x * y + y * z + z * x;
}

#endif
