// See triangulate.h. Ears are cut in the plane of the polygon's Newell normal (Sutherland et al. 1974), dropping the
// largest axis; an ear is a convex corner whose triangle holds no other corner (Meisters 1975).

#include "scene/triangulate.h"

#include "base/vec.h"

enum { MOST_CLIPPED_CORNERS = 8192 };  // above it, one polygon could use up the whole file's work
#define MOST_TESTS ((size_t)400 << 20) // about a second

void triangulator_init(Triangulator *t)
{
  *t = (Triangulator){.tests_left = MOST_TESTS};
}

void triangulator_finish(Triangulator *t)
{
  array_finish(&t->points);
  array_finish(&t->ring);
}

static void fan(uint32_t first, uint32_t n, uint32_t *out)
{
  for (uint32_t i = 1; i + 1 < n; i++) {
    *out++ = first;
    *out++ = (first + i) % n;
    *out++ = (first + i + 1) % n;
  }
}

// The sum over edges of the cross products' parts: twice the area vector. Relative to the first corner, because far
// from the origin the products would cancel.
static void newell_normal(const float *c, uint32_t n, double normal[3])
{
  double prev[3] = {0};
  normal[0] = normal[1] = normal[2] = 0;
  for (uint32_t i = 1; i < n; i++) {
    double p[3];
    for (int k = 0; k < 3; k++) p[k] = (double)c[3 * (size_t)i + k] - (double)c[k];
    normal[0] += prev[1] * p[2] - prev[2] * p[1];
    normal[1] += prev[2] * p[0] - prev[0] * p[2];
    normal[2] += prev[0] * p[1] - prev[1] * p[0];
    for (int k = 0; k < 3; k++) prev[k] = p[k];
  }
}

// Drops the axis along which the normal is largest, swapping the others where needed so that the polygon turns
// counter-clockwise.
static void flatten(const float *c, uint32_t n, const double normal[3], double *out)
{
  int axis = 0;
  for (int k = 1; k < 3; k++)
    if (fabs(normal[k]) > fabs(normal[axis])) axis = k;
  int u = (axis + 1) % 3, v = (axis + 2) % 3;
  if (normal[axis] < 0) {
    const int swap = u;
    u = v;
    v = swap;
  }
  for (size_t i = 0; i < n; i++) {
    out[2 * i] = (double)c[3 * i + u];
    out[2 * i + 1] = (double)c[3 * i + v];
  }
}

// Twice the signed area of a triangle of corners; positive is counter-clockwise.
static double turn(const double *p, size_t a, size_t b, size_t c)
{
  return (p[2 * b] - p[2 * a]) * (p[2 * c + 1] - p[2 * a + 1]) -
         (p[2 * b + 1] - p[2 * a + 1]) * (p[2 * c] - p[2 * a]);
}

// Convex: never turns right, and goes round once, which is to say that x changes direction twice.
static bool is_convex(const double *p, uint32_t n)
{
  int changes = 0, direction = 0, first = 0;
  for (uint32_t i = 0; i < n; i++) {
    const uint32_t j = i + 1 == n ? 0 : i + 1, k = j + 1 == n ? 0 : j + 1;
    if (turn(p, i, j, k) < 0) return false;
    const double dx = p[2 * (size_t)j] - p[2 * (size_t)i];
    const int now = (dx > 0) - (dx < 0);
    if (!now) continue;
    changes += direction && now != direction;
    if (!first) first = now;
    direction = now;
  }
  return changes + (direction != first) <= 2;
}

static bool is_inside(const double *p, size_t a, size_t b, size_t c, size_t q)
{
  return turn(p, a, b, q) >= 0 && turn(p, b, c, q) >= 0 && turn(p, c, a, q) >= 0;
}

static bool is_same_place(const double *p, size_t a, size_t b)
{
  return p[2 * a] == p[2 * b] && p[2 * a + 1] == p[2 * b + 1];
}

// The corners left form a ring: ring[2i] is the one before i, ring[2i + 1] the one after.
static bool is_ear(Triangulator *t, const double *p, const uint32_t *ring, uint32_t i)
{
  const uint32_t a = ring[2 * (size_t)i], c = ring[2 * (size_t)i + 1];
  if (t->tests_left) t->tests_left--;
  if (turn(p, a, i, c) <= 0) return false;
  for (uint32_t q = ring[2 * (size_t)c + 1]; q != a; q = ring[2 * (size_t)q + 1]) {
    if (t->tests_left) t->tests_left--;
    // Only a corner that does not turn left can lie in an ear; polygons with a slit visit a place twice.
    if (turn(p, ring[2 * (size_t)q], q, ring[2 * (size_t)q + 1]) > 0) continue;
    if (is_same_place(p, q, a) || is_same_place(p, q, c) || is_same_place(p, q, i)) continue;
    if (is_inside(p, a, i, c, q)) return false;
  }
  return true;
}

static void clip_ears(Triangulator *t, const double *p, uint32_t *ring, uint32_t n, uint32_t *out)
{
  for (uint32_t i = 0; i < n; i++) {
    ring[2 * (size_t)i] = i ? i - 1 : n - 1;
    ring[2 * (size_t)i + 1] = i + 1 < n ? i + 1 : 0;
  }
  uint32_t left = n, at = 0, refused = 0;
  bool gave_up = false;
  while (left > 2) {
    const uint32_t before = ring[2 * (size_t)at], after = ring[2 * (size_t)at + 1];
    // With no ear left, either the rest lies on a line, or the polygon crosses itself: the corner at hand is cut all
    // the same. Corners on a line go last, because cutting them off early leaves cracks to the neighbours.
    const bool cut_anyway = left == 3 || gave_up || refused == left || !t->tests_left;
    gave_up = gave_up || (cut_anyway && left > 3 && turn(p, before, at, after) != 0);
    if (!cut_anyway && !is_ear(t, p, ring, at)) {
      refused++;
      at = after;
      continue;
    }
    *out++ = before;
    *out++ = at;
    *out++ = after;
    ring[2 * (size_t)before + 1] = after;
    ring[2 * (size_t)after] = before;
    left--;
    refused = 0;
    at = ring[2 * (size_t)after + 1]; // not the neighbour: that would cut long splinters round one corner
  }
  t->fan_count += gave_up;
}

// A quad folds along the diagonal through its corner that turns right, if there is one. (Two can be only when it
// crosses itself.)
static uint32_t quad_start(const double p[8])
{
  for (uint32_t i = 0; i < 4; i++)
    if (turn(p, (i + 3) % 4, i, (i + 1) % 4) < 0) return i;
  return 0;
}

bool triangulate(Triangulator *t, const float *corners, uint32_t n, uint32_t *out)
{
  double normal[3], quad[8];
  if (n <= 3) return fan(0, n, out), true;
  newell_normal(corners, n, normal);
  if (n == 4) {
    flatten(corners, n, normal, quad);
    return fan(quad_start(quad), 4, out), true;
  }
  if (!array_reserve(&t->points, 2 * (size_t)n)) return false;
  flatten(corners, n, normal, t->points.items);
  if (is_convex(t->points.items, n)) return fan(0, n, out), true;
  if (n > MOST_CLIPPED_CORNERS || !t->tests_left) {
    t->fan_count++;
    return fan(0, n, out), true;
  }
  if (!array_reserve(&t->ring, 2 * (size_t)n)) return false;
  clip_ears(t, t->points.items, t->ring.items, n, out);
  return true;
}
