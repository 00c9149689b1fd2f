// Building the light tree: ranges of emitters are halved where the sum over both halves of power, area of the box and
// width of the cone of normals is least (the surface area orientation heuristic of Conty and Kulla 2018, section 4.1,
// by bins along the longest axis and from some hundred of them; three axes and all of them took twice the time and
// made 1 % less noise among 10,000 lamps), until a node has eight children. See light_tree.h.

#include "shade/light_tree_build.h"

#include "base/mem.h"

#include <float.h>
#include <string.h>

enum { BINS = 12, LOOKED_AT = 256 };

// What a group of emitters sends and from where.
typedef struct Sender {
  Vec3 lo, hi, axis;
  float cos_spread; // 2: no emitter yet
  float cos_end;
  double power;
} Sender;

typedef struct Item {
  Sender sender;
  Vec3 centre;
  uint32_t emitter;
} Item;

typedef struct Range {
  uint32_t first, end;
  uint32_t parent; // node * 8 + lane that will point to it
  int32_t level;
} Range;

typedef struct TreeBuild {
  LightTree *tree;
  Item *items;
  Range *stack;
  size_t height;
} TreeBuild;

static Sender sender_none(void)
{
  return (Sender){.lo = v3_all(FLT_MAX), .hi = v3_all(-FLT_MAX), .cos_spread = 2, .cos_end = 1};
}

// --- cones ----------------------------------------------------------------------------------------

// The narrowest cone with two others in it (Conty and Kulla 2018, algorithm 1).
static void cone_add(Sender *s, Vec3 axis, float cos_spread)
{
  if (s->cos_spread > 1) {
    s->axis = axis;
    s->cos_spread = cos_spread;
    return;
  }
  if (s->cos_spread <= -1) return;
  // Most are single normals within the cone, or the very one it is made of.
  if (cos_spread >= 1 && v3_dot(s->axis, axis) >= s->cos_spread) return;
  const bool is_wider = cos_spread < s->cos_spread;
  const Vec3 wide_axis = is_wider ? axis : s->axis, other_axis = is_wider ? s->axis : axis;
  const double wide = acos((double)(is_wider ? cos_spread : s->cos_spread));
  const double other = acos((double)(is_wider ? s->cos_spread : cos_spread)), pi = 3.14159265358979;
  const double apart = acos((double)clamp_f(v3_dot(wide_axis, other_axis), -1, 1));
  s->axis = wide_axis;
  s->cos_spread = (float)cos(wide);
  if (apart + other <= wide) return;
  const double spread = (wide + apart + other) / 2;
  const Vec3 across = other_axis - v3_dot(wide_axis, other_axis) * wide_axis;
  if (v3_length(across) < 1e-5f && apart < 1) { // apart by rounding: there is no telling where to turn
    s->cos_spread = (float)fmax(cos(fmin(wide + apart + other, pi)) - 1e-6, -1);
    return;
  }
  if (spread >= pi || v3_length(across) < 1e-5f) {
    s->cos_spread = -1;
    return;
  }
  // A little wider, for the rounding of the axis.
  const double turn = spread - wide;
  s->axis = v3_normalize((float)cos(turn) * wide_axis + (float)sin(turn) * v3_normalize(across));
  s->cos_spread = (float)fmax(cos(spread) - 1e-6, -1);
}

static void sender_add(Sender *s, const Sender *more)
{
  if (more->cos_spread > 1) return;
  s->lo = v3_min(s->lo, more->lo);
  s->hi = v3_max(s->hi, more->hi);
  s->power += more->power;
  s->cos_end = min_f(s->cos_end, more->cos_end);
  cone_add(s, more->axis, more->cos_spread);
}

// Of the directions that a cone of normals and a cosine beyond it reach: 2 pi times this much.
static double orientation(const Sender *s)
{
  const double spread = acos((double)clamp_f(s->cos_spread, -1, 1)), half = 1.5707963267949;
  const double end = fmin(spread + half, 2 * half), sine = sin(spread);
  return 1 - cos(spread) + (2 * end * sine - cos(spread - 2 * end) - 2 * spread * sine + cos(spread)) / 4;
}

static double cost_of(const Sender *s)
{
  if (s->cos_spread > 1) return 0;
  const Vec3 d = s->hi - s->lo;
  const double area = (double)(d[0] * d[1] + d[1] * d[2] + d[2] * d[0]), edge = (double)v3_max_lane(d);
  return s->power * orientation(s) * (area + 1e-3 * edge * edge + 1e-30);
}

// --- emitters -------------------------------------------------------------------------------------

static Sender sender_of(const Emitter *e, double power)
{
  Sender s = sender_none();
  const Vec3 x = e->x, y = e->y, r = v3_all(e->radius);
  s.power = power;
  s.lo = s.hi = e->p;
  s.axis = v3(0, 0, 1);
  s.cos_spread = -1;
  s.cos_end = 0;
  switch ((EmitterKind)e->kind) {
  case EMITTER_POINT: return s;
  case EMITTER_SPOT:
    s.axis = v3_normalize(e->x);
    s.cos_spread = 1;
    s.cos_end = e->cos_outer;
    return s;
  case EMITTER_SPHERE:
    s.lo = e->p - r;
    s.hi = e->p + r;
    return s;
  case EMITTER_TRIANGLE:
    s.lo = v3_min(v3_min(e->p, e->p + x), e->p + y);
    s.hi = v3_max(v3_max(e->p, e->p + x), e->p + y);
    break;
  case EMITTER_QUAD:
    s.lo = v3_min(v3_min(e->p, e->p + x), v3_min(e->p + y, e->p + x + y));
    s.hi = v3_max(v3_max(e->p, e->p + x), v3_max(e->p + y, e->p + x + y));
    break;
  case EMITTER_DISK:
    s.lo = e->p - v3_max(x, -x) - v3_max(y, -y);
    s.hi = e->p + v3_max(x, -x) + v3_max(y, -y);
    break;
  }
  if (e->is_two_sided) return s;
  s.axis = v3_normalize(v3_cross(x, y));
  s.cos_spread = 1;
  return s;
}

static size_t gather(TreeBuild *b, const Emitter *emitters, const double *power, size_t count)
{
  size_t kept = 0;
  for (size_t i = 0; i < count; i++) {
    b->tree->leaf_of[i] = LIGHT_ROOT;
    if (!(power[i] > 0)) continue;
    const Sender s = sender_of(&emitters[i], power[i]);
    if (!v3_is_finite(s.lo) || !v3_is_finite(s.hi)) continue;
    b->items[kept++] = (Item){s, 0.5f * (s.lo + s.hi), (uint32_t)i};
  }
  return kept;
}

// --- halving --------------------------------------------------------------------------------------

typedef struct Split {
  double cost;
  int axis, bin; // items of bins below it go left
} Split;

static int bin_of(const Item *item, int axis, float lo, float scale)
{
  const int bin = (int)((item->centre[axis] - lo) * scale);
  return bin < 0 ? 0 : bin >= BINS ? BINS - 1 : bin;
}

static void try_axis(const Item *items, Range r, int axis, float lo, float hi, Split *best)
{
  Sender bins[BINS], right[BINS];
  if (!(hi > lo)) return;
  for (int i = 0; i < BINS; i++) bins[i] = sender_none();
  const uint32_t stride = (r.end - r.first) / LOOKED_AT + 1;
  for (uint32_t i = r.first; i < r.end; i += stride)
    sender_add(&bins[bin_of(&items[i], axis, lo, BINS / (hi - lo))], &items[i].sender);
  Sender sum = sender_none();
  for (int i = BINS - 1; i > 0; i--) {
    sender_add(&sum, &bins[i]);
    right[i] = sum;
  }
  sum = sender_none();
  for (int i = 1; i < BINS; i++) {
    sender_add(&sum, &bins[i - 1]);
    if (sum.cos_spread > 1 || right[i].cos_spread > 1) continue;
    const double cost = cost_of(&sum) + cost_of(&right[i]);
    if (cost < best->cost) *best = (Split){cost, axis, i};
  }
}

// Where the right half begins. Items that no plane parts are halved as they lie.
static uint32_t halve(Item *items, Range r, bool is_deep)
{
  Vec3 lo = v3_all(FLT_MAX), hi = v3_all(-FLT_MAX);
  for (uint32_t i = r.first; i < r.end; i++) {
    lo = v3_min(lo, items[i].centre);
    hi = v3_max(hi, items[i].centre);
  }
  Split best = {.cost = DBL_MAX, .axis = -1};
  const Vec3 size = hi - lo;
  const int longest = size[0] >= size[1] ? (size[0] >= size[2] ? 0 : 2) : size[1] >= size[2] ? 1 : 2;
  if (!is_deep) try_axis(items, r, longest, lo[longest], hi[longest], &best);
  uint32_t middle = r.first;
  for (uint32_t i = r.first; best.axis >= 0 && i < r.end; i++) {
    if (bin_of(&items[i], best.axis, lo[best.axis], BINS / (hi[best.axis] - lo[best.axis])) >= best.bin)
      continue;
    const Item item = items[i];
    items[i] = items[middle];
    items[middle++] = item;
  }
  return middle > r.first && middle < r.end ? middle : r.first + (r.end - r.first) / 2;
}

// --- nodes ----------------------------------------------------------------------------------------

static void set_lane(LightNode *n, int i, const Sender *s, double scale)
{
  const Vec3 centre = 0.5f * (s->lo + s->hi), half = s->hi - centre;
  n->x[i] = centre[0];
  n->y[i] = centre[1];
  n->z[i] = centre[2];
  n->radius2[i] = v3_dot(half, half) * 1.0001f;
  n->power[i] = max_f((float)(s->power * scale), 1e-30f);
  n->axis_x[i] = s->axis[0];
  n->axis_y[i] = s->axis[1];
  n->axis_z[i] = s->axis[2];
  n->cos_spread[i] = s->cos_spread;
  n->sin_spread[i] = safe_sqrt(1 - s->cos_spread * s->cos_spread);
  n->cos_end[i] = s->cos_end;
}

// The range with most emitters is halved until there are eight.
static int cut_in_eight(TreeBuild *b, Range r, Range parts[8])
{
  int count = 1;
  parts[0] = r;
  if (r.end - r.first <= 8) { // each by itself, without looking for halves
    count = (int)(r.end - r.first);
    for (int i = 0; i < count; i++)
      parts[i] = (Range){r.first + (uint32_t)i, r.first + (uint32_t)i + 1, 0, 0};
  }
  while (count < 8) {
    int most = 0;
    for (int i = 1; i < count; i++)
      if (parts[i].end - parts[i].first > parts[most].end - parts[most].first) most = i;
    if (parts[most].end - parts[most].first < 2) break;
    const uint32_t middle = halve(b->items, parts[most], r.level > 12);
    parts[count] = parts[most];
    parts[most].end = parts[count++].first = middle;
  }
  return count;
}

static void make_node(TreeBuild *b, Range r, double scale)
{
  Range parts[8];
  LightTree *t = b->tree;
  const uint32_t node_i = (uint32_t)t->node_count++;
  LightNode *n = &t->nodes[node_i];
  const int count = cut_in_eight(b, r, parts);
  memset(n, 0, sizeof *n);
  t->parent[node_i] = r.parent;
  if (r.parent != LIGHT_ROOT) t->nodes[r.parent / 8].child[r.parent % 8] = (int32_t)node_i;
  for (int i = 0; i < count; i++) {
    Sender s = sender_none();
    for (uint32_t k = parts[i].first; k < parts[i].end; k++) sender_add(&s, &b->items[k].sender);
    set_lane(n, i, &s, scale);
    const uint32_t place = node_i * 8 + (uint32_t)i;
    if (parts[i].end - parts[i].first > 1) {
      b->stack[b->height++] = (Range){parts[i].first, parts[i].end, place, r.level + 1};
      continue;
    }
    const uint32_t emitter = b->items[parts[i].first].emitter;
    n->child[i] = (int32_t)(emitter | (uint32_t)LIGHT_LEAF);
    t->leaf_of[emitter] = place;
  }
}

// The items' copy in the arena takes their place.
static bool move_to(Arena *arena, void **items, size_t count, size_t size)
{
  void *to = *items && count ? arena_alloc(arena, count, size) : NULL;
  if (to) memcpy(to, *items, count * size);
  mem_free(*items);
  *items = to;
  return to || !count;
}

bool light_tree_build(LightTree *t, Arena *arena, const Emitter *emitters, const double *power, size_t count,
                      const Cancel *cancel, Err *err)
{
  *t = (LightTree){0};
  // A node has at least two children, so there are fewer nodes than emitters; how many is known at the end.
  t->nodes = mem_alloc(count, sizeof *t->nodes);
  t->parent = mem_alloc(count, sizeof *t->parent);
  t->leaf_of = arena_alloc(arena, count, sizeof *t->leaf_of);
  TreeBuild b = {t, mem_alloc(count, sizeof *b.items), mem_alloc(count + 8, sizeof *b.stack), 0};
  bool ok = t->nodes && t->parent && t->leaf_of && b.items && b.stack, is_whole = true;
  if (ok) {
    const size_t kept = t->leaf_count = gather(&b, emitters, power, count);
    double most = 0;
    for (size_t i = 0; i < kept; i++) most = fmax(most, b.items[i].sender.power);
    if (kept) b.stack[b.height++] = (Range){0, (uint32_t)kept, LIGHT_ROOT, 0};
    while (b.height && !is_cancelled(cancel)) make_node(&b, b.stack[--b.height], 1 / most);
    is_whole = b.height == 0;
  }
  ok = move_to(arena, (void **)&t->nodes, t->node_count, sizeof *t->nodes) && ok;
  ok = move_to(arena, (void **)&t->parent, t->node_count, sizeof *t->parent) && ok;
  mem_free(b.items);
  mem_free(b.stack);
  if (!ok) return err_memory(err, "the tree of lights", count * sizeof *t->nodes);
  return is_whole || err_set(err, ERR_CANCELLED, "preparing the lights was cancelled");
}
