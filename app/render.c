// `rayfold render`: one scene into one film, the film into as many files as were named. The steps stand in
// run_render() in their order: everything that can be known to be wrong is found before a big scene is loaded, and
// nothing is written before the film is done. See render.h for what lies in other files.

#include "render.h"

#include "commands.h"
#include "library.h"
#include "output.h"
#include "pictures.h"
#include "settings.h"
#include "signals.h"
#include "stage.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

// The scene's own limit of render.spp: what a render bounded by time or noise alone may take.
#define MOST_SAMPLES "524288"

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

// --- loading and preparing -------------------------------------------------------------------------
// A view's colours are numbers to be read off, not light: the scene's curve and exposure would only bend them. What
// the command line says of develop still holds.
static ExitCode develop_view_as_it_is(Render *r)
{
  if (integrator_is_light(rf_scene_render_def(r->scene, NULL, NULL).integrator)) return EXIT_DONE;
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
ExitCode render_open_shutter(Render *r, double seconds)
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
  if (!code) code = render_open_shutter(r, render_moment(r, 0));
  r->stats.prepare = seconds_now() - start;
  return code;
}

// --- rendering -------------------------------------------------------------------------------------
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
  if (r->frames.is_wanted) render_add_frames_before(r, &now);
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

ExitCode render_fail_stopped(const Render *r)
{
  const long frame = render_frame_number(r);
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
    return render_fail_stopped(r);
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

ExitCode render_picture(Render *r)
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

ExitCode render_denoise(Render *r)
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
      code = render_fail_stopped(r);
    else
      code = fail(EXIT_INTERNAL, "%s", text);
  }
  progress_clear(&r->progress);
  r->stats.denoise += seconds_now() - start;
  return code;
}

// --- writing ---------------------------------------------------------------------------------------
ExitCode render_write_pictures(Render *r)
{
  const double start = seconds_now();
  const long frame = r->frames.is_wanted ? render_frame_number(r) : FRAME_NONE;
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

void render_print_summary(const Render *r)
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
  ExitCode code = render_write_pictures(r);
  const ExitCode after = write_hash_and_stats(r);
  if (!code) code = after;
  if (!code) code = r->kept_code;
  if (code) return code;
  render_print_summary(r);
  if (!r->is_stop_said || (r->is_complete && r->later <= 0)) return EXIT_DONE;
  return fail(EXIT_STOPPED,
              "stopped after %d of %.0f samples a pixel and saved these; for all of them run the same "
              "command again",
              r->stats.rendered.samples, r->stats.rendered.samples + r->left + r->later);
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
  ExitCode code = render_read_args(&r);
  if (!code) code = open_engine(&r);
  if (!code) code = render_check_args(&r);
  if (!code) code = load(&r);
  if (!code) code = render_plan_frames(&r);
  if (!code) code = prepare(&r);
  if (!code && r.frames.is_wanted) {
    code = render_frames(&r);
    finish(&r);
    return code;
  }
  if (!code) code = render_picture(&r);
  if (!code) code = render_denoise(&r);
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
        "SCENE is a scene file (.json) or a model (.obj .gltf .glb .ply .stl .vox .grid .nvdb). A model that brings neither "
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
