// Tree: the layout of both levels in memory, for builders and for hot code.
//
//   Node8 (256 bytes)  | lo x[8] | hi x[8] | lo y[8] | hi y[8] | lo z[8] | hi z[8] | child[8] | count[8] |  ...  |
//                        box rows of eight children, one lane each                             leaf sizes  spare
//
// A child is a node's index, or LEAF_BIT and what the leaf holds: a Tri8 block in a mesh's tree, an instance in the
// upper one. Lanes not used have lo = +inf, hi = -inf, which no ray enters. A parent's box of a child is the exact
// union of what lies below it, so that boxes are nested without a gap.
//
// Depth: a builder makes splits of any shape down to MOST_SAH_DEPTH levels of nodes; below, it halves the largest
// range seven times a node, so n references become at most ceil(n / 8) a child, and 2^31 of them are single after
// 11 more levels. A walk that takes one entry and puts back at most eight grows by seven a level and so never holds
// more than 7 * (24 + 11) + 1 = 246 entries.

#ifndef RAYFOLD_ACCEL_TREE_H
#define RAYFOLD_ACCEL_TREE_H

#include "accel/accel.h"
#include "base/file.h"
#include "geom/triangle.h"

#include <stdatomic.h>

enum { MOST_SAH_DEPTH = 24, MOST_DEPTH = MOST_SAH_DEPTH + 11, STACK_SIZE = 256 };
_Static_assert(7 * MOST_DEPTH + 1 <= STACK_SIZE, "no walk may outgrow its stack");

#define LEAF_BIT   0x80000000u
#define EMPTY_TREE UINT32_MAX // as a root: nothing to hit

typedef struct Node8 {
  float box[6][8];
  uint32_t child[8];
  uint8_t count[8]; // of a leaf: its primitives; of a node: 0
  uint8_t spare[24];
} Node8;
_Static_assert(sizeof(Node8) == 256, "four cache lines");

struct MeshTree {
  atomic_int users;
  uint32_t root; // child code
  SharedFile *file; // a use of the saved model that the arrays lie in, not to be written to; NULL: they are owned
  Node8 *nodes;
  Tri8 *blocks;  // each has at least one triangle
  size_t node_count, block_count, triangle_count;
  Bounds bounds;
};

struct Accel {
  uint32_t root;
  Node8 *nodes;        // owned
  Instance *instances; // owned, each holding a use of its mesh
  float (*boxes)[6];   // owned: the instances' boxes in the world; empty for those that nothing can hit
  size_t node_count, instance_count;
  Bounds bounds;
};

#endif
