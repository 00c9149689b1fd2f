// Wormholes and black holes in scenes: light that is the same everywhere stays so; a ray goes back the way it came, and
// what is carried along it stays rigid; the shadow and the disk of a hole are where geodesics integrated step by step
// say; what cannot be is refused. The tables themselves are tested in test_radial.c.

#include "base/hash.h"
#include "tests/scene_text.h"

// Of the columns from, to.
static double mean_of(const Film *f, uint32_t from, uint32_t to, double *worst)
{
  const size_t count = (size_t)f->width * f->height;
  float *rgba = calloc(count, 4 * sizeof *rgba);
  double sum = 0;
  *worst = 0;
  CHECK(rgba && film_resolve(f, FILM_BEAUTY, rgba));
  for (size_t i = 0; i < count; i++) {
    if (i % f->width < from || i % f->width >= to) continue;
    sum += (double)rgba[4 * i] / ((double)(to - from) * f->height);
    *worst = fmax(*worst, fabs((double)rgba[4 * i] - 1));
  }
  free(rgba);
  return sum;
}

// --- the furnace ----------------------------------------------------------------------------------
#define FURNACE(gates, more)                                                                                           \
  "{ \"rayfold\": 1, \"render\": { \"size\": [12, 9], \"spp\": 24, \"max_depth\": 64, \"roulette_depth\": 64,"       \
  "\"crossings\": 256, \"fade_color\": [1, 1, 1]" more " }, \"sky\": { \"kind\": \"constant\", \"color\": [1, 1, 1] },"       \
  "\"camera\": { \"position\": [0.3, 0.2, 2.5], \"target\": [0, 0, 0], \"fov\": 60 }, \"cells\": { \"c\": { } },"     \
  "\"materials\": { \"f\": { \"kind\": \"pbr\", \"base_color\": 0.5, \"specular\": 0, \"roughness\": 1, \"emissive\": 0.5 } }," \
  "\"gates\": { " gates " }, \"lights\": [ { \"kind\": \"sphere\", \"position\": [0.4, 1.4, 0.3], \"radius\": 0.3, \"radiance\": 1 }," \
  "{ \"kind\": \"sphere\", \"position\": [-1, 1.2, 0.3], \"radius\": 0.3, \"radiance\": 1, \"cell\": \"c\" } ], \"objects\": ["                       \
  "{ \"shape\": { \"kind\": \"box\" }, \"translate\": [-2, -1, -1], \"cell\": \"c\", \"material\": \"f\" },"            \
  "{ \"shape\": { \"kind\": \"box\", \"size\": [9, 0.1, 9] }, \"translate\": [0, -1.2, 0], \"material\": \"f\" },"        \
  "{ \"shape\": { \"kind\": \"sphere\", \"radius\": 0.4 }, \"translate\": [1, 1, 0.5], \"material\": \"f\" } ] }"
#define ENDS(more)                                                                                                    \
  "\"a\": { \"kind\": \"wormhole\", \"rotate\": [10, 20, 30], \"to\": \"b\"" more " },"                             \
  "\"b\": { \"kind\": \"wormhole\", \"cell\": \"c\", \"translate\": [0.5, 0, 0.3]" more " }"
#define HOLE "\"a\": { \"kind\": \"black_hole\", \"horizon\": 0.2, \"caught\": [1, 1, 1] }"

static void check_furnace(const char *json, const char *name, Integrator integrator)
{
  double worst = 0;
  Film *f = picture_of(json, integrator, cpu_best_isa());
  const double mean = f ? mean_of(f, 0, f->width, &worst) : 0;
  CHECK_MSG(fabs(mean - 1) < 5e-3, "%s: mean %g", name, mean);
  CHECK_MSG(worst < 0.35, "%s: a pixel off by %g", name, worst);
  film_destroy(f);
}

TEST(light_is_the_same_everywhere)
{
  check_furnace(FURNACE(ENDS(""), ""), "Ellis", INTEGRATOR_PATH);
  check_furnace(FURNACE(ENDS(", \"mirror\": true, \"throat\": 0.3, \"length\": 0.5, \"lensing\": 0.2"), ""), "DNGR", INTEGRATOR_PATH);
  check_furnace(FURNACE(HOLE, ""), "hole", INTEGRATOR_PATH);
}

// Fog that only shines, up to a hole's ball two metres away: 1 - exp(-absorption length), and nothing of the way is counted twice.
TEST(fog_ends_where_the_way_does)
{
  double worst;
  Film *f = picture_of("{ \"rayfold\": 1, \"render\": { \"size\": [4, 4], \"spp\": 4, \"atmosphere\": \"m\" }, \"media\": { \"m\": { \"kind\": \"homogeneous\","
                       "\"absorption\": 0.4, \"scattering\": 0, \"emission\": 0.4 } }, \"camera\": { \"position\": [0, 0, 3], \"target\": [0, 0, 0], \"fov\": 0.5 },"
                       "\"gates\": { \"a\": { \"kind\": \"black_hole\" } } }", INTEGRATOR_PATH, cpu_best_isa());
  CHECK_NEAR(f ? mean_of(f, 0, 4, &worst) : 0, 1 - exp(-0.8), 1e-3);
  film_destroy(f);
}

// --- single rays ----------------------------------------------------------------------------------
typedef struct Balls {
  World *world;
  const Ball *ball;
} Balls;

static Balls balls_of(const char *json)
{
  Err err = {0};
  Scene *s = scene_of(json, &err);
  World *w = s ? world_prepare(s, NULL, NULL, NULL, NULL, &err) : NULL;
  CHECK_MSG(w, "%s", err.text);
  scene_destroy(s);
  return (Balls){w, w ? w->space.gates[0].side[GATE_FRONT].curve->ball : NULL};
}

static float draw(uint32_t *seed) { return 2 * unit_float(hash_u32(++*seed)) - 1; }

static Vec3 draw_way(uint32_t *seed, float radius, Vec3 *v)
{
  const Vec3 n = v3_normalize(v3(draw(seed), draw(seed), draw(seed) + 1e-3f));
  *v = v3_normalize(v3(draw(seed), draw(seed), draw(seed) + 1e-3f));
  if (v3_dot(*v, n) > 0) *v = -*v;
  return radius * n;
}

TEST(a_ray_goes_back_the_way_it_came)
{
  for (int mirrors = 0; mirrors < 2; mirrors++) {
    Balls b = balls_of(mirrors ? FURNACE(ENDS(", \"mirror\": true"), "") : FURNACE(ENDS(""), ""));
    uint32_t seed = 3;
    int count[2] = {0};
    for (int i = 0; b.ball && i < 300; i++) {
      Vec3 v, p = draw_way(&seed, 1, &v), p_to = p, v_to = v;
      if (fabsf(v3_length(v3_cross(p, v)) - 0.5f) < 0.03f) continue; // winds for long
      const BallEnd end = ball_go(b.ball, &p_to, &v_to);
      CHECK(end != BALL_ENDED && v3_dot(p_to, v_to) > -1e-6f);
      count[end == BALL_PASSED]++;
      // Of the other end the ball is the same, mirrored or not.
      Vec3 p_back = p_to, v_back = -v_to;
      CHECK(ball_go(b.ball, &p_back, &v_back) == end);
      CHECK_MSG(v3_length(p_back - p) < 1e-3f && v3_length(v_back + v) < 1e-3f, "off by %g", (double)v3_length(p_back - p));
      // A frame carried along stays one, goes on along the way, and comes back as it was.
      const Frame f = frame_around(v3_normalize(v3(draw(&seed), draw(&seed), 0.1f)));
      const Vec3 x = ball_carry(b.ball, end, p, v, v_to, f.x), y = ball_carry(b.ball, end, p, v, v_to, f.y), z = ball_carry(b.ball, end, p, v, v_to, f.z);
      const bool is_mirrored = mirrors && end == BALL_PASSED;
      CHECK_NEAR(v3_dot(x, v3_cross(y, z)), is_mirrored ? -1 : 1, 1e-4);
      CHECK_NEAR(v3_dot(x, y), 0, 1e-4);
      CHECK(v3_length(ball_carry(b.ball, end, p, v, v_to, v) - v_to) < 1e-4f);
      CHECK(v3_length(ball_carry(b.ball, end, p_to, -v_to, -v, x) - f.x) < 2e-3f);
    }
    CHECK_MSG(count[0] > 50 && count[1] > 20, "%d turned, %d passed", count[0], count[1]);
    world_release(b.world);
  }
}

#define DISK(more) "{ \"rayfold\": 1, \"render\": { \"size\": [48, 48], \"spp\": 4 }, \"camera\": { \"position\": [0, %s, 6], \"target\": [0, 0, 0], \"fov\": 20 }," \
  "\"gates\": { \"a\": { \"kind\": \"black_hole\", \"horizon\": 0.1" more " } } }"

// x'' = -3/2 rs h^2 x / |x|^5 until the way goes through the plane of the disk within it; 0: it does not.
static double disk_met(const Vec3 from, Vec3 v, double rs, double inner, double outer)
{
  double x[3], d[3], h[3];
  for (int k = 0; k < 3; k++) {
    x[k] = (double)from[k];
    d[k] = (double)v[k];
  }
  for (int k = 0; k < 3; k++) h[k] = x[(k + 1) % 3] * d[(k + 2) % 3] - x[(k + 2) % 3] * d[(k + 1) % 3];
  const double h2 = h[0] * h[0] + h[1] * h[1] + h[2] * h[2];
  for (int i = 0; i < 40000; i++) {
    const double r = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]), step = 2e-3 * r;
    if (r < rs || (i > 2 && r > 1)) return 0;
    double was = x[1], at = r, mid[3], q = 0;
    for (int k = 0; k < 3; k++) mid[k] = x[k] + 0.5 * step * d[k];
    for (int k = 0; k < 3; k++) q += mid[k] * mid[k];
    for (int k = 0; k < 3; k++) d[k] += step * -1.5 * rs * h2 * mid[k] / (q * q * sqrt(q)); // leapfrog
    for (int k = 0; k < 3; k++) x[k] = mid[k] + 0.5 * step * d[k];
    if ((was > 0) == (x[1] > 0)) continue;
    const double f = was / (was - x[1]);
    at = (1 - f) * r + f * sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
    if (at >= inner && at <= outer) return at;
  }
  return 0;
}

TEST(the_disk_is_where_light_comes_to_it)
{
  char json[600];
  snprintf(json, sizeof json, DISK(", \"disk_outer\": 0.9"), "1");
  Balls b = balls_of(json);
  uint32_t seed = 9;
  int met = 0, count = 0;
  for (int i = 0; b.ball && i < 250; i++) {
    Vec3 v;
    const Vec3 p = draw_way(&seed, 1, &v);
    const RadialPlane plane = radial_plane(1, v3_normalize(p), v);
    if (fabsf(plane.h - b.ball->radial.critical) < 0.01f) continue;
    const double at = disk_met(p, v, 0.1, 0.3, 0.9), found = (double)ball_disk(b.ball, &plane).r;
    count++;
    met += at > 0;
    const bool is_edge = fabs(fmax(at, found) - 0.3) < 5e-3 || fabs(fmax(at, found) - 0.9) < 5e-3;
    CHECK_MSG(is_edge || fabs(found - at) < 4e-3, "%g, is %g", found, at);
  }
  CHECK_MSG(met > 50 && met < count - 20, "%d of %d", met, count);
  // Warm white at 4500 K: redder than the screen's own white.
  const float *c = b.ball ? b.ball->hole->color[HEAT_NODES / HEAT_MOST] : NULL;
  if (c) CHECK(c[0] > 1.2f && c[2] < 0.7f);
  if (c) CHECK_NEAR(0.2126 * (double)c[0] + 0.7152 * (double)c[1] + 0.0722 * (double)c[2], 1, 1e-4);
  world_release(b.world);
}

// --- pictures ---------------------------------------------------------------------------------------
// A way from afar is caught if, straight on, it would come nearer than hc: 1 / hc^2 = 4 / (27 rs^2) + rs / R^3.
TEST(the_shadow_of_a_hole)
{
  char json[600];
  snprintf(json, sizeof json, DISK(", \"caught\": [1, 1, 1]"), "0");
  double worst;
  Film *f = picture_of(json, INTEGRATOR_PATH, cpu_best_isa());
  const double hc2 = 1 / (4 / (27 * 0.01) + 0.1), tan2 = hc2 / (36 - hc2), half = tan(M_PI / 18);
  const double seen = f ? mean_of(f, 0, 48, &worst) : 0, is = M_PI * tan2 / (4 * half * half);
  CHECK_MSG(fabs(seen / is - 1) < 0.02, "%g of the picture, should be %g", seen, is);
  film_destroy(f);
}

// The side that comes is brighter by far; every integrator and instruction set sees it.
TEST(the_disk_shines)
{
  char json[600];
  snprintf(json, sizeof json, DISK(", \"disk_outer\": 0.9"), "1");
  double worst;
  Film *f = picture_of(json, INTEGRATOR_PATH, cpu_best_isa());
  const double coming = f ? mean_of(f, 0, 24, &worst) : 0, going = f ? mean_of(f, 24, 48, &worst) : 0;
  CHECK_MSG(coming > 2 * going && going > 1e-4, "%g, %g", coming, going);
  for (IsaLevel isa = ISA_REF; isa <= cpu_best_isa(); isa++) {
    Film *other = picture_of(json, INTEGRATOR_PATH, isa);
    CHECK(f && other && film_hash(other) == film_hash(f));
    film_destroy(other);
  }
  static const Integrator integrators[] = {INTEGRATOR_CLASSIC, INTEGRATOR_WHITTED, INTEGRATOR_ALBEDO};
  for (size_t i = 0; i < sizeof integrators / sizeof *integrators; i++) {
    Film *other = picture_of(json, integrators[i], cpu_best_isa());
    CHECK_NEAR((other ? mean_of(other, 0, 24, &worst) : 0) / coming, 1, 0.03);
    film_destroy(other);
  }
  film_destroy(f);
}

// --- the rest -------------------------------------------------------------------------------------
TEST(what_cannot_be_is_refused)
{
#define GATE(gates) "{ \"rayfold\": 1, \"cells\": { \"c\": { \"kind\": \"spherical\", \"beams\": 0.1 } }, \"gates\": { " gates " } }"
  static const struct {
    const char *json, *says;
  } cases[] = {
      {GATE("\"a\": { \"kind\": \"wormhole\", \"throat\": 1, \"to\": \"a\" }"), "must be smaller than the ball"},
      {GATE("\"a\": { \"kind\": \"wormhole\", \"length\": 1, \"to\": \"a\" }"), "needs \"lensing\""},
      {GATE("\"a\": { \"kind\": \"wormhole\" }"), "leads nowhere"},
      {GATE("\"a\": { \"kind\": \"wormhole\", \"to_scale\": 2 }"), "leads to another wormhole"},
      {GATE("\"a\": { \"kind\": \"wormhole\", \"to\": \"b\" }, \"b\": { \"kind\": \"sphere\" }"), "kind is another"},
      {GATE("\"a\": { \"kind\": \"wormhole\", \"to\": \"b\" }, \"b\": { \"kind\": \"wormhole\", \"throat\": 0.4 }"), "measures are others"},
      {GATE("\"a\": { \"kind\": \"wormhole\", \"to\": \"b\" }, \"b\": { \"kind\": \"wormhole\", \"cell\": \"c\" }"), "only flat cells have"},
      {GATE("\"a\": { \"kind\": \"black_hole\", \"to\": \"a\" }"), "a black hole leads nowhere"},
      {GATE("\"a\": { \"kind\": \"black_hole\", \"cell\": \"c\" }"), "only flat cells have"},
      {GATE("\"a\": { \"kind\": \"black_hole\", \"wall\": true }"), "a black hole has a cell on both sides"},
      {GATE("\"a\": { \"kind\": \"black_hole\", \"horizon\": 0.6 }"), "needs a ball of at least 1.2 m"},
      {GATE("\"a\": { \"kind\": \"black_hole\", \"disk_outer\": 0.9, \"disk_inner\": 0.15 }"), "nearer than 0.15 m"},
      {GATE("\"a\": { \"kind\": \"black_hole\", \"disk_outer\": 1.1 }"), "the ball's surface"},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    Err err = {0};
    Scene *s = scene_of(cases[i].json, &err);
    CHECK_MSG(!s && strstr(err.text, cases[i].says) && strstr(err.text, ":1:"), "%zu: \"%s\"", i, err.text);
    scene_destroy(s);
  }
}

TEST_MAIN
