// Lanes: eight or four floats as one, by the compiler's vectors. What C has no operator for (least, greatest, the
// signs as bits) is here; where the machine lacks the instruction, the compiler takes the vector apart.

#ifndef BENCH_LADDER_LANES_H
#define BENCH_LADDER_LANES_H

#include <stdint.h>
#include <string.h>

#ifdef __AVX2__
#include <immintrin.h>
#endif

typedef float v4 __attribute__((vector_size(16)));
typedef float v8 __attribute__((vector_size(32)));
typedef int32_t i4 __attribute__((vector_size(16)));
typedef int32_t i8 __attribute__((vector_size(32)));

static inline v4 v4_all(float f)
{
  return (v4){f, f, f, f};
}
static inline v8 v8_all(float f)
{
  return (v8){f, f, f, f, f, f, f, f};
}

static inline v4 v4_halves_changed(v4 a)
{
  return (v4){a[2], a[3], a[0], a[1]};
}

static inline v4 v4_load(const float *p)
{
  v4 v;
  memcpy(&v, p, sizeof v);
  return v;
}

static inline v8 v8_load(const float *p)
{
  v8 v;
  memcpy(&v, p, sizeof v);
  return v;
}

#ifdef __AVX2__
static inline v4 v4_min(v4 a, v4 b)
{
  return _mm_min_ps(a, b);
}
static inline v4 v4_max(v4 a, v4 b)
{
  return _mm_max_ps(a, b);
}
static inline v8 v8_min(v8 a, v8 b)
{
  return _mm256_min_ps(a, b);
}
static inline v8 v8_max(v8 a, v8 b)
{
  return _mm256_max_ps(a, b);
}
static inline unsigned i4_bits(i4 m)
{
  return (unsigned)_mm_movemask_ps((v4)m);
}
static inline unsigned i8_bits(i8 m)
{
  return (unsigned)_mm256_movemask_ps((v8)m);
}
static inline v8 v8_choose(i8 m, v8 yes, v8 no)
{
  return _mm256_blendv_ps(no, yes, (v8)m);
}

static inline v8
v8_of_bytes(const uint8_t p[8]) // GCC 12 makes eight scalar conversions of __builtin_convertvector
{
  return _mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(_mm_loadl_epi64((const __m128i *)(const void *)p)));
}
#else
static inline v8 v8_of_bytes(const uint8_t p[8])
{
  return (v8){p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7]};
}

static inline v8 v8_choose(i8 m, v8 yes, v8 no)
{
  return (v8)((m & (i8)yes) | (~m & (i8)no));
}
static inline v4 v4_min(v4 a, v4 b)
{
  return (v4)(((a < b) & (i4)a) | (~(a < b) & (i4)b));
}
static inline v4 v4_max(v4 a, v4 b)
{
  return (v4)(((a > b) & (i4)a) | (~(a > b) & (i4)b));
}
static inline v8 v8_min(v8 a, v8 b)
{
  return v8_choose(a < b, a, b);
}
static inline v8 v8_max(v8 a, v8 b)
{
  return v8_choose(a > b, a, b);
}

static inline unsigned i4_bits(i4 m)
{
  unsigned bits = 0;
  for (int i = 0; i < 4; i++) bits |= (unsigned)(m[i] < 0) << i;
  return bits;
}

static inline unsigned i8_bits(i8 m)
{
  unsigned bits = 0;
  for (int i = 0; i < 8; i++) bits |= (unsigned)(m[i] < 0) << i;
  return bits;
}
#endif

#endif
