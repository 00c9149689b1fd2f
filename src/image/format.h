// Private to the room image: what a picture format is to image.c, and the few helpers its files share. A format is
// one const Format in one file; the list of them is in image.c. A format whose library this build lacks keeps its
// row with neither read nor write, so that it can be named in messages.

#ifndef RAYFOLD_IMAGE_FORMAT_H
#define RAYFOLD_IMAGE_FORMAT_H

#include "base/file.h"
#include "image/image.h"

typedef struct Format {
  const char *name; // for messages: "PNG"
  const char
      *extensions[3];  // with the dot, lower case; the first is the usual one; none for a format not written
  const char *package; // Debian package that brings the library; NULL when no library is needed
  bool is_linear;      // see image_format()

  // Whether a file of at least four bytes begins like this format.
  bool (*is_start)(const uint8_t *bytes, size_t size);

  // Decodes all of it into *out, which is zero before and may be left partly filled on failure.
  bool (*read)(Image *out, const uint8_t *bytes, size_t size, const char *name, Err *err);

  // Writes to a file that is thrown away on failure. The picture has been checked by image_write().
  bool (*write)(FileOut *f, const ImageOut *img, Err *err);
} Format;

extern const Format format_png, format_jpeg, format_webp, format_exr, format_hdr, format_pfm, format_stb,
    format_hash;

// Refuses a size that is zero or beyond the limits; name is the file's.
bool image_check_size(uint64_t width, uint64_t height, uint32_t channels, PixelType type, const char *name,
                      Err *err);

// Checks the size and allocates the pixels, not cleared.
bool image_create(Image *out, uint64_t width, uint64_t height, uint32_t channels, PixelType type,
                  const char *name, Err *err);

// The sentence for a file whose content is broken: why is what exactly was found.
bool image_damaged(const char *name, const char *format, const char *why, Err *err);

static inline void *image_pixel(const Image *img, uint32_t x, uint32_t y)
{
  return (char *)img->pixels + ((size_t)y * img->width + x) * img->channels * pixel_size(img->type);
}

static inline uint32_t plane_channel_count(const Plane *p)
{
  uint32_t n = 0;
  while (p->channels[n]) n++;
  return n;
}

// Row y of the first plane as display values of 8 or 16 bits, in as many channels as wanted: grey is spread over
// colours, missing alpha is opaque, alpha not wanted is dropped and so is all colour but the first when grey is
// wanted. Alpha is stored as it is, everything else sRGB-encoded.
void display_row_u8(uint8_t *out, uint32_t channels, const ImageOut *img, uint32_t y);
void display_row_u16(uint16_t *out, uint32_t channels, const ImageOut *img, uint32_t y);

// All rows as 8 bits, in new memory (mem_free); NULL and err when there is none.
uint8_t *display_pixels(uint32_t channels, const ImageOut *img, Err *err);

#endif
