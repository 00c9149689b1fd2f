// Worlds of cells and gates, flat ones: a gate that changes nothing changes no bit of the picture; a world glued to
// itself equals its copies laid side by side; what leads nowhere is refused with a sentence.

#include "tests/render_sample.h"

#include <unistd.h>

// --- scenes from text -----------------------------------------------------------------------------
static Scene *scene_of(const char *json, Err *err)
{
  char path[] = "/tmp/rayfold-worlds-XXXXXX";
  const int fd = mkstemp(path);
  const size_t size = strlen(json);
  CHECK(fd >= 0 && write(fd, json, size) == (ssize_t)size);
  close(fd);
  Scene *s = scene_create(NULL);
  const bool ok = import_json(s, path, NULL, err);
  unlink(path);
  if (ok) return s;
  scene_destroy(s);
  return NULL;
}

static Film *picture_of(Scene *s, Integrator integrator, IsaLevel isa)
{
  Err err = {0};
  s->render.integrator = (int32_t)integrator;
  World *w = world_prepare(s, NULL, NULL, NULL, NULL, &err);
  Film *f = film_create((uint32_t)s->render.size[0], (uint32_t)s->render.size[1], 1 << FILM_BEAUTY, NULL);
  RenderJob job = {.world = w, .settings = s->render, .film = f, .end_sample = (uint32_t)s->render.spp, .seed = 1};
  CHECK_MSG(w && f && eye_from_camera(&s->camera, &job.eye, NULL), "%s", err.text);
  RenderStats stats = {0};
  if (w) CHECK(render_run(&job, NULL, hot_table(isa), NULL, &stats, NULL));
  CHECK(stats.bad_samples == 0);
  world_release(w);
  return f;
}

static uint64_t hash_of(const char *json, Integrator integrator, IsaLevel isa)
{
  Err err = {0};
  Scene *s = scene_of(json, &err);
  CHECK_MSG(s, "%s", err.text);
  if (!s) return 0;
  Film *f = picture_of(s, integrator, isa);
  const uint64_t hash = film_hash(f);
  film_destroy(f);
  scene_destroy(s);
  return hash;
}

// --- the null gate ----------------------------------------------------------------------------------
#define HALL(front, back, gates)                                                                                     \
  "{ \"rayfold\": 1, \"render\": { \"size\": [40, 30], \"spp\": 4, \"max_depth\": 3 },"                                \
  "\"camera\": { \"position\": [0.3, 1.2, 3.5], \"target\": [0, 1, -3], \"fov\": 60 " front "},"                        \
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
