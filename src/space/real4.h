// The algebra of cells of constant curvature, for one type of number: included by chart.h once for float (names end in
// _f) and once for double (_d), so that what is drawn and what is proved is one text.
//
// A point is X = (x, y, z, w): in flat space w = 1, in spherical space x^2 + y^2 + z^2 + w^2 = 1, in hyperbolic space
// w^2 - x^2 - y^2 - z^2 = 1 with w > 0. A geodesic is a point and a unit tangent; maps between cells are 4 x 4 matrices
// that keep the product. kappa is 0, 1 or -1 and lengths are in units of the radius of curvature.
//
// Does not know scenes, nor the affine chart (chart.h).

#ifndef REAL
#include "space/chart.h" // which includes this twice
#else

typedef struct R(Vec4) {
  REAL v[4];
} R(Vec4);

typedef struct R(Mat4) {
  REAL m[4][4]; // rows
} R(Mat4);

typedef struct R(Geodesic) {
  R(Vec4) p, v; // a point, and the unit tangent the way goes on with
} R(Geodesic);

// One face of a convex domain: inside is plane . X <= 0, and what leaves through it goes on at map X.
typedef struct R(Face) {
  R(Vec4) plane;
  R(Mat4) map;
} R(Face);

// The product of two tangents, or of two points of curved space.
static inline REAL R(dot4)(int kappa, const R(Vec4) *a, const R(Vec4) *b)
{
  return a->v[0] * b->v[0] + a->v[1] * b->v[1] + a->v[2] * b->v[2] + (REAL)kappa * (a->v[3] * b->v[3]);
}

// A covector at a point.
static inline REAL R(pair4)(const R(Vec4) *n, const R(Vec4) *x)
{
  return n->v[0] * x->v[0] + n->v[1] * x->v[1] + n->v[2] * x->v[2] + n->v[3] * x->v[3];
}

// a x + b y
static inline R(Vec4) R(mix4)(REAL a, const R(Vec4) *x, REAL b, const R(Vec4) *y)
{
  R(Vec4) out;
  for (int i = 0; i < 4; i++) out.v[i] = a * x->v[i] + b * y->v[i];
  return out;
}

static inline R(Vec4) R(mat4_apply)(const R(Mat4) *m, const R(Vec4) *x)
{
  R(Vec4) out;
  for (int i = 0; i < 4; i++)
    out.v[i] = m->m[i][0] * x->v[0] + m->m[i][1] * x->v[1] + m->m[i][2] * x->v[2] + m->m[i][3] * x->v[3];
  return out;
}

// A geodesic's way is along, where x = P c + V s: cos and sin of the length, cosh and sinh, 1 and the length.
static inline void R(geodesic_move)(int kappa, REAL c, REAL s, R(Geodesic) *g)
{
  const R(Vec4) p = g->p;
  g->p = R(mix4)(c, &p, s, &g->v);
  g->v = R(mix4)(c, &g->v, -(REAL)kappa * s, &p);
}

// Takes off what rounding has added: point back into the space, tangent made tangent and unit.
static inline void R(geodesic_mend)(int kappa, R(Geodesic) *g)
{
  if (kappa != 0) {
    const REAL n = (REAL)kappa * R(dot4)(kappa, &g->p, &g->p);
    const REAL scale = 1 / REAL_SQRT(n);
    for (int i = 0; i < 4; i++) g->p.v[i] *= scale;
    g->v = R(mix4)(1, &g->v, -(REAL)kappa * R(dot4)(kappa, &g->p, &g->v), &g->p);
  }
  const REAL scale = 1 / REAL_SQRT(R(dot4)(kappa, &g->v, &g->v));
  for (int i = 0; i < 4; i++) g->v.v[i] *= scale;
}

// Through which face a geodesic leaves a convex domain, and the cosine c and sine s of the way there, as geodesic_move()
// takes them. -1: through none. The face that is nearest is the one whose cotangent q = (N V) / (-N P) is greatest, on
// the whole half circle 0..pi of spherical space, too. A point that rounding has put outside of a face leaves at once if it
// goes out, and has just come in if not, so no epsilon is needed and no way is lost (worlds.md, section 2.3).
static inline int R(domain_exit)(int kappa, const R(Face) *faces, int count, const R(Geodesic) *g, REAL *c, REAL *s)
{
  int exit = -1;
  REAL most = 0;
  for (int f = 0; f < count; f++) {
    const REAL out = R(pair4)(&faces[f].plane, &g->v), depth = -R(pair4)(&faces[f].plane, &g->p);
    if (depth <= 0 && out > 0) {
      *c = 1;
      *s = 0;
      return f;
    }
    if (depth <= 0 || (out <= 0 && kappa <= 0)) continue;
    const REAL q = out / depth;
    if (exit >= 0 && q <= most) continue;
    most = q;
    exit = f;
  }
  if (exit < 0) return -1;
  const REAL n = most * most + (REAL)kappa;
  if (!(n > 0)) return -1; // a plane beyond the horizon of hyperbolic space
  *s = 1 / REAL_SQRT(n);
  *c = kappa == 0 ? 1 : most * *s;
  return exit;
}

// Goes on behind a face.
static inline void R(geodesic_cross)(int kappa, const R(Face) *face, R(Geodesic) *g)
{
  g->p = R(mat4_apply)(&face->map, &g->p);
  g->v = R(mat4_apply)(&face->map, &g->v);
  R(geodesic_mend)(kappa, g);
}

#endif
