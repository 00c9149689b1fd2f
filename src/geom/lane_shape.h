// Lane shapes: simple shapes against many rays at once, a ray a lane, in floats. solid.h and sphere.h give a crossing to
// the last bits of a double, one ray by one; a picture needs far less, if only a ray that leaves a surface does not meet
// it again at once. Two things see to that:
//
//   - roots are taken from numbers that do not cancel: the discriminant at the place of the ray nearest to the shape's
//     middle, where it is small, and the constant term at the ray's origin, whose sign says on which side that lies
//     (Haines et al., "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems 2019, chapter 7);
//   - points are drawn onto the surface, and `error` is LANE_ULPS of all numbers that meet in a test.
//
//   ball       a sphere in the world            flat      plane, or a piece of one: triangle, quad, disk
//   round      solid.h's, in a space of its own: cylinders, cones, ellipsoids
//
// Directions are of unit length. A box about a shape is a ball here, so that it asks for no reciprocals.

#ifndef RAYFOLD_GEOM_LANE_SHAPE_H
#define RAYFOLD_GEOM_LANE_SHAPE_H

#include "base/err.h"
#include "base/wide3.h"

typedef enum LaneKind { LANE_BALL, LANE_PLANE, LANE_TRIANGLE, LANE_QUAD, LANE_DISK, LANE_ROUND } LaneKind;

typedef struct LaneShape {
  uint8_t kind; // LaneKind
  uint8_t mask; // RayMask bits of the rays that see it
  bool is_closed; // it has an inside
  uint32_t instance;
  float reach;  // metres: how large the numbers of its tests get, less the ray's own
  Vec3 center;  // of a ball, and of what bounds a piece or a round
  float radius; // likewise; infinite: nothing does
  // Of a plane and its pieces: n.p + n0 = 0 with n of unit length; u.p + u0 and v.p + v0 say where on it, in a triangle's
  // weights, or -1..1 over a quad or a disk's square, or metres.
  Vec3 n, u, v;
  float n0, u0, v0;
  // Of a round.
  Frame world_from_object, object_from_world;
  float bulge, round_radius, slope, low, high;
} LaneShape;

// How far off a surface its points may lie, in units of the last place of reach and coordinates. The tests lose about
// four, going into a round's own space as many again (surface_place counts the same); twice that, since rays that come
// back to their own surface are seen and ones that start a little higher are not.
#define LANE_ULPS 16

// Where rays cross a shape: the stretch of the line within it, or a piece's one crossing as both ends. An end that is
// not there is infinite, ahead and behind.
typedef struct LaneSpan {
  wx from, to;
  unsigned from_low, from_high, to_low, to_high; // lanes where an end is on a flat cap
} LaneSpan;

static inline LaneSpan lane_nowhere(void) { return (LaneSpan){.from = wx_set(INFINITY), .to = wx_set(-INFINITY)}; }

static inline LaneSpan lane_ball_span(const LaneShape *s, Wide3 o, Wide3 d)
{
  const Wide3 f = w3_sub(w3_of(s->center), o);
  const wx b = w3_dot(f, d);
  const Wide3 l = w3_sub(f, w3_scale(d, b));
  const wx rest = s->radius * s->radius - w3_dot(l, l);
  const unsigned met = wx_le(wx_set(0), rest);
  if (!met) return lane_nowhere();
  const wx q = b + wx_signed(wx_sqrt(wx_max(rest, wx_set(0))), b), c = w3_dot(f, f) - s->radius * s->radius, t = c / q;
  LaneSpan at = lane_nowhere();
  at.from = wx_choose(met, wx_min(t, q), at.from);
  at.to = wx_choose(met, wx_max(t, q), at.to);
  return at;
}

// Does the line come near enough to be tested, and not only behind its origin?
static inline unsigned lane_near(const LaneShape *s, Wide3 o, Wide3 d)
{
  const Wide3 f = w3_sub(w3_of(s->center), o);
  const wx b = w3_dot(f, d);
  const Wide3 l = w3_sub(f, w3_scale(d, b));
  return wx_le(w3_dot(l, l), wx_set(s->radius * s->radius)) & wx_le(wx_set(-s->radius), b);
}

// In object space, of a line whose direction need not be of unit length.
static inline LaneSpan lane_round_side(const LaneShape *s, Wide3 o, Wide3 d)
{
  const wx along = d.x * d.x + d.z * d.z, all = along + d.y * d.y, zero = wx_set(0);
  // The nearest place to the origin; to the axis of what is the same at every height.
  const bool to_axis = s->bulge == 0 && s->slope == 0;
  const wx length = to_axis ? wx_choose(wx_lt(zero, along), along, wx_set(1)) : all;
  const wx shift = -(o.x * d.x + o.z * d.z + (to_axis ? zero : o.y * d.y)) / length;
  const Wide3 near = w3_add(o, w3_scale(d, shift));
  const wx grow = s->slope * d.y, near_radius = s->round_radius + s->slope * near.y;
  const wx a = along + s->bulge * (d.y * d.y) - grow * grow;
  const wx near_b = near.x * d.x + near.z * d.z + s->bulge * (near.y * d.y) - near_radius * grow;
  const wx near_c = near.x * near.x + near.z * near.z + s->bulge * (near.y * near.y) - near_radius * near_radius;
  const wx rest = near_b * near_b - a * near_c;
  const unsigned met = wx_le(zero, rest);
  LaneSpan at = lane_nowhere();
  if (!met) return at;
  const wx radius = s->round_radius + s->slope * o.y;
  const wx b = o.x * d.x + o.z * d.z + s->bulge * (o.y * d.y) - radius * grow;
  const wx c = o.x * o.x + o.z * o.z + s->bulge * (o.y * o.y) - radius * radius;
  const wx q = -(b + wx_signed(wx_sqrt(wx_max(rest, zero)), b)), t0 = q / a, t1 = c / q;
  const wx first = wx_min(t0, t1), last = wx_max(t0, t1);
  // Where a line goes along a cone, a < 0, it is inside both halves; that with a positive radius is meant.
  const unsigned is_across = wx_le(zero, a), grows = wx_lt(zero, grow);
  wx from = wx_choose(is_across, first, wx_choose(grows, last, wx_set(-INFINITY)));
  wx to = wx_choose(is_across, last, wx_choose(grows, wx_set(INFINITY), first));
  const unsigned beside = wx_eq(q, zero); // a cylinder's axis, or a cone's tip: all or nothing
  const unsigned inside = beside & wx_lt(c, zero);
  from = wx_choose(beside, wx_choose(inside, wx_set(-INFINITY), wx_set(INFINITY)), from);
  to = wx_choose(beside, wx_choose(inside, wx_set(INFINITY), wx_set(-INFINITY)), to);
  at.from = wx_choose(met, from, at.from);
  at.to = wx_choose(met, to, at.to);
  return at;
}

static inline LaneSpan lane_round_span(const LaneShape *s, Wide3 world_o, Wide3 world_d)
{
  const Wide3 o = w3_point(&s->object_from_world, world_o), d = w3_vector(&s->object_from_world, world_d);
  LaneSpan at = lane_round_side(s, o, d);
  if (s->low == -INFINITY && s->high == INFINITY) return at;
  const wx inv = 1 / d.y, t_low = (s->low - o.y) * inv, t_high = (s->high - o.y) * inv;
  const unsigned down = wx_lt(d.y, wx_set(0));
  const wx near = wx_choose(down, t_high, t_low), far = wx_choose(down, t_low, t_high);
  if (s->is_closed) {
    const unsigned enters = wx_lt(at.from, near), leaves = wx_lt(far, at.to);
    at.from = wx_choose(enters, near, at.from);
    at.to = wx_choose(leaves, far, at.to);
    at.from_high = enters & down;
    at.from_low = enters & ~down;
    at.to_low = leaves & down;
    at.to_high = leaves & ~down;
    const unsigned is_gone = ~wx_lt(at.from, at.to);
    at.from = wx_choose(is_gone, wx_set(INFINITY), at.from);
    at.to = wx_choose(is_gone, wx_set(-INFINITY), at.to);
    return at;
  }
  const unsigned has_from = wx_le(near, at.from) & wx_le(at.from, far), has_to = wx_le(near, at.to) & wx_le(at.to, far);
  at.from = wx_choose(has_from, at.from, wx_set(-INFINITY));
  at.to = wx_choose(has_to, at.to, wx_set(INFINITY));
  return at;
}

static inline unsigned lane_piece_holds(const LaneShape *s, Wide3 p)
{
  const wx u = w3_dot(p, w3_of(s->u)) + s->u0, v = w3_dot(p, w3_of(s->v)) + s->v0, zero = wx_set(0), one = wx_set(1);
  switch ((LaneKind)s->kind) {
  case LANE_TRIANGLE: return wx_le(zero, u) & wx_le(zero, v) & wx_le(u + v, one);
  case LANE_QUAD: return wx_le(wx_abs(u), one) & wx_le(wx_abs(v), one);
  case LANE_DISK: return wx_le(u * u + v * v, one);
  case LANE_PLANE:
  case LANE_BALL:
  case LANE_ROUND: break;
  }
  return WIDEST_BITS;
}

static inline LaneSpan lane_flat_span(const LaneShape *s, Wide3 o, Wide3 d)
{
  const Wide3 n = w3_of(s->n);
  const wx t = -(w3_dot(o, n) + s->n0) / w3_dot(d, n);
  unsigned met = wx_lt(wx_abs(t), wx_set(INFINITY));
  if (s->kind != LANE_PLANE) met &= lane_piece_holds(s, w3_add(o, w3_scale(d, t)));
  LaneSpan at = lane_nowhere();
  at.from = at.to = wx_choose(met, t, wx_set(-INFINITY));
  return at;
}

static inline LaneSpan lane_shape_span(const LaneShape *s, Wide3 o, Wide3 d)
{
  switch ((LaneKind)s->kind) {
  case LANE_BALL: return lane_ball_span(s, o, d);
  case LANE_PLANE:
  case LANE_TRIANGLE:
  case LANE_QUAD:
  case LANE_DISK: return lane_flat_span(s, o, d);
  case LANE_ROUND: return lane_round_span(s, o, d);
  }
  unreachable();
}

// The first crossing ahead, and the part of the skin (solid.h) it is on: 0, or 1 and 2 for the caps.
typedef struct LaneCrossing {
  wx t; // infinite: none
  unsigned low, high;
} LaneCrossing;

static inline LaneCrossing lane_first(const LaneSpan *at)
{
  const wx zero = wx_set(0);
  const unsigned is_from = wx_lt(zero, at->from), is_to = wx_lt(zero, at->to);
  return (LaneCrossing){wx_choose(is_from, at->from, wx_choose(is_to, at->to, wx_set(INFINITY))),
                        (is_from & at->from_low) | (~is_from & at->to_low), (is_from & at->from_high) | (~is_from & at->to_high)};
}

// Points and outward normals of unit length where lines meet the shape.
static inline void lane_shape_surface(const LaneShape *s, Wide3 o, Wide3 d, wx t, unsigned low, unsigned high, Wide3 *p,
                                      Wide3 *n)
{
  const Wide3 at = w3_add(o, w3_scale(d, t));
  if (s->kind == LANE_BALL) {
    *n = w3_normalize(w3_sub(at, w3_of(s->center)));
    *p = w3_add(w3_of(s->center), w3_scale(*n, wx_set(s->radius)));
    return;
  }
  if (s->kind != LANE_ROUND) {
    *n = w3_of(s->n);
    *p = w3_sub(at, w3_scale(*n, w3_dot(at, *n) + s->n0));
    return;
  }
  Wide3 own = w3_point(&s->object_from_world, at);
  const wx across = wx_sqrt(own.x * own.x + own.z * own.z + s->bulge * (own.y * own.y));
  const wx radius = s->round_radius + s->slope * own.y, side = wx_choose(wx_lt(wx_set(0), across), radius / across, wx_set(1));
  const unsigned on_cap = low | high;
  const wx cap = wx_choose(low, wx_set(s->low), wx_set(s->high)), zero = wx_set(0);
  const Wide3 drawn = w3(own.x * side, s->bulge > 0 ? own.y * side : own.y, own.z * side);
  own = w3_choose(on_cap, w3(own.x, cap, own.z), drawn);
  // A cone's tip has no normal of its own; it takes the axis.
  const wx up = s->bulge * own.y - s->slope * (s->round_radius + s->slope * own.y);
  const Wide3 slant = w3(own.x, up, own.z), axis = w3(zero, wx_choose(low, wx_set(-1), wx_set(1)), zero);
  const unsigned has_none = w3_is_zero(slant);
  const Wide3 outward = w3_choose(on_cap | has_none, axis, slant);
  *n = w3_normalize(w3_normal(&s->object_from_world, outward));
  *p = w3_point(&s->world_from_object, own);
}

// How far its points may lie off it, in metres.
static inline wx lane_error(const LaneShape *s, Wide3 p)
{
  return (wx_abs(p.x) + wx_abs(p.y) + wx_abs(p.z) + s->reach) * (LANE_ULPS * 0x1p-24f);
}

#endif
