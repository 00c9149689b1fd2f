// Voxel beam: how far rays that go alike may skip through a grid together. The beam is cut into slabs of bricks across
// the axis it mostly follows; in each slab all rays lie in one rectangle, and while no brick of that rectangle holds
// anything, no ray can have met anything (Wald et al., "Ray tracing animated scenes using coherent grid traversal", 2006,
// walk grids by such slabs). Then each ray starts its own walk a cell before the first slab that holds something. Since a
// walk is defined by the numbers of its planes, it finds from there what it would have found from its origin.

#ifndef RAYFOLD_GEOM_VOXEL_BEAM_H
#define RAYFOLD_GEOM_VOXEL_BEAM_H

#include "geom/voxel_lanes.h"

// Origins, and slopes of all other coordinates by the main one, as least and greatest.
typedef struct VoxelBeam {
  int axis, step;
  Vec3 o_lo, o_hi, slope_lo, slope_hi;
  bool is_one; // all rays run along the axis the same way, none of them far from it
} VoxelBeam;

static inline unsigned voxel_beam_group(uint64_t set, int g) { return (unsigned)(set >> g * WIDEST) & WIDEST_BITS; }

// Of rays of a set, least and greatest.
static inline void voxel_beam_ends(wx x, unsigned asked, float *lo, float *hi)
{
  *lo = min_f(*lo, wx_least(wx_choose(asked, x, wx_set(FLT_MAX))));
  *hi = max_f(*hi, wx_most(wx_choose(asked, x, wx_set(-FLT_MAX))));
}

// Of all rays of a set that is not empty.
static inline VoxelBeam voxel_beam(const VoxelRays *r, uint64_t set)
{
  const int first = __builtin_ctzll(set);
  const float d[3] = {r->d[0][first], r->d[1][first], r->d[2][first]}, x = fabsf(d[0]), y = fabsf(d[1]), z = fabsf(d[2]);
  const int axis = x > y ? (x > z ? 0 : 2) : (y > z ? 1 : 2);
  float ends[4][3]; // of origins and slopes
  unsigned astray = 0;
  for (int k = 0; k < 3; k++) ends[0][k] = ends[2][k] = FLT_MAX, ends[1][k] = ends[3][k] = -FLT_MAX;
  for (int g = 0; g < VOXEL_RAYS / WIDEST; g++) {
    const unsigned asked = voxel_beam_group(set, g);
    if (!asked) continue;
    const wx main = wx_load(r->d[axis] + g * WIDEST);
    astray |= asked & ~wx_lt(wx_set(0), d[axis] > 0 ? main : -main);
    for (int k = 0; k < 3; k++) {
      const wx slope = wx_load(r->d[k] + g * WIDEST) / main;
      // A slope above 2 in size would make rectangles large; this also turns away rays that do not move along the axis.
      astray |= asked & ~wx_le(wx_abs(slope), wx_set(2));
      voxel_beam_ends(wx_load(r->o[k] + g * WIDEST), asked, &ends[0][k], &ends[1][k]);
      voxel_beam_ends(slope, asked, &ends[2][k], &ends[3][k]);
    }
  }
  return (VoxelBeam){axis, d[axis] > 0 ? 1 : -1, v3_load(ends[0]), v3_load(ends[1]), v3_load(ends[2]), v3_load(ends[3]), !astray};
}

static inline bool voxel_brick_is_filled(const Voxels *v, const int32_t brick[3])
{
  const VoxelNode *n = voxels_node(v, 8 * (uint32_t)brick[0], 8 * (uint32_t)brick[1], 8 * (uint32_t)brick[2]);
  if (!n) return false;
  const uint32_t word = (uint32_t)brick[2] & 7, bit = ((uint32_t)brick[0] & 7) | ((uint32_t)brick[1] & 7) << 3;
  return n->any[word] >> bit & 1;
}

// Widens lo..hi by where the rays are when they cross a plane of the axis.
static inline void voxel_beam_at(const VoxelBeam *b, float plane, Vec3 *lo, Vec3 *hi)
{
  const float near = plane - b->o_hi[b->axis], far = plane - b->o_lo[b->axis];
  const Vec3 a = near * b->slope_lo, c = near * b->slope_hi, e = far * b->slope_lo, f = far * b->slope_hi;
  *lo = lanes_min(b->o_lo + lanes_min(lanes_min(a, c), lanes_min(e, f)), *lo);
  *hi = lanes_max(b->o_hi + lanes_max(lanes_max(a, c), lanes_max(e, f)), *hi);
}

static inline int32_t voxel_clamp_cell(float x, int32_t low, int32_t high)
{
  return (int32_t)clamp_f(floorf(x), (float)low, (float)high);
}

// Does any brick of the slab's rectangle hold something? A rectangle of many bricks is taken to.
static inline bool voxel_beam_meets(const Voxels *v, const VoxelBeam *b, int32_t slab)
{
  const int i = b->axis == 0 ? 1 : 0, j = b->axis == 2 ? 1 : 2;
  Vec3 lo = v3_all(INFINITY), hi = v3_all(-INFINITY);
  voxel_beam_at(b, (float)(8 * slab), &lo, &hi);
  voxel_beam_at(b, (float)(8 * slab + 8), &lo, &hi);
  // More than the rounding of a plane's number can move a ray, also one from far away.
  const Vec3 size = lanes_max(lanes_max(b->o_hi, -b->o_lo), v3_all((float)VOXELS_MOST_SIDE));
  const float pad = 0.02f + 2e-6f * v3_max_lane(size);
  lo -= pad;
  hi += pad;
  if (!(hi[i] >= (float)v->lo[i] && lo[i] <= (float)v->hi[i] && hi[j] >= (float)v->lo[j] && lo[j] <= (float)v->hi[j])) return false;
  int32_t from[3], to[3];
  for (int k = 0; k < 3; k++) {
    from[k] = voxel_clamp_cell(lo[k], v->lo[k], v->hi[k] - 1) >> 3;
    to[k] = voxel_clamp_cell(hi[k], v->lo[k], v->hi[k] - 1) >> 3;
  }
  if ((to[i] - from[i] + 1) * (to[j] - from[j] + 1) > 16) return true;
  int32_t brick[3];
  brick[b->axis] = slab;
  for (brick[j] = from[j]; brick[j] <= to[j]; brick[j]++)
    for (brick[i] = from[i]; brick[i] <= to[i]; brick[i]++)
      if (voxel_brick_is_filled(v, brick)) return true;
  return false;
}

// The plane of the beam's axis that rays may start at; false: nothing is met at all.
static inline bool voxel_beam_start(const Voxels *v, const VoxelBeam *b, int32_t *plane)
{
  const int k = b->axis;
  const int32_t first = b->step > 0 ? v->lo[k] >> 3 : (v->hi[k] - 1) >> 3, end = b->step > 0 ? (v->hi[k] - 1) >> 3 : v->lo[k] >> 3;
  int32_t slab = first;
  // Rays that begin inside start where the first of them does.
  const float begin = b->step > 0 ? b->o_lo[k] : b->o_hi[k];
  if (begin >= (float)v->lo[k] && begin < (float)v->hi[k]) slab = (int32_t)begin >> 3;
  for (; b->step > 0 ? slab <= end : slab >= end; slab += b->step) {
    if (!voxel_beam_meets(v, b, slab)) continue;
    *plane = b->step > 0 ? 8 * slab - 1 : 8 * slab + 9; // a cell before the slab, in one that is empty or outside
    return true;
  }
  return false;
}

#endif
