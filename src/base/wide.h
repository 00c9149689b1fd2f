// Wide: floats and integers in lanes of the build's native width, so that one kernel serves every level. Arithmetic
// and comparison are C operators on the types; only what C cannot say is here. This is the one file that knows
// instruction sets.
//
//   level  ref  v2  v3  v4
//   WIDE    1    4   8   8     (v4 stays at 256 bits: a single ray has eight boxes to test, not sixteen)
//
// Every function gives the same bits at every level, lane by lane, NaN and signed zeros included. A comparison gives
// a mask (wi): all ones where true in lanes, 1 in the plain form, and masks combine with & and |, not with ~.
// Layouts are fixed at eight lanes; a kernel steps `for (int g = 0; g < 8; g += WIDE)`.

#ifndef RAYFOLD_BASE_WIDE_H
#define RAYFOLD_BASE_WIDE_H

#include "base/vec.h"

#include <string.h>

#if defined(__AVX2__)
#include <immintrin.h>
#define WIDE 8
#elif defined(__SSE4_1__)
#include <smmintrin.h>
#define WIDE 4
#else
#if defined(__SSE__)
#include <xmmintrin.h>
#endif
#define WIDE 1
#endif

#if WIDE == 1
typedef float wf;
typedef int32_t wi;
#else
typedef float wf __attribute__((vector_size(4 * WIDE)));
typedef int32_t wi __attribute__((vector_size(4 * WIDE)));
#endif

static inline wf wf_set(float x) { return x - (wf){0}; } // x - 0 is x, also for -0

static inline wf wf_load(const float *p)
{
  wf x;
  memcpy(&x, p, sizeof x);
  return x;
}

static inline void wf_store(float *p, wf x) { memcpy(p, &x, sizeof x); }

#if WIDE == 8

// a < b ? a : b and a > b ? a : b: the second operand when either is NaN.
static inline wf wf_min(wf a, wf b) { return (wf)_mm256_min_ps((__m256)a, (__m256)b); }
static inline wf wf_max(wf a, wf b) { return (wf)_mm256_max_ps((__m256)a, (__m256)b); }
static inline wf wf_select(wi m, wf a, wf b)
{
  return (wf)_mm256_blendv_ps((__m256)b, (__m256)a, (__m256)m);
}
static inline wf wf_sqrt(wf a) { return (wf)_mm256_sqrt_ps((__m256)a); }
static inline unsigned wi_bits(wi m) { return (unsigned)_mm256_movemask_ps((__m256)m); }

#elif WIDE == 4

static inline wf wf_min(wf a, wf b) { return (wf)_mm_min_ps((__m128)a, (__m128)b); }
static inline wf wf_max(wf a, wf b) { return (wf)_mm_max_ps((__m128)a, (__m128)b); }
static inline wf wf_select(wi m, wf a, wf b) { return (wf)_mm_blendv_ps((__m128)b, (__m128)a, (__m128)m); }
static inline wf wf_sqrt(wf a) { return (wf)_mm_sqrt_ps((__m128)a); }
static inline unsigned wi_bits(wi m) { return (unsigned)_mm_movemask_ps((__m128)m); }

#else

static inline wf wf_min(wf a, wf b) { return a < b ? a : b; }
static inline wf wf_max(wf a, wf b) { return a > b ? a : b; }
static inline wf wf_select(wi m, wf a, wf b) { return m ? a : b; }
static inline wf wf_sqrt(wf a) { return sqrtf(a); }
static inline unsigned wi_bits(wi m) { return (unsigned)m & 1; }

#endif

// Lowest and highest of two points in all four lanes, with the same meaning as wf_min and wf_max: one instruction
// even in the baseline build, where tree builders live.
#if defined(__SSE__)
static inline Vec3 lanes_min(Vec3 a, Vec3 b) { return (Vec3)_mm_min_ps((__m128)a, (__m128)b); }
static inline Vec3 lanes_max(Vec3 a, Vec3 b) { return (Vec3)_mm_max_ps((__m128)a, (__m128)b); }
#else
static inline Vec3 lanes_min(Vec3 a, Vec3 b)
{
  for (int i = 0; i < 4; i++) a[i] = a[i] < b[i] ? a[i] : b[i];
  return a;
}
static inline Vec3 lanes_max(Vec3 a, Vec3 b)
{
  for (int i = 0; i < 4; i++) a[i] = a[i] > b[i] ? a[i] : b[i];
  return a;
}
#endif

#endif
