// G1: closed meshes have no holes. Rays from inside towards vertices and points of edges must hit something, at any
// scale and far from the origin, one by one and in batches. RAYFOLD_RAYS=N asks for N rays instead of a share of the
// usual ten million, and RAYFOLD_SEED=N for others.

#include "tests/soup.h"

#include "accel/batch.h"
#include "accel/traverse.h"

enum { AT_ONCE = 512 };

#if defined __OPTIMIZE__ && !defined __SANITIZE_ADDRESS__ && !defined __SANITIZE_THREAD__
enum { RAYS = 2500 * 1000 };
#else
enum { RAYS = 100 * 1000 };
#endif

static long asked(const char *name, long usual)
{
  const char *text = getenv(name);
  return text ? atol(text) : usual;
}

typedef struct Closed {
  int around, down;
  float radius, bumps;
  Vec3 centre;
} Closed;

static const Closed kinds[] = {
    {100, 50, 2, 0, {0, 0, 0}},
    {100, 50, 2, 0, {1000, 37, -2000}},
    {100, 50, 2, 0, {148376, 1234, -223423}},
    {100, 50, 1e-6f, 0, {0, 0, 0}},
    {100, 50, 1e6f, 0, {0, 0, 0}},
    {7, 900, 3, 0, {5, 6, 7}}, // thin, long triangles
    {400, 200, 1, 0.2f, {0, 0, 0}},
};

static Soup closed_soup(const Closed *k)
{
  const size_t columns = (size_t)k->around, down = (size_t)k->down;
  Soup s = {mem_zero((down + 1) * columns * 3, sizeof(float)),
            mem_zero(2 * columns * down * 3, sizeof(uint32_t)), (down + 1) * columns, 0};
  for (size_t j = 0; j <= down; j++)
    for (size_t i = 0; i < columns; i++) {
      const double theta = 3.14159265358979 * (double)j / (double)down;
      const double phi = 2 * 3.14159265358979 * (double)i / (double)columns;
      const bool is_pole = j == 0 || j == down; // all corners of a pole must be one point
      const float x = is_pole ? 0 : (float)(sin(theta) * cos(phi)),
                  z = is_pole ? 0 : (float)(sin(theta) * sin(phi));
      const float bump = is_pole ? 1 : 1 + k->bumps * unit_float(hash_u32((uint32_t)(j * columns + i)));
      v3_store(s.positions + 3 * (j * columns + i),
               k->centre + k->radius * bump * v3(x, (float)cos(theta), z));
    }
  for (size_t j = 0; j < down; j++)
    for (size_t i = 0; i < columns; i++) {
      const uint32_t p = (uint32_t)(j * columns + i), q = (uint32_t)(j * columns + (i + 1) % columns);
      const uint32_t c = (uint32_t)columns, six[6] = {p, q, p + c, q, q + c, p + c};
      memcpy(s.triangles + 3 * s.triangle_count, six, sizeof six);
      s.triangle_count += 2;
    }
  return s;
}

// From near the middle to a vertex, or to a point of an edge as near as floats can say.
static Ray ray_to_edge(const Closed *k, const Soup *s, Random *r)
{
  const uint32_t choice = hash_u32(r->state++);
  const uint32_t *t = s->triangles + 3 * (choice % s->triangle_count);
  const Vec3 p = v3_load(s->positions + 3 * (size_t)t[0]), q = v3_load(s->positions + 3 * (size_t)t[1]);
  const Vec3 o = k->centre + 0.3f * k->radius * rnd_vec(r), to = choice >> 30 ? v3_mix(p, q, rnd(r)) : p;
  return (Ray){o, to - o, 0, INFINITY};
}

static long missed_of(const Accel *a, const PackedRay *rays)
{
  RayCounters c = {0};
  Hit hits[AT_ONCE], alone;
  uint8_t blocked[AT_ONCE];
  Batch b = {.accel = a, .rays = rays, .count = AT_ONCE, .mask = RAY_ALL, .counters = &c, .hits = hits};
  accel_ask(&b);
  b.hits = NULL;
  b.blocked = blocked;
  accel_ask(&b);
  long missed = 0;
  for (int i = 0; i < AT_ONCE; i++) {
    missed += hits[i].instance == NO_HIT || !blocked[i];
    if (i % 8) continue;
    const Ray ray = ray_unpack(&rays[i]);
    missed += !accel_closest(a, &ray, RAY_ALL, NULL, NULL, &c, &alone);
  }
  return missed;
}

TEST(closed_meshes_have_no_holes)
{
  const size_t count = 4 * (sizeof kinds / sizeof *kinds); // each in either layout and quality
  const long rounds = asked("RAYFOLD_RAYS", RAYS) / AT_ONCE / (long)count + 1;
  const uint32_t seed = (uint32_t)asked("RAYFOLD_SEED", 0);
  for (size_t k = 0; k < count; k++) {
    Soup s = closed_soup(&kinds[k / 4]);
    Accel *a = accel_of(&s, (TreeOptions){(TreeLayout)(k & 1), (TreeQuality)(k >> 1 & 1)}, false);
    long missed = 0;
    for (long round = 0; round < rounds; round++) {
      Random r = {hash_combine(hash_combine(seed, (uint32_t)k), (uint32_t)round)};
      PackedRay rays[AT_ONCE];
      for (int i = 0; i < AT_ONCE; i++) {
        const Ray ray = ray_to_edge(&kinds[k / 4], &s, &r);
        rays[i] = ray_pack(&ray);
      }
      missed += missed_of(a, rays);
    }
    CHECK_MSG(missed == 0, "mesh %zu: %ld of %ld rays escaped", k, missed, rounds * AT_ONCE);
    accel_destroy(a);
    soup_finish(&s);
  }
}

TEST_MAIN
