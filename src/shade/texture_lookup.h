// Looking up a texture: uv map, wrapping, filters, gain and bias. Hot: allocates nothing, touches no file, and any
// uv at all (huge, infinite, NaN) gives some texel.
//
// A lookup gives the mean over what the ray's cone covers. That is an ellipse in the texture; a few probes along its
// longer axis, each as wide as the shorter, are averaged (McCormack et al., "Feline", SIGGRAPH 1999), each between two
// mips of a picture or in closed form from a pattern (pattern.h). Where a texel is larger than the ellipse the picture
// is looked up as it is, with one bilinear fetch.

#ifndef RAYFOLD_SHADE_TEXTURE_LOOKUP_H
#define RAYFOLD_SHADE_TEXTURE_LOOKUP_H

#include "base/ray.h"
#include "shade/material.h"
#include "shade/pattern.h"
#include "shade/texel.h"
#include "shade/texture.h"

// Longer ellipses are blurred across. As many as 8-fold anisotropic filters of graphics cards take; not measured.
enum { TEXTURE_MOST_PROBES = 8 };

// --- what the cone covers -------------------------------------------------------------------------
// A place in a texture (uv) and the ellipse around it, from end to end, in units of 1/scale of uv: `along` and
// `across` are unit vectors.
typedef struct TextureSpot {
  Vec2 at, along, across;
  float length, width; // 0: a point
} TextureSpot;

// What an axis on the surface is in the texture, in units of 1/scale.
static inline Vec2 texture_axis(const TextureMap *t, const SurfacePoint *s, Vec3 axis, Vec2 scale)
{
  const float du = v3_dot(s->grad_u[t->texcoord & 1], axis), dv = v3_dot(s->grad_v[t->texcoord & 1], axis);
  return (Vec2){scale.x * (t->uv_map[0][0] * du + t->uv_map[0][1] * dv),
                scale.y * (t->uv_map[1][0] * du + t->uv_map[1][1] * dv)};
}

// Two conjugate axes a and b make the ellipse of the matrix a a' + b b': its own axes are the eigenvectors.
static inline void spot_ellipse(TextureSpot *spot, Vec2 a, Vec2 b)
{
  const float p = a.x * a.x + b.x * b.x, q = a.x * a.y + b.x * b.y, r = a.y * a.y + b.y * b.y;
  const float mean = 0.5f * (p + r), half = 0.5f * (p - r), root = sqrtf(half * half + q * q), large = mean + root;
  if (!(large > 0 && large < 1e30f)) return;
  const Vec2 v = p > r ? (Vec2){half + root, q} : (Vec2){q, root - half};
  const float norm = sqrtf(v.x * v.x + v.y * v.y);
  spot->along = norm > 0 ? (Vec2){v.x / norm, v.y / norm} : (Vec2){1, 0};
  spot->across = (Vec2){-spot->along.y, spot->along.x};
  spot->length = sqrtf(large);
  spot->width = fabsf(a.x * b.y - a.y * b.x) / spot->length; // the axes' product is the determinant
}

static inline Vec2 texture_at(const TextureMap *t, const SurfacePoint *s)
{
  const Vec2 uv = s->uv[t->texcoord & 1];
  return (Vec2){t->uv_map[0][0] * uv.x + t->uv_map[0][1] * uv.y + t->uv_map[0][2],
                t->uv_map[1][0] * uv.x + t->uv_map[1][1] * uv.y + t->uv_map[1][2]};
}

static inline TextureSpot texture_spot(const TextureMap *t, const SurfacePoint *s, Vec2 scale)
{
  TextureSpot spot = {.at = texture_at(t, s)};
  if (t->minify != TEXTURE_UNFILTERED && !v3_is_zero(s->minor))
    spot_ellipse(&spot, texture_axis(t, s, s->major, scale), texture_axis(t, s, s->minor, scale));
  return spot;
}

// How many probes for an ellipse, and how wide they are; `least` is the width below which detail does not matter.
static inline int spot_probes(TextureMinify minify, float length, float width, float least, float *probe_width)
{
  const float narrow = max_f(width, least), ratio = length / narrow;
  const int count = minify == TEXTURE_TRILINEAR || !(ratio > 1) ? 1
                    : ratio < TEXTURE_MOST_PROBES              ? (int)ceilf(ratio)
                                                               : TEXTURE_MOST_PROBES;
  *probe_width = max_f(narrow, length / (float)count);
  return count;
}

// Where probe i of count lies along the ellipse, -1/2..1/2.
static inline float probe_place(int i, int count) { return ((float)i + 0.5f) / (float)count - 0.5f; }

// --- pictures -------------------------------------------------------------------------------------
// Rows run from the top, v from the bottom.
static inline Texel texture_texel(const TextureMap *t, const Image *img, float u, float v, bool is_nearest)
{
  const float x = texture_fold(u, (TextureWrap)t->wrap_u), y = 1 - texture_fold(v, (TextureWrap)t->wrap_v);
  if (is_nearest) return texel_get(img, texel_nearest(x, img->width), texel_nearest(y, img->height), t->is_srgb);
  return texel_bilinear(img, texel_span(x, img->width, t->wrap_u == TEXTURE_REPEAT),
                        texel_span(y, img->height, t->wrap_v == TEXTURE_REPEAT), t->is_srgb);
}

static inline const Image *texture_level(const TextureMap *t, uint32_t level)
{
  return level == 0 ? &t->image : &t->levels[(level <= t->level_count ? level : t->level_count) - 1];
}

// Between the two mips whose texels are just narrower and just wider than `width` texels (at least 1). The weight runs
// evenly from one to the next, where a logarithm's would bend a little: it costs nothing and is the same everywhere.
static inline Texel texture_between_mips(const TextureMap *t, float u, float v, float width)
{
  uint32_t bits;
  memcpy(&bits, &width, 4);
  const uint32_t level = (bits >> 23) - 127, rest = bits & 0x7fffff;
  const Texel fine = texture_texel(t, texture_level(t, level), u, v, false);
  if (rest == 0 || level >= t->level_count) return fine;
  return texel_mix(fine, texture_texel(t, texture_level(t, level + 1), u, v, false), (float)rest * 0x1p-23f);
}

static inline Texel texture_picture(const TextureMap *t, const SurfacePoint *s)
{
  const Vec2 size = {(float)t->image.width, (float)t->image.height};
  const TextureSpot spot = texture_spot(t, s, size);
  if (!(spot.length > 1) || t->level_count == 0)
    return texture_texel(t, &t->image, spot.at.x, spot.at.y, t->is_nearest);
  float width;
  const int count = spot_probes((TextureMinify)t->minify, spot.length, spot.width, 1, &width);
  const Vec2 step = {spot.length * spot.along.x / size.x, spot.length * spot.along.y / size.y};
  Texel sum = {v3_all(0), 0};
  for (int i = 0; i < count; i++) {
    const float k = probe_place(i, count);
    const Texel texel = texture_between_mips(t, spot.at.x + k * step.x, spot.at.y + k * step.y, width);
    sum.rgb += texel.rgb;
    sum.alpha += texel.alpha;
  }
  return (Texel){sum.rgb / (float)count, sum.alpha / (float)count};
}

// --- patterns ---------------------------------------------------------------------------------------
static inline float texture_flat_pattern(const TextureMap *t, Vec2 at, Vec2 width)
{
  switch ((TextureMapKind)t->kind) {
  case TEXTURE_MAP_CHECKER: return pattern_checker(at, width);
  case TEXTURE_MAP_GRADIENT: return pattern_gradient(t, at, width);
  case TEXTURE_MAP_BRICK: return pattern_brick(t, at, width);
  case TEXTURE_MAP_WAVE: return pattern_wave(at.x, width.x);
  case TEXTURE_MAP_NOISE: return pattern_noise(t, v3(at.x, at.y, 0), max_f(width.x, width.y));
  case TEXTURE_MAP_IMAGE: break;
  }
  return 0;
}

// A probe's width along u and v is that of the box with the same variance as its own two sides have there.
static inline float texture_pattern(const TextureMap *t, const SurfacePoint *s)
{
  const TextureSpot spot = texture_spot(t, s, (Vec2){1, 1});
  if (spot.length == 0) return texture_flat_pattern(t, spot.at, (Vec2){0, 0});
  float width, sum = 0;
  const int count = spot_probes((TextureMinify)t->minify, spot.length, spot.width, 0.05f, &width);
  const float along = spot.length / (float)count, across = count == 1 ? spot.length : spot.width;
  const Vec2 box = {sqrtf(sqr_f(along * spot.along.x) + sqr_f(across * spot.across.x)),
                    sqrtf(sqr_f(along * spot.along.y) + sqr_f(across * spot.across.y))};
  for (int i = 0; i < count; i++) {
    const float k = spot.length * probe_place(i, count);
    sum += texture_flat_pattern(t, (Vec2){spot.at.x + k * spot.along.x, spot.at.y + k * spot.along.y}, box);
  }
  return sum / (float)count;
}

// Noise in space: in the object's, so that it goes with the object, or in the world's.
static inline float texture_solid(const TextureMap *t, const SurfacePoint *s)
{
  const bool is_object = t->space == TEXTURE_OBJECT;
  const Vec3 p = is_object ? s->object_p : s->p;
  if (t->minify == TEXTURE_UNFILTERED || v3_is_zero(s->minor)) return pattern_noise(t, p, 0);
  const float scale = is_object ? s->object_scale : 1;
  const float length = scale * v3_length(s->major), across = scale * v3_length(s->minor);
  float least, sum = 0;
  const int count = spot_probes((TextureMinify)t->minify, length, across, 0.05f / t->frequency, &least);
  const float width = max_f(across, length / (float)count);
  const Vec3 step = is_object ? frame_vector(&s->object_frame, s->major) : s->major;
  for (int i = 0; i < count; i++) sum += pattern_noise(t, p + probe_place(i, count) * step, width);
  return sum / (float)count;
}

// --- whole lookups ------------------------------------------------------------------------------------
// The texture's linear rgba at a place. A picture without pixels is white.
static inline void texture_lookup(const TextureMap *t, const SurfacePoint *s, float rgba[4])
{
  Texel texel = {v3_all(1), 1};
  if (t->kind != TEXTURE_MAP_IMAGE) {
    const float part = t->kind == TEXTURE_MAP_NOISE && t->space != TEXTURE_UV ? texture_solid(t, s)
                                                                              : texture_pattern(t, s);
    texel.rgb = v3_mix(v3_load(t->color_a), v3_load(t->color_b), part);
  } else {
    if (t->image.pixels) texel = texture_picture(t, s);
    texel.rgb = texel.rgb * v3_load(t->gain) + v3_load(t->bias);
    texel.alpha *= t->alpha_gain;
  }
  v3_store(rgba, texel.rgb);
  rgba[3] = texel.alpha;
}

// --- places beside one another ------------------------------------------------------------------------
// The place `step` (world space, along the surface) from s, as textures see it.
static inline SurfacePoint texture_moved(const SurfacePoint *s, Vec3 step)
{
  SurfacePoint moved = *s;
  moved.p += step;
  moved.object_p += frame_vector(&s->object_frame, step);
  for (int i = 0; i < 2; i++) {
    moved.uv[i].x += v3_dot(s->grad_u[i], step);
    moved.uv[i].y += v3_dot(s->grad_v[i], step);
  }
  return moved;
}

// The step in metres over which a texture's slope is taken: about what a ray covers, but a texel at least, and of
// patterns a hundredth of a unit, of noise a quarter of its finest feature. 0: unknown.
static inline float texture_step(const TextureMap *t, const SurfacePoint *s)
{
  const float covered = sqrtf(v3_length(s->major) * v3_length(s->minor));
  if (t->kind == TEXTURE_MAP_NOISE && t->space != TEXTURE_UV) {
    float finest = 1 / t->frequency;
    for (int32_t i = 1; i < t->octaves; i++) finest /= t->lacunarity;
    return max_f(covered, 0.25f * finest / (t->space == TEXTURE_OBJECT ? s->object_scale : 1));
  }
  const bool is_picture = t->kind == TEXTURE_MAP_IMAGE;
  const Vec2 scale = is_picture ? (Vec2){(float)t->image.width, (float)t->image.height} : (Vec2){100, 100};
  const Frame f = frame_around(s->ng);
  const Vec2 a = texture_axis(t, s, f.x, scale), b = texture_axis(t, s, f.y, scale); // texels a metre
  const float most = sqrtf(max_f(a.x * a.x + a.y * a.y, b.x * b.x + b.y * b.y));
  return most > 0 ? max_f(covered, 1 / most) : 0;
}

// What a reference gives to multiply a factor with: 1 where there is no texture.
static inline Vec3 texture_color(const TextureMap *maps, TextureRef ref, const SurfacePoint *s)
{
  if (ref.map < 0) return v3_all(1);
  float rgba[4];
  texture_lookup(&maps[ref.map], s, rgba);
  return v3_load(rgba);
}

static inline float texture_channel(const TextureMap *maps, TextureRef ref, const SurfacePoint *s)
{
  if (ref.map < 0) return 1;
  float rgba[4];
  texture_lookup(&maps[ref.map], s, rgba);
  return rgba[ref.channel & 3];
}

#endif
