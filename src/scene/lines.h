// Lines: a text file read line by line in place, and the words of a line. For formats made of "keyword values" lines
// (OBJ, MTL, STL). Line ends may be \n, \r\n or, in a file without any \n, \r. Nothing is copied but lines
// continued with a backslash.

#ifndef RAYFOLD_SCENE_LINES_H
#define RAYFOLD_SCENE_LINES_H

#include "base/err.h"
#include "base/number.h"
#include "base/text.h"

#include <string.h>

typedef struct Lines {
  const char *next, *file_end; // what has not been read
  const char *name;            // of the file, for messages
  size_t number;               // of the line at hand, from 1
  size_t lines_read;           // file lines so far; beyond number when the line at hand was continued
  char line_end;               // '\n' or '\r'
  bool joins_lines;            // a backslash at the end goes on in the next line
  Text joined;
} Lines;

void lines_init(Lines *l, const char *name, const void *data, size_t size);
void lines_finish(Lines *l);

// The next line, without its end, in *line and *end. False at the end of the file.
bool lines_next(Lines *l, const char **line, const char **end);

// Reports an error at the line at hand. Returns false.
bool lines_fail(const Lines *l, Err *err, const char *format, ...) __attribute__((format(printf, 3, 4)));

static inline bool is_blank(char c)
{
  return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f';
}

static inline const char *skip_blanks(const char *p, const char *end)
{
  while (p < end && is_blank(*p)) p++;
  return p;
}

static inline const char *skip_word(const char *p, const char *end)
{
  while (p < end && !is_blank(*p)) p++;
  return p;
}

static inline const char *trim_end(const char *p, const char *end)
{
  while (end > p && is_blank(end[-1])) end--;
  return end;
}

// Whether the word [p, end) is this one, in any case of its ASCII letters.
bool word_is(const char *p, const char *end, const char *word);

// Up to `most` numbers, each after blanks, up to the first thing that is none. Returns how many.
int line_floats(const char **p, const char *end, float *out, int most);

// A part of a line for a message: printed with "%.*s" and these two, long ones cut.
#define SHOWN(p, end) (int)((end) - (p) < 40 ? (end) - (p) : 40), (p)

#endif
