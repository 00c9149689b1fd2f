// The cold side of the light tree: light_tree.c.

#ifndef RAYFOLD_SHADE_LIGHT_TREE_BUILD_H
#define RAYFOLD_SHADE_LIGHT_TREE_BUILD_H

#include "base/arena.h"
#include "base/err.h"
#include "base/jobs.h"
#include "shade/light.h"

// power: of each emitter; those without any are never aimed at. count at least 1. The result does not depend on
// anything but the arguments. Fails only when memory is out or it is cancelled.
bool light_tree_build(LightTree *t, Arena *arena, const Emitter *emitters, const double *power, size_t count,
                      const Cancel *cancel, Err *err);

#endif
