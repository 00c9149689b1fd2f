// Rows of the fast denoiser's steps around its passes: light taken out of a picture, the noise and the slopes that the
// passes go by, and light given back. Hot; see denoise_fast.h.
//
// One pixel beyond each side of the picture luminance is that of the last pixel, and depth goes on as it did before it,
// so that no step asks where the picture ends. (The passes look at neither: nothing is like the border's normals.)

#ifndef RAYFOLD_POST_FAST_ROWS_H
#define RAYFOLD_POST_FAST_ROWS_H

#include "base/fmath.h"
#include "base/vec.h"
#include "base/wide.h"
#include "post/kernels.h"

// Added to the albedo that light is divided by: keeps what is black or has none (a mirror, the sky) finite.
#define LEAST_ALBEDO 0.02f
// What depth may be off beside its slope, as a share of itself, and how many slopes.
#define DEPTH_SHARE  0.005f
#define DEPTH_SLOPES 3.0f

static inline float fast_divisor(const float *albedo)
{
  return clamp_f(guided_finite(*albedo), 0, 1) + LEAST_ALBEDO;
}

// Light as luminance, red and blue in a[0..2]; the measured variance in a[3] and the luminance of what it was divided by in
// b[3], for the next step.
static inline void fast_take_pixel(const FastPlanes *f, size_t pixel, size_t i)
{
  const Guided *g = f->guided;
  Vec3 light = v3_all(0), albedo = v3_all(0);
  for (int k = 0; k < 3; k++) {
    const float c = g->color[4 * pixel + (size_t)k];
    albedo[k] = fast_divisor(g->albedo + 3 * pixel + k);
    light[k] = c > 0 ? min_f(c, 1e15f) : 0;
    f->normal[k][i] = clamp_f(guided_finite(g->normal[3 * pixel + (size_t)k]), -1, 1);
  }
  light = light / albedo;
  f->a[0][i] = luminance(light);
  f->a[1][i] = light[0];
  f->a[2][i] = light[2];
  f->a[3][i] = guided_finite(g->variance[pixel]);
  f->b[3][i] = luminance(albedo);
  f->depth[i] = clamp_f(guided_finite(g->depth[pixel]), 0, 1e15f);
}

// The border's pixel one step beyond `end`, which has `inner` beside it on the other side.
static inline void fast_extend(const FastPlanes *f, size_t border, size_t end, size_t inner)
{
  f->a[0][border] = f->a[0][end];
  f->depth[border] = 2 * f->depth[end] - f->depth[inner];
}

static void fast_take_rows(const FastPlanes *f, uint32_t first, uint32_t end)
{
  const uint32_t width = f->guided->width;
  for (uint32_t y = first; y < end; y++) {
    const size_t row = f->origin + y * f->stride, last = row + width - 1;
    for (uint32_t x = 0; x < width; x++) fast_take_pixel(f, (size_t)y * width + x, row + x);
    fast_extend(f, row - 1, row, row + (width > 1));
    fast_extend(f, last + 1, last, last - (width > 1));
  }
}

// The rows above and below the picture, once all others are taken.
static void fast_extend_rows(const FastPlanes *f)
{
  const size_t height = f->guided->height, inner = height > 1 ? f->stride : 0, last = f->origin + (height - 1) * f->stride;
  for (size_t x = 0; x < (size_t)f->guided->width + 2; x++) {
    const size_t top = f->origin - 1 + x, bottom = last - 1 + x;
    fast_extend(f, top - f->stride, top, top + inner);
    fast_extend(f, bottom + f->stride, bottom, bottom - inner);
  }
}

// Of luminance among a pixel and its neighbours.
static inline wx fast_variance(const FastPlanes *f, size_t i)
{
  wx sum = wx_set(0), squares = wx_set(0);
  for (int dy = -1; dy <= 1; dy++)
    for (int dx = -1; dx <= 1; dx++) {
      const wx l = wx_load(f->a[0] + i + (ptrdiff_t)f->stride * dy + dx);
      sum = sum + l;
      squares = squares + l * l;
    }
  const wx mean = sum * wx_set(1 / 9.0f);
  return wx_max(squares * wx_set(1 / 9.0f) - mean * mean, wx_set(0));
}

// How far depth may be off a pixel on. Of the two sides the flatter one counts, so that an edge is no slope.
static inline wx fast_depth_step(const FastPlanes *f, size_t i)
{
  const float *d = f->depth + i;
  const wx middle = wx_load(d);
  const wx across = wx_min(wx_abs(wx_load(d - 1) - middle), wx_abs(wx_load(d + 1) - middle));
  const wx along = wx_min(wx_abs(wx_load(d - f->stride) - middle), wx_abs(wx_load(d + f->stride) - middle));
  return wx_set(DEPTH_SLOPES) * wx_max(across, along) + wx_set(DEPTH_SHARE) * middle + wx_set(1e-12f);
}

// The variance of the light: as the film measured it, or among the neighbours where it did not (with one sample) or
// could not (all samples were black).
static void fast_prepare_rows(const FastPlanes *f, uint32_t first, uint32_t end)
{
  const uint32_t width = f->guided->width;
  for (uint32_t y = first; y < end; y++) {
    const size_t row = f->origin + y * f->stride;
    for (uint32_t x = 0; x < width; x += WIDEST) {
      const size_t i = row + x;
      const wx measured = wx_load(f->a[3] + i), albedo = wx_load(f->b[3] + i);
      const wx variance = wx_choose(wx_lt(wx_set(0), measured), measured / (albedo * albedo), fast_variance(f, i));
      wx_store(f->a[3] + i, wx_min(variance, wx_set(1e30f)));
      wx_store(f->depth_scale + i, wx_set(1) / fast_depth_step(f, i));
    }
    for (uint32_t x = width; x % WIDEST; x++) f->a[3][row + x] = 0; // beyond the picture nothing is known
  }
}

static void fast_give_rows(const FastPlanes *f, float *const light[3], float *out, uint32_t first, uint32_t end)
{
  const Guided *g = f->guided;
  for (uint32_t y = first; y < end; y++)
    for (uint32_t x = 0; x < g->width; x++) {
      const size_t pixel = (size_t)y * g->width + x, i = f->origin + y * f->stride + x;
      const float l = light[0][i], red = light[1][i], blue = light[2][i];
      const float green = max_f((l - 0.2126f * red - 0.0722f * blue) * (1 / 0.7152f), 0); // rounding may go below
      const float rgb[3] = {red, green, blue};
      for (int k = 0; k < 3; k++) out[4 * pixel + (size_t)k] = rgb[k] * fast_divisor(g->albedo + 3 * pixel + k);
      out[4 * pixel + 3] = clamp_f(guided_finite(g->color[4 * pixel + 3]), 0, 1);
    }
}

#endif
