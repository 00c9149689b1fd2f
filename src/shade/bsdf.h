// From a material and a surface point to what light does there: the Bsdf (lobes.h), emission and coverage. Hot.
// Factors, textures and vertex colours are multiplied here; nothing below knows them.
//
// PBR follows glTF 2.0, appendix B, with its extensions ior, specular, transmission, clearcoat, emissive_strength.
// It departs where glTF's own formulas gain or lose energy or are not reciprocal: diffuse takes what the specular
// layer's albedo leaves (Kulla and Conty 2017), metals get their multiple reflections back (ibid.), the transmitting
// part uses exact Fresnel instead of Schlick's. Rough glass is not compensated for paths of several bounces: seen from
// outside it loses 1 % at roughness 0.3, 4 % at 0.5 and 8 to 25 % at 0.9, more towards the horizon and from inside.
// Sheen, anisotropy, iridescence and dispersion follow their extensions, too; what lies below a film gets what is left of
// the brightest channel at the worst angle, and stretched metals get back a part of their multiple reflections only.

#ifndef RAYFOLD_SHADE_BSDF_H
#define RAYFOLD_SHADE_BSDF_H

#include "shade/lobes.h"
#include "shade/material.h"
#include "shade/texture_lookup.h"

// --- the shading normal ---------------------------------------------------------------------------
// n moved just so far towards `to` that their cosine is at least a little.
static inline Vec3 bend_towards(Vec3 n, Vec3 to)
{
  const float least = 1e-3f, cos = v3_dot(n, to);
  return cos >= least ? n : v3_normalize(n + (2 * least - cos) * to);
}

// The normal map's normal on the front side: rgb 0..1 stands for -1..1 along tangent, bitangent and normal (glTF 2.0,
// 3.9.3).
static inline Vec3 mapped_normal(const SurfaceMaterial *m, const TextureMap *maps, const SurfacePoint *s)
{
  if (m->normal_map.map < 0 || v3_is_zero(s->tangent)) return s->n;
  const Vec3 c = 2 * texture_color(maps, m->normal_map, s) - v3_all(1);
  const Vec3 bitangent = s->tangent_sign * v3_cross(s->n, s->tangent);
  const Vec3 n = v3_normalize(m->normal_scale * (c[0] * s->tangent + c[1] * bitangent) + c[2] * s->n);
  return v3_is_zero(n) || !v3_is_finite(n) ? s->n : n;
}

static inline float bump_height(const SurfaceMaterial *m, const TextureMap *maps, const SurfacePoint *s, Vec3 step)
{
  const SurfacePoint moved = texture_moved(s, step);
  return m->bump_scale * v3_mean(texture_color(maps, m->bump_map, &moved));
}

// n of a surface raised by the bump map: n less the gradient of the heights along the surface (Mikkelsen 2010, "Bump
// Mapping Unparametrized Surfaces on the GPU", equation 3). Central differences over what the ray's cone covers, or
// over a texel where that is more, between which bilinear heights have no slope to speak of.
static inline Vec3 bumped_normal(const SurfaceMaterial *m, const TextureMap *maps, const SurfacePoint *s, Vec3 n)
{
  const float step = m->bump_scale == 0 || m->bump_map.map < 0 ? 0 : texture_step(&maps[m->bump_map.map], s);
  if (!(step > 0 && step < INFINITY)) return n;
  const Frame f = frame_around(s->ng);
  const float du = bump_height(m, maps, s, 0.5f * step * f.x) - bump_height(m, maps, s, -0.5f * step * f.x);
  const float dv = bump_height(m, maps, s, 0.5f * step * f.y) - bump_height(m, maps, s, -0.5f * step * f.y);
  const Vec3 bumped = v3_normalize(n - (du * f.x + dv * f.y) / step);
  return v3_is_zero(bumped) || !v3_is_finite(bumped) ? n : bumped;
}

// The shading normal on wo's side. It must see wo, or the surface would be black where it can be seen.
static inline Vec3 material_normal(const SurfaceMaterial *m, const TextureMap *maps, const SurfacePoint *s, Vec3 wo)
{
  const float side = s->is_back ? -1 : 1;
  const Vec3 n = bumped_normal(m, maps, s, mapped_normal(m, maps, s));
  return bend_towards(bend_towards(side * n, side * s->ng), wo);
}

// --- the materials ----------------------------------------------------------------------------------
static inline float smooth_or_rough(float roughness)
{
  return roughness < BSDF_SMOOTH_ROUGHNESS ? 0 : min_f(roughness, 1);
}

// Colours and factors that come from files may exceed what a surface can reflect.
static inline Vec3 clamp_color(Vec3 c)
{
  return v3_min(v3_max(c, v3_all(0)), v3_all(1));
}

static inline void set_roughness(Bsdf *b, float roughness)
{
  b->roughness = smooth_or_rough(roughness);
  b->alpha = b->roughness * b->roughness;
}

// The transmitting part with all but its reflectances. Equal indices bend nothing, so such a surface is treated as a
// sheet; a sheet's light leaves it the way it came, spread less than refraction into a body would (Burley,
// "Extending the Disney BRDF to a BSDF", 2015, section 5.2).
static inline void set_glass(Bsdf *b, const SurfaceMaterial *m, bool is_back, float weight, Vec3 color)
{
  b->glass = weight;
  b->tint = weight * color;
  b->is_thin = m->is_thin_walled || fabsf(m->ior - 1) < 1e-3f;
  b->eta = is_back && !b->is_thin ? 1 / m->ior : m->ior;
  const float spread = smooth_or_rough(b->roughness * clamp_f(0.65f * m->ior - 0.35f, 0, 1));
  b->thin_alpha = fabsf(m->ior - 1) < 1e-3f ? 0 : spread * spread;
}

// What a metal's microfacets reflect to and fro between them, as a factor of the two directions' missing energy
// (Kulla and Conty 2017, with the squared mean Fresnel term of a second bounce: Turquin 2019, section 3.2). f is the mean
// of its reflectance.
static inline void set_multiple(Bsdf *b, float weight, Vec3 f)
{
  const float missing = ggx_mean_missing(b->roughness);
  if (weight <= 0 || b->alpha == 0 || missing <= 0) return;
  b->multiple = weight * (f * f) * (1 - missing) / ((1 - f * missing) * missing);
  b->multiple_mean = missing;
  b->multiple_norm = 1 / f_log(1 + 1 / (b->alpha * b->alpha));
}

// A diffuse base under a specular layer, with a factor such that a white one reflects just what
// the layer leaves (Kulla and Conty 2017, "diffuse").
static inline void set_covered(Bsdf *b, Vec3 albedo, float f0, float f90)
{
  b->cover0 = f0;
  b->cover90 = f90;
  b->diffuse_mean = max_f(1 - ggx_albedo(ggx_albedo_mean(b->roughness), f0, f90), 1e-4f);
  b->diffuse = albedo / b->diffuse_mean;
}

static inline void set_coat(const SurfaceMaterial *m, const TextureMap *maps, const SurfacePoint *s, Bsdf *b)
{
  if (m->clearcoat <= 0) return;
  b->coat = clamp_f(m->clearcoat * texture_channel(maps, m->clearcoat_map, s), 0, 1);
  b->coat_roughness =
      smooth_or_rough(m->clearcoat_roughness * texture_channel(maps, m->clearcoat_roughness_map, s));
  b->coat_alpha = b->coat_roughness * b->coat_roughness;
}

// --- what few materials have ------------------------------------------------------------------------
// Stretched bumps (KHR_materials_anisotropy): wider along a direction given by a turn from the tangent and a texture.
static RARE void set_anisotropy(const SurfaceMaterial *m, const TextureMap *maps, const SurfacePoint *s, Bsdf *b)
{
  float strength = m->anisotropy, sine, cosine;
  Vec2 along = {1, 0};
  if (m->anisotropy_map.map >= 0) {
    const Vec3 c = texture_color(maps, m->anisotropy_map, s);
    const float x = 2 * c[0] - 1, y = 2 * c[1] - 1, length = sqrtf(x * x + y * y);
    if (length > 1e-4f) along = (Vec2){x / length, y / length};
    strength *= c[2];
  }
  strength = clamp_f(strength, 0, 1);
  if (!(strength > 1e-3f) || v3_is_zero(s->tangent)) return;
  f_sincos(m->anisotropy_turn, &sine, &cosine);
  const Vec3 bitangent = s->tangent_sign * v3_cross(s->n, s->tangent), z = b->frame.z;
  const Vec3 x = (along.x * cosine - along.y * sine) * s->tangent + (along.x * sine + along.y * cosine) * bitangent;
  const Vec3 flat = v3_normalize(x - v3_dot(x, z) * z);
  if (!(v3_dot(flat, flat) > 0.5f)) return;
  b->frame.x = flat;
  b->frame.y = v3_cross(z, flat);
  const float narrow = sqr_f(max_f(b->roughness, BSDF_SMOOTH_ROUGHNESS));
  b->width = (Vec2){mix_f(narrow, 1, strength * strength), narrow};
  b->alpha = sqrtf(b->width.x * b->width.y);
  b->roughness = sqrtf(b->alpha);
  b->stretch = strength;
  b->is_stretched = true;
}

// A film over a surface whose part that lies under it reflects f0 at normal incidence. *bound: the least f0 whose
// Schlick term with f90 = 1 is above the film's reflectance at every angle; *mean: over the hemisphere, by the cosine.
// Eight angles and three low ones: with 64 neither changes by more than 0.01 for films up to 600 nm.
static RARE void set_film(const SurfaceMaterial *m, const TextureMap *maps, const SurfacePoint *s, Vec3 f0, Bsdf *b,
                            float *bound, Vec3 *mean)
{
  enum { ANGLES = 8 };
  const float weight = clamp_f(m->iridescence * texture_channel(maps, m->iridescence_map, s), 0, 1);
  const float thickness = mix_f(m->film_least, m->film_most, texture_channel(maps, m->film_map, s));
  *bound = 0;
  *mean = v3_all(0);
  if (!(weight > 0) || !(thickness > 0)) return;
  b->film = thin_film(weight, m->film_ior, thickness, f0);
  for (int i = 0; i < ANGLES; i++) {
    const float cos = sqrtf(((float)i + 0.5f) / ANGLES), x = fresnel_schlick(cos);
    const Vec3 r = film_reflectance(&b->film, cos);
    *mean += r / ANGLES;
    *bound = max_f(*bound, (v3_max_lane(r) - x) / (1 - x));
  }
  for (int i = 1; i <= 3; i++) { // the angles above leave out the lowest
    const float cos = 0.06f * (float)i, x = fresnel_schlick(cos);
    *bound = max_f(*bound, (v3_max_lane(film_reflectance(&b->film, cos)) - x) / (1 - x));
  }
  *bound = min_f(*bound + 0.01f, 1);
}

static RARE void set_sheen(const SurfaceMaterial *m, const TextureMap *maps, const SurfacePoint *s, Bsdf *b)
{
  b->sheen = clamp_color(m->sheen_color * texture_color(maps, m->sheen_color_map, s));
  b->sheen_roughness = m->sheen_roughness * texture_channel(maps, m->sheen_roughness_map, s);
  b->sheen_most = v3_max_lane(b->sheen);
}

// All of these. below: what lies under a film, at normal incidence; cover0 and mean: of the specular layer, changed by one.
static RARE void set_extras(const SurfaceMaterial *m, const TextureMap *maps, const SurfacePoint *s, Vec3 below,
                                  float specular, Bsdf *b, float *cover0, Vec3 *mean)
{
  b->has_extras = true;
  if (m->anisotropy > 0) set_anisotropy(m, maps, s, b);
  if (m->iridescence > 0) {
    float bound;
    Vec3 film_mean;
    set_film(m, maps, s, below, b, &bound, &film_mean);
    *mean = v3_mix(*mean, film_mean, b->film.weight);
    *cover0 = mix_f(*cover0, bound * specular, b->film.weight);
  }
  set_sheen(m, maps, s, b);
}

// Parts the colours of light at a surface it is refracted by: what passes is of one channel, the band. A path that has
// not been refracted yet (is_white) has that channel chosen evenly and brings it three times; one that has goes on with
// its own. The indices are those of KHR_materials_dispersion, red's the least.
static RARE void bsdf_disperse(const SurfaceMaterial *m, int band, bool is_white, Bsdf *b)
{
  if (!(m->dispersion > 0) || !(b->glass > 0) || b->is_thin) return;
  const float spread = (m->ior - 1) * 0.025f * m->dispersion;
  const Vec3 inside = v3_max(v3(m->ior - spread, m->ior, m->ior + spread), v3_all(1.001f));
  b->etas = b->eta < 1 ? v3_all(1) / inside : inside;
  b->eta = b->etas[band];
  b->band = (uint8_t)band;
  b->is_dispersed = is_white;
}

static inline void bsdf_pbr(const SurfaceMaterial *m, const TextureMap *maps, const SurfacePoint *s,
                            Vec3 base, Bsdf *b)
{
  const float metal = clamp_f(m->metallic * texture_channel(maps, m->metallic_map, s), 0, 1);
  const float through = clamp_f(m->transmission * texture_channel(maps, m->transmission_map, s), 0, 1);
  const float specular = clamp_f(m->specular * texture_channel(maps, m->specular_map, s), 0, 1);
  const Vec3 specular_color = m->specular_color * texture_color(maps, m->specular_color_map, s);
  const Vec3 f0 = specular * clamp_color(fresnel_f0(m->ior) * specular_color); // KHR_materials_specular
  const float glass = (1 - metal) * through, plastic = (1 - metal) * (1 - through);
  set_roughness(b, m->roughness * texture_channel(maps, m->roughness_map, s));

  b->f0 = metal * base + plastic * f0;
  b->f90 = v3_all(metal + plastic * specular);
  float cover0 = v3_max_lane(f0);
  Vec3 mean = base + (v3_all(1) - base) / 21; // of Schlick's term
  if (m->has_extras) {
    const bool is_glass_only = metal == 0 && plastic == 0;
    const Vec3 below = is_glass_only ? f0 / max_f(specular, 1e-6f) : b->f0 / max_f(b->f90[0], 1e-6f);
    set_extras(m, maps, s, below, specular, b, &cover0, &mean);
  }
  set_multiple(b, metal, mean);
  if (plastic > 0) set_covered(b, plastic * base, cover0, specular);
  if (glass > 0) {
    set_glass(b, m, s->is_back, glass, base);
    b->glass0 = f0;
    b->glass90 = v3_all(specular);
    b->is_coat_behind = s->is_back && !b->is_thin;
  }
  set_coat(m, maps, s, b);
}

static inline void bsdf_glass(const SurfaceMaterial *m, const SurfacePoint *s, Vec3 color, Bsdf *b)
{
  set_roughness(b, m->roughness);
  set_glass(b, m, s->is_back, 1, color);
  b->glass0 = v3_all(fresnel_f0(m->ior));
  b->glass90 = v3_all(1);
}

// Highlights of older tracers: the parts of diffuse and gloss add up to 1 at most, which world/ sees to.
static RARE void bsdf_gloss(const SurfaceMaterial *m, Vec3 color, Bsdf *b)
{
  set_covered(b, color, 0, 0);
  b->gloss = (Gloss){m->distribution, m->gloss_width, m->gloss_c, m->specular_color * m->gloss_f0, m->specular_color};
  b->has_extras = true;
}

// --- mixes ------------------------------------------------------------------------------------------
// A surface that is one material in part and another for the rest. Which of the two a path meets is settled by chance at
// each hit, so that all after it (lobes, densities, MIS) is that of a plain material and the mean is exactly the sum;
// what shines is added up without chance. A part that is not wholly there (alpha) counts by as much as is there. Mixes
// hold mixes only so deep, and never themselves (scene/mix_check.h), so these functions end.
static inline float material_opacity(const SurfaceMaterial *m, const TextureMap *maps, const SurfacePoint *s);

// How much is there of each part.
static RARE void mix_parts(const SurfaceMaterial *m, const TextureMap *maps, const SurfacePoint *s, float *first,
                           float *second)
{
  const float amount = clamp_f(m->mix_amount * texture_channel(maps, m->mix_map, s), 0, 1);
  *first = 1 - amount;
  *second = amount;
  if (m->alpha_mode == SURFACE_OPAQUE) return;
  *first *= material_opacity(m + m->mix_first, maps, s);
  *second *= material_opacity(m + m->mix_second, maps, s);
}

static RARE float mix_second_share(const SurfaceMaterial *m, const TextureMap *maps, const SurfacePoint *s)
{
  float first, second;
  mix_parts(m, maps, s, &first, &second);
  return second > 0 ? second / (first + second) : 0;
}

static RARE const SurfaceMaterial *mix_choose(const SurfaceMaterial *m, const TextureMap *maps, const SurfacePoint *s,
                                         float chance)
{
  while (m->kind == SURFACE_MIX) {
    const float share = mix_second_share(m, maps, s);
    const bool is_second = chance < share;
    chance = is_second ? chance / share : (chance - share) / (1 - share);
    m += is_second ? m->mix_second : m->mix_first;
  }
  return m;
}

// The plain material a path meets at s, by a number in [0, 1) that is used for nothing else.
static inline const SurfaceMaterial *material_choose(const SurfaceMaterial *m, const TextureMap *maps,
                                                     const SurfacePoint *s, float chance)
{
  return m->kind == SURFACE_MIX ? mix_choose(m, maps, s, chance) : m;
}

// The Bsdf of the material at s for light that leaves towards wo (unit, on the side s.is_back says).
static inline void material_bsdf(const SurfaceMaterial *m, const TextureMap *maps, const SurfacePoint *s,
                                 Vec3 wo, Bsdf *out)
{
  *out = (Bsdf){.eta = 1};
  m = material_choose(m, maps, s, 0.5f); // whoever has not chosen gets the larger part
  out->ng = (s->is_back ? -1.0f : 1.0f) * s->ng;
  out->frame = frame_around(material_normal(m, maps, s, wo));
  const Vec3 color = clamp_color(m->color * texture_color(maps, m->color_map, s) * v3_load(s->color));
  switch ((SurfaceKind)m->kind) {
  case SURFACE_PBR: bsdf_pbr(m, maps, s, color, out); return;
  case SURFACE_LAMBERT:
    set_covered(out, color, 0, 0);
    out->is_matt = true;
    return;
  case SURFACE_MIRROR:
    set_roughness(out, m->roughness);
    out->f0 = out->f90 = color;
    return;
  case SURFACE_GLASS: bsdf_glass(m, s, color, out); return;
  case SURFACE_PHONG:
  case SURFACE_COOK_TORRANCE: bsdf_gloss(m, color, out); return;
  case SURFACE_EMISSION:
  case SURFACE_MIX: return;
  }
  unreachable();
}

// Of sheen about what it reflects at 45 degrees, of gloss and films what they do straight on.
static RARE Vec3 albedo_with_extras(const Bsdf *b, Vec3 base)
{
  const float sheen = min_f(sheen_raw_albedo(b->sheen_roughness, 0.7f), 1);
  if (b->film.weight > 0) base += b->film.weight * (b->f90 * film_reflectance(&b->film, 1) - b->f0);
  return (base + b->gloss.f0) * (1 - sheen * b->sheen_most) + b->sheen * sheen;
}

// The colour a denoiser may divide by: about what the surface reflects or passes of light from all around, 0..1.
static inline Vec3 bsdf_albedo(const Bsdf *b)
{
  const GgxAlbedo mean = ggx_albedo_mean(b->roughness);
  const Vec3 specular = b->f0 * (mean.full - mean.edge) + b->f90 * mean.edge;
  const Vec3 glass = b->glass * b->glass0 + b->tint * (1 - v3_max_lane(b->glass0));
  Vec3 base = b->diffuse * sqr_f(b->diffuse_mean) + b->multiple * sqr_f(b->multiple_mean) + specular + glass;
  if (b->has_extras) base = albedo_with_extras(b, base);
  return clamp_color(base * (1 - b->coat * COAT_F0) + v3_all(b->coat * COAT_F0));
}

static RARE Vec3 mix_emission(const SurfaceMaterial *m, const TextureMap *maps, const SurfacePoint *s);

// Radiance emitted to the side the ray came from. A material that is not double-sided shines to the front only.
static inline Vec3 material_emission(const SurfaceMaterial *m, const TextureMap *maps, const SurfacePoint *s)
{
  if (v3_is_zero(m->emission) || (s->is_back && !m->is_double_sided)) return v3_all(0);
  if (m->kind == SURFACE_MIX) return mix_emission(m, maps, s);
  return m->emission * v3_max(texture_color(maps, m->emission_map, s), v3_all(0));
}

static RARE Vec3 mix_emission(const SurfaceMaterial *m, const TextureMap *maps, const SurfacePoint *s)
{
  return v3_mix(material_emission(m + m->mix_first, maps, s), material_emission(m + m->mix_second, maps, s),
                mix_second_share(m, maps, s));
}

// How much of the surface is there, 0..1: 1 when opaque, 0 or 1 when masked.
static inline float material_opacity(const SurfaceMaterial *m, const TextureMap *maps, const SurfacePoint *s)
{
  if (m->alpha_mode == SURFACE_OPAQUE) return 1;
  if (m->kind == SURFACE_MIX) {
    float first, second;
    mix_parts(m, maps, s, &first, &second);
    return min_f(first + second, 1);
  }
  const TextureRef alpha = {m->color_map.map, 3};
  const float a =
      m->opacity * s->color[3] * texture_channel(maps, alpha, s) * texture_channel(maps, m->opacity_map, s);
  if (m->alpha_mode == SURFACE_MASK) return a >= m->alpha_cutoff ? 1 : 0;
  return clamp_f(a, 0, 1);
}

#endif
