// Tree: the layout of both levels in memory, for builders and for hot code.
//
//   Node8 (256 bytes)  | lo x[8] | hi x[8] | lo y[8] | hi y[8] | lo z[8] | hi z[8] | child[8] | count[8] | cost | ... |
//                        box rows of eight children, one lane each                             leaf sizes
//
// A child is a node's index, or LEAF_BIT and what the leaf holds: a Tri8 block in a mesh's tree, an instance in the
// upper one. Lanes not used have lo = +inf, hi = -inf, which no ray enters. A parent's box of a child is the exact
// union of what lies below it, so that boxes are nested without a gap. A triangle of a refitted tree that nothing can
// hit any more keeps its lane, with NaN for vertices; a box with no others below is empty.
//
// A compact tree has a CompactNode for each Node8 and a CompactLeaf for each block, with the same child codes, and
// leaves the vertices where the mesh has them. accel/compact.h turns one into the other. Leaves with the corners'
// indices, too, made trees of 21 bytes a triangle instead of 7 and 1.1 to 1.4 times as fast; nodes of 128 bytes,
// each two whole lines, 8 bytes and at most 1.06 times.
//
//   CompactNode (96)   | origin xyz | exponents, count | x lo[8] hi[8] | y lo[8] hi[8] | z lo[8] hi[8] | child[8] |
//   CompactLeaf (32)   | prim[8] |
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
  float cost;       // tests a ray that enters may expect, when built; 0: as the boxes say now (accel/refit.h)
  uint8_t spare[20];
} Node8;
_Static_assert(sizeof(Node8) == 256, "four cache lines");

// A plane of child i along axis k is at origin[k] + 2^(exponent[k] - 127) * plane[k][i], its upper one at i + 8; the
// power is a float's bits, its exponent at least 1. Children fill lanes from 0 on.
typedef struct CompactNode {
  float origin[3];
  uint8_t exponent[3];
  uint8_t count; // children
  uint8_t plane[3][16];
  uint32_t child[8];
} CompactNode;
_Static_assert(sizeof(CompactNode) == 96, "two of them in three cache lines, and none in more than two");

typedef struct CompactLeaf {
  uint32_t prim[8]; // triangles of the mesh; NO_HIT in lanes not used, never the first
} CompactLeaf;

struct MeshTree {
  atomic_int users;
  TreeLayout layout;
  TreeQuality quality; // it was built with
  uint32_t root; // child code
  SharedFile *file; // a use of the saved model that the arrays lie in, not to be written to; NULL: they are owned
  // Of TREE_FLOAT, else NULL. Each block has at least one triangle, though perhaps not to be hit.
  Node8 *nodes;
  Tri8 *blocks;
  // Of TREE_COMPACT, else NULL; and the mesh's own arrays, which the tree's caller keeps.
  CompactNode *compact_nodes;
  CompactLeaf *compact_leaves;
  const float *positions;
  const uint32_t *triangles;
  size_t node_count, block_count, triangle_count;
  Bounds bounds;
  bool has_pieces; // triangles may be in several leaves, each under the box of its piece: see build_spatial.c
};

struct Accel {
  uint32_t root;
  Node8 *nodes;        // owned
  Instance *instances; // owned unless borrowed, each holding a use of its mesh
  float (*boxes)[6];   // likewise: the instances' boxes in the world; empty for those that nothing can hit
  bool is_borrowed;    // both are another Accel's
  uint32_t *endless;   // owned: instances that have no ends and are not in the tree; NULL: there are none
  size_t node_count, instance_count, endless_count;
  Bounds bounds;       // of those in the tree
};

#endif
