// Refitting: see refit.h. The new tree has the old one's nodes and blocks, number by number; only vertices, boxes and
// costs are new, found from below in one walk. Subtrees are walked side by side, then what is above them.
//
// A triangle that loses its area keeps its lane, so that it is there when it comes back.

#include "accel/refit.h"

#include <string.h>

enum { SUBTREES = 512 }; // at least so many items for threads, if there are; measured with 2 threads

// --- blocks and boxes -----------------------------------------------------------------------------

static Bounds lane_box(const Node8 *n, int lane)
{
  return (Bounds){v3(n->box[0][lane], n->box[2][lane], n->box[4][lane]),
                  v3(n->box[1][lane], n->box[3][lane], n->box[5][lane])};
}

static void set_lane_box(Node8 *n, int lane, const Bounds *box)
{
  for (int k = 0; k < 3; k++) {
    n->box[2 * k][lane] = box->lo[k];
    n->box[2 * k + 1][lane] = box->hi[k];
  }
}

static Bounds refit_block(Refit *r, uint32_t block_i)
{
  uint32_t prim[8];
  memcpy(prim, r->old->blocks[block_i].prim, sizeof prim);
  for (uint32_t lane = 0; lane < 8; lane++) {
    if (prim[lane] == NO_HIT) continue;
    if (prim[lane] >= r->mesh.triangle_count) {
      atomic_store_explicit(&r->is_foreign, true, memory_order_relaxed);
      prim[lane] = NO_HIT;
      continue;
    }
    // A triangle may have lanes in several blocks, and so be found by two threads at once.
    atomic_store_explicit(&r->is_found[prim[lane]], 1, memory_order_relaxed);
  }
  return block_fill(&r->tree->blocks[block_i], &r->mesh, prim);
}

// --- one node -------------------------------------------------------------------------------------

// What a ray that enters pays, as a multiple of one test. An area of 0 is met by no ray.
static double cost_ratio(double cost, double area) { return area > 0 ? cost / area : 1; }

// What it paid when its part was built.
static float built_ratio(const Node8 *old, const NodeState *s, double old_area)
{
  return old->cost > 0 ? old->cost : (float)cost_ratio(s->built_cost, old_area);
}

static void judge(const Refit *r, Node8 *n, NodeState *s)
{
  const double mended = (double)n->cost * s->area;
  s->is_worn = s->cost > (double)r->most_wear * mended;
  s->has_worn |= s->is_worn;
  if (s->is_worn) s->cost = mended;
}

// Everything below it is done.
static void refit_node(Refit *r, uint32_t node_i)
{
  const Node8 *old = &r->old->nodes[node_i];
  Node8 *n = &r->tree->nodes[node_i];
  NodeState s = {.box = bounds_empty()};
  Bounds old_box = bounds_empty();
  *n = *old;
  for (int lane = 0; lane < 8; lane++) {
    const uint32_t code = old->child[lane];
    if (code == EMPTY_TREE) continue;
    const Bounds before = lane_box(old, lane);
    const bool is_leaf = code & LEAF_BIT;
    const NodeState *child = is_leaf ? NULL : &r->states[code];
    const Bounds box = is_leaf ? refit_block(r, code & ~LEAF_BIT) : child->box;
    set_lane_box(n, lane, &box);
    bounds_add(&s.box, &box);
    bounds_add(&old_box, &before);
    s.cost += is_leaf ? bounds_half_area(&box) : child->cost;
    s.built_cost += is_leaf ? bounds_half_area(&before) : child->built_cost;
    s.lanes += is_leaf ? old->count[lane] : child->lanes;
    s.has_worn |= !is_leaf && child->has_worn;
  }
  const double old_area = bounds_half_area(&old_box);
  s.area = bounds_half_area(&s.box);
  s.cost += s.area;
  s.built_cost += old_area;
  n->cost = built_ratio(old, &s, old_area);
  judge(r, n, &s);
  r->states[node_i] = s;
}

// --- all of them ----------------------------------------------------------------------------------

// As deep as the tree, so at most MOST_DEPTH.
static void refit_subtree(Refit *r, uint32_t node_i)
{
  for (int lane = 0; lane < 8; lane++) {
    const uint32_t code = r->old->nodes[node_i].child[lane];
    if (!(code & LEAF_BIT)) refit_subtree(r, code);
  }
  refit_node(r, node_i);
}

// The nodes from the root down, level by level: first those above, then the roots of what one item does.
typedef struct Cut {
  Refit *refit;
  ARRAY(uint32_t) nodes;
  size_t above;
} Cut;

static bool cut_subtrees(Cut *c)
{
  const MeshTree *t = c->refit->old;
  if (!array_push(&c->nodes, t->root)) return false;
  while (c->above < c->nodes.count && c->nodes.count - c->above < SUBTREES) {
    const Node8 *n = &t->nodes[c->nodes.items[c->above++]];
    for (int lane = 0; lane < 8; lane++) {
      if (!(n->child[lane] & LEAF_BIT) && !array_push(&c->nodes, n->child[lane])) return false;
    }
  }
  return true;
}

static void subtree_work(void *user, size_t item, int worker)
{
  (void)worker;
  const Cut *c = user;
  refit_subtree(c->refit, c->nodes.items[c->above + item]);
}

static bool refit_nodes(Refit *r, Err *err)
{
  Cut c = {.refit = r};
  bool ok = cut_subtrees(&c) || err_memory(err, "refitting a tree", c.nodes.count * sizeof *c.nodes.items);
  if (ok && !jobs_run(r->jobs, c.nodes.count - c.above, subtree_work, &c, r->cancel)) {
    ok = err_set(err, ERR_CANCELLED, "refitting a tree was cancelled");
  }
  for (size_t i = c.above; ok && i-- > 0;) refit_node(r, c.nodes.items[i]);
  array_finish(&c.nodes);
  return ok;
}

static bool refit_all(Refit *r, Err *err)
{
  const MeshTree *old = r->old;
  MeshTree *t = r->tree;
  t->root = old->root;
  t->bounds = bounds_empty();
  t->node_count = old->node_count;
  t->block_count = old->block_count;
  t->triangle_count = old->triangle_count;
  t->quality = old->quality; // though without its pieces: boxes are those of whole triangles again
  if (t->node_count) t->nodes = mem_alloc(t->node_count, sizeof *t->nodes);
  if (t->node_count) r->states = mem_alloc(t->node_count, sizeof *r->states);
  if (t->block_count) t->blocks = mem_alloc(t->block_count, sizeof *t->blocks);
  r->is_found = mem_zero(r->mesh.triangle_count, sizeof *r->is_found);
  if ((t->node_count && (!t->nodes || !r->states)) || (t->block_count && !t->blocks) || !r->is_found) {
    return err_memory(err, "a mesh's tree", mesh_tree_bytes(t));
  }
  if (t->root == EMPTY_TREE) return true;
  if (t->root & LEAF_BIT) {
    t->bounds = refit_block(r, 0);
    return true;
  }
  if (!refit_nodes(r, err)) return false;
  t->bounds = r->states[t->root].box;
  return true;
}

// --- the next tree --------------------------------------------------------------------------------

// False with *is_hopeless: the mesh must be built.
static bool make_tree(Refit *r, bool *is_hopeless, Err *err)
{
  if (!refit_all(r, err)) return false;
  *is_hopeless = atomic_load_explicit(&r->is_foreign, memory_order_relaxed);
  if (*is_hopeless || !refit_insert(r, is_hopeless, err)) return false;
  const bool has_worn = r->states && r->states[r->tree->root].has_worn;
  return !has_worn || refit_graft(r, is_hopeless, err);
}

MeshTree *refit_run(Refit *r, Err *err)
{
  // A tree in another layout, or of no triangles yet, gives nothing to start from.
  bool is_hopeless = !r->old->blocks || (r->old->node_count && !r->old->nodes), ok = false;
  if (!is_hopeless) {
    r->tree = mem_zero(1, sizeof *r->tree);
    if (r->tree) atomic_init(&r->tree->users, 1);
    ok = r->tree ? make_tree(r, &is_hopeless, err) : err_memory(err, "a mesh's tree", sizeof *r->tree);
  }
  mem_free(r->states);
  mem_free(r->is_found);
  array_finish(&r->newcomers);
  if (ok) return r->tree;
  mesh_tree_release(r->tree);
  if (!is_hopeless) return NULL;
  r->rebuilt_count = r->mesh.triangle_count;
  return mesh_tree_build(r->mesh.positions, r->mesh.vertex_count, r->mesh.triangles, r->mesh.triangle_count,
                         (TreeOptions){r->old->layout, r->old->quality}, r->jobs,
                         r->cancel, err);
}

MeshTree *mesh_tree_refit(const MeshTree *old, const float *positions, size_t vertex_count, const uint32_t *triangles,
                          size_t triangle_count, Jobs *jobs, const Cancel *cancel, Err *err)
{
  Refit r = {.old = old, .mesh = {positions, vertex_count, triangles, triangle_count}, .jobs = jobs, .cancel = cancel,
             .most_wear = MOST_WEAR};
  return refit_run(&r, err);
}
