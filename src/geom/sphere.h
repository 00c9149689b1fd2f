// Sphere about the origin: where a ray meets it. Stable for small, far and grazed spheres (Haines, Guenther,
// Akenine-Moeller, "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems 2019, chapter 7).

#ifndef RAYFOLD_GEOM_SPHERE_H
#define RAYFOLD_GEOM_SPHERE_H

#include "base/fmath.h"
#include "geom/tree_ray.h"

// Both crossings in order, anywhere on the line; false when it passes by.
static inline bool sphere_hit(float radius, const TreeRay *r, float t[2])
{
  const Vec3 f = v3_load(r->o), d = v3_load(r->d);
  const float a = v3_dot(d, d), b = -v3_dot(f, d);
  // Distance of the line from the centre by its nearest point, not by b * b - a * c, which cancels (eq. 7.5).
  const Vec3 l = f + b / a * d;
  const float discriminant = radius * radius - v3_dot(l, l);
  if (!(discriminant >= 0)) return false;
  // The smaller root by c / q avoids the other cancellation (eq. 7.6). c in double: it decides whether a ray that
  // leaves the surface hits it again.
  const double c = (double)f[0] * f[0] + (double)f[1] * f[1] + (double)f[2] * f[2] - (double)radius * radius;
  const float q = b + copysignf(sqrtf(a * discriminant), b);
  const float t0 = (float)(c / q), t1 = q / a;
  t[0] = min_f(t0, t1);
  t[1] = max_f(t0, t1);
  return t[0] == t[0] && t[1] == t[1];
}

// Surface parameters of a point on it: u around the y axis from -z over +x... to -z again, v from the pole -y up.
static inline Vec2 sphere_uv(float radius, Vec3 p)
{
  const float around = f_atan2(p[0], p[2]) * (0.5f / PI) + 0.5f;
  return (Vec2){clamp_f(around, 0, 1), 1 - f_acos(clamp_f(p[1] / radius, -1, 1)) / PI};
}

#endif
