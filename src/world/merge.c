// See merge.h. Two walks over the instances: one counts, one writes.

#include "world/merge.h"

#include "base/mem.h"
#include "geom/sdf_mesh.h"
#include "world/parts.h"

#include <string.h>

enum { AROUND = 64, DOWN = 32 }; // facets of a sphere; a disk has AROUND

typedef struct Size {
  size_t vertices, triangles;
} Size;

static bool is_light(const World *w, size_t i)
{
  const SurfaceMaterial *m = &w->materials[w->instances[i].materials[0]];
  return accel_instances(w->accel)[i].kind != INSTANCE_MESH && m->kind == SURFACE_EMISSION && m->needs_filter;
}

// The data of each instance that is a mesh: an instance knows the arrays, the parts know whose they are. Found by a
// table, since a world may have as many meshes as instances. NULL: memory is out.
static const MeshData **list_meshes(const World *w)
{
  const WorldParts *parts = w->parts;
  const MeshData **meshes = mem_zero(w->instance_count, sizeof *meshes);
  Table found = {0};
  bool ok = meshes;
  for (size_t k = 0; ok && k < parts->meshes.count; k++)
    ok = table_add(&found, (uintptr_t)parts->meshes.items[k].data->positions, (int32_t)k);
  for (size_t i = 0; ok && i < w->instance_count; i++) {
    size_t step = 0;
    const int32_t *k = table_next(&found, (uintptr_t)w->instances[i].mesh.positions, &step);
    meshes[i] = k ? parts->meshes.items[*k].data : NULL;
  }
  table_finish(&found);
  if (ok) return meshes;
  mem_free(meshes);
  return NULL;
}

static bool has_cap(const Solid *s, double y)
{
  return s->is_closed && s->radius + s->slope * y > 0;
}

static Size solid_size(const Solid *s)
{
  switch ((SolidKind)s->kind) {
  case SOLID_TRIANGLE: return (Size){3, 1};
  case SOLID_TORUS: return (Size){(AROUND + 1) * (DOWN + 1), 2 * AROUND * DOWN};
  case SOLID_ROUND: {
    const size_t caps = (size_t)has_cap(s, s->low) + has_cap(s, s->high);
    return (Size){2 * (AROUND + 1) + caps * (AROUND + 1), 2 * AROUND + caps * AROUND};
  }
  case SOLID_PLANE:
  case SOLID_BOX: return (Size){0};
  }
  unreachable();
}

static Size shape_size(const World *w, size_t i, const MeshData *mesh)
{
  switch ((InstanceKind)accel_instances(w->accel)[i].kind) {
  case INSTANCE_MESH: return (Size){mesh->vertex_count, mesh->triangle_count};
  case INSTANCE_SPHERE: return (Size){(AROUND + 1) * (DOWN + 1), 2 * AROUND * (DOWN - 1)};
  case INSTANCE_QUAD: return (Size){4, 2};
  case INSTANCE_DISK: return (Size){AROUND + 1, AROUND};
  case INSTANCE_SOLID: return solid_size(accel_instances(w->accel)[i].solid);
  case INSTANCE_CSG:
  case INSTANCE_VOXELS:
  case INSTANCE_SDF: return (Size){0}; // has a mesh of its own
  }
  unreachable();
}

typedef struct Merging {
  MeshData *out;
  const Instance *instance;
  bool is_mirrored;
  size_t vertex, triangle; // next to write
} Merging;

static void put_vertex(Merging *m, Vec3 p, Vec3 n, float u, float v)
{
  const size_t i = m->vertex++;
  v3_store(m->out->positions + 3 * i, frame_point(&m->instance->world_from_object, p));
  v3_store(m->out->normals + 3 * i, v3_normalize(frame_normal(&m->instance->object_from_world, n)));
  m->out->texcoords[0][2 * i] = u;
  m->out->texcoords[0][2 * i + 1] = v;
}

static void put_triangle(Merging *m, size_t base, size_t a, size_t b, size_t c)
{
  uint32_t *t = m->out->triangles + 3 * m->triangle++;
  t[0] = (uint32_t)(base + a);
  t[1] = (uint32_t)(base + (m->is_mirrored ? c : b)); // a mirror turns the winding; outside stays outside
  t[2] = (uint32_t)(base + (m->is_mirrored ? b : c));
}

// A mesh without normals gives each vertex the mean of its faces, which viewers of the merged mesh then interpolate.
static void add_face_normals(const MeshData *mesh, float *normals)
{
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    const uint32_t *v = mesh->triangles + 3 * t;
    const Vec3 a = v3_load(mesh->positions + 3 * (size_t)v[0]);
    const Vec3 n = v3_cross(v3_load(mesh->positions + 3 * (size_t)v[1]) - a,
                            v3_load(mesh->positions + 3 * (size_t)v[2]) - a);
    for (int k = 0; k < 3; k++) {
      float *sum = normals + 3 * (size_t)v[k];
      v3_store(sum, v3_load(sum) + n);
    }
  }
}

static bool put_mesh(Merging *m, const MeshData *mesh)
{
  const size_t base = m->vertex;
  float *made = mesh->normals ? NULL : mem_zero(mesh->vertex_count, 3 * sizeof *made);
  if (!mesh->normals && !made) return false;
  if (made) add_face_normals(mesh, made);
  const float *normals = made ? made : mesh->normals, *uv = mesh->texcoords[0];
  for (size_t i = 0; i < mesh->vertex_count; i++)
    put_vertex(m, v3_load(mesh->positions + 3 * i), v3_load(normals + 3 * i), uv ? uv[2 * i] : 0, uv ? uv[2 * i + 1] : 0);
  for (size_t t = 0; t < mesh->triangle_count; t++)
    put_triangle(m, base, mesh->triangles[3 * t], mesh->triangles[3 * t + 1], mesh->triangles[3 * t + 2]);
  mem_free(made);
  return true;
}

static void put_sphere(Merging *m, float radius)
{
  const size_t base = m->vertex, row = AROUND + 1;
  for (int j = 0; j <= DOWN; j++)
    for (int i = 0; i <= AROUND; i++) {
      const double theta = 3.14159265358979323846 * j / DOWN, phi = 2 * 3.14159265358979323846 * i / AROUND;
      const Vec3 n = v3((float)(sin(theta) * sin(phi)), (float)cos(theta), (float)(sin(theta) * cos(phi)));
      put_vertex(m, radius * n, n, (float)i / AROUND, 1 - (float)j / DOWN);
    }
  for (size_t j = 0; j < DOWN; j++)
    for (size_t i = 0; i < AROUND; i++) {
      const size_t a = j * row + i;
      if (j > 0) put_triangle(m, base, a, a + row, a + 1);
      if (j < DOWN - 1) put_triangle(m, base, a + 1, a + row, a + row + 1);
    }
}

static void put_quad(Merging *m, float x, float y)
{
  const size_t base = m->vertex;
  const float corner[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
  for (int k = 0; k < 4; k++)
    put_vertex(m, v3(corner[k][0] * x, corner[k][1] * y, 0), v3(0, 0, 1), corner[k][0] / 2 + 0.5f, corner[k][1] / 2 + 0.5f);
  put_triangle(m, base, 0, 1, 2);
  put_triangle(m, base, 0, 2, 3);
}

static void put_disk(Merging *m, float radius)
{
  const size_t base = m->vertex;
  put_vertex(m, v3_all(0), v3(0, 0, 1), 0.5f, 0.5f);
  for (int i = 0; i < AROUND; i++) {
    const double a = 2 * 3.14159265358979323846 * i / AROUND;
    const float c = (float)cos(a), s = (float)sin(a);
    put_vertex(m, v3(radius * c, radius * s, 0), v3(0, 0, 1), 0.5f + c / 2, 0.5f + s / 2);
  }
  for (size_t i = 0; i < AROUND; i++) put_triangle(m, base, 0, 1 + i, 1 + (i + 1) % AROUND);
}

// The skin where it is turned by i of AROUND about the axis and j of `down` along the side or around the tube.
static void put_turned(Merging *m, const Solid *s, int i, int j, int down)
{
  const double turn = 2 * 3.14159265358979323846 * ((double)i / AROUND - 0.5), x = sin(turn), z = cos(turn);
  double across, y;
  if (s->kind == SOLID_TORUS) {
    const double around = 2 * 3.14159265358979323846 * ((double)j / down - 0.5);
    across = s->size[0] + s->size[1] * cos(around);
    y = s->size[1] * sin(around);
  } else {
    y = j ? s->high : s->low;
    across = s->radius + s->slope * y;
  }
  const double p[3] = {across * x, y, across * z};
  const double near_tip[3] = {x, s->radius / -s->slope + 1 / s->slope, z}; // a cone's normal does not depend on the height
  const bool is_tip = s->kind == SOLID_ROUND && !(across > 0);
  put_vertex(m, v3((float)p[0], (float)p[1], (float)p[2]), solid_normal(s, PART_SIDE, is_tip ? near_tip : p),
             (float)i / AROUND, (float)j / (float)down);
}

static void put_turned_skin(Merging *m, const Solid *s, int down)
{
  const size_t base = m->vertex, row = AROUND + 1;
  for (int j = 0; j <= down; j++)
    for (int i = 0; i <= AROUND; i++) put_turned(m, s, i, j, down);
  for (size_t j = 0; j < (size_t)down; j++)
    for (size_t i = 0; i < AROUND; i++) {
      const size_t a = j * row + i;
      put_triangle(m, base, a, a + 1, a + row + 1);
      put_triangle(m, base, a, a + row + 1, a + row);
    }
}

static void put_cap(Merging *m, const Solid *s, bool is_high)
{
  const size_t base = m->vertex;
  const double y = is_high ? s->high : s->low, r = s->radius + s->slope * y;
  const uint32_t part = is_high ? PART_HIGH : PART_LOW;
  for (int i = 0; i <= AROUND; i++) {
    const double turn = 2 * 3.14159265358979323846 * (i - 1) / AROUND;
    const double p[3] = {i ? r * sin(turn) : 0, y, i ? r * cos(turn) : 0};
    const Vec2 uv = solid_uv(s, part, p);
    put_vertex(m, v3((float)p[0], (float)p[1], (float)p[2]), v3(0, is_high ? 1 : -1, 0), uv.x, uv.y);
  }
  for (size_t i = 0; i < AROUND; i++) {
    const size_t a = 1 + i, b = 1 + (i + 1) % AROUND;
    put_triangle(m, base, 0, is_high ? a : b, is_high ? b : a);
  }
}

static void put_solid(Merging *m, const Solid *s)
{
  switch ((SolidKind)s->kind) {
  case SOLID_TRIANGLE: {
    const size_t base = m->vertex;
    for (int k = 0; k < 3; k++) put_vertex(m, v3(k == 1, k == 2, 0), v3(0, 0, 1), k == 1, k == 2);
    put_triangle(m, base, 0, 1, 2);
    return;
  }
  case SOLID_TORUS: put_turned_skin(m, s, DOWN); return;
  case SOLID_ROUND:
    put_turned_skin(m, s, 1);
    if (has_cap(s, s->low)) put_cap(m, s, false);
    if (has_cap(s, s->high)) put_cap(m, s, true);
    return;
  case SOLID_PLANE:
  case SOLID_BOX: return;
  }
  unreachable();
}

// Without ends, or known only as an expression.
static bool is_unmeshable(const Instance *i)
{
  if (i->kind == INSTANCE_CSG || i->kind == INSTANCE_VOXELS) return true;
  if (i->kind == INSTANCE_SDF) return !bounds_is_finite(&i->sdf->bounds);
  return i->kind == INSTANCE_SOLID &&
         (i->solid->kind == SOLID_PLANE || !(i->solid->high - i->solid->low < INFINITY));
}

static void put_field(Merging *m, const SdfMesh *field)
{
  const size_t base = m->vertex;
  for (size_t i = 0; i < field->vertices.count; i++) {
    const SdfMeshVertex *v = &field->vertices.items[i];
    put_vertex(m, v3_load(v->p), v3_load(v->n), 0, 0);
  }
  for (size_t i = 0; i < field->triangles.count; i += 3) {
    const uint32_t *t = field->triangles.items + i;
    put_triangle(m, base, t[0], t[1], t[2]);
  }
}

// The surfaces of all fields that are to be seen; one an instance, most of them empty.
static SdfMesh *mesh_fields(const World *w, Err *err)
{
  SdfMesh *fields = mem_zero(w->instance_count, sizeof *fields);
  bool ok = fields || err_memory(err, "the merged mesh", w->instance_count * sizeof *fields);
  for (size_t i = 0; ok && i < w->instance_count; i++) {
    const Instance *in = &accel_instances(w->accel)[i];
    if (in->kind == INSTANCE_SDF && !is_light(w, i)) ok = sdf_mesh_make(&fields[i], in->sdf, SDF_MESH_SIDE, err);
  }
  if (ok) return fields;
  for (size_t i = 0; fields && i < w->instance_count; i++) sdf_mesh_finish(&fields[i]);
  mem_free(fields);
  return NULL;
}

static bool put_instance(Merging *m, const World *w, size_t i, const MeshData *mesh, const SdfMesh *field)
{
  m->instance = &accel_instances(w->accel)[i];
  m->is_mirrored = frame_determinant(&m->instance->world_from_object) < 0;
  switch ((InstanceKind)m->instance->kind) {
  case INSTANCE_MESH: return put_mesh(m, mesh);
  case INSTANCE_SPHERE: put_sphere(m, m->instance->size[0]); return true;
  case INSTANCE_QUAD: put_quad(m, m->instance->size[0], m->instance->size[1]); return true;
  case INSTANCE_DISK: put_disk(m, m->instance->size[0]); return true;
  case INSTANCE_SOLID: put_solid(m, m->instance->solid); return true;
  case INSTANCE_SDF: put_field(m, field); return true;
  case INSTANCE_CSG:
  case INSTANCE_VOXELS: return true;
  }
  unreachable();
}

static Size whole_size(const World *w, const MeshData *const *meshes, const SdfMesh *fields)
{
  Size size = {0};
  for (size_t i = 0; i < w->instance_count; i++) {
    const Size s = is_light(w, i) ? (Size){0} : shape_size(w, i, meshes[i]);
    size.vertices += s.vertices + fields[i].vertices.count;
    size.triangles += s.triangles + fields[i].triangles.count / 3;
  }
  return size;
}

static bool check_size(Size size, Err *err)
{
  if (!size.triangles) return err_set(err, ERR_BAD_SCENE, "the scene has no surfaces to write");
  return size.vertices <= UINT32_MAX ||
         err_set(err, ERR_BAD_SCENE, "the scene has %zu vertices; one mesh holds at most %u", size.vertices,
                 UINT32_MAX);
}

static MeshData *create_sized(Size size)
{
  MeshData *out = mesh_data_create();
  if (!out) return NULL;
  out->vertex_count = size.vertices;
  out->triangle_count = size.triangles;
  out->positions = mem_alloc(size.vertices, 3 * sizeof(float));
  out->normals = mem_alloc(size.vertices, 3 * sizeof(float));
  out->texcoords[0] = mem_alloc(size.vertices, 2 * sizeof(float));
  out->triangles = mem_alloc(size.triangles, 3 * sizeof(uint32_t));
  if (out->positions && out->normals && out->texcoords[0] && out->triangles) return out;
  mesh_data_release(out);
  return NULL;
}

MeshData *world_merge(const World *w, Err *err)
{
  for (size_t i = 0; i < w->instance_count; i++)
    if (is_unmeshable(&accel_instances(w->accel)[i]))
      return err_set(err, ERR_BAD_SCENE, "planes, other shapes without ends, csg and voxels cannot be written as triangles; take them out first"), NULL;
  if (!w->instance_count) return check_size((Size){0}, err), NULL;
  const MeshData **meshes = list_meshes(w);
  SdfMesh *fields = meshes ? mesh_fields(w, err) : NULL;
  if (!meshes) return err_memory(err, "the merged mesh", 8 * w->instance_count), NULL;
  if (!fields) return mem_free(meshes), NULL;
  const Size size = whole_size(w, meshes, fields);
  Merging m = {0};
  if (check_size(size, err)) {
    m.out = create_sized(size);
    bool ok = m.out;
    for (size_t i = 0; ok && i < w->instance_count; i++)
      ok = is_light(w, i) || put_instance(&m, w, i, meshes[i], &fields[i]);
    if (!ok) {
      err_memory(err, "the merged mesh", 32ull * size.vertices);
      mesh_data_release(m.out);
      m.out = NULL;
    }
  }
  for (size_t i = 0; i < w->instance_count; i++) sdf_mesh_finish(&fields[i]);
  mem_free(fields);
  mem_free(meshes);
  return m.out;
}
