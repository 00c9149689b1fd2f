// Pattern: textures that are computed. Each gives the part of color_b (0..1) at a place, as the mean over what a pixel
// covers: in closed form (the integral of the pattern over a box: Heckbert 1989, "Fundamentals of Texture Mapping and
// Image Warping", section 3.5), and noise by leaving out the octaves that are finer than that (Norton et al. 1982,
// "Clamping"). Hot: allocates nothing; any number at all gives some value.

#ifndef RAYFOLD_SHADE_PATTERN_H
#define RAYFOLD_SHADE_PATTERN_H

#include "base/fmath.h"
#include "base/hash.h"
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

// Boxes narrower than this are points: the difference of two integrals would be rounding.
#define PATTERN_SHARP 1e-4f

// --- fields, bands ----------------------------------------------------------------------------------
// -1 in the first half of each unit, 1 in the second; its mean over `width` around x.
static inline float pattern_square(float x, float width)
{
  const float f = texture_fold(x, TEXTURE_REPEAT);
  if (!(width > PATTERN_SHARP)) return f >= 0.5f ? 1 : -1;
  const float low = texture_fold(x - width / 2, TEXTURE_REPEAT), high = texture_fold(x + width / 2, TEXTURE_REPEAT);
  return (min_f(low, 1 - low) - min_f(high, 1 - high)) / width;
}

static inline float pattern_checker(Vec2 at, Vec2 width)
{
  return 0.5f - 0.5f * pattern_square(at.x, width.x) * pattern_square(at.y, width.y);
}

// 1 in the first `part` of each unit, 0 in the rest.
static inline float pattern_pulse_integral(float x, float part)
{
  const float whole = floorf(x);
  return whole * part + min_f(x - whole, part);
}

static inline float pattern_pulse(float x, float width, float part)
{
  if (!isfinite(x)) return 0;
  if (!(width > PATTERN_SHARP)) return x - floorf(x) < part ? 1 : 0;
  if (!(width < 1e6f)) return part;
  const float start = x - floorf(x) - width / 2; // near 0, where floats are fine
  return clamp_f((pattern_pulse_integral(start + width, part) - pattern_pulse_integral(start, part)) / width, 0, 1);
}

// Courses one unit of v high, bricks `length` long; 1 is mortar. A pixel over several courses takes the upright joints
// of the one it is centred on for those of all, which keeps the mean.
static inline float pattern_brick(const TextureMap *t, Vec2 at, Vec2 width)
{
  const float course = floorf(at.y), shift = texture_fold(course / 2, TEXTURE_REPEAT) > 0.25f ? t->stagger : 0;
  const float joint = pattern_pulse((at.x - shift * t->length) / t->length, width.x / t->length, t->mortar / t->length);
  const float bed = pattern_pulse(at.y, width.y, t->mortar);
  return 1 - (1 - joint) * (1 - bed);
}

// A cosine along u with a period of one; a box takes sinc(width) off its height.
static inline float pattern_wave(float x, float width)
{
  const float f = texture_fold(x, TEXTURE_REPEAT), w = PI * min_f(width, 1e4f);
  return 0.5f - 0.5f * f_cos(2 * PI * f) * (w > 1e-3f ? f_sin(w) / w : 1);
}

// --- gradients --------------------------------------------------------------------------------------
// The integral from 0 of what texture_fold() gives.
static inline float pattern_ramp_integral(float x, TextureWrap wrap)
{
  switch (wrap) {
  case TEXTURE_REPEAT: return 0.5f * (floorf(x) + sqr_f(x - floorf(x)));
  case TEXTURE_CLAMP: return x < 0 ? 0 : x < 1 ? 0.5f * x * x : x - 0.5f;
  case TEXTURE_MIRROR: {
    const float period = floorf(x / 2), r = x - 2 * period;
    return period + (r < 1 ? 0.5f * r * r : 1 - 0.5f * sqr_f(2 - r));
  }
  }
  unreachable();
}

static inline float pattern_ramp(float x, float width, TextureWrap wrap)
{
  if (!(width > 1e-3f) || !(fabsf(x) + width < 1e6f)) return texture_fold(x, wrap);
  const float sum = pattern_ramp_integral(x + width / 2, wrap) - pattern_ramp_integral(x - width / 2, wrap);
  return clamp_f(sum / width, 0, 1);
}

// Linear: along u from 0 to 1. Radial: from the middle of uv's unit square to its sides.
static inline float pattern_gradient(const TextureMap *t, Vec2 at, Vec2 width)
{
  const TextureWrap wrap = (TextureWrap)t->wrap_u;
  if (!t->is_radial) return pattern_ramp(at.x, width.x, wrap);
  const float x = at.x - 0.5f, y = at.y - 0.5f;
  return pattern_ramp(2 * sqrtf(x * x + y * y), 2 * max_f(width.x, width.y), wrap);
}

// --- noise --------------------------------------------------------------------------------------------
// One of twelve directions to the middles of a cube's edges (Perlin 2002, "Improving Noise"), times an offset.
static inline float noise_corner(uint32_t h, float x, float y, float z)
{
  const uint32_t k = (uint32_t)((uint64_t)h * 12 >> 32), axis = k >> 2;
  const float a = axis == 0 ? y : x, b = axis == 2 ? y : z;
  return (k & 1 ? -a : a) + (k & 2 ? -b : b);
}

static inline float noise_fade(float t) { return t * t * t * (t * (t * 6 - 15) + 10); }

// Gradient noise, about -1..1, zero at whole coordinates, mean 0.
static inline float noise_at(Vec3 p, uint32_t seed)
{
  float f[3];
  uint32_t cell[3];
  for (int k = 0; k < 3; k++) {
    const float low = floorf(p[k]);
    if (!(fabsf(low) < 2e9f)) return 0;
    f[k] = p[k] - low;
    cell[k] = (uint32_t)(int32_t)low;
  }
  const float u = noise_fade(f[0]), v = noise_fade(f[1]), w = noise_fade(f[2]);
  float n[2][2];
  for (uint32_t z = 0; z < 2; z++) {
    const uint32_t hz = hash_combine(seed, cell[2] + z);
    for (uint32_t y = 0; y < 2; y++) {
      const uint32_t hy = hash_combine(hz, cell[1] + y);
      n[z][y] = mix_f(noise_corner(hash_combine(hy, cell[0]), f[0], f[1] - (float)y, f[2] - (float)z),
                      noise_corner(hash_combine(hy, cell[0] + 1), f[0] - 1, f[1] - (float)y, f[2] - (float)z), u);
    }
  }
  return mix_f(mix_f(n[0][0], n[0][1], v), mix_f(n[1][0], n[1][1], v), w);
}

// Sum of octaves (Perlin 1985), each held back as a pixel grows from a quarter to three quarters of its features.
static inline float pattern_noise(const TextureMap *t, Vec3 p, float width)
{
  float sum = 0, all = 0, amplitude = 1, frequency = t->frequency;
  for (int32_t i = 0; i < t->octaves; i++) {
    const float seen = clamp_f(1.5f - 2 * width * frequency, 0, 1);
    if (seen > 0) sum += seen * amplitude * noise_at(p * frequency, t->seed + (uint32_t)i);
    all += amplitude;
    amplitude *= t->persistence;
    frequency *= t->lacunarity;
  }
  return clamp_f(0.5f + 0.5f * t->contrast * sum / all, 0, 1);
}

#endif
