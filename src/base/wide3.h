// Wide3: vectors and a few functions in lanes (wide.h), for many rays at once. Everything is made of + - * / and roots,
// so that all levels give the same bits; the polynomials are good to a few ulps of a float, not to the half that
// fmath.h keeps: they serve shading, where that is a thousandth of what a pixel can show.

#ifndef RAYFOLD_BASE_WIDE3_H
#define RAYFOLD_BASE_WIDE3_H

#include "base/hash.h"
#include "base/wide.h"

typedef struct Wide3 {
  wx x, y, z;
} Wide3;

static inline Wide3 w3(wx x, wx y, wx z) { return (Wide3){x, y, z}; }
static inline Wide3 w3_of(Vec3 v) { return w3(wx_set(v[0]), wx_set(v[1]), wx_set(v[2])); }
static inline Wide3 w3_all(wx s) { return w3(s, s, s); }
static inline Wide3 w3_add(Wide3 a, Wide3 b) { return w3(a.x + b.x, a.y + b.y, a.z + b.z); }
static inline Wide3 w3_sub(Wide3 a, Wide3 b) { return w3(a.x - b.x, a.y - b.y, a.z - b.z); }
static inline Wide3 w3_mul(Wide3 a, Wide3 b) { return w3(a.x * b.x, a.y * b.y, a.z * b.z); }
static inline Wide3 w3_scale(Wide3 a, wx s) { return w3(a.x * s, a.y * s, a.z * s); }
static inline Wide3 w3_turned(Wide3 a) { return w3(-a.x, -a.y, -a.z); }
static inline wx w3_dot(Wide3 a, Wide3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline Wide3 w3_cross(Wide3 a, Wide3 b)
{
  return w3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
static inline Wide3 w3_choose(unsigned bits, Wide3 a, Wide3 b)
{
  return w3(wx_choose(bits, a.x, b.x), wx_choose(bits, a.y, b.y), wx_choose(bits, a.z, b.z));
}
// Of unit length; a zero vector gives NaN.
static inline Wide3 w3_normalize(Wide3 a) { return w3_scale(a, 1 / wx_sqrt(w3_dot(a, a))); }
static inline wx w3_most(Wide3 a) { return wx_max(a.x, wx_max(a.y, a.z)); }
// Lanes in which all three are zero.
static inline unsigned w3_is_zero(Wide3 a)
{
  const wx none = wx_set(0);
  return wx_eq(a.x, none) & wx_eq(a.y, none) & wx_eq(a.z, none);
}

static inline Wide3 w3_vector(const Frame *f, Wide3 v)
{
  return w3(v.x * f->x[0] + v.y * f->y[0] + v.z * f->z[0], v.x * f->x[1] + v.y * f->y[1] + v.z * f->z[1],
            v.x * f->x[2] + v.y * f->y[2] + v.z * f->z[2]);
}
static inline Wide3 w3_point(const Frame *f, Wide3 p) { return w3_add(w3_vector(f, p), w3_of(f->p)); }
// Normals go by the inverse transpose: pass the inverse map.
static inline Wide3 w3_normal(const Frame *inverse, Wide3 n)
{
  return w3(w3_dot(n, w3_of(inverse->x)), w3_dot(n, w3_of(inverse->y)), w3_dot(n, w3_of(inverse->z)));
}

// Three rows of numbers `stride` apart.
static inline Wide3 w3_load(const float *p, size_t stride)
{
  return w3(wx_load(p), wx_load(p + stride), wx_load(p + 2 * stride));
}
static inline void w3_store(float *p, size_t stride, Wide3 a)
{
  wx_store(p, a.x);
  wx_store(p + stride, a.y);
  wx_store(p + 2 * stride, a.z);
}
static inline void w3_put(float *p, size_t stride, unsigned bits, Wide3 a)
{
  wx_put(p, bits, a.x);
  wx_put(p + stride, bits, a.y);
  wx_put(p + 2 * stride, bits, a.z);
}

// --- functions ----------------------------------------------------------------------------------------
static inline wx wx_clamp(wx x, float low, float high) { return wx_min(wx_max(x, wx_set(low)), wx_set(high)); }

// 2^x for |x| <= 126, beyond that as there: 2^k e^(f ln 2), |f| <= 1/2, Taylor to degree 7 (7e-9).
static inline wx wx_exp2(wx x)
{
  const wx held = wx_clamp(x, -126, 126), k = wx_floor(held + 0.5f), r = (held - k) * 0.693147181f;
  const wx e = 1 + r * (1 + r * (0.5f + r * (1 / 6.0f + r * (1 / 24.0f + r * (1 / 120.0f + r * (1 / 720.0f + r * (1 / 5040.0f)))))));
  const wxu scale = (wxu)((wx_truncate(k) + 127) << 23);
  return e * wx_of_pattern(scale);
}

// log2 of positive normal numbers: 2 artanh(s) / ln 2 with s = (m - 1) / (m + 1), m in [sqrt 1/2, sqrt 2) (Abramowitz and
// Stegun 4.1.27), to s^9 (3e-9 of the result).
static inline wx wx_log2(wx x)
{
  const wxu bits = wx_pattern(x), shifted = bits - 0x3f3504f3u; // the bits of sqrt 1/2
  const wx k = wx_of_int((wxi)shifted >> 23), m = wx_of_pattern(bits - (shifted & 0xff800000u));
  const wx s = (m - 1) / (m + 1), z = s * s;
  const wx p = 1 + z * (1 / 3.0f + z * (1 / 5.0f + z * (1 / 7.0f + z * (1 / 9.0f))));
  return k + s * p * 2.88539008f; // 2 / ln 2
}

static inline wx wx_exp(wx x) { return wx_exp2(x * 1.44269504f); }

// x^y for x >= 0 and y > 0; what is too small for a normal number is 0.
static inline wx wx_pow(wx x, wx y)
{
  const wx e = y * wx_log2(wx_max(x, wx_set(0x1p-126f)));
  return wx_choose(wx_lt(e, wx_set(-125)), wx_set(0), wx_exp2(e));
}

// arccos of 0..1: sqrt(1 - x) times a polynomial (Abramowitz and Stegun 4.4.46, 2e-8).
static inline wx wx_acos_positive(wx x)
{
  const wx p = 1.5707963050f + x * (-0.2145988016f + x * (0.0889789874f + x * (-0.0501743046f + x * (0.0308918810f +
               x * (-0.0170881256f + x * (0.0066700901f + x * -0.0012624911f))))));
  return wx_sqrt(wx_max(1 - x, wx_set(0))) * p;
}

// hash_u32 and hash_combine of hash.h.
static inline wxu wxu_hash(wxu x)
{
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  return x ^ (x >> 16);
}
static inline wxu wxu_hash_combine(wxu seed, wxu x) { return wxu_hash(seed ^ wxu_hash(x + 0x9e3779b9u)); }

#endif
