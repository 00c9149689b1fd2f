// See keys.h.

#include "scene/keys.h"

#include "scene/kinds.h"
#include "scene/value.h"

#include <string.h>

const KeyMember key_members[KEY_MEMBER_COUNT] = {
    {"time", "\"type\":\"number\",\"minimum\":-1000000,\"maximum\":1000000", "Seconds."},
    {"value", "", "The field's value then, in the form that the field has everywhere."},
    {"easing",
     "\"oneOf\":[{\"enum\":[\"step\",\"linear\",\"smooth\",\"cubic\",\"spline\"]},{\"type\":\"array\",\"minItems\":"
     "4,\"maxItems\":4,\"items\":{\"type\":\"number\"}}]",
     "From this key to the next, instead of the track's: a name; or [x1, y1, x2, y2], a timing curve as CSS has it; "
     "or spline, which follows the keys' `in` and `out`."},
    {"in", "", "For spline: the value's change a second just before the key; none: 0."},
    {"out", "", "For spline: the value's change a second just after the key; none: 0."},
};

enum { MOST_KEYS = 1 << 20 };

typedef struct KeyReader {
  Scene *scene;
  const char **member;
  Err *err;
} KeyReader;

static bool fail(const KeyReader *r, const char *member, const char *message)
{
  *r->member = member;
  return err_set(r->err, ERR_BAD_SCENE, "%s", message);
}

static bool check_members(const KeyReader *r, const Json *dict)
{
  const char *names[KEY_MEMBER_COUNT];
  for (int i = 0; i < KEY_MEMBER_COUNT; i++) names[i] = key_members[i].name;
  for (JsonMember m = js_first(dict); m.key; m = js_next(dict, m)) {
    bool is_known = false;
    for (int i = 0; i < KEY_MEMBER_COUNT; i++) is_known = is_known || !strcmp(m.key, names[i]);
    char hint[120];
    if (is_known) continue;
    *r->member = m.key;
    return err_set(r->err, ERR_BAD_SCENE, "\"%.60s\" is not a member of a key%s", m.key,
                   text_hint(hint, m.key, names, KEY_MEMBER_COUNT));
  }
  return true;
}

static bool read_bezier(const KeyReader *r, const Json *list, Key *out)
{
  bool ok = js_kind(list) == JSON_LIST && js_count(list) == 4;
  for (size_t i = 0; ok && i < 4; i++) {
    const double x = js_number(js_at(list, i), 1e9);
    ok = x >= (i % 2 ? -1e6 : 0) && x <= (i % 2 ? 1e6 : 1);
    out->bezier[i] = (float)x;
  }
  out->easing = KEY_BEZIER;
  return ok || fail(r, "easing",
                    "easing must be \"step\", \"linear\", \"smooth\", \"cubic\" or \"spline\", or four numbers "
                    "[x1, y1, x2, y2] with both x between 0 and 1");
}

static bool read_easing(const KeyReader *r, const Json *v, Key *out)
{
  const char *text = js_text(v);
  const Field *f = group_find_field(&group_track, NULL, "easing", NULL);
  char name[40];
  out->easing = KEY_AS_TRACK;
  if (!v) return true;
  if (text_equal(text, "spline")) return out->easing = KEY_SPLINE, true;
  for (int32_t i = 0; text && choice_name(f, i, name); i++)
    if (!strcmp(text, name)) return out->easing = i, true;
  return read_bezier(r, v, out);
}

static const char *keep_json(const KeyReader *r, const Json *v)
{
  Text text = {0};
  js_put_value(&text, v);
  const char *kept = text.failed ? NULL : arena_text(&r->scene->arena, text_get(&text));
  text_finish(&text);
  if (!kept) err_memory(r->err, "a key", 0);
  return kept;
}

static bool read_key(const KeyReader *r, const Json *dict, const Key *before, Key *out)
{
  if (js_kind(dict) != JSON_DICT) return fail(r, NULL, "a key is a dictionary { \"time\": ..., \"value\": ... }");
  if (!check_members(r, dict)) return false;
  if (!js_get(dict, "time") || !js_get(dict, "value")) return fail(r, NULL, "a key needs \"time\" and \"value\"");
  out->time = (float)js_number(js_get(dict, "time"), 1e9);
  if (!(out->time >= -1e6f && out->time <= 1e6f))
    return fail(r, "time", "time must be a number of seconds between -1e6 and 1e6");
  if (before && !(out->time > before->time)) return fail(r, "time", "keys must be in order, each later than the one before");
  if (!read_easing(r, js_get(dict, "easing"), out)) return false;
  const Json *in = js_get(dict, "in"), *after = js_get(dict, "out");
  return (out->value = keep_json(r, js_get(dict, "value"))) && (!in || (out->in = keep_json(r, in))) &&
         (!after || (out->out = keep_json(r, after)));
}

const Keys *keys_read(Scene *s, const Json *list, int *item, const char **member, Err *err)
{
  const KeyReader r = {s, member, err};
  const size_t count = js_count(list);
  *item = -1;
  *member = NULL;
  if (js_kind(list) != JSON_LIST || !count || count > MOST_KEYS) {
    fail(&r, NULL, "keys must be a list of 1 to 1048576 dictionaries { \"time\": ..., \"value\": ... }");
    return NULL;
  }
  Keys *keys = arena_alloc(&s->arena, 1, sizeof *keys + count * sizeof *keys->items);
  if (!keys) {
    err_memory(err, "keys", count * sizeof *keys->items);
    return NULL;
  }
  memset(keys, 0, sizeof *keys + count * sizeof *keys->items);
  keys->count = count;
  for (size_t i = 0; i < count; i++) {
    *item = (int)i;
    if (!read_key(&r, js_at(list, i), i ? &keys->items[i - 1] : NULL, &keys->items[i])) return NULL;
  }
  *item = -1;
  return keys;
}

// --- writing --------------------------------------------------------------------------------------
static void write_key(const Key *k, Text *out)
{
  text_add(out, "{\"time\":");
  js_put_number(out, (double)k->time);
  text_add(out, ",\"value\":%s", k->value);
  if (k->easing == KEY_SPLINE) text_add(out, ",\"easing\":\"spline\"");
  if (k->easing == KEY_BEZIER) {
    text_add(out, ",\"easing\":[");
    for (int i = 0; i < 4; i++) {
      if (i) text_add(out, ",");
      js_put_number(out, (double)k->bezier[i]);
    }
    text_add(out, "]");
  }
  char name[40];
  if (k->easing >= 0 && choice_name(group_find_field(&group_track, NULL, "easing", NULL), k->easing, name))
    text_add(out, ",\"easing\":\"%s\"", name);
  if (k->in) text_add(out, ",\"in\":%s", k->in);
  if (k->out) text_add(out, ",\"out\":%s", k->out);
  text_add(out, "}");
}

void keys_write(const Keys *k, Text *out)
{
  text_add(out, "[");
  for (size_t i = 0; i < k->count; i++) {
    if (i) text_add(out, ",");
    write_key(&k->items[i], out);
  }
  text_add(out, "]");
}
