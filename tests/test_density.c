// Densities: files of grids, sound and hostile, and the bounds that light is followed by.

#include "tests/test.h"

#include "tests/scene_sample.h"

#include "base/hash.h"
#include "base/mem.h"
#include "image/grid.h"
#include "world/parts.h"
#include "world/world.h"

// --- files ------------------------------------------------------------------------------------------

static bool read_text(const char *head, const void *values, size_t size, Grid *g, Err *err)
{
  char bytes[2000];
  const size_t n = strlen(head);
  memcpy(bytes, head, n);
  if (size) memcpy(bytes + n, values, size);
  *err = (Err){0};
  return grid_read(g, sample_write("a.grid", bytes, n + size), err);
}

TEST(a_grid_is_read)
{
  const float values[6] = {0, 1, 2, 3, 4, 5};
  const uint8_t bytes[4] = {0, 51, 255, 102};
  Grid g;
  Err err;
  CHECK_MSG(read_text("rayfold-grid 1\nsize 3 2 1\nbox -1 0 2 1 1 2.5\ndata float32\n", values, sizeof values, &g, &err), "%s",
            err.text);
  CHECK(g.size[0] == 3 && g.size[1] == 2 && g.size[2] == 1 && g.lo[0] == -1 && g.hi[2] == 2.5f && g.values[5] == 5);
  grid_finish(&g);
  CHECK_MSG(read_text("rayfold-grid 1\nsize 4 1 1\ndata uint8\n", bytes, sizeof bytes, &g, &err), "%s", err.text);
  CHECK(g.hi[0] == 0.5f && g.lo[1] == -0.125f && g.values[1] == 0.2f && g.values[2] == 1);
  grid_finish(&g);
}

TEST(hostile_grids_are_refused)
{
  const float bad[2][2] = {{1, -1}, {1, NAN}};
  const struct {
    const char *head, *message;
  } cases[] = {
      {"", "is no grid"},
      {"rayfold-grid 2\n", "is no grid"},
      {"rayfold-grid 1\nsize 2 1 1\n", "cut off"},
      {"rayfold-grid 1\nsize 2 1\ndata float32\n", "unknown"},
      {"rayfold-grid 1\nsize 0 1 1\ndata float32\n", "must be 1 to"},
      {"rayfold-grid 1\nsize 4294967295 1 1\ndata float32\n", "must be 1 to"},
      {"rayfold-grid 1\nsize 4096 4096 4096\ndata float32\n", "needs 274.9 GB"},
      {"rayfold-grid 1\nsize 3 1 1\ndata float32\n", "take 12 bytes, but 8 follow"},
      {"rayfold-grid 1\nsize 2 1 1\nbox 0 0 0 1 0 1\ndata float32\n", "no inside"},
      {"rayfold-grid 1\nsize 2 1 1\nbox 0 0 0 1 nan 1\ndata float32\n", "no inside"},
      {"rayfold-grid 1\nsize 2 1 1\ndata float64\n", "unknown"},
  };
  Grid g;
  Err err;
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    CHECK_MSG(!read_text(cases[i].head, bad[0], 8, &g, &err), "%s", cases[i].head);
    CHECK_TEXT(err.text, cases[i].message);
    CHECK(!g.values);
  }
  for (int i = 0; i < 2; i++) {
    CHECK(!read_text("rayfold-grid 1\nsize 2 1 1\ndata float32\n", bad[i], 8, &g, &err));
    CHECK_TEXT(err.text, "value at (1, 0, 0)");
  }
}

// Random bytes behind the right first ones: an error or a grid, never more.
TEST(hostile_nvdb_files_do_no_harm)
{
  static uint8_t bytes[4096];
  for (uint32_t round = 0; round < 300; round++) {
    for (uint32_t i = 0; i < sizeof bytes; i++) bytes[i] = (uint8_t)(round % 3 == 0 ? 0 : hash_combine(round, i));
    memcpy(bytes, "NanoVDB0", 8);
    bytes[12] = 1, bytes[13] = bytes[14] = bytes[15] = 0;
    const uint64_t size = sizeof bytes - 192;
    memcpy(bytes + 16, &size, 8);
    const uint32_t type = 1, name = 0;
    memcpy(bytes + 16 + 32, &type, 4);
    memcpy(bytes + 16 + 136, &name, 4);
    memcpy(bytes + 192 + 636, &type, 4);
    Grid g;
    Err err = {0};
    if (grid_read(&g, sample_write("a.nvdb", bytes, round % 7 ? sizeof bytes : hash_u32(round) % sizeof bytes), &err))
      grid_finish(&g);
    else
      CHECK(err.kind && err.text[0]);
  }
}

static void check_refused(const char *media, const char *object, const char *message)
{
  char text[600];
  Err err;
  snprintf(text, sizeof text, "{ \"rayfold\": 1, \"media\": { \"m\": { %s } },\n\"objects\": [ { %s } ] }", media, object);
  Scene *s = sample_load(text, &err);
  CHECK_MSG(!s, "%s", text);
  scene_destroy(s);
  CHECK_TEXT(err.text, message);
}

TEST(media_are_refused_with_their_place)
{
  const char *fog = "\"kind\": \"homogeneous\"", *ball = "\"shape\": { \"kind\": \"sphere\" }, \"medium\": \"m\"";
  check_refused("\"kind\": \"grid\"", ball, "1:33: a medium of kind \"grid\" needs a \"file\"");
  check_refused("\"kind\": \"mist\"", ball, "homogeneous");
  check_refused("\"kind\": \"homogeneous\", \"anisotropy\": 2", ball, "must be between -1 and 1");
  check_refused("\"kind\": \"cloud\", \"resolution\": 100000", ball, "between 4 and 1024");
  check_refused(fog, "\"shape\": { \"kind\": \"quad\" }, \"medium\": \"m\"", "2:55: only a sphere, a box, a mesh or voxels can be filled");
  check_refused(fog, "\"shape\": { \"kind\": \"sphere\" }, \"medium\": \"n\"", "\"n\"");
}

// --- bounds -----------------------------------------------------------------------------------------

static uint32_t draws;

static float random_unit(void)
{
  return unit_float(hash_u32(draws++));
}

static Density *density_of(World *w)
{
  return &w->parts->densities.items[0]->density;
}

static World *world_with(MediumKind kind, Scene **s)
{
  Err err = {0};
  *s = scene_create(NULL);
  const int32_t i = scene_add_medium(*s, kind, "m");
  Medium *m = &(*s)->media.items[i];
  if (kind == MEDIUM_BALL) m->ball.waves = 23;
  if (kind == MEDIUM_CLOUD) m->cloud.resolution = 40;
  if (kind == MEDIUM_WISPS) m->wisps.resolution = 40;
  World *w = world_prepare(*s, NULL, NULL, NULL, NULL, &err);
  CHECK_MSG(w, "%s", err.text);
  return w;
}

// No density is above the bound of the cell that a walk says it is in, and a walk covers its line without a gap.
TEST(bounds_hold_along_every_line)
{
  for (int kind = MEDIUM_BALL; kind <= MEDIUM_WISPS; kind++) {
    Scene *s;
    World *w = world_with((MediumKind)kind, &s);
    const Density *d = density_of(w);
    double sum = 0, bound = 0;
    for (int line = 0; line < 300; line++) {
      Vec3 o = v3_all(0), dir = v3_all(0);
      for (int k = 0; k < 3; k++) {
        o[k] = 4 * random_unit() - 2;
        dir[k] = line % 5 == k ? 0 : d->lo[k] + random_unit() * (d->hi[k] - d->lo[k]) - o[k];
      }
      dir = v3_normalize(dir);
      DensityWalk walk;
      if (!density_walk(d, o, dir, 0, 10, &walk)) continue;
      float at = walk.t;
      do {
        CHECK(walk.t == at);
        const float end = density_cell_end(&walk);
        for (int i = 0; i < 4; i++) {
          const float t = at + random_unit() * (end - at), here = density_at(d, o + t * dir);
          CHECK_MSG(here >= 0 && here <= density_most(&walk), "kind %d: %.6g above %.6g", kind, (double)here,
                    (double)density_most(&walk));
          sum += (double)here;
          bound += (double)density_most(&walk);
        }
        at = end;
      } while (density_step(&walk));
      CHECK_NEAR(at, walk.end, 1e-4);
    }
    printf("  kind %d: density is %.0f %% of its bound\n", kind, 100 * sum / bound);
    CHECK(sum > 0.05 * bound);
    world_release(w);
    scene_destroy(s);
  }
}

TEST(the_next_world_shares_densities)
{
  Scene *s;
  Err err = {0};
  World *first = world_with(MEDIUM_CLOUD, &s);
  s->media.items[0].common.density = 3;
  World *second = world_prepare(s, first, NULL, NULL, NULL, &err);
  s->media.items[0].cloud.seed = 2;
  World *third = world_prepare(s, second, NULL, NULL, NULL, &err);
  CHECK(density_of(first) == density_of(second) && density_of(second) != density_of(third));
  world_release(first);
  world_release(second);
  world_release(third);
  scene_destroy(s);
}

TEST(clean_up)
{
  sample_remove();
}

TEST_MAIN
