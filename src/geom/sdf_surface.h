// Sdf surface: the surface point of a hit on a field. Its place and normal are found in double; how far a next ray must
// stand off to begin on its own side is tried out with the very numbers that ray will march with.
//
// uv are the two coordinates across the axis the normal goes along most, in metres of the field's own space.

#ifndef RAYFOLD_GEOM_SDF_SURFACE_H
#define RAYFOLD_GEOM_SDF_SURFACE_H

#include "base/hash.h"
#include "geom/footprint.h"
#include "geom/offset.h"
#include "geom/sdf_exact.h"
#include "geom/sdf_march.h"

// Decides where materials are mixed by chance: by the place.
static inline float sdf_chance(const double p[3])
{
  uint32_t h = 0;
  for (int k = 0; k < 3; k++) {
    const float x = (float)p[k];
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    h = hash_combine(h, bits);
  }
  return unit_float(h);
}

static inline const SdfLeaf *sdf_leaf_at(const Sdf *f, const double p[3])
{
  const float at[3] = {(float)p[0], (float)p[1], (float)p[2]};
  SdfPlace place;
  sdf_place(f, at, &place);
  return place.leaf ? place.leaf : f->leaves;
}

// Whose part was hit at t on a ray in the field's space.
static SDF_LARGE uint32_t sdf_hit_leaf(const Sdf *f, const float o[3], const float d[3], float t)
{
  double p[3];
  for (int k = 0; k < 3; k++) p[k] = (double)o[k] + (double)t * (double)d[k];
  return sdf_owner(f, sdf_leaf_at(f, p), p, sdf_chance(p)).leaf;
}

// The least distance, of a few, from which the field is seen as outside above the surface and as inside below. Where there
// is none, as on what is thinner than that, the one that is right above.
static inline float sdf_standoff(const Sdf *f, const Placement *at, bool is_identity, const SurfacePoint *s, float least)
{
  float fallback = 0, away = least;
  for (int i = 0; i < 8; i++, away *= 3) {
    float p[2][3], value[2];
    for (int k = 0; k < 2; k++) {
      const Vec3 o = offset_point(s->p, s->ng, away, k ? -s->ng : s->ng);
      v3_store(p[k], is_identity ? o : frame_point(at->object_from_world, o));
    }
    sdf_values(f, (const float(*)[3])p, 2, value);
    if (value[0] > 0 && value[1] < 0) return away;
    if (value[0] > 0 && fallback == 0) fallback = away;
  }
  return fallback > 0 ? fallback : least;
}

// The axis that uv lie across, 0 to 2.
static inline int sdf_axis(Vec3 n)
{
  const Vec3 size = v3_abs(n);
  return size[0] > size[1] ? (size[0] > size[2] ? 0 : 2) : (size[1] > size[2] ? 1 : 2);
}

static SDF_LARGE SurfacePoint surface_of_sdf(const Sdf *f, const Placement *at, bool is_identity, const Ray *ray, const Hit *hit)
{
  const Vec3 o = is_identity ? ray->o : frame_point(at->object_from_world, ray->o);
  const Vec3 d = is_identity ? ray->d : frame_vector(at->object_from_world, ray->d);
  SdfCrossing c = {.t = (double)hit->t};
  double p[3];
  for (int k = 0; k < 3; k++) {
    c.o[k] = (double)o[k];
    c.d[k] = (double)d[k];
    p[k] = c.o[k] + c.t * c.d[k];
  }
  c.leaf = sdf_leaf_at(f, p);
  const double t = sdf_crossing_near(f, &c);
  for (int k = 0; k < 3; k++) p[k] = c.o[k] + t * c.d[k];

  const Vec3 n = sdf_normal(f, c.leaf, p);
  SurfacePoint s = surface_begin(ray, hit, v3_normalize(frame_normal(at->object_from_world, n)));
  surface_place(&s, at, p);
  s.error = sdf_standoff(f, at, is_identity, &s, 2 * s.error);
  const int axis = sdf_axis(n), u = axis == 0 ? 2 : 0, v = axis == 1 ? 2 : 1;
  s.uv[0] = s.uv[1] = (Vec2){(float)p[u], (float)p[v]};
  const Frame *m = at->world_from_object;
  const Vec3 columns[3] = {m->x, m->y, m->z};
  surface_smooth_frame(&s, columns[u], columns[v]);
  if (f->colors) {
    const Vec3 color = sdf_owner(f, c.leaf, p, sdf_chance(p)).color;
    v3_store(s.color, color);
  }
  return s;
}

static inline void footprint_of_sdf(SurfacePoint *s, const Frame *world_from_object)
{
  const int axis = sdf_axis(frame_local(world_from_object, s->ng)), u = axis == 0 ? 2 : 0, v = axis == 1 ? 2 : 1;
  const Vec3 columns[3] = {world_from_object->x, world_from_object->y, world_from_object->z};
  footprint_gradients(s, 0, columns[u], columns[v]);
  footprint_gradients(s, 1, columns[u], columns[v]);
}

#endif
