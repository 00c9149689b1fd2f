// Pearson's chi-square test of directions against the density they claim, as Mitsuba and pbrt use it: count samples
// in cells of the sphere, integrate the density over each, pool cells that expect little, and ask how likely so large
// a difference is by chance. Many such tests at once share one level (Sidak 1967).

#ifndef RAYFOLD_TESTS_CHI_SQUARE_H
#define RAYFOLD_TESTS_CHI_SQUARE_H

#include "base/fmath.h"
#include "base/hash.h"
#include "base/vec.h"

enum { CHI_ROWS = 32, CHI_COLUMNS = 64, CHI_CELLS = CHI_ROWS * CHI_COLUMNS };

// What is tested: a sampler (false: nothing came out) and its density per solid angle.
typedef struct ChiCase {
  bool (*sample)(const void *user, uint32_t i, Vec3 *d);
  double (*pdf)(const void *user, Vec3 d);
  const void *user;
  int fineness; // midpoints of a cell's side for the first look; 0: 5
} ChiCase;

typedef struct ChiResult {
  double p;        // chance of a difference this large if the density is right
  double integral; // of the density over the sphere
  double accepted; // part of the samples that came out
} ChiResult;

// Three unit numbers for sample i.
static inline void chi_random(uint32_t i, float u[3])
{
  for (uint32_t k = 0; k < 3; k++) u[k] = unit_float(hash_combine(1000 + k, i));
}

// Upper regularised incomplete gamma function Q(a, x): series below a + 1, Lentz's continued fraction above
// (Abramowitz and Stegun 6.5.29 and 6.5.31).
static inline double gamma_q(double a, double x)
{
  if (x <= 0) return 1;
  const double scale = exp(a * log(x) - x - lgamma(a));
  if (x < a + 1) {
    double sum = 1 / a, term = sum;
    for (int n = 1; n < 10000 && term > sum * 1e-15; n++) sum += term *= x / (a + n);
    return 1 - sum * scale;
  }
  double b = x + 1 - a, c = 1e300, d = 1 / b, h = d;
  for (int n = 1; n < 10000; n++) {
    const double an = -n * (n - a);
    b += 2;
    d = 1 / (an * d + b);
    c = b + an / c;
    h *= d * c;
    if (fabs(d * c - 1) < 1e-15) break;
  }
  return h * scale;
}

// Cells are equal in the cosine to y and in the angle around it.
static inline int chi_cell(Vec3 d)
{
  const double row = (1 - (double)d[1]) / 2 * CHI_ROWS,
               turn = atan2((double)d[2], (double)d[0]) / (2 * M_PI) + 0.5;
  const int r = (int)fmin(fmax(row, 0), CHI_ROWS - 1), c = (int)fmin(turn * CHI_COLUMNS, CHI_COLUMNS - 1);
  return r * CHI_COLUMNS + c;
}

static inline Vec3 chi_direction(double row, double column)
{
  const double y = 1 - 2 * row / CHI_ROWS, r = sqrt(fmax(0, 1 - y * y));
  const double phi = (column / CHI_COLUMNS - 0.5) * 2 * M_PI;
  return v3((float)(r * cos(phi)), (float)y, (float)(r * sin(phi)));
}

// Mean density over a cell by n x n midpoints; *spread: the largest over the mean.
static inline double chi_cell_mean(const ChiCase *c, int row, int column, int n, double *spread)
{
  double sum = 0, most = 0;
  for (int i = 0; i < n; i++)
    for (int j = 0; j < n; j++) {
      const double p = c->pdf(c->user, chi_direction(row + (i + 0.5) / n, column + (j + 0.5) / n));
      sum += p;
      most = fmax(most, p);
    }
  *spread = sum > 0 ? most * n * n / sum : 1;
  return sum / (n * n);
}

// The chance that counts differ so much from what is expected. Cells that expect fewer than 5 are thrown together, with
// what lies in no cell: pool expected, pool_count counted.
static inline double chi_pearson(const double *expected, const double *counted, int cells, double pool,
                                 double pool_count)
{
  double statistic = 0;
  int degrees = -1;
  for (int i = 0; i < cells; i++) {
    const double e = expected[i];
    if (e < 5) {
      pool += e;
      pool_count += counted[i];
    } else {
      statistic += (counted[i] - e) * (counted[i] - e) / e;
      degrees++;
    }
  }
  if (pool >= 5) statistic += (pool_count - pool) * (pool_count - pool) / pool, degrees++;
  return degrees > 0 ? gamma_q(degrees / 2.0, statistic / 2) : 1;
}

static inline ChiResult chi_square(const ChiCase *c, uint32_t sample_count)
{
  static double expected[CHI_CELLS], counted[CHI_CELLS];
  ChiResult out = {0};
  for (int i = 0; i < CHI_CELLS; i++) {
    double spread;
    expected[i] = chi_cell_mean(c, i / CHI_COLUMNS, i % CHI_COLUMNS, c->fineness ? c->fineness : 5, &spread);
    const bool is_peak = expected[i] > 0.02 && spread > 1.05;
    const int n = !is_peak ? 0 : spread > 2 ? 64 : 20;
    if (n) expected[i] = chi_cell_mean(c, i / CHI_COLUMNS, i % CHI_COLUMNS, n, &spread);
    expected[i] *= 4 * M_PI / CHI_CELLS;
    out.integral += expected[i];
    counted[i] = 0;
  }
  uint32_t accepted = 0;
  for (uint32_t i = 0; i < sample_count; i++) {
    Vec3 d;
    if (!c->sample(c->user, i, &d)) continue;
    accepted++;
    counted[chi_cell(d)]++;
  }
  out.accepted = (double)accepted / sample_count;
  for (int i = 0; i < CHI_CELLS; i++) expected[i] *= sample_count;
  out.p =
      chi_pearson(expected, counted, CHI_CELLS, (1 - out.integral) * sample_count, sample_count - accepted);
  return out;
}

// The level of one of n tests such that all together fail by chance once in a hundred runs of other seeds.
static inline double sidak_level(int n)
{
  return 1 - pow(1 - 0.01, 1.0 / n);
}

#endif
