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
#if defined(__AVX512VL__)
static inline unsigned wf_le(wf a, wf b) { return _mm256_cmp_ps_mask((__m256)a, (__m256)b, _CMP_LE_OQ); }
static inline unsigned wf_lt(wf a, wf b) { return _mm256_cmp_ps_mask((__m256)a, (__m256)b, _CMP_LT_OQ); }
static inline unsigned wf_eq(wf a, wf b) { return _mm256_cmp_ps_mask((__m256)a, (__m256)b, _CMP_EQ_OQ); }
#else
static inline unsigned wf_le(wf a, wf b) { return wi_bits(a <= b); }
static inline unsigned wf_lt(wf a, wf b) { return wi_bits(a < b); }
static inline unsigned wf_eq(wf a, wf b) { return wi_bits(a == b); }
#endif

#elif WIDE == 4

static inline wf wf_min(wf a, wf b) { return (wf)_mm_min_ps((__m128)a, (__m128)b); }
static inline wf wf_max(wf a, wf b) { return (wf)_mm_max_ps((__m128)a, (__m128)b); }
static inline wf wf_select(wi m, wf a, wf b) { return (wf)_mm_blendv_ps((__m128)b, (__m128)a, (__m128)m); }
static inline wf wf_sqrt(wf a) { return (wf)_mm_sqrt_ps((__m128)a); }
static inline unsigned wi_bits(wi m) { return (unsigned)_mm_movemask_ps((__m128)m); }
static inline unsigned wf_le(wf a, wf b) { return wi_bits(a <= b); }
static inline unsigned wf_lt(wf a, wf b) { return wi_bits(a < b); }
static inline unsigned wf_eq(wf a, wf b) { return wi_bits(a == b); }

#else

static inline wf wf_min(wf a, wf b) { return a < b ? a : b; }
static inline wf wf_max(wf a, wf b) { return a > b ? a : b; }
static inline wf wf_select(wi m, wf a, wf b) { return m ? a : b; }
static inline wf wf_sqrt(wf a) { return sqrtf(a); }
static inline unsigned wi_bits(wi m) { return (unsigned)m & 1; }
static inline unsigned wf_le(wf a, wf b) { return a <= b; }
static inline unsigned wf_lt(wf a, wf b) { return a < b; }
static inline unsigned wf_eq(wf a, wf b) { return a == b; }

#endif

// The widest registers there are, for many rays at once and for both planes of eight boxes: WIDEST lanes, with the
// functions of wf under the name wx. Comparisons give one bit a lane.
#if defined(__AVX512F__)
#define WIDEST 16
typedef float wx __attribute__((vector_size(64)));
typedef int32_t wxi __attribute__((vector_size(64)));

static inline wx wx_min(wx a, wx b) { return (wx)_mm512_min_ps((__m512)a, (__m512)b); }
static inline wx wx_max(wx a, wx b) { return (wx)_mm512_max_ps((__m512)a, (__m512)b); }
static inline wx wx_sqrt(wx a) { return (wx)_mm512_sqrt_ps((__m512)a); }
static inline unsigned wx_le(wx a, wx b) { return _mm512_cmp_ps_mask((__m512)a, (__m512)b, _CMP_LE_OQ); }
static inline unsigned wx_lt(wx a, wx b) { return _mm512_cmp_ps_mask((__m512)a, (__m512)b, _CMP_LT_OQ); }
static inline unsigned wx_eq(wx a, wx b) { return _mm512_cmp_ps_mask((__m512)a, (__m512)b, _CMP_EQ_OQ); }
// bits ? a : b
static inline wx wx_choose(unsigned bits, wx a, wx b)
{
  return (wx)_mm512_mask_blend_ps((__mmask16)bits, (__m512)b, (__m512)a);
}
// Of all lanes, none of them NaN.
static inline float wx_least(wx x) { return _mm512_reduce_min_ps((__m512)x); }
static inline float wx_most(wx x) { return _mm512_reduce_max_ps((__m512)x); }
static inline wx wx_load(const float *p) { return (wx)_mm512_loadu_ps(p); }
static inline void wx_store(float *p, wx x) { _mm512_storeu_ps(p, (__m512)x); }
// Writes the lanes in bits, of a vector or of one number, and leaves the others as they are.
static inline void wx_put(float *p, unsigned bits, wx x) { _mm512_mask_storeu_ps(p, (__mmask16)bits, (__m512)x); }
static inline void wx_put_int(uint32_t *p, unsigned bits, uint32_t x)
{
  _mm512_mask_storeu_epi32(p, (__mmask16)bits, _mm512_set1_epi32((int)x));
}
static inline wx wx_lanes(wxi order, const float *p) { return (wx)_mm512_permutexvar_ps((__m512i)order, _mm512_loadu_ps(p)); }
static inline wx wx_join(wf low, wf high)
{
  return (wx)_mm512_insertf32x8(_mm512_castps256_ps512((__m256)low), (__m256)high, 1);
}
static inline wf wx_low(wx x) { return (wf)_mm512_castps512_ps256((__m512)x); }
static inline wf wx_high(wx x) { return (wf)_mm512_extractf32x8_ps((__m512)x, 1); }
#else
#define WIDEST WIDE
typedef wf wx;
typedef wi wxi;

static inline wx wx_min(wx a, wx b) { return wf_min(a, b); }
static inline wx wx_max(wx a, wx b) { return wf_max(a, b); }
static inline wx wx_sqrt(wx a) { return wf_sqrt(a); }
static inline unsigned wx_le(wx a, wx b) { return wf_le(a, b); }
static inline unsigned wx_lt(wx a, wx b) { return wf_lt(a, b); }
static inline unsigned wx_eq(wx a, wx b) { return wf_eq(a, b); }
static inline wx wx_load(const float *p) { return wf_load(p); }
static inline float wx_least(wx x)
{
  float lane[WIDE], least;
  wf_store(lane, x);
  least = lane[0];
  for (int i = 1; i < WIDE; i++) least = lane[i] < least ? lane[i] : least;
  return least;
}
static inline float wx_most(wx x) { return -wx_least(-x); }
static inline void wx_store(float *p, wx x) { wf_store(p, x); }
static inline void wx_put_int(uint32_t *p, unsigned bits, uint32_t x)
{
  for (; bits; bits &= bits - 1) p[__builtin_ctz(bits)] = x;
}
static inline wx wx_choose(unsigned bits, wx a, wx b)
{
#if WIDE == 1
  return bits & 1 ? a : b;
#else
  wi lane, m;
  for (int i = 0; i < WIDE; i++) lane[i] = 1 << i;
  m = (((wi){0} + (int32_t)bits) & lane) == lane;
  return wf_select(m, a, b);
#endif
}
static inline void wx_put(float *p, unsigned bits, wx x) { wf_store(p, wx_choose(bits, x, wf_load(p))); }
#endif
static inline wx wx_set(float x) { return x - (wx){0}; }

// Integers in as many lanes; wxu shifts and multiplies modulo 2^32.
#if WIDEST != 16
typedef wi wxi;
#endif
#if WIDEST == 1
typedef uint32_t wxu;
static inline wxu wx_pattern(wx x)
{
  wxu bits;
  memcpy(&bits, &x, sizeof bits);
  return bits;
}
static inline wx wx_of_pattern(wxu bits)
{
  wx x;
  memcpy(&x, &bits, sizeof x);
  return x;
}
static inline wx wx_of_int(wxi i) { return (float)i; }
static inline wxi wx_truncate(wx x) { return (int32_t)x; } // of what an int32_t holds
static inline wx wx_floor(wx x) { return floorf(x); }
#else
typedef uint32_t wxu __attribute__((vector_size(4 * WIDEST)));
static inline wxu wx_pattern(wx x) { return (wxu)x; }
static inline wx wx_of_pattern(wxu bits) { return (wx)bits; }
static inline wx wx_of_int(wxi i) { return __builtin_convertvector(i, wx); }
static inline wxi wx_truncate(wx x) { return __builtin_convertvector(x, wxi); } // of what an int32_t holds
#if WIDEST == 16
static inline wx wx_floor(wx x) { return (wx)_mm512_roundscale_ps((__m512)x, _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC); }
#elif WIDEST == 8
static inline wx wx_floor(wx x) { return (wx)_mm256_floor_ps((__m256)x); }
#else
static inline wx wx_floor(wx x) { return (wx)_mm_floor_ps((__m128)x); }
#endif
#endif
static inline wxu wxu_set(uint32_t x) { return x - (wxu){0}; }
static inline wx wx_abs(wx x) { return wx_of_pattern(wx_pattern(x) & 0x7fffffffu); }
// The size of a with the sign of b.
static inline wx wx_signed(wx a, wx b)
{
  return wx_of_pattern((wx_pattern(a) & 0x7fffffffu) | (wx_pattern(b) & 0x80000000u));
}
static inline wxu wxu_load(const uint32_t *p)
{
  wxu x;
  memcpy(&x, p, sizeof x);
  return x;
}
static inline void wxu_store(uint32_t *p, wxu x) { memcpy(p, &x, sizeof x); }
static inline wxu wxu_choose(unsigned bits, wxu a, wxu b)
{
  return wx_pattern(wx_choose(bits, wx_of_pattern(a), wx_of_pattern(b)));
}
// Lanes of two integers that agree.
static inline unsigned wxu_eq(wxu a, wxu b)
{
#if WIDEST == 16
  return _mm512_cmpeq_epi32_mask((__m512i)a, (__m512i)b);
#elif WIDEST == 8
  return (unsigned)_mm256_movemask_ps((__m256)(a == b));
#elif WIDEST == 4
  return (unsigned)_mm_movemask_ps((__m128)(a == b));
#else
  return a == b;
#endif
}
// Of the lanes in bits table[at], of the others `rest`.
static inline wxu wxu_gather(const uint32_t *table, unsigned bits, wxu at, wxu rest)
{
#if WIDEST == 16
  return (wxu)_mm512_mask_i32gather_epi32((__m512i)rest, (__mmask16)bits, (__m512i)at, table, 4);
#elif WIDEST == 1
  return bits & 1 ? table[at] : rest;
#else
  for (int i = 0; i < WIDEST; i++)
    if (bits >> i & 1) rest[i] = table[at[i]];
  return rest;
#endif
}
// Lanes in bits, side by side from p on. WIDEST numbers may be written.
static inline void wx_squeeze(float *p, unsigned bits, wx x)
{
#if WIDEST == 16
  _mm512_storeu_ps(p, _mm512_maskz_compress_ps((__mmask16)bits, (__m512)x));
#else
  float lane[WIDEST];
  wx_store(lane, x);
  for (; bits; bits &= bits - 1) *p++ = lane[__builtin_ctz(bits)];
#endif
}
static inline void wxu_squeeze(uint32_t *p, unsigned bits, wxu x)
{
#if WIDEST == 16
  _mm512_storeu_si512(p, _mm512_maskz_compress_epi32((__mmask16)bits, (__m512i)x));
#else
  uint32_t lane[WIDEST];
  wxu_store(lane, x);
  for (; bits; bits &= bits - 1) *p++ = lane[__builtin_ctz(bits)];
#endif
}

// a * b + c, rounded once where the processor can (v3, v4) and twice elsewhere: the one function whose bits depend on
// the level, for sums so long that the picture's last bits are worth less than half of their time.
static inline wx wx_fma(wx a, wx b, wx c)
{
#if WIDEST == 16
  return (wx)_mm512_fmadd_ps((__m512)a, (__m512)b, (__m512)c);
#elif defined(__FMA__)
  return (wx)_mm256_fmadd_ps((__m256)a, (__m256)b, (__m256)c);
#else
  return a * b + c;
#endif
}
#define WIDEST_BITS (WIDEST == 16 ? 0xffffu : (1u << WIDEST) - 1)

// Eight rows of eight floats, one after another, to columns `stride` floats apart.
static inline void wide_transpose8(const float *rows, float *columns, size_t stride)
{
#if defined(__AVX__)
  __m256 r[8], a[8], b[8];
  for (int i = 0; i < 8; i++) r[i] = _mm256_loadu_ps(rows + 8 * i);
  for (int i = 0; i < 8; i += 2) {
    a[i] = _mm256_unpacklo_ps(r[i], r[i + 1]);
    a[i + 1] = _mm256_unpackhi_ps(r[i], r[i + 1]);
  }
  for (int i = 0; i < 8; i += 4) {
    b[i] = _mm256_shuffle_ps(a[i], a[i + 2], 0x44);
    b[i + 1] = _mm256_shuffle_ps(a[i], a[i + 2], 0xee);
    b[i + 2] = _mm256_shuffle_ps(a[i + 1], a[i + 3], 0x44);
    b[i + 3] = _mm256_shuffle_ps(a[i + 1], a[i + 3], 0xee);
  }
  for (size_t i = 0; i < 4; i++) {
    _mm256_storeu_ps(columns + i * stride, _mm256_permute2f128_ps(b[i], b[i + 4], 0x20));
    _mm256_storeu_ps(columns + (i + 4) * stride, _mm256_permute2f128_ps(b[i], b[i + 4], 0x31));
  }
#else
  for (size_t c = 0; c < 8; c++)
    for (size_t r = 0; r < 8; r++) columns[c * stride + r] = rows[8 * r + c];
#endif
}

// Bytes to floats, WIDEST of them.
static inline wx wx_bytes(const uint8_t *p)
{
#if WIDEST == 16
  return (wx)_mm512_cvtepi32_ps(_mm512_cvtepu8_epi32(_mm_loadu_si128((const __m128i *)(const void *)p)));
#elif WIDE == 8
  return (wf)_mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(_mm_loadl_epi64((const __m128i *)(const void *)p)));
#elif WIDE == 4
  int32_t four;
  memcpy(&four, p, sizeof four);
  return (wf)_mm_cvtepi32_ps(_mm_cvtepu8_epi32(_mm_cvtsi32_si128(four)));
#else
  return (float)*p;
#endif
}

// Eight points of three floats, each somewhere else, to three rows of eight. Plain loads, since gathers are slow on
// processors mended against data sampling.
static inline void wide_points8(const float *const points[8], float rows[3][8])
{
#if defined(__AVX__)
  const __m128i three = _mm_setr_epi32(-1, -1, -1, 0);
  __m256 r[4];
  for (int i = 0; i < 4; i++) {
    const __m128 low = _mm_maskload_ps(points[i], three), high = _mm_maskload_ps(points[i + 4], three);
    r[i] = _mm256_insertf128_ps(_mm256_castps128_ps256(low), high, 1);
  }
  const __m256 xy01 = _mm256_unpacklo_ps(r[0], r[1]), xy23 = _mm256_unpacklo_ps(r[2], r[3]);
  const __m256 z01 = _mm256_unpackhi_ps(r[0], r[1]), z23 = _mm256_unpackhi_ps(r[2], r[3]);
  _mm256_storeu_ps(rows[0], _mm256_shuffle_ps(xy01, xy23, 0x44));
  _mm256_storeu_ps(rows[1], _mm256_shuffle_ps(xy01, xy23, 0xee));
  _mm256_storeu_ps(rows[2], _mm256_shuffle_ps(z01, z23, 0x44));
#else
  for (int i = 0; i < 8; i++)
    for (int k = 0; k < 3; k++) rows[k][i] = points[i][k];
#endif
}

// Fetches cache lines that will be read soon. A function that only prefetches has no effect in GCC's eyes, and
// where it is not inlined at once its calls are dropped; the empty statement keeps them.
static inline void fetch_ahead(const void *p, size_t size)
{
  for (size_t at = 0; at < size; at += 64) __builtin_prefetch((const char *)p + at);
  __asm__ volatile("");
}

// Where the processor can compress and sort eight 64-bit numbers in a register, a walk puts children on its stack
// without a branch.
#if WIDE == 8 && defined(__AVX512VL__)
#define WIDE_SORTS 1

// One step of a sorting network, larger numbers to the front: compares each lane with its partner.
#define WIDE_SORT_STEP(k, partner, back)                                                                                \
  do {                                                                                                                  \
    const __m512i p_ = partner;                                                                                         \
    k = _mm512_mask_min_epu64(_mm512_max_epu64(k, p_), back, k, p_);                                                    \
  } while (0)

// Writes key << 32 | value of the lanes in bits to the stack at top, sorted so that the smallest key comes last, or
// in lane order. Returns how many. Room for eight is needed. Keys must not be negative. The network is Batcher's
// merge exchange for four lanes, and for eight where there are more than four.
static inline int wide_push(uint64_t *top, const uint32_t *values, wf keys, unsigned bits, bool is_sorted)
{
  const __m512i high = _mm512_slli_epi64(_mm512_cvtepu32_epi64((__m256i)keys), 32);
  const __m512i low = _mm512_cvtepu32_epi64(_mm256_loadu_si256((const __m256i *)values));
  __m512i k = _mm512_maskz_compress_epi64((__mmask8)bits, _mm512_or_si512(high, low));
  const int count = __builtin_popcount(bits);
  if (is_sorted) {
    if (__builtin_expect(count > 4, 0)) {
      const __m512i l3 = _mm512_setr_epi64(0, 2, 1, 3, 4, 6, 5, 7), l5 = _mm512_setr_epi64(0, 1, 4, 5, 2, 3, 6, 7);
      const __m512i l6 = _mm512_setr_epi64(0, 2, 1, 4, 3, 6, 5, 7);
      WIDE_SORT_STEP(k, _mm512_permutex_epi64(k, 0xb1), 0xaa);
      WIDE_SORT_STEP(k, _mm512_permutex_epi64(k, 0x4e), 0xcc);
      WIDE_SORT_STEP(k, _mm512_permutexvar_epi64(l3, k), 0x44);
      WIDE_SORT_STEP(k, _mm512_shuffle_i64x2(k, k, 0x4e), 0xf0);
      WIDE_SORT_STEP(k, _mm512_permutexvar_epi64(l5, k), 0x30);
      WIDE_SORT_STEP(k, _mm512_permutexvar_epi64(l6, k), 0x54);
    } else {
      __m256i q = _mm512_castsi512_si256(k), p = _mm256_permute4x64_epi64(q, 0xb1);
      q = _mm256_mask_min_epu64(_mm256_max_epu64(q, p), 0xa, q, p);
      p = _mm256_permute4x64_epi64(q, 0x4e);
      q = _mm256_mask_min_epu64(_mm256_max_epu64(q, p), 0xc, q, p);
      p = _mm256_permute4x64_epi64(q, 0xd8);
      q = _mm256_mask_min_epu64(_mm256_max_epu64(q, p), 0x4, q, p);
      _mm256_storeu_si256((__m256i *)(void *)top, q);
      return count;
    }
  }
  _mm512_storeu_si512(top, k);
  return count;
}
#else
#define WIDE_SORTS 0
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
