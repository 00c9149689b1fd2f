// Shots through the public interface: the worlds and eyes of one open shutter. The scene is walked through the time it
// is open; a step where nothing but the camera moved shows the world of the step before.

#include "api/api.h"

#include "base/mem.h"
#include "scene/track.h"

struct rf_shot {
  rf_engine *engine;
  int step_count;
  rf_world *worlds[MOST_MOMENTS]; // owned, where a step has a new one; NULL: that of the step before
  rf_eye eyes[MOST_MOMENTS];
  RenderMoment moments[MOST_MOMENTS];
};

typedef struct Shutter {
  double moment, open; // seconds: its middle, and how long
  int steps;
} Shutter;

static bool read_shutter(const rf_scene *s, const char *camera, double seconds, Shutter *out, Err *err)
{
  const Camera *c = api_find_camera(s->scene, camera, err);
  if (!c) return false;
  *out = (Shutter){seconds, (double)c->common.shutter / (double)s->scene->timeline.fps, s->scene->render.motion_steps};
  if (!(out->open > 0)) out->steps = 1;
  return true;
}

// A step stands for its middle.
static double step_moment(const Shutter *shutter, int k)
{
  return shutter->moment + shutter->open * ((k + 0.5) / shutter->steps - 0.5);
}

// A scene without a camera is framed once, by its first step, or the picture would shake with what it shows.
static bool look(rf_shot *shot, rf_scene *s, const char *camera, float aspect, int k)
{
  if (k && !camera && !s->scene->has_camera) return shot->eyes[k] = shot->eyes[0], true;
  return rf_camera(s, shot->worlds[k], camera, aspect, &shot->eyes[k]);
}

static bool add_step(rf_shot *shot, rf_scene *s, const rf_world *previous, unsigned moved, int k)
{
  shot->step_count = k + 1;
  if (k && !(moved & MOVED_WORLD)) return true;
  for (int i = k - 1; i >= 0 && k; i--)
    if (shot->worlds[i]) {
      previous = shot->worlds[i];
      break;
    }
  return (shot->worlds[k] = rf_prepare(s, previous)) != NULL;
}

static bool prepare_steps(rf_shot *shot, rf_scene *s, const rf_world *previous, const char *camera, float aspect,
                          const Shutter *shutter)
{
  unsigned any = 0;
  Err err = {0};
  for (int k = 0; k < shutter->steps; k++) {
    unsigned moved;
    if (!scene_set_time(s->scene, step_moment(shutter, k), &moved, &err)) return api_fail(&err);
    if (k) any |= moved;
    if (!add_step(shot, s, previous, moved, k) || !look(shot, s, camera, aspect, k)) return false;
  }
  if (!any) shot->step_count = 1;
  return true;
}

static void link_moments(rf_shot *shot)
{
  const World *world = NULL;
  for (int k = 0; k < shot->step_count; k++) {
    if (shot->worlds[k]) world = shot->worlds[k]->world;
    shot->moments[k] = (RenderMoment){world, api_eye(&shot->eyes[k])};
  }
}

rf_shot *rf_shot_prepare(rf_scene *s, const rf_world *previous, const char *camera, float aspect, double seconds)
{
  static const char function[] = "rf_shot_prepare";
  if (!s) return api_bad_argument(function, "the scene is NULL"), NULL;
  if (!(fabs(seconds) <= 1e9)) return api_bad_argument(function, "%g s is no moment", seconds), NULL;
  Err err = {0};
  Shutter shutter = {0};
  rf_shot *shot = mem_zero(1, sizeof *shot);
  if (!shot) err_memory(&err, "a shot", sizeof *shot);
  // The shutter may move, too: it is asked at the moment itself.
  bool ok = shot && scene_set_time(s->scene, seconds, NULL, &err) && read_shutter(s, camera, seconds, &shutter, &err);
  ok = api_fail(&err) && ok;
  if (shot) shot->engine = s->engine;
  ok = ok && prepare_steps(shot, s, previous, camera, aspect, &shutter);
  if (ok && shutter.steps > 1) ok = rf_set_time(s, seconds);
  if (ok) {
    link_moments(shot);
    return shot;
  }
  rf_shot_destroy(shot);
  return NULL;
}

int rf_shot_steps(const rf_shot *shot)
{
  return shot ? shot->step_count : 0;
}

const rf_world *rf_shot_world(const rf_shot *shot)
{
  int k = shot ? shot->step_count / 2 : -1;
  while (k > 0 && !shot->worlds[k]) k--;
  return k < 0 ? NULL : shot->worlds[k];
}

rf_eye rf_shot_eye(const rf_shot *shot)
{
  return shot ? shot->eyes[shot->step_count / 2] : (rf_eye){0};
}

rf_status rf_shot_render(const rf_shot *shot, const rf_render_def *def, rf_film *f, rf_render_stats *stats)
{
  if (!shot || !def || !f) {
    api_bad_argument("rf_shot_render", "shot, definition and film must not be NULL");
    return RF_BAD_ARGUMENT;
  }
  const ApiSight sight = {.world = shot->moments[0].world,
                          .eye = shot->moments[0].eye,
                          .moments = shot->step_count > 1 ? shot->moments : NULL,
                          .moment_count = shot->step_count > 1 ? (uint32_t)shot->step_count : 0};
  return api_render(shot->engine, &sight, def, f, stats);
}

void rf_shot_destroy(rf_shot *shot)
{
  if (!shot) return;
  for (int k = 0; k < MOST_MOMENTS; k++) rf_world_destroy(shot->worlds[k]);
  mem_free(shot);
}
