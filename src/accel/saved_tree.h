// Saved trees: a MeshTree as the bytes of a saved model, and back without a copy. The arrays lie in the file as in
// memory (tree.h), so opening one costs a look at each node and leaf and nothing else.
//
//   head   TreeHead
//   nodes  Node8[node_count]    a node's number is greater than its parent's
//   leaves Tri8[block_count]
//
// Walks trust a tree completely, and a file may come from anyone: what mesh_tree_open() hands out can be walked by any
// ray without leaving the arrays, growing past the stack or going round in circles. It does not check that boxes
// hold what lies below them, nor that leaves hold the mesh's own triangles: a wrong one gives wrong pictures, no worse.

#ifndef RAYFOLD_ACCEL_SAVED_TREE_H
#define RAYFOLD_ACCEL_SAVED_TREE_H

#include "accel/accel.h"
#include "base/file.h"
#include "base/span.h"

#include <stdint.h>

// Written into files: a number once given keeps its meaning.
typedef enum TreeLayout { TREE_NODE8_TRI8 = 1 } TreeLayout; // Node8 and Tri8 as of tree.h
typedef enum TreeQuality { TREE_FAST = 1 } TreeQuality;     // which builder made it

typedef struct TreeHead {
  uint32_t layout;  // TreeLayout
  uint32_t quality; // TreeQuality
  uint32_t root;    // child code
  uint32_t spare;
  uint64_t node_count, block_count, triangle_count;
  float lo[3], hi[3]; // bounds
} TreeHead;
_Static_assert(sizeof(TreeHead) == 64, "a cache line, without gaps");

// The tree's arrays and its head, filled in by this call; all valid as long as tree and head are.
SavedTree mesh_tree_save(const MeshTree *t, TreeHead *head);

// False for none, and for one of a layout or builder that this program does not know: build a new one.
bool saved_tree_is_known(const SavedTree *saved);

// The tree in these bytes of file, of which it takes a use, for a mesh of so many triangles. jobs may be NULL. NULL
// when it is not sound (ERR_BAD_SCENE), or on no memory.
MeshTree *mesh_tree_open(const SavedTree *saved, size_t mesh_triangle_count, SharedFile *file, Jobs *jobs,
                         Err *err);

#endif
