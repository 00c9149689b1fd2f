// Kernels: what the cold side of post asks of the code that is compiled once per instruction set. The table is part of
// that unit's; one call is some rows of a picture.

#ifndef RAYFOLD_POST_KERNELS_H
#define RAYFOLD_POST_KERNELS_H

#include "post/guided.h"
#include "post/maps.h"

#include <stdbool.h>

// A 3x3 convolution with zero padding, bias and ReLU. The inputs' channels follow one another, as if they were one
// map. With is_up the first input is of half the size and stands for its nearest-neighbour enlargement.
typedef struct Conv {
  Map in[2];
  int in_count;
  bool is_up;
  bool pools; // out is of half the size and gets the largest of each 2x2 pixels
  Map out;
  // weights: [phase, if is_up][block of out][input][its blocks][tap row][tap column][channel in][16 out]. The enlarged
  // input has 2x2 taps, others 3x3 (pack_layer() in unet.c).
  const float *weights, *bias;
  size_t phase_size, block_size; // floats of weights from one phase, one block of out to the next
  uint32_t width, height;        // before pooling
} Conv;

// One pass of the wavelet filter over planes of `stride` floats a row, with a border as wide as the step all around in
// which no pixel is like any other. Rows are computed to a multiple of 16 pixels.
typedef struct Atrous {
  const float *in[4]; // luminance, red, blue, and the variance of luminance
  float *out[4];
  const float *normal[3], *depth;
  const float *depth_scale; // 1 / (metres of depth that one pixel may be off)
  size_t stride, origin;    // origin: of pixel (0, 0)
  uint32_t width;
  int step;
} Atrous;

// The planes of the fast denoiser (denoise_fast.h), with the passes' border. The passes go from a to b and back.
typedef struct FastPlanes {
  const Guided *guided;
  float *a[4], *b[4], *normal[3], *depth, *depth_scale;
  size_t stride, origin;
} FastPlanes;

typedef struct PostKernels {
  // Rows 2 * pair and 2 * pair + 1 (before pooling). scratch: conv_scratch() floats if it pools.
  void (*conv_rows)(const Conv *c, uint32_t pair, float *scratch);
  void (*atrous_rows)(const Atrous *a, uint32_t first, uint32_t end); // rows [first, end)
  // Of the fast denoiser, in this order (fast_rows.h): all rows, the border, all rows, passes, all rows.
  void (*fast_take_rows)(const FastPlanes *f, uint32_t first, uint32_t end);
  void (*fast_extend_rows)(const FastPlanes *f);
  void (*fast_prepare_rows)(const FastPlanes *f, uint32_t first, uint32_t end);
  void (*fast_give_rows)(const FastPlanes *f, float *const light[3], float *out, uint32_t first, uint32_t end);
} PostKernels;

// Floats that a pooling convolution needs to keep two rows in.
static inline size_t conv_scratch(uint32_t width, uint32_t channels)
{
  return (size_t)map_blocks(channels) * 2 * width * MAP_BLOCK;
}

#endif
