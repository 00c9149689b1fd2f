// The film: exact sums in any order, what is refused, and what each plane says.

#include "tests/test.h"

#include "base/hash.h"
#include "base/mem.h"
#include "render/film.h"

enum { ALL = (1 << FILM_PLANE_COUNT) - 1, W = 13, H = 7 };

static float noise(uint32_t a, uint32_t b, uint32_t c)
{
  return unit_float(hash_combine(hash_combine(a, b), c));
}

static FilmSample made_up(uint32_t pixel, uint32_t sample)
{
  FilmSample s = {.alpha = noise(pixel, sample, 0), .depth = 10 * noise(pixel, sample, 1)};
  for (int k = 0; k < 3; k++) {
    s.radiance[k] = 5 * noise(pixel, sample, 2 + (uint32_t)k);
    s.albedo[k] = noise(pixel, sample, 5 + (uint32_t)k);
    s.normal[k] = noise(pixel, sample, 8 + (uint32_t)k) - 0.5f;
    s.position[k] = 100 * noise(pixel, sample, 11 + (uint32_t)k);
  }
  s.object = 1 + hash_combine(pixel, sample) % 5;
  s.material = 1 + hash_combine(pixel, sample) % 3;
  s.is_hit = noise(pixel, sample, 20) < 0.7f;
  return s;
}

static Film *film_of(uint32_t first, uint32_t end, bool backwards)
{
  Film *f = film_create(W, H, ALL, NULL);
  CHECK(f && film_claim(f, first, end, NULL));
  for (uint32_t k = 0; k < (end - first) * W * H; k++) {
    const uint32_t i = backwards ? (end - first) * W * H - 1 - k : k;
    const FilmSample s = made_up(i % (W * H), first + i / (W * H));
    film_add(f, i % W, i % (W * H) / W, first + i / (W * H), &s);
  }
  return f;
}

TEST(any_order_and_split_gives_the_same_bytes)
{
  Film *whole = film_of(0, 12, false), *backwards = film_of(0, 12, true);
  CHECK(film_hash(whole) == film_hash(backwards));
  const uint32_t cuts[5] = {0, 1, 4, 5, 12};
  const int orders[3][4] = {{0, 1, 2, 3}, {3, 1, 0, 2}, {2, 3, 1, 0}};
  for (int o = 0; o < 3; o++) {
    Film *sum = film_create(W, H, ALL, NULL);
    for (int k = 0; k < 4; k++) {
      Film *part = film_of(cuts[orders[o][k]], cuts[orders[o][k] + 1], k & 1);
      CHECK(film_merge(sum, part, NULL));
      film_destroy(part);
    }
    CHECK(film_hash(sum) == film_hash(whole));
    CHECK(sum->ranges.count == 1 && sum->ranges.items[0].first == 0 && sum->ranges.items[0].end == 12);
    film_destroy(sum);
  }
  film_destroy(whole);
  film_destroy(backwards);
}

TEST(merging_what_overlaps_is_refused)
{
  Film *a = film_of(0, 4, false), *b = film_of(3, 5, false);
  Film *small = film_create(W - 1, H, ALL, NULL), *bare = film_create(W, H, 0, NULL);
  const uint64_t before = film_hash(a);
  Err err = {0}, size = {0}, planes = {0};
  CHECK(!film_merge(a, b, &err));
  CHECK_TEXT(err.text, "samples 3 to 5 are in the film already");
  CHECK(!film_merge(a, small, &size) && size.kind == ERR_BAD_ARGUMENT);
  CHECK(!film_merge(a, bare, &planes));
  CHECK_TEXT(planes.text, "planes");
  CHECK(film_hash(a) == before && a->ranges.count == 1);
  film_destroy(a);
  film_destroy(b);
  film_destroy(small);
  film_destroy(bare);
}

TEST(claims_are_kept_as_ranges)
{
  Film *f = film_create(2, 2, 0, NULL);
  CHECK(film_claim(f, 8, 16, NULL) && film_claim(f, 0, 4, NULL) && film_claim(f, 32, 64, NULL));
  CHECK(f->ranges.count == 3);
  CHECK(!film_claim(f, 15, 17, NULL) && !film_claim(f, 3, 4, NULL) && !film_claim(f, 0, 100, NULL));
  CHECK(film_claim(f, 4, 8, NULL));
  CHECK(f->ranges.count == 2 && f->ranges.items[0].end == 16 && f->ranges.items[1].first == 32);
  Err err = {0};
  CHECK(!film_claim(f, 1000, 1000 + FILM_MOST_SAMPLES, &err));
  CHECK_TEXT(err.text, "at most 524288");
  CHECK(!film_claim(f, 5, 5, NULL));
  film_clear(f);
  CHECK(film_claim(f, 0, FILM_MOST_SAMPLES, NULL));
  film_destroy(f);
}

TEST(sizes_are_checked)
{
  size_t bytes = 0;
  CHECK(film_bytes(10, 10, 0, &bytes) && bytes == sizeof(Film) + 100 * (4 * 8 + 4));
  Err err = {0};
  CHECK(!film_create(0, 5, 0, &err));
  CHECK(!film_create(FILM_MOST_SIDE + 1, 5, 0, NULL));
  CHECK_TEXT(err.text, "0 x 5");
  for (long n = 1; n <= 10; n++) {
    mem_fail_after(n);
    Film *f = film_create(4, 4, ALL, NULL);
    mem_fail_after(0);
    CHECK(!f);
    film_destroy(f);
  }
}

TEST(planes_say_what_was_added)
{
  Film *f = film_of(0, 9, false);
  float beauty[W * H * 4], depth[W * H], position[W * H * 3], id[W * H], variance[W * H], count[W * H];
  CHECK(film_resolve(f, FILM_BEAUTY, beauty) && film_resolve(f, FILM_DEPTH, depth));
  CHECK(film_resolve(f, FILM_POSITION, position) && film_resolve(f, FILM_OBJECT_ID, id));
  CHECK(film_resolve(f, FILM_VARIANCE, variance) && film_resolve(f, FILM_SAMPLES, count));
  for (uint32_t p = 0; p < W * H; p++) {
    double red = 0, alpha = 0, z = 0, y = 0, hits = 0, l = 0, l2 = 0;
    for (uint32_t i = 0; i < 9; i++) {
      const FilmSample s = made_up(p, i);
      const double lum = luminance(s.radiance);
      red += s.radiance[0];
      alpha += s.alpha;
      l += lum;
      l2 += lum * lum;
      if (!s.is_hit) continue;
      hits++;
      z += s.depth;
      y += s.position[1];
    }
    const FilmSample first = made_up(p, 0);
    CHECK_NEAR(beauty[4 * p], red / 9, 1e-6);
    CHECK_NEAR(beauty[4 * p + 3], alpha / 9, 1e-6);
    CHECK_NEAR(depth[p], hits > 0 ? z / hits : 0, 1e-5);
    CHECK_NEAR(position[3 * p + 1], hits > 0 ? y / hits : 0, 1e-4);
    CHECK(id[p] == (first.is_hit ? (float)first.object : 0) && count[p] == 9);
    CHECK_NEAR(variance[p], (l2 - l * l / 9) / (9 * 8), 1e-5);
  }
  film_destroy(f);
}

TEST(bad_numbers_stay_out)
{
  Film *f = film_create(1, 1, ALL, NULL);
  const float bad[3] = {NAN, INFINITY, -INFINITY};
  for (int k = 0; k < 3; k++) {
    FilmSample s = {.is_hit = true, .alpha = 1, .depth = bad[k], .normal = v3_all(bad[k])};
    s.radiance = v3(1, bad[k], 2);
    CHECK(!film_add(f, 0, 0, (uint32_t)k, &s));
  }
  FilmSample bright = {.radiance = v3(1e30f, -1e30f, 3e38f), .alpha = 1};
  CHECK(film_add(f, 0, 0, 3, &bright));
  float rgba[4], normal[3], depth, variance;
  CHECK(film_resolve(f, FILM_BEAUTY, rgba) && film_resolve(f, FILM_NORMAL, normal));
  CHECK(film_resolve(f, FILM_DEPTH, &depth) && film_resolve(f, FILM_VARIANCE, &variance));
  CHECK(rgba[0] == FILM_LIMIT / 4 && rgba[1] == -FILM_LIMIT / 4 && rgba[3] == 1);
  CHECK(isfinite(normal[0]) && isfinite(depth) && isfinite(variance));
  film_destroy(f);
}

TEST(a_full_film_does_not_overflow)
{
  Film *f = film_create(1, 1, ALL, NULL);
  const FilmSample s = {.radiance = v3_all(1e9f), .alpha = 1};
  for (uint32_t i = 0; i < FILM_MOST_SAMPLES; i++) film_add(f, 0, 0, i, &s);
  float rgba[4], variance;
  CHECK(film_resolve(f, FILM_BEAUTY, rgba) && film_resolve(f, FILM_VARIANCE, &variance));
  CHECK(rgba[0] == FILM_LIMIT && rgba[3] == 1 && variance < 1e-9f);
  film_destroy(f);
}

TEST(fixed_point_rounds_to_the_nearest)
{
  CHECK(film_fixed(1) == 1 << 28 && film_fixed(-0.5f) == -(1 << 27) && film_fixed(0) == 0);
  CHECK(film_fixed(0x1p-28f) == 1 && film_fixed(0.4f * 0x1p-28f) == 0 && film_fixed(0.6f * 0x1p-28f) == 1);
  CHECK(film_fixed(NAN) == 0 && film_fixed(INFINITY) == (1ll << 44) - (1 << 20) &&
        film_fixed(-INFINITY) == (1 << 20) - (1ll << 44));
}

TEST(noise_is_the_relative_error)
{
  Film *f = film_create(64, 64, ALL, NULL);
  for (uint32_t p = 0; p < 64 * 64; p++) {
    for (uint32_t i = 0; i < 64; i++) { // 0 or 2 with equal chance: standard deviation 1, mean 1, error 1/8
      const FilmSample s = {.radiance = v3_all(noise(p, i, 0) < 0.5f ? 0 : 2)};
      film_add(f, p % 64, p / 64, i, &s);
    }
  }
  float noise[16];
  CHECK_NEAR(film_noise(f, noise), 0.125, 0.002);
  for (int i = 0; i < 16; i++) CHECK_NEAR(noise[i], 0.125, 0.01);
  film_destroy(f);
}

TEST_MAIN
