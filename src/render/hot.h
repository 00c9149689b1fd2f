// Hot: the door between the cold side of rendering and the code that runs per ray. hot.c is compiled once per
// instruction set and only its table leaves it; the work handed over is coarse, a tile or a batch of rays.

#ifndef RAYFOLD_RENDER_HOT_H
#define RAYFOLD_RENDER_HOT_H

#include "base/cpu.h"
#include "base/jobs.h"
#include "post/kernels.h"
#include "render/camera.h"
#include "render/film.h"
#include "render/filter.h"
#include "render/subsample.h"
#include "world/world.h"

// Some samples of every pixel: all a tile needs to know. Read only while tiles are rendered, but for the film.
typedef struct RenderPass {
  const World *world;
  Eye eye;
  RenderSettings settings; // size, spp and seed are not looked at: they are here
  Filter filter;
  uint32_t seed;
  uint32_t first_sample, end_sample; // [first, end)
  Film *film;
  const Cancel *cancel, *stop; // either ends the tile early; may be NULL
} RenderPass;

typedef struct Tile {
  uint32_t x0, y0, x1, y1; // pixels [x0, x1) x [y0, y1)
} Tile;

// One per worker, so that nothing is shared while rays are traced.
typedef struct WorkerState {
  RayCounters rays;
  uint64_t bad_samples; // not finite, counted as black
} __attribute__((aligned(64))) WorkerState;

// What a sample of a pixel sees.
typedef struct HotLook {
  Vec3 radiance;
  uint32_t signature; // whitted.h: equal ones may be mixed
  uint32_t object;    // 1 + index; 0: nothing
} HotLook;

typedef struct HotTable {
  const char *name; // of the level
  // Adds the pass's samples of the tile's pixels to the film; false if it was broken off between two pixels.
  bool (*render_tile)(const RenderPass *pass, Tile tile, WorkerState *worker);
  // Samples of up to SUBSAMPLE_PACKET pixels by the integrator whitted: the first of the pass's. Nothing is added to the
  // film, of which only the size is looked at. scratch: look_bytes of the worker's own, 64-byte aligned, of which the
  // first pointer is NULL before the pass's first call.
  size_t look_bytes;
  void (*look_at)(const RenderPass *pass, const SubsamplePixel *pixels, size_t count, HotLook *out, WorkerState *worker,
                  void *scratch);
  // Closest hits (instance NO_HIT: none) and "is anything in the way" of bare geometry: every instance counts, whoever
  // it is visible to, and alpha is not looked at.
  void (*closest_n)(const Accel *accel, const PackedRay *rays, Hit *hits, size_t count);
  void (*any_n)(const Accel *accel, const PackedRay *rays, uint8_t *blocked, size_t count);
  // One piece of a ray's way: what it meets in its cell, and, if that is a gate, which; of what every ray can see.
  void (*piece)(const World *world, const Ray *ray, const Way *way, Hit *hit, SpaceExit *end);
  PostKernels post;
} HotTable;

// The table of a level; of the next lower one if this build has no code for it.
const HotTable *hot_table(IsaLevel level);

#endif
