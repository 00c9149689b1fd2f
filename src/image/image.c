// See image.h. The list of formats, the choice among them, and the limits every reader keeps. Nothing here knows a
// format's bytes or library.

#include "image/image.h"

#include "base/file.h"
#include "base/mem.h"
#include "base/text.h"
#include "image/format.h"

#include <string.h>
#include <strings.h>

// stb reads formats that cannot be told by their first bytes, so it comes after those that can. hash is not told by
// an extension: its whole path is its name.
static const Format *const formats[] = {&format_png, &format_jpeg, &format_webp, &format_exr,
                                        &format_hdr, &format_pfm,  &format_stb,  &format_hash};
enum { FORMAT_COUNT = sizeof formats / sizeof *formats, MOST_EXTENSIONS = 3 * FORMAT_COUNT };

size_t pixel_size(PixelType type)
{
  switch (type) {
  case PIXEL_U8: return 1;
  case PIXEL_U16: return 2;
  case PIXEL_F16: return 2;
  case PIXEL_F32: return 4;
  }
  unreachable();
}

void image_finish(Image *img)
{
  mem_free(img->pixels);
  *img = (Image){0};
}

float image_value(const Image *img, uint32_t x, uint32_t y, uint32_t channel)
{
  const void *p = (const char *)image_pixel(img, x, y) + channel * pixel_size(img->type);
  switch (img->type) {
  case PIXEL_U8: return (float)*(const uint8_t *)p / 255;
  case PIXEL_U16: return (float)*(const uint16_t *)p / 65535;
  case PIXEL_F16: return half_to_float(*(const uint16_t *)p);
  case PIXEL_F32: return *(const float *)p;
  }
  unreachable();
}

// --- what readers share ---------------------------------------------------------------------------

bool image_check_size(uint64_t width, uint64_t height, uint32_t channels, PixelType type, const char *name,
                      Err *err)
{
  if (width == 0 || height == 0)
    return err_set(err, ERR_BAD_SCENE, "%s: the picture is empty (%llu x %llu pixels); save it again", name,
                   (unsigned long long)width, (unsigned long long)height);
  const bool is_side_fine = width <= IMAGE_MOST_SIDE && height <= IMAGE_MOST_SIDE;
  const uint64_t bytes = is_side_fine ? width * height * channels * pixel_size(type) : 0;
  if (is_side_fine && bytes <= IMAGE_MOST_BYTES) return true;
  return err_set(
      err, ERR_BAD_SCENE,
      "%s: the picture is too large (%llu x %llu pixels); at most %d pixels a side and %zu MB in all are read; "
      "scale it down",
      name, (unsigned long long)width, (unsigned long long)height, IMAGE_MOST_SIDE, IMAGE_MOST_BYTES >> 20);
}

bool image_create(Image *out, uint64_t width, uint64_t height, uint32_t channels, PixelType type,
                  const char *name, Err *err)
{
  if (!image_check_size(width, height, channels, type, name, err)) return false;
  const size_t pixels = (size_t)width * (size_t)height, size = channels * pixel_size(type);
  *out = (Image){(uint32_t)width, (uint32_t)height, channels, type, mem_alloc(pixels, size)};
  return out->pixels || err_memory(err, name, pixels * size);
}

bool image_damaged(const char *name, const char *format, const char *why, Err *err)
{
  return err_set(err, ERR_BAD_SCENE, "%s: this %s file is damaged or ends early (%s); copy or save it again",
                 name, format, why);
}

// --- reading --------------------------------------------------------------------------------------

static bool format_is_missing(const Format *f, const char *name, Err *err)
{
  return err_set(err, ERR_BAD_ARGUMENT,
                 "%s: this build of Rayfold has no %s; install the Debian package %s and build again, or use "
                 "another format",
                 name, f->name, f->package);
}

bool image_read_bytes(Image *out, const void *bytes, size_t size, const char *name, Err *err)
{
  *out = (Image){0};
  if (size < 4) return err_set(err, ERR_BAD_SCENE, "%s: no picture; the file has %zu bytes", name, size);
  for (size_t i = 0; i < FORMAT_COUNT; i++) {
    const Format *f = formats[i];
    if (!f->is_start || !f->is_start(bytes, size)) continue;
    if (!f->read) return format_is_missing(f, name, err);
    if (f->read(out, bytes, size, name, err)) return true;
    image_finish(out);
    return false;
  }
  unreachable(); // stb takes everything
}

bool image_read(Image *out, const char *path, Err *err)
{
  *out = (Image){0};
  FileBytes file;
  const bool ok = file_read(&file, path, err) && image_read_bytes(out, file.data, file.size, path, err);
  file_release(&file);
  return ok;
}

// --- writing --------------------------------------------------------------------------------------

static const Format *find_writer(const char *path)
{
  if (!strcmp(path, format_hash.name)) return &format_hash;
  const char *extension = path_extension(path);
  for (size_t i = 0; i < FORMAT_COUNT; i++)
    for (size_t k = 0; k < 3 && formats[i]->extensions[k]; k++)
      if (!strcasecmp(extension, formats[i]->extensions[k])) return formats[i];
  return NULL;
}

static bool unknown_extension(const char *path, Err *err)
{
  const char *known[MOST_EXTENSIONS], *extension = path_extension(path);
  size_t count = 0;
  Text list = {0};
  for (size_t i = 0; i < FORMAT_COUNT; i++)
    for (size_t k = 0; k < 3 && formats[i]->extensions[k]; k++) {
      known[count++] = formats[i]->extensions[k];
      text_add(&list, " %s", formats[i]->extensions[k]);
    }
  char hint[120];
  if (extension[0])
    err_set(err, ERR_BAD_ARGUMENT, "%s: pictures are not written as \"%s\"%s; known are%s, and the name hash",
            path, extension, text_hint(hint, extension, known, count), text_get(&list));
  else
    err_set(err, ERR_BAD_ARGUMENT, "%s: the extension says how to write a picture; add one of%s", path,
            text_get(&list));
  text_finish(&list);
  return false;
}

bool image_format(const char *path, bool *is_linear, Err *err)
{
  const Format *f = find_writer(path);
  if (!f) return unknown_extension(path, err);
  if (!f->write) return format_is_missing(f, path, err);
  *is_linear = f->is_linear;
  return true;
}

// The caller's promises, in the order a writer relies on them.
static const char *fault_of(const ImageOut *img)
{
  if (!img->width || !img->height) return "the picture is empty";
  if (img->width > IMAGE_MOST_SIDE || img->height > IMAGE_MOST_SIDE)
    return "a side is longer than 32768 pixels";
  if (!img->planes || !img->plane_count) return "there is no plane";
  for (size_t i = 0; i < img->plane_count; i++) {
    const Plane *p = &img->planes[i];
    if (!p->name || !p->channels || !p->channels[0] || !p->pixels)
      return "a plane lacks its name or its pixels";
  }
  if (img->bits != 0 && img->bits != 8 && img->bits != 16 && img->bits != 32)
    return "bits is not 8, 16 or 32";
  if (img->quality < 0 || img->quality > 100) return "quality is not within 1 and 100";
  return NULL;
}

bool image_write(const char *path, const ImageOut *img, Err *err)
{
  bool is_linear;
  if (!image_format(path, &is_linear, err)) return false;
  const char *fault = fault_of(img);
  if (fault) return err_set(err, ERR_BAD_ARGUMENT, "cannot write \"%s\": %s", path, fault);
  const Format *format = find_writer(path);
  if (format == &format_hash) return format->write(NULL, img, err);
  FileOut f;
  const bool ok = file_begin(&f, path, err) && format->write(&f, img, err) && file_commit(&f, err);
  file_finish(&f);
  return ok;
}
