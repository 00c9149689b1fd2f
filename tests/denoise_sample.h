// What the tests of denoising share: a scene rendered with few and with many samples, and how far pictures are apart.

#ifndef RAYFOLD_TESTS_DENOISE_SAMPLE_H
#define RAYFOLD_TESTS_DENOISE_SAMPLE_H

#include "tests/render_sample.h"

#include "post/guided.h"

typedef struct Shot {
  Guided guided;
  float *planes; // owned
} Shot;

static inline Shot shot_of_planes(uint32_t width, uint32_t height)
{
  const size_t n = (size_t)width * height;
  float *p = mem_zero(n, 12 * sizeof *p);
  return (Shot){{width, height, p, p + 4 * n, p + 7 * n, p + 10 * n, p + 11 * n}, p};
}

static inline Shot shot_render(uint32_t width, uint32_t height, uint32_t spp)
{
  Err err = {0};
  Scene *s = rich_scene();
  World *w = world_of(s);
  Film *f = film_create(width, height, ALL_PLANES, &err);
  Jobs *jobs = jobs_create(0, &err);
  RenderJob job = job_of(s, w, pinhole(0, 0.6f, 4, 0, -0.3f, 0, 40), f, spp);
  RenderStats stats;
  CHECK_MSG(render_run(&job, jobs, hot_table(cpu_best_isa()), NULL, &stats, &err), "%s", err.text);
  Shot shot = shot_of_planes(width, height);
  film_resolve(f, FILM_BEAUTY, (float *)shot.guided.color);
  film_resolve(f, FILM_ALBEDO, (float *)shot.guided.albedo);
  film_resolve(f, FILM_NORMAL, (float *)shot.guided.normal);
  film_resolve(f, FILM_DEPTH, (float *)shot.guided.depth);
  film_resolve(f, FILM_VARIANCE, (float *)shot.guided.variance);
  jobs_destroy(jobs);
  film_destroy(f);
  world_release(w);
  scene_destroy(s);
  return shot;
}

// Peak signal-to-noise ratio in decibels, of colours clipped to 0..1 and taken to display values.
static inline double psnr(const float *a, const float *b, size_t pixels)
{
  double sum = 0;
  for (size_t i = 0; i < 4 * pixels; i++) {
    if (i % 4 == 3) continue;
    const double d = pow(fmin((double)a[i], 1), 1 / 2.2) - pow(fmin((double)b[i], 1), 1 / 2.2);
    sum += d * d;
  }
  return -10 * log10(sum / (3 * (double)pixels));
}

// Puts what no picture should hold into every plane, here and there.
static inline void shot_spoil(Shot *shot)
{
  static const float odd[] = {NAN, INFINITY, -INFINITY, -1, 1e38f, -1e38f, 1e-40f};
  const size_t n = (size_t)shot->guided.width * shot->guided.height * 12;
  for (size_t i = 0; i < n; i += 5) shot->planes[i] = odd[i / 5 % 7];
}

static inline bool is_all_finite(const float *x, size_t n)
{
  for (size_t i = 0; i < n; i++)
    if (!isfinite(x[i]) || x[i] < 0) return false;
  return true;
}

// One colour all over, on a wall that faces the eye.
static inline Shot shot_constant(uint32_t width, uint32_t height, float r, float g, float b)
{
  Shot shot = shot_of_planes(width, height);
  const size_t n = (size_t)width * height;
  for (size_t i = 0; i < n; i++) {
    float *const pixel = shot.planes + 4 * i, *const albedo = shot.planes + 4 * n + 3 * i;
    pixel[0] = r;
    pixel[1] = g;
    pixel[2] = b;
    pixel[3] = 1;
    albedo[0] = albedo[1] = albedo[2] = 0.5f;
    shot.planes[7 * n + 3 * i + 2] = 1;
    shot.planes[10 * n + i] = 3;
  }
  return shot;
}

#endif
