// The last few levels: up to SMALL references are sorted along each axis once, and every split is the best of all
// planes between them (the full sweep of MacDonald and Booth 1990). Orders stay sorted because a split moves them
// stably, and all three keep the same runs:
//
//   order[axis]   | left of the first split ....... | right ........ |    a run is [begin, begin + count) in each
//
// At this size that costs no more than bins, which must be cleared and swept however few references there are.

#include "accel/build_bins.h"
#include "accel/build_tree.h"

typedef struct SmallRange {
  const Build *build;
  const BuildRef *refs;
  uint8_t order[3][SMALL];
} SmallRange;

typedef struct Run {
  uint32_t node;
  uint8_t begin, count;
} Run;

// A float as an integer of the same order.
static Int4 sortable(Vec3 x)
{
  const Int4 bits = (Int4)x;
  return bits ^ ((bits >> 31) & 0x7fffffff);
}

// Each centre's rank is the number of smaller ones. The lowest bits of the key give way to the reference's place, so
// that no two are equal; centres that differ by less than that may be taken in either order.
static void sort_centers(SmallRange *s, uint32_t count)
{
  enum { GROUPS = SMALL / 4 };
  union {
    Int4 group[GROUPS];
    int32_t one[SMALL];
  } key[3];
  Int4 wide[SMALL];
  for (uint32_t i = 0; i < count; i++) {
    const Int4 k = (sortable(ref_center(&s->refs[i])) & ~(SMALL - 1)) | (int)i;
    for (int axis = 0; axis < 3; axis++) key[axis].one[i] = k[axis];
  }
  for (uint32_t i = count; i % 4; i++) key[0].one[i] = key[1].one[i] = key[2].one[i] = INT32_MAX;
  for (int axis = 0; axis < 3; axis++) {
    for (uint32_t i = 0; i < count; i++) wide[i] = key[axis].one[i] - (Int4){0};
    for (uint32_t g = 0; 4 * g < count; g++) {
      union {
        Int4 group;
        int32_t one[4];
      } rank = {.group = {0}};
      for (uint32_t i = 0; i < count; i++) rank.group -= wide[i] < key[axis].group[g];
      for (uint32_t i = 4 * g; i < count && i < 4 * g + 4; i++) s->order[axis][rank.one[i % 4]] = (uint8_t)i;
    }
  }
}

// The best place to cut the run: the first so many along an axis go left.
static Run best_cut(const SmallRange *s, const Run *r, float scale, int *axis)
{
  Vec3 right[SMALL];
  Bounds box[3] = {bounds_empty(), bounds_empty(), bounds_empty()};
  Int4 count = {0};
  for (uint32_t i = r->count - 1u; i > 0; i--) {
    for (int k = 0; k < 3; k++) bounds_add(&box[k], &s->refs[s->order[k][r->begin + i]]);
    count += 1;
    right[i] = side_costs(s->build, box, count, scale);
  }
  Vec3 best = v3_all(INFINITY);
  Int4 at = {0};
  for (int k = 0; k < 3; k++) box[k] = bounds_empty();
  count = (Int4){0};
  for (uint32_t i = 1; i < r->count; i++) {
    for (int k = 0; k < 3; k++) bounds_add(&box[k], &s->refs[s->order[k][r->begin + i - 1u]]);
    count += 1;
    const Vec3 cost = side_costs(s->build, box, count, scale) + right[i];
    const Int4 is_less = cost < best;
    best = select_lanes(is_less, cost, best);
    at = (is_less & count) | (~is_less & at);
  }
  *axis = best[1] < best[0] ? 1 : 0;
  if (best[2] < best[*axis]) *axis = 2;
  const bool found = best[*axis] < INFINITY;
  return (Run){0, r->begin, (uint8_t)(found ? at[*axis] : r->count / 2)};
}

// Moves the references on the left of the cut to the front of the run along the other axes, too.
static void cut(SmallRange *s, const Run *r, const Run *left, int axis, Bounds box[2])
{
  uint8_t side[SMALL], moved[SMALL];
  box[0] = box[1] = bounds_empty();
  for (uint32_t i = 0; i < r->count; i++) {
    const uint8_t ref = s->order[axis][r->begin + i];
    const bool goes_right = i >= left->count;
    side[ref] = goes_right;
    bounds_add(&box[goes_right], &s->refs[ref]);
  }
  for (int k = 0; k < 3; k++) {
    if (k == axis) continue;
    uint8_t *order = s->order[k] + r->begin;
    uint32_t lefts = 0, rights = 0;
    for (uint32_t i = 0; i < r->count; i++) {
      const uint8_t ref = order[i];
      order[lefts] = ref;
      moved[rights] = ref;
      rights += side[ref];
      lefts += !side[ref];
    }
    memcpy(order + lefts, moved, rights);
  }
}

bool small_split(const Build *b, BinaryTree *t, uint32_t node, uint32_t first, uint32_t count)
{
  SmallRange s = {.build = b, .refs = b->refs + first};
  sort_centers(&s, count);
  Run stack[SMALL];
  int height = 0;
  stack[height++] = (Run){node, 0, (uint8_t)count};
  while (height > 0) {
    const Run r = stack[--height];
    BinaryNode *n = &t->items[r.node];
    if (r.count <= b->leaf_size) {
      node_set_leaf(n, first + r.begin, r.count);
      continue;
    }
    const Bounds all = {v3_load(n->lo), v3_load(n->hi)};
    int axis;
    Bounds box[2];
    Run left = best_cut(&s, &r, box_scale(&all), &axis);
    cut(&s, &r, &left, axis, box);
    const uint32_t pair = tree_add_pair(t, r.node, r.count);
    if (pair == UINT32_MAX) return false;
    node_set_box(&t->items[pair], &box[0]);
    node_set_box(&t->items[pair + 1], &box[1]);
    left.node = pair;
    stack[height++] = (Run){pair + 1, (uint8_t)(r.begin + left.count), (uint8_t)(r.count - left.count)};
    stack[height++] = left;
  }
  for (uint32_t i = 0; i < count; i++) b->top->prims[first + i] = ref_prim(&s.refs[s.order[0][i]]);
  return true;
}
