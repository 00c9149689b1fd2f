// See text.h.

#include "base/text.h"

#include "base/mem.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

static bool reserve(Text *t, size_t more)
{
  size_t need;
  if (t->failed || !size_add(t->length, more, &need) || !size_add(need, 1, &need)) return !(t->failed = true);
  if (need <= t->capacity) return true;
  size_t room = t->capacity * 2 > need ? t->capacity * 2 : need;
  if (room < 256) room = 256;
  char *grown = mem_resize(t->data, t->length, room, 1);
  if (!grown) return !(t->failed = true);
  t->data = grown;
  t->capacity = room;
  t->data[t->length] = 0;
  return true;
}

void text_add_n(Text *t, const char *bytes, size_t n)
{
  if (!reserve(t, n)) return;
  memcpy(t->data + t->length, bytes, n);
  t->length += n;
  t->data[t->length] = 0;
}

void text_add(Text *t, const char *format, ...)
{
  va_list args, again;
  va_start(args, format);
  va_copy(again, args);
  const int n = vsnprintf(NULL, 0, format, args);
  va_end(args);
  if (n >= 0 && reserve(t, (size_t)n)) {
    vsnprintf(t->data + t->length, (size_t)n + 1, format, again);
    t->length += (size_t)n;
  }
  va_end(again);
}

void text_clear(Text *t)
{
  t->length = 0;
  t->failed = false;
  if (t->data) t->data[0] = 0;
}

void text_finish(Text *t)
{
  mem_free(t->data);
  *t = (Text){0};
}

const char *text_get(const Text *t) { return t->data ? t->data : ""; }

bool text_equal(const char *a, const char *b) { return a == b || (a && b && !strcmp(a, b)); }

bool text_ends(const char *s, const char *suffix)
{
  const size_t n = strlen(s), m = strlen(suffix);
  return n >= m && !strcasecmp(s + n - m, suffix);
}

// Levenshtein distance with adjacent swaps counted as one, cut off for long names.
static int edit_distance(const char *a, const char *b)
{
  enum { LONGEST = 63 };
  const int n = (int)strnlen(a, LONGEST + 1), m = (int)strnlen(b, LONGEST + 1);
  if (n > LONGEST || m > LONGEST) return LONGEST;
  int rows[3][LONGEST + 1];
  for (int j = 0; j <= m; j++) rows[0][j] = j;
  for (int i = 1; i <= n; i++) {
    int *now = rows[i % 3];
    const int *up = rows[(i + 2) % 3], *up2 = rows[(i + 1) % 3];
    now[0] = i;
    for (int j = 1; j <= m; j++) {
      int best = up[j - 1] + (a[i - 1] != b[j - 1]);
      if (up[j] + 1 < best) best = up[j] + 1;
      if (now[j - 1] + 1 < best) best = now[j - 1] + 1;
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] && up2[j - 2] + 1 < best)
        best = up2[j - 2] + 1;
      now[j] = best;
    }
  }
  return rows[n % 3][m];
}

const char *text_nearest(const char *name, const char *const *candidates, size_t count)
{
  const char *best = NULL;
  int best_distance = 1 + (int)strlen(name) / 3;
  for (size_t i = 0; i < count; i++) {
    if (!candidates[i]) continue;
    const int d = strcasecmp(name, candidates[i]) ? edit_distance(name, candidates[i]) : 0;
    if (d > best_distance || (best && d == best_distance)) continue;
    best = candidates[i];
    best_distance = d;
  }
  return best;
}

const char *text_hint(char out[120], const char *name, const char *const *candidates, size_t count)
{
  const char *near = text_nearest(name, candidates, count);
  out[0] = 0;
  if (near) snprintf(out, 120, "; did you mean \"%s\"?", near);
  return out;
}

void text_disarm(char *s)
{
  for (unsigned char *c = (unsigned char *)s; *c; c++) {
    const bool is_c1 = c[0] == 0xc2 && c[1] >= 0x80 && c[1] < 0xa0;
    if (is_c1) c[1] = '?';
    if (is_c1 || (*c < 0x20 && *c != '\n') || *c == 0x7f) *c = '?';
  }
}

const char *path_base(const char *path)
{
  const char *slash = strrchr(path, '/');
  return slash ? slash + 1 : path;
}

const char *path_extension(const char *path)
{
  const char *base = path_base(path), *dot = strrchr(base, '.');
  return dot && dot != base ? dot : "";
}
