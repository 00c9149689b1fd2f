// What both denoisers take: a noisy picture and the planes that guide them, as the film gives them.

#ifndef RAYFOLD_POST_GUIDED_H
#define RAYFOLD_POST_GUIDED_H

#include <stddef.h>
#include <stdint.h>

typedef struct Guided {
  uint32_t width, height;
  const float *color;    // rgba, linear radiance multiplied by alpha
  const float *albedo;   // rgb
  const float *normal;   // xyz, world space
  const float *depth;    // metres, 0: nothing there
  const float *variance; // of the mean luminance; 0: not known
} Guided;

static inline float guided_finite(float x)
{
  return x - x == 0 ? x : 0;
}

#endif
