// See table.h.

#include "base/table.h"

#include "base/hash.h"
#include "base/mem.h"

// Keys may be pointers or small numbers, so they are mixed before their low bits are taken.
static TableEntry *place(const Table *t, uint64_t key, size_t step)
{
  return &t->entries[(hash_u64(key) + step) & (t->capacity - 1)];
}

static void put(Table *t, TableEntry e)
{
  size_t step = 0;
  while (place(t, e.key, step)->value >= 0) step++;
  *place(t, e.key, step) = e;
}

static bool grow(Table *t)
{
  const Table old = *t;
  t->capacity = old.capacity ? 2 * old.capacity : 32;
  t->entries = mem_alloc(t->capacity, sizeof *t->entries);
  if (!t->entries) {
    *t = old;
    return false;
  }
  table_clear(t);
  for (size_t i = 0; i < old.capacity; i++)
    if (old.entries[i].value >= 0) put(t, old.entries[i]);
  t->count = old.count;
  mem_free(old.entries);
  return true;
}

bool table_add(Table *t, uint64_t key, int32_t value)
{
  if (2 * (t->count + 1) > t->capacity && !grow(t)) return false;
  put(t, (TableEntry){key, value});
  t->count++;
  return true;
}

int32_t *table_next(const Table *t, uint64_t key, size_t *step)
{
  if (!t->capacity) return NULL;
  for (TableEntry *e; (e = place(t, key, (*step)++))->value >= 0;)
    if (e->key == key) return &e->value;
  return NULL;
}

void table_clear(Table *t)
{
  if (t->capacity) memset(t->entries, 0xff, t->capacity * sizeof *t->entries);
  t->count = 0;
}

void table_finish(Table *t)
{
  mem_free(t->entries);
  *t = (Table){0};
}
