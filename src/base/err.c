// See err.h.

#include "base/err.h"

#include "base/text.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

bool err_set(Err *err, ErrKind kind, const char *format, ...)
{
  if (!err || err->kind != ERR_NONE) return false;
  err->kind = kind;
  va_list args;
  va_start(args, format);
  vsnprintf(err->text, sizeof err->text, format, args);
  va_end(args);
  text_disarm(err->text);
  return false;
}

bool err_where(Err *err, const char *format, ...)
{
  if (!err || err->kind == ERR_NONE) return false;
  char where[sizeof err->text];
  va_list args;
  va_start(args, format);
  vsnprintf(where, sizeof where, format, args);
  va_end(args);
  text_disarm(where);
  size_t n = strlen(where);
  if (n + 2 >= sizeof err->text) return false;
  char joined[sizeof err->text];
  memcpy(joined, where, n);
  memcpy(joined + n, ": ", 2);
  n += 2;
  const size_t rest = strnlen(err->text, sizeof err->text - n - 1);
  memcpy(joined + n, err->text, rest);
  joined[n + rest] = 0;
  memcpy(err->text, joined, n + rest + 1);
  return false;
}

bool err_memory(Err *err, const char *what, unsigned long long bytes)
{
  return err_set(err, ERR_NO_MEMORY, "not enough memory for %s (%.1f MB); close other programs or use less of it",
                 what, (double)bytes / 1e6);
}
