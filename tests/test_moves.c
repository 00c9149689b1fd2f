// Vertices that move, through worlds and the public interface: what the next world shares, what it makes anew, and that
// nobody can tell a world that followed from one that was made from nothing.

#include "tests/test.h"

#include "accel/tree.h"
#include "base/hash.h"
#include "base/mem.h"
#include "rayfold/rayfold.h"
#include "world/parts.h"
#include "world/world.h"

enum { SIDE = 24, VERTICES = SIDE * SIDE, TRIANGLES = 2 * (SIDE - 1) * (SIDE - 1) };

typedef struct Cloth {
  float positions[3 * VERTICES], normals[3 * VERTICES], texcoords[2 * VERTICES];
  uint32_t triangles[3 * TRIANGLES];
} Cloth;

static float wave(float x, float y, float time) { return 0.2f * sinf(5 * x + time) * cosf(4 * y - 2 * time); }

// A cloth in the wind; at `time` 0 with all else it needs.
static void blow(Cloth *c, float time)
{
  for (uint32_t i = 0; i < VERTICES; i++) {
    const float x = (float)(i % SIDE) / (SIDE - 1), y = (float)(i / SIDE) / (SIDE - 1);
    const Vec3 n = v3_normalize(v3(-cosf(5 * x + time), sinf(4 * y - 2 * time), 1));
    v3_store(c->positions + 3 * i, v3(2 * x - 1, 2 * y - 1, wave(x, y, time)));
    v3_store(c->normals + 3 * i, n);
    c->texcoords[2 * i] = x;
    c->texcoords[2 * i + 1] = y;
  }
  uint32_t *t = c->triangles;
  for (uint32_t i = 0; i < VERTICES; i++) {
    if (i % SIDE == SIDE - 1 || i / SIDE == SIDE - 1) continue;
    const uint32_t six[6] = {i, i + 1, i + SIDE, i + 1, i + SIDE + 1, i + SIDE};
    memcpy(t, six, sizeof six);
    t += 6;
  }
}

// --- worlds ---------------------------------------------------------------------------------------

static void *copy_of(const void *from, size_t count, size_t size)
{
  void *to = mem_alloc(count, size);
  memcpy(to, from, count * size);
  return to;
}

static void add_cloth(Scene *s, const Cloth *c)
{
  MeshData *m = mesh_data_create();
  m->vertex_count = VERTICES;
  m->triangle_count = TRIANGLES;
  m->positions = copy_of(c->positions, VERTICES, 3 * sizeof(float));
  m->texcoords[0] = copy_of(c->texcoords, VERTICES, 2 * sizeof(float));
  m->triangles = copy_of(c->triangles, TRIANGLES, 3 * sizeof(uint32_t));
  const int32_t mesh = scene_add_mesh(s, "cloth", m), object = scene_add_object(s, SHAPE_MESH, NULL);
  s->objects.items[object].shape.mesh_i = mesh;
}

static void move_mesh(Scene *s, size_t mesh_i, const float *positions)
{
  MeshData **data = &s->meshes.items[mesh_i].data, *moved = mesh_data_move(*data, positions, NULL);
  mesh_data_release(*data);
  *data = moved;
}

static const MeshTree *tree_of(const World *w, size_t mesh_i) { return w->parts->meshes.items[mesh_i].tree; }

// A refitted tree knows what it cost when it was built.
static bool is_refitted(const MeshTree *t) { return t->node_count && t->nodes[t->root].cost > 0; }

static World *next_world(const Scene *s, const World *previous)
{
  Err err = {0};
  World *w = world_prepare(s, previous, NULL, NULL, NULL, &err);
  CHECK_MSG(w, "%s", err.text);
  return w;
}

TEST(an_edit_of_one_object_makes_only_its_own_tree)
{
  Err err = {0};
  Cloth c;
  blow(&c, 0);
  Scene *s = scene_create(&err);
  for (int i = 0; i < 3; i++) add_cloth(s, &c);
  World *first = next_world(s, NULL);
  s->objects.items[1].common.translate[0] = 5; // moves an object: the upper tree alone
  World *second = next_world(s, first);
  for (size_t i = 0; i < 3; i++) CHECK(tree_of(second, i) == tree_of(first, i));
  add_cloth(s, &c); // one more object: its tree
  World *third = next_world(s, second);
  for (size_t i = 0; i < 3; i++) CHECK(tree_of(third, i) == tree_of(first, i));
  CHECK(tree_of(third, 3) != tree_of(first, 0));
  blow(&c, 1);
  move_mesh(s, 1, c.positions); // moves vertices: that mesh's tree
  World *fourth = next_world(s, third);
  for (size_t i = 0; i < 4; i++) CHECK((tree_of(fourth, i) == tree_of(third, i)) == (i != 1));
  CHECK(is_refitted(tree_of(fourth, 1)) && !is_refitted(tree_of(third, 1)));
  const World *all[] = {first, second, third, fourth};
  for (int i = 0; i < 4; i++) world_release((World *)all[i]);
  scene_destroy(s);
}

// Moved again and again; what is no longer shown is let go, which a leak check would tell.
TEST(moved_meshes_share_what_stays)
{
  Err err = {0};
  Cloth c;
  blow(&c, 0);
  Scene *s = scene_create(&err);
  add_cloth(s, &c);
  World *w = next_world(s, NULL);
  const MeshData *first = s->meshes.items[0].data;
  for (int i = 1; i < 5; i++) {
    blow(&c, (float)i);
    move_mesh(s, 0, c.positions);
    const MeshData *m = s->meshes.items[0].data;
    CHECK(m->base == first && m->triangles == first->triangles && m->texcoords[0] == first->texcoords[0]);
    World *next = next_world(s, w);
    CHECK(is_refitted(tree_of(next, 0)) && next->instances[0].mesh.positions == m->positions);
    world_release(w);
    w = next;
  }
  scene_destroy(s);
  CHECK(w->instances[0].mesh.triangles[5] == SIDE && w->instances[0].mesh.positions[2] == c.positions[2]);
  world_release(w);
}

// A model that is loaded again after its file changed has nothing in common with the last one but what it holds.
TEST(a_scene_loaded_again_follows_the_last_world)
{
  Err err = {0};
  Cloth c;
  blow(&c, 0);
  Scene *s = scene_create(&err), *again = scene_create(&err), *other = scene_create(&err);
  add_cloth(s, &c);
  World *w = next_world(s, NULL);
  scene_destroy(s);
  blow(&c, 0.5f);
  add_cloth(again, &c);
  World *follower = next_world(again, w);
  CHECK(is_refitted(tree_of(follower, 0)));
  c.triangles[3 * (TRIANGLES / 2)] = c.triangles[0]; // in the middle, where no key looks
  add_cloth(other, &c);
  World *stranger = next_world(other, w);
  CHECK(!is_refitted(tree_of(stranger, 0)));
  scene_destroy(again);
  scene_destroy(other);
  world_release(w);
  world_release(follower);
  world_release(stranger);
}

// --- the public interface -------------------------------------------------------------------------

static rf_object add_public_cloth(rf_scene *s, const Cloth *c)
{
  rf_mesh_def def = rf_default_mesh_def();
  def.positions = c->positions;
  def.normals = c->normals;
  def.texcoords = c->texcoords;
  def.triangles = c->triangles;
  def.vertex_count = VERTICES;
  def.triangle_count = TRIANGLES;
  return rf_add_mesh(s, "cloth", &def);
}

static rf_ray ray_number(uint32_t i)
{
  float x[6];
  for (uint32_t k = 0; k < 6; k++) x[k] = 4 * unit_float(hash_u32(6 * i + k)) - 2;
  return (rf_ray){.origin = {x[0], x[1], 2}, .direction = {x[2] / 2 - x[0], x[3] / 2 - x[1], -2}, .tmax = INFINITY};
}

// How many rays, and what is at the place each hits, differ between two worlds.
static int differences(const rf_world *a, const rf_world *b, int *hits)
{
  int wrong = 0;
  for (uint32_t i = 0; i < 400; i++) {
    const rf_ray ray = ray_number(i);
    rf_hit p, q;
    const bool hit = rf_intersect(a, &ray, &p);
    wrong += rf_intersect(b, &ray, &q) != hit || memcmp(&p, &q, sizeof p);
    *hits += hit;
    if (!hit) continue;
    const rf_surface x = rf_surface_at(a, &ray, &p), y = rf_surface_at(b, &ray, &q);
    wrong += memcmp(&x.position, &y.position, sizeof x.position) || memcmp(&x.n, &y.n, sizeof x.n) || x.u != y.u;
  }
  return wrong;
}

TEST(a_world_that_followed_is_like_one_from_nothing)
{
  Cloth c;
  blow(&c, 0);
  rf_engine *e = rf_engine_create(NULL);
  rf_scene *s = rf_scene_create(e);
  const rf_object cloth = add_public_cloth(s, &c), ball = rf_add(s, "sphere", "ball");
  rf_world *world = rf_prepare(s, NULL), *at_first = world;
  int hits = 0;
  for (int i = 1; i < 20; i++) {
    blow(&c, 0.3f * (float)i);
    if (i % 4 == 0) c.positions[3 * (VERTICES / 2) + 2] = 3; // one vertex drawn far out
    CHECK(rf_move_vertices(s, cloth, c.positions, i % 3 ? c.normals : NULL, VERTICES));
    CHECK(rf_move(s, ball, (rf_frame){{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {(float)i, 0, -4}}));
    rf_world *next = rf_prepare(s, world), *fresh = rf_prepare(s, NULL);
    CHECK(next && fresh);
    const int wrong = differences(next, fresh, &hits);
    CHECK_MSG(wrong == 0, "step %d: %d", i, wrong);
    if (world != at_first) rf_world_destroy(world);
    rf_world_destroy(fresh);
    world = next;
  }
  CHECK(hits > 1000);

  // The first world is as it was.
  blow(&c, 0);
  CHECK(rf_move_vertices(s, cloth, c.positions, c.normals, VERTICES));
  CHECK(rf_move(s, ball, (rf_frame){{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}));
  rf_world *back = rf_prepare(s, world);
  CHECK(differences(at_first, back, &hits) == 0);
  rf_world_destroy(at_first);
  rf_world_destroy(world);
  rf_world_destroy(back);
  rf_scene_destroy(s);
  rf_engine_destroy(e);
}

static bool fails_with(rf_engine *e, bool ok, const char *what)
{
  const char *text;
  const rf_status status = rf_error(e, &text);
  if (!ok && status == RF_BAD_ARGUMENT && strstr(text, what)) return true;
  fprintf(stderr, "instead of \"%s\": \"%s\"\n", what, text);
  return false;
}

TEST(what_cannot_be_moved_says_why)
{
  Cloth c;
  blow(&c, 0);
  rf_engine *e = rf_engine_create(NULL);
  rf_scene *s = rf_scene_create(e);
  const rf_object cloth = add_public_cloth(s, &c), ball = rf_add(s, "sphere", "ball");
  rf_world *world = rf_prepare(s, NULL);
  const float *p = c.positions, *n = c.normals;
  CHECK(fails_with(e, rf_move_vertices(NULL, cloth, p, n, VERTICES), "no object"));
  CHECK(fails_with(e, rf_move_vertices(s, (rf_object){99}, p, n, VERTICES), "no object with id 99"));
  CHECK(fails_with(e, rf_move_vertices(s, cloth, NULL, n, VERTICES), "NULL"));
  CHECK(fails_with(e, rf_move_vertices(s, ball, p, n, VERTICES), "has no mesh of its own"));
  CHECK(fails_with(e, rf_move_vertices(s, cloth, p, n, VERTICES - 1), "has 576 vertices, but 575 are given"));
  c.positions[3 * 17 + 1] = NAN;
  CHECK(fails_with(e, rf_move_vertices(s, cloth, p, n, VERTICES), "position 17 is ("));
  c.positions[3 * 17 + 1] = -INFINITY;
  CHECK(fails_with(e, rf_move_vertices(s, cloth, p, NULL, VERTICES), "position 17 is ("));
  c.positions[3 * 17 + 1] = 0;
  c.normals[5] = INFINITY;
  CHECK(fails_with(e, rf_move_vertices(s, cloth, p, n, VERTICES), "normal 1 is ("));
  int hits = 0;
  rf_world *after = rf_prepare(s, world);
  CHECK_MSG(differences(world, after, &hits) == 0, "what failed changed nothing");
  for (long i = 1; i <= 3; i++) {
    mem_fail_after(i);
    const bool ok = rf_move_vertices(s, cloth, p, p, VERTICES);
    mem_fail_after(0);
    const char *text;
    CHECK(!ok && rf_error(e, &text) == RF_NO_MEMORY);
  }
  CHECK(rf_move_vertices(s, cloth, p, p, VERTICES));
  rf_world_destroy(after);
  rf_world_destroy(world);
  rf_scene_destroy(s);
  rf_engine_destroy(e);
}

TEST_MAIN
