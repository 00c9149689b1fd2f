// The sampler: every pair is a (0,2)-sequence in every pixel, values are even over pixels and seeds, and the error is
// spread over neighbouring pixels without hurting any one of them.

#include "tests/test.h"

#include "render/sampler.h"

// Do the first 2^log_count samples of the pixel meet every elementary interval exactly once?
static bool is_net(uint32_t x, uint32_t y, uint32_t pair, uint32_t seed, uint32_t first, int log_count)
{
  const uint32_t n = 1u << log_count;
  for (int a = 0; a <= log_count; a++) {
    bool taken[1024] = {false};
    for (uint32_t i = 0; i < n; i++) {
      const Sampler s = sampler_begin(x, y, first + i, seed);
      const SampleBits b = sample_bits(&s, pair);
      const uint32_t column = (uint32_t)((uint64_t)b.x >> (32 - a));
      const uint32_t row = (uint32_t)((uint64_t)b.y >> (32 - (log_count - a)));
      const uint32_t cell = column << (log_count - a) | row;
      if (taken[cell]) return false;
      taken[cell] = true;
    }
  }
  return true;
}

TEST(every_power_of_two_of_samples_is_a_net)
{
  for (uint32_t pair = 0; pair < 40; pair += 3) {
    for (int log_count = 0; log_count <= 9; log_count++) {
      CHECK_MSG(is_net(17 * pair, 1000 - pair, pair, 5, 0, log_count), "pair %u, 2^%d samples", pair,
                log_count);
    }
  }
  // Aligned runs further on, too: what a second machine renders is as good as what the first did.
  CHECK(is_net(3, 4, 2, 1, 256, 8) && is_net(3, 4, 2, 1, 65536, 6) && is_net(3, 4, 2, 1, 0x40000, 4));
}

// Many at once are the same numbers, whatever lies in the rows behind.
TEST(rows_are_samplers)
{
  SamplerRows rows = {0};
  uint32_t x[SAMPLER_ROWS], y[SAMPLER_ROWS];
  const uint32_t samples[] = {0, 1, 2, 3, 4, 7, 8, 255, 256, 0x40000, 0x7fffffffu, 0x80000000u, 0xffffffffu};
  const size_t kinds = sizeof samples / sizeof *samples;
  for (uint32_t pair = 0; pair < 50; pair++) {
    const size_t count = 1 + pair % SAMPLER_ROWS;
    Sampler s[SAMPLER_ROWS];
    for (size_t i = 0; i < count; i++) {
      s[i] = sampler_begin((uint32_t)i * 7, pair, samples[(i + pair) % kinds], 3 + pair);
      sampler_rows_set(&rows, i, &s[i]);
    }
    sample_rows(&rows, count, pair, x, y);
    for (size_t i = 0; i < count; i++) {
      const SampleBits b = sample_bits(&s[i], pair);
      CHECK(x[i] == b.x && y[i] == b.y);
    }
  }
}

TEST(neighbours_share_the_strata)
{
  // At one sample the 2^k pixels of an aligned block hold one value in each of 2^k strata, in x and in y.
  for (uint32_t pair = 0; pair < 30; pair++) {
    for (int axis = 0; axis < 2; axis++) {
      for (uint32_t side = 2, levels = 4; side <= 16; side *= 2, levels *= 4) {
        bool taken[256] = {false};
        bool ok = true;
        for (uint32_t i = 0; i < side * side; i++) {
          const Sampler s = sampler_begin(32 + i % side, 48 + i / side, 0, 9);
          const Vec2 u = sample_pair(&s, pair);
          const uint32_t cell = (uint32_t)((axis ? u.y : u.x) * (float)levels);
          ok = ok && !taken[cell];
          taken[cell] = true;
        }
        CHECK_MSG(ok, "pair %u axis %d side %u", pair, axis, side);
      }
    }
  }
}

TEST(samples_stay_below_a_stratum_at_every_power_of_two)
{
  // With 4 samples the top two bits are settled inside each pixel; the next two then tell 2 x 2 neighbours apart.
  for (uint32_t pair = 0; pair < 30; pair++) {
    bool taken[16] = {false};
    bool ok = true;
    for (uint32_t i = 0; i < 16; i++) {
      const Sampler s = sampler_begin(64 + (i & 1), 64 + (i >> 1 & 1), i >> 2, 2);
      const uint32_t cell = (uint32_t)(sample_pair(&s, pair).x * 16);
      ok = ok && !taken[cell];
      taken[cell] = true;
    }
    CHECK_MSG(ok, "pair %u", pair);
  }
}

static double mean_of_cells(const int *cells, int count, double *chi)
{
  double total = 0;
  for (int i = 0; i < count; i++) total += cells[i];
  *chi = 0;
  for (int i = 0; i < count; i++)
    *chi += (cells[i] - total / count) * (cells[i] - total / count) / (total / count);
  return total / count;
}

TEST(one_pixel_is_even_over_seeds)
{
  // 16 x 16 cells, 255 degrees of freedom: chi-square stays under 341 with a probability of 99.97 %.
  for (uint32_t sample = 0; sample < 6; sample++) {
    int cells[256] = {0};
    for (uint32_t seed = 0; seed < 20000; seed++) {
      const Sampler s = sampler_begin(123, 45, sample, seed);
      const Vec2 u = sample_pair(&s, sample + 3);
      cells[(int)(u.x * 16) * 16 + (int)(u.y * 16)]++;
    }
    double chi;
    mean_of_cells(cells, 256, &chi);
    CHECK_MSG(chi < 341, "sample %u: chi-square %.1f", sample, chi);
  }
}

TEST(pairs_are_independent)
{
  // x of one pair against x of the next, over pixels and samples.
  for (uint32_t pair = 0; pair < 8; pair++) {
    int cells[256] = {0};
    for (uint32_t i = 0; i < 40000; i++) {
      const Sampler s = sampler_begin(hash_u32(i) & 0xfff, hash_u32(i + 77777) & 0xfff, i & 15, i >> 8);
      cells[(int)(sample_pair(&s, pair).x * 16) * 16 + (int)(sample_pair(&s, pair + 1).x * 16)]++;
    }
    double chi;
    mean_of_cells(cells, 256, &chi);
    CHECK_MSG(chi < 341, "pair %u: chi-square %.1f", pair, chi);
  }
}

// Root mean square error over 64 x 64 pixels and 4 seeds of an integrand whose integral is known; blurred: after
// averaging 4 x 4 pixels. kind 0: white noise, 1: plain Owen-scrambled Sobol a pixel, 2: ours.
static float take(int kind, uint32_t x, uint32_t y, uint32_t i, uint32_t seed, bool is_edge)
{
  Sampler s = sampler_begin(x, y, i, seed);
  Vec2 u = sample_pair(&s, 1);
  if (kind < 2) {
    s.rank = 0;
    s.block_seed = hash_u32(s.pixel_seed + 1);
    if (kind == 0) s = (Sampler){hash_combine(s.block_seed, i), 0, 0, 0};
    u = sample_pair(&s, 1);
  }
  return is_edge ? (u.x + u.y < 0.75f) : u.x * u.x + u.y;
}

static void measure(int kind, uint32_t samples, bool is_edge, double *error, double *blurred)
{
  static double image[64 * 64];
  const double truth = is_edge ? 0.75 * 0.75 / 2 : 1.0 / 3 + 0.5;
  *error = *blurred = 0;
  for (uint32_t seed = 0; seed < 4; seed++) {
    for (uint32_t p = 0; p < 64 * 64; p++) {
      image[p] = 0;
      for (uint32_t i = 0; i < samples; i++) image[p] += take(kind, p % 64, p / 64, i, seed, is_edge);
      image[p] = image[p] / samples - truth;
      *error += image[p] * image[p] / (4 * 64 * 64);
    }
    for (uint32_t b = 0; b < 256; b++) {
      double sum = 0;
      for (uint32_t k = 0; k < 16; k++) sum += image[(b / 16 * 4 + k / 4) * 64 + b % 16 * 4 + k % 4] / 16;
      *blurred += sum * sum / (4 * 256);
    }
  }
  *error = sqrt(*error);
  *blurred = sqrt(*blurred);
}

TEST(no_pixel_pays_for_the_blue_noise)
{
  for (int is_edge = 0; is_edge < 2; is_edge++) {
    for (uint32_t samples = 1; samples <= 64; samples *= 4) {
      double white[2], plain[2], ours[2];
      measure(0, samples, is_edge, &white[0], &white[1]);
      measure(1, samples, is_edge, &plain[0], &plain[1]);
      measure(2, samples, is_edge, &ours[0], &ours[1]);
      CHECK_MSG(ours[0] < 1.08 * plain[0], "%u samples: %.5f against %.5f", samples, ours[0], plain[0]);
      if (samples >= 4)
        CHECK_MSG(ours[0] < 0.8 * white[0], "%u samples: %.5f, white %.5f", samples, ours[0], white[0]);
      if (samples > 4) continue;
      CHECK_MSG(ours[1] < 0.8 * plain[1], "blurred, %u samples: %.5f against %.5f", samples, ours[1],
                plain[1]);
    }
  }
}

TEST(values_are_fixed)
{
  uint32_t h = 0;
  for (uint32_t i = 0; i < 1000; i++) {
    const Sampler s = sampler_begin(i * 7, i * 13, i * i, i / 10);
    const SampleBits b = sample_bits(&s, i % 50);
    h = hash_combine(hash_combine(h, b.x), b.y);
  }
  CHECK_MSG(h == 0x642b2ab1u, "%#x", h);
}

TEST_MAIN
