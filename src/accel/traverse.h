// Traverse: the nearest hit of a ray, or whether there is any. Two levels: the tree of instances in the world, and
// below it each mesh's tree in object space, where the ray's direction is not brought back to length one, so that t
// means the same everywhere.
//
// The answer does not depend on the trees. A hit on a primitive counts when the ray passes the primitive's own test,
// its own box and its instance's box; its t is raised to where the ray enters those boxes. Boxes are nested and
// their test is monotone, so whatever a box hides for being missed or farther than the best hit could not have won.
// Of equal t the smallest (instance, prim) wins. Hence a tree gives bit for bit what testing everything gives
// (accel/brute.h), at every level and for every shape of tree.
//
// Hot: nothing is checked. A ray that is not finite (tmax may be infinite) or has no direction hits nothing.

#ifndef RAYFOLD_ACCEL_TRAVERSE_H
#define RAYFOLD_ACCEL_TRAVERSE_H

#include "accel/tree.h"
#include "geom/disk.h"
#include "geom/quad.h"
#include "geom/sphere.h"
#include "geom/triangle.h"

// One question on its way through the trees: what is asked, and the best answer yet.
typedef struct Query {
  const Ray *ray; // in the world
  HitFilter *filter;
  const void *user;
  RayCounters *counters;
  Hit best;         // t starts at tmax and instance at NO_HIT
  bool is_any;      // the first hit will do
} Query;

// Where the walk stands: one instance, and the ray inside it.
typedef struct Visit {
  const Instance *instance;
  uint32_t instance_i;
  float near; // where the ray enters the instance's box
  TreeRay ray;
} Visit;

typedef struct StackEntry {
  uint32_t child;
  float near;
} StackEntry;

// Which children's boxes the ray meets within tmax, and where it enters them.
static inline unsigned node8_hit(const Node8 *n, const TreeRay *r, float tmax, float near[8])
{
  unsigned bits = 0;
  for (int g = 0; g < 8; g += WIDE) {
    wf t0 = wf_set(r->tmin), t1 = wf_set(tmax);
    for (int k = 0; k < 3; k++) {
      t0 = wf_max((wf_load(n->box[r->near_row[k]] + g) - r->o[k]) * r->inv[k], t0);
      t1 = wf_min((wf_load(n->box[r->far_row[k]] + g) - r->o[k]) * r->inv_far[k], t1);
    }
    wf_store(near + g, t0);
    bits |= wi_bits(t0 <= t1) << g;
  }
  return bits;
}

// Puts the children on the stack, the nearest on top. For any hit their order is of no use.
static inline int push_children(StackEntry *stack, int height, const Node8 *n, unsigned bits, const float near[8],
                                bool is_any)
{
  const int bottom = height;
  for (; bits; bits &= bits - 1) {
    const int i = __builtin_ctz(bits);
    const StackEntry e = {n->child[i], near[i]};
    int at = height++;
    for (; !is_any && at > bottom && stack[at - 1].near < e.near; at--) stack[at] = stack[at - 1];
    stack[at] = e;
  }
  return height;
}

// Whether a hit at t on this primitive beats the best one.
static inline bool is_better(const Hit *best, float t, uint32_t instance, uint32_t prim)
{
  if (t != best->t) return t < best->t;
  if (best->instance == NO_HIT) return false; // tmax itself is outside the interval
  return instance != best->instance ? instance < best->instance : prim < best->prim;
}

// Takes the candidate as the best hit unless the filter lets the ray pass.
static inline bool take_hit(Query *q, const Visit *v, const Hit *h)
{
  if (v->instance->has_filter && q->filter && !q->filter(q->user, q->ray, h)) return false;
  q->best = *h;
  return true;
}

static inline bool block_closest(Query *q, const Visit *v, const Tri8 *b)
{
  Tri8Hits h;
  bool found = false;
  q->counters->prims++;
  for (unsigned bits = tri8_hit(b, &v->ray, q->best.t, &h); bits; bits &= bits - 1) {
    const int i = __builtin_ctz(bits);
    const float near = tri8_box_near(b, i, &v->ray);
    const float t = max_f(max_f(h.t[i], near), v->near);
    if (!is_better(&q->best, t, v->instance_i, b->prim[i]) || !tri8_is_ahead(b, i, &v->ray)) continue;
    const float det = h.e[0][i] + h.e[1][i] + h.e[2][i];
    const Hit hit = {t, h.e[1][i] / det, h.e[2][i] / det, b->prim[i], v->instance_i};
    found |= take_hit(q, v, &hit);
    if (found && q->is_any) return true;
  }
  return found;
}

static inline bool mesh_closest(Query *q, const Visit *v)
{
  const MeshTree *m = v->instance->mesh;
  StackEntry stack[STACK_SIZE];
  int height = 0;
  bool found = false;
  stack[height++] = (StackEntry){m->root, v->near};
  while (height > 0) {
    const StackEntry e = stack[--height];
    if (e.near > q->best.t) continue;
    if (e.child & LEAF_BIT) {
      found |= block_closest(q, v, &m->blocks[e.child & ~LEAF_BIT]);
      if (found && q->is_any) return true;
      continue;
    }
    const Node8 *n = &m->nodes[e.child];
    float near[8];
    q->counters->nodes++;
    const unsigned bits = node8_hit(n, &v->ray, q->best.t, near);
    height = push_children(stack, height, n, bits, near, q->is_any);
  }
  return found;
}

// Spheres, quads and disks: up to two crossings, nearest first.
static inline bool shape_closest(Query *q, const Visit *v)
{
  const Instance *s = v->instance;
  float t[2], u = 0, w = 0;
  int count = 0;
  q->counters->prims++;
  switch ((InstanceKind)s->kind) {
  case INSTANCE_SPHERE: count = sphere_hit(s->size[0], &v->ray, t) ? 2 : 0; break;
  case INSTANCE_QUAD: count = quad_hit(s->size[0], s->size[1], &v->ray, t, &u, &w); break;
  case INSTANCE_DISK: count = disk_hit(s->size[0], &v->ray, t, &u, &w); break;
  case INSTANCE_MESH: break;
  }
  for (int i = 0; i < count; i++) {
    const float at = max_f(t[i], v->near);
    if (!(t[i] > v->ray.tmin) || !is_better(&q->best, at, v->instance_i, 0)) continue;
    if (s->kind == INSTANCE_SPHERE) {
      const Vec2 uv = sphere_uv(s->size[0], v3_load(v->ray.o) + t[i] * v3_load(v->ray.d));
      u = uv.x;
      w = uv.y;
    }
    const Hit hit = {at, u, w, 0, v->instance_i};
    if (take_hit(q, v, &hit)) return true;
  }
  return false;
}

// The instance's primitives, by the ray brought into its space.
static inline bool instance_closest(Query *q, const Accel *a, uint32_t instance_i, const TreeRay *world, float near,
                                    RayMask mask)
{
  const Instance *i = &a->instances[instance_i];
  if (!(i->mask & mask)) return false;
  Visit v;
  v.instance = i;
  v.instance_i = instance_i;
  v.near = near;
  if (i->is_identity) {
    v.ray = *world;
  } else {
    const Vec3 o = frame_point(&i->object_from_world, q->ray->o);
    const Vec3 d = frame_vector(&i->object_from_world, q->ray->d);
    if (!tree_ray_init(&v.ray, o, d, world->tmin)) return false;
  }
  return i->kind == INSTANCE_MESH ? mesh_closest(q, &v) : shape_closest(q, &v);
}

// Walks the upper tree. True when something was hit: q->best.
static inline bool accel_walk(const Accel *a, RayMask mask, Query *q)
{
  TreeRay r;
  if (a->root == EMPTY_TREE || !tree_ray_init(&r, q->ray->o, q->ray->d, q->ray->tmin)) return false;
  if (!(r.tmin < q->ray->tmax)) return false;
  StackEntry stack[STACK_SIZE];
  int height = 0;
  bool found = false;
  stack[height++] = (StackEntry){a->root, r.tmin};
  if (a->root & LEAF_BIT) stack[0].near = tree_ray_box(&r, a->boxes[a->root & ~LEAF_BIT], q->best.t);
  while (height > 0) {
    const StackEntry e = stack[--height];
    if (e.near > q->best.t) continue;
    if (e.child & LEAF_BIT) {
      found |= instance_closest(q, a, e.child & ~LEAF_BIT, &r, e.near, mask);
      if (found && q->is_any) return true;
      continue;
    }
    const Node8 *n = &a->nodes[e.child];
    float near[8];
    q->counters->nodes++;
    const unsigned bits = node8_hit(n, &r, q->best.t, near);
    height = push_children(stack, height, n, bits, near, q->is_any);
  }
  return found;
}

// The best hit starts at a finite t, so that boxes a ray never enters, at infinity, are beyond it.
static inline Query query_of(const Ray *ray, HitFilter *filter, const void *user, RayCounters *c, bool is_any)
{
  return (Query){ray, filter, user, c, {.t = min_f(ray->tmax, FLT_MAX), .instance = NO_HIT}, is_any};
}

// The nearest hit with tmin < t < tmax on instances that see the mask; filter may be NULL, counters may not. *hit is
// always set: instance is NO_HIT and t is tmax when there is none.
static inline bool accel_closest(const Accel *a, const Ray *ray, RayMask mask, HitFilter *filter, const void *user,
                                 RayCounters *c, Hit *hit)
{
  Query q = query_of(ray, filter, user, c, false);
  const bool found = accel_walk(a, mask, &q);
  *hit = q.best;
  if (!found) hit->t = ray->tmax;
  return found;
}

// Whether there is any hit that accel_closest would count.
static inline bool accel_any(const Accel *a, const Ray *ray, RayMask mask, HitFilter *filter, const void *user,
                             RayCounters *c)
{
  Query q = query_of(ray, filter, user, c, true);
  return accel_walk(a, mask, &q);
}

static inline Ray ray_unpack(const PackedRay *p)
{
  return (Ray){v3_load(p->o), v3_load(p->d), p->tmin, p->tmax};
}

// Many rays, in any order: room for kernels that keep several in flight.
static inline void accel_closest_n(const Accel *a, const PackedRay *rays, size_t count, RayMask mask,
                                   HitFilter *filter, const void *user, RayCounters *c, Hit *hits)
{
  for (size_t i = 0; i < count; i++) {
    const Ray ray = ray_unpack(&rays[i]);
    accel_closest(a, &ray, mask, filter, user, c, &hits[i]);
  }
}

static inline void accel_any_n(const Accel *a, const PackedRay *rays, size_t count, RayMask mask, HitFilter *filter,
                               const void *user, RayCounters *c, uint8_t *blocked)
{
  for (size_t i = 0; i < count; i++) {
    const Ray ray = ray_unpack(&rays[i]);
    blocked[i] = accel_any(a, &ray, mask, filter, user, c);
  }
}

#endif
