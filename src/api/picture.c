// Picture files through the public interface: loading, saving, converting. No film is involved.

#include "api/api.h"

#include "base/mem.h"
#include "image/image.h"
#include "post/tone.h"

#include <string.h>

void rf_image_free(rf_image *img)
{
  if (!img) return;
  mem_free(img->pixels);
  *img = (rf_image){0};
}

bool api_is_opaque(const rf_image *rgba)
{
  for (size_t i = 0; i < (size_t)rgba->width * (size_t)rgba->height; i++)
    if (rgba->pixels[4 * i + 3] < 1) return false;
  return true;
}

void api_drop_alpha(rf_image *rgba)
{
  for (size_t i = 0; i < (size_t)rgba->width * (size_t)rgba->height; i++)
    memmove(rgba->pixels + 3 * i, rgba->pixels + 4 * i, 3 * sizeof(float));
  rgba->channels = 3;
}

static bool is_float(const Image *img) { return img->type == PIXEL_F16 || img->type == PIXEL_F32; }

static void to_rgba(const Image *img, float *out)
{
  const bool decode = !is_float(img);
  for (uint32_t y = 0; y < img->height; y++)
    for (uint32_t x = 0; x < img->width; x++, out += 4) {
      for (uint32_t c = 0; c < 3; c++) {
        const float v = image_value(img, x, y, img->channels >= 3 ? c : 0);
        out[c] = decode ? srgb_decode(v) : v;
      }
      out[3] = img->channels == 2 || img->channels == 4 ? image_value(img, x, y, img->channels - 1) : 1;
    }
}

// The file's picture as linear rgba, and what it was stored as.
static bool read_rgba(const char *path, rf_image *out, PixelType *type, Err *err)
{
  Image img = {0};
  if (image_read(&img, path, err)) {
    *type = img.type;
    *out = (rf_image){(int)img.width, (int)img.height, 4,
                      mem_alloc((size_t)img.width * img.height, 4 * sizeof(float))};
    if (out->pixels) to_rgba(&img, out->pixels);
    else err_memory(err, path, 16ull * img.width * img.height);
  }
  image_finish(&img);
  return err->kind == ERR_NONE;
}

bool rf_image_load(rf_engine *e, const char *path, rf_image *out)
{
  if (!e || !path || !out) return api_bad_argument("rf_image_load", "engine, path and result must not be NULL");
  Err err = {0};
  PixelType type;
  *out = (rf_image){0};
  if (!read_rgba(path, out, &type, &err)) *out = (rf_image){0};
  return api_fail(&err);
}

static void write_picture(const rf_image *img, const rf_save_def *save, bool is_exact, const char *path, Err *err)
{
  const Plane plane = {"", img->channels == 4 ? "RGBA" : "RGB", img->pixels, is_exact};
  const ImageOut out = {.width = (uint32_t)img->width, .height = (uint32_t)img->height, .planes = &plane,
                        .plane_count = 1, .bits = save->bits, .quality = save->quality, .comment = save->comment};
  image_write(path, &out, err);
}

bool rf_image_save(rf_engine *e, const rf_image *img, const rf_save_def *save, const char *path)
{
  static const char function[] = "rf_image_save";
  const rf_save_def defaults = rf_default_save_def();
  if (!e || !img || !img->pixels || !path)
    return api_bad_argument(function, "engine, picture and path must not be NULL");
  if (img->width < 1 || img->height < 1 || (img->channels != 3 && img->channels != 4))
    return api_bad_argument(function, "%d x %d with %d channels: it takes 3 or 4", img->width, img->height,
                            img->channels);
  if (!save) save = &defaults;
  if (!api_has_magic(save->magic, MAGIC_SAVE, function, "rf_save_def")) return false;
  Err err = {0};
  write_picture(img, save, false, path, &err);
  return api_fail(&err);
}

bool rf_image_convert(rf_engine *e, const char *from, const char *to, const rf_develop_def *develop,
                      const rf_save_def *save)
{
  static const char function[] = "rf_image_convert";
  const rf_save_def defaults = rf_default_save_def();
  if (!e || !from || !to) return api_bad_argument(function, "engine and paths must not be NULL");
  if (!save) save = &defaults;
  Tone tone;
  if (!api_has_magic(save->magic, MAGIC_SAVE, function, "rf_save_def") || !api_tone(develop, function, &tone))
    return false;
  Err err = {0};
  bool is_linear = false;
  PixelType type;
  rf_image rgba = {0};
  if (image_format(to, &is_linear, &err) && read_rgba(from, &rgba, &type, &err)) {
    if ((type == PIXEL_F16 || type == PIXEL_F32) && !is_linear)
      tone_pixels(&tone, rgba.pixels, (size_t)rgba.width * (size_t)rgba.height, e->jobs);
    if (api_is_opaque(&rgba)) api_drop_alpha(&rgba);
    write_picture(&rgba, save, type == PIXEL_F32, to, &err);
  }
  rf_image_free(&rgba);
  return api_fail(&err);
}
