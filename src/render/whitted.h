// Whitted: direct light, mirror rays and refracted rays, all of them and no chance (Whitted, "An improved illumination
// model for shaded display", 1980). A pixel's tree of rays is a list of work: each entry is a ray, what it may still
// bring to its pixel, and what it is inside of. The newest 64 entries go at once, so that their rays and their shadow
// rays are asked together, and what they send on comes next: the list stays as deep as the tree, not as wide.
//
//   list  [ ... | 64 newest ] --> closest hits --> light by light: shadow rays --> mirror and refracted rays --> list
//
// All numbers of a packet lie in rows (whitted_rows.h), so that what is the same for every ray is done for as many as a
// register holds: whitted_surface.h finds what they meet, whitted_light.h lights it, and this file sends on. In worlds of
// few simple shapes (accel/lanes.h) nothing at all is done ray by ray. Floats in lanes instead of doubles one by one made
// the intro's scenes 8 to 20 times as fast; they differ by a 255th or more in 0 and 7 of 480 000 pixels.
//
// Sums are of multiples of 2^-28 like the film's and so exact, also in doubles; a pixel does not depend on who was traced beside it. A signature tells
// what a pixel is made of: objects met and lights that reach them, at the eye's ray, along mirror rays to the second and
// refracted rays to the third surface; equal ones may be interpolated (subsample.h).
//
// How surfaces count (docs/shapes.md has the table): `light_model` "scene" takes what the material is; the others give
// every material one of three. In "physical" units lights fall off and highlights lose no energy, and the scene's own
// materials are those of the path tracer; in "classic" units a point's intensity arrives undiminished, matt
// surfaces show diffuse * cosine, highlights specular * cosine^exponent.
//
// Rough mirrors and rough glass are taken for smooth ones, weaker the rougher a mirror is. More than MOST_LIGHTS lights
// are not all asked: one of them by chance, as the path tracer does.

#ifndef RAYFOLD_RENDER_WHITTED_H
#define RAYFOLD_RENDER_WHITTED_H

#include "render/whitted_light.h"

// Once for many packets of a pass.
static inline void whitted_place(Whitted *t, const RenderPass *pass, RayCounters *counters, bool has_signatures)
{
  t->has_signatures = has_signatures;
  t->pass = pass;
  t->counters = counters;
  t->lanes = pass->world->lanes;
  t->has_curved = false;
  for (uint32_t i = 0; i < pass->world->cell_count; i++) t->has_curved |= world_curvature(pass->world, i) != 0;
  whitted_make_skins(t);
}

static inline void whitted_begin(Whitted *t, uint32_t sample)
{
  t->sample = sample;
  t->count = t->height = 0;
  memset(t->habits, 0, sizeof t->habits);
}

// Adds the sample of a pixel.
static inline void whitted_add(Whitted *t, uint32_t x, uint32_t y)
{
  t->x[t->count] = x;
  t->y[t->count++] = y;
}

// --- the eye's rays -------------------------------------------------------------------------------------

// Is the filter narrower than what a place on the film can tell apart?
static inline bool filter_is_point(const Filter *f) { return f->place[0] > -1e-5f && f->place[FILTER_STEPS] < 1e-5f; }

// Places on the film, and on the lens where there is one.
static inline void whitted_film_places(const Whitted *t, float *film_x, float *film_y)
{
  const RenderPass *pass = t->pass;
  SamplerRows rows = {0};
  uint32_t u[SAMPLER_ROWS], v[SAMPLER_ROWS];
  if (filter_is_point(&pass->filter)) {
    for (size_t i = 0; i < t->count; i++) {
      film_x[i] = (float)t->x[i] + 0.5f;
      film_y[i] = (float)t->y[i] + 0.5f;
    }
    return;
  }
  for (size_t i = 0; i < t->count; i++) {
    const Sampler s = sampler_begin(t->x[i], t->y[i], t->sample, pass->seed);
    sampler_rows_set(&rows, i, &s);
  }
  sample_rows(&rows, t->count, PAIR_FILM, u, v);
  for (size_t i = 0; i < t->count; i++) {
    const Vec2 off = filter_sample(&pass->filter, (Vec2){unit_float(u[i]), unit_float(v[i])});
    film_x[i] = (float)t->x[i] + 0.5f + off.x;
    film_y[i] = (float)t->y[i] + 0.5f + off.y;
  }
}

// What the ray of direction d stands for: eye_cone, in lanes.
static inline wx whitted_spread(const Eye *e, float height, Wide3 d)
{
  switch (e->kind) {
  case EYE_PERSPECTIVE: {
    const wx cosine = wx_max(-w3_dot(d, w3_of(e->frame.z)), wx_set(0));
    return 2 * e->tan_half_fov / height * cosine * wx_sqrt(cosine);
  }
  case EYE_ORTHOGRAPHIC: return wx_set(0);
  case EYE_PANORAMIC: return wx_set(e->span / 2 / height);
  }
  unreachable();
}

// eye_ray() of pinholes.
static inline void whitted_pinhole(Whitted *t, const float *film_x, const float *film_y)
{
  const Eye *e = &t->pass->eye;
  const float width = (float)t->pass->film->width, height = (float)t->pass->film->height;
  const float across = e->tan_half_fov * (width / height);
  for (size_t i = 0; i < t->count; i += WIDEST) {
    const wx x = 2 * wx_load(film_x + i) / width - 1, y = 1 - 2 * wx_load(film_y + i) / height;
    const Wide3 d = w3_vector(&e->frame, w3(x * across, y * e->tan_half_fov, wx_set(-1)));
    w3_store(&t->list[GO_O][i], LIST_ROW, w3_of(e->frame.p));
    w3_store(&t->list[GO_D][i], LIST_ROW, w3_normalize(d));
  }
}

static inline void whitted_other_eyes(Whitted *t, const float *film_x, const float *film_y)
{
  const RenderPass *pass = t->pass;
  for (size_t i = 0; i < t->count; i++) {
    Vec2 lens = {0, 0};
    if (pass->eye.aperture > 0) {
      const Sampler s = sampler_begin(t->x[i], t->y[i], t->sample, pass->seed);
      lens = sample_pair(&s, PAIR_LENS);
    }
    const Ray ray = eye_ray(&pass->eye, (float)pass->film->width, (float)pass->film->height, (Vec2){film_x[i], film_y[i]}, lens);
    for (int k = 0; k < 3; k++) {
      t->list[GO_O + k][i] = ray.o[k];
      t->list[GO_D + k][i] = ray.d[k];
    }
  }
}

static inline void whitted_look(Whitted *t)
{
  const RenderPass *pass = t->pass;
  const Eye *e = &pass->eye;
  float film_x[WHITTED_ROW] = {0}, film_y[WHITTED_ROW] = {0};
  whitted_film_places(t, film_x, film_y);
  if (e->kind == EYE_PERSPECTIVE && !(e->aperture > 0))
    whitted_pinhole(t, film_x, film_y);
  else
    whitted_other_eyes(t, film_x, film_y);
  const float share = pass->world->whitted.filter_textures ? 1 / sqrtf((float)t->sample + 1) : 0;
  const float height = (float)pass->film->height, begin = e->kind == EYE_ORTHOGRAPHIC ? e->height / height : 0;
  for (size_t i = 0; i < t->count; i += WIDEST) {
    const Wide3 d = w3_load(&t->list[GO_D][i], LIST_ROW);
    w3_store(&t->list[GO_WEIGHT][i], LIST_ROW, w3_all(wx_set(1)));
    w3_store(&t->list[GO_FADE][i], LIST_ROW, w3_all(wx_set(0)));
    wx_store(&t->list[GO_WIDTH][i], wx_set(share * begin));
    wx_store(&t->list[GO_SPREAD][i], share * whitted_spread(e, height, d));
  }
  const float kappa = world_curvature(pass->world, e->cell);
  for (size_t i = 0; kappa != 0 && i < t->count; i++) {
    float (*o)[LIST_ROW] = t->list + GO_O, (*d)[LIST_ROW] = t->list + GO_D;
    const Vec3 turned = local_direction(kappa, v3(o[0][i], o[1][i], o[2][i]), v3(d[0][i], d[1][i], d[2][i]));
    for (int k = 0; k < 3; k++) d[k][i] = turned[k];
  }
  memset(t->signature, 0, sizeof t->signature);
  for (size_t i = 0; i < WHITTED_SIZE; i++) {
    t->list_int[GO_WAY][i] = 1;
    t->list_int[GO_CELL][i] = pass->eye.cell;
    t->list_int[GO_INFO][i] = (uint32_t)i | 1u << INFO_REFRACTED;
  }
  for (size_t i = 0; i < t->count; i++) {
    t->seen[i].alpha = 1;
    t->seen[i].is_hit = false;
  }
  t->height = t->count;
}

// --- what goes on -----------------------------------------------------------------------------------------

// What goes which way in the chart, of those in curved cells.
static inline Wide3 whitted_in_chart(const Whitted *t, int lane, unsigned bits, Wide3 d)
{
  float rows[3][WIDEST];
  w3_store(rows[0], WIDEST, d);
  for (; bits; bits &= bits - 1) {
    const int k = __builtin_ctz(bits);
    const size_t i = (size_t)(lane + k);
    const Vec3 turned = local_direction(whitted_kappa(t, i), whitted_row3(t->at + AT_P, i), v3(rows[0][k], rows[1][k], rows[2][k]));
    for (int c = 0; c < 3; c++) rows[c][k] = turned[c];
  }
  return w3_load(rows[0], WIDEST);
}

static inline void whitted_send(Whitted *t, int lane, unsigned bits, Wide3 weight, Wide3 d, Wide3 absorption, bool is_refracted)
{
  weight = w3_mul(weight, whitted_go3(t, GO_WEIGHT, lane));
  bits &= wx_lt(wx_set(t->pass->world->whitted.least_weight), w3_most(weight));
  if (!bits) return;
  if (t->has_curved) d = whitted_in_chart(t, lane, bits, d);
  const Wide3 p = whitted_at3(t, AT_P, lane), ng = whitted_at3(t, AT_NG, lane);
  const wx error = wx_load(&t->at[AT_ERROR][lane]), off = wx_choose(wx_lt(w3_dot(d, ng), wx_set(0)), -error, error);
  const Wide3 o = w3_add(p, w3_scale(ng, off));
  const wx rows[GO_ROWS] = {o.x, o.y, o.z, d.x, d.y, d.z, weight.x, weight.y, weight.z, absorption.x, absorption.y,
                            absorption.z, wx_load(&t->at[AT_WIDTH][lane]), wx_load(&t->go[GO_SPREAD][lane])};
  for (int k = 0; k < GO_ROWS; k++) wx_squeeze(&t->list[k][t->height], bits, rows[k]);
  const wxu way = wxu_load(&t->go_int[GO_WAY][lane]), info = wxu_load(&t->go_int[GO_INFO][lane]) + (1u << INFO_LEVEL);
  wxu_squeeze(&t->list_int[GO_WAY][t->height], bits, wxu_hash_combine(way, wxu_set(2 + is_refracted)));
  wxu_squeeze(&t->list_int[GO_CELL][t->height], bits, wxu_load(&t->go_int[GO_CELL][lane]));
  wxu_squeeze(&t->list_int[GO_INFO][t->height], bits, is_refracted ? info : info & ~(1u << INFO_REFRACTED));
  t->height += (size_t)__builtin_popcount(bits);
}

// The part of light that a smooth surface between two dielectrics reflects, and the cosine behind it, 0 where all is
// (fresnel_dielectric, in floats: near total reflection that cosine is known to 3e-4).
static inline wx whitted_dielectric(wx i, wx eta, wx *cos_t)
{
  const wx zero = wx_set(0), cos2_t = 1 - (1 - i) * (1 + i) / (eta * eta), cosine = wx_sqrt(wx_max(cos2_t, zero));
  const wx s = (i - eta * cosine) / (i + eta * cosine), p = (eta * i - cosine) / (eta * i + cosine);
  *cos_t = cosine;
  return wx_choose(wx_lt(zero, cos2_t), (s * s + p * p) / 2, wx_set(1));
}

// What is passed, split between the refracted ray, which is sent here, and the mirror. Total reflection sends all that
// would have passed to the mirror's direction.
static inline Wide3 whitted_pass(Whitted *t, int lane, unsigned bits, wx cos_i, Wide3 mirror)
{
  const bool has_fresnel = t->pass->world->whitted.fresnel;
  const unsigned is_thin = whitted_bits(t->is_thin, lane), is_back = whitted_bits(t->is_back, lane);
  const unsigned has_own = whitted_bits(t->has_own_weights, lane), is_glass = whitted_bits(t->is_glass, lane);
  const Wide3 passed = whitted_at3(t, AT_PASSED, lane), wo = w3_turned(whitted_go3(t, GO_D, lane)), n = whitted_at3(t, AT_N, lane);
  const wx one = wx_set(1), zero = wx_set(0), ior = wx_load(&t->at[AT_IOR][lane]), eta = wx_choose(is_back & ~is_thin, 1 / ior, ior);
  wx cos_t;
  const wx reflected = whitted_dielectric(cos_i, eta, &cos_t), f0 = (ior - 1) / (ior + 1);
  const unsigned is_total = ~is_thin & wx_eq(cos_t, zero);
  wx part = has_fresnel ? reflected : wx_choose(has_own, zero, f0 * f0);
  part = wx_choose(is_total, one, part);
  const wx least = wx_set(1e-6f);
  const wx whole = wx_choose(is_glass & ~is_total, 1 / wx_max(w3_most(passed), least), one); // polished glass mirrors white
  const unsigned sent = bits & ~is_total;
  if (sent) {
    const Wide3 bent = w3_normalize(w3_sub(w3_scale(n, cos_i / eta - cos_t), w3_scale(wo, 1 / eta)));
    const Wide3 d = w3_choose(is_thin, w3_turned(wo), bent);
    const Wide3 outside = w3_choose(is_thin, whitted_go3(t, GO_FADE, lane), w3_all(zero));
    const Wide3 inside = w3_choose(is_thin | is_back, outside, whitted_at3(t, AT_FADE, lane));
    whitted_send(t, lane, sent, w3_scale(passed, 1 - part), d, inside, true);
  }
  return w3_choose(bits, w3_add(mirror, w3_scale(passed, part * whole)), mirror);
}

// The weights of both rays. With Fresnel's formulas what is passed splits; else both are as the material says, glass as
// it is seen straight on.
static inline void whitted_go_on(Whitted *t, int lane, unsigned bits)
{
  const Wide3 d = whitted_go3(t, GO_D, lane), n = whitted_at3(t, AT_N, lane);
  Wide3 mirror = whitted_at3(t, AT_MIRROR, lane);
  const unsigned mirrors = bits & ~w3_is_zero(mirror), passes = bits & ~w3_is_zero(whitted_at3(t, AT_PASSED, lane));
  if (!(mirrors | passes)) return;
  const wx along = w3_dot(d, n), cos_i = wx_clamp(-along, 0, 1);
  const unsigned grows = mirrors & whitted_bits(t->is_pbr, lane);
  if (grows && t->pass->world->whitted.fresnel) {
    const wx away = 1 - cos_i, away2 = away * away, x = away2 * away2 * away, smooth = wx_load(&t->at[AT_SMOOTH][lane]);
    const Wide3 grown = w3_add(mirror, w3_scale(w3_sub(w3_all(smooth), mirror), x));
    mirror = w3_choose(grows & wx_lt(wx_set(0), w3_most(mirror)), grown, mirror);
  }
  if (passes) mirror = whitted_pass(t, lane, passes, cos_i, mirror);
  const unsigned reflects = bits & ~w3_is_zero(mirror);
  if (reflects)
    whitted_send(t, lane, reflects, mirror, w3_sub(d, w3_scale(n, 2 * along)), whitted_go3(t, GO_FADE, lane), false);
}

// --- what it comes to -------------------------------------------------------------------------------------

// The nearest multiple of 2^-28: adding 1.5 * 2^24 leaves no more places.
static inline double whitted_fixed(float x) { return (double)x + 0x1.8p24 - 0x1.8p24; }

// Held as film_fixed() does.
static inline wx whitted_held(wx x)
{
  return wx_choose(wx_eq(x, x), wx_clamp(x, -FILM_LIMIT, FILM_LIMIT), wx_set(0));
}

// Sums, in any order, of a group's signatures.
static inline void whitted_sign(Whitted *t, int lane, unsigned bits)
{
  const wxu info = wxu_load(&t->go_int[GO_INFO][lane]), level = info >> INFO_LEVEL & 0xff;
  const wxu most = 2 + (info >> INFO_REFRACTED & 1);
  const wxu what = wxu_load(t->object + lane) ^ wxu_load(t->pattern + lane);
  const wxu sign = wxu_hash_combine(wxu_hash_combine(wxu_load(&t->go_int[GO_WAY][lane]), what), wxu_load(t->lit + lane));
  const wxu counts = wxu_choose(wx_le(wx_of_int((wxi)level), wx_of_int((wxi)most)), sign, wxu_set(0));
  uint32_t signs[WIDEST];
  wxu_store(signs, counts);
  for (size_t i = 0; bits; i++, bits >>= 1) t->signature[whitted_pixel(t, (size_t)lane + i)] += signs[i];
}

// Adds all light to its pixels; the first packet, in their order, begins the sums.
static inline void whitted_pay(Whitted *t)
{
  float (*light)[WHITTED_ROW] = t->at + AT_LIGHT;
  for (int i = 0; i < (int)t->going; i += WIDEST) {
    const Wide3 l = w3_mul(whitted_go3(t, GO_WEIGHT, i), whitted_at3(t, AT_LIGHT, i));
    w3_store(&light[0][i], WHITTED_ROW, w3(whitted_held(l.x), whitted_held(l.y), whitted_held(l.z)));
  }
  if (whitted_level(t, 0) == 0) {
    for (int c = 0; c < 3; c++)
      for (size_t i = 0; i < WHITTED_SIZE; i++) t->sums[c][i] = whitted_fixed(light[c][i]);
    return;
  }
  for (size_t i = 0; i < t->going; i++) {
    const uint32_t pixel = whitted_pixel(t, i);
    for (int c = 0; c < 3; c++) t->sums[c][pixel] += whitted_fixed(light[c][i]);
  }
}

// The newest rays of the list, to the end.
static inline void whitted_step(Whitted *t)
{
  t->going = t->height < WHITTED_SIZE ? t->height : WHITTED_SIZE;
  t->height -= t->going;
  for (int k = 0; k < GO_ROWS; k++) memcpy(t->go[k], &t->list[k][t->height], sizeof t->go[k]);
  for (int k = 0; k < GO_INT_ROWS; k++) memcpy(t->go_int[k], &t->list_int[k][t->height], sizeof t->go_int[k]);
  whitted_find(t);
  whitted_arrive(t);
  whitted_light(t);
  const int32_t most = t->pass->settings.max_depth < MOST_LEVELS ? t->pass->settings.max_depth : MOST_LEVELS;
  const uint64_t all = whitted_all(t);
  whitted_pay(t);
  for (int i = 0; i < (int)t->going; i += WIDEST) {
    const wxu level = wxu_load(&t->go_int[GO_INFO][i]) >> INFO_LEVEL & 0xff;
    const unsigned lives = whitted_bits(t->lives, i) & wx_lt(wx_of_int((wxi)level), wx_set((float)most));
    if (t->has_signatures) whitted_sign(t, i, whitted_bits(all, i));
    if (lives) whitted_go_on(t, i, lives);
  }
}

// What the pixels see is in t->seen and t->signature.
static inline void whitted_trace(Whitted *t)
{
  whitted_look(t);
  while (t->height) whitted_step(t);
  for (size_t i = 0; i < t->count; i++)
    for (int k = 0; k < 3; k++) t->seen[i].radiance[k] = (float)t->sums[k][i];
}

#endif
