// Tile: the samples of a pass for the pixels of one rectangle, from the sampler to the film.

#ifndef RAYFOLD_RENDER_TILE_H
#define RAYFOLD_RENDER_TILE_H

#include "render/path.h"
#include "render/views.h"

static inline void tile_sample(const RenderPass *pass, uint32_t x, uint32_t y, uint32_t sample,
                               WorkerState *worker)
{
  Film *film = pass->film;
  const Sampler sampler = sampler_begin(x, y, sample, pass->seed);
  const Vec2 off = filter_sample(&pass->filter, sample_pair(&sampler, PAIR_FILM));
  const Vec2 place = {(float)x + 0.5f + off.x, (float)y + 0.5f + off.y};
  const Vec2 lens = pass->eye.aperture > 0 ? sample_pair(&sampler, PAIR_LENS) : (Vec2){0, 0};
  const Ray ray = eye_ray(&pass->eye, (float)film->width, (float)film->height, place, lens);
  const uint32_t seed = hash_combine(sampler.pixel_seed, sample);
  const FilmSample seen = pass->settings.integrator == INTEGRATOR_PATH
                              ? path_render(pass, &sampler, ray, seed, &worker->rays)
                              : view_render(pass, ray, seed, &worker->rays);
  if (!film_add(film, x, y, sample, &seen)) worker->bad_samples++;
}

static bool tile_render(const RenderPass *pass, Tile tile, WorkerState *worker)
{
  for (uint32_t y = tile.y0; y < tile.y1; y++) {
    for (uint32_t x = tile.x0; x < tile.x1; x++) {
      if (is_cancelled(pass->cancel) || is_cancelled(pass->stop)) return false;
      for (uint32_t i = pass->first_sample; i < pass->end_sample; i++) tile_sample(pass, x, y, i, worker);
    }
  }
  return true;
}

#endif
