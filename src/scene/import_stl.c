// STL, ASCII and binary. The format knows only loose triangles, so corners at the same place are made one vertex by
// a hash; there are no vertex normals, and shading is flat. Normals a facet and colours (two incompatible ways to
// abuse the attribute bytes) are ignored. Several solids in a file become one mesh.
//
// A binary file may begin with "solid", too; what decides is whether its size is that of its triangle count.

#include "scene/import.h"
#include "scene/lines.h"

#include "base/file.h"
#include "base/hash.h"

enum { HEADER_SIZE = 84, FACET_SIZE = 50, LONGEST_PROBE = 128 };

typedef struct Stl {
  Scene *scene;
  const char *path;
  Err *err;
  ARRAY(float) positions;
  ARRAY(uint32_t) triangles;
  ARRAY(uint32_t) table; // vertex numbers by place, open addressing; its count is a power of two
  size_t in_table;
  const char *name; // of the first solid
} Stl;

static bool no_memory(const Stl *f)
{
  return err_memory(f->err, f->path, 0);
}

// --- vertices ---------------------------------------------------------------------------------------
static size_t place_hash(const float p[3])
{
  uint32_t b[3];
  memcpy(b, p, sizeof b);
  return hash_u64(hash_u64((uint64_t)b[0] << 32 | b[1]) + b[2]);
}

// The vertex's place in the table, or the free one where it belongs. NULL after a long search: a file can be made so
// that all hash alike, and must not take quadratic time; its vertices then stay apart.
static uint32_t *find_place(Stl *f, const float p[3])
{
  const size_t mask = f->table.count - 1;
  size_t at = place_hash(p) & mask;
  for (int i = 0; i < LONGEST_PROBE; i++, at = (at + 1) & mask) {
    uint32_t *place = &f->table.items[at];
    if (*place == UINT32_MAX || !memcmp(f->positions.items + 3 * (size_t)*place, p, 3 * sizeof *p))
      return place;
  }
  return NULL;
}

static bool grow_table(Stl *f, size_t wanted)
{
  array_finish(&f->table);
  if (!array_reserve(&f->table, wanted)) return no_memory(f);
  f->table.count = wanted;
  f->in_table = 0;
  memset(f->table.items, 0xff, wanted * sizeof *f->table.items);
  for (size_t i = 0; i < f->positions.count / 3; i++) {
    uint32_t *place = find_place(f, f->positions.items + 3 * i);
    if (!place || *place != UINT32_MAX) continue;
    *place = (uint32_t)i;
    f->in_table++;
  }
  return true;
}

static bool add_vertex(Stl *f, const float read[3], uint32_t *out)
{
  const float p[3] = {read[0] + 0, read[1] + 0, read[2] + 0}; // -0 becomes 0
  if (2 * (f->in_table + 1) > f->table.count && !grow_table(f, f->table.count ? 2 * f->table.count : 1024))
    return false;
  uint32_t *place = find_place(f, p);
  if (place && *place != UINT32_MAX) return *out = *place, true;
  const size_t count = f->positions.count / 3;
  if (count >= UINT32_MAX - 1)
    return err_set(f->err, ERR_BAD_SCENE, "%s: holds more than 4294967294 vertices; split the file", f->path);
  if (!array_reserve(&f->positions, 3 * count + 3)) return no_memory(f);
  memcpy(f->positions.items + 3 * count, p, sizeof p);
  f->positions.count += 3;
  if (place) {
    *place = (uint32_t)count;
    f->in_table++;
  }
  *out = (uint32_t)count;
  return true;
}

static bool add_corner(Stl *f, const float p[3])
{
  uint32_t v = 0;
  return add_vertex(f, p, &v) && (array_push(&f->triangles, v) || no_memory(f));
}

// --- binary -----------------------------------------------------------------------------------------
static uint32_t facet_count(const FileBytes *file)
{
  uint32_t n;
  memcpy(&n, file->data + HEADER_SIZE - 4, sizeof n);
  return n;
}

static bool read_binary(Stl *f, const FileBytes *file)
{
  if (file->size < HEADER_SIZE)
    return err_set(f->err, ERR_BAD_SCENE,
                   "%s: byte %zu: an STL file has 84 bytes at least; this is none, or cut off", f->path,
                   file->size);
  const size_t n = facet_count(file), most = (file->size - HEADER_SIZE) / FACET_SIZE;
  if (n > most)
    return err_set(
        f->err, ERR_BAD_SCENE,
        "%s: byte 80: promises %zu triangles, but there are bytes for %zu; the file is cut off or no STL",
        f->path, n, most);
  // A closed mesh has half as many vertices as triangles; the table is twice that, and a power of two.
  size_t table_size = 1024;
  while (table_size < n) table_size *= 2;
  if (!grow_table(f, table_size)) return false;
  if (!array_reserve(&f->triangles, 3 * n) || !array_reserve(&f->positions, 3 * (n / 2 + 2)))
    return no_memory(f);
  bool has_attributes = !!memmem(file->data, HEADER_SIZE - 4, "COLOR=", 6);
  for (size_t i = 0; i < n; i++) {
    const uint8_t *facet = file->data + HEADER_SIZE + i * FACET_SIZE;
    for (size_t k = 0; k < 3; k++) {
      float p[3];
      memcpy(p, facet + 12 + 12 * k, sizeof p);
      if (!add_corner(f, p)) return false;
    }
    has_attributes = has_attributes || facet[48] || facet[49];
  }
  if (has_attributes)
    note_once(&f->scene->notes, "%s: the colour bytes of the triangles are ignored", f->path);
  if (file->size != HEADER_SIZE + n * FACET_SIZE)
    note_once(&f->scene->notes, "%s: %zu bytes after the last triangle are ignored", f->path,
              file->size - HEADER_SIZE - n * FACET_SIZE);
  return true;
}

// --- ASCII ------------------------------------------------------------------------------------------
static bool is_ascii(const FileBytes *file)
{
  if (file->size >= HEADER_SIZE && file->size == HEADER_SIZE + (size_t)facet_count(file) * FACET_SIZE)
    return false;
  // Text holds no zero bytes; a count of triangles below 16 million does.
  if (memchr(file->data, 0, file->size < HEADER_SIZE ? file->size : HEADER_SIZE)) return false;
  Lines lines;
  lines_init(&lines, "", file->data, file->size);
  const char *p, *end;
  bool was_solid = false;
  for (int i = 0; i < 100 && lines_next(&lines, &p, &end); i++) {
    p = skip_blanks(p, end);
    end = skip_word(p, end);
    if (p == end) continue;
    if (was_solid) return word_is(p, end, "facet") || word_is(p, end, "endsolid");
    if (!word_is(p, end, "solid")) return false;
    was_solid = true;
  }
  return was_solid;
}

// The corners of the loop that are read; a facet is three.
typedef struct Loop {
  size_t corner_count;
  bool is_open;
} Loop;

static bool read_vertex(Stl *f, const Lines *lines, Loop *loop, const char *p, const char *end)
{
  float x[3];
  if (!loop->is_open || loop->corner_count == 3)
    return lines_fail(lines, f->err,
                      "a vertex stands where none belongs; a facet has three, inside \"outer loop\"");
  if (line_floats(&p, end, x, 3) < 3) return lines_fail(lines, f->err, "a vertex needs three numbers");
  loop->corner_count++;
  return add_corner(f, x);
}

static bool read_ascii_line(Stl *f, const Lines *lines, Loop *loop, const char *p, const char *end)
{
  const char *after = skip_word(p, end);
  if (word_is(p, after, "vertex")) return read_vertex(f, lines, loop, after, end);
  if (word_is(p, after, "facet")) return true;
  if (word_is(p, after, "outer")) {
    if (loop->is_open) return lines_fail(lines, f->err, "a loop begins inside another");
    *loop = (Loop){.is_open = true};
    return true;
  }
  if (word_is(p, after, "endloop")) {
    if (loop->corner_count != 3 || !loop->is_open)
      return lines_fail(lines, f->err, "a facet has %zu corners instead of three", loop->corner_count);
    *loop = (Loop){0};
    return true;
  }
  if (word_is(p, after, "solid") && !f->name) {
    p = skip_blanks(after, end);
    f->name = arena_text_n(&f->scene->arena, p, (size_t)(trim_end(p, end) - p));
    return f->name || no_memory(f);
  }
  if (word_is(p, after, "endfacet") || word_is(p, after, "endsolid") || word_is(p, after, "solid"))
    return true;
  return lines_fail(lines, f->err, "\"%.*s\" is no word of an STL file", SHOWN(p, after));
}

static bool read_ascii(Stl *f, const FileBytes *file)
{
  Lines lines;
  Loop loop = {0};
  const char *p, *end;
  lines_init(&lines, f->path, file->data, file->size);
  while (lines_next(&lines, &p, &end)) {
    p = skip_blanks(p, end);
    if (p < end && !read_ascii_line(f, &lines, &loop, p, end)) return false;
  }
  return !loop.is_open || lines_fail(&lines, f->err, "the file ends inside a facet; it is cut off");
}

// --- the mesh ---------------------------------------------------------------------------------------
static bool add_to_scene(Stl *f)
{
  MeshData *m = mesh_data_create();
  if (!m) return no_memory(f);
  m->vertex_count = f->positions.count / 3;
  m->triangle_count = f->triangles.count / 3;
  m->positions = f->positions.items;
  m->triangles = f->triangles.items;
  f->positions.items = NULL;
  f->triangles.items = NULL;
  return import_add_mesh(f->scene, f->path, f->name, m, NULL, 0, f->err);
}

bool import_stl(Scene *s, const char *path, const LoadOptions *options, Err *err)
{
  (void)options; // an STL file names no others
  FileBytes file;
  if (!file_read(&file, path, err)) return false;
  Stl f = {.scene = s, .path = path, .err = err};
  const bool ok = (is_ascii(&file) ? read_ascii(&f, &file) : read_binary(&f, &file)) && add_to_scene(&f);
  array_finish(&f.positions);
  array_finish(&f.triangles);
  array_finish(&f.table);
  file_release(&file);
  return ok;
}
