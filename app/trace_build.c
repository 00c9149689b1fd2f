// See trace_build.h.

#include "trace_build.h"

#include "library.h"
#include "trace_run.h"

#include <stdio.h>
#include <string.h>
#include <time.h>

enum { LEAST_BUILDS = 3, MOST_BUILDS = 64 };

static double process_seconds(void)
{
  struct timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

// --- memory, as Linux tells it -----------------------------------------------------------------------
// A line of /proc/self/status in bytes; negative: not to be had.
static double status_bytes(const char *key)
{
  char line[128];
  double bytes = -1;
  long kib;
  FILE *f = fopen("/proc/self/status", "r");
  if (!f) return bytes;
  while (bytes < 0 && fgets(line, sizeof line, f))
    if (!strncmp(line, key, strlen(key)) && sscanf(line + strlen(key), " %ld", &kib) == 1)
      bytes = 1024.0 * (double)kib;
  fclose(f);
  return bytes;
}

// What is in memory now; from here on VmHWM is the most since.
static double watch_peak(void)
{
  FILE *f = fopen("/proc/self/clear_refs", "w");
  if (!f) return -1;
  const bool is_reset = fputs("5", f) >= 0;
  return !fclose(f) && is_reset ? status_bytes("VmRSS:") : -1;
}

static double peak_since(double before)
{
  const double peak = status_bytes("VmHWM:");
  return before < 0 || peak < 0 ? -1 : peak - before;
}

// --- building --------------------------------------------------------------------------------------
static ExitCode build_once(rf_engine *engine, rf_scene *scene, double *seconds, TraceBuild *out)
{
  const double before = watch_peak(), start = seconds_now(), cpu_start = process_seconds();
  rf_world *world = rf_prepare(scene, NULL);
  const double cpu = process_seconds() - cpu_start;
  *seconds = seconds_now() - start;
  const double peak = peak_since(before);
  if (!world) return fail_library(engine);
  out->kept_bytes = (double)rf_world_take_stats(world).tree_bytes;
  if (cpu < out->cpu) out->cpu = cpu;
  if (peak > out->peak_bytes) out->peak_bytes = peak; // later builds find freed memory still there
  rf_world_destroy(world);
  return EXIT_DONE;
}

ExitCode trace_build(rf_engine *engine, rf_scene *scene, int most, double seconds, TraceBuild *out)
{
  double times[MOST_BUILDS], sum = 0;
  int count = 0;
  *out = (TraceBuild){.cpu = 1e30, .peak_bytes = -1};
  for (; count < MOST_BUILDS && (count < LEAST_BUILDS || (count < most && sum < seconds)); count++) {
    const ExitCode code = build_once(engine, scene, &times[count], out);
    if (code) return code;
    sum += times[count];
  }
  const TraceTimes t = trace_times(times, count);
  out->best = t.best;
  out->median = t.median;
  return EXIT_DONE;
}
