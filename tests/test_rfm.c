// Saved models: the same picture as from the model, one message for each way a file can be wrong, and nothing that a
// file with right checksums but hostile content may do.

#include "accel/tree.h"
#include "tests/fuzz.h"
#include "tests/saved_model.h"

#include "accel/saved_tree.h"

static const char *const files[] = {
    "sheet.obj", "sheet.mtl",       "paper.png",   "quads.gltf", "quads.bin",   "out.rfm",  "again.rfm",
    "wrong.rfm", "whole/inner.rfm", "places.json", "places.rfm", "old/out.rfm", "copy.json"};

static rf_engine *engine(int threads)
{
  rf_engine_def def = rf_default_engine_def();
  def.threads = threads;
  return rf_engine_create(&def);
}

// --- the same picture -------------------------------------------------------------------------------
static void check_round_trip(rf_engine *e, const char *model)
{
  const uint64_t hash = saved_hash(e, model, false);
  saved_convert(e, model, model_path("out.rfm"));
  CHECK_MSG(saved_hash(e, model_path("out.rfm"), false) == hash, "%s", model);
  saved_convert(e, model_path("out.rfm"), model_path("again.rfm"));
  CHECK_MSG(saved_hash(e, model_path("again.rfm"), false) == hash, "%s, saved twice", model);
  FileBytes a, b;
  Err err = {0};
  CHECK(file_read(&a, model_path("out.rfm"), &err) && file_read(&b, model_path("again.rfm"), &err));
  CHECK_MSG(a.size == b.size && !memcmp(a.data, b.data, a.size), "%s: saved twice gives other bytes", model);
  file_release(&a);
  file_release(&b);
}

TEST(saved_models_show_what_the_model_shows)
{
  rf_engine *e = engine(2), *alone = engine(1);
  check_round_trip(e, saved_write_obj(9));
  check_round_trip(e, saved_write_gltf());
  check_round_trip(e, "tests/data/blender.obj");
  check_round_trip(e, "tests/data/assimp.ply");
  check_round_trip(e, "tests/data/gltf/assimp_pyramid.glb");
  check_round_trip(e, "scenes/cornell.json");
  saved_convert(e, saved_write_obj(60), model_path("out.rfm")); // as large as a mapped one
  const uint64_t hash = saved_hash(e, model_path("sheet.obj"), false);
  CHECK(saved_hash(e, model_path("out.rfm"), false) == hash);
  CHECK(saved_hash(alone, model_path("out.rfm"), false) == hash);
  rf_engine_destroy(e);
  rf_engine_destroy(alone);
}

// Pictures beside the new file stay there; from elsewhere they come along, and the file stands for itself.
TEST(a_saved_model_elsewhere_brings_its_pictures)
{
  rf_engine *e = engine(1);
  const uint64_t hash = saved_hash(e, saved_write_gltf(), false);
  mkdir(model_path("whole"), 0777);
  saved_convert(e, model_path("quads.gltf"), model_path("whole/inner.rfm"));
  saved_convert(e, model_path("quads.gltf"), model_path("out.rfm"));
  unlink(model_path("paper.png"));
  CHECK(saved_hash(e, model_path("whole/inner.rfm"), false) == hash);
  RfmFile f;
  Err err = {0};
  size_t pictures = 0, textures = 0;
  CHECK(rfm_open(&f, model_path("whole/inner.rfm"), &err));
  for (size_t i = 0; i < f.head->section_count; i++) {
    pictures += f.sections[i].kind == RFM_PICTURE;
    if (f.sections[i].kind == RFM_TEXTURES) textures = f.sections[i].size / 4;
  }
  CHECK_MSG(pictures == 2 && textures == 3, "%zu of %zu textures", pictures,
            textures); // two show one picture
  rfm_close(&f);
  rf_scene *s = saved_load(e, model_path("out.rfm"), false);
  const char *text;
  CHECK(!rf_prepare(s, NULL) && rf_error(e, &text) == RF_NOT_FOUND);
  CHECK_TEXT(text, "paper.png");
  rf_scene_destroy(s);
  rf_engine_destroy(e);
}

TEST(a_scene_places_saved_models)
{
  static const char scene[] =
      "{\"rayfold\":1,\"objects\":[{\"shape\":{\"kind\":\"mesh\",\"file\":\"%s\"}},"
      "{\"shape\":{\"kind\":\"mesh\",\"file\":\"%s\"},\"translate\":[0,0.5,0.2]}],"
      "\"sky\":{\"kind\":\"gradient\"},\"camera\":{\"position\":[0.5,1.2,3],\"target\":[0.5,0,0.5]}}";
  char text[1000];
  rf_engine *e = engine(1);
  saved_convert(e, saved_write_obj(9), model_path("out.rfm"));
  snprintf(text, sizeof text, scene, "sheet.obj", "sheet.obj");
  const uint64_t hash = saved_hash(e, model_write("places.json", text, strlen(text)), false);
  snprintf(text, sizeof text, scene, "out.rfm", "out.rfm");
  CHECK(saved_hash(e, model_write("places.json", text, strlen(text)), false) == hash);
  saved_convert(e, model_path("places.json"), model_path("places.rfm"));
  CHECK(saved_hash(e, model_path("places.rfm"), false) == hash);
  rf_scene *s = saved_load(e, model_path("places.json"), false);
  const char *why;
  CHECK(!rf_scene_save(s, model_path("out.rfm")) && rf_error(e, &why) == RF_BAD_ARGUMENT);
  CHECK_TEXT(why, "the scene itself shows this file; save it under another name");
  rf_scene_destroy(s);
  rf_engine_destroy(e);
}

// Everything that a mesh can hold, beyond what a picture of it shows.
TEST(all_arrays_survive)
{
  Err err = {0};
  Scene *s = scene_create(&err);
  MeshData *m = mesh_data_create();
  m->vertex_count = 5;
  m->triangle_count = 2;
  float **const arrays[] = {&m->positions,    &m->normals, &m->texcoords[0],
                            &m->texcoords[1], &m->colors,  &m->tangents};
  const size_t widths[] = {3, 3, 2, 2, 4, 4};
  for (size_t k = 0; k < 6; k++) {
    *arrays[k] = mem_alloc(5 * widths[k], sizeof(float));
    for (size_t i = 0; i < 5 * widths[k]; i++)
      (*arrays[k])[i] = unit_float(hash_u32((uint32_t)(100 * k + i)));
  }
  m->triangles = mem_alloc(6, sizeof(uint32_t));
  memcpy(m->triangles, (uint32_t[]){0, 1, 2, 4, 3, 2}, 24);
  m->material_slots = mem_alloc(2, sizeof(uint16_t));
  memcpy(m->material_slots, (uint16_t[]){1, 0}, 4);
  scene_add_material(s, MATERIAL_PBR, "a");
  scene_add_material(s, MATERIAL_GLASS, "b");
  scene_add_mesh(s, "odd \xff name", mesh_data_share(m));
  int32_t slots[2] = {1, -1};
  s->meshes.items[0].slots = slots;
  s->meshes.items[0].slot_count = 2;
  scene_add_object(s, SHAPE_MESH, NULL);
  s->objects.items[0].shape.mesh_i = 0;
  CHECK(rfm_write(s, &(SavedTree){0}, false, 0, model_path("out.rfm"), &err));
  Scene *t = scene_load(model_path("out.rfm"), NULL, &err);
  CHECK_MSG(t, "%s", err.text);
  const Mesh *mesh = &t->meshes.items[0];
  for (size_t k = 0; k < 6; k++) {
    const size_t at = (size_t)((char *)arrays[k] - (char *)m);
    const float *back;
    memcpy(&back, (const char *)mesh->data + at, sizeof back);
    CHECK(back && !memcmp(back, *arrays[k], 5 * widths[k] * sizeof(float)));
  }
  CHECK(!memcmp(mesh->data->triangles, m->triangles, 24) &&
        !memcmp(mesh->data->material_slots, m->material_slots, 4));
  CHECK(mesh->slot_count == 2 && mesh->slots[0] == 1 && mesh->slots[1] == -1 &&
        text_equal(mesh->name, "odd \xff name"));
  CHECK(t->materials.items[1].kind == MATERIAL_GLASS && text_equal(t->materials.items[0].name, "a"));
  scene_destroy(t);
  scene_destroy(s);
  mesh_data_release(m);
}

// Real files hold vertices that are not numbers; what is saved holds none.
TEST(models_with_broken_vertices_can_be_saved)
{
  static const char obj[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 1 inf\nv 1 1 0.5\nf 1 2 3\nf 2 4 3\nf 2 5 3\n";
  rf_engine *e = engine(1);
  check_round_trip(e, model_write("sheet.obj", obj, sizeof obj - 1));
  rf_engine_destroy(e);
}

// The world holds on to the bytes: neither the scene nor the file's name is needed any more.
TEST(worlds_outlive_scene_and_file)
{
  rf_engine *e = engine(2);
  rf_eye eye;
  saved_convert(e, saved_write_obj(60), model_path("out.rfm"));
  const uint64_t hash = saved_hash(e, model_path("out.rfm"), false);
  rf_scene *s = saved_load(e, model_path("out.rfm"), false);
  rf_world *first = rf_prepare(s, NULL), *w = rf_prepare(s, first);
  CHECK(first && w && rf_camera(s, w, NULL, 1.5f, &eye));
  rf_scene_destroy(s);
  rf_world_destroy(first);
  saved_convert(e, saved_write_gltf(), model_path("out.rfm")); // another takes the name
  unlink(model_path("out.rfm"));
  CHECK(saved_hash_world(e, w, &eye) == hash);
  rf_world_destroy(w);
  rf_engine_destroy(e);
}

TEST(saved_models_become_scenes_again)
{
  rf_engine *e = engine(1);
  const uint64_t hash = saved_hash(e, saved_write_obj(4), false);
  saved_convert(e, model_path("sheet.obj"), model_path("out.rfm"));
  saved_convert(e, model_path("out.rfm"), model_path("copy.json")); // small enough to be one text
  CHECK(saved_hash(e, model_path("copy.json"), false) == hash);
  rf_engine_destroy(e);
}

// --- damage -----------------------------------------------------------------------------------------
typedef struct Bytes {
  char *data;
  size_t size;
} Bytes;

// With its picture inside, so that it can be opened anywhere.
static Bytes saved_sheet(int n)
{
  rf_engine *e = engine(1);
  FileBytes file;
  Err err = {0};
  mkdir(model_path("whole"), 0777);
  saved_convert(e, saved_write_obj(n), model_path("whole/inner.rfm"));
  CHECK(file_read(&file, model_path("whole/inner.rfm"), &err));
  const Bytes b = {aligned_alloc(64, (file.size + 127) / 64 * 64), file.size};
  memcpy(b.data, file.data, file.size);
  file_release(&file);
  rf_engine_destroy(e);
  return b;
}

static void check_refused(const void *data, size_t size, const char *part)
{
  rf_engine *e = engine(1);
  const char *text = "";
  const char *path = model_write("wrong.rfm", data, size);
  const Fuzz f = {.engine = e};
  CHECK_MSG(!fuzz_open(&f, path, &text), "it opens, but should be \"%s\"", part);
  CHECK_TEXT(text, part);
  if (size) CHECK_TEXT(text, "wrong.rfm");
  rf_engine_destroy(e);
}

TEST(damage_is_told_apart)
{
  const Bytes b = saved_sheet(9);
  RfmHead *head = (RfmHead *)(void *)b.data;
  check_refused(b.data, 40, "cut short after 40 bytes; copy it again, or convert it again");
  check_refused(b.data, b.size - 1, "cut short: it has");
  check_refused(b.data, 0, "the file is empty");
  check_refused("# no model\n", 11,
                "this is no saved model of rayfold; make one with `rayfold convert MODEL wrong.rfm`");
  check_refused("ply\nformat ascii 1.0\n", 21, "its content looks like a PLY model; rename it");
  b.data[b.size] = 7;
  check_refused(b.data, b.size + 1, "bytes behind its end");
  const RfmHead good = *head;
  head->version++;
  check_refused(b.data, b.size,
                "saved by another version of rayfold (its format is number 2, this program reads 1)");
  *head = good;
  head->byte_order = __builtin_bswap32(RFM_BYTE_ORDER);
  check_refused(b.data, b.size, "a machine with the other byte order");
  *head = good;
  head->key ^= 1;
  check_refused(b.data, b.size, "the checksum of its head is wrong");
  *head = good;
  ((char *)seal_bytes(b.data, RFM_POSITIONS))[100] ^= 1;
  check_refused(b.data, b.size,
                "the checksum is wrong of the positions of mesh 0; convert it again from the model");
  ((char *)seal_bytes(b.data, RFM_POSITIONS))[100] ^= 1;
  ((char *)seal_bytes(b.data, RFM_TREE_LEAVES))[1000] ^= 32;
  check_refused(b.data, b.size, "the checksum is wrong of the tree of mesh 0");
  ((char *)seal_bytes(b.data, RFM_TREE_LEAVES))[1000] ^= 32;
  check_refused(b.data, b.size - 64, "cut short");
  free(b.data);
}

// Every bit of a file is covered: by the head's checksum, a section's, or by being a gap that nobody reads.
TEST(no_flipped_bit_changes_a_model)
{
  const Bytes b = saved_sheet(2);
  rf_engine *e = engine(1);
  const uint64_t hash = saved_hash(e, model_path("whole/inner.rfm"), false);
  for (size_t i = 0; i < b.size; i += TEST_IS_SLOW ? 7 : 1) {
    b.data[i] ^= (char)(1 << i % 8);
    const char *wrong = model_write("wrong.rfm", b.data, b.size);
    rf_scene *s = rf_scene_load(e, wrong, NULL);
    const char *text;
    if (!s) {
      rf_error(e, &text);
      CHECK_TEXT(text, i < 8 ? "this is no saved model" : "convert it again from the model");
    }
    if (i % 64 == 0 && s) CHECK(saved_hash_scene(e, s) == hash);
    const RfmHead *head = (const RfmHead *)(const void *)b.data;
    bool is_covered = i < sizeof *head + head->section_count * sizeof(RfmSection);
    for (size_t k = 0; !is_covered && k < head->section_count; k++) {
      const RfmSection *at = &seal_sections(b.data)[k];
      is_covered = i >= at->offset && i < at->offset + at->size;
    }
    CHECK_MSG(!s == is_covered || i < sizeof *head, "byte %zu", i);
    rf_scene_destroy(s);
    b.data[i] ^= (char)(1 << i % 8);
  }
  free(b.data);
  rf_engine_destroy(e);
}

TEST(every_cut_is_refused)
{
  const Bytes b = saved_sheet(4);
  Fuzz f;
  const char *text = "";
  fuzz_begin(&f, "rfm");
  for (size_t n = 0; n < b.size; n += TEST_IS_SLOW ? 13 : 3) {
    Err err;
    Scene *s = model_load(import_rfm, "wrong.rfm", b.data, n, &err);
    CHECK_MSG(!s, "%zu bytes", n);
    scene_destroy(s);
    if (n % 5 == 0) fuzz_one(&f, b.data, n, &text); // with right checksums
  }
  fuzz_end(&f);
  free(b.data);
}

// --- hostile files: everything wrong but the checksums ----------------------------------------------
// Thousands of random changes, more of them where numbers lead somewhere. The sanitizers watch.
TEST(random_changes_with_right_checksums)
{
  static const RfmKind kinds[] = {RFM_TREE_NODES, RFM_TREE_HEAD, RFM_TREE_LEAVES, RFM_MESH,
                                  RFM_TRIANGLES,  RFM_SCENE,     RFM_POSITIONS,   RFM_MATERIAL_SLOTS};
  const Bytes b = saved_sheet(9);
  char *copy = aligned_alloc(64, (b.size + 63) / 64 * 64);
  Fuzz f;
  const char *text = "";
  int opened = 0;
  const uint32_t rounds = TEST_IS_SLOW ? 1500 : 5000;
  fuzz_begin(&f, "rfm");
  for (uint32_t i = 0; i < rounds; i++) {
    memcpy(copy, b.data, b.size);
    for (uint32_t k = 0; k <= i % 3; k++) {
      const uint32_t r = hash_combine(i, k), q = hash_u32(r);
      const RfmSection *s = seal_find(b.data, kinds[r % 8], 0);
      const size_t at = r % 16 < 13 && s ? s->offset + q % s->size : q % b.size;
      const uint32_t value = q % 5 == 0 ? ~0u : q % 5 == 1 ? 0x7fc00000 : q % 5 == 2 ? q % 64 : hash_u32(q);
      if (q % 3)
        copy[at] ^= (char)(1 << r % 8);
      else if (at + 8 <= b.size)
        memcpy(copy + at / 4 * 4, &value, 4);
    }
    opened += fuzz_one(&f, copy, b.size, &text);
  }
  CHECK_MSG(opened > 10 && opened < (int)rounds, "%d of %u", opened, rounds);
  fuzz_end(&f);
  free(copy);
  free(b.data);
}

static void check_sealed(const Bytes *b, const char *part)
{
  seal(b->data, b->size);
  check_refused(b->data, b->size, part);
}

// The file with one number changed, refused for this reason; then it is as before.
#define WITH(pointer, value, part)            \
  do {                                        \
    __typeof__(pointer) const at = (pointer); \
    const __typeof__(*at) kept = *at;         \
    *at = (value);                            \
    check_sealed(&b, part);                   \
    *at = kept;                               \
  } while (0)

TEST(numbers_that_lead_out_are_refused)
{
  const Bytes b = saved_sheet(9);
  RfmMesh *mesh = seal_bytes(b.data, RFM_MESH);
  uint32_t *triangles = seal_bytes(b.data, RFM_TRIANGLES);
  float *positions = seal_bytes(b.data, RFM_POSITIONS);
  int32_t *slots = (int32_t *)(mesh + 1);
  uint16_t *material_slots = seal_bytes(b.data, RFM_MATERIAL_SLOTS);
  RfmSection *first = seal_sections(b.data), *array = seal_find(b.data, RFM_POSITIONS, 0);
  WITH(&triangles[7], 100, "impossible numbers among the triangles of mesh 0");
  WITH(&positions[5], (float)NAN, "impossible numbers among the positions");
  WITH(&material_slots[3], 2, "impossible numbers among the material slots");
  WITH(&slots[0], 2, "names a material that is not there");
  WITH(&slots[0], -2, "names a material that is not there");
  WITH(&mesh->vertex_count, 101, "the positions of mesh 0 have the wrong size");
  WITH(&mesh->triangle_count, 0, "the sizes of mesh 0 are out of range");
  WITH(&mesh->triangle_count, 1ull << 62, "the sizes of mesh 0 are out of range");
  WITH(&mesh->slot_count, 0xffffffffu, "the sizes of mesh 0 do not fit together");
  WITH(&array->owner, 1, "stand apart from it");
  WITH(&seal_find(b.data, RFM_MESH, 0)->owner, 3, "out of order");
  WITH(&array->kind, 0, "has no positions or no triangles");
  WITH(&first->kind, 0, "it holds no scene");
  WITH(&first->offset, b.size, "its parts do not lie in a row");
  WITH(&first->offset, first->offset + 4, "its parts do not lie in a row");
  WITH(&array->offset, first->offset, "its parts do not lie in a row"); // twice to be looked at
  WITH((int32_t *)seal_bytes(b.data, RFM_TEXTURES), 1, "its textures and pictures do not fit together");
  WITH(&seal_find(b.data, RFM_TEXTURES, 0)->kind, 999, "its textures and pictures do not fit together");
  WITH(&first->size, ~0ull, "its parts do not lie in a row");
  WITH(&first->size, first->size - 1, "it holds no scene");
  free(b.data);
}

TEST(trees_that_lead_out_or_round_are_refused)
{
  static const char wrong[] = "the tree of a mesh is not sound";
  const Bytes b = saved_sheet(20);
  TreeHead *head = seal_bytes(b.data, RFM_TREE_HEAD);
  Node8 *nodes = seal_bytes(b.data, RFM_TREE_NODES);
  Tri8 *blocks = seal_bytes(b.data, RFM_TREE_LEAVES);
  CHECK(head->node_count > 10 && head->root == 0);
  int inner = 0, unused = -1, node = -1, free_lane = -1;
  while (nodes[0].child[inner] & LEAF_BIT) inner++;
  for (uint32_t i = 0; i < head->node_count && unused < 0; i++)
    for (int k = 0; k < 8; k++)
      if (nodes[i].child[k] == EMPTY_TREE) node = (int)i, unused = k;
  size_t block = 0;
  for (; free_lane < 0; block += free_lane < 0)
    for (int k = 0; k < 8; k++)
      if (blocks[block].prim[k] == NO_HIT) free_lane = k;
  uint32_t *child = &nodes[0].child[inner];
  WITH(child, 0, wrong);                          // round
  WITH(child, (uint32_t)head->node_count, wrong); // out
  WITH(child, LEAF_BIT | (uint32_t)head->block_count, wrong);
  WITH(child, EMPTY_TREE, wrong);
  WITH(child, *child + 1, wrong); // two parents: a neighbour's child, too
  WITH(&nodes[0].box[0][inner], (float)NAN, wrong);
  WITH(&nodes[0].box[0][inner], INFINITY, wrong);
  WITH(&nodes[0].box[3][inner], -INFINITY, wrong);
  WITH(&nodes[node].child[unused], 0, wrong); // walks would not go there, refits would
  WITH(&nodes[0].count[inner], 1, wrong);
  int leaf = -1;
  uint32_t parent = 0;
  for (; leaf < 0; parent += leaf < 0)
    for (int k = 0; k < 8; k++)
      if (nodes[parent].count[k] > 1) leaf = k;
  WITH(&nodes[parent].count[leaf], 0, wrong);
  WITH(&nodes[parent].count[leaf], 9, wrong);
  WITH(&nodes[parent].count[leaf], (uint8_t)(nodes[parent].count[leaf] - 1), wrong);
  WITH(&nodes[parent].child[leaf], nodes[parent].child[leaf] ^ 1, wrong); // two parents, and none for another
  WITH(&head->root, LEAF_BIT, wrong);
  WITH(&nodes[node].box[0][unused], 0, wrong); // a lane that half a box makes neither used nor unused
  WITH(&blocks[block].prim[0], 20u * 20 * 2, wrong);
  WITH(&blocks[block].prim[0], NO_HIT, wrong);
  WITH(&blocks[block].v[0][1][free_lane], 0.5f, wrong); // a lane that may be hit, of no triangle
  WITH(&head->root, (uint32_t)head->node_count, wrong);
  WITH(&head->root, LEAF_BIT | (uint32_t)head->block_count, wrong);
  WITH(&head->root, EMPTY_TREE, wrong);
  WITH(&head->node_count, head->node_count + 1, wrong);
  WITH(&head->block_count, 1ull << 60, wrong);
  WITH(&head->triangle_count, 801, wrong);
  WITH(&head->lo[1], (float)NAN, wrong);
  WITH(&head->hi[1], -INFINITY, wrong);
  free(b.data);
}

// A chain of nodes as long as the file: more levels than any walk has room for.
TEST(trees_that_are_too_deep_are_refused)
{
  const Bytes b = saved_sheet(40);
  const TreeHead *head = seal_bytes(b.data, RFM_TREE_HEAD);
  Node8 *nodes = seal_bytes(b.data, RFM_TREE_NODES);
  CHECK(head->node_count > MOST_DEPTH + 1);
  for (uint32_t i = 0; i < head->node_count; i++) {
    const bool is_last = i + 1 == (i < MOST_DEPTH + 1 ? MOST_DEPTH + 1 : head->node_count);
    for (int k = 0; k < 8; k++) {
      for (int c = 0; c < 6; c++)
        nodes[i].box[c][k] = k ? (c % 2 ? -INFINITY : INFINITY) : (c % 2 ? 1.0f : -1.0f);
      nodes[i].child[k] = k ? EMPTY_TREE : is_last ? LEAF_BIT : i + 1;
    }
  }
  check_sealed(&b, "the tree of a mesh is not sound");
  free(b.data);
}

// What was saved can be moved: its tree is followed without being written to.
TEST(saved_models_can_be_moved)
{
  const Bytes b = saved_sheet(30);
  rf_engine *e = engine(1);
  rf_scene *s = rf_scene_load(e, model_write("moves.rfm", b.data, b.size), NULL);
  rf_world *world = rf_prepare(s, NULL);
  CHECK(s && world);
  const Fuzz f = {.engine = e};
  fuzz_move(&f, s, world);
  const char *text;
  CHECK_MSG(rf_error(e, &text) == RF_OK, "%s", text);
  rf_world_destroy(world);
  rf_scene_destroy(s);
  rf_engine_destroy(e);
  free(b.data);
}

// A layout or a builder of another day: the tree is built anew.
TEST(unknown_trees_are_built_anew)
{
  const Bytes b = saved_sheet(9);
  rf_engine *e = engine(1);
  const uint64_t hash = saved_hash(e, model_path("whole/inner.rfm"), false);
  TreeHead *head = seal_bytes(b.data, RFM_TREE_HEAD);
  head->layout = 77;
  head->root = 12345;
  seal(b.data, b.size);
  CHECK(saved_hash(e, model_write("wrong.rfm", b.data, b.size), false) == hash);
  head->layout = SAVED_NODE8_TRI8;
  head->quality = 77;
  seal(b.data, b.size);
  CHECK(saved_hash(e, model_write("wrong.rfm", b.data, b.size), false) == hash);
  seal_find(b.data, RFM_TREE_HEAD, 0)->kind = 1000; // a section of another day
  seal(b.data, b.size);
  CHECK(saved_hash(e, model_write("wrong.rfm", b.data, b.size), false) == hash);
  free(b.data);
  rf_engine_destroy(e);
}

// What was saved yesterday opens today: when this fails, RFM_VERSION or a tree's layout has to go up, and this file is
// to be made again by `rayfold convert tests/data/assimp.obj tests/data/saved/cube.rfm`.
TEST(old_files_still_open)
{
  rf_engine *e = engine(1);
  CHECK(saved_hash(e, "tests/data/saved/cube.rfm", false) == saved_hash(e, "tests/data/assimp.obj", false));
  rf_engine_destroy(e);
}

// --- out of memory and disk -------------------------------------------------------------------------
TEST(failing_allocations_leave_nothing_behind)
{
  rf_engine *e = engine(1);
  saved_convert(e, saved_write_gltf(), model_path("out.rfm"));
  model_starve(import_rfm, model_path("out.rfm"));
  rf_scene *s = saved_load(e, model_path("quads.gltf"), false);
  bool ok = false;
  unlink(model_path("wrong.rfm"));
  for (long n = 1; !ok && n < 3000; n++) {
    const char *text;
    mem_fail_after(n);
    ok = rf_scene_save(s, model_path("wrong.rfm"));
    mem_fail_after(0);
    if (ok) break;
    CHECK(rf_error(e, &text) == RF_NO_MEMORY && access(model_path("wrong.rfm"), F_OK));
  }
  CHECK(ok);
  rf_scene_destroy(s);
  rf_engine_destroy(e);
}

TEST(a_file_that_cannot_be_written_is_not_begun)
{
  rf_engine *e = engine(1);
  rf_scene *s = saved_load(e, saved_write_obj(2), false);
  const char *text;
  CHECK(!rf_scene_save(s, model_path("nowhere/out.rfm")) && rf_error(e, &text) == RF_IO);
  CHECK_TEXT(text, "create the folder first");
  rf_scene_destroy(s);
  rf_engine_destroy(e);
}

TEST(zz_clean)
{
  model_clean(files, sizeof files / sizeof *files);
  rmdir(model_path("whole"));
  rmdir(model_path(""));
}

TEST_MAIN
