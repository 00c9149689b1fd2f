// The integrator `classic` against the path tracer, where they must agree, and in furnaces of every kind of light.

#include "tests/render_sample.h"

static Picture picture(const Scene *s, Eye eye, Integrator integrator, int depth, uint32_t spp)
{
  Scene *scene = (Scene *)s;
  World *w = world_of(scene);
  Film *f = film_create(8, 8, ALL_PLANES, NULL);
  RenderJob job = job_of(s, w, eye, f, spp);
  job.settings.integrator = integrator;
  job.settings.max_depth = depth;
  job.settings.roulette_depth = 100;
  RenderStats stats;
  CHECK(render_run(&job, NULL, hot_table(cpu_best_isa()), NULL, &stats, NULL) && stats.bad_samples == 0);
  const Picture p = summarize(f);
  film_destroy(f);
  world_release(w);
  return p;
}

static void check_same(const char *name, const Picture *a, const Picture *b)
{
  const double sigma = sqrt(a->error * a->error + b->error * b->error) + 1e-6;
  printf("  %-28s %.5f +- %.5f against %.5f +- %.5f\n", name, (double)a->mean[1], a->error, (double)b->mean[1], b->error);
  CHECK_MSG(fabs((double)(a->mean[1] - b->mean[1])) < 4 * sigma, "%s: %g against %g", name, (double)a->mean[1],
            (double)b->mean[1]);
}

static Scene *corner(float sky)
{
  Scene *s = new_scene(sky);
  const int32_t grey = add_lambert(s, 0.7f, 0.7f, 0.7f), shiny = add_pbr(s, 0.6f, 0.4f);
  add_quad(s, grey, 0, -1, 0, -90, 0, 6);
  add_quad(s, grey, 0, 2, -2, 0, 0, 6);
  add_box(s, shiny, 0.4f, -0.5f, 0, 1, 1, 1);
  Light *l = add_light(s, LIGHT_RECT);
  set3(l->rect.position, -1, 2, 1);
  set3(l->rect.target, 0, 0, 0);
  return s;
}

// With matt surfaces alone, one surface and its scattered rays are paths of two bounces.
TEST(one_matt_surface_is_two_bounces)
{
  const uint32_t spp = (uint32_t)(256 * test_intensity());
  const Eye eye = pinhole(0, 0, 4, 0, 0, 0, 50);
  for (int sky = 0; sky < 3; sky++) {
    Scene *s = corner(sky == 1 ? 0.5f : 0);
    s->materials.items[1].kind = MATERIAL_LAMBERT;
    s->materials.items[1].lambert = s->materials.items[0].lambert;
    if (sky == 2) {
      s->sky.kind = SKY_GRADIENT;
      set3(s->sky.gradient.zenith, 0, 0.1f, 0);
      set3(s->sky.gradient.horizon, 0, 3, 0);
      s->sky.gradient.gain = 1;
    }
    const int counts[] = {1, 8, 100};
    const Picture path = picture(s, eye, INTEGRATOR_PATH, 2, 4 * spp);
    for (int i = 0; i < 3; i++) {
      s->render.scatter = counts[i];
      char name[40];
      snprintf(name, sizeof name, "sky %d, %d scattered rays", sky, counts[i]);
      const Picture classic = picture(s, eye, INTEGRATOR_CLASSIC, 1, i == 2 ? spp / 16 + 1 : spp);
      check_same(name, &classic, &path);
    }
    scene_destroy(s);
  }
}

// Without scattered rays what is left of a matt surface is direct light.
TEST(no_scattered_rays_is_direct_light)
{
  const Eye eye = pinhole(0, 0, 4, 0, 0, 0, 50);
  Scene *s = corner(0);
  s->render.scatter = 0;
  s->materials.items[1].kind = MATERIAL_LAMBERT;
  s->materials.items[1].lambert = s->materials.items[0].lambert;
  const Picture classic = picture(s, eye, INTEGRATOR_CLASSIC, 1, 256), path = picture(s, eye, INTEGRATOR_PATH, 1, 256);
  check_same("direct light", &classic, &path);
  scene_destroy(s);
}

TEST(mirrors_chain_up_to_the_depth)
{
  Scene *s = new_scene(0.3f);
  const int32_t mirror = scene_add_material(s, MATERIAL_MIRROR, "mirror");
  set3(s->materials.items[mirror].mirror.color, 0.5f, 0.5f, 0.5f);
  add_quad(s, mirror, 0, 0, -1, 0, 0, 50);
  add_quad(s, mirror, 0, 0, 1, 0, 180, 50);
  const Eye eye = pinhole(0, 0, 0, 0, 0, -1, 4);
  // Between the mirrors all light is gone; each closed chain is black.
  for (int depth = 0; depth < 6; depth++) {
    const Picture a = picture(s, eye, INTEGRATOR_CLASSIC, depth, 4);
    CHECK(a.most == 0);
  }
  s->materials.items[add_glow(s, 8, true)].emission.strength = 8;
  s->objects.items[1].common.material = 1; // the second wall shines: one mirror away
  const float expected[] = {0, 4, 4};
  for (int depth = 0; depth < 3; depth++) {
    const Picture a = picture(s, eye, INTEGRATOR_CLASSIC, depth, 16), b = picture(s, eye, INTEGRATOR_PATH, depth, 16);
    CHECK_NEAR(a.mean[1], expected[depth], 1e-4);
    CHECK_NEAR(a.mean[1], b.mean[1], 1e-5);
  }
  scene_destroy(s);
}

// A white body that sees radiance 1 all around is as bright as what it sees, whatever the light is made of.
static void check_furnace(const char *name, const Scene *s, double tolerance)
{
  const Eye eye = parallel(0, 0, 0.9f, 0, 0, 0, 0.1f);
  const Picture path = picture(s, eye, INTEGRATOR_PATH, 1, 256), classic = picture(s, eye, INTEGRATOR_CLASSIC, 1, 64);
  printf("  %-12s path %.4f +- %.4f, classic %.4f +- %.4f\n", name, (double)path.mean[1], path.error,
         (double)classic.mean[1], classic.error);
  CHECK_NEAR(path.mean[1], 1, 3 * path.error + tolerance);
  CHECK_NEAR(classic.mean[1], 1, 3 * classic.error + tolerance);
}

static Scene *white_ball(void)
{
  Scene *s = new_scene(0);
  add_sphere(s, add_lambert(s, 1, 1, 1), 0, 0, 0, 0.5f);
  return s;
}

TEST(furnaces_of_every_kind_of_light)
{
  Scene *s = white_ball();
  for (int side = 0; side < 6; side++) { // a cell of rectangles
    Light *l = add_light(s, LIGHT_RECT);
    float p[3] = {0};
    p[side / 2] = side % 2 ? 1 : -1;
    set3(l->rect.position, p[0], p[1], p[2]);
    set3(l->rect.radiance, 1, 1, 1);
    l->rect.size[0] = l->rect.size[1] = 2;
  }
  check_furnace("rect", s, 1e-3);
  scene_destroy(s);

  s = white_ball(); // two disks so close that they are nearly the whole sphere, from both sides of a thin slab
  for (int side = 0; side < 2; side++) {
    Light *l = add_light(s, LIGHT_DISK);
    set3(l->disk.position, 0, 0, side ? 1 : -1);
    set3(l->disk.radiance, 1, 1, 1);
    l->disk.radius = 300;
  }
  check_furnace("disk", s, 5e-3);
  scene_destroy(s);

  s = white_ball(); // a box of shining triangles
  const int32_t glow = add_glow(s, 1, true);
  add_box(s, glow, 0, 0, 0, 2, 2, 2);
  s->materials.items[glow].emission.double_sided = true;
  check_furnace("mesh", s, 1e-3);
  scene_destroy(s);

  s = white_ball();
  s->sky.constant = (SkyConstant){{1, 1, 1}, 1};
  check_furnace("constant", s, 1e-3);
  s->sky.kind = SKY_GRADIENT;
  s->sky.gradient = (SkyGradient){{1, 1, 1}, {1, 1, 1}, {1, 1, 1}, 1};
  check_furnace("gradient", s, 1e-3);
  scene_destroy(s);

  s = white_ball(); // two suns of half a sphere each
  for (int side = 0; side < 2; side++) {
    Light *l = add_light(s, LIGHT_SUN);
    set3(l->sun.direction, 0, side ? 1 : -1, 0);
    set3(l->sun.irradiance, (float)M_PI, (float)M_PI, (float)M_PI); // pi L sin^2 90
    l->sun.angle = 180;
  }
  check_furnace("sun", s, 1e-3);
  scene_destroy(s);
}

TEST(every_level_and_tile_gives_the_same_bits)
{
  Scene *s = rich_scene();
  World *w = world_of(s);
  uint64_t first = 0;
  for (int level = 0; level <= (int)cpu_best_isa(); level++)
    for (uint32_t tile = 8; tile <= 24; tile += 16) {
      Film *f = film_create(29, 23, ALL_PLANES, NULL);
      RenderJob job = job_of(s, w, pinhole(0, 0, 4, 0, 0, 0, 50), f, 2);
      job.settings.integrator = INTEGRATOR_CLASSIC;
      job.settings.max_depth = 3;
      job.settings.scatter = 5;
      job.tile_size = tile;
      CHECK(render_run(&job, NULL, hot_table((IsaLevel)level), NULL, NULL, NULL));
      const uint64_t h = film_hash(f);
      if (!first) first = h;
      CHECK_MSG(h == first, "level %d, tiles of %u", level, tile);
      film_destroy(f);
    }
  world_release(w);
  scene_destroy(s);
}

TEST_MAIN
