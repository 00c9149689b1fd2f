// Spatial splits: a range of references is split by objects, as in build.c, or by a plane in space, which cuts the
// references it passes through in two (Stich, Friedrich, Dietrich, "Spatial splits in bounding volume hierarchies",
// HPG 2009). What lies in a piece is found by the caller's RefClip, from the whole primitive: a piece's box is what all
// planes that made it have in common, and its rounding does not add up.
//
// Why no hit is lost: a hit is a point of the triangle and a box about it (tri_slack in geom/triangle.h), which the ray
// must meet. Whichever planes cut the triangle, the point lies on one side or the other of each, and so in one of the
// pieces; that piece's box contains the point's box, since each of its planes left a margin wide enough for that
// (tri_margin); and box tests are monotone, so a ray that meets the point's box meets those of all nodes on the way.
//
// References grow in place. A range has room behind it, which its parent shared out by the number of references:
//
//   refs   | left ......... room | right ............... room |
//
// so that threads need not ask each other, and the tree depends on the references alone. Large ranges are split level
// by level, each by one thread; from `subtree_size` on a thread keeps what is below, as in build.c.

#include "accel/build_bins.h"
#include "accel/build_tree.h"

enum {
  SLABS = 16,              // bins a spatial split is chosen from
  LEAST_SUBTREE = 1 << 12, // a range of so many is one thread's to the end, ...
  MOST_SUBTREE = 1 << 16,  // ... of more too, if there are 64 such in all
};

// Pieces beyond the primitives themselves, as a share of these. In a furnished hall 0.15, 0.3, 0.6 gave 6.94, 6.91,
// 6.95 nodes a bounced ray, against 8.86 without pieces, and 59, 62, 65 bytes a triangle against 54.
#define MORE_ROOM 0.2f

// Spatial splits are tried where the sides of the best object split overlap by this much of the scene's surface: the
// paper's alpha. There, 1e-3, 1e-4 and 1e-5 gave the same counts to a hundredth; the larger, the sooner it is built.
#define LEAST_OVERLAP 1e-4f

// ... and by this share of the range's own surface. 0, 0.03, 0.1 built a terrain of a million triangles, which gains
// nothing, in 4.7, 1.4 and 1.1 s, and gave 8.1, 7.5, 8.3 nodes a camera's ray in the hall.
#define LEAST_SHARE 0.03f

// A spatial split must cost so much less than the best object split: costs are guessed as if large triangles never
// came to lie alone. 1, 0.95, 0.9, 0.85 gave 59, 58, 58, 56 bytes a triangle in the hall, and for random lines 2.7,
// 2.8, 2.9, 2.5 leaves at 7.0, 7.0, 6.9, 6.9 nodes.
#define MOST_COST 0.85f

// No more than child codes can number.
size_t spatial_room(size_t prim_count)
{
  const size_t most = (size_t)LEAF_BIT - 2, more = (size_t)((double)MORE_ROOM * (double)prim_count);
  return prim_count + more < most ? prim_count + more : most;
}

typedef struct Range {
  uint32_t first, count, room, node; // room: for how many references, count included
  int depth;
  Bounds box;
} Range;

typedef ARRAY(Range) Ranges;

// References between two neighbouring planes, along each axis: their boxes there, and how many begin and end there.
typedef struct Slabs {
  Vec3 lo, scale;
  Bounds box[3][SLABS];
  Int4 begin[SLABS], end[SLABS]; // lane: axis
} Slabs;

// A way to split a range. Boxes and counts of the sides are what is expected of it.
typedef struct Cut {
  bool is_spatial;
  int axis;    // -1: none found
  float plane; // of a spatial cut
  int bin;     // of an object cut: left are those whose centres are below it
  BinMap map;  // of an object cut
  float cost;
  Bounds box[2];
  uint32_t count[2];
} Cut;

typedef struct Scratch {
  Room room;
  Bins bins;
  Slabs slabs;
} Scratch;

// What threads share.
typedef struct Spatial {
  Build *build;
  Ranges level, children, subtrees; // children: two for each range of the level
  Scratch **scratch;                // one a worker, made by it
  size_t worker_count;
  float scale; // of areas: box_scale of everything
  float least_overlap;
  uint32_t subtree_size;
  atomic_bool is_out_of_memory, has_pieces;
} Spatial;

static float area_of(const Bounds *b, float scale)
{
  const Vec3 d = (b->hi - b->lo) * scale;
  return d[0] * (d[1] + d[2]) + d[1] * d[2];
}

static Bounds common(const Bounds *a, const Bounds *b)
{
  return (Bounds){lanes_max(a->lo, b->lo), lanes_min(a->hi, b->hi)};
}

static Bounds joint(const Bounds *a, const Bounds *b)
{
  return (Bounds){lanes_min(a->lo, b->lo), lanes_max(a->hi, b->hi)};
}

// --- object cuts --------------------------------------------------------------------------------

static float cut_cost(const Build *b, const Cut *c, float scale)
{
  const Bounds box[3] = {c->box[0], c->box[1], c->box[1]};
  const Int4 count = {(int)c->count[0], (int)c->count[1], (int)c->count[1], 0};
  const Vec3 cost = side_costs(b, box, count, scale);
  return cost[0] + cost[1];
}

static Cut object_cut(const Spatial *s, const Range *r, Bins *bins)
{
  const BuildRef *refs = s->build->refs + r->first;
  Bounds centers = bounds_empty();
  for (uint32_t i = 0; i < r->count; i++) bounds_add_point(&centers, ref_center(&refs[i]));
  Cut c = {.axis = -1, .cost = INFINITY, .map = bin_map(centers.lo, centers.hi, r->count)};
  bins_clear(bins, bin_count(&c.map));
  for (uint32_t i = 0; i < r->count; i++) bins_add(bins, &c.map, &refs[i]);
  const Split split = bins_split(s->build, bins, &c.map, &r->box);
  if (split.axis < 0) return c;
  c.axis = split.axis;
  c.bin = split.bin;
  memcpy(c.box, split.box, sizeof c.box);
  c.count[0] = split.left_count;
  c.count[1] = r->count - split.left_count;
  c.cost = cut_cost(s->build, &c, s->scale);
  return c;
}

// The area that a cut could save is that around the overlap; its face across the axis remains.
static bool sides_overlap(const Spatial *s, const Range *r, const Cut *c)
{
  const Bounds both = common(&c->box[0], &c->box[1]);
  const float least = max_f(s->least_overlap, LEAST_SHARE * area_of(&r->box, s->scale));
  const Vec3 d = (both.hi - both.lo) * s->scale;
  const float face = d[c->axis == 0 ? 1 : 0] * d[c->axis == 2 ? 1 : 2];
  return !bounds_is_empty(&both) && area_of(&both, s->scale) - face > least;
}

// --- spatial cuts -------------------------------------------------------------------------------

static float slab_plane(const Slabs *s, int axis, int i)
{
  return s->lo[axis] + (float)i / s->scale[axis];
}

static void slabs_clear(Slabs *s, const Bounds *box)
{
  s->lo = box->lo;
  for (int k = 0; k < 3; k++) {
    const float scale = (float)SLABS / (box->hi[k] - box->lo[k]);
    s->scale[k] = box->hi[k] > box->lo[k] && isfinite(scale) ? scale : 0;
    for (int i = 0; i < SLABS; i++) s->box[k][i] = bounds_empty();
  }
  s->scale[3] = 0;
  memset(s->begin, 0, sizeof s->begin);
  memset(s->end, 0, sizeof s->end);
}

static Int4 slabs_of(const Slabs *s, Vec3 p)
{
  const Vec3 x = lanes_max((p - s->lo) * s->scale, v3_all(0));
  return __builtin_convertvector(lanes_min(x, v3_all(SLABS - 1)), Int4);
}

// The piece of a reference between two planes.
static Bounds piece_of(const Build *b, const BuildRef *r, int axis, float lo, float hi)
{
  const Bounds piece = b->clip(b->clip_user, ref_prim(r), axis, lo, hi);
  return common(&piece, r);
}

static void slabs_add(Slabs *s, const Build *b, const BuildRef *r)
{
  const Vec3 none = {1, 1, 1, 0};
  const Int4 from = slabs_of(s, r->lo * none), to = slabs_of(s, r->hi * none);
  for (int k = 0; k < 3; k++) {
    s->begin[from[k]][k]++;
    s->end[to[k]][k]++;
    if (from[k] == to[k]) {
      bounds_add(&s->box[k][from[k]], r);
      continue;
    }
    for (int i = from[k]; i <= to[k]; i++) {
      const float lo = i == from[k] ? -INFINITY : slab_plane(s, k, i);
      const float hi = i == to[k] ? INFINITY : slab_plane(s, k, i + 1);
      const Bounds piece = piece_of(b, r, k, lo, hi);
      if (!bounds_is_empty(&piece)) bounds_add(&s->box[k][i], &piece);
    }
  }
}

// The best plane between slabs that makes no more references than there is room for.
static Cut slabs_cut(const Spatial *s, const Slabs *slabs, uint32_t room)
{
  Vec3 right[SLABS];
  Int4 rights[SLABS];
  Bounds box[3] = {bounds_empty(), bounds_empty(), bounds_empty()};
  Int4 count = {0};
  for (int i = SLABS - 1; i > 0; i--) {
    for (int k = 0; k < 3; k++) bounds_add(&box[k], &slabs->box[k][i]);
    count += slabs->end[i];
    right[i] = side_costs(s->build, box, count, s->scale);
    rights[i] = count;
  }
  Cut c = {.is_spatial = true, .axis = -1, .cost = INFINITY};
  int at = 0;
  for (int k = 0; k < 3; k++) box[k] = bounds_empty();
  count = (Int4){0};
  for (int i = 1; i < SLABS; i++) {
    for (int k = 0; k < 3; k++) bounds_add(&box[k], &slabs->box[k][i - 1]);
    count += slabs->begin[i - 1];
    const Vec3 cost = side_costs(s->build, box, count, s->scale) + right[i];
    for (int k = 0; k < 3; k++) {
      if (!(cost[k] < c.cost) || slabs->scale[k] <= 0 || (uint32_t)(count + rights[i])[k] > room) continue;
      c.cost = cost[k];
      c.axis = k;
      at = i;
    }
  }
  if (c.axis < 0) return c;
  c.plane = slab_plane(slabs, c.axis, at);
  c.box[0] = c.box[1] = bounds_empty();
  for (int i = 0; i < SLABS; i++) {
    bounds_add(&c.box[i >= at], &slabs->box[c.axis][i]);
    if (i < at)
      c.count[0] += (uint32_t)slabs->begin[i][c.axis];
    else
      c.count[1] += (uint32_t)slabs->end[i][c.axis];
  }
  return c;
}

static Cut spatial_cut(const Spatial *s, const Range *r, Slabs *slabs)
{
  const BuildRef *refs = s->build->refs + r->first;
  slabs_clear(slabs, &r->box);
  for (uint32_t i = 0; i < r->count; i++) slabs_add(slabs, s->build, &refs[i]);
  return slabs_cut(s, slabs, r->room);
}

// --- carrying it out ----------------------------------------------------------------------------

// The sides while references are dealt out: left ones where they come from, right ones to the spare.
typedef struct Sides {
  BuildRef *refs[2];
  uint32_t count[2];
  Bounds box[2];
} Sides;

static void give(Sides *sides, int side, const BuildRef *r)
{
  bounds_add(&sides->box[side], r);
  sides->refs[side][sides->count[side]++] = *r;
}

static BuildRef with_prim(const Bounds *box, const BuildRef *r)
{
  return ref_of(box, ref_prim(r));
}

// A reference on both sides of the plane: two pieces, unless it costs less to leave it whole and widen one side
// (section 4.4 of the paper). The cut's boxes and counts are kept up to date with what was decided. True when cut.
static bool give_straddler(const Spatial *s, Cut *c, Sides *sides, const BuildRef *r, bool has_room)
{
  const Bounds piece[2] = {piece_of(s->build, r, c->axis, -INFINITY, c->plane),
                           piece_of(s->build, r, c->axis, c->plane, INFINITY)};
  for (int side = 0; side < 2; side++) {
    if (!bounds_is_empty(&piece[!side])) continue;
    // Nothing on either side: a box that holds none of its triangle, which is not worth a case of its own.
    const BuildRef only = bounds_is_empty(&piece[side]) ? *r : with_prim(&piece[side], r);
    give(sides, side, &only);
    return false;
  }
  const float area[2] = {area_of(&c->box[0], s->scale), area_of(&c->box[1], s->scale)};
  const Bounds wide[2] = {joint(&c->box[0], r), joint(&c->box[1], r)};
  const float n[2] = {(float)c->count[0], (float)c->count[1]};
  const float whole[2] = {area_of(&wide[0], s->scale) * n[0] + area[1] * (n[1] - 1),
                          area[0] * (n[0] - 1) + area_of(&wide[1], s->scale) * n[1]};
  const int side = whole[1] < whole[0];
  if (has_room && area[0] * n[0] + area[1] * n[1] < whole[side]) {
    for (int i = 0; i < 2; i++) {
      const BuildRef half = with_prim(&piece[i], r);
      give(sides, i, &half);
    }
    return true;
  }
  c->box[side] = wide[side];
  c->count[!side]--;
  give(sides, side, r);
  return false;
}

static void deal_by_plane(Spatial *s, const Range *r, Cut *c, Sides *sides)
{
  const BuildRef *refs = s->build->refs + r->first;
  uint32_t left = r->room - r->count;
  for (uint32_t i = 0; i < r->count; i++) {
    const BuildRef ref = refs[i];
    if (ref.hi[c->axis] <= c->plane)
      give(sides, 0, &ref);
    else if (ref.lo[c->axis] >= c->plane)
      give(sides, 1, &ref);
    else
      left -= give_straddler(s, c, sides, &ref, left > 0);
  }
  if (left < r->room - r->count) atomic_store_explicit(&s->has_pieces, true, memory_order_relaxed);
}

static void deal_by_center(const Spatial *s, const Range *r, const Cut *c, Sides *sides)
{
  const BuildRef *refs = s->build->refs + r->first;
  for (uint32_t i = 0; i < r->count; i++) {
    const BuildRef ref = refs[i];
    const float center = ref.lo[c->axis] + ref.hi[c->axis];
    give(sides, (center - c->map.lo[c->axis]) * c->map.scale[c->axis] >= (float)c->bin, &ref);
  }
}

// As they lie, half of them each.
static void deal_in_half(const Spatial *s, const Range *r, Sides *sides)
{
  const BuildRef *refs = s->build->refs + r->first;
  for (uint32_t i = 0; i < r->count; i++) {
    const BuildRef ref = refs[i];
    give(sides, i >= r->count - r->count / 2, &ref);
  }
}

// Puts the right side behind the left one, and shares out the room that is left.
static void place_sides(const Spatial *s, const Range *r, const Sides *sides, Range child[2])
{
  const uint32_t total = sides->count[0] + sides->count[1], more = r->room - total;
  const uint32_t left_more = (uint32_t)((uint64_t)more * sides->count[0] / total);
  const uint32_t room[2] = {sides->count[0] + left_more, sides->count[1] + more - left_more};
  for (int side = 0; side < 2; side++) {
    child[side] = (Range){.first = r->first + (side ? room[0] : 0),
                          .count = sides->count[side],
                          .room = room[side],
                          .depth = r->depth + 1,
                          .box = sides->box[side]};
  }
  memcpy(s->build->refs + child[1].first, sides->refs[1], sides->count[1] * sizeof(BuildRef));
}

static bool may_be_cut(const Spatial *s, const Range *r)
{
  return r->room > r->count && r->depth < MOST_SPLIT_DEPTH && area_of(&r->box, s->scale) > s->least_overlap;
}

static Cut best_cut(const Spatial *s, const Range *r, Scratch *own)
{
  Cut c = {.axis = -1, .cost = INFINITY};
  if (r->depth >= MOST_SPLIT_DEPTH) return c;
  c = object_cut(s, r, &own->bins);
  if (!may_be_cut(s, r) || (c.axis >= 0 && !sides_overlap(s, r, &c))) return c;
  const Cut spatial = spatial_cut(s, r, &own->slabs);
  return spatial.axis >= 0 && spatial.cost < MOST_COST * c.cost ? spatial : c;
}

// Splits a range as the cut says. The spare has room for as many references as the range has.
static void split_range(Spatial *s, const Range *r, Cut *c, BuildRef *spare, Range child[2])
{
  const Sides none = {{s->build->refs + r->first, spare}, {0}, {bounds_empty(), bounds_empty()}};
  Sides sides = none;
  if (c->is_spatial)
    deal_by_plane(s, r, c, &sides);
  else if (c->axis >= 0)
    deal_by_center(s, r, c, &sides);
  else
    deal_in_half(s, r, &sides);
  if (!sides.count[0] || !sides.count[1]) { // a plane beyond them all, by rounding
    if (!sides.count[0]) memcpy(sides.refs[0], spare, sides.count[1] * sizeof *spare);
    sides = none;
    deal_in_half(s, r, &sides);
  }
  place_sides(s, r, &sides, child);
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

// --- subtrees, side by side ---------------------------------------------------------------------

// Room for so many references, and rows of cost. NULL: no memory.
static Scratch *scratch_of(Spatial *s, int worker, size_t spare_count, size_t cost_count)
{
  Scratch *own = s->scratch[worker];
  if (!own) own = s->scratch[worker] = mem_zero(1, sizeof *own);
  const bool ok = own && room_reserve(&own->room, spare_count, cost_count);
  if (!ok) atomic_store_explicit(&s->is_out_of_memory, true, memory_order_relaxed);
  return ok ? own : NULL;
}

// Depth first with a stack of our own: one range off, two on. False: no memory, or cancelled.
static bool split_subtree(Spatial *s, const Range *root, BinaryTree *t, Scratch *own)
{
  const Build *b = s->build;
  Range stack[MOST_BINARY_DEPTH + 2];
  int height = 0;
  stack[height++] = *root;
  while (height > 0) {
    const Range r = stack[--height];
    if (is_cancelled(b->cancel)) return false;
    if (r.count <= b->leaf_size) {
      node_fill_leaf(b, &t->items[r.node], r.first, r.count);
      continue;
    }
    const bool is_small = r.count <= SMALL && r.depth < MOST_SPLIT_DEPTH;
    Cut cut = {.axis = -1};
    if (!is_small || may_be_cut(s, &r)) cut = best_cut(s, &r, own);
    if (is_small && !cut.is_spatial) {
      if (!small_split(b, t, r.node, r.first, r.count)) return false;
      continue;
    }
    split_range(s, &r, &cut, own->room.spare, &stack[height]);
    if (!add_children(t, &r, &stack[height])) return false;
    height += 2;
  }
  return true;
}

static void subtree_work(void *user, size_t item, int worker)
{
  Spatial *s = user;
  Range r = s->subtrees.items[item];
  Subtree *sub = &s->build->top->subtrees.items[item];
  Scratch *own = scratch_of(s, worker, r.room, 0);
  bool ok = own && array_reserve(&sub->tree, 3 * (size_t)r.room / s->build->leaf_size + 8);
  if (ok) {
    r.node = 0;
    sub->tree.count = 1;
    node_set_box(&sub->tree.items[0], &r.box);
    ok = split_subtree(s, &r, &sub->tree, own);
    ok = ok && tree_reinsert(s->build, &sub->tree, MOST_BINARY_DEPTH - r.depth, r.first, r.room);
  }
  ok = ok && (own = scratch_of(s, worker, 0, sub->tree.count));
  if (ok) {
    wide_collapse(s->build, &sub->tree, own->room.cost, false);
    memcpy(sub->cost, own->room.cost[0], sizeof sub->cost);
  } else {
    atomic_store_explicit(&s->is_out_of_memory, true, memory_order_relaxed);
  }
}

static bool split_subtrees(Spatial *s)
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
  return jobs_run(s->build->jobs, s->subtrees.count, subtree_work, s, s->build->cancel);
}

// --- all of it ----------------------------------------------------------------------------------

static bool queue_range(Spatial *s, const Range *r)
{
  const bool is_large = r->count > s->subtree_size && r->depth < MOST_SPLIT_DEPTH;
  return is_large ? array_push(&s->level, *r) : array_push(&s->subtrees, *r);
}

static void level_work(void *user, size_t item, int worker)
{
  Spatial *s = user;
  const Range *r = &s->level.items[item];
  Scratch *own = scratch_of(s, worker, r->room, 0);
  if (!own) return;
  Cut cut = best_cut(s, r, own);
  split_range(s, r, &cut, own->room.spare, &s->children.items[2 * item]);
}

static bool split_level(Spatial *s)
{
  const Build *b = s->build;
  const size_t count = s->level.count;
  if (!array_reserve(&s->children, 2 * count)) return false;
  if (!jobs_run(b->jobs, count, level_work, s, b->cancel)) return false;
  if (atomic_load_explicit(&s->is_out_of_memory, memory_order_relaxed)) return false;
  for (size_t i = 0; i < count; i++) {
    if (!add_children(&b->top->tree, &s->level.items[i], &s->children.items[2 * i])) return false;
  }
  s->level.count = 0;
  for (size_t i = 0; i < 2 * count; i++) {
    if (!queue_range(s, &s->children.items[i])) return false;
  }
  return true;
}

static bool split_all(Spatial *s)
{
  Build *b = s->build;
  BinaryTree *t = &b->top->tree;
  s->scratch = mem_zero(s->worker_count, sizeof *s->scratch);
  if (!s->scratch || !array_reserve(t, 1)) return false;
  const size_t share = b->count / 64;
  s->subtree_size = (uint32_t)(share < LEAST_SUBTREE  ? LEAST_SUBTREE
                               : share > MOST_SUBTREE ? MOST_SUBTREE
                                                      : share);
  for (size_t i = 0; i < b->count; i++) bounds_add(&b->bounds, &b->refs[i]);
  s->scale = box_scale(&b->bounds);
  s->least_overlap = LEAST_OVERLAP * area_of(&b->bounds, s->scale);
  t->count = 1;
  node_set_box(&t->items[0], &b->bounds);
  const Range all = {.count = (uint32_t)b->count, .room = (uint32_t)b->room, .box = b->bounds};
  if (!queue_range(s, &all)) return false;
  while (s->level.count) {
    if (!split_level(s)) return false;
  }
  return split_subtrees(s) && !atomic_load_explicit(&s->is_out_of_memory, memory_order_relaxed);
}

static void spatial_finish(Spatial *s)
{
  for (size_t i = 0; s->scratch && i < s->worker_count; i++) {
    if (!s->scratch[i]) continue;
    room_finish(&s->scratch[i]->room);
    mem_free(s->scratch[i]);
  }
  mem_free(s->scratch);
  array_finish(&s->level);
  array_finish(&s->children);
  array_finish(&s->subtrees);
}

bool spatial_split(Build *b)
{
  Spatial s = {.build = b, .worker_count = (size_t)jobs_thread_count(b->jobs)};
  const bool ok = split_all(&s);
  b->has_pieces = atomic_load_explicit(&s.has_pieces, memory_order_relaxed);
  spatial_finish(&s);
  return ok;
}
