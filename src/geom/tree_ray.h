// TreeRay: a ray made ready for many tests in one space: reciprocals for boxes, shear for triangles.
//
// The box test is conservative (Ize, "Robust BVH Ray Traversal", JCGT 2013): far planes are pushed out by a relative
// FAR_SLACK, more than the 2 gamma(3) of the paper, so that it also covers the rounding of the triangle test. It is
// monotone: a box inside another is never hit when the outer one is missed, and never nearer. Results of a tree
// therefore do not depend on its shape, because each primitive's hit must also pass the primitive's own box, and is
// not nearer than it (see accel/traverse.h).

#ifndef RAYFOLD_GEOM_TREE_RAY_H
#define RAYFOLD_GEOM_TREE_RAY_H

#include "base/ray.h"
#include "geom/bounds.h"

#include <float.h>

#define FAR_SLACK (1 + 0x1p-20f)

typedef struct TreeRay {
  float o[3], d[3];
  float inv[3];     // 1 / d; infinite where d is zero
  float inv_far[3]; // the same for far planes: widened
  float tmin;       // at least 0
  int near_row[3], far_row[3]; // rows of a box { lo x, lo y, lo z, hi x, hi y, hi z } by the sign of d
  int kx, ky, kz;   // kz: the axis along which d is longest
  float sx, sy, sz; // shear and scale that turn d into (0, 0, 1)
} TreeRay;

// False when no answer exists: a ray that is not finite or has no direction. Negative tmin counts as 0. Components
// of d too small to have a reciprocal count as 0, for boxes and triangles alike.
static inline bool tree_ray_init(TreeRay *r, Vec3 o, Vec3 d, float tmin)
{
  if (!v3_is_finite(o) || !v3_is_finite(d)) return false;
  for (int k = 0; k < 3; k++) {
    r->o[k] = o[k];
    r->d[k] = fabsf(d[k]) < FLT_MIN ? copysignf(0, d[k]) : d[k];
    r->inv[k] = 1 / r->d[k];
    r->inv_far[k] = r->inv[k] * FAR_SLACK;
    const bool is_backward = signbit(r->d[k]);
    r->near_row[k] = is_backward ? 3 + k : k;
    r->far_row[k] = is_backward ? k : 3 + k;
  }
  const float ax = fabsf(r->d[0]), ay = fabsf(r->d[1]), az = fabsf(r->d[2]);
  r->kz = ax > ay ? (ax > az ? 0 : 2) : (ay > az ? 1 : 2);
  r->kx = r->kz == 2 ? 0 : r->kz + 1;
  r->ky = r->kx == 2 ? 0 : r->kx + 1;
  r->sz = r->inv[r->kz];
  r->sx = r->d[r->kx] / r->d[r->kz];
  r->sy = r->d[r->ky] / r->d[r->kz];
  r->tmin = max_f(tmin, 0);
  return r->d[r->kz] != 0;
}

// Where the ray enters the box { lo, hi }, or infinity when it misses it or enters beyond tmax. NaN, from a plane
// the ray lies in, constrains nothing: it is the first operand of min and max.
static inline float tree_ray_box(const TreeRay *r, const float box[6], float tmax)
{
  float t0 = r->tmin, t1 = tmax;
  for (int k = 0; k < 3; k++) {
    t0 = max_f((box[r->near_row[k]] - r->o[k]) * r->inv[k], t0);
    t1 = min_f((box[r->far_row[k]] - r->o[k]) * r->inv_far[k], t1);
  }
  return t0 <= t1 ? t0 : INFINITY;
}

#endif
