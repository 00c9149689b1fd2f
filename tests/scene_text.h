// Scenes written as text in a test, and their pictures by the scene's own camera and settings.

#ifndef RAYFOLD_TESTS_SCENE_TEXT_H
#define RAYFOLD_TESTS_SCENE_TEXT_H

#include "tests/render_sample.h"

#include <unistd.h>

// NULL, with the reason, if it is refused.
static inline Scene *scene_of(const char *json, Err *err)
{
  char path[] = "/tmp/rayfold-scene-XXXXXX";
  const int fd = mkstemp(path);
  const size_t size = strlen(json);
  CHECK(fd >= 0 && write(fd, json, size) == (ssize_t)size);
  close(fd);
  Scene *s = scene_create(NULL);
  const bool ok = import_json(s, path, NULL, err);
  unlink(path);
  if (ok) return s;
  scene_destroy(s);
  return NULL;
}

static inline Film *film_of(Scene *s, Integrator integrator, IsaLevel isa)
{
  Err err = {0};
  s->render.integrator = (int32_t)integrator;
  World *w = world_prepare(s, NULL, NULL, NULL, NULL, &err);
  Film *f = film_create((uint32_t)s->render.size[0], (uint32_t)s->render.size[1], 1 << FILM_BEAUTY, NULL);
  RenderJob job = {.world = w, .settings = s->render, .film = f, .end_sample = (uint32_t)s->render.spp, .seed = 1};
  CHECK_MSG(w && f && eye_from_camera(&s->camera, &job.eye, NULL), "%s", err.text);
  RenderStats stats = {0};
  if (w) {
    eye_bend(&s->camera, w->cells[job.eye.cell].curvature, &job.eye);
    CHECK(render_run(&job, NULL, hot_table(isa), NULL, &stats, NULL));
  }
  CHECK(stats.bad_samples == 0);
  world_release(w);
  return f;
}

static inline Film *picture_of(const char *json, Integrator integrator, IsaLevel isa)
{
  Err err = {0};
  Scene *s = scene_of(json, &err);
  CHECK_MSG(s, "%s", err.text);
  Film *f = s ? film_of(s, integrator, isa) : NULL;
  scene_destroy(s);
  return f;
}

#endif
