// See mips.h.

#include "image/mips.h"

#include "base/mem.h"

static uint32_t half_of(uint32_t side)
{
  return side > 1 ? side / 2 : 1;
}

static size_t room_of(const Image *img) // levels begin at multiples of 16 bytes
{
  return ((size_t)img->width * img->height * img->channels * pixel_size(img->type) + 15) & ~(size_t)15;
}

bool mips_begin(Mips *m, const Image *finest)
{
  *m = (Mips){0};
  Image level = *finest;
  while (m->count < MIPS_MOST && (level.width > 1 || level.height > 1)) {
    level.width = half_of(level.width);
    level.height = half_of(level.height);
    m->levels[m->count++] = level;
    m->size += room_of(&level);
  }
  if (!m->count) return true;
  m->block = mem_alloc(m->size, 1);
  if (!m->block) {
    *m = (Mips){0};
    return false;
  }
  char *at = m->block;
  for (uint32_t i = 0; i < m->count; i++) {
    m->levels[i].pixels = at;
    at += room_of(&m->levels[i]);
  }
  return true;
}

void mips_finish(Mips *m)
{
  mem_free(m->block);
  *m = (Mips){0};
}

// The texels of the level above that one texel covers, and their parts of it. At most 3: a texel stands for fewer
// than 2 + 1/n of n, and begins at a multiple of 1/n.
typedef struct Taps {
  uint32_t first, count;
  float weight[4];
} Taps;

static Taps taps_of(uint32_t i, uint32_t above, uint32_t below)
{
  // In units of 1/below of a texel above, all is whole numbers.
  const uint64_t start = (uint64_t)i * above, end = start + above;
  Taps t = {.first = (uint32_t)(start / below)};
  for (uint64_t x = t.first; x * below < end && t.count < 4; x++) {
    const uint64_t low = x * below > start ? x * below : start;
    const uint64_t high = (x + 1) * below < end ? (x + 1) * below : end;
    t.weight[t.count++] = (float)(high - low) / (float)above;
  }
  return t;
}

static float decode(const Image *img, size_t at, bool is_srgb)
{
  switch (img->type) {
  case PIXEL_U8: {
    const uint8_t v = ((const uint8_t *)img->pixels)[at];
    return is_srgb ? srgb_from_u8[v] : (float)v / 255;
  }
  case PIXEL_U16: {
    const float v = (float)((const uint16_t *)img->pixels)[at] / 65535;
    return is_srgb ? srgb_decode(v) : v;
  }
  case PIXEL_F16: return half_to_float(((const uint16_t *)img->pixels)[at]);
  case PIXEL_F32: return ((const float *)img->pixels)[at];
  }
  return 0;
}

// As lookups have it: one broken texel must not spoil a level.
static float decode_finite(const Image *img, size_t at, bool is_srgb)
{
  const float v = decode(img, at, is_srgb);
  return isfinite(v) ? v : 0;
}

static void encode(Image *img, size_t at, float v, bool is_srgb)
{
  switch (img->type) {
  case PIXEL_U8:
    ((uint8_t *)img->pixels)[at] = is_srgb ? srgb_to_u8(v) : (uint8_t)(v * 255 + 0.5f);
    return;
  case PIXEL_U16:
    ((uint16_t *)img->pixels)[at] = (uint16_t)((is_srgb ? srgb_encode(v) : v) * 65535 + 0.5f);
    return;
  case PIXEL_F16: ((uint16_t *)img->pixels)[at] = half_from_float(fminf(fmaxf(v, -65504), 65504)); return;
  case PIXEL_F32: ((float *)img->pixels)[at] = v; return;
  }
}

// Integers stay in 0..1: the weights' sum may be an ulp above one.
static float held(const Image *img, float v)
{
  return img->type == PIXEL_F16 || img->type == PIXEL_F32 ? v : fminf(fmaxf(v, 0), 1);
}

static void make_texel(Image *to, size_t at, const Image *from, MipsMeaning meaning, const Taps *x,
                       const Taps *y)
{
  const uint32_t n = from->channels;
  const bool has_alpha = n == 2 || n == 4, is_weighted = meaning.is_coverage && has_alpha;
  const uint32_t colors = has_alpha ? n - 1 : n;
  float plain[4] = {0, 0, 0, 0}, covered[3] = {0, 0, 0}, alpha = 0;
  for (uint32_t j = 0; j < y->count; j++)
    for (uint32_t i = 0; i < x->count; i++) {
      const size_t texel = ((size_t)(y->first + j) * from->width + x->first + i) * n;
      const float w = x->weight[i] * y->weight[j], a = has_alpha ? decode_finite(from, texel + n - 1, false) : 1;
      alpha += w * a;
      for (uint32_t c = 0; c < colors; c++) {
        const float v = decode_finite(from, texel + c, meaning.is_srgb);
        plain[c] += w * v;
        if (is_weighted) covered[c] += w * a * v;
      }
    }
  for (uint32_t c = 0; c < colors; c++)
    encode(to, at + c, held(to, is_weighted && alpha > 0 ? covered[c] / alpha : plain[c]), meaning.is_srgb);
  if (has_alpha) encode(to, at + n - 1, held(to, alpha), false);
}

void mips_rows(Mips *m, const Image *finest, MipsMeaning meaning, uint32_t level, uint32_t y0, uint32_t y1)
{
  Image *to = &m->levels[level];
  const Image *from = level ? &m->levels[level - 1] : finest;
  for (uint32_t y = y0; y < y1; y++) {
    const Taps rows = taps_of(y, from->height, to->height);
    for (uint32_t x = 0; x < to->width; x++) {
      const Taps columns = taps_of(x, from->width, to->width);
      make_texel(to, ((size_t)y * to->width + x) * to->channels, from, meaning, &columns, &rows);
    }
  }
}
