// See trace_run.h.

#include "trace_run.h"

#include "library.h"

#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <time.h>

enum {
  CHUNK = 4096, // rays a thread takes at a time
  BLOCK = 1024, // rays a call: their hits, 24 KiB, stay in the first cache until they are results
  MOST_RUNS = 1000,
};

typedef struct Worker {
  const TraceRun *run;
  atomic_size_t *next; // the only thing threads share: each value is one thread's chunk
  int number;
  double seconds; // of processor time
} Worker;

// --- one chunk, by each interface ------------------------------------------------------------------
static RayResult result_of(const rf_hit *hit)
{
  return (RayResult){hit->t, hit->object.id ? hit->part : RAY_MISS, hit->u, hit->v};
}

static RayResult result_of_any(bool is_blocked)
{
  return (RayResult){.prim = is_blocked ? 0 : RAY_MISS};
}

static void closest_single(const rf_world *world, const rf_ray *rays, RayResult *out, size_t count)
{
  for (size_t i = 0; i < count; i++) {
    rf_hit hit;
    rf_intersect(world, &rays[i], &hit);
    out[i] = result_of(&hit);
  }
}

static void any_single(const rf_world *world, const rf_ray *rays, RayResult *out, size_t count)
{
  for (size_t i = 0; i < count; i++) out[i] = result_of_any(rf_occluded(world, &rays[i]));
}

static void closest_batch(const rf_world *world, const rf_ray *rays, RayResult *out, size_t count)
{
  rf_hit hits[BLOCK];
  for (size_t first = 0; first < count; first += BLOCK) {
    const size_t n = count - first < BLOCK ? count - first : BLOCK;
    rf_intersect_n(world, rays + first, hits, n);
    for (size_t i = 0; i < n; i++) out[first + i] = result_of(&hits[i]);
  }
}

static void any_batch(const rf_world *world, const rf_ray *rays, RayResult *out, size_t count)
{
  uint8_t blocked[BLOCK];
  for (size_t first = 0; first < count; first += BLOCK) {
    const size_t n = count - first < BLOCK ? count - first : BLOCK;
    rf_occluded_n(world, rays + first, blocked, n);
    for (size_t i = 0; i < n; i++) out[first + i] = result_of_any(blocked[i]);
  }
}

static void trace_chunk(const TraceRun *r, size_t first, size_t count)
{
  const rf_ray *rays = r->rays->rays + first;
  RayResult *out = r->results + first;
  switch (r->api) {
  case TRACE_SINGLE: (r->rays->is_any ? any_single : closest_single)(r->world, rays, out, count); return;
  case TRACE_BATCH: (r->rays->is_any ? any_batch : closest_batch)(r->world, rays, out, count); return;
  }
}

// --- threads ---------------------------------------------------------------------------------------
// Ties this thread to the number-th processor that the process may use, so that the system moves none about.
static void pin(int number)
{
  cpu_set_t all, one;
  if (sched_getaffinity(0, sizeof all, &all)) return; // not pinned: slower perhaps, not wrong
  int left = number % CPU_COUNT(&all);
  for (int cpu = 0; cpu < CPU_SETSIZE; cpu++) {
    if (!CPU_ISSET(cpu, &all) || left-- > 0) continue;
    CPU_ZERO(&one);
    CPU_SET(cpu, &one);
    pthread_setaffinity_np(pthread_self(), sizeof one, &one);
    return;
  }
}

static double thread_seconds(void)
{
  struct timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void *work(void *user)
{
  Worker *w = user;
  const size_t count = w->run->rays->count;
  pin(w->number);
  const double start = thread_seconds();
  for (size_t i; (i = atomic_fetch_add_explicit(w->next, CHUNK, memory_order_relaxed)) < count;)
    trace_chunk(w->run, i, count - i < CHUNK ? count - i : CHUNK);
  w->seconds = thread_seconds() - start;
  return NULL;
}

double trace_run(const TraceRun *run)
{
  pthread_t threads[MOST_TRACE_THREADS];
  Worker workers[MOST_TRACE_THREADS];
  atomic_size_t next;
  atomic_init(&next, 0);
  int started = 0;
  double cpu = 0;
  const double start = seconds_now();
  for (; started < run->threads; started++) {
    workers[started] = (Worker){.run = run, .next = &next, .number = started};
    if (pthread_create(&threads[started], NULL, work, &workers[started])) break;
  }
  for (int i = 0; i < started; i++) {
    pthread_join(threads[i], NULL);
    cpu += workers[i].seconds / started;
  }
  const double wall = seconds_now() - start;
  if (started < run->threads) return -1;
  return getenv("RTB_CPU") ? cpu : wall;
}

// --- times -----------------------------------------------------------------------------------------
static int by_size(const void *a, const void *b)
{
  const double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

TraceTimes trace_times(double *seconds, int count)
{
  qsort(seconds, (size_t)count, sizeof *seconds, by_size);
  const double upper = seconds[count / 2], lower = seconds[(count - 1) / 2];
  return (TraceTimes){.best = seconds[0], .median = (lower + upper) / 2};
}

bool trace_measure(const TraceRun *run, int least, double seconds, TraceTimes *out)
{
  double times[MOST_RUNS], sum = 0;
  int count = 0;
  if (trace_run(run) < 0) return false;
  for (; count < MOST_RUNS && (count < least || sum < seconds); count++) {
    times[count] = trace_run(run);
    if (times[count] < 0) return false;
    sum += times[count];
  }
  *out = trace_times(times, count);
  return true;
}
