// Meshes written and read again: the same floats, and a file that is whole or not there.

#include "tests/model.h"

#include "image/image.h"
#include "scene/edit.h"
#include "scene/export_mesh.h"

// A strip of random numbers, as rough as float can be.
static MeshData *make_mesh(bool has_normals, bool has_texcoords, bool has_colors, bool has_slots)
{
  enum { N = 100 };
  MeshData *m = mesh_data_create();
  m->vertex_count = N;
  m->triangle_count = N - 2;
  m->positions = mem_alloc(N, 12);
  m->triangles = mem_alloc(N - 2, 12);
  if (has_normals) m->normals = mem_alloc(N, 12);
  if (has_texcoords) m->texcoords[0] = mem_alloc(N, 8);
  if (has_colors) m->colors = mem_alloc(N, 16);
  if (has_slots) m->material_slots = mem_alloc(N - 2, 2);
  for (uint32_t i = 0; i < N; i++) {
    for (uint32_t k = 0; k < 3; k++)
      m->positions[3 * i + k] = unit_float(hash_combine(i, k)) * 100 - 50 + (float)i;
    const Vec3 n = v3_normalize(v3(unit_float(hash_u32(i)), unit_float(hash_u32(i + 1000)) - 0.5f, 0.25f));
    if (has_normals) v3_store(m->normals + 3 * i, n);
    for (uint32_t k = 0; has_texcoords && k < 2; k++)
      m->texcoords[0][2 * i + k] = unit_float(hash_combine(i + 7, k));
    for (uint32_t k = 0; has_colors && k < 4; k++)
      m->colors[4 * i + k] = k == 3 ? 1 : unit_float(hash_combine(i + 9, k));
    for (uint32_t k = 0; i < N - 2 && k < 3; k++) m->triangles[3 * i + k] = i + k;
    if (has_slots && i < N - 2) m->material_slots[i] = (uint16_t)(i / 40);
  }
  return m;
}

static bool same_corners(const MeshData *a, const float *values_a, const MeshData *b, const float *values_b,
                         size_t width, float tolerance)
{
  if (!values_a != !values_b || a->triangle_count != b->triangle_count) return false;
  for (size_t i = 0; values_a && i < 3 * a->triangle_count; i++)
    for (size_t k = 0; k < width; k++)
      if (!(fabsf(values_a[width * a->triangles[i] + k] - values_b[width * b->triangles[i] + k]) <=
            tolerance))
        return false;
  return true;
}

static void check_round_trip(const MeshData *m, bool (*export)(const MeshData *, const char *, Err *),
                             Importer *import, const char *name, float color_tolerance,
                             float normal_tolerance)
{
  Err err = {0};
  const char *path = model_path(name);
  CHECK_MSG(export(m, path, &err), "%s", err.text);
  Scene *s = model_load_file(import, path, &err);
  CHECK_MSG(s, "%s", err.text);
  if (!s) return;
  const MeshData *back = s->meshes.items[0].data;
  CHECK(same_corners(m, m->positions, back, back->positions, 3, 0));
  if (import != import_stl) {
    CHECK(same_corners(m, m->normals, back, back->normals, 3, normal_tolerance));
    CHECK(same_corners(m, m->texcoords[0], back, back->texcoords[0], 2, 0));
    CHECK(same_corners(m, m->colors, back, back->colors, 4, color_tolerance));
    CHECK(back->vertex_count == m->vertex_count);
  }
  if (import == import_obj && m->material_slots)
    CHECK(!memcmp(m->material_slots, back->material_slots, m->triangle_count * sizeof(uint16_t)));
  scene_destroy(s);
}

TEST(round_trips)
{
  for (int i = 0; i < 16; i++) {
    MeshData *m = make_mesh(i & 1, i & 2, i & 4, i & 8);
    check_round_trip(m, export_ply, import_ply, "a.ply", 0.0091f / 2, 2e-7f); // half an 8-bit step at white
    check_round_trip(m, export_obj, import_obj, "a.obj", 1e-6f, 2e-7f);
    check_round_trip(m, export_stl, import_stl, "a.stl", 0, 0);
    mesh_data_release(m);
  }
}

TEST(a_file_is_whole_or_not_there)
{
  Err err = {0};
  MeshData *m = make_mesh(true, true, true, true);
  CHECK(!export_ply(m, "/nonexistent/folder/a.ply", &err));
  CHECK(err.kind == ERR_IO);
  CHECK_TEXT(err.text, "create the folder first");
  err = (Err){0};
  CHECK(!export_stl(m, "/dev/full", &err));
  CHECK(err.kind == ERR_IO);
  mesh_data_release(m);
}

// All rooms decode by the one curve of the image room: each of 256 codes comes back as the same float, from PLY as from
// a picture or "#rrggbb".
TEST(colour_codes_are_those_of_pictures)
{
  enum { N = 256 };
  MeshData *m = make_mesh(false, false, false, false);
  mem_free(m->positions);
  m->vertex_count = N;
  m->positions = mem_zero(N, 12);
  m->colors = mem_alloc(N, 16);
  for (int i = 0; i < 4 * N; i++) m->colors[i] = i % 4 == 3 ? 1 : srgb_from_u8[(i / 4 + 85 * (i % 4)) % 256];
  Err err = {0};
  CHECK(export_ply(m, model_path("codes.ply"), &err));
  Scene *s = model_load_file(import_ply, model_path("codes.ply"), &err);
  CHECK_MSG(s && !memcmp(m->colors, s->meshes.items[0].data->colors, 16 * N), "%s", err.text);
  for (int i = 0; s && i < N; i++) {
    char json[20];
    snprintf(json, sizeof json, "\"#%02x0000\"", i);
    CHECK(scene_set(s, "sky.color", json, &err) && s->sky.constant.color[0] == srgb_from_u8[i]);
  }
  scene_destroy(s);
  mesh_data_release(m);
}

TEST(too_many_triangles_for_stl)
{
  const MeshData m = {.triangle_count = (size_t)1 << 32};
  Err err = {0};
  CHECK(!export_stl(&m, model_path("a.stl"), &err));
  CHECK(err.kind == ERR_BAD_ARGUMENT);
}

TEST(zz_clean)
{
  static const char *const names[] = {"a.ply", "a.obj", "a.stl"};
  model_clean(names, sizeof names / sizeof *names);
}

TEST_MAIN
