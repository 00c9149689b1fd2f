// PFM, the portable float map: a text head (kind, size, byte order), then rows of floats from the bottom. Exact.
// The head's scale is ignored but for its sign, as everyone does; rows of four channels ("PF4") are not read.
//
//   PF\n  width height\n  -1.0\n  data      PF: rgb, Pf: grey; a negative scale means little-endian

#include "image/format.h"

#include "base/mem.h"

#include <stdio.h>
#include <string.h>

static bool is_pfm(const uint8_t *bytes, size_t size)
{
  return size >= 3 && bytes[0] == 'P' && (bytes[1] == 'F' || bytes[1] == 'f') &&
         (bytes[2] == '\n' || bytes[2] == '\r' || bytes[2] == ' ');
}

static bool is_space(uint8_t c)
{
  return c == ' ' || c == '\n' || c == '\r' || c == '\t';
}

// The next word of the head, cut to fit; false at the end of the file. One white byte after it is taken, too.
static bool next_word(char word[32], const uint8_t **p, const uint8_t *end)
{
  size_t n = 0;
  while (*p < end && is_space(**p)) ++*p;
  for (; *p < end && !is_space(**p); ++*p)
    if (n < 31) word[n++] = (char)**p;
  word[n] = 0;
  if (*p == end || n == 0) return false;
  ++*p;
  return true;
}

// Digits only, saturating far beyond any size.
static bool parse_size(uint64_t *out, const char *word)
{
  *out = 0;
  for (; *word >= '0' && *word <= '9'; word++)
    if (*out < 1u << 30) *out = *out * 10 + (uint64_t)(*word - '0');
  return *word == 0;
}

static void read_row(float *to, const uint8_t *from, size_t count, bool is_little)
{
  const bool swap = is_little != (__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__);
  memcpy(to, from, count * sizeof *to);
  if (!swap) return;
  uint32_t bits;
  for (size_t i = 0; i < count; i++) {
    memcpy(&bits, to + i, 4);
    bits = __builtin_bswap32(bits);
    memcpy(to + i, &bits, 4);
  }
}

static bool read_pfm(Image *out, const uint8_t *bytes, size_t size, const char *name, Err *err)
{
  const uint8_t *p = bytes + 2, *end = bytes + size;
  const uint32_t channels = bytes[1] == 'F' ? 3 : 1;
  char width_word[32], height_word[32], scale[32];
  uint64_t width, height;
  if (!next_word(width_word, &p, end) || !next_word(height_word, &p, end) || !next_word(scale, &p, end))
    return image_damaged(name, "PFM", "its head is not complete", err);
  if (!parse_size(&width, width_word) || !parse_size(&height, height_word))
    return image_damaged(name, "PFM", "its size is not a number", err);
  if (!image_check_size(width, height, channels, PIXEL_F32, name, err)) return false;
  const size_t row_size = (size_t)width * channels * sizeof(float);
  if ((size_t)(end - p) / row_size < height)
    return image_damaged(name, "PFM", "too few bytes for its size", err);
  if (!image_create(out, width, height, channels, PIXEL_F32, name, err)) return false;
  for (uint32_t y = 0; y < out->height; y++, p += row_size)
    read_row(image_pixel(out, 0, out->height - 1 - y), p, (size_t)width * channels, scale[0] == '-');
  return true;
}

static bool write_pfm(FileOut *f, const ImageOut *img, Err *err)
{
  const uint32_t have = plane_channel_count(img->planes), channels = have < 3 ? 1 : 3;
  const bool is_little = __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__;
  char head[64];
  const int n = snprintf(head, sizeof head, "%s\n%u %u\n%s\n", channels == 3 ? "PF" : "Pf", img->width,
                         img->height, is_little ? "-1.0" : "1.0");
  const size_t count = (size_t)img->width * channels;
  float *row = mem_alloc(count, sizeof *row);
  if (!row) return err_memory(err, f->path, count * sizeof *row);
  bool ok = file_write(f, head, (size_t)n, err);
  for (uint32_t y = img->height; ok && y-- > 0;) {
    const float *in = img->planes->pixels + (size_t)y * img->width * have;
    for (uint32_t x = 0; x < img->width; x++)
      memcpy(row + x * channels, in + (size_t)x * have, channels * sizeof *row);
    ok = file_write(f, row, count * sizeof *row, err);
  }
  mem_free(row);
  return ok;
}

const Format format_pfm = {.name = "PFM",
                           .extensions = {".pfm"},
                           .is_linear = true,
                           .is_start = is_pfm,
                           .read = read_pfm,
                           .write = write_pfm};
