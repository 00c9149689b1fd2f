// See build.h. A Range is a run of references that will become one child. Small ranges are split in place by one
// thread; large ones by all, chunk by chunk, into the other buffer, keeping order. Both look at bins only, so it
// makes no difference to the tree's quality which one is used.
//
// Numbers chosen by building the fractal terrain of 1 M triangles and the city of 6 M of the benchmark set: 32 bins
// against 16 gave 1 % fewer nodes a ray; subtrees of 16 Ki references keep two and more threads busy to the end.

#include "accel/build.h"

#include "base/array.h"

enum {
  MOST_BINS = 32,
  CHUNK = 1 << 14,         // references a work item
  TOGETHER = 4 * CHUNK,    // from this size on a range is split by all threads
  SUBTREE = 1 << 14,       // up to this size a range is one thread's
  SMALL_LEAF_SHARE = 1,    // leaves over leaf_size / this are still split while a node has lanes free
};

typedef struct Range {
  BuildRef *refs; // where in which buffer
  size_t count;
  Bounds box, centers; // of the references, and of their boxes' centres
  double area;
} Range;

typedef struct Bins {
  Bounds box[3][MOST_BINS];
  uint32_t count[3][MOST_BINS];
} Bins;

// How centres map to bins: axis k, bin (center - lo) * scale, where scale 0 marks an axis of no use.
typedef struct BinMap {
  Vec3 lo, scale;
  int count;
} BinMap;

typedef struct Split {
  int axis, bin; // left: bins below this one; axis -1: no plane found
} Split;

typedef struct Subtree {
  Range range;
  int depth;
  ARRAY(Node8) nodes; // child: index of a node, or LEAF_BIT and the offset of its references in the range
  size_t leaf_count, first_node, first_leaf;
  uint32_t root; // child code, known after emitting
  bool failed;
} Subtree;

// The nodes above the subtrees. A child is a top node, or LEAF_BIT and the number of a subtree.
typedef struct BuildTop {
  ARRAY(Node8) nodes;
  ARRAY(Subtree) subtrees;
  uint32_t root;
  Bins *chunk_bins; // one a chunk, for splits by all threads
} BuildTop;

bool build_init(Build *b, size_t count, Err *err)
{
  b->count = count;
  if (!b->leaf_size) b->leaf_size = 8;
  if (count == 0) return true;
  b->refs = mem_alloc(count, sizeof *b->refs);
  if (count >= TOGETHER) b->spare = mem_alloc(count, sizeof *b->spare);
  if (b->refs && (b->spare || count < TOGETHER)) return true;
  return err_memory(err, "building a tree", (unsigned long long)count * sizeof *b->refs);
}

void build_finish(Build *b)
{
  if (b->top) {
    for (size_t i = 0; i < b->top->subtrees.count; i++) array_finish(&b->top->subtrees.items[i].nodes);
    array_finish(&b->top->subtrees);
    array_finish(&b->top->nodes);
    mem_free(b->top->chunk_bins);
    mem_free(b->top);
  }
  mem_free(b->refs);
  mem_free(b->spare);
  *b = (Build){0};
}

// --- bins ---------------------------------------------------------------------------------------

static inline Vec3 ref_center(const BuildRef *r) { return 0.5f * r->lo + 0.5f * r->hi; } // halves do not overflow

static void bins_clear(Bins *bins, int count)
{
  for (int k = 0; k < 3; k++) {
    for (int i = 0; i < count; i++) {
      bins->box[k][i] = bounds_empty();
      bins->count[k][i] = 0;
    }
  }
}

static BinMap bin_map(const Range *r)
{
  BinMap m = {r->centers.lo, v3_all(0), r->count < 64 ? 8 : r->count < 1024 ? 16 : MOST_BINS};
  for (int k = 0; k < 3; k++) {
    const float extent = r->centers.hi[k] - r->centers.lo[k];
    const float scale = (float)m.count / extent;
    if (extent > 0 && isfinite(extent) && isfinite(scale)) m.scale[k] = scale;
  }
  return m;
}

static inline int bin_of(const BinMap *m, float center, int k)
{
  const int i = m->scale[k] > 0 ? (int)((center - m->lo[k]) * m->scale[k]) : 0;
  return i < m->count ? i : m->count - 1;
}

static void bins_add(Bins *bins, const BinMap *m, const BuildRef *refs, size_t count)
{
  for (size_t i = 0; i < count; i++) {
    const Vec3 c = ref_center(&refs[i]);
    for (int k = 0; k < 3; k++) {
      const int bin = bin_of(m, c[k], k);
      bounds_add(&bins->box[k][bin], &refs[i]);
      bins->count[k][bin]++;
    }
  }
}

static void bins_merge(Bins *bins, const Bins *other, int count)
{
  for (int k = 0; k < 3; k++) {
    for (int i = 0; i < count; i++) {
      bounds_add(&bins->box[k][i], &other->box[k][i]);
      bins->count[k][i] += other->count[k][i];
    }
  }
}

// Leaves are tested a block at a time, so a range costs its blocks.
static double blocks_of(const Build *b, size_t count) { return (double)((count + b->leaf_size - 1) / b->leaf_size); }

static Split best_split(const Build *b, const Bins *bins, const BinMap *m)
{
  Split best = {-1, 0};
  double best_cost = INFINITY;
  for (int k = 0; k < 3; k++) {
    if (m->scale[k] <= 0) continue;
    double right_cost[MOST_BINS];
    Bounds box = bounds_empty();
    size_t count = 0;
    for (int i = m->count - 1; i > 0; i--) {
      bounds_add(&box, &bins->box[k][i]);
      count += bins->count[k][i];
      right_cost[i] = count ? bounds_half_area(&box) * blocks_of(b, count) : -1;
    }
    box = bounds_empty();
    count = 0;
    for (int i = 1; i < m->count; i++) {
      bounds_add(&box, &bins->box[k][i - 1]);
      count += bins->count[k][i - 1];
      if (!count || right_cost[i] < 0) continue;
      const double cost = bounds_half_area(&box) * blocks_of(b, count) + right_cost[i];
      if (cost < best_cost) {
        best_cost = cost;
        best = (Split){k, i};
      }
    }
  }
  return best;
}

// --- splitting one range ------------------------------------------------------------------------

static Range range_empty(BuildRef *refs)
{
  return (Range){refs, 0, bounds_empty(), bounds_empty(), 0};
}

static inline void range_grow(Range *r, const BuildRef *ref)
{
  bounds_add(&r->box, ref);
  bounds_add_point(&r->centers, ref_center(ref));
}

static void range_measure(Range *r)
{
  r->box = r->centers = bounds_empty();
  for (size_t i = 0; i < r->count; i++) range_grow(r, &r->refs[i]);
  r->area = bounds_half_area(&r->box);
}

// No plane separates the centres, or the tree has become too deep for choice: half of them each, as they lie.
static void split_in_half(const Range *r, Range out[2])
{
  out[0] = range_empty(r->refs);
  out[0].count = r->count - r->count / 2;
  out[1] = range_empty(r->refs + out[0].count);
  out[1].count = r->count / 2;
  range_measure(&out[0]);
  range_measure(&out[1]);
}

static inline bool is_left(const BinMap *m, Split s, const BuildRef *ref)
{
  return bin_of(m, ref_center(ref)[s.axis], s.axis) < s.bin;
}

static void partition_in_place(const Range *r, const BinMap *m, Split s, Range out[2])
{
  Range left = range_empty(r->refs), right = range_empty(NULL);
  BuildRef *i = r->refs, *end = r->refs + r->count;
  while (i < end) {
    if (is_left(m, s, i)) {
      range_grow(&left, i++);
      continue;
    }
    const BuildRef moved = *i;
    range_grow(&right, &moved);
    *i = *--end;
    *end = moved;
  }
  left.count = (size_t)(i - r->refs);
  right.refs = i;
  right.count = r->count - left.count;
  out[0] = left;
  out[1] = right;
}

// What the threads share while they split one large range.
typedef struct Together {
  const Build *build;
  const Range *range;
  const BinMap *map;
  Split split;
  Bins *bins;         // one a chunk
  BuildRef *target;   // the range's place in the other buffer
  size_t *left_count; // one a chunk: how many go left, then how many did before it
  Range *parts;       // two a chunk
} Together;

static size_t chunk_size(const Range *r, size_t chunk)
{
  return r->count - chunk * CHUNK < CHUNK ? r->count - chunk * CHUNK : CHUNK;
}

static void bin_chunk(void *user, size_t chunk, int worker)
{
  (void)worker;
  Together *t = user;
  bins_clear(&t->bins[chunk], t->map->count);
  bins_add(&t->bins[chunk], t->map, t->range->refs + chunk * CHUNK, chunk_size(t->range, chunk));
}

static void move_chunk(void *user, size_t chunk, int worker)
{
  (void)worker;
  Together *t = user;
  const BuildRef *refs = t->range->refs + chunk * CHUNK;
  const size_t before = t->left_count[chunk], all_left = t->left_count[(t->range->count + CHUNK - 1) / CHUNK];
  BuildRef *left = t->target + before, *right = t->target + all_left + (chunk * CHUNK - before);
  Range parts[2] = {range_empty(NULL), range_empty(NULL)};
  for (size_t i = 0, n = chunk_size(t->range, chunk); i < n; i++) {
    const bool goes_left = is_left(t->map, t->split, &refs[i]);
    range_grow(&parts[!goes_left], &refs[i]);
    *(goes_left ? left++ : right++) = refs[i];
  }
  memcpy(&t->parts[2 * chunk], parts, sizeof parts);
}

// Splits by all threads: bins of each chunk, then each chunk's references to their place in the other buffer. Needs
// scratch for the chunks; false when there is no memory or on cancel.
static bool split_together(Build *b, const Range *r, const BinMap *m, Range out[2], bool *found)
{
  const size_t chunks = (r->count + CHUNK - 1) / CHUNK;
  Together t = {.build = b, .range = r, .map = m, .bins = b->top->chunk_bins};
  if (!jobs_run(b->jobs, chunks, bin_chunk, &t, b->cancel)) return false;
  t.left_count = mem_alloc(chunks + 1, sizeof *t.left_count);
  t.parts = mem_alloc(2 * chunks, sizeof *t.parts);
  bool ok = t.left_count && t.parts;
  if (!ok) goto done;

  size_t left = 0;
  Bins sum = t.bins[0];
  for (size_t c = 1; c < chunks; c++) bins_merge(&sum, &t.bins[c], m->count);
  t.split = best_split(b, &sum, m);
  *found = t.split.axis >= 0;
  if (!*found) goto done;
  for (size_t c = 0; c < chunks; c++) {
    t.left_count[c] = left;
    for (int i = 0; i < t.split.bin; i++) left += t.bins[c].count[t.split.axis][i];
  }
  t.left_count[chunks] = left;
  const bool is_in_refs = r->refs >= b->refs && r->refs < b->refs + b->count;
  t.target = is_in_refs ? b->spare + (r->refs - b->refs) : b->refs + (r->refs - b->spare);
  ok = jobs_run(b->jobs, chunks, move_chunk, &t, b->cancel);
  if (!ok) goto done;

  for (int side = 0; side < 2; side++) {
    out[side] = range_empty(t.target + (side ? left : 0));
    out[side].count = side ? r->count - left : left;
    for (size_t c = 0; c < chunks; c++) {
      bounds_add(&out[side].box, &t.parts[2 * c + side].box);
      bounds_add(&out[side].centers, &t.parts[2 * c + side].centers);
    }
  }
done:
  mem_free(t.left_count);
  mem_free(t.parts);
  return ok;
}

// b->top->chunk_bins is set while the top is split, and only then may threads work together on one range.
static bool split_range(Build *b, const Range *r, bool in_half, Range out[2])
{
  bool found = false;
  if (!in_half) {
    const BinMap m = bin_map(r);
    if (r->count >= TOGETHER) {
      if (!split_together(b, r, &m, out, &found)) return false;
    } else {
      Bins bins;
      bins_clear(&bins, m.count);
      bins_add(&bins, &m, r->refs, r->count);
      const Split s = best_split(b, &bins, &m);
      found = s.axis >= 0;
      if (found) partition_in_place(r, &m, s, out);
    }
  }
  if (!found) split_in_half(r, out);
  out[0].area = bounds_half_area(&out[0].box);
  out[1].area = bounds_half_area(&out[1].box);
  return true;
}

// --- nodes --------------------------------------------------------------------------------------

// The child to split next: the one of largest area among those that must be split, then among those that may; when
// splitting in half, the one with most references. -1: none.
static int next_child(const Build *b, const Range *children, int count, bool in_half)
{
  const size_t limits[2] = {b->leaf_size, b->leaf_size / SMALL_LEAF_SHARE};
  for (int round = 0; round < 2; round++) {
    int best = -1;
    for (int i = 0; i < count; i++) {
      if (children[i].count <= limits[round] || children[i].count < 2) continue;
      if (best < 0 || (in_half ? children[i].count > children[best].count : children[i].area > children[best].area)) {
        best = i;
      }
    }
    if (best >= 0) return best;
  }
  return -1;
}

// Cuts the range into at most eight children. Returns how many; 0: no memory or cancelled.
static int split_children(Build *b, const Range *r, int depth, Range children[8])
{
  const bool in_half = depth >= MOST_SAH_DEPTH;
  int count = 1;
  children[0] = *r;
  while (count < 8) {
    const int i = next_child(b, children, count, in_half);
    if (i < 0) break;
    Range out[2];
    if (!split_range(b, &children[i], in_half, out)) return 0;
    children[i] = out[0];
    children[count++] = out[1];
  }
  return count;
}

static Node8 node_of(const Range *children, int count)
{
  Node8 n = {0};
  for (int i = 0; i < 8; i++) {
    const Bounds box = i < count ? children[i].box : bounds_empty();
    for (int k = 0; k < 3; k++) {
      n.box[2 * k][i] = box.lo[k];
      n.box[2 * k + 1][i] = box.hi[k];
    }
    n.child[i] = EMPTY_TREE;
  }
  return n;
}

// A range still to become a node, and the lane that waits for its number.
typedef struct Pending {
  Range range;
  size_t node;
  int lane, depth;
} Pending;

// Depth first with a stack of our own: one entry off, at most eight on, MOST_DEPTH levels (see tree.h).
static void split_subtree(void *user, size_t item, int worker)
{
  (void)worker;
  Build *b = user;
  Subtree *s = &b->top->subtrees.items[item];
  if (s->range.count <= b->leaf_size) {
    s->leaf_count = 1;
    return;
  }
  Pending stack[STACK_SIZE];
  int height = 0;
  stack[height++] = (Pending){s->range, SIZE_MAX, 0, s->depth};
  while (height > 0 && !is_cancelled(b->cancel)) {
    const Pending p = stack[--height];
    Range children[8];
    const int count = split_children(b, &p.range, p.depth, children);
    const size_t node_i = s->nodes.count;
    s->failed = count == 0 || !array_push(&s->nodes, node_of(children, count));
    if (s->failed) return;
    if (p.node != SIZE_MAX) s->nodes.items[p.node].child[p.lane] = (uint32_t)node_i;
    for (int i = count - 1; i >= 0; i--) {
      if (children[i].count > b->leaf_size) {
        stack[height++] = (Pending){children[i], node_i, i, p.depth + 1};
        continue;
      }
      s->nodes.items[node_i].child[i] = LEAF_BIT | (uint32_t)(children[i].refs - s->range.refs);
      s->nodes.items[node_i].count[i] = (uint8_t)children[i].count;
      s->leaf_count++;
    }
  }
}

// The nodes above the subtrees, in order of depth; each child is queued as a node or set aside as a subtree.
static bool split_top(Build *b, const Range *all)
{
  BuildTop *top = b->top;
  ARRAY(Pending) queue = {0};
  bool ok = array_push(&queue, (Pending){*all, SIZE_MAX, 0, 0});
  for (size_t q = 0; ok && q < queue.count; q++) {
    const Pending p = queue.items[q];
    uint32_t code;
    if (p.range.count <= SUBTREE) {
      code = LEAF_BIT | (uint32_t)top->subtrees.count;
      ok = array_push(&top->subtrees, (Subtree){.range = p.range, .depth = p.depth});
    } else {
      Range children[8];
      const int count = split_children(b, &p.range, p.depth, children);
      code = (uint32_t)top->nodes.count;
      ok = count > 0 && array_push(&top->nodes, node_of(children, count));
      for (int i = 0; ok && i < count; i++) {
        ok = array_push(&queue, (Pending){children[i], code, i, p.depth + 1});
      }
    }
    if (!ok) break;
    if (p.node == SIZE_MAX) {
      top->root = code;
    } else {
      top->nodes.items[p.node].child[p.lane] = code;
    }
  }
  array_finish(&queue);
  return ok;
}

static void measure_chunk(void *user, size_t chunk, int worker)
{
  (void)worker;
  Together *t = user;
  Range part = range_empty(t->range->refs + chunk * CHUNK);
  part.count = chunk_size(t->range, chunk);
  range_measure(&part);
  t->parts[chunk] = part;
}

static bool measure_all(Build *b, Range *all)
{
  const size_t chunks = (b->count + CHUNK - 1) / CHUNK;
  Together t = {.range = all, .parts = mem_alloc(chunks, sizeof *t.parts)};
  const bool ok = t.parts && jobs_run(b->jobs, chunks, measure_chunk, &t, b->cancel);
  for (size_t c = 0; ok && c < chunks; c++) {
    bounds_add(&all->box, &t.parts[c].box);
    bounds_add(&all->centers, &t.parts[c].centers);
  }
  mem_free(t.parts);
  all->area = bounds_half_area(&all->box);
  return ok;
}

static bool build_failed(const Build *b, Err *err)
{
  if (is_cancelled(b->cancel)) return err_set(err, ERR_CANCELLED, "building a tree was cancelled");
  return err_memory(err, "building a tree", (unsigned long long)b->count * sizeof(BuildRef));
}

bool build_split(Build *b, Err *err)
{
  b->bounds = bounds_empty();
  if (b->count == 0) return true;
  b->top = mem_zero(1, sizeof *b->top);
  Range all = range_empty(b->refs);
  all.count = b->count;
  if (!b->top || !measure_all(b, &all)) return build_failed(b, err);
  b->bounds = all.box;
  if (b->count >= TOGETHER) {
    b->top->chunk_bins = mem_alloc((b->count + CHUNK - 1) / CHUNK, sizeof(Bins));
    if (!b->top->chunk_bins) return build_failed(b, err);
  }
  const bool ok = split_top(b, &all) && jobs_run(b->jobs, b->top->subtrees.count, split_subtree, b, b->cancel);
  if (!ok) return build_failed(b, err);

  b->node_count = b->top->nodes.count;
  b->leaf_count = 0;
  for (size_t i = 0; i < b->top->subtrees.count; i++) {
    Subtree *s = &b->top->subtrees.items[i];
    if (s->failed) return build_failed(b, err);
    s->first_node = b->node_count;
    s->first_leaf = b->leaf_count;
    b->node_count += s->nodes.count;
    b->leaf_count += s->leaf_count;
  }
  return true;
}

// --- emitting -----------------------------------------------------------------------------------

typedef struct Emit {
  const Build *build;
  Node8 *nodes;
  LeafEmit *emit;
  void *user;
} Emit;

static void emit_subtree(void *user, size_t item, int worker)
{
  (void)worker;
  const Emit *e = user;
  Subtree *s = &e->build->top->subtrees.items[item];
  if (s->nodes.count == 0) {
    s->root = LEAF_BIT | e->emit(e->user, s->first_leaf, s->range.refs, (uint32_t)s->range.count);
    return;
  }
  s->root = (uint32_t)s->first_node;
  size_t leaf_i = s->first_leaf;
  for (size_t i = 0; i < s->nodes.count; i++) {
    Node8 n = s->nodes.items[i];
    for (int lane = 0; lane < 8; lane++) {
      if (n.child[lane] == EMPTY_TREE) continue;
      if (n.child[lane] & LEAF_BIT) {
        const BuildRef *refs = s->range.refs + (n.child[lane] & ~LEAF_BIT);
        n.child[lane] = LEAF_BIT | e->emit(e->user, leaf_i++, refs, n.count[lane]);
      } else {
        n.child[lane] += (uint32_t)s->first_node;
      }
    }
    e->nodes[s->first_node + i] = n;
  }
}

uint32_t build_emit(Build *b, Node8 *nodes, LeafEmit *emit, void *user)
{
  if (b->count == 0) return EMPTY_TREE;
  const BuildTop *top = b->top;
  Emit e = {b, nodes, emit, user};
  jobs_run(b->jobs, top->subtrees.count, emit_subtree, &e, NULL);
  for (size_t i = 0; i < top->nodes.count; i++) {
    nodes[i] = top->nodes.items[i];
    for (int lane = 0; lane < 8; lane++) {
      const uint32_t code = nodes[i].child[lane];
      if (code == EMPTY_TREE || !(code & LEAF_BIT)) continue;
      const Subtree *s = &top->subtrees.items[code & ~LEAF_BIT];
      nodes[i].child[lane] = s->root;
      if (s->root & LEAF_BIT) nodes[i].count[lane] = (uint8_t)s->range.count;
    }
  }
  return top->root & LEAF_BIT ? top->subtrees.items[top->root & ~LEAF_BIT].root : top->root;
}
