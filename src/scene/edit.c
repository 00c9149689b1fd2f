// See edit.h. An edit works on a copy of the one element it touches; only when the copy has passed every check is it
// put in place, and from there on nothing can fail.

#include "scene/edit.h"

#include "base/mem.h"
#include "image/voxels.h"
#include "scene/element.h"
#include "scene/mix_check.h"
#include "scene/target.h"
#include "scene/track.h"
#include "scene/voxels_json.h"

#include <stdio.h>
#include <string.h>

enum { MOST_CHANGES = 1000, INLINE_TRIANGLES = 64 };

typedef enum Action { ACTION_REPLACE, ACTION_INSERT, ACTION_REMOVE } Action;

// One edit being made.
typedef struct Edit {
  Scene *scene;
  const char *path;
  Target target;
  JsonDoc *doc;  // the value
  void *element; // the copy
  bool is_given; // afterwards, of a section that may be absent
  Action action;
  Err *err;
} Edit;

static bool fail(const Edit *e, const char *message)
{
  return err_set(e->err, ERR_BAD_SCENE, "%.200s: %s", e->path, message);
}

// --- the value ------------------------------------------------------------------------------------
static JsonDoc *parse_value(const char *path, const char *json, Err *err)
{
  Err wrong = {0};
  JsonDoc *doc = js_parse(json, strlen(json), path, &wrong);
  if (doc) return doc;
  const char first = json[strspn(json, " \t\r\n")];
  if (wrong.kind == ERR_NO_MEMORY || first == '{' || first == '[' || first == '"') {
    err_set(err, wrong.kind, "%s", wrong.text);
    return NULL;
  }
  Text quoted = {0};
  js_put_text(&quoted, json);
  doc = js_parse(text_get(&quoted), quoted.length, path, err);
  text_finish(&quoted);
  return doc;
}

// --- editing the copy -----------------------------------------------------------------------------
static ElementReader reader(const Edit *e)
{
  return (ElementReader){.scene = e->scene, .doc = e->doc, .is_edit = true, .err = e->err};
}

static bool set_name(const Edit *e)
{
  const Section *c = e->target.section;
  const Json *v = js_root(e->doc);
  const char **name = group_name(c->group, e->element), *wanted = js_text(v);
  if (js_kind(v) == JSON_NULL_ && c->form == SECTION_LIST) return *name = NULL, true;
  if (!wanted || !*wanted || strlen(wanted) > LONGEST_TEXT)
    return fail(e, "a name must be a text of 1 to 4096 bytes");
  if (text_equal(*name, wanted)) return true;
  if (c->form == SECTION_BY_NAME && section_index(e->scene, c, wanted) >= 0)
    return err_set(e->err, ERR_BAD_SCENE, "%.200s: there is a %s \"%.100s\" already", e->path, c->group->noun,
                   wanted);
  *name = arena_text(&e->scene->arena, wanted);
  return *name || err_memory(e->err, wanted, strlen(wanted));
}

static bool is_same_field(const Field *a, const Field *b)
{
  return a->type == b->type && !strcmp(a->name, b->name) &&
         (a->type != FIELD_choice || !strcmp(a->unit, b->unit));
}

// Takes over the value of a field of the same name, if it is allowed there, too.
static void keep_value(const Edit *e, const Field *from, const void *from_at, const Field *to, void *to_at)
{
  if (!is_same_field(from, to)) return;
  Text text = {0};
  value_write(e->scene, from, from_at, &text, NULL);
  JsonDoc *doc = js_parse(text_get(&text), text.length, "value", NULL);
  int item;
  if (doc) (void)value_read(e->scene, to, js_root(doc), to_at, &item, NULL);
  js_free(doc);
  text_finish(&text);
}

static bool set_kind(const Edit *e)
{
  const Group *g = e->target.group;
  const char *name = js_text(js_root(e->doc));
  const int32_t kind = name ? group_find_kind(g, name) : -1;
  if (kind < 0) {
    const char *names[32];
    size_t count = 0;
    for (; count < g->kind_count && count < 32; count++) names[count] = g->kinds[count].name;
    char hint[120];
    return err_set(e->err, ERR_BAD_SCENE, "%.200s: \"%.60s\" is not a kind of %s%s", e->path,
                   name ? name : "", g->noun, text_hint(hint, name ? name : "", names, count));
  }
  void *object = target_group(&e->target, e->element);
  if (group_kind(g, object) == &g->kinds[kind]) return true;
  void *fresh = mem_zero(1, g->size);
  if (!fresh) return err_memory(e->err, e->path, g->size);
  group_default(g, kind, fresh);
  if (g->has_name) *group_name(g, fresh) = *group_name(g, object);
  const Field *to, *from;
  void *to_at, *from_at;
  for (size_t i = 0; (to = group_field_at(g, fresh, i, &to_at)); i++)
    if ((from = group_find_field(g, object, to->name, &from_at))) keep_value(e, from, from_at, to, to_at);
  memcpy(object, fresh, g->size);
  mem_free(fresh);
  return true;
}

// Another file: its cells are loaded later. Without one the cells stay, but must now be written out.
static bool another_voxels(const Edit *e, Shape *shape)
{
  if (shape->voxels.file || shape->voxels_i < 0) return shape->voxels_i = -1, true;
  SceneVoxels v = e->scene->voxels.items[shape->voxels_i];
  v.is_program = false;
  (void)voxels_share(v.data);
  shape->voxels_i = scene_add_voxels(e->scene, &v);
  return shape->voxels_i >= 0 || err_memory(e->err, e->path, 0);
}

static bool set_stroke(const Edit *e)
{
  const ElementReader r = reader(e);
  Shape *shape = target_group(&e->target, e->element);
  Err wrong = {0};
  if (shape->voxels_i < 0) return fail(e, "there are no voxels to edit yet; give the shape a file, or a size");
  ElementReader quiet = r;
  quiet.err = &wrong;
  return voxels_json_strokes(&quiet, shape, &shape->voxels_i) || err_set(e->err, wrong.kind, "%.200s: %s", e->path, wrong.text);
}

static bool set_field(const Edit *e)
{
  const Field *f = &e->target.field;
  void *at = target_field(&e->target, e->element);
  const Json *v = js_root(e->doc);
  if (js_kind(v) == JSON_NULL_) {
    fields_default(f, 1, (char *)at - f->offset);
  } else {
    Err wrong = {0};
    int item;
    if (!value_read(e->scene, f, v, at, &item, &wrong))
      return err_set(e->err, wrong.kind, "%.200s: %s", e->path, wrong.text);
  }
  if (e->target.group == &group_shape && f->type == FIELD_file) { // another model
    Shape *shape = target_group(&e->target, e->element);
    if (shape->kind == SHAPE_VOXELS) return another_voxels(e, shape);
    shape->model_i = -1;
    if (shape->mesh.file) shape->mesh_i = -1;
  }
  return true;
}

static bool set_whole(Edit *e)
{
  const Target *t = &e->target;
  const Section *c = t->section;
  const Json *v = js_root(e->doc);
  const ElementReader r = reader(e);
  if (js_kind(v) == JSON_NULL_ && !t->is_nested) {
    if (t->is_new) return fail(e, "there is no such thing to remove");
    if (c->form == SECTION_ONE) group_default(c->group, 0, e->element);
    e->is_given = false;
    e->action = c->form == SECTION_ONE ? ACTION_REPLACE : ACTION_REMOVE;
    return true;
  }
  if (t->is_new) {
    e->action = ACTION_INSERT;
    const char **name = group_name(c->group, e->element);
    if (t->name.length && !(*name = arena_text(&e->scene->arena, text_get(&t->name))))
      return err_memory(e->err, e->path, t->name.length);
  }
  return element_read(&r, t->group, v, (ElementPlace){0}, target_group(t, e->element));
}

static bool bind_track(const Edit *e, Track *track, Err *err)
{
  int item;
  const char *member;
  if (track_bind(e->scene, track, &item, &member, err)) return true;
  if (item >= 0) err_where(err, "key %d", item);
  return false;
}

static bool check_group(const Edit *e, const Group *g, void *element)
{
  Err wrong = {0};
  element_drop_unused(g, element);
  if (!element_check(g, element, NULL, &wrong) || !element_load_model(e->scene, g, element, NULL, &wrong) ||
      (g == &group_track && !bind_track(e, element, &wrong)))
    return err_set(e->err, wrong.kind, "%.200s: %s", e->path, wrong.text);
  if (g == &group_material && !mix_check(e->scene, element, (int32_t)e->target.index, NULL, NULL, &wrong))
    return err_set(e->err, wrong.kind, "%.200s: %s", e->path, wrong.text);
  return !g->nested || check_group(e, g->nested, group_nested(g, element));
}

static bool check_removal(const Edit *e)
{
  Text who = {0};
  const bool is_used = section_user(e->scene, e->target.section, e->target.index, &who);
  if (is_used)
    err_set(e->err, ERR_BAD_SCENE, "%.200s: this %s is still used by %.200s; change that first", e->path,
            e->target.group->noun, text_get(&who));
  text_finish(&who);
  return !is_used;
}

static bool make(Edit *e)
{
  const Target *t = &e->target;
  bool ok = false;
  switch (t->part) {
  case TARGET_SCENE:
  case TARGET_SECTION: return fail(e, "name one thing to set, such as materials.gold or objects[0]");
  case TARGET_WHOLE: ok = set_whole(e); break;
  case TARGET_KIND: ok = set_kind(e); break;
  case TARGET_NAME: ok = set_name(e); break;
  case TARGET_FIELD: ok = set_field(e); break;
  case TARGET_STROKE: ok = set_stroke(e); break;
  }
  if (!ok) return false;
  return e->action == ACTION_REMOVE ? check_removal(e) : check_group(e, t->section->group, e->element);
}

// --- putting it in place --------------------------------------------------------------------------
static void replace(Scene *s, const Section *c, size_t index, const void *element)
{
  void *at = section_at(s, c, index);
  const bool is_renamed =
      c->group->has_name && !text_equal(*group_name(c->group, at), *group_name(c->group, element));
  memcpy(at, element, c->group->size);
  if (is_renamed) section_names_changed(s, c);
}

static bool commit(Scene *s, const Section *c, size_t index, Action action, const void *element,
                   bool is_given)
{
  switch (action) {
  case ACTION_REPLACE:
    replace(s, c, index, element);
    if (section_given(s, c)) *section_given(s, c) = is_given;
    return true;
  case ACTION_INSERT: return section_insert(s, c, index, element);
  case ACTION_REMOVE: section_remove(s, c, index); return true;
  }
  unreachable();
}

static bool begin(Edit *e, const char *json)
{
  if (!target_find(e->scene, e->path, &e->target, e->err)) return false;
  e->doc = parse_value(e->path, json, e->err);
  if (!e->doc) return false;
  const Target *t = &e->target;
  if (!t->section) return fail(e, "name one thing to set, such as materials.gold or objects[0]");
  e->element = mem_zero(1, t->section->group->size);
  if (!e->element) return err_memory(e->err, e->path, t->section->group->size);
  if (!t->is_new && t->part != TARGET_SECTION)
    memcpy(e->element, section_at(e->scene, t->section, t->index), t->section->group->size);
  e->is_given = true;
  return make(e);
}

static void finish(Edit *e)
{
  js_free(e->doc);
  mem_free(e->element);
  target_finish(&e->target);
}

bool scene_set(Scene *s, const char *path, const char *json, Err *err)
{
  Edit e = {.scene = s, .path = path, .err = err};
  bool ok = begin(&e, json);
  if (ok && !commit(s, e.target.section, e.target.index, e.action, e.element, e.is_given))
    ok = err_memory(err, path, e.target.section->group->size);
  finish(&e);
  return ok;
}

// --- reading --------------------------------------------------------------------------------------
static void get_section(const Scene *s, const Section *c, Text *out)
{
  const bool is_list = c->form == SECTION_LIST;
  text_add(out, is_list ? "[" : "{");
  for (size_t i = 0; i < section_count(s, c); i++) {
    const void *element = section_at(s, c, i);
    if (i) text_add(out, ",");
    if (!is_list) {
      js_put_text(out, *group_name(c->group, element));
      text_add(out, ":");
    }
    element_write(s, c->group, element, is_list, INLINE_TRIANGLES, out, NULL);
  }
  text_add(out, is_list ? "]" : "}");
}

static void get_target(const Scene *s, const Target *t, Text *out)
{
  void *element = section_at(s, t->section, t->index);
  const bool is_list = t->section->form == SECTION_LIST && !t->is_nested;
  switch (t->part) {
  case TARGET_SCENE: return;
  case TARGET_SECTION: get_section(s, t->section, out); return;
  case TARGET_WHOLE:
    element_write(s, t->group, target_group(t, element), is_list, INLINE_TRIANGLES, out, NULL);
    return;
  case TARGET_KIND: js_put_text(out, group_kind(t->group, target_group(t, element))->name); return;
  case TARGET_NAME:
    if (*group_name(t->group, element))
      js_put_text(out, *group_name(t->group, element));
    else
      text_add(out, "null");
    return;
  case TARGET_FIELD: value_write(s, &t->field, target_field(t, element), out, NULL); return;
  case TARGET_STROKE: text_add(out, "null"); return; // what was done is not there any more
  }
}

bool scene_get(const Scene *s, const char *path, Text *out, Err *err)
{
  Target t;
  bool ok = target_find(s, path, &t, err);
  if (ok && t.is_new) ok = err_set(err, ERR_BAD_SCENE, "%.200s: there is no such %s", path, t.group->noun);
  if (ok && t.part == TARGET_SCENE)
    ok = scene_write(s, out, err);
  else if (ok)
    get_target(s, &t, out);
  if (ok && out->failed) ok = err_memory(err, path, out->length);
  target_finish(&t);
  return ok;
}

// --- snapshots ------------------------------------------------------------------------------------
// Calls of this visit every reference of an element. Nested groups (shapes) hold none.
static int32_t *reference_at(const Group *g, void *element, size_t *i, const Section **to)
{
  const Field *f;
  void *at;
  for (; (f = group_field_at(g, element, *i, &at)); ++*i) {
    *to = section_of_reference(f->type);
    if (!*to) continue;
    ++*i;
    return at;
  }
  return NULL;
}

static size_t count_references(const Group *g, void *element)
{
  const Section *to;
  size_t i = 0, count = 0;
  while (reference_at(g, element, &i, &to)) count++;
  return count;
}

static bool snapshot_take(const Scene *s, const Section *c, const void *element, bool is_given, Snapshot *out)
{
  *out = (Snapshot){.bytes = mem_alloc(1, c->group->size), .is_given = is_given};
  if (!out->bytes) return false;
  memcpy(out->bytes, element, c->group->size);
  const size_t count = count_references(c->group, out->bytes);
  if (!count) return true;
  out->names = mem_zero(count, sizeof *out->names);
  if (!out->names) return false;
  const Section *to;
  const int32_t *at;
  for (size_t i = 0, k = 0; (at = reference_at(c->group, out->bytes, &i, &to)); k++)
    if (*at >= 0) out->names[k] = *group_name(to->group, section_at(s, to, (size_t)*at));
  return true;
}

// Makes the snapshot's references those of the scene as it is now.
static bool snapshot_bind(const Scene *s, const Section *c, Snapshot *snapshot, Err *err)
{
  const Section *to;
  int32_t *at;
  for (size_t i = 0, k = 0; (at = reference_at(c->group, snapshot->bytes, &i, &to)); k++) {
    *at = snapshot->names[k] ? section_index(s, to, snapshot->names[k]) : -1;
    if (*at < 0 && snapshot->names[k])
      return err_set(err, ERR_BAD_SCENE, "the %s \"%.100s\" that this used is gone", to->group->noun,
                     snapshot->names[k]);
  }
  return true;
}

static void snapshot_finish(Snapshot *s)
{
  mem_free(s->bytes);
  mem_free(s->names);
}

// --- history --------------------------------------------------------------------------------------
static void change_finish(Change *c)
{
  mem_free(c->path);
  snapshot_finish(&c->before);
  snapshot_finish(&c->after);
  array_finish(&c->slots);
}

// Mesh slots of objects that were removed may name the material that goes now; an undo must give it back to them.
static bool note_slots(const Scene *s, Change *c)
{
  c->slots.count = 0;
  if (c->section->group != &group_material) return true;
  for (size_t i = 0; i < s->meshes.count; i++)
    for (size_t k = 0; k < s->meshes.items[i].slot_count; k++) {
      int32_t *slot = &s->meshes.items[i].slots[k];
      if (*slot == (int32_t)c->index && !array_push(&c->slots, slot)) return false;
    }
  return true;
}

static bool describe(const Edit *e, Change *c)
{
  const Section *section = e->target.section;
  const bool *given = section_given(e->scene, section);
  const size_t size = strlen(e->path) + 1;
  *c = (Change){.path = mem_alloc(size, 1), .section = section, .index = e->target.index};
  if (!c->path) return false;
  memcpy(c->path, e->path, size);
  if (e->action != ACTION_INSERT &&
      !snapshot_take(e->scene, section, section_at(e->scene, section, c->index), given && *given, &c->before))
    return false;
  if (e->action == ACTION_REMOVE) return note_slots(e->scene, c);
  return snapshot_take(e->scene, section, e->element, e->is_given, &c->after);
}

// Room for one more, and nothing left to redo.
static bool make_room(History *h)
{
  if (!array_reserve(&h->changes, h->done + 1)) return false;
  while (h->changes.count > h->done) change_finish(&h->changes.items[--h->changes.count]);
  if (h->changes.count < MOST_CHANGES) return true;
  change_finish(&h->changes.items[0]);
  memmove(h->changes.items, h->changes.items + 1, --h->changes.count * sizeof *h->changes.items);
  h->done--;
  return true;
}

// Grids that no object shows and no undo or redo would bring back are let go: a drag of the mouse makes hundreds.
static void forget_voxels(const History *h, Scene *s)
{
  bool *is_used = s->voxels.count ? mem_zero(s->voxels.count, sizeof *is_used) : NULL;
  if (!is_used) return;
  for (size_t i = 0; i < s->objects.count; i++)
    if (s->objects.items[i].shape.voxels_i >= 0) is_used[s->objects.items[i].shape.voxels_i] = true;
  for (size_t i = 0; i < h->changes.count; i++) {
    const Change *c = &h->changes.items[i];
    const Object *states[2] = {c->before.bytes, c->after.bytes};
    for (int k = 0; c->section->group == &group_object && k < 2; k++)
      if (states[k] && states[k]->shape.voxels_i >= 0) is_used[states[k]->shape.voxels_i] = true;
  }
  for (size_t i = 0; i < s->voxels.count; i++) {
    if (is_used[i]) continue;
    voxels_release(s->voxels.items[i].data);
    s->voxels.items[i].data = NULL;
  }
  mem_free(is_used);
}

bool history_set(History *h, Scene *s, const char *path, const char *json, Err *err)
{
  Edit e = {.scene = s, .path = path, .err = err};
  Change c = {0};
  bool ok = begin(&e, json);
  if (ok) {
    ok = describe(&e, &c) && make_room(h) &&
         commit(s, e.target.section, e.target.index, e.action, e.element, e.is_given);
    if (!ok) err_memory(err, path, e.target.section->group->size);
  }
  // An object gets its identity when it enters the scene; a redo must bring back the same.
  if (ok && e.action == ACTION_INSERT)
    memcpy(c.after.bytes, section_at(s, c.section, c.index), c.section->group->size);
  if (ok)
    h->changes.items[h->changes.count++] = c;
  else
    change_finish(&c);
  if (ok) h->done = h->changes.count;
  if (ok && e.target.part == TARGET_STROKE) forget_voxels(h, s);
  finish(&e);
  return ok;
}

// Makes the element what `want` says, given that it is now what `have` says.
static bool restore(Scene *s, Change *c, Snapshot *want, const Snapshot *have, Err *err)
{
  const size_t count = section_count(s, c->section);
  if (c->index + (have->bytes != NULL) > count)
    return err_set(err, ERR_BAD_SCENE, "%.200s: other edits have changed the scene since", c->path);
  Text who = {0};
  bool ok = true;
  if (!want->bytes && section_user(s, c->section, c->index, &who))
    ok = err_set(err, ERR_BAD_SCENE, "%.200s: it is still used by %.200s", c->path, text_get(&who));
  text_finish(&who);
  if (!ok || (want->bytes && !snapshot_bind(s, c->section, want, err))) return false;
  if (!want->bytes && !note_slots(s, c)) return err_memory(err, c->path, 0);
  const Action action = !want->bytes ? ACTION_REMOVE : have->bytes ? ACTION_REPLACE : ACTION_INSERT;
  if (!commit(s, c->section, c->index, action, want->bytes, want->is_given))
    return err_memory(err, c->path, c->section->group->size);
  if (action == ACTION_INSERT)
    for (size_t i = 0; i < c->slots.count; i++) *c->slots.items[i] = (int32_t)c->index;
  return true;
}

bool history_undo(History *h, Scene *s, Err *err)
{
  if (!h->done) return err_set(err, ERR_BAD_ARGUMENT, "there is nothing to undo");
  Change *c = &h->changes.items[h->done - 1];
  if (!restore(s, c, &c->before, &c->after, err)) return false;
  h->done--;
  return true;
}

bool history_redo(History *h, Scene *s, Err *err)
{
  if (h->done == h->changes.count) return err_set(err, ERR_BAD_ARGUMENT, "there is nothing to redo");
  Change *c = &h->changes.items[h->done];
  if (!restore(s, c, &c->after, &c->before, err)) return false;
  h->done++;
  return true;
}

void history_finish(History *h)
{
  for (size_t i = 0; i < h->changes.count; i++) change_finish(&h->changes.items[i]);
  array_finish(&h->changes);
  h->done = 0;
}
