// Wavefront OBJ: one pass over the mapped file with a hand-written scanner. The whole file becomes one mesh with a
// material slot a triangle; `o` and `g` do not split it, because they say nothing about placement (vertices are
// shared and absolute) and some programs write thousands. The mesh is named after the `o` when there is just one,
// else after the file. Smoothing is by given normals only: `s` is ignored, and a file without vn is faceted.
//
// Errors are what cannot be understood (a vertex without three numbers, an index out of range); what is understood
// but not supported (curves, lines, points), or missing beside the file (its MTL), is a note.

#include "scene/cache.h"
#include "scene/corners.h"
#include "scene/import.h"
#include "scene/import_mtl.h"
#include "scene/lines.h"
#include "scene/names.h"
#include "scene/triangulate.h"

#include "base/file.h"
#include "image/image.h"

#include <string.h>

enum {
  MOST_SLOTS = UINT16_MAX + 1, // what a triangle's slot can tell apart
  MOST_LIBRARIES = 64,
  MOST_IGNORED = 64
};

typedef ARRAY(float) Floats;
typedef ARRAY(uint32_t) Indices;

typedef struct Obj {
  Scene *scene;
  const char *path;
  const LoadOptions *options;
  Err *err;
  Lines lines;

  Floats positions, texcoords, normals; // as in the file: 3, 2 and 3 floats each
  Floats colors;                        // 3 a position, sRGB; empty when none has any
  Corners corners;
  Indices triangles;
  ARRAY(uint16_t) slots;   // one a triangle; empty while all are slot 0
  int32_t slot;            // of the faces to come; -1: no usemtl yet
  Names materials;         // slot -> name; "" is a face before any usemtl
  Names libraries;         // as named by mtllib
  Names ignored;           // keywords there is a note for
  const char *object_name; // of the first `o`
  size_t object_count;

  Indices face, cut;  // scratch: the face's vertices; its triangles as corner numbers
  Floats face_points; // scratch: its positions
  Triangulator triangulator;
} Obj;

static bool no_memory(const Obj *o)
{
  return err_memory(o->err, o->path, 0);
}

// --- how much there is ------------------------------------------------------------------------------
// Counted before reading, so that the large arrays are allocated once at their size: growing by copies would
// take two and a half times the memory at its peak.
typedef struct Counts {
  size_t positions, texcoords, normals, triangles;
} Counts;

static size_t count_words(const char *p, const char *end)
{
  size_t n = 0;
  bool was_blank = true;
  for (; p < end; p++) {
    const bool now_blank = is_blank(*p);
    n += was_blank && !now_blank;
    was_blank = now_blank;
  }
  return n;
}

static Counts count_ahead(const Lines *lines)
{
  Counts c = {0};
  for (const char *p = lines->next; p < lines->file_end;) {
    const char *stop = memchr(p, lines->line_end, (size_t)(lines->file_end - p));
    const char *end = stop ? stop : lines->file_end;
    p = skip_blanks(p, end);
    const char second = end - p > 1 ? p[1] : 0;
    if (end - p > 1 && *p == 'v') {
      c.positions += is_blank(second);
      c.texcoords += second == 't';
      c.normals += second == 'n';
    } else if (*p == 'f' && is_blank(second)) {
      const size_t n = count_words(p + 1, end);
      c.triangles += n > 2 ? n - 2 : 0;
    }
    p = end + 1;
  }
  return c;
}

static bool reserve_all(Obj *o)
{
  const Counts c = count_ahead(&o->lines);
  return (array_reserve(&o->positions, 3 * c.positions) && array_reserve(&o->texcoords, 2 * c.texcoords) &&
          array_reserve(&o->normals, 3 * c.normals) && array_reserve(&o->triangles, 3 * c.triangles) &&
          array_reserve(&o->corners.vertices, c.positions) &&
          array_reserve(&o->corners.heads, c.positions)) ||
         no_memory(o);
}

// --- vertices ---------------------------------------------------------------------------------------
static bool push_floats(Obj *o, Floats *to, const float *x, size_t n)
{
  if (!array_reserve(to, to->count + n)) return no_memory(o);
  memcpy(to->items + to->count, x, n * sizeof *x);
  to->count += n;
  return true;
}

// Six numbers are a position and a colour (MeshLab, Blender, ZBrush); four a position and a weight, which only
// curves use.
static bool read_position(Obj *o, const char *p, const char *end)
{
  static const float white[3] = {1, 1, 1};
  float x[6];
  const int n = line_floats(&p, end, x, 6);
  if (n < 3) {
    p = skip_blanks(p, end);
    return lines_fail(&o->lines, o->err, "a vertex needs three numbers, but number %d is \"%.*s\"", n + 1,
                      SHOWN(p, end));
  }
  if (o->positions.count / 3 >= CORNER_NONE - 1)
    return lines_fail(&o->lines, o->err, "there are more than 4294967294 vertices; split the file");
  if (n == 6 || o->colors.count) {
    while (o->colors.count < o->positions.count)
      if (!push_floats(o, &o->colors, white, 3)) return false;
    if (!push_floats(o, &o->colors, n == 6 ? x + 3 : white, 3)) return false;
  }
  return push_floats(o, &o->positions, x, 3);
}

static bool read_texcoord(Obj *o, const char *p, const char *end)
{
  float x[2] = {0};
  if (line_floats(&p, end, x, 2) < 1)
    return lines_fail(&o->lines, o->err, "a texture coordinate needs a number, not \"%.*s\"", SHOWN(p, end));
  return push_floats(o, &o->texcoords, x, 2);
}

static bool read_normal(Obj *o, const char *p, const char *end)
{
  float x[3];
  if (line_floats(&p, end, x, 3) < 3)
    return lines_fail(&o->lines, o->err, "a normal needs three numbers, not \"%.*s\"", SHOWN(p, end));
  return push_floats(o, &o->normals, x, 3);
}

// --- faces ------------------------------------------------------------------------------------------
static inline const char *read_index(const char *p, const char *end, int64_t *out)
{
  uint32_t x = 0;
  const char *q = p;
  for (; q < end && q < p + 9 && (unsigned char)(*q - '0') < 10; q++) x = x * 10 + (uint32_t)(*q - '0');
  if (q == p || q == p + 9) return number_int(p, end, out); // a sign, or long
  *out = x;
  return q;
}

// One part of a corner: 1 is the first, -1 the last so far.
static inline bool resolve_index(const Obj *o, int64_t i, size_t count, const char *what, uint32_t *out)
{
  const uint64_t at = i > 0 ? (uint64_t)i - 1 : (uint64_t)i + count;
  if (at >= count || i == 0)
    return lines_fail(&o->lines, o->err, "the face names %s %lld, but %zu came before this line", what,
                      (long long)i, count);
  *out = (uint32_t)at;
  return true;
}

static bool bad_corner(const Obj *o, const char *p, const char *end)
{
  end = skip_word(p, end);
  return lines_fail(&o->lines, o->err, "\"%.*s\" is not a corner of a face; write v, v/t, v//n or v/t/n",
                    SHOWN(p, end));
}

static bool read_corner(Obj *o, const char **p, const char *end)
{
  const char *start = *p, *q;
  int64_t i;
  Corner c = {0, CORNER_NONE, CORNER_NONE, 0};
  q = read_index(start, end, &i);
  if (!q) return bad_corner(o, start, end);
  if (!resolve_index(o, i, o->positions.count / 3, "vertex", &c.position)) return false;
  if (q < end && *q == '/') {
    const char *after = read_index(++q, end, &i);
    if (after && !resolve_index(o, i, o->texcoords.count / 2, "texture coordinate", &c.texcoord))
      return false;
    if (after) q = after;
    if (q < end && *q == '/') {
      after = read_index(++q, end, &i);
      if (after && !resolve_index(o, i, o->normals.count / 3, "normal", &c.normal)) return false;
      if (after) q = after;
    }
  }
  if (q < end && !is_blank(*q)) return bad_corner(o, start, end);
  *p = q;
  const uint32_t vertex = corners_vertex(&o->corners, c.position, c.texcoord, c.normal);
  if (vertex == CORNER_NONE) return no_memory(o);
  return array_push(&o->face, vertex) || no_memory(o);
}

static bool push_slots(Obj *o, size_t triangle_count)
{
  if (o->slot < 0) {
    o->slot = names_add(&o->materials, &o->scene->arena, "", 0);
    if (o->slot < 0) return no_memory(o);
  }
  if (!o->slot && !o->slots.count) return true;
  const size_t before = o->triangles.count / 3;
  if (!array_reserve(&o->slots, before + triangle_count)) return no_memory(o);
  if (!o->slots.count) { // until now all was slot 0; room for all that is to come
    if (!array_reserve(&o->slots, o->triangles.capacity / 3)) return no_memory(o);
    memset(o->slots.items, 0, before * sizeof *o->slots.items);
    o->slots.count = before;
  }
  for (size_t i = 0; i < triangle_count; i++) o->slots.items[o->slots.count++] = (uint16_t)o->slot;
  return true;
}

static bool push_polygon(Obj *o)
{
  const size_t n = o->face.count;
  o->face_points.count = 0;
  for (size_t i = 0; i < n; i++) {
    const size_t position = o->corners.vertices.items[o->face.items[i]].position;
    if (!push_floats(o, &o->face_points, o->positions.items + 3 * position, 3)) return false;
  }
  if (n > UINT32_MAX / 4 || !array_reserve(&o->cut, 3 * (n - 2)) ||
      !triangulate(&o->triangulator, o->face_points.items, (uint32_t)n, o->cut.items))
    return no_memory(o);
  for (size_t i = 0; i < 3 * (n - 2); i++)
    o->triangles.items[o->triangles.count++] = o->face.items[o->cut.items[i]];
  return true;
}

static bool read_face(Obj *o, const char *p, const char *end)
{
  o->face.count = 0;
  if (!corners_grow(&o->corners, o->positions.count / 3)) return no_memory(o);
  for (p = skip_blanks(p, end); p < end && *p != '#'; p = skip_blanks(p, end))
    if (!read_corner(o, &p, end)) return false;
  const size_t n = o->face.count;
  if (n < 3) {
    note_once(&o->scene->notes, "%s: faces with fewer than three corners are left out", o->path);
    return true;
  }
  if (!push_slots(o, n - 2)) return false;
  if (!array_reserve(&o->triangles, o->triangles.count + 3 * (n - 2))) return no_memory(o);
  if (n > 3) return push_polygon(o);
  for (size_t i = 0; i < 3; i++) o->triangles.items[o->triangles.count++] = o->face.items[i];
  return true;
}

// --- other lines ------------------------------------------------------------------------------------
static bool read_usemtl(Obj *o, const char *p, const char *end)
{
  const size_t length = (size_t)(end - p);
  const int32_t found = names_find(&o->materials, p, length);
  if (found < 0 && names_count(&o->materials) >= MOST_SLOTS) {
    note_once(&o->scene->notes, "%s: uses more than %d materials; the rest look like the first", o->path,
              MOST_SLOTS);
    o->slot = 0;
    return true;
  }
  o->slot = found < 0 ? names_add(&o->materials, &o->scene->arena, p, length) : found;
  return o->slot >= 0 || no_memory(o);
}

static bool read_mtllib(Obj *o, const char *p, const char *end)
{
  if (names_count(&o->libraries) >= MOST_LIBRARIES) {
    note_once(&o->scene->notes, "%s: names more than %d material libraries; the rest is ignored", o->path,
              MOST_LIBRARIES);
    return true;
  }
  return names_add(&o->libraries, &o->scene->arena, p, (size_t)(end - p)) >= 0 || no_memory(o);
}

static bool read_object_name(Obj *o, const char *p, const char *end)
{
  if (o->object_count++) return true;
  o->object_name = arena_text_n(&o->scene->arena, p, (size_t)(end - p));
  return o->object_name || no_memory(o);
}

static bool is_keyword(const char *p, const char *end)
{
  if (end - p > 20) return false;
  for (; p < end; p++)
    if (!((*p | 0x20) >= 'a' && (*p | 0x20) <= 'z') && !(*p >= '0' && *p <= '9') && *p != '_') return false;
  return true;
}

// Lines, points, curves, surfaces and what other programs invented: one note for each keyword. The keywords are
// remembered here because asking the notes for every one of a million lines would take its time.
static bool ignore_line(Obj *o, const char *p, const char *end)
{
  if (!is_keyword(p, end)) {
    p = "?";
    end = p + 1;
  }
  const size_t length = (size_t)(end - p);
  if (names_find(&o->ignored, p, length) >= 0 || names_count(&o->ignored) >= MOST_IGNORED) return true;
  if (*p == '?')
    note_once(&o->scene->notes, "%s: lines that are not OBJ are ignored", o->path);
  else
    note_once(&o->scene->notes, "%s: \"%.*s\" lines are ignored", o->path, SHOWN(p, end));
  return names_add(&o->ignored, &o->scene->arena, p, length) >= 0 || no_memory(o);
}

static bool read_keyword(Obj *o, const char *p, const char *end)
{
  const char *after = skip_word(p, end), *rest = skip_blanks(after, end);
  end = trim_end(rest, end);
  if (word_is(p, after, "usemtl")) return read_usemtl(o, rest, end);
  if (word_is(p, after, "mtllib")) return read_mtllib(o, rest, end);
  if (word_is(p, after, "o")) return read_object_name(o, rest, end);
  if (word_is(p, after, "g") || word_is(p, after, "s") || word_is(p, after, "end")) return true;
  return ignore_line(o, p, after);
}

static bool read_lines(Obj *o)
{
  const char *p, *end;
  while (lines_next(&o->lines, &p, &end)) {
    p = skip_blanks(p, end);
    if (p == end || *p == '#') continue;
    const char second = end - p > 1 ? p[1] : ' ', third = end - p > 2 ? p[2] : ' ';
    bool ok;
    if (*p == 'v' && is_blank(second))
      ok = read_position(o, p + 1, end);
    else if (*p == 'f' && is_blank(second))
      ok = read_face(o, p + 1, end);
    else if (*p == 'v' && second == 't' && is_blank(third))
      ok = read_texcoord(o, p + 2, end);
    else if (*p == 'v' && second == 'n' && is_blank(third))
      ok = read_normal(o, p + 2, end);
    else
      ok = read_keyword(o, p, end);
    if (!ok) return false;
  }
  return !o->lines.joined.failed || no_memory(o);
}

// --- materials --------------------------------------------------------------------------------------
// A library that cannot be opened is no failure: the reason is left in *why.
static bool read_library(Obj *o, const char *name, MtlWants *wants, Err *why)
{
  Text file = {0};
  FileBytes bytes = {0};
  const bool allow_outside = o->options && o->options->allow_outside;
  const char *root = o->options ? o->options->root : NULL;
  bool ok = true;
  if (path_resolve(&file, o->path, name, root, allow_outside, why)) {
    const bool is_read = file_read(&bytes, text_get(&file), why);
    ok = cache_add_content(o->scene, text_get(&file), is_read ? &bytes : NULL, o->options) || no_memory(o);
    if (ok && is_read) ok = import_mtl(wants, text_get(&file), &bytes, o->err);
  }
  file_release(&bytes);
  text_finish(&file);
  return ok;
}

// "mtllib a.mtl b.mtl" names two files, "mtllib my scene.mtl" one: the whole rest of the line is tried first.
static bool read_library_line(Obj *o, const char *names, MtlWants *wants)
{
  Err why = {0};
  if (!read_library(o, names, wants, &why)) return false;
  if (!why.kind) return true;
  const char *end = names + strlen(names);
  Text one = {0};
  bool ok = true;
  for (const char *p = names, *after; ok && p < end; p = skip_blanks(after, end)) {
    after = skip_word(p, end);
    text_clear(&one);
    text_add_n(&one, p, (size_t)(after - p));
    why = (Err){0};
    ok = read_library(o, text_get(&one), wants, &why);
    if (why.kind)
      note_once(&o->scene->notes, "%s: a material library is left out: %.400s", o->path, why.text);
  }
  text_finish(&one);
  return ok;
}

// slot -> material. A name that no library defines shows the default material.
static bool find_materials(Obj *o, int32_t *slots, size_t count)
{
  for (size_t i = 0; i < count; i++) slots[i] = -1;
  MtlWants wants = {
      .scene = o->scene, .obj_path = o->path, .options = o->options, .names = &o->materials, .found = slots};
  bool ok = true;
  for (size_t i = 0; ok && i < names_count(&o->libraries); i++)
    ok = read_library_line(o, names_get(&o->libraries, (int32_t)i), &wants);
  table_finish(&wants.textures);
  if (!ok) return false;
  for (size_t i = 0; i < count; i++) {
    const char *name = names_get(&o->materials, (int32_t)i);
    if (slots[i] < 0 && name[0] && names_count(&o->libraries))
      note_once(&o->scene->notes, "%s: material \"%.60s\" is not defined in its libraries; it looks grey",
                o->path, name);
  }
  return true;
}

// Vertex colours multiply the base colour, so faces without a material get a white one.
static bool whiten_default(Obj *o, int32_t *slots, size_t count)
{
  int32_t white = -1;
  for (size_t i = 0; i < count; i++) {
    if (slots[i] >= 0) continue;
    if (white < 0) white = scene_add_material(o->scene, MATERIAL_PBR, "vertex colors");
    if (white < 0) return no_memory(o);
    for (int k = 0; k < 3; k++) o->scene->materials.items[white].pbr.base_color[k] = 1;
    slots[i] = white;
  }
  return true;
}

// --- normals ----------------------------------------------------------------------------------------
static bool is_direction(const float *n)
{
  const Vec3 v = v3_load(n);
  const float length2 = v3_dot(v, v);
  return length2 > 0 && isfinite(length2);
}

static Vec3 face_normal(const Obj *o, const uint32_t *triangle)
{
  Vec3 p[3];
  for (int k = 0; k < 3; k++)
    p[k] = v3_load(o->positions.items + 3 * (size_t)o->corners.vertices.items[triangle[k]].position);
  const Vec3 n = v3_normalize(v3_cross(p[1] - p[0], p[2] - p[0]));
  return v3_is_finite(n) && !v3_is_zero(n) ? n : v3(0, 1, 0);
}

// Forgets normals that point nowhere. True in *some when a vertex has a normal, in *all when all have.
static void survey_normals(Obj *o, bool *some, bool *all)
{
  *some = false;
  *all = true;
  for (size_t i = 0; i < o->corners.vertices.count; i++) {
    Corner *c = &o->corners.vertices.items[i];
    if (c->normal != CORNER_NONE && !is_direction(o->normals.items + 3 * (size_t)c->normal))
      c->normal = CORNER_NONE;
    *some = *some || c->normal != CORNER_NONE;
    *all = *all && c->normal != CORNER_NONE;
  }
}

// Gives the triangle's corners without a normal the face's. The first triangle at a vertex keeps it, later ones
// get copies; `first_made` is where the normals made here begin.
static bool complete_triangle(Obj *o, uint32_t *triangle, size_t first_made)
{
  const size_t mine = o->normals.count / 3;
  for (int k = 0; k < 3; k++) {
    Corner *c = &o->corners.vertices.items[triangle[k]];
    if (c->normal != CORNER_NONE && (c->normal < first_made || c->normal == mine)) continue;
    if (o->normals.count == 3 * mine) {
      float n[3];
      v3_store(n, face_normal(o, triangle));
      if (mine >= CORNER_NONE || !push_floats(o, &o->normals, n, 3)) return no_memory(o);
    }
    if (c->normal == CORNER_NONE) {
      c->normal = (uint32_t)mine;
      continue;
    }
    Corner copy = *c;
    copy.normal = (uint32_t)mine;
    triangle[k] = (uint32_t)o->corners.vertices.count;
    if (o->corners.vertices.count >= CORNER_NONE || !array_push(&o->corners.vertices, copy))
      return no_memory(o);
  }
  return true;
}

static bool complete_normals(Obj *o)
{
  bool some, all;
  survey_normals(o, &some, &all);
  if (!some) o->normals.count = 0;
  if (!some || all) return true;
  const size_t first_made = o->normals.count / 3;
  for (size_t t = 0; t < o->triangles.count; t += 3)
    if (!complete_triangle(o, o->triangles.items + t, first_made)) return false;
  return true;
}

// --- the mesh ---------------------------------------------------------------------------------------
// Each of these frees what it was made from, so that no more than one array exists twice.
static bool build_positions(Obj *o, MeshData *m)
{
  const size_t n = m->vertex_count;
  m->positions = mem_alloc(n, 3 * sizeof(float));
  if (!m->positions) return no_memory(o);
  for (size_t i = 0; i < n; i++)
    memcpy(m->positions + 3 * i, o->positions.items + 3 * (size_t)o->corners.vertices.items[i].position,
           3 * sizeof(float));
  array_finish(&o->positions);
  return true;
}

static bool build_texcoords(Obj *o, MeshData *m)
{
  if (!o->texcoords.count) return true;
  float *to = m->texcoords[0] = mem_zero(m->vertex_count, 2 * sizeof(float));
  if (!to) return no_memory(o);
  for (size_t i = 0; i < m->vertex_count; i++) {
    const size_t from = o->corners.vertices.items[i].texcoord;
    if (from != CORNER_NONE) memcpy(to + 2 * i, o->texcoords.items + 2 * from, 2 * sizeof(float));
  }
  array_finish(&o->texcoords);
  return true;
}

static bool build_normals(Obj *o, MeshData *m)
{
  if (!o->normals.count) return true;
  m->normals = mem_alloc(m->vertex_count, 3 * sizeof(float));
  if (!m->normals) return no_memory(o);
  for (size_t i = 0; i < m->vertex_count; i++) {
    // A corner that no triangle uses can be without a normal still.
    const size_t from = o->corners.vertices.items[i].normal;
    const Vec3 n = from == CORNER_NONE ? v3(0, 1, 0) : v3_load(o->normals.items + 3 * from);
    v3_store(m->normals + 3 * i, v3_normalize(n));
  }
  array_finish(&o->normals);
  return true;
}

// Colours are 0..1 in sRGB, as Blender and MeshLab write them; a value above 1 shows that the file counts to 255.
static bool build_colors(Obj *o, MeshData *m)
{
  if (!o->colors.count) return true;
  m->colors = mem_alloc(m->vertex_count, 4 * sizeof(float));
  if (!m->colors) return no_memory(o);
  float most = 0;
  for (size_t i = 0; i < o->colors.count; i++) most = max_f(most, o->colors.items[i]);
  const float unit = most > 1 ? 1 / 255.0f : 1;
  for (size_t i = 0; i < m->vertex_count; i++) {
    const float *from = o->colors.items + 3 * (size_t)o->corners.vertices.items[i].position;
    for (int k = 0; k < 3; k++) m->colors[4 * i + k] = srgb_decode(clamp_f(from[k] * unit, 0, 1));
    m->colors[4 * i + 3] = 1;
  }
  array_finish(&o->colors);
  return true;
}

static bool build_mesh(Obj *o, MeshData *m)
{
  if (!o->triangles.count) return err_set(o->err, ERR_BAD_SCENE, "%s: holds no triangles", o->path);
  array_finish(&o->corners.heads);
  if (!complete_normals(o)) return false;
  m->vertex_count = o->corners.vertices.count;
  m->triangle_count = o->triangles.count / 3;
  if (!build_colors(o, m) || !build_positions(o, m) || !build_normals(o, m) || !build_texcoords(o, m))
    return false;
  m->triangles = o->triangles.items;
  m->material_slots = o->slots.items;
  o->triangles.items = NULL;
  o->slots.items = NULL;
  return true;
}

static bool add_to_scene(Obj *o)
{
  const bool has_colors = o->colors.count;
  const size_t slot_count = names_count(&o->materials);
  int32_t *slots = NULL;
  MeshData *m = mesh_data_create();
  bool ok = false;
  if (!m) {
    no_memory(o);
    goto done;
  }
  if (!build_mesh(o, m)) goto done;
  slots = mem_alloc(slot_count, sizeof *slots);
  if (!slots) {
    no_memory(o);
    goto done;
  }
  if (!find_materials(o, slots, slot_count)) goto done;
  if (has_colors && !whiten_default(o, slots, slot_count)) goto done;
  if (o->triangulator.fan_count)
    note_once(&o->scene->notes, "%s: %zu polygons cross themselves or are too large to cut well", o->path,
              o->triangulator.fan_count);
  ok = import_add_mesh(o->scene, o->path, o->object_count == 1 ? o->object_name : NULL, m, slots, slot_count,
                       o->err);
  m = NULL;
done:
  mesh_data_release(m);
  mem_free(slots);
  return ok;
}

static void obj_finish(Obj *o)
{
  lines_finish(&o->lines);
  array_finish(&o->positions);
  array_finish(&o->texcoords);
  array_finish(&o->normals);
  array_finish(&o->colors);
  corners_finish(&o->corners);
  array_finish(&o->triangles);
  array_finish(&o->slots);
  names_finish(&o->materials);
  names_finish(&o->libraries);
  names_finish(&o->ignored);
  array_finish(&o->face);
  array_finish(&o->cut);
  array_finish(&o->face_points);
  triangulator_finish(&o->triangulator);
}

bool import_obj(Scene *s, const char *path, const LoadOptions *options, Err *err)
{
  FileBytes file;
  if (!file_read(&file, path, err)) return false;
  Obj o = {.scene = s, .path = path, .options = options, .err = err, .slot = -1};
  triangulator_init(&o.triangulator);
  lines_init(&o.lines, path, file.data, file.size);
  o.lines.joins_lines = true;
  const bool ok = reserve_all(&o) && read_lines(&o) && add_to_scene(&o);
  obj_finish(&o);
  file_release(&file);
  return ok;
}
