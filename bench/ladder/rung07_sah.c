// Rung 7, a flat binary tree split by cost: the pairs of rung 6 with the splits of sah.h. Now nodes must say where
// their children are, sixteen bytes more a pair, which makes it exactly one cache line; and leaves hold a few triangles.

#include "pairs.h"
#include "sah.h"

#include <stdlib.h>

typedef struct SahPair {
  Planes planes;
  uint32_t first[2], count[2]; // of each child: its pair and 0, or its first triangle and how many
} SahPair;
_Static_assert(sizeof(SahPair) == 64, "a cache line");

typedef struct Flat {
  SahPair *pairs;
  Triangle *triangles; // in the order of the leaves
  uint32_t *prims;
} Flat;

static void flat_destroy(void *tree)
{
  Flat *t = tree;
  if (!t) return;
  free(t->pairs);
  free(t->triangles);
  free(t->prims);
  free(t);
}

static void set_child(SahPair *p, int side, const SahNode *n)
{
  planes_set(&p->planes, side, &n->box);
  p->count[side] = n->count;
  p->first[side] = n->count ? n->first : (n->first + 1) / 2; // nodes 1 and 2 are pair 1, 3 and 4 pair 2, ...
}

// Pair 0 is the root, and beside it nothing.
static void set_root(SahPair *p, const SahTree *sah)
{
  const SahNode nothing = {.box = box_nowhere(), .count = 1};
  set_child(p, 0, &sah->nodes[0]);
  set_child(p, 1, &nothing);
}

static void *flat_build(const LadderMesh *m, size_t *bytes)
{
  SahTree sah;
  if (!sah_build(m, 4, &sah)) return NULL;
  const uint32_t pairs = (sah.node_count + 1) / 2, n = m->triangle_count;
  Flat *t = malloc(sizeof *t);
  if (t)
    *t = (Flat){aligned_alloc(64, pairs * sizeof(SahPair)), malloc(n * sizeof(Triangle)),
                malloc(4 * (size_t)n)};
  if (t && t->pairs && t->triangles && t->prims) {
    set_root(&t->pairs[0], &sah);
    for (uint32_t i = 1; i < sah.node_count; i++)
      set_child(&t->pairs[(i + 1) / 2], (i + 1) % 2, &sah.nodes[i]);
    for (uint32_t i = 0; i < n; i++) {
      t->triangles[i] = mesh_triangle(m, sah.items[i].prim);
      t->prims[i] = sah.items[i].prim;
    }
  } else {
    flat_destroy(t);
    t = NULL;
  }
  sah_finish(&sah);
  *bytes = pairs * sizeof(SahPair) + n * (sizeof(Triangle) + 4);
  return t;
}

typedef struct Waiting {
  uint32_t first, count;
  float near;
} Waiting;

static void flat_walk(const Flat *t, Walk *w, LadderCounts *c)
{
  Waiting stack[SAH_MOST_DEPTH + 2];
  int height = 0;
  stack[height++] = (Waiting){0, 0, w->tmin};
  while (height > 0) {
    const Waiting e = stack[--height];
    if (e.near > w->best.t * SLACK) continue;
    if (e.count) {
      c->triangles += e.count;
      for (uint32_t i = e.first; i < e.first + e.count; i++) walk_triangle(w, &t->triangles[i], t->prims[i]);
      continue;
    }
    const SahPair *p = &t->pairs[e.first];
    const PairHit hit = planes_test(&p->planes, w);
    const Waiting l = {p->first[0], p->count[0], hit.left}, r = {p->first[1], p->count[1], hit.right};
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

static void flat_closest(const void *tree, const LadderRay *rays, LadderHit *hits, size_t count,
                         LadderCounts *c)
{
  for (size_t r = 0; r < count; r++) {
    Walk w = walk_begin(&rays[r]);
    flat_walk(tree, &w, c);
    hits[r] = w.best;
  }
}

const Rung rung_sah = {"flat binary, by cost",
                       "Splits where a ray is likely to need only one side.",
                       true,
                       flat_build,
                       flat_closest,
                       flat_destroy};
