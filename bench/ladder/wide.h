// Wide: eight children a node instead of two. A node opens its largest children until it has eight (Wald, Benthin,
// Boulos 2008), so that the tree is a third as deep and eight boxes are one test.

#ifndef BENCH_LADDER_WIDE_H
#define BENCH_LADDER_WIDE_H

#include "lanes.h"
#include "sah.h"

// A walk takes one entry and puts back at most eight, and no binary tree is deeper than SAH_MOST_DEPTH.
enum { WIDE_STACK = 7 * SAH_MOST_DEPTH + 1 };

// The nodes of the binary tree that become the children of `node`, an inner one; how many.
int wide_children(const SahTree *sah, uint32_t node, uint32_t children[8]);

// How many wide nodes the tree takes.
uint32_t wide_count(const SahTree *sah);

typedef struct WideWalk { // a ray, its signs turned into the rows its planes are in: lo x y z, hi x y z
  Walk walk;
  int near_row[3], far_row[3];
} WideWalk;

static inline WideWalk wide_walk_begin(const LadderRay *r)
{
  WideWalk w = {.walk = walk_begin(r)};
  for (int k = 0; k < 3; k++) {
    const int is_backward = w.walk.inv[k] < 0;
    w.near_row[k] = is_backward ? 3 + k : k;
    w.far_row[k] = is_backward ? k : 3 + k;
  }
  return w;
}

typedef struct WideWaiting { // a child still to visit
  uint32_t child, count;     // as the rung means them
  float near;
} WideWaiting;

// Puts a child among those of its node, which begin at `bottom`, the nearest on top.
static inline int wide_push(WideWaiting *stack, int bottom, int height, WideWaiting e)
{
  int at = height;
  for (; at > bottom && stack[at - 1].near < e.near; at--) stack[at] = stack[at - 1];
  stack[at] = e;
  return height + 1;
}

#endif
