// Sdf exact: a field in doubles, four places at a time: where on a ray its surface is, which way that faces, and whose
// part it is. Marching in floats finds the place to a float; here it is found again without their rounding.
//
// Normals are tetrahedron differences: four values at places normal_step / 2 off along (1, -1, -1), (-1, -1, 1),
// (-1, 1, -1), (1, 1, 1), summed with these as weights (Quilez, "Normals for an SDF"). On a surface that curves with a
// radius r they are off by about (normal_step / 2r)^2, and by 1e-16 / normal_step from rounding: with the steps world/
// chooses, under 1e-6 radians on smooth surfaces; creases are rounded over a normal_step.

#ifndef RAYFOLD_GEOM_SDF_EXACT_H
#define RAYFOLD_GEOM_SDF_EXACT_H

#include "base/err.h"
#include "geom/sdf.h"

typedef double Num4 __attribute__((vector_size(32)));
typedef int64_t Mask4 __attribute__((vector_size(32)));
typedef int32_t Int4 __attribute__((vector_size(16)));
typedef uint32_t Unsigned4 __attribute__((vector_size(16)));

static inline Num4 num4_set(double x) { return x - (Num4){0}; }
static inline Num4 num4_choose(Mask4 m, Num4 a, Num4 b) { return (Num4)((m & (Mask4)a) | (~m & (Mask4)b)); }
static inline Num4 num4_min(Num4 a, Num4 b) { return num4_choose(a < b, a, b); }
static inline Num4 num4_max(Num4 a, Num4 b) { return num4_choose(a > b, a, b); }
static inline Num4 num4_sqrt(Num4 a) { return (Num4){sqrt(a[0]), sqrt(a[1]), sqrt(a[2]), sqrt(a[3])}; }
static inline Int4 num4_to_int(Num4 a) { return (Int4){(int32_t)a[0], (int32_t)a[1], (int32_t)a[2], (int32_t)a[3]}; }
static inline Num4 num4_from_int(Int4 a) { return (Num4){(double)a[0], (double)a[1], (double)a[2], (double)a[3]}; }

#define NUM Num4
#define INT Int4
#define UNSIGNED Unsigned4
#define SDF_(name) name##_d
#define N_SET(x) num4_set((double)(x))
#define N_MIN(a, b) num4_min(a, b)
#define N_MAX(a, b) num4_max(a, b)
#define N_SQRT(a) num4_sqrt(a)
#define N_LESS(a, b, x, y) num4_choose((a) < (b), x, y)
#define N_TO_INT(a) num4_to_int(a)
#define N_FROM_INT(a) num4_from_int(a)
#include "geom/sdf_eval.h"

// The tape for a place: the leaf's of its cell, or the whole field's. Empty cells have none of their own.
static inline double sdf_value_at(const Sdf *f, const double p[3])
{
  const Num4 at[3] = {num4_set(p[0]), num4_set(p[1]), num4_set(p[2])};
  return sdf_run_d(f, f->codes + f->leaves->first, f->leaves->count, at, NULL)[0];
}

// A ray in the field's space, and the crossing it was found to have.
typedef struct SdfCrossing {
  double o[3], d[3], t;
  const SdfLeaf *leaf; // whose tape holds there
} SdfCrossing;

// The crossing again, without the rounding of the march: four places about it, and the chord between the two on either
// side. What is left is of the second order in their distance, 1e-12 of the way.
static inline double sdf_crossing_near(const Sdf *f, const SdfCrossing *c)
{
  const double reach = fabs(c->t) * 0x1p-20;
  Num4 t = c->t + reach * (Num4){-1, -0.25, 0.25, 1};
  Num4 at[3];
  for (int k = 0; k < 3; k++) at[k] = c->o[k] + t * c->d[k];
  const Num4 v = sdf_run_d(f, f->codes + c->leaf->first, c->leaf->count, at, NULL);
  double best = c->t, least = INFINITY;
  for (int i = 0; i < 3; i++)
    if ((v[i] < 0) != (v[i + 1] < 0)) return t[i] + (t[i + 1] - t[i]) * (v[i] / (v[i] - v[i + 1]));
  for (int i = 0; i < 4; i++) {
    if (!(fabs(v[i]) < least)) continue;
    least = fabs(v[i]);
    best = t[i];
  }
  return best;
}

// Points out of the surface; any length but 0.
static inline Vec3 sdf_normal(const Sdf *f, const SdfLeaf *leaf, const double p[3])
{
  static const double corner[3][4] = {{1, -1, -1, 1}, {-1, -1, 1, 1}, {-1, 1, -1, 1}};
  const double h = (double)f->normal_step * 0.5;
  Num4 at[3];
  Vec3 n = v3_all(0);
  for (int k = 0; k < 3; k++) at[k] = p[k] + h * (Num4){corner[k][0], corner[k][1], corner[k][2], corner[k][3]};
  const Num4 v = sdf_run_d(f, f->codes + leaf->first, leaf->count, at, NULL) * (1 / h);
  for (int k = 0; k < 3; k++)
    n[k] = (float)(v[0] * corner[k][0] + v[1] * corner[k][1] + v[2] * corner[k][2] + v[3] * corner[k][3]);
  return v3_is_zero(n) || !v3_is_finite(n) ? v3(0, 1, 0) : n;
}

// Whose part a place on the surface is, and its colour where parts are mixed.
typedef struct SdfOwner {
  uint32_t leaf;
  Vec3 color;
} SdfOwner;

// How much of the second of two joined values counts: the share of its slope in theirs, half where both are equal.
static inline double sdf_share(const SdfStep *s, double a, double b)
{
  const double k = (double)s->smooth;
  if (s->operation == SDF_SOFT_MAXIMUM) {
    const double apart = k > 0 ? fmin(fmax((a - b) / k, -18), 18) : a > b ? 18 : -18;
    const double e = sdf_decay_d(num4_set(fabs(apart)))[0];
    return apart > 0 ? e / (1 + e) : 1 / (1 + e);
  }
  if (s->operation == SDF_INTERSECTION) a = -a, b = -b;
  if (s->operation == SDF_DIFFERENCE) a = -a;
  const double h = k > 0 ? fmax(k - fabs(a - b), 0) / k : 0, other = h * h / 2;
  return b < a ? 1 - other : other;
}

// chance: 0..1, decides between materials that are mixed by chance.
static SDF_LARGE SdfOwner sdf_owner(const Sdf *f, const SdfLeaf *leaf, const double p[3], float chance)
{
  SdfOwner stack[SDF_MOST_DEPTH + 2];
  double values[SDF_MOST_DEPTH + 2];
  int height = 0;
  SdfTrace_d trace;
  Num4 at[3] = {num4_set(p[0]), num4_set(p[1]), num4_set(p[2])};
  SdfMemory_d m;
  sdf_begin_tape_d(&m, at);
  for (uint32_t i = 0; i < leaf->count; i++) {
    const uint16_t code = f->codes[leaf->first + i];
    const SdfStep *s = &f->steps[code >> 1];
    sdf_step_d(f, code, &m, &trace);
    if (s->kind == SDF_ENTER) continue;
    SdfOwner own = {s->leaf, f->colors ? v3_load(f->colors[s->leaf]) : v3_all(1)};
    if (s->kind == SDF_JOIN || s->kind == SDF_LEAVE) own = stack[--height];
    if (!(code & 1)) {
      const SdfOwner before = stack[--height];
      const double share = sdf_share(s, values[height], trace.value[0]);
      const bool takes = s->mix == SDF_MIX_MATERIAL ? (double)chance < share : share > 0.5;
      if (s->mix == SDF_MIX_MATERIAL) { // what is left of the chance decides further down
        chance = (float)(takes ? chance / share : (chance - share) / (1 - share));
        own = takes ? own : before;
      } else {
        const Vec3 mixed = s->mix == SDF_MIX_COLOR ? v3_mix(before.color, own.color, (float)share)
                                                   : (share > 0.5 ? own.color : before.color);
        own.leaf = takes ? own.leaf : before.leaf;
        own.color = mixed;
      }
    }
    values[height] = trace.joined[0];
    stack[height++] = own;
  }
  return stack[0];
}

#endif
