// See stage.h. All lengths are in radii of the model: half the diagonal of its box.

#include "stage.h"

#include "library.h"
#include "output.h"

#include <math.h>
#include <stdarg.h>
#include <string.h>

static void forget_error(rf_engine *engine)
{
  rf_error(engine, NULL);
}

static bool is_value(rf_engine *engine, rf_scene *scene, const char *path, const char *value)
{
  const char *json = rf_get(scene, path);
  forget_error(engine); // a path that leads nowhere is an answer here
  return json && !strcmp(json, value);
}

bool stage_is_wanted(rf_engine *engine, rf_scene *scene)
{
  // The library lights a model that brings no light by a sun of this name.
  const bool is_unlit = rf_get(scene, "lights.stage_sun");
  forget_error(engine);
  return is_unlit && is_value(engine, scene, "camera", "{}");
}

void stage_turn(rf_engine *engine, rf_scene *scene, const char *path, bool is_quiet)
{
  // Printers and CAD have z up, and STL is theirs; nothing in the file tells.
  if (!output_is_any(path, ".stl")) return;
  if (!rf_set(scene, "objects[0].rotate", "[-90, 0, 0]")) {
    forget_error(engine);
    return;
  }
  if (!is_quiet)
    say_note("%s: taken to have z up, as STL files mostly do; if it lies on its side: "
             "--set objects[0].rotate=[0,0,0]",
             path);
}

bool stage_owns(const char *path)
{
  static const char *const sections[] = {"camera", "sky", "lights"};
  const size_t n = strcspn(path, ".[=");
  for (size_t i = 0; i < sizeof sections / sizeof *sections; i++)
    if (strlen(sections[i]) == n && !strncmp(path, sections[i], n)) return true;
  return !strncmp(path, "objects.stage_", 14) || !strncmp(path, "materials.stage_", 16);
}

// --- putting it up ---------------------------------------------------------------------------------
typedef struct Stage {
  rf_engine *engine;
  rf_scene *scene;
  ExitCode code; // of the first edit that failed; the rest are skipped
  double centre[3];
  double floor; // height of the model's lowest point
  double radius;
} Stage;

__attribute__((format(printf, 3, 4))) static void put(Stage *s, const char *path, const char *format, ...)
{
  char json[600];
  va_list args;
  if (s->code) return;
  va_start(args, format);
  vsnprintf(json, sizeof json, format, args);
  va_end(args);
  if (!rf_set(s->scene, path, json)) s->code = fail_library(s->engine);
}

// False for what no table fits: nothing there, or smaller than a light may be.
static bool measure(Stage *s, const rf_world *model)
{
  rf_vec3 lo, hi;
  if (!rf_world_bounds(model, &lo, &hi)) return false;
  const double x = (double)hi.x - lo.x, y = (double)hi.y - lo.y, z = (double)hi.z - lo.z;
  s->centre[0] = lo.x + x / 2;
  s->centre[1] = lo.y + y / 2;
  s->centre[2] = lo.z + z / 2;
  s->floor = lo.y;
  s->radius = sqrt(x * x + y * y + z * z) / 2;
  return s->radius > 1e-5 && s->radius < 1e15;
}

static void put_eye(Stage *s, const rf_eye *e)
{
  const rf_vec3 p = e->frame.p, back = e->frame.z;
  const double focus = e->focus;
  put(s, "camera", "{\"position\": [%.9g, %.9g, %.9g], \"target\": [%.9g, %.9g, %.9g], \"fov\": %.6g}", p.x,
      p.y, p.z, p.x - focus * back.x, p.y - focus * back.y, p.z - focus * back.z,
      e->fov * 180 / 3.14159265358979323846);
}

// From rf_camera(), which frames a scene without a camera.
static void put_camera(Stage *s, const rf_world *model, float aspect)
{
  rf_eye e;
  if (rf_camera(s->scene, model, NULL, aspect, &e))
    put_eye(s, &e);
  else
    s->code = fail_library(s->engine);
}

ExitCode stage_hold_camera(rf_engine *engine, rf_scene *scene, const rf_eye *eye)
{
  Stage s = {.engine = engine, .scene = scene};
  if (is_value(engine, scene, "camera", "{}")) put_eye(&s, eye);
  return s.code;
}

static void put_light(Stage *s, const char *name, const double at[3], const double size[2],
                      const double radiance[3])
{
  char path[40];
  snprintf(path, sizeof path, "lights.%s", name);
  const double r = s->radius, *c = s->centre;
  put(s, path,
      "{\"kind\": \"rect\", \"position\": [%.9g, %.9g, %.9g], \"target\": [%.9g, %.9g, %.9g], "
      "\"size\": [%.9g, %.9g], \"radiance\": [%g, %g, %g], \"visible_to_camera\": false}",
      c[0] + r * at[0], c[1] + r * at[1], c[2] + r * at[2], c[0], c[1], c[2], r * size[0], r * size[1],
      radiance[0], radiance[1], radiance[2]);
}

// A large warm box to the left of the eye, a cooler one behind to the right that draws the outline, and a dim sky from
// above that fills the shadows. A white matt model comes out just under white.
static void put_lights(Stage *s)
{
  put(s, "sky",
      "{\"kind\": \"gradient\", \"zenith\": [1, 1.05, 1.15], \"horizon\": [0.55, 0.57, 0.6], "
      "\"ground\": [0.2, 0.2, 0.2], \"gain\": 0.2}");
  put(s, "lights.stage_sun", "null");
  put_light(s, "stage_key", (double[]){-2.7, 3.2, 2.0}, (double[]){1.8, 1.8}, (double[]){19, 18, 16.6});
  put_light(s, "stage_rim", (double[]){2.6, 2.2, -2.4}, (double[]){1.2, 2.4}, (double[]){15, 16, 17.6});
}

// Large enough that the eye, which looks down on it, sees no end. A ten-thousandth below the model: a flat one would
// fight with it for each pixel otherwise.
static void put_floor(Stage *s)
{
  const double r = s->radius, *c = s->centre;
  put(s, "materials.stage_floor",
      "{\"kind\": \"pbr\", \"base_color\": [0.2, 0.203, 0.21], \"roughness\": 0.45}");
  put(s, "objects.stage_floor",
      "{\"shape\": {\"kind\": \"disk\", \"radius\": %.9g}, \"material\": \"stage_floor\", \"rotate\": [-90, "
      "0, 0], "
      "\"translate\": [%.9g, %.9g, %.9g]}",
      50 * r, c[0], s->floor - 1e-4 * r, c[2]);
}

ExitCode stage_build(rf_engine *engine, rf_scene *scene, const rf_world *model, float aspect)
{
  Stage s = {.engine = engine, .scene = scene};
  if (!measure(&s, model)) return EXIT_DONE;
  put_camera(&s, model, aspect);
  put_lights(&s);
  const rf_render_def render = rf_scene_render_def(scene, NULL, NULL);
  if (integrator_is_light(render.integrator) && !render.transparent) put_floor(&s);
  return s.code;
}
