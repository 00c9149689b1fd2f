// Splitting: see build.h. A range of references whose split is known is gone through once: the references are put on
// their side of the plane, in place, and go into the bins of the child they belong to. So the children's splits are
// known in turn, and no range is ever measured. A child's bins lie over its box, cut by its parent's bins and the
// plane, which is known by then; where the centres turn out to fill little of that, they are binned again.
//
// Large ranges are gone through by all threads, a chunk each, all ranges of a level at once: a chunk's references are
// ordered within the chunk, then runs that ended up on the wrong side change places. From `subtree_size` on one thread
// goes on alone, and from SMALL on build_small.c does.

#include "accel/build_bins.h"
#include "accel/build_tree.h"

enum {
  CHUNK = 1 << 12,          // references a work item
  LEAST_SUBTREE = 1 << 12,  // a range of so many is one thread's, ...
  MOST_SUBTREE = 1 << 16,   // ... of more too, if there are 64 such in all
  LEAST_FILLED_SHARE = 4,   // bins are laid anew when centres fill less than 1 / this of them along every axis
  MOST_NEW_BINS = 8,        // so often
};

// References that will become one node, and how they will be split.
typedef struct Range {
  uint32_t first, count, node;
  int depth, new_bins; // new_bins: how often bins were laid anew
  Bounds box;
  BinMap map;
  Split split;
} Range;

// A worker's own memory. Kept from item to item.
typedef struct Scratch {
  Room room;
  Bins bins[2];
} Scratch;

// A piece of a large range. After it was gone through its first left_count references belong left.
typedef struct Chunk {
  uint32_t range, first, count, left_count;
  Bins bins[2]; // of the children; the first is used for the range itself when that is binned
} Chunk;

typedef struct Swap {
  uint32_t a, b, count; // runs of references that change places
} Swap;

typedef ARRAY(Range) Ranges;

// What threads share while they split.
typedef struct Splitter {
  Build *build;
  Ranges level, next, subtrees;
  ARRAY(Chunk) chunks;
  ARRAY(Swap) swaps;
  Scratch **scratch; // one a worker, made by it
  size_t worker_count;
  uint32_t subtree_size;
  atomic_bool is_out_of_memory;
} Splitter;

bool build_init(Build *b, size_t count, Err *err)
{
  b->count = count;
  if (!b->leaf_size) b->leaf_size = 8;
  if (count == 0) return true;
  b->room = b->clip ? spatial_room(count) : count;
  b->refs = mem_alloc(b->room, sizeof *b->refs);
  if (b->refs) return true;
  return err_memory(err, "building a tree", (unsigned long long)b->room * sizeof *b->refs);
}

void build_finish(Build *b)
{
  BuildTop *top = b->top;
  if (top) {
    for (size_t i = 0; i < top->subtrees.count; i++) array_finish(&top->subtrees.items[i].tree);
    array_finish(&top->subtrees);
    array_finish(&top->tree);
    wide_finish(top->wide);
    mem_free(top->prims);
    mem_free(top);
  }
  mem_free(b->refs);
  *b = (Build){0};
}

// --- scratch ------------------------------------------------------------------------------------

// Room for so many references, and rows of cost. NULL: no memory.
static Scratch *scratch_of(Splitter *s, int worker, size_t spare_count, size_t cost_count)
{
  Scratch *own = s->scratch[worker];
  if (!own) own = s->scratch[worker] = mem_zero(1, sizeof *own);
  const bool ok = own && room_reserve(&own->room, spare_count, cost_count);
  if (!ok) atomic_store_explicit(&s->is_out_of_memory, true, memory_order_relaxed);
  return ok ? own : NULL;
}

static void splitter_finish(Splitter *s)
{
  for (size_t i = 0; s->scratch && i < s->worker_count; i++) {
    if (!s->scratch[i]) continue;
    room_finish(&s->scratch[i]->room);
    mem_free(s->scratch[i]);
  }
  mem_free(s->scratch);
  array_finish(&s->level);
  array_finish(&s->next);
  array_finish(&s->subtrees);
  array_finish(&s->chunks);
  array_finish(&s->swaps);
}

// --- a range's own split ------------------------------------------------------------------------

// Whether the centres fill too little of the bins to choose well; then lo and hi are where they do lie.
static bool bins_are_wasted(const Bins *bins, BinMap *m, size_t count)
{
  const int n = bin_count(m);
  bool is_filled = false, is_useful = false;
  Vec3 lo = m->lo, hi = m->hi;
  for (int k = 0; k < 3; k++) {
    if (m->scale[k] <= 0) continue;
    int from = 0, to = n - 1;
    while (from < n - 1 && bins->count[from][k] == 0) from++;
    while (to > from && bins->count[to][k] == 0) to--;
    is_useful = true;
    is_filled |= (to + 1 - from) * LEAST_FILLED_SHARE > n;
    lo[k] = m->lo[k] + (float)from / m->scale[k];
    hi[k] = m->lo[k] + (float)(to + 1) / m->scale[k];
  }
  if (is_filled || !is_useful) return false;
  const BinMap finer = bin_map(lo, hi, count);
  const bool is_finer = finer.scale[0] > m->scale[0] || finer.scale[1] > m->scale[1] || finer.scale[2] > m->scale[2];
  *m = finer;
  return is_finer;
}

static void bins_fill(Bins *bins, const BinMap *m, const BuildRef *refs, size_t count)
{
  bins_clear(bins, bin_count(m));
  for (size_t i = 0; i < count; i++) bins_add(bins, m, &refs[i]);
}

// Chooses the range's split by its bins, which may be filled again for that.
static void choose_split(const Build *b, Range *r, Bins *bins)
{
  for (int i = 0; i < MOST_NEW_BINS && bins_are_wasted(bins, &r->map, r->count); i++) {
    bins_fill(bins, &r->map, b->refs + r->first, r->count);
  }
  r->split = bins_split(b, bins, &r->map, &r->box);
}

static bool needs_split(const Range *r) { return r->count > SMALL && r->depth < MOST_SPLIT_DEPTH; }

// What the two sides of a range will be, all but their nodes and splits.
static void child_ranges(const Range *r, Range child[2])
{
  for (int side = 0; side < 2; side++) {
    Range *c = &child[side];
    c->first = side ? r->first + r->split.left_count : r->first;
    c->count = side ? r->count - r->split.left_count : r->split.left_count;
    c->depth = r->depth + 1;
    c->new_bins = 0;
    c->box = r->split.box[side];
    c->map = bin_map_below(&r->map, &r->split, side, c->count);
    c->split.axis = -1;
  }
}

// Adds the nodes of a split. False: no memory.
static bool add_children(BinaryTree *t, const Range *r, Range child[2])
{
  const uint32_t pair = tree_add_pair(t, r->node, r->count);
  if (pair == UINT32_MAX) return false;
  for (int side = 0; side < 2; side++) {
    child[side].node = pair + (uint32_t)side;
    node_set_box(&t->items[child[side].node], &child[side].box);
  }
  return true;
}

// Puts the references on their side of the range's plane, keeping order: left ones to `left`, which may be where they
// come from, right ones to `right`. Returns how many went left. Without a branch: sides are hard to predict.
static uint32_t part(const Range *r, const BuildRef *refs, uint32_t count, BuildRef *left, BuildRef *right)
{
  const int k = r->split.axis;
  const float lo = r->map.lo[k], scale = r->map.scale[k], bin = (float)r->split.bin;
  uint32_t lefts = 0, rights = 0;
  for (uint32_t i = 0; i < count; i++) {
    const float *f = (const float *)&refs[i];
    const bool side = (f[k] + f[4 + k] - lo) * scale >= bin;
    const BuildRef ref = refs[i];
    left[lefts] = ref;
    right[rights] = ref;
    rights += side;
    lefts += !side;
  }
  return lefts;
}

static void bins_add_all(Bins *bins, const BinMap *m, const BuildRef *refs, uint32_t count)
{
  for (uint32_t i = 0; i < count; i++) bins_add(bins, m, &refs[i]);
}

// The same, in place by way of `spare`, and each goes into its child's bins while it is at hand.
static uint32_t part_and_bin(const Range *r, const Range child[2], BuildRef *refs, uint32_t count, BuildRef *spare,
                             Bins bins[2])
{
  bins_clear(&bins[0], bin_count(&child[0].map));
  bins_clear(&bins[1], bin_count(&child[1].map));
  uint32_t lefts = 0, rights = 0;
  for (uint32_t at = 0; at < count; at += 256) {
    const uint32_t n = count - at < 256 ? count - at : 256;
    const uint32_t left = part(r, refs + at, n, refs + lefts, spare + rights);
    bins_add_all(&bins[0], &child[0].map, refs + lefts, left);
    bins_add_all(&bins[1], &child[1].map, spare + rights, n - left);
    lefts += left;
    rights += n - left;
  }
  memcpy(refs + lefts, spare, rights * sizeof *refs);
  return lefts;
}

static Bounds refs_bounds(const BuildRef *refs, size_t count)
{
  Bounds b = bounds_empty();
  for (size_t i = 0; i < count; i++) bounds_add(&b, &refs[i]);
  return b;
}

// No plane separates the centres, or the tree has become too deep for choice: half of them each, as they lie.
static void split_in_half(const Build *b, Range *r, Range child[2])
{
  r->split = (Split){.axis = 0, .left_count = r->count - r->count / 2};
  for (int side = 0; side < 2; side++) {
    const BuildRef *refs = b->refs + r->first + (side ? r->split.left_count : 0);
    r->split.box[side] = refs_bounds(refs, side ? r->count / 2 : r->split.left_count);
  }
  child_ranges(r, child);
  for (int side = 0; side < 2; side++) {
    child[side].map = bin_map(2 * child[side].box.lo, 2 * child[side].box.hi, child[side].count);
  }
}

// Splits a range by one thread and chooses the splits of its children.
static void split_range(const Build *b, Range *r, Range child[2], Scratch *s)
{
  BuildRef *refs = b->refs + r->first;
  if (r->split.axis < 0 || r->depth >= MOST_SPLIT_DEPTH) {
    split_in_half(b, r, child);
    for (int side = 0; side < 2; side++) {
      if (!needs_split(&child[side])) continue;
      bins_fill(&s->bins[side], &child[side].map, b->refs + child[side].first, child[side].count);
      choose_split(b, &child[side], &s->bins[side]);
    }
    return;
  }
  child_ranges(r, child);
  if (!needs_split(&child[0]) && !needs_split(&child[1])) {
    const uint32_t lefts = part(r, refs, r->count, refs, s->room.spare);
    memcpy(refs + lefts, s->room.spare, (r->count - lefts) * sizeof *refs);
    return;
  }
  part_and_bin(r, child, refs, r->count, s->room.spare, s->bins);
  for (int side = 0; side < 2; side++) {
    if (needs_split(&child[side])) choose_split(b, &child[side], &s->bins[side]);
  }
}

// --- subtrees, side by side ---------------------------------------------------------------------

// Depth first with a stack of our own: one range off, two on. False: no memory, or cancelled.
static bool split_subtree(const Build *b, const Range *root, BinaryTree *t, Scratch *s)
{
  Range stack[MOST_BINARY_DEPTH + 2];
  int height = 0;
  stack[height++] = *root;
  while (height > 0) {
    Range r = stack[--height];
    if (is_cancelled(b->cancel)) return false;
    if (r.count <= b->leaf_size) {
      node_fill_leaf(b, &t->items[r.node], r.first, r.count);
    } else if (r.count <= SMALL && r.depth < MOST_SPLIT_DEPTH) {
      if (!small_split(b, t, r.node, r.first, r.count)) return false;
    } else {
      split_range(b, &r, &stack[height], s);
      if (!add_children(t, &r, &stack[height])) return false;
      height += 2;
    }
  }
  return true;
}

static void subtree_work(void *user, size_t item, int worker)
{
  Splitter *s = user;
  Range r = s->subtrees.items[item];
  Subtree *sub = &s->build->top->subtrees.items[item];
  Scratch *own = scratch_of(s, worker, r.count, 0);
  bool ok = own && array_reserve(&sub->tree, 3 * (size_t)r.count / s->build->leaf_size + 8);
  if (ok) {
    r.node = 0;
    sub->tree.count = 1;
    node_set_box(&sub->tree.items[0], &r.box);
    ok = split_subtree(s->build, &r, &sub->tree, own);
  }
  ok = ok && (own = scratch_of(s, worker, 0, sub->tree.count));
  if (ok) {
    wide_collapse(s->build, &sub->tree, own->room.cost, false);
    memcpy(sub->cost, own->room.cost[0], sizeof sub->cost);
  } else {
    atomic_store_explicit(&s->is_out_of_memory, true, memory_order_relaxed);
  }
}

// --- large ranges, by all threads ---------------------------------------------------------------

static bool cut_into_chunks(Splitter *s)
{
  size_t count = 0;
  for (size_t i = 0; i < s->level.count; i++) count += (s->level.items[i].count + CHUNK - 1) / CHUNK;
  if (!array_reserve(&s->chunks, count)) return false;
  s->chunks.count = 0;
  for (size_t i = 0; i < s->level.count; i++) {
    const Range *r = &s->level.items[i];
    for (uint32_t at = 0; at < r->count; at += CHUNK) {
      Chunk *c = &s->chunks.items[s->chunks.count++];
      c->range = (uint32_t)i;
      c->first = r->first + at;
      c->count = r->count - at < CHUNK ? r->count - at : CHUNK;
    }
  }
  return true;
}

static void chunk_work(void *user, size_t item, int worker)
{
  Splitter *s = user;
  Chunk *c = &s->chunks.items[item];
  const Range *r = &s->level.items[c->range];
  BuildRef *refs = s->build->refs + c->first;
  if (r->split.axis < 0) {
    bins_fill(&c->bins[0], &r->map, refs, c->count);
    return;
  }
  const Scratch *own = scratch_of(s, worker, CHUNK, 0);
  if (!own) return;
  Range child[2];
  child_ranges(r, child);
  c->left_count = part_and_bin(r, child, refs, c->count, own->room.spare, c->bins);
}

static void swap_work(void *user, size_t item, int worker)
{
  (void)worker;
  const Splitter *s = user;
  const Swap *w = &s->swaps.items[item];
  BuildRef *a = s->build->refs + w->a, *b = s->build->refs + w->b;
  for (uint32_t i = 0; i < w->count; i++) {
    const BuildRef moved = a[i];
    a[i] = b[i];
    b[i] = moved;
  }
}

// The references of a chunk that lie on the wrong side of the middle: its right ones below, its left ones above.
static Swap misplaced(const Chunk *c, uint32_t middle, bool is_below)
{
  const uint32_t cut = c->first + c->left_count, end = c->first + c->count;
  const uint32_t from = is_below ? cut : c->first > middle ? c->first : middle;
  const uint32_t to = is_below ? (end < middle ? end : middle) : cut;
  return (Swap){from, from, to > from ? to - from : 0};
}

// Pairs the misplaced runs of a range's chunks; there are as many on either side of the middle.
static bool plan_swaps(Splitter *s, const Chunk *chunks, size_t chunk_count, uint32_t middle)
{
  size_t i = 0, j = 0;
  Swap below = {0}, above = {0};
  for (;;) {
    while (below.count == 0 && i < chunk_count) below = misplaced(&chunks[i++], middle, true);
    while (above.count == 0 && j < chunk_count) above = misplaced(&chunks[j++], middle, false);
    if (below.count == 0 || above.count == 0) return true;
    const uint32_t count = below.count < above.count ? below.count : above.count;
    if (!array_push(&s->swaps, (Swap){below.a, above.a, count})) return false;
    below.a += count;
    below.count -= count;
    above.a += count;
    above.count -= count;
  }
}

// A range goes on among the large ones, or alone: when it is small, or has nothing left to choose.
static bool queue_range(Splitter *s, const Range *r)
{
  const bool is_large = r->count > s->subtree_size && r->depth < MOST_SPLIT_DEPTH;
  return is_large ? array_push(&s->next, *r) : array_push(&s->subtrees, *r);
}

// Chooses a split from the bins, or asks for better ones: its axis is -1 then.
static bool queue_binned(Splitter *s, Range *r, Bins *bins)
{
  if (needs_split(r)) {
    const bool is_again = r->new_bins < MOST_NEW_BINS && bins_are_wasted(bins, &r->map, r->count);
    r->new_bins++;
    if (!is_again) r->split = bins_split(s->build, bins, &r->map, &r->box);
    if (!is_again && r->split.axis < 0) return array_push(&s->subtrees, *r);
  }
  return queue_range(s, r);
}

// Takes a range's chunks together.
static bool finish_range(Splitter *s, Range *r, Chunk *chunks, size_t chunk_count)
{
  Bins *bins = chunks[0].bins;
  if (r->split.axis < 0) {
    for (size_t i = 1; i < chunk_count; i++) bins_merge(&bins[0], &chunks[i].bins[0], bin_count(&r->map));
    return queue_binned(s, r, &bins[0]);
  }
  Range child[2];
  child_ranges(r, child);
  if (!add_children(&s->build->top->tree, r, child)) return false;
  for (int side = 0; side < 2; side++) {
    const int n = bin_count(&child[side].map);
    for (size_t i = 1; i < chunk_count; i++) bins_merge(&bins[side], &chunks[i].bins[side], n);
    if (!queue_binned(s, &child[side], &bins[side])) return false;
  }
  return plan_swaps(s, chunks, chunk_count, child[1].first);
}

static bool split_level(Splitter *s)
{
  Build *b = s->build;
  if (!cut_into_chunks(s) || !jobs_run(b->jobs, s->chunks.count, chunk_work, s, b->cancel)) return false;
  if (atomic_load_explicit(&s->is_out_of_memory, memory_order_relaxed)) return false;
  s->next.count = s->swaps.count = 0;
  Chunk *c = s->chunks.items;
  for (size_t i = 0; i < s->level.count; i++) {
    Range *r = &s->level.items[i];
    const size_t count = (r->count + CHUNK - 1) / CHUNK;
    if (!finish_range(s, r, c, count)) return false;
    c += count;
  }
  if (!jobs_run(b->jobs, s->swaps.count, swap_work, s, b->cancel)) return false;
  const Ranges done = s->level;
  s->level = s->next;
  s->next = done;
  return true;
}

// --- all of it ----------------------------------------------------------------------------------

typedef struct Measure {
  const Build *build;
  struct {
    Bounds box, centers;
  } *parts; // one a chunk
} Measure;

static void measure_work(void *user, size_t item, int worker)
{
  (void)worker;
  Measure *m = user;
  const size_t first = item * CHUNK, left = m->build->count - first, count = left < CHUNK ? left : CHUNK;
  Bounds box = bounds_empty(), centers = bounds_empty();
  for (size_t i = first; i < first + count; i++) {
    bounds_add(&box, &m->build->refs[i]);
    bounds_add_point(&centers, ref_center(&m->build->refs[i]));
  }
  m->parts[item].box = box;
  m->parts[item].centers = centers;
}

// The range of all references.
static bool measure_all(const Build *b, Range *all)
{
  const size_t chunks = (b->count + CHUNK - 1) / CHUNK;
  Measure m = {b, mem_alloc(chunks, sizeof *m.parts)};
  const bool ok = m.parts && jobs_run(b->jobs, chunks, measure_work, &m, b->cancel);
  Bounds centers = bounds_empty();
  *all = (Range){.count = (uint32_t)b->count, .box = bounds_empty(), .split.axis = -1};
  for (size_t c = 0; ok && c < chunks; c++) {
    bounds_add(&all->box, &m.parts[c].box);
    bounds_add(&centers, &m.parts[c].centers);
  }
  mem_free(m.parts);
  all->map = bin_map(centers.lo, centers.hi, b->count);
  return ok;
}

// The root, and large ranges level by level until all are small.
static bool split_top(Splitter *s)
{
  Build *b = s->build;
  BinaryTree *t = &b->top->tree;
  Range all;
  if (!measure_all(b, &all) || !array_reserve(t, 1)) return false;
  b->bounds = all.box;
  t->count = 1;
  node_set_box(&t->items[0], &all.box);
  if (all.count > SMALL ? !array_push(&s->level, all) : !array_push(&s->subtrees, all)) return false;
  while (s->level.count) {
    if (!split_level(s)) return false;
  }
  return true;
}

static bool split_subtrees(Splitter *s)
{
  BuildTop *top = s->build->top;
  if (!array_reserve(&top->subtrees, s->subtrees.count)) return false;
  top->subtrees.count = s->subtrees.count;
  memset(top->subtrees.items, 0, top->subtrees.count * sizeof *top->subtrees.items);
  for (size_t i = 0; i < s->subtrees.count; i++) {
    BinaryNode *n = &top->tree.items[s->subtrees.items[i].node];
    n->link = (uint32_t)i;
    n->bits = NODE_SUBTREE;
  }
  return jobs_run(s->build->jobs, s->subtrees.count, subtree_work, s, s->build->cancel) &&
         !atomic_load_explicit(&s->is_out_of_memory, memory_order_relaxed);
}

static bool split_all(Splitter *s)
{
  const Build *b = s->build;
  s->scratch = mem_zero(s->worker_count, sizeof *s->scratch);
  if (!s->scratch) return false;
  const size_t share = b->count / 64;
  s->subtree_size = (uint32_t)(share < LEAST_SUBTREE ? LEAST_SUBTREE : share > MOST_SUBTREE ? MOST_SUBTREE : share);
  return split_top(s) && split_subtrees(s);
}

static bool object_split(Build *b)
{
  Splitter s = {.build = b, .worker_count = (size_t)jobs_thread_count(b->jobs)};
  const bool ok = split_all(&s);
  splitter_finish(&s);
  return ok;
}

static bool top_init(Build *b)
{
  b->top = mem_zero(1, sizeof *b->top);
  if (b->top) b->top->prims = mem_alloc(b->room, sizeof *b->top->prims);
  return b->top && b->top->prims;
}

bool build_split(Build *b, Err *err)
{
  b->bounds = bounds_empty();
  if (b->count == 0) return true;
  bool ok = top_init(b) && (b->clip ? spatial_split(b) : object_split(b));
  mem_free(b->refs);
  b->refs = NULL;
  ok = ok && wide_plan(b);
  if (ok) return true;
  if (is_cancelled(b->cancel)) return err_set(err, ERR_CANCELLED, "building a tree was cancelled");
  return err_memory(err, "building a tree", (unsigned long long)b->count * sizeof(BuildRef));
}
