// Trace build: how long a world takes to prepare and what its trees hold, as the yardstick in bench/ measures
// Embree's.

#ifndef RAYFOLD_APP_TRACE_BUILD_H
#define RAYFOLD_APP_TRACE_BUILD_H

#include "say.h"

#include <stddef.h>

typedef struct TraceBuild {
  double best, median, cpu; // seconds: by the clock, and the least processor time of all threads together
  double kept_bytes,
      peak_bytes; // trees; the most memory preparing added, negative where the system does not tell
} TraceBuild;

// Prepares the scene at least three times, and up to `most` times while they take less than `seconds` together.
ExitCode trace_build(rf_engine *engine, rf_scene *scene, int most, double seconds, TraceBuild *out);

#endif
