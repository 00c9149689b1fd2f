// Worlds through the public interface: preparing, asking rays, cameras.

#include "api/api.h"
#include "scene/gates.h"

#include "accel/place.h"
#include "base/mem.h"
#include "render/camera.h"

#include <string.h>

// Rays and hits go through the kernels as they are.
_Static_assert(sizeof(rf_ray) == sizeof(PackedRay) && sizeof(rf_hit) == sizeof(Hit), "same size");
_Static_assert(offsetof(rf_ray, direction) == offsetof(PackedRay, d) &&
                   offsetof(rf_ray, tmax) == offsetof(PackedRay, tmax),
               "rf_ray is PackedRay");
_Static_assert(offsetof(rf_hit, u) == offsetof(Hit, u) && offsetof(rf_hit, part) == offsetof(Hit, prim) &&
                   offsetof(rf_hit, instance) == offsetof(Hit, instance) && offsetof(rf_hit, object) == 20,
               "rf_hit is Hit");

static bool name_objects(rf_world *w, const Scene *s, Err *err)
{
  const size_t count = w->world->instance_count;
  w->objects = mem_alloc(count + 1, sizeof *w->objects);
  if (!w->objects) return err_memory(err, "object ids", (count + 1) * sizeof *w->objects);
  w->objects[0].id = 0;
  for (size_t i = 0; i < count; i++) {
    const uint32_t object_i = w->world->instances[i].object_i;
    w->objects[i + 1].id =
        object_i < s->objects.count ? s->objects.items[object_i].id : UINT32_MAX; // a light's own
  }
  return true;
}

rf_world *api_prepare(rf_scene *s, const rf_world *previous, const Cancel *cancel, Err *err)
{
  rf_engine *e = s->engine;
  rf_world *w = mem_zero(1, sizeof *w);
  if (!w) return err_memory(err, "a world", sizeof *w), NULL;
  w->engine = e;
  w->world = world_prepare(s->scene, previous ? previous->world : NULL, &s->options, e->jobs, cancel, err);
  if (!w->world || !name_objects(w, s->scene, err)) {
    rf_world_destroy(w);
    return NULL;
  }
  api_log_notes(e, &w->world->notes);
  return w;
}

rf_world *rf_prepare(rf_scene *s, const rf_world *previous)
{
  if (!s) return api_bad_argument("rf_prepare", "the scene is NULL"), NULL;
  Err err = {0};
  rf_world *w = api_prepare(s, previous, &s->engine->cancel, &err);
  api_fail(&err);
  return w;
}

rf_world *rf_world_share(const rf_world *w, rf_engine *e)
{
  if (!w) return api_bad_argument("rf_world_share", "the world is NULL"), NULL;
  const size_t count = w->world->instance_count + 1;
  Err err = {0};
  rf_world *other = mem_zero(1, sizeof *other);
  if (other) other->objects = mem_alloc(count, sizeof *other->objects);
  if (!other || !other->objects) {
    mem_free(other);
    api_fail((err_memory(&err, "a world", count * sizeof *other->objects), &err));
    return NULL;
  }
  other->engine = e ? e : w->engine;
  other->world = world_share(w->world);
  memcpy(other->objects, w->objects, count * sizeof *other->objects);
  return other;
}

void rf_world_destroy(rf_world *w)
{
  if (!w) return;
  world_release(w->world);
  mem_free(w->objects);
  mem_free(w);
}

bool rf_world_bounds(const rf_world *w, rf_vec3 *lo, rf_vec3 *hi)
{
  if (!w || !lo || !hi) return api_bad_argument("rf_world_bounds", "world and results must not be NULL");
  const float *l = w->world->lo, *h = w->world->hi;
  *lo = (rf_vec3){l[0], l[1], l[2]};
  *hi = (rf_vec3){h[0], h[1], h[2]};
  return l[0] <= h[0];
}

rf_world_stats rf_world_take_stats(const rf_world *w)
{
  if (!w) return (rf_world_stats){0};
  return (rf_world_stats){.triangles = w->world->triangle_count,
                          .unique_triangles = w->world->unique_triangle_count,
                          .geometry_bytes = w->world->geometry_bytes,
                          .texture_bytes = w->world->texture_bytes,
                          .tree_bytes = w->world->tree_bytes};
}

// --- rays: these check nothing --------------------------------------------------------------------
void rf_intersect_n(const rf_world *w, const rf_ray *rays, rf_hit *hits, size_t count)
{
  // The kernels write our hits in place; the names are put in while a block of them is still in the first cache.
  enum { BLOCK = 1024 };
  for (size_t first = 0; first < count; first += BLOCK) {
    const size_t n = count - first < BLOCK ? count - first : BLOCK;
    Hit *block = (Hit *)(void *)(hits + first);
    w->engine->hot->closest_n(w->world->accel, (const PackedRay *)(const void *)(rays + first), block, n);
    for (size_t i = 0; i < n; i++)
      hits[first + i].object = w->objects[block[i].instance + 1u]; // NO_HIT + 1 is 0
  }
}

void rf_occluded_n(const rf_world *w, const rf_ray *rays, uint8_t *blocked, size_t count)
{
  w->engine->hot->any_n(w->world->accel, (const PackedRay *)(const void *)rays, blocked, count);
}

bool rf_intersect(const rf_world *w, const rf_ray *ray, rf_hit *hit)
{
  rf_intersect_n(w, ray, hit, 1);
  return hit->object.id != 0;
}

bool rf_occluded(const rf_world *w, const rf_ray *ray)
{
  uint8_t blocked = 0;
  rf_occluded_n(w, ray, &blocked, 1);
  return blocked;
}

static rf_vec3 to_public(Vec3 v)
{
  return (rf_vec3){v[0], v[1], v[2]};
}
static Vec3 from_public(rf_vec3 v)
{
  return v3(v.x, v.y, v.z);
}

rf_surface rf_surface_at(const rf_world *w, const rf_ray *ray, const rf_hit *hit)
{
  const World *world = w->world;
  const Ray r = {from_public(ray->origin), from_public(ray->direction), ray->tmin, ray->tmax};
  const Hit h = {hit->t, hit->u, hit->v, hit->part, hit->instance};
  const SurfacePoint s = accel_surface(world->accel, &world->instances[h.instance].mesh, &r, &h);
  const uint32_t material = world_material(world, &h);
  return (rf_surface){.position = to_public(s.p),
                      .error = s.error,
                      .ng = to_public(s.ng),
                      .n = to_public(s.n),
                      .u = s.uv[0].x,
                      .v = s.uv[0].y,
                      .is_back = s.is_back,
                      .material = material + 1,
                      .material_name = world->material_names[material]};
}

typedef struct NearestCrossing {
  float t;
  uint32_t prim;
  const Voxels *grid;
  VoxelCrossing found;
  float off;
} NearestCrossing;

// The crossing that the hit was: of the same face and entry, nearest to its t, which was held to the instance's box.
static bool see_crossing(void *user, const VoxelCrossing *c)
{
  NearestCrossing *n = user;
  const float off = fabsf(c->t - n->t);
  if (voxel_prim(n->grid, c) == n->prim && off < n->off) {
    n->off = off;
    n->found = *c;
  }
  return c->t > n->t && c->t - n->t > n->off;
}

bool rf_voxel_at(const rf_world *w, const rf_ray *ray, const rf_hit *hit, rf_voxel *out)
{
  if (!hit->object.id || hit->instance >= w->world->instance_count) return false;
  const Instance *i = &accel_instances(w->world->accel)[hit->instance];
  if (i->kind != INSTANCE_VOXELS) return false;
  const Vec3 o = frame_point(&i->object_from_world, from_public(ray->origin)) + v3_all(0);
  const Vec3 d = frame_vector(&i->object_from_world, from_public(ray->direction));
  const float from[3] = {o[0], o[1], o[2]}, way[3] = {d[0], d[1], d[2]};
  const Voxels *v = i->voxels->grid;
  NearestCrossing n = {.t = hit->t, .prim = hit->part, .grid = v, .off = INFINITY};
  (void)voxel_walk(i->voxels, from, way, fmaxf(ray->tmin, 0), FLT_MAX, see_crossing, &n);
  if (!(n.off < INFINITY)) return false;
  const uint32_t entry = hit->part >> 3;
  *out = (rf_voxel){.face = (int32_t)n.found.face, .entry = entry, .name = v->palette->entries[entry].name};
  for (int k = 0; k < 3; k++) {
    out->cell[k] = out->beside[k] = n.found.cell[k];
    out->size[k] = v->size[k];
    out->color[k] = v->palette->entries[entry].color[k];
  }
  out->beside[n.found.face >> 1] += n.found.face & 1 ? 1 : -1;
  return true;
}

// --- cameras --------------------------------------------------------------------------------------
const Camera *api_find_camera(const Scene *s, const char *name, Err *err)
{
  if (!name) return &s->camera;
  const char *names[64];
  size_t count = 0;
  for (size_t i = 0; i < s->cameras.count; i++) {
    if (text_equal(s->cameras.items[i].name, name)) return &s->cameras.items[i];
    if (count < 64) names[count++] = s->cameras.items[i].name;
  }
  char hint[120];
  err_set(err, ERR_BAD_SCENE, "there is no camera \"%s\"%s", name, text_hint(hint, name, names, count));
  return NULL;
}

static rf_eye public_eye(const Eye *e)
{
  rf_eye out = {.frame = {to_public(e->frame.x), to_public(e->frame.y), to_public(e->frame.z), to_public(e->frame.p)},
                .lens = (rf_lens)e->kind, .focus = e->focus, .aperture = e->aperture, .blades = e->blades,
                .height = e->height, .cell = (int)e->cell};
  out.fov = e->kind == EYE_PANORAMIC ? e->span : 2 * (float)atan((double)e->tan_half_fov);
  return out;
}

Eye api_eye(const rf_eye *e)
{
  return (Eye){.kind = (EyeKind)e->lens,
               .frame = {from_public(e->frame.x), from_public(e->frame.y), from_public(e->frame.z),
                         from_public(e->frame.p)},
               .tan_half_fov = (float)tan((double)e->fov / 2), .focus = e->focus, .aperture = e->aperture,
               .blades = e->blades, .height = e->height, .span = e->fov, .cell = (uint32_t)e->cell};
}

bool rf_camera(rf_scene *s, const rf_world *w, const char *name, float aspect, rf_eye *eye)
{
  if (!s || !eye) return api_bad_argument("rf_camera", "scene and result must not be NULL");
  Err err = {0};
  Eye e;
  const Camera *found = api_find_camera(s->scene, name, &err);
  Camera framed;
  if (!name && !s->scene->has_camera && w) {
    framed = world_frame_camera(w->world, aspect > 0 ? aspect : 1);
    found = &framed;
  }
  if (found && eye_from_camera(found, &e, &err)) {
    if (found->common.cell >= 0) eye_bend(found, cell_curvature(&s->scene->cells.items[found->common.cell]), &e);
    *eye = public_eye(&e);
  }
  return api_fail(&err);
}

rf_ray rf_eye_ray(const rf_eye *eye, float width, float height, float x, float y)
{
  Eye e = api_eye(eye);
  e.aperture = 0;
  const Ray r = eye_ray(&e, width, height, (Vec2){x, y}, (Vec2){0.5f, 0.5f});
  return (rf_ray){to_public(r.o), 0, to_public(r.d), INFINITY};
}
