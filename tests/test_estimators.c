// What Monte Carlo owes: its ways agree region by region, its error falls as it should, and what it says of its own error
// is so (P12 to P15 of the promises). Counts grow with the night.

#include "tests/render_sample.h"

enum { W = 24, H = 18, PIXELS = W * H };

static double effort(void) { return TEST_IS_SLOW ? 0.125 : test_intensity(); }

// A room with a lamp, matt, shiny and clear things. With is_aimed the lamp is aimed at, else it is met by luck alone.
static Scene *room(bool is_aimed)
{
  Scene *s = new_scene(0);
  const int32_t white = add_lambert(s, 0.75f, 0.75f, 0.75f), red = add_lambert(s, 0.6f, 0.1f, 0.1f);
  const int32_t metal = add_pbr(s, 0.8f, 0.3f), plastic = add_pbr(s, 0.4f, 0.4f);
  s->materials.items[metal].pbr.metallic = 1;
  add_quad(s, white, 0, -1, 0, -90, 0, 2);
  add_quad(s, white, 0, 1, 0, 90, 0, 2);
  add_quad(s, white, 0, 0, -1, 0, 0, 2);
  add_quad(s, red, -1, 0, 0, 0, 90, 2);
  add_quad(s, white, 1, 0, 0, 0, -90, 2);
  add_sphere(s, metal, -0.45f, -0.6f, -0.3f, 0.4f);
  add_box(s, plastic, 0.4f, -0.7f, 0.2f, 0.5f, 0.6f, 0.5f);
  add_quad(s, add_glow(s, 4, is_aimed), 0, 0.99f, 0, 90, 0, 1.2f);
  s->render.max_depth = 6;
  return s;
}

// One picture's luminance, and what the film says of its variance.
typedef struct Shot {
  float light[PIXELS], variance[PIXELS];
} Shot;

static void shoot(const Scene *s, const World *w, uint32_t spp, uint64_t seed, Shot *out)
{
  Film *f = film_create(W, H, ALL_PLANES, NULL);
  RenderJob job = job_of(s, w, pinhole(0, 0, 3.4f, 0, 0, 0, 36), f, spp);
  float rgba[4 * PIXELS];
  job.seed = seed;
  CHECK(render_run(&job, NULL, hot_table(cpu_best_isa()), NULL, NULL, NULL));
  CHECK(film_resolve(f, FILM_BEAUTY, rgba) && film_resolve(f, FILM_VARIANCE, out->variance));
  for (int i = 0; i < PIXELS; i++) out->light[i] = luminance(v3_load(rgba + 4 * i));
  film_destroy(f);
}

// --- P13: the ways agree -----------------------------------------------------------------------------

enum { REGIONS_X = 4, REGIONS_Y = 3, REGIONS = REGIONS_X * REGIONS_Y };

static void sum_regions(const Shot *shot, double light[REGIONS], double variance[REGIONS])
{
  memset(light, 0, REGIONS * sizeof *light);
  memset(variance, 0, REGIONS * sizeof *variance);
  for (int i = 0; i < PIXELS; i++) {
    const int r = i / W * REGIONS_Y / H * REGIONS_X + i % W * REGIONS_X / W;
    light[r] += (double)shot->light[i];
    variance[r] += (double)shot->variance[i];
  }
}

// Aimed at, and met by luck; with roulette from the first bounce, and without; by each sample's own numbers.
TEST(ways_agree_region_by_region)
{
  static const struct {
    const char *name;
    bool is_aimed;
    int32_t roulette_depth;
    double share; // of the samples
  } ways[] = {{"light and luck", true, 3, 1}, {"luck alone", false, 3, 6}, {"no roulette", true, 100, 1}, {"all roulette", true, 0, 2}};
  double light[4][REGIONS], variance[4][REGIONS];
  for (int k = 0; k < 4; k++) {
    Scene *s = room(ways[k].is_aimed);
    s->render.roulette_depth = ways[k].roulette_depth;
    World *w = world_of(s);
    Shot shot;
    shoot(s, w, (uint32_t)fmin(48 * ways[k].share * effort(), 500000), 7 + (uint64_t)k, &shot);
    sum_regions(&shot, light[k], variance[k]);
    world_release(w);
    scene_destroy(s);
    double most = 0;
    for (int r = 0; r < REGIONS; r++) {
      const double sigma = sqrt(variance[k][r] + variance[0][r]), off = light[k][r] - light[0][r];
      if (k) most = fmax(most, fabs(off) / sigma);
      // Of 36 comparisons 3.6 sigma is passed once in a hundred runs.
      if (k) CHECK_MSG(fabs(off) < 3.6 * sigma, "%s, region %d: %g against %g +- %g", ways[k].name, r, light[k][r], light[0][r], sigma);
      if (k && test_intensity() >= 100) CHECK_NEAR(light[k][r] / light[0][r], 1, 0.003);
    }
    if (k) printf("  %-14s worst region %.2f sigma off\n", ways[k].name, most);
  }
}

// --- P14, P15, P12: the error ------------------------------------------------------------------------

// Variance of pictures of so many samples, by seeds; and what their films say of it.
static double variance_by_seeds(const Scene *s, const World *w, uint32_t spp, int seeds, double *told)
{
  static double sum[PIXELS], squares[PIXELS];
  static Shot shot;
  memset(sum, 0, sizeof sum);
  memset(squares, 0, sizeof squares);
  double variance = 0;
  *told = 0;
  for (int k = 0; k < seeds; k++) {
    shoot(s, w, spp, 1000 + (uint64_t)k, &shot);
    for (int i = 0; i < PIXELS; i++) {
      const double x = (double)shot.light[i];
      sum[i] += x;
      squares[i] += x * x;
      *told += (double)shot.variance[i] / (PIXELS * (double)seeds);
    }
  }
  for (int i = 0; i < PIXELS; i++) variance += (squares[i] - sum[i] * sum[i] / seeds) / (seeds - 1) / PIXELS;
  return variance;
}

// The root mean square error falls with the root of the samples, or faster, as the samples of one pixel are spread evenly;
// and what a film says of its variance, which takes samples for independent, is never less than it is, and some times more.
TEST(error_falls_by_the_root_and_is_told)
{
  enum { STEPS = TEST_IS_SLOW ? 2 : 4 };
  Scene *s = room(true);
  World *w = world_of(s);
  const int seeds = (int)fmin(8 * fmax(1, sqrt(test_intensity())), 400);
  double x[STEPS], y[STEPS], mean_x = 0, mean_y = 0, top = 0, bottom = 0;
  for (int k = 0; k < STEPS; k++) {
    const uint32_t spp = 4u << (2 * k);
    double told;
    const double variance = variance_by_seeds(s, w, spp, seeds, &told);
    printf("  %3u samples: error %.5f, told %.2f times its variance\n", spp, sqrt(variance), told / variance);
    CHECK_MSG(told / variance > 0.9 && told / variance < 5, "%u samples: %.3f", spp, told / variance);
    mean_x += (x[k] = log((double)spp)) / STEPS;
    mean_y += (y[k] = 0.5 * log(variance)) / STEPS;
  }
  for (int k = 0; k < STEPS; k++) {
    top += (x[k] - mean_x) * (y[k] - mean_y);
    bottom += (x[k] - mean_x) * (x[k] - mean_x);
  }
  printf("  slope %.3f\n", top / bottom);
  CHECK_MSG(top / bottom < -0.47 && top / bottom > -0.8, "slope %.3f", top / bottom);
  world_release(w);
  scene_destroy(s);
}

// Pixels lie as far from a picture of very many samples as their variances say.
TEST(pixels_lie_where_their_variance_says)
{
  Scene *s = room(true);
  World *w = world_of(s);
  static Shot truth, shot;
  shoot(s, w, (uint32_t)fmin(1024 * effort(), 1 << 19), 1, &truth);
  int within = 0, count = 0;
  for (uint64_t seed = 2; seed < (TEST_IS_SLOW ? 4 : 10); seed++) {
    shoot(s, w, 64, seed, &shot);
    for (int i = 0; i < PIXELS; i++, count++)
      within += fabsf(shot.light[i] - truth.light[i]) <= 3 * sqrtf(shot.variance[i] + truth.variance[i]);
  }
  printf("  %.3f %% within three sigma\n", 100.0 * within / count);
  CHECK_MSG(within >= (test_intensity() > 1 ? 0.995 : 0.99) * count, "%d of %d", within, count);
  world_release(w);
  scene_destroy(s);
}

TEST_MAIN
