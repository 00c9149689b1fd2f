// Ball: a gate whose inside bends light. A ray that comes to it leaves it elsewhere, by the tables of radial.h: of a
// wormhole through the ball at its other end or, if it grazes, back out of its own; of a black hole back out, or not at
// all: it falls in, or ends at the disk of hot matter around the hole.
//
// Works in the chart around the ball's middle, y the axis of the disk. Outside of the ball space is flat, so what the
// bending would do farther out is not in it. Does not know gates or cells.

#ifndef RAYFOLD_SPACE_BALL_H
#define RAYFOLD_SPACE_BALL_H

#include "space/radial.h"

enum { HEAT_NODES = 128, HEAT_MOST = 4 }; // times as hot as the hottest of the disk: g stays below 3 even at 1.5 rs

typedef struct BlackHole {
  float rs;              // the horizon's radius
  float inner, outer;    // of the disk; outer 0: there is none
  float gain;            // radiance where it is hottest, as it shines there
  float caught[3];       // what is seen in place of light that falls in
  float color[HEAT_NODES + 1][3]; // of a blackbody, of luminance 1, by its temperature over that of the hottest
} BlackHole;

typedef struct Ball {
  Radial radial;
  RadialOrbits *orbits;    // of a black hole
  const BlackHole *hole;   // NULL: a wormhole
  bool is_mirror;          // left and right change places on the way through
} Ball;

// What becomes of a ray.
typedef enum { BALL_PASSED, BALL_TURNED, BALL_ENDED } BallEnd;

// Where a way first comes to the disk.
typedef struct DiskPlace {
  float r;      // 0: it does not
  float cosine; // between what circles there and the light that goes back along the way
} DiskPlace;

// The way crosses the disk's plane every half turn of its angle.
static inline DiskPlace ball_disk(const Ball *b, const RadialPlane *plane)
{
  const BlackHole *hole = b->hole;
  const DiskPlace none = {0, 0};
  if (!(hole->outer > 0)) return none;
  float angle = f_atan2(-plane->e1[1], plane->e2[1]), total;
  if (angle < 0) angle += PI;
  for (;; angle += PI) {
    const float u = radial_orbit(&b->radial, plane->h, angle, &total);
    if (!(angle < total)) return none;
    const float r = u > 0 ? 1 / u : 0;
    // Light comes the other way, so its turning is that from e2 to e1.
    if (r >= hole->inner && r <= hole->outer) return (DiskPlace){r, -v3_cross(plane->e1, plane->e2)[1]};
  }
}

// Temperature of a thin disk over its greatest, at 49/36 of its inner radius (Shakura and Sunyaev 1973).
static inline float disk_heat(float inner, float r)
{
  const float x = inner / r, quarter = sqrtf(sqrtf(max_f(1 - sqrtf(x), 0)));
  return x / sqrtf(sqrtf(x)) * quarter / 0.48786f;
}

// p on the ball and the unit vector v into it; what comes out, or is left as it was where the ray ends.
static inline BallEnd ball_go(const Ball *b, Vec3 *p, Vec3 *v)
{
  const RadialPlane plane = radial_plane(b->radial.radius, v3_normalize(*p), *v);
  const RadialWay way = radial_way(&b->radial, plane.h);
  if (b->hole && (way.is_passed || ball_disk(b, &plane).r > 0)) return BALL_ENDED;
  Vec3 n;
  radial_leave(&plane, b->radial.radius, way.angle, &n, v);
  *p = b->radial.radius * n;
  if (!way.is_passed) return BALL_TURNED;
  // The outsides of two balls are mirror images.
  if (b->is_mirror) return BALL_PASSED;
  (*p)[2] = -(*p)[2];
  (*v)[2] = -(*v)[2];
  return BALL_PASSED;
}

// What is seen along a ray that ended: the disk's light, redder or bluer and dimmer or brighter as it goes away or comes
// and climbs out of the hole (worlds.md, section 2.8), or what is caught.
static inline Vec3 ball_light(const Ball *b, Vec3 p, Vec3 v)
{
  const BlackHole *hole = b->hole;
  const RadialPlane plane = radial_plane(b->radial.radius, v3_normalize(p), v);
  const DiskPlace at = ball_disk(b, &plane);
  if (!(at.r > 0)) return v3_load(hole->caught);
  const float impact = hole_impact(hole->rs, b->radial.radius, plane.h);
  const float heat = disk_heat(hole->inner, at.r) * kepler_shift(hole->rs, at.r, impact, at.cosine);
  const float x = min_f(heat, HEAT_MOST) * ((float)HEAT_NODES / HEAT_MOST);
  const int i = x < HEAT_NODES ? (int)x : HEAT_NODES - 1;
  const Vec3 color = v3_mix(v3_load(hole->color[i]), v3_load(hole->color[i + 1]), x - (float)i);
  return hole->gain * (heat * heat) * (heat * heat) * color;
}

// A vector x carried along the way of ball_go(), from p and v, to where the way went on along v_to, parallel to itself: it
// keeps its parts along the way, across the way's plane, and along the third direction.
static inline Vec3 ball_carry(const Ball *b, BallEnd end, Vec3 p, Vec3 v, Vec3 v_to, Vec3 x)
{
  const RadialPlane plane = radial_plane(b->radial.radius, v3_normalize(p), v);
  const Vec3 across = v3_cross(plane.e1, plane.e2), side = v3_cross(across, v);
  Vec3 across_to = across;
  if (end == BALL_PASSED && !b->is_mirror) across_to[2] = -across_to[2];
  Vec3 side_to = v3_cross(across_to, v_to);
  if (end == BALL_PASSED && b->is_mirror) side_to = -side_to; // left-handed from now on
  return v3_dot(x, v) * v_to + v3_dot(x, side) * side_to + v3_dot(x, across) * across_to;
}

#endif
