// Turns: many unrelated rays, walked in turns in one thread. A ray that waits for a node from memory costs nothing
// while the others work, and their steps do not wait for each other's results. Each turn's next node or leaf is
// fetched ahead. Turns at nodes and turns at leaves are kept in separate lists, so that what a step does can be
// foretold (Barringer and Akenine-Moeller, "Dynamic Ray Stream Traversal", 2014, sort likewise by what is next).
//
// A turn's stack holds the upper tree's entries, a sentinel, and above it those of the mesh being visited.

#ifndef RAYFOLD_ACCEL_TURNS_H
#define RAYFOLD_ACCEL_TURNS_H

#include "accel/batch_rays.h"
#include "accel/compact.h"
#include "accel/traverse.h"

enum { MOST_TURNS = 32 }; // of 4, 8, 16 and 32 the best

typedef struct Turn {
  Query query;
  Visit visit; // its ray is that of the tree being walked
  Ray ray;
  TreeRay world, own;
  const Node8 *nodes;      // of the tree being walked
  const MeshTree *compact; // that tree, if it is compact; nodes is then of no use
  const char *items[2];    // nodes and leaves, to fetch ahead
  size_t item_size[2];
  bool is_inside, found; // inside: a mesh's tree
  uint32_t child;        // to look at next
  float near;            // where the ray enters it
  uint32_t ray_i;
  int height;
  int fetched; // of a compact leaf: 1 its corners, 2 its points
  StackEntry stack[2 * STACK_SIZE + 8];
} Turn;

static inline void turn_set_items(Turn *t, const void *nodes, size_t node_size, const void *leaves,
                                  size_t leaf_size)
{
  t->items[0] = nodes;
  t->items[1] = leaves;
  t->item_size[0] = node_size;
  t->item_size[1] = leaf_size;
}

static inline void turn_walk_upper(Turn *t, const Accel *a)
{
  t->nodes = a->nodes;
  t->compact = NULL;
  turn_set_items(t, a->nodes, sizeof *a->nodes, a->instances, sizeof *a->instances);
  t->visit.ray = &t->world;
  t->is_inside = false;
}

static inline void turn_walk_mesh(Turn *t, const MeshTree *m)
{
  t->nodes = m->nodes;
  t->compact = m->layout == TREE_COMPACT ? m : NULL;
  if (t->compact)
    turn_set_items(t, m->compact_nodes, sizeof *m->compact_nodes, m->compact_leaves, sizeof *m->compact_leaves);
  else
    turn_set_items(t, m->nodes, sizeof *m->nodes, m->blocks, sizeof *m->blocks);
  t->is_inside = true;
}

// Takes the next child off the stack. The sentinel is nearer than anything.
static inline void turn_pop(Turn *t)
{
  StackEntry e;
  do e = t->stack[--t->height];
  while (e.near > t->query.best.t);
  t->child = e.child;
  t->near = e.near;
}

static inline void turn_fetch(const Turn *t)
{
  const unsigned is_leaf = t->child >> 31;
  const size_t i = t->child == EMPTY_TREE ? 0 : t->child & ~LEAF_BIT;
  const char *p = t->items[is_leaf] + i * t->item_size[is_leaf];
  if (t->compact) fetch_ahead(p, 2 * 64);
  else fetch_ahead(p, 5 * 64);
}

// Begins with the next ray of the batch that can hit anything; false when there is none.
static inline bool turn_begin(Turn *t, const Batch *b, size_t *next)
{
  const Accel *a = b->accel;
  while (*next < b->count) {
    const size_t i = (*next)++;
    t->ray_i = (uint32_t)i;
    t->ray = ray_unpack(&b->rays[i]);
    t->query = query_of(&t->ray, b->filter, batch_user(b, i), b->counters, b->blocked != NULL);
    const bool is_ray = tree_ray_init(&t->world, t->ray.o, t->ray.d, t->ray.tmin) && t->world.tmin < t->ray.tmax;
    t->found = is_ray && a->endless_count && endless_closest(&t->query, a, &t->world, b->mask);
    if (a->root == EMPTY_TREE || !is_ray || (t->found && b->blocked)) {
      batch_answer(b, i, &t->query.best, t->found);
      continue;
    }
    t->stack[0] = (StackEntry){EMPTY_TREE, -INFINITY};
    t->height = 1;
    t->fetched = 0;
    t->child = a->root;
    t->near = t->world.tmin;
    if (a->root & LEAF_BIT) t->near = tree_ray_box(&t->world, a->boxes[a->root & ~LEAF_BIT], t->query.best.t);
    turn_walk_upper(t, a);
    if (t->near > t->query.best.t) turn_pop(t);
    return true;
  }
  return false;
}

static inline void turn_node(Turn *t, bool is_any)
{
  Node8 space;
  const Node8 *n = t->compact ? mesh_node(t->compact, t->child, &space) : &t->nodes[t->child];
  Near8 near;
  const unsigned bits = node8_hit(n, t->visit.ray, t->query.best.t, &near);
  t->height = push_children(t->stack, t->height, n, bits, &near, is_any);
  turn_pop(t);
}

// A leaf of the upper tree: shapes are done with at once, a mesh's tree is entered.
static inline void turn_instance(Turn *t, const Batch *b)
{
  const uint32_t instance_i = t->child & ~LEAF_BIT;
  const Instance *i = &b->accel->instances[instance_i];
  Visit v = {.instance = i, .instance_i = instance_i, .near = t->near};
  v.ray = i->mask & b->mask ? instance_ray(i, &t->ray, &t->world, &t->own) : NULL;
  if (!v.ray) {
    turn_pop(t);
    return;
  }
  if (i->kind != INSTANCE_MESH) {
    t->found |= shape_closest(&t->query, &v);
    turn_pop(t);
    return;
  }
  t->visit = v;
  t->stack[t->height++] = (StackEntry){EMPTY_TREE, -INFINITY};
  t->child = i->mesh->root;
  turn_walk_mesh(t, i->mesh);
}

// A compact leaf has its vertices two reads away. A turn fetches each ahead, and takes the leaf in its third step.
static inline bool turn_waits(Turn *t)
{
  const uint32_t leaf_i = t->child & ~LEAF_BIT;
  t->fetched = (t->fetched + 1) % 3;
  if (t->fetched == 1) leaf_fetch_corners(t->compact, leaf_i);
  if (t->fetched == 2) leaf_fetch_points(t->compact, leaf_i);
  return t->fetched != 0;
}

// One step at a leaf; true when the ray is done.
static inline bool turn_leaf(Turn *t, const Batch *b, bool is_any)
{
  if (t->child == EMPTY_TREE) {
    if (!t->is_inside) return true;
    turn_walk_upper(t, b->accel);
    turn_pop(t);
    return false;
  }
  if (t->is_inside) {
    if (t->compact && turn_waits(t)) return false;
    Tri8 space;
    const Tri8 *block = mesh_block(t->visit.instance->mesh, t->child & ~LEAF_BIT, &space);
    t->found |= block_closest(&t->query, &t->visit, block);
    if (is_any && t->found) return true;
    turn_pop(t);
    return false;
  }
  turn_instance(t, b);
  return is_any && t->found;
}

// The turns at nodes and at leaves of this round; those of the next are collected while it runs.
typedef struct TurnLists {
  uint8_t at[2][MOST_TURNS];
  int count[2];
} TurnLists;

static inline void turn_list(TurnLists *l, const Turn *t, int turn_i)
{
  const unsigned is_leaf = t->child >> 31;
  turn_fetch(t);
  l->at[0][l->count[0]] = l->at[1][l->count[1]] = (uint8_t)turn_i;
  l->count[0] += !is_leaf;
  l->count[1] += (int)is_leaf;
}

static inline void turns_round(Turn *turns, const Batch *b, bool is_any, size_t *next, const TurnLists *now,
                               TurnLists *then)
{
  then->count[0] = then->count[1] = 0;
  for (int k = 0; k < now->count[0]; k++) {
    Turn *t = &turns[now->at[0][k]];
    turn_node(t, is_any);
    turn_list(then, t, now->at[0][k]);
  }
  for (int k = 0; k < now->count[1]; k++) {
    Turn *t = &turns[now->at[1][k]];
    if (turn_leaf(t, b, is_any)) {
      batch_answer(b, t->ray_i, &t->query.best, t->found);
      if (!turn_begin(t, b, next)) continue;
    }
    turn_list(then, t, now->at[1][k]);
  }
  b->counters->nodes += (uint64_t)now->count[0];
}

// Answers all rays of the batch.
static inline void turns_walk(const Batch *b)
{
  const bool is_any = b->blocked != NULL;
  Turn turns[MOST_TURNS];
  TurnLists lists[2];
  size_t next = 0;
  lists[0].count[0] = lists[0].count[1] = 0;
  for (int i = 0; i < MOST_TURNS && turn_begin(&turns[i], b, &next); i++)
    turn_list(&lists[0], &turns[i], i);
  for (int round = 0; lists[round].count[0] + lists[round].count[1] > 0; round ^= 1)
    turns_round(turns, b, is_any, &next, &lists[round], &lists[round ^ 1]);
}

#endif
