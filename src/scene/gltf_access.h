// Accessors: the numbers in a glTF file's buffers. Opening one checks that every element lies inside its bytes; the
// reads after that cannot fail but for memory.

#ifndef RAYFOLD_SCENE_GLTF_ACCESS_H
#define RAYFOLD_SCENE_GLTF_ACCESS_H

#include "scene/gltf.h"

// Component types by their number in the file.
typedef enum GltfType {
  GLTF_I8 = 5120,
  GLTF_U8 = 5121,
  GLTF_I16 = 5122,
  GLTF_U16 = 5123,
  GLTF_U32 = 5125,
  GLTF_F32 = 5126,
} GltfType;

typedef struct Accessor {
  size_t index; // in the file, for messages
  size_t count; // elements
  int width;    // components an element: 1 to 4, or 16
  GltfType type;
  bool normalized;
  const uint8_t *data;                           // the first element; NULL: all zeros
  size_t stride;                                 // bytes from one element to the next
  size_t sparse_count;                           // elements replaced by others
  GltfType sparse_type;                          // of their indices
  const uint8_t *sparse_indices, *sparse_values; // both without gaps
} Accessor;

// Accessors without a buffer view are all zeros, so nothing bounds their count but this.
enum { GLTF_MOST_ZEROS = 1 << 20 };

// Opens accessors[dict[key]]. Absent: *is_given false (and true returned).
bool accessor_open(Gltf *g, const Json *dict, const char *key, bool *is_given, Accessor *out);

// Elements first to first + count as floats, `width` each, integers normalised if the accessor says so. Missing
// components become 1 (alpha), surplus ones are left out. In range by the caller.
void accessor_floats(const Accessor *a, size_t first, size_t count, int width, float *out);

// All elements of an unsigned integer accessor of width 1.
void accessor_indices(const Accessor *a, uint32_t *out);

#endif
