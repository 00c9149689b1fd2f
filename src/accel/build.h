// Build: turns boxes into an eight-wide tree by binned surface-area splits (Wald, "On fast construction of SAH-based
// bounding volume hierarchies", 2007; the wide nodes as Wald, Benthin, Boulos, "Getting rid of packets", 2008: the
// child of largest area is split until there are eight). Knows neither triangles nor instances: the caller fills the
// references and says what a leaf becomes.
//
//   split (top by all threads together, then subtrees side by side) -> counts known -> caller allocates -> emit
//
// The tree depends on the references alone: work is cut at fixed sizes, never by the number of threads.

#ifndef RAYFOLD_ACCEL_BUILD_H
#define RAYFOLD_ACCEL_BUILD_H

#include "accel/tree.h"

// A box to be put in the tree. lo[3] holds the bits of the primitive's number.
typedef Bounds BuildRef;

typedef struct Build {
  BuildRef *refs, *spare; // owned; spare (for splits by many threads) only when count is large
  size_t count;
  uint32_t leaf_size; // most primitives in a leaf, at most 8
  Jobs *jobs;
  const Cancel *cancel;
  Bounds bounds;                 // of everything
  size_t node_count, leaf_count; // after build_split
  struct BuildTop *top;          // private
} Build;

// Room for so many references; the caller then fills refs[0..count), and may lower count. False: no memory.
bool build_init(Build *b, size_t count, Err *err);
bool build_split(Build *b, Err *err); // reorders refs; false: no memory or cancelled
void build_finish(Build *b);          // accepts zero

// Makes the leaf with number leaf_i out of its references and returns the child code without LEAF_BIT. Called for
// each leaf once, from several threads.
typedef uint32_t LeafEmit(void *user, size_t leaf_i, const BuildRef *refs, uint32_t count);

// Writes node_count nodes; returns the root's child code. EMPTY_TREE when there is nothing.
uint32_t build_emit(Build *b, Node8 *nodes, LeafEmit *emit, void *user);

static inline void ref_set_prim(BuildRef *r, uint32_t prim) { memcpy((char *)&r->lo + 12, &prim, 4); }

static inline uint32_t ref_prim(const BuildRef *r)
{
  uint32_t prim;
  memcpy(&prim, (const char *)&r->lo + 12, 4);
  return prim;
}

#endif
