// The fast denoiser: what it must leave alone, what it must bring, and one picture whatever the level and the threads.

#include "tests/denoise_sample.h"

#include "post/denoise_fast.h"

static const PostKernels *best(void)
{
  return &hot_table(cpu_best_isa())->post;
}

static void denoise_with(const Shot *s, const PostKernels *kernels, int threads, float *out)
{
  Err err = {0};
  Jobs *jobs = jobs_create(threads, &err);
  CHECK_MSG(denoise_fast(&s->guided, kernels, NULL, jobs, NULL, out, &err), "%s", err.text);
  jobs_destroy(jobs);
}

// Measured: 29.6 dB become 34.8.
TEST(four_samples_come_nearer_to_many)
{
  enum { W = 240, H = 160 };
  Shot noisy = shot_render(W, H, 4), truth = shot_render(W, H, TEST_IS_SLOW ? 64 : 128);
  float *out = mem_alloc(W * H, 4 * sizeof *out);
  denoise_with(&noisy, best(), 2, out);
  const double before = psnr(noisy.guided.color, truth.guided.color, W * H),
               after = psnr(out, truth.guided.color, W * H);
  printf("     %.1f dB before, %.1f dB after\n", before, after);
  CHECK_MSG(after > before + 4, "%.2f dB before, %.2f dB after", before, after);
  mem_free(out);
  mem_free(noisy.planes);
  mem_free(truth.planes);
}

TEST(a_constant_stays)
{
  static const uint32_t sizes[][2] = {{1, 1}, {1, 7}, {5, 1}, {2, 2}, {67, 35}};
  for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++) {
    const uint32_t w = sizes[k][0], h = sizes[k][1];
    Shot s = shot_constant(w, h, 0.7f, 0.2f, 30);
    float *out = mem_alloc(w * h, 4 * sizeof *out);
    denoise_with(&s, best(), 2, out);
    for (size_t i = 0; i < 4 * (size_t)w * h; i++)
      CHECK_NEAR(out[i], s.guided.color[i], 1e-5f * s.guided.color[i]);
    mem_free(out);
    mem_free(s.planes);
  }
}

TEST(nonsense_comes_out_finite)
{
  Shot s = shot_render(61, 43, 1);
  float *out = mem_alloc(61 * 43, 4 * sizeof *out);
  shot_spoil(&s);
  denoise_with(&s, best(), 1, out);
  CHECK(is_all_finite(out, 4 * 61 * 43));
  mem_free(out);
  mem_free(s.planes);
}

TEST(one_picture_on_all_levels_and_threads)
{
  enum { W = 93, H = 71 };
  Shot s = shot_render(W, H, 2);
  float *want = mem_alloc(W * H, 4 * sizeof *want), *out = mem_alloc(W * H, 4 * sizeof *out);
  denoise_with(&s, &hot_table(ISA_REF)->post, 1, want);
  for (int level = ISA_REF; level <= (int)cpu_best_isa(); level++)
    for (int threads = 1; threads <= 5; threads += 2) {
      denoise_with(&s, &hot_table((IsaLevel)level)->post, threads, out);
      CHECK_MSG(!memcmp(out, want, W * H * 4 * sizeof *out), "%s on %d threads", isa_names[level], threads);
    }
  mem_free(out);
  mem_free(want);
  mem_free(s.planes);
}

// Two walls at an angle, one lit and one dark: no light passes over the edge.
TEST(an_edge_of_the_scene_stays_sharp)
{
  enum { W = 64, H = 32 };
  Shot s = shot_constant(W, H, 1, 1, 1);
  for (uint32_t i = 0; i < W * H; i++) {
    if (i % W < W / 2) continue;
    float *const normal = s.planes + 7 * W * H + 3 * i;
    normal[0] = 1;
    normal[2] = 0;
    for (int k = 0; k < 3; k++) s.planes[4 * i + k] = 0.01f;
    s.planes[11 * W * H + i] = 1; // noisy enough that light alone is no edge
  }
  float *out = mem_alloc(W * H, 4 * sizeof *out);
  denoise_with(&s, best(), 1, out);
  for (uint32_t i = 0; i < 4 * W * H; i++) CHECK_NEAR(out[i], s.guided.color[i], 1e-5f);
  mem_free(out);
  mem_free(s.planes);
}

TEST(cancel_and_no_memory)
{
  Shot s = shot_constant(16, 16, 1, 1, 1);
  float out[16 * 16 * 4];
  Cancel cancel = {true};
  Err err = {0};
  CHECK(!denoise_fast(&s.guided, best(), NULL, NULL, &cancel, out, &err) && err.kind == ERR_CANCELLED);
  err = (Err){0};
  mem_fail_after(1);
  CHECK(!denoise_fast(&s.guided, best(), NULL, NULL, NULL, out, &err) && err.kind == ERR_NO_MEMORY);
  mem_fail_after(0);
  mem_free(s.planes);
}

TEST_MAIN
