// See pages.h: what `rayfold info` says. Models are counted as often as objects show them, and stored once.

#include "image/voxels.h"
#include "scene/kinds.h"
#include "scene/pages.h"
#include "scene/rig.h"

#include <float.h>
#include <stdint.h>

typedef struct Count {
  double shown;    // triangles, each instance counted
  uint64_t stored; // triangles
  uint64_t shapes; // analytic shapes shown, each instance
  uint64_t bytes;  // of mesh data
  uint64_t files;  // models, at any depth
} Count;

typedef struct Box {
  Vec3 lo, hi;
} Box;

static const Box nothing = {{FLT_MAX, FLT_MAX, FLT_MAX}, {-FLT_MAX, -FLT_MAX, -FLT_MAX}};

static void grow(Box *b, Vec3 p)
{
  b->lo = v3_min(b->lo, p);
  b->hi = v3_max(b->hi, p);
}

// The box around a box moved by a frame.
static void grow_by_box(Box *b, const Frame *f, const Box *inner)
{
  if (inner->lo[0] > inner->hi[0]) return;
  for (int i = 0; i < 8; i++)
    grow(b, frame_point(f, v3(i & 1 ? inner->hi[0] : inner->lo[0], i & 2 ? inner->hi[1] : inner->lo[1],
                              i & 4 ? inner->hi[2] : inner->lo[2])));
}

static uint64_t mesh_bytes(const MeshData *m)
{
  const uint64_t floats = 3 + 3 * (m->normals != NULL) + 2 * (m->texcoords[0] != NULL) +
                          2 * (m->texcoords[1] != NULL) + 4 * (m->colors != NULL) + 4 * (m->tangents != NULL);
  return m->vertex_count * floats * 4 + m->triangle_count * (12 + 2 * (m->material_slots != NULL));
}

static Box half_box(float x, float y, float z)
{
  return (Box){v3(-x, -y, -z), v3(x, y, z)};
}

static Box mesh_box(const MeshData *m)
{
  Box b = nothing;
  for (size_t i = 0; i < m->vertex_count; i++) grow(&b, v3_load(m->positions + 3 * i));
  return b;
}

static Box voxels_box(const Scene *s, const Shape *shape)
{
  const Voxels *v = shape->voxels_i >= 0 ? s->voxels.items[shape->voxels_i].data : NULL;
  const Vec3 from = voxels_origin(&shape->voxels, v);
  if (!v || v->lo[0] >= v->hi[0]) return nothing;
  const float a = shape->voxels.voxel_size;
  return (Box){from + a * v3((float)v->lo[0], (float)v->lo[1], (float)v->lo[2]),
               from + a * v3((float)v->hi[0], (float)v->hi[1], (float)v->hi[2])};
}

static Box shape_box(const Scene *s, const Shape *shape, Count *count)
{
  if (shape->kind != SHAPE_MESH) count->shapes++;
  switch ((ShapeKind)shape->kind) {
  case SHAPE_SPHERE: return half_box(shape->sphere.radius, shape->sphere.radius, shape->sphere.radius);
  case SHAPE_QUAD: return half_box(shape->quad.size[0] / 2, shape->quad.size[1] / 2, 0);
  case SHAPE_DISK: return half_box(shape->disk.radius, shape->disk.radius, 0);
  case SHAPE_BOX: return half_box(shape->box.size[0] / 2, shape->box.size[1] / 2, shape->box.size[2] / 2);
  case SHAPE_TRIANGLE: {
    Box b = nothing;
    grow(&b, v3_load(shape->triangle.a));
    grow(&b, v3_load(shape->triangle.b));
    grow(&b, v3_load(shape->triangle.c));
    return b;
  }
  case SHAPE_CYLINDER:
    if (shape->cylinder.height == 0) return nothing;
    return half_box(shape->cylinder.radius, shape->cylinder.height / 2, shape->cylinder.radius);
  case SHAPE_CONE: {
    const float widest = max_f(shape->cone.radius, shape->cone.top_radius);
    return half_box(widest, shape->cone.height / 2, widest);
  }
  case SHAPE_TORUS: {
    const float outer = shape->torus.radius + shape->torus.tube_radius;
    return half_box(outer, shape->torus.tube_radius, outer);
  }
  case SHAPE_VOXELS: return voxels_box(s, shape);
  case SHAPE_PLANE:
  case SHAPE_ENDLESS_CONE: // have no ends
  case SHAPE_ROUND_BOX:
    return half_box(shape->round_box.size[0] / 2, shape->round_box.size[1] / 2, shape->round_box.size[2] / 2);
  case SHAPE_CAPSULE:
    return half_box(shape->capsule.radius, shape->capsule.radius + shape->capsule.height / 2, shape->capsule.radius);
  case SHAPE_ELLIPSOID:
    return half_box(shape->ellipsoid.radius[0], shape->ellipsoid.radius[1], shape->ellipsoid.radius[2]);
  case SHAPE_OCTAHEDRON: return half_box(shape->octahedron.radius, shape->octahedron.radius, shape->octahedron.radius);
  case SHAPE_MENGER: return half_box(shape->menger.size / 2, shape->menger.size / 2, shape->menger.size / 2);
  case SHAPE_MANDELBULB: return half_box(shape->mandelbulb.radius, shape->mandelbulb.radius, shape->mandelbulb.radius);
  case SHAPE_FORMULA: return half_box(shape->formula.size[0] / 2, shape->formula.size[1] / 2, shape->formula.size[2] / 2);
  case SHAPE_FIELD:
  case SHAPE_CSG: return nothing; // its parts are measured, those cut away, too
  case SHAPE_MESH: break;
  }
  if (shape->mesh_i < 0) return nothing;
  const MeshData *m = s->meshes.items[shape->mesh_i].data;
  count->shown += (double)m->triangle_count;
  return mesh_box(m);
}

// Scenes nest at most 16 deep, so this may call itself; each model is measured once, however often it is shown.
static Box scene_box(const Scene *s, Count *count)
{
  Box all = nothing;
  ARRAY(Box) boxes = {0};
  ARRAY(Count) counts = {0};
  for (size_t i = 0; i < s->models.count; i++) {
    Count inner = {0};
    const Box box = scene_box(s->models.items[i].scene, &inner);
    if (!array_push(&boxes, box) || !array_push(&counts, inner)) break;
    count->stored += inner.stored;
    count->bytes += inner.bytes;
    count->files += 1 + inner.files;
  }
  for (size_t i = 0; i < s->meshes.count; i++) {
    count->stored += s->meshes.items[i].data->triangle_count;
    count->bytes += mesh_bytes(s->meshes.items[i].data);
  }
  for (size_t i = 0; i < s->objects.count; i++) {
    const Object *o = &s->objects.items[i];
    const Frame f = object_frame(&o->common);
    const int32_t m = o->shape.kind == SHAPE_MESH ? o->shape.model_i : -1;
    if (m >= 0 && (size_t)m >= counts.count) continue; // memory was out
    const Box box = m >= 0 ? boxes.items[m] : shape_box(s, &o->shape, count);
    if (m >= 0) {
      count->shown += counts.items[m].shown;
      count->shapes += counts.items[m].shapes;
    }
    grow_by_box(&all, &f, &box);
  }
  array_finish(&boxes);
  array_finish(&counts);
  return all;
}

static void put_section(const Scene *s, const Section *c, Text *out)
{
  const size_t count = section_count(s, c);
  if (c->form == SECTION_ONE || !count) return;
  text_add(out, "%-10s %zu", c->group->name, count);
  const Group *g = c->group->nested ? c->group->nested : c->group;
  for (size_t k = 0, named = 0; g->has_kind && k < g->kind_count; k++) {
    size_t of_kind = 0;
    for (size_t i = 0; i < count; i++) {
      const void *e = section_at(s, c, i);
      of_kind += group_kind(g, c->group->nested ? group_nested(c->group, e) : e) == &g->kinds[k];
    }
    if (of_kind) text_add(out, "%s%zu %s", named++ ? ", " : ": ", of_kind, g->kinds[k].name);
  }
  text_add(out, "\n");
}

static void put_geometry(const Scene *s, Text *out)
{
  Count count = {0};
  const Box box = scene_box(s, &count);
  text_add(out, "%-10s %.0f shown, %llu stored (%.1f MB)\n", "triangles", count.shown,
           (unsigned long long)count.stored, (double)count.bytes / 1e6);
  if (count.shapes) text_add(out, "%-10s %llu shown\n", "shapes", (unsigned long long)count.shapes);
  if (count.files) text_add(out, "%-10s %llu\n", "models", (unsigned long long)count.files);
  if (box.lo[0] > box.hi[0]) return;
  text_add(out, "%-10s %.6g %.6g %.6g to %.6g %.6g %.6g m\n", "bounds", (double)box.lo[0], (double)box.lo[1],
           (double)box.lo[2], (double)box.hi[0], (double)box.hi[1], (double)box.hi[2]);
}

bool scene_info(const Scene *s, Text *out)
{
  text_add(out, "%s\n", s->path ? s->path : "a scene made by calls");
  text_add(out, "%-10s %d x %d, %d samples a pixel\n", "picture", s->render.size[0], s->render.size[1],
           s->render.spp);
  text_add(out, "%-10s %s\n", "camera",
           s->has_camera ? group_kind(&group_camera, &s->camera)->name : "none: one that shows everything");
  text_add(out, "%-10s %s\n", "sky", s->has_sky ? group_kind(&group_sky, &s->sky)->name : "none given");
  for (int i = 0; i < SECTION_COUNT; i++) put_section(s, &scene_sections[i], out);
  put_geometry(s, out);
  for (size_t i = 0; s->rig && i < s->rig->clips.count; i++)
    text_add(out, "%-10s %s, %g to %g s\n", "clip", s->rig->clips.items[i].name,
             (double)s->rig->clips.items[i].start, (double)s->rig->clips.items[i].end);
  for (size_t i = 0; i < s->notes.lines.count; i++) text_add(out, "note       %s\n", s->notes.lines.items[i]);
  return !out->failed;
}
