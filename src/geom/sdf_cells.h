// Sdf cells: a field with all it owns, and the tree of cells that says which steps count where. Cold: done once, when a
// world is prepared; successive worlds share the body of a field that did not change.

#ifndef RAYFOLD_GEOM_SDF_CELLS_H
#define RAYFOLD_GEOM_SDF_CELLS_H

#include "base/array.h"
#include "base/err.h"
#include "geom/sdf.h"

#include <stdatomic.h>

typedef struct SdfColor {
  float rgb[3];
} SdfColor;

typedef struct SdfBody {
  atomic_int users;
  uint64_t key; // hash of the steps and all they name
  Sdf sdf;      // its pointers lead into the arrays
  ARRAY(SdfStep) steps;
  ARRAY(SdfWarp) warps;
  ARRAY(Formula) formulas;
  ARRAY(SdfColor) colors; // one a leaf, or none
  ARRAY(uint32_t) entries;
  ARRAY(SdfLeaf) leaves;
  ARRAY(uint16_t) codes;
} SdfBody;

SdfBody *sdf_body_create(Err *err);
SdfBody *sdf_body_share(SdfBody *b);
void sdf_body_release(SdfBody *b); // accepts NULL

// steps, warps, formulas, colors and sdf.bounds, detail, normal_step, leaf_count are given; the rest is made.
bool sdf_body_make(SdfBody *b, Err *err);

size_t sdf_body_bytes(const SdfBody *b);

#endif
