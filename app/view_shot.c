// Screenshots: the view in the window's size with all of the scene's samples, rendered by an engine of its own whose
// threads have the lowest priority, so that the window does not feel it. The file appears whole or not at all.

#include "view.h"

#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

static rf_go progress(void *user, const rf_progress *p)
{
  Shot *s = user;
  pthread_mutex_lock(&s->mutex);
  s->done = p->done;
  pthread_mutex_unlock(&s->mutex);
  return RF_GO_ON;
}

static bool render(Shot *s)
{
  rf_film *f = rf_film_create(s->engine, s->width, s->height, RF_BEAUTY);
  s->render.progress = progress;
  s->render.user = s;
  const bool ok = f && rf_render(s->world, &s->eye, &s->render, f, NULL) == RF_OK &&
                  rf_film_save(f, &s->develop, NULL, s->path);
  rf_film_destroy(f);
  return ok;
}

static void *shot_main(void *user)
{
  Shot *s = user;
  const bool ok = render(s);
  const char *text = "";
  if (!ok) rf_error(s->engine, &text);
  pthread_mutex_lock(&s->mutex);
  snprintf(s->message, sizeof s->message, "%s%.580s", ok ? "saved " : "", ok ? s->path : text);
  s->done = ok;
  s->is_done = true;
  pthread_mutex_unlock(&s->mutex);
  return NULL;
}

// Threads inherit the priority of the one that makes them; on Linux each has its own.
static void *shot_begin_main(void *user)
{
  Shot *s = user;
  setpriority(PRIO_PROCESS, 0, 19);
  shot_main(s);
  return NULL;
}

static void *engine_main(void *user)
{
  Shot *s = user;
  if (setpriority(PRIO_PROCESS, 0, 19)) s->done = 0; // then it competes: slower, not wrong
  s->engine = rf_engine_create(NULL);
  return NULL;
}

// "showcase-001.png" in the current folder, the first that is free.
static bool choose_path(View *v, char out[1024])
{
  const char *name = strrchr(v->path, '/');
  name = name ? name + 1 : v->path;
  const int n = (int)strcspn(name, ".");
  do snprintf(out, 1024, "%.*s-%03d.png", n > 200 ? 200 : n, name, ++v->shot_number);
  while (access(out, F_OK) == 0 && v->shot_number < 999);
  return access(out, F_OK) != 0;
}

void shot_begin(View *v)
{
  Shot *s = &v->shot;
  if (s->is_running || !v->live) return note_say(v, true, "one picture at a time");
  if (!choose_path(v, s->path)) return note_say(v, true, "%s and all before it are there already", s->path);
  pthread_t maker;
  if (!s->engine && !pthread_create(&maker, NULL, engine_main, s)) pthread_join(maker, NULL);
  rf_world *w = s->engine ? rf_live_world(v->live) : NULL;
  s->world = w ? rf_world_share(w, s->engine) : NULL;
  rf_world_destroy(w);
  if (!s->world) return note_library(v);
  s->eye = walker_eye(&v->walker);
  s->render = v->wanted.render;
  s->develop = v->wanted.develop;
  s->width = v->width;
  s->height = v->height;
  s->is_done = false;
  s->done = 0;
  if (v->script) { // a script's next line may look at the file
    shot_main(s);
    s->is_running = true;
    return;
  }
  s->is_running = !pthread_create(&s->thread, NULL, shot_begin_main, s);
  note_say(v, false, "rendering %s", s->path);
}

void shot_step(View *v)
{
  Shot *s = &v->shot;
  if (!s->is_running) return;
  pthread_mutex_lock(&s->mutex);
  const bool is_done = s->is_done;
  pthread_mutex_unlock(&s->mutex);
  if (!is_done) return;
  if (!v->script) pthread_join(s->thread, NULL);
  s->is_running = false;
  note_say(v, s->done < 1, "%s", s->message);
  rf_world_destroy(s->world);
  s->world = NULL;
}

void shot_finish(View *v)
{
  Shot *s = &v->shot;
  if (s->is_running && !v->script) {
    rf_cancel(s->engine);
    pthread_join(s->thread, NULL);
  }
  rf_world_destroy(s->world);
  rf_engine_destroy(s->engine);
  pthread_mutex_destroy(&s->mutex);
}

// --- pixels of the window -------------------------------------------------------------------------
static float decoded(uint32_t code)
{
  static float table[256]; // of the sRGB curve; filled by the first who asks, on the one thread that does
  if (table[255] == 0)
    for (int i = 0; i < 256; i++) {
      const double c = i / 255.0;
      table[i] = (float)(c <= 0.04045 ? c / 12.92 : __builtin_pow((c + 0.055) / 1.055, 2.4));
    }
  return table[code & 255];
}

bool pixels_save(View *v, const uint32_t *pixels, int width, int height, const char *path)
{
  const size_t n = (size_t)width * (size_t)height;
  rf_image img = {width, height, 3, malloc(n * 3 * sizeof(float))};
  if (!img.pixels) return false;
  for (size_t i = 0; i < n; i++)
    for (int k = 0; k < 3; k++) img.pixels[3 * i + k] = decoded(pixels[i] >> (16 - 8 * k));
  const bool ok = rf_image_save(v->engine, &img, NULL, path);
  free(img.pixels);
  return ok;
}
