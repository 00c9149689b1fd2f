// The camera of a scene that has none: a fixed direction, and from there the nearest point that sees everything. It
// goes by the triangles, not by their box: a box's empty corners would leave a slender model small in its picture.

#include "world/parts.h"
#include "world/world.h"

#include <float.h>
#include <string.h>

enum {
  MOST_TRIANGLES = 1 << 23
}; // past it, boxes of instances do: 8 M triangles take 60 ms on the 2021 Xeon at hand

// Seen along a fixed axis z, a point (x, y, z) is inside the picture of an eye at (cx, cy, d) if
// |x - cx| <= (d - z) tan_x and likewise for y. All points are if these four are, over all points, at most
// cx + d tan_x, -cx + d tan_x, cy + d tan_y and -cy + d tan_y.
typedef struct Extent {
  Vec3 centre, right, up, back; // of the view
  float tan_x, tan_y;
  float left_most, right_most, down_most, up_most, near_most;
} Extent;

static void see(Extent *e, Vec3 p)
{
  if (!v3_is_finite(p)) return; // placed beyond all numbers: nothing can hit it either
  const Vec3 q = p - e->centre;
  const float x = v3_dot(q, e->right), y = v3_dot(q, e->up), z = v3_dot(q, e->back);
  e->right_most = max_f(e->right_most, x + z * e->tan_x);
  e->left_most = max_f(e->left_most, -x + z * e->tan_x);
  e->up_most = max_f(e->up_most, y + z * e->tan_y);
  e->down_most = max_f(e->down_most, -y + z * e->tan_y);
  e->near_most = max_f(e->near_most, z);
}

static void see_box(Extent *e, const Frame *f, const float lo[3], const float hi[3])
{
  for (int k = 0; k < 8; k++)
    see(e, frame_point(f, v3(k & 1 ? hi[0] : lo[0], k & 2 ? hi[1] : lo[1], k & 4 ? hi[2] : lo[2])));
}

static const MeshData *find_mesh(const World *w, const MeshTree *tree)
{
  for (size_t k = 0; k < w->parts->meshes.count; k++)
    if (w->parts->meshes.items[k].tree == tree) return w->parts->meshes.items[k].data;
  return NULL;
}

static void see_mesh(Extent *e, const World *w, const Instance *i)
{
  const MeshData *m = w->triangle_count <= MOST_TRIANGLES ? find_mesh(w, i->mesh) : NULL;
  if (!m) {
    float lo[3], hi[3];
    mesh_tree_bounds(i->mesh, lo, hi);
    if (lo[0] <= hi[0]) see_box(e, &i->world_from_object, lo, hi);
    return;
  }
  for (size_t k = 0; k < 3 * m->triangle_count; k++)
    see(e, frame_point(&i->world_from_object, v3_load(m->positions + 3 * (size_t)m->triangles[k])));
}

static void see_instance(Extent *e, const World *w, const Instance *i)
{
  const float r = i->size[0];
  switch ((InstanceKind)i->kind) {
  case INSTANCE_MESH: see_mesh(e, w, i); return;
  case INSTANCE_SPHERE:
    see_box(e, &i->world_from_object, (float[3]){-r, -r, -r}, (float[3]){r, r, r});
    return;
  case INSTANCE_QUAD:
    see_box(e, &i->world_from_object, (float[3]){-r, -i->size[1], 0}, (float[3]){r, i->size[1], 0});
    return;
  case INSTANCE_SOLID: {
    const Bounds b = solid_bounds(i->solid);
    if (!bounds_is_finite(&b)) return; // no picture shows all of it
    see_box(e, &i->world_from_object, (float[3]){b.lo[0], b.lo[1], b.lo[2]}, (float[3]){b.hi[0], b.hi[1], b.hi[2]});
    return;
  }
  case INSTANCE_CSG: {
    const Bounds *b = &i->csg->bounds;
    const Frame here = frame_identity();
    if (!bounds_is_finite(b)) return;
    see_box(e, &here, (float[3]){b->lo[0], b->lo[1], b->lo[2]}, (float[3]){b->hi[0], b->hi[1], b->hi[2]});
    return;
  }
  case INSTANCE_VOXELS: {
    const Bounds b = voxel_bounds(i->voxels);
    if (bounds_is_empty(&b)) return;
    see_box(e, &i->world_from_object, (float[3]){b.lo[0], b.lo[1], b.lo[2]}, (float[3]){b.hi[0], b.hi[1], b.hi[2]});
    return;
  }
  case INSTANCE_SDF: {
    const Bounds *b = &i->sdf->bounds;
    if (!bounds_is_finite(b)) return;
    see_box(e, &i->world_from_object, (float[3]){b->lo[0], b->lo[1], b->lo[2]}, (float[3]){b->hi[0], b->hi[1], b->hi[2]});
    return;
  }
  case INSTANCE_DISK: see_box(e, &i->world_from_object, (float[3]){-r, -r, 0}, (float[3]){r, r, 0}); return;
  }
  unreachable();
}

Camera world_frame_camera(const World *w, float aspect)
{
  Camera c;
  memset(&c, 0, sizeof c);
  c.kind = CAMERA_PERSPECTIVE;
  c.common.up[1] = 1;
  c.common.cell = -1;
  c.perspective.fov = 30;
  if (!(w->lo[0] <= w->hi[0])) {
    c.common.position[2] = 4;
    return c;
  }
  // A lens of 80 mm on full frame, and high enough that a floor fills the picture up to its upper edge.
  const float tangent = (float)tan((double)c.perspective.fov * 3.14159265358979323846 / 360), margin = 1.2f;
  const float none = -FLT_MAX;
  Extent e = {.centre = v3_load(w->lo) / 2 + v3_load(w->hi) / 2,
              .back = v3_normalize(v3(0.55f, 0.42f, 1)),
              .tan_x = tangent * aspect / margin,
              .tan_y = tangent / margin,
              .left_most = none,
              .right_most = none,
              .down_most = none,
              .up_most = none,
              .near_most = none};
  e.right = v3_normalize(v3_cross(v3(0, 1, 0), e.back));
  e.up = v3_cross(e.back, e.right);
  for (size_t i = 0; i < w->instance_count; i++) see_instance(&e, w, &accel_instances(w->accel)[i]);
  for (size_t i = 0; i < w->media_count; i++) // of the atmosphere there is no end
    if (w->media[i].object_i != NO_HIT) see_instance(&e, w, &accel_instances(w->media_accel)[i]);
  float distance =
      max_f((e.left_most + e.right_most) / (2 * e.tan_x), (e.down_most + e.up_most) / (2 * e.tan_y));
  if (!(distance > e.near_most)) distance = e.near_most + 1; // a single point
  const Vec3 target =
      e.centre + (e.right_most - e.left_most) / 2 * e.right + (e.up_most - e.down_most) / 2 * e.up;
  v3_store(c.common.target, target);
  v3_store(c.common.position, target + distance * e.back);
  return c;
}
