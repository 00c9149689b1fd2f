#include "space/isometry.h"

Mat4_d isometry_identity(void)
{
  Mat4_d m = {{{0}}};
  for (int i = 0; i < 4; i++) m.m[i][i] = 1;
  return m;
}

Mat4_d isometry_product(const Mat4_d *a, const Mat4_d *b)
{
  Mat4_d out = {{{0}}};
  for (int i = 0; i < 4; i++)
    for (int j = 0; j < 4; j++)
      for (int k = 0; k < 4; k++) out.m[i][j] += a->m[i][k] * b->m[k][j];
  return out;
}

// M^T J M = J gives the inverse J M^T J of curved space without a division; in flat space the turn is transposed.
Mat4_d isometry_inverse(int kappa, const Mat4_d *m)
{
  Mat4_d out = {{{0}}};
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) out.m[i][j] = m->m[j][i];
  for (int i = 0; i < 3; i++) {
    for (int k = 0; k < 3 && kappa == 0; k++) out.m[i][3] -= m->m[k][i] * m->m[k][3];
    if (kappa != 0) {
      out.m[i][3] = kappa * m->m[3][i];
      out.m[3][i] = kappa * m->m[i][3];
    }
  }
  out.m[3][3] = kappa == 0 ? 1 : m->m[3][3];
  return out;
}

static void cosine_sine(int kappa, double length, double *c, double *s)
{
  *c = kappa > 0 ? cos(length) : kappa < 0 ? cosh(length) : 1;
  *s = kappa > 0 ? sin(length) : kappa < 0 ? sinh(length) : length;
}

Mat4_d isometry_move(int kappa, const double n[3], double length)
{
  Mat4_d m = isometry_identity();
  double c, s;
  cosine_sine(kappa, length, &c, &s);
  for (int i = 0; i < 3; i++) {
    for (int j = 0; j < 3; j++) m.m[i][j] += (c - 1) * n[i] * n[j];
    m.m[i][3] = s * n[i];
    m.m[3][i] = -kappa * s * n[i];
  }
  m.m[3][3] = c;
  return m;
}

// Rodrigues' formula.
Mat4_d isometry_turn(const double axis[3], double angle)
{
  const double c = cos(angle), s = sin(angle);
  Mat4_d m = isometry_identity();
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) m.m[i][j] = (i == j ? c : 0) + (1 - c) * axis[i] * axis[j];
  for (int i = 0; i < 3; i++) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    m.m[k][j] += s * axis[i];
    m.m[j][k] -= s * axis[i];
  }
  return m;
}

// X - 2 (N X) n, with n the vector of the unit covector N.
Mat4_d isometry_mirror(int kappa, const Vec4_d *plane)
{
  Mat4_d m = isometry_identity();
  for (int i = 0; i < 4; i++)
    for (int j = 0; j < 4; j++) m.m[i][j] -= 2 * (i < 3 ? 1 : kappa) * plane->v[i] * plane->v[j];
  return m;
}

void isometry_mend(int kappa, Mat4_d *m)
{
  for (int turn = 0; turn < 4; turn++) {
    const int j = (turn + 3) % 4; // the place, then the axes
    Vec4_d a = {{m->m[0][j], m->m[1][j], m->m[2][j], m->m[3][j]}};
    if (kappa == 0 && j == 3) continue;
    for (int before = kappa == 0; before < turn; before++) {
      const int i = (before + 3) % 4;
      const Vec4_d b = {{m->m[0][i], m->m[1][i], m->m[2][i], m->m[3][i]}};
      a = mix4_d(1, &a, -dot4_d(kappa, &a, &b) * (i == 3 ? kappa : 1), &b);
    }
    const double n = sqrt(fabs(dot4_d(kappa, &a, &a)));
    for (int i = 0; i < 4; i++) m->m[i][j] = a.v[i] / n;
  }
}

double isometry_distance(const Mat4_d *a, const Mat4_d *b)
{
  double most = 0;
  for (int i = 0; i < 4; i++)
    for (int j = 0; j < 4; j++) most = fmax(most, fabs(a->m[i][j] - b->m[i][j]));
  return most;
}

// By the half of the chord, exact for near points as well.
double point_distance(int kappa, const Vec4_d *p, const Vec4_d *q)
{
  const Vec4_d chord = mix4_d(1, p, -1, q);
  const double half = 0.5 * sqrt(fmax(dot4_d(kappa, &chord, &chord), 0));
  return kappa > 0 ? 2 * asin(fmin(half, 1)) : kappa < 0 ? 2 * asinh(half) : 2 * half;
}

Geodesic_d geodesic_between(int kappa, const Vec4_d *p, const Vec4_d *q)
{
  Geodesic_d g = {*p, mix4_d(1, q, kappa == 0 ? -1 : -kappa * dot4_d(kappa, p, q), p)};
  geodesic_mend_d(kappa, &g);
  return g;
}

void geodesic_go(int kappa, double length, Geodesic_d *g)
{
  double c, s;
  cosine_sine(kappa, length, &c, &s);
  geodesic_move_d(kappa, c, s, g);
}

Vec4_d plane_through(int kappa, const Vec4_d *p, const Vec4_d *n)
{
  Vec4_d plane = *n;
  plane.v[3] = kappa == 0 ? -dot4_d(0, n, p) : kappa * n->v[3];
  return plane;
}
