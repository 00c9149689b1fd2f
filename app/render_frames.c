// Many moments of `rayfold render`: which they are, each one's world, and the files and films that they go into. A frame is
// rendered as any picture is, by the steps of render.c.

#include "render.h"

#include "library.h"
#include "output.h"
#include "pictures.h"
#include "signals.h"
#include "video.h"

#include <limits.h>
#include <stdio.h>

// --- moments ---------------------------------------------------------------------------------------
double render_moment(const Render *r, long n)
{
  return r->frames.is_wanted ? (double)(r->frames.first + n * r->frames.step) / r->fps : r->frames.at;
}

ExitCode render_plan_frames(Render *r)
{
  double start, end;
  r->moves = rf_animation_range(r->scene, &start, &end, &r->fps);
  if (r->is_all && !r->moves)
    return fail(EXIT_USAGE, "%s: nothing in it moves, so say which frames are wanted, as in --frames 0:24",
                r->args->operands[0]);
  if (r->is_all) frames_take_all(&r->frames, start, end, r->fps);
  if (!args_has(r->args, "at")) r->frames.at = start;
  return !r->moves || rf_set_time(r->scene, render_moment(r, 0)) ? EXIT_DONE : fail_library(r->engine);
}

long render_frame_number(const Render *r)
{
  return r->frames.first + r->frames_done * r->frames.step;
}

void render_add_frames_before(const Render *r, rf_progress *now)
{
  now->done = ((double)r->frames_done + now->done) / (double)frames_count(&r->frames);
  now->seconds += r->frames_before.seconds;
  now->rays += r->frames_before.rays;
  if (now->done > 0) now->eta = now->seconds * (1 - now->done) / now->done;
}

// --- films -----------------------------------------------------------------------------------------
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

// --- one after the other ---------------------------------------------------------------------------
static bool is_frame_there(const Render *r)
{
  const char *output;
  bool is_there = args_has(r->args, "output");
  for (size_t i = 0; is_there && (output = args_next(r->args, "output", &i));) {
    char path[PATH_MAX];
    frame_name(path, output, render_frame_number(r));
    is_there = output_exists(path);
  }
  return is_there;
}

// The world of the first frame stands since prepare().
static ExitCode prepare_frame(Render *r)
{
  const double start = seconds_now(), seconds = render_moment(r, r->frames_done);
  const float aspect = (float)r->stats.width / (float)r->stats.height;
  if (!r->moves || r->frames_done == 0) return EXIT_DONE;
  if (!rf_set_time(r->scene, seconds)) return fail_library(r->engine);
  rf_world *next = rf_prepare(r->scene, r->world);
  if (!next) return fail_library(r->engine);
  rf_world_destroy(r->world);
  r->world = next;
  if (!rf_camera(r->scene, next, args_text(r->args, "camera"), aspect, &r->eye)) return fail_library(r->engine);
  const ExitCode code = render_open_shutter(r, seconds);
  r->stats.prepare += seconds_now() - start;
  return code;
}

static ExitCode render_frame(Render *r)
{
  snprintf(r->progress.label, sizeof r->progress.label, "frame %ld", render_frame_number(r));
  r->before = (rf_progress){0};
  ExitCode code = prepare_frame(r);
  if (!code) code = render_picture(r);
  if (!code) code = render_denoise(r);
  if (!code) code = render_write_pictures(r);
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

ExitCode render_frames(Render *r)
{
  const char *stats = args_text(r->args, "stats");
  ExitCode code = begin_videos(r);
  signals_defer();
  for (; !code && r->frames_done < frames_count(&r->frames); r->frames_done++) {
    if (args_has(r->args, "resume") && is_frame_there(r)) continue;
    code = signals_count() ? render_fail_stopped(r) : render_frame(r);
    if (code) break;
  }
  if (!code) code = finish_videos(r);
  if (!code) render_print_summary(r);
  return code || !stats ? code : stats_write(&r->stats, stats);
}
