// Voxels as smoke: an object of voxels that a medium fills has no surface. The medium is as thick as it says where cells
// are filled and is not there where they are empty. Where nothing is seen behind it, it has the colours of the palette
// (shade/albedo.h), and the shine of cells that shine, which scatter nothing. Bounds are kept a brick, or so many bricks
// that there are 64 along a side at most; the box of such bounds may reach beyond the grid, where all is empty.

#include "base/hash.h"
#include "shade/albedo.h"
#include "world/density.h"

#include <string.h>

enum { BRICK = 8, MOST_CELLS = 64 };

// Marks the cells that hold a brick of the node whose first cell is at `base`.
static void mark_node(Density *d, const VoxelNode *n, const int32_t base[3], int32_t side)
{
  for (int32_t b = 0; b < 512; b++) {
    const int32_t brick[3] = {base[0] + BRICK * (b & 7), base[1] + BRICK * (b >> 3 & 7), base[2] + BRICK * (b >> 6)};
    if (!((n->some[b >> 6] | n->full[b >> 6]) >> (b & 63) & 1)) continue;
    const size_t x = (size_t)(brick[0] / side), y = (size_t)(brick[1] / side), z = (size_t)(brick[2] / side);
    d->most[(z * d->cells[1] + y) * d->cells[0] + x] = 1;
  }
}

static bool add_bounds(Density *d, Err *err)
{
  const Voxels *v = d->voxels.cells;
  int32_t side = BRICK;
  for (int k = 0; k < 3; k++)
    while (v->size[k] > side * MOST_CELLS) side *= 2;
  for (int k = 0; k < 3; k++) {
    d->cells[k] = (uint32_t)((v->size[k] + side - 1) / side);
    d->hi[k] = (float)(d->cells[k] * (uint32_t)side);
  }
  const size_t count = (size_t)d->cells[0] * d->cells[1] * d->cells[2];
  d->most = mem_zero(count, sizeof *d->most);
  if (!d->most) return err_memory(err, "the bounds of a medium", count * sizeof *d->most);
  size_t i = 0;
  for (int32_t z = 0; z < v->nodes_size[2]; z++)
    for (int32_t y = 0; y < v->nodes_size[1]; y++)
      for (int32_t x = 0; x < v->nodes_size[0]; x++, i++)
        if (v->nodes[i]) mark_node(d, v->nodes[i], (int32_t[]){64 * x, 64 * y, 64 * z}, side);
  return true;
}

static bool add_palette(Density *d, Err *err)
{
  const VoxelPalette *p = d->voxels.cells->palette;
  d->voxels.tints = mem_zero(p->entry_count, sizeof *d->voxels.tints);
  d->voxels.glows = mem_zero(p->entry_count, sizeof *d->voxels.glows);
  if (!d->voxels.tints || !d->voxels.glows) return err_memory(err, "colours of smoke", 2 * p->entry_count * sizeof(Vec3));
  for (uint32_t i = 1; i < p->entry_count; i++) {
    const VoxelLook *l = &p->looks[p->entries[i].look];
    const Vec3 color = v3_load(p->entries[i].color);
    const bool shines = !l->material && l->emission > 0 && !v3_is_zero(color);
    if (shines) d->voxels.glows[i] = l->emission * color;
    else d->voxels.tints[i] = albedo_of_color(color);
    d->has_glow |= shines;
  }
  d->has_tint = true;
  return true;
}

const Density *prepare_voxel_density(Prepare *p, Voxels *v)
{
  const uintptr_t address = (uintptr_t)v; // of what lives as long as the part does
  bool is_made;
  DensityPart *part = prepare_density_part(p, hash_bytes(0x766f78, &address, sizeof address), &is_made);
  if (!part || is_made) return part ? &part->density : NULL;
  part->density.kind = DENSITY_VOXELS;
  part->density.voxels.cells = voxels_share(v);
  return add_bounds(&part->density, p->err) && add_palette(&part->density, p->err) ? &part->density : NULL;
}
