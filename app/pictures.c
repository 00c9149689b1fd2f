// See pictures.h.

#include "pictures.h"

#include "nearest.h"
#include "output.h"
#include "video.h"

#include <inttypes.h>
#include <string.h>

bool picture_is_hash(const char *output)
{
  return !strcmp(output, "hash");
}

bool picture_is_exr(const char *output)
{
  return output_is_any(output, ".exr");
}

bool picture_is_video(const char *output)
{
  return output_is_any(output, VIDEO_OUTPUTS);
}

bool pictures_have(const Args *a, bool (*is_such)(const char *output))
{
  const char *output;
  for (size_t i = 0; (output = args_next(a, "output", &i));)
    if (is_such(output)) return true;
  return false;
}

static ExitCode check_bits(const char *output, const char *bits)
{
  const bool png = output_is_any(output, ".png"), exr = picture_is_exr(output);
  if ((png && !strcmp(bits, "32")) || (exr && !strcmp(bits, "8")))
    return fail(EXIT_USAGE, "--bits %s: %s takes %s", bits, output, png ? "8 or 16" : "16 or 32");
  return EXIT_DONE;
}

// What rf_can_save() refuses: a format left out of this build, or a slip in the extension.
static ExitCode fail_format(const char *output)
{
  static const char formats[] = ".png|.jpg|.jpeg|.webp|.exr|.hdr|.pfm";
  const char *extension = output_extension(output);
  if (output_is_any(output, formats))
    return fail(EXIT_USAGE, "-o %s: this build cannot write %s; `rayfold --version` tells why", output,
                extension);
  if (!*extension)
    return fail(EXIT_USAGE, "-o %s: the name needs an extension, as in %s.png; or it is \"hash\"", output,
                output);
  char names[8][40], hint[160];
  Nearest n = nearest_begin(extension);
  size_t i = 0;
  for (const char *rest = formats; i < 8 && next_choice(&rest, names[i]); i++) nearest_try(&n, names[i]);
  nearest_hint(&n, "", hint);
  return fail(EXIT_USAGE, "-o %s: \"%s\" is no picture format%s", output, extension,
              *hint ? hint : "; take .png, .jpg, .webp, .exr, .hdr or .pfm");
}

static ExitCode check_output(const Args *a, rf_engine *engine, const char *output)
{
  if (picture_is_hash(output)) return EXIT_DONE;
  if (picture_is_video(output) && args_know(a, "frames")) return output_check(output);
  if (!rf_can_save(engine, output)) return fail_format(output);
  const char *bits = args_text(a, "bits");
  const ExitCode code = bits ? check_bits(output, bits) : EXIT_DONE;
  return code ? code : output_check(output);
}

ExitCode pictures_check(const Args *a, rf_engine *engine)
{
  const char *output;
  for (size_t i = 0; (output = args_next(a, "output", &i));) {
    const ExitCode code = check_output(a, engine, output);
    if (code) return code;
  }
  return EXIT_DONE;
}

rf_develop_def pictures_develop(const Args *a, rf_develop_def develop)
{
  if (!args_has(a, "no-effects")) return develop;
  develop = rf_default_develop_def();
  develop.tone_curve = "linear";
  develop.exposure = 0;
  return develop;
}

ExitCode pictures_write(const Args *a, rf_engine *engine, const rf_film *film, unsigned planes,
                        rf_develop_def develop, long frame)
{
  rf_save_def save = rf_default_save_def();
  save.planes = planes;
  save.bits = (int)args_integer(a, "bits", 0);
  save.quality = (int)args_integer(a, "quality", 0);
  develop = pictures_develop(a, develop);
  ExitCode first = EXIT_DONE;
  const char *output;
  for (size_t i = 0; (output = args_next(a, "output", &i));) {
    char path[PATH_MAX];
    if (picture_is_hash(output) || picture_is_video(output)) continue;
    frame_name(path, output, frame);
    if (rf_film_save(film, &develop, &save, path)) continue;
    const ExitCode code = fail_library(engine);
    if (!first) first = code;
  }
  return first;
}

ExitCode pictures_print_hash(uint64_t hash)
{
  printf("%016" PRIx64 "\n", hash);
  return stdout_finish("the hash");
}

void pictures_list(const Args *a, FILE *out)
{
  const char *output;
  size_t i = 0;
  for (const char *comma = ""; (output = args_next(a, "output", &i)); comma = ", ")
    fprintf(out, "%s%s", comma, output);
}
