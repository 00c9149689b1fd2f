// See live.h. One film a step of resolution is kept, so that going up and down allocates nothing; they go when the
// window changes its size. Costs are measured on every frame and predict the next.

#include "render/live.h"

#include "base/hash.h"
#include "base/mem.h"
#include "post/denoise_fast.h"
#include "post/display.h"
#include "render/blocks.h"
#include "render/trail.h"

#include <string.h>
#include <time.h>

// What a frame can be rendered at, finest first. Another way to spend less on a frame is one more row here.
// By film: can become the finished picture. The others go straight to the window (blocks.h): all pixels, or some.
typedef enum LiveWay { BY_FILM, BY_PIXELS, BY_BLOCKS } LiveWay;
typedef struct LiveLevel {
  uint32_t step; // window pixels that one rendered pixel is wide
  LiveWay way;
} LiveLevel;
static const LiveLevel levels[] = {{1, BY_FILM}, {1, BY_PIXELS}, {1, BY_BLOCKS}, {2, BY_FILM}, {4, BY_FILM}, {8, BY_FILM}};
enum { LEVEL_BLOCKS = 2, LEVEL_COUNT = sizeof levels / sizeof *levels, ROWS_AN_ITEM = 16, MOST_PASS = 16 };

// A finer level is only tried when it is expected to need no more than this share of the time there is: without the
// gap, levels change with every fluctuation of the machine.
#define FINER_SHARE 0.75
// A pass of a still picture may take this long, so that what is shown and asked in between stays fresh.
#define PASS_SECONDS 0.1
// Between two pictures of a still view there is at least this time, unless the samples have doubled: cleaning and
// showing take as long as several samples of a simple scene.
#define SHOW_SECONDS 0.2

typedef struct Costs {   // of what was measured last, seconds; 0: not known
  double render, denoise; // a rendered pixel (and sample)
  double show;            // a window pixel
  double ways[BY_BLOCKS + 1]; // a window pixel of those without a film
} Costs;

struct Live {
  Jobs *jobs;
  const HotTable *hot;
  LiveView view; // of the last step; width 0: none
  const World *world;
  Film *films[LEVEL_COUNT]; // owned; NULL: not needed yet
  Blocks *blocks;           // owned; likewise
  uint32_t planes;          // of theirs
  int level;                // of the last frame
  uint32_t samples;         // in its film
  uint32_t shown_samples;   // in the picture shown
  double shown_time;
  uint32_t frame;           // counts those of something moving, so that their noise differs
  bool is_current;          // the films's picture is on show as the view says
  Costs costs[2];           // of views and of light
  Trail trail;
  Display display;
  float *planes_of; // owned: resolved planes, 12 floats a pixel of window size
  float *clean;     // owned: 4 floats a pixel
  FastScratch denoise;
  size_t room;      // pixels of both
  uint64_t rays;    // since the last frame shown
  double render_seconds;
};

static double seconds_now(void)
{
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + (double)t.tv_nsec * 1e-9;
}

Live *live_create(Jobs *jobs, const HotTable *hot, Err *err)
{
  Live *l = mem_zero(1, sizeof *l);
  if (!l) return err_memory(err, "a live picture", sizeof *l), NULL;
  l->jobs = jobs;
  l->hot = hot;
  return l;
}

static void drop_films(Live *l)
{
  for (int i = 0; i < LEVEL_COUNT; i++) {
    film_destroy(l->films[i]);
    l->films[i] = NULL;
  }
  blocks_destroy(l->blocks);
  l->blocks = NULL;
}

void live_destroy(Live *l)
{
  if (!l) return;
  drop_films(l);
  trail_finish(&l->trail);
  display_finish(&l->display);
  mem_free(l->planes_of);
  mem_free(l->clean);
  fast_scratch_finish(&l->denoise);
  mem_free(l);
}

void live_frame_finish(LiveFrame *f)
{
  mem_free(f->pixels);
  mem_free(f->objects);
  *f = (LiveFrame){0};
}

// --- comparing ------------------------------------------------------------------------------------
static bool vectors_equal(Vec3 a, Vec3 b) { return a[0] == b[0] && a[1] == b[1] && a[2] == b[2]; }

static bool eyes_equal(const Eye *a, const Eye *b)
{
  return a->kind == b->kind && vectors_equal(a->frame.x, b->frame.x) && vectors_equal(a->frame.y, b->frame.y) &&
         vectors_equal(a->frame.z, b->frame.z) && vectors_equal(a->frame.p, b->frame.p) &&
         a->tan_half_fov == b->tan_half_fov && a->focus == b->focus && a->aperture == b->aperture &&
         a->blades == b->blades && a->height == b->height && a->span == b->span;
}

static bool settings_equal(const RenderSettings *a, const RenderSettings *b)
{
  return a->integrator == b->integrator && a->max_depth == b->max_depth && a->roulette_depth == b->roulette_depth &&
         a->scatter == b->scatter && a->filter == b->filter && a->filter_width == b->filter_width && a->clamp == b->clamp &&
         a->transparent == b->transparent;
}

bool live_view_differs(const LiveView *a, const LiveView *b)
{
  return a->width != b->width || a->height != b->height || a->seed != b->seed || a->first_sample != b->first_sample ||
         a->blocks != b->blocks || a->shows_blocks != b->shows_blocks || !eyes_equal(&a->eye, &b->eye) || !settings_equal(&a->settings, &b->settings);
}

static bool is_noisy(const LiveView *v)
{
  return v->settings.integrator == INTEGRATOR_PATH || v->settings.integrator == INTEGRATOR_CLASSIC;
}
static bool can_use_pixels(const LiveView *v)
{
  return v->settings.integrator == INTEGRATOR_WHITTED && !v->settings.transparent;
}
static bool only_blocks(const LiveView *v) { return can_use_pixels(v) && v->blocks > 0 && v->shows_blocks; }
static bool is_cleaned(const LiveView *v) { return v->denoises && is_noisy(v); }
static bool has_trail(const LiveView *v) { return v->reprojects && is_noisy(v); }

static bool shows_differ(const LiveView *a, const LiveView *b)
{
  return a->tone.kind != b->tone.kind || a->tone.exposure != b->tone.exposure || a->tone.gamma != b->tone.gamma ||
         is_cleaned(a) != is_cleaned(b);
}

// --- films ----------------------------------------------------------------------------------------
static uint32_t planes_for(const LiveView *v)
{
  uint32_t planes = 1u << FILM_BEAUTY | 1u << FILM_OBJECT_ID;
  if (is_cleaned(v)) planes |= 1u << FILM_ALBEDO | 1u << FILM_NORMAL | 1u << FILM_DEPTH | 1u << FILM_VARIANCE;
  if (has_trail(v)) planes |= 1u << FILM_DEPTH;
  return planes;
}

static uint32_t divide_up(uint32_t x, uint32_t by) { return (x + by - 1) / by; }

static void clear_rows(void *user, size_t item, int worker)
{
  Film *f = user;
  (void)worker;
  const uint32_t first = (uint32_t)item * ROWS_AN_ITEM, end = first + ROWS_AN_ITEM;
  film_clear_rows(f, first, end < f->height ? end : f->height);
}

// The film of a level, empty.
static Film *fresh_film(Live *l, int level, Err *err)
{
  Film **f = &l->films[level];
  const uint32_t step = levels[level].step;
  if (!*f) return *f = film_create(divide_up(l->view.width, step), divide_up(l->view.height, step), l->planes, err);
  jobs_run(l->jobs, divide_up((*f)->height, ROWS_AN_ITEM), clear_rows, *f, NULL);
  film_forget(*f);
  return *f;
}

static bool make_room(Live *l, const LiveView *v, Err *err)
{
  const size_t pixels = (size_t)v->width * v->height;
  if (l->view.width != v->width || l->view.height != v->height || l->planes != planes_for(v)) {
    drop_films(l);
    l->planes = planes_for(v);
  }
  if (pixels == l->room) return true;
  mem_free(l->planes_of);
  mem_free(l->clean);
  l->planes_of = mem_alloc(pixels, 12 * sizeof *l->planes_of);
  l->clean = mem_alloc(pixels, 4 * sizeof *l->clean);
  l->room = l->planes_of && l->clean ? pixels : 0;
  return l->room || err_memory(err, "the window's picture", 64ull * pixels);
}

// --- how fine -------------------------------------------------------------------------------------
static size_t pixels_at(const LiveView *v, int level)
{
  const uint32_t step = levels[level].step;
  return (size_t)divide_up(v->width, step) * divide_up(v->height, step);
}

static Costs *costs_of(Live *l, const LiveView *v) { return &l->costs[is_noisy(v)]; }

static double expected_seconds(Live *l, const LiveView *v, int level, uint32_t samples)
{
  const Costs *c = costs_of(l, v);
  const LiveWay way = levels[level].way;
  if (way != BY_FILM) {
    const double known = c->ways[way], guess = (c->render + c->show) / (way == BY_BLOCKS ? 2 : 1); // two to five times as fast
    return (double)pixels_at(v, level) * (known > 0 ? known : guess);
  }
  const double denoise = is_cleaned(v) ? c->denoise : 0;
  return (double)pixels_at(v, level) * (samples * c->render + denoise) + (double)v->width * v->height * c->show;
}

// Whether a level is one for what moves in the view at all. Where a size was asked for, blocks serve if they may.
static bool level_serves(const LiveView *v, int level)
{
  switch (levels[level].way) {
  case BY_FILM: return levels[level].step > 1 || !can_use_pixels(v);
  case BY_PIXELS: return can_use_pixels(v) && !(v->step == 1 && v->blocks > 0);
  case BY_BLOCKS: return can_use_pixels(v) && v->blocks > 0;
  }
  unreachable();
}

static int choose_level(Live *l, const LiveView *v)
{
  if (only_blocks(v)) return LEVEL_BLOCKS;
  if (v->step > 0) {
    for (int i = 0; i < LEVEL_COUNT; i++)
      if ((int)levels[i].step >= v->step && level_serves(v, i)) return i;
    return LEVEL_COUNT - 1;
  }
  if (costs_of(l, v)->render <= 0) return is_noisy(v) ? LEVEL_COUNT - 1 : LEVEL_COUNT - 2; // not known: soon
  int level = 0;
  while (level < LEVEL_COUNT - 1 &&
         (!level_serves(v, level) ||
          expected_seconds(l, v, level, 1) > v->frame_seconds * (level < l->level ? FINER_SHARE : 1)))
    level++;
  return level;
}

// How many samples fit, a power of two. At coarser levels pixels come first.
static uint32_t choose_samples(Live *l, const LiveView *v, int level)
{
  uint32_t n = 1;
  if (level > 0 || v->step > 0) return 1;
  while (2 * n <= MOST_PASS && expected_seconds(l, v, level, 2 * n) <= FINER_SHARE * v->frame_seconds) n *= 2;
  const uint32_t most = v->end_sample - v->first_sample;
  return n < most ? n : most;
}

// Slow frames count at once, fast ones by and by.
static void learn(double *cost, double seen)
{
  *cost = seen > *cost ? (*cost > 0 ? 0.5 * (*cost + seen) : seen) : 0.8 * *cost + 0.2 * seen;
}

// --- rendering ------------------------------------------------------------------------------------
static bool add_samples(Live *l, Film *f, uint32_t first, uint32_t count, const Cancel *cancel, Err *err)
{
  const RenderJob job = {.world = l->world,
                         .eye = l->view.eye,
                         .settings = l->view.settings,
                         .seed = l->view.seed,
                         .film = f,
                         .first_sample = first,
                         .end_sample = first + count};
  RenderStats stats;
  const double start = seconds_now();
  const bool ok = render_run(&job, l->jobs, l->hot, cancel, &stats, err);
  const double took = seconds_now() - start;
  l->rays += stats.rays.camera_rays + stats.rays.bounce_rays + stats.rays.shadow_rays;
  l->render_seconds += took;
  if (ok) learn(&costs_of(l, &l->view)->render, took / ((double)f->width * f->height * count));
  return ok;
}

// Anew at a level; its samples begin where the finished picture's do if it can become that one.
static bool begin_level(Live *l, int level, uint32_t first, uint32_t samples, const Cancel *cancel, Err *err)
{
  Film *f = fresh_film(l, level, err);
  l->level = level;
  l->samples = 0;
  if (!f || !add_samples(l, f, first, samples, cancel, err)) return false;
  l->samples = samples;
  return true;
}

static bool moving_frame(Live *l, int level, const Cancel *abandon, Err *err)
{
  const uint32_t samples = choose_samples(l, &l->view, level);
  // What the finished picture never sees is free to differ from frame to frame, so that noise averages out.
  const uint32_t shift = level > 0 && is_noisy(&l->view) ? l->frame++ % 1024 : 0;
  return begin_level(l, level, l->view.first_sample + shift, samples, abandon, err);
}

static uint32_t next_pass(Live *l)
{
  const uint32_t left = l->view.end_sample - l->view.first_sample - l->samples;
  const double one = costs_of(l, &l->view)->render * (double)pixels_at(&l->view, 0);
  uint32_t n = l->samples < MOST_PASS ? l->samples : MOST_PASS;
  while (l->view.step == 0 && n > 1 && n * one > PASS_SECONDS) n /= 2;
  return n < left ? n : left;
}

// --- showing --------------------------------------------------------------------------------------
typedef struct Resolve {
  const Film *film;
  float *color, *albedo, *normal, *depth, *variance;
  uint32_t *objects;
} Resolve;

static void resolve_rows(void *user, size_t item, int worker)
{
  const Resolve *r = user;
  const Film *f = r->film;
  (void)worker;
  const uint32_t first = (uint32_t)item * ROWS_AN_ITEM;
  const uint32_t end = first + ROWS_AN_ITEM < f->height ? first + ROWS_AN_ITEM : f->height;
  film_resolve_rows(f, FILM_BEAUTY, first, end, r->color);
  if (film_has(f, FILM_DEPTH)) film_resolve_rows(f, FILM_DEPTH, first, end, r->depth);
  if (film_has(f, FILM_ALBEDO)) {
    film_resolve_rows(f, FILM_ALBEDO, first, end, r->albedo);
    film_resolve_rows(f, FILM_NORMAL, first, end, r->normal);
    film_resolve_rows(f, FILM_VARIANCE, first, end, r->variance);
  }
  for (size_t i = (size_t)first * f->width; i < (size_t)end * f->width; i++) {
    const uint64_t id = f->object[i];
    r->objects[i] = id == UINT64_MAX ? 0 : (uint32_t)id;
  }
}

static Resolve resolve(Live *l, const Film *f, uint32_t *objects)
{
  const size_t n = (size_t)f->width * f->height;
  float *p = l->planes_of;
  Resolve r = {f, p, p + 4 * n, p + 7 * n, p + 10 * n, p + 11 * n, objects};
  jobs_run(l->jobs, divide_up(f->height, ROWS_AN_ITEM), resolve_rows, &r, NULL);
  return r;
}

static bool grow(uint32_t **pixels, size_t *room, size_t count, Err *err)
{
  if (*room == count) return true;
  mem_free(*pixels);
  *pixels = mem_alloc(count, sizeof **pixels);
  *room = *pixels ? count : 0;
  return *pixels || err_memory(err, "a frame", count * sizeof **pixels);
}

static bool is_finished(const Live *l)
{
  return l->level == 0 && l->samples >= l->view.end_sample - l->view.first_sample;
}

// The trail of frames before belongs to what moves and to the first steps after; samples take over by and by.
static bool blend(Live *l, const Film *f, float *color, const float *depth, Err *err)
{
  const bool keeps = l->level > 0 || l->samples <= 1;
  if (!has_trail(&l->view) || l->samples >= TRAIL_MOST || is_finished(l)) return true;
  return trail_blend(&l->trail, &l->view.eye, f->width, f->height, color, depth, (float)l->samples, keeps, l->jobs, err);
}

static bool show(Live *l, const Cancel *cancel, LiveFrame *out, Err *err)
{
  const LiveView *v = &l->view;
  const Film *f = l->films[l->level];
  const size_t pixels = (size_t)f->width * f->height, window = (size_t)v->width * v->height;
  if (!grow(&out->pixels, &out->pixel_room, window, err) || !grow(&out->objects, &out->object_room, pixels, err) ||
      !display_fit(&l->display, f->width, f->height, v->width, v->height, l->jobs, err))
    return false;
  const double start = seconds_now();
  const Resolve r = resolve(l, f, out->objects);
  float *color = r.color;
  if (is_cleaned(v)) {
    const Guided g = {f->width, f->height, r.color, r.albedo, r.normal, r.depth, r.variance};
    if (!denoise_fast(&g, &l->hot->post, &l->denoise, l->jobs, cancel, l->clean, err)) return false;
    color = l->clean;
  }
  if (!blend(l, f, color, r.depth, err)) return false;
  const double cleaned = seconds_now();
  tone_pixels(&v->tone, color, pixels, l->jobs);
  display_show(&l->display, color, out->pixels, l->jobs);
  const double end = seconds_now();
  Costs *c = costs_of(l, v);
  learn(&c->denoise, (cleaned - start) / (double)pixels);
  learn(&c->show, (end - cleaned) / (double)window);

  out->width = v->width;
  out->height = v->height;
  out->render_width = f->width;
  out->render_height = f->height;
  out->traced = 1;
  out->samples = l->samples;
  out->is_finished = is_finished(l);
  out->render_seconds = l->render_seconds;
  out->denoise_seconds = cleaned - start;
  out->show_seconds = end - cleaned;
  out->rays = l->rays;
  l->rays = 0;
  l->render_seconds = 0;
  l->shown_samples = l->samples;
  l->shown_time = end;
  l->is_current = true;
  return true;
}

// --- one step -------------------------------------------------------------------------------------
static LiveOutcome finish(Live *l, bool is_moving, const Cancel *cancel, LiveFrame *out, Err *err)
{
  out->is_moving = is_moving;
  if (show(l, cancel, out, err)) return LIVE_SHOWN;
  return err->kind == ERR_CANCELLED ? LIVE_WORKED : LIVE_FAILED;
}

static LiveOutcome broken_off(const Err *err) { return err->kind == ERR_CANCELLED ? LIVE_WORKED : LIVE_FAILED; }

// A frame straight into the window's pixels.
static bool show_pixels(Live *l, int level, const Cancel *cancel, LiveFrame *out, Err *err)
{
  const LiveView *v = &l->view;
  const size_t window = (size_t)v->width * v->height;
  l->level = level;
  l->samples = 0;
  if (!grow(&out->pixels, &out->pixel_room, window, err) || !grow(&out->objects, &out->object_room, window, err)) return false;
  if (!l->blocks && !(l->blocks = blocks_create(v->width, v->height, l->jobs, l->hot, err))) return false;
  RenderPass pass = {.world = l->world, .eye = v->eye, .settings = v->settings, .seed = (uint32_t)hash_u64(v->seed),
                     .first_sample = v->first_sample, .end_sample = v->first_sample + 1};
  filter_build(&pass.filter, (FilterKind)v->settings.filter, v->settings.filter_width);
  SubsampleSettings settings = subsample_defaults();
  settings.block = levels[level].way == BY_BLOCKS ? v->blocks : 0;
  settings.shows_blocks = v->shows_blocks;
  SubsampleStats stats;
  RayCounters rays;
  const double start = seconds_now();
  if (!blocks_render(l->blocks, &pass, &settings, &v->tone, cancel, out->pixels, out->objects, &stats, &rays, err))
    return false;
  const double end = seconds_now();
  learn(&costs_of(l, v)->ways[levels[level].way], (end - start) / (double)window);
  out->width = out->render_width = v->width;
  out->height = out->render_height = v->height;
  out->samples = l->samples = l->shown_samples = 1;
  out->is_finished = v->shows_blocks;
  out->render_seconds = l->render_seconds + end - start;
  out->denoise_seconds = out->show_seconds = 0;
  out->traced = (double)stats.traced / (double)window;
  out->rays = l->rays + rays.camera_rays + rays.bounce_rays + rays.shadow_rays;
  l->rays = 0;
  l->render_seconds = 0;
  l->shown_time = end;
  l->is_current = true;
  return true;
}

// The level to go on with from another: the next finer one that has a film.
static int finer_level(int level)
{
  do level--;
  while (level > 0 && levels[level].way != BY_FILM);
  return level > 0 ? level : 0;
}

// One step finer, then more samples.
static LiveOutcome refine(Live *l, const Cancel *interrupt, LiveFrame *out, Err *err)
{
  Film *f = l->films[0];
  const uint32_t all = l->view.end_sample - l->view.first_sample;
  if (only_blocks(&l->view) && l->is_current) return LIVE_IDLE;
  if (only_blocks(&l->view)) {
    out->is_moving = false;
    return show_pixels(l, choose_level(l, &l->view), interrupt, out, err) ? LIVE_SHOWN : broken_off(err);
  }
  if (l->level > 0 || !l->samples || !f || f->is_partial) {
    const int from = l->level, level = finer_level(from);
    const uint32_t shift = level > 0 && is_noisy(&l->view) ? l->frame++ % 1024 : 0;
    if (!begin_level(l, level, l->view.first_sample + shift, 1, interrupt, err)) {
      if (err->kind == ERR_CANCELLED) l->level = from; // again from there
      return broken_off(err);
    }
    return finish(l, false, interrupt, out, err);
  }
  if (l->samples < all) {
    const uint32_t n = next_pass(l);
    if (!add_samples(l, f, l->view.first_sample + l->samples, n, interrupt, err)) return broken_off(err);
    l->samples += n;
    l->is_current = false;
    const bool is_due = l->view.step > 0 || l->samples >= all || l->samples >= 2 * l->shown_samples ||
                        seconds_now() - l->shown_time > SHOW_SECONDS;
    return is_due ? finish(l, false, interrupt, out, err) : LIVE_WORKED;
  }
  return l->is_current ? LIVE_IDLE : finish(l, false, interrupt, out, err);
}

LiveOutcome live_step(Live *l, const World *w, const LiveView *view, const Cancel *abandon, const Cancel *interrupt,
                      LiveFrame *out, Err *err)
{
  const bool is_changed = l->world != w || live_view_differs(&l->view, view) || l->planes != planes_for(view);
  if (l->world != w || l->view.settings.integrator != view->settings.integrator) trail_forget(&l->trail);
  if (!is_changed) {
    if (shows_differ(&l->view, view) || l->view.end_sample > view->end_sample) l->is_current = false;
    l->view = *view;
    return refine(l, interrupt, out, err);
  }
  if (!make_room(l, view, err)) {
    l->view.width = 0; // the room of the view before is gone, too
    return LIVE_FAILED;
  }
  l->view = *view;
  l->world = w;
  l->is_current = false;
  const int level = choose_level(l, view);
  const bool has_film = levels[level].way == BY_FILM;
  if (!(!has_film ? show_pixels(l, level, abandon, out, err) : moving_frame(l, level, abandon, err))) {
    l->view.width = 0; // begin anew, whatever comes
    return broken_off(err);
  }
  if (!has_film) {
    out->is_moving = true;
    return LIVE_SHOWN;
  }
  return finish(l, true, abandon, out, err);
}

const Film *live_film(const Live *l)
{
  return l->level == 0 && l->samples ? l->films[0] : NULL;
}
