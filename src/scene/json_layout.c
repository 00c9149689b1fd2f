// Lays out compact JSON for people (see json.h). It walks the text itself, not a tree: a container that fits in the
// rest of the line stays on it, long lists of numbers flow, everything else is opened up level by level.

#include "scene/json.h"

#include <stdint.h>
#include <string.h>

enum { WIDTH = 100 };

typedef struct Layout {
  Text *out;
  size_t line_start; // where in out the current line begins
  int depth;
} Layout;

static const char *past_text(const char *p)
{
  for (p++; *p && *p != '"'; p++)
    if (*p == '\\' && p[1]) p++;
  return *p ? p + 1 : p;
}

// The end of the container at p if it takes at most `room` columns on one line, else NULL.
static const char *fitting_end(const char *p, size_t room)
{
  int depth = 0;
  size_t used = 0;
  while (*p && used <= room) {
    const char *start = p;
    if (*p == '"') {
      p = past_text(p);
      used += (size_t)(p - start);
      continue;
    }
    if (*p == '{' || *p == '[') depth++;
    if (*p == '}' || *p == ']') depth--;
    used += *p == ',' || *p == ':' || *p == '{' || *p == '}' ? 2 : 1;
    p++;
    if (depth == 0) return used <= room ? p : NULL;
  }
  return NULL;
}

static void put(Layout *l, const char *bytes, size_t n)
{
  text_add_n(l->out, bytes, n);
}

static void new_line(Layout *l)
{
  put(l, "\n", 1);
  l->line_start = l->out->length;
  text_add(l->out, "%*s", 2 * l->depth, "");
}

// A blank after each comma and colon, and inside braces.
static void put_line(Layout *l, const char *p, const char *end)
{
  while (p < end) {
    const char *after = *p == '"' ? past_text(p) : p + 1;
    if (*p == '}' && p[-1] != '{') put(l, " ", 1);
    put(l, p, (size_t)(after - p));
    if (*p == ',' || *p == ':' || (*p == '{' && p[1] != '}')) put(l, " ", 1);
    p = after;
  }
}

// A list of numbers, filling each line.
static const char *put_numbers(Layout *l, const char *p)
{
  put(l, p++, 1);
  l->depth++;
  new_line(l);
  bool is_first = true;
  while (*p && *p != ']') {
    const size_t n = strcspn(p, ",]"), size = n + (p[n] == ',');
    if (!is_first && l->out->length - l->line_start + 1 + size > WIDTH)
      new_line(l);
    else if (!is_first)
      put(l, " ", 1);
    is_first = false;
    put(l, p, size);
    p += size;
  }
  l->depth--;
  new_line(l);
  put(l, "]", 1);
  return *p ? p + 1 : p;
}

// One step: a value that is not opened, or the opening bracket of one that is.
static const char *put_value(Layout *l, const char *p, bool is_root)
{
  const size_t column = l->out->length - l->line_start;
  if (*p != '{' && *p != '[') {
    const size_t n = *p == '"' ? (size_t)(past_text(p) - p) : strcspn(p, ",]}");
    put(l, p, n);
    return p + n;
  }
  const char *end = is_root || column >= WIDTH ? NULL : fitting_end(p, WIDTH - column);
  if (end) {
    put_line(l, p, end);
    return end;
  }
  if (*p == '[' && !strchr("{[\"]", p[1])) return put_numbers(l, p);
  put(l, p, 1);
  l->depth++;
  new_line(l);
  return p + 1;
}

void js_layout(Text *out, const char *p)
{
  Layout l = {out, out->length, 0};
  bool is_root = true;
  while (*p && !out->failed) {
    if (*p == ',') {
      put(&l, p++, 1);
      new_line(&l);
    } else if (*p == ':') {
      put(&l, ": ", 2);
      p++;
    } else if (*p == '}' || *p == ']') {
      l.depth--;
      new_line(&l);
      put(&l, p++, 1);
    } else {
      p = put_value(&l, p, is_root);
    }
    is_root = false;
  }
  put(&l, "\n", 1);
}
