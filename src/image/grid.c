// See grid.h: our own format, and which reader a file is for.

#include "image/grid.h"

#include "base/file.h"
#include "base/mem.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

void grid_finish(Grid *g)
{
  mem_free(g->values);
  *g = (Grid){0};
}

static double memory_size(void)
{
  return (double)sysconf(_SC_PHYS_PAGES) * (double)sysconf(_SC_PAGESIZE);
}

bool grid_allocate(Grid *out, const char *path, Err *err)
{
  const uint32_t *n = out->size;
  const double bytes = (double)n[0] * n[1] * n[2] * sizeof(float);
  for (int k = 0; k < 3; k++)
    if (!n[k] || n[k] > GRID_MOST_SIDE)
      return err_set(err, ERR_BAD_SCENE, "%s: a grid's sides must be 1 to %d values long, and this is %u x %u x %u", path,
                     GRID_MOST_SIDE, n[0], n[1], n[2]);
  if (bytes > memory_size() / 2)
    return err_set(err, ERR_NO_MEMORY, "%s: a grid of %u x %u x %u values needs %.1f GB, more than half of this machine's "
                   "%.1f GB; make it coarser", path, n[0], n[1], n[2], bytes * 1e-9, memory_size() * 1e-9);
  out->values = mem_alloc((size_t)n[0] * n[1] * n[2], sizeof *out->values);
  return out->values || err_memory(err, path, (size_t)bytes);
}

bool grid_check(const Grid *g, const char *path, Err *err)
{
  size_t i = 0;
  for (size_t z = 0; z < g->size[2]; z++)
    for (size_t y = 0; y < g->size[1]; y++)
      for (size_t x = 0; x < g->size[0]; x++, i++) {
        const float v = g->values[i];
        if (v >= 0 && isfinite(v)) continue;
        return err_set(err, ERR_BAD_SCENE, "%s: the value at (%zu, %zu, %zu) is %g; densities must be finite and not negative",
                       path, x, y, z, (double)v);
      }
  return true;
}

static bool fail_format(const char *path, const char *what, Err *err)
{
  return err_set(err, ERR_BAD_SCENE, "%s: %s; a grid file begins with the lines \"rayfold-grid 1\", \"size X Y Z\", \"box ...\" "
                 "and \"data float32\" (see docs/media.md)", path, what);
}

// One line of the head into a text of its own; false if there is none of a head's length.
static bool next_line(const uint8_t *data, size_t size, size_t *at, char line[256])
{
  size_t n = 0;
  while (*at + n < size && n < 255 && data[*at + n] != '\n') n++;
  if (*at + n >= size || data[*at + n] != '\n') return false;
  memcpy(line, data + *at, n);
  line[n] = 0;
  *at += n + 1;
  return true;
}

static bool check_box(const Grid *g)
{
  for (int k = 0; k < 3; k++)
    if (!isfinite(g->lo[k]) || !isfinite(g->hi[k]) || !(g->lo[k] < g->hi[k]) || !isfinite(g->hi[k] - g->lo[k])) return false;
  return true;
}

// The longest side is 1 m, the middle at the origin.
static void default_box(Grid *g)
{
  uint32_t longest = 1;
  for (int k = 0; k < 3; k++) longest = g->size[k] > longest ? g->size[k] : longest;
  for (int k = 0; k < 3; k++) {
    g->hi[k] = (float)(g->size[k] ? g->size[k] : 1) / (2 * (float)longest); // a size of 0 is refused later
    g->lo[k] = -g->hi[k];
  }
}

// The head; *at is then where the values begin.
static bool read_head(Grid *g, const uint8_t *data, size_t size, size_t *at, size_t *value_size, const char *path, Err *err)
{
  char line[256], rest[2];
  bool has_box = false;
  *value_size = 0;
  if (!next_line(data, size, at, line) || strcmp(line, "rayfold-grid 1") != 0) return fail_format(path, "it is no grid", err);
  while (!*value_size) {
    if (!next_line(data, size, at, line)) return fail_format(path, "its head is cut off", err);
    if (sscanf(line, "size %u %u %u %1s", &g->size[0], &g->size[1], &g->size[2], rest) == 3) continue;
    if (sscanf(line, "box %f %f %f %f %f %f %1s", &g->lo[0], &g->lo[1], &g->lo[2], &g->hi[0], &g->hi[1], &g->hi[2], rest) == 6)
      has_box = true;
    else if (!strcmp(line, "data float32"))
      *value_size = 4;
    else if (!strcmp(line, "data uint8"))
      *value_size = 1;
    else
      return fail_format(path, "a line of its head is unknown", err);
  }
  if (!has_box) default_box(g);
  return check_box(g) || fail_format(path, "its box has no inside", err);
}

static bool read_own(Grid *g, const uint8_t *data, size_t size, const char *path, Err *err)
{
  size_t at = 0, value_size;
  if (!read_head(g, data, size, &at, &value_size, path, err)) return false;
  const double wanted = (double)g->size[0] * g->size[1] * g->size[2] * (double)value_size;
  if (!grid_allocate(g, path, err)) return false;
  if ((double)(size - at) != wanted)
    return err_set(err, ERR_BAD_SCENE, "%s: %u x %u x %u values take %.0f bytes, but %zu follow its head", path, g->size[0],
                   g->size[1], g->size[2], wanted, size - at);
  const size_t count = (size_t)g->size[0] * g->size[1] * g->size[2];
  if (value_size == 4) memcpy(g->values, data + at, count * 4);
  for (size_t i = 0; value_size == 1 && i < count; i++) g->values[i] = (float)data[at + i] / 255;
  return grid_check(g, path, err);
}

bool grid_read(Grid *out, const char *path, Err *err)
{
  FileBytes file;
  *out = (Grid){0};
  if (!file_read(&file, path, err)) return false;
  const bool is_nvdb = file.size >= 7 && !memcmp(file.data, "NanoVDB", 7);
  const bool ok = is_nvdb ? grid_read_nvdb(out, file.data, file.size, path, err) : read_own(out, file.data, file.size, path, err);
  file_release(&file);
  if (!ok) grid_finish(out);
  return ok;
}
