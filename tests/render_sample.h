// What the tests of rendering share: small scenes put together by hand, eyes to see them by, and what a film shows.

#ifndef RAYFOLD_TESTS_RENDER_SAMPLE_H
#define RAYFOLD_TESTS_RENDER_SAMPLE_H

#include "tests/test.h"

#include "base/mem.h"
#include "render/render.h"

enum { ALL_PLANES = (1 << FILM_PLANE_COUNT) - 1 };

static inline void set3(float out[3], float x, float y, float z)
{
  out[0] = x;
  out[1] = y;
  out[2] = z;
}

// --- scenes -------------------------------------------------------------------------------------

static inline Scene *new_scene(float sky)
{
  Scene *s = scene_create(NULL);
  s->sky.kind = SKY_CONSTANT;
  set3(s->sky.constant.color, sky, sky, sky);
  s->sky.constant.gain = 1;
  return s;
}

static inline int32_t add_lambert(Scene *s, float r, float g, float b)
{
  const int32_t m = scene_add_material(s, MATERIAL_LAMBERT, "lambert");
  set3(s->materials.items[m].lambert.albedo, r, g, b);
  return m;
}

static inline int32_t add_pbr(Scene *s, float base, float roughness)
{
  const int32_t m = scene_add_material(s, MATERIAL_PBR, "pbr");
  set3(s->materials.items[m].pbr.base_color, base, base, base);
  s->materials.items[m].pbr.roughness = roughness;
  return m;
}

static inline int32_t add_glow(Scene *s, float radiance, bool lights_others)
{
  const int32_t m = scene_add_material(s, MATERIAL_EMISSION, "glow");
  s->materials.items[m].emission.strength = radiance;
  s->materials.items[m].emission.lights_others = lights_others;
  return m;
}

static inline Object *add_object(Scene *s, ShapeKind kind, int32_t material, float x, float y, float z)
{
  const int32_t i = scene_add_object(s, kind, NULL);
  Object *o = &s->objects.items[i];
  o->common.material = material;
  set3(o->common.translate, x, y, z);
  return o;
}

static inline Object *add_sphere(Scene *s, int32_t material, float x, float y, float z, float radius)
{
  Object *o = add_object(s, SHAPE_SPHERE, material, x, y, z);
  o->shape.sphere.radius = radius;
  return o;
}

// A square of side `size` that faces +z after being turned about x and y (degrees).
static inline Object *add_quad(Scene *s, int32_t material, float x, float y, float z, float turn_x,
                               float turn_y, float size)
{
  Object *o = add_object(s, SHAPE_QUAD, material, x, y, z);
  o->shape.quad.size[0] = o->shape.quad.size[1] = size;
  set3(o->common.rotate, turn_x, turn_y, 0);
  return o;
}

static inline Object *add_box(Scene *s, int32_t material, float x, float y, float z, float size_x,
                              float size_y, float size_z)
{
  Object *o = add_object(s, SHAPE_BOX, material, x, y, z);
  set3(o->shape.box.size, size_x, size_y, size_z);
  return o;
}

// Good until the next light is added.
static inline Light *add_light(Scene *s, LightKind kind)
{
  const int32_t i = scene_add_light(s, kind, NULL);
  return &s->lights.items[i];
}

// One of most things that light can meet.
static inline Scene *rich_scene(void)
{
  Scene *s = new_scene(0);
  s->sky.kind = SKY_GRADIENT;
  set3(s->sky.gradient.zenith, 0.2f, 0.4f, 0.9f);
  set3(s->sky.gradient.horizon, 0.9f, 0.9f, 1);
  set3(s->sky.gradient.ground, 0.3f, 0.3f, 0.2f);
  s->sky.gradient.gain = 1;
  add_quad(s, add_lambert(s, 0.7f, 0.7f, 0.7f), 0, -1, 0, -90, 0, 8);
  const int32_t metal = add_pbr(s, 0.9f, 0.25f), coat = add_pbr(s, 0.5f, 0.6f), veil = add_pbr(s, 0.8f, 0.5f);
  s->materials.items[metal].pbr.metallic = 1;
  s->materials.items[coat].pbr.clearcoat = 1;
  s->materials.items[veil].pbr.alpha_mode = ALPHA_BLEND;
  s->materials.items[veil].pbr.opacity = 0.5f;
  const int32_t glass = scene_add_material(s, MATERIAL_GLASS, "glass");
  set3(s->materials.items[glass].glass.attenuation_color, 0.3f, 0.8f, 0.4f);
  s->materials.items[glass].glass.attenuation_distance = 1;
  add_sphere(s, metal, -1.1f, -0.5f, 0, 0.5f);
  add_sphere(s, glass, 0, -0.5f, 0.4f, 0.5f);
  add_box(s, coat, 1.1f, -0.6f, -0.3f, 0.8f, 0.8f, 0.8f);
  add_quad(s, veil, 0, 0.2f, 1.2f, 0, 20, 0.8f);
  add_sphere(s, add_glow(s, 6, true), 0.6f, 0.8f, -0.8f, 0.2f);
  Light *sun = add_light(s, LIGHT_SUN);
  set3(sun->sun.direction, 1, 2, 1);
  Light *point = add_light(s, LIGHT_POINT);
  set3(point->point.position, -2, 1, 2);
  return s;
}

// --- pictures -----------------------------------------------------------------------------------

static inline World *world_of(Scene *s)
{
  Err err = {0};
  World *w = world_prepare(s, NULL, NULL, NULL, NULL, &err);
  CHECK_MSG(w, "%s", err.text);
  if (!w) exit(1);
  return w;
}

static inline Eye pinhole(float x, float y, float z, float to_x, float to_y, float to_z, float fov)
{
  Camera c = {.kind = CAMERA_PERSPECTIVE, .common = {.position = {x, y, z}, .target = {to_x, to_y, to_z}, .up = {0, 1, 0}}};
  c.perspective.fov = fov;
  Eye e;
  CHECK(eye_from_camera(&c, &e, NULL));
  return e;
}

static inline Eye parallel(float x, float y, float z, float to_x, float to_y, float to_z, float height)
{
  Camera c = {.kind = CAMERA_ORTHOGRAPHIC, .common = {.position = {x, y, z}, .target = {to_x, to_y, to_z}, .up = {0, 1, 0}}};
  c.orthographic.height = height;
  Eye e;
  CHECK(eye_from_camera(&c, &e, NULL));
  return e;
}

static inline RenderJob job_of(const Scene *s, const World *w, Eye eye, Film *film, uint32_t spp)
{
  RenderJob job = {.world = w, .eye = eye, .settings = s->render, .seed = 1, .film = film, .end_sample = spp};
  job.settings.filter = FILTER_BOX;
  return job;
}

typedef struct Picture {
  float mean[4];     // of all pixels
  float least, most; // of a pixel's mean colour
  double error;      // standard error of the mean luminance
} Picture;

static inline Picture summarize(const Film *f)
{
  const size_t n = (size_t)f->width * f->height;
  float *rgba = mem_alloc(4 * n, sizeof *rgba), *variance = mem_alloc(n, sizeof *variance);
  CHECK(film_resolve(f, FILM_BEAUTY, rgba) && film_resolve(f, FILM_VARIANCE, variance));
  double sum[4] = {0}, sum_variance = 0;
  Picture p = {.least = INFINITY, .most = -INFINITY};
  for (size_t i = 0; i < n; i++) {
    for (int k = 0; k < 4; k++) sum[k] += rgba[4 * i + k];
    sum_variance += variance[i];
    const float grey = (rgba[4 * i] + rgba[4 * i + 1] + rgba[4 * i + 2]) / 3;
    p.least = fminf(p.least, grey);
    p.most = fmaxf(p.most, grey);
  }
  for (int k = 0; k < 4; k++) p.mean[k] = (float)(sum[k] / (double)n);
  p.error = sqrt(sum_variance) / (double)n;
  mem_free(rgba);
  mem_free(variance);
  return p;
}

// Side x side pixels of a world made for it, all samples of which are numbers. The scene stays.
static inline Picture picture_seen(Scene *s, Eye eye, uint32_t side, uint32_t spp)
{
  World *w = world_of(s);
  Film *f = film_create(side, side, ALL_PLANES, NULL);
  const RenderJob job = job_of(s, w, eye, f, spp);
  RenderStats stats;
  Err err = {0};
  CHECK_MSG(render_run(&job, NULL, hot_table(cpu_best_isa()), NULL, &stats, &err), "%s", err.text);
  CHECK_MSG(stats.bad_samples == 0, "%llu samples are not finite", (unsigned long long)stats.bad_samples);
  const Picture p = summarize(f);
  film_destroy(f);
  world_release(w);
  return p;
}

#endif
