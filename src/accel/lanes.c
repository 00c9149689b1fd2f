// See lanes.h: from placed shapes to their numbers in the world.

#include "accel/lanes.h"

#include "accel/tree.h"

static float largest(Vec3 v) { return max_f(fabsf(v[0]), max_f(fabsf(v[1]), fabsf(v[2]))); }

// How long the longest and the shortest of all vectors of unit length become, at most and at least, for maps that turn,
// mirror and scale evenly; false for others.
static bool even_scale(const Frame *f, float *scale)
{
  const float x = v3_dot(f->x, f->x), y = v3_dot(f->y, f->y), z = v3_dot(f->z, f->z), slack = 1e-5f * x;
  *scale = sqrtf(x);
  return fabsf(y - x) < slack && fabsf(z - x) < slack && fabsf(v3_dot(f->x, f->y)) < slack &&
         fabsf(v3_dot(f->y, f->z)) < slack && fabsf(v3_dot(f->z, f->x)) < slack;
}

// A coordinate of object space as a plane's equation in the world: axis k of the inverse map.
static Vec3 coordinate(const Instance *i, int k, float scale, float shift, float *constant)
{
  const Frame *m = &i->object_from_world;
  *constant = m->p[k] * scale + shift;
  return v3(m->x[k], m->y[k], m->z[k]) * scale;
}

// z = 0 of object space, with x and y times su and sv as places on it.
static void make_flat(const Instance *i, LaneKind kind, float su, float sv, LaneShape *s)
{
  s->kind = (uint8_t)kind;
  s->n = coordinate(i, 2, 1, 0, &s->n0);
  const float length = v3_length(s->n);
  s->n = s->n / length;
  s->n0 = s->n0 / length;
  s->u = coordinate(i, 0, su, 0, &s->u0);
  s->v = coordinate(i, 1, sv, 0, &s->v0);
}

static void make_round(const Instance *i, const Solid *solid, LaneShape *s)
{
  s->kind = LANE_ROUND;
  s->is_closed = solid->is_closed;
  s->world_from_object = i->world_from_object;
  s->object_from_world = i->object_from_world;
  s->bulge = (float)solid->bulge;
  s->round_radius = (float)solid->radius;
  s->slope = (float)solid->slope;
  s->low = (float)solid->low;
  s->high = (float)solid->high;
}

static bool make_solid(const Instance *i, LaneShape *s)
{
  const Solid *solid = i->solid;
  switch ((SolidKind)solid->kind) {
  case SOLID_PLANE: make_flat(i, LANE_PLANE, 1, 1, s); return true;
  case SOLID_TRIANGLE: make_flat(i, LANE_TRIANGLE, 1, 1, s); return true;
  case SOLID_ROUND: make_round(i, solid, s); return true;
  case SOLID_BOX:
  case SOLID_TORUS: return false;
  }
  unreachable();
}

static bool make_shape(const Instance *i, LaneShape *s)
{
  float scale;
  switch ((InstanceKind)i->kind) {
  case INSTANCE_SPHERE: {
    const Solid ball = solid_sphere(i->size[0]);
    s->kind = LANE_BALL;
    s->is_closed = true;
    s->center = i->world_from_object.p;
    if (!even_scale(&i->world_from_object, &scale)) make_round(i, &ball, s);
    s->radius = i->size[0] * scale;
    return true;
  }
  case INSTANCE_QUAD: make_flat(i, LANE_QUAD, 1 / i->size[0], 1 / i->size[1], s); return true;
  case INSTANCE_DISK: make_flat(i, LANE_DISK, 1 / i->size[0], 1 / i->size[0], s); return true;
  case INSTANCE_SOLID: return make_solid(i, s);
  case INSTANCE_MESH:
  case INSTANCE_VOXELS:
  case INSTANCE_SDF:
  case INSTANCE_CSG: return false;
  }
  unreachable();
}

// The ball about the shape's box, and how large numbers get.
static void bound(const float box[6], LaneShape *s)
{
  const Vec3 lo = v3(box[0], box[2], box[4]), hi = v3(box[1], box[3], box[5]);
  s->reach = max_f(largest(lo), largest(hi));
  if (s->reach < INFINITY) {
    if (s->kind == LANE_BALL) return;
    s->center = 0.5f * (lo + hi);
    s->radius = 1.001f * v3_length(hi - s->center);
    return;
  }
  s->radius = INFINITY;
  s->reach = s->kind == LANE_ROUND ? largest(s->world_from_object.p) + fabsf(s->round_radius) : fabsf(s->n0);
}

const LaneSet *lanes_build(const Accel *a, Arena *arena)
{
  if (a->instance_count == 0 || a->instance_count > LANE_SHAPES) return NULL;
  for (size_t i = 0; i < a->instance_count; i++)
    if (a->instances[i].has_filter) return NULL;
  LaneSet *set = arena_alloc(arena, 1, sizeof *set);
  if (!set) return NULL; // trees do as well
  set->count = 0;
  for (size_t i = 0; i < a->instance_count; i++) {
    LaneShape *s = &set->shapes[set->count];
    *s = (LaneShape){.mask = a->instances[i].mask, .instance = (uint32_t)i};
    if (a->boxes[i][0] > a->boxes[i][1]) continue; // nothing can hit it
    if (!make_shape(&a->instances[i], s)) return NULL;
    bound(a->boxes[i], s);
    if (s->radius < INFINITY)
      for (int k = 0; k < 4; k++) set->ball[k][set->count] = k < 3 ? s->center[k] : s->radius;
    else
      set->endless |= 1u << set->count;
    set->count++;
  }
  return set;
}
