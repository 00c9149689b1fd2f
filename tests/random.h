// Random places and directions for tests: the same row of numbers in every run, for each test file its own.

#ifndef RAYFOLD_TESTS_RANDOM_H
#define RAYFOLD_TESTS_RANDOM_H

#include "base/fmath.h"
#include "base/hash.h"
#include "base/vec.h"

static uint32_t rnd_state = 1;

static inline float rnd(void)
{
  rnd_state = hash_u32(rnd_state + 0x9e3779b9u);
  return unit_float(rnd_state);
}

static inline float rnd_between(float low, float high) { return low + (high - low) * rnd(); }

static inline Vec3 rnd_direction(void)
{
  const float z = 1 - 2 * rnd(), r = safe_sqrt(1 - z * z), a = 2 * PI * rnd();
  return v3(r * f_cos(a), r * f_sin(a), z);
}

#endif
