// Rung 10, packets: sixteen rays walk the tree of rung 7 together (Wald et al. 2001), one in each lane. A node or
// triangle is read once for all of them, and a box is entered when any of them meets it. Neighbouring camera rays go
// the same way nearly all the time; rays that go their own ways drag each other through everything any of them needs.

#include "lanes.h"
#include "sah.h"

#include <stdlib.h>

enum { GROUPS = 2, PACKET = 8 * GROUPS };

typedef struct PacketTree {
  SahTree sah;         // without its items
  Triangle *triangles; // in the order of the leaves
  uint32_t *prims;
} PacketTree;

static void packets_destroy(void *tree)
{
  PacketTree *t = tree;
  if (!t) return;
  sah_finish(&t->sah);
  free(t->triangles);
  free(t->prims);
  free(t);
}

static void *packets_build(const LadderMesh *m, size_t *bytes)
{
  const uint32_t n = m->triangle_count;
  PacketTree *t = calloc(1, sizeof *t);
  if (t) {
    t->triangles = malloc(n * sizeof(Triangle));
    t->prims = malloc(4 * (size_t)n);
  }
  if (!t || !t->triangles || !t->prims || !sah_build(m, 4, &t->sah)) {
    packets_destroy(t);
    return NULL;
  }
  for (uint32_t i = 0; i < n; i++) {
    t->triangles[i] = mesh_triangle(m, t->sah.items[i].prim);
    t->prims[i] = t->sah.items[i].prim;
  }
  free(t->sah.items);
  t->sah.items = NULL;
  *bytes = t->sah.node_count * sizeof(SahNode) + n * (sizeof(Triangle) + 4);
  return t;
}

typedef struct Packet { // eight rays a group, one a lane
  v8 o[3][GROUPS], d[3][GROUPS], inv[3][GROUPS], tmin[GROUPS], best_t[GROUPS];
  i8 best_prim[GROUPS];
} Packet;

static Packet packet_begin(const LadderRay *rays, size_t count)
{
  Packet p;
  for (int i = 0; i < PACKET; i++) {
    const Walk w =
        walk_begin(&rays[(size_t)i < count ? (size_t)i : count - 1]); // the last ray fills what is left
    const int g = i / 8, lane = i % 8;
    for (int k = 0; k < 3; k++) {
      p.o[k][g][lane] = w.o[k];
      p.d[k][g][lane] = w.d[k];
      p.inv[k][g][lane] = w.inv[k];
    }
    p.tmin[g][lane] = w.tmin;
    p.best_t[g][lane] = w.best.t;
    p.best_prim[g][lane] = -1;
  }
  return p;
}

// Does any ray meet the box? walk_box() for all of them.
static inline bool packet_box(const Packet *p, const Box *b)
{
  for (int g = 0; g < GROUPS; g++) {
    v8 in = p->tmin[g], out = p->best_t[g] * v8_all(SLACK);
    for (int k = 0; k < 3; k++) {
      const v8 t0 = (v8_all(b->lo[k]) - p->o[k][g]) * p->inv[k][g],
               t1 = (v8_all(b->hi[k]) - p->o[k][g]) * p->inv[k][g];
      in = v8_max(in, v8_min(t0, t1));
      out = v8_min(out, v8_max(t0, t1) * v8_all(SLACK));
    }
    if (i8_bits(in <= out)) return true;
  }
  return false;
}

static inline v8 v8_dot(const v8 a[3], const v8 b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void v8_cross(const v8 a[3], const v8 b[3], v8 out[3])
{
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}

// walk_triangle() for all of them.
static inline void packet_triangle(Packet *packet, const Triangle *tri, uint32_t prim)
{
  v8 e1[3], e2[3];
  for (int k = 0; k < 3; k++) {
    e1[k] = v8_all(tri->e1[k]);
    e2[k] = v8_all(tri->e2[k]);
  }
  for (int g = 0; g < GROUPS; g++) {
    v8 d[3], s[3], p[3], q[3];
    for (int k = 0; k < 3; k++) {
      d[k] = packet->d[k][g];
      s[k] = packet->o[k][g] - v8_all(tri->v0[k]);
    }
    v8_cross(d, e2, p);
    v8_cross(s, e1, q);
    const v8 inv = v8_all(1) / v8_dot(e1, p);
    const v8 u = v8_dot(s, p) * inv, v = v8_dot(d, q) * inv, t = v8_dot(e2, q) * inv, zero = v8_all(0);
    const i8 number = (i8){0} + (int32_t)prim, best = packet->best_prim[g];
    const i8 better =
        (t < packet->best_t[g]) | ((t == packet->best_t[g]) & (number < best)); // best -1: nothing yet
    const i8 takes = (u >= zero) & (v >= zero) & (u + v <= v8_all(1)) & (t > packet->tmin[g]) & better;
    packet->best_t[g] = v8_choose(takes, t, packet->best_t[g]);
    packet->best_prim[g] = (takes & number) | (~takes & best);
  }
}

// Which child the first ray comes to first, by the way it goes between their middles: good for all when they agree.
static inline bool right_first(const Packet *p, const SahNode *children)
{
  float way = 0;
  for (int k = 0; k < 3; k++) {
    const Box *l = &children[0].box, *r = &children[1].box;
    way += p->d[k][0][0] * (r->lo[k] + r->hi[k] - l->lo[k] - l->hi[k]);
  }
  return way < 0;
}

static void packet_walk(const PacketTree *t, Packet *p, LadderCounts *c)
{
  uint32_t stack[SAH_MOST_DEPTH + 2];
  int height = 0;
  stack[height++] = 0;
  while (height > 0) {
    const SahNode *n = &t->sah.nodes[stack[--height]];
    c->boxes++;
    if (!packet_box(p, &n->box)) continue;
    if (n->count) {
      c->triangles += n->count;
      for (uint32_t i = n->first; i < n->first + n->count; i++)
        packet_triangle(p, &t->triangles[i], t->prims[i]);
      continue;
    }
    const uint32_t right = right_first(p, &t->sah.nodes[n->first]);
    stack[height++] = n->first + 1 - right;
    stack[height++] = n->first + right;
  }
}

static void packets_closest(const void *tree, const LadderRay *rays, LadderHit *hits, size_t count,
                            LadderCounts *c)
{
  for (size_t r = 0; r < count; r += PACKET) {
    const size_t n = count - r < PACKET ? count - r : PACKET;
    Packet p = packet_begin(rays + r, n);
    packet_walk(tree, &p, c);
    for (size_t i = 0; i < n; i++)
      hits[r + i] = (LadderHit){p.best_t[i / 8][i % 8], (uint32_t)p.best_prim[i / 8][i % 8]};
  }
}

const Rung rung_packets = {"packets of 16",
                           "Neighbouring rays share every read and every test.",
                           true,
                           packets_build,
                           packets_closest,
                           packets_destroy};
