// Tone curves: from scene light to the screen. Picture in, picture out; linear Rec.709 on both sides, the result
// clipped to 0..1 and still to be encoded to sRGB by whoever writes it.

#ifndef RAYFOLD_POST_TONE_H
#define RAYFOLD_POST_TONE_H

#include "base/jobs.h"
#include "base/vec.h"

#include <stddef.h>

typedef enum ToneKind {
  TONE_CURVE_LINEAR,  // clip
  TONE_CURVE_FILMIC,  // a fit of the ACES reference and output transforms
  TONE_CURVE_AGX,     // AgX, base look
  TONE_CURVE_NEUTRAL, // Khronos PBR Neutral: base colours come out as they went in
} ToneKind;

typedef struct Tone {
  ToneKind kind;
  float exposure; // stops
  float gamma;    // extra power; 1: none
} Tone;

// One colour. NaN and negative light count as black.
Vec3 tone_color(const Tone *t, Vec3 color);

// pixel_count pixels of rgba floats, in place; alpha is clipped to 0..1. jobs may be NULL.
void tone_pixels(const Tone *t, float *rgba, size_t pixel_count, Jobs *jobs);

#endif
