// Render: drives a picture. Samples come in passes over the picture, small ones first, each cut into tiles that
// workers take off one counter. The film after n samples is the same however they were cut into passes, tiles, calls
// or machines. Which samples of which part a pass takes is plan.h's.

#ifndef RAYFOLD_RENDER_RENDER_H
#define RAYFOLD_RENDER_RENDER_H

#include "render/hot.h"

typedef enum RenderGo { // the order of rf_go
  RENDER_GO_ON,
  RENDER_STOP_AFTER_PASS, // finish the pass, then stop; the film holds whole passes
  RENDER_STOP_NOW,        // break off; pixels may differ in their number of samples
} RenderGo;

typedef struct RenderProgress {
  double done;         // 0..1
  double seconds, eta; // since the start; still to go at this rate
  double samples;      // a pixel, in this call
  double left;         // samples a pixel still to take; with a noise target, an estimate
  double noise;        // film_noise() after the last pass; 0: unknown
  double quiet;        // the part of the cells that are down to the noise target; 0 without one
  uint64_t rays;       // up to the last pass
} RenderProgress;

// What is seen, and from where, in a part of the time a shutter is open.
typedef struct RenderMoment {
  const World *world;
  Eye eye;
} RenderMoment;

enum { MOST_MOMENTS = 64 };

typedef struct RenderJob {
  const World *world;
  Eye eye;
  // Where something moves: 2 to MOST_MOMENTS, in order, all as long; world and eye are then not looked at. Each sample of
  // each pixel sees one of them, the first n samples each of them equally often, to within one.
  const RenderMoment *moments;
  uint32_t moment_count;   // 0: nothing moves
  RenderSettings settings; // size, spp and seed in it are not looked at
  uint64_t seed;
  Film *film;                        // gets the samples; its size is the picture's
  uint32_t first_sample, end_sample; // [first, end) of every pixel; those that the film has are left out
  uint32_t part, part_end, parts;    // only the cells of parts [part, part_end) of so many; 0, 0, 0: all
  uint32_t tile_size;                // pixels; 0: 16
  double budget_seconds;             // stop after the pass that reaches it; 0: take all samples
  double noise_target;               // cells stop when their noise is this low; 0: likewise
  RenderGo (*progress)(void *user,
                       const RenderProgress *p); // on the calling thread, about ten times a second and
  void *user;                                    // after each pass; may be NULL
} RenderJob;

typedef struct RenderStats {
  double seconds;
  RayCounters rays;
  uint64_t bad_samples; // not finite, counted as black; should be 0
  uint32_t samples;     // most that any pixel got
  double mean_samples;  // a pixel
  double noise, quiet;  // as in RenderProgress, at the end
  bool is_complete;     // nothing is left to take: all samples are in, or the noise is reached everywhere
} RenderStats;

// Adds samples to the film. True also when the budget, the noise target or RENDER_STOP_AFTER_PASS ended it early.
// ERR_CANCELLED within 50 ms of a cancel or RENDER_STOP_NOW: the film stays usable, each pixel with the samples it
// got, and is marked is_partial. jobs, cancel and stats may be NULL.
bool render_run(const RenderJob *job, Jobs *jobs, const HotTable *hot, const Cancel *cancel,
                RenderStats *stats, Err *err);

#endif
