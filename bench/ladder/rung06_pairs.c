// Rung 6, two boxes together: a node keeps the boxes of its two children side by side, and one row of vector
// instructions tests both (pairs.h). The tree is that of the array, and the count of tests halves, because a pair is
// one test.

#include "halves.h"
#include "pairs.h"

#include <stdlib.h>

typedef struct PairTree {
  uint32_t leaf_count;
  Planes *pairs;   // of inner nodes 1 to leaf_count - 1
  uint32_t *first; // as in rung 5
  Triangle *triangles;
  uint32_t *prims;
} PairTree;

static void pairs_destroy(void *tree)
{
  PairTree *t = tree;
  if (!t) return;
  free(t->pairs);
  free(t->first);
  free(t->triangles);
  free(t->prims);
  free(t);
}

static uint32_t leaf_start(const PairTree *t, uint32_t i, uint32_t count)
{
  return (uint32_t)((uint64_t)i * count / t->leaf_count);
}

// Returns the node's own box.
static Box fill(PairTree *t, uint32_t node, Item *items, uint32_t leaf, uint32_t leaves, uint32_t count)
{
  const uint32_t first = leaf_start(t, leaf, count), end = leaf_start(t, leaf + leaves, count);
  if (leaves == 1) return end > first ? items[first].box : box_nowhere();
  const uint32_t middle = leaf_start(t, leaf + leaves / 2, count);
  if (end > first) items_halve(items + first, end - first, middle - first);
  const Box l = fill(t, 2 * node, items, leaf, leaves / 2, count);
  const Box r = fill(t, 2 * node + 1, items, leaf + leaves / 2, leaves / 2, count);
  planes_set(&t->pairs[node], 0, &l);
  planes_set(&t->pairs[node], 1, &r);
  return end > first ? items_box(items + first, end - first) : box_nowhere();
}

static void *pairs_build(const LadderMesh *m, size_t *bytes)
{
  const uint32_t n = m->triangle_count;
  uint32_t leaves = 2; // a pair at least
  while (leaves < n) leaves *= 2;
  Item *items = items_of(m);
  PairTree *t = malloc(sizeof *t);
  if (t)
    *t = (PairTree){.leaf_count = leaves,
                    .pairs = malloc(leaves * sizeof(Planes)),
                    .first = malloc(4 * ((size_t)leaves + 1)),
                    .triangles = malloc(n * sizeof(Triangle)),
                    .prims = malloc(4 * (size_t)n)};
  if (!t || !items || !t->pairs || !t->first || !t->triangles || !t->prims) {
    free(items);
    pairs_destroy(t);
    return NULL;
  }
  fill(t, 1, items, 0, leaves, n);
  for (uint32_t i = 0; i <= leaves; i++) t->first[i] = leaf_start(t, i, n);
  for (uint32_t i = 0; i < n; i++) {
    t->triangles[i] = mesh_triangle(m, items[i].prim);
    t->prims[i] = items[i].prim;
  }
  free(items);
  *bytes = leaves * sizeof(Planes) + 4 * ((size_t)leaves + 1) + n * (sizeof(Triangle) + 4);
  return t;
}

typedef struct Waiting {
  uint32_t node;
  float near;
} Waiting;

static void pairs_walk(const PairTree *t, Walk *w, LadderCounts *c)
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
    const PairHit hit = planes_test(&t->pairs[e.node], w);
    const Waiting l = {2 * e.node, hit.left}, r = {2 * e.node + 1, hit.right};
    c->boxes++;
    if (hit.bits == 3) {
      const bool left_first = l.near <= r.near;
      stack[height++] = left_first ? r : l;
      stack[height++] = left_first ? l : r;
    } else if (hit.bits) {
      stack[height++] = hit.bits == 1 ? l : r;
    }
  }
}

static void pairs_closest(const void *tree, const LadderRay *rays, LadderHit *hits, size_t count,
                          LadderCounts *c)
{
  for (size_t r = 0; r < count; r++) {
    Walk w = walk_begin(&rays[r]);
    pairs_walk(tree, &w, c);
    hits[r] = w.best;
  }
}

const Rung rung_pairs = {"two boxes together",
                         "One row of vector instructions for both children.",
                         true,
                         pairs_build,
                         pairs_closest,
                         pairs_destroy};
