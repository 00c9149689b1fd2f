// Rung 9, eight wide and compact: the planes of the children as 8-bit steps inside the node's own box (Mahovsky 2005;
// Ylitie, Karras, Laine 2017), children found by counting on from the first, and triangles without empty lanes. Little
// more than half the memory of rung 8, for some work to unpack, boxes up to a step too large, and triangles tested one
// by one: a trade of speed for room.

#include "wide.h"

#include <stdlib.h>

typedef struct CompactNode { // 96 bytes
  float origin[3], step[3];
  uint8_t rows[6][8]; // lo x y z, hi x y z: plane = origin + step * this
  uint32_t first_node, first_prim;
  uint8_t offset[8]; // from first_node or first_prim
  uint8_t count[8];  // of a leaf its triangles; 0: a node; NONE: nothing
} CompactNode;
_Static_assert(sizeof(CompactNode) == 96, "one and a half cache lines");

enum { NONE = 255 };

typedef struct CompactTree {
  CompactNode *nodes;  // node 0 has the root as its only child
  Triangle *triangles; // in the order of the leaves
  uint32_t *prims;
  uint32_t node_count;
} CompactTree;

static void compact_destroy(void *tree)
{
  CompactTree *t = tree;
  if (!t) return;
  free(t->nodes);
  free(t->triangles);
  free(t->prims);
  free(t);
}

// The plane as the walk will compute it, to the bit: that the steps are rounded outwards is checked with it.
static inline float plane_of(float origin, float step, int at)
{
  return origin + step * (float)at;
}

static void set_axis(CompactNode *n, int axis, const Box *boxes, int count)
{
  float lo = INFINITY, hi = -INFINITY;
  for (int i = 0; i < count; i++) {
    lo = least(lo, boxes[i].lo[axis]);
    hi = most(hi, boxes[i].hi[axis]);
  }
  float step = most((hi - lo) / 255, 1e-30f);
  while (plane_of(lo, step, 255) < hi) step *= 1.0001f; // the last step reaches the end, whatever was rounded
  n->origin[axis] = lo;
  n->step[axis] = step;
  for (int i = 0; i < 8; i++) {
    int first = 255, last = 0; // of a lane without a child
    if (i < count) {
      first = (int)((boxes[i].lo[axis] - lo) / step);
      last = (int)((boxes[i].hi[axis] - lo) / step);
      first = first > 255 ? 255 : first;
      while (first > 0 && plane_of(lo, step, first) > boxes[i].lo[axis]) first--;
      while (last < 255 && plane_of(lo, step, last) < boxes[i].hi[axis]) last++;
    }
    n->rows[axis][i] = (uint8_t)first;
    n->rows[3 + axis][i] = (uint8_t)(last > 255 ? 255 : last);
  }
}

// A node's inner children lie beside each other, and so do the triangles of its leaves.
static void emit(CompactTree *t, const SahTree *sah, uint32_t at, const uint32_t *children, int count,
                 uint32_t *prims)
{
  CompactNode *n = &t->nodes[at];
  Box boxes[8];
  uint32_t inner = 0;
  memset(n, 0, sizeof *n);
  memset(n->count, NONE, sizeof n->count);
  n->first_node = t->node_count;
  n->first_prim = *prims;
  for (int i = 0; i < count; i++) {
    const SahNode *child = &sah->nodes[children[i]];
    boxes[i] = child->box;
    n->count[i] = (uint8_t)child->count;
    n->offset[i] = (uint8_t)(child->count ? *prims - n->first_prim : inner++);
    for (uint32_t k = 0; k < child->count; k++) t->prims[(*prims)++] = sah->items[child->first + k].prim;
  }
  for (int k = 0; k < 3; k++) set_axis(n, k, boxes, count);
  t->node_count += inner;
  const uint32_t first_node = n->first_node;
  for (int i = 0, k = 0; i < count; i++) {
    if (sah->nodes[children[i]].count) continue;
    uint32_t below[8];
    const int below_count = wide_children(sah, children[i], below);
    emit(t, sah, first_node + (uint32_t)k++, below, below_count, prims);
  }
}

static void *compact_build(const LadderMesh *m, size_t *bytes)
{
  SahTree sah;
  if (!sah_build(m, 4, &sah)) return NULL;
  const uint32_t nodes = wide_count(&sah) + 1;
  CompactTree *t = calloc(1, sizeof *t);
  if (t) {
    t->nodes = aligned_alloc(32, nodes * sizeof(CompactNode));
    t->triangles = malloc(m->triangle_count * sizeof(Triangle));
    t->prims = malloc(4 * (size_t)m->triangle_count);
  }
  if (t && t->nodes && t->triangles && t->prims) {
    const uint32_t root = 0;
    uint32_t prims = 0;
    t->node_count = 1;
    emit(t, &sah, 0, &root, 1, &prims);
    for (uint32_t i = 0; i < prims; i++) t->triangles[i] = mesh_triangle(m, t->prims[i]);
  } else {
    compact_destroy(t);
    t = NULL;
  }
  sah_finish(&sah);
  *bytes = nodes * sizeof(CompactNode) + m->triangle_count * (sizeof(Triangle) + 4);
  return t;
}

static inline v8 planes_unpack(const CompactNode *n, int row, int axis)
{
  return v8_all(n->origin[axis]) + v8_all(n->step[axis]) * v8_of_bytes(n->rows[row]);
}

static inline unsigned compact_test(const CompactNode *n, const WideWalk *w, float near[8])
{
  v8 in = v8_all(w->walk.tmin), out = v8_all(w->walk.best.t * SLACK);
  for (int k = 0; k < 3; k++) {
    const v8 o = v8_all(w->walk.o[k]), inv = v8_all(w->walk.inv[k]);
    in = v8_max(in, (planes_unpack(n, w->near_row[k], k) - o) * inv);
    out = v8_min(out, (planes_unpack(n, w->far_row[k], k) - o) * inv * v8_all(SLACK));
  }
  memcpy(near, &in, sizeof in);
  return i8_bits(in <= out);
}

static void compact_walk(const CompactTree *t, WideWalk *w, LadderCounts *c)
{
  WideWaiting stack[WIDE_STACK + 7];
  int height = 0;
  stack[height++] = (WideWaiting){.child = 0, .near = w->walk.tmin};
  while (height > 0) {
    const WideWaiting e = stack[--height];
    if (e.near > w->walk.best.t * SLACK) continue;
    if (e.count) {
      c->triangles += e.count;
      for (uint32_t i = e.child; i < e.child + e.count; i++)
        walk_triangle(&w->walk, &t->triangles[i], t->prims[i]);
      continue;
    }
    const CompactNode *n = &t->nodes[e.child];
    float near[8];
    const int bottom = height;
    c->boxes++;
    for (unsigned bits = compact_test(n, w, near); bits; bits &= bits - 1) {
      const int i = __builtin_ctz(bits);
      if (n->count[i] == NONE)
        continue; // a box of no size, from so far away that it is not seen to be inside out
      const uint32_t first = n->count[i] ? n->first_prim : n->first_node;
      const WideWaiting child = {first + n->offset[i], n->count[i], near[i]};
      height = wide_push(stack, bottom, height, child);
    }
  }
}

static void compact_closest(const void *tree, const LadderRay *rays, LadderHit *hits, size_t count,
                            LadderCounts *c)
{
  for (size_t r = 0; r < count; r++) {
    WideWalk w = wide_walk_begin(&rays[r]);
    compact_walk(tree, &w, c);
    hits[r] = w.walk.best;
  }
}

const Rung rung_compact = {"8 wide, compact",
                           "Planes as bytes: little more than half the memory.",
                           true,
                           compact_build,
                           compact_closest,
                           compact_destroy};
