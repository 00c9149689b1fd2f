// NanoVDB files, by the one header of theirs that is C. The sparse tree is laid out as a dense grid over the box of its
// active values. Every read is checked against the file's size (a place outside reads 0), and what could make a lookup
// long is checked first, so a hostile file ends in a wrong grid or an error and nothing else.
//
// Only grids of plain floats, not compressed, not turned.

#include "image/grid.h"

#include "base/mem.h"

#include <math.h>
#include <string.h>

#ifdef RAYFOLD_HAVE_NANOVDB

#define PNANOVDB_C
#define PNANOVDB_BUF_BOUNDS_CHECK
#include <nanovdb/PNanoVDB.h>

enum { HEAD_SIZE = 16, META_SIZE = 176, MOST_TILES = 64 }; // a tile is 4096 values wide, so a grid we take has at most 8 parts

typedef struct NvdbFile {
  pnanovdb_buf_t buf;
  uint32_t *words; // owned
  pnanovdb_root_handle_t root;
  pnanovdb_map_handle_t map;
} NvdbFile;

static uint64_t get64(const uint8_t *p)
{
  uint64_t x;
  memcpy(&x, p, 8);
  return x;
}

static uint32_t get32(const uint8_t *p)
{
  uint32_t x;
  memcpy(&x, p, 4);
  return x;
}

static bool fail(const char *path, const char *what, Err *err)
{
  return err_set(err, ERR_BAD_SCENE, "%s: %s", path, what);
}

// The first grid of the file into aligned memory.
static bool open_grid(NvdbFile *f, const uint8_t *data, size_t size, const char *path, Err *err)
{
  if (size < HEAD_SIZE + META_SIZE) return fail(path, "the NanoVDB file is cut off", err);
  const uint32_t count = data[12] | (uint32_t)data[13] << 8, codec = data[14] | (uint32_t)data[15] << 8;
  if (!count) return fail(path, "the NanoVDB file holds no grid", err);
  if (codec) return fail(path, "the NanoVDB file is compressed; write it without a codec", err);
  size_t at = HEAD_SIZE;
  uint64_t bytes = 0;
  for (uint32_t i = 0; i < count; i++) { // the grids follow all of their heads
    if (size - at < META_SIZE) return fail(path, "the NanoVDB file is cut off", err);
    if (!i) bytes = get64(data + at);
    if (!i && get32(data + at + 32) != PNANOVDB_GRID_TYPE_FLOAT)
      return fail(path, "the first grid of the NanoVDB file does not hold plain floats, which alone are read", err);
    const uint64_t name = get32(data + at + 136);
    if (name > size - at - META_SIZE) return fail(path, "the NanoVDB file is cut off", err);
    at += META_SIZE + (size_t)name;
  }
  if (bytes < PNANOVDB_GRID_SIZE + PNANOVDB_TREE_SIZE || bytes > size - at)
    return fail(path, "the NanoVDB file is cut off", err);
  const size_t words = (size_t)(bytes + 7) / 8 * 2;
  f->words = mem_zero(words, sizeof *f->words);
  if (!f->words) return err_memory(err, path, words * sizeof *f->words);
  memcpy(f->words, data + at, (size_t)bytes);
  f->buf = pnanovdb_make_buf(f->words, words);
  return true;
}

static bool find_root(NvdbFile *f, const char *path, Err *err)
{
  const pnanovdb_grid_handle_t grid = {{0}};
  if (pnanovdb_grid_get_grid_type(f->buf, grid) != PNANOVDB_GRID_TYPE_FLOAT)
    return fail(path, "the NanoVDB file contradicts itself about what it holds", err);
  f->map = pnanovdb_grid_get_map(f->buf, grid);
  f->root = pnanovdb_tree_get_root(f->buf, pnanovdb_grid_get_tree(f->buf, grid));
  if (pnanovdb_root_get_tile_count(f->buf, f->root) > MOST_TILES)
    return fail(path, "the grid of the NanoVDB file reaches too far; crop it", err);
  return true;
}

// The box of active values, and where the map puts it: values stand in the middle of voxels one unit wide.
static bool find_box(const NvdbFile *f, Grid *g, int32_t first[3], const char *path, Err *err)
{
  const pnanovdb_coord_t low = pnanovdb_root_get_bbox_min(f->buf, f->root), high = pnanovdb_root_get_bbox_max(f->buf, f->root);
  const int32_t lows[3] = {low.x, low.y, low.z}, highs[3] = {high.x, high.y, high.z};
  for (uint32_t k = 0; k < 3; k++) {
    const int64_t wide = (int64_t)highs[k] - lows[k] + 1;
    if (wide < 1 || wide > GRID_MOST_SIDE)
      return err_set(err, ERR_BAD_SCENE, "%s: the grid is %lld values wide along an axis; 1 to %d are possible", path,
                     (long long)wide, GRID_MOST_SIDE);
    const double unit = pnanovdb_map_get_matd(f->buf, f->map, 4 * k), offset = pnanovdb_map_get_vecd(f->buf, f->map, k);
    for (uint32_t c = 0; c < 3; c++)
      if (c != k && pnanovdb_map_get_matd(f->buf, f->map, 3 * k + c) != 0)
        return fail(path, "the grid of the NanoVDB file is turned against its axes; turn the object instead", err);
    g->size[k] = (uint32_t)wide;
    first[k] = lows[k];
    g->lo[k] = (float)(unit * (lows[k] - 0.5) + offset);
    g->hi[k] = (float)(unit * (highs[k] + 0.5) + offset);
    if (!isfinite(g->lo[k]) || !isfinite(g->hi[k]) || !(g->lo[k] < g->hi[k]))
      return fail(path, "the grid of the NanoVDB file has no size", err);
  }
  return true;
}

static void fill(const NvdbFile *f, const Grid *g, const int32_t first[3])
{
  pnanovdb_readaccessor_t acc;
  pnanovdb_readaccessor_init(&acc, f->root);
  size_t i = 0;
  for (uint32_t z = 0; z < g->size[2]; z++)
    for (uint32_t y = 0; y < g->size[1]; y++)
      for (uint32_t x = 0; x < g->size[0]; x++) {
        const pnanovdb_coord_t at = {first[0] + (int32_t)x, first[1] + (int32_t)y, first[2] + (int32_t)z};
        const pnanovdb_address_t value =
            pnanovdb_readaccessor_get_value_address(PNANOVDB_GRID_TYPE_FLOAT, f->buf, &acc, &at);
        g->values[i++] = pnanovdb_read_float(f->buf, value);
      }
}

bool grid_read_nvdb(Grid *out, const uint8_t *data, size_t size, const char *path, Err *err)
{
  NvdbFile f = {0};
  int32_t first[3];
  bool ok = open_grid(&f, data, size, path, err) && find_root(&f, path, err) && find_box(&f, out, first, path, err) &&
            grid_allocate(out, path, err);
  if (ok) fill(&f, out, first);
  mem_free(f.words);
  return ok && grid_check(out, path, err);
}

#else

bool grid_read_nvdb(Grid *out, const uint8_t *data, size_t size, const char *path, Err *err)
{
  (void)out, (void)data, (void)size;
  return err_set(err, ERR_BAD_SCENE, "%s: this Rayfold was built without NanoVDB; install libnanovdb-dev and build it again, "
                 "or write a .grid (docs/media.md)", path);
}

#endif
