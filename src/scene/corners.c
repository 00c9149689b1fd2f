// See corners.h.

#include "scene/corners.h"

#include <string.h>

bool corners_grow(Corners *c, size_t count)
{
  if (count <= c->heads.count) return true;
  if (!array_reserve(&c->heads, count)) return false;
  memset(c->heads.items + c->heads.count, 0xff, (count - c->heads.count) * sizeof *c->heads.items);
  c->heads.count = count;
  return true;
}

void corners_finish(Corners *c)
{
  array_finish(&c->vertices);
  array_finish(&c->heads);
}
