// A mesh's arrays as those who make its tree read them, and which triangles a tree holds: those that something can
// hit. A tree's blocks keep the vertices themselves, so that a ray needs no look at these arrays.

#ifndef RAYFOLD_ACCEL_MESH_INPUT_H
#define RAYFOLD_ACCEL_MESH_INPUT_H

#include "accel/tree.h"

#include <string.h>

typedef struct MeshArrays {
  const float *positions; // 3 a vertex
  size_t vertex_count;
  const uint32_t *triangles; // 3 a triangle
  size_t triangle_count;
} MeshArrays;

// Whether a triangle has an area, in double.
static inline bool has_area(const Vec3 v[3])
{
  double area = 0;
  for (int k = 0; k < 3; k++) {
    const int l = k == 2 ? 0 : k + 1;
    area += fabs(((double)v[1][k] - v[0][k]) * ((double)v[2][l] - v[0][l]) -
                 ((double)v[1][l] - v[0][l]) * ((double)v[2][k] - v[0][k]));
  }
  return area > 0;
}

// The corners of a triangle; false for one that nothing can hit: of no area, not finite, or with a bad index.
static inline bool triangle_corners(const MeshArrays *m, size_t i, Vec3 v[3])
{
  for (int c = 0; c < 3; c++) {
    const uint32_t vertex = m->triangles[3 * i + c];
    if (vertex >= m->vertex_count) return false;
    v[c] = v3_load(m->positions + 3 * (size_t)vertex);
    if (!v3_is_finite(v[c])) return false;
  }
  return has_area(v);
}

static inline Bounds corners_bounds(const Vec3 v[3])
{
  return (Bounds){lanes_min(lanes_min(v[0], v[1]), v[2]), lanes_max(lanes_max(v[0], v[1]), v[2])};
}

// --- blocks ---------------------------------------------------------------------------------------

typedef Vec3 Four; // here: one coordinate of four triangles
typedef int32_t FourBits __attribute__((vector_size(16)));

// Four triangles, a coordinate a row.
typedef struct Tri4 {
  Four v[3][3]; // vertex, axis
} Tri4;

static inline Vec3 vertex_load(const MeshArrays *m, uint32_t vertex)
{
  if (vertex >= m->vertex_count) return v3_all(NAN);
  const float *p = m->positions + 3 * (size_t)vertex;
  if (vertex + 1u >= m->vertex_count) return v3_load(p);
  Vec3 v; // in one read, the next vertex's first coordinate with it
  memcpy(&v, p, sizeof v);
  return v;
}

static inline void tri4_load(Tri4 *t, const MeshArrays *m, const uint32_t prim[4])
{
#pragma GCC unroll 3
  for (int c = 0; c < 3; c++) {
    Vec3 p[4];
#pragma GCC unroll 4
    for (int i = 0; i < 4; i++) {
      p[i] = prim[i] == NO_HIT ? v3_all(NAN) : vertex_load(m, m->triangles[3 * (size_t)prim[i] + (size_t)c]);
    }
    const Four xy01 = __builtin_shufflevector(p[0], p[1], 0, 4, 1, 5);
    const Four xy23 = __builtin_shufflevector(p[2], p[3], 0, 4, 1, 5);
    const Four z01 = __builtin_shufflevector(p[0], p[1], 2, 6, 2, 6);
    const Four z23 = __builtin_shufflevector(p[2], p[3], 2, 6, 2, 6);
    t->v[c][0] = __builtin_shufflevector(xy01, xy23, 0, 1, 4, 5);
    t->v[c][1] = __builtin_shufflevector(xy01, xy23, 2, 3, 6, 7);
    t->v[c][2] = __builtin_shufflevector(z01, z23, 0, 1, 4, 5);
  }
}

static inline Four four_size(Four x) { return lanes_max(x, -x); }

// Those whose corners are finite and whose area single precision can tell from none: of a difference of products that
// is 2^-20 of them, rounding can be no more than a quarter.
static inline FourBits tri4_is_clear(const Tri4 *t)
{
  Four broken = {0}, margin = {0}, a[3], b[3];
#pragma GCC unroll 9
  for (int i = 0; i < 9; i++) broken += t->v[i / 3][i % 3] - t->v[i / 3][i % 3]; // infinity less infinity is NaN
#pragma GCC unroll 3
  for (int k = 0; k < 3; k++) {
    a[k] = t->v[1][k] - t->v[0][k];
    b[k] = t->v[2][k] - t->v[0][k];
  }
  const Four least = (Four){0} + FLT_MIN;
#pragma GCC unroll 3
  for (int k = 0; k < 3; k++) {
    const int l = k == 2 ? 0 : k + 1;
    const Four p = a[k] * b[l], q = a[l] * b[k];
    margin = lanes_max(four_size(p - q) - lanes_max(0x1p-20f * (four_size(p) + four_size(q)), least), margin);
  }
  return (broken == 0) & (margin > 0);
}

// Takes the vertices from those that nothing can hit.
static inline void tri4_drop_hidden(Tri4 *t, const uint32_t prim[4])
{
  const FourBits clear = tri4_is_clear(t);
  for (int i = 0; i < 4; i++) {
    if (clear[i] || prim[i] == NO_HIT) continue;
    Vec3 v[3];
    for (int c = 0; c < 3; c++) v[c] = v3(t->v[c][0][i], t->v[c][1][i], t->v[c][2][i]);
    if (v3_is_finite(v[0]) && v3_is_finite(v[1]) && v3_is_finite(v[2]) && has_area(v)) continue;
    for (int k = 0; k < 9; k++) t->v[k / 3][k % 3][i] = NAN;
  }
}

// The least of each row, as x, y and z.
static inline Vec3 least_of_rows(const Four r[3])
{
  const Four low = __builtin_shufflevector(r[0], r[1], 0, 1, 4, 5);
  const Four high = __builtin_shufflevector(r[0], r[1], 2, 3, 6, 7);
  const Four xy = lanes_min(low, high);
  const Four zz = lanes_min(r[2], __builtin_shufflevector(r[2], r[2], 2, 3, 2, 3));
  const Vec3 even = __builtin_shufflevector(xy, zz, 0, 2, 4, 4), odd = __builtin_shufflevector(xy, zz, 1, 3, 5, 5);
  const Vec3 least = lanes_min(even, odd);
  return v3(least[0], least[1], least[2]);
}

// Writes the triangles into a block, NO_HIT for lanes not used. One that nothing can hit keeps its lane, but has no
// vertices. Returns the box of the others.
static inline Bounds block_fill(Tri8 *block, const MeshArrays *m, const uint32_t prim[8])
{
  const Four none = (Four){0} + INFINITY;
  Four lo[3] = {none, none, none}, hi[3] = {none, none, none}; // hi: turned round in sign
  memcpy(block->prim, prim, sizeof block->prim);
  for (int half = 0; half < 8; half += 4) {
    Tri4 t;
    tri4_load(&t, m, block->prim + half);
    tri4_drop_hidden(&t, block->prim + half);
#pragma GCC unroll 9
    for (int i = 0; i < 9; i++) {
      const Four x = t.v[i / 3][i % 3];
      memcpy(block->v[i / 3][i % 3] + half, &x, sizeof x);
      lo[i % 3] = lanes_min(x, lo[i % 3]); // NaN, the first operand, counts for nothing
      hi[i % 3] = lanes_min(-x, hi[i % 3]);
    }
  }
  return (Bounds){least_of_rows(lo), -least_of_rows(hi)};
}

#endif
