// What is done with a hostile file, in the fuzzer and in the test that replays its findings: everything the program
// would do. A model or scene is loaded, described, prepared and rendered in 64 rays; a picture becomes a sky, a lamp's
// file a lamp.

#ifndef RAYFOLD_TESTS_FUZZ_H
#define RAYFOLD_TESTS_FUZZ_H

#include "rayfold/rayfold.h"
#include "tests/seal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char *const fuzz_scenes[] = {"obj", "mtl", "gltf", "glb", "ply", "stl", "vox", "json", "rfm"};
static const char *const fuzz_pictures[] = {"png", "jpg", "hdr", "exr", "webp", "pfm", "ies"};

typedef struct Fuzz {
  rf_engine *engine;
  const char *format; // an extension
  char folder[64];    // of the files it is fed from
} Fuzz;

static inline void fuzz_write(const Fuzz *f, const char *name, const void *data, size_t size)
{
  char path[200];
  snprintf(path, sizeof path, "%s/%s", f->folder, name);
  FILE *out = fopen(path, "wb");
  if (!out || fwrite(data, 1, size, out) != size || fclose(out)) abort();
}

static inline bool fuzz_is_picture(const char *format)
{
  for (size_t i = 0; i < sizeof fuzz_pictures / sizeof *fuzz_pictures; i++)
    if (!strcmp(format, fuzz_pictures[i])) return true;
  return false;
}

// The file that is opened: it is the input itself, or it names the input.
static inline void fuzz_begin(Fuzz *f, const char *format)
{
  char text[300];
  rf_engine_def def = rf_default_engine_def();
  def.threads = 1;
  f->format = format;
  f->engine = rf_engine_create(&def);
  strcpy(f->folder, "/tmp/rayfold-fuzz-XXXXXX");
  if (!f->engine || !mkdtemp(f->folder)) abort();
  if (!strcmp(format, "ies"))
    strcpy(text, "{\"rayfold\": 1, \"lights\": [{\"kind\": \"point\", \"ies\": \"input.ies\"}],"
                 " \"objects\": [{\"shape\": {\"kind\": \"sphere\"}}]}");
  else if (fuzz_is_picture(format))
    snprintf(text, sizeof text, "{\"rayfold\": 1, \"sky\": {\"kind\": \"image\", \"file\": \"input.%s\"}}",
             format);
  else
    snprintf(text, sizeof text,
             "mtllib input.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n");
  fuzz_write(f, fuzz_is_picture(format) ? "opens.json" : "opens.obj", text, strlen(text));
}

static inline void fuzz_render(const Fuzz *f, rf_scene *scene, rf_world *world)
{
  int width, height;
  rf_eye eye;
  rf_render_def def = rf_scene_render_def(scene, &width, &height);
  def.first_sample = 0;
  def.end_sample = 1;
  if (def.max_depth > 4) def.max_depth = 4;
  if (!rf_camera(scene, world, NULL, 1, &eye)) return;
  rf_film *film = rf_film_create(f->engine, 8, 8, RF_ALL_PLANES);
  if (film) rf_render(world, &eye, &def, film, NULL);
  rf_film_destroy(film);
}

// Moves the vertices of the first object's mesh, if it has one, and prepares the next world from this one: refits trust
// a tree more than walks do.
static inline void fuzz_move(const Fuzz *f, rf_scene *scene, const rf_world *world)
{
  const float none[3] = {0};
  const char *why;
  size_t count = 0;
  for (uint32_t id = 0; id < 4 && !count; id++) {
    if (rf_move_vertices(scene, (rf_object){id}, none, NULL, 0)) return;
    rf_error(f->engine, &why);
    const char *has = strstr(why, "the mesh has ");
    if (!has || sscanf(has, "the mesh has %zu", &count) != 1 || !count || count > 100000) continue;
    float *moved = malloc(count * 3 * sizeof *moved);
    for (size_t i = 0; moved && i < 3 * count; i++) moved[i] = (float)((i * 7919) % 101) / 50 - 1;
    const bool ok = moved && rf_move_vertices(scene, (rf_object){id}, moved, NULL, count);
    free(moved);
    rf_world *next = ok ? rf_prepare(scene, world) : NULL;
    if (next) fuzz_render(f, scene, next);
    rf_world_destroy(next);
  }
  rf_error(f->engine, &why);
}

// False: refused, with the reason in text.
static inline bool fuzz_open(const Fuzz *f, const char *path, const char **text)
{
  rf_scene *scene = rf_scene_load(f->engine, path, NULL);
  if (scene) rf_free(rf_scene_info(scene));
  rf_world *world = scene ? rf_prepare(scene, NULL) : NULL;
  if (world) fuzz_render(f, scene, world);
  const bool ok = rf_error(f->engine, text) == RF_OK;
  if (world && ok) fuzz_move(f, scene, world);
  rf_world_destroy(world);
  rf_scene_destroy(scene);
  return ok;
}

// A saved model with a wrong checksum is refused before anything else is looked at, so all are made right.
static inline void fuzz_write_sealed(const Fuzz *f, const char *name, const void *data, size_t size)
{
  void *copy = aligned_alloc(64, (size + 63) / 64 * 64 + 64);
  if (!copy) abort();
  memcpy(copy, data, size);
  seal(copy, size);
  fuzz_write(f, name, copy, size);
  free(copy);
}

static inline bool fuzz_one(const Fuzz *f, const void *data, size_t size, const char **text)
{
  char name[40], path[200];
  snprintf(name, sizeof name, "input.%s", f->format);
  if (!strcmp(f->format, "rfm")) fuzz_write_sealed(f, name, data, size);
  else fuzz_write(f, name, data, size);
  const char *opened = fuzz_is_picture(f->format)  ? "opens.json"
                       : !strcmp(f->format, "mtl") ? "opens.obj"
                                                   : name;
  snprintf(path, sizeof path, "%s/%s", f->folder, opened);
  return fuzz_open(f, path, text);
}

static inline void fuzz_end(Fuzz *f)
{
  char path[200];
  for (int i = 0; i < 3; i++) {
    snprintf(path, sizeof path, "%s/%s.%s", f->folder, i ? "opens" : "input",
             i == 0   ? f->format
             : i == 1 ? "json"
                      : "obj");
    unlink(path);
  }
  rmdir(f->folder);
  rf_engine_destroy(f->engine);
}

#endif
