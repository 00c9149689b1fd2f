// The whitted integrator against closed forms: light models in both units, mirrors, glass and total reflection, shadows
// through glass, roles, and pictures that do not depend on tiles or instruction sets. A prism bends rays as Snell says.

#include "tests/render_sample.h"

#include "accel/place.h"
#include "accel/traverse.h"
#include "geom/offset.h"
#include "shade/fresnel.h"

static Scene *whitted_scene(void)
{
  Scene *s = new_scene(0);
  s->render.integrator = INTEGRATOR_WHITTED;
  s->render.max_depth = 4;
  s->render.filter = FILTER_BOX;
  s->render.filter_width = 1e-6f;
  s->whitted.light_units = LIGHT_UNITS_CLASSIC;
  return s;
}

static int32_t add_phong(Scene *s, float diffuse, float specular, float exponent)
{
  const int32_t m = scene_add_material(s, MATERIAL_PHONG, "phong");
  Phong *p = &s->materials.items[m].phong;
  set3(p->ambient, diffuse, diffuse, diffuse);
  set3(p->diffuse, diffuse, diffuse, diffuse);
  set3(p->specular, specular, specular, specular);
  p->exponent = exponent;
  return m;
}

static void add_point(Scene *s, float x, float y, float z, float intensity)
{
  Light *l = add_light(s, LIGHT_POINT);
  set3(l->point.position, x, y, z);
  set3(l->point.intensity, intensity, intensity, intensity);
}

static Film *picture_by(const Scene *s, uint32_t side, uint32_t tile, IsaLevel isa, bool with_lanes)
{
  Err err = {0};
  World *w = world_prepare(s, NULL, NULL, NULL, NULL, &err);
  if (w && !with_lanes) w->lanes = NULL;
  Camera c = {.kind = CAMERA_PERSPECTIVE, .common = {.position = {0, 0, 4}, .up = {0, 1, 0}}, .perspective = {.fov = 40}};
  Film *f = film_create(side, side, ALL_PLANES, NULL);
  RenderJob job = {.world = w, .settings = s->render, .film = f, .end_sample = 1, .tile_size = tile};
  CHECK_MSG(w && f && eye_from_camera(&c, &job.eye, NULL), "%s", err.text);
  RenderStats stats;
  CHECK(render_run(&job, NULL, hot_table(isa), NULL, &stats, NULL));
  CHECK(stats.bad_samples == 0);
  world_release(w);
  return f;
}

// A picture of `side` pixels seen from (0, 0, 4) towards -z; the caller frees the film.
static Film *picture(const Scene *s, uint32_t side, uint32_t tile, IsaLevel isa) { return picture_by(s, side, tile, isa, true); }

// The red of the one pixel that looks straight ahead.
static double middle_by(const Scene *s, bool with_lanes)
{
  Film *f = picture_by(s, 1, 0, cpu_best_isa(), with_lanes);
  float out[4];
  CHECK(film_resolve(f, FILM_BEAUTY, out));
  film_destroy(f);
  return (double)out[0];
}

static double middle(const Scene *s) { return middle_by(s, true); }

TEST(light_models_in_classic_units)
{
  Scene *s = whitted_scene();
  add_quad(s, add_phong(s, 0.5f, 0.3f, 20), 0, 0, 0, 0, 0, 4);
  add_point(s, 3, 0, 4, 2); // 5 m away at a cosine of 0.8
  const double along = 0.8;  // of the mirror's direction, the normal, and the light
  CHECK_NEAR(middle(s), 2 * (0.5 * 0.8 + 0.3 * pow(along, 20)), 1e-5);
  s->whitted.light_model = LIGHT_MODEL_LAMBERT;
  CHECK_NEAR(middle(s), 2 * 0.5 * 0.8, 1e-5);
  set3(s->whitted.ambient, 0.25f, 0.25f, 0.25f);
  CHECK_NEAR(middle(s), 2 * 0.5 * 0.8 + 0.25 * 0.5, 1e-5);
  s->whitted.light_units = LIGHT_UNITS_PHYSICAL;
  CHECK_NEAR(middle(s), 2.0 / 25 * 0.5 / 3.14159265358979 * 0.8 + 0.25 * 0.5, 1e-6);
  scene_destroy(s);
}

// Cook and Torrance by their formula, in doubles.
TEST(cook_torrance_in_classic_units)
{
  Scene *s = whitted_scene();
  const int32_t m = scene_add_material(s, MATERIAL_COOK_TORRANCE, NULL);
  CookTorrance *c = &s->materials.items[m].cook_torrance;
  set3(c->diffuse, 0, 0, 0);
  set3(c->specular, 0.5f, 0.5f, 0.5f);
  set3(c->f0, 0.2f, 0.2f, 0.2f);
  c->roughness = 0.25f;
  add_quad(s, m, 0, 0, 0, 0, 0, 4);
  add_point(s, 3, 0, 4, 2);
  const double n_l = 0.8, half = acos(n_l) / 2, n_h = cos(half), v_h = n_h;
  const double f = 0.2 + 0.8 * pow(1 - v_h, 5), rough = exp(-(half / 0.25) * (half / 0.25));
  const double g = fmin(1, fmin(2 * n_h * 1 / v_h, 2 * n_h * n_l / v_h));
  CHECK_NEAR(middle(s), 2 * 0.5 * f * rough * g, 1e-5);
  scene_destroy(s);
}

// In physical units a pbr, a lambert and a phong surface look to one light as the path tracer shows them.
TEST(physical_units_agree_with_the_path_tracer)
{
  for (int kind = 0; kind < 3; kind++) {
    Scene *s = whitted_scene();
    s->whitted.light_units = LIGHT_UNITS_PHYSICAL;
    add_quad(s, kind == 0 ? add_pbr(s, 0.6f, 0.4f) : kind == 1 ? add_lambert(s, 0.6f, 0.6f, 0.6f) : add_phong(s, 0.5f, 0.3f, 20),
             0, 0, 0, 0, 0, 4);
    add_point(s, 2, 1, 3, 30);
    s->render.max_depth = 0; // no mirror rays
    const double whitted = middle(s);
    s->render.integrator = INTEGRATOR_PATH;
    s->render.max_depth = 1;
    CHECK_NEAR(whitted, middle(s), 1e-5 * whitted);
    CHECK(whitted > 0.1);
    scene_destroy(s);
  }
}

// A sheet of glass in front of a wall that shines: fixed weights, Fresnel's, and the mirror behind the eye.
TEST(glass_and_mirrors)
{
  Scene *s = whitted_scene();
  add_quad(s, add_glow(s, 1, false), 0, 0, -2, 0, 0, 40);
  const int32_t m = add_phong(s, 0, 0, 1);
  Phong *p = &s->materials.items[m].phong;
  set3(p->transmit, 0.5f, 0.5f, 0.5f);
  set3(p->reflect, 0.25f, 0.25f, 0.25f);
  set3(s->sky.constant.color, 0.5f, 0.5f, 0.5f);
  add_box(s, m, 0, 0, 0, 9, 9, 1);
  s->whitted.fresnel = false;
  s->whitted.least_weight = 0;
  s->render.max_depth = 2; // front; back; the wall, and from the back inside to the front, which only shines
  CHECK_NEAR(middle(s), 0.25 * 0.5 + 0.5 * 0.5 * 1, 1e-6);
  s->whitted.fresnel = true;
  const double f = 0.04; // (1.5 - 1)^2 / (1.5 + 1)^2
  CHECK_NEAR(middle(s), (0.25 + 0.5 * f) * 0.5 + 0.25 * (1 - f) * (1 - f), 1e-5);
  p->attenuation_distance = 1;
  set3(p->attenuation_color, 0.5f, 1, 1);
  CHECK_NEAR(middle(s), (0.25 + 0.5 * f) * 0.5 + 0.25 * (1 - f) * (1 - f) * 0.5, 1e-5);
  scene_destroy(s);
}

// Through a pane light loses its colour twice; an opaque thing or `hard` stops it; a background throws no shadow.
TEST(shadows)
{
  Scene *s = whitted_scene();
  add_quad(s, add_phong(s, 0.5f, 0, 1), 0, 0, 0, 0, 0, 4);
  add_point(s, 3, 0, 4, 2);
  const double lit = 2 * 0.5 * 0.8;
  const int32_t pane = add_phong(s, 0, 0, 1);
  set3(s->materials.items[pane].phong.transmit, 0.5f, 0.25f, 0.5f);
  Object *box = add_box(s, pane, 1.5f, 0, 2, 0.5f, 0.5f, 0.5f);
  CHECK_NEAR(middle(s), lit * 0.25, 1e-5);
  s->whitted.shadows = SHADOWS_HARD;
  CHECK_NEAR(middle(s), 0, 1e-6);
  s->whitted.shadows = SHADOWS_NONE;
  CHECK_NEAR(middle(s), lit, 1e-5);
  s->whitted.shadows = SHADOWS_HARD;
  box->common.role = ROLE_BACKGROUND;
  CHECK_NEAR(middle(s), lit, 1e-5);
  box->common.role = ROLE_ACTOR;
  set3(box->common.translate, 0, 0, 1);
  set3(s->materials.items[pane].phong.transmit, 0, 0, 0);
  s->objects.items[0].common.role = ROLE_BACKGROUND; // the actor in front is seen
  CHECK_NEAR(middle(s), 0, 1e-6);
  scene_destroy(s);
}

// What lies within coloured glass is lit through as much of it as there is towards the light, by lanes and by trees.
TEST(light_comes_into_glass)
{
  Scene *s = whitted_scene();
  s->whitted.fresnel = false;
  add_quad(s, add_phong(s, 0.5f, 0, 1), 0, 0, 0, 0, 0, 4);
  add_point(s, 3, 0, 4, 2);
  const int32_t body = add_phong(s, 0, 0, 1);
  Phong *p = &s->materials.items[body].phong;
  set3(p->transmit, 0.5f, 0.5f, 0.5f);
  p->attenuation_distance = 1;
  set3(p->attenuation_color, 0.5f, 1, 1);
  add_box(s, body, 0, 0, 0, 9, 9, 2); // 1 m to the eye, and 5/4 m to the light
  const double lit = 2 * 0.5 * 0.8;
  CHECK_NEAR(middle_by(s, true), lit * 0.5 * 0.5 * pow(0.5, 1 + 1.25), 1e-5);
  CHECK_NEAR(middle_by(s, false), lit * 0.5 * 0.5 * pow(0.5, 1 + 1.25), 1e-5);
  set3(s->objects.items[1].common.translate, 0, 0, 2); // in front of it: all of both ways through
  CHECK_NEAR(middle_by(s, true), lit * 0.5 * 0.5 * 0.5 * 0.5 * pow(0.5, 2 + 2.5), 1e-5);
  CHECK_NEAR(middle_by(s, false), lit * 0.5 * 0.5 * 0.5 * 0.5 * pow(0.5, 2 + 2.5), 1e-5);
  scene_destroy(s);
}

// What is there in part is there in part of a pixel's samples, and a mix shines with both its parts.
TEST(parts_of_surfaces)
{
  Scene *s = whitted_scene();
  set3(s->sky.constant.color, 1, 1, 1);
  const int32_t veil = add_pbr(s, 0, 1), glow = add_glow(s, 3, false), grey = add_lambert(s, 0.5f, 0.5f, 0.5f);
  s->materials.items[veil].pbr.alpha_mode = ALPHA_BLEND;
  s->materials.items[veil].pbr.opacity = 0.5f;
  s->materials.items[veil].pbr.specular = 0;
  add_quad(s, veil, 0, 0, 0, 0, 0, 4);
  World *w = world_of(s);
  Film *f = film_create(8, 8, ALL_PLANES, NULL);
  const RenderJob job = job_of(s, w, pinhole(0, 0, 4, 0, 0, 0, 20), f, 256);
  CHECK(render_run(&job, NULL, hot_table(cpu_best_isa()), NULL, NULL, NULL));
  const Picture p = summarize(f);
  CHECK_MSG(p.least > 0.3f && p.most < 0.7f, "%g to %g", (double)p.least, (double)p.most);
  CHECK_NEAR(p.mean[0], 0.5, 0.02);
  film_destroy(f);
  world_release(w);

  const int32_t mix = scene_add_material(s, MATERIAL_MIX, "mix");
  s->materials.items[mix].mix = (Mix){grey, glow, 0.25f, -1, 0};
  s->objects.items[0].common.material = mix;
  set3(s->sky.constant.color, 0, 0, 0);
  CHECK_NEAR(middle(s), 0.25 * 3, 1e-6);
  scene_destroy(s);
}

// Every tiling and every instruction set give the same film.
TEST(one_picture)
{
  Scene *s = rich_scene();
  s->render.integrator = INTEGRATOR_WHITTED;
  s->render.max_depth = 6;
  uint64_t first = 0;
  for (int k = 0; k < 4 + (int)cpu_best_isa(); k++) {
    static const uint32_t tiles[4] = {16, 8, 13, 37};
    Film *f = picture(s, 37, tiles[k < 4 ? k : 0], k < 4 ? cpu_best_isa() : (IsaLevel)(k - 4));
    const uint64_t hash = film_hash(f);
    if (!k) first = hash;
    CHECK_MSG(hash == first, "%d", k);
    film_destroy(f);
  }
  scene_destroy(s);
}

// P11. Rays through a prism of glass, made of three half-spaces, turn by what Snell's law twice says.
TEST(a_prism_deviates_as_snell_says)
{
  Scene *s = new_scene(0);
  const int32_t body = scene_add_object(s, SHAPE_CSG, "prism");
  s->objects.items[body].shape.csg.operation = CSG_INTERSECTION;
  for (int k = 0; k < 3; k++) {
    Object *o = add_object(s, SHAPE_PLANE, -1, 0, 0, 0);
    o->common.part_of = body;
    const float a = (float)(k * 120 + 30) * (PI / 180);
    set3(o->common.rotate, -90, 0, (float)(k * 120 - 60)); // normals at 30, 150 and 270 degrees in the plane z = 0
    set3(o->common.translate, f_cos(a), f_sin(a), 0);
  }
  World *w = world_prepare(s, NULL, NULL, NULL, NULL, NULL);
  CHECK(w && w->instance_count == 1);
  RayCounters c = {0};
  int through = 0;
  double worst = 0;
  for (int i = 0; w && i < 1000; i++) {
    const double n = 1.5, apex = 3.14159265358979323846 / 3, in = 0.55 + 0.75 * i / 1000; // angle of incidence
    const double face = 5 * apex / 2;                                                  // 150 degrees
    const double to = face + 3.14159265358979323846 - in;                              // the ray turns towards the base
    const Vec3 at = v3((float)cos(face), (float)sin(face), 0.1f), d = v3((float)cos(to), (float)sin(to), 0);
    Ray ray = {at - 2 * d, d, 0, INFINITY};
    Hit hit;
    bool ok = true;
    for (int k = 0; k < 2 && ok; k++) {
      ok = accel_closest(w->accel, &ray, RAY_ALL, NULL, NULL, &c, &hit);
      if (!ok) break;
      const SurfacePoint p = accel_surface(w->accel, NULL, &ray, &hit);
      const Vec3 normal = p.is_back ? -p.ng : p.ng;
      const float eta = p.is_back ? 1 / 1.5f : 1.5f;
      float cos_t;
      const float cos_i = -v3_dot(ray.d, normal);
      fresnel_dielectric(cos_i, eta, &cos_t);
      ok = cos_t > 0;
      const Vec3 on = v3_normalize(refract(-ray.d, normal, eta, cos_i, cos_t));
      ray = (Ray){offset_origin(&p, on), on, 0, INFINITY};
    }
    const double inside = asin(sin(in) / n), out = asin(fmin(n * sin(apex - inside), 1));
    if (!ok) continue;
    const double turned = acos(fmin((double)v3_dot(ray.d, d), 1)), expected = in + out - apex;
    worst = fmax(worst, fabs(turned - expected));
    through++;
  }
  CHECK_MSG(through > 900 && worst < 1e-5, "%d through, worst %g rad", through, worst);
  world_release(w);
  scene_destroy(s);
}

TEST_MAIN
