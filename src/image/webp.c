// WebP by libwebp: 8 bits, RGB or RGBA. Animations are refused. Quality 100 is written without loss, also under
// transparent pixels.

#include "image/format.h"

#include "base/mem.h"

#include <string.h>

static bool is_webp(const uint8_t *bytes, size_t size)
{
  return size >= 12 && !memcmp(bytes, "RIFF", 4) && !memcmp(bytes + 8, "WEBP", 4);
}

#if RAYFOLD_HAVE_WEBP
#include <webp/decode.h>
#include <webp/encode.h>

static const char *status_text(VP8StatusCode status)
{
  switch (status) {
  case VP8_STATUS_OK: return "no error";
  case VP8_STATUS_OUT_OF_MEMORY: return "out of memory";
  case VP8_STATUS_INVALID_PARAM: return "its parameters contradict each other";
  case VP8_STATUS_BITSTREAM_ERROR: return "its bits make no sense";
  case VP8_STATUS_UNSUPPORTED_FEATURE: return "it uses a feature libwebp does not know";
  case VP8_STATUS_SUSPENDED: return "the end of the file comes too soon";
  case VP8_STATUS_USER_ABORT: return "aborted";
  case VP8_STATUS_NOT_ENOUGH_DATA: return "the end of the file comes too soon";
  }
  return "unknown error";
}

static bool read_webp(Image *out, const uint8_t *bytes, size_t size, const char *name, Err *err)
{
  WebPDecoderConfig config;
  if (!WebPInitDecoderConfig(&config)) return err_set(err, ERR_BAD_ARGUMENT, "%s: libwebp is too old", name);
  VP8StatusCode status = WebPGetFeatures(bytes, size, &config.input);
  if (status != VP8_STATUS_OK) return image_damaged(name, "WebP", status_text(status), err);
  if (config.input.has_animation)
    return err_set(err, ERR_BAD_SCENE, "%s: animated WebP is not read; save one frame as a still picture",
                   name);
  const uint32_t channels = config.input.has_alpha ? 4 : 3;
  if (!image_create(out, (uint64_t)config.input.width, (uint64_t)config.input.height, channels, PIXEL_U8,
                    name, err))
    return false;
  const size_t stride = (size_t)out->width * channels;
  config.output.colorspace = channels == 4 ? MODE_RGBA : MODE_RGB;
  config.output.is_external_memory = 1;
  config.output.u.RGBA =
      (WebPRGBABuffer){.rgba = out->pixels, .stride = (int)stride, .size = stride * out->height};
  status = WebPDecode(bytes, size, &config);
  WebPFreeDecBuffer(&config.output);
  return status == VP8_STATUS_OK || image_damaged(name, "WebP", status_text(status), err);
}

typedef struct WebpTarget {
  FileOut *file;
  Err *err;
} WebpTarget;

static int put_bytes(const uint8_t *data, size_t size, const WebPPicture *picture)
{
  const WebpTarget *target = picture->custom_ptr;
  return file_write(target->file, data, size, target->err);
}

// Method 2 of 6 halves the time of the default 4 for files 1 % larger; without loss, preset 1 of 9 takes a third of
// the time of preset 6 for files 4 % larger.
static void configure(WebPConfig *config, int quality)
{
  WebPConfigInit(config);
  config->quality = (float)quality;
  config->method = 2;
  if (quality < 100) return;
  WebPConfigLosslessPreset(config, 1);
  config->exact = 1;
}

static bool write_webp(FileOut *f, const ImageOut *img, Err *err)
{
  if (img->width > WEBP_MAX_DIMENSION || img->height > WEBP_MAX_DIMENSION)
    return err_set(err, ERR_BAD_ARGUMENT,
                   "cannot write \"%s\": WebP holds at most %d pixels a side; write .png or .exr instead",
                   f->path, WEBP_MAX_DIMENSION);
  const uint32_t have = plane_channel_count(img->planes), channels = have == 2 || have >= 4 ? 4 : 3;
  uint8_t *pixels = display_pixels(channels, img, err);
  if (!pixels) return false;
  WebpTarget target = {f, err};
  WebPConfig config;
  WebPPicture picture;
  configure(&config, img->quality ? img->quality : 92);
  WebPPictureInit(&picture);
  picture.width = (int)img->width;
  picture.height = (int)img->height;
  picture.use_argb = config.lossless;
  picture.writer = put_bytes;
  picture.custom_ptr = &target;
  const int stride = picture.width * (int)channels;
  const bool ok = (channels == 4 ? WebPPictureImportRGBA : WebPPictureImportRGB)(&picture, pixels, stride) &&
                  WebPEncode(&config, &picture);
  if (!ok) err_set(err, ERR_IO, "cannot write \"%s\": libwebp reports error %d", f->path, picture.error_code);
  WebPPictureFree(&picture);
  mem_free(pixels);
  return ok;
}
#endif

const Format format_webp = {
    .name = "WebP",
    .extensions = {".webp"},
    .package = "libwebp-dev",
    .is_start = is_webp,
#if RAYFOLD_HAVE_WEBP
    .read = read_webp,
    .write = write_webp,
#endif
};
