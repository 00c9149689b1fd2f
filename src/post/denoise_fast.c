// See denoise_fast.h. Everything lies in planes with a border; a and b take turns as in and out. Light is filtered as
// luminance, red and blue: luminance is what every tap compares, and green comes out of the three again.

#include "post/denoise_fast.h"

#include "base/mem.h"
#include "base/vec.h"

#include <string.h>

enum { PASSES = 5, BORDER = 1 << (PASSES - 1), ROUND = 16, ROWS_AN_ITEM = 16, PLANES = 13 };
// In the normals of the border: nothing is like it.
#define NOWHERE 1e3f
// Added to the albedo that light is divided by: keeps what is black or has none (a mirror, the sky) finite.
#define LEAST_ALBEDO 0.02f
// What depth may be off beside its slope, as a share of itself, and how many slopes.
#define DEPTH_SHARE  0.005f
#define DEPTH_SLOPES 3.0f

typedef struct Fast {
  const Guided *guided;
  const PostKernels *kernels;
  float *planes; // owned
  float *a[4], *b[4], *normal[3], *depth, *depth_scale;
  size_t stride, origin;
  Atrous pass;
  float *out;
} Fast;

static void fill_border(const Fast *f, float *plane, float value)
{
  const size_t end = f->stride * (f->guided->height + 2 * BORDER) + 2 * BORDER;
  float *at = plane, *row = plane + BORDER * f->stride;
  for (uint32_t y = 0; y < f->guided->height; y++, row += f->stride) {
    while (at < row + BORDER) *at++ = value;
    at = row + BORDER + f->guided->width;
  }
  while (at < plane + end) *at++ = value;
}

static bool fast_init(Fast *f, Err *err)
{
  const uint32_t width = f->guided->width, rounded = (width + ROUND - 1) / ROUND * ROUND;
  f->stride = rounded + 2 * BORDER;
  f->origin = BORDER * f->stride + BORDER;
  const size_t plane = f->stride * (f->guided->height + 2 * BORDER) + 2 * BORDER;
  f->planes = mem_alloc(plane, PLANES * sizeof *f->planes);
  if (!f->planes) return err_memory(err, "denoising", plane * PLANES * sizeof *f->planes);
  float *next = f->planes;
  float **const all[PLANES] = {&f->a[0],      &f->a[1],      &f->a[2],     &f->a[3],  &f->b[0],
                               &f->b[1],      &f->b[2],      &f->b[3],     &f->depth, &f->depth_scale,
                               &f->normal[0], &f->normal[1], &f->normal[2]};
  for (int i = 0; i < PLANES; i++, next += plane) *all[i] = next;
  for (int i = 0; i < PLANES; i++) fill_border(f, *all[i], i < PLANES - 3 ? 0 : NOWHERE);
  return true;
}

// --- before the passes ----------------------------------------------------------------------------
static float divisor(const Guided *g, size_t pixel, int channel)
{
  return clamp_f(guided_finite(g->albedo[3 * pixel + channel]), 0, 1) + LEAST_ALBEDO;
}

static void take_pixel(const Fast *f, size_t pixel, size_t i)
{
  const Guided *g = f->guided;
  Vec3 light;
  for (int k = 0; k < 3; k++) {
    const float c = g->color[4 * pixel + k];
    light[k] = (c > 0 ? min_f(c, 1e15f) : 0) / divisor(g, pixel, k);
    f->normal[k][i] = clamp_f(guided_finite(g->normal[3 * pixel + k]), -1, 1);
  }
  f->a[0][i] = luminance(light);
  f->a[1][i] = light[0];
  f->a[2][i] = light[2];
  f->depth[i] = clamp_f(guided_finite(g->depth[pixel]), 0, 1e15f);
}

typedef struct Window {    // of 3x3 pixels, cut off at the picture's edge
  uint32_t x0, y0, x1, y1; // inclusive
} Window;

static Window window_at(const Guided *g, uint32_t x, uint32_t y)
{
  return (Window){x ? x - 1 : 0, y ? y - 1 : 0, x + 1 < g->width ? x + 1 : x, y + 1 < g->height ? y + 1 : y};
}

// Of luminance among a pixel and its neighbours.
static float variance_around(const Fast *f, Window w)
{
  float sum = 0, squares = 0;
  for (uint32_t y = w.y0; y <= w.y1; y++)
    for (uint32_t x = w.x0; x <= w.x1; x++) {
      const size_t i = f->origin + y * f->stride + x;
      const float l = f->a[0][i];
      sum += l;
      squares += l * l;
    }
  const float n = (float)((w.x1 - w.x0 + 1) * (w.y1 - w.y0 + 1));
  return max_f(squares / n - sqr_f(sum / n), 0);
}

// How far depth may be off a pixel on. Of the two sides the flatter one counts, so that an edge is no slope.
static float depth_step(const Fast *f, Window w, uint32_t x, uint32_t y)
{
  const float *row = f->depth + f->origin + y * f->stride, middle = row[x];
  const float *column = f->depth + f->origin + x;
  const float left = w.x0 < x ? fabsf(row[x - 1] - middle) : 0,
              right = w.x1 > x ? fabsf(row[x + 1] - middle) : left;
  const float up = w.y0 < y ? fabsf(column[w.y0 * f->stride] - middle) : 0;
  const float down = w.y1 > y ? fabsf(column[w.y1 * f->stride] - middle) : up;
  const float slope = max_f(min_f(w.x0 < x ? left : right, right), min_f(w.y0 < y ? up : down, down));
  return DEPTH_SLOPES * slope + DEPTH_SHARE * middle + 1e-12f;
}

// The variance of the light: as the film measured it, or among the neighbours where it did not (with one sample) or
// could not (all samples were black).
static void prepare_pixel(const Fast *f, uint32_t x, uint32_t y)
{
  const Guided *g = f->guided;
  const size_t pixel = (size_t)y * g->width + x, i = f->origin + y * f->stride + x;
  const Window w = window_at(g, x, y);
  const float measured = guided_finite(g->variance[pixel]);
  const float albedo = luminance(v3(divisor(g, pixel, 0), divisor(g, pixel, 1), divisor(g, pixel, 2)));
  f->a[3][i] = min_f(measured > 0 ? measured / sqr_f(albedo) : variance_around(f, w), 1e30f);
  f->depth_scale[i] = 1 / depth_step(f, w, x, y);
}

// --- rows of each step ----------------------------------------------------------------------------
static Window rows_of(const Fast *f, size_t item)
{
  const uint32_t first = (uint32_t)item * ROWS_AN_ITEM, height = f->guided->height;
  return (Window){0, first, f->guided->width, first + ROWS_AN_ITEM < height ? first + ROWS_AN_ITEM : height};
}

static void take_rows(void *user, size_t item, int worker)
{
  const Fast *f = user;
  const Window w = rows_of(f, item);
  (void)worker;
  for (uint32_t y = w.y0; y < w.y1; y++)
    for (uint32_t x = 0; x < w.x1; x++) take_pixel(f, (size_t)y * w.x1 + x, f->origin + y * f->stride + x);
}

static void prepare_rows(void *user, size_t item, int worker)
{
  const Fast *f = user;
  const Window w = rows_of(f, item);
  (void)worker;
  for (uint32_t y = w.y0; y < w.y1; y++)
    for (uint32_t x = 0; x < w.x1; x++) prepare_pixel(f, x, y);
}

static void filter_rows(void *user, size_t item, int worker)
{
  const Fast *f = user;
  const Window w = rows_of(f, item);
  (void)worker;
  f->kernels->atrous_rows(&f->pass, w.y0, w.y1);
}

static void give_rows(void *user, size_t item, int worker)
{
  const Fast *f = user;
  const Guided *g = f->guided;
  const Window w = rows_of(f, item);
  (void)worker;
  for (uint32_t y = w.y0; y < w.y1; y++)
    for (uint32_t x = 0; x < w.x1; x++) {
      const size_t pixel = (size_t)y * w.x1 + x, i = f->origin + y * f->stride + x;
      const float l = f->pass.out[0][i], red = f->pass.out[1][i], blue = f->pass.out[2][i];
      const float green = max_f((l - 0.2126f * red - 0.0722f * blue) * (1 / 0.7152f), 0); // rounding may go below
      const float light[3] = {red, green, blue};
      for (int k = 0; k < 3; k++) f->out[4 * pixel + k] = light[k] * divisor(g, pixel, k);
      f->out[4 * pixel + 3] = clamp_f(guided_finite(g->color[4 * pixel + 3]), 0, 1);
    }
}

// --------------------------------------------------------------------------------------------------
static Atrous pass_of(const Fast *f, int i)
{
  float *const *in = i % 2 ? f->b : f->a, *const *out = i % 2 ? f->a : f->b;
  Atrous a = {.depth = f->depth,
              .depth_scale = f->depth_scale,
              .stride = f->stride,
              .origin = f->origin,
              .width = f->guided->width,
              .step = 1 << i};
  for (int k = 0; k < 4; k++) {
    a.in[k] = in[k];
    a.out[k] = out[k];
  }
  for (int k = 0; k < 3; k++) a.normal[k] = f->normal[k];
  return a;
}

static bool run(Fast *f, Jobs *jobs, const Cancel *cancel)
{
  const size_t items = (f->guided->height + ROWS_AN_ITEM - 1) / ROWS_AN_ITEM;
  if (!jobs_run(jobs, items, take_rows, f, cancel) || !jobs_run(jobs, items, prepare_rows, f, cancel))
    return false;
  for (int i = 0; i < PASSES; i++) {
    f->pass = pass_of(f, i);
    if (!jobs_run(jobs, items, filter_rows, f, cancel)) return false;
  }
  return jobs_run(jobs, items, give_rows, f, cancel);
}

bool denoise_fast(const Guided *g, const PostKernels *kernels, Jobs *jobs, const Cancel *cancel, float *out,
                  Err *err)
{
  Fast f = {.guided = g, .kernels = kernels, .out = out};
  if (!fast_init(&f, err)) return false;
  const bool ok = run(&f, jobs, cancel);
  mem_free(f.planes);
  return ok || err_set(err, ERR_CANCELLED, "denoising was cancelled");
}
