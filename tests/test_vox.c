// MagicaVoxel files: written and read back, placed and turned by a scene graph, cut short at every byte and with bytes
// changed; and strokes of a brush as edits of a scene, with undo.

#include "tests/test.h"

#include "base/file.h"
#include "base/hash.h"
#include "rayfold/rayfold.h"
#include "scene/edit.h"
#include "scene/vox.h"

#include <stdlib.h>
#include <time.h>
#include <unistd.h>

static const char path[] = "/tmp/rayfold-test-vox.vox";

static uint32_t state = 1;
static uint32_t rnd(uint32_t n)
{
  state += 0x9e3779b9u;
  return hash_u32(state) % n;
}

static Voxels *sample(int32_t x, int32_t y, int32_t z, int entries, int cells)
{
  VoxelEdit *e = voxel_edit_create((int32_t[]){x, y, z}, NULL);
  for (int i = 0; i < entries; i++) {
    VoxelLook look = voxel_look_plain();
    if (i == 1) look.metallic = 1, look.roughness = 0.25f;
    if (i == 2) look.transmission = 1, look.ior = 1.25f;
    if (i == 3) look.emission = 20;
    // Colours that eight bits hold exactly.
    const float color[3] = {(float)(i & 15) / 15, (float)(i >> 4 & 15) / 15, i > 255 ? 1 : 0};
    (void)voxel_edit_color(e, color, (uint32_t)voxel_edit_look(e, &look));
  }
  for (int i = 0; i < cells; i++)
    (void)voxel_edit_put(e, (int32_t)rnd((uint32_t)x), (int32_t)rnd((uint32_t)y), (int32_t)rnd((uint32_t)z), 1 + rnd((uint32_t)entries));
  (void)voxel_edit_put(e, 0, 0, 0, 1); // corners, so that nothing is cut off
  (void)voxel_edit_put(e, x - 1, y - 1, z - 1, 1);
  return voxel_edit_end(e, NULL);
}

// Do two cells have the same colour and look?
static bool is_alike(const Voxels *a, uint32_t i, const Voxels *b, uint32_t j)
{
  if (!i || !j) return i == j;
  const VoxelEntry *x = &a->palette->entries[i], *y = &b->palette->entries[j];
  const VoxelLook *l = &a->palette->looks[x->look], *m = &b->palette->looks[y->look];
  float off = 0;
  for (int k = 0; k < 3; k++) off = fmaxf(off, fabsf(x->color[k] - y->color[k]));
  return off < 0.01f && fabsf(l->metallic - m->metallic) < 1e-3f && fabsf(l->transmission - m->transmission) < 1e-3f &&
         fabsf(l->emission - m->emission) < 1e-3f * (1 + l->emission);
}

static int differences(const Voxels *a, const Voxels *b)
{
  int wrong = 0;
  for (int k = 0; k < 3; k++) wrong += a->size[k] != b->size[k];
  for (int32_t z = 0; z < a->size[2]; z++)
    for (int32_t y = 0; y < a->size[1]; y++)
      for (int32_t x = 0; x < a->size[0]; x++) wrong += !is_alike(a, voxels_entry(a, x, y, z), b, voxels_entry(b, x, y, z));
  return wrong;
}

static Voxels *read_merged(const char *name, Err *err)
{
  FileBytes bytes;
  VoxFile f;
  Voxels *v = NULL;
  if (!file_read(&bytes, name, err)) return NULL;
  if (vox_read(&f, name, (Span){bytes.data, bytes.size}, err)) {
    v = vox_merge(&f, name, NULL, err);
    vox_finish(&f);
  }
  file_release(&bytes);
  return v;
}

// One model and many pieces, all kinds of materials.
TEST(what_is_written_is_read)
{
  static const int32_t sizes[3][3] = {{9, 20, 33}, {1, 1, 1}, {300, 20, 270}};
  for (int i = 0; i < 3; i++) {
    Err err = {0};
    uint32_t reduced = 7;
    Voxels *v = sample(sizes[i][0], sizes[i][1], sizes[i][2], i == 1 ? 1 : 200, 2000);
    CHECK_MSG(vox_write(v, path, &reduced, &err), "%s", err.text);
    CHECK(reduced == 0);
    Voxels *back = read_merged(path, &err);
    CHECK_MSG(back && differences(v, back) == 0, "grid %d: %s", i, err.text);
    voxels_release(v);
    voxels_release(back);
  }
  // More than 255 kinds are reduced, and said to be.
  uint32_t reduced = 0;
  Voxels *many = sample(30, 30, 30, 400, 20000);
  CHECK(vox_write(many, path, &reduced, NULL) && reduced == 400);
  voxels_release(many);
}

// As objects of a scene each model comes out where the merged grid has it, whatever the turns.
TEST(turns_by_quarters)
{
  static const uint8_t turns[6] = {4, 17, 2 | 1 << 2 | 1 << 4, 1 | 2 << 2, 0 | 2 << 2 | 7 << 4, 2 | 0 << 2 | 5 << 4};
  for (int i = 0; i < 6; i++) {
    const uint8_t cells[] = {0, 0, 0, 1, 2, 0, 0, 2, 0, 4, 6, 3, 2, 4, 6, 4};
    VoxFile f = {0};
    const VoxModel m = {{3, 5, 7}, cells, 4};
    VoxPlace p = {.at = {10, 20, 30}};
    p.axis[0] = (int8_t)(turns[i] & 3), p.axis[1] = (int8_t)(turns[i] >> 2 & 3), p.axis[2] = (int8_t)(3 - p.axis[0] - p.axis[1]);
    for (int k = 0; k < 3; k++) p.sign[k] = turns[i] >> (4 + k) & 1 ? -1 : 1;
    for (int c = 0; c < 256; c++) f.looks[c] = voxel_look_plain(), f.colors[c][0] = (uint8_t)c;
    CHECK(array_push(&f.models, m) && array_push(&f.places, p));
    int32_t corner[3];
    Voxels *v = vox_merge(&f, "a test", corner, NULL);
    CHECK(v && v->cell_count == 4);
    for (int n = 0; v && n < 4; n++) { // the formula of the format's page: turn (cell - middle) plus place
      int32_t w[3];
      for (int k = 0; k < 3; k++) {
        const int j = p.axis[k];
        const int32_t at = cells[4 * n + j] - m.size[j] / 2;
        w[k] = (int32_t)p.at[k] + (p.sign[k] > 0 ? at : -at - 1);
      }
      const uint32_t entry = voxels_entry(v, w[0] - corner[0], w[2] - corner[1], -w[1] - 1 - corner[2]);
      CHECK_MSG(entry && v->palette->entries[entry].name[0] == (char)('0' + cells[4 * n + 3]), "turn %d, cell %d", i, n);
    }
    voxels_release(v);
    vox_finish(&f);
  }
}

TEST(broken_files_are_refused_with_their_place)
{
  uint32_t reduced;
  Voxels *v = sample(9, 20, 33, 20, 300);
  CHECK(vox_write(v, path, &reduced, NULL));
  voxels_release(v);
  FileBytes bytes;
  if (!file_read(&bytes, path, NULL)) return;
  uint8_t *copy = malloc(bytes.size);
  VoxFile f;
  int refused = 0;
  const size_t step = TEST_IS_SLOW ? 7 : 1;
  for (size_t n = 0; n < bytes.size; n += step) { // cut short, in memory of just that size
    uint8_t *part = malloc(n ? n : 1);
    memcpy(part, bytes.data, n);
    Err err = {0};
    if (!vox_read(&f, "cut.vox", (Span){part, n}, &err)) {
      refused++;
      CHECK_MSG(strstr(err.text, "cut.vox: byte "), "%s", err.text);
    } else {
      vox_finish(&f);
    }
    free(part);
  }
  CHECK(refused > (int)(bytes.size / step) - 60); // all but cuts between chunks
  for (int n = 0; n < (TEST_IS_SLOW ? 500 : 3000) * (int)fmin(test_intensity(), 100); n++) {
    memcpy(copy, bytes.data, bytes.size);
    for (uint32_t k = 0; k <= rnd(4); k++) copy[rnd((uint32_t)bytes.size)] = (uint8_t)(rnd(3) ? rnd(256) : 255);
    Err err = {0};
    if (!vox_read(&f, "bad.vox", (Span){copy, bytes.size}, &err)) continue;
    Voxels *merged = vox_merge(&f, "bad.vox", NULL, &err);
    voxels_release(merged);
    vox_finish(&f);
  }
  free(copy);
  file_release(&bytes);
}

// --- strokes ------------------------------------------------------------------------------------------------------
static const char castle[] =
    "{\"rayfold\":1,\"objects\":[{\"name\":\"castle\",\"shape\":{\"kind\":\"voxels\",\"voxel_size\":1,\"size\":[64,64,64],"
    "\"palette\":{\"stone\":{\"color\":0.5}},\"fill\":[{\"kind\":\"box\",\"size\":[64,10,64],\"voxel\":\"stone\"}]}}]}";

static const char *error_of(rf_engine *e)
{
  const char *text = "";
  rf_error(e, &text);
  return text ? text : "";
}

static rf_scene *load_castle(rf_engine *e)
{
  const char *file = "/tmp/rayfold-test-castle.json";
  CHECK(file_write_whole(file, castle, strlen(castle), NULL));
  return rf_scene_load(e, file, NULL);
}

static bool pick(rf_engine *e, rf_scene *s, float x, float y, float z, rf_voxel *out)
{
  rf_world *w = rf_prepare(s, NULL);
  const rf_ray ray = {{x, y, z}, 0, {0.01f, -1, 0.02f}, 1e9f};
  rf_hit hit;
  (void)e;
  const bool ok = w && rf_intersect(w, &ray, &hit) && rf_voxel_at(w, &ray, &hit, out);
  rf_world_destroy(w);
  return ok;
}

TEST(strokes_are_edits_with_undo)
{
  rf_engine *e = rf_engine_create(NULL);
  rf_scene *s = load_castle(e);
  CHECK_MSG(s, "%s", error_of(e));
  if (!s) return;
  static const char *const at = "objects.castle.shape.stroke";
  char *first = strdup(rf_get(s, "objects.castle"));
  rf_voxel v;
  CHECK(pick(e, s, 20.5f, 50, 20.5f, &v));
  CHECK(v.cell[0] == 20 && v.cell[1] == 9 && v.cell[2] == 21 && v.face == 3 && v.beside[1] == 10 && !strcmp(v.name, "stone"));
  CHECK(rf_set(s, at, "{\"kind\":\"sphere\",\"center\":[20.5,10.5,21.5],\"radius\":4,\"mode\":\"add\",\"color\":\"#ff0000\"}"));
  CHECK(pick(e, s, 20.5f, 50, 20.5f, &v) && v.cell[1] == 14 && !v.name && v.color[0] > 0.99f && v.color[1] < 0.01f);
  CHECK(rf_set(s, at, "[{\"kind\":\"extrude\",\"at\":[50,9,50],\"face\":\"+y\",\"amount\":3},"
                      "{\"kind\":\"box\",\"corner\":[40,0,40],\"size\":[4,20,4],\"mode\":\"erase\"}]"));
  CHECK(pick(e, s, 50.5f, 50, 50.5f, &v) && v.cell[1] == 12);
  CHECK(!pick(e, s, 41.2f, 50, 41.2f, &v));
  CHECK(rf_set(s, at, "{\"kind\":\"replace\",\"what\":\"stone\",\"color\":\"#00ff00\"}"));
  CHECK(pick(e, s, 5.5f, 50, 5.5f, &v) && v.color[1] > 0.99f);
  char *last = strdup(rf_get(s, "objects.castle"));
  // Refused with a sentence, and nothing is changed.
  CHECK(!rf_set(s, at, "{\"kind\":\"box\",\"corner\":[70,0,0],\"size\":3}"));
  CHECK_TEXT(error_of(e), "touches no cell of the grid of 64 x 64 x 64");
  CHECK(!rf_set(s, at, "{\"kind\":\"box\",\"voxel\":\"wood\"}"));
  CHECK_TEXT(error_of(e), "no \"wood\" in the palette");
  CHECK(!strcmp(rf_get(s, "objects.castle"), last));
  for (int i = 0; i < 3; i++) CHECK(rf_undo(s));
  CHECK(!strcmp(rf_get(s, "objects.castle"), first));
  CHECK(pick(e, s, 20.5f, 50, 20.5f, &v) && v.cell[1] == 9);
  for (int i = 0; i < 3; i++) CHECK(rf_redo(s));
  CHECK(!strcmp(rf_get(s, "objects.castle"), last));
  CHECK(pick(e, s, 5.5f, 50, 5.5f, &v) && v.color[1] > 0.99f);
  // Saved as the program with the strokes behind it, and as a .vox; both show the same cells.
  CHECK(rf_scene_save(s, "/tmp/rayfold-test-castle2.json") && rf_scene_save(s, path));
  rf_scene *again = rf_scene_load(e, "/tmp/rayfold-test-castle2.json", NULL);
  CHECK(again && pick(e, again, 50.5f, 50, 50.5f, &v) && v.cell[1] == 12 && v.color[1] > 0.99f);
  CHECK(again && !strcmp(rf_get(again, "objects.castle"), last));
  rf_scene *vox = rf_scene_load(e, path, NULL);
  CHECK_MSG(vox, "%s", error_of(e));
  rf_scene_destroy(vox);
  rf_scene_destroy(again);
  free(first);
  free(last);
  rf_scene_destroy(s);
  rf_engine_destroy(e);
}

// Promise: a stroke on 512^3 cells shows in 30 ms; this is the part before rays, in processor time, least of some.
TEST(a_stroke_on_a_large_grid_takes_little)
{
  rf_engine *e = rf_engine_create(NULL);
  static const char big[] =
      "{\"rayfold\":1,\"objects\":[{\"name\":\"land\",\"shape\":{\"kind\":\"voxels\",\"size\":[512,512,512],\"fill\":["
      "{\"kind\":\"hills\",\"size\":[512,100,512],\"lump\":128,\"octaves\":6}]}}]}";
  const char *file = "/tmp/rayfold-test-castle.json";
  CHECK(file_write_whole(file, big, strlen(big), NULL));
  rf_scene *s = rf_scene_load(e, file, NULL);
  rf_world *w = s ? rf_prepare(s, NULL) : NULL;
  CHECK_MSG(w, "%s", error_of(e));
  double best = 1e9;
  for (int i = 0; w && i < 5; i++) {
    char step[160];
    snprintf(step, sizeof step, "{\"kind\":\"sphere\",\"center\":[%d,60,250],\"radius\":8,\"color\":\"#ff0000\"}", 100 + 40 * i);
    const clock_t begin = clock();
    CHECK(rf_set(s, "objects.land.shape.stroke", step));
    rf_world *next = rf_prepare(s, w);
    const double seconds = (double)(clock() - begin) / CLOCKS_PER_SEC;
    if (seconds < best) best = seconds;
    rf_world_destroy(w);
    w = next;
  }
  CHECK_MSG(best < (TEST_IS_SLOW ? 0.3 : 0.03), "%.1f ms", 1000 * best);
  if (getenv("SHOW")) printf("a stroke: %.2f ms\n", 1000 * best);
  rf_world_destroy(w);
  rf_scene_destroy(s);
  rf_engine_destroy(e);
}

TEST(clean_up)
{
  CHECK(unlink(path) == 0);
  CHECK(unlink("/tmp/rayfold-test-castle.json") == 0);
  CHECK(unlink("/tmp/rayfold-test-castle2.json") == 0);
}

TEST_MAIN
