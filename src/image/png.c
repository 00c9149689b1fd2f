// PNG by libpng. Stored types are kept: 8 or 16 bits, grey or colour, with alpha; palettes and fewer bits are
// expanded to 8. Gamma, profiles and animation are ignored. libpng reports by longjmp: everything a jump may cross
// lives in a struct of the caller's, never in a local of the function that calls setjmp.

#include "image/format.h"

#include "base/mem.h"

#include <string.h>

static bool is_png(const uint8_t *bytes, size_t size)
{
  return size >= 4 && !memcmp(bytes, "\x89PNG", 4);
}

#if RAYFOLD_HAVE_PNG
#include <png.h>

typedef struct PngJob {
  png_structp png;
  png_infop info;
  Err *err;
  const char *name;          // reading: the file's
  const uint8_t *next, *end; // reading: bytes not yet taken
  Image *image;              // reading: the result
  FileOut *file;             // writing: the target
  const ImageOut *out;       // writing: the picture
  void *row;                 // writing: owned
} PngJob;

static void on_read_error(png_structp png, png_const_charp message)
{
  PngJob *job = png_get_error_ptr(png);
  image_damaged(job->name, "PNG", message, job->err);
  png_longjmp(png, 1);
}

static void on_write_error(png_structp png, png_const_charp message)
{
  PngJob *job = png_get_error_ptr(png);
  err_set(job->err, ERR_IO, "cannot write \"%s\": %s", job->file->path, message);
  png_longjmp(png, 1);
}

static void on_warning(png_structp png, png_const_charp message)
{
  (void)png, (void)message;
}

static void take_bytes(png_structp png, png_bytep to, size_t size)
{
  PngJob *job = png_get_io_ptr(png);
  if (size > (size_t)(job->end - job->next)) png_error(png, "the end of the file comes too soon");
  memcpy(to, job->next, size);
  job->next += size;
}

static void put_bytes(png_structp png, png_bytep from, size_t size)
{
  PngJob *job = png_get_io_ptr(png);
  if (!file_write(job->file, from, size, job->err)) png_longjmp(png, 1);
}

static void put_flush(png_structp png)
{
  (void)png;
}

// --- reading --------------------------------------------------------------------------------------

// Deflate makes at most 1032 bytes out of one (zlib's technical notes), so a header that promises more than the file
// can hold is refused before anything is allocated for it.
static bool can_hold(const PngJob *job, uint32_t width, uint32_t height, uint32_t bits)
{
  const uint64_t stored = (uint64_t)height * (((uint64_t)width * bits + 7) / 8);
  return stored / 1032 <= (uint64_t)(job->end - job->next);
}

static bool read_header(PngJob *job)
{
  png_structp png = job->png;
  png_set_user_limits(png, 0x7fffffff, 0x7fffffff); // ours are asked next and explain themselves
  png_set_chunk_malloc_max(png, 8 << 20);
  png_read_info(png, job->info);
  const uint32_t width = png_get_image_width(png, job->info), height = png_get_image_height(png, job->info);
  const uint32_t bits = png_get_bit_depth(png, job->info);
  const uint32_t pixel_bits = bits * png_get_channels(png, job->info);
  if (!image_check_size(width, height, 1, PIXEL_U8, job->name, job->err)) return false;
  if (!can_hold(job, width, height, pixel_bits))
    return image_damaged(job->name, "PNG", "too few bytes for its size", job->err);
  png_set_expand(png);
  if (bits == 16 && __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__) png_set_swap(png);
  png_set_interlace_handling(png);
  png_read_update_info(png, job->info);
  return image_create(job->image, width, height, png_get_channels(png, job->info),
                      bits == 16 ? PIXEL_U16 : PIXEL_U8, job->name, job->err);
}

static bool decode(PngJob *job)
{
  if (setjmp(png_jmpbuf(job->png))) return false;
  png_set_read_fn(job->png, job, take_bytes);
  if (!read_header(job)) return false;
  const int passes = png_get_interlace_type(job->png, job->info) == PNG_INTERLACE_ADAM7 ? 7 : 1;
  for (int pass = 0; pass < passes; pass++)
    for (uint32_t y = 0; y < job->image->height; y++)
      png_read_row(job->png, image_pixel(job->image, 0, y), NULL);
  png_read_end(job->png, NULL);
  return true;
}

static bool read_png(Image *out, const uint8_t *bytes, size_t size, const char *name, Err *err)
{
  PngJob job = {.err = err, .name = name, .next = bytes, .end = bytes + size, .image = out};
  job.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &job, on_read_error, on_warning);
  job.info = job.png ? png_create_info_struct(job.png) : NULL;
  const bool ok = job.info ? decode(&job) : err_memory(err, name, 4096);
  png_destroy_read_struct(&job.png, &job.info, NULL);
  return ok;
}

// --- writing --------------------------------------------------------------------------------------

static void add_comment(PngJob *job)
{
  png_text text = {.key = (png_charp) "Comment", .text = (png_charp)(uintptr_t)job->out->comment};
  text.compression = PNG_TEXT_COMPRESSION_NONE;
  // tEXt is Latin-1; anything beyond ASCII goes into iTXt, which is UTF-8.
  for (const char *c = job->out->comment; *c; c++)
    if (*c & 0x80) text.compression = PNG_ITXT_COMPRESSION_NONE;
  png_set_text(job->png, job->info, &text, 1);
}

static bool encode(PngJob *job)
{
  static const int color_types[] = {0, PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA, PNG_COLOR_TYPE_RGB,
                                    PNG_COLOR_TYPE_RGB_ALPHA};
  if (setjmp(png_jmpbuf(job->png))) return false;
  const ImageOut *img = job->out;
  const uint32_t have = plane_channel_count(img->planes), channels = have < 4 ? have : 4;
  const int bits = img->bits == 16 ? 16 : 8;
  png_set_write_fn(job->png, job, put_bytes, put_flush);
  // Half the time of level 4 and a sixth of level 6 for files 16 % larger; other filters cost more than they save.
  png_set_compression_level(job->png, 2);
  png_set_filter(job->png, 0, PNG_FILTER_SUB);
  png_set_IHDR(job->png, job->info, img->width, img->height, bits, color_types[channels], PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_BASE, PNG_FILTER_TYPE_BASE);
  png_set_sRGB(job->png, job->info, PNG_sRGB_INTENT_PERCEPTUAL);
  if (img->comment) add_comment(job);
  png_write_info(job->png, job->info);
  if (bits == 16 && __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__) png_set_swap(job->png);
  for (uint32_t y = 0; y < img->height; y++) {
    if (bits == 16)
      display_row_u16(job->row, channels, img, y);
    else
      display_row_u8(job->row, channels, img, y);
    png_write_row(job->png, job->row);
  }
  png_write_end(job->png, NULL);
  return true;
}

static bool write_png(FileOut *f, const ImageOut *img, Err *err)
{
  PngJob job = {.err = err, .file = f, .out = img, .row = mem_alloc(img->width, 8)};
  job.png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &job, on_write_error, on_warning);
  job.info = job.png ? png_create_info_struct(job.png) : NULL;
  const bool ok = job.info && job.row ? encode(&job) : err_memory(err, f->path, 8 * (size_t)img->width);
  png_destroy_write_struct(&job.png, &job.info);
  mem_free(job.row);
  return ok;
}
#endif

const Format format_png = {
    .name = "PNG",
    .extensions = {".png"},
    .package = "libpng-dev",
    .is_start = is_png,
#if RAYFOLD_HAVE_PNG
    .read = read_png,
    .write = write_png,
#endif
};
