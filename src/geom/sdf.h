// Sdf: distance fields. A field gives for every place how far it is from a surface, at least: negative inside. It is a
// tape: steps in postfix order, each of which finds a value (of a primitive, or of a group that ends) and joins it with
// the value before. A field is prepared as a tree of cells, each with the steps that count inside it, so that far parts
// of a large field cost nothing:
//
//   Sdf: steps[] warps[]   the whole field
//        entries[]         16 x 16 x 16 cells, and 4 x 4 x 4 for each that is cut once more: a leaf, or nothing with
//                          the distance that is free
//        leaves[]          a piece of codes[] and how steep the field is there
//        codes[]           step << 1 | (1: push the value instead of joining it)
//
// Steepness: values grow at most `steep` a metre (the Lipschitz constant), so value / steep is free on all sides (Hart,
// "Sphere Tracing", The Visual Computer 1996). Frames scale values by their least stretch, so primitives count as 1;
// warps and formulas bring more, which is found cell by cell (geom/sdf_cells.c).
//
// geom/sdf_eval.h runs a tape in lanes, geom/sdf_march.h follows rays, geom/sdf_exact.h finds the place and the normal.

#ifndef RAYFOLD_GEOM_SDF_H
#define RAYFOLD_GEOM_SDF_H

#include "base/err.h"
#include "base/formula.h"
#include "geom/bounds.h"

typedef enum SdfKind {
  SDF_SPHERE,     // size: radius
  SDF_BOX,        // half extents less rounding, rounding
  SDF_TORUS,      // ring, tube; around y
  SDF_CYLINDER,   // radius, half height, which may be infinite
  SDF_CONE,       // lower and upper radius, half height
  SDF_CAPSULE,    // radius, half of the straight part
  SDF_PLANE,      // z
  SDF_ELLIPSOID,  // radii; a bound, not the distance
  SDF_OCTAHEDRON, // radius
  SDF_MENGER,     // half extent; count: levels
  SDF_MANDELBULB, // radius; count: rounds; power
  SDF_FORMULA,    // half extents of the box it is cut to
  SDF_ENTER,      // a group begins whose parts lie in warped space
  SDF_LEAVE,      // the group ends: its value is changed, the space before comes back
  SDF_JOIN,       // a group ends that changes nothing
} SdfKind;

typedef enum SdfOperation { SDF_UNION, SDF_INTERSECTION, SDF_DIFFERENCE, SDF_SOFT_MAXIMUM } SdfOperation;
typedef enum SdfMix { SDF_MIX_NONE, SDF_MIX_COLOR, SDF_MIX_MATERIAL } SdfMix;

typedef struct SdfStep {
  uint8_t kind;      // SdfKind
  uint8_t operation; // how the value joins that before it
  uint8_t mix;       // SdfMix: what becomes of materials where a join is smooth
  uint8_t power;
  uint8_t is_pushed; // the first of its group
  uint8_t is_moved;  // its map only moves
  uint16_t count;
  uint16_t leaf;     // which material
  uint16_t warp;     // of SDF_ENTER and SDF_LEAVE
  float smooth;      // metres over which the join is smooth; 0: hard
  float inv_smooth;  // 1 / smooth
  float sixth;       // smooth / 6
  float scale;       // of its value
  float map[12];     // to its own space from that around it: three rows and what is added
  float size[4];
  uint16_t formula;  // of SDF_FORMULA
} SdfStep;

// How a group bends space before its parts are asked, and what becomes of their value. Lengths in the group's space.
typedef struct SdfWarp {
  bool has_space;    // else only the value changes, and SDF_LEAVE stands alone
  bool is_mirrored;
  float bend, twist; // radians a metre
  float spacing[3];  // 0: not repeated along this axis
  float shift[3];          // so that an even number of copies has its middle at the origin
  float first[3], last[3]; // numbers of the copies along each axis
  float gap[3];      // from what is repeated to the border of its cell
  float elongate[3];
  float round, onion; // metres added all around; half the thickness of a shell, 0: none
  float noise, noise_frequency; // height, waves a metre
  uint32_t seed;
} SdfWarp;

// Called from many places, each time for long: one copy a unit is enough.
#define SDF_LARGE __attribute__((noinline, unused))

enum { SDF_MOST_DEPTH = 16, SDF_MOST_STEPS = 8192, SDF_MOST_LEAVES = 4096 };
// Steepest change of gradient noise, a metre at one wave a metre: 3.1 was the most of 10^8 samples (tests/test_fields.c).
#define SDF_NOISE_STEEP 3.6f
#define SDF_NOISE_HIGH 1.05f // its largest value

// What an entry says in its lowest two bits; the others:
#define SDF_CELL_EMPTY 0u // of a float: the value at the cell's middle over the steepness, negative inside
#define SDF_CELL_WIDE 1u  // likewise, of the empty cell of 4 x 4 x 4 that it is part of
#define SDF_CELL_CUT 2u   // of the 64 entries where it goes on, the first, times four
#define SDF_CELL_LEAF 3u  // of a leaf, times four
#define SDF_CELL_KIND 3u

enum { SDF_TOP = 16, SDF_TOP_CELLS = SDF_TOP * SDF_TOP * SDF_TOP };

typedef struct SdfLeaf {
  uint32_t first, count; // in codes
  float flat;            // 1 / steepness
} SdfLeaf;

typedef struct Sdf {
  const SdfStep *steps;
  const SdfWarp *warps;
  const Formula *formulas;
  uint32_t step_count;
  uint16_t leaf_count;   // materials
  const float (*colors)[3]; // one a leaf; NULL: colours are not mixed
  Bounds bounds;         // of the surface; of what has no ends, not finite
  float lo[3], cell;     // of the tree of cells: its corner, and the width of a finest cell
  float inv_cell;
  uint32_t levels;       // 4^levels cells along each side, 2 or 3; 0: no tree, one leaf everywhere
  const uint32_t *entries; // x + 16 y + 256 z, then x + 4 y + 16 z
  const SdfLeaf *leaves; // the first is the whole field
  const uint16_t *codes;
  float detail;          // metres: a part thicker than this is never missed
  float normal_step;     // metres between the places a normal is found from
  bool has_ids;          // hits want to know their leaf
} Sdf;

#endif
