// Rung 5, the tree as an array: node n has its children at 2n and 2n + 1, so no pointer is stored and none is followed;
// where a node lies is arithmetic (a heap's order, Williams 1964). The price is that the tree must be whole: as many
// leaves as the next power of two. Triangles lie in the order of the leaves.

#include "halves.h"

#include <stdlib.h>

typedef struct ArrayTree {
  uint32_t leaf_count; // a power of two; leaf i is node leaf_count + i
  Box *boxes;          // of nodes 1 to 2 * leaf_count - 1
  uint32_t *first;     // leaf i holds triangles first[i] to first[i + 1] - 1: one or none
  Triangle *triangles;
  uint32_t *prims;
} ArrayTree;

static void array_destroy(void *tree)
{
  ArrayTree *t = tree;
  if (!t) return;
  free(t->boxes);
  free(t->first);
  free(t->triangles);
  free(t->prims);
  free(t);
}

// Leaf i begins at triangle i * count / leaf_count: halving the leaves halves the triangles.
static uint32_t leaf_start(const ArrayTree *t, uint32_t i, uint32_t count)
{
  return (uint32_t)((uint64_t)i * count / t->leaf_count);
}

static void fill(ArrayTree *t, uint32_t node, Item *items, uint32_t leaf, uint32_t leaves, uint32_t count)
{
  const uint32_t first = leaf_start(t, leaf, count), end = leaf_start(t, leaf + leaves, count);
  t->boxes[node] = end > first ? items_box(items + first, end - first) : box_nowhere();
  if (leaves == 1) return;
  const uint32_t middle = leaf_start(t, leaf + leaves / 2, count);
  if (end > first) items_halve(items + first, end - first, middle - first);
  fill(t, 2 * node, items, leaf, leaves / 2, count);
  fill(t, 2 * node + 1, items, leaf + leaves / 2, leaves / 2, count);
}

static void *array_build(const LadderMesh *m, size_t *bytes)
{
  const uint32_t n = m->triangle_count;
  uint32_t leaves = 1;
  while (leaves < n) leaves *= 2;
  Item *items = items_of(m);
  ArrayTree *t = malloc(sizeof *t);
  if (t)
    *t = (ArrayTree){leaves, malloc(2 * leaves * sizeof(Box)), malloc(4 * ((size_t)leaves + 1)),
                     malloc(n * sizeof(Triangle)), malloc(4 * (size_t)n)};
  if (!t || !items || !t->boxes || !t->first || !t->triangles || !t->prims) {
    free(items);
    array_destroy(t);
    return NULL;
  }
  fill(t, 1, items, 0, leaves, n);
  for (uint32_t i = 0; i <= leaves; i++) t->first[i] = leaf_start(t, i, n);
  for (uint32_t i = 0; i < n; i++) {
    t->triangles[i] = mesh_triangle(m, items[i].prim);
    t->prims[i] = items[i].prim;
  }
  free(items);
  *bytes = 2 * leaves * sizeof(Box) + 4 * ((size_t)leaves + 1) + n * (sizeof(Triangle) + 4);
  return t;
}

typedef struct Waiting {
  uint32_t node;
  float near;
} Waiting;

static void array_walk(const ArrayTree *t, Walk *w, LadderCounts *c)
{
  Waiting stack[64];
  int height = 0;
  stack[height++] = (Waiting){1, w->tmin};
  while (height > 0) {
    const Waiting e = stack[--height];
    if (e.near > w->best.t * SLACK) continue;
    if (e.node >= t->leaf_count) {
      const uint32_t leaf = e.node - t->leaf_count;
      for (uint32_t i = t->first[leaf]; i < t->first[leaf + 1]; i++) {
        c->triangles++;
        walk_triangle(w, &t->triangles[i], t->prims[i]);
      }
      continue;
    }
    const uint32_t left = 2 * e.node;
    const Waiting l = {left, walk_box(w, &t->boxes[left])}, r = {left + 1, walk_box(w, &t->boxes[left + 1])};
    c->boxes += 2;
    const bool left_first = l.near <= r.near;
    const Waiting far = left_first ? r : l, near = left_first ? l : r;
    if (far.near < INFINITY) stack[height++] = far;
    if (near.near < INFINITY) stack[height++] = near;
  }
}

static void array_closest(const void *tree, const LadderRay *rays, LadderHit *hits, size_t count,
                          LadderCounts *c)
{
  for (size_t r = 0; r < count; r++) {
    Walk w = walk_begin(&rays[r]);
    array_walk(tree, &w, c);
    hits[r] = w.best;
  }
}

const Rung rung_array = {
    "tree as an array", "No pointers: children of n are 2n and 2n + 1.", true, array_build, array_closest,
    array_destroy};
