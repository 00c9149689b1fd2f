// See formula_range.h.

#include "geom/formula_range.h"

#include "geom/sdf.h"

typedef struct Span {
  double lo, hi;
} Span;

typedef struct Dual { // a value and its slopes along x, y and z
  Span v, slope[3];
} Dual;

// Spans hold numbers, infinite ones among them: infinity less infinity is the only thing that would make others of them
// (add), so these need not care for what is no number.
static double least_of(double a, double b) { return a < b ? a : b; }
static double most_of(double a, double b) { return a > b ? a : b; }

static const Span whole = {-INFINITY, INFINITY}, nothing = {0, 0};

static bool has_zero(Span a) { return a.lo <= 0 && a.hi >= 0; }
static double most(Span a) { return most_of(fabs(a.lo), fabs(a.hi)); }

// Where an end would be no number, that end is not known.
static Span add(Span a, Span b)
{
  const double lo = a.lo + b.lo, hi = a.hi + b.hi;
  return (Span){lo == lo ? lo : -INFINITY, hi == hi ? hi : INFINITY};
}

static Span negate(Span a) { return (Span){-a.hi, -a.lo}; }
static Span hull(Span a, Span b) { return (Span){least_of(a.lo, b.lo), most_of(a.hi, b.hi)}; }

static double product(double a, double b) { return a == 0 || b == 0 ? 0 : a * b; } // 0 times infinity is 0

static Span times(Span a, Span b)
{
  const double p[4] = {product(a.lo, b.lo), product(a.lo, b.hi), product(a.hi, b.lo), product(a.hi, b.hi)};
  return (Span){least_of(least_of(p[0], p[1]), least_of(p[2], p[3])), most_of(most_of(p[0], p[1]), most_of(p[2], p[3]))};
}

static Span invert(Span a) { return has_zero(a) ? whole : (Span){1 / a.hi, 1 / a.lo}; }

// Of sin over a span: the ends, and 1 or -1 where a top or a bottom lies between.
static Span sine(Span a)
{
  const double pi = 3.14159265358979323846;
  if (!(a.hi - a.lo < 2 * pi) || !(most(a) < 1e6)) return (Span){-1, 1};
  Span s = {least_of(sin(a.lo), sin(a.hi)), most_of(sin(a.lo), sin(a.hi))};
  if (floor((a.hi - pi / 2) / (2 * pi)) > floor((a.lo - pi / 2) / (2 * pi))) s.hi = 1;
  if (floor((a.hi + pi / 2) / (2 * pi)) > floor((a.lo + pi / 2) / (2 * pi))) s.lo = -1;
  return s;
}

static Span cosine(Span a)
{
  const double quarter = 1.57079632679489661923;
  return sine((Span){a.lo + quarter, a.hi + quarter});
}

// f(a) with a known span of values and of f'.
static Dual chain(Span v, Span rise, const Dual *a)
{
  Dual r = {.v = v};
  for (int k = 0; k < 3; k++) r.slope[k] = times(rise, a->slope[k]);
  return r;
}

static Dual dual_add(const Dual *a, const Dual *b)
{
  Dual r = {.v = add(a->v, b->v)};
  for (int k = 0; k < 3; k++) r.slope[k] = add(a->slope[k], b->slope[k]);
  return r;
}

static Dual dual_negate(const Dual *a)
{
  return chain(negate(a->v), (Span){-1, -1}, a);
}

static Dual dual_multiply(const Dual *a, const Dual *b)
{
  Dual r = {.v = times(a->v, b->v)};
  if (a == b) r.v = (Span){has_zero(a->v) ? 0 : least_of(a->v.lo * a->v.lo, a->v.hi * a->v.hi), most(a->v) * most(a->v)};
  for (int k = 0; k < 3; k++) r.slope[k] = add(times(a->slope[k], b->v), times(a->v, b->slope[k]));
  return r;
}

static Dual dual_invert(const Dual *a)
{
  const Span i = invert(a->v);
  return chain(i, negate(times(i, i)), a);
}

static Dual dual_min(const Dual *a, const Dual *b)
{
  if (a->v.hi < b->v.lo) return *a;
  if (b->v.hi < a->v.lo) return *b;
  Dual r = {.v = {least_of(a->v.lo, b->v.lo), least_of(a->v.hi, b->v.hi)}};
  for (int k = 0; k < 3; k++) r.slope[k] = hull(a->slope[k], b->slope[k]);
  return r;
}

static Dual dual_max(const Dual *a, const Dual *b)
{
  const Dual c = dual_negate(a), d = dual_negate(b), least = dual_min(&c, &d);
  return dual_negate(&least);
}

static Dual dual_abs(const Dual *a)
{
  if (a->v.lo >= 0) return *a;
  if (a->v.hi <= 0) return dual_negate(a);
  return chain((Span){0, most(a->v)}, (Span){-1, 1}, a);
}

static Dual dual_sqrt(const Dual *a)
{
  const double lo = sqrt(most_of(a->v.lo, 0)), hi = sqrt(most_of(a->v.hi, 0));
  return chain((Span){lo, hi}, (Span){hi > 0 ? 0.5 / hi : 0, lo > 0 ? 0.5 / lo : INFINITY}, a);
}

static Dual dual_exp(const Dual *a)
{
  const double m = FORMULA_MOST_EXPONENT;
  const Span e = {exp(least_of(most_of(a->v.lo, -m), m)), exp(least_of(most_of(a->v.hi, -m), m))};
  return chain(e, (Span){0, e.hi}, a);
}

// What jumps is as steep as can be, unless the box lies between two jumps.
static Dual dual_floor(const Dual *a)
{
  const Span v = {floor(a->v.lo), floor(a->v.hi)};
  return chain(v, v.lo == v.hi ? nothing : whole, a);
}

// |(a, b, c)|: the slope is a mean of theirs with weights of length one.
static Dual dual_length(const Dual *const parts[], int count)
{
  double lo = 0, hi = 0;
  for (int i = 0; i < count; i++) {
    const double least = has_zero(parts[i]->v) ? 0 : least_of(fabs(parts[i]->v.lo), fabs(parts[i]->v.hi));
    lo += least * least;
    hi += most(parts[i]->v) * most(parts[i]->v);
  }
  Dual r = {.v = {sqrt(lo), sqrt(hi)}};
  const Span over = lo > 0 ? invert(r.v) : whole;
  for (int k = 0; k < 3; k++) {
    Span slope = nothing;
    double bound = 0;
    for (int i = 0; i < count; i++) {
      Span weight = times(parts[i]->v, over);
      weight = (Span){most_of(weight.lo, -1), least_of(weight.hi, 1)};
      slope = add(slope, times(weight, parts[i]->slope[k]));
      bound += most(parts[i]->slope[k]) * most(parts[i]->slope[k]);
    }
    bound = sqrt(bound);
    r.slope[k] = (Span){most_of(slope.lo, -bound), least_of(slope.hi, bound)};
  }
  return r;
}

static Dual dual_atan2(const Dual *y, const Dual *x)
{
  const double pi = 3.14159265358979323846;
  Dual r = {.v = {-pi, pi}, .slope = {whole, whole, whole}};
  if (has_zero(y->v) && x->v.lo <= 0) return r; // the jump, or the middle
  const Span length2 = add(times(x->v, x->v), times(y->v, y->v));
  const double least_x = has_zero(x->v) ? 0 : least_of(fabs(x->v.lo), fabs(x->v.hi));
  const double least_y = has_zero(y->v) ? 0 : least_of(fabs(y->v.lo), fabs(y->v.hi));
  const Span over = invert((Span){least_x * least_x + least_y * least_y, length2.hi});
  r.v = (Span){INFINITY, -INFINITY}; // monotone in each operand, so corners are enough
  for (int i = 0; i < 4; i++) {
    const double a = atan2(i & 1 ? y->v.hi : y->v.lo, i & 2 ? x->v.hi : x->v.lo);
    r.v = hull(r.v, (Span){a, a});
  }
  for (int k = 0; k < 3; k++)
    r.slope[k] = times(add(times(x->v, y->slope[k]), negate(times(y->v, x->slope[k]))), over);
  return r;
}

static Dual dual_noise(const Dual *const parts[3])
{
  Dual r = {.v = {-SDF_NOISE_HIGH, SDF_NOISE_HIGH}};
  for (int k = 0; k < 3; k++) {
    double along = 0;
    for (int i = 0; i < 3; i++) along += most(parts[i]->slope[k]) * most(parts[i]->slope[k]);
    r.slope[k] = (Span){-SDF_NOISE_STEEP * sqrt(along), SDF_NOISE_STEEP * sqrt(along)};
  }
  return r;
}

// min(a, b) - h^3 k / 6: between their slopes, and by k between -1/6 and 0.
static Dual dual_smooth_min(const Dual *a, const Dual *b, const Dual *c)
{
  const double k = most_of(c->v.hi, 0);
  Dual r = {.v = add((Span){least_of(a->v.lo, b->v.lo), least_of(a->v.hi, b->v.hi)}, (Span){-k / 6, 0})};
  for (int i = 0; i < 3; i++) {
    r.slope[i] = add(hull(a->slope[i], b->slope[i]), times((Span){-1.0 / 6, 0}, c->slope[i]));
  }
  return r;
}

static Dual dual_mod(const Dual *a, const Dual *b)
{
  const Dual over = dual_invert(b), part = dual_multiply(a, &over), whole_part = dual_floor(&part);
  const Dual taken = dual_multiply(b, &whole_part), minus = dual_negate(&taken);
  Dual r = dual_add(a, &minus);
  const double size = most(b->v); // a remainder lies between 0 and b, unless that is too near 0 to divide by
  if (b->v.lo < FORMULA_LEAST_DIVISOR && b->v.hi > -FORMULA_LEAST_DIVISOR) return r;
  r.v = (Span){most_of(r.v.lo, b->v.lo < 0 ? -size : 0), least_of(r.v.hi, b->v.hi > 0 ? size : 0)};
  return r;
}

static Dual step_dual(const FormulaStep *s, const Dual *r)
{
  const Dual *a = &r[s->in[0]], *b = &r[s->in[1]], *c = &r[s->in[2]];
  const Dual *const parts[3] = {a, b, c};
  Dual t, u;
  switch ((FormulaOp)s->op) {
  case FORMULA_CONSTANT: return (Dual){.v = {(double)s->value, (double)s->value}};
  case FORMULA_COPY: return *a;
  case FORMULA_ADD: return dual_add(a, b);
  case FORMULA_SUBTRACT: t = dual_negate(b); return dual_add(a, &t);
  case FORMULA_MULTIPLY: return dual_multiply(a, b);
  case FORMULA_DIVIDE: t = dual_invert(b); return dual_multiply(a, &t);
  case FORMULA_NEGATE: return dual_negate(a);
  case FORMULA_MIN: return dual_min(a, b);
  case FORMULA_MAX: return dual_max(a, b);
  case FORMULA_ABS: return dual_abs(a);
  case FORMULA_SQRT: return dual_sqrt(a);
  case FORMULA_SIN: return chain(sine(a->v), cosine(a->v), a);
  case FORMULA_COS: return chain(cosine(a->v), negate(sine(a->v)), a);
  case FORMULA_EXP: return dual_exp(a);
  case FORMULA_FLOOR: return dual_floor(a);
  case FORMULA_MOD: return dual_mod(a, b);
  case FORMULA_LENGTH2: return dual_length(parts, 2);
  case FORMULA_LENGTH3: return dual_length(parts, 3);
  case FORMULA_CLAMP: t = dual_max(a, b); return dual_min(&t, c);
  case FORMULA_MIX:
    t = dual_negate(a);
    t = dual_add(b, &t);
    u = dual_multiply(&t, c);
    return dual_add(a, &u);
  case FORMULA_SMOOTH_MIN: return dual_smooth_min(a, b, c);
  case FORMULA_SMOOTH_MAX: {
    const Dual na = dual_negate(a), nb = dual_negate(b);
    t = dual_smooth_min(&na, &nb, c);
    return dual_negate(&t);
  }
  case FORMULA_ATAN2: return dual_atan2(a, b);
  case FORMULA_NOISE: return dual_noise(parts);
  }
  unreachable();
}

FormulaRange formula_range(const Formula *f, const double lo[3], const double hi[3])
{
  Dual r[FORMULA_REGISTERS] = {0};
  for (int k = 0; k < 3; k++) {
    r[k].v = (Span){lo[k], hi[k]};
    r[k].slope[k] = (Span){1, 1};
  }
  for (uint32_t i = 0; i < f->count; i++) r[f->steps[i].out] = step_dual(&f->steps[i], r);
  const Dual *d = &r[f->result];
  double steep = 0;
  for (int k = 0; k < 3; k++) steep += most(d->slope[k]) * most(d->slope[k]);
  steep = sqrt(steep) * (1 + 1e-6);
  const double size = most(d->v), slack = 1e-6 * (size < INFINITY ? size : 0) + 1e-9;
  const bool is_known = d->v.lo <= d->v.hi; // else rounding turned it inside out
  return (FormulaRange){is_known ? d->v.lo - slack : -INFINITY, is_known ? d->v.hi + slack : INFINITY,
                        steep < FORMULA_STEEPEST ? steep : FORMULA_STEEPEST};
}
