// All voxels of a scene in one grid, cell by cell: for objects that are moved by whole cells and turned by quarters, as
// those of a .vox file are. Others must be sampled anew (world/voxelise.h).

#include "base/mem.h"
#include "image/voxels.h"
#include "scene/scene.h"

#include <math.h>
#include <stdint.h>

typedef struct Placed { // an object's map from its cells to those of the whole, in whole numbers
  const Voxels *v;
  int axis[3], sign[3]; // row k is sign[k] at column axis[k]
  double at[3];
} Placed;

static bool place(const Scene *s, const Object *o, double cell, Placed *out)
{
  const Frame f = object_frame(&o->common);
  const Vec3 columns[3] = {f.x, f.y, f.z};
  const float size = o->shape.voxels.voxel_size;
  if (o->shape.kind != SHAPE_VOXELS || o->shape.voxels_i < 0 || fabs((double)size - cell) > 1e-6 * cell) return false;
  out->v = s->voxels.items[o->shape.voxels_i].data;
  const Vec3 from = frame_point(&f, voxels_origin(&o->shape.voxels, out->v));
  for (int k = 0; k < 3; k++) {
    out->axis[k] = -1;
    for (int j = 0; j < 3; j++) {
      if (fabsf(columns[j][k]) < 1e-5f) continue;
      if (out->axis[k] >= 0 || fabsf(fabsf(columns[j][k]) - 1) > 1e-5f) return false;
      out->axis[k] = j;
      out->sign[k] = columns[j][k] > 0 ? 1 : -1;
    }
    out->at[k] = (double)from[k] / cell;
    if (out->axis[k] < 0) return false;
  }
  return true;
}

// The first corner of the cell that a cell goes to, in cells.
static void moved_cell(const Placed *p, const int32_t c[3], double out[3])
{
  for (int k = 0; k < 3; k++) out[k] = p->at[k] + (p->sign[k] > 0 ? c[p->axis[k]] : -c[p->axis[k]] - 1);
}

static bool copy_cells(const Placed *p, const double corner[3], VoxelEdit *e)
{
  const VoxelPalette *from = p->v->palette;
  int32_t *entries = mem_zero(from->entry_count, sizeof *entries);
  bool ok = entries;
  for (uint32_t i = 1; ok && i < from->entry_count; i++) {
    const int32_t look = voxel_edit_look(e, &from->looks[from->entries[i].look]);
    entries[i] = voxel_edit_color(e, from->entries[i].color, look < 0 ? 0 : (uint32_t)look);
    ok = entries[i] >= 0;
  }
  int32_t c[3];
  for (c[2] = p->v->lo[2]; ok && c[2] < p->v->hi[2]; c[2]++)
    for (c[1] = p->v->lo[1]; ok && c[1] < p->v->hi[1]; c[1]++)
      for (c[0] = p->v->lo[0]; ok && c[0] < p->v->hi[0]; c[0]++) {
        const uint32_t entry = voxels_entry(p->v, c[0], c[1], c[2]);
        double to[3];
        if (!entry) continue;
        moved_cell(p, c, to);
        ok = voxel_edit_put(e, (int32_t)lround(to[0] - corner[0]), (int32_t)lround(to[1] - corner[1]),
                            (int32_t)lround(to[2] - corner[2]), (uint32_t)entries[entry]);
      }
  mem_free(entries);
  return ok;
}

Voxels *scene_merge_voxels(const Scene *s, Err *err)
{
  double lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
  const double cell = s->objects.count ? (double)s->objects.items[0].shape.voxels.voxel_size : 1;
  if (!s->objects.count || s->objects.items[0].shape.kind != SHAPE_VOXELS) return NULL;
  for (size_t i = 0; i < s->objects.count; i++) {
    Placed p;
    if (!place(s, &s->objects.items[i], cell, &p)) return NULL;
    const int32_t ends[2][3] = {{p.v->lo[0], p.v->lo[1], p.v->lo[2]}, {p.v->hi[0] - 1, p.v->hi[1] - 1, p.v->hi[2] - 1}};
    for (int n = 0; n < 2; n++) {
      double at[3];
      moved_cell(&p, ends[n], at);
      for (int k = 0; k < 3; k++) {
        lo[k] = fmin(lo[k], at[k]);
        hi[k] = fmax(hi[k], at[k] + 1);
        if (fabs(at[k] - lo[k] - round(at[k] - lo[k])) > 1e-2) return NULL;
      }
    }
  }
  int32_t size[3];
  for (int k = 0; k < 3; k++) size[k] = hi[k] - lo[k] > 0 && hi[k] - lo[k] < 1e6 ? (int32_t)lround(hi[k] - lo[k]) : 0;
  VoxelEdit *e = voxel_edit_create(size, err);
  bool ok = e;
  for (size_t i = 0; ok && i < s->objects.count; i++) {
    Placed p;
    ok = place(s, &s->objects.items[i], cell, &p) && (copy_cells(&p, lo, e) || err_memory(err, "voxels", 0));
  }
  if (ok) return voxel_edit_end(e, err);
  voxel_edit_destroy(e);
  return NULL;
}
