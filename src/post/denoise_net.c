// See denoise_net.h. What goes into the network and comes out of it is as the weights were trained for: radiance is
// brought to middle grey, then through a perceptual curve; normals go from -1..1 to 0..1 (Open Image Denoise 2,
// documentation of the "RT" filter, and its training scripts).

#include "post/denoise_net.h"

#include "base/fmath.h"
#include "base/vec.h"

#include <string.h>

// --- the perceptual curve -------------------------------------------------------------------------
// The PU curve of Aydin, Mantiuk and Seidel ("Extending Quality Metrics to Full Luminance Range Images", 2008) in the
// three-piece fit that the weights were trained with: linear, a power, a logarithm; divided by its value at 65504.
#define PU_NORM 0.318967164f
static float pu_encode(float y)
{
  if (y <= 1.57945760e-06f) return PU_NORM * 1.41283765e+03f * y;
  if (y <= 3.22087631e-02f) return PU_NORM * (1.64593172f * f_pow(y, 4.31384981e-01f) - 2.94139609e-03f);
  return PU_NORM * (1.92653254e-01f * f_log(y + 6.26026094e-03f) + 9.98620152e-01f);
}

static float pu_decode(float encoded)
{
  const float x = encoded / PU_NORM;
  if (x <= 2.23151711e-03f) return x / 1.41283765e+03f;
  if (x <= 3.70974749e-01f) return f_pow((x + 2.94139609e-03f) / 1.64593172f, 1 / 4.31384981e-01f);
  return f_exp((x - 9.98620152e-01f) / 1.92653254e-01f) - 6.26026094e-03f;
}

// --- exposure -------------------------------------------------------------------------------------
static float light(float x)
{
  return x > 0 ? min_f(x, 1e30f) : 0;
} // NaN is none, infinity a lot

static Vec3 light_at(const Guided *g, size_t pixel)
{
  const float *p = g->color + 4 * pixel;
  return v3(light(p[0]), light(p[1]), light(p[2]));
}

typedef struct Span {
  uint32_t first, end;
} Span;

static Span span_of(uint32_t size, uint32_t count, uint32_t i)
{
  return (Span){(uint32_t)((uint64_t)size * i / count), (uint32_t)((uint64_t)size * (i + 1) / count)};
}

static double mean_luminance(const Guided *g, Span x, Span y)
{
  double sum = 0;
  for (uint32_t j = y.first; j < y.end; j++)
    for (uint32_t i = x.first; i < x.end; i++) sum += luminance(light_at(g, (size_t)j * g->width + i));
  return sum / ((double)(x.end - x.first) * (y.end - y.first));
}

// What brings the picture's middle to 0.18: the geometric mean of blocks of up to 16x16 pixels (Reinhard et al. 2002,
// "Photographic Tone Reproduction", equation 1, on a small version of the picture). Black blocks do not count.
static float exposure_of(const Guided *g)
{
  const uint32_t columns = (g->width + 15) / 16, rows = (g->height + 15) / 16;
  double sum = 0;
  size_t count = 0;
  for (uint32_t j = 0; j < rows; j++)
    for (uint32_t i = 0; i < columns; i++) {
      const double l = mean_luminance(g, span_of(g->width, columns, i), span_of(g->height, rows, j));
      if (!(l > 1e-8)) continue;
      sum += fmath_log(l);
      count++;
    }
  return count ? (float)(0.18 / fmath_exp(sum / (double)count)) : 1;
}

// --- tiles ----------------------------------------------------------------------------------------
// More than the network sees to one side: its kernels reach 79 pixels, pooled pixels 15 more. Tiles begin at multiples
// of UNET_ALIGN, as pooling must pair the same pixels.
enum { OVERLAP = 96 };

typedef struct Axis {
  uint32_t size, whole; // of the picture; rounded up to UNET_ALIGN
  uint32_t step, tile;  // pixels a tile answers for, pixels it looks at
} Axis;

static uint32_t align(uint32_t x)
{
  return (x + UNET_ALIGN - 1) / UNET_ALIGN * UNET_ALIGN;
}

static Axis axis_of(uint32_t size, uint32_t count)
{
  Axis a = {.size = size, .whole = align(size), .step = align((size + count - 1) / count)};
  a.tile = a.step + 2 * OVERLAP < a.whole ? a.step + 2 * OVERLAP : a.whole;
  return a;
}

// The longer side of a tile is divided until it is small enough, or as small as pays.
static void divide(const Guided *g, size_t most, Axis axis[2])
{
  uint32_t columns = 1, rows = 1;
  for (;;) {
    axis[0] = axis_of(g->width, columns);
    axis[1] = axis_of(g->height, rows);
    if ((size_t)axis[0].tile * axis[1].tile <= most) return;
    const bool is_wide = axis[0].tile >= axis[1].tile;
    if (axis[!is_wide].step <= UNET_ALIGN) return;
    if (is_wide)
      columns++;
    else
      rows++;
  }
}

typedef struct TileAxis {
  uint32_t from;       // first pixel the tile looks at
  uint32_t first, end; // pixels it answers for
} TileAxis;

static TileAxis tile_of(const Axis *a, uint32_t i)
{
  const uint32_t first = i * a->step, end = first + a->step < a->size ? first + a->step : a->size;
  const uint32_t wanted = first > OVERLAP ? first - OVERLAP : 0, last = a->whole - a->tile;
  return (TileAxis){wanted < last ? wanted : last, first, end};
}

typedef struct Work {
  const Guided *guided;
  float exposure;
  UnetPlan *plan;
  TileAxis x, y;
  float *out;
} Work;

static void fill_pixel(const Guided *g, size_t pixel, float exposure, float *to)
{
  const Vec3 c = light_at(g, pixel);
  for (int k = 0; k < 3; k++) {
    to[k] = pu_encode(min_f(c[k] * exposure, 1e30f));
    to[3 + k] = clamp_f(guided_finite(g->albedo[3 * pixel + k]), 0, 1);
    to[6 + k] = clamp_f(guided_finite(g->normal[3 * pixel + k]), -1, 1) * 0.5f + 0.5f;
  }
}

// A row of the input. Past the picture's edge everything is zero, as is the padding of the network's convolutions.
static void fill_row(void *user, size_t item, int worker)
{
  const Work *w = user;
  const Guided *g = w->guided;
  const Map *m = unet_input(w->plan);
  const uint32_t y = w->y.from + (uint32_t)item;
  (void)worker;
  for (uint32_t i = 0; i < m->width; i++) {
    float *to = map_at(m, 0, i, (ptrdiff_t)item);
    const uint32_t x = w->x.from + i;
    memset(to, 0, MAP_BLOCK * sizeof *to);
    if (x < g->width && y < g->height) fill_pixel(g, (size_t)y * g->width + x, w->exposure, to);
  }
}

static void take_row(void *user, size_t item, int worker)
{
  const Work *w = user;
  const uint32_t y = w->y.first + (uint32_t)item;
  (void)worker;
  for (uint32_t x = w->x.first; x < w->x.end; x++) {
    const float *from = map_at(unet_output(w->plan), 0, x - w->x.from, y - w->y.from);
    const size_t pixel = (size_t)y * w->guided->width + x;
    // The curve's end is 1. A little more is an honest answer, much more is none.
    for (int k = 0; k < 3; k++) w->out[4 * pixel + k] = pu_decode(clamp_f(from[k], 0, 2)) / w->exposure;
    w->out[4 * pixel + 3] = clamp_f(guided_finite(w->guided->color[4 * pixel + 3]), 0, 1);
  }
}

static bool run_tile(Work *w, const PostKernels *kernels, Jobs *jobs, const Cancel *cancel)
{
  return jobs_run(jobs, unet_input(w->plan)->height, fill_row, w, cancel) &&
         unet_run(w->plan, kernels, jobs, cancel) &&
         jobs_run(jobs, w->y.end - w->y.first, take_row, w, cancel);
}

bool denoise_net(const Guided *g, const Unet *net, size_t tile_pixels, const PostKernels *kernels, Jobs *jobs,
                 const Cancel *cancel, float *out, Err *err)
{
  if (net->layers[0].in != DENOISE_CHANNELS || net->layers[UNET_LAYERS - 1].out != 3)
    return err_set(err, ERR_BAD_SCENE, "the network is not one for colour, albedo and normal");
  Axis axis[2];
  UnetPlan plan;
  divide(g, tile_pixels ? tile_pixels : DENOISE_TILE, axis);
  if (!unet_plan_init(&plan, net, axis[0].tile, axis[1].tile, jobs_thread_count(jobs), err)) return false;
  Work w = {.guided = g, .exposure = exposure_of(g), .plan = &plan, .out = out};
  bool ok = true;
  for (uint32_t j = 0; ok && j * axis[1].step < g->height; j++)
    for (uint32_t i = 0; ok && i * axis[0].step < g->width; i++) {
      w.x = tile_of(&axis[0], i);
      w.y = tile_of(&axis[1], j);
      ok = run_tile(&w, kernels, jobs, cancel);
    }
  unet_plan_finish(&plan);
  return ok || err_set(err, ERR_CANCELLED, "denoising was cancelled");
}
