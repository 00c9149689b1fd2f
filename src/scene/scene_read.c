// Reads the scene file, strictly: an unknown key, kind, name or an impossible value is an error with its place.
// First the names of all textures, materials, media, cameras, skies, cells and gates are entered, then everything is filled in, so that a
// reference may stand before what it names. It knows sections and tables, no parameter by heart.

#include "base/file.h"
#include "base/mem.h"
#include "scene/element.h"
#include "scene/gates.h"
#include "scene/import.h"
#include "scene/mix_check.h"
#include "scene/rfm.h"

#include <stdio.h>
#include <string.h>

enum { FILE_VERSION = 1 };

typedef struct SceneReader {
  ElementReader element;
  const Json *root;
} SceneReader;

// --- the whole ------------------------------------------------------------------------------------
static bool check_version(const SceneReader *r, Err *err)
{
  const Json *v = js_get(r->root, "rayfold");
  if (js_kind(r->root) != JSON_DICT || (!v && js_get(r->root, "asset")))
    return js_fail(r->element.doc, NULL, NULL, 0, false, err,
                   "this is not a scene file, which begins { \"rayfold\": %d%s", FILE_VERSION,
                   js_get(r->root, "asset") ? "; it looks like glTF, so name it .gltf" : "");
  if (!v)
    return js_fail(r->element.doc, NULL, NULL, 0, false, err,
                   "the member \"rayfold\": %d is missing, which tells a scene file from other JSON",
                   FILE_VERSION);
  if (js_kind(v) == JSON_NUMBER && js_number(v, 0) == FILE_VERSION) return true;
  return js_fail(r->element.doc, r->root, "rayfold", 0, false, err,
                 "rayfold must be %d, the version of the format that this program reads", FILE_VERSION);
}

static bool check_sections(const SceneReader *r, Err *err)
{
  const char *names[SECTION_COUNT + 1] = {"rayfold"};
  for (int i = 0; i < SECTION_COUNT; i++) names[i + 1] = scene_sections[i].group->name;
  for (JsonMember m = js_first(r->root); m.key; m = js_next(r->root, m)) {
    if (!strcmp(m.key, names[0]) || section_find(m.key)) continue;
    char hint[120];
    return js_fail(r->element.doc, r->root, m.key, 0, true, err, "\"%.60s\" is not a section of a scene%s",
                   m.key, text_hint(hint, m.key, names, SECTION_COUNT + 1));
  }
  return true;
}

static bool check_forms(const SceneReader *r, Err *err)
{
  for (int i = 0; i < SECTION_COUNT; i++) {
    const Section *c = &scene_sections[i];
    const char *key = c->group->name;
    const Json *v = js_get(r->root, key);
    const bool is_list = c->form == SECTION_LIST;
    if (!v || js_kind(v) == (is_list ? JSON_LIST : JSON_DICT)) continue;
    return js_fail(r->element.doc, r->root, key, 0, false, err, "%s must be a %s, but is %s", key,
                   is_list ? "list [ ... ]" : "dictionary { ... }", js_kind_name(v));
  }
  return true;
}

// --- first pass: names ----------------------------------------------------------------------------
static bool enter_name(SceneReader *r, const Section *c, const Json *dict, const char *key, Err *err)
{
  Scene *s = r->element.scene;
  const size_t length = strlen(key);
  if (!length || length > LONGEST_TEXT)
    return js_fail(r->element.doc, dict, key, 0, true, err,
                   "the name of a %s must have 1 to %d bytes, not %zu", c->group->noun, LONGEST_TEXT, length);
  union {
    Camera camera;
    NamedSky sky;
    Cell cell;
    Gate gate;
    Texture texture;
    Material material;
    Medium medium;
  } fresh;
  group_default(c->group, 0, &fresh);
  const char *name = arena_text(&s->arena, key);
  *group_name(c->group, &fresh) = name;
  return (name && section_insert(s, c, section_count(s, c), &fresh)) || err_memory(err, key, c->group->size);
}

static bool enter_names(SceneReader *r, Err *err)
{
  for (int i = 0; i < SECTION_COUNT; i++) {
    const Section *c = &scene_sections[i];
    const Json *dict = c->form == SECTION_BY_NAME ? js_get(r->root, c->group->name) : NULL;
    for (JsonMember m = js_first(dict); m.key; m = js_next(dict, m))
      if (!enter_name(r, c, dict, m.key, err)) return false;
  }
  return true;
}

// --- second pass: content -------------------------------------------------------------------------
static bool read_one(const SceneReader *r, const Section *c, const Json *v)
{
  Scene *s = r->element.scene;
  if (section_given(s, c)) *section_given(s, c) = true;
  return element_read(&r->element, c->group, v, (ElementPlace){r->root, c->group->name, 0},
                      section_at(s, c, 0));
}

static bool read_by_name(const SceneReader *r, const Section *c, const Json *v)
{
  Scene *s = r->element.scene;
  size_t i = 0;
  for (JsonMember m = js_first(v); m.key; m = js_next(v, m), i++)
    if (!element_read(&r->element, c->group, m.value, (ElementPlace){v, m.key, 0}, section_at(s, c, i)))
      return false;
  return true;
}

static bool read_list(const SceneReader *r, const Section *c, const Json *v)
{
  Scene *s = r->element.scene;
  union {
    Object object;
    Light light;
    Track track;
  } fresh;
  for (size_t i = 0; i < js_count(v); i++) {
    memset(&fresh, 0, sizeof fresh);
    if (!element_read(&r->element, c->group, js_at(v, i), (ElementPlace){v, NULL, i}, &fresh)) return false;
    if (!section_insert(s, c, i, &fresh)) return err_memory(r->element.err, c->group->name, c->group->size);
  }
  return true;
}

// Mixes may name materials that are read after them, so they are looked at when all are there.
static bool check_mixes(const SceneReader *r)
{
  int32_t i;
  const char *field;
  Err wrong = {0};
  const Scene *s = r->element.scene;
  if (mix_check(s, NULL, -1, &i, &field, &wrong)) return true;
  const Json *dict = js_get(js_get(r->root, group_material.name), s->materials.items[i].name);
  return js_fail(r->element.doc, dict, field, 0, false, r->element.err, "%s", wrong.text);
}

// Gates, likewise, name each other.
static bool check_gates(const SceneReader *r)
{
  int32_t i = 0;
  const char *field = NULL;
  Err wrong = {0};
  Scene *s = r->element.scene;
  if (!s->gates.count && !s->cells.count) return true;
  GateLink(*links)[2] = mem_zero(s->gates.count + 1, sizeof *links);
  if (!links) return err_memory(r->element.err, "gates", s->gates.count * sizeof *links);
  const bool is_linked = gates_link(s, links, &i, &field, &wrong);
  mem_free(links);
  if (!is_linked) {
    const Json *dict = js_get(r->root, group_gate.name), *gate = js_get(dict, s->gates.items[i].name);
    return field && js_get(gate, field) ? js_fail(r->element.doc, gate, field, 0, false, r->element.err, "%s", wrong.text)
                                        : js_fail(r->element.doc, dict, s->gates.items[i].name, 0, true, r->element.err, "%s", wrong.text);
  }
  if (cells_check(s, &i, &wrong)) return true;
  return js_fail(r->element.doc, js_get(r->root, group_cell.name), s->cells.items[i].name, 0, true, r->element.err, "%s", wrong.text);
}

static bool read_sections(const SceneReader *r)
{
  for (int i = 0; i < SECTION_COUNT; i++) {
    const Section *c = &scene_sections[i];
    const Json *v = js_get(r->root, c->group->name);
    if (!v) continue;
    bool ok = false;
    switch (c->form) {
    case SECTION_ONE: ok = read_one(r, c, v); break;
    case SECTION_BY_NAME: ok = read_by_name(r, c, v); break;
    case SECTION_LIST: ok = read_list(r, c, v); break;
    }
    if (!ok) return false;
  }
  return check_mixes(r) && check_gates(r);
}

static bool read_names(SceneReader *r)
{
  Err *err = r->element.err;
  r->root = js_root(r->element.doc);
  return check_version(r, err) && check_sections(r, err) && check_forms(r, err) && enter_names(r, err);
}

// Gives embedded pictures to the textures just named, before their content is read.
static bool link_pictures(Scene *s, const RfmPictures *p, const char *path, Err *err)
{
  bool ok = p->texture_count == s->textures.count;
  for (size_t i = 0; ok && i < p->texture_count; i++) {
    const int32_t k = p->picture_of[i];
    ok = k >= -1 && (k < 0 || (size_t)k < p->picture_count);
    if (!ok || k < 0) continue;
    s->textures.items[i].embedded = p->pictures[k].data;
    s->textures.items[i].embedded_size = p->pictures[k].size;
  }
  return ok ||
         err_set(err, ERR_BAD_SCENE,
                 "%s: this saved model is damaged: its textures and pictures do not fit together; convert "
                 "it again from the model it was made of",
                 path);
}

bool scene_read_linked(Scene *s, Span text, const char *path, const RfmPictures *pictures,
                       const LoadOptions *options, Err *err)
{
  JsonDoc *doc = js_parse(text.data, text.size, path, err);
  SceneReader r = {.element = {.scene = s, .doc = doc, .options = options, .is_edit = true, .err = err}};
  const bool ok = doc && read_names(&r) && link_pictures(s, pictures, path, err) && read_sections(&r);
  js_free(doc);
  return ok;
}

static bool is_blank(const uint8_t *data, size_t size)
{
  for (size_t i = 0; i < size; i++)
    if (!strchr(" \t\r\n", data[i]) || !data[i]) return false;
  return true;
}

bool import_json_text(Scene *s, const char *path, const char *text, size_t size, const LoadOptions *options, Err *err)
{
  JsonDoc *doc = js_parse(text, size, path, err);
  SceneReader r = {.element = {.scene = s, .doc = doc, .options = options, .err = err}};
  const bool ok = doc && read_names(&r) && read_sections(&r);
  js_free(doc);
  return ok;
}

bool import_json(Scene *s, const char *path, const LoadOptions *options, Err *err)
{
  const LoadOptions none = {0};
  if (!options) options = &none;
  if (!s->path) s->path = arena_text(&s->arena, path);
  s->root = arena_text(&s->arena, options->root);
  s->allow_outside = options->allow_outside;
  if (!s->path || (options->root && !s->root)) return err_memory(err, path, 0);
  FileBytes file;
  if (!file_read(&file, path, err)) return false;
  const size_t mark =
      file.size >= 3 && !memcmp(file.data, "\xef\xbb\xbf", 3) ? 3 : 0; // Windows editors write one
  bool ok = false;
  if (is_blank(file.data + mark, file.size - mark)) {
    err_set(err, ERR_BAD_SCENE, "%s: the file is empty; a scene file begins { \"rayfold\": %d", path,
            FILE_VERSION);
  } else {
    ok = import_json_text(s, path, (const char *)file.data + mark, file.size - mark, options, err);
  }
  file_release(&file);
  return ok;
}
