// Meshes of a glTF file: each primitive becomes one Mesh of the scene with at most one material slot. Only the part of
// the vertex buffers that a primitive's indices span is copied, as exporters like to share one buffer among many.
// Points and lines are left out with a note.
//
// A primitive without a material gets none, so it is shown in our grey instead of glTF's white metal.

#include "scene/gltf_access.h"

#include <stdio.h>
#include <string.h>

enum { MODE_TRIANGLES = 4, MODE_STRIP = 5, MODE_FAN = 6 };

// One primitive on its way: the JSON, where it stands, and the vertices it spans.
typedef struct Primitive {
  Gltf *g;
  const Json *json, *attributes;
  char place[80];      // "meshes[3].primitives[0]"
  size_t vertex_count; // in the file
  size_t first, count; // the part that is used
  MeshData *data;
} Primitive;

// --- triangles ------------------------------------------------------------------------------------
static size_t triangle_count_of(size_t mode, size_t index_count)
{
  if (mode == MODE_TRIANGLES) return index_count / 3;
  return index_count < 3 ? 0 : index_count - 2;
}

// Strips turn every other triangle over to keep them all facing the same way; fans go round the first vertex
// (section 3.7.2.1). Strips bridge gaps with triangles without area, which are dropped.
static size_t unroll(size_t mode, const uint32_t *in, size_t index_count, uint32_t *out)
{
  size_t n = 0;
  for (size_t i = 0; i + 2 < index_count; i++) {
    const size_t odd = mode == MODE_STRIP ? i & 1 : 0;
    const uint32_t a = in[mode == MODE_FAN ? 0 : i], b = in[i + 1 + odd], c = in[i + 2 - odd];
    if (a == b || b == c || c == a) continue;
    out[3 * n] = a;
    out[3 * n + 1] = b;
    out[3 * n + 2] = c;
    n++;
  }
  return n;
}

static uint32_t *read_indices(Primitive *p, size_t *count)
{
  Accessor a;
  bool is_given;
  Gltf *g = p->g;
  if (!accessor_open(g, p->json, "indices", &is_given, &a)) return NULL;
  if (is_given && (a.width != 1 || (a.type != GLTF_U8 && a.type != GLTF_U16 && a.type != GLTF_U32))) {
    gltf_fail(g, p->json, "indices", "%s: indices must be unsigned whole numbers, one each", p->place);
    return NULL;
  }
  *count = is_given ? a.count : p->vertex_count;
  uint32_t *indices = gltf_alloc(g, *count, sizeof *indices, "indices");
  if (!indices) return NULL;
  if (is_given)
    accessor_indices(&a, indices);
  else
    for (size_t i = 0; i < *count; i++) indices[i] = (uint32_t)i;
  return indices;
}

// Which vertices the triangles use; then counts the indices from the first of them.
static bool find_span(Primitive *p)
{
  MeshData *m = p->data;
  uint32_t low = UINT32_MAX, high = 0;
  for (size_t i = 0; i < 3 * m->triangle_count; i++) {
    low = m->triangles[i] < low ? m->triangles[i] : low;
    high = m->triangles[i] > high ? m->triangles[i] : high;
  }
  if (high >= p->vertex_count)
    return gltf_fail(p->g, p->json, "indices", "%s: an index names vertex %u, but there are only %zu",
                     p->place, high, p->vertex_count);
  for (size_t i = 0; low && i < 3 * m->triangle_count; i++) m->triangles[i] -= low;
  p->first = low;
  p->count = (size_t)high - low + 1;
  m->vertex_count = p->count;
  return true;
}

static bool add_triangles(Primitive *p, size_t mode)
{
  size_t index_count = 0;
  uint32_t *indices = read_indices(p, &index_count);
  if (!indices) return false;
  p->data->triangle_count = triangle_count_of(mode, index_count);
  if (mode == MODE_TRIANGLES) {
    p->data->triangles = indices;
  } else {
    p->data->triangles = gltf_alloc(p->g, p->data->triangle_count, 3 * sizeof(uint32_t), "triangles");
    if (p->data->triangles) p->data->triangle_count = unroll(mode, indices, index_count, p->data->triangles);
    mem_free(indices);
  }
  return p->data->triangles && (!p->data->triangle_count || find_span(p));
}

// --- vertices -------------------------------------------------------------------------------------
// The span of an attribute, `width` floats a vertex. NULL in *out if the primitive has none.
static bool read_attribute(Primitive *p, const char *key, int narrowest, int width, float **out)
{
  Accessor a;
  bool is_given;
  *out = NULL;
  if (!accessor_open(p->g, p->attributes, key, &is_given, &a)) return false;
  if (!is_given) return true;
  if (a.width < narrowest || a.width > width || a.type == GLTF_U32)
    return gltf_fail(p->g, p->attributes, key, "%s: accessors[%zu] is of a type that %s cannot have",
                     p->place, a.index, key);
  if (a.count != p->vertex_count)
    return gltf_fail(p->g, p->attributes, key, "%s: %s has %zu elements for %zu vertices", p->place, key,
                     a.count, p->vertex_count);
  float *values = gltf_alloc(p->g, p->count, (size_t)width * sizeof(float), key);
  if (!values) return false;
  accessor_floats(&a, p->first, p->count, width, values);
  *out = values;
  return true;
}

static Vec3 face_normal(const MeshData *m, const uint32_t *v)
{
  const Vec3 a = v3_load(m->positions + 3 * (size_t)v[0]);
  const Vec3 b = v3_load(m->positions + 3 * (size_t)v[1]), c = v3_load(m->positions + 3 * (size_t)v[2]);
  return v3_normalize(v3_cross(b - a, c - a));
}

// Quantised normals are a little too short, and broken files have some of length zero: those take the normal of a
// triangle they belong to.
static void repair_normals(MeshData *m)
{
  bool has_zero = false;
  for (size_t i = 0; i < m->vertex_count; i++) {
    const Vec3 n = v3_load(m->normals + 3 * i);
    const float length2 = v3_dot(n, n);
    has_zero = has_zero || length2 == 0;
    if (fabsf(length2 - 1) > 1e-5f) v3_store(m->normals + 3 * i, v3_normalize(n));
  }
  for (size_t i = 0; has_zero && i < 3 * m->triangle_count; i++) {
    float *n = m->normals + 3 * (size_t)m->triangles[i];
    if (n[0] == 0 && n[1] == 0 && n[2] == 0) v3_store(n, face_normal(m, m->triangles + i - i % 3));
  }
}

static void turn_over(float *texcoords, size_t count)
{
  for (size_t i = 0; texcoords && i < count; i++) texcoords[2 * i + 1] = 1 - texcoords[2 * i + 1];
}

// Tangents serve only with normals and with a length; one that has none spoils them all, as they would disagree with
// those found from texture coordinates.
static void repair_tangents(MeshData *m)
{
  bool ok = m->normals;
  for (size_t i = 0; ok && m->tangents && i < m->vertex_count; i++) {
    float *t = m->tangents + 4 * i;
    const Vec3 unit = v3_normalize(v3_load(t));
    ok = !v3_is_zero(unit);
    v3_store(t, unit);
    t[3] = t[3] < 0 ? -1 : 1;
  }
  if (ok) return;
  mem_free(m->tangents);
  m->tangents = NULL;
}

static bool add_vertices(Primitive *p)
{
  MeshData *m = p->data;
  if (!read_attribute(p, "POSITION", 3, 3, &m->positions) ||
      !read_attribute(p, "NORMAL", 3, 3, &m->normals) || !read_attribute(p, "TANGENT", 4, 4, &m->tangents) ||
      !read_attribute(p, "COLOR_0", 3, 4, &m->colors) ||
      !read_attribute(p, "TEXCOORD_0", 2, 2, &m->texcoords[0]) ||
      !read_attribute(p, "TEXCOORD_1", 2, 2, &m->texcoords[1]))
    return false;
  for (int k = 0; k < 2; k++) turn_over(m->texcoords[k], m->vertex_count);
  if (m->normals) repair_normals(m);
  repair_tangents(m);
  return true;
}

// --- primitives -----------------------------------------------------------------------------------
// Draco keeps the real data in a buffer view of its own; files made for everyone have it uncompressed, too.
static bool check_draco(Primitive *p, size_t position_i)
{
  if (!gltf_extension(p->json, "KHR_draco_mesh_compression") ||
      js_get(gltf_item(p->g, "accessors", position_i), "bufferView"))
    return true;
  return gltf_fail(p->g, p->json, "extensions",
                   "%s is compressed with Draco, which is not supported; unpack the file "
                   "with \"gltf-transform copy IN.glb OUT.glb\"",
                   p->place);
}

// Opens what says how many vertices there are; *is_usable false if the primitive is to be left out, with a note.
static bool begin(Primitive *p, size_t mode, bool *is_usable)
{
  Notes *notes = &p->g->scene->notes;
  Accessor positions;
  *is_usable = false;
  if (mode < MODE_TRIANGLES) {
    note_once(notes, "%s: points and lines are not shown", p->g->path);
    return true;
  }
  if (mode > MODE_FAN) return gltf_fail(p->g, p->json, "mode", "%s: \"mode\" must be 0 to 6", p->place);
  size_t position_i;
  if (!gltf_index(p->g, p->attributes, "POSITION", "accessors", &position_i)) return false;
  if (position_i == GLTF_NONE) {
    note_once(notes, "%s: %s has no POSITION and is left out", p->g->path, p->place);
    return true;
  }
  if (!check_draco(p, position_i) || !accessor_open(p->g, p->attributes, "POSITION", is_usable, &positions))
    return false;
  p->vertex_count = positions.count;
  if (p->vertex_count > UINT32_MAX)
    return gltf_fail(p->g, p->attributes, "POSITION", "%s has too many vertices", p->place);
  return true;
}

// Hands the finished data to the scene; p->data is no longer ours afterwards.
static bool finish(Primitive *p, const char *name)
{
  Gltf *g = p->g;
  size_t material;
  char where[300];
  snprintf(where, sizeof where, "%.200s: %s", g->path, p->place);
  if (!gltf_index(g, p->json, "material", "materials", &material) ||
      !mesh_data_check(p->data, where, &g->scene->notes, g->err))
    return false;
  const int32_t at = scene_add_mesh(g->scene, name, p->data);
  p->data = NULL;
  if (at < 0) return err_memory(g->err, "meshes", sizeof(Mesh));
  if (!gltf_add_deform(g, p->json, p->place, p->vertex_count, p->first, p->count, at)) return false;
  if (material == GLTF_NONE) return true;
  Mesh *mesh = &g->scene->meshes.items[at];
  mesh->slots = arena_alloc(&g->scene->arena, 1, sizeof *mesh->slots);
  if (!mesh->slots) return err_memory(g->err, "meshes", sizeof *mesh->slots);
  mesh->slots[0] = (int32_t)material;
  mesh->slot_count = 1;
  return true;
}

static bool add_primitive(Primitive *p, const char *name)
{
  size_t mode;
  bool is_usable;
  if (!gltf_size(p->g, p->json, "mode", MODE_TRIANGLES, &mode) || !begin(p, mode, &is_usable)) return false;
  if (!is_usable) return true;
  p->data = mesh_data_create();
  if (!p->data) return err_memory(p->g->err, p->place, sizeof(MeshData));
  bool ok = add_triangles(p, mode);
  if (ok && !p->data->triangle_count)
    note_once(&p->g->scene->notes, "%s: %s has no triangles and is left out", p->g->path, p->place);
  else
    ok = ok && add_vertices(p) && finish(p, name);
  mesh_data_release(p->data);
  return ok;
}

bool gltf_add_mesh(Gltf *g, size_t mesh_i, const GltfMesh **out)
{
  GltfMesh *mesh = &g->meshes[mesh_i];
  *out = mesh;
  if (mesh->is_loaded) return true;
  const Json *json = gltf_item(g, "meshes", mesh_i), *primitives = js_get(json, "primitives");
  char name[GLTF_NAME_SIZE];
  gltf_name(json, "mesh", mesh_i, name);
  mesh->first = g->scene->meshes.count;
  const size_t count = js_kind(primitives) == JSON_LIST ? js_count(primitives) : 0;
  for (size_t i = 0; i < count; i++) {
    Primitive p = {
        .g = g, .json = js_at(primitives, i), .attributes = js_get(js_at(primitives, i), "attributes")};
    snprintf(p.place, sizeof p.place, "meshes[%zu].primitives[%zu]", mesh_i, i);
    if (!gltf_charge(g, 1, sizeof(Mesh) + sizeof(MeshData) + sizeof name, "meshes") ||
        !add_primitive(&p, name))
      return false;
  }
  mesh->count = g->scene->meshes.count - mesh->first;
  mesh->is_loaded = true;
  return true;
}
