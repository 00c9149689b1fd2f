// Tri8: eight triangles and the test of one ray against them. Watertight: the ray is sheared to the z axis and each
// edge function is antisymmetric bit by bit in its two vertices, so neighbours never both reject a ray through their
// shared edge (Woop, Benthin, Wald, "Watertight Ray/Triangle Intersection", JCGT 2013). Both sides are hit. Rests on
// a * b - c * d not being contracted to a fused multiply-add.

#ifndef RAYFOLD_GEOM_TRIANGLE_H
#define RAYFOLD_GEOM_TRIANGLE_H

#include "geom/tree_ray.h"

// A vertex this much farther than tmin is beyond it without a doubt, whatever rounding did to either.
#define AHEAD_SLACK (1 + 0x1p-20f)

typedef struct Tri8 {
  float v[3][3][8]; // vertex, axis, lane; NaN in lanes not used, which nothing hits
  uint32_t prim[8]; // triangle of the mesh; NO_HIT in lanes not used
} Tri8;
_Static_assert(sizeof(Tri8) == 320, "five cache lines");

// What the wide test leaves behind: distances and edge functions, valid in lanes of the returned bits.
typedef struct Tri8Hits {
  float t[8], e[3][8];
} Tri8Hits;

// The paper's fallback: an edge function that is exactly zero may be so by rounding, and is done again in double,
// where the products are exact.
static inline float exact_edge(float a, float b, float c, float d)
{
  return (float)((double)a * b - (double)c * d);
}

static inline void tri8_exact_edges(Tri8Hits *h, int i, const float x[3][8], const float y[3][8])
{
  h->e[0][i] = exact_edge(x[2][i], y[1][i], y[2][i], x[1][i]);
  h->e[1][i] = exact_edge(x[0][i], y[2][i], y[0][i], x[2][i]);
  h->e[2][i] = exact_edge(x[1][i], y[0][i], y[1][i], x[0][i]);
}

// Lanes with tmin < t <= tmax, before the own box of each is asked.
static inline unsigned tri8_hit(const Tri8 *b, const TreeRay *r, float tmax, Tri8Hits *h)
{
  unsigned bits = 0;
  for (int g = 0; g < 8; g += WIDE) {
    wf x[3], y[3], z[3];
    for (int i = 0; i < 3; i++) {
      z[i] = wf_load(b->v[i][r->kz] + g) - r->o[r->kz];
      x[i] = wf_load(b->v[i][r->kx] + g) - r->o[r->kx] - r->sx * z[i];
      y[i] = wf_load(b->v[i][r->ky] + g) - r->o[r->ky] - r->sy * z[i];
    }
    wf e0 = x[2] * y[1] - y[2] * x[1];
    wf e1 = x[0] * y[2] - y[0] * x[2];
    wf e2 = x[1] * y[0] - y[1] * x[0];
    const wf none = wf_set(0);
    const wf least = wf_min(wf_min(e0, e1), e2), most = wf_max(wf_max(e0, e1), e2);
    unsigned inside = wf_le(none, least) | wf_le(most, none);
    if (!inside) continue;
    const unsigned zero = wf_eq(least, none) | wf_eq(most, none);
    if (__builtin_expect(zero != 0, 0)) {
      float xs[3][8], ys[3][8];
      for (int i = 0; i < 3; i++) {
        wf_store(xs[i] + g, x[i]);
        wf_store(ys[i] + g, y[i]);
      }
      wf_store(h->e[0] + g, e0);
      wf_store(h->e[1] + g, e1);
      wf_store(h->e[2] + g, e2);
      for (unsigned left = zero; left; left &= left - 1) tri8_exact_edges(h, g + __builtin_ctz(left), xs, ys);
      e0 = wf_load(h->e[0] + g);
      e1 = wf_load(h->e[1] + g);
      e2 = wf_load(h->e[2] + g);
      inside = (wf_le(none, e0) & wf_le(none, e1) & wf_le(none, e2)) |
               (wf_le(e0, none) & wf_le(e1, none) & wf_le(e2, none));
    }
    const wf det = e0 + e1 + e2;
    const wf t = (e0 * z[0] + e1 * z[1] + e2 * z[2]) * r->sz / det;
    wf_store(h->e[0] + g, e0);
    wf_store(h->e[1] + g, e1);
    wf_store(h->e[2] + g, e2);
    wf_store(h->t + g, t);
    bits |= (inside & ~wf_eq(det, none) & wf_lt(wf_set(r->tmin), t) & wf_le(t, wf_set(tmax))) << g;
  }
  return bits;
}

static inline void tri8_box(const Tri8 *b, int i, float box[6])
{
  for (int k = 0; k < 3; k++) {
    box[2 * k] = min_f(min_f(b->v[0][k][i], b->v[1][k][i]), b->v[2][k][i]);
    box[2 * k + 1] = max_f(max_f(b->v[0][k][i], b->v[1][k][i]), b->v[2][k][i]);
  }
}

// Where the ray enters the box of one triangle of the block; infinity when it misses it.
static inline float tri8_box_near(const Tri8 *b, int i, const TreeRay *r)
{
  float box[6];
  tri8_box(b, i, box);
  return tree_ray_box(r, box, FLT_MAX);
}

// Where trees hold pieces of triangles (accel/build_spatial.c), a hit is a point, and its box, of TRI_SLACK to either
// side, has to be met as well. The box tells which pieces the ray must have come through: those the point lies in,
// once they are widened by tri_margin. That covers the box's half side, and as much again for the rounding of the
// point (7 * 2^-24 of the vertices), of its box (2) and of the clipping (11).
//
// The half side itself is what a ray may be off the point because of the edge functions' rounding: about
// 2^-24 * size / width for a triangle seen as a needle. Up to a ratio of 1024 the box is large enough, and beyond
// that the point is computed anew in double. As much as the vertices' own rounding, 2^-19, is added for triangles
// far from the origin, and FLT_MIN where that is denormal.
#define TRI_SLACK 0x1p-14f

static inline float tri_slack(const float box[6])
{
  float size = 0, away = 0;
  for (int k = 0; k < 3; k++) {
    size = max_f(box[2 * k + 1] - box[2 * k], size);
    away = max_f(max_f(box[2 * k + 1], -box[2 * k]), away);
  }
  return TRI_SLACK * size + 0x1p-19f * away + 8 * FLT_MIN;
}

static inline float tri_margin(const float box[6])
{
  return 2 * tri_slack(box);
}

// Where the ray enters the box about a point of a triangle, cut by the triangle's own box.
static inline float tri_point_near(const float box[6], const float point[3], const TreeRay *r)
{
  const float slack = tri_slack(box);
  float about[6];
  for (int k = 0; k < 3; k++) {
    about[2 * k] = max_f(point[k] - slack, box[2 * k]);
    about[2 * k + 1] = min_f(point[k] + slack, box[2 * k + 1]);
  }
  return tree_ray_box(r, about, FLT_MAX);
}

// The same by a point found in double; what lies beyond an edge is brought back to it. Infinity when there is none.
static inline float tri8_exact_near(const Tri8 *b, int i, const float box[6], const TreeRay *r)
{
  const uint32_t axes[3] = {r->kx, r->ky, r->kz};
  double v[3][3];
  for (int c = 0; c < 3; c++) {
    for (int k = 0; k < 3; k++) v[c][k] = (double)b->v[c][axes[k]][i] - r->o[axes[k]];
    for (int k = 0; k < 2; k++) v[c][k] -= (double)r->d[axes[k]] / r->d[r->kz] * v[c][2];
  }
  double e[3], sum = 0, inside = 0;
  for (int c = 0; c < 3; c++) {
    const double *p = v[c == 0 ? 2 : c - 1], *q = v[c == 2 ? 0 : c + 1];
    e[c] = p[0] * q[1] - p[1] * q[0];
    sum += e[c];
  }
  for (int c = 0; c < 3; c++) {
    e[c] = fmax(sum < 0 ? -e[c] : e[c], 0);
    inside += e[c];
  }
  if (!(inside > 0 && inside < INFINITY)) return INFINITY;
  float point[3];
  for (int k = 0; k < 3; k++) {
    point[k] = (float)((e[0] * b->v[0][k][i] + e[1] * b->v[1][k][i] + e[2] * b->v[2][k][i]) / inside);
  }
  return tri_point_near(box, point, r);
}

// Where the ray enters the box about its point of hit, given the edge functions there; infinity when it misses it.
static inline float tri8_point_near(const Tri8 *b, int i, const TreeRay *r, float e0, float e1, float e2)
{
  const float det = e0 + e1 + e2, w[3] = {e0 / det, e1 / det, e2 / det};
  float box[6], point[3];
  tri8_box(b, i, box);
  for (int k = 0; k < 3; k++) point[k] = w[0] * b->v[0][k][i] + w[1] * b->v[1][k][i] + w[2] * b->v[2][k][i];
  const float near = tri_point_near(box, point, r);
  return near < INFINITY ? near : tri8_exact_near(b, i, box, r);
}

// Whether the triangle's plane lies beyond tmin when measured in double. The float distance of a large triangle is
// off by its size times 2^-24, so that a ray leaving it by a few ulps may seem to hit it again. There is no doubt
// when all three vertices lie ahead along the ray's longest axis, since rounding moves a vertex by 2^-24 of its
// distance.
static inline bool tri8_is_ahead(const Tri8 *b, int i, const TreeRay *r)
{
  float first = INFINITY;
  for (int c = 0; c < 3; c++) first = min_f((b->v[c][r->kz][i] - r->o[r->kz]) * r->sz, first);
  if (first > r->tmin * AHEAD_SLACK) return true;
  double e1[3], e2[3], to[3];
  for (int k = 0; k < 3; k++) {
    e1[k] = (double)b->v[1][k][i] - b->v[0][k][i];
    e2[k] = (double)b->v[2][k][i] - b->v[0][k][i];
    to[k] = (double)b->v[0][k][i] - r->o[k];
  }
  const double n[3] = {e1[1] * e2[2] - e1[2] * e2[1], e1[2] * e2[0] - e1[0] * e2[2],
                       e1[0] * e2[1] - e1[1] * e2[0]};
  const double along = n[0] * r->d[0] + n[1] * r->d[1] + n[2] * r->d[2];
  const double away = n[0] * to[0] + n[1] * to[1] + n[2] * to[2];
  return along > 0 ? away > r->tmin * along : along < 0 && away < r->tmin * along;
}

#endif
