// From a scene's cells and gates to those of a world: apertures become instances of the tree, which rays find like any
// surface; walls are left to space/. Objects that stand in a gate get a second instance on its other side, and both are
// cut where the gate's plane is.

#include "scene/gates.h"
#include "scene/triangulate.h"
#include "world/prepare.h"

enum { MOST_GATES = 16384, MOST_CELLS = 65534 }; // a word of Way has 16 bits a crossing

// --- doors of curved cells ------------------------------------------------------------------------
static float curvature_at(const Prepare *p, const Gate *g)
{
  return g->common.cell < 0 ? 0 : cell_curvature(&p->scene->cells.items[g->common.cell]);
}

static bool place_door(Prepare *p, const Gate *g, Bend *out)
{
  const Frame f = gate_frame(g);
  const float kappa = curvature_at(p, g);
  if (kappa == 0) {
    *out = (Bend){.rho = 1, .place = {{{f.x[0], f.y[0], f.z[0], f.p[0]}, {f.x[1], f.y[1], f.z[1], f.p[1]}, {f.x[2], f.y[2], f.z[2], f.p[2]}, {0, 0, 0, 1}}}};
    return true;
  }
  return bend_at(kappa, &f, out) || err_set(p->err, ERR_BAD_SCENE, "gate \"%s\" is beyond the end of its cell's chart; move it nearer", g->name);
}

static Mat4_f floats(const Mat4_d *m)
{
  Mat4_f out;
  for (int i = 0; i < 4; i++)
    for (int k = 0; k < 4; k++) out.m[i][k] = (float)m->m[i][k];
  return out;
}

static bool fill_door(Prepare *p, const Gate *g, const GateLink *link, GateSide *side)
{
  if (!link->exists || link->gate < 0) return true;
  const Gate *other = &p->scene->gates.items[link->gate];
  const float kappa = curvature_at(p, g), kappa_to = curvature_at(p, other);
  if (kappa == 0 && kappa_to == 0) return true;
  GateCurve *curve = arena_alloc(&p->world->arena, 1, sizeof *curve);
  Bend here, there;
  if (!curve) return prepare_failed_memory(p);
  if (!place_door(p, g, &here) || !place_door(p, other, &there)) return false;
  const Mat4_d back = isometry_inverse(here.kappa, &here.place);
  *curve = (GateCurve){.kappa = kappa, .kappa_to = kappa_to, .map = floats(&back), .is_door = true,
                       .radius_to = bend_extent(kappa_to, other->sphere.radius), .map_to = floats(&there.place)};
  side->curve = curve;
  side->is_null = side->is_shift = side->is_into = false;
  return true;
}

// In the chart a ball is an ellipsoid.
static bool bend_gate(Prepare *p, const Gate *g, Frame *frame)
{
  Bend bend;
  return place_door(p, g, &bend) && (bend_sphere(&bend, v3_all(0), g->sphere.radius, frame) ||
                                     err_set(p->err, ERR_BAD_SCENE, "gate \"%s\" reaches beyond the end of its cell's chart", g->name));
}

// --- apertures ------------------------------------------------------------------------------------
static const uint32_t *default_material(Prepare *p)
{
  uint32_t *slot = arena_alloc(&p->world->arena, 1, sizeof *slot);
  if (slot) *slot = UINT32_MAX; // turned into the default material's index once that is known
  return slot;
}

static MeshData *outline_mesh(Prepare *p, const Points *points)
{
  const uint32_t n = (uint32_t)points->count;
  MeshData *m = mesh_data_create();
  Triangulator t;
  triangulator_init(&t);
  bool ok = m != NULL;
  if (ok) {
    m->positions = mem_alloc(3 * (size_t)n, sizeof(float));
    m->triangles = mem_alloc(3 * (size_t)(n - 2), sizeof(uint32_t));
    m->vertex_count = n;
    m->triangle_count = n - 2;
    ok = m->positions && m->triangles;
  }
  for (uint32_t i = 0; ok && i < n; i++) {
    m->positions[3 * i] = points->xy[2 * i];
    m->positions[3 * i + 1] = points->xy[2 * i + 1];
    m->positions[3 * i + 2] = 0;
  }
  ok = ok && triangulate(&t, m->positions, n, m->triangles);
  triangulator_finish(&t);
  if (ok) return m;
  if (m) mesh_data_release(m);
  prepare_failed_memory(p);
  return NULL;
}

// The arrays of a mesh made here belong to the world's parts.
static bool add_mesh_aperture(Prepare *p, MeshData *m, Instance *i, WorldInstance *w)
{
  const int32_t part = m ? parts_add_mesh(p->parts, p->previous, m) : -1;
  i->kind = INSTANCE_MESH;
  if (m) w->mesh = (TriangleMesh){.positions = m->positions, .triangles = m->triangles};
  return part >= 0 ? prepare_add_instance(p, i, w, part) : prepare_failed_memory(p);
}

static bool add_aperture(Prepare *p, const Gate *g, uint32_t gate_i)
{
  Instance i = {.world_from_object = gate_frame(g), .mask = RAY_ALL};
  WorldInstance w = {.materials = default_material(p), .slot_count = 1, .object_i = NO_HIT, .gate = gate_i + 1};
  if (!w.materials) return prepare_failed_memory(p);
  p->cell = (uint32_t)(g->common.cell + 1);
  switch ((GateKind)g->kind) {
  case GATE_RECT:
    i.kind = INSTANCE_QUAD;
    i.size[0] = g->rect.size[0] / 2;
    i.size[1] = g->rect.size[1] / 2;
    return prepare_add_instance(p, &i, &w, -1);
  case GATE_SPHERE:
    i.kind = INSTANCE_SPHERE;
    i.size[0] = g->sphere.radius;
    if (curvature_at(p, g) != 0) {
      i.size[0] = 1;
      if (!bend_gate(p, g, &i.world_from_object)) return false;
    }
    return prepare_add_instance(p, &i, &w, -1);
  case GATE_WORMHOLE:
  case GATE_BLACK_HOLE:
    i.kind = INSTANCE_SPHERE;
    i.size[0] = g->kind == GATE_WORMHOLE ? g->wormhole.radius : g->black_hole.radius;
    return prepare_add_instance(p, &i, &w, -1);
  case GATE_BOX:
    i.world_from_object.x *= g->box.size[0];
    i.world_from_object.y *= g->box.size[1];
    i.world_from_object.z *= g->box.size[2];
    return prepare_unit_box(p) ? add_mesh_aperture(p, prepare_unit_box(p), &i, &w) : prepare_failed_memory(p);
  case GATE_POLYGON: {
    MeshData *m = outline_mesh(p, g->polygon.points);
    const bool ok = m && add_mesh_aperture(p, m, &i, &w);
    if (m) mesh_data_release(m);
    return ok;
  }
  }
  unreachable();
}

static Aperture aperture_of(const Gate *g)
{
  switch ((GateKind)g->kind) {
  case GATE_RECT: return APERTURE_RECT;
  case GATE_POLYGON: return APERTURE_POLYGON;
  case GATE_BOX: return APERTURE_BOX;
  case GATE_SPHERE:
  case GATE_WORMHOLE:
  case GATE_BLACK_HOLE: return APERTURE_SPHERE;
  }
  unreachable();
}

static GateSide side_of(const Scene *s, const GateLink *link)
{
  GateSide side = {.cell = NO_CELL, .gate = NO_GATE, .map = frame_identity(), .scale = 1};
  if (!link->exists) return side;
  const Frame one = frame_identity();
  side.map = link->map;
  side.cell = (uint32_t)(link->cell + 1);
  side.gate = link->gate >= 0 ? (uint32_t)link->gate : NO_GATE;
  side.scale = v3_length(link->map.x);
  if (fabsf(side.scale - 1) < 1e-6f) side.scale = 1;
  side.is_shift = v3_is_zero(link->map.x - one.x) && v3_is_zero(link->map.y - one.y) && v3_is_zero(link->map.z - one.z);
  side.is_null = side.is_shift && v3_is_zero(link->map.p);
  side.is_into = link->gate >= 0 && !gate_is_flat(&s->gates.items[link->gate]) && link->side == BACK;
  return side;
}

static bool fill_gate(Prepare *p, const Gate *g, const GateLink links[2], SpaceGate *out)
{
  const Frame f = gate_frame(g);
  *out = (SpaceGate){.side = {side_of(p->scene, &links[FRONT]), side_of(p->scene, &links[BACK])},
                     .own_from_cell = frame_inverse(&f), .n = f.z, .c = v3_dot(f.z, f.p), .aperture = (uint8_t)aperture_of(g),
                     .is_wall = g->common.wall, .cell = (uint32_t)(g->common.cell + 1), .instance = NO_HIT};
  switch ((GateKind)g->kind) {
  case GATE_RECT:
    for (int k = 0; k < 2; k++) out->size[k] = g->rect.size[k] / 2;
    return true;
  case GATE_BOX:
    for (int k = 0; k < 3; k++) out->size[k] = g->box.size[k] / 2;
    return true;
  case GATE_SPHERE: {
    Frame bent;
    out->size[0] = g->sphere.radius;
    if (!fill_door(p, g, &links[FRONT], &out->side[FRONT])) return false;
    if (curvature_at(p, g) == 0) return true;
    if (!bend_gate(p, g, &bent)) return false;
    out->size[0] = 1;
    out->own_from_cell = frame_inverse(&bent);
    return true;
  }
  case GATE_WORMHOLE:
  case GATE_BLACK_HOLE: return prepare_ball(p, g, &links[FRONT], out);
  case GATE_POLYGON: {
    const Points *from = g->polygon.points;
    float *xy = arena_alloc(&p->world->arena, 2 * (size_t)from->count, sizeof *xy);
    if (!xy) return prepare_failed_memory(p);
    memcpy(xy, from->xy, 2 * (size_t)from->count * sizeof *xy);
    out->xy = xy;
    out->corner_count = from->count;
    return true;
  }
  }
  unreachable();
}

// --- objects in gates -----------------------------------------------------------------------------------
static uint32_t add_clip(Prepare *p, Vec3 n, float c)
{
  return array_push(&p->clips, ((WorldClip){n, c})) ? (uint32_t)p->clips.count : 0;
}

// The plane of a gate as its map shows it: what was on the side of n stays on the side of n.
static uint32_t add_mapped_clip(Prepare *p, const Frame *map, Vec3 n, Vec3 at)
{
  const Frame back = frame_inverse(map);
  const Vec3 there = v3_normalize(frame_normal(&back, n));
  return add_clip(p, there, v3_dot(there, frame_point(map, at)));
}

static bool split_instance(Prepare *p, size_t index, const Object *o, const Gate *g, const GateLink links[2])
{
  const Frame f = gate_frame(g), own = object_frame(&o->common);
  const int side = v3_dot(f.z, own.p - f.p) >= 0 ? FRONT : BACK;
  const GateLink *link = &links[side];
  if (!link->exists) return true;
  const Vec3 n = side == FRONT ? f.z : -f.z; // to the side the object mostly is on
  if (p->instances.items[index].kind == INSTANCE_CSG)
    return err_set(p->err, ERR_BAD_SCENE, "object \"%s\": a csg cannot stand in a gate; make it a mesh", o->name ? o->name : "");
  Instance copy = p->instances.items[index];
  WorldInstance w = p->shading.items[index];
  p->shading.items[index].clip = add_clip(p, n, v3_dot(n, f.p));
  w.clip = add_mapped_clip(p, &link->map, -n, f.p);
  if (!p->shading.items[index].clip || !w.clip) return prepare_failed_memory(p);
  copy.world_from_object = frame_product(&link->map, &copy.world_from_object);
  p->cell = (uint32_t)(link->cell + 1);
  return prepare_add_instance(p, &copy, &w, p->mesh_parts.items[index]);
}

static bool split_objects(Prepare *p, GateLink (*links)[2])
{
  const Scene *s = p->scene;
  const size_t count = p->instances.count;
  for (size_t i = 0; i < count; i++) {
    const uint32_t object_i = p->shading.items[i].object_i;
    if (object_i >= s->objects.count || s->objects.items[object_i].common.through < 0) continue;
    const Object *o = &s->objects.items[object_i];
    const Gate *g = &s->gates.items[o->common.through];
    if (!gate_is_flat(g) || g->common.cell != o->common.cell)
      return err_set(p->err, ERR_BAD_SCENE, "object \"%s\" cannot go through gate \"%s\", which %s", o->name ? o->name : "", g->name,
                     gate_is_flat(g) ? "stands in another cell" : "is not flat");
    if (!split_instance(p, i, o, g, links[o->common.through])) return false;
  }
  return true;
}

// --- the whole --------------------------------------------------------------------------------------------
bool prepare_cells(Prepare *p)
{
  World *w = p->world;
  const Scene *s = p->scene;
  w->cell_count = s->cells.count + 1;
  w->crossings = s->render.crossings;
  w->fade = s->render.fade;
  w->fade_color = v3_load(s->render.fade_color);
  if (s->gates.count > MOST_GATES || s->cells.count > MOST_CELLS)
    return err_set(p->err, ERR_BAD_SCENE, "more than %d gates or %d cells", MOST_GATES, MOST_CELLS);
  for (size_t k = 1; k < p->sources.count; k++)
    if (p->sources.items[k].scene->gates.count || p->sources.items[k].scene->cells.count)
      return err_set(p->err, ERR_BAD_SCENE, "%s has cells or gates, and stands in another scene as a model; only the scene itself may have them",
                     p->sources.items[k].scene->path ? p->sources.items[k].scene->path : "a model");
  for (size_t c = 0; c < s->cells.count; c++)
    if (s->cells.items[c].kind != CELL_FLAT && s->cells.items[c].common.atmosphere >= 0)
      return err_set(p->err, ERR_BAD_SCENE, "cell \"%s\" is curved and has no atmosphere; \"fade\" in the render settings makes what is "
                     "far fade", s->cells.items[c].name);
  for (size_t c = 0; c < s->cells.count && s->render.integrator == INTEGRATOR_WHITTED; c++)
    if (s->cells.items[c].kind != CELL_FLAT)
      note_once(&w->notes, "the integrator whitted takes light in curved cells for that of flat ones; path and classic do not");
  return cells_check(s, NULL, p->err);
}

static bool fill_walls(Prepare *p, const SpaceGate *gates)
{
  World *w = p->world;
  uint32_t *first = arena_alloc(&w->arena, w->cell_count + 1, sizeof *first), count = 0;
  uint32_t *walls = arena_alloc(&w->arena, w->space.gate_count + 1, sizeof *walls);
  if (!first || !walls) return prepare_failed_memory(p);
  for (uint32_t c = 0; c < w->cell_count; c++) {
    first[c] = count;
    for (uint32_t i = 0; i < w->space.gate_count; i++)
      if (gates[i].is_wall && gates[i].cell == c) walls[count++] = i;
  }
  first[w->cell_count] = count;
  w->space.walls = walls;
  w->space.first_wall = first;
  return true;
}

bool prepare_gates(Prepare *p)
{
  World *w = p->world;
  const Scene *s = p->scene;
  size_t count = s->gates.count;
  SpaceGate *gates = arena_alloc(&w->arena, count + prepare_form_faces(p) + 1, sizeof *gates);
  GateLink(*links)[2] = arena_alloc(&p->scratch, count + 1, sizeof *links);
  if (!gates || !links) return prepare_failed_memory(p);
  if (!gates_link(s, links, NULL, NULL, p->err)) return false;
  for (size_t i = 0; i < count; i++) {
    const Gate *g = &s->gates.items[i];
    if (!fill_gate(p, g, links[i], &gates[i])) return false;
    if (g->common.wall) continue;
    gates[i].instance = (uint32_t)p->instances.count;
    if (!add_aperture(p, g, (uint32_t)i)) return false;
  }
  if (!prepare_forms(p, gates, &count)) return false;
  w->space.gates = gates;
  w->space.gate_count = count;
  return fill_walls(p, gates) && split_objects(p, links);
}
