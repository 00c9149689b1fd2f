#include "wide.h"

static float area(const Box *b)
{
  const float x = b->hi[0] - b->lo[0], y = b->hi[1] - b->lo[1], z = b->hi[2] - b->lo[2];
  return x * y + y * z + z * x;
}

int wide_children(const SahTree *sah, uint32_t node, uint32_t children[8])
{
  int count = 2;
  children[0] = sah->nodes[node].first;
  children[1] = children[0] + 1;
  while (count < 8) {
    int largest = -1;
    for (int i = 0; i < count; i++) {
      const SahNode *n = &sah->nodes[children[i]];
      if (!n->count && (largest < 0 || area(&n->box) > area(&sah->nodes[children[largest]].box))) largest = i;
    }
    if (largest < 0) break; // leaves, all of them
    children[count++] = sah->nodes[children[largest]].first + 1;
    children[largest] = children[count - 1] - 1;
  }
  return count;
}

static uint32_t count_below(const SahTree *sah, uint32_t node)
{
  uint32_t children[8], sum = 1;
  if (sah->nodes[node].count) return 0;
  const int count = wide_children(sah, node, children);
  for (int i = 0; i < count; i++) sum += count_below(sah, children[i]);
  return sum;
}

uint32_t wide_count(const SahTree *sah)
{
  return count_below(sah, 0);
}
