// The tree against testing everything, bit by bit, over scenes made to be nasty; closed meshes have no holes; things
// that are broken hit nothing and break nothing.

#include "tests/soup.h"

#include "accel/brute.h"
#include "accel/traverse.h"
#include "geom/offset.h"
#include "geom/surface.h"

static bool same_hit(const Hit *a, const Hit *b)
{
  return a->instance == b->instance && a->prim == b->prim && !memcmp(&a->t, &b->t, 4) && !memcmp(&a->u, &b->u, 4) &&
         !memcmp(&a->v, &b->v, 4);
}

// Same primitive, t, u, v to the last bit; any-hit says the same. Walks the trees of a and tests everything in plain's,
// which are of floats. *is_hit: what testing everything says.
static bool tree_is_right(const Accel *a, const Accel *plain, const Ray *ray, bool *is_hit)
{
  RayCounters c = {0};
  Hit tree, brute;
  const bool hit = accel_closest(a, ray, RAY_ALL, NULL, NULL, &c, &tree);
  const bool any = accel_any(a, ray, RAY_ALL, NULL, NULL, &c);
  *is_hit = accel_closest_brute(plain, ray, RAY_ALL, NULL, NULL, &c, &brute);
  return hit == *is_hit && any == *is_hit && (!hit || same_hit(&tree, &brute));
}

static Accel *plain_of(const Soup *s, TreeOptions options, bool many)
{
  return accel_of(s, (TreeOptions){TREE_FLOAT, options.quality}, many);
}

// G2, G3.
static void check_against_brute_force(TreeOptions options)
{
  for (int kind = 0; kind < 2 * NASTY_COUNT; kind++) {
    const bool many = kind >= NASTY_COUNT;
    Soup s = nasty_soup((Nasty)(kind % NASTY_COUNT), many ? 150 : 600);
    Accel *a = accel_of(&s, options, many), *plain = plain_of(&s, options, many);
    Random r = {5u + (uint32_t)kind};
    int hits = 0, wrong = 0;
    for (int i = 0; i < 4000; i++) {
      const Ray ray = nasty_ray(a, &s, &r, i);
      bool is_hit;
      wrong += !tree_is_right(a, plain, &ray, &is_hit);
      hits += is_hit;
    }
    CHECK_MSG(wrong == 0, "layout %d, quality %d, scene %d: %d of %d hits differ", options.layout, options.quality, kind,
              wrong, hits);
    if (kind != TINY + NASTY_COUNT) CHECK_MSG(hits > 20, "scene %d: only %d hits", kind, hits);
    accel_destroy(a);
    accel_destroy(plain);
    soup_finish(&s);
  }
}

TEST(the_tree_equals_brute_force) { check_against_brute_force((TreeOptions){TREE_FLOAT, TREE_FAST}); }
TEST(a_compact_tree_equals_brute_force) { check_against_brute_force((TreeOptions){TREE_COMPACT, TREE_FAST}); }
TEST(a_tree_of_pieces_equals_brute_force) { check_against_brute_force((TreeOptions){TREE_FLOAT, TREE_BEST}); }
TEST(a_compact_tree_of_pieces_equals_brute_force) { check_against_brute_force((TreeOptions){TREE_COMPACT, TREE_BEST}); }

static size_t lanes_used(const MeshTree *t)
{
  size_t count = 0;
  for (size_t i = 0; i < 8 * t->block_count; i++) count += t->blocks[i / 8].prim[i % 8] != NO_HIT;
  return count;
}

static Vec3 corner_of(const Tri8 *b, int corner, int lane)
{
  return v3(b->v[corner][0][lane], b->v[corner][1][lane], b->v[corner][2][lane]);
}

// Points where mistakes with pieces would show: where a leaf's box cuts an edge of a triangle in it, give or take what
// rounding does; and on edges and at corners.
static Vec3 delicate_point(const MeshTree *t, Random *r, int i)
{
  const Node8 *n = NULL;
  int child = 0;
  do {
    n = &t->nodes[hash_u32(r->state++) % t->node_count];
    child = (int)(hash_u32(r->state++) & 7);
  } while (!(n->child[child] & LEAF_BIT) || n->child[child] == EMPTY_TREE);
  const Tri8 *b = &t->blocks[n->child[child] & ~LEAF_BIT];
  int lane = (int)(hash_u32(r->state++) & 7);
  while (b->prim[lane] == NO_HIT) lane--;
  const int corner = (int)(hash_u32(r->state++) % 3), axis = (int)(hash_u32(r->state++) % 3);
  const Vec3 p = corner_of(b, corner, lane), q = corner_of(b, (corner + 1) % 3, lane);
  if (i % 4 == 0) return v3_mix(p, q, rnd(r));
  if (i % 16 == 1) return p;
  const float plane = n->box[2 * axis + (int)(hash_u32(r->state++) & 1)][child];
  Vec3 on = v3_mix(p, q, (plane - p[axis]) / (q[axis] - p[axis]));
  on[axis] = plane;
  on += (i & 2 ? 0x1p-24f : 0x1p-22f) * rnd_vec(r);
  return v3_is_finite(on) ? on : v3_mix(p, q, rnd(r));
}

TEST(pieces_lose_no_hit_at_their_planes_and_from_afar)
{
  const Vec3 away[] = {v3_all(0), v3(1000, -300, 70), v3(-3e5f, 2e5f, 1e5f)};
  for (int k = 0; k < 3; k++) {
    Soup s = boards(40, 500, away[k]);
    const TreeOptions options = {TREE_FLOAT, TREE_BEST};
    Accel *a = accel_of(&s, options, false), *compact = accel_of(&s, (TreeOptions){TREE_COMPACT, TREE_BEST}, false);
    const MeshTree *t = accel_instances(a)[0].mesh;
    if (k < 2) CHECK(t->has_pieces && lanes_used(t) > s.triangle_count); // the last has margins as wide as boards
    Random r = {3u + (uint32_t)k};
    int hits = 0, wrong = 0;
    for (int i = 0; i < 35000; i++) {
      const Vec3 to = delicate_point(t, &r, i);
      const float distance = i % 3 ? 1 : powf(10, rnd_in(&r, 0, 6));
      Vec3 d = rnd_vec(&r);
      if (i % 5 < 3) d[i % 3] = 0; // nothing widens a box across a ray
      if (i % 5 < 2) d[(i + 1) % 3] = 0;
      if (i % 23 == 0) d *= v3(1e-6f, 1, 1e-3f);
      const Ray ray = {to - distance * d, d, 0, INFINITY};
      bool is_hit;
      wrong += !tree_is_right(a, a, &ray, &is_hit) || !tree_is_right(compact, a, &ray, &is_hit);
      hits += is_hit;
    }
    accel_destroy(compact);
    CHECK_MSG(wrong == 0 && hits > 10000, "%d: %d of %d hits differ", k, wrong, hits);
    accel_destroy(a);
    soup_finish(&s);
  }
}

static Soup ball(int around, int down, float radius, Vec3 centre)
{
  const size_t rows = (size_t)down + 1, columns = (size_t)around;
  Soup s = {mem_zero(rows * columns * 3, sizeof(float)), mem_zero(2 * columns * (size_t)down * 3, sizeof(uint32_t)),
            rows * columns, 0};
  for (int j = 0; j <= down; j++)
    for (int i = 0; i < around; i++) {
      const double theta = 3.14159265358979 * j / down, phi = 2 * 3.14159265358979 * i / around;
      const Vec3 n = v3((float)(sin(theta) * cos(phi)), (float)cos(theta), (float)(sin(theta) * sin(phi)));
      const bool pole = j == 0 || j == down; // all corners of a pole must be one point
      v3_store(s.positions + 3 * ((size_t)j * columns + (size_t)i), centre + radius * (pole ? v3(0, n[1], 0) : n));
    }
  for (size_t j = 0; j < (size_t)down; j++)
    for (size_t i = 0; i < columns; i++) {
      const uint32_t p = (uint32_t)(j * columns + i), q = (uint32_t)(j * columns + (i + 1) % columns);
      const uint32_t six[6] = {p, q, p + (uint32_t)columns, q, q + (uint32_t)columns, p + (uint32_t)columns};
      memcpy(s.triangles + 3 * s.triangle_count, six, sizeof six);
      s.triangle_count += 2;
    }
  return s;
}

// G1: rays from inside at vertices and points of edges never escape, at any scale and far from the origin.
static void check_for_holes(TreeQuality quality)
{
  const Vec3 centres[] = {v3(0, 0, 0), v3(1000, 37, -2000), v3(148376, 1234, -223423)};
  const float radii[] = {2, 2, 2, 1e-6f, 1e6f};
  for (int k = 0; k < 5; k++) {
    const Vec3 centre = k < 3 ? centres[k] : v3_all(0);
    Soup s = ball(100, 50, radii[k], centre);
    Accel *a = accel_of(&s, (TreeOptions){TREE_FLOAT, quality}, false);
    Random r = {31u + (uint32_t)k};
    int missed = 0;
    for (int i = 0; i < (TEST_IS_SLOW ? 8000 : 40000); i++) {
      const uint32_t *t = s.triangles + 3 * (hash_u32((uint32_t)i) % s.triangle_count);
      const Vec3 p = v3_load(s.positions + 3 * (size_t)t[0]), q = v3_load(s.positions + 3 * (size_t)t[1]);
      const Vec3 o = centre + 0.3f * radii[k] * rnd_vec(&r), to = i % 4 ? v3_mix(p, q, rnd(&r)) : p;
      const Ray ray = {o, to - o, 0, INFINITY};
      RayCounters c = {0};
      Hit hit;
      missed += !accel_closest(a, &ray, RAY_ALL, NULL, NULL, &c, &hit);
    }
    CHECK_MSG(missed == 0, "ball %d: %d rays escaped", k, missed);
    accel_destroy(a);
    soup_finish(&s);
  }
}

TEST(a_closed_mesh_has_no_holes)
{
  check_for_holes(TREE_FAST);
  check_for_holes(TREE_BEST);
}

// G8: a broken ray hits nothing, and soon.
TEST(broken_rays_hit_nothing)
{
  Soup s = nasty_soup(RANDOM, 500);
  Accel *a = accel_of(&s, (TreeOptions){0}, true);
  const float odd[] = {NAN, INFINITY, -INFINITY, 0};
  for (int i = 0; i < 4; i++)
    for (int k = 0; k < 7; k++) {
      Ray ray = {v3(0.1f, 0.2f, 3), v3(0, 0, -1), 0, INFINITY};
      if (k < 3) ray.o[k] = odd[i];
      else if (k < 6) ray.d[k - 3] = odd[i];
      else ray.d = v3_all(0);
      const bool is_broken = !v3_is_finite(ray.o) || !v3_is_finite(ray.d) || v3_is_zero(ray.d);
      RayCounters c = {0};
      Hit hit;
      const bool found = accel_closest(a, &ray, RAY_ALL, NULL, NULL, &c, &hit);
      CHECK(!is_broken || !found);
      CHECK(c.nodes + c.prims < 10000);
    }
  accel_destroy(a);
  soup_finish(&s);
}

// Of a node's lanes, those whose unpacked box does not contain the exact one or is larger by two steps of the grid
// (a step is at most twice the node's box over 255, since it is a power of two), and those without a child that are
// not what no ray enters.
static int lanes_wrong(const Node8 *exact, const Node8 *unpacked)
{
  int wrong = memcmp(exact->child, unpacked->child, sizeof exact->child) != 0;
  for (int k = 0; k < 6; k += 2) {
    double lo = INFINITY, hi = -INFINITY;
    for (int i = 0; i < 8; i++) {
      lo = fmin(lo, (double)exact->box[k][i]);
      hi = fmax(hi, (double)exact->box[k + 1][i]);
    }
    const double most = (hi - lo) * 4 / 255 + 0x1p-22 * fmax(fabs(lo), fabs(hi)) + 2 * FLT_MIN;
    for (int i = 0; i < 8; i++) {
      const double below = (double)exact->box[k][i] - unpacked->box[k][i];
      const double above = (double)unpacked->box[k + 1][i] - exact->box[k + 1][i];
      if (exact->child[i] == EMPTY_TREE)
        wrong += unpacked->box[k][i] != INFINITY || unpacked->box[k + 1][i] != -INFINITY;
      else
        wrong += !(below >= 0 && below <= most && above >= 0 && above <= most);
    }
  }
  return wrong;
}

// At every size floats have, down to where steps would be denormal.
TEST(compact_boxes_contain_the_exact_ones)
{
  const float scales[] = {1, 1e-20f, 1e-37f, 1e-40f, 1e20f, 1e37f, 3e37f};
  for (int kind = 0; kind < NASTY_COUNT; kind++)
    for (int k = 0; k < (kind == FAR_AWAY ? 4 : 7); k++) {
      Soup s = nasty_soup((Nasty)kind, 2000);
      for (size_t i = 0; i < 3 * s.vertex_count; i++) s.positions[i] *= scales[k];
      MeshTree *tree[2];
      for (int layout = 0; layout < 2; layout++)
        tree[layout] = soup_tree(&s, (TreeOptions){.layout = (TreeLayout)layout}, NULL);
      CHECK(tree[0] && tree[1] && tree[0]->node_count == tree[1]->node_count && tree[0]->root == tree[1]->root);
      int wrong = 0;
      for (uint32_t i = 0; i < tree[0]->node_count; i++) {
        Node8 space;
        wrong += lanes_wrong(&tree[0]->nodes[i], mesh_node(tree[1], i, &space));
      }
      CHECK_MSG(wrong == 0, "scene %d by %g: %d lanes are wrong", kind, (double)scales[k], wrong);
      mesh_tree_release(tree[0]);
      mesh_tree_release(tree[1]);
      soup_finish(&s);
    }
}

static MeshTree *tree_of(const Soup *s, size_t triangle_count, TreeOptions options, Jobs *jobs, Err *err)
{
  return mesh_tree_build(s->positions, s->vertex_count, s->triangles, triangle_count, options, jobs, NULL, err);
}

static void check_threads_and_failures(TreeOptions options)
{
  Soup s = boards(20, 20000, v3_all(0));
  Jobs *jobs = jobs_create(3, NULL);
  MeshTree *one = tree_of(&s, s.triangle_count, options, NULL, NULL);
  MeshTree *three = tree_of(&s, s.triangle_count, options, jobs, NULL);
  CHECK(one && three && one->node_count == three->node_count && one->block_count == three->block_count);
  CHECK(one->has_pieces == (options.quality == TREE_BEST) && three->has_pieces == one->has_pieces);
  if (options.layout == TREE_COMPACT) {
    CHECK(!memcmp(one->compact_nodes, three->compact_nodes, one->node_count * sizeof *one->compact_nodes));
    CHECK(mesh_tree_bytes(one) < 10 * s.triangle_count);
  } else {
    CHECK(!memcmp(one->nodes, three->nodes, one->node_count * sizeof *one->nodes));
  }
  mesh_tree_release(one);
  mesh_tree_release(three);
  for (long n = 1; n < 200; n++) {
    Err err = {0};
    mem_fail_after(n);
    MeshTree *t = tree_of(&s, 300, options, NULL, &err);
    mem_fail_after(0);
    mesh_tree_release(t);
    if (t) break;
    CHECK(err.kind == ERR_NO_MEMORY);
  }
  MeshTree *empty = tree_of(&s, 0, options, NULL, NULL);
  CHECK(empty != NULL);
  mesh_tree_release(empty);
  jobs_destroy(jobs);
  soup_finish(&s);
}

TEST(threads_build_the_same_tree_and_failures_are_clean)
{
  for (int i = 0; i < 4; i++) check_threads_and_failures((TreeOptions){(TreeLayout)(i & 1), (TreeQuality)(i >> 1)});
}

TEST_MAIN
