// Saving scenes: what cannot stand in the scene file itself goes beside it, names of files lead to the same files,
// and saving what was saved changes nothing.

#include "tests/test.h"

#include "base/mem.h"
#include "scene/mesh_split.h"
#include "tests/scene_sample.h"

#include <dirent.h>
#include <sys/stat.h>

static void check_save(const Scene *s, const char *path)
{
  Err err = {0};
  CHECK_MSG(scene_save(s, path, &err), "%s", err.text);
}

static Scene *load(const char *path)
{
  Err err = {0};
  Scene *s = scene_load(path, NULL, &err);
  CHECK_MSG(s, "%s", err.text);
  return s;
}

static bool is_same_file(const char *a, const char *b)
{
  FileBytes x, y;
  if (!file_read(&x, a, NULL) || !file_read(&y, b, NULL)) return false;
  const bool same = x.size == y.size && !memcmp(x.data, y.data, x.size);
  file_release(&x);
  file_release(&y);
  return same;
}

static int count_files(const char *name)
{
  DIR *d = opendir(sample_path(name));
  int count = 0;
  for (struct dirent *e; d && (e = readdir(d));) count += e->d_name[0] != '.';
  if (d) closedir(d);
  return count;
}

// A strip of triangles in the plane z = 0 whose slots take turns.
static MeshData *strip(size_t triangles, int slots, bool has_colors)
{
  MeshData *m = mesh_data_create();
  m->triangle_count = triangles;
  m->vertex_count = triangles + 2;
  m->positions = mem_zero(m->vertex_count, 12);
  m->normals = mem_zero(m->vertex_count, 12);
  m->triangles = mem_zero(triangles, 12);
  m->material_slots = slots ? mem_zero(triangles, 2) : NULL;
  m->colors = has_colors ? mem_zero(m->vertex_count, 16) : NULL;
  for (size_t i = 0; i < m->vertex_count; i++) {
    m->positions[3 * i] = (float)i;
    m->positions[3 * i + 1] = (float)(i & 1);
    m->normals[3 * i + 2] = 1;
    for (size_t k = 0; has_colors && k < 4; k++) m->colors[4 * i + k] = 1;
  }
  for (size_t t = 0; t < triangles; t++) {
    for (size_t k = 0; k < 3; k++) m->triangles[3 * t + k] = (uint32_t)(t + k);
    if (slots) m->material_slots[t] = (uint16_t)(t % (size_t)slots);
  }
  return m;
}

static Scene *scene_with_strip(size_t triangles, int slots, bool has_colors)
{
  Scene *s = scene_create(NULL);
  const int32_t mesh_i = scene_add_mesh(s, "a strip/..", strip(triangles, slots, has_colors));
  Mesh *mesh = &s->meshes.items[mesh_i];
  mesh->slots = arena_alloc(&s->arena, 4, sizeof *mesh->slots);
  mesh->slot_count = (size_t)slots;
  for (int i = 0; i < slots; i++) {
    scene_add_material(s, MATERIAL_LAMBERT, NULL);
    mesh->slots[i] = slots - 1 - i;
  }
  for (int i = 0; i < 2; i++) {
    const int32_t object_i = scene_add_object(s, SHAPE_MESH, i ? NULL : "strip");
    s->objects.items[object_i].shape.mesh_i = mesh_i;
  }
  return s;
}

TEST(a_mesh_is_split_by_material)
{
  Scene *s = scene_with_strip(100, 3, true);
  MeshParts parts = {0};
  CHECK(mesh_split(&s->meshes.items[0], s->materials.count, &parts, NULL));
  CHECK(parts.list.count == 3);
  size_t triangles = 0;
  for (size_t p = 0; p < parts.list.count; p++) {
    const MeshData *m = parts.list.items[p].data;
    CHECK(parts.list.items[p].material == (int32_t)p);
    CHECK(mesh_data_check(parts.list.items[p].data, "part", NULL, NULL));
    for (size_t t = 0; t < m->triangle_count; t++) {
      // Triangle t of the part was number 3 t + (2 - p) of the strip, whose vertices lie at x = number + 0, 1, 2.
      const size_t whole = 3 * t + 2 - p;
      for (size_t k = 0; k < 3; k++) CHECK(m->positions[3 * m->triangles[3 * t + k]] == (float)(whole + k));
    }
    CHECK(m->colors && m->normals && m->normals[2] == 1);
    triangles += m->triangle_count;
  }
  CHECK(triangles == 100);
  mesh_parts_finish(&parts);
  scene_destroy(s);
}

// A scene of very many materials and meshes splits each mesh, so that must not take a step for each material.
TEST(splitting_takes_nothing_for_materials_not_used)
{
  Scene *s = scene_with_strip(100, 3, false);
  s->meshes.items[0].slots[1] = 1 << 30;
  s->meshes.items[0].slots[2] = -7;
  MeshParts parts = {0};
  CHECK(mesh_split(&s->meshes.items[0], (size_t)1 << 40, &parts, NULL));
  CHECK(parts.list.count == 3 && parts.list.items[0].material == -1 && parts.list.items[1].material == 2 &&
        parts.list.items[2].material == 1 << 30);
  mesh_parts_finish(&parts);
  scene_destroy(s);
}

TEST(large_meshes_go_beside_the_scene)
{
  Scene *s = scene_with_strip(300, 3, false);
  check_save(s, sample_path("large.json"));
  CHECK(count_files("large.data") == 3); // both objects share them
  Scene *t = load(sample_path("large.json"));
  if (t) {
    CHECK(t->objects.count == 6 && t->models.count == 3);
    CHECK(!strcmp(t->objects.items[1].name, "strip.2") && t->objects.items[1].common.material == 1);
    CHECK(!strncmp(t->objects.items[0].shape.mesh.file, "large.data/a-strip----", 22));
    const Scene *model = t->models.items[0].scene;
    CHECK(model->meshes.items[0].data->triangle_count == 100 && model->meshes.items[0].data->normals);
    check_save(t, sample_path("again.json"));
    Scene *u = load(sample_path("again.json"));
    CHECK(is_same_file(sample_path("large.json"), sample_path("again.json")));
    scene_destroy(u);
  }
  check_save(s, sample_path("large.json")); // the same content has the same names
  CHECK(count_files("large.data") == 3);
  scene_destroy(s);
  scene_destroy(t);
}

TEST(small_meshes_stand_in_the_file)
{
  Scene *s = scene_with_strip(4, 2, false);
  check_save(s, sample_path("small.json"));
  CHECK(count_files("small.data") == 0);
  Scene *t = load(sample_path("small.json"));
  if (t) {
    CHECK(t->objects.count == 4 && t->meshes.count == 4 && t->meshes.items[0].data->triangle_count == 2);
    check_save(t, sample_path("small2.json"));
    CHECK(is_same_file(sample_path("small.json"), sample_path("small2.json")));
  }
  scene_destroy(s);
  scene_destroy(t);
}

TEST(embedded_pictures_become_files)
{
  static const uint8_t png[] = "\x89PNG\r\n\x1a\n and more";
  Scene *s = scene_create(NULL), *t;
  for (int i = 0; i < 3; i++) {
    Texture *texture;
    const int32_t at = scene_add_texture(s, TEXTURE_IMAGE, "wood");
    texture = &s->textures.items[at];
    texture->embedded = png;
    texture->embedded_size = sizeof png - (size_t)(i == 1);
  }
  Text out = {0};
  Err err = {0};
  CHECK(!scene_write(s, &out, &err));
  CHECK_TEXT(err.text, "lies inside a model file");
  check_save(s, sample_path("pictures.json"));
  CHECK(count_files("pictures.data") == 2); // the third is the first
  t = load(sample_path("pictures.json"));
  if (t) {
    CHECK(text_ends(t->textures.items[0].image.file, ".png") && !t->textures.items[0].embedded);
    CHECK(!strcmp(t->textures.items[0].image.file, t->textures.items[2].image.file));
    CHECK(strcmp(t->textures.items[0].image.file, t->textures.items[1].image.file));
    CHECK_MSG(scene_check_files(t, &err), "%s", err.text);
    FileBytes file;
    CHECK(scene_file_path(t, t->textures.items[0].image.file, NULL, &out, NULL) &&
          file_read(&file, text_get(&out), NULL) && file.size == sizeof png &&
          !memcmp(file.data, png, sizeof png));
    file_release(&file);
  }
  CHECK(s->textures.items[0].embedded && !s->textures.items[0].image.file); // the scene itself is as it was
  scene_destroy(s);
  scene_destroy(t);
  text_finish(&out);
}

static void check_moved(const char *from, const char *file, const char *to, const char *wanted)
{
  Err err = {0};
  Scene *s = scene_create(NULL), *t;
  const LoadOptions outside = {.allow_outside = true};
  s->path = sample_path(from);
  s->sky.kind = SKY_IMAGE;
  s->sky.image = (SkyImage){.file = file, .gain = 1};
  s->has_sky = true;
  check_save(s, sample_path(to));
  t = scene_load(sample_path(to), &outside, &err);
  CHECK_MSG(t, "%s", err.text);
  if (t)
    CHECK_MSG(!strcmp(t->sky.image.file, wanted), "%s from %s to %s: %s", file, from, to, t->sky.image.file);
  scene_destroy(s);
  scene_destroy(t);
}

TEST(file_names_lead_to_the_same_files)
{
  CHECK(!mkdir(sample_path("a"), 0777) && !mkdir(sample_path("a/b"), 0777) &&
        !mkdir(sample_path("ab"), 0777));
  check_moved("x.json", "sky.exr", "y.json", "sky.exr");
  check_moved("x.json", "./sky.exr", "y.json", "./sky.exr"); // as it was written
  check_moved("x.json", "sky.exr", "a/y.json", "../sky.exr");
  check_moved("x.json", "a/sky.exr", "a/y.json", "sky.exr");
  check_moved("x.json", "a/sky.exr", "ab/y.json", "../a/sky.exr");
  check_moved("a/x.json", "sky.exr", "y.json", "a/sky.exr");
  check_moved("a/b/x.json", "../sky.exr", "y.json", "a/sky.exr");
  check_moved("a/b/x.json", "./.././b//c/sky.exr", "ab/y.json", "../a/b/c/sky.exr");
  check_moved("a/b/x.json", "c\\sky.exr", "a/y.json", "b/c/sky.exr");
  check_moved("a/x.json", "/data/sky.exr", "y.json", "/data/sky.exr");
}

// A scene may not read outside its folder, so what it shows must not stay there.
TEST(pictures_come_along_to_another_folder)
{
  Err err = {0};
  Scene *s = scene_create(NULL), *t;
  CHECK(!mkdir(sample_path("from"), 0777) && !mkdir(sample_path("to"), 0777));
  sample_write("from/wood.png", "\x89PNG", 5);
  s->path = sample_path("from/model.obj");
  const int32_t texture_i = scene_add_texture(s, TEXTURE_IMAGE, "wood");
  s->textures.items[texture_i].image.file = "wood.png";
  s->sky.kind = SKY_IMAGE;
  s->sky.image = (SkyImage){.file = "wood.png", .gain = 1};
  s->has_sky = true;
  check_save(s, sample_path("to/model.json"));
  t = load(sample_path("to/model.json"));
  if (t) {
    CHECK_MSG(scene_check_files(t, &err), "%s", err.text);
    CHECK_TEXT(t->textures.items[0].image.file, "model.data/wood-");
    CHECK_TEXT(t->sky.image.file, "model.data/sky-");
  }
  check_save(s, sample_path("beside.json")); // below its folder they may stay where they are
  scene_destroy(t);
  t = load(sample_path("beside.json"));
  if (t) CHECK(!strcmp(t->textures.items[0].image.file, "from/wood.png"));
  scene_destroy(s);
  scene_destroy(t);
}

TEST(the_sample_is_saved_as_it_is_written)
{
  Err err;
  Scene *s = sample_load(sample_scene, &err);
  Text out = {0};
  FileBytes file = {0};
  CHECK_MSG(s && scene_write(s, &out, &err), "%s", err.text);
  if (s) check_save(s, sample_path("copy.json"));
  CHECK(file_read(&file, sample_path("copy.json"), &err));
  CHECK(file.size == out.length && !memcmp(file.data, text_get(&out), out.length));
  file_release(&file);
  text_finish(&out);
  scene_destroy(s);
}

TEST(a_save_that_fails_leaves_the_old_file)
{
  Err err = {0};
  Scene *s = scene_create(NULL);
  CHECK(!scene_save(s, sample_path("no such folder/x.json"), &err) && err.kind == ERR_IO);
  CHECK_TEXT(err.text, "create the folder first");
  sample_write("old.json", "old", 3);
  s->develop.exposure = NAN;
  err = (Err){0};
  CHECK(!scene_save(s, sample_path("old.json"), &err) && err.kind == ERR_BAD_SCENE);
  FileBytes file = {0};
  CHECK(file_read(&file, sample_path("old.json"), NULL) && file.size == 3);
  file_release(&file);
  scene_destroy(s);
}

TEST(every_allocation_may_fail)
{
  Scene *s = scene_with_strip(70, 2, true);
  sample_write("kept.json", "old", 3);
  for (long n = 1; n < 1000; n++) {
    Err err = {0};
    mem_fail_after(n);
    const bool ok = scene_save(s, sample_path("kept.json"), &err);
    mem_fail_after(0);
    if (ok) {
      CHECK(n > 10);
      break;
    }
    CHECK_MSG(err.kind == ERR_NO_MEMORY, "%ld: %s", n, err.text);
    CHECK(n < 900);
  }
  scene_destroy(s);
}

TEST(clean_up)
{
  sample_remove();
}

TEST_MAIN
