// Halves: the simplest way to a balanced tree, shared by the rungs that are about layout and not about where to
// split: cut the triangles into two equal halves across the longest side of their box, and so on.

#ifndef BENCH_LADDER_HALVES_H
#define BENCH_LADDER_HALVES_H

#include "basics.h"

typedef struct Item {
  Box box;
  uint32_t prim;
} Item;

// One item a triangle, in the mesh's order; free() them. NULL: no memory.
Item *items_of(const LadderMesh *m);

Box items_box(const Item *items, uint32_t count);

// Moves the `left` items whose middles come first along the longest side of their box to the front.
void items_halve(Item *items, uint32_t count, uint32_t left);

#endif
