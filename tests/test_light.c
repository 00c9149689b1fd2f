// Lights: densities that match the samples, irradiances with closed forms, where the sky's picture lies, and what
// building a set does when memory runs out.

#include "tests/test.h"

#include "base/mem.h"
#include "shade/light_sample.h"
#include "tests/chi_square.h"

static Emitter emitter_of(EmitterKind kind, Vec3 p, Vec3 x, Vec3 y, float radius)
{
  Emitter e = {.kind = (uint8_t)kind,
               .p = p,
               .x = x,
               .y = y,
               .color = v3_all(2),
               .radius = radius,
               .map = -1,
               .mean_map = 1};
  const float area = v3_length(v3_cross(x, y));
  e.area = kind == EMITTER_TRIANGLE ? area / 2
           : kind == EMITTER_QUAD   ? area
           : kind == EMITTER_DISK   ? PI * area
                                    : 0;
  if (kind == EMITTER_SPHERE) e.area = 4 * PI * radius * radius;
  return e;
}

static const SkyMap no_sky;

static LightSet set_of(const Emitter *e, size_t count)
{
  LightSet set;
  CHECK(light_set_build(&set, e, count, NULL, 0, &no_sky, NULL, NULL));
  return set;
}

// --- where a ray meets an emitter -----------------------------------------------------------------------
static bool meet_flat(const Emitter *e, Vec3 p, Vec3 d, double *distance, double *cosine)
{
  const Vec3 n = v3_normalize(v3_cross(e->x, e->y));
  *distance = (double)(v3_dot(e->p - p, n) / v3_dot(d, n));
  *cosine = -(double)v3_dot(d, n);
  const Vec3 at = p + (float)*distance * d - e->p;
  const float xx = v3_dot(e->x, e->x), yy = v3_dot(e->y, e->y), xy = v3_dot(e->x, e->y);
  const float px = v3_dot(at, e->x), py = v3_dot(at, e->y), scale = xx * yy - xy * xy;
  const float a = (px * yy - py * xy) / scale, b = (py * xx - px * xy) / scale;
  const bool is_inside =
      e->kind == EMITTER_DISK
          ? a * a + b * b <= 1
          : a >= 0 && b >= 0 && (e->kind == EMITTER_TRIANGLE ? a + b <= 1 : a <= 1 && b <= 1);
  return *distance > 0 && is_inside && (*cosine > 0 || e->is_two_sided);
}

static bool meet_sphere(const Emitter *e, Vec3 p, Vec3 d, double *distance, double *cosine)
{
  const Vec3 to = e->p - p;
  const double along = (double)v3_dot(to, d), gap = (double)v3_dot(to, to) - along * along;
  const double inside2 = (double)(e->radius * e->radius) - gap;
  if (inside2 < 0) return false;
  *distance = along - sqrt(inside2);
  if (*distance < 0) *distance = along + sqrt(inside2);
  *cosine = sqrt(inside2) / (double)e->radius;
  return *distance > 0;
}

typedef struct Lit {
  LightSet set;
  Vec3 p;
  size_t group;
} Lit;

static bool draw(const void *user, uint32_t i, Vec3 *d)
{
  const Lit *l = user;
  float u[3];
  chi_random(i, u);
  LightSample s;
  if (!light_sample(&l->set, NULL, l->group, l->p, v3_all(0), u[0], (Vec2){u[1], u[2]}, &s)) return false;
  *d = s.wl;
  return true;
}

static double emitter_density(const void *user, Vec3 d)
{
  const Lit *l = user;
  double sum = 0, distance, cosine;
  for (uint32_t i = 0; i < l->set.emitter_count; i++) {
    const Emitter *e = &l->set.emitters[i];
    const bool hit = e->kind == EMITTER_SPHERE ? meet_sphere(e, l->p, d, &distance, &cosine)
                                               : meet_flat(e, l->p, d, &distance, &cosine);
    if (hit) sum += (double)light_pdf_emitter(&l->set, i, l->p, v3_all(0), (float)distance, (float)fabs(cosine));
  }
  return sum;
}

static double sky_density(const void *user, Vec3 d)
{
  return (double)sky_pdf(&((const Lit *)user)->set.sky, d);
}
static double sun_density(const void *user, Vec3 d)
{
  return (double)sun_pdf(&((const Lit *)user)->set.suns[0], d);
}

enum { SAMPLES = 100000, CASES = 9 };
static double least_p = 1;

static void check_density(const char *name, const Lit *l, double (*pdf)(const void *, Vec3))
{
  const ChiCase c = {draw, pdf, l, 24};
  const ChiResult r = chi_square(&c, SAMPLES);
  least_p = fmin(least_p, r.p);
  CHECK_MSG(r.p > sidak_level(CASES), "%s: p = %g", name, r.p);
  CHECK_MSG(fabs(r.integral - r.accepted) < 4e-3, "%s: integral %g, accepted %g", name, r.integral,
            r.accepted);
}

TEST(emitters_follow_their_density)
{
  Emitter all[] = {emitter_of(EMITTER_QUAD, v3(-1, 1, -1), v3(2, 0, 0.3f), v3(0, 0, 2), 0),
                   emitter_of(EMITTER_TRIANGLE, v3(1, -1, -1), v3(-0.4f, 2, 0), v3(0, 0.5f, 2), 0),
                   emitter_of(EMITTER_DISK, v3(-2, 0, 0), v3(0, 1, 0), v3(0, 0, 1.5f), 0),
                   emitter_of(EMITTER_SPHERE, v3(0, -2, 0.5f), v3_all(0), v3_all(0), 1)};
  const char *names[] = {"quad", "triangle", "disk", "sphere"};
  for (int i = 0; i < 4; i++) {
    all[i].is_two_sided = true;
    const Lit l = {.set = set_of(&all[i], 1), .p = v3(0.1f, 0, 0.2f)};
    check_density(names[i], &l, emitter_density);
    light_set_finish((LightSet *)&l.set);
  }
  Lit l = {.set = set_of(all, 4), .p = v3(0.1f, 0, 0.2f)};
  check_density("all four", &l, emitter_density);
  light_set_finish(&l.set);
  l = (Lit){.set = set_of(&all[3], 1), .p = v3(0.3f, -2.2f, 0.5f)};
  check_density("sphere from inside", &l, emitter_density);
  light_set_finish(&l.set);
  printf("  least p so far %.4f (level %.1e)\n", least_p, sidak_level(CASES));
}

// --- skies and suns ---------------------------------------------------------------------------------------
static float sky_pixels[16 * 32 * 3];

static SkyMap spotted_sky(void)
{
  for (int i = 0; i < 16 * 32 * 3; i++) sky_pixels[i] = (float)(i / 96) / 16;
  for (int c = 0; c < 3; c++) sky_pixels[(5 * 32 + 20) * 3 + c] = 30;
  return (SkyMap){
      .kind = SKY_MAP_IMAGE, .image = {32, 16, 3, PIXEL_F32, sky_pixels}, .gain = 1, .rotation = 0.5f};
}

static LightSet sky_set(const SkyMap *sky)
{
  LightSet set;
  CHECK(light_set_build(&set, NULL, 0, NULL, 0, sky, NULL, NULL));
  return set;
}

TEST(skies_and_suns_follow_their_density)
{
  const SkyMap image = spotted_sky();
  Lit l = {.set = sky_set(&image)};
  CHECK(light_group_count(&l.set) == 1);
  check_density("image", &l, sky_density);
  light_set_finish(&l.set);
  const SkyMap gradient = {.kind = SKY_MAP_GRADIENT,
                           .color = v3(0, 0, 1),
                           .horizon = v3_all(3),
                           .ground = v3_all(0.1f),
                           .gain = 2};
  l.set = sky_set(&gradient);
  check_density("gradient", &l, sky_density);
  light_set_finish(&l.set);
  const Sun sun = {.direction = v3_normalize(v3(1, 2, -1)), .radiance = v3_all(1), .one_minus_cos = 0.1f};
  CHECK(light_set_build(&l.set, NULL, 0, &sun, 1, &no_sky, NULL, NULL) && light_group_count(&l.set) == 1);
  check_density("sun", &l, sun_density);
  light_set_finish(&l.set);
  printf("  least p of all %.4f\n", least_p);
}

TEST(no_shining_part_of_a_sky_is_without_density)
{
  memset(sky_pixels, 0, sizeof sky_pixels);
  for (int c = 0; c < 3; c++) sky_pixels[(5 * 32 + 31) * 3 + c] = sky_pixels[(15 * 32 + 3) * 3 + c] = 1;
  const SkyMap sky = {.kind = SKY_MAP_IMAGE, .image = {32, 16, 3, PIXEL_F32, sky_pixels}, .gain = 1};
  LightSet set = sky_set(&sky);
  int bright = 0;
  for (uint32_t i = 0; i < 100000; i++) {
    float u[3];
    chi_random(i, u);
    const Vec3 d = cone_direction(v3(0, 1, 0), 2, (Vec2){u[0], u[1]});
    if (sky_radiance(&set.sky, d)[0] < 1e-4f) continue;
    bright++;
    CHECK(sky_pdf(&set.sky, d) > 0);
  }
  CHECK(bright > 100);
  light_set_finish(&set);
}

TEST(the_picture_hangs_where_it_should)
{
  memset(sky_pixels, 0, sizeof sky_pixels);
  for (int y = 0; y < 16; y++)
    for (int x = 0; x < 32; x++)
      sky_pixels[(y * 32 + x) * 3] = (float)x, sky_pixels[(y * 32 + x) * 3 + 1] = (float)y;
  SkyMap sky = {.kind = SKY_MAP_IMAGE, .image = {32, 16, 3, PIXEL_F32, sky_pixels}, .gain = 1};
  CHECK_NEAR(sky_radiance(&sky, v3(0, 0, -1))[0], 15.5, 1e-4); // the centre
  CHECK_NEAR(sky_radiance(&sky, v3(1, 0, 0))[0], 23.5, 1e-4);  // to the right
  CHECK_NEAR(sky_radiance(&sky, v3(0, 0, -1))[1], 7.5, 1e-4);
  CHECK_NEAR(sky_radiance(&sky, v3(0, 1, 0))[1], 0, 1e-4);
  CHECK_NEAR(sky_radiance(&sky, v3(0, -1, 0))[1], 15, 1e-4);
  sky.rotation = PI / 2; // counter-clockwise from above: what was at -z is now at -x
  CHECK_NEAR(sky_radiance(&sky, v3(-1, 0, 0))[0], 15.5, 1e-4);
  for (uint32_t i = 0; i < 1000; i++) {
    float u[3];
    chi_random(i, u);
    const Vec2 uv = {u[0], 0.01f + 0.98f * u[1]}, back = sky_uv(&sky, sky_direction(&sky, uv));
    CHECK_NEAR(back.x, uv.x, 2e-5);
    CHECK_NEAR(back.y, uv.y, 2e-6);
  }
}

// --- irradiance ---------------------------------------------------------------------------------------------
// Mean of radiance cos / pdf over points of the unit cube (Roberts's R3 sequence).
static double irradiance(const LightSet *set, size_t group, Vec3 p, Vec3 n)
{
  double sum = 0;
  for (uint32_t i = 1; i <= 200000; i++) {
    LightSample s;
    const Vec2 u = {unit_float(i * 3518319155u), unit_float(i * 2882110345u)};
    if (!light_sample(set, NULL, group, p, n, unit_float(i * 2360945575u), u, &s)) continue;
    sum += (double)(s.radiance[1] * max_f(v3_dot(s.wl, n), 0) / s.pdf);
  }
  return sum / 200000;
}

// Lambert's formula for a polygon wholly above the horizon (1760): half the sum over edges of the angle seen times
// the cosine between n and the edge's plane.
static double polygon_irradiance(const Vec3 *corners, int count, Vec3 n)
{
  double sum = 0;
  for (int i = 0; i < count; i++) {
    const Vec3 a = v3_normalize(corners[i]), b = v3_normalize(corners[(i + 1) % count]);
    sum += acos((double)v3_dot(a, b)) * (double)v3_dot(v3_normalize(v3_cross(a, b)), n);
  }
  return fabs(sum) / 2;
}

static void check_irradiance(const char *name, const Emitter *e, double truth)
{
  LightSet set = set_of(e, 1);
  const double got = irradiance(&set, 0, v3_all(0), v3(0, 1, 0));
  printf("  %-10s %.6f, closed form %.6f\n", name, got, truth);
  CHECK_MSG(fabs(got / truth - 1) < 1e-3, "%s: %g against %g", name, got, truth);
  light_set_finish(&set);
}

TEST(irradiance_has_its_closed_form)
{
  const Emitter sphere = emitter_of(EMITTER_SPHERE, v3(0, 3, 0), v3_all(0), v3_all(0), 1.2f);
  check_irradiance("sphere", &sphere, 2 * M_PI * 0.16);
  const Emitter far = emitter_of(EMITTER_SPHERE, v3(0, 3e4f, 0), v3_all(0), v3_all(0), 1.2f);
  check_irradiance("far sphere", &far, 2 * M_PI * 1.6e-9);
  const Emitter disk = emitter_of(EMITTER_DISK, v3(0, 2, 0), v3(1.5f, 0, 0), v3(0, 0, 1.5f), 0);
  check_irradiance("disk", &disk, 2 * M_PI * 2.25 / (2.25 + 4));
  const Emitter quad = emitter_of(EMITTER_QUAD, v3(0, 1, 0), v3(1, 0, 0), v3(0, 0, 2), 0);
  // A rectangle over one of its corners (Howell, "A catalog of radiation heat transfer", B-3).
  const double r1 = sqrt(2), r2 = sqrt(5),
               factor = (1 / r1 * atan(2 / r1) + 2 / r2 * atan(1 / r2)) / (2 * M_PI);
  check_irradiance("quad", &quad, 2 * M_PI * factor);
  const Vec3 corners[] = {v3(-1, 1, 1), v3(2, 1.5f, 0.5f), v3(0.3f, 1, -1)};
  const Emitter triangle =
      emitter_of(EMITTER_TRIANGLE, corners[0], corners[1] - corners[0], corners[2] - corners[0], 0);
  Emitter both = triangle;
  both.is_two_sided = true;
  check_irradiance("triangle", &both, 2 * polygon_irradiance(corners, 3, v3(0, 1, 0)));
}

TEST(suns_and_skies_give_their_irradiance)
{
  LightSet set;
  const Vec3 d = v3(0, 1, 0);
  const float heights[] = {1.07e-5f, 0.01f, 0.5f};
  for (int i = 0; i < 3; i++) {
    const Sun sun = {.direction = d, .radiance = v3_all(2), .one_minus_cos = heights[i]};
    CHECK(light_set_build(&set, NULL, 0, &sun, 1, &no_sky, NULL, NULL));
    const double c = 1 - (double)heights[i], truth = 2 * M_PI * (1 - c) * (1 + c);
    CHECK_NEAR(irradiance(&set, 0, v3_all(0), d) / truth, 1, 1e-3);
    CHECK(sun_radiance_seen(&set, d)[0] == 2 && sun_radiance_seen(&set, -d)[0] == 0);
    light_set_finish(&set);
  }
  const Sun delta = {.direction = d, .radiance = v3_all(3)};
  CHECK(light_set_build(&set, NULL, 0, &delta, 1, &no_sky, NULL, NULL));
  CHECK_NEAR(irradiance(&set, 0, v3_all(0), v3_normalize(v3(0, 1, 1))), 3 / sqrt(2), 1e-6);
  CHECK(sun_radiance_seen(&set, d)[0] == 0);
  light_set_finish(&set);

  for (int i = 0; i < 16 * 32 * 3; i++) sky_pixels[i] = 1;
  SkyMap sky = {.kind = SKY_MAP_IMAGE, .image = {32, 16, 3, PIXEL_F32, sky_pixels}, .gain = 2};
  set = sky_set(&sky);
  CHECK_NEAR(irradiance(&set, 0, v3_all(0), v3_normalize(v3(1, 2, 3))), 2 * M_PI, 5e-3);
  light_set_finish(&set);
  sky = (SkyMap){.kind = SKY_MAP_CONSTANT, .color = v3_all(1), .gain = 2};
  set = sky_set(&sky);
  CHECK(light_group_count(&set) == 0 && sky_pdf(&set.sky, d) == 0 && sky_radiance(&set.sky, d)[0] == 2);
  light_set_finish(&set);
}

TEST(points_and_spots)
{
  Emitter e[] = {emitter_of(EMITTER_POINT, v3(0, 2, 0), v3_all(0), v3_all(0), 0),
                 emitter_of(EMITTER_SPOT, v3(0, 2, 0), v3(0, -1, 0), v3_all(0), 0)};
  e[1].cos_outer = 0.8f;
  e[1].cos_inner = 0.9f;
  LightSet set = set_of(e, 2);
  CHECK_NEAR(irradiance(&set, 0, v3_all(0), v3(0, 1, 0)), 1, 1e-4); // both: 2 / 2^2
  const float of[2] = {light_tree_pmf(&set.tree, v3_all(0), v3_all(0), 0), light_tree_pmf(&set.tree, v3_all(0), v3_all(0), 1)};
  CHECK_NEAR(of[1] / of[0], 0.15 / 2, 1e-5);
  CHECK(light_pdf_emitter(&set, 0, v3_all(0), v3_all(0), 2, 1) == 0);
  light_set_finish(&set);
  CHECK(spot_falloff(&e[1], 0.95f) == 1 && spot_falloff(&e[1], 0.79f) == 0);
  CHECK_NEAR(spot_falloff(&e[1], 0.85f), 0.5, 1e-5);
}

TEST(backs_are_dark)
{
  const Emitter quad = emitter_of(EMITTER_QUAD, v3(-1, 1, -1), v3(2, 0, 0), v3(0, 0, 2), 0); // faces down
  LightSet set = set_of(&quad, 1);
  LightSample s;
  const Vec2 u = {0.3f, 0.4f};
  CHECK(light_sample(&set, NULL, 0, v3(0, 0, 0), v3_all(0), 0.5f, u, &s));
  CHECK(!light_sample(&set, NULL, 0, v3(0, 2, 0), v3_all(0), 0.5f, u, &s));
  light_set_finish(&set);
  const Emitter sphere = emitter_of(EMITTER_SPHERE, v3_all(0), v3_all(0), v3_all(0), 1);
  set = set_of(&sphere, 1);
  CHECK(!light_sample(&set, NULL, 0, v3(0.1f, 0, 0), v3_all(0), 0.5f, u, &s));
  light_set_finish(&set);
}

TEST(odd_powers_and_no_memory)
{
  Emitter e[3] = {emitter_of(EMITTER_POINT, v3(0, 2, 0), v3_all(0), v3_all(0), 0)};
  e[1] = e[2] = e[0];
  e[0].color = v3_all(NAN);
  e[2].color = v3_all(-1);
  LightSet set = set_of(e, 3);
  for (uint32_t i = 0; i < 3; i++) {
    uint32_t picked;
    float pmf;
    CHECK(light_tree_pmf(&set.tree, v3_all(0), v3_all(0), i) == (float)(i == 1));
    CHECK(light_tree_pick(&set.tree, v3_all(0), v3_all(0), 0x1.fffffep-1f * (float)i / 2, &picked, &pmf) && picked == 1);
  }
  light_set_finish(&set);

  const SkyMap sky = spotted_sky();
  const Sun sun = {.direction = v3(0, 1, 0), .radiance = v3_all(1), .one_minus_cos = 0.1f};
  for (long n = 1; n < 20; n++) {
    Err err = {0};
    mem_fail_after(n);
    const bool ok = light_set_build(&set, e, 3, &sun, 1, &sky, NULL, &err);
    mem_fail_after(0);
    CHECK(ok == (err.kind == ERR_NONE) && (ok || err.kind == ERR_NO_MEMORY));
    CHECK(ok || (set.emitter_count == 0 && light_group_count(&set) == 0));
    light_set_finish(&set);
    if (ok) break;
    CHECK(n < 19);
  }
}

TEST_MAIN
