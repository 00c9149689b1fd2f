// The hash of a picture, and the format that is nothing but it: writing to the name "hash" touches no disk, so
// everything can run where there is none. Equal pictures have equal hashes on every machine; the sign of zero and
// the payload of a NaN do not count, because instruction sets may differ in them.

#include "base/hash.h"

#include "image/format.h"

#include <string.h>

static uint32_t canonical_bits(float x)
{
  uint32_t bits;
  memcpy(&bits, &x, sizeof bits);
  if (x == 0) return 0;
  return x != x ? 0x7fc00000u : bits;
}

static uint64_t hash_floats(uint64_t h, const float *x, size_t count)
{
  uint32_t block[1024];
  while (count) {
    const size_t n = count < 1024 ? count : 1024;
    for (size_t i = 0; i < n; i++) block[i] = canonical_bits(x[i]);
    h = hash_bytes(h, block, n * sizeof *block);
    x += n;
    count -= n;
  }
  return h;
}

uint64_t image_hash(const ImageOut *img)
{
  const uint32_t size[2] = {img->width, img->height};
  uint64_t h = hash_bytes(0, size, sizeof size);
  for (size_t i = 0; i < img->plane_count; i++) {
    const Plane *p = &img->planes[i];
    h = hash_bytes(h, p->name, strlen(p->name));
    h = hash_bytes(h, p->channels, strlen(p->channels));
    h = hash_floats(h, p->pixels, (size_t)img->width * img->height * plane_channel_count(p));
  }
  return h;
}

// The caller prints image_hash(); there is nothing to store.
static bool write_nothing(FileOut *f, const ImageOut *img, Err *err)
{
  (void)f, (void)img, (void)err;
  return true;
}

const Format format_hash = {.name = "hash", .is_linear = true, .write = write_nothing};
