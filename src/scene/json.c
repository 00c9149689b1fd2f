// See json.h. The library keeps no places, so a place is found again when a message needs it: the source text and
// the parsed tree are walked together (the library keeps members in file order) until the wanted container comes up.
// The text is known to be valid JSON by then, which makes the walk simple.

#include "scene/json.h"

#include "base/mem.h"
#include "base/number.h"

#include <ctype.h>
#include <jansson.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

struct JsonDoc {
  json_t *root;
  char *text; // owned copy, terminated
  size_t size;
  char *name;
};

// --- places ---------------------------------------------------------------------------------------
static const char *skip_space(const char *p)
{
  while (*p == ' ' || *p == '\t' || *p == '\n' || *p == '\r') p++;
  return p;
}

// One character on, but never past the end: should the text and the library's reading of it differ somewhere, a
// message shows the wrong place, and nothing worse.
static const char *step(const char *p) { return *p ? p + 1 : p; }

static const char *skip_text(const char *p)
{
  if (!*p) return p;
  for (p++; *p && *p != '"'; p++)
    if (*p == '\\' && p[1]) p++;
  return *p ? p + 1 : p;
}

// Past one value, without recursion.
static const char *skip_value(const char *p)
{
  int depth = 0;
  do {
    p = skip_space(p);
    if (*p == '"') {
      p = skip_text(p);
    } else if (*p == '{' || *p == '[') {
      depth++;
      p++;
    } else if (*p == '}' || *p == ']') {
      depth--;
      p++;
    } else if (*p == ',' || *p == ':') {
      p++;
    } else {
      while (*p && !strchr(" \t\r\n,:{}[]\"", *p)) p++;
    }
  } while (depth > 0 && *p);
  return p;
}

typedef struct Place {
  const json_t *container; // wanted
  const char *key;
  size_t index;
  bool at_key;
  const char *found;
} Place;

// The library refuses nesting past 2048, so this recursion is bounded.
static const char *find_place(const char *p, const json_t *v, Place *place);

static const char *find_in_dict(const char *p, const json_t *v, Place *place)
{
  const char *key;
  json_t *member;
  p = skip_space(step(p));
  json_object_foreach((json_t *)(size_t)v, key, member) {
    const char *key_at = p;
    const char *value_at = skip_space(step(skip_space(skip_text(p))));
    if (place->container == v && place->key && !strcmp(place->key, key)) {
      place->found = place->at_key ? key_at : value_at;
      return NULL;
    }
    p = find_place(value_at, member, place);
    if (!p) return NULL;
    p = skip_space(p);
    if (*p == ',') p = skip_space(p + 1);
  }
  return step(p);
}

static const char *find_in_list(const char *p, const json_t *v, Place *place)
{
  p = skip_space(step(p));
  for (size_t i = 0; i < json_array_size(v); i++) {
    if (place->container == v && !place->key && place->index == i) {
      place->found = p;
      return NULL;
    }
    p = find_place(p, json_array_get(v, i), place);
    if (!p) return NULL;
    p = skip_space(p);
    if (*p == ',') p = skip_space(p + 1);
  }
  return step(p);
}

static const char *find_place(const char *p, const json_t *v, Place *place)
{
  if (json_is_object(v)) return find_in_dict(p, v, place);
  if (json_is_array(v)) return find_in_list(p, v, place);
  return skip_value(p);
}

// "name:line:column: message", the line, and a caret under the column.
static bool fail_at(const char *text, size_t size, const char *name, const char *at, Err *err, const char *message)
{
  const char *start = at, *end = at, *last = text + size;
  while (start > text && start[-1] != '\n') start--;
  while (end < last && *end != '\n' && *end != '\r') end++;
  int line = 1;
  for (const char *p = text; p < start; p++) line += *p == '\n';
  enum { WIDEST = 140 };
  const char *from = at - start > WIDEST / 2 ? at - WIDEST / 2 : start;
  int width = end - from > WIDEST ? WIDEST : (int)(end - from);
  char shown[WIDEST + 1];
  for (int i = 0; i < width; i++) shown[i] = iscntrl((unsigned char)from[i]) ? ' ' : from[i];
  shown[width] = 0;
  return err_set(err, ERR_BAD_SCENE, "%s:%d:%d: %s\n    %s\n    %*s^", name, line, (int)(at - start) + 1, message,
                 shown, (int)(at - from), "");
}

bool js_fail(const JsonDoc *doc, const Json *container, const char *key, size_t index, bool at_key, Err *err,
             const char *format, ...)
{
  char message[1000];
  va_list args;
  va_start(args, format);
  vsnprintf(message, sizeof message, format, args);
  va_end(args);
  Place place = {container, key, index, at_key, NULL};
  const char *start = skip_space(doc->text);
  if (container) find_place(start, doc->root, &place);
  return fail_at(doc->text, doc->size, doc->name, place.found ? place.found : start, err, message);
}

// --- reading --------------------------------------------------------------------------------------
static bool parse_fail(const JsonDoc *doc, const json_error_t *e, Err *err)
{
  const char *at = doc->text;
  for (int line = 1; line < e->line; line++) {
    const char *next = memchr(at, '\n', doc->size - (size_t)(at - doc->text));
    if (!next) break;
    at = next + 1;
  }
  const char *end = doc->text + doc->size;
  for (int column = 1; column < e->column && at < end && *at != '\n'; column++) at++;
  char message[400];
  snprintf(message, sizeof message, "this is not valid JSON: %s", e->text);
  return fail_at(doc->text, doc->size, doc->name, at, err, message);
}

JsonDoc *js_parse(const char *text, size_t size, const char *name, Err *err)
{
  JsonDoc *doc = mem_zero(1, sizeof *doc);
  const size_t name_size = strlen(name) + 1;
  if (doc) {
    doc->text = mem_alloc(size + 1, 1);
    doc->name = mem_alloc(name_size, 1);
  }
  if (!doc || !doc->text || !doc->name) {
    err_memory(err, name, size);
    js_free(doc);
    return NULL;
  }
  memcpy(doc->text, text, size);
  doc->text[size] = 0;
  doc->size = size;
  memcpy(doc->name, name, name_size);
  // The library takes a zero byte after a number for a blank; everything here, for the end.
  const char *zero = memchr(doc->text, 0, size);
  if (zero) {
    fail_at(doc->text, size, name, zero, err, "this is not valid JSON: there is a zero byte in it");
    js_free(doc);
    return NULL;
  }
  json_error_t error = {0};
  doc->root = json_loadb(doc->text, size, JSON_REJECT_DUPLICATES | JSON_DECODE_ANY, &error);
  if (doc->root) return doc;
  if (json_error_code(&error) == json_error_out_of_memory) err_memory(err, name, size);
  parse_fail(doc, &error, err);
  js_free(doc);
  return NULL;
}

void js_free(JsonDoc *doc)
{
  if (!doc) return;
  json_decref(doc->root);
  mem_free(doc->text);
  mem_free(doc->name);
  mem_free(doc);
}

const Json *js_root(const JsonDoc *doc) { return doc->root; }

JsonKind js_kind(const Json *v)
{
  if (!v) return JSON_NONE;
  switch (json_typeof(v)) {
  case JSON_OBJECT: return JSON_DICT;
  case JSON_ARRAY: return JSON_LIST;
  case JSON_STRING: return JSON_TEXT;
  case JSON_INTEGER:
  case JSON_REAL: return JSON_NUMBER;
  case JSON_TRUE:
  case JSON_FALSE: return JSON_BOOL;
  case JSON_NULL: return JSON_NULL_;
  }
  return JSON_NONE;
}

const char *js_kind_name(const Json *v)
{
  static const char *const names[] = {"nothing", "null", "true or false", "a number", "a text", "a list", "a dictionary"};
  return names[js_kind(v)];
}

double js_number(const Json *v, double fallback) { return json_is_number(v) ? json_number_value(v) : fallback; }
bool js_bool(const Json *v, bool fallback) { return json_is_boolean(v) ? json_boolean_value(v) : fallback; }

const char *js_text(const Json *v)
{
  const char *s = json_string_value(v);
  return s && strlen(s) == json_string_length(v) ? s : NULL;
}

size_t js_count(const Json *v) { return json_is_array(v) ? json_array_size(v) : json_object_size(v); }
const Json *js_at(const Json *list, size_t i) { return json_array_get(list, i); }
const Json *js_get(const Json *dict, const char *key) { return json_object_get(dict, key); }

static JsonMember member(const Json *dict, void *iterator)
{
  if (!iterator) return (JsonMember){0};
  (void)dict;
  return (JsonMember){json_object_iter_key(iterator), json_object_iter_value(iterator), iterator};
}

JsonMember js_first(const Json *dict) { return member(dict, json_object_iter((json_t *)(size_t)dict)); }

JsonMember js_next(const Json *dict, JsonMember m)
{
  return member(dict, json_object_iter_next((json_t *)(size_t)dict, m.iterator));
}

// --- writing --------------------------------------------------------------------------------------
// The length of the UTF-8 sequence at p, 0 if it is none (RFC 3629: no overlong forms, no surrogates).
static int utf8_length(const unsigned char *p)
{
  const int n = *p < 0x80 ? 1 : *p < 0xc2 ? 0 : *p < 0xe0 ? 2 : *p < 0xf0 ? 3 : *p < 0xf5 ? 4 : 0;
  for (int i = 1; i < n; i++)
    if ((p[i] & 0xc0) != 0x80) return 0; // also stops at the end of the text
  if ((*p == 0xe0 && p[1] < 0xa0) || (*p == 0xed && p[1] > 0x9f)) return 0;
  if ((*p == 0xf0 && p[1] < 0x90) || (*p == 0xf4 && p[1] > 0x8f)) return 0;
  return n;
}

// Names from old model files may be in Latin-1; JSON must be UTF-8, so a stray byte becomes that character.
void js_put_text(Text *out, const char *text)
{
  text_add(out, "\"");
  for (const unsigned char *p = (const unsigned char *)text; *p;) {
    const int n = utf8_length(p);
    if (*p == '"' || *p == '\\') text_add(out, "\\%c", *p);
    else if (*p == '\n') text_add(out, "\\n");
    else if (*p < 0x20 || *p == 0x7f || !n) text_add(out, "\\u%04x", *p);
    else text_add_n(out, (const char *)p, (size_t)n);
    p += n ? n : 1;
  }
  text_add(out, "\"");
}

void js_put_number(Text *out, double x)
{
  char digits[NUMBER_SIZE];
  text_add_n(out, digits, number_format(digits, (float)x));
}

void js_put_value(Text *out, const Json *v)
{
  char *dump = json_dumps(v, JSON_COMPACT | JSON_ENCODE_ANY | JSON_REAL_PRECISION(9));
  if (dump) text_add(out, "%s", dump);
  else out->failed = true;
  free(dump);
}
