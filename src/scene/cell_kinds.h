// Cells and gates as a scene has them: the field tables of their kinds, and the structs made from them. Part of scene.h.
//
// A cell is a space of its own, with its own coordinates; whatever names none is in the one that has no name. A gate is
// a surface whose other side lies elsewhere. See docs/worlds.md. Curved cells have the coordinates of their chart
// (space/chart.h).

#ifndef RAYFOLD_SCENE_CELL_KINDS_H
#define RAYFOLD_SCENE_CELL_KINDS_H

#include "scene/field.h"

#define CELL_FIELDS(F)                                                                                              \
  F(sky,    sky, -1, 0, 0, "", "What is seen in it where nothing is, of `skies`; none: the scene's own.")           \
  F(medium, atmosphere, -1, 0, 0, "", "A homogeneous medium that fills all of it.")                                 \
  F(vec3,   gravity, (0, -9.81, 0), -NO_LIMIT, NO_LIMIT, "m/s2", "Which way walkers fall; zero: they float.")       \
  F(real,   beams, 0, 0, NO_LIMIT, "m", "With `space`: radius of beams along the edges of the solid that is repeated; 0 is none.") \
  F(material, beam_material, -1, 0, 0, "", "What the beams are made of.")
#define CELL_FLAT_FIELDS(F)                                                                                         \
  F(choice, space, 0, 0, 0, "none|torus|half_turn|klein|hantzsche_wendt", "Makes a finite space without an edge of it: who goes far enough is back. `torus` by three moves, `half_turn` turned about y by the move along y, `klein` mirrored along x by the move along z, `hantzsche_wendt` by three screws.") \
  F(vec3,   size, (4, 4, 4), 1e-3, NO_LIMIT, "m", "With `space`: after how much it repeats, along x, y and z.")
#define CELL_SPHERICAL_FIELDS(F)                                                                                    \
  F(real,   radius, 10, 1e-3, 1e6, "m", "Radius of curvature: all the way round is 2 pi of it.")                    \
  F(choice, space, 0, 0, 0, "poincare|quaternionic|lens", "Which finite space: a dodecahedron glued to itself with a tenth of a turn, a cube with a quarter, or the lens space L(p, q).") \
  F(integer, p, 5, 3, 24, "", "Of a lens space: of how many cells the sphere is made.")                             \
  F(integer, q, 2, 1, 23, "", "Of a lens space: how many p-ths of a turn each step makes; no factor common with p.")
#define CELL_HYPERBOLIC_FIELDS(F)                                                                                   \
  F(real,   radius, 5, 1e-3, 1e6, "m", "Radius of curvature: a circle of this radius is 1.18 times as long as a flat one.") \
  F(choice, space, 0, 0, 0, "seifert_weber|right_angled|cubes", "Which space: a dodecahedron glued to itself with three tenths of a turn, dodecahedra with right angles whose faces are mirrors of space, or cubes five round an edge, whose content must look the same from each face.")
FIELD_STRUCT(CellCommon, CELL_FIELDS);
FIELD_STRUCT(CellFlat, CELL_FLAT_FIELDS);
FIELD_STRUCT(CellSpherical, CELL_SPHERICAL_FIELDS);
FIELD_STRUCT(CellHyperbolic, CELL_HYPERBOLIC_FIELDS);
typedef enum { FLAT_NONE, FLAT_TORUS, FLAT_HALF_TURN, FLAT_KLEIN, FLAT_HANTZSCHE_WENDT } FlatSpace;
typedef enum { SPHERICAL_POINCARE, SPHERICAL_QUATERNIONIC, SPHERICAL_LENS } SphericalSpace;
typedef enum { HYPERBOLIC_SEIFERT_WEBER, HYPERBOLIC_RIGHT_ANGLED, HYPERBOLIC_CUBES } HyperbolicSpace;
typedef enum CellKind { CELL_FLAT, CELL_SPHERICAL, CELL_HYPERBOLIC } CellKind;
typedef struct Cell {
  const char *name;
  int32_t kind; // CellKind
  CellCommon common;
  union {
    CellFlat flat;
    CellSpherical spherical;
    CellHyperbolic hyperbolic;
  };
} Cell;

#define GATE_FIELDS(F)                                                                                              \
  F(cell,   cell, -1, 0, 0, "", "The cell it stands in.")                                                           \
  F(vec3,   translate, (0, 0, 0), -NO_LIMIT, NO_LIMIT, "m", "Where its middle is.")                                 \
  F(vec3,   rotate, (0, 0, 0), -NO_LIMIT, NO_LIMIT, "deg", "Turned about x, then y, then z; unturned, the front of a flat one faces +z.") \
  F(gate,   to, -1, 0, 0, "", "The gate it leads to, which leads back. One of another size makes what passes larger or smaller.") \
  F(choice, out, 0, 0, 0, "front|back", "Of flat ones: what goes in at the front comes out of that side. `front` for doors into two rooms, `back` for one opening cut in two.") \
  F(choice, sides, 0, 0, 0, "both|front", "Whether the back leads on likewise. A side that leads nowhere is not there.") \
  F(gate,   back_to, -1, 0, 0, "", "Where the back leads instead, by the same rules.")                              \
  F(flag,   one_way, 0, 0, 1, "", "The gate it leads to does not lead back.")                                       \
  F(flag,   mirror, 0, 0, 1, "", "Left and right change places on the way.")                                        \
  F(flag,   wall, 0, 0, 1, "", "The cell ends at this flat gate: nothing of it lies beyond its plane, and rays leave by it, never past its edge.") \
  F(cell,   to_cell, -1, 0, 0, "", "Without `to`: the cell it leads to, one way; none: its own.")                   \
  F(vec3,   to_translate, (0, 0, 0), -NO_LIMIT, NO_LIMIT, "m", "Without `to`: where one comes out, as if the gate were carried there.") \
  F(vec3,   to_rotate, (0, 0, 0), -NO_LIMIT, NO_LIMIT, "deg", "Without `to`: how it is turned there.")              \
  F(real,   to_scale, 1, 1e-6, 1e6, "", "Without `to`: how much larger it is there.")
FIELD_STRUCT(GateCommon, GATE_FIELDS);
#define GATE_RECT_FIELDS(F) \
  F(vec2, size, (1, 2), 1e-6, NO_LIMIT, "m", "Width and height.")
#define GATE_POLYGON_FIELDS(F) \
  F(points, points, 0, -NO_LIMIT, NO_LIMIT, "m", "Its corners, counter-clockwise seen from the front.")
#define GATE_BOX_FIELDS(F) \
  F(vec3, size, (1, 1, 1), 1e-6, NO_LIMIT, "m", "Extent along x, y and z; its front is outside.")
#define GATE_SPHERE_FIELDS(F) \
  F(real, radius, 1, 1e-6, NO_LIMIT, "m", "Its front is outside.")
#define GATE_WORMHOLE_FIELDS(F)                                                                                     \
  F(real, radius, 1, 1e-6, NO_LIMIT, "m", "Of the ball within which it bends light; outside of it space is flat.")  \
  F(real, throat, 0.5, 1e-6, NO_LIMIT, "m", "Radius where it is narrowest, smaller than that of the ball.")         \
  F(real, length, 0, 0, NO_LIMIT, "m", "Of a tube of that radius between its ends; needs `lensing`.")               \
  F(real, lensing, 0, 0, NO_LIMIT, "m", "How softly the throat widens at its ends (DNGR's M): 0 is Ellis's wormhole, which has no tube.")
#define GATE_BLACK_HOLE_FIELDS(F)                                                                                   \
  F(real,  radius, 1, 1e-6, NO_LIMIT, "m", "Of the ball within which it bends light; outside of it space is flat.") \
  F(real,  horizon, 0.1, 1e-6, NO_LIMIT, "m", "Radius of its horizon, at most half of the ball's. It looks 2.6 times as large.") \
  F(color, caught, (0, 0, 0), 0, NO_LIMIT, "W/m2sr", "What is seen in place of light that falls in.")               \
  F(real,  disk_inner, 0.3, 1e-6, NO_LIMIT, "m", "Where the disk of hot matter about its y axis begins: more than 1.5 horizons; 3 are natural.") \
  F(real,  disk_outer, 0, 0, NO_LIMIT, "m", "Where it ends, at most at the ball's surface; 0: there is no disk.")   \
  F(real,  disk_temperature, 4500, 1, 40000, "K", "Where it is hottest, 1.36 times as far out as it begins; its colour.")              \
  F(real,  disk_gain, 1, 0, NO_LIMIT, "W/m2sr", "Its radiance there, before motion and gravity change it by the fourth power of the shift.")
FIELD_STRUCT(GateRect, GATE_RECT_FIELDS);
FIELD_STRUCT(GatePolygon, GATE_POLYGON_FIELDS);
FIELD_STRUCT(GateBox, GATE_BOX_FIELDS);
FIELD_STRUCT(GateSphere, GATE_SPHERE_FIELDS);
FIELD_STRUCT(GateWormhole, GATE_WORMHOLE_FIELDS);
FIELD_STRUCT(GateBlackHole, GATE_BLACK_HOLE_FIELDS);
typedef enum { GATE_OUT_FRONT, GATE_OUT_BACK } GateOut;
typedef enum { GATE_SIDES_BOTH, GATE_SIDES_FRONT } GateSides;
typedef enum GateKind { GATE_RECT, GATE_POLYGON, GATE_BOX, GATE_SPHERE, GATE_WORMHOLE, GATE_BLACK_HOLE } GateKind;
typedef struct Gate {
  const char *name;
  int32_t kind; // GateKind
  GateCommon common;
  union {
    GateRect rect;
    GatePolygon polygon;
    GateBox box;
    GateSphere sphere;
    GateWormhole wormhole;
    GateBlackHole black_hole;
  };
} Gate;

#endif
