// Basics: what every rung needs and none is about: boxes, triangles, and a ray against one of each. The arithmetic is
// written once, and the wide rungs repeat it lane by lane, so that all rungs find the same t for the same triangle.

#ifndef BENCH_LADDER_BASICS_H
#define BENCH_LADDER_BASICS_H

#include "ladder.h"

#include <math.h>
#include <string.h>

typedef struct Box {
  float lo[3], hi[3];
} Box;

typedef struct Triangle { // a corner and two edges from it
  float v0[3], e1[3], e2[3];
} Triangle;

static inline float least(float a, float b)
{
  return a < b ? a : b;
} // one instruction; fminf is a call
static inline float most(float a, float b)
{
  return a > b ? a : b;
}

static inline Box box_empty(void)
{
  return (Box){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
}

// A place no ray comes by: for lanes and leaves that hold nothing. (The empty box is inside out, and the slab test
// below does not mind which side it meets first.)
static inline Box box_nowhere(void)
{
  return (Box){{1e30f, 1e30f, 1e30f}, {1e30f, 1e30f, 1e30f}};
}

static inline void box_add(Box *b, const Box *other)
{
  for (int k = 0; k < 3; k++) {
    b->lo[k] = least(b->lo[k], other->lo[k]);
    b->hi[k] = most(b->hi[k], other->hi[k]);
  }
}

static inline const float *mesh_corner(const LadderMesh *m, uint32_t triangle, int corner)
{
  return m->positions + 3 * (size_t)m->triangles[3 * (size_t)triangle + corner];
}

static inline Box mesh_box(const LadderMesh *m, uint32_t triangle)
{
  Box b = box_empty();
  for (int c = 0; c < 3; c++) {
    Box point;
    memcpy(point.lo, mesh_corner(m, triangle, c), sizeof point.lo);
    memcpy(point.hi, point.lo, sizeof point.hi);
    box_add(&b, &point);
  }
  return b;
}

static inline Triangle mesh_triangle(const LadderMesh *m, uint32_t triangle)
{
  const float *a = mesh_corner(m, triangle, 0), *b = mesh_corner(m, triangle, 1),
              *c = mesh_corner(m, triangle, 2);
  Triangle t;
  for (int k = 0; k < 3; k++) {
    t.v0[k] = a[k];
    t.e1[k] = b[k] - a[k];
    t.e2[k] = c[k] - a[k];
  }
  return t;
}

// --- rays ------------------------------------------------------------------------------------------
// Boxes are a little larger than they say, and hits a little farther when boxes are compared with them, so that
// rounding does not let a box hide a triangle that the list would have found.
#define SLACK (1 + 0x1p-20f)

typedef struct Walk { // a ray on its way, and the best hit so far
  float o[3], d[3], inv[3], tmin;
  LadderHit best;
} Walk;

static inline Walk walk_begin(const LadderRay *r)
{
  Walk w = {.tmin = r->tmin, .best = {r->tmax, LADDER_MISS}};
  for (int k = 0; k < 3; k++) {
    w.o[k] = r->o[k];
    w.d[k] = r->d[k];
    w.inv[k] = 1 / (fabsf(r->d[k]) < 1e-20f ? copysignf(1e-20f, r->d[k]) : r->d[k]); // no infinity times zero
  }
  return w;
}

// Where the ray enters the box; infinity when it misses it or enters behind the best hit. The slab test of Kay and
// Kajiya (1986).
static inline float walk_box(const Walk *w, const Box *b)
{
  float near = w->tmin, far = w->best.t * SLACK;
  for (int k = 0; k < 3; k++) {
    const float t0 = (b->lo[k] - w->o[k]) * w->inv[k], t1 = (b->hi[k] - w->o[k]) * w->inv[k];
    near = most(near, least(t0, t1));
    far = least(far, most(t0, t1) * SLACK);
  }
  return near <= far ? near : INFINITY;
}

static inline float dot3(const float a[3], const float b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void cross3(const float a[3], const float b[3], float out[3])
{
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}

// Takes the hit if it is better than the best. Of equal t the smallest number wins, so that order does not matter.
static inline void walk_take(Walk *w, float t, uint32_t prim)
{
  if (t < w->best.t || (t == w->best.t && prim < w->best.prim && w->best.prim != LADDER_MISS))
    w->best = (LadderHit){t, prim};
}

// Moeller and Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection", 1997; both sides count.
static inline void walk_triangle(Walk *w, const Triangle *tri, uint32_t prim)
{
  float p[3], s[3], q[3];
  cross3(w->d, tri->e2, p);
  const float inv = 1 / dot3(tri->e1, p);
  for (int k = 0; k < 3; k++) s[k] = w->o[k] - tri->v0[k];
  cross3(s, tri->e1, q);
  const float u = dot3(s, p) * inv, v = dot3(w->d, q) * inv, t = dot3(tri->e2, q) * inv;
  if (u >= 0 && v >= 0 && u + v <= 1 && t > w->tmin) walk_take(w, t, prim); // a NaN is none of these
}

#endif
