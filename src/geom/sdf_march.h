// Sdf march: where rays cross the surface of a field. Up to 64 rays go on together, side by side in lanes; each by itself
// decides its next place, and those that stand where the same steps of the tape count are asked in lanes. So a ray's way
// depends on nothing but the ray, however many go with it and however wide registers are.
//
// A ray goes on by what is free at its place (sphere tracing), a little more than that while the free balls still overlap
// (Keinert et al., "Enhanced Sphere Tracing", 2014), but by `detail` at least. A crossing is a change of sign, then closed
// in on to a float's last bits. Hence the promise: a part through which a ray goes for `detail` or longer is never
// missed, thinner ones may be. What is inside is followed like what is outside, so rays leave glass as they enter it.
//
// A ray that has not come to an end after SDF_MOST_MARCH places is close along the surface: that counts as a crossing if
// it is within `detail`, else it meets nothing. Through a field of the usual 4000 `detail`s each way that cannot happen:
// its diagonal is 6929 of them.

#ifndef RAYFOLD_GEOM_SDF_MARCH_H
#define RAYFOLD_GEOM_SDF_MARCH_H

#include "geom/sdf.h"
#include "geom/tree_ray.h"

#include "geom/sdf_eval.h"

enum { SDF_RAYS = 64, SDF_GROUPS = SDF_RAYS / WIDEST, SDF_MOST_MARCH = 8192, SDF_MOST_CLOSE = 16 };
#define SDF_RELAX 1.3f // of 1, 1.2, 1.3, 1.4 and 1.6 the best for 200 melted spheres and for the sponge

// Rays side by side, one a lane, in the field's space. `going` are those still on their way: either starting, marching or
// closing in. Those that met the surface are `crossed` then, the others missed.
typedef struct SdfGroup {
  float o[3][WIDEST], d[3][WIDEST], inv[3][WIDEST]; // inv: 1 / d, infinite where d is 0
  float inv_length[WIDEST];                         // 1 / |d|
  float t[WIDEST], end[WIDEST];                     // the place to ask at, and how far it matters
  float low[WIDEST], low_free[WIDEST];              // the last place on the side where it began, and how far it was free there
  float high[WIDEST], high_free[WIDEST];            // a place on the other side, once there is one; not positive
  float side[WIDEST];                               // 1: it began outside, -1: inside
  float places[WIDEST], closes[WIDEST];             // how many so far
  unsigned going, starts, closing, crossed;
  unsigned moved_low;                               // of those closing in: their low end moved last
  unsigned waiting;                                 // for what a leaf says about the following
  float p[3][WIDEST], exit[WIDEST];                 // where they stand; how far the cell reaches from t on
  float value[WIDEST], flat[WIDEST];                // the answer, and of whose cell
  uint32_t leaf[WIDEST];
} __attribute__((aligned(64))) SdfGroup;

// Writes the lanes in bits. Not by a masked store (wx_put), which loads that follow at once would have to wait for.
static inline void sdf_put(float *p, unsigned bits, wx x) { wx_store(p, wx_choose(bits, x, wx_load(p))); }

// --- cells --------------------------------------------------------------------------------------------
// What rays find at their places: the steps that count there, or that nothing is near.
typedef struct SdfCells {
  unsigned leaves;   // lanes in a cell with steps
  uint32_t leaf[WIDEST];
  wx clear;          // of nothing: what is free about p, by sign
  wx lo[3], width;   // of the cell; of the whole field, infinite
} SdfCells;

// From what is free about the cell's middle.
static inline wx sdf_cell_clear(const SdfCells *c, const wx p[3], wx middle)
{
  wx away2 = wx_set(0);
  for (int k = 0; k < 3; k++) {
    const wx off = p[k] - (c->lo[k] + 0.5f * c->width);
    away2 = away2 + off * off;
  }
  return wx_signed(wx_max(wx_abs(middle) - wx_sqrt(away2), 0x1p-20f * c->width), middle);
}

// Of the lanes in `asked`.
static inline void sdf_find(const Sdf *f, const wx p[3], unsigned asked, SdfCells *out)
{
  const uint32_t last = (1u << 2 * f->levels) - 1, shift = f->levels ? 2 * f->levels - 4 : 0; // of cells in the top's
  const float side = f->cell * (float)(last + 1);
  wxu at[3], entry = wxu_set(SDF_CELL_LEAF), top, inner; // outside: the whole field
  unsigned inside = f->levels ? asked : 0;
  for (int k = 0; k < 3; k++) {
    const wx off = (p[k] - f->lo[k]) * f->inv_cell;
    inside &= wx_le(wx_set(f->lo[k]), p[k]) & wx_le(p[k], wx_set(f->lo[k] + side));
    at[k] = (wxu)wx_truncate(wx_min(wx_max(off, wx_set(0)), wx_set((float)last)));
  }
  top = at[0] >> shift | at[1] >> shift << 4 | at[2] >> shift << 8;
  if (inside) entry = wxu_gather(f->entries, inside, top, entry);
  const unsigned cut = inside & wxu_eq(entry & SDF_CELL_KIND, wxu_set(SDF_CELL_CUT));
  inner = (entry >> 2) + ((at[0] & 3) | (at[1] & 3) << 2 | (at[2] & 3) << 4);
  if (cut) entry = wxu_gather(f->entries, cut, inner, entry);

  const wxu kind = entry & SDF_CELL_KIND;
  const unsigned wide = inside & wxu_eq(kind, wxu_set(SDF_CELL_WIDE));
  const wxu low = wxu_choose(wide, wxu_set(shift + 2), wxu_choose(cut, wxu_set(0), wxu_set(shift)));
  out->width = wx_choose(inside, f->cell * wx_of_int((wxi)(1 << low)), wx_set(INFINITY));
  for (int k = 0; k < 3; k++) out->lo[k] = f->lo[k] + f->cell * wx_of_int((wxi)(at[k] >> low << low));
  out->leaves = asked & wxu_eq(kind, wxu_set(SDF_CELL_LEAF));
  wxu_store(out->leaf, entry >> 2);
  out->clear = sdf_cell_clear(out, p, wx_of_pattern(entry & ~SDF_CELL_KIND));
}

// How far along the rays their cells reach from t on.
static inline wx sdf_cell_exit(const SdfGroup *g, const SdfCells *at)
{
  wx exit = wx_set(INFINITY);
  for (int k = 0; k < 3; k++) {
    const wx wall = wx_choose(wx_lt(wx_load(g->d[k]), wx_set(0)), at->lo[k], at->lo[k] + at->width);
    exit = wx_min((wall - wx_load(g->o[k])) * wx_load(g->inv[k]), exit); // no number, of a ray in the wall: no end
  }
  return wx_max(exit - wx_load(g->t), wx_set(0));
}

// --- a ray's way --------------------------------------------------------------------------------------
// A ray made ready in a lane; false when it misses the field's box.
static inline bool sdf_begin(const Sdf *f, const TreeRay *ray, float end, SdfGroup *g, int lane)
{
  float t0 = ray->tmin, t1 = end, length2 = 0;
  for (int k = 0; k < 3; k++) {
    const float o = ray->o[k], d = ray->d[k];
    g->o[k][lane] = o;
    g->d[k][lane] = d;
    g->inv[k][lane] = d == 0 ? INFINITY : 1 / d;
    length2 += sqr_f(d);
    if (d == 0) {
      if (!(o >= f->bounds.lo[k] && o <= f->bounds.hi[k])) return false;
      continue;
    }
    const float a = (f->bounds.lo[k] - o) / d, b = (f->bounds.hi[k] - o) / d;
    t0 = max_f(min_f(a, b), t0);
    t1 = min_f(max_f(a, b), t1);
  }
  if (!(t0 <= t1 * FAR_SLACK)) return false;
  g->inv_length[lane] = 1 / sqrtf(length2);
  g->t[lane] = t0;
  g->end[lane] = t1;
  g->places[lane] = g->closes[lane] = 0;
  g->going |= 1u << lane;
  g->starts |= 1u << lane;
  return true;
}

// On from a crossing, to find the next: as if the ray began on the other side of it.
static inline void sdf_go_on(SdfGroup *g, int lane, float end)
{
  const unsigned bit = 1u << lane;
  const float high = g->high[lane];
  g->t[lane] = high * (1 + 0x1p-22f) + 0x1p-126f;
  g->end[lane] = min_f(g->end[lane], end);
  g->low[lane] = high;
  g->low_free[lane] = INFINITY;
  g->side[lane] = -g->side[lane];
  g->closes[lane] = 0;
  g->places[lane] += 1;
  g->crossed &= ~bit;
  g->closing &= ~bit;
  if (g->places[lane] < SDF_MOST_MARCH) g->going |= bit;
}

// These lanes come to an end, met or not.
static inline void sdf_end(SdfGroup *g, unsigned lanes, unsigned crossed)
{
  g->going &= ~lanes;
  g->closing &= ~lanes;
  g->crossed |= lanes & crossed;
}

// Where to ask between the two ends: the secant through them (with Illinois' halving of an end that stays; Dowell and
// Jarratt 1971), kept off the ends. Ends when they are a few bits apart.
static inline void sdf_close(SdfGroup *g, unsigned lanes)
{
  const wx low = wx_load(g->low), high = wx_load(g->high), gap = high - low, low_free = wx_load(g->low_free);
  const wx closes = wx_load(g->closes), part = low_free / (low_free - wx_load(g->high_free));
  const wx t = low + gap * wx_min(wx_max(part, wx_set(0.02f)), wx_set(0.98f));
  const unsigned goes_on = wx_lt(0x1p-22f * high, gap) & wx_lt(low, t) & wx_lt(t, high) & wx_lt(closes, wx_set(SDF_MOST_CLOSE));
  sdf_put(g->t, lanes, t);
  sdf_put(g->closes, lanes, closes + 1);
  sdf_end(g, lanes & ~goes_on, lanes);
}

// One of both ends moves to where the lanes stand.
static inline void sdf_narrow(SdfGroup *g, unsigned lanes, wx free)
{
  const unsigned low = lanes & wx_lt(wx_set(0), free), high = lanes & ~low;
  const wx t = wx_load(g->t);
  sdf_put(g->high_free, low & g->moved_low, 0.5f * wx_load(g->high_free));
  sdf_put(g->low_free, high & ~g->moved_low, 0.5f * wx_load(g->low_free));
  sdf_put(g->low, low, t);
  sdf_put(g->low_free, low, free);
  sdf_put(g->high, high, t);
  sdf_put(g->high_free, high, free);
  g->moved_low = (g->moved_low & ~lanes) | low;
  sdf_close(g, lanes);
}

// The lanes stand beyond a crossing.
static inline void sdf_cross(SdfGroup *g, unsigned lanes, wx free, wx least, bool is_any)
{
  const wx t = wx_load(g->t), low_free = wx_load(g->low_free), went = t - wx_load(g->low);
  const unsigned enough = is_any ? lanes & wx_lt(t, wx_load(g->end)) : 0;
  sdf_put(g->high, lanes, t);
  sdf_put(g->high_free, lanes, wx_min(free, -0x1p-30f * least));
  sdf_put(g->low_free, lanes & ~wx_lt(low_free, wx_set(INFINITY)), went);
  g->moved_low &= ~lanes;
  g->closing |= lanes;
  sdf_end(g, enough, lanes);
  if (lanes & ~enough) sdf_close(g, lanes & ~enough);
}

// What is free at where they stand is passed.
static inline void sdf_advance(SdfGroup *g, unsigned lanes, wx free, wx step, wx least)
{
  const wx t = wx_load(g->t), places = wx_load(g->places) + 1;
  const unsigned behind = lanes & ~wx_lt(t, wx_load(g->end));
  sdf_end(g, behind, 0);
  lanes &= ~behind;
  sdf_put(g->places, lanes, places);
  const unsigned stuck = lanes & ~wx_lt(places, wx_set(SDF_MOST_MARCH));
  sdf_put(g->high, stuck, t);
  sdf_end(g, stuck, wx_lt(free, 2 * least));
  lanes &= ~stuck;
  g->starts &= ~lanes;
  sdf_put(g->low, lanes, t);
  sdf_put(g->low_free, lanes, wx_max(free, step));
  const wx next = t + wx_max(wx_choose(wx_lt(free, step), step, free * SDF_RELAX), least);
  sdf_put(g->t, lanes, next);
  sdf_end(g, lanes & ~wx_lt(t, next), 0); // no float is left ahead
}

// The lanes learn what is free at their places, times side: beyond a crossing it is negative. step: how far they may go.
static inline void sdf_learn(const Sdf *f, SdfGroup *g, unsigned lanes, wx free, wx step, bool is_any)
{
  const wx t = wx_load(g->t), low = wx_load(g->low), low_free = wx_load(g->low_free), went = t - low;
  const wx least = wx_max(f->detail * wx_load(g->inv_length), 0x1p-21f * t), sure = wx_max(low_free, least);
  const unsigned closing = lanes & g->closing, marching = lanes & ~g->closing & ~g->starts;
  const unsigned far = marching & wx_lt(sure * 1.0001f, went) & wx_lt(free + low_free, went); // the free balls do not touch
  const unsigned beyond = marching & ~far & ~wx_lt(wx_set(0), free), on = lanes & ~closing & ~far & ~beyond;
  if (far) {
    sdf_put(g->t, far, low + sure);
    sdf_put(g->low_free, far, wx_set(INFINITY)); // so that this is taken for sure
  }
  if (closing) sdf_narrow(g, closing, free);
  if (beyond) sdf_cross(g, beyond, free, least, is_any);
  if (on) sdf_advance(g, on, free, step, least);
}

// The side on which those begin that start here.
static inline wx sdf_sides(SdfGroup *g, unsigned lanes, wx value)
{
  sdf_put(g->side, lanes & g->starts, wx_choose(wx_lt(value, wx_set(0)), wx_set(-1), wx_set(1)));
  return wx_load(g->side) * wx_load(g->inv_length);
}

// Those who stand where a leaf has to be asked wait for it; the others go on by what is free. False: all wait, or have
// come to an end.
static inline bool sdf_skip(const Sdf *f, SdfGroup *g, bool is_any)
{
  unsigned lanes = g->going & ~g->waiting;
  SdfCells at;
  wx p[3];
  for (int k = 0; k < 3; k++) p[k] = wx_load(g->o[k]) + wx_load(g->t) * wx_load(g->d[k]);
  sdf_find(f, p, lanes, &at);
  const wx exit = sdf_cell_exit(g, &at);
  if (at.leaves) {
    for (int k = 0; k < 3; k++) sdf_put(g->p[k], at.leaves, p[k]);
    sdf_put(g->exit, at.leaves, exit);
    wxu_store(g->leaf, wxu_choose(at.leaves, wxu_load(at.leaf), wxu_load(g->leaf)));
    g->waiting |= at.leaves;
    lanes &= ~at.leaves;
    if (!lanes) return false;
  }
  const wx free = at.clear * sdf_sides(g, lanes, at.clear);
  sdf_learn(f, g, lanes, free, wx_max(free, exit), is_any);
  return (g->going & ~g->waiting) != 0;
}

// Goes through cells where nothing is. In turns, so that a group need not wait for what memory has to say to another.
static inline void sdf_skip_all(const Sdf *f, SdfGroup *groups, int count, bool is_any)
{
  uint64_t open = 0;
  for (int g = 0; g < count; g++) {
    groups[g].waiting = 0;
    open |= (uint64_t)(groups[g].going != 0) << g;
  }
  while (open)
    for (uint64_t left = open; left; left &= left - 1)
      if (!sdf_skip(f, &groups[__builtin_ctzll(left)], is_any)) open &= ~(left & -left);
}

// The leaves' answers.
static inline void sdf_take(const Sdf *f, SdfGroup *g, bool is_any)
{
  const wx whole = wx_set(f->leaves->flat), flat = wx_load(g->flat), value = wx_load(g->value);
  const wx own = value * sdf_sides(g, g->waiting, value), free = own * whole;
  // What is free by the cell's own steepness holds inside the cell alone.
  const unsigned is_flatter = wx_lt(whole, flat) & wx_lt(wx_set(0), own);
  const wx step = wx_choose(is_flatter, wx_max(free, wx_min(own * flat, wx_load(g->exit))), free);
  sdf_learn(f, g, g->waiting, free, step, is_any);
}

// --- many rays ----------------------------------------------------------------------------------------
// Places in the same leaf, side by side, and whose they are.
typedef struct SdfAsked {
  float p[3][SDF_RAYS + WIDEST];
  float *value[SDF_RAYS], *flat[SDF_RAYS];
  int count;
} SdfAsked;

// Takes those who wait in this leaf; of each group `left` are not yet taken.
static inline void sdf_gather(SdfGroup *groups, int count, unsigned *left, uint32_t leaf, SdfAsked *out)
{
  out->count = 0;
  for (int g = 0; g < count; g++) {
    const unsigned same = left[g] & wxu_eq(wxu_load(groups[g].leaf), wxu_set(leaf));
    if (!same) continue;
    for (int k = 0; k < 3; k++) wx_squeeze(out->p[k] + out->count, same, wx_load(groups[g].p[k]));
    for (unsigned lanes = same; lanes; lanes &= lanes - 1) {
      const int i = __builtin_ctz(lanes);
      out->value[out->count] = &groups[g].value[i];
      out->flat[out->count++] = &groups[g].flat[i];
    }
    left[g] &= ~same;
  }
}

static inline void sdf_answer(const Sdf *f, const SdfLeaf *leaf, SdfAsked *a)
{
  float values[WIDEST];
  for (int first = 0; first < a->count; first += WIDEST) {
    wx at[3];
    for (int k = 0; k < 3; k++) { // lanes to spare ask what the first does
      const unsigned lanes = a->count - first < WIDEST ? (1u << (a->count - first)) - 1 : WIDEST_BITS;
      at[k] = wx_choose(lanes, wx_load(a->p[k] + first), wx_set(a->p[k][first]));
    }
    wx_store(values, sdf_run_f(f, f->codes + leaf->first, leaf->count, at, NULL));
    for (int i = 0; i < WIDEST && first + i < a->count; i++) {
      *a->value[first + i] = values[i];
      *a->flat[first + i] = leaf->flat;
    }
  }
}

// Follows the rays that are going until each has crossed or missed. is_any: a crossing before the ray's end is enough, it
// need not be found exactly. Returns how many places were asked about.
static SDF_LARGE uint64_t sdf_march(const Sdf *f, SdfGroup *groups, int count, bool is_any)
{
  unsigned left[SDF_GROUPS];
  SdfAsked asked;
  uint64_t total = 0;
  for (bool goes_on = true; goes_on;) {
    goes_on = false;
    sdf_skip_all(f, groups, count, is_any);
    for (int g = 0; g < count; g++) left[g] = groups[g].waiting;
    for (int g = 0; g < count; g++)
      while (left[g]) {
        const uint32_t leaf = groups[g].leaf[__builtin_ctz(left[g])];
        sdf_gather(groups + g, count - g, left + g, leaf, &asked);
        sdf_answer(f, f->leaves + leaf, &asked);
        total += (uint64_t)asked.count;
      }
    for (int g = 0; g < count; g++) {
      if (groups[g].waiting) sdf_take(f, &groups[g], is_any);
      goes_on |= groups[g].going != 0;
    }
  }
  return total;
}

// What is found at one place.
typedef struct SdfPlace {
  const SdfLeaf *leaf; // NULL: nothing is there
  float clear;         // of nothing: what is free about p, by sign
  float lo[3], width;  // of the cell; of the whole field, infinite
} SdfPlace;

static inline float sdf_first(wx x)
{
  float lanes[WIDEST];
  wx_store(lanes, x);
  return lanes[0];
}

static inline void sdf_place(const Sdf *f, const float p[3], SdfPlace *out)
{
  const wx at[3] = {wx_set(p[0]), wx_set(p[1]), wx_set(p[2])};
  SdfCells c;
  sdf_find(f, at, 1, &c);
  out->leaf = c.leaves & 1 ? f->leaves + c.leaf[0] : NULL;
  out->clear = sdf_first(c.clear);
  out->width = sdf_first(c.width);
  for (int k = 0; k < 3; k++) out->lo[k] = sdf_first(c.lo[k]);
}

// The value at a few places as rays see it, for who has to know on which side of the surface a ray will start.
static SDF_LARGE void sdf_values(const Sdf *f, const float (*p)[3], int count, float *values)
{
  SdfPlace at;
  for (int i = 0; i < count; i++) {
    sdf_place(f, p[i], &at);
    const wx place[3] = {wx_set(p[i][0]), wx_set(p[i][1]), wx_set(p[i][2])};
    values[i] = at.leaf ? sdf_first(sdf_run_f(f, f->codes + at.leaf->first, at.leaf->count, place, NULL)) : at.clear;
  }
}

#endif
