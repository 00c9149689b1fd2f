// Bsdf: how a surface scatters light at one point, as numbers, and the two questions asked of it: how much (eval) and
// where to (sample). Hot. Every material is the same stack of lobes, most of them of zero weight:
//
//      wo   wl
//        \ /        coat      a clear film of ior 1.5 over everything (GGX or mirror), seen from the front only
//         v         sheen     fibres (sheen.h)
//     ---------     specular  GGX, round or stretched, or mirror; per microfacet, light reflects or (glass) refracts
//                   gloss     instead of it: the highlights of older tracers (gloss.h)
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
#include "shade/gloss.h"
#include "shade/microfacet.h"
#include "shade/sheen.h"
#include "shade/thin_film.h"

// Below this roughness a lobe is a perfect mirror (delta): alpha would be under 0.001, narrower than float
// directions can resolve to the accuracy promised, and than an eye can tell.
#define BSDF_SMOOTH_ROUGHNESS 0.03f

// What few materials have is kept out of the way of the others' code.
#define RARE __attribute__((noinline, cold))

// Weights are reflectances, 0..1. All of it belongs to the side wo is on.
typedef struct Bsdf {
  Frame frame; // z: shading normal on wo's side
  Vec3 ng;     // geometric normal on wo's side
  bool is_matt; // diffuse is all there is, over nothing and under nothing: the short way through all below

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
  bool is_coat_behind;                    // coat and sheen are on the other side, and filter transmitted light only

  // What few materials have. While has_extras is false nothing below counts, and one test is all it costs.
  bool has_extras, is_stretched, is_dispersed;
  uint8_t band;                // of dispersed: the channel of colour that is refracted; eta is its index
  Vec3 etas;                   // likewise: the indices of all three, which reflect each by its own
  float stretch;               // strength of anisotropy
  Vec2 width;                  // of stretched bumps, along the frame's x and y; alpha is their geometric mean
  Vec3 sheen;                  // reflectance
  float sheen_most, sheen_roughness; // its largest channel
  ThinFilm film;               // over specular and glass
  Gloss gloss;
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

static inline float glass_edge(float fresnel, float eta)
{
  const float first = fresnel_f0(eta);
  return clamp_f((fresnel - first) / (1 - first), 0, 1);
}

// Under a thin film what the film's two borders and the body's reflect together, by the cosine outside, whichever side
// the light comes from. A sheet of index 1 is the film alone, as a soap bubble.
static RARE Vec3 film_over_glass(const Bsdf *b, Vec3 r, float cos_i, float cos_t)
{
  if (!(cos_t > 0)) return v3_all(1);
  return v3_mix(r, b->glass90 * film_reflectance(&b->film, b->eta < 1 ? cos_t : cos_i), b->film.weight);
}

// Light of three colours that are about to part: each is reflected by its own index, and only the one of `band` passes,
// for all three (a mean of three such choices is right; bsdf_disperse() in bsdf.h).
static RARE GlassSplit glass_split_dispersed(const Bsdf *b, float fresnel, float cos_i, float cos_t)
{
  Vec3 r = v3_all(0);
  for (int k = 0; k < 3; k++) {
    float cos_k = cos_t;
    const float here = k == b->band ? fresnel : fresnel_dielectric(cos_i, b->etas[k], &cos_k);
    const Vec3 all = b->glass0 + (b->glass90 - b->glass0) * glass_edge(here, b->etas[k]);
    r[k] = b->film.weight > 0 ? film_over_glass(b, all, cos_i, cos_k)[k] : all[k];
  }
  Vec3 pass = v3_all(0);
  if (cos_t > 0) pass[b->band] = 3 * b->tint[b->band] * max_f(1 - r[b->band], 0);
  return (GlassSplit){b->glass * r, pass, cos_t};
}

static inline GlassSplit glass_split_at(const Bsdf *b, float fresnel, float cos_i, float cos_t)
{
  if (b->is_dispersed) return glass_split_dispersed(b, fresnel, cos_i, cos_t);
  Vec3 r = b->glass0 + (b->glass90 - b->glass0) * glass_edge(fresnel, b->eta);
  if (b->film.weight > 0) r = film_over_glass(b, r, cos_i, cos_t);
  if (b->is_thin && b->eta != 1) r = 2 * r / (1 + r);
  const Vec3 pass = cos_t > 0 ? b->tint * max_f(1 - v3_max_lane(r), 0) : v3_all(0);
  return (GlassSplit){b->glass * r, pass, cos_t};
}

static inline GlassSplit glass_split(const Bsdf *b, float cos_i)
{
  float cos_t;
  const float fresnel = fresnel_dielectric(cos_i, b->eta, &cos_t);
  return glass_split_at(b, fresnel, cos_i, cos_t);
}

// --- what is known once wo is ---------------------------------------------------------------------
// Chances of the lobes, and the layers' albedos towards wo. Local directions from here on.
typedef struct BsdfView {
  Vec3 wo;
  float coat_albedo, sheen_albedo;     // weight included; 0 where they do not reflect
  float diffuse_share, multiple_share; // what is left for them on wo's side
  float p_coat, p_specular, p_thin, p_multiple, p_diffuse, p_sheen, p_gloss; // sum to 1 or are all 0
} BsdfView;

static inline float coat_albedo(const Bsdf *b, float cos)
{
  return b->coat * ggx_albedo(ggx_albedo_at(b->coat_roughness, cos), COAT_F0, 1);
}

static inline bool bsdf_has_specular(const Bsdf *b)
{
  return !v3_is_zero(b->f90) || !v3_is_zero(b->f0) || b->glass > 0;
}

// The largest channel of what the sheen reflects; held to 1 as the lobe is.
static inline float sheen_albedo(const Bsdf *b, float cos)
{
  if (!(b->sheen_most > 0)) return 0;
  return b->sheen_most * min_f(sheen_raw_albedo(b->sheen_roughness, cos), 1);
}

// The albedo of stretched bumps has no table: this is what round ones of the mean width have, or of the width across w
// where that is more, and a little. Over widths 0.001..1, strengths 0.1..1 and all directions it is never below the truth
// by more than 1e-3, and above it by up to 0.1 at strength 0.3 and 0.5 at 1: so much of metals' multiple reflections is
// missing, and near the horizon as much of the light for diffuse.
static RARE GgxAlbedo ellipse_albedo(const Bsdf *b, Vec3 w)
{
  const float x2 = w[0] * w[0], y2 = w[1] * w[1], across2 = x2 + y2;
  const float width = across2 > 0 ? sqrtf((sqr_f(b->width.x) * x2 + sqr_f(b->width.y) * y2) / across2) : b->alpha;
  const GgxAlbedo mean = ggx_albedo_at(b->roughness, w[2]), here = ggx_albedo_at(sqrtf(width), w[2]);
  const float low = 1 - min_f(w[2], 1), low2 = low * low;
  return (GgxAlbedo){min_f(max_f(mean.full, here.full) + b->stretch * (0.06f * low2 + 0.012f), 1),
                     max_f(mean.edge, here.edge) + b->stretch * (0.125f * low2 * low2 * low + 0.004f)};
}

// The cosine-weighted part of light that the specular layer leaves for diffuse, and the part that its single
// reflections lose (both 1 - E of Kulla and Conty, "Revisiting physically based shading at Imageworks", 2017).
static inline void shares_at(const Bsdf *b, Vec3 w, float *diffuse, float *multiple)
{
  *diffuse = *multiple = 1;
  if (b->cover90 == 0 && v3_is_zero(b->multiple)) return;
  const GgxAlbedo a = b->is_stretched ? ellipse_albedo(b, w) : ggx_albedo_at(b->roughness, w[2]);
  *diffuse = max_f(1 - ggx_albedo(a, b->cover0, b->cover90), 0);
  *multiple = max_f(1 - a.full, 0);
}

static RARE Vec3 specular_under_film(const Bsdf *b, Vec3 f, float cos)
{
  return v3_mix(f, b->f90 * film_reflectance(&b->film, cos), b->film.weight);
}

// What specular reflects at a (half-vector) cosine, without glass.
static inline Vec3 specular_fresnel(const Bsdf *b, float cos)
{
  const float x = fresnel_schlick(cos);
  const Vec3 f = b->f0 * (1 - x) + b->f90 * x;
  return b->film.weight > 0 ? specular_under_film(b, f, cos) : f;
}

// Part of bsdf_view(): chances of the lobes that few materials have.
static RARE void view_extras(const Bsdf *b, BsdfView *v, float cos)
{
  const float under = 1 - v->coat_albedo;
  if (!b->is_coat_behind) v->sheen_albedo = sheen_albedo(b, cos);
  v->p_sheen = under * v->sheen_albedo;
  if (b->gloss.kind == GLOSS_NONE) return;
  const float x = fresnel_schlick(cos);
  v->p_gloss = under * (1 - v->sheen_albedo) * luminance(b->gloss.f0 * (1 - x) + b->gloss.f90 * x);
}

static inline BsdfView bsdf_view(const Bsdf *b, Vec3 wo)
{
  BsdfView v = {.wo = wo};
  const float cos = wo[2];
  if (!(cos > 0)) return v;
  if (b->is_matt) {
    v.diffuse_share = 1;
    v.p_diffuse = v3_is_zero(b->diffuse) ? 0 : 1;
    return v;
  }
  if (b->coat > 0) v.coat_albedo = b->is_coat_behind ? 0 : coat_albedo(b, cos);
  shares_at(b, wo, &v.diffuse_share, &v.multiple_share);
  v.p_coat = v.coat_albedo;
  if (b->has_extras) view_extras(b, &v, cos);
  const float under = (1 - v.coat_albedo) * (1 - v.sheen_albedo);
  v.p_diffuse = under * v.diffuse_share * luminance(b->diffuse) * b->diffuse_mean;
  v.p_multiple = under * v.multiple_share * luminance(b->multiple) * b->multiple_mean;
  if (bsdf_has_specular(b)) {
    v.p_specular = luminance(specular_fresnel(b, cos));
    if (b->glass > 0) {
      const GlassSplit g = glass_split(b, cos);
      v.p_specular += luminance(g.reflect) + (b->is_thin ? 0 : luminance(g.pass));
      v.p_thin = under * (b->is_thin ? luminance(g.pass) : 0);
    }
    v.p_specular *= under;
  }
  const float sum = v.p_coat + v.p_specular + v.p_thin + v.p_multiple + v.p_diffuse + (v.p_sheen + v.p_gloss);
  const float scale = sum > 0 ? 1 / sum : 0;
  v.p_coat *= scale;
  v.p_specular *= scale;
  v.p_thin *= scale;
  v.p_multiple *= scale;
  v.p_diffuse *= scale;
  v.p_sheen *= scale;
  v.p_gloss *= scale;
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
  Facet f = {.reflect = specular_fresnel(b, cos) + g->reflect, .p_reflect = 1};
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

// The specular lobe's distribution, round or stretched.
static inline Vec3 specular_normal(const Bsdf *b, Vec3 wo, Vec2 u)
{
  if (b->alpha == 0) return v3(0, 0, 1);
  return b->is_stretched ? ellipse_sample(wo, b->width, u) : ggx_sample(wo, b->alpha, u);
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

// The same for sheen.
static RARE float under_sheen(const Bsdf *b, const BsdfView *v, Vec3 wl)
{
  const bool is_through = wl[2] < 0;
  if (b->is_coat_behind) return is_through ? 1 - sheen_albedo(b, -wl[2]) : 1;
  if (is_through && !b->is_thin) return 1 - v->sheen_albedo;
  return 1 - max_f(v->sheen_albedo, sheen_albedo(b, fabsf(wl[2])));
}

static inline float under_layers(const Bsdf *b, const BsdfView *v, Vec3 wl)
{
  const float left = under_coat(b, v, wl);
  return b->has_extras ? left * under_sheen(b, v, wl) : left;
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

static RARE float ellipse_reflection(const Bsdf *b, Vec3 wo, Vec3 wl, float *density)
{
  const float d = ellipse_d(v3_normalize(wo + wl), b->width);
  *density = d * ellipse_g1_over_cos(wo, b->width) / 4;
  return d * ellipse_visibility(wo, wl, b->width) * wl[2];
}

static inline float specular_reflection(const Bsdf *b, Vec3 wo, Vec3 wl, float *density)
{
  return b->is_stretched ? ellipse_reflection(b, wo, wl, density) : ggx_reflection(wo, wl, b->alpha, density);
}

// Adds the lobes that few materials have to f, whatever lies over them but the coat included.
static RARE Vec3 add_extras(const Bsdf *b, const BsdfView *v, Vec3 wl, Vec3 f, float *pdf)
{
  if (b->gloss.kind != GLOSS_NONE) {
    float density;
    f += gloss_eval(&b->gloss, v->wo, wl, &density);
    *pdf += v->p_gloss * density;
  }
  f *= under_sheen(b, v, wl);
  if (v->sheen_albedo > 0) {
    f += b->sheen * sheen_reflection(v->wo, wl, b->sheen_roughness);
    *pdf += v->p_sheen / (2 * PI);
  }
  return f;
}

static inline Vec3 eval_matt(const Bsdf *b, const BsdfView *v, Vec3 wl)
{
  float diffuse, multiple;
  shares_at(b, wl, &diffuse, &multiple);
  return (b->diffuse * (v->diffuse_share * diffuse) + b->multiple * (v->multiple_share * multiple)) * (wl[2] / PI);
}

static inline Vec3 eval_reflection(const Bsdf *b, const BsdfView *v, Vec3 wl, float *pdf)
{
  float density;
  Vec3 f = eval_matt(b, v, wl);
  *pdf = v->p_diffuse * wl[2] / PI + v->p_multiple * multiple_pdf(b, wl[2]);
  const float cos = half_cos(v->wo, wl);
  if (b->alpha > 0 && bsdf_has_specular(b)) {
    const Facet facet = facet_at(b, cos);
    f += facet.reflect * specular_reflection(b, v->wo, wl, &density);
    *pdf += v->p_specular * facet.p_reflect * density;
  }
  if (b->has_extras) f = add_extras(b, v, wl, f, pdf);
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
      glass_split_at(b, fresnel_by_cosines((double)cos_o, (double)-cos_l, (double)b->eta), cos_o, -cos_l);
  const Facet facet = facet_of(b, cos_o, &g);
  const float d = b->is_stretched ? ellipse_d(h, b->width) : ggx_d(h, b->alpha);
  const float g1 = b->is_stretched ? ellipse_g1_over_cos(v->wo, b->width) : ggx_g1_over_cos(v->wo[2], b->alpha);
  const float visible = b->is_stretched ? ellipse_visibility(v->wo, wl, b->width)
                                        : ggx_visibility(v->wo[2], -wl[2], b->alpha);
  const float jacobian = -cos_l / sqr_f(cos_o + b->eta * cos_l);
  *pdf = v->p_specular * (1 - facet.p_reflect) * d * g1 * cos_o * jacobian * sqr_f(b->eta);
  return facet.pass * (4 * d * visible * -wl[2] * cos_o * jacobian);
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
  return f * under_layers(b, v, wl);
}

// f |cos| and the pdf for a view; wl in world space. A direction whose sides of shading and geometric normal differ
// gives nothing: light would leak through the surface or be cast by its inside.
static inline Vec3 bsdf_eval_view(const Bsdf *b, const BsdfView *v, Vec3 wl, float *pdf)
{
  *pdf = 0;
  const Vec3 local = frame_local(&b->frame, wl);
  const float outer = v3_dot(wl, b->ng);
  if (!(v->wo[2] > 0) || !(local[2] * outer > 0)) return v3_all(0);
  if (b->is_matt) {
    *pdf = v->p_diffuse * max_f(local[2], 0) / PI;
    return b->diffuse * (max_f(local[2], 0) / PI);
  }
  return local[2] > 0 ? eval_reflection(b, v, local, pdf) : eval_transmission(b, v, local, pdf);
}

// What of that diffuse and multiple give.
static inline Vec3 bsdf_eval_matt(const Bsdf *b, const BsdfView *v, Vec3 wl)
{
  const Vec3 local = frame_local(&b->frame, wl);
  if (!(v->wo[2] > 0) || !(local[2] > 0) || !(v3_dot(wl, b->ng) > 0)) return v3_all(0);
  return eval_matt(b, v, local) * under_layers(b, v, local);
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
  const Vec3 h = specular_normal(b, v->wo, u);
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

// Sheen, evenly over the hemisphere (as Estevez and Kulla 2017 do), or gloss.
static RARE bool sample_extras(const Bsdf *b, const BsdfView *v, bool is_sheen, Vec2 u, BsdfSample *out)
{
  out->wl = is_sheen ? direction_about(u.y, safe_sqrt(1 - u.y * u.y), u.x) : gloss_sample(&b->gloss, v->wo, u);
  return true;
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
  if (b->has_extras) {
    if (at < v->p_sheen + v->p_gloss) return sample_extras(b, v, at < v->p_sheen, u, out);
    at -= v->p_sheen + v->p_gloss;
  }
  out->wl = at < v->p_multiple ? sample_multiple(b, u) : sample_cosine(u);
  return at < v->p_multiple || v->p_diffuse > 0;
}

// By cosine, so the albedo is the weight.
static inline bool sample_matt(const Bsdf *b, const BsdfView *v, Vec2 u, BsdfSample *out)
{
  const Vec3 local = sample_cosine(u);
  *out = (BsdfSample){.wl = v3_normalize(frame_vector(&b->frame, local)), .weight = b->diffuse, .pdf = local[2] / PI};
  return v->wo[2] > 0 && v->p_diffuse > 0 && out->pdf > 0 && v3_dot(out->wl, b->ng) > 0;
}

// Chooses wl for scattering towards wo; u_lobe and u in [0, 1). False: the light is absorbed (also when the direction
// falls on the wrong side of the surface), and *out means nothing.
static inline bool bsdf_sample_view(const Bsdf *b, const BsdfView *v, float u_lobe, Vec2 u, BsdfSample *out)
{
  if (b->is_matt) return sample_matt(b, v, u, out);
  *out = (BsdfSample){0};
  if (!(v->wo[2] > 0) || !sample_lobe(b, v, u_lobe, u, out)) return false;
  const Vec3 local = out->wl;
  // A microfacet may send light below the surface it belongs to, where it is lost to the single-bounce model.
  if (out->is_transmission != (local[2] < 0)) return false;
  out->wl = v3_normalize(frame_vector(&b->frame, local));
  if (out->is_delta) {
    if (!(local[2] * v3_dot(out->wl, b->ng) > 0) || !(out->pdf > 0)) return false;
    // The coat's own reflection is not under itself.
    const bool is_coat = u_lobe < v->p_coat;
    out->weight *= (is_coat ? 1 : under_layers(b, v, local)) / out->pdf;
    return true;
  }
  const Vec3 f = bsdf_eval_view(b, v, out->wl, &out->pdf);
  out->weight = f / out->pdf;
  return out->pdf > 0 && isfinite(out->pdf);
}

static inline bool bsdf_sample(const Bsdf *b, Vec3 wo, float u_lobe, Vec2 u, BsdfSample *out)
{
  const BsdfView v = bsdf_view(b, frame_local(&b->frame, wo));
  return bsdf_sample_view(b, &v, u_lobe, u, out);
}

#endif
