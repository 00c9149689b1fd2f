// See arrow.h.

#include "arrow.h"

#include <math.h>

static double dot(rf_vec3 a, rf_vec3 b) { return (double)a.x * b.x + (double)a.y * b.y + (double)a.z * b.z; }

bool arrow_turn(const rf_world *w, const rf_body *arrow, const rf_body *home, double *turn, double *way)
{
  rf_body b = *arrow;
  if (b.cell != home->cell) return false;
  const rf_vec3 last = rf_toward(w, b.cell, b.frame.p, home->frame.p);
  *way = sqrt(dot(last, last));
  if (*way > 0) (void)rf_walk(w, &b, last, false);
  if (b.cell != home->cell) return false;
  const rf_vec3 left = rf_toward(w, b.cell, b.frame.p, home->frame.p);
  if (sqrt(dot(left, left)) > 1e-3 * (1 + *way)) return false; // a gate was on the way
  const double x = dot(home->frame.x, b.frame.z), y = dot(home->frame.y, b.frame.z), z = dot(home->frame.z, b.frame.z);
  *turn = atan2(sqrt(x * x + y * y), z);
  return true;
}
