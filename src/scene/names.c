// See names.h.

#include "scene/names.h"

#include "base/hash.h"

#include <string.h>

static bool is_name(const char *stored, const char *name, size_t length)
{
  return !strncmp(stored, name, length) && !stored[length];
}

// Where the name is in the table, or the free place where it belongs.
static size_t find_place(const Names *n, const char *name, size_t length)
{
  const size_t mask = n->table.count - 1;
  size_t at = hash_bytes(0, name, length) & mask;
  while (n->table.items[at] >= 0 && !is_name(n->list.items[n->table.items[at]], name, length))
    at = (at + 1) & mask;
  return at;
}

int32_t names_find(const Names *n, const char *name, size_t length)
{
  // A zero byte ends a name, so that what is found is what was stored.
  return n->table.count ? n->table.items[find_place(n, name, strnlen(name, length))] : -1;
}

static bool grow_table(Names *n)
{
  const size_t wanted = n->table.count ? 2 * n->table.count : 64;
  if (!array_reserve(&n->table, wanted)) return false;
  n->table.count = wanted;
  memset(n->table.items, 0xff, wanted * sizeof *n->table.items);
  for (size_t i = 0; i < n->list.count; i++) {
    const char *name = n->list.items[i];
    n->table.items[find_place(n, name, strlen(name))] = (int32_t)i;
  }
  return true;
}

int32_t names_add(Names *n, Arena *a, const char *name, size_t length)
{
  length = strnlen(name, length);
  const int32_t found = names_find(n, name, length);
  if (found >= 0) return found;
  if (2 * (n->list.count + 1) > n->table.count && !grow_table(n)) return -1;
  const char *copy = arena_text_n(a, name, length);
  if (!copy || n->list.count >= INT32_MAX || !array_push(&n->list, copy)) return -1;
  const int32_t i = (int32_t)n->list.count - 1;
  n->table.items[find_place(n, copy, length)] = i;
  return i;
}

void names_finish(Names *n)
{
  array_finish(&n->list);
  array_finish(&n->table);
}
