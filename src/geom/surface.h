// Surface: from a hit to everything shading wants to know of the place, in world space. The point comes from the
// shape in object space (a triangle's vertices and weights, a sphere's radius), not from o + t * d, whose error
// grows with the ray's length. Done in double, once a hit, so that what is left of rounding is the last ulp; that
// and the way back into object space are bounded in SurfacePoint.error.
//
// Normals go by the inverse transpose, so outside stays outside under mirroring maps. Does not know materials:
// instance and prim are copied from the hit, material is left 0.

#ifndef RAYFOLD_GEOM_SURFACE_H
#define RAYFOLD_GEOM_SURFACE_H

#include "base/ray.h"
#include "geom/solid.h"
#include "geom/sphere.h"
#include "geom/voxel_walk.h"

// The arrays of a triangle mesh, owned by someone else. Only positions and triangles must be there.
typedef struct TriangleMesh {
  const float *positions;    // 3 a vertex
  const float *normals;      // 3 a vertex, unit
  const float *texcoords[2]; // 2 a vertex
  const float *colors;       // 4 a vertex, linear
  const float *tangents;     // 4 a vertex: unit tangent and the bitangent's sign; or as tangent_of says
  const uint32_t *tangent_of; // 3 a triangle: index of each corner's tangent; NULL: its vertex's
  const uint32_t *triangles; // 3 vertex indices a triangle
} TriangleMesh;

// What surface_of_triangle() will read, asked of memory ahead: first a triangle's indices, and when those are there its
// vertices. Meshes of a million triangles lie far from the processor.
static inline void mesh_fetch_indices(const TriangleMesh *m, uint32_t prim)
{
  fetch_ahead(m->triangles + 3 * (size_t)prim, 1);
}

static inline void mesh_fetch_vertices(const TriangleMesh *m, uint32_t prim)
{
  const uint32_t *corner = m->triangles + 3 * (size_t)prim;
  for (int k = 0; k < 3; k++) {
    fetch_ahead(m->positions + 3 * (size_t)corner[k], 1);
    if (m->normals) fetch_ahead(m->normals + 3 * (size_t)corner[k], 1);
    if (m->texcoords[0]) fetch_ahead(m->texcoords[0] + 2 * (size_t)corner[k], 1);
  }
}

// The two maps of a placed shape.
typedef struct Placement {
  const Frame *world_from_object, *object_from_world;
} Placement;

static inline Vec3 v3_abs(Vec3 a) { return v3(fabsf(a[0]), fabsf(a[1]), fabsf(a[2])); }

// A frame's map of magnitudes: bounds how large sums inside it get.
static inline Vec3 frame_magnitude(const Frame *f, Vec3 a, float origin)
{
  return a[0] * v3_abs(f->x) + a[1] * v3_abs(f->y) + a[2] * v3_abs(f->z) + origin * v3_abs(f->p);
}

// Sets p and error from the point in object space; ng must be set. Two ulps for rounding p itself; eight for the
// next ray's way into object space (four terms a component, and an inverse known to a few ulps); one of the largest
// component, so that no place has none.
static inline void surface_place(SurfacePoint *s, const Placement *at, const double p[3])
{
  const Frame *m = at->world_from_object;
  for (int k = 0; k < 3; k++) {
    s->p[k] = (float)(m->x[k] * p[0] + m->y[k] * p[1] + m->z[k] * p[2] + m->p[k]);
  }
  s->p[3] = 0;
  const Vec3 size = v3_abs(s->p);
  const Vec3 back = frame_magnitude(m, frame_magnitude(at->object_from_world, size, 1), 0);
  s->error = 0x1p-24f * (v3_dot(v3_abs(s->ng), 2 * size + 8 * back) + v3_max_lane(size));
}

// A tangent perpendicular to n: the given direction if it is of use, else any.
static inline Vec3 surface_tangent(Vec3 n, Vec3 along)
{
  const Vec3 t = along - v3_dot(along, n) * n;
  const float length = v3_dot(t, t);
  return length > 1e-12f * v3_dot(along, along) && length < INFINITY ? t / sqrtf(length) : frame_around(n).x;
}

// Sets n, tangent and tangent_sign of a shape with known derivatives (world space) and no normals of its own.
static inline void surface_smooth_frame(SurfacePoint *s, Vec3 dpdu, Vec3 dpdv)
{
  s->n = s->ng;
  s->tangent = surface_tangent(s->n, dpdu);
  s->tangent_sign = v3_dot(v3_cross(s->n, s->tangent), dpdv) < 0 ? -1.0f : 1.0f;
}

static inline SurfacePoint surface_begin(const Ray *ray, const Hit *hit, Vec3 ng)
{
  return (SurfacePoint){
    .ng = ng, .is_back = v3_dot(ray->d, ng) > 0, .instance = hit->instance, .prim = hit->prim, .color = {1, 1, 1, 1}};
}

// Derivatives of position by texture coordinates (pbrt-v4, "Triangle meshes"); false when they do not exist.
static inline bool triangle_derivatives(const TriangleMesh *m, int set, const uint32_t corner[3], Vec3 e1, Vec3 e2,
                                        Vec3 *dpdu, Vec3 *dpdv)
{
  const float *uv = m->texcoords[set];
  if (!uv) return false;
  const float u0 = uv[2 * (size_t)corner[0]], v0 = uv[2 * (size_t)corner[0] + 1];
  const float u1 = uv[2 * (size_t)corner[1]] - u0, v1 = uv[2 * (size_t)corner[1] + 1] - v0;
  const float u2 = uv[2 * (size_t)corner[2]] - u0, v2 = uv[2 * (size_t)corner[2] + 1] - v0;
  const float det = u1 * v2 - v1 * u2;
  const float inv = 1 / det;
  *dpdu = (v2 * e1 - v1 * e2) * inv;
  *dpdv = (u1 * e2 - u2 * e1) * inv;
  return det != 0 && v3_is_finite(*dpdu) && v3_is_finite(*dpdv);
}

static inline Vec3 corners_mix(const float *a, const uint32_t corner[3], size_t stride, const float w[3])
{
  return w[0] * v3_load(a + stride * corner[0]) + w[1] * v3_load(a + stride * corner[1]) +
         w[2] * v3_load(a + stride * corner[2]);
}

// Shading normal and tangent of a triangle: from its arrays where they are of use.
static inline void triangle_frame(SurfacePoint *s, const TriangleMesh *m, const Placement *at, const uint32_t corner[3],
                                  const float w[3], Vec3 e1, Vec3 e2)
{
  s->n = s->ng;
  float turned = 1;
  if (m->normals) {
    const Vec3 n = v3_normalize(frame_normal(at->object_from_world, corners_mix(m->normals, corner, 3, w)));
    if (v3_is_finite(n) && !v3_is_zero(n)) {
      turned = v3_dot(n, s->ng) < 0 ? -1.0f : 1.0f;
      s->n = turned * n;
    }
  }
  Vec3 dpdu = v3_all(0), dpdv = v3_all(0);
  if (m->tangents) {
    const uint32_t *of = m->tangent_of ? m->tangent_of + 3 * (size_t)s->prim : corner;
    s->tangent = surface_tangent(s->n, frame_vector(at->world_from_object, corners_mix(m->tangents, of, 4, w)));
    const float mirrored = frame_determinant(at->world_from_object) < 0 ? -1.0f : 1.0f;
    s->tangent_sign = copysignf(1, m->tangents[4 * (size_t)of[0] + 3]) * mirrored * turned;
  } else if (triangle_derivatives(m, 0, corner, e1, e2, &dpdu, &dpdv)) {
    s->tangent = surface_tangent(s->n, frame_vector(at->world_from_object, dpdu));
    const Vec3 bitangent = frame_vector(at->world_from_object, dpdv);
    s->tangent_sign = v3_dot(v3_cross(s->n, s->tangent), bitangent) < 0 ? -1.0f : 1.0f;
  } else {
    s->tangent = frame_around(s->n).x;
    s->tangent_sign = 1;
  }
}

static inline void triangle_attributes(SurfacePoint *s, const TriangleMesh *m, const uint32_t corner[3],
                                       const float w[3])
{
  for (int i = 0; i < 3; i++) {
    for (int set = 0; set < 2; set++) {
      if (!m->texcoords[set]) continue;
      s->uv[set].x += w[i] * m->texcoords[set][2 * (size_t)corner[i]];
      s->uv[set].y += w[i] * m->texcoords[set][2 * (size_t)corner[i] + 1];
    }
  }
  if (!m->colors) return;
  for (int k = 0; k < 4; k++) {
    s->color[k] = w[0] * m->colors[4 * (size_t)corner[0] + k] + w[1] * m->colors[4 * (size_t)corner[1] + k] +
                  w[2] * m->colors[4 * (size_t)corner[2] + k];
  }
}

static inline SurfacePoint surface_of_triangle(const TriangleMesh *m, const Placement *at, const Ray *ray,
                                               const Hit *hit)
{
  const uint32_t *corner = m->triangles + 3 * (size_t)hit->prim;
  const float *v0 = m->positions + 3 * (size_t)corner[0];
  const float *v1 = m->positions + 3 * (size_t)corner[1];
  const float *v2 = m->positions + 3 * (size_t)corner[2];
  double e1[3], e2[3], p[3];
  for (int k = 0; k < 3; k++) {
    e1[k] = (double)v1[k] - v0[k];
    e2[k] = (double)v2[k] - v0[k];
    p[k] = v0[k] + hit->u * e1[k] + hit->v * e2[k];
  }
  // The normal is brought to length one in double first: the product of two tiny edges is no float.
  double n[3] = {e1[1] * e2[2] - e1[2] * e2[1], e1[2] * e2[0] - e1[0] * e2[2], e1[0] * e2[1] - e1[1] * e2[0]};
  const double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  const Vec3 ng = v3((float)(n[0] / length), (float)(n[1] / length), (float)(n[2] / length));

  SurfacePoint s = surface_begin(ray, hit, v3_normalize(frame_normal(at->object_from_world, ng)));
  const float w[3] = {1 - hit->u - hit->v, hit->u, hit->v};
  surface_place(&s, at, p);
  triangle_frame(&s, m, at, corner, w, v3((float)e1[0], (float)e1[1], (float)e1[2]),
                 v3((float)e2[0], (float)e2[1], (float)e2[2]));
  triangle_attributes(&s, m, corner, w);
  return s;
}

// The point is where the hit's distance says, drawn onto the sphere.
static inline SurfacePoint surface_of_sphere(float radius, const Placement *at, const Ray *ray, const Hit *hit)
{
  const Vec3 o = frame_point(at->object_from_world, ray->o), d = frame_vector(at->object_from_world, ray->d);
  double p[3];
  for (int k = 0; k < 3; k++) p[k] = (double)o[k] + (double)hit->t * d[k];
  const double scale = radius / sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
  for (int k = 0; k < 3; k++) p[k] *= scale;
  const Vec3 po = v3((float)p[0], (float)p[1], (float)p[2]);

  SurfacePoint s = surface_begin(ray, hit, v3_normalize(frame_normal(at->object_from_world, po)));
  surface_place(&s, at, p);
  s.uv[0] = s.uv[1] = (Vec2){hit->u, hit->v};
  const Vec3 dpdu = v3(po[2], 0, -po[0]);
  surface_smooth_frame(&s, frame_vector(at->world_from_object, dpdu),
                       frame_vector(at->world_from_object, v3_cross(po, dpdu)));
  return s;
}

// The crossing that a hit was, found again: Hit.t has lost digits on the way.
static inline double solid_crossing_near(const Solid *s, const SolidRay *own, const Hit *hit)
{
  const Crossings c = solid_cross(s, own);
  double best = (double)hit->t, off = INFINITY;
  for (int i = 0; i < c.count; i++) {
    const double away = fabs(c.at[i].t - (double)hit->t);
    if (c.at[i].part != hit->prim % SOLID_PARTS || !(away < off)) continue;
    best = c.at[i].t;
    off = away;
  }
  return best;
}

// own: the ray in the solid's space. is_flipped: the solid is cut out of something, which begins where it ends.
static inline SurfacePoint surface_of_solid(const Solid *solid, const Placement *at, const SolidRay *own,
                                            bool is_flipped, const Ray *ray, const Hit *hit)
{
  const uint32_t part = hit->prim % SOLID_PARTS;
  double p[3];
  solid_point(own, solid_crossing_near(solid, own, hit), p);
  const Vec3 n = solid_normal(solid, part, p);
  Vec3 dpdu, dpdv;
  solid_derivatives(solid, part, p, &dpdu, &dpdv);
  const Vec3 outward = v3_normalize(frame_normal(at->object_from_world, n));
  SurfacePoint s = surface_begin(ray, hit, is_flipped ? -outward : outward);
  surface_place(&s, at, p);
  s.uv[0] = s.uv[1] = solid_uv(solid, part, p);
  surface_smooth_frame(&s, frame_vector(at->world_from_object, dpdu), frame_vector(at->world_from_object, dpdv));
  return s;
}

// Directions of growing u and v on a face of a cell; see voxel_face_uv().
static inline Vec3 voxel_face_u(uint32_t face)
{
  switch (face) {
  case 0: return v3(0, 0, 1);
  case 1: return v3(0, 0, -1);
  case 4: return v3(-1, 0, 0);
  default: return v3(1, 0, 0);
  }
}

static inline Vec3 voxel_face_v(uint32_t face)
{
  return face == 2 ? v3(0, 0, 1) : face == 3 ? v3(0, 0, -1) : v3(0, 1, 0);
}

// Brings the place on the face to where it surely is on it: the plane is a whole number, and to the sides the hit's u and v
// say where in its cell it is. Kept off the cell's edges by `edge`, so that the next ray does not begin in a neighbour.
static inline void voxel_place(const Hit *hit, float edge, double p[3])
{
  const uint32_t face = hit->prim & 7, axis = face >> 1;
  const Vec3 along[2] = {voxel_face_u(face), voxel_face_v(face)};
  const float uv[2] = {clamp_f(hit->u, edge, 1 - edge), clamp_f(hit->v, edge, 1 - edge)};
  p[axis] = floor(p[axis] + 0.5);
  for (int i = 0; i < 2; i++) {
    int k = 0;
    while (along[i][k] == 0) k++;
    const float raw = i ? hit->v : hit->u;
    const double was = along[i][k] > 0 ? (double)raw : 1 - (double)raw;
    const double now = along[i][k] > 0 ? (double)uv[i] : 1 - (double)uv[i];
    p[k] = floor(p[k] - was + 0.5) + now;
  }
}

static inline SurfacePoint surface_of_voxel(const VoxelBody *body, const Placement *at, const Ray *ray, const Hit *hit)
{
  const uint32_t face = hit->prim & 7, axis = face >> 1, entry = hit->prim >> 3;
  const Vec3 o = frame_point(at->object_from_world, ray->o), d = frame_vector(at->object_from_world, ray->d);
  double p[3];
  for (int k = 0; k < 3; k++) p[k] = (double)o[k] + (double)hit->t * (double)d[k];
  Vec3 n = v3_all(0);
  n[axis] = face & 1 ? 1 : -1;
  SurfacePoint s = surface_begin(ray, hit, v3_normalize(frame_normal(at->object_from_world, n)));
  voxel_place(hit, 0, p);
  surface_place(&s, at, p);
  // The rounding of places, in cells.
  const float edge = min_f(2 * s.error * v3_length(frame_vector(at->object_from_world, s.ng)), 0.25f);
  voxel_place(hit, edge, p);
  surface_place(&s, at, p);
  s.uv[0] = s.uv[1] = (Vec2){hit->u, hit->v};
  const VoxelEntry *e = &body->grid->palette->entries[entry < body->grid->palette->entry_count ? entry : 0];
  for (int k = 0; k < 3; k++) s.color[k] = e->color[k];
  surface_smooth_frame(&s, frame_vector(at->world_from_object, voxel_face_u(face)),
                       frame_vector(at->world_from_object, voxel_face_v(face)));
  return s;
}

// A quad or a disk: half_x and half_y are its half extents, or both the disk's radius.
static inline SurfacePoint surface_of_flat(float half_x, float half_y, const Placement *at, const Ray *ray,
                                           const Hit *hit)
{
  const double p[3] = {(2.0 * hit->u - 1) * half_x, (2.0 * hit->v - 1) * half_y, 0};
  SurfacePoint s = surface_begin(ray, hit, v3_normalize(frame_normal(at->object_from_world, v3(0, 0, 1))));
  surface_place(&s, at, p);
  s.uv[0] = s.uv[1] = (Vec2){hit->u, hit->v};
  surface_smooth_frame(&s, at->world_from_object->x, at->world_from_object->y);
  return s;
}

#endif
