// See jobs.h. The batch lives under one mutex; the item counter is the only thing the workers share while they
// work. It is relaxed: it hands out numbers and orders nothing, because the batch's data is published by the mutex
// when it starts and its results by the mutex when the last worker leaves.

#include "base/jobs.h"

#include "base/cpu.h"
#include "base/mem.h"

#include <pthread.h>
#include <string.h>

enum { MOST_THREADS = 256 };

struct Jobs {
  int thread_count; // workers, the caller included
  int started;      // threads really running, caller not included
  pthread_t *threads;
  pthread_mutex_t batch_mutex; // held by the caller for a whole batch
  pthread_mutex_t mutex;       // guards what follows
  pthread_cond_t work_ready, work_done;
  unsigned long long batch; // number of the batch, so that a worker joins each once
  int next_worker, active;  // workers given out, workers inside the batch
  bool quit, is_open; // is_open: workers may join the batch
  size_t count;
  JobWork *work;
  void *user;
  const Cancel *cancel;
  atomic_size_t next; // the next item
};

static _Thread_local bool is_inside_item;

static void take_items(Jobs *j, int worker)
{
  is_inside_item = true;
  for (;;) {
    const size_t i = atomic_fetch_add_explicit(&j->next, 1, memory_order_relaxed);
    if (i >= j->count || is_cancelled(j->cancel)) break;
    j->work(j->user, i, worker);
  }
  is_inside_item = false;
}

static void *worker_main(void *arg)
{
  Jobs *j = arg;
  unsigned long long seen = 0;
  pthread_mutex_lock(&j->mutex);
  for (;;) {
    while (!j->quit && (j->batch == seen || !j->is_open)) pthread_cond_wait(&j->work_ready, &j->mutex);
    if (j->quit) break;
    seen = j->batch;
    const int worker = j->next_worker++;
    j->active++;
    pthread_mutex_unlock(&j->mutex);
    take_items(j, worker);
    pthread_mutex_lock(&j->mutex);
    if (--j->active == 0) pthread_cond_signal(&j->work_done);
  }
  pthread_mutex_unlock(&j->mutex);
  return NULL;
}

Jobs *jobs_create(int thread_count, Err *err)
{
  if (thread_count <= 0) thread_count = cpu_thread_count();
  if (thread_count > MOST_THREADS) thread_count = MOST_THREADS;
  Jobs *j = mem_zero(1, sizeof *j);
  pthread_t *threads = mem_zero((size_t)thread_count, sizeof *threads);
  if (!j || !threads) {
    mem_free(j);
    mem_free(threads);
    err_memory(err, "the thread pool", sizeof *j);
    return NULL;
  }
  j->thread_count = thread_count;
  j->threads = threads;
  pthread_mutex_init(&j->batch_mutex, NULL);
  pthread_mutex_init(&j->mutex, NULL);
  pthread_cond_init(&j->work_ready, NULL);
  pthread_cond_init(&j->work_done, NULL);
  for (; j->started < thread_count - 1; j->started++) {
    const int failed = pthread_create(&j->threads[j->started], NULL, worker_main, j);
    if (!failed) continue;
    err_set(err, ERR_NO_MEMORY, "cannot start %d threads: %s; ask for fewer with --threads", thread_count,
            strerror(failed));
    jobs_destroy(j);
    return NULL;
  }
  return j;
}

void jobs_destroy(Jobs *j)
{
  if (!j) return;
  pthread_mutex_lock(&j->mutex);
  j->quit = true;
  pthread_cond_broadcast(&j->work_ready);
  pthread_mutex_unlock(&j->mutex);
  for (int i = 0; i < j->started; i++) pthread_join(j->threads[i], NULL);
  pthread_cond_destroy(&j->work_ready);
  pthread_cond_destroy(&j->work_done);
  pthread_mutex_destroy(&j->mutex);
  pthread_mutex_destroy(&j->batch_mutex);
  mem_free(j->threads);
  mem_free(j);
}

int jobs_thread_count(const Jobs *j) { return j ? j->thread_count : 1; }

bool jobs_run(Jobs *j, size_t count, JobWork *work, void *user, const Cancel *cancel)
{
  if (!j || j->started == 0 || is_inside_item || count <= 1) {
    for (size_t i = 0; i < count && !is_cancelled(cancel); i++) work(user, i, 0);
    return !is_cancelled(cancel);
  }
  pthread_mutex_lock(&j->batch_mutex);
  pthread_mutex_lock(&j->mutex);
  j->count = count;
  j->work = work;
  j->user = user;
  j->cancel = cancel;
  j->next_worker = 1;
  j->batch++;
  j->is_open = true;
  atomic_store_explicit(&j->next, 0, memory_order_relaxed);
  pthread_cond_broadcast(&j->work_ready);
  pthread_mutex_unlock(&j->mutex);

  take_items(j, 0);

  pthread_mutex_lock(&j->mutex);
  j->is_open = false; // a worker that wakes up late must not join
  while (j->active > 0) pthread_cond_wait(&j->work_done, &j->mutex);
  pthread_mutex_unlock(&j->mutex);
  pthread_mutex_unlock(&j->batch_mutex);
  return !is_cancelled(cancel);
}
