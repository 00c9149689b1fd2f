// A mesh's arrays as those who make its tree read them, and which triangles a tree holds: those that something can
// hit. A tree's blocks keep the vertices themselves, so that a ray needs no look at these arrays.

#ifndef RAYFOLD_ACCEL_MESH_INPUT_H
#define RAYFOLD_ACCEL_MESH_INPUT_H

#include "accel/tree.h"

typedef struct MeshArrays {
  const float *positions; // 3 a vertex
  size_t vertex_count;
  const uint32_t *triangles; // 3 a triangle
  size_t triangle_count;
} MeshArrays;

static inline bool has_area_exactly(const Vec3 v[3])
{
  double area = 0;
  for (int k = 0; k < 3; k++) {
    const int l = k == 2 ? 0 : k + 1;
    area += fabs(((double)v[1][k] - v[0][k]) * ((double)v[2][l] - v[0][l]) -
                 ((double)v[1][l] - v[0][l]) * ((double)v[2][k] - v[0][k]));
  }
  return area > 0;
}

// Whether a triangle has an area, in double. Most are spared that: of a difference of products in single precision
// that is 2^-20 of them, rounding can be no more than a quarter.
static inline bool has_area(const Vec3 v[3])
{
  const Vec3 a = v[1] - v[0], b = v[2] - v[0];
  const Vec3 p = a * __builtin_shufflevector(b, b, 1, 2, 0, 3), q = __builtin_shufflevector(a, a, 1, 2, 0, 3) * b;
  const Vec3 least = 0x1p-20f * (lanes_max(p, -p) + lanes_max(q, -q)), c = p - q;
  const Vec3 margin = lanes_max(c, -c) - lanes_max(least, v3_all(FLT_MIN));
  return margin[0] > 0 || margin[1] > 0 || margin[2] > 0 || has_area_exactly(v);
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

// Writes one lane of a block, NO_HIT for one not used. Returns the triangle's box: empty when nothing can hit it, which
// then keeps its lane, but has no vertices.
static inline Bounds block_set_lane(Tri8 *block, uint32_t lane, const MeshArrays *m, uint32_t prim)
{
  Vec3 v[3];
  const bool is_there = prim != NO_HIT && triangle_corners(m, prim, v);
  if (!is_there) v[0] = v[1] = v[2] = v3_all(NAN);
  block->prim[lane] = prim;
  for (int c = 0; c < 3; c++) {
    for (int k = 0; k < 3; k++) block->v[c][k][lane] = v[c][k];
  }
  return is_there ? corners_bounds(v) : bounds_empty();
}

#endif
