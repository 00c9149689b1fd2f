#include "halves.h"

#include <stdlib.h>

Item *items_of(const LadderMesh *m)
{
  Item *items = malloc(m->triangle_count * sizeof *items);
  for (uint32_t i = 0; items && i < m->triangle_count; i++) items[i] = (Item){mesh_box(m, i), i};
  return items;
}

Box items_box(const Item *items, uint32_t count)
{
  Box b = box_empty();
  for (uint32_t i = 0; i < count; i++) box_add(&b, &items[i].box);
  return b;
}

static int longest_side(const Box *b)
{
  const float x = b->hi[0] - b->lo[0], y = b->hi[1] - b->lo[1], z = b->hi[2] - b->lo[2];
  return x >= y && x >= z ? 0 : y >= z ? 1 : 2;
}

static float middle(const Item *i, int axis)
{
  return i->box.lo[axis] + i->box.hi[axis];
}

static float median_of_three(float a, float b, float c)
{
  return most(least(a, b), least(most(a, b), c));
}

// Hoare's selection (1961): parts around a pivot and goes on with the side that holds the wanted place. Items equal
// to the pivot change sides, so that many equal ones are cut in half and not peeled off one by one.
void items_halve(Item *items, uint32_t count, uint32_t left)
{
  const Box box = items_box(items, count);
  const int axis = longest_side(&box);
  int64_t first = 0, last = (int64_t)count - 1;
  while (first < last) {
    const float pivot = median_of_three(middle(&items[first], axis), middle(&items[(first + last) / 2], axis),
                                        middle(&items[last], axis));
    int64_t i = first, k = last;
    while (i <= k) {
      while (middle(&items[i], axis) < pivot) i++;
      while (middle(&items[k], axis) > pivot) k--;
      if (i > k) break;
      const Item other = items[i];
      items[i++] = items[k];
      items[k--] = other;
    }
    if ((int64_t)left <= k)
      last = k;
    else if ((int64_t)left >= i)
      first = i;
    else
      return;
  }
}
