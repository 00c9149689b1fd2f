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

// Written into files: a number once given keeps its meaning. Compact trees are not saved: they are made for little
// memory, and are quickly built.
typedef enum SavedLayout { SAVED_NODE8_TRI8 = 1 } SavedLayout;     // Node8 and Tri8 as of tree.h
typedef enum SavedQuality { SAVED_FAST = 1, SAVED_BEST } SavedQuality; // which builder made it

typedef struct TreeHead {
  uint32_t layout;  // SavedLayout
  uint32_t quality; // SavedQuality
  uint32_t root;    // child code
  uint32_t has_pieces; // 0 or 1
  uint64_t node_count, block_count, triangle_count;
  float lo[3], hi[3]; // bounds
} TreeHead;
_Static_assert(sizeof(TreeHead) == 64, "a cache line, without gaps");

// The arrays of a tree of floats and its head, filled in by this call; all valid as long as tree and head are.
SavedTree mesh_tree_save(const MeshTree *t, TreeHead *head);

// False for none, for one of a layout or builder that this program does not know, and for one that is not what is
// wanted (one of more quality is): build a new one.
bool saved_tree_suits(const SavedTree *saved, TreeOptions wanted);

// The tree in these bytes of file, of which it takes a use, for a mesh of so many triangles. jobs may be NULL. NULL
// when it is not sound (ERR_BAD_SCENE), or on no memory.
MeshTree *mesh_tree_open(const SavedTree *saved, size_t mesh_triangle_count, SharedFile *file, Jobs *jobs,
                         Err *err);

#endif
