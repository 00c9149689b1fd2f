// CSG: bodies put together from closed solids by union, intersection and difference (Goldstein and Nagel, "3-D visual
// simulation", 1971; Roth, "Ray casting for modeling solids", 1982). A line crosses each solid's skin at a few places;
// walking along all of them in order, one bit a solid says whether the line is inside it, and the body's skin is where
// the expression of these bits changes its value. So there are no lists of intervals to merge, and what there is at
// most is known: MOST_LEAVES solids of MOST_CROSSINGS each.
//
// Leaves are placed in the world, each by maps of its own, so that a ray goes into a leaf's space in one step and a
// surface point comes out as that of any placed shape (geom/surface.h). Skins that lie in the same place are crossed
// together: of two boxes side by side no wall is left between them, and a cut flush with a face leaves no skin. That
// needs equal numbers, so it holds for shapes that are moved, not for skins that only meet after being turned.
//
// A hit's primitive is leaf * SOLID_PARTS + part. Does not know meshes or open shapes: world/ refuses them by name.

#ifndef RAYFOLD_GEOM_CSG_H
#define RAYFOLD_GEOM_CSG_H

#include "geom/solid.h"
#include "geom/tree_ray.h"

enum { MOST_LEAVES = 32, MOST_STEPS = 2 * MOST_LEAVES - 1, MOST_CSG_CROSSINGS = MOST_LEAVES * MOST_CROSSINGS };

// Steps of the expression in postfix form; the least values are leaves.
enum { STEP_UNION = MOST_LEAVES, STEP_INTERSECTION, STEP_DIFFERENCE };

typedef struct CsgLeaf {
  Frame world_from_leaf, leaf_from_world;
  Solid solid;
  float box[6];    // of the leaf in the world; infinite where it has no end
  bool is_flipped; // taken away, so that its outside is the body's inside
} CsgLeaf;

typedef struct Csg {
  const CsgLeaf *leaves;
  uint32_t leaf_count, step_count;
  uint8_t steps[MOST_STEPS];
  Bounds bounds; // of the body in the world
} Csg;

// The expression's value where the line is inside the solids whose bits are set. The stack is bits, too.
static inline bool csg_value(const Csg *c, uint32_t inside)
{
  uint64_t stack = 0;
  for (uint32_t i = 0; i < c->step_count; i++) {
    const uint64_t b = stack & 1, a = stack >> 1 & 1;
    switch (c->steps[i]) {
    case STEP_UNION: stack = (stack >> 2) << 1 | (a | b); break;
    case STEP_INTERSECTION: stack = (stack >> 2) << 1 | (a & b); break;
    case STEP_DIFFERENCE: stack = (stack >> 2) << 1 | (a & ~b & 1); break;
    default: stack = stack << 1 | (inside >> c->steps[i] & 1);
    }
  }
  return stack & 1;
}

static inline SolidRay csg_leaf_ray(const CsgLeaf *l, const float o[3], const float d[3])
{
  const Frame *m = &l->leaf_from_world;
  SolidRay r;
  for (int k = 0; k < 3; k++) {
    r.o[k] = (double)m->x[k] * o[0] + (double)m->y[k] * o[1] + (double)m->z[k] * o[2] + (double)m->p[k];
    r.d[k] = (double)m->x[k] * d[0] + (double)m->y[k] * d[1] + (double)m->z[k] * d[2];
  }
  return r;
}

typedef struct CsgCrossing {
  double t;
  uint32_t prim;
} CsgCrossing;

typedef struct CsgCrossings {
  CsgCrossing at[MOST_CSG_CROSSINGS];
  int count;
  uint32_t inside; // far behind the origin, a bit a leaf
} CsgCrossings;

// All crossings of all leaves that the ray may meet, in order; equal ones by primitive. A leaf whose box lies behind
// the ray or beside it is one the ray is never inside.
static inline void csg_collect(const Csg *c, const TreeRay *r, CsgCrossings *all)
{
  all->count = 0;
  all->inside = 0;
  for (uint32_t l = 0; l < c->leaf_count; l++) {
    const CsgLeaf *leaf = &c->leaves[l];
    if (tree_ray_box(r, leaf->box, INFINITY) == INFINITY) continue;
    const SolidRay own = csg_leaf_ray(leaf, r->o, r->d);
    const Crossings found = solid_cross(&leaf->solid, &own);
    all->inside |= (uint32_t)found.begins_inside << l;
    for (int i = 0; i < found.count; i++) {
      const CsgCrossing x = {found.at[i].t, l * SOLID_PARTS + found.at[i].part};
      int at = all->count++;
      for (; at > 0 && all->at[at - 1].t > x.t; at--) all->at[at] = all->at[at - 1];
      all->at[at] = x;
    }
  }
}

// Takes all crossings from `first` on that are at one place: to 40 bits, since the way there was another for each
// leaf. Returns the one whose skin is the body's here, if there is any: that which first turns the value.
static inline int csg_cross(const Csg *c, const CsgCrossings *all, int first, uint32_t *inside, bool *value, int *seen)
{
  const double end = all->at[first].t + 0x1p-40 * fabs(all->at[first].t);
  const bool before = *value;
  int i = first;
  *seen = first;
  for (bool now = before; i < all->count && all->at[i].t <= end; i++) {
    *inside ^= 1u << all->at[i].prim / SOLID_PARTS;
    const bool next = csg_value(c, *inside);
    if (now == before && next != before) *seen = i;
    now = next;
    *value = next;
  }
  return i;
}

// The first place from tmin on where the ray goes through the body's skin and `takes` agrees.
typedef bool CsgTake(void *user, double t, uint32_t prim);

static inline bool csg_first(const Csg *c, const TreeRay *r, CsgTake *takes, void *user)
{
  CsgCrossings all;
  csg_collect(c, r, &all);
  bool value = csg_value(c, all.inside);
  for (int i = 0, seen; i < all.count;) {
    const bool before = value;
    i = csg_cross(c, &all, i, &all.inside, &value, &seen);
    if (value != before && all.at[seen].t > (double)r->tmin && takes(user, all.at[seen].t, all.at[seen].prim)) return true;
  }
  return false;
}

#endif
