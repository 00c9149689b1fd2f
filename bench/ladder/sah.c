#include "sah.h"

#include <stdlib.h>

enum { BINS = 16 };

// Of a box test against a triangle test. In the hall 0.5, 1 and 2 are equally fast within the noise; 0.5 makes rung 8 a
// quarter larger, 2 makes it a fifth smaller for half as many triangle tests more.
static const float box_cost = 1;

typedef struct Bin {
  Box box;
  uint32_t count;
} Bin;

typedef struct Split {
  int axis;
  uint32_t bin;    // items of bins before it go left
  float cost;      // in areas times tests; infinite: none was found
  float lo, scale; // bin of a middle: (middle - lo) * scale
} Split;

static float half_area(const Box *b)
{
  const float x = b->hi[0] - b->lo[0], y = b->hi[1] - b->lo[1], z = b->hi[2] - b->lo[2];
  return x < 0 ? 0 : x * y + y * z + z * x;
}

static uint32_t bin_of(const Item *i, const Split *s)
{
  const float at = (i->box.lo[s->axis] + i->box.hi[s->axis] - s->lo) * s->scale;
  return at >= BINS - 1 ? BINS - 1 : (uint32_t)at;
}

static void try_axis(const Item *items, uint32_t count, int axis, float lo, float hi, Split *best)
{
  Split s = {.axis = axis, .lo = lo, .scale = BINS / (hi - lo)};
  Bin bins[BINS];
  float right_cost[BINS]; // of everything from this bin on
  if (!(hi > lo) || !(s.scale < INFINITY)) return;
  for (int b = 0; b < BINS; b++) bins[b] = (Bin){box_empty(), 0};
  for (uint32_t i = 0; i < count; i++) {
    Bin *bin = &bins[bin_of(&items[i], &s)];
    box_add(&bin->box, &items[i].box);
    bin->count++;
  }
  Box sum = box_empty();
  uint32_t n = 0;
  for (int b = BINS - 1; b > 0; b--) {
    box_add(&sum, &bins[b].box);
    right_cost[b] = half_area(&sum) * (float)(n += bins[b].count);
  }
  sum = box_empty();
  n = 0;
  for (uint32_t b = 1; b < BINS; b++) {
    box_add(&sum, &bins[b - 1].box);
    n += bins[b - 1].count;
    s.cost = half_area(&sum) * (float)n + right_cost[b];
    s.bin = b;
    if (n > 0 && n < count && s.cost < best->cost) *best = s;
  }
}

static Split best_split(const Item *items, uint32_t count)
{
  Split best = {.cost = INFINITY};
  float lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
  for (uint32_t i = 0; i < count; i++)
    for (int k = 0; k < 3; k++) {
      const float middle = items[i].box.lo[k] + items[i].box.hi[k];
      lo[k] = least(lo[k], middle);
      hi[k] = most(hi[k], middle);
    }
  for (int k = 0; k < 3; k++) try_axis(items, count, k, lo[k], hi[k], &best);
  return best;
}

// How many went left.
static uint32_t part(Item *items, uint32_t count, const Split *s)
{
  uint32_t i = 0, k = count;
  while (i < k) {
    if (bin_of(&items[i], s) < s->bin) {
      i++;
    } else {
      const Item other = items[i];
      items[i] = items[--k];
      items[k] = other;
    }
  }
  return i;
}

// Where to cut, or 0 for a leaf.
static uint32_t cut(Item *items, uint32_t count, const Box *box, uint32_t leaf_size, int depth)
{
  if (count == 1) return 0;
  const Split s = depth < SAH_DEPTH ? best_split(items, count) : (Split){.cost = INFINITY};
  const float area = half_area(box);
  const bool is_worth_it = s.cost + 2 * box_cost * area < (float)count * area;
  if (count <= leaf_size && !is_worth_it) return 0;
  if (s.cost < INFINITY) return part(items, count, &s);
  items_halve(items, count, count / 2);
  return count / 2;
}

static void build_node(SahTree *t, uint32_t node, uint32_t first, uint32_t count, uint32_t leaf_size,
                       int depth)
{
  SahNode *n = &t->nodes[node];
  n->box = items_box(t->items + first, count);
  const uint32_t left = cut(t->items + first, count, &n->box, leaf_size, depth);
  n->first = left ? t->node_count : first;
  n->count = left ? 0 : count;
  if (!left) return;
  t->node_count += 2;
  build_node(t, n->first, first, left, leaf_size, depth + 1);
  build_node(t, n->first + 1, first + left, count - left, leaf_size, depth + 1);
}

bool sah_build(const LadderMesh *m, uint32_t leaf_size, SahTree *out)
{
  *out = (SahTree){.items = items_of(m), .item_count = m->triangle_count};
  out->nodes = malloc(2 * (size_t)m->triangle_count * sizeof *out->nodes);
  if (!out->items || !out->nodes) {
    sah_finish(out);
    return false;
  }
  out->node_count = 1;
  build_node(out, 0, 0, m->triangle_count, leaf_size, 0);
  return true;
}

void sah_finish(SahTree *t)
{
  free(t->nodes);
  free(t->items);
  *t = (SahTree){0};
}
