// The cache beside a model: taken while it fits, written anew when anything it was made of has changed, and never the
// cause of an error.

#include "scene/cache.h"
#include "tests/saved_model.h"

#include <fcntl.h>
#include <pthread.h>

static const char *const files[] = {"sheet.obj", "sheet.mtl",     "paper.png",      "quads.gltf",
                                    "quads.bin", "sheet.obj.rfm", "quads.gltf.rfm", "places.json"};

static Scene *load(const char *path, bool use_cache)
{
  Err err = {0};
  const LoadOptions options = {.use_cache = use_cache};
  Scene *s = scene_load(path, &options, &err);
  CHECK_MSG(s, "%s", err.text);
  return s;
}

// Would a load take the cache?
static bool is_fresh(const char *path)
{
  Scene *s = load(path, true);
  const bool fresh = s && s->saved && !s->wants_cache;
  scene_destroy(s);
  return fresh;
}

static void touch(const char *name, const char *more)
{
  FILE *f = fopen(model_path(name), "a");
  if (!f || fputs(more, f) < 0 || fclose(f)) abort();
}

static void check_made_anew(rf_engine *e, const char *path, const char *why)
{
  CHECK_MSG(!is_fresh(path), "%s", why);
  const uint64_t hash = saved_hash(e, path, false);
  CHECK_MSG(saved_hash(e, path, true) == hash, "%s: made anew", why);
  CHECK_MSG(is_fresh(path), "%s: kept", why);
  CHECK_MSG(saved_hash(e, path, true) == hash, "%s: taken", why);
}

TEST(a_cache_fits_until_something_changes)
{
  rf_engine *e = rf_engine_create(NULL);
  const char *path = model_path("sheet.obj");
  char obj[200];
  strcpy(obj, path);
  saved_write_obj(9);
  check_made_anew(e, obj, "no cache");
  touch("sheet.obj", "v 3 3 3\nf 1 2 101\n");
  check_made_anew(e, obj, "another model");
  touch("sheet.mtl", "newmtl red\nKd 0 1 0\n");
  check_made_anew(e, obj, "another material");
  unlink(model_path("paper.png"));
  check_made_anew(e, obj, "a missing texture");
  saved_copy("tests/data/image/palette.png", "paper.png");
  check_made_anew(e, obj, "a texture that is back");
  unlink(model_path("sheet.mtl"));
  check_made_anew(e, obj, "a missing library");
  saved_write_obj(9);
  check_made_anew(e, obj, "the first one again");
  // The time of a file says nothing.
  const struct timespec times[2] = {{1, 0}, {1, 0}};
  CHECK(!utimensat(AT_FDCWD, obj, times, 0) && is_fresh(obj));
  rf_engine_destroy(e);
}

TEST(buffers_are_sources_too)
{
  rf_engine *e = rf_engine_create(NULL);
  char gltf[200];
  strcpy(gltf, saved_write_gltf());
  check_made_anew(e, gltf, "no cache");
  FileBytes bin;
  Err err = {0};
  CHECK(file_read(&bin, model_path("quads.bin"), &err));
  char *copy = malloc(bin.size);
  memcpy(copy, bin.data, bin.size);
  const float height = 1.5f;
  memcpy(copy + 2 * 48 + 4, &height, 4);
  model_write("quads.bin", copy, bin.size);
  free(copy);
  file_release(&bin);
  check_made_anew(e, gltf, "another buffer");
  rf_engine_destroy(e);
}

// As after a crash of another program, another version, or a hand that put something else there.
TEST(a_bad_cache_is_written_anew)
{
  rf_engine *e = rf_engine_create(NULL);
  char obj[200], rfm[200];
  strcpy(obj, saved_write_obj(9));
  strcpy(rfm, model_path("sheet.obj.rfm"));
  const uint64_t hash = saved_hash(e, obj, true);
  FileBytes good;
  Err err = {0};
  CHECK(is_fresh(obj) && file_read(&good, rfm, &err));
  for (size_t n = 0; n < good.size; n += 997) {
    char *copy = malloc(good.size);
    memcpy(copy, good.data, good.size);
    copy[n] ^= 4;
    model_write("sheet.obj.rfm", copy, n % 2 ? n : good.size);
    free(copy);
    CHECK_MSG(saved_hash(e, obj, true) == hash && is_fresh(obj), "byte %zu", n);
  }
  file_release(&good);
  CHECK(!unlink(rfm));
  rf_scene *s = saved_load(e, obj, false);
  CHECK(rf_scene_save(s, rfm)); // a saved model of that name is no cache
  rf_scene_destroy(s);
  CHECK(!is_fresh(obj) && saved_hash(e, obj, true) == hash && is_fresh(obj));
  rf_engine_destroy(e);
}

TEST(other_options_are_another_cache)
{
  char obj[200];
  rf_engine *e = rf_engine_create(NULL);
  strcpy(obj, saved_write_obj(4));
  saved_hash(e, obj, true);
  CHECK(is_fresh(obj));
  Err err = {0};
  const LoadOptions outside = {.use_cache = true, .allow_outside = true};
  Scene *s = scene_load(obj, &outside, &err);
  CHECK(s && s->wants_cache);
  scene_destroy(s);
  rf_engine_destroy(e);
}

TEST(models_in_scenes_are_cached)
{
  static const char scene[] =
      "{\"rayfold\":1,\"objects\":[{\"shape\":{\"kind\":\"mesh\",\"file\":\"sheet.obj\"}},"
      "{\"shape\":{\"kind\":\"mesh\",\"file\":\"quads.gltf\"},\"translate\":[0,0.5,0.2]}],"
      "\"sky\":{\"kind\":\"gradient\"},\"camera\":{\"position\":[0.5,1.2,3],\"target\":[0.5,0,0.5]}}";
  rf_engine *e = rf_engine_create(NULL);
  char path[200];
  saved_write_obj(9);
  saved_write_gltf();
  unlink(model_path("sheet.obj.rfm"));
  unlink(model_path("quads.gltf.rfm"));
  strcpy(path, model_write("places.json", scene, sizeof scene - 1));
  const uint64_t hash = saved_hash(e, path, false);
  CHECK(access(model_path("sheet.obj.rfm"), F_OK)); // off unless asked for
  CHECK(saved_hash(e, path, true) == hash && saved_hash(e, path, true) == hash);
  CHECK(!access(model_path("sheet.obj.rfm"), F_OK) && !access(model_path("quads.gltf.rfm"), F_OK));
  CHECK(access(model_path("places.json.rfm"), F_OK)); // a scene file is read as it is
  Scene *s = load(path, true);
  for (size_t i = 0; s && i < s->models.count; i++) CHECK(s->models.items[i].scene->saved);
  scene_destroy(s);
  rf_engine_destroy(e);
}

// The same words as without: what an importer could not honour is in the cache.
TEST(notes_are_kept)
{
  rf_engine *e = rf_engine_create(NULL);
  char obj[200];
  strcpy(obj, saved_write_obj(2));
  unlink(model_path("sheet.mtl"));
  Scene *plain = load(obj, false);
  saved_hash(e, obj, true);
  Scene *cached = load(obj, true);
  CHECK(cached->saved && plain->notes.lines.count && cached->notes.lines.count == plain->notes.lines.count);
  for (size_t i = 0; i < plain->notes.lines.count; i++)
    CHECK(text_equal(plain->notes.lines.items[i], cached->notes.lines.items[i]));
  scene_destroy(plain);
  scene_destroy(cached);
  rf_engine_destroy(e);
}

// A folder in the place of the cache stands for all that keeps it from being written; root may write anywhere.
TEST(what_cannot_be_written_costs_a_note)
{
  rf_engine *e = rf_engine_create(NULL);
  char obj[200];
  strcpy(obj, saved_write_obj(4));
  const uint64_t hash = saved_hash(e, obj, false);
  unlink(model_path("sheet.obj.rfm"));
  mkdir(model_path("sheet.obj.rfm"), 0777);
  rf_scene *s = saved_load(e, obj, true);
  CHECK(saved_hash_scene(e, s) == hash && rf_scene_note(s, 0));
  if (rf_scene_note(s, 0)) CHECK_TEXT(rf_scene_note(s, 0), "no cache is kept: cannot write");
  rf_scene_destroy(s);
  rmdir(model_path("sheet.obj.rfm"));
  rf_engine_destroy(e);
}

typedef struct Writer {
  const char *path;
  uint64_t hash;
} Writer;

static void *load_with_cache(void *user)
{
  const Writer *w = user;
  rf_engine_def def = rf_default_engine_def();
  def.threads = 1;
  rf_engine *e = rf_engine_create(&def);
  for (int i = 0; i < 10; i++) {
    CHECK(saved_hash(e, w->path, true) == w->hash);
    if (i % 3 == 2) {
      char rfm[220];
      snprintf(rfm, sizeof rfm, "%s.rfm", w->path);
      unlink(rfm);
    }
  }
  rf_engine_destroy(e);
  return NULL;
}

// Each writes a file of its own and renames it, so a reader has the whole of one or another.
TEST(many_writers_at_once)
{
  rf_engine *e = rf_engine_create(NULL);
  char obj[200];
  strcpy(obj, saved_write_obj(9));
  Writer w = {obj, saved_hash(e, obj, false)};
  pthread_t threads[4];
  for (int i = 0; i < 4; i++) CHECK(!pthread_create(&threads[i], NULL, load_with_cache, &w));
  for (int i = 0; i < 4; i++) pthread_join(threads[i], NULL);
  rf_engine_destroy(e);
}

TEST(zz_clean)
{
  model_clean(files, sizeof files / sizeof *files);
}

TEST_MAIN
