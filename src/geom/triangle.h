// Tri8: eight triangles and the test of one ray against them. Watertight: the ray is sheared to the z axis and each
// edge function is antisymmetric bit by bit in its two vertices, so neighbours never both reject a ray through their
// shared edge (Woop, Benthin, Wald, "Watertight Ray/Triangle Intersection", JCGT 2013). Both sides are hit. Rests on
// a * b - c * d not being contracted to a fused multiply-add.

#ifndef RAYFOLD_GEOM_TRIANGLE_H
#define RAYFOLD_GEOM_TRIANGLE_H

#include "geom/tree_ray.h"

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
static inline void tri8_exact_edges(Tri8Hits *h, int i, const float x[3][8], const float y[3][8])
{
  for (int a = 0; a < 3; a++) {
    const int b = a == 0 ? 1 : a == 1 ? 2 : 0, c = a == 0 ? 2 : a == 1 ? 0 : 1;
    h->e[a][i] = (float)((double)x[c][i] * y[b][i] - (double)y[c][i] * x[b][i]);
  }
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
    const unsigned zero = wi_bits((e0 == 0) | (e1 == 0) | (e2 == 0));
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
    }
    const wi inside = ((e0 >= 0) & (e1 >= 0) & (e2 >= 0)) | ((e0 <= 0) & (e1 <= 0) & (e2 <= 0));
    if (!wi_bits(inside)) continue;
    const wf det = e0 + e1 + e2;
    const wf t = (e0 * z[0] + e1 * z[1] + e2 * z[2]) * r->sz / det;
    wf_store(h->e[0] + g, e0);
    wf_store(h->e[1] + g, e1);
    wf_store(h->e[2] + g, e2);
    wf_store(h->t + g, t);
    bits |= wi_bits(inside & (det != 0) & (t > r->tmin) & (t <= tmax)) << g;
  }
  return bits;
}

// Where the ray enters the box of one triangle of the block; infinity when it misses it.
static inline float tri8_box_near(const Tri8 *b, int i, const TreeRay *r)
{
  float box[6];
  for (int k = 0; k < 3; k++) {
    box[k] = min_f(min_f(b->v[0][k][i], b->v[1][k][i]), b->v[2][k][i]);
    box[3 + k] = max_f(max_f(b->v[0][k][i], b->v[1][k][i]), b->v[2][k][i]);
  }
  return tree_ray_box(r, box, FLT_MAX);
}

// Whether the triangle's plane lies beyond tmin when measured in double. The float distance of a large triangle is
// off by its size times 2^-24, so that a ray leaving it by a few ulps may seem to hit it again.
static inline bool tri8_is_ahead(const Tri8 *b, int i, const TreeRay *r)
{
  double e1[3], e2[3], to[3];
  for (int k = 0; k < 3; k++) {
    e1[k] = (double)b->v[1][k][i] - b->v[0][k][i];
    e2[k] = (double)b->v[2][k][i] - b->v[0][k][i];
    to[k] = (double)b->v[0][k][i] - r->o[k];
  }
  const double n[3] = {e1[1] * e2[2] - e1[2] * e2[1], e1[2] * e2[0] - e1[0] * e2[2], e1[0] * e2[1] - e1[1] * e2[0]};
  const double along = n[0] * r->d[0] + n[1] * r->d[1] + n[2] * r->d[2];
  const double away = n[0] * to[0] + n[1] * to[1] + n[2] * to[2];
  return along > 0 ? away > r->tmin * along : along < 0 && away < r->tmin * along;
}

#endif
