#include "space/form.h"

#include <string.h>

#include "base/hash.h"

static const struct {
  const char *name;
  int kappa;
} forms[FORM_KINDS] = {
    [FORM_TORUS] = {"torus", 0},
    [FORM_HALF_TURN] = {"half_turn", 0},
    [FORM_KLEIN] = {"klein", 0},
    [FORM_HANTZSCHE_WENDT] = {"hantzsche_wendt", 0},
    [FORM_POINCARE] = {"poincare", 1},
    [FORM_QUATERNIONIC] = {"quaternionic", 1},
    [FORM_LENS] = {"lens", 1},
    [FORM_SEIFERT_WEBER] = {"seifert_weber", -1},
    [FORM_RIGHT_ANGLED] = {"right_angled", -1},
    [FORM_CUBES] = {"cubes", -1},
};

const char *form_name(FormKind kind) { return forms[kind].name; }
int form_kappa(FormKind kind) { return forms[kind].kappa; }
bool form_is_manifold(FormKind kind) { return kind != FORM_CUBES && kind != FORM_RIGHT_ANGLED; }

bool form_find(const char *name, FormKind *kind)
{
  for (int i = 0; i < FORM_KINDS; i++)
    if (!strcmp(name, forms[i].name)) {
      *kind = (FormKind)i;
      return true;
    }
  return false;
}

// --- corners --------------------------------------------------------------------------------------

static double plane_height(const Vec4_d *plane, const double k[3])
{
  return plane->v[0] * k[0] + plane->v[1] * k[1] + plane->v[2] * k[2] + plane->v[3];
}

typedef struct Polygon {
  double at[FORM_MOST_CORNERS][3];
  int count;
} Polygon;

// Far out on a plane: larger than any domain, and what is left of an unbounded one.
#define FAR_OUT 1e4

static Polygon polygon_of_plane(const Vec4_d *plane)
{
  const double *n = plane->v;
  const double square = n[0] * n[0] + n[1] * n[1] + n[2] * n[2], length = sqrt(square);
  const Frame axes = frame_around(v3((float)(n[0] / length), (float)(n[1] / length), (float)(n[2] / length)));
  Polygon p = {.count = 4};
  for (int i = 0; i < 4; i++) {
    const double a = i == 0 || i == 3 ? FAR_OUT : -FAR_OUT, b = i < 2 ? FAR_OUT : -FAR_OUT;
    for (int k = 0; k < 3; k++) p.at[i][k] = a * (double)axes.x[k] + b * (double)axes.y[k];
    // The axes are floats: onto the plane itself.
    const double off = plane_height(plane, p.at[i]) / square;
    for (int k = 0; k < 3; k++) p.at[i][k] -= off * n[k];
  }
  return p;
}

// Sutherland and Hodgman: what is inside a plane. Corners on it, to rounding, count as inside once.
static void polygon_clip(const Vec4_d *plane, Polygon *p)
{
  const Polygon whole = *p;
  p->count = 0;
  for (int i = 0; i < whole.count; i++) {
    const double *a = whole.at[i], *b = whole.at[(i + 1) % whole.count];
    double ha = plane_height(plane, a), hb = plane_height(plane, b);
    if (fabs(ha) < 1e-11) ha = 0;
    if (fabs(hb) < 1e-11) hb = 0;
    if (ha <= 0 && p->count < FORM_MOST_CORNERS) memcpy(p->at[p->count++], a, sizeof p->at[0]);
    if (ha * hb < 0 && p->count < FORM_MOST_CORNERS) {
      for (int k = 0; k < 3; k++) p->at[p->count][k] = (a[k] * hb - b[k] * ha) / (hb - ha);
      p->count++;
    }
  }
}

static bool is_near(const double a[3], const double b[3])
{
  double size = 1, off = 0;
  for (int k = 0; k < 3; k++) {
    size = fmax(size, fabs(a[k]));
    off = fmax(off, fabs(a[k] - b[k]));
  }
  return off < 1e-8 * size;
}

static void polygon_tidy(Polygon *p)
{
  int count = 0;
  for (int i = 0; i < p->count; i++)
    if (count == 0 || !is_near(p->at[i], p->at[count - 1])) memmove(p->at[count++], p->at[i], sizeof p->at[0]);
  while (count > 1 && is_near(p->at[0], p->at[count - 1])) count--;
  p->count = count;
}

static double corner_distance(int kappa, const double k[3])
{
  const double r = sqrt(k[0] * k[0] + k[1] * k[1] + k[2] * k[2]);
  return kappa > 0 ? atan(r) : kappa < 0 ? atanh(fmin(r, 1)) : r;
}

static double plane_distance(int kappa, const Vec4_d *plane)
{
  return kappa > 0 ? asin(-plane->v[3]) : kappa < 0 ? asinh(-plane->v[3]) : -plane->v[3];
}

// Finds the faces' corners, and leaves out planes that touch the domain in less than a face.
static void form_find_corners(SpaceForm *f)
{
  bool keeps[FORM_MOST_FACES];
  for (int i = 0; i < f->face_count; i++) {
    Polygon p = polygon_of_plane(&f->faces[i].plane);
    for (int j = 0; j < f->face_count && p.count; j++)
      if (j != i) polygon_clip(&f->faces[j].plane, &p);
    polygon_tidy(&p);
    keeps[i] = p.count > 2;
    f->faces[i].corner_count = p.count;
    memcpy(f->faces[i].corners, p.at, sizeof p.at);
  }
  int count = 0;
  for (int i = 0; i < f->face_count; i++)
    if (keeps[i]) f->faces[count++] = f->faces[i];
  f->face_count = count;
  f->inner = INFINITY;
  f->is_bounded = true;
  for (int i = 0; i < count; i++) {
    f->inner = fmin(f->inner, plane_distance(f->kappa, &f->faces[i].plane));
    for (int c = 0; c < f->faces[i].corner_count; c++) {
      f->outer = fmax(f->outer, corner_distance(f->kappa, f->faces[i].corners[c]));
      for (int k = 0; k < 3; k++) f->is_bounded &= fabs(f->faces[i].corners[c][k]) < 0.5 * FAR_OUT;
    }
  }
}

// The plane that a map takes a face's plane to, seen from the other side: the partner is there.
static void form_find_partners(SpaceForm *f)
{
  for (int i = 0; i < f->face_count; i++) {
    const Mat4_d back = isometry_inverse(f->kappa, &f->faces[i].map);
    double best = INFINITY;
    for (int j = 0; j < f->face_count; j++) {
      double off = 0;
      for (int k = 0; k < 4; k++) { // covectors go by the inverse
        double there = 0;
        for (int l = 0; l < 4; l++) there += f->faces[i].plane.v[l] * back.m[l][k];
        off = fmax(off, fabs(there + f->faces[j].plane.v[k]));
      }
      if (off >= best) continue;
      best = off;
      f->faces[i].partner = j;
    }
  }
}

// --- forms from groups ----------------------------------------------------------------------------

enum { MOST_MOVES = 400 };

typedef struct Group {
  int kappa, count;
  Mat4_d moves[MOST_MOVES]; // the first is the identity
} Group;

static void group_add(Group *g, const Mat4_d *m)
{
  for (int i = 0; i < g->count; i++)
    if (isometry_distance(&g->moves[i], m) < 1e-6) return;
  if (g->count < MOST_MOVES) g->moves[g->count++] = *m;
}

// Shorter products come first, so what is left out when there is no more room is far away.
static void group_grow(Group *g, const Mat4_d *generators, int generator_count)
{
  const Mat4_d one = isometry_identity();
  group_add(g, &one);
  for (int i = 0; i < g->count && g->count < MOST_MOVES; i++)
    for (int k = 0; k < generator_count; k++) {
      const Mat4_d back = isometry_inverse(g->kappa, &generators[k]);
      const Mat4_d there = isometry_product(&g->moves[i], &generators[k]), here = isometry_product(&g->moves[i], &back);
      group_add(g, &there);
      group_add(g, &here);
    }
}

// What is as far from the centre as from its image under a move.
static Vec4_d plane_between(int kappa, const Mat4_d *move)
{
  Vec4_d n;
  double square = 0;
  for (int i = 0; i < 4; i++) n.v[i] = (i < 3 ? 1 : kappa) * (move->m[i][3] - (i == 3));
  for (int i = 0; i < 3; i++) square += n.v[i] * n.v[i];
  if (kappa == 0) n.v[3] = -0.5 * square;
  const double length = sqrt(square + kappa * n.v[3] * n.v[3]);
  for (int i = 0; i < 4; i++) n.v[i] /= length;
  return n;
}

static double move_length(int kappa, const Mat4_d *m)
{
  const Vec4_d centre = {{0, 0, 0, 1}}, image = {{m->m[0][3], m->m[1][3], m->m[2][3], m->m[3][3]}};
  return point_distance(kappa, &centre, &image);
}

// The domain around the centre. Nearest moves are tried first and only those kept that still cut something off, so a
// few faces' room is enough.
static void form_from_group(Group *g, SpaceForm *f)
{
  bool is_tried[MOST_MOVES] = {true};
  for (int round = 1; round < g->count; round++) {
    int best = -1;
    double nearest = INFINITY;
    for (int i = 1; i < g->count; i++) {
      const double length = is_tried[i] ? INFINITY : move_length(g->kappa, &g->moves[i]);
      if (length >= nearest - 1e-9) continue;
      nearest = length;
      best = i;
    }
    if (best < 0) break;
    is_tried[best] = true;
    const Vec4_d plane = plane_between(g->kappa, &g->moves[best]);
    Polygon p = polygon_of_plane(&plane);
    for (int j = 0; j < f->face_count && p.count; j++) polygon_clip(&f->faces[j].plane, &p);
    polygon_tidy(&p);
    if (p.count < 3 || f->face_count == FORM_MOST_FACES) continue;
    f->faces[f->face_count++] =
        (FormFace){.plane = plane, .map = isometry_inverse(g->kappa, &g->moves[best])};
  }
}

static Mat4_d flat_move(double sx, double sy, double sz, double x, double y, double z)
{
  return (Mat4_d){{{sx, 0, 0, x}, {0, sy, 0, y}, {0, 0, sz, z}, {0, 0, 0, 1}}};
}

static void form_flat(FormKind kind, const double s[3], SpaceForm *f)
{
  Mat4_d moves[3] = {flat_move(1, 1, 1, s[0], 0, 0), flat_move(1, 1, 1, 0, s[1], 0), flat_move(1, 1, 1, 0, 0, s[2])};
  if (kind == FORM_HALF_TURN) moves[1] = flat_move(-1, 1, -1, 0, s[1], 0); // about what is upright
  if (kind == FORM_KLEIN) moves[2] = flat_move(-1, 1, 1, 0, 0, s[2]);
  if (kind == FORM_HANTZSCHE_WENDT) { // Hantzsche and Wendt 1935; the space group P 21 21 21
    moves[0] = flat_move(1, -1, -1, s[0] / 2, s[1] / 2, 0);
    moves[1] = flat_move(-1, 1, -1, 0, s[1] / 2, s[2] / 2);
    moves[2] = flat_move(-1, -1, 1, s[0] / 2, 0, s[2] / 2);
  }
  Group g = {.kappa = 0};
  group_grow(&g, moves, 3);
  form_from_group(&g, f);
}

static int common_factor(int a, int b) { return b ? common_factor(b, a % b) : a; }

// (z1, z2) -> (e^(2 pi i q/p) z1, e^(2 pi i/p) z2) with z1 = x + i y, z2 = w + i z. About a point of the circle z1 = 0 the
// domain is a lens whose rim lies at the end of the chart. About a point between the two circles it is bounded, unless the
// move turns both alike (q = 1 or p - 1), when all points are such.
static bool form_lens(int p, int q, SpaceForm *f)
{
  if (p < 3 || p > FORM_MOST_CORNERS || q < 1 || q >= p || common_factor(p, q) != 1) return false;
  const double turn = 2 * M_PI / p, z[3] = {0, 0, 1}, x[3] = {1, 0, 0};
  const Mat4_d along = isometry_move(1, z, turn), about = isometry_turn(z, turn * q);
  Mat4_d move = isometry_product(&along, &about);
  if (q != 1 && q != p - 1) {
    const Mat4_d there = isometry_move(1, x, M_PI / 4), back = isometry_inverse(1, &there);
    move = isometry_product(&move, &there);
    move = isometry_product(&back, &move);
  }
  Group g = {.kappa = 1};
  group_grow(&g, &move, 1);
  form_from_group(&g, f);
  return true;
}

// --- forms from solids ----------------------------------------------------------------------------

// The normals of the dodecahedron's faces are the icosahedron's corners, (0, 1, golden) and its cyclic and signed kin, turned
// so that one face is a floor: 2 atan(1 / golden) / 2 about x takes (0, golden, 1) upright.
static int dodecahedron_normals(double n[][3])
{
  const double golden = 0.5 * (1 + sqrt(5)), length = sqrt(1 + golden * golden), axis[3] = {1, 0, 0};
  const Mat4_d upright = isometry_turn(axis, -atan2(1, golden));
  int count = 0;
  for (int turn = 0; turn < 3; turn++)
    for (int signs = 0; signs < 4; signs++) {
      Vec4_d v = {{0}};
      v.v[turn] = (signs & 1 ? -1 : 1) * golden / length;
      v.v[(turn + 1) % 3] = (signs & 2 ? -1 : 1) / length;
      const Vec4_d u = mat4_apply_d(&upright, &v);
      memcpy(n[count++], u.v, sizeof n[0]);
    }
  return count;
}

static int cube_normals(double n[][3])
{
  for (int i = 0; i < 6; i++)
    for (int k = 0; k < 3; k++) n[i][k] = k == i / 2 ? (i & 1 ? -1 : 1) : 0;
  return 6;
}

// A regular solid whose faces meet at `dihedral`: normals of neighbours with cosine c between them have the product
// c cos^2 r + sin^2 r (c cosh^2 r - sinh^2 r) = -cos dihedral, so both spaces have cos^2 r (cosh^2 r) =
// (1 + cos dihedral) / (1 - c). Faces are glued to the opposite ones after a turn, or mirror.
static void form_solid(int kappa, double (*n)[3], int count, double dihedral, double twist, bool mirrors, SpaceForm *f)
{
  double c = -1;
  for (int i = 1; i < count; i++) {
    const double cosine = n[0][0] * n[i][0] + n[0][1] * n[i][1] + n[0][2] * n[i][2];
    if (cosine > c) c = cosine;
  }
  const double ratio = (1 + cos(dihedral)) / (1 - c);
  const double r = kappa > 0 ? acos(sqrt(ratio)) : acosh(sqrt(ratio));
  const double across = sqrt(ratio), up = kappa > 0 ? sin(r) : sinh(r);
  for (int i = 0; i < count; i++) {
    FormFace *face = &f->faces[f->face_count++];
    face->plane = (Vec4_d){{across * n[i][0], across * n[i][1], across * n[i][2], -up}};
    const Mat4_d back = isometry_move(kappa, n[i], -2 * r), turn = isometry_turn(n[i], twist);
    face->map = mirrors ? isometry_mirror(kappa, &face->plane) : isometry_product(&back, &turn);
  }
}

bool form_make(FormKind kind, const FormShape *shape, SpaceForm *out)
{
  double dodecahedron[12][3], cube[6][3];
  dodecahedron_normals(dodecahedron);
  cube_normals(cube);
  memset(out, 0, sizeof *out);
  out->kind = kind;
  out->kappa = form_kappa(kind);
  switch (kind) {
  case FORM_TORUS:
  case FORM_HALF_TURN:
  case FORM_KLEIN:
  case FORM_HANTZSCHE_WENDT: form_flat(kind, shape->size, out); break;
  case FORM_POINCARE: form_solid(1, dodecahedron, 12, 2 * M_PI / 3, M_PI / 5, false, out); break;
  case FORM_QUATERNIONIC: form_solid(1, cube, 6, 2 * M_PI / 3, M_PI / 2, false, out); break;
  case FORM_LENS:
    if (!form_lens(shape->p, shape->q, out)) return false;
    break;
  case FORM_SEIFERT_WEBER: form_solid(-1, dodecahedron, 12, 2 * M_PI / 5, 3 * M_PI / 5, false, out); break;
  case FORM_RIGHT_ANGLED: form_solid(-1, dodecahedron, 12, M_PI / 2, 0, true, out); break;
  case FORM_CUBES: form_solid(-1, cube, 6, 2 * M_PI / 5, 0, false, out); break;
  case FORM_KINDS: return false;
  }
  form_find_corners(out);
  form_find_partners(out);
  return out->face_count > 1;
}

// --- proofs ---------------------------------------------------------------------------------------

static Vec4_d chart_point(int kappa, const double k[3])
{
  const double w = 1 / sqrt(1 + kappa * (k[0] * k[0] + k[1] * k[1] + k[2] * k[2]));
  return (Vec4_d){{k[0] * w, k[1] * w, k[2] * w, w}};
}

// The other face at the edge between two points.
static int edge_neighbour(const SpaceForm *f, int face, const Vec4_d *a, const Vec4_d *b)
{
  int best = -1;
  double least = INFINITY;
  for (int i = 0; i < f->face_count; i++) {
    if (i == face) continue;
    const double off = fabs(pair4_d(&f->faces[i].plane, a)) + fabs(pair4_d(&f->faces[i].plane, b));
    if (off >= least) continue;
    least = off;
    best = i;
  }
  return best;
}

static double plane_angle(int kappa, const Vec4_d *a, const Vec4_d *b)
{
  return acos(fmax(fmin(-dot4_d(kappa, a, b), 1), -1));
}

// Around the edge until the first face is met again at the same place. The maps of mirrors need the way round that brings
// their product home, so it goes on, for them alone, until it does.
FormCycle form_cycle(const SpaceForm *form, int face, int corner)
{
  const FormFace *start = &form->faces[face];
  const Vec4_d first = chart_point(form->kappa, start->corners[corner]);
  const Vec4_d second = chart_point(form->kappa, start->corners[(corner + 1) % start->corner_count]);
  const Mat4_d one = isometry_identity();
  FormCycle c = {.product = one};
  int at = face;
  for (int turn = 0; turn < 64; turn++) {
    const FormFace *f = &form->faces[at];
    c.product = isometry_product(&f->map, &c.product);
    c.length++;
    const Vec4_d a = mat4_apply_d(&c.product, &first), b = mat4_apply_d(&c.product, &second);
    at = edge_neighbour(form, f->partner, &a, &b);
    c.angle += plane_angle(form->kappa, &form->faces[f->partner].plane, &form->faces[at].plane);
    const bool is_home = at == face && point_distance(form->kappa, &a, &first) + point_distance(form->kappa, &b, &second) < 1e-6;
    if (is_home && (form_is_manifold(form->kind) || isometry_distance(&c.product, &one) < 1e-6)) break;
  }
  return c;
}

void form_faces_d(const SpaceForm *form, Face_d *faces)
{
  for (int i = 0; i < form->face_count; i++) faces[i] = (Face_d){form->faces[i].plane, form->faces[i].map};
}

void form_faces_f(const SpaceForm *form, Face_f *faces)
{
  for (int i = 0; i < form->face_count; i++)
    for (int k = 0; k < 4; k++) {
      faces[i].plane.v[k] = (float)form->faces[i].plane.v[k];
      for (int l = 0; l < 4; l++) faces[i].map.m[k][l] = (float)form->faces[i].map.m[k][l];
    }
}

bool form_contains(const SpaceForm *form, const double k[3])
{
  for (int i = 0; i < form->face_count; i++)
    if (plane_height(&form->faces[i].plane, k) > 0) return false;
  return true;
}

// Points of a box of the chart, each for (1 + kappa k k)^-2 of volume.
double form_volume(const SpaceForm *form, uint32_t samples)
{
  double half = 0, sum = 0;
  for (int i = 0; i < form->face_count; i++)
    for (int c = 0; c < form->faces[i].corner_count; c++)
      for (int k = 0; k < 3; k++) half = fmax(half, fabs(form->faces[i].corners[c][k]));
  for (uint32_t i = 0; i < samples; i++) {
    const uint32_t h = hash_combine(0x70c0, i);
    const double k[3] = {half * (2 * (double)unit_float(hash_combine(h, 0)) - 1),
                         half * (2 * (double)unit_float(hash_combine(h, 1)) - 1),
                         half * (2 * (double)unit_float(hash_combine(h, 2)) - 1)};
    if (!form_contains(form, k)) continue;
    const double w = 1 + form->kappa * (k[0] * k[0] + k[1] * k[1] + k[2] * k[2]);
    sum += 1 / (w * w);
  }
  return sum * 8 * half * half * half / samples;
}
