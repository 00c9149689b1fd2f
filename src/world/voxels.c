// From a shape of voxels to an instance: materials by the entries of its palette, matter for what lets light through, and
// the faces of shining voxels put together to rectangles that can be aimed at.

#include "base/hash.h"
#include "world/prepare.h"

#include <stdlib.h>
#include <string.h>

enum { MOST_RECTANGLES = 1 << 16 };

// --- materials ----------------------------------------------------------------------------------------------------
typedef struct Palette { // being turned into materials
  Prepare *p;
  const Source *source;
  const VoxelPalette *from;
  uint32_t *materials; // slot -> material
  uint16_t *slots;     // entry -> slot
  uint8_t *matter;     // entry -> matter
  uint32_t slot_count;
  bool has_see_through;
} Palette;

static SurfaceMaterial plain_material(const VoxelLook *l)
{
  SurfaceMaterial m = surface_default();
  m.color = v3_all(1);
  m.roughness = l->roughness;
  m.metallic = l->metallic;
  m.transmission = l->transmission;
  m.ior = l->ior;
  return m;
}

static bool is_see_through(const SurfaceMaterial *m)
{
  return m->kind == SURFACE_GLASS || m->transmission > 0 || !v3_is_zero(m->passed);
}

static bool add_slot(Palette *t, uint32_t material)
{
  t->materials[t->slot_count++] = material;
  return true;
}

static bool add_own(Palette *t, const SurfaceMaterial *m)
{
  return prepare_add_material(t->p, m, NULL) && add_slot(t, (uint32_t)t->p->materials.count - 1);
}

static bool add_named(Palette *t, const char *name)
{
  const int32_t i = scene_find_material(t->source->scene, name);
  if (i < 0) return err_set(t->p->err, ERR_BAD_SCENE, "a voxel names the material \"%.60s\", which is not defined", name);
  return add_slot(t, t->source->material_base + (uint32_t)i);
}

// A look that shines makes a material for each entry, any other one for all of them.
static bool add_look(Palette *t, uint32_t look_i)
{
  const VoxelLook *l = &t->from->looks[look_i];
  const uint32_t shared = t->slot_count;
  bool is_shared = false;
  for (uint32_t i = 1; i < t->from->entry_count; i++) {
    const VoxelEntry *e = &t->from->entries[i];
    if (e->look != look_i) continue;
    if (!l->material && l->emission > 0) {
      SurfaceMaterial m = plain_material(l);
      m.emission = v3_load(e->color) * l->emission;
      m.is_light = !v3_is_zero(m.emission);
      m.is_double_sided = false;
      t->slots[i] = (uint16_t)t->slot_count;
      if (!add_own(t, &m)) return false;
    } else {
      const SurfaceMaterial m = plain_material(l);
      t->slots[i] = (uint16_t)shared;
      if (!is_shared && !(l->material ? add_named(t, l->material) : add_own(t, &m))) return false;
      is_shared = true;
    }
    const bool passes = is_see_through(&t->p->materials.items[t->materials[t->slots[i]]]);
    t->matter[i] = (uint8_t)(passes ? (look_i < 253 ? 2 + look_i : 255) : 1);
    t->has_see_through |= passes;
  }
  return true;
}

static bool add_palette(Palette *t, Arena *arena, WorldInstance *w, VoxelBody *body)
{
  const uint32_t count = t->from->entry_count;
  t->materials = arena_alloc(arena, count + 1, sizeof *t->materials);
  t->slots = arena_alloc(arena, count + 1, sizeof *t->slots);
  t->matter = arena_alloc(arena, count + 1, sizeof *t->matter);
  if (!t->materials || !t->slots || !t->matter) return prepare_failed_memory(t->p);
  memset(t->slots, 0, (count + 1) * sizeof *t->slots);
  memset(t->matter, 0, count + 1);
  for (uint32_t i = 0; i < t->from->look_count; i++)
    if (!add_look(t, i)) return false;
  if (!t->slot_count) t->materials[t->slot_count++] = UINT32_MAX; // an empty palette: the default material, never seen
  w->materials = t->materials;
  w->slots = t->slots;
  w->slot_count = t->slot_count;
  w->prim_shift = 3;
  body->matter = t->has_see_through ? t->matter : NULL;
  return true;
}

// One material for all: of one matter, so that glass has no walls inside.
static bool add_override(Prepare *p, uint32_t material, WorldInstance *w)
{
  uint32_t *materials = arena_alloc(&p->world->arena, 1, sizeof *materials);
  if (!materials) return prepare_failed_memory(p);
  materials[0] = material;
  w->materials = materials;
  w->slot_count = 1;
  w->slots = NULL;
  w->prim_shift = 3;
  return true;
}

static bool keep_grid(Prepare *p, Voxels *v)
{
  for (size_t i = 0; i < p->parts->voxels.count; i++)
    if (p->parts->voxels.items[i] == v) return true;
  if (!array_push(&p->parts->voxels, v)) return prepare_failed_memory(p);
  voxels_share(v);
  return true;
}

bool prepare_voxels(Prepare *p, const Source *source, const Object *o, int32_t material, Instance *i, WorldInstance *w)
{
  if (o->shape.voxels_i < 0)
    return err_set(p->err, ERR_BAD_SCENE, "object \"%s\" is voxels without any; give it a \"file\", or a \"size\" and \"fill\"",
                   o->name ? o->name : "");
  Voxels *v = source->scene->voxels.items[o->shape.voxels_i].data;
  VoxelBody *body = arena_alloc(&p->world->arena, 1, sizeof *body);
  if (!body || !keep_grid(p, v)) return prepare_failed_memory(p);
  *body = (VoxelBody){v, NULL};
  Palette t = {.p = p, .source = source, .from = v->palette};
  if (material >= 0 ? !add_override(p, (uint32_t)material, w) : !add_palette(&t, &p->world->arena, w, body))
    return err_where(p->err, "object \"%s\"", o->name ? o->name : "");
  const float size = o->shape.voxels.voxel_size;
  const Frame cells = {v3(size, 0, 0), v3(0, size, 0), v3(0, 0, size), voxels_origin(&o->shape.voxels, v)};
  i->kind = INSTANCE_VOXELS;
  i->voxels = body;
  i->world_from_object = frame_product(&i->world_from_object, &cells);
  return prepare_add_instance(p, i, w, -1);
}

// --- lights -------------------------------------------------------------------------------------------------------
// A bare face of a shining cell. Ordered by face, plane, entry, row and column, so that those of one row lie together.
typedef struct Face {
  uint64_t order;
  int16_t cell[3];
} Face;
typedef ARRAY(Face) Faces;

typedef struct Rectangle {
  uint32_t entry, face;
  int32_t plane, column, row, width, height;
} Rectangle;
typedef ARRAY(Rectangle) Rectangles;

// Which coordinates are columns and rows of a face.
static int column_axis(uint32_t face) { return face >> 1 == 0 ? 1 : 0; }
static int row_axis(uint32_t face) { return face >> 1 == 2 ? 1 : 2; }

static bool add_faces(const Voxels *v, const int32_t cell[3], uint32_t entry, Faces *out)
{
  for (uint32_t face = 0; face < 6; face++) {
    int32_t beside[3] = {cell[0], cell[1], cell[2]};
    beside[face >> 1] += face & 1 ? 1 : -1;
    if (voxels_entry(v, beside[0], beside[1], beside[2])) continue;
    const uint64_t plane = (uint64_t)cell[face >> 1], row = (uint64_t)cell[row_axis(face)], column = (uint64_t)cell[column_axis(face)];
    const Face f = {(uint64_t)face << 60 | plane << 46 | (uint64_t)entry << 30 | row << 15 | column,
                    {(int16_t)cell[0], (int16_t)cell[1], (int16_t)cell[2]}};
    if (!array_push(out, f)) return false;
  }
  return true;
}

// Has the brick entries that shine? By its list, without looking at its cells.
static bool brick_shines(const VoxelNode *n, uint32_t rank, const bool *shines)
{
  const uint32_t at = n->at[rank];
  if (at & VOXEL_UNIFORM) return shines[at & 0xffff];
  const uint8_t *d = n->data + 2 * (size_t)at;
  VoxelRecord r;
  memcpy(&r, d, sizeof r);
  if (!r.bits) return true;
  for (uint32_t i = 0; i < r.count; i++)
    if (shines[r.base + voxel_record_bits(d + sizeof r, i * r.id_bits, r.id_bits)]) return true;
  return false;
}

static bool gather_brick(const Voxels *v, const int32_t base[3], const bool *shines, Faces *out)
{
  for (int32_t c = 0; c < 512; c++) {
    const int32_t cell[3] = {base[0] + (c & 7), base[1] + (c >> 3 & 7), base[2] + (c >> 6)};
    const uint32_t entry = voxels_entry(v, cell[0], cell[1], cell[2]);
    if (entry && shines[entry] && !add_faces(v, cell, entry, out)) return false;
  }
  return true;
}

static bool gather_node(const Voxels *v, const VoxelNode *n, const int32_t base[3], const bool *shines, Faces *out)
{
  for (uint32_t b = 0, rank = 0, full = 0; b < 512; b++) {
    const bool is_some = n->some[b >> 6] >> (b & 63) & 1, is_full = n->full[b >> 6] >> (b & 63) & 1;
    const int32_t brick[3] = {base[0] + 8 * (int32_t)(b & 7), base[1] + 8 * (int32_t)(b >> 3 & 7), base[2] + 8 * (int32_t)(b >> 6)};
    const bool any = (is_some && brick_shines(n, rank, shines)) || (is_full && shines[n->full_ids[full]]);
    rank += is_some;
    full += is_full;
    if (any && !gather_brick(v, brick, shines, out)) return false;
  }
  return true;
}

static bool gather_faces(const Voxels *v, const bool *shines, Faces *out)
{
  for (int32_t z = 0; z < v->nodes_size[2]; z++)
    for (int32_t y = 0; y < v->nodes_size[1]; y++)
      for (int32_t x = 0; x < v->nodes_size[0]; x++) {
        const int32_t base[3] = {64 * x, 64 * y, 64 * z};
        const VoxelNode *n = voxels_node(v, 64 * (uint32_t)x, 64 * (uint32_t)y, 64 * (uint32_t)z);
        if (n && !gather_node(v, n, base, shines, out)) return false;
      }
  return true;
}

static int by_order(const void *a, const void *b)
{
  const uint64_t x = ((const Face *)a)->order, y = ((const Face *)b)->order;
  return x < y ? -1 : x > y;
}

static bool goes_on(const Face *a, const Face *b) { return b->order == a->order + 1; }

// The row of faces from `first` on joins a rectangle that ends just above and is as wide, or begins one.
static bool add_run(const Face *first, int32_t width, Rectangles *out, Table *ends)
{
  const uint32_t face = (uint32_t)(first->order >> 60), entry = (uint32_t)(first->order >> 30) & 0xffff;
  const Rectangle r = {entry, face, first->cell[face >> 1], first->cell[column_axis(face)], first->cell[row_axis(face)], width, 1};
  const int32_t numbers[6] = {(int32_t)face, r.plane, (int32_t)entry, r.column, width, 0};
  const uint64_t key = hash_bytes(7, numbers, sizeof numbers);
  size_t step = 0;
  for (int32_t *i; (i = table_next(ends, key, &step));) {
    Rectangle *o = &out->items[*i];
    if (o->face != face || o->plane != r.plane || o->entry != entry || o->column != r.column || o->width != width) continue;
    if (o->row + o->height == r.row) {
      o->height++;
      return true;
    }
    *i = (int32_t)out->count;
    return array_push(out, r);
  }
  return table_add(ends, key, (int32_t)out->count) && array_push(out, r);
}

static bool join_faces(Faces *faces, Rectangles *out)
{
  Table ends = {0};
  bool ok = true;
  if (faces->count) qsort(faces->items, faces->count, sizeof *faces->items, by_order);
  for (size_t i = 0, n = 1; ok && i < faces->count; i += n) {
    for (n = 1; i + n < faces->count && goes_on(&faces->items[i + n - 1], &faces->items[i + n]); n++) continue;
    ok = add_run(&faces->items[i], (int32_t)n, out, &ends);
  }
  table_finish(&ends);
  return ok;
}

// cross(x, y) of an emitter is its outside.
static Emitter rectangle_emitter(const Frame *f, const Rectangle *r, const SurfaceMaterial *m)
{
  const int axis = (int)(r->face >> 1), ca = column_axis(r->face), ra = row_axis(r->face);
  Vec3 corner = v3_all(0), along = v3_all(0), up = v3_all(0), out = v3_all(0);
  corner[axis] = (float)(r->plane + (int32_t)(r->face & 1));
  corner[ca] = (float)r->column;
  corner[ra] = (float)r->row;
  along[ca] = (float)r->width;
  up[ra] = (float)r->height;
  out[axis] = r->face & 1 ? 1 : -1;
  Emitter e = {.kind = EMITTER_QUAD, .color = m->emission, .is_two_sided = m->is_double_sided, .map = -1, .mean_map = 1};
  const bool turns = (v3_dot(v3_cross(along, up), out) < 0) != (frame_determinant(f) < 0);
  e.p = frame_point(f, corner);
  e.x = frame_vector(f, turns ? up : along);
  e.y = frame_vector(f, turns ? along : up);
  e.area = v3_length(v3_cross(e.x, e.y));
  return e;
}

static void put_key(VoxelLights *l, uint64_t key, int32_t emitter)
{
  uint64_t *keys = (uint64_t *)(size_t)l->keys;
  int32_t *emitters = (int32_t *)(size_t)l->emitters;
  uint32_t i = (uint32_t)hash_u64(key) & l->mask;
  while (keys[i]) i = (i + 1) & l->mask;
  keys[i] = key;
  emitters[i] = emitter;
}

static bool keep_emitters(Prepare *p, size_t index, const Rectangles *list, size_t face_count)
{
  WorldInstance *w = &p->shading.items[index];
  const Frame *f = &p->instances.items[index].world_from_object;
  uint32_t capacity = 16;
  while (capacity < 2 * face_count) capacity *= 2;
  VoxelLights *l = arena_alloc(&p->world->arena, 1, sizeof *l);
  uint64_t *keys = arena_alloc(&p->world->arena, capacity, sizeof *keys);
  int32_t *emitters = arena_alloc(&p->world->arena, capacity, sizeof *emitters);
  if (!l || !keys || !emitters) return prepare_failed_memory(p);
  memset(keys, 0, capacity * sizeof *keys);
  *l = (VoxelLights){keys, emitters, capacity - 1};
  for (size_t i = 0; i < list->count; i++) {
    const Rectangle *r = &list->items[i];
    const uint32_t slot = w->slots ? w->slots[r->entry] : 0;
    const Emitter e = rectangle_emitter(f, r, &p->materials.items[w->materials[slot]]);
    if (!(e.area > 0) || !isfinite(e.area)) continue;
    for (int32_t y = 0; y < r->height; y++)
      for (int32_t x = 0; x < r->width; x++) {
        int32_t c[3];
        c[r->face >> 1] = r->plane;
        c[column_axis(r->face)] = r->column + x;
        c[row_axis(r->face)] = r->row + y;
        put_key(l, voxel_light_key(r->face, c[0], c[1], c[2]), (int32_t)p->emitters.count);
      }
    if (!prepare_add_emitter(p, &e)) return false;
  }
  w->voxel_lights = l;
  return true;
}

bool prepare_voxel_emitters(Prepare *p, size_t index)
{
  const WorldInstance *w = &p->shading.items[index];
  const Voxels *v = p->instances.items[index].voxels->grid;
  bool *shines = mem_zero(v->palette->entry_count, sizeof *shines), any = false;
  Faces faces = {0};
  Rectangles list = {0};
  if (!shines) return prepare_failed_memory(p);
  for (uint32_t i = 1; i < v->palette->entry_count; i++) {
    const SurfaceMaterial *m = &p->materials.items[w->materials[w->slots ? w->slots[i] : 0]];
    shines[i] = m->is_light && m->alpha_mode == SURFACE_OPAQUE && m->emission_map.map < 0;
    any |= shines[i];
  }
  bool ok = !any || (gather_faces(v, shines, &faces) && join_faces(&faces, &list));
  if (!ok) (void)prepare_failed_memory(p);
  if (ok && list.count > MOST_RECTANGLES)
    note_once(&p->world->notes, "more than %d faces of voxels shine, which are not aimed at; that costs noise", MOST_RECTANGLES);
  else if (ok && list.count)
    ok = keep_emitters(p, index, &list, faces.count);
  mem_free(shines);
  array_finish(&faces);
  array_finish(&list);
  return ok;
}
