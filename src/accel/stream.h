// Stream: up to 64 rays walked through the trees together, each node visited once for all rays that may meet it. A
// stack entry is a child and the set of rays that want to see it, one bit each. What a single walk pays per ray and
// node (order, stack, waiting for memory) is paid here per node. (Tsakok, "Faster incoherent rays: Multi-BVH ray
// stream tracing", 2009; Barringer and Akenine-Moeller, "Dynamic Ray Stream Traversal", 2014.)
//
// At a node, sparse sets are tested one ray against eight boxes; dense sets of coherent rays first all at once by
// intervals (Reshetov, Soupikov, Hurley, "Multi-Level Ray Tracing Algorithm", 2005), then, child by child, one box
// against many rays. Leaves likewise: one ray against eight triangles, or one triangle against many rays.

#ifndef RAYFOLD_ACCEL_STREAM_H
#define RAYFOLD_ACCEL_STREAM_H

#include "accel/batch_rays.h"
#include "accel/compact.h"
#include "accel/rayset.h"
#include "geom/voxel_beam.h"

typedef struct Stream {
  const Batch *batch;
  size_t first; // ray of the batch that is ray 0 here
  uint64_t found;
  bool is_any;
  uint64_t nodes, prims; // tested, by all rays
  uint64_t visits;       // to nodes
  // The best hits so far, in lanes.
  float t[SET_SIZE], u[SET_SIZE], v[SET_SIZE];
  uint32_t prim[SET_SIZE], instance[SET_SIZE];
  float near[SET_SIZE]; // where each ray enters the box of the instance being visited
} Stream;

typedef struct StreamStack {
  int height;
  uint32_t child[STACK_SIZE + 8];
  float near[STACK_SIZE + 8]; // no ray of the set enters the child before
  uint64_t rays[STACK_SIZE + 8];
} StreamStack;

static inline unsigned group_bits(uint64_t set, int g)
{
  return (unsigned)(set >> (g * WIDEST)) & WIDEST_BITS;
}

static inline int group_count(uint64_t set)
{
  int count = 0;
  for (int g = 0; g < SET_GROUPS; g++) count += group_bits(set, g) != 0;
  return count;
}

// --- nodes ------------------------------------------------------------------------------------------

// What a node's test finds out: which children are met, where first, and by whom.
typedef struct Meeting {
  unsigned bits;
  Near8 near;
  uint64_t rays[8];
} Meeting;

static inline Meeting node_meet_sparse(const Stream *s, RaySet *rays, const Node8 *n, uint64_t set)
{
  Meeting m = {0};
#if WIDE_SORTS
  __m512i sets = _mm512_setzero_si512();
  m.near.t[0] = wf_set(INFINITY);
#else
  for (int g = 0; g < 8 / WIDE; g++) m.near.t[g] = wf_set(INFINITY);
#endif
  for (uint64_t left = set; left; left &= left - 1) {
    const int i = __builtin_ctzll(left);
    Near8 near;
    const unsigned bits = node8_hit(n, rayset_ray(rays, i), s->t[i], &near);
    m.bits |= bits;
#if WIDE_SORTS
    sets = _mm512_mask_or_epi64(sets, (__mmask8)bits, sets, _mm512_set1_epi64((long long)(left & -left)));
    m.near.t[0] =
        (wf)_mm256_mask_min_ps((__m256)m.near.t[0], (__mmask8)bits, (__m256)m.near.t[0], (__m256)near.t[0]);
#else
    float met[8], first[8];
    memcpy(met, &near, sizeof met);
    memcpy(first, &m.near, sizeof first);
    for (unsigned b = bits; b; b &= b - 1) {
      const int c = __builtin_ctz(b);
      m.rays[c] |= left & -left;
      first[c] = min_f(met[c], first[c]);
    }
    memcpy(&m.near, first, sizeof first);
#endif
  }
#if WIDE_SORTS
  _mm512_storeu_si512(m.rays, sets);
#endif
  return m;
}

static inline float stream_most_t(const Stream *s, uint64_t set)
{
  wx most = wx_set(0);
  for (int g = 0; g < SET_GROUPS; g++)
    if (group_bits(set, g))
      most = wx_max(wx_choose(group_bits(set, g), wx_load(s->t + g * WIDEST), wx_set(0)), most);
  return wx_most(most);
}

static inline Meeting node_meet_dense(const Stream *s, const RaySet *rays, const Node8 *n, uint64_t set)
{
  Meeting m = {0};
  unsigned left = rayset_node(rays, n, stream_most_t(s, set), &m.near);
  bool has_leaf = false;
  for (unsigned l = left; l; l &= l - 1) has_leaf |= n->child[__builtin_ctz(l)] >> 31;
  if (rays->is_pencil && !has_leaf) {
    m.bits = left;
    for (int c = 0; c < 8; c++) m.rays[c] = set;
    return m;
  }
  for (; left; left &= left - 1) {
    const int c = __builtin_ctz(left);
    const float box[6] = {n->box[0][c], n->box[1][c], n->box[2][c], n->box[3][c], n->box[4][c], n->box[5][c]};
    uint64_t met = 0;
    for (int g = 0; g < SET_GROUPS; g++) {
      const unsigned asked = group_bits(set, g);
      wx near;
      if (asked)
        met |= (uint64_t)(rayset_box(rays, g, box, wx_load(s->t + g * WIDEST), &near) & asked) << g * WIDEST;
    }
    m.rays[c] = met;
    m.bits |= (unsigned)(met != 0) << c;
  }
  return m;
}

// Puts the children that are met on the stack, the nearest on top.
static inline void stream_push(StreamStack *stack, const Node8 *n, const Meeting *m, bool is_any)
{
#if WIDE_SORTS
  static const uint32_t lanes[8] = {0, 1, 2, 3, 4, 5, 6, 7};
  uint64_t keys[8];
  const int count = wide_push(keys, lanes, m->near.t[0], m->bits, !is_any);
#else
  StackEntry keys[8];
  Node8 by_lane;
  for (uint32_t i = 0; i < 8; i++) by_lane.child[i] = i;
  const int count = push_children(keys, 0, &by_lane, m->bits, &m->near, is_any);
#endif
  for (int i = 0; i < count; i++) {
    uint64_t key;
    memcpy(&key, &keys[i], sizeof key);
    const int c = (int)(key & 7), at = stack->height++;
    const uint32_t near = (uint32_t)(key >> 32);
    memcpy(&stack->near[at], &near, sizeof near);
    stack->child[at] = n->child[c];
    stack->rays[at] = m->rays[c];
  }
}

// --- leaves -----------------------------------------------------------------------------------------

static inline Hit stream_best(const Stream *s, int i)
{
  return (Hit){s->t[i], s->u[i], s->v[i], s->prim[i], s->instance[i]};
}

static inline void stream_take(Stream *s, int i, const Hit *h)
{
  s->t[i] = h->t;
  s->u[i] = h->u;
  s->v[i] = h->v;
  s->prim[i] = h->prim;
  s->instance[i] = h->instance;
  s->found |= 1ull << i;
}

// The question of one ray by itself. *ray is filled in.
static inline Query stream_query(const Stream *s, int i, RayCounters *unused, Ray *ray)
{
  const Batch *b = s->batch;
  *ray = ray_unpack(&b->rays[s->first + (size_t)i]);
  return (Query){ray, b->filter, batch_user(b, s->first + (size_t)i), unused, stream_best(s, i), s->is_any};
}

// One ray, eight triangles.
static inline void stream_block_sparse(Stream *s, RaySet *rays, const Visit *v, const Tri8 *b, int i)
{
  Tri8Hits h;
  Visit own = *v;
  own.ray = rayset_ray(rays, i);
  own.near = s->near[i];
  unsigned bits = tri8_hit(b, own.ray, s->t[i], &h);
  if (!bits) return;
  RayCounters unused;
  Ray ray;
  Query q = stream_query(s, i, &unused, &ray);
  bool found = false;
  for (; bits && !(found && s->is_any); bits &= bits - 1) {
    const int k = __builtin_ctz(bits);
    found |= take_triangle(&q, &own, b, k, h.t[k], h.e[0][k], h.e[1][k], h.e[2][k]);
  }
  if (found) stream_take(s, i, &q.best);
}

// Lanes whose rays hit at the same t as their best hit, and by number come first.
static inline unsigned lanes_tied(const Stream *s, int at, unsigned equal, uint32_t instance, uint32_t prim)
{
  unsigned better = 0;
  for (; equal; equal &= equal - 1) {
    const int i = __builtin_ctz(equal);
    const Hit best = stream_best(s, at + i);
    better |= (unsigned)is_better(&best, best.t, instance, prim) << i;
  }
  return better;
}

// Lanes of triangle i's hits that are ahead of their rays' origins, as tri8_is_ahead has it.
static inline unsigned lanes_ahead(RaySet *rays, int g, const Tri8 *b, int i, const LaneHits *h,
                                   unsigned bits)
{
  const int at = g * WIDEST;
  const wx sz = wx_load(rays->sz + at);
  const wx first = wx_min(h->z[2] * sz, wx_min(h->z[1] * sz, h->z[0] * sz));
  unsigned ahead = wx_lt(wx_load(rays->tmin + at) * AHEAD_SLACK, first) & bits;
  for (unsigned left = bits & ~ahead; left; left &= left - 1) {
    const int k = __builtin_ctz(left);
    ahead |= (unsigned)tri8_is_ahead(b, i, rayset_ray(rays, at + k)) << k;
  }
  return ahead;
}

static inline unsigned lanes_filtered(Stream *s, const Visit *v, int at, unsigned bits,
                                      const Hit hits[WIDEST])
{
  const Batch *b = s->batch;
  if (!v->instance->has_filter || !b->filter) return bits;
  unsigned pass = 0;
  for (; bits; bits &= bits - 1) {
    const int k = __builtin_ctz(bits);
    const size_t ray_i = s->first + (size_t)(at + k);
    const Ray ray = ray_unpack(&b->rays[ray_i]);
    pass |= (unsigned)b->filter(batch_user(b, ray_i), &ray, &hits[k]) << k;
  }
  return pass;
}

// One triangle, many rays: what take_triangle does, in lanes.
static inline void stream_triangle(Stream *s, RaySet *rays, const Visit *v, const Tri8 *b,
                                   const SeenBlock *seen, int i, int g, unsigned asked)
{
  const int at = g * WIDEST;
  const wx best = wx_load(s->t + at);
  LaneHits h;
  unsigned bits = rayset_triangle(rays, g, seen, i, best, &h) & asked;
  if (!bits) return;
  wx near;
  float box[6];
  tri8_box(b, i, box);
  bits &= rayset_box(rays, g, box, wx_set(FLT_MAX), &near);
  if (v->instance->mesh->has_pieces && bits) bits = rayset_point(rays, g, b, i, &h, bits, &near);
  const wx t = wx_max(wx_max(h.t, near), wx_load(s->near + at));
  const unsigned equal = wx_eq(t, best) & bits;
  bits &= wx_lt(t, best);
  if (__builtin_expect(equal != 0, 0)) bits |= lanes_tied(s, at, equal, v->instance_i, b->prim[i]);
  bits = lanes_ahead(rays, g, b, i, &h, bits);
  if (!bits) return;
  const wx det = h.e[0] + h.e[1] + h.e[2], hit_u = h.e[1] / det, hit_v = h.e[2] / det;
  if (__builtin_expect(v->instance->has_filter, 0)) {
    Hit hits[WIDEST];
    float lanes[3][WIDEST];
    wx_store(lanes[0], t);
    wx_store(lanes[1], hit_u);
    wx_store(lanes[2], hit_v);
    for (int k = 0; k < WIDEST; k++)
      hits[k] = (Hit){lanes[0][k], lanes[1][k], lanes[2][k], b->prim[i], v->instance_i};
    bits = lanes_filtered(s, v, at, bits, hits);
  }
  wx_put(s->t + at, bits, t);
  wx_put(s->u + at, bits, hit_u);
  wx_put(s->v + at, bits, hit_v);
  wx_put_int(s->prim + at, bits, b->prim[i]);
  wx_put_int(s->instance + at, bits, v->instance_i);
  s->found |= (uint64_t)bits << at;
}

static inline void stream_block_dense(Stream *s, RaySet *rays, const Visit *v, const Tri8 *b, uint64_t set)
{
  SeenBlock seen;
  rayset_see(rays, b, &seen);
  unsigned left = rays->is_pencil ? rayset_block(rays, &seen, stream_most_t(s, set)) : 0xff;
  for (; left; left &= left - 1) {
    const int i = __builtin_ctz(left);
    if (b->prim[i] == NO_HIT) return;
    for (int g = 0; g < SET_GROUPS; g++) {
      const unsigned asked = group_bits(set, g);
      if (asked) stream_triangle(s, rays, v, b, &seen, i, g, asked);
    }
    if (s->is_any && !(set &= ~s->found)) return;
  }
}

static inline void stream_block(Stream *s, RaySet *rays, const Visit *v, const Tri8 *b, uint64_t set)
{
  s->prims += (uint64_t)__builtin_popcountll(set);
  if (rays->is_coherent && __builtin_popcountll(set) >= 4 * group_count(set)) {
    stream_block_dense(s, rays, v, b, set);
    return;
  }
  for (uint64_t left = set; left; left &= left - 1) stream_block_sparse(s, rays, v, b, __builtin_ctzll(left));
}

// --- the walk ---------------------------------------------------------------------------------------

static inline void stream_node(Stream *s, RaySet *rays, const Node8 *n, uint64_t set, StreamStack *stack)
{
  const int count = __builtin_popcountll(set);
  const bool is_dense = rays->is_coherent && count >= 2 + 2 * group_count(set);
  const Meeting m = is_dense ? node_meet_dense(s, rays, n, set) : node_meet_sparse(s, rays, n, set);
  s->visits++;
  s->nodes += (uint64_t)count;
  stream_push(stack, n, &m, s->is_any);
}

static inline void stream_begin(StreamStack *stack, uint32_t root, uint64_t set)
{
  stack->height = 1;
  stack->child[0] = root;
  stack->near[0] = 0;
  stack->rays[0] = set;
}

// Takes the next child off the stack, and the rays that still want to see it; false when there is none.
static inline bool stream_pop(const Stream *s, StreamStack *stack, uint32_t *child, uint64_t *set)
{
  while (stack->height > 0) {
    *child = stack->child[--stack->height];
    *set = stack->rays[stack->height];
    if (s->is_any) *set &= ~s->found;
    const bool is_one = !(*set & (*set - 1));
    if (!is_one || (*set && !(stack->near[stack->height] > s->t[__builtin_ctzll(*set)]))) return true;
  }
  return false;
}

static inline void mesh_fetch(const MeshTree *m, uint32_t child)
{
  const size_t i = child & ~LEAF_BIT;
  const bool is_leaf = child & LEAF_BIT;
  if (m->layout == TREE_FLOAT)
    is_leaf ? fetch_ahead(&m->blocks[i], sizeof(Tri8)) : fetch_ahead(&m->nodes[i], sizeof(Node8));
  else
    is_leaf ? fetch_ahead(&m->compact_leaves[i], sizeof(CompactLeaf))
            : fetch_ahead(&m->compact_nodes[i], sizeof(CompactNode));
}

// Leaves that come next: the nearest has its corners by now, that after it itself.
static inline void stream_fetch_leaves(const MeshTree *m, const StreamStack *stack)
{
  const int at = stack->height;
  if (at > 1 && stack->child[at - 2] & LEAF_BIT) leaf_fetch_corners(m, stack->child[at - 2] & ~LEAF_BIT);
  if (at > 0 && stack->child[at - 1] & LEAF_BIT) leaf_fetch_points(m, stack->child[at - 1] & ~LEAF_BIT);
}

static inline void stream_mesh(Stream *s, const Visit *v, RaySet *rays, uint64_t set)
{
  const MeshTree *m = v->instance->mesh;
  StreamStack stack;
  Node8 node;
  Tri8 block;
  uint32_t child;
  stream_begin(&stack, m->root, set);
  while (stream_pop(s, &stack, &child, &set)) {
    if (child & LEAF_BIT) {
      if (m->layout == TREE_COMPACT) stream_fetch_leaves(m, &stack);
      stream_block(s, rays, v, mesh_block(m, child & ~LEAF_BIT, &block), set);
      continue;
    }
    const int bottom = stack.height;
    stream_node(s, rays, mesh_node(m, child, &node), set, &stack);
    for (int i = stack.height - 1; i >= bottom; i--) mesh_fetch(m, stack.child[i]);
  }
}

// The rays of the set in the grid's space, in its lanes; those among them that are rays there.
static inline uint64_t voxel_rays_place(const Stream *s, const RaySet *world, const Instance *in, uint64_t set, VoxelRays *out)
{
  uint64_t ready = 0;
  for (uint64_t left = set; left; left &= left - 1) {
    const int i = __builtin_ctzll(left);
    const PackedRay *r = &s->batch->rays[s->first + (size_t)i];
    Vec3 o = v3_load(r->o), d = v3_load(r->d);
    TreeRay placed;
    if (!in->is_identity) o = frame_point(&in->object_from_world, o), d = frame_vector(&in->object_from_world, d);
    if (tree_ray_place(&placed, o, d, world->tmin[i])) ready |= left & -left;
    for (int k = 0; k < 3; k++) {
      out->o[k][i] = placed.o[k];
      out->d[k][i] = placed.d[k];
    }
    out->from[i] = placed.tmin;
  }
  return ready;
}

// Rays that go alike skip together what is empty before them. False: there is nothing else.
static inline bool stream_voxel_beam(const Voxels *grid, VoxelRays *rays, uint64_t set)
{
  enum { BEAM_LEAST = 8 }; // rays
  int32_t plane;
  if (__builtin_popcountll(set) < BEAM_LEAST) return true;
  const VoxelBeam beam = voxel_beam(rays, set);
  if (!beam.is_one) return true;
  if (!voxel_beam_start(grid, &beam, &plane)) return false;
  for (uint64_t left = set; left; left &= left - 1) {
    const int i = __builtin_ctzll(left);
    const float from = ((float)plane - rays->o[beam.axis][i]) * (1 / rays->d[beam.axis][i]);
    if (!(from > rays->from[i])) continue;
    rays->from[i] = from;
    rays->is_clear |= left & -left;
  }
  return true;
}

// All that a ray meets, one by one.
static inline void stream_voxel(Stream *s, const Visit *v, const RaySet *world, const VoxelRays *rays, int i)
{
  RayCounters unused = {0};
  Ray ray;
  TreeRay placed;
  Query q = stream_query(s, i, &unused, &ray);
  Visit own = *v;
  for (int k = 0; k < 3; k++) {
    placed.o[k] = rays->o[k][i];
    placed.d[k] = rays->d[k][i];
  }
  placed.tmin = max_f(world->tmin[i], 0);
  own.ray = &placed;
  own.near = s->near[i];
  if (voxels_closest(&q, &own)) stream_take(s, i, &q.best);
}

// A group's first crossings that are better hits than their rays have: what voxels_take() does, in lanes. Rays that it
// does not decide about are left: those which begin in a filled cell, and ties.
static inline uint64_t stream_voxel_hits(Stream *s, const Visit *v, const VoxelRays *rays, int g)
{
  const int at = g * WIDEST;
  const unsigned met = group_bits(rays->met, g);
  const wx t = wx_max(wx_load(rays->t + at), wx_load(s->near + at)), best = wx_load(s->t + at);
  const unsigned hits = wx_lt(t, best) & met;
  wx hit_u = wx_set(0), hit_v = hit_u;
  if (!s->is_any) voxel_rays_uv(rays, g, &hit_u, &hit_v);
  wx_put(s->t + at, hits, t);
  wx_put(s->u + at, hits, hit_u);
  wx_put(s->v + at, hits, hit_v);
  wx_put_int(s->instance + at, hits, v->instance_i);
  s->found |= (uint64_t)hits << at;
  for (unsigned left = s->is_any ? 0 : hits; left; left &= left - 1) {
    const int i = at + __builtin_ctz(left);
    const VoxelCrossing c = voxel_rays_crossing(rays, i);
    s->prim[i] = voxel_prim(v->instance->voxels->grid, &c);
  }
  return (uint64_t)(wx_eq(t, best) & met) << at;
}

static inline void stream_voxels(Stream *s, RaySet *world, const Visit *v, uint64_t set)
{
  VoxelRays rays;
  const Voxels *grid = v->instance->voxels->grid;
  voxel_rays_begin(&rays);
  s->visits++; // one for all
  s->nodes += (uint64_t)__builtin_popcountll(set);
  s->prims += (uint64_t)__builtin_popcountll(set);
  set = voxel_rays_place(s, world, v->instance, set, &rays);
  if (!set || !stream_voxel_beam(grid, &rays, set)) return;
  for (int g = 0; g < SET_GROUPS; g++) {
    const unsigned asked = group_bits(set, g);
    if (asked) voxel_rays_walk(grid, &rays, g, s->t + g * WIDEST, asked);
  }
  uint64_t rest = rays.unknown;
  if (v->instance->has_filter && s->batch->filter) rest |= rays.met;
  else
    for (int g = 0; g < SET_GROUPS; g++)
      if (group_bits(rays.met, g)) rest |= stream_voxel_hits(s, v, &rays, g);
  for (; rest; rest &= rest - 1) stream_voxel(s, v, world, &rays, __builtin_ctzll(rest));
}

static inline void stream_shape(Stream *s, RaySet *world, const Visit *v, uint64_t set)
{
  const Instance *in = v->instance;
  for (uint64_t left = set; left; left &= left - 1) {
    const int i = __builtin_ctzll(left);
    RayCounters unused = {0};
    Ray ray;
    TreeRay placed;
    Query q = stream_query(s, i, &unused, &ray);
    Visit own = *v;
    own.ray = &placed;
    own.near = s->near[i];
    if (in->kind == INSTANCE_CSG)
      own.ray = rayset_ray(world, i); // it lies in the world and asks for boxes
    else if (in->is_identity ? !tree_ray_place(&placed, ray.o, ray.d, world->tmin[i])
                             : !tree_ray_place(&placed, frame_point(&in->object_from_world, ray.o),
                                               frame_vector(&in->object_from_world, ray.d), world->tmin[i]))
      continue;
    if (shape_closest(&q, &own)) stream_take(s, i, &q.best);
  }
  s->prims += (uint64_t)__builtin_popcountll(set);
}

// Rays side by side in a field, and which of the set they are.
typedef struct StreamSdf {
  SdfGroup groups[SDF_GROUPS];
  uint8_t rays[SDF_RAYS];
  int count;
} StreamSdf;

// Those of the set that come into the field's box.
static inline void stream_sdf_begin(const Stream *s, const RaySet *world, const Instance *in, uint64_t set, StreamSdf *out)
{
  out->count = 0;
  for (; set; set &= set - 1) {
    const int i = __builtin_ctzll(set), lane = out->count % WIDEST;
    const PackedRay *r = &s->batch->rays[s->first + (size_t)i];
    const Vec3 o = in->is_identity ? v3_load(r->o) : frame_point(&in->object_from_world, v3_load(r->o));
    const Vec3 d = in->is_identity ? v3_load(r->d) : frame_vector(&in->object_from_world, v3_load(r->d));
    TreeRay own;
    SdfGroup *g = &out->groups[out->count / WIDEST];
    if (lane == 0) memset(g, 0, sizeof *g);
    if (!tree_ray_place(&own, o, d, world->tmin[i]) || !sdf_begin(in->sdf, &own, s->t[i], g, lane)) continue;
    out->rays[out->count++] = (uint8_t)i;
  }
}

// A crossing; false: a later one may do.
static inline bool stream_sdf_take(Stream *s, const RaySet *world, const Visit *v, int i, const SdfGroup *g, int lane)
{
  RayCounters unused = {0};
  Ray ray;
  bool is_over;
  Query q = stream_query(s, i, &unused, &ray);
  const TreeRay own = {.tmin = world->tmin[i]}; // all that is looked at
  const Visit at = {v->instance, v->instance_i, s->near[i], &own};
  if (!take_sdf(&q, &at, g, lane, &is_over)) return is_over;
  stream_take(s, i, &q.best);
  return true;
}

// All rays of the set through a field together.
static SDF_LARGE void stream_sdf(Stream *s, const RaySet *world, const Visit *v, uint64_t set)
{
  const Instance *in = v->instance;
  const bool is_any = s->is_any && !in->has_filter;
  StreamSdf many;
  stream_sdf_begin(s, world, in, set, &many);
  const int count = (many.count + WIDEST - 1) / WIDEST;
  for (bool goes_on = many.count > 0; goes_on;) {
    goes_on = false;
    s->prims += sdf_march(in->sdf, many.groups, count, is_any);
    for (int k = 0; k < count; k++) {
      SdfGroup *g = &many.groups[k];
      for (unsigned left = g->crossed; left; left &= left - 1) {
        const int lane = __builtin_ctz(left), i = many.rays[k * WIDEST + lane];
        if (!stream_sdf_take(s, world, v, i, g, lane)) sdf_go_on(g, lane, s->t[i]);
      }
      g->crossed = 0;
      goes_on |= g->going != 0;
    }
  }
}

// The rays brought into the instance's space, in the lanes they have; lanes in between are copies.
static inline uint64_t stream_transform(const Stream *s, const Instance *i, uint64_t set, const RaySet *world,
                                        RaySet *own)
{
  const int first = __builtin_ctzll(set), end = 64 - __builtin_clzll(set);
  for (int k = 0; k < end; k++) {
    const int from = set >> k & 1 ? k : first;
    const PackedRay *r = &s->batch->rays[s->first + (size_t)from];
    rayset_put(own, k, frame_point(&i->object_from_world, v3_load(r->o)),
               frame_vector(&i->object_from_world, v3_load(r->d)), world->tmin[from]);
  }
  return set & rayset_ready(own, end);
}

// The rays of the set that enter the instance's box before their best hit, and where they do.
static inline uint64_t stream_enter(Stream *s, RaySet *world, const float box[6], uint64_t set)
{
  for (int g = 0; g < SET_GROUPS; g++) {
    const unsigned asked = group_bits(set, g);
    wx near;
    if (!asked) continue;
    const unsigned met = rayset_any_box(world, g, box, wx_load(s->t + g * WIDEST), &near) & asked;
    wx_store(s->near + g * WIDEST, near);
    set &= ~((uint64_t)(asked & ~met) << g * WIDEST);
  }
  return set;
}

static inline void stream_instance(Stream *s, uint32_t instance_i, RaySet *world, RaySet *own, uint64_t set)
{
  const Accel *a = s->batch->accel;
  const Instance *i = &a->instances[instance_i];
  const Visit v = {.instance = i, .instance_i = instance_i};
  RaySet *rays = world;
  if (!(i->mask & s->batch->mask)) return;
  if (i->kind != INSTANCE_MESH) {
    set = stream_enter(s, world, a->boxes[instance_i], set);
    if (i->kind == INSTANCE_VOXELS) stream_voxels(s, world, &v, set);
    else if (i->kind == INSTANCE_SDF) stream_sdf(s, world, &v, set);
    else stream_shape(s, world, &v, set);
    return;
  }
  if (!i->is_identity) { // a mesh in place has no box nearer than its triangles' own
    set = stream_enter(s, world, a->boxes[instance_i], set);
    if (set && !i->is_identity) set = stream_transform(s, i, set, world, rays = own);
    if (!set) return;
  } else {
    memset(s->near, 0, sizeof s->near);
  }
  stream_mesh(s, &v, rays, set);
}

static inline void stream_world(Stream *s, RaySet *world, uint64_t set)
{
  const Accel *a = s->batch->accel;
  StreamStack stack;
  RaySet own;
  uint32_t child;
  for (size_t i = 0; i < a->endless_count; i++) {
    if (s->is_any) set &= ~s->found;
    if (set) stream_instance(s, a->endless[i], world, &own, set);
  }
  stream_begin(&stack, a->root, set);
  if (a->root == EMPTY_TREE) return;
  while (stream_pop(s, &stack, &child, &set)) {
    if (child & LEAF_BIT)
      stream_instance(s, child & ~LEAF_BIT, world, &own, set);
    else
      stream_node(s, world, &a->nodes[child], set, &stack);
  }
}

// What comes after this stream is read and written soon.
static inline void stream_fetch_next(const Batch *b, size_t next)
{
  if (next + SET_SIZE > b->count) return;
  fetch_ahead(b->rays + next, SET_SIZE * sizeof *b->rays);
  if (b->hits) fetch_ahead(b->hits + next, SET_SIZE * sizeof *b->hits);
}

// Answers up to 64 rays of the batch. Returns how many rays shared a visit to a node on average.
static inline float stream_run(const Batch *b, size_t first, int count)
{
  Stream s;
  RaySet world;
  uint64_t set = 0;
  s.batch = b;
  s.first = first;
  s.found = 0;
  s.is_any = b->blocked != NULL;
  s.nodes = s.prims = s.visits = 0;
  stream_fetch_next(b, first + SET_SIZE);
  rayset_load(&world, b->rays + first, count);
  for (int g = 0; g < SET_GROUPS; g++) {
    const int at = g * WIDEST;
    const wx tmax = wx_load(world.tmax + at);
    wx_store(s.t + at, wx_min(tmax, wx_set(FLT_MAX)));
    wx_put_int(s.instance + at, WIDEST_BITS, NO_HIT);
    set |= (uint64_t)wx_lt(wx_max(wx_load(world.tmin + at), wx_set(0)), tmax) << at;
  }
  set &= rayset_ready(&world, count);
  stream_world(&s, &world, set);
  b->counters->nodes += s.nodes;
  b->counters->prims += s.prims;
  for (int i = 0; i < count; i++) {
    const Hit best = stream_best(&s, i);
    batch_answer(b, first + (size_t)i, &best, s.found >> i & 1);
  }
  return (float)s.nodes / (float)(s.visits + 1);
}

#endif
