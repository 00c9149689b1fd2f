// Pictures in memory, and the one door to picture files. Files are recognised by their first bytes when read and
// by their extension when written. Each format's library is known to one file of this room.

#ifndef RAYFOLD_IMAGE_IMAGE_H
#define RAYFOLD_IMAGE_IMAGE_H

#include "base/err.h"
#include "base/fmath.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef enum PixelType { PIXEL_U8, PIXEL_U16, PIXEL_F16, PIXEL_F32 } PixelType;

// A picture as it was stored: integer types usually hold sRGB-encoded values, float types linear ones; the reader
// keeps them as they are, whoever samples decides. Rows from the top, channels interleaved:
// 1 grey, 2 grey + alpha, 3 rgb, 4 rgba (alpha not multiplied in).
typedef struct Image {
  uint32_t width, height, channels;
  PixelType type;
  void *pixels; // owned (mem_alloc), width * height * channels of type
} Image;        // zero is no image

enum { IMAGE_MOST_SIDE = 32768 };
#define IMAGE_MOST_BYTES ((size_t)1 << 30) // larger pictures are refused before anything is allocated

size_t pixel_size(PixelType type); // bytes of one channel
void image_finish(Image *img);     // accepts zero

// PNG, JPEG, Radiance HDR, OpenEXR, WebP and PFM, and what stb_image reads besides. `name` is for messages.
bool image_read_bytes(Image *out, const void *bytes, size_t size, const char *name, Err *err);
bool image_read(Image *out, const char *path, Err *err);

// One channel value as float; integers map 0..max to 0..1 without decoding sRGB.
float image_value(const Image *img, uint32_t x, uint32_t y, uint32_t channel);

// --- writing ------------------------------------------------------------------------------------
// A named group of channels, all planes of a picture the same size. The first plane is the picture itself.
typedef struct Plane {
  const char *name;     // "" for the picture; else "albedo", "normal", "depth", ...
  const char *channels; // one letter each, in memory order: "RGB", "RGBA", "XYZ", "Z", "I"
  const float *pixels;  // rows from the top, interleaved; linear
  bool is_exact;        // keep 32 bits in files that would store 16 (ids, depth)
} Plane;

typedef struct ImageOut {
  uint32_t width, height;
  const Plane *planes; // at least one
  size_t plane_count;
  int bits;            // PNG 8 or 16, EXR 16 (half) or 32; 0 is the format's default (8; 16)
  int quality;         // JPEG and WebP, 1..100; 0 is the default (92)
  const char *comment; // stored where the format can; may be NULL
} ImageOut;

// What the extension of path stands for; false if no writer knows it (message lists those there are).
// is_linear: the format holds linear radiance (exr, hdr, pfm, hash) rather than display values (png, jpg, webp).
bool image_format(const char *path, bool *is_linear, Err *err);

// Writes the file whole or not at all. Display formats take the first plane only, as display-linear 0..1, encode it
// to sRGB and round; EXR takes all planes ("albedo.R", ...); HDR and PFM the first plane's colour.
bool image_write(const char *path, const ImageOut *img, Err *err);

// A 64-bit hash of size and every plane's name and bits.
uint64_t image_hash(const ImageOut *img);

// --- colour -------------------------------------------------------------------------------------
// sRGB transfer curves, IEC 61966-2-1, for all of Rayfold. Exact for 8 bit: srgb_to_u8(srgb_from_u8(i)) == i.
float srgb_encode(float linear); // clamps to 0..1; NaN gives 0

// Hot, for texels of 16 bits, so by our own power. NaN and what is below 0 give 0; above 1 the curve goes on.
static inline float srgb_decode(float encoded)
{
  if (!(encoded > 0)) return 0;
  return encoded <= 0.04045f ? encoded / 12.92f : f_pow((encoded + 0.055f) / 1.055f, 2.4f);
}

extern const float srgb_from_u8[256];
uint8_t srgb_to_u8(float linear);

// Half floats (IEEE 754 binary16), round to nearest even; overflow gives infinity.
uint16_t half_from_float(float x);
float half_to_float(uint16_t h);

#endif
