// Views: pictures of the geometry instead of light, for looking at scenes and at the ray tracer itself. One ray a
// sample; colours mean what each case says.

#ifndef RAYFOLD_RENDER_VIEWS_H
#define RAYFOLD_RENDER_VIEWS_H

#include "render/path.h"

// Any two neighbouring numbers get colours that are easy to tell apart.
static inline Vec3 view_color_of(uint32_t number)
{
  const uint32_t h = hash_u32(number + 1);
  return v3(0.1f + 0.9f * (float)(h & 255) / 255, 0.1f + 0.9f * (float)(h >> 8 & 255) / 255,
            0.1f + 0.9f * (float)(h >> 16 & 255) / 255);
}

// Black, blue, green, yellow, red, white at 0, 0.2, ... 1.
static inline Vec3 view_heat(float x)
{
  const Vec3 stops[6] = {v3(0, 0, 0), v3(0, 0, 1), v3(0, 1, 0), v3(1, 1, 0), v3(1, 0, 0), v3(1, 1, 1)};
  const float s = clamp_f(x, 0, 1) * 5;
  const int i = s >= 5 ? 4 : (int)s;
  return v3_mix(stops[i], stops[i + 1], s - (float)i);
}

static inline float view_fraction(float x)
{
  const float f = x - floorf(x);
  return f >= 0 && f <= 1 ? f : 0;
}

// 256 boxes and primitives tested for one ray are white.
static inline Vec3 view_cost(const RayCounters *before, const RayCounters *after)
{
  return view_heat((float)(after->nodes - before->nodes + after->prims - before->prims) / 256);
}

// hit: of the camera's ray; cost: of finding it.
static inline FilmSample view_render(const RenderPass *pass, Ray ray, const Way *way, const PackedRay *eye_ray_of,
                                     Cone cone, const Hit *hit, Vec3 cost)
{
  const World *w = pass->world;
  FilmSample out = {.alpha = 1};
  if (pass->settings.integrator == INTEGRATOR_COST) out.radiance = cost;
  if (hit->instance == NO_HIT) {
    if (way->is_lost) out.radiance = way_lost_light(w, way, &ray, hit->t);
    else if (pass->settings.transparent) out.alpha = 0;
    return out;
  }
  SurfacePoint s = trace_surface(w, &ray, hit);
  const float kappa = world_curvature(w, way->cell), length = local_length(kappa, &ray, hit->t);
  trace_footprint(w, &ray, hit, cone.width * way->scale + cone.spread * local_spread(kappa, length), &s);
  if (kappa != 0) s = local_surface(kappa, &s);
  Bsdf b;
  material_bsdf(&w->materials[s.material], w->textures, &s, -local_vector(kappa, s.p, ray.d), &b);
  path_first_hit(pass, &s, hit, bsdf_albedo(&b), &out);
  if (way->is_moved || kappa != 0) path_unfold(&pass->eye, eye_ray_of, way_length(way, length), &out);
  switch ((Integrator)pass->settings.integrator) {
  case INTEGRATOR_NORMAL: out.radiance = 0.5f * out.normal + v3_all(0.5f); break;
  case INTEGRATOR_DEPTH: out.radiance = v3_all(1 / (1 + max_f(out.depth, 0))); break; // near is bright
  case INTEGRATOR_ALBEDO: out.radiance = out.albedo; break;
  case INTEGRATOR_UV: out.radiance = v3(view_fraction(s.uv[0].x), view_fraction(s.uv[0].y), 0); break;
  case INTEGRATOR_ID: out.radiance = view_color_of(out.object); break;
  case INTEGRATOR_BARY: out.radiance = v3(1 - hit->u - hit->v, hit->u, hit->v); break;
  case INTEGRATOR_COST:
  case INTEGRATOR_PATH:
  case INTEGRATOR_WHITTED:
  case INTEGRATOR_CLASSIC: break;
  }
  return out;
}

#endif
