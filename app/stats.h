// Stats: what `render --stats FILE` writes, one JSON object.

#ifndef RAYFOLD_APP_STATS_H
#define RAYFOLD_APP_STATS_H

#include "say.h"

typedef struct Stats {
  const char *scene; // as it was named on the command line
  const char *isa;
  int threads, width, height;
  double load, prepare, render, denoise, write; // seconds; write has developing in it
  rf_render_stats rendered;            // summed over all ranges of samples
  rf_world_stats world;
  uint64_t hash;
} Stats;

ExitCode stats_write(const Stats *s, const char *path);

// Adds one more render to a sum.
void stats_add(rf_render_stats *sum, const rf_render_stats *more);
uint64_t stats_rays(const rf_render_stats *r); // traced, all kinds

#endif
