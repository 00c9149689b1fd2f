// See number.h. Nearly every number in a model file has so few digits that its value is one correctly rounded
// product or quotient of two exact doubles (Clinger 1990, "How to read floating point numbers accurately", the
// fast path). Floats go further: the double may be a little off unless it lies next to the middle between two
// floats. What is left goes to strtod() in the "C" locale, with the digits cut to a bounded length first.

#include "base/number.h"

#include <locale.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

// The digits of a number taken apart: value = mantissa * 10^exponent, cut after 19 digits.
typedef struct Decimal {
  uint64_t mantissa;
  int64_t exponent;
  bool is_negative, is_cut;        // is_cut: digits other than zero were dropped
  const char *digits, *digits_end; // digits and at most one point, for the slow path
  int64_t written_exponent;
} Decimal;

static const double powers[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

static bool is_digit(char c)
{
  return (unsigned char)(c - '0') < 10;
}

static const char *read_exponent(const char *p, const char *end, int64_t *exponent)
{
  if (p == end || (*p | 0x20) != 'e') return p;
  const char *q = p + 1;
  const bool is_negative = q < end && *q == '-';
  if (q < end && (*q == '-' || *q == '+')) q++;
  if (q == end || !is_digit(*q)) return p; // "1e" is the number 1, then a letter
  int64_t e = 0;
  for (; q < end && is_digit(*q); q++)
    if (e < 1000000000000) e = e * 10 + (*q - '0');
  *exponent = is_negative ? -e : e;
  return q;
}

static const char *read_decimal(const char *p, const char *end, Decimal *d)
{
  *d = (Decimal){.digits = p};
  int kept = 0;
  bool after_point = false, any = false;
  for (; p < end; p++) {
    if (*p == '.' && !after_point) {
      after_point = true;
      continue;
    }
    if (!is_digit(*p)) break;
    any = true;
    if (kept < 19) {
      d->mantissa = d->mantissa * 10 + (uint64_t)(*p - '0');
      kept += d->mantissa != 0; // leading zeros do not count
      d->exponent -= after_point;
    } else {
      d->is_cut |= *p != '0';
      d->exponent += !after_point;
    }
  }
  if (!any) return NULL;
  d->digits_end = p;
  p = read_exponent(p, end, &d->written_exponent);
  d->exponent += d->written_exponent;
  return p;
}

static bool has_word(const char *p, const char *end, const char *word)
{
  const size_t n = strlen(word);
  return (size_t)(end - p) >= n && !strncasecmp(p, word, n);
}

static const char *read_word(const char *p, const char *end, double *out)
{
  if (has_word(p, end, "infinity")) return *out = INFINITY, p + 8;
  if (has_word(p, end, "inf")) return *out = INFINITY, p + 3;
  if (!has_word(p, end, "nan")) return NULL;
  *out = NAN;
  return p + 3;
}

// "1.#IND", "1.#QNAN", "1.#INF": what Microsoft's library of old printed.
static const char *read_hash_word(const char *p, const char *end, double *out)
{
  *out = has_word(p, end, "#inf") ? INFINITY : NAN;
  for (p++; p < end && ((*p >= 'A' && *p <= 'Z') || (*p >= 'a' && *p <= 'z') || is_digit(*p));) p++;
  return p;
}

// The digits as text that strtod() reads, in the "C" locale. A double needs 767 digits at most to be told from the
// middle to its neighbour, so what comes after 800 is cut and a last digit 1 stands for it.
enum { MOST_DIGITS = 800, SLOW_SIZE = MOST_DIGITS + 40 };

static void slow_text(char text[SLOW_SIZE], const Decimal *d)
{
  size_t n = 0;
  int64_t exponent = d->written_exponent;
  bool after_point = false, is_cut = false;
  for (const char *p = d->digits; p < d->digits_end; p++) {
    if (*p == '.') {
      after_point = true;
    } else if (n < MOST_DIGITS) {
      if (n || *p != '0') text[n++] = *p;
      exponent -= after_point;
    } else {
      is_cut |= *p != '0';
      exponent += !after_point;
    }
  }
  if (is_cut) {
    text[n++] = '1';
    exponent--;
  }
  snprintf(text + n, SLOW_SIZE - n, "e%lld", (long long)exponent);
}

static locale_t c_locale(void)
{
  return newlocale(LC_ALL_MASK, "C", (locale_t)0);
} // a static one in glibc

static double slow_double(const Decimal *d)
{
  char text[SLOW_SIZE];
  slow_text(text, d);
  const locale_t c = c_locale();
  const double x = strtod_l(text, NULL, c);
  freelocale(c);
  return x;
}

static float slow_float(const Decimal *d)
{
  char text[SLOW_SIZE];
  slow_text(text, d);
  const locale_t c = c_locale();
  const float x = strtof_l(text, NULL, c);
  freelocale(c);
  return x;
}

static double magnitude(const Decimal *d)
{
  if (d->mantissa == 0) return 0;
  if (d->mantissa <= (uint64_t)1 << 53 && !d->is_cut) {
    if (d->exponent >= 0 && d->exponent <= 22) return (double)d->mantissa * powers[d->exponent];
    if (d->exponent < 0 && d->exponent >= -22) return (double)d->mantissa / powers[-d->exponent];
  }
  return slow_double(d);
}

// The mantissa, the cut and the one product or quotient are each off by at most 2^-53 relative, so the true value
// lies within 2^-51 of the product; if both ends of that round to the same float, so does the truth.
static float magnitude_float(const Decimal *d)
{
  if (d->mantissa == 0) return 0;
  if (d->exponent < -22 || d->exponent > 15) return slow_float(d);
  const double m = (double)d->mantissa;
  const double x = d->exponent < 0 ? m / powers[-d->exponent] : m * powers[d->exponent];
  const float low = (float)(x * (1 - 0x1p-51)), high = (float)(x * (1 + 0x1p-51));
  return low == high ? low : slow_float(d);
}

// The sign, then "nan" and "inf"; *found is set when those settled the number.
static const char *read_sign(const char *p, const char *end, bool *is_negative)
{
  *is_negative = p < end && *p == '-';
  return p < end && (*p == '-' || *p == '+') ? p + 1 : p;
}

const char *number_float(const char *p, const char *end, float *out)
{
  bool is_negative;
  Decimal d;
  p = read_sign(p, end, &is_negative);
  const char *after = read_decimal(p, end, &d);
  double word;
  float x;
  if (!after) {
    after = read_word(p, end, &word);
    if (!after) return NULL;
    x = (float)word;
  } else if (after < end && *after == '#' && d.mantissa == 1) {
    after = read_hash_word(after, end, &word);
    x = (float)word;
  } else {
    x = magnitude_float(&d);
  }
  *out = is_negative ? -x : x;
  return after;
}

const char *number_double(const char *p, const char *end, double *out)
{
  bool is_negative;
  Decimal d;
  p = read_sign(p, end, &is_negative);
  const char *after = read_decimal(p, end, &d);
  double x;
  if (!after) {
    after = read_word(p, end, &x);
    if (!after) return NULL;
  } else if (after < end && *after == '#' && d.mantissa == 1) {
    after = read_hash_word(after, end, &x);
  } else {
    x = magnitude(&d);
  }
  *out = is_negative ? -x : x;
  return after;
}

const char *number_int(const char *p, const char *end, int64_t *out)
{
  bool is_negative;
  p = read_sign(p, end, &is_negative);
  if (p == end || !is_digit(*p)) return NULL;
  int64_t x = 0;
  for (; p < end && is_digit(*p); p++) {
    const int digit = *p - '0';
    if (is_negative ? __builtin_mul_overflow(x, 10, &x) || __builtin_sub_overflow(x, digit, &x)
                    : __builtin_mul_overflow(x, 10, &x) || __builtin_add_overflow(x, digit, &x)) {
      for (; p < end && is_digit(*p);) p++;
      x = is_negative ? INT64_MIN : INT64_MAX;
      break;
    }
  }
  *out = x;
  return p;
}

// The usual case: few decimals, found by trying one more each time. Returns the length, 0 when x is not one of those.
static size_t format_plain(char out[NUMBER_SIZE], float x)
{
  enum { MOST_DECIMALS = 12 };
  const double magnitude_of_x = fabs((double)x);
  if (!(magnitude_of_x >= 1e-3 && magnitude_of_x < 1e7)) return 0;
  for (int decimals = 0; decimals <= MOST_DECIMALS; decimals++) {
    const double scaled = nearbyint(magnitude_of_x * powers[decimals]);
    if ((float)(scaled / powers[decimals]) != (float)magnitude_of_x) continue;
    char digits[24];
    int n = 0;
    for (uint64_t rest = (uint64_t)scaled; rest || n <= decimals; rest /= 10)
      digits[n++] = (char)('0' + rest % 10);
    char *p = out;
    if (x < 0) *p++ = '-';
    while (n > 0) {
      if (n == decimals) *p++ = '.';
      *p++ = digits[--n];
    }
    *p = 0;
    float back; // the quotient above was rounded twice
    return number_float(out, p, &back) && back == x ? (size_t)(p - out) : 0;
  }
  return 0;
}

size_t number_format(char out[NUMBER_SIZE], float x)
{
  size_t n = format_plain(out, x);
  for (int precision = 1; !n && precision <= 9; precision++) {
    const int length = snprintf(out, NUMBER_SIZE, "%.*g", precision, (double)x);
    for (char *p = out; *p; p++)
      if (*p == ',') *p = '.'; // a host program may have set a locale
    float back;
    if (precision == 9 || (number_float(out, out + length, &back) && back == x)) n = (size_t)length;
  }
  return n;
}
