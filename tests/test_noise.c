// Sampling until a noise target: cells stop by themselves, the picture is still a function of world, eye, settings and
// seed alone, and stopping early bends no mean.

#include "tests/test.h"

#include "tests/render_sample.h"

#include "base/cpu.h"

enum { WIDTH = 75, HEIGHT = 60, MOST = 2048, PLANES = 1 << FILM_VARIANCE };

typedef struct Subject {
  Scene *scene;
  World *world;
  Eye eye;
} Subject;

// A ball in the half shade of a lamp, in the middle of a floor; around it an even sky that has no noise at all.
static Subject subject_begin(void)
{
  Subject s = {.scene = new_scene(0.5f)};
  const int32_t grey = add_lambert(s.scene, 0.6f, 0.6f, 0.6f);
  add_sphere(s.scene, grey, 0, 0, 0, 0.5f);
  add_quad(s.scene, grey, 0, -0.5f, 0, -90, 0, 1.6f);
  add_quad(s.scene, add_glow(s.scene, 8, true), 1.2f, 1, 0.5f, 50, 40, 0.6f);
  s.world = world_of(s.scene);
  s.eye = pinhole(0, 1, 4, 0, -0.1f, 0, 50);
  return s;
}

static void subject_finish(Subject *s)
{
  world_release(s->world);
  scene_destroy(s->scene);
}

static RenderJob job_for(const Subject *s, Film *f, double noise, uint64_t seed)
{
  return (RenderJob){.world = s->world, .eye = s->eye, .settings = s->scene->render, .seed = seed, .film = f,
                     .end_sample = MOST, .noise_target = noise};
}

static Film *new_film(void)
{
  Film *f = film_create(WIDTH, HEIGHT, PLANES, NULL);
  CHECK(f);
  return f;
}

static RenderStats render(const RenderJob *job, Jobs *jobs, IsaLevel level)
{
  RenderStats stats;
  Err err = {0};
  CHECK_MSG(render_run(job, jobs, hot_table(level), NULL, &stats, &err), "%s", err.text);
  return stats;
}

TEST(cells_stop_by_themselves)
{
  Subject s = subject_begin();
  Film *f = new_film();
  const RenderJob job = job_for(&s, f, 0.03, 1);
  const RenderStats stats = render(&job, NULL, cpu_best_isa());
  float noise[64];
  CHECK(stats.is_complete && stats.quiet == 1 && film_noise(f, noise) <= 0.03);
  uint32_t least = UINT32_MAX, most = 0;
  for (uint32_t i = 0; i < film_cells(f); i++) {
    const CellBox b = film_cell_box(f, i);
    const uint32_t n = f->count[b.y0 * WIDTH + b.x0];
    CHECK(noise[i] <= 0.03f);
    for (uint32_t y = b.y0; y < b.y1; y++)
      for (uint32_t x = b.x0; x < b.x1; x++) CHECK(f->count[y * WIDTH + x] == n);
    if (n < least) least = n;
    if (n > most) most = n;
  }
  CHECK_MSG(least == 32 && most >= 64 && most == stats.samples, "%u to %u samples", least, most);
  CHECK(stats.mean_samples > least && stats.mean_samples < most);
  film_destroy(f);
  subject_finish(&s);
}

// Calls cut short after every pass, as a kept film's are by its clock.
static RenderGo stop_soon(void *user, const RenderProgress *p)
{
  (void)p;
  return ++*(int *)user % 3 ? RENDER_GO_ON : RENDER_STOP_AFTER_PASS;
}

TEST(the_picture_depends_on_nothing_else)
{
  Subject s = subject_begin();
  Film *f = new_film();
  RenderJob job = job_for(&s, f, 0.05, 3);
  render(&job, NULL, cpu_best_isa());
  const uint64_t truth = film_hash(f);
  Jobs *jobs = jobs_create(3, NULL);
  const uint32_t sizes[2] = {7, 64};
  for (int i = 0; i < 2; i++) {
    film_clear(f);
    job.tile_size = sizes[i];
    render(&job, jobs, i ? ISA_REF : cpu_best_isa());
    CHECK(film_hash(f) == truth);
  }
  // Gone on with again and again, and cut short by a budget, where a pass may end before its stop.
  film_clear(f);
  int calls = 0, rounds = 0;
  job.progress = stop_soon;
  job.user = &calls;
  RenderStats stats = {0};
  for (; !stats.is_complete && rounds < 1000; rounds++) {
    job.budget_seconds = rounds % 2 ? 1e-3 : 0;
    stats = render(&job, jobs, cpu_best_isa());
  }
  CHECK(film_hash(f) == truth && rounds > 3);
  jobs_destroy(jobs);
  // A lower target goes on from there; a higher one has nothing to do.
  job.progress = NULL;
  job.budget_seconds = 0;
  job.noise_target = 0.1;
  CHECK(render(&job, NULL, cpu_best_isa()).mean_samples == 0 && film_hash(f) == truth);
  job.noise_target = 0.04;
  CHECK(render(&job, NULL, cpu_best_isa()).mean_samples > 0 && film_noise(f, NULL) <= 0.04);
  film_destroy(f);
  subject_finish(&s);
}

TEST(an_adaptive_film_is_filled_up_to_the_whole)
{
  Subject s = subject_begin();
  Film *whole = new_film(), *f = new_film();
  RenderJob plain = job_for(&s, whole, 0, 5), job = job_for(&s, f, 0.1, 5);
  render(&job, NULL, cpu_best_isa());
  plain.end_sample = 192;
  render(&plain, NULL, cpu_best_isa());
  CHECK(film_hash(f) != film_hash(whole));
  job.noise_target = 0;
  job.end_sample = 192;
  render(&job, NULL, cpu_best_isa());
  CHECK(film_hash(f) == film_hash(whole) && f->ranges.count == whole->ranges.count);
  film_destroy(whole);
  film_destroy(f);
  subject_finish(&s);
}

TEST(parts_of_a_picture_make_the_whole)
{
  Subject s = subject_begin();
  Film *whole = new_film(), *sum = new_film();
  RenderJob job = job_for(&s, whole, 0, 2);
  job.end_sample = 6;
  render(&job, NULL, cpu_best_isa());
  job.parts = 7;
  const uint32_t cuts[4][2] = {{5, 7}, {0, 1}, {1, 3}, {3, 5}};
  for (int i = 0; i < 4; i++) {
    Film *part = job.film = new_film();
    job.part = cuts[i][0];
    job.part_end = cuts[i][1];
    render(&job, NULL, cpu_best_isa());
    CHECK(film_merge(sum, part, NULL));
    const uint64_t before = film_hash(sum);
    Err err = {0};
    CHECK(!film_merge(sum, part, &err) && film_hash(sum) == before);
    CHECK_TEXT(err.text, "in the film already");
    film_destroy(part);
  }
  CHECK(film_hash(sum) == film_hash(whole) && sum->ranges.count == whole->ranges.count);
  film_destroy(sum);
  film_destroy(whole);
  subject_finish(&s);
}

TEST(what_cannot_be_is_refused)
{
  Subject s = subject_begin();
  Film *f = new_film();
  RenderJob job = job_for(&s, f, 0.1, 1);
  Err parts = {0}, gap = {0}, none = {0};
  job.parts = 4;
  job.part_end = 2;
  CHECK(!render_run(&job, NULL, hot_table(ISA_REF), NULL, NULL, &parts));
  CHECK_TEXT(parts.text, "whole picture");
  job.part = 2;
  CHECK(!render_run(&job, NULL, hot_table(ISA_REF), NULL, NULL, &none));
  CHECK_TEXT(none.text, "parts 2 to 2 of 4 are none");
  job.parts = 0;
  CHECK(film_claim(f, 8, 12, NULL));
  CHECK(!render_run(&job, NULL, hot_table(ISA_REF), NULL, NULL, &gap));
  CHECK_TEXT(gap.text, "samples 8 to 12 by themselves");
  film_destroy(f);
  subject_finish(&s);
}

static double mean_of(const Film *f)
{
  double sum = 0;
  for (size_t i = 0; i < WIDTH * HEIGHT; i++) sum += (double)f->moments[i].sum * 0x1p-28 / f->count[i];
  return sum / (WIDTH * HEIGHT);
}

// A cell that stops because it looks quiet is one that has seen little: too dark, if neighbours did not mind it.
TEST(stopping_early_bends_no_mean)
{
  Subject s = subject_begin();
  Film *f = new_film();
  Jobs *jobs = jobs_create(2, NULL);
  const int rounds = (int)(TEST_IS_SLOW ? 4 : 12 * test_intensity());
  double mean = 0, squares = 0, truth = 0;
  for (int i = 0; i < rounds; i++) {
    film_clear(f);
    RenderJob job = job_for(&s, f, 0.1, 100 + (uint64_t)i);
    render(&job, jobs, cpu_best_isa());
    const double m = mean_of(f);
    mean += m / rounds;
    squares += m * m / rounds;
  }
  film_clear(f);
  RenderJob job = job_for(&s, f, 0, 7);
  job.end_sample = (uint32_t)fmin(512 * test_intensity(), 32768);
  render(&job, jobs, cpu_best_isa());
  truth = mean_of(f);
  const double sigma = sqrt(fmax(squares - mean * mean, 0) / rounds);
  printf("  mean of %d adaptive pictures against the truth: %+.4f %% (sigma %.4f %%)\n", rounds,
         100 * (mean / truth - 1), 100 * sigma / truth);
  CHECK_NEAR(mean / truth, 1, 0.003);
  jobs_destroy(jobs);
  film_destroy(f);
  subject_finish(&s);
}

TEST_MAIN
