// Sdf march: where rays cross the surface of a field. Up to 64 rays go on together; each by itself decides its next
// place, and those that stand where the same steps of the tape count are asked in lanes. So a ray's way depends on nothing
// but the ray, however many go with it and however wide registers are.
//
// A ray goes on by what is free at its place (sphere tracing), a little more than that while the free balls still overlap
// (Keinert et al., "Enhanced Sphere Tracing", 2014), but by `detail` at least. A crossing is a change of sign, then closed
// in on to a float's last bits. Hence the promise: a part through which a ray goes for `detail` or longer is never
// missed, thinner ones may be. What is inside is followed like what is outside, so rays leave glass as they enter it.
//
// A ray that has not come to an end after SDF_MOST_MARCH places is close along the surface: that counts as a crossing if
// it is within `detail`, else it meets nothing.

#ifndef RAYFOLD_GEOM_SDF_MARCH_H
#define RAYFOLD_GEOM_SDF_MARCH_H

#include "geom/sdf.h"
#include "geom/tree_ray.h"

#include "geom/sdf_eval.h"

enum { SDF_RAYS = 64, SDF_MOST_MARCH = 1024, SDF_MOST_CLOSE = 16 };
#define SDF_RELAX 1.3f // of 1, 1.2, 1.3, 1.4 and 1.6 the best for 200 melted spheres and for the sponge

typedef enum SdfState { SDF_STARTS, SDF_MARCHES, SDF_CLOSES, SDF_CROSSED, SDF_MISSED } SdfState;

typedef struct SdfRay {
  float o[3], d[3], inv_length; // in the field's space; 1 / |d|
  float t, end;                 // the place to ask at, and how far it matters
  float low, low_free;          // the last place on the side where it began, and how far it was free there
  float high, high_free;        // a place on the other side, once there is one; not positive
  uint16_t places, closes;
  uint8_t state;                // SdfState
  bool moved_low;               // when closing in: which end moved last
  float side;                   // 1: outside, -1: inside
} SdfRay;

// What a ray finds at a place: the steps that count there, or that nothing is near.
typedef struct SdfPlace {
  const SdfLeaf *leaf; // NULL: nothing is there
  float clear;         // of nothing: what is free about p, by sign
  float lo[3], width;  // of the cell
} SdfPlace;

static inline bool sdf_is_inside_tree(const Sdf *f, const float p[3])
{
  bool inside = true;
  const float width = f->cell * (float)(1u << 2 * f->levels);
  for (int k = 0; k < 3; k++) inside &= p[k] >= f->lo[k] && p[k] <= f->lo[k] + width;
  return inside;
}

static inline void sdf_find(const Sdf *f, const float p[3], SdfPlace *out)
{
  out->leaf = f->leaves;
  out->width = INFINITY;
  out->clear = 0;
  if (!f->levels || !sdf_is_inside_tree(f, p)) return;
  uint32_t at[3], shift = 2 * f->levels;
  const uint32_t last = (1u << shift) - 1;
  for (int k = 0; k < 3; k++) {
    const uint32_t i = (uint32_t)((p[k] - f->lo[k]) * f->inv_cell);
    at[k] = i < last ? i : last;
  }
  const SdfNode *node = f->nodes;
  for (;;) {
    shift -= 2;
    const SdfEntry e = node->entries[(at[0] >> shift & 3) | (at[1] >> shift & 3) << 2 | (at[2] >> shift & 3) << 4];
    const uint32_t kind = e.link & SDF_LINK_KIND, i = e.link & ~SDF_LINK_KIND;
    if (kind == SDF_LINK_NODE) {
      node = f->nodes + i;
      continue;
    }
    out->width = f->cell * (float)(1u << shift);
    float away2 = 0;
    for (int k = 0; k < 3; k++) {
      out->lo[k] = f->lo[k] + f->cell * (float)(at[k] >> shift << shift);
      away2 += sqr_f(p[k] - (out->lo[k] + 0.5f * out->width));
    }
    if (kind == SDF_LINK_LEAF) {
      out->leaf = f->leaves + i;
      return;
    }
    out->leaf = NULL;
    const float free = max_f(fabsf(e.clear) - sqrtf(away2), 0x1p-20f * out->width);
    out->clear = copysignf(free, e.clear);
    return;
  }
}

// How far along the ray the cell reaches from t on.
static inline float sdf_cell_exit(const SdfRay *r, const SdfPlace *at)
{
  float exit = INFINITY;
  for (int k = 0; k < 3; k++) {
    const float wall = r->d[k] < 0 ? at->lo[k] : at->lo[k] + at->width;
    const float t = (wall - r->o[k]) / r->d[k];
    if (r->d[k] != 0) exit = min_f(exit, t);
  }
  return max_f(exit - r->t, 0);
}

// The ray made ready; false when it misses the field's box.
static inline bool sdf_begin(const Sdf *f, const TreeRay *ray, float end, SdfRay *r)
{
  float t0 = ray->tmin, t1 = end, length2 = 0;
  for (int k = 0; k < 3; k++) {
    r->o[k] = ray->o[k];
    r->d[k] = ray->d[k];
    length2 += sqr_f(ray->d[k]);
    if (ray->d[k] == 0) {
      if (!(r->o[k] >= f->bounds.lo[k] && r->o[k] <= f->bounds.hi[k])) return false;
      continue;
    }
    const float a = (f->bounds.lo[k] - r->o[k]) / r->d[k], b = (f->bounds.hi[k] - r->o[k]) / r->d[k];
    t0 = max_f(min_f(a, b), t0);
    t1 = min_f(max_f(a, b), t1);
  }
  r->inv_length = 1 / sqrtf(length2);
  r->t = t0;
  r->end = t1;
  r->places = r->closes = 0;
  r->state = SDF_STARTS;
  return t0 <= t1 * FAR_SLACK;
}

// On from a crossing, to find the next: as if the ray began on the other side of it.
static inline void sdf_go_on(SdfRay *r, float end)
{
  r->t = r->high * (1 + 0x1p-22f) + 0x1p-126f;
  r->end = min_f(r->end, end);
  r->low = r->high;
  r->low_free = INFINITY;
  r->side = -r->side;
  r->closes = 0;
  r->state = ++r->places < SDF_MOST_MARCH ? SDF_MARCHES : SDF_MISSED;
}

static inline float sdf_least_step(const Sdf *f, const SdfRay *r)
{
  return max_f(f->detail * r->inv_length, 0x1p-21f * r->t);
}

// Where to ask between the two ends: the secant through them (with Illinois' halving of an end that stays; Dowell and
// Jarratt 1971), kept off the ends. Ends when they are a few bits apart.
static inline void sdf_close(SdfRay *r)
{
  const float gap = r->high - r->low, part = r->low_free / (r->low_free - r->high_free);
  r->t = r->low + gap * clamp_f(part, 0.02f, 0.98f);
  if (!(gap > 0x1p-22f * r->high) || !(r->t > r->low && r->t < r->high) || r->closes++ >= SDF_MOST_CLOSE)
    r->state = SDF_CROSSED;
}

// The ray learns what is free at its place, times side: beyond a crossing it is negative. step: how far it may go.
static inline void sdf_learn(const Sdf *f, SdfRay *r, float free, float step, bool is_any)
{
  const float least = sdf_least_step(f, r);
  if (r->state == SDF_CLOSES) {
    if (free > 0) {
      if (r->moved_low) r->high_free *= 0.5f;
      r->low = r->t;
      r->low_free = free;
    } else {
      if (!r->moved_low) r->low_free *= 0.5f;
      r->high = r->t;
      r->high_free = free;
    }
    r->moved_low = free > 0;
    sdf_close(r);
    return;
  }
  if (r->state == SDF_MARCHES) {
    const float went = r->t - r->low, sure = max_f(r->low_free, least);
    if (went > sure * 1.0001f && free + r->low_free < went) { // too far: the free balls do not touch
      r->t = r->low + sure;
      r->low_free = INFINITY; // so that this is taken for sure
      return;
    }
    if (!(free > 0)) {
      r->high = r->t;
      r->high_free = min_f(free, -0x1p-30f * least);
      r->state = SDF_CLOSES;
      r->moved_low = false;
      if (!(r->low_free < INFINITY)) r->low_free = went;
      if (is_any && r->high < r->end)
        r->state = SDF_CROSSED;
      else
        sdf_close(r);
      return;
    }
  }
  if (!(r->t < r->end)) {
    r->state = SDF_MISSED;
    return;
  }
  if (++r->places >= SDF_MOST_MARCH) {
    r->high = r->t;
    r->state = free < 2 * least ? SDF_CROSSED : SDF_MISSED;
    return;
  }
  r->state = SDF_MARCHES;
  r->low = r->t;
  r->low_free = max_f(free, step);
  const float next = r->t + max_f(step > free ? step : free * SDF_RELAX, least);
  if (next > r->t)
    r->t = next;
  else
    r->state = SDF_MISSED; // no float is left ahead
}

// Goes through cells where nothing is; true: the ray now stands where a leaf has to be asked.
static inline bool sdf_skip(const Sdf *f, SdfRay *r, bool is_any, float p[3], SdfPlace *at)
{
  while (r->state < SDF_CROSSED) {
    for (int k = 0; k < 3; k++) p[k] = r->o[k] + r->t * r->d[k];
    sdf_find(f, p, at);
    if (at->leaf) return true;
    if (r->state == SDF_STARTS) r->side = at->clear < 0 ? -1 : 1;
    const float free = at->clear * r->side * r->inv_length;
    sdf_learn(f, r, free, max_f(free, sdf_cell_exit(r, at)), is_any);
  }
  return false;
}

// A leaf's answer.
static inline void sdf_take(const Sdf *f, SdfRay *r, const SdfPlace *at, float value, bool is_any)
{
  if (r->state == SDF_STARTS) r->side = value < 0 ? -1 : 1;
  const float own = value * r->side * r->inv_length, free = own * f->leaves->flat;
  // What is free by the cell's own steepness holds inside the cell alone.
  const bool is_flatter = at->leaf->flat > f->leaves->flat && own > 0;
  const float step = is_flatter ? max_f(free, min_f(own * at->leaf->flat, sdf_cell_exit(r, at))) : free;
  sdf_learn(f, r, free, step, is_any);
}

// Follows the rays in `set` until each has crossed or missed. is_any: a crossing before the ray's end is enough, it need
// not be found exactly. Returns how many places were asked about, and adds nothing to those done before.
static SDF_LARGE uint64_t sdf_march(const Sdf *f, SdfRay *rays, uint64_t set, bool is_any)
{
  SdfPlace places[SDF_RAYS];
  float p[SDF_RAYS][3], lanes[3][WIDEST], values[WIDEST];
  uint8_t ray_of[WIDEST];
  uint64_t asked = 0;
  while (set) {
    for (uint64_t left = set; left; left &= left - 1) {
      const int i = __builtin_ctzll(left);
      if (!sdf_skip(f, &rays[i], is_any, p[i], &places[i])) set &= ~(left & -left);
    }
    for (uint64_t left = set; left;) {
      const int first = __builtin_ctzll(left);
      const SdfLeaf *leaf = places[first].leaf;
      int count = 0;
      for (int l = 0; l < WIDEST; l++)
        for (int k = 0; k < 3; k++) lanes[k][l] = p[first][k];
      for (uint64_t same = left; same && count < WIDEST; same &= same - 1) {
        const int i = __builtin_ctzll(same);
        if (places[i].leaf != leaf) continue;
        for (int k = 0; k < 3; k++) lanes[k][count] = p[i][k];
        ray_of[count++] = (uint8_t)i;
        left &= ~(same & -same);
      }
      const wx at[3] = {wx_load(lanes[0]), wx_load(lanes[1]), wx_load(lanes[2])};
      wx_store(values, sdf_run_f(f, f->codes + leaf->first, leaf->count, at, NULL));
      for (int l = 0; l < count; l++) sdf_take(f, &rays[ray_of[l]], &places[ray_of[l]], values[l], is_any);
      asked += (uint64_t)count;
    }
  }
  return asked;
}

// The value at a few places as rays see it, for who has to know on which side of the surface a ray will start.
static SDF_LARGE void sdf_values(const Sdf *f, const float (*p)[3], int count, float *values)
{
  float lanes[3][WIDEST], out[WIDEST];
  SdfPlace at;
  for (int i = 0; i < count; i++) {
    sdf_find(f, p[i], &at);
    if (!at.leaf) {
      values[i] = at.clear;
      continue;
    }
    for (int k = 0; k < 3; k++)
      for (int l = 0; l < WIDEST; l++) lanes[k][l] = p[i][k];
    const wx place[3] = {wx_load(lanes[0]), wx_load(lanes[1]), wx_load(lanes[2])};
    wx_store(out, sdf_run_f(f, f->codes + at.leaf->first, at.leaf->count, place, NULL));
    values[i] = out[0];
  }
}

#endif
