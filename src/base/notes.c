// See notes.h.

#include "base/notes.h"

#include "base/text.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

enum { MOST_NOTES = 200 };

void note_once(Notes *notes, const char *format, ...)
{
  if (!notes || notes->lines.count >= MOST_NOTES) return;
  char line[600];
  va_list args;
  va_start(args, format);
  vsnprintf(line, sizeof line, format, args);
  va_end(args);
  text_disarm(line);
  for (size_t i = 0; i < notes->lines.count; i++)
    if (!strcmp(notes->lines.items[i], line)) return;
  const size_t size = strlen(line) + 1;
  char *copy = mem_alloc(size, 1);
  if (!copy) return; // a lost note must not fail a load
  memcpy(copy, line, size);
  if (!array_push(&notes->lines, copy)) mem_free(copy);
}

void notes_finish(Notes *notes)
{
  for (size_t i = 0; i < notes->lines.count; i++) mem_free(notes->lines.items[i]);
  array_finish(&notes->lines);
}
