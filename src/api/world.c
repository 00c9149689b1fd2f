// Worlds through the public interface: preparing, asking rays, cameras.

#include "api/api.h"

#include "base/mem.h"
#include "render/camera.h"

#include <string.h>

_Static_assert(sizeof(rf_ray) == sizeof(PackedRay), "rays go to the kernels as they are");

static bool copy_ids(rf_world *w, const Scene *s, Err *err)
{
  w->object_count = s->objects.count;
  w->object_ids = mem_alloc(w->object_count ? w->object_count : 1, sizeof *w->object_ids);
  if (!w->object_ids) return err_memory(err, "object ids", w->object_count * sizeof *w->object_ids);
  for (size_t i = 0; i < w->object_count; i++) w->object_ids[i] = s->objects.items[i].id;
  return true;
}

rf_world *rf_prepare(rf_scene *s, const rf_world *previous)
{
  if (!s) return api_bad_argument("rf_prepare", "the scene is NULL"), NULL;
  Err err = {0};
  rf_engine *e = s->engine;
  rf_world *w = mem_zero(1, sizeof *w);
  if (!w) err_memory(&err, "a world", sizeof *w);
  if (w && copy_ids(w, s->scene, &err)) {
    w->engine = e;
    w->world = world_prepare(s->scene, previous ? previous->world : NULL, &s->options, e->jobs, &e->cancel, &err);
  }
  if (!api_fail(&err)) {
    rf_world_destroy(w);
    return NULL;
  }
  api_log_notes(e, &w->world->notes);
  return w;
}

void rf_world_destroy(rf_world *w)
{
  if (!w) return;
  world_release(w->world);
  mem_free(w->object_ids);
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
  return (rf_world_stats){w->world->triangle_count, w->world->unique_triangle_count, w->world->geometry_bytes,
                          w->world->texture_bytes};
}

// --- rays: these check nothing --------------------------------------------------------------------
static Vec3 geometric_normal(const World *w, const Hit *h)
{
  const Instance *i = accel_instances(w->accel) + h->instance;
  const TriangleMesh *m = &w->instances[h->instance].mesh;
  Vec3 n = v3(0, 0, 1);
  if (i->kind == INSTANCE_MESH) {
    const uint32_t *t = m->triangles + 3 * (size_t)h->prim;
    const Vec3 a = v3_load(m->positions + 3 * (size_t)t[0]);
    n = v3_cross(v3_load(m->positions + 3 * (size_t)t[1]) - a, v3_load(m->positions + 3 * (size_t)t[2]) - a);
  }
  return v3_normalize(frame_normal(&i->object_from_world, n));
}

static rf_hit public_hit(const rf_world *w, const PackedRay *ray, const Hit *h)
{
  if (h->instance == NO_HIT) return (rf_hit){.t = ray->tmax};
  const Instance *i = accel_instances(w->world->accel) + h->instance;
  const uint32_t object_i = w->world->instances[h->instance].object_i;
  Vec3 n;
  if (i->kind == INSTANCE_SPHERE) {
    const Vec3 p = v3_load(ray->o) + h->t * v3_load(ray->d);
    n = v3_normalize(frame_normal(&i->object_from_world, frame_point(&i->object_from_world, p)));
  } else {
    n = geometric_normal(w->world, h);
  }
  const uint32_t id = object_i < w->object_count ? w->object_ids[object_i] : UINT32_MAX; // a light's own surface
  return (rf_hit){.t = h->t, .u = h->u, .v = h->v, .part = h->prim, .object = {id}, .normal = {n[0], n[1], n[2]}};
}

void rf_intersect_n(const rf_world *w, const rf_ray *rays, rf_hit *hits, size_t count)
{
  enum { BATCH = 256 };
  Hit found[BATCH];
  for (size_t first = 0; first < count; first += BATCH) {
    const size_t n = count - first < BATCH ? count - first : BATCH;
    const PackedRay *batch = (const PackedRay *)(const void *)(rays + first);
    w->engine->hot->closest_n(w->world->accel, batch, found, n);
    for (size_t i = 0; i < n; i++) hits[first + i] = public_hit(w, &batch[i], &found[i]);
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

// --- cameras --------------------------------------------------------------------------------------
static const Camera *find_camera(const Scene *s, const char *name, Err *err)
{
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

static rf_vec3 to_public(Vec3 v) { return (rf_vec3){v[0], v[1], v[2]}; }
static Vec3 from_public(rf_vec3 v) { return v3(v.x, v.y, v.z); }

static rf_eye public_eye(const Eye *e)
{
  rf_eye out = {.frame = {to_public(e->frame.x), to_public(e->frame.y), to_public(e->frame.z), to_public(e->frame.p)},
                .lens = (rf_lens)e->kind, .focus = e->focus, .aperture = e->aperture, .blades = e->blades,
                .height = e->height};
  out.fov = e->kind == EYE_PANORAMIC ? e->span : 2 * (float)atan((double)e->tan_half_fov);
  return out;
}

Eye api_eye(const rf_eye *e)
{
  return (Eye){.kind = (EyeKind)e->lens,
               .frame = {from_public(e->frame.x), from_public(e->frame.y), from_public(e->frame.z),
                         from_public(e->frame.p)},
               .tan_half_fov = (float)tan((double)e->fov / 2), .focus = e->focus, .aperture = e->aperture,
               .blades = e->blades, .height = e->height, .span = e->fov};
}

bool rf_camera(rf_scene *s, const rf_world *w, const char *name, float aspect, rf_eye *eye)
{
  if (!s || !eye) return api_bad_argument("rf_camera", "scene and result must not be NULL");
  Err err = {0};
  Eye e;
  const Camera *found = name ? find_camera(s->scene, name, &err) : &s->scene->camera;
  Camera framed;
  if (!name && !s->scene->has_camera && w) {
    framed = world_frame_camera(w->world, aspect > 0 ? aspect : 1);
    found = &framed;
  }
  if (found && eye_from_camera(found, &e, &err)) *eye = public_eye(&e);
  return api_fail(&err);
}
