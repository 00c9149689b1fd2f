// PLY: all types and orders, what other programs write, and what broken files may not do.

#include "tests/model.h"

static Scene *load_text(const char *text, Err *err)
{
  return model_load(import_ply, "a.ply", text, strlen(text), err);
}

static Scene *load_ok(const char *text)
{
  Err err;
  Scene *s = load_text(text, &err);
  CHECK_MSG(s, "%s", err.text);
  if (s) check_whole(s);
  return s;
}

static void check_error(const char *text, const char *part)
{
  Err err;
  Scene *s = load_text(text, &err);
  CHECK_MSG(!s, "loaded: %.60s", text);
  if (!s) CHECK_TEXT(err.text, part);
  scene_destroy(s);
}

#define HEAD  "ply\nformat ascii 1.0\n"
#define XYZ   "property float x\nproperty float y\nproperty float z\n"
#define VERT3 HEAD "element vertex 3\n" XYZ
#define VERT4 HEAD "element vertex 4\n" XYZ
#define FACE1 "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
#define TRI   "0 0 0\n1 0 0\n1 1 0\n"
#define QUAD  TRI "0 1 0\n"

TEST(a_quad_becomes_two_triangles)
{
  Scene *s = load_ok(VERT4 FACE1 QUAD "4 0 1 2 3\n");
  if (!s) return;
  const MeshData *m = s->meshes.items[0].data;
  CHECK(m->vertex_count == 4 && m->triangle_count == 2 && !m->normals && !m->colors);
  CHECK_NEAR(mesh_area(m), 1, 1e-7);
  CHECK(s->objects.count == 1 && !strcmp(s->objects.items[0].name, "a") && s->materials.count == 0);
  scene_destroy(s);
}

// --- binary, made by hand -----------------------------------------------------------------------------
typedef struct Bytes {
  unsigned char data[2000];
  size_t size;
  bool is_big;
} Bytes;

static void put_text(Bytes *b, const char *text)
{
  memcpy(b->data + b->size, text, strlen(text));
  b->size += strlen(text);
}

static void put(Bytes *b, const void *value, size_t size)
{
  for (size_t i = 0; i < size; i++)
    b->data[b->size++] = ((const unsigned char *)value)[b->is_big ? size - 1 - i : i];
}

static void put_as(Bytes *b, const char *type, double x)
{
  const int64_t n = (int64_t)x;
  const float f = (float)x;
  if (strstr(type, "64") || !strcmp(type, "double"))
    put(b, &x, 8);
  else if (!strncmp(type, "float", 5))
    put(b, &f, 4);
  else
    put(b, &n,
        strstr(type, "8") || strstr(type, "char")     ? 1
        : strstr(type, "16") || strstr(type, "short") ? 2
                                                      : 4);
}

static const char *const types[] = {"char",  "uchar",  "short",   "ushort", "int",   "uint",
                                    "float", "double", "int8",    "uint8",  "int16", "uint16",
                                    "int32", "uint32", "float32", "float64"};

// A tetrahedron with every type for coordinates, indices and counts, and strange properties around each.
static void make_tetrahedron(Bytes *b, int type, bool is_big)
{
  static const int p[4][3] = {{0, 0, 0}, {3, 0, 0}, {0, 5, 0}, {0, 0, 7}},
                   f[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  const char *t = types[type], *count = types[type % 8 < 6 ? type : 1];
  char head[900];
  *b = (Bytes){.is_big = is_big};
  snprintf(head, sizeof head,
           "ply\r\nformat binary_%s_endian 1.0\r\ncomment made by hand\r\nobj_info none\r\nelement junk 2\r\n"
           "property list %s double weights\r\nproperty short s\r\nelement nothing 4000000000\r\n"
           "element vertex 4\r\nproperty uchar flags\r\nproperty %s z\r\nproperty list uchar short more\r\n"
           "property %s y\r\nproperty %s x\r\nelement face 4\r\nproperty float quality\r\n"
           "property list %s %s vertex_index\r\nproperty uchar tail\r\nelement camera 1\r\nproperty float "
           "f\r\nend_header\r\n",
           is_big ? "big" : "little", count, t, t, t, count, t);
  put_text(b, head);
  for (int i = 0; i < 2; i++) {
    put_as(b, count, 2);
    for (int k = 0; k < 2; k++) put_as(b, "double", 1e300);
    put_as(b, "short", -1);
  }
  for (int v = 0; v < 4; v++) {
    put_as(b, "uchar", 255);
    put_as(b, t, p[v][2]);
    put_as(b, "uchar", v);
    for (int k = 0; k < v; k++) put_as(b, "short", 9);
    put_as(b, t, p[v][1]);
    put_as(b, t, p[v][0]);
  }
  for (int i = 0; i < 4; i++) {
    put_as(b, "float", 0.5);
    put_as(b, count, 3);
    for (int k = 0; k < 3; k++) put_as(b, t, f[i][k]);
    put_as(b, "uchar", 7);
  }
  put_as(b, "float", 35);
}

TEST(every_type_in_both_orders)
{
  for (int type = 0; type < 16; type++)
    for (int is_big = 0; is_big < 2; is_big++) {
      Bytes b;
      Err err;
      make_tetrahedron(&b, type, is_big);
      Scene *s = model_load(import_ply, "a.ply", b.data, b.size, &err);
      CHECK_MSG(s, "%s: %s", types[type], err.text);
      if (s) CHECK_NEAR(mesh_volume(s->meshes.items[0].data), 3 * 5 * 7 / 6.0, 1e-5);
      scene_destroy(s);
    }
}

TEST(values_below_zero_and_wide_ones)
{
  Bytes b = {0};
  put_text(&b, "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty char x\nproperty short "
               "y\nproperty uint z\n"
               "element face 1\nproperty list uchar uchar vertex_indices\nend_header\n");
  static const unsigned char body[] = {0xff, 0xff, 0xfe, 0,    0, 0, 1, 0x80, 0x80, 0, 0xff, 0xff, 0xff,
                                       0xff, 0x7f, 0x7f, 0xff, 0, 1, 0, 0,    3,    0, 1,    2};
  memcpy(b.data + b.size, body, sizeof body);
  Err err;
  Scene *s = model_load(import_ply, "a.ply", b.data, b.size + sizeof body, &err);
  CHECK_MSG(s, "%s", err.text);
  if (!s) return;
  const float want[9] = {-1, -2, 1, -128, -32768, 4294967296.0f, 127, 32767, 65536};
  CHECK(!memcmp(s->meshes.items[0].data->positions, want, sizeof want));
  scene_destroy(s);
}

// --- parts of vertices --------------------------------------------------------------------------------
TEST(normals_colors_and_texture_coordinates)
{
  Scene *s = load_ok(
      HEAD
      "element vertex 3\n" XYZ
      "property float nx\nproperty float ny\nproperty float nz\nproperty uchar red\nproperty uchar green\n"
      "property uchar blue\nproperty uchar alpha\nproperty float s\nproperty float t\n" FACE1
      "0 0 0 0 0 2 255 128 0 51 0.25 0.5\n1 0 0 0 0 0 0 0 0 255 1 0\n1 1 0 0 0 -1 1 2 3 0 0 1\n3 0 1 2\n");
  if (!s) return;
  const MeshData *m = s->meshes.items[0].data;
  CHECK(m->normals[2] == 1 && m->normals[8] == -1 && m->normals[4] == 1); // unit; a zero one points up
  CHECK(m->colors[0] == 1 && m->colors[2] == 0);
  CHECK_NEAR(m->colors[1], 0.2158605, 1e-6);
  CHECK_NEAR(m->colors[3], 0.2, 1e-6);
  CHECK(m->texcoords[0][0] == 0.25f && m->texcoords[0][1] == 0.5f && m->texcoords[0][5] == 1);
  CHECK(s->materials.count == 1 && s->materials.items[0].pbr.base_color[0] == 1 &&
        s->meshes.items[0].slots[0] == 0);
  scene_destroy(s);
}

TEST(float_colors_are_linear_and_wide_ones_srgb)
{
  Scene *s = load_ok(HEAD "element vertex 3\n" XYZ
                          "property float red\nproperty float green\nproperty float blue\n" FACE1
                          "0 0 0 0.5 1 2\n1 0 0 0 0 0\n1 1 0 0 0 0\n3 0 1 2\n");
  if (s) CHECK(s->meshes.items[0].data->colors[0] == 0.5f && s->meshes.items[0].data->colors[2] == 2);
  if (s) CHECK(s->meshes.items[0].data->colors[3] == 1);
  scene_destroy(s);
  s = load_ok(HEAD "element vertex 3\n" XYZ
                   "property ushort red\nproperty ushort green\nproperty ushort blue\n" FACE1
                   "0 0 0 32896 65535 0\n1 0 0 0 0 0\n1 1 0 0 0 0\n3 0 1 2\n");
  if (s) CHECK_NEAR(s->meshes.items[0].data->colors[0], 0.2158605, 1e-5);
  scene_destroy(s);
}

TEST(texture_file_and_coordinates_of_faces)
{
  model_write("wood.png", "x", 1);
  Scene *s = load_ok(
      "ply\nformat ascii 1.0\ncomment VCGLIB generated\ncomment TextureFile wood.png\nelement vertex 4\n" XYZ
      "element face 2\nproperty list uchar int vertex_indices\nproperty list uchar float "
      "texcoord\nend_header\n" QUAD "3 0 1 2 6 0 0 1 0 1 1\n3 0 2 3 6 0 0 0.5 0.5 0 1\n");
  if (!s) return;
  const MeshData *m = s->meshes.items[0].data;
  CHECK(m->vertex_count == 5 && m->triangle_count == 2 &&
        m->texcoords[0]); // vertex 2 is split, vertex 0 is not
  CHECK_NEAR(mesh_area(m), 1, 1e-6);
  CHECK(m->triangles[0] == m->triangles[3] && m->triangles[2] != m->triangles[4]);
  CHECK(m->texcoords[0][2 * m->triangles[4]] == 0.5f && m->texcoords[0][2 * m->triangles[2]] == 1);
  CHECK(s->textures.count == 1 && !strcmp(s->textures.items[0].image.file, "wood.png"));
  CHECK(s->materials.count == 1 && s->materials.items[0].pbr.base_color_texture == 0);
  scene_destroy(s);
  s = load_ok("ply\nformat ascii 1.0\ncomment TextureFile gone.png\nelement vertex 3\n" XYZ FACE1 TRI
              "3 0 1 2");
  if (s) CHECK(has_note(s, "gone.png") && s->textures.count == 0);
  scene_destroy(s);
}

TEST(strips_turn_by_turns)
{
  Scene *s = load_ok(HEAD "element vertex 6\n" XYZ
                          "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
                          "0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n1 2 0\n10 0 1 2 3 4 5 -1 0 1 2\n");
  if (!s) return;
  const MeshData *m = s->meshes.items[0].data;
  CHECK(m->triangle_count == 5);
  for (size_t t = 0; t < m->triangle_count; t++) {
    Vec3 p[3];
    for (int k = 0; k < 3; k++) p[k] = v3_load(m->positions + 3 * m->triangles[3 * t + k]);
    CHECK(v3_cross(p[1] - p[0], p[2] - p[0])[2] == 1); // all face the same way
  }
  scene_destroy(s);
}

TEST(faces_may_come_before_vertices)
{
  Scene *s = load_ok(HEAD "element face 1\nproperty list uchar int vertex_indices\nelement vertex 4\n" XYZ
                          "end_header\n"
                          "4 0 1 2 3\n" QUAD);
  if (s) CHECK_NEAR(mesh_area(s->meshes.items[0].data), 1, 1e-7);
  scene_destroy(s);
}

// As Blender 2.4 wrote them.
TEST(a_comment_may_lack_the_word)
{
  Scene *s = load_ok(HEAD "Created by Blender3D 247\nelement vertex 3\n" XYZ FACE1 TRI "3 0 1 2\n");
  if (s) CHECK(s->notes.lines.count == 1);
  if (s) CHECK_TEXT(s->notes.lines.items[0], "line 3 of the header");
  scene_destroy(s);
}

TEST(ascii_is_read_by_words)
{
  Scene *s = load_ok("ply\r\nformat ascii 1.0\r\nelement vertex 3\r\n" XYZ FACE1
                     "0 0 0 1 0\r\n0 1 1e0 0\t3 0\n\n1 2.0");
  if (s) CHECK_NEAR(mesh_area(s->meshes.items[0].data), 0.5, 1e-7);
  scene_destroy(s);
}

// --- errors -------------------------------------------------------------------------------------------
TEST(errors_say_where)
{
  check_error("", "header has no end");
  check_error("plyx\n", "a.ply:1: this is no PLY file");
  check_error("ply\n", "header has no end");
  check_error("ply\nelement vertex 3\n", "a.ply:2: \"format\" must come first");
  check_error("ply\nformat ebcdic 1.0\n", "a.ply:2: \"ebcdic\" is no PLY format");
  check_error(HEAD "property float x\n", "a.ply:3: a property comes before any element");
  check_error(HEAD "element vertex -3\n", "needs a name and a count");
  check_error(HEAD "element vertex 99999999999999999999\n", "needs a name and a count");
  check_error(HEAD "element vertex 3\nproperty quad x\n", "a.ply:4: \"quad\" is no type");
  check_error(HEAD "element vertex 3\nproperty list float int x\n", "a list's count cannot be \"float\"");
  check_error(HEAD "element vertex 3\nproperty float\n", "has no name");
  check_error(HEAD "elephant\n" VERT3, "a.ply:3: this is no line of a PLY header");
  check_error(HEAD "element vertex 3\nproperty float x\n" FACE1 TRI "3 0 1 2", "no x, y and z");
  check_error(VERT3 "element face 1\nproperty int n\nend_header\n" TRI "3", "no list \"vertex_indices\"");
  check_error(VERT3 FACE1 TRI "3 0 1 3\n", "a face names vertex 3, but there are only 3");
  check_error(VERT3 FACE1 TRI "3 0 1 -1\n", "vertex -1");
  check_error(VERT3 FACE1 TRI "3 0 1 2147483648\n", "vertex 2147483648");
  check_error(VERT3 FACE1 TRI "3 0 1\n", "a.ply:14: the file ends early");
  check_error(VERT3 FACE1 "0 0 0\n1 x 0\n", "a.ply:11: \"x\" is not the number");
  check_error(VERT3 FACE1 TRI "99 0 1 2\n", "a list of 99 values does not fit");
  check_error(VERT3 FACE1 TRI "-1 0 1 2\n", "a list of -1 values");
  check_error(VERT3 "end_header\n" TRI, "point cloud");
  check_error(VERT3 FACE1 TRI "2 0 1", "holds no triangles");
  check_error(HEAD "end_header\n", "holds no triangles");
  check_error(VERT3 FACE1 "0 0 0\n1 nan 0\n1 1 0\n3 0 1 2\n", "not finite");
}

TEST(counts_are_held_against_the_bytes_there_are)
{
  check_error("ply\nformat binary_little_endian 1.0\nelement vertex 4294967295\n" XYZ FACE1 "0123456789",
              "byte 178: the header promises 4294967295 of \"vertex\", but only 10 bytes are left");
  check_error(HEAD "element vertex 4000000000\n" XYZ FACE1 TRI, "promises 4000000000");
  check_error(HEAD "element vertex 9223372036854775806\n" XYZ FACE1 TRI, "promises");
  check_error("ply\nformat binary_little_endian 1.0\nelement other 9000000000000000000\nproperty double "
              "x\nend_header\n",
              "promises");
}

TEST(files_of_other_programs)
{
  static const char *const files[] = {"tests/data/assimp.ply", "tests/data/assimp_ascii.ply"};
  for (int i = 0; i < 2; i++) {
    Err err;
    Scene *s = model_load_file(import_ply, files[i], &err);
    CHECK_MSG(s, "%s", err.text);
    if (!s) continue;
    const MeshData *m = s->meshes.items[0].data;
    CHECK(m->vertex_count == 24 && m->triangle_count == 12 && m->normals && m->texcoords[0]);
    CHECK_NEAR(mesh_volume(m), 8, 1e-5);
    scene_destroy(s);
  }
  // Headers as Blender, MeshLab and CloudCompare write them.
  scene_destroy(
      load_ok("ply\nformat ascii 1.0\ncomment Created in Blender version 4.2.0\nelement vertex 3\n" XYZ
              "property float nx\nproperty float ny\nproperty float nz\nproperty float s\nproperty float t\n"
              "element face 1\nproperty list uchar uint vertex_indices\nend_header\n"
              "0 0 0 0 0 1 0 0\n1 0 0 0 0 1 1 0\n1 1 0 0 0 1 1 1\n3 0 1 2\n"));
  scene_destroy(load_ok(
      "ply\nformat ascii 1.0\ncomment VCGLIB generated\nelement vertex 3\n" XYZ
      "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\n"
      "property float quality\nelement face 1\nproperty list uchar int vertex_indices\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\nend_header\n"
      "0 0 0 1 2 3 255 0.5 \n1 0 0 1 2 3 255 0.5 \n1 1 0 1 2 3 255 0.5 \n3 0 1 2 255 255 255 255 \n"));
  scene_destroy(load_ok(
      "ply\nformat ascii 1.0\ncomment Author: CloudCompare v2.12\nobj_info Generated by CloudCompare!\n"
      "element vertex 3\nproperty double x\nproperty double y\nproperty double z\nproperty float scalar_a\n"
      "element face 1\nproperty list int int vertex_indices\nend_header\n"
      "0 0 0 0\n1 0 0 0\n1 1 0 0\n3 0 1 2\n"));
}

TEST(broken_files_do_not_crash)
{
  Bytes b;
  for (int type = 0; type < 16; type += 5) {
    make_tetrahedron(&b, type, type % 2);
    model_break(import_ply, "a.ply", b.data, b.size, 1000);
  }
  static const char text[] =
      "ply\nformat ascii 1.0\ncomment TextureFile wood.png\nelement vertex 5\n" XYZ
      "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 2\n"
      "property list uchar int vertex_indices\nproperty list uchar float texcoord\nend_header\n"
      "0 0 0 1 2 3\n1 0 0 1 2 3\n1 1 0 1 2 3\n0 1 0 1 2 3\n.2 .3 0 1 2 3\n"
      "5 0 1 2 3 4 10 0 0 1 0 1 1 0 1 0 0\n3 0 2 3 6 0 0 0.5 0.5 0 1\n";
  model_break(import_ply, "a.ply", text, sizeof text - 1, 2000);
  model_write("a.ply", text, sizeof text - 1);
  model_starve(import_ply, model_path("a.ply"));
}

TEST(zz_clean)
{
  static const char *const names[] = {"a.ply", "wood.png"};
  model_clean(names, sizeof names / sizeof *names);
}

TEST_MAIN
