// Gates as they lead to each other: from what a scene says of its gates to a map for each of their sides. A gate's map
// is a similarity: it turns, moves, scales alike in all directions, and may mirror. Refuses what is none, and gates
// that lead nowhere, with a sentence that says which and why. Cold.

#ifndef RAYFOLD_SCENE_GATES_H
#define RAYFOLD_SCENE_GATES_H

#include "scene/scene.h"

enum { FRONT, BACK }; // of a gate: rays go in at the front against its normal (into a closed one), at the back along it

// Where a side leads.
typedef struct GateLink {
  bool exists;  // false: the side is not there, rays pass
  int32_t cell; // index into the scene's cells, -1: the unnamed one
  int32_t gate; // out of which one comes; -1: out of none
  int32_t side; // of that gate
  Frame map;    // from the coordinates of this gate's cell into that cell's
} GateLink;

// links: one pair, front and back, for each of the scene's gates. On failure *gate_i and *field (either may be NULL)
// tell what is at fault; *field may become NULL.
bool gates_link(const Scene *s, GateLink (*links)[2], int32_t *gate_i, const char **field, Err *err);

// The gate's own place: its middle and axes, z along the normal of a flat one.
Frame gate_frame(const Gate *g);
static inline bool gate_is_flat(const Gate *g) { return g->kind == GATE_RECT || g->kind == GATE_POLYGON; }

// What one gate by itself must be: of some size, an outline that does not cross itself.
bool gate_check(const Gate *g, const char **field, Err *err);

// What one cell by itself must be.
bool cell_check(const Cell *c, const char **field, Err *err);
static inline float cell_curvature(const Cell *c) // per square metre
{
  const float r = c->kind == CELL_SPHERICAL ? c->spherical.radius : c->hyperbolic.radius;
  return c->kind == CELL_FLAT ? 0 : c->kind == CELL_SPHERICAL ? 1 / (r * r) : -1 / (r * r);
}

// Every named cell has something in it. *cell_i as above.
bool cells_check(const Scene *s, int32_t *cell_i, Err *err);

#endif
