// RaySet: up to 64 rays in one space, twice: one after another for a ray against many boxes or triangles, and in
// lanes for many rays against one box or triangle. Where all of them point into the same octant and along the same
// axis they are coherent, and only then the lanes may be used: all rays then read the same rows of a box and shear
// along the same axis. Every test in lanes does the same arithmetic as the test of a single ray, and gives its bits.

#ifndef RAYFOLD_ACCEL_RAYSET_H
#define RAYFOLD_ACCEL_RAYSET_H

#include "accel/step.h"

#include <stddef.h>

enum { SET_SIZE = 64, SET_GROUPS = SET_SIZE / WIDEST };

typedef struct RaySet {
  float o[3][SET_SIZE], tmin[SET_SIZE], d[3][SET_SIZE], tmax[SET_SIZE]; // in the order of PackedRay
  float inv[3][SET_SIZE], inv_far[3][SET_SIZE], sx[SET_SIZE], sy[SET_SIZE], sz[SET_SIZE];
  bool is_coherent;
  bool is_pencil;                               // coherent, and all from one origin: the intervals are tight
  uint32_t near_row[3], far_row[3], kx, ky, kz; // of coherent rays
  // The ends of what the rays have, for a test of all at once: where a near (far) plane is seen from at best, and the
  // reciprocals from least to most.
  float near_from[3], far_from[3], inv_ends[2][3], far_ends[2][3], least_tmin;
  uint64_t made; // which of the next there are
  TreeRay ray[SET_SIZE];
} __attribute__((aligned(64))) RaySet;
_Static_assert(offsetof(RaySet, tmax) == 7 * SET_SIZE * sizeof(float), "eight rows without a gap");

// The ray by itself; made when first asked for.
static inline const TreeRay *rayset_ray(RaySet *s, int i)
{
  if (!(s->made >> i & 1)) {
    s->made |= 1ull << i;
    (void)tree_ray_init(&s->ray[i], v3(s->o[0][i], s->o[1][i], s->o[2][i]),
                        v3(s->d[0][i], s->d[1][i], s->d[2][i]), s->tmin[i]);
  }
  return &s->ray[i];
}

static inline void rayset_put(RaySet *s, int i, Vec3 o, Vec3 d, float tmin)
{
  for (int k = 0; k < 3; k++) {
    s->o[k][i] = o[k];
    s->d[k][i] = d[k];
  }
  s->tmin[i] = tmin;
}

static inline void rayset_load(RaySet *s, const PackedRay *rays, int count)
{
  PackedRay rest[8];
  float *columns = (float *)(void *)s; // o, tmin, d and tmax are one after another
  for (int i = 0; i < count; i += 8) {
    const PackedRay *eight = rays + i;
    if (count - i < 8) eight = memcpy(rest, eight, (size_t)(count - i) * sizeof *rays);
    wide_transpose8((const float *)(const void *)eight, columns + i, SET_SIZE);
  }
}

// Bits of lanes where x is finite, so that x - x is 0 and not NaN.
static inline unsigned lanes_finite(wx x)
{
  return wx_eq(x - x, wx_set(0));
}

// One group's reciprocals and shears, as tree_ray_init has them. Returns the lanes that can hit anything, and adds
// to what is known of all: bit 2k of *seen says that a ray goes forward along axis k, bit 2k + 1 backward, bits 6 to 8
// the longest axes, bit 9 that a reciprocal is infinite.
static inline unsigned rayset_ready_group(RaySet *s, int g, unsigned lanes, unsigned *seen)
{
  const int at = g * WIDEST;
  const wx none = wx_set(0);
  wx d[3], size[3];
  unsigned good = lanes;
  for (int k = 0; k < 3; k++) {
    d[k] = wx_load(s->d[k] + at);
    size[k] = wx_max(d[k], -d[k]);
    const wx o = wx_load(s->o[k] + at) + none; // -0 becomes 0
    wx_store(s->o[k] + at, o);
    good &= lanes_finite(d[k]) & lanes_finite(o);
    const unsigned tiny = wx_lt(size[k], wx_set(FLT_MIN));
    if (tiny & lanes) *seen |= 1 << 9;
    d[k] = wx_choose(tiny, d[k] * none, d[k]); // zero of the same sign
    wx_store(s->d[k] + at, d[k]);
    const wx inv = wx_set(1) / d[k];
    wx_store(s->inv[k] + at, inv);
    wx_store(s->inv_far[k] + at, inv * FAR_SLACK);
    const unsigned forward = wx_lt(none, d[k]) & lanes, backward = wx_lt(d[k], none) & lanes;
    *seen |= (unsigned)(forward != 0) << 2 * k | (unsigned)(backward != 0) << (2 * k + 1);
  }
  const wx tmin = wx_load(s->tmin + at);
  wx_store(s->tmin + at, wx_max(tmin, none));
  const unsigned xy = wx_lt(size[1], size[0]), xz = wx_lt(size[2], size[0]), yz = wx_lt(size[2], size[1]);
  const unsigned along[3] = {xy & xz, ~xy & yz, (xy & ~xz) | (~xy & ~yz)};
  const wx longest = wx_max(wx_max(size[0], size[1]), size[2]);
  good &= wx_le(wx_set(FLT_MIN), longest) & wx_lt(longest, wx_set(MOST_DIRECTION));
  for (uint32_t k = 0; k < 3; k++) {
    if (!(along[k] & lanes)) continue;
    *seen |= 1u << (6 + k);
    const uint32_t kx = k == 2 ? 0 : k + 1, ky = kx == 2 ? 0 : kx + 1;
    wx_store(s->sx + at, d[kx] / d[k]);
    wx_store(s->sy + at, d[ky] / d[k]);
    wx_store(s->sz + at, wx_load(s->inv[k] + at));
    s->kx = kx;
    s->ky = ky;
    s->kz = k;
  }
  return good;
}

static inline float lanes_least(const float *x, int groups)
{
  wx least = wx_load(x);
  for (int g = 1; g < groups; g++) least = wx_min(wx_load(x + g * WIDEST), least);
  return wx_least(least);
}

static inline float lanes_most(const float *x, int groups)
{
  wx most = wx_load(x);
  for (int g = 1; g < groups; g++) most = wx_max(wx_load(x + g * WIDEST), most);
  return wx_most(most);
}

static inline void rayset_find_ends(RaySet *s, int groups)
{
  for (int k = 0; k < 3; k++) {
    const float low = lanes_least(s->o[k], groups), high = lanes_most(s->o[k], groups);
    const bool is_backward = s->inv[k][0] < 0;
    s->near_from[k] = is_backward ? low : high;
    s->far_from[k] = is_backward ? high : low;
    s->inv_ends[0][k] = lanes_least(s->inv[k], groups);
    s->inv_ends[1][k] = lanes_most(s->inv[k], groups);
    s->far_ends[0][k] = s->inv_ends[0][k] * FAR_SLACK; // rounding is monotone
    s->far_ends[1][k] = s->inv_ends[1][k] * FAR_SLACK;
    s->near_row[k] = 2 * (uint32_t)k + is_backward;
    s->far_row[k] = 2 * (uint32_t)k + 1 - is_backward;
  }
  s->least_tmin = lanes_least(s->tmin, groups);
  s->is_pencil = true;
  for (int k = 0; k < 3; k++) s->is_pencil &= s->near_from[k] == s->far_from[k];
}

// After the first count rays were put: makes them ready and returns those that can hit anything. With fewer than fill
// the last group the lanes left over are copies of the first ray.
static inline uint64_t rayset_ready(RaySet *s, int count)
{
  uint64_t good = 0;
  unsigned seen = 0;
  const int groups = (count + WIDEST - 1) / WIDEST;
  for (int i = count; i < groups * WIDEST; i++) {
    for (int k = 0; k < 3; k++) {
      s->o[k][i] = s->o[k][0];
      s->d[k][i] = s->d[k][0];
    }
    s->tmin[i] = s->tmin[0];
  }
  for (int g = 0; g < groups; g++) {
    const int left = count - g * WIDEST;
    const unsigned lanes = left >= WIDEST ? WIDEST_BITS : (1u << left) - 1;
    good |= (uint64_t)rayset_ready_group(s, g, lanes, &seen) << g * WIDEST;
  }
  const unsigned axes = seen >> 6 & 7;
  s->is_coherent = WIDEST > 1 && good == (count == 64 ? ~0ull : (1ull << count) - 1) && !(seen >> 9) &&
                   !(axes & (axes - 1)) && !((seen & seen >> 1) & 0x15);
  s->made = 0;
  s->is_pencil = false;
  if (s->is_coherent) rayset_find_ends(s, groups);
  return good;
}

// --- many coherent rays at once ---------------------------------------------------------------------

// By one axis, what is left of eight boxes' intervals: to_near and to_far are the ways to their planes.
static inline void rayset_cut(const RaySet *s, uint32_t axis, wf to_near, wf to_far, wf *t0, wf *t1)
{
  *t0 = wf_max(wf_min(to_near * s->inv_ends[0][axis], to_near * s->inv_ends[1][axis]), *t0);
  *t1 = wf_min(wf_max(to_far * s->far_ends[0][axis], to_far * s->far_ends[1][axis]), *t1);
}

// Which children's boxes any of the rays may meet, and a bound from below to where: interval arithmetic. Products are
// monotone in both factors, rounding included, so no ray's own test can pass where this one does not.
static inline unsigned rayset_node(const RaySet *s, const Node8 *n, float tmax, Near8 *near)
{
  unsigned bits = 0;
  for (int g = 0; g < 8; g += WIDE) {
    wf t0 = wf_set(s->least_tmin), t1 = wf_set(tmax);
    for (uint32_t k = 0; k < 3; k++) {
      const wf to_near = wf_load(n->box[s->near_row[k]] + g) - s->near_from[k];
      const wf to_far = wf_load(n->box[s->far_row[k]] + g) - s->far_from[k];
      rayset_cut(s, k, to_near, to_far, &t0, &t1);
    }
    near->t[g / WIDE] = t0;
    bits |= wf_le(t0, t1) << g;
  }
  return bits;
}

// Which of a group's rays meet a box within their tmax, and where.
static inline unsigned rayset_box(const RaySet *s, int g, const float box[6], wx tmax, wx *near)
{
  const int at = g * WIDEST;
  wx t0 = wx_load(s->tmin + at), t1 = tmax;
  for (int k = 0; k < 3; k++) {
    const wx o = wx_load(s->o[k] + at);
    t0 = wx_max((wx_set(box[s->near_row[k]]) - o) * wx_load(s->inv[k] + at), t0);
    t1 = wx_min((wx_set(box[s->far_row[k]]) - o) * wx_load(s->inv_far[k] + at), t1);
  }
  *near = t0;
  return wx_le(t0, t1);
}

// The same for rays that go anywhere.
static inline unsigned rayset_any_box(const RaySet *s, int g, const float box[6], wx tmax, wx *near)
{
  const int at = g * WIDEST;
  wx t0 = wx_load(s->tmin + at), t1 = tmax;
  for (int k = 0; k < 3; k++) {
    const wx o = wx_load(s->o[k] + at), inv = wx_load(s->inv[k] + at);
    const wx lo = wx_set(box[2 * k]), hi = wx_set(box[2 * k + 1]);
    const unsigned backward = wx_lt(inv, wx_set(0));
    t0 = wx_max((wx_choose(backward, hi, lo) - o) * inv, t0);
    t1 = wx_min((wx_choose(backward, lo, hi) - o) * wx_load(s->inv_far[k] + at), t1);
  }
  *near = t0;
  return wx_le(t0, t1);
}

// A block of triangles as coherent rays see it: axes in the order of the shear, and from their origin if they share it.
typedef struct SeenBlock {
  float v[3][3][8];
} SeenBlock;

static inline void rayset_see(const RaySet *s, const Tri8 *b, SeenBlock *seen)
{
  const uint32_t axes[3] = {s->kx, s->ky, s->kz};
  for (int c = 0; c < 3; c++)
    for (int k = 0; k < 3; k++)
      for (int g = 0; g < 8; g += WIDE) {
        const wf v = wf_load(b->v[c][axes[k]] + g);
        wf_store(seen->v[c][k] + g, s->is_pencil ? v - s->near_from[axes[k]] : v);
      }
}

// Which of the block's triangles have boxes that any ray of a pencil may meet: rayset_node's test.
static inline unsigned rayset_block(const RaySet *s, const SeenBlock *b, float tmax)
{
  const uint32_t axes[3] = {s->kx, s->ky, s->kz};
  unsigned bits = 0;
  for (int g = 0; g < 8; g += WIDE) {
    wf t0 = wf_set(s->least_tmin), t1 = wf_set(tmax);
    for (int k = 0; k < 3; k++) {
      const wf v0 = wf_load(b->v[0][k] + g), v1 = wf_load(b->v[1][k] + g), v2 = wf_load(b->v[2][k] + g);
      const wf lo = wf_min(wf_min(v0, v1), v2), hi = wf_max(wf_max(v0, v1), v2);
      const bool is_backward = s->inv_ends[0][axes[k]] < 0;
      rayset_cut(s, axes[k], is_backward ? hi : lo, is_backward ? lo : hi, &t0, &t1);
    }
    bits |= wf_le(t0, t1) << g;
  }
  return bits;
}

// Edge functions and distances of a group's rays and one triangle.
typedef struct LaneHits {
  wx t, e[3], z[3];
} LaneHits;

static inline void rayset_exact_edges(LaneHits *h, const wx x[3], const wx y[3], unsigned zero)
{
  float xs[3][WIDEST], ys[3][WIDEST], e[3][WIDEST];
  for (int i = 0; i < 3; i++) {
    wx_store(xs[i], x[i]);
    wx_store(ys[i], y[i]);
    wx_store(e[i], h->e[i]);
  }
  for (; zero; zero &= zero - 1) {
    const int i = __builtin_ctz(zero);
    e[0][i] = exact_edge(xs[2][i], ys[1][i], ys[2][i], xs[1][i]);
    e[1][i] = exact_edge(xs[0][i], ys[2][i], ys[0][i], xs[2][i]);
    e[2][i] = exact_edge(xs[1][i], ys[0][i], ys[1][i], xs[0][i]);
  }
  for (int i = 0; i < 3; i++) h->e[i] = wx_load(e[i]);
}

// Which of a group's rays pass through triangle i of the block with tmin < t <= tmax, as tri8_hit has it.
static inline unsigned rayset_triangle(const RaySet *s, int g, const SeenBlock *seen, int i, wx tmax,
                                       LaneHits *h)
{
  const int at = g * WIDEST;
  const wx none = wx_set(0), sx = wx_load(s->sx + at), sy = wx_load(s->sy + at), sz = wx_load(s->sz + at);
  wx x[3], y[3];
  for (int c = 0; c < 3; c++) {
    x[c] = wx_set(seen->v[c][0][i]);
    y[c] = wx_set(seen->v[c][1][i]);
    h->z[c] = wx_set(seen->v[c][2][i]);
    if (!s->is_pencil) {
      x[c] -= wx_load(s->o[s->kx] + at);
      y[c] -= wx_load(s->o[s->ky] + at);
      h->z[c] -= wx_load(s->o[s->kz] + at);
    }
    x[c] -= sx * h->z[c];
    y[c] -= sy * h->z[c];
  }
  h->e[0] = x[2] * y[1] - y[2] * x[1];
  h->e[1] = x[0] * y[2] - y[0] * x[2];
  h->e[2] = x[1] * y[0] - y[1] * x[0];
  const wx least = wx_min(wx_min(h->e[0], h->e[1]), h->e[2]),
           most = wx_max(wx_max(h->e[0], h->e[1]), h->e[2]);
  unsigned inside = wx_le(none, least) | wx_le(most, none);
  if (!inside) return 0;
  const unsigned zero = wx_eq(least, none) | wx_eq(most, none);
  if (__builtin_expect(zero != 0, 0)) {
    rayset_exact_edges(h, x, y, zero);
    inside = (wx_le(none, h->e[0]) & wx_le(none, h->e[1]) & wx_le(none, h->e[2])) |
             (wx_le(h->e[0], none) & wx_le(h->e[1], none) & wx_le(h->e[2], none));
  }
  const wx det = h->e[0] + h->e[1] + h->e[2];
  h->t = (h->e[0] * h->z[0] + h->e[1] * h->z[1] + h->e[2] * h->z[2]) * sz / det;
  return inside & ~wx_eq(det, none) & wx_lt(wx_load(s->tmin + at), h->t) & wx_le(h->t, tmax);
}

// Which of a group's rays meet the boxes about their points of hit on triangle i, and where: tri8_point_near in lanes.
// *near is changed where they do.
static inline unsigned rayset_point(RaySet *s, int g, const Tri8 *b, int i, const LaneHits *h, unsigned asked,
                                    wx *near)
{
  const int at = g * WIDEST;
  const wx det = h->e[0] + h->e[1] + h->e[2], w[3] = {h->e[0] / det, h->e[1] / det, h->e[2] / det};
  float box[6], exact[WIDEST];
  tri8_box(b, i, box);
  const float slack = tri_slack(box);
  wx t0 = wx_load(s->tmin + at), t1 = wx_set(FLT_MAX);
  for (int k = 0; k < 3; k++) {
    const wx point = w[0] * b->v[0][k][i] + w[1] * b->v[1][k][i] + w[2] * b->v[2][k][i],
             o = wx_load(s->o[k] + at);
    const wx lo = wx_max(point - slack, wx_set(box[2 * k])),
             hi = wx_min(point + slack, wx_set(box[2 * k + 1]));
    const bool is_backward = s->near_row[k] & 1;
    t0 = wx_max(((is_backward ? hi : lo) - o) * wx_load(s->inv[k] + at), t0);
    t1 = wx_min(((is_backward ? lo : hi) - o) * wx_load(s->inv_far[k] + at), t1);
  }
  unsigned met = wx_le(t0, t1) & asked;
  *near = t0;
  if (__builtin_expect(met == asked, 1)) return met;
  wx_store(exact, t0);
  for (unsigned left = asked & ~met; left; left &= left - 1) {
    const int k = __builtin_ctz(left);
    exact[k] = tri8_exact_near(b, i, box, rayset_ray(s, at + k));
    met |= (unsigned)(exact[k] < INFINITY) << k;
  }
  *near = wx_load(exact);
  return met;
}

#endif
