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
#define MOST_DIRECTION \
  0x1p125f // of a component: its reciprocal must not be denormal, which a caller's mode may flush

// A box, or a row of boxes, is { lo x, hi x, lo y, hi y, lo z, hi z }.
typedef struct TreeRay {
  float o[3], d[3];
  float inv[3];                     // 1 / d; infinite where d is zero
  float inv_far[3];                 // the same for far planes: widened
  float tmin;                       // at least 0
  uint32_t near_row[3], far_row[3]; // of a box, by the sign of d
  uint32_t kx, ky, kz;              // kz: the axis along which d is longest
  float sx, sy, sz;                 // shear and scale that turn d into (0, 0, 1)
#if WIDEST == 16
  wx scale[3];  // inv and -inv_far, eight each: near planes and far planes turned round in one product
  wxi order[3]; // lanes of a pair of rows, near planes first
#endif
} TreeRay;

typedef int32_t Vec3i __attribute__((vector_size(16)));

static inline void tree_ray_set_axis(TreeRay *r, int k)
{
  const uint32_t is_backward = signbit(r->d[k]) != 0;
  r->near_row[k] = 2 * (uint32_t)k + is_backward;
  r->far_row[k] = 2 * (uint32_t)k + 1 - is_backward;
#if WIDEST == 16
  const wxi forward = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
  r->scale[k] = wx_join(wf_set(r->inv[k]), wf_set(-r->inv_far[k]));
  r->order[k] = forward ^ (int32_t)(is_backward << 3);
#endif
}

// Components of d too small to have a reciprocal count as 0.
static inline Vec3 tree_ray_direction(Vec3 d)
{
  const Vec3i sign = {INT32_MIN, INT32_MIN, INT32_MIN, INT32_MIN};
  const Vec3 size = (Vec3)((Vec3i)d & ~sign);
  return (Vec3)((Vec3i)d & (sign | (size >= FLT_MIN)));
}

// What tree_ray_init makes of the ray's place and direction, without what only boxes and triangles ask for.
static inline bool tree_ray_place(TreeRay *r, Vec3 o, Vec3 d, float tmin)
{
  const bool is_finite = v3_is_finite(d) && v3_is_finite(o);
  d = tree_ray_direction(d);
  v3_store(r->o, o + v3_all(0));
  v3_store(r->d, d);
  r->tmin = max_f(tmin, 0);
  const float longest = max_f(fabsf(d[0]), max_f(fabsf(d[1]), fabsf(d[2])));
  return longest != 0 && longest < MOST_DIRECTION && is_finite;
}

// False when no answer exists: a ray that is not finite, has no direction or one beyond MOST_DIRECTION. Negative tmin
// counts as 0. Components of d too small to have a reciprocal count as 0, for boxes and triangles alike.
static inline bool tree_ray_init(TreeRay *r, Vec3 o, Vec3 d, float tmin)
{
  const bool is_finite = v3_is_finite(d) && v3_is_finite(o);
  o += v3_all(0); // -0 becomes 0: rays from one place start alike
  d = tree_ray_direction(d);
  const Vec3i sign = {INT32_MIN, INT32_MIN, INT32_MIN, INT32_MIN};
  const Vec3 size = (Vec3)((Vec3i)d & ~sign);
  const Vec3 inv = 1 / d;
  v3_store(r->o, o);
  v3_store(r->d, d);
  v3_store(r->inv, inv);
  v3_store(r->inv_far, inv * FAR_SLACK);
  for (int k = 0; k < 3; k++) tree_ray_set_axis(r, k);
  r->kz = size[0] > size[1] ? (size[0] > size[2] ? 0 : 2) : (size[1] > size[2] ? 1 : 2);
  r->kx = r->kz == 2 ? 0 : r->kz + 1;
  r->ky = r->kx == 2 ? 0 : r->kx + 1;
  const Vec3 shear = d / r->d[r->kz];
  float s[4];
  memcpy(s, &shear, sizeof s);
  r->sz = r->inv[r->kz];
  r->sx = s[r->kx];
  r->sy = s[r->ky];
  r->tmin = max_f(tmin, 0);
  const float longest = r->d[r->kz];
  return longest != 0 && fabsf(longest) < MOST_DIRECTION && is_finite;
}

// Where the ray enters the box, or infinity when it misses it or enters beyond tmax. NaN, from a plane the ray lies
// in, constrains nothing: it is the first operand of min and max.
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
