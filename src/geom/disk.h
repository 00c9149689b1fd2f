// Disk in the plane z = 0 about the origin, facing +z. Its u, v run 0..1 across the square around it, so that a
// picture laid on it is not bent.

#ifndef RAYFOLD_GEOM_DISK_H
#define RAYFOLD_GEOM_DISK_H

#include "geom/quad.h"

static inline bool disk_hit(float radius, const TreeRay *r, float *t, float *u, float *v)
{
  float x, y;
  *t = plane_hit(r, &x, &y);
  if (!(x * x + y * y <= radius * radius)) return false;
  *u = clamp_f(x / (2 * radius) + 0.5f, 0, 1);
  *v = clamp_f(y / (2 * radius) + 0.5f, 0, 1);
  return true;
}

#endif
