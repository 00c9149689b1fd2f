// See element.h.

#include "scene/element.h"

#include "base/file.h"
#include "base/mem.h"
#include "scene/mesh_json.h"
#include "scene/track.h"
#include "scene/voxels_json.h"

#include <limits.h>
#include <stdio.h>
#include <string.h>

const char element_mesh_key[] = "mesh";

// --- reading --------------------------------------------------------------------------------------
// An error at the dictionary itself, which stands as a member of its container.
static bool fail_here(const ElementReader *r, ElementPlace p, const char *message)
{
  return js_fail(r->doc, p.container, p.key, p.index, false, r->err, "%s", message);
}

static bool fail_at_key(const ElementReader *r, const Json *dict, const char *key, const char *message)
{
  return js_fail(r->doc, dict, key, 0, true, r->err, "%s", message);
}

typedef struct Candidates {
  const char *names[96];
  size_t count;
} Candidates;

static void add_candidate(Candidates *c, const char *name)
{
  if (c->count < sizeof c->names / sizeof *c->names) c->names[c->count++] = name;
}

static void add_kinds_with(const Group *g, const char *key, Text *out)
{
  bool is_first = true;
  for (size_t k = 0; k < g->kind_count; k++)
    for (size_t i = 0; i < g->kinds[k].field_count; i++)
      if (!strcmp(g->kinds[k].fields[i].name, key)) {
        text_add(out, is_first ? "; it belongs to kind \"%s\"" : ", \"%s\"", g->kinds[k].name);
        is_first = false;
      }
}

static bool fail_unknown(const ElementReader *r, const Group *g, const void *out, const Json *dict,
                         const char *key)
{
  Candidates c = {0};
  const Field *f;
  for (size_t i = 0; (f = group_field_at(g, out, i, NULL)); i++) add_candidate(&c, f->name);
  if (g->has_kind) add_candidate(&c, "kind");
  if (group_is_listed(g)) add_candidate(&c, "name");
  if (g->nested) add_candidate(&c, g->nested->name);
  for (int i = 0; g == &group_shape && i < MESH_KEY_COUNT; i++) add_candidate(&c, mesh_keys[i].name);
  for (int i = 0; g == &group_shape && i < VOXEL_KEY_COUNT; i++) add_candidate(&c, voxel_keys[i].name);
  char hint[120];
  Text message = {0};
  text_add(&message, "\"%.60s\" is not a field of ", key);
  if (g->has_kind)
    text_add(&message, "a %s of kind \"%s\"", g->noun, group_kind(g, out)->name);
  else
    text_add(&message, "%s %s", g == &group_object ? "an" : "the", g->noun);
  const size_t plain = message.length;
  add_kinds_with(g, key, &message);
  if (message.length == plain) text_add(&message, "%s", text_hint(hint, key, c.names, c.count));
  fail_at_key(r, dict, key, text_get(&message));
  text_finish(&message);
  return false;
}

static bool read_kind(const ElementReader *r, const Group *g, const Json *dict, ElementPlace place,
                      int32_t *kind)
{
  const Json *v = js_get(dict, "kind");
  *kind = 0;
  if (!g->has_kind || (!v && g->kind_optional)) return true;
  Candidates c = {0};
  Text list = {0};
  for (size_t i = 0; i < g->kind_count; i++) {
    add_candidate(&c, g->kinds[i].name);
    text_add(&list, "%s\"%s\"", i == 0 ? "" : i + 1 < g->kind_count ? ", " : " or ", g->kinds[i].name);
  }
  char hint[120], message[600];
  const char *name = js_text(v);
  *kind = name ? group_find_kind(g, name) : -1;
  if (!v) {
    snprintf(message, sizeof message, "a %s needs a \"kind\": %s", g->noun, text_get(&list));
    fail_here(r, place, message);
  } else if (!name) {
    js_fail(r->doc, dict, "kind", 0, false, r->err, "kind must be %s, but is %s", text_get(&list),
            js_kind_name(v));
  } else if (*kind < 0) {
    text_hint(hint, name, c.names, c.count);
    js_fail(r->doc, dict, "kind", 0, false, r->err, "\"%.60s\" is not a kind of %s (there are %s)%s", name,
            g->noun, text_get(&list), hint);
  }
  text_finish(&list);
  return *kind >= 0;
}

static bool read_name(const ElementReader *r, const Json *dict, const Json *v, const char **name)
{
  static const Field field = {.type = FIELD_text, .name = "name"};
  Err wrong = {0};
  int item;
  if (js_kind(v) == JSON_NULL_ || !value_read(r->scene, &field, v, name, &item, &wrong) || !**name)
    return js_fail(r->doc, dict, "name", 0, false, r->err, "%s",
                   wrong.kind ? wrong.text : "a name must be a text that is not empty");
  return true;
}

// An error inside a value has the place of the value, or of the item of it that is at fault.
static bool read_field(const ElementReader *r, const Field *f, const Json *dict, JsonMember m, void *at)
{
  Err wrong = {0};
  int item;
  if (value_read(r->scene, f, m.value, at, &item, &wrong)) return true;
  if (wrong.kind == ERR_NO_MEMORY) return err_set(r->err, wrong.kind, "%s", wrong.text);
  if (item >= 0) return js_fail(r->doc, m.value, NULL, (size_t)item, false, r->err, "%s", wrong.text);
  return js_fail(r->doc, dict, m.key, 0, false, r->err, "%s", wrong.text);
}

static bool read_mesh_reference(const ElementReader *r, const Json *dict, JsonMember m, Shape *shape)
{
  const double i = js_number(m.value, -1);
  const size_t count = r->scene->meshes.count;
  if (!(i >= 0 && i < (double)count))
    return js_fail(r->doc, dict, m.key, 0, false, r->err,
                   "the scene holds meshes 0 to %zu, and this is none of them", count ? count - 1 : 0);
  shape->mesh_i = (int32_t)i;
  return true;
}

static bool read_member(const ElementReader *r, const Group *g, const Json *dict, JsonMember m, void *out)
{
  void *at;
  const bool is_mesh = g == &group_shape && ((Shape *)out)->kind == SHAPE_MESH;
  const bool is_voxels = g == &group_shape && ((Shape *)out)->kind == SHAPE_VOXELS;
  if (g->has_kind && !strcmp(m.key, "kind")) return true;
  if (group_is_listed(g) && !strcmp(m.key, "name"))
    return read_name(r, dict, m.value, group_name(g, out));
  if (g->nested && !strcmp(m.key, g->nested->name))
    return element_read(r, g->nested, m.value, (ElementPlace){dict, m.key, 0}, group_nested(g, out));
  if (is_mesh && r->is_edit && !strcmp(m.key, element_mesh_key)) return read_mesh_reference(r, dict, m, out);
  if (is_mesh && mesh_json_is_key(m.key)) return true; // all together, afterwards
  if (is_voxels && voxels_json_is_key(m.key)) return true;
  const Field *f = group_find_field(g, out, m.key, &at);
  return f ? read_field(r, f, dict, m, at) : fail_unknown(r, g, out, dict, m.key);
}

static bool read_mesh(const ElementReader *r, const Json *dict, Shape *shape)
{
  if (shape->kind != SHAPE_MESH || !mesh_json_is_given(dict)) return true;
  if (shape->mesh.file || shape->mesh_i >= 0)
    return fail_at_key(r, dict, shape->mesh.file ? "file" : element_mesh_key,
                       "a mesh has either a file or lists of its own, not both");
  return mesh_json_read(r->scene, r->doc, dict, NULL, &shape->mesh_i, r->err);
}

static bool load_model(const ElementReader *r, const Json *dict, const Group *g, void *out)
{
  Err wrong = {0};
  if (element_load_model(r->scene, g, out, r->options, &wrong)) return true;
  // In a chain of scenes the last one knows why, the first one adds where it began.
  if (r->options && r->options->depth > 1) return err_set(r->err, wrong.kind, "%s", wrong.text);
  js_fail(r->doc, dict, "file", 0, false, r->err, "cannot load this model: %s", wrong.text);
  if (r->err) r->err->kind = wrong.kind; // a missing file stays a missing file
  return false;
}

// The error's place is the value at fault in a key, the key, or the track's own field.
static bool bind_track(const ElementReader *r, const Json *dict, ElementPlace place, Track *track)
{
  Err wrong = {0};
  int item;
  const char *member;
  if (track_bind(r->scene, track, &item, &member, &wrong)) return true;
  if (wrong.kind == ERR_NO_MEMORY) return err_set(r->err, wrong.kind, "%s", wrong.text);
  const Json *keys = js_get(dict, "keys"), *key = item >= 0 ? js_at(keys, (size_t)item) : NULL;
  if (key && js_get(key, member)) return js_fail(r->doc, key, member, 0, false, r->err, "%s", wrong.text);
  if (key) return js_fail(r->doc, keys, NULL, (size_t)item, false, r->err, "%s", wrong.text);
  return member && js_get(dict, member) ? js_fail(r->doc, dict, member, 0, false, r->err, "%s", wrong.text)
                                        : fail_here(r, place, wrong.text);
}

// Defaults, but what has no form in JSON stays: the name (a key outside), an object's id, a picture's bytes.
static void set_default(const Group *g, int32_t kind, void *out)
{
  const char **name = group_name(g, out), *kept_name = name ? *name : NULL;
  const Texture texture = g == &group_texture ? *(const Texture *)out : (Texture){0};
  const uint32_t id = g == &group_object ? ((const Object *)out)->id : 0;
  group_default(g, kind, out);
  if (name) *name = kept_name;
  if (g == &group_object) ((Object *)out)->id = id;
  if (g == &group_texture) {
    ((Texture *)out)->embedded = texture.embedded;
    ((Texture *)out)->embedded_size = texture.embedded_size;
  }
}

void element_drop_unused(const Group *g, void *element)
{
  Texture *t = element;
  if (g != &group_texture || (t->kind == TEXTURE_IMAGE && !t->image.file)) return;
  t->embedded = NULL;
  t->embedded_size = 0;
}

bool element_read(const ElementReader *r, const Group *g, const Json *dict, ElementPlace place, void *out)
{
  char message[300];
  if (js_kind(dict) != JSON_DICT) {
    snprintf(message, sizeof message, "%s %s must be a dictionary { ... }, but is %s",
             g->has_kind ? "a" : "the", g->noun, js_kind_name(dict));
    return fail_here(r, place, message);
  }
  int32_t kind;
  if (!read_kind(r, g, dict, place, &kind)) return false;
  set_default(g, kind, out);
  for (JsonMember m = js_first(dict); m.key; m = js_next(dict, m))
    if (!read_member(r, g, dict, m, out)) return false;
  if (g->nested && !js_get(dict, g->nested->name)) {
    snprintf(message, sizeof message, "this %s needs a \"%s\"", g->noun, g->nested->name);
    return fail_here(r, place, message);
  }
  if (g == &group_shape && !read_mesh(r, dict, out)) return false;
  element_drop_unused(g, out);
  const char *field;
  Err wrong = {0};
  if (!element_check(g, out, &field, &wrong))
    return js_get(dict, field ? field : "") ? js_fail(r->doc, dict, field, 0, false, r->err, "%s", wrong.text)
                                            : fail_here(r, place, wrong.text);
  if (g == &group_track) return bind_track(r, dict, place, out);
  if (!load_model(r, dict, g, out)) return false;
  const bool is_voxels = g == &group_shape && ((Shape *)out)->kind == SHAPE_VOXELS;
  return !is_voxels || voxels_json_read(r, dict, place, out);
}

// --- models ---------------------------------------------------------------------------------------
static int32_t add_model(Scene *s, const char *path, const LoadOptions *options, Err *err)
{
  Model model = {.file = arena_text(&s->arena, path)};
  if (!model.file || !array_reserve(&s->models, s->models.count + 1)) {
    err_memory(err, path, 0);
    return -1;
  }
  model.scene = scene_load(path, options, err);
  if (!model.scene) return -1;
  array_push(&s->models, model);
  return (int32_t)s->models.count - 1;
}

bool element_load_model(Scene *s, const Group *g, void *element, const LoadOptions *options, Err *err)
{
  if (g != &group_shape) return true;
  Shape *shape = element;
  const bool is_voxels = shape->kind == SHAPE_VOXELS && shape->voxels.file && shape->voxels_i < 0;
  if (!is_voxels && (shape->kind != SHAPE_MESH || !shape->mesh.file || shape->model_i >= 0)) return true;
  Text path = {0}, folder = {0};
  // An edit begins a chain of its own, so that a scene cannot be put into itself.
  LoadOptions inner = {
      .allow_outside = s->allow_outside, .root = s->root, .depth = s->path != NULL, .open_files = &s->path};
  if (options) inner = *options;
  bool ok = scene_file_path(s, is_voxels ? shape->voxels.file : shape->mesh.file, &inner, &path, err);
  if (ok && is_voxels) {
    ok = scene_load_voxels(s, text_get(&path), &shape->voxels_i, err);
  } else if (ok) {
    if (!inner.root) {
      path_folder(&folder, s->path ? s->path : "");
      inner.root = text_get(&folder);
    }
    shape->model_i = scene_find_model(s, text_get(&path));
    if (shape->model_i < 0) shape->model_i = add_model(s, text_get(&path), &inner, err);
    ok = shape->model_i >= 0;
  }
  text_finish(&path);
  text_finish(&folder);
  return ok;
}

// --- writing --------------------------------------------------------------------------------------
static void add_key(Text *out, const char *key)
{
  if (out->data[out->length - 1] != '{') text_add(out, ",");
  js_put_text(out, key);
  text_add(out, ":");
}

static void write_fields(const Scene *s, const Group *g, const void *element, Text *out, bool *is_finite)
{
  const Field *f;
  void *at;
  for (size_t i = 0; (f = group_field_at(g, element, i, &at)); i++) {
    if (value_is_default(f, at)) continue;
    add_key(out, f->name);
    value_write(s, f, at, out, is_finite);
  }
}

static void write_mesh(const Scene *s, const Shape *shape, size_t mesh_limit, Text *out, bool *is_finite)
{
  const bool has_mesh = shape->mesh_i >= 0 && (size_t)shape->mesh_i < s->meshes.count;
  if (shape->kind != SHAPE_MESH || shape->mesh.file || !has_mesh) return;
  const MeshData *m = s->meshes.items[shape->mesh_i].data;
  if (m->triangle_count <= mesh_limit)
    mesh_json_write(m, out, is_finite);
  else
    text_add(out, ",\"%s\":%d", element_mesh_key, shape->mesh_i);
}

void element_write(const Scene *s, const Group *g, const void *element, bool as_list_item, size_t mesh_limit,
                   Text *out, bool *is_finite)
{
  text_add(out, "{");
  if (out->failed) return;
  const char **name = group_name(g, element);
  if (as_list_item && name && *name) {
    add_key(out, "name");
    js_put_text(out, *name);
  }
  const Kind *kind = group_kind(g, element);
  if (g->has_kind && !(g->kind_optional && kind == g->kinds)) {
    add_key(out, "kind");
    js_put_text(out, kind->name);
  }
  if (g->nested) {
    add_key(out, g->nested->name);
    element_write(s, g->nested, group_nested(g, element), false, mesh_limit, out, is_finite);
  }
  write_fields(s, g, element, out, is_finite);
  if (g == &group_shape) write_mesh(s, element, mesh_limit, out, is_finite);
  if (g == &group_shape) voxels_json_write(s, element, out);
  text_add(out, "}");
}
