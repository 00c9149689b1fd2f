// Files of the viewer: a scene is opened on a thread of its own while the old one is still shown; one that has changed
// on the disk is opened again; what cannot be read leaves everything as it was and says why.

#include "view.h"

#include "library.h"
#include "output.h"
#include "settings.h"
#include "stage.h"

#include <string.h>
#include <sys/stat.h>

enum { LOOK_EVERY = 500 }; // milliseconds between two looks at the file's date

// All 0 for a file that is not there.
static Stamp stamp_of(const char *path)
{
  struct stat s;
  if (stat(path, &s)) return (Stamp){0};
  return (Stamp){(long long)s.st_mtim.tv_sec, s.st_mtim.tv_nsec, (long long)s.st_size};
}

static bool has_changed(const View *v)
{
  const Stamp now = stamp_of(v->path), then = v->stamp;
  if (now.size == 0) return false; // being written, or gone
  return now.seconds != then.seconds || now.nanoseconds != then.nanoseconds || now.size != then.size;
}

// --- opening --------------------------------------------------------------------------------------
// A model that brings neither camera nor light is put on a studio floor, as `rayfold render` does.
static bool put_on_stage(View *v, rf_scene *s, const char *path)
{
  if (!stage_is_wanted(v->engine, s)) return true;
  stage_turn(v->engine, s, path, true);
  rf_world *w = rf_prepare(s, NULL);
  const bool ok = w && stage_build(v->engine, s, w, (float)v->width / (float)v->height) == EXIT_DONE;
  rf_world_destroy(w);
  return ok;
}

// A scene that moves is shown at its first moment, as `rayfold render` does.
static bool begin_moving(rf_scene *s)
{
  double start;
  return !rf_animation_range(s, &start, NULL, NULL) || rf_set_time(s, start);
}

static rf_scene *load(View *v, const char *path, rf_world **world, char message[600])
{
  rf_load_def def = rf_default_load_def();
  def.allow_outside = args_has(v->args, "allow-outside");
  def.cache = args_has(v->args, "cache");
  rf_scene *s = rf_scene_load(v->engine, path, &def);
  const bool is_good = s && settings_apply(v->args, v->engine, s, SETTINGS_BEFORE_STAGE) == EXIT_DONE &&
                       put_on_stage(v, s, path) && settings_apply(v->args, v->engine, s, SETTINGS_OF_STAGE) == EXIT_DONE && begin_moving(s) &&
                       (!v->loader.is_other || (*world = rf_prepare(s, NULL)) != NULL);
  if (is_good) return s;
  const char *text;
  v->loader.is_missing = rf_error(v->engine, &text) == RF_NOT_FOUND;
  snprintf(message, 600, "%s", *text ? text : "it cannot be shown with the settings given");
  rf_scene_destroy(s);
  return NULL;
}

static void *load_main(void *user)
{
  View *v = user;
  Loader *l = &v->loader;
  char message[600] = "";
  rf_world *w = NULL;
  rf_scene *s = load(v, l->path, &w, message);
  pthread_mutex_lock(&l->mutex);
  l->scene = s;
  l->world = w;
  memcpy(l->message, message, sizeof message);
  l->is_done = true;
  pthread_mutex_unlock(&l->mutex);
  v->kind->wake(v->screen);
  return NULL;
}

void view_open(View *v, const char *path)
{
  Loader *l = &v->loader;
  char first[1024];
  if (l->is_running) return; // view_check_file() will see that the file has changed
  if (list_first(path, first)) path = first;
  snprintf(l->path, sizeof l->path, "%s", path);
  l->is_done = false;
  l->is_other = strcmp(path, v->path) != 0;
  l->stamp = stamp_of(path);
  if (!l->is_other) v->stamp = l->stamp; // once is enough, whatever comes of it
  if (v->script) { // a script's frames must not depend on how long it takes
    load_main(v);
    l->is_running = true;
    return;
  }
  l->is_running = !pthread_create(&l->thread, NULL, load_main, v);
  if (!l->is_running) note_say(v, true, "cannot start a thread to open %s", path);
}

static void ready(void *user)
{
  View *v = user;
  v->kind->wake(v->screen);
}

// The first scene begins the live picture, others take its place.
static void show_scene(View *v, rf_scene *s)
{
  const char *camera = args_text(v->args, "camera");
  rf_world *w = v->loader.world; // NULL: the same file again
  const bool is_first = !v->live;
  rf_eye eye;
  uint64_t edit = 0;
  int width, height;
  const rf_render_def render = rf_scene_render_def(s, &width, &height);
  const rf_develop_def develop = rf_scene_develop_def(s);
  v->loader.world = NULL;
  if (!rf_camera(s, w ? w : view_world(v), is_first ? camera : NULL, (float)v->width / (float)v->height, &eye)) {
    if (is_first)
      v->code = camera ? fail_usage(v->engine, "--camera %s", camera) : fail_library(v->engine);
    else
      note_library(v);
    rf_scene_destroy(s);
    rf_world_destroy(w);
    return;
  }
  rf_vec3 lo, hi;
  if (w && rf_world_bounds(w, &lo, &hi)) v->walker.size = vec_length(vec_add(hi, lo, -1));
  if (!(v->walker.size > 1e-4f)) v->walker.size = 10;
  if (v->walker.size > 40 * eye.focus && eye.focus > 0) v->walker.size = 40 * eye.focus; // an endless floor is no size
  v->develop = develop;
  const char *integrator = v->wanted.render.integrator;
  v->wanted.render = render;
  if (!is_first) v->wanted.render.integrator = integrator;
  snprintf(v->path, sizeof v->path, "%s", v->loader.path);
  v->stamp = v->loader.stamp;
  v->is_overtaken = v->is_save_warned = false;
  if (v->loader.is_other) walker_set(&v->walker, &eye);
  caption_take(v, s);
  if (is_first) {
    rf_live_def def = rf_default_live_def();
    def.stepped = v->script;
    def.ready = ready;
    def.user = v;
    def.previous = w;
    v->live = rf_live_create(s, &def);
    if (!v->live) note_library(v);
  } else {
    edit = rf_live_replace(v->live, s);
  }
  if (v->live) game_begin(v, edit);
  rf_world_destroy(w);
  view_integrator(v, v->wanted.render.integrator);
  pick_clear(v);
  const char *name = strrchr(v->path, '/');
  char title[300];
  snprintf(title, sizeof title, "%.200s - Rayfold", *v->caption.title ? v->caption.title : name ? name + 1 : v->path);
  v->kind->title(v->screen, title);
}

void view_check_file(View *v)
{
  Loader *l = &v->loader;
  pthread_mutex_lock(&l->mutex);
  const bool is_done = l->is_running && l->is_done;
  pthread_mutex_unlock(&l->mutex);
  if (is_done) {
    if (!v->script) pthread_join(l->thread, NULL);
    l->is_running = false;
    const bool was_shown = v->live;
    if (l->scene)
      show_scene(v, l->scene);
    else if (was_shown) {
      v->is_overtaken |= !l->is_other;
      note_say(v, true, "%s", l->message);
    }
    else
      v->code = fail(l->is_missing ? EXIT_NO_INPUT : EXIT_BAD_SCENE, "%s", l->message);
    if (l->scene && was_shown) note_say(v, false, "opened %s", l->path);
    l->scene = NULL;
  }
  if (!v->live || v->clock < v->next_look) return;
  v->next_look = v->clock + LOOK_EVERY * 1e-3;
  if (has_changed(v)) view_open(v, v->path);
}

void view_close_file(View *v)
{
  Loader *l = &v->loader;
  if (l->is_running && !v->script) {
    rf_cancel(v->engine);
    pthread_join(l->thread, NULL);
  }
  if (l->is_running) rf_scene_destroy(l->scene);
  if (l->is_running) rf_world_destroy(l->world);
  pthread_mutex_destroy(&l->mutex);
}

// --- saving ---------------------------------------------------------------------------------------
bool scene_take(View *v, double seconds, rf_scene **out)
{
  *out = v->live ? rf_live_borrow(v->live, seconds) : NULL;
  if (!*out && seconds >= 1) note_say(v, true, "the scene is being prepared; try again");
  return *out;
}

// Would saving write over what is not in the window? Then once more says that it is meant.
static bool is_warned(View *v, const char *path, bool is_scene)
{
  const bool is_lost = is_scene ? v->is_overtaken || has_changed(v) : stamp_of(path).size > 0;
  if (!is_lost || v->is_save_warned) return false;
  v->is_save_warned = true;
  note_say(v, true, "%s on the disk is not what is shown here; ctrl + S once more writes over it", path);
  return true;
}

// A scene file is written over; a model gets a scene file beside it.
void view_save(View *v)
{
  char path[1100];
  rf_scene *s;
  const bool is_scene = output_is_any(v->path, ".json");
  snprintf(path, sizeof path, is_scene ? "%s" : "%s.json", v->path);
  if (is_warned(v, path, is_scene) || !scene_take(v, 2, &s)) return;
  const bool ok = rf_scene_save(s, path);
  if (!ok) note_library(v);
  rf_live_return(v->live);
  if (!ok) return;
  if (!is_scene) snprintf(v->path, sizeof v->path, "%.1023s", path);
  v->stamp = stamp_of(v->path);
  v->is_overtaken = v->is_save_warned = false;
  note_say(v, false, "saved %s", path);
}
