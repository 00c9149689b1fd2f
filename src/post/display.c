// See display.h.

#include "post/display.h"

#include "base/mem.h"
#include "base/vec.h"
#include "base/wide.h"
#include "image/image.h"

#include <string.h>

enum { ROWS_AN_ITEM = 16, CODES = 4096 };

typedef float Pixel __attribute__((vector_size(16))); // r, g, b, a

// --- getting ready --------------------------------------------------------------------------------
// The cubic through four points a, b, c, d at t between b and c (Catmull and Rom, "A class of local interpolating
// splines", 1974).
static void spline_weights(float t, float out[4])
{
  const float t2 = t * t, t3 = t2 * t;
  out[0] = 0.5f * (-t3 + 2 * t2 - t);
  out[1] = 0.5f * (3 * t3 - 5 * t2 + 2);
  out[2] = 0.5f * (-3 * t3 + 4 * t2 + t);
  out[3] = 0.5f * (t3 - t2);
}

static void fill_taps(DisplayTap *taps, uint32_t from, uint32_t to)
{
  for (uint32_t i = 0; i < to; i++) {
    const float at = ((float)i + 0.5f) * (float)from / (float)to - 0.5f, below = floorf(at);
    spline_weights(at - below, taps[i].weight);
    for (int k = 0; k < 4; k++) taps[i].at[k] = (uint32_t)clamp_f(below + (float)(k - 1), 0, (float)(from - 1));
  }
}

bool display_fit(Display *d, uint32_t from_width, uint32_t from_height, uint32_t width, uint32_t height, Jobs *jobs,
                 Err *err)
{
  if (d->from_width == from_width && d->from_height == from_height && d->width == width && d->height == height)
    return true;
  display_finish(d);
  if (from_width != width || from_height != height) {
    const size_t line = (size_t)from_width * jobs_thread_count(jobs);
    d->columns = mem_alloc(width, sizeof *d->columns);
    d->rows = mem_alloc(height, sizeof *d->rows);
    d->lines = mem_alloc(line, sizeof(Pixel));
    if (!d->columns || !d->rows || !d->lines) {
      display_finish(d);
      return err_memory(err, "the window's picture", line * sizeof(Pixel));
    }
    fill_taps(d->columns, from_width, width);
    fill_taps(d->rows, from_height, height);
  }
  d->from_width = from_width;
  d->from_height = from_height;
  d->width = width;
  d->height = height;
  return true;
}

void display_finish(Display *d)
{
  mem_free(d->columns);
  mem_free(d->rows);
  mem_free(d->lines);
  *d = (Display){0};
}

// --- pixels ---------------------------------------------------------------------------------------
typedef struct Work {
  const Display *display;
  float *rgba;
  uint32_t *out;
  uint8_t codes[CODES + 1]; // sRGB code of a square root
} Work;

static Pixel load(const float *p)
{
  Pixel x;
  memcpy(&x, p, sizeof x);
  return x;
}

// No overshoot: between the two nearest.
static Pixel held(Pixel x, Pixel b, Pixel c)
{
  return lanes_min(lanes_max(x, lanes_min(b, c)), lanes_max(b, c));
}

static Pixel weigh(const float w[4], Pixel a, Pixel b, Pixel c, Pixel d)
{
  return held(w[0] * a + w[1] * b + w[2] * c + w[3] * d, b, c);
}

static void exact_row(const float *from, uint32_t *to, uint32_t width)
{
  for (uint32_t x = 0; x < width; x++, from += 4)
    to[x] = 0xff000000u | (uint32_t)srgb_to_u8(from[0]) << 16 | (uint32_t)srgb_to_u8(from[1]) << 8 | srgb_to_u8(from[2]);
}

static void spline_row(const Work *w, uint32_t y, float *line)
{
  const Display *d = w->display;
  const DisplayTap *row = &d->rows[y];
  const size_t stride = 4 * (size_t)d->from_width;
  const float *a = w->rgba + row->at[0] * stride, *b = w->rgba + row->at[1] * stride;
  const float *c = w->rgba + row->at[2] * stride, *e = w->rgba + row->at[3] * stride;
  for (size_t i = 0; i < stride; i += 4) {
    const Pixel p = weigh(row->weight, load(a + i), load(b + i), load(c + i), load(e + i));
    memcpy(line + i, &p, sizeof p);
  }
  uint32_t *to = w->out + (size_t)y * d->width;
  for (uint32_t x = 0; x < d->width; x++) {
    const DisplayTap *t = &d->columns[x];
    const Pixel p = weigh(t->weight, load(line + 4 * t->at[0]), load(line + 4 * t->at[1]), load(line + 4 * t->at[2]),
                          load(line + 4 * t->at[3])) * (float)CODES + 0.5f;
    to[x] = 0xff000000u | (uint32_t)w->codes[(int)p[0]] << 16 | (uint32_t)w->codes[(int)p[1]] << 8 | w->codes[(int)p[2]];
  }
}

static void root_rows(void *user, size_t item, int worker)
{
  const Work *w = user;
  (void)worker;
  const Display *d = w->display;
  const size_t row = 4 * (size_t)d->from_width, first = item * ROWS_AN_ITEM * row;
  const size_t all = row * d->from_height, end = first + ROWS_AN_ITEM * row < all ? first + ROWS_AN_ITEM * row : all;
  for (size_t i = first; i < end; i++) w->rgba[i] = w->rgba[i] > 0 ? sqrtf(min_f(w->rgba[i], 1)) : 0;
}

static void show_rows(void *user, size_t item, int worker)
{
  const Work *w = user;
  const Display *d = w->display;
  const uint32_t first = (uint32_t)item * ROWS_AN_ITEM;
  for (uint32_t y = first; y < first + ROWS_AN_ITEM && y < d->height; y++) {
    if (d->rows)
      spline_row(w, y, d->lines + 4 * (size_t)d->from_width * (size_t)worker);
    else
      exact_row(w->rgba + 4 * (size_t)y * d->width, w->out + (size_t)y * d->width, d->width);
  }
}

static size_t items(uint32_t rows) { return (rows + ROWS_AN_ITEM - 1) / ROWS_AN_ITEM; }

void display_show(const Display *d, float *rgba, uint32_t *out, Jobs *jobs)
{
  Work w = {.display = d, .rgba = rgba, .out = out};
  if (d->rows) {
    for (int i = 0; i <= CODES; i++) w.codes[i] = srgb_to_u8(sqr_f((float)i / CODES));
    jobs_run(jobs, items(d->from_height), root_rows, &w, NULL);
  }
  jobs_run(jobs, items(d->height), show_rows, &w, NULL);
}
