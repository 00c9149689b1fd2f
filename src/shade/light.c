// Cold side of lights: copies them and makes the tables they are chosen by. See light.h.

#include "shade/light.h"

#include "base/mem.h"
#include "shade/light_sample.h"
#include "shade/light_tree_build.h"

#include <string.h>

static double power_of(const Emitter *e)
{
  const double lum = (double)luminance(e->color) * (double)e->mean_map, pi = 3.14159265358979323846;
  switch ((EmitterKind)e->kind) {
  case EMITTER_POINT: return lum * 4 * pi;
  case EMITTER_SPOT: return lum * 2 * pi * (1 - 0.5 * ((double)e->cos_outer + (double)e->cos_inner));
  case EMITTER_TRIANGLE:
  case EMITTER_QUAD:
  case EMITTER_DISK:
  case EMITTER_SPHERE: return lum * pi * (double)e->area * (e->is_two_sided ? 2 : 1);
  }
  unreachable();
}

// Running sums of count weights into cdf[0..count], scaled to end at exactly 1; equal steps if all weights are 0.
static double fill_cdf(float *cdf, const double *weights, size_t count)
{
  double total = 0, sum = 0;
  for (size_t i = 0; i < count; i++) total += weights[i];
  cdf[0] = 0;
  for (size_t i = 0; i < count; i++) {
    sum += weights[i];
    cdf[i + 1] = total > 0 ? (float)(sum / total) : (float)(i + 1) / (float)count;
  }
  cdf[count] = 1;
  return total;
}

static bool build_emitters(LightSet *set, const Emitter *emitters, size_t count, const Cancel *cancel,
                           Err *err)
{
  if (!count) return true;
  set->emitters = arena_alloc(&set->arena, count, sizeof *emitters);
  double *power = mem_alloc(count, sizeof *power);
  if (!set->emitters || !power) {
    mem_free(power);
    return err_memory(err, "lights", count * sizeof *emitters);
  }
  memcpy(set->emitters, emitters, count * sizeof *emitters);
  set->emitter_count = count;
  for (size_t i = 0; i < count; i++) power[i] = fmin(fmax(power_of(&emitters[i]), 0), 1e30);
  const bool ok = light_tree_build(&set->tree, &set->arena, emitters, power, count, cancel, err);
  mem_free(power);
  return ok;
}

// --- sky ------------------------------------------------------------------------------------------
enum { SKY_MOST_WIDE = 1024, SKY_MOST_HIGH = 512, SKY_GRADIENT_ROWS = 128 };

static void grid_size(SkyMap *sky)
{
  const Image *img = &sky->image;
  if (sky->kind == SKY_MAP_IMAGE) {
    sky->grid_width = img->width < SKY_MOST_WIDE ? img->width : SKY_MOST_WIDE;
    sky->grid_height = img->height < SKY_MOST_HIGH ? img->height : SKY_MOST_HIGH;
  } else { // a gradient depends on height alone
    sky->grid_width = 1;
    sky->grid_height = SKY_GRADIENT_ROWS;
  }
}

// Adds a texel's light to its cell and the cells of its neighbours in the row.
static void add_texel(const SkyMap *sky, double *row, uint32_t x, double light)
{
  const uint32_t width = sky->image.width, left = x > 0 ? x - 1 : width - 1,
                 right = x + 1 < width ? x + 1 : 0;
  row[(uint64_t)left * sky->grid_width / width] += light / 8;
  row[(uint64_t)x * sky->grid_width / width] += light * 3 / 4;
  row[(uint64_t)right * sky->grid_width / width] += light / 8;
}

// Sums each texel's luminance in the cells, weighed by the solid angle of its row. A bilinear lookup shows an eighth
// of a texel's light in each neighbour's place, so that is where it goes: no cell that shines may have no chance.
static void add_texels(const SkyMap *sky, double *cells)
{
  const Image *img = &sky->image;
  const int64_t last = (int64_t)img->height - 1;
  for (uint32_t y = 0; y < img->height; y++) {
    const double weight = (double)sky_row_weight(sky, ((float)y + 0.5f) / (float)img->height);
    double *rows[3];
    for (int k = 0; k < 3; k++) {
      const int64_t near = (int64_t)y + k - 1, inside = near < 0 ? 0 : near > last ? last : near;
      rows[k] = cells + (size_t)((uint64_t)inside * sky->grid_height / img->height) * sky->grid_width;
    }
    for (uint32_t x = 0; x < img->width; x++) {
      const double light = fmax((double)luminance(sky_texel(img, x, y)), 0) * weight;
      add_texel(sky, rows[0], x, light / 8);
      add_texel(sky, rows[1], x, light * 3 / 4);
      add_texel(sky, rows[2], x, light / 8);
    }
  }
}

static void add_gradient(const SkyMap *sky, double *cells)
{
  for (uint32_t y = 0; y < sky->grid_height; y++) {
    const double theta = 3.14159265358979323846 * ((double)y + 0.5) / sky->grid_height;
    cells[y] = sin(theta) * (double)luminance(sky_gradient(sky, (float)cos(theta)));
  }
}

static bool is_uniform(const SkyMap *sky)
{
  switch ((SkyMapKind)sky->kind) {
  case SKY_MAP_CONSTANT: return true;
  case SKY_MAP_GRADIENT:
    return v3_is_zero(sky->color - sky->horizon) && v3_is_zero(sky->horizon - sky->ground);
  case SKY_MAP_IMAGE: return !sky->image.pixels;
  }
  unreachable();
}

static bool build_sky(LightSet *set, const SkyMap *sky, Err *err)
{
  set->sky = *sky;
  SkyMap *s = &set->sky;
  s->is_sampled = false;
  s->row_cdf = s->cell_cdf = NULL;
  if (s->gain == 0 || is_uniform(s)) return true;
  grid_size(s);
  const size_t width = s->grid_width, height = s->grid_height;
  double *cells = mem_zero(width * height + height, sizeof *cells);
  s->row_cdf = arena_alloc(&set->arena, height + 1, sizeof *s->row_cdf);
  s->cell_cdf = arena_alloc(&set->arena, (width + 1) * height, sizeof *s->cell_cdf);
  if (!cells || !s->row_cdf || !s->cell_cdf) {
    mem_free(cells);
    return err_memory(err, "the sky's tables", width * height * sizeof *cells);
  }
  double *rows = cells + width * height;
  if (s->kind == SKY_MAP_IMAGE)
    add_texels(s, cells);
  else
    add_gradient(s, cells);
  for (size_t y = 0; y < height; y++)
    rows[y] = fill_cdf(s->cell_cdf + y * (width + 1), cells + y * width, width);
  s->is_sampled = fill_cdf(s->row_cdf, rows, height) > 0; // a black sky is not worth a ray
  mem_free(cells);
  return true;
}

bool light_set_build(LightSet *out, const Emitter *emitters, size_t emitter_count, const Sun *suns,
                     size_t sun_count, const SkyMap *sky, const Cancel *cancel, Err *err)
{
  LightSet set = {0};
  *out = set;
  bool ok = build_emitters(&set, emitters, emitter_count, cancel, err) && build_sky(&set, sky, err);
  if (ok && sun_count) {
    set.suns = arena_alloc(&set.arena, sun_count, sizeof *suns);
    if (set.suns)
      memcpy(set.suns, suns, sun_count * sizeof *suns);
    else
      ok = err_memory(err, "suns", sun_count * sizeof *suns);
    set.sun_count = sun_count;
  }
  if (!ok)
    arena_finish(&set.arena);
  else
    *out = set;
  return ok;
}

void light_set_finish(LightSet *s)
{
  arena_finish(&s->arena);
  *s = (LightSet){0};
}
