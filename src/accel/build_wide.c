// Collapsing: which nodes of the binary tree become wide nodes and leaves, at the lowest cost there is for this binary
// tree (Ylitie, Karras, Laine, "Efficient incoherent ray traversal on GPUs through compressed wide BVHs", HPG 2017,
// section 4.1, after Aila and Karras 2010). For every node and every number of roots up to seven, cost[node][i] is that
// of the cheapest forest for what lies below it:
//
//   cost[n][1] = min(area * a leaf, if it is small enough;  area * a node + split(n, 8))
//   cost[n][i] = min(cost[n][1], split(n, i)),   split(n, i) = min over k of cost[left][k] + cost[right][i - k]
//
// What was chosen is kept in the nodes' bits, and emitting only follows it. Costs are areas over that of the scene.
//
// Depth: a walk must never hold more than STACK_SIZE entries, so a tree has at most MOST_DEPTH levels of nodes. The
// cheapest tree is nearly always far below that. When it is not, the same search is done once more for the lowest
// tree, counting levels instead of areas. That one is low enough: opening the highest of a node's subtrees seven times
// takes three levels off its height, since no more than 1 + 2 + 4 of them are higher than that; and MOST_BINARY_DEPTH
// is 103 levels, a third of which is 35.

#include "accel/build_tree.h"

_Static_assert((MOST_BINARY_DEPTH + 2) / 3 <= MOST_DEPTH, "the lowest wide tree must fit the walk's stack");

#define NODE_COST  1.0f
#define BLOCK_COST 1.0f

// Bits of a node: whether it is a leaf when it is one child, and for i of 2 to 8 roots how many the left side gets; 0:
// it is better off as one.
enum { NODE_LEAF = 64, LEFT_SHIFT = 8, LEFT_BITS = 3 };

static uint32_t lefts_of(const BinaryNode *n, int roots)
{
  return n->bits >> (LEFT_SHIFT + LEFT_BITS * (roots - 2)) & 7;
}

// --- choosing -----------------------------------------------------------------------------------

static float half_area_scaled(const BinaryNode *n, float scale)
{
  const Vec3 d = (v3_load(n->hi) - v3_load(n->lo)) * scale;
  return d[0] * (d[1] + d[2]) + d[1] * d[2];
}

typedef struct Collapse {
  float scale; // of areas
  uint32_t leaf_size;
  bool by_depth;
} Collapse;

// Costs of a node that is one thing whatever it is given.
static void set_all(float cost[8], float one)
{
  for (int i = 1; i < 8; i++) cost[i] = one;
}

// The cheapest way to share out 2 to 8 roots between two sides.
static void split_roots(const Collapse *c, const float *left, const float *right, float split[9], uint32_t *bits)
{
  for (int i = 2; i <= 8; i++) {
    split[i] = INFINITY;
    int lefts = 1;
    for (int k = 1; k < i; k++) {
      const float sum = c->by_depth ? max_f(left[k], right[i - k]) : left[k] + right[i - k];
      if (sum < split[i]) lefts = k;
      split[i] = min_f(sum, split[i]);
    }
    *bits |= (uint32_t)lefts << (LEFT_SHIFT + LEFT_BITS * (i - 2));
  }
}

static void collapse_node(const Collapse *c, BinaryNode *n, const float *left, const float *right, float *cost)
{
  const float area = c->by_depth ? 1 : half_area_scaled(n, c->scale);
  const uint32_t count = n->bits & NODE_COUNT;
  uint32_t bits = n->bits & (NODE_COUNT | NODE_INNER);
  float split[9];
  split_roots(c, left, right, split, &bits);
  cost[1] = area * NODE_COST + split[8];
  if (count && count <= c->leaf_size && area * BLOCK_COST <= cost[1]) {
    cost[1] = area * BLOCK_COST;
    bits |= NODE_LEAF;
  }
  for (int i = 2; i < 8; i++) {
    cost[i] = split[i];
    if (split[i] < cost[1]) continue;
    cost[i] = cost[1];
    bits &= ~(7u << (LEFT_SHIFT + LEFT_BITS * (i - 2)));
  }
  n->bits = bits;
}

static Collapse collapse_of(const Build *b, bool by_depth)
{
  const float scale = 1 / v3_max_lane(b->bounds.hi - b->bounds.lo);
  return (Collapse){isfinite(scale) ? scale : 0, b->leaf_size, by_depth};
}

void wide_collapse(const Build *b, BinaryTree *t, float (*cost)[8], bool by_depth)
{
  const Collapse c = collapse_of(b, by_depth);
  for (size_t i = t->count; i-- > 0;) {
    BinaryNode *n = &t->items[i];
    if (n->bits & NODE_SUBTREE) {
      memcpy(cost[i], b->top->subtrees.items[n->link].cost, sizeof cost[i]);
    } else if (n->bits & NODE_INNER) {
      collapse_node(&c, n, cost[n->link], cost[n->link + 1], cost[i]);
    } else {
      n->bits = (n->bits & NODE_COUNT) | NODE_LEAF;
      set_all(cost[i], by_depth ? 0 : half_area_scaled(n, c.scale) * BLOCK_COST);
    }
  }
}

// --- following the choice -----------------------------------------------------------------------

// A node and the piece it is in.
typedef struct Place {
  const BinaryNode *piece;
  uint32_t i;
} Place;

static const BinaryNode *node_at(Place p) { return &p.piece[p.i]; }

// Where the top ends, what stands for a subtree is its root.
static Place enter_subtree(const BuildTop *top, Place p)
{
  if (!(node_at(p)->bits & NODE_SUBTREE)) return p;
  return (Place){top->subtrees.items[node_at(p)->link].tree.items, 0};
}

// The children of a wide node.
static int wide_children(const BuildTop *top, Place wide, Place children[8])
{
  struct {
    Place place;
    int roots;
  } open[8];
  int height = 0, count = 0;
  open[height].place = wide;
  open[height++].roots = 8;
  while (height > 0) {
    const Place p = enter_subtree(top, open[--height].place);
    const int roots = open[height].roots;
    const int lefts = roots > 1 && node_at(p)->bits & NODE_INNER ? (int)lefts_of(node_at(p), roots) : 0;
    if (lefts == 0) {
      children[count++] = p;
      continue;
    }
    open[height].place = (Place){p.piece, node_at(p)->link + 1};
    open[height++].roots = roots - lefts;
    open[height].place = (Place){p.piece, node_at(p)->link};
    open[height++].roots = lefts;
  }
  return count;
}

static bool is_leaf(Place p) { return (node_at(p)->bits & NODE_LEAF) != 0; }

static uint32_t first_prim(Place p)
{
  while (node_at(p)->bits & NODE_INNER) p.i = node_at(p)->link;
  return node_at(p)->link;
}

// --- numbering and emitting ---------------------------------------------------------------------

// A wide node and all below it, walked by one thread. Its own number is given by whoever has it as a child, so that
// siblings are neighbours; what is below has numbers in a row.
typedef struct Branch {
  Place root;
  size_t node; // its number
  int depth;   // of nodes down to it, itself included
  size_t first_node, first_leaf;
  size_t node_count, leaf_count; // below it
  int most_depth;
} Branch;

typedef ARRAY(Branch) Branches;

// The top walk stops where subtrees begin; branches are what it finds there.
typedef struct WideTop {
  bool has_nodes; // the root is not a leaf
  Branch top;     // of no use when the root is in a subtree
  Branches branches;
} WideTop;

void wide_finish(WideTop *w)
{
  if (!w) return;
  array_finish(&w->branches);
  mem_free(w);
}

// Where a walk writes; nodes NULL only counts.
typedef struct Output {
  const Build *build;
  Node8 *nodes;
  LeafEmit *emit;
  void *user;
} Output;

static void write_box(Node8 *n, int lane, const float lo[3], const float hi[3])
{
  for (int k = 0; k < 3; k++) {
    n->box[2 * k][lane] = lo[k];
    n->box[2 * k + 1][lane] = hi[k];
  }
}

static uint32_t write_leaf(const Output *out, Place leaf, size_t leaf_i)
{
  const uint32_t *prims = out->build->top->prims + first_prim(leaf);
  return LEAF_BIT | out->emit(out->user, leaf_i, prims, node_at(leaf)->bits & NODE_COUNT);
}

// Writes a node whose inner children have numbers from next_node on and whose leaves from next_leaf on, both in order.
static void write_node(const Output *out, Node8 *to, const Place *children, int count, size_t next_node,
                       size_t next_leaf)
{
  const float lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
  Node8 n = {0};
  for (int lane = 0; lane < 8; lane++) {
    if (lane >= count) {
      write_box(&n, lane, lo, hi);
      n.child[lane] = EMPTY_TREE;
      continue;
    }
    const BinaryNode *c = node_at(children[lane]);
    write_box(&n, lane, c->lo, c->hi);
    if (is_leaf(children[lane])) {
      n.count[lane] = c->bits & NODE_COUNT;
      n.child[lane] = write_leaf(out, children[lane], next_leaf++);
    } else {
      n.child[lane] = (uint32_t)next_node++;
    }
  }
  *to = n;
}

// A wide node still to be walked.
typedef struct Pending {
  Place place;
  size_t node;
  int depth;
} Pending;

// Goes through the wide nodes of a branch, depth first. A node's inner children come in a row, and so do its leaves.
// With `found`, the walk does not go into other pieces and puts what it would have found there down. False: no memory.
static bool walk_branch(Branch *b, const Output *out, Branches *found)
{
  const BuildTop *top = out->build->top;
  Pending stack[STACK_SIZE];
  int height = 0;
  size_t next_node = b->first_node, next_leaf = b->first_leaf;
  b->most_depth = b->depth;
  stack[height++] = (Pending){b->root, b->node, b->depth};
  while (height > 0) {
    const Pending p = stack[--height];
    if (p.depth > b->most_depth) b->most_depth = p.depth;
    if (p.depth > MOST_DEPTH) return true; // the caller does it again, by depth
    Place children[8], inner[8];
    const int count = wide_children(top, p.place, children);
    int inner_count = 0;
    for (int i = 0; i < count; i++) {
      if (!is_leaf(children[i])) inner[inner_count++] = children[i];
    }
    if (out->nodes) write_node(out, &out->nodes[p.node], children, count, next_node, next_leaf);
    for (int i = inner_count - 1; i >= 0; i--) {
      const size_t node = next_node + (size_t)i;
      if (inner[i].piece == p.place.piece) {
        stack[height++] = (Pending){inner[i], node, p.depth + 1};
      } else if (found && !array_push(found, (Branch){.root = inner[i], .node = node, .depth = p.depth + 1})) {
        return false;
      }
    }
    next_node += (size_t)inner_count;
    next_leaf += (size_t)(count - inner_count);
  }
  b->node_count = next_node - b->first_node;
  b->leaf_count = next_leaf - b->first_leaf;
  return true;
}

typedef struct BranchJob {
  WideTop *wide;
  Output out;
} BranchJob;

static void branch_work(void *user, size_t item, int worker)
{
  (void)worker;
  BranchJob *j = user;
  walk_branch(&j->wide->branches.items[item], &j->out, NULL);
}

static bool collapse_top(const Build *b, bool by_depth)
{
  float (*cost)[8] = mem_alloc(b->top->tree.count, sizeof *cost);
  if (!cost) return false;
  wide_collapse(b, &b->top->tree, cost, by_depth);
  mem_free(cost);
  return true;
}

// The subtrees have been collapsed by whoever split them, but by cost.
static bool collapse_subtrees_by_depth(const Build *b)
{
  bool ok = true;
  for (size_t i = 0; ok && i < b->top->subtrees.count; i++) {
    Subtree *s = &b->top->subtrees.items[i];
    float (*cost)[8] = mem_alloc(s->tree.count, sizeof *cost);
    ok = cost != NULL;
    if (!ok) break;
    wide_collapse(b, &s->tree, cost, true);
    memcpy(s->cost, cost[0], sizeof s->cost);
    mem_free(cost);
  }
  return ok;
}

// Finds the branches, counts what is below each and gives out numbers: the top's first, then branch by branch.
static bool number_all(Build *b, int *depth)
{
  WideTop *w = b->top->wide;
  const Place root = enter_subtree(b->top, (Place){b->top->tree.items, 0});
  b->node_count = 0;
  b->leaf_count = 1;
  *depth = 0;
  w->branches.count = 0;
  w->has_nodes = !is_leaf(root);
  if (!w->has_nodes) return true;

  w->top = (Branch){.root = root, .depth = 1, .first_node = 1};
  BranchJob j = {w, {.build = b}};
  if (root.piece != b->top->tree.items) {
    if (!array_push(&w->branches, w->top)) return false;
    w->top.root.piece = NULL;
  } else if (!walk_branch(&w->top, &j.out, &w->branches)) {
    return false;
  }
  if (!jobs_run(b->jobs, w->branches.count, branch_work, &j, b->cancel)) return false;
  *depth = w->top.most_depth;
  b->node_count = 1 + w->top.node_count;
  b->leaf_count = w->top.leaf_count;
  for (size_t i = 0; i < w->branches.count; i++) {
    Branch *r = &w->branches.items[i];
    r->first_node = b->node_count;
    r->first_leaf = b->leaf_count;
    b->node_count += r->node_count;
    b->leaf_count += r->leaf_count;
    if (r->most_depth > *depth) *depth = r->most_depth;
  }
  return true;
}

bool wide_plan(Build *b)
{
  b->top->wide = mem_zero(1, sizeof *b->top->wide);
  int depth;
  if (!b->top->wide || !collapse_top(b, false) || !number_all(b, &depth)) return false;
  if (depth <= MOST_DEPTH) return true;
  return collapse_subtrees_by_depth(b) && collapse_top(b, true) && number_all(b, &depth);
}

uint32_t build_emit(Build *b, Node8 *nodes, LeafEmit *emit, void *user)
{
  if (b->count == 0) return EMPTY_TREE;
  WideTop *w = b->top->wide;
  BranchJob j = {w, {b, nodes, emit, user}};
  if (!w->has_nodes) return write_leaf(&j.out, enter_subtree(b->top, (Place){b->top->tree.items, 0}), 0);
  if (w->top.root.piece) walk_branch(&w->top, &j.out, NULL);
  jobs_run(b->jobs, w->branches.count, branch_work, &j, NULL);
  return 0;
}
