// NoEucRT's files of elements: each kind becomes the cells and gates that it means, by the numbers its description
// gives; what is wrong with a file is said with file, line and reason.

#include "tests/test.h"

#include "scene/gates.h"

#include <unistd.h>

#define DOOR "v -50 -100 -400\nv -50 50 -400\r\nv 50 -100 -400\nv 50 50 -400\nf 3 4 2\nf 3 2 1\n"
// x 495..805, y -205..105, z -595..-5
#define BOX                                                                                                              \
  "v 495 -205 -5\nv 805 -205 -5\nv 805 105 -5\nv 495 105 -5\nv 495 -205 -595\nv 805 -205 -595\nv 805 105 -595\nv 495 105 -595\n" \
  "f 1 2 3\nf 1 3 4\nf 6 5 8\nf 6 8 7\nf 5 1 4\nf 5 4 8\nf 2 6 7\nf 2 7 3\nf 4 3 7\nf 4 7 8\nf 5 6 2\nf 5 2 1\n"

static Scene *element_of(const char *kind, const char *text, Err *err)
{
  char path[] = "/tmp/rayfold-element-XXXXXX";
  const int fd = mkstemp(path);
  const size_t size = strlen(text);
  CHECK(fd >= 0 && write(fd, text, size) == (ssize_t)size);
  close(fd);
  const LoadOptions options = {.element = kind};
  Scene *s = scene_load(path, &options, err);
  unlink(path);
  return s;
}

static Scene *good(const char *kind, const char *text, GateLink links[][2])
{
  Err err = {0};
  Scene *s = element_of(kind, text, &err);
  CHECK_MSG(s, "%s: %s", kind, err.text);
  if (!s) exit(1);
  CHECK_MSG(gates_link(s, links, NULL, NULL, &err), "%s", err.text);
  return s;
}

static void check_point(Vec3 p, float x, float y, float z)
{
  CHECK_MSG(v3_length(p - (Vec3){x, y, z}) < 2e-3f, "%g %g %g", (double)p[0], (double)p[1], (double)p[2]);
}

static const Gate *gate_named(const Scene *s, const char *name, int *i)
{
  for (size_t k = 0; k < s->gates.count; k++)
    if (!strcmp(s->gates.items[k].name, name)) return *i = (int)k, &s->gates.items[k];
  CHECK_MSG(false, "no gate %s", name);
  exit(1);
}

TEST(a_portal_shifts_by_exit_minus_centre_both_ways_alike)
{
  GateLink links[4][2];
  Scene *s = good("portal", DOOR "c 0 -25 -400\ne 10000 25 0\nfog 3\n", links);
  CHECK(s->gates.count == 1 && s->gates.items[0].kind == GATE_POLYGON && s->gates.items[0].polygon.points->count == 4);
  CHECK(s->notes.lines.count == 1 && strstr(s->notes.lines.items[0], ":9: \"fog\" means nothing in a portal"));
  const Frame f = gate_frame(&s->gates.items[0]);
  check_point(f.p, 0, -25, -400);
  check_point(f.z, 0, 0, 1);
  for (int side = 0; side < 2; side++) {
    CHECK(links[0][side].exists);
    check_point(frame_point(&links[0][side].map, (Vec3){10, 20, -400}), 10010, 70, 0);
    check_point(frame_vector(&links[0][side].map, (Vec3){1, 2, 3}), 1, 2, 3);
  }
  scene_destroy(s);
}

TEST(a_slanted_portal_and_a_box_are_portals_too)
{
  GateLink links[4][2];
  Scene *s = good("portal", "v 0 0 0\nv 2 0 -1\nv 2 3 -1\nv 1 4 -0.5\nv 0 3 0\nf 1 2 3\nf 1 3 4\nf 1 4 5\nc 0 0 0\ne 0 0 7 1\n", links);
  const Gate *g = &s->gates.items[0];
  const Frame f = gate_frame(g);
  CHECK(g->polygon.points->count == 5);
  check_point(frame_vector(&f, (Vec3){0, 0, 1}), 1 / sqrtf(5), 0, 2 / sqrtf(5));
  float least = INFINITY; // each corner is where the file has it
  for (int i = 0; i < 5; i++)
    least = fminf(least, v3_length(frame_point(&f, (Vec3){g->polygon.points->xy[2 * i], g->polygon.points->xy[2 * i + 1], 0}) - (Vec3){1, 4, -0.5f}));
  CHECK_NEAR(least, 0, 1e-4);
  check_point(links[0][FRONT].map.p, 0, 0, 7);
  scene_destroy(s);
  s = good("PORTAL", BOX "c 0 0 0\ne 0 0 -550\n", links);
  CHECK(s->gates.items[0].kind == GATE_BOX);
  CHECK_NEAR(s->gates.items[0].box.size[2], 590, 1e-3);
  check_point(links[0][FRONT].map.p, 0, 0, -550);
  scene_destroy(s);
}

// Through a tunnel and out of it again: from the gate `in` along the cell to `out`, as one map of both.
static void check_through(const char *kind, const char *text, Vec3 in, float inner_length, Vec3 expected, Vec3 expected_x)
{
  GateLink links[4][2];
  Scene *s = good(kind, text, links);
  int a, b;
  gate_named(s, "in", &a);
  gate_named(s, "out, inside", &b);
  const Vec3 inside = frame_point(&links[a][FRONT].map, in) + (Vec3){0, 0, -inner_length};
  check_point(frame_point(&links[b][FRONT].map, inside), expected[0], expected[1], expected[2]);
  const Vec3 x = frame_vector(&links[b][FRONT].map, frame_vector(&links[a][FRONT].map, (Vec3){1, 0, 0}));
  check_point(x, expected_x[0], expected_x[1], expected_x[2]);
  CHECK(s->cells.count == 1 && s->objects.count >= 1);
  scene_destroy(s);
}

TEST(tunnels_are_as_long_wide_and_wrung_inside_as_the_original_says)
{
  const Vec3 in = {650, -150, -5}, out = {650, -150, -595}, same = {1, 0, 0};
  check_through("warped", BOX "c 1\nd 0 0 -1\ni 3\n", in, 147.5f, out, same);
  check_through("warped", BOX "c 0\nd 0 0 -1\ni 0.8\n", in, 2950, out, same);
  check_through("warped", BOX "d 0 0 -1\ni 1\n", in, 295, out, same);
  // One is 0.3 as large at the end, so stands 0.3 as high over the floor at -205.
  const float log_length = 590 * logf(1 / 0.3f) / 0.7f;
  check_through("shrink", BOX "d 0 0 -1\ni 0.3\nl 590\nc 105\n", in, log_length, (Vec3){650, -205 + 0.3f * 55, -595}, (Vec3){0.3f, 0, 0});
  // Half a turn: what was below the middle is above it, and left is right.
  check_through("rotation", BOX "d 0 0 -1\ni 180\na 0 0 1\nl 590\n", in, 590, (Vec3){650, 50, -595}, (Vec3){-1, 0, 0});
}

TEST(a_material_is_phong_of_one_number_each)
{
  GateLink links[1][2];
  Scene *s = good("material", "Ka 0.1 0.1 0.1\nkd 0.6\nks 0.3\nns 20\n", links);
  const Material *m = &s->materials.items[0];
  CHECK(s->materials.count == 1 && m->kind == MATERIAL_PHONG && m->phong.exponent == 20);
  CHECK_NEAR(m->phong.ambient[1], 0.1, 1e-6);
  CHECK_NEAR(m->phong.diffuse[2], 0.6, 1e-6);
  CHECK_NEAR(m->phong.specular[0], 0.3, 1e-6);
  scene_destroy(s);
}

TEST(bad_elements_are_refused_with_line_and_reason)
{
  static const struct {
    const char *kind, *text, *says;
  } cases[] = {
      {"portal", DOOR "c 0 0 0\n", "needs a line \"e\""},
      {"portal", DOOR "e 0 0 0\n", "needs a line \"c\""},
      {"portal", "c 0 0 0\ne 1 0 0\n", "needs a mesh"},
      {"portal", DOOR "c 0 0\ne 1 0 0\n", ":7: \"c\" of a portal takes three numbers"},
      {"portal", DOOR "c 0 0 0\ne 0 0 0\n", ":8: \"e\" is the centre"},
      {"portal", "v 0 0 0\nv 1 0 0\nv 0 1 1\nv 1 1 0\nf 1 2 3\nf 2 4 3\nc 0 0 0\ne 1 0 0\n", "must be flat"},
      {"portal", DOOR "f 1 2 5\nc 0 0 0\ne 1 0 0\n", ":7: corner 5 is not among the 4 vertices"},
      {"portal", DOOR "f 1 2\n", ":7: a face has three corners"},
      {"warped", BOX "i 3\n", "needs a line \"d\""},
      {"warped", BOX "d 0 0 -1\nc 0\ni 1\n", "endless"},
      {"warped", BOX "d 0 1 -1\ni 1\n", "along x, y or z"},
      {"warped", DOOR "d 0 0 -1\ni 1\n", "must be a box"},
      {"shrink", BOX "d 0 0 -1\ni 0.3\nl 0\n", ":23: \"l\" must be larger than 0"},
      {"shrink", BOX "d 0 0 -1\ni 0\nl 3\n", ":22: \"i\" must be larger than 0"},
      {"rotation", BOX "d 0 0 -1\ni 300\na 0 1 0\nl 590\n", ":23: \"a\" must lie along z"},
      {"material", "ka 2\n", ":1: \"ka\" must be between 0 and 1"},
      {"door", DOOR, "there is no element \"door\""},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    Err err = {0};
    Scene *s = element_of(cases[i].kind, cases[i].text, &err);
    CHECK_MSG(!s, "case %zu", i);
    CHECK_TEXT(err.text, cases[i].says);
    scene_destroy(s);
  }
}

TEST_MAIN
