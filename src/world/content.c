// A hash of what a world shows that its scene's text only names: vertices, triangles, pixels and densities. Two machines that
// read the same files get the same number.

#include "base/hash.h"
#include "world/parts.h"
#include "world/world.h"

static uint64_t hash_floats(uint64_t h, const float *x, size_t count)
{
  return x ? hash_bulk(h, x, count * sizeof *x) : hash_bulk(h, "", 0);
}

static uint64_t mesh_hash(uint64_t h, const MeshData *m)
{
  h = hash_floats(h, m->positions, 3 * m->vertex_count);
  h = hash_floats(h, m->normals, 3 * m->vertex_count);
  for (int i = 0; i < 2; i++) h = hash_floats(h, m->texcoords[i], 2 * m->vertex_count);
  h = hash_floats(h, m->colors, 4 * m->vertex_count);
  h = hash_floats(h, m->tangents, 4 * m->vertex_count);
  h = hash_bulk(h, m->triangles, 3 * m->triangle_count * sizeof *m->triangles);
  return m->material_slots ? hash_bulk(h, m->material_slots, m->triangle_count * sizeof *m->material_slots)
                           : h;
}

static uint64_t image_part_hash(uint64_t h, const Image *i)
{
  const uint32_t head[4] = {i->width, i->height, i->channels, (uint32_t)i->type};
  h = hash_bulk(h, head, sizeof head);
  const size_t size = (size_t)i->width * i->height * i->channels * pixel_size(i->type);
  return i->pixels ? hash_bulk(h, i->pixels, size) : h;
}

static uint64_t values_hash(uint64_t h, const DensityValues *g)
{
  const size_t count = g->values ? (size_t)g->size[0] * g->size[1] * g->size[2] : 0;
  return hash_floats(hash_bulk(h, g->size, sizeof g->size), g->values, count);
}

static uint64_t density_hash(uint64_t h, const Density *d)
{
  switch ((DensityKind)d->kind) {
  case DENSITY_GRID: return values_hash(values_hash(h, &d->grid), &d->heat);
  case DENSITY_BALL: return h; // a formula, which the scene's text has whole
  case DENSITY_VOXELS: return voxels_hash(h, d->voxels.cells);
  }
  unreachable();
}

uint64_t world_content_hash(const World *w)
{
  const WorldParts *p = (const WorldParts *)w->parts;
  uint64_t h = 0;
  for (size_t i = 0; i < p->meshes.count; i++) h = mesh_hash(h, p->meshes.items[i].data);
  for (size_t i = 0; i < p->images.count; i++) h = image_part_hash(h, &p->images.items[i]->image);
  for (size_t i = 0; i < p->voxels.count; i++) h = voxels_hash(h, p->voxels.items[i]);
  for (size_t i = 0; i < p->densities.count; i++) h = density_hash(h, &p->densities.items[i]->density);
  return h;
}
