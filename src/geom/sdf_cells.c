// See sdf_cells.h. From the whole field down, a cell's tape is that of the cell around it without the steps that cannot
// matter inside: the value at a cell's middle and the steepness bound every value in it, and where one side of a join is
// the smaller one for sure, by more than the join is smooth, the other is left out (Keeter, "Massively parallel rendering
// of complex closed-form implicit surfaces", SIGGRAPH 2020, shortens tapes likewise, with interval arithmetic). A cell
// through which the surface cannot go is empty. Leaves with the same tape are one, so that rays in both are asked together.

#include "geom/sdf_cells.h"

#include "base/hash.h"
#include "base/table.h"
#include "geom/formula_range.h"
#include "geom/sdf_exact.h"

#include <string.h>

enum { SIDE = 4, CHILDREN = 64, LANES = 4 };

// What is known of a value all over a cell.
typedef struct Known {
  double lo, hi, steep;
  uint32_t start; // of its steps, in the tape being written
} Known;

// A space the tape is inside of.
typedef struct Space {
  double steep;  // of its coordinates, in units of its own scale
  bool is_loose; // the cell reaches over a border between copies: values inside jump
  uint32_t start;
} Space;

typedef struct Pruner {
  const Sdf *sdf;
  const uint16_t *from; // codes
  uint32_t count;
  const SdfTrace_d *trace; // one a code
  int lane;
  double radius;        // of the ball around the cell, in the field's space
  double slack;         // for the rounding of rays' floats
  uint16_t *out;
  uint32_t out_count;
  Known stack[SDF_MOST_DEPTH + 2];
  Space spaces[SDF_MOST_DEPTH + 1];
  int height, depth;
} Pruner;

static void narrow(Known *k, double lo, double hi)
{
  k->lo = fmax(k->lo, lo);
  k->hi = fmin(k->hi, hi);
}

// By the value in the middle.
static void narrow_about(Known *k, double middle, double radius)
{
  const double reach = k->steep * radius * (1 + 1e-6) + 1e-6 * fabs(middle);
  narrow(k, middle - reach, middle + reach);
}

// Greatest stretch of a shear by s (the larger singular value of a unit matrix with s beside its diagonal).
static double shear(double s)
{
  return s / 2 + sqrt(1 + s * s / 4);
}

// Does the ball of this radius about x reach over a border between copies along the axis?
static bool is_split(const SdfWarp *w, int k, double x, double radius)
{
  const double spacing = (double)w->spacing[k], at = x + (double)w->shift[k];
  const double low = fmin(fmax(nearbyint((at - radius) / spacing), (double)w->first[k]), (double)w->last[k]);
  const double high = fmin(fmax(nearbyint((at + radius) / spacing), (double)w->first[k]), (double)w->last[k]);
  return low != high;
}

static void enter(Pruner *p, const SdfStep *s, const SdfTrace_d *t)
{
  const SdfWarp *w = &p->sdf->warps[s->warp];
  const Space *around = &p->spaces[p->depth];
  Space inside = {around->steep, around->is_loose, p->out_count};
  double radius = p->radius * around->steep / (double)s->scale * (1 + 1e-6);
  double at[3], away = 0;
  for (int k = 0; k < 3; k++) {
    at[k] = t->p[k][p->lane];
    away += at[k] * at[k];
  }
  away = sqrt(away);
  if (w->bend != 0) {
    const double stretch = 1 + fabs((double)w->bend) * (sqrt(at[0] * at[0] + at[1] * at[1]) + radius);
    inside.steep *= stretch;
    radius *= stretch;
  }
  if (w->twist != 0) {
    const double off_axis = w->bend != 0 ? away : sqrt(at[0] * at[0] + at[2] * at[2]);
    const double stretch = shear(fabs((double)w->twist) * (off_axis + radius));
    inside.steep *= stretch;
    radius *= stretch;
  }
  const bool is_turned = w->bend != 0 || w->twist != 0;
  for (int k = 0; k < 3; k++)
    if (w->spacing[k] > 0 && !w->is_mirrored) inside.is_loose |= is_turned || is_split(w, k, at[k], radius);
  p->spaces[++p->depth] = inside;
}

static double formula_box(const Pruner *p, const SdfStep *s, const SdfTrace_d *t, double steep, Known *k)
{
  const double radius = p->radius * steep / (double)s->scale * (1 + 1e-6);
  double lo[3], hi[3];
  for (int a = 0; a < 3; a++) {
    const double side = (double)s->size[a], at = t->p[a][p->lane];
    lo[a] = fmin(fmax(at - radius, -side), side);
    hi[a] = fmin(fmax(at + radius, -side), side);
  }
  const FormulaRange r = formula_range(&p->sdf->formulas[s->formula], lo, hi);
  k->lo = fmax(k->lo, (double)s->scale * r.lo); // the box can only cut away
  return fmax(r.steep, 1);
}

static Known primitive(const Pruner *p, const SdfStep *s, const SdfTrace_d *t)
{
  const Space *here = &p->spaces[p->depth];
  Known k = {-INFINITY, INFINITY, here->steep, p->out_count};
  if (s->kind == SDF_FORMULA) k.steep *= formula_box(p, s, t, here->steep, &k);
  if (here->is_loose)
    k.lo = -INFINITY;
  else
    narrow_about(&k, t->value[p->lane], p->radius);
  return k;
}

static Known leave(Pruner *p, const SdfStep *s, const SdfTrace_d *t)
{
  const SdfWarp *w = &p->sdf->warps[s->warp];
  Known k = p->stack[--p->height];
  const double scale = (double)s->scale;
  bool is_repeated = false;
  if (w->has_space) {
    k.start = p->spaces[p->depth].start;
    p->depth--;
    for (int a = 0; a < 3; a++) is_repeated |= w->spacing[a] > 0;
  }
  if (w->onion > 0) {
    const double least = k.lo > 0 ? k.lo : k.hi < 0 ? -k.hi : 0;
    k.hi = fmax(fabs(k.lo), fabs(k.hi)) - (double)w->onion * scale;
    k.lo = least - (double)w->onion * scale;
  }
  const double high = SDF_NOISE_HIGH * fabs((double)w->noise) * scale;
  k.lo -= (double)w->round * scale + high;
  k.hi += high - (double)w->round * scale;
  k.steep += fabs((double)w->noise) * (double)w->noise_frequency * (double)SDF_NOISE_STEEP * p->spaces[p->depth].steep;
  if (is_repeated) k.lo = -INFINITY, k.hi = INFINITY; // the border may be nearer
  if (!p->spaces[p->depth].is_loose) narrow_about(&k, t->value[p->lane], p->radius);
  return k;
}

typedef struct Verdict {
  bool drops_first, drops_second;
} Verdict;

static Known known_negative(const Known *k)
{
  return (Known){-k->hi, -k->lo, k->steep, k->start};
}

// Which of the two values cannot matter anywhere in the cell.
static Verdict judge(const SdfStep *s, const Known *a, const Known *b, double slack)
{
  const double smooth = (double)s->smooth;
  switch ((SdfOperation)s->operation) {
  case SDF_UNION: return (Verdict){a->lo > b->hi + smooth + slack, b->lo > a->hi + smooth + slack};
  case SDF_INTERSECTION: return (Verdict){a->hi + smooth + slack < b->lo, b->hi + smooth + slack < a->lo};
  case SDF_DIFFERENCE: return (Verdict){false, -b->lo + smooth + slack < a->lo};
  case SDF_SOFT_MAXIMUM: return (Verdict){a->hi + 18 * smooth + slack < b->lo, b->hi + 18 * smooth + slack < a->lo};
  }
  unreachable();
}

static Known join(const SdfStep *s, const Known *a, const Known *b)
{
  const double smooth = (double)s->smooth;
  const Known minus = known_negative(b), *other = s->operation == SDF_DIFFERENCE ? &minus : b;
  Known k = {.steep = fmax(a->steep, b->steep), .start = a->start};
  if (s->operation == SDF_UNION) {
    k.lo = fmin(a->lo, b->lo) - smooth / 6;
    k.hi = fmin(a->hi, b->hi);
  } else {
    k.lo = fmax(a->lo, other->lo);
    k.hi = fmax(a->hi, other->hi) + smooth * (s->operation == SDF_SOFT_MAXIMUM ? 0.6932 : 1.0 / 6);
  }
  return k;
}

static void emit(Pruner *p, uint16_t code) { p->out[p->out_count++] = code; }

// Takes away what was written from `start` to `end`.
static void cut(Pruner *p, uint32_t start, uint32_t end)
{
  memmove(p->out + start, p->out + end, (p->out_count - end) * sizeof *p->out);
  p->out_count -= end - start;
}

static void put(Pruner *p, uint16_t code, const SdfStep *s, Known x, const SdfTrace_d *t)
{
  if (code & 1) {
    emit(p, code);
    p->stack[p->height++] = x;
    return;
  }
  const Known before = p->stack[--p->height];
  const Verdict v = judge(s, &before, &x, p->slack);
  if (v.drops_second) {
    p->out_count = x.start;
    p->stack[p->height++] = before;
    return;
  }
  if (v.drops_first) {
    if (s->kind != SDF_JOIN) emit(p, code | 1);
    cut(p, before.start, x.start);
    x.start = before.start;
    p->stack[p->height++] = x;
    return;
  }
  emit(p, code);
  Known k = join(s, &before, &x);
  if (!p->spaces[p->depth].is_loose) narrow_about(&k, t->joined[p->lane], p->radius);
  p->stack[p->height++] = k;
}

static Known prune(Pruner *p)
{
  p->out_count = 0;
  p->height = p->depth = 0;
  p->spaces[0] = (Space){1, false, 0};
  for (uint32_t i = 0; i < p->count; i++) {
    const uint16_t code = p->from[i];
    const SdfStep *s = &p->sdf->steps[code >> 1];
    const SdfTrace_d *t = &p->trace[i];
    switch ((SdfKind)s->kind) {
    case SDF_ENTER:
      enter(p, s, t);
      emit(p, code);
      break;
    case SDF_LEAVE: put(p, code, s, leave(p, s, t), t); break;
    case SDF_JOIN: {
      const Known k = p->stack[--p->height];
      put(p, code, s, k, t);
      break;
    }
    case SDF_SPHERE:
    case SDF_BOX:
    case SDF_TORUS:
    case SDF_CYLINDER:
    case SDF_CONE:
    case SDF_CAPSULE:
    case SDF_PLANE:
    case SDF_ELLIPSOID:
    case SDF_OCTAHEDRON:
    case SDF_MENGER:
    case SDF_MANDELBULB:
    case SDF_FORMULA: put(p, code, s, primitive(p, s, t), t); break;
    }
  }
  return p->stack[0];
}

// --- the tree -----------------------------------------------------------------------------------------
typedef struct Maker {
  SdfBody *body;
  Err *err;
  Table found;          // hash of a tape and its steepness -> leaf
  SdfTrace_d *trace;    // room for a level each
  uint16_t *codes;      // likewise
  uint32_t step_count;
  double root_steep, slack;
} Maker;

static bool failed_memory(Maker *m)
{
  return err_memory(m->err, "the cells of a field", m->body->entries.count * sizeof(uint32_t));
}

// Steepness in eighths, so that cells differ less.
static float flat_of(double steep)
{
  return (float)(8 / ceil(fmax(steep, 1) * 8 - 1e-3));
}

static bool add_leaf(Maker *m, const uint16_t *codes, uint32_t count, double steep, uint32_t *leaf_i)
{
  SdfBody *b = m->body;
  const float flat = flat_of(steep);
  uint64_t key = hash_bytes(count, codes, count * sizeof *codes);
  key = hash_bytes(key, &flat, sizeof flat);
  size_t step = 0;
  for (const int32_t *at; (at = table_next(&m->found, key, &step));) {
    const SdfLeaf *l = &b->leaves.items[*at];
    if (l->count != count || l->flat != flat || memcmp(b->codes.items + l->first, codes, count * sizeof *codes)) continue;
    *leaf_i = (uint32_t)*at;
    return true;
  }
  if (!array_reserve(&b->codes, b->codes.count + count)) return failed_memory(m);
  const SdfLeaf leaf = {(uint32_t)b->codes.count, count, flat};
  memcpy(b->codes.items + b->codes.count, codes, count * sizeof *codes);
  b->codes.count += count;
  *leaf_i = (uint32_t)b->leaves.count;
  if (!array_push(&b->leaves, leaf) || !table_add(&m->found, key, (int32_t)*leaf_i)) return failed_memory(m);
  return true;
}

// Steps so costly that an empty cell is worth more than its memory.
static bool is_costly(const Maker *m, const uint16_t *codes, uint32_t count)
{
  for (uint32_t i = 0; i < count; i++) {
    const uint8_t kind = m->body->steps.items[codes[i] >> 1].kind;
    if (kind == SDF_MANDELBULB || kind == SDF_MENGER || kind == SDF_FORMULA || kind == SDF_ENTER) return true;
  }
  return count > 2;
}

// The entries of 4 x 4 x 4 cells: at first + x stride[0] + y stride[1] + z stride[2]. Those of the top's 4 x 4 x 4 wide
// cells are 64 each.
typedef struct Region {
  uint32_t first, stride[3];
} Region;

static const Region top_region = {0, {4, 4 * SDF_TOP, 4 * SDF_TOP * SDF_TOP}};

static uint32_t entry_of(const Region *r, int child)
{
  uint32_t at = r->first;
  for (int k = 0; k < 3; k++) at += r->stride[k] * (child >> 2 * k & 3);
  return at;
}

static Region block_of(uint32_t first) { return (Region){first, {1, SDF_TOP, SDF_TOP * SDF_TOP}}; }

// Sets a cell's entry, or all of a wide cell's.
static void set_entry(Maker *m, uint32_t at, uint32_t level, uint32_t entry)
{
  const Region block = block_of(at);
  if (level > 0) m->body->entries.items[at] = entry;
  for (int i = 0; level == 0 && i < CHILDREN; i++) m->body->entries.items[entry_of(&block, i)] = entry;
}

// A float's bits, less the two that say what it is: a little nearer to 0.
static uint32_t empty_entry(const Known *k, double middle, double root_steep, uint32_t level)
{
  float clear = (float)(middle / root_steep);
  uint32_t bits;
  if ((clear < 0) != (k->hi < 0)) clear = k->hi < 0 ? -0.0f : 0.0f;
  memcpy(&bits, &clear, sizeof bits);
  return (bits & ~SDF_CELL_KIND) | (level == 0 ? SDF_CELL_WIDE : SDF_CELL_EMPTY);
}

static bool divide(Maker *m, const Region *region, const uint16_t *codes, uint32_t count, const double lo[3], double width, uint32_t level);

static bool cut_cell(Maker *m, uint32_t at, const Pruner *p, const double lo[3], double width, uint32_t level)
{
  Region inside = block_of(at);
  if (level > 0) {
    inside = (Region){(uint32_t)m->body->entries.count, {1, SIDE, SIDE * SIDE}};
    if (!array_reserve(&m->body->entries, m->body->entries.count + CHILDREN)) return failed_memory(m);
    m->body->entries.count += CHILDREN;
    set_entry(m, at, level, inside.first << 2 | SDF_CELL_CUT);
  }
  return divide(m, &inside, p->out, p->out_count, lo, width, level + 1);
}

static bool add_cell(Maker *m, uint32_t at, Pruner *p, const double lo[3], double width, uint32_t level)
{
  const Known k = prune(p);
  uint32_t leaf;
  if (k.lo > 0 || k.hi < 0) {
    set_entry(m, at, level, empty_entry(&k, p->trace[p->count - 1].joined[p->lane], m->root_steep, level));
    return true;
  }
  if (level + 1 < m->body->sdf.levels && is_costly(m, p->out, p->out_count)) return cut_cell(m, at, p, lo, width, level);
  if (!add_leaf(m, p->out, p->out_count, k.steep, &leaf)) return false;
  set_entry(m, at, level, leaf << 2 | SDF_CELL_LEAF);
  return true;
}

// 4 x 4 x 4 cells, four at a time. Calls itself, as deep as there are levels.
static bool divide(Maker *m, const Region *region, const uint16_t *codes, uint32_t count, const double lo[3], double width, uint32_t level)
{
  const double cell = width / SIDE;
  SdfTrace_d *trace = m->trace + (size_t)level * m->step_count;
  Pruner p = {.sdf = &m->body->sdf, .from = codes, .count = count, .trace = trace, .slack = m->slack,
              .radius = cell * 0.867, // half a diagonal and a thousandth
              .out = m->codes + (size_t)level * m->step_count};
  for (int first = 0; first < CHILDREN; first += LANES) {
    double corner[LANES][3];
    Num4 at[3];
    for (int l = 0; l < LANES; l++)
      for (int k = 0; k < 3; k++) {
        corner[l][k] = lo[k] + cell * (double)((first + l) >> 2 * k & 3);
        at[k][l] = corner[l][k] + cell / 2;
      }
    (void)sdf_run_d(&m->body->sdf, codes, count, at, trace);
    for (p.lane = 0; p.lane < LANES; p.lane++)
      if (!add_cell(m, entry_of(region, first + p.lane), &p, corner[p.lane], cell, level)) return false;
  }
  return true;
}

// The whole field as the first leaf, with the steepness it has at most: over its box, or, without ends, as of
// primitives alone, which is all that world/ lets through.
static bool add_whole(Maker *m, const double middle[3], double radius)
{
  SdfBody *b = m->body;
  uint16_t *codes = m->codes, *out = m->codes + m->step_count;
  uint32_t leaf_i;
  for (uint32_t i = 0; i < m->step_count; i++) codes[i] = (uint16_t)(i << 1 | b->steps.items[i].is_pushed);
  Num4 at[3];
  for (int k = 0; k < 3; k++) at[k] = num4_set(middle[k]);
  (void)sdf_run_d(&b->sdf, codes, m->step_count, at, m->trace);
  Pruner p = {.sdf = &b->sdf, .from = codes, .count = m->step_count, .trace = m->trace, .radius = radius, .slack = m->slack, .out = out};
  m->root_steep = fmax(prune(&p).steep, 1);
  return add_leaf(m, codes, m->step_count, m->root_steep, &leaf_i);
}

// Of few primitives whole cells are cheap enough; of many, cells should hold few.
static uint32_t levels_of(const Maker *m)
{
  const uint16_t *codes = m->codes;
  if (m->step_count == 1 && !is_costly(m, codes, 1)) return 0;
  return m->step_count < 6 && !is_costly(m, codes, m->step_count) ? 2 : 3;
}

static bool make(Maker *m)
{
  SdfBody *b = m->body;
  Sdf *s = &b->sdf;
  const bool has_ends = bounds_is_finite(&s->bounds);
  double lo[3] = {0}, middle[3] = {0}, width = 0, radius = 1e3;
  for (int k = 0; has_ends && k < 3; k++) width = fmax(width, (double)s->bounds.hi[k] - (double)s->bounds.lo[k]);
  for (int k = 0; has_ends && k < 3; k++) {
    middle[k] = ((double)s->bounds.lo[k] + (double)s->bounds.hi[k]) / 2;
    lo[k] = middle[k] - width * 0.5000001;
  }
  width *= 1.0000002;
  if (has_ends) radius = width * 0.8660254037844387;
  m->slack = 2e-6 * radius;
  if (!add_whole(m, middle, radius)) return false;
  s->levels = has_ends ? levels_of(m) : 0;
  if (!s->levels) return true;
  for (int k = 0; k < 3; k++) s->lo[k] = (float)lo[k];
  s->cell = (float)(width / (double)(1u << 2 * s->levels));
  s->inv_cell = 1 / s->cell;
  if (!array_reserve(&b->entries, SDF_TOP_CELLS)) return failed_memory(m);
  b->entries.count = SDF_TOP_CELLS;
  // Cells lie as floats have them, and a little wider, since rays find theirs by rounded numbers.
  const double corner[3] = {(double)s->lo[0], (double)s->lo[1], (double)s->lo[2]};
  uint16_t *whole = b->codes.items; // may move while leaves are added
  uint16_t *copy = m->codes + (size_t)(s->levels + 1) * m->step_count;
  memcpy(copy, whole, m->step_count * sizeof *copy);
  return divide(m, &top_region, copy, m->step_count, corner, (double)s->cell * (double)(1u << 2 * s->levels), 0);
}

static void point(SdfBody *b)
{
  Sdf *s = &b->sdf;
  s->steps = b->steps.items;
  s->step_count = (uint32_t)b->steps.count;
  s->warps = b->warps.items;
  s->formulas = b->formulas.items;
  s->colors = b->colors.count ? (const float(*)[3])(const void *)b->colors.items : NULL;
  s->entries = b->entries.items;
  s->leaves = b->leaves.items;
  s->codes = b->codes.items;
}

bool sdf_body_make(SdfBody *b, Err *err)
{
  enum { MOST_LEVELS = 4 };
  Maker m = {.body = b, .err = err, .step_count = (uint32_t)b->steps.count};
  point(b);
  m.trace = mem_alloc(m.step_count * MOST_LEVELS, sizeof *m.trace);
  m.codes = mem_alloc(m.step_count * (MOST_LEVELS + 1), sizeof *m.codes);
  const bool ok = m.trace && m.codes ? make(&m) : failed_memory(&m);
  table_finish(&m.found);
  mem_free(m.trace);
  mem_free(m.codes);
  point(b);
  return ok;
}

SdfBody *sdf_body_create(Err *err)
{
  SdfBody *b = mem_zero(1, sizeof *b);
  if (!b) return err_memory(err, "a field", sizeof *b), NULL;
  atomic_init(&b->users, 1);
  return b;
}

SdfBody *sdf_body_share(SdfBody *b)
{
  atomic_fetch_add_explicit(&b->users, 1, memory_order_relaxed);
  return b;
}

void sdf_body_release(SdfBody *b)
{
  if (!b || atomic_fetch_sub_explicit(&b->users, 1, memory_order_acq_rel) != 1) return;
  array_finish(&b->steps);
  array_finish(&b->warps);
  array_finish(&b->formulas);
  array_finish(&b->colors);
  array_finish(&b->entries);
  array_finish(&b->leaves);
  array_finish(&b->codes);
  mem_free(b);
}

size_t sdf_body_bytes(const SdfBody *b)
{
  return sizeof *b + b->steps.count * sizeof(SdfStep) + b->warps.count * sizeof(SdfWarp) +
         b->formulas.count * sizeof(Formula) + b->entries.count * sizeof(uint32_t) + b->leaves.count * sizeof(SdfLeaf) +
         b->codes.count * sizeof(uint16_t);
}
