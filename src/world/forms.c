// The faces of cells that are finite spaces: walls of space that lead to each other, by the maps of space/form.h, and beams
// along the edges where they meet, as one mesh.

#include "space/form.h"
#include "scene/gates.h"
#include "world/prepare.h"

#include <string.h>

// The form of a cell; false: it has none.
static bool form_of(const Cell *c, FormKind *kind, FormShape *shape)
{
  static const FormKind flat[] = {0, FORM_TORUS, FORM_HALF_TURN, FORM_KLEIN, FORM_HANTZSCHE_WENDT};
  static const FormKind spherical[] = {FORM_POINCARE, FORM_QUATERNIONIC, FORM_LENS};
  static const FormKind hyperbolic[] = {FORM_SEIFERT_WEBER, FORM_RIGHT_ANGLED, FORM_CUBES};
  *shape = (FormShape){0};
  switch ((CellKind)c->kind) {
  case CELL_FLAT:
    for (int k = 0; k < 3; k++) shape->size[k] = (double)c->flat.size[k];
    *kind = flat[c->flat.space];
    return c->flat.space != FLAT_NONE;
  case CELL_SPHERICAL:
    shape->p = c->spherical.p;
    shape->q = c->spherical.q;
    *kind = spherical[c->spherical.space];
    return true;
  case CELL_HYPERBOLIC: *kind = hyperbolic[c->hyperbolic.space]; return true;
  }
  unreachable();
}

static double unit_of(const Cell *c)
{
  return c->kind == CELL_FLAT ? 1 : c->kind == CELL_SPHERICAL ? (double)c->spherical.radius : (double)c->hyperbolic.radius;
}

// --- walls ----------------------------------------------------------------------------------------
static bool fill_face(Prepare *p, const Cell *c, uint32_t cell, const FormFace *face, uint32_t first, SpaceGate *out)
{
  const double *n = face->plane.v, length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  GateSide side = {.map = frame_identity(), .scale = 1, .cell = cell, .gate = first + (uint32_t)face->partner};
  const double (*m)[4] = face->map.m;
  if (c->kind == CELL_FLAT) {
    Vec3 *column[4] = {&side.map.x, &side.map.y, &side.map.z, &side.map.p};
    for (int k = 0; k < 4; k++) *column[k] = v3((float)m[0][k], (float)m[1][k], (float)m[2][k]);
    side.is_shift = m[0][0] == 1 && m[1][1] == 1 && m[2][2] == 1;
  } else {
    GateCurve *curve = arena_alloc(&p->world->arena, 1, sizeof *curve);
    if (!curve) return prepare_failed_memory(p);
    *curve = (GateCurve){.kappa = cell_curvature(c), .kappa_to = cell_curvature(c)};
    for (int i = 0; i < 4; i++)
      for (int k = 0; k < 4; k++) curve->map.m[i][k] = (float)m[i][k];
    side.curve = curve;
  }
  // The front of a wall faces into the cell.
  const Vec3 inward = v3((float)(-n[0] / length), (float)(-n[1] / length), (float)(-n[2] / length));
  *out = (SpaceGate){.side = {side, {.cell = NO_CELL, .gate = NO_GATE, .map = frame_identity(), .scale = 1}},
                     .own_from_cell = frame_identity(), .n = inward, .c = (float)(n[3] / length * unit_of(c)),
                     .is_wall = true, .cell = cell, .instance = NO_HIT};
  return true;
}

// --- beams ----------------------------------------------------------------------------------------
enum { BEAM_SIDES = 16, BEAM_PARTS = 12, BEAM_VERTICES = (BEAM_SIDES + 1) * (BEAM_PARTS + 1) };

static Vec4_d chart_place(const SpaceForm *f, const double k[3])
{
  const double w = 1 / sqrt(1 + f->kappa * (k[0] * k[0] + k[1] * k[1] + k[2] * k[2]));
  return (Vec4_d){{k[0] * w, k[1] * w, k[2] * w, w}};
}

// Two unit vectors across a geodesic, which stay the same vectors all along it.
static void across(int kappa, const Geodesic_d *g, Vec4_d out[2])
{
  int found = 0;
  for (int axis = 0; axis < 3 && found < 2; axis++) {
    Vec4_d v = {{axis == 0, axis == 1, axis == 2, 0}};
    if (kappa) v = mix4_d(1, &v, -kappa * dot4_d(kappa, &v, &g->p), &g->p);
    v = mix4_d(1, &v, -dot4_d(kappa, &v, &g->v), &g->v);
    if (found) v = mix4_d(1, &v, -dot4_d(kappa, &v, &out[0]), &out[0]);
    const double square = dot4_d(kappa, &v, &v);
    if (square < 0.01) continue;
    out[found++] = mix4_d(1 / sqrt(square), &v, 0, &v);
  }
}

// What is everywhere as far from an edge.
static void put_beam(const SpaceForm *f, const double a[3], const double b[3], double radius, double unit, MeshData *m,
                     size_t beam)
{
  const Vec4_d from = chart_place(f, a), to = chart_place(f, b);
  const double length = point_distance(f->kappa, &from, &to);
  for (uint32_t part = 0; part <= BEAM_PARTS; part++) {
    Geodesic_d g = geodesic_between(f->kappa, &from, &to);
    geodesic_go(f->kappa, length * part / BEAM_PARTS, &g);
    Vec4_d side[2];
    across(f->kappa, &g, side);
    for (uint32_t k = 0; k <= BEAM_SIDES; k++) {
      const size_t i = beam * BEAM_VERTICES + part * (BEAM_SIDES + 1) + k;
      const double turn = 2 * M_PI * k / BEAM_SIDES;
      Geodesic_d out = {g.p, mix4_d(cos(turn), &side[0], sin(turn), &side[1])};
      geodesic_go(f->kappa, radius, &out);
      const Vec4_d plane = plane_through(f->kappa, &out.p, &out.v);
      const double n = sqrt(plane.v[0] * plane.v[0] + plane.v[1] * plane.v[1] + plane.v[2] * plane.v[2]);
      for (int c = 0; c < 3; c++) {
        m->positions[3 * i + (size_t)c] = (float)(unit * out.p.v[c] / out.p.v[3]);
        m->normals[3 * i + (size_t)c] = (float)(plane.v[c] / n);
      }
      m->texcoords[0][2 * i] = (float)(length * unit * part / BEAM_PARTS);
      m->texcoords[0][2 * i + 1] = (float)k / BEAM_SIDES;
    }
  }
  uint32_t *t = m->triangles + 6 * beam * BEAM_PARTS * BEAM_SIDES;
  for (uint32_t part = 0; part < BEAM_PARTS; part++)
    for (uint32_t k = 0; k < BEAM_SIDES; k++, t += 6) {
      const uint32_t at = (uint32_t)(beam * BEAM_VERTICES) + part * (BEAM_SIDES + 1) + k, up = at + BEAM_SIDES + 1;
      const uint32_t two[6] = {at, at + 1, up + 1, at, up + 1, up};
      memcpy(t, two, sizeof two);
    }
}

// Each edge is the side of two faces; the second has its ends the other way round.
static bool is_first_side(const SpaceForm *f, int face, const double a[3], const double b[3])
{
  for (int i = 0; i < face; i++)
    for (int c = 0; c < f->faces[i].corner_count; c++) {
      const double *x = f->faces[i].corners[c], *y = f->faces[i].corners[(c + 1) % f->faces[i].corner_count];
      double same = 0, other = 0;
      for (int k = 0; k < 3; k++) {
        same = fmax(same, fmax(fabs(x[k] - a[k]), fabs(y[k] - b[k])));
        other = fmax(other, fmax(fabs(x[k] - b[k]), fabs(y[k] - a[k])));
      }
      if (same < 1e-6 || other < 1e-6) return false;
    }
  return true;
}

static MeshData *beam_mesh(const SpaceForm *f, double radius, double unit)
{
  size_t most = 0, count = 0;
  for (int i = 0; i < f->face_count; i++) most += (size_t)f->faces[i].corner_count;
  MeshData *m = mesh_data_create();
  if (!m) return NULL;
  m->positions = mem_zero(most * BEAM_VERTICES, 3 * sizeof(float));
  m->normals = mem_zero(most * BEAM_VERTICES, 3 * sizeof(float));
  m->texcoords[0] = mem_zero(most * BEAM_VERTICES, 2 * sizeof(float));
  m->triangles = mem_zero(2 * most * BEAM_PARTS * BEAM_SIDES, 3 * sizeof(uint32_t));
  if (!m->positions || !m->normals || !m->texcoords[0] || !m->triangles) {
    mesh_data_release(m);
    return NULL;
  }
  for (int i = 0; i < f->face_count; i++)
    for (int c = 0; c < f->faces[i].corner_count; c++) {
      const double *a = f->faces[i].corners[c], *b = f->faces[i].corners[(c + 1) % f->faces[i].corner_count];
      if (is_first_side(f, i, a, b)) put_beam(f, a, b, radius / unit, unit, m, count++);
    }
  m->vertex_count = count * BEAM_VERTICES;
  m->triangle_count = 2 * count * BEAM_PARTS * BEAM_SIDES;
  return m;
}

static bool add_beams(Prepare *p, const Cell *c, uint32_t cell, const SpaceForm *f)
{
  if (!(c->common.beams > 0)) return true;
  if (!f->is_bounded)
    return err_set(p->err, ERR_BAD_SCENE, "cell \"%s\": the edges of this lens space lie at the end of its chart, where no beam "
                   "can be; leave out \"beams\"", c->name);
  if ((double)c->common.beams > 0.5 * f->inner * unit_of(c))
    return err_set(p->err, ERR_BAD_SCENE, "cell \"%s\": beams of %g m fill a cell whose faces are %g m from its middle; make them thinner",
                   c->name, (double)c->common.beams, f->inner * unit_of(c));
  MeshData *m = beam_mesh(f, (double)c->common.beams, unit_of(c));
  uint32_t *slot = arena_alloc(&p->world->arena, 1, sizeof *slot);
  const int32_t part = m && slot ? parts_add_mesh(p->parts, p->previous, m) : -1;
  bool ok = part >= 0;
  if (ok) {
    const int32_t material = c->common.beam_material;
    *slot = material >= 0 ? p->sources.items[0].material_base + (uint32_t)material : UINT32_MAX;
    const Instance i = {.kind = INSTANCE_MESH, .world_from_object = frame_identity(), .mask = RAY_ALL};
    const WorldInstance w = {.mesh = {.positions = m->positions, .normals = m->normals, .texcoords = {m->texcoords[0]},
                                      .triangles = m->triangles},
                             .materials = slot, .slot_count = 1, .object_i = NO_HIT};
    p->cell = cell;
    ok = prepare_add_instance(p, &i, &w, part);
  }
  mesh_data_release(m);
  return ok || prepare_failed_memory(p);
}

// --- the whole ------------------------------------------------------------------------------------
size_t prepare_form_faces(const Prepare *p)
{
  FormKind kind;
  FormShape shape;
  size_t count = 0;
  for (size_t i = 0; i < p->scene->cells.count; i++) count += form_of(&p->scene->cells.items[i], &kind, &shape) ? FORM_MOST_FACES : 0;
  return count;
}

bool prepare_forms(Prepare *p, SpaceGate *gates, size_t *count)
{
  for (size_t i = 0; i < p->scene->cells.count; i++) {
    const Cell *c = &p->scene->cells.items[i];
    FormKind kind;
    FormShape shape;
    SpaceForm form;
    if (!form_of(c, &kind, &shape)) continue;
    if (!form_make(kind, &shape, &form))
      return err_set(p->err, ERR_BAD_SCENE, "cell \"%s\": its numbers make no space", c->name);
    const size_t first = *count;
    for (int f = 0; f < form.face_count; f++)
      if (!fill_face(p, c, (uint32_t)i + 1, &form.faces[f], (uint32_t)first, &gates[(*count)++])) return false;
    if (!add_beams(p, c, (uint32_t)i + 1, &form)) return false;
  }
  return true;
}
