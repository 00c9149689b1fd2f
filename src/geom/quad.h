// Quad and disk: flat shapes in the plane z = 0 about the origin, facing +z.

#ifndef RAYFOLD_GEOM_QUAD_H
#define RAYFOLD_GEOM_QUAD_H

#include "geom/tree_ray.h"

// Where the line crosses z = 0, as a distance; the point in *x, *y. NaN when it runs inside the plane.
static inline float plane_hit(const TreeRay *r, float *x, float *y)
{
  const float t = r->d[2] != 0 ? -r->o[2] / r->d[2] : NAN;
  *x = r->o[0] + t * r->d[0];
  *y = r->o[1] + t * r->d[1];
  return t;
}

// A quad spans [-half_x, half_x] x [-half_y, half_y]; u, v run 0..1 along x and y.
static inline bool quad_hit(float half_x, float half_y, const TreeRay *r, float *t, float *u, float *v)
{
  float x, y;
  *t = plane_hit(r, &x, &y);
  if (!(fabsf(x) <= half_x && fabsf(y) <= half_y)) return false;
  *u = clamp_f(x / (2 * half_x) + 0.5f, 0, 1);
  *v = clamp_f(y / (2 * half_y) + 0.5f, 0, 1);
  return true;
}

#endif
