// OBJ and MTL: what each statement means, what other programs write, and what broken files may not do.

#include "tests/model.h"

#include "scene/triangulate.h"

static Scene *load_text(const char *text, Err *err)
{
  return model_load(import_obj, "a.obj", text, strlen(text), err);
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
  if (!s) CHECK(err.kind == ERR_BAD_SCENE);
  scene_destroy(s);
}

#define QUAD "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"

TEST(a_quad_becomes_two_triangles_and_an_object)
{
  Scene *s = load_ok("o plate\n" QUAD "f 1 2 3 4\n");
  if (!s) return;
  const MeshData *m = s->meshes.items[0].data;
  CHECK(s->meshes.count == 1 && s->objects.count == 1 && m->vertex_count == 4 && m->triangle_count == 2);
  CHECK(!m->normals && !m->texcoords[0] && !m->colors && !m->material_slots);
  CHECK_NEAR(mesh_area(m), 1, 1e-7);
  CHECK(!strcmp(s->objects.items[0].name, "plate"));
  CHECK(s->objects.items[0].shape.kind == SHAPE_MESH && s->objects.items[0].shape.mesh_i == 0);
  CHECK(s->notes.lines.count == 0);
  scene_destroy(s);
}

TEST(all_forms_of_corners)
{
  Scene *s = load_ok(
      "\xef\xbb\xbf# all\r\n" QUAD "vt 0 0\r\nvt 1 0\r\nvt 0.5 1 0\r\nvn 0 0 2\r\n"
      "f 1/1/1 2/2/1 3/3/1\r\n f\t-4/-3/-1  -2/-1/-1 -1/-2/-1 \t\r\n"
      "f 1//1 2//1 3//1\nf 1 2 3\nf 1/1 2/2 3/3\nf 1/1/ 2/2/ 3/3/\nf 1/ 2/ 3/ # comment\nf 1// 2// 3//");
  if (!s) return;
  const MeshData *m = s->meshes.items[0].data;
  CHECK(m->triangle_count == 8);
  CHECK(m->normals && m->texcoords[0]);
  for (size_t i = 0; i < m->vertex_count; i++)
    CHECK_NEAR(m->normals[3 * i + 2], 1, 1e-6); // unit; or the faces' own
  CHECK(m->texcoords[0][2 * m->triangles[2]] == 0.5f && m->texcoords[0][2 * m->triangles[2] + 1] == 1);
  CHECK(m->positions[3 * m->triangles[4] + 1] == 1); // -2 is the third of four
  scene_destroy(s);
}

TEST(equal_corners_are_one_vertex)
{
  Scene *s = load_ok(QUAD "vn 0 0 1\nvn 0 1 0\nf 1//1 2//1 3//1\nf 1//1 3//1 4//1\nf 1//2 2//2 3//2\n");
  if (!s) return;
  CHECK(s->meshes.items[0].data->vertex_count == 7);
  scene_destroy(s);
}

TEST(corners_without_a_normal_get_the_faces_own)
{
  Scene *s = load_ok("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nvn 1 0 0\nvn 0 0 0\nf 1//1 2 3\nf 1 3 "
                     "4\nf 1 4 5\nf 1//2 2//2 3//2\n");
  if (!s) return;
  const MeshData *m = s->meshes.items[0].data;
  const float *n = m->normals, want[4][3][3] = {{{1, 0, 0}, {0, 0, 1}, {0, 0, 1}},
                                                {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}},
                                                {{1, 0, 0}, {1, 0, 0}, {1, 0, 0}},
                                                {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}}};
  for (int t = 0; t < 4; t++)
    for (int k = 0; k < 3; k++)
      for (int c = 0; c < 3; c++) CHECK_NEAR(n[3 * m->triangles[3 * t + k] + c], want[t][k][c], 1e-6);
  scene_destroy(s);
}

TEST(continued_lines_and_old_mac_line_ends)
{
  Scene *s = load_ok("v 0 0 \\\n0\nv 1 0 0\nv 1 1 0\nf 1 \\\r\n 2 \\\n\\\n 3\n");
  if (s) CHECK(s->meshes.items[0].data->triangle_count == 1);
  scene_destroy(s);
  s = load_ok("v 0 0 0\rv 1 0 0\rv 1 1 0\rf 1 2 3\r");
  if (s) CHECK(s->meshes.items[0].data->triangle_count == 1);
  scene_destroy(s);
  check_error("v 0 0 \\\n0\nv 1 0 0\nf 1 2 3\n", "a.obj:4: the face names vertex 3");
}

TEST(errors_name_the_line)
{
  check_error("", "holds no triangles");
  check_error("# nothing\n", "holds no triangles");
  check_error(QUAD, "holds no triangles");
  check_error(QUAD "f 1 2\n", "holds no triangles");
  check_error(QUAD "f 1 2 5\n", "a.obj:5: the face names vertex 5, but 4 came before this line");
  check_error(QUAD "f 1 2 0\n", "vertex 0");
  check_error(QUAD "f 1 2 2147483648\n", "vertex 2147483648");
  check_error(QUAD "f 1 2 99999999999999999999\n", "vertex 9223372036854775807");
  check_error(QUAD "f 1 2 -999\n", "vertex -999");
  check_error(QUAD "f 1 2 -99999999999999999999\n", "vertex -9223372036854775808");
  check_error(QUAD "f 1/1 2/1 3/1\n", "texture coordinate 1");
  check_error(QUAD "f 1//1 2//1 3//1\n", "normal 1");
  check_error(QUAD "f 1 2 -\n", "a.obj:5: \"-\" is not a corner");
  check_error(QUAD "f 1 2 3x\n", "\"3x\"");
  check_error(QUAD "f 1 2 3/-\n", "\"3/-\"");
  check_error("v 1 -\n", "a.obj:1: a vertex needs three numbers, but number 2 is \"-\"");
  check_error("vt x\n", "a.obj:1: a texture coordinate");
  check_error("vn 1 2\n", "a.obj:1: a normal");
  Err err;
  CHECK(!model_load(import_obj, "a.obj", "v 1 2 \0 3", 9, &err));
  CHECK_TEXT(err.text, "a.obj:1");
  CHECK(!model_load_file(import_obj, model_path("missing.obj"), &err));
  CHECK(err.kind == ERR_NOT_FOUND);
}

TEST(vertices_that_are_no_numbers_cost_their_triangles)
{
  Scene *s = load_ok(QUAD "v nan 0 0\nv 1e400 0 0\nv -1.#IND 0 0\nf 1 2 3\nf 1 2 5\nf 1 2 6\nf 1 2 7\n");
  if (!s) return;
  CHECK(s->meshes.items[0].data->triangle_count == 1);
  CHECK(has_note(s, "3 of 4 triangles"));
  scene_destroy(s);
}

TEST(other_statements_are_noted_once)
{
  Scene *s = load_ok(QUAD "l 1 2\nl 2 3\np 1\ns 1\ns off\ng a b\ncurv 0 1 1 2\n\x01\x02 x\nf 1 2 3\n");
  if (!s) return;
  CHECK(has_note(s, "\"l\" lines are ignored") && has_note(s, "\"p\"") && has_note(s, "\"curv\"") &&
        has_note(s, "not OBJ"));
  CHECK(s->notes.lines.count == 4);
  scene_destroy(s);
}

TEST(vertex_colors_are_srgb_and_make_the_default_white)
{
  Scene *s = load_ok("v 0 0 0 1 0.5 0\nv 1 0 0 1 1 1\nv 1 1 0\nf 1 2 3\n");
  if (!s) return;
  const float *c = s->meshes.items[0].data->colors;
  CHECK(c && c[0] == 1 && c[2] == 0 && c[3] == 1 && c[8] == 1);
  if (c) CHECK_NEAR(c[1], 0.21404114, 1e-5);
  CHECK(s->materials.count == 1 && s->materials.items[0].pbr.base_color[1] == 1);
  CHECK(s->meshes.items[0].slots[0] == 0);
  scene_destroy(s);
  s = load_ok("v 0 0 0 255 128 0\nv 1 0 0 255 255 255\nv 1 1 0 0 0 0\nf 1 2 3\n");
  if (s) CHECK_NEAR(s->meshes.items[0].data->colors[1], 0.2158605, 1e-5);
  scene_destroy(s);
  s = load_ok("v 0 0 0 1\nv 1 0 0 1\nv 1 1 0 1\nf 1 2 3\n"); // a weight
  if (s) CHECK(!s->meshes.items[0].data->colors);
  scene_destroy(s);
}

// --- polygons -----------------------------------------------------------------------------------------
typedef struct Shape2 {
  char *text;
  size_t length;
} Shape2;

static Scene *load_polygon(size_t n, void (*point)(size_t i, size_t n, double xyz[3]))
{
  char *text = malloc(n * 120 + 100), *p = text;
  for (size_t i = 0; i < n; i++) {
    double x[3];
    point(i, n, x);
    p += sprintf(p, "v %.9g %.9g %.9g\n", x[0], x[1], x[2]);
  }
  p += sprintf(p, "f");
  for (size_t i = 1; i <= n; i++) p += sprintf(p, " %zu", i);
  Scene *s = load_ok(text);
  free(text);
  return s;
}

static void circle(size_t i, size_t n, double x[3])
{
  const double a = 2 * M_PI * (double)i / (double)n;
  x[0] = cos(a);
  x[1] = 5;
  x[2] = -sin(a);
}

// Radius 1 and 1/3 in turn, on a tilted plane.
static void star(size_t i, size_t n, double x[3])
{
  const double a = 2 * M_PI * (double)i / (double)n, r = i % 2 ? 1 / 3.0 : 1;
  x[0] = r * cos(a);
  x[1] = r * sin(a);
  x[2] = x[0] + x[1] + 100;
}

static void comb(size_t i, size_t n, double x[3])
{
  const size_t teeth = n / 2 - 1;
  x[2] = 0;
  if (i >= n - 2) {
    x[0] = i == n - 2 ? (double)teeth * 2 : 0;
    x[1] = -1;
  } else {
    x[0] = (double)i;
    x[1] = i % 2 ? 10 : 0;
  }
}

static double shoelace(size_t n, void (*point)(size_t, size_t, double[3]))
{
  double a = 0, p[3], q[3];
  for (size_t i = 0; i < n; i++) {
    point(i, n, p);
    point((i + 1) % n, n, q);
    a += p[0] * q[1] - p[1] * q[0];
  }
  return fabs(a) / 2;
}

TEST(concave_polygons_keep_their_area)
{
  for (size_t n = 4; n <= 400; n = n < 20 ? n + 2 : n * 2) {
    Scene *s = load_polygon(n, star);
    if (!s) continue;
    CHECK(s->meshes.items[0].data->triangle_count == n - 2);
    CHECK_NEAR(mesh_area(s->meshes.items[0].data), shoelace(n, star) * sqrt(3), 1e-4);
    CHECK(s->notes.lines.count == 0);
    scene_destroy(s);
  }
  Scene *s = load_polygon(500, comb);
  if (s) CHECK_NEAR(mesh_area(s->meshes.items[0].data), shoelace(500, comb), 1e-2);
  scene_destroy(s);
}

TEST(a_concave_quad_folds_at_its_reflex_corner)
{
  for (int turn = 0; turn < 4; turn++) {
    char text[200];
    snprintf(text, sizeof text, "v 0 0 0\nv 4 0 0\nv 1 1 0\nv 0 4 0\nf %d %d %d %d\n", turn + 1,
             (turn + 1) % 4 + 1, (turn + 2) % 4 + 1, (turn + 3) % 4 + 1);
    Scene *s = load_ok(text);
    if (s) CHECK_NEAR(mesh_area(s->meshes.items[0].data), 4, 1e-6);
    scene_destroy(s);
  }
}

TEST(huge_polygons_take_linear_time)
{
  Scene *s = load_polygon(100000, circle);
  if (s) CHECK_NEAR(mesh_area(s->meshes.items[0].data), M_PI, 1e-3);
  scene_destroy(s);
  s = load_polygon(100000, star);
  if (s) CHECK(s->meshes.items[0].data->triangle_count == 99998 && has_note(s, "1 polygons"));
  scene_destroy(s);
}

TEST(crossing_and_flat_polygons_end)
{
  static const char *const faces[] = {"f 1 2 3 4 1 2 3 4\n", "f 1 3 2 4 1\n", "f 1 1 1 1 1\n",
                                      "f 1 2 1 2 1 2\n", "f 1 2 3 1 4 3\n"};
  for (size_t i = 0; i < sizeof faces / sizeof *faces; i++) {
    char text[200];
    snprintf(text, sizeof text, QUAD "%s", faces[i]);
    scene_destroy(load_ok(text));
  }
}

TEST(triangulation_gives_up_in_time)
{
  // A spiral whose ears are searched long; with the work spent it must still come out as n - 2 triangles.
  enum { N = 4000 };
  static float corners[3 * N];
  static uint32_t out[3 * N];
  for (int i = 0; i < N; i++) {
    const double a = i < N / 2 ? i * 0.05 : (N - i) * 0.05, r = a + (i < N / 2 ? 0 : 0.5);
    corners[3 * i] = (float)(r * cos(a));
    corners[3 * i + 1] = (float)(r * sin(a));
  }
  Triangulator t;
  triangulator_init(&t);
  t.tests_left = 100000;
  CHECK(triangulate(&t, corners, N, out));
  CHECK(t.tests_left == 0 && t.fan_count == 1);
  for (size_t i = 0; i < 3 * (N - 2); i++) CHECK(out[i] < N);
  triangulator_finish(&t);
}

// --- materials ----------------------------------------------------------------------------------------
static Scene *load_with(const char *mtl, const char *obj)
{
  model_write("my lib.mtl", mtl, strlen(mtl));
  return load_ok(obj);
}

static Scene *load_material(const char *mtl)
{
  char text[4000];
  snprintf(text, sizeof text, "newmtl m 1\n%s", mtl);
  Scene *s = load_with(text, "mtllib my lib.mtl\n" QUAD "usemtl m 1\nf 1 2 3\n");
  CHECK(s && s->materials.count == 1 && s->meshes.items[0].slots[0] == 0);
  if (s && s->materials.count == 1) return s;
  scene_destroy(s);
  return NULL;
}

TEST(slots_follow_usemtl)
{
  Scene *s = load_with("newmtl a\nKd 1 0 0\nnewmtl b\nKd 0 1 0\nnewmtl unused\nnewmtl b\nKd 0 0 1\n",
                       "mtllib nowhere.mtl my lib.mtl\nmtllib my lib.mtl\n" QUAD
                       "f 1 2 3\nusemtl b\nf 1 2 3 4\nusemtl a\nf 1 2 4\nusemtl missing\nf 1 2 3\n");
  if (!s) return;
  const Mesh *m = &s->meshes.items[0];
  CHECK(m->slot_count == 4 && m->data->triangle_count == 5 && s->materials.count == 2);
  const uint16_t want[5] = {0, 1, 1, 2, 3};
  CHECK(m->data->material_slots && !memcmp(m->data->material_slots, want, sizeof want));
  CHECK(m->slots[0] == -1 && m->slots[3] == -1);
  CHECK(s->materials.items[m->slots[1]].pbr.base_color[1] == 1 &&
        s->materials.items[m->slots[2]].pbr.base_color[0] == 1);
  CHECK(has_note(s, "material \"missing\" is not defined") && has_note(s, "nowhere.mtl"));
  scene_destroy(s);
}

TEST(a_missing_library_is_a_note)
{
  Scene *s = load_ok("mtllib gone.mtl\n" QUAD "usemtl m\nf 1 2 3\n");
  if (s) CHECK(has_note(s, "gone.mtl") && s->materials.count == 0 && s->meshes.items[0].slots[0] == -1);
  scene_destroy(s);
  s = load_ok("mtllib ../../../../etc/passwd\n" QUAD "usemtl root\nf 1 2 3\n");
  if (s) CHECK(has_note(s, "--allow-outside"));
  scene_destroy(s);
}

TEST(the_classic_statements)
{
  Scene *s =
      load_material("Ka 1 1 1\nKd 0.25 0.5 0.75\nKs 0.5 0.5 0.5\nNs 30\nNi 1.45\nd 1\nillum 2\nKe 3 2 1\n");
  if (!s) return;
  const Pbr *p = &s->materials.items[0].pbr;
  CHECK(!strcmp(s->materials.items[0].name, "m 1"));
  CHECK(p->base_color[0] == 0.25f && p->base_color[1] == 0.5f && p->base_color[2] == 0.75f);
  CHECK(p->specular == 1 && p->specular_color[0] == 1); // Ks 0.5 is Blender's default, the plain dielectric
  CHECK_NEAR(p->roughness, 0.5, 1e-6);                  // (2 / 32)^(1/4)
  CHECK_NEAR(p->ior, 1.45, 1e-6);
  CHECK(p->alpha_mode == ALPHA_OPAQUE && p->opacity == 1 && p->transmission == 0 && p->metallic == 0);
  CHECK(p->emissive[0] == 3 && p->emissive[2] == 1 && p->emissive_strength == 1);
  CHECK(s->notes.lines.count == 0);
  scene_destroy(s);
}

static void check_real(const char *mtl, size_t offset, float want)
{
  Scene *s = load_material(mtl);
  if (!s) return;
  const float got = *(const float *)(const void *)((const char *)&s->materials.items[0].pbr + offset);
  CHECK_MSG(fabsf(got - want) < 1e-5f, "%s gives %g, not %g", mtl, (double)got, (double)want);
  scene_destroy(s);
}

static void check_whole_number(const char *mtl, size_t offset, int32_t want)
{
  Scene *s = load_material(mtl);
  if (!s) return;
  const int32_t got = *(const int32_t *)(const void *)((const char *)&s->materials.items[0].pbr + offset);
  CHECK_MSG(got == want, "%s gives %d, not %d", mtl, got, want);
  scene_destroy(s);
}

#define REAL(mtl, field, want)  check_real(mtl, offsetof(Pbr, field), want)
#define WHOLE(mtl, field, want) check_whole_number(mtl, offsetof(Pbr, field), want)

TEST(each_statement_has_its_field)
{
  REAL("Ks 0 0 0", specular, 0);
  REAL("Ks 1 1 1\nillum 1", specular, 0);
  REAL("Ks 1 1 1\nillum 1\nPr 0.3", specular, 1);
  REAL("Ks 0.25 0.5 1", specular_color, 0.5f);
  REAL("Ns 100\nPr 0.3", roughness, 0.3f);
  REAL("Ns 0", roughness, 1);
  REAL("Ns -5", roughness, 1);
  REAL("Pr 7", roughness, 1);
  REAL("Pm 0.75", metallic, 0.75f);
  REAL("Kd 0 0 0\nKs 0.9 0.8 0.7\nillum 3", metallic, 1);
  REAL("Kd 0 0 0\nKs 0.9 0.8 0.7\nillum 3", base_color, 0.9f);
  REAL("Kd 0.8 0.5 0.1\nKs 0.5 0.5 0.5\nillum 3", metallic, 0);
  REAL("d 0.25", opacity, 0.25f);
  WHOLE("d 0.25", alpha_mode, ALPHA_BLEND);
  REAL("d -halo 0.25", opacity, 0.25f);
  REAL("Tr 0.25", opacity, 0.75f);
  REAL("d 0.5\nTr 0.9", opacity, 0.5f);
  REAL("Tr 1", opacity, 1);
  WHOLE("Tr 1", alpha_mode, ALPHA_OPAQUE);
  REAL("d 0.25\nillum 9", opacity, 0.25f);
  REAL("d 0.25\nillum 9", transmission, 0);
  REAL("d 0.25\nillum 6", transmission, 0.75f);
  REAL("d 0.25\nillum 6", opacity, 1);
  WHOLE("d 0.25\nillum 6", alpha_mode, ALPHA_OPAQUE);
  REAL("illum 7\nKd 0 0 0\nNi 1.33", transmission, 1);
  REAL("illum 7\nKd 0 0 0\nNi 1.33", base_color, 1);
  REAL("illum 7\nKd 0 0 0\nNi 1.33", ior, 1.33f);
  REAL("illum 7\nNs 10", roughness, 0);
  REAL("illum 4\nTf 0.5 0.25 0.5", transmission, 0.5f);
  REAL("Tf 1 1 1\nillum 2", transmission, 0);
  REAL("Ni 1", ior, 1.5f);
  REAL("Ni 0", ior, 1.5f);
  REAL("Ni 77", ior, 5);
  REAL("Pc 0.5\nPcr 0.25", clearcoat, 0.5f);
  REAL("Pc 0.5\nPcr 0.25", clearcoat_roughness, 0.25f);
  REAL("Ps 0.4", sheen_color, 0.4f);
  REAL("Ps 0.4", sheen_roughness, 0.5f);
  REAL("aniso 0.3\nanisor 0.25", anisotropy, 0.3f);
  REAL("aniso 0.3\nanisor 0.25", anisotropy_rotation, 90);
  REAL("aniso -0.3\nanisor 0.25", anisotropy_rotation, 180);
  REAL("Kd 0.5", base_color, 0.5f);
  REAL("Kd nan 1 1", base_color, 0.8f);
  REAL("Kd 9 9 9", base_color, 1);
  REAL("kd 0.5 0.5 0.5", base_color, 0.5f);
}

TEST(what_cannot_be_shown_is_noted)
{
  Scene *s = load_material(
      "map_Ns x.png\ndisp x.png\ndecal x.png\nrefl -type sphere x.png\n"
      "Kd red\nd\n");
  if (!s) return;
  static const char *const words[] = {"\"map_Ns\"", "\"disp\"",         "\"decal\"",
                                      "\"refl\"",   "Kd needs numbers", "d needs numbers"};
  for (size_t i = 0; i < sizeof words / sizeof *words; i++) CHECK_MSG(has_note(s, words[i]), "%s", words[i]);
  CHECK(s->notes.lines.count == 6);
  scene_destroy(s);
}

TEST(maps_and_their_options)
{
  model_write("my tex.png", "x", 1);
  model_write("1.png", "x", 1);
  model_write("t_normal.png", "x", 1);
  Scene *s =
      load_material("Kd 0 0 0\nmap_Kd -o 0.5 0.25 -s 2 3 1 -clamp on -blendu off -mm 0.1 2 my tex.png\n"
                    "map_Ks my tex.png\nmap_Ke -s 2 1.png\nmap_Pr -imfchan g my tex.png\nmap_Pm my tex.png\n"
                    "map_Bump -bm 0.75 t_normal.png\nmap_d my tex.png\n");
  if (!s) return;
  const Pbr *p = &s->materials.items[0].pbr;
  CHECK(s->textures.count == 4); // my tex.png in two ways, 1.png, t_normal.png
  CHECK(p->base_color_texture == 0 && p->base_color[0] == 1);
  const Texture *t = &s->textures.items[0];
  CHECK(!strcmp(t->image.file, "my tex.png"));
  CHECK(t->common.offset[0] == 0.5f && t->common.offset[1] == 0.25f && t->common.scale[0] == 2 &&
        t->common.scale[1] == 3);
  CHECK(t->image.wrap_u == WRAP_CLAMP && t->image.wrap_v == WRAP_CLAMP && t->image.encoding == ENCODING_AUTO);
  CHECK(t->image.gain[2] == 2 && t->image.bias[2] == 0.1f);
  CHECK(p->specular_color_texture >= 0 && p->roughness_texture == p->specular_color_texture &&
        p->metallic_texture == p->roughness_texture);
  CHECK(p->roughness == 1 && p->metallic == 1 && p->roughness_channel == 1 && p->metallic_channel == 0);
  CHECK(p->emissive_texture >= 0 && p->emissive[0] == 1);
  if (p->emissive_texture >= 0) {
    CHECK(!strcmp(s->textures.items[p->emissive_texture].image.file, "1.png"));
    CHECK(s->textures.items[p->emissive_texture].common.scale[0] == 2);
  }
  CHECK(p->normal_texture >= 0 && p->normal_scale == 0.75f);
  // map_d names the picture of map_Kd: its alpha is meant, which comes with the base colour.
  CHECK(p->opacity_texture == -1 && p->alpha_mode == ALPHA_BLEND && p->opacity == 1);
  scene_destroy(s);
}

TEST(map_files_from_elsewhere)
{
  model_write("my tex.png", "x", 1);
  Scene *s = load_material(
      "map_Kd C:\\Users\\me\\my tex.png\nmap_Ks /etc/passwd\nmap_Ke \"my tex.png\"\nbump my tex.png\n"
      "map_d none.png\nmap_Pr\n");
  if (!s) return;
  const Pbr *p = &s->materials.items[0].pbr;
  CHECK(p->base_color_texture == 0 && s->textures.count == 1 && p->emissive_texture == 0);
  CHECK(p->specular_color_texture == -1 && has_note(s, "/etc/passwd"));
  CHECK(p->normal_texture == -1 && p->bump_texture == p->base_color_texture && p->bump_scale == 0.01f);
  CHECK(p->opacity_texture == -1 && p->alpha_mode == ALPHA_OPAQUE && has_note(s, "none.png"));
  CHECK(p->roughness_texture == -1 && has_note(s, "without a file name"));
  scene_destroy(s);
}

// --- other programs' files ----------------------------------------------------------------------------
TEST(files_of_other_programs)
{
  Err err;
  Scene *s = model_load_file(import_obj, "tests/data/assimp.obj", &err);
  CHECK_MSG(s, "%s", err.text);
  if (s) {
    CHECK(s->meshes.items[0].data->triangle_count == 12);
    CHECK_NEAR(mesh_volume(s->meshes.items[0].data), 8, 1e-5);
    CHECK(s->meshes.items[0].data->normals && s->materials.count == 1);
  }
  scene_destroy(s);
  s = model_load_file(import_obj, "tests/data/blender.obj", &err);
  CHECK_MSG(s, "%s", err.text);
  if (s) {
    const MeshData *m = s->meshes.items[0].data;
    CHECK(m->triangle_count == 12 && m->vertex_count == 24 && m->normals && m->texcoords[0]);
    CHECK_NEAR(mesh_volume(m), 8, 1e-5);
    CHECK(!strcmp(s->meshes.items[0].name, "Cube"));
    const Pbr *p = &s->materials.items[0].pbr;
    CHECK(p->specular_color[0] == 1 && p->ior == 1.45f && p->alpha_mode == ALPHA_OPAQUE);
    CHECK(s->notes.lines.count == 0);
  }
  scene_destroy(s);
}

// --- broken files -------------------------------------------------------------------------------------
static const char small[] =
    "mtllib my lib.mtl\no a\nv 0 0 0 1 0 0\nv 1 0 0\nv 1 1 \\\n 0\nv 0 1 0\nv .2 .3 0\nvt 0 1\nvn 0 0 1\n"
    "usemtl m 1\nf 1/1/1 2/1/1 3/1/1 4/1/1 5/1/1\ns 1\nusemtl q\nf -1 -2 -3\nl 1 2\n";
static const char small_mtl[] =
    "newmtl m 1\nKd 1 .5 0\nNs 20\nd 0.5\nmap_Kd -o 1 2 my tex.png\nillum 6\nTf 1 1 1\nnewmtl q\nKe 1\n";

TEST(broken_files_do_not_crash)
{
  model_write("my tex.png", "x", 1);
  model_write("my lib.mtl", small_mtl, sizeof small_mtl - 1);
  model_break(import_obj, "a.obj", small, sizeof small - 1, 2000);
}

// import_obj on a fixed OBJ, with the broken bytes as its MTL.
static bool import_mtl_bytes(Scene *s, const char *path, const LoadOptions *options, Err *err)
{
  (void)path;
  return import_obj(s, model_path("fixed.obj"), options, err);
}

TEST(broken_libraries_do_not_fail_the_model)
{
  static const char obj[] = "mtllib my lib.mtl\n" QUAD "usemtl m 1\nf 1 2 3\nusemtl q\nf 1 2 3\n";
  model_write("my tex.png", "x", 1);
  model_write("fixed.obj", obj, sizeof obj - 1);
  model_break(import_mtl_bytes, "my lib.mtl", small_mtl, sizeof small_mtl - 1, 1000);
}

TEST(running_out_of_memory_is_an_error)
{
  model_write("my tex.png", "x", 1);
  model_write("my lib.mtl", small_mtl, sizeof small_mtl - 1);
  model_write("a.obj", small, sizeof small - 1);
  model_starve(import_obj, model_path("a.obj"));
}

TEST(long_lines_and_deep_repeats)
{
  enum { N = 10 << 20 };
  char *text = malloc(N + 200);
  const size_t head = (size_t)sprintf(text, QUAD "f 1 2 3\n");
  static const char *const fills[] = {"# ", "usemtl ", "f ", "v ", "mtllib ", "x", "g "};
  for (size_t i = 0; i < sizeof fills / sizeof *fills; i++) {
    const size_t n = (size_t)sprintf(text + head, "%s", fills[i]);
    memset(text + head + n, 'a', N);
    Err err;
    Scene *s = model_load(import_obj, "a.obj", text, head + n + N, &err);
    CHECK_MSG(!s == (*fills[i] == 'f' || *fills[i] == 'v'), "%s", fills[i]);
    scene_destroy(s);
  }
  char *p = text + head; // a new material, group and kind of line again and again
  for (int i = 0; p < text + (1 << 20); i++)
    p += sprintf(p, "usemtl m%d\ng g%d\no o%d\nk%d\nmtllib l%d\nf 1 2 3\n", i, i, i, i, i);
  Err err;
  Scene *s = model_load(import_obj, "a.obj", text, (size_t)(p - text), &err);
  CHECK_MSG(s, "%s", err.text);
  scene_destroy(s);
  free(text);
}

TEST(zz_clean)
{
  static const char *const names[] = {"a.obj",      "fixed.obj", "my lib.mtl",
                                      "my tex.png", "1.png",     "t_normal.png"};
  model_clean(names, sizeof names / sizeof *names);
}

TEST_MAIN
