// JPEG by TurboJPEG. Grey stays one channel; CMYK and YCCK become RGB by the plain rule (light = what ink and black
// leave), without a colour profile. Orientation tags are ignored. A damaged file is an error, not a half picture.

#include "image/format.h"

#include "base/mem.h"

#include <string.h>

static bool is_jpeg(const uint8_t *bytes, size_t size)
{
  return size >= 3 && !memcmp(bytes, "\xff\xd8\xff", 3);
}

#if RAYFOLD_HAVE_JPEG
#include <turbojpeg.h>

// --- reading --------------------------------------------------------------------------------------

// Adobe's programs store CMYK inverted and leave a marker (APP14) that says so.
static bool has_adobe_marker(const uint8_t *bytes, size_t size)
{
  size_t at = 2;
  while (size - at >= 12 && bytes[at] == 0xff && bytes[at + 1] != 0xda) {
    if (bytes[at + 1] == 0xee && !memcmp(bytes + at + 4, "Adobe", 5)) return true;
    const size_t length = (size_t)bytes[at + 2] << 8 | bytes[at + 3];
    if (length + 2 > size - at) return false;
    at += length + 2;
  }
  return false;
}

static void rgb_from_cmyk(uint8_t *rgb, const uint8_t *cmyk, size_t count, bool is_inverted)
{
  const unsigned flip = is_inverted ? 0 : 255;
  for (size_t i = 0; i < count; i++, rgb += 3, cmyk += 4)
    for (int c = 0; c < 3; c++) rgb[c] = (uint8_t)(((cmyk[c] ^ flip) * (cmyk[3] ^ flip) + 127) / 255);
}

// Some cameras leave stray bytes or an odd version number; libjpeg warns of them and the picture is whole.
static bool is_harmless(tjhandle tj)
{
  const char *text = tjGetErrorStr2(tj);
  return tjGetErrorCode(tj) == TJERR_WARNING &&
         (strstr(text, "extraneous bytes") || strstr(text, "JFIF revision"));
}

static bool decode(tjhandle tj, uint8_t *to, int format, const Image *img, const uint8_t *bytes, size_t size,
                   const char *name, Err *err)
{
  // LIMITSCANS ends files of many thousand scans, which take minutes otherwise.
  const int flags = TJFLAG_ACCURATEDCT | TJFLAG_LIMITSCANS, width = (int)img->width,
            height = (int)img->height;
  if (!tjDecompress2(tj, bytes, size, to, width, 0, height, format, flags | TJFLAG_STOPONWARNING))
    return true;
  if (is_harmless(tj)) {
    if (!tjDecompress2(tj, bytes, size, to, width, 0, height, format, flags) || is_harmless(tj)) return true;
  }
  return image_damaged(name, "JPEG", tjGetErrorStr2(tj), err);
}

static bool read_cmyk(tjhandle tj, const Image *img, const uint8_t *bytes, size_t size, const char *name,
                      Err *err)
{
  const size_t count = (size_t)img->width * img->height;
  uint8_t *cmyk = mem_alloc(count, 4);
  const bool ok =
      cmyk ? decode(tj, cmyk, TJPF_CMYK, img, bytes, size, name, err) : err_memory(err, name, 4 * count);
  if (ok) rgb_from_cmyk(img->pixels, cmyk, count, has_adobe_marker(bytes, size));
  mem_free(cmyk);
  return ok;
}

static bool read_jpeg_with(tjhandle tj, Image *out, const uint8_t *bytes, size_t size, const char *name,
                           Err *err)
{
  int width = 0, height = 0, sampling = 0, space = -1;
  // An unusual sampling makes this fail with size and space known, which is enough to decode.
  if (tjDecompressHeader3(tj, bytes, size, &width, &height, &sampling, &space) &&
      (width <= 0 || height <= 0 || space < 0))
    return image_damaged(name, "JPEG", tjGetErrorStr2(tj), err);
  const bool is_grey = space == TJCS_GRAY, is_cmyk = space == TJCS_CMYK || space == TJCS_YCCK;
  if (!image_check_size((uint64_t)width, (uint64_t)height,
                        is_grey   ? 1
                        : is_cmyk ? 4
                                  : 3,
                        PIXEL_U8, name, err))
    return false;
  // A block of 64 pixels takes a bit at least, or a fraction of one with arithmetic coding.
  if ((uint64_t)width * (uint64_t)height / 2048 > size)
    return image_damaged(name, "JPEG", "too few bytes for its size", err);
  if (!image_create(out, (uint64_t)width, (uint64_t)height, is_grey ? 1 : 3, PIXEL_U8, name, err))
    return false;
  if (is_cmyk) return read_cmyk(tj, out, bytes, size, name, err);
  return decode(tj, out->pixels, is_grey ? TJPF_GRAY : TJPF_RGB, out, bytes, size, name, err);
}

static bool read_jpeg(Image *out, const uint8_t *bytes, size_t size, const char *name, Err *err)
{
  tjhandle tj = tjInitDecompress();
  if (!tj) return err_memory(err, name, 1 << 16);
  const bool ok = read_jpeg_with(tj, out, bytes, size, name, err);
  tjDestroy(tj);
  return ok;
}

// --- writing --------------------------------------------------------------------------------------

// TurboJPEG cannot write a comment (COM), so one is put behind the JFIF header, which must stay first.
static bool write_with_comment(FileOut *f, const uint8_t *bytes, size_t size, const char *comment, Err *err)
{
  enum { MOST = 65533 };
  const size_t head = size > 6 && bytes[3] == 0xe0 ? 4 + ((size_t)bytes[4] << 8 | bytes[5]) : 2;
  const size_t length = comment ? strnlen(comment, MOST) : 0, stored = length + 2;
  const uint8_t marker[4] = {0xff, 0xfe, (uint8_t)(stored >> 8), (uint8_t)stored};
  return file_write(f, bytes, head, err) &&
         (!length || (file_write(f, marker, sizeof marker, err) && file_write(f, comment, length, err))) &&
         file_write(f, bytes + head, size - head, err);
}

static bool write_jpeg(FileOut *f, const ImageOut *img, Err *err)
{
  const bool is_grey = plane_channel_count(img->planes) < 3;
  const int quality = img->quality ? img->quality : 92;
  const int sampling = is_grey ? TJSAMP_GRAY : quality >= 90 ? TJSAMP_444 : TJSAMP_420;
  bool ok = false;
  unsigned char *bytes = NULL; // TurboJPEG's
  unsigned long size = 0;
  uint8_t *pixels = display_pixels(is_grey ? 1 : 3, img, err);
  tjhandle tj = tjInitCompress();
  if (!pixels || !tj) {
    err_memory(err, f->path, (size_t)img->width * img->height);
    goto done;
  }
  if (tjCompress2(tj, pixels, (int)img->width, 0, (int)img->height, is_grey ? TJPF_GRAY : TJPF_RGB, &bytes,
                  &size, sampling, quality, TJFLAG_ACCURATEDCT)) {
    err_set(err, ERR_IO, "cannot write \"%s\": %s", f->path, tjGetErrorStr2(tj));
    goto done;
  }
  ok = write_with_comment(f, bytes, size, img->comment, err);
done:
  tjFree(bytes);
  if (tj) tjDestroy(tj);
  mem_free(pixels);
  return ok;
}
#endif

const Format format_jpeg = {
    .name = "JPEG",
    .extensions = {".jpg", ".jpeg"},
    .package = "libturbojpeg0-dev",
    .is_start = is_jpeg,
#if RAYFOLD_HAVE_JPEG
    .read = read_jpeg,
    .write = write_jpeg,
#endif
};
