// Place: the surface point of a hit on any kind of instance, by geom/surface.h.

#ifndef RAYFOLD_ACCEL_PLACE_H
#define RAYFOLD_ACCEL_PLACE_H

#include "accel/tree.h"
#include "geom/footprint.h"
#include "geom/sdf_surface.h"

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
  case INSTANCE_SOLID: {
    const Vec3 o = frame_point(at.object_from_world, ray->o), d = frame_vector(at.object_from_world, ray->d);
    const SolidRay own = {{o[0], o[1], o[2]}, {d[0], d[1], d[2]}};
    return surface_of_solid(i->solid, &at, &own, false, ray, hit);
  }
  case INSTANCE_VOXELS: return surface_of_voxel(i->voxels, &at, ray, hit);
  case INSTANCE_CSG: {
    const CsgLeaf *leaf = &i->csg->leaves[hit->prim / SOLID_PARTS];
    const float o[3] = {ray->o[0], ray->o[1], ray->o[2]}, d[3] = {ray->d[0], ray->d[1], ray->d[2]};
    const SolidRay own = csg_leaf_ray(leaf, o, d);
    const Placement placed = {&leaf->world_from_leaf, &leaf->leaf_from_world};
    return surface_of_solid(&leaf->solid, &placed, &own, leaf->is_flipped, ray, hit);
  }
  case INSTANCE_SDF: return surface_of_sdf(i->sdf, &at, i->is_identity, ray, hit);
  }
  unreachable();
}

// Adds what textures ask for: a ray `width` metres across met the place along d.
static inline void accel_footprint(const Accel *a, const TriangleMesh *mesh, const Ray *ray, const Hit *hit, float width,
                                   SurfacePoint *s)
{
  const Instance *i = &a->instances[hit->instance];
  const CsgLeaf *leaf = i->kind == INSTANCE_CSG ? &i->csg->leaves[hit->prim / SOLID_PARTS] : NULL;
  const Frame *f = leaf ? &leaf->world_from_leaf : &i->world_from_object;
  const Frame *back = leaf ? &leaf->leaf_from_world : &i->object_from_world;
  s->object_p = frame_point(back, s->p);
  if (!(width > 0)) return;
  footprint_of_cone(s, ray->d, width);
  s->object_frame = *back;
  s->object_scale = v3_length(frame_vector(back, s->major)) / v3_length(s->major);
  switch ((InstanceKind)i->kind) {
  case INSTANCE_MESH: footprint_of_triangle(s, mesh, f, hit); return;
  case INSTANCE_SPHERE: footprint_of_sphere(s, f); return;
  case INSTANCE_QUAD: footprint_of_shape(s, f, v3(2 * i->size[0], 0, 0), v3(0, 2 * i->size[1], 0)); return;
  case INSTANCE_SOLID: footprint_of_solid(s, i->solid, hit->prim, f); return;
  case INSTANCE_SDF: footprint_of_sdf(s, f); return;
  case INSTANCE_CSG: footprint_of_solid(s, &leaf->solid, hit->prim % SOLID_PARTS, f); return;
  case INSTANCE_VOXELS: footprint_of_shape(s, f, voxel_face_u(hit->prim & 7), voxel_face_v(hit->prim & 7)); return;
  case INSTANCE_DISK: footprint_of_shape(s, f, v3(2 * i->size[0], 0, 0), v3(0, 2 * i->size[0], 0)); return;
  }
  unreachable();
}

#endif
