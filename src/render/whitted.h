// Whitted: direct light, mirror rays and refracted rays, all of them and no chance (Whitted, "An improved illumination
// model for shaded display", 1980). A pixel's tree of rays is a list of work: each entry is a ray, what it may still
// bring to its pixel, and what it is inside of. The newest 64 entries go at once, so that their rays and their shadow
// rays are asked together, and what they send on comes next: the list stays as deep as the tree, not as wide.
//
//   list  [ ... | 64 newest ] --> closest hits --> light by light: shadow rays --> mirror and refracted rays --> list
//
// Sums are integers of 2^-28 like the film's, so a pixel does not depend on who was traced beside it. A signature tells
// what a pixel is made of: objects met and lights that reach them, at the eye's ray, along mirror rays to the second and
// refracted rays to the third surface; equal ones may be interpolated (subsample.h).
//
// How surfaces count (docs/shapes.md has the table): `light_model` "scene" takes what the material is; the others give
// every material one of three. In "physical" units lights fall off and highlights lose no energy, and the scene's own
// materials are those of the path tracer, to the bit; in "classic" units a point's intensity arrives undiminished, matt
// surfaces show diffuse * cosine, highlights specular * cosine^exponent.
//
// Rough mirrors and rough glass are taken for smooth ones, weaker the rougher a mirror is. More than MOST_LIGHTS lights
// are not all asked: one of them by chance, as the path tracer does.

#ifndef RAYFOLD_RENDER_WHITTED_H
#define RAYFOLD_RENDER_WHITTED_H

#include "render/wave.h"

enum {
  WHITTED_SIZE = WAVE_SIZE, // rays that go at once
  MOST_LEVELS = 24,         // max_depth counts up to here
  WHITTED_LIST = WHITTED_SIZE * (MOST_LEVELS + 2),
  MOST_LIGHTS = 32,         // one bit each in a signature
  MOST_PANES = 32,          // transparent surfaces a shadow ray may pass
};

typedef struct WhittedRay {
  PackedRay ray;
  Vec3 weight, absorption; // absorption: per metre, where it is
  Cone cone;
  uint32_t way; // a hash of mirror and refraction so far: the place in the tree
  uint16_t pixel;
  uint8_t level;
  bool is_refracted; // all the way
} WhittedRay;

// A place that is hit, and what the model needs of it.
typedef struct WhittedPoint {
  SurfacePoint s;
  const SurfaceMaterial *m;
  Vec3 wo, n;                // n on wo's side
  Vec3 diffuse, specular, f0; // of the classic models
  float exponent, facets;    // of phong; of cook_torrance the m
  Vec3 mirror, passed;       // weights of the rays sent on
  uint32_t lit;
  float width;
  uint16_t ray_i;
} WhittedPoint;

typedef struct Whitted {
  const RenderPass *pass;
  RayCounters *counters;
  size_t count; // pixels
  Sampler samplers[WHITTED_SIZE];
  FilmSample seen[WHITTED_SIZE];
  uint32_t signature[WHITTED_SIZE];
  int64_t sums[WHITTED_SIZE][3];

  size_t height; // of the list
  WhittedRay list[WHITTED_LIST];

  // Of the 64 that go.
  size_t going, point_count;
  WhittedRay rays[WHITTED_SIZE];
  Hit hits[WHITTED_SIZE];
  WhittedPoint points[WHITTED_SIZE];
  BatchHabit habits[4];
} Whitted;

static inline void whitted_begin(Whitted *t, const RenderPass *pass, RayCounters *counters)
{
  t->pass = pass;
  t->counters = counters;
  t->count = t->height = 0;
  memset(t->habits, 0, sizeof t->habits);
}

// Adds one sample of a pixel.
static inline void whitted_add(Whitted *t, uint32_t x, uint32_t y, uint32_t sample)
{
  const RenderPass *pass = t->pass;
  const float width = (float)pass->film->width, height = (float)pass->film->height;
  const size_t i = t->count++;
  const Sampler sampler = sampler_begin(x, y, sample, pass->seed);
  const Vec2 off = filter_sample(&pass->filter, sample_pair(&sampler, PAIR_FILM));
  const Vec2 lens = pass->eye.aperture > 0 ? sample_pair(&sampler, PAIR_LENS) : (Vec2){0, 0};
  const Ray ray = eye_ray(&pass->eye, width, height, (Vec2){(float)x + 0.5f + off.x, (float)y + 0.5f + off.y}, lens);
  const float share = 1 / sqrtf((float)sample + 1);
  const Cone cone = pass->world->whitted.filter_textures ? eye_cone(&pass->eye, height, ray.d) : (Cone){0, 0};
  t->samplers[i] = sampler;
  t->seen[i] = (FilmSample){.alpha = 1};
  t->signature[i] = 0;
  memset(t->sums[i], 0, sizeof t->sums[i]);
  t->list[t->height++] = (WhittedRay){.ray = ray_pack(&ray), .weight = v3_all(1), .way = 1, .pixel = (uint16_t)i,
                                      .cone = {share * cone.width, share * cone.spread}, .is_refracted = true};
}

static inline void whitted_pay(Whitted *t, const WhittedRay *r, Vec3 light)
{
  const Vec3 l = r->weight * light;
  for (int k = 0; k < 3; k++) t->sums[r->pixel][k] += film_fixed(l[k]);
}

static inline uint32_t whitted_seed(const Whitted *t, const WhittedRay *r, uint32_t which)
{
  const Sampler *s = &t->samplers[r->pixel];
  return hash_combine(hash_combine(hash_combine(s->pixel_seed, s->sample), r->way), which);
}

static inline void whitted_ask(Whitted *t, const PackedRay *rays, size_t count, RayMask mask, const TraceQuery *queries,
                               int habit, Hit *hits, uint8_t *blocked)
{
  accel_ask(&(Batch){.accel = t->pass->world->accel, .rays = rays, .count = count, .mask = mask, .filter = trace_counts,
                     .user = queries, .user_stride = sizeof *queries, .counters = t->counters,
                     .habit = &t->habits[habit], .hits = hits, .blocked = blocked});
}

// --- what is met --------------------------------------------------------------------------------------

// Rays that start at the eye see what the camera may see, others what it may not, too. Where there is a background it
// is asked of the rays alone that met no actor.
static inline void whitted_find_masked(Whitted *t, bool is_first, RayMask camera, RayMask bounce)
{
  for (int pass = 0; pass < 2; pass++) { // camera rays; others
    PackedRay rays[WHITTED_SIZE];
    TraceQuery queries[WHITTED_SIZE];
    Hit hits[WHITTED_SIZE];
    uint16_t of[WHITTED_SIZE];
    size_t count = 0;
    for (size_t i = 0; i < t->going; i++) {
      const WhittedRay *r = &t->rays[i];
      if ((r->level > 0) != pass || (!is_first && t->hits[i].instance != NO_HIT)) continue;
      rays[count] = r->ray;
      queries[count] = (TraceQuery){t->pass->world, whitted_seed(t, r, 0)};
      of[count++] = (uint16_t)i;
    }
    if (!count) continue;
    *(pass ? &t->counters->bounce_rays : &t->counters->camera_rays) += count;
    whitted_ask(t, rays, count, pass ? bounce : camera, queries, pass, hits, NULL);
    for (size_t k = 0; k < count; k++) t->hits[of[k]] = hits[k];
  }
}

static inline void whitted_find(Whitted *t)
{
  if (!t->pass->world->has_background) {
    whitted_find_masked(t, true, RAY_CAMERA, RAY_BOUNCE);
    return;
  }
  whitted_find_masked(t, true, RAY_ACTOR_CAMERA, RAY_ACTOR_BOUNCE);
  whitted_find_masked(t, false, RAY_BACKGROUND_CAMERA, RAY_BACKGROUND_BOUNCE);
}

// --- what a surface is ----------------------------------------------------------------------------------

// A highlight's exponent and facets of the same width as GGX's: alpha = roughness^2 is the facets' slope, and Phong's
// lobe of equal slope has 2 / alpha^2 - 2 (Walter et al. 2007, section 5.2, for Blinn's; the mirror direction turns twice
// as fast, so a quarter).
static inline void whitted_widths(WhittedPoint *p, float roughness)
{
  const float alpha = max_f(roughness * roughness, 0.02f);
  p->exponent = max_f((2 / (alpha * alpha) - 2) / 4, 1);
  p->facets = alpha;
}

static inline void whitted_surface(const World *w, WhittedPoint *p)
{
  const SurfaceMaterial *m = p->m;
  const Vec3 color = clamp_color(m->color * texture_color(w->textures, m->color_map, &p->s) * v3_load(p->s.color));
  p->diffuse = p->specular = p->mirror = p->passed = v3_all(0);
  p->f0 = v3_all(fresnel_f0(m->ior));
  whitted_widths(p, m->roughness);
  const float smooth = sqr_f(1 - m->roughness);
  switch ((SurfaceKind)m->kind) {
  case SURFACE_PBR: {
    const float metal = clamp_f(m->metallic * texture_channel(w->textures, m->metallic_map, &p->s), 0, 1);
    const float through = (1 - metal) * clamp_f(m->transmission * texture_channel(w->textures, m->transmission_map, &p->s), 0, 1);
    p->diffuse = color * (1 - metal - through);
    p->f0 = metal * color + (1 - metal) * p->f0 * m->specular;
    p->specular = v3_all(1);
    p->mirror = smooth * p->f0 * (1 - through);
    p->passed = through * color;
    return;
  }
  case SURFACE_LAMBERT: p->diffuse = color; return;
  case SURFACE_MIRROR:
    p->f0 = p->mirror = color;
    p->specular = v3_all(1);
    return;
  case SURFACE_GLASS:
    p->specular = v3_all(1);
    p->passed = color;
    return;
  case SURFACE_PHONG:
  case SURFACE_COOK_TORRANCE:
    p->diffuse = color;
    p->specular = m->specular_color;
    p->f0 = m->kind == SURFACE_PHONG ? p->f0 : m->gloss_f0;
    if (m->kind == SURFACE_PHONG) {
      p->exponent = m->gloss_width;
      p->facets = sqrtf(2 / (4 * p->exponent + 2));
    } else {
      p->facets = m->gloss_width;
      p->exponent = max_f((2 / sqr_f(p->facets) - 2) / 4, 1);
    }
    p->mirror = m->mirrored;
    p->passed = m->passed;
    return;
  case SURFACE_EMISSION:
  case SURFACE_MIX: return;
  }
  unreachable();
}

// The model a surface is lit by.
typedef enum WhittedModel { WHITTED_OWN, WHITTED_LAMBERT, WHITTED_PHONG, WHITTED_COOK_TORRANCE } WhittedModel;

static inline WhittedModel whitted_model(const WhittedSettings *set, const SurfaceMaterial *m)
{
  switch ((LightModel)set->light_model) {
  case LIGHT_MODEL_LAMBERT: return WHITTED_LAMBERT;
  case LIGHT_MODEL_PHONG: return WHITTED_PHONG;
  case LIGHT_MODEL_COOK_TORRANCE: return WHITTED_COOK_TORRANCE;
  case LIGHT_MODEL_SCENE: break;
  }
  if (set->light_units == LIGHT_UNITS_PHYSICAL) return WHITTED_OWN;
  if (m->kind == SURFACE_LAMBERT) return WHITTED_LAMBERT;
  return m->kind == SURFACE_PHONG ? WHITTED_PHONG : WHITTED_COOK_TORRANCE;
}

// Cook and Torrance 1982 as the intro's thesis has it: F R G / ((N.V)(N.L)), times N.L; F is Schlick's, the facets lie by
// exp(-(angle / m)^2), or by the material's c times that.
static inline Vec3 whitted_facets(const WhittedPoint *p, Vec3 wl, float n_l)
{
  const Vec3 h = v3_normalize(p->wo + wl);
  const float n_h = clamp_f(v3_dot(p->n, h), 0, 1), n_v = max_f(v3_dot(p->n, p->wo), 1e-3f), v_h = max_f(v3_dot(p->wo, h), 1e-3f);
  const float given = p->m->kind == SURFACE_COOK_TORRANCE ? p->m->gloss_given_c : 0;
  const float rough = (given > 0 ? given : 1) * f_exp(-sqr_f(f_acos(n_h) / p->facets));
  const float masked = min_f(1, 2 * n_h * min_f(n_v, n_l) / v_h), x = fresnel_schlick(v_h);
  return (p->f0 + (v3_all(1) - p->f0) * x) * (rough * masked / n_v);
}

// What the surface sends to the eye of light that arrives from wl, 1 a square metre across it.
static inline Vec3 whitted_reflect(const WhittedPoint *p, WhittedModel model, bool is_physical, Vec3 wl, float n_l)
{
  const Vec3 matt = p->diffuse * (is_physical ? n_l / PI : n_l);
  if (model == WHITTED_LAMBERT || v3_is_zero(p->specular)) return matt;
  if (model == WHITTED_PHONG) {
    const float along = v3_dot(v3_reflect(p->wo, p->n), wl);
    if (!(along > 0)) return matt;
    const float lobe = f_pow(along, p->exponent);
    // The physical form gains no energy (Lafortune and Willems 1994).
    return matt + p->specular * (is_physical ? lobe * (p->exponent + 2) / (2 * PI) * n_l : lobe);
  }
  const Vec3 facets = p->specular * whitted_facets(p, wl, n_l);
  return matt + (is_physical ? facets / (4 * PI * sqr_f(p->facets)) : facets);
}

// --- light ------------------------------------------------------------------------------------------------

typedef struct WhittedLight {
  PackedRay ray;
  Vec3 light; // that arrives at the eye's ray, if nothing is in the way
  TraceQuery query;
  uint16_t point;
} WhittedLight;

static inline bool whitted_aim(const Whitted *t, const WhittedPoint *p, const WhittedRay *r, size_t light, LightSample *l)
{
  const World *w = t->pass->world;
  const LightSet *set = &w->lights;
  const bool is_soft = w->whitted.soft_shadows, by_chance = set->emitter_count > MOST_LIGHTS;
  // The middle of flat lights; (0, 0) is that of disks and of what is seen of spheres.
  Vec2 u = {0, 0};
  if (is_soft || by_chance)
    u = sample_pair(&t->samplers[r->pixel], PAIR_VERTEX + (hash_combine(r->way, (uint32_t)light) >> 8));
  *l = (LightSample){.pdf = 0};
  if (light >= (by_chance ? 1 : set->emitter_count)) {
    const Sun *sun = &set->suns[light - (by_chance ? 1 : set->emitter_count)];
    return sun_sample(sun, u, l);
  }
  if (by_chance) {
    const float choice = sample_pair(&t->samplers[r->pixel], PAIR_VERTEX + (hash_combine(r->way, 77) >> 8)).x;
    return emitter_sample(set, w->textures, p->s.p, p->n, choice, u, l);
  }
  const Emitter *e = &set->emitters[light];
  if (!is_soft && e->kind == EMITTER_QUAD) u = (Vec2){0.5f, 0.5f};
  if (!is_soft && e->kind == EMITTER_TRIANGLE) u = (Vec2){4.0f / 9, 0.5f};
  switch ((EmitterKind)e->kind) {
  case EMITTER_POINT:
  case EMITTER_SPOT: return point_sample(set, e, p->s.p, l);
  case EMITTER_TRIANGLE:
  case EMITTER_QUAD:
  case EMITTER_DISK: return flat_sample(e, w->textures, p->s.p, u, l);
  case EMITTER_SPHERE: return sphere_sample(e, p->s.p, u, l);
  }
  unreachable();
}

// What one light offers a point; false: nothing.
static inline bool whitted_offer(const Whitted *t, size_t point_i, size_t light, WhittedLight *out)
{
  const World *w = t->pass->world;
  const WhittedSettings *set = &w->whitted;
  const WhittedPoint *p = &t->points[point_i];
  const WhittedRay *r = &t->rays[p->ray_i];
  const WhittedModel model = whitted_model(set, p->m);
  LightSample l;
  if (!whitted_aim(t, p, r, light, &l) || !(l.pdf > 0)) return false;
  const float n_l = v3_dot(p->n, l.wl);
  const bool is_physical = set->light_units == LIGHT_UNITS_PHYSICAL;
  Vec3 arriving = l.radiance / l.pdf;
  if (!is_physical && l.is_delta && l.distance < INFINITY) arriving = arriving * (l.distance * l.distance);
  if (model == WHITTED_OWN) {
    Bsdf b;
    float pdf;
    material_bsdf(p->m, w->textures, &p->s, p->wo, &b);
    if (bsdf_is_delta(&b) || (n_l <= 0 && b.glass <= 0)) return false;
    const BsdfView view = bsdf_view(&b, frame_local(&b.frame, p->wo));
    out->light = arriving * bsdf_eval_view(&b, &view, l.wl, &pdf);
  } else {
    if (!(n_l > 0)) return false;
    out->light = arriving * whitted_reflect(p, model, is_physical, l.wl, n_l);
  }
  if (v3_is_zero(out->light) && set->shadows == SHADOWS_NONE) return false;
  const Ray ray = trace_light_ray(&p->s, l.wl, l.distance);
  out->ray = ray_pack(&ray);
  out->query = (TraceQuery){w, whitted_seed(t, r, 1 + (uint32_t)light)};
  out->point = (uint16_t)point_i;
  return true;
}

// What passes a surface that a shadow ray meets, straight on; zero: it is opaque.
static inline Vec3 whitted_pane(const World *w, const PackedRay *packed, const Hit *hit, WhittedPoint *p)
{
  const Ray ray = ray_unpack(packed);
  p->s = trace_surface(w, &ray, hit);
  p->m = material_choose(&w->materials[p->s.material], w->textures, &p->s, 0.5f);
  p->wo = -ray.d;
  trace_footprint(w, &ray, hit, 0, &p->s);
  whitted_surface(w, p);
  return p->passed;
}

// Light that comes through glass: from pane to pane, all rays that are still on their way together.
static inline void whitted_through(Whitted *t, WhittedLight *lights, size_t count, RayMask mask)
{
  const World *w = t->pass->world;
  PackedRay rays[WHITTED_SIZE];
  TraceQuery queries[WHITTED_SIZE];
  Hit hits[WHITTED_SIZE];
  uint16_t of[WHITTED_SIZE];
  Vec3 inside[WHITTED_SIZE];
  size_t left = 0;
  for (size_t i = 0; i < count; i++) {
    rays[left] = lights[i].ray;
    queries[left] = lights[i].query;
    inside[left] = v3_all(0);
    of[left++] = (uint16_t)i;
  }
  for (int pane = 0; left; pane++) {
    size_t kept = 0;
    t->counters->shadow_rays += left;
    whitted_ask(t, rays, left, mask, queries, 3, hits, NULL);
    for (size_t k = 0; k < left; k++) {
      WhittedLight *l = &lights[of[k]];
      l->light *= path_fade(inside[k], hits[k].instance == NO_HIT ? (rays[k].tmax < INFINITY ? rays[k].tmax : 0) : hits[k].t);
      if (hits[k].instance == NO_HIT) continue;
      WhittedPoint p;
      const Vec3 passed = pane == MOST_PANES ? v3_all(0) : whitted_pane(w, &rays[k], &hits[k], &p);
      l->light *= passed;
      if (v3_is_zero(passed) || v3_is_zero(l->light)) {
        l->light = v3_all(0);
        continue;
      }
      const Vec3 d = v3_load(rays[k].d);
      const Ray on = {offset_origin(&p.s, d), d, 0, rays[k].tmax - hits[k].t};
      if (!(on.tmax > 0)) continue;
      rays[kept] = ray_pack(&on);
      queries[kept] = queries[k];
      inside[kept] = p.s.is_back || p.m->is_thin_walled ? v3_all(0) : p.m->absorption;
      of[kept++] = of[k];
    }
    left = kept;
  }
}

static inline void whitted_shadows(Whitted *t, WhittedLight *lights, size_t count)
{
  const World *w = t->pass->world;
  const ShadowKind shadows = (ShadowKind)w->whitted.shadows;
  const RayMask mask = w->has_background ? RAY_ACTOR_SHADOW : RAY_SHADOW;
  PackedRay rays[WHITTED_SIZE];
  TraceQuery queries[WHITTED_SIZE];
  uint8_t blocked[WHITTED_SIZE];
  WhittedLight through[WHITTED_SIZE];
  size_t stopped = 0;
  if (shadows == SHADOWS_NONE || !count) return;
  for (size_t i = 0; i < count; i++) {
    rays[i] = lights[i].ray;
    queries[i] = lights[i].query;
  }
  t->counters->shadow_rays += count;
  whitted_ask(t, rays, count, mask, queries, 2, NULL, blocked);
  uint16_t of[WHITTED_SIZE];
  for (size_t i = 0; i < count; i++) {
    if (!blocked[i]) continue;
    if (shadows == SHADOWS_TRANSPARENT && w->has_panes) {
      of[stopped] = (uint16_t)i;
      through[stopped++] = lights[i];
    } else {
      lights[i].light = v3_all(0);
    }
  }
  whitted_through(t, through, stopped, mask);
  for (size_t k = 0; k < stopped; k++) lights[of[k]].light = through[k].light;
}

static inline size_t whitted_light_count(const LightSet *set)
{
  return (set->emitter_count > MOST_LIGHTS ? 1 : set->emitter_count) + set->sun_count;
}

static inline void whitted_light(Whitted *t)
{
  const size_t lights = whitted_light_count(&t->pass->world->lights);
  for (size_t k = 0; k < lights; k++) {
    WhittedLight offers[WHITTED_SIZE];
    size_t count = 0;
    for (size_t i = 0; i < t->point_count; i++) count += whitted_offer(t, i, k, &offers[count]);
    whitted_shadows(t, offers, count);
    for (size_t i = 0; i < count; i++) {
      WhittedPoint *p = &t->points[offers[i].point];
      if (v3_is_zero(offers[i].light)) continue;
      p->lit |= 1u << (k & 31);
      whitted_pay(t, &t->rays[p->ray_i], offers[i].light);
    }
  }
}

// --- what goes on -----------------------------------------------------------------------------------------

static inline void whitted_send(Whitted *t, const WhittedPoint *p, Vec3 weight, Vec3 d, Vec3 absorption, bool is_refracted)
{
  const WhittedRay *r = &t->rays[p->ray_i];
  weight = r->weight * weight;
  if (!(v3_max_lane(weight) > t->pass->world->whitted.least_weight) || t->height == WHITTED_LIST) return;
  const Ray ray = {offset_origin(&p->s, d), d, 0, INFINITY};
  t->list[t->height++] = (WhittedRay){.ray = ray_pack(&ray), .weight = weight, .absorption = absorption,
                                      .cone = {p->width, r->cone.spread}, .way = hash_combine(r->way, 2 + is_refracted),
                                      .pixel = r->pixel, .level = (uint8_t)(r->level + 1),
                                      .is_refracted = is_refracted && r->is_refracted};
}

// The weights of both rays. With Fresnel's formulas what is passed splits; else both are as the material says, glass as
// it is seen straight on. Total reflection sends all that would have passed to the mirror's direction.
static inline void whitted_go_on(Whitted *t, const WhittedPoint *p)
{
  const WhittedSettings *set = &t->pass->world->whitted;
  const WhittedRay *r = &t->rays[p->ray_i];
  const float cos_i = clamp_f(v3_dot(p->n, p->wo), 0, 1);
  const Vec3 mirror_d = v3_reflect(p->wo, p->n);
  const bool has_own = p->m->kind == SURFACE_PHONG || p->m->kind == SURFACE_COOK_TORRANCE; // weights of its own
  Vec3 mirror = p->mirror, passed = p->passed;
  if (set->fresnel && !has_own && !v3_is_zero(mirror) && p->m->kind == SURFACE_PBR)
    mirror = mirror + (v3_all(max_f(v3_max_lane(mirror), 0) > 0 ? sqr_f(1 - p->m->roughness) : 0) - mirror) * fresnel_schlick(cos_i);
  if (!v3_is_zero(passed)) {
    const bool is_thin = p->m->is_thin_walled || fabsf(p->m->ior - 1) < 1e-3f;
    const float eta = p->s.is_back && !is_thin ? 1 / p->m->ior : p->m->ior;
    float cos_t;
    const float reflected = fresnel_dielectric(cos_i, eta, &cos_t);
    if (!is_thin && cos_t == 0) {
      mirror += passed;
    } else {
      const float part = set->fresnel ? reflected : has_own ? 0 : fresnel_f0(p->m->ior);
      mirror += passed * part * (has_own || p->m->kind != SURFACE_GLASS ? 1 : 1 / max_f(v3_max_lane(passed), 1e-6f));
      const Vec3 d = is_thin ? -p->wo : v3_normalize(refract(p->wo, p->n, eta, cos_i, cos_t));
      const Vec3 inside = is_thin ? r->absorption : p->s.is_back ? v3_all(0) : p->m->absorption;
      whitted_send(t, p, passed * (1 - part), d, inside, true);
    }
  }
  if (!v3_is_zero(mirror)) whitted_send(t, p, mirror, mirror_d, r->absorption, false);
}

static inline void whitted_sign(Whitted *t, const WhittedRay *r, uint32_t object, uint32_t lit)
{
  if (r->level > (r->is_refracted ? 3 : 2)) return;
  t->signature[r->pixel] += hash_combine(hash_combine(r->way, object), lit); // a sum: in any order
}

// Where a ray of the 64 ends: what shines there, and the point if light is to be asked for.
static inline void whitted_arrive(Whitted *t, size_t i)
{
  const World *w = t->pass->world;
  WhittedRay *r = &t->rays[i];
  const Ray ray = ray_unpack(&r->ray);
  const Hit *hit = &t->hits[i];
  if (hit->instance == NO_HIT) {
    r->weight *= path_fade(r->absorption, INFINITY);
    if (r->level == 0 && t->pass->settings.transparent)
      t->seen[r->pixel].alpha = 0;
    else
      whitted_pay(t, r, sky_radiance(&w->lights.sky, ray.d) + sun_radiance_seen(&w->lights, ray.d));
    whitted_sign(t, r, 0, 0);
    return;
  }
  WhittedPoint *p = &t->points[t->point_count++];
  *p = (WhittedPoint){.s = trace_surface(w, &ray, hit), .wo = -ray.d, .ray_i = (uint16_t)i};
  p->width = r->cone.width + r->cone.spread * hit->t;
  trace_footprint(w, &ray, hit, p->width, &p->s);
  p->m = material_choose(&w->materials[p->s.material], w->textures, &p->s, 0.5f);
  r->weight *= path_fade(r->absorption, hit->t);
  p->n = material_normal(p->m, w->textures, &p->s, p->wo);
  whitted_surface(w, p);
  Vec3 light = material_emission(&w->materials[p->s.material], w->textures, &p->s); // of a mix, what both parts shine
  if (!v3_is_zero(w->whitted_ambient)) {
    const bool has_ambient = p->m->kind == SURFACE_PHONG || p->m->kind == SURFACE_COOK_TORRANCE;
    const Vec3 a = has_ambient ? p->m->ambient * texture_color(w->textures, p->m->color_map, &p->s) : p->diffuse;
    light += w->whitted_ambient * a;
  }
  if (!v3_is_zero(light)) whitted_pay(t, r, light);
  if (r->level == 0)
    path_first_hit(t->pass, &p->s, hit, clamp_color(p->diffuse + p->mirror + p->passed), &t->seen[r->pixel]);
  if (p->m->kind == SURFACE_EMISSION) {
    whitted_sign(t, r, w->instances[p->s.instance].object_i + 1, 0);
    t->point_count--;
  }
}

// The newest rays of the list, to the end.
static inline void whitted_step(Whitted *t)
{
  t->going = t->height < WHITTED_SIZE ? t->height : WHITTED_SIZE;
  t->height -= t->going;
  t->point_count = 0;
  memcpy(t->rays, t->list + t->height, t->going * sizeof *t->rays);
  whitted_find(t);
  for (size_t i = 0; i < t->going; i++) whitted_arrive(t, i);
  const int32_t most = t->pass->settings.max_depth < MOST_LEVELS ? t->pass->settings.max_depth : MOST_LEVELS;
  whitted_light(t);
  for (size_t i = 0; i < t->point_count; i++) {
    const WhittedPoint *p = &t->points[i];
    const WhittedRay *r = &t->rays[p->ray_i];
    whitted_sign(t, r, t->pass->world->instances[p->s.instance].object_i + 1, p->lit);
    if (r->level < most) whitted_go_on(t, p);
  }
}

// What the pixels see is in t->seen and t->signature.
static inline void whitted_trace(Whitted *t)
{
  while (t->height) whitted_step(t);
  for (size_t i = 0; i < t->count; i++)
    for (int k = 0; k < 3; k++) t->seen[i].radiance[k] = (float)((double)t->sums[i][k] * 0x1p-28);
}

#endif
