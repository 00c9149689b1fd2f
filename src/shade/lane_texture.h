// Lane texture: what texture_lookup.h does for one place, for as many as a register has lanes. Of patterns only the
// checker, whose mean over what a pixel covers has a closed form without branches; others go one by one.

#ifndef RAYFOLD_SHADE_LANE_TEXTURE_H
#define RAYFOLD_SHADE_LANE_TEXTURE_H

#include "base/wide3.h"
#include "shade/texture_lookup.h"

// Places in a texture, and the two axes of what a ray covers there, from end to end (texture_spot has one of them).
typedef struct LaneSpot {
  wx x, y;
  wx along[2], across[2];
} LaneSpot;

// In periods of a checker, two tiles: a ray that covers more sees tiles mixed, and their mean changes little from place to
// place.
#define TILE_SHARP 0.7f

static inline wx lane_fraction(wx x) { return x - wx_floor(x); }

// pattern_square
static inline wx lane_square(wx x, wx width)
{
  const wx f = lane_fraction(x), one = wx_set(1);
  const unsigned is_sharp = ~wx_lt(wx_set(PATTERN_SHARP), width);
  const wx sharp = wx_choose(wx_le(wx_set(0.5f), f), one, -one);
  if ((is_sharp & WIDEST_BITS) == WIDEST_BITS) return sharp;
  const wx low = lane_fraction(x - width / 2), high = lane_fraction(x + width / 2);
  const wx mean = (wx_min(low, 1 - low) - wx_min(high, 1 - high)) / wx_max(width, wx_set(PATTERN_SHARP));
  return wx_choose(is_sharp, sharp, mean);
}

// The part of color_b, as texture_pattern() has it.
static inline wx lane_checker(const TextureMap *t, const LaneSpot *s, wxu *tile)
{
  const wx zero = wx_set(0), one = wx_set(1), *a = s->along, *b = s->across;
  const wx p = a[0] * a[0] + b[0] * b[0], q = a[0] * a[1] + b[0] * b[1], r = a[1] * a[1] + b[1] * b[1];
  const wx mean = 0.5f * (p + r), half = 0.5f * (p - r), root = wx_sqrt(half * half + q * q), large = mean + root;
  const unsigned has_size = wx_lt(zero, large) & wx_lt(large, wx_set(1e30f));
  const unsigned is_wide = wx_lt(r, p);
  const wx ex = wx_choose(is_wide, half + root, q), ey = wx_choose(is_wide, q, root - half);
  const wx norm = wx_sqrt(ex * ex + ey * ey);
  const unsigned has_axis = wx_lt(zero, norm);
  const wx axis_x = wx_choose(has_axis, ex / norm, one), axis_y = wx_choose(has_axis, ey / norm, zero);
  const wx length = wx_choose(has_size, wx_sqrt(wx_max(large, zero)), zero);
  const wx width = wx_choose(has_size, wx_abs(a[0] * b[1] - a[1] * b[0]) / length, zero);
  // spot_probes
  const wx ratio = length / wx_max(width, wx_set(0.05f)), most = wx_set(TEXTURE_MOST_PROBES);
  const wx rounded = -wx_floor(-ratio);
  wx count = wx_min(wx_max(rounded, one), most);
  if (t->minify == TEXTURE_TRILINEAR) count = one;
  const wx along = length / count, across = wx_choose(wx_eq(count, one), length, width);
  const wx box_x = wx_sqrt(along * axis_x * (along * axis_x) + across * axis_y * (across * axis_y));
  const wx box_y = wx_sqrt(along * axis_y * (along * axis_y) + across * axis_x * (across * axis_x));
  // Within a tile that is larger than what is covered, colours are alike.
  const unsigned is_fine = wx_lt(box_x, wx_set(TILE_SHARP)) & wx_lt(box_y, wx_set(TILE_SHARP));
  const wx cell_x = wx_clamp(wx_floor(2 * s->x), -0x1p30f, 0x1p30f), cell_y = wx_clamp(wx_floor(2 * s->y), -0x1p30f, 0x1p30f);
  const wxu cell = wxu_hash_combine((wxu)wx_truncate(cell_x), (wxu)wx_truncate(cell_y));
  *tile = wxu_choose(is_fine, cell, wxu_set(0));
  wx sum = zero;
  const float end = wx_most(count);
  for (float i = 0; i < end; i++) {
    const wx k = length * ((i + 0.5f) / count - 0.5f);
    const wx part = 0.5f - 0.5f * lane_square(s->x + k * axis_x, box_x) * lane_square(s->y + k * axis_y, box_y);
    sum += wx_choose(wx_lt(wx_set(i), count), part, zero);
  }
  return sum / count;
}

// Which tile of a checker is seen, for one place; 0: other textures, or many tiles at once.
static inline uint32_t texture_tile(const TextureMap *t, const SurfacePoint *s)
{
  if (t->kind != TEXTURE_MAP_CHECKER) return 0;
  const TextureSpot spot = texture_spot(t, s, (Vec2){1, 1});
  if (!(spot.length < TILE_SHARP) || !(fabsf(spot.at.x) + fabsf(spot.at.y) < 0x1p29f)) return 0;
  return hash_combine((uint32_t)(int32_t)floorf(2 * spot.at.x), (uint32_t)(int32_t)floorf(2 * spot.at.y));
}

// Its colours; u and v, and how they change along a ray's two axes, before the texture's own map.
static inline Wide3 lane_checker_color(const TextureMap *t, wx u, wx v, const wx du[2], const wx dv[2], wxu *tile)
{
  const float (*m)[3] = t->uv_map;
  LaneSpot s = {m[0][0] * u + m[0][1] * v + m[0][2], m[1][0] * u + m[1][1] * v + m[1][2],
                {wx_set(0), wx_set(0)}, {wx_set(0), wx_set(0)}};
  for (int k = 0; k < 2 && t->minify != TEXTURE_UNFILTERED; k++) {
    s.along[k] = m[k][0] * du[0] + m[k][1] * dv[0];
    s.across[k] = m[k][0] * du[1] + m[k][1] * dv[1];
  }
  const wx part = lane_checker(t, &s, tile);
  return w3_add(w3_scale(w3_of(v3_load(t->color_a)), 1 - part), w3_scale(w3_of(v3_load(t->color_b)), part));
}

#endif
