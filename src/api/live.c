// The live picture: its threads, and where they meet. The frames themselves are made by render/live.h.
//
//   caller --view, edits--> | mutex | --edits--> edit thread  --newest world--> | mutex | --world, view--> frame thread
//          <--newest frame- |       | <-------------------------frames------------------------------------
//
// All meetings are under one mutex, held to copy some words or swap two indices and never while anything is computed:
//   inbox   what callers ask: the newest view, and edits in their order.
//   world   the newest one. Only the edit thread replaces it; the frame thread and callers take uses of their own.
//   frames  three: one being made, the newest, one in the caller's hands. Indices are swapped, pixels never copied.
//   scene   is_scene_taken says that the edit thread or a borrower has it; the mutex orders one after the other.
// Besides, two Cancels: atomics whose order does not matter, as whoever sets one also changes the inbox.

#include "api/api.h"

#include "base/mem.h"
#include "render/live.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

typedef enum LiveEditKind { LIVE_SET, LIVE_UNDO, LIVE_REDO, LIVE_REPLACE, LIVE_PREPARE } LiveEditKind;

typedef struct LiveEdit {
  LiveEditKind kind;
  bool goes_on;
  char *path, *json; // owned, of LIVE_SET
  rf_scene *scene;   // owned, of LIVE_REPLACE
  uint64_t number;
} LiveEdit;

typedef ARRAY(LiveEdit) LiveEdits;

typedef struct LiveSlot {
  LiveFrame frame;
  uint64_t number, view, edit;
  double prepare_seconds;
  rf_eye eye;
} LiveSlot;

struct rf_live {
  rf_engine *engine;
  void (*ready)(void *user);
  void *user;
  bool is_stepped;
  int started;          // threads running
  pthread_t threads[2]; // of edits, of frames
  Cancel quit;          // ends everything: prepare, and frames of something moving
  Cancel interrupt;     // ends a pass that refines, because the picture must begin anew
  Cancel superseded;    // ends preparing, because the scene is to be replaced

  pthread_mutex_t mutex; // guards what follows, down to the line
  pthread_cond_t edit_wake, frame_wake, scene_free;
  LiveEdits edits;       // not yet taken
  uint64_t edit_number;  // of the last one asked
  LiveView view;         // width 0: none yet
  rf_eye eye;            // as the view was given
  uint64_t view_number;
  uint64_t posted;       // counts whatever the frame thread should look at
  rf_world *world;       // the newest; NULL: none yet
  uint64_t world_edit;   // the last edit that it shows, or would if it were one of geometry
  double prepare_seconds;
  int ready_slot, taken_slot; // of slots; the third is the frame thread's
  bool is_ready;              // ready_slot is newer than taken_slot
  bool is_scene_taken, is_borrowed; // by anybody; by a caller
  bool is_message_new;
  char message[sizeof((Err *)0)->text];
  // ---------------------------------------
  rf_scene *scene;    // owned; by whoever has taken it
  rf_world *previous; // owned; for the first world to share with; NULL afterwards
  bool is_stale;      // preparing was broken off, so the newest world lacks edits; of whoever has taken the scene
  LiveSlot slots[3];
  // Of the frame thread alone:
  Live *live;
  World *shown;       // its use of the newest world
  int slot;           // it works in this one
  uint64_t finished;  // posted, when nothing was left to do
  uint64_t frame_count;
};

static double seconds_now(void)
{
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + (double)t.tv_nsec * 1e-9;
}

rf_live_def rf_default_live_def(void) { return (rf_live_def){.magic = MAGIC_LIVE}; }

rf_live_view rf_default_live_view(void)
{
  return (rf_live_view){.render = rf_default_render_def(), .develop = rf_default_develop_def(), .denoise = true,
                        .reproject = true, .frame_seconds = 0.016, .blocks = 8, .magic = MAGIC_LIVE_VIEW};
}

static void tell(rf_live *l, const Err *err)
{
  pthread_mutex_lock(&l->mutex);
  memcpy(l->message, err->text, sizeof l->message);
  l->is_message_new = true;
  pthread_mutex_unlock(&l->mutex);
  if (l->ready) l->ready(l->user);
}

static void edit_finish(LiveEdit *e)
{
  free(e->path);
  free(e->json);
  rf_scene_destroy(e->scene);
}

static void edits_finish(LiveEdits *edits)
{
  for (size_t i = 0; i < edits->count; i++) edit_finish(&edits->items[i]);
  array_finish(edits);
}

// --- the edit thread ------------------------------------------------------------------------------
// These parts of a scene are read by those who ask for views; no world holds them.
static bool is_in_world(const char *path)
{
  static const char *const outside[] = {"camera", "cameras", "develop", "render"};
  if (!strcmp(path, "render") || !strcmp(path, "render.tree") || !strcmp(path, "render.compact")) return true;
  const size_t n = strcspn(path, ".[");
  for (size_t i = 0; i < sizeof outside / sizeof *outside; i++)
    if (strlen(outside[i]) == n && !strncmp(outside[i], path, n)) return false;
  return true;
}

static bool apply_set(rf_scene *s, const LiveEdit *e, Err *err)
{
  History *h = &s->history;
  const bool replaces = e->goes_on && h->done > 0 && h->done == h->changes.count &&
                        !strcmp(h->changes.items[h->done - 1].path, e->path) && history_undo(h, s->scene, NULL);
  if (history_set(h, s->scene, e->path, e->json, err)) return true;
  if (replaces) history_redo(h, s->scene, NULL);
  return false;
}

// Applies one edit. True if the world no longer shows what the scene says.
static bool apply(rf_live *l, LiveEdit *e, Err *err)
{
  rf_scene *s = l->scene;
  History *h = &s->history;
  switch (e->kind) {
  case LIVE_SET: return apply_set(s, e, err) && is_in_world(e->path);
  case LIVE_UNDO: return history_undo(h, s->scene, err) && is_in_world(h->changes.items[h->done].path);
  case LIVE_REDO: return history_redo(h, s->scene, err) && is_in_world(h->changes.items[h->done - 1].path);
  case LIVE_REPLACE:
  case LIVE_PREPARE: return true;
  }
  unreachable();
}

static void publish_world(rf_live *l, rf_world *w, uint64_t edit, double seconds)
{
  pthread_mutex_lock(&l->mutex);
  rf_world *old = l->world;
  l->world = w;
  l->world_edit = edit;
  l->prepare_seconds = seconds;
  l->posted++;
  atomic_store_explicit(&l->interrupt.requested, true, memory_order_relaxed);
  pthread_cond_signal(&l->frame_wake);
  pthread_mutex_unlock(&l->mutex);
  rf_world_destroy(old);
}

// The scene as it is after an edit, or the one that should replace it, as the newest world.
static bool prepare(rf_live *l, rf_scene *s, uint64_t edit, Err *err)
{
  const double start = seconds_now();
  // Only this thread replaces l->world, so it may look at it without the mutex.
  rf_world *w = api_prepare(s, l->world ? l->world : l->previous, &l->superseded, err);
  if (w) {
    rf_world_destroy(l->previous);
    l->previous = NULL;
  }
  if (w) publish_world(l, w, edit, seconds_now() - start);
  return w;
}

// The edits of one turn, then one world for all of them.
static void work_off(rf_live *l, LiveEdits *edits, uint64_t last)
{
  for (size_t i = 0; i < edits->count; i++) {
    LiveEdit *e = &edits->items[i];
    Err err = {0};
    l->is_stale |= apply(l, e, &err);
    if (e->kind == LIVE_REPLACE && prepare(l, e->scene, e->number, &err)) {
      rf_scene *old = l->scene;
      l->scene = e->scene;
      e->scene = old;
      l->is_stale = false;
    }
    if (err.kind && err.kind != ERR_CANCELLED) tell(l, &err);
  }
  Err err = {0};
  const bool ok = !l->is_stale || prepare(l, l->scene, last, &err);
  // What was broken off for another scene is made up for if that one cannot be prepared; what failed would fail again.
  l->is_stale = !ok && err.kind == ERR_CANCELLED;
  if (!ok && !l->is_stale) tell(l, &err);
  pthread_mutex_lock(&l->mutex);
  l->world_edit = last;
  l->posted++;
  pthread_cond_signal(&l->frame_wake);
  pthread_mutex_unlock(&l->mutex);
}

// Takes scene and inbox for one turn; the mutex is held.
static LiveEdits take_edits(rf_live *l, uint64_t *last)
{
  const LiveEdits edits = l->edits;
  memset(&l->edits, 0, sizeof l->edits);
  *last = l->edit_number;
  l->is_scene_taken = true;
  atomic_store_explicit(&l->superseded.requested, is_cancelled(&l->quit), memory_order_relaxed);
  return edits;
}

static void give_scene(rf_live *l)
{
  pthread_mutex_lock(&l->mutex);
  l->is_scene_taken = l->is_borrowed = false;
  pthread_cond_broadcast(&l->scene_free);
  pthread_cond_signal(&l->edit_wake);
  pthread_mutex_unlock(&l->mutex);
}

// Works off what was asked, if there is anything and nobody has the scene.
static void edit_turn(rf_live *l)
{
  uint64_t last = 0;
  LiveEdits edits = {0};
  pthread_mutex_lock(&l->mutex);
  if (l->edits.count && !l->is_scene_taken) edits = take_edits(l, &last);
  pthread_mutex_unlock(&l->mutex);
  if (!edits.count) return;
  work_off(l, &edits, last);
  edits_finish(&edits);
  give_scene(l);
}

static void *edit_main(void *user)
{
  rf_live *l = user;
  for (;;) {
    pthread_mutex_lock(&l->mutex);
    while (!is_cancelled(&l->quit) && (!l->edits.count || l->is_scene_taken))
      pthread_cond_wait(&l->edit_wake, &l->mutex);
    pthread_mutex_unlock(&l->mutex);
    if (is_cancelled(&l->quit)) return NULL;
    edit_turn(l);
  }
}

// --- the frame thread -----------------------------------------------------------------------------
// What to work on; the mutex is held. False: there is no world or view yet, or nothing to do.
static bool take_view(rf_live *l, LiveView *view, World **old, uint64_t *posted)
{
  if (!l->world || !l->view.width || l->finished == l->posted) return false;
  *old = NULL;
  if (l->shown != l->world->world) {
    *old = l->shown;
    l->shown = world_share(l->world->world);
  }
  *view = l->view;
  *posted = l->posted;
  LiveSlot *s = &l->slots[l->slot];
  s->view = l->view_number;
  s->edit = l->world_edit;
  s->eye = l->eye;
  s->prepare_seconds = l->prepare_seconds;
  atomic_store_explicit(&l->interrupt.requested, is_cancelled(&l->quit), memory_order_relaxed);
  return true;
}

static void publish_frame(rf_live *l)
{
  l->slots[l->slot].number = ++l->frame_count;
  pthread_mutex_lock(&l->mutex);
  const int made = l->slot;
  l->slot = l->ready_slot;
  l->ready_slot = made;
  l->is_ready = true;
  pthread_mutex_unlock(&l->mutex);
  if (l->ready) l->ready(l->user);
}

// True if something was done.
static bool frame_turn(rf_live *l, const LiveView *view, World *old, uint64_t posted)
{
  Err err = {0};
  const LiveOutcome outcome =
      live_step(l->live, l->shown, view, &l->quit, &l->interrupt, &l->slots[l->slot].frame, &err);
  world_release(old); // only now, so that its address is not that of a newer one
  switch (outcome) {
  case LIVE_IDLE: l->finished = posted; return false;
  case LIVE_WORKED: return true;
  case LIVE_SHOWN: publish_frame(l); return true;
  case LIVE_FAILED:
    tell(l, &err);
    l->finished = posted; // until something changes
    return false;
  }
  unreachable();
}

static void *frame_main(void *user)
{
  rf_live *l = user;
  LiveView view;
  World *old;
  uint64_t posted;
  for (;;) {
    pthread_mutex_lock(&l->mutex);
    while (!is_cancelled(&l->quit) && !take_view(l, &view, &old, &posted))
      pthread_cond_wait(&l->frame_wake, &l->mutex);
    pthread_mutex_unlock(&l->mutex);
    if (is_cancelled(&l->quit)) return NULL;
    frame_turn(l, &view, old, posted);
  }
}

// --- coming and going -----------------------------------------------------------------------------
static bool start_threads(rf_live *l, Err *err)
{
  static void *(*const mains[2])(void *) = {edit_main, frame_main};
  for (; !l->is_stepped && l->started < 2; l->started++) {
    const int failed = pthread_create(&l->threads[l->started], NULL, mains[l->started], l);
    if (failed) return err_set(err, ERR_NO_MEMORY, "cannot start a thread: %s", strerror(failed));
  }
  return true;
}

static rf_live *live_new(rf_scene *s, const rf_live_def *def, Err *err)
{
  rf_live *l = mem_zero(1, sizeof *l);
  if (!l) return err_memory(err, "a live picture", sizeof *l), NULL;
  pthread_condattr_t clock;
  pthread_condattr_init(&clock);
  pthread_condattr_setclock(&clock, CLOCK_MONOTONIC);
  pthread_mutex_init(&l->mutex, NULL);
  pthread_cond_init(&l->edit_wake, NULL);
  pthread_cond_init(&l->frame_wake, NULL);
  pthread_cond_init(&l->scene_free, &clock);
  pthread_condattr_destroy(&clock);
  l->engine = s->engine;
  l->scene = s;
  l->ready = def->ready;
  l->user = def->user;
  l->is_stepped = def->stepped;
  l->ready_slot = 1;
  l->taken_slot = 2;
  if (def->previous) l->previous = rf_world_share(def->previous, NULL);
  l->live = live_create(s->engine->jobs, s->engine->hot, err);
  if (!array_push(&l->edits, ((LiveEdit){.kind = LIVE_PREPARE}))) err_memory(err, "a live picture", 0);
  return l;
}

rf_live *rf_live_create(rf_scene *s, const rf_live_def *def)
{
  const rf_live_def defaults = rf_default_live_def();
  if (!s) return api_bad_argument("rf_live_create", "the scene is NULL"), NULL;
  if (!def) def = &defaults;
  if (!api_has_magic(def->magic, MAGIC_LIVE, "rf_live_create", "rf_live_def")) {
    rf_scene_destroy(s);
    return NULL;
  }
  Err err = {0};
  rf_live *l = live_new(s, def, &err);
  if (!l) rf_scene_destroy(s);
  if (l && !err.kind) start_threads(l, &err);
  if (api_fail(&err)) return l;
  rf_live_destroy(l);
  return NULL;
}

void rf_live_destroy(rf_live *l)
{
  if (!l) return;
  pthread_mutex_lock(&l->mutex);
  atomic_store(&l->quit.requested, true);
  atomic_store(&l->interrupt.requested, true);
  atomic_store(&l->superseded.requested, true);
  pthread_cond_broadcast(&l->edit_wake);
  pthread_cond_broadcast(&l->frame_wake);
  pthread_mutex_unlock(&l->mutex);
  for (int i = 0; i < l->started; i++) pthread_join(l->threads[i], NULL);
  edits_finish(&l->edits);
  live_destroy(l->live);
  world_release(l->shown);
  rf_world_destroy(l->world);
  rf_world_destroy(l->previous);
  rf_scene_destroy(l->scene);
  for (int i = 0; i < 3; i++) live_frame_finish(&l->slots[i].frame);
  pthread_cond_destroy(&l->edit_wake);
  pthread_cond_destroy(&l->frame_wake);
  pthread_cond_destroy(&l->scene_free);
  pthread_mutex_destroy(&l->mutex);
  mem_free(l);
}

// --- asking ---------------------------------------------------------------------------------------
static bool view_from(const rf_live_view *v, LiveView *out)
{
  static const char function[] = "rf_live_show";
  if (!api_has_magic(v->magic, MAGIC_LIVE_VIEW, function, "rf_live_view") ||
      !api_settings(&v->render, function, &out->settings) || !api_tone(&v->develop, function, &out->tone))
    return false;
  if (v->width < 1 || v->height < 1 || v->width > FILM_MOST_SIDE || v->height > FILM_MOST_SIDE)
    return api_bad_argument(function, "%d x %d is no size of a window", v->width, v->height);
  if (v->render.end_sample <= v->render.first_sample || v->render.first_sample > FILM_MOST_SAMPLES / 2)
    return api_bad_argument(function, "samples %d to %d are none, or begin too high", v->render.first_sample,
                            v->render.end_sample);
  const rf_frame *f = &v->eye.frame;
  const float sum = f->x.x + f->x.y + f->x.z + f->y.x + f->y.y + f->y.z + f->z.x + f->z.y + f->z.z + f->p.x + f->p.y +
                    f->p.z + v->eye.fov + v->eye.focus + v->eye.aperture + v->eye.height;
  if (!isfinite(sum)) return api_bad_argument(function, "the eye is at no place, or looks nowhere: not all of it is finite");
  if (v->step != 0 && v->step != 1 && v->step != 2 && v->step != 4 && v->step != 8)
    return api_bad_argument(function, "a step of %d; it is 0, 1, 2, 4 or 8", v->step);
  if (v->blocks != 0 && v->blocks != 4 && v->blocks != 8 && v->blocks != 16)
    return api_bad_argument(function, "blocks of %d; it is 0, 4, 8 or 16", v->blocks);
  out->eye = api_eye(&v->eye);
  out->width = (uint32_t)v->width;
  out->height = (uint32_t)v->height;
  out->seed = v->render.seed;
  out->first_sample = (uint32_t)v->render.first_sample;
  out->end_sample = (uint32_t)v->render.end_sample;
  out->denoises = v->denoise;
  out->reprojects = v->reproject;
  out->frame_seconds = v->frame_seconds;
  out->step = v->step;
  out->blocks = v->blocks;
  out->shows_blocks = v->show_blocks;
  return true;
}

uint64_t rf_live_show(rf_live *l, const rf_live_view *view)
{
  LiveView v = {0};
  if (!l || !view) return api_bad_argument("rf_live_show", "live picture and view must not be NULL"), 0;
  if (!view_from(view, &v)) return 0;
  pthread_mutex_lock(&l->mutex);
  const uint64_t number = ++l->view_number;
  if (live_view_differs(&l->view, &v)) atomic_store_explicit(&l->interrupt.requested, true, memory_order_relaxed);
  l->view = v;
  l->eye = view->eye;
  l->posted++;
  pthread_cond_signal(&l->frame_wake);
  pthread_mutex_unlock(&l->mutex);
  return number;
}

// Takes the edit over; 0 when memory is out.
static uint64_t ask(rf_live *l, LiveEdit e)
{
  pthread_mutex_lock(&l->mutex);
  LiveEdit *last = l->edits.count ? &l->edits.items[l->edits.count - 1] : NULL;
  const bool replaces = last && e.goes_on && last->kind == LIVE_SET && !strcmp(last->path, e.path);
  if (replaces) e.goes_on = last->goes_on;
  if (replaces) edit_finish(last);
  const bool ok = replaces || array_reserve(&l->edits, l->edits.count + 1);
  e.number = l->edit_number + 1;
  if (ok) l->edits.items[replaces ? l->edits.count - 1 : l->edits.count++] = e;
  if (ok && e.kind == LIVE_REPLACE) atomic_store_explicit(&l->superseded.requested, true, memory_order_relaxed);
  const uint64_t number = ok ? ++l->edit_number : 0; // e.number
  pthread_cond_signal(&l->edit_wake);
  pthread_mutex_unlock(&l->mutex);
  if (ok) return number;
  Err err = {0};
  err_memory(&err, "an edit", sizeof e);
  edit_finish(&e);
  return api_fail(&err);
}

uint64_t rf_live_set(rf_live *l, const char *path, const char *json, bool goes_on)
{
  if (!l || !path || !json) return api_bad_argument("rf_live_set", "live picture, path and value must not be NULL"), 0;
  LiveEdit e = {.kind = LIVE_SET, .goes_on = goes_on, .path = strdup(path), .json = strdup(json)};
  if (e.path && e.json) return ask(l, e);
  Err err = {0};
  err_memory(&err, "an edit", strlen(json));
  edit_finish(&e);
  return api_fail(&err);
}

uint64_t rf_live_undo(rf_live *l)
{
  return l ? ask(l, (LiveEdit){.kind = LIVE_UNDO}) : api_bad_argument("rf_live_undo", "the live picture is NULL");
}

uint64_t rf_live_redo(rf_live *l)
{
  return l ? ask(l, (LiveEdit){.kind = LIVE_REDO}) : api_bad_argument("rf_live_redo", "the live picture is NULL");
}

uint64_t rf_live_replace(rf_live *l, rf_scene *s)
{
  if (!l || !s || s->engine != l->engine) {
    rf_scene_destroy(s);
    return api_bad_argument("rf_live_replace", "live picture and scene must not be NULL, and of one engine");
  }
  return ask(l, (LiveEdit){.kind = LIVE_REPLACE, .scene = s});
}

// --- answers --------------------------------------------------------------------------------------
bool rf_live_take(rf_live *l, rf_live_frame *out)
{
  if (!l || !out) return api_bad_argument("rf_live_take", "live picture and result must not be NULL");
  pthread_mutex_lock(&l->mutex);
  const bool is_new = l->is_ready;
  if (is_new) {
    const int taken = l->ready_slot;
    l->ready_slot = l->taken_slot;
    l->taken_slot = taken;
    l->is_ready = false;
  }
  pthread_mutex_unlock(&l->mutex);
  if (!is_new) return false;
  const LiveSlot *s = &l->slots[l->taken_slot]; // the caller's alone until it comes again
  const LiveFrame *f = &s->frame;
  *out = (rf_live_frame){.pixels = f->pixels, .width = (int)f->width, .height = (int)f->height,
                         .objects = f->objects, .render_width = (int)f->render_width,
                         .render_height = (int)f->render_height, .samples = (int)f->samples,
                         .is_moving = f->is_moving, .is_finished = f->is_finished,
                         .prepare_seconds = s->prepare_seconds, .render_seconds = f->render_seconds,
                         .denoise_seconds = f->denoise_seconds, .show_seconds = f->show_seconds, .traced = f->traced, .rays = f->rays,
                         .number = s->number, .view = s->view, .edit = s->edit, .eye = s->eye};
  return true;
}

bool rf_live_message(rf_live *l, char *out, size_t size)
{
  if (!l || !out || !size) return api_bad_argument("rf_live_message", "live picture and room must not be NULL");
  pthread_mutex_lock(&l->mutex);
  const bool is_new = l->is_message_new;
  const size_t n = strlen(l->message) < size - 1 ? strlen(l->message) : size - 1;
  if (is_new) {
    memcpy(out, l->message, n);
    out[n] = 0;
  }
  l->is_message_new = false;
  pthread_mutex_unlock(&l->mutex);
  return is_new;
}

rf_world *rf_live_world(rf_live *l)
{
  if (!l) return api_bad_argument("rf_live_world", "the live picture is NULL"), NULL;
  pthread_mutex_lock(&l->mutex);
  rf_world *w = l->world ? rf_world_share(l->world, NULL) : NULL;
  pthread_mutex_unlock(&l->mutex);
  return w;
}

rf_scene *rf_live_borrow(rf_live *l, double seconds)
{
  if (!l) return api_bad_argument("rf_live_borrow", "the live picture is NULL"), NULL;
  const double until = seconds_now() + (seconds < 1e6 ? seconds : 1e6);
  const struct timespec end = {(time_t)until, (long)((until - (double)(time_t)until) * 1e9)};
  if (l->is_stepped) edit_turn(l);
  pthread_mutex_lock(&l->mutex);
  while ((l->is_scene_taken || l->edits.count) && seconds_now() < until)
    pthread_cond_timedwait(&l->scene_free, &l->mutex, &end);
  const bool ok = !l->is_scene_taken && !l->edits.count;
  if (ok) l->is_scene_taken = l->is_borrowed = true;
  pthread_mutex_unlock(&l->mutex);
  return ok ? l->scene : NULL;
}

void rf_live_return(rf_live *l)
{
  if (!l) return;
  pthread_mutex_lock(&l->mutex);
  const bool is_borrowed = l->is_borrowed;
  pthread_mutex_unlock(&l->mutex);
  if (is_borrowed) give_scene(l);
}

bool rf_live_step(rf_live *l)
{
  if (!l || !l->is_stepped) return api_bad_argument("rf_live_step", "this is for live pictures created as stepped");
  LiveView view;
  World *old;
  uint64_t posted;
  edit_turn(l);
  pthread_mutex_lock(&l->mutex);
  const bool has_work = take_view(l, &view, &old, &posted);
  pthread_mutex_unlock(&l->mutex);
  return has_work && frame_turn(l, &view, old, posted);
}
