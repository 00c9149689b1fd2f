// Grids: densities in three dimensions, and the door to their files. What comes out is finite and not negative.
//
// Our own format, `.grid`: lines of text, then the values, little-endian, x fastest, then y, then z:
//
//   rayfold-grid 1
//   size 64 32 64
//   box -1 0 -1  1 1 1        corners in metres; may be left out: the longest side is 1 m, centred
//   data float32              or uint8, where 255 stands for 1
//   <values>                  directly behind the line's end
//
// `.nvdb` (NanoVDB) where PNanoVDB.h was there to build with.

#ifndef RAYFOLD_IMAGE_GRID_H
#define RAYFOLD_IMAGE_GRID_H

#include "base/err.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct Grid {
  uint32_t size[3];
  float lo[3], hi[3]; // metres
  float *values;      // owned (mem_alloc)
} Grid;               // zero is none

enum { GRID_MOST_SIDE = 4096 };

// Refuses what does not fit into the machine's memory before anything is allocated.
bool grid_read(Grid *out, const char *path, Err *err);
void grid_finish(Grid *g); // accepts zero

// For readers of formats: allocates the values of out->size, or says how much they would need.
bool grid_allocate(Grid *out, const char *path, Err *err);
// The first value that is negative or not finite is refused, with its place.
bool grid_check(const Grid *g, const char *path, Err *err);

bool grid_read_nvdb(Grid *out, const uint8_t *data, size_t size, const char *path, Err *err);

#endif
