// Voxels as smoke: their cells as a density, what passes and what comes back, in closed form and by Chandrasekhar's functions.

#include "tests/render_sample.h"
#include "tests/scene_sample.h"

#include "base/hash.h"
#include "image/grid.h"
#include "scene/edit.h"
#include "shade/albedo.h"
#include "shade/spectrum.h"
#include "world/parts.h"
#include "world/voxelise.h"

static uint32_t draws;

static float random_unit(void)
{
  return unit_float(hash_u32(draws++));
}

// A scene of one object of voxels that the medium "m" fills.
static Scene *smoke_scene(const char *size, const char *cells, const char *medium)
{
  char text[3000];
  Err err;
  snprintf(text, sizeof text, "{ \"rayfold\": 1, \"sky\": { \"kind\": \"constant\", \"color\": 1 },\n\"media\": { \"m\": { %s } },\n"
           "\"objects\": [ { \"name\": \"v\", \"medium\": \"m\", \"shape\": { \"kind\": \"voxels\", \"voxel_size\": 1, \"origin\": \"floor\", \"size\": %s,\n"
           "%s } } ] }", medium, size, cells);
  Scene *s = sample_load(text, &err);
  CHECK_MSG(s, "%s", err.text);
  if (!s) exit(1);
  return s;
}

// At any place the density is 1 in a filled cell, else 0, and never above the bound of the cell that a walk is in.
TEST(the_density_is_the_cells)
{
  Scene *s = smoke_scene("[70, 31, 530]", "\"fill\": [ { \"kind\": \"sphere\", \"center\": [30, 15, 40], \"radius\": 14 }, { \"kind\": \"hills\", "
                         "\"corner\": [0, 0, 400], \"size\": [70, 20, 130] }, { \"kind\": \"box\", \"corner\": [64, 8, 128], \"size\": [6, 8, 64] } ]",
                         "\"kind\": \"homogeneous\"");
  World *w = world_of(s);
  const Voxels *v = s->voxels.items[0].data;
  const Density *d = &w->parts->densities.items[0]->density;
  int filled = 0;
  for (int line = 0; line < 2000; line++) {
    const Vec3 wide = v3(70, 31, 530), o = wide * v3(random_unit(), random_unit(), random_unit());
    const Vec3 dir = v3_normalize(wide * v3(random_unit(), random_unit(), random_unit()) - o);
    DensityWalk walk;
    if (!density_walk(d, o, dir, 0, 1000, &walk)) continue;
    do {
      const float t = walk.t + random_unit() * (density_cell_end(&walk) - walk.t);
      const Vec3 p = o + t * dir;
      const uint32_t entry = voxels_entry(v, (int32_t)floorf(p[0]), (int32_t)floorf(p[1]), (int32_t)floorf(p[2]));
      CHECK(density_at(d, p) == (entry ? 1 : 0) && density_at(d, p) <= density_most(&walk));
      filled += entry != 0;
    } while (density_step(&walk));
  }
  CHECK(filled > 1000);
  world_release(w);
  scene_destroy(s);
}

// Behind cells of different kinds: exp(-chance), whatever their colour.
TEST(what_passes_is_by_the_filled_cells)
{
  Scene *s = smoke_scene("[8, 8, 8]", "\"fill\": [ { \"kind\": \"box\", \"size\": [8, 8, 8], \"color\": [1, 0.5, 0] }, "
                         "{ \"kind\": \"box\", \"corner\": [0, 0, 2], \"size\": [8, 8, 3], \"mode\": \"erase\" } ]",
                         "\"kind\": \"homogeneous\", \"scattering\": 0.1, \"absorption\": 0.2");
  s->render.max_depth = 0;
  const Picture p = picture_seen(s, parallel(0, 4, 50, 0, 4, 0, 2), 16, 64);
  for (int k = 0; k < 3; k++) CHECK_NEAR(p.mean[k], exp(-0.3 * 5), 5 * p.error);
  CHECK(p.error < 0.005);
  scene_destroy(s);
}

// White cells that scatter all: the sky is what is seen, whatever the shape.
TEST(a_white_furnace)
{
  Scene *s = smoke_scene("[24, 24, 24]", "\"fill\": [ { \"kind\": \"sphere\", \"center\": [12, 12, 12], \"radius\": 11, \"color\": 1 }, { \"kind\": \"box\", "
                         "\"corner\": [5, 5, 5], \"size\": [9, 3, 19], \"mode\": \"erase\" } ]", "\"kind\": \"homogeneous\", \"scattering\": 0.3");
  s->render.max_depth = 1000;
  for (int march = 0; march < 2; march++) {
    s->render.volumes = march ? VOLUMES_MARCH : VOLUMES_EXACT;
    const Picture p = picture_seen(s, pinhole(20, 30, 40, 0, 12, 0, 30), 12, 16);
    CHECK_NEAR(p.mean[1], 1, 1e-3 + 5 * p.error);
  }
  scene_destroy(s);
}

// Chandrasekhar's H for scattering all ways alike, at the middles of COUNT parts of [0, 1] ("Radiative Transfer", 1950,
// chapter V: the form that converges for all albedos).
enum { H_COUNT = 200 };
static void chandrasekhar(double albedo, double h[H_COUNT])
{
  for (int i = 0; i < H_COUNT; i++) h[i] = 1;
  for (int round = 0; round < 60; round++)
    for (int i = 0; i < H_COUNT; i++) {
      const double mu = (i + 0.5) / H_COUNT;
      double sum = 0;
      for (int k = 0; k < H_COUNT; k++) {
        const double other = (k + 0.5) / H_COUNT;
        sum += other * h[k] / (mu + other) / H_COUNT;
      }
      h[i] = 1 / (sqrt(1 - albedo) + albedo / 2 * sum);
    }
}

// The formula, against the exact reflectance for light from all sides: 1 - 2 sqrt(1 - a) times the first moment of H.
TEST(albedos_look_like_colours)
{
  for (int i = 0; i <= 10; i++) {
    const double albedo = i / 10.0;
    double h[H_COUNT], moment = 0;
    chandrasekhar(albedo, h);
    for (int k = 0; k < H_COUNT; k++) moment += h[k] * (k + 0.5) / H_COUNT / H_COUNT;
    CHECK_NEAR(reflectance_of_albedo((float)albedo), 1 - 2 * sqrt(1 - albedo) * moment, 0.01);
    CHECK_NEAR(albedo_of_reflectance(reflectance_of_albedo((float)albedo)), albedo, 2e-3);
  }
}

// Thick smoke seen straight on under a white sky, by colour channel: 1 - sqrt(1 - a) H(1).
TEST(thick_smoke_has_the_colours_of_its_cells)
{
  Scene *s = smoke_scene("[64, 64, 64]", "\"fill\": [ { \"kind\": \"box\", \"size\": [64, 64, 64], \"color\": [0.8, 0.3, 0.05] } ]",
                         "\"kind\": \"homogeneous\", \"scattering\": 2");
  s->render.max_depth = 200;
  const float color[3] = {0.8f, 0.3f, 0.05f};
  const Picture p = picture_seen(s, parallel(0, 32, 99, 0, 32, 0, 1), 16, (uint32_t)(TEST_IS_SLOW ? 32 : 128));
  for (int k = 0; k < 3; k++) {
    const double albedo = (double)albedo_of_reflectance(color[k]);
    double h[H_COUNT];
    chandrasekhar(albedo, h);
    CHECK_NEAR(p.mean[k], 1 - sqrt(1 - albedo) * h[H_COUNT - 1], 0.004 + 6 * p.error);
  }
  scene_destroy(s);
}

// Cells that shine: what a slab of them adds is their radiance times 1 - exp(-depth), of the sky behind the rest is left.
TEST(shining_cells_glow)
{
  Scene *s = smoke_scene("[8, 8, 4]", "\"palette\": { \"lamp\": { \"color\": [1, 0.5, 0], \"emission\": 4 } }, "
                         "\"fill\": [ { \"kind\": \"box\", \"size\": [8, 8, 4], \"voxel\": \"lamp\" } ]",
                         "\"kind\": \"homogeneous\", \"scattering\": 0.15, \"absorption\": 0.05");
  const double left = exp(-0.8), glow[3] = {4, 2, 0};
  for (int march = 0; march < 2; march++) {
    s->render.volumes = march ? VOLUMES_MARCH : VOLUMES_EXACT;
    const Picture p = picture_seen(s, parallel(0, 4, 50, 0, 4, 0, 2), 16, 64);
    for (int k = 0; k < 3; k++) CHECK_NEAR(p.mean[k], left + glow[k] * (1 - left), 6 * p.error + 1e-3);
    CHECK(p.error < 0.02);
  }
  scene_destroy(s);
}

static void check_edit_refused(Scene *s, const char *path, const char *json, const char *message)
{
  Err err = {0};
  CHECK(!scene_set(s, path, json, &err));
  CHECK_TEXT(err.text, message);
}

// An edit turns a thing to smoke and back; what makes no sense is refused.
TEST(an_edit_turns_voxels_to_smoke)
{
  Scene *s = smoke_scene("[4, 4, 4]", "\"fill\": [ { \"kind\": \"box\", \"size\": [4, 4, 4] } ]", "\"kind\": \"homogeneous\"");
  World *smoke = world_of(s);
  CHECK(smoke->instance_count == 0 && smoke->media_count == 1);
  Err err = {0};
  CHECK(scene_set(s, "objects.v.medium", "null", &err));
  World *solid = world_of(s);
  CHECK(solid->instance_count == 1 && solid->media_count == 0);
  CHECK(scene_set(s, "materials.paint", "{\"kind\":\"lambert\"}", &err) && scene_set(s, "objects.v.material", "\"paint\"", &err));
  check_edit_refused(s, "objects.v.medium", "\"m\"", "leave out the material");
  CHECK(scene_set(s, "objects.v.material", "null", &err) && scene_set(s, "objects.v.medium", "\"m\"", &err));
  CHECK(scene_set(s, "media.m", "{\"kind\":\"ball\"}", &err));
  CHECK(!world_prepare(s, NULL, NULL, NULL, NULL, &err));
  CHECK_TEXT(err.text, "give them a homogeneous one");
  world_release(smoke);
  world_release(solid);
  scene_destroy(s);
}

// The next world has the same density of the same cells, another one after a stroke.
TEST(the_next_world_shares_smoke)
{
  Scene *s = smoke_scene("[4, 4, 4]", "\"fill\": [ { \"kind\": \"box\", \"size\": [4, 4, 4] } ]", "\"kind\": \"homogeneous\"");
  Err err = {0};
  World *first = world_of(s);
  CHECK(scene_set(s, "media.m.density", "3", &err));
  World *second = world_prepare(s, first, NULL, NULL, NULL, &err);
  CHECK(scene_set(s, "objects.v.shape.stroke", "{\"kind\":\"box\",\"mode\":\"erase\"}", &err));
  World *third = world_prepare(s, second, NULL, NULL, NULL, &err);
  CHECK(first->parts->densities.items[0] == second->parts->densities.items[0] &&
        second->parts->densities.items[0] != third->parts->densities.items[0]);
  world_release(first);
  world_release(second);
  world_release(third);
  scene_destroy(s);
}

// --- to grids and back -----------------------------------------------------------------------------------
static bool are_equal(const Voxels *a, const Voxels *b)
{
  for (int k = 0; k < 3; k++)
    if (a->hi[k] - a->lo[k] != b->hi[k] - b->lo[k]) return false;
  for (int32_t z = 0; z < a->hi[2] - a->lo[2]; z++)
    for (int32_t y = 0; y < a->hi[1] - a->lo[1]; y++)
      for (int32_t x = 0; x < a->hi[0] - a->lo[0]; x++)
        if (!voxels_entry(a, a->lo[0] + x, a->lo[1] + y, a->lo[2] + z) != !voxels_entry(b, b->lo[0] + x, b->lo[1] + y, b->lo[2] + z))
          return false;
  return true;
}

static const char lump[] = "\"fill\": [ { \"kind\": \"sphere\", \"center\": [9, 8, 12], \"radius\": 7.3, \"color\": [0.8, 0.4, 0.2] }, "
                           "{ \"kind\": \"hills\", \"size\": [21, 9, 17], \"color\": [0.2, 0.6, 0.2] } ]";

// Smoke made solid has the cells it had, and their colours.
TEST(smoke_and_back_is_the_same)
{
  Scene *s = smoke_scene("[21, 20, 23]", lump, "\"kind\": \"homogeneous\"");
  const Voxels *before = s->voxels.items[0].data;
  World *w = world_of(s);
  float cell, corner[3];
  Err err = {0};
  Voxels *after = world_voxelise(w, 0, true, 0.5f, &cell, corner, &err);
  CHECK_MSG(after, "%s", err.text);
  if (after) {
    CHECK(after->cell_count == before->cell_count && are_equal(before, after));
    CHECK_NEAR(cell, 1, 1e-5);
    int wrong = 0;
    for (int32_t z = 0; z < after->size[2]; z++)
      for (int32_t y = 0; y < after->size[1]; y++)
        for (int32_t x = 0; x < after->size[0]; x++) {
          const VoxelEntry *a = &after->palette->entries[voxels_entry(after, x, y, z)];
          const VoxelEntry *b = &before->palette->entries[voxels_entry(before, before->lo[0] + x, before->lo[1] + y, before->lo[2] + z)];
          for (int k = 0; k < 3; k++) wrong += a->color[k] != b->color[k];
        }
    CHECK(wrong == 0);
  }
  voxels_release(after);
  world_release(w);
  scene_destroy(s);
}

// A grid of voxels holds a 1 for each, so that its values mixed add up to their volume; and comes back cell by cell.
TEST(a_grid_and_back_is_the_same)
{
  Scene *s = smoke_scene("[21, 20, 23]", lump, "\"kind\": \"homogeneous\"");
  const Voxels *before = s->voxels.items[0].data;
  const char *path = sample_path("lump.grid");
  Err err = {0};
  Grid g;
  CHECK_MSG(export_grid(before, 0.25, path, &err) && grid_read(&g, path, &err), "%s", err.text);
  double sum = 0;
  for (size_t i = 0; i < (size_t)g.size[0] * g.size[1] * g.size[2]; i++) sum += (double)g.values[i];
  CHECK_NEAR(sum, (double)before->cell_count, 0);
  CHECK_NEAR((g.hi[0] - g.lo[0]) / (float)g.size[0], 0.25, 1e-6);
  grid_finish(&g);
  Scene *made = scene_load(path, NULL, &err);
  CHECK_MSG(made, "%s", err.text);
  World *w = made ? world_of(made) : NULL;
  float cell = 0, corner[3];
  Voxels *after = w ? world_voxelise(w, 0, true, 0.5f, &cell, corner, &err) : NULL;
  CHECK_MSG(after && are_equal(before, after), "%s", err.text);
  CHECK_NEAR(cell, 0.25, 1e-5);
  Voxels *none = w ? world_voxelise(w, 20, true, 1e9f, &cell, corner, &err) : NULL;
  CHECK(none && none->cell_count == 0);
  voxels_release(none);
  voxels_release(after);
  world_release(w);
  scene_destroy(made);
  scene_destroy(s);
}

// --- heat ---------------------------------------------------------------------------------------------------
// Chromaticities of the Planckian locus: 2000 K, 2856 K (illuminant A, CIE 15:2004) and 6500 K. The observer is a fit, good to
// 0.004.
TEST(black_bodies_have_their_colours)
{
  static BlackBody b;
  black_body_make(&b);
  const double known[3][3] = {{2000, 0.5267, 0.4133}, {2856, 0.4476, 0.4074}, {6500, 0.3135, 0.3237}};
  for (int i = 0; i < 3; i++) {
    const Vec3 c = black_body_at(&b, (float)known[i][0]);
    const double r = (double)c[0], g = (double)c[1], bl = (double)c[2];
    const double x = 0.4124 * r + 0.3576 * g + 0.1805 * bl, y = 0.2126 * r + 0.7152 * g + 0.0722 * bl, z = 0.0193 * r + 0.1192 * g + 0.9505 * bl;
    CHECK_NEAR(x / (x + y + z), known[i][1], 0.004);
    CHECK_NEAR(y / (x + y + z), known[i][2], 0.004);
  }
  // Wien: at a peak of 555 nm (5221 K) the luminance of the spectrum over its peak is a little below 1.
  const Vec3 c = black_body_at(&b, 5221);
  CHECK_NEAR(luminance(c), 0.97, 0.03);
}

// A slab that only absorbs and is hot shines by Kirchhoff's law: (1 - exp(-depth)) times the black body.
TEST(what_absorbs_glows)
{
  static BlackBody b;
  black_body_make(&b);
  const Vec3 color = 3 * black_body_at(&b, 2500);
  const double left = exp(-0.2 * 4);
  for (int kind = 0; kind < 3; kind++) { // in cells; by steps; the same everywhere, without any
    Scene *s = smoke_scene("[8, 8, 4]", "\"fill\": [ { \"kind\": \"box\", \"size\": [8, 8, 4] } ]",
                           "\"kind\": \"homogeneous\", \"scattering\": 0, \"absorption\": 0.2, \"temperature\": 2500, \"glow\": 3");
    if (kind == 1) s->render.volumes = VOLUMES_MARCH;
    if (kind == 2) {
      Object *o = &s->objects.items[0];
      o->shape = (Shape){.kind = SHAPE_BOX, .box = {{8, 8, 4}}};
      o->common.translate[1] = 4;
    }
    const Picture p = picture_seen(s, parallel(0, 4, 50, 0, 4, 0, 2), 16, 64);
    for (int k = 0; k < 3; k++) CHECK_NEAR(p.mean[k], left + (double)color[k] * (1 - left), 6 * p.error + 2e-3);
    scene_destroy(s);
  }
}

// Of a file of heat, two values mixed: in the middle of the box it is the mean of them.
TEST(heat_comes_from_a_file)
{
  const char head[] = "rayfold-grid 1\nsize 1 1 1\nbox -1 -1 -1 1 1 1\ndata float32\n", heat_head[] = "rayfold-grid 1\nsize 2 1 1\nbox -1 -1 -1 1 1 1\ndata float32\n";
  const float one[1] = {1}, heat[2] = {1100, 4100};
  char bytes[200];
  memcpy(bytes, head, sizeof head - 1);
  memcpy(bytes + sizeof head - 1, one, 4);
  sample_write("one.grid", bytes, sizeof head - 1 + 4);
  memcpy(bytes, heat_head, sizeof heat_head - 1);
  memcpy(bytes + sizeof heat_head - 1, heat, 8);
  sample_write("heat.grid", bytes, sizeof heat_head - 1 + 8);
  Err err;
  Scene *s = sample_load("{ \"rayfold\": 1, \"sky\": { \"kind\": \"constant\", \"color\": 0 }, \"media\": { \"m\": { \"kind\": \"grid\", "
                         "\"file\": \"one.grid\", \"heat\": \"heat.grid\", \"heat_offset\": 100, \"temperature\": 1.25, \"scattering\": 0, "
                         "\"absorption\": 0.5 } }, \"objects\": [ { \"shape\": { \"kind\": \"box\", \"size\": [2, 2, 2] }, \"medium\": \"m\" } ] }", &err);
  CHECK_MSG(s, "%s", err.text);
  static BlackBody b;
  black_body_make(&b);
  const Vec3 color = black_body_at(&b, 1.25f * (2600 - 100));
  const Picture p = picture_seen(s, parallel(0, 0, 9, 0, 0, 0, 1e-3f), 16, 64);
  for (int k = 0; k < 3; k++) CHECK_NEAR(p.mean[k], (1 - exp(-1)) * (double)color[k], 6 * p.error + 2e-3);
  scene_destroy(s);
  s = sample_load("{ \"rayfold\": 1, \"media\": { \"m\": { \"kind\": \"grid\", \"file\": \"one.grid\", \"heat\": \"none.grid\" } } }", &err);
  CHECK(s && !world_prepare(s, NULL, NULL, NULL, NULL, &err));
  CHECK_TEXT(err.text, "none.grid");
  scene_destroy(s);
}

TEST(clean_up)
{
  sample_remove();
}

TEST_MAIN
