// Footprint: what textures have to know of a place beside its coordinates: how fast those change along the surface, and
// how much of the surface the ray stands for. Only asked for where there are textures.

#ifndef RAYFOLD_GEOM_FOOTPRINT_H
#define RAYFOLD_GEOM_FOOTPRINT_H

#include "geom/surface.h"

// The gradients of u and v along the surface from the derivatives of p by them; none where those are degenerate.
static inline void footprint_gradients(SurfacePoint *s, int set, Vec3 dpdu, Vec3 dpdv)
{
  const float det = v3_dot(s->ng, v3_cross(dpdu, dpdv));
  const Vec3 u = v3_cross(dpdv, s->ng) / det, v = v3_cross(s->ng, dpdu) / det;
  if (det == 0 || !v3_is_finite(u) || !v3_is_finite(v)) return;
  s->grad_u[set] = u;
  s->grad_v[set] = v;
}

static inline void footprint_of_triangle(SurfacePoint *s, const TriangleMesh *m, const Frame *world_from_object,
                                         const Hit *hit)
{
  const uint32_t *corner = m->triangles + 3 * (size_t)hit->prim;
  const Vec3 p = v3_load(m->positions + 3 * (size_t)corner[0]);
  const Vec3 e1 = frame_vector(world_from_object, v3_load(m->positions + 3 * (size_t)corner[1]) - p);
  const Vec3 e2 = frame_vector(world_from_object, v3_load(m->positions + 3 * (size_t)corner[2]) - p);
  for (int set = 0; set < 2; set++) {
    Vec3 dpdu, dpdv;
    if (triangle_derivatives(m, set, corner, e1, e2, &dpdu, &dpdv)) footprint_gradients(s, set, dpdu, dpdv);
  }
}

static inline void footprint_of_shape(SurfacePoint *s, const Frame *world_from_object, Vec3 dpdu, Vec3 dpdv)
{
  footprint_gradients(s, 0, frame_vector(world_from_object, dpdu), frame_vector(world_from_object, dpdv));
  s->grad_u[1] = s->grad_u[0];
  s->grad_v[1] = s->grad_v[0];
}

// u runs once around the y axis, v from pole to pole. object_p must be set.
static inline void footprint_of_sphere(SurfacePoint *s, const Frame *world_from_object)
{
  const Vec3 po = s->object_p, dpdu = 2 * PI * v3(po[2], 0, -po[0]);
  const float around = sqrtf(po[0] * po[0] + po[2] * po[2]);
  if (around > 0) footprint_of_shape(s, world_from_object, dpdu, v3_cross(po, dpdu) / (2 * around));
}

// object_p must be set.
static inline void footprint_of_solid(SurfacePoint *s, const Solid *solid, uint32_t part, const Frame *world_from_object)
{
  const double p[3] = {(double)s->object_p[0], (double)s->object_p[1], (double)s->object_p[2]};
  Vec3 dpdu, dpdv;
  solid_derivatives(solid, part, p, &dpdu, &dpdv);
  footprint_of_shape(s, world_from_object, dpdu, dpdv);
}

// The cone `width` metres across that meets the surface along d leaves an ellipse: as wide across d, longer along it by
// the cosine. Grazing further than 1 : 1024 is taken for that.
static inline void footprint_of_cone(SurfacePoint *s, Vec3 d, float width)
{
  const float cosine = max_f(fabsf(v3_dot(d, s->ng)), 0x1p-10f);
  const Vec3 side = v3_cross(s->ng, d), across = v3_is_zero(side) ? frame_around(s->ng).x : v3_normalize(side);
  s->minor = width * across;
  s->major = width / cosine * v3_cross(across, s->ng);
}

#endif
