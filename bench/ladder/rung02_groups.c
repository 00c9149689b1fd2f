// Rung 2, boxes around groups: neighbouring triangles share a box, and a ray that misses the box misses them all
// (Rubin and Whitted 1980, by hand then). Sixty-four triangles for one test, but still all groups for every ray.

#include "halves.h"

#include <stdlib.h>

// Mrays/s in the hall, of camera and of bounced rays: 32 has 0.062 and 0.053, 64 has 0.079 and 0.058, 128 has 0.092 and
// 0.051.
enum { GROUP = 64 };

typedef struct Groups {
  uint32_t group_count, triangle_count;
  Box *boxes;
  Triangle *triangles; // group after group
  uint32_t *prims;
} Groups;

static void groups_destroy(void *tree)
{
  Groups *g = tree;
  if (!g) return;
  free(g->boxes);
  free(g->triangles);
  free(g->prims);
  free(g);
}

// Halving sorts neighbours together: down to groups.
static void gather(Item *items, uint32_t count)
{
  if (count <= GROUP) return;
  const uint32_t groups = (count + GROUP - 1) / GROUP, left = groups / 2 * GROUP;
  items_halve(items, count, left);
  gather(items, left);
  gather(items + left, count - left);
}

static void *groups_build(const LadderMesh *m, size_t *bytes)
{
  Groups *g = calloc(1, sizeof *g);
  Item *items = items_of(m);
  const uint32_t n = m->triangle_count, groups = (n + GROUP - 1) / GROUP;
  if (g)
    *g = (Groups){groups, n, malloc(groups * sizeof(Box)), malloc(n * sizeof(Triangle)),
                  malloc(4 * (size_t)n)};
  if (!g || !items || !g->boxes || !g->triangles || !g->prims) {
    free(items);
    groups_destroy(g);
    return NULL;
  }
  gather(items, n);
  for (uint32_t i = 0; i < groups; i++)
    g->boxes[i] = items_box(items + i * GROUP, n - i * GROUP < GROUP ? n - i * GROUP : GROUP);
  for (uint32_t i = 0; i < n; i++) {
    g->triangles[i] = mesh_triangle(m, items[i].prim);
    g->prims[i] = items[i].prim;
  }
  free(items);
  *bytes = groups * sizeof(Box) + n * (sizeof(Triangle) + 4);
  return g;
}

static void groups_closest(const void *tree, const LadderRay *rays, LadderHit *hits, size_t count,
                           LadderCounts *c)
{
  const Groups *g = tree;
  uint64_t triangles = 0;
  for (size_t r = 0; r < count; r++) {
    Walk w = walk_begin(&rays[r]);
    for (uint32_t i = 0; i < g->group_count; i++) {
      if (walk_box(&w, &g->boxes[i]) == INFINITY) continue;
      const uint32_t first = i * GROUP, left = g->triangle_count - first,
                     end = first + (left < GROUP ? left : GROUP);
      for (uint32_t k = first; k < end; k++) walk_triangle(&w, &g->triangles[k], g->prims[k]);
      triangles += end - first;
    }
    hits[r] = w.best;
  }
  c->boxes += count * g->group_count;
  c->triangles += triangles;
}

const Rung rung_groups = {
    "boxes around groups", "One box says no for 64 triangles.", true, groups_build, groups_closest,
    groups_destroy};
