// Rung 8, eight wide: a node is eight boxes in rows, one vector instruction for eight of anything, and a leaf is four
// triangles in lanes. Planes are picked by the signs of the ray's direction, so that no least and most of each pair of
// planes is needed. This is the form today's tracers have (Embree, 2014, and ours).

#include "wide.h"

#include <stdlib.h>

typedef struct WideNode { // 224 bytes
  float rows[6][8];       // lo x y z, hi x y z of eight children; a lane without a child is inside out
  uint32_t child[8];      // a node, or LEAF and a block
} WideNode;

#define LEAF 0x80000000u

typedef struct Block { // four triangles, 160 bytes; a lane without one has no area
  float v0[3][4], e1[3][4], e2[3][4];
  uint32_t prim[4];
} Block;

typedef struct WideTree {
  WideNode *nodes;
  Block *blocks;
  uint32_t root, node_count, block_count;
} WideTree;

static void wide_destroy(void *tree)
{
  WideTree *t = tree;
  if (!t) return;
  free(t->nodes);
  free(t->blocks);
  free(t);
}

static uint32_t emit_block(WideTree *t, const LadderMesh *m, const Item *items, uint32_t count)
{
  Block *b = &t->blocks[t->block_count];
  memset(b, 0, sizeof *b);
  for (uint32_t i = 0; i < count; i++) {
    const Triangle tri = mesh_triangle(m, items[i].prim);
    b->prim[i] = items[i].prim;
    for (int k = 0; k < 3; k++) {
      b->v0[k][i] = tri.v0[k];
      b->e1[k][i] = tri.e1[k];
      b->e2[k][i] = tri.e2[k];
    }
  }
  return LEAF | t->block_count++;
}

static uint32_t emit(WideTree *t, const LadderMesh *m, const SahTree *sah, uint32_t node)
{
  const SahNode *n = &sah->nodes[node];
  if (n->count) return emit_block(t, m, sah->items + n->first, n->count);
  uint32_t children[8];
  const int count = wide_children(sah, node, children);
  const uint32_t at = t->node_count++;
  WideNode *w = &t->nodes[at];
  for (int i = 0; i < 8; i++) {
    const Box box = i < count ? sah->nodes[children[i]].box : box_empty();
    for (int k = 0; k < 3; k++) {
      w->rows[k][i] = box.lo[k];
      w->rows[3 + k][i] = box.hi[k];
    }
    w->child[i] = i < count ? emit(t, m, sah, children[i]) : 0;
  }
  return at;
}

static void *wide_build(const LadderMesh *m, size_t *bytes)
{
  SahTree sah;
  if (!sah_build(m, 4, &sah)) return NULL;
  const uint32_t nodes = wide_count(&sah), leaves = (sah.node_count + 1) / 2;
  WideTree *t = calloc(1, sizeof *t);
  if (t) {
    t->nodes = aligned_alloc(32, (nodes + 1) * sizeof(WideNode));
    t->blocks = aligned_alloc(32, leaves * sizeof(Block));
  }
  if (t && t->nodes && t->blocks) {
    t->root = emit(t, m, &sah, 0);
  } else {
    wide_destroy(t);
    t = NULL;
  }
  sah_finish(&sah);
  *bytes = nodes * sizeof(WideNode) + leaves * sizeof(Block);
  return t;
}

static inline unsigned wide_test(const WideNode *n, const WideWalk *w, float near[8])
{
  v8 in = v8_all(w->walk.tmin), out = v8_all(w->walk.best.t * SLACK);
  for (int k = 0; k < 3; k++) {
    const v8 o = v8_all(w->walk.o[k]), inv = v8_all(w->walk.inv[k]);
    in = v8_max(in, (v8_load(n->rows[w->near_row[k]]) - o) * inv);
    out = v8_min(out, (v8_load(n->rows[w->far_row[k]]) - o) * inv * v8_all(SLACK));
  }
  memcpy(near, &in, sizeof in);
  return i8_bits(in <= out);
}

static inline v4 v4_dot(const v4 a[3], const v4 b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void v4_cross(const v4 a[3], const v4 b[3], v4 out[3])
{
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}

// walk_triangle() for four at once.
static inline void block_test(const Block *b, Walk *w)
{
  v4 d[3], e1[3], e2[3], s[3], p[3], q[3];
  for (int k = 0; k < 3; k++) {
    d[k] = v4_all(w->d[k]);
    e1[k] = v4_load(b->e1[k]);
    e2[k] = v4_load(b->e2[k]);
    s[k] = v4_all(w->o[k]) - v4_load(b->v0[k]);
  }
  v4_cross(d, e2, p);
  v4_cross(s, e1, q);
  const v4 inv = v4_all(1) / v4_dot(e1, p);
  const v4 u = v4_dot(s, p) * inv, v = v4_dot(d, q) * inv, t = v4_dot(e2, q) * inv, zero = v4_all(0);
  unsigned bits = i4_bits((u >= zero) & (v >= zero) & (u + v <= v4_all(1)) & (t > v4_all(w->tmin)) &
                          (t <= v4_all(w->best.t)));
  for (; bits; bits &= bits - 1) {
    const int i = __builtin_ctz(bits);
    walk_take(w, t[i], b->prim[i]);
  }
}

static void wide_walk(const WideTree *t, WideWalk *w, LadderCounts *c)
{
  WideWaiting stack[WIDE_STACK];
  int height = 0;
  stack[height++] = (WideWaiting){.child = t->root, .near = w->walk.tmin};
  while (height > 0) {
    const WideWaiting e = stack[--height];
    if (e.near > w->walk.best.t * SLACK) continue;
    if (e.child & LEAF) {
      c->triangles++;
      block_test(&t->blocks[e.child & ~LEAF], &w->walk);
      continue;
    }
    const WideNode *n = &t->nodes[e.child];
    float near[8];
    const int bottom = height;
    c->boxes++;
    for (unsigned bits = wide_test(n, w, near); bits; bits &= bits - 1) {
      const int i = __builtin_ctz(bits);
      height = wide_push(stack, bottom, height, (WideWaiting){.child = n->child[i], .near = near[i]});
    }
  }
}

static void wide_closest(const void *tree, const LadderRay *rays, LadderHit *hits, size_t count,
                         LadderCounts *c)
{
  for (size_t r = 0; r < count; r++) {
    WideWalk w = wide_walk_begin(&rays[r]);
    wide_walk(tree, &w, c);
    hits[r] = w.walk.best;
  }
}

const Rung rung_wide = {"8 wide",     "Eight boxes a test, four triangles a test, a third of the depth.",
                        true,         wide_build,
                        wide_closest, wide_destroy};
