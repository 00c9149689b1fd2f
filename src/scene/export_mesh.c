// See export_mesh.h. Rows are put together in small buffers and go through the file's own; binary rows rely on a
// little-endian machine, as the importers do.

#include "scene/export_mesh.h"

#include "base/file.h"
#include "base/number.h"
#include "image/image.h"

#include <string.h>

static uint8_t to_u8(float x)
{
  return (uint8_t)(clamp_f(x, 0, 1) * 255 + 0.5f);
}

// A row being put together.
typedef struct RowOut {
  char bytes[400];
  size_t size;
} RowOut;

static void put(RowOut *r, const void *data, size_t size)
{
  memcpy(r->bytes + r->size, data, size);
  r->size += size;
}

static bool write_row(FileOut *f, RowOut *r, Err *err)
{
  const bool ok = file_write(f, r->bytes, r->size, err);
  r->size = 0;
  return ok;
}

// --- PLY --------------------------------------------------------------------------------------------
static bool ply_header(FileOut *f, const MeshData *m, Err *err)
{
  Text t = {0};
  text_add(&t, "ply\nformat binary_little_endian 1.0\ncomment written by rayfold\nelement vertex %zu\n",
           m->vertex_count);
  text_add(&t, "property float x\nproperty float y\nproperty float z\n");
  if (m->normals) text_add(&t, "property float nx\nproperty float ny\nproperty float nz\n");
  if (m->texcoords[0]) text_add(&t, "property float s\nproperty float t\n");
  if (m->colors)
    text_add(&t, "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\n");
  // Signed where it suffices, because older programs know no other.
  text_add(&t, "element face %zu\nproperty list uchar %s vertex_indices\nend_header\n", m->triangle_count,
           m->vertex_count <= INT32_MAX ? "int" : "uint");
  const bool ok =
      t.failed ? err_memory(err, "a PLY header", 1000) : file_write(f, text_get(&t), t.length, err);
  text_finish(&t);
  return ok;
}

static bool ply_vertex(FileOut *f, const MeshData *m, size_t i, Err *err)
{
  RowOut r = {.size = 0};
  put(&r, m->positions + 3 * i, 12);
  if (m->normals) put(&r, m->normals + 3 * i, 12);
  if (m->texcoords[0]) put(&r, m->texcoords[0] + 2 * i, 8);
  for (size_t k = 0; m->colors && k < 4; k++) {
    const float c = m->colors[4 * i + k];
    const uint8_t byte = k < 3 ? srgb_to_u8(c) : to_u8(c);
    put(&r, &byte, 1);
  }
  return write_row(f, &r, err);
}

static bool ply_body(FileOut *f, const MeshData *m, Err *err)
{
  const uint8_t three = 3;
  for (size_t i = 0; i < m->vertex_count; i++)
    if (!ply_vertex(f, m, i, err)) return false;
  for (size_t t = 0; t < m->triangle_count; t++) {
    RowOut r = {.size = 0};
    put(&r, &three, 1);
    put(&r, m->triangles + 3 * t, 12);
    if (!write_row(f, &r, err)) return false;
  }
  return true;
}

bool export_ply(const MeshData *m, const char *path, Err *err)
{
  FileOut f;
  const bool ok =
      file_begin(&f, path, err) && ply_header(&f, m, err) && ply_body(&f, m, err) && file_commit(&f, err);
  file_finish(&f);
  return ok;
}

// --- OBJ --------------------------------------------------------------------------------------------
static void put_number(RowOut *r, float x)
{
  char text[NUMBER_SIZE];
  put(r, " ", 1);
  put(r, text, number_format(text, x));
}

static bool obj_rows(FileOut *f, const char *keyword, const float *values, size_t count, size_t width,
                     Err *err)
{
  for (size_t i = 0; values && i < count; i++) {
    RowOut r = {.size = 0};
    put(&r, keyword, strlen(keyword));
    for (size_t k = 0; k < width; k++) put_number(&r, values[width * i + k]);
    put(&r, "\n", 1);
    if (!write_row(f, &r, err)) return false;
  }
  return true;
}

static bool obj_colored_positions(FileOut *f, const MeshData *m, Err *err)
{
  for (size_t i = 0; i < m->vertex_count; i++) {
    RowOut r = {.size = 0};
    put(&r, "v", 1);
    for (size_t k = 0; k < 3; k++) put_number(&r, m->positions[3 * i + k]);
    for (size_t k = 0; k < 3; k++) put_number(&r, srgb_encode(m->colors[4 * i + k]));
    put(&r, "\n", 1);
    if (!write_row(f, &r, err)) return false;
  }
  return true;
}

static void put_integer(RowOut *r, uint32_t x)
{
  char digits[10];
  size_t n = sizeof digits;
  do digits[--n] = (char)('0' + x % 10);
  while (x /= 10);
  put(r, digits + n, sizeof digits - n);
}

static bool obj_faces(FileOut *f, const MeshData *m, Err *err)
{
  for (size_t t = 0; t < m->triangle_count; t++) {
    RowOut r = {.size = 0};
    if (m->material_slots && (t == 0 || m->material_slots[t] != m->material_slots[t - 1])) {
      put(&r, "usemtl slot_", 12);
      put_integer(&r, m->material_slots[t]);
      put(&r, "\n", 1);
    }
    put(&r, "f", 1);
    for (size_t k = 0; k < 3; k++) {
      const uint32_t v = m->triangles[3 * t + k] + 1;
      put(&r, " ", 1);
      put_integer(&r, v);
      if (m->texcoords[0] || m->normals) put(&r, "/", 1);
      if (m->texcoords[0]) put_integer(&r, v);
      if (m->normals) put(&r, "/", 1);
      if (m->normals) put_integer(&r, v);
    }
    put(&r, "\n", 1);
    if (!write_row(f, &r, err)) return false;
  }
  return true;
}

bool export_obj(const MeshData *m, const char *path, Err *err)
{
  static const char head[] = "# written by rayfold\n";
  FileOut f;
  const size_t n = m->vertex_count;
  const bool ok =
      file_begin(&f, path, err) && file_write(&f, head, sizeof head - 1, err) &&
      (m->colors ? obj_colored_positions(&f, m, err) : obj_rows(&f, "v", m->positions, n, 3, err)) &&
      obj_rows(&f, "vt", m->texcoords[0], n, 2, err) && obj_rows(&f, "vn", m->normals, n, 3, err) &&
      obj_faces(&f, m, err) && file_commit(&f, err);
  file_finish(&f);
  return ok;
}

// --- STL --------------------------------------------------------------------------------------------
static bool stl_body(FileOut *f, const MeshData *m, Err *err)
{
  // The header must not begin with "solid", which would make some programs read text.
  char header[80] = "binary STL written by rayfold";
  const uint32_t count = (uint32_t)m->triangle_count;
  if (!file_write(f, header, sizeof header, err) || !file_write(f, &count, sizeof count, err)) return false;
  for (size_t t = 0; t < m->triangle_count; t++) {
    const float *p[3];
    for (size_t k = 0; k < 3; k++) p[k] = m->positions + 3 * (size_t)m->triangles[3 * t + k];
    const Vec3 a = v3_load(p[0]), n = v3_normalize(v3_cross(v3_load(p[1]) - a, v3_load(p[2]) - a));
    float normal[3];
    v3_store(normal, n);
    RowOut r = {.size = 0};
    put(&r, normal, 12);
    for (size_t k = 0; k < 3; k++) put(&r, p[k], 12);
    put(&r, "\0\0", 2);
    if (!write_row(f, &r, err)) return false;
  }
  return true;
}

bool export_stl(const MeshData *m, const char *path, Err *err)
{
  if (m->triangle_count > UINT32_MAX)
    return err_set(err, ERR_BAD_ARGUMENT, "%s: STL holds at most 4294967295 triangles, not %zu; write PLY",
                   path, m->triangle_count);
  FileOut f;
  const bool ok = file_begin(&f, path, err) && stl_body(&f, m, err) && file_commit(&f, err);
  file_finish(&f);
  return ok;
}
