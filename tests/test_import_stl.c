// STL: the two forms and the trap between them, merged vertices, and what broken files may not do.

#include "tests/model.h"

static Scene *load_bytes(const void *data, size_t size, Err *err)
{
  return model_load(import_stl, "part.stl", data, size, err);
}

static Scene *load_ok(const char *text)
{
  Err err;
  Scene *s = load_bytes(text, strlen(text), &err);
  CHECK_MSG(s, "%s", err.text);
  if (s) check_whole(s);
  return s;
}

static void check_error(const char *text, const char *part)
{
  Err err;
  Scene *s = load_bytes(text, strlen(text), &err);
  CHECK_MSG(!s, "loaded: %.60s", text);
  if (!s) CHECK_TEXT(err.text, part);
  scene_destroy(s);
}

#define FACET(a, b, c)                                                                \
  " facet normal 0 0 1\n  outer loop\n   vertex " a "\n   vertex " b "\n   vertex " c \
  "\n  endloop\n endfacet\n"
#define TWO FACET("0 0 0", "1 0 0", "1 1 0") FACET("-0 0 0", "1e0 1 0", "0 1.0 -0")

TEST(ascii_merges_equal_corners)
{
  Scene *s = load_ok("solid my part \n" TWO "endsolid my part\n");
  if (!s) return;
  const MeshData *m = s->meshes.items[0].data;
  CHECK(m->vertex_count == 4 && m->triangle_count == 2 && !m->normals); // -0 is 0
  CHECK_NEAR(mesh_area(m), 1, 1e-7);
  CHECK(!strcmp(s->meshes.items[0].name, "my part") && s->objects.count == 1);
  scene_destroy(s);
}

TEST(solids_without_names_and_several_of_them)
{
  Scene *s = load_ok("solid\n" TWO
                     "endsolid\nSOLID b\r\nFACET NORMAL nan 0 0\nOUTER LOOP\nVERTEX 5 5 5\nVERTEX 6 5 5\n"
                     "VERTEX 6 6 5\nENDLOOP\nENDFACET\nENDSOLID b");
  if (!s) return;
  CHECK(s->meshes.items[0].data->triangle_count == 3 && !strcmp(s->meshes.items[0].name, "part"));
  scene_destroy(s);
}

TEST(errors_say_where)
{
  check_error("", "byte 0");
  check_error("solid\nendsolid\n", "holds no triangles");
  check_error("solid a\n facet normal 0 0 1\n outer loop\n vertex 1 2\n",
              "part.stl:4: a vertex needs three numbers");
  check_error("solid a\n facet normal 0 0 1\n vertex 1 2 3\n",
              "part.stl:3: a vertex stands where none belongs");
  check_error("solid a\nfacet\nouter loop\nvertex 1 2 3\nendloop\n", "part.stl:5: a facet has 1 corners");
  check_error("solid a\nfacet\nouter loop\nvertex 1 2 3\n", "ends inside a facet");
  check_error("solid a\n" TWO "what\n", "\"what\" is no word");
  check_error("hello, this is no model at all, but some text that goes on for more than eighty-four bytes to "
              "see what happens",
              "promises");
}

// --- binary -------------------------------------------------------------------------------------------
enum { MOST = 84 + 50 * 20 };

static size_t make_cube(unsigned char *out, const char *head)
{
  static const unsigned char faces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                            {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  memset(out, 0, MOST);
  memcpy(out, head, strlen(head));
  unsigned char *p = out + 80;
  const uint32_t n = 12;
  memcpy(p, &n, 4);
  p += 4;
  for (int f = 0; f < 6; f++)
    for (int t = 0; t < 2; t++) {
      const int corners[3] = {faces[f][0], faces[f][1 + t], faces[f][2 + t]};
      for (int k = 0; k < 3; k++)
        for (int c = 0; c < 3; c++) {
          const float x = (float)(corners[k] >> c & 1) * 3;
          memcpy(p + 12 + 12 * k + 4 * c, &x, 4);
        }
      p += 50;
    }
  return (size_t)(p - out);
}

TEST(binary_even_if_it_begins_with_solid)
{
  static const char *const heads[] = {"", "solid cube", "solid\nfacet normal"};
  for (int i = 0; i < 3; i++) {
    unsigned char data[MOST];
    Err err;
    const size_t n = make_cube(data, heads[i]);
    Scene *s = load_bytes(data, n, &err);
    CHECK_MSG(s, "%s", err.text);
    if (!s) continue;
    const MeshData *m = s->meshes.items[0].data;
    CHECK(m->vertex_count == 8 && m->triangle_count == 12 && s->notes.lines.count == 0);
    CHECK_NEAR(mesh_volume(m), 27, 1e-5);
    CHECK(!strcmp(s->meshes.items[0].name, "part"));
    scene_destroy(s);
  }
}

TEST(binary_counts_and_extras)
{
  unsigned char data[MOST];
  Err err;
  const size_t n = make_cube(data, "solid cube");
  Scene *s = load_bytes(data, n + 5, &err);
  CHECK(s && has_note(s, "5 bytes after the last triangle"));
  scene_destroy(s);
  CHECK(!load_bytes(data, n - 1, &err));
  CHECK_TEXT(err.text, "promises 12 triangles, but there are bytes for 11");
  memset(data + 80, 0xff, 4);
  CHECK(!load_bytes(data, n, &err));
  CHECK_TEXT(err.text, "promises 4294967295");
  make_cube(data, "");
  data[84 + 48] = 1;
  s = load_bytes(data, n, &err);
  CHECK(s && has_note(s, "colour"));
  scene_destroy(s);
  make_cube(data, "");
  memset(data + 80, 0, 4);
  CHECK(!load_bytes(data, 84, &err));
  CHECK_TEXT(err.text, "holds no triangles");
}

TEST(vertices_that_are_no_numbers_cost_their_triangles)
{
  unsigned char data[MOST];
  Err err;
  const size_t n = make_cube(data, "");
  const float nan = NAN;
  memcpy(data + 84 + 12, &nan, 4);
  Scene *s = load_bytes(data, n, &err);
  CHECK(s && s->meshes.items[0].data->triangle_count == 11);
  scene_destroy(s);
}

// Many distinct vertices make the table grow; each must be found again.
TEST(a_grid_has_one_vertex_a_place)
{
  enum { N = 60 };
  const size_t size = 84 + 50 * 2 * N * N;
  unsigned char *data = calloc(size, 1), *p = data + 84;
  const uint32_t count = 2 * N * N;
  memcpy(data + 80, &count, 4);
  for (int i = 0; i < N * N; i++)
    for (int t = 0; t < 2; t++, p += 50) {
      const int x = i % N, y = i / N;
      const float c[9] = {(float)x,           (float)y,     0, (float)x + 1, (float)(y + t), 0,
                          (float)(x + 1 - t), (float)y + 1, 0};
      memcpy(p + 12, c, sizeof c);
    }
  Err err;
  Scene *s = load_bytes(data, size, &err);
  CHECK(s && s->meshes.items[0].data->vertex_count == (N + 1) * (N + 1));
  scene_destroy(s);
  free(data);
}

TEST(files_of_other_programs)
{
  static const char *const files[] = {"tests/data/assimp.stl", "tests/data/assimp_ascii.stl"};
  for (int i = 0; i < 2; i++) {
    Err err;
    Scene *s = model_load_file(import_stl, files[i], &err);
    CHECK_MSG(s, "%s", err.text);
    if (!s) continue;
    CHECK(s->meshes.items[0].data->vertex_count == 8 && s->meshes.items[0].data->triangle_count == 12);
    CHECK_NEAR(mesh_volume(s->meshes.items[0].data), 8, 1e-5);
    scene_destroy(s);
  }
}

TEST(broken_files_do_not_crash)
{
  unsigned char data[MOST];
  const size_t n = make_cube(data, "solid cube");
  model_break(import_stl, "part.stl", data, n, 2000);
  static const char text[] = "solid a\n" TWO "endsolid\n";
  model_break(import_stl, "part.stl", text, sizeof text - 1, 2000);
  model_write("part.stl", data, n);
  model_starve(import_stl, model_path("part.stl"));
}

TEST(zz_clean)
{
  static const char *const names[] = {"part.stl"};
  model_clean(names, sizeof names / sizeof *names);
}

TEST_MAIN
