// Place: the surface point of a hit on any kind of instance, by geom/surface.h.

#ifndef RAYFOLD_ACCEL_PLACE_H
#define RAYFOLD_ACCEL_PLACE_H

#include "accel/tree.h"
#include "geom/surface.h"

// mesh: the arrays the instance's tree was built from; not looked at for shapes. material is left 0.
static inline SurfacePoint accel_surface(const Accel *a, const TriangleMesh *mesh, const Ray *ray, const Hit *hit)
{
  const Instance *i = &a->instances[hit->instance];
  const Placement at = {&i->world_from_object, &i->object_from_world};
  switch ((InstanceKind)i->kind) {
  case INSTANCE_MESH: return surface_of_triangle(mesh, &at, ray, hit);
  case INSTANCE_SPHERE: return surface_of_sphere(i->size[0], &at, ray, hit);
  case INSTANCE_QUAD: return surface_of_flat(i->size[0], i->size[1], &at, ray, hit);
  case INSTANCE_DISK: return surface_of_flat(i->size[0], i->size[0], &at, ray, hit);
  }
  unreachable();
}

#endif
