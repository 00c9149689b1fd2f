// Numbers in text: against strtof() and strtod() on random digits, at the ties where rounding is hard, and at the
// end of the range where reading on would be a fault (ASan watches).

#include "tests/test.h"

#include "base/hash.h"
#include "base/number.h"

#include <locale.h>

// In a block of exactly the text's size, so that a byte read too many is caught.
static size_t read_float(const char *text, float *out)
{
  const size_t n = strlen(text);
  char *exact = malloc(n ? n : 1);
  memcpy(exact, text, n);
  const char *end = number_float(exact, exact + n, out);
  const size_t used = end ? (size_t)(end - exact) : 0;
  free(exact);
  return used;
}

static void check_float(const char *text)
{
  float x = -1;
  double y = -1;
  const size_t used = read_float(text, &x);
  char *end;
  const float want = strtof(text, &end);
  CHECK_MSG(used == (size_t)(end - text), "\"%s\": used %zu of %zu", text, used, (size_t)(end - text));
  CHECK_MSG(!memcmp(&x, &want, sizeof x), "\"%s\": %.9g, not %.9g", text, (double)x, (double)want);
  const double want_y = strtod(text, NULL);
  number_double(text, text + strlen(text), &y);
  CHECK_MSG(!memcmp(&y, &want_y, sizeof y), "\"%s\": %.17g, not %.17g", text, y, want_y);
}

TEST(floats_agree_with_the_c_library)
{
  static const char *const texts[] = {"0",
                                      "-0",
                                      "1",
                                      "+1.5",
                                      "-2.25e3",
                                      ".5",
                                      "5.",
                                      "1e",
                                      "1e+",
                                      "1.5abc",
                                      "123456789012345678901234567890",
                                      "16777217",
                                      "16777219",
                                      "16777217.0000000000000000000000001",
                                      "16777216.9999999999999999999999999",
                                      "0.1",
                                      "3.4028235e38",
                                      "3.4028236e38",
                                      "1e39",
                                      "1e400",
                                      "-1e400",
                                      "1e-45",
                                      "7e-46",
                                      "7.1e-46",
                                      "1e-400",
                                      "2.2250738585072012e-308",
                                      "9007199254740993",
                                      "9007199254740993.0000000000000000000000000000000001",
                                      "0.000000000000000000000000000000000000000000001",
                                      "1e99999999999999999999",
                                      "1e-99999999999999999999",
                                      "1.17549435e-38",
                                      "8388609.5",
                                      "1.00000005960464477539062500000000000000000001",
                                      "1..2",
                                      "00012.50"};
  for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) check_float(texts[i]);
  for (uint32_t i = 0; i < 200000; i++) {
    const uint32_t a = hash_u32(i), b = hash_u32(a), c = hash_u32(b);
    char text[80];
    switch (a % 4) {
    case 0: snprintf(text, sizeof text, "%.*f", (int)(b % 12), (double)(int32_t)c / 65536.0); break;
    case 1: snprintf(text, sizeof text, "%u%u.%u", b, c, a); break;
    case 2: snprintf(text, sizeof text, "%.*ge%d", (int)(b % 20), (double)c, (int)(a >> 4) % 50 - 60); break;
    default: { // the exact middle of two floats, written out
      const uint32_t bits = (b & 0x00ffffffu) + 0x3f000000u;
      float f;
      memcpy(&f, &bits, sizeof f);
      snprintf(text, sizeof text, "%.40f", ((double)f + (double)nextafterf(f, 9)) / 2);
    }
    }
    check_float(text);
  }
}

TEST(ten_thousand_digits_round_as_the_first_eight_hundred_and_a_sign_of_more)
{
  char *text = malloc(20001);
  memset(text, '0', 20000);
  memcpy(text, "16777217.", 9);
  text[20000] = 0;
  check_float(text); // a tie: to even
  text[19999] = '1';
  check_float(text); // just above it
  free(text);
}

TEST(what_is_no_number_is_refused)
{
  static const char *const texts[] = {"", "-", "+", ".", "-.", "e5", "x", " 1", "--1", "#", "i", "na"};
  for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
    float x = 7;
    CHECK_MSG(read_float(texts[i], &x) == 0 && x == 7, "\"%s\" read as %g", texts[i], (double)x);
  }
}

TEST(words_for_numbers)
{
  float x;
  CHECK(read_float("nan", &x) == 3 && isnan(x));
  CHECK(read_float("-NaN", &x) == 4 && isnan(x));
  CHECK(read_float("-inf", &x) == 4 && isinf(x) && x < 0);
  CHECK(read_float("Infinity", &x) == 8 && isinf(x));
  CHECK(read_float("-1.#IND00", &x) == 9 && isnan(x));
  CHECK(read_float("1.#INF", &x) == 6 && isinf(x));
}

TEST(integers_are_held_at_the_ends)
{
  int64_t x;
  const char *t = "-9223372036854775808 9223372036854775808 -999999999999999999999 +12/";
  const char *end = t + strlen(t);
  const char *p = number_int(t, end, &x);
  CHECK(p && x == INT64_MIN);
  p = number_int(p + 1, end, &x);
  CHECK(p && x == INT64_MAX);
  p = number_int(p + 1, end, &x);
  CHECK(p && x == INT64_MIN);
  p = number_int(p + 1, end, &x);
  CHECK(p && x == 12 && *p == '/');
  CHECK(!number_int(p, end, &x));
  CHECK(!number_int(end, end, &x));
}

TEST(written_floats_read_back_under_any_locale)
{
  const bool comma = setlocale(LC_ALL, "de_DE.UTF-8") || setlocale(LC_ALL, "fr_FR.UTF-8");
  (void)comma; // where no such locale is installed, this checks the plain one
  for (uint32_t i = 0; i < 100000; i++) {
    const uint32_t bits = hash_u32(i);
    float x, back = 0;
    memcpy(&x, &bits, sizeof x);
    if (i % 2) x = ((float)bits - 0x1p31f) * powf(10, -(float)(bits % 14)); // the range of coordinates
    if (!isfinite(x)) continue;
    char text[NUMBER_SIZE];
    const size_t n = number_format(text, x);
    CHECK(number_float(text, text + n, &back) == text + n);
    CHECK_MSG(back == x, "%s for %.9g", text, (double)x);
  }
  setlocale(LC_ALL, "C");
}

TEST(written_floats_are_short)
{
  static const struct {
    float x;
    const char *text;
  } cases[] = {{0, "0"},
               {1, "1"},
               {-1, "-1"},
               {0.1f, "0.1"},
               {-2.5f, "-2.5"},
               {100, "100"},
               {0.001f, "0.001"},
               {1e-10f, "1e-10"},
               {1e20f, "1e+20"},
               {0.3333333f, "0.3333333"},
               {16777216, "16777216"},
               {1234567.25f, "1234567.2"},
               {-0.05f, "-0.05"},
               {INFINITY, "inf"}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char text[NUMBER_SIZE];
    CHECK(number_format(text, cases[i].x) == strlen(text));
    CHECK_MSG(!strcmp(text, cases[i].text), "%s, not %s", text, cases[i].text);
  }
}

TEST_MAIN
