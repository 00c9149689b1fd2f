// From a csg object and the objects that are its parts to one body (geom/csg.h): the tree of operations as postfix
// steps, each closed shape a leaf placed in the world with its own material. A part stands further down in the list
// than what it is a part of, so that there are no circles to look for.

#include "world/prepare.h"

enum { MOST_CSG_DEPTH = 16 };

typedef struct Body {
  Prepare *p;
  const CsgPlace *place;
  Csg *csg;
  CsgLeaf *leaves;     // of csg
  uint32_t *materials; // one a leaf
} Body;

static const Object *object_at(const Body *b, int32_t i)
{
  return &b->place->source->scene->objects.items[i];
}

static bool fail_at(const Body *b, int32_t i, const char *message)
{
  return prepare_failed_object(b->p, b->place->source->scene, i, message);
}

bool prepare_solid(const Shape *s, Solid *out, Frame *moved)
{
  *moved = frame_identity();
  switch ((ShapeKind)s->kind) {
  case SHAPE_SPHERE: *out = solid_sphere(s->sphere.radius); return true;
  case SHAPE_BOX:
    *out = (Solid){.kind = SOLID_BOX, .is_closed = true,
                   .size = {s->box.size[0] / 2, s->box.size[1] / 2, s->box.size[2] / 2}};
    return true;
  case SHAPE_PLANE: *out = (Solid){.kind = SOLID_PLANE, .is_closed = true}; return true;
  case SHAPE_TRIANGLE: {
    const Vec3 a = v3_load(s->triangle.a), x = v3_load(s->triangle.b) - a, y = v3_load(s->triangle.c) - a;
    const Vec3 n = v3_cross(x, y);
    *moved = (Frame){x, y, n / sqrtf(v3_length(n)), a}; // a normal of the corners' own scale
    *out = (Solid){.kind = SOLID_TRIANGLE};
    return true;
  }
  case SHAPE_CYLINDER:
    *out = solid_frustum(s->cylinder.radius, s->cylinder.radius, s->cylinder.height, s->cylinder.capped);
    return true;
  case SHAPE_CONE:
    *out = solid_frustum(s->cone.radius, s->cone.top_radius, s->cone.height, s->cone.capped);
    return true;
  case SHAPE_ENDLESS_CONE:
    *out = solid_cone(tan((double)s->endless_cone.angle * (3.14159265358979323846 / 180)));
    return true;
  case SHAPE_TORUS:
    *out = (Solid){.kind = SOLID_TORUS, .is_closed = true, .size = {s->torus.radius, min_f(s->torus.tube_radius, s->torus.radius)}};
    return true;
  case SHAPE_MESH:
  case SHAPE_QUAD:
  case SHAPE_DISK:
  case SHAPE_VOXELS:
  case SHAPE_CSG:
  case SHAPE_FIELD:
  case SHAPE_ROUND_BOX:
  case SHAPE_CAPSULE:
  case SHAPE_ELLIPSOID:
  case SHAPE_OCTAHEDRON:
  case SHAPE_MENGER:
  case SHAPE_MANDELBULB:
  case SHAPE_FORMULA: return false;
  }
  unreachable();
}

static bool add_leaf(Body *b, int32_t i, const Frame *frame, uint32_t material, bool is_flipped, Bounds *bounds)
{
  const Object *o = object_at(b, i);
  Csg *c = b->csg;
  CsgLeaf leaf = {.is_flipped = is_flipped};
  Frame moved;
  if (o->shape.kind == SHAPE_MESH)
    return fail_at(b, i, "is a mesh, which cannot be part of a csg: only shapes given by formulas know inside from outside");
  if (!prepare_solid(&o->shape, &leaf.solid, &moved) || !leaf.solid.is_closed)
    return fail_at(b, i, "is part of a csg but has no inside; take a sphere, box, plane, torus, endless_cone, or a "
                         "cylinder or cone with its caps");
  if (c->leaf_count == MOST_LEAVES)
    return fail_at(b, i, "is one part too many: a csg has at most 32 shapes, those of its parts counted");
  leaf.world_from_leaf = frame_product(frame, &moved);
  leaf.leaf_from_world = frame_inverse(&leaf.world_from_leaf);
  const Bounds own = solid_bounds(&leaf.solid);
  *bounds = accel_world_bounds(&leaf.world_from_leaf, &own);
  for (int k = 0; k < 3; k++) {
    leaf.box[2 * k] = bounds->lo[k];
    leaf.box[2 * k + 1] = bounds->hi[k];
  }
  c->steps[c->step_count++] = (uint8_t)c->leaf_count;
  b->materials[c->leaf_count] = material;
  b->leaves[c->leaf_count++] = leaf;
  return true;
}

static void bounds_meet(Bounds *b, const Bounds *other)
{
  b->lo = lanes_max(other->lo, b->lo);
  b->hi = lanes_min(other->hi, b->hi);
}

static uint8_t step_of(CsgOperation operation)
{
  switch (operation) {
  case CSG_UNION: return STEP_UNION;
  case CSG_INTERSECTION: return STEP_INTERSECTION;
  case CSG_DIFFERENCE: return STEP_DIFFERENCE;
  }
  unreachable();
}

// Calls itself for parts that are bodies, at most MOST_CSG_DEPTH deep.
static bool add_body(Body *b, int32_t i, const Frame *frame, uint32_t material, bool is_flipped, int depth, Bounds *bounds)
{
  const Source *source = b->place->source;
  const CsgOperation operation = (CsgOperation)object_at(b, i)->shape.csg.operation;
  bool is_first = true;
  if (depth == MOST_CSG_DEPTH) return fail_at(b, i, "is nested too deep: csg in csg goes at most 16 deep");
  for (int32_t part = source->first_part[i]; part >= 0; part = source->next_part[part], is_first = false) {
    const Object *o = object_at(b, part);
    const Frame own = object_frame(&o->common), placed = frame_product(frame, &own);
    const uint32_t skin = b->place->material < 0 && o->common.material >= 0
                              ? source->material_base + (uint32_t)o->common.material
                              : material;
    const bool flips = is_flipped != (operation == CSG_DIFFERENCE && !is_first);
    Bounds box;
    const bool ok = o->shape.kind == SHAPE_CSG ? add_body(b, part, &placed, skin, flips, depth + 1, &box)
                                               : add_leaf(b, part, &placed, skin, flips, &box);
    if (!ok) return false;
    if (is_first) {
      *bounds = box;
      continue;
    }
    b->csg->steps[b->csg->step_count++] = step_of(operation);
    if (operation == CSG_UNION) bounds_add(bounds, &box);
    if (operation == CSG_INTERSECTION) bounds_meet(bounds, &box);
  }
  return !is_first ||
         fail_at(b, i, "is a csg without parts; name it in \"part_of\" of the objects it is made of, below it in the list");
}

bool prepare_csg(Prepare *p, const CsgPlace *place, int32_t object_i, Instance *instance, WorldInstance *shading)
{
  Arena *arena = &p->world->arena;
  Body b = {p, place, arena_alloc(arena, 1, sizeof *b.csg), arena_alloc(arena, MOST_LEAVES, sizeof *b.leaves),
            arena_alloc(arena, MOST_LEAVES, sizeof *b.materials)};
  uint16_t *slots = arena_alloc(arena, MOST_LEAVES * SOLID_PARTS, sizeof *slots);
  if (!b.csg || !b.leaves || !b.materials || !slots) return prepare_failed_memory(p);
  *b.csg = (Csg){.leaves = b.leaves};
  const Object *o = object_at(&b, object_i);
  const uint32_t material = place->material >= 0      ? (uint32_t)place->material
                            : o->common.material >= 0 ? place->source->material_base + (uint32_t)o->common.material
                                                      : UINT32_MAX; // the default, once that is known
  const Frame own = object_frame(&o->common), frame = frame_product(&place->frame, &own);
  if (!add_body(&b, object_i, &frame, material, false, 0, &b.csg->bounds)) return false;
  for (int i = 0; i < MOST_LEAVES * SOLID_PARTS; i++) slots[i] = (uint16_t)(i / SOLID_PARTS);
  instance->kind = INSTANCE_CSG;
  instance->csg = b.csg;
  instance->world_from_object = frame_identity();
  shading->slots = slots;
  shading->materials = b.materials;
  shading->slot_count = b.csg->leaf_count;
  return prepare_add_instance(p, instance, shading, -1);
}

static bool can_have_parts(const Shape *s) { return s->kind == SHAPE_CSG || s->kind == SHAPE_FIELD; }

bool prepare_parts(Prepare *p, Source *source)
{
  const Scene *s = source->scene;
  const size_t count = s->objects.count;
  source->first_part = arena_alloc(&p->scratch, count + 1, sizeof *source->first_part);
  source->next_part = arena_alloc(&p->scratch, count + 1, sizeof *source->next_part);
  if (!source->first_part || !source->next_part) return prepare_failed_memory(p);
  for (size_t i = 0; i < count; i++) source->first_part[i] = source->next_part[i] = -1;
  for (size_t i = count; i-- > 0;) { // from behind, so that the lists come out in order
    const int32_t whole = s->objects.items[i].common.part_of;
    if (whole < 0) continue;
    const char *name = s->objects.items[i].name;
    if ((size_t)whole >= i || !can_have_parts(&s->objects.items[whole].shape))
      return err_set(p->err, ERR_BAD_SCENE, "objects[%zu]%s%s%s: part_of must name an object of kind csg or field further up in the list",
                     i, name ? " (\"" : "", name ? name : "", name ? "\")" : "");
    source->next_part[i] = source->first_part[whole];
    source->first_part[whole] = (int32_t)i;
  }
  return true;
}
