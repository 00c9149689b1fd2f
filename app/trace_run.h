// Trace run: all rays of a file once through a world, by threads that take chunks off one counter, timed as the
// yardstick in bench/ times Embree, so that the figures compare: a run includes reading each 32-byte ray and writing
// its 16-byte result.

#ifndef RAYFOLD_APP_TRACE_RUN_H
#define RAYFOLD_APP_TRACE_RUN_H

#include "ray_file.h"

typedef enum TraceApi {
  TRACE_SINGLE, // one ray a call
  TRACE_BATCH,
} TraceApi;

enum { MOST_TRACE_THREADS = 256 };

typedef struct TraceRun {
  const rf_world *world;
  const RayFile *rays;
  RayResult *results; // as many
  TraceApi api;
  int threads;
} TraceRun;

// Seconds by the wall clock, or with RTB_CPU in the environment the mean processor time of the threads, which is the
// steadier figure on a machine with other work. Negative: a thread could not be started.
double trace_run(const TraceRun *run);

typedef struct TraceTimes {
  double best, median;
} TraceTimes;

// One run to warm up, then at least `least` and until `seconds` are spent. False: as trace_run().
bool trace_measure(const TraceRun *run, int least, double seconds, TraceTimes *out);

// Sorts the values.
TraceTimes trace_times(double *seconds, int count);

#endif
