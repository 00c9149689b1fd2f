// Whitted's light: one light after another for all places of a packet. First what would arrive, then whose way is free,
// then what the surface makes of it. Bare points and suns without a size are aimed at in lanes, others one by one by
// shade/light_sample.h; surfaces lit by a model in lanes, the path tracer's own BSDFs one by one.

#ifndef RAYFOLD_RENDER_WHITTED_LIGHT_H
#define RAYFOLD_RENDER_WHITTED_LIGHT_H

#include "render/whitted_surface.h"

// --- surfaces -----------------------------------------------------------------------------------------

// Cook and Torrance 1982 as the intro's thesis has it: F R G / ((N.V)(N.L)), times N.L; F is Schlick's, the facets lie by
// exp(-(angle / m)^2), or by the material's c times that.
static inline Wide3 whitted_facets(const Whitted *t, int lane, Wide3 wl, wx n_l)
{
  const Wide3 wo = w3_turned(whitted_go3(t, GO_D, lane)), n = whitted_at3(t, AT_N, lane), f0 = whitted_at3(t, AT_F0, lane);
  const Wide3 h = w3_normalize(w3_add(wo, wl));
  const wx least = wx_set(1e-3f), one = wx_set(1), facets = wx_load(&t->at[AT_FACETS][lane]);
  const wx n_h = wx_clamp(w3_dot(n, h), 0, 1), n_v = wx_max(w3_dot(n, wo), least), v_h = wx_max(w3_dot(wo, h), least);
  const wx angle = wx_acos_positive(n_h) / facets, rough = wx_load(&t->at[AT_HEIGHT][lane]) * wx_exp(-(angle * angle));
  const wx masked = wx_min(one, 2 * n_h * wx_min(n_v, n_l) / v_h);
  const wx away = wx_clamp(1 - v_h, 0, 1), away2 = away * away, x = away2 * away2 * away; // fresnel_schlick
  const wx all = rough * masked / n_v;
  return w3((f0.x + (1 - f0.x) * x) * all, (f0.y + (1 - f0.y) * x) * all, (f0.z + (1 - f0.z) * x) * all);
}

// Phong 1975; the physical form gains no energy (Lafortune and Willems 1994).
static inline wx whitted_lobe(const Whitted *t, int lane, bool is_physical, Wide3 wl, wx n_l)
{
  const Wide3 d = whitted_go3(t, GO_D, lane), n = whitted_at3(t, AT_N, lane);
  const wx exponent = wx_load(&t->at[AT_EXPONENT][lane]), zero = wx_set(0);
  const wx along = w3_dot(w3_sub(d, w3_scale(n, 2 * w3_dot(d, n))), wl);
  const wx lobe = wx_choose(wx_lt(zero, along), wx_pow(wx_max(along, zero), exponent), zero);
  return is_physical ? lobe * (exponent + 2) * (1 / (2 * PI)) * n_l : lobe;
}

// What surfaces lit by a model send to the eye of light that arrives from wl, 1 a square metre across it.
static inline Wide3 whitted_reflect(const Whitted *t, int lane, unsigned bits, Wide3 wl, wx n_l)
{
  const bool is_physical = t->pass->world->whitted.light_units == LIGHT_UNITS_PHYSICAL;
  const Wide3 specular = whitted_at3(t, AT_SPECULAR, lane), none = w3_all(wx_set(0));
  Wide3 sum = w3_scale(whitted_at3(t, AT_DIFFUSE, lane), is_physical ? n_l / PI : n_l);
  const unsigned glossy = bits & ~w3_is_zero(specular);
  const unsigned phong = whitted_bits(t->model[WHITTED_PHONG], lane) & glossy;
  const unsigned facets = whitted_bits(t->model[WHITTED_COOK_TORRANCE], lane) & glossy;
  if (phong) sum = w3_add(sum, w3_choose(phong, w3_scale(specular, whitted_lobe(t, lane, is_physical, wl, n_l)), none));
  if (facets) {
    Wide3 f = w3_mul(specular, whitted_facets(t, lane, wl, n_l));
    const wx m = wx_load(&t->at[AT_FACETS][lane]);
    if (is_physical) f = w3_scale(f, 1 / (4 * PI * (m * m)));
    sum = w3_add(sum, w3_choose(facets, f, none));
  }
  return sum;
}

// --- aiming -------------------------------------------------------------------------------------------

static inline size_t whitted_light_count(const LightSet *set)
{
  return (set->emitter_count > MOST_LIGHTS ? 1 : set->emitter_count) + set->sun_count;
}

// One place, any light.
static inline bool whitted_sample(const Whitted *t, size_t i, size_t light, LightSample *l)
{
  const World *w = t->pass->world;
  const LightSet *set = world_lights(w, t->go_int[GO_CELL][i]);
  const bool is_soft = w->whitted.soft_shadows, by_chance = set->emitter_count > MOST_LIGHTS;
  const Vec3 p = whitted_row3(t->at + AT_P, i), n = whitted_row3(t->at + AT_N, i);
  const uint32_t way = t->go_int[GO_WAY][i];
  const Sampler sampler = whitted_sampler(t, i);
  // The middle of flat lights; (0, 0) is that of disks and of what is seen of spheres.
  Vec2 u = {0, 0};
  if (is_soft || by_chance) u = sample_pair(&sampler, PAIR_VERTEX + (hash_combine(way, (uint32_t)light) >> 8));
  *l = (LightSample){.pdf = 0};
  if (light >= whitted_light_count(set)) return false;
  if (light >= (by_chance ? 1 : set->emitter_count))
    return sun_sample(&set->suns[light - (by_chance ? 1 : set->emitter_count)], u, l);
  if (by_chance) {
    const float choice = sample_pair(&sampler, PAIR_VERTEX + (hash_combine(way, 77) >> 8)).x;
    return emitter_sample(set, w->textures, p, local_chart_normal(whitted_kappa(t, i), p, n), choice, u, l);
  }
  const Emitter *e = &set->emitters[light];
  l->image = e->image;
  if (!is_soft && e->kind == EMITTER_QUAD) u = (Vec2){0.5f, 0.5f};
  if (!is_soft && e->kind == EMITTER_TRIANGLE) u = (Vec2){4.0f / 9, 0.5f};
  switch ((EmitterKind)e->kind) {
  case EMITTER_POINT:
  case EMITTER_SPOT: return point_sample(set, e, p, l);
  case EMITTER_TRIANGLE:
  case EMITTER_QUAD:
  case EMITTER_DISK: return flat_sample(e, w->textures, p, u, l);
  case EMITTER_SPHERE: return sphere_sample(e, p, u, l);
  }
  unreachable();
}

static inline bool whitted_aim_one(Whitted *t, size_t i, size_t light)
{
  LightSample l;
  if (!whitted_sample(t, i, light, &l) || !(l.pdf > 0)) return false;
  const bool is_classic = t->pass->world->whitted.light_units == LIGHT_UNITS_CLASSIC;
  const bool is_undiminished = is_classic && l.is_delta && l.distance < INFINITY;
  const Vec3 sent = l.radiance;
  Vec3 wl;
  float length;
  local_lamp(whitted_kappa(t, i), whitted_row3(t->at + AT_P, i), &l, &wl, &length);
  Vec3 arriving = (is_undiminished ? sent : l.radiance) / l.pdf;
  if (is_undiminished) arriving = arriving * (l.distance * l.distance);
  if (world_has_gates(t->pass->world)) {
    t->plans[i] = light_plan(t->pass->world, t->go_int[GO_CELL][i], l.image);
    arriving = arriving * path_light_fade(t->pass->world, length);
  }
  whitted_set3(t->at + AT_WL, i, wl);
  whitted_set3(t->at + AT_ARRIVING, i, arriving);
  t->at[AT_DISTANCE][i] = l.distance;
  return true;
}

// Points without a profile: the lanes they shine on.
static inline unsigned whitted_aim_point(Whitted *t, int lane, unsigned bits, const Emitter *e)
{
  const Wide3 way = w3_sub(w3_of(e->p), whitted_at3(t, AT_P, lane));
  const wx distance2 = w3_dot(way, way), distance = wx_sqrt(distance2);
  const bool is_classic = t->pass->world->whitted.light_units == LIGHT_UNITS_CLASSIC;
  const wx falloff = is_classic ? wx_set(1) : 1 / distance2;
  whitted_put3(t, AT_WL, lane, WIDEST_BITS, w3_scale(way, 1 / distance));
  whitted_put3(t, AT_ARRIVING, lane, WIDEST_BITS, w3_scale(w3_of(e->color), falloff));
  wx_store(&t->at[AT_DISTANCE][lane], distance);
  return wx_lt(wx_set(0), distance2) & bits;
}

static inline unsigned whitted_aim_sun(Whitted *t, int lane, unsigned bits, const Sun *s)
{
  whitted_put3(t, AT_WL, lane, WIDEST_BITS, w3_of(s->direction));
  whitted_put3(t, AT_ARRIVING, lane, WIDEST_BITS, w3_of(s->radiance));
  wx_store(&t->at[AT_DISTANCE][lane], wx_set(INFINITY));
  return bits;
}

static inline unsigned whitted_aim_group(Whitted *t, int lane, unsigned bits, size_t light)
{
  const LightSet *set = &t->pass->world->lights;
  const bool by_chance = set->emitter_count > MOST_LIGHTS || world_has_gates(t->pass->world); // then lanes have lights of their own
  if (!by_chance && light < set->emitter_count) {
    const Emitter *e = &set->emitters[light];
    if (e->kind == EMITTER_POINT && !e->profile) return whitted_aim_point(t, lane, bits, e);
  } else if (!by_chance && sun_is_delta(&set->suns[light - set->emitter_count])) {
    return whitted_aim_sun(t, lane, bits, &set->suns[light - set->emitter_count]);
  }
  unsigned aimed = 0;
  for (; bits; bits &= bits - 1) {
    const int k = __builtin_ctz(bits);
    aimed |= (unsigned)whitted_aim_one(t, (size_t)(lane + k), light) << k;
  }
  return aimed;
}

// A surface with a BSDF of its own: what arrives becomes what it sends. False: nothing.
static inline bool whitted_shade_own(Whitted *t, size_t i)
{
  const Vec3 wo = -whitted_row3(t->go + GO_D, i), wl = whitted_row3(t->at + AT_WL, i);
  Bsdf b;
  float pdf;
  material_bsdf(t->material[i], t->pass->world->textures, &t->surface[i], wo, &b);
  if (bsdf_is_delta(&b) || (v3_dot(whitted_row3(t->at + AT_N, i), wl) <= 0 && b.glass <= 0)) return false;
  const BsdfView view = bsdf_view(&b, frame_local(&b.frame, wo));
  whitted_set3(t->at + AT_ARRIVING, i, whitted_row3(t->at + AT_ARRIVING, i) * bsdf_eval_view(&b, &view, wl, &pdf));
  return true;
}

// Who asks whether the light comes through.
static inline uint64_t whitted_aim(Whitted *t, size_t light)
{
  uint64_t asked = 0;
  for (int i = 0; i < (int)t->going; i += WIDEST) {
    const unsigned lives = whitted_bits(t->lives, i), own = whitted_bits(t->model[WHITTED_OWN], i);
    if (!lives) continue;
    unsigned bits = whitted_aim_group(t, i, lives, light);
    const wx n_l = w3_dot(whitted_at3(t, AT_N, i), whitted_at3(t, AT_WL, i));
    bits &= own | wx_lt(wx_set(0), n_l);
    for (unsigned left = bits & own; left; left &= left - 1)
      if (!whitted_shade_own(t, (size_t)(i + __builtin_ctz(left)))) bits &= ~(left & -left);
    whitted_mark(&asked, i, bits);
  }
  return asked;
}

// --- shadows, in lanes ----------------------------------------------------------------------------------

// The ray of trace_light_ray(), and how far it goes.
static inline LaneRays whitted_light_rays(const Whitted *t, int lane, unsigned bits, wx *tmax)
{
  const Wide3 p = whitted_at3(t, AT_P, lane), ng = whitted_at3(t, AT_NG, lane), wl = whitted_at3(t, AT_WL, lane);
  const wx error = wx_load(&t->at[AT_ERROR][lane]), distance = wx_load(&t->at[AT_DISTANCE][lane]);
  const wx size = wx_max(wx_abs(p.x), wx_max(wx_abs(p.y), wx_abs(p.z)));
  const wx off = wx_choose(wx_lt(w3_dot(wl, ng), wx_set(0)), -error, error);
  *tmax = wx_choose(wx_lt(distance, wx_set(INFINITY)), distance - (1e-5f * distance + 1e-6f * size), distance);
  return (LaneRays){w3_add(p, w3_scale(ng, off)), wl, bits};
}

// What the panes leave of light on its way straight on: each crossing colours it, and what lies between two takes its
// part. The product does not depend on their order.
static inline Wide3 whitted_through_lanes(Whitted *t, int lane, uint32_t which, const LaneRays *r, wx tmax)
{
  const wx zero = wx_set(0);
  const unsigned is_clear = w3_is_zero(whitted_go3(t, GO_FADE, lane)); // where the eye's ray was within nothing, or started there
  Wide3 left = w3_all(wx_set(1));
  for (; which; which &= which - 1) {
    const uint32_t i = (uint32_t)__builtin_ctz(which);
    const LaneShape *s = &t->lanes->shapes[i];
    const SurfaceMaterial *m = t->skins[i].m;
    if (s->kind == LANE_ROUND && s->radius < INFINITY && !(lane_near(s, r->o, r->d) & r->bits)) continue;
    const LaneSpan at = lane_shape_span(s, r->o, r->d);
    t->counters->prims += WIDEST;
    const unsigned first = wx_lt(zero, at.from) & wx_lt(at.from, tmax);
    const unsigned second = s->kind == LANE_BALL || s->kind == LANE_ROUND ? wx_lt(zero, at.to) & wx_lt(at.to, tmax) : 0;
    if (!((first | second) & r->bits)) continue;
    const Wide3 passed = w3_of(t->skins[i].passed);
    left = w3_choose(first, w3_mul(left, passed), left);
    left = w3_choose(second, w3_mul(left, passed), left);
    if (m->is_thin_walled || v3_is_zero(m->absorption)) continue; // open ones with any are not asked here
    const unsigned counts = wx_lt(zero, at.from) | ~is_clear;
    const wx inside = wx_choose(counts, wx_max(wx_min(at.to, tmax) - wx_max(at.from, zero), zero), zero);
    left = w3_mul(left, whitted_fade(w3_of(m->absorption), inside));
  }
  return left;
}

// About the way from the places to the light; what leaves a place starts its error off it.
static inline LaneCone whitted_light_cone(const Whitted *t, uint64_t asked)
{
  LaneCone c = whitted_cone(t->at + AT_P, t->at + AT_WL, asked);
  wx most = wx_set(0);
  for (int i = 0; i < WHITTED_SIZE; i += WIDEST)
    most = wx_max(wx_choose(whitted_bits(asked, i), wx_load(&t->at[AT_ERROR][i]), most), most);
  c.radius += wx_most(most);
  return c;
}

// Who of those asked gets light; AT_ARRIVING is what is left of it.
static inline uint64_t whitted_shadows_in_lanes(Whitted *t, uint64_t asked, bool is_transparent)
{
  uint64_t lit = 0;
  uint32_t within = UINT32_MAX;
  if (t->lanes->count > LANE_FEW) {
    const LaneCone cone = whitted_light_cone(t, asked);
    within = lanes_in_cone(t->lanes, &cone);
  }
  const uint32_t panes = is_transparent ? t->panes & within : 0;
  const uint32_t stops = (is_transparent ? t->walls : t->walls | t->panes) & within;
  for (int i = 0; i < (int)t->going; i += WIDEST) {
    wx tmax;
    LaneRays r = whitted_light_rays(t, i, whitted_bits(asked, i), &tmax);
    if (!r.bits) continue;
    r.bits &= ~lanes_any(t->lanes, stops, &r, tmax, &t->counters->prims);
    whitted_mark(&lit, i, r.bits);
    if (!panes || !r.bits) continue;
    const Wide3 left = whitted_through_lanes(t, i, panes, &r, tmax);
    whitted_put3(t, AT_ARRIVING, i, r.bits, w3_mul(whitted_at3(t, AT_ARRIVING, i), left));
  }
  return lit;
}

// --- shadows, by the trees ------------------------------------------------------------------------------

typedef struct WhittedLights { // rays to one light that are asked together
  size_t count;
  PackedRay rays[WHITTED_SIZE];
  TraceQuery queries[WHITTED_SIZE];
  uint8_t of[WHITTED_SIZE];
} WhittedLights;

// What passes a surface that a shadow ray meets, straight on; zero: it is opaque.
static inline Vec3 whitted_pane(const World *w, const PackedRay *packed, const Hit *hit, SurfacePoint *s,
                                const SurfaceMaterial **m)
{
  const Ray ray = ray_unpack(packed);
  *s = trace_surface(w, &ray, hit);
  trace_footprint(w, &ray, hit, 0, s);
  const SurfaceMaterial *shown = &w->materials[s->material];
  *m = material_choose(shown, w->textures, s, 0.5f);
  return whitted_skin(w, shown, *m, s).passed;
}

// What a ray to the light begins in: what the eye's came through, or what lies behind the surface.
static inline Vec3 whitted_inside(const Whitted *t, size_t i)
{
  const bool is_thin = t->is_thin >> i & 1, is_back = t->is_back >> i & 1;
  if (is_thin || v3_dot(whitted_row3(t->at + AT_N, i), whitted_row3(t->at + AT_WL, i)) >= 0) return whitted_row3(t->go + GO_FADE, i);
  return is_back ? v3_all(0) : whitted_row3(t->at + AT_FADE, i);
}

// Light that comes through glass: from pane to pane, all rays that are still on their way together.
static inline void whitted_through(Whitted *t, WhittedLights *l, RayMask mask)
{
  const World *w = t->pass->world;
  Hit hits[WHITTED_SIZE];
  Vec3 inside[WHITTED_SIZE];
  for (size_t k = 0; k < l->count; k++) inside[k] = whitted_inside(t, l->of[k]);
  for (int pane = 0; l->count; pane++) {
    size_t kept = 0;
    t->counters->shadow_rays += l->count;
    for (size_t k = 0, n; k < l->count; k += n) { // those in one cell together
      const uint32_t cell = t->go_int[GO_CELL][l->of[k]];
      for (n = 1; k + n < l->count && t->go_int[GO_CELL][l->of[k + n]] == cell; n++) {}
      whitted_ask(t, cell, l->rays + k, n, mask, l->queries + k, 3, hits + k, NULL);
    }
    for (size_t k = 0; k < l->count; k++) {
      const size_t i = l->of[k];
      const Hit *hit = &hits[k];
      const Ray ray = ray_unpack(&l->rays[k]);
      const float passed = hit->instance != NO_HIT ? hit->t : ray.tmax < INFINITY ? ray.tmax : 0;
      Vec3 light = whitted_row3(t->at + AT_ARRIVING, i) * path_fade(inside[k], local_length(whitted_kappa(t, i), &ray, passed));
      SurfacePoint s;
      const SurfaceMaterial *m = NULL;
      if (hit->instance != NO_HIT)
        light *= pane == MOST_PANES ? v3_all(0) : whitted_pane(w, &l->rays[k], hit, &s, &m);
      whitted_set3(t->at + AT_ARRIVING, i, light);
      if (hit->instance == NO_HIT || v3_is_zero(light)) continue;
      const Ray on = {offset_origin(&s, ray.d), ray.d, 0, ray.tmax - hit->t};
      if (!(on.tmax > 0)) continue;
      l->rays[kept] = ray_pack(&on);
      l->queries[kept] = l->queries[k];
      inside[kept] = s.is_back || m->is_thin_walled ? v3_all(0) : m->absorption;
      l->of[kept++] = (uint8_t)i;
    }
    l->count = kept;
  }
}

static inline Ray whitted_light_ray(const Whitted *t, size_t i)
{
  const SurfacePoint s = {.p = whitted_row3(t->at + AT_P, i), .ng = whitted_row3(t->at + AT_NG, i), .error = t->at[AT_ERROR][i]};
  const Vec3 d = local_direction(whitted_kappa(t, i), s.p, whitted_row3(t->at + AT_WL, i));
  return trace_light_ray(&s, d, t->at[AT_DISTANCE][i]);
}

static inline uint64_t whitted_shadows_by_trees(Whitted *t, uint64_t asked, size_t light, bool is_transparent)
{
  const World *w = t->pass->world;
  const bool has_gates = world_has_gates(w);
  const RayMask mask = w->has_background && !has_gates ? RAY_ACTOR_SHADOW : RAY_SHADOW;
  WhittedLights l = {.count = 0};
  uint8_t blocked[WHITTED_SIZE];
  for (uint64_t left = asked; left; left &= left - 1) {
    const size_t i = (size_t)__builtin_ctzll(left);
    const Ray ray = whitted_light_ray(t, i);
    l.rays[l.count] = ray_pack(&ray);
    l.queries[l.count] = (TraceQuery){w, whitted_seed(t, i, 1 + (uint32_t)light), 0, 0};
    l.of[l.count++] = (uint8_t)i;
  }
  if (has_gates) {
    Way ways[WHITTED_SIZE];
    uint64_t plans[WHITTED_SIZE];
    for (size_t k = 0; k < l.count; k++) {
      ways[k] = way_begin(t->go_int[GO_CELL][l.of[k]]);
      plans[k] = t->plans[l.of[k]];
    }
    ways_blocked(w, l.rays, ways, plans, l.queries, l.count, mask, t->counters, &t->habits[2], blocked);
  } else {
    whitted_ask(t, 0, l.rays, l.count, mask, l.queries, 2, NULL, blocked);
  }
  size_t kept = 0;
  for (size_t k = 0; k < l.count; k++) {
    if (!blocked[k]) continue;
    const bool is_dark = !is_transparent || !w->has_panes || (has_gates && t->plans[l.of[k]]); // beyond gates glass is dark
    if (is_dark) asked &= ~(1ull << l.of[k]);
    if (is_dark) continue;
    l.rays[kept] = l.rays[k];
    l.queries[kept] = l.queries[k];
    l.of[kept++] = l.of[k];
  }
  l.count = is_transparent && w->has_panes ? kept : 0;
  whitted_through(t, &l, mask);
  return asked;
}

// --- all of it ------------------------------------------------------------------------------------------

static inline uint64_t whitted_shadows(Whitted *t, uint64_t asked, size_t light)
{
  const ShadowKind shadows = (ShadowKind)t->pass->world->whitted.shadows;
  if (shadows == SHADOWS_NONE || !asked) return asked;
  t->counters->shadow_rays += (uint64_t)__builtin_popcountll(asked);
  if (t->lanes && (t->has_lane_shadows || shadows == SHADOWS_HARD))
    return whitted_shadows_in_lanes(t, asked, shadows == SHADOWS_TRANSPARENT);
  return whitted_shadows_by_trees(t, asked, light, shadows == SHADOWS_TRANSPARENT);
}

static inline void whitted_shade(Whitted *t, uint64_t lit, size_t light)
{
  for (int i = 0; i < (int)t->going; i += WIDEST) {
    const unsigned bits = whitted_bits(lit, i), own = whitted_bits(t->model[WHITTED_OWN], i);
    if (!bits) continue;
    const Wide3 wl = whitted_at3(t, AT_WL, i);
    Wide3 sent = whitted_at3(t, AT_ARRIVING, i);
    if (bits & ~own) {
      const wx n_l = w3_dot(whitted_at3(t, AT_N, i), wl);
      sent = w3_choose(own, sent, w3_mul(sent, whitted_reflect(t, i, bits & ~own, wl, n_l)));
    }
    whitted_put3(t, AT_LIGHT, i, bits, w3_add(whitted_at3(t, AT_LIGHT, i), sent));
    const wxu had = wxu_load(t->lit + i);
    wxu_store(t->lit + i, wxu_choose(bits & ~w3_is_zero(sent), had | (1u << (light & 31)), had));
  }
}

static inline void whitted_light(Whitted *t)
{
  size_t lights = 0;
  for (uint32_t c = 0; c < t->pass->world->cell_count; c++) {
    const size_t count = whitted_light_count(world_lights(t->pass->world, c));
    lights = count > lights ? count : lights;
  }
  for (size_t k = 0; k < lights && t->lives; k++) whitted_shade(t, whitted_shadows(t, whitted_aim(t, k), k), k);
}

#endif
