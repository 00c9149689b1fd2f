// Bins: boxes of references by the place of their centres along each axis, and the best plane between bins (Wald, "On
// fast construction of SAH-based bounding volume hierarchies", 2007). The three axes go side by side in vector lanes.
//
// Centres are kept doubled, lo + hi. Where that overflows, or a box has no extent, an axis is of no use and its scale
// is 0; every reference then falls in bin 0.

#ifndef RAYFOLD_ACCEL_BUILD_BINS_H
#define RAYFOLD_ACCEL_BUILD_BINS_H

#include "accel/build.h"

enum { MOST_BINS = 32 };

typedef int32_t Int4 __attribute__((vector_size(16)));

typedef struct Bins {
  Bounds box[3][MOST_BINS];
  Int4 count[MOST_BINS]; // lane: axis
} Bins;

// How doubled centres map to bins: (center - lo) * scale, cut to [0, last].
typedef struct BinMap {
  Vec3 lo, hi, scale, last;
} BinMap;

typedef struct Split {
  int axis, bin; // left: bins below this one; axis -1: no plane found
  uint32_t left_count;
  Bounds box[2];
} Split;

// The fourth lane is cleared: primitives' numbers are denormal floats, and multiplying those may take 150 cycles.
static inline Vec3 ref_center(const BuildRef *r) { return (Vec3)((Int4)(r->lo + r->hi) & (Int4){-1, -1, -1, 0}); }

static inline int bin_count(const BinMap *m) { return (int)m->last[0] + 1; }

// Bins over the doubled centres from lo to hi, fewer when there are few references to put in.
static inline BinMap bin_map(Vec3 lo, Vec3 hi, size_t count)
{
  const int bins = count < 256 ? 16 : MOST_BINS;
  lo[3] = hi[3] = 0; // of boxes: a primitive's number, see ref_center
  BinMap m = {lo, hi, v3_all(0), v3_all((float)(bins - 1))};
  for (int k = 0; k < 3; k++) {
    const float scale = (float)bins / (hi[k] - lo[k]);
    if (hi[k] > lo[k] && isfinite(hi[k] - lo[k]) && isfinite(scale)) m.scale[k] = scale;
  }
  return m;
}

// The map for one side of a split: centres lie in the doubled box and on their side of the plane.
static inline BinMap bin_map_below(const BinMap *m, const Split *s, int side, size_t count)
{
  Vec3 lo = lanes_max(m->lo, 2 * s->box[side].lo), hi = lanes_min(m->hi, 2 * s->box[side].hi);
  const float plane = m->lo[s->axis] + (float)s->bin / m->scale[s->axis];
  if (side) lo[s->axis] = max_f(lo[s->axis], plane);
  else hi[s->axis] = min_f(hi[s->axis], plane);
  return bin_map(lo, hi, count);
}

static inline Int4 bins_of(const BinMap *m, Vec3 center)
{
  const Vec3 x = lanes_max((center - m->lo) * m->scale, v3_all(0)); // NaN becomes 0
  return __builtin_convertvector(lanes_min(x, m->last), Int4);
}

static inline void bins_clear(Bins *b, int count)
{
  for (int i = 0; i < count; i++) {
    for (int k = 0; k < 3; k++) b->box[k][i] = bounds_empty();
    b->count[i] = (Int4){0};
  }
}

static inline void bins_add(Bins *b, const BinMap *m, const BuildRef *r)
{
  const Int4 bin = bins_of(m, ref_center(r));
#pragma GCC unroll 3
  for (int k = 0; k < 3; k++) {
    bounds_add(&b->box[k][bin[k]], r);
    b->count[bin[k]][k]++;
  }
}

static inline void bins_merge(Bins *b, const Bins *other, int count)
{
  for (int i = 0; i < count; i++) {
    for (int k = 0; k < 3; k++) bounds_add(&b->box[k][i], &other->box[k][i]);
    b->count[i] += other->count[i];
  }
}

// Half the surfaces of three boxes, scaled by a factor squared, in lanes. An empty box gives infinity or NaN.
static inline Vec3 three_areas(const Bounds b[3], float scale)
{
  const Vec3 d0 = b[0].hi - b[0].lo, d1 = b[1].hi - b[1].lo, d2 = b[2].hi - b[2].lo;
  const Vec3 xy01 = __builtin_shufflevector(d0, d1, 0, 4, 1, 5), z01 = __builtin_shufflevector(d0, d1, 2, 6, 2, 6);
  const Vec3 x = __builtin_shufflevector(xy01, d2, 0, 1, 4, 4) * scale;
  const Vec3 y = __builtin_shufflevector(xy01, d2, 2, 3, 5, 5) * scale;
  const Vec3 z = __builtin_shufflevector(z01, d2, 0, 1, 6, 6) * scale;
  return x * (y + z) + y * z;
}

// One over the longest side, so that areas neither overflow nor vanish; 0 when that cannot be.
static inline float box_scale(const Bounds *b)
{
  const float s = 1 / v3_max_lane(b->hi - b->lo);
  return isfinite(s) ? s : 0;
}

static inline Vec3 select_lanes(Int4 mask, Vec3 a, Vec3 b) { return (Vec3)((mask & (Int4)a) | (~mask & (Int4)b)); }

// What references cost, by area: leaves are tested a block at a time, so their blocks; and a little for each, or blocks
// are filled with what does not belong together. Weights of 0, 0.05, 0.15, 0.3 gave 4.8, 4.7, 3.7, 3.8 leaves a
// camera's ray in a furnished hall, and 49, 51, 54, 57 bytes a triangle. No references: infinity.
#define PRIM_COST 0.15f

static inline Vec3 side_costs(const Build *b, const Bounds box[3], Int4 count, float scale)
{
  const Int4 blocks = (count + (int)(b->leaf_size - 1)) >> __builtin_ctz(b->leaf_size);
  const Vec3 weight = __builtin_convertvector(blocks, Vec3) + PRIM_COST * __builtin_convertvector(count, Vec3);
  const Vec3 cost = three_areas(box, scale) * weight;
  return select_lanes(count > 0, cost, v3_all(INFINITY));
}

// The best plane between bins, and what lies on either side of it.
static inline Split bins_split(const Build *b, const Bins *bins, const BinMap *m, const Bounds *all)
{
  const int n = bin_count(m);
  const float scale = box_scale(all);
  Vec3 right[MOST_BINS];
  Bounds box[3] = {bounds_empty(), bounds_empty(), bounds_empty()};
  Int4 count = {0};
  for (int i = n - 1; i > 0; i--) {
    for (int k = 0; k < 3; k++) bounds_add(&box[k], &bins->box[k][i]);
    count += bins->count[i];
    right[i] = side_costs(b, box, count, scale);
  }
  Vec3 best = v3_all(INFINITY);
  Int4 at = {0};
  for (int k = 0; k < 3; k++) box[k] = bounds_empty();
  count = (Int4){0};
  for (int i = 1; i < n; i++) {
    for (int k = 0; k < 3; k++) bounds_add(&box[k], &bins->box[k][i - 1]);
    count += bins->count[i - 1];
    const Vec3 cost = side_costs(b, box, count, scale) + right[i];
    const Int4 is_less = cost < best;
    best = select_lanes(is_less, cost, best);
    at = (is_less & i) | (~is_less & at);
  }
  Split s = {.axis = -1};
  float cost = INFINITY;
  for (int k = 0; k < 3; k++) {
    if (!(best[k] < cost) || m->scale[k] <= 0) continue;
    cost = best[k];
    s.axis = k;
    s.bin = at[k];
  }
  if (s.axis < 0) return s;
  s.box[0] = s.box[1] = bounds_empty();
  for (int i = 0; i < n; i++) {
    bounds_add(&s.box[i >= s.bin], &bins->box[s.axis][i]);
    if (i < s.bin) s.left_count += (uint32_t)bins->count[i][s.axis];
  }
  return s;
}

#endif
