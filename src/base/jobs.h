// A pool of threads that run one batch of numbered items at a time. The caller works too, so a pool of one thread
// starts none. Items are taken in order off one counter; which thread takes which is not fixed, so an item's result
// must not depend on it.

#ifndef RAYFOLD_BASE_JOBS_H
#define RAYFOLD_BASE_JOBS_H

#include "base/err.h"

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>

typedef struct Jobs Jobs;

// Set by anyone at any time; items not yet begun are then skipped, and long items should look at it themselves.
typedef struct Cancel {
  atomic_bool requested;
} Cancel;

static inline bool is_cancelled(const Cancel *c)
{
  return c && atomic_load_explicit(&c->requested, memory_order_relaxed);
}

Jobs *jobs_create(int thread_count, Err *err); // thread_count 0: cpu_thread_count(); at most 256
void jobs_destroy(Jobs *j);                    // accepts NULL
int jobs_thread_count(const Jobs *j);          // NULL counts as one

// Calls work(user, item, worker) for every item in [0, count), worker in [0, thread count). Returns when all are
// done; false if cancelled before the end. Calls from several threads wait for each other. A call from inside an
// item runs its items on that thread alone (as worker 0 of its own scratch, so it must not use per-worker state of
// the outer batch). jobs NULL runs everything here. cancel may be NULL.
typedef void JobWork(void *user, size_t item, int worker);
bool jobs_run(Jobs *j, size_t count, JobWork *work, void *user, const Cancel *cancel);

#endif
