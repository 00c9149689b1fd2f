// Voxels: cells against a plain array through edits, the walk against brute force bit by bit, the same answers from every
// walk and instruction set, surfaces that what leaves them does not meet again, light of shining voxels against that of
// shining boxes, and programs of scene files.

#include "tests/render_sample.h"
#include "tests/test.h"

#include "accel/brute.h"
#include "accel/place.h"
#include "base/hash.h"
#include "geom/offset.h"
#include "image/voxels.h"
#include "render/hot.h"
#include "scene/edit.h"

#include <unistd.h>

static uint32_t state = 1;

static uint32_t rnd_bits(void)
{
  state += 0x9e3779b9u;
  return hash_u32(state);
}
static float rnd(void) { return unit_float(rnd_bits()); }
static int32_t rnd_int(int32_t n) { return (int32_t)(rnd_bits() % (uint32_t)n); }
static float rnd_between(float low, float high) { return low + (high - low) * rnd(); }

static Vec3 rnd_direction(void)
{
  const float z = 1 - 2 * rnd(), r = safe_sqrt(1 - z * z), a = 2 * PI * rnd();
  return v3(r * f_cos(a), r * f_sin(a), z);
}

// --- cells --------------------------------------------------------------------------------------------------------
enum { PLAIN_X = 70, PLAIN_Y = 40, PLAIN_Z = 130 };
static uint16_t plain[PLAIN_Z][PLAIN_Y][PLAIN_X];

static int count_differences(const Voxels *v)
{
  int wrong = 0;
  uint64_t filled = 0, bare = 0;
  for (int z = 0; z < PLAIN_Z; z++)
    for (int y = 0; y < PLAIN_Y; y++)
      for (int x = 0; x < PLAIN_X; x++) {
        wrong += voxels_entry(v, x, y, z) != plain[z][y][x];
        if (!plain[z][y][x]) continue;
        filled++;
        bare += x == 0 || y == 0 || z == 0 || x == PLAIN_X - 1 || y == PLAIN_Y - 1 || z == PLAIN_Z - 1 || !plain[z][y][x - 1] ||
                !plain[z][y][x + 1] || !plain[z][y - 1][x] || !plain[z][y + 1][x] || !plain[z - 1][y][x] || !plain[z + 1][y][x];
        for (int k = 0; k < 3; k++) wrong += (int[]){x, y, z}[k] < v->lo[k] || (int[]){x, y, z}[k] >= v->hi[k];
      }
  return wrong + (v->cell_count != filled) + (voxels_surface_count(v) != bare);
}

// Edits of all kinds, through all widths of entries; versions before stay what they were.
TEST(cells_are_those_of_a_plain_array)
{
  const int32_t size[3] = {PLAIN_X, PLAIN_Y, PLAIN_Z};
  memset(plain, 0, sizeof plain);
  Voxels *v = voxel_edit_end(voxel_edit_create(size, NULL), NULL);
  CHECK(v && v->cell_count == 0 && v->lo[0] >= v->hi[0]);
  for (int round = 0; round < 6; round++) {
    VoxelEdit *e = voxel_edit_from(v, NULL);
    const int entries = round == 0 ? 1 : round == 1 ? 3 : round == 2 ? 14 : round == 3 ? 200 : 700;
    for (int i = 0; i < entries; i++) (void)voxel_edit_color(e, (float[]){(float)i / 800, 0.5f, 0}, 0);
    for (int n = 0; n < (round == 5 ? 60000 : 4000); n++) {
      const int32_t x = rnd_int(PLAIN_X / 2), y = rnd_int(PLAIN_Y), z = rnd_int(PLAIN_Z);
      const uint32_t entry = n % 5 == 0 ? 0 : 1 + (uint32_t)rnd_int(entries);
      CHECK(voxel_edit_put(e, x, y, z, entry));
      plain[z][y][x] = (uint16_t)entry;
      if (n % 100 == 0) CHECK(voxel_edit_get(e, x, y, z) == entry);
    }
    for (int n = 0; n < 3; n++) {
      const int32_t lo[3] = {rnd_int(PLAIN_X) - 5, rnd_int(PLAIN_Y) - 5, rnd_int(PLAIN_Z) - 5};
      const int32_t hi[3] = {lo[0] + rnd_int(40), lo[1] + rnd_int(40), lo[2] + rnd_int(40)};
      const uint32_t entry = n == 2 ? 0 : 1 + (uint32_t)rnd_int(entries);
      CHECK(voxel_edit_fill(e, lo, hi, entry));
      for (int z = lo[2] < 0 ? 0 : lo[2]; z < hi[2] && z < PLAIN_Z; z++)
        for (int y = lo[1] < 0 ? 0 : lo[1]; y < hi[1] && y < PLAIN_Y; y++)
          for (int x = lo[0] < 0 ? 0 : lo[0]; x < hi[0] && x < PLAIN_X; x++) plain[z][y][x] = (uint16_t)entry;
    }
    const uint64_t before = voxels_hash(0, v);
    Voxels *next = voxel_edit_end(e, NULL);
    CHECK(next && count_differences(next) == 0);
    CHECK(voxels_hash(0, v) == before && voxels_hash(0, next) != before);
    voxels_release(v);
    v = next;
  }
  // What an edit does not touch is shared, not copied.
  VoxelEdit *e = voxel_edit_from(v, NULL);
  CHECK(voxel_edit_put(e, 1, 1, 1, 2));
  Voxels *next = voxel_edit_end(e, NULL);
  CHECK(next->nodes[0] != v->nodes[0] && next->nodes[2] == v->nodes[2] && next->palette == v->palette);
  voxels_release(v);
  voxels_release(next);
}

// A brick takes a byte a cell of its skin, its entries by how many kinds it has; what is filled takes two bytes a brick.
TEST(memory_is_that_of_the_skin)
{
  const int32_t size[3] = {256, 256, 256};
  for (int hollow = 0; hollow < 2; hollow++) {
    VoxelEdit *e = voxel_edit_create(size, NULL);
    const uint32_t entry = (uint32_t)voxel_edit_color(e, (float[]){1, 0, 0}, 0);
    for (int z = 0; z < 256; z++)
      for (int y = 0; y < 256; y++)
        for (int x = 0; x < 256; x++) {
          const float r = sqrtf(sqr_f((float)x - 127.5f) + sqr_f((float)y - 127.5f) + sqr_f((float)z - 127.5f));
          if (r <= 120 && (!hollow || r > 118.5f)) (void)voxel_edit_put(e, x, y, z, entry);
        }
    Voxels *v = voxel_edit_end(e, NULL);
    const double a_cell = (double)voxels_bytes(v) / (double)voxels_surface_count(v);
    CHECK_MSG(a_cell < (hollow ? 2 : 2.05), "%.2f bytes a cell of the surface, hollow %d", a_cell, hollow);
    voxels_release(v);
  }
}

// Whatever the colours, a cell takes not much more than the bits that tell them apart, and is read back.
TEST(colours_take_the_bits_they_need)
{
  static const int kinds[4] = {2, 100, 1000, 60000};
  static uint16_t cells[64][64][64];
  for (int n = 0; n < 4; n++) {
    VoxelEdit *e = voxel_edit_create((int32_t[]){64, 64, 64}, NULL);
    for (int i = 0; i < kinds[n]; i++) (void)voxel_edit_color(e, (float[]){(float)(i & 255), (float)(i >> 8), 0}, 0);
    for (int z = 0; z < 64; z++)
      for (int y = 0; y < 64; y++)
        for (int x = 0; x < 64; x++) {
          cells[z][y][x] = (uint16_t)(1 + rnd_int(kinds[n]));
          (void)voxel_edit_put(e, x, y, z, cells[z][y][x]);
        }
    Voxels *v = voxel_edit_end(e, NULL);
    int wrong = 0;
    for (int z = 0; z < 64; z++)
      for (int y = 0; y < 64; y++)
        for (int x = 0; x < 64; x++) wrong += voxels_entry(v, x, y, z) != cells[z][y][x];
    const double palette = (double)v->palette->entry_count * sizeof *v->palette->entries;
    const double bits = 8 * ((double)voxels_bytes(v) - palette) / (64.0 * 64 * 64);
    CHECK_MSG(wrong == 0 && bits < ceil(log2(kinds[n])) + 1.5, "%d kinds: %d wrong, %.2f bits a cell", kinds[n], wrong, bits);
    voxels_release(v);
  }
}

TEST(no_allocation_that_fails_breaks_anything)
{
  const int32_t size[3] = {70, 70, 20};
  int ended = 0;
  for (long n = 1; n < 60; n++) {
    mem_fail_after(n);
    VoxelEdit *e = voxel_edit_create(size, NULL);
    bool ok = e != NULL;
    for (int i = 0; ok && i < 40; i++) {
      const int32_t entry = voxel_edit_color(e, (float[]){(float)i, 0, 0}, 0);
      ok = entry >= 0 && voxel_edit_put(e, (7 * i) % 70, i, i % 20, (uint32_t)entry);
    }
    Voxels *v = ok ? voxel_edit_end(e, NULL) : NULL;
    if (!ok) voxel_edit_destroy(e);
    mem_fail_after(0);
    ended += v != NULL;
    voxels_release(v);
  }
  CHECK(ended < 59);
}

// In a full palette, the first of the entries that are nearest, of the same look: as looking at each of them finds it.
TEST(a_full_palette_gives_the_nearest)
{
  const int32_t size[3] = {8, 8, 8};
  VoxelEdit *e = voxel_edit_create(size, NULL);
  VoxelLook look = voxel_look_plain();
  look.roughness = 0.25f;
  const uint32_t second = (uint32_t)voxel_edit_look(e, &look);
  for (int i = 0; i < VOXELS_MOST_ENTRIES; i++) {
    const float color[3] = {rnd() * rnd(), rnd(), i % 3 ? 0.25f * (float)rnd_int(4) : 0.5f};
    CHECK(voxel_edit_color(e, color, i % 5 ? 0 : second) > 0);
  }
  while (voxel_edit_grid(e)->palette->entry_count <= VOXELS_MOST_ENTRIES)
    (void)voxel_edit_color(e, (float[3]){rnd(), rnd(), rnd()}, second);
  const VoxelPalette *p = voxel_edit_grid(e)->palette;
  for (int n = 0; n < 60; n++) {
    const uint32_t wanted = n % 4 ? 0 : second;
    const float scale = n % 7 ? 1 : 2, color[3] = {scale * rnd(), scale * rnd(), n % 3 ? rnd() : (float)rnd_int(2)};
    int32_t best = 0;
    float off = INFINITY;
    for (uint32_t i = 1; i < p->entry_count; i++) {
      float d = 0;
      for (int k = 0; k < 3; k++) d += fabsf(sqrtf(p->entries[i].color[k]) - sqrtf(color[k]));
      if (p->entries[i].look != wanted || !(d < off)) continue;
      off = d;
      best = (int32_t)i;
    }
    CHECK(voxel_edit_color(e, color, wanted) == best);
  }
  voxel_edit_destroy(e);
}

// --- the walk -----------------------------------------------------------------------------------------------------
enum { MOST_MET = 4000 };
typedef struct Met {
  VoxelCrossing at[MOST_MET];
  int count, most;
} Met;

static bool note(void *user, const VoxelCrossing *c)
{
  Met *m = user;
  if (m->count < MOST_MET) m->at[m->count++] = *c;
  return m->count >= m->most;
}

static uint32_t matter_at(const VoxelBody *b, const int32_t c[3]) { return voxel_matter(b, voxels_entry(b->grid, c[0], c[1], c[2])); }

typedef struct GridPlane {
  float t;
  int axis;
} GridPlane;

static int by_time(const void *a, const void *b)
{
  const GridPlane *x = a, *y = b;
  return x->t < y->t ? -1 : x->t > y->t ? 1 : x->axis - y->axis;
}

// All planes of the grid, sorted, and every cell in between looked at: what the walk is defined by.
static void brute_walk(const VoxelBody *b, const float o[3], const float d[3], float tmin, float tmax, Met *out)
{
  static GridPlane planes[3 * 1024];
  const VoxelLine l = voxel_line(o, d);
  const Voxels *v = b->grid;
  int count = 0;
  int32_t c[3];
  out->count = 0;
  for (int k = 0; k < 3; k++) {
    // Cells count from -1 (before the grid) to its size (behind).
    c[k] = l.step[k] > 0 ? -1 : v->size[k];
    if (!l.step[k]) c[k] = (int32_t)fminf(fmaxf(floorf(o[k]), -1), (float)v->size[k]);
    for (int32_t n = 0; l.step[k] && n <= v->size[k]; n++) planes[count++] = (GridPlane){voxel_plane_t(&l, k, n), k};
  }
  qsort(planes, (size_t)count, sizeof *planes, by_time);
  int i = 0;
  for (; i < count && planes[i].t <= tmin; i++) c[planes[i].axis] += l.step[planes[i].axis];
  uint32_t matter = matter_at(b, c);
  for (; i < count && planes[i].t <= tmax && out->count < MOST_MET; i++) {
    const int k = planes[i].axis;
    const int32_t before[3] = {c[0], c[1], c[2]};
    c[k] += l.step[k];
    const uint32_t now = matter_at(b, c);
    if (now == matter) continue;
    const bool is_left = now == 0 || matter == 1;
    const int32_t *of = is_left ? before : c;
    const bool looks_along = is_left ? l.step[k] > 0 : l.step[k] < 0;
    out->at[out->count++] = (VoxelCrossing){planes[i].t, {of[0], of[1], of[2]}, 2 * (uint32_t)k + looks_along};
    matter = now;
  }
}

// Rays as people and mirrors make them: axis-parallel, along planes and edges, through corners, from inside, from far.
static void nasty_ray(const Voxels *v, int i, float o[3], float d[3])
{
  Vec3 to = v3(rnd_between(-2, (float)v->size[0] + 2), rnd_between(-2, (float)v->size[1] + 2), rnd_between(-2, (float)v->size[2] + 2));
  Vec3 way = rnd_direction();
  if (i % 5 == 1) to = v3(floorf(to[0]), floorf(to[1]), floorf(to[2])); // through a corner
  if (i % 7 == 2) way[rnd_int(3)] = 0;
  if (i % 11 == 3) way = v3(0, 0, 0), way[rnd_int(3)] = i & 1 ? 1 : -1;
  if (i % 13 == 4) way = v3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1); // through corner after corner
  if (i % 17 == 5) way[rnd_int(3)] = 1e-30f;
  if (i % 19 == 6) way *= 1e-3f;
  const float away = i % 3 == 0 ? 0 : i % 23 == 7 ? 3e4f : (float)v->size[2];
  const Vec3 from = to - away * way;
  v3_store(o, from);
  v3_store(d, way);
}

static Voxels *sample_grid(const int32_t size[3], int kind)
{
  VoxelEdit *e = voxel_edit_create(size, NULL);
  for (int i = 0; i < 4; i++) (void)voxel_edit_color(e, (float[]){(float)i / 4, 0, 0}, 0);
  for (int32_t z = 0; z < size[2]; z++)
    for (int32_t y = 0; y < size[1]; y++)
      for (int32_t x = 0; x < size[0]; x++) {
        const uint32_t h = rnd_bits();
        const float r = sqrtf(sqr_f((float)x - 40) + sqr_f((float)y - 30) + sqr_f((float)z - 60));
        const bool is_in = kind == 0 ? h % 3 == 0 : kind == 1 ? h % 200 == 0 : (r < 28 && r > 9) || h % 4000 == 0;
        if (is_in) (void)voxel_edit_put(e, x, y, z, 1 + (kind == 2 ? (uint32_t)(x / 9 + z / 17) % 4 : h >> 8 & 3));
      }
  return voxel_edit_end(e, NULL);
}

// Promise G7: no difference in 10^7 rays (at RAYFOLD_INTENSITY 100), the whole way through, not only the first hit.
TEST(the_walk_is_brute_force)
{
  static const int32_t sizes[3][3] = {{19, 24, 33}, {130, 70, 200}, {90, 64, 129}};
  static Met walked, brute;
  for (int kind = 0; kind < 3; kind++) {
    Voxels *v = sample_grid(sizes[kind], kind);
    static const uint8_t matter[5] = {0, 1, 2, 2, 3};
    int wrong = 0, hits = 0;
    const int rays = (int)((TEST_IS_SLOW ? 1500 : 12000) * fmin(test_intensity(), 300));
    for (int i = 0; i < rays; i++) {
      const VoxelBody body = {v, i & 1 ? matter : NULL};
      float o[3], d[3];
      nasty_ray(v, i, o, d);
      const float tmin = i % 29 == 1 ? rnd() * 20 : 0, tmax = i % 31 == 2 ? 40 * rnd() : INFINITY;
      walked.count = 0;
      walked.most = MOST_MET;
      (void)voxel_walk(&body, o, d, tmin, fminf(tmax, FLT_MAX), note, &walked);
      brute_walk(&body, o, d, tmin, fminf(tmax, FLT_MAX), &brute);
      bool same = walked.count == brute.count;
      for (int k = 0; same && k < walked.count; k++)
        same = !memcmp(&walked.at[k].t, &brute.at[k].t, 4) && !memcmp(walked.at[k].cell, brute.at[k].cell, sizeof brute.at[k].cell) &&
               walked.at[k].face == brute.at[k].face;
      wrong += !same;
      hits += walked.count > 0;
    }
    CHECK_MSG(wrong == 0 && hits > rays / 8, "grid %d: %d of %d rays differ, %d hit", kind, wrong, rays, hits);
    voxels_release(v);
  }
}

// --- in the tree --------------------------------------------------------------------------------------------------
static Frame some_frame(float turn, float size, Vec3 at)
{
  Frame f = frame_around(v3_normalize(v3(turn, 0.4f * turn, 1)));
  f.x *= size, f.y *= size, f.z *= size;
  f.p = at;
  return f;
}

static Instance placed_grid(const VoxelBody *b, Frame f)
{
  return (Instance){.world_from_object = f, .object_from_world = frame_inverse(&f), .voxels = b, .kind = INSTANCE_VOXELS, .mask = RAY_ALL};
}

TEST(all_walks_and_levels_agree)
{
  enum { RAYS = 4096 };
  static PackedRay rays[RAYS];
  static Hit hits[RAYS], first[RAYS];
  static uint8_t blocked[RAYS];
  Voxels *v = sample_grid((int32_t[]){80, 60, 120}, 2);
  static const uint8_t matter[5] = {0, 1, 2, 2, 3};
  const VoxelBody opaque = {v, NULL}, clear = {v, matter};
  const Instance list[4] = {placed_grid(&opaque, frame_identity()), placed_grid(&opaque, some_frame(0.5f, 0.37f, v3(90, 3, 5))),
                            placed_grid(&clear, some_frame(-1.5f, 1.4f, v3(-120, 10, 5))),
                            placed_grid(&opaque, some_frame(0.2f, 0.01f, v3(40, 30, -20)))};
  Accel *a = accel_build(list, 4, NULL, NULL, NULL);
  RayCounters unused = {0};
  int met = 0, wrong = 0;
  for (int i = 0; i < RAYS; i++) { // blocks of like rays, and others
    const Vec3 to = i / 64 % 2 ? v3(rnd_between(-130, 120), rnd_between(0, 70), rnd_between(-20, 120))
                               : v3(40 + 0.1f * (float)(i & 63), 30 + 0.2f * (float)(i / 64), 60);
    const Vec3 from = i / 64 % 2 ? to - 200 * rnd_direction() : v3(150, 90, 260);
    const Ray r = {from, to - from, 0, INFINITY};
    rays[i] = ray_pack(&r);
    Hit brute;
    met += accel_closest(a, &r, RAY_ALL, NULL, NULL, &unused, &first[i]);
    (void)accel_closest_brute(a, &r, RAY_ALL, NULL, NULL, &unused, &brute);
    wrong += memcmp(&brute, &first[i], 20) != 0;
  }
  CHECK_MSG(wrong == 0 && met > RAYS / 4, "%d differ from brute force, %d hit", wrong, met);
  for (IsaLevel level = ISA_REF; level <= cpu_best_isa(); level++) {
    hot_table(level)->closest_n(a, rays, hits, RAYS);
    hot_table(level)->any_n(a, rays, blocked, RAYS);
    int differ = 0;
    for (int i = 0; i < RAYS; i++) differ += memcmp(&hits[i], &first[i], 20) != 0 || blocked[i] != (first[i].instance != NO_HIT);
    CHECK_MSG(differ == 0, "level %d: %d differ", (int)level, differ);
  }
  accel_destroy(a);
  voxels_release(v);
}

// Rays by many in lanes find what one by one finds, at every level, whatever the rays: also such whose reciprocals are
// next to nothing, from far away, with ends in the grid, and from within what is filled.
TEST(lanes_find_what_single_walks_find)
{
  enum { MANY = 64 };
  static const int32_t sizes[3][3] = {{19, 24, 33}, {130, 70, 200}, {90, 64, 129}};
  PackedRay rays[MANY];
  Hit hits[MANY], single[MANY];
  uint8_t blocked[MANY];
  RayCounters unused = {0};
  const int rounds = (int)((TEST_IS_SLOW ? 40 : 300) * fmin(test_intensity(), 100));
  for (int kind = 0; kind < 3; kind++) {
    Voxels *v = sample_grid(sizes[kind], kind);
    static const uint8_t matter[5] = {0, 1, 2, 2, 3};
    const VoxelBody body = {v, kind == 1 ? matter : NULL};
    const Instance in = placed_grid(&body, frame_identity());
    Accel *a = accel_build(&in, 1, NULL, NULL, NULL);
    int wrong = 0, met = 0;
    for (int r = 0; r < rounds; r++) {
      for (int i = 0; i < MANY; i++) {
        float o[3], d[3];
        nasty_ray(v, r * MANY + i, o, d);
        const float size = r % 5 == 1 ? 0x1p100f : r % 5 == 2 ? 1e-20f : 1;
        const Ray ray = {v3_load(o), v3_load(d) * size, i % 29 == 1 ? rnd() * 20 / size : 0, i % 31 == 2 ? 40 * rnd() / size : INFINITY};
        rays[i] = ray_pack(&ray);
        met += accel_closest(a, &ray, RAY_ALL, NULL, NULL, &unused, &single[i]);
      }
      for (IsaLevel level = ISA_REF; level <= cpu_best_isa(); level++) {
        hot_table(level)->closest_n(a, rays, hits, MANY);
        hot_table(level)->any_n(a, rays, blocked, MANY);
        for (int i = 0; i < MANY; i++) wrong += memcmp(&hits[i], &single[i], 20) != 0 || blocked[i] != (single[i].instance != NO_HIT);
      }
    }
    CHECK_MSG(wrong == 0 && met > rounds * MANY / 8, "grid %d: %d differ, %d met", kind, wrong, met);
    accel_destroy(a);
    voxels_release(v);
  }
}

// Points lie on their faces, normals are those of the faces, and what leaves a face outwards does not meet it again, nor
// the neighbours it touches; what goes inwards meets the other side.
TEST(points_are_on_faces_and_left_for_good)
{
  Voxels *v = sample_grid((int32_t[]){80, 60, 120}, 2);
  const VoxelBody body = {v, NULL};
  const Frame frames[4] = {frame_identity(), some_frame(0.5f, 0.05f, v3(3, 1, 2)), some_frame(-1.1f, 13, v3(0, 0, 0)),
                           some_frame(0.3f, 0.1f, v3(2000, -500, 100))};
  RayCounters unused = {0};
  const int rays = (int)((TEST_IS_SLOW ? 1000 : 5000) * fmin(test_intensity(), 100));
  int met = 0, off = 0, again = 0, lost = 0, turned = 0;
  for (int i = 0; i < rays; i++) {
    const Frame f = frames[i & 3];
    const Instance in = placed_grid(&body, f);
    static Accel *accels[4];
    if (!accels[i & 3]) accels[i & 3] = accel_build(&in, 1, NULL, NULL, NULL);
    const Accel *a = accels[i & 3];
    const Vec3 to = v3(rnd_between(10, 70), rnd_between(0, 60), rnd_between(30, 90)), way = rnd_direction();
    const Ray r = {frame_point(&f, to - 200 * way), frame_vector(&f, way), 0, INFINITY};
    Hit h;
    if (!accel_closest(a, &r, RAY_ALL, NULL, NULL, &unused, &h)) continue;
    met++;
    const SurfacePoint s = accel_surface(a, NULL, &r, &h);
    const Vec3 p = frame_point(&in.object_from_world, s.p), n = v3_normalize(frame_normal(&f, s.ng));
    const int axis = (int)(h.prim & 7) >> 1;
    off += !(fabsf(p[axis] - floorf(p[axis] + 0.5f)) < 2e-3f) || !(fabsf(n[axis]) > 0.999f);
    turned += s.is_back;
    Vec3 out = rnd_direction();
    if (v3_dot(out, s.ng) < 0) out = -out;
    // The cell in front of the face is empty, so the first thing met is farther than its own walls are near.
    const Ray leaves = {offset_origin(&s, out), out, 0, INFINITY};
    Hit next;
    if (accel_closest(a, &leaves, RAY_ALL, NULL, NULL, &unused, &next)) {
      const SurfacePoint b = accel_surface(a, NULL, &leaves, &next);
      again += b.is_back;
    }
    const Ray enters = {offset_origin(&s, -s.ng), -s.ng, 0, INFINITY};
    lost += !accel_closest(a, &enters, RAY_ALL, NULL, NULL, &unused, &next) || !accel_surface(a, NULL, &enters, &next).is_back;
    if (i >= rays - 4) {
      accel_destroy(accels[i & 3]);
      accels[i & 3] = NULL;
    }
  }
  CHECK_MSG(off == 0 && again == 0 && lost == 0 && turned == 0, "%d met: %d off, %d met again, %d lost, %d turned", met, off, again, lost, turned);
  CHECK(met > rays / 3);
  voxels_release(v);
}

// --- scenes -------------------------------------------------------------------------------------------------------
static Scene *load_text(const char *json, Err *err)
{
  char path[] = "/tmp/rayfold-voxels-XXXXXX.json";
  const int f = mkstemps(path, 5);
  CHECK(f >= 0 && write(f, json, strlen(json)) == (ssize_t)strlen(json));
  close(f);
  Scene *s = scene_load(path, NULL, err);
  unlink(path);
  return s;
}

static Picture picture_of(const char *json, uint32_t spp)
{
  Err err = {0};
  Scene *s = load_text(json, &err);
  CHECK_MSG(s, "%s", err.text);
  if (!s) exit(1);
  World *w = world_of(s);
  Film *film = film_create(48, 36, ALL_PLANES, NULL);
  const RenderJob job = job_of(s, w, pinhole(4, 3, 6, 0, 0.5f, 0, 40), film, spp);
  CHECK(render_run(&job, NULL, hot_table(cpu_best_isa()), NULL, NULL, NULL));
  const Picture p = summarize(film);
  film_destroy(film);
  world_release(w);
  scene_destroy(s);
  return p;
}

#define LIT_SCENE(lamp)                                                                                                   \
  "{\"rayfold\":1,\"sky\":{\"kind\":\"constant\",\"color\":0},\"materials\":{\"glow\":{\"kind\":\"pbr\",\"roughness\":0.9,"  \
  "\"base_color\":[1,0.5,0.25],\"emissive\":[1,0.5,0.25],\"emissive_strength\":5}},\"objects\":[{\"shape\":{\"kind\":\"box\",\"size\":[6,0.2,6]},\"translate\":[0,-0.6,0]}," \
  lamp "]}"

// Shining voxels are aimed at as rectangles; the light is that of a box of the same size, and of voxels that nobody aims
// at (a material by name), within three standard errors.
TEST(voxels_shine_as_boxes_do)
{
  const uint32_t spp = TEST_IS_SLOW ? 24 : 96;
  const Picture box = picture_of(LIT_SCENE("{\"shape\":{\"kind\":\"box\",\"size\":[1,0.5,0.5]},\"material\":\"glow\",\"rotate\":[0,30,0]}"), spp);
  const Picture voxels = picture_of(LIT_SCENE("{\"shape\":{\"kind\":\"voxels\",\"voxel_size\":0.125,\"origin\":\"center\",\"size\":[8,4,4],"
                                              "\"palette\":{\"lamp\":{\"color\":[1,0.5,0.25],\"emission\":5}},\"fill\":[{\"kind\":"
                                              "\"box\",\"size\":[8,4,4],\"voxel\":\"lamp\"}]},\"rotate\":[0,30,0]}"), spp);
  const Picture named = picture_of(LIT_SCENE("{\"shape\":{\"kind\":\"voxels\",\"voxel_size\":0.125,\"origin\":\"center\",\"size\":[8,4,4],"
                                             "\"palette\":{\"lamp\":{\"material\":\"glow\",\"color\":1}},\"fill\":[{\"kind\":"
                                             "\"box\",\"size\":[8,4,4],\"voxel\":\"lamp\"}]},\"scale\":[-1,1,1],\"rotate\":[0,30,0]}"), spp);
  for (int k = 0; k < 3; k++) {
    const double off = 4 * (box.error + voxels.error) * (k == 0 ? 2 : 1);
    CHECK_NEAR(voxels.mean[k], box.mean[k], off);
    CHECK_NEAR(named.mean[k], box.mean[k], off);
  }
  CHECK(voxels.error < 1.5 * box.error); // so they were aimed at
}

static const char tower[] =
    "{\"rayfold\":1,\"materials\":{\"gold\":{\"kind\":\"pbr\",\"metallic\":1,\"roughness\":0.2}},"
    "\"objects\":[{\"name\":\"tower\",\"shape\":{\"kind\":\"voxels\",\"size\":[24,40,24],"
    "\"palette\":{\"stone\":{\"color\":\"#888880\"},\"pane\":{\"color\":\"#a0d0ff\",\"transmission\":1},\"crown\":{\"material\":\"gold\"}},"
    "\"fill\":[{\"kind\":\"cylinder\",\"base\":[12,0,12],\"radius\":10,\"height\":30,\"hollow\":2,\"voxel\":\"stone\",\"randomness\":0.2},"
    "{\"kind\":\"cylinder\",\"base\":[12,30,12],\"radius\":11,\"top_radius\":0,\"height\":9,\"color\":\"#a03020\"},"
    "{\"kind\":\"box\",\"corner\":[9,8,0],\"size\":[6,6,6],\"mode\":\"paint\",\"voxel\":\"pane\"},"
    "{\"kind\":\"sphere\",\"center\":[12,38,12],\"radius\":2,\"voxel\":\"crown\"},"
    "{\"kind\":\"flood\",\"at\":[12,20,12],\"mode\":\"add\",\"color\":\"#400000\"},"
    "{\"kind\":\"box\",\"corner\":[1,0,1],\"size\":[2,2,2],\"repeat\":4,\"offset\":[6,0,0],\"color\":\"#ffffff\"},"
    "{\"kind\":\"replace\",\"what\":\"crown\",\"color\":\"#00ff00\"},"
    "{\"kind\":\"extrude\",\"at\":[1,1,1],\"face\":\"-x\",\"amount\":1}]}}]}";

// What is written is what was read, to the byte, and makes the same cells.
TEST(a_program_is_saved_as_it_was)
{
  Err err = {0};
  Scene *s = load_text(tower, &err);
  CHECK_MSG(s, "%s", err.text);
  if (!s) return;
  Text first = {0}, second = {0};
  CHECK(scene_write(s, &first, &err));
  Scene *again = load_text(text_get(&first), &err);
  CHECK_MSG(again, "%s", err.text);
  if (again) {
    CHECK(scene_write(again, &second, &err));
    CHECK(!strcmp(text_get(&first), text_get(&second)));
    const Voxels *a = s->voxels.items[s->objects.items[0].shape.voxels_i].data;
    const Voxels *b = again->voxels.items[again->objects.items[0].shape.voxels_i].data;
    CHECK(voxels_hash(0, a) == voxels_hash(0, b) && a->cell_count > 2000);
    CHECK(voxels_entry(a, 12, 39, 12) && !voxels_entry(a, 0, 20, 0));
  }
  text_finish(&first);
  text_finish(&second);
  scene_destroy(s);
  scene_destroy(again);
}

TEST(mistakes_are_named_with_their_place)
{
  static const struct {
    const char *inside, *message;
  } wrong[] = {
      {"\"size\":[0,4,4]", "between 1 and 4096"},
      {"\"size\":[4,4]", "three whole numbers"},
      {"\"fill\":[]", "need a \"file\""},
      {"\"size\":[4,4,4],\"palette\":[]", "dictionary"},
      {"\"size\":[4,4,4],\"palette\":{\"a\":{\"colour\":1}}", "did you mean \"color\""},
      {"\"size\":[4,4,4],\"fill\":[{\"kind\":\"boxx\"}]", "did you mean \"box\""},
      {"\"size\":[4,4,4],\"fill\":[{\"kind\":\"box\",\"voxel\":\"stone\"}]", "no \"stone\""},
      {"\"size\":[4,4,4],\"fill\":[{\"kind\":\"box\",\"corner\":[9,0,0]}]", "touches no cell"},
      {"\"size\":[4,4,4],\"fill\":[{\"kind\":\"flood\",\"at\":[9,0,0]}]", "outside the grid"},
      {"\"size\":[4,4,4],\"fill\":[{\"kind\":\"extrude\",\"at\":[1,0,0]}]", "is empty"},
      {"\"size\":[4,4,4],\"fill\":[{\"kind\":\"heights\",\"file\":\"none.png\"}]", "none.png"},
      {"\"size\":[4,4,4],\"cells\":[0,4,1]", "three whole numbers"},
      {"\"size\":[4,4,4],\"palette\":{\"a\":{}},\"cells\":[60,5,1]", "fit into the grid"},
      {"\"size\":[4,4,4],\"sizze\":1", "did you mean \"size\""},
  };
  for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
    char json[600];
    Err err = {0};
    snprintf(json, sizeof json, "{\"rayfold\":1,\"objects\":[{\"shape\":{\"kind\":\"voxels\",%s}}]}", wrong[i].inside);
    Scene *s = load_text(json, &err);
    CHECK_MSG(!s && strstr(err.text, wrong[i].message) && strstr(err.text, ".json:1:"), "%s: %s", wrong[i].inside, err.text);
    scene_destroy(s);
  }
}

TEST(the_light_through_glass_and_off_gold_is_the_same_on_all_levels)
{
  Err err = {0};
  Scene *s = load_text(tower, &err);
  if (!s) return;
  World *w = world_of(s);
  uint64_t hash = 0;
  for (IsaLevel level = ISA_REF; level <= cpu_best_isa(); level++) {
    Film *film = film_create(32, 24, ALL_PLANES, NULL);
    const RenderJob job = job_of(s, w, pinhole(4, 4, 6, 1.2f, 1.5f, 1.2f, 40), film, 2);
    CHECK(render_run(&job, NULL, hot_table(level), NULL, NULL, NULL));
    if (level == ISA_REF) hash = film_hash(film);
    CHECK(film_hash(film) == hash);
    film_destroy(film);
  }
  world_release(w);
  scene_destroy(s);
}

TEST_MAIN
