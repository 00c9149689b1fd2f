// Transport: a ray goes through gates. It keeps nothing but where it is now: no stack of maps, and no offset from the
// gate it came out of, which it knows by its number instead.
//
// At a gate the whole line is mapped, its origin too, and tmin says from where on it counts:
//
//   o ----------> | gate           o' is where the line would have begun, had all of it lain in the new chart;
//        o' ......| ----------> x  t is the length of the whole way, and a map that is the identity changes no bit
//
// So t needs no sum, and a hit far away is as exact as it would be in one large flat scene.

#ifndef RAYFOLD_SPACE_TRANSPORT_H
#define RAYFOLD_SPACE_TRANSPORT_H

#include "space/gate.h"

enum { WORD_GATES = 4 }; // that a word can name
#define WORD_LOST UINT64_MAX // more than that were gone through

// What a ray has gone through since it began.
typedef struct Way {
  uint64_t word;   // the sides it went in at, 16 bits each, the first lowest: 1 + 2 * gate + side
  uint32_t cell;   // where it is
  uint32_t from;   // the gate it came out of, which a straight line does not meet again from the same side; NO_GATE
  float scale;     // lengths here of one where it began
  float passed;    // length before the ray's origin, in today's lengths: 0, unless someone moved the origin, as curved cells do
  uint16_t crossings;
  bool is_within;  // `from` is closed, and the ray is within
  bool is_moved;   // some gate had a map that is not the identity
  bool is_lost;    // it went through as many as it may, and ends there; or in a ball:
  uint32_t ended;  // 1 + the gate in whose ball it ended, before which the ray still is; 0: in none
} Way;

// All gates of a world, and for each cell which of them are its walls.
typedef struct Space {
  const SpaceGate *gates;
  size_t gate_count;
  const uint32_t *walls;      // gates, by cell
  const uint32_t *first_wall; // of each cell, and the end
} Space;

// Where a ray leaves by a gate that is in no tree.
typedef struct SpaceExit {
  float t;       // INFINITY: nowhere
  uint32_t gate;
  int side;
} SpaceExit;

static inline Way way_begin(uint32_t cell)
{
  return (Way){.cell = cell, .from = NO_GATE, .scale = 1};
}

// Of walls only those count that the ray goes out by, and none lies behind tmin: a ray that rounding has put outside
// leaves at once by the right one, and never by the one it came in by.
static inline SpaceExit space_exit(const Space *s, const Way *w, const Ray *ray)
{
  SpaceExit e = {INFINITY, NO_GATE, GATE_FRONT};
  for (uint32_t i = s->first_wall[w->cell]; i < s->first_wall[w->cell + 1]; i++) {
    const SpaceGate *g = &s->gates[s->walls[i]];
    const float along = v3_dot(g->n, ray->d);
    if (!(along < 0)) continue;
    const float t = max_f((g->c - v3_dot(g->n, ray->o)) / along, ray->tmin);
    if (t < e.t) e = (SpaceExit){t, s->walls[i], GATE_FRONT};
  }
  if (!w->is_within) return e;
  float near, far;
  const SpaceGate *g = &s->gates[w->from];
  gate_span(g, ray, &near, &far);
  far = max_f(far, ray->tmin);
  if (far < e.t && g->side[GATE_BACK].cell != NO_CELL) e = (SpaceExit){far, w->from, GATE_BACK};
  return e;
}

// The same place on the boundary and the same angle to it; what went in goes out. Turned over front to back, or left would
// be right beyond: the outsides of two balls are mirror images. p and v are in the charts around the balls' middles.
static inline void way_door(const GateCurve *c, Vec3 *p, Vec3 *v)
{
  const Vec3 n = v3_normalize(*p);
  const Vec3 out = *v - 2 * v3_dot(*v, n) * n;
  *p = c->radius_to * v3(n[0], n[1], -n[2]);
  *v = v3(out[0], out[1], -out[2]);
  chart_map(c->kappa_to, &c->map_to, p, v);
}

// Through a gate of a curved cell, the ray begins anew at the gate: a line of one chart may have no origin in the next.
static inline void way_curve(const GateCurve *c, Way *w, float t, Ray *ray)
{
  Vec3 p = ray->o + t * ray->d, v = v3_normalize(chart_to_local(c->kappa, p, ray->d));
  w->passed += chart_length(c->kappa, chart_span(c->kappa, ray->o, ray->d, t));
  chart_map(c->kappa, &c->map, &p, &v);
  if (c->is_door) way_door(c, &p, &v);
  ray->o = p;
  ray->d = v3_normalize(chart_from_local(c->kappa_to, p, v));
  ray->tmin = 0;
}

// Into a ball that bends light, where lengths do not count.
static inline BallEnd way_ball(const GateCurve *c, float t, Ray *ray)
{
  Vec3 p = ray->o + t * ray->d, v = ray->d;
  chart_map(0, &c->map, &p, &v);
  const BallEnd end = ball_go(c->ball, &p, &v);
  if (end == BALL_ENDED) return end;
  chart_map(0, end == BALL_PASSED ? &c->map_to : &c->back, &p, &v);
  const Vec3 d = v3_normalize(v);
  *ray = (Ray){p - t * d, d, t, ray->tmax};
  return end;
}

// What is seen along a way that ended in a ball, its ray at p.
static inline Vec3 way_ball_light(const Space *s, const Way *w, Vec3 p, Vec3 d)
{
  const GateCurve *c = s->gates[w->ended - 1].side[GATE_FRONT].curve;
  chart_map(0, &c->map, &p, &d);
  return ball_light(c->ball, p, d);
}

static inline void way_scale(Way *w, float scale, Ray *ray)
{
  ray->tmin *= scale;
  ray->tmax *= scale;
  w->scale *= scale;
  w->passed *= scale;
}

// Takes the ray, whose direction has unit length, through a side of a gate that it meets at t. False: it ended there.
static inline bool way_cross(const Space *s, Way *w, uint32_t gate, int side, float t, Ray *ray)
{
  const GateSide *to = &s->gates[gate].side[side];
  BallEnd end = BALL_PASSED;
  if (!to->curve) {
    ray->o = frame_point(&to->map, ray->o);
    ray->tmin = t;
    if (!to->is_shift) ray->d = v3_normalize(frame_vector(&to->map, ray->d));
  } else if (to->curve->ball) {
    end = way_ball(to->curve, t, ray);
    if (end == BALL_ENDED) {
      w->is_lost = true;
      w->ended = 1 + gate;
      return false;
    }
  } else {
    way_curve(to->curve, w, t, ray);
  }
  if (to->scale != 1) way_scale(w, to->scale, ray);
  w->word = w->crossings < WORD_GATES ? w->word | (uint64_t)(1 + 2 * gate + (uint32_t)side) << 16 * w->crossings : WORD_LOST;
  w->is_moved |= !to->is_null;
  w->cell = end == BALL_TURNED ? s->gates[gate].cell : to->cell;
  w->from = end == BALL_TURNED ? gate : to->gate;
  w->is_within = to->is_into && to->gate != NO_GATE;
  w->crossings++;
  return true;
}

// What length leaves of light: all up to four fifths of `fade`, nothing beyond it, smooth between. 0: no fade.
static inline float space_fade(float fade, float length)
{
  if (!(fade > 0)) return 1;
  const float x = clamp_f(5 * (1 - length / fade), 0, 1);
  return x * x * (3 - 2 * x);
}

#endif
