// Span: bytes that belong to someone else. SavedTree: the arrays of a mesh's tree as they lie in a saved model, for
// rooms that hand them on; accel/saved_tree.h knows what is in them.

#ifndef RAYFOLD_BASE_SPAN_H
#define RAYFOLD_BASE_SPAN_H

#include <stddef.h>

typedef struct Span {
  const void *data; // 64-byte aligned
  size_t size;      // in bytes; 0: nothing
} Span;

typedef struct SavedTree {
  Span head, nodes, leaves;
} SavedTree;

#endif
