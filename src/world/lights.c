// From lights and shining surfaces to emitters that can be aimed at. An area light is a real thing: an instance with
// an emissive material that is there from its front only.

#include "scene/gates.h"
#include "scene/ies.h"
#include "shade/light_sample.h"
#include "world/prepare.h"

#include <string.h>

static double radians(float degrees) { return (double)degrees * (3.14159265358979323846 / 180); }

// A pose at p whose z axis points to target; y is up as far as that is possible.
static Frame facing(const float position[3], const float target[3])
{
  const Vec3 p = v3_load(position);
  Vec3 z = v3_normalize(v3_load(target) - p);
  if (v3_is_zero(z)) z = v3(0, -1, 0);
  const Vec3 up = fabsf(z[1]) > 0.999f ? v3(0, 0, -1) : v3(0, 1, 0);
  const Vec3 x = v3_normalize(v3_cross(up, z));
  return (Frame){x, v3_cross(z, x), z, p};
}

bool prepare_add_emitter(Prepare *p, const Emitter *e)
{
  return (array_push(&p->emitters, *e) && array_push(&p->emitter_cells, p->cell)) || prepare_failed_memory(p);
}

// --- in curved cells ------------------------------------------------------------------------------
static float cell_kappa(const Prepare *p) { return p->cell ? cell_curvature(&p->scene->cells.items[p->cell - 1]) : 0; }
static bool cell_is_curved(const Prepare *p) { return cell_kappa(p) != 0; }

// A lamp as a mesh in the cell's chart, whose triangles are aimed at. Its way to face is that of the chart.
static bool add_bent_area(Prepare *p, const Instance *i, const WorldInstance *shading)
{
  const float kappa = cell_kappa(p);
  const Frame *f = &i->world_from_object, one = frame_identity();
  Bend bend;
  Frame pose = *f;
  pose.z = v3_normalize(chart_to_local(kappa, f->p, f->z));
  pose.x = v3_normalize(f->x - v3_dot(f->x, pose.z) * pose.z);
  pose.y = v3_cross(pose.z, pose.x);
  if (!bend_at(kappa, &pose, &bend))
    return err_set(p->err, ERR_BAD_SCENE, "it is beyond the end of its cell's chart, which is its radius from the middle; move it nearer");
  MeshData *own = i->kind == INSTANCE_QUAD   ? bend_quad(i->size[0], i->size[1])
                  : i->kind == INSTANCE_DISK ? bend_disk(i->size[0])
                                             : bend_ball(kappa, i->size[0]);
  if (!own) return prepare_failed_memory(p);
  MeshData *bent = bend_mesh(&bend, own, &one, p->err);
  mesh_data_release(own);
  if (!bent) return false;
  const int32_t part = parts_add_mesh(p->parts, p->previous, bent);
  WorldInstance w = *shading;
  w.mesh = (TriangleMesh){.positions = bent->positions, .texcoords = {bent->texcoords[0]}, .triangles = bent->triangles};
  const Instance to = {.world_from_object = one, .kind = INSTANCE_MESH, .mask = i->mask};
  const bool ok = part >= 0 ? prepare_add_instance(p, &to, &w, part) : prepare_failed_memory(p);
  mesh_data_release(bent);
  return ok;
}

// What has no place, or lights by angles that its chart does not keep, is not there in curved space.
static bool check_curved(Prepare *p, const Light *l)
{
  const float kappa = cell_kappa(p);
  if (kappa == 0) return true;
  if (l->kind == LIGHT_SUN || l->kind == LIGHT_SPOT || (l->kind == LIGHT_POINT && l->point.ies))
    return err_set(p->err, ERR_BAD_SCENE, "a curved cell is lit by point lights without a file, and by rects, disks and spheres; a %s is none",
                   l->kind == LIGHT_SUN ? "sun" : l->kind == LIGHT_SPOT ? "spot" : "measured lamp");
  return l->kind != LIGHT_POINT || chart_holds(kappa, v3_load(l->point.position)) ||
         err_set(p->err, ERR_BAD_SCENE, "it is beyond the end of its cell's chart, which is its radius from the middle; move it nearer");
}

// The instance of an area light; its emitter comes with those of all other shining surfaces.
static bool add_area(Prepare *p, const Frame *frame, InstanceKind kind, float size_x, float size_y,
                     const float radiance[3], bool is_visible, uint32_t object_i)
{
  SurfaceMaterial m = surface_default();
  m.kind = SURFACE_EMISSION;
  m.is_double_sided = false;
  m.needs_filter = true; // from behind the light is not there
  m.emission = v3_load(radiance);
  m.is_light = !v3_is_zero(m.emission);
  uint32_t *material = arena_alloc(&p->world->arena, 1, sizeof *material);
  if (!material || !prepare_add_material(p, &m, NULL)) return prepare_failed_memory(p);
  *material = (uint32_t)p->materials.count - 1;
  const WorldInstance w = {.materials = material, .slot_count = 1, .object_i = object_i};
  const Instance i = {.world_from_object = *frame, .size = {size_x, size_y}, .kind = (uint8_t)kind,
                      .mask = (uint8_t)(is_visible ? RAY_ALL : RAY_ALL & ~RAY_CAMERA)};
  return cell_is_curved(p) ? add_bent_area(p, &i, &w) : prepare_add_instance(p, &i, &w, -1);
}

bool prepare_add_sun(Prepare *p, const float direction[3], Vec3 irradiance, float angle)
{
  const Vec3 d = v3_normalize(v3_load(direction));
  if (v3_is_zero(d)) return err_set(p->err, ERR_BAD_SCENE, "a sun's direction is zero; let it point to the sun");
  const double radius = radians(angle) / 2, one_minus_cos = 2 * pow(sin(radius / 2), 2);
  // Below a thousandth of a degree the disk's solid angle drowns in rounding, and nobody sees it.
  const bool is_point = angle < 1e-3f;
  // A disk of radiance L around the zenith gives pi L sin^2 of its radius.
  const double projected = 3.14159265358979323846 * pow(sin(radius), 2);
  const Vec3 radiance = is_point ? irradiance : irradiance / (float)projected;
  const Sun sun = {.direction = d, .radiance = radiance, .one_minus_cos = is_point ? 0 : (float)one_minus_cos};
  return (array_push(&p->suns, sun) && array_push(&p->sun_cells, p->cell)) || prepare_failed_memory(p);
}

static bool add_sun(Prepare *p, const LightSun *l, const Frame *frame)
{
  const Vec3 d = frame_vector(frame, v3_load(l->direction));
  const float direction[3] = {d[0], d[1], d[2]};
  return prepare_add_sun(p, direction, v3_load(l->irradiance), l->angle);
}

// --- lamps with a measured distribution ---------------------------------------------------------------
static const float *keep_floats(Prepare *p, const float *from, size_t count, float divisor)
{
  float *to = arena_alloc(&p->world->arena, count, sizeof *to);
  for (size_t i = 0; to && i < count; i++) to[i] = from[i] / divisor;
  return to;
}

static bool add_profile(Prepare *p, const Ies *s)
{
  const size_t values = (size_t)s->vertical_count * s->horizontal_count;
  const LightProfile f = {s->vertical_count, s->horizontal_count, keep_floats(p, s->vertical, s->vertical_count, 1),
                          keep_floats(p, s->horizontal, s->horizontal_count, 1),
                          keep_floats(p, s->candela, values, s->peak)};
  return (f.vertical && f.horizontal && f.value && array_push(&p->profiles, f)) || prepare_failed_memory(p);
}

static bool read_profile(Prepare *p, const char *path)
{
  FileBytes bytes = {0};
  Ies ies = {0};
  const bool ok = file_read(&bytes, path, p->err) && ies_read(&ies, path, bytes.data, bytes.size, p->err) &&
                  add_profile(p, &ies);
  ies_finish(&ies);
  file_release(&bytes);
  if (!ok) return false;
  const char *kept = arena_text(&p->scratch, path);
  return (kept && array_push(&p->profile_paths, kept)) || prepare_failed_memory(p);
}

// The file's number plus one, read once; 0: it failed.
static uint32_t find_profile(Prepare *p, const Scene *scene, const char *file)
{
  Text path = {0};
  uint32_t found = 0;
  if (scene_file_path(scene, file, p->options, &path, p->err)) {
    for (uint32_t i = 0; !found && i < p->profile_paths.count; i++)
      if (!strcmp(p->profile_paths.items[i], text_get(&path))) found = i + 1;
    if (!found && read_profile(p, text_get(&path))) found = (uint32_t)p->profiles.count;
  }
  text_finish(&path);
  return found;
}

// The mean of a profile over the sphere: the integral over horizontal angles is exact for its linear pieces, that over
// vertical ones goes in steps of a degree.
static double profile_mean(const LightProfile *f)
{
  double sum = 0;
  for (int v = 0; v < 180; v++) {
    double around = 0;
    for (int h = 0; h < 360; h++) around += (double)profile_value(f, (float)v + 0.5f, (float)h + 0.5f) / 360;
    sum += around * (cos(radians((float)v)) - cos(radians((float)v + 1))) / 2;
  }
  return sum;
}

// Gives a point or spot a profile about `axis`, its horizontal angle 0 at `side` turned about the axis.
static bool put_profile(Prepare *p, const Scene *scene, const char *file, float rotation, Vec3 axis, Vec3 side, Emitter *e)
{
  if (!file) return true;
  e->profile = find_profile(p, scene, file);
  if (!e->profile) return false;
  const Vec3 z = v3_normalize(axis), x = v3_normalize(side - z * v3_dot(side, z));
  const double turn = radians(rotation);
  e->x = z;
  e->y = x * (float)cos(turn) + v3_cross(x, z) * (float)sin(turn);
  e->mean_map = (float)profile_mean(&p->profiles.items[e->profile - 1]);
  return true;
}

static bool add_point(Prepare *p, const LightPoint *l, const Scene *scene, const Frame *frame)
{
  Emitter e = {.kind = EMITTER_POINT, .p = frame_point(frame, v3_load(l->position)), .color = v3_load(l->intensity),
               .map = -1, .mean_map = 1};
  return put_profile(p, scene, l->ies, l->ies_rotation, -frame->y, frame->x, &e) && prepare_add_emitter(p, &e);
}

static bool add_spot(Prepare *p, const LightSpot *l, const Scene *scene, const Frame *frame)
{
  const Frame own = facing(l->position, l->target);
  const Vec3 at = frame_point(frame, v3_load(l->position));
  const Vec3 axis = v3_normalize(frame_point(frame, v3_load(l->target)) - at);
  if (v3_is_zero(axis))
    return err_set(p->err, ERR_BAD_SCENE, "a spot light's target is where the light is; aim it at another point");
  const float inner = l->inner_angle < l->angle ? l->inner_angle : l->angle;
  Emitter e = {.kind = EMITTER_SPOT, .p = at, .x = axis, .color = v3_load(l->intensity), .map = -1,
               .mean_map = 1, .cos_outer = (float)cos(radians(l->angle)), .cos_inner = (float)cos(radians(inner))};
  return put_profile(p, scene, l->ies, l->ies_rotation, axis, -frame_vector(frame, own.x), &e) && prepare_add_emitter(p, &e);
}

static bool add_light(Prepare *p, const Light *l, const Scene *scene, const Frame *frame, uint32_t object_i)
{
  switch ((LightKind)l->kind) {
  case LIGHT_POINT: return add_point(p, &l->point, scene, frame);
  case LIGHT_SPOT: return add_spot(p, &l->spot, scene, frame);
  case LIGHT_SUN: return add_sun(p, &l->sun, frame);
  case LIGHT_RECT: {
    const Frame own = facing(l->rect.position, l->rect.target), f = frame_product(frame, &own);
    return add_area(p, &f, INSTANCE_QUAD, l->rect.size[0] / 2, l->rect.size[1] / 2, l->rect.radiance,
                    l->rect.visible_to_camera, object_i);
  }
  case LIGHT_DISK: {
    const Frame own = facing(l->disk.position, l->disk.target), f = frame_product(frame, &own);
    return add_area(p, &f, INSTANCE_DISK, l->disk.radius, 0, l->disk.radiance, l->disk.visible_to_camera, object_i);
  }
  case LIGHT_SPHERE: {
    Frame own = frame_identity();
    own.p = v3_load(l->sphere.position);
    const Frame f = frame_product(frame, &own);
    return add_area(p, &f, INSTANCE_SPHERE, l->sphere.radius, 0, l->sphere.radiance, l->sphere.visible_to_camera,
                    object_i);
  }
  }
  unreachable();
}

bool prepare_scene_lights(Prepare *p, const Source *source, const Frame *frame, uint32_t object_i)
{
  for (size_t i = 0; i < source->scene->lights.count; i++) {
    const Light *l = &source->scene->lights.items[i];
    if (source->scene == p->scene) p->cell = (uint32_t)(l->common.cell + 1); // a model's are where it is
    if (!check_curved(p, l)) return err_where(p->err, "lights[%zu]", i);
    if (!add_light(p, l, source->scene, frame, object_i)) return err_where(p->err, "lights[%zu]", i);
  }
  return true;
}

// --- shining surfaces -----------------------------------------------------------------------------
// Cut-out surfaces are not aimed at: a point on a hole would shine. They still light what their rays meet.
// Nor is noise in space: what is aimed at is a place in uv, and what is met there would shine otherwise.
static bool is_aimable(Prepare *p, const SurfaceMaterial *m)
{
  if (!m->is_light || m->alpha_mode != SURFACE_OPAQUE) return false;
  const TextureMap *map = m->emission_map.map >= 0 ? &p->textures.items[m->emission_map.map] : NULL;
  if (!map || map->kind != TEXTURE_MAP_NOISE || map->space == TEXTURE_UV) return true;
  note_once(&p->world->notes, "what shines by noise in space is not aimed at, which costs noise; lay it out in \"uv\"");
  return false;
}

static bool is_similarity(const Frame *f)
{
  const float x = v3_length(f->x), y = v3_length(f->y), z = v3_length(f->z), e = 1e-4f * x;
  return fabsf(x - y) < e && fabsf(x - z) < e && fabsf(v3_dot(f->x, f->y)) < e * x &&
         fabsf(v3_dot(f->y, f->z)) < e * x && fabsf(v3_dot(f->z, f->x)) < e * x;
}

static Emitter emitter_of(const Prepare *p, const SurfaceMaterial *m)
{
  Emitter e = {.color = m->emission, .is_two_sided = m->is_double_sided, .map = m->emission_map.map, .mean_map = 1};
  const int32_t part = e.map >= 0 ? p->texture_parts.items[e.map] : -1;
  if (part >= 0) e.mean_map = image_part_mean(p->parts->images.items[part], p->textures.items[e.map].is_srgb);
  return e;
}

// The emitter of a shape, in world space; area 0 if it has none that can be sampled.
static Emitter shape_emitter(Prepare *p, const Instance *i, const SurfaceMaterial *m)
{
  const Frame *f = &i->world_from_object;
  Emitter e = emitter_of(p, m);
  switch ((InstanceKind)i->kind) {
  case INSTANCE_MESH: break;
  case INSTANCE_SPHERE:
    if (!is_similarity(f) || e.map >= 0) {
      note_once(&p->world->notes, "a shining ellipsoid or textured sphere is not aimed at, which costs noise; use a mesh");
      break;
    }
    e.kind = EMITTER_SPHERE;
    e.p = f->p;
    e.radius = i->size[0] * v3_length(f->x);
    e.area = 4 * PI * e.radius * e.radius;
    break;
  case INSTANCE_QUAD:
    e.kind = EMITTER_QUAD;
    e.p = frame_point(f, v3(-i->size[0], -i->size[1], 0));
    e.x = f->x * (2 * i->size[0]);
    e.y = f->y * (2 * i->size[1]);
    e.area = v3_length(v3_cross(e.x, e.y));
    break;
  case INSTANCE_SOLID:
    if (i->solid->kind != SOLID_TRIANGLE) {
      note_once(&p->world->notes, "a shining plane, cylinder, cone or torus is not aimed at, which costs noise; use a mesh");
      break;
    }
    e.kind = EMITTER_TRIANGLE;
    e.p = f->p;
    e.x = f->x;
    e.y = f->y;
    e.uv[1][0] = e.uv[2][1] = 1;
    e.area = v3_length(v3_cross(e.x, e.y)) / 2;
    break;
  case INSTANCE_CSG:
    note_once(&p->world->notes, "a shining csg is not aimed at, which costs noise; use a mesh");
    break;
  case INSTANCE_VOXELS: break; // has many
  case INSTANCE_SDF:
    note_once(&p->world->notes, "a shining distance field is not aimed at, which costs noise; use a mesh");
    break;
  case INSTANCE_DISK:
    e.kind = EMITTER_DISK;
    e.p = f->p;
    e.x = f->x * i->size[0];
    e.y = f->y * i->size[0];
    e.area = PI * v3_length(v3_cross(e.x, e.y));
    break;
  }
  return e;
}

// The normal of an emitter is cross(x, y). A mirroring map turns the winding but not the outside of a thing.
static void unmirror(Emitter *e, const Frame *f)
{
  if (frame_determinant(f) >= 0) return;
  if (e->kind != EMITTER_TRIANGLE && e->map >= 0) e->area = 0; // its picture would be turned: not aimed at
  const Vec3 x = e->x;
  e->x = e->y;
  e->y = x;
  for (int c = 0; c < 2; c++) {
    const float t = e->uv[1][c];
    e->uv[1][c] = e->uv[2][c];
    e->uv[2][c] = t;
  }
}

static Emitter triangle_emitter(const Prepare *p, const Emitter *base, const Frame *f, const TriangleMesh *mesh,
                                size_t triangle)
{
  Emitter e = *base;
  Vec3 v[3];
  e.kind = EMITTER_TRIANGLE;
  const float *uv = e.map >= 0 ? mesh->texcoords[p->textures.items[e.map].texcoord] : NULL;
  for (int k = 0; k < 3; k++) {
    const uint32_t vertex = mesh->triangles[3 * triangle + (size_t)k];
    v[k] = frame_point(f, v3_load(mesh->positions + 3 * (size_t)vertex));
    for (int c = 0; uv && c < 2; c++) e.uv[k][c] = uv[2 * (size_t)vertex + (size_t)c];
  }
  e.p = v[0];
  e.x = v[1] - v[0];
  e.y = v[2] - v[0];
  e.area = v3_length(v3_cross(e.x, e.y)) / 2;
  unmirror(&e, f);
  return e;
}

static bool mesh_emitters(Prepare *p, size_t index, const MeshData *data)
{
  WorldInstance *w = &p->shading.items[index];
  const Frame *f = &p->instances.items[index].world_from_object;
  int32_t *table = arena_alloc(&p->world->arena, data->triangle_count, sizeof *table);
  if (!table) return prepare_failed_memory(p);
  for (size_t t = 0; t < data->triangle_count; t++) {
    const uint32_t slot = w->slots && w->slots[t] < w->slot_count ? w->slots[t] : 0;
    const SurfaceMaterial *m = &p->materials.items[w->materials[slot]];
    table[t] = -1;
    if (!is_aimable(p, m)) continue;
    const Emitter base = emitter_of(p, m), e = triangle_emitter(p, &base, f, &w->mesh, t);
    if (!(e.area > 0) || !isfinite(e.area)) continue;
    table[t] = (int32_t)p->emitters.count;
    if (!prepare_add_emitter(p, &e)) return false;
  }
  w->emitters = table;
  return true;
}

static bool shape_emitters(Prepare *p, size_t index)
{
  WorldInstance *w = &p->shading.items[index];
  const Instance *i = &p->instances.items[index];
  Emitter e = shape_emitter(p, i, &p->materials.items[w->materials[0]]);
  unmirror(&e, &i->world_from_object);
  if (!(e.area > 0) || !isfinite(e.area)) return true;
  int32_t *table = arena_alloc(&p->world->arena, 1, sizeof *table);
  if (!table) return prepare_failed_memory(p);
  *table = (int32_t)p->emitters.count;
  w->emitters = table;
  return prepare_add_emitter(p, &e);
}

bool prepare_emitters(Prepare *p)
{
  for (size_t i = 0; i < p->instances.count; i++) {
    const WorldInstance *w = &p->shading.items[i];
    bool shines = false;
    for (uint32_t s = 0; s < w->slot_count; s++) shines |= is_aimable(p, &p->materials.items[w->materials[s]]);
    if (!shines || w->gate || w->clip) continue; // what is cut off must not be aimed at
    p->cell = p->instance_cells.items[i];
    const int32_t part = p->mesh_parts.items[i];
    if (p->instances.items[i].kind == INSTANCE_VOXELS) {
      if (!prepare_voxel_emitters(p, i)) return false;
      continue;
    }
    if (part >= 0 ? !mesh_emitters(p, i, p->parts->meshes.items[part].data) : !shape_emitters(p, i)) return false;
  }
  return true;
}
