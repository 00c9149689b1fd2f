// The public interface from outside: what its header promises and no room below can show.

#include "tests/test.h"

#include "rayfold/rayfold.h"

// A picture of nothing but sky.
static rf_film *sky_film(rf_engine *e, rf_scene *s, int width, unsigned planes, int samples)
{
  rf_world *w = rf_prepare(s, NULL);
  rf_eye eye;
  rf_render_def def = rf_default_render_def();
  def.end_sample = samples;
  rf_film *f = rf_film_create(e, width, 5, planes);
  CHECK(w && f && rf_camera(s, w, NULL, 1, &eye) && rf_render(w, &eye, &def, f, NULL) == RF_OK);
  rf_world_destroy(w);
  return f;
}

static uint64_t sky_hash(rf_engine *e, rf_scene *s, int width, unsigned planes, int samples)
{
  rf_film *f = sky_film(e, s, width, planes, samples);
  const uint64_t hash = rf_film_hash(f);
  rf_film_destroy(f);
  return hash;
}

TEST(equal_pictures_have_equal_hashes)
{
  rf_engine *e = rf_engine_create(NULL);
  rf_scene *s = rf_scene_create(e);
  CHECK(rf_set(s, "sky.color", "[0.25, 0.5, 0.75]"));
  const uint64_t hash = sky_hash(e, s, 7, RF_BEAUTY, 2);
  CHECK(hash);
  CHECK_MSG(sky_hash(e, s, 7, RF_ALL_PLANES, 2) == hash, "with all planes");
  CHECK_MSG(sky_hash(e, s, 7, RF_BEAUTY | RF_DEPTH, 5) == hash, "with more samples of the same");
  CHECK(sky_hash(e, s, 8, RF_BEAUTY, 2) != hash);
  CHECK(rf_set(s, "sky.color", "[0.25, 0.5, 0.7500001]"));
  CHECK(sky_hash(e, s, 7, RF_BEAUTY, 2) != hash);
  const char *text;
  CHECK(rf_film_hash(NULL) == 0 && rf_error(e, &text) == RF_BAD_ARGUMENT);
  rf_scene_destroy(s);
  rf_engine_destroy(e);
}

TEST_MAIN
