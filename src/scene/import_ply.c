// PLY, the Stanford polygon format: ASCII and both binary orders, any property types in any order; elements and
// properties nobody here knows are skipped. Vertices stay as they are; polygons are cut to triangles, strips are
// unrolled. Texture coordinates a face (MeshLab's "texcoord" lists) split the vertices they disagree on.
//
// A header's counts are believed only as far as there are bytes for them. Point clouds are refused: there is no
// surface to see. Colours a face, several textures and camera elements are not read.

#include "scene/corners.h"
#include "scene/import.h"
#include "scene/lines.h"
#include "scene/triangulate.h"

#include "base/file.h"
#include "image/image.h"

#include <stdarg.h>
#include <stdio.h>

enum { MOST_ELEMENTS = 64, MOST_PROPERTIES = 256, NAME_SIZE = 40 };

typedef enum PlyType {
  PLY_I8,
  PLY_U8,
  PLY_I16,
  PLY_U16,
  PLY_I32,
  PLY_U32,
  PLY_F32,
  PLY_F64,
  PLY_TYPE_COUNT
} PlyType;
typedef enum PlyFormat { FORMAT_NONE, FORMAT_ASCII, FORMAT_LITTLE, FORMAT_BIG } PlyFormat;

static const uint8_t type_sizes[PLY_TYPE_COUNT] = {1, 1, 2, 2, 4, 4, 4, 8};

typedef struct Property {
  char name[NAME_SIZE];
  PlyType type, count_type;
  bool is_list;
} Property;

typedef struct Element {
  char name[NAME_SIZE];
  uint64_t count;
  size_t first, property_count; // its properties
  size_t least_size;            // bytes that one takes at the least
  bool has_list;
} Element;

typedef struct Ply {
  Scene *scene;
  const char *path;
  Err *err;
  const char *data, *end, *p; // the file, and what of it has been read

  PlyFormat format;
  Element elements[MOST_ELEMENTS];
  Property properties[MOST_PROPERTIES];
  size_t element_count, property_count;
  char *texture_file; // in the arena
  size_t odd_line;    // of the header: the first with an unknown keyword, 0: none

  MeshData *mesh;
  ARRAY(uint32_t) triangles;
  ARRAY(uint32_t) face, cut; // scratch
  ARRAY(float) face_points, face_texcoords;
  Triangulator triangulator;
  Corners corners;               // used when faces have texture coordinates
  ARRAY(float) corner_texcoords; // 2 a vertex of corners
} Ply;

// Says where: the line of an ASCII file, the byte of a binary one.
__attribute__((format(printf, 2, 3))) static bool ply_fail(const Ply *f, const char *format, ...)
{
  char text[600];
  va_list args;
  va_start(args, format);
  vsnprintf(text, sizeof text, format, args);
  va_end(args);
  for (char *c = text; *c; c++)
    if ((unsigned char)*c < ' ') *c = '?';
  if (f->format != FORMAT_ASCII)
    return err_set(f->err, ERR_BAD_SCENE, "%s: byte %zu: %s", f->path, (size_t)(f->p - f->data), text);
  size_t line = 1;
  for (const char *c = f->data; c < f->p; c++) line += *c == '\n';
  return err_set(f->err, ERR_BAD_SCENE, "%s:%zu: %s", f->path, line, text);
}

static bool no_memory(const Ply *f)
{
  return err_memory(f->err, f->path, 0);
}

// --- the header -------------------------------------------------------------------------------------
static bool find_type(const char *p, const char *end, PlyType *out)
{
  static const char *const names[2][PLY_TYPE_COUNT] = {
      {"char", "uchar", "short", "ushort", "int", "uint", "float", "double"},
      {"int8", "uint8", "int16", "uint16", "int32", "uint32", "float32", "float64"}};
  for (int n = 0; n < 2; n++)
    for (int t = 0; t < PLY_TYPE_COUNT; t++)
      if (word_is(p, end, names[n][t])) return *out = (PlyType)t, true;
  return false;
}

static void copy_name(char out[NAME_SIZE], const char *p, const char *end)
{
  const size_t n = end - p < NAME_SIZE - 1 ? (size_t)(end - p) : NAME_SIZE - 1;
  memcpy(out, p, n);
  out[n] = 0;
}

static bool header_format(Ply *f, const Lines *lines, const char *p, const char *end)
{
  static const char *const names[] = {"", "ascii", "binary_little_endian", "binary_big_endian"};
  const char *after = skip_word(p, end);
  for (int i = FORMAT_ASCII; i <= FORMAT_BIG; i++)
    if (word_is(p, after, names[i])) f->format = (PlyFormat)i;
  return f->format || lines_fail(lines, f->err, "\"%.*s\" is no PLY format", SHOWN(p, after));
}

static bool header_element(Ply *f, const Lines *lines, const char *p, const char *end)
{
  const char *after = skip_word(p, end), *count = skip_blanks(after, end);
  int64_t n;
  if (p == after || number_int(count, end, &n) != end || n < 0 || n == INT64_MAX)
    return lines_fail(lines, f->err, "\"element\" needs a name and a count");
  if (f->element_count == MOST_ELEMENTS)
    return lines_fail(lines, f->err, "there are more than %d elements", MOST_ELEMENTS);
  Element *e = &f->elements[f->element_count++];
  *e = (Element){.count = (uint64_t)n, .first = f->property_count};
  copy_name(e->name, p, after);
  return true;
}

static bool header_property(Ply *f, const Lines *lines, const char *p, const char *end)
{
  if (!f->element_count) return lines_fail(lines, f->err, "a property comes before any element");
  if (f->property_count == MOST_PROPERTIES)
    return lines_fail(lines, f->err, "there are more than %d properties", MOST_PROPERTIES);
  Element *e = &f->elements[f->element_count - 1];
  Property *q = &f->properties[f->property_count];
  *q = (Property){0};
  const char *after = skip_word(p, end);
  q->is_list = word_is(p, after, "list");
  if (q->is_list) {
    p = skip_blanks(after, end);
    after = skip_word(p, end);
    if (!find_type(p, after, &q->count_type) || q->count_type >= PLY_F32)
      return lines_fail(lines, f->err, "a list's count cannot be \"%.*s\"", SHOWN(p, after));
    p = skip_blanks(after, end);
    after = skip_word(p, end);
  }
  if (!find_type(p, after, &q->type))
    return lines_fail(lines, f->err, "\"%.*s\" is no type", SHOWN(p, after));
  p = skip_blanks(after, end);
  if (p == end) return lines_fail(lines, f->err, "a property has no name");
  copy_name(q->name, p, skip_word(p, end));
  f->property_count++;
  e->property_count++;
  e->has_list = e->has_list || q->is_list;
  e->least_size += f->format == FORMAT_ASCII ? 1 : type_sizes[q->is_list ? q->count_type : q->type];
  return true;
}

// "comment TextureFile wood.png" is how MeshLab names the texture.
static bool header_comment(Ply *f, const char *p, const char *end)
{
  const char *after = skip_word(p, end), *file = skip_blanks(after, end);
  if (!word_is(p, after, "TextureFile") || file == end) return true;
  if (f->texture_file) {
    note_once(&f->scene->notes, "%s: names several textures; only the first is used", f->path);
    return true;
  }
  f->texture_file = arena_text_n(&f->scene->arena, file, (size_t)(end - file));
  return f->texture_file || no_memory(f);
}

static bool header_line(Ply *f, const Lines *lines, const char *p, const char *end, bool *is_last)
{
  const char *after = skip_word(p, end), *rest = skip_blanks(after, end);
  end = trim_end(rest, end);
  if (lines->number == 1)
    return word_is(p, after, "ply") ||
           lines_fail(lines, f->err, "this is no PLY file: its first line is not \"ply\"");
  if (p == end || word_is(p, after, "obj_info")) return true;
  if (word_is(p, after, "comment")) return header_comment(f, rest, end);
  if (word_is(p, after, "format")) return header_format(f, lines, rest, end);
  if (!f->format) return lines_fail(lines, f->err, "\"format\" must come first");
  if (word_is(p, after, "element")) return header_element(f, lines, rest, end);
  if (word_is(p, after, "property")) return header_property(f, lines, rest, end);
  *is_last = word_is(p, after, "end_header");
  // Blender 2.4 forgot the word "comment"; such lines say nothing about the data.
  if (!*is_last && !f->odd_line) f->odd_line = lines->number;
  return true;
}

static bool no_header_end(const Ply *f, Lines *lines)
{
  if (f->odd_line) lines->number = f->odd_line;
  return lines_fail(lines, f->err, "%s",
                    f->odd_line ? "this is no line of a PLY header, and there is no \"end_header\" below it"
                                : "the header has no end; is this a PLY file, and all of it?");
}

static bool read_header(Ply *f)
{
  Lines lines;
  lines_init(&lines, f->path, f->data, (size_t)(f->end - f->data));
  // The body may be binary, so the first line alone says how lines end.
  const bool is_mac = f->end - f->data > 4 && f->data[3] == '\r' && f->data[4] != '\n';
  lines.line_end = is_mac ? '\r' : '\n';
  const char *p, *end;
  bool is_last = false;
  while (!is_last) {
    if (!lines_next(&lines, &p, &end)) return no_header_end(f, &lines);
    if (!header_line(f, &lines, p, end, &is_last)) return false;
  }
  if (f->odd_line)
    note_once(&f->scene->notes, "%s: line %zu of the header, and any others of unknown kind, are ignored",
              f->path, f->odd_line);
  f->p = lines.next;
  return true;
}

// --- values -----------------------------------------------------------------------------------------
static void skip_space(Ply *f)
{
  while (f->p < f->end && (is_blank(*f->p) || *f->p == '\n')) f->p++;
}

static bool no_value(Ply *f)
{
  skip_space(f);
  if (f->p == f->end) return ply_fail(f, "the file ends early");
  return ply_fail(f, "\"%.*s\" is not the number expected here", SHOWN(f->p, skip_word(f->p, f->end)));
}

static bool read_text_value(Ply *f, PlyType type, double *out)
{
  skip_space(f);
  float x;
  int64_t i;
  const char *after;
  if (type >= PLY_F32) {
    after = number_float(f->p, f->end, &x);
    if (after) *out = (double)x;
  } else {
    after = number_int(f->p, f->end, &i);
    if (after) *out = (double)i;
    // Some programs print integers as 3.0.
    if (after && after < f->end && (*after == '.' || (*after | 0x20) == 'e'))
      after = number_double(f->p, f->end, out);
  }
  if (!after || (after < f->end && !is_blank(*after) && *after != '\n')) return no_value(f);
  f->p = after;
  return true;
}

// We run on little-endian machines only (base/hash.h says so, too).
static inline bool read_value(Ply *f, PlyType type, double *out)
{
  if (f->format == FORMAT_ASCII) return read_text_value(f, type, out);
  const size_t size = type_sizes[type];
  if ((size_t)(f->end - f->p) < size) return no_value(f);
  uint64_t bits = 0;
  memcpy(&bits, f->p, size);
  f->p += size;
  if (f->format == FORMAT_BIG) bits = __builtin_bswap64(bits) >> (64 - 8 * size);
  const uint32_t low = (uint32_t)bits;
  float x;
  switch (type) {
  case PLY_I8: *out = (int8_t)low; break;
  case PLY_U8: *out = (uint8_t)low; break;
  case PLY_I16: *out = (int16_t)low; break;
  case PLY_U16: *out = (uint16_t)low; break;
  case PLY_I32: *out = (int32_t)low; break;
  case PLY_U32: *out = low; break;
  case PLY_F32:
    memcpy(&x, &low, sizeof x);
    *out = (double)x;
    break;
  case PLY_F64: memcpy(out, &bits, sizeof *out); break;
  case PLY_TYPE_COUNT: unreachable();
  }
  return true;
}

static bool read_list_count(Ply *f, const Property *q, size_t *count)
{
  double n;
  if (!read_value(f, q->count_type, &n)) return false;
  const size_t least = f->format == FORMAT_ASCII ? 1 : type_sizes[q->type];
  if (!(n >= 0) || n > (double)((size_t)(f->end - f->p) / least))
    return ply_fail(f, "a list of %.0f values does not fit into the file", n);
  *count = (size_t)n;
  return true;
}

static bool skip_property(Ply *f, const Property *q)
{
  size_t n = 1;
  double x;
  if (q->is_list && !read_list_count(f, q, &n)) return false;
  if (f->format != FORMAT_ASCII) {
    if ((size_t)(f->end - f->p) / type_sizes[q->type] < n) return no_value(f);
    f->p += n * type_sizes[q->type];
    return true;
  }
  for (size_t i = 0; i < n; i++)
    if (!read_value(f, q->type, &x)) return false;
  return true;
}

// --- elements ---------------------------------------------------------------------------------------
static bool has_room(Ply *f, const Element *e)
{
  if (!e->least_size || e->count <= (size_t)(f->end - f->p) / e->least_size) return true;
  return ply_fail(
      f, "the header promises %llu of \"%s\", but only %zu bytes are left; the file is cut off or damaged",
      (unsigned long long)e->count, e->name, (size_t)(f->end - f->p));
}

static bool skip_element(Ply *f, const Element *e)
{
  if (!e->property_count) return true;
  if (f->format != FORMAT_ASCII && !e->has_list) {
    f->p += e->count * e->least_size;
    return true;
  }
  for (uint64_t i = 0; i < e->count; i++)
    for (size_t k = 0; k < e->property_count; k++)
      if (!skip_property(f, &f->properties[e->first + k])) return false;
  return true;
}

static const Property *find_property(const Ply *f, const Element *e, const char *const *names)
{
  for (; *names; names++)
    for (size_t k = 0; k < e->property_count; k++)
      if (!strcmp(f->properties[e->first + k].name, *names)) return &f->properties[e->first + k];
  return NULL;
}

// --- vertices ---------------------------------------------------------------------------------------
typedef enum VertexPart {
  PART_X,
  PART_Y,
  PART_Z,
  PART_NX,
  PART_NY,
  PART_NZ,
  PART_U,
  PART_V,
  PART_RED,
  PART_GREEN,
  PART_BLUE,
  PART_ALPHA,
  PART_COUNT
} VertexPart;

static const char *const part_names[PART_COUNT][6] = {{"x"},
                                                      {"y"},
                                                      {"z"},
                                                      {"nx", "normal_x"},
                                                      {"ny", "normal_y"},
                                                      {"nz", "normal_z"},
                                                      {"u", "s", "texture_u", "texture_s", "tex_u"},
                                                      {"v", "t", "texture_v", "texture_t", "tex_v"},
                                                      {"red", "diffuse_red", "r"},
                                                      {"green", "diffuse_green", "g"},
                                                      {"blue", "diffuse_blue", "b"},
                                                      {"alpha", "a"}};

// Where a property's values go; to is NULL for those nobody wants.
typedef struct Target {
  float *to;
  size_t stride;
  float unit;   // multiplies integers
  bool is_srgb; // integer colours are as a screen shows them, float colours linear
} Target;

static float integer_unit(PlyType type)
{
  static const float most[PLY_TYPE_COUNT] = {127, 255, 32767, 65535, 2147483647.0f, 4294967295.0f, 1, 1};
  return 1 / most[type];
}

static bool allocate(Ply *f, float **array, size_t width)
{
  *array = mem_alloc(f->mesh->vertex_count, width * sizeof(float));
  return *array || no_memory(f);
}

static bool set_targets(Ply *f, const Element *e, Target *targets)
{
  const Property *parts[PART_COUNT];
  MeshData *m = f->mesh;
  for (int i = 0; i < PART_COUNT; i++) {
    parts[i] = find_property(f, e, part_names[i]);
    if (parts[i] && parts[i]->is_list) parts[i] = NULL;
  }
  if (!parts[PART_X] || !parts[PART_Y] || !parts[PART_Z])
    return ply_fail(f, "the vertices have no x, y and z");
  const bool has_normals = parts[PART_NX] && parts[PART_NY] && parts[PART_NZ];
  const bool has_colors = parts[PART_RED] && parts[PART_GREEN] && parts[PART_BLUE];
  const bool has_texcoords = parts[PART_U] && parts[PART_V];
  if (!allocate(f, &m->positions, 3) || (has_normals && !allocate(f, &m->normals, 3)) ||
      (has_texcoords && !allocate(f, &m->texcoords[0], 2)) || (has_colors && !allocate(f, &m->colors, 4)))
    return false;
  for (size_t i = 3; m->colors && i < 4 * m->vertex_count; i += 4) m->colors[i] = 1;
  for (int i = 0; i < PART_COUNT; i++) {
    if (!parts[i]) continue;
    Target *t = &targets[parts[i] - &f->properties[e->first]];
    *t = (Target){.stride = 3, .unit = 1};
    if (i < PART_NX)
      t->to = m->positions + i;
    else if (i < PART_U)
      t->to = m->normals ? m->normals + (i - PART_NX) : NULL;
    else if (i < PART_RED) {
      t->to = m->texcoords[0] ? m->texcoords[0] + (i - PART_U) : NULL;
      t->stride = 2;
    } else {
      t->to = m->colors ? m->colors + (i - PART_RED) : NULL;
      t->stride = 4;
      t->unit = integer_unit(parts[i]->type);
      t->is_srgb = i != PART_ALPHA && parts[i]->type < PLY_F32;
    }
  }
  return true;
}

static bool read_vertices(Ply *f, const Element *e)
{
  Target targets[MOST_PROPERTIES] = {0};
  if (e->count >= CORNER_NONE) return ply_fail(f, "there are more than 4294967294 vertices; split the file");
  f->mesh->vertex_count = e->count;
  if (!e->count) return true;
  if (!set_targets(f, e, targets)) return false;
  for (size_t v = 0; v < e->count; v++)
    for (size_t k = 0; k < e->property_count; k++) {
      const Property *q = &f->properties[e->first + k];
      const Target *t = &targets[k];
      double x;
      if (q->is_list || !t->to) {
        if (!skip_property(f, q)) return false;
        continue;
      }
      if (!read_value(f, q->type, &x)) return false;
      float *to = t->to + v * t->stride;
      if (!t->is_srgb)
        *to = (float)x * t->unit;
      else if (q->type == PLY_U8)
        *to = srgb_from_u8[(int)clamp_f((float)x, 0, 255)];
      else
        *to = srgb_decode(clamp_f((float)x * t->unit, 0, 1));
    }
  return true;
}

// --- faces ------------------------------------------------------------------------------------------
static bool read_index(Ply *f, PlyType type, uint32_t *out)
{
  double x;
  if (!read_value(f, type, &x)) return false;
  if (!(x >= 0 && x < (double)f->mesh->vertex_count))
    return ply_fail(f, "a face names vertex %.0f, but there are only %zu", x, f->mesh->vertex_count);
  *out = (uint32_t)x;
  return true;
}

static bool push_face(Ply *f)
{
  const size_t n = f->face.count;
  if (n < 3) {
    note_once(&f->scene->notes, "%s: faces with fewer than three corners are left out", f->path);
    return true;
  }
  if (n > UINT32_MAX / 4 || !array_reserve(&f->triangles, f->triangles.count + 3 * (n - 2)) ||
      !array_reserve(&f->cut, 3 * (n - 2)) || !array_reserve(&f->face_points, 3 * n))
    return no_memory(f);
  uint32_t *to = f->triangles.items + f->triangles.count;
  f->triangles.count += 3 * (n - 2);
  if (n == 3) {
    memcpy(to, f->face.items, 3 * sizeof *to);
    return true;
  }
  for (size_t i = 0; i < n; i++) {
    const uint32_t v = f->face.items[i];
    const size_t position = f->corners.vertices.count ? f->corners.vertices.items[v].position : v;
    memcpy(f->face_points.items + 3 * i, f->mesh->positions + 3 * position, 3 * sizeof(float));
  }
  if (!triangulate(&f->triangulator, f->face_points.items, (uint32_t)n, f->cut.items)) return no_memory(f);
  for (size_t i = 0; i < 3 * (n - 2); i++) to[i] = f->face.items[f->cut.items[i]];
  return true;
}

static bool read_indices(Ply *f, const Property *q)
{
  size_t n;
  if (!read_list_count(f, q, &n)) return false;
  f->face.count = 0;
  if (!array_reserve(&f->face, n)) return no_memory(f);
  for (; f->face.count < n; f->face.count++)
    if (!read_index(f, q->type, &f->face.items[f->face.count])) return false;
  return true;
}

static bool read_face_texcoords(Ply *f, const Property *q)
{
  size_t n;
  if (!read_list_count(f, q, &n)) return false;
  f->face_texcoords.count = 0;
  if (!array_reserve(&f->face_texcoords, n)) return no_memory(f);
  for (; f->face_texcoords.count < n; f->face_texcoords.count++) {
    double x;
    if (!read_value(f, q->type, &x)) return false;
    f->face_texcoords.items[f->face_texcoords.count] = (float)x;
  }
  return true;
}

// The vertex at this position with this texture coordinate. Chains are searched for a bounded length, as in
// corners.h, but compare the values.
static bool split_vertex(Ply *f, uint32_t position, const float uv[2], uint32_t *out)
{
  enum { LONGEST_SEARCH = 32 };
  uint32_t *head = &f->corners.heads.items[position], i = *head;
  for (int steps = 0; i != CORNER_NONE && steps < LONGEST_SEARCH;
       steps++, i = f->corners.vertices.items[i].next)
    if (!memcmp(f->corner_texcoords.items + 2 * (size_t)i, uv, 2 * sizeof *uv)) return *out = i, true;
  const size_t count = f->corners.vertices.count;
  if (count >= CORNER_NONE - 1 ||
      !array_push(&f->corners.vertices, (Corner){.position = position, .next = *head}) ||
      !array_reserve(&f->corner_texcoords, 2 * count + 2))
    return no_memory(f);
  memcpy(f->corner_texcoords.items + 2 * count, uv, 2 * sizeof *uv);
  f->corner_texcoords.count = 2 * count + 2;
  *out = *head = (uint32_t)count;
  return true;
}

static bool split_face(Ply *f)
{
  static const float none[2] = {0, 0};
  const bool has_all = f->face_texcoords.count >= 2 * f->face.count;
  for (size_t i = 0; i < f->face.count; i++)
    if (!split_vertex(f, f->face.items[i], has_all ? f->face_texcoords.items + 2 * i : none,
                      &f->face.items[i]))
      return false;
  return true;
}

static bool read_faces(Ply *f, const Element *e)
{
  static const char *const index_names[] = {"vertex_indices", "vertex_index", NULL};
  static const char *const texcoord_names[] = {"texcoord", NULL};
  const Property *indices = find_property(f, e, index_names),
                 *texcoords = find_property(f, e, texcoord_names);
  if (!indices || !indices->is_list) return ply_fail(f, "the faces have no list \"vertex_indices\"");
  if (texcoords && (!texcoords->is_list || f->mesh->texcoords[0])) texcoords = NULL;
  // Split and unsplit vertices have other numbers, so all faces must be of one sort.
  if (f->triangles.count && !f->corners.vertices.count) texcoords = NULL;
  if (f->corners.vertices.count && !texcoords)
    return ply_fail(f, "faces with and without texture coordinates in two elements are not supported");
  if (texcoords && !corners_grow(&f->corners, f->mesh->vertex_count)) return no_memory(f);
  const size_t triangle_size = f->format == FORMAT_ASCII ? 7 : 1 + 3 * (size_t)type_sizes[indices->type];
  const size_t most = (size_t)(f->end - f->p) / triangle_size;
  if (!array_reserve(&f->triangles, 3 * (e->count < most ? (size_t)e->count : most))) return no_memory(f);
  for (uint64_t i = 0; i < e->count; i++) {
    for (size_t k = 0; k < e->property_count; k++) {
      const Property *q = &f->properties[e->first + k];
      if (!(q == indices     ? read_indices(f, q)
            : q == texcoords ? read_face_texcoords(f, q)
                             : skip_property(f, q)))
        return false;
    }
    if (texcoords && !split_face(f)) return false;
    if (!push_face(f)) return false;
  }
  return true;
}

// A strip's triangles turn by turns; -1 begins the next strip.
static bool push_strip(Ply *f, size_t count, const Property *q)
{
  size_t in_strip = 0;
  uint32_t last[2] = {0};
  for (size_t i = 0; i < count; i++) {
    double x;
    const char *start = f->p;
    if (!read_value(f, q->type, &x)) return false;
    if (x == -1) {
      in_strip = 0;
      continue;
    }
    uint32_t v;
    f->p = start;
    if (!read_index(f, q->type, &v)) return false;
    const bool is_odd = in_strip % 2;
    if (++in_strip >= 3) {
      if (!array_reserve(&f->triangles, f->triangles.count + 3)) return no_memory(f);
      uint32_t *to = f->triangles.items + f->triangles.count;
      to[0] = last[is_odd];
      to[1] = last[!is_odd];
      to[2] = v;
      f->triangles.count += 3;
    }
    last[0] = last[1];
    last[1] = v;
  }
  return true;
}

static bool read_strips(Ply *f, const Element *e)
{
  static const char *const names[] = {"vertex_indices", "vertex_index", NULL};
  const Property *indices = find_property(f, e, names);
  if (!indices || !indices->is_list) return ply_fail(f, "the strips have no list \"vertex_indices\"");
  if (f->corners.vertices.count)
    return ply_fail(f, "strips beside faces with texture coordinates are not supported");
  for (uint64_t i = 0; i < e->count; i++)
    for (size_t k = 0; k < e->property_count; k++) {
      const Property *q = &f->properties[e->first + k];
      size_t n;
      if (q == indices ? !read_list_count(f, q, &n) || !push_strip(f, n, q) : !skip_property(f, q))
        return false;
    }
  return true;
}

// --- the body ---------------------------------------------------------------------------------------
static bool is_surface(const Element *e)
{
  return !strcmp(e->name, "face") || !strcmp(e->name, "tristrips");
}

static bool read_surface(Ply *f, const Element *e)
{
  if (!e->property_count) return true;
  return !strcmp(e->name, "face") ? read_faces(f, e) : read_strips(f, e);
}

// Elements lie one after the other. Faces need the vertices; those that come before them are skipped at first and
// read at the end.
static bool read_body(Ply *f)
{
  const char *starts[MOST_ELEMENTS] = {0};
  bool has_vertices = false;
  for (size_t i = 0; i < f->element_count; i++) {
    const Element *e = &f->elements[i];
    if (!has_room(f, e)) return false;
    const bool is_vertex = !strcmp(e->name, "vertex") && !has_vertices;
    if (is_surface(e) && !has_vertices) starts[i] = f->p;
    if (is_vertex                       ? !read_vertices(f, e)
        : has_vertices && is_surface(e) ? !read_surface(f, e)
                                        : !skip_element(f, e))
      return false;
    has_vertices = has_vertices || is_vertex;
  }
  for (size_t i = 0; has_vertices && i < f->element_count; i++) {
    if (!starts[i]) continue;
    f->p = starts[i];
    if (!read_surface(f, &f->elements[i])) return false;
  }
  return true;
}

// --- the mesh ---------------------------------------------------------------------------------------
static bool gather(Ply *f, float **array, size_t width)
{
  if (!*array) return true;
  const size_t n = f->corners.vertices.count;
  float *split = mem_alloc(n, width * sizeof(float));
  if (!split) return no_memory(f);
  for (size_t i = 0; i < n; i++)
    memcpy(split + width * i, *array + width * f->corners.vertices.items[i].position, width * sizeof(float));
  mem_free(*array);
  *array = split;
  return true;
}

static bool apply_split(Ply *f)
{
  MeshData *m = f->mesh;
  if (!f->corners.vertices.count) return true;
  if (!gather(f, &m->positions, 3) || !gather(f, &m->normals, 3) || !gather(f, &m->colors, 4)) return false;
  m->vertex_count = f->corners.vertices.count;
  m->texcoords[0] = f->corner_texcoords.items;
  f->corner_texcoords.items = NULL;
  return true;
}

static void make_unit(float *normals, size_t count)
{
  for (size_t i = 0; normals && i < count; i++) {
    const Vec3 n = v3_normalize(v3_load(normals + 3 * i));
    v3_store(normals + 3 * i, v3_is_zero(n) ? v3(0, 1, 0) : n);
  }
}

// Vertex colours and a texture multiply the base colour, which is white for them.
static bool make_material(Ply *f, const LoadOptions *options, int32_t *out)
{
  *out = -1;
  const char *file =
      f->texture_file ? import_find_file(f->scene, f->path, f->path, f->texture_file, options) : NULL;
  if (!file && !f->mesh->colors) return true;
  *out = scene_add_material(f->scene, MATERIAL_PBR, file ? "texture" : "vertex colors");
  const int32_t texture_i = file && *out >= 0 ? import_add_image(f->scene, file) : -1;
  if (*out < 0 || (file && texture_i < 0)) return no_memory(f);
  Pbr *pbr = &f->scene->materials.items[*out].pbr;
  for (int k = 0; k < 3; k++) pbr->base_color[k] = 1;
  pbr->base_color_texture = texture_i;
  return true;
}

static bool add_to_scene(Ply *f, const LoadOptions *options)
{
  MeshData *m = f->mesh;
  int32_t material_i;
  if (!f->triangles.count)
    return err_set(f->err, ERR_BAD_SCENE, "%s: holds no triangles%s", f->path,
                   m->vertex_count ? "; it is a point cloud, of which a surface must be made first" : "");
  if (!apply_split(f)) return false;
  m->triangles = f->triangles.items;
  m->triangle_count = f->triangles.count / 3;
  f->triangles.items = NULL;
  make_unit(m->normals, m->vertex_count);
  if (!make_material(f, options, &material_i)) return false;
  if (f->triangulator.fan_count)
    note_once(&f->scene->notes, "%s: %zu polygons cross themselves or are too large to cut well", f->path,
              f->triangulator.fan_count);
  f->mesh = NULL;
  return import_add_mesh(f->scene, f->path, NULL, m, &material_i, 1, f->err);
}

static void ply_finish(Ply *f)
{
  mesh_data_release(f->mesh);
  array_finish(&f->triangles);
  array_finish(&f->face);
  array_finish(&f->cut);
  array_finish(&f->face_points);
  array_finish(&f->face_texcoords);
  triangulator_finish(&f->triangulator);
  corners_finish(&f->corners);
  array_finish(&f->corner_texcoords);
}

bool import_ply(Scene *s, const char *path, const LoadOptions *options, Err *err)
{
  FileBytes file;
  if (!file_read(&file, path, err)) return false;
  const char *data = (const char *)file.data;
  Ply f = {.scene = s, .path = path, .err = err, .data = data, .end = data + file.size, .p = data};
  triangulator_init(&f.triangulator);
  f.mesh = mesh_data_create();
  const bool ok = f.mesh ? read_header(&f) && read_body(&f) && add_to_scene(&f, options) : no_memory(&f);
  ply_finish(&f);
  file_release(&file);
  return ok;
}
