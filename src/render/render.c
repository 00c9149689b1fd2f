// See render.h. Tiles go in rows: what matters for speed is that a tile's rays stay close together, not the order of
// tiles. The thread that called works too, as worker 0, and reports progress between its own tiles.

#include "render/render.h"

#include "base/hash.h"

#include <time.h>

enum { TILE_SIZE = 16, MOST_PASS = 16 };
#define PROGRESS_SECONDS 0.1

typedef struct Run {
  const RenderJob *job;
  const HotTable *hot;
  RenderPass pass;
  WorkerState *workers; // owned, one a thread
  size_t worker_count;
  uint32_t tile_size, columns, rows;
  Cancel stop; // set by RENDER_STOP_NOW
  RenderGo go; // what the caller said last; only worker 0 touches it
  double start, last_progress;
  RenderProgress told; // noise and rays of the last whole pass
  uint32_t done;       // samples in whole passes
} Run;

static double seconds_now(void)
{
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + (double)t.tv_nsec * 1e-9;
}

static uint32_t sample_count(const Run *r)
{
  return r->job->end_sample - r->job->first_sample;
}

// Tells the caller how far it is; samples counts parts of a pass.
static void report(Run *r, double samples)
{
  if (!r->job->progress) return;
  RenderProgress p = r->told;
  p.samples = samples;
  p.seconds = seconds_now() - r->start;
  p.done = samples / sample_count(r);
  p.eta = p.done > 0 ? p.seconds * (1 - p.done) / p.done : 0;
  const double budget = r->job->budget_seconds;
  if (budget > 0 && p.seconds + p.eta > budget) {
    p.eta = budget > p.seconds ? budget - p.seconds : 0;
    p.done = p.seconds < budget ? p.seconds / budget : 1;
  }
  const RenderGo go = r->job->progress(r->job->user, &p);
  if (go > r->go) r->go = go;
  if (go == RENDER_STOP_NOW) atomic_store_explicit(&r->stop.requested, true, memory_order_relaxed);
  r->last_progress = seconds_now();
}

static Tile tile_at(const Run *r, size_t item)
{
  const uint32_t x = (uint32_t)(item % r->columns) * r->tile_size,
                 y = (uint32_t)(item / r->columns) * r->tile_size;
  const uint32_t x1 = x + r->tile_size, y1 = y + r->tile_size;
  const Film *f = r->job->film;
  return (Tile){x, y, x1 < f->width ? x1 : f->width, y1 < f->height ? y1 : f->height};
}

static void render_item(void *user, size_t item, int worker)
{
  Run *r = user;
  r->hot->render_tile(&r->pass, tile_at(r, item), &r->workers[worker]);
  if (worker != 0 || !r->job->progress || seconds_now() - r->last_progress < PROGRESS_SECONDS) return;
  // Tiles are taken in order, so this one's number says how many have been begun.
  const double part = (double)(item + 1) / ((double)r->columns * r->rows);
  report(r, r->done + part * (r->pass.end_sample - r->pass.first_sample));
}

// 1, 1, 2, 4, 8, 16, 16, ... so that the first picture comes soon, and not more than the budget seems to allow.
static uint32_t pass_size(const Run *r)
{
  uint32_t n = r->done == 0 ? 1 : r->done < MOST_PASS ? r->done : MOST_PASS;
  const double budget = r->job->budget_seconds;
  if (budget > 0 && r->done > 0) {
    const double used = seconds_now() - r->start, fits = (budget - used) * r->done / used;
    if (fits < n) n = fits < 1 ? 1 : (uint32_t)fits;
  }
  const uint32_t left = sample_count(r) - r->done;
  return n < left ? n : left;
}

static void add_counters(RayCounters *to, const RayCounters *from)
{
  to->camera_rays += from->camera_rays;
  to->bounce_rays += from->bounce_rays;
  to->shadow_rays += from->shadow_rays;
  to->nodes += from->nodes;
  to->prims += from->prims;
}

static RenderStats collect_stats(const Run *r)
{
  RenderStats s = {.seconds = seconds_now() - r->start, .samples = r->done};
  for (size_t i = 0; i < r->worker_count; i++) {
    add_counters(&s.rays, &r->workers[i].rays);
    s.bad_samples += r->workers[i].bad_samples;
  }
  return s;
}

static bool fail_cancelled(const Run *r, Err *err)
{
  return err_set(err, ERR_CANCELLED, "rendering was cancelled after %u samples a pixel", r->done);
}

// One pass; false if it was broken off or could not begin.
static bool run_pass(Run *r, Jobs *jobs, const Cancel *cancel, Err *err)
{
  r->pass.first_sample = r->job->first_sample + r->done;
  r->pass.end_sample = r->pass.first_sample + pass_size(r);
  if (!film_claim(r->job->film, r->pass.first_sample, r->pass.end_sample, err)) return false;
  jobs_run(jobs, (size_t)r->columns * r->rows, render_item, r, cancel);
  if (is_cancelled(cancel) || is_cancelled(&r->stop)) {
    r->job->film->is_partial = true;
    return fail_cancelled(r, err);
  }
  r->done += r->pass.end_sample - r->pass.first_sample;
  return true;
}

static bool is_enough(Run *r)
{
  const RenderJob *job = r->job;
  const RayCounters rays = collect_stats(r).rays;
  r->told.rays = rays.camera_rays + rays.bounce_rays + rays.shadow_rays;
  if (job->progress || job->noise_target > 0) r->told.noise = film_noise(job->film);
  report(r, r->done);
  if (r->done >= sample_count(r) || r->go != RENDER_GO_ON) return true;
  if (job->budget_seconds > 0 && seconds_now() - r->start >= job->budget_seconds) return true;
  return job->noise_target > 0 && r->told.noise > 0 && r->told.noise <= job->noise_target;
}

static bool check_job(const RenderJob *job, Err *err)
{
  if (job->first_sample >= job->end_sample) {
    return err_set(err, ERR_BAD_ARGUMENT, "samples %u to %u are none; the end must lie above the first",
                   job->first_sample, job->end_sample);
  }
  if (job->noise_target > 0 && !film_has(job->film, FILM_VARIANCE)) {
    return err_set(err, ERR_BAD_ARGUMENT, "a noise target needs a film with the variance plane");
  }
  return true;
}

bool render_run(const RenderJob *job, Jobs *jobs, const HotTable *hot, const Cancel *cancel,
                RenderStats *stats, Err *err)
{
  if (stats) *stats = (RenderStats){0};
  if (!check_job(job, err)) return false;
  Run r = {.job = job, .hot = hot, .worker_count = (size_t)jobs_thread_count(jobs), .start = seconds_now()};
  r.workers = mem_zero(r.worker_count, sizeof *r.workers);
  if (!r.workers) return err_memory(err, "the workers' counters", r.worker_count * sizeof *r.workers);
  r.tile_size = job->tile_size ? job->tile_size : TILE_SIZE;
  r.columns = (job->film->width + r.tile_size - 1) / r.tile_size;
  r.rows = (job->film->height + r.tile_size - 1) / r.tile_size;
  r.last_progress = r.start;
  r.pass = (RenderPass){.world = job->world,
                        .eye = job->eye,
                        .settings = job->settings,
                        .seed = (uint32_t)hash_u64(job->seed),
                        .film = job->film,
                        .cancel = cancel,
                        .stop = &r.stop};
  filter_build(&r.pass.filter, (FilterKind)job->settings.filter, job->settings.filter_width);

  bool ok = run_pass(&r, jobs, cancel, err);
  while (ok && !is_enough(&r)) ok = run_pass(&r, jobs, cancel, err);
  if (ok && r.go == RENDER_STOP_NOW && r.done < sample_count(&r)) ok = fail_cancelled(&r, err);
  if (stats) *stats = collect_stats(&r);
  mem_free(r.workers);
  return ok;
}
