// The clear sky against what is known of it in closed form, its sampling against its density, and crosses against
// panoramas.

#include "tests/render_sample.h"

#include "shade/atmosphere.h"
#include "shade/light_sample.h"
#include "tests/chi_square.h"

#include <time.h>
#include <unistd.h>

// --- the air --------------------------------------------------------------------------------------------
typedef struct Sky1 {
  SkyMap map;
  AtmosphereLight light;
} Sky1;

static float sky_pixels[ATMOSPHERE_WIDE * ATMOSPHERE_HIGH * 3];

static Atmosphere clear(double elevation)
{
  return (Atmosphere){.elevation = (float)(elevation * M_PI / 180),
                      .air = 1,
                      .dust = 1,
                      .ozone = 1,
                      .albedo = v3_all(0.3f),
                      .sun_radius = 0.0046f};
}

static Sky1 bake(Atmosphere a)
{
  Sky1 s = {.map = {.kind = SKY_MAP_IMAGE, .gain = 1}};
  CHECK(atmosphere_bake(&a, sky_pixels, &s.light, NULL, NULL, NULL));
  s.map.image = (Image){ATMOSPHERE_WIDE, ATMOSPHERE_HIGH, 3, PIXEL_F32, sky_pixels};
  s.map.horizon_angle = s.light.horizon;
  return s;
}

// By the midpoint rule in equal steps of the cosine and of the turn.
static double diffuse(const Sky1 *s)
{
  double sum = 0;
  for (int y = 0; y < 200; y++)
    for (int x = 0; x < 100; x++) {
      const float c = ((float)y + 0.5f) / 200, flat = sqrtf(1 - c * c), phi = 2 * PI * ((float)x + 0.5f) / 100;
      sum += (double)(luminance(sky_radiance(&s->map, v3(flat * sinf(phi), c, flat * cosf(phi)))) * c);
    }
  return sum * 2 * M_PI / (200 * 100);
}

// How much of a gas whose density falls by e every `height` km lies along a straight ray from the ground, in km at the
// ground's density: through shells, in steps that are fine near the ground.
static double column(double mu, double height, int steps)
{
  const double r = 6360, end = -r * mu + sqrt(r * r * (mu * mu - 1) + 6460.0 * 6460.0);
  double sum = 0;
  for (int i = 0; i < steps; i++) {
    const double t = (i + 0.5) / steps, at = end * t * t;
    sum += exp(-(sqrt(r * r + at * at + 2 * r * mu * at) - r) / height) * 2 * end * t / steps;
  }
  return sum;
}

TEST(sunlight_fades_as_the_air_says)
{
  Atmosphere a = clear(90);
  a.air = a.dust = a.ozone = 0;
  const Sky1 bare = bake(a);
  CHECK_NEAR(luminance(bare.light.sun), ATMOSPHERE_SUN, 1e-4);
  CHECK_NEAR(diffuse(&bare), 0, 1e-6);
  a.dust = 1;
  const double elevations[] = {90, 40, 10, 3};
  for (int i = 0; i < 4; i++) {
    a.elevation = (float)(elevations[i] * M_PI / 180);
    const double depth = 4.44e-3 * column(sin(elevations[i] * M_PI / 180), 1.2, 20000);
    const Sky1 dusty = bake(a);
    const double got = (double)(luminance(dusty.light.sun) / luminance(bare.light.sun));
    printf("  %2.0f deg: %.5f, by quadrature %.5f\n", elevations[i], got, exp(-depth));
    CHECK_NEAR(log(got) / -depth, 1, 8e-3); // half a percent is the table's, between the ground and 25 m up
    if (i == 0) CHECK_NEAR(depth, 4.44e-3 * 1.2, 1e-6); // the closed form at the zenith
  }
}

// Thin air sends each ray's share of the sun's light on once. Over flat ground half of it came down, as molecules
// scatter as much ahead as back; a round planet gets a little less, as the way to the horizon is not endless.
TEST(thin_air_scatters_once)
{
  double down = 0;
  for (int i = 0; i < 400; i++) {
    const double mu = (i + 0.5) / 400;
    down += 2 * M_PI * mu * 3 / (16 * M_PI) * (1 + mu * mu) * column(mu, 8, 1000) / column(1, 8, 1000) / 400;
  }
  CHECK(down > 0.47 && down < 0.5);
  Atmosphere a = clear(90);
  a.dust = a.ozone = 0;
  a.albedo = v3_all(0);
  const double parts[] = {0.02, 0.05};
  for (int i = 0; i < 2; i++) {
    a.air = (float)parts[i];
    const Sky1 s = bake(a);
    const double lost = (double)(ATMOSPHERE_SUN - luminance(s.light.sun)), got = diffuse(&s);
    printf("  air %.2f: %.5f comes down of %.5f scattered\n", parts[i], got, lost);
    CHECK_NEAR(got / lost / down, 1, 0.01 + parts[i] / 5);
  }
}

TEST(no_more_light_arrives_than_came)
{
  for (int elevation = 10; elevation <= 90; elevation += 40) {
    Atmosphere a = clear(elevation);
    a.albedo = v3_all(0);
    const Sky1 s = bake(a);
    const double came = (double)ATMOSPHERE_SUN * sin(elevation * M_PI / 180);
    const double sun = (double)luminance(s.light.sun) * sin(elevation * M_PI / 180), sky = diffuse(&s);
    printf("  %2d deg: sun %.3f + sky %.3f of %.3f\n", elevation, sun, sky, came);
    CHECK(sun + sky < came && sun + sky > 0.6 * came);
    a.albedo = v3_all(0.9f); // bright ground lights the sky from below
    const Sky1 snow = bake(a);
    CHECK(diffuse(&snow) > sky * 1.05);
  }
}

TEST(skies_look_as_skies_do)
{
  float before = INFINITY, zenith_before = INFINITY;
  for (int i = 0; i < 8; i++) { // as the sun sinks it dims and reddens, and the zenith dims
    const float elevations[] = {80, 50, 25, 12, 5, 1, -3, -7};
    const Sky1 s = bake(clear((double)elevations[i]));
    const float zenith = luminance(sky_radiance(&s.map, v3(0, 1, 0)));
    CHECK(luminance(s.light.sun) < before || (i >= 6 && v3_is_zero(s.light.sun)));
    CHECK(zenith < zenith_before && zenith > 0);
    before = luminance(s.light.sun);
    zenith_before = zenith;
  }
  const Sky1 noon = bake(clear(60));
  const Vec3 up = sky_radiance(&noon.map, v3(0, 1, 0)), low = sky_radiance(&noon.map, v3_normalize(v3(1, 0.05f, 0)));
  CHECK(up[2] > 2 * up[0] && luminance(low) > luminance(up)); // blue above, paler towards the horizon
  const Sky1 sunset = bake(clear(0.5));
  const Vec3 glow = sky_radiance(&sunset.map, v3_normalize(v3(0, 0.01f, -1)));
  const Vec3 top = sky_radiance(&sunset.map, v3(0, 1, 0));
  CHECK(glow[0] > 2 * glow[2] && top[2] > top[0]); // red at the horizon, and the zenith stays blue
  CHECK(sunset.light.sun[0] > 4 * sunset.light.sun[2]);
  Atmosphere high = clear(60);
  high.altitude = 20000;
  const Sky1 up_there = bake(high);
  CHECK(luminance(sky_radiance(&up_there.map, v3(0, 1, 0))) < luminance(up) / 4);
  CHECK(luminance(up_there.light.sun) > luminance(noon.light.sun) && up_there.light.horizon > noon.light.horizon);
}

// --- sampling -----------------------------------------------------------------------------------------
typedef struct Lit {
  LightSet set;
} Lit;

static bool draw(const void *user, uint32_t i, Vec3 *d)
{
  float u[3];
  LightSample s;
  chi_random(i, u);
  if (!light_sample(&((const Lit *)user)->set, NULL, 0, v3_all(0), v3_all(0), u[0], (Vec2){u[1], u[2]}, &s)) return false;
  *d = s.wl;
  return true;
}

static double density(const void *user, Vec3 d)
{
  return (double)sky_pdf(&((const Lit *)user)->set.sky, d);
}

TEST(the_clear_sky_follows_its_density)
{
  const double elevations[] = {40, 2};
  for (int i = 0; i < 2; i++) {
    Sky1 s = bake(clear(elevations[i]));
    s.map.rotation = 0.7f;
    Lit l;
    CHECK(light_set_build(&l.set, NULL, 0, NULL, 0, &s.map, NULL, NULL) && l.set.sky.is_sampled);
    const ChiCase c = {draw, density, &l, 48};
    const ChiResult r = chi_square(&c, 100000);
    CHECK_MSG(r.p > sidak_level(2), "%g deg: p = %g", elevations[i], r.p);
    CHECK_MSG(fabs(r.integral - r.accepted) < 5e-3, "integral %g, accepted %g", r.integral, r.accepted);
    double sum = 0; // aiming gives the irradiance that quadrature does
    for (uint32_t k = 1; k <= 50000; k++) {
      LightSample one;
      const Vec2 u = {unit_float(k * 3242174889u), unit_float(k * 2447445414u)};
      if (sky_sample(&l.set.sky, u, &one)) sum += (double)(luminance(one.radiance) * max_f(one.wl[1], 0) / one.pdf);
    }
    CHECK_NEAR(sum / 50000 / diffuse(&s), 1, 5e-3);
    light_set_finish(&l.set);
    for (uint32_t k = 0; k < 2000; k++) {
      float u[3];
      chi_random(k, u);
      const Vec2 uv = {u[0], 0.02f + 0.96f * u[1]}, back = sky_uv(&s.map, sky_direction(&s.map, uv));
      CHECK_NEAR(back.x, uv.x, 3e-5);
      CHECK(fabsf(back.y - uv.y) < 1e-5f || fabsf(uv.y - 0.5f) < 0.01f); // angles at the horizon are squared
    }
  }
}

TEST(baking_is_quick_and_can_be_cancelled)
{
  const clock_t start = clock();
  bake(clear(30));
  const double seconds = (double)(clock() - start) / CLOCKS_PER_SEC;
  printf("  %.0f ms of one processor\n", seconds * 1000);
  Cancel cancel;
  atomic_init(&cancel.requested, true);
  AtmosphereLight light;
  Err err = {0};
  const Atmosphere a = clear(30);
  CHECK(!atmosphere_bake(&a, sky_pixels, &light, NULL, &cancel, &err) && err.kind == ERR_CANCELLED);
  err = (Err){0};
  mem_fail_after(1);
  CHECK(!atmosphere_bake(&a, sky_pixels, &light, NULL, NULL, &err) && err.kind == ERR_NO_MEMORY);
  mem_fail_after(0);
}

// --- crosses ------------------------------------------------------------------------------------------
enum { SIDE = 16 };

// The colour of a direction, smooth over the sphere, so that every wrongly placed or turned side shows.
static Vec3 color_towards(Vec3 d)
{
  return v3(0.5f + 0.4f * d[0], 0.5f + 0.4f * d[1], 0.5f + 0.4f * d[2]);
}

// Directions by the table of the original's specification: u to the right, v up, both -1..1.
static Vec3 side_direction(int column, int row, float u, float v)
{
  if (row == 0) return v3(u, 1, v);
  if (row == 2) return v3(u, -1, -v);
  switch (column) {
  case 0: return v3(-1, v, -u);
  case 1: return v3(u, v, -1);
  case 2: return v3(1, v, u);
  default: return v3(-u, v, 1);
  }
}

static void write_cross(const char *path, bool stands)
{
  const int width = (stands ? 3 : 4) * SIDE, height = (stands ? 4 : 3) * SIDE;
  float *pixels = calloc((size_t)(width * height), 3 * sizeof *pixels);
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++) {
      int column = x / SIDE, row = y / SIDE;
      float u = ((float)(x % SIDE) + 0.5f) / SIDE * 2 - 1, v = 1 - ((float)(y % SIDE) + 0.5f) / SIDE * 2;
      if (stands && row == 3) { // the back, upside down
        if (column != 1) continue;
        column = 3, row = 1, u = -u, v = -v;
      }
      if (row != 1 && column != 1) continue;
      const Vec3 c = color_towards(v3_normalize(side_direction(column, row, u, v)));
      for (int k = 0; k < 3; k++) pixels[3 * ((height - 1 - y) * width + x) + k] = c[k]; // PFM begins at the bottom
    }
  FILE *f = fopen(path, "wb");
  CHECK(f != NULL);
  fprintf(f, "PF\n%d %d\n-1.0\n", width, height);
  fwrite(pixels, sizeof *pixels, (size_t)(3 * width * height), f);
  fclose(f);
  free(pixels);
}

TEST(crosses_unfold)
{
  char folder[] = "/tmp/rayfold-cross-XXXXXX", path[64];
  CHECK(mkdtemp(folder) != NULL);
  snprintf(path, sizeof path, "%s/cross.pfm", folder);
  for (int stands = 0; stands < 2; stands++) {
    write_cross(path, stands);
    Scene *s = new_scene(0);
    s->sky.kind = SKY_IMAGE;
    s->sky.image = (SkyImage){.file = path, .layout = LAYOUT_CROSS, .gain = 1};
    s->allow_outside = true;
    World *w = world_of(s);
    CHECK(w->lights.sky.is_sampled);
    double worst = 0;
    for (uint32_t i = 0; i < 5000; i++) {
      float u[3];
      chi_random(i, u);
      const Vec3 d = cone_direction(v3(0, 1, 0), 2, (Vec2){u[0], u[1]});
      const Vec3 off = sky_radiance(&w->lights.sky, d) - color_towards(d);
      worst = fmax(worst, (double)v3_max_lane(v3_abs(off)));
    }
    printf("  %s: off by at most %.4f\n", stands ? "standing" : "lying", worst);
    CHECK(worst < 0.02); // half a texel is 0.02 of the colour's range
    world_release(w);
    s->sky.image.layout = LAYOUT_PANORAMA;
    w = world_of(s);
    world_release(w);
    scene_destroy(s);
  }
  FILE *f = fopen(path, "wb");
  fprintf(f, "PF\n4 2\n-1.0\n");
  for (int i = 0; i < 96; i++) fputc(0, f);
  fclose(f);
  Scene *s = new_scene(0);
  s->sky.kind = SKY_IMAGE;
  s->sky.image = (SkyImage){.file = path, .layout = LAYOUT_CROSS, .gain = 1};
  s->allow_outside = true;
  Err err = {0};
  CHECK(!world_prepare(s, NULL, NULL, NULL, NULL, &err));
  CHECK_TEXT(err.text, "4 x 2");
  scene_destroy(s);
  unlink(path);
  rmdir(folder);
}

TEST(a_sun_sky_in_a_scene)
{
  Scene *s = new_scene(0);
  s->sky.kind = SKY_SUN;
  s->sky.sun = (SkySun){.elevation = 30, .azimuth = 90, .sun_size = 0.53f, .sun_intensity = 1, .air = 1, .dust = 1,
                        .ozone = 1, .gain = 2};
  World *w = world_of(s);
  CHECK(w->lights.sun_count == 1 && w->lights.sky.is_sampled);
  const Vec3 d = w->lights.suns[0].direction;
  CHECK_NEAR(d[0], cos(M_PI / 6), 1e-6); // east is +x
  CHECK_NEAR(d[1], 0.5, 1e-6);
  // The sky is brightest around the sun.
  CHECK(luminance(sky_radiance(&w->lights.sky, v3_normalize(v3(d[0], d[1] + 0.05f, 0)))) >
        2 * luminance(sky_radiance(&w->lights.sky, v3(-d[0], d[1], 0))));
  world_release(w);
  s->sky.sun.elevation = -5; // after sunset there is only the sky
  w = world_of(s);
  CHECK(w->lights.sun_count == 0 && w->lights.sky.is_sampled);
  world_release(w);
  scene_destroy(s);
}

TEST_MAIN
