// The transcendental functions against libm in double: the worst error in units of the last place over a dense sweep
// of floats, and the corners.

#include "tests/test.h"

#include "base/fmath.h"
#include "base/hash.h"

#include <float.h>

#define SAMPLE_COUNT 400000

// Distance from the true value, in steps of the float grid there.
static double ulps(float got, double truth)
{
  if (isnan(got) || isnan(truth)) return isnan(got) && isnan(truth) ? 0 : INFINITY;
  if (got == (float)truth)
    return fabs(truth) < FLT_MAX ? fabs(got - truth) / ldexp(1, ilogb(fmax(fabs(truth), FLT_MIN)) - 23) : 0;
  return fabs((double)got - truth) / ldexp(1, ilogb(fmax(fabs(truth), FLT_MIN)) - 23);
}

// A float with random bits in [low, high], exponents as likely as each other near zero.
static float draw(uint32_t i, float low, float high)
{
  const uint32_t h = hash_combine(17, i);
  const float u = unit_float(h) * (high - low) + low;
  return h & 1 ? u : fminf(fmaxf(ldexpf(u, -(int)(hash_u32(h) % 40)), low), high);
}

static float sine_of(float x)
{
  return f_sin(x);
}
static float cosine_of(float x)
{
  return f_cos(x);
}

static void sweep(const char *name, float (*mine)(float), double (*truth)(double), float low, float high)
{
  double worst = 0;
  float at = 0;
  for (uint32_t i = 0; i < SAMPLE_COUNT; i++) {
    const float x = draw(i, low, high);
    const double e = ulps(mine(x), truth((double)x));
    if (e > worst) worst = e, at = x;
  }
  printf("  %-5s on %g..%g: %.4f ulp, at %.9g\n", name, (double)low, (double)high, worst, (double)at);
  CHECK_MSG(worst <= 0.51, "%s(%.9g) is %.3f ulp off", name, (double)at, worst);
}

TEST(one_argument_functions_are_the_nearest_float)
{
  sweep("sin", sine_of, sin, -7, 7);
  sweep("sin", sine_of, sin, -1e6f, 1e6f);
  sweep("cos", cosine_of, cos, -7, 7);
  sweep("cos", cosine_of, cos, -1e6f, 1e6f);
  sweep("exp", f_exp, exp, -104, 88.7f);
  sweep("exp", f_exp, exp, -1, 1);
  sweep("log", f_log, log, FLT_TRUE_MIN, 3e38f);
  sweep("log", f_log, log, 0.5f, 2);
  sweep("acos", f_acos, acos, -1, 1);
  sweep("asin", f_asin, asin, -1, 1);
}

TEST(two_argument_functions_are_the_nearest_float)
{
  double worst_pow = 0, worst_atan = 0;
  for (uint32_t i = 0; i < SAMPLE_COUNT; i++) {
    const float x = draw(i, 0, 100), y = draw(i + SAMPLE_COUNT, -8, 8);
    const double power = pow((double)x, (double)y);
    if (power < (double)FLT_MAX && power > 1e-37) worst_pow = fmax(worst_pow, ulps(f_pow(x, y), power));
    worst_atan = fmax(worst_atan, ulps(f_atan2(x - 50, y), atan2((double)(x - 50), (double)y)));
  }
  printf("  pow %.4f ulp, atan2 %.4f ulp\n", worst_pow, worst_atan);
  CHECK(worst_pow <= 0.51);
  CHECK(worst_atan <= 0.51);
}

TEST(corners)
{
  float s, c;
  f_sincos(0, &s, &c);
  CHECK(s == 0 && c == 1);
  f_sincos(INFINITY, &s, &c);
  CHECK(isnan(s) && isnan(c));
  f_sincos(1e30f, &s, &c);
  CHECK(s == 0 && c == 1);
  CHECK(f_exp(0) == 1 && f_exp(200) == INFINITY && f_exp(-200) == 0 && f_exp(-INFINITY) == 0 &&
        isnan(f_exp(NAN)));
  CHECK(f_log(1) == 0 && f_log(0) == -INFINITY && isnan(f_log(-1)) && f_log(INFINITY) == INFINITY);
  CHECK(f_pow(0, 2) == 0 && f_pow(0, 0) == 1 && f_pow(0, -1) == INFINITY && isnan(f_pow(-1, 2)) &&
        f_pow(1, 5) == 1);
  CHECK(f_pow(3, 2) == 9 && f_pow(1e30f, 2) == INFINITY);
  CHECK(f_atan2(0, 0) == 0 && f_atan2(0, -1) == (float)M_PI && f_atan2(-0.0f, -1) == -(float)M_PI);
  CHECK(f_atan2(1, 0) == (float)M_PI_2 && f_atan2(-1, 0) == -(float)M_PI_2);
  CHECK(f_acos(1.0001f) == 0 && f_acos(-2) == (float)M_PI && f_asin(2) == (float)M_PI_2 &&
        isnan(f_acos(NAN)));
}

TEST_MAIN
