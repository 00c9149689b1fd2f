// Offset: where a ray that leaves a surface starts. Its origin is moved along the geometric normal by what rounding
// may have put the point off the surface: a number of ulps, not a fixed epsilon, so large enough far from the origin
// and small near it (the aim of Waechter and Binder, Ray Tracing Gems 2019, chapter 6; the bound itself is carried
// as in pbrt, "Managing Rounding Error"). Everyone who leaves a surface goes through here, and then traces with
// tmin = 0.

#ifndef RAYFOLD_GEOM_OFFSET_H
#define RAYFOLD_GEOM_OFFSET_H

#include "base/ray.h"

// For leaving p in the direction w, on the side of the surface w points to.
static inline Vec3 offset_point(Vec3 p, Vec3 ng, float error, Vec3 w)
{
  return p + (v3_dot(w, ng) < 0 ? -error : error) * ng;
}

static inline Vec3 offset_origin(const SurfacePoint *s, Vec3 w) { return offset_point(s->p, s->ng, s->error, w); }

#endif
