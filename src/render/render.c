// See render.h. Tiles go in rows: what matters for speed is that a tile's rays stay close together, not the order of
// tiles. The thread that called works too, as worker 0, and reports progress between its own tiles.

#include "render/render.h"

#include "base/hash.h"
#include "base/mem.h"
#include "render/plan.h"

#include <time.h>

enum { TILE_SIZE = 16 };
#define PROGRESS_SECONDS 0.1

typedef struct Run {
  const RenderJob *job;
  const HotTable *hot;
  RenderPass pass;
  WorkerState *workers; // owned, one a thread
  size_t worker_count;
  Plan plan;
  bool is_even; // the pass takes the same samples everywhere, in tiles of tile_size; else cell by cell
  uint32_t tile_size, columns, rows;
  Cancel stop; // set by RENDER_STOP_NOW
  RenderGo go; // what the caller said last; only worker 0 touches it
  double start, last_progress;
  RenderProgress told; // noise and rays of the last whole pass
  double done, cost;   // samples a pixel in whole passes, and of the pass under way
  bool is_complete;
  uint8_t moments[MOST_MOMENTS]; // the order in which samples take them
} Run;

static double seconds_now(void)
{
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + (double)t.tv_nsec * 1e-9;
}

// Tells the caller how far it is; samples counts parts of a pass.
static void report(Run *r, double samples)
{
  if (!r->job->progress) return;
  RenderProgress p = r->told;
  p.samples = samples;
  p.seconds = seconds_now() - r->start;
  const double left = r->plan.left - (samples - r->done);
  p.left = left > 0 ? left : 0;
  p.done = samples > 0 || p.left > 0 ? samples / (samples + p.left) : 1;
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

static size_t item_count(const Run *r)
{
  return r->is_even ? (size_t)r->columns * r->rows : r->plan.count;
}

// Numbers below n in the order of their reversed bits (van der Corput): any run of them from the start is spread as
// evenly as can be, so that a picture stopped early is blurred as it should be, only more coarsely.
static void order_moments(uint8_t *order, uint32_t n)
{
  uint32_t bits = 0;
  while (1u << bits < n) bits++;
  for (uint32_t i = 0, k = 0; n && i < 1u << bits; i++) {
    uint32_t reversed = 0;
    for (uint32_t b = 0; b < bits; b++) reversed |= (i >> b & 1) << (bits - 1 - b);
    if (reversed < n) order[k++] = (uint8_t)reversed;
  }
}

// Samples [first, end) of a tile; where things move one by one, each in its moment's world. The sampler deals each
// pixel's samples in an order of its own, so which moment a sample sees says nothing about where in the pixel it looks.
static void render_samples(const Run *r, uint32_t first, uint32_t end, Tile tile, WorkerState *worker)
{
  const uint32_t step = r->job->moment_count ? 1 : end - first;
  RenderPass pass = r->pass;
  for (uint32_t sample = first; sample < end; sample += step) {
    if (r->job->moment_count) {
      const RenderMoment *m = &r->job->moments[r->moments[sample % r->job->moment_count]];
      pass.world = m->world;
      pass.eye = m->eye;
    }
    if (pass.eye.cell >= pass.world->cell_count) pass.eye.cell = 0;
    pass.first_sample = sample;
    pass.end_sample = sample + step;
    if (!r->hot->render_tile(&pass, tile, worker)) return;
  }
}

static void render_item(void *user, size_t item, int worker)
{
  Run *r = user;
  if (r->is_even) {
    render_samples(r, r->pass.first_sample, r->pass.end_sample, tile_at(r, item), &r->workers[worker]);
  } else {
    const CellRange *c = &r->plan.items[item];
    const CellBox b = film_cell_box(r->job->film, c->cell);
    render_samples(r, c->first, c->end, (Tile){b.x0, b.y0, b.x1, b.y1}, &r->workers[worker]);
  }
  if (worker != 0 || !r->job->progress || seconds_now() - r->last_progress < PROGRESS_SECONDS) return;
  // Tiles are taken in order, so this one's number says how many have been begun.
  report(r, r->done + r->cost * (double)(item + 1) / (double)item_count(r));
}

// Not more than the budget seems to allow.
static void fit_budget(Run *r)
{
  const double budget = r->job->budget_seconds, used = seconds_now() - r->start, cost = plan_cost(&r->plan);
  if (!(budget > 0) || !(r->done > 0)) return;
  const double part = (budget - used) / used * r->done / cost * PLAN_STOP;
  if (part < PLAN_STOP) plan_trim(&r->plan, part < 1 ? 1 : (uint32_t)part);
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
  RenderStats s = {.seconds = seconds_now() - r->start,
                   .samples = plan_most_taken(&r->plan),
                   .mean_samples = r->done,
                   .noise = r->told.noise,
                   .quiet = r->told.quiet,
                   .is_complete = r->is_complete};
  for (size_t i = 0; i < r->worker_count; i++) {
    add_counters(&s.rays, &r->workers[i].rays);
    s.bad_samples += r->workers[i].bad_samples;
  }
  return s;
}

static bool fail_cancelled(const Run *r, Err *err)
{
  return err_set(err, ERR_CANCELLED, "rendering was cancelled after %g samples a pixel", r->done);
}

// One pass; false if it was broken off or could not begin.
static bool run_pass(Run *r, Jobs *jobs, const Cancel *cancel, Err *err)
{
  fit_budget(r);
  r->cost = plan_cost(&r->plan);
  r->is_even = plan_is_even(&r->plan);
  r->pass.first_sample = r->plan.items[0].first;
  r->pass.end_sample = r->plan.items[0].end;
  if (!film_claim_cells(r->job->film, r->plan.items, r->plan.count, err)) return false;
  jobs_run(jobs, item_count(r), render_item, r, cancel);
  if (is_cancelled(cancel) || is_cancelled(&r->stop)) {
    r->job->film->is_partial = true;
    return fail_cancelled(r, err);
  }
  plan_took(&r->plan);
  r->done = plan_mean_taken(&r->plan);
  return true;
}

// Plans the next pass and tells how far it is; false when there is none or no more is wanted.
static bool go_on(Run *r)
{
  const RenderJob *job = r->job;
  const RayCounters rays = collect_stats(r).rays;
  r->told.rays = rays.camera_rays + rays.bounce_rays + rays.shadow_rays;
  r->is_complete = !plan_next(&r->plan, PLAN_STOP);
  r->told.noise = job->noise_target > 0 ? r->plan.picture_noise : job->progress ? film_noise(job->film, NULL) : 0;
  r->told.quiet = r->plan.done_cells;
  report(r, r->done);
  if (r->is_complete || r->go != RENDER_GO_ON) return false;
  return !(job->budget_seconds > 0 && seconds_now() - r->start >= job->budget_seconds);
}

static bool begin_plan(Run *r, Err *err)
{
  const RenderJob *job = r->job;
  const uint64_t cells = film_cells(job->film), parts = job->parts ? job->parts : 1;
  const uint64_t part = job->parts ? job->part : 0, part_end = job->parts ? job->part_end : 1;
  if (part >= part_end || part_end > parts)
    return err_set(err, ERR_BAD_ARGUMENT, "parts %u to %u of %u are none", job->part, job->part_end, job->parts);
  const uint32_t first = (uint32_t)(cells * part / parts), end = (uint32_t)(cells * part_end / parts);
  return plan_init(&r->plan, job->film, job->first_sample, job->end_sample, first, end, job->noise_target, err);
}

bool render_run(const RenderJob *job, Jobs *jobs, const HotTable *hot, const Cancel *cancel,
                RenderStats *stats, Err *err)
{
  if (stats) *stats = (RenderStats){0};
  Run r = {.job = job, .hot = hot, .worker_count = (size_t)jobs_thread_count(jobs), .start = seconds_now()};
  r.workers = mem_zero(r.worker_count, sizeof *r.workers);
  if (!r.workers) return err_memory(err, "the workers' counters", r.worker_count * sizeof *r.workers);
  if (!begin_plan(&r, err)) {
    mem_free(r.workers);
    return false;
  }
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
  order_moments(r.moments, job->moment_count);
  filter_build(&r.pass.filter, (FilterKind)job->settings.filter, job->settings.filter_width);

  bool ok = true;
  r.is_complete = !plan_next(&r.plan, PLAN_STOP);
  if (!r.is_complete) {
    do ok = run_pass(&r, jobs, cancel, err);
    while (ok && go_on(&r));
  }
  if (ok && r.go == RENDER_STOP_NOW && !r.is_complete) ok = fail_cancelled(&r, err);
  if (stats) *stats = collect_stats(&r);
  plan_finish(&r.plan);
  mem_free(r.workers);
  return ok;
}
