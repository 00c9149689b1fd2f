// Growable arrays as a macro over three members: ARRAY(Type) declares { items, count, capacity }, array_push()
// appends. Owned by the struct that holds it; array_finish() frees. Growth is by half again, so n pushes cost O(n).

#ifndef RAYFOLD_BASE_ARRAY_H
#define RAYFOLD_BASE_ARRAY_H

#include "base/mem.h"

#define ARRAY(Type)            \
  struct {                     \
    Type *items;               \
    size_t count, capacity;    \
  }

// Room for at least n items in all; false when memory is out (the array is unchanged).
#define array_reserve(a, n) \
  ((n) <= (a)->capacity || array_grow_to((void **)&(a)->items, (a)->count, &(a)->capacity, (n), sizeof *(a)->items))

// Appends a copy of the value; false when memory is out.
#define array_push(a, ...)                                                                                       \
  (array_reserve(a, (a)->count + 1) && ((a)->items[(a)->count++] = (__VA_ARGS__), true))

#define array_finish(a) (mem_free((a)->items), (a)->items = NULL, (a)->count = (a)->capacity = 0)

static inline bool array_grow_to(void **items, size_t count, size_t *capacity, size_t wanted, size_t size)
{
  size_t room = *capacity + *capacity / 2;
  if (room < wanted) room = wanted;
  if (room < 8) room = 8;
  void *grown = mem_resize(*items, count, room, size);
  if (!grown) return false;
  *items = grown;
  *capacity = room;
  return true;
}

#endif
