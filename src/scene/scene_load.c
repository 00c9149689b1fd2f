// Loads any file that can be a scene: chooses the reader by extension, or by the first bytes where there is none,
// keeps the chain of files so that a scene that includes itself is told from a deep one, and finds the other files a
// scene names. It reads no format itself.

#include "base/file.h"
#include "scene/cache.h"
#include "scene/import.h"
#include "scene/kinds.h"
#include "scene/rfm.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

enum {
  DEEPEST = 16, // scenes in scenes
  MOST_NESTED =
      1000, // files that scenes in scenes load; two files that each name two, and so on, would double
};

typedef bool Importer(Scene *s, const char *path, const LoadOptions *options, Err *err);

typedef struct Format {
  const char *extension, *noun;
  Importer *import;
  bool is_cached; // takes long enough to read that a cache beside it pays
} Format;

static const Format formats[] = {
    {".json", "a scene file", import_json, false}, {".obj", "a Wavefront OBJ model", import_obj, true},
    {".gltf", "a glTF model", import_gltf, true},  {".glb", "a binary glTF model", import_gltf, true},
    {".ply", "a PLY model", import_ply, true},     {".stl", "an STL model", import_stl, true},
    {".rfm", "a saved model", import_rfm, false},  {".vox", "a MagicaVoxel model", import_vox, false},
    {".grid", "a grid of densities", import_grid, false}, {".nvdb", "a NanoVDB grid", import_grid, false},
};
enum { FORMAT_COUNT = sizeof formats / sizeof *formats };

// --- which format ---------------------------------------------------------------------------------
static const Format *by_extension(const char *extension)
{
  for (int i = 0; i < FORMAT_COUNT; i++)
    if (!strcasecmp(extension, formats[i].extension)) return &formats[i];
  return NULL;
}

static bool contains(const uint8_t *data, size_t size, const char *word)
{
  return memmem(data, size, word, strlen(word));
}

static const char *guess_extension(const uint8_t *data, size_t size)
{
  enum { LOOK = 1 << 16 };
  if (size >= 4 && !memcmp(data, "glTF", 4)) return ".glb";
  if (size >= 8 && !memcmp(data, RFM_MAGIC, 8)) return ".rfm";
  if (size >= 8 && !memcmp(data, "VOX ", 4)) return ".vox";
  if (size >= 4 && (!memcmp(data, "ply\n", 4) || !memcmp(data, "ply\r", 4))) return ".ply";
  if (size > LOOK) size = LOOK;
  size_t i = size >= 3 && !memcmp(data, "\xef\xbb\xbf", 3) ? 3 : 0;
  while (i < size && strchr(" \t\r\n", data[i]) && data[i]) i++;
  if (i < size && data[i] == '{')
    return contains(data, size, "\"asset\"") && !contains(data, size, "\"rayfold\"") ? ".gltf" : ".json";
  if (size - i >= 5 && !memcmp(data + i, "solid", 5)) return ".stl";
  static const char *const words[] = {"v ", "vn ", "vt ", "f ", "o ", "g ", "mtllib ", "\nv ", "\nmtllib "};
  for (size_t k = 0; k < sizeof words / sizeof *words; k++) {
    const size_t n = strlen(words[k]);
    if (words[k][0] == '\n' ? contains(data, size, words[k])
                            : size - i >= n && !memcmp(data + i, words[k], n))
      return ".obj";
  }
  return "";
}

static const Format *by_content(const char *path, Err *err)
{
  FileBytes file;
  if (!file_read(&file, path, err)) return NULL;
  const Format *found = by_extension(guess_extension(file.data, file.size));
  file_release(&file);
  return found;
}

// What can be said about a file that its reader did not understand: better than that format's syntax error.
static bool explain_content(const char *path, const FileBytes *file, const Format *taken, Err *err)
{
  if (!file->size) return err_set(err, ERR_BAD_SCENE, "%s: the file is empty; save or export it again", path);
  if (file->size >= 2 && (!memcmp(file->data, "\xfe\xff", 2) || !memcmp(file->data, "\xff\xfe", 2)))
    return err_set(err, ERR_BAD_SCENE, "%s: the text is in UTF-16; save it as UTF-8", path);
  const Format *real = by_extension(guess_extension(file->data, file->size));
  return !real || real->import == taken->import ||
         err_set(err, ERR_BAD_SCENE,
                 "%s: the name says it is %s, but its content looks like %s; rename it to end in %s", path,
                 taken->noun, real->noun, real->extension);
}

static void explain(const char *path, const Format *taken, Err *err)
{
  FileBytes file;
  Err better = {0};
  if (!err || err->kind != ERR_BAD_SCENE || !file_read(&file, path, NULL)) return;
  if (!explain_content(path, &file, taken, &better)) *err = better;
  file_release(&file);
}

static const Format *choose(const char *path, Err *err)
{
  const Format *format = by_extension(path_extension(path));
  Err missing = {0};
  if (!format) format = by_content(path, &missing);
  if (format) return format;
  if (missing.kind) {
    err_set(err, missing.kind, "%s", missing.text);
    return NULL;
  }
  Text list = {0};
  for (int i = 0; i < FORMAT_COUNT; i++) text_add(&list, "%s%s", i ? " " : "", formats[i].extension);
  err_set(err, ERR_BAD_SCENE, "%s: this is no scene or model that can be read; there are %s", path,
          text_get(&list));
  text_finish(&list);
  return NULL;
}

// --- the chain of files ---------------------------------------------------------------------------
static bool is_same_file(const char *a, const char *b)
{
  struct stat x, y;
  return !stat(a, &x) && !stat(b, &y) && x.st_dev == y.st_dev && x.st_ino == y.st_ino;
}

static bool chain_fail(const char *path, const LoadOptions *o, const char *what, Err *err)
{
  Text chain = {0};
  for (int i = 0; i < o->depth; i++) text_add(&chain, "\"%.100s\" -> ", o->open_files[i]);
  err_set(err, ERR_BAD_SCENE, "%s: %s\"%.100s\"", what, text_get(&chain), path);
  text_finish(&chain);
  return false;
}

static bool check_chain(const char *path, const LoadOptions *o, Err *err)
{
  for (int i = 0; i < o->depth; i++)
    if (is_same_file(path, o->open_files[i]))
      return chain_fail(path, o, "a scene must not contain itself", err);
  if (o->depth >= DEEPEST) return chain_fail(path, o, "scenes are nested more than 16 deep", err);
  if (o->depth >= 2 && o->nested_count && ++*o->nested_count > MOST_NESTED)
    return err_set(err, ERR_BAD_SCENE,
                   "scenes inside scenes name more than %d files; put shared models into one scene",
                   MOST_NESTED);
  return true;
}

static Scene *begin_scene(const char *path, const Format *format, const LoadOptions *options, Err *err)
{
  Scene *s = scene_create(err);
  if (!s) return NULL;
  s->path = arena_text(&s->arena, path);
  s->root = arena_text(&s->arena, options->root);
  s->allow_outside = options->allow_outside;
  s->is_model = format->import != import_json && format->import != import_element;
  if (s->path && (!options->root || s->root)) return s;
  err_memory(err, path, 0);
  scene_destroy(s);
  return NULL;
}

// A model from the cache beside it; NULL: there is none that fits.
static Scene *load_cached(const char *path, const Format *format, const LoadOptions *options)
{
  if (!options->use_cache || !format->is_cached) return NULL;
  Scene *s = begin_scene(path, format, options, NULL);
  if (s && cache_load(s, path, options)) return s;
  scene_destroy(s);
  return NULL;
}

// The model's own file as the first of a cache's sources. Hashed before it is read: should someone replace it in
// between, the cache is stale at once and never wrong.
static bool note_sources(Scene *s, const Format *format, const LoadOptions *options, Err *err)
{
  FileBytes bytes;
  if (!options->use_cache || !format->is_cached) return true;
  if (!file_read(&bytes, s->path, err)) return false;
  s->wants_cache = cache_add_content(s, s->path, &bytes, options);
  file_release(&bytes);
  return s->wants_cache || err_memory(err, s->path, 0);
}

Scene *scene_load(const char *path, const LoadOptions *options, Err *err)
{
  int count = 0;
  LoadOptions inner = options ? *options : (LoadOptions){0};
  if (!inner.nested_count) inner.nested_count = &count;
  if (!check_chain(path, &inner, err)) return NULL;
  static const Format element = {"", "an element of NoEucRT", import_element, false};
  const Format *format = inner.element ? &element : choose(path, err);
  if (!format) return NULL;
  const char *chain[DEEPEST + 1];
  for (int i = 0; i < inner.depth; i++) chain[i] = inner.open_files[i];
  chain[inner.depth++] = path;
  inner.open_files = chain;
  Scene *s = load_cached(path, format, &inner);
  if (s) return s;
  s = begin_scene(path, format, &inner, err);
  if (!s) return NULL;
  Err first = {0};
  if (note_sources(s, format, &inner, &first) && format->import(s, path, &inner, &first)) {
    s->wants_cache = s->wants_cache && !s->rig; // a cache keeps no clips
    return s;
  }
  if (!inner.element) explain(path, format, &first);
  err_set(err, first.kind, "%s", first.text);
  scene_destroy(s);
  return NULL;
}

// --- files named in a scene -----------------------------------------------------------------------
bool scene_file_path(const Scene *s, const char *file, const LoadOptions *options, Text *out, Err *err)
{
  return path_resolve(out, s->path ? s->path : "", file, options ? options->root : s->root,
                      options ? options->allow_outside : s->allow_outside, err);
}

static bool check_file(const Scene *s, const char *file, Text *path, Err *err)
{
  if (!scene_file_path(s, file, NULL, path, err)) return false;
  struct stat st;
  FileBytes bytes;
  // A folder or a pipe is not a picture; file_read() says so in words. Large files are not read for this.
  if (!stat(text_get(path), &st) && S_ISREG(st.st_mode)) {
    FILE *stream = fopen(text_get(path), "rb");
    if (stream) return !fclose(stream);
  }
  if (!file_read(&bytes, text_get(path), err)) return false;
  file_release(&bytes);
  return true;
}

static bool check_element(const Scene *s, const Group *g, const void *element, Text *path, Err *err)
{
  const Field *f;
  void *at;
  for (size_t i = 0; (f = group_field_at(g, element, i, &at)); i++)
    if (f->type == FIELD_file && *(const char **)at && **(const char **)at && !check_file(s, *(const char **)at, path, err))
      return false;
  return !g->nested || check_element(s, g->nested, group_nested(g, element), path, err);
}

static bool fail_in_element(const Scene *s, const Section *c, size_t i, Err *err)
{
  Text where = {0};
  section_path(s, c, i, &where);
  err_where(err, "%s: %s", s->path ? s->path : "scene", text_get(&where));
  text_finish(&where);
  return false;
}

bool scene_check_files(const Scene *s, Err *err)
{
  Text path = {0};
  bool ok = true;
  for (int k = 0; ok && k < SECTION_COUNT; k++) {
    const Section *c = &scene_sections[k];
    for (size_t i = 0; ok && i < section_count(s, c); i++)
      ok = check_element(s, c->group, section_at(s, c, i), &path, err) || fail_in_element(s, c, i, err);
  }
  text_finish(&path);
  for (size_t i = 0; ok && i < s->models.count; i++) ok = scene_check_files(s->models.items[i].scene, err);
  return ok;
}
