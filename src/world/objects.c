// From objects to instances: scenes inside scenes are laid flat, each object's maps multiplied up the chain. The
// walk keeps its own stack, bounded by the depth to which scenes may nest.

#include "scene/gates.h"
#include "world/prepare.h"

enum { MOST_NESTING = 32 };

typedef struct Level { // one scene being walked
  Source *source;
  size_t next;         // object to look at next
  Frame frame;
  int32_t material;    // override, index into the world's; -1: none
  int32_t volume;      // what fills its objects, index into the world's; -1: none
  uint8_t mask;
  bool is_background;
} Level;

static bool frames_equal(const Frame *a, const Frame *b)
{
  return v3_is_zero(a->x - b->x) && v3_is_zero(a->y - b->y) && v3_is_zero(a->z - b->z) && v3_is_zero(a->p - b->p);
}

// Bits for integrators that tell roles apart: whatever the plain bits allow, by role.
static uint8_t mask_of_role(uint8_t mask, bool is_background)
{
  if (is_background)
    return (uint8_t)(mask | (mask & RAY_CAMERA ? RAY_BACKGROUND_CAMERA : 0) | (mask & RAY_BOUNCE ? RAY_BACKGROUND_BOUNCE : 0));
  return (uint8_t)(mask | (mask & RAY_CAMERA ? RAY_ACTOR_CAMERA : 0) | (mask & RAY_SHADOW ? RAY_ACTOR_SHADOW : 0) |
                   (mask & RAY_BOUNCE ? RAY_ACTOR_BOUNCE : 0));
}

bool prepare_add_instance(Prepare *p, const Instance *instance, const WorldInstance *shading, int32_t mesh_part)
{
  Instance i = *instance;
  const bool is_background = shading->is_background;
  i.mask = mask_of_role(i.mask, is_background);
  p->world->has_background |= is_background;
  const Frame identity = frame_identity();
  i.object_from_world = frame_inverse(&i.world_from_object);
  i.is_identity = frames_equal(&i.world_from_object, &identity);
  return (array_push(&p->instances, i) && array_push(&p->instance_cells, p->cell) && array_push(&p->shading, *shading) &&
          array_push(&p->mesh_parts, mesh_part)) ||
         prepare_failed_memory(p);
}

// The world's material of each slot; with an override, or without slots, one material for all.
static bool set_materials(Prepare *p, const Source *source, const Mesh *mesh, int32_t material, WorldInstance *w)
{
  const uint32_t fallback = UINT32_MAX; // turned into the default material's index once that is known
  const size_t count = material < 0 && mesh && mesh->slot_count ? mesh->slot_count : 1;
  uint32_t *slots = arena_alloc(&p->world->arena, count, sizeof *slots);
  if (!slots) return prepare_failed_memory(p);
  slots[0] = material >= 0 ? (uint32_t)material : fallback;
  if (material < 0 && mesh)
    for (size_t i = 0; i < mesh->slot_count; i++)
      slots[i] = mesh->slots[i] >= 0 ? source->material_base + (uint32_t)mesh->slots[i] : fallback;
  w->materials = slots;
  w->slot_count = (uint32_t)count;
  if (material < 0 && mesh) w->slots = mesh->data->material_slots;
  return true;
}

static TriangleMesh mesh_arrays(const MeshData *m)
{
  return (TriangleMesh){.positions = m->positions, .normals = m->normals,
                        .texcoords = {m->texcoords[0], m->texcoords[1]}, .colors = m->colors,
                        .tangents = m->tangents, .triangles = m->triangles};
}

// A box is the same twelve triangles everywhere, sized by its instance.
MeshData *prepare_unit_box(Prepare *p)
{
  static const float corner[8][3] = {{-1, -1, -1}, {1, -1, -1}, {-1, 1, -1}, {1, 1, -1},
                                     {-1, -1, 1},  {1, -1, 1},  {-1, 1, 1},  {1, 1, 1}};
  // Four corners a side, counter-clockwise seen from outside, so that uv can run over each side.
  static const uint8_t side[6][4] = {{4, 5, 7, 6}, {1, 0, 2, 3}, {5, 1, 3, 7}, {0, 4, 6, 2}, {6, 7, 3, 2}, {0, 1, 5, 4}};
  static const float uv[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  if (p->parts->unit_box) return p->parts->unit_box;
  if (p->previous && p->previous->unit_box) return p->parts->unit_box = mesh_data_share(p->previous->unit_box);
  MeshData *m = mesh_data_create();
  if (!m) return NULL;
  m->positions = mem_alloc(24 * 3, sizeof(float));
  m->texcoords[0] = mem_alloc(24 * 2, sizeof(float));
  m->triangles = mem_alloc(12 * 3, sizeof(uint32_t));
  if (!m->positions || !m->texcoords[0] || !m->triangles) {
    mesh_data_release(m);
    return NULL;
  }
  m->vertex_count = 24;
  m->triangle_count = 12;
  for (uint32_t s = 0; s < 6; s++) {
    for (uint32_t k = 0; k < 4; k++) {
      for (int c = 0; c < 3; c++) m->positions[(4 * s + k) * 3 + c] = corner[side[s][k]][c] / 2;
      for (int c = 0; c < 2; c++) m->texcoords[0][(4 * s + k) * 2 + c] = uv[k][c];
    }
    const uint32_t two[6] = {4 * s, 4 * s + 1, 4 * s + 2, 4 * s, 4 * s + 2, 4 * s + 3};
    for (int c = 0; c < 6; c++) m->triangles[6 * s + c] = two[c];
  }
  return p->parts->unit_box = m;
}

// An object's way into the world: a surface, the boundary of a medium, or both.
typedef struct Placing {
  Instance instance;
  WorldInstance surface;
  bool has_surface, is_box;
  int32_t volume; // -1: none
  Frame medium_from_world;
} Placing;

static bool place(Prepare *p, Placing *o, int32_t part)
{
  if (o->volume >= 0) {
    const WorldMedium m = {o->surface.mesh, (uint32_t)o->volume, o->medium_from_world, o->surface.object_i,
                           o->is_box && !o->has_surface};
    if (!prepare_add_medium(p, &o->instance, &m, part)) return false;
    o->surface.medium = (uint32_t)p->media.count;
  }
  return !o->has_surface || prepare_add_instance(p, &o->instance, &o->surface, part);
}

static bool add_mesh(Prepare *p, MeshData *data, int32_t part, Placing *o)
{
  if (part < 0) part = parts_add_mesh(p->parts, p->previous, data);
  if (part < 0) return prepare_failed_memory(p);
  o->surface.mesh = mesh_arrays(data);
  o->instance.kind = INSTANCE_MESH;
  return place(p, o, part);
}

// What fills an object: its own medium, or that of what it is part of.
static int32_t volume_of(const Level *level, const Object *o)
{
  return level->volume < 0 && o->common.medium >= 0 ? (int32_t)level->source->volume_base + o->common.medium
                                                    : level->volume;
}

static bool can_be_filled(int32_t shape_kind)
{
  return shape_kind == SHAPE_MESH || shape_kind == SHAPE_SPHERE || shape_kind == SHAPE_BOX || shape_kind == SHAPE_VOXELS;
}

// Voxels that a medium fills: smoke, in a box around the filled cells.
static bool add_smoke(Prepare *p, const Source *source, const Object *o, Placing *at)
{
  const char *name = o->name ? o->name : "";
  if (at->has_surface)
    return err_set(p->err, ERR_BAD_SCENE, "object \"%s\": voxels that a medium fills are smoke and have no surface; leave out the material",
                   name);
  if (o->shape.voxels_i < 0)
    return err_set(p->err, ERR_BAD_SCENE, "object \"%s\" is voxels without any; give it a \"file\", or a \"size\" and \"fill\"", name);
  Voxels *v = source->scene->voxels.items[o->shape.voxels_i].data;
  if (!v->cell_count) return true;
  const float size = o->shape.voxels.voxel_size;
  const Frame cells = {v3(size, 0, 0), v3(0, size, 0), v3(0, 0, size), voxels_origin(&o->shape.voxels, v)};
  const Frame world_from_cells = frame_product(&at->instance.world_from_object, &cells);
  Vec3 wide = v3_all(0), middle = v3_all(0);
  for (int k = 0; k < 3; k++) {
    wide[k] = (float)(v->hi[k] - v->lo[k]);
    middle[k] = (float)v->lo[k] + wide[k] / 2;
  }
  const Frame box = {v3(wide[0], 0, 0), v3(0, wide[1], 0), v3(0, 0, wide[2]), middle};
  MeshData *unit = prepare_unit_box(p);
  if (!unit) return prepare_failed_memory(p);
  at->volume = prepare_voxel_volume(p, o->name, at->volume, v);
  at->medium_from_world = frame_inverse(&world_from_cells);
  at->instance.world_from_object = frame_product(&world_from_cells, &box);
  at->is_box = true;
  return at->volume >= 0 && add_mesh(p, unit, -1, at);
}

static bool add_solid(Prepare *p, const Shape *shape, Instance *i, WorldInstance *w)
{
  Solid *solid = arena_alloc(&p->world->arena, 1, sizeof *solid);
  Frame moved;
  if (!solid) return prepare_failed_memory(p);
  (void)prepare_solid(shape, solid, &moved);
  i->kind = INSTANCE_SOLID;
  i->solid = solid;
  i->world_from_object = frame_product(&i->world_from_object, &moved);
  return prepare_add_instance(p, i, w, -1);
}

// --- in curved cells ------------------------------------------------------------------------------
// Where an object of the scene itself has its chart: its turn and place. The rest, sizes and what is within a model, is
// done there.
static bool begin_bend(Prepare *p, const Object *o, size_t object_i)
{
  const float kappa = p->cell ? cell_curvature(&p->scene->cells.items[p->cell - 1]) : 0;
  p->is_bent = kappa != 0;
  if (!p->is_bent) return true;
  const Frame f = object_frame(&o->common);
  Frame pose = {v3_normalize(f.x), v3_normalize(f.y), v3_normalize(f.z), f.p};
  if (frame_determinant(&pose) < 0) pose.z = -pose.z;
  if (fabsf(frame_determinant(&pose) - 1) > 1e-3f)
    return err_set(p->err, ERR_BAD_SCENE, "object \"%s\" (%zu) is sheared by its matrix, which no object of a curved cell can be",
                   o->name ? o->name : "", object_i);
  p->bend_from_world = frame_inverse(&pose);
  return bend_at(kappa, &pose, &p->bend) ||
         err_set(p->err, ERR_BAD_SCENE, "object \"%s\" (%zu) is beyond the end of its cell's chart, which is its radius from the middle; move it nearer",
                 o->name ? o->name : "", object_i);
}

// Puts a mesh into the cell's chart. m is given up.
static bool add_bent_mesh(Prepare *p, MeshData *m, const Frame *own, Placing *o)
{
  if (!m) return prepare_failed_memory(p);
  MeshData *bent = bend_mesh(&p->bend, m, own, p->err);
  mesh_data_release(m);
  if (!bent) return false;
  const int32_t part = parts_add_mesh(p->parts, p->previous, bent);
  o->instance.world_from_object = frame_identity();
  const bool ok = part >= 0 ? add_mesh(p, bent, part, o) : prepare_failed_memory(p);
  mesh_data_release(bent);
  return ok;
}

static bool add_bent(Prepare *p, const Object *o, MeshData *mesh, Placing *at)
{
  Instance *i = &at->instance;
  Frame own = frame_product(&p->bend_from_world, &i->world_from_object);
  if (at->volume >= 0)
    return err_set(p->err, ERR_BAD_SCENE, "object \"%s\": nothing in a curved cell can be filled with a medium", o->name ? o->name : "");
  switch ((ShapeKind)o->shape.kind) {
  case SHAPE_MESH: return add_bent_mesh(p, mesh_data_share(mesh), &own, at);
  case SHAPE_SPHERE: {
    const float scale = cbrtf(fabsf(frame_determinant(&own)));
    i->kind = INSTANCE_SPHERE;
    i->size[0] = 1;
    return bend_sphere(&p->bend, own.p, scale * o->shape.sphere.radius, &i->world_from_object)
               ? place(p, at, -1)
               : err_set(p->err, ERR_BAD_SCENE, "object \"%s\" reaches beyond the end of its cell's chart; make it smaller", o->name ? o->name : "");
  }
  case SHAPE_QUAD: return add_bent_mesh(p, bend_quad(o->shape.quad.size[0] / 2, o->shape.quad.size[1] / 2), &own, at);
  case SHAPE_DISK: return add_bent_mesh(p, bend_disk(o->shape.disk.radius), &own, at);
  case SHAPE_BOX: {
    MeshData *box = prepare_unit_box(p);
    own.x *= o->shape.box.size[0];
    own.y *= o->shape.box.size[1];
    own.z *= o->shape.box.size[2];
    return add_bent_mesh(p, box ? mesh_data_share(box) : NULL, &own, at);
  }
  case SHAPE_PLANE:
  case SHAPE_TRIANGLE:
  case SHAPE_CYLINDER:
  case SHAPE_CONE:
  case SHAPE_ENDLESS_CONE:
  case SHAPE_TORUS:
  case SHAPE_VOXELS:
  case SHAPE_FIELD:
  case SHAPE_ROUND_BOX:
  case SHAPE_CAPSULE:
  case SHAPE_ELLIPSOID:
  case SHAPE_OCTAHEDRON:
  case SHAPE_MENGER:
  case SHAPE_MANDELBULB:
  case SHAPE_FORMULA:
  case SHAPE_CSG: break;
  }
  return err_set(p->err, ERR_BAD_SCENE, "object \"%s\": in a curved cell there are spheres, quads, disks, boxes and meshes only; make it a mesh",
                 o->name ? o->name : "");
}

static bool add_shape(Prepare *p, const Level *level, const Object *o, int32_t material, uint32_t object_i)
{
  const Frame own = object_frame(&o->common);
  Placing at = {.instance = {.world_from_object = frame_product(&level->frame, &own), .mask = level->mask},
                .surface = {.object_i = object_i,
                            .is_background = level->is_background || o->common.role == ROLE_BACKGROUND},
                .volume = volume_of(level, o)};
  Instance *i = &at.instance;
  if (at.volume >= 0 && !can_be_filled(o->shape.kind))
    return err_set(p->err, ERR_BAD_SCENE, "object \"%s\": only a sphere, a box, a mesh or voxels can be filled with a medium",
                   o->name ? o->name : "");
  at.medium_from_world = frame_inverse(&i->world_from_object);
  at.has_surface = at.volume < 0 || material >= 0;
  const Mesh *mesh = o->shape.kind == SHAPE_MESH ? &level->source->scene->meshes.items[o->shape.mesh_i] : NULL;
  if (!o->common.visible_to_camera) i->mask &= (uint8_t)~RAY_CAMERA;
  if (!o->common.casts_shadow) i->mask &= (uint8_t)~RAY_SHADOW;
  if (at.has_surface && !set_materials(p, level->source, mesh, material, &at.surface)) return false;
  if (p->is_bent) return add_bent(p, o, mesh ? mesh->data : NULL, &at);
  switch ((ShapeKind)o->shape.kind) {
  case SHAPE_MESH: return add_mesh(p, mesh->data, level->source->mesh_parts[o->shape.mesh_i], &at);
  case SHAPE_SPHERE:
    i->kind = INSTANCE_SPHERE;
    i->size[0] = o->shape.sphere.radius;
    return place(p, &at, -1);
  case SHAPE_QUAD:
    i->kind = INSTANCE_QUAD;
    i->size[0] = o->shape.quad.size[0] / 2;
    i->size[1] = o->shape.quad.size[1] / 2;
    return place(p, &at, -1);
  case SHAPE_DISK:
    i->kind = INSTANCE_DISK;
    i->size[0] = o->shape.disk.radius;
    return place(p, &at, -1);
  case SHAPE_PLANE:
  case SHAPE_TRIANGLE:
  case SHAPE_CYLINDER:
  case SHAPE_CONE:
  case SHAPE_ENDLESS_CONE:
  case SHAPE_TORUS: return add_solid(p, &o->shape, i, &at.surface);
  case SHAPE_CSG: {
    const CsgPlace whole = {level->source, level->frame, level->material};
    return prepare_csg(p, &whole, (int32_t)level->next - 1, i, &at.surface);
  }
  case SHAPE_VOXELS:
    return at.volume >= 0 ? add_smoke(p, level->source, o, &at) : prepare_voxels(p, level->source, o, material, i, &at.surface);
  case SHAPE_FIELD:
  case SHAPE_ROUND_BOX:
  case SHAPE_CAPSULE:
  case SHAPE_ELLIPSOID:
  case SHAPE_OCTAHEDRON:
  case SHAPE_MENGER:
  case SHAPE_MANDELBULB:
  case SHAPE_FORMULA: {
    const CsgPlace whole = {level->source, level->frame, level->material};
    return prepare_field(p, &whole, (int32_t)level->next - 1, i, &at.surface);
  }
  case SHAPE_BOX: {
    MeshData *box = prepare_unit_box(p);
    if (!box) return prepare_failed_memory(p);
    i->world_from_object.x *= o->shape.box.size[0];
    i->world_from_object.y *= o->shape.box.size[1];
    i->world_from_object.z *= o->shape.box.size[2];
    at.is_box = true;
    return add_mesh(p, box, -1, &at);
  }
  }
  unreachable();
}

// --- sources --------------------------------------------------------------------------------------
static int32_t *index_table(Prepare *p, size_t count)
{
  int32_t *table = arena_alloc(&p->scratch, count + 1, sizeof *table);
  for (size_t i = 0; table && i < count; i++) table[i] = -1;
  return table;
}

static bool add_source(Prepare *p, const Scene *scene)
{
  Source s = {.scene = scene, .color_maps = index_table(p, scene->textures.count),
              .data_maps = index_table(p, scene->textures.count), .mesh_parts = index_table(p, scene->meshes.count)};
  if (!s.color_maps || !s.data_maps || !s.mesh_parts) return prepare_failed_memory(p);
  for (size_t i = 0; i < scene->meshes.count; i++) {
    s.mesh_parts[i] = parts_add_mesh(p->parts, p->previous, scene->meshes.items[i].data);
    if (s.mesh_parts[i] < 0) return prepare_failed_memory(p);
  }
  return prepare_parts(p, &s) && prepare_materials(p, &s) && prepare_volumes(p, &s) &&
         (array_push(&p->sources, s) || prepare_failed_memory(p));
}

// Breadth first: the list of sources is the queue. Each scene owns its models, so none is met twice.
bool prepare_sources(Prepare *p, const Scene *scene)
{
  if (!add_source(p, scene)) return false;
  for (size_t k = 0; k < p->sources.count; k++) {
    const Scene *s = p->sources.items[k].scene;
    p->sources.items[k].model_base = (uint32_t)p->sources.count;
    for (size_t i = 0; i < s->models.count; i++)
      if (!add_source(p, s->models.items[i].scene)) return false;
  }
  return true;
}

// --- the walk -------------------------------------------------------------------------------------
static Level enter(const Prepare *p, const Level *level, const Object *o, int32_t material)
{
  const Frame own = object_frame(&o->common);
  Level below = {.frame = frame_product(&level->frame, &own), .material = material, .volume = volume_of(level, o),
                 .mask = level->mask, .is_background = level->is_background || o->common.role == ROLE_BACKGROUND};
  below.source = &p->sources.items[level->source->model_base + (uint32_t)o->shape.model_i];
  if (!o->common.visible_to_camera) below.mask &= (uint8_t)~RAY_CAMERA;
  if (!o->common.casts_shadow) below.mask &= (uint8_t)~RAY_SHADOW;
  return below;
}

bool prepare_objects(Prepare *p)
{
  Level stack[MOST_NESTING];
  int depth = 1;
  uint32_t object_i = 0; // of the main scene
  stack[0] = (Level){.source = &p->sources.items[0], .frame = frame_identity(), .material = -1, .volume = -1,
                     .mask = RAY_ALL};
  if (!prepare_scene_lights(p, stack[0].source, &stack[0].frame, NO_HIT)) return false;
  while (depth > 0) {
    Level *level = &stack[depth - 1];
    if (level->next >= level->source->scene->objects.count) {
      depth--;
      continue;
    }
    const Object *o = &level->source->scene->objects.items[level->next++];
    if (o->common.part_of >= 0) continue; // goes with the whole
    if (depth == 1) {
      object_i = (uint32_t)level->next - 1;
      p->cell = (uint32_t)(o->common.cell + 1);
      if (!begin_bend(p, o, object_i)) return false;
    }
    int32_t material = level->material;
    if (material < 0 && o->common.material >= 0)
      material = (int32_t)level->source->material_base + o->common.material;
    if (o->shape.kind == SHAPE_MESH && o->shape.model_i >= 0) {
      if (depth == MOST_NESTING)
        return err_set(p->err, ERR_BAD_SCENE, "scenes are nested more than %d deep", MOST_NESTING);
      stack[depth] = enter(p, level, o, material);
      if (!prepare_scene_lights(p, stack[depth].source, &stack[depth].frame, object_i)) return false;
      depth++;
    } else if (o->shape.kind == SHAPE_MESH && o->shape.mesh_i < 0) {
      return err_set(p->err, ERR_BAD_SCENE,
                     "object %zu%s%s%s has a mesh shape without a mesh; give it \"file\", or \"positions\" and "
                     "\"triangles\"",
                     level->next - 1, o->name ? " (\"" : "", o->name ? o->name : "", o->name ? "\")" : "");
    } else if (!add_shape(p, level, o, material, object_i)) {
      return false;
    }
    if (is_cancelled(p->cancel)) return err_set(p->err, ERR_CANCELLED, "preparing was cancelled");
  }
  return true;
}
