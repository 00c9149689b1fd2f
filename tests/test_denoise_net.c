// The network with its authors' weights. Without them (tools/denoiser.sh gets them) the test is skipped.

#include "tests/denoise_sample.h"

#include "post/denoise_net.h"
#include "post/weights.h"

static const char *const files[] = {"rt_hdr_alb_nrm_small.tza", "rt_hdr_alb_nrm.tza"};

static const PostKernels *best(void)
{
  return &hot_table(cpu_best_isa())->post;
}

static Unet network(int which)
{
  Unet u;
  Err err = {0};
  CHECK_MSG(weights_load(&u, NULL, files[which], &err), "%s", err.text);
  return u;
}

static void denoise_with(const Shot *s, const Unet *net, size_t tile, const PostKernels *kernels, int threads,
                         float *out)
{
  Err err = {0};
  Jobs *jobs = jobs_create(threads, &err);
  CHECK_MSG(denoise_net(&s->guided, net, tile, kernels, jobs, NULL, out, &err), "%s", err.text);
  jobs_destroy(jobs);
}

TEST(four_samples_come_much_nearer_to_many)
{
  enum { W = TEST_IS_SLOW ? 72 : 240, H = TEST_IS_SLOW ? 48 : 160 };
  Shot noisy = shot_render(W, H, 4), truth = shot_render(W, H, TEST_IS_SLOW ? 64 : 128);
  float *out = mem_alloc(W * H, 4 * sizeof *out);
  const double before = psnr(noisy.guided.color, truth.guided.color, W * H);
  for (int which = 0; which < 2; which++) {
    Unet net = network(which);
    denoise_with(&noisy, &net, 0, best(), 2, out);
    const double after = psnr(out, truth.guided.color, W * H);
    printf("     %s: %.1f dB before, %.1f dB after\n", files[which], before, after);
    CHECK_MSG(after > before + (TEST_IS_SLOW ? 3 : 6), "%s: %.2f dB before, %.2f dB after", files[which],
              before, after);
    unet_finish(&net);
  }
  mem_free(out);
  mem_free(noisy.planes);
  mem_free(truth.planes);
}

// The tiles overlap by more than the network sees, so cutting changes no bit; nor do threads.
TEST(tiles_and_threads_change_nothing)
{
  enum { W = 525, H = 70 };
  if (TEST_IS_SLOW) return;
  Shot s = shot_render(W, H, 2);
  Unet net = network(0);
  float *want = mem_alloc(W * H, 4 * sizeof *want), *out = mem_alloc(W * H, 4 * sizeof *out);
  denoise_with(&s, &net, 0, best(), 1, want);
  denoise_with(&s, &net, 0, best(), 3, out);
  CHECK(!memcmp(out, want, W * H * 4 * sizeof *out));
  denoise_with(&s, &net, 320 * 80, best(), 2, out);
  CHECK(!memcmp(out, want, W * H * 4 * sizeof *out));
  unet_finish(&net);
  mem_free(out);
  mem_free(want);
  mem_free(s.planes);
}

// Levels that fuse sums agree to the bit; all agree to rounding.
TEST(levels_agree)
{
  enum { W = 50, H = 40 };
  Shot s = shot_render(W, H, 2);
  Unet net = network(0);
  float *want = mem_alloc(W * H, 4 * sizeof *want), *out = mem_alloc(W * H, 4 * sizeof *out);
  denoise_with(&s, &net, 0, &hot_table(ISA_REF)->post, 2, want);
  for (int level = ISA_V2; level <= (int)cpu_best_isa(); level++) {
    denoise_with(&s, &net, 0, &hot_table((IsaLevel)level)->post, 2, out);
    for (size_t i = 0; i < 4 * W * H; i++)
      CHECK_MSG(fabsf(out[i] - want[i]) <= 1e-4f * want[i] + 1e-5f, "%s: %g against %g", isa_names[level],
                (double)out[i], (double)want[i]);
    if (level == ISA_V4) {
      denoise_with(&s, &net, 0, &hot_table(ISA_V3)->post, 2, want);
      CHECK(!memcmp(out, want, W * H * 4 * sizeof *out));
    }
  }
  unet_finish(&net);
  mem_free(out);
  mem_free(want);
  mem_free(s.planes);
}

// Within 3 % in the mean (the network is unsure near a picture's corners), and whatever the picture's brightness:
// exposure is found, not assumed.
TEST(a_constant_nearly_stays)
{
  Unet net = network(0);
  for (float gain = 1e-3f; gain < 2e3f; gain *= 1e3f) {
    Shot s = shot_constant(67, 35, 0.5f * gain, 0.4f * gain, 0.3f * gain);
    float *out = mem_alloc(67 * 35, 4 * sizeof *out);
    denoise_with(&s, &net, 0, best(), 2, out);
    double sum[4] = {0};
    for (size_t i = 0; i < 4 * 67 * 35; i++) {
      CHECK_NEAR(out[i], s.guided.color[i], 0.5f * s.guided.color[i]);
      sum[i % 4] += (double)out[i] / (67 * 35);
    }
    for (size_t k = 0; k < 4; k++) CHECK_NEAR(sum[k], s.guided.color[k], 0.03f * s.guided.color[k]);
    mem_free(out);
    mem_free(s.planes);
  }
  unet_finish(&net);
}

TEST(nonsense_comes_out_finite)
{
  Unet net = network(1);
  Shot s = shot_render(61, 43, 1);
  float *out = mem_alloc(61 * 43, 4 * sizeof *out);
  for (int again = 0; again < 2; again++) { // spoiled here and there, and then all black
    if (!again) shot_spoil(&s);
    if (again) memset(s.planes, 0, 61 * 43 * 12 * sizeof *s.planes);
    denoise_with(&s, &net, 0, best(), 1, out);
    CHECK(is_all_finite(out, 4 * 61 * 43));
  }
  mem_free(out);
  mem_free(s.planes);
  unet_finish(&net);
}

static bool has_weights(void)
{
  Err err = {0};
  for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
    Unet u;
    const bool ok = weights_load(&u, NULL, files[i], &err);
    unet_finish(&u);
    if (!ok) fprintf(stderr, "skipped: %s\n", err.text);
    if (!ok) return false;
  }
  return true;
}

__attribute__((constructor)) static void skip_without_weights(void)
{
  if (!has_weights()) _Exit(77);
}

TEST_MAIN
