// Path: unidirectional path tracing with light sampling and multiple importance sampling (Veach 1997, chapters 9 and
// 10; pbrt, "A better path tracer"). The steps below come in the order of the physics; wave.h takes them, for many paths
// side by side. The ray that continues the path is also the BSDF's half of direct light, so each vertex costs one ray
// and one shadow ray a group of lights.
//
// Depth counts bounces: 0 is what the eye sees shining, 1 is direct light. Inside a body light fades by Beer-Lambert
// with the absorption of the surface it came in through; bodies inside bodies are not kept track of.
//
// Scattering in a medium (media.h) is a bounce like one off a surface, with a phase function for its BSDF.
//
// The ray may have gone through gates (ways.h): the vertex and all that is local are in the cell where it ended, the
// place it came from is in the cell where it began.
//
// Does not know caustics by any means but luck.

#ifndef RAYFOLD_RENDER_PATH_H
#define RAYFOLD_RENDER_PATH_H

#include "render/hot.h"
#include "render/local.h"
#include "render/media.h"
#include "render/sampler.h"
#include "render/ways.h"
#include "shade/light_sample.h"

// Pairs of the sampler. The film's and the lens's come first, then those of each vertex.
// PAIR_MATERIAL is far behind those, and asked for only by the vertices of materials that need it.
enum { PAIR_FILM, PAIR_LENS, PAIR_VERTEX, PAIR_SCATTER = 0, PAIR_CHOICES, PAIR_LIGHTS, PAIRS_DRAWN,
       PAIR_MATERIAL = 1 << 20 };

// Those of the way to a vertex are far from them, so that pictures without media do not depend on media.
// A way through many media has stretches beyond those that have pairs of their own: plain hashes decide in them.
enum { PAIR_MEDIA = 1 << 30, MEDIA_PAIRS = 16, STRETCHES_PAIRED = MEDIA_PAIRS / 2 };

typedef struct Path {
  const RenderPass *pass;
  const Sampler *sampler;
  Vec2 drawn[PAIRS_DRAWN]; // the first pairs of the next vertex
  uint32_t seed;     // of this sample, for alpha
  int32_t depth;     // bounces so far
  Vec3 radiance;     // found so far
  Vec3 throughput;   // what is left of radiance from the next vertex when it arrives at the eye
  Vec3 absorption;   // per metre, where the ray is
  float eta_scale;   // what refraction has taken off the throughput and will give back
  Vec3 from, from_n; // last vertex, and the normal it aims at lights with
  float scatter_pdf; // with which its BSDF chose the ray, per solid angle of the chart
  bool was_delta;    // no light could have been aimed at in that direction
  Cone cone;         // what the next ray stands for
  float share;       // of a pixel's side that this sample stands for
  Way way;           // of the ray that arrives; its cell is that of the vertex
  uint32_t from_cell; // of the last vertex
  uint32_t piece;    // of a way through media
  uint8_t band;      // once dispersed, the only channel of colour it carries, 1 to 3; 0: white
} Path;

// Where a path is.
typedef struct PathVertex {
  const Phase *phase; // in a medium, where of the rest only s.p counts and all else is zero; NULL: on a surface
  const SurfaceMaterial *m;
  SurfacePoint s;
  Bsdf bsdf;
  Vec3 wo;     // true, as all that has to do with the BSDF; s is in the chart (local.h)
  float width; // of the cone that arrived, metres
  float kappa; // curvature of its cell
} PathVertex;

static inline uint32_t path_pair(const Path *p, uint32_t which)
{
  const uint32_t stride = PAIR_LIGHTS + 2 * (uint32_t)p->pass->world->light_groups;
  return PAIR_VERTEX + (uint32_t)p->depth * stride + which;
}

static inline Vec2 path_draw(const Path *p, uint32_t which)
{
  return which < PAIRS_DRAWN ? p->drawn[which] : sample_pair(p->sampler, path_pair(p, which));
}

// Which part of a mix, and which colour of dispersed light.
static inline Vec2 path_material_pair(const Path *p)
{
  return sample_pair(p->sampler, PAIR_MATERIAL + (uint32_t)p->depth);
}

static inline uint32_t path_ray_seed(const Path *p, uint32_t ray)
{
  return hash_combine(p->seed, (uint32_t)p->depth << 16 | ray);
}

// For the i-th stretch of a medium on the way to a vertex: where light is scattered (which: 0), and by which medium (1).
static inline Vec2 path_media_pair(const Path *p, uint32_t stretch, uint32_t which)
{
  if (stretch < STRETCHES_PAIRED)
    return sample_pair(p->sampler, PAIR_MEDIA + (uint32_t)p->depth * MEDIA_PAIRS + 2 * stretch + which);
  const uint32_t h = hash_combine(path_ray_seed(p, 0xfffe), 2 * stretch + which);
  return (Vec2){unit_float(hash_combine(h, 0)), unit_float(hash_combine(h, 1))};
}

// Power heuristic with exponent 2 (Veach 1997, equation 9.13).
static inline float mis_weight(float pdf, float other)
{
  if (!(pdf < 1e18f)) return 1; // its square would overflow
  return pdf * pdf / (pdf * pdf + other * other);
}

// Adds light that arrives after `bounces` bounces, held to the user's limit if it is indirect.
static inline void path_add(Path *p, int32_t bounces, Vec3 light)
{
  const float limit = p->pass->settings.clamp, most = v3_max_lane(light);
  if (limit > 0 && bounces > 1 && most > limit) light = light * (limit / most);
  p->radiance += light;
}

static inline __attribute__((always_inline)) Vec3 path_fade(Vec3 absorption, float distance)
{
  if (v3_is_zero(absorption)) return v3_all(1);
  Vec3 left = v3_all(0);
  for (int k = 0; k < 3; k++) left[k] = absorption[k] > 0 ? f_exp(-absorption[k] * distance) : 1;
  return left;
}

// --- add what it emits --------------------------------------------------------------------------

// Weight of light found by following the BSDF where aiming could have found it, too.
static inline float path_found_weight(const Path *p, float light_pdf)
{
  return p->depth == 0 || p->was_delta ? 1 : mis_weight(p->scatter_pdf, light_pdf);
}

// The images in the cell where the ray began of the lamps in the cell where it ended; NULL: they are not aimed at.
static inline const LightImage *path_images(const Path *p)
{
  const WorldCell *c = &p->pass->world->cells[p->from_cell];
  for (uint32_t i = 0; i < c->image_count; i++)
    if (c->images[i].word == p->way.word) return &c->images[i];
  return NULL;
}

static inline int32_t path_image_of(const Path *p, int32_t emitter)
{
  const LightImage *image = path_images(p);
  return image && image->emitters ? image->emitters[emitter] : -1;
}

static inline void path_add_emission(Path *p, const SurfaceMaterial *m, const SurfacePoint *s, const Ray *ray,
                                     const Hit *hit)
{
  const World *w = p->pass->world;
  const Vec3 emitted = material_emission(m, w->textures, s);
  if (v3_is_zero(emitted)) return;
  int32_t emitter = m->is_light ? world_emitter(w, s) : -1;
  float weight = 1;
  if (emitter >= 0 && p->way.crossings) emitter = path_image_of(p, emitter);
  if (emitter >= 0) {
    const float pdf = light_pdf_emitter(world_lights(w, p->from_cell), (uint32_t)emitter, p->from, p->from_n,
                                        way_length(&p->way, hit->t), v3_dot(ray->d, s->ng));
    weight = path_found_weight(p, pdf);
  }
  path_add(p, p->depth, p->throughput * emitted * weight);
}

// What is left of a sky's light that came through gates; or what is seen where the way is lost, at t.
static inline Vec3 path_sky_left(const World *w, const Way *way, const Ray *ray, float t, Vec3 light)
{
  if (way->is_lost) return way_lost_light(w, way, ray, t);
  return w->fade_color + (light - w->fade_color) * space_fade(w->fade, way_length(way, ray->tmin)); // where the last gate was
}

// The ray leaves the scene, or is lost at t: the sky, and the disks of suns.
static inline void path_add_sky(Path *p, const Ray *ray, float t)
{
  const Vec3 d = ray->d;
  const World *w = p->pass->world;
  const WorldCell *cell = &w->cells[p->way.cell];
  const LightSet *lights = cell->lights;
  const bool is_direct = !p->way.crossings; // through gates the sky is not aimed at, and of suns the images
  const LightImage *image = is_direct ? NULL : path_images(p);
  const bool is_aimed = is_direct || (image && image->first_sun != NO_IMAGE);
  Vec3 light = sky_radiance(&lights->sky, d) * path_found_weight(p, is_direct ? sky_pdf(&lights->sky, d) : 0);
  for (size_t i = 0; i < cell->own_suns; i++) {
    const Sun *sun = &lights->suns[i];
    light += sun_radiance(sun, d) * path_found_weight(p, is_aimed ? sun_pdf(sun, d) : 0);
  }
  if (!is_direct || p->way.is_lost) light = path_sky_left(w, &p->way, ray, t, light);
  path_add(p, p->depth, p->throughput * light * path_fade(p->absorption, INFINITY));
}

// Through gates lengths may have changed.
static inline void path_rescale(Path *p)
{
  p->absorption = p->absorption / p->way.scale;
  p->cone.width *= p->way.scale;
}

// What length alone takes of all that the ray brings.
static inline void path_lose(Path *p, float length)
{
  const float left = space_fade(p->pass->world->fade, length);
  if (left == 1) return;
  path_add(p, p->depth, p->throughput * (1 - left) * p->pass->world->fade_color);
  p->throughput *= left;
}

// The path's ray meets a surface: what is lost on the way, what shines there, and how the surface scatters.
static inline void path_arrive(Path *p, const Ray *ray, const Hit *hit, PathVertex *v)
{
  const World *w = p->pass->world;
  v->s = trace_surface(w, ray, hit);
  v->phase = NULL;
  v->m = &w->materials[v->s.material];
  v->kappa = world_curvature(w, p->way.cell);
  const float length = local_length(v->kappa, ray, hit->t);
  v->wo = -local_vector(v->kappa, v->s.p, ray->d);
  v->width = p->cone.width + p->cone.spread * local_spread(v->kappa, p->way.passed + length);
  trace_footprint(w, ray, hit, v->kappa == 0 ? v->width : v->width / chart_w(v->kappa, v->s.p), &v->s);
  p->throughput *= path_fade(p->absorption, length);
  if (w->fade > 0 && world_has_gates(w)) path_lose(p, way_length(&p->way, length));
  path_add_emission(p, v->m, &v->s, ray, hit);
  if (v->m->kind == SURFACE_MIX)
    v->m = material_choose(v->m, w->textures, &v->s, path_material_pair(p).x);
  if (v->kappa == 0) {
    material_bsdf(v->m, w->textures, &v->s, v->wo, &v->bsdf);
  } else {
    const SurfacePoint local = local_surface(v->kappa, &v->s);
    material_bsdf(v->m, w->textures, &local, v->wo, &v->bsdf);
  }
  if (v->m->dispersion > 0) {
    const int band = p->band ? p->band - 1 : (int)(3 * path_material_pair(p).y);
    bsdf_disperse(v->m, band, !p->band, &v->bsdf);
  }
}

// --- sample lights ------------------------------------------------------------------------------

// Whether light from wl, in the chart, comes through the surface.
static inline bool path_crosses(const PathVertex *v, Vec3 wl)
{
  return (v3_dot(wl, v->s.ng) < 0) != v->s.is_back;
}

// What is absorbed on the way from s towards wl: outside nothing, inside what the body's skin says.
static inline Vec3 path_absorption_towards(const Path *p, const PathVertex *v, Vec3 wl)
{
  if (!path_crosses(v, wl) || v->m->is_thin_walled) return p->absorption;
  return v->s.is_back ? v3_all(0) : v->m->absorption;
}

// The side that light must come from to count; zero: any.
static inline Vec3 path_light_side(const Bsdf *b) { return b->glass > 0 ? v3_all(0) : b->frame.z; }

// The same in the chart, where lamps are.
static inline Vec3 path_aim_side(const PathVertex *v)
{
  return local_chart_normal(v->kappa, v->s.p, path_light_side(&v->bsdf));
}

// Light that arrives at a vertex if nothing is in its way, and the ray that asks.
typedef struct PathLight {
  PackedRay ray;
  Vec3 light; // as the eye will see it
  uint32_t seed;
  uint16_t path_i, group;
  uint32_t cell; // where the ray begins
  uint64_t plan; // the sides of gates it is aimed through, as in Way
} PathLight;

static MEDIA_APART float path_phase(const Phase *phase, Vec3 wo, Vec3 wl)
{
  return phase_pdf(phase, -wo, wl);
}

// What the vertex scatters towards its ray's origin of light from wl.
static inline __attribute__((always_inline)) Vec3 path_eval(const PathVertex *v, const BsdfView *view, Vec3 wl, float *pdf)
{
  if (!v->phase) return bsdf_eval_view(&v->bsdf, view, wl, pdf);
  *pdf = path_phase(v->phase, v->wo, wl);
  return v3_all(*pdf);
}

// The gates that an image of a lamp is seen through; image: as a LightSample has it.
static inline uint64_t light_plan(const World *w, uint32_t cell, uint32_t image)
{
  return image ? w->cells[cell].images[image - 1].word : 0;
}

// A ray to an image that misses its first gate needs no asking.
static inline bool light_meets_gate(const World *w, uint32_t cell, uint32_t image, const Ray *ray)
{
  const uint32_t first = (uint32_t)(light_plan(w, cell, image) & 0xffff) - 1;
  return gate_meet(&w->space.gates[first / 2], (int)(first & 1), ray) < ray->tmax;
}

static inline float path_light_fade(const World *w, float length)
{
  return world_has_gates(w) && length < INFINITY ? space_fade(w->fade, length) : 1;
}

// What one group of lights offers the vertex; false: nothing.
static inline bool path_sample_light(const Path *p, const PathVertex *v, const BsdfView *view, size_t group,
                                     PathLight *out)
{
  const World *w = p->pass->world;
  const Vec2 place = path_draw(p, PAIR_LIGHTS + 2 * (uint32_t)group);
  // Only emitters are chosen among.
  const LightSet *lights = world_lights(w, p->way.cell);
  const float choice = group == 0 && lights->emitter_count > 1
                           ? path_draw(p, PAIR_LIGHTS + 1).x
                           : 0;
  LightSample l;
  float scatter_pdf;
  if (!light_sample(lights, w->textures, group, v->s.p, path_aim_side(v), choice, place, &l)) return false;
  Vec3 wl;
  float length;
  local_lamp(v->kappa, v->s.p, &l, &wl, &length);
  const Vec3 f = path_eval(v, view, wl, &scatter_pdf);
  out->light = p->throughput * f * l.radiance * path_fade(path_absorption_towards(p, v, l.wl), length) *
               ((l.is_delta ? 1 : mis_weight(l.pdf, scatter_pdf)) / l.pdf);
  if (w->fade > 0) out->light *= path_light_fade(w, length);
  if (v3_is_zero(out->light)) return false;
  const Ray ray = trace_light_ray(&v->s, l.wl, l.distance);
  if (l.image && !light_meets_gate(w, p->way.cell, l.image, &ray)) return false;
  out->ray = ray_pack(&ray);
  out->seed = path_ray_seed(p, 1 + (uint32_t)group);
  out->cell = p->way.cell;
  out->plan = light_plan(w, p->way.cell, l.image);
  return true;
}

// --- scatter, and decide whether to go on -------------------------------------------------------
// A direction drawn with density pdf stands for 1/pdf of solid angle among the directions one sample could have taken,
// and for the part of it that is this sample's (Bekaert et al. 2003, "A custom designed density estimator for light
// transport", footprints from densities). A quarter of its side is an estimate, meant to keep neighbouring samples' cones
// apart; no other part was measured.
static inline void path_widen(Path *p, const BsdfSample *next, float width)
{
  p->cone.width = width;
  if (next->is_delta) return;
  p->cone.spread = max_f(p->cone.spread, min_f(0.25f * p->share / sqrtf(next->pdf), 1));
}

static inline bool path_scatter(Path *p, const PathVertex *v, const BsdfView *view, float choice, Ray *ray)
{
  BsdfSample next;
  const Bsdf *b = &v->bsdf;
  const Vec2 place = path_draw(p, PAIR_SCATTER);
  if (!bsdf_sample_view(b, view, choice, place, &next)) return false;
  p->throughput *= next.weight;
  if (v3_is_zero(p->throughput) || !v3_is_finite(p->throughput)) return false;
  const Vec3 d = local_direction(v->kappa, v->s.p, next.wl);
  if (next.is_transmission) {
    p->absorption = path_absorption_towards(p, v, d);
    if (!b->is_thin) p->eta_scale *= b->eta * b->eta;
    if (b->is_dispersed) p->band = (uint8_t)(b->band + 1);
  }
  p->scatter_pdf = v->kappa == 0 ? next.pdf : next.pdf / chart_solid_angle(v->kappa, v->s.p, next.wl);
  p->was_delta = next.is_delta;
  p->from = v->s.p;
  p->from_n = path_aim_side(v);
  p->from_cell = p->way.cell;
  path_widen(p, &next, v->width);
  *ray = (Ray){offset_origin(&v->s, d), d, 0, INFINITY};
  return true;
}

// Russian roulette (Arvo and Kirk 1990) on what the path can still bring, were it not inside a dense body: by its root, as
// what a path adds to the variance goes with the square of what it brings and must be weighed against its cost (Rath et
// al. 2022, "EARS", section 3). Twice under the root: variance times rays is 0.91 of that of a plain throughput in a
// Cornell box, 0.85 in a still life and 0.89 on terrain under a sky; without the 2, 0.92, 0.93 and 0.90.
static inline bool path_survives(Path *p, float chance)
{
  if (p->depth < p->pass->settings.roulette_depth) return true;
  const float keep = min_f(sqrtf(2 * v3_max_lane(p->throughput) * p->eta_scale), 1);
  if (!(chance < keep)) return false;
  p->throughput = p->throughput / keep;
  return true;
}

// --- in media -----------------------------------------------------------------------------------------

// What a stretch adds that begins `from` metres on.
static inline void path_add_glow(Path *p, const Volume *v, float from, float length)
{
  Volume inside = *v;
  inside.extinction += p->absorption;
  path_add(p, p->depth, p->throughput * path_fade(p->absorption, from) * volume_glow(&inside, length));
}

// Light was scattered at t by one of the media whose scattering `sum` holds.
static inline void path_note_scattering(Path *p, const MediumSet *s, const Volume *sum, const Ray *ray, float t, float choice,
                                        MediumPoint *out)
{
  out->t = t;
  out->p = ray->o + t * ray->d;
  out->medium = media_pick(p->pass->world, s, sum, out->p, choice, &p->throughput);
}

// One stretch of homogeneous media. True: light was scattered in it.
static inline bool path_through(Path *p, const MediumSet *s, const Ray *ray, float from, float to, uint32_t stretch,
                                MediumPoint *out)
{
  const Volume sum = media_sum(p->pass->world, s);
  if (!v3_is_zero(sum.emission)) path_add_glow(p, &sum, from, to - from);
  if (v3_is_zero(sum.scattering)) {
    p->throughput *= volume_fade(sum.extinction, to - from);
    return false;
  }
  const float t = volume_distance(&sum, to - from, path_media_pair(p, stretch, 0), &p->throughput);
  if (!(t < to - from)) return false;
  path_note_scattering(p, s, &sum, ray, from + t, s->count > 1 ? path_media_pair(p, stretch, 1).x : 0, out);
  return true;
}

// One stretch with media that differ from place to place. At each place where light may be met it goes on or is
// scattered, by chances that weigh channels by what the path carries (Kutz et al., "Spectral and decomposition
// tracking", 2017, section 3); in grey media that is as likely as it is in nature, and nothing needs weighing.
static inline bool path_track(Path *p, const MediumSet *s, const Ray *ray, float from, float to, MediaDice *dice,
                              MediumPoint *out)
{
  MediaTrack tracks[MOST_MEDIA];
  tracks_begin(p->pass->world, s, ray, from, to, dice, tracks);
  for (;;) {
    const uint32_t i = tracks_nearest(tracks, s->count);
    MediaTrack *k = &tracks[i];
    if (!(k->t < to)) return false;
    const Volume *v = k->volume;
    const float part = track_density(k) / k->chance;
    if (part > 0 && volume_shines(v))
      path_add(p, p->depth, p->throughput * path_fade(p->absorption, k->t) * volume_emission(v, track_place(k)) * part);
    const Vec3 met = v3_min(part * v->extinction, v3_all(1)), missed = v3_all(1) - met;
    const float meets = v3_dot(p->throughput, met), misses = v3_dot(p->throughput, missed);
    if (v3_is_zero(v->scattering)) {
      p->throughput *= missed;
    } else if (media_roll(dice) * (meets + misses) < meets) {
      p->throughput *= part * volume_scattering(v, track_place(k)) * ((meets + misses) / meets);
      *out = (MediumPoint){.p = ray->o + k->t * ray->d, .t = k->t, .medium = s->media[i]};
      return true;
    } else if (!v3_is_grey(met)) {
      p->throughput *= missed * ((meets + misses) / misses);
    }
    if (v3_is_zero(p->throughput)) return false;
    track_next(k, dice, to);
  }
}

// The same by steps.
static inline bool path_march(Path *p, const MediumSet *s, const Ray *ray, float from, float to, MediaDice *dice,
                              MediumPoint *out)
{
  const World *w = p->pass->world;
  const int32_t steps = p->pass->settings.volume_steps;
  const float length = (to - from) / (float)steps, jitter = media_roll(dice), target = -f_log(1 - media_roll(dice));
  const Vec3 share = p->throughput / (p->throughput[0] + p->throughput[1] + p->throughput[2]);
  const int c = channel_pick(p->throughput, media_roll(dice));
  Vec3 depth = v3_all(0);
  for (int32_t i = 0; i < steps; i++) {
    const float at = from + (float)i * length;
    const Volume v = media_sum_at(w, s, ray->o + (at + jitter * length) * ray->d);
    if (!v3_is_zero(v.emission)) { // by the chance to have come so far
      const Vec3 left = volume_fade(depth, 1);
      path_add(p, p->depth, p->throughput * path_fade(p->absorption, at) * (left / v3_dot(share, left)) * volume_glow(&v, length));
    }
    if (depth[c] + v.extinction[c] * length >= target && v.extinction[c] > 0) {
      const float t = max_f(target - depth[c], 0) / v.extinction[c];
      const Vec3 left = volume_fade(depth + t * v.extinction, 1);
      p->throughput *= v.scattering * left / v3_dot(share, v.extinction * left);
      path_note_scattering(p, s, &v, ray, at + t, media_roll(dice), out);
      return true;
    }
    depth += v.extinction * length;
  }
  const Vec3 left = volume_fade(depth, 1);
  p->throughput *= left / v3_dot(share, left);
  return false;
}

// Follows the ray through media to its end. True: it was scattered on the way, at *out. Glow is added for every stretch
// as a whole, so it does not matter where light is scattered.
static inline bool path_travel(Path *p, MediumSet *set, const Ray *ray, float end, RayCounters *counters, MediumPoint *out)
{
  const World *w = p->pass->world;
  Ray way = *ray;
  way.tmax = end;
  MediaWalk walk = media_walk(w, p->way.cell, &way, set, counters);
  MediaDice dice = {path_ray_seed(p, 0xffff), 0};
  if (p->piece) dice.seed = hash_combine(dice.seed, p->piece);
  bool is_scattered = false;
  for (uint32_t stretch = p->piece * STRETCHES_PAIRED; !is_scattered && media_next(&walk);) {
    if (!set->count || v3_is_zero(p->throughput)) continue;
    if (!media_differ(w, set))
      is_scattered = path_through(p, set, ray, walk.from, walk.to, stretch++, out);
    else if (p->pass->settings.volumes == VOLUMES_MARCH)
      is_scattered = path_march(p, set, ray, walk.from, walk.to, &dice, out);
    else
      is_scattered = path_track(p, set, ray, walk.from, walk.to, &dice, out);
  }
  if (!is_scattered) return false;
  out->phase = &medium_volume(w, out->medium)->phase;
  p->throughput *= path_fade(p->absorption, out->t);
  return true;
}

static MEDIA_APART bool path_scatter_medium(Path *p, const MediumPoint *at, Ray *ray)
{
  if (v3_is_zero(p->throughput) || !v3_is_finite(p->throughput)) return false;
  const Vec3 wl = phase_sample(at->phase, ray->d, path_draw(p, PAIR_SCATTER), &p->scatter_pdf);
  p->was_delta = false;
  p->from = at->p;
  p->from_n = v3_all(0);
  p->from_cell = p->way.cell;
  path_widen(p, &(BsdfSample){.pdf = p->scatter_pdf}, p->cone.width + p->cone.spread * at->t);
  *ray = (Ray){at->p, wl, 0, INFINITY};
  return true;
}

// --- what is seen first -----------------------------------------------------------------------------

static inline bool bsdf_is_delta(const Bsdf *b)
{
  const bool has_rough = (b->alpha > 0 && bsdf_has_specular(b)) || (b->coat > 0 && b->coat_alpha > 0) ||
                         (b->glass > 0 && b->is_thin && b->thin_alpha > 0) ||
                         (b->has_extras && (b->sheen_most > 0 || b->gloss.kind != GLOSS_NONE));
  return !has_rough && v3_is_zero(b->diffuse) && v3_is_zero(b->multiple);
}

// What the film keeps of the first thing seen.
static inline void path_first_hit(const RenderPass *pass, const SurfacePoint *s, const Hit *hit, Vec3 albedo,
                                  FilmSample *out)
{
  const Eye *e = &pass->eye;
  out->is_hit = true;
  out->albedo = albedo;
  out->normal = s->is_back ? -s->n : s->n;
  out->position = s->p;
  out->depth = e->kind == EYE_PANORAMIC ? hit->t : v3_dot(e->frame.p - s->p, e->frame.z);
  out->object = pass->world->instances[s->instance].object_i + 1;
  out->material = s->material + 1;
}

// What was seen through gates lies for the eye where it seems to be: along its own ray.
static inline void path_unfold(const Eye *e, const PackedRay *packed, float length, FilmSample *seen)
{
  const Ray ray = ray_unpack(packed);
  seen->position = ray.o + length * ray.d;
  seen->depth = e->kind == EYE_PANORAMIC ? length : v3_dot(e->frame.p - seen->position, e->frame.z);
}

// The same where the first thing is a medium: for what looks for edges, a surface that faces the viewer.
static inline void path_first_medium(const RenderPass *pass, const Ray *ray, const MediumPoint *at, FilmSample *out)
{
  const Eye *e = &pass->eye;
  const World *w = pass->world;
  const Volume *v = medium_volume(w, at->medium);
  const Vec3 scattering = volume_scattering(v, frame_point(&w->media[at->medium].medium_from_world, at->p));
  out->is_hit = true;
  out->albedo = v3_all(0);
  for (int k = 0; k < 3; k++) out->albedo[k] = v->extinction[k] > 0 ? scattering[k] / v->extinction[k] : 0;
  out->normal = -ray->d;
  out->position = at->p;
  out->depth = e->kind == EYE_PANORAMIC ? at->t : v3_dot(e->frame.p - at->p, e->frame.z);
  out->object = w->media[at->medium].object_i + 1; // of the atmosphere 0
  out->material = 0;
}

#endif
