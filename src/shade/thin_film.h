// Iridescence: a film some hundred nanometres thick, whose two borders' reflections interfere, in the colours of
// Rec.709 (Belcour and Barla, "A practical extension to microfacet theory for the modeling of varying iridescence",
// 2017; KHR_materials_iridescence). Hot.
//
// As in the extension, borders reflect by Schlick's term and orders above the second are left out. Departing from it,
// the colour of a film that does nothing is white: each channel's sensitivity is divided by its value at zero, and the
// result is held to 0..1, so that no film gains energy.

#ifndef RAYFOLD_SHADE_THIN_FILM_H
#define RAYFOLD_SHADE_THIN_FILM_H

#include "base/fmath.h"
#include "shade/fresnel.h"

typedef struct ThinFilm {
  float weight;       // 0: there is none
  float ior, thickness; // in nanometres
  Vec3 base, shift;   // of the border below: reflectance at normal incidence, phase shift (0 or pi)
} ThinFilm;

// Of what lies below, by its reflectance in air.
static inline ThinFilm thin_film(float weight, float ior, float nanometres, Vec3 f0)
{
  // Below 30 nm the film fades away, as the extension asks.
  const float x = clamp_f(nanometres / 30, 0, 1);
  ThinFilm f = {.weight = weight, .ior = mix_f(1, ior, x * x * (3 - 2 * x)), .thickness = nanometres};
  for (int k = 0; k < 3; k++) {
    const float root = sqrtf(clamp_f(f0[k], 0, 0.9999f)), index = (1 + root) / (1 - root);
    f.base[k] = fresnel_f0(index / f.ior);
    f.shift[k] = index < f.ior ? PI : 0;
  }
  return f;
}

// How a cosine over the spectrum, of a path difference in nanometres and a phase, looks to the eye: Gaussians in
// frequency fitted to the CIE 1931 curves (Belcour and Barla 2017, section 4 and their code's constants).
static inline Vec3 film_sensitivity(float difference, Vec3 phase)
{
  static const float rgb_of_xyz[3][3] = {{3.2404542f, -1.5371385f, -0.4985314f},
                                         {-0.9692660f, 1.8760108f, 0.0415560f},
                                         {0.0556434f, -0.2040259f, 1.0572252f}};
  // Height, position and variance; x has two.
  static const float gaussians[4][3] = {{5.4856e-13f, 1.6810e+06f, 4.3278e+09f},
                                        {4.4201e-13f, 1.7953e+06f, 9.3046e+09f},
                                        {5.2481e-13f, 2.2084e+06f, 6.6121e+09f},
                                        {9.7470e-14f, 2.2399e+06f, 4.5282e+09f}};
  const float wave = 2 * PI * difference * 1e-9f;
  float height[4], angle[4];
  for (int g = 0; g < 4; g++) {
    height[g] = gaussians[g][0] * sqrtf(2 * PI * gaussians[g][2]) * f_exp(-gaussians[g][2] * wave * wave) / 1.0685e-7f;
    angle[g] = gaussians[g][1] * wave;
  }
  Vec3 out = v3_all(0);
  for (int k = 0; k < 3; k++) {
    const float x = height[0] * f_cos(angle[0] + phase[k]) + height[3] * f_cos(angle[3] + phase[k]);
    const float y = height[1] * f_cos(angle[1] + phase[k]), z = height[2] * f_cos(angle[2] + phase[k]);
    const float *m = rgb_of_xyz[k];
    out[k] = (m[0] * x + m[1] * y + m[2] * z) / (m[0] + m[1] + m[2]);
  }
  return out;
}

// The film's reflectance at a cosine in the air above it (Belcour and Barla 2017, equation 10, with the unpolarised
// terms of the extension).
static inline Vec3 film_reflectance(const ThinFilm *f, float cos)
{
  const float cos2_in = 1 - (1 - cos) * (1 + cos) / sqr_f(f->ior);
  if (!(cos2_in > 0)) return v3_all(1);
  const float cos_in = sqrtf(cos2_in), first0 = fresnel_f0(f->ior);
  const float first = first0 + (1 - first0) * fresnel_schlick(cos), through = 1 - first;
  const Vec3 second = f->base + (v3_all(1) - f->base) * fresnel_schlick(cos_in);
  const float difference = 2 * f->ior * f->thickness * cos_in;
  Vec3 both = first * second, root = v3_all(0);
  for (int k = 0; k < 3; k++) {
    both[k] = clamp_f(both[k], 1e-5f, 0.9999f);
    root[k] = sqrtf(both[k]);
  }
  const Vec3 inner = through * through * second / (v3_all(1) - both), phase = v3_all(PI) + f->shift;
  const Vec3 swing = (inner - v3_all(through)) * root;
  const Vec3 sum = v3_all(first) + inner + 2 * swing * film_sensitivity(difference, phase) +
                   2 * swing * root * film_sensitivity(2 * difference, 2 * phase);
  return v3_min(v3_max(sum, v3_all(0)), v3_all(1));
}

#endif
