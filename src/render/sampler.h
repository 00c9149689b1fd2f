// Sampler: where each sample of each pixel looks. A value is a function of (pixel, sample, dimension, seed) and there
// is no state, so any thread may take any sample in any order, and the first n samples are the same in every run.
//
// Dimensions come in pairs. Within a pixel each pair is an Owen-scrambled Sobol (0,2)-sequence; pairs are padded by
// shuffling the sample index (Burley, "Practical hash-based Owen scrambling", JCGT 2020). Between pixels the error is
// spread as blue noise: a pixel's rank p along a shuffled Z curve (Ahmed and Wonka, "Screen-space blue-noise
// diffusion of Monte Carlo sampling error via hierarchical ordering of pixels", 2020) goes in as a second index:
//
//   x = owen(I s ^ L p),  y = owen(U s ^ L U p)      over GF(2), U[r][c] = C(c, r), L the transpose of U
//
// I and U are the first two Sobol matrices. Any j rows in succession of L's first j columns are regular, so below the
// bits that 2^k samples settle, 2^j neighbours of one block still differ evenly: the spread holds at every power of
// two, while Ahmed and Wonka must know the number of samples in advance. Seen from one pixel, L p is only a digital
// shift under an Owen scrambling, so its own convergence is that of plain Owen-scrambled Sobol.
//
// The scrambling is shared by blocks of 16 x 16 pixels, not by the picture: an unlucky one would show everywhere.
// Inside a block each pixel deals the samples of [2^k, 2^(k+1)) in its own order, so that pairs do not meet in the
// same way in every pixel; without this, functions of four and more dimensions were 35 % noisier after a blur.
//
// Measured (RMSE, and after a Gaussian blur of 1.5 pixels in brackets, 64 x 64 pixels, 16 seeds):
//                          plain Owen per pixel    a void-and-cluster mask XORed in    this
//   2-D bell,    1 sample    .240 (.0452)            .241 (.0102)                        .241 (.0198)
//   2-D bell,    4           .0497 (.0095)           .0495 (.0064)                       .0494 (.0040)
//   2-D bell,   16           .0080 (.0015)           .0077 (.0014)                       .0081 (.0009)
//   2-D edge,    4           .157 (.0295)            .155 (.0300)                        .158 (.0198)
//   6-D smooth, 16           .0504 (.0094)           .0500 (.0101)                       .0505 (.0098)
// The mask is better at one sample and no better than plain from sixteen on, because an XOR reaches only the mask's
// low bits once the high ones are stratified; a mask's low bits are white.
//
// Does not tell apart samples 2^32 apart or pixels 65536 apart.

#ifndef RAYFOLD_RENDER_SAMPLER_H
#define RAYFOLD_RENDER_SAMPLER_H

#include "base/hash.h"
#include "base/vec.h"

#include <stdint.h>

enum { SAMPLER_ROWS = 64 };

// The place of one sample: what all its dimensions share.
typedef struct Sampler {
  uint32_t block_seed, pixel_seed;
  uint32_t rank;   // the pixel's rank along the Z curve, its bits reversed
  uint32_t sample; // its index, bits reversed
} Sampler;

static inline uint32_t bits_reverse(uint32_t x)
{
  x = ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
  x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
  x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
  return __builtin_bswap32(x);
}

// Spreads the low 16 bits to the even places.
static inline uint32_t bits_spread(uint32_t x)
{
  x = (x | (x << 8)) & 0x00ff00ffu;
  x = (x | (x << 4)) & 0x0f0f0f0fu;
  x = (x | (x << 2)) & 0x33333333u;
  return (x | (x << 1)) & 0x55555555u;
}

// U and L applied to an index, bit 0 first. C(c, r) is odd exactly when the bits of r are among those of c (Lucas), so
// both are sums over subsets in five steps (Ahmed, "An implementation algorithm of 2D Sobol sequence", 2024).
static inline uint32_t pascal_upper(uint32_t v)
{
  v ^= v >> 16;
  v ^= (v >> 8) & 0x00ff00ffu;
  v ^= (v >> 4) & 0x0f0f0f0fu;
  v ^= (v >> 2) & 0x33333333u;
  return v ^ ((v >> 1) & 0x55555555u);
}

static inline uint32_t pascal_lower(uint32_t v)
{
  v ^= v << 16;
  v ^= (v << 8) & 0xff00ff00u;
  v ^= (v << 4) & 0xf0f0f0f0u;
  v ^= (v << 2) & 0xccccccccu;
  return v ^ ((v << 1) & 0xaaaaaaaau);
}

// Owen scrambling of reversed bits: each bit is flipped by a hash of those below it (Laine and Karras, "Stratified
// sampling for stochastic transparency", 2011, with the constants of Vegdahl, 2021).
static inline uint32_t owen_reversed(uint32_t x, uint32_t seed)
{
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1;
  x ^= x * 0x05526c56u;
  return x ^ (x * 0x53a22864u);
}

static inline Sampler sampler_begin(uint32_t x, uint32_t y, uint32_t sample, uint32_t seed)
{
  const uint32_t rank = bits_spread(x) | bits_spread(y) << 1;
  const uint32_t h = hash_u32(seed + 0x68bc21ebu);
  return (Sampler){hash_u32(h ^ (rank >> 8) * 0x85ebca6bu), hash_u32(h + rank * 0x9e3779b9u),
                   bits_reverse(rank), bits_reverse(sample)};
}

// The pixel's own order within [2^k, 2^(k+1)): the k bits below the highest are scrambled, the set of the first 2^k
// samples stays. All in reversed bits.
// zeros: below the lowest bit of sample, 31 - k; 31 of 0.
static inline uint32_t sample_dealt(uint32_t sample, uint32_t zeros, uint32_t seed)
{
  const uint32_t up = (zeros + 1) & 31;
  const uint32_t dealt = owen_reversed(sample >> up, seed) << up | 1u << zeros;
  return zeros >= 30 ? sample : dealt;
}

typedef struct SampleBits {
  uint32_t x, y; // fractions of 2^32
} SampleBits;

static inline SampleBits sample_bits_at(const Sampler *s, uint32_t zeros, uint32_t pair)
{
  const uint32_t h = hash_u32(s->block_seed ^ pair * 0x9e3779b9u);
  const uint32_t dealt = sample_dealt(s->sample, zeros, hash_u32(s->pixel_seed + pair));
  const uint32_t index = bits_reverse(owen_reversed(dealt, h));
  const uint32_t rank = bits_reverse(owen_reversed(s->rank, h ^ 0xb5297a4du));
  const uint32_t x = index ^ pascal_lower(rank);
  const uint32_t y = pascal_upper(index) ^ pascal_lower(pascal_upper(rank));
  return (SampleBits){bits_reverse(owen_reversed(x, hash_u32(h + 0x1b56c4e9u))),
                      bits_reverse(owen_reversed(y, hash_u32(h + 0x7feb352du)))};
}

static inline SampleBits sample_bits(const Sampler *s, uint32_t pair)
{
  return sample_bits_at(s, s->sample ? (uint32_t)__builtin_ctz(s->sample) : 31, pair);
}

// Fractions of 2^32 of one pair of many samplers. Nothing in it waits or branches, so that compilers work on as many at
// once as fit a register; where shifts by lanes of their own are not to be had (SSE), one by one.
typedef struct SamplerRows {
  uint32_t block_seed[SAMPLER_ROWS], pixel_seed[SAMPLER_ROWS], rank[SAMPLER_ROWS], sample[SAMPLER_ROWS];
  uint32_t zeros[SAMPLER_ROWS]; // below the lowest bit of sample, 31 of 0
} SamplerRows;

static inline void sampler_rows_set(SamplerRows *r, size_t i, const Sampler *s)
{
  r->block_seed[i] = s->block_seed;
  r->pixel_seed[i] = s->pixel_seed;
  r->rank[i] = s->rank;
  r->sample[i] = s->sample;
  r->zeros[i] = s->sample ? (uint32_t)__builtin_ctz(s->sample) : 31;
}

// The first `count` rows, rounded up to whole registers: rows past them must hold some sampler.
static inline void sample_rows(const SamplerRows *r, size_t count, uint32_t pair, uint32_t *restrict x,
                               uint32_t *restrict y)
{
  const size_t end = (count + 15) & ~(size_t)15;
  for (size_t i = 0; i < end; i++) {
    const Sampler s = {r->block_seed[i], r->pixel_seed[i], r->rank[i], r->sample[i]};
    const SampleBits b = sample_bits_at(&s, r->zeros[i], pair);
    x[i] = b.x;
    y[i] = b.y;
  }
}

// Two values in [0, 1), multiples of 2^-24.
static inline Vec2 sample_pair(const Sampler *s, uint32_t pair)
{
  const SampleBits b = sample_bits(s, pair);
  return (Vec2){unit_float(b.x), unit_float(b.y)};
}

#endif
