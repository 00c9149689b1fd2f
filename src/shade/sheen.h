// Sheen: the soft light that fibres standing up from cloth throw back along the surface. Hot; the numbers of the
// albedo are in sheen_table.c, written by tools/sheen_table.c. Directions are local, z the shading normal.
//
// Distribution and masking are Charlie's (Estevez and Kulla, "Production friendly microfacet sheen BRDF", 2017), which
// KHR_materials_sheen names. Its narrowest lobes reflect more than they get near the horizon; there the lobe is divided
// by the larger albedo of its two directions, so that it stays reciprocal and reflects 1 at most.

#ifndef RAYFOLD_SHADE_SHEEN_H
#define RAYFOLD_SHADE_SHEEN_H

#include "base/fmath.h"
#include "base/vec.h"

enum { SHEEN_ROWS = 24, SHEEN_COLUMNS = 32 };
extern const uint16_t sheen_table[SHEEN_ROWS][SHEEN_COLUMNS]; // rows: roughness from SHEEN_LEAST; columns: root of cos
#define SHEEN_LEAST 0.15f // narrower sheen is taken as this: the lobe would be a line at the horizon
#define SHEEN_MOST  4.0f  // what 65535 in the table stands for

// The part of light towards a direction that sheen of reflectance one sends there, before it is held to 1.
static inline float sheen_raw_albedo(float roughness, float cos)
{
  const float row = (clamp_f(roughness, SHEEN_LEAST, 1) - SHEEN_LEAST) * ((SHEEN_ROWS - 1) / (1 - SHEEN_LEAST));
  const float column = clamp_f(safe_sqrt(cos), 0, 1) * (SHEEN_COLUMNS - 1);
  const float r = min_f(floorf(row), SHEEN_ROWS - 2), c = min_f(floorf(column), SHEEN_COLUMNS - 2);
  const uint16_t *a = &sheen_table[(int)r][(int)c], *b = &sheen_table[(int)r + 1][(int)c];
  return mix_f(mix_f(a[0], a[1], column - c), mix_f(b[0], b[1], column - c), row - r) * (SHEEN_MOST / 65535);
}

// Estevez and Kulla 2017, equation 3.
static inline float sheen_fit(float x, float t)
{
  const float a = mix_f(21.5473f, 25.3245f, t), b = mix_f(3.82987f, 3.32435f, t);
  const float c = mix_f(0.19823f, 0.16801f, t), d = mix_f(-1.97760f, -1.27393f, t);
  return a / (1 + b * f_pow(x, c)) + d * x + mix_f(-4.32054f, -4.85967f, t);
}

// Smith's Lambda of the fibres (ibid.).
static inline float sheen_lambda(float cos, float alpha)
{
  const float t = sqr_f(1 - alpha);
  return cos < 0.5f ? f_exp(sheen_fit(cos, t)) : f_exp(2 * sheen_fit(0.5f, t) - sheen_fit(1 - cos, t));
}

// f |cos| of sheen of reflectance one: distribution (ibid., equation 2), masking, and the limit of albedo.
static inline float sheen_reflection(Vec3 wo, Vec3 wl, float roughness)
{
  const float r = clamp_f(roughness, SHEEN_LEAST, 1), alpha = r * r;
  const Vec3 h = v3_normalize(wo + wl);
  const float sine2 = h[0] * h[0] + h[1] * h[1];
  const float d = (2 + 1 / alpha) * f_pow(sine2, 0.5f / alpha) / (2 * PI);
  const float visible = 1 / (1 + (sheen_lambda(wo[2], alpha) + sheen_lambda(wl[2], alpha)));
  const float most = max_f(1, max_f(sheen_raw_albedo(r, wo[2]), sheen_raw_albedo(r, wl[2])));
  return d * visible / (4 * wo[2] * wl[2] * most) * wl[2];
}

#endif
