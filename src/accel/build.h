// Build: turns boxes into an eight-wide tree. Knows neither triangles nor instances: the caller fills the references
// and says what a leaf becomes.
//
//   references -> split: a binary tree, by the surface-area heuristic     build.c, build_bins.h, build_small.c
//                 or one in which references may be cut in pieces         build_spatial.c
//                 and nodes have moved to where they cost least           build_reinsert.c
//              -> collapse: which binary nodes become wide ones, by cost  build_wide.c
//              -> counts known, caller allocates -> emit                  build_wide.c
//
// The tree depends on the references alone: work is cut at sizes that depend on their number, never by the number of
// threads, and whatever threads do side by side is put together in a fixed order.

#ifndef RAYFOLD_ACCEL_BUILD_H
#define RAYFOLD_ACCEL_BUILD_H

#include "accel/tree.h"

// A box to be put in the tree. lo[3] holds the bits of the primitive's number.
typedef Bounds BuildRef;

// The box of what of a primitive lies between two planes across an axis. Must be wide enough that every hit on the
// primitive is in the box of a piece whichever way it is cut, see TRI_SLACK. May be empty.
typedef Bounds RefClip(const void *user, uint32_t prim, int axis, float lo, float hi);

typedef struct Build {
  BuildRef *refs; // owned; gone after build_split
  size_t count;   // of primitives
  size_t room;    // for references, pieces included
  RefClip *clip;  // NULL: nothing is cut in pieces
  const void *clip_user;
  bool has_pieces; // after build_split: something was
  uint32_t leaf_size; // most primitives in a leaf: 1, 2, 4 or 8
  Jobs *jobs;
  const Cancel *cancel;
  Bounds bounds;                 // of everything
  size_t node_count, leaf_count; // after build_split
  struct BuildTop *top;          // private
} Build;

// Room for so many primitives; the caller then fills refs[0..count), and may lower count. False: no memory.
bool build_init(Build *b, size_t count, Err *err);
bool build_split(Build *b, Err *err); // false: no memory or cancelled
void build_finish(Build *b);          // accepts zero

// Makes the leaf with number leaf_i of these primitives. Called for each leaf once, from several threads. Returns the
// child code without LEAF_BIT.
typedef uint32_t LeafEmit(void *user, size_t leaf_i, const uint32_t *prims, uint32_t count);

// Writes node_count nodes; returns the root's child code. EMPTY_TREE when there is nothing.
uint32_t build_emit(Build *b, Node8 *nodes, LeafEmit *emit, void *user);

static inline BuildRef ref_of(const Bounds *box, uint32_t prim)
{
  BuildRef r = *box;
  r.hi[3] = 0;
  memcpy((char *)&r.lo + 12, &prim, 4);
  return r;
}

static inline uint32_t ref_prim(const BuildRef *r)
{
  uint32_t prim;
  memcpy(&prim, (const char *)&r->lo + 12, 4);
  return prim;
}

#endif
