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
  LANE_SHAPES = 32 // more are faster by the tree
};

typedef struct LaneSet {
  uint32_t count;
  LaneShape shapes[LANE_SHAPES]; // in the order of instances
} LaneSet;

// NULL without an error: the instances are not all of the kinds that lanes know, or too many. In the arena.
const LaneSet *lanes_build(const Accel *a, Arena *arena);

// --- hot ------------------------------------------------------------------------------------------------

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

// The nearest hits before hits->t on shapes that see the mask. Returns the shapes tested, times lanes.
static inline uint64_t lanes_closest(const LaneSet *set, RayMask mask, const LaneRays *r, LaneNearest *hits)
{
  uint64_t tested = 0;
  for (uint32_t i = 0; i < set->count; i++) {
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
