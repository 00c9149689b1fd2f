// Grids of densities as scenes, and voxels as grids of densities. A grid alone becomes a box of smoke around it; voxels
// become a grid that is 1 in filled cells, one cell wider to each side, so that it falls to 0 inside of its box.

#include "base/file.h"
#include "base/mem.h"
#include "image/grid.h"
#include "image/voxels.h"
#include "scene/scene.h"

#include <stdio.h>
#include <string.h>

static const char *last_part(const char *path)
{
  const char *slash = strrchr(path, '/');
  return slash ? slash + 1 : path;
}

// A look straight through its thickest places would be left with exp(-DEPTH) of what is behind.
static bool add_smoke(Scene *s, const char *path, const Grid *g)
{
  enum { DEPTH = 10 };
  const int32_t medium = scene_add_medium(s, MEDIUM_GRID, "smoke"), object = scene_add_object(s, SHAPE_BOX, "smoke");
  float most = 0, longest = 0;
  const size_t count = (size_t)g->size[0] * g->size[1] * g->size[2];
  if (medium < 0 || object < 0) return false;
  Medium *m = &s->media.items[medium];
  Object *o = &s->objects.items[object];
  for (size_t i = 0; i < count; i++) most = fmaxf(most, g->values[i]);
  for (int k = 0; k < 3; k++) {
    o->shape.box.size[k] = 2 * fmaxf(fabsf(g->lo[k]), fabsf(g->hi[k])); // centred, as boxes are; the grid need not be
    longest = fmaxf(longest, g->hi[k] - g->lo[k]);
  }
  const float scattering = most > 0 ? DEPTH / (most * longest) : 1;
  for (int k = 0; k < 3; k++) m->common.scattering[k] = scattering;
  m->grid.file = arena_text(&s->arena, last_part(path));
  o->common.medium = medium;
  s->render.max_depth = 32;
  return m->grid.file;
}

bool import_grid(Scene *s, const char *path, const LoadOptions *options, Err *err)
{
  (void)options; // it names no others
  Grid g;
  if (!grid_read(&g, path, err)) return false;
  const bool ok = add_smoke(s, path, &g) || err_memory(err, path, sizeof(Object));
  grid_finish(&g);
  return ok;
}

static bool write_cells(FileOut *f, const Voxels *v, Err *err)
{
  const size_t wide = (size_t)(v->hi[0] - v->lo[0]) + 2;
  uint8_t *row = mem_alloc(wide, sizeof *row);
  bool ok = row || err_memory(err, "a row of a grid", wide);
  for (int32_t z = v->lo[2] - 1; ok && z <= v->hi[2]; z++)
    for (int32_t y = v->lo[1] - 1; ok && y <= v->hi[1]; y++) {
      for (size_t x = 0; x < wide; x++) row[x] = voxels_entry(v, v->lo[0] - 1 + (int32_t)x, y, z) ? 255 : 0;
      ok = file_write(f, row, wide, err);
    }
  mem_free(row);
  return ok;
}

bool export_grid(const Voxels *v, double cell, const char *path, Err *err)
{
  char head[400];
  int32_t n[3];
  double half[3];
  FileOut f = {0};
  if (!v->cell_count) return err_set(err, ERR_BAD_SCENE, "%s: there are no voxels to make a grid of", path);
  for (int k = 0; k < 3; k++) {
    n[k] = v->hi[k] - v->lo[k] + 2;
    half[k] = cell * n[k] / 2;
    if (n[k] > GRID_MOST_SIDE)
      return err_set(err, ERR_BAD_SCENE, "%s: the voxels and a border are %d cells wide, and a grid at most %d", path, n[k],
                     GRID_MOST_SIDE);
  }
  snprintf(head, sizeof head, "rayfold-grid 1\nsize %d %d %d\nbox %.9g %.9g %.9g  %.9g %.9g %.9g\ndata uint8\n", n[0], n[1],
           n[2], -half[0], -half[1], -half[2], half[0], half[1], half[2]);
  const bool ok = file_begin(&f, path, err) && file_write(&f, head, strlen(head), err) && write_cells(&f, v, err) &&
                  file_commit(&f, err);
  file_finish(&f);
  return ok;
}
