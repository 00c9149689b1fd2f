// JSON as the scene room sees it: a strict reader with places for messages, over the one JSON library. Duplicate
// keys, trailing text, NaN and nesting deeper than the library's limit (2048) are errors with line and column.

#ifndef RAYFOLD_SCENE_JSON_H
#define RAYFOLD_SCENE_JSON_H

#include "base/err.h"
#include "base/text.h"

#include <stdbool.h>
#include <stddef.h>

typedef struct json_t Json; // a value; lives as long as its document
typedef struct JsonDoc JsonDoc;

typedef enum JsonKind { JSON_NONE, JSON_NULL_, JSON_BOOL, JSON_NUMBER, JSON_TEXT, JSON_LIST, JSON_DICT } JsonKind;

// Parses text (not necessarily terminated, copied). name is used in messages ("castle.json"). NULL on error.
JsonDoc *js_parse(const char *text, size_t size, const char *name, Err *err);
void js_free(JsonDoc *doc); // accepts NULL
const Json *js_root(const JsonDoc *doc);

// Every question accepts NULL and a value of the wrong kind: the answer is then NONE, NULL, 0 or the fallback.
JsonKind js_kind(const Json *v);
const char *js_kind_name(const Json *v); // "a number", "a list", ... for messages
double js_number(const Json *v, double fallback);
bool js_bool(const Json *v, bool fallback);
const char *js_text(const Json *v);              // NULL if not a text; a text holding a zero byte is none, too
size_t js_count(const Json *list_or_dict);
const Json *js_at(const Json *list, size_t i);
const Json *js_get(const Json *dict, const char *key);

// Members of a dictionary in file order:  for (JsonMember m = js_first(d); m.key; m = js_next(d, m))
typedef struct JsonMember {
  const char *key; // NULL at the end
  const Json *value;
  void *iterator;
} JsonMember;
JsonMember js_first(const Json *dict);
JsonMember js_next(const Json *dict, JsonMember m);

// Reports an error at a member of a dictionary (key) or list (key NULL, index): "file:line:column: message", the
// line and a caret. at_key points at the key instead of its value. container NULL: the whole file. Returns false.
bool js_fail(const JsonDoc *doc, const Json *container, const char *key, size_t index, bool at_key, Err *err,
             const char *format, ...) __attribute__((format(printf, 7, 8)));

// Writing: a text in quotes with escapes, and the shortest number that reads back as the same float.
void js_put_text(Text *out, const char *text);
void js_put_number(Text *out, double x);
void js_put_value(Text *out, const Json *v); // compact

// Lays out compact JSON for people: two spaces a level, what fits in 100 columns on one line. The root dictionary is
// always opened. compact must be valid, without blanks between its parts (what the functions above make).
void js_layout(Text *out, const char *compact);

#endif
