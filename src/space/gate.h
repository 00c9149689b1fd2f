// Gate: a surface that hands a ray on to another place, by a map for each of its sides. Flat ones are rectangles and
// outlines; closed ones, boxes and spheres, have their front outside. A wall is a flat gate whose whole plane ends the
// cell. Hot. Where gates are in the tree they are instances like any other, and the tree finds them; walls, and the far
// side of a closed gate that a ray is within, are found here, by formulas that cannot miss.
//
// A cell's coordinates are a chart: of a flat cell metres along three axes. A map goes from one chart to another; in flat
// cells it is affine, a turn or mirror times one scale. Does not know shapes, trees or worlds.

#ifndef RAYFOLD_SPACE_GATE_H
#define RAYFOLD_SPACE_GATE_H

#include "base/ray.h"
#include "space/ball.h"
#include "space/chart.h"

#define NO_CELL UINT32_MAX
#define NO_GATE UINT32_MAX

enum { GATE_FRONT, GATE_BACK }; // the side a ray goes in at: the front against the normal

typedef enum Aperture { APERTURE_RECT, APERTURE_POLYGON, APERTURE_BOX, APERTURE_SPHERE } Aperture;

// A gate of a curved cell maps by what is no Frame.
typedef struct GateCurve {
  float kappa, kappa_to; // of the cells on both sides, per square metre
  Mat4_f map;            // in units of the radius of curvature
  // Of a door, a ball whose outside goes on outside of another: map goes into the chart around its own middle, map_to out
  // of that of the other, where its boundary is at radius_to.
  bool is_door;
  float radius_to;
  Mat4_f map_to;
  // Of a ball that bends light, in flat cells: what it does, in charts as those of doors, and the way back out of it.
  const Ball *ball;
  Mat4_f back;
} GateCurve;

// Where one side leads.
typedef struct GateSide {
  Frame map;     // from this cell's chart into the other's
  float scale;   // lengths there of one here
  uint32_t cell; // NO_CELL: the side is not there, and rays pass
  uint32_t gate; // out of which one comes; NO_GATE: out of none
  bool is_shift; // the map only moves: directions stay what they are, to the bit
  bool is_into;  // one comes out within a closed gate
  bool is_null;  // the map is the identity
  const GateCurve *curve; // instead of the map; NULL: both sides are flat
} GateSide;

typedef struct SpaceGate {
  GateSide side[2];
  Frame own_from_cell; // to where it is centred, its normal along z; lengths stay
  Vec3 n;              // of a flat one: unit normal, to the front
  float c;             // its plane is n . p = c
  float size[3];       // half of its extent; of a sphere the radius
  const float *xy;     // corners of an outline, 2 each
  int32_t corner_count;
  uint8_t aperture;
  bool is_wall;
  uint32_t cell, instance; // instance: in the tree; NO_HIT for walls
} SpaceGate;

static inline bool gate_is_closed(const SpaceGate *g)
{
  return g->aperture == APERTURE_BOX || g->aperture == APERTURE_SPHERE;
}

// Where a line enters and leaves a closed gate; false: it passes by. The same roots as geom/sphere.h has, and slabs as
// Kay and Kajiya 1986; where rounding loses a grazing line, both are at the nearest point.
static inline bool gate_span(const SpaceGate *g, const Ray *ray, float *near, float *far)
{
  const Vec3 o = frame_point(&g->own_from_cell, ray->o), d = frame_vector(&g->own_from_cell, ray->d);
  if (g->aperture == APERTURE_SPHERE) {
    const float middle = -v3_dot(o, d) / v3_dot(d, d);
    const Vec3 closest = o + middle * d;
    const float left = g->size[0] * g->size[0] - v3_dot(closest, closest);
    const float half = safe_sqrt(left / v3_dot(d, d));
    *near = middle - half;
    *far = middle + half;
    return left >= 0;
  }
  *near = -INFINITY;
  *far = INFINITY;
  for (int k = 0; k < 3; k++) {
    if (d[k] == 0) continue;
    const float a = (-g->size[k] - o[k]) / d[k], b = (g->size[k] - o[k]) / d[k];
    *near = max_f(*near, min_f(a, b));
    *far = min_f(*far, max_f(a, b));
  }
  return *near <= *far;
}

// Which side a ray goes in at that meets the gate at t.
static inline int gate_side_at(const SpaceGate *g, const Ray *ray, float t)
{
  float near, far;
  if (!gate_is_closed(g)) return v3_dot(g->n, ray->d) < 0 ? GATE_FRONT : GATE_BACK;
  gate_span(g, ray, &near, &far);
  return fabsf(t - near) <= fabsf(t - far) ? GATE_FRONT : GATE_BACK;
}

// Whether a place in the plane of a flat gate is within its outline (crossing number).
static inline bool gate_has(const SpaceGate *g, Vec3 p)
{
  const Vec3 at = frame_point(&g->own_from_cell, p);
  if (g->aperture == APERTURE_RECT) return fabsf(at[0]) <= g->size[0] && fabsf(at[1]) <= g->size[1];
  bool is_in = false;
  for (int32_t i = 0, k = g->corner_count - 1; i < g->corner_count; k = i++) {
    const float *a = g->xy + 2 * i, *b = g->xy + 2 * k;
    if ((a[1] > at[1]) != (b[1] > at[1]) && at[0] < (b[0] - a[0]) * (at[1] - a[1]) / (b[1] - a[1]) + a[0]) is_in = !is_in;
  }
  return is_in;
}

// Where a ray goes in at this side of the gate; INFINITY: it does not.
static inline float gate_meet(const SpaceGate *g, int side, const Ray *ray)
{
  if (gate_is_closed(g)) {
    float near, far;
    if (!gate_span(g, ray, &near, &far)) return INFINITY;
    const float t = side == GATE_FRONT ? near : far;
    return t > ray->tmin ? t : INFINITY;
  }
  const float along = v3_dot(g->n, ray->d);
  if (along == 0 || (along < 0) != (side == GATE_FRONT)) return INFINITY;
  const float t = (g->c - v3_dot(g->n, ray->o)) / along;
  if (g->is_wall) return max_f(t, ray->tmin);
  return t > ray->tmin && gate_has(g, ray->o + t * ray->d) ? t : INFINITY;
}

#endif
