// Formula range: bounds for a formula over a box: its values, and how steeply it changes. Interval arithmetic on values
// and derivatives (Moore, "Interval Analysis", 1966), in double and widened a little where results are handed out.

#ifndef RAYFOLD_GEOM_FORMULA_RANGE_H
#define RAYFOLD_GEOM_FORMULA_RANGE_H

#include "base/formula.h"

#define FORMULA_STEEPEST 1e4 // steeper, or with jumps, counts as this

typedef struct FormulaRange {
  double lo, hi, steep;
} FormulaRange;

FormulaRange formula_range(const Formula *f, const double lo[3], const double hi[3]);

#endif
