// Solid: shapes given by formulas, in double. A solid is asked where a line crosses its skin, anywhere on the line, so
// that the same answer serves a ray (the first crossing ahead), a body cut out of another (which side a stretch is on)
// and the surface point (the crossing again, without the rounding of Hit.t).
//
//   plane      z = 0, facing +z; inside is z < 0
//   triangle   (0, 0), (1, 0), (0, 1) in the plane z = 0, facing +z; x and y are the weights of two corners
//   box        |x|, |y|, |z| at most size
//   round      x^2 + z^2 + bulge y^2 = (radius + slope y)^2 for low <= y <= high: sphere, cylinder and cone, whole or
//              cut off, open or with flat caps. radius + slope y is nowhere negative between low and high.
//   torus      a ring of radius size[0] around the y axis, its tube of radius size[1]
//
// Every formula starts at the point of the line nearest to the shape's centre: the constant term of a quadric grows
// with the square of the distance, and with it what a root loses (Haines et al., "Precision Improvements for
// Ray/Sphere Intersection", Ray Tracing Gems 2019, chapter 7, is the same thought). What is left is 1e-16 of that
// distance.
//
// Does not know maps, trees, materials or C's libm beyond sqrt.

#ifndef RAYFOLD_GEOM_SOLID_H
#define RAYFOLD_GEOM_SOLID_H

#include "base/err.h"
#include "base/fmath.h"
#include "geom/bounds.h"

typedef enum SolidKind { SOLID_PLANE, SOLID_TRIANGLE, SOLID_BOX, SOLID_ROUND, SOLID_TORUS } SolidKind;

typedef struct Solid {
  uint8_t kind;   // SolidKind
  bool is_closed; // it has an inside: a round's caps are there
  float size[3];  // of box (half extents) and torus
  double bulge, radius, slope, low, high; // of round
} Solid;

// Parts of the skin, for texture coordinates and normals.
enum { PART_SIDE, PART_LOW, PART_HIGH, SOLID_PARTS = 8 }; // of a box: 2 * axis + (1 on the positive side)
enum { MOST_CROSSINGS = 4 };

typedef struct SolidRay {
  double o[3], d[3];
} SolidRay;

typedef struct Crossing {
  double t;
  uint32_t part;
} Crossing;

// Where a line crosses a skin, in order. Closed ones are entered and left in turns.
typedef struct Crossings {
  Crossing at[MOST_CROSSINGS];
  int count;
  bool begins_inside; // of closed ones, far behind the origin
} Crossings;

static inline double solid_dot(const double a[3], const double b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void crossings_add(Crossings *c, double t, uint32_t part)
{
  if (t > -INFINITY && t < INFINITY) c->at[c->count++] = (Crossing){t, part};
}

// A stretch of the line, which may have no ends, and what bounds it.
typedef struct Stretch {
  double from, to;
  uint32_t from_part, to_part;
} Stretch;

static inline void stretch_cut(Stretch *s, double from, double to, uint32_t from_part, uint32_t to_part)
{
  if (from > s->from) {
    s->from = from;
    s->from_part = from_part;
  }
  if (to < s->to) {
    s->to = to;
    s->to_part = to_part;
  }
}

// Between two parallel planes. Nothing is left when the line runs beside them.
static inline void stretch_cut_slab(Stretch *s, double low, double high, double o, double d, uint32_t part)
{
  if (d > 0) {
    stretch_cut(s, (low - o) / d, (high - o) / d, part, part + 1);
  } else if (d < 0) {
    stretch_cut(s, (high - o) / d, (low - o) / d, part + 1, part);
  } else if (!(low <= o && o <= high)) {
    s->to = -INFINITY;
  }
}

static inline Crossings stretch_crossings(const Stretch *s, double shift)
{
  Crossings c = {.count = 0};
  if (!(s->from < s->to)) return c;
  c.begins_inside = s->from == -INFINITY;
  crossings_add(&c, s->from + shift, s->from_part);
  crossings_add(&c, s->to + shift, s->to_part);
  return c;
}

// The line's place nearest to the origin, or to the y axis, as a distance along it, and the ray moved there.
static inline double solid_shift(const SolidRay *r, bool to_axis, SolidRay *near)
{
  const double across2 = r->d[0] * r->d[0] + r->d[2] * r->d[2];
  double shift = -solid_dot(r->o, r->d) / solid_dot(r->d, r->d);
  if (to_axis && across2 > 0) shift = -(r->o[0] * r->d[0] + r->o[2] * r->d[2]) / across2;
  for (int k = 0; k < 3; k++) {
    near->o[k] = r->o[k] + shift * r->d[k];
    near->d[k] = r->d[k];
  }
  return shift;
}

// --- round ------------------------------------------------------------------------------------------

// The stretch of the line inside a t^2 + 2 b t + c <= 0. A cone has two halves; where the line goes along it, a < 0, it
// is inside both, and that with a positive radius is meant: ahead when the radius grows along the line.
static inline bool quadric_stretch(double a, double b, double c, bool grows, Stretch *s)
{
  double discriminant = b * b - a * c;
  *s = (Stretch){-INFINITY, INFINITY, PART_SIDE, PART_SIDE};
  // A line through a cone's tip has a discriminant of zero, give or take what rounding leaves of its terms.
  if (!(discriminant >= -0x1p-50 * (b * b + fabs(a * c)))) return false;
  const double root = sqrt(discriminant > 0 ? discriminant : 0), q = -(b + copysign(root, b));
  a += 0; // -0 becomes 0
  if (q == 0) {
    if (a == 0) return c < 0; // beside the axis of a cylinder
    s->from = s->to = 0;
    if (a < 0) *(grows ? &s->to : &s->from) = grows ? INFINITY : -INFINITY;
    return a < 0;
  }
  // The smaller root by c / q: b and the root would cancel. With a = 0 the other one is infinite, on the right side.
  const double t0 = q / a, t1 = c / q, low = t0 < t1 ? t0 : t1, high = t0 < t1 ? t1 : t0;
  if (a >= 0) {
    s->from = low;
    s->to = high;
  } else if (grows) {
    s->from = high;
  } else {
    s->to = low;
  }
  return true;
}

static inline Crossings round_cross(const Solid *s, const SolidRay *ray)
{
  SolidRay r;
  const bool is_endless = s->low == -INFINITY && s->bulge == 0 && s->slope == 0; // a cylinder, the same at every height
  const double shift = solid_shift(ray, is_endless, &r), x = r.o[0], y = r.o[1], z = r.o[2], dy = r.d[1];
  const double radius = s->radius + s->slope * y, grow = s->slope * dy;
  const double a = r.d[0] * r.d[0] + r.d[2] * r.d[2] + s->bulge * dy * dy - grow * grow;
  const double b = x * r.d[0] + z * r.d[2] + s->bulge * y * dy - radius * grow;
  const double c = x * x + z * z + s->bulge * y * y - radius * radius;
  Stretch inside;
  if (!quadric_stretch(a, b, c, grow > 0, &inside)) return (Crossings){.count = 0};
  if (s->is_closed) {
    stretch_cut_slab(&inside, s->low, s->high, y, dy, PART_LOW);
    return stretch_crossings(&inside, shift);
  }
  Stretch between = {-INFINITY, INFINITY, 0, 0};
  Crossings found = {.count = 0};
  stretch_cut_slab(&between, s->low, s->high, y, dy, PART_LOW);
  if (between.from <= inside.from && inside.from <= between.to) crossings_add(&found, inside.from + shift, PART_SIDE);
  if (between.from <= inside.to && inside.to <= between.to) crossings_add(&found, inside.to + shift, PART_SIDE);
  return found;
}

// --- box, plane, triangle ---------------------------------------------------------------------------

static inline Crossings box_cross(const Solid *s, const SolidRay *r)
{
  Stretch inside = {-INFINITY, INFINITY, 0, 0};
  for (uint32_t k = 0; k < 3; k++) {
    const double half = s->size[k];
    stretch_cut_slab(&inside, -half, half, r->o[k], r->d[k], 2 * k);
  }
  return stretch_crossings(&inside, 0);
}

static inline Crossings plane_cross(const SolidRay *r)
{
  Crossings c = {.begins_inside = r->d[2] > 0 || (r->d[2] == 0 && r->o[2] < 0)};
  if (r->d[2] != 0) crossings_add(&c, -r->o[2] / r->d[2], PART_SIDE);
  return c;
}

static inline Crossings unit_triangle_cross(const SolidRay *r)
{
  Crossings c = {.count = 0};
  const double t = -r->o[2] / r->d[2], x = r->o[0] + t * r->d[0], y = r->o[1] + t * r->d[1];
  if (r->d[2] != 0 && x >= 0 && y >= 0 && x + y <= 1) crossings_add(&c, t, PART_SIDE);
  return c;
}

// --- torus --------------------------------------------------------------------------------------------

// t^4 + p t^2 + q t + s, or by rank 1 and 2 its derivatives over 4 and 12.
typedef struct Quartic {
  double p, q, s;
} Quartic;

static inline double quartic_at(const Quartic *f, int rank, double t)
{
  if (rank == 2) return t * t + f->p / 6;
  if (rank == 1) return (t * t + f->p / 2) * t + f->q / 4;
  return ((t * t + f->p) * t + f->q) * t + f->s;
}

// The root in an interval where the function goes through zero once: Newton's steps, and halving where they leave it.
// 60 halvings reach the last bit; a dozen steps is what it takes.
static inline double quartic_root(const Quartic *f, int rank, double low, double high, bool is_rising)
{
  const double factor = rank == 1 ? 3 : 4; // of the next derivative
  double t = (low + high) / 2;
  for (int i = 0; i < 60; i++) {
    const double value = quartic_at(f, rank, t);
    if (value == 0) return t;
    *((value < 0) == is_rising ? &low : &high) = t;
    double next = t - value / (factor * quartic_at(f, rank + 1, t));
    if (!(next > low && next < high)) next = (low + high) / 2;
    if (next == t) return t;
    t = next;
  }
  return t;
}

// Roots between the given places, which hold all turning points; the places are the first and the last and in order.
static inline int quartic_roots(const Quartic *f, int rank, const double *place, int count, double *roots)
{
  int found = 0;
  for (int i = 0; i + 1 < count; i++) {
    const double a = quartic_at(f, rank, place[i]), b = quartic_at(f, rank, place[i + 1]);
    if ((a < 0) != (b < 0)) roots[found++] = quartic_root(f, rank, place[i], place[i + 1], a < 0);
  }
  return found;
}

// From the nearest point, o.d = 0, the torus' equation (|p|^2 + R^2 - r^2)^2 = 4 R^2 (x^2 + z^2) has no cubic term. Its
// roots lie between its turning points, those between theirs, which are the roots of a quadratic: no root is missed,
// however close to another (the method is old; Bernstein, Graphics Gems V, 1995, uses it for any polynomial).
static inline Crossings torus_cross(const Solid *s, const SolidRay *ray)
{
  SolidRay r;
  Crossings found = {.count = 0};
  const double shift = solid_shift(ray, false, &r), speed = sqrt(solid_dot(r.d, r.d));
  const double ring = s->size[0], tube = s->size[1], outer = ring + tube;
  const double far2 = solid_dot(r.o, r.o) / (outer * outer);
  if (!(far2 < 1)) return found;
  // In units of the outer radius and of the ray's length.
  double o[3], d[3];
  for (int k = 0; k < 3; k++) {
    o[k] = r.o[k] / outer;
    d[k] = r.d[k] / speed;
  }
  const double ring2 = ring * ring / (outer * outer), tube2 = tube * tube / (outer * outer);
  const double k = far2 + ring2 - tube2;
  const Quartic f = {.p = 2 * k - 4 * ring2 * (d[0] * d[0] + d[2] * d[2]),
                     .q = -8 * ring2 * (o[0] * d[0] + o[2] * d[2]),
                     .s = k * k - 4 * ring2 * (o[0] * o[0] + o[2] * o[2])};
  const double end = sqrt(1 - far2) * (1 + 0x1p-40);
  double place[5] = {-end}, roots[4];
  int count = 1;
  const double turn = f.p < 0 ? sqrt(-f.p / 6) : 0;
  if (turn > 0 && turn < end) {
    place[count++] = -turn;
    place[count++] = turn;
  }
  place[count++] = end;
  const int turns = quartic_roots(&f, 1, place, count, roots);
  for (int i = 0; i < turns; i++) place[1 + i] = roots[i];
  place[1 + turns] = end;
  const int crossings = quartic_roots(&f, 0, place, 2 + turns, roots);
  if (crossings & 1) return found; // an end inside, by rounding: the line touches the outer circle
  for (int i = 0; i < crossings; i++) crossings_add(&found, roots[i] * (outer / speed) + shift, PART_SIDE);
  return found;
}

// --- all ----------------------------------------------------------------------------------------------

static inline Crossings solid_cross(const Solid *s, const SolidRay *r)
{
  switch ((SolidKind)s->kind) {
  case SOLID_PLANE: return plane_cross(r);
  case SOLID_TRIANGLE: return unit_triangle_cross(r);
  case SOLID_BOX: return box_cross(s, r);
  case SOLID_ROUND: return round_cross(s, r);
  case SOLID_TORUS: return torus_cross(s, r);
  }
  unreachable();
}

static inline void solid_point(const SolidRay *r, double t, double p[3])
{
  for (int k = 0; k < 3; k++) p[k] = r->o[k] + t * r->d[k];
}

// How far outside a point is, in object space: negative inside. Of open ones only its zeros count. For tests and for
// whoever marches; a distance for all but cones, whose side it foreshortens.
static inline double solid_field(const Solid *s, const double p[3])
{
  const double across = sqrt(p[0] * p[0] + p[2] * p[2]);
  switch ((SolidKind)s->kind) {
  case SOLID_PLANE:
  case SOLID_TRIANGLE: return p[2];
  case SOLID_BOX: return fmax(fabs(p[0]) - s->size[0], fmax(fabs(p[1]) - s->size[1], fabs(p[2]) - s->size[2]));
  case SOLID_ROUND: {
    const double side = sqrt(across * across + s->bulge * p[1] * p[1]) - (s->radius + s->slope * p[1]);
    return s->is_closed ? fmax(side, fmax(s->low - p[1], p[1] - s->high)) : side;
  }
  case SOLID_TORUS: return sqrt((across - s->size[0]) * (across - s->size[0]) + p[1] * p[1]) - s->size[1];
  }
  unreachable();
}

static inline Vec3 solid_vec(double x, double y, double z) { return v3((float)x, (float)y, (float)z); }

// The outward normal, not of unit length.
static inline Vec3 solid_normal(const Solid *s, uint32_t part, const double p[3])
{
  switch ((SolidKind)s->kind) {
  case SOLID_PLANE:
  case SOLID_TRIANGLE: return v3(0, 0, 1);
  case SOLID_BOX: {
    Vec3 n = v3_all(0);
    n[part >> 1] = part & 1 ? 1 : -1;
    return n;
  }
  case SOLID_ROUND: {
    if (part != PART_SIDE) return v3(0, part == PART_HIGH ? 1 : -1, 0);
    const double y = s->bulge * p[1] - s->slope * (s->radius + s->slope * p[1]);
    const double length = sqrt(p[0] * p[0] + y * y + p[2] * p[2]);
    if (!(length > 0)) return v3(0, s->slope < 0 ? 1 : -1, 0); // a cone's tip
    return solid_vec(p[0] / length, y / length, p[2] / length);
  }
  case SOLID_TORUS: {
    const double across = sqrt(p[0] * p[0] + p[2] * p[2]), scale = across > 0 ? 1 - s->size[0] / across : 0;
    const double length = sqrt(scale * scale * across * across + p[1] * p[1]);
    if (!(length > 0)) return v3(0, 1, 0);
    return solid_vec(p[0] * scale / length, p[1] / length, p[2] * scale / length);
  }
  }
  unreachable();
}

static inline float turn_of(double a, double b)
{
  return clamp_f((float)(fmath_atan2(a, b) * (0.5 / 3.14159265358979323846) + 0.5), 0, 1);
}

// u around the y axis as on a sphere, v from low to high (in metres where there are no ends); caps, like disks, show
// the square around them; a box shows all of uv on each side; a plane repeats every metre.
static inline Vec2 solid_uv(const Solid *s, uint32_t part, const double p[3])
{
  switch ((SolidKind)s->kind) {
  case SOLID_PLANE:
  case SOLID_TRIANGLE: return (Vec2){(float)p[0], (float)p[1]};
  case SOLID_BOX: {
    const uint32_t k = part >> 1, a = k == 0 ? 2 : 0, b = k == 1 ? 2 : 1;
    const double u = p[a] / (2 * s->size[a]), v = p[b] / (2 * s->size[b]);
    const bool is_turned = (part == 1) | (part == 4); // so that u runs to the right seen from outside
    return (Vec2){clamp_f((float)(0.5 + (is_turned ? -u : u)), 0, 1), clamp_f((float)(0.5 + (k == 1 && part == 3 ? -v : v)), 0, 1)};
  }
  case SOLID_ROUND: {
    if (part == PART_SIDE) {
      const bool is_sphere = s->bulge > 0, has_ends = s->low > -INFINITY && s->high < INFINITY;
      const double along = is_sphere ? 1 - (double)f_acos((float)(p[1] / s->radius)) / 3.14159265358979323846
                           : has_ends ? (p[1] - s->low) / (s->high - s->low)
                                      : p[1];
      return (Vec2){turn_of(p[0], p[2]), (float)along};
    }
    const double r = 2 * (s->radius + s->slope * (part == PART_LOW ? s->low : s->high));
    return (Vec2){clamp_f((float)(p[0] / r + 0.5), 0, 1),
                  clamp_f((float)((part == PART_LOW ? p[2] : -p[2]) / r + 0.5), 0, 1)};
  }
  case SOLID_TORUS:
    return (Vec2){turn_of(p[0], p[2]), turn_of(p[1], sqrt(p[0] * p[0] + p[2] * p[2]) - s->size[0])};
  }
  unreachable();
}

// How the place moves with u and v.
static inline void solid_derivatives(const Solid *s, uint32_t part, const double p[3], Vec3 *dpdu, Vec3 *dpdv)
{
  const double around = 2 * 3.14159265358979323846, across = sqrt(p[0] * p[0] + p[2] * p[2]);
  const double x = across > 0 ? p[0] / across : 0, z = across > 0 ? p[2] / across : 1; // outward
  switch ((SolidKind)s->kind) {
  case SOLID_PLANE:
  case SOLID_TRIANGLE:
    *dpdu = v3(1, 0, 0);
    *dpdv = v3(0, 1, 0);
    return;
  case SOLID_BOX: {
    const uint32_t k = part >> 1;
    const float sign = part == 1 || part == 4 ? -2 : 2;
    *dpdu = k == 0 ? v3(0, 0, sign * s->size[2]) : v3(sign * s->size[0], 0, 0);
    *dpdv = k == 1 ? v3(0, 0, part == 3 ? -2 * s->size[2] : 2 * s->size[2]) : v3(0, 2 * s->size[1], 0);
    return;
  }
  case SOLID_ROUND: {
    *dpdu = solid_vec(around * z * across, 0, -around * x * across);
    if (part != PART_SIDE) {
      const double width = 2 * (s->radius + s->slope * (part == PART_LOW ? s->low : s->high));
      *dpdu = solid_vec(width, 0, 0);
      *dpdv = solid_vec(0, 0, part == PART_LOW ? width : -width);
    } else if (s->bulge > 0) {
      *dpdv = solid_vec(-around / 2 * p[1] * x, around / 2 * across, -around / 2 * p[1] * z);
    } else {
      const double height = s->low > -INFINITY && s->high < INFINITY ? s->high - s->low : 1;
      *dpdv = solid_vec(height * s->slope * x, height, height * s->slope * z);
    }
    return;
  }
  case SOLID_TORUS:
    *dpdu = solid_vec(around * z * across, 0, -around * x * across);
    *dpdv = solid_vec(-around * p[1] * x, around * (across - s->size[0]), -around * p[1] * z);
    return;
  }
  unreachable();
}

static inline float solid_up(double x) { return (float)x + 0x1p-22f * fabsf((float)x); } // rounded away from inside

static inline Bounds bounds_of_half(double x, double y_low, double y_high, double z)
{
  return (Bounds){v3(-solid_up(x), -solid_up(-y_low), -solid_up(z)), v3(solid_up(x), solid_up(y_high), solid_up(z))};
}

// Its box in object space; not finite when it has no ends.
static inline Bounds solid_bounds(const Solid *s)
{
  switch ((SolidKind)s->kind) {
  case SOLID_PLANE: return (Bounds){v3(-INFINITY, -INFINITY, -INFINITY), v3(INFINITY, INFINITY, 0)};
  case SOLID_TRIANGLE: return (Bounds){v3(0, 0, 0), v3(1, 1, 0)};
  case SOLID_BOX: return (Bounds){v3(-s->size[0], -s->size[1], -s->size[2]), v3(s->size[0], s->size[1], s->size[2])};
  case SOLID_ROUND: {
    if (s->bulge > 0) return bounds_of_half(s->radius, -s->radius, s->radius, s->radius);
    const double low = s->radius + s->slope * s->low, high = s->radius + s->slope * s->high;
    const double widest = s->slope != 0 ? fmax(low, high) : s->radius;
    return bounds_of_half(widest, s->low, s->high, widest);
  }
  case SOLID_TORUS: {
    const double outer = (double)s->size[0] + s->size[1];
    return bounds_of_half(outer, -(double)s->size[1], s->size[1], outer);
  }
  }
  unreachable();
}

static inline Solid solid_sphere(float radius)
{
  return (Solid){.kind = SOLID_ROUND, .is_closed = true, .bulge = 1, .radius = radius, .low = -INFINITY, .high = INFINITY};
}

// Standing upright, its middle at the origin; a height of 0: without ends.
static inline Solid solid_frustum(float radius, float top_radius, float height, bool is_capped)
{
  if (height == 0)
    return (Solid){.kind = SOLID_ROUND, .is_closed = true, .radius = radius, .low = -INFINITY, .high = INFINITY};
  return (Solid){.kind = SOLID_ROUND, .is_closed = is_capped, .radius = ((double)radius + top_radius) / 2,
                 .slope = ((double)top_radius - radius) / height, .low = -(double)height / 2, .high = (double)height / 2};
}

// Its tip at the origin, growing wider downwards for ever.
static inline Solid solid_cone(double tangent)
{
  return (Solid){.kind = SOLID_ROUND, .is_closed = true, .slope = -tangent, .low = -INFINITY, .high = 0};
}

#endif
