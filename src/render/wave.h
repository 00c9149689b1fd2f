// Wave: paths that go side by side, a bounce at a time, so that their rays are asked together: camera rays share
// their way through the trees, shadow rays of one group of lights go alike, and bounces have other rays to work on
// while one waits for memory. A path's result does not depend on who goes beside it: its rays get the same answers
// alone, and its light is added in its own order.
//
//   wave_add a path for each sample -> wave_trace: what the camera's rays meet; shade; ask for the lights; what the
//                                      next rays meet; ...
//
// 64 paths against 256 and 1024: within 5 % either way in four scenes, so the smallest, which stays in the cache.

#ifndef RAYFOLD_RENDER_WAVE_H
#define RAYFOLD_RENDER_WAVE_H

#include "render/path.h"

enum {
  WAVE_SIZE = SAMPLER_ROWS,    // paths
  WAVE_LIGHTS = 2 * WAVE_SIZE, // rays to lights that are asked together
  LIGHT_GROUPS_APART = 4,      // whose rays are asked by themselves; those of later groups go together
  DEPTHS_APART = 3,            // likewise: first, second, later bounces
};

typedef struct Wave {
  const RenderPass *pass;
  RayCounters *counters;
  size_t count;
  Sampler samplers[WAVE_SIZE];
  Path paths[WAVE_SIZE];
  FilmSample seen[WAVE_SIZE];

  int32_t depth;
  size_t going; // paths still on their way
  uint16_t path_of[WAVE_SIZE];
  PackedRay rays[WAVE_SIZE];
  Way ways[WAVE_SIZE]; // of the rays
  TraceQuery queries[WAVE_SIZE];
  Hit hits[WAVE_SIZE];
  BatchHabit habits[DEPTHS_APART + LIGHT_GROUPS_APART];

  size_t light_count;
  PathLight lights[WAVE_LIGHTS];

  // In worlds with media: where the eye, the paths and the rays to lights are in.
  bool has_media;
  MediumSet eye_media, media[WAVE_SIZE], light_media[WAVE_LIGHTS];

  // In worlds with gates: what the camera's rays were, and, with media, who was scattered before a gate, by path.
  PackedRay eye_rays[WAVE_SIZE];
  bool is_scattered[WAVE_SIZE];
  MediumPoint scattered[WAVE_SIZE];
} Wave;

// Once for all waves of a pass.
static inline void wave_place_eye(Wave *w, const RenderPass *pass, RayCounters *counters)
{
  w->has_media = pass->world->media_count > 0 && pass->settings.integrator == INTEGRATOR_PATH;
  if (w->has_media) w->eye_media = media_at(pass->world, pass->eye.cell, pass->eye.frame.p, counters);
}

static inline void wave_begin(Wave *w, const RenderPass *pass, RayCounters *counters)
{
  w->pass = pass;
  w->counters = counters;
  w->count = w->light_count = 0;
  memset(w->habits, 0, sizeof w->habits);
}

// The media a path begins in: a lens is not all at its centre.
static MEDIA_APART void wave_place_path(Wave *w, size_t i, Vec3 from)
{
  w->media[i] = w->eye_media;
  media_move(w->pass->world, w->pass->eye.cell, &w->media[i], w->pass->eye.frame.p, from, w->counters);
}

// Adds the path of one sample of a pixel.
static inline void wave_add(Wave *w, uint32_t x, uint32_t y, uint32_t sample)
{
  const RenderPass *pass = w->pass;
  const Film *film = pass->film;
  const size_t i = w->count++;
  const Sampler sampler = sampler_begin(x, y, sample, pass->seed);
  const Vec2 off = filter_sample(&pass->filter, sample_pair(&sampler, PAIR_FILM));
  const Vec2 place = {(float)x + 0.5f + off.x, (float)y + 0.5f + off.y};
  const Vec2 lens = pass->eye.aperture > 0 ? sample_pair(&sampler, PAIR_LENS) : (Vec2){0, 0};
  const Ray ray = eye_ray(&pass->eye, (float)film->width, (float)film->height, place, lens);
  // Of n samples each stands for an n-th of the pixel. How many there will be is not known, so sample i takes its share
  // as if it were the last: the first is as smooth as one sample must be, and what filtering takes away fades with more.
  const float share = 1 / sqrtf((float)sample + 1);
  const Cone cone = eye_cone(&pass->eye, (float)film->height, ray.d);
  w->samplers[i] = sampler;
  w->paths[i] = (Path){.pass = pass,
                       .sampler = &w->samplers[i],
                       .seed = hash_combine(sampler.pixel_seed, sample),
                       .throughput = v3_all(1),
                       .eta_scale = 1,
                       .from_cell = pass->eye.cell,
                       .cone = {share * cone.width, share * cone.spread},
                       .share = share};
  w->seen[i] = (FilmSample){.alpha = 1};
  w->path_of[i] = (uint16_t)i;
  w->rays[i] = w->eye_rays[i] = ray_pack(&ray);
  const float kappa = world_curvature(pass->world, pass->eye.cell);
  if (kappa != 0) v3_store(w->rays[i].d, local_direction(kappa, ray.o, ray.d));
  w->ways[i] = way_begin(pass->eye.cell);
  w->queries[i] = (TraceQuery){pass->world, path_ray_seed(&w->paths[i], 0), 0, 0};
  w->is_scattered[i] = false;
  if (w->has_media) wave_place_path(w, i, ray.o);
}

// A ray in media comes to a gate: what becomes of its light on the way there, and what it is in beyond.
static MEDIA_APART bool wave_pass_gate(void *wave, uint16_t i, const Ray *ray, const SpaceExit *end)
{
  Wave *w = wave;
  const World *world = w->pass->world;
  const size_t path_i = w->path_of[i];
  Path *p = &w->paths[path_i];
  const Vec3 absorption = p->absorption;
  p->way = w->ways[i];
  p->piece = p->way.crossings;
  p->absorption = absorption / p->way.scale;
  w->is_scattered[path_i] = path_travel(p, &w->media[path_i], ray, end->t, w->counters, &w->scattered[path_i]);
  if (!w->is_scattered[path_i]) p->throughput *= path_fade(p->absorption, end->t);
  p->absorption = absorption;
  if (w->is_scattered[path_i]) return false;
  const GateSide *side = &world->space.gates[end->gate].side[end->side];
  Way way = w->ways[i];
  Ray there = *ray;
  uint32_t cell = side->cell;
  Vec3 at = frame_point(&side->map, ray->o + end->t * ray->d);
  if (side->curve) {
    if (!way_cross(&world->space, &way, end->gate, end->side, end->t, &there)) return true;
    cell = way.cell;
    at = there.o + there.tmin * there.d;
  }
  w->media[path_i] = media_at(world, cell, at, w->counters);
  return true;
}

static MEDIA_APART void wave_find_in_media(Wave *w, RayMask mask, BatchHabit *habit)
{
  Ways q = {.world = w->pass->world, .rays = w->rays, .ways = w->ways, .queries = w->queries, .hits = w->hits, .mask = mask,
            .counters = w->counters, .habit = habit, .passes = wave_pass_gate, .user = w, .open_count = w->going};
  for (size_t i = 0; i < w->going; i++) q.open[i] = (uint16_t)i;
  while (q.open_count) ways_step(&q);
}

// What the rays meet that are on their way.
static inline void wave_find(Wave *w, RayMask mask)
{
  *(mask == RAY_CAMERA ? &w->counters->camera_rays : &w->counters->bounce_rays) += w->going;
  BatchHabit *habit = &w->habits[w->depth < DEPTHS_APART ? w->depth : DEPTHS_APART - 1];
  if (w->has_media && world_has_gates(w->pass->world))
    wave_find_in_media(w, mask, habit);
  else
    ways_closest(w->pass->world, w->rays, w->ways, w->queries, w->going, mask, w->counters, habit, w->hits);
}

static inline void wave_look(Wave *w)
{
  w->depth = 0;
  w->going = w->count;
  wave_find(w, RAY_CAMERA);
}

// --- lights ---------------------------------------------------------------------------------------

// Asks for the rays to one group of lights, those after the last that is kept apart together.
static inline void wave_ask_lights(Wave *w, int group, bool *is_blocked)
{
  PackedRay rays[WAVE_LIGHTS];
  TraceQuery queries[WAVE_LIGHTS];
  uint8_t blocked[WAVE_LIGHTS];
  uint16_t light_of[WAVE_LIGHTS];
  Way ways[WAVE_LIGHTS];
  uint64_t plans[WAVE_LIGHTS];
  const World *world = w->pass->world;
  const bool has_gates = world_has_gates(world);
  size_t count = 0;
  for (size_t i = 0; i < w->light_count; i++) {
    const PathLight *l = &w->lights[i];
    if (l->group != group) continue;
    rays[count] = l->ray;
    queries[count] = (TraceQuery){world, l->seed, 0, 0};
    if (has_gates) {
      ways[count] = way_begin(l->cell);
      plans[count] = l->plan;
    }
    light_of[count++] = (uint16_t)i;
  }
  w->counters->shadow_rays += count;
  BatchHabit *habit = &w->habits[DEPTHS_APART + group];
  if (has_gates)
    ways_blocked(world, rays, ways, plans, queries, count, RAY_SHADOW, w->counters, habit, blocked);
  else
    cell_ask(world, 0, rays, queries, count, RAY_SHADOW, w->counters, habit, NULL, blocked);
  for (size_t k = 0; k < count; k++) is_blocked[light_of[k]] = blocked[k];
}

static MEDIA_APART void wave_fade_light(Wave *w, size_t i)
{
  PathLight *l = &w->lights[i];
  const World *world = w->pass->world;
  const RenderSettings *settings = &w->pass->settings;
  const int32_t steps = settings->volumes == VOLUMES_MARCH ? settings->volume_steps : 0;
  PackedRay packed = l->ray;
  Way way = way_begin(l->cell);
  MediumSet set = w->light_media[i];
  uint64_t plan = l->plan;
  for (uint32_t piece = 1;; piece++, plan >>= 16) {
    Ray ray = ray_unpack(&packed);
    const uint32_t gate = (uint32_t)(plan & 0xffff) - 1;
    const int side = (int)(gate & 1);
    if (plan) ray.tmax = gate_meet(&world->space.gates[gate / 2], side, &ray);
    l->light *= media_transmittance(world, way.cell, &ray, set, hash_combine(l->seed, piece), steps, w->counters);
    if (!plan || !(ray.tmax < INFINITY)) return;
    const float t = ray.tmax;
    ray.tmax = packed.tmax;
    if (!way_cross(&world->space, &way, gate / 2, side, t, &ray)) return;
    packed = ray_pack(&ray);
    way_move_origin(&way, &packed);
    set = media_at(world, way.cell, v3_load(packed.o), w->counters);
  }
}

// Adds the light that nothing is in the way of, in the order it was offered.
static inline void wave_add_lights(Wave *w)
{
  bool is_blocked[WAVE_LIGHTS];
  for (int g = 0; g < LIGHT_GROUPS_APART; g++) wave_ask_lights(w, g, is_blocked);
  for (size_t i = 0; i < w->light_count; i++) {
    const PathLight *l = &w->lights[i];
    if (is_blocked[i]) continue;
    if (w->has_media) wave_fade_light(w, i);
    path_add(&w->paths[l->path_i], w->depth + 1, l->light);
  }
  w->light_count = 0;
}

static inline void wave_sample_lights(Wave *w, const Path *p, const PathVertex *v, const BsdfView *view)
{
  const size_t groups = light_group_count(world_lights(w->pass->world, p->way.cell));
  for (size_t g = 0; g < groups; g++) {
    if (w->light_count == WAVE_LIGHTS) wave_add_lights(w);
    PathLight *l = &w->lights[w->light_count];
    if (!path_sample_light(p, v, view, g, l)) continue;
    if (w->has_media) {
      MediumSet *media = &w->light_media[w->light_count];
      *media = w->media[p - w->paths];
      if (path_crosses(v, v3_load(l->ray.d)))
        media_cross_surface(w->pass->world, media, v->s.instance, !v->s.is_back);
    }
    l->path_i = (uint16_t)(p - w->paths);
    l->group = (uint16_t)(g < LIGHT_GROUPS_APART ? g : LIGHT_GROUPS_APART - 1);
    w->light_count++;
  }
}

// --- one bounce of all ------------------------------------------------------------------------------

// Takes a path through the media on its way. True if it is scattered there.
static MEDIA_APART bool wave_travel(Wave *w, Path *p, const Ray *ray, float end, MediumPoint *at, FilmSample *seen)
{
  const size_t i = (size_t)(p - w->paths);
  p->piece = p->way.crossings;
  if (w->is_scattered[i])
    *at = w->scattered[i];
  else if (!path_travel(p, &w->media[i], ray, end, w->counters, at))
    return false;
  w->is_scattered[i] = false;
  if (p->depth == 0) {
    path_first_medium(w->pass, ray, at, seen);
    if (p->way.is_moved) path_unfold(&w->pass->eye, &w->eye_rays[i], way_length(&p->way, at->t), seen);
  }
  return true;
}

// Takes a path to the surface where its ray ends. True unless it ends there, too.
static inline bool wave_arrive(Wave *w, Path *p, const Ray *ray, const Hit *hit, PathVertex *v, FilmSample *seen)
{
  if (hit->instance == NO_HIT) {
    if (p->depth == 0 && w->pass->settings.transparent && !p->way.is_lost)
      seen->alpha = w->has_media ? 1 - v3_mean(p->throughput) : 0; // media cover by what they take
    else
      path_add_sky(p, ray, hit->t);
    return false;
  }
  path_arrive(p, ray, hit, v);
  if (p->depth == 0) {
    path_first_hit(w->pass, &v->s, hit, bsdf_albedo(&v->bsdf), seen);
    if (p->way.is_moved || v->kappa != 0)
      path_unfold(&w->pass->eye, &w->eye_rays[p - w->paths], way_length(&p->way, local_length(v->kappa, ray, hit->t)), seen);
  }
  return v->m->kind != SURFACE_EMISSION;
}

// Takes a path to its next vertex. True, and the ray to go on by, unless the path ends there.
static inline bool wave_step(void *wave, Path *p, Ray *ray, const Hit *hit, FilmSample *seen)
{
  Wave *w = wave;
  PathVertex v;
  MediumPoint at;
  const bool is_lost = world_has_gates(w->pass->world) && p->way.is_lost; // what is in its way was seen to at the gate
  const bool is_inside = w->has_media && !is_lost && wave_travel(w, p, ray, hit->t, &at, seen);
  if (is_inside)
    v = (PathVertex){.phase = at.phase, .s = {.p = at.p}, .wo = -ray->d};
  else if (!wave_arrive(w, p, ray, hit, &v, seen))
    return false;
  if (p->depth >= w->pass->settings.max_depth) return false;
  const BsdfView view = is_inside ? (BsdfView){0} : bsdf_view(&v.bsdf, frame_local(&v.bsdf.frame, v.wo));
  if (is_inside || !bsdf_is_delta(&v.bsdf)) wave_sample_lights(w, p, &v, &view);
  const Vec2 choices = path_draw(p, PAIR_CHOICES);
  if (is_inside) return path_scatter_medium(p, &at, ray) && path_survives(p, choices.y);
  if (!path_scatter(p, &v, &view, choices.x, ray)) return false;
  if (w->has_media && path_crosses(&v, ray->d))
    media_cross_surface(w->pass->world, &w->media[p - w->paths], v.s.instance, !v.s.is_back);
  return path_survives(p, choices.y);
}

// The numbers that nearly every vertex needs, of all paths together: one by one they took a sixth of the time in a
// Cornell box.
static inline void wave_draw(Wave *w)
{
  SamplerRows rows = {0};
  uint32_t x[SAMPLER_ROWS], y[SAMPLER_ROWS];
  for (size_t i = 0; i < w->going; i++) sampler_rows_set(&rows, i, &w->samplers[w->path_of[i]]);
  for (uint32_t which = 0; w->going && which < PAIRS_DRAWN; which++) {
    sample_rows(&rows, w->going, path_pair(&w->paths[w->path_of[0]], which), x, y);
    for (size_t i = 0; i < w->going; i++)
      w->paths[w->path_of[i]].drawn[which] = (Vec2){unit_float(x[i]), unit_float(y[i])};
  }
}

// Asks memory for the triangles of all hits, so that shading waits for it once and not once a path.
static inline void wave_fetch(const Wave *w)
{
  const WorldInstance *instances = w->pass->world->instances;
  for (size_t i = 0; i < w->going; i++) {
    const Hit *h = &w->hits[i];
    if (h->instance != NO_HIT && instances[h->instance].mesh.triangles)
      mesh_fetch_indices(&instances[h->instance].mesh, h->prim);
  }
  for (size_t i = 0; i < w->going; i++) {
    const Hit *h = &w->hits[i];
    if (h->instance != NO_HIT && instances[h->instance].mesh.triangles)
      mesh_fetch_vertices(&instances[h->instance].mesh, h->prim);
  }
}

// What takes a path to its next vertex, for wave_advance().
typedef bool WaveStep(void *user, Path *p, Ray *ray, const Hit *hit, FilmSample *seen);

// Takes all that are on their way to their next vertices and keeps those that go on. Always inlined, so that `step` is no
// call.
static inline __attribute__((always_inline)) void wave_advance(Wave *w, WaveStep *step, void *user)
{
  size_t left = 0;
  wave_fetch(w);
  wave_draw(w);
  for (size_t i = 0; i < w->going; i++) {
    const size_t path_i = w->path_of[i];
    Path *p = &w->paths[path_i];
    Ray ray = ray_unpack(&w->rays[i]);
    p->way = w->ways[i];
    if (p->way.crossings) path_rescale(p);
    if (!step(user, p, &ray, &w->hits[i], &w->seen[path_i])) continue;
    p->depth++;
    w->path_of[left] = (uint16_t)path_i;
    w->rays[left] = ray_pack(&ray);
    w->ways[left] = way_begin(p->way.cell);
    w->queries[left++].seed = path_ray_seed(p, 0);
  }
  wave_add_lights(w);
  w->going = left;
}

static inline void wave_shade(Wave *w)
{
  wave_advance(w, wave_step, w);
}

// What the paths see is in w->seen.
static inline void wave_trace(Wave *w)
{
  wave_look(w);
  for (wave_shade(w); w->going; wave_shade(w)) {
    w->depth++;
    wave_find(w, RAY_BOUNCE);
  }
  for (size_t i = 0; i < w->count; i++) w->seen[i].radiance = w->paths[i].radiance;
}

#endif
