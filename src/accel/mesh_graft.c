// Grafting: see refit.h. Each worn part is a mesh of its own for the builder of build.h, and its tree takes the place
// of the old part: what is kept moves together, in its order, and the new parts follow.
//
//   nodes of the new tree   | kept, gaps closed ........... | graft 0 | graft 1 | ...    and likewise its blocks
//
// A part's tree may be deeper than the old one. A walk's stack holds only MOST_DEPTH levels, so should the whole come
// to more, it is built as one.

#include "accel/build.h"
#include "accel/refit.h"

#include <stdlib.h>
#include <string.h>

enum {
  LARGE_GRAFT = 1 << 16, // from so many triangles on all threads build one graft; smaller ones go side by side
  COPY_CHUNK = 1 << 10,  // nodes or blocks a work item
  GONE = 1,              // in the maps: belongs to a worn part
};

// When more than this share of the triangles must be built anew, the whole is: that costs little more, and is better.
#define MOST_REBUILT_SHARE 0.5

typedef struct Graft {
  uint32_t node;   // of the worn part's root
  uint32_t parent; // and its place there
  int lane;
  int depth;       // of nodes down to it, itself included
  MeshTree tree;   // of the part; owns its arrays
  size_t first_node, first_block; // where those go
  bool is_made;
} Graft;

typedef struct Grafting {
  Refit *refit;
  ARRAY(Graft) grafts;
  uint32_t *node_map, *block_map; // owned; old number -> new one, for what is kept
  MeshTree *tree;                 // with the grafts; owned until it is done
} Grafting;

static void grafting_finish(Grafting *g)
{
  for (size_t i = 0; i < g->grafts.count; i++) {
    mem_free(g->grafts.items[i].tree.nodes);
    mem_free(g->grafts.items[i].tree.blocks);
  }
  array_finish(&g->grafts);
  mem_free(g->node_map);
  mem_free(g->block_map);
  mesh_tree_release(g->tree);
}

// --- finding them ---------------------------------------------------------------------------------

// The highest worn parts below a node that is not worn. False: no memory.
static bool find_grafts(Grafting *g, uint32_t node_i, int depth)
{
  const Node8 *n = &g->refit->tree->nodes[node_i];
  for (int lane = 0; lane < 8; lane++) {
    const uint32_t code = n->child[lane];
    if (code & LEAF_BIT || !g->refit->states[code].has_worn) continue;
    const Graft graft = {.node = code, .parent = node_i, .lane = lane, .depth = depth + 1};
    const bool ok =
        g->refit->states[code].is_worn ? array_push(&g->grafts, graft) : find_grafts(g, code, depth + 1);
    if (!ok) return false;
  }
  return true;
}

static size_t lanes_to_rebuild(const Grafting *g)
{
  size_t lanes = 0;
  for (size_t i = 0; i < g->grafts.count; i++) lanes += g->refit->states[g->grafts.items[i].node].lanes;
  return lanes;
}

// --- building one ---------------------------------------------------------------------------------

static void gather_block(const Tri8 *block, Build *b)
{
  for (int lane = 0; lane < 8; lane++) {
    if (block->prim[lane] == NO_HIT || block->v[0][0][lane] != block->v[0][0][lane]) continue;
    float box[6];
    tri8_box(block, lane, box);
    const Bounds bounds = {v3(box[0], box[2], box[4]), v3(box[1], box[3], box[5])};
    b->refs[b->count++] = ref_of(&bounds, block->prim[lane]);
  }
}

static void gather_subtree(const MeshTree *t, uint32_t node_i, Build *b)
{
  for (int lane = 0; lane < 8; lane++) {
    const uint32_t code = t->nodes[node_i].child[lane];
    if (code == EMPTY_TREE) continue;
    if (code & LEAF_BIT) gather_block(&t->blocks[code & ~LEAF_BIT], b);
    else gather_subtree(t, code, b);
  }
}

// The first newcomer of a node, or where it would be.
static size_t find_newcomers(const Refit *r, uint32_t node)
{
  size_t low = 0, high = r->newcomers.count;
  while (low < high) {
    const size_t middle = low + (high - low) / 2;
    if (r->newcomers.items[middle].node < node) low = middle + 1;
    else high = middle;
  }
  return low;
}

static size_t count_newcomers(const Refit *r, uint32_t node)
{
  return find_newcomers(r, node + 1) - find_newcomers(r, node);
}

static void gather_newcomers(const Refit *r, uint32_t node, Build *b)
{
  const Newcomer *n = r->newcomers.items + find_newcomers(r, node);
  for (size_t i = count_newcomers(r, node); i-- > 0; n++) b->refs[b->count++] = ref_of(&n->box, n->prim);
}

static int by_prim(const void *a, const void *b)
{
  const uint32_t p = ref_prim(a), q = ref_prim(b);
  return (p > q) - (p < q);
}

// A builder that splits triangles puts them in several leaves; here a triangle's box is its whole box, so one will do.
static void drop_duplicates(Build *b)
{
  if (b->count == 0) return;
  qsort(b->refs, b->count, sizeof *b->refs, by_prim);
  size_t kept = 1;
  for (size_t i = 1; i < b->count; i++) {
    if (ref_prim(&b->refs[i]) != ref_prim(&b->refs[kept - 1])) b->refs[kept++] = b->refs[i];
  }
  b->count = kept;
}

typedef struct GraftEmit {
  const MeshArrays *mesh;
  Tri8 *blocks;
} GraftEmit;

static uint32_t emit_block(void *user, size_t leaf_i, const uint32_t *prims, uint32_t count)
{
  const GraftEmit *e = user;
  uint32_t prim[8];
  for (uint32_t lane = 0; lane < 8; lane++) prim[lane] = lane < count ? prims[lane] : NO_HIT;
  block_fill(&e->blocks[leaf_i], e->mesh, prim);
  return (uint32_t)leaf_i;
}

static bool fill_graft(const Refit *r, Graft *graft, Build *b)
{
  const NodeState *s = &r->states[graft->node];
  MeshTree *t = &graft->tree;
  if (!build_init(b, s->lanes + count_newcomers(r, graft->node), NULL)) return false;
  b->count = 0;
  gather_subtree(r->tree, graft->node, b);
  gather_newcomers(r, graft->node, b);
  if (r->states[r->tree->root].lanes > r->found_count) drop_duplicates(b);
  if (!build_split(b, NULL)) return false;
  t->triangle_count = b->count;
  t->node_count = b->node_count;
  t->block_count = b->leaf_count;
  if (t->node_count) t->nodes = mem_alloc(t->node_count, sizeof *t->nodes);
  if (t->block_count) t->blocks = mem_alloc(t->block_count, sizeof *t->blocks);
  if ((t->node_count && !t->nodes) || (t->block_count && !t->blocks)) return false;
  GraftEmit emit = {&r->mesh, t->blocks};
  t->root = build_emit(b, t->nodes, emit_block, &emit);
  return true;
}

static void make_graft(const Refit *r, Graft *graft, Jobs *jobs)
{
  Build b = {.jobs = jobs, .cancel = r->cancel};
  graft->is_made = fill_graft(r, graft, &b);
  build_finish(&b);
}

static bool is_large(const Refit *r, const Graft *graft) { return r->states[graft->node].lanes >= LARGE_GRAFT; }

static void small_graft_work(void *user, size_t item, int worker)
{
  (void)worker;
  const Grafting *g = user;
  Graft *graft = &g->grafts.items[item];
  if (!is_large(g->refit, graft)) make_graft(g->refit, graft, NULL);
}

static bool make_grafts(Grafting *g, Err *err)
{
  const Refit *r = g->refit;
  bool ok = jobs_run(r->jobs, g->grafts.count, small_graft_work, g, r->cancel);
  for (size_t i = 0; ok && i < g->grafts.count; i++) {
    if (is_large(r, &g->grafts.items[i])) make_graft(r, &g->grafts.items[i], r->jobs);
    ok = g->grafts.items[i].is_made;
  }
  if (ok) return true;
  if (is_cancelled(r->cancel)) return err_set(err, ERR_CANCELLED, "rebuilding parts of a tree was cancelled");
  return err_memory(err, "rebuilding parts of a tree", lanes_to_rebuild(g) * sizeof(BuildRef));
}

// Levels of nodes.
static int tree_height(const MeshTree *t, uint32_t code)
{
  if (code & LEAF_BIT) return 0;
  int most = 0;
  for (int lane = 0; lane < 8; lane++) {
    const int height = tree_height(t, t->nodes[code].child[lane]);
    if (height > most) most = height;
  }
  return most + 1;
}

static bool is_too_deep(const Grafting *g)
{
  for (size_t i = 0; i < g->grafts.count; i++) {
    const Graft *graft = &g->grafts.items[i];
    if (graft->depth - 1 + tree_height(&graft->tree, graft->tree.root) > MOST_DEPTH) return true;
  }
  return false;
}

// --- putting the tree together --------------------------------------------------------------------

static void mark_gone(Grafting *g, uint32_t node_i)
{
  g->node_map[node_i] = GONE;
  for (int lane = 0; lane < 8; lane++) {
    const uint32_t code = g->refit->tree->nodes[node_i].child[lane];
    if (code == EMPTY_TREE) continue;
    if (code & LEAF_BIT) g->block_map[code & ~LEAF_BIT] = GONE;
    else mark_gone(g, code);
  }
}

// Numbers what is not gone; returns how many are left.
static size_t number_kept(uint32_t *map, size_t count)
{
  size_t kept = 0;
  for (size_t i = 0; i < count; i++) map[i] = map[i] == GONE ? EMPTY_TREE : (uint32_t)kept++;
  return kept;
}

// Gives everything its number in the new tree.
static bool number_all(Grafting *g)
{
  const MeshTree *from = g->refit->tree;
  MeshTree *t = g->tree;
  g->node_map = mem_zero(from->node_count, sizeof *g->node_map);
  g->block_map = mem_zero(from->block_count, sizeof *g->block_map);
  if (!g->node_map || !g->block_map) return false;
  for (size_t i = 0; i < g->grafts.count; i++) mark_gone(g, g->grafts.items[i].node);
  t->node_count = number_kept(g->node_map, from->node_count);
  t->block_count = number_kept(g->block_map, from->block_count);
  t->triangle_count = from->triangle_count;
  for (size_t i = 0; i < g->grafts.count; i++) {
    Graft *graft = &g->grafts.items[i];
    graft->first_node = t->node_count;
    graft->first_block = t->block_count;
    t->node_count += graft->tree.node_count;
    t->block_count += graft->tree.block_count;
    // Lanes count a triangle once for each leaf it is in, so this is a bound from below, never under the graft's own.
    const size_t lanes = g->refit->states[graft->node].lanes;
    t->triangle_count -= lanes < t->triangle_count ? lanes : t->triangle_count;
    t->triangle_count += graft->tree.triangle_count;
  }
  return true;
}

static uint32_t kept_code(const Grafting *g, uint32_t code)
{
  if (code == EMPTY_TREE) return code;
  return code & LEAF_BIT ? LEAF_BIT | g->block_map[code & ~LEAF_BIT] : g->node_map[code];
}

static uint32_t graft_code(const Graft *graft, uint32_t code)
{
  if (code == EMPTY_TREE) return code;
  return code + (uint32_t)(code & LEAF_BIT ? graft->first_block : graft->first_node);
}

static void copy_kept(void *user, size_t item, int worker)
{
  (void)worker;
  const Grafting *g = user;
  const MeshTree *from = g->refit->tree;
  for (size_t i = item * COPY_CHUNK; i < (item + 1) * COPY_CHUNK; i++) {
    if (i < from->node_count && g->node_map[i] != EMPTY_TREE) {
      Node8 *to = &g->tree->nodes[g->node_map[i]];
      *to = from->nodes[i];
      for (int lane = 0; lane < 8; lane++) to->child[lane] = kept_code(g, to->child[lane]);
    }
    if (i < from->block_count && g->block_map[i] != EMPTY_TREE) g->tree->blocks[g->block_map[i]] = from->blocks[i];
  }
}

static void copy_graft(void *user, size_t item, int worker)
{
  (void)worker;
  const Grafting *g = user;
  const Graft *graft = &g->grafts.items[item];
  Node8 *nodes = g->tree->nodes + graft->first_node;
  for (size_t i = 0; i < graft->tree.node_count; i++) {
    nodes[i] = graft->tree.nodes[i];
    for (int lane = 0; lane < 8; lane++) nodes[i].child[lane] = graft_code(graft, nodes[i].child[lane]);
  }
  if (graft->tree.block_count)
    memcpy(g->tree->blocks + graft->first_block, graft->tree.blocks, graft->tree.block_count * sizeof(Tri8));
  Node8 *parent = &g->tree->nodes[g->node_map[graft->parent]];
  parent->child[graft->lane] = graft_code(graft, graft->tree.root);
  parent->count[graft->lane] = (uint8_t)(graft->tree.root & LEAF_BIT ? graft->tree.triangle_count : 0);
}

static bool join(Grafting *g, Err *err)
{
  const MeshTree *from = g->refit->tree;
  MeshTree *t = g->tree = mem_zero(1, sizeof *t);
  if (!t) return err_memory(err, "a mesh's tree", sizeof *t);
  atomic_init(&t->users, 1);
  t->quality = from->quality;
  t->bounds = from->bounds;
  if (!number_all(g)) return err_memory(err, "a mesh's tree", mesh_tree_bytes(from));
  t->root = g->node_map[from->root];
  t->nodes = mem_alloc(t->node_count, sizeof *t->nodes);
  if (t->block_count) t->blocks = mem_alloc(t->block_count, sizeof *t->blocks);
  if (!t->nodes || (t->block_count && !t->blocks)) return err_memory(err, "a mesh's tree", mesh_tree_bytes(t));
  const size_t most = from->node_count > from->block_count ? from->node_count : from->block_count;
  const Refit *r = g->refit;
  return (jobs_run(r->jobs, (most + COPY_CHUNK - 1) / COPY_CHUNK, copy_kept, g, r->cancel) &&
          jobs_run(r->jobs, g->grafts.count, copy_graft, g, r->cancel)) ||
         err_set(err, ERR_CANCELLED, "rebuilding parts of a tree was cancelled");
}

static bool graft_all(Grafting *g, bool *is_hopeless, Err *err)
{
  Refit *r = g->refit;
  if (!find_grafts(g, r->tree->root, 1)) return err_memory(err, "refitting a tree", sizeof(Graft));
  const size_t lanes = lanes_to_rebuild(g);
  *is_hopeless = (double)lanes > MOST_REBUILT_SHARE * (double)r->states[r->tree->root].lanes;
  if (*is_hopeless || !make_grafts(g, err)) return false;
  *is_hopeless = is_too_deep(g);
  if (*is_hopeless || !join(g, err)) return false;
  mesh_tree_release(r->tree);
  r->tree = g->tree;
  g->tree = NULL;
  r->rebuilt_count = lanes;
  return true;
}

bool refit_graft(Refit *r, bool *is_hopeless, Err *err)
{
  *is_hopeless = r->states[r->tree->root].is_worn;
  if (*is_hopeless) return false;
  Grafting g = {.refit = r};
  const bool ok = graft_all(&g, is_hopeless, err);
  grafting_finish(&g);
  return ok;
}
