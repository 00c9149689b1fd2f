// See voxel_step.h. Boxes, balls, lines and cylinders are known by how far a point is from their skin, at least: a whole
// brick that lies farther from it than its corners do is filled or passed in one go, so large bodies cost their skin.

#include "scene/voxel_step.h"

#include "base/array.h"
#include "base/hash.h"
#include "image/image.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef struct Step {
  VoxelEdit *edit;
  const VoxelStep *what;
  float move[3];    // of this repetition
  int32_t entry;    // what is filled in; -1: colours are found one by one
  uint32_t look;
  float color[3];   // linear
  bool keeps_own;   // of what is extruded: its own entry
  uint64_t written; // cells that were inside the grid
  Err *err;
} Step;

static bool failed_memory(const Step *s) { return err_memory(s->err, "voxels", 0); }

// --- colours ------------------------------------------------------------------------------------------------------
// Colours of a cell differ by a few levels a channel, so that the palette stays small: 9 x 9 x 9 at most.
static int32_t random_entry(const Step *s, int32_t x, int32_t y, int32_t z)
{
  const float reach = s->what->common.randomness / 2;
  uint32_t h = hash_combine(hash_combine(hash_combine((uint32_t)s->what->common.seed, (uint32_t)x), (uint32_t)y), (uint32_t)z);
  float color[3];
  // Half of it is brightness alone, which is how stones and leaves differ.
  const float common = ((float)(h % 9) - 4) / 4;
  for (int k = 0; k < 3; k++) {
    h = hash_u32(h + 1);
    const float own = ((float)(h % 3) - 1);
    const float v = srgb_encode(s->color[k]) + reach * (0.7f * common + 0.3f * own);
    color[k] = srgb_decode(v < 0 ? 0 : v > 1 ? 1 : v);
  }
  return voxel_edit_color(s->edit, color, s->look);
}

static bool put(Step *s, int32_t x, int32_t y, int32_t z)
{
  const VoxelMode mode = (VoxelMode)s->what->common.mode;
  const Voxels *grid = voxel_edit_grid(s->edit);
  if ((uint32_t)x >= (uint32_t)grid->size[0] || (uint32_t)y >= (uint32_t)grid->size[1] || (uint32_t)z >= (uint32_t)grid->size[2])
    return true;
  s->written++;
  if (mode == VOXEL_ADD || mode == VOXEL_PAINT) {
    const bool is_filled = voxel_edit_get(s->edit, x, y, z) != 0;
    if (is_filled != (mode == VOXEL_PAINT)) return true;
  }
  const int32_t entry = mode == VOXEL_ERASE ? 0 : s->entry >= 0 ? s->entry : random_entry(s, x, y, z);
  return (entry >= 0 && voxel_edit_put(s->edit, x, y, z, (uint32_t)entry)) || failed_memory(s);
}

// --- bodies -------------------------------------------------------------------------------------------------------
// How far a point is outside the body, below 0 inside: never more than the true distance, exact on the skin.
static float box_distance(const VoxelBox *b, const float p[3])
{
  float most = -INFINITY;
  for (int k = 0; k < 3; k++) most = fmaxf(most, fmaxf(b->corner[k] - p[k], p[k] - (b->corner[k] + b->size[k])));
  return most;
}

static float length3(float x, float y, float z) { return sqrtf(x * x + y * y + z * z); }

static float line_distance(const VoxelStroke *l, const float p[3])
{
  float along = 0, size = 0;
  for (int k = 0; k < 3; k++) {
    along += (p[k] - l->from[k]) * (l->to[k] - l->from[k]);
    size += (l->to[k] - l->from[k]) * (l->to[k] - l->from[k]);
  }
  const float t = size > 0 ? fminf(fmaxf(along / size, 0), 1) : 0;
  float d[3];
  for (int k = 0; k < 3; k++) d[k] = p[k] - (l->from[k] + t * (l->to[k] - l->from[k]));
  return length3(d[0], d[1], d[2]) - l->radius;
}

// Beside its axis; the slant of a cone makes distances to its side smaller by the cosine.
static float cylinder_side(const VoxelCylinder *c, const float p[3], float smaller)
{
  const float top = c->top_radius < 0 ? c->radius : c->top_radius, up = p[1] - c->base[1];
  const float here = c->height > 0 ? c->radius + (top - c->radius) * up / c->height : c->radius;
  const float slope = c->height > 0 ? (top - c->radius) / c->height : 0;
  const float x = p[0] - c->base[0], z = p[2] - c->base[2];
  return (sqrtf(x * x + z * z) - (here - smaller)) / sqrtf(1 + slope * slope);
}

static float body_distance(const VoxelStep *s, const float p[3])
{
  switch ((VoxelStepKind)s->kind) {
  case STEP_BOX: {
    const float d = box_distance(&s->box, p);
    return s->box.hollow > 0 ? fmaxf(d, -d - s->box.hollow) : d;
  }
  case STEP_SPHERE: {
    const float *c = s->sphere.center, d = length3(p[0] - c[0], p[1] - c[1], p[2] - c[2]) - s->sphere.radius;
    return s->sphere.hollow > 0 ? fmaxf(d, -d - s->sphere.hollow) : d;
  }
  case STEP_LINE: return line_distance(&s->line, p);
  case STEP_CYLINDER: {
    const VoxelCylinder *c = &s->cylinder;
    const float ends = fmaxf(c->base[1] - p[1], p[1] - (c->base[1] + c->height)), side = cylinder_side(c, p, 0);
    const float d = fmaxf(ends, side);
    return c->hollow > 0 ? fmaxf(d, -cylinder_side(c, p, c->hollow)) : d;
  }
  case STEP_HILLS:
  case STEP_HEIGHTS:
  case STEP_FLOOD:
  case STEP_EXTRUDE:
  case STEP_REPLACE: break;
  }
  return INFINITY;
}

// The body's box, in whole cells.
static void body_box(const VoxelStep *s, float lo[3], float hi[3])
{
  for (int k = 0; k < 3; k++) switch ((VoxelStepKind)s->kind) {
    case STEP_BOX:
      lo[k] = s->box.corner[k];
      hi[k] = s->box.corner[k] + s->box.size[k];
      break;
    case STEP_SPHERE:
      lo[k] = s->sphere.center[k] - s->sphere.radius;
      hi[k] = s->sphere.center[k] + s->sphere.radius;
      break;
    case STEP_LINE:
      lo[k] = fminf(s->line.from[k], s->line.to[k]) - s->line.radius;
      hi[k] = fmaxf(s->line.from[k], s->line.to[k]) + s->line.radius;
      break;
    case STEP_CYLINDER: {
      const float widest = fmaxf(s->cylinder.radius, s->cylinder.top_radius);
      lo[k] = s->cylinder.base[k] - (k == 1 ? 0 : widest);
      hi[k] = s->cylinder.base[k] + (k == 1 ? s->cylinder.height : widest);
      break;
    }
    case STEP_HILLS:
    case STEP_HEIGHTS:
    case STEP_FLOOD:
    case STEP_EXTRUDE:
    case STEP_REPLACE: lo[k] = hi[k] = 0; break;
    }
}

// The cells of a box of places that lie in the grid: from lo up to, but not with, hi.
static bool clip_cells(const Step *s, const float from[3], const float to[3], int32_t lo[3], int32_t hi[3])
{
  const Voxels *grid = voxel_edit_grid(s->edit);
  bool some = true;
  for (int k = 0; k < 3; k++) {
    const float side = (float)grid->size[k];
    lo[k] = (int32_t)fminf(fmaxf(floorf(from[k] + s->move[k]), 0), side);
    hi[k] = (int32_t)fminf(fmaxf(ceilf(to[k] + s->move[k]), 0), side);
    some &= lo[k] < hi[k];
  }
  return some;
}

static bool fill_cells(Step *s, const int32_t from[3], const int32_t to[3], bool is_whole)
{
  for (int32_t z = from[2]; z < to[2]; z++)
    for (int32_t y = from[1]; y < to[1]; y++)
      for (int32_t x = from[0]; x < to[0]; x++) {
        const float p[3] = {(float)x + 0.5f - s->move[0], (float)y + 0.5f - s->move[1], (float)z + 0.5f - s->move[2]};
        if ((is_whole || body_distance(s->what, p) <= 0) && !put(s, x, y, z)) return false;
      }
  return true;
}

// Cells of many colours take a byte each, at least. What more than half of the machine's memory would be needed for is
// not begun; only whole bricks inside are counted.
static bool has_room(const Step *s, const int32_t lo[3], const int32_t hi[3])
{
  const double memory = (double)sysconf(_SC_PHYS_PAGES) * (double)sysconf(_SC_PAGESIZE);
  const double all = (double)(hi[0] - lo[0]) * (hi[1] - lo[1]) * (hi[2] - lo[2]);
  double bytes = 0;
  if (s->entry >= 0 || s->what->common.mode != VOXEL_SET || all < memory / 2) return true;
  for (int32_t z = lo[2] & ~7; z < hi[2]; z += 8)
    for (int32_t y = lo[1] & ~7; y < hi[1]; y += 8)
      for (int32_t x = lo[0] & ~7; x < hi[0]; x += 8) {
        const float middle[3] = {(float)x + 4 - s->move[0], (float)y + 4 - s->move[1], (float)z + 4 - s->move[2]};
        if (body_distance(s->what, middle) < -6.07f) bytes += 512;
      }
  return bytes < memory / 2 ||
         err_set(s->err, ERR_NO_MEMORY, "cells of random colours need %.1f GB here, more than half of this machine's %.1f GB; fill less, "
                 "or leave out the randomness", bytes * 1e-9, memory * 1e-9);
}

static bool fill_body(Step *s)
{
  float from[3], to[3];
  int32_t lo[3], hi[3];
  body_box(s->what, from, to);
  if (!clip_cells(s, from, to, lo, hi)) return true;
  if (!has_room(s, lo, hi)) return false;
  const VoxelMode mode = (VoxelMode)s->what->common.mode;
  const bool is_plain = mode == VOXEL_ERASE || (mode == VOXEL_SET && s->entry >= 0);
  for (int32_t z = lo[2] & ~7; z < hi[2]; z += 8)
    for (int32_t y = lo[1] & ~7; y < hi[1]; y += 8)
      for (int32_t x = lo[0] & ~7; x < hi[0]; x += 8) {
        const float middle[3] = {(float)x + 4 - s->move[0], (float)y + 4 - s->move[1], (float)z + 4 - s->move[2]};
        const float d = body_distance(s->what, middle), corner = 6.07f; // from a brick's middle to its farthest cell's
        const int32_t a[3] = {x > lo[0] ? x : lo[0], y > lo[1] ? y : lo[1], z > lo[2] ? z : lo[2]};
        const int32_t b[3] = {x + 8 < hi[0] ? x + 8 : hi[0], y + 8 < hi[1] ? y + 8 : hi[1], z + 8 < hi[2] ? z + 8 : hi[2]};
        if (d > corner) continue;
        if (d < -corner && is_plain) {
          if (!voxel_edit_fill(s->edit, a, b, mode == VOXEL_ERASE ? 0 : (uint32_t)s->entry)) return failed_memory(s);
          s->written++;
        } else if (!fill_cells(s, a, b, d < -corner)) {
          return false;
        }
      }
  return true;
}

// --- lands --------------------------------------------------------------------------------------------------------
static float lattice(int32_t x, int32_t z, uint32_t seed)
{
  return unit_float(hash_combine(hash_combine(seed, (uint32_t)x), (uint32_t)z));
}

// Value noise: random heights at whole numbers, joined by smoothstep (Perlin, "An image synthesizer", 1985).
static float noise2(float x, float z, uint32_t seed)
{
  const float fx = floorf(x), fz = floorf(z);
  const int32_t i = (int32_t)fx, k = (int32_t)fz;
  const float u = x - fx, w = z - fz, su = u * u * (3 - 2 * u), sw = w * w * (3 - 2 * w);
  const float a = mix_f(lattice(i, k, seed), lattice(i + 1, k, seed), su);
  const float b = mix_f(lattice(i, k + 1, seed), lattice(i + 1, k + 1, seed), su);
  return mix_f(a, b, sw);
}

static float hill_height(const VoxelStep *s, float x, float z)
{
  float sum = 0, weight = 1, total = 0, size = s->hills.lump;
  for (int32_t o = 0; o < s->hills.octaves; o++, weight /= 2, size /= 2) {
    sum += weight * noise2(x / size, z / size, (uint32_t)(s->common.seed + o));
    total += weight;
  }
  return sum / total * s->hills.size[1];
}

// A column from the land's floor up to a height in cells.
static bool fill_column(Step *s, int32_t x, int32_t z, float floor_y, float height)
{
  const int32_t bottom = (int32_t)floorf(floor_y + s->move[1]), top = (int32_t)floorf(floor_y + s->move[1] + height + 0.5f);
  for (int32_t y = bottom > 0 ? bottom : 0; y < top && y < voxel_edit_grid(s->edit)->size[1]; y++)
    if (!put(s, x, y, z)) return false;
  return true;
}

static bool fill_hills(Step *s)
{
  const VoxelHills *h = &s->what->hills;
  const float to[3] = {h->corner[0] + h->size[0], h->corner[1] + h->size[1], h->corner[2] + h->size[2]};
  int32_t lo[3], hi[3];
  if (!clip_cells(s, h->corner, to, lo, hi)) return true;
  for (int32_t z = lo[2]; z < hi[2]; z++)
    for (int32_t x = lo[0]; x < hi[0]; x++)
      if (!fill_column(s, x, z, h->corner[1], hill_height(s->what, (float)x - s->move[0], (float)z - s->move[2]))) return false;
  return true;
}

static bool fill_picture(Step *s, const Image *img)
{
  const VoxelHeights *h = &s->what->heights;
  const float to[3] = {h->corner[0] + h->size[0], h->corner[1] + h->size[1], h->corner[2] + h->size[2]};
  const bool is_grey = img->channels < 3;
  int32_t lo[3], hi[3];
  if (!clip_cells(s, h->corner, to, lo, hi)) return true;
  for (int32_t z = lo[2]; z < hi[2]; z++)
    for (int32_t x = lo[0]; x < hi[0]; x++) {
      const float u = ((float)x + 0.5f - s->move[0] - h->corner[0]) / h->size[0];
      const float v = ((float)z + 0.5f - s->move[2] - h->corner[2]) / h->size[2];
      const uint32_t px = (uint32_t)fminf(fmaxf(u * (float)img->width, 0), (float)img->width - 1);
      const uint32_t py = (uint32_t)fminf(fmaxf(v * (float)img->height, 0), (float)img->height - 1);
      float sum = 0;
      for (uint32_t c = 0; c < 3; c++) {
        const float value = image_value(img, px, py, is_grey ? 0 : c);
        sum += value;
        if (h->colored) s->color[c] = srgb_decode(fminf(fmaxf(value, 0), 1));
      }
      if (h->colored) s->entry = s->what->common.randomness > 0 ? -1 : voxel_edit_color(s->edit, s->color, s->look);
      if (!fill_column(s, x, z, h->corner[1], fminf(fmaxf(sum / 3, 0), 1) * h->size[1])) return false;
    }
  return true;
}

static bool fill_heights(Step *s, const Scene *scene, const LoadOptions *options)
{
  Text path = {0};
  Image img = {0};
  const bool ok = scene_file_path(scene, s->what->heights.file, options, &path, s->err) &&
                  image_read(&img, text_get(&path), s->err) && fill_picture(s, &img);
  image_finish(&img);
  text_finish(&path);
  return ok;
}

// --- cells that hang together -------------------------------------------------------------------------------------
typedef struct VoxelPlace {
  int16_t at[3];
} VoxelPlace;
typedef ARRAY(VoxelPlace) Cells;

static uint32_t get(const Step *s, const int32_t c[3]) { return voxel_edit_get(s->edit, c[0], c[1], c[2]); }

static bool is_in_grid(const Step *s, const int32_t c[3])
{
  const int32_t *size = voxel_edit_grid(s->edit)->size;
  return (uint32_t)c[0] < (uint32_t)size[0] && (uint32_t)c[1] < (uint32_t)size[1] && (uint32_t)c[2] < (uint32_t)size[2];
}

static bool start_cell(const Step *s, const float at[3], int32_t out[3])
{
  for (int k = 0; k < 3; k++) out[k] = (int32_t)floorf(at[k] + s->move[k]);
  const int32_t *size = voxel_edit_grid(s->edit)->size;
  return is_in_grid(s, out) || err_set(s->err, ERR_BAD_SCENE, "the cell [%d, %d, %d] lies outside the grid of %d x %d x %d voxels",
                                       out[0], out[1], out[2], size[0], size[1], size[2]);
}

// A bit a cell of the grid, for cells that were seen.
static bool see(uint64_t *seen, const int32_t *size, const int32_t c[3])
{
  const size_t i = (size_t)c[0] + (size_t)size[0] * ((size_t)c[1] + (size_t)size[1] * (size_t)c[2]);
  const bool is_new = !(seen[i >> 6] >> (i & 63) & 1);
  seen[i >> 6] |= 1ull << (i & 63);
  return is_new;
}

typedef bool Joins(const Step *s, const int32_t cell[3], uint32_t entry, int face);

// All cells from `first` on that joins() agrees to, spreading over sides other than along `not_along` (-1: all).
static bool gather(Step *s, const int32_t first[3], int not_along, int face, Joins *joins, Cells *out)
{
  const int32_t *size = voxel_edit_grid(s->edit)->size;
  const double bytes = (double)size[0] * size[1] * size[2] / 8;
  const double memory = (double)sysconf(_SC_PHYS_PAGES) * (double)sysconf(_SC_PAGESIZE);
  if (bytes > memory / 4)
    return err_set(s->err, ERR_NO_MEMORY, "to follow cells through a grid of %d x %d x %d takes %.1f GB; use a smaller one",
                   size[0], size[1], size[2], bytes * 1e-9);
  uint64_t *seen = mem_zero((size_t)(bytes / 8) + 1, sizeof *seen);
  if (!seen) return failed_memory(s);
  const uint32_t entry = get(s, first);
  bool ok = true;
  if (joins(s, first, entry, face)) {
    (void)see(seen, size, first);
    ok = array_push(out, ((VoxelPlace){{(int16_t)first[0], (int16_t)first[1], (int16_t)first[2]}}));
  }
  for (size_t i = 0; ok && i < out->count; i++)
    for (int side = 0; ok && side < 6; side++) {
      if (side >> 1 == not_along) continue;
      int32_t c[3] = {out->items[i].at[0], out->items[i].at[1], out->items[i].at[2]};
      c[side >> 1] += side & 1 ? 1 : -1;
      if (is_in_grid(s, c) && joins(s, c, entry, face) && see(seen, size, c))
        ok = array_push(out, ((VoxelPlace){{(int16_t)c[0], (int16_t)c[1], (int16_t)c[2]}}));
    }
  mem_free(seen);
  return ok || failed_memory(s);
}

static bool is_alike(const Step *s, const int32_t c[3], uint32_t entry, int face)
{
  (void)face;
  return get(s, c) == entry;
}

static bool is_alike_and_bare(const Step *s, const int32_t c[3], uint32_t entry, int face)
{
  int32_t out[3] = {c[0], c[1], c[2]};
  out[face >> 1] += face & 1 ? 1 : -1;
  return entry && get(s, c) == entry && !get(s, out);
}

static bool fill_flood(Step *s)
{
  Cells cells = {0};
  int32_t first[3];
  bool ok = start_cell(s, s->what->flood.at, first) && gather(s, first, -1, 0, is_alike, &cells);
  for (size_t i = 0; ok && i < cells.count; i++)
    ok = put(s, cells.items[i].at[0], cells.items[i].at[1], cells.items[i].at[2]);
  array_finish(&cells);
  return ok;
}

static bool extrude(Step *s)
{
  const VoxelExtrude *x = &s->what->extrude;
  const int axis = x->face >> 1, out = x->face & 1 ? 1 : -1;
  Cells cells = {0};
  int32_t first[3];
  bool ok = start_cell(s, x->at, first);
  const uint32_t own = ok ? get(s, first) : 0;
  if (ok && !own) ok = err_set(s->err, ERR_BAD_SCENE, "the cell [%d, %d, %d] is empty, so it has no face to draw out", first[0], first[1], first[2]);
  ok = ok && gather(s, first, axis, x->face, is_alike_and_bare, &cells);
  if (ok && !cells.count)
    ok = err_set(s->err, ERR_BAD_SCENE, "another voxel covers that face of the cell [%d, %d, %d]", first[0], first[1], first[2]);
  for (size_t i = 0; ok && i < cells.count; i++)
    for (int32_t n = 0; ok && n < abs(x->amount); n++) {
      int32_t c[3] = {cells.items[i].at[0], cells.items[i].at[1], cells.items[i].at[2]};
      c[axis] += x->amount > 0 ? out * (n + 1) : -out * n;
      if (!is_in_grid(s, c)) break;
      s->written++;
      if (x->amount < 0) ok = voxel_edit_put(s->edit, c[0], c[1], c[2], 0) || failed_memory(s);
      else if (s->keeps_own) ok = voxel_edit_put(s->edit, c[0], c[1], c[2], own) || failed_memory(s);
      else ok = put(s, c[0], c[1], c[2]);
    }
  array_finish(&cells);
  return ok;
}

// --- replacing ----------------------------------------------------------------------------------------------------
static bool is_color(const float a[3], const float b[3])
{
  for (int k = 0; k < 3; k++)
    if (fabsf(a[k] - b[k]) > 1e-4f) return false;
  return true;
}

static bool replace(Step *s)
{
  const VoxelReplace *r = &s->what->replace;
  const Voxels *grid = voxel_edit_grid(s->edit);
  const VoxelPalette *p = grid->palette;
  const uint32_t count = p->entry_count; // those that join now are not replaced
  const int32_t what = r->what ? voxel_edit_find(s->edit, r->what) : -1;
  if (r->what && what < 0) return err_set(s->err, ERR_BAD_SCENE, "what: there is no voxel \"%.60s\" in the palette", r->what);
  uint8_t *goes = mem_zero(count, 1);
  if (!goes) return failed_memory(s);
  for (uint32_t i = 1; i < count; i++)
    goes[i] = r->what ? i == (uint32_t)what : r->what_color[0] < 0 || is_color(p->entries[i].color, r->what_color);
  bool ok = true;
  for (int32_t z = 0; ok && z < grid->size[2]; z++)
    for (int32_t y = 0; ok && y < grid->size[1]; y++)
      for (int32_t x = 0; ok && x < grid->size[0]; x++) {
        if (!(x & 63) && !grid->nodes[(x >> 6) + (size_t)grid->nodes_size[0] * ((size_t)(y >> 6) + (size_t)grid->nodes_size[1] * (size_t)(z >> 6))] &&
            !voxel_edit_is_open(s->edit, x, y, z)) {
          x += 63;
          continue;
        }
        const uint32_t entry = voxel_edit_get(s->edit, x, y, z);
        if (entry && entry < count && goes[entry]) ok = put(s, x, y, z);
      }
  s->written++; // replacing nothing is no mistake
  mem_free(goes);
  return ok;
}

// --- the whole ----------------------------------------------------------------------------------------------------
static bool choose_entry(Step *s)
{
  const VoxelStepFields *c = &s->what->common;
  memcpy(s->color, c->color, sizeof s->color);
  s->keeps_own = s->what->kind == STEP_EXTRUDE && !c->voxel;
  if (c->voxel) {
    s->entry = voxel_edit_find(s->edit, c->voxel);
    if (s->entry < 0) return err_set(s->err, ERR_BAD_SCENE, "voxel: there is no \"%.60s\" in the palette", c->voxel);
    const VoxelEntry *e = &voxel_edit_grid(s->edit)->palette->entries[s->entry];
    memcpy(s->color, e->color, sizeof s->color);
    s->look = e->look;
  } else if (!s->keeps_own && c->mode != VOXEL_ERASE) {
    s->entry = voxel_edit_color(s->edit, s->color, 0);
    if (s->entry < 0) return failed_memory(s);
  }
  if (c->randomness > 0) s->entry = -1;
  return true;
}

static bool apply_once(Step *s, const Scene *scene, const LoadOptions *options)
{
  switch ((VoxelStepKind)s->what->kind) {
  case STEP_BOX:
  case STEP_SPHERE:
  case STEP_LINE:
  case STEP_CYLINDER: return fill_body(s);
  case STEP_HILLS: return fill_hills(s);
  case STEP_HEIGHTS: return fill_heights(s, scene, options);
  case STEP_FLOOD: return fill_flood(s);
  case STEP_EXTRUDE: return extrude(s);
  case STEP_REPLACE: return replace(s);
  }
  unreachable();
}

bool voxel_step_apply(VoxelEdit *e, const VoxelStep *step, const Scene *scene, const LoadOptions *options, Err *err)
{
  Step s = {.edit = e, .what = step, .err = err};
  if (!choose_entry(&s)) return false;
  for (int32_t i = 0; i < step->common.repeat; i++) {
    for (int k = 0; k < 3; k++) s.move[k] = (float)i * step->common.offset[k];
    if (!apply_once(&s, scene, options)) return false;
  }
  const int32_t *size = voxel_edit_grid(e)->size;
  return s.written || step->kind == STEP_HILLS || step->kind == STEP_HEIGHTS ||
         err_set(err, ERR_BAD_SCENE, "this touches no cell of the grid of %d x %d x %d voxels; their places run from 0, 0, 0 to %d, %d, %d",
                 size[0], size[1], size[2], size[0], size[1], size[2]);
}
