// See lines.h.

#include "scene/lines.h"

#include <stdarg.h>
#include <stdio.h>
#include <strings.h>

void lines_init(Lines *l, const char *name, const void *data, size_t size)
{
  const char *text = data;
  *l = (Lines){.next = text, .file_end = text + size, .name = name};
  if (size >= 3 && !memcmp(text, "\xef\xbb\xbf", 3)) l->next += 3; // a byte order mark
  l->line_end = size && memchr(text, '\n', size) ? '\n' : '\r';
}

void lines_finish(Lines *l)
{
  text_finish(&l->joined);
}

static void raw_line(Lines *l, const char **line, const char **end)
{
  *line = l->next;
  const char *stop = memchr(l->next, l->line_end, (size_t)(l->file_end - l->next));
  l->next = stop ? stop + 1 : l->file_end;
  l->lines_read++;
  *end = stop ? stop : l->file_end;
  if (*end > *line && (*end)[-1] == '\r') --*end;
}

static bool is_continued(const Lines *l, const char *line, const char *end)
{
  return l->joins_lines && end > line && end[-1] == '\\' && l->next < l->file_end;
}

bool lines_next(Lines *l, const char **line, const char **end)
{
  if (l->next == l->file_end) return false;
  raw_line(l, line, end);
  l->number = l->lines_read;
  if (!is_continued(l, *line, *end)) return true;
  text_clear(&l->joined);
  while (is_continued(l, *line, *end)) {
    text_add_n(&l->joined, *line, (size_t)(*end - *line - 1));
    text_add_n(&l->joined, " ", 1);
    raw_line(l, line, end);
  }
  text_add_n(&l->joined, *line, (size_t)(*end - *line));
  *line = text_get(&l->joined);
  *end = *line + l->joined.length;
  return true;
}

bool lines_fail(const Lines *l, Err *err, const char *format, ...)
{
  char text[1000];
  va_list args;
  va_start(args, format);
  vsnprintf(text, sizeof text, format, args);
  va_end(args);
  for (char *p = text; *p; p++)
    if ((unsigned char)*p < ' ') *p = '?'; // quoted bytes of a broken file must not reach a terminal
  return err_set(err, ERR_BAD_SCENE, "%s:%zu: %s", l->name, l->number, text);
}

bool word_is(const char *p, const char *end, const char *word)
{
  const size_t n = strlen(word);
  return (size_t)(end - p) == n && !strncasecmp(p, word, n);
}

int line_floats(const char **p, const char *end, float *out, int most)
{
  int n = 0;
  while (n < most) {
    const char *after = number_float(skip_blanks(*p, end), end, out + n);
    if (!after) break;
    *p = after;
    n++;
  }
  return n;
}
