// Ways: rays followed through gates, to what they meet at last. Straight pieces are asked of the trees, cell by cell; where
// a piece ends at a gate, space/ carries the ray over, and it is asked again. In worlds without gates this is one
// question to one tree.
//
// Rays to lamps beyond gates know which gates they are aimed through; anything else in their way, other gates too, is
// in their way.

#ifndef RAYFOLD_RENDER_WAYS_H
#define RAYFOLD_RENDER_WAYS_H

#include "render/trace.h"

enum { MOST_WAYS = 128 }; // in one question

// The whole length of a way whose ray is at t, in lengths of where it began.
static inline float way_length(const Way *way, float t)
{
  return (way->passed + t) / way->scale;
}

static inline bool world_has_gates(const World *w)
{
  return w->space.gate_count > 0;
}

static inline const LightSet *world_lights(const World *w, uint32_t cell)
{
  return w->cells[cell].lights;
}

// What is seen where a way is lost, its ray at t there; from what it came to, what length leaves of it.
static inline Vec3 way_lost_light(const World *w, const Way *way, const Ray *ray, float t)
{
  if (!way->ended) return w->fade_color;
  const Vec3 light = way_ball_light(&w->space, way, ray->o + t * ray->d, ray->d);
  return w->fade_color + (light - w->fade_color) * space_fade(w->fade, way_length(way, t));
}

// One batch to the tree of one cell.
static inline void cell_ask(const World *w, uint32_t cell, const PackedRay *rays, const TraceQuery *queries, size_t count,
                            RayMask mask, RayCounters *counters, BatchHabit *habit, Hit *hits, uint8_t *blocked)
{
  accel_ask(&(Batch){.accel = w->cells[cell].accel, .rays = rays, .count = count, .mask = mask, .filter = trace_counts,
                     .user = queries, .user_stride = sizeof *queries, .counters = counters, .habit = habit, .hits = hits,
                     .blocked = blocked});
}

// Where a piece of a way ends: at a gate, or not.
static inline SpaceExit way_end(const World *w, const Ray *ray, const SpaceExit *exit, const Hit *hit)
{
  if (hit->instance == NO_HIT) return exit->t < ray->tmax ? *exit : (SpaceExit){INFINITY, NO_GATE, 0};
  const uint32_t gate = w->instances[hit->instance].gate;
  if (!gate) return (SpaceExit){INFINITY, NO_GATE, 0};
  return (SpaceExit){hit->t, gate - 1, gate_side_at(&w->space.gates[gate - 1], ray, hit->t)};
}

// Takes one ray over the gate at the end of its piece. False: that was its end.
static inline bool way_go_on(const World *w, Way *way, const SpaceExit *end, PackedRay *packed)
{
  if (end->gate == NO_GATE) return false;
  Ray ray = ray_unpack(packed);
  if (way->crossings >= w->crossings) {
    way->is_lost = true;
    return false;
  }
  if (!way_cross(&w->space, way, end->gate, end->side, end->t, &ray)) return false;
  *packed = ray_pack(&ray);
  return true;
}

static inline void way_move_origin(Way *way, PackedRay *ray)
{
  for (int k = 0; k < 3; k++) ray->o[k] += ray->tmin * ray->d[k];
  ray->tmax -= ray->tmin;
  way->passed += ray->tmin;
  ray->tmin = 0;
}

// One piece of the rays of one cell, as many as stand first in `open`: takes them off it, and appends those that go on.
typedef struct Ways {
  const World *world;
  PackedRay *rays;
  Way *ways;
  const TraceQuery *queries;
  Hit *hits;
  RayMask mask;
  RayCounters *counters;
  BatchHabit *habit;
  // In worlds with media, of a ray that meets a gate at the end of a piece: may it go on? Its next piece then begins with
  // an origin at the gate, as media need it. NULL: there are none.
  bool (*passes)(void *user, uint16_t i, const Ray *ray, const SpaceExit *end);
  void *user;
  size_t open_count;
  uint16_t open[MOST_WAYS];
} Ways;

static inline void ways_step(Ways *q)
{
  const World *w = q->world;
  const uint32_t cell = q->ways[q->open[0]].cell;
  PackedRay rays[MOST_WAYS];
  TraceQuery queries[MOST_WAYS];
  SpaceExit exits[MOST_WAYS];
  Hit hits[MOST_WAYS];
  uint16_t of[MOST_WAYS];
  size_t count = 0, kept = 0;
  for (size_t k = 0; k < q->open_count; k++) {
    const uint16_t i = q->open[k];
    const Way *way = &q->ways[i];
    if (way->cell != cell) {
      q->open[kept++] = i;
      continue;
    }
    const Ray ray = ray_unpack(&q->rays[i]);
    rays[count] = q->rays[i];
    exits[count] = space_exit(&w->space, way, &ray);
    if (exits[count].t < ray.tmax) rays[count].tmax = exits[count].t;
    queries[count] = q->queries[i];
    queries[count].without = way->from + 1; // of NO_GATE 0
    of[count++] = i;
  }
  cell_ask(w, cell, rays, queries, count, q->mask, q->counters, q->habit, hits, NULL);
  for (size_t k = 0; k < count; k++) {
    const uint16_t i = of[k];
    const Ray ray = ray_unpack(&q->rays[i]);
    const SpaceExit end = way_end(w, &ray, &exits[k], &hits[k]);
    q->hits[i] = hits[k];
    if (hits[k].instance == NO_HIT) q->hits[i].t = ray.tmax;
    if (end.gate != NO_GATE) q->hits[i].instance = NO_HIT;
    if (q->passes && end.gate != NO_GATE && !q->passes(q->user, i, &ray, &end)) continue;
    if (!way_go_on(w, &q->ways[i], &end, &q->rays[i])) continue;
    if (q->passes) way_move_origin(&q->ways[i], &q->rays[i]);
    q->open[kept++] = i;
  }
  q->open_count = kept;
}

// What rays meet: rays and ways are then those of their last pieces.
static inline void ways_closest(const World *w, PackedRay *rays, Way *ways, const TraceQuery *queries, size_t count,
                                RayMask mask, RayCounters *counters, BatchHabit *habit, Hit *hits)
{
  if (!world_has_gates(w)) {
    cell_ask(w, 0, rays, queries, count, mask, counters, habit, hits, NULL);
    return;
  }
  Ways q = {.world = w, .rays = rays, .ways = ways, .queries = queries, .hits = hits, .mask = mask, .counters = counters,
            .habit = habit, .open_count = count};
  for (size_t i = 0; i < count; i++) q.open[i] = (uint16_t)i;
  while (q.open_count) ways_step(&q);
}

// One piece of one ray: what it meets in its cell before any gate, or the gate.
static inline SpaceExit way_piece(const World *w, const Ray *ray, const Way *way, RayMask mask, uint32_t seed, RayCounters *rays,
                                  Hit *hit)
{
  const TraceQuery q = {w, seed, way->from + 1, 0};
  const SpaceExit exit = world_has_gates(w) ? space_exit(&w->space, way, ray) : (SpaceExit){INFINITY, NO_GATE, 0};
  Ray piece = *ray;
  if (exit.t < piece.tmax) piece.tmax = exit.t;
  accel_closest(w->cells[way->cell].accel, &piece, mask, trace_counts, &q, rays, hit);
  const SpaceExit end = way_end(w, ray, &exit, hit);
  if (end.gate != NO_GATE) hit->instance = NO_HIT;
  return end;
}

// The whole way of one ray, without a batch.
static inline bool way_closest(const World *w, Ray *ray, Way *way, RayMask mask, uint32_t seed, RayCounters *rays, Hit *hit)
{
  *(mask == RAY_CAMERA ? &rays->camera_rays : &rays->bounce_rays) += 1;
  for (;;) {
    const SpaceExit end = way_piece(w, ray, way, mask, seed, rays, hit);
    if (end.gate == NO_GATE) return hit->instance != NO_HIT;
    if (way->crossings >= w->crossings) {
      way->is_lost = true;
      return false;
    }
    if (!way_cross(&w->space, way, end.gate, end.side, end.t, ray)) return false;
  }
}

// --- to lamps ---------------------------------------------------------------------------------------

// Cuts a ray to a lamp where it leaves its cell by a gate in no tree. Anything it would meet beyond is not on its way.
static inline bool way_stays(const Space *s, const Way *way, const Ray *ray)
{
  return !(space_exit(s, way, ray).t < ray->tmax);
}

// Whether something is in the way of rays that are aimed through gates: ways begin where the rays do, plans tell the
// sides they must go in at.
static inline void ways_blocked(const World *w, const PackedRay *from, const Way *begin, const uint64_t *plans,
                                const TraceQuery *seeds, size_t count, RayMask mask, RayCounters *counters, BatchHabit *habit,
                                uint8_t *blocked)
{
  PackedRay rays[MOST_WAYS];
  Way ways[MOST_WAYS];
  uint64_t left[MOST_WAYS];
  uint16_t open[MOST_WAYS];
  size_t open_count = count;
  for (size_t i = 0; i < count; i++) {
    rays[i] = from[i];
    ways[i] = begin[i];
    left[i] = plans[i];
    open[i] = (uint16_t)i;
    blocked[i] = 1;
  }
  while (open_count) {
    PackedRay pieces[MOST_WAYS];
    TraceQuery queries[MOST_WAYS];
    float ends[MOST_WAYS];
    uint8_t stopped[MOST_WAYS];
    uint16_t of[MOST_WAYS];
    size_t n = 0, kept = 0;
    const uint32_t cell = ways[open[0]].cell;
    for (size_t k = 0; k < open_count; k++) {
      const uint16_t i = open[k];
      if (ways[i].cell != cell) {
        open[kept++] = i;
        continue;
      }
      Ray ray = ray_unpack(&rays[i]);
      const uint32_t aim = (uint32_t)(left[i] & 0xffff);
      const SpaceExit exit = space_exit(&w->space, &ways[i], &ray);
      if (aim) {
        const SpaceGate *g = &w->space.gates[(aim - 1) / 2];
        const bool is_exit = exit.gate == (aim - 1) / 2;
        const float t = is_exit ? exit.t : g->is_wall ? INFINITY : gate_meet(g, (int)((aim - 1) & 1), &ray);
        if (!(t < ray.tmax) || exit.t < t) continue; // past the gate: blocked
        ends[n] = ray.tmax = t;
      } else if (exit.t < ray.tmax) {
        continue;
      }
      pieces[n] = ray_pack(&ray);
      queries[n] = seeds[i];
      queries[n].without = ways[i].from + 1;
      queries[n].aim = aim ? (aim - 1) / 2 + 1 : 0;
      of[n++] = i;
    }
    cell_ask(w, cell, pieces, queries, n, mask, counters, habit, NULL, stopped);
    for (size_t k = 0; k < n; k++) {
      const uint16_t i = of[k];
      if (stopped[k]) continue;
      const uint32_t aim = (uint32_t)(left[i] & 0xffff);
      if (!aim) {
        blocked[i] = 0;
        continue;
      }
      Ray ray = ray_unpack(&rays[i]);
      if (!way_cross(&w->space, &ways[i], (aim - 1) / 2, (int)((aim - 1) & 1), ends[k], &ray)) continue;
      rays[i] = ray_pack(&ray);
      left[i] >>= 16;
      open[kept++] = i;
    }
    open_count = kept;
  }
}

#endif
