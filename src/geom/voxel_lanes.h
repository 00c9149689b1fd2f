// Voxel lanes: up to 64 rays through a grid of cells, a ray a lane, in step, until each meets the first filled cell. In a
// step a ray crosses the largest empty block that its cell lies in: of 64, 32, 16, 8, 4, 2 cells or 1 a side. Blocks of 64
// are nodes that are not there; all others are found by one rule, since a node's bricks and a brick's cells are both a map
// of 8^3 bits: are the 4^3 or the 2^3 bits about this one all clear?
//
// What is crossed when is defined by the numbers of voxel_walk.h, which are computed here by the same operations. A ray's
// place along the two axes that it does not step along is guessed and then put right by those numbers, so that the answer
// is that of single steps, bit for bit, at every level of instructions.
//
// What rays meet behind their first filled cell, or if they begin in one, is not found here: voxel_walk.h goes on.

#ifndef RAYFOLD_GEOM_VOXEL_LANES_H
#define RAYFOLD_GEOM_VOXEL_LANES_H

#include "base/wide.h"
#include "geom/voxel_walk.h"

enum { VOXEL_RAYS = 64 };

typedef struct VoxelRays {
  float o[3][VOXEL_RAYS], d[3][VOXEL_RAYS]; // as tree_ray_place() has them
  float from[VOXEL_RAYS];                   // nothing counts up to here
  uint64_t is_clear;                        // rays that are known to be in an empty cell there
  // Answers: rays with a first crossing, and rays that begin in a filled cell; of what was met the time, the cell, the rays
  // that met a face of each axis, and those that met a face which looks along its axis.
  uint64_t met, unknown;
  float t[VOXEL_RAYS], cell[3][VOXEL_RAYS];
  uint64_t on[3], along;
} __attribute__((aligned(64))) VoxelRays;

typedef struct VoxelLanes {
  wx o[3], d[3], inv[3];
  unsigned moves[3], up[3];
  wx way[3], lo[3], hi[3], exit[3]; // 1 or -1; what is filled, first and last cells; the plane that leads out of it, times way
  wx sure[3];                       // see voxel_lanes_cell()
  wx t, limit;                      // of the last plane, and beyond which nothing counts
  unsigned on[3];                   // lanes whose last plane is one of this axis
  wx c[3];                          // cells
  uint32_t block[WIDEST];           // if they are empty, one less than the cells a side of an empty block about them
} VoxelLanes;

static inline wx voxel_lanes_t(const VoxelLanes *l, int k, wx plane) { return (plane - l->o[k]) * l->inv[k]; }

static inline void voxel_lanes_begin(VoxelLanes *l, const Voxels *v, const VoxelRays *r, int at)
{
  const wx zero = wx_set(0);
  memset(l->block, 0, sizeof l->block);
  for (int k = 0; k < 3; k++) {
    l->o[k] = wx_load(r->o[k] + at);
    l->d[k] = wx_load(r->d[k] + at);
    l->inv[k] = 1 / l->d[k];
    l->up[k] = wx_lt(zero, l->d[k]);
    l->moves[k] = l->up[k] | wx_lt(l->d[k], zero);
    l->lo[k] = wx_set((float)v->lo[k]);
    l->hi[k] = wx_set((float)(v->hi[k] - 1));
    l->way[k] = wx_choose(l->up[k], wx_set(1), wx_set(-1));
    l->exit[k] = wx_choose(l->up[k], wx_set((float)v->hi[k]), -l->lo[k]);
    const wx slack = 0x1.8p-22f * (wx_abs(l->o[k]) + (float)v->hi[k]);
    l->sure[k] = wx_choose(wx_lt(wx_abs(l->d[k]), wx_set(0x1p64f)), 0.5f - slack, wx_set(-1));
  }
}

// See voxel_clip(). Lanes that enter the box of what is filled.
static inline unsigned voxel_lanes_clip(VoxelLanes *l, const Voxels *v, wx from, wx tmax)
{
  unsigned alive = WIDEST_BITS;
  wx last[3];
  l->t = from;
  l->limit = tmax;
  l->on[0] = l->on[1] = 0;
  l->on[2] = WIDEST_BITS;
  for (int k = 0; k < 3; k++) {
    const wx lo = l->lo[k], hi = wx_set((float)v->hi[k]);
    alive &= l->moves[k] | (wx_le(lo, l->o[k]) & wx_lt(l->o[k], hi));
    const wx near = voxel_lanes_t(l, k, wx_choose(l->up[k], lo, hi)), far = voxel_lanes_t(l, k, wx_choose(l->up[k], hi, lo));
    const unsigned later = wx_lt(l->t, near) & l->moves[k];
    // Of planes at the same time the last axis counts.
    const unsigned same = wx_eq(near, l->t) & l->moves[k] & ~(k == 0 ? WIDEST_BITS : k == 1 ? l->on[1] | l->on[2] : l->on[2]);
    l->t = wx_choose(later, near, l->t);
    for (int j = 0; j < 3; j++) l->on[j] = j == k ? l->on[j] | later | same : l->on[j] & ~(later | same);
    last[k] = wx_choose(l->moves[k], far, wx_set(INFINITY));
    l->limit = wx_choose(l->moves[k], wx_min(far, l->limit), l->limit);
  }
  for (int k = 0; k < 3; k++) {
    const unsigned not_after = k == 0 ? WIDEST_BITS : k == 1 ? l->on[1] | l->on[2] : l->on[2];
    alive &= ~(wx_lt(last[k], l->t) | (wx_eq(last[k], l->t) & not_after));
  }
  return alive & wx_le(l->t, l->limit);
}

// Lanes in which a plane of axis k is crossed no later than the last one.
static inline unsigned voxel_lanes_crossed(const VoxelLanes *l, int k, wx plane)
{
  const wx t = voxel_lanes_t(l, k, plane);
  const unsigned not_after = k == 0 ? WIDEST_BITS : k == 1 ? ~l->on[0] : l->on[2];
  return wx_lt(t, l->t) | (wx_eq(t, l->t) & not_after);
}

// Which of the cells low to high the lanes are in after their last plane; see voxel_block_at().
//
// By where they are, if that is not near a plane: (n - o) * (1 / d) is rounded three times and o + t * d twice, so that
// "crossed by the numbers" and "crossed by the place" can differ only where the place is nearer to the plane than
// 5 * 2^-24 (|o| + |place|); 6 of these are asked for. (Reciprocals near the denormal are left out of this.)
static inline wx voxel_lanes_cell(const VoxelLanes *l, int k, wx low, wx high, unsigned asked)
{
  const wx p = l->o[k] + l->t * l->d[k];
  wx c = wx_of_int(wx_truncate(wx_min(wx_max(p, low), high)));
  asked &= l->moves[k];
  asked &= ~wx_lt(wx_abs(p - c - 0.5f), l->sure[k]);
  while (__builtin_expect(asked != 0, 0)) {
    const unsigned enters = voxel_lanes_crossed(l, k, c), leaves = voxel_lanes_crossed(l, k, c + 1);
    const unsigned more = ~(leaves ^ l->up[k]) & wx_lt(c, high) & asked, less = (enters ^ l->up[k]) & wx_lt(low, c) & asked;
    if (!(more | less)) break;
    c += wx_choose(more, wx_set(1), wx_set(0)) - wx_choose(less, wx_set(1), wx_set(0));
  }
  return c;
}

// Is a cell filled? node: its number; brick: in the node, x + 8 y + 64 z; cell: likewise in the brick. If not, *block is
// one less than the cells a side of an empty block about it. No branches: what is next differs from lane to lane, and a
// third of them would be foretold wrongly.
static inline unsigned voxel_look(const Voxels *v, uint32_t node, uint32_t brick, uint32_t cell, uint32_t *block)
{
  static const VoxelNode nothing;
  const VoxelNode *n = v->nodes[node];
  const uint32_t is_none = !n;
  n = n ? n : &nothing;
  const uint64_t some = n->some[brick >> 6];
  const uint32_t is_some = (uint32_t)(some >> (brick & 63)) & 1, rank = voxel_bits_before(n->some, n->some_before, brick >> 6, brick & 63);
  // The brick's map, or that of the node's bricks.
  const uintptr_t own = -(uintptr_t)is_some, of_brick = (uintptr_t)n->masks + rank * sizeof *n->masks;
  const uint64_t *map = (const uint64_t *)((of_brick & own) | ((uintptr_t)n->any & ~own));
  const uint32_t at = (cell & (uint32_t)own) | (brick & ~(uint32_t)own);
  const uint64_t *four = map + (at >> 6 & 4), *two = map + (at >> 6 & 6);
  const uint32_t is_four = ((four[0] | four[1] | four[2] | four[3]) >> (at & 044) & 0x0f0f0f0f) != 0;
  const uint32_t is_two = ((two[0] | two[1]) >> (at & 066) & 0x0303) != 0; // then four are not clear, too
  *block = ((4 - 2 * is_four - is_two) << (3 - 3 * is_some + is_none)) - 1;
  return (unsigned)(map[at >> 6] >> (at & 63)) & 1;
}

// Looks at the cells of the lanes asked for, and says in which of them they are filled.
static inline unsigned voxel_lanes_look(VoxelLanes *l, const Voxels *v, unsigned asked)
{
  uint32_t node[WIDEST], brick[WIDEST], cell[WIDEST];
  const uint32_t row = (uint32_t)v->nodes_size[0], layer = row * (uint32_t)v->nodes_size[1];
  const wxu x = (wxu)wx_truncate(l->c[0]), y = (wxu)wx_truncate(l->c[1]), z = (wxu)wx_truncate(l->c[2]);
  unsigned filled = 0;
  wxu_store(node, (x >> 6) + row * (y >> 6) + layer * (z >> 6));
  wxu_store(brick, (x >> 3 & 7) | (y & 070) | (z << 3 & 0700));
  wxu_store(cell, (x & 7) | (y << 3 & 070) | (z << 6 & 0700));
  for (; asked; asked &= asked - 1) {
    const int i = __builtin_ctz(asked);
    filled |= voxel_look(v, node[i], brick[i], cell[i], &l->block[i]) << i;
  }
  return filled;
}

// Out of the empty blocks. Lanes that are still in what may be filled and before their limit.
static inline unsigned voxel_lanes_step(VoxelLanes *l, unsigned asked)
{
  const wxu blocks = wxu_load(l->block);
  wx low[3], high[3], next[3];
  unsigned left = 0;
  for (int k = 0; k < 3; k++) {
    const wxu c = (wxu)wx_truncate(l->c[k]);
    low[k] = wx_of_int((wxi)(c & ~blocks));
    high[k] = wx_of_int((wxi)(c | blocks));
    next[k] = wx_choose(l->moves[k], voxel_lanes_t(l, k, wx_choose(l->up[k], high[k] + 1, low[k])), wx_set(INFINITY));
  }
  l->t = wx_min(next[0], wx_min(next[1], next[2]));
  l->on[0] = wx_eq(next[0], l->t);
  l->on[1] = wx_eq(next[1], l->t) & ~l->on[0];
  l->on[2] = ~(l->on[0] | l->on[1]) & WIDEST_BITS;
  asked &= wx_le(l->t, l->limit);
  for (int k = 0; k < 3; k++) {
    const wx plane = wx_choose(l->up[k], high[k] + 1, low[k]);
    left |= l->on[k] & ~wx_lt(plane * l->way[k], l->exit[k]);
    const wx beside = voxel_lanes_cell(l, k, low[k], high[k], asked & ~l->on[k]);
    l->c[k] = wx_choose(l->on[k], wx_choose(l->up[k], high[k] + 1, low[k] - 1), beside);
  }
  return asked & ~left;
}

static inline void voxel_rays_meet(VoxelRays *r, const VoxelLanes *l, int at, unsigned met)
{
  wx_put(r->t + at, met, l->t);
  r->met |= (uint64_t)met << at;
  for (int k = 0; k < 3; k++) {
    wx_put(r->cell[k] + at, met, l->c[k]);
    r->on[k] |= (uint64_t)(l->on[k] & met) << at;
    r->along |= (uint64_t)(l->on[k] & met & ~l->up[k]) << at;
  }
}

// Nothing has been met.
static inline void voxel_rays_begin(VoxelRays *r)
{
  r->is_clear = r->met = r->unknown = r->along = 0;
  memset(r->on, 0, sizeof r->on);
}

// Makes a group ready and looks at its first cells. Lanes that go on from empty ones.
static inline unsigned voxel_rays_enter(const Voxels *v, VoxelRays *r, VoxelLanes *l, int at, const float *tmax, unsigned asked)
{
  const wx from = wx_load(r->from + at);
  voxel_lanes_begin(l, v, r, at);
  asked &= voxel_lanes_clip(l, v, from, wx_load(tmax));
  for (int k = 0; k < 3; k++) l->c[k] = voxel_lanes_cell(l, k, l->lo[k], l->hi[k], asked);
  const unsigned filled = voxel_lanes_look(l, v, asked);
  // Rays that begin within the grid begin in this cell, and have not come into it.
  const unsigned unknown = filled & wx_eq(l->t, from) & ~(unsigned)(r->is_clear >> at);
  r->unknown |= (uint64_t)unknown << at;
  if (filled & ~unknown) voxel_rays_meet(r, l, at, filled & ~unknown);
  return asked & ~filled;
}

// Group g of the rays, as far as tmax; those in `asked`. (All groups a step each by turns, to have more going on at once,
// was no faster.)
static inline void voxel_rays_walk(const Voxels *v, VoxelRays *r, int g, const float *tmax, unsigned asked)
{
  const int at = g * WIDEST;
  VoxelLanes l;
  asked = voxel_rays_enter(v, r, &l, at, tmax, asked);
  while (asked && (asked = voxel_lanes_step(&l, asked))) {
    const unsigned filled = voxel_lanes_look(&l, v, asked);
    if (filled) voxel_rays_meet(r, &l, at, filled);
    asked &= ~filled;
  }
}

static inline VoxelCrossing voxel_rays_crossing(const VoxelRays *r, int i)
{
  const uint32_t axis = r->on[0] >> i & 1 ? 0 : r->on[1] >> i & 1 ? 1 : 2;
  return (VoxelCrossing){r->t[i],
                         {(int32_t)r->cell[0][i], (int32_t)r->cell[1][i], (int32_t)r->cell[2][i]},
                         2 * axis + (uint32_t)(r->along >> i & 1)};
}

// voxel_face_uv() of a group's rays.
static inline void voxel_rays_uv(const VoxelRays *r, int g, wx *u, wx *v)
{
  const int at = g * WIDEST;
  const wx t = wx_load(r->t + at), zero = wx_set(0), one = wx_set(1);
  const unsigned x = (unsigned)(r->on[0] >> at), y = (unsigned)(r->on[1] >> at), along = (unsigned)(r->along >> at);
  wx f[3];
  for (int k = 0; k < 3; k++) {
    const wx p = wx_load(r->o[k] + at) + t * wx_load(r->d[k] + at) - wx_load(r->cell[k] + at);
    f[k] = wx_min(wx_max(p, zero), one);
  }
  *u = wx_choose(x, wx_choose(along, one - f[2], f[2]), wx_choose(y | along, f[0], one - f[0]));
  *v = wx_choose(y, wx_choose(along, one - f[2], f[2]), f[1]);
}

#endif
