// Sah: where to split, decided by cost. A ray that meets a box meets a box inside it with the probability of their
// areas (Goldsmith and Salmon 1987; MacDonald and Booth 1990), so the best split has the least area times triangles
// on both sides. Tried at 16 places an axis instead of at every triangle (Wald 2007). The binary tree made here is
// what the rungs above turn into their own forms.

#ifndef BENCH_LADDER_SAH_H
#define BENCH_LADDER_SAH_H

#include "halves.h"

// Splits are chosen by cost down to SAH_DEPTH, by halves below, so that a tree of 2^28 triangles is no deeper than
// SAH_MOST_DEPTH, whatever they look like.
enum { SAH_DEPTH = 40, SAH_MOST_DEPTH = SAH_DEPTH + 28 };

typedef struct SahNode { // 32 bytes: a pair of them is a cache line
  Box box;
  uint32_t first; // of an inner node: its left child, the right one beside it; of a leaf: its first item
  uint32_t count; // items of a leaf; 0: an inner node
} SahNode;

typedef struct SahTree {
  SahNode *nodes; // the root is nodes[0]
  Item *items;    // in the order of the leaves
  uint32_t node_count, item_count;
} SahTree;

// Leaves of at most leaf_size items. False: no memory.
bool sah_build(const LadderMesh *m, uint32_t leaf_size, SahTree *out);
void sah_finish(SahTree *t); // accepts zero

#endif
