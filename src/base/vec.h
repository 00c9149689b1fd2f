// Vec3, Vec2 and Frame: the small algebra everything else is written in.
//
// Vec3 is a GCC/Clang vector of four floats, so + - * / work on whole vectors and on vector and scalar, and the
// fourth lane is carried along unused. It is not the type to store millions of: arrays in memory are packed
// float[3], loaded with v3_load(). Every function here is exact IEEE single precision in a fixed order (no fused
// multiply-add), so all instruction sets give the same bits.

#ifndef RAYFOLD_BASE_VEC_H
#define RAYFOLD_BASE_VEC_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

typedef float Vec3 __attribute__((vector_size(16)));

typedef struct Vec2 {
  float x, y;
} Vec2;

// An affine map, its columns: where the x, y, z axes and the origin go. As a pose: right, up, back, place.
typedef struct Frame {
  Vec3 x, y, z, p;
} Frame;

#define PI 3.14159265358979323846f

static inline Vec3 v3(float x, float y, float z) { return (Vec3){x, y, z, 0}; }
static inline Vec3 v3_all(float s) { return (Vec3){s, s, s, 0}; }
static inline Vec3 v3_load(const float *p) { return (Vec3){p[0], p[1], p[2], 0}; }

static inline void v3_store(float *p, Vec3 a)
{
  p[0] = a[0];
  p[1] = a[1];
  p[2] = a[2];
}

static inline float min_f(float a, float b) { return a < b ? a : b; }
static inline float max_f(float a, float b) { return a > b ? a : b; }
static inline float clamp_f(float x, float low, float high) { return min_f(max_f(x, low), high); }
static inline float mix_f(float a, float b, float t) { return a * (1 - t) + b * t; }
static inline float sqr_f(float x) { return x * x; }
static inline float safe_sqrt(float x) { return sqrtf(max_f(x, 0)); }

static inline float v3_dot(Vec3 a, Vec3 b)
{
  const Vec3 m = a * b;
  return m[0] + m[1] + m[2];
}

static inline Vec3 v3_cross(Vec3 a, Vec3 b)
{
  return v3(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]);
}

static inline float v3_length(Vec3 a) { return sqrtf(v3_dot(a, a)); }

// Unit vector along a; a zero vector stays zero instead of turning to NaN.
static inline Vec3 v3_normalize(Vec3 a)
{
  const float n = v3_dot(a, a);
  return n > 0 ? a / sqrtf(n) : a;
}

static inline Vec3 v3_min(Vec3 a, Vec3 b)
{
  return v3(min_f(a[0], b[0]), min_f(a[1], b[1]), min_f(a[2], b[2]));
}

static inline Vec3 v3_max(Vec3 a, Vec3 b)
{
  return v3(max_f(a[0], b[0]), max_f(a[1], b[1]), max_f(a[2], b[2]));
}

static inline Vec3 v3_mix(Vec3 a, Vec3 b, float t) { return a * (1 - t) + b * t; }
static inline float v3_max_lane(Vec3 a) { return max_f(a[0], max_f(a[1], a[2])); }
static inline float v3_mean(Vec3 a) { return (a[0] + a[1] + a[2]) / 3; }
static inline bool v3_is_zero(Vec3 a) { return a[0] == 0 && a[1] == 0 && a[2] == 0; }
static inline bool v3_is_finite(Vec3 a) { return isfinite(a[0]) && isfinite(a[1]) && isfinite(a[2]); }

// Mirror of w about n, both pointing away from the surface.
static inline Vec3 v3_reflect(Vec3 w, Vec3 n) { return 2 * v3_dot(w, n) * n - w; }

// Relative luminance of a linear Rec.709 colour (ITU-R BT.709).
static inline float luminance(Vec3 c) { return 0.2126f * c[0] + 0.7152f * c[1] + 0.0722f * c[2]; }

// An orthonormal basis around a unit n, z = n (Duff et al., "Building an orthonormal basis, revisited", JCGT 2017).
static inline Frame frame_around(Vec3 n)
{
  const float sign = copysignf(1, n[2]);
  const float a = -1 / (sign + n[2]);
  const float b = n[0] * n[1] * a;
  return (Frame){v3(1 + sign * n[0] * n[0] * a, sign * b, -sign * n[0]),
                 v3(b, sign + n[1] * n[1] * a, -n[1]), n, v3_all(0)};
}

static inline Frame frame_identity(void)
{
  return (Frame){v3(1, 0, 0), v3(0, 1, 0), v3(0, 0, 1), v3_all(0)};
}

static inline Vec3 frame_vector(const Frame *f, Vec3 v) { return v[0] * f->x + v[1] * f->y + v[2] * f->z; }
static inline Vec3 frame_point(const Frame *f, Vec3 p) { return frame_vector(f, p) + f->p; }

// For an orthonormal frame: the vector's coordinates in it (the transpose).
static inline Vec3 frame_local(const Frame *f, Vec3 v)
{
  return v3(v3_dot(v, f->x), v3_dot(v, f->y), v3_dot(v, f->z));
}

// Normals go by the inverse transpose: pass the inverse map.
static inline Vec3 frame_normal(const Frame *inverse, Vec3 n) { return frame_local(inverse, n); }

static inline Frame frame_product(const Frame *a, const Frame *b)
{
  return (Frame){frame_vector(a, b->x), frame_vector(a, b->y), frame_vector(a, b->z), frame_point(a, b->p)};
}

static inline float frame_determinant(const Frame *f) { return v3_dot(f->x, v3_cross(f->y, f->z)); }

// Inverse by cofactors; a singular frame gives a frame of zeros.
static inline Frame frame_inverse(const Frame *f)
{
  const float d = frame_determinant(f);
  if (d == 0 || !isfinite(1 / d)) return (Frame){0};
  const Vec3 r0 = v3_cross(f->y, f->z) / d, r1 = v3_cross(f->z, f->x) / d, r2 = v3_cross(f->x, f->y) / d;
  Frame inv = {v3(r0[0], r1[0], r2[0]), v3(r0[1], r1[1], r2[1]), v3(r0[2], r1[2], r2[2]), v3_all(0)};
  inv.p = -frame_vector(&inv, f->p);
  return inv;
}

#endif
