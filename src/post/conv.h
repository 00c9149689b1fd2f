// Convolution: 3x3, direct. A tile of neighbouring pixels by one or two blocks of output channels is kept in registers
// while all input channels pass by: one load of weights serves all pixels of the tile, one input value all channels.
//
// An enlarged input is never made. Where rows and columns repeat, an output pixel of a given parity sees only 2x2
// different input pixels, so the nine weights are added up to four beforehand: 4/9 of the work, the same result up to
// rounding (the sub-pixel view of Shi et al. 2016, "Real-Time Single Image and Video Super-Resolution", section 3).
//
// Sums are fused where the processor can (v3, v4), as three quarters of a denoiser's time is spent here. So the levels
// with and without agree to rounding only; tests/test_unet.c bounds it. Everything else is in a fixed order.

#ifndef RAYFOLD_POST_CONV_H
#define RAYFOLD_POST_CONV_H

#include "base/wide.h"
#include "post/kernels.h"

// By registers: 24 of 32 hold sums at v4, 12 of 16 at v3 and v2.
enum {
  CONV_PARTS = MAP_BLOCK / WIDEST, // registers to a block of channels
  CONV_BLOCKS = WIDEST == 16 ? 2 : 1,
  CONV_PIXELS = WIDEST == 16  ? 12
                : WIDEST == 8 ? 6
                : WIDEST == 4 ? 3
                              : 1,
  CONV_MOST = CONV_BLOCKS * CONV_PARTS,
};

typedef struct ConvTile {
  uint32_t x, y;   // first pixel of an input of full size
  uint32_t block;  // first of out
  uint32_t px, py; // parity of an enlarged input's pixels
} ConvTile;

typedef wx ConvSums[CONV_MOST][CONV_PIXELS];

#define CONV_INLINE static inline __attribute__((always_inline))

// Adds one tap of up to 16 channels. step: floats from one pixel of the tile to the next in the input.
CONV_INLINE void conv_tap(ConvSums sums, const int blocks, const int step, const float *in,
                          const float *weights, size_t block_size, uint32_t channels)
{
  for (uint32_t c = 0; c < channels; c++, weights += MAP_BLOCK) {
    wx w[CONV_MOST];
#pragma GCC unroll 16
    for (int b = 0; b < blocks * CONV_PARTS; b++)
      w[b] = wx_load(weights + (size_t)(b / CONV_PARTS) * block_size + b % CONV_PARTS * WIDEST);
#pragma GCC unroll 16
    for (int p = 0; p < CONV_PIXELS; p++) {
      const wx x = wx_set(in[p * step + (int)c]);
#pragma GCC unroll 16
      for (int b = 0; b < blocks * CONV_PARTS; b++) sums[b][p] = wx_fma(x, w[b], sums[b][p]);
    }
  }
}

// All taps of one input, taps x taps of them from pixel (x, y) on. Returns the weights of the next.
CONV_INLINE const float *conv_input(ConvSums sums, const int blocks, const int step, const int taps,
                                    const Map *in, ptrdiff_t x, ptrdiff_t y, const float *weights,
                                    size_t block_size)
{
  for (uint32_t b = 0; b * MAP_BLOCK < in->channels; b++) {
    const uint32_t left = in->channels - b * MAP_BLOCK, channels = left < MAP_BLOCK ? left : MAP_BLOCK;
    for (int ty = 0; ty < taps; ty++)
      for (int tx = 0; tx < taps; tx++, weights += channels * MAP_BLOCK)
        conv_tap(sums, blocks, step, map_at(in, b, x + tx, y + ty), weights, block_size, channels);
  }
  return weights;
}

// One tile into out, `step` floats from pixel to pixel; the first `count` pixels of it are stored.
CONV_INLINE void conv_tile(const Conv *c, const ConvTile *t, const int blocks, const bool is_up, float *out,
                           size_t out_block, uint32_t count)
{
  const int step = is_up ? 2 * MAP_BLOCK : MAP_BLOCK;
  const float *weights = c->weights + (t->py * 2 + t->px) * c->phase_size + t->block * c->block_size;
  ConvSums sums;
#pragma GCC unroll 16
  for (int b = 0; b < blocks * CONV_PARTS; b++) {
    const wx bias = wx_load(c->bias + t->block * MAP_BLOCK + b * WIDEST);
#pragma GCC unroll 16
    for (int p = 0; p < CONV_PIXELS; p++) sums[b][p] = bias;
  }
  int first = 0;
  if (is_up) {
    const ptrdiff_t x = (ptrdiff_t)(t->x / 2 + t->px) - 1, y = (ptrdiff_t)(t->y / 2 + t->py) - 1;
    weights = conv_input(sums, blocks, MAP_BLOCK, 2, &c->in[0], x, y, weights, c->block_size);
    first = 1;
  }
  for (int i = first; i < c->in_count; i++)
    weights = conv_input(sums, blocks, step, 3, &c->in[i], (ptrdiff_t)t->x - 1, (ptrdiff_t)t->y - 1, weights,
                         c->block_size);
  const wx zero = wx_set(0);
#pragma GCC unroll 16
  for (int p = 0; p < CONV_PIXELS; p++) {
    if ((uint32_t)p >= count) break;
#pragma GCC unroll 16
    for (int b = 0; b < blocks * CONV_PARTS; b++) // of NaN, the maximum is zero
      wx_store(out + (size_t)(b / CONV_PARTS) * out_block + p * step + b % CONV_PARTS * WIDEST,
               wx_max(sums[b][p], zero));
  }
}

// The pixels of one parity (all, if not is_up) of row y, all channels.
CONV_INLINE void conv_row_of(const Conv *c, uint32_t y, uint32_t px, const bool is_up, float *out,
                             size_t out_block)
{
  const uint32_t stride = is_up ? 2 : 1, pixels = c->width / stride, blocks = map_blocks(c->out.channels);
  for (uint32_t i = 0; i < pixels; i += CONV_PIXELS) {
    ConvTile t = {.x = i * stride + px, .y = y, .px = px, .py = is_up ? y & 1 : 0};
    const uint32_t count = pixels - i < CONV_PIXELS ? pixels - i : CONV_PIXELS;
    for (; t.block + CONV_BLOCKS <= blocks; t.block += CONV_BLOCKS)
      conv_tile(c, &t, CONV_BLOCKS, is_up, out + t.block * out_block + t.x * MAP_BLOCK, out_block, count);
    if (CONV_BLOCKS > 1 && t.block < blocks)
      conv_tile(c, &t, 1, is_up, out + t.block * out_block + t.x * MAP_BLOCK, out_block, count);
  }
}

static void conv_row(const Conv *c, uint32_t y, float *out, size_t out_block)
{
  if (c->is_up) {
    conv_row_of(c, y, 0, true, out, out_block);
    conv_row_of(c, y, 1, true, out, out_block);
  } else
    conv_row_of(c, y, 0, false, out, out_block);
}

// The largest of each 2x2 pixels of two rows.
static void conv_pool(const float *upper, const float *lower, float *out, uint32_t pixels)
{
  for (uint32_t x = 0; x < pixels; x++)
    for (int k = 0; k < MAP_BLOCK; k += WIDEST) {
      const float *a = upper + 2 * x * MAP_BLOCK + k, *b = lower + 2 * x * MAP_BLOCK + k;
      const wx high = wx_max(wx_load(a), wx_load(a + MAP_BLOCK));
      wx_store(out + x * MAP_BLOCK + k, wx_max(high, wx_max(wx_load(b), wx_load(b + MAP_BLOCK))));
    }
}

static void conv_rows(const Conv *c, uint32_t pair, float *scratch)
{
  const size_t row = (size_t)c->width * MAP_BLOCK;
  for (uint32_t r = 0; r < 2; r++) {
    const uint32_t y = 2 * pair + r;
    if (y >= c->height) break;
    if (c->pools)
      conv_row(c, y, scratch + r * row, 2 * row);
    else
      conv_row(c, y, map_at(&c->out, 0, 0, y), c->out.block);
  }
  if (!c->pools) return;
  for (uint32_t b = 0; b < map_blocks(c->out.channels); b++)
    conv_pool(scratch + b * 2 * row, scratch + b * 2 * row + row, map_at(&c->out, b, 0, pair), c->width / 2);
}

#endif
