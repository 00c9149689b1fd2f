// See arena.h.

#include "base/arena.h"

#include "base/mem.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

enum { ARENA_ALIGN = 64, BLOCK_SIZE = 64 << 10 };

struct ArenaBlock {
  ArenaBlock *previous;
  size_t used, size; // bytes after the header
  char pad[ARENA_ALIGN - sizeof(ArenaBlock *) - 2 * sizeof(size_t)];
};
_Static_assert(sizeof(ArenaBlock) == ARENA_ALIGN, "the header must not break the alignment");

static ArenaBlock *add_block(Arena *a, size_t size)
{
  const size_t room = size > BLOCK_SIZE ? size : BLOCK_SIZE;
  ArenaBlock *b = mem_alloc(1, sizeof *b + room);
  if (!b) return NULL;
  b->previous = a->last;
  b->used = 0;
  b->size = room;
  a->last = b;
  a->total_size += sizeof *b + room;
  return b;
}

void *arena_alloc(Arena *a, size_t count, size_t size)
{
  size_t bytes;
  if (!size_mul(count, size, &bytes) || !size_add(bytes, ARENA_ALIGN - 1, &bytes)) goto dry;
  bytes &= ~(size_t)(ARENA_ALIGN - 1);
  ArenaBlock *b = a->last;
  if (!b || b->size - b->used < bytes) b = add_block(a, bytes);
  if (!b) goto dry;
  void *p = (char *)(b + 1) + b->used;
  b->used += bytes;
  return memset(p, 0, bytes);
dry:
  a->ran_dry = true;
  return NULL;
}

char *arena_text_n(Arena *a, const char *text, size_t length)
{
  char *copy = length < (size_t)-1 ? arena_alloc(a, length + 1, 1) : NULL;
  if (copy) memcpy(copy, text, length);
  return copy;
}

char *arena_text(Arena *a, const char *text) { return text ? arena_text_n(a, text, strlen(text)) : NULL; }

char *arena_format(Arena *a, const char *format, ...)
{
  va_list args, again;
  va_start(args, format);
  va_copy(again, args);
  const int n = vsnprintf(NULL, 0, format, args);
  va_end(args);
  char *text = n >= 0 ? arena_alloc(a, (size_t)n + 1, 1) : NULL;
  if (text) vsnprintf(text, (size_t)n + 1, format, again);
  va_end(again);
  return text;
}

void arena_finish(Arena *a)
{
  for (ArenaBlock *b = a->last; b;) {
    ArenaBlock *previous = b->previous;
    mem_free(b);
    b = previous;
  }
  *a = (Arena){0};
}
