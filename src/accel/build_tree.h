// The binary tree between splitting and collapsing, as the files build*.c share it. Not for anyone else.
//
// It is kept in pieces: the nodes above (BuildTop), and one piece for each subtree that one thread built alone. A piece
// is an array in which a node's two children are neighbours and come after it.

#ifndef RAYFOLD_ACCEL_BUILD_TREE_H
#define RAYFOLD_ACCEL_BUILD_TREE_H

#include "accel/build.h"
#include "base/array.h"
#include "base/mem.h"

// Splits of any shape are made down to MOST_SPLIT_DEPTH levels of binary nodes, then ranges are halved. A range of up
// to SMALL references may add SMALL - 1 levels, one of 2^31 halved 31. See build_wide.c for what that means in levels
// of wide nodes.
enum { SMALL = 32, MOST_SPLIT_DEPTH = 72, MOST_BINARY_DEPTH = MOST_SPLIT_DEPTH + 31 };

typedef struct BinaryNode {
  float lo[3];
  uint32_t link; // inner: its left child in the piece; leaf: its first primitive in BuildTop.prims; or a subtree
  float hi[3];
  uint32_t bits; // NODE_ bits, and what build_wide.c decides
} BinaryNode;
_Static_assert(sizeof(BinaryNode) == 32, "two siblings a cache line");

// The lowest four bits hold the number of primitives below if that is at most 8, and 0 if it is more.
enum { NODE_COUNT = 15, NODE_INNER = 16, NODE_SUBTREE = 32 };

typedef ARRAY(BinaryNode) BinaryTree;

typedef struct Subtree {
  BinaryTree tree;
  float cost[8]; // of its root, by build_wide.c
} Subtree;

typedef struct BuildTop {
  BinaryTree tree; // its leaves have NODE_SUBTREE
  ARRAY(Subtree) subtrees;
  uint32_t *prims;        // owned: the primitives in the order of the leaves
  struct WideTop *wide;   // of build_wide.c
} BuildTop;

static inline void node_set_box(BinaryNode *n, const Bounds *box)
{
  v3_store(n->lo, box->lo);
  v3_store(n->hi, box->hi);
}

static inline void node_set_leaf(BinaryNode *n, uint32_t first, uint32_t count)
{
  n->link = first;
  n->bits = count;
}

static inline void node_fill_leaf(const Build *b, BinaryNode *n, uint32_t first, uint32_t count)
{
  node_set_leaf(n, first, count);
  for (uint32_t i = 0; i < count; i++) b->top->prims[first + i] = ref_prim(&b->refs[first + i]);
}

// What a worker needs for one subtree after another: room for references, and rows of cost. It only grows.
typedef struct Room {
  BuildRef *spare;   // owned
  float (*cost)[8];  // owned
  size_t spare_count, cost_count;
} Room; // zero is none

static inline bool room_reserve(Room *r, size_t spare_count, size_t cost_count)
{
  if (r->spare_count < spare_count) {
    mem_free(r->spare);
    r->spare = mem_alloc(spare_count, sizeof *r->spare);
    r->spare_count = r->spare ? spare_count : 0;
  }
  if (r->cost_count < cost_count) {
    mem_free(r->cost);
    r->cost = mem_alloc(cost_count, sizeof *r->cost);
    r->cost_count = r->cost ? cost_count : 0;
  }
  return r->spare_count >= spare_count && r->cost_count >= cost_count;
}

static inline void room_finish(Room *r)
{
  mem_free(r->spare);
  mem_free(r->cost);
}

// Adds two nodes, both children of the parent; returns the number of the first. UINT32_MAX: no memory.
static inline uint32_t tree_add_pair(BinaryTree *t, uint32_t parent, uint32_t prim_count)
{
  if (!array_reserve(t, t->count + 2)) return UINT32_MAX;
  const uint32_t first = (uint32_t)t->count;
  t->count += 2;
  t->items[parent].link = first;
  t->items[parent].bits = NODE_INNER | (prim_count <= 8 ? prim_count : 0);
  return first;
}

// build_small.c: makes the subtree of refs[first .. first + count), at most SMALL of them, below `node`, whose box is
// set, and writes their primitives. False: no memory.
bool small_split(const Build *b, BinaryTree *t, uint32_t node, uint32_t first, uint32_t count);

// build_spatial.c: as many references as fit in the room that so many primitives are given, and all of the splitting
// when primitives may be cut. False: no memory, or cancelled.
size_t spatial_room(size_t prim_count);
bool spatial_split(Build *b);

// build_reinsert.c: makes a subtree cheaper by moving nodes about in it; its ref_count primitives, which lie from first
// on, change their order. Leaves it as it is when it would grow deeper than most_depth. False: no memory.
bool tree_reinsert(const Build *b, BinaryTree *t, int most_depth, uint32_t first, uint32_t ref_count);

// build_wide.c. Decides for one piece what becomes of it; cost has room for a row a node.
void wide_collapse(const Build *b, BinaryTree *t, float (*cost)[8], bool by_depth);
// The nodes above the subtrees, then the numbering of everything. False: no memory.
bool wide_plan(Build *b);
void wide_finish(struct WideTop *w); // accepts NULL

#endif
