// Transcendental functions that give the same bits everywhere: libm's differ between versions and machines, and a
// picture must not. Each takes and gives floats but works in double with + - * / and sqrt alone, so a result is
// the nearest float in nearly all cases (at most 0.51 ulp off, tests/test_fmath.c) without tables or tricks.
//
// Not here: vector forms, and the corner cases of C's annex F beyond those named below.

#ifndef RAYFOLD_BASE_FMATH_H
#define RAYFOLD_BASE_FMATH_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

static inline uint64_t bits_of_double(double x)
{
  uint64_t bits;
  memcpy(&bits, &x, 8);
  return bits;
}

static inline double double_of_bits(uint64_t bits)
{
  double x;
  memcpy(&x, &bits, 8);
  return x;
}

// Adding and taking away 1.5 * 2^52 rounds to an integer (ties to even), and leaves that integer in the low bits of
// the sum.
#define FMATH_ROUNDER 0x1.8p52

// Sine and cosine. Exact reduction to +-pi/4 by Cody and Waite's split of pi/2 (33 bits and the rest, "Software
// Manual for the Elementary Functions", 1980), then the Taylor series. Beyond 1e6 radians, where a float no longer
// tells angles apart well, the answer is that of 0; NaN and infinity give NaN.
static inline void f_sincos(float x, float *sine, float *cosine)
{
  const double a = fabsf(x) <= 1e6f ? x : x - x;
  const double turned = a * 0x1.45f306dc9c883p-1 + FMATH_ROUNDER; // 2 / pi
  const double quarters = turned - FMATH_ROUNDER;
  const double r = a - quarters * 0x1.921fb54400000p+0 - quarters * 0x1.0b4611a626331p-34;
  const double z = r * r;
  const double s =
      r + r * z * (-1.0 / 6 + z * (1.0 / 120 + z * (-1.0 / 5040 + z * (1.0 / 362880 - z * (1.0 / 39916800)))));
  const double c =
      1 + z * (-0.5 +
               z * (1.0 / 24 + z * (-1.0 / 720 + z * (1.0 / 40320 + z * (-1.0 / 3628800 + z * (1.0 / 479001600))))));
  const unsigned quarter = (unsigned)bits_of_double(turned) & 3;
  const double sine_of = quarter & 1 ? c : s, cosine_of = quarter & 1 ? s : c;
  *sine = (float)(quarter & 2 ? -sine_of : sine_of);
  *cosine = (float)((quarter + 1) & 2 ? -cosine_of : cosine_of);
}

static inline float f_sin(float x)
{
  float s, c;
  f_sincos(x, &s, &c);
  return s;
}

static inline float f_cos(float x)
{
  float s, c;
  f_sincos(x, &s, &c);
  return c;
}

// e^x for doubles whose result is meant for a float: 2^k e^r with |r| <= ln(2)/2, Taylor to degree 8 (2e-10).
static inline double fmath_exp(double x)
{
  if (!(x == x)) return x;
  if (x > 89) return INFINITY;
  if (x < -104) return 0;
  const double scaled = x * 0x1.71547652b82fep+0 + FMATH_ROUNDER; // 1 / ln 2
  const double k = scaled - FMATH_ROUNDER;
  const double r = x - k * 0x1.62e42fefa39efp-1;
  const double high = 1.0 / 24 + r * (1.0 / 120 + r * (1.0 / 720 + r * (1.0 / 5040 + r * (1.0 / 40320))));
  const double e = 1 + r * (1 + r * (0.5 + r * (1.0 / 6 + r * high)));
  const uint64_t exponent = (bits_of_double(scaled) + 1023) & 0x7ff;
  return e * double_of_bits(exponent << 52);
}

static inline float f_exp(float x)
{
  return (float)fmath_exp(x);
}

// ln x for positive doubles that were floats: 2^k m with m in [sqrt 1/2, sqrt 2), and ln m = 2 artanh s with
// s = (m - 1) / (m + 1), |s| <= 0.172 (Abramowitz and Stegun 4.1.27), series to s^13 (2e-12).
static inline double fmath_log(double x)
{
  const uint64_t bits = bits_of_double(x);
  const uint64_t shifted = bits - 0x3fe6a09e667f3bcdu; // the bits of sqrt 1/2
  const double k = (double)((int64_t)shifted >> 52);
  const double m = double_of_bits(bits - (shifted & 0xfff0000000000000u));
  const double s = (m - 1) / (m + 1), z = s * s;
  const double high = 1.0 / 7 + z * (1.0 / 9 + z * (1.0 / 11 + z * (1.0 / 13)));
  return k * 0x1.62e42fefa39efp-1 + 2 * s * (1 + z * (1.0 / 3 + z * (1.0 / 5 + z * high)));
}

// ln x: -infinity at 0, NaN below.
static inline float f_log(float x)
{
  if (!(x > 0)) return x == 0 ? -INFINITY : NAN;
  return isinf(x) ? x : (float)fmath_log(x);
}

// x to the power y for x >= 0; NaN for negative x, 1 for y = 0 (as in C).
static inline float f_pow(float x, float y)
{
  if (y == 0) return 1;
  if (!(x > 0)) return x == 0 ? (y > 0 ? 0 : INFINITY) : NAN;
  if (isinf(x)) return y > 0 ? INFINITY : 0;
  return (float)fmath_exp(y * fmath_log(x));
}

// The angle of the point (x, y), -pi..pi. Reduction to |t| <= tan(pi/8), then a polynomial in t^2 through the
// Chebyshev nodes of that interval (7 terms, relative error 3e-11).
static inline double fmath_atan2(double y, double x)
{
  const double ax = fabs(x), ay = fabs(y);
  const double big = ax > ay ? ax : ay, small = ax > ay ? ay : ax;
  if (big == 0) return copysign(signbit(x) ? 0x1.921fb54442d18p+1 : 0.0, y);
  const bool is_steep = small > 0.41421356237309503 * big;
  const double t = is_steep ? (small - big) / (small + big) : small / big;
  const double z = t * t;
  const double high = 0x1.c437ebb461d52p-4 + z * (-0x1.5a5d9c695c281p-4 + z * 0x1.81a0409b71171p-5);
  const double p =
      0x1.ffffffffd07fbp-1 +
      z * (-0x1.5555548109ce6p-2 + z * (0x1.9998fdb71601ep-3 + z * (-0x1.247ca7fa76bc3p-3 + z * high)));
  double angle = t * p + (is_steep ? 0x1.921fb54442d18p-1 : 0);
  if (ay > ax) angle = 0x1.921fb54442d18p+0 - angle;
  if (signbit(x)) angle = 0x1.921fb54442d18p+1 - angle;
  return copysign(angle, y);
}

static inline float f_atan2(float y, float x)
{
  return (float)fmath_atan2(y, x);
}

// Arcs of x held to -1..1, so that a cosine a little off needs no care at the caller's.
static inline float f_acos(float x)
{
  const double a = x > 1 ? 1 : x < -1 ? -1 : x;
  return (float)fmath_atan2(sqrt((1 - a) * (1 + a)), a);
}

static inline float f_asin(float x)
{
  const double a = x > 1 ? 1 : x < -1 ? -1 : x;
  return (float)fmath_atan2(a, sqrt((1 - a) * (1 + a)));
}

#endif
