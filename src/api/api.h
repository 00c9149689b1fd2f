// What the files of the public interface share: the engine, the handles, and how an error reaches the caller.

#ifndef RAYFOLD_API_API_H
#define RAYFOLD_API_API_H

#include "base/cpu.h"
#include "base/err.h"
#include "base/jobs.h"
#include "post/tone.h"
#include "rayfold/rayfold.h"
#include "render/camera.h"
#include "render/film.h"
#include "render/hot.h"
#include "render/render.h"
#include "scene/edit.h"
#include "scene/scene.h"
#include "world/world.h"

struct rf_engine {
  Jobs *jobs;
  const HotTable *hot; // the kernels of the chosen level
  IsaLevel isa;
  Cancel cancel;
  void (*log)(void *user, rf_log_level level, const char *line);
  void *user;
};

struct rf_scene {
  rf_engine *engine;
  Scene *scene;
  History history;
  LoadOptions options;
  Text answer;    // of the last rf_get
};

struct rf_world {
  rf_engine *engine;
  World *world;
  rf_object *
      objects; // of each instance, one place on: [0] is that of NO_HIT, none. Hits name them without the scene
};

struct rf_film {
  rf_engine *engine;
  Film *film;
  float *clean; // owned: the denoised picture, rgba; NULL: none was made of what the film holds now
};

// An Err for one call: api_fail() hands it to rf_error() of this thread if it holds anything.
bool api_fail(const Err *err);                                            // returns err->kind == ERR_NONE
bool api_bad_argument(const char *function, const char *format, ...)      // returns false
    __attribute__((format(printf, 2, 3)));
void api_film_changed(rf_film *f); // forgets the denoised picture
Eye api_eye(const rf_eye *e);
bool api_settings(const rf_render_def *def, const char *function, RenderSettings *out);
// Makes the scene ready; NULL with the error in err. cancel may be NULL.
rf_world *api_prepare(rf_scene *s, const rf_world *previous, const Cancel *cancel, Err *err);
// The camera of that name, NULL: the main one. NULL on error.
const Camera *api_find_camera(const Scene *s, const char *name, Err *err);

// What a render sees: one world and eye, or several moments (see RenderJob).
typedef struct ApiSight {
  const World *world;
  Eye eye;
  const RenderMoment *moments;
  uint32_t moment_count;
} ApiSight;
rf_status api_render(rf_engine *e, const ApiSight *sight, const rf_render_def *def, rf_film *f, rf_render_stats *stats);
void api_log_notes(const rf_engine *e, const Notes *notes);
bool api_tone(const rf_develop_def *def, const char *function, Tone *out); // def NULL: defaults
bool api_is_opaque(const rf_image *rgba); // covered everywhere: needs no alpha channel
void api_drop_alpha(rf_image *rgba);

// Is this the struct its default function made? Records the failure if not.
bool api_has_magic(uint32_t magic, uint32_t wanted, const char *function, const char *type);

enum {
  MAGIC_ENGINE = 0x52464531,
  MAGIC_LOAD,
  MAGIC_MESH,
  MAGIC_RENDER,
  MAGIC_DEVELOP,
  MAGIC_SAVE,
  MAGIC_DENOISE,
  MAGIC_LIVE,
  MAGIC_LIVE_VIEW,
};

#endif
