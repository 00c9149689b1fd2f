// See plan.h.

#include "render/plan.h"

#include "base/mem.h"

static double cell_pixels(const Film *f, uint32_t cell)
{
  const CellBox b = film_cell_box(f, cell);
  return (double)(b.x1 - b.x0) * (b.y1 - b.y0);
}

// A film that is to be judged by its noise has samples without gaps, from the first on.
static bool check_no_gaps(const Plan *p, Err *err)
{
  const CellRange *r = p->film->ranges.items;
  for (size_t i = 0; i < p->film->ranges.count; i++)
    if (r[i].first != p->first)
      return err_set(err, ERR_BAD_ARGUMENT,
                     "the film has samples %u to %u by themselves; a noise target needs all from %u on", r[i].first,
                     r[i].end, p->first);
  return true;
}

static bool check_plan(const Plan *p, Err *err)
{
  const uint32_t cells = film_cells(p->film);
  if (p->first >= p->end)
    return err_set(err, ERR_BAD_ARGUMENT, "samples %u to %u are none; the end must lie above the first", p->first,
                   p->end);
  if (p->first_cell >= p->end_cell || p->end_cell > cells)
    return err_set(err, ERR_BAD_ARGUMENT, "cells %u to %u of %u are none", p->first_cell, p->end_cell, cells);
  if (!(p->noise_target > 0)) return true;
  if (!film_has(p->film, FILM_VARIANCE))
    return err_set(err, ERR_BAD_ARGUMENT, "a noise target needs a film with the variance plane");
  if (p->end_cell - p->first_cell < cells)
    return err_set(err, ERR_BAD_ARGUMENT, "a noise target needs the whole picture: a cell is judged with its neighbours");
  return check_no_gaps(p, err);
}

bool plan_init(Plan *p, const Film *film, uint32_t first, uint32_t end, uint32_t first_cell, uint32_t end_cell,
               double noise_target, Err *err)
{
  const uint32_t cells = film_cells(film);
  *p = (Plan){.film = film, .first = first, .end = end, .first_cell = first_cell, .end_cell = end_cell,
              .noise_target = noise_target};
  if (!check_plan(p, err)) return false;
  p->items = mem_alloc(cells, sizeof *p->items);
  p->taken = mem_zero(cells, sizeof *p->taken);
  p->noise = mem_zero(cells, sizeof *p->noise);
  p->goes_on = mem_zero(cells, sizeof *p->goes_on);
  if (!p->items || !p->taken || !p->noise || !p->goes_on) {
    plan_finish(p);
    return err_memory(err, "the plan of a picture", cells * sizeof *p->items);
  }
  for (uint32_t i = first_cell; i < end_cell; i++) p->pixels += cell_pixels(film, i);
  return true;
}

void plan_finish(Plan *p)
{
  mem_free(p->items);
  mem_free(p->taken);
  mem_free(p->noise);
  mem_free(p->goes_on);
  *p = (Plan){0};
}

// --- what is lacking --------------------------------------------------------------------------------

// Goes through the film's ranges along with the cells, which must come in order.
typedef struct Lack {
  CellRange next; // the first samples lacking; first == end: none
  uint32_t all;   // how many are lacking in all
} Lack;

static Lack lack_of(const Plan *p, uint32_t cell, size_t *at)
{
  const CellRange *r = p->film->ranges.items;
  const size_t count = p->film->ranges.count;
  Lack l = {{cell, p->end, p->end}, 0};
  uint32_t from = p->first;
  while (*at < count && r[*at].cell < cell) ++*at;
  for (; from < p->end; ++*at) {
    const bool is_here = *at < count && r[*at].cell == cell;
    const uint32_t to = !is_here || r[*at].first > p->end ? p->end : r[*at].first;
    if (to > from) {
      if (!l.all) l.next = (CellRange){cell, from, to};
      l.all += to - from;
    }
    if (!is_here) break;
    if (r[*at].end > from) from = r[*at].end;
  }
  return l;
}

// 1, 1, 2, 4, 8, 16, 16, ... so that the first picture comes soon.
static uint32_t early(uint32_t taken)
{
  return taken == 0 ? 1 : taken < PLAN_STOP ? taken : PLAN_STOP;
}

static void add_item(Plan *p, CellRange r, uint32_t most)
{
  if (r.end - r.first > most) r.end = r.first + most;
  if (r.first < r.end) p->items[p->count++] = r;
}

static void plan_evenly(Plan *p, uint32_t most)
{
  size_t at = 0;
  double left = 0;
  for (uint32_t i = p->first_cell; i < p->end_cell; i++) {
    const Lack l = lack_of(p, i, &at);
    const uint32_t fits = early(p->taken[i]);
    left += l.all * cell_pixels(p->film, i);
    add_item(p, l.next, fits < most ? fits : most);
  }
  p->left = left / p->pixels;
}

// --- until the noise is low enough ------------------------------------------------------------------

// The first stop above n samples.
static uint32_t stop_after(uint32_t n)
{
  uint32_t stop = PLAN_STOP;
  while (stop <= n) {
    const uint32_t quarter = stop / 4 & ~3u;
    stop += quarter > PLAN_STOP ? quarter : PLAN_STOP;
  }
  return stop;
}

static bool is_stop(uint32_t n)
{
  return n > 0 && stop_after(n - 1) == n;
}

// Cells that are under way to their stop, all others wait for them.
static void plan_to_stop(Plan *p, uint32_t most)
{
  size_t at = 0;
  for (uint32_t i = p->first_cell; i < p->end_cell; i++) {
    const CellRange r = lack_of(p, i, &at).next;
    const uint32_t n = r.first - p->first;
    if (n >= PLAN_LEAST && is_stop(n)) continue;
    const uint32_t to_stop = stop_after(n) - n, fits = early(n) < to_stop ? early(n) : to_stop;
    add_item(p, r, fits < most ? fits : most);
  }
}

static bool is_noisy_around(const Plan *p, uint32_t cell)
{
  const uint32_t columns = film_columns(p->film), rows = film_cells(p->film) / columns;
  const uint32_t x = cell % columns, y = cell / columns;
  for (uint32_t j = y ? y - 1 : 0; j <= y + 1 && j < rows; j++)
    for (uint32_t i = x ? x - 1 : 0; i <= x + 1 && i < columns; i++)
      if (p->noise[j * columns + i] > p->noise_target) return true;
  return false;
}

static void judge(Plan *p)
{
  double done = 0;
  p->picture_noise = film_noise(p->film, p->noise);
  for (uint32_t i = p->first_cell; i < p->end_cell; i++) {
    p->goes_on[i] = is_noisy_around(p, i);
    done += p->noise[i] <= p->noise_target;
  }
  p->done_cells = done / (p->end_cell - p->first_cell);
}

static void plan_past_stop(Plan *p, uint32_t most)
{
  size_t at = 0;
  judge(p);
  for (uint32_t i = p->first_cell; i < p->end_cell; i++) {
    const CellRange r = lack_of(p, i, &at).next;
    const uint32_t n = r.first - p->first, to_stop = stop_after(n) - n;
    if (p->goes_on[i]) add_item(p, r, to_stop < most ? to_stop : most);
  }
}

// Noise falls with the root of the samples.
static void estimate_left(Plan *p)
{
  size_t at = 0;
  double left = 0;
  for (uint32_t i = p->first_cell; i < p->end_cell; i++) {
    const Lack l = lack_of(p, i, &at);
    const double n = l.next.first - p->first, over = p->noise[i] / p->noise_target;
    const double more = n < PLAN_LEAST ? PLAN_LEAST - n : over > 1 ? n * (over * over - 1) : p->goes_on[i] ? PLAN_STOP : 0;
    left += (more < l.all ? more : l.all) * cell_pixels(p->film, i);
  }
  p->left = left / p->pixels;
}

bool plan_next(Plan *p, uint32_t most)
{
  p->count = 0;
  if (most > PLAN_STOP) most = PLAN_STOP;
  if (p->noise_target > 0) {
    plan_to_stop(p, most);
    if (!p->count) plan_past_stop(p, most);
    estimate_left(p);
  } else {
    plan_evenly(p, most);
  }
  return p->count > 0;
}

// --- what a pass is ---------------------------------------------------------------------------------
double plan_cost(const Plan *p)
{
  double samples = 0;
  for (size_t i = 0; i < p->count; i++)
    samples += (p->items[i].end - p->items[i].first) * cell_pixels(p->film, p->items[i].cell);
  return samples / p->pixels;
}

void plan_trim(Plan *p, uint32_t most)
{
  for (size_t i = 0; i < p->count; i++)
    if (p->items[i].end - p->items[i].first > most) p->items[i].end = p->items[i].first + most;
}

void plan_took(Plan *p)
{
  for (size_t i = 0; i < p->count; i++) p->taken[p->items[i].cell] += p->items[i].end - p->items[i].first;
}

uint32_t plan_most_taken(const Plan *p)
{
  uint32_t most = 0;
  for (uint32_t i = p->first_cell; i < p->end_cell; i++)
    if (p->taken[i] > most) most = p->taken[i];
  return most;
}

double plan_mean_taken(const Plan *p)
{
  double samples = 0;
  for (uint32_t i = p->first_cell; i < p->end_cell; i++) samples += p->taken[i] * cell_pixels(p->film, i);
  return samples / p->pixels;
}

bool plan_is_even(const Plan *p)
{
  if (p->count != film_cells(p->film)) return false;
  for (size_t i = 1; i < p->count; i++)
    if (p->items[i].first != p->items[0].first || p->items[i].end != p->items[0].end) return false;
  return true;
}
