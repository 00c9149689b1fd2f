// The elements of NoEucRT, an earlier ray tracer, become cells and gates of a scene. Its files are OBJ meshes with a few
// lines more, and the same letter means different things in each kind of element; the kind is not in the file:
//
//   portal    c x y z, its centre; e x y z, the exit: what meets its surface goes on from e - c further, as it came
//   warped    a box; d x y z, the axis; i, the intensity; c 0 expands, all else compresses. Its length for who is inside
//             is L / (1 + i), or L / (1 - i): a cell of that length between gates at its ends
//   shrink    a box; d; i, the size one has at the end, of 1; l, the length over which. Inside, a metre is as long as
//             one's size there, so the cell is l ln(1 / i) / (1 - i) long and wider by 1 / i at its end
//   rotation  a box along z; d; a, the axis, here that of travel only; i, degrees over l: a cell that is wrung
//   material  no mesh, but ka, kd, ks and ns, one number each: a phong material
//
// Each is written as scene text and read by the reader of scene files, so what it makes can be written by hand. The
// sides of boxes become walls; the original left them to other meshes. Only boxes along the axes are tunnels, as there.

#include "scene/import.h"
#include "scene/lines.h"

#include "base/array.h"
#include "base/file.h"
#include "base/vec.h"

#include <math.h>
#include <strings.h>

enum { RINGS = 24, ACROSS = 6 };

typedef enum ElementKind { ELEMENT_PORTAL, ELEMENT_WARPED, ELEMENT_SHRINK, ELEMENT_ROTATION, ELEMENT_MATERIAL, ELEMENT_KINDS } ElementKind;
static const char *const kind_names[ELEMENT_KINDS] = {"portal", "warped", "shrink", "rotation", "material"};

// The records of an element: which letters, and how many numbers each holds; 0: the kind does not know it.
typedef enum RecordName { RECORD_C, RECORD_E, RECORD_D, RECORD_I, RECORD_L, RECORD_A, RECORD_KA, RECORD_KD, RECORD_KS, RECORD_NS, RECORD_COUNT } RecordName;
static const char *const record_names[RECORD_COUNT] = {"c", "e", "d", "i", "l", "a", "ka", "kd", "ks", "ns"};
static const uint8_t numbers_of[ELEMENT_KINDS][RECORD_COUNT] = {
    [ELEMENT_PORTAL] = {[RECORD_C] = 3, [RECORD_E] = 3},
    [ELEMENT_WARPED] = {[RECORD_C] = 1, [RECORD_D] = 3, [RECORD_I] = 1},
    [ELEMENT_SHRINK] = {[RECORD_C] = 1, [RECORD_D] = 3, [RECORD_I] = 1, [RECORD_L] = 1},
    [ELEMENT_ROTATION] = {[RECORD_D] = 3, [RECORD_I] = 1, [RECORD_L] = 1, [RECORD_A] = 3},
    [ELEMENT_MATERIAL] = {[RECORD_KA] = 1, [RECORD_KD] = 1, [RECORD_KS] = 1, [RECORD_NS] = 1},
};

typedef struct Record {
  size_t line; // 0: not there
  float x[3];
} Record;

typedef struct Element {
  Scene *scene;
  const char *path;
  Err *err;
  Lines lines;
  ElementKind kind;
  Record records[RECORD_COUNT];
  ARRAY(Vec3) vertices;
  ARRAY(uint32_t) corners;
  Vec3 lo, hi;
  Text out;
} Element;

// --- reading ------------------------------------------------------------------------------------------
static bool fail_at(const Element *e, RecordName r, const char *says)
{
  return err_set(e->err, ERR_BAD_SCENE, "%s:%zu: \"%s\" %s", e->path, e->records[r].line, record_names[r], says);
}

static bool read_vertex(Element *e, const char *p, const char *end)
{
  float x[3];
  if (line_floats(&p, end, x, 3) != 3) return lines_fail(&e->lines, e->err, "a vertex has three numbers: v x y z");
  const Vec3 v = {x[0], x[1], x[2]};
  for (int k = 0; k < 3; k++)
    if (!isfinite(v[k])) return lines_fail(&e->lines, e->err, "a vertex must be finite");
  return array_push(&e->vertices, v) || err_memory(e->err, e->path, 0);
}

// The first three corners, as the original; of 4/7 the 4 counts.
static bool read_face(Element *e, const char *p, const char *end)
{
  for (int k = 0; k < 3; k++) {
    float x;
    p = skip_blanks(p, end);
    const char *stop = number_float(p, end, &x);
    if (!stop || stop == p || (stop < end && !is_blank(*stop) && *stop != '/'))
      return lines_fail(&e->lines, e->err, "a face has three corners, numbers of vertices: f a b c");
    if (!(x >= 1) || x > (float)e->vertices.count || x != floorf(x))
      return lines_fail(&e->lines, e->err, "corner %.9g is not among the %zu vertices above; they count from 1", (double)x, e->vertices.count);
    if (!array_push(&e->corners, (uint32_t)x - 1)) return err_memory(e->err, e->path, 0);
    p = skip_word(stop, end);
  }
  if (skip_blanks(p, end) < end)
    note_once(&e->scene->notes, "%s:%zu: of a face only the first three corners count", e->path, e->lines.number);
  return true;
}

static bool read_record(Element *e, RecordName r, const char *p, const char *end)
{
  Record *record = &e->records[r];
  const int count = numbers_of[e->kind][r];
  if (line_floats(&p, end, record->x, count) != count)
    return lines_fail(&e->lines, e->err, "\"%s\" of a %s takes %s", record_names[r], kind_names[e->kind], count == 1 ? "a number" : "three numbers");
  for (int k = 0; k < count; k++)
    if (!isfinite(record->x[k])) return lines_fail(&e->lines, e->err, "\"%s\" must be finite", record_names[r]);
  record->line = e->lines.number;
  return true;
}

static bool read_line(Element *e, const char *p, const char *end)
{
  p = skip_blanks(p, end);
  const char *stop = skip_word(p, end);
  if (p == stop || *p == '#') return true;
  for (RecordName r = 0; r < RECORD_COUNT; r++)
    if (numbers_of[e->kind][r] && word_is(p, stop, record_names[r])) return read_record(e, r, stop, end);
  if (e->kind != ELEMENT_MATERIAL) {
    if (word_is(p, stop, "v")) return read_vertex(e, stop, end);
    if (word_is(p, stop, "f")) return read_face(e, stop, end);
    if (word_is(p, stop, "vt")) return true;
  }
  note_once(&e->scene->notes, "%s:%zu: \"%.*s\" means nothing in a %s and is ignored", e->path, e->lines.number, SHOWN(p, stop), kind_names[e->kind]);
  return true;
}

static bool need(const Element *e, RecordName r, const char *what)
{
  return e->records[r].line || err_set(e->err, ERR_BAD_SCENE, "%s: a %s needs a line \"%s\", %s", e->path, kind_names[e->kind], record_names[r], what);
}

static bool read_file(Element *e)
{
  FileBytes file;
  if (!file_read(&file, e->path, e->err)) return false;
  const char *line, *end;
  bool ok = true;
  lines_init(&e->lines, e->path, file.data, file.size);
  while (ok && lines_next(&e->lines, &line, &end)) ok = read_line(e, line, end);
  lines_finish(&e->lines);
  file_release(&file);
  if (ok && e->kind != ELEMENT_MATERIAL && !e->corners.count)
    ok = err_set(e->err, ERR_BAD_SCENE, "%s: a %s needs a mesh: lines \"v x y z\" and \"f a b c\"", e->path, kind_names[e->kind]);
  for (size_t i = 0; ok && i < e->corners.count; i++) {
    const Vec3 p = e->vertices.items[e->corners.items[i]];
    for (int k = 0; k < 3; k++) {
      e->lo[k] = i ? fminf(e->lo[k], p[k]) : p[k];
      e->hi[k] = i ? fmaxf(e->hi[k], p[k]) : p[k];
    }
  }
  return ok;
}

// --- writing ------------------------------------------------------------------------------------------
static void add_vec(Text *t, const char *name, Vec3 v)
{
  text_add(t, "\"%s\": [%.7g, %.7g, %.7g]", name, (double)(v[0] + 0), (double)(v[1] + 0), (double)(v[2] + 0));
}

// A rectangle across an axis, of a box's size there, that faces along it or against: the fields of a gate or quad.
static void add_rect(Text *t, Vec3 middle, Vec3 extent, int axis, bool is_forward, float roll)
{
  const Vec3 turns[3] = {{0, is_forward ? 90 : -90, 0}, {is_forward ? -90 : 90, 0, 0}, {0, is_forward ? 0 : 180, roll}};
  const float width = extent[axis == 0 ? 2 : 0], height = extent[axis == 1 ? 2 : 1];
  text_add(t, "\"kind\": \"rect\", \"size\": [%.7g, %.7g], ", (double)width, (double)height);
  add_vec(t, "translate", middle);
  text_add(t, ", ");
  add_vec(t, "rotate", turns[axis]);
}

static void add_wall(Text *t, const char *name, Vec3 middle, Vec3 extent, int axis, bool is_forward)
{
  const Vec3 turns[3] = {{0, is_forward ? 90 : -90, 0}, {is_forward ? -90 : 90, 0, 0}, {0, is_forward ? 0 : 180, 0}};
  text_add(t, "{ \"name\": \"%s\", \"cell\": \"tunnel\", \"shape\": { \"kind\": \"quad\", \"size\": [%.7g, %.7g] }, ", name,
           (double)extent[axis == 0 ? 2 : 0], (double)extent[axis == 1 ? 2 : 1]);
  add_vec(t, "translate", middle);
  text_add(t, ", ");
  add_vec(t, "rotate", turns[axis]);
  text_add(t, " }");
}

// --- portal -------------------------------------------------------------------------------------------
static bool is_box(const Element *e)
{
  const float slack = 1e-5f * v3_length(e->hi - e->lo);
  unsigned seen = 0; // of its eight corners
  for (size_t i = 0; i < e->corners.count; i++) {
    const Vec3 p = e->vertices.items[e->corners.items[i]];
    unsigned corner = 0;
    for (int k = 0; k < 3; k++) {
      if (e->hi[k] - e->lo[k] <= slack || (p[k] > e->lo[k] + slack && p[k] < e->hi[k] - slack)) return false;
      corner |= (unsigned)(p[k] >= e->hi[k] - slack) << k;
    }
    seen |= 1u << corner;
  }
  return seen == 255;
}

static bool same_place(const Element *e, uint32_t a, uint32_t b)
{
  return v3_length(e->vertices.items[a] - e->vertices.items[b]) <= 1e-6f * v3_length(e->hi - e->lo);
}

// Whether an edge has no triangle on its other side.
static bool is_border(const Element *e, uint32_t a, uint32_t b)
{
  for (size_t i = 0; i < e->corners.count; i++)
    if (same_place(e, e->corners.items[i], b) && same_place(e, e->corners.items[i % 3 == 2 ? i - 2 : i + 1], a)) return false;
  return true;
}

static bool next_border(const Element *e, uint32_t from, uint32_t *to)
{
  for (size_t i = 0; i < e->corners.count; i++) {
    const uint32_t a = e->corners.items[i], b = e->corners.items[i % 3 == 2 ? i - 2 : i + 1];
    if (same_place(e, a, from) && !same_place(e, a, b) && is_border(e, a, b)) return *to = b, true;
  }
  return false;
}

// The outline, counter-clockwise seen from the front. Quadratic, which for a door is nothing; large meshes are refused.
static int outline_of(const Element *e, uint32_t out[MOST_POINTS])
{
  uint32_t first = 0, next;
  bool has_first = false;
  for (size_t i = 0; !has_first && i < e->corners.count; i++) has_first = next_border(e, first = e->corners.items[i], &next);
  if (!has_first) return 0;
  int count = 0;
  uint32_t at = first;
  do {
    if (count == MOST_POINTS) return 0;
    out[count++] = at;
    if (!next_border(e, at, &at)) return 0;
  } while (!same_place(e, at, first));
  return count;
}

static bool portal_normal(const Element *e, Vec3 *n)
{
  Vec3 sum = {0, 0, 0};
  for (size_t i = 0; i < e->corners.count; i += 3) {
    const Vec3 a = e->vertices.items[e->corners.items[i]];
    sum += v3_cross(e->vertices.items[e->corners.items[i + 1]] - a, e->vertices.items[e->corners.items[i + 2]] - a);
  }
  const float size = v3_length(e->hi - e->lo);
  if (!(v3_length(sum) > 1e-9f * size * size)) return false;
  *n = sum / v3_length(sum);
  for (size_t i = 0; i < e->corners.count; i++)
    if (fabsf(v3_dot(*n, e->vertices.items[e->corners.items[i]] - e->lo) - v3_dot(*n, e->vertices.items[e->corners.items[0]] - e->lo)) > 1e-4f * size)
      return false;
  return true;
}

static bool make_portal(Element *e)
{
  if (!need(e, RECORD_C, "its centre") || !need(e, RECORD_E, "where one comes out")) return false;
  enum { MOST_TRIANGLES = 1024 };
  const Record *c = &e->records[RECORD_C], *exit = &e->records[RECORD_E];
  const Vec3 middle = (e->lo + e->hi) * 0.5f, shift = {exit->x[0] - c->x[0], exit->x[1] - c->x[1], exit->x[2] - c->x[2]};
  if (v3_length(shift) == 0) return fail_at(e, RECORD_E, "is the centre \"c\" itself: this portal leads to where it is");
  Vec3 n, rotate = {0, 0, 0};
  uint32_t outline[MOST_POINTS];
  Text *t = &e->out;
  text_add(t, "{ \"rayfold\": 1, \"gates\": { \"portal\": { ");
  if (is_box(e)) {
    text_add(t, "\"kind\": \"box\", ");
    add_vec(t, "size", e->hi - e->lo);
  } else {
    const bool is_flat = portal_normal(e, &n);
    const int count = is_flat && e->corners.count <= 3 * MOST_TRIANGLES ? outline_of(e, outline) : 0;
    if (count < LEAST_POINTS)
      return err_set(e->err, ERR_BAD_SCENE, "%s: a portal must be flat with one outline of at most %d corners, or a box along the axes; %s",
                     e->path, MOST_POINTS, is_flat ? "this one's triangles have another border" : "this mesh is neither");
    // z onto n by a turn about x, then y.
    const float a = asinf(fmaxf(-1, fminf(1, -n[1]))), b = n[0] == 0 && n[2] == 0 ? 0 : atan2f(n[0], n[2]);
    const Vec3 x = {cosf(b), 0, -sinf(b)}, y = {sinf(a) * sinf(b), cosf(a), sinf(a) * cosf(b)};
    rotate = (Vec3){a, b, 0} * 57.29577951f;
    text_add(t, "\"kind\": \"polygon\", \"points\": [");
    for (int i = 0; i < count; i++) {
      const Vec3 p = e->vertices.items[outline[i]] - middle;
      text_add(t, "%s[%.7g, %.7g]", i ? ", " : "", (double)v3_dot(p, x), (double)v3_dot(p, y));
    }
    text_add(t, "]");
  }
  text_add(t, ", ");
  add_vec(t, "translate", middle);
  text_add(t, ", ");
  add_vec(t, "rotate", rotate);
  text_add(t, ", ");
  add_vec(t, "to_translate", middle + shift);
  text_add(t, ", ");
  add_vec(t, "to_rotate", rotate);
  text_add(t, " } } }");
  return true;
}

// --- tunnels ------------------------------------------------------------------------------------------
typedef struct Tunnel {
  int axis;
  bool is_forward;   // one travels towards larger coordinates
  Vec3 extent, near; // near: the middle of the end that one goes in by
  float length, inner_length;
} Tunnel;

static Vec3 along(const Tunnel *t, Vec3 p, float by)
{
  p[t->axis] += t->is_forward ? by : -by;
  return p;
}

static bool find_tunnel(Element *e, Tunnel *t)
{
  if (!need(e, RECORD_D, "its axis") || !need(e, RECORD_I, "how much it does")) return false;
  if (!is_box(e)) return err_set(e->err, ERR_BAD_SCENE, "%s: a %s tunnel must be a box along the axes", e->path, kind_names[e->kind]);
  const float *d = e->records[RECORD_D].x;
  const int count = (d[0] != 0) + (d[1] != 0) + (d[2] != 0);
  if (count != 1) return fail_at(e, RECORD_D, count ? "must lie along x, y or z: other tunnels are not boxes along the axes" : "must not be 0");
  t->axis = d[0] != 0 ? 0 : d[1] != 0 ? 1 : 2;
  t->is_forward = d[t->axis] > 0;
  t->extent = e->hi - e->lo;
  t->length = t->inner_length = t->extent[t->axis];
  t->near = (e->lo + e->hi) * 0.5f;
  t->near[t->axis] = t->is_forward ? e->lo[t->axis] : e->hi[t->axis];
  return true;
}

static bool find_length(Element *e, Tunnel *t)
{
  if (!need(e, RECORD_L, "its length")) return false;
  t->length = t->inner_length = e->records[RECORD_L].x[0];
  return t->length > 0 || fail_at(e, RECORD_L, "must be larger than 0: over no length nothing can change");
}

// Gates at both ends of the box, and what they lead to at the ends of the cell, whose far end may be larger and rolled.
static void add_gates(Element *e, const Tunnel *t, float size, float roll)
{
  Vec3 far_inside = along(t, t->near, t->inner_length);
  if (size != 1) far_inside[1] = e->lo[1] + t->extent[1] * size / 2; // the floor goes on level
  text_add(&e->out, "{ \"rayfold\": 1, \"cells\": { \"tunnel\": {} }, \"gates\": { \"in\": { ");
  add_rect(&e->out, t->near, t->extent, t->axis, !t->is_forward, 0);
  text_add(&e->out, ", \"sides\": \"front\", \"to\": \"in, inside\" }, \"out\": { ");
  add_rect(&e->out, along(t, t->near, t->extent[t->axis]), t->extent, t->axis, t->is_forward, 0);
  text_add(&e->out, ", \"sides\": \"front\", \"to\": \"out, inside\" }, \"in, inside\": { \"cell\": \"tunnel\", \"wall\": true, ");
  add_rect(&e->out, t->near, t->extent, t->axis, t->is_forward, 0);
  text_add(&e->out, " }, \"out, inside\": { \"cell\": \"tunnel\", \"wall\": true, ");
  add_rect(&e->out, far_inside, t->extent * size, t->axis, !t->is_forward, roll);
  text_add(&e->out, " } }, \"objects\": [ ");
}

static bool make_warped(Element *e)
{
  Tunnel t;
  if (!find_tunnel(e, &t)) return false;
  const float i = e->records[RECORD_I].x[0];
  const bool is_expanded = e->records[RECORD_C].line && e->records[RECORD_C].x[0] == 0;
  if (i < 0) return fail_at(e, RECORD_I, "must not be negative");
  if (is_expanded && i >= 1) return fail_at(e, RECORD_I, "must be below 1 where \"c\" is 0: at 1 the tunnel would be endless");
  t.inner_length = is_expanded ? t.length / (1 - i) : t.length / (1 + i);
  add_gates(e, &t, 1, 0);
  Vec3 extent = t.extent;
  extent[t.axis] = t.inner_length;
  const Vec3 middle = along(&t, t.near, t.inner_length / 2);
  for (int k = 1; k <= 4; k++) {
    const int axis = (t.axis + (k + 1) / 2) % 3;
    Vec3 at = middle;
    at[axis] += (k % 2 ? -0.5f : 0.5f) * extent[axis];
    char name[16];
    snprintf(name, sizeof name, "wall %d", k);
    add_wall(&e->out, name, at, extent, axis, k % 2);
    text_add(&e->out, k < 4 ? ", " : " ] }");
  }
  return true;
}

// One mesh of four walls, ring by ring; each ring is the box's section, larger and turned.
static void add_hull(Element *e, const Tunnel *t, int rings, int across, float size, float roll)
{
  const int wide = t->axis == 0 ? 2 : 0, per_ring = 4 * across;
  text_add(&e->out, "{ \"name\": \"walls\", \"cell\": \"tunnel\", \"shape\": { \"kind\": \"mesh\", \"positions\": [");
  for (int r = 0; r <= rings; r++)
    for (int k = 0; k < per_ring; k++) {
      static const float corner[5][2] = {{-0.5f, -0.5f}, {0.5f, -0.5f}, {0.5f, 0.5f}, {-0.5f, 0.5f}, {-0.5f, -0.5f}};
      const float f = (float)r / (float)rings, g = (float)(k % across) / (float)across, scale = 1 + (size - 1) * f, angle = roll * f / 57.29577951f;
      const float *a = corner[k / across], *b = corner[k / across + 1];
      const float u = (a[0] + (b[0] - a[0]) * g) * t->extent[wide] * scale, v = (a[1] + (b[1] - a[1]) * g) * t->extent[1] * scale;
      Vec3 p = along(t, t->near, t->inner_length * f);
      p[1] += (scale - 1) * t->extent[1] / 2;
      p[wide] += u * cosf(angle) - v * sinf(angle);
      p[1] += u * sinf(angle) + v * cosf(angle);
      text_add(&e->out, "%s[%.7g, %.7g, %.7g]", r || k ? ", " : "", (double)p[0], (double)p[1], (double)p[2]);
    }
  text_add(&e->out, "], \"triangles\": [");
  for (int r = 0; r < rings; r++)
    for (int k = 0; k < per_ring; k++) {
      const int a = r * per_ring + k, b = r * per_ring + (k + 1) % per_ring, c = a + per_ring, d = b + per_ring;
      text_add(&e->out, "%s[%d, %d, %d], [%d, %d, %d]", a ? ", " : "", a, b, d, a, d, c);
    }
  text_add(&e->out, "] } } ] }");
}

static bool make_shrink(Element *e)
{
  Tunnel t;
  if (!find_tunnel(e, &t) || !find_length(e, &t)) return false;
  const float i = e->records[RECORD_I].x[0];
  if (t.axis == 1) return fail_at(e, RECORD_D, "must lie along x or z: one walks through this tunnel");
  if (!(i > 0)) return fail_at(e, RECORD_I, "must be larger than 0: the size at the end, of 1");
  t.inner_length = i == 1 ? t.length : t.length * logf(1 / i) / (1 - i);
  add_gates(e, &t, 1 / i, 0);
  add_hull(e, &t, 1, 1, 1 / i, 0);
  return true;
}

static bool make_rotation(Element *e)
{
  Tunnel t;
  if (!find_tunnel(e, &t) || !find_length(e, &t) || !need(e, RECORD_A, "the axis of rotation")) return false;
  const float *a = e->records[RECORD_A].x;
  if (t.axis != 2) return fail_at(e, RECORD_D, "must lie along z: only such tunnels are wrung");
  if (a[0] != 0 || a[1] != 0 || a[2] == 0)
    return fail_at(e, RECORD_A, "must lie along z, as travel does; turning about another axis was done to the camera alone, and is no space: bend a "
                                "corridor instead, as scenes/worlds/rotating_tunnel_2.json does");
  const float roll = a[2] > 0 ? e->records[RECORD_I].x[0] : -e->records[RECORD_I].x[0];
  if (fabsf(roll) > 360) return fail_at(e, RECORD_I, "must be 360 degrees at most");
  // A rect that faces -z is turned by 180 about y first; rolled afterwards, about z, both turn alike.
  add_gates(e, &t, 1, roll);
  add_hull(e, &t, RINGS, ACROSS, 1, roll);
  return true;
}

// --- material -----------------------------------------------------------------------------------------
static bool make_material(Element *e)
{
  for (RecordName r = RECORD_KA; r <= RECORD_NS; r++)
    if (e->records[r].x[0] < 0 || (r != RECORD_NS && e->records[r].x[0] > 1))
      return fail_at(e, r, r == RECORD_NS ? "must not be negative" : "must be between 0 and 1");
  text_add(&e->out, "{ \"rayfold\": 1, \"materials\": { \"material\": { \"kind\": \"phong\", \"ambient\": %.7g, \"diffuse\": %.7g, \"specular\": %.7g, "
           "\"exponent\": %.7g } } }", (double)e->records[RECORD_KA].x[0], (double)e->records[RECORD_KD].x[0],
           (double)e->records[RECORD_KS].x[0], (double)fminf(e->records[RECORD_NS].x[0], 10000));
  return true;
}

static bool make_text(Element *e)
{
  switch (e->kind) {
  case ELEMENT_PORTAL: return make_portal(e);
  case ELEMENT_WARPED: return make_warped(e);
  case ELEMENT_SHRINK: return make_shrink(e);
  case ELEMENT_ROTATION: return make_rotation(e);
  case ELEMENT_MATERIAL: return make_material(e);
  case ELEMENT_KINDS: break;
  }
  return false;
}

bool import_element(Scene *s, const char *path, const LoadOptions *options, Err *err)
{
  Element e = {.scene = s, .path = path, .err = err};
  while (e.kind < ELEMENT_KINDS && strcasecmp(options->element, kind_names[e.kind])) e.kind++;
  if (e.kind == ELEMENT_KINDS)
    return err_set(err, ERR_BAD_SCENE, "there is no element \"%s\"; there are portal, warped, shrink, rotation and material", options->element);
  bool ok = read_file(&e) && make_text(&e);
  if (ok && e.out.failed) ok = err_memory(err, path, 0);
  if (ok) ok = import_json_text(s, path, text_get(&e.out), e.out.length, options, err);
  array_finish(&e.vertices);
  array_finish(&e.corners);
  text_finish(&e.out);
  return ok;
}
