// The other formats, by stb_image: BMP, TGA, GIF (its first frame), PSD (its flat picture), PNM. Reads only, and
// comes last, because TGA has no mark at its start. It is fed through callbacks, which see when it asks for bytes
// beyond the end: stb_image itself goes on with zeros.

#include "image/format.h"

#include "base/mem.h"

#include <string.h>

static bool is_anything(const uint8_t *bytes, size_t size)
{
  (void)bytes;
  return size > 0;
}

#if RAYFOLD_HAVE_STB
#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_ONLY_BMP
#define STBI_ONLY_TGA
#define STBI_ONLY_GIF
#define STBI_ONLY_PSD
#define STBI_ONLY_PNM
#define STBI_NO_STDIO
#define STBI_MAX_DIMENSIONS                  IMAGE_MOST_SIDE
#define STBI_MALLOC(size)                    mem_alloc((size), 1)
#define STBI_REALLOC_SIZED(block, old, size) mem_resize((block), (old), (size), 1)
#define STBI_FREE(block)                     mem_free(block)
#pragma GCC diagnostic ignored "-Wunused-function" // it declares what the formats left out would define
#include <stb/stb_image.h>

typedef struct Source {
  const uint8_t *next, *end;
  bool ran_out;
} Source;

static int take_bytes(void *user, char *to, int size)
{
  Source *s = user;
  const size_t left = (size_t)(s->end - s->next), n = (size_t)size < left ? (size_t)size : left;
  if (left == 0) s->ran_out = true;
  memcpy(to, s->next, n);
  s->next += n;
  return (int)n;
}

// A row's padding may be missing at the end of a file, so skipping beyond the end is no fault yet.
static void skip_bytes(void *user, int count)
{
  Source *s = user;
  const size_t left = (size_t)(s->end - s->next);
  if (count > 0) s->next += (size_t)count < left ? (size_t)count : left;
}

static int is_at_end(void *user)
{
  return ((const Source *)user)->next == ((const Source *)user)->end;
}

static const stbi_io_callbacks source_calls = {.read = take_bytes, .skip = skip_bytes, .eof = is_at_end};

static bool unknown_picture(const char *name, Err *err)
{
  return err_set(
      err, ERR_BAD_SCENE,
      "%s: not a picture I know, or a damaged one; PNG, JPEG, WebP, OpenEXR, HDR, PFM, BMP, TGA, GIF, PSD "
      "and PNM are read",
      name);
}

static bool read_stb(Image *out, const uint8_t *bytes, size_t size, const char *name, Err *err)
{
  const Source start = {bytes, bytes + size, false};
  Source s = start;
  int width = 0, height = 0, channels = 0;
  if (!stbi_info_from_callbacks(&source_calls, &s, &width, &height, &channels))
    return unknown_picture(name, err);
  s = start;
  const bool is_16 = stbi_is_16_bit_from_callbacks(&source_calls, &s);
  const PixelType type = is_16 ? PIXEL_U16 : PIXEL_U8;
  // Four channels are checked, because stb_image may work with more than it gives in the end.
  if (!image_check_size((uint64_t)width, (uint64_t)height, 4, type, name, err)) return false;
  // No byte of these formats stands for more pixels than a long GIF code; without this, 30 bytes that promise a
  // gigabyte would get it.
  enum { MOST_PIXELS_A_BYTE = 4096 };
  if ((uint64_t)width * (uint64_t)height / MOST_PIXELS_A_BYTE > size)
    return image_damaged(name, "picture", "too few bytes for its size", err);
  s = start;
  void *pixels = is_16 ? (void *)stbi_load_16_from_callbacks(&source_calls, &s, &width, &height, &channels, 0)
                       : (void *)stbi_load_from_callbacks(&source_calls, &s, &width, &height, &channels, 0);
  *out = (Image){(uint32_t)width, (uint32_t)height, (uint32_t)channels, type, pixels};
  if (pixels && !s.ran_out) return true;
  return image_damaged(name, "picture",
                       s.ran_out ? "the end of the file comes too soon" : stbi_failure_reason(), err);
}
#endif

const Format format_stb = {
    .name = "reader for this kind of file",
    .package = "libstb-dev",
    .is_start = is_anything,
#if RAYFOLD_HAVE_STB
    .read = read_stb,
#endif
};
