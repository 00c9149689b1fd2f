// Traverse: the nearest hit of one ray, or whether there is any. Two levels: the tree of instances in the world, and
// below it each mesh's tree in object space, where the ray's direction is not brought back to length one, so that t
// means the same everywhere. accel/batch.h does the same for many rays at once, and faster.
//
// Hot: nothing is checked. A ray that is not finite (tmax may be infinite), has no direction, or one longer than
// MOST_DIRECTION, hits nothing.

#ifndef RAYFOLD_ACCEL_TRAVERSE_H
#define RAYFOLD_ACCEL_TRAVERSE_H

#include "accel/compact.h"
#include "accel/step.h"

// The nearest child on the stack that is not beyond tmax; false when there is none.
static inline bool pop_child(const StackEntry *stack, int *height, float tmax, uint32_t *child)
{
  while (*height > 0) {
    const StackEntry e = stack[--*height];
    *child = e.child;
    if (!(e.near > tmax)) return true;
  }
  return false;
}

static inline bool mesh_closest(Query *q, const Visit *v)
{
  const MeshTree *m = v->instance->mesh;
  StackEntry stack[STACK_SIZE + 8];
  Node8 node;
  Tri8 block;
  int height = 0;
  bool found = false;
  uint32_t child = m->root;
  for (;;) {
    // Down to a leaf, always to the nearest child; one that is alone need not go over the stack.
    while (!(child & LEAF_BIT)) {
      const Node8 *n = mesh_node(m, child, &node);
      Near8 near;
      q->counters->nodes++;
      const unsigned bits = node8_hit(n, v->ray, q->best.t, &near);
      if (bits && !(bits & (bits - 1))) {
        child = n->child[__builtin_ctz(bits)];
        continue;
      }
      const unsigned rest = bits & (bits - 1);
      if (rest && !(rest & (rest - 1))) {
        child = push_farther(stack, &height, n, bits, &near);
        continue;
      }
      height = push_children(stack, height, n, bits, &near, q->is_any);
      if (!pop_child(stack, &height, q->best.t, &child)) return found;
    }
    found |= block_closest(q, v, mesh_block(m, child & ~LEAF_BIT, &block));
    if (found && q->is_any) return true;
    if (!pop_child(stack, &height, q->best.t, &child)) return found;
  }
}

// The instance's primitives, by the ray brought into its space.
static inline bool instance_closest(Query *q, const Accel *a, uint32_t instance_i, const TreeRay *world,
                                    float near, RayMask mask)
{
  TreeRay own;
  Visit v = {.instance = &a->instances[instance_i], .instance_i = instance_i, .near = near};
  if (!(v.instance->mask & mask)) return false;
  v.ray = instance_ray(v.instance, q->ray, world, &own);
  if (!v.ray) return false;
  return v.instance->kind == INSTANCE_MESH ? mesh_closest(q, &v) : shape_closest(q, &v);
}

// The instances that have no ends; first, so that what they hide is not walked for.
static inline bool endless_closest(Query *q, const Accel *a, const TreeRay *world, RayMask mask)
{
  bool found = false;
  for (size_t i = 0; i < a->endless_count && !(found && q->is_any); i++)
    found |= instance_closest(q, a, a->endless[i], world, world->tmin, mask);
  return found;
}

// Walks the upper tree. True when something was hit: q->best.
static inline bool accel_walk(const Accel *a, RayMask mask, Query *q)
{
  TreeRay r;
  if (!tree_ray_init(&r, q->ray->o, q->ray->d, q->ray->tmin) || !(r.tmin < q->ray->tmax)) return false;
  StackEntry stack[STACK_SIZE + 8];
  int height = 0;
  bool found = a->endless_count && endless_closest(q, a, &r, mask);
  if (a->root == EMPTY_TREE || (found && q->is_any)) return found;
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
    Near8 near;
    q->counters->nodes++;
    const unsigned bits = node8_hit(n, &r, q->best.t, &near);
    height = push_children(stack, height, n, bits, &near, q->is_any);
  }
  return found;
}

// The nearest hit with tmin < t < tmax on instances that see the mask; filter may be NULL, counters may not. *hit is
// always set: instance is NO_HIT and t is tmax when there is none.
static inline bool accel_closest(const Accel *a, const Ray *ray, RayMask mask, HitFilter *filter,
                                 const void *user, RayCounters *c, Hit *hit)
{
  Query q = query_of(ray, filter, user, c, false);
  const bool found = accel_walk(a, mask, &q);
  *hit = q.best;
  if (!found) hit->t = ray->tmax;
  return found;
}

// Whether there is any hit that accel_closest would count.
static inline bool accel_any(const Accel *a, const Ray *ray, RayMask mask, HitFilter *filter,
                             const void *user, RayCounters *c)
{
  Query q = query_of(ray, filter, user, c, true);
  return accel_walk(a, mask, &q);
}

#endif
