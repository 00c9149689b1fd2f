// See sdf_mesh.h.

#include "geom/sdf_mesh.h"

#include "geom/sdf_surface.h"

typedef struct Grid {
  const Sdf *sdf;
  SdfMesh *mesh;
  double lo[3], width; // of the first corner, and of a cell
  size_t size[3];      // cells
  bool *inside;        // of the corners, one more along each axis
  uint32_t *vertex;    // of the cells; NO_HIT: the surface does not go through
} Grid;

void sdf_mesh_finish(SdfMesh *m)
{
  array_finish(&m->vertices);
  array_finish(&m->triangles);
}

static size_t corner_index(const Grid *g, const size_t at[3])
{
  return (at[2] * (g->size[1] + 1) + at[1]) * (g->size[0] + 1) + at[0];
}

static size_t cell_index(const Grid *g, const size_t at[3])
{
  return (at[2] * g->size[1] + at[1]) * g->size[0] + at[0];
}

static void corner_place(const Grid *g, const size_t at[3], double p[3])
{
  for (int k = 0; k < 3; k++) p[k] = g->lo[k] + g->width * (double)at[k];
}

static double value(const Grid *g, const double p[3])
{
  const SdfLeaf *leaf = sdf_leaf_at(g->sdf, p);
  const Num4 at[3] = {num4_set(p[0]), num4_set(p[1]), num4_set(p[2])};
  return sdf_run_d(g->sdf, g->sdf->codes + leaf->first, leaf->count, at, NULL)[0];
}

static bool is_inside(const Grid *g, const double p[3])
{
  const float at[3] = {(float)p[0], (float)p[1], (float)p[2]};
  SdfPlace place;
  sdf_place(g->sdf, at, &place);
  return place.leaf ? value(g, p) < 0 : place.clear < 0;
}

// Where the field is 0 between an inside and an outside: 12 steps of Illinois' secant.
static void cross(const Grid *g, const double in[3], const double out[3], double p[3])
{
  double a = 0, b = 1, va = value(g, in), vb = value(g, out);
  double t = 0.5;
  int last = 0;
  if (!(va < 0) || !(vb > 0)) va = -1, vb = 1; // 0 at a corner
  for (int i = 0; i < 12; i++) {
    t = a + (b - a) * fmin(fmax(va / (va - vb), 0.01), 0.99);
    for (int k = 0; k < 3; k++) p[k] = in[k] + t * (out[k] - in[k]);
    const double v = value(g, p);
    if (v < 0) {
      if (last < 0) vb /= 2;
      a = t, va = v, last = -1;
    } else {
      if (last > 0) va /= 2;
      b = t, vb = v, last = 1;
      if (v == 0) return;
    }
  }
}

// What planes a cell has seen: sums of n n^T and of n (n . p), about the mean of the places.
typedef struct Planes {
  double p[12][3], n[12][3];
  int count;
} Planes;

static double minor3(const double m[3][3], int i, int j)
{
  const int r0 = (i + 1) % 3, r1 = (i + 2) % 3, c0 = (j + 1) % 3, c1 = (j + 2) % 3;
  return m[r0][c0] * m[r1][c1] - m[r0][c1] * m[r1][c0];
}

// Least squares of the distances to all planes, drawn a little to the mean, so that a flat surface has one answer.
static void meet(const Planes *s, const double lo[3], double width, double x[3])
{
  double mean[3] = {0}, m[3][3] = {{0}}, b[3] = {0};
  for (int i = 0; i < s->count; i++)
    for (int k = 0; k < 3; k++) mean[k] += s->p[i][k] / s->count;
  for (int i = 0; i < s->count; i++) {
    double away = 0;
    for (int k = 0; k < 3; k++) away += s->n[i][k] * (s->p[i][k] - mean[k]);
    for (int k = 0; k < 3; k++) {
      b[k] += s->n[i][k] * away;
      for (int l = 0; l < 3; l++) m[k][l] += s->n[i][k] * s->n[i][l];
    }
  }
  for (int k = 0; k < 3; k++) m[k][k] += 0.02 * s->count;
  const double det = m[0][0] * minor3(m, 0, 0) + m[0][1] * minor3(m, 0, 1) + m[0][2] * minor3(m, 0, 2);
  for (int k = 0; k < 3; k++) {
    const double off = (minor3(m, 0, k) * b[0] + minor3(m, 1, k) * b[1] + minor3(m, 2, k) * b[2]) / det;
    x[k] = fmin(fmax(mean[k] + off, lo[k]), lo[k] + width);
  }
}

static void see_edge(const Grid *g, const size_t a[3], const size_t b[3], Planes *s)
{
  const bool in_a = g->inside[corner_index(g, a)], in_b = g->inside[corner_index(g, b)];
  double pa[3], pb[3];
  if (in_a == in_b) return;
  corner_place(g, a, pa);
  corner_place(g, b, pb);
  double *p = s->p[s->count];
  cross(g, in_a ? pa : pb, in_a ? pb : pa, p);
  const Vec3 n = v3_normalize(sdf_normal(g->sdf, sdf_leaf_at(g->sdf, p), p));
  for (int k = 0; k < 3; k++) s->n[s->count][k] = (double)n[k];
  s->count++;
}

static bool add_vertex(Grid *g, const size_t at[3], Err *err)
{
  Planes s = {.count = 0};
  double lo[3], x[3];
  uint32_t *index = &g->vertex[cell_index(g, at)];
  *index = NO_HIT;
  for (int axis = 0; axis < 3; axis++)
    for (size_t e = 0; e < 4; e++) {
      size_t a[3] = {at[0], at[1], at[2]}, b[3];
      a[(axis + 1) % 3] += e & 1;
      a[(axis + 2) % 3] += e >> 1;
      for (int k = 0; k < 3; k++) b[k] = a[k] + (k == axis);
      see_edge(g, a, b, &s);
    }
  if (!s.count) return true;
  corner_place(g, at, lo);
  meet(&s, lo, g->width, x);
  const Vec3 n = v3_normalize(sdf_normal(g->sdf, sdf_leaf_at(g->sdf, x), x));
  const SdfMeshVertex v = {{(float)x[0], (float)x[1], (float)x[2]}, {n[0], n[1], n[2]}};
  *index = (uint32_t)g->mesh->vertices.count;
  return array_push(&g->mesh->vertices, v) || err_memory(err, "the mesh of a field", sizeof v * g->mesh->vertices.count);
}

// The quad across the edge from corner `at` along an axis, facing from inside to outside.
static bool add_quad(Grid *g, const size_t at[3], int axis, Err *err)
{
  const size_t to[3] = {at[0] + (axis == 0), at[1] + (axis == 1), at[2] + (axis == 2)};
  const bool in = g->inside[corner_index(g, at)], in_to = g->inside[corner_index(g, to)];
  static const size_t back[4][2] = {{1, 1}, {0, 1}, {0, 0}, {1, 0}}; // around the axis, anticlockwise
  uint32_t v[4];
  if (in == in_to) return true;
  for (int i = 0; i < 4; i++) {
    size_t cell[3] = {at[0], at[1], at[2]};
    cell[(axis + 1) % 3] -= back[i][0];
    cell[(axis + 2) % 3] -= back[i][1];
    v[in ? i : 3 - i] = g->vertex[cell_index(g, cell)];
  }
  const uint32_t six[6] = {v[0], v[1], v[2], v[0], v[2], v[3]};
  for (int i = 0; i < 6; i++)
    if (!array_push(&g->mesh->triangles, six[i])) return err_memory(err, "the mesh of a field", 4 * g->mesh->triangles.count);
  return true;
}

static bool fill(Grid *g, Err *err)
{
  size_t at[3];
  for (at[2] = 0; at[2] <= g->size[2]; at[2]++)
    for (at[1] = 0; at[1] <= g->size[1]; at[1]++)
      for (at[0] = 0; at[0] <= g->size[0]; at[0]++) {
        double p[3];
        corner_place(g, at, p);
        g->inside[corner_index(g, at)] = is_inside(g, p);
      }
  for (at[2] = 0; at[2] < g->size[2]; at[2]++)
    for (at[1] = 0; at[1] < g->size[1]; at[1]++)
      for (at[0] = 0; at[0] < g->size[0]; at[0]++)
        if (!add_vertex(g, at, err)) return false;
  // The outermost corners are outside, so an edge that is crossed has cells all around.
  for (at[2] = 1; at[2] < g->size[2]; at[2]++)
    for (at[1] = 1; at[1] < g->size[1]; at[1]++)
      for (at[0] = 1; at[0] < g->size[0]; at[0]++)
        for (int axis = 0; axis < 3; axis++)
          if (!add_quad(g, at, axis, err)) return false;
  return true;
}

bool sdf_mesh_make(SdfMesh *m, const Sdf *f, uint32_t side, Err *err)
{
  Grid g = {.sdf = f, .mesh = m};
  const Vec3 extent = f->bounds.hi - f->bounds.lo;
  g.width = (double)v3_max_lane(extent) / (side < 8 ? 8 : side > SDF_MESH_MOST ? SDF_MESH_MOST : side);
  size_t corners = 1, cells = 1;
  for (int k = 0; k < 3; k++) {
    g.size[k] = (size_t)ceil((double)extent[k] / g.width) + 3; // more than a cell to spare on each side
    g.lo[k] = ((double)f->bounds.lo[k] + (double)f->bounds.hi[k]) / 2 - g.width * (double)g.size[k] / 2;
    corners *= g.size[k] + 1;
    cells *= g.size[k];
  }
  g.inside = mem_alloc(corners, sizeof *g.inside);
  g.vertex = mem_alloc(cells, sizeof *g.vertex);
  const bool ok = g.inside && g.vertex ? fill(&g, err) : err_memory(err, "the mesh of a field", 5 * cells);
  mem_free(g.inside);
  mem_free(g.vertex);
  if (!ok) sdf_mesh_finish(m);
  return ok;
}
