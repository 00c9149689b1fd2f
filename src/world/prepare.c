// scene -> world, as a list of steps. Everything is gathered in growable arrays first and laid into the world's
// arena at the end; nothing of the world is seen by anyone before it is whole.

#include "scene/gates.h"
#include "world/prepare.h"

#include <string.h>

struct WorldParts; // the world's private member is our WorldParts

bool prepare_failed_memory(Prepare *p)
{
  return err_set(p->err, ERR_NO_MEMORY, "not enough memory to prepare the scene; simplify it or close other programs");
}

bool prepare_failed_object(Prepare *p, const Scene *s, int32_t i, const char *message)
{
  const char *name = s->objects.items[i].name;
  return err_set(p->err, ERR_BAD_SCENE, "objects[%d]%s%s%s %s", i, name ? " (\"" : "", name ? name : "", name ? "\")" : "",
                 message);
}

// The default material comes last; slots that named none point to it.
static bool add_default_material(Prepare *p)
{
  const SurfaceMaterial m = surface_default();
  if (!prepare_add_material(p, &m, NULL)) return false;
  const uint32_t last = (uint32_t)p->materials.count - 1;
  for (size_t i = 0; i < p->shading.count; i++) {
    uint32_t *slots = (uint32_t *)(size_t)p->shading.items[i].materials;
    for (uint32_t s = 0; s < p->shading.items[i].slot_count; s++)
      if (slots[s] == UINT32_MAX) slots[s] = last;
  }
  return true;
}

static void set_filters(Prepare *p)
{
  for (size_t i = 0; i < p->materials.count; i++) {
    const SurfaceMaterial *m = &p->materials.items[i];
    p->world->has_panes |= m->transmission > 0 || !v3_is_zero(m->passed);
  }
  for (size_t i = 0; i < p->instances.count; i++) {
    const WorldInstance *w = &p->shading.items[i];
    p->instances.items[i].has_filter |= w->gate || w->clip;
    for (uint32_t s = 0; s < w->slot_count; s++)
      p->instances.items[i].has_filter |= p->materials.items[w->materials[s]].needs_filter;
    p->world->has_filters |= p->instances.items[i].has_filter;
  }
}

static void *keep(Prepare *p, const void *items, size_t count, size_t size)
{
  void *copy = arena_alloc(&p->world->arena, count ? count : 1, size);
  if (copy && count) memcpy(copy, items, count * size);
  return copy;
}

static bool lay_down(Prepare *p)
{
  World *w = p->world;
  w->instances = keep(p, p->shading.items, p->shading.count, sizeof *p->shading.items);
  w->instance_count = p->shading.count;
  w->materials = keep(p, p->materials.items, p->materials.count, sizeof *p->materials.items);
  w->material_names = keep(p, p->material_names.items, p->materials.count, sizeof *p->material_names.items);
  w->material_count = p->materials.count;
  w->textures = keep(p, p->textures.items, p->textures.count, sizeof *p->textures.items);
  w->texture_count = p->textures.count;
  w->volumes = keep(p, p->volumes.items, p->volumes.count, sizeof *p->volumes.items);
  w->media = keep(p, p->media.items, p->media.count, sizeof *p->media.items);
  w->media_count = p->media.count;
  w->clips = keep(p, p->clips.items, p->clips.count, sizeof *p->clips.items);
  for (size_t c = 0; c < w->cell_count; c++) p->cells[c].atmosphere = p->atmospheres[c];
  return (w->clips && w->volumes && w->media && w->instances && w->materials && w->material_names && w->textures) || prepare_failed_memory(p);
}

// A tree for each cell.
static bool build_trees(Prepare *p)
{
  World *w = p->world;
  p->cells = arena_alloc(&w->arena, w->cell_count, sizeof *p->cells);
  p->atmospheres = arena_alloc(&p->scratch, w->cell_count, sizeof *p->atmospheres);
  Accel **trees = arena_alloc(&p->scratch, w->cell_count, sizeof *trees);
  if (!p->cells || !p->atmospheres || !trees) return prepare_failed_memory(p);
  memset(p->cells, 0, w->cell_count * sizeof *p->cells);
  memset(p->atmospheres, 0, w->cell_count * sizeof *p->atmospheres);
  if (!accel_build_cells(p->instances.items, p->instance_cells.items, p->instances.count, trees, w->cell_count, p->jobs,
                         p->cancel, p->err))
    return false;
  w->cells = p->cells;
  w->accel = trees[0];
  for (size_t c = 0; c < w->cell_count; c++) {
    float lo[3], hi[3];
    p->cells[c].accel = trees[c];
    p->cells[c].curvature = c ? cell_curvature(&p->scene->cells.items[c - 1]) : 0;
    p->cells[c].gravity = c ? v3_load(p->scene->cells.items[c - 1].common.gravity) : v3(0, -9.81f, 0);
    w->tree_bytes += accel_bytes(trees[c]);
    accel_bounds(trees[c], lo, hi);
    for (int k = 0; k < 3; k++) {
      w->lo[k] = c ? fminf(w->lo[k], lo[k]) : lo[k];
      w->hi[k] = c ? fmaxf(w->hi[k], hi[k]) : hi[k];
    }
  }
  return true;
}

static bool build_accel(Prepare *p)
{
  World *w = p->world;
  for (size_t i = 0; i < p->instances.count; i++) {
    const int32_t part = p->mesh_parts.items[i];
    if (part < 0) continue;
    p->instances.items[i].mesh = p->parts->meshes.items[part].tree;
    w->triangle_count += p->parts->meshes.items[part].data->triangle_count;
  }
  if (!build_trees(p)) return false;
  const bool is_one = w->cell_count == 1 && !w->space.gate_count;
  w->lanes = is_one ? lanes_build(w->accel, &w->arena) : NULL;
  for (size_t i = 0; i < p->parts->meshes.count; i++) {
    const MeshData *m = p->parts->meshes.items[i].data;
    w->unique_triangle_count += m->triangle_count;
    w->tree_bytes += mesh_tree_bytes(p->parts->meshes.items[i].tree);
    if (p->parts->meshes.items[i].tangents) w->geometry_bytes += p->parts->meshes.items[i].tangents->size;
    w->geometry_bytes += 12 * m->triangle_count +
                         (12 + (m->normals ? 12u : 0u) + (m->texcoords[0] ? 8u : 0u) +
                          (m->texcoords[1] ? 8u : 0u) + (m->colors ? 16u : 0u) + (m->tangents ? 16u : 0u)) *
                             m->vertex_count;
  }
  for (size_t i = 0; i < p->parts->voxels.count; i++) w->geometry_bytes += voxels_bytes(p->parts->voxels.items[i]);
  w->geometry_bytes += w->tree_bytes;
  return true;
}

static bool run_steps(Prepare *p)
{
  if (!prepare_sources(p, p->scene) || !prepare_cells(p) || !prepare_sky(p) || !prepare_objects(p) || !prepare_gates(p) ||
      !add_default_material(p))
    return false;
  if (!parts_make(p->parts, p->jobs, p->cancel, p->err)) return false;
  if (!prepare_texture_pixels(p)) return false;
  set_filters(p);
  if (!prepare_tangents(p)) return false;
  return prepare_emitters(p) && build_accel(p) && prepare_media(p) && lay_down(p) && prepare_light_set(p);
}

static void finish(Prepare *p)
{
  array_finish(&p->sources);
  array_finish(&p->materials);
  array_finish(&p->material_names);
  array_finish(&p->textures);
  array_finish(&p->texture_parts);
  array_finish(&p->texture_mips);
  array_finish(&p->instances);
  array_finish(&p->instance_cells);
  array_finish(&p->boundary_cells);
  array_finish(&p->emitter_cells);
  array_finish(&p->sun_cells);
  array_finish(&p->clips);
  array_finish(&p->shading);
  array_finish(&p->mesh_parts);
  array_finish(&p->volumes);
  array_finish(&p->media);
  array_finish(&p->boundaries);
  array_finish(&p->boundary_parts);
  array_finish(&p->emitters);
  array_finish(&p->suns);
  array_finish(&p->profiles);
  array_finish(&p->profile_paths);
  arena_finish(&p->scratch);
}

World *world_prepare(const Scene *s, const World *previous, const LoadOptions *options, Jobs *jobs,
                     const Cancel *cancel, Err *err)
{
  World *w = mem_zero(1, sizeof *w);
  WorldParts *parts = mem_zero(1, sizeof *parts);
  if (!w || !parts) {
    mem_free(w);
    mem_free(parts);
    err_memory(err, "a world", sizeof *w);
    return NULL;
  }
  atomic_init(&w->users, 1);
  w->parts = parts;
  w->whitted = s->whitted;
  w->whitted_ambient = v3_load(s->whitted.ambient);
  parts->tree_options.layout = s->render.compact ? TREE_COMPACT : TREE_FLOAT;
  parts->tree_options.quality = s->render.tree == SCENE_TREE_BEST ? TREE_BEST : TREE_FAST;
  Prepare p = {.scene = s, .options = options, .previous = previous ? previous->parts : NULL, .jobs = jobs,
               .cancel = cancel, .err = err, .world = w, .parts = parts};
  const bool ok = run_steps(&p);
  finish(&p);
  if (ok) return w;
  world_release(w);
  return NULL;
}

World *world_share(World *w)
{
  atomic_fetch_add_explicit(&w->users, 1, memory_order_relaxed);
  return w;
}

void world_release(World *w)
{
  // Acquire-release: the last user must see everything the others did before they let go.
  if (!w || atomic_fetch_sub_explicit(&w->users, 1, memory_order_acq_rel) != 1) return;
  for (size_t c = w->cells ? w->cell_count : 0; c-- > 0;) { // the first, which owns what the others share, last
    accel_destroy(w->cells[c].accel);
    accel_destroy(w->cells[c].media_accel);
    if (c && w->cells[c].lights) light_set_finish((LightSet *)(size_t)w->cells[c].lights);
  }
  light_set_finish(&w->lights);
  parts_finish(w->parts);
  mem_free(w->parts);
  notes_finish(&w->notes);
  arena_finish(&w->arena);
  mem_free(w);
}
