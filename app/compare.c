// `rayfold compare`: how far pictures are from a reference, in the figures by which renderers are compared.

#include "commands.h"
#include "library.h"
#include "output.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BLOCK = 16 }; // pixels, of the blocks whose means are compared

static const Option compare_options[] = {
    {.name = "output",
     .letter = 'o',
     .kind = OPTION_FILE,
     .argument = "OUT",
     .sentence = "Also write the difference of the last picture: grey where they agree, brighter or darker where "
                 "it is; ten times as strong as it is, relative to the reference."},
    {.name = "most",
     .kind = OPTION_REAL,
     .argument = "X",
     .low = 0,
     .high = 1e30,
     .initial = "nothing is too much",
     .sentence = "End with exit code 65 if the relMSE of a picture is above X."},
    {0},
};

typedef struct Difference {
  double relmse, rmse, psnr; // psnr against 1, in dB
  double mean[3], reference_mean[3];
  double worst; // of all blocks' mean luminances, relative to the reference's mean luminance
  int worst_x, worst_y;
} Difference;

static double luminance(const double c[3]) { return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]; }

// The mean of k x k pixels, so that a picture of a multiple of the reference's size can be compared with it.
static void shrink(rf_image *img, int k)
{
  const int width = img->width / k, height = img->height / k;
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++)
      for (int c = 0; c < 4; c++) {
        double sum = 0;
        for (int j = 0; j < k * k; j++)
          sum += img->pixels[4 * ((size_t)(y * k + j / k) * (size_t)img->width + (size_t)(x * k + j % k)) + (size_t)c];
        // What is written lies in front of all that is still to be read.
        img->pixels[4 * ((size_t)y * (size_t)width + (size_t)x) + (size_t)c] = (float)(sum / (k * k));
      }
  img->width = width;
  img->height = height;
}

static ExitCode fit(const rf_image *reference, rf_image *img, const char *path)
{
  const int k = img->width / reference->width;
  if (k < 1 || img->width != k * reference->width || img->height != k * reference->height)
    return fail(EXIT_BAD_SCENE, "%s is %d x %d and the reference %d x %d; it must be the same size or a multiple", path,
                img->width, img->height, reference->width, reference->height);
  if (k > 1) shrink(img, k);
  return EXIT_DONE;
}

static void find_worst_block(const rf_image *reference, const rf_image *img, Difference *out)
{
  const double scale = luminance(out->reference_mean);
  for (int top = 0; top < img->height; top += BLOCK)
    for (int left = 0; left < img->width; left += BLOCK) {
      double sum[3] = {0};
      int count = 0;
      for (int y = top; y < top + BLOCK && y < img->height; y++)
        for (int x = left; x < left + BLOCK && x < img->width; x++, count++)
          for (int c = 0; c < 3; c++) {
            const size_t i = 4 * ((size_t)y * (size_t)img->width + (size_t)x) + (size_t)c;
            sum[c] += (double)img->pixels[i] - reference->pixels[i];
          }
      const double off = scale > 0 ? fabs(luminance(sum)) / count / scale : 0;
      if (off <= out->worst) continue;
      out->worst = off;
      out->worst_x = left;
      out->worst_y = top;
    }
}

static Difference difference_of(const rf_image *reference, const rf_image *img)
{
  Difference d = {0};
  const size_t count = (size_t)img->width * (size_t)img->height;
  double squares = 0;
  for (size_t i = 0; i < 4 * count; i++) {
    if (i % 4 == 3) continue;
    const double a = img->pixels[i], r = reference->pixels[i];
    squares += (a - r) * (a - r);
    d.relmse += (a - r) * (a - r) / (r * r + 0.01);
    d.mean[i % 4] += a / (double)count;
    d.reference_mean[i % 4] += r / (double)count;
  }
  d.relmse /= 3 * (double)count;
  d.rmse = sqrt(squares / (3 * (double)count));
  d.psnr = d.rmse > 0 ? -20 * log10(d.rmse) : INFINITY;
  find_worst_block(reference, img, &d);
  return d;
}

static void print_difference(const char *path, const Difference *d)
{
  const double l = luminance(d->mean), r = luminance(d->reference_mean);
  printf("%s: relMSE %.4g, RMSE %.4g, PSNR %.2f dB, mean %.5f %.5f %.5f", path, d->relmse, d->rmse, d->psnr, d->mean[0],
         d->mean[1], d->mean[2]);
  if (r > 0) printf(" (%+.2f %%), worst block %.2f %% at %d,%d", 100 * (l / r - 1), 100 * d->worst, d->worst_x, d->worst_y);
  putchar('\n');
}

// Middle grey plus ten times the relative difference, as display values.
static void make_difference(const rf_image *reference, rf_image *img)
{
  for (size_t i = 0; i < 4 * (size_t)img->width * (size_t)img->height; i++) {
    const float r = reference->pixels[i], off = (img->pixels[i] - r) / sqrtf(r * r + 0.01f);
    const float v = 0.5f + 5 * off;
    img->pixels[i] = i % 4 == 3 ? 1 : v < 0 ? 0 : v > 1 ? 1 : v;
  }
}

static ExitCode compare_one(rf_engine *engine, const Args *args, const rf_image *reference, size_t i)
{
  const char *path = args->operands[i], *out = args_text(args, "output");
  rf_image img = {0};
  ExitCode code = rf_image_load(engine, path, &img) ? fit(reference, &img, path) : fail_library(engine);
  if (!code) {
    const Difference d = difference_of(reference, &img);
    print_difference(path, &d);
    if (!(d.relmse <= args_real(args, "most", INFINITY)))
      code = fail(EXIT_BAD_SCENE, "%s: a relMSE of %.4g is above %s", path, d.relmse, args_text(args, "most"));
  }
  if (img.pixels && out && i + 1 == args->operand_count && img.width == reference->width) {
    make_difference(reference, &img);
    if (!rf_image_save(engine, &img, NULL, out) && !code) code = fail_library(engine);
  }
  rf_image_free(&img);
  return code;
}

static ExitCode run_compare(const Args *args)
{
  const char *out = args_text(args, "output");
  rf_engine *engine = NULL;
  rf_image reference = {0};
  ExitCode code = engine_open(&engine, 0, NULL);
  if (!code && out && !rf_can_save(engine, out)) code = fail_usage(engine, "-o %s", out);
  if (!code && out) code = output_check(out);
  if (!code && !rf_image_load(engine, args->operands[0], &reference)) code = fail_library(engine);
  for (size_t i = 1; !code && i < args->operand_count; i++) code = compare_one(engine, args, &reference, i);
  rf_image_free(&reference);
  rf_engine_destroy(engine);
  return code ? code : stdout_finish("the figures");
}

const Command command_compare = {
    .name = "compare",
    .sentence = "Tell how far pictures are from a reference.",
    .operands = "REFERENCE PICTURE...",
    .least = 2,
    .most = SIZE_MAX,
    .operand_kind = OPERAND_FILE,
    .usage = "[OPTION]...",
    .text = "Prints for each picture its relMSE, the mean of (p - r)^2 / (r^2 + 0.01) over pixels and channels; its RMSE "
            "and PSNR; its mean colour and how far its luminance is off; and the block of 16 x 16 pixels whose mean is "
            "furthest off, in parts of the reference's mean. All in linear light, so .exr, .hdr and .pfm are best. A "
            "picture of a multiple of the reference's size is averaged down to it.",
    .example = "rayfold compare reference.exr mine.exr -o difference.png",
    .options = compare_options,
    .run = run_compare,
};
