// Density: how thick a medium is at a place in its object's space, 0 and above. It multiplies a volume's coefficients.
// Each comes with a coarse grid of bounds over its box, so that light can be followed by steps that suit the place
// (Woodcock et al. 1965, "Techniques used in the GEM code", with local bounds). world/density.c makes both. Hot.
//
//   box lo..hi, divided into cells[]      most[z][y][x]: density_at() is nowhere in the cell above it
//
// Outside of the box the density is 0. Some know more than how thick they are: what colour scatters there (tint), and what
// shines there (glow).

#ifndef RAYFOLD_SHADE_DENSITY_H
#define RAYFOLD_SHADE_DENSITY_H

#include "base/err.h"
#include "base/fmath.h"
#include "base/vec.h"
#include "image/voxels.h"

#include <stddef.h>

typedef enum DensityKind { DENSITY_GRID, DENSITY_BALL, DENSITY_VOXELS } DensityKind;

// Values in a box, each in the middle of its voxel.
typedef struct DensityValues {
  Vec3 lo, hi;
  uint32_t size[3]; // along x, y, z
  float *values;    // x fastest; NULL: none
} DensityValues;

typedef struct Density {
  uint8_t kind; // DensityKind
  bool has_tint, has_glow;
  Vec3 lo, hi;
  uint32_t cells[3];
  float *most;
  DensityValues heat; // how hot it is, by what a medium's temperature counts; none: 1
  union {
    DensityValues grid;
    struct {
      Vec3 waves_origin;
      float radius, waves;
    } ball;
    struct {
      Voxels *cells;       // a cell is one unit wide; 1 in those that are filled
      Vec3 *tints, *glows; // by entry
    } voxels;
  };
} Density;

// Trilinear between the middles of voxels; beyond the outermost middles as there.
static inline float density_mix(const DensityValues *g, Vec3 p)
{
  size_t at[3], step[3];
  float part[3];
  size_t stride = 1, base = 0;
  for (int k = 0; k < 3; k++) {
    const float last = (float)(g->size[k] - 1);
    const float x = clamp_f((p[k] - g->lo[k]) / (g->hi[k] - g->lo[k]) * (float)g->size[k] - 0.5f, 0, last);
    const float whole = min_f(floorf(x), max_f(last - 1, 0));
    at[k] = (size_t)whole;
    part[k] = x - whole;
    base += at[k] * stride;
    step[k] = g->size[k] > 1 ? stride : 0;
    stride *= g->size[k];
  }
  const float *v = g->values + base;
  const float x00 = mix_f(v[0], v[step[0]], part[0]);
  const float x10 = mix_f(v[step[1]], v[step[1] + step[0]], part[0]);
  const float x01 = mix_f(v[step[2]], v[step[2] + step[0]], part[0]);
  const float x11 = mix_f(v[step[2] + step[1]], v[step[2] + step[1] + step[0]], part[0]);
  return mix_f(mix_f(x00, x10, part[1]), mix_f(x01, x11, part[1]), part[2]);
}

static inline float density_ball(const Density *d, Vec3 p)
{
  const float inside = 1 - v3_length(p) / d->ball.radius;
  if (!(inside > 0)) return 0;
  const Vec3 w = d->ball.waves * (p - d->ball.waves_origin);
  return inside * (0.5f + 0.5f * f_sin(w[0]) * f_sin(w[1]) * f_sin(w[2]));
}

// 0: empty.
static inline uint32_t density_entry(const Density *d, Vec3 p)
{
  return voxels_entry(d->voxels.cells, (int32_t)floorf(p[0]), (int32_t)floorf(p[1]), (int32_t)floorf(p[2]));
}

static inline float density_at(const Density *d, Vec3 p)
{
  for (int k = 0; k < 3; k++)
    if (!(p[k] >= d->lo[k] && p[k] <= d->hi[k])) return 0;
  switch ((DensityKind)d->kind) {
  case DENSITY_GRID: return density_mix(&d->grid, p);
  case DENSITY_BALL: return density_ball(d, p);
  case DENSITY_VOXELS: return density_entry(d, p) ? 1 : 0;
  }
  unreachable();
}

// What of the medium's scattering there is at a place inside, by colour; the rest of it is absorbed there.
static inline Vec3 density_tint(const Density *d, Vec3 p)
{
  switch ((DensityKind)d->kind) {
  case DENSITY_GRID:
  case DENSITY_BALL: return v3_all(1);
  case DENSITY_VOXELS: return d->voxels.tints[density_entry(d, p)];
  }
  unreachable();
}

// What it shines with there, seen through so much of it that nothing is seen behind: radiance.
static inline Vec3 density_glow(const Density *d, Vec3 p)
{
  switch ((DensityKind)d->kind) {
  case DENSITY_GRID:
  case DENSITY_BALL: return v3_all(0);
  case DENSITY_VOXELS: return d->voxels.glows[density_entry(d, p)];
  }
  unreachable();
}

static inline float density_heat(const Density *d, Vec3 p)
{
  return d->heat.values ? density_mix(&d->heat, p) : 1;
}

// --- bounds along a ray -----------------------------------------------------------------------------

// A walk through the cells a line meets, in order (Amanatides and Woo, "A fast voxel traversal algorithm", 1987).
typedef struct DensityWalk {
  const Density *density;
  float t, next[3], step_t[3], end; // t: where the present cell is entered or the walk has come to
  int32_t cell[3], step[3];
} DensityWalk;

static inline float density_most(const DensityWalk *w)
{
  const Density *d = w->density;
  return d->most[((size_t)w->cell[2] * d->cells[1] + (size_t)w->cell[1]) * d->cells[0] + (size_t)w->cell[0]];
}

static inline float density_cell_end(const DensityWalk *w)
{
  return min_f(min_f(w->next[0], w->next[1]), min_f(w->next[2], w->end));
}

// Begins at `from` on the line o + t d; false if it meets nothing up to `to`.
static inline bool density_walk(const Density *density, Vec3 o, Vec3 d, float from, float to, DensityWalk *w)
{
  w->density = density;
  for (int k = 0; k < 3; k++) {
    const float a = (density->lo[k] - o[k]) / d[k], b = (density->hi[k] - o[k]) / d[k];
    if (d[k] == 0 && !(o[k] >= density->lo[k] && o[k] <= density->hi[k])) return false;
    if (d[k] == 0) continue;
    from = max_f(from, min_f(a, b));
    to = min_f(to, max_f(a, b));
  }
  if (!(from < to)) return false;
  w->t = from;
  w->end = to;
  for (int k = 0; k < 3; k++) {
    const float width = (density->hi[k] - density->lo[k]) / (float)density->cells[k];
    const float at = (o[k] + from * d[k] - density->lo[k]) / width;
    w->cell[k] = (int32_t)clamp_f(at, 0, (float)density->cells[k] - 0.5f);
    w->step[k] = d[k] < 0 ? -1 : 1;
    w->step_t[k] = width / fabsf(d[k]);
    w->next[k] = d[k] == 0 ? INFINITY
                           : (density->lo[k] + (float)(w->cell[k] + (d[k] > 0)) * width - o[k]) / d[k];
  }
  return true;
}

// Goes on to the next cell; false at the end.
static inline bool density_step(DensityWalk *w)
{
  const int k = w->next[0] < w->next[1] ? (w->next[0] < w->next[2] ? 0 : 2) : (w->next[1] < w->next[2] ? 1 : 2);
  if (!(w->next[k] < w->end)) return false;
  w->t = max_f(w->t, w->next[k]);
  w->next[k] += w->step_t[k];
  w->cell[k] += w->step[k];
  return w->cell[k] >= 0 && w->cell[k] < (int32_t)w->density->cells[k];
}

#endif
