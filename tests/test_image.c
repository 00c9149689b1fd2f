// The image room: colour codes against their formulas, every format written and read back, files made by other
// programs, and what damaged or hostile files may do (nothing but fail). A format this build lacks is skipped.
//
// The pictures in tests/data/image are 24 x 17 pixels of colour_at(), made by ImageMagick 6.9, ffmpeg 5.1 and the
// C++ library of OpenEXR 3.1; the latter hold linear_at().

#include "tests/test.h"

#include "base/file.h"
#include "base/hash.h"
#include "base/mem.h"
#include "base/text.h"
#include "image/image.h"

#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

enum { WIDTH = 24, HEIGHT = 17 };

static const char *const test_files[] = {
    "alpha.webp",   "b44.exr",      "cmyk.jpg", "colours.bmp",     "colours.gif",  "colours.hdr",
    "colours.tga",  "deep.exr",     "dwaa.exr", "grey.jpg",        "grey1.png",    "grey16.png",
    "lossy.webp",   "palette.png",  "piz.exr",  "progressive.jpg", "pxr24.exr",    "rle.exr",
    "scan.exr",     "tiled.exr",    "zips.exr", "interlaced.png",  "sampling.jpg", "small.psd",
    "old_runs.hdr", "grey_uint.exr"};
enum { TEST_FILE_COUNT = sizeof test_files / sizeof *test_files };

static const char *data_path(const char *name)
{
  static char path[200];
  snprintf(path, sizeof path, "tests/data/image/%s", name);
  return path;
}

static const char *temp_path(const char *name)
{
  static char path[200];
  const char *folder = getenv("TMPDIR");
  snprintf(path, sizeof path, "%s/rayfold-test-%d-%s", folder ? folder : "/tmp", (int)getpid(), name);
  return path;
}

// Whether this build reads and writes the format.
static bool is_built(const char *extension)
{
  char name[40];
  bool is_linear;
  snprintf(name, sizeof name, "x%s", extension);
  return image_format(name, &is_linear, NULL);
}

static bool is_stb_built(void)
{
#if RAYFOLD_HAVE_STB
  return true;
#else
  return false;
#endif
}

static bool is_file_built(const char *name)
{
  const char *extension = path_extension(name);
  return strcmp(".bmp.tga.gif.psd", extension) && strstr(".bmp.tga.gif.psd", extension) ? is_stb_built()
                                                                                        : is_built(extension);
}

static int colour_at(int x, int y, int c)
{
  return c == 0 ? x * 255 / 23 : c == 1 ? y * 255 / 16 : c == 2 ? (x * 7 + y * 13) % 256 : x * 11 % 256;
}

static float linear_at(int x, int y, int c)
{
  return c == 0   ? (float)x * 0.25f
         : c == 1 ? (float)y * 0.5f
         : c == 2 ? (float)(x + y) * 0.125f
                  : 1 - (float)x / 32;
}

// --- colour ---------------------------------------------------------------------------------------

static double decode_exactly(double v)
{
  return v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4);
}
static double encode_exactly(double x)
{
  return x <= 0.0031308 ? x * 12.92 : 1.055 * pow(x, 1 / 2.4) - 0.055;
}

TEST(srgb_is_exact_for_8_bit)
{
  for (int i = 0; i < 256; i++) {
    CHECK_MSG(srgb_from_u8[i] == (float)decode_exactly(i / 255.0), "code %d", i);
    CHECK(srgb_to_u8(srgb_from_u8[i]) == i);
    CHECK_NEAR(srgb_decode((float)i / 255), srgb_from_u8[i], 1e-6);
  }
  CHECK(srgb_to_u8(-1) == 0 && srgb_to_u8(NAN) == 0 && srgb_to_u8(INFINITY) == 255 && srgb_to_u8(2) == 255);
  CHECK(srgb_encode(-1) == 0 && srgb_encode(NAN) == 0 && srgb_encode(INFINITY) == 1);
}

TEST(srgb_rounds_as_the_formula)
{
  for (int i = 0; i < 255; i++) { // both sides of every step
    const float edge = (float)decode_exactly((i + 0.5) / 255);
    for (float x = edge * 0.999999f; x < edge * 1.000001f; x = nextafterf(x, 2)) {
      const double exact = 255 * encode_exactly((double)x);
      if (fabs(exact - floor(exact) - 0.5) > 1e-9)
        CHECK_MSG(srgb_to_u8(x) == (int)(exact + 0.5), "%.9g", (double)x);
    }
  }
  for (uint32_t i = 0; i < 100000; i++) {
    const float x = unit_float(hash_u32(i)) * unit_float(hash_u32(~i));
    CHECK_MSG(srgb_to_u8(x) == (int)(255 * encode_exactly((double)x) + 0.5), "%.9g", (double)x);
    CHECK_NEAR(srgb_encode(x), encode_exactly((double)x), 2e-7);
  }
}

TEST(halves_survive_floats)
{
  for (uint32_t h = 0; h < 65536; h++) {
    const float x = half_to_float((uint16_t)h);
    const int exponent = (int)(h >> 10 & 31), fraction = (int)(h & 1023);
    const double size = exponent ? ldexp(1024 + fraction, exponent - 25) : ldexp(fraction, -24);
    if (exponent == 31)
      CHECK(fraction ? x != x : isinf(x));
    else
      CHECK_MSG((double)fabsf(x) == size, "half %04x gives %g", h, (double)x);
    CHECK(!signbit(x) == !(h & 0x8000));
    const uint16_t back = half_from_float(x);
    CHECK_MSG(back == h || (exponent == 31 && fraction && back == (h | 0x200)), "%04x gives %04x", h, back);
  }
}

TEST(halves_round_to_nearest_even)
{
  for (uint32_t h = 0; h < 0x7bff; h++) {
    const float low = half_to_float((uint16_t)h), high = half_to_float((uint16_t)(h + 1)),
                middle = (low + high) / 2;
    CHECK(half_from_float(middle) == h + (h & 1));
    CHECK(half_from_float(nextafterf(middle, 0)) == h);
    CHECK(half_from_float(nextafterf(middle, 1e9f)) == h + 1);
    CHECK(half_from_float(-middle) == (0x8000 | (h + (h & 1))));
  }
  CHECK(half_from_float(65519.996f) == 0x7bff && half_from_float(65520) == 0x7c00 &&
        half_from_float(3e38f) == 0x7c00);
  CHECK(half_from_float(1e-30f) == 0 && half_from_float(-1e-30f) == 0x8000);
}

// --- round trips ----------------------------------------------------------------------------------

typedef struct Picture {
  float pixels[HEIGHT * WIDTH * 4];
  Plane plane;
  ImageOut out;
} Picture;

// Linear values 0..gain, the same for the same place.
static void make_picture(Picture *p, const char *channels, float gain)
{
  const size_t count = strlen(channels);
  for (size_t i = 0; i < HEIGHT * WIDTH * count; i++) p->pixels[i] = unit_float(hash_u32((uint32_t)i)) * gain;
  p->plane = (Plane){.name = "", .channels = channels, .pixels = p->pixels};
  p->out = (ImageOut){.width = WIDTH, .height = HEIGHT, .planes = &p->plane, .plane_count = 1};
}

static bool write_and_read(Image *back, const Picture *p, const char *extension)
{
  char name[40];
  snprintf(name, sizeof name, "trip%s", extension);
  const char *path = temp_path(name);
  Err err = {0};
  const bool ok = image_write(path, &p->out, &err) && image_read(back, path, &err);
  CHECK_MSG(ok, "%s", err.text);
  if (ok) CHECK(back->width == WIDTH && back->height == HEIGHT);
  unlink(path);
  return ok;
}

TEST(png_keeps_every_code)
{
  static Picture p;
  Image back;
  if (!is_built(".png")) return;
  for (int channels = 1; channels <= 4; channels++) {
    make_picture(&p, &"RGBA"[4 - channels], 1);
    for (int i = 0; i < HEIGHT * WIDTH * channels; i++) {
      const bool is_alpha = (channels == 2 || channels == 4) && i % channels == channels - 1;
      p.pixels[i] = is_alpha ? (float)(i * 5 % 256) / 255 : srgb_from_u8[i * 7 % 256];
    }
    if (!write_and_read(&back, &p, ".png")) return;
    CHECK(back.type == PIXEL_U8 && back.channels == (uint32_t)channels);
    for (int i = 0; i < HEIGHT * WIDTH * channels; i++) {
      const bool is_alpha = (channels == 2 || channels == 4) && i % channels == channels - 1;
      CHECK(((uint8_t *)back.pixels)[i] == (is_alpha ? i * 5 % 256 : i * 7 % 256));
    }
    image_finish(&back);
  }
}

TEST(png_of_16_bit_is_exact)
{
  static Picture p;
  Image back;
  if (!is_built(".png")) return;
  make_picture(&p, "RGB", 1);
  for (int i = 0; i < HEIGHT * WIDTH * 3; i++)
    p.pixels[i] = (float)decode_exactly((double)(i * 53 % 65536) / 65535);
  p.out.bits = 16;
  if (!write_and_read(&back, &p, ".png")) return;
  CHECK(back.type == PIXEL_U16 && back.channels == 3);
  for (int i = 0; i < HEIGHT * WIDTH * 3; i++) CHECK(((uint16_t *)back.pixels)[i] == i * 53 % 65536);
  image_finish(&back);
}

// The largest difference of encoded values, for smooth content (codecs do not like noise).
static float smooth_difference(const char *extension, int quality, const char *channels)
{
  static Picture p;
  Image back;
  float most = 0;
  make_picture(&p, channels, 1);
  const int count = (int)strlen(channels);
  for (int y = 0; y < HEIGHT; y++)
    for (int x = 0; x < WIDTH; x++)
      for (int c = 0; c < count; c++)
        p.pixels[(y * WIDTH + x) * count + c] =
            srgb_decode(0.2f + 0.02f * (float)x + 0.01f * (float)(y * (c + 1)));
  p.out.quality = quality;
  if (!write_and_read(&back, &p, extension)) return 1;
  const bool is_grey = back.channels == 1;
  for (uint32_t y = 0; y < HEIGHT; y++)
    for (uint32_t x = 0; x < WIDTH; x++)
      for (uint32_t c = 0; c < back.channels; c++) {
        const float there = p.pixels[((int)y * WIDTH + (int)x) * count + (is_grey ? 0 : (int)c)];
        const float expected = c == 3 ? fminf(there, 1) : srgb_encode(there);
        most = fmaxf(most, fabsf(image_value(&back, x, y, c) - expected));
      }
  image_finish(&back);
  return most;
}

TEST(lossy_formats_come_close)
{
  if (is_built(".jpg")) {
    CHECK(smooth_difference(".jpg", 0, "RGB") < 0.02f);
    CHECK(smooth_difference(".JPEG", 100, "RGB") < 0.01f);
    CHECK(smooth_difference(".jpg", 50, "RGBA") < 0.1f);
    CHECK(smooth_difference(".jpg", 95, "I") < 0.01f);
  }
  if (is_built(".webp")) {
    CHECK(smooth_difference(".webp", 0, "RGB") < 0.04f);
    CHECK(smooth_difference(".webp", 100, "RGB") < 0.5f / 255 + 1e-6f);
    CHECK(smooth_difference(".webp", 100, "RGBA") < 0.5f / 255 + 1e-6f);
  }
}

TEST(jpeg_quality_changes_the_size)
{
  static Picture p;
  if (!is_built(".jpg")) return;
  long size[2];
  for (int i = 0; i < 2; i++) {
    make_picture(&p, "RGB", 1);
    p.out.quality = i ? 90 : 40;
    struct stat st = {0};
    const char *path = temp_path("quality.jpg");
    CHECK(image_write(path, &p.out, NULL) && !stat(path, &st));
    size[i] = (long)st.st_size;
    unlink(path);
  }
  CHECK(size[0] < size[1]);
}

TEST(pfm_and_exr_of_32_bit_are_exact)
{
  static const float odd[] = {-1.5f, 1e-40f, 3e38f, INFINITY, 0};
  static const char *const extensions[] = {".pfm", ".exr"};
  static Picture p;
  Image back;
  for (int i = 0; i < 2; i++) {
    if (!is_built(extensions[i])) continue;
    make_picture(&p, "RGB", 1000);
    memcpy(p.pixels + 100, odd, sizeof odd);
    p.out.bits = 32;
    if (!write_and_read(&back, &p, extensions[i])) continue;
    CHECK(back.type == PIXEL_F32 && back.channels == 3);
    CHECK(!memcmp(back.pixels, p.pixels, sizeof(float) * HEIGHT * WIDTH * 3));
    image_finish(&back);
  }
  make_picture(&p, "Z", 7);
  if (write_and_read(&back, &p, ".pfm")) {
    CHECK(back.channels == 1 && !memcmp(back.pixels, p.pixels, sizeof(float) * HEIGHT * WIDTH));
    image_finish(&back);
  }
}

TEST(exr_of_16_bit_is_the_nearest_half)
{
  static Picture p;
  Image back;
  if (!is_built(".exr")) return;
  make_picture(&p, "RGBA", 100);
  if (!write_and_read(&back, &p, ".exr")) return;
  CHECK(back.type == PIXEL_F16 && back.channels == 4);
  for (int i = 0; i < HEIGHT * WIDTH * 4; i++)
    CHECK(((uint16_t *)back.pixels)[i] == half_from_float(p.pixels[i]));
  image_finish(&back);
}

TEST(exr_holds_all_planes)
{
  static float colour[40 * 50 * 3], depth[40 * 50], normal[40 * 50 * 3];
  if (!is_built(".exr")) return;
  for (int i = 0; i < 40 * 50 * 3; i++) {
    colour[i] = (float)(i % 100);
    normal[i] = (float)(i % 7) / 8;
    depth[i / 3] = (float)i + 1.0f / 3;
  }
  const Plane planes[] = {
      {.name = "normal", .channels = "XYZ", .pixels = normal},
      {.name = "", .channels = "RGB", .pixels = colour},
      {.name = "depth_of_a_name_longer_than_31_bytes", .channels = "Y", .pixels = depth, .is_exact = true}};
  ImageOut out = {.width = 50, .height = 40, .planes = planes, .plane_count = 3, .comment = "made by a test"};
  const char *path = temp_path("planes.exr");
  Err err = {0};
  Image back;
  CHECK_MSG(image_write(path, &out, &err), "%s", err.text);
  CHECK_MSG(image_read(&back, path, &err), "%s", err.text); // the unnamed layer, among others
  CHECK(back.type == PIXEL_F16 && back.channels == 3);
  for (uint32_t i = 0; i < 40 * 50 * 3; i++)
    CHECK(image_value(&back, i / 3 % 50, i / 150, i % 3) == colour[i]);
  image_finish(&back);

  out.planes = planes + 2; // a depth by itself stays exact, and its layer is found
  out.plane_count = 1;
  CHECK(image_write(path, &out, &err) && image_read(&back, path, &err));
  CHECK(back.type == PIXEL_F32 && back.channels == 1 && !memcmp(back.pixels, depth, sizeof depth));
  image_finish(&back);

  out.planes = planes;
  CHECK(image_write(path, &out, &err));
  CHECK(!image_read(&back, path, &err)); // X, Y and Z are no colours
  CHECK_TEXT(err.text, "normal.X");
  unlink(path);
}

TEST(hdr_keeps_seven_bits_of_the_brightest)
{
  static Picture p;
  Image back;
  for (int round = 0; round < 3; round++) {
    make_picture(&p, "RGB", round == 0 ? 1 : round == 1 ? 1e30f : 1e-30f);
    for (int i = 0; i < 60; i++) p.pixels[300 + i] = p.pixels[300]; // runs
    if (!write_and_read(&back, &p, ".hdr")) return;
    CHECK(back.type == PIXEL_F32 && back.channels == 3);
    for (int i = 0; i < HEIGHT * WIDTH; i++) {
      const float *a = p.pixels + (size_t)i * 3, *b = (const float *)back.pixels + (size_t)i * 3;
      const float most = fmaxf(a[0], fmaxf(a[1], a[2]));
      for (int c = 0; c < 3; c++) CHECK_NEAR(a[c], b[c], most / 256 * 1.0001f);
    }
    memcpy(p.pixels, back.pixels, sizeof(float) * HEIGHT * WIDTH * 3); // the second time nothing is lost
    image_finish(&back);
    if (!write_and_read(&back, &p, ".hdr")) return;
    CHECK(!memcmp(p.pixels, back.pixels, sizeof(float) * HEIGHT * WIDTH * 3));
    image_finish(&back);
  }
}

TEST(hdr_of_odd_values_and_widths)
{
  const float values[] = {NAN, -1, INFINITY, 0, 1e-45f, 0.999f, 0, 0, 0};
  const Plane plane = {.name = "", .channels = "RGB", .pixels = values};
  const ImageOut out = {.width = 3, .height = 1, .planes = &plane, .plane_count = 1}; // too narrow for runs
  const char *path = temp_path("odd.hdr");
  Err err = {0};
  Image back = {0};
  CHECK(image_write(path, &out, &err) && image_read(&back, path, &err));
  CHECK(image_value(&back, 0, 0, 0) == 0 && image_value(&back, 0, 0, 1) == 0);
  CHECK(image_value(&back, 0, 0, 2) > 1e38f && isfinite(image_value(&back, 0, 0, 2)));
  CHECK_NEAR(image_value(&back, 1, 0, 2), 0.999, 0.002);
  image_finish(&back);
  unlink(path);
}

TEST(comments_are_stored)
{
  static const char *const extensions[] = {".png", ".jpg", ".exr", ".hdr"};
  static Picture p;
  make_picture(&p, "RGB", 1);
  p.out.comment = "seed 17\nspp 4";
  for (int i = 0; i < 4; i++) {
    if (!is_built(extensions[i])) continue;
    char name[40];
    snprintf(name, sizeof name, "comment%s", extensions[i]);
    const char *path = temp_path(name);
    FileBytes f = {0};
    Image back;
    Err err = {0};
    CHECK(image_write(path, &p.out, NULL) && file_read(&f, path, NULL));
    CHECK_MSG(f.data && memmem(f.data, f.size, "seed 17", 7), "%s", extensions[i]);
    CHECK_MSG(image_read_bytes(&back, f.data, f.size, path, &err), "%s", err.text);
    image_finish(&back);
    file_release(&f);
    unlink(path);
  }
}

// --- files of other programs ----------------------------------------------------------------------

// Reads a test picture and checks its form; *img is to be finished. False when this build cannot.
static bool open_picture(Image *img, const char *name, uint32_t channels, PixelType type)
{
  *img = (Image){0};
  if (!is_file_built(name)) return false;
  Err err = {0};
  const bool ok = image_read(img, data_path(name), &err);
  CHECK_MSG(ok, "%s", err.text);
  CHECK_MSG(!ok || (img->channels == channels && img->type == type), "%s: %u channels", name, img->channels);
  return ok && img->channels == channels && img->type == type;
}

// At most `most` codes off anywhere and `mean` on average.
static void check_colours(const char *name, uint32_t channels, int most, int mean)
{
  Image img;
  if (!open_picture(&img, name, channels, PIXEL_U8)) return;
  CHECK(img.width <= WIDTH && img.height <= HEIGHT);
  int worst = 0, sum = 0;
  for (uint32_t y = 0; y < img.height; y++)
    for (uint32_t x = 0; x < img.width; x++)
      for (uint32_t c = 0; c < 3; c++) {
        const int got = (int)lroundf(image_value(&img, x, y, c) * 255);
        const int off = abs(got - colour_at((int)x, (int)y, (int)c));
        if (off > worst) worst = off;
        sum += off;
      }
  sum /= (int)(img.width * img.height * 3);
  CHECK_MSG(worst <= most && sum <= mean, "%s is off by up to %d codes, %d on average", name, worst, sum);
  image_finish(&img);
}

TEST(pictures_of_other_programs_are_read)
{
  check_colours("interlaced.png", 3, 0, 0);
  check_colours("colours.bmp", 3, 0, 0);
  check_colours("colours.tga", 3, 0, 0);
  check_colours("small.psd", 4, 0, 0);
  check_colours("colours.gif", 4, 30, 5); // 256 colours
  check_colours("progressive.jpg", 3, 16, 2);
  check_colours("cmyk.jpg", 3, 16, 2);
  check_colours("sampling.jpg", 3, 255, 12); // colours at an eighth: the saw-teeth of blue suffer
  check_colours("lossy.webp", 3, 255, 12);
}

TEST(png_variants_are_expanded)
{
  Image img;
  if (open_picture(&img, "grey16.png", 1, PIXEL_U16)) {
    for (uint32_t i = 0; i < WIDTH * HEIGHT; i++)
      CHECK(((uint16_t *)img.pixels)[i] == (i % WIDTH * 2000 + i / WIDTH * 701) % 65536);
    image_finish(&img);
  }
  if (open_picture(&img, "grey1.png", 1, PIXEL_U8)) {
    for (uint32_t i = 0; i < WIDTH * HEIGHT; i++)
      CHECK(((uint8_t *)img.pixels)[i] == ((i % WIDTH + i / WIDTH) % 2 ? 0 : 255));
    image_finish(&img);
  }
  if (open_picture(&img, "palette.png", 4, PIXEL_U8)) {
    for (uint32_t y = 0; y < HEIGHT; y++)
      for (uint32_t x = 0; x < WIDTH; x++) {
        const uint8_t *p = (uint8_t *)img.pixels + (y * WIDTH + x) * 4;
        const uint32_t k = (x + y) % 4;
        if (k == 3)
          CHECK(p[3] == 0);
        else
          CHECK(p[0] == k * 85 && p[1] == x / 6 * 60 && p[2] == 7 && p[3] == 255);
      }
    image_finish(&img);
  }
}

TEST(webp_alpha_and_grey_jpeg_are_read)
{
  Image img;
  if (open_picture(&img, "alpha.webp", 4, PIXEL_U8)) {
    for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) {
      const uint8_t *p = (uint8_t *)img.pixels + i * 4;
      CHECK(p[3] == colour_at((int)(i % WIDTH), 0, 3));
      for (int c = 0; p[3] && c < 3; c++) CHECK(p[c] == colour_at((int)(i % WIDTH), (int)(i / WIDTH), c));
    }
    image_finish(&img);
  }
  if (open_picture(&img, "grey.jpg", 1, PIXEL_U8)) {
    for (uint32_t i = 0; i < WIDTH * HEIGHT; i++)
      CHECK_NEAR(((uint8_t *)img.pixels)[i], i % WIDTH * 10 + i / WIDTH, 2);
    image_finish(&img);
  }
}

TEST(hdr_runs_old_and_new_are_read)
{
  Image img;
  if (open_picture(&img, "colours.hdr", 3, PIXEL_F32)) {
    for (uint32_t y = 0; y < HEIGHT; y++)
      for (uint32_t x = 0; x < WIDTH; x++)
        for (uint32_t c = 0; c < 3; c++)
          CHECK_NEAR(image_value(&img, x, y, c), colour_at((int)x, (int)y, (int)c) / 255.0,
                     1.0 / 128); // cut, not rounded
    image_finish(&img);
  }
  // Written by hand: +Y -X, so from the lower right corner; one row of 300 pixels with a count of two bytes.
  if (open_picture(&img, "old_runs.hdr", 3, PIXEL_F32)) {
    CHECK(img.width == 300 && img.height == 2);
    CHECK(image_value(&img, 299, 1, 0) == 1 && image_value(&img, 0, 1, 0) == 1);
    CHECK(image_value(&img, 299, 0, 1) == 0.5f && image_value(&img, 1, 0, 1) == 0.5f);
    CHECK(image_value(&img, 0, 0, 2) == 2 && image_value(&img, 0, 0, 1) == 0);
    image_finish(&img);
  }
}

// The layer "diffuse" in a data window from (-3, -2) to (20, 14), shown from (0, 0) to (19, 15).
static void check_layer(const char *name, float tolerance)
{
  Image img;
  if (!open_picture(&img, name, 3, PIXEL_F16)) return;
  CHECK(img.width == 20 && img.height == 16);
  for (int y = 0; y < 16; y++)
    for (int x = 0; x < 20; x++)
      for (int c = 0; c < 3; c++)
        CHECK_NEAR(image_value(&img, (uint32_t)x, (uint32_t)y, (uint32_t)c),
                   y + 2 < HEIGHT ? linear_at(x + 3, y + 2, c) : 0, tolerance);
  image_finish(&img);
}

TEST(exr_windows_layers_and_compressions)
{
  check_layer("zips.exr", 0);
  check_layer("rle.exr", 0);
  check_layer("piz.exr", 0);
  check_layer("pxr24.exr", 0);
  check_layer("b44.exr", 0.3f); // lossy
}

TEST(exr_of_tiles_integers_and_ffmpeg)
{
  Image img;
  if (open_picture(&img, "tiled.exr", 4, PIXEL_F16)) {
    for (int y = 0; y < HEIGHT; y++)
      for (int x = 0; x < WIDTH; x++)
        for (int c = 0; c < 4; c++)
          CHECK(image_value(&img, (uint32_t)x, (uint32_t)y, (uint32_t)c) == linear_at(x, y, c));
    image_finish(&img);
  }
  if (open_picture(&img, "grey_uint.exr", 1, PIXEL_F32)) { // rows stored from the bottom
    for (uint32_t i = 0; i < WIDTH * HEIGHT; i++)
      CHECK(((float *)img.pixels)[i] == (float)(i % WIDTH * 1000 + i / WIDTH));
    image_finish(&img);
  }
  if (open_picture(&img, "scan.exr", 3, PIXEL_F16)) {
    for (uint32_t y = 0; y < HEIGHT; y++)
      for (uint32_t x = 0; x < WIDTH; x++)
        for (uint32_t c = 0; c < 3; c++)
          CHECK_NEAR(image_value(&img, x, y, c), colour_at((int)x, (int)y, (int)c) / 255.0,
                     1.0 / 220); // ffmpeg scales by 255 / 256 and cuts
    image_finish(&img);
  }
}

TEST(exr_that_cannot_be_read_is_explained)
{
  Image img;
  Err err = {0};
  if (!is_built(".exr")) return;
  CHECK(!image_read(&img, data_path("deep.exr"), &err));
  CHECK_TEXT(err.text, "deep OpenEXR pictures are not read");
  err = (Err){0};
  // OpenEXRCore learns this compression with 3.1.10.
  if (!image_read(&img, data_path("dwaa.exr"), &err))
    CHECK_TEXT(err.text, "save it with another compression");
  image_finish(&img);
}

// --- hostile files --------------------------------------------------------------------------------

static double seconds(void)
{
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + (double)t.tv_nsec * 1e-9;
}

// Reads from memory of just that size, so that a sanitizer sees any step beyond it.
static bool read_exactly(const uint8_t *bytes, size_t size, Err *err)
{
  uint8_t *copy = malloc(size ? size : 1);
  memcpy(copy, bytes, size);
  Image img;
  *err = (Err){0};
  const bool ok = image_read_bytes(&img, copy, size, "broken", err);
  if (ok) {
    volatile float last = image_value(&img, img.width - 1, img.height - 1, img.channels - 1);
    (void)last;
  } else {
    CHECK(!img.pixels && err->kind != ERR_NONE && strstr(err->text, "broken"));
  }
  image_finish(&img);
  free(copy);
  return ok;
}

TEST(truncated_files_fail_cleanly)
{
  Err err;
  for (int i = 0; i < TEST_FILE_COUNT; i++) {
    FileBytes f;
    if (!is_file_built(test_files[i])) continue;
    CHECK(file_read(&f, data_path(test_files[i]), NULL));
    const char *extension = path_extension(test_files[i]);
    // Other formats, and mip levels, may end in bytes that carry no picture.
    const bool needs_all = strstr(".png.jpg.hdr", extension) || !strcmp(test_files[i], "scan.exr");
    for (size_t size = 0; size < f.size; size++) {
      const bool ok = read_exactly(f.data, size, &err);
      CHECK_MSG(!ok || !needs_all, "%s cut to %zu bytes is read", test_files[i], size);
    }
    file_release(&f);
  }
  static Picture p;
  make_picture(&p, "RGB", 1);
  const char *path = temp_path("cut.pfm");
  FileBytes f;
  CHECK(image_write(path, &p.out, NULL) && file_read(&f, path, NULL));
  for (size_t size = 0; size < f.size; size += size < 40 ? 1 : 97) CHECK(!read_exactly(f.data, size, &err));
  file_release(&f);
  unlink(path);
}

static void flip_bytes(const FileBytes *f, uint32_t seed, int count)
{
  Err err;
  uint8_t *bytes = malloc(f->size);
  for (int i = 0; i < count; i++) {
    memcpy(bytes, f->data, f->size);
    uint32_t r = hash_combine(seed, (uint32_t)i);
    for (uint32_t n = 1 + r % 3; n; n--) {
      r = hash_u32(r + n);
      // Heads decide most, so every other byte is among the first 64.
      const size_t at = (r & 1 && f->size > 64 ? r >> 9 & 63 : (r >> 9) % f->size);
      bytes[at] = (uint8_t)(hash_u32(r) >> 5);
    }
    read_exactly(bytes, f->size, &err);
  }
  free(bytes);
}

TEST(random_bytes_do_no_harm)
{
  for (int i = 0; i < TEST_FILE_COUNT; i++) {
    FileBytes f;
    if (!is_file_built(test_files[i])) continue;
    CHECK(file_read(&f, data_path(test_files[i]), NULL));
    flip_bytes(&f, (uint32_t)i, 2000);
    file_release(&f);
  }
  uint8_t noise[300];
  Err err;
  for (uint32_t i = 0; i < 2000; i++) {
    for (uint32_t k = 0; k < sizeof noise; k++) noise[k] = (uint8_t)hash_combine(i, k);
    CHECK(!read_exactly(noise, i % sizeof noise, &err) || is_stb_built()); // TGA has no mark
  }
}

TEST(huge_promises_are_refused_at_once)
{
  // A head of 65535 x 65535 pixels with its right checksum, and the beginning of the data.
  static const uint8_t png[] = "\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR\0\0\xff\xff\0\0\xff\xff\x08\x06\0\0\0"
                               "\xb6\x05\xd9\x50\0\0\0\x0aIDATx";
  static const char pfm[] = "PF\n40000 2\n-1.0\nxxxxxxxx", empty[] = "PF\n0 2\n-1.0\nxxxxxxxx";
  static const char large_hdr[] = "#?RADIANCE\n\n-Y 30000 +X 30000\nxxxxxxxxxxxxxxxxxxxxx";
  static const char thin_hdr[] = "#?RADIANCE\n\n-Y 9000 +X 9000\nxxxxxxxxxxxxxxxxxxxxx";
  Err err;
  const double start = seconds();
  if (is_built(".png")) {
    CHECK(!read_exactly(png, sizeof png, &err));
    CHECK_TEXT(err.text, "too large (65535 x 65535");
    CHECK_TEXT(err.text, "at most 32768 pixels a side");
  }
  CHECK(!read_exactly((const uint8_t *)pfm, sizeof pfm - 1, &err));
  CHECK_TEXT(err.text, "too large (40000 x 2");
  CHECK(!read_exactly((const uint8_t *)empty, sizeof empty - 1, &err));
  CHECK_TEXT(err.text, "the picture is empty");
  CHECK(!read_exactly((const uint8_t *)large_hdr, sizeof large_hdr - 1, &err));
  CHECK_TEXT(err.text, "MB in all");
  CHECK(!read_exactly((const uint8_t *)thin_hdr, sizeof thin_hdr - 1, &err));
  CHECK_TEXT(err.text, "too few bytes");
  CHECK(seconds() - start < 1);
}

TEST(memory_may_run_out_anywhere)
{
  for (int i = 0; i < TEST_FILE_COUNT; i++) {
    if (!is_file_built(test_files[i])) continue;
    Err err = {0};
    bool ok = false;
    for (long n = 1; n < 200 && !ok; n++) {
      Image img;
      err = (Err){0};
      mem_fail_after(n);
      ok = image_read(&img, data_path(test_files[i]), &err);
      mem_fail_after(0);
      CHECK(ok || err.kind != ERR_NONE);
      image_finish(&img);
      if (!ok && strstr(err.text, "not read")) break; // deep
      if (!ok && strstr(err.text, "another compression")) break;
    }
    CHECK_MSG(ok || strstr(err.text, "not read") || strstr(err.text, "another compression"), "%s: %s",
              test_files[i], err.text);
  }
}

// --- targets --------------------------------------------------------------------------------------

static const char *const extensions[] = {".png", ".jpg", ".webp", ".exr", ".hdr", ".pfm"};

static bool file_has(const char *path, const char *content)
{
  FileBytes f;
  if (!file_read(&f, path, NULL)) return false;
  const bool same = f.size == strlen(content) && !memcmp(f.data, content, f.size);
  file_release(&f);
  return same;
}

TEST(a_full_disk_leaves_the_old_picture)
{
  static float noise[128 * 128 * 3];
  for (uint32_t i = 0; i < 128 * 128 * 3; i++) noise[i] = unit_float(hash_u32(i));
  const Plane plane = {.name = "", .channels = "RGB", .pixels = noise};
  const ImageOut out = {.width = 128, .height = 128, .planes = &plane, .plane_count = 1};
  struct rlimit old_limit, limit;
  getrlimit(RLIMIT_FSIZE, &old_limit);
  signal(SIGXFSZ, SIG_IGN);
  for (int i = 0; i < 6; i++) {
    if (!is_built(extensions[i])) continue;
    char name[40];
    snprintf(name, sizeof name, "full%s", extensions[i]);
    const char *path = temp_path(name);
    CHECK(file_write_whole(path, "old", 3, NULL));
    limit = old_limit;
    limit.rlim_cur = 2000;
    setrlimit(RLIMIT_FSIZE, &limit);
    Err err = {0};
    const bool ok = image_write(path, &out, &err);
    setrlimit(RLIMIT_FSIZE, &old_limit);
    CHECK_MSG(!ok && err.kind == ERR_IO && strstr(err.text, "too large"), "%s: %s", extensions[i], err.text);
    CHECK(file_has(path, "old"));
    unlink(path);
  }
}

TEST(failed_allocations_leave_the_old_picture)
{
  static Picture p;
  make_picture(&p, "RGBA", 1);
  for (int i = 0; i < 6; i++) {
    if (!is_built(extensions[i])) continue;
    char name[40];
    snprintf(name, sizeof name, "memory%s", extensions[i]);
    const char *path = temp_path(name);
    CHECK(file_write_whole(path, "old", 3, NULL));
    bool ok = false;
    for (long n = 1; n < 200 && !ok; n++) {
      Err err = {0};
      mem_fail_after(n);
      ok = image_write(path, &p.out, &err);
      mem_fail_after(0);
      CHECK_MSG(ok || (err.kind != ERR_NONE && file_has(path, "old")), "%s, allocation %ld", extensions[i],
                n);
    }
    CHECK(ok);
    unlink(path);
  }
}

TEST(unwritable_targets_are_named)
{
  static Picture p;
  make_picture(&p, "RGB", 1);
  for (int i = 0; i < 6; i++) {
    if (!is_built(extensions[i])) continue;
    char path[100];
    snprintf(path, sizeof path, "/nonexistent/picture%s", extensions[i]);
    Err err = {0};
    CHECK(!image_write(path, &p.out, &err) && err.kind == ERR_IO);
    CHECK_TEXT(err.text, path);
  }
}

TEST(extensions_choose_the_format)
{
  Err err = {0};
  bool is_linear = true;
  if (is_built(".png")) CHECK(image_format("a/B.PNG", &is_linear, &err) && !is_linear);
  CHECK(image_format("a.hdr", &is_linear, &err) && is_linear);
  CHECK(image_format("hash", &is_linear, &err) && is_linear);
  CHECK(!image_format("a/picture.pgn", &is_linear, &err) && err.kind == ERR_BAD_ARGUMENT);
  CHECK_TEXT(err.text, "did you mean \".png\"?");
  CHECK_TEXT(err.text, ".exr .hdr .pfm");
  err = (Err){0};
  CHECK(!image_format("folder.png/picture", &is_linear, &err));
  CHECK_TEXT(err.text, "add one of");
  CHECK(!image_format("a.hash", &is_linear, NULL));
}

TEST(wrong_arguments_are_refused)
{
  static Picture p;
  make_picture(&p, "RGB", 1);
  const char *path = temp_path("wrong.pfm");
  ImageOut bad[6];
  for (int i = 0; i < 6; i++) bad[i] = p.out;
  bad[0].width = 0;
  bad[1].height = 40000;
  bad[2].plane_count = 0;
  bad[3].bits = 12;
  bad[4].quality = 101;
  Plane plane = {.name = "", .channels = "", .pixels = p.pixels};
  bad[5].planes = &plane;
  for (int i = 0; i < 6; i++) {
    Err err = {0};
    CHECK(!image_write(path, &bad[i], &err) && err.kind == ERR_BAD_ARGUMENT);
    CHECK_TEXT(err.text, path);
  }
  CHECK(access(path, F_OK) != 0);
}

// --- hash -----------------------------------------------------------------------------------------

TEST(hash_sees_every_bit_but_signs_of_zero)
{
  static Picture p, q;
  make_picture(&p, "RGB", 1);
  q = p;
  q.plane.pixels = q.pixels;
  q.out.planes = &q.plane;
  const uint64_t hash = image_hash(&p.out);
  CHECK(image_hash(&q.out) == hash);
  for (int i = 0; i < HEIGHT * WIDTH * 3; i += 37) {
    const float old = q.pixels[i];
    q.pixels[i] = nextafterf(old, 2);
    CHECK(image_hash(&q.out) != hash);
    q.pixels[i] = old;
  }
  p.pixels[5] = 0;
  q.pixels[5] = -0.0f;
  p.pixels[6] = NAN;
  q.pixels[6] = -NAN;
  CHECK(image_hash(&p.out) == image_hash(&q.out));
  q.plane.name = "albedo";
  CHECK(image_hash(&p.out) != image_hash(&q.out));
  q.plane.name = "";
  q.plane.channels = "XYZ";
  CHECK(image_hash(&p.out) != image_hash(&q.out));
  q.plane.channels = "RGB";
  q.out.width = HEIGHT;
  q.out.height = WIDTH;
  CHECK(image_hash(&p.out) != image_hash(&q.out));
}

TEST(hash_writes_nothing)
{
  static Picture p;
  make_picture(&p, "RGB", 1);
  Err err = {0};
  CHECK(image_write("hash", &p.out, &err));
  CHECK(access("hash", F_OK) != 0);
}

TEST_MAIN
