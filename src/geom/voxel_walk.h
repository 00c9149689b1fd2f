// Voxel walk: a straight line through a grid of cells, in order, with whole empty or filled bricks (8^3 cells) and empty
// nodes (64^3) taken in one step (Amanatides and Woo, "A fast voxel traversal algorithm for ray tracing", 1987, on
// three levels).
//
// What is crossed is defined by numbers, not by how the walk goes: plane n of axis k is crossed at (n - o[k]) * (1 / d[k]),
// in single precision, and planes are crossed in the order of these numbers, equal ones in the order of their axes.
// Each is recomputed where it is needed and never added up; a level's planes are among those of the level below, so
// steps over a brick or a node lead to exactly the cell that single steps would have led to. Hence the answer is that of
// brute force, bit for bit, at every level of instructions, and a ray cannot slip between cells that share an edge.
//
// A surface is where matter changes: between empty and filled, and around each kind of see-through matter; of opaque
// cells side by side no wall is left between them. One cell is one unit of length here.

#ifndef RAYFOLD_GEOM_VOXEL_WALK_H
#define RAYFOLD_GEOM_VOXEL_WALK_H

#include "geom/bounds.h"
#include "geom/tree_ray.h"
#include "image/voxels.h"

#include <stdint.h>

// A grid as rays see it. matter: one an entry of its palette: 0 empty, 1 opaque, above it kinds of see-through matter;
// NULL: all entries are opaque.
typedef struct VoxelBody {
  const Voxels *grid;
  const uint8_t *matter;
} VoxelBody;

// A place where the line goes through a surface.
typedef struct VoxelCrossing {
  float t;
  int32_t cell[3]; // whose side it is
  uint32_t face;   // of that cell: 2 * axis, + 1 where it looks along the axis
} VoxelCrossing;

typedef bool VoxelTake(void *user, const VoxelCrossing *at); // true ends the walk

static inline Bounds voxel_bounds(const VoxelBody *b)
{
  const Voxels *v = b->grid;
  if (v->lo[0] >= v->hi[0]) return bounds_empty();
  return (Bounds){v3((float)v->lo[0], (float)v->lo[1], (float)v->lo[2]),
                  v3((float)v->hi[0], (float)v->hi[1], (float)v->hi[2])};
}

// The line made ready: step is 0 along axes it does not move on.
typedef struct VoxelLine {
  float o[3], d[3], inv[3];
  int32_t step[3], up[3]; // up: 1 where a cell's far plane is its upper one
} VoxelLine;

static inline VoxelLine voxel_line(const float o[3], const float d[3])
{
  VoxelLine l;
  for (int k = 0; k < 3; k++) {
    l.o[k] = o[k];
    l.d[k] = d[k];
    l.inv[k] = 1 / d[k];
    l.step[k] = d[k] > 0 ? 1 : d[k] < 0 ? -1 : 0;
    l.up[k] = d[k] > 0;
  }
  return l;
}

static inline float voxel_plane_t(const VoxelLine *l, int k, int32_t n) { return ((float)n - l->o[k]) * l->inv[k]; }

// Is plane n of axis k crossed no later than one that is crossed at t on axis a?
static inline bool voxel_is_crossed(const VoxelLine *l, int k, int32_t n, float t, int a)
{
  const float at = voxel_plane_t(l, k, n);
  return at < t || (at == t && k <= a);
}

// Which of `count` blocks of 1 << shift cells, the first of which begins at base, the line is in after (t, a).
static inline int32_t voxel_block_at(const VoxelLine *l, int k, int32_t base, int shift, int32_t count, float t, int a)
{
  // Right but for rounding; clamped as a float, since it may be anything.
  const float p = clamp_f(l->o[k] + t * l->d[k], (float)base, (float)(base + (count << shift)));
  int32_t c = ((int32_t)p - base) >> shift; // not negative, so the integer below
  c = c < count ? c : count - 1;
  if (l->step[k] > 0) {
    while (c < count - 1 && voxel_is_crossed(l, k, base + ((c + 1) << shift), t, a)) c++;
    while (c > 0 && !voxel_is_crossed(l, k, base + (c << shift), t, a)) c--;
  } else if (l->step[k] < 0) {
    while (c > 0 && voxel_is_crossed(l, k, base + (c << shift), t, a)) c--;
    while (c < count - 1 && !voxel_is_crossed(l, k, base + ((c + 1) << shift), t, a)) c++;
  }
  return c;
}

// One level of the walk: the block it is in, and where its far planes are.
typedef struct VoxelLevel {
  int32_t base[3], c[3]; // c counts blocks from base
  float next[3];
} VoxelLevel;

static inline void voxel_enter(VoxelLevel *v, const VoxelLine *l, const int32_t base[3], int shift, const int32_t count[3],
                               float t, int a)
{
  for (int k = 0; k < 3; k++) {
    v->base[k] = base[k];
    v->c[k] = voxel_block_at(l, k, base[k], shift, count[k], t, a);
    v->next[k] = l->step[k] ? voxel_plane_t(l, k, base[k] + ((v->c[k] + l->up[k]) << shift)) : INFINITY;
  }
}

// The axis of the plane that is crossed next: the first of the nearest. The times are not negative, so they order as
// integers, and the axis goes along in the low bits.
static inline int voxel_next_axis(const float next[3])
{
  uint32_t bits[3];
  memcpy(bits, next, sizeof bits);
  const uint64_t x = (uint64_t)bits[0] << 2, y = (uint64_t)bits[1] << 2 | 1, z = (uint64_t)bits[2] << 2 | 2;
  const uint64_t xy = x < y ? x : y;
  return (int)((xy < z ? xy : z) & 3);
}

// One step; false when that leads out of the blocks.
static inline bool voxel_step(VoxelLevel *v, const VoxelLine *l, int axis, int shift, const int32_t count[3])
{
  v->c[axis] += l->step[axis];
  if ((uint32_t)v->c[axis] >= (uint32_t)count[axis]) return false;
  v->next[axis] = voxel_plane_t(l, axis, v->base[axis] + ((v->c[axis] + l->up[axis]) << shift));
  return true;
}

// Where the walk is, and what it goes through.
typedef struct VoxelWalk {
  const VoxelBody *body;
  const VoxelLine *line;
  float t, limit;     // of the last plane crossed; nothing beyond the limit counts
  int axis;           // of that plane
  uint32_t matter;    // on this side of it
  VoxelTake *takes;
  void *user;
} VoxelWalk;

// Into matter, at the cell with the plane that was crossed last. True: the walk is over.
static inline bool voxel_meet(VoxelWalk *w, uint32_t matter, const int32_t cell[3])
{
  const uint32_t before = w->matter;
  if (matter == before) return false;
  w->matter = matter;
  // The side is that of what is entered; of what is left, where there is nothing, or where what is left is opaque.
  const bool is_left = matter == 0 || before == 1;
  VoxelCrossing at = {w->t, {cell[0], cell[1], cell[2]}, 2 * (uint32_t)w->axis};
  if (is_left) at.cell[w->axis] -= w->line->step[w->axis];
  at.face |= (uint32_t)(is_left == (w->line->step[w->axis] > 0));
  return w->takes(w->user, &at);
}

static inline uint32_t voxel_matter(const VoxelBody *b, uint32_t entry) { return b->matter ? b->matter[entry] : entry != 0; }

// The plane that `v` crosses next becomes the last one. False: it is beyond the limit.
static inline bool voxel_advance(VoxelWalk *w, const VoxelLevel *v)
{
  w->axis = voxel_next_axis(v->next);
  w->t = v->next[w->axis];
  return w->t <= w->limit;
}

typedef enum VoxelEnd { VOXEL_GOES_ON, VOXEL_TAKEN, VOXEL_BEYOND } VoxelEnd;

static inline VoxelEnd voxel_walk_brick(VoxelWalk *w, const VoxelNode *n, uint32_t rank, const int32_t base[3])
{
  static const int32_t count[3] = {8, 8, 8};
  const uint64_t *mask = n->masks[rank];
  VoxelLevel v;
  voxel_enter(&v, w->line, base, 0, count, w->t, w->axis);
  for (;;) {
    const uint32_t cell = (uint32_t)(v.c[0] | v.c[1] << 3 | v.c[2] << 6);
    uint32_t matter = (uint32_t)(mask[cell >> 6] >> (cell & 63)) & 1;
    if (matter && w->body->matter) matter = w->body->matter[voxel_brick_entry(n, rank, cell)];
    if (matter != w->matter) {
      const int32_t at[3] = {base[0] + v.c[0], base[1] + v.c[1], base[2] + v.c[2]};
      if (voxel_meet(w, matter, at)) return VOXEL_TAKEN;
    }
    if (!voxel_advance(w, &v)) return VOXEL_BEYOND;
    if (!voxel_step(&v, w->line, w->axis, 0, count)) return VOXEL_GOES_ON;
  }
}

// The cell of a block that the line is in after its last plane.
static inline void voxel_cell_in(const VoxelWalk *w, const int32_t base[3], int shift, int32_t cell[3])
{
  for (int k = 0; k < 3; k++) cell[k] = base[k] + voxel_block_at(w->line, k, base[k], 0, 1 << shift, w->t, w->axis);
}

static inline bool voxel_meet_block(VoxelWalk *w, uint32_t matter, const int32_t base[3], int shift)
{
  int32_t cell[3];
  if (matter == w->matter) return false;
  voxel_cell_in(w, base, shift, cell);
  return voxel_meet(w, matter, cell);
}

static inline VoxelEnd voxel_walk_node(VoxelWalk *w, const VoxelNode *n, const int32_t base[3])
{
  static const int32_t count[3] = {8, 8, 8};
  VoxelLevel v;
  voxel_enter(&v, w->line, base, 3, count, w->t, w->axis);
  for (;;) {
    const uint32_t word = (uint32_t)v.c[2], bit = (uint32_t)(v.c[0] | v.c[1] << 3);
    const int32_t brick[3] = {base[0] + 8 * v.c[0], base[1] + 8 * v.c[1], base[2] + 8 * v.c[2]};
    if (n->some[word] >> bit & 1) {
      const VoxelEnd end = voxel_walk_brick(w, n, voxel_bits_before(n->some, n->some_before, word, bit), brick);
      if (end != VOXEL_GOES_ON) return end;
    } else {
      const bool is_full = n->full[word] >> bit & 1;
      const uint32_t entry = is_full ? n->full_ids[voxel_bits_before(n->full, n->full_before, word, bit)] : 0;
      if (voxel_meet_block(w, voxel_matter(w->body, entry), brick, 3)) return VOXEL_TAKEN;
    }
    if (!voxel_advance(w, &v)) return VOXEL_BEYOND;
    if (!voxel_step(&v, w->line, w->axis, 3, count)) return VOXEL_GOES_ON;
  }
}

// Where the line enters the box of what is filled, after tmin: (*t, *axis) is the last plane it has crossed then; for a
// line that begins inside, tmin and the last axis. False: it misses the box, or enters beyond *limit, which becomes where
// the line leaves the box if that comes first.
static inline bool voxel_clip(const Voxels *v, const VoxelLine *l, float tmin, float *t, int *axis, float *limit)
{
  *t = tmin;
  *axis = 2;
  float end = *limit, last[3] = {INFINITY, INFINITY, INFINITY};
  for (int k = 0; k < 3; k++) {
    if (!l->step[k]) {
      if (!(l->o[k] >= (float)v->lo[k] && l->o[k] < (float)v->hi[k])) return false;
      continue;
    }
    const float near = voxel_plane_t(l, k, l->up[k] ? v->lo[k] : v->hi[k]);
    const float far = voxel_plane_t(l, k, l->up[k] ? v->hi[k] : v->lo[k]);
    if (near >= *t) {
      *axis = near > *t || k > *axis ? k : *axis;
      *t = near;
    }
    end = min_f(far, end);
    last[k] = far;
  }
  *limit = end;
  // Planes that were crossed at the same time count in the order of their axes here, too.
  for (int k = 0; k < 3; k++)
    if (last[k] < *t || (last[k] == *t && k <= *axis)) return false;
  return *t <= end;
}

// All surfaces that the line meets with tmin < t <= tmax, in order, until one is taken. True if one was.
static inline bool voxel_walk(const VoxelBody *body, const float o[3], const float d[3], float tmin, float tmax,
                              VoxelTake *takes, void *user)
{
  const Voxels *v = body->grid;
  static const int32_t origin[3] = {0, 0, 0};
  const VoxelLine line = voxel_line(o, d);
  VoxelWalk w = {.body = body, .line = &line, .limit = tmax, .takes = takes, .user = user};
  VoxelLevel root;
  if (!voxel_clip(v, &line, tmin, &w.t, &w.axis, &w.limit)) return false;
  voxel_enter(&root, &line, origin, 6, v->nodes_size, w.t, w.axis);
  if (w.t == tmin) { // it begins in this cell; what is there is not met
    int32_t cell[3];
    for (int k = 0; k < 3; k++) cell[k] = voxel_block_at(&line, k, 0, 0, v->size[k], w.t, w.axis);
    w.matter = voxel_matter(body, voxels_entry(v, cell[0], cell[1], cell[2]));
  }
  for (;;) {
    const int32_t base[3] = {64 * root.c[0], 64 * root.c[1], 64 * root.c[2]};
    const VoxelNode *n =
        v->nodes[root.c[0] + (size_t)v->nodes_size[0] * ((size_t)root.c[1] + (size_t)v->nodes_size[1] * (size_t)root.c[2])];
    if (n) {
      const VoxelEnd end = voxel_walk_node(&w, n, base);
      if (end != VOXEL_GOES_ON) return end == VOXEL_TAKEN;
    } else if (voxel_meet_block(&w, 0, base, 6)) {
      return true;
    }
    if (!voxel_advance(&w, &root)) return false;
    if (voxel_step(&root, &line, w.axis, 6, v->nodes_size)) continue;
    // Out of the grid, which is empty.
    if (!w.matter) return false;
    int32_t cell[3];
    const int32_t last[3] = {64 * root.c[0], 64 * root.c[1], 64 * root.c[2]};
    voxel_cell_in(&w, last, 6, cell);
    return voxel_meet(&w, 0, cell);
  }
}

// Where on a face a crossing is, 0 to 1: u runs to the right and v up as one looks at the face, and up is y on the four
// sides, -z on the top and z below.
static inline Vec2 voxel_face_uv(const VoxelCrossing *at, const float o[3], const float d[3])
{
  float f[3];
  for (int k = 0; k < 3; k++) f[k] = clamp_f(o[k] + at->t * d[k] - (float)at->cell[k], 0, 1);
  switch (at->face) {
  case 0: return (Vec2){f[2], f[1]};
  case 1: return (Vec2){1 - f[2], f[1]};
  case 2: return (Vec2){f[0], f[2]};
  case 3: return (Vec2){f[0], 1 - f[2]};
  case 4: return (Vec2){1 - f[0], f[1]};
  default: return (Vec2){f[0], f[1]};
  }
}

// A hit's primitive: the face and the entry of the cell.
static inline uint32_t voxel_prim(const Voxels *v, const VoxelCrossing *at)
{
  return at->face | voxels_entry(v, at->cell[0], at->cell[1], at->cell[2]) << 3;
}

#endif
