// What the tests of the model importers share: models written to a folder of their own, loaded, and broken in every
// way there is time for.

#ifndef RAYFOLD_TESTS_MODEL_H
#define RAYFOLD_TESTS_MODEL_H

#include "base/file.h"
#include "base/hash.h"
#include "base/mem.h"
#include "scene/scene.h"

#include "tests/test.h"

#include <unistd.h>

typedef bool Importer(Scene *s, const char *path, const LoadOptions *options, Err *err);

// A path in this run's temporary folder; valid until the call after the next three.
static inline const char *model_path(const char *name)
{
  static char folder[100], paths[4][200];
  static int next;
  if (!folder[0]) {
    const char *tmp = getenv("TMPDIR");
    snprintf(folder, sizeof folder, "%.60s/rayfold-XXXXXX", tmp ? tmp : "/tmp");
    if (!mkdtemp(folder)) abort();
  }
  char *path = paths[next++ % 4];
  snprintf(path, sizeof paths[0], "%s/%.80s", folder, name);
  return path;
}

// At the end of a test file: removes the folder and the files named.
static inline void model_clean(const char *const *names, size_t count)
{
  for (size_t i = 0; i < count; i++) unlink(model_path(names[i]));
  rmdir(model_path(""));
}

static inline const char *model_write(const char *name, const void *data, size_t size)
{
  const char *path = model_path(name);
  test_put_file(path, data, size);
  return path;
}

// A loaded scene, or NULL and the error's text.
static inline Scene *model_load_file(Importer *import, const char *path, Err *err)
{
  *err = (Err){0};
  Scene *s = scene_create(err);
  if (s && import(s, path, NULL, err)) {
    CHECK(err->kind == ERR_NONE);
    return s;
  }
  CHECK(err->kind != ERR_NONE && err->text[0]);
  scene_destroy(s);
  return NULL;
}

static inline Scene *model_load(Importer *import, const char *name, const void *data, size_t size, Err *err)
{
  return model_load_file(import, model_write(name, data, size), err);
}

static inline bool has_note(const Scene *s, const char *part)
{
  for (size_t i = 0; i < s->notes.lines.count; i++)
    if (strstr(s->notes.lines.items[i], part)) return true;
  return false;
}

static inline double mesh_area(const MeshData *m)
{
  double area = 0;
  for (size_t t = 0; t < m->triangle_count; t++) {
    Vec3 p[3];
    for (int k = 0; k < 3; k++) p[k] = v3_load(m->positions + 3 * (size_t)m->triangles[3 * t + k]);
    area += (double)v3_length(v3_cross(p[1] - p[0], p[2] - p[0])) / 2;
  }
  return area;
}

// Signed: positive when the triangles face outwards.
static inline double mesh_volume(const MeshData *m)
{
  double volume = 0;
  for (size_t t = 0; t < m->triangle_count; t++) {
    Vec3 p[3];
    for (int k = 0; k < 3; k++) p[k] = v3_load(m->positions + 3 * (size_t)m->triangles[3 * t + k]);
    volume += (double)v3_dot(p[0], v3_cross(p[1], p[2])) / 6;
  }
  return volume;
}

// A scene that loaded must be whole, whatever the file was.
static inline void check_whole(const Scene *s)
{
  for (size_t i = 0; i < s->meshes.count; i++) {
    const Mesh *mesh = &s->meshes.items[i];
    const MeshData *m = mesh->data;
    CHECK(m->triangle_count > 0);
    for (size_t t = 0; t < 3 * m->triangle_count; t++) {
      CHECK(m->triangles[t] < m->vertex_count);
      for (size_t k = 0; k < 3; k++) CHECK(isfinite(m->positions[3 * (size_t)m->triangles[t] + k]));
    }
    for (size_t t = 0; m->material_slots && t < m->triangle_count; t++)
      CHECK(m->material_slots[t] < mesh->slot_count);
    for (size_t k = 0; k < mesh->slot_count; k++)
      CHECK(mesh->slots[k] >= -1 && mesh->slots[k] < (int32_t)s->materials.count);
  }
}

// The file cut at every length, then with bytes changed at random; nothing may crash (ASan watches) or load into a
// scene that is not whole.
static inline void model_break(Importer *import, const char *name, const void *data, size_t size,
                               int flip_count)
{
  Err err;
  char *copy = malloc(size + 1);
  for (size_t n = 0; n < size; n++) {
    Scene *s = model_load(import, name, data, n, &err);
    if (s) check_whole(s);
    scene_destroy(s);
  }
  for (int i = 0; i < flip_count; i++) {
    memcpy(copy, data, size);
    const uint32_t r = hash_u32((uint32_t)i);
    for (uint32_t k = 0; k <= r % 3; k++) {
      const uint32_t q = hash_combine(r, k);
      copy[q % size] = (char)(hash_u32(q) % 4 ? hash_u32(q) >> 8 : (uint32_t) "0-9/e. \n"[(q >> 20) % 8]);
    }
    Scene *s = model_load(import, name, copy, size, &err);
    if (s) check_whole(s);
    scene_destroy(s);
  }
  free(copy);
}

// Every allocation in turn fails: a clean error each time (LeakSanitizer watches), until none is left to fail.
static inline void model_starve(Importer *import, const char *path)
{
  for (long n = 1; n < 2000; n++) {
    Err err = {0};
    Scene *s = scene_create(&err);
    mem_fail_after(n);
    const bool ok = import(s, path, NULL, &err);
    mem_fail_after(0);
    scene_destroy(s);
    if (ok) return;
    CHECK(err.kind != ERR_NONE);
  }
  CHECK_MSG(false, "the import of %s never succeeds", path);
}

#endif
