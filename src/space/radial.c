// Tables of radial.h. The integrals' inverse roots are taken out by substitutions that make what is left smooth, so a
// few hundred steps give nine digits wherever the way turns.

#include "space/radial.h"

// Composite Simpson.
enum { STEPS = 400 };
typedef double Integrand(double t, const void *what);

static double simpson(Integrand *f, const void *what, double to)
{
  const double step = to / STEPS;
  double sum = f(0, what) + f(to, what);
  for (int i = 1; i < STEPS; i++) sum += (i & 1 ? 4 : 2) * f(i * step, what);
  return sum * step / 3;
}

static double x_of_node(double v) { return pow(v * (2 - v), 4); }

// The table's first node has no finite x; its value is the limit, which is flat there to fourth order in v.
static void branch_fill(double (*angle)(double x, const void *what), const void *what, double log_part, double root_part,
                        RadialBranch *b)
{
  b->log_part = (float)log_part;
  b->root_part = (float)root_part;
  for (int i = 1; i <= RADIAL_NODES; i++) {
    const double x = x_of_node((double)i / RADIAL_NODES);
    b->nodes[i] = (float)(angle(x, what) + log_part * log(x) - root_part / sqrt(x));
  }
  b->nodes[0] = b->nodes[1];
}

// --- wormholes ------------------------------------------------------------------------------------

typedef struct Wormhole {
  double radius, throat, half_length, lensing; // DNGR's rho, a, M; no lensing: Ellis
  double reach;                                // r at the ball's surface, from the tube's end
} Wormhole;

// f(r): Ellis 1973; James et al. 2015, "Visualizing Interstellar's wormhole", equation 5.
static double worm_f(const Wormhole *w, double r)
{
  if (w->lensing == 0) return sqrt(r * r + w->throat * w->throat);
  const double x = 2 * r / (M_PI * w->lensing);
  return w->throat + w->lensing * (x * atan(x) - 0.5 * log1p(x * x));
}

static double worm_slope(const Wormhole *w, double r)
{
  return w->lensing == 0 ? r / worm_f(w, r) : 2 / M_PI * atan(2 * r / (M_PI * w->lensing));
}

// f grows by itself from its value at r0: f(r) = value has one r >= 0 (Newton, from the right as f is convex).
static double worm_where(const Wormhole *w, double value)
{
  double r = value > w->throat ? value + 4 * w->lensing + 1 : 0;
  for (int i = 0; i < 100 && r > 0; i++) {
    const double slope = worm_slope(w, r);
    const double next = slope > 0 ? r - (worm_f(w, r) - value) / slope : 0;
    if (!(next < r)) break;
    r = next > 0 ? next : 0;
  }
  return r;
}

// d angle / dr = b / (f sqrt(f^2 - b^2)). With r = r0 cosh t, or c sinh t where the way passes, the root's zero is
// that of dr: what is left is smooth. f - b near the turn is taken from its series, since both are nearly the same.
typedef struct WormWay {
  const Wormhole *w;
  double b, turn, scale;
} WormWay;

static double worm_speed(double r, double dr, const WormWay *way)
{
  const Wormhole *w = way->w;
  const double f = worm_f(w, r), b = way->b;
  double rest = f - b;
  if (w->lensing == 0 && way->turn > 0) rest = (r - way->turn) * (r + way->turn) / (f + b);
  return rest > 0 ? b * dr / (f * sqrt(rest * (f + b))) : 0;
}

static double worm_turned(double t, const void *what)
{
  const WormWay *way = what;
  const double r0 = way->turn;
  const double near = fmax(t, 1e-3); // even in t: the middle is as its surroundings
  const double r = r0 * cosh(near), dr = r0 * sinh(near);
  return worm_speed(r, dr, way);
}

static double worm_passed(double t, const void *what)
{
  const WormWay *way = what;
  return worm_speed(way->scale * sinh(t), way->scale * cosh(t), way);
}

static double worm_turned_angle(double x, const void *what)
{
  const Wormhole *w = what;
  WormWay way = {w, w->throat + x * (w->radius - w->throat), 0, 0};
  way.turn = w->lensing == 0 ? sqrt((way.b - w->throat) * (way.b + w->throat)) : worm_where(w, way.b);
  if (!(way.turn > 0 && way.turn < w->reach)) return 0;
  return 2 * simpson(worm_turned, &way, acosh(w->reach / way.turn));
}

static double worm_passed_angle(double x, const void *what)
{
  const Wormhole *w = what;
  WormWay way = {w, w->throat * (1 - x), 0, 0};
  // Where f^2 - b^2 has grown as much again as it is at the throat: f near there is throat + curve r^2 / 2.
  const double gap = (w->throat - way.b) * (w->throat + way.b);
  const double curve = w->lensing == 0 ? 1 / w->throat : 4 / (M_PI * M_PI * w->lensing);
  way.scale = sqrt(gap / (curve * w->throat));
  const double tube = w->half_length * way.b / (w->throat * sqrt(gap));
  return 2 * (tube + simpson(worm_passed, &way, asinh(w->reach / way.scale)));
}

static bool wormhole_fill(Wormhole *w, Radial *out)
{
  if (!(w->throat > 0 && w->radius > w->throat)) return false;
  w->reach = w->lensing == 0 ? sqrt((w->radius - w->throat) * (w->radius + w->throat)) : worm_where(w, w->radius);
  *out = (Radial){.radius = (float)w->radius, .critical = (float)w->throat};
  // Near the circle of light at the throat r grows as e^(angle / k), k = 1 / sqrt(f f'').
  const double k = w->lensing == 0 ? 1 : M_PI / 2 * sqrt(w->lensing / w->throat);
  branch_fill(worm_turned_angle, w, k, 0, &out->turned);
  // In a tube: 2 a b / (rho sqrt(rho^2 - b^2)) = a sqrt 2 / (rho sqrt x) and what is smooth.
  branch_fill(worm_passed_angle, w, k, w->half_length * M_SQRT2 / w->throat, &out->passed);
  return true;
}

bool radial_ellis(float radius, float throat, Radial *out)
{
  Wormhole w = {.radius = (double)radius, .throat = (double)throat};
  return wormhole_fill(&w, out);
}

bool radial_dngr(float radius, float throat, float half_length, float lensing, Radial *out)
{
  Wormhole w = {(double)radius, (double)throat, (double)half_length, (double)lensing, 0};
  return lensing > 0 && half_length >= 0 && wormhole_fill(&w, out);
}

// --- black holes ----------------------------------------------------------------------------------
// (du/d angle)^2 = 1/b^2 - u^2 + rs u^3 for u = 1/r (Schwarzschild's light; the same curve as the Newtonian motion of
// worlds.md, section 2.8). Its three roots u1 < 0 < u2 < u3 are real where the way turns, at u2.

typedef struct Hole {
  double radius, rs, critical;
} Hole;

static double hole_b2(const Hole *w, double h) // 1 / b^2
{
  return 1 / (h * h) - w->rs / (w->radius * w->radius * w->radius);
}

// Viete's three cosines for rs u^3 - u^2 + 1/b^2 = 0.
static void hole_roots(const Hole *w, double b2, double u[3])
{
  const double third = 1 / (3 * w->rs), c = 1 - 13.5 * b2 * w->rs * w->rs;
  const double angle = acos(fmax(fmin(c, 1), -1)) / 3;
  for (int i = 0; i < 3; i++) u[i] = third * (1 + 2 * cos(angle + 2 * M_PI * (i == 0 ? 1 : i == 1 ? 2 : 0) / 3));
}

// With u = u2 - y^2, y = c sinh t, c^2 = u3 - u2: the angle is the integral of 2 / sqrt(rs (u - u1)).
static double hole_speed(double t, const void *what)
{
  const double *p = what;
  const double y = p[2] * sinh(t);
  return 2 / sqrt(p[3] * (p[1] - y * y - p[0]));
}

static double hole_angle(double x, const void *what)
{
  const Hole *w = what;
  const double h = w->critical + x * (w->radius - w->critical);
  double u[3];
  hole_roots(w, hole_b2(w, h), u);
  const double p[4] = {u[0], u[1], sqrt(fmax(u[2] - u[1], 1e-14)), w->rs};
  const double y = sqrt(fmax(u[1] - 1 / w->radius, 0));
  return 2 * simpson(hole_speed, p, asinh(y / p[2]));
}

// u'' = 3/2 rs u^2 - u by Runge and Kutta's fourth order.
static void hole_step(double rs, double step, double *u, double *v)
{
  double ku[4], kv[4];
  for (int i = 0; i < 4; i++) {
    const double share = i == 0 ? 0 : i == 3 ? 1 : 0.5;
    const double un = *u + (i ? share * step * ku[i - 1] : 0), vn = *v + (i ? share * step * kv[i - 1] : 0);
    ku[i] = vn;
    kv[i] = 1.5 * rs * un * un - un;
  }
  *u += step / 6 * (ku[0] + 2 * ku[1] + 2 * ku[2] + ku[3]);
  *v += step / 6 * (kv[0] + 2 * kv[1] + 2 * kv[2] + kv[3]);
}

// The angle from the ball's surface to the horizon, where du/d angle > 1 / (3 sqrt 3 rs) and nothing is singular but the
// critical way itself.
static double hole_fall(const Hole *w, double b2)
{
  double u = 1 / w->radius, v = sqrt(b2 - u * u + w->rs * u * u * u), angle = 0;
  const double step = 2e-3;
  while (u < 1 / w->rs && angle < 40) {
    hole_step(w->rs, step, &u, &v);
    angle += step;
  }
  return angle - (u - 1 / w->rs) / v;
}

enum { STEPS_A_COLUMN = 8 };

static void orbit_row(const Hole *w, double b2, double angle, float *row)
{
  double u = 1 / w->radius, v = sqrt(fmax(b2 - u * u + w->rs * u * u * u, 0));
  for (int j = 0; j <= RADIAL_COLUMNS; j++) {
    row[j] = (float)u;
    for (int i = 0; i < STEPS_A_COLUMN; i++) hole_step(w->rs, angle / (RADIAL_COLUMNS * STEPS_A_COLUMN), &u, &v);
  }
}

bool radial_hole(float radius, float rs, RadialOrbits *orbits, Radial *out)
{
  // Light that grazes the ball must not be caught: the ball is larger than the circle of light.
  if (!(rs > 0 && radius >= 2 * rs)) return false;
  Hole w = {(double)radius, (double)rs, 0};
  w.critical = 1 / sqrt(4 / (27 * w.rs * w.rs) + w.rs / (w.radius * w.radius * w.radius));
  *out = (Radial){.radius = radius, .critical = (float)w.critical, .orbits = orbits};
  branch_fill(hole_angle, &w, 1, 0, &out->turned);
  for (int i = 0; i <= RADIAL_ROWS; i++) {
    const double x = fmax(x_of_node((double)i / RADIAL_ROWS), 1e-9);
    const double out_h = w.critical + x * (w.radius - w.critical), in_h = w.critical * fmax(1 - x, 1e-5);
    orbit_row(&w, hole_b2(&w, out_h), 0.5 * hole_angle(x, &w), orbits->u[0][i]);
    const double fall = hole_fall(&w, hole_b2(&w, in_h));
    orbits->total[i] = (float)fall;
    orbit_row(&w, hole_b2(&w, in_h), fall, orbits->u[1][i]);
  }
  return true;
}
