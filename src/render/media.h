// Media: what becomes of light between two places. Surfaces have been found already; here a ray's way is cut into
// stretches where it goes in and out of media (their boundaries have a tree of their own), and on each stretch light is
// scattered, absorbed and added.
//
//   way:  eye --------|=============|---------|======X   scattered, or on to the surface at its end
//                     in            out       in
//
// Media that overlap add up: a ray carries the set of those it is in. Which is a set and not a counter, so that a boundary
// found twice, on an edge, does no harm.
//
// A homogeneous stretch is sampled in closed form: the distance by one channel's extinction, weighed against all three
// (balance heuristic over channels; pbrt-v4, section 14.2), so that coloured fog is as quiet as grey.
//
// Does not know lights or surfaces: path.h does.

#ifndef RAYFOLD_RENDER_MEDIA_H
#define RAYFOLD_RENDER_MEDIA_H

#include "render/trace.h"

// What only worlds with media need is kept out of the loops of all others, where it costs registers: 4 % of a Cornell box.
#define MEDIA_APART __attribute__((noinline))

enum { MOST_MEDIA = 8 }; // that overlap; what comes after is not noticed

// The media a place lies in.
typedef struct MediumSet {
  uint32_t count, media[MOST_MEDIA]; // indices into World.media
} MediumSet;

// The set far outside of everything.
static inline MediumSet media_outside(const World *w)
{
  return w->has_atmosphere ? (MediumSet){1, {(uint32_t)w->media_count - 1}} : (MediumSet){0};
}

static inline void medium_enter(MediumSet *s, uint32_t medium)
{
  for (uint32_t i = 0; i < s->count; i++)
    if (s->media[i] == medium) return;
  if (s->count < MOST_MEDIA) s->media[s->count++] = medium;
}

static inline void medium_leave(MediumSet *s, uint32_t medium)
{
  for (uint32_t i = 0; i < s->count; i++)
    if (s->media[i] == medium) {
      s->media[i] = s->media[--s->count];
      return;
    }
}

// Light goes through a surface that may be a medium's boundary as well.
static MEDIA_APART void media_cross_surface(const World *w, MediumSet *s, uint32_t instance, bool is_inwards)
{
  const uint32_t medium = w->instances[instance].medium;
  if (!medium) return;
  if (is_inwards)
    medium_enter(s, medium - 1);
  else
    medium_leave(s, medium - 1);
}

// --- stretches ------------------------------------------------------------------------------------

// A ray's way, walked from boundary to boundary.
typedef struct MediaWalk {
  const World *world;
  Ray ray;         // d of unit length
  MediumSet *set;  // where the walk is
  float from, to;  // the stretch it is on
  Hit last;        // the boundary behind `from`
  RayCounters *counters;
} MediaWalk;

// Boundaries in the order of their distance, then of their index, each once: those behind the last one.
static bool media_is_next(const void *user, const Ray *ray, const Hit *hit)
{
  const Hit *last = user;
  (void)ray;
  if (hit->t != last->t) return hit->t > last->t;
  if (hit->instance != last->instance) return hit->instance > last->instance;
  return hit->prim > last->prim;
}

// Whether the ray goes into the medium at its boundary.
static inline bool media_goes_in(const World *w, const Ray *ray, const Hit *hit)
{
  const Instance *i = &w->media_accel->instances[hit->instance];
  const Vec3 d = frame_vector(&i->object_from_world, ray->d);
  if (i->kind == INSTANCE_SPHERE) return v3_dot(frame_point(&i->object_from_world, ray->o + hit->t * ray->d), d) < 0;
  const TriangleMesh *m = &w->media[hit->instance].mesh;
  const uint32_t *corner = m->triangles + 3 * (size_t)hit->prim;
  const Vec3 a = v3_load(m->positions + 3 * (size_t)corner[0]);
  const Vec3 n = v3_cross(v3_load(m->positions + 3 * (size_t)corner[1]) - a,
                          v3_load(m->positions + 3 * (size_t)corner[2]) - a);
  return v3_dot(n, d) < 0;
}

static inline MediaWalk media_walk(const World *w, const Ray *ray, MediumSet *set, RayCounters *counters)
{
  return (MediaWalk){w, *ray, set, 0, 0, {.t = -1, .instance = NO_HIT}, counters};
}

// Goes on to the next stretch, if there is one.
static inline bool media_next(MediaWalk *m)
{
  if (!(m->to < m->ray.tmax)) return false;
  if (m->last.instance != NO_HIT) {
    if (media_goes_in(m->world, &m->ray, &m->last))
      medium_enter(m->set, m->last.instance);
    else
      medium_leave(m->set, m->last.instance);
  }
  m->from = m->to;
  Ray rest = m->ray;
  rest.tmin = 0.999999f * max_f(m->last.t, 0); // the next may be at the same distance; the filter knows
  Hit next = {.t = m->ray.tmax, .instance = NO_HIT};
  if (m->world->media_accel)
    accel_closest(m->world->media_accel, &rest, RAY_ALL, media_is_next, &m->last, m->counters, &next);
  m->last = next;
  m->to = next.t;
  // All that has a boundary lies behind: what a walk may think it is in, it has left through an edge.
  if (next.instance == NO_HIT && m->ray.tmax == INFINITY) *m->set = media_outside(m->world);
  return true;
}

// The media at a point: by coming there from far outside.
static inline MediumSet media_at(const World *w, Vec3 p, RayCounters *counters)
{
  MediumSet set = media_outside(w);
  if (!w->media_accel) return set;
  const Vec3 lo = w->media_accel->bounds.lo, hi = w->media_accel->bounds.hi;
  const float far = 2 * (v3_length(hi - lo) + v3_length(p - lo));
  const Vec3 d = v3_normalize(v3(0.437f, 0.813f, 0.385f)); // along no axis that rooms are built by
  const Ray ray = {p + far * d, -d, 0, far};
  MediaWalk walk = media_walk(w, &ray, &set, counters);
  while (media_next(&walk)) {}
  return set;
}

// Carries the set from one point to another, as an eye is moved.
static inline void media_move(const World *w, MediumSet *set, Vec3 from, Vec3 to, RayCounters *counters)
{
  const float distance = v3_length(to - from);
  if (!(distance > 0)) return;
  const Ray ray = {from, (to - from) / distance, 0, distance};
  MediaWalk walk = media_walk(w, &ray, set, counters);
  while (media_next(&walk)) {}
}

// --- homogeneous stretches --------------------------------------------------------------------------

static inline const Volume *medium_volume(const World *w, uint32_t medium)
{
  return &w->volumes[w->media[medium].volume];
}

// Media that overlap, as one.
static inline Volume media_sum(const World *w, const MediumSet *s)
{
  Volume sum = *medium_volume(w, s->media[0]);
  for (uint32_t i = 1; i < s->count; i++) {
    const Volume *v = medium_volume(w, s->media[i]);
    sum.scattering += v->scattering;
    sum.extinction += v->extinction;
    sum.emission += v->emission;
  }
  return sum;
}

// What is left after a distance; the distance may be infinite (Beer and Lambert).
static inline Vec3 volume_fade(Vec3 extinction, float distance)
{
  Vec3 left = v3_all(1);
  for (int k = 0; k < 3; k++)
    if (extinction[k] > 0) left[k] = f_exp(-extinction[k] * distance);
  return left;
}

// Light that a stretch adds to what comes out of its near end: the integral of emission times what is left of it.
static inline Vec3 volume_glow(const Volume *v, float distance)
{
  Vec3 sum = v3_all(0);
  for (int k = 0; k < 3; k++) {
    if (!(v->emission[k] > 0)) continue;
    const float depth = v->extinction[k] * distance;
    // 1 - exp(-x) by its series where the difference would lose its digits.
    sum[k] = v->emission[k] *
             (depth < 1e-3f ? distance * (1 - depth / 2) : (1 - f_exp(-depth)) / v->extinction[k]);
  }
  return sum;
}

static inline bool v3_is_grey(Vec3 a)
{
  return a[0] == a[1] && a[1] == a[2];
}

// Which of the channels of weights w a number in [0, 1) falls to.
static inline int channel_pick(Vec3 w, float u)
{
  const float at = u * (w[0] + w[1] + w[2]);
  return at < w[0] ? 0 : at < w[0] + w[1] ? 1 : 2;
}

// How far light goes through a stretch before it is scattered or absorbed; at least `length`: it passes. The throughput
// is weighed for either.
static inline float volume_distance(const Volume *v, float length, Vec2 u, Vec3 *throughput)
{
  const Vec3 share = *throughput / (throughput[0][0] + throughput[0][1] + throughput[0][2]);
  const bool is_grey = v3_is_grey(v->extinction);
  const float chosen = v->extinction[is_grey ? 0 : channel_pick(*throughput, u.y)];
  const float t = chosen > 0 ? -f_log(1 - u.x) / chosen : INFINITY;
  const bool passes = !(t < length);
  if (is_grey) {
    if (!passes) *throughput = *throughput * v->scattering / v->extinction;
    return t;
  }
  const Vec3 left = volume_fade(v->extinction, passes ? length : t);
  const Vec3 density = passes ? left : v->extinction * left;
  const float pdf = v3_dot(share, density);
  *throughput = pdf > 0 ? *throughput * (passes ? left : v->scattering * left) / pdf : v3_all(0);
  return t;
}

// Which of several media that overlap has scattered light; the throughput holds the sum of their scattering and is
// weighed for the one.
static inline uint32_t media_pick(const World *w, const MediumSet *s, const Volume *sum, float u, Vec3 *throughput)
{
  if (s->count == 1) return s->media[0];
  Vec3 share[MOST_MEDIA];
  float chance[MOST_MEDIA], total = 0;
  for (uint32_t i = 0; i < s->count; i++) {
    const Vec3 scattering = medium_volume(w, s->media[i])->scattering;
    for (int k = 0; k < 3; k++) share[i][k] = sum->scattering[k] > 0 ? scattering[k] / sum->scattering[k] : 0;
    share[i][3] = 0;
    total += chance[i] = v3_mean(share[i] * *throughput);
  }
  uint32_t i = 0;
  for (float at = u * total; i + 1 < s->count && at >= chance[i]; i++) at -= chance[i];
  *throughput = chance[i] > 0 ? *throughput * share[i] * (total / chance[i]) : v3_all(0);
  return s->media[i];
}

// --- what light does on its way -----------------------------------------------------------------------

// Where light was scattered.
typedef struct MediumPoint {
  Vec3 p;
  float t; // along the ray
  uint32_t medium;
  const Phase *phase;
} MediumPoint;

// What is left of light that comes along the ray from its end.
static inline Vec3 media_transmittance(const World *w, const Ray *ray, MediumSet set, RayCounters *counters)
{
  Vec3 left = v3_all(1);
  MediaWalk walk = media_walk(w, ray, &set, counters);
  while (media_next(&walk) && !v3_is_zero(left)) {
    if (!set.count) continue;
    left = left * volume_fade(media_sum(w, &set).extinction, walk.to - walk.from);
  }
  return left;
}

#endif
