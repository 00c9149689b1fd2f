// Tza: the container in which Open Image Denoise's trained networks come, version 2. Little-endian: a header of 12
// bytes (0x41d7, major, minor version, offset of the table), tensors, and the table: a count, then for each tensor its
// name, dimensions, layout, data type ('f' or 'h': 32 or 16 bits) and offset. Everything is checked before it is
// believed.

#ifndef RAYFOLD_POST_TZA_H
#define RAYFOLD_POST_TZA_H

#include "base/err.h"

#include <stddef.h>
#include <stdint.h>

enum { TZA_MOST_TENSORS = 256, TZA_MOST_DIMS = 4 };

typedef struct TzaTensor {
  const char *name; // in the file's bytes, not terminated
  size_t name_length;
  uint32_t dims, size[TZA_MOST_DIMS]; // outermost first; [out, in, height, width] of a convolution
  bool is_half;
  const uint8_t *data; // in the file's bytes
  size_t count;        // of numbers
} TzaTensor;

typedef struct Tza {
  TzaTensor tensors[TZA_MOST_TENSORS];
  size_t count;
} Tza;

// Points into bytes, which must outlive it.
bool tza_read(Tza *out, const uint8_t *bytes, size_t size, Err *err);
const TzaTensor *tza_find(const Tza *t, const char *name); // NULL: not there
float tza_value(const TzaTensor *t, size_t i);

#endif
