// Quaternions, for turning between two attitudes the short way. Cold code, in double: angles in files are degrees and
// 90 of them should come out as 90. After Shoemake, "Animating rotation with quaternion curves" (1985).

#ifndef RAYFOLD_SCENE_QUATERNION_H
#define RAYFOLD_SCENE_QUATERNION_H

#include "base/vec.h"

typedef struct Quaternion {
  double v[4]; // x, y, z, w
} Quaternion;

static inline double quaternion_dot(Quaternion a, Quaternion b)
{
  return a.v[0] * b.v[0] + a.v[1] * b.v[1] + a.v[2] * b.v[2] + a.v[3] * b.v[3];
}

// q or -q, which turn alike: the one nearer to a.
static inline Quaternion quaternion_toward(Quaternion a, Quaternion q)
{
  if (quaternion_dot(a, q) < 0)
    for (int i = 0; i < 4; i++) q.v[i] = -q.v[i];
  return q;
}

// Of length zero: no turn.
static inline Quaternion quaternion_unit(Quaternion q)
{
  const double n = sqrt(quaternion_dot(q, q));
  if (!(n > 0)) return (Quaternion){{0, 0, 0, 1}};
  for (int i = 0; i < 4; i++) q.v[i] /= n;
  return q;
}

static inline Quaternion quaternion_slerp(Quaternion a, Quaternion b, double u)
{
  b = quaternion_toward(a, b);
  const double cosine = quaternion_dot(a, b);
  double from = 1 - u, to = u;
  if (cosine < 1 - 1e-12) { // nearer than that the chord is the arc
    const double angle = acos(cosine), sine = sin(angle);
    from = sin((1 - u) * angle) / sine;
    to = sin(u * angle) / sine;
  }
  for (int i = 0; i < 4; i++) a.v[i] = from * a.v[i] + to * b.v[i];
  return quaternion_unit(a);
}

// About x, then y, then z, in degrees, as an object's rotate.
static inline Quaternion quaternion_from_angles(const float degrees[3])
{
  const double half = 3.14159265358979323846 / 360;
  double s[3], c[3];
  for (int i = 0; i < 3; i++) {
    s[i] = sin((double)degrees[i] * half);
    c[i] = cos((double)degrees[i] * half);
  }
  return (Quaternion){{s[0] * c[1] * c[2] - c[0] * s[1] * s[2], c[0] * s[1] * c[2] + s[0] * c[1] * s[2],
                       c[0] * c[1] * s[2] - s[0] * s[1] * c[2], c[0] * c[1] * c[2] + s[0] * s[1] * s[2]}};
}

static inline void quaternion_to_angles(Quaternion q, float degrees[3])
{
  q = quaternion_unit(q);
  const double x = q.v[0], y = q.v[1], z = q.v[2], w = q.v[3], degree = 180 / 3.14159265358979323846;
  const double sine = 2 * (w * y - z * x);
  // Looking straight up or down, only the sum or difference of the other two counts: z takes it all.
  if (fabs(sine) > 1 - 1e-12) {
    degrees[0] = 0;
    degrees[1] = sine > 0 ? 90 : -90;
    degrees[2] = (float)(atan2(-2 * (x * y - w * z), 1 - 2 * (x * x + z * z)) * degree);
    return;
  }
  degrees[0] = (float)(atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)) * degree);
  degrees[1] = (float)(asin(sine) * degree);
  degrees[2] = (float)(atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)) * degree);
}

// The map whose axes are turned so and sized.
static inline Frame quaternion_frame(Quaternion q, Vec3 scale, Vec3 origin)
{
  q = quaternion_unit(q);
  const float x = (float)q.v[0], y = (float)q.v[1], z = (float)q.v[2], w = (float)q.v[3];
  return (Frame){v3(1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)) * scale[0],
                 v3(2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)) * scale[1],
                 v3(2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)) * scale[2], origin};
}

#endif
