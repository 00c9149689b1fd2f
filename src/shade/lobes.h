// Bsdf: how a surface scatters light at one point, as numbers, and the two questions asked of it: how much (eval) and
// where to (sample). Hot. Every material is the same stack of lobes, most of them of zero weight:
//
//      wo   wl
//        \ /        coat      a clear film of ior 1.5 over everything (GGX or mirror), seen from the front only
//     ----v----     specular  GGX or mirror; per microfacet, light reflects or (glass) refracts
//      diffuse      diffuse   what specular lets through; and what a metal's bumps pass on among themselves
//     ----.----     thin      light that goes straight through a sheet
//          \ wl
//
// Invariants: reflected plus transmitted light never exceeds the incoming (tests/test_bsdf.c: by less than 1e-3);
// reflection is reciprocal, transmission up to the square of the index; the pdf eval gives is the one sample has, and
// sample's weight is eval over pdf by construction. Transmission carries radiance (seen from the camera), so it is
// divided by the squared relative index (Veach 1997, section 5.2).
//
// Not here: where the numbers come from (bsdf.h), emission, and what happens between two surfaces (media).

#ifndef RAYFOLD_SHADE_LOBES_H
#define RAYFOLD_SHADE_LOBES_H

#include "base/ray.h"
#include "shade/fresnel.h"
#include "shade/ggx_table.h"
#include "shade/microfacet.h"

// Below this roughness a lobe is a perfect mirror (delta): alpha would be under 0.001, narrower than float
// directions can resolve to the accuracy promised, and than an eye can tell.
#define BSDF_SMOOTH_ROUGHNESS 0.03f

// Weights are reflectances, 0..1. All of it belongs to the side wo is on.
typedef struct Bsdf {
  Frame frame; // z: shading normal on wo's side
  Vec3 ng;     // geometric normal on wo's side

  Vec3 diffuse;                      // albedo over the mean share that specular reflection leaves
  float diffuse_mean, multiple_mean; // those mean shares, of diffuse and multiple
  float cover0, cover90;             // f0 and f90 of the specular layer over diffuse; 0: nothing covers it
  // What a metal's single reflections miss, with all interreflections (Kulla and Conty 2017); and 1 / ln(1 + 1/alpha^2)
  // for its density.
  Vec3 multiple;
  float multiple_norm;

  float roughness, alpha; // of specular; alpha 0: delta
  Vec3 f0, f90;           // Schlick's term, weights included
  Vec3 glass0,
      glass90;      // reflectance of the transmitting part at normal and grazing incidence, before its weight
  Vec3 tint;        // what passes the surface, weights included
  float glass;      // weight of the transmitting part
  float eta;        // index behind over index on wo's side
  bool is_thin;     // the transmitting part is a sheet: light leaves it as it came
  float thin_alpha; // width of what passes a sheet; 0: delta

  float coat, coat_roughness, coat_alpha; // weight, 0..1; alpha 0: delta
  bool is_coat_behind;                    // the coat is on the other side, and filters transmitted light only
} Bsdf;

typedef struct BsdfSample {
  Vec3 wl;
  Vec3 weight; // f |cos| / pdf
  float pdf;   // per solid angle; of a delta lobe: the chance of taking it
  bool is_delta, is_transmission;
} BsdfSample;

#define COAT_F0 0.04f // ior 1.5

// --- the transmitting part ----------------------------------------------------------------------
// What a boundary of the transmitting part reflects and lets pass at a (half-vector) cosine on wo's side: exact
// Fresnel, stretched from (F0, 1) to (glass0, glass90) as KHR_materials_specular asks. A sheet has two boundaries and
// the light between them adds up to 2 F / (1 + F) (Stokes 1862).
typedef struct GlassSplit {
  Vec3 reflect, pass;
  float cos_t;
} GlassSplit;

static inline GlassSplit glass_split_at(const Bsdf *b, float fresnel, float cos_t)
{
  const float first = fresnel_f0(b->eta), x = clamp_f((fresnel - first) / (1 - first), 0, 1);
  Vec3 r = b->glass0 + (b->glass90 - b->glass0) * x;
  if (b->is_thin) r = 2 * r / (1 + r);
  const Vec3 pass = cos_t > 0 ? b->tint * max_f(1 - v3_max_lane(r), 0) : v3_all(0);
  return (GlassSplit){b->glass * r, pass, cos_t};
}

static inline GlassSplit glass_split(const Bsdf *b, float cos_i)
{
  float cos_t;
  const float fresnel = fresnel_dielectric(cos_i, b->eta, &cos_t);
  return glass_split_at(b, fresnel, cos_t);
}

// --- what is known once wo is ---------------------------------------------------------------------
// Chances of the lobes, and the layers' albedos towards wo. Local directions from here on.
typedef struct BsdfView {
  Vec3 wo;
  float coat_albedo;                   // of the coat, its weight included; 0 where it does not reflect
  float diffuse_share, multiple_share; // what is left for them on wo's side
  float p_coat, p_specular, p_thin, p_multiple, p_diffuse; // sum to 1 or are all 0
} BsdfView;

static inline float coat_albedo(const Bsdf *b, float cos)
{
  return b->coat * ggx_albedo(ggx_albedo_at(b->coat_roughness, cos), COAT_F0, 1);
}

static inline bool bsdf_has_specular(const Bsdf *b)
{
  return !v3_is_zero(b->f90) || !v3_is_zero(b->f0) || b->glass > 0;
}

// The cosine-weighted part of light that the specular layer leaves for diffuse, and the part that its single
// reflections lose (both 1 - E of Kulla and Conty, "Revisiting physically based shading at Imageworks", 2017).
static inline void shares_at(const Bsdf *b, float cos, float *diffuse, float *multiple)
{
  *diffuse = *multiple = 1;
  if (b->cover90 == 0 && v3_is_zero(b->multiple)) return;
  const GgxAlbedo a = ggx_albedo_at(b->roughness, cos);
  *diffuse = max_f(1 - ggx_albedo(a, b->cover0, b->cover90), 0);
  *multiple = max_f(1 - a.full, 0);
}

static inline BsdfView bsdf_view(const Bsdf *b, Vec3 wo)
{
  BsdfView v = {.wo = wo};
  const float cos = wo[2];
  if (!(cos > 0)) return v;
  if (b->coat > 0) v.coat_albedo = b->is_coat_behind ? 0 : coat_albedo(b, cos);
  shares_at(b, cos, &v.diffuse_share, &v.multiple_share);
  v.p_coat = v.coat_albedo;
  const float under = 1 - v.coat_albedo;
  v.p_diffuse = under * v.diffuse_share * luminance(b->diffuse) * b->diffuse_mean;
  v.p_multiple = under * v.multiple_share * luminance(b->multiple) * b->multiple_mean;
  if (bsdf_has_specular(b)) {
    const float x = fresnel_schlick(cos);
    v.p_specular = luminance(b->f0 * (1 - x) + b->f90 * x);
    if (b->glass > 0) {
      const GlassSplit g = glass_split(b, cos);
      v.p_specular += luminance(g.reflect) + (b->is_thin ? 0 : luminance(g.pass));
      v.p_thin = under * (b->is_thin ? luminance(g.pass) : 0);
    }
    v.p_specular *= under;
  }
  const float sum = v.p_coat + v.p_specular + v.p_thin + v.p_multiple + v.p_diffuse;
  const float scale = sum > 0 ? 1 / sum : 0;
  v.p_coat *= scale;
  v.p_specular *= scale;
  v.p_thin *= scale;
  v.p_multiple *= scale;
  v.p_diffuse *= scale;
  return v;
}

// --- one microfacet -------------------------------------------------------------------------------
// What a microfacet reflects, and the chance that sampling follows it there rather than through.
typedef struct Facet {
  Vec3 reflect, pass;
  float cos_t, p_reflect;
} Facet;

static inline Facet facet_of(const Bsdf *b, float cos, const GlassSplit *g)
{
  const float x = fresnel_schlick(cos);
  Facet f = {.reflect = b->f0 * (1 - x) + b->f90 * x + g->reflect, .p_reflect = 1};
  if (b->is_thin) return f;
  f.cos_t = g->cos_t;
  f.pass = g->pass;
  const float r = v3_max_lane(f.reflect), t = v3_max_lane(f.pass);
  if (t > 0) f.p_reflect = r / (r + t);
  return f;
}

static inline Facet facet_at(const Bsdf *b, float cos)
{
  const GlassSplit g = b->glass > 0 ? glass_split(b, cos) : (GlassSplit){0};
  return facet_of(b, cos, &g);
}

// --- eval ------------------------------------------------------------------------------------------
// Density of sampling by what single reflections miss, which is about alpha^2 / (cos^2 + alpha^2): nearly all of it
// near the horizon for a narrow lobe, where sampling by the cosine would hardly ever look.
static inline float multiple_pdf(const Bsdf *b, float cos)
{
  return cos * b->multiple_norm / ((cos * cos + b->alpha * b->alpha) * PI);
}

// What the coat lets through on the way in and out. The smaller of the two directions' shares, not their product:
// reciprocal, and never more than one of them, so energy holds over any base (glTF's KHR_materials_clearcoat takes
// the share of wo alone, which is not reciprocal).
static inline float under_coat(const Bsdf *b, const BsdfView *v, Vec3 wl)
{
  if (b->coat == 0) return 1;
  const bool is_through = wl[2] < 0;
  if (b->is_coat_behind) return is_through ? 1 - coat_albedo(b, -wl[2]) : 1;
  if (is_through && !b->is_thin) return 1 - v->coat_albedo;
  return 1 - max_f(v->coat_albedo, coat_albedo(b, fabsf(wl[2])));
}

// Cosine of the half-vector to either direction, from both alike so that the result is symmetric to the last bit.
static inline float half_cos(Vec3 wo, Vec3 wl)
{
  return safe_sqrt((1 + v3_dot(wo, wl)) / 2);
}

// f |cos| of one GGX reflection of unit reflectance; *density: of sampling wl by it.
static inline float ggx_reflection(Vec3 wo, Vec3 wl, float alpha, float *density)
{
  const float d = ggx_d(v3_normalize(wo + wl), alpha);
  *density = d * ggx_g1_over_cos(wo[2], alpha) / 4;
  return d * ggx_visibility(wo[2], wl[2], alpha) * wl[2];
}

static inline Vec3 eval_reflection(const Bsdf *b, const BsdfView *v, Vec3 wl, float *pdf)
{
  float diffuse, multiple, density;
  shares_at(b, wl[2], &diffuse, &multiple);
  Vec3 f = (b->diffuse * (v->diffuse_share * diffuse) + b->multiple * (v->multiple_share * multiple)) *
           (wl[2] / PI);
  *pdf = v->p_diffuse * wl[2] / PI + v->p_multiple * multiple_pdf(b, wl[2]);
  const float cos = half_cos(v->wo, wl);
  if (b->alpha > 0 && bsdf_has_specular(b)) {
    const Facet facet = facet_at(b, cos);
    f += facet.reflect * ggx_reflection(v->wo, wl, b->alpha, &density);
    *pdf += v->p_specular * facet.p_reflect * density;
  }
  f *= under_coat(b, v, wl);
  if (b->coat_alpha > 0 && v->coat_albedo > 0) {
    const float fresnel = COAT_F0 + (1 - COAT_F0) * fresnel_schlick(cos);
    f += b->coat * fresnel * ggx_reflection(v->wo, wl, b->coat_alpha, &density);
    *pdf += v->p_coat * density;
  }
  return f;
}

// Rough refraction (Walter et al. 2007, equations 16, 17 and 21, light coming from wl). The masking term is the
// reflection's height-correlated one, as in pbrt-v4.
static inline Vec3 eval_refraction(const Bsdf *b, const BsdfView *v, Vec3 wl, float *pdf)
{
  // The sum of wo and wl times their indices, up to a factor that makes it the same seen from either side: a microfacet
  // met at a grazing angle has a cosine of few digits, and they must be the same ones for reciprocity.
  const Vec3 sum = b->eta < 1 ? (1 / b->eta) * v->wo + wl : v->wo + b->eta * wl;
  const Vec3 h = v3_normalize(sum[2] > 0 ? sum : -sum);
  const float cos_o = v3_dot(v->wo, h), cos_l = v3_dot(wl, h);
  if (cos_o <= 0 || cos_l >= 0) return v3_all(0);
  // Both cosines are at hand, so near total reflection neither has to be the root of a difference.
  const GlassSplit g =
      glass_split_at(b, fresnel_by_cosines((double)cos_o, (double)-cos_l, (double)b->eta), -cos_l);
  const Facet facet = facet_of(b, cos_o, &g);
  const float d = ggx_d(h, b->alpha), jacobian = -cos_l / sqr_f(cos_o + b->eta * cos_l);
  *pdf = v->p_specular * (1 - facet.p_reflect) * d * ggx_g1_over_cos(v->wo[2], b->alpha) * cos_o * jacobian *
         sqr_f(b->eta);
  return facet.pass * (4 * d * ggx_visibility(v->wo[2], -wl[2], b->alpha) * -wl[2] * cos_o * jacobian);
}

// Through a sheet: the reflection's mirror image, with its own width.
static inline Vec3 eval_thin(const Bsdf *b, const BsdfView *v, Vec3 wl, float *pdf)
{
  const Vec3 mirrored = v3(wl[0], wl[1], -wl[2]);
  float density;
  const float f = ggx_reflection(v->wo, mirrored, b->thin_alpha, &density);
  *pdf = v->p_thin * density;
  return glass_split(b, half_cos(v->wo, mirrored)).pass * f;
}

static inline Vec3 eval_transmission(const Bsdf *b, const BsdfView *v, Vec3 wl, float *pdf)
{
  *pdf = 0;
  if (b->glass == 0) return v3_all(0);
  const bool is_rough = b->is_thin ? b->thin_alpha > 0 : b->alpha > 0;
  if (!is_rough) return v3_all(0);
  const Vec3 f = b->is_thin ? eval_thin(b, v, wl, pdf) : eval_refraction(b, v, wl, pdf);
  return f * under_coat(b, v, wl);
}

// f |cos| and the pdf for a view; wl in world space. A direction whose sides of shading and geometric normal differ
// gives nothing: light would leak through the surface or be cast by its inside.
static inline Vec3 bsdf_eval_view(const Bsdf *b, const BsdfView *v, Vec3 wl, float *pdf)
{
  *pdf = 0;
  const Vec3 local = frame_local(&b->frame, wl);
  const float outer = v3_dot(wl, b->ng);
  if (!(v->wo[2] > 0) || !(local[2] * outer > 0)) return v3_all(0);
  return local[2] > 0 ? eval_reflection(b, v, local, pdf) : eval_transmission(b, v, local, pdf);
}

// f(wo, wl) |cos(n, wl)|, and the density with which bsdf_sample() would give wl (0 for its delta lobes, which add
// nothing here). wo must be on the side the Bsdf was made for.
static inline Vec3 bsdf_eval(const Bsdf *b, Vec3 wo, Vec3 wl, float *pdf)
{
  const BsdfView v = bsdf_view(b, frame_local(&b->frame, wo));
  return bsdf_eval_view(b, &v, wl, pdf);
}

// --- sample -----------------------------------------------------------------------------------------
// By cosine (Malley's method: a point in the unit disk, lifted).
static inline Vec3 sample_cosine(Vec2 u)
{
  float sine, cosine;
  f_sincos(2 * PI * u.x, &sine, &cosine);
  const float r = sqrtf(u.y);
  return v3(r * cosine, r * sine, safe_sqrt(1 - u.y));
}

// The inverse of multiple_pdf's integral: cos^2 = alpha^2 ((1 + 1 / alpha^2)^u - 1).
static inline Vec3 sample_multiple(const Bsdf *b, Vec2 u)
{
  float sine, cosine;
  f_sincos(2 * PI * u.x, &sine, &cosine);
  const float alpha2 = b->alpha * b->alpha, z2 = clamp_f(alpha2 * (f_exp(u.y / b->multiple_norm) - 1), 0, 1);
  const float r = sqrtf(1 - z2);
  return v3(r * cosine, r * sine, sqrtf(z2));
}

// A direction from a lobe, local. The weight is set for delta lobes only.
static inline bool sample_specular(const Bsdf *b, const BsdfView *v, float u_lobe, Vec2 u, BsdfSample *out)
{
  const Vec3 h = b->alpha > 0 ? ggx_sample(v->wo, b->alpha, u) : v3(0, 0, 1);
  const float cos = v3_dot(v->wo, h);
  const Facet facet = facet_at(b, cos);
  out->is_delta = b->alpha == 0;
  out->is_transmission = u_lobe >= facet.p_reflect;
  if (!out->is_transmission) {
    out->wl = v3_reflect(v->wo, h);
    out->weight = facet.reflect;
    out->pdf = v->p_specular * facet.p_reflect;
    return true;
  }
  out->wl = refract(v->wo, h, b->eta, cos, facet.cos_t);
  out->weight = facet.pass / sqr_f(b->eta);
  out->pdf = v->p_specular * (1 - facet.p_reflect);
  return cos > 0 && facet.cos_t > 0;
}

static inline void sample_thin(const Bsdf *b, const BsdfView *v, Vec2 u, BsdfSample *out)
{
  const Vec3 h = b->thin_alpha > 0 ? ggx_sample(v->wo, b->thin_alpha, u) : v3(0, 0, 1);
  const Vec3 mirrored = v3_reflect(v->wo, h);
  out->is_delta = b->thin_alpha == 0;
  out->is_transmission = true;
  out->wl = v3(mirrored[0], mirrored[1], -mirrored[2]);
  out->weight = glass_split(b, v->wo[2]).pass;
  out->pdf = v->p_thin;
}

static inline void sample_coat(const Bsdf *b, const BsdfView *v, Vec2 u, BsdfSample *out)
{
  const Vec3 h = b->coat_alpha > 0 ? ggx_sample(v->wo, b->coat_alpha, u) : v3(0, 0, 1);
  out->is_delta = b->coat_alpha == 0;
  out->wl = v3_reflect(v->wo, h);
  out->weight = v3_all(b->coat * (COAT_F0 + (1 - COAT_F0) * fresnel_schlick(v->wo[2])));
  out->pdf = v->p_coat;
}

// Picks a lobe with u_lobe and puts the rest of that number back into 0..1.
static inline bool sample_lobe(const Bsdf *b, const BsdfView *v, float u_lobe, Vec2 u, BsdfSample *out)
{
  float at = u_lobe;
  if (at < v->p_coat) {
    sample_coat(b, v, u, out);
    return true;
  }
  at -= v->p_coat;
  if (at < v->p_specular) return sample_specular(b, v, at / v->p_specular, u, out);
  at -= v->p_specular;
  if (at < v->p_thin) {
    sample_thin(b, v, u, out);
    return true;
  }
  at -= v->p_thin;
  out->wl = at < v->p_multiple ? sample_multiple(b, u) : sample_cosine(u);
  return at < v->p_multiple || v->p_diffuse > 0;
}

// Chooses wl for scattering towards wo; u_lobe and u in [0, 1). False: the light is absorbed (also when the direction
// falls on the wrong side of the surface), and *out means nothing.
static inline bool bsdf_sample(const Bsdf *b, Vec3 wo, float u_lobe, Vec2 u, BsdfSample *out)
{
  const BsdfView v = bsdf_view(b, frame_local(&b->frame, wo));
  *out = (BsdfSample){0};
  if (!(v.wo[2] > 0) || !sample_lobe(b, &v, u_lobe, u, out)) return false;
  const Vec3 local = out->wl;
  // A microfacet may send light below the surface it belongs to, where it is lost to the single-bounce model.
  if (out->is_transmission != (local[2] < 0)) return false;
  out->wl = v3_normalize(frame_vector(&b->frame, local));
  if (out->is_delta) {
    if (!(local[2] * v3_dot(out->wl, b->ng) > 0) || !(out->pdf > 0)) return false;
    // The coat's own reflection is not under itself.
    const bool is_coat = u_lobe < v.p_coat;
    out->weight *= (is_coat ? 1 : under_coat(b, &v, local)) / out->pdf;
    return true;
  }
  const Vec3 f = bsdf_eval_view(b, &v, out->wl, &out->pdf);
  out->weight = f / out->pdf;
  return out->pdf > 0 && isfinite(out->pdf);
}

#endif
