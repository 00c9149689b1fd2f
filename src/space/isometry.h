// Maps of space onto itself as 4 x 4 matrices in double: moves along a line, turns, mirrors, and what is made of them.
// Cold. kappa is 0, 1 or -1 as in real4.h.

#ifndef RAYFOLD_SPACE_ISOMETRY_H
#define RAYFOLD_SPACE_ISOMETRY_H

#include "space/chart.h"

Mat4_d isometry_identity(void);
Mat4_d isometry_product(const Mat4_d *a, const Mat4_d *b); // a after b
Mat4_d isometry_inverse(int kappa, const Mat4_d *m);

// By a length along a unit vector at the centre.
Mat4_d isometry_move(int kappa, const double n[3], double length);
// About an axis through the centre, radians, counter-clockwise seen against the axis.
Mat4_d isometry_turn(const double axis[3], double angle);
// In a plane, a covector as domains have them.
Mat4_d isometry_mirror(int kappa, const Vec4_d *plane);

// Columns made orthonormal again: Gram and Schmidt with the space's product, the place first.
void isometry_mend(int kappa, Mat4_d *m);

// The greatest difference of two maps' entries.
double isometry_distance(const Mat4_d *a, const Mat4_d *b);

double point_distance(int kappa, const Vec4_d *p, const Vec4_d *q);
// The geodesic from p to q; p and q must differ, and not be opposite.
Geodesic_d geodesic_between(int kappa, const Vec4_d *p, const Vec4_d *q);
void geodesic_go(int kappa, double length, Geodesic_d *g);

// The unit covector of the plane through p whose unit normal is the tangent n there.
Vec4_d plane_through(int kappa, const Vec4_d *p, const Vec4_d *n);

#endif
