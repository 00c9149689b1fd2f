// A world from text by the public interface, for tests of what is asked of worlds.

#ifndef RAYFOLD_TESTS_PLACE_H
#define RAYFOLD_TESTS_PLACE_H

#include "tests/test.h"

#include <rayfold/rayfold.h>

#include <unistd.h>

typedef struct Place {
  rf_engine *engine;
  rf_scene *scene;
  rf_world *world;
} Place;

static inline Place place_of(const char *json)
{
  char path[] = "/tmp/rayfold-place-XXXXXX.json";
  const int fd = mkstemps(path, 5);
  const size_t size = strlen(json);
  CHECK(fd >= 0 && write(fd, json, size) == (ssize_t)size);
  close(fd);
  rf_engine_def def = rf_default_engine_def();
  def.threads = 1;
  Place p = {.engine = rf_engine_create(&def)};
  const char *text = "";
  p.scene = rf_scene_load(p.engine, path, NULL);
  p.world = p.scene ? rf_prepare(p.scene, NULL) : NULL;
  if (!p.world) rf_error(p.engine, &text);
  CHECK_MSG(p.world, "%s", text);
  unlink(path);
  return p;
}

static inline void leave(Place *p)
{
  rf_world_destroy(p->world);
  rf_scene_destroy(p->scene);
  rf_engine_destroy(p->engine);
}

#endif
