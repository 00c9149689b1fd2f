// See names.h.

#include "scene/names.h"

#include "base/hash.h"

#include <string.h>

static bool is_name(const char *stored, const char *name, size_t length)
{
  return !strncmp(stored, name, length) && !stored[length];
}

static int32_t find(const Names *n, uint64_t key, const char *name, size_t length)
{
  size_t step = 0;
  for (const int32_t *i; (i = table_next(&n->table, key, &step));)
    if (is_name(n->list.items[*i], name, length)) return *i;
  return -1;
}

int32_t names_find(const Names *n, const char *name, size_t length)
{
  length = strnlen(name, length); // a zero byte ends a name, so that what is found is what was stored
  return find(n, hash_bytes(0, name, length), name, length);
}

int32_t names_add(Names *n, Arena *a, const char *name, size_t length)
{
  length = strnlen(name, length);
  const uint64_t key = hash_bytes(0, name, length);
  const int32_t found = find(n, key, name, length);
  if (found >= 0) return found;
  const char *copy = arena_text_n(a, name, length);
  const int32_t i = (int32_t)n->list.count;
  if (!copy || n->list.count >= INT32_MAX || !array_reserve(&n->list, n->list.count + 1) ||
      !table_add(&n->table, key, i))
    return -1;
  array_push(&n->list, copy);
  return i;
}

void names_finish(Names *n)
{
  array_finish(&n->list);
  table_finish(&n->table);
}
