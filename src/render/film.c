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

void film_clear_rows(Film *f, uint32_t first, uint32_t end)
{
  FilmArray arrays[FILM_ARRAY_COUNT];
  film_list_arrays(f, arrays);
  const size_t from = (size_t)f->width * first, count = (size_t)f->width * (end - first);
  for (int i = 0; i < FILM_ARRAY_COUNT; i++) {
    const size_t size = arrays[i].pixel_size;
    if (*arrays[i].data) memset((char *)*arrays[i].data + from * size, arrays[i].fill, count * size);
  }
}

void film_clear(Film *f)
{
  film_clear_rows(f, 0, f->height);
  film_forget(f);
}

void film_forget(Film *f)
{
  f->ranges.count = 0;
  f->is_partial = false;
}

// --- which samples are in -----------------------------------------------------------------------

static uint32_t cells_along(uint32_t pixels)
{
  return (pixels + FILM_CELL - 1) / FILM_CELL;
}

uint32_t film_columns(const Film *f)
{
  return cells_along(f->width);
}

uint32_t film_cells(const Film *f)
{
  return cells_along(f->width) * cells_along(f->height);
}

CellBox film_cell_box(const Film *f, uint32_t cell)
{
  const uint32_t x = cell % film_columns(f) * FILM_CELL, y = cell / film_columns(f) * FILM_CELL;
  const uint32_t x1 = x + FILM_CELL, y1 = y + FILM_CELL;
  return (CellBox){x, y, x1 < f->width ? x1 : f->width, y1 < f->height ? y1 : f->height};
}

static bool is_before(const CellRange *a, const CellRange *b)
{
  return a->cell != b->cell ? a->cell < b->cell : a->end <= b->first;
}

// False, with the reason, unless the samples may be added to f.
static bool check_apart(const Film *f, const CellRange *more, size_t count, Err *err)
{
  for (size_t i = 0, k = 0; i < f->ranges.count && k < count;) {
    const CellRange *have = &f->ranges.items[i], *add = &more[k];
    if (is_before(have, add))
      i++;
    else if (is_before(add, have))
      k++;
    else {
      const CellBox box = film_cell_box(f, add->cell);
      return err_set(err, ERR_BAD_ARGUMENT,
                     "samples %u to %u are in the film already (at pixel %u, %u it has %u to %u); render or merge others",
                     add->first, add->end, box.x0, box.y0, have->first, have->end);
    }
  }
  return true;
}

// Both lists in order, neighbours joined. The lists are known to be apart.
static size_t join_ranges(const CellRange *a, size_t a_count, const CellRange *b, size_t b_count, CellRange *out)
{
  size_t n = 0;
  for (size_t i = 0, k = 0; i < a_count || k < b_count;) {
    const CellRange r = k == b_count || (i < a_count && is_before(&a[i], &b[k])) ? a[i++] : b[k++];
    if (n && out[n - 1].cell == r.cell && out[n - 1].end == r.first)
      out[n - 1].end = r.end;
    else
      out[n++] = r;
  }
  return n;
}

static bool check_totals(const CellRange *ranges, size_t count, Err *err)
{
  uint64_t total = 0;
  for (size_t i = 0; i < count; i++) {
    if (i && ranges[i].cell != ranges[i - 1].cell) total = 0;
    total += ranges[i].end - ranges[i].first;
    if (total > FILM_MOST_SAMPLES)
      return err_set(err, ERR_BAD_ARGUMENT, "a film holds at most %d samples a pixel", FILM_MOST_SAMPLES);
  }
  return true;
}

bool film_claim_cells(Film *f, const CellRange *ranges, size_t count, Err *err)
{
  const size_t most = f->ranges.count + count;
  if (!check_apart(f, ranges, count, err)) return false;
  CellRange *joined = mem_alloc(most, sizeof *joined);
  if (!joined) return err_memory(err, "the list of samples", most * sizeof *joined);
  const size_t n = join_ranges(f->ranges.items, f->ranges.count, ranges, count, joined);
  if (!check_totals(joined, n, err)) {
    mem_free(joined);
    return false;
  }
  array_finish(&f->ranges);
  f->ranges.items = joined;
  f->ranges.count = n;
  f->ranges.capacity = most;
  return true;
}

bool film_claim(Film *f, uint32_t first, uint32_t end, Err *err)
{
  if (first >= end) return err_set(err, ERR_BAD_ARGUMENT, "samples %u to %u are none", first, end);
  const uint32_t cells = film_cells(f);
  CellRange *all = mem_alloc(cells, sizeof *all);
  if (!all) return err_memory(err, "the list of samples", cells * sizeof *all);
  for (uint32_t i = 0; i < cells; i++) all[i] = (CellRange){i, first, end};
  const bool ok = film_claim_cells(f, all, cells, err);
  mem_free(all);
  return ok;
}

bool film_merge(Film *dst, const Film *src, Err *err)
{
  if (dst->width != src->width || dst->height != src->height || dst->planes != src->planes) {
    return err_set(
        err, ERR_BAD_ARGUMENT,
        "films of %u x %u and %u x %u pixels with planes %#x and %#x cannot be merged; they must be alike",
        dst->width, dst->height, src->width, src->height, dst->planes, src->planes);
  }
  if (!film_claim_cells(dst, src->ranges.items, src->ranges.count, err)) return false;
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

// Of pixels [first, end); out is that of pixel 0, as in what follows.
static void resolve_means(const int64_t *sums, const uint32_t *count, size_t first, size_t end, size_t channels,
                          float *out)
{
  for (size_t i = first; i < end; i++)
    for (size_t k = i * channels; k < (i + 1) * channels; k++) out[k] = mean_of(sums[k], count[i]);
}

// Sums whose last channel counts the samples that hit something.
static void resolve_hits(const int64_t *sums, size_t first, size_t end, size_t channels, float *out)
{
  for (size_t i = first; i < end; i++) {
    const int64_t *s = sums + i * (channels + 1);
    for (size_t k = 0; k < channels; k++) out[i * channels + k] = mean_of(s[k], s[channels]);
  }
}

static void resolve_ids(const uint64_t *ids, size_t first, size_t end, float *out)
{
  for (size_t i = first; i < end; i++) out[i] = ids[i] == UINT64_MAX ? 0 : (float)(uint32_t)ids[i];
}

void film_resolve_rows(const Film *f, FilmPlane plane, uint32_t first_row, uint32_t end_row, float *out)
{
  const size_t first = (size_t)f->width * first_row, end = (size_t)f->width * end_row;
  switch (plane) {
  case FILM_BEAUTY: resolve_means(f->sums[plane], f->count, first, end, 4, out); break;
  case FILM_ALBEDO:
  case FILM_NORMAL: resolve_means(f->sums[plane], f->count, first, end, 3, out); break;
  case FILM_DEPTH: resolve_hits(f->depth, first, end, 1, out); break;
  case FILM_POSITION: resolve_hits(f->position, first, end, 3, out); break;
  case FILM_OBJECT_ID: resolve_ids(f->object, first, end, out); break;
  case FILM_MATERIAL_ID: resolve_ids(f->material, first, end, out); break;
  case FILM_VARIANCE:
    for (size_t i = first; i < end; i++) out[i] = (float)variance_of(&f->moments[i], f->count[i]);
    break;
  case FILM_SAMPLES:
    for (size_t i = first; i < end; i++) out[i] = (float)f->count[i];
    break;
  case FILM_PLANE_COUNT: unreachable();
  }
}

bool film_resolve(const Film *f, FilmPlane plane, float *out)
{
  if (plane >= FILM_PLANE_COUNT || !film_has(f, plane)) return false;
  film_resolve_rows(f, plane, 0, f->height, out);
  return true;
}

// Sums over the pixels of a cell that have samples.
typedef struct CellNoise {
  double light, variance;
  size_t pixels;
} CellNoise;

static CellNoise cell_noise(const Film *f, uint32_t cell)
{
  const CellBox b = film_cell_box(f, cell);
  CellNoise c = {0};
  for (uint32_t y = b.y0; y < b.y1; y++)
    for (size_t i = (size_t)y * f->width + b.x0; i < (size_t)y * f->width + b.x1; i++) {
      if (!f->count[i]) continue;
      c.light += (double)f->moments[i].sum * 0x1p-28 / f->count[i];
      c.variance += variance_of(&f->moments[i], f->count[i]);
      c.pixels++;
    }
  return c;
}

static double mean_light(const Film *f)
{
  double light = 0;
  size_t pixels = 0;
  for (size_t i = 0; i < pixel_count(f); i++) {
    if (!f->count[i]) continue;
    light += (double)f->moments[i].sum * 0x1p-28 / f->count[i];
    pixels++;
  }
  return pixels ? light / (double)pixels : 0;
}

double film_noise(const Film *f, float *noise)
{
  const uint32_t cells = film_cells(f);
  double squares = 0;
  size_t counted = 0;
  if (!f->moments) return 0;
  const double picture = mean_light(f);
  for (uint32_t i = 0; i < cells; i++) {
    const CellNoise c = cell_noise(f, i);
    const double n = c.pixels ? (double)c.pixels : 1, light = c.light / n;
    const double measure = light >= picture ? light : light > 0 ? sqrt(light * picture) : 0;
    const double found = measure > 0 ? sqrt(c.variance / n) / measure : 0;
    if (noise) noise[i] = (float)found;
    squares += found * found;
    counted += c.pixels > 0;
  }
  return counted ? sqrt(squares / (double)counted) : 0;
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
