// Media: light through fog against closed forms, quadrature, and the white furnace.

#include "tests/chi_square.h"
#include "tests/render_sample.h"

static Picture picture_of(Scene *s, Eye eye, uint32_t side, uint32_t spp)
{
  const Picture p = picture_seen(s, eye, side, spp);
  scene_destroy(s);
  return p;
}

// Good until the next one is added.
static MediumCommon *add_medium(Scene *s, float scattering, float absorption)
{
  const int32_t i = scene_add_medium(s, MEDIUM_HOMOGENEOUS, "medium");
  MediumCommon *m = &s->media.items[i].common;
  set3(m->scattering, scattering, scattering, scattering);
  set3(m->absorption, absorption, absorption, absorption);
  return m;
}

static int32_t last_medium(const Scene *s)
{
  return (int32_t)s->media.count - 1;
}

// --- phase functions --------------------------------------------------------------------------------

typedef struct PhaseCase {
  Phase phase;
  Vec3 travel;
} PhaseCase;

static bool phase_draw(const void *user, uint32_t i, Vec3 *d)
{
  const PhaseCase *c = user;
  float u[3], pdf;
  chi_random(i, u);
  *d = phase_sample(&c->phase, c->travel, (Vec2){u[0], u[1]}, &pdf);
  return fabsf(pdf - phase_pdf(&c->phase, c->travel, *d)) <= 1e-6f * pdf;
}

static double phase_density(const void *user, Vec3 d)
{
  const PhaseCase *c = user;
  return (double)phase_pdf(&c->phase, c->travel, d);
}

TEST(phase_functions_scatter_as_they_say)
{
  const Phase phases[] = {{0, 0, 0}, {0.5f, 0, 0}, {-0.7f, 0, 0}, {0.9f, 0, 0}, {0.0005f, 0, 0}, {0.8f, -0.4f, 0.3f}};
  const int count = sizeof phases / sizeof *phases;
  for (int i = 0; i < count; i++) {
    const PhaseCase user = {phases[i], v3_normalize(v3(0.3f, -0.8f, 0.5f))};
    const ChiCase c = {phase_draw, phase_density, &user, 0};
    const ChiResult r = chi_square(&c, (uint32_t)(100000 * test_intensity()));
    CHECK_NEAR(r.integral, 1, 2e-3);
    CHECK_MSG(r.accepted == 1 && r.p > sidak_level(count), "phase %d: p %.3g, accepted %.5f", i, r.p, r.accepted);
  }
}

TEST(the_mean_cosine_is_g)
{
  const float g[] = {-0.9f, -0.3f, 0, 0.3f, 0.9f, 0.95f};
  for (int i = 0; i < 6; i++) {
    double mean = 0, norm = 0;
    for (int k = 0; k < 200000; k++) {
      const double c = -1 + (k + 0.5) / 100000, p = (double)phase_lobe(g[i], (float)c) * 2 * M_PI / 100000;
      norm += p;
      mean += p * c;
    }
    CHECK_NEAR(norm, 1, 1e-3);
    CHECK_NEAR(mean, g[i], 1e-3);
  }
}

// Who asks for an integrator that sees no media is told so.
TEST(integrators_without_media_say_so)
{
  const Integrator kinds[] = {INTEGRATOR_PATH, INTEGRATOR_CLASSIC, INTEGRATOR_WHITTED};
  for (int i = 0; i < 3; i++) {
    Scene *s = new_scene(1);
    s->render.integrator = kinds[i];
    add_medium(s, 0, 1);
    add_sphere(s, -1, 0, 0, 0, 1)->common.medium = 0;
    World *w = world_of(s);
    CHECK(w->notes.lines.count == (i > 0));
    if (i && w->notes.lines.count) CHECK(strstr(w->notes.lines.items[0], i == 1 ? "classic" : "whitted"));
    world_release(w);
    scene_destroy(s);
  }
}

// --- what is lost -----------------------------------------------------------------------------------

// P9: what is left behind a slab, exactly: light that is only absorbed needs no chance.
TEST(absorption_is_exponential)
{
  const float thickness[] = {0.01f, 0.3f, 1, 4, 10};
  for (int i = 0; i < 5; i++) {
    Scene *s = new_scene(1);
    MediumCommon *m = add_medium(s, 0, 0);
    set3(m->absorption, 0.2f, 1, 0.5f);
    m->density = 0.8f;
    add_box(s, -1, 0, 0, 0, 8, 8, thickness[i])->common.medium = 0;
    const Picture p = picture_of(s, parallel(0, 0, 9, 0, 0, 0, 2), 4, 1);
    CHECK_NEAR(p.mean[0], exp(-0.16 * (double)thickness[i]), 1e-5);
    CHECK_NEAR(p.mean[1], exp(-0.8 * (double)thickness[i]), 1e-5);
    CHECK_NEAR(p.mean[2], exp(-0.4 * (double)thickness[i]), 1e-5);
  }
}

TEST(media_that_overlap_add_up)
{
  Scene *s = new_scene(1);
  add_medium(s, 0, 0.3f);
  add_medium(s, 0, 0.5f);
  add_box(s, -1, 0, 0, 0, 4, 4, 2)->common.medium = 0;
  add_box(s, -1, 0, 0, 0, 4, 4, 2)->common.medium = 1;    // all faces the same
  add_box(s, -1, 0, 0, -0.5f, 4, 4, 1)->common.medium = 1; // one face the same, again
  add_sphere(s, -1, 0, 0, 3, 0.5f)->common.medium = 0;    // beside
  const Picture p = picture_of(s, parallel(0, 0, 9, 0, 0, 0, 1e-3f), 4, 1);
  CHECK_NEAR(p.mean[0], exp(-0.3 * 2 - 0.5 * 2 - 0.5 * 1 - 0.3 * 1), 1e-5);
}

// What passes many media in a row is what passes one of their length: each has chances of its own.
TEST(many_media_in_a_row)
{
  Scene *s = new_scene(1);
  add_medium(s, 0.5f, 0);
  s->render.max_depth = 0; // what is scattered is lost
  for (int i = 0; i < 24; i++) add_box(s, -1, 0, 0, (float)i, 8, 8, 0.25f)->common.medium = 0;
  const Picture p = picture_of(s, parallel(0, 0, 30, 0, 0, 0, 1), 16, 64);
  CHECK_NEAR(p.mean[0], exp(-0.5 * 24 * 0.25), 6 * p.error);
  CHECK(p.error < 0.003);
}

// Smoke covers what is behind it by what it takes of its light, whatever it does with that.
TEST(smoke_is_seen_in_alpha)
{
  const float scattering[] = {0, 0.7f, 0.3f};
  for (int i = 0; i < 3; i++) {
    Scene *s = new_scene(1);
    MediumCommon *m = add_medium(s, scattering[i], 0.7f - scattering[i]);
    if (i == 2) set3(m->absorption, 0.1f, 0.4f, 0.7f);
    s->render.transparent = true;
    add_box(s, -1, 0, 0, 0, 8, 8, 1)->common.medium = 0;
    const Picture p = picture_of(s, parallel(0, 0, 9, 0, 0, 0, 1), 16, 64);
    const double left = i == 2 ? (exp(-0.4) + exp(-0.7) + exp(-1.0)) / 3 : exp(-0.7);
    CHECK_NEAR(p.mean[3], 1 - left, i ? 0.02 : 1e-5);
  }
}

// An eye knows what it is in: at its centre, on its lens, and where parallel rays begin.
TEST(an_eye_may_be_inside)
{
  Scene *s = new_scene(1);
  add_medium(s, 0, 1);
  add_sphere(s, -1, 0, 0, 0, 2)->common.medium = 0;
  add_sphere(s, -1, 0, 0, 0, 1)->common.medium = 0;
  const Picture p = picture_of(s, pinhole(0, 0, 0, 1, 2, 3, 60), 8, 1);
  CHECK_NEAR(p.least, exp(-3), 1e-5);
  CHECK_NEAR(p.most, exp(-3), 1e-5);

  s = new_scene(1);
  add_medium(s, 0, 1);
  add_box(s, -1, 3, 0, 0, 6, 6, 6)->common.medium = 0; // begins at x = 0
  const Picture half = picture_of(s, parallel(0.25f, 0, 0, 0.25f, 0, -1, 2), 8, 1);
  CHECK_NEAR(half.most, 1, 1e-6);
  CHECK_NEAR(half.least, exp(-3), 1e-5);
  CHECK_NEAR(half.mean[1], (3 + 5 * exp(-3)) / 8, 1e-5);
}

// Boundaries stop no ray to a light, and a light's own way through them counts.
TEST(lamps_shine_through_boundaries)
{
  for (int is_inside = 0; is_inside < 2; is_inside++) {
    Scene *s = new_scene(0);
    add_medium(s, 0, 0.5f);
    add_quad(s, add_lambert(s, 1, 1, 1), 0, 0, 0, -90, 0, 50);
    add_box(s, -1, 0, 2, 0, 9, 1, 9)->common.medium = 0;
    add_sphere(s, -1, 0, 2, 0, 0.25f)->common.medium = 0;
    Light *l = add_light(s, LIGHT_POINT);
    set3(l->point.position, 0, is_inside ? 2 : 4, 0);
    set3(l->point.intensity, PI, PI, PI);
    s->render.max_depth = 1;
    const Picture p = picture_of(s, pinhole(0, 0.5f, 0.001f, 0, 0, 0, 0.01f), 4, 1);
    const double height = is_inside ? 2 : 4, way = is_inside ? 0.75 : 1.5;
    CHECK_NEAR(p.mean[0], exp(-0.5 * way) / (height * height), 1e-5);
  }
}

TEST(an_atmosphere_is_everywhere)
{
  Scene *s = new_scene(7); // behind all that is endless
  add_medium(s, 0, 0.25f);
  s->render.atmosphere = 0;
  add_quad(s, add_glow(s, 3, true), 0, 0, 0, 0, 0, 9);
  const Picture p = picture_of(s, parallel(0, 0, 4, 0, 0, 0, 1), 4, 1);
  CHECK_NEAR(p.mean[0], 3 * exp(-1), 2e-5);
  s = new_scene(7);
  add_medium(s, 0, 0.25f);
  s->render.atmosphere = 0;
  CHECK_NEAR(picture_of(s, parallel(0, 0, 4, 0, 0, 0, 1), 4, 1).mean[0], 0, 1e-6);
}

// --- what is added ----------------------------------------------------------------------------------

TEST(a_glow_adds_up_along_its_way)
{
  const double thickness = 2.5;
  for (int k = 0; k < 3; k++) { // clear, absorbing, scattering light away (and, at depth 0, losing it)
    Scene *s = new_scene(0);
    MediumCommon *m = add_medium(s, k == 2 ? 0.6f : 0, k == 1 ? 0.6f : 0);
    set3(m->emission, 0.2f, 0.4f, 0.8f);
    add_box(s, -1, 0, 0, 0, 8, 8, 2.5f)->common.medium = 0;
    s->render.max_depth = 0;
    const Picture p = picture_of(s, parallel(0, 0, 9, 0, 0, 0, 2), 4, 1);
    const double length = k ? (1 - exp(-0.6 * thickness)) / 0.6 : thickness;
    CHECK_NEAR(p.mean[0], 0.2 * length, 1e-5);
    CHECK_NEAR(p.mean[2], 0.8 * length, 1e-5);
  }
}

// --- what is scattered ------------------------------------------------------------------------------

// The light of a point inside a medium that one scattering brings to a ray passing it at a distance, by Simpson's rule.
static double single_scatter(double g, double scattering, double extinction, double aside, double half)
{
  const int n = 20000;
  double sum = 0;
  for (int i = 0; i <= n; i++) {
    const double t = 2 * half * i / n, z = half - t; // of the place; the ray comes in at z = half, the light is at z = 0
    const double r2 = aside * aside + z * z, r = sqrt(r2);
    const double cosine = z / r; // between the way on, -z, and the way to the light
    const double d = 1 + g * g - 2 * g * cosine, phase = (1 - g * g) / (4 * M_PI * d * sqrt(d));
    sum += (i == 0 || i == n ? 1 : i % 2 ? 4 : 2) * scattering * phase * exp(-extinction * (t + r)) / r2;
  }
  return sum * 2 * half / n / 3;
}

TEST(single_scattering_agrees_with_quadrature)
{
  const float g[] = {0, 0.5f, 0.9f};
  for (int i = 0; i < 3; i++) {
    Scene *s = new_scene(0);
    add_medium(s, 0.6f, 0.2f)->anisotropy = g[i];
    add_box(s, -1, 0, 0, 0, 6, 6, 4)->common.medium = 0;
    Light *l = add_light(s, LIGHT_POINT);
    set3(l->point.position, 0.8f, 0, 0);
    set3(l->point.intensity, 1, 1, 1);
    s->render.max_depth = 1;
    const Picture p = picture_of(s, parallel(0, 0, 5, 0, 0, 0, 1e-4f), 32, (uint32_t)(TEST_IS_SLOW ? 64 : 256));
    const double want = single_scatter((double)g[i], 0.6, 0.8, 0.8, 2);
    printf("  g %.1f: %.6f, quadrature %.6f, error %.2g\n", (double)g[i], (double)p.mean[1], want, p.error);
    CHECK_NEAR(p.mean[1], want, (TEST_IS_SLOW ? 0.01 : 0.005) * want);
  }
}

// A medium that loses nothing cannot be seen in a white sky, whatever its colour, form and phase function.
TEST(white_media_vanish_in_a_white_sky)
{
  for (int k = 0; k < 6; k++) {
    Scene *s = new_scene(1);
    MediumCommon *m = add_medium(s, 2, 0);
    if (k == 1) m->anisotropy = 0.8f;
    if (k == 2) m->anisotropy = 0.7f, m->second_anisotropy = -0.5f, m->second_part = 0.4f;
    if (k == 3) set3(m->scattering, 0.3f, 1, 3);
    if (k == 4) set3(add_medium(s, 0, 0)->scattering, 2, 0.5f, 0); // two that overlap
    int32_t glass = -1;
    if (k == 5) glass = scene_add_material(s, MATERIAL_GLASS, "glass");
    if (k == 0)
      add_box(s, -1, 0, 0, 0, 1.5f, 1.5f, 1.5f)->common.medium = 0;
    else
      add_sphere(s, glass, 0, 0, 0, 1)->common.medium = 0;
    if (k == 4) add_box(s, -1, 0.4f, 0, 0, 1, 1, 1)->common.medium = last_medium(s);
    s->render.max_depth = 255;
    const Picture p = picture_of(s, pinhole(0, 0, 4, 0, 0, 0, 30), 24, 64);
    for (int c = 0; c < 3; c++)
      CHECK_MSG(fabsf(p.mean[c] - 1) < (k == 3 ? 0.012f : 0.005f), "case %d: %.5f +- %.5f", k, (double)p.mean[c], p.error);
    CHECK_MSG(p.least > 0.7f && p.most < 1.3f, "case %d: %.4f to %.4f", k, (double)p.least, (double)p.most);
  }
}

static Eye fog_eye(void)
{
  return pinhole(0, 0.5f, 5, 0, 0, 0, 40);
}

static Scene *fog_scene(bool is_twice)
{
  Scene *s = new_scene(0);
  add_medium(s, is_twice ? 0.7f : 1.4f, is_twice ? 0.1f : 0.2f)->anisotropy = 0.4f;
  add_quad(s, add_lambert(s, 0.5f, 0.5f, 0.5f), 0, -1, 0, -90, 0, 6);
  for (int i = 0; i <= is_twice; i++) add_box(s, -1, 0, 0, 0, 2, 1.5f, 2)->common.medium = 0;
  Light *l = add_light(s, LIGHT_RECT);
  set3(l->rect.position, 1, 2, 1);
  return s;
}

TEST(two_media_are_one_of_twice_the_density)
{
  const Picture one = picture_of(fog_scene(false), fog_eye(), 32, 64), two = picture_of(fog_scene(true), fog_eye(), 32, 64);
  const double error = sqrt(one.error * one.error + two.error * two.error);
  printf("  one %.5f, two halves %.5f, error %.2g\n", (double)one.mean[1], (double)two.mean[1], error);
  CHECK_NEAR(one.mean[1], two.mean[1], 4 * error);
  CHECK_MSG(error < 0.01 * (double)one.mean[1], "too noisy to tell: %.3g", error);
}

// --- media that differ from place to place ------------------------------------------------------------

// A ball with waves and a homogeneous one, overlapping.
static Scene *ball_scene(float scattering, float absorption)
{
  Scene *s = new_scene(1);
  const int32_t i = scene_add_medium(s, MEDIUM_BALL, "ball");
  Medium *m = &s->media.items[i];
  set3(m->common.scattering, scattering, scattering, scattering);
  set3(m->common.absorption, absorption, absorption, absorption);
  m->ball.radius = 0.9f;
  m->ball.waves = 9;
  set3(m->ball.waves_origin, 0.1f, -0.2f, 0.3f);
  add_box(s, -1, 0, 0, 0, 2, 2, 2)->common.medium = i;
  return s;
}

// The ball's depth along a line parallel to z, by the midpoint rule.
static double ball_depth(double x, double y)
{
  const int n = 20000;
  double sum = 0;
  for (int i = 0; i < n; i++) {
    const double z = -1 + (i + 0.5) * 2 / n, r = sqrt(x * x + y * y + z * z);
    if (r < 0.9) sum += (1 - r / 0.9) * (0.5 + 0.5 * sin(9 * (x - 0.1)) * sin(9 * (y + 0.2)) * sin(9 * (z - 0.3)));
  }
  return sum * 2 / n;
}

// Seen against the sky: a pure absorber by ratio tracking, one that scatters by delta tracking at depth 0. And a lamp
// seen through it by ratio tracking of shadow rays.
TEST(tracking_agrees_with_quadrature)
{
  const double want = exp(-4 * ball_depth(0.2, 0.1));
  for (int k = 0; k < 2; k++) {
    Scene *s = ball_scene(k ? 4 : 0, k ? 0 : 4);
    s->render.max_depth = 0;
    const Picture p = picture_of(s, parallel(0.2f, 0.1f, 5, 0.2f, 0.1f, 0, 1e-3f), 32, (uint32_t)(256 * test_intensity()));
    printf("  %s %.5f, quadrature %.5f, error %.2g\n", k ? "delta" : "ratio", (double)p.mean[1], want, p.error);
    CHECK_MSG(fabs((double)p.mean[1] - want) < 4 * p.error && p.error < 0.005 * want, "%.5f against %.5f +- %.2g",
              (double)p.mean[1], want, p.error);
  }
  Scene *s = ball_scene(4, 0);
  set3(s->sky.constant.color, 0, 0, 0);
  add_quad(s, add_lambert(s, 1, 1, 1), 0, 0, -2, 0, 0, 50);
  Light *l = add_light(s, LIGHT_POINT);
  set3(l->point.position, 0.2f, 0.1f, 2);
  set3(l->point.intensity, PI, PI, PI);
  s->render.max_depth = 1;
  const Picture p = picture_of(s, pinhole(1.7f, 0.1f, -1.8f, 0.2f, 0.1f, -2, 0.01f), 32, 64);
  CHECK_MSG(fabs((double)p.mean[1] * 16 - want) < 4 * 16 * p.error && p.error * 16 < 0.005 * want, "%.5f against %.5f +- %.2g",
            (double)p.mean[1] * 16, want, p.error * 16);
}

TEST(white_smoke_vanishes_in_a_white_sky)
{
  for (int k = 0; k < 3; k++) { // grey, coloured, two that overlap
    Scene *s = ball_scene(6, 0);
    if (k == 1) set3(s->media.items[0].common.scattering, 1, 3, 9);
    if (k == 2) set3(add_medium(s, 0, 0)->scattering, 0.5f, 1, 2);
    if (k == 2) add_sphere(s, -1, 0.3f, 0, 0, 0.8f)->common.medium = last_medium(s);
    s->render.max_depth = 1000;
    const Picture p = picture_of(s, pinhole(0, 0, 5, 0, 0, 0, 22), 24, 64);
    for (int c = 0; c < 3; c++)
      CHECK_MSG(fabsf(p.mean[c] - 1) < (k ? 0.015f : 0.005f), "case %d: %.5f +- %.5f", k, (double)p.mean[c], p.error);
  }
}

TEST(two_smokes_are_one_of_twice_the_density)
{
  Picture p[2];
  for (int k = 0; k < 2; k++) {
    Scene *s = ball_scene(k ? 4 : 8, k ? 0.5f : 1);
    if (k) add_box(s, -1, 0, 0, 0, 2, 2, 2)->common.medium = 0;
    p[k] = picture_of(s, pinhole(0, 0, 5, 0, 0, 0, 22), 24, 128);
  }
  const double error = sqrt(p[0].error * p[0].error + p[1].error * p[1].error);
  CHECK_NEAR(p[0].mean[1], p[1].mean[1], 4 * error);
  CHECK(error < 0.01);
}

// The march's promise: its brightness does not hang on how many steps it takes.
TEST(a_march_is_as_bright_in_few_steps_as_in_many)
{
  float mean[4];
  const int32_t steps[4] = {0, 8, 16, 64}; // 0: exact
  for (int k = 0; k < 4; k++) {
    Scene *s = ball_scene(6, 0.5f);
    s->render.volumes = steps[k] ? VOLUMES_MARCH : VOLUMES_EXACT;
    s->render.volume_steps = steps[k] ? steps[k] : 1;
    s->render.max_depth = 16;
    mean[k] = picture_of(s, pinhole(0, 0, 5, 0, 0, 0, 22), 24, 64).mean[1];
  }
  printf("  exact %.4f; 8 steps %.4f, 16 %.4f, 64 %.4f\n", (double)mean[0], (double)mean[1], (double)mean[2], (double)mean[3]);
  for (int k = 1; k < 4; k++) CHECK_NEAR(mean[k], mean[0], 0.01 * (double)mean[0]);
}

TEST(smoke_glows)
{
  Scene *s = ball_scene(0, 0.3f);
  set3(s->sky.constant.color, 0, 0, 0);
  set3(s->media.items[0].common.emission, 2, 2, 2);
  const Picture p = picture_of(s, parallel(0.2f, 0.1f, 5, 0.2f, 0.1f, 0, 1e-3f), 32, 64);
  const double want = 2 / 0.3 * (1 - exp(-0.3 * ball_depth(0.2, 0.1))); // emission and absorption go together
  CHECK_MSG(fabs((double)p.mean[1] - want) < 4 * p.error && p.error < 0.01 * want, "%.5f against %.5f +- %.2g",
            (double)p.mean[1], want, p.error);
}

TEST(every_instruction_set_sees_the_same_fog)
{
  Scene *s = fog_scene(true);
  s->media.items[0].kind = MEDIUM_BALL;
  s->media.items[0].ball = (MediumBall){.radius = 1, .waves = 5};
  World *w = world_of(s);
  Film *films[ISA_COUNT] = {0};
  for (int level = 0; level < ISA_COUNT; level++) {
    films[level] = film_create(16, 16, 0, NULL);
    const RenderJob job = job_of(s, w, fog_eye(), films[level], 4);
    if (level <= (int)cpu_best_isa()) CHECK(render_run(&job, NULL, hot_table((IsaLevel)level), NULL, NULL, NULL));
    if (level <= (int)cpu_best_isa())
      CHECK(!memcmp(films[0]->sums[FILM_BEAUTY], films[level]->sums[FILM_BEAUTY], 16 * 16 * 4 * sizeof(int64_t)));
  }
  for (int level = 0; level < ISA_COUNT; level++) film_destroy(films[level]);
  world_release(w);
  scene_destroy(s);
}

TEST_MAIN
