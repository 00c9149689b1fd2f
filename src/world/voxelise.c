// See voxelise.h. Triangles against boxes by separating axes (Akenine-Moller, "Fast 3D triangle-box overlap testing",
// 2001); all else by rays.

#include "world/voxelise.h"

#include "accel/place.h"
#include "accel/traverse.h"
#include "shade/albedo.h"
#include "shade/texture_lookup.h"
#include "world/parts.h"

#include <math.h>

typedef struct Voxeliser {
  const World *world;
  VoxelEdit *edit;
  Vec3 corner;
  float cell;
  int32_t size[3];
  Err *err;
} Voxeliser;

// Colours by steps of a 64th, so that pictures do not fill the palette; what is in between is not seen on cells.
static float rounded(float linear)
{
  const float v = roundf(srgb_encode(linear) * 63) / 63;
  return srgb_decode(v);
}

static int32_t entry_of(const Voxeliser *x, const SurfacePoint *s)
{
  const SurfaceMaterial *m = &x->world->materials[s->material];
  const Vec3 tint = texture_color(x->world->textures, m->color_map, s);
  VoxelLook look = voxel_look_plain();
  look.roughness = roundf(m->roughness * 16) / 16;
  look.metallic = roundf(m->metallic * 4) / 4;
  look.transmission = m->kind == SURFACE_GLASS ? 1 : roundf(m->transmission * 4) / 4;
  look.ior = m->ior;
  float color[3];
  const float emitted = v3_max_lane(m->emission);
  for (int k = 0; k < 3; k++)
    color[k] = rounded(emitted > 0 ? m->emission[k] / emitted : m->color[k] * tint[k] * s->color[k]);
  look.emission = emitted;
  const int32_t look_i = voxel_edit_look(x->edit, &look);
  return voxel_edit_color(x->edit, color, look_i < 0 ? 0 : (uint32_t)look_i);
}

static bool put(const Voxeliser *x, const int32_t c[3], const SurfacePoint *s)
{
  if (voxel_edit_get(x->edit, c[0], c[1], c[2])) return true; // the first one stays
  const int32_t entry = entry_of(x, s);
  return (entry >= 0 && voxel_edit_put(x->edit, c[0], c[1], c[2], (uint32_t)entry)) || err_memory(x->err, "voxels", 0);
}

// --- triangles ----------------------------------------------------------------------------------------------------
// Vertices relative to the middle of a cell, which reaches half a unit to all sides. One axis: does the box miss the triangle?
static bool is_apart(const Vec3 v[3], Vec3 axis)
{
  const float a = v3_dot(v[0], axis), b = v3_dot(v[1], axis), c = v3_dot(v[2], axis);
  const Vec3 size = v3_abs(axis);
  const float reach = 0.5f * (size[0] + size[1] + size[2]) * (1 + 1e-5f) + 1e-6f;
  return fminf(a, fminf(b, c)) > reach || fmaxf(a, fmaxf(b, c)) < -reach;
}

static bool is_touched(const Vec3 v[3])
{
  const Vec3 unit[3] = {v3(1, 0, 0), v3(0, 1, 0), v3(0, 0, 1)}, edge[3] = {v[1] - v[0], v[2] - v[1], v[0] - v[2]};
  for (int k = 0; k < 3; k++)
    if (is_apart(v, unit[k])) return false;
  if (is_apart(v, v3_cross(edge[0], edge[1]))) return false;
  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 3; k++)
      if (is_apart(v, v3_cross(edge[i], unit[k]))) return false;
  return true;
}

// Weights of the triangle's point nearest to the origin in its plane, held inside.
static void weights_at(const Vec3 v[3], float *u, float *w)
{
  const Vec3 a = v[1] - v[0], b = v[2] - v[0], p = -v[0];
  const float aa = v3_dot(a, a), ab = v3_dot(a, b), bb = v3_dot(b, b), pa = v3_dot(p, a), pb = v3_dot(p, b);
  const float det = aa * bb - ab * ab;
  *u = det > 0 ? clamp_f((bb * pa - ab * pb) / det, 0, 1) : 0;
  *w = det > 0 ? clamp_f((aa * pb - ab * pa) / det, 0, 1 - *u) : 0;
}

static bool put_triangle(const Voxeliser *x, uint32_t instance, uint32_t triangle)
{
  const Instance *in = &accel_instances(x->world->accel)[instance];
  const TriangleMesh *mesh = &x->world->instances[instance].mesh;
  Vec3 v[3], lo = v3_all(INFINITY), hi = v3_all(-INFINITY);
  for (int k = 0; k < 3; k++) {
    const uint32_t i = mesh->triangles[3 * (size_t)triangle + (size_t)k];
    v[k] = (frame_point(&in->world_from_object, v3_load(mesh->positions + 3 * (size_t)i)) - x->corner) / x->cell;
    lo = v3_min(v[k], lo);
    hi = v3_max(v[k], hi);
  }
  int32_t from[3], to[3], c[3];
  for (int k = 0; k < 3; k++) {
    from[k] = (int32_t)clamp_f(floorf(lo[k] - 1e-4f), 0, (float)(x->size[k] - 1));
    to[k] = (int32_t)clamp_f(floorf(hi[k] + 1e-4f), 0, (float)(x->size[k] - 1));
  }
  const Ray ray = {v3_all(0), v3(0, 0, 1), 0, INFINITY};
  const Placement at = {&in->world_from_object, &in->object_from_world};
  for (c[2] = from[2]; c[2] <= to[2]; c[2]++)
    for (c[1] = from[1]; c[1] <= to[1]; c[1]++)
      for (c[0] = from[0]; c[0] <= to[0]; c[0]++) {
        const Vec3 middle = v3((float)c[0] + 0.5f, (float)c[1] + 0.5f, (float)c[2] + 0.5f);
        const Vec3 near[3] = {v[0] - middle, v[1] - middle, v[2] - middle};
        if (!is_touched(near)) continue;
        Hit hit = {.prim = triangle, .instance = instance};
        weights_at(near, &hit.u, &hit.v);
        SurfacePoint s = surface_of_triangle(mesh, &at, &ray, &hit);
        s.material = world_material(x->world, &hit);
        if (!put(x, c, &s)) return false;
      }
  return true;
}

// The instance's triangles: it knows the arrays, the parts know how long they are.
static size_t triangle_count(const World *w, uint32_t instance)
{
  const WorldParts *parts = (const WorldParts *)w->parts;
  const float *positions = w->instances[instance].mesh.positions;
  for (size_t k = 0; positions && k < parts->meshes.count; k++)
    if (parts->meshes.items[k].data->positions == positions) return parts->meshes.items[k].data->triangle_count;
  return 0;
}

static bool put_meshes(const Voxeliser *x)
{
  for (uint32_t i = 0; i < x->world->instance_count; i++) {
    const size_t count = triangle_count(x->world, i);
    for (uint32_t t = 0; t < count; t++)
      if (!put_triangle(x, i, t)) return false;
  }
  return true;
}

// --- rays ---------------------------------------------------------------------------------------------------------
// Along one line through the middles of cells: surfaces, and what lies between the front of one and the back of the next.
static bool put_line(const Voxeliser *x, int axis, Vec3 origin, bool is_solid)
{
  Vec3 d = v3_all(0);
  d[axis] = 1;
  Ray ray = {origin, d, 0, INFINITY};
  RayCounters unused = {0};
  Hit hit;
  int32_t entered = -1;
  SurfacePoint front = {0};
  for (int n = 0; n < 4 * x->size[axis] && accel_closest(x->world->accel, &ray, RAY_ALL, NULL, NULL, &unused, &hit); n++) {
    SurfacePoint s = accel_surface(x->world->accel, &x->world->instances[hit.instance].mesh, &ray, &hit);
    s.material = world_material(x->world, &hit);
    const Vec3 p = (s.p - x->corner) / x->cell;
    int32_t c[3];
    for (int k = 0; k < 3; k++) c[k] = (int32_t)clamp_f(floorf(p[k]), 0, (float)(x->size[k] - 1));
    if (!put(x, c, &s)) return false;
    if (is_solid && s.is_back && entered >= 0) {
      const int32_t end = c[axis];
      for (c[axis] = entered; c[axis] < end; c[axis]++)
        if (!put(x, c, &front)) return false;
      entered = -1;
    } else if (is_solid && !s.is_back && entered < 0) {
      entered = c[axis];
      front = s;
    }
    ray.tmin = nextafterf(hit.t + 1e-5f * x->cell, INFINITY);
  }
  return true;
}

static bool put_lines(const Voxeliser *x, bool is_solid)
{
  for (int axis = 0; axis < 3; axis++) {
    const int i = axis == 0 ? 1 : 0, j = axis == 2 ? 1 : 2;
    for (int32_t a = 0; a < x->size[i]; a++)
      for (int32_t b = 0; b < x->size[j]; b++) {
        Vec3 o = x->corner;
        o[axis] -= x->cell;
        o[i] += x->cell * ((float)a + 0.5f);
        o[j] += x->cell * ((float)b + 0.5f);
        if (!put_line(x, axis, o, is_solid && axis == 1)) return false;
      }
  }
  return true;
}

// --- media --------------------------------------------------------------------------------------------------------
static bool is_inside(const Instance *i, Vec3 p, bool is_box)
{
  const Vec3 at = frame_point(&i->object_from_world, p);
  if (i->kind == INSTANCE_SPHERE) return v3_length(at) <= i->size[0];
  return !is_box || v3_max_lane(v3_abs(at)) <= 0.5f + 1e-5f; // a mesh holds all of its density
}

static int32_t smoke_entry(const Voxeliser *x, const Volume *v, Vec3 there)
{
  VoxelLook look = voxel_look_plain();
  float color[3];
  if (v->density && v->density->kind == DENSITY_VOXELS) { // what it was before it was smoke
    const VoxelPalette *p = v->density->voxels.cells->palette;
    const VoxelEntry *e = &p->entries[density_entry(v->density, there)];
    const int32_t look_i = voxel_edit_look(x->edit, &p->looks[e->look]);
    return voxel_edit_color(x->edit, e->color, look_i < 0 ? 0 : (uint32_t)look_i);
  }
  const Vec3 scattering = volume_scattering(v, there);
  for (int k = 0; k < 3; k++)
    color[k] = v->extinction[k] > 0 ? rounded(reflectance_of_albedo(scattering[k] / v->extinction[k])) : 1;
  const int32_t look_i = voxel_edit_look(x->edit, &look);
  return voxel_edit_color(x->edit, color, look_i < 0 ? 0 : (uint32_t)look_i);
}

static bool put_medium(const Voxeliser *x, uint32_t i, float density)
{
  const Instance *boundary = &accel_instances(x->world->media_accel)[i];
  const WorldMedium *m = &x->world->media[i];
  const Volume *v = &x->world->volumes[m->volume];
  int32_t c[3];
  for (c[2] = 0; c[2] < x->size[2]; c[2]++)
    for (c[1] = 0; c[1] < x->size[1]; c[1]++)
      for (c[0] = 0; c[0] < x->size[0]; c[0]++) {
        const Vec3 p = x->corner + x->cell * v3((float)c[0] + 0.5f, (float)c[1] + 0.5f, (float)c[2] + 0.5f);
        const Vec3 there = frame_point(&m->medium_from_world, p);
        const float here = v->density ? density_at(v->density, there) : 1;
        if (here < density || !is_inside(boundary, p, m->is_box) || voxel_edit_get(x->edit, c[0], c[1], c[2])) continue;
        const int32_t entry = smoke_entry(x, v, there);
        if (entry < 0 || !voxel_edit_put(x->edit, c[0], c[1], c[2], (uint32_t)entry))
          return err_memory(x->err, "voxels", 0);
      }
  return true;
}

static bool put_media(const Voxeliser *x, float density)
{
  const Accel *a = x->world->media_accel;
  for (uint32_t i = 0; density > 0 && a && i < a->instance_count; i++)
    if (!put_medium(x, i, density)) return false;
  return true;
}

// How wide the smallest of the cells of media are that have some; 0: none have.
static float media_cell(const World *w)
{
  float least = 0;
  for (uint32_t i = 0; w->media_accel && i < w->media_accel->instance_count; i++) {
    const Density *d = w->volumes[w->media[i].volume].density;
    const Frame f = frame_inverse(&w->media[i].medium_from_world);
    const Vec3 axes[3] = {f.x, f.y, f.z};
    for (int k = 0; d && k < 3; k++) {
      const float cells = d->kind == DENSITY_GRID     ? (float)d->grid.size[k]
                          : d->kind == DENSITY_VOXELS ? d->hi[k] - d->lo[k]
                                                      : 0;
      const float wide = cells > 0 ? v3_length(axes[k]) * (d->hi[k] - d->lo[k]) / cells : 0;
      if (wide > 0 && (!(least > 0) || wide < least)) least = wide;
    }
  }
  return least;
}

static int32_t side_of_media(const World *w, float longest, Err *err)
{
  const float cell = media_cell(w), side = cell > 0 ? roundf(longest / cell) : 0;
  if (side >= 1 && side <= VOXELS_MOST_SIDE) return (int32_t)side;
  if (side > 0)
    err_set(err, ERR_BAD_SCENE, "as fine as the grid is there would be %.0f voxels along the longest side, and there may "
            "be %d; say how many there should be", (double)side, VOXELS_MOST_SIDE);
  else
    err_set(err, ERR_BAD_SCENE, "say how many voxels there should be along the longest side, 1 to %d", VOXELS_MOST_SIDE);
  return 0;
}

Voxels *world_voxelise(const World *w, int32_t side, bool is_solid, float density, float *cell, float corner[3], Err *err)
{
  const Vec3 lo = v3_load(w->lo), hi = v3_load(w->hi);
  const float longest = v3_max_lane(hi - lo);
  if (!(w->lo[0] <= w->hi[0]) || !(longest > 0) || !isfinite(longest)) {
    err_set(err, ERR_BAD_SCENE, "there is nothing to make voxels of");
    return NULL;
  }
  if (!side && !(side = side_of_media(w, longest, err))) return NULL;
  Voxeliser x = {.world = w, .cell = longest / (float)side, .corner = lo, .err = err};
  for (int k = 0; k < 3; k++) {
    const float cells = ceilf((hi[k] - lo[k]) / x.cell - 1e-4f);
    x.size[k] = cells < 1 ? 1 : cells > (float)side ? side : (int32_t)cells;
  }
  x.edit = voxel_edit_create(x.size, err);
  if (!x.edit) return NULL;
  if (!put_meshes(&x) || !put_lines(&x, is_solid) || !put_media(&x, density)) {
    voxel_edit_destroy(x.edit);
    return NULL;
  }
  *cell = x.cell;
  v3_store(corner, x.corner);
  return voxel_edit_end(x.edit, err);
}
