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

static void look_at_date(View *v)
{
  struct stat s;
  if (stat(v->path, &s)) return;
  v->stamp.seconds = (long long)s.st_mtim.tv_sec;
  v->stamp.nanoseconds = s.st_mtim.tv_nsec;
  v->stamp.size = (long long)s.st_size;
}

static bool has_changed(const View *v)
{
  struct stat s;
  if (stat(v->path, &s) || s.st_size == 0) return false; // being written
  return (long long)s.st_mtim.tv_sec != v->stamp.seconds || s.st_mtim.tv_nsec != v->stamp.nanoseconds ||
         (long long)s.st_size != v->stamp.size;
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

static rf_scene *load(View *v, const char *path, char message[600])
{
  rf_load_def def = rf_default_load_def();
  def.allow_outside = args_has(v->args, "allow-outside");
  def.cache = args_has(v->args, "cache");
  rf_scene *s = rf_scene_load(v->engine, path, &def);
  const bool is_good = s && settings_apply(v->args, v->engine, s, SETTINGS_BEFORE_STAGE) == EXIT_DONE &&
                       put_on_stage(v, s, path) && settings_apply(v->args, v->engine, s, SETTINGS_OF_STAGE) == EXIT_DONE;
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
  rf_scene *s = load(v, l->path, message);
  pthread_mutex_lock(&l->mutex);
  l->scene = s;
  memcpy(l->message, message, sizeof message);
  l->is_done = true;
  pthread_mutex_unlock(&l->mutex);
  v->kind->wake(v->screen);
  return NULL;
}

void view_open(View *v, const char *path)
{
  Loader *l = &v->loader;
  if (l->is_running) return; // view_check_file() will see that the file has changed
  snprintf(l->path, sizeof l->path, "%s", path);
  l->is_done = false;
  if (!strcmp(path, v->path)) look_at_date(v);
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
  const bool is_other = strcmp(v->path, v->loader.path) != 0, is_first = !v->live;
  rf_eye eye;
  int width, height;
  const rf_render_def render = rf_scene_render_def(s, &width, &height);
  const rf_develop_def develop = rf_scene_develop_def(s);
  rf_world *w = NULL;
  if (is_first || is_other) w = rf_prepare(s, NULL); // for its size and rays; the live picture takes its trees over
  const bool ok = (w || (!is_first && !is_other)) &&
                  rf_camera(s, w, is_first ? camera : NULL, (float)v->width / (float)v->height, &eye);
  if (!ok) {
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
  look_at_date(v);
  v->home = eye;
  if (is_first || is_other) walker_set(&v->walker, &eye);
  if (is_first) {
    rf_live_def def = rf_default_live_def();
    def.stepped = v->script;
    def.ready = ready;
    def.user = v;
    def.previous = w;
    v->live = rf_live_create(s, &def);
    if (!v->live) note_library(v);
  } else {
    rf_live_replace(v->live, s);
  }
  rf_world_destroy(w);
  view_integrator(v, v->wanted.render.integrator);
  pick_clear(v);
  const char *name = strrchr(v->path, '/');
  char title[300];
  snprintf(title, sizeof title, "%.200s - Rayfold", name ? name + 1 : v->path);
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
    else if (was_shown)
      note_say(v, true, "%s", l->message);
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
  pthread_mutex_destroy(&l->mutex);
}

// --- saving ---------------------------------------------------------------------------------------
bool scene_take(View *v, double seconds, rf_scene **out)
{
  *out = v->live ? rf_live_borrow(v->live, seconds) : NULL;
  if (!*out && seconds >= 1) note_say(v, true, "the scene is being prepared; try again");
  return *out;
}

// A scene file is written over; a model gets a scene file beside it.
void view_save(View *v)
{
  char path[1100];
  rf_scene *s;
  if (!scene_take(v, 2, &s)) return;
  const size_t n = strlen(v->path);
  const bool is_scene = n > 5 && !strcmp(v->path + n - 5, ".json");
  snprintf(path, sizeof path, is_scene ? "%s" : "%s.json", v->path);
  const bool ok = rf_scene_save(s, path);
  if (!ok) note_library(v);
  rf_live_return(v->live);
  if (!ok) return;
  if (!is_scene) snprintf(v->path, sizeof v->path, "%.1023s", path);
  look_at_date(v);
  note_say(v, false, "saved %s", path);
}
