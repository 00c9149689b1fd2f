// Classic: light as ray tracers of the studio's kind have it (GO-Draaw's V1, docs/lights.md): at each surface along a
// chain of mirror rays direct light, and `scatter` rays by the cosine that look once at what lies around. A chain has
// max_depth surfaces. Splitting is by lobes: what is matt goes to the scatter rays, all else to the chain's next ray; both
// halves are weighed against aiming at lights, so with one matt surface this is the path tracer of depth 2, exactly.
//
//   chain     eye - - - o - - - - - o - - - - - o         one ray each; what it meets last only shines
//                      / | .       / | .
//   scatter           o  o  o     o  o  o                  meets shine, and are lit by what can be aimed at and by the sky
//
// Of what the original did wrong this mends: its mirror ray went where the light's would, so reflections did not follow
// the eye; scatter rays took surfaces' colours unlit; shadow rays did not end at the light; highlights had no exponent;
// rays that met nothing were black.
//
// Light that is scattered twice by matt surfaces is not in it, nor what rough glass does to light from lamps after it.

#ifndef RAYFOLD_RENDER_CLASSIC_H
#define RAYFOLD_RENDER_CLASSIC_H

#include "render/wave.h"

typedef struct Classic {
  Wave chain, side;
  uint32_t x[WAVE_SIZE], y[WAVE_SIZE], sample; // of the chain's paths
  uint16_t owner[WAVE_SIZE];                   // the chain's path that sent a side path
  Vec3 scattered[WAVE_SIZE];                   // what came back, by the chain's path
} Classic;

// How a surface scatters, in two.
typedef struct ClassicLobes {
  BsdfView view;
  float count; // scatter rays
  bool has_shine;
  Bsdf shine; // the Bsdf without what is matt; unset where nothing else is
  BsdfView shine_view;
} ClassicLobes;

static inline ClassicLobes classic_lobes(const PathVertex *v, float count)
{
  const Vec3 wo = frame_local(&v->bsdf.frame, v->wo);
  ClassicLobes l;
  l.view = bsdf_view(&v->bsdf, wo);
  l.count = count;
  l.has_shine = bsdf_has_specular(&v->bsdf) || v->bsdf.coat > 0 || v->bsdf.has_extras;
  if (!l.has_shine) return l;
  l.shine = v->bsdf;
  l.shine.diffuse = l.shine.multiple = v3_all(0);
  l.shine.cover0 = l.shine.cover90 = 0; // of nothing
  l.shine_view = bsdf_view(&l.shine, wo);
  return l;
}

// --- lights ---------------------------------------------------------------------------------------
// wl and distance are those of the chart, length is the true one.
static inline void classic_push(Wave *w, const Path *p, const PathVertex *v, size_t group, Vec3 wl, float distance,
                                float length, uint32_t image, Vec3 light)
{
  light = light * path_fade(path_absorption_towards(p, v, wl), length);
  if (v3_is_zero(light)) return;
  if (w->light_count == WAVE_LIGHTS) wave_add_lights(w);
  const Ray ray = trace_light_ray(&v->s, wl, distance);
  w->lights[w->light_count++] =
      (PathLight){.ray = ray_pack(&ray),
                  .light = light,
                  .seed = path_ray_seed(p, 1 + (uint32_t)group),
                  .path_i = (uint16_t)(p - w->paths),
                  .group = (uint16_t)(group < LIGHT_GROUPS_APART ? group : LIGHT_GROUPS_APART - 1),
                  .cell = p->way.cell,
                  .plan = light_plan(p->pass->world, p->way.cell, image)};
}

static inline bool classic_aim(const Path *p, const PathVertex *v, size_t group, LightSample *l)
{
  const World *w = p->pass->world;
  const LightSet *lights = world_lights(w, p->way.cell);
  const float choice = group == 0 && lights->emitter_count > 1 ? path_draw(p, PAIR_LIGHTS + 1).x : 0;
  return light_sample(lights, w->textures, group, v->s.p, path_aim_side(v), choice,
                      path_draw(p, PAIR_LIGHTS + 2 * (uint32_t)group), l);
}

// Each half of the surface weighs aiming against its own rays.
static inline void classic_chain_lights(Wave *w, const Path *p, const PathVertex *v, const ClassicLobes *lobes)
{
  const size_t groups = light_group_count(world_lights(w->pass->world, p->way.cell));
  for (size_t g = 0; g < groups; g++) {
    LightSample l;
    Vec3 shine = v3_all(0), wl;
    float pdf = 0, length;
    if (!classic_aim(p, v, g, &l)) continue;
    local_lamp(v->kappa, v->s.p, &l, &wl, &length);
    const Vec3 matt = bsdf_eval_matt(&v->bsdf, &lobes->view, wl);
    if (lobes->has_shine) shine = bsdf_eval_view(&lobes->shine, &lobes->shine_view, wl, &pdf);
    const float cosine = max_f(v3_dot(wl, v->bsdf.frame.z), 0);
    const float matt_weight = l.is_delta ? 1 : mis_weight(l.pdf, lobes->count * cosine / PI);
    const float shine_weight = l.is_delta ? 1 : mis_weight(l.pdf, pdf);
    const Vec3 f = matt * matt_weight + shine * shine_weight;
    classic_push(w, p, v, g, l.wl, l.distance, length, l.image,
                 p->throughput * f * l.radiance * (path_light_fade(w->pass->world, length) / l.pdf));
  }
}

static inline bool classic_sky_is_black(const SkyMap *sky)
{
  return sky->kind == SKY_MAP_CONSTANT && v3_is_zero(sky->color * sky->gain);
}

// A ray that nobody aims may go through gates to another cell's sky, or be lost among them: what it brings in the end. A
// sky of this cell that is aimed at brings nothing.
static inline Vec3 classic_sky_beyond(const Wave *w, const Path *p, const PathVertex *v, Vec3 wl, size_t group)
{
  const World *world = w->pass->world;
  Ray ray = trace_light_ray(&v->s, wl, INFINITY);
  Way way = way_begin(p->way.cell);
  Hit hit;
  const bool is_hit = way_closest(world, &ray, &way, RAY_SHADOW, path_ray_seed(p, 1 + (uint32_t)group), w->counters, &hit);
  const SkyMap *sky = &world_lights(world, way.cell)->sky;
  if (!is_hit && !way.crossings && !way.is_lost) return sky->is_sampled ? v3_all(0) : sky_radiance(sky, ray.d);
  if (!is_hit) return path_sky_left(world, &way, &ray, hit.t, sky_radiance(sky, ray.d));
  const float length = local_length(world_curvature(world, way.cell), &ray, hit.t);
  return world->fade_color * (1 - space_fade(world->fade, way_length(&way, length)));
}

// Where a scatter ray ends no ray goes on, so aiming has all the weight, and a sky that is not aimed at is asked for; in
// worlds with gates at once, so that what is left to ask is a ray of no length.
static inline void classic_side_lights(Wave *w, const Path *p, const PathVertex *v)
{
  const LightSet *lights = world_lights(w->pass->world, p->way.cell);
  const size_t groups = light_group_count(lights);
  const BsdfView view = bsdf_view(&v->bsdf, frame_local(&v->bsdf.frame, v->wo));
  const bool has_gates = world_has_gates(w->pass->world);
  for (size_t g = 0; g < groups; g++) {
    LightSample l;
    float pdf, length;
    Vec3 wl;
    if (!classic_aim(p, v, g, &l)) continue;
    local_lamp(v->kappa, v->s.p, &l, &wl, &length);
    const Vec3 f = bsdf_eval_view(&v->bsdf, &view, wl, &pdf);
    classic_push(w, p, v, g, l.wl, l.distance, length, l.image,
                 p->throughput * f * l.radiance * (path_light_fade(w->pass->world, length) / l.pdf));
  }
  BsdfSample next;
  if ((!has_gates && (lights->sky.is_sampled || classic_sky_is_black(&lights->sky))) ||
      !bsdf_sample_view(&v->bsdf, &view, path_draw(p, PAIR_CHOICES).x, path_draw(p, PAIR_SCATTER), &next))
    return;
  next.wl = local_direction(v->kappa, v->s.p, next.wl);
  const Vec3 weight = p->throughput * next.weight;
  if (has_gates)
    classic_push(w, p, v, groups, next.wl, 0, INFINITY, 0, weight * classic_sky_beyond(w, p, v, next.wl, groups));
  else
    classic_push(w, p, v, groups, next.wl, INFINITY, INFINITY, 0, weight * sky_radiance(&lights->sky, next.wl));
}

// --- scatter ------------------------------------------------------------------------------------------
static inline void classic_side_shade(Wave *w, Path *p, const Ray *ray, const Hit *hit)
{
  PathVertex v;
  if (hit->instance == NO_HIT) {
    path_add_sky(p, ray, hit->t);
    return;
  }
  path_arrive(p, ray, hit, &v);
  if (v.m->kind != SURFACE_EMISSION && !bsdf_is_delta(&v.bsdf)) classic_side_lights(w, p, &v);
}

// Sends the side paths that wait and hands what they find to those who sent them.
static inline void classic_flush(Classic *c)
{
  Wave *w = &c->side;
  w->depth = 1;
  w->going = w->count;
  if (w->going) {
    wave_find(w, RAY_BOUNCE);
    wave_fetch(w);
    wave_draw(w);
  }
  for (size_t i = 0; i < w->going; i++) {
    const Ray ray = ray_unpack(&w->rays[i]);
    w->paths[i].way = w->ways[i];
    if (w->ways[i].crossings) path_rescale(&w->paths[i]);
    classic_side_shade(w, &w->paths[i], &ray, &w->hits[i]);
  }
  wave_add_lights(w);
  for (size_t i = 0; i < w->going; i++) c->scattered[c->owner[i]] += w->paths[i].radiance;
  w->count = 0;
}

static inline void classic_send(Classic *c, const Path *p, const PathVertex *v, const ClassicLobes *lobes,
                                const Sampler *sampler, Vec2 u)
{
  const Vec3 local = sample_cosine(u), wl = v3_normalize(frame_vector(&v->bsdf.frame, local));
  const Vec3 matt = bsdf_eval_matt(&v->bsdf, &lobes->view, wl);
  if (v3_is_zero(matt) || !(local[2] > 0)) return;
  if (c->side.count == WAVE_SIZE) classic_flush(c);
  Wave *w = &c->side;
  const size_t i = w->count++;
  const Vec3 d = local_direction(v->kappa, v->s.p, wl);
  const Ray ray = {offset_origin(&v->s, d), d, 0, INFINITY};
  const float pdf = lobes->count * local[2] / PI;
  w->samplers[i] = *sampler;
  w->paths[i] = (Path){.pass = p->pass,
                       .sampler = &w->samplers[i],
                       .seed = hash_combine(p->seed, sampler->sample),
                       .depth = 1,
                       .throughput = p->throughput * matt * (PI / (local[2] * lobes->count)),
                       .absorption = path_absorption_towards(p, v, d),
                       .eta_scale = 1,
                       .from = v->s.p,
                       .from_n = path_aim_side(v),
                       .from_cell = p->way.cell,
                       .scatter_pdf = v->kappa == 0 ? pdf : pdf / chart_solid_angle(v->kappa, v->s.p, wl),
                       .cone = p->cone,
                       .share = p->share,
                       .band = p->band};
  path_widen(&w->paths[i], &(BsdfSample){.pdf = pdf}, v->width);
  c->owner[i] = (uint16_t)(p - c->chain.paths);
  w->path_of[i] = (uint16_t)i;
  w->rays[i] = ray_pack(&ray);
  w->ways[i] = way_begin(p->way.cell);
  w->queries[i] = (TraceQuery){p->pass->world, path_ray_seed(&w->paths[i], 0), 0, 0};
}

// The pair of many samplers at once. By itself, so that the compiler has room to work on a register full of them.
static __attribute__((noinline)) void classic_draw(const Sampler *samplers, uint32_t count, Vec2 *out)
{
  SamplerRows rows;
  uint32_t x[SAMPLER_ROWS], y[SAMPLER_ROWS];
  const uint32_t end = (count + 15) & ~15u;
  for (uint32_t k = 0; k < end; k++) sampler_rows_set(&rows, k, &samplers[k < count ? k : 0]);
  sample_rows(&rows, count, PAIR_VERTEX + PAIR_SCATTER, x, y);
  for (uint32_t k = 0; k < count; k++) out[k] = (Vec2){unit_float(x[k]), unit_float(y[k])};
}

// The scatter rays of one surface are samples of one sequence that goes on with the pixel's samples, so that they lie
// evenly among themselves and with those of the samples before.
static inline void classic_scatter(Classic *c, const Path *p, const PathVertex *v, const ClassicLobes *lobes)
{
  const uint32_t count = (uint32_t)lobes->count, at = (uint32_t)(p - c->chain.paths);
  const uint32_t seed = hash_combine(p->pass->seed, 0x5ca77e5u + (uint32_t)p->depth);
  for (uint32_t first = 0; first < count; first += SAMPLER_ROWS) {
    const uint32_t chunk = count - first < SAMPLER_ROWS ? count - first : SAMPLER_ROWS;
    Sampler samplers[SAMPLER_ROWS];
    Vec2 u[SAMPLER_ROWS];
    for (uint32_t k = 0; k < chunk; k++)
      samplers[k] = sampler_begin(c->x[at], c->y[at], c->sample * count + first + k, seed);
    classic_draw(samplers, chunk, u);
    for (uint32_t k = 0; k < chunk; k++) classic_send(c, p, v, lobes, &samplers[k], u[k]);
  }
}

// --- the chain ------------------------------------------------------------------------------------------
// Takes a path to where its ray ends. True, and the ray to go on by, unless the chain ends there.
static inline bool classic_step(void *classic, Path *p, Ray *ray, const Hit *hit, FilmSample *seen)
{
  Classic *c = classic;
  const RenderPass *pass = p->pass;
  PathVertex v;
  if (hit->instance == NO_HIT) {
    if (p->depth == 0 && pass->settings.transparent && !p->way.is_lost)
      seen->alpha = 0;
    else
      path_add_sky(p, ray, hit->t);
    return false;
  }
  path_arrive(p, ray, hit, &v);
  if (p->depth == 0) {
    path_first_hit(pass, &v.s, hit, bsdf_albedo(&v.bsdf), seen);
    if (p->way.is_moved || v.kappa != 0)
      path_unfold(&pass->eye, &c->chain.eye_rays[p - c->chain.paths], way_length(&p->way, local_length(v.kappa, ray, hit->t)), seen);
  }
  if (p->depth >= pass->settings.max_depth || v.m->kind == SURFACE_EMISSION) return false;
  const bool is_matt = !v3_is_zero(v.bsdf.diffuse) || !v3_is_zero(v.bsdf.multiple);
  const ClassicLobes lobes = classic_lobes(&v, is_matt ? (float)pass->settings.scatter : 0);
  if (!bsdf_is_delta(&v.bsdf)) classic_chain_lights(&c->chain, p, &v, &lobes);
  classic_scatter(c, p, &v, &lobes);
  if (!lobes.has_shine) return false;
  v.bsdf = lobes.shine;
  const BsdfView view = bsdf_view(&v.bsdf, frame_local(&v.bsdf.frame, v.wo));
  return path_scatter(p, &v, &view, path_draw(p, PAIR_CHOICES).x, ray);
}

static inline void classic_shade(Classic *c)
{
  wave_advance(&c->chain, classic_step, c);
  classic_flush(c);
}

// What the paths see is in c->chain.seen.
static inline void classic_trace(Classic *c)
{
  Wave *w = &c->chain;
  for (size_t i = 0; i < w->count; i++) c->scattered[i] = v3_all(0);
  wave_look(w);
  for (classic_shade(c); w->going; classic_shade(c)) {
    w->depth++;
    wave_find(w, RAY_BOUNCE);
  }
  for (size_t i = 0; i < w->count; i++) w->seen[i].radiance = w->paths[i].radiance + c->scattered[i];
}

static inline void classic_begin(Classic *c, const RenderPass *pass, RayCounters *counters, uint32_t sample)
{
  wave_begin(&c->chain, pass, counters);
  wave_begin(&c->side, pass, counters);
  c->sample = sample;
}

static inline void classic_add(Classic *c, uint32_t x, uint32_t y)
{
  c->x[c->chain.count] = x;
  c->y[c->chain.count] = y;
  wave_add(&c->chain, x, y, c->sample);
}

#endif
