// One texel of a picture as linear rgba, whatever its stored type and channel count. Hot. Coordinates must lie
// inside the picture; wrapping is the caller's.

#ifndef RAYFOLD_SHADE_TEXEL_H
#define RAYFOLD_SHADE_TEXEL_H

#include "base/vec.h"
#include "image/image.h"

// A half as a float: the exponent is rebased by a multiplication, which takes care of subnormals too; infinities and
// NaN give 0, because one broken texel must not spoil a picture. (image/half_to_float keeps them, and is a call.)
static inline float texel_half(uint16_t h)
{
  if ((h & 0x7c00) == 0x7c00) return 0;
  const uint32_t bits = (uint32_t)(h & 0x7fff) << 13;
  float f;
  memcpy(&f, &bits, 4);
  f *= 0x1p112f;
  return h & 0x8000 ? -f : f;
}

static inline float texel_channel(const Image *img, size_t index, bool is_srgb)
{
  switch (img->type) {
  case PIXEL_U8: {
    const uint8_t v = ((const uint8_t *)img->pixels)[index];
    return is_srgb ? srgb_from_u8[v] : (float)v / 255;
  }
  case PIXEL_U16: {
    const float v = (float)((const uint16_t *)img->pixels)[index] / 65535;
    return is_srgb ? srgb_decode(v) : v;
  }
  case PIXEL_F16: return texel_half(((const uint16_t *)img->pixels)[index]);
  case PIXEL_F32: {
    const float v = ((const float *)img->pixels)[index];
    return isfinite(v) ? v : 0;
  }
  }
  unreachable();
}

// Grey is spread to rgb and missing alpha is 1; alpha is never decoded.
typedef struct Texel {
  Vec3 rgb;
  float alpha;
} Texel;

// The usual picture, without asking for its type at every channel.
static inline Texel texel_of_bytes(const uint8_t *p, bool has_alpha, bool is_srgb)
{
  const Vec3 rgb = is_srgb ? v3(srgb_from_u8[p[0]], srgb_from_u8[p[1]], srgb_from_u8[p[2]])
                           : v3((float)p[0], (float)p[1], (float)p[2]) / 255;
  return (Texel){rgb, has_alpha ? (float)p[3] / 255 : 1};
}

static inline Texel texel_get(const Image *img, uint32_t x, uint32_t y, bool is_srgb)
{
  const size_t at = ((size_t)y * img->width + x) * img->channels;
  if (img->type == PIXEL_U8 && img->channels >= 3)
    return texel_of_bytes((const uint8_t *)img->pixels + at, img->channels == 4, is_srgb);
  const float r = texel_channel(img, at, is_srgb);
  const bool has_alpha = img->channels == 2 || img->channels == 4;
  const float alpha = has_alpha ? texel_channel(img, at + img->channels - 1, false) : 1;
  if (img->channels < 3) return (Texel){v3_all(r), alpha};
  return (Texel){v3(r, texel_channel(img, at + 1, is_srgb), texel_channel(img, at + 2, is_srgb)), alpha};
}

// Where a sample falls between texel centres (at half integers): the two neighbours and the second one's weight.
typedef struct TexelSpan {
  uint32_t first, second;
  float weight;
} TexelSpan;

// s in 0..1 over `count` texels. Beyond the border lies the other end (is_cyclic) or the border texel again.
static inline TexelSpan texel_span(float s, uint32_t count, bool is_cyclic)
{
  const float at = clamp_f(s, 0, 1) * (float)count - 0.5f, low = floorf(at);
  const int32_t last = (int32_t)count - 1, i = (int32_t)low;
  const int32_t before = is_cyclic ? last : 0, after = is_cyclic ? 0 : last;
  return (TexelSpan){(uint32_t)(i < 0      ? before
                                : i > last ? after
                                           : i),
                     (uint32_t)(i >= last ? after : i + 1), at - low};
}

static inline uint32_t texel_nearest(float s, uint32_t count)
{
  const uint32_t i = (uint32_t)(clamp_f(s, 0, 1) * (float)count);
  return i < count ? i : count - 1;
}

static inline Texel texel_mix(Texel a, Texel b, float t)
{
  return (Texel){v3_mix(a.rgb, b.rgb, t), mix_f(a.alpha, b.alpha, t)};
}

// Bilinear between the four texels of two spans.
static inline Texel texel_bilinear(const Image *img, TexelSpan x, TexelSpan y, bool is_srgb)
{
  const Texel top = texel_mix(texel_get(img, x.first, y.first, is_srgb),
                              texel_get(img, x.second, y.first, is_srgb), x.weight);
  const Texel bottom = texel_mix(texel_get(img, x.first, y.second, is_srgb),
                                 texel_get(img, x.second, y.second, is_srgb), x.weight);
  return texel_mix(top, bottom, y.weight);
}

#endif
