// Looking up a texture: uv map, wrapping, filter, gain and bias. Hot: allocates nothing, touches no file, and any
// uv at all (huge, infinite, NaN) gives some texel. No minification filter: the sampler's many rays per pixel do it.

#ifndef RAYFOLD_SHADE_TEXTURE_LOOKUP_H
#define RAYFOLD_SHADE_TEXTURE_LOOKUP_H

#include "shade/material.h"
#include "shade/texel.h"
#include "shade/texture.h"

// Folds a coordinate into 0..1.
static inline float texture_fold(float s, TextureWrap wrap)
{
  if (!isfinite(s)) return 0;
  switch (wrap) {
  case TEXTURE_REPEAT: return s - floorf(s);
  case TEXTURE_CLAMP: return clamp_f(s, 0, 1);
  case TEXTURE_MIRROR: {
    const float t = s - 2 * floorf(s / 2);
    return t > 1 ? 2 - t : t;
  }
  }
  unreachable();
}

// Rows run from the top, v from the bottom.
static inline Texel texture_texel(const TextureMap *t, float u, float v)
{
  const Image *img = &t->image;
  const float x = texture_fold(u, (TextureWrap)t->wrap_u), y = 1 - texture_fold(v, (TextureWrap)t->wrap_v);
  if (t->is_nearest)
    return texel_get(img, texel_nearest(x, img->width), texel_nearest(y, img->height), t->is_srgb);
  return texel_bilinear(img, texel_span(x, img->width, t->wrap_u == TEXTURE_REPEAT),
                        texel_span(y, img->height, t->wrap_v == TEXTURE_REPEAT), t->is_srgb);
}

static inline Vec3 texture_checker(const TextureMap *t, float u, float v)
{
  const bool right = texture_fold(u, TEXTURE_REPEAT) >= 0.5f, upper = texture_fold(v, TEXTURE_REPEAT) >= 0.5f;
  return v3_load(right == upper ? t->color_a : t->color_b);
}

// The texture's linear rgba at a surface's two uv sets. A picture without pixels is white.
static inline void texture_lookup(const TextureMap *t, const Vec2 uv[2], float rgba[4])
{
  const Vec2 at = uv[t->texcoord & 1];
  const float u = t->uv_map[0][0] * at.x + t->uv_map[0][1] * at.y + t->uv_map[0][2];
  const float v = t->uv_map[1][0] * at.x + t->uv_map[1][1] * at.y + t->uv_map[1][2];
  Texel texel = {v3_all(1), 1};
  switch ((TextureMapKind)t->kind) {
  case TEXTURE_MAP_CHECKER: texel.rgb = texture_checker(t, u, v); break;
  case TEXTURE_MAP_IMAGE:
    if (t->image.pixels) texel = texture_texel(t, u, v);
    texel.rgb = texel.rgb * v3_load(t->gain) + v3_load(t->bias);
    break;
  }
  v3_store(rgba, texel.rgb);
  rgba[3] = texel.alpha;
}

// What a reference gives to multiply a factor with: 1 where there is no texture.
static inline Vec3 texture_color(const TextureMap *maps, TextureRef ref, const Vec2 uv[2])
{
  if (ref.map < 0) return v3_all(1);
  float rgba[4];
  texture_lookup(&maps[ref.map], uv, rgba);
  return v3_load(rgba);
}

static inline float texture_channel(const TextureMap *maps, TextureRef ref, const Vec2 uv[2])
{
  if (ref.map < 0) return 1;
  float rgba[4];
  texture_lookup(&maps[ref.map], uv, rgba);
  return rgba[ref.channel & 3];
}

#endif
