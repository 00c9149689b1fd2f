// Pictures of curved cells: light that is the same everywhere stays so, through any space; lamps thin out as spheres
// grow; every instruction set sees the same; what cannot be is refused with a sentence.

#include "tests/scene_text.h"

static Vec3 mean_of(const Film *f, double *worst)
{
  const size_t count = (size_t)f->width * f->height;
  float *rgba = calloc(count, 4 * sizeof *rgba);
  double sum[3] = {0};
  *worst = 0;
  CHECK(rgba && film_resolve(f, FILM_BEAUTY, rgba));
  for (size_t i = 0; i < count; i++) {
    for (size_t k = 0; k < 3; k++) sum[k] += (double)rgba[4 * i + k] / (double)count;
    *worst = fmax(*worst, fabs((double)rgba[4 * i] - 1));
  }
  free(rgba);
  return v3((float)sum[0], (float)sum[1], (float)sum[2]);
}

// --- the furnace ----------------------------------------------------------------------------------
// All matter shines 1/2 and scatters 1/2, so light is 1 wherever one looks, lamps included (worlds.md, section 2.5). A
// lamp that is aimed at, and rays it is found by through faces, must add up to the same.
#define FURNACE(cell, more)                                                                                            \
  "{ \"rayfold\": 1, \"render\": { \"size\": [12, 9], \"spp\": 24, \"max_depth\": 64, \"roulette_depth\": 64,"       \
  "\"crossings\": 256, \"fade_color\": [1, 1, 1] },"                                                                   \
  "\"camera\": { \"position\": [0.1, 0.05, 0.9], \"target\": [0, 0, 0], \"fov\": 90, \"cell\": \"c\" },"               \
  "\"materials\": { \"f\": { \"kind\": \"pbr\", \"base_color\": 0.5, \"specular\": 0, \"roughness\": 1, \"emissive\": 0.5 } }," \
  "\"cells\": { \"c\": { " cell ", \"beams\": 0.3, \"beam_material\": \"f\" } },"                                       \
  "\"objects\": [ { \"shape\": { \"kind\": \"box\", \"size\": [0.6, 0.6, 0.6] }, \"translate\": [0.2, -0.3, 0], \"cell\": \"c\", \"material\": \"f\" }," \
  "{ \"shape\": { \"kind\": \"sphere\", \"radius\": 0.4 }, \"translate\": [-0.6, 0.2, 0.1], \"cell\": \"c\", \"material\": \"f\" } ]" more "}"
#define LAMP ", \"lights\": [ { \"kind\": \"sphere\", \"position\": [0.3, 0.8, 0.2], \"radius\": 0.3, \"radiance\": 1, \"cell\": \"c\" } ]"

static void check_furnace(const char *json, const char *name)
{
  double worst = 0;
  Film *f = picture_of(json, INTEGRATOR_PATH, cpu_best_isa());
  const Vec3 mean = f ? mean_of(f, &worst) : v3_all(0);
  CHECK_MSG(fabsf(mean[0] - 1) < 5e-3f, "%s: mean %g", name, (double)mean[0]);
  CHECK_MSG(worst < 0.35, "%s: a pixel off by %g", name, worst);
  film_destroy(f);
}

TEST(light_is_the_same_everywhere)
{
  check_furnace(FURNACE("\"kind\": \"spherical\", \"space\": \"poincare\", \"radius\": 5", LAMP), "poincare");
  check_furnace(FURNACE("\"kind\": \"spherical\", \"space\": \"lens\", \"radius\": 3, \"p\": 5, \"q\": 2", LAMP), "lens");
  check_furnace(FURNACE("\"kind\": \"hyperbolic\", \"space\": \"seifert_weber\", \"radius\": 2", LAMP), "seifert_weber");
  check_furnace(FURNACE("\"kind\": \"hyperbolic\", \"space\": \"right_angled\", \"radius\": 2", LAMP), "right_angled");
  check_furnace(FURNACE("\"space\": \"torus\", \"size\": [3, 4, 5]", LAMP), "torus");
  check_furnace(FURNACE("\"space\": \"hantzsche_wendt\", \"size\": [5, 5, 5]", LAMP), "hantzsche_wendt");
  if (test_intensity() <= 1) return; // the others at night
  check_furnace(FURNACE("\"kind\": \"spherical\", \"space\": \"quaternionic\", \"radius\": 3", ""), "quaternionic");
  check_furnace(FURNACE("\"kind\": \"hyperbolic\", \"space\": \"cubes\", \"radius\": 2", LAMP), "cubes");
  check_furnace(FURNACE("\"space\": \"half_turn\"", LAMP), "half_turn");
  check_furnace(FURNACE("\"space\": \"klein\"", LAMP), "klein");
}

// A ball in an open room of even light, whose inside is another space: nothing shows where it is.
TEST(doors_let_light_through)
{
  check_furnace("{ \"rayfold\": 1, \"render\": { \"size\": [12, 9], \"spp\": 24, \"max_depth\": 64, \"roulette_depth\": 64,"
                "\"crossings\": 256, \"fade_color\": [1, 1, 1] }, \"sky\": { \"kind\": \"constant\", \"color\": [1, 1, 1] },"
                "\"camera\": { \"position\": [0.3, 0.2, 2.5], \"target\": [0, 0, 0], \"fov\": 60 },"
                "\"materials\": { \"f\": { \"kind\": \"pbr\", \"base_color\": 0.5, \"specular\": 0, \"roughness\": 1, \"emissive\": 0.5 } },"
                "\"cells\": { \"c\": { \"kind\": \"spherical\", \"space\": \"quaternionic\", \"radius\": 5, \"beams\": 0.3, \"beam_material\": \"f\" } },"
                "\"gates\": { \"a\": { \"kind\": \"sphere\", \"radius\": 1, \"to\": \"b\" },"
                "\"b\": { \"kind\": \"sphere\", \"radius\": 1.00679, \"cell\": \"c\", \"translate\": [0.5, 0, 0.3] } },"
                "\"objects\": [ { \"shape\": { \"kind\": \"box\" }, \"translate\": [-2, -1, -1], \"cell\": \"c\", \"material\": \"f\" },"
                "{ \"shape\": { \"kind\": \"sphere\", \"radius\": 0.5 }, \"translate\": [1, 1, 0.5], \"material\": \"f\" } ] }", "door");
}

// --- falloff --------------------------------------------------------------------------------------
// A small floor below a point lamp at distance t: E = I / S(t)^2, seen from above.
static double floor_brightness(const char *kind, double rho, double height)
{
  char json[2000];
  snprintf(json, sizeof json,
           "{ \"rayfold\": 1, \"render\": { \"size\": [8, 8], \"spp\": 1, \"max_depth\": 1, \"light_gates\": 0 }, \"cells\": { \"c\": { %s } },"
           "\"camera\": { \"position\": [0, 0.2, 0], \"target\": [0, 0, 0], \"up\": [0, 0, 1], \"fov\": 2, \"cell\": \"c\" },"
           "\"materials\": { \"w\": { \"kind\": \"lambert\", \"albedo\": 1 } },"
           "\"objects\": [ { \"shape\": { \"kind\": \"quad\", \"size\": [0.2, 0.2] }, \"rotate\": [-90, 0, 0], \"cell\": \"c\", \"material\": \"w\" } ],"
           "\"lights\": [ { \"kind\": \"point\", \"position\": [0, %.9g, 0], \"intensity\": 3.14159265, \"cell\": \"c\" } ] }",
           kind, rho > 0 ? rho * tan(height / rho) : rho < 0 ? -rho * tanh(height / -rho) : height);
  double unused;
  Film *f = picture_of(json, INTEGRATOR_PATH, cpu_best_isa());
  const double out = f ? (double)mean_of(f, &unused)[1] : 0;
  film_destroy(f);
  return out;
}

TEST(lamps_thin_out_as_spheres_grow)
{
  CHECK_NEAR(floor_brightness("\"kind\": \"spherical\", \"space\": \"quaternionic\", \"radius\": 2", 2, 1.2) * 4 * sin(0.6) * sin(0.6), 1, 2e-3);
  CHECK_NEAR(floor_brightness("\"kind\": \"hyperbolic\", \"space\": \"cubes\", \"radius\": 2", -2, 0.9) * 4 * sinh(0.45) * sinh(0.45), 1, 2e-3);
  CHECK_NEAR(floor_brightness("\"space\": \"torus\", \"size\": [900, 900, 900]", 0, 1.2) * 1.44, 1, 2e-3);
}

// --- whitted ----------------------------------------------------------------------------------------
// Lamps without a size, matt surfaces and mirrors: a chain of mirrors without scattered rays is all there is, so both
// integrators without chance must see the same.
#define MIRRORS(cell, place)                                                                                           \
  "{ \"rayfold\": 1, \"render\": { \"size\": [40, 30], \"spp\": 1, \"max_depth\": 5, \"scatter\": 0, \"filter\": \"box\"," \
  "\"filter_width\": 1e-6, \"crossings\": 40, \"fade\": 9, \"fade_color\": [0, 0.2, 0.3], \"light_gates\": 0 },"   \
  "\"camera\": { \"position\": " place ", \"target\": [0, 0, 0], \"fov\": 80, \"cell\": \"c\" },"                     \
  "\"materials\": { \"m\": { \"kind\": \"mirror\" }, \"w\": { \"kind\": \"lambert\", \"albedo\": [0.8, 0.5, 0.3] } }," \
  "\"cells\": { \"c\": { " cell ", \"beams\": 0.15, \"beam_material\": \"w\" } },"                                    \
  "\"objects\": [ { \"shape\": { \"kind\": \"box\", \"size\": [0.6, 0.6, 0.6] }, \"translate\": [0.3, -0.3, 0], \"rotate\": [10, 30, 0], \"cell\": \"c\", \"material\": \"w\" }," \
  "{ \"shape\": { \"kind\": \"sphere\", \"radius\": 0.4 }, \"translate\": [-0.6, 0.2, 0.1], \"cell\": \"c\", \"material\": \"m\" } ]," \
  "\"lights\": [ { \"kind\": \"point\", \"position\": [0.1, 0.9, 0.5], \"intensity\": 2, \"cell\": \"c\" } ] }"

static int differing(const char *json, double *light)
{
  enum { PIXELS = 40 * 30 };
  static float seen[2][PIXELS][4];
  const Integrator by[2] = {INTEGRATOR_WHITTED, INTEGRATOR_CLASSIC};
  for (int k = 0; k < 2; k++) {
    Film *f = picture_of(json, by[k], cpu_best_isa());
    CHECK(f && film_resolve(f, FILM_BEAUTY, seen[k][0]));
    film_destroy(f);
  }
  int off = 0;
  *light = 0;
  for (int i = 0; i < PIXELS; i++) {
    *light += (double)seen[1][i][0] / PIXELS;
    off += fabsf(seen[0][i][0] - seen[1][i][0]) > 2e-3f * (0.1f + seen[1][i][0]);
  }
  return off;
}

TEST(whitted_sees_curved_light)
{
  static const char *const scenes[3] = {MIRRORS("\"kind\": \"spherical\", \"space\": \"poincare\", \"radius\": 5", "[0.2, 0.1, 1.2]"),
                                        MIRRORS("\"kind\": \"hyperbolic\", \"space\": \"seifert_weber\", \"radius\": 2", "[0.2, 0.1, 1]"),
                                        MIRRORS("\"space\": \"torus\", \"size\": [3, 3, 3]", "[0.2, 0.1, 1.2]")};
  for (int i = 0; i < 3; i++) {
    double light;
    const int off = differing(scenes[i], &light);
    CHECK_MSG(off <= 2 && light > 0.01, "%d: %d pixels differ, mean %g", i, off, light);
  }
}

// --- the rest -------------------------------------------------------------------------------------
TEST(every_instruction_set_sees_the_same_space)
{
  const char *json = FURNACE("\"kind\": \"hyperbolic\", \"space\": \"seifert_weber\", \"radius\": 2", LAMP);
  Film *expected = picture_of(json, INTEGRATOR_PATH, ISA_REF);
  for (IsaLevel isa = ISA_REF + 1; isa <= cpu_best_isa(); isa++) {
    Film *f = picture_of(json, INTEGRATOR_PATH, isa);
    CHECK(expected && f && film_hash(f) == film_hash(expected));
    film_destroy(f);
  }
  film_destroy(expected);
}

TEST(what_cannot_be_is_refused)
{
#define CURVED "\"kind\": \"spherical\", \"radius\": 2"
  static const struct {
    const char *json, *says;
  } cases[] = {
      {"{ \"rayfold\": 1, \"cells\": { \"c\": { " CURVED ", \"space\": \"lens\", \"p\": 6, \"q\": 3, \"beams\": 0.1 } } }", "no lens space L(6, 3)"},
      {"{ \"rayfold\": 1, \"cells\": { \"c\": { " CURVED ", \"beams\": 1 } } }", "make them thinner"},
      {"{ \"rayfold\": 1, \"media\": { \"m\": { \"kind\": \"homogeneous\" } }, \"cells\": { \"c\": { " CURVED ", \"atmosphere\": \"m\" } } }", "is curved and has no atmosphere"},
      {"{ \"rayfold\": 1, \"cells\": { \"c\": { " CURVED " } }, \"lights\": [ { \"kind\": \"sun\", \"cell\": \"c\" } ] }", "a sun is none"},
      {"{ \"rayfold\": 1, \"cells\": { \"c\": { \"kind\": \"hyperbolic\", \"radius\": 2 } }, \"objects\": [ { \"cell\": \"c\", \"translate\": [3, 0, 0],"
       "\"shape\": { \"kind\": \"sphere\" } } ] }", "beyond the end of its cell's chart"},
      {"{ \"rayfold\": 1, \"cells\": { \"c\": { " CURVED " } }, \"objects\": [ { \"cell\": \"c\", \"shape\": { \"kind\": \"torus\" } } ] }",
       "make it a mesh"},
      {"{ \"rayfold\": 1, \"cells\": { \"c\": { " CURVED ", \"beams\": 0.1 } }, \"gates\": { \"a\": { \"kind\": \"rect\", \"to\": \"b\" },"
       "\"b\": { \"kind\": \"rect\", \"cell\": \"c\" } } }", "which only spheres do"},
      {"{ \"rayfold\": 1, \"cells\": { \"c\": { " CURVED ", \"beams\": 0.1 } }, \"gates\": { \"a\": { \"kind\": \"sphere\", \"to\": \"b\" },"
       "\"b\": { \"kind\": \"sphere\", \"cell\": \"c\" } } }", "wide where they meet"},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    Err err = {0};
    Scene *s = scene_of(cases[i].json, &err);
    World *w = s ? world_prepare(s, NULL, NULL, NULL, NULL, &err) : NULL;
    CHECK_MSG(!w && strstr(err.text, cases[i].says), "%zu: \"%s\"", i, err.text);
    world_release(w);
    scene_destroy(s);
  }
}

TEST_MAIN
