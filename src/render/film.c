// See film.h: creating, merging and reading films. Adding samples is hot and lies in the header.

#include "render/film.h"

#include "base/hash.h"
#include "base/mem.h"

#include <string.h>

const char *const film_plane_names[FILM_PLANE_COUNT] = {
    "", "albedo", "normal", "depth", "position", "object", "material", "variance", "samples"};
const char *const film_plane_channels[FILM_PLANE_COUNT] = {"RGBA", "RGB", "XYZ", "Z", "XYZ",
                                                           "I",    "I",   "Y",   "N"};

void film_list_arrays(Film *f, FilmArray out[FILM_ARRAY_COUNT])
{
  const FilmArray all[FILM_ARRAY_COUNT] = {
      {(void **)&f->sums[FILM_BEAUTY], 4 * sizeof(int64_t), FILM_BEAUTY, 0},
      {(void **)&f->sums[FILM_ALBEDO], 3 * sizeof(int64_t), FILM_ALBEDO, 0},
      {(void **)&f->sums[FILM_NORMAL], 3 * sizeof(int64_t), FILM_NORMAL, 0},
      {(void **)&f->depth, 2 * sizeof(int64_t), FILM_DEPTH, 0},
      {(void **)&f->position, 4 * sizeof(int64_t), FILM_POSITION, 0},
      {(void **)&f->object, sizeof(uint64_t), FILM_OBJECT_ID, 0xff},
      {(void **)&f->material, sizeof(uint64_t), FILM_MATERIAL_ID, 0xff},
      {(void **)&f->moments, sizeof(FilmMoments), FILM_VARIANCE, 0},
      {(void **)&f->count, sizeof(uint32_t), FILM_SAMPLES, 0},
  };
  memcpy(out, all, sizeof all);
}

static size_t pixel_count(const Film *f)
{
  return (size_t)f->width * f->height;
}
static uint32_t with_needed(uint32_t planes)
{
  return planes | 1u << FILM_BEAUTY | 1u << FILM_SAMPLES;
}

bool film_bytes(uint32_t width, uint32_t height, uint32_t planes, size_t *bytes)
{
  Film none = {0};
  FilmArray arrays[FILM_ARRAY_COUNT];
  film_list_arrays(&none, arrays);
  size_t pixel_size = 0, pixels;
  for (int i = 0; i < FILM_ARRAY_COUNT; i++) {
    if (with_needed(planes) >> arrays[i].plane & 1) pixel_size += arrays[i].pixel_size;
  }
  return size_mul(width, height, &pixels) && size_mul(pixels, pixel_size, &pixels) &&
         size_add(pixels, sizeof(Film), bytes);
}

Film *film_create(uint32_t width, uint32_t height, uint32_t planes, Err *err)
{
  size_t bytes = 0;
  if (width < 1 || height < 1 || width > FILM_MOST_SIDE || height > FILM_MOST_SIDE) {
    err_set(err, ERR_BAD_ARGUMENT, "a picture of %u x %u pixels is not possible; each side must be 1 to %d",
            width, height, FILM_MOST_SIDE);
    return NULL;
  }
  film_bytes(width, height, planes, &bytes);
  Film *f = mem_zero(1, sizeof *f);
  bool ok = f;
  if (f) {
    f->width = width;
    f->height = height;
    f->planes = with_needed(planes) & ((1u << FILM_PLANE_COUNT) - 1);
    FilmArray arrays[FILM_ARRAY_COUNT];
    film_list_arrays(f, arrays);
    for (int i = 0; i < FILM_ARRAY_COUNT && ok; i++) {
      if (!film_has(f, arrays[i].plane)) continue;
      *arrays[i].data = mem_alloc(pixel_count(f), arrays[i].pixel_size);
      ok = *arrays[i].data;
    }
  }
  if (!ok) {
    err_memory(err, "the film", bytes);
    film_destroy(f);
    return NULL;
  }
  film_clear(f);
  return f;
}

void film_destroy(Film *f)
{
  if (!f) return;
  FilmArray arrays[FILM_ARRAY_COUNT];
  film_list_arrays(f, arrays);
  for (int i = 0; i < FILM_ARRAY_COUNT; i++) mem_free(*arrays[i].data);
  array_finish(&f->ranges);
  mem_free(f);
}

void film_clear(Film *f)
{
  FilmArray arrays[FILM_ARRAY_COUNT];
  film_list_arrays(f, arrays);
  for (int i = 0; i < FILM_ARRAY_COUNT; i++) {
    if (*arrays[i].data) memset(*arrays[i].data, arrays[i].fill, pixel_count(f) * arrays[i].pixel_size);
  }
  f->ranges.count = 0;
  f->is_partial = false;
}

// --- which samples are in -----------------------------------------------------------------------

static uint32_t claimed_count(const Film *f)
{
  uint32_t n = 0;
  for (size_t i = 0; i < f->ranges.count; i++) n += f->ranges.items[i].end - f->ranges.items[i].first;
  return n;
}

// False, with the reason, unless the samples may be added to f.
static bool check_claim(const Film *f, SampleRange r, Err *err)
{
  for (size_t i = 0; i < f->ranges.count; i++) {
    const SampleRange have = f->ranges.items[i];
    if (r.first < have.end && have.first < r.end) {
      return err_set(err, ERR_BAD_ARGUMENT,
                     "samples %u to %u are in the film already (it has %u to %u); render or merge others",
                     r.first, r.end, have.first, have.end);
    }
  }
  return true;
}

// Inserts in order and joins neighbours; room for one more has been made.
static void insert_range(Film *f, SampleRange r)
{
  SampleRange *a = f->ranges.items;
  size_t i = f->ranges.count++;
  for (; i > 0 && a[i - 1].first > r.first; i--) a[i] = a[i - 1];
  a[i] = r;
  size_t kept = 0;
  for (size_t k = 1; k < f->ranges.count; k++) {
    if (a[k].first == a[kept].end)
      a[kept].end = a[k].end;
    else
      a[++kept] = a[k];
  }
  f->ranges.count = kept + 1;
}

static bool check_total(const Film *f, uint64_t more, Err *err)
{
  if (claimed_count(f) + more <= FILM_MOST_SAMPLES) return true;
  return err_set(err, ERR_BAD_ARGUMENT, "a film holds at most %d samples a pixel", FILM_MOST_SAMPLES);
}

bool film_claim(Film *f, uint32_t first, uint32_t end, Err *err)
{
  if (first >= end) return err_set(err, ERR_BAD_ARGUMENT, "samples %u to %u are none", first, end);
  const SampleRange r = {first, end};
  if (!check_claim(f, r, err) || !check_total(f, end - first, err)) return false;
  if (!array_reserve(&f->ranges, f->ranges.count + 1)) {
    return err_memory(err, "the list of samples", sizeof(SampleRange));
  }
  insert_range(f, r);
  return true;
}

bool film_merge(Film *dst, const Film *src, Err *err)
{
  if (dst->width != src->width || dst->height != src->height || dst->planes != src->planes) {
    return err_set(
        err, ERR_BAD_ARGUMENT,
        "films of %u x %u and %u x %u pixels with planes %#x and %#x cannot be merged; they must be alike",
        dst->width, dst->height, src->width, src->height, dst->planes, src->planes);
  }
  for (size_t i = 0; i < src->ranges.count; i++) {
    if (!check_claim(dst, src->ranges.items[i], err)) return false;
  }
  if (!check_total(dst, claimed_count(src), err)) return false;
  if (!array_reserve(&dst->ranges, dst->ranges.count + src->ranges.count)) {
    return err_memory(err, "the list of samples", src->ranges.count * sizeof(SampleRange));
  }
  for (size_t i = 0; i < src->ranges.count; i++) insert_range(dst, src->ranges.items[i]);
  dst->is_partial |= src->is_partial;

  const size_t n = pixel_count(dst);
  for (size_t i = 0; i < n; i++) {
    dst->count[i] += src->count[i];
    for (size_t k = 4 * i; k < 4 * i + 4; k++) dst->sums[FILM_BEAUTY][k] += src->sums[FILM_BEAUTY][k];
    if (dst->object && src->object[i] < dst->object[i]) dst->object[i] = src->object[i];
    if (dst->material && src->material[i] < dst->material[i]) dst->material[i] = src->material[i];
    if (!dst->moments) continue;
    dst->moments[i].sum += src->moments[i].sum;
    dst->moments[i].squares += src->moments[i].squares;
  }
  for (size_t k = 0; dst->sums[FILM_ALBEDO] && k < 3 * n; k++)
    dst->sums[FILM_ALBEDO][k] += src->sums[FILM_ALBEDO][k];
  for (size_t k = 0; dst->sums[FILM_NORMAL] && k < 3 * n; k++)
    dst->sums[FILM_NORMAL][k] += src->sums[FILM_NORMAL][k];
  for (size_t k = 0; dst->depth && k < 2 * n; k++) dst->depth[k] += src->depth[k];
  for (size_t k = 0; dst->position && k < 4 * n; k++) dst->position[k] += src->position[k];
  return true;
}

// --- reading ------------------------------------------------------------------------------------

static float mean_of(int64_t sum, int64_t count)
{
  return count ? (float)((double)sum * 0x1p-28 / (double)count) : 0;
}

// Of the mean: (sum of squares - square of the sum / n) / (n (n - 1)). Doubles lose nothing that matters: both sums are
// exact up to here.
static double variance_of(const FilmMoments *m, uint32_t count)
{
  if (count < 2) return 0;
  const double n = count, sum = (double)m->sum * 0x1p-28;
  const double spread = (double)m->squares * 0x1p-56 - sum * sum / n;
  return spread > 0 ? spread / (n * (n - 1)) : 0;
}

static void resolve_means(const int64_t *sums, const uint32_t *count, size_t pixels, size_t channels,
                          float *out)
{
  for (size_t i = 0; i < pixels * channels; i++) out[i] = mean_of(sums[i], count[i / channels]);
}

// Sums whose last channel counts the samples that hit something.
static void resolve_hits(const int64_t *sums, size_t pixels, size_t channels, float *out)
{
  for (size_t i = 0; i < pixels; i++) {
    const int64_t *s = sums + i * (channels + 1);
    for (size_t k = 0; k < channels; k++) out[i * channels + k] = mean_of(s[k], s[channels]);
  }
}

static void resolve_ids(const uint64_t *first, size_t pixels, float *out)
{
  for (size_t i = 0; i < pixels; i++) out[i] = first[i] == UINT64_MAX ? 0 : (float)(uint32_t)first[i];
}

bool film_resolve(const Film *f, FilmPlane plane, float *out)
{
  if (plane >= FILM_PLANE_COUNT || !film_has(f, plane)) return false;
  const size_t n = pixel_count(f);
  switch (plane) {
  case FILM_BEAUTY: resolve_means(f->sums[plane], f->count, n, 4, out); break;
  case FILM_ALBEDO:
  case FILM_NORMAL: resolve_means(f->sums[plane], f->count, n, 3, out); break;
  case FILM_DEPTH: resolve_hits(f->depth, n, 1, out); break;
  case FILM_POSITION: resolve_hits(f->position, n, 3, out); break;
  case FILM_OBJECT_ID: resolve_ids(f->object, n, out); break;
  case FILM_MATERIAL_ID: resolve_ids(f->material, n, out); break;
  case FILM_VARIANCE:
    for (size_t i = 0; i < n; i++) out[i] = (float)variance_of(&f->moments[i], f->count[i]);
    break;
  case FILM_SAMPLES:
    for (size_t i = 0; i < n; i++) out[i] = (float)f->count[i];
    break;
  case FILM_PLANE_COUNT: unreachable();
  }
  return true;
}

double film_noise(const Film *f)
{
  enum { STEPS = 8, LOW = -24, BINS = 32 * STEPS }; // an eighth of an octave a bin, from 2^-24
  if (!f->moments) return 0;
  size_t bins[BINS] = {0}, total = 0;
  for (size_t i = 0; i < pixel_count(f); i++) {
    if (f->count[i] < 2 || f->moments[i].sum <= 0) continue;
    const double mean = (double)f->moments[i].sum * 0x1p-28 / f->count[i];
    const double error = sqrt(variance_of(&f->moments[i], f->count[i])) / mean;
    const double bin = error > 0 ? (log2(error) - LOW) * STEPS : 0;
    bins[bin < 0 ? 0 : bin >= BINS ? BINS - 1 : (size_t)bin]++;
    total++;
  }
  size_t below = 0;
  for (int b = 0; b < BINS && total; b++) {
    below += bins[b];
    if (2 * below >= total) return b ? exp2((b + 0.5) / STEPS + LOW) : 0;
  }
  return 0;
}

uint64_t film_hash(const Film *f)
{
  FilmArray arrays[FILM_ARRAY_COUNT];
  film_list_arrays((Film *)(uintptr_t)f, arrays);
  const uint32_t head[3] = {f->width, f->height, f->planes};
  uint64_t h = hash_bytes(0, head, sizeof head);
  for (int i = 0; i < FILM_ARRAY_COUNT; i++) {
    if (*arrays[i].data) h = hash_bytes(h, *arrays[i].data, pixel_count(f) * arrays[i].pixel_size);
  }
  return h;
}
