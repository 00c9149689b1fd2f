// Lanes: a world of few and simple shapes, asked by all rays of a packet at once without a tree. Packets have up to
// LANES rays as rows of floats; a group of as many as a register holds goes through all shapes, each behind a test with
// the ball about it. Answers are those of accel/batch.h but for the last bits: shapes are tested in floats
// (geom/lane_shape.h).
//
// What it cannot do (meshes, bodies, surfaces that are there in part) has no LaneSet: lanes_build says so, and whoever
// asks takes the trees.

#ifndef RAYFOLD_ACCEL_LANES_H
#define RAYFOLD_ACCEL_LANES_H

#include "accel/accel.h"
#include "base/arena.h"
#include "geom/lane_shape.h"

enum {
  LANES = 64,      // rays a packet
  LANE_SHAPES = 32, // more are faster by the tree
  LANE_FEW = 8      // so many are not held against a packet's cone: of 10 shapes that saves 10 %, of 7 it costs 3 %
};

typedef struct LaneSet {
  uint32_t count, endless; // endless: bits of those that no ball is about
  // The others' balls, in rows: a packet of rays is held against all of them at once.
  float ball[4][LANE_SHAPES]; // centre and radius; of endless ones, and past the last, a ball of no size at the origin
  LaneShape shapes[LANE_SHAPES]; // in the order of instances
} LaneSet;

// NULL without an error: the instances are not all of the kinds that lanes know, or too many. In the arena.
const LaneSet *lanes_build(const Accel *a, Arena *arena);

// --- hot ------------------------------------------------------------------------------------------------

static inline uint32_t lanes_all(const LaneSet *set) { return set->count == 32 ? UINT32_MAX : (1u << set->count) - 1; }

// What a packet of rays stays within: it starts no more than `radius` from the apex and goes nowhere that makes a larger
// angle with the axis, of unit length.
typedef struct LaneCone {
  Vec3 apex, axis;
  float radius, cosine;
} LaneCone;

// Shapes that rays within the cone may meet, and perhaps others. A ball R about a place at the distance L from the apex
// is met when its direction makes at most the cone's angle and asin((R + radius) / L) with the axis.
static inline uint32_t lanes_in_cone(const LaneSet *set, const LaneCone *c)
{
  if (!(c->cosine > 0.2f)) return UINT32_MAX; // in every direction, about
  const float cosine = c->cosine - 1e-4f, sine = sqrtf(max_f(1 - cosine * cosine, 0)); // the rounding of both
  uint32_t within = set->endless;
  for (uint32_t i = 0; i < set->count; i += WIDEST) {
    const Wide3 v = w3_sub(w3(wx_load(set->ball[0] + i), wx_load(set->ball[1] + i), wx_load(set->ball[2] + i)), w3_of(c->apex));
    const wx length2 = w3_dot(v, v), radius = wx_load(set->ball[3] + i) * 1.001f + c->radius, zero = wx_set(0);
    const wx leg = wx_sqrt(wx_max(length2 - radius * radius, zero));
    const unsigned is_inside = wx_le(length2, radius * radius);
    const unsigned is_met = wx_le(cosine * leg - sine * radius, w3_dot(v, w3_of(c->axis)) + 1e-5f * radius);
    within |= (uint32_t)(is_inside | is_met) << i;
  }
  return within;
}

// One group of rays: where they start and go to, and the lanes that count.
typedef struct LaneRays {
  Wide3 o, d;
  unsigned bits;
} LaneRays;

typedef struct LaneNearest {
  wx t; // starts at tmax; stays there where nothing is met
  unsigned met;
  wxu shape, part; // index into the set's shapes; of solid.h
} LaneNearest;

// The nearest hits before hits->t on those of the shapes in `which` that see the mask. Returns the shapes tested, times lanes.
static inline uint64_t lanes_closest(const LaneSet *set, uint32_t which, RayMask mask, const LaneRays *r, LaneNearest *hits)
{
  uint64_t tested = 0;
  which &= lanes_all(set);
  for (; which; which &= which - 1) {
    const uint32_t i = (uint32_t)__builtin_ctz(which);
    const LaneShape *s = &set->shapes[i];
    if (!(s->mask & mask)) continue;
    if (s->kind == LANE_ROUND && s->radius < INFINITY && !(lane_near(s, r->o, r->d) & r->bits)) continue;
    const LaneSpan span = lane_shape_span(s, r->o, r->d);
    const LaneCrossing c = lane_first(&span);
    const unsigned nearer = wx_lt(c.t, hits->t) & r->bits;
    tested++;
    if (!nearer) continue;
    hits->met |= nearer;
    hits->t = wx_choose(nearer, c.t, hits->t);
    hits->shape = wxu_choose(nearer, wxu_set(i), hits->shape);
    if (s->kind == LANE_ROUND)
      hits->part = wxu_choose(nearer, wxu_choose(c.low, wxu_set(1), wxu_choose(c.high, wxu_set(2), wxu_set(0))), hits->part);
    else
      hits->part = wxu_choose(nearer, wxu_set(0), hits->part);
  }
  return tested * WIDEST;
}

// Lanes that meet a shape in `which` before tmax.
static inline unsigned lanes_any(const LaneSet *set, uint32_t which, const LaneRays *r, wx tmax, uint64_t *tested)
{
  unsigned met = 0;
  for (; which && (r->bits & ~met); which &= which - 1) {
    const LaneShape *s = &set->shapes[__builtin_ctz(which)];
    if (s->kind == LANE_ROUND && s->radius < INFINITY && !(lane_near(s, r->o, r->d) & r->bits & ~met)) continue;
    const LaneSpan span = lane_shape_span(s, r->o, r->d);
    const LaneCrossing c = lane_first(&span);
    met |= wx_lt(c.t, tmax) & r->bits;
    *tested += WIDEST;
  }
  return met;
}

#endif
