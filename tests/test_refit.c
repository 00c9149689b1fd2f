// A tree that follows its vertices against one built anew and against testing everything, bit by bit, through chains of
// random edits. RAYFOLD_EDITS=10000 in the environment makes it so many edits instead of a few hundred.

#include "tests/soup.h"

#include "accel/brute.h"
#include "accel/refit.h"
#include "accel/traverse.h"

// --- edits ----------------------------------------------------------------------------------------

typedef enum Edit {
  ONE_VERTEX,
  SOME_TRIANGLES, // somewhere else
  ALL_A_LITTLE,
  TWIST,
  SCALE,
  FLATTEN,
  SHUFFLE,        // every triangle takes another's place
  STIR_PART,      // those below some node of the tree do
  SOME_COLLAPSE,  // triangles of a region become points
  ALL_COLLAPSE,
  DUPLICATE,      // triangles come to lie on one another
  NOT_FINITE,
  AS_AT_FIRST,
  EDIT_COUNT
} Edit;

static float *vertex(const Soup *s, size_t i) { return s->positions + 3 * i; }

static size_t any_of(Random *r, size_t count) { return hash_u32(r->state++) % count; }

static void move_triangle(const Soup *s, size_t t, Vec3 by)
{
  for (int c = 0; c < 3; c++) {
    float *p = vertex(s, s->triangles[3 * t + (size_t)c]);
    v3_store(p, v3_load(p) + by);
  }
}

static void twist(const Soup *s, float turns)
{
  for (size_t i = 0; i < s->vertex_count; i++) {
    float *p = vertex(s, i);
    const float angle = turns * p[1], c = cosf(angle), n = sinf(angle), x = c * p[0] + n * p[2];
    p[2] = c * p[2] - n * p[0];
    p[0] = x;
  }
}

static void swap_triangles(const Soup *s, size_t t, size_t u)
{
  for (int c = 0; c < 3; c++) {
    float *p = vertex(s, s->triangles[3 * t + (size_t)c]), *q = vertex(s, s->triangles[3 * u + (size_t)c]);
    const Vec3 a = v3_load(p), b = v3_load(q);
    v3_store(p, b);
    v3_store(q, a);
  }
}

static void put_on(const Soup *s, size_t t, size_t u, bool is_point)
{
  for (int c = 0; c < 3; c++) {
    const size_t from = 3 * u + (size_t)(is_point ? 0 : c);
    v3_store(vertex(s, s->triangles[3 * t + (size_t)c]), v3_load(vertex(s, s->triangles[from])));
  }
}

// The triangles of two levels of the tree.
static size_t prims_below(const MeshTree *t, uint32_t node_i, int levels, uint32_t *prims)
{
  size_t count = 0;
  for (int lane = 0; lane < 8; lane++) {
    const uint32_t code = t->nodes[node_i].child[lane];
    if (code == EMPTY_TREE) continue;
    if (!(code & LEAF_BIT) && levels > 1) count += prims_below(t, code, levels - 1, prims + count);
    for (int i = 0; code & LEAF_BIT && i < t->nodes[node_i].count[lane]; i++)
      prims[count++] = t->blocks[code & ~LEAF_BIT].prim[i];
  }
  return count;
}

static void stir_part(const Soup *s, const MeshTree *t, Random *r)
{
  uint32_t prims[512];
  const size_t count = t->node_count ? prims_below(t, (uint32_t)any_of(r, t->node_count), 2, prims) : 0;
  for (size_t i = 0; i < count; i++) swap_triangles(s, prims[i], prims[any_of(r, count)]);
}

static float size_of(const float *positions, size_t count)
{
  Bounds b = bounds_empty();
  for (size_t i = 0; i < count; i++) bounds_add_point(&b, v3_load(positions + 3 * i));
  return v3_max_lane(b.hi - b.lo);
}

static void edit(const Soup *s, const MeshTree *t, const float *at_first, Edit e, Random *r)
{
  const size_t many = s->triangle_count, first = any_of(r, many);
  const float factor = rnd_in(r, 0.2f, 4), size = size_of(at_first, s->vertex_count) / 2;
  switch (e) {
  case ONE_VERTEX: v3_store(vertex(s, any_of(r, s->vertex_count)), v3_load(at_first) + size * rnd_vec(r)); return;
  case SOME_TRIANGLES:
    for (int i = 0; i < 5; i++) move_triangle(s, any_of(r, many), size * rnd_vec(r));
    return;
  case ALL_A_LITTLE:
    for (size_t i = 0; i < s->vertex_count; i++)
      v3_store(vertex(s, i), v3_load(vertex(s, i)) + 0.01f * size * rnd_vec(r));
    return;
  case TWIST: twist(s, rnd_in(r, -3, 3)); return;
  case SCALE:
    for (size_t i = 0; i < 3 * s->vertex_count; i++) s->positions[i] *= factor;
    return;
  case FLATTEN:
    for (size_t i = 0; i < s->vertex_count; i++) vertex(s, i)[2] *= 1e-4f;
    return;
  case SHUFFLE:
    for (size_t i = 0; i < many; i++) swap_triangles(s, i, any_of(r, many));
    return;
  case STIR_PART: stir_part(s, t, r); return;
  case SOME_COLLAPSE:
    for (size_t i = first; i < many && i < first + many / 4; i++) put_on(s, i, i, true);
    return;
  case ALL_COLLAPSE:
    for (size_t i = 0; i < many; i++) put_on(s, i, 0, true);
    return;
  case DUPLICATE:
    for (int i = 0; i < 40; i++) put_on(s, any_of(r, many), first, false);
    return;
  case NOT_FINITE:
    for (int i = 0; i < 10; i++) vertex(s, any_of(r, s->vertex_count))[i % 3] = i % 2 ? NAN : -INFINITY;
    return;
  case AS_AT_FIRST: memcpy(s->positions, at_first, 3 * s->vertex_count * sizeof(float)); return;
  case EDIT_COUNT: return;
  }
}

static bool is_broken(const Soup *s)
{
  for (size_t i = 0; i < 3 * s->vertex_count; i++) {
    if (!(fabsf(s->positions[i]) < 1e12f)) return true;
  }
  return false;
}

// --- what must hold of any tree -------------------------------------------------------------------

typedef struct Inspection {
  const MeshTree *tree;
  const Soup *soup;
  MeshArrays mesh;
  uint8_t *found;              // of triangles: lanes
  size_t nodes, blocks, wrong; // met
} Inspection;

static MeshArrays arrays_of(const Soup *s)
{
  return (MeshArrays){s->positions, s->vertex_count, s->triangles, s->triangle_count};
}

static Bounds inspect_block(Inspection *in, uint32_t block_i, uint32_t count)
{
  const Tri8 *b = &in->tree->blocks[block_i];
  Tri8 expected;
  Bounds all = bounds_empty();
  in->blocks++;
  for (uint32_t lane = 0; lane < 8; lane++) {
    const bool is_used = b->prim[lane] != NO_HIT;
    in->wrong += is_used != (lane < count) || (is_used && b->prim[lane] >= in->mesh.triangle_count);
    Vec3 v[3];
    const bool can_be_hit = is_used && triangle_corners(&in->mesh, b->prim[lane], v);
    if (is_used) in->found[b->prim[lane]]++;
    if (!can_be_hit) v[0] = v[1] = v[2] = v3_all(NAN);
    for (int c = 0; c < 3; c++) {
      if (can_be_hit) bounds_add_point(&all, v[c]);
      for (int k = 0; k < 3; k++) expected.v[c][k][lane] = v[c][k];
    }
  }
  for (int i = 0; i < 72; i++) {
    const float x = b->v[i / 24][i / 8 % 3][i % 8], y = expected.v[i / 24][i / 8 % 3][i % 8];
    in->wrong += x == x || y == y ? memcmp(&x, &y, sizeof x) != 0 : 0;
  }
  return all;
}

static bool is_box_of(const Node8 *n, int lane, const Bounds *b)
{
  bool same = true;
  for (int k = 0; k < 3; k++) same &= n->box[2 * k][lane] == b->lo[k] && n->box[2 * k + 1][lane] == b->hi[k];
  return same;
}

static Bounds inspect_node(Inspection *in, uint32_t node_i, int depth)
{
  const Node8 *n = &in->tree->nodes[node_i];
  Bounds all = bounds_empty();
  in->nodes++;
  in->wrong += depth > MOST_DEPTH;
  for (int lane = 0; lane < 8; lane++) {
    const uint32_t code = n->child[lane];
    Bounds box = bounds_empty();
    if (code == EMPTY_TREE) in->wrong += n->count[lane] != 0;
    else if (code & LEAF_BIT) box = inspect_block(in, code & ~LEAF_BIT, n->count[lane]);
    else box = inspect_node(in, code, depth + 1);
    in->wrong += !is_box_of(n, lane, &box);
    bounds_add(&all, &box);
  }
  return all;
}

// Boxes are exact unions, everything is reached once, every triangle that can be hit is there, and no walk outgrows its
// stack. A triangle has at most so many lanes. Returns the number of faults.
static size_t inspect_lanes(const MeshTree *t, const Soup *s, int most_lanes)
{
  Inspection in = {.tree = t, .soup = s, .mesh = arrays_of(s), .found = mem_zero(s->triangle_count, 1)};
  Bounds all = bounds_empty();
  if (t->root != EMPTY_TREE && t->root & LEAF_BIT) {
    uint32_t count = 0;
    while (count < 8 && t->blocks[0].prim[count] != NO_HIT) count++;
    all = inspect_block(&in, 0, count);
  } else if (t->root != EMPTY_TREE) {
    all = inspect_node(&in, t->root, 1);
  }
  for (int k = 0; k < 3; k++) in.wrong += all.lo[k] != t->bounds.lo[k] || all.hi[k] != t->bounds.hi[k];
  in.wrong += in.nodes != t->node_count || in.blocks != t->block_count;
  for (size_t i = 0; i < s->triangle_count; i++) {
    Vec3 v[3];
    in.wrong += in.found[i] > most_lanes || (!in.found[i] && triangle_corners(&in.mesh, i, v));
  }
  mem_free(in.found);
  return in.wrong;
}

static size_t inspect(const MeshTree *t, const Soup *s) { return inspect_lanes(t, s, 1); }

// --- hits -----------------------------------------------------------------------------------------

static Accel *accel_on(MeshTree *t)
{
  const Frame f = {v3(0.4f, 0.1f, 0), v3(0, -0.5f, 0.2f), v3(0.1f, 0, 0.6f), v3(0.3f, 1, -0.2f)};
  const Instance two[2] = {{.world_from_object = frame_identity(), .object_from_world = frame_identity(), .mesh = t,
                            .kind = INSTANCE_MESH, .mask = RAY_ALL, .is_identity = true},
                           {.world_from_object = f, .object_from_world = frame_inverse(&f), .mesh = t,
                            .kind = INSTANCE_MESH, .mask = RAY_ALL}};
  Accel *a = accel_build(two, 2, NULL, NULL, NULL);
  CHECK(a != NULL);
  return a;
}

static bool is_same_hit(const Hit *a, const Hit *b)
{
  return a->instance == b->instance && (a->instance == NO_HIT || !memcmp(a, b, offsetof(Hit, instance)));
}

// Rays whose answers are not those of a tree built anew, and of testing everything.
static int wrong_rays(MeshTree *t, const Soup *s, Random *r, int count, int *hits)
{
  MeshTree *fresh = mesh_tree_build(s->positions, s->vertex_count, s->triangles, s->triangle_count, (TreeOptions){0}, NULL, NULL, NULL);
  Accel *a = accel_on(t), *b = accel_on(fresh);
  int wrong = 0;
  for (int i = 0; i < count; i++) {
    const Ray ray = nasty_ray(a, s, r, i);
    RayCounters c = {0};
    Hit refitted, rebuilt, brute;
    const bool hit = accel_closest(a, &ray, RAY_ALL, NULL, NULL, &c, &refitted);
    accel_closest(b, &ray, RAY_ALL, NULL, NULL, &c, &rebuilt);
    accel_closest_brute(b, &ray, RAY_ALL, NULL, NULL, &c, &brute);
    wrong += !is_same_hit(&refitted, &rebuilt) || !is_same_hit(&refitted, &brute) ||
             accel_any(a, &ray, RAY_ALL, NULL, NULL, &c) != hit;
    *hits += hit;
  }
  accel_destroy(a);
  accel_destroy(b);
  mesh_tree_release(fresh);
  return wrong;
}

static MeshTree *run(Refit *r, const MeshTree *old, const Soup *s, Jobs *jobs)
{
  *r = (Refit){.old = old, .mesh = arrays_of(s), .jobs = jobs, .most_wear = MOST_WEAR};
  MeshTree *t = refit_run(r, NULL);
  CHECK(t != NULL);
  return t;
}

static MeshTree *refit_of(const MeshTree *old, const Soup *s)
{
  Refit r;
  return run(&r, old, s, NULL);
}

static MeshTree *build_of(const Soup *s)
{
  MeshTree *t = mesh_tree_build(s->positions, s->vertex_count, s->triangles, s->triangle_count, (TreeOptions){0}, NULL, NULL, NULL);
  CHECK(t != NULL);
  return t;
}

static int edits_wanted(void)
{
  const char *text = getenv("RAYFOLD_EDITS");
  return text ? atoi(text) : TEST_IS_SLOW ? 100 : 400;
}

// A height field, whose triangles share their vertices.
static Soup net(size_t side)
{
  Soup s = {mem_zero(side * side * 3, sizeof(float)), mem_zero(6 * (side - 1) * (side - 1), sizeof(uint32_t)),
            side * side, 0};
  for (size_t j = 0; j < side; j++) {
    for (size_t i = 0; i < side; i++) {
      const float x = (float)i / (float)side, y = (float)j / (float)side;
      v3_store(s.positions + 3 * (j * side + i), v3(2 * x - 1, 0.3f * sinf(9 * x) * cosf(7 * y), 2 * y - 1));
      if (i + 1 == side || j + 1 == side) continue;
      const uint32_t p = (uint32_t)(j * side + i), q = p + (uint32_t)side, six[6] = {p, q, p + 1, p + 1, q, q + 1};
      memcpy(s.triangles + 3 * s.triangle_count, six, sizeof six);
      s.triangle_count += 2;
    }
  }
  return s;
}

// G5: edits upon edits, each followed by a refit of the last refit.
TEST(a_refitted_tree_answers_as_one_built_anew)
{
  const int edits = edits_wanted() / (NASTY_COUNT + 1) + 1;
  int in_parts = 0, hits = 0;
  for (int kind = 0; kind <= NASTY_COUNT; kind++) {
    Soup s = kind < NASTY_COUNT ? nasty_soup((Nasty)kind, 500) : net(17);
    float *at_first = mem_alloc(3 * s.vertex_count, sizeof *at_first);
    memcpy(at_first, s.positions, 3 * s.vertex_count * sizeof *at_first);
    MeshTree *tree = build_of(&s);
    Random r = {900u * (uint32_t)kind};
    for (int i = 0; i < edits; i++) {
      // A chain that breaks numbers goes back to the start now and then, or nothing would be left to test.
      const Edit e = is_broken(&s) && i % 3 == 0 ? AS_AT_FIRST
                     : i % 2                     ? STIR_PART
                                                 : (Edit)any_of(&r, EDIT_COUNT);
      edit(&s, tree, at_first, e, &r);
      Refit refit;
      MeshTree *next = run(&refit, tree, &s, NULL);
      in_parts += refit.rebuilt_count > 0 && refit.rebuilt_count < s.triangle_count;
      const size_t faults = inspect(next, &s);
      CHECK_MSG(faults == 0, "soup %d, edit %d of kind %d: %zu faults", kind, i, e, faults);
      const int wrong = wrong_rays(next, &s, &r, 60, &hits);
      CHECK_MSG(wrong == 0, "soup %d, edit %d of kind %d: %d of 60 rays differ", kind, i, e, wrong);
      mesh_tree_release(tree);
      tree = next;
    }
    mesh_tree_release(tree);
    mem_free(at_first);
    soup_finish(&s);
  }
  CHECK_MSG(hits > 20 * edits, "only %d hits", hits);
  CHECK_MSG(in_parts > edits / 4, "parts were built anew only %d times in %d", in_parts, 9 * edits);
}

TEST(triangles_come_and_go)
{
  Soup s = nasty_soup(RANDOM, 600);
  Random r = {3};
  int hits = 0;
  float *whole = mem_alloc(3 * s.vertex_count, sizeof *whole);
  memcpy(whole, s.positions, 3 * s.vertex_count * sizeof *whole);
  MeshTree *there = build_of(&s);
  edit(&s, there, whole, ALL_COLLAPSE, &r);
  MeshTree *gone = refit_of(there, &s), *never = build_of(&s);
  CHECK(inspect(gone, &s) == 0 && gone->block_count == there->block_count && gone->bounds.lo[0] == INFINITY);
  CHECK(wrong_rays(gone, &s, &r, 20, &hits) == 0 && hits == 0);
  edit(&s, gone, whole, AS_AT_FIRST, &r);
  MeshTree *back = refit_of(gone, &s), *first = refit_of(never, &s);
  CHECK_MSG(back->node_count == there->node_count && back->block_count == there->block_count, "they kept their lanes");
  for (size_t i = 0; i < back->node_count; i++) {
    CHECK(!memcmp(back->nodes[i].box, there->nodes[i].box, sizeof there->nodes[i].box));
  }
  CHECK(inspect(first, &s) == 0 && first->triangle_count == 600);
  CHECK(wrong_rays(back, &s, &r, 100, &hits) == 0 && wrong_rays(first, &s, &r, 100, &hits) == 0 && hits > 0);
  MeshTree *all[] = {there, gone, never, back, first};
  for (int i = 0; i < 5; i++) mesh_tree_release(all[i]);
  mem_free(whole);
  soup_finish(&s);
}

// A tree of other triangles is nothing to start from, nor is an empty one; the answer is right all the same.
TEST(a_tree_that_does_not_fit_is_built)
{
  Soup s = nasty_soup(RANDOM, 100), more = nasty_soup(RANDOM, 700), none = nasty_soup(RANDOM, 0);
  MeshTree *large = build_of(&more), *small = build_of(&s), *empty = build_of(&none);
  MeshTree *made[] = {refit_of(large, &s), refit_of(small, &more), refit_of(empty, &s), refit_of(large, &none)};
  CHECK(inspect(made[0], &s) == 0 && inspect(made[1], &more) == 0 && inspect(made[2], &s) == 0);
  CHECK(made[3]->root == EMPTY_TREE);
  for (int i = 0; i < 4; i++) mesh_tree_release(made[i]);
  mesh_tree_release(large);
  mesh_tree_release(small);
  mesh_tree_release(empty);
  soup_finish(&s);
  soup_finish(&more);
  soup_finish(&none);
}

// --- parts built anew -----------------------------------------------------------------------------

// Stirs the triangles of the corner where all coordinates are below `most`.
static void stir(const Soup *s, Random *r, float most)
{
  size_t last = SIZE_MAX;
  for (size_t t = 0; t < s->triangle_count; t++) {
    const float *p = vertex(s, s->triangles[3 * t]);
    if (p[0] > most || p[1] > most || p[2] > most || rnd(r) < 0.3f) continue;
    if (last != SIZE_MAX) swap_triangles(s, t, last);
    last = t;
  }
}

static bool is_same_tree(const MeshTree *a, const MeshTree *b)
{
  return a->root == b->root && a->node_count == b->node_count && a->block_count == b->block_count &&
         !memcmp(a->nodes, b->nodes, a->node_count * sizeof *a->nodes) &&
         !memcmp(a->blocks, b->blocks, a->block_count * sizeof *a->blocks);
}

TEST(only_worn_parts_are_built_anew_by_any_number_of_threads)
{
  Soup s = nasty_soup(RANDOM, TEST_IS_SLOW ? 20000 : 150000);
  MeshTree *tree = build_of(&s);
  Jobs *jobs = jobs_create(3, NULL);
  Random random = {8};
  for (int i = 0; i < 3; i++) {
    stir(&s, &random, i == 0 ? -0.2f : i == 1 ? -0.5f : 2);
    Refit one, three;
    MeshTree *a = run(&one, tree, &s, NULL), *b = run(&three, tree, &s, jobs);
    const size_t n = s.triangle_count, rebuilt = one.rebuilt_count;
    CHECK_MSG(i == 2 ? rebuilt == n : rebuilt > n / 100 && rebuilt < n / 4, "%zu", rebuilt);
    CHECK(rebuilt == three.rebuilt_count && is_same_tree(a, b) && inspect(a, &s) == 0);
    mesh_tree_release(tree);
    mesh_tree_release(b);
    tree = run(&three, a, &s, NULL); // nothing has moved since, so nothing is left to mend
    CHECK_MSG(three.rebuilt_count == 0 && inspect(tree, &s) == 0, "%zu", three.rebuilt_count);
    mesh_tree_release(a);
  }
  mesh_tree_release(tree);
  jobs_destroy(jobs);
  soup_finish(&s);
}

// A builder may put a triangle in several leaves, whose boxes hold only pieces of it.
static void repeat_triangles(MeshTree *t, Random *r)
{
  for (size_t i = 0; i < t->node_count; i++) {
    Node8 *n = &t->nodes[i];
    for (int lane = 0; lane < 8; lane++) {
      if (n->child[lane] == EMPTY_TREE || !(n->child[lane] & LEAF_BIT) || n->count[lane] == 8) continue;
      const Tri8 *from = &t->blocks[any_of(r, t->block_count)];
      t->blocks[n->child[lane] & ~LEAF_BIT].prim[n->count[lane]++] = from->prim[0];
    }
  }
}

TEST(triangles_may_be_in_several_leaves)
{
  Soup s = nasty_soup(RANDOM, 3000);
  Random random = {12};
  int hits = 0;
  MeshTree *tree = build_of(&s);
  repeat_triangles(tree, &random);
  for (int i = 0; i < 6; i++) {
    if (i > 1) stir(&s, &random, -0.2f);
    Refit r;
    MeshTree *next = run(&r, tree, &s, NULL);
    CHECK(inspect_lanes(next, &s, 100) == 0 && wrong_rays(next, &s, &random, 100, &hits) == 0);
    mesh_tree_release(tree);
    tree = next;
  }
  CHECK(hits > 0);
  mesh_tree_release(tree);
  soup_finish(&s);
}

// Triangles that had no area when the tree was built come in one by one, and only their surroundings are built anew.
TEST(newcomers_find_a_place)
{
  Soup s = nasty_soup(RANDOM, 5000);
  Random random = {11};
  float *whole = mem_alloc(3 * s.vertex_count, sizeof *whole);
  memcpy(whole, s.positions, 3 * s.vertex_count * sizeof *whole);
  for (size_t t = 0; t < s.triangle_count; t += 10) put_on(&s, t, t, true);
  MeshTree *tree = build_of(&s);
  CHECK(tree->triangle_count == 4500);
  int hits = 0;
  size_t rebuilt = 0, came = 0;
  for (size_t t = 0; t < s.triangle_count; came = t / 10, t += came < 20 ? 10 : 200) {
    for (size_t i = 0; i <= t; i += 10) memcpy(s.positions + 9 * i, whole + 9 * i, 9 * sizeof *whole);
    Refit r;
    MeshTree *next = run(&r, tree, &s, NULL);
    rebuilt += r.rebuilt_count;
    CHECK(inspect(next, &s) == 0 && next->triangle_count == 4500 + t / 10 + 1);
    CHECK(wrong_rays(next, &s, &random, 20, &hits) == 0);
    mesh_tree_release(tree);
    tree = next;
  }
  CHECK_MSG(rebuilt < 64 * 500 && hits > 0, "%zu", rebuilt);
  mesh_tree_release(tree);
  mem_free(whole);
  soup_finish(&s);
}

TEST(moving_and_scaling_wear_nothing)
{
  Soup s = nasty_soup(NEEDLES, 3000);
  MeshTree *tree = build_of(&s);
  for (int i = 0; i < 4; i++) {
    for (size_t k = 0; k < s.vertex_count; k++) v3_store(vertex(&s, k), 3 * v3_load(vertex(&s, k)) + v3(1, 2, 3));
    Refit r;
    MeshTree *next = run(&r, tree, &s, NULL);
    CHECK_MSG(r.rebuilt_count == 0, "%zu", r.rebuilt_count);
    mesh_tree_release(tree);
    tree = next;
  }
  mesh_tree_release(tree);
  soup_finish(&s);
}

TEST(failures_are_clean)
{
  Soup s = nasty_soup(RANDOM, 3000);
  MeshTree *tree = build_of(&s);
  Random random = {8};
  stir(&s, &random, -0.2f);
  const MeshArrays m = arrays_of(&s);
  long n = 1;
  for (; n < 1000; n++) {
    Err err = {0};
    Refit r = {.old = tree, .mesh = m, .most_wear = MOST_WEAR};
    mem_fail_after(n);
    MeshTree *t = refit_run(&r, &err);
    mem_fail_after(0);
    mesh_tree_release(t);
    if (t) CHECK(r.rebuilt_count > 0 && r.rebuilt_count < s.triangle_count);
    if (t) break;
    CHECK(err.kind == ERR_NO_MEMORY);
  }
  CHECK(n > 8 && n < 1000);
  Cancel cancel;
  atomic_init(&cancel.requested, true);
  Err err = {0};
  CHECK(!mesh_tree_refit(tree, m.positions, m.vertex_count, m.triangles, m.triangle_count, NULL, &cancel, &err));
  CHECK(err.kind == ERR_CANCELLED);
  mesh_tree_release(tree);
  soup_finish(&s);
}

// --- depth ----------------------------------------------------------------------------------------

static int height_of(const MeshTree *t, uint32_t code)
{
  int most = 0;
  for (int lane = 0; !(code & LEAF_BIT) && lane < 8; lane++) {
    const int height = height_of(t, t->nodes[code].child[lane]) + 1;
    if (height > most) most = height;
  }
  return most;
}

// Puts nodes of one child each above a tree until it is as deep as a tree may be.
static void hang_low(MeshTree *t)
{
  const size_t more = (size_t)(MOST_DEPTH - height_of(t, t->root)), count = t->node_count;
  Node8 *nodes = mem_zero(count + more, sizeof *nodes);
  memcpy(nodes, t->nodes, count * sizeof *nodes);
  for (size_t i = 0; i < more; i++) {
    Node8 *n = &nodes[count + i];
    for (int lane = 0; lane < 8; lane++) {
      n->child[lane] = lane ? EMPTY_TREE : i ? (uint32_t)(count + i - 1) : t->root;
      for (int k = 0; k < 6; k++) {
        n->box[k][lane] = lane ? (k % 2 ? -INFINITY : INFINITY) : k % 2 ? t->bounds.hi[k / 2] : t->bounds.lo[k / 2];
      }
    }
  }
  mem_free(t->nodes);
  t->nodes = nodes;
  t->node_count = count + more;
  t->root = (uint32_t)(t->node_count - 1);
}

// Triangles that halve in size and distance, again and again: built, they make a tree far deeper than scattered ones.
static void recede(const Soup *s, size_t first, size_t count)
{
  for (size_t t = first; t < first + count; t++) {
    const float size = exp2f(-(float)(t - first) / (float)count * 100);
    for (int c = 0; c < 3; c++)
      v3_store(vertex(s, s->triangles[3 * t + (size_t)c]), size * v3(1 + (float)(c == 1), 1 + (float)(c == 2), 1));
  }
}

TEST(no_tree_becomes_too_deep_for_a_walk)
{
  for (size_t share = 2; share <= 8; share++) {
    Soup s = nasty_soup(RANDOM, 2000);
    MeshTree *old = build_of(&s);
    hang_low(old);
    CHECK(height_of(old, old->root) == MOST_DEPTH && inspect(old, &s) == 0);
    recede(&s, 0, s.triangle_count / share);
    Refit r;
    MeshTree *t = run(&r, old, &s, NULL);
    CHECK(inspect(t, &s) == 0 && r.rebuilt_count > 0);
    mesh_tree_release(t);
    mesh_tree_release(old);
    soup_finish(&s);
  }
}

TEST_MAIN
