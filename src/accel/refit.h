// Refit: a mesh's next tree out of its last one, when the same triangles have moved. Trees are shared between worlds
// and may be read by others at the time, so the old one is never written to.
//
//   old tree + positions -> refit: same nodes and blocks, new vertices and boxes, from below    mesh_refit.c
//                        -> judge: what does a ray pay in each part, and what when it was built?     "
//                        -> insert: where do triangles go that had no area?                    mesh_insert.c
//                        -> graft: worn parts are built anew, the rest is kept                  mesh_graft.c
//
// The judgement. A ray that enters a node tests its box row, and below it what boxes it meets: the sum of areas over
// the node's own (the surface-area heuristic). This cost does not change when a part is moved or scaled, only when
// things that were apart come to overlap. Node8.cost keeps what it was when a builder made the part; where it is 0 the
// old tree still is what the builder made, and its boxes say. From below, a part is worn when it costs `most_wear`
// times as much, its own worn parts already counted as mended: so what is built anew is no more than what is at fault.
//
// The answer depends on the old tree and the positions alone, not on threads.

#ifndef RAYFOLD_ACCEL_REFIT_H
#define RAYFOLD_ACCEL_REFIT_H

#include "accel/mesh_input.h"
#include "base/array.h"

// Of a hall, a terrain and a sphere, twisted by 45 and 180 degrees, crumpled, and waving, this rebuilds at most 19 % of
// the triangles where a plain refit costs rays up to 1.11 times the steps of a build, and all where it costs more. 1.2
// rebuilds up to 43 % in the first cases and gains 2 %; 1.7 leaves trees of 1.5 times the steps.
#define MOST_WEAR 1.4f

typedef struct NodeState { // of a node of the new tree
  Bounds box;        // of all below
  double area;       // of box
  double cost;       // areas of all boxes below and its own, worn parts counted as if mended
  double built_cost; // the same of the old tree, where that is as built
  uint32_t lanes;    // of blocks below
  bool is_worn, has_worn; // it, or a part below
} NodeState;

typedef struct Newcomer { // a triangle that had no lane and now can be hit
  uint32_t node;          // the worn part it goes to
  uint32_t prim;
  Bounds box;
} Newcomer;

typedef struct Refit {
  const MeshTree *old;
  MeshArrays mesh;
  Jobs *jobs;
  const Cancel *cancel;
  float most_wear;        // MOST_WEAR; INFINITY: nothing is built anew
  size_t rebuilt_count;   // result: triangles that were
  MeshTree *tree;         // being made
  NodeState *states;      // owned; one a node
  atomic_uchar *is_found; // owned; one a triangle of the mesh: the tree has it
  size_t found_count;
  ARRAY(Newcomer) newcomers; // by node
  atomic_bool is_foreign; // the tree has triangles that the mesh has not
} Refit;

// The next tree. NULL on no memory or cancel.
MeshTree *refit_run(Refit *r, Err *err);

// Finds the triangles that the tree lacks, and a part for each, which counts as worn. *is_hopeless: as below.
bool refit_insert(Refit *r, bool *is_hopeless, Err *err);

// Builds the worn parts of r->tree anew and replaces it by a tree with them. *is_hopeless: it must be built as a whole.
bool refit_graft(Refit *r, bool *is_hopeless, Err *err);

#endif
