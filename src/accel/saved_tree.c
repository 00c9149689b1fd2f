// See saved_tree.h. Two looks at the nodes: all threads check boxes and the range of child codes, then one goes
// through the children in order to see that none has two parents and none lies too deep.

#include "accel/saved_tree.h"

#include "accel/tree.h"
#include "base/mem.h"

enum { CHUNK = 4096 }; // nodes or leaves a job: about a megabyte

typedef struct TreeCheck {
  const MeshTree *tree;
  uint32_t mesh_triangle_count;
  size_t node_chunks;
  atomic_bool is_bad; // set by any thread, read after all are done
} TreeCheck;

// --- one node, one leaf -----------------------------------------------------------------------------
// Which lanes hold a finite box, and which the box that no ray enters. A not-a-number is neither.
static void sort_lanes(const Node8 *n, unsigned *used, unsigned *unused)
{
  *used = *unused = 0;
  for (int g = 0; g < 8; g += WIDE) {
    unsigned box = ~0u, none = ~0u;
    for (int k = 0; k < 3; k++) {
      const wf lo = wf_load(n->box[2 * k] + g), hi = wf_load(n->box[2 * k + 1] + g);
      box &= wf_le(wf_set(-FLT_MAX), lo) & wf_le(lo, hi) & wf_le(hi, wf_set(FLT_MAX));
      none &= wf_eq(lo, wf_set(INFINITY)) & wf_eq(hi, wf_set(-INFINITY));
    }
    *used |= box << g;
    *unused |= none << g;
  }
}

// Refits size their room by a leaf's count. Of a tree of pieces it may be more than the triangles it holds.
static bool is_leaf_sound(const MeshTree *t, uint32_t block_i, uint8_t count)
{
  int used = 0;
  if (block_i >= t->block_count || count < 1 || count > 8) return false;
  for (int i = 0; i < 8; i++) used += t->blocks[block_i].prim[i] != NO_HIT;
  return used <= count;
}

static bool is_node_sound(const MeshTree *t, size_t i)
{
  const Node8 *n = &t->nodes[i];
  unsigned used, unused;
  sort_lanes(n, &used, &unused);
  if ((used | unused) != 0xff) return false;
  for (unsigned left = used; left; left &= left - 1) {
    const int lane = __builtin_ctz(left);
    const uint32_t child = n->child[lane];
    const bool ok = child & LEAF_BIT ? is_leaf_sound(t, child & ~LEAF_BIT, n->count[lane])
                                     : child > i && child < t->node_count && n->count[lane] == 0;
    if (!ok) return false;
  }
  for (unsigned left = unused; left; left &= left - 1)
    if (n->child[__builtin_ctz(left)] != EMPTY_TREE) return false;
  return true;
}

// A lane without a triangle must be one that nothing hits: not-a-numbers in one vertex reach every determinant. All
// lanes alike and without a branch, since how many of them are used is different in each block.
static bool is_block_sound(const Tri8 *b, uint32_t triangle_count)
{
  const float(*v)[8] = b->v[0];
  uint32_t bad = 0;
  for (int i = 0; i < 8; i++) {
    const uint32_t is_used = b->prim[i] < triangle_count, is_none = b->prim[i] == NO_HIT;
    const uint32_t is_nan = (v[0][i] != v[0][i]) & (v[1][i] != v[1][i]) & (v[2][i] != v[2][i]);
    bad |= !(is_used | (is_none & is_nan));
  }
  return !bad && b->prim[0] != NO_HIT;
}

static void check_chunk(void *user, size_t item, int worker)
{
  (void)worker;
  TreeCheck *c = user;
  const MeshTree *t = c->tree;
  const bool is_nodes = item < c->node_chunks;
  const size_t first = (is_nodes ? item : item - c->node_chunks) * CHUNK;
  const size_t count = is_nodes ? t->node_count : t->block_count;
  bool ok = true;
  for (size_t i = first; ok && i < count && i < first + CHUNK; i++)
    ok = is_nodes ? is_node_sound(t, i) : is_block_sound(&t->blocks[i], c->mesh_triangle_count);
  if (!ok) atomic_store_explicit(&c->is_bad, true, memory_order_relaxed);
}

// --- the whole --------------------------------------------------------------------------------------
// A child's number is greater than its parent's, so each node's depth is known when its turn comes. A second parent
// would make a tree of thousands of nodes a walk of billions of steps; and refits want every node and leaf to be in
// the tree, once.
static bool are_links_sound(const MeshTree *t, uint8_t *depth, uint8_t *is_seen)
{
  size_t leaves = 0;
  depth[t->root] = 1;
  for (size_t i = 0; i < t->node_count; i++) {
    const Node8 *n = &t->nodes[i];
    if (!depth[i] || depth[i] > MOST_DEPTH) return false;
    for (int lane = 0; lane < 8; lane++) {
      const uint32_t child = n->child[lane];
      if (child == EMPTY_TREE) continue;
      uint8_t *seen = child & LEAF_BIT ? &is_seen[child & ~LEAF_BIT] : &depth[child];
      if (*seen) return false;
      *seen = (uint8_t)(depth[i] + 1);
      leaves += child >> 31;
    }
  }
  return leaves == t->block_count;
}

static bool fail_damaged(const SharedFile *file, Err *err)
{
  return err_set(
      err, ERR_BAD_SCENE,
      "%s: this saved model is damaged: the tree of a mesh is not sound; convert it again from the "
      "model it was made of",
      file->path);
}

// Nothing to hit, or a root that is there and a finite box around it all.
static bool is_root_sound(const MeshTree *t)
{
  if (t->root == EMPTY_TREE) return t->block_count == 0 && t->node_count == 0;
  if (bounds_is_empty(&t->bounds) || !bounds_is_finite(&t->bounds)) return false;
  if (t->root & LEAF_BIT) return t->root == LEAF_BIT && t->block_count == 1 && t->node_count == 0;
  return t->root < t->node_count;
}

static bool check_tree(const MeshTree *t, size_t mesh_triangle_count, Jobs *jobs, Err *err)
{
  if (!is_root_sound(t) || t->triangle_count > mesh_triangle_count) return fail_damaged(t->file, err);
  const size_t node_chunks = (t->node_count + CHUNK - 1) / CHUNK;
  TreeCheck c = {.tree = t, .mesh_triangle_count = (uint32_t)mesh_triangle_count, .node_chunks = node_chunks};
  atomic_init(&c.is_bad, false);
  jobs_run(jobs, node_chunks + (t->block_count + CHUNK - 1) / CHUNK, check_chunk, &c, NULL);
  if (atomic_load(&c.is_bad)) return fail_damaged(t->file, err);
  if (!t->node_count) return true;
  uint8_t *depth = mem_zero(t->node_count + t->block_count, 1);
  if (!depth) return err_memory(err, "checking a tree", t->node_count + t->block_count);
  const bool ok = are_links_sound(t, depth, depth + t->node_count);
  mem_free(depth);
  return ok || fail_damaged(t->file, err);
}

bool saved_tree_suits(const SavedTree *saved, TreeOptions wanted)
{
  const TreeHead *head = saved->head.data;
  if (saved->head.size != sizeof *head || head->layout != SAVED_NODE8_TRI8 || head->has_pieces > 1)
    return false;
  if (wanted.layout != TREE_FLOAT) return false;
  return head->quality == SAVED_BEST || (head->quality == SAVED_FAST && wanted.quality == TREE_FAST);
}

// Child codes and their leaf bit leave 31 bits for numbers.
static bool are_sizes_sound(const SavedTree *saved)
{
  const TreeHead *head = saved->head.data;
  return head->node_count < LEAF_BIT && head->block_count < LEAF_BIT &&
         saved->nodes.size == head->node_count * sizeof(Node8) &&
         saved->leaves.size == head->block_count * sizeof(Tri8);
}

MeshTree *mesh_tree_open(const SavedTree *saved, size_t mesh_triangle_count, SharedFile *file, Jobs *jobs,
                         Err *err)
{
  const TreeHead *head = saved->head.data;
  if (!are_sizes_sound(saved)) return fail_damaged(file, err), NULL;
  MeshTree *t = mem_zero(1, sizeof *t);
  if (!t) return err_memory(err, "a mesh's tree", sizeof *t), NULL;
  atomic_init(&t->users, 1);
  t->file = shared_file_share(file);
  t->quality = head->quality == SAVED_BEST ? TREE_BEST : TREE_FAST;
  t->has_pieces = head->has_pieces;
  t->root = head->root;
  t->nodes = (Node8 *)(size_t)saved->nodes.data;
  t->blocks = (Tri8 *)(size_t)saved->leaves.data;
  t->node_count = head->node_count;
  t->block_count = head->block_count;
  t->triangle_count = head->triangle_count;
  t->bounds = t->root == EMPTY_TREE ? bounds_empty() : (Bounds){v3_load(head->lo), v3_load(head->hi)};
  if (check_tree(t, mesh_triangle_count, jobs, err)) return t;
  mesh_tree_release(t);
  return NULL;
}

SavedTree mesh_tree_save(const MeshTree *t, TreeHead *head)
{
  *head = (TreeHead){.layout = SAVED_NODE8_TRI8,
                     .quality = t->quality == TREE_BEST ? SAVED_BEST : SAVED_FAST,
                     .has_pieces = t->has_pieces,
                     .root = t->root,
                     .node_count = t->node_count,
                     .block_count = t->block_count,
                     .triangle_count = t->triangle_count};
  v3_store(head->lo, t->bounds.lo);
  v3_store(head->hi, t->bounds.hi);
  return (SavedTree){{head, sizeof *head},
                     {t->nodes, t->node_count * sizeof *t->nodes},
                     {t->blocks, t->block_count * sizeof *t->blocks}};
}
