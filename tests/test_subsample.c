// Pictures from a tenth of their pixels: against the whole picture, in motion, on any number of threads.

#include "tests/test.h"

#include "base/fmath.h"
#include "base/vec.h"
#include "base/mem.h"
#include "render/subsample.h"

// --- a picture to make: a shaded disk with a highlight and a striped one move over a ramp ----------
typedef struct Show {
  float time;
  int width, height;
  atomic_int asked;
} Show;

static Vec3 disk_color(float dx, float dy, float r)
{
  const float shade = safe_sqrt(1 - (dx * dx + dy * dy) / (r * r)), x = dx / r - 0.3f, y = dy / r + 0.4f;
  const float light = f_exp(-20 * (x * x + y * y));
  return v3_min(v3(0.2f, 0.3f, 0.7f) * shade + v3_all(light), v3_all(1));
}

static SubsampleResult show_at(const Show *show, int px, int py)
{
  const float w = (float)show->width, x = (float)px, y = (float)py;
  const float cx = w * (0.5f + 0.2f * f_cos(show->time)), cy = w * (0.35f + 0.1f * f_sin(2 * show->time)), r = 0.16f * w;
  SubsampleResult out = {{0.4f + 0.3f * x / w, 0.5f, 0.6f - 0.4f * y / w}, 1, 0};
  const float ex = x - w * 0.2f, ey = y - w * (0.2f + 0.02f * show->time), q = 0.12f * w;
  if (ex * ex + ey * ey < q * q) {
    out.signature = 2 + (uint32_t)(int)floorf((ex + ey) / (0.04f * w) + 100);
    v3_store(out.rgb, out.signature & 1 ? v3_all(0.9f) : v3_all(0.1f));
  }
  const float dx = x - cx, dy = y - cy;
  if (dx * dx + dy * dy < r * r) {
    out.signature = 1000;
    v3_store(out.rgb, disk_color(dx, dy, r));
  }
  return out;
}

static void show_trace(void *user, const SubsamplePixel *pixels, size_t count, SubsampleResult *out, int worker)
{
  Show *show = user;
  (void)worker;
  show->asked += (int)count;
  for (size_t i = 0; i < count; i++) out[i] = show_at(show, pixels[i].x, pixels[i].y);
}

static uint8_t *run_on(SubsampleTrace *trace, Show *show, const SubsampleSettings *settings, int threads,
                       SubsampleStats *stats)
{
  Err err = {0};
  Jobs *jobs = jobs_create(threads, &err);
  Subsampler *s = subsampler_create(show->width, show->height, &err);
  uint8_t *rgba = mem_zero((size_t)show->width * (size_t)show->height, 4);
  CHECK(jobs && s && rgba && subsampler_run(s, settings, trace, show, jobs, NULL, rgba, NULL, stats));
  subsampler_destroy(s);
  jobs_destroy(jobs);
  return rgba;
}

static uint8_t *run(Show *show, const SubsampleSettings *settings, int threads, SubsampleStats *stats)
{
  return run_on(show_trace, show, settings, threads, stats);
}

static double psnr(const uint8_t *a, const uint8_t *b, size_t pixels)
{
  double sum = 0;
  for (size_t i = 0; i < 4 * pixels; i++) sum += ((double)a[i] - b[i]) * ((double)a[i] - b[i]);
  return sum > 0 ? 10 * log10(255.0 * 255 * 3 * (double)pixels / sum) : INFINITY;
}

static SubsampleSettings whole(void)
{
  SubsampleSettings s = subsample_defaults();
  s.block = 1;
  return s;
}

// --------------------------------------------------------------------------------------------------
TEST(every_pixel_is_the_function)
{
  Show show = {.time = 1, .width = 83, .height = 61};
  SubsampleStats stats;
  const SubsampleSettings settings = whole();
  uint8_t *rgba = run(&show, &settings, 2, &stats);
  for (int y = 0; y < show.height; y++)
    for (int x = 0; x < show.width; x++) {
      const SubsampleResult r = show_at(&show, x, y);
      for (int c = 0; c < 3; c++)
        CHECK(rgba[4 * (y * show.width + x) + c] == (uint8_t)(clamp_f(r.rgb[c], 0, 1) * 255 + 0.5f));
    }
  CHECK(stats.traced == 83 * 61 && show.asked == 83 * 61);
  mem_free(rgba);
}

// Each pixel is asked for once, comes from a block or a trace, and no frame is far from the whole picture or flickers.
TEST(moving_pictures_are_near_the_whole)
{
  enum { WIDTH = 400, HEIGHT = 300 };
  uint8_t *last[2] = {0};
  double worst = INFINITY, traced = 0;
  int flickering = 0;
  const int frames = TEST_IS_SLOW ? 4 : 24;
  for (int frame = 0; frame < frames; frame++) {
    Show show = {.time = (float)frame / 60, .width = WIDTH, .height = HEIGHT};
    const SubsampleSettings settings[2] = {whole(), subsample_defaults()};
    SubsampleStats stats;
    uint8_t *full = run(&show, &settings[0], 2, NULL);
    show.asked = 0;
    uint8_t *mine = run(&show, &settings[1], 2, &stats);
    CHECK((uint64_t)show.asked == stats.traced);
    CHECK(stats.traced + stats.equal + stats.mixed >= WIDTH * HEIGHT);
    traced += (double)stats.traced / (WIDTH * HEIGHT) / frames;
    worst = fmin(worst, psnr(full, mine, WIDTH * HEIGHT));
    for (size_t i = 0; last[0] && i < 4 * WIDTH * HEIGHT; i++)
      flickering += abs((mine[i] - full[i]) - (last[1][i] - last[0][i])) > 16;
    mem_free(last[0]);
    mem_free(last[1]);
    last[0] = full;
    last[1] = mine;
  }
  mem_free(last[0]);
  mem_free(last[1]);
  CHECK_MSG(worst > 50, "worst frame %.1f dB", worst);
  CHECK_MSG(traced < 0.3, "%.3f traced", traced);
  CHECK_MSG(flickering <= frames, "%d values flicker", flickering);
}

TEST(threads_and_sizes_make_no_difference)
{
  const int sizes[][2] = {{1, 1}, {2, 1}, {1, 9}, {7, 5}, {8, 8}, {9, 9}, {16, 17}, {33, 40}, {257, 31}, {3, 200}};
  for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++)
    for (int block = 4; block <= 16; block *= 2) {
      Show show = {.time = 2, .width = sizes[i][0], .height = sizes[i][1]};
      const size_t pixels = (size_t)show.width * (size_t)show.height;
      SubsampleSettings settings = subsample_defaults();
      const SubsampleSettings all = whole();
      settings.block = block;
      SubsampleStats one, many;
      uint8_t *a = run(&show, &settings, 1, &one), *b = run(&show, &settings, 4, &many), *full = run(&show, &all, 1, NULL);
      CHECK(!memcmp(a, b, 4 * pixels) && one.traced == many.traced && one.mixed == many.mixed);
      CHECK(one.traced <= pixels);
      CHECK_MSG(psnr(a, full, pixels) > 30, "%d x %d, block %d: %.1f dB", show.width, show.height, block,
                psnr(a, full, pixels));
      mem_free(a);
      mem_free(b);
      mem_free(full);
    }
}

// --- rules, each by the smallest picture that needs it ---------------------------------------------
static void flat_trace(void *user, const SubsamplePixel *pixels, size_t count, SubsampleResult *out, int worker)
{
  Show *show = user;
  (void)worker, (void)pixels;
  show->asked += (int)count;
  for (size_t i = 0; i < count; i++) out[i] = (SubsampleResult){{0.5f, 0.25f, 1}, 7, 0};
}

static void ramp_trace(void *user, const SubsamplePixel *pixels, size_t count, SubsampleResult *out, int worker)
{
  (void)user, (void)worker;
  for (size_t i = 0; i < count; i++)
    out[i] = (SubsampleResult){{0.0038f * pixels[i].x, 0.5f, 0.003f * pixels[i].y + 0.1f}, 7, 0};
}

// A spot of a pixel, in colour or (of another signature) in name only, at (show->time, 20).
static void spot_trace(void *user, const SubsamplePixel *pixels, size_t count, SubsampleResult *out, int worker)
{
  Show *show = user;
  (void)worker;
  for (size_t i = 0; i < count; i++) {
    const bool is_spot = pixels[i].x == (int)show->time && pixels[i].y == 20;
    out[i] = (SubsampleResult){{is_spot ? 1.0f : 0.5f, 0.5f, 0.5f}, 7, 0};
  }
}

static void step_trace(void *user, const SubsamplePixel *pixels, size_t count, SubsampleResult *out, int worker)
{
  (void)user, (void)worker;
  for (size_t i = 0; i < count; i++) out[i] = (SubsampleResult){{0.5f, 0.5f, 0.5f}, pixels[i].x < 19, 0};
}

TEST(equal_colours_need_corners_and_centres)
{
  Show show = {.width = 65, .height = 65};
  const SubsampleSettings settings = subsample_defaults();
  SubsampleStats stats;
  uint8_t *rgba = run_on(flat_trace, &show, &settings, 2, &stats);
  // 9 x 9 corners; 64 centres, and those of the last row and column, whose blocks are a pixel wide.
  CHECK_MSG(stats.traced == 81 + 64 + 16, "%d traced", (int)stats.traced);
  CHECK(stats.equal == 65 * 65 && stats.mixed == 0 && rgba[0] == 128 && rgba[4 * 65 * 65 - 2] == 255);
  mem_free(rgba);
}

TEST(ramps_are_exact)
{
  Show show = {.width = 120, .height = 90};
  const SubsampleSettings settings = subsample_defaults(), all = whole();
  SubsampleStats stats;
  uint8_t *mine = run_on(ramp_trace, &show, &settings, 2, &stats), *full = run_on(ramp_trace, &show, &all, 2, NULL);
  for (int i = 0; i < 4 * 120 * 90; i++) CHECK(abs(mine[i] - full[i]) <= 1);
  CHECK(stats.traced < 120 * 90 / 20);
  mem_free(mine);
  mem_free(full);
}

TEST(centres_are_looked_at)
{
  SubsampleSettings settings = subsample_defaults();
  for (int has_probe = 0; has_probe <= 1; has_probe++) {
    Show show = {.time = 20, .width = 64, .height = 64}; // (20, 20) is the centre of a block of 8
    settings.has_probe = has_probe;
    uint8_t *rgba = run_on(spot_trace, &show, &settings, 1, NULL);
    CHECK((rgba[4 * (20 * 64 + 20)] == 255) == has_probe);
    mem_free(rgba);
  }
}

// Colours alike, paths not: cut down to where the signature changes.
TEST(signatures_count)
{
  Show show = {.width = 64, .height = 64};
  const SubsampleSettings settings = subsample_defaults();
  SubsampleStats stats;
  uint8_t *rgba = run_on(step_trace, &show, &settings, 1, &stats);
  CHECK_MSG(stats.traced > 64 * 4, "%d traced", (int)stats.traced);
  mem_free(rgba);
}

// A spot in the middle of a block's edge: its neighbour below was cut there for another reason and traced it.
static void edge_trace(void *user, const SubsamplePixel *pixels, size_t count, SubsampleResult *out, int worker)
{
  (void)user, (void)worker;
  for (size_t i = 0; i < count; i++) {
    const int x = pixels[i].x, y = pixels[i].y;
    const bool is_other = x == 20 && y == 28, is_bump = x == 20 && y >= 22 && y <= 26;
    out[i] = (SubsampleResult){{is_bump ? 1.0f : 0.5f, 0.5f, 0.5f}, is_other, 0};
  }
}

TEST(edges_are_looked_at)
{
  SubsampleSettings settings = subsample_defaults();
  for (int has_round = 0; has_round <= 1; has_round++) {
    Show show = {.width = 64, .height = 64};
    settings.has_round = has_round;
    uint8_t *rgba = run_on(edge_trace, &show, &settings, 1, NULL);
    // (20, 24) is traced by the block below, whose centre is other; (20, 22) belongs to the block above.
    CHECK(rgba[4 * (24 * 64 + 20)] == 255 && (rgba[4 * (22 * 64 + 20)] == 255) == has_round);
    mem_free(rgba);
  }
}

TEST(blocks_can_be_shown)
{
  Show show = {.time = 1, .width = 200, .height = 150};
  SubsampleSettings settings = subsample_defaults();
  SubsampleStats plain, shown;
  uint8_t *a = run(&show, &settings, 1, &plain);
  settings.shows_blocks = true;
  uint8_t *b = run(&show, &settings, 1, &shown);
  size_t same = 0;
  for (size_t i = 0; i < 200 * 150; i++) same += !memcmp(a + 4 * i, b + 4 * i, 4);
  CHECK(same == plain.traced && plain.traced == shown.traced);
  mem_free(a);
  mem_free(b);
}

static void cancel_trace(void *user, const SubsamplePixel *pixels, size_t count, SubsampleResult *out, int worker)
{
  Cancel *cancel = user;
  (void)worker, (void)pixels;
  for (size_t i = 0; i < count; i++) out[i] = (SubsampleResult){.signature = pixels[i].x};
  atomic_store(&cancel->requested, true);
}

TEST(it_can_be_cancelled)
{
  Err err = {0};
  Cancel cancel = {false};
  Jobs *jobs = jobs_create(3, &err);
  Subsampler *s = subsampler_create(640, 480, &err);
  uint8_t *rgba = mem_zero(640 * 480, 4);
  const SubsampleSettings settings = subsample_defaults();
  SubsampleStats stats;
  CHECK(!subsampler_run(s, &settings, cancel_trace, &cancel, jobs, &cancel, rgba, NULL, &stats) && stats.traced < 640 * 480 / 2);
  mem_free(rgba);
  subsampler_destroy(s);
  jobs_destroy(jobs);
}

TEST_MAIN
