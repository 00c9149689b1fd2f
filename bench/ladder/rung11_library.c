// Rung 11, the library: all of it together, through rayfold.h as any program uses it. It builds with one thread here,
// as the other rungs do.

#include "basics.h"

#include <rayfold/rayfold.h>
#include <stdlib.h>

_Static_assert(sizeof(LadderRay) == sizeof(rf_ray), "rays go to the library as they are");

typedef struct Library {
  rf_engine *engine;
  rf_world *world;
} Library;

static void library_destroy(void *tree)
{
  Library *l = tree;
  if (!l) return;
  rf_world_destroy(l->world);
  rf_engine_destroy(l->engine);
  free(l);
}

static rf_world *prepare(rf_engine *engine, const LadderMesh *m)
{
  rf_mesh_def def = rf_default_mesh_def();
  def.positions = m->positions;
  def.triangles = m->triangles;
  def.vertex_count = m->vertex_count;
  def.triangle_count = m->triangle_count;
  rf_scene *scene = rf_scene_create(engine);
  rf_world *world = scene && rf_add_mesh(scene, NULL, &def).id ? rf_prepare(scene, NULL) : NULL;
  rf_scene_destroy(scene);
  return world;
}

static void *library_build(const LadderMesh *m, size_t *bytes)
{
  rf_engine_def def = rf_default_engine_def();
  def.threads = 1;
  Library *l = calloc(1, sizeof *l);
  if (l) l->engine = rf_engine_create(&def);
  if (l && l->engine) l->world = prepare(l->engine, m);
  if (!l || !l->world) {
    library_destroy(l);
    return NULL;
  }
  *bytes = rf_world_take_stats(l->world).tree_bytes;
  return l;
}

static void library_closest(const void *tree, const LadderRay *rays, LadderHit *hits, size_t count,
                            LadderCounts *c)
{
  enum { BLOCK = 1024 };
  const Library *l = tree;
  rf_hit found[BLOCK];
  (void)c;
  for (size_t first = 0; first < count; first += BLOCK) {
    const size_t n = count - first < BLOCK ? count - first : BLOCK;
    rf_intersect_n(l->world, (const rf_ray *)(const void *)(rays + first), found, n);
    for (size_t i = 0; i < n; i++)
      hits[first + i] = (LadderHit){found[i].t, found[i].object.id ? found[i].part : LADDER_MISS};
  }
}

const Rung rung_library = {"the library",   "All of it, watertight, on the best instructions there are.",
                           false,           library_build,
                           library_closest, library_destroy};
