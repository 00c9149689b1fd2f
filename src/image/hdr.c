// Radiance pictures (.hdr): three bytes of mantissa that share a byte of exponent, in runs. Read are the flat form,
// the old runs (a pixel 1 1 1 n repeats the last one) and the new ones (four planes per row), in any of the eight
// orientations; written are the new ones. After Ward, "Real Pixels", Graphics Gems II, and the Radiance reference
// manual. EXPOSURE and colour correction in the head are not applied; XYZE files are refused.

#include "image/format.h"

#include "base/mem.h"
#include "base/vec.h"

#include <stdio.h>
#include <string.h>

enum { RUN_LEAST_WIDTH = 8, RUN_MOST_WIDTH = 32767 }; // rows outside are always flat

static bool is_hdr(const uint8_t *bytes, size_t size)
{
  return size >= 2 && bytes[0] == '#' && bytes[1] == '?';
}

// Where pixel (i, j), the j-th of scan line i, belongs: x = x0 + i * xi + j * xj, and the same for y.
typedef struct Head {
  uint64_t line_count, line_length;
  bool is_upright; // lines run along x
  bool flips_i, flips_j;
  const uint8_t *data; // first byte behind the head
} Head;

// --- reading: the head ----------------------------------------------------------------------------

// One line without its end into out, cut to fit; the position behind it, or NULL when the file ends first.
static const uint8_t *next_line(char out[128], const uint8_t *p, const uint8_t *end)
{
  const uint8_t *stop = memchr(p, '\n', (size_t)(end - p));
  if (!stop) return NULL;
  size_t n = (size_t)(stop - p);
  if (n && stop[-1] == '\r') n--;
  if (n > 127) n = 127;
  memcpy(out, p, n);
  out[n] = 0;
  return stop + 1;
}

// "-Y 480 +X 640": the slow axis with its direction and length, then the fast one.
static bool parse_resolution(Head *head, const char *line)
{
  char sign1, axis1, sign2, axis2;
  unsigned count, length;
  if (sscanf(line, "%c%c %9u %c%c %9u", &sign1, &axis1, &count, &sign2, &axis2, &length) != 6) return false;
  const bool is_upright = axis1 == 'Y' && axis2 == 'X', is_turned = axis1 == 'X' && axis2 == 'Y';
  if ((!is_upright && !is_turned) || (sign1 != '-' && sign1 != '+') || (sign2 != '-' && sign2 != '+'))
    return false;
  // Rows count from the top here, so it is +Y and -X that run backwards.
  head->flips_i = sign1 == (is_upright ? '+' : '-');
  head->flips_j = sign2 == (is_upright ? '-' : '+');
  head->is_upright = is_upright;
  head->line_count = count;
  head->line_length = length;
  return true;
}

static bool read_head(Head *head, const uint8_t *bytes, size_t size, const char *name, Err *err)
{
  const uint8_t *p = bytes, *end = bytes + size;
  char line[128];
  do {
    p = next_line(line, p, end);
    if (!p) return image_damaged(name, "HDR", "its head does not end", err);
    if (!strncmp(line, "FORMAT=", 7) && strcmp(line + 7, "32-bit_rle_rgbe"))
      return err_set(err, ERR_BAD_SCENE,
                     "%s: HDR pictures of format \"%s\" are not read, only 32-bit_rle_rgbe", name, line + 7);
  } while (line[0]);
  head->data = next_line(line, p, end);
  if (!head->data || !parse_resolution(head, line))
    return image_damaged(name, "HDR", "its head has no size like \"-Y 480 +X 640\"", err);
  return true;
}

// --- reading: scan lines --------------------------------------------------------------------------

// New runs: each of the four bytes of all pixels by itself; a count above 128 repeats one byte count - 128 times,
// below it copies so many.
static const uint8_t *read_planes(uint8_t *rgbe, size_t length, const uint8_t *p, const uint8_t *end)
{
  for (size_t c = 0; c < 4; c++) {
    size_t i = 0;
    while (i < length) {
      if (end - p < 2) return NULL;
      const bool is_run = *p > 128;
      const size_t count = is_run ? *p - 128u : *p;
      p++;
      if (count == 0 || count > length - i || (!is_run && count > (size_t)(end - p))) return NULL;
      for (size_t k = 0; k < count; k++) rgbe[4 * (i + k) + c] = is_run ? p[0] : p[k];
      i += count;
      p += is_run ? 1 : count;
    }
  }
  return p;
}

// Flat pixels and old runs; several run marks in a row make the count's bytes, lowest first.
static const uint8_t *read_pixels(uint8_t *rgbe, size_t length, const uint8_t *p, const uint8_t *end)
{
  unsigned shift = 0;
  for (size_t i = 0; i < length; p += 4) {
    if (end - p < 4) return NULL;
    if (p[0] == 1 && p[1] == 1 && p[2] == 1) {
      const size_t count = (size_t)p[3] << shift;
      if (i == 0 || shift > 16 || count > length - i) return NULL;
      for (size_t k = 0; k < count; k++, i++) memcpy(rgbe + 4 * i, rgbe + 4 * (i - 1), 4);
      shift += 8;
    } else {
      memcpy(rgbe + 4 * i++, p, 4);
      shift = 0;
    }
  }
  return p;
}

static const uint8_t *read_line(uint8_t *rgbe, size_t length, const uint8_t *p, const uint8_t *end)
{
  const bool is_new = end - p >= 4 && p[0] == 2 && p[1] == 2 && p[2] < 128 && length >= RUN_LEAST_WIDTH &&
                      length <= RUN_MOST_WIDTH;
  if (!is_new) return read_pixels(rgbe, length, p, end);
  if (((size_t)p[2] << 8 | p[3]) != length) return NULL;
  return read_planes(rgbe, length, p + 4, end);
}

static void float_from_rgbe(float rgb[3], const uint8_t rgbe[4])
{
  const float scale = rgbe[3] ? ldexpf(1, rgbe[3] - 128 - 8) : 0;
  for (int c = 0; c < 3; c++) rgb[c] = (float)rgbe[c] * scale;
}

static void place_line(Image *out, const Head *head, uint32_t i, const uint8_t *rgbe)
{
  const uint32_t line = head->flips_i ? (uint32_t)head->line_count - 1 - i : i;
  for (uint32_t j = 0; j < head->line_length; j++) {
    const uint32_t along = head->flips_j ? (uint32_t)head->line_length - 1 - j : j;
    float_from_rgbe(head->is_upright ? image_pixel(out, along, line) : image_pixel(out, line, along),
                    rgbe + 4 * j);
  }
}

static bool read_hdr(Image *out, const uint8_t *bytes, size_t size, const char *name, Err *err)
{
  Head head = {0};
  if (!read_head(&head, bytes, size, name, err)) return false;
  const uint64_t width = head.is_upright ? head.line_length : head.line_count;
  const uint64_t height = head.is_upright ? head.line_count : head.line_length;
  if (!image_check_size(width, height, 3, PIXEL_F32, name, err)) return false;
  const uint8_t *p = head.data, *end = bytes + size;
  if ((size_t)(end - p) / 4 < head.line_count)
    return image_damaged(name, "HDR", "too few bytes for its size", err);
  uint8_t *rgbe = mem_alloc((size_t)head.line_length, 4);
  bool ok = rgbe ? image_create(out, width, height, 3, PIXEL_F32, name, err)
                 : err_memory(err, name, 4 * head.line_length);
  for (uint32_t i = 0; ok && i < head.line_count; i++) {
    p = read_line(rgbe, (size_t)head.line_length, p, end);
    if (p)
      place_line(out, &head, i, rgbe);
    else
      ok = image_damaged(name, "HDR", "a scan line is broken", err);
  }
  mem_free(rgbe);
  return ok;
}

// --- writing --------------------------------------------------------------------------------------

// The largest channel fills its mantissa; all are rounded to nearest. Negative values and NaN become 0, infinity the
// largest there is.
static void rgbe_from_float(uint8_t rgbe[4], const float rgb[3])
{
  float v[3], most = 0;
  for (int c = 0; c < 3; c++) {
    v[c] = rgb[c] > 0 ? min_f(rgb[c], 255 * 0x1p119f) : 0;
    most = max_f(most, v[c]);
  }
  memset(rgbe, 0, 4);
  if (most < 0x1p-127f) return;
  int exponent;
  (void)frexpf(most, &exponent);
  if (most * ldexpf(1, 8 - exponent) >= 255.5f) exponent++; // would round to 256
  const float scale = ldexpf(1, 8 - exponent);
  for (int c = 0; c < 3; c++) rgbe[c] = (uint8_t)(v[c] * scale + 0.5f);
  rgbe[3] = (uint8_t)(exponent + 128);
}

// How many equal bytes begin at i, up to 127.
static size_t run_length(const uint8_t *plane, size_t i, size_t length)
{
  size_t n = 1;
  while (n < 127 && i + n < length && plane[4 * (i + n)] == plane[4 * i]) n++;
  return n;
}

// One byte of all pixels in runs of four and more, and copies of up to 128 between them; the bytes written.
static size_t write_runs(uint8_t *to, const uint8_t *plane, size_t length)
{
  size_t n = 0, i = 0;
  while (i < length) {
    const size_t run = run_length(plane, i, length);
    if (run >= 4) {
      to[n++] = (uint8_t)(128 + run);
      to[n++] = plane[4 * i];
      i += run;
      continue;
    }
    const size_t start = i;
    while (i < length && i - start < 128 && run_length(plane, i, length) < 4) i++;
    to[n++] = (uint8_t)(i - start);
    for (size_t k = start; k < i; k++) to[n++] = plane[4 * k];
  }
  return n;
}

static size_t write_line(uint8_t *to, const uint8_t *rgbe, size_t length)
{
  if (length < RUN_LEAST_WIDTH || length > RUN_MOST_WIDTH) {
    memcpy(to, rgbe, 4 * length);
    return 4 * length;
  }
  const uint8_t mark[4] = {2, 2, (uint8_t)(length >> 8), (uint8_t)length};
  memcpy(to, mark, 4);
  size_t n = 4;
  for (size_t c = 0; c < 4; c++) n += write_runs(to + n, rgbe + c, length);
  return n;
}

static void row_rgbe(uint8_t *rgbe, const ImageOut *img, uint32_t y)
{
  const uint32_t have = plane_channel_count(img->planes);
  const float *in = img->planes->pixels + (size_t)y * img->width * have;
  for (uint32_t x = 0; x < img->width; x++, in += have, rgbe += 4) {
    const float rgb[3] = {in[0], in[have < 3 ? 0 : 1], in[have < 3 ? 0 : 2]};
    rgbe_from_float(rgbe, rgb);
  }
}

// Head lines end at a line break, so a comment may not have any.
static bool write_head(FileOut *f, const ImageOut *img, Err *err)
{
  Text head = {0};
  text_add(&head, "#?RADIANCE\n");
  if (img->comment) {
    text_add(&head, "# ");
    for (const char *c = img->comment; *c; c++) text_add_n(&head, *c == '\n' || *c == '\r' ? " " : c, 1);
    text_add(&head, "\n");
  }
  text_add(&head, "FORMAT=32-bit_rle_rgbe\n\n-Y %u +X %u\n", img->height, img->width);
  const bool ok = head.failed ? err_memory(err, f->path, 256) : file_write(f, head.data, head.length, err);
  text_finish(&head);
  return ok;
}

static bool write_hdr(FileOut *f, const ImageOut *img, Err *err)
{
  // Copies of 128 add a byte each, so a line of runs is at most this long.
  const size_t length = img->width, most = 4 + 4 * (length + length / 4 + 2);
  uint8_t *rgbe = mem_alloc(length, 4), *line = mem_alloc(most, 1);
  bool ok = rgbe && line ? write_head(f, img, err) : err_memory(err, f->path, most);
  for (uint32_t y = 0; ok && y < img->height; y++) {
    row_rgbe(rgbe, img, y);
    ok = file_write(f, line, write_line(line, rgbe, length), err);
  }
  mem_free(rgbe);
  mem_free(line);
  return ok;
}

const Format format_hdr = {.name = "HDR",
                           .extensions = {".hdr"},
                           .is_linear = true,
                           .is_start = is_hdr,
                           .read = read_hdr,
                           .write = write_hdr};
