// Step: what a ray does at one node and at one leaf. All walks (one ray, rays in turns, packets) are made of these
// steps, and so give the same answer.
//
// The answer does not depend on the trees. A hit on a primitive counts when the ray passes the primitive's own test,
// its own box and its instance's box; its t is raised to where the ray enters those boxes. Boxes are nested and
// their test is monotone, so whatever a box hides for being missed or farther than the best hit could not have won.
// In a tree of pieces the box of a triangle is cut down to one about the point where it is hit, which its pieces'
// boxes contain (geom/triangle.h). Of equal t the smallest (instance, prim) wins. Hence a tree gives bit for bit what
// testing everything gives (accel/brute.h), at every level, for every shape of tree and every order of walking.

#ifndef RAYFOLD_ACCEL_STEP_H
#define RAYFOLD_ACCEL_STEP_H

#include "accel/tree.h"
#include "geom/disk.h"
#include "geom/quad.h"
#include "geom/sdf_surface.h"
#include "geom/sphere.h"
#include "geom/triangle.h"

// One question on its way through the trees: what is asked, and the best answer yet.
typedef struct Query {
  const Ray *ray; // in the world
  HitFilter *filter;
  const void *user;
  RayCounters *counters;
  Hit best;    // t starts at tmax and instance at NO_HIT
  bool is_any; // the first hit will do
} Query;

// Where a walk stands: one instance, and the ray in its space.
typedef struct Visit {
  const Instance *instance;
  uint32_t instance_i;
  float near;         // where the ray enters the instance's box
  const TreeRay *ray; // the world's own, if the instance's map is the identity
} Visit;

// A child still to be looked at. As one integer it orders by near, which is never negative.
typedef struct StackEntry {
  uint32_t child;
  float near;
} StackEntry;
_Static_assert(sizeof(StackEntry) == 8, "moved and compared as 64 bits");

typedef struct Near8 { // where a ray enters each of eight boxes
  wf t[8 / WIDE];
} Near8;

// Which children's boxes the ray meets within tmax, and where it enters them. Where registers hold both planes of
// eight boxes, the far ones are turned round in sign, so that one maximum does for both.
static inline unsigned node8_hit(const Node8 *n, const TreeRay *r, float tmax, Near8 *near)
{
#if WIDEST == 16
  wx t = wx_join(wf_set(r->tmin), wf_set(-tmax));
  for (int k = 0; k < 3; k++) t = wx_max((wx_lanes(r->order[k], n->box[2 * k]) - r->o[k]) * r->scale[k], t);
  near->t[0] = wx_low(t);
  return wf_le(near->t[0], -wx_high(t));
#else
  unsigned bits = 0;
  for (int g = 0; g < 8; g += WIDE) {
    wf t0 = wf_set(r->tmin), t1 = wf_set(tmax);
    for (int k = 0; k < 3; k++) {
      t0 = wf_max((wf_load(n->box[r->near_row[k]] + g) - r->o[k]) * r->inv[k], t0);
      t1 = wf_min((wf_load(n->box[r->far_row[k]] + g) - r->o[k]) * r->inv_far[k], t1);
    }
    near->t[g / WIDE] = t0;
    bits |= wf_le(t0, t1) << g;
  }
  return bits;
#endif
}

// Puts the children on the stack, the nearest on top. For any hit their order is of no use.
static inline int push_children(StackEntry *stack, int height, const Node8 *n, unsigned bits,
                                const Near8 *near, bool is_any)
{
#if WIDE_SORTS
  return height + wide_push((uint64_t *)(stack + height), n->child, near->t[0], bits, !is_any);
#else
  float t[8];
  const int bottom = height;
  for (int g = 0; g < 8; g += WIDE) wf_store(t + g, near->t[g / WIDE]);
  for (; bits; bits &= bits - 1) {
    const int i = __builtin_ctz(bits);
    const StackEntry e = {n->child[i], t[i]};
    int at = height++;
    for (; !is_any && at > bottom && stack[at - 1].near < e.near; at--) stack[at] = stack[at - 1];
    stack[at] = e;
  }
  return height;
#endif
}

static inline uint64_t stack_key(const Node8 *n, const float *near, int i)
{
  uint32_t bits;
  memcpy(&bits, near + i, sizeof bits);
  return (uint64_t)bits << 32 | n->child[i];
}

// Of two children, puts the farther one on the stack and returns the nearer. Without a sort: half of all nodes that
// are not passed by end here, and what follows waits for the answer.
static inline uint32_t push_farther(StackEntry *stack, int *height, const Node8 *n, unsigned bits,
                                    const Near8 *near)
{
  float t[8];
  for (int g = 0; g < 8; g += WIDE) wf_store(t + g, near->t[g / WIDE]);
  const uint64_t a = stack_key(n, t, __builtin_ctz(bits)), b = stack_key(n, t, 31 - __builtin_clz(bits));
  const uint64_t far = a > b ? a : b, nearer = a > b ? b : a;
  memcpy(&stack[(*height)++], &far, sizeof far);
  return (uint32_t)nearer;
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

// Where the ray enters the box that a hit on the triangle must be in; infinity when it misses that.
static inline float triangle_near(const Visit *v, const Tri8 *b, int i, float e0, float e1, float e2)
{
  return v->instance->mesh->has_pieces ? tri8_point_near(b, i, v->ray, e0, e1, e2)
                                       : tri8_box_near(b, i, v->ray);
}

// One triangle that the ray passes through at t, by its edge functions.
static inline bool take_triangle(Query *q, const Visit *v, const Tri8 *b, int i, float t, float e0, float e1,
                                 float e2)
{
  const float at = max_f(max_f(t, triangle_near(v, b, i, e0, e1, e2)), v->near);
  if (!is_better(&q->best, at, v->instance_i, b->prim[i]) || !tri8_is_ahead(b, i, v->ray)) return false;
  const float det = e0 + e1 + e2;
  const Hit hit = {at, e1 / det, e2 / det, b->prim[i], v->instance_i};
  return take_hit(q, v, &hit);
}

static inline bool block_closest(Query *q, const Visit *v, const Tri8 *b)
{
  Tri8Hits h;
  bool found = false;
  q->counters->prims++;
  for (unsigned bits = tri8_hit(b, v->ray, q->best.t, &h); bits; bits &= bits - 1) {
    const int i = __builtin_ctz(bits);
    found |= take_triangle(q, v, b, i, h.t[i], h.e[0][i], h.e[1][i], h.e[2][i]);
    if (found && q->is_any) return true;
  }
  return found;
}

// What take_crossing needs to know of the instance.
typedef struct CrossingTaker {
  Query *query;
  const Visit *visit;
} CrossingTaker;

// A crossing of a solid's skin or a body's, at t on the ray. False: it is not the best hit.
static inline bool take_crossing(Query *q, const Visit *v, double t, uint32_t prim, const Solid *s, uint32_t part,
                                 const SolidRay *own)
{
  const float at = max_f((float)t, v->near);
  if (!((float)t > v->ray->tmin) || !is_better(&q->best, at, v->instance_i, prim)) return false;
  Hit hit = {at, 0, 0, prim, v->instance_i};
  if (!q->is_any) {
    double p[3];
    solid_point(own, t, p);
    const Vec2 uv = solid_uv(s, part, p);
    hit.u = uv.x;
    hit.v = uv.y;
  }
  return take_hit(q, v, &hit);
}

static inline bool solid_closest(Query *q, const Visit *v)
{
  const Solid *s = v->instance->solid;
  const TreeRay *r = v->ray;
  const SolidRay own = {{r->o[0], r->o[1], r->o[2]}, {r->d[0], r->d[1], r->d[2]}};
  const Crossings c = solid_cross(s, &own);
  for (int i = 0; i < c.count; i++)
    if (take_crossing(q, v, c.at[i].t, c.at[i].part, s, c.at[i].part, &own)) return true;
  return false;
}

static inline bool csg_take(void *user, double t, uint32_t prim)
{
  const CrossingTaker *taker = user;
  const Visit *v = taker->visit;
  const CsgLeaf *leaf = &v->instance->csg->leaves[prim / SOLID_PARTS];
  const SolidRay own = csg_leaf_ray(leaf, v->ray->o, v->ray->d);
  return take_crossing(taker->query, v, t, prim, &leaf->solid, prim % SOLID_PARTS, &own);
}

static inline bool csg_closest(Query *q, const Visit *v)
{
  CrossingTaker taker = {q, v};
  return csg_first(v->instance->csg, v->ray, csg_take, &taker);
}

static inline bool voxels_take(void *user, const VoxelCrossing *c)
{
  const CrossingTaker *taker = user;
  Query *q = taker->query;
  const Visit *v = taker->visit;
  const Voxels *grid = v->instance->voxels->grid;
  const float at = max_f(c->t, v->near);
  Hit hit = {at, 0, 0, voxel_prim(grid, c), v->instance_i};
  if (!(c->t > v->ray->tmin) || !is_better(&q->best, at, hit.instance, hit.prim)) return false;
  const Vec2 uv = q->is_any ? (Vec2){0, 0} : voxel_face_uv(c, v->ray->o, v->ray->d);
  hit.u = uv.x;
  hit.v = uv.y;
  return take_hit(q, v, &hit);
}

static inline bool voxels_closest(Query *q, const Visit *v)
{
  CrossingTaker taker = {q, v};
  return voxel_walk(v->instance->voxels, v->ray->o, v->ray->d, v->ray->tmin, q->best.t, voxels_take, &taker);
}

// A ray's crossing of a field's surface. False: it is not the best hit; *is_over: nor will a later one be.
static inline bool take_sdf(Query *q, const Visit *v, const SdfGroup *g, int lane, bool *is_over)
{
  const Sdf *f = v->instance->sdf;
  const float t = g->high[lane], at = max_f(t, v->near);
  *is_over = !is_better(&q->best, at, v->instance_i, 0);
  if (*is_over || !(t > v->ray->tmin)) return false;
  const float o[3] = {g->o[0][lane], g->o[1][lane], g->o[2][lane]}, d[3] = {g->d[0][lane], g->d[1][lane], g->d[2][lane]};
  const bool asks = !q->is_any || (v->instance->has_filter && q->filter);
  const Hit hit = {at, 0, 0, asks && f->has_ids ? sdf_hit_leaf(f, o, d, t) : 0, v->instance_i};
  return take_hit(q, v, &hit);
}

static inline bool sdf_closest(Query *q, const Visit *v)
{
  const Sdf *f = v->instance->sdf;
  const bool is_any = q->is_any && !v->instance->has_filter;
  SdfGroup g = {0};
  if (!sdf_begin(f, v->ray, q->best.t, &g, 0)) return false;
  for (bool is_over = false; !is_over; sdf_go_on(&g, 0, q->best.t)) {
    q->counters->prims += sdf_march(f, &g, 1, is_any);
    if (!g.crossed) return false;
    if (take_sdf(q, v, &g, 0, &is_over)) return true;
  }
  return false;
}

// Shapes by formula: up to two crossings of spheres, quads and disks, nearest first; solids have loops of their own.
static inline bool shape_closest(Query *q, const Visit *v)
{
  const Instance *s = v->instance;
  float t[2], u = 0, w = 0;
  int count = 0;
  q->counters->prims++;
  switch ((InstanceKind)s->kind) {
  case INSTANCE_SPHERE: count = sphere_hit(s->size[0], v->ray, t) ? 2 : 0; break;
  case INSTANCE_QUAD: count = quad_hit(s->size[0], s->size[1], v->ray, t, &u, &w); break;
  case INSTANCE_DISK: count = disk_hit(s->size[0], v->ray, t, &u, &w); break;
  case INSTANCE_SOLID: return solid_closest(q, v);
  case INSTANCE_CSG: return csg_closest(q, v);
  case INSTANCE_VOXELS: return voxels_closest(q, v);
  case INSTANCE_SDF: return sdf_closest(q, v);
  case INSTANCE_MESH: break;
  }
  for (int i = 0; i < count; i++) {
    const float at = max_f(t[i], v->near);
    if (!(t[i] > v->ray->tmin) || !is_better(&q->best, at, v->instance_i, 0)) continue;
    if (s->kind == INSTANCE_SPHERE) {
      const Vec2 uv = sphere_uv(s->size[0], v3_load(v->ray->o) + t[i] * v3_load(v->ray->d));
      u = uv.x;
      w = uv.y;
    }
    const Hit hit = {at, u, w, 0, v->instance_i};
    if (take_hit(q, v, &hit)) return true;
  }
  return false;
}

// The ray in the instance's space; in *own, unless the map is the identity. NULL: it cannot hit.
static inline const TreeRay *instance_ray(const Instance *i, const Ray *ray, const TreeRay *world,
                                          TreeRay *own)
{
  if (i->is_identity) return world;
  const Vec3 o = frame_point(&i->object_from_world, ray->o), d = frame_vector(&i->object_from_world, ray->d);
  return tree_ray_init(own, o, d, world->tmin) ? own : NULL;
}

// The best hit starts at a finite t, so that boxes a ray never enters, at infinity, are beyond it.
static inline Query query_of(const Ray *ray, HitFilter *filter, const void *user, RayCounters *c, bool is_any)
{
  return (Query){ray, filter, user, c, {.t = min_f(ray->tmax, FLT_MAX), .instance = NO_HIT}, is_any};
}

static inline Ray ray_unpack(const PackedRay *p)
{
  return (Ray){v3_load(p->o), v3_load(p->d), p->tmin, p->tmax};
}

static inline PackedRay ray_pack(const Ray *r)
{
  return (PackedRay){{r->o[0], r->o[1], r->o[2]}, r->tmin, {r->d[0], r->d[1], r->d[2]}, r->tmax};
}

#endif
