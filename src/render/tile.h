// Tile: the samples of a pass for the pixels of one rectangle, from the sampler to the film. The camera's rays of a
// block of 8 x 8 pixels go together, so that they share their way through the trees.

#ifndef RAYFOLD_RENDER_TILE_H
#define RAYFOLD_RENDER_TILE_H

#include "render/path.h"
#include "render/views.h"

enum { BLOCK_SIDE = 8, BLOCK_PIXELS = BLOCK_SIDE * BLOCK_SIDE };

// One sample of each pixel of a block.
typedef struct Block {
  Tile pixels;
  uint32_t sample;
  size_t count; // of pixels, row by row
  Sampler samplers[BLOCK_PIXELS];
  uint32_t seeds[BLOCK_PIXELS];
  Ray rays[BLOCK_PIXELS];
  PackedRay packed[BLOCK_PIXELS];
  TraceQuery queries[BLOCK_PIXELS];
  Hit hits[BLOCK_PIXELS];
  Vec3 costs[BLOCK_PIXELS]; // of the cost view
} Block;

static inline void block_add_pixel(Block *b, const RenderPass *pass, uint32_t x, uint32_t y)
{
  const Film *film = pass->film;
  const size_t i = b->count++;
  const Sampler sampler = sampler_begin(x, y, b->sample, pass->seed);
  const Vec2 off = filter_sample(&pass->filter, sample_pair(&sampler, PAIR_FILM));
  const Vec2 place = {(float)x + 0.5f + off.x, (float)y + 0.5f + off.y};
  const Vec2 lens = pass->eye.aperture > 0 ? sample_pair(&sampler, PAIR_LENS) : (Vec2){0, 0};
  const Ray ray = eye_ray(&pass->eye, (float)film->width, (float)film->height, place, lens);
  b->samplers[i] = sampler;
  b->seeds[i] = hash_combine(sampler.pixel_seed, b->sample);
  b->rays[i] = ray;
  b->packed[i] =
      (PackedRay){{ray.o[0], ray.o[1], ray.o[2]}, ray.tmin, {ray.d[0], ray.d[1], ray.d[2]}, ray.tmax};
  b->queries[i] = (TraceQuery){pass->world, path_camera_seed(b->seeds[i])};
}

// The cost view asks what one ray costs by itself.
static inline void block_find_costs(Block *b, const RenderPass *pass, RayCounters *rays)
{
  for (size_t i = 0; i < b->count; i++) {
    const RayCounters before = *rays;
    trace_closest(pass->world, &b->rays[i], RAY_CAMERA, b->queries[i].seed, rays, &b->hits[i]);
    b->costs[i] = view_cost(&before, rays);
  }
}

static inline void block_render(Block *b, const RenderPass *pass, WorkerState *worker)
{
  b->count = 0;
  for (uint32_t y = b->pixels.y0; y < b->pixels.y1; y++)
    for (uint32_t x = b->pixels.x0; x < b->pixels.x1; x++) block_add_pixel(b, pass, x, y);
  if (pass->settings.integrator == INTEGRATOR_COST)
    block_find_costs(b, pass, &worker->rays);
  else
    trace_camera(pass->world, b->packed, b->queries, b->count, &worker->rays, b->hits);
  size_t i = 0;
  for (uint32_t y = b->pixels.y0; y < b->pixels.y1; y++)
    for (uint32_t x = b->pixels.x0; x < b->pixels.x1; x++, i++) {
      const FilmSample seen =
          pass->settings.integrator == INTEGRATOR_PATH
              ? path_render(pass, &b->samplers[i], b->rays[i], &b->hits[i], b->seeds[i], &worker->rays)
              : view_render(pass, b->rays[i], &b->hits[i], b->costs[i]);
      if (!film_add(pass->film, x, y, b->sample, &seen)) worker->bad_samples++;
    }
}

static inline uint32_t least_u32(uint32_t a, uint32_t b)
{
  return a < b ? a : b;
}

static bool tile_render(const RenderPass *pass, Tile tile, WorkerState *worker)
{
  Block b = {0};
  for (uint32_t y = tile.y0; y < tile.y1; y += BLOCK_SIDE)
    for (uint32_t x = tile.x0; x < tile.x1; x += BLOCK_SIDE) {
      b.pixels = (Tile){x, y, least_u32(x + BLOCK_SIDE, tile.x1), least_u32(y + BLOCK_SIDE, tile.y1)};
      for (b.sample = pass->first_sample; b.sample < pass->end_sample; b.sample++) {
        if (is_cancelled(pass->cancel) || is_cancelled(pass->stop)) return false;
        block_render(&b, pass, worker);
      }
    }
  return true;
}

#endif
