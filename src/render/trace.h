// Trace: the questions integrators ask of a world. What does this ray meet, is the way free, what is it like there.
// Surfaces that are not wholly there (alpha, single-sided) are settled here, by chance but without state: whether a
// surface counts is a function of the ray's seed and the surface, so the order of traversal does not matter.

#ifndef RAYFOLD_RENDER_TRACE_H
#define RAYFOLD_RENDER_TRACE_H

#include "accel/batch.h"
#include "accel/place.h"
#include "accel/traverse.h"
#include "base/hash.h"
#include "geom/offset.h"
#include "shade/bsdf.h"
#include "world/world.h"

typedef struct TraceQuery {
  const World *world;
  uint32_t seed; // one a ray
  uint32_t without, aim; // gates not to be met: that it came out of, that it is aimed through; 1 + gate, 0: none
} TraceQuery;

static inline SurfacePoint trace_surface(const World *w, const Ray *ray, const Hit *hit)
{
  SurfacePoint s = accel_surface(w->accel, &w->instances[hit->instance].mesh, ray, hit);
  s.material = world_material(w, hit);
  return s;
}

// What the material's textures have to know beside the place itself, of a ray `width` metres across there.
static inline void trace_footprint(const World *w, const Ray *ray, const Hit *hit, float width, SurfacePoint *s)
{
  if (w->materials[s->material].has_maps)
    accel_footprint(w->accel, &w->instances[hit->instance].mesh, ray, hit, width, s);
}

// Tells the places apart where one ray meets one instance: of a mesh by its triangles; quads and disks are met once;
// other shapes by how far away the place is, which is the same bits however it was found.
static inline uint32_t trace_place(const World *w, const Hit *hit)
{
  const InstanceKind kind = (InstanceKind)w->accel->instances[hit->instance].kind;
  if (kind != INSTANCE_SPHERE && kind != INSTANCE_SOLID && kind != INSTANCE_CSG && kind != INSTANCE_VOXELS &&
      kind != INSTANCE_SDF)
    return hit->prim;
  uint32_t bits;
  memcpy(&bits, &hit->t, sizeof bits);
  return hash_combine(hit->prim, bits);
}

// Does a gate, or what is left of an instance that goes through one, count where the ray meets it?
static bool trace_counts_gate(const TraceQuery *q, const Ray *ray, const Hit *hit)
{
  const World *w = q->world;
  const WorldInstance *i = &w->instances[hit->instance];
  if (i->clip) {
    const WorldClip *c = &w->clips[i->clip - 1];
    return v3_dot(c->n, ray->o + hit->t * ray->d) > c->c;
  }
  if (i->gate == q->without || i->gate == q->aim) return false;
  const SpaceGate *g = &w->space.gates[i->gate - 1];
  return g->side[gate_side_at(g, ray, hit->t)].cell != NO_CELL;
}

// Does the surface stop this ray? Coverage is settled by comparing with a hash (stochastic transparency, Enderton et
// al. 2010): right on average, and each path sees a surface that is there or not.
static bool trace_counts(const void *user, const Ray *ray, const Hit *hit)
{
  const TraceQuery *q = user;
  const World *w = q->world;
  const WorldInstance *i = &w->instances[hit->instance];
  if ((i->gate || i->clip) && !trace_counts_gate(q, ray, hit)) return false;
  if (i->gate) return true;
  const SurfaceMaterial *m = &w->materials[world_material(w, hit)];
  if (!m->needs_filter) return true;
  SurfacePoint s = trace_surface(w, ray, hit);
  if (s.is_back && !m->is_double_sided) return false;
  trace_footprint(w, ray, hit, 0, &s); // the finest level: the mean of a cut is not the cut of a mean
  const float opacity = material_opacity(m, w->textures, &s);
  if (opacity >= 1) return true;
  return unit_float(hash_combine(hash_combine(q->seed, hit->instance), trace_place(w, hit))) < opacity;
}

// The ray that asks whether the way from s towards wl is free for `distance`. It ends short of the light, whose own
// surface is not in the way: by the rounding of both ends and of the direction.
static inline Ray trace_light_ray(const SurfacePoint *s, Vec3 wl, float distance)
{
  const Vec3 size = v3_abs(s->p);
  const float slack = 1e-5f * distance + 1e-6f * v3_max_lane(size);
  return (Ray){offset_origin(s, wl), wl, 0, distance < INFINITY ? distance - slack : distance};
}

#endif
