// Worlds of cells and gates, flat ones: a gate that changes nothing changes no bit of the picture; a world glued to
// itself equals its copies laid side by side; what leads nowhere is refused with a sentence.

#include "tests/scene_text.h"

#include "base/text.h"

// --- pictures -------------------------------------------------------------------------------------
static uint64_t hash_of(const char *json, Integrator integrator, IsaLevel isa)
{
  Err err = {0};
  Scene *s = scene_of(json, &err);
  CHECK_MSG(s, "%s", err.text);
  if (!s) return 0;
  Film *f = film_of(s, integrator, isa);
  const uint64_t hash = film_hash(f);
  film_destroy(f);
  scene_destroy(s);
  return hash;
}

// --- the null gate ----------------------------------------------------------------------------------
#define HALL(front, back, gates)                                                                                     \
  "{ \"rayfold\": 1, \"render\": { \"size\": [40, 30], \"spp\": 4, \"max_depth\": 3 },"                                \
  "\"camera\": { \"position\": [0.3, 1.2, 3.5], \"target\": [0, 1, -3], \"fov\": 60 " front "},"                        \
  "\"sky\": { \"kind\": \"constant\", \"color\": [0.3, 0.4, 0.6] },"                                                     \
  "\"materials\": { \"w\": { \"kind\": \"lambert\", \"albedo\": 0.7 }, \"m\": { \"kind\": \"mirror\" } },"              \
  gates "\"objects\": ["                                                                                                \
  "{ \"shape\": { \"kind\": \"quad\", \"size\": [4, 4] }, \"translate\": [0, 0, 2], \"rotate\": [-90, 0, 0], \"material\": \"w\"" front "}," \
  "{ \"shape\": { \"kind\": \"quad\", \"size\": [4, 4] }, \"translate\": [0, 0, -2], \"rotate\": [-90, 0, 0], \"material\": \"w\"" back "}," \
  "{ \"shape\": { \"kind\": \"quad\", \"size\": [4, 3] }, \"translate\": [0, 1.5, -4], \"material\": \"m\"" back "},"    \
  "{ \"shape\": { \"kind\": \"torus\" }, \"translate\": [0, -50, 0], \"material\": \"w\"" front "}," /* no lanes know it: all ask the trees */ \
  "{ \"shape\": { \"kind\": \"sphere\", \"radius\": 0.5 }, \"translate\": [-0.8, 0.5, 1.5], \"material\": \"w\"" front "}," \
  "{ \"shape\": { \"kind\": \"box\", \"size\": [0.7, 1.5, 0.7] }, \"translate\": [0.8, 0.75, -1.5], \"material\": \"w\"" back "} ]," \
  "\"lights\": [ { \"kind\": \"spot\", \"position\": [0, 2.5, 1], \"target\": [0, 0, -0.5], \"angle\": 80, \"intensity\": 20" front "} ] }"

static const char whole[] = HALL("", "", "");
static const char cut[] = HALL("", ", \"cell\": \"rear\"",
                               "\"cells\": { \"rear\": {} }, \"gates\": {"
                               "\"a\": { \"kind\": \"rect\", \"size\": [40, 40], \"to\": \"b\", \"out\": \"back\" },"
                               "\"b\": { \"kind\": \"rect\", \"size\": [40, 40], \"cell\": \"rear\" } },");
static const char walled[] = HALL("", ", \"cell\": \"rear\"",
                                  "\"cells\": { \"rear\": {} }, \"gates\": {"
                                  "\"a\": { \"kind\": \"rect\", \"size\": [40, 40], \"to\": \"b\", \"wall\": true },"
                                  "\"b\": { \"kind\": \"rect\", \"size\": [40, 40], \"cell\": \"rear\", \"rotate\": [0, 180, 0], \"wall\": true } },");

TEST(a_gate_that_changes_nothing_changes_no_bit)
{
  static const Integrator integrators[] = {INTEGRATOR_PATH, INTEGRATOR_CLASSIC, INTEGRATOR_WHITTED, INTEGRATOR_NORMAL, INTEGRATOR_DEPTH, INTEGRATOR_ALBEDO};
  for (size_t i = 0; i < sizeof integrators / sizeof *integrators; i++) {
    const uint64_t expected = hash_of(whole, integrators[i], cpu_best_isa());
    const uint64_t free_standing = hash_of(cut, integrators[i], cpu_best_isa());
    const uint64_t wall = hash_of(walled, integrators[i], cpu_best_isa());
    CHECK_MSG(free_standing == expected, "integrator %d", (int)integrators[i]);
    CHECK_MSG(wall == expected, "integrator %d", (int)integrators[i]);
  }
}

TEST(every_instruction_set_sees_the_same_world)
{
  static const Integrator integrators[] = {INTEGRATOR_PATH, INTEGRATOR_WHITTED, INTEGRATOR_CLASSIC, INTEGRATOR_COST};
  for (size_t i = 0; i < sizeof integrators / sizeof *integrators; i++) {
    const uint64_t expected = hash_of(cut, integrators[i], ISA_REF);
    for (IsaLevel isa = ISA_REF + 1; isa <= cpu_best_isa(); isa++)
      CHECK_MSG(hash_of(cut, integrators[i], isa) == expected, "integrator %d, level %d", (int)integrators[i], (int)isa);
  }
}


// --- light ------------------------------------------------------------------------------------------
// Mean of the middle channel, and the standard error of it as far as pixels are independent.
static double mean_of(const char *json, double *error)
{
  Err err = {0};
  Scene *s = scene_of(json, &err);
  CHECK_MSG(s, "%s", err.text);
  if (!s) return 0;
  Film *f = film_of(s, INTEGRATOR_PATH, cpu_best_isa());
  const size_t count = (size_t)f->width * f->height;
  float *rgba = mem_alloc(count, 4 * sizeof *rgba);
  CHECK(film_resolve(f, FILM_BEAUTY, rgba));
  double sum = 0, sum2 = 0;
  for (size_t i = 0; i < count; i++) {
    const double x = (double)rgba[4 * i + 1];
    sum += x;
    sum2 += x * x;
  }
  mem_free(rgba);
  film_destroy(f);
  scene_destroy(s);
  const double mean = sum / (double)count;
  if (error) *error = sqrt(fmax(sum2 / (double)count - mean * mean, 0) / (double)count);
  return mean;
}

// Two rooms with a door between them that turns, scales (1 : 1.5) and, if told so, mirrors, and a ball gate in the first that
// holds a place of a third. SURFACE is what all is made of; MORE goes into the render settings.
#define ROOMS(render, surface, mirror)                                                                                 \
  "{ \"rayfold\": 1, \"render\": { " render " },"                                                                      \
  "\"camera\": { \"position\": [0.4, 0.2, 0.7], \"target\": [-0.3, -0.1, -1], \"fov\": 90 },"                             \
  "\"materials\": { " surface " }, \"cells\": { \"b\": {}, \"c\": {} },"                                               \
  "\"gates\": {"                                                                                                       \
  "\"ab\": { \"kind\": \"rect\", \"size\": [1.2, 1.2], \"translate\": [0.1, 0, -0.99], \"to\": \"ba\" " mirror "},"     \
  "\"ba\": { \"kind\": \"rect\", \"cell\": \"b\", \"size\": [1.8, 1.8], \"translate\": [0.1, 0.1, -1.48], \"rotate\": [0, 0, 20] }," \
  "\"ball\": { \"kind\": \"sphere\", \"radius\": 0.3, \"translate\": [-0.5, -0.5, 0.2], \"to\": \"bubble\" },"        \
  "\"bubble\": { \"kind\": \"sphere\", \"cell\": \"c\", \"radius\": 0.6 } },"                                        \
  "\"objects\": ["                                                                                                     \
  "{ \"shape\": { \"kind\": \"box\", \"size\": 2 }, \"material\": \"m\" },"                                            \
  "{ \"cell\": \"b\", \"shape\": { \"kind\": \"box\", \"size\": 3 }, \"material\": \"m\" },"                            \
  "{ \"cell\": \"b\", \"shape\": { \"kind\": \"box\", \"size\": [0.5, 0.6, 0.4] }, \"translate\": [0.2, 0, 0.7], \"material\": \"l\" }," \
  "{ \"cell\": \"c\", \"shape\": { \"kind\": \"box\", \"size\": [0.4, 0.4, 0.4] }, \"material\": \"m\" },"               \
  "{ \"cell\": \"c\", \"shape\": { \"kind\": \"box\", \"size\": 2 }, \"material\": \"m\" } ] }"

TEST(a_furnace_is_one_everywhere)
{
#define GREY "\"kind\": \"pbr\", \"base_color\": 0.5, \"specular\": 0, \"roughness\": 1, \"emissive\": 0.5"
  static const char *const worlds[] = {
      ROOMS("\"size\": [12, 9], \"spp\": 128, \"max_depth\": 16, \"roulette_depth\": 100", "\"m\": { " GREY " }, \"l\": { " GREY " }", ""),
      ROOMS("\"size\": [12, 9], \"spp\": 128, \"max_depth\": 16, \"roulette_depth\": 100", "\"m\": { " GREY " }, \"l\": { " GREY " }", ", \"mirror\": true"),
      ROOMS("\"size\": [12, 9], \"spp\": 128, \"max_depth\": 16, \"roulette_depth\": 100, \"light_gates\": 0", "\"m\": { " GREY " }, \"l\": { " GREY " }", "")};
  for (size_t i = 0; i < 3; i++) {
    double error;
    const double mean = mean_of(worlds[i], &error);
    CHECK_MSG(fabs(mean - 1) < 0.005, "world %zu: %g +- %g", i, mean, error); // L = e / (1 - a)
  }
}

TEST(aiming_through_gates_finds_the_same_light_as_chance)
{
#define LIT "\"m\": { \"kind\": \"lambert\", \"albedo\": 0.6 }, \"l\": { \"kind\": \"emission\", \"strength\": 5, \"double_sided\": true"
  static const struct {
    const char *aimed, *none, *chance; // through gates; only within a cell; not at all
  } cases[] = {
      {ROOMS("\"size\": [24, 18], \"spp\": 64, \"max_depth\": 5", LIT " }", ""),
       ROOMS("\"size\": [24, 18], \"spp\": 64, \"max_depth\": 5, \"light_gates\": 0", LIT " }", ""),
       ROOMS("\"size\": [24, 18], \"spp\": 256, \"max_depth\": 5", LIT ", \"lights_others\": false }", "")},
      {ROOMS("\"size\": [24, 18], \"spp\": 64, \"max_depth\": 5", LIT " }", ", \"mirror\": true"),
       ROOMS("\"size\": [24, 18], \"spp\": 64, \"max_depth\": 5, \"light_gates\": 0", LIT " }", ", \"mirror\": true"),
       ROOMS("\"size\": [24, 18], \"spp\": 256, \"max_depth\": 5", LIT ", \"lights_others\": false }", ", \"mirror\": true")}};
  for (size_t i = 0; i < 2; i++) {
    const double aimed = mean_of(cases[i].aimed, NULL), none = mean_of(cases[i].none, NULL), chance = mean_of(cases[i].chance, NULL);
    CHECK_MSG(fabs(aimed / none - 1) < 0.04 && fabs(aimed / chance - 1) < 0.04, "%g, not through gates %g, by chance %g", aimed, none, chance);
  }
}

// A lamp behind a door that halves lengths, and where it seems to be: at twice the distance, with four times the power.
TEST(lamps_fall_off_in_their_own_unit)
{
#define LAMP(lamp, more)                                                                                                  \
  "{ \"rayfold\": 1, \"render\": { \"size\": [8, 8], \"spp\": 16, \"max_depth\": 1 },"                                       \
  "\"camera\": { \"position\": [0, 3, 0], \"target\": [0, 0, 0], \"up\": [0, 0, -1], \"fov\": 40 },"                         \
  "\"materials\": { \"m\": { \"kind\": \"lambert\", \"albedo\": 0.8 } }," more                                               \
  "\"objects\": [ { \"shape\": { \"kind\": \"quad\", \"size\": [4, 4] }, \"rotate\": [-90, 0, 0], \"material\": \"m\" } ],"    \
  "\"lights\": [ " lamp " ] }"
  const double through = mean_of(LAMP("{ \"kind\": \"point\", \"cell\": \"b\", \"position\": [0, 1, -1.5], \"intensity\": 10 }",
                                      "\"cells\": { \"b\": {} }, \"gates\": { \"g\": { \"kind\": \"rect\", \"size\": [8, 8], \"translate\": [0, 0, -2.5], \"to\": \"h\" },"
                                      "\"h\": { \"kind\": \"rect\", \"cell\": \"b\", \"size\": [4, 4], \"rotate\": [0, 180, 0] } },"), NULL);
  const double plain = mean_of(LAMP("{ \"kind\": \"point\", \"position\": [0, 2, -5.5], \"intensity\": 40 }", ""), NULL);
  CHECK_MSG(plain > 0 && fabs(through / plain - 1) < 1e-4, "%g, unfolded %g", through, plain);
  const double sun = mean_of(LAMP("{ \"kind\": \"sun\", \"cell\": \"b\", \"direction\": [0, 1, -2], \"irradiance\": 3, \"angle\": 0 }",
                                  "\"cells\": { \"b\": {} }, \"gates\": { \"g\": { \"kind\": \"rect\", \"size\": [80, 80], \"translate\": [0, 0, -2.5], \"to\": \"h\", \"mirror\": true },"
                                  "\"h\": { \"kind\": \"rect\", \"cell\": \"b\", \"size\": [40, 40], \"rotate\": [0, 180, 0] } },"), NULL);
  const double plain_sun = mean_of(LAMP("{ \"kind\": \"sun\", \"direction\": [0, 1, -2], \"irradiance\": 3, \"angle\": 0 }", ""), NULL);
  CHECK_MSG(plain_sun > 0 && fabs(sun / plain_sun - 1) < 1e-4, "%g, unfolded %g", sun, plain_sun);
}

// --- glued to itself ------------------------------------------------------------------------------------
static Scene *torus_scene(bool is_glued)
{
  Err err = {0};
  Text t = {0};
  text_add(&t, "{ \"rayfold\": 1, \"render\": { \"size\": [96, 64], \"spp\": 1, \"filter\": \"box\", \"filter_width\": 1e-6, \"fade\": 7, \"max_depth\": 0 },"
               "\"camera\": { \"position\": [0.55, 0.3, 0.7], \"target\": [-0.2, 0.1, -1], \"fov\": 80 },"
               "\"whitted\": { \"ambient\": 1, \"light_units\": \"classic\" },"
               "\"materials\": { \"a\": { \"kind\": \"lambert\", \"albedo\": [0.9, 0.5, 0.2] }, \"b\": { \"kind\": \"lambert\", \"albedo\": [0.2, 0.4, 0.9] } },\"gates\": {");
  if (is_glued)
    text_add(&t, "\"x0\": { \"kind\": \"rect\", \"size\": [2, 2], \"translate\": [-1, 0, 0], \"rotate\": [0, 90, 0], \"to\": \"x1\", \"wall\": true },"
                 "\"x1\": { \"kind\": \"rect\", \"size\": [2, 2], \"translate\": [1, 0, 0], \"rotate\": [0, -90, 0], \"wall\": true },"
                 "\"y0\": { \"kind\": \"rect\", \"size\": [2, 2], \"translate\": [0, -1, 0], \"rotate\": [-90, 0, 0], \"to\": \"y1\", \"out\": \"front\", \"wall\": true },"
                 "\"y1\": { \"kind\": \"rect\", \"size\": [2, 2], \"translate\": [0, 1, 0], \"rotate\": [90, 180, 0], \"wall\": true },"
                 "\"z0\": { \"kind\": \"rect\", \"size\": [2, 2], \"translate\": [0, 0, -1], \"to\": \"z1\", \"wall\": true },"
                 "\"z1\": { \"kind\": \"rect\", \"size\": [2, 2], \"translate\": [0, 0, 1], \"rotate\": [0, 180, 0], \"wall\": true } },");
  else // one gate far off, so that length fades here, too
    text_add(&t, "\"n\": { \"kind\": \"rect\", \"translate\": [0, 900, 0], \"to\": \"n\", \"out\": \"back\" } },");
  text_add(&t, "\"objects\": [");
  const int reach = is_glued ? 0 : 4;
  for (int x = -reach; x <= reach; x++)
    for (int y = -reach; y <= reach; y++)
      for (int z = -reach; z <= reach; z++)
        text_add(&t, "%s{ \"shape\": { \"kind\": \"sphere\", \"radius\": 0.3 }, \"translate\": [%d, %d, %d], \"material\": \"a\" },"
                     "{ \"shape\": { \"kind\": \"box\", \"size\": [0.3, 0.2, 0.4] }, \"translate\": [%g, %g, %g], \"material\": \"b\" }",
                 x + y + z > -3 * reach ? "," : "", 2 * x, 2 * y, 2 * z, 2 * x - 0.6, 2 * y - 0.55, 2 * z + 0.3);
  text_add(&t, "] }");
  Scene *s = scene_of(text_get(&t), &err);
  CHECK_MSG(s, "%s", err.text);
  text_finish(&t);
  return s;
}

TEST(a_torus_equals_its_copies_side_by_side)
{
  Scene *glued = torus_scene(true), *copies = torus_scene(false);
  if (!glued || !copies) return;
  Film *a = film_of(glued, INTEGRATOR_WHITTED, cpu_best_isa()), *b = film_of(copies, INTEGRATOR_WHITTED, cpu_best_isa());
  const size_t count = (size_t)a->width * a->height;
  float *x = mem_alloc(count, 16), *y = mem_alloc(count, 16);
  CHECK(film_resolve(a, FILM_BEAUTY, x) && film_resolve(b, FILM_BEAUTY, y));
  size_t off = 0, lit = 0;
  for (size_t i = 0; i < count; i++) {
    bool is_off = false;
    for (size_t k = 0; k < 3; k++) is_off |= fabsf(x[4 * i + k] - y[4 * i + k]) > 1.0f / 255;
    off += is_off;
    lit += y[4 * i] > 0.02f;
  }
  CHECK_MSG(off <= count / 1000, "%zu of %zu pixels", off, count);
  CHECK(lit > count / 8);
  mem_free(x);
  mem_free(y);
  film_destroy(a);
  film_destroy(b);
  scene_destroy(glued);
  scene_destroy(copies);
}

TEST(no_ray_is_lost_in_a_torus)
{
  Err err = {0};
  Scene *s = torus_scene(true);
  World *w = s ? world_prepare(s, NULL, NULL, NULL, NULL, &err) : NULL;
  CHECK_MSG(w, "%s", err.text);
  if (!w) return;
  const int rays = (int)((TEST_IS_SLOW ? 40 : 1000) * test_intensity()), most = 10000;
  size_t lost = 0, outside = 0;
  uint32_t seed = 7;
  for (int i = 0; i < rays; i++) {
    Vec3 v[2];
    for (int k = 0; k < 6; k++) {
      seed = seed * 1664525u + 1013904223u;
      v[k / 3][k % 3] = (float)(seed >> 8) * 0x1p-23f - 1;
    }
    if (i % 4 == 0) v[1][i / 4 % 3] = 0; // in a plane
    if (i % 16 == 0) v[0] = v3(1, 1, 1) - 2 * v3(i & 16 ? 1.0f : 0, i & 32 ? 1.0f : 0, i & 64 ? 1.0f : 0); // from a corner
    v[0][3] = v[1][3] = 0;
    Ray ray = {v[0], v3_normalize(v[1]), 0, INFINITY};
    Way way = way_begin(0);
    for (int n = 0; n < most; n++) {
      const SpaceExit e = space_exit(&w->space, &way, &ray);
      if (!(e.t < INFINITY)) {
        lost++;
        break;
      }
      way_cross(&w->space, &way, e.gate, e.side, e.t, &ray);
      const Vec3 p = ray.o + ray.tmin * ray.d, size = v3_max(p, -p);
      outside += v3_max_lane(size) > 1.001f;
      if (way.crossings % 64 == 0) { // as far as a picture's rays go
        ray.o = p;
        ray.tmin = 0;
      }
    }
  }
  CHECK_MSG(!lost && !outside, "%zu lost, %zu more than a thousandth outside, of %d rays of %d crossings", lost, outside, rays, most);
  world_release(w);
  scene_destroy(s);
}

// --- what the original did wrong --------------------------------------------------------------------------
static float *pixels_of(const char *json, Integrator integrator, size_t *count)
{
  Err err = {0};
  Scene *s = scene_of(json, &err);
  CHECK_MSG(s, "%s", err.text);
  if (!s) return NULL;
  Film *f = film_of(s, integrator, cpu_best_isa());
  *count = (size_t)f->width * f->height;
  float *rgba = mem_alloc(*count, 4 * sizeof *rgba);
  CHECK(film_resolve(f, FILM_BEAUTY, rgba));
  film_destroy(f);
  scene_destroy(s);
  return rgba;
}

// A ray along the axis of a tunnel that leads to itself ends, and in the colour it was told to.
TEST(rays_that_would_go_on_for_ever_end)
{
  static const char axis[] =
      "{ \"rayfold\": 1, \"render\": { \"size\": [9, 9], \"spp\": 1, \"crossings\": 64, \"fade_color\": [0.25, 0.5, 0.75] },"
      "\"camera\": { \"position\": [0, 0, 0], \"target\": [0, 0, -1], \"fov\": 20 }, \"sky\": { \"kind\": \"constant\" },"
      "\"gates\": { \"a\": { \"kind\": \"rect\", \"size\": [1000, 1000], \"translate\": [0, 0, -1], \"to\": \"b\" },"
      "\"b\": { \"kind\": \"rect\", \"size\": [1000, 1000], \"translate\": [0, 0, 1], \"rotate\": [0, 180, 0] } } }";
  static const Integrator integrators[] = {INTEGRATOR_PATH, INTEGRATOR_CLASSIC, INTEGRATOR_WHITTED, INTEGRATOR_NORMAL};
  for (size_t i = 0; i < 4; i++) {
    size_t count = 0;
    float *rgba = pixels_of(axis, integrators[i], &count);
    for (size_t k = 0; rgba && k < count; k++)
      CHECK_MSG(fabsf(rgba[4 * k] - 0.25f) + fabsf(rgba[4 * k + 1] - 0.5f) + fabsf(rgba[4 * k + 2] - 0.75f) < 1e-3f,
                "integrator %d: %g", (int)integrators[i], (double)rgba[4 * k]);
    mem_free(rgba);
  }
}

// A room ten kilometres away, through a door, looks as the room beside the door: no specks, whole shadows of a sun.
TEST(far_rooms_look_as_near_ones)
{
#define FAR_ROOM(x, head)                                                                                              \
  "{ \"rayfold\": 1, \"render\": { \"size\": [48, 36], \"spp\": 4, \"max_depth\": 2 }," head                              \
  "\"sky\": { \"kind\": \"constant\" }, \"materials\": { \"m\": { \"kind\": \"lambert\", \"albedo\": 0.8 } },"           \
  "\"objects\": [ { \"shape\": { \"kind\": \"quad\", \"size\": [8, 8] }, \"translate\": [" x ", 0, -4], \"rotate\": [-90, 0, 0], \"material\": \"m\" },"  \
  "{ \"shape\": { \"kind\": \"box\", \"size\": 1 }, \"translate\": [" x ", 1.5, -4], \"material\": \"m\" } ],"             \
  "\"lights\": [ { \"kind\": \"sun\", \"direction\": [0.2, 1, 0.3], \"irradiance\": 3, \"angle\": 0 } ] }"
#define EYE "\"camera\": { \"position\": [0.2, 2, 2], \"target\": [0, 0.8, -4], \"fov\": 50 },"
  size_t count = 0, off = 0, dark = 0;
  float *near = pixels_of(FAR_ROOM("0", EYE), INTEGRATOR_WHITTED, &count);
  float *far = pixels_of(FAR_ROOM("10000", EYE "\"gates\": { \"g\": { \"kind\": \"rect\", \"size\": [20, 20], \"translate\": [0, 0, 0.5],"
                                           "\"to_translate\": [10000, 0, 0.5], \"sides\": \"front\" } },"), INTEGRATOR_WHITTED, &count);
  for (size_t i = 0; near && far && i < count; i++) {
    off += fabsf(near[4 * i] - far[4 * i]) > 0.01f;
    dark += near[4 * i] < 0.01f;
  }
  CHECK_MSG(off <= count / 200, "%zu of %zu pixels differ", off, count); // edges, at coordinates of a millimetre
  CHECK(dark > 20 && dark < count - 100);
  mem_free(near);
  mem_free(far);
}

// --- what is refused ----------------------------------------------------------------------------------
TEST(gates_that_lead_nowhere_are_refused_with_a_sentence)
{
#define HEAD "{ \"rayfold\": 1, \"cells\": { \"b\": {} }, \"objects\": [ { \"cell\": \"b\", \"shape\": { \"kind\": \"sphere\" } } ],\n"
  static const struct {
    const char *json, *says;
  } cases[] = {
      {HEAD "\"gates\": { \"g\": { \"kind\": \"rect\" } } }", "leads nowhere"},
      {HEAD "\"gates\": { \"g\": { \"kind\": \"rect\", \"to\": \"h\" }, \"h\": { \"kind\": \"rect\", \"size\": [1, 3] } } }", "outline"},
      {HEAD "\"gates\": { \"g\": { \"kind\": \"rect\", \"to\": \"h\" }, \"h\": { \"kind\": \"sphere\" } } }", "kind is another"},
      {HEAD "\"gates\": { \"g\": { \"kind\": \"rect\", \"cell\": \"bb\" } } }", "cell \"bb\" is not defined; did you mean \"b\""},
      {HEAD "\"gates\": { \"g\": { \"kind\": \"rect\", \"to\": \"hh\" } } }", "gate \"hh\" is not defined"},
      {HEAD "\"gates\": { \"g\": { \"kind\": \"rect\", \"size\": [0, 1], \"to\": \"g\" } } }", "at least 1e-06"},
      {HEAD "\"gates\": { \"g\": { \"kind\": \"box\", \"wall\": true, \"to\": \"g\" } } }", "only a flat gate"},
      {HEAD "\"gates\": { \"g\": { \"kind\": \"polygon\", \"to\": \"g\" } } }", "needs \"points\""},
      {HEAD "\"gates\": { \"g\": { \"kind\": \"polygon\", \"points\": [[0, 0], [1, 1], [1, 0], [0, 1]], \"to\": \"g\" } } }", "crosses itself"},
      {HEAD "\"gates\": { \"g\": { \"kind\": \"rect\", \"to\": \"h\" }, \"k\": { \"kind\": \"rect\", \"to\": \"h\", \"translate\": [1, 0, 0] },"
            "\"h\": { \"kind\": \"rect\" } } }", "two places"},
      {"{ \"rayfold\": 1, \"cells\": { \"c\": {} } }", "is empty"},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    Err err = {0};
    Scene *s = scene_of(cases[i].json, &err);
    CHECK_MSG(!s && strstr(err.text, cases[i].says), "%zu: \"%s\"", i, err.text);
    scene_destroy(s);
  }
}

TEST_MAIN
