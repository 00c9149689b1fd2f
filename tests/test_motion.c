// Tests of blur by motion, through the public interface: what a moving light leaves on a film against the closed form,
// and that a picture of moving things depends on threads and splits as little as any other.

#include "rayfold/rayfold.h"

#include "tests/model.h"
#include "tests/test.h"

#include <math.h>
#include <string.h>

enum { WIDTH = 32, HEIGHT = 4 };

// A pixel is a metre wide. A bar of 4 m shines at 1 and goes from -6 to 6 in one second, which is one frame.
#define BAR(more) \
  "{ \"rayfold\": 1, \"render\": { \"size\": [32, 4], \"filter\": \"box\", \"max_depth\": 0, \"motion_steps\": 64 }," \
  "\"camera\": { \"kind\": \"orthographic\", \"position\": [0, 0, 5], \"target\": [0, 0, 0], \"height\": 4, "        \
  "\"shutter\": 1 }, \"materials\": { \"light\": { \"kind\": \"emission\" } }, \"timeline\": { \"fps\": 1 },"        \
  "\"objects\": [ { \"name\": \"bar\", \"shape\": { \"kind\": \"quad\", \"size\": [4, 10] }, \"material\": \"light\" } ]," \
  "\"animation\": [ " more " ] }"
#define MOVES                                                                                                  \
  "{ \"path\": \"objects.bar.translate.x\", \"keys\": [ { \"time\": 0, \"value\": -6 }, { \"time\": 1, \"value\": 6 } ] }"
#define CAMERA_MOVES                                                                                                  \
  "{ \"path\": \"camera.position.x\", \"keys\": [ { \"time\": 0, \"value\": 6 }, { \"time\": 1, \"value\": -6 } ] },"  \
  "{ \"path\": \"camera.target.x\", \"keys\": [ { \"time\": 0, \"value\": 6 }, { \"time\": 1, \"value\": -6 } ] }"

static rf_engine *engine_of(int threads)
{
  rf_engine_def def = rf_default_engine_def();
  def.threads = threads;
  rf_engine *e = rf_engine_create(&def);
  if (!e) abort();
  return e;
}

static rf_scene *load(rf_engine *e, const char *text)
{
  rf_scene *s = rf_scene_load(e, model_write("motion.json", text, strlen(text)), NULL);
  const char *why;
  if (!s) rf_error(e, &why);
  CHECK_MSG(s, "%s", why);
  return s;
}

// Samples [first, end) of the moment into a film.
static rf_film *shoot(rf_engine *e, rf_scene *s, double moment, int first, int end, int *steps)
{
  rf_shot *shot = rf_shot_prepare(s, NULL, NULL, (float)WIDTH / HEIGHT, moment);
  rf_film *f = rf_film_create(e, WIDTH, HEIGHT, RF_BEAUTY);
  rf_render_def def = rf_scene_render_def(s, NULL, NULL);
  def.first_sample = first;
  def.end_sample = end;
  CHECK(shot && f && rf_shot_render(shot, &def, f, NULL) == RF_OK);
  if (steps) *steps = rf_shot_steps(shot);
  rf_shot_destroy(shot);
  return f;
}

// The area of the bar's time on [.., x], in pixels: the mean over its way of how much of [-inf, x] it covers.
static double swept(double x)
{
  double sum = 0;
  const int n = 4000;
  for (int i = 0; i < n; i++) {
    const double c = -6 + 12 * (i + 0.5) / n, covered = x - (c - 2);
    sum += covered < 0 ? 0 : covered > 4 ? 4 : covered;
  }
  return sum / n;
}

static void check_bar(const char *text)
{
  rf_engine *e = engine_of(2);
  rf_scene *s = load(e, text);
  int steps = 0;
  rf_film *f = shoot(e, s, 0.5, 0, 2048, &steps);
  rf_image img;
  CHECK(steps == 64);
  if (rf_film_plane(f, RF_BEAUTY, &img)) {
    for (int x = 0; x < WIDTH; x++) {
      double mean = 0;
      for (int y = 0; y < HEIGHT; y++) mean += (double)img.pixels[4 * (y * WIDTH + x)] / HEIGHT;
      CHECK_NEAR(mean, swept(x - WIDTH / 2 + 1) - swept(x - WIDTH / 2), 0.008);
    }
    rf_image_free(&img);
  }
  rf_film_destroy(f);
  rf_scene_destroy(s);
  rf_engine_destroy(e);
}

TEST(a_moving_light_is_on_each_pixel_as_long_as_it_was_there)
{
  check_bar(BAR(MOVES));
}

TEST(a_moving_eye_sees_the_same)
{
  check_bar(BAR(CAMERA_MOVES));
}

TEST(few_samples_are_spread_over_the_whole_time)
{
  // 16 of 64 steps: every fourth place of the bar, so a pixel in the middle of its way is lit a third of the time.
  rf_engine *e = engine_of(1);
  rf_scene *s = load(e, BAR(MOVES));
  rf_film *f = shoot(e, s, 0.5, 0, 16, NULL);
  rf_image img;
  if (rf_film_plane(f, RF_BEAUTY, &img)) {
    for (int x = 12; x < 20; x++) CHECK_NEAR(img.pixels[4 * x], 4 / 12.0, 1.01 / 16);
    rf_image_free(&img);
  }
  rf_film_destroy(f);
  rf_scene_destroy(s);
  rf_engine_destroy(e);
}

static uint64_t picture(int threads, const char *text, double moment, const int *cuts, int count)
{
  rf_engine *e = engine_of(threads);
  rf_scene *s = load(e, text);
  rf_film *all = NULL;
  for (int i = 0; i + 1 < count; i++) {
    rf_film *part = shoot(e, s, moment, cuts[i], cuts[i + 1], NULL);
    if (all) CHECK(rf_film_merge(all, part));
    if (all) rf_film_destroy(part);
    else all = part;
  }
  const uint64_t hash = rf_film_hash(all);
  rf_film_destroy(all);
  rf_scene_destroy(s);
  rf_engine_destroy(e);
  return hash;
}

TEST(threads_and_splits_make_no_difference)
{
  static const int whole[] = {0, 40}, parts[] = {0, 1, 7, 24, 40};
  const char *text = BAR(MOVES);
  const uint64_t hash = picture(1, text, 0.4, whole, 2);
  CHECK(hash == picture(3, text, 0.4, whole, 2) && hash == picture(2, text, 0.4, parts, 5));
  CHECK(hash != picture(1, text, 0.6, whole, 2));
}

TEST(what_stands_still_is_not_touched)
{
  // Beyond its last key nothing moves: one step, and the picture of rf_render().
  rf_engine *e = engine_of(1);
  rf_scene *s = load(e, BAR(MOVES));
  int steps = 0;
  rf_film *f = shoot(e, s, 5, 0, 16, &steps), *plain = rf_film_create(e, WIDTH, HEIGHT, RF_BEAUTY);
  rf_world *w = rf_prepare(s, NULL);
  rf_render_def def = rf_scene_render_def(s, NULL, NULL);
  rf_eye eye;
  def.end_sample = 16;
  CHECK(w && rf_camera(s, w, NULL, 8, &eye) && rf_render(w, &eye, &def, plain, NULL) == RF_OK);
  CHECK(steps == 1 && rf_film_hash(f) == rf_film_hash(plain));
  rf_film_destroy(f);
  // A closed shutter likewise.
  CHECK(rf_set(s, "camera.shutter", "0"));
  f = shoot(e, s, 0.5, 0, 16, &steps);
  CHECK(steps == 1);
  rf_film_destroy(f);
  rf_film_destroy(plain);
  rf_world_destroy(w);
  rf_scene_destroy(s);
  rf_engine_destroy(e);
}

TEST(the_interface_refuses_what_makes_no_sense)
{
  rf_engine *e = engine_of(1);
  rf_scene *s = load(e, BAR(MOVES));
  double start, end, fps;
  CHECK(rf_animation_range(s, &start, &end, &fps) && start == 0 && end == 1 && fps == 1);
  CHECK(!rf_set_time(s, (double)NAN) && rf_error(e, NULL) == RF_BAD_ARGUMENT);
  CHECK(!rf_set_time(NULL, 0) && !rf_shot_prepare(NULL, NULL, NULL, 1, 0));
  CHECK(!rf_shot_prepare(s, NULL, "nowhere", 1, 0) && rf_error(e, NULL) == RF_BAD_SCENE);
  CHECK(rf_shot_render(NULL, NULL, NULL, NULL) == RF_BAD_ARGUMENT && !rf_shot_world(NULL) && !rf_shot_steps(NULL));
  rf_shot_destroy(NULL);
  rf_scene_destroy(s);
  rf_engine_destroy(e);
  model_clean((const char *const[]){"motion.json"}, 1);
}

TEST_MAIN
