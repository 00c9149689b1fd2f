// Sdf eval: runs a tape for a number of places at once, one a lane. This file is included once for each kind of lane
// (floats to march with, doubles to find places and normals with), with these defined: NUM and INT, types of as many
// lanes; SDF_(name), the name for this kind; and N_SET N_MIN N_MAX N_SQRT N_LESS(a, b, x, y) (x where a < b, else y)
// N_TO_INT N_FROM_INT, of which N_MIN(a, b) is b where either is no number. Without them: floats. It takes them back.
//
// Distances are those of the usual closed forms (most are collected in Quilez, "Distance functions"); where one is only a
// bound it says so. None allocates, none branches on lanes.

#ifndef NUM
#include "geom/sdf.h"
#define NUM wx
#define INT wxi
#define UNSIGNED wxu
#define SDF_(name) name##_f
#define N_SET(x) wx_set(x)
#define N_MIN(a, b) wx_min(a, b)
#define N_MAX(a, b) wx_max(a, b)
#define N_SQRT(a) wx_sqrt(a)
#define N_LESS(a, b, x, y) wx_choose(wx_lt(a, b), x, y)
#define N_TO_INT(a) wx_truncate(a)
#define N_FROM_INT(a) wx_of_int(a)
#endif

static inline NUM SDF_(sdf_abs)(NUM a) { return N_MAX(a, -a); }
static inline NUM SDF_(sdf_clamp)(NUM a, NUM low, NUM high) { return N_MIN(N_MAX(a, low), high); }
static inline NUM SDF_(sdf_length2)(NUM a, NUM b) { return N_SQRT(a * a + b * b); }
static inline NUM SDF_(sdf_length3)(NUM a, NUM b, NUM c) { return N_SQRT(a * a + b * b + c * c); }

// The nearest whole number, ties to even; numbers beyond 2^22 have no fraction that matters and stay.
static inline NUM SDF_(sdf_nearest)(NUM a)
{
  const NUM big = N_SET(sizeof a / sizeof(INT) == 1 ? 0x1.8p23f : 0x1.8p52f);
  const NUM whole = (a + big) - big;
  return N_LESS(SDF_(sdf_abs)(a), N_SET(0x1p22f), whole, a);
}

static inline NUM SDF_(sdf_floor)(NUM a)
{
  const NUM near = SDF_(sdf_nearest)(a);
  return N_LESS(a, near, near - 1, near);
}

// Sine and cosine: to a quarter turn by two parts of pi / 2, then Taylor. Beyond 1e6 the answer is that of 0.
static inline void SDF_(sdf_sincos)(NUM x, NUM *sine, NUM *cosine)
{
  const NUM a = N_LESS(SDF_(sdf_abs)(x), N_SET(1e6f), x, N_SET(0));
  const NUM q = SDF_(sdf_nearest)(a * 0.636619772f);
  const NUM r = ((a - q * 0x1.92p+0f) - q * 0x1.fb4p-12f) - q * 0x1.4442d2p-24f, z = r * r;
  const NUM s = r + r * z * (-1.0f / 6 + z * (1.0f / 120 + z * (-1.0f / 5040 + z * (1.0f / 362880 - z * (1.0f / 39916800)))));
  const NUM c = 1 + z * (-0.5f + z * (1.0f / 24 + z * (-1.0f / 720 + z * (1.0f / 40320 - z * (1.0f / 3628800)))));
  const NUM turn = q - 4 * SDF_(sdf_floor)(q * 0.25f); // 0..3
  const NUM odd = turn - 2 * SDF_(sdf_floor)(turn * 0.5f);
  const NUM of_sine = N_LESS(odd, N_SET(0.5f), s, c), of_cosine = N_LESS(odd, N_SET(0.5f), c, s);
  *sine = N_LESS(turn, N_SET(1.5f), of_sine, -of_sine);
  *cosine = N_LESS(SDF_(sdf_abs)(turn - 1.5f), N_SET(1), -of_cosine, of_cosine);
}

// e^-x for 0 <= x <= 20: Taylor to degree 9 of x / 64, squared six times.
static inline NUM SDF_(sdf_decay)(NUM x)
{
  const NUM y = -x * (1.0f / 64);
  NUM e = 1 + y * (1 + y * (0.5f + y * (1.0f / 6 + y * (1.0f / 24 + y * (1.0f / 120 + y * (1.0f / 720 + y * (1.0f / 5040 + y * (1.0f / 40320))))))));
  for (int i = 0; i < 6; i++) e = e * e;
  return e;
}

// ln(1 + u) for 0 <= u <= 1: 2 artanh s with s = u / (2 + u) at most 1/3 (Abramowitz and Stegun 4.1.27).
static inline NUM SDF_(sdf_log1p)(NUM u)
{
  const NUM s = u / (2 + u), z = s * s;
  return 2 * s * (1 + z * (1.0f / 3 + z * (1.0f / 5 + z * (1.0f / 7 + z * (1.0f / 9 + z * (1.0f / 11 + z * (1.0f / 13 + z * (1.0f / 15))))))));
}

// ln x for 1 <= x <= 2^64 or so: the sixteenth root, then the series.
static inline NUM SDF_(sdf_log)(NUM x)
{
  const NUM y = N_SQRT(N_SQRT(N_SQRT(N_SQRT(N_SQRT(x))))), s = (y - 1) / (y + 1), z = s * s;
  return 64 * s * (1 + z * (1.0f / 3 + z * (1.0f / 5 + z * (1.0f / 7 + z * (1.0f / 9 + z * (1.0f / 11))))));
}

static inline NUM SDF_(sdf_atan2)(NUM y, NUM x)
{
  const NUM ax = SDF_(sdf_abs)(x), ay = SDF_(sdf_abs)(y), big = N_MAX(N_MAX(ax, ay), N_SET(1e-30f)), small = N_MIN(ax, ay);
  const NUM steep = N_SET(0.41421357f) * big, t = N_LESS(steep, small, small - big, small) / N_LESS(steep, small, small + big, big);
  const NUM z = t * t; // |t| <= tan(pi / 8)
  NUM a = t * (1 + z * (-1.0f / 3 + z * (1.0f / 5 + z * (-1.0f / 7 + z * (1.0f / 9 + z * (-1.0f / 11 + z * (1.0f / 13 - z * (1.0f / 15))))))));
  a = N_LESS(steep, small, a + 0.785398163f, a);
  a = N_LESS(ax, ay, 1.57079633f - a, a);
  a = N_LESS(x, N_SET(0), 3.14159265f - a, a);
  return N_LESS(y, N_SET(0), -a, a);
}

// --- noise ------------------------------------------------------------------------------------------
static inline UNSIGNED SDF_(sdf_hash)(UNSIGNED x) // as base/hash.h
{
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  return x ^ (x >> 16);
}

// An offset's product with one of the cube's diagonals (+-1, +-1, +-1), which the bits choose.
static inline NUM SDF_(sdf_corner)(UNSIGNED h, NUM x, NUM y, NUM z)
{
  const NUM a = N_FROM_INT((INT)((h >> 29 & 1) << 1)) - 1, b = N_FROM_INT((INT)((h >> 30 & 1) << 1)) - 1;
  const NUM c = N_FROM_INT((INT)((h >> 31) << 1)) - 1;
  return a * x + b * y + c * z;
}

// Gradient noise (Perlin, "Improving Noise", 2002), about -1..1, 0 at whole numbers.
static SDF_LARGE NUM SDF_(sdf_noise)(NUM x, NUM y, NUM z, uint32_t seed)
{
  NUM f[3] = {x, y, z}, fade[3], plane[2];
  UNSIGNED cell[3];
  for (int k = 0; k < 3; k++) {
    const NUM inside = N_LESS(SDF_(sdf_abs)(f[k]), N_SET(1e6f), f[k], N_SET(0)), low = SDF_(sdf_floor)(inside);
    f[k] = inside - low;
    cell[k] = (UNSIGNED)N_TO_INT(low);
    fade[k] = f[k] * f[k] * f[k] * (f[k] * (f[k] * 6 - 15) + 10);
  }
  for (uint32_t k = 0; k < 2; k++) {
    const UNSIGNED hz = SDF_(sdf_hash)(cell[2] + k + seed * 0x9e3779b9u);
    NUM row[2];
    for (uint32_t j = 0; j < 2; j++) {
      const UNSIGNED hy = SDF_(sdf_hash)(hz ^ (cell[1] + j));
      const NUM a = SDF_(sdf_corner)(SDF_(sdf_hash)(hy ^ cell[0]), f[0], f[1] - (float)j, f[2] - (float)k);
      const NUM b = SDF_(sdf_corner)(SDF_(sdf_hash)(hy ^ (cell[0] + 1)), f[0] - 1, f[1] - (float)j, f[2] - (float)k);
      row[j] = a + (b - a) * fade[0];
    }
    plane[k] = row[0] + (row[1] - row[0]) * fade[1];
  }
  return plane[0] + (plane[1] - plane[0]) * fade[2];
}

// --- joins --------------------------------------------------------------------------------------------
// The smaller of both, rounded off over k: min(a, b) - h^3 k / 6 with h = max(k - |a - b|, 0) / k. k = 0 is the plain
// minimum. Its gradient lies between those of a and b, so it is no steeper than they are.
static inline NUM SDF_(sdf_smooth_min)(const SdfStep *s, NUM a, NUM b)
{
  if (!(s->smooth > 0)) return N_MIN(a, b);
  const NUM h = N_MAX(s->smooth - SDF_(sdf_abs)(a - b), N_SET(0)) * s->inv_smooth;
  return N_MIN(a, b) - h * h * h * s->sixth;
}

// k ln(e^(a/k) + e^(b/k)): a soft maximum, above both. From 18 k apart it is the larger one, as in floats.
static inline NUM SDF_(sdf_soft_max)(const SdfStep *s, NUM a, NUM b)
{
  if (!(s->smooth > 0)) return N_MAX(a, b);
  const NUM apart = SDF_(sdf_abs)(a - b) * s->inv_smooth, far = N_SET(18);
  const NUM more = s->smooth * SDF_(sdf_log1p)(SDF_(sdf_decay)(N_MIN(apart, far)));
  return N_MAX(a, b) + N_LESS(apart, far, more, N_SET(0));
}

static inline NUM SDF_(sdf_join)(const SdfStep *s, NUM a, NUM b)
{
  switch ((SdfOperation)s->operation) {
  case SDF_UNION: return SDF_(sdf_smooth_min)(s, a, b);
  case SDF_INTERSECTION: return -SDF_(sdf_smooth_min)(s, -a, -b);
  case SDF_DIFFERENCE: return -SDF_(sdf_smooth_min)(s, -a, b);
  case SDF_SOFT_MAXIMUM: return SDF_(sdf_soft_max)(s, a, b);
  }
  unreachable();
}

// --- primitives ---------------------------------------------------------------------------------------
static inline NUM SDF_(sdf_outside2)(NUM a, NUM b) // of a quarter plane
{
  const NUM zero = N_SET(0);
  return N_MIN(N_MAX(a, b), zero) + SDF_(sdf_length2)(N_MAX(a, zero), N_MAX(b, zero));
}

static inline NUM SDF_(sdf_box)(const float *half, const NUM p[3])
{
  const NUM zero = N_SET(0);
  const NUM x = SDF_(sdf_abs)(p[0]) - half[0], y = SDF_(sdf_abs)(p[1]) - half[1], z = SDF_(sdf_abs)(p[2]) - half[2];
  return SDF_(sdf_length3)(N_MAX(x, zero), N_MAX(y, zero), N_MAX(z, zero)) + N_MIN(N_MAX(x, N_MAX(y, z)), zero);
}

static inline NUM SDF_(sdf_cone)(const float *size, const NUM p[3])
{
  const float low = size[0], high = size[1], half = size[2], across = high - low, along = 2 * half;
  const NUM q = SDF_(sdf_length2)(p[0], p[2]), y = p[1], zero = N_SET(0);
  const NUM cap_x = N_MAX(q - N_LESS(y, zero, N_SET(low), N_SET(high)), zero), cap_y = SDF_(sdf_abs)(y) - half;
  const NUM t = SDF_(sdf_clamp)(((high - q) * across + (half - y) * along) * (1 / (across * across + along * along)), zero, N_SET(1));
  const NUM side_x = q - high + across * t, side_y = y - half + along * t;
  const NUM d = N_SQRT(N_MIN(cap_x * cap_x + cap_y * cap_y, side_x * side_x + side_y * side_y));
  return N_LESS(side_x, zero, N_LESS(cap_y, zero, -d, d), d);
}

static inline NUM SDF_(sdf_octahedron)(float radius, const NUM p[3])
{
  const NUM x = SDF_(sdf_abs)(p[0]), y = SDF_(sdf_abs)(p[1]), z = SDF_(sdf_abs)(p[2]), m = x + y + z - radius;
  // Nearest to an edge where one coordinate is small: turned so that it is the first.
  const NUM low = N_MIN(x, N_MIN(y, z)), zero = N_SET(0);
  const NUM a = N_LESS(low, x, N_LESS(low, y, x, z), y), b = N_LESS(low, x, N_LESS(low, y, y, x), z);
  const NUM k = SDF_(sdf_clamp)(0.5f * (b - a + radius), zero, N_SET(radius));
  const NUM edge = SDF_(sdf_length3)(low, a - radius + k, b - k);
  return N_LESS(3 * low, m, edge, m * 0.57735027f);
}

// A cube with crosses of three thicknesses, and so on, cut out; a bound, of steepness 1 in each step.
static inline NUM SDF_(sdf_menger)(float half, int levels, const NUM p[3])
{
  NUM d = SDF_(sdf_box)((float[3]){half, half, half}, p);
  float width = half; // of a cell, halved
  for (int i = 0; i < levels; i++) {
    NUM r[3];
    for (int k = 0; k < 3; k++) {
      const NUM off = p[k] - 2 * width * SDF_(sdf_nearest)(p[k] * (0.5f / width)); // from the cell's middle
      r[k] = SDF_(sdf_abs)(off) - width * (1.0f / 3);                             // from the middle third
    }
    const NUM a = N_MAX(r[0], r[1]), b = N_MAX(r[1], r[2]), c = N_MAX(r[2], r[0]);
    d = N_MAX(d, -N_MIN(a, N_MIN(b, c)));
    width *= 1.0f / 3;
  }
  return d;
}

// The n-th power of a complex number, 2 <= n <= 16.
static inline void SDF_(sdf_power)(NUM a, NUM b, int n, NUM *x, NUM *y)
{
  int bit = 16;
  while (!(n & bit)) bit >>= 1;
  NUM re = a, im = b;
  for (bit >>= 1; bit; bit >>= 1) {
    const NUM square = re * re - im * im;
    im = 2 * re * im;
    re = square;
    if (!(n & bit)) continue;
    const NUM turned = re * a - im * b;
    im = re * b + im * a;
    re = turned;
  }
  *x = re;
  *y = im;
}

// The set of White and Nylander (2009): w -> w^n + p in spherical angles, done with complex powers instead of angles.
// The value is Hubbard and Douady's estimate of the distance, ln|w| |w| / (2 |w'|), an estimate indeed: what it is worth
// is measured in tests/test_fields.c. A skin of a 500th of the radius holds together what would be dust.
static SDF_LARGE NUM SDF_(sdf_mandelbulb)(float radius, int rounds, int n, const NUM at[3])
{
  const NUM one = N_SET(1), bail = N_SET(4), tiny = N_SET(1e-20f);
  const float shrink = 1.25f / radius; // the set of power 8 reaches to 1.2
  const NUM p[3] = {at[0] * shrink, at[1] * shrink, at[2] * shrink};
  NUM w[3] = {p[0], p[1], p[2]}, r = SDF_(sdf_length3)(w[0], w[1], w[2]), slope = one;
  for (int i = 0; i < rounds; i++) {
    const NUM across = N_MAX(SDF_(sdf_length2)(w[0], w[1]), tiny);
    NUM turn_x, turn_y, up, out, lower = one, power = N_MAX(r, tiny);
    for (int bit = n - 1; bit; bit >>= 1, power = power * power)
      if (bit & 1) lower = lower * power;
    SDF_(sdf_power)(w[0] / across, w[1] / across, n, &turn_x, &turn_y);
    SDF_(sdf_power)(w[2], across, n, &up, &out); // of length r^n
    const NUM next[3] = {out * turn_x + p[0], out * turn_y + p[1], up + p[2]};
    slope = N_LESS(r, bail, (float)n * lower * slope + 1, slope);
    for (int k = 2; k >= 0; k--) w[k] = N_LESS(r, bail, next[k], w[k]);
    r = N_LESS(r, bail, SDF_(sdf_length3)(w[0], w[1], w[2]), r);
  }
  const NUM d = 0.5f * SDF_(sdf_log)(N_MAX(r, tiny)) * r / slope;
  return d * (1 / shrink) - radius * 0.002f;
}

// --- formulas -----------------------------------------------------------------------------------------
static inline NUM SDF_(sdf_divide)(NUM a, NUM b)
{
  const NUM least = N_SET((float)FORMULA_LEAST_DIVISOR);
  const NUM up = N_MAX(b, least), down = N_MIN(b, -least);
  return a / N_LESS(b, N_SET(0), down, up);
}

static inline NUM SDF_(sdf_exp)(NUM x)
{
  const NUM most = N_SET((float)FORMULA_MOST_EXPONENT), at = SDF_(sdf_clamp)(x, -most, most);
  const NUM e = SDF_(sdf_decay)(SDF_(sdf_abs)(at));
  return N_LESS(at, N_SET(0), e, 1 / e);
}

static inline NUM SDF_(sdf_formula_step)(const FormulaStep *s, const NUM *r)
{
  const NUM a = r[s->in[0]], b = r[s->in[1]], c = r[s->in[2]];
  NUM sine, cosine;
  switch ((FormulaOp)s->op) {
  case FORMULA_CONSTANT: return N_SET(s->value);
  case FORMULA_COPY: return a;
  case FORMULA_ADD: return a + b;
  case FORMULA_SUBTRACT: return a - b;
  case FORMULA_MULTIPLY: return a * b;
  case FORMULA_DIVIDE: return SDF_(sdf_divide)(a, b);
  case FORMULA_NEGATE: return -a;
  case FORMULA_MIN: return N_MIN(a, b);
  case FORMULA_MAX: return N_MAX(a, b);
  case FORMULA_ABS: return SDF_(sdf_abs)(a);
  case FORMULA_SQRT: return N_SQRT(N_MAX(a, N_SET(0)));
  case FORMULA_SIN: SDF_(sdf_sincos)(a, &sine, &cosine); return sine;
  case FORMULA_COS: SDF_(sdf_sincos)(a, &sine, &cosine); return cosine;
  case FORMULA_EXP: return SDF_(sdf_exp)(a);
  case FORMULA_FLOOR: return SDF_(sdf_floor)(a);
  case FORMULA_MOD: return a - b * SDF_(sdf_floor)(SDF_(sdf_divide)(a, b));
  case FORMULA_LENGTH2: return SDF_(sdf_length2)(a, b);
  case FORMULA_LENGTH3: return SDF_(sdf_length3)(a, b, c);
  case FORMULA_CLAMP: return SDF_(sdf_clamp)(a, b, c);
  case FORMULA_MIX: return a + (b - a) * c;
  case FORMULA_SMOOTH_MIN:
  case FORMULA_SMOOTH_MAX: {
    const NUM sign = N_SET(s->op == FORMULA_SMOOTH_MIN ? 1 : -1), k = N_MAX(c, N_SET(1e-9f));
    const NUM h = N_MAX(k - SDF_(sdf_abs)(a - b), N_SET(0)) / k;
    return sign * (N_MIN(sign * a, sign * b) - h * h * h * k * (1.0f / 6));
  }
  case FORMULA_ATAN2: return SDF_(sdf_atan2)(a, b);
  case FORMULA_NOISE: return SDF_(sdf_noise)(a, b, c, 0);
  }
  unreachable();
}

// Cut to its box, and outside it as on the box, so that its steepness inside is all there is to know. What is no number,
// from numbers too large, is outside.
static SDF_LARGE NUM SDF_(sdf_formula)(const Formula *f, const SdfStep *s, const NUM p[3])
{
  NUM r[FORMULA_REGISTERS];
  for (int k = 0; k < 3; k++) r[k] = SDF_(sdf_clamp)(p[k], N_SET(-s->size[k]), N_SET(s->size[k]));
  for (uint32_t i = 0; i < f->count; i++) r[f->steps[i].out] = SDF_(sdf_formula_step)(&f->steps[i], r);
  const NUM most = N_SET(1e9f), d = N_MAX(N_MIN(r[f->result], most), -most);
  return N_MAX(d, SDF_(sdf_box)(s->size, p));
}

// --- steps --------------------------------------------------------------------------------------------
static inline void SDF_(sdf_map)(const SdfStep *s, const NUM p[3], NUM out[3])
{
  const float *m = s->map;
  if (s->is_moved) {
    for (int k = 0; k < 3; k++) out[k] = p[k] + m[9 + k];
    return;
  }
  for (int k = 0; k < 3; k++) out[k] = p[0] * m[3 * k] + p[1] * m[3 * k + 1] + p[2] * m[3 * k + 2] + m[9 + k];
}

// The value of a primitive at a place in its own space.
static inline NUM SDF_(sdf_primitive)(const Sdf *f, const SdfStep *s, const NUM p[3])
{
  const float *size = s->size;
  switch ((SdfKind)s->kind) {
  case SDF_SPHERE: return SDF_(sdf_length3)(p[0], p[1], p[2]) - size[0];
  case SDF_BOX: return SDF_(sdf_box)(size, p) - size[3];
  case SDF_TORUS: return SDF_(sdf_length2)(SDF_(sdf_length2)(p[0], p[2]) - size[0], p[1]) - size[1];
  case SDF_CYLINDER:
    return SDF_(sdf_outside2)(SDF_(sdf_length2)(p[0], p[2]) - size[0], SDF_(sdf_abs)(p[1]) - size[1]);
  case SDF_CONE: return SDF_(sdf_cone)(size, p);
  case SDF_CAPSULE: {
    const NUM y = p[1] - SDF_(sdf_clamp)(p[1], N_SET(-size[1]), N_SET(size[1]));
    return SDF_(sdf_length3)(p[0], y, p[2]) - size[0];
  }
  case SDF_PLANE: return p[2];
  case SDF_ELLIPSOID: {
    const float least = min_f(size[0], min_f(size[1], size[2]));
    return (SDF_(sdf_length3)(p[0] * (1 / size[0]), p[1] * (1 / size[1]), p[2] * (1 / size[2])) - 1) * least;
  }
  case SDF_OCTAHEDRON: return SDF_(sdf_octahedron)(size[0], p);
  case SDF_MENGER: return SDF_(sdf_menger)(size[0], s->count, p);
  case SDF_MANDELBULB: return SDF_(sdf_mandelbulb)(size[0], s->count, s->power, p);
  case SDF_FORMULA: return SDF_(sdf_formula)(&f->formulas[s->formula], s, p);
  case SDF_ENTER:
  case SDF_LEAVE:
  case SDF_JOIN: break;
  }
  unreachable();
}

static inline void SDF_(sdf_turn)(NUM angle, NUM *a, NUM *b)
{
  NUM s, c;
  SDF_(sdf_sincos)(angle, &s, &c);
  const NUM x = c * *a - s * *b, y = s * *a + c * *b;
  *a = x;
  *b = y;
}

// The place one copy along an axis has been moved back by, and how far the border to a neighbour's copy is.
static inline void SDF_(sdf_repeat)(const SdfWarp *w, int k, NUM p[3], NUM *border)
{
  const float spacing = w->spacing[k];
  p[k] = p[k] + w->shift[k];
  const NUM copy = SDF_(sdf_clamp)(SDF_(sdf_nearest)(p[k] * (1 / spacing)), N_SET(w->first[k]), N_SET(w->last[k]));
  const NUM off = p[k] - spacing * copy;
  if (w->is_mirrored) { // every second copy is seen in a mirror
    const NUM odd = copy - 2 * SDF_(sdf_nearest)(copy * 0.5f);
    p[k] = N_LESS(N_SET(0.5f), SDF_(sdf_abs)(odd), -off, off);
    return;
  }
  // Copies beyond the border are at least their gap beyond it; where there is no neighbour nothing is near.
  const NUM side = spacing * 0.5f - SDF_(sdf_abs)(off) + w->gap[k], far = N_SET(1e18f);
  const NUM high = N_LESS(copy, N_SET(w->last[k]), side, far), low = N_LESS(N_SET(w->first[k]), copy, side, far);
  *border = N_MIN(*border, N_LESS(off, N_SET(0), low, high));
  p[k] = off;
}

static SDF_LARGE void SDF_(sdf_warp)(const SdfWarp *w, NUM p[3], NUM *border)
{
  *border = N_SET(1e18f);
  if (w->bend != 0) SDF_(sdf_turn)(w->bend * p[0], &p[0], &p[1]);
  if (w->twist != 0) SDF_(sdf_turn)(w->twist * p[1], &p[0], &p[2]);
  for (int k = 0; k < 3; k++) {
    if (w->spacing[k] > 0) SDF_(sdf_repeat)(w, k, p, border);
    if (w->elongate[k] > 0) p[k] = p[k] - SDF_(sdf_clamp)(p[k], N_SET(-w->elongate[k]), N_SET(w->elongate[k]));
  }
}

static inline NUM SDF_(sdf_change)(const SdfStep *s, const SdfWarp *w, const NUM around[3], NUM x)
{
  if (w->onion > 0) x = SDF_(sdf_abs)(x) - w->onion * s->scale;
  x = x - w->round * s->scale;
  if (w->noise != 0) {
    NUM p[3];
    SDF_(sdf_map)(s, around, p);
    for (int k = 0; k < 3; k++) p[k] = p[k] * w->noise_frequency;
    x = x + w->noise * s->scale * SDF_(sdf_noise)(p[0], p[1], p[2], w->seed);
  }
  return x;
}

// What a step did, for who has to know: its own value, what came of joining it, and the place in its own space.
typedef struct SDF_(SdfTrace) {
  NUM value, joined, p[3];
} SDF_(SdfTrace);

// What a tape remembers between its steps: values not yet joined, and the places in the spaces it is inside of.
typedef struct SDF_(SdfMemory) {
  NUM values[SDF_MOST_DEPTH + 2], places[SDF_MOST_DEPTH + 1][3], borders[SDF_MOST_DEPTH + 1];
  int depth, height;
} SDF_(SdfMemory);

static inline void SDF_(sdf_begin_tape)(SDF_(SdfMemory) *m, const NUM p[3])
{
  m->depth = m->height = 0;
  for (int k = 0; k < 3; k++) m->places[0][k] = p[k];
}

static inline void SDF_(sdf_step)(const Sdf *f, uint16_t code, SDF_(SdfMemory) *m, SDF_(SdfTrace) *trace)
{
  const SdfStep *s = &f->steps[code >> 1];
  NUM x, own[3];
  for (int k = 0; k < 3; k++) own[k] = m->places[m->depth][k];
  if (s->kind == SDF_ENTER) {
    SDF_(sdf_map)(s, m->places[m->depth], own);
    if (trace)
      for (int k = 0; k < 3; k++) trace->p[k] = own[k];
    m->depth++;
    SDF_(sdf_warp)(&f->warps[s->warp], own, &m->borders[m->depth]);
    m->borders[m->depth] = m->borders[m->depth] * s->scale;
    for (int k = 0; k < 3; k++) m->places[m->depth][k] = own[k];
    return;
  }
  if (s->kind == SDF_JOIN) {
    x = m->values[--m->height];
  } else if (s->kind == SDF_LEAVE) {
    const SdfWarp *w = &f->warps[s->warp];
    x = m->values[--m->height];
    if (w->has_space) x = N_MIN(x, m->borders[m->depth--]);
    x = SDF_(sdf_change)(s, w, m->places[m->depth], x);
  } else {
    SDF_(sdf_map)(s, m->places[m->depth], own);
    x = SDF_(sdf_primitive)(f, s, own) * s->scale;
  }
  const NUM joined = code & 1 ? x : SDF_(sdf_join)(s, m->values[--m->height], x);
  m->values[m->height++] = joined;
  if (!trace) return;
  trace->value = x;
  trace->joined = joined;
  for (int k = 0; k < 3; k++) trace->p[k] = own[k];
}

// The field's value at a place in its space. trace: one a code, or NULL.
static SDF_LARGE NUM SDF_(sdf_run)(const Sdf *f, const uint16_t *codes, uint32_t count, const NUM p[3], SDF_(SdfTrace) *trace)
{
  SDF_(SdfMemory) m;
  SDF_(sdf_begin_tape)(&m, p);
  for (uint32_t i = 0; i < count; i++) SDF_(sdf_step)(f, codes[i], &m, trace ? &trace[i] : NULL);
  return m.values[0];
}

#undef NUM
#undef INT
#undef UNSIGNED
#undef SDF_
#undef N_SET
#undef N_MIN
#undef N_MAX
#undef N_SQRT
#undef N_LESS
#undef N_TO_INT
#undef N_FROM_INT
