// Maps: the pictures inside a neural network, many channels a pixel. Sixteen channels lie side by side, so that
// whole registers are loaded and stored at every level; blocks of sixteen follow one another:
//
//   block 0:  row -1 (zeros)   row 0: [0] x 0, x 1, ... x w-1 [0]   ...   row h (zeros)
//   block 1:  the same for channels 16..31
//
// Each block has a border of one pixel of zeros, which is the padding of a 3x3 convolution. A kernel works on a run of
// pixels and may read past the end of a row (and throw away what it made of it): MAP_SLACK floats follow the last.

#ifndef RAYFOLD_POST_MAPS_H
#define RAYFOLD_POST_MAPS_H

#include <stddef.h>
#include <stdint.h>

enum { MAP_BLOCK = 16, MAP_SLACK = 40 * MAP_BLOCK };

typedef struct Map {
  float *data;       // pixel (0, 0) of block 0; not owned
  size_t row, block; // floats from one row, one block to the next
  uint32_t width, height, channels;
} Map;

static inline uint32_t map_blocks(uint32_t channels)
{
  return (channels + MAP_BLOCK - 1) / MAP_BLOCK;
}

static inline float *map_at(const Map *m, uint32_t block, ptrdiff_t x, ptrdiff_t y)
{
  return m->data + (ptrdiff_t)(block * m->block) + y * (ptrdiff_t)m->row + x * MAP_BLOCK;
}

#endif
