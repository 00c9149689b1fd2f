// Pairs: two boxes side by side, and both against a ray in one row of vector instructions. The planes of the boxes
// across one axis are four lanes: lo lo hi hi.

#ifndef BENCH_LADDER_PAIRS_H
#define BENCH_LADDER_PAIRS_H

#include "basics.h"
#include "lanes.h"

typedef struct Planes { // 48 bytes
  float axis[3][4];     // lo of the left box, of the right, hi of the left, of the right
} Planes;

static inline void planes_set(Planes *p, int side, const Box *b)
{
  for (int k = 0; k < 3; k++) {
    p->axis[k][side] = b->lo[k];
    p->axis[k][2 + side] = b->hi[k];
  }
}

typedef struct PairHit {
  unsigned bits;     // of the boxes the ray meets
  float left, right; // where it enters them
} PairHit;

// The slab test of walk_box(), for both.
static inline PairHit planes_test(const Planes *p, const Walk *w)
{
  v4 in = v4_all(w->tmin), out = v4_all(w->best.t * SLACK);
  for (int k = 0; k < 3; k++) {
    const v4 t = (v4_load(p->axis[k]) - v4_all(w->o[k])) * v4_all(w->inv[k]);
    const v4 other = v4_halves_changed(t);
    in = v4_max(in, v4_min(t, other));
    out = v4_min(out, v4_max(t, other) * v4_all(SLACK));
  }
  return (PairHit){i4_bits(in <= out) & 3, in[0], in[1]};
}

#endif
