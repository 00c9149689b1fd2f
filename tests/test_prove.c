// Proofs against what geometry knows: sums of angles, carried frames and areas agree with curvature, volumes of space forms
// are those of the books, and a way that is walked in curved space is the geodesic.

#include "tests/place.h"

static Place form_of(const char *cell)
{
  char json[600];
  snprintf(json, sizeof json,
           "{ \"rayfold\": 1, \"cells\": { \"c\": { %s } }, \"objects\": ["
           "{ \"cell\": \"c\", \"shape\": { \"kind\": \"sphere\", \"radius\": 0.1 }, \"translate\": [0.3, 0, 0] } ] }", cell);
  return place_of(json);
}

static rf_body body_at(float x, float y, float z, int cell)
{
  return (rf_body){.frame = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {x, y, z}}, .scale = 1, .cell = cell};
}

static const char *const curved[] = {
    "\"kind\": \"spherical\", \"radius\": 10, \"space\": \"poincare\"",
    "\"kind\": \"spherical\", \"radius\": 3, \"space\": \"quaternionic\"",
    "\"kind\": \"hyperbolic\", \"radius\": 2, \"space\": \"seifert_weber\"",
    "\"kind\": \"hyperbolic\", \"radius\": 5, \"space\": \"right_angled\"",
};
static const double curvature[] = {1.0 / 100, 1.0 / 9, -1.0 / 4, -1.0 / 25};
enum { CURVED = sizeof curved / sizeof *curved };

// Gauss and Bonnet, three ways at once: angles from directions, area from places, turn from the frame that was carried.
// The second triangle goes through faces of the cell.
TEST(triangles_have_the_angles_that_curvature_says)
{
  for (int i = 0; i < CURVED; i++) {
    Place p = form_of(curved[i]);
    const double r = 1 / sqrt(fabs(curvature[i]));
    CHECK_NEAR(rf_curvature(p.world, 1), curvature[i], 1e-7);
    for (int large = 0; large < 2; large++) {
      const float a = (float)((large ? 1.1 : 0.15) * r);
      const rf_vec3 legs[2] = {{a, 0.2f * a, 0}, {-0.3f * a, 0.9f * a, 0.2f * a}};
      rf_body b = body_at(0.02f, -0.05f, 0.03f, 1);
      rf_round t;
      CHECK(rf_walk_round(p.world, &b, legs, 2, true, &t));
      CHECK_MSG(t.is_home && t.sides == 3, "%s: off by %g m of %g, %d sides", curved[i], t.miss, t.length, t.sides);
      CHECK(large ? t.gates > 0 : t.gates == 0);
      CHECK_NEAR(t.angles - M_PI, curvature[i] * t.area, large ? 2e-4 : 1e-5);
      CHECK_NEAR(t.turn, fabs(curvature[i]) * t.area, large ? 2e-4 : 1e-5);
      CHECK(fabs(curvature[i]) * t.area > (large ? 0.2 : 0.008)); // there is something to measure
    }
    leave(&p);
  }
}

// A right-angled triangle with legs of an eighth of the way around: tan(E / 2) = tan(a / 2) tan(b / 2), with tanh in hyperbolic space.
TEST(areas_of_right_angled_triangles)
{
  for (int i = 0; i < CURVED; i++) {
    Place p = form_of(curved[i]);
    const double r = 1 / sqrt(fabs(curvature[i])), a = M_PI / 4;
    const rf_vec3 corners[3] = {{0, 0, 0}, {(float)(a * r), 0, 0}, {0, 0, -(float)(a * r)}};
    const double half = curvature[i] > 0 ? tan(a / 2) : tanh(a / 2), area = 2 * atan(half * half) * r * r;
    rf_body b = body_at(0, 0, 0, 1);
    rf_round t;
    CHECK(rf_walk_corners(p.world, &b, corners, 3, &t));
    CHECK_MSG(t.is_home, "off by %g", t.miss);
    CHECK_NEAR(t.area, area, 1e-5 * area);
    CHECK_NEAR(fabs((double)t.axis.y), 1, 1e-3);
    CHECK_NEAR(t.turn, area / (r * r), 1e-4);
    leave(&p);
  }
}

// Octant of the sphere: three right angles, three quarters of a turn of the sum, and a quarter of a turn of the frame.
TEST(an_octant_has_three_right_angles)
{
  Place p = form_of(curved[0]);
  const float quarter = (float)(10 * M_PI / 2);
  const rf_vec3 corners[3] = {{0, 0, 0}, {quarter, 0, 0}, {0, quarter, 0}};
  rf_body b = body_at(0.1f, 0.2f, 0, 1);
  rf_round t;
  CHECK(rf_walk_corners(p.world, &b, corners, 3, &t));
  CHECK_MSG(t.is_home && t.gates > 3, "off by %g, %d gates", t.miss, t.gates);
  CHECK_NEAR(t.angles, 1.5 * M_PI, 1e-4);
  CHECK_NEAR(t.turn, M_PI / 2, 1e-4);
  CHECK_NEAR(t.area, 100 * 4 * M_PI / 8, 1e-2);
  leave(&p);
}

// A great circle is closed wherever it leads through the Poincare space: back after 2 pi, from every direction.
TEST(all_the_way_round_a_sphere_is_home)
{
  Place p = form_of(curved[0]);
  for (int i = 0; i < 20; i++) {
    const rf_vec3 d = {sinf(1.7f * (float)i), cosf(2.3f * (float)i), 0.5f * sinf((float)i + 1)};
    const float n = (float)(2 * M_PI * 10) / sqrtf(d.x * d.x + d.y * d.y + d.z * d.z);
    const rf_vec3 leg = {d.x * n, d.y * n, d.z * n};
    rf_body b = body_at(0.3f, 0.2f, -0.1f, 1);
    rf_round t;
    CHECK(rf_walk_round(p.world, &b, &leg, 1, false, &t));
    CHECK_MSG(t.is_home && t.miss < 1e-3 && t.gates >= 9 && t.turn < 1e-4, "off by %g m, %d gates, turned by %g", t.miss, t.gates, t.turn);
  }
  leave(&p);
}

// Flat space forms: what comes home through their faces is turned as their group says, and in flat triangles nothing is.
TEST(ways_home_through_faces)
{
  static const struct {
    const char *cell;
    rf_vec3 leg;
    double turn;
    bool is_mirrored;
  } cases[] = {
      {"\"space\": \"torus\", \"size\": [3, 4, 5]", {3, 0, 0}, 0, false},
      {"\"space\": \"torus\", \"size\": [3, 4, 5]", {-6, 8, 5}, 0, false},
      {"\"space\": \"half_turn\", \"size\": [3, 4, 5]", {0, 4, 0}, M_PI, false},
      {"\"space\": \"half_turn\", \"size\": [3, 4, 5]", {0, 8, 0}, 0, false},
      {"\"space\": \"klein\", \"size\": [3, 4, 5]", {0, 0, 5}, 0, true},
      {"\"space\": \"klein\", \"size\": [3, 4, 5]", {0, 0, 10}, 0, false},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    Place p = form_of(cases[i].cell);
    rf_body b = body_at(0, 0.3f, 0, 1);
    rf_round t;
    CHECK(rf_walk_round(p.world, &b, &cases[i].leg, 1, false, &t));
    CHECK_MSG(t.is_home, "%s: off by %g", cases[i].cell, t.miss);
    CHECK_NEAR(t.turn, cases[i].turn, 1e-6);
    CHECK(t.is_mirrored == cases[i].is_mirrored && isnan(t.area));
    CHECK_NEAR(fabs((double)t.axis.y), cases[i].turn > 0 ? 1 : 0, 1e-6);
    const rf_vec3 legs[2] = {{2.5f, 1, 0}, {-1, 2.5f, 1}};
    CHECK(rf_walk_round(p.world, &b, legs, 2, true, &t));
    CHECK_NEAR(t.angles, M_PI, 1e-5);
    CHECK_NEAR(t.turn, 0, 1e-5);
    leave(&p);
  }
}

// A place in front of a door that halves: the way there and back is no way round, and one that does not come home says so.
TEST(what_does_not_come_home_is_told)
{
  Place p = place_of("{ \"rayfold\": 1, \"cells\": { \"b\": {} }, \"gates\": {"
                     "\"a\": { \"kind\": \"rect\", \"size\": [2, 2], \"translate\": [0, 0, -3], \"to\": \"b\" },"
                     "\"b\": { \"kind\": \"rect\", \"cell\": \"b\", \"size\": [1, 1] } },"
                     "\"objects\": [ { \"shape\": { \"kind\": \"sphere\" }, \"translate\": [5, 5, 5] },"
                     "{ \"cell\": \"b\", \"shape\": { \"kind\": \"sphere\" }, \"translate\": [5, 5, 5] } ] }");
  rf_body b = body_at(0, 0, 0, 0);
  const rf_vec3 out = {0, 0, -4}, legs[2] = {{0, 0, -4}, {4, 0, 0}};
  rf_round t;
  CHECK(rf_walk_round(p.world, &b, &out, 1, false, &t));
  CHECK(!t.is_home && isnan(t.miss) && isnan(t.turn) && t.gates == 1);
  CHECK_NEAR(t.scale, 0.5, 1e-6);
  CHECK(rf_walk_round(p.world, &b, legs, 2, true, &t)); // home past the door's edge: one stays beyond
  CHECK(!t.is_home && isnan(t.angles));
  const char *text;
  const rf_vec3 none = {0, 0, 0}, bad = {NAN, 0, 0};
  CHECK(!rf_walk_round(p.world, &b, &none, 1, true, &t) && rf_error(p.engine, &text) == RF_BAD_ARGUMENT);
  CHECK(!rf_walk_round(p.world, &b, &bad, 1, true, &t) && rf_error(p.engine, &text) == RF_BAD_ARGUMENT);
  CHECK(!rf_walk_corners(p.world, &b, legs, 2, &t) && rf_error(p.engine, &text) == RF_BAD_ARGUMENT);
  double v, e;
  CHECK(!rf_cell_volume(p.world, 0, b.frame.p, 100, 1, &v, &e) && rf_error(p.engine, &text) == RF_BAD_SCENE);
  leave(&p);
}

// Volumes of the books: 2 pi^2 / 120, / 8 and / 5 of the sphere's, Seifert-Weber 11.1991, {5,3,4} 4.3062 (worlds.md, section 2.12).
TEST(volumes_of_space_forms)
{
  static const struct {
    const char *cell;
    double volume;
  } cases[] = {
      {"\"space\": \"torus\", \"size\": [2, 2, 2]", 8},
      {"\"kind\": \"spherical\", \"radius\": 1, \"space\": \"poincare\"", 2 * M_PI * M_PI / 120},
      {"\"kind\": \"spherical\", \"radius\": 10, \"space\": \"quaternionic\"", 2000 * M_PI * M_PI / 8},
      {"\"kind\": \"spherical\", \"radius\": 1, \"space\": \"lens\", \"p\": 5, \"q\": 2", 2 * M_PI * M_PI / 5},
      {"\"kind\": \"hyperbolic\", \"radius\": 1, \"space\": \"seifert_weber\"", 11.1990647},
      {"\"kind\": \"hyperbolic\", \"radius\": 2, \"space\": \"right_angled\"", 8 * 4.3062076},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    Place p = form_of(cases[i].cell);
    double v = 0, e = 0;
    const uint32_t rays = TEST_IS_SLOW ? 10000 : 100000;
    CHECK(rf_cell_volume(p.world, 1, (rf_vec3){0.02f, 0.01f, -0.03f}, rays, 1, &v, &e));
    CHECK_MSG(fabs(v - cases[i].volume) < 3.5 * e && e < (TEST_IS_SLOW ? 0.03 : 0.01) * v, "%s: %g +- %g, not %g", cases[i].cell, v, e, cases[i].volume);
    CHECK(!rf_cell_volume(p.world, 1, (rf_vec3){50, 0, 0}, 10, 1, &v, &e)); // outside
    leave(&p);
  }
}

// The ruler: a straight look as long as the geodesic from place to place, through as many faces as were met.
TEST(a_look_has_the_length_of_its_way)
{
  for (int i = 0; i < CURVED; i++) {
    Place p = form_of(curved[i]);
    const rf_vec3 from = {-0.2f, 0.1f, 0.15f}, ball = {0.3f, 0, 0}, way = rf_toward(p.world, 1, from, ball);
    const float far = sqrtf(way.x * way.x + way.y * way.y + way.z * way.z);
    rf_hit hit;
    rf_arrival at;
    const rf_ray ray = {from, 0, {way.x / far, way.y / far, way.z / far}, INFINITY};
    CHECK(rf_look(p.world, 1, &ray, &hit, &at) && at.gates == 0);
    CHECK_NEAR(at.length, far - 0.1f, 1e-5); // the ball's radius is a true one
    // The body that walks as far is at the ball's surface.
    rf_body b = body_at(from.x, from.y, from.z, 1);
    CHECK(rf_walk(p.world, &b, way, true).is_blocked);
    const rf_vec3 left = rf_toward(p.world, 1, b.frame.p, ball);
    CHECK_NEAR(sqrtf(left.x * left.x + left.y * left.y + left.z * left.z), 0.1, 1e-4);
    leave(&p);
  }
}

// One step or many, geodesics are the same, and frames stay orthonormal.
TEST(a_walk_in_curved_space_is_the_same_in_few_steps_and_in_many)
{
  for (int i = 0; i < CURVED; i++) {
    Place p = form_of(curved[i]);
    rf_body one = body_at(0.1f, 0.05f, 0, 1), many = one;
    const float length = (float)(4 / sqrt(fabs(curvature[i])));
    const int steps = 100;
    (void)rf_walk(p.world, &one, (rf_vec3){0.6f * length, 0, -0.8f * length}, false);
    for (int k = 0; k < steps; k++) {
      const rf_frame f = many.frame;
      const float a = 0.6f * length / (float)steps, b = -0.8f * length / (float)steps;
      (void)rf_walk(p.world, &many, (rf_vec3){a * f.x.x + b * f.z.x, a * f.x.y + b * f.z.y, a * f.x.z + b * f.z.z}, false);
    }
    const rf_vec3 apart = rf_toward(p.world, 1, one.frame.p, many.frame.p);
    CHECK(one.cell == 1 && many.cell == 1);
    CHECK_MSG(sqrtf(apart.x * apart.x + apart.y * apart.y + apart.z * apart.z) < 1e-3f * length, "%s: %g %g %g", curved[i],
              (double)apart.x, (double)apart.y, (double)apart.z);
    const rf_frame f = many.frame;
    CHECK_NEAR(f.x.x * f.y.x + f.x.y * f.y.y + f.x.z * f.y.z, 0, 1e-6);
    CHECK_NEAR(one.frame.x.x * f.x.x + one.frame.x.y * f.x.y + one.frame.x.z * f.x.z, 1, 1e-3);
    leave(&p);
  }
}

TEST_MAIN
