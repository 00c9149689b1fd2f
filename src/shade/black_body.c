// The table of spectrum.h: Planck's law, each spectrum divided by its own peak (as pbrt-v4, section 4.4.1, does), seen by
// the CIE observer; 1 at all wavelengths would have a luminance of 1.

#include "shade/spectrum.h"

#include <math.h>

// Radiance at a wavelength in nanometres, but for a factor that the division by the peak takes away.
static double planck(double nm, double kelvin)
{
  const double second_radiation = 1.438776877e7; // nm K
  return 1 / (pow(nm, 5) * expm1(second_radiation / (nm * kelvin)));
}

static Vec3 color_of(double kelvin)
{
  enum { FROM = 360, TO = 830, STEP = 5 };
  const double luminous = 106.856895;                  // integral of the observer's y in nm
  const double peak = planck(2.897771955e6 / kelvin, kelvin); // Wien's law
  Vec3 sum = v3_all(0);
  for (int nm = FROM; nm <= TO; nm += STEP)
    sum += (float)(planck(nm, kelvin) / peak * STEP / luminous) * rec709_of((float)nm);
  return v3_max(sum, v3_all(0)); // the deepest reds lie outside Rec.709
}

void black_body_make(BlackBody *out)
{
  const int first = 20; // below 200 K nothing is seen, and the numbers would end
  for (int i = 0; i < BLACK_BODY_COUNT; i++)
    out->color[i] = i < first ? v3_all(0) : color_of((double)BLACK_BODY_STEP * i);
}
