// Rtm: meshes and rays as the measuring tools read them from files (bench/README.md has the formats), and the clock
// they measure by. What goes wrong ends the program.

#ifndef RAYFOLD_TESTS_RTM_H
#define RAYFOLD_TESTS_RTM_H

#include "base/mem.h"
#include "base/ray.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

typedef struct MeshFile {
  uint64_t vertex_count, triangle_count;
  float *positions;
  uint32_t *triangles;
  const char *name;
} MeshFile;

typedef struct RayFile {
  uint32_t is_any;
  uint64_t count;
  char name[32];
  PackedRay *rays;
  struct {
    float t;
    uint32_t prim;
    float uv[2];
  } *hits;
} RayFile;

static inline void die(const char *what, const char *name)
{
  fprintf(stderr, "%s: %s\n", name, what);
  exit(1);
}

static inline void *read_items(FILE *f, size_t count, size_t size, const char *name)
{
  void *items = mem_alloc(count, size);
  if (!items) die("no memory", name);
  if (fread(items, size, count, f) != count) die("is cut short", name);
  return items;
}

static inline FILE *open_file(const char *path, const char *magic)
{
  char head[8];
  FILE *f = fopen(path, "rb");
  if (!f) die("cannot be opened", path);
  if (fread(head, 8, 1, f) != 1 || memcmp(head, magic, 8)) die("is not such a file", path);
  return f;
}

static inline MeshFile read_mesh(const char *path)
{
  FILE *f = open_file(path, "RTBMESH1");
  MeshFile m = {.name = strrchr(path, '/') ? strrchr(path, '/') + 1 : path};
  if (fread(&m.vertex_count, 8, 2, f) != 2) die("is cut short", path);
  m.positions = read_items(f, 3 * m.vertex_count, sizeof *m.positions, path);
  m.triangles = read_items(f, 3 * m.triangle_count, sizeof *m.triangles, path);
  fclose(f);
  return m;
}

static inline RayFile read_rays(const char *path)
{
  RayFile r = {0};
  FILE *f = open_file(path, "RTBRAYS1");
  uint64_t triangles;
  uint32_t coherent;
  const bool ok = fread(&r.is_any, 4, 1, f) == 1 && fread(&coherent, 4, 1, f) == 1 && fread(&r.count, 8, 1, f) == 1 &&
                  fread(&triangles, 8, 1, f) == 1 && fread(r.name, 32, 1, f) == 1;
  if (!ok) die("is cut short", path);
  r.rays = read_items(f, r.count, sizeof *r.rays, path);
  r.hits = read_items(f, r.count, sizeof *r.hits, path);
  fclose(f);
  return r;
}

static inline double seconds(clockid_t clock)
{
  struct timespec t;
  clock_gettime(clock, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

#endif
