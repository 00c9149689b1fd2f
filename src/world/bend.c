#include "world/bend.h"

#include "base/mem.h"

#include <string.h>

bool bend_at(float kappa, const Frame *pose, Bend *out)
{
  const int sign = kappa > 0 ? 1 : -1;
  const double rho = 1 / sqrt(fabs((double)kappa));
  const Vec3 p = pose->p;
  const double r = sqrt((double)p[0] * p[0] + (double)p[1] * p[1] + (double)p[2] * p[2]);
  if (sign < 0 && !(r < rho)) return false;
  const double n[3] = {r > 0 ? p[0] / r : 1, r > 0 ? p[1] / r : 0, r > 0 ? p[2] / r : 0};
  const double length = sign > 0 ? atan(r / rho) : atanh(r / rho);
  const Mat4_d there = isometry_move(sign, n, length);
  const Mat4_d turn = {{{pose->x[0], pose->y[0], pose->z[0], 0},
                        {pose->x[1], pose->y[1], pose->z[1], 0},
                        {pose->x[2], pose->y[2], pose->z[2], 0},
                        {0, 0, 0, 1}}};
  *out = (Bend){sign, rho, isometry_product(&there, &turn)};
  return true;
}

// A point of a chart in metres, as a ray through the space: not normalised, which charts do not need.
static Vec4_d lift(const Bend *b, const double p[3]) { return (Vec4_d){{p[0] / b->rho, p[1] / b->rho, p[2] / b->rho, 1}}; }

static bool move_point(const Bend *b, const double p[3], double out[3])
{
  const Vec4_d x = lift(b, p), y = mat4_apply_d(&b->place, &x);
  const double square = x.v[0] * x.v[0] + x.v[1] * x.v[1] + x.v[2] * x.v[2];
  if ((b->kappa < 0 && square >= 1) || !(y.v[3] > 1e-9 * sqrt(1 + square))) return false;
  for (int k = 0; k < 3; k++) out[k] = b->rho * y.v[k] / y.v[3];
  return true;
}

bool bend_point(const Bend *b, Vec3 p, Vec3 *out)
{
  const double from[3] = {p[0], p[1], p[2]};
  double to[3];
  if (!move_point(b, from, to)) return false;
  *out = v3((float)to[0], (float)to[1], (float)to[2]);
  return true;
}

float bend_extent(float kappa, float length)
{
  const double root = sqrt(fabs((double)kappa)), x = root * (double)length;
  return (float)(kappa > 0 ? tan(x) / root : kappa < 0 ? tanh(x) / root : (double)length);
}

// --- meshes ---------------------------------------------------------------------------------------

static void *copy_array(const void *from, size_t count, size_t size, bool *ok)
{
  if (!from || !count) return NULL;
  void *to = mem_alloc(count, size);
  if (to) memcpy(to, from, count * size);
  *ok &= to != NULL;
  return to;
}

// The covector of the plane through a place with this normal, carried along: its first three numbers are the normal there.
static void move_normal(const Bend *b, const Mat4_d *back, const double p[3], const float n[3], float out[3])
{
  const Vec4_d x = lift(b, p);
  const double plane[4] = {n[0], n[1], n[2], -(n[0] * x.v[0] + n[1] * x.v[1] + n[2] * x.v[2])};
  double moved[3] = {0}, square = 0;
  for (int k = 0; k < 3; k++) {
    for (int i = 0; i < 4; i++) moved[k] += plane[i] * back->m[i][k];
    square += moved[k] * moved[k];
  }
  for (int k = 0; k < 3; k++) out[k] = (float)(moved[k] / sqrt(square > 0 ? square : 1));
}

static bool move_vertices(const Bend *b, const MeshData *m, const Frame *own, MeshData *to)
{
  const Mat4_d back = isometry_inverse(b->kappa, &b->place);
  const Frame inverse = frame_inverse(own);
  for (size_t i = 0; i < m->vertex_count; i++) {
    const Vec3 at = frame_point(own, v3_load(m->positions + 3 * i));
    const double p[3] = {at[0], at[1], at[2]};
    double moved[3];
    if (!move_point(b, p, moved)) return false;
    for (int k = 0; k < 3; k++) to->positions[3 * i + (size_t)k] = (float)moved[k];
    if (!to->normals) continue;
    const Vec3 n = v3_normalize(frame_normal(&inverse, v3_load(m->normals + 3 * i)));
    const float from[3] = {n[0], n[1], n[2]};
    move_normal(b, &back, p, from, to->normals + 3 * i);
  }
  return true;
}

// A mirroring map turns triangles over, whose outside is by their winding.
static void turn_over(MeshData *m)
{
  for (size_t i = 0; i < m->triangle_count; i++) {
    const uint32_t t = m->triangles[3 * i + 1];
    m->triangles[3 * i + 1] = m->triangles[3 * i + 2];
    m->triangles[3 * i + 2] = t;
  }
}

MeshData *bend_mesh(const Bend *b, const MeshData *m, const Frame *own, Err *err)
{
  MeshData *to = mesh_data_create();
  bool ok = to != NULL;
  if (ok) {
    to->vertex_count = m->vertex_count;
    to->triangle_count = m->triangle_count;
    to->positions = copy_array(m->positions, m->vertex_count, 3 * sizeof(float), &ok);
    to->normals = copy_array(m->normals, m->vertex_count, 3 * sizeof(float), &ok);
    for (int i = 0; i < 2; i++) to->texcoords[i] = copy_array(m->texcoords[i], m->vertex_count, 2 * sizeof(float), &ok);
    to->colors = copy_array(m->colors, m->vertex_count, 4 * sizeof(float), &ok);
    to->triangles = copy_array(m->triangles, m->triangle_count, 3 * sizeof(uint32_t), &ok);
    to->material_slots = copy_array(m->material_slots, m->triangle_count, sizeof(uint16_t), &ok);
  }
  if (!ok) {
    err_set(err, ERR_NO_MEMORY, "not enough memory for a mesh of %zu vertices in a curved cell", m->vertex_count);
  } else if (!move_vertices(b, m, own, to)) {
    ok = err_set(err, ERR_BAD_SCENE, "part of it is beyond the end of its cell's chart; make it smaller, or the cell's radius larger");
  } else if (frame_determinant(own) < 0) {
    turn_over(to);
  }
  if (ok) return to;
  mesh_data_release(to);
  return NULL;
}

static MeshData *mesh_make(size_t vertices, size_t triangles)
{
  MeshData *m = mesh_data_create();
  if (!m) return NULL;
  m->vertex_count = vertices;
  m->triangle_count = triangles;
  m->positions = mem_zero(vertices, 3 * sizeof(float));
  m->texcoords[0] = mem_zero(vertices, 2 * sizeof(float));
  m->triangles = mem_zero(triangles, 3 * sizeof(uint32_t));
  if (m->positions && m->texcoords[0] && m->triangles) return m;
  mesh_data_release(m);
  return NULL;
}

static void set_vertex(MeshData *m, size_t i, float x, float y, float z, float u, float v)
{
  const float p[3] = {x, y, z}, uv[2] = {u, v};
  memcpy(m->positions + 3 * i, p, sizeof p);
  memcpy(m->texcoords[0] + 2 * i, uv, sizeof uv);
}

static void set_triangle(MeshData *m, size_t i, uint32_t a, uint32_t b, uint32_t c)
{
  const uint32_t t[3] = {a, b, c};
  memcpy(m->triangles + 3 * i, t, sizeof t);
}

MeshData *bend_quad(float half_x, float half_y)
{
  MeshData *m = mesh_make(4, 2);
  if (!m) return NULL;
  for (uint32_t i = 0; i < 4; i++) {
    const float u = i == 1 || i == 2, v = i >= 2;
    set_vertex(m, i, (2 * u - 1) * half_x, (2 * v - 1) * half_y, 0, u, v);
  }
  set_triangle(m, 0, 0, 1, 2);
  set_triangle(m, 1, 0, 2, 3);
  return m;
}

enum { DISK_SIDES = 128, BALL_ROWS = 24, BALL_COLUMNS = 48 };

MeshData *bend_disk(float radius)
{
  MeshData *m = mesh_make(DISK_SIDES + 1, DISK_SIDES);
  if (!m) return NULL;
  set_vertex(m, DISK_SIDES, 0, 0, 0, 0.5f, 0.5f);
  for (uint32_t i = 0; i < DISK_SIDES; i++) {
    float s, c;
    f_sincos(2 * PI * (float)i / DISK_SIDES, &s, &c);
    set_vertex(m, i, radius * c, radius * s, 0, 0.5f + 0.5f * c, 0.5f + 0.5f * s);
    set_triangle(m, i, DISK_SIDES, i, (i + 1) % DISK_SIDES);
  }
  return m;
}

MeshData *bend_ball(float kappa, float radius)
{
  const uint32_t around = BALL_COLUMNS + 1;
  MeshData *m = mesh_make((BALL_ROWS + 1) * around, 2 * BALL_ROWS * BALL_COLUMNS);
  const float r = bend_extent(kappa, radius);
  size_t t = 0;
  if (!m) return NULL;
  for (uint32_t row = 0; row <= BALL_ROWS; row++)
    for (uint32_t col = 0; col < around; col++) {
      float s, c, sine, cosine;
      const float v = (float)row / BALL_ROWS, u = (float)col / BALL_COLUMNS;
      f_sincos(PI * v, &s, &c);
      f_sincos(2 * PI * u, &sine, &cosine);
      set_vertex(m, row * around + col, r * s * sine, -r * c, r * s * cosine, u, v);
      if (row == BALL_ROWS || col == BALL_COLUMNS) continue;
      const uint32_t a = row * around + col;
      set_triangle(m, t++, a, a + 1, a + around + 1);
      set_triangle(m, t++, a, a + around + 1, a + around);
    }
  return m;
}

// --- balls ----------------------------------------------------------------------------------------

// With the ball's centre at distance d from the cell's, along the way there it reaches from d - r to d + r. Across it is
// as wide as <X,C>^2 = cos^2 r <X,X> says in the middle between those (worlds.md, section 2.2, quadrics).
bool bend_sphere(const Bend *b, Vec3 centre, float radius, Frame *world_from_object)
{
  Vec3 at;
  if (!bend_point(b, centre, &at)) return false;
  const double x = (double)v3_length(at) / b->rho, r = (double)radius / b->rho;
  const double d = b->kappa > 0 ? atan(x) : atanh(fmin(x, 1 - 1e-12));
  if (b->kappa > 0 && d + r > 1.5) return false; // a quarter of the way round is the end of the chart
  const double far = b->kappa > 0 ? tan(d + r) : tanh(d + r), near = b->kappa > 0 ? tan(d - r) : tanh(d - r);
  const double middle = 0.5 * (far + near), along = 0.5 * (far - near);
  double across;
  if (b->kappa > 0) {
    const double c = (middle * sin(d) + cos(d)) / cos(r);
    across = sqrt(fmax(c * c - middle * middle - 1, 0));
  } else {
    const double c = (cosh(d) - middle * sinh(d)) / cosh(r);
    across = sqrt(fmax(1 - middle * middle - c * c, 0));
  }
  const Vec3 n = x > 0 ? at / v3_length(at) : v3(0, 0, 1);
  const float wide = (float)(across * b->rho), more = (float)((along - across) * b->rho);
  Vec3 column[3];
  for (int k = 0; k < 3; k++) { // the ball is turned as its object is
    const Vec3 axis = v3((float)b->place.m[0][k], (float)b->place.m[1][k], (float)b->place.m[2][k]);
    const Vec3 unit = v3_normalize(axis - ((float)b->place.m[3][k] / (1 + (float)b->place.m[3][3])) *
                                              v3((float)b->place.m[0][3], (float)b->place.m[1][3], (float)b->place.m[2][3]));
    column[k] = wide * unit + (more * v3_dot(n, unit)) * n;
  }
  *world_from_object = (Frame){column[0], column[1], column[2], n * (float)(middle * b->rho)};
  return true;
}
