// Tile: the samples of a pass for the pixels of one rectangle, from the sampler to the film. The paths of a block of
// 8 x 8 pixels go together, so that their rays share their way through the trees.

#ifndef RAYFOLD_RENDER_TILE_H
#define RAYFOLD_RENDER_TILE_H

#include "render/classic.h"
#include "render/views.h"
#include "render/whitted.h"

enum { BLOCK_SIDE = 8 };
_Static_assert(BLOCK_SIDE *BLOCK_SIDE <= WAVE_SIZE, "a block's paths are one wave");

// Debug views. That of cost asks what one ray costs by itself.
static inline void block_view(Wave *w)
{
  const bool is_cost = w->pass->settings.integrator == INTEGRATOR_COST;
  if (!is_cost) wave_look(w);
  for (size_t i = 0; i < w->count; i++) {
    Ray ray = ray_unpack(&w->rays[i]);
    const RayCounters before = *w->counters;
    if (is_cost)
      way_closest(w->pass->world, &ray, &w->ways[i], RAY_CAMERA, w->queries[i].seed, w->counters, &w->hits[i]);
    w->seen[i] = view_render(w->pass, ray, &w->ways[i], &w->eye_rays[i], w->paths[i].cone, &w->hits[i], view_cost(&before, w->counters));
  }
}

static inline uint32_t least_u32(uint32_t a, uint32_t b)
{
  return a < b ? a : b;
}

static inline void block_render(Classic *c, const RenderPass *pass, const Tile *block, uint32_t sample,
                                WorkerState *worker)
{
  Wave *w = &c->chain;
  classic_begin(c, pass, &worker->rays, sample);
  for (uint32_t y = block->y0; y < block->y1; y++)
    for (uint32_t x = block->x0; x < block->x1; x++) classic_add(c, x, y);
  if (pass->settings.integrator == INTEGRATOR_PATH)
    wave_trace(w);
  else if (pass->settings.integrator == INTEGRATOR_CLASSIC)
    classic_trace(c);
  else
    block_view(w);
  size_t i = 0;
  for (uint32_t y = block->y0; y < block->y1; y++)
    for (uint32_t x = block->x0; x < block->x1; x++)
      if (!film_add(pass->film, x, y, sample, &w->seen[i++])) worker->bad_samples++;
}

static inline void block_whitted(Whitted *t, const RenderPass *pass, const Tile *block, uint32_t sample,
                                 WorkerState *worker)
{
  whitted_begin(t, sample);
  for (uint32_t y = block->y0; y < block->y1; y++)
    for (uint32_t x = block->x0; x < block->x1; x++) whitted_add(t, x, y);
  whitted_trace(t);
  size_t i = 0;
  for (uint32_t y = block->y0; y < block->y1; y++)
    for (uint32_t x = block->x0; x < block->x1; x++)
      if (!film_add(pass->film, x, y, sample, &t->seen[i++])) worker->bad_samples++;
}

static bool tile_render(const RenderPass *pass, Tile tile, WorkerState *worker)
{
  union {
    Classic c;
    Whitted t;
  } by;
  if (pass->settings.integrator == INTEGRATOR_WHITTED) {
    whitted_place(&by.t, pass, &worker->rays, false);
  } else {
    wave_place_eye(&by.c.chain, pass, &worker->rays);
    wave_place_eye(&by.c.side, pass, &worker->rays);
  }
  for (uint32_t y = tile.y0; y < tile.y1; y += BLOCK_SIDE)
    for (uint32_t x = tile.x0; x < tile.x1; x += BLOCK_SIDE) {
      const Tile block = {x, y, least_u32(x + BLOCK_SIDE, tile.x1), least_u32(y + BLOCK_SIDE, tile.y1)};
      for (uint32_t sample = pass->first_sample; sample < pass->end_sample; sample++) {
        if (is_cancelled(pass->cancel) || is_cancelled(pass->stop)) return false;
        if (pass->settings.integrator == INTEGRATOR_WHITTED)
          block_whitted(&by.t, pass, &block, sample, worker);
        else
          block_render(&by.c, pass, &block, sample, worker);
      }
    }
  return true;
}

_Static_assert((int)SUBSAMPLE_PACKET <= (int)WHITTED_SIZE, "a packet of pixels is one of rays");

static void pixels_look_at(const RenderPass *pass, const SubsamplePixel *pixels, size_t count, HotLook *out,
                           WorkerState *worker, void *scratch)
{
  Whitted *t = scratch;
  if (t->pass != pass) whitted_place(t, pass, &worker->rays, true);
  whitted_begin(t, pass->first_sample);
  for (size_t i = 0; i < count; i++) whitted_add(t, pixels[i].x, pixels[i].y);
  whitted_trace(t);
  for (size_t i = 0; i < count; i++)
    out[i] = (HotLook){t->seen[i].radiance, t->signature[i], t->seen[i].is_hit ? t->seen[i].object : 0};
}

#endif
