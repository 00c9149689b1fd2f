// Spectrum: how light of a wavelength looks, as linear Rec.709, and that of black bodies. A red or blue that is too deep for
// Rec.709 has channels below 0.

#ifndef RAYFOLD_SHADE_SPECTRUM_H
#define RAYFOLD_SHADE_SPECTRUM_H

#include "base/fmath.h"
#include "base/vec.h"

// One lobe of Wyman, Sloan and Shirley, "Simple analytic approximations to the CIE XYZ color matching functions", 2013.
static inline float spectrum_lobe(float nm, float middle, float below, float above)
{
  const float t = (nm - middle) / (nm < middle ? below : above);
  return f_exp(-0.5f * t * t);
}

static inline Vec3 rec709_of(float nm)
{
  const float x = 1.056f * spectrum_lobe(nm, 599.8f, 37.9f, 31.0f) + 0.362f * spectrum_lobe(nm, 442.0f, 16.0f, 26.7f) -
                  0.065f * spectrum_lobe(nm, 501.1f, 20.4f, 26.2f);
  const float y = 0.821f * spectrum_lobe(nm, 568.8f, 46.9f, 40.5f) + 0.286f * spectrum_lobe(nm, 530.9f, 16.3f, 31.1f);
  const float z = 1.217f * spectrum_lobe(nm, 437.0f, 11.8f, 36.0f) + 0.681f * spectrum_lobe(nm, 459.0f, 26.0f, 13.8f);
  return v3(3.2406f * x - 1.5372f * y - 0.4986f * z, -0.9689f * x + 1.8758f * y + 0.0415f * z,
            0.0557f * x - 0.2040f * y + 1.0570f * z); // IEC 61966-2-1
}

// --- black bodies ---------------------------------------------------------------------------------------
// Their colours by temperature, in steps; a thousand kelvin to ten thousand is what flames and lamps have. In steps of 10 K
// what lies between is off by 0.7 % at 1000 K and by 0.04 % at 2000 K.
enum { BLACK_BODY_COUNT = 1024 };
#define BLACK_BODY_STEP 10.0f // K

typedef struct BlackBody {
  Vec3 color[BLACK_BODY_COUNT];
} BlackBody;

void black_body_make(BlackBody *out);

static inline Vec3 black_body_at(const BlackBody *b, float kelvin)
{
  const float x = clamp_f(kelvin / BLACK_BODY_STEP, 0, BLACK_BODY_COUNT - 1.001f);
  const uint32_t i = (uint32_t)x;
  return b->color[i] + (x - (float)i) * (b->color[i + 1] - b->color[i]);
}

#endif
