// What the command line of `rayfold render` asks for, as far as it can be read without the scene: samples, parts, planes,
// outputs. Everything that can be known to be wrong is found here, before a big scene is loaded.

#include "render.h"

#include "library.h"
#include "nearest.h"
#include "output.h"
#include "pictures.h"
#include "settings.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

static ExitCode check_frames(const Render *r)
{
  const bool is_resumed = args_has(r->args, "resume");
  if (r->frames.is_wanted && args_has(r->args, "at"))
    return fail(EXIT_USAGE, "--at shows one moment and --frames many; leave one of them out");
  if (r->frames.is_wanted && args_has(r->args, "film"))
    return fail(EXIT_USAGE, "--film keeps the samples of one picture; render frames without it, or one frame with --at");
  if (is_resumed && !r->frames.is_wanted) return fail(EXIT_USAGE, "--resume goes on with --frames");
  if (is_resumed && (pictures_have(r->args, picture_is_video) || pictures_have(r->args, picture_is_hash)))
    return fail(EXIT_USAGE, "--resume goes on with numbered pictures; a film is made in one go");
  return EXIT_DONE;
}

static ExitCode check_outputs(Render *r)
{
  const char *stats = args_text(r->args, "stats"), *film = args_text(r->args, "film");
  if (!args_has(r->args, "output") && !film)
    return fail(EXIT_USAGE, "render needs -o OUT, as in `rayfold render %s -o picture.png`",
                r->args->operands[0]);
  ExitCode code = frames_read(r->args, &r->frames, &r->is_all);
  if (!code) code = check_frames(r);
  if (!code) code = pictures_check(r->args, r->engine);
  if (!code && film) code = output_check(film);
  return code || !stats ? code : output_check(stats);
}

static const struct {
  const char *name;
  unsigned planes;
} aov_names[] = {
    {"albedo", RF_ALBEDO},     {"normal", RF_NORMAL},       {"depth", RF_DEPTH},
    {"position", RF_POSITION}, {"object_id", RF_OBJECT_ID}, {"material_id", RF_MATERIAL_ID},
    {"variance", RF_VARIANCE}, {"samples", RF_SAMPLES},     {"all", RF_ALL_PLANES},
    {"none", RF_BEAUTY},
};

static ExitCode read_aov(Render *r, const char *name)
{
  char hint[160];
  Nearest n = nearest_begin(name);
  for (size_t i = 0; i < sizeof aov_names / sizeof *aov_names; i++) {
    if (!strcmp(name, aov_names[i].name)) {
      r->planes |= aov_names[i].planes;
      return EXIT_DONE;
    }
    nearest_try(&n, aov_names[i].name);
  }
  nearest_hint(&n, "", hint);
  return fail(EXIT_USAGE, "--aov: there is no plane \"%s\"%s", name,
              *hint ? hint : "; `rayfold render --help` lists them");
}

static ExitCode read_planes(Render *r)
{
  const char *list = args_text(r->args, "aov");
  r->planes = RF_BEAUTY;
  // Without the variance nobody knows the noise, which the progress line shows and --noise waits for.
  if (!list || args_has(r->args, "noise")) r->planes |= RF_VARIANCE;
  if (!list) {
    if (pictures_have(r->args, picture_is_exr)) r->planes = RF_ALL_PLANES;
    return EXIT_DONE;
  }
  while (*list) {
    char name[40];
    const size_t n = strcspn(list, ",");
    snprintf(name, sizeof name, "%.*s", (int)(n < 39 ? n : 39), list);
    const ExitCode code = read_aov(r, name);
    if (code) return code;
    list += n + (list[n] == ',');
  }
  if (strcmp(args_text(r->args, "aov"), "none") && !pictures_have(r->args, picture_is_exr) &&
      !pictures_have(r->args, picture_is_hash))
    return fail(EXIT_USAGE,
                "--aov: only .exr holds planes beside the picture; add an output like -o picture.exr");
  return EXIT_DONE;
}

static ExitCode read_range(const char *text, Range *out)
{
  char first[24];
  long a, b;
  const size_t n = strcspn(text, ":");
  snprintf(first, sizeof first, "%.*s", (int)(n < 23 ? n : 23), text);
  if (text[n] != ':' || !read_integer(first, &a) || !read_integer(text + n + 1, &b) || a < 0 || b <= a ||
      b > INT32_MAX)
    return fail(EXIT_USAGE, "--samples %s: it is A:B, whole numbers with 0 <= A < B, as in 0:8", text);
  *out = (Range){(int)a, (int)b};
  return EXIT_DONE;
}

static ExitCode read_tiles(Render *r)
{
  const char *text = args_text(r->args, "tiles");
  char first[24] = "", end[24] = "";
  long a, b, n;
  if (!text) return EXIT_DONE;
  const size_t colon = strcspn(text, ":"), slash = strcspn(text, "/");
  if (text[colon] && text[slash] && colon < slash) {
    snprintf(first, sizeof first, "%.*s", (int)(colon < 23 ? colon : 23), text);
    snprintf(end, sizeof end, "%.*s", (int)(slash - colon - 1 < 23 ? slash - colon - 1 : 23), text + colon + 1);
  }
  if (!read_integer(first, &a) || !read_integer(end, &b) || !read_integer(text + slash + 1, &n) || a < 0 || b <= a ||
      b > n || n > INT32_MAX)
    return fail(EXIT_USAGE, "--tiles %s: it is A:B/N, whole numbers with 0 <= A < B <= N, as in 0:1/4", text);
  if (args_has(r->args, "noise"))
    return fail(EXIT_USAGE, "--noise needs the whole picture, as each tile is judged with its neighbours; leave out --tiles");
  r->part = (Range){(int)a, (int)b};
  r->parts = (int)n;
  return EXIT_DONE;
}

static ExitCode check_ranges(const Render *r)
{
  for (size_t i = 0; i < r->range_count; i++)
    for (size_t j = 0; j < i; j++)
      if (r->ranges[i].first < r->ranges[j].end && r->ranges[j].first < r->ranges[i].end)
        return fail(EXIT_USAGE, "--samples %d:%d and %d:%d overlap; a sample counts once", r->ranges[j].first,
                    r->ranges[j].end, r->ranges[i].first, r->ranges[i].end);
  if (r->range_count && (args_has(r->args, "time") || args_has(r->args, "noise")))
    return fail(EXIT_USAGE, "--samples says exactly which samples to take; leave out --time and --noise");
  const long spp = args_integer(r->args, "spp", INT32_MAX);
  for (size_t i = 0; i < r->range_count; i++)
    if (r->ranges[i].end > spp)
      return fail(EXIT_USAGE, "--samples %d:%d ends after --spp %ld", r->ranges[i].first, r->ranges[i].end,
                  spp);
  return EXIT_DONE;
}

static ExitCode read_ranges(Render *r)
{
  const char *text;
  r->ranges = calloc(r->args->given_count + 1, sizeof *r->ranges); // one more for the default
  if (!r->ranges) return fail(EXIT_INTERNAL, "not enough memory to read the command line");
  for (size_t i = 0; (text = args_next(r->args, "samples", &i));) {
    const ExitCode code = read_range(text, &r->ranges[r->range_count++]);
    if (code) return code;
  }
  return check_ranges(r);
}

// A value out of range is found on an empty scene, before a big one is loaded.
static ExitCode rehearse_settings(Render *r)
{
  rf_scene *empty = rf_scene_create(r->engine);
  if (!empty) return fail_library(r->engine);
  ExitCode code = settings_apply(r->args, r->engine, empty, SETTINGS_PLAIN);
  for (size_t i = 0; !code && i < r->range_count; i++) {
    char samples[24];
    snprintf(samples, sizeof samples, "%d", r->ranges[i].end);
    if (!rf_set(empty, "render.spp", samples))
      code = fail_usage(r->engine, "--samples %d:%d", r->ranges[i].first, r->ranges[i].end);
  }
  rf_scene_destroy(empty);
  return code;
}

ExitCode render_read_args(Render *r)
{
  ExitCode code = read_ranges(r);
  if (!code) code = read_tiles(r);
  return code ? code : read_planes(r);
}

ExitCode render_check_args(Render *r)
{
  const ExitCode code = check_outputs(r);
  return code ? code : rehearse_settings(r);
}
