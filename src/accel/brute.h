// Brute: the answers of accel/traverse.h without its trees, by testing everything in order. For tests; it shares the
// primitive tests, so that any difference is the trees' fault.

#ifndef RAYFOLD_ACCEL_BRUTE_H
#define RAYFOLD_ACCEL_BRUTE_H

#include "accel/traverse.h"

static inline void brute_instance(Query *q, const Accel *a, uint32_t instance_i, const TreeRay *world, float near)
{
  TreeRay own;
  Visit v = {.instance = &a->instances[instance_i], .instance_i = instance_i, .near = near};
  v.ray = instance_ray(v.instance, q->ray, world, &own);
  if (!v.ray) return;
  if (v.instance->kind != INSTANCE_MESH) {
    shape_closest(q, &v);
    return;
  }
  const MeshTree *m = v.instance->mesh;
  for (uint32_t b = 0; b < m->block_count; b++) {
    Tri8 space;
    block_closest(q, &v, mesh_block(m, b, &space));
  }
}

static inline bool accel_closest_brute(const Accel *a, const Ray *ray, RayMask mask, HitFilter *filter,
                                       const void *user, RayCounters *c, Hit *hit)
{
  Query q = query_of(ray, filter, user, c, false);
  TreeRay r;
  const bool is_ray = tree_ray_init(&r, ray->o, ray->d, ray->tmin) && r.tmin < ray->tmax;
  for (uint32_t i = 0; is_ray && i < a->instance_count; i++) {
    if (!(a->instances[i].mask & mask)) continue;
    const float near = tree_ray_box(&r, a->boxes[i], FLT_MAX);
    if (near < INFINITY) brute_instance(&q, a, i, &r, near);
  }
  *hit = q.best;
  if (hit->instance == NO_HIT) hit->t = ray->tmax;
  return hit->instance != NO_HIT;
}

#endif
