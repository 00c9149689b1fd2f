// Rung 1, the list: every ray is tested against every triangle. Nothing to build and nothing to get wrong, and the
// cost of a ray grows with the scene: 100,000 triangles, 100,000 tests. Whitted's first pictures (1980) spent three
// quarters of their time here.

#include "basics.h"

#include <stdlib.h>

typedef struct List {
  uint32_t count;
  Triangle triangles[];
} List;

static void *list_build(const LadderMesh *m, size_t *bytes)
{
  *bytes = sizeof(List) + m->triangle_count * sizeof(Triangle);
  List *list = malloc(*bytes);
  if (!list) return NULL;
  list->count = m->triangle_count;
  for (uint32_t i = 0; i < list->count; i++) list->triangles[i] = mesh_triangle(m, i);
  return list;
}

static void list_closest(const void *tree, const LadderRay *rays, LadderHit *hits, size_t count,
                         LadderCounts *c)
{
  const List *list = tree;
  for (size_t r = 0; r < count; r++) {
    Walk w = walk_begin(&rays[r]);
    for (uint32_t i = 0; i < list->count; i++) walk_triangle(&w, &list->triangles[i], i);
    hits[r] = w.best;
  }
  c->triangles += count * list->count;
}

const Rung rung_list = {"list of triangles",
                        "The start: every ray against every triangle.",
                        true,
                        list_build,
                        list_closest,
                        free};
