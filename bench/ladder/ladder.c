#include "basics.h"

#include <stdlib.h>
#include <time.h>

const Rung *const ladder_rungs[] = {&rung_list,    &rung_groups,  &rung_fat,     &rung_lean,
                                    &rung_array,   &rung_pairs,   &rung_sah,     &rung_wide,
                                    &rung_compact, &rung_packets, &rung_library, NULL};
_Static_assert(sizeof ladder_rungs / sizeof *ladder_rungs == LADDER_RUNGS + 1, "all of them");

bool ladder_can_run(void)
{
#ifdef __AVX2__
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
#else
  return true;
#endif
}

// Processor time: rungs run in this thread alone, and other work on the machine is not theirs.
static double cpu_seconds(void)
{
  struct timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

// --- one rung on one set ---------------------------------------------------------------------------
typedef struct Trial { // memory shared by all trials, for the largest set
  LadderRay *rays;
  LadderHit *hits;
  LadderHit *found[LADDER_SETS]; // of each set what rungs before found
  bool *is_found[LADDER_SETS];
  float diagonal; // of the mesh
} Trial;

static float mesh_diagonal(const LadderMesh *m)
{
  Box b = box_empty();
  float sum = 0;
  for (uint32_t i = 0; i < m->triangle_count; i++) {
    const Box triangle = mesh_box(m, i);
    box_add(&b, &triangle);
  }
  for (int k = 0; k < 3; k++) sum += (b.hi[k] - b.lo[k]) * (b.hi[k] - b.lo[k]);
  return sqrtf(sum);
}

static bool trial_init(Trial *t, const Ladder *l)
{
  size_t largest = 0;
  bool ok = true;
  *t = (Trial){.diagonal = mesh_diagonal(l->mesh)};
  for (size_t s = 0; s < l->set_count; s++) {
    const size_t n = l->sets[s].count;
    t->found[s] = malloc(n * sizeof **t->found);
    t->is_found[s] = calloc(n, sizeof **t->is_found);
    ok = ok && t->found[s] && t->is_found[s];
    if (n > largest) largest = n;
  }
  t->rays = malloc(largest * sizeof *t->rays);
  t->hits = malloc(largest * sizeof *t->hits);
  return ok && t->rays && t->hits;
}

static void trial_finish(Trial *t)
{
  for (int s = 0; s < LADDER_SETS; s++) {
    free(t->found[s]);
    free(t->is_found[s]);
  }
  free(t->rays);
  free(t->hits);
}

// Which ray of the set is the i-th of `count`: runs of neighbours, evenly out of the whole set, because neighbours
// help each other.
static size_t picked(const LadderSet *set, size_t count, size_t i)
{
  enum { RUN = 64 };
  if (count == set->count) return i;
  const size_t runs = set->count / RUN, wanted = (count + RUN - 1) / RUN;
  return (size_t)((double)(i / RUN) * ((double)runs / (double)wanted)) * RUN + i % RUN;
}

static double run(const Rung *rung, const void *tree, Trial *t, size_t count, LadderCounts *counts)
{
  const double start = cpu_seconds();
  *counts = (LadderCounts){0};
  rung->closest(tree, t->rays, t->hits, count, counts);
  return cpu_seconds() - start;
}

static void pick(const LadderSet *set, Trial *t, size_t count)
{
  for (size_t i = 0; i < count; i++) t->rays[i] = set->rays[picked(set, count, i)];
}

// As many rays as take about a third of the time: all of them, if that is possible.
static size_t affordable(const Rung *rung, const void *tree, const LadderSet *set, Trial *t, double seconds)
{
  LadderCounts counts;
  size_t count = set->count < 64 ? set->count : 64;
  for (;;) {
    pick(set, t, count);
    const double taken = run(rung, tree, t, count, &counts);
    const size_t more = count < set->count / 4 ? 4 * count : set->count;
    if (count == set->count || taken * (double)more / (double)count > seconds / 3) return count;
    count = more;
  }
}

static bool is_same(const Rung *rung, float diagonal, const LadderHit *a, const LadderHit *b)
{
  if (rung != &rung_library) return a->prim == b->prim && (a->t == b->t || a->prim == LADDER_MISS);
  if (a->prim == LADDER_MISS || b->prim == LADDER_MISS) return a->prim == b->prim;
  return fabsf(a->t - b->t) <=
         1e-4f * fmaxf(a->t, 1e-3f * diagonal); // another arithmetic, and edges are shared
}

static void compare(const Rung *rung, const LadderSet *set, size_t s, Trial *t, RungOnSet *on)
{
  for (size_t i = 0; i < on->rays; i++) {
    const size_t at = picked(set, on->rays, i);
    if (t->is_found[s][at]) {
      on->compared++;
      on->differing += !is_same(rung, t->diagonal, &t->found[s][at], &t->hits[i]);
    }
    t->is_found[s][at] = true;
    t->found[s][at] = t->hits[i];
  }
}

static void measure(const Rung *rung, const void *tree, const LadderSet *set, size_t s, Trial *t,
                    double seconds, RungOnSet *on)
{
  LadderCounts counts;
  double best = INFINITY, sum = 0;
  on->rays = affordable(rung, tree, set, t, seconds);
  for (int i = 0; i < 1000 && (i < 2 || sum < seconds); i++) {
    const double taken = run(rung, tree, t, on->rays, &counts);
    best = fmin(best, taken);
    sum += taken;
  }
  on->rate = (double)on->rays / fmax(best, 1e-9);
  on->boxes = (double)counts.boxes / (double)on->rays;
  on->triangles = (double)counts.triangles / (double)on->rays;
  compare(rung, set, s, t, on);
}

// --- all of them -----------------------------------------------------------------------------------
static bool climb(Ladder *l, size_t i, Trial *t, double seconds)
{
  RungResult *r = &l->results[i];
  size_t bytes = 0;
  *r = (RungResult){.rung = ladder_rungs[i]};
  const double start = cpu_seconds();
  void *tree = r->rung->build(l->mesh, &bytes);
  r->build_seconds = cpu_seconds() - start;
  r->bytes_per_triangle = (double)bytes / l->mesh->triangle_count;
  for (size_t s = 0; s < l->set_count && tree; s++)
    measure(r->rung, tree, &l->sets[s], s, t, seconds, &r->on[s]);
  r->rung->destroy(tree);
  return tree != NULL;
}

bool ladder_run(Ladder *l, double seconds, void (*said)(void *user, const Ladder *l, size_t rung), void *user)
{
  Trial t;
  bool ok = trial_init(&t, l);
  for (l->rung_count = 0; ok && ladder_rungs[l->rung_count];) {
    ok = climb(l, l->rung_count, &t, seconds);
    if (ok) said(user, l, l->rung_count++);
  }
  trial_finish(&t);
  return ok;
}

bool ladder_agrees(const Ladder *l)
{
  for (size_t i = 0; i < l->rung_count; i++)
    for (size_t s = 0; s < l->set_count; s++) {
      const RungOnSet *on = &l->results[i].on[s];
      const size_t one_in = l->results[i].rung == &rung_library ? 1000 : 100000;
      if (on->differing > on->compared / one_in) return false;
    }
  return true;
}
