// Walking and looking through gates, by the public interface: no jump at a gate, the same way in few steps or many, back
// to the start on the way back, and no one ever lost.

#include "tests/place.h"

static rf_body body_at(float x, float y, float z, int cell)
{
  return (rf_body){.frame = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {x, y, z}}, .scale = 1, .cell = cell};
}

static double apart(rf_vec3 a, rf_vec3 b)
{
  return sqrt(pow((double)(a.x - b.x), 2) + pow((double)(a.y - b.y), 2) + pow((double)(a.z - b.z), 2));
}

// A tunnel 6 m long that goes on for ever; a ball hangs in it.
static const char tunnel[] =
    "{ \"rayfold\": 1, \"gates\": {"
    "\"near\": { \"kind\": \"rect\", \"size\": [4, 3], \"translate\": [0, 1.5, 2], \"rotate\": [0, 180, 0], \"to\": \"far\" %s },"
    "\"far\": { \"kind\": \"rect\", \"size\": [4, 3], \"translate\": [0, 1.5, -4] %s } },"
    "\"objects\": [ { \"shape\": { \"kind\": \"sphere\", \"radius\": 0.5 }, \"translate\": [1.4, 2.4, -1] } ] }";

TEST(a_walk_is_the_same_in_few_steps_and_in_many)
{
  char json[1000];
  for (int walled = 0; walled < 2; walled++) {
    snprintf(json, sizeof json, tunnel, walled ? ", \"wall\": true" : "", walled ? ", \"wall\": true" : "");
    Place p = place_of(json);
    rf_body one = body_at(-0.5f, 1.5f, 0, 0), few = one, many = one;
    int gates[3] = {0};
    const float length = 1003; // 4 to the first gate, and 166 tunnels and a half
    gates[0] += rf_walk(p.world, &one, (rf_vec3){0, 0, -length}, true).gates;
    for (int i = 0; i < 5; i++) gates[1] += rf_walk(p.world, &few, (rf_vec3){0, 0, -length / 5}, true).gates;
    for (int i = 0; i < 5000; i++) gates[2] += rf_walk(p.world, &many, (rf_vec3){0, 0, -length / 5000}, true).gates;
    CHECK_MSG(gates[0] == 167 && gates[1] == 167 && gates[2] == 167, "%d %d %d", gates[0], gates[1], gates[2]);
    // 5000 additions of floats are known to about a millimetre.
    CHECK_MSG(apart(one.frame.p, (rf_vec3){-0.5f, 1.5f, -1}) < 1e-4, "z %g", (double)one.frame.p.z);
    CHECK_MSG(apart(few.frame.p, (rf_vec3){-0.5f, 1.5f, -1}) < 1e-4, "z %g", (double)few.frame.p.z);
    CHECK_MSG(apart(many.frame.p, (rf_vec3){-0.5f, 1.5f, -1}) < 3e-3, "z %g", (double)many.frame.p.z);
    leave(&p);
  }
}

// Doors that turn, halve and mirror.
static const char doors[] =
    "{ \"rayfold\": 1, \"cells\": { \"b\": { \"gravity\": [0, 0, -5] } }, \"gates\": {"
    "\"a\": { \"kind\": \"rect\", \"size\": [2, 2], \"translate\": [0, 1, -3], \"to\": \"b\", \"mirror\": true },"
    "\"b\": { \"kind\": \"rect\", \"cell\": \"b\", \"size\": [1, 1], \"translate\": [5, 0.5, 1], \"rotate\": [0, 70, 30] } },"
    "\"objects\": [ { \"shape\": { \"kind\": \"quad\", \"size\": [20, 20] }, \"rotate\": [-90, 0, 0] },"
    "{ \"cell\": \"b\", \"shape\": { \"kind\": \"sphere\", \"radius\": 60 }, \"translate\": [5, 0, 1] } ] }";

TEST(forth_and_back_regains_the_start)
{
  Place p = place_of(doors);
  CHECK(rf_find_cell(p.scene, "b") == 1 && rf_find_cell(p.scene, NULL) == 0 && rf_find_cell(p.scene, "c") == -1);
  CHECK(rf_gravity(p.world, 1).z == -5 && rf_gravity(p.world, 0).y == -9.81f);
  const rf_body start = body_at(0.3f, 1.2f, 0.5f, 0);
  rf_body b = start;
  b.velocity = (rf_vec3){0, 0, -2};
  rf_hit hit;
  rf_arrival seen;
  const rf_ray ahead = {b.frame.p, 0, {0.02f, 0.01f, -1}, INFINITY};
  CHECK(rf_look(p.world, 0, &ahead, &hit, &seen) && seen.cell == 1);
  const float far = hit.t;
  const rf_walk_end end = rf_walk(p.world, &b, (rf_vec3){0.02f * 6, 0.01f * 6, -6}, true);
  CHECK(end.gates == 1 && !end.is_blocked && end.done == 1 && b.cell == 1);
  CHECK_NEAR(b.scale, 0.5, 1e-6);
  CHECK_NEAR(sqrt(pow((double)b.velocity.x, 2) + pow((double)b.velocity.y, 2) + pow((double)b.velocity.z, 2)), 1, 1e-5);
  // What was ahead is nearer by the way that was walked, and looks the same: there was no jump.
  const rf_frame f = b.frame;
  const rf_vec3 on = {0.02f * f.x.x + 0.01f * f.y.x - f.z.x, 0.02f * f.x.y + 0.01f * f.y.y - f.z.y, 0.02f * f.x.z + 0.01f * f.y.z - f.z.z};
  const rf_ray there = {f.p, 0, {on.x / 2, on.y / 2, on.z / 2}, INFINITY};
  rf_hit again;
  CHECK(rf_look(p.world, 1, &there, &again, NULL));
  CHECK_NEAR(again.t, far - 6, 1e-3);
  const double hand = (double)((f.x.y * f.y.z - f.x.z * f.y.y) * f.z.x + (f.x.z * f.y.x - f.x.x * f.y.z) * f.z.y + (f.x.x * f.y.y - f.x.y * f.y.x) * f.z.z);
  CHECK_NEAR(hand, -1, 1e-5); // left-handed now
  rf_walk(p.world, &b, (rf_vec3){-on.x * 3, -on.y * 3, -on.z * 3}, true);
  CHECK(b.cell == 0 && apart(b.frame.p, start.frame.p) < 2e-5);
  CHECK(apart(b.frame.x, start.frame.x) < 1e-5 && apart(b.frame.z, start.frame.z) < 1e-5);
  CHECK_NEAR(b.scale, 1, 1e-6);
  leave(&p);
}

TEST(surfaces_stop_a_walk_and_the_rest_is_told)
{
  Place p = place_of(doors);
  rf_body b = body_at(0, 1, 0, 0);
  const rf_walk_end end = rf_walk(p.world, &b, (rf_vec3){0, -4, 0}, true);
  CHECK(end.is_blocked && end.surface.n.y > 0.99f);
  CHECK_NEAR(end.done, 0.25, 1e-5);
  CHECK_NEAR(end.left.y, -3, 1e-4);
  CHECK_NEAR(b.frame.p.y, 0, 1e-5);
  rf_body ghost = body_at(0, 1, 0, 0);
  CHECK(rf_walk(p.world, &ghost, (rf_vec3){0, -4, 0}, false).done == 1);
  CHECK_NEAR(ghost.frame.p.y, -3, 1e-5);
  leave(&p);
}

// The compressed tunnel of the thesis, six metres long outside and a quarter of that within: eye and feet agree, and light
// shifts aside by what is within only.
TEST(a_compressed_tunnel_is_as_short_to_walk_as_it_looks)
{
  Place p = place_of("{ \"rayfold\": 1, \"cells\": { \"inside\": {} }, \"gates\": {"
                     "\"front\": { \"kind\": \"rect\", \"size\": [2, 2], \"to\": \"first\" },"
                     "\"first\": { \"kind\": \"rect\", \"cell\": \"inside\", \"size\": [2, 2], \"translate\": [0, 0, 0.75], \"rotate\": [0, 180, 0], \"wall\": true },"
                     "\"back\": { \"kind\": \"rect\", \"size\": [2, 2], \"translate\": [0, 0, -6], \"rotate\": [0, 180, 0], \"to\": \"last\" },"
                     "\"last\": { \"kind\": \"rect\", \"cell\": \"inside\", \"size\": [2, 2], \"translate\": [0, 0, -0.75], \"wall\": true } },"
                     "\"objects\": [ { \"shape\": { \"kind\": \"quad\", \"size\": [9, 9] }, \"translate\": [0, 0, -8] },"
                     "{ \"cell\": \"inside\", \"shape\": { \"kind\": \"quad\", \"size\": [2, 2] }, \"translate\": [0, -1, 0], \"rotate\": [-90, 0, 0] } ] }");
  const rf_ray ray = {{0, 0, 0.5f}, 0, {0.2f, 0, -1}, INFINITY};
  rf_hit hit;
  rf_arrival at;
  CHECK(rf_look(p.world, 0, &ray, &hit, &at) && at.cell == 0);
  CHECK_NEAR(hit.t, 0.5 + 1.5 + 2, 1e-5);
  const rf_surface s = rf_surface_at(p.world, &at.ray, &hit);
  CHECK_NEAR(s.position.x, 0.2 * 4, 1e-5);
  CHECK_NEAR(s.position.z, -8, 1e-5);
  rf_body b = body_at(0, 0, 0.5f, 0);
  const rf_walk_end end = rf_walk(p.world, &b, (rf_vec3){0, 0, -3}, true);
  CHECK(end.gates == 2 && b.cell == 0);
  CHECK_NEAR(b.frame.p.z, -7, 1e-5); // half a metre before, one and a half within, one behind
  leave(&p);
}

// A cube glued to itself on all sides, by walls or by mere gates: a drunkard never gets out.
TEST(nobody_is_lost)
{
  static const char cube[] =
      "{ \"rayfold\": 1, \"gates\": {"
      "\"x0\": { \"kind\": \"rect\", \"size\": [2, 2], \"translate\": [-1, 0, 0], \"rotate\": [0, 90, 0], \"to\": \"x1\" %s },"
      "\"x1\": { \"kind\": \"rect\", \"size\": [2, 2], \"translate\": [1, 0, 0], \"rotate\": [0, -90, 0] %s },"
      "\"y0\": { \"kind\": \"rect\", \"size\": [2, 2], \"translate\": [0, -1, 0], \"rotate\": [-90, 0, 0], \"to\": \"y1\" %s, \"mirror\": false },"
      "\"y1\": { \"kind\": \"rect\", \"size\": [2, 2], \"translate\": [0, 1, 0], \"rotate\": [90, 0, 0] %s },"
      "\"z0\": { \"kind\": \"rect\", \"size\": [2, 2], \"translate\": [0, 0, -1], \"to\": \"z1\" %s },"
      "\"z1\": { \"kind\": \"rect\", \"size\": [2, 2], \"translate\": [0, 0, 1], \"rotate\": [0, 180, 0] %s } },"
      "\"objects\": [ { \"shape\": { \"kind\": \"sphere\", \"radius\": 0.2 } } ] }";
  const char *wall = ", \"wall\": true";
  char json[2000];
  snprintf(json, sizeof json, cube, wall, wall, wall, wall, wall, wall);
  Place p = place_of(json);
  uint32_t seed = 1;
  rf_body b = body_at(0.5f, 0.5f, 0.5f, 0);
  int outside = 0, gates = 0;
  const int steps = (TEST_IS_SLOW ? 20000 : 200000) * (int)test_intensity();
  for (int i = 0; i < steps; i++) {
    float m[3];
    for (int k = 0; k < 3; k++) {
      seed = seed * 1664525u + 1013904223u;
      m[k] = ((float)(seed >> 8) * 0x1p-24f - 0.5f) * 3;
    }
    gates += rf_walk(p.world, &b, (rf_vec3){m[0], m[1], m[2]}, false).gates;
    const rf_vec3 at = b.frame.p;
    outside += !(fabsf(at.x) <= 1 && fabsf(at.y) <= 1 && fabsf(at.z) <= 1);
  }
  CHECK_MSG(outside == 0, "%d of %d steps ended outside", outside, steps);
  CHECK_MSG(gates > steps / 2, "%d", gates);
  leave(&p);
}

// A wormhole is walked through in one step or in many, straight to its middle, and back; a black hole stops who comes.
TEST(balls_that_bend_light)
{
  Place p = place_of("{ \"rayfold\": 1, \"cells\": { \"b\": {} }, \"gates\": {"
                     "\"a\": { \"kind\": \"wormhole\", \"to\": \"c\", \"translate\": [0, 1, 0] },"
                     "\"c\": { \"kind\": \"wormhole\", \"cell\": \"b\", \"translate\": [5, 1, 0], \"rotate\": [0, 90, 0] },"
                     "\"h\": { \"kind\": \"black_hole\", \"translate\": [0, 1, 8] } },"
                     "\"objects\": [ { \"cell\": \"b\", \"shape\": { \"kind\": \"sphere\", \"radius\": 0.5 }, \"translate\": [0, 1, 0] } ] }");
  const rf_body start = body_at(0, 1, 3, 0);
  rf_body one = start, many = start;
  // Straight through the middle one comes out in front of where one went in, turned over: at -z of the other ball, which
  // is turned so that this is -x.
  rf_hit hit;
  const rf_ray ahead = {start.frame.p, 0, {0, 0, -1}, INFINITY};
  rf_arrival seen;
  CHECK(rf_look(p.world, 0, &ahead, &hit, &seen) && seen.cell == 1);
  CHECK_NEAR(hit.t, 2 + 3.5, 1e-4);
  int gates[2] = {rf_walk(p.world, &one, (rf_vec3){0, 0, -3.5f}, true).gates, 0};
  for (int i = 0; i < 700; i++) {
    const rf_vec3 back = many.frame.z;
    gates[1] += rf_walk(p.world, &many, (rf_vec3){-back.x / 200, -back.y / 200, -back.z / 200}, true).gates;
  }
  CHECK(gates[0] == 1 && gates[1] == 1 && one.cell == 1 && many.cell == 1);
  CHECK_MSG(apart(one.frame.p, (rf_vec3){2.5f, 1, 0}) < 1e-4, "%g %g %g", (double)one.frame.p.x, (double)one.frame.p.y, (double)one.frame.p.z);
  CHECK_MSG(apart(many.frame.p, one.frame.p) < 1e-3 && apart(many.frame.z, one.frame.z) < 1e-4, "%g", (double)many.frame.p.x);
  CHECK(apart(one.frame.z, (rf_vec3){1, 0, 0}) < 1e-4 && apart(one.frame.y, (rf_vec3){0, 1, 0}) < 1e-4); // still ahead, and upright
  rf_walk(p.world, &one, (rf_vec3){3.5f, 0, 0}, true);
  CHECK(one.cell == 0 && apart(one.frame.p, start.frame.p) < 1e-4 && apart(one.frame.x, start.frame.x) < 1e-4);
  rf_body grazing = body_at(0.9f, 1, 3, 0);
  CHECK(rf_walk(p.world, &grazing, (rf_vec3){0, 0, -6}, true).gates == 1 && grazing.cell == 0); // bent, but not through
  rf_body fallen = body_at(0.2f, 1, 5, 0);
  for (int stops = 0; stops < 2; stops++) {
    const rf_walk_end end = rf_walk(p.world, &fallen, (rf_vec3){0, 0, 9}, stops);
    CHECK(end.is_blocked && !end.gates && fallen.cell == 0);
    CHECK_NEAR(end.surface.ng.z, -sqrt(0.96), 1e-4);
    CHECK_NEAR(fallen.frame.p.z, 8 - sqrt(0.96), 1e-4);
  }
  leave(&p);
}

TEST_MAIN
