// The public interface from outside: what its header promises and no room below can show.

#include "tests/test.h"

#include "rayfold/rayfold.h"

#include <time.h>
#include <unistd.h>

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

// A film is kept with a key that changes with all that changes its samples, and with nothing else.
TEST(films_are_kept_and_keys_tell_pictures_apart)
{
  rf_engine *e = rf_engine_create(NULL);
  rf_scene *s = rf_scene_create(e);
  rf_world *w = rf_prepare(s, NULL);
  rf_eye eye;
  CHECK(rf_camera(s, w, NULL, 1, &eye));
  const uint64_t key = rf_picture_key(s, w, &eye);
  CHECK(key);
  CHECK(rf_set(s, "render.spp", "7") && rf_set(s, "develop.exposure", "2"));
  CHECK(rf_picture_key(s, w, &eye) == key);
  CHECK(rf_set(s, "render.seed", "5"));
  CHECK(rf_picture_key(s, w, &eye) != key);
  CHECK(rf_undo(s));
  rf_eye moved = eye;
  moved.frame.p.x += 1;
  CHECK(rf_picture_key(s, w, &eye) == key && rf_picture_key(s, w, &moved) != key);
  CHECK(rf_set_time(s, 1));
  CHECK(rf_picture_key(s, w, &eye) == key);
  CHECK(rf_set(s, "camera.shutter", "0.5"));
  const uint64_t open_key = rf_picture_key(s, w, &eye);
  CHECK(rf_set_time(s, 2));
  CHECK(rf_picture_key(s, w, &eye) != open_key);
  CHECK(rf_undo(s));

  char path[] = "/tmp/rayfold-kept-XXXXXX";
  const int file = mkstemp(path);
  CHECK(file >= 0);
  rf_film *f = sky_film(e, s, 7, RF_ALL_PLANES, 3);
  CHECK(rf_film_keep(f, path, key, "mine"));
  rf_film_label label;
  rf_film *back = rf_film_open(e, path, &label);
  int pairs[4][2];
  CHECK(back && label.key == key && !strcmp(label.note, "mine") && !label.is_older);
  CHECK(rf_film_hash(back) == rf_film_hash(f) && rf_film_planes(back) == RF_ALL_PLANES);
  CHECK(rf_film_samples(back, pairs, 4) == 1 && pairs[0][0] == 0 && pairs[0][1] == 3);
  CHECK(!rf_film_open(e, "/nowhere.rff", NULL) && !rf_film_open(NULL, path, NULL) && !rf_film_keep(NULL, path, 0, NULL));
  CHECK(rf_film_samples(NULL, NULL, 0) == 0 && rf_picture_key(NULL, w, &eye) == 0);
  char older[64];
  snprintf(older, sizeof older, "%s~", path);
  remove(path);
  remove(older);
  close(file);
  rf_free(label.note);
  rf_film_destroy(back);
  rf_film_destroy(f);
  rf_world_destroy(w);
  rf_scene_destroy(s);
  rf_engine_destroy(e);
}

TEST(a_render_takes_what_a_scene_file_takes)
{
  static const struct {
    int max_depth, roulette_depth;
    bool is_fine;
  } cases[] = {{0, 0, true},     {4096, 4096, true}, {-1, 3, false},
               {4097, 3, false}, {8, -1, false},     {8, 4097, false}};
  rf_engine *e = rf_engine_create(NULL);
  rf_scene *s = rf_scene_create(e);
  rf_world *w = rf_prepare(s, NULL);
  rf_film *f = rf_film_create(e, 2, 2, RF_BEAUTY);
  rf_eye eye;
  CHECK(rf_camera(s, w, NULL, 1, &eye));
  for (int i = 0; i < 6; i++) {
    rf_render_def def = rf_default_render_def();
    char depth[12];
    def.max_depth = cases[i].max_depth;
    def.roulette_depth = cases[i].roulette_depth;
    def.first_sample = i;
    def.end_sample = i + 1;
    CHECK_MSG(rf_render(w, &eye, &def, f, NULL) == (cases[i].is_fine ? RF_OK : RF_BAD_ARGUMENT), "case %d",
              i);
    snprintf(depth, sizeof depth, "%d", cases[i].max_depth);
    if (cases[i].roulette_depth == 3) CHECK(!rf_set(s, "render.max_depth", depth));
    if (cases[i].is_fine) CHECK(rf_set(s, "render.max_depth", depth));
  }
  rf_film_destroy(f);
  rf_world_destroy(w);
  rf_scene_destroy(s);
  rf_engine_destroy(e);
}

// --- objects --------------------------------------------------------------------------------------
static const rf_frame unmoved = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}};

// Handles are of objects, not of places in a list: what is there is found, what is gone is not.
static void check_developed(const rf_film *f, float want, float tolerance)
{
  rf_develop_def develop = rf_default_develop_def();
  rf_image picture;
  develop.tone_curve = "linear";
  develop.exposure = 0;
  CHECK(rf_develop(f, &develop, &picture));
  for (int i = 0; i < 4 * picture.width * picture.height; i += 4) CHECK_NEAR(picture.pixels[i], want, tolerance);
  rf_image_free(&picture);
}

// A clean picture lies beside the film's own until the film changes; the film's sums and hash stay.
TEST(denoising_leaves_the_film_alone)
{
  rf_engine *e = rf_engine_create(NULL);
  rf_scene *s = rf_scene_create(e);
  const char *text;
  CHECK(rf_set(s, "sky.color", "[0.25, 0.25, 0.25]") && rf_set(s, "render.denoise", "\"fast\""));
  rf_film *f = sky_film(e, s, 7, RF_DENOISE_PLANES, 2), *bare = sky_film(e, s, 7, RF_BEAUTY, 2);
  const uint64_t hash = rf_film_hash(f);
  rf_denoise_def def = rf_scene_denoise_def(s);
  CHECK(!strcmp(def.kind, "fast") && !strcmp(rf_scene_denoise_def(NULL).kind, "off"));
  CHECK(rf_film_denoise(f, &def) && rf_film_hash(f) == hash);
  check_developed(f, 0.25f, 1e-5f);
  rf_film_clear(f);
  check_developed(f, 0, 0);
  CHECK(!rf_film_denoise(bare, &def) && rf_error(e, &text) == RF_BAD_ARGUMENT);
  CHECK_TEXT(text, "RF_DENOISE_PLANES");
  def.kind = "better";
  CHECK(!rf_film_denoise(f, &def) && rf_error(e, &text) == RF_BAD_ARGUMENT);
  CHECK_TEXT(text, "off, fast, good or best");
  def.kind = "best";
  def.weights = "/dev";
  CHECK(!rf_film_denoise(f, &def) && rf_error(e, &text) == RF_NOT_FOUND);
  CHECK_TEXT(text, "tools/denoiser.sh");
  CHECK(!rf_film_denoise(NULL, NULL));
  rf_film_destroy(bare);
  rf_film_destroy(f);
  rf_scene_destroy(s);
  rf_engine_destroy(e);
}

TEST(objects_keep_their_handles)
{
  enum { COUNT = 60 };
  rf_engine *e = rf_engine_create(NULL);
  rf_scene *s = rf_scene_create(e);
  rf_object objects[COUNT];
  bool is_there[COUNT];
  char name[COUNT][16];
  for (int i = 0; i < COUNT; i++) {
    snprintf(name[i], sizeof name[i], "o%d", i);
    objects[i] = rf_add(s, "sphere", name[i]);
    is_there[i] = objects[i].id;
  }
  int removed[COUNT], removed_count = 0;
  for (unsigned step = 0; step < 400; step++) {
    const unsigned i = step * 2654435761u >> 8, k = i % COUNT;
    if (i & 768 && is_there[k]) {
      CHECK(rf_remove(s, objects[k]));
      is_there[k] = false;
      removed[removed_count++] = (int)k;
    } else if (removed_count && rf_undo(s)) {
      is_there[removed[--removed_count]] = true;
    }
    for (int j = 0; j < COUNT; j++) {
      CHECK_MSG(rf_find(s, name[j]).id == (is_there[j] ? objects[j].id : 0), "step %u, object %d", step, j);
      CHECK_MSG(rf_move(s, objects[j], unmoved) == is_there[j], "step %u, object %d", step, j);
    }
  }
  CHECK(removed_count > 10);
  CHECK(!rf_move(s, (rf_object){0}, unmoved) && !rf_move(s, (rf_object){9999}, unmoved) &&
        !rf_find(s, NULL).id);
  rf_scene_destroy(s);
  rf_engine_destroy(e);
}

TEST(many_objects_are_moved_one_by_one)
{
  enum { MANY = 100000 };
  rf_engine *e = rf_engine_create(NULL);
  rf_scene *s = rf_scene_create(e);
  const clock_t start = clock();
  for (int i = 0; i < MANY; i++) {
    char name[16];
    snprintf(name, sizeof name, "o%d", i);
    CHECK(rf_add(s, "sphere", name).id);
    snprintf(name, sizeof name, "o%d", i / 2);
    CHECK(rf_move(s, rf_find(s, name), unmoved));
  }
  const double seconds = (double)(clock() - start) / CLOCKS_PER_SEC;
  CHECK_MSG(seconds < 4, "%.2f s", seconds); // 0.1 s; looking at all objects each time takes 11 s
  rf_scene_destroy(s);
  rf_engine_destroy(e);
}

TEST_MAIN
