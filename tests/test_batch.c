// Batches against testing every primitive for every ray, bit by bit: rays that go alike and rays that do not, any
// number of them, with filters and masks, in worlds of one mesh and of many instances.

#include "tests/soup.h"

#include "accel/batch.h"
#include "accel/brute.h"

enum { MOST_RAYS = 1500 };

typedef enum Bundle { SCATTERED, PENCIL, PARALLEL, TO_A_LIGHT, LENS, MIXED, BUNDLE_COUNT } Bundle;

// Rays of an image of 40 columns, or others that are alike in some way; some of them broken.
static Ray bundle_ray(Bundle kind, const Accel *a, const Soup *s, Random *r, int i)
{
  float lo[3], hi[3];
  accel_bounds(a, lo, hi);
  const Vec3 l = v3_load(lo), size = v3_load(hi) - l, centre = l + 0.5f * size;
  const float span = v3_max_lane(size);
  const Vec3 eye = centre + span * v3(0.9f, 0.7f, 1.3f);
  const float x = (float)(i % 40) / 40 - 0.5f, y = (float)(i / 40 % 40) / 40 - 0.5f;
  const Vec3 on_plane = centre + span * v3(x, y, 0.1f * x);
  Ray ray = {eye, on_plane - eye, 0, INFINITY};
  switch (kind) {
  case SCATTERED: return nasty_ray(a, s, r, i);
  case PENCIL: break;
  case PARALLEL: ray = (Ray){on_plane + span * v3(0.5f, 1, 2), v3(-0.25f, -0.5f, -1), 0, INFINITY}; break;
  case TO_A_LIGHT: ray = (Ray){on_plane, eye - on_plane, 0, 0.999f}; break;
  case LENS: ray.o += 0.02f * span * rnd_vec(r); break;
  case MIXED: return i / 7 % 3 ? bundle_ray(PENCIL, a, s, r, i) : nasty_ray(a, s, r, i);
  case BUNDLE_COUNT: break;
  }
  if (i % 97 == 5) ray.d[i % 3] = 0;
  if (i % 71 == 7) ray.o[i % 3] = i % 2 ? NAN : INFINITY;
  if (i % 73 == 8) ray.d[i % 3] = i % 2 ? NAN : -INFINITY;
  if (i % 79 == 9) ray.o[i % 3] = -0.0f;
  if (i % 199 == 3) ray.tmin = i % 2 ? NAN : -1;
  if (i % 193 == 4) ray.tmax = i % 2 ? NAN : FLT_MAX;
  if (i % 223 == 9) ray.d = v3_all(0);
  if (i % 227 == 11) ray.tmax = -1;
  if (i % 229 == 13) ray.d = ray.d * 1e-39f;
  if (i % 101 == 17) ray.tmin = 0.5f;
  return ray;
}

// Lets some of the surfaces pass, for some of the rays.
static bool some_count(const void *user, const Ray *ray, const Hit *hit)
{
  (void)ray;
  return hash_combine(hash_combine(*(const uint32_t *)user, hit->instance), hit->prim) % 3 != 0;
}

typedef struct Asked {
  PackedRay rays[MOST_RAYS];
  uint32_t seeds[MOST_RAYS];
  Hit hits[MOST_RAYS], expected[MOST_RAYS];
  uint8_t blocked[MOST_RAYS];
} Asked;

// Each walk by itself, whichever accel_ask would have taken.
typedef void Ask(const Batch *b);

static void ask_streams(const Batch *b)
{
  for (size_t at = 0; at < b->count; at += SET_SIZE)
    stream_run(b, at, b->count - at < SET_SIZE ? (int)(b->count - at) : SET_SIZE);
}

static void expect_brute(Asked *q, const Accel *plain, size_t count, RayMask mask, HitFilter *filter)
{
  RayCounters c = {0};
  for (size_t i = 0; i < count; i++) {
    const Ray ray = ray_unpack(&q->rays[i]);
    if (accel_closest_brute(plain, &ray, mask, filter, &q->seeds[i], &c, &q->expected[i])) continue;
    q->expected[i] = (Hit){.t = ray.tmax, .instance = NO_HIT};
  }
}

static bool is_expected(const Asked *q, size_t i)
{
  const Hit *got = &q->hits[i], *expected = &q->expected[i];
  return got->instance == expected->instance && got->prim == expected->prim &&
         !memcmp(&got->t, &expected->t, 4) && !memcmp(&got->u, &expected->u, 4) &&
         !memcmp(&got->v, &expected->v, 4) && q->blocked[i] == (expected->instance != NO_HIT);
}

// The answers of a, by every walk, that differ from those of testing everything in plain, which has the same instances.
static int ask_all(Asked *q, const Accel *a, const Accel *plain, size_t count, RayMask mask,
                   HitFilter *filter)
{
  Ask *const asks[] = {accel_ask, ask_streams, turns_walk};
  int wrong = 0;
  expect_brute(q, plain, count, mask, filter);
  for (int k = 0; k < 3; k++) {
    RayCounters c = {0};
    Batch b = {.accel = a,
               .rays = q->rays,
               .count = count,
               .mask = mask,
               .filter = filter,
               .user = q->seeds,
               .user_stride = sizeof *q->seeds,
               .counters = &c,
               .hits = q->hits};
    asks[k](&b);
    b.hits = NULL;
    b.blocked = q->blocked;
    asks[k](&b);
    for (size_t i = 0; i < count; i++) wrong += !is_expected(q, i);
  }
  return wrong;
}

// Bundles of every kind through one world.
static void check_bundles(const Accel *a, const Accel *plain, const Soup *s, int scene, Asked *q)
{
  for (int bundle = 0; bundle < BUNDLE_COUNT; bundle++) {
    Random r = {5u + (uint32_t)scene};
    for (int i = 0; i < MOST_RAYS; i++) {
      const Ray ray = bundle_ray((Bundle)bundle, a, s, &r, i);
      q->rays[i] = ray_pack(&ray);
      q->seeds[i] = (uint32_t)i / 2;
    }
    const int wrong = ask_all(q, a, plain, MOST_RAYS, RAY_ALL, NULL);
    CHECK_MSG(wrong == 0, "scene %d, bundle %d: %d of %d answers differ", scene, bundle, wrong, MOST_RAYS);
  }
}

// G2, G3
static void check_layout(TreeLayout layout)
{
  Asked *q = malloc(sizeof *q);
  for (int kind = 0; kind < 4 * NASTY_COUNT; kind++) {
    const bool many = kind / NASTY_COUNT & 1;
    const TreeQuality quality = kind < 2 * NASTY_COUNT ? TREE_FAST : TREE_BEST;
    Soup s = nasty_soup((Nasty)(kind % NASTY_COUNT), many ? 60 : 400);
    Accel *a = accel_of(&s, (TreeOptions){layout, quality}, many);
    Accel *plain = accel_of(&s, (TreeOptions){TREE_FLOAT, quality}, many);
    check_bundles(a, plain, &s, kind, q);
    accel_destroy(a);
    accel_destroy(plain);
    soup_finish(&s);
  }
  free(q);
}

TEST(batches_through_pieces_equal_brute_force)
{
  Asked *q = malloc(sizeof *q);
  for (int k = 0; k < 4; k++) {
    const bool many = k & 1;
    Soup s = boards(40, 500, many ? v3(30, -40, 10) : v3_all(0));
    Accel *a = accel_of(&s, (TreeOptions){k & 2 ? TREE_COMPACT : TREE_FLOAT, TREE_BEST}, many);
    Accel *plain = accel_of(&s, (TreeOptions){TREE_FLOAT, TREE_BEST}, many);
    CHECK(a->instances[0].mesh->has_pieces);
    check_bundles(a, plain, &s, 100 + k, q);
    accel_destroy(a);
    accel_destroy(plain);
    soup_finish(&s);
  }
  free(q);
}

TEST(batches_equal_brute_force)
{
  check_layout(TREE_FLOAT);
}
TEST(batches_of_compact_trees_equal_brute_force)
{
  check_layout(TREE_COMPACT);
}

TEST(any_number_of_rays_filters_and_masks)
{
  Asked *q = malloc(sizeof *q);
  Soup s = nasty_soup(RANDOM, 300);
  Accel *a = accel_of(&s, (TreeOptions){0}, true);
  for (size_t i = 0; i < a->instance_count; i++) {
    a->instances[i].mask = (uint8_t)(i % 3 ? RAY_ALL : RAY_CAMERA);
    a->instances[i].has_filter = i % 2;
  }
  for (size_t count = 1; count < 200; count += count < 70 ? 1 : 13)
    for (int bundle = 0; bundle < BUNDLE_COUNT; bundle++) {
      Random r = {(uint32_t)count};
      for (size_t i = 0; i < count; i++) {
        const Ray ray = bundle_ray((Bundle)bundle, a, &s, &r, (int)i);
        q->rays[i] = ray_pack(&ray);
        q->seeds[i] = (uint32_t)i;
      }
      const int wrong = ask_all(q, a, a, count, count % 2 ? RAY_SHADOW : RAY_CAMERA, some_count);
      CHECK_MSG(wrong == 0, "%zu rays, bundle %d: %d answers differ", count, bundle, wrong);
    }
  accel_destroy(a);
  soup_finish(&s);
  free(q);
}

TEST_MAIN
