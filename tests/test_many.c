// Scenes of very many things become worlds, and one mesh, in a time that grows with their number. Measured is processor
// time, which other programs disturb little.

#include "tests/test.h"

#include "world/merge.h"
#include "world/parts.h"
#include "world/world.h"

#include <time.h>

static void add_triangle(Scene *s)
{
  static const float positions[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  static const uint32_t triangles[] = {0, 1, 2};
  MeshData *m = mesh_data_create();
  m->vertex_count = 3;
  m->triangle_count = 1;
  m->positions = mem_alloc(9, sizeof(float));
  m->triangles = mem_alloc(3, sizeof(uint32_t));
  memcpy(m->positions, positions, sizeof positions);
  memcpy(m->triangles, triangles, sizeof triangles);
  const int32_t mesh = scene_add_mesh(s, "triangle", m), object = scene_add_object(s, SHAPE_MESH, NULL);
  s->objects.items[object].shape.mesh_i = mesh;
}

// Prepares, prepares again, and merges a scene of so many meshes. Processor seconds.
static double time_meshes(int count)
{
  Err err = {0};
  Scene *s = scene_create(&err);
  for (int i = 0; i < count; i++) add_triangle(s);
  const clock_t start = clock();
  World *first = world_prepare(s, NULL, NULL, NULL, NULL, &err);
  World *second = world_prepare(s, first, NULL, NULL, NULL, &err);
  MeshData *merged = world_merge(second, &err);
  const double seconds = (double)(clock() - start) / CLOCKS_PER_SEC;
  CHECK_MSG(merged && merged->triangle_count == (size_t)count, "%s", err.text);
  CHECK(second->parts->meshes.items[count - 1].tree == first->parts->meshes.items[count - 1].tree);
  mesh_data_release(merged);
  world_release(first);
  world_release(second);
  scene_destroy(s);
  return seconds;
}

TEST(many_meshes_take_linear_time)
{
  const double few = time_meshes(10000), many = time_meshes(80000);
  printf("  %.3f and %.3f s\n", few, many);
  CHECK_MSG(many < 16 * few + 0.1, "8 times the meshes take %.2f s instead of %.2f s", many, few);
}

// Thousands of textures of one large picture inside a model.
TEST(a_picture_of_many_textures_is_looked_at_once)
{
  enum { SIDE = 1000, COUNT = 3000 };
  static const char head[] = "Pf\n1000 1000\n-1\n"; // PFM: every build reads it
  const size_t size = sizeof head - 1 + (size_t)4 * SIDE * SIDE;
  Err err = {0};
  Scene *s = scene_create(&err);
  uint8_t *pfm = arena_alloc(&s->arena, size, 1);
  memcpy(pfm, head, sizeof head - 1);
  for (int i = 0; i < COUNT; i++) {
    const int32_t t = scene_add_texture(s, TEXTURE_IMAGE, NULL),
                  m = scene_add_material(s, MATERIAL_LAMBERT, NULL);
    s->textures.items[t].embedded = pfm;
    s->textures.items[t].embedded_size = size;
    s->materials.items[m].lambert.albedo_texture = t;
  }
  const clock_t start = clock();
  World *w = world_prepare(s, NULL, NULL, NULL, NULL, &err);
  const double seconds = (double)(clock() - start) / CLOCKS_PER_SEC;
  CHECK_MSG(w && w->parts->images.count == 1 && w->texture_count == COUNT, "%s", err.text);
  CHECK_MSG(seconds < 1.5, "%.2f s", seconds); // 0.02 s; hashing it for each texture takes 5 s and more
  world_release(w);
  scene_destroy(s);
}

TEST_MAIN
