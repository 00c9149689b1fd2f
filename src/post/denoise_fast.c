// See denoise_fast.h. Everything lies in planes with a border; a and b take turns as in and out. Light is filtered as
// luminance, red and blue: luminance is what every tap compares, and green comes out of the three again.

#include "post/denoise_fast.h"

#include "base/mem.h"

enum { PASSES = 5, BORDER = 1 << (PASSES - 1), ROUND = 16, ROWS_AN_ITEM = 16, PLANES = 13 };
// In the normals of the border: nothing is like it.
#define NOWHERE 1e3f

typedef struct Fast {
  FastPlanes planes;
  const PostKernels *kernels;
  Atrous pass;
  float *out;
} Fast;

// All but the picture's own pixels.
static void fill_border(const FastPlanes *f, float *plane, float value)
{
  const size_t end = f->stride * (f->guided->height + 2 * BORDER) + 2 * BORDER;
  float *at = plane, *row = plane + BORDER * f->stride;
  for (uint32_t y = 0; y < f->guided->height; y++, row += f->stride) {
    while (at < row + BORDER) *at++ = value;
    at = row + BORDER + f->guided->width;
  }
  while (at < plane + end) *at++ = value;
}

static bool make_room(FastScratch *s, size_t floats, Err *err)
{
  if (s->room >= floats) return true;
  fast_scratch_finish(s);
  s->planes = mem_alloc(floats, sizeof *s->planes);
  if (!s->planes) return err_memory(err, "denoising", floats * sizeof *s->planes);
  s->room = floats;
  return true;
}

void fast_scratch_finish(FastScratch *s)
{
  mem_free(s->planes);
  *s = (FastScratch){0};
}

static bool lay_out(FastPlanes *f, FastScratch *scratch, Err *err)
{
  const uint32_t rounded = (f->guided->width + ROUND - 1) / ROUND * ROUND;
  f->stride = rounded + 2 * BORDER;
  f->origin = BORDER * f->stride + BORDER;
  const size_t plane = f->stride * (f->guided->height + 2 * BORDER) + 2 * BORDER;
  if (!make_room(scratch, plane * PLANES, err)) return false;
  float *next = scratch->planes;
  float **const all[PLANES] = {&f->a[0],      &f->a[1],      &f->a[2],     &f->a[3],  &f->b[0],
                               &f->b[1],      &f->b[2],      &f->b[3],     &f->depth, &f->depth_scale,
                               &f->normal[0], &f->normal[1], &f->normal[2]};
  for (int i = 0; i < PLANES; i++, next += plane) *all[i] = next;
  for (int i = 0; i < PLANES; i++) fill_border(f, *all[i], i < PLANES - 3 ? 0 : NOWHERE);
  return true;
}

// --- rows of each step ----------------------------------------------------------------------------
static uint32_t first_row(size_t item) { return (uint32_t)item * ROWS_AN_ITEM; }

static uint32_t end_row(const Fast *f, size_t item)
{
  const uint32_t end = first_row(item) + ROWS_AN_ITEM, height = f->planes.guided->height;
  return end < height ? end : height;
}

static void take_rows(void *user, size_t item, int worker)
{
  const Fast *f = user;
  (void)worker;
  f->kernels->fast_take_rows(&f->planes, first_row(item), end_row(f, item));
}

static void prepare_rows(void *user, size_t item, int worker)
{
  const Fast *f = user;
  (void)worker;
  f->kernels->fast_prepare_rows(&f->planes, first_row(item), end_row(f, item));
}

static void filter_rows(void *user, size_t item, int worker)
{
  const Fast *f = user;
  (void)worker;
  f->kernels->atrous_rows(&f->pass, first_row(item), end_row(f, item));
}

static void give_rows(void *user, size_t item, int worker)
{
  const Fast *f = user;
  (void)worker;
  f->kernels->fast_give_rows(&f->planes, f->pass.out, f->out, first_row(item), end_row(f, item));
}

// --------------------------------------------------------------------------------------------------
static Atrous pass_of(const FastPlanes *f, int i)
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
  const size_t items = (f->planes.guided->height + ROWS_AN_ITEM - 1) / ROWS_AN_ITEM;
  if (!jobs_run(jobs, items, take_rows, f, cancel)) return false;
  f->kernels->fast_extend_rows(&f->planes);
  if (!jobs_run(jobs, items, prepare_rows, f, cancel)) return false;
  for (int i = 0; i < PASSES; i++) {
    f->pass = pass_of(&f->planes, i);
    if (!jobs_run(jobs, items, filter_rows, f, cancel)) return false;
  }
  return jobs_run(jobs, items, give_rows, f, cancel);
}

bool denoise_fast(const Guided *g, const PostKernels *kernels, FastScratch *scratch, Jobs *jobs, const Cancel *cancel,
                  float *out, Err *err)
{
  FastScratch own = {0};
  Fast f = {.planes.guided = g, .kernels = kernels, .out = out};
  bool ok = lay_out(&f.planes, scratch ? scratch : &own, err);
  if (ok && !run(&f, jobs, cancel)) ok = err_set(err, ERR_CANCELLED, "denoising was cancelled");
  fast_scratch_finish(&own);
  return ok;
}
