// See target.h.

#include "scene/target.h"

#include "base/mem.h"
#include "base/number.h"

#include <stdio.h>
#include <string.h>

// --- steps of a path ------------------------------------------------------------------------------
typedef struct Step {
  bool is_index;
  size_t index;
  Text text;
} Step;

typedef struct PathReader {
  const char *path, *at;
  Err *err;
} PathReader;

static bool fail(const PathReader *r, const char *what)
{
  return err_set(r->err, ERR_BAD_SCENE, "%.200s: %s", r->path, what);
}

static bool read_index(PathReader *r, Step *step)
{
  int64_t i = -1;
  const char *end = number_int(r->at + 1, r->at + strlen(r->at), &i);
  if (!end || *end != ']' || i < 0) return fail(r, "an index is written [0], [1], ...");
  step->is_index = true;
  step->index = (size_t)i;
  r->at = end + 1;
  return true;
}

static bool read_quoted(PathReader *r, Step *step)
{
  const char *end = r->at + 1;
  while (*end && *end != '"') end += *end == '\\' && end[1] ? 2 : 1;
  if (!*end) return fail(r, "a closing quote is missing");
  JsonDoc *doc = js_parse(r->at, (size_t)(end + 1 - r->at), "path", NULL);
  const char *text = doc ? js_text(js_root(doc)) : NULL;
  if (text) text_add(&step->text, "%s", text);
  js_free(doc);
  if (!text) return fail(r, "a quoted name is written as in JSON");
  r->at = end + 1;
  return true;
}

// The next step, or *more = false at the end.
static bool read_step(PathReader *r, Step *step, bool *more)
{
  step->is_index = false;
  text_clear(&step->text);
  *more = *r->at != 0;
  if (!*more) return true;
  const bool is_first = r->at == r->path;
  if (*r->at == '[' && !is_first) return read_index(r, step);
  if (*r->at == '.' && !is_first)
    r->at++;
  else if (!is_first)
    return fail(r, "names are separated by dots");
  if (*r->at == '"') return read_quoted(r, step);
  const size_t n = strcspn(r->at, ".[\"");
  if (!n) return fail(r, "a name is missing between the dots");
  text_add_n(&step->text, r->at, n);
  r->at += n;
  return true;
}

// --- what a step names ----------------------------------------------------------------------------
typedef struct Candidates {
  const char **names;
  size_t count;
} Candidates;

static bool fail_name(const PathReader *r, const char *what, const char *name, Candidates c)
{
  char hint[120];
  return err_set(r->err, ERR_BAD_SCENE, "%.200s: %s \"%.100s\"%s", r->path, what, name,
                 text_hint(hint, name, c.names, c.count));
}

static bool find_section(const PathReader *r, const Step *step, Target *t)
{
  const char *names[SECTION_COUNT];
  for (int i = 0; i < SECTION_COUNT; i++) names[i] = scene_sections[i].group->name;
  t->section = section_find(text_get(&step->text));
  if (!t->section)
    return fail_name(r, "there is no section", text_get(&step->text), (Candidates){names, SECTION_COUNT});
  t->group = t->section->group;
  t->part = t->section->form == SECTION_ONE ? TARGET_WHOLE : TARGET_SECTION;
  return true;
}

static bool fail_element(const PathReader *r, const Scene *s, const Target *t, const Step *step)
{
  const size_t count = section_count(s, t->section);
  if (step->is_index)
    return err_set(r->err, ERR_BAD_SCENE, "%.200s: there are %zu %s, counted from 0", r->path, count,
                   t->section->group->name);
  const char **names = mem_alloc(count, sizeof *names);
  for (size_t i = 0; names && i < count; i++) names[i] = *group_name(t->group, section_at(s, t->section, i));
  char what[60] = "there is no ";
  strncat(what, t->group->noun, sizeof what - strlen(what) - 1);
  fail_name(r, what, text_get(&step->text), (Candidates){names, names ? count : 0});
  mem_free(names);
  return false;
}

// An element that is not there is a new one, if the path ends here and names it or the place behind the last.
static bool find_element(const PathReader *r, const Scene *s, const Step *step, Target *t)
{
  const size_t count = section_count(s, t->section);
  const int32_t found = step->is_index ? -1 : section_index(s, t->section, text_get(&step->text));
  t->part = TARGET_WHOLE;
  t->index = step->is_index ? step->index : found >= 0 ? (size_t)found : count;
  if (t->index < count) return true;
  const bool may_be_new =
      !*r->at && t->index == count && (!step->is_index || t->section->form == SECTION_LIST);
  if (!may_be_new) return fail_element(r, s, t, step);
  if (!step->is_index && (!step->text.length || step->text.length > LONGEST_TEXT))
    return fail(r, "a name must have 1 to 4096 bytes");
  t->is_new = true;
  text_add(&t->name, "%s", text_get(&step->text));
  return true;
}

static bool fail_field(const PathReader *r, const Group *g, const void *object, const char *name)
{
  const char *names[96];
  Candidates c = {names, 0};
  const Field *f;
  for (size_t i = 0; c.count < 90 && (f = group_field_at(g, object, i, NULL)); i++)
    names[c.count++] = f->name;
  if (g->has_kind) names[c.count++] = "kind";
  if (g->has_name) names[c.count++] = "name";
  if (g->nested) names[c.count++] = g->nested->name;
  if (g->nested && group_find_field(g->nested, group_nested(g, object), name, NULL))
    return err_set(r->err, ERR_BAD_SCENE, "%.200s: \"%s\" is a field of the %s; write %s.%s", r->path, name,
                   g->nested->noun, g->nested->name, name);
  char what[100] = "there is no field";
  if (g->has_kind)
    snprintf(what, sizeof what, "a %s of kind \"%s\" has no field", g->noun, group_kind(g, object)->name);
  return fail_name(r, what, name, c);
}

static bool find_member(const PathReader *r, const Step *step, Target *t, const void *element)
{
  const char *name = text_get(&step->text);
  const void *object = t->is_nested ? group_nested(t->section->group, element) : element;
  if (step->is_index) return fail(r, "a field is named, not numbered");
  if (t->group->nested && !strcmp(name, t->group->nested->name)) {
    t->group = t->group->nested;
    t->is_nested = true;
    return true;
  }
  if (t->group->has_kind && !strcmp(name, "kind")) return t->part = TARGET_KIND, true;
  if (t->section->form != SECTION_ONE && t->group->has_name && !strcmp(name, "name"))
    return t->part = TARGET_NAME, true;
  if (t->group == &group_shape && ((const Shape *)object)->kind == SHAPE_VOXELS && !strcmp(name, "stroke"))
    return t->part = TARGET_STROKE, true;
  const Field *f = group_find_field(t->group, object, name, NULL);
  if (!f) return fail_field(r, t->group, object, name);
  t->part = TARGET_FIELD;
  t->field = *f;
  t->is_common = f >= t->group->common && f < t->group->common + t->group->common_count;
  return true;
}

// "1", "y" or "g": the second of several numbers.
static bool find_component(const PathReader *r, const Step *step, Target *t)
{
  const char *name = text_get(&step->text);
  size_t i = step->index;
  if (!step->is_index) {
    const char *letters = t->field.type == FIELD_color ? "rgb" : "xyz";
    const char *found = name[0] && !name[1] ? strchr(letters, name[0]) : NULL;
    i = found                                          ? (size_t)(found - letters)
        : name[0] >= '0' && name[0] <= '9' && !name[1] ? (size_t)(name[0] - '0')
                                                       : 99;
  }
  if (i < 3 && value_component(&t->field, (int)i, &t->field)) return true;
  return err_set(r->err, ERR_BAD_SCENE, "%.200s: %s has no component \"%.40s\"", r->path, t->field.name,
                 name);
}

static bool follow(PathReader *r, const Scene *s, Step *step, Target *t)
{
  bool more, has_component = false;
  if (!read_step(r, step, &more)) return false;
  if (step->text.failed) return err_memory(r->err, r->path, strlen(r->path));
  if (!more) return t->part = TARGET_SCENE, true;
  if (!find_section(r, step, t)) return false;
  for (;;) {
    if (!read_step(r, step, &more)) return false;
    if (step->text.failed) return err_memory(r->err, r->path, strlen(r->path));
    if (!more) return true;
    bool ok = false;
    switch (t->part) {
    case TARGET_SECTION: ok = find_element(r, s, step, t); break;
    case TARGET_WHOLE: ok = find_member(r, step, t, section_at(s, t->section, t->index)); break;
    case TARGET_FIELD:
      ok = has_component ? fail(r, "the path goes on after a number") : find_component(r, step, t);
      has_component = true;
      break;
    case TARGET_SCENE:
    case TARGET_KIND:
    case TARGET_STROKE:
    case TARGET_NAME: ok = fail(r, "the path goes on after a plain value"); break;
    }
    if (!ok) return false;
  }
}

bool target_find(const Scene *s, const char *path, Target *t, Err *err)
{
  *t = (Target){0};
  PathReader r = {path, path, err};
  Step step = {0};
  bool ok = follow(&r, s, &step, t);
  if (ok && t->name.failed) ok = err_memory(err, path, strlen(path));
  text_finish(&step.text);
  return ok;
}

void target_finish(Target *t)
{
  text_finish(&t->name);
}

void *target_group(const Target *t, void *element)
{
  return t->is_nested ? group_nested(t->section->group, element) : element;
}

void *target_field(const Target *t, void *element)
{
  return group_field(t->group, target_group(t, element), &t->field, t->is_common);
}
