// Rendering: pictures of worlds whose light is known in closed form.

#include "tests/render_sample.h"

#include "scene/kinds.h"

// Renders side x side pixels with the plain level and destroys the scene.
static Picture picture_of(Scene *s, Eye eye, uint32_t side, uint32_t spp)
{
  World *w = world_of(s);
  Film *f = film_create(side, side, ALL_PLANES, NULL);
  const RenderJob job = job_of(s, w, eye, f, spp);
  RenderStats stats;
  Err err = {0};
  CHECK_MSG(render_run(&job, NULL, hot_table(cpu_best_isa()), NULL, &stats, &err), "%s", err.text);
  CHECK_MSG(stats.bad_samples == 0, "%llu samples are not finite", (unsigned long long)stats.bad_samples);
  CHECK(stats.rays.camera_rays == (uint64_t)side * side * spp && stats.samples == spp);
  const Picture p = summarize(f);
  film_destroy(f);
  world_release(w);
  scene_destroy(s);
  return p;
}

// --- the white furnace --------------------------------------------------------------------------

// P1: inside a closed body of albedo a that emits 1 - a everything shines with exactly 1, if paths may be as long as a
// scene can ask for: at albedo 0.99, 255 bounces would leave 8 % of the light out.
TEST(white_furnace)
{
  const struct {
    float albedo, tolerance;
    uint32_t spp;
  } cases[] = {{0, 1e-4f, 1}, {0.5f, 0.005f, 16}, {0.9f, 0.005f, 16}, {0.99f, 0.01f, 6}};
  for (int is_sphere = 0; is_sphere < 2; is_sphere++) {
    for (int c = 0; c < 4; c++) {
      Scene *s = new_scene(0);
      const int32_t m = add_pbr(s, cases[c].albedo, 1);
      s->materials.items[m].pbr.specular = 0;
      const float e = 1 - cases[c].albedo;
      set3(s->materials.items[m].pbr.emissive, e, e, e);
      if (is_sphere)
        add_sphere(s, m, 0, 0, 0, 2);
      else
        add_box(s, m, 0, 0, 0, 3, 2, 4);
      s->render.max_depth = (int32_t)group_find_field(&group_render, &s->render, "max_depth", NULL)->high;
      const Picture p = picture_of(s, pinhole(0.3f, 0.2f, 0.4f, 1, -0.5f, -1, 90), 64, cases[c].spp);
      printf("  %s, albedo %.2f: %.5f +- %.5f\n", is_sphere ? "sphere" : "box", (double)cases[c].albedo,
             (double)p.mean[1], p.error);
      for (int k = 0; k < 3; k++) {
        CHECK_MSG(fabsf(p.mean[k] - 1) < cases[c].tolerance, "%s, albedo %.2f: %.5f +- %.5f",
                  is_sphere ? "sphere" : "box", (double)cases[c].albedo, (double)p.mean[k], p.error);
      }
    }
  }
}

TEST(clear_things_vanish_in_a_white_sky)
{
  for (int kind = 0; kind < 4; kind++) {
    Scene *s = new_scene(1);
    int32_t m = -1;
    if (kind == 0) m = scene_add_material(s, MATERIAL_GLASS, "glass");
    if (kind == 1) m = add_lambert(s, 1, 1, 1);
    if (kind == 2) m = scene_add_material(s, MATERIAL_MIRROR, "mirror");
    if (kind == 2) set3(s->materials.items[m].mirror.color, 1, 1, 1);
    if (kind == 3) {
      m = add_pbr(s, 1, 0.5f);
      s->materials.items[m].pbr.metallic = 1;
    }
    add_sphere(s, m, 0, 0, 0, 1);
    s->render.max_depth = 255;
    const Picture p = picture_of(s, pinhole(0, 0, 4, 0, 0, 0, 30), 24, 64);
    CHECK_MSG(fabsf(p.mean[1] - 1) < (kind == 3 ? 0.02f : 0.004f), "kind %d: %.5f", kind, (double)p.mean[1]);
    CHECK_MSG(p.least > 0.8f && p.most < 1.25f, "kind %d: %.4f to %.4f", kind, (double)p.least,
              (double)p.most);
  }
}

// --- direct light -------------------------------------------------------------------------------

// The radiance of a white floor at the origin, y up, seen from a little above through a narrow eye.
static float floor_radiance(Scene *s, uint32_t spp, float *blue)
{
  add_quad(s, add_lambert(s, 1, 1, 1), 0, 0, 0, -90, 0, 50);
  s->render.max_depth = 1;
  const Picture p = picture_of(s, parallel(0.3f, 0.4f, 0, 0, 0, 0, 1e-4f), 8, spp);
  if (blue) *blue = p.mean[2];
  return p.mean[0];
}

TEST(a_point_light_falls_off_with_the_square)
{
  Scene *s = new_scene(0);
  Light *l = add_light(s, LIGHT_POINT);
  set3(l->point.position, 3, 4, 0);
  set3(l->point.intensity, 50, 20, 100);
  float blue;
  CHECK_NEAR(floor_radiance(s, 1, &blue), 50 / PI * 0.8 / 25, 1e-4);
  CHECK_NEAR(blue, 100 / PI * 0.8 / 25, 2e-4);
}

TEST(a_spot_light_has_a_cone)
{
  for (int inside = 0; inside < 2; inside++) {
    Scene *s = new_scene(0);
    Light *l = add_light(s, LIGHT_SPOT);
    set3(l->spot.position, 0, 2, 0);
    set3(l->spot.target, inside ? 0.1f : 2, 0, 0);
    set3(l->spot.intensity, 8, 8, 8);
    l->spot.angle = 30;
    l->spot.inner_angle = 20;
    CHECK_NEAR(floor_radiance(s, 1, NULL), inside ? 2 / PI : 0, 1e-4);
  }
}

TEST(a_sun_of_any_size_gives_its_irradiance)
{
  const float angles[3] = {0, 0.53f, 20};
  for (int k = 0; k < 3; k++) {
    Scene *s = new_scene(0);
    Light *l = add_light(s, LIGHT_SUN);
    set3(l->sun.direction, 1, 1, 0);
    set3(l->sun.irradiance, 3, 3, 3);
    l->sun.angle = angles[k];
    CHECK_NEAR(floor_radiance(s, 256, NULL), 3 / PI * sqrt(0.5), k == 0 ? 1e-5 : 2e-3);
  }
}

TEST(a_sphere_light_gives_sine_squared)
{
  Scene *s = new_scene(0);
  Light *l = add_light(s, LIGHT_SPHERE);
  set3(l->sphere.position, 0, 2, 0);
  l->sphere.radius = 1;
  set3(l->sphere.radiance, 5, 5, 5);
  CHECK_NEAR(floor_radiance(s, 1024, NULL), 5 * 0.25, 5 * 0.25 * 0.003); // irradiance pi L sin^2
}

TEST(flat_lights_give_their_form_factors)
{
  Scene *s = new_scene(0);
  Light *l = add_light(s, LIGHT_DISK);
  set3(l->disk.position, 0, 2, 0);
  set3(l->disk.target, 0, 0, 0);
  l->disk.radius = 1.5f;
  set3(l->disk.radiance, 5, 5, 5);
  const double disk = 1.5 * 1.5 / (1.5 * 1.5 + 4);
  CHECK_NEAR(floor_radiance(s, 1024, NULL), 5 * disk, 5 * disk * 0.004);

  s = new_scene(0);
  l = add_light(s, LIGHT_RECT);
  set3(l->rect.position, 0, 2, 0);
  set3(l->rect.target, 0, 0, 0);
  l->rect.size[0] = 3;
  l->rect.size[1] = 2;
  set3(l->rect.radiance, 5, 5, 5);
  // Four quarters, each a rectangle with a corner above the point (Howell's catalog, B-4).
  const double a = 0.75, b = 0.5, p = sqrt(1 + a * a), q = sqrt(1 + b * b);
  const double rect = 4 / (2 * (double)PI) * (a / p * atan(b / p) + b / q * atan(a / q));
  CHECK_NEAR(floor_radiance(s, 1024, NULL), 5 * rect, 5 * rect * 0.004);
}

TEST(skies_light_by_their_radiance)
{
  CHECK_NEAR(floor_radiance(new_scene(0.7f), 64, NULL), 0.7, 1e-4);
  Scene *s = new_scene(0);
  s->sky.kind = SKY_GRADIENT;
  set3(s->sky.gradient.zenith, 2, 2, 2);
  set3(s->sky.gradient.horizon, 2, 2, 2);
  set3(s->sky.gradient.ground, 0, 0, 0);
  s->sky.gradient.gain = 1;
  CHECK_NEAR(floor_radiance(s, 1024, NULL), 2, 0.01);
}

// P8: what a white receiver gets from a light of radiance 1, on the mean, is the form factor from it to the light. The
// eye stands between them and sees the receiver, which fills `share` of its square.
static void check_form_factor(const char *name, Scene *s, double share, double truth)
{
  s->render.max_depth = 1;
  const uint32_t spp = (uint32_t)(256 * test_intensity());
  const Picture p = picture_of(s, parallel(0, 0, 0.4f, 0, 0, 0, 1), 32, spp);
  const double got = (double)p.mean[1] / share, error = p.error / share;
  printf("  %-22s %.6f +- %.6f, closed form %.6f\n", name, got, error, truth);
  CHECK_MSG(fabs(got - truth) < 3 * error + 1e-6, "%s: %g against %g", name, got, truth);
  if (test_intensity() >= 100) CHECK_NEAR(got / truth, 1, 0.002);
}

TEST(form_factors_of_squares)
{
  // Unit squares: opposite at distance one (Howell C-11) and with a common edge (C-14).
  for (int is_perpendicular = 0; is_perpendicular < 2; is_perpendicular++) {
    Scene *s = new_scene(0);
    add_quad(s, add_lambert(s, 1, 1, 1), 0, 0, 0, 0, 0, 1); // faces +z
    Light *l = add_light(s, LIGHT_RECT);
    l->rect.size[0] = l->rect.size[1] = 1;
    set3(l->rect.radiance, 1, 1, 1);
    set3(l->rect.position, is_perpendicular ? -0.5f : 0, 0, is_perpendicular ? 0.5f : 1);
    set3(l->rect.target, is_perpendicular ? 1 : 0, 0, is_perpendicular ? 0.5f : 0);
    if (is_perpendicular)
      check_form_factor("perpendicular squares", s, 1, 0.2000438);
    else
      check_form_factor("parallel squares", s, 1, 0.1998249);
  }
}

TEST(form_factors_of_disks_and_spheres)
{
  for (int is_sphere = 0; is_sphere < 2; is_sphere++) {
    Scene *s = new_scene(0);
    Object *o = add_object(s, SHAPE_DISK, add_lambert(s, 1, 1, 1), 0, 0, 0); // faces +z
    o->shape.disk.radius = 0.5f;
    Light *l = add_light(s, is_sphere ? LIGHT_SPHERE : LIGHT_DISK);
    if (is_sphere) {
      set3(l->sphere.position, 0, 0, 1.2f);
      l->sphere.radius = 0.7f;
      set3(l->sphere.radiance, 1, 1, 1);
      // From a sphere to a disk on its axis (Howell C-99), turned about by the areas.
      const double from_sphere = 0.5 * (1 - 1 / sqrt(1 + 0.25 / 1.44));
      check_form_factor("sphere over a disk", s, (double)PI / 4, from_sphere * 4 * 0.49 / 0.25);
      continue;
    }
    set3(l->disk.position, 0, 0, 1);
    set3(l->disk.target, 0, 0, 0);
    l->disk.radius = 0.7f;
    set3(l->disk.radiance, 1, 1, 1);
    // Coaxial disks (Howell C-41).
    const double ratio = 1.4, x = 1 + (1 + 0.49) / 0.25;
    check_form_factor("coaxial disks", s, (double)PI / 4, 0.5 * (x - sqrt(x * x - 4 * ratio * ratio)));
  }
}

TEST(aimed_at_and_stumbled_upon_agree)
{
  // A bright ball over a glossy floor, once as a light (both strategies, weighted) and once found by bounces alone.
  for (int c = 0; c < 4; c++) {
    Picture p[2];
    for (int is_light = 0; is_light < 2; is_light++) {
      Scene *s = new_scene(0);
      const int32_t m = add_pbr(s, 0.6f, c == 0 ? 1 : c == 1 ? 0.3f : 0.15f);
      if (c >= 2) s->materials.items[m].pbr.metallic = 1;
      add_quad(s, m, 0, 0, 0, -90, 0, 6);
      if (c == 3)
        add_quad(s, add_glow(s, 3, is_light), -1.2f, 1, 0, 0, 90, 1.5f);
      else
        add_sphere(s, add_glow(s, 8, is_light), 0, 1.2f, -0.5f, 0.6f);
      s->render.max_depth = 3;
      p[is_light] = picture_of(s, pinhole(0, 1.5f, 4, 0, 0.3f, 0, 40), 24, 128);
    }
    const double sigma = sqrt(p[0].error * p[0].error + p[1].error * p[1].error);
    CHECK_MSG(fabs((double)p[0].mean[1] - (double)p[1].mean[1]) < 3 * sigma + 1e-4,
              "case %d: %.5f and %.5f +- %.5f", c, (double)p[0].mean[1], (double)p[1].mean[1], sigma);
    // Aiming pays except where the BSDF alone is right already; there it must not cost.
    CHECK_MSG(p[1].error < (c < 2 ? 0.8 : 1.2) * p[0].error, "case %d: %.5f and %.5f", c, p[1].error,
              p[0].error);
  }
}

// What a lamp with a pattern shines is the same by aiming and by luck, also when the pattern lies in space.
TEST(patterns_shine_as_they_look)
{
  for (int space = 0; space < 3; space++) {
    Picture p[2];
    for (int is_light = 0; is_light < 2; is_light++) {
      Scene *s = new_scene(0);
      const int32_t t = scene_add_texture(s, TEXTURE_NOISE, "noise"), glow = add_glow(s, 4, is_light);
      s->textures.items[t].noise = (TextureNoise){.space = space, .size = 0.8f, .octaves = 2, .lacunarity = 2,
                                                  .persistence = 0.5f, .contrast = 4, .color_b = {1, 1, 1}};
      s->materials.items[glow].emission.color_texture = t;
      add_quad(s, add_lambert(s, 1, 1, 1), 0, 0, 0, -90, 0, 4);
      add_quad(s, glow, 0.35f, 0.4f, 0.2f, 90, 0, 1);
      s->render.max_depth = 1;
      p[is_light] = picture_of(s, parallel(0.2f, 0.2f, 1, 0.3f, 0, 0, 0.4f), 16, 512);
    }
    const double sigma = sqrt(p[0].error * p[0].error + p[1].error * p[1].error);
    CHECK_MSG(fabs((double)p[0].mean[1] - (double)p[1].mean[1]) < 4 * sigma + 1e-4, "space %d: %.5f and %.5f +- %.5f", space,
              (double)p[0].mean[1], (double)p[1].mean[1], sigma);
    CHECK(p[0].mean[1] > 0.1f);
  }
}

// --- through and past things --------------------------------------------------------------------

TEST(a_slab_absorbs_exponentially)
{
  const float tilt[2] = {0, 1};
  for (int k = 0; k < 2; k++) {
    Scene *s = new_scene(1);
    const int32_t m = scene_add_material(s, MATERIAL_GLASS, "glass");
    s->materials.items[m].glass.ior = 1;
    set3(s->materials.items[m].glass.attenuation_color, 0.5f, 0.25f, 1);
    s->materials.items[m].glass.attenuation_distance = 1;
    add_box(s, m, 0, 0, 0, 20, 20, 2);
    const Picture p = picture_of(s, parallel(tilt[k] * 5, 0, 5, 0, 0, 0, 0.01f), 4, 4);
    const double length = 2 * (k ? sqrt(2) : 1);
    CHECK_NEAR(p.mean[0], pow(0.5, length), 1e-5);
    CHECK_NEAR(p.mean[1], pow(0.25, length), 1e-5);
    CHECK_NEAR(p.mean[2], 1, 1e-5);
  }
}

TEST(a_slab_of_glass_reflects_and_absorbs)
{
  // Light to and fro between the two faces, T = (1 - R)^2 t / (1 - R^2 t^2), against a black sky behind the eye.
  Scene *s = new_scene(0);
  const int32_t m = scene_add_material(s, MATERIAL_GLASS, "glass");
  set3(s->materials.items[m].glass.attenuation_color, 0.5f, 0.5f, 0.5f);
  s->materials.items[m].glass.attenuation_distance = 1;
  add_box(s, m, 0, 0, 0, 40, 40, 1);
  add_quad(s, add_glow(s, 1, false), 0, 0, -10, 0, 0, 100);
  s->render.max_depth = 64;
  const Picture p = picture_of(s, parallel(0, 0, 5, 0, 0, 0, 0.01f), 16, 256);
  const double r = 0.04, t = 0.5;
  CHECK_NEAR(p.mean[1], (1 - r) * (1 - r) * t / (1 - r * r * t * t), 0.004);
}

TEST(a_mirror_shows_what_is_there)
{
  Scene *s = new_scene(0);
  const int32_t m = scene_add_material(s, MATERIAL_MIRROR, "mirror");
  set3(s->materials.items[m].mirror.color, 0.9f, 0.5f, 0.1f);
  add_quad(s, m, 0, 0, 0, 0, 0, 4);
  add_quad(s, add_glow(s, 2, true), 0, 0, 6, 180, 0, 30); // behind the eye, facing the mirror
  const Picture p = picture_of(s, parallel(0, 0, 3, 0, 0, 0, 1), 8, 4);
  CHECK_NEAR(p.mean[0], 1.8, 1e-5);
  CHECK_NEAR(p.mean[1], 1, 1e-5);
  CHECK_NEAR(p.mean[2], 0.2, 1e-5);
}

static float through_curtain(AlphaMode mode, float opacity, bool double_sided, bool from_behind)
{
  Scene *s = new_scene(0);
  const int32_t m = add_pbr(s, 0, 1);
  Pbr *pbr = &s->materials.items[m].pbr;
  pbr->alpha_mode = (int32_t)mode;
  pbr->opacity = opacity;
  pbr->double_sided = double_sided;
  pbr->specular = 0;
  add_quad(s, m, 0, 0, 0, from_behind ? 180 : 0, 0, 4);
  add_quad(s, add_glow(s, 1, false), 0, 0, -3, 0, 0, 10);
  return picture_of(s, parallel(0, 0, 3, 0, 0, 0, 1), 32, 64).mean[1];
}

TEST(opacity_lets_light_through_in_part)
{
  CHECK_NEAR(through_curtain(ALPHA_OPAQUE, 0.3f, true, false), 0, 1e-6);
  CHECK_NEAR(through_curtain(ALPHA_BLEND, 0.3f, true, false), 0.7, 0.01);
  CHECK_NEAR(through_curtain(ALPHA_BLEND, 0.8f, true, true), 0.2, 0.01);
  CHECK_NEAR(through_curtain(ALPHA_MASK, 0.6f, true, false), 0, 1e-6);
  CHECK_NEAR(through_curtain(ALPHA_MASK, 0.4f, true, false), 1, 1e-6);
  CHECK_NEAR(through_curtain(ALPHA_OPAQUE, 1, false, false), 0, 1e-6);
  CHECK_NEAR(through_curtain(ALPHA_OPAQUE, 1, false, true), 1, 1e-6);
}

// A way in and a way out are two surfaces, each there in part.
TEST(opacity_counts_at_each_crossing)
{
  for (int c = 0; c < 4; c++) {
    Scene *s = new_scene(1);
    const int32_t m = add_pbr(s, 0, 1);
    Pbr *pbr = &s->materials.items[m].pbr;
    pbr->alpha_mode = ALPHA_BLEND;
    pbr->opacity = 0.3f;
    pbr->specular = 0;
    if (c == 0) add_sphere(s, m, 0, 0, 0, 1);
    if (c == 1) add_box(s, m, 0, 0, 0, 2, 2, 2);
    if (c == 2) {
      Object *o = add_object(s, SHAPE_CYLINDER, m, 0, 0, 0);
      o->shape.cylinder.radius = 1;
      o->shape.cylinder.height = 2;
    }
    if (c == 3) {
      Object *o = add_object(s, SHAPE_TORUS, m, 0, 0, 0); // met four times
      o->shape.torus.radius = 1;
      o->shape.torus.tube_radius = 0.4f;
    }
    CHECK_NEAR(picture_of(s, parallel(0, 0, 3, 0, 0, 0, 0.2f), 32, 64).mean[1], pow(0.7, c == 3 ? 4 : 2), 0.01);
  }
}

TEST(shadows_are_as_thin_as_what_casts_them)
{
  const struct {
    float opacity;
    bool casts_shadow;
    double expected;
  } cases[3] = {{0.3f, true, 0.7}, {1, true, 0}, {1, false, 1}};
  for (int c = 0; c < 3; c++) {
    Scene *s = new_scene(0);
    const int32_t m = add_pbr(s, 0, 1);
    s->materials.items[m].pbr.alpha_mode = ALPHA_BLEND;
    s->materials.items[m].pbr.opacity = cases[c].opacity;
    add_quad(s, m, 0, 1, 0, 90, 0, 0.5f)->common.casts_shadow = cases[c].casts_shadow;
    Light *l = add_light(s, LIGHT_SUN);
    set3(l->sun.irradiance, PI, PI, PI);
    l->sun.angle = 0;
    CHECK_NEAR(floor_radiance(s, 256, NULL), cases[c].expected, 0.02);
  }
}

TEST(what_the_camera_may_not_see_still_lights)
{
  Scene *s = new_scene(0);
  Light *l = add_light(s, LIGHT_RECT);
  set3(l->rect.position, 0, 0, 1);
  set3(l->rect.target, 0, 0, 0);
  set3(l->rect.radiance, 1, 1, 1);
  l->rect.visible_to_camera = false;
  add_quad(s, add_lambert(s, 1, 1, 1), 0, 0, 0, 0, 0, 1);
  s->render.max_depth = 1;
  const Picture p = picture_of(s, parallel(0, 0, 3, 0, 0, 0, 1), 16, 64); // looks right through the light
  CHECK_NEAR(p.mean[1], 0.1998, 0.003);
}

TEST(depth_counts_bounces)
{
  // In a closed white box with e = 1, n bounces bring 1 + a + ... + a^n.
  for (int32_t depth = 0; depth < 4; depth++) {
    Scene *s = new_scene(0);
    const int32_t m = add_pbr(s, 0.5f, 1);
    s->materials.items[m].pbr.specular = 0;
    set3(s->materials.items[m].pbr.emissive, 1, 1, 1);
    add_box(s, m, 0, 0, 0, 2, 2, 2);
    s->render.max_depth = depth;
    const Picture p = picture_of(s, pinhole(0, 0, 0.5f, 0, 0, -1, 60), 16, 64);
    CHECK_NEAR(p.mean[1], 2 - pow(0.5, depth), 0.01);
  }
}

TEST(the_clamp_holds_only_indirect_light)
{
  for (int is_clamped = 0; is_clamped < 2; is_clamped++) {
    Scene *s = new_scene(0);
    Light *l = add_light(s, LIGHT_POINT);
    set3(l->point.position, 0, 1, 0);
    set3(l->point.intensity, 100, 100, 100);
    s->render.clamp = is_clamped ? 0.1f : 0;
    CHECK_NEAR(floor_radiance(s, 1, NULL), 100 / (double)PI, 0.01);
  }
}

// --- planes -------------------------------------------------------------------------------------

TEST(planes_show_the_first_thing_seen)
{
  Scene *s = new_scene(1);
  add_quad(s, add_lambert(s, 0.2f, 0.4f, 0.6f), 0, 0, -2, 0, 0, 1);
  add_quad(s, add_glow(s, 1, true), 5, 5, 5, 0, 0, 1);
  World *w = world_of(s);
  Film *f = film_create(33, 33, ALL_PLANES, NULL);
  RenderJob job = job_of(s, w, pinhole(0, 0, 0, 0, 0, -1, 90), f, 8);
  job.settings.transparent = true;
  CHECK(render_run(&job, NULL, hot_table(ISA_REF), NULL, NULL, NULL));
  float rgba[33 * 33 * 4], albedo[33 * 33 * 3], normal[33 * 33 * 3], depth[33 * 33], position[33 * 33 * 3];
  float object[33 * 33], material[33 * 33];
  CHECK(film_resolve(f, FILM_BEAUTY, rgba) && film_resolve(f, FILM_ALBEDO, albedo));
  CHECK(film_resolve(f, FILM_NORMAL, normal) && film_resolve(f, FILM_DEPTH, depth));
  CHECK(film_resolve(f, FILM_POSITION, position) && film_resolve(f, FILM_OBJECT_ID, object));
  CHECK(film_resolve(f, FILM_MATERIAL_ID, material));
  const int middle = 16 * 33 + 16, off = 16 * 33 + 18, corner = 0;
  CHECK(rgba[4 * middle + 3] == 1 && rgba[4 * corner + 3] == 0 && rgba[4 * corner] == 0);
  CHECK_NEAR(albedo[3 * middle + 2], 0.6, 1e-5);
  CHECK_NEAR(normal[3 * middle + 2], 1, 1e-6);
  CHECK_NEAR(depth[middle], 2, 1e-6);
  CHECK_NEAR(depth[off], 2, 1e-6); // along the axis, not along the ray
  CHECK_NEAR(position[3 * off], 2 * 2 / 16.5, 0.02);
  CHECK_NEAR(position[3 * off + 2], -2, 1e-6);
  CHECK(object[middle] == 1 && object[corner] == 0 && material[middle] == 1 && material[corner] == 0);
  CHECK(depth[corner] == 0);
  film_destroy(f);
  world_release(w);
  scene_destroy(s);
}

TEST(batches_of_rays_see_bare_geometry)
{
  Scene *s = new_scene(0);
  const int32_t veil = add_pbr(s, 0.8f, 0.5f);
  s->materials.items[veil].pbr.alpha_mode = ALPHA_BLEND;
  s->materials.items[veil].pbr.opacity = 0; // not there for light, but there
  add_sphere(s, veil, 0, 0, -5, 1);
  World *w = world_of(s);
  const PackedRay rays[4] = {{{0, 0, 0}, 0, {0, 0, -1}, INFINITY},
                             {{0, 0, 0}, 0, {0, 0, -2}, 1.9f},
                             {{0, 0, 0}, 4.5f, {0, 0, -1}, INFINITY},
                             {{0, 0, 0}, 0, {0, 1, 0}, INFINITY}};
  const float distance[4] = {4, 0, 6, 0};
  for (int level = ISA_REF; level <= (int)cpu_best_isa(); level++) {
    Hit hits[4];
    uint8_t blocked[4];
    const HotTable *hot = hot_table((IsaLevel)level);
    CHECK(!strcmp(hot->name, isa_names[level]));
    hot->closest_n(w->accel, rays, hits, 4);
    hot->any_n(w->accel, rays, blocked, 4);
    for (int i = 0; i < 4; i++) {
      CHECK(blocked[i] == (distance[i] > 0) && (hits[i].instance != NO_HIT) == (distance[i] > 0));
      if (distance[i] > 0) CHECK_NEAR(hits[i].t, distance[i], 1e-5);
    }
  }
  world_release(w);
  scene_destroy(s);
}

TEST(an_empty_world_is_its_sky)
{
  const Picture p = picture_of(new_scene(0.25f), pinhole(0, 0, 0, 0, 0, -1, 60), 9, 2);
  CHECK(p.least == 0.25f && p.most == 0.25f && p.mean[3] == 1);
}

TEST(bad_jobs_are_refused)
{
  Scene *s = new_scene(1);
  World *w = world_of(s);
  Film *f = film_create(4, 4, 0, NULL);
  RenderJob job = job_of(s, w, pinhole(0, 0, 0, 0, 0, -1, 60), f, 0);
  Err none = {0}, noise = {0};
  CHECK(!render_run(&job, NULL, hot_table(ISA_REF), NULL, NULL, &none) && none.kind == ERR_BAD_ARGUMENT);
  job.end_sample = 4;
  job.noise_target = 0.1;
  CHECK(!render_run(&job, NULL, hot_table(ISA_REF), NULL, NULL, &noise));
  CHECK_TEXT(noise.text, "variance");
  film_destroy(f);
  world_release(w);
  scene_destroy(s);
}

TEST_MAIN
