// See filter.h: the curves, and their inverse distributions by summing fine steps.

#include "render/filter.h"

#include "base/fmath.h"

// The curve at x in [-1, 1] of its half width. Blackman-Harris: the four-term window of Harris, "On the use of windows
// for harmonic analysis", 1978. The Gaussian is cut at three standard deviations.
static double curve_at(FilterKind kind, double x)
{
  switch (kind) {
  case FILTER_BOX: return 1;
  case FILTER_BLACKMAN_HARRIS: {
    const float phase = PI * (float)(x + 1);
    return 0.35875 - 0.48829 * f_cos(phase) + 0.14128 * f_cos(2 * phase) - 0.01168 * f_cos(3 * phase);
  }
  case FILTER_GAUSSIAN: return f_exp((float)(-4.5 * x * x));
  }
  unreachable();
}

void filter_build(Filter *out, FilterKind kind, float width)
{
  enum { FINE = 16384 };
  const double half = (width > 0 ? width : kind == FILTER_BOX ? 1 : 3) / 2.0;
  double total = 0, sum = 0;
  for (int k = 0; k < FINE; k++) total += curve_at(kind, (2 * k + 1.0) / FINE - 1);
  int i = 0;
  for (int k = 0; k < FINE; k++) {
    const double weight = curve_at(kind, (2 * k + 1.0) / FINE - 1);
    for (; i <= FILTER_STEPS && i * total / FILTER_STEPS <= sum + weight; i++) {
      const double inside = weight > 0 ? (i * total / FILTER_STEPS - sum) / weight : 0;
      out->place[i] = (float)(half * (2 * (k + inside) / FINE - 1));
    }
    sum += weight;
  }
  for (; i <= FILTER_STEPS; i++) out->place[i] = (float)half; // rounding of the last sum
  out->place[0] = (float)-half;
}
