// See mesh_json.h.

#include "scene/mesh_json.h"

#include "base/mem.h"
#include "base/number.h"

#include <math.h>
#include <string.h>

enum { POSITIONS, TRIANGLES, NORMALS, TEXCOORDS };
const MeshKey mesh_keys[MESH_KEY_COUNT] = {
    {"positions", 3, true, false, "Vertices in metres, x y z each."},
    {"triangles", 3, true, true, "Three vertex numbers each, from 0, counter-clockwise seen from outside."},
    {"normals", 3, false, false, "One a vertex, for smooth shading; made unit length."},
    {"texcoords", 2, false, false, "u v for each vertex; v runs up."},
};

bool mesh_json_is_key(const char *name)
{
  for (int i = 0; i < MESH_KEY_COUNT; i++)
    if (!strcmp(mesh_keys[i].name, name)) return true;
  return false;
}

bool mesh_json_is_given(const Json *shape)
{
  for (int i = 0; i < MESH_KEY_COUNT; i++)
    if (js_get(shape, mesh_keys[i].name)) return true;
  return false;
}

// --- reading --------------------------------------------------------------------------------------
typedef struct Source { // one of the lists
  const JsonDoc *doc;
  const Json *shape;
  const MeshKey *key;
  Err *err;
} Source;

static bool fail_item(const Source *from, const Json *list, size_t i, const Json *v)
{
  return js_fail(from->doc, list, NULL, i, false, from->err, "%s must hold %s, but this is %s",
                 from->key->name, from->key->is_index ? "vertex numbers" : "numbers that a float can hold",
                 js_kind_name(v));
}

// Numbers of a flat list, from out[0] on.
static bool read_flat(const Source *from, const Json *list, void *out)
{
  for (size_t i = 0; i < js_count(list); i++) {
    const Json *v = js_at(list, i);
    const double x = js_number(v, NAN);
    if (from->key->is_index) {
      if (!(x >= 0 && x < 4294967295.0 && x == floor(x))) return fail_item(from, list, i, v);
      ((uint32_t *)out)[i] = (uint32_t)x;
    } else {
      if (!isfinite((float)x)) return fail_item(from, list, i, v);
      ((float *)out)[i] = (float)x;
    }
  }
  return true;
}

static bool read_entries(const Source *from, const Json *list, char *out)
{
  const int per = from->key->per;
  for (size_t i = 0; i < js_count(list); i++) {
    const Json *entry = js_at(list, i);
    if (js_kind(entry) != JSON_LIST || js_count(entry) != (size_t)per)
      return js_fail(from->doc, list, NULL, i, false, from->err,
                     "each entry of %s must be a list of %d numbers", from->key->name, per);
    if (!read_flat(from, entry, out + i * (size_t)per * 4)) return false;
  }
  return true;
}

// *out is 4-byte numbers, `per` an entry, *count entries; owned by the caller, NULL when the key is absent.
static bool read_key(const JsonDoc *doc, const Json *shape, int k, void **out, size_t *count, Err *err)
{
  const Source from = {doc, shape, &mesh_keys[k], err};
  const size_t per = (size_t)from.key->per;
  const Json *list = js_get(shape, from.key->name);
  *out = NULL;
  *count = 0;
  if (!list && !from.key->is_required) return true;
  const size_t length = js_kind(list) == JSON_LIST ? js_count(list) : 0;
  const bool is_nested = js_kind(js_at(list, 0)) == JSON_LIST;
  if (!length || (!is_nested && length % per))
    return js_fail(doc, shape, from.key->name, 0, !list, err,
                   "a mesh without file needs %s: a list of numbers, %zu an entry, or a list of such lists",
                   from.key->name, per);
  *count = is_nested ? length : length / per;
  size_t numbers;
  *out = size_mul(*count, per, &numbers) ? mem_alloc(numbers, 4) : NULL;
  if (!*out) return err_memory(err, from.key->name, length * 4);
  return is_nested ? read_entries(&from, list, *out) : read_flat(&from, list, *out);
}

// Normals already of unit length stay as they are, so that a file read and written again does not change.
static bool make_unit(const JsonDoc *doc, const Json *shape, float *n, size_t count, Err *err)
{
  for (size_t i = 0; i < count; i++, n += 3) {
    const double x = (double)n[0], y = (double)n[1], z = (double)n[2], length = sqrt(x * x + y * y + z * z);
    if (!(length > 0))
      return js_fail(doc, shape, mesh_keys[NORMALS].name, 0, false, err,
                     "normal %zu is zero; give it a direction", i);
    if (fabs(length - 1) < 1e-6) continue;
    for (int k = 0; k < 3; k++) n[k] = (float)((double)n[k] / length);
  }
  return true;
}

static bool check_count(const JsonDoc *doc, const Json *shape, int k, size_t count, size_t vertices, Err *err)
{
  if (!count || count == vertices) return true;
  return js_fail(doc, shape, mesh_keys[k].name, 0, false, err, "%s are for %zu vertices, but there are %zu",
                 mesh_keys[k].name, count, vertices);
}

static bool read_lists(MeshData *m, const JsonDoc *doc, const Json *shape, Err *err)
{
  size_t normals, texcoords;
  return read_key(doc, shape, POSITIONS, (void **)&m->positions, &m->vertex_count, err) &&
         read_key(doc, shape, TRIANGLES, (void **)&m->triangles, &m->triangle_count, err) &&
         read_key(doc, shape, NORMALS, (void **)&m->normals, &normals, err) &&
         read_key(doc, shape, TEXCOORDS, (void **)&m->texcoords[0], &texcoords, err) &&
         check_count(doc, shape, NORMALS, normals, m->vertex_count, err) &&
         check_count(doc, shape, TEXCOORDS, texcoords, m->vertex_count, err) &&
         make_unit(doc, shape, m->normals, normals, err);
}

bool mesh_json_read(Scene *s, const JsonDoc *doc, const Json *shape, const char *name, int32_t *mesh_i,
                    Err *err)
{
  MeshData *m = mesh_data_create();
  if (!m) return err_memory(err, "a mesh", sizeof *m);
  Err wrong = {0};
  if (!read_lists(m, doc, shape, err)) goto failed;
  if (!mesh_data_check(m, name ? name : "the mesh", &s->notes, &wrong)) {
    js_fail(doc, shape, mesh_keys[TRIANGLES].name, 0, false, err, "%s", wrong.text);
    goto failed;
  }
  *mesh_i = scene_add_mesh(s, name, m); // takes m over, also when it fails
  return *mesh_i >= 0 || err_memory(err, "a mesh", 0);
failed:
  mesh_data_release(m);
  return false;
}

// --- writing --------------------------------------------------------------------------------------
static void write_floats(int k, const float *x, size_t count, Text *out, bool *is_finite)
{
  if (!x) return;
  char digits[NUMBER_SIZE];
  text_add(out, ",\"%s\":[", mesh_keys[k].name);
  for (size_t i = 0; i < count * (size_t)mesh_keys[k].per; i++) {
    if (!isfinite(x[i])) *is_finite = false;
    const size_t n = number_format(digits, isfinite(x[i]) ? x[i] : 0);
    if (i) text_add_n(out, ",", 1);
    text_add_n(out, digits, n);
  }
  text_add(out, "]");
}

void mesh_json_write(const MeshData *m, Text *out, bool *is_finite)
{
  write_floats(POSITIONS, m->positions, m->vertex_count, out, is_finite);
  text_add(out, ",\"%s\":[", mesh_keys[TRIANGLES].name);
  for (size_t i = 0; i < 3 * m->triangle_count; i++) text_add(out, i ? ",%u" : "%u", m->triangles[i]);
  text_add(out, "]");
  write_floats(NORMALS, m->normals, m->vertex_count, out, is_finite);
  write_floats(TEXCOORDS, m->texcoords[0], m->vertex_count, out, is_finite);
}
