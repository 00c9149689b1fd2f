// Space forms: a convex domain whose faces are glued to each other, so that a finite cell is a whole space without an
// edge. Each is made from a few numbers: either from the group of its moves, as the domain of the places that are nearer
// to the centre than to any of its images (Dirichlet), or from a regular solid and a turn. Planes, corners and maps are
// computed; none is written down. Lengths are radii of curvature, metres in flat space.
//
// Invariant: what leaves through face f goes on at map X, which lies on face `partner`; the maps around an edge of a
// manifold multiply to the identity (form_cycle()). Cold.

#ifndef RAYFOLD_SPACE_FORM_H
#define RAYFOLD_SPACE_FORM_H

#include "space/isometry.h"

typedef enum FormKind {
  FORM_TORUS,         // flat: three moves
  FORM_HALF_TURN,     // flat: two moves, and one with half a turn about it
  FORM_KLEIN,         // flat: two moves, and one that is mirrored across
  FORM_HANTZSCHE_WENDT, // flat: three screws of half a turn
  FORM_POINCARE,      // spherical: dodecahedron, opposite faces turned by 36 degrees
  FORM_QUATERNIONIC,  // spherical: cube, a quarter of a turn
  FORM_LENS,          // spherical: L(p, q)
  FORM_SEIFERT_WEBER, // hyperbolic: dodecahedron, 108 degrees
  FORM_RIGHT_ANGLED,  // hyperbolic: the dodecahedron of {5,3,4}, its faces mirrors of space
  FORM_CUBES,         // hyperbolic: cubes five round an edge, {4,3,5}, moved without a turn
  FORM_KINDS
} FormKind;

enum { FORM_MOST_FACES = 32, FORM_MOST_CORNERS = 24 };

typedef struct FormFace {
  Vec4_d plane;
  Mat4_d map;
  int partner;
  int corner_count;
  double corners[FORM_MOST_CORNERS][3]; // in the chart of unit curvature, counter-clockwise from outside
} FormFace;

typedef struct SpaceForm {
  FormKind kind;
  int kappa;
  int face_count;
  FormFace faces[FORM_MOST_FACES];
  double inner, outer; // distances of the nearest face and the farthest corner from the centre
  bool is_bounded;     // in the chart: some lens spaces reach its end
} SpaceForm;

typedef struct FormShape {
  double size[3]; // metres, of a flat form's moves
  int p, q;       // of a lens space: 3 <= p <= 24, no common factor
} FormShape;

// What the maps around an edge make together.
typedef struct FormCycle {
  Mat4_d product;
  int length;   // faces crossed
  double angle; // sum of the angles between faces
} FormCycle;

const char *form_name(FormKind kind); // as scenes call it
bool form_find(const char *name, FormKind *kind);
int form_kappa(FormKind kind);

// Whether a world in it is consistent whatever it holds; {4,3,5} is so only for what is as symmetric as a cube.
bool form_is_manifold(FormKind kind);

// False: the numbers make no space (p and q).
bool form_make(FormKind kind, const FormShape *shape, SpaceForm *out);

FormCycle form_cycle(const SpaceForm *form, int face, int corner); // of the edge from that corner to the next

// Copies faces and maps into the types that rays are walked with.
void form_faces_f(const SpaceForm *form, Face_f *faces);
void form_faces_d(const SpaceForm *form, Face_d *faces);

bool form_contains(const SpaceForm *form, const double k[3]); // a place of the chart
double form_volume(const SpaceForm *form, uint32_t samples);   // by chance; cubic radii of curvature

#endif
