// Newcomers: see refit.h. Triangles of no area are kept out of a tree when it is built, so one that gains an area has
// no lane. It goes down from the root to where boxes grow least (Goldsmith and Salmon 1987), and the small part where
// that ends is built anew with it.

#include "accel/refit.h"

#include <stdlib.h>
#include <string.h>

enum { LARGEST_PART = 64 }; // triangles of a part that is built anew for a newcomer

// When more than this share of the triangles come new, the whole is built.
#define MOST_NEWCOMERS_SHARE 0.125

static double growth(const NodeState *s, const Bounds *box)
{
  Bounds grown = s->box;
  bounds_add(&grown, box);
  return bounds_half_area(&grown) - s->area;
}

// The lane of the inner child that grows least; -1: there is none.
static int best_lane(const Refit *r, const Node8 *n, const Bounds *box)
{
  int best = -1;
  double least = 0;
  for (int lane = 0; lane < 8; lane++) {
    if (n->child[lane] & LEAF_BIT) continue;
    const double g = growth(&r->states[n->child[lane]], box);
    if (best >= 0 && !(g < least)) continue;
    best = lane;
    least = g;
  }
  return best;
}

static void grow(NodeState *s, const Bounds *box)
{
  bounds_add(&s->box, box);
  s->area = bounds_half_area(&s->box);
  s->has_worn = true;
}

// The worn part it goes to. Two never end one above the other: what stops the way stops it for all.
static uint32_t go_down(Refit *r, const Bounds *box)
{
  uint32_t node_i = r->tree->root;
  for (;;) {
    Node8 *n = &r->tree->nodes[node_i];
    NodeState *s = &r->states[node_i];
    grow(s, box);
    const int lane = s->is_worn || s->lanes <= LARGEST_PART ? -1 : best_lane(r, n, box);
    s->is_worn |= lane < 0;
    if (lane < 0) return node_i;
    node_i = n->child[lane];
    for (int k = 0; k < 3; k++) {
      n->box[2 * k][lane] = min_f(n->box[2 * k][lane], box->lo[k]);
      n->box[2 * k + 1][lane] = max_f(n->box[2 * k + 1][lane], box->hi[k]);
    }
  }
}

static bool add_newcomer(Refit *r, uint32_t prim)
{
  Vec3 v[3];
  if (!triangle_corners(&r->mesh, prim, v)) return true;
  const Bounds box = corners_bounds(v);
  bounds_add(&r->tree->bounds, &box);
  const Newcomer n = {r->states ? go_down(r, &box) : 0, prim, box};
  return array_push(&r->newcomers, n);
}

static int by_node(const void *a, const void *b)
{
  const Newcomer *x = a, *y = b;
  if (x->node != y->node) return x->node < y->node ? -1 : 1;
  return (x->prim > y->prim) - (x->prim < y->prim);
}

bool refit_insert(Refit *r, bool *is_hopeless, Err *err)
{
  const unsigned char *is_found = (const unsigned char *)r->is_found;
  const size_t count = r->mesh.triangle_count;
  const double most = r->states ? MOST_NEWCOMERS_SHARE * (double)count : 0;
  r->found_count = count;
  for (size_t i = 0; i < count; i++) {
    const unsigned char *lacking = memchr(is_found + i, 0, count - i);
    if (!lacking) break;
    i = (size_t)(lacking - is_found);
    r->found_count--;
    if (!add_newcomer(r, (uint32_t)i)) return err_memory(err, "refitting a tree", sizeof(Newcomer));
    *is_hopeless = (double)r->newcomers.count > most;
    if (*is_hopeless) return false;
  }
  if (r->newcomers.count) qsort(r->newcomers.items, r->newcomers.count, sizeof *r->newcomers.items, by_node);
  return true;
}
