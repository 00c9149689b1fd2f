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
// Where a medium differs from place to place, light is followed by delta tracking and seen through by ratio tracking,
// both against local bounds; or, for speed, by steps (render.volumes: march), which is a little too bright where steps
// are long, as exp() of a mean is less than the mean of exp(). (See MediaTrack and media_march.)
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

// The set far outside of everything in a cell.
static inline MediumSet media_outside(const World *w, uint32_t cell)
{
  const uint32_t atmosphere = w->cells[cell].atmosphere;
  return atmosphere ? (MediumSet){1, {atmosphere - 1}} : (MediumSet){0};
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
  uint32_t cell;
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

// Where a ray goes into and out of the unit box of an instance, anywhere on its line; false when it passes by. A ray in
// a face's plane (0 / 0) may do either: it has no way inside.
static inline bool media_box(const Instance *i, const Ray *ray, float t[2])
{
  const Vec3 o = frame_point(&i->object_from_world, ray->o), d = frame_vector(&i->object_from_world, ray->d);
  t[0] = -INFINITY;
  t[1] = INFINITY;
  for (int k = 0; k < 3; k++) {
    const float a = (-0.5f - o[k]) / d[k], b = (0.5f - o[k]) / d[k];
    t[0] = max_f(t[0], min_f(a, b));
    t[1] = min_f(t[1], max_f(a, b));
  }
  return t[0] < t[1];
}

// The next boundary of few boxes; prim 0 is where the ray goes in, 1 where it goes out. (Finding all crossings once a walk
// was not faster.)
static inline void media_next_box(const World *w, const Ray *ray, const Hit *last, Hit *next)
{
  for (uint32_t i = 0; i < w->media_accel->instance_count; i++) {
    float t[2];
    if (!media_box(&w->media_accel->instances[i], ray, t)) continue;
    for (uint32_t k = 0; k < 2; k++) {
      const Hit hit = {.t = t[k], .instance = i, .prim = k};
      if (t[k] >= 0 && t[k] < next->t && media_is_next(last, ray, &hit)) *next = hit;
    }
  }
}

// Whether the ray goes into the medium at its boundary.
static inline bool media_goes_in(const World *w, const Ray *ray, const Hit *hit)
{
  if (w->media_are_boxes) return hit->prim == 0;
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

static inline MediaWalk media_walk(const World *w, uint32_t cell, const Ray *ray, MediumSet *set, RayCounters *counters)
{
  return (MediaWalk){w, *ray, set, 0, 0, {.t = -1, .instance = NO_HIT}, counters, cell};
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
  Hit next = {.t = m->ray.tmax, .instance = NO_HIT};
  const Accel *boundaries = m->world->cells[m->cell].media_accel;
  if (m->world->media_are_boxes) {
    media_next_box(m->world, &m->ray, &m->last, &next);
  } else if (boundaries) {
    Ray rest = m->ray;
    rest.tmin = 0.999999f * max_f(m->last.t, 0); // the next may be at the same distance; the filter knows
    accel_closest(boundaries, &rest, RAY_ALL, media_is_next, &m->last, m->counters, &next);
  }
  m->last = next;
  m->to = next.t;
  // All that has a boundary lies behind: what a walk may think it is in, it has left through an edge.
  if (next.instance == NO_HIT && m->ray.tmax == INFINITY) *m->set = media_outside(m->world, m->cell);
  return true;
}

// The media at a point: by coming there from far outside.
static inline MediumSet media_at(const World *w, uint32_t cell, Vec3 p, RayCounters *counters)
{
  MediumSet set = media_outside(w, cell);
  const Accel *boundaries = w->cells[cell].media_accel;
  if (!boundaries || boundaries->root == EMPTY_TREE) return set;
  const Vec3 lo = boundaries->bounds.lo, hi = boundaries->bounds.hi;
  const float far = 2 * (v3_length(hi - lo) + v3_length(p - lo));
  const Vec3 d = v3_normalize(v3(0.437f, 0.813f, 0.385f)); // along no axis that rooms are built by
  const Ray ray = {p + far * d, -d, 0, far};
  MediaWalk walk = media_walk(w, cell, &ray, &set, counters);
  while (media_next(&walk)) {}
  return set;
}

// Carries the set from one point to another, as an eye is moved.
static inline void media_move(const World *w, uint32_t cell, MediumSet *set, Vec3 from, Vec3 to, RayCounters *counters)
{
  const float distance = v3_length(to - from);
  if (!(distance > 0)) return;
  const Ray ray = {from, (to - from) / distance, 0, distance};
  MediaWalk walk = media_walk(w, cell, &ray, set, counters);
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

// Whether any of the media differs from place to place.
static inline bool media_differ(const World *w, const MediumSet *s)
{
  for (uint32_t i = 0; i < s->count; i++)
    if (medium_volume(w, s->media[i])->density) return true;
  return false;
}

// Media that overlap, as one that is everywhere what they are here.
static inline Volume media_sum_at(const World *w, const MediumSet *s, Vec3 p)
{
  Volume sum = {0};
  for (uint32_t i = 0; i < s->count; i++) {
    const Volume *v = medium_volume(w, s->media[i]);
    const Vec3 there = v->density ? frame_point(&w->media[s->media[i]].medium_from_world, p) : v3_all(0);
    const float density = v->density ? density_at(v->density, there) : 1;
    if (!(density > 0)) continue;
    sum.scattering += density * volume_scattering(v, there);
    sum.extinction += density * v->extinction;
    sum.emission += density * volume_emission(v, there);
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
static inline uint32_t media_pick(const World *w, const MediumSet *s, const Volume *sum, Vec3 p, float u, Vec3 *throughput)
{
  if (s->count == 1) return s->media[0];
  Vec3 share[MOST_MEDIA];
  float chance[MOST_MEDIA] = {0}, total = 0;
  for (uint32_t i = 0; i < s->count; i++) {
    const MediumSet one = {1, {s->media[i]}};
    const Vec3 scattering = media_sum_at(w, &one, p).scattering;
    for (int k = 0; k < 3; k++) share[i][k] = sum->scattering[k] > 0 ? scattering[k] / sum->scattering[k] : 0;
    share[i][3] = 0;
    total += chance[i] = v3_mean(share[i] * *throughput);
  }
  uint32_t i = 0;
  for (float at = u * total; i + 1 < s->count && at >= chance[i]; i++) at -= chance[i];
  *throughput = chance[i] > 0 ? *throughput * share[i] * (total / chance[i]) : v3_all(0);
  return s->media[i];
}

// --- media that differ from place to place --------------------------------------------------------------

// What decides along one stretch: numbers that are a function of a seed and of how many were taken.
typedef struct MediaDice {
  uint32_t seed, taken;
} MediaDice;

static inline float media_roll(MediaDice *d)
{
  return unit_float(hash_combine(d->seed, d->taken++));
}

// One medium of a stretch, followed from one place where light may meet it to the next: as often as it would were it
// as thick as the bound of each cell says (delta tracking). Media that overlap are followed side by side: whose
// next place is nearest comes first, which is the same as following their sum.
typedef struct MediaTrack {
  const Volume *volume;
  Vec3 o, d;       // the ray in the medium's space; the same t
  DensityWalk walk;
  bool is_inside;  // there is a cell to walk in
  float scale;     // chances a metre at density 1
  float t, chance; // the next place, INFINITY: none; chances a metre there
} MediaTrack;

static inline void track_next(MediaTrack *k, MediaDice *dice, float length_end)
{
  float depth = -f_log(1 - media_roll(dice));
  if (!k->volume->density) {
    k->t += depth / k->scale;
    if (!(k->t < length_end)) k->t = INFINITY;
    return;
  }
  while (k->is_inside) {
    const float end = density_cell_end(&k->walk);
    k->chance = k->scale * density_most(&k->walk);
    const float there = k->chance * (end - k->walk.t);
    if (depth < there) {
      k->t = k->walk.t = k->walk.t + depth / k->chance;
      return;
    }
    depth -= max_f(there, 0);
    k->is_inside = density_step(&k->walk);
  }
  k->t = INFINITY;
}

static inline MediaTrack track_begin(const World *w, uint32_t medium, const Ray *ray, float from, float to, MediaDice *dice)
{
  const WorldMedium *m = &w->media[medium];
  MediaTrack k = {.volume = &w->volumes[m->volume], .t = from};
  k.scale = k.chance = k.volume->most;
  if (k.volume->density) {
    k.o = frame_point(&m->medium_from_world, ray->o);
    k.d = frame_vector(&m->medium_from_world, ray->d);
    k.is_inside = density_walk(k.volume->density, k.o, k.d, from, to, &k.walk);
  }
  if (k.scale > 0)
    track_next(&k, dice, to);
  else
    k.t = INFINITY;
  return k;
}

// The place, in the medium's space.
static inline Vec3 track_place(const MediaTrack *k)
{
  return k->o + k->t * k->d;
}

static inline float track_density(const MediaTrack *k)
{
  return k->volume->density ? density_at(k->volume->density, track_place(k)) : 1;
}

static inline uint32_t tracks_nearest(const MediaTrack *tracks, uint32_t count)
{
  uint32_t nearest = 0;
  for (uint32_t i = 1; i < count; i++)
    if (tracks[i].t < tracks[nearest].t) nearest = i;
  return nearest;
}

static inline void tracks_begin(const World *w, const MediumSet *s, const Ray *ray, float from, float to, MediaDice *dice,
                                MediaTrack tracks[MOST_MEDIA])
{
  for (uint32_t i = 0; i < s->count; i++) tracks[i] = track_begin(w, s->media[i], ray, from, to, dice);
}

// What is left of light: at every place where it may be met, what the medium there does not take (ratio tracking:
// Novak, Selle and Jarosz, "Residual ratio tracking", 2014). Once little is left, it is gambled for.
static inline Vec3 tracks_fade(const World *w, const MediumSet *s, const Ray *ray, float from, float to, MediaDice *dice)
{
  MediaTrack tracks[MOST_MEDIA];
  Vec3 left = v3_all(1);
  for (uint32_t i = 0; i < s->count; i++) {
    MediaTrack *k = &tracks[i];
    if (!medium_volume(w, s->media[i])->density) {
      left *= volume_fade(medium_volume(w, s->media[i])->extinction, to - from);
      continue;
    }
    *k = track_begin(w, s->media[i], ray, from, to, dice);
    while (k->t < to) {
      left *= v3_max(v3_all(1) - k->volume->extinction * (track_density(k) / k->chance), v3_all(0));
      if (v3_max_lane(left) < 0.1f) {
        if (media_roll(dice) >= 0.25f) return v3_all(0);
        left = 4 * left;
      }
      track_next(k, dice, to);
    }
  }
  return left;
}

// --- the same by steps, for speed ---------------------------------------------------------------------
// A stretch is cut into equal steps, each as homogeneous as one place in it; where in its step that is is one number for all
// steps, so that no steps show. Within a step all is in closed form.

static inline Vec3 march_fade(const World *w, const MediumSet *s, const Ray *ray, float from, float to, int32_t steps,
                              float jitter)
{
  const float length = (to - from) / (float)steps;
  Vec3 depth = v3_all(0);
  for (int32_t i = 0; i < steps; i++)
    depth += media_sum_at(w, s, ray->o + (from + ((float)i + jitter) * length) * ray->d).extinction * length;
  return volume_fade(depth, 1);
}

// --- what light does on its way -----------------------------------------------------------------------

// Where light was scattered.
typedef struct MediumPoint {
  Vec3 p;
  float t; // along the ray
  uint32_t medium;
  const Phase *phase;
} MediumPoint;

// What is left of light that comes along the ray from its end. steps: of a march, 0: without error.
static inline Vec3 media_transmittance(const World *w, uint32_t cell, const Ray *ray, MediumSet set, uint32_t seed, int32_t steps,
                                       RayCounters *counters)
{
  Vec3 left = v3_all(1);
  MediaDice dice = {seed, 0};
  MediaWalk walk = media_walk(w, cell, ray, &set, counters);
  while (media_next(&walk) && !v3_is_zero(left)) {
    if (!set.count) continue;
    if (!media_differ(w, &set))
      left *= volume_fade(media_sum(w, &set).extinction, walk.to - walk.from);
    else if (steps)
      left *= march_fade(w, &set, ray, walk.from, walk.to, steps, media_roll(&dice));
    else
      left *= tracks_fade(w, &set, ray, walk.from, walk.to, &dice);
  }
  return left;
}

#endif
