// One pass of the edge-avoiding wavelet filter, "a-trous": a 3x3 kernel whose taps lie `step` pixels apart, each
// weighted by how much the two places look like one surface (Dammertz et al. 2010, "Edge-Avoiding A-Trous Wavelet
// Transform for fast Global Illumination Filtering", section 3) and, of light, by how far it is off in units of its
// own noise (Schied et al. 2017, "Spatiotemporal Variance-Guided Filtering", section 4.4). In place of exponentials
// stand powers of what is left of 1 after a line or a parabola, which have their shape and reach zero.
//
// No sum is fused: all levels give the same bits.

#ifndef RAYFOLD_POST_ATROUS_H
#define RAYFOLD_POST_ATROUS_H

#include "base/wide.h"
#include "post/kernels.h"

// How many standard deviations of light bring its weight down to 1/e: 4 as in Schied et al. (1 and 2 leave 4 and 1 dB
// more noise in pictures of four samples).
#define ATROUS_SIGMAS 4.0f

typedef struct AtrousHere { // of the pixels in the middle
  wx normal[3], depth, depth_scale, luminance, light_scale;
} AtrousHere;

// Variance through a 3x3 Gauss, as single pixels' own is noisy (Schied et al., section 4.4).
static inline wx atrous_variance(const Atrous *a, size_t i)
{
  const float *v = a->in[3] + i;
  const size_t row = a->stride;
  const wx corners =
      wx_load(v - row - 1) + wx_load(v - row + 1) + wx_load(v + row - 1) + wx_load(v + row + 1);
  const wx sides = wx_load(v - row) + wx_load(v + row) + wx_load(v - 1) + wx_load(v + 1);
  return corners * wx_set(0.0625f) + sides * wx_set(0.125f) + wx_load(v) * wx_set(0.25f);
}

static inline AtrousHere atrous_here(const Atrous *a, size_t i)
{
  AtrousHere h;
  for (int k = 0; k < 3; k++) h.normal[k] = wx_load(a->normal[k] + i);
  h.depth = wx_load(a->depth + i);
  h.depth_scale = wx_load(a->depth_scale + i) * wx_set(1.0f / (float)a->step);
  h.luminance = wx_load(a->in[0] + i);
  const wx noise = wx_set(ATROUS_SIGMAS) * wx_sqrt(atrous_variance(a, i));
  h.light_scale = wx_set(0.25f) / (noise + h.luminance * wx_set(1e-3f) + wx_set(1e-6f));
  return h;
}

static inline wx atrous_abs(wx x)
{
  return wx_max(x, -x);
}
static inline wx atrous_left(wx x)
{
  return wx_max(wx_set(1) - x, wx_set(0));
}

// Normals 29 degrees apart and more share nothing. (Sharper weights of the same slope, up to the 128th power of Schied
// et al., leave 0.3 to 1 dB more noise in pictures of four samples.)
static inline wx atrous_weight(const Atrous *a, const AtrousHere *h, size_t i)
{
  wx turned = wx_set(0);
  for (int k = 0; k < 3; k++) {
    const wx d = wx_load(a->normal[k] + i) - h->normal[k];
    turned = turned + d * d;
  }
  const wx n = atrous_left(turned * wx_set(4));
  const wx z = (wx_load(a->depth + i) - h->depth) * h->depth_scale, flat = atrous_left(z * z);
  const wx l1 = atrous_left(atrous_abs(wx_load(a->in[0] + i) - h->luminance) * h->light_scale), l2 = l1 * l1;
  return n * n * flat * (l2 * l2);
}

static inline void atrous_pixels(const Atrous *a, size_t i)
{
  static const float kernel[3] = {0.25f, 0.5f, 0.25f};
  const AtrousHere here = atrous_here(a, i);
  wx sum[3] = {wx_set(0), wx_set(0), wx_set(0)}, variance = wx_set(0), total = wx_set(0);
  for (int dy = -1; dy <= 1; dy++)
    for (int dx = -1; dx <= 1; dx++) {
      const size_t at = i + (size_t)((ptrdiff_t)a->stride * dy * a->step + dx * a->step);
      wx w = wx_set(kernel[dx + 1] * kernel[dy + 1]);
      if (dx || dy) w = w * atrous_weight(a, &here, at);
      for (int k = 0; k < 3; k++) sum[k] = sum[k] + w * wx_load(a->in[k] + at);
      variance = variance + w * w * wx_load(a->in[3] + at);
      total = total + w;
    }
  const wx scale = wx_set(1) / total; // the middle alone is a quarter
  for (int k = 0; k < 3; k++) wx_store(a->out[k] + i, sum[k] * scale);
  wx_store(a->out[3] + i, variance * (scale * scale));
}

static void atrous_rows(const Atrous *a, uint32_t first, uint32_t end)
{
  for (uint32_t y = first; y < end; y++)
    for (uint32_t x = 0; x < a->width; x += WIDEST) atrous_pixels(a, a->origin + y * a->stride + x);
}

#endif
