// Local: vectors where light meets matter. Rays, surface points and lamps are in the chart of their cell, where they are
// straight and flat; what scatters there has to do with true lengths and angles. In flat cells both are the same and all
// of this hands on what it is given; in curved cells vectors go over at the vertex, and nowhere else (space/chart.h).
//
// Densities per solid angle of the chart and of the place differ by chart_solid_angle(); aiming at lamps knows only those
// of the chart, and paths keep theirs so.

#ifndef RAYFOLD_RENDER_LOCAL_H
#define RAYFOLD_RENDER_LOCAL_H

#include "shade/light_sample.h"
#include "space/chart.h"
#include "world/world.h"

static inline float world_curvature(const World *w, uint32_t cell) { return w->cells[cell].curvature; }

// Unit vectors for unit directions of the chart at p, and back.
static inline Vec3 local_vector(float kappa, Vec3 p, Vec3 d)
{
  return kappa == 0 ? d : v3_normalize(chart_to_local(kappa, p, d));
}

static inline Vec3 local_direction(float kappa, Vec3 p, Vec3 v)
{
  return kappa == 0 ? v : v3_normalize(chart_from_local(kappa, p, v));
}

// The normal in the chart of a surface whose true one is n.
static inline Vec3 local_chart_normal(float kappa, Vec3 p, Vec3 n)
{
  return kappa == 0 || v3_is_zero(n) ? n : v3_normalize(chart_to_local(kappa, p, n));
}

// A length along a ray from its origin.
static inline float local_length(float kappa, const Ray *ray, float t)
{
  return kappa == 0 || !(t < INFINITY) ? t : chart_length(kappa, chart_span(kappa, ray->o, ray->d, t));
}

// How far rays part on so long a way that part by one at a metre.
static inline float local_spread(float kappa, float length)
{
  if (kappa == 0) return length;
  const float root = sqrtf(fabsf(kappa)), x = root * length;
  if (kappa > 0) return fabsf(f_sin(x)) / root;
  const float e = f_exp(x);
  return 0.5f * (e - 1 / e) / root;
}

// The surface as what scatters sees it: true normals and tangents, in the place of those of the chart.
static inline SurfacePoint local_surface(float kappa, const SurfacePoint *s)
{
  SurfacePoint out = *s;
  out.n = chart_normal(kappa, s->p, s->n);
  out.ng = chart_normal(kappa, s->p, s->ng);
  out.tangent = surface_tangent(out.n, chart_to_local(kappa, s->p, s->tangent));
  return out;
}

// From what the chart says of a lamp to what is true at p: its direction, its density, and how much of a small lamp's
// light arrives, which thins out as spheres around it grow.
static inline void local_lamp(float kappa, Vec3 p, LightSample *l, Vec3 *wl, float *length)
{
  *wl = l->wl;
  *length = l->distance;
  if (kappa == 0) return;
  *wl = v3_normalize(chart_to_local(kappa, p, l->wl));
  const ChartLength span = chart_span(kappa, p, l->wl, l->distance);
  *length = chart_length(kappa, span);
  if (l->is_delta) {
    const float spread = chart_spread(kappa, span);
    l->radiance = l->radiance * (l->distance * l->distance / (spread * spread));
  } else {
    l->pdf *= chart_solid_angle(kappa, p, *wl);
  }
}

#endif
