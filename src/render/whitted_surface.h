// Whitted's places: what rays meet, and what is there. Shapes of a LaneSet and materials without textures (or with a
// checker on something flat) go in lanes; all else one by one, by the functions every integrator has, into the same rows.

#ifndef RAYFOLD_RENDER_WHITTED_SURFACE_H
#define RAYFOLD_RENDER_WHITTED_SURFACE_H

#include "render/whitted_rows.h"
#include "shade/lane_texture.h"

// --- what is met --------------------------------------------------------------------------------------

// By the trees. Where there is a background it is asked of the rays alone that met no actor.
static inline void whitted_find_masked(Whitted *t, bool is_first, RayMask mask)
{
  PackedRay rays[WHITTED_SIZE];
  TraceQuery queries[WHITTED_SIZE];
  Hit hits[WHITTED_SIZE];
  uint16_t of[WHITTED_SIZE];
  size_t count = 0;
  for (size_t i = 0; i < t->going; i++) {
    if (!is_first && t->hits[i].instance != NO_HIT) continue;
    const Ray ray = whitted_ray(t, i);
    rays[count] = ray_pack(&ray);
    queries[count] = (TraceQuery){t->pass->world, whitted_seed(t, i, 0), 0, 0};
    of[count++] = (uint16_t)i;
  }
  if (count) whitted_ask(t, 0, rays, count, mask, queries, whitted_level(t, 0) > 0, hits, NULL);
  for (size_t k = 0; k < count; k++) t->hits[of[k]] = hits[k];
}

static inline void whitted_find_by_trees(Whitted *t, RayMask actors, RayMask background)
{
  whitted_find_masked(t, true, actors);
  if (background) whitted_find_masked(t, false, background);
  for (size_t i = 0; i < t->going; i++) {
    t->t[i] = t->hits[i].t;
    if (t->hits[i].instance != NO_HIT) t->met |= 1ull << i;
  }
}

// Through gates, where roles are not told apart: the rays become those of their last pieces.
static inline void whitted_find_through_gates(Whitted *t, RayMask mask)
{
  PackedRay rays[WHITTED_SIZE];
  TraceQuery queries[WHITTED_SIZE];
  for (size_t i = 0; i < t->going; i++) {
    const Ray ray = whitted_ray(t, i);
    rays[i] = ray_pack(&ray);
    t->ways[i] = way_begin(t->go_int[GO_CELL][i]);
    queries[i] = (TraceQuery){t->pass->world, whitted_seed(t, i, 0), 0, 0};
    PackedRay *seen = &t->eye_rays[whitted_pixel(t, i)];
    if (whitted_level(t, i) > 0) continue;
    *seen = rays[i];
    v3_store(seen->d, local_vector(whitted_kappa(t, i), ray.o, ray.d));
  }
  ways_closest(t->pass->world, rays, t->ways, queries, t->going, mask, t->counters, &t->habits[whitted_level(t, 0) > 0], t->hits);
  for (size_t i = 0; i < t->going; i++) {
    const Way *way = &t->ways[i];
    const Ray last = ray_unpack(&rays[i]);
    t->t[i] = t->has_curved ? local_length(world_curvature(t->pass->world, way->cell), &last, t->hits[i].t) : t->hits[i].t;
    t->last_gate[i] = way_length(way, rays[i].tmin);
    if (t->hits[i].instance != NO_HIT) t->met |= 1ull << i;
    if (!way->crossings) continue;
    whitted_set3(t->go + GO_O, i, v3_load(rays[i].o));
    whitted_set3(t->go + GO_D, i, v3_load(rays[i].d));
    whitted_set3(t->go + GO_FADE, i, whitted_row3(t->go + GO_FADE, i) / way->scale);
    t->go[GO_WIDTH][i] *= way->scale;
    t->go_int[GO_CELL][i] = way->cell;
  }
}

// The middle of the box about vectors in rows, and half its size.
static inline Vec3 whitted_middle(const float (*v)[WHITTED_ROW], uint64_t rays, Vec3 *half)
{
  Vec3 lo = v3_all(0), hi = v3_all(0);
  for (int k = 0; k < 3; k++) {
    wx least = wx_set(INFINITY), most = wx_set(-INFINITY);
    for (int i = 0; i < WHITTED_SIZE; i += WIDEST) {
      const unsigned bits = (unsigned)(rays >> i) & WIDEST_BITS;
      const wx at = wx_load(v[k] + i);
      least = wx_min(wx_choose(bits, at, wx_set(INFINITY)), least);
      most = wx_max(wx_choose(bits, at, wx_set(-INFINITY)), most);
    }
    lo[k] = wx_least(least);
    hi[k] = wx_most(most);
  }
  *half = 0.5f * (hi - lo);
  return 0.5f * (lo + hi);
}

// A cone about the rays of a packet.
static inline LaneCone whitted_cone(const float (*o)[WHITTED_ROW], const float (*d)[WHITTED_ROW], uint64_t rays)
{
  Vec3 half, unused;
  LaneCone c = {.apex = whitted_middle(o, rays, &half), .axis = v3_normalize(whitted_middle(d, rays, &unused))};
  c.radius = 1.001f * v3_length(half);
  wx least = wx_set(1);
  for (int i = 0; i < WHITTED_SIZE; i += WIDEST) {
    const wx cosine = w3_dot(w3_of(c.axis), w3_load(d[0] + i, WHITTED_ROW));
    least = wx_min(wx_choose((unsigned)(rays >> i) & WIDEST_BITS, cosine, wx_set(1)), least);
  }
  c.cosine = wx_least(least);
  return c;
}

static inline void whitted_find_in_lanes(Whitted *t, RayMask actors, RayMask background)
{
  const uint64_t all = whitted_all(t);
  uint32_t which = UINT32_MAX;
  if (t->lanes->count > LANE_FEW) {
    const LaneCone cone = whitted_cone(t->go + GO_O, t->go + GO_D, all);
    which = lanes_in_cone(t->lanes, &cone);
  }
  for (int i = 0; i < (int)t->going; i += WIDEST) {
    LaneRays r = {whitted_go3(t, GO_O, i), whitted_go3(t, GO_D, i), whitted_bits(all, i)};
    LaneNearest n = {.t = wx_set(INFINITY)};
    t->counters->prims += lanes_closest(t->lanes, which, actors, &r, &n);
    r.bits &= ~n.met;
    if (background && r.bits) t->counters->prims += lanes_closest(t->lanes, which, background, &r, &n);
    wx_store(t->t + i, n.t);
    wxu_store(t->shape + i, n.shape);
    wxu_store(t->part + i, n.part);
    whitted_mark(&t->met, i, n.met);
  }
}

// All rays of a packet start at the eye, which sees what a camera may see, or none does.
static inline void whitted_find(Whitted *t)
{
  const bool is_first = whitted_level(t, 0) == 0, has_background = t->pass->world->has_background;
  const RayMask actors = has_background ? (is_first ? RAY_ACTOR_CAMERA : RAY_ACTOR_BOUNCE) : is_first ? RAY_CAMERA : RAY_BOUNCE;
  const RayMask background = !has_background ? (RayMask)0 : is_first ? RAY_BACKGROUND_CAMERA : RAY_BACKGROUND_BOUNCE;
  *(is_first ? &t->counters->camera_rays : &t->counters->bounce_rays) += t->going;
  t->met = 0;
  if (world_has_gates(t->pass->world))
    whitted_find_through_gates(t, is_first ? RAY_CAMERA : RAY_BOUNCE);
  else if (t->lanes)
    whitted_find_in_lanes(t, actors, background);
  else
    whitted_find_by_trees(t, actors, background);
}

// --- what a surface is ----------------------------------------------------------------------------------

// A highlight's exponent and facets of the same width as GGX's: alpha = roughness^2 is the facets' slope, and Phong's
// lobe of equal slope has 2 / alpha^2 - 2 (Walter et al. 2007, section 5.2, for Blinn's; the mirror direction turns twice
// as fast, so a quarter).
static inline void whitted_widths(WhittedSkin *k, float roughness)
{
  const float alpha = max_f(roughness * roughness, 0.02f);
  k->exponent = max_f((2 / (alpha * alpha) - 2) / 4, 1);
  k->facets = alpha;
}

static inline bool whitted_has_own_weights(const SurfaceMaterial *m)
{
  return m->kind == SURFACE_PHONG || m->kind == SURFACE_COOK_TORRANCE;
}

static inline void whitted_skin_parts(const World *w, const SurfaceMaterial *m, const SurfacePoint *s, WhittedSkin *k)
{
  const Vec3 color = clamp_color(m->color * texture_color(w->textures, m->color_map, s) * v3_load(s->color));
  const float smooth = sqr_f(1 - m->roughness);
  switch ((SurfaceKind)m->kind) {
  case SURFACE_PBR: {
    const float metal = clamp_f(m->metallic * texture_channel(w->textures, m->metallic_map, s), 0, 1);
    const float through = (1 - metal) * clamp_f(m->transmission * texture_channel(w->textures, m->transmission_map, s), 0, 1);
    k->diffuse = color * (1 - metal - through);
    k->f0 = metal * color + (1 - metal) * k->f0 * m->specular;
    k->specular = v3_all(1);
    k->mirror = smooth * k->f0 * (1 - through);
    k->passed = through * color;
    return;
  }
  case SURFACE_LAMBERT: k->diffuse = color; return;
  case SURFACE_MIRROR:
    k->f0 = k->mirror = color;
    k->specular = v3_all(1);
    return;
  case SURFACE_GLASS:
    k->specular = v3_all(1);
    k->passed = color;
    return;
  case SURFACE_PHONG:
  case SURFACE_COOK_TORRANCE:
    k->diffuse = color;
    k->specular = m->specular_color;
    k->f0 = m->kind == SURFACE_PHONG ? k->f0 : m->gloss_f0;
    if (m->kind == SURFACE_PHONG) {
      k->exponent = m->gloss_width;
      k->facets = sqrtf(2 / (4 * k->exponent + 2));
    } else {
      k->facets = m->gloss_width;
      k->exponent = max_f((2 / sqr_f(k->facets) - 2) / 4, 1);
    }
    k->mirror = m->mirrored;
    k->passed = m->passed;
    return;
  case SURFACE_EMISSION:
  case SURFACE_MIX: return;
  }
  unreachable();
}

// shown: the material that was hit; m: the same, or of a mix the part that was chosen.
static inline WhittedSkin whitted_skin(const World *w, const SurfaceMaterial *shown, const SurfaceMaterial *m,
                                       const SurfacePoint *s)
{
  WhittedSkin k = {.m = m};
  k.diffuse = k.specular = k.mirror = k.passed = v3_all(0);
  k.f0 = v3_all(fresnel_f0(m->ior));
  whitted_widths(&k, m->roughness);
  whitted_skin_parts(w, m, s, &k);
  k.glow = material_emission(shown, w->textures, s); // of a mix, what both parts shine
  if (!v3_is_zero(w->whitted_ambient))
    k.glow += w->whitted_ambient *
              (whitted_has_own_weights(m) ? m->ambient * texture_color(w->textures, m->color_map, s) : k.diffuse);
  return k;
}

static inline WhittedModel whitted_model(const WhittedSettings *set, const SurfaceMaterial *m)
{
  switch ((LightModel)set->light_model) {
  case LIGHT_MODEL_LAMBERT: return WHITTED_LAMBERT;
  case LIGHT_MODEL_PHONG: return WHITTED_PHONG;
  case LIGHT_MODEL_COOK_TORRANCE: return WHITTED_COOK_TORRANCE;
  case LIGHT_MODEL_SCENE: break;
  }
  const bool is_bare = m->kind == SURFACE_LAMBERT; // its BSDF is the model's
  if (set->light_units == LIGHT_UNITS_PHYSICAL) return is_bare ? WHITTED_LAMBERT : WHITTED_OWN;
  if (m->kind == SURFACE_LAMBERT) return WHITTED_LAMBERT;
  return m->kind == SURFACE_PHONG ? WHITTED_PHONG : WHITTED_COOK_TORRANCE;
}

static inline float whitted_height(const SurfaceMaterial *m)
{
  return m->kind == SURFACE_COOK_TORRANCE && m->gloss_given_c > 0 ? m->gloss_given_c : 1;
}

// Whether all places of a shape are alike, but for a checker on something flat.
static inline bool whitted_is_plain(const World *w, const LaneShape *s, const SurfaceMaterial *m)
{
  if (m->kind == SURFACE_MIX || !v3_is_zero(m->emission) || whitted_model(&w->whitted, m) == WHITTED_OWN) return false;
  if (!m->has_maps) return true;
  if (m->kind != SURFACE_LAMBERT && !whitted_has_own_weights(m)) return false; // color is the one map of these
  return s->kind != LANE_BALL && s->kind != LANE_ROUND && m->color_map.map >= 0 &&
         w->textures[m->color_map.map].kind == TEXTURE_MAP_CHECKER;
}

// Of all shapes of the set, once for many packets.
static inline void whitted_make_skins(Whitted *t)
{
  const World *w = t->pass->world;
  const RayMask shadow = w->has_background ? RAY_ACTOR_SHADOW : RAY_SHADOW;
  t->walls = t->panes = 0;
  t->has_lane_shadows = t->lanes != NULL;
  for (uint32_t i = 0; t->lanes && i < t->lanes->count; i++) {
    const LaneShape *s = &t->lanes->shapes[i];
    const WorldInstance *in = &w->instances[s->instance];
    const SurfaceMaterial *shown = &w->materials[in->materials[0]];
    SurfaceMaterial m = *shown;
    const SurfacePoint place = {.ng = v3(0, 0, 1), .n = v3(0, 0, 1), .color = {1, 1, 1, 1}};
    const bool is_plain = whitted_is_plain(w, s, &m);
    const TextureMap *checker = m.has_maps && is_plain ? &w->textures[m.color_map.map] : NULL;
    m.color_map.map = is_plain ? -1 : m.color_map.map;
    WhittedSkin *k = &t->skins[i];
    *k = (WhittedSkin){.m = shown};
    if (is_plain) *k = whitted_skin(w, &m, &m, &place);
    k->m = shown;
    k->checker = checker;
    k->is_plain = is_plain;
    if (!(s->mask & shadow)) continue;
    const bool is_wall = shown->kind != SURFACE_MIX && !(shown->transmission > 0) && v3_is_zero(shown->passed);
    *(is_wall ? &t->walls : &t->panes) |= 1u << i;
    const bool is_clear = shown->is_thin_walled || v3_is_zero(shown->absorption); // else what is open has no length within
    t->has_lane_shadows &= is_wall || (is_plain && !checker && (s->is_closed || is_clear));
  }
}

// --- what is there, in lanes ----------------------------------------------------------------------------

// What a checker multiplies colours with: the ray's cone covers an ellipse (footprint_of_cone), cut into uv.
static inline Wide3 whitted_checker(Whitted *t, const LaneShape *s, const TextureMap *map, int lane, unsigned bits, Wide3 p,
                                   Wide3 n)
{
  const wx zero = wx_set(0);
  const bool is_metres = s->kind == LANE_PLANE || s->kind == LANE_TRIANGLE;
  const float scale = is_metres ? 1 : 0.5f;
  const Wide3 u = w3_scale(w3_of(s->u), wx_set(scale)), v = w3_scale(w3_of(s->v), wx_set(scale));
  const wx at_u = w3_dot(p, u) + (scale * s->u0 + (is_metres ? 0 : 0.5f));
  const wx at_v = w3_dot(p, v) + (scale * s->v0 + (is_metres ? 0 : 0.5f));
  wx du[2] = {zero, zero}, dv[2] = {zero, zero};
  if (t->pass->world->whitted.filter_textures) {
    const Wide3 d = whitted_go3(t, GO_D, lane), side = w3_cross(n, d);
    const wx length2 = w3_dot(side, side), width = wx_load(&t->at[AT_WIDTH][lane]);
    const unsigned is_slanted = wx_lt(zero, length2);
    const Wide3 across = w3_choose(is_slanted, w3_scale(side, 1 / wx_sqrt(length2)), w3_of(frame_around(s->n).x));
    const wx cosine = wx_max(wx_abs(w3_dot(d, n)), wx_set(0x1p-10f));
    const Wide3 minor = w3_scale(across, width), major = w3_scale(w3_cross(across, n), width / cosine);
    du[0] = w3_dot(u, major);
    dv[0] = w3_dot(v, major);
    du[1] = w3_dot(u, minor);
    dv[1] = w3_dot(v, minor);
  }
  wxu tile;
  const Wide3 color = lane_checker_color(map, at_u, at_v, du, dv, &tile);
  wxu_store(t->pattern + lane, wxu_choose(bits, tile, wxu_load(t->pattern + lane)));
  return color;
}

static inline void whitted_put_skin(Whitted *t, const WhittedSkin *k, int lane, unsigned bits, Wide3 diffuse, Wide3 glow)
{
  const SurfaceMaterial *m = k->m;
  whitted_put3(t, AT_DIFFUSE, lane, bits, diffuse);
  whitted_put3(t, AT_LIGHT, lane, bits, glow);
  whitted_put3(t, AT_SPECULAR, lane, bits, w3_of(k->specular));
  whitted_put3(t, AT_F0, lane, bits, w3_of(k->f0));
  whitted_put3(t, AT_MIRROR, lane, bits, w3_of(k->mirror));
  whitted_put3(t, AT_PASSED, lane, bits, w3_of(k->passed));
  whitted_put3(t, AT_FADE, lane, bits, w3_of(m->absorption));
  wx_put(&t->at[AT_EXPONENT][lane], bits, wx_set(k->exponent));
  wx_put(&t->at[AT_FACETS][lane], bits, wx_set(k->facets));
  wx_put(&t->at[AT_HEIGHT][lane], bits, wx_set(whitted_height(m)));
  wx_put(&t->at[AT_IOR][lane], bits, wx_set(m->ior));
  wx_put(&t->at[AT_SMOOTH][lane], bits, wx_set(sqr_f(1 - m->roughness)));
  if (m->is_thin_walled || fabsf(m->ior - 1) < 1e-3f) whitted_mark(&t->is_thin, lane, bits);
  if (m->kind == SURFACE_PBR) whitted_mark(&t->is_pbr, lane, bits);
  if (m->kind == SURFACE_GLASS) whitted_mark(&t->is_glass, lane, bits);
  if (whitted_has_own_weights(m)) whitted_mark(&t->has_own_weights, lane, bits);
  if (m->kind == SURFACE_EMISSION) return;
  whitted_mark(&t->lives, lane, bits);
  whitted_mark(&t->model[whitted_model(&t->pass->world->whitted, m)], lane, bits);
}

// The lanes of a group that met one shape.
static inline void whitted_fill_lanes(Whitted *t, uint32_t shape, int lane, unsigned bits)
{
  const LaneShape *s = &t->lanes->shapes[shape];
  const WhittedSkin *k = &t->skins[shape];
  const wxu part = wxu_load(t->part + lane);
  const Wide3 d = whitted_go3(t, GO_D, lane);
  Wide3 p, ng;
  lane_shape_surface(s, whitted_go3(t, GO_O, lane), d, wx_load(t->t + lane), wxu_eq(part, wxu_set(1)), wxu_eq(part, wxu_set(2)),
                     &p, &ng);
  const unsigned is_back = wx_lt(wx_set(0), w3_dot(d, ng)) & bits;
  whitted_put3(t, AT_P, lane, bits, p);
  whitted_put3(t, AT_NG, lane, bits, ng);
  whitted_put3(t, AT_N, lane, bits, w3_choose(is_back, w3_turned(ng), ng));
  wx_put(&t->at[AT_ERROR][lane], bits, lane_error(s, p));
  wx_put_int(t->object + lane, bits, t->pass->world->instances[s->instance].object_i + 1);
  whitted_mark(&t->is_back, lane, is_back);
  Wide3 diffuse = w3_of(k->diffuse), glow = w3_of(k->glow);
  if (k->checker) {
    const Wide3 tint = whitted_checker(t, s, k->checker, lane, bits, p, ng);
    diffuse = w3_mul(diffuse, tint);
    glow = w3_mul(glow, tint);
  }
  whitted_put_skin(t, k, lane, bits, diffuse, glow);
}

// --- what is there, one by one --------------------------------------------------------------------------

// The trees' hit of a ray that lanes found. Barycentric weights and the like are found again from the place.
static inline Hit whitted_hit_of_lane(const Whitted *t, size_t i, const Ray *ray)
{
  const LaneShape *s = &t->lanes->shapes[t->shape[i]];
  Hit hit = {t->t[i], 0, 0, t->part[i], s->instance};
  const Instance *in = &t->pass->world->accel->instances[s->instance];
  const Vec3 p = ray->o + t->t[i] * ray->d;
  if (s->kind == LANE_QUAD || s->kind == LANE_DISK) {
    hit.u = clamp_f(0.5f * (v3_dot(p, s->u) + s->u0) + 0.5f, 0, 1);
    hit.v = clamp_f(0.5f * (v3_dot(p, s->v) + s->v0) + 0.5f, 0, 1);
  } else if (in->kind == INSTANCE_SPHERE) {
    const Vec2 uv = sphere_uv(in->size[0], frame_point(&in->object_from_world, p));
    hit.u = uv.x;
    hit.v = uv.y;
  }
  return hit;
}

// From here on the ray and its surface are as what scatters sees them.
static inline void whitted_turn_to_local(Whitted *t, size_t i, float kappa)
{
  SurfacePoint *s = &t->surface[i];
  if (kappa == 0) return;
  whitted_set3(t->go + GO_D, i, local_vector(kappa, s->p, whitted_row3(t->go + GO_D, i)));
  *s = local_surface(kappa, s);
}

static inline void whitted_fill_one(Whitted *t, size_t i)
{
  const World *w = t->pass->world;
  const Ray ray = whitted_ray(t, i);
  if (t->lanes) t->hits[i] = whitted_hit_of_lane(t, i, &ray);
  SurfacePoint *s = &t->surface[i];
  *s = trace_surface(w, &ray, &t->hits[i]);
  const float kappa = whitted_kappa(t, i);
  if (kappa != 0) t->at[AT_WIDTH][i] = t->go[GO_WIDTH][i] + t->go[GO_SPREAD][i] * local_spread(kappa, t->ways[i].passed + t->t[i]);
  trace_footprint(w, &ray, &t->hits[i], kappa == 0 ? t->at[AT_WIDTH][i] : t->at[AT_WIDTH][i] / chart_w(kappa, s->p), s);
  if (t->lanes) s->error = max_f(s->error, (LANE_ULPS * 0x1p-24f) * t->lanes->shapes[t->shape[i]].reach);
  const SurfaceMaterial *shown = &w->materials[s->material], *m = material_choose(shown, w->textures, s, 0.5f);
  const WhittedSkin k = whitted_skin(w, shown, m, s);
  t->material[i] = m;
  whitted_set3(t->at + AT_P, i, s->p);
  whitted_set3(t->at + AT_NG, i, s->ng);
  t->at[AT_ERROR][i] = s->error;
  t->object[i] = w->instances[s->instance].object_i + 1;
  t->pattern[i] = t->has_signatures && m->color_map.map >= 0 ? texture_tile(&w->textures[m->color_map.map], s) : 0;
  if (s->is_back) t->is_back |= 1ull << i;
  const int lane = (int)i / WIDEST * WIDEST;
  whitted_put_skin(t, &k, lane, 1u << ((int)i - lane), w3_of(k.diffuse), w3_of(k.glow));
  const SurfacePoint in_chart = *s;
  whitted_turn_to_local(t, i, kappa);
  whitted_set3(t->at + AT_N, i, material_normal(m, w->textures, s, -whitted_row3(t->go + GO_D, i)));
  if (whitted_level(t, i) > 0) return;
  path_first_hit(t->pass, &in_chart, &t->hits[i], clamp_color(k.diffuse + k.mirror + k.passed), &t->seen[whitted_pixel(t, i)]);
  if (world_has_gates(w) && (t->ways[i].is_moved || kappa != 0))
    path_unfold(&t->pass->eye, &t->eye_rays[whitted_pixel(t, i)], way_length(&t->ways[i], t->t[i]), &t->seen[whitted_pixel(t, i)]);
}

// --- all of a packet ------------------------------------------------------------------------------------

// What the film keeps of the first thing seen, of a place filled in lanes.
static inline void whitted_first_hit(Whitted *t, size_t i)
{
  const RenderPass *pass = t->pass;
  const LaneShape *s = &t->lanes->shapes[t->shape[i]];
  FilmSample *out = &t->seen[whitted_pixel(t, i)];
  out->is_hit = true;
  out->object = t->object[i];
  if (!(pass->film->planes & ~(1u << FILM_BEAUTY | 1u << FILM_OBJECT_ID | 1u << FILM_SAMPLES))) return;
  out->material = pass->world->instances[s->instance].materials[0] + 1;
  out->normal = whitted_row3(t->at + AT_N, i);
  out->position = whitted_row3(t->at + AT_P, i);
  out->albedo = clamp_color(whitted_row3(t->at + AT_DIFFUSE, i) + whitted_row3(t->at + AT_MIRROR, i) +
                            whitted_row3(t->at + AT_PASSED, i));
  out->depth = pass->eye.kind == EYE_PANORAMIC ? t->t[i] : v3_dot(pass->eye.frame.p - out->position, pass->eye.frame.z);
}

// The same of one ray that may have gone through gates.
static inline Vec3 whitted_sky_beyond(const Whitted *t, size_t i)
{
  const World *w = t->pass->world;
  const WorldCell *cell = &w->cells[t->go_int[GO_CELL][i]];
  const Vec3 d = whitted_row3(t->go + GO_D, i);
  const Ray ray = whitted_ray(t, i);
  if (t->ways[i].is_lost) return way_lost_light(w, &t->ways[i], &ray, t->t[i]);
  Vec3 light = sky_radiance(&cell->lights->sky, d);
  for (size_t k = 0; k < cell->own_suns; k++) light += sun_radiance(&cell->lights->suns[k], d);
  return t->ways[i].crossings ? w->fade_color + (light - w->fade_color) * space_fade(w->fade, t->last_gate[i]) : light;
}

// What length takes of the light of places seen, and puts in its stead.
static inline void whitted_lose(Whitted *t)
{
  const World *w = t->pass->world;
  for (uint64_t left = t->met; left; left &= left - 1) {
    const size_t i = (size_t)__builtin_ctzll(left);
    const float stays = space_fade(w->fade, way_length(&t->ways[i], t->t[i]));
    if (stays == 1) continue;
    const bool is_gone = !(stays > 1e-6f);
    if (is_gone) t->lives &= ~(1ull << i);
    const Vec3 shone = whitted_row3(t->at + AT_LIGHT, i);
    whitted_set3(t->at + AT_LIGHT, i, is_gone ? w->fade_color : shone + w->fade_color * ((1 - stays) / stays));
    if (!is_gone) whitted_set3(t->go + GO_WEIGHT, i, whitted_row3(t->go + GO_WEIGHT, i) * stays);
  }
}

// What comes from the sky along rays that met nothing.
static inline Wide3 whitted_sky(const Whitted *t, int lane, unsigned bits)
{
  const LightSet *lights = &t->pass->world->lights;
  const SkyMap *sky = &lights->sky;
  const Wide3 d = whitted_go3(t, GO_D, lane);
  const bool has_gates = world_has_gates(t->pass->world);
  if (!has_gates && sky->kind == SKY_MAP_CONSTANT && !lights->sun_count) return w3_of(sky->color * sky->gain);
  if (!has_gates && sky->kind == SKY_MAP_GRADIENT && !lights->sun_count) {
    const wx up = wx_min(wx_abs(d.y), wx_set(1));
    const Wide3 end = w3_choose(wx_le(wx_set(0), d.y), w3_of(sky->color), w3_of(sky->ground));
    return w3_scale(w3_add(w3_scale(w3_of(sky->horizon), 1 - up), w3_scale(end, up)), wx_set(sky->gain));
  }
  float rgb[3][WIDEST] = {{0}};
  for (; bits; bits &= bits - 1) {
    const int k = __builtin_ctz(bits);
    const Vec3 along = whitted_row3(t->go + GO_D, (size_t)(lane + k));
    const Vec3 c = has_gates ? whitted_sky_beyond(t, (size_t)(lane + k)) : sky_radiance(sky, along) + sun_radiance_seen(lights, along);
    for (int i = 0; i < 3; i++) rgb[i][k] = c[i];
  }
  return w3_load(rgb[0], WIDEST);
}

// What is left of light after `distance` in lanes; path_fade.
static inline Wide3 whitted_fade(Wide3 absorption, wx distance)
{
  const wx zero = wx_set(0), one = wx_set(1);
  wx left[3] = {absorption.x, absorption.y, absorption.z};
  for (int k = 0; k < 3; k++)
    left[k] = wx_choose(wx_lt(zero, left[k]), wx_exp(-wx_min(left[k] * distance, wx_set(100))), one);
  return w3(left[0], left[1], left[2]);
}

// Where the rays of a group end.
static inline void whitted_arrive_group(Whitted *t, int lane, unsigned going)
{
  const unsigned met = whitted_bits(t->met, lane), missed = going & ~met;
  const wx distance = wx_load(t->t + lane);
  const Wide3 absorption = whitted_go3(t, GO_FADE, lane);
  if (w3_is_zero(absorption) != WIDEST_BITS)
    w3_store(&t->go[GO_WEIGHT][lane], WHITTED_ROW, w3_mul(whitted_go3(t, GO_WEIGHT, lane), whitted_fade(absorption, distance)));
  wx_store(&t->at[AT_WIDTH][lane], wx_load(&t->go[GO_WIDTH][lane]) + wx_load(&t->go[GO_SPREAD][lane]) * distance);
  wx_put_int(t->object + lane, WIDEST_BITS, 0);
  wx_put_int(t->lit + lane, WIDEST_BITS, 0);
  wx_put_int(t->pattern + lane, WIDEST_BITS, 0);
  if (missed) whitted_put3(t, AT_LIGHT, lane, missed, whitted_sky(t, lane, missed));
  for (unsigned left = met; left;) {
    const size_t i = (size_t)(lane + __builtin_ctz(left));
    unsigned same = left & -left;
    if (t->lanes && t->skins[t->shape[i]].is_plain) {
      same = wxu_eq(wxu_load(t->shape + lane), wxu_set(t->shape[i])) & left;
      whitted_fill_lanes(t, t->shape[i], lane, same);
      for (unsigned k = same; k && whitted_level(t, i) == 0; k &= k - 1) whitted_first_hit(t, (size_t)(lane + __builtin_ctz(k)));
    } else {
      whitted_fill_one(t, i);
    }
    left &= ~same;
  }
}

// As wave_fetch(): asks memory for the triangles of all hits, so that shading waits for it once and not once a ray.
static inline void whitted_fetch(const Whitted *t)
{
  const WorldInstance *instances = t->pass->world->instances;
  for (int pass = 0; pass < 2; pass++)
    for (uint64_t left = t->met; left; left &= left - 1) {
      const Hit *h = &t->hits[__builtin_ctzll(left)];
      const TriangleMesh *mesh = &instances[h->instance].mesh;
      if (!mesh->triangles) continue;
      if (pass)
        mesh_fetch_vertices(mesh, h->prim);
      else
        mesh_fetch_indices(mesh, h->prim);
    }
}

static inline void whitted_arrive(Whitted *t)
{
  if (!t->lanes) whitted_fetch(t);
  const uint64_t all = whitted_all(t);
  t->lives = t->is_back = t->is_thin = t->is_pbr = t->is_glass = t->has_own_weights = 0;
  memset(t->model, 0, sizeof t->model);
  for (int i = 0; i < (int)t->going; i += WIDEST) whitted_arrive_group(t, i, whitted_bits(all, i));
  if (t->pass->world->fade > 0 && world_has_gates(t->pass->world)) whitted_lose(t);
  if (!t->pass->settings.transparent || whitted_level(t, 0) > 0) return;
  for (uint64_t left = all & ~t->met; left; left &= left - 1) {
    const size_t i = (size_t)__builtin_ctzll(left);
    if (world_has_gates(t->pass->world) && t->ways[i].is_lost) continue;
    t->seen[whitted_pixel(t, i)].alpha = 0;
    whitted_set3(t->at + AT_LIGHT, i, v3_all(0));
  }
}

#endif
