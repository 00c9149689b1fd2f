// See vox.h. The file is read twice: chunks with their checks first, then the graph from its root, with a stack of its own
// and a limit on how much a small file may unfold to.

#include "scene/vox.h"

#include "base/file.h"
#include "base/mem.h"
#include "base/text.h"
#include "image/image.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_PLACES = 1 << 16, MOST_NODES = 1 << 20, DEEPEST = 64, MODEL_SIDE = 256 };

// --- bytes --------------------------------------------------------------------------------------------------------
typedef struct Reader {
  const char *name;
  const uint8_t *data;
  size_t at, end;
  Err *err;
} Reader;

static bool fail(const Reader *r, size_t at, const char *message)
{
  return err_set(r->err, ERR_BAD_SCENE, "%s: byte %zu: %s", r->name, at, message);
}

static bool read_u32(Reader *r, uint32_t *out)
{
  if (r->end - r->at < 4) return fail(r, r->at, "the file ends in the middle of a number; it is cut short");
  const uint8_t *p = r->data + r->at;
  *out = p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
  r->at += 4;
  return true;
}

typedef struct Words { // a text in the file
  const char *text;
  uint32_t size;
} Words;

static bool read_text(Reader *r, Words *out)
{
  if (!read_u32(r, &out->size)) return false;
  if (out->size > r->end - r->at) return fail(r, r->at - 4, "a text is longer than what is left of its chunk");
  out->text = (const char *)r->data + r->at;
  r->at += out->size;
  return true;
}

static bool words_are(Words w, const char *text) { return w.size == strlen(text) && !memcmp(w.text, text, w.size); }

static float words_number(Words w)
{
  char digits[64];
  const uint32_t n = w.size < sizeof digits - 1 ? w.size : (uint32_t)sizeof digits - 1;
  memcpy(digits, w.text, n);
  digits[n] = 0;
  const float x = strtof(digits, NULL);
  return isfinite(x) ? x : 0;
}

// Calls take() with each pair of a dictionary.
typedef bool TakePair(Reader *r, void *user, Words key, Words value);

static bool read_dict(Reader *r, TakePair *take, void *user)
{
  uint32_t count;
  if (!read_u32(r, &count)) return false;
  for (uint32_t i = 0; i < count; i++) {
    Words key, value;
    if (!read_text(r, &key) || !read_text(r, &value) || !take(r, user, key, value)) return false;
  }
  return true;
}

// --- the graph ----------------------------------------------------------------------------------------------------
typedef enum NodeKind { NODE_NONE, NODE_MOVE, NODE_GROUP, NODE_SHAPE } NodeKind;

typedef struct Node {
  uint32_t id;
  uint8_t kind; // NodeKind
  bool is_hidden;
  Words name;
  int8_t axis[3], sign[3];
  int32_t at[3];
  uint32_t child;         // of a move
  size_t first, count;    // of a group and a shape: in the list of children or models
} Node;

typedef struct Graph {
  ARRAY(Node) nodes;      // sorted by id, once all are read
  ARRAY(uint32_t) children;
} Graph;

static bool take_node(Reader *r, void *user, Words key, Words value)
{
  Node *n = user;
  (void)r;
  if (words_are(key, "_name")) n->name = value;
  if (words_are(key, "_hidden")) n->is_hidden = words_are(value, "1");
  return true;
}

static bool set_turn(Node *n, uint32_t bits)
{
  n->axis[0] = (int8_t)(bits & 3);
  n->axis[1] = (int8_t)(bits >> 2 & 3);
  n->axis[2] = (int8_t)(3 - n->axis[0] - n->axis[1]);
  for (int k = 0; k < 3; k++) n->sign[k] = bits >> (4 + k) & 1 ? -1 : 1;
  return n->axis[0] < 3 && n->axis[1] < 3 && n->axis[0] != n->axis[1];
}

static bool take_frame(Reader *r, void *user, Words key, Words value)
{
  Node *n = user;
  if (words_are(key, "_r") && !set_turn(n, (uint32_t)words_number(value)))
    return fail(r, r->at, "a turn is none: two of its rows are along one axis");
  if (!words_are(key, "_t")) return true;
  char digits[64];
  const uint32_t size = value.size < sizeof digits - 1 ? value.size : (uint32_t)sizeof digits - 1;
  memcpy(digits, value.text, size);
  digits[size] = 0;
  char *p = digits;
  for (int k = 0; k < 3; k++) {
    const long x = strtol(p, &p, 10);
    n->at[k] = (int32_t)(x < -(1 << 20) ? -(1 << 20) : x > 1 << 20 ? 1 << 20 : x);
  }
  return true;
}

static bool read_move(Reader *r, Node *n)
{
  uint32_t reserved, layer, frames;
  n->kind = NODE_MOVE;
  (void)set_turn(n, 4);
  if (!read_dict(r, take_node, n) || !read_u32(r, &n->child) || !read_u32(r, &reserved) || !read_u32(r, &layer) ||
      !read_u32(r, &frames))
    return false;
  return frames == 0 || read_dict(r, take_frame, n); // later frames are an animation's
}

static bool skip_pair(Reader *r, void *user, Words key, Words value)
{
  (void)r, (void)user, (void)key, (void)value;
  return true;
}

static bool read_list(Reader *r, Graph *g, Node *n, NodeKind kind)
{
  uint32_t count;
  n->kind = (uint8_t)kind;
  n->first = g->children.count;
  if (!read_dict(r, take_node, n) || !read_u32(r, &count)) return false;
  for (uint32_t i = 0; i < count; i++) {
    uint32_t child;
    if (!read_u32(r, &child) || (kind == NODE_SHAPE && !read_dict(r, skip_pair, NULL))) return false;
    if (!array_push(&g->children, child)) return err_memory(r->err, r->name, 4ull * count);
    n->count++;
  }
  return true;
}

static bool read_node(Reader *r, Graph *g, NodeKind kind)
{
  Node n = {0};
  if (!read_u32(r, &n.id) || !(kind == NODE_MOVE ? read_move(r, &n) : read_list(r, g, &n, kind))) return false;
  if (g->nodes.count >= MOST_NODES) return fail(r, r->at, "the scene graph has more than a million nodes");
  return array_push(&g->nodes, n) || err_memory(r->err, r->name, sizeof n);
}

static int by_id(const void *a, const void *b)
{
  const uint32_t x = ((const Node *)a)->id, y = ((const Node *)b)->id;
  return x < y ? -1 : x > y;
}

static const Node *find_node(const Graph *g, uint32_t id)
{
  const Node key = {.id = id};
  return g->nodes.count ? bsearch(&key, g->nodes.items, g->nodes.count, sizeof key, by_id) : NULL;
}

typedef struct Frame3 { // a turn by quarters and a place
  int8_t axis[3], sign[3];
  int64_t at[3];
  Words name;
} Frame3;

// a after b.
static Frame3 combine(const Frame3 *a, const Node *b)
{
  Frame3 f = {.name = b->name.size ? b->name : a->name};
  for (int k = 0; k < 3; k++) {
    const int j = a->axis[k];
    f.axis[k] = b->axis[j];
    f.sign[k] = (int8_t)(a->sign[k] * b->sign[j]);
    f.at[k] = a->at[k] + a->sign[k] * b->at[j];
  }
  return f;
}

typedef struct Walker {
  Reader *r;
  const Graph *graph;
  VoxFile *file;
  size_t visited;
} Walker;

static bool add_place(Walker *w, uint32_t model, const Frame3 *f)
{
  if (model >= w->file->models.count) return fail(w->r, w->r->end, "the scene graph names a model that the file does not hold");
  if (w->file->places.count >= MOST_PLACES) return fail(w->r, w->r->end, "the scene graph places more than 65536 models");
  VoxPlace p = {.model = model, .name = f->name.text, .name_size = f->name.size};
  memcpy(p.axis, f->axis, sizeof p.axis);
  memcpy(p.sign, f->sign, sizeof p.sign);
  memcpy(p.at, f->at, sizeof p.at);
  return array_push(&w->file->places, p) || err_memory(w->r->err, w->r->name, sizeof p);
}

static bool walk(Walker *w, uint32_t id, const Frame3 *f, int depth)
{
  const Node *n = find_node(w->graph, id);
  if (!n) return fail(w->r, w->r->end, "the scene graph names a node that the file does not hold");
  if (depth > DEEPEST || ++w->visited > MOST_NODES)
    return fail(w->r, w->r->end, "the scene graph is deeper than 64 nodes, or unfolds to more than a million");
  if (n->is_hidden) return true;
  switch ((NodeKind)n->kind) {
  case NODE_NONE: return true;
  case NODE_MOVE: {
    const Frame3 next = combine(f, n);
    return walk(w, n->child, &next, depth + 1);
  }
  case NODE_GROUP:
    for (size_t i = 0; i < n->count; i++)
      if (!walk(w, w->graph->children.items[n->first + i], f, depth + 1)) return false;
    return true;
  case NODE_SHAPE: return n->count == 0 || add_place(w, w->graph->children.items[n->first], f);
  }
  unreachable();
}

// --- materials ----------------------------------------------------------------------------------------------------
typedef struct Matter { // of the file
  Words type;
  float rough, metal, ior, refraction, flux, emit, trans;
  bool has_trans, has_rough;
} Matter;

static bool take_matter(Reader *r, void *user, Words key, Words value)
{
  Matter *m = user;
  const float x = words_number(value);
  (void)r;
  if (words_are(key, "_type")) m->type = value;
  if (words_are(key, "_rough")) m->rough = x, m->has_rough = true;
  if (words_are(key, "_metal")) m->metal = x;
  if (words_are(key, "_ior")) m->ior = x;
  if (words_are(key, "_ri")) m->refraction = x;
  if (words_are(key, "_flux")) m->flux = x;
  if (words_are(key, "_emit")) m->emit = x;
  if (words_are(key, "_trans") || (words_are(key, "_alpha") && !m->has_trans)) m->trans = x, m->has_trans = true;
  return true;
}

static float within(float x, float low, float high) { return x < low ? low : x > high ? high : x; }

static VoxelLook look_of(const Matter *m)
{
  VoxelLook l = voxel_look_plain();
  if (!m->type.size || words_are(m->type, "_diffuse")) return l;
  if (m->has_rough) l.roughness = within(m->rough, 0, 1);
  l.ior = within(m->refraction > 0 ? m->refraction : 1 + m->ior, 1, 3);
  if (m->ior <= 0 && m->refraction <= 0) l.ior = 1.5f;
  if (words_are(m->type, "_metal")) l.metallic = within(m->metal > 0 ? m->metal : 1, 0, 1);
  if (words_are(m->type, "_glass")) l.transmission = m->trans > 0 ? within(m->trans, 0, 1) : 1;
  if (words_are(m->type, "_emit")) l.emission = within(m->emit, 0, 1) * powf(10, within(m->flux, 0, 4));
  return l;
}

static bool read_matter(Reader *r, VoxFile *f)
{
  uint32_t id;
  Matter m = {0};
  if (!read_u32(r, &id) || !read_dict(r, take_matter, &m)) return false;
  if (id < 256) f->looks[id] = look_of(&m);
  return true;
}

// --- chunks -------------------------------------------------------------------------------------------------------
static bool read_size(Reader *r, VoxModel *m)
{
  const size_t at = r->at;
  for (int k = 0; k < 3; k++) {
    uint32_t n;
    if (!read_u32(r, &n)) return false;
    if (n < 1 || n > MODEL_SIDE) return fail(r, at, "a model's side must be 1 to 256 cells");
    m->size[k] = (int32_t)n;
  }
  return true;
}

static bool read_cells(Reader *r, VoxFile *f, VoxModel *m)
{
  const size_t start = r->at;
  if (!m->size[0]) return fail(r, start, "cells without a size in front of them");
  if (!read_u32(r, &m->count)) return false;
  if (m->count > (r->end - r->at) / 4) return fail(r, start, "the cells are more than their chunk holds; the file is cut short");
  m->cells = r->data + r->at;
  for (uint32_t i = 0; i < m->count; i++)
    for (int k = 0; k < 3; k++)
      if (m->cells[4 * i + (uint32_t)k] >= m->size[k]) return fail(r, r->at + 4 * (size_t)i, "a cell lies outside its model");
  const bool ok = array_push(&f->models, *m);
  *m = (VoxModel){0};
  return ok || err_memory(r->err, r->name, sizeof *m);
}

static bool read_colors(Reader *r, VoxFile *f)
{
  if (r->end - r->at < 1024) return fail(r, r->at, "the palette is shorter than 256 colours");
  for (int i = 1; i < 256; i++) memcpy(f->colors[i], r->data + r->at + 4 * (size_t)(i - 1), 4);
  return true;
}

static bool is_chunk(const uint8_t *id, const char *name) { return !memcmp(id, name, 4); }

static bool read_chunk(Reader *r, const uint8_t *id, VoxFile *f, Graph *g, VoxModel *next)
{
  if (is_chunk(id, "SIZE")) return read_size(r, next);
  if (is_chunk(id, "XYZI")) return read_cells(r, f, next);
  if (is_chunk(id, "RGBA")) return read_colors(r, f);
  if (is_chunk(id, "MATL")) return read_matter(r, f);
  if (is_chunk(id, "nTRN")) return read_node(r, g, NODE_MOVE);
  if (is_chunk(id, "nGRP")) return read_node(r, g, NODE_GROUP);
  if (is_chunk(id, "nSHP")) return read_node(r, g, NODE_SHAPE);
  return true; // PACK, LAYR, rCAM, rOBJ, NOTE, IMAP and what may come
}

static bool read_chunks(Reader *r, VoxFile *f, Graph *g)
{
  VoxModel next = {0};
  while (r->at < r->end) {
    uint32_t size, children;
    const size_t at = r->at;
    if (r->end - r->at < 12) return fail(r, at, "the file ends in the middle of a chunk's head; it is cut short");
    const uint8_t *id = r->data + at;
    r->at += 4;
    if (!read_u32(r, &size) || !read_u32(r, &children)) return false;
    if (size > r->end - r->at) return fail(r, at, "a chunk is longer than what is left of the file; it is cut short");
    Reader inside = {r->name, r->data, r->at, r->at + size, r->err};
    if (!is_chunk(id, "MAIN") && !read_chunk(&inside, id, f, g, &next)) return false;
    r->at += size; // children follow as chunks of their own
  }
  return true;
}

// Files without a palette of their own have a standard one: steps of 0x33 in all channels, then ramps of red, green, blue
// and grey.
static void standard_colors(VoxFile *f)
{
  static const uint8_t ramp[10] = {0xee, 0xdd, 0xbb, 0xaa, 0x88, 0x77, 0x55, 0x44, 0x22, 0x11};
  for (int i = 1; i < 256; i++) {
    uint8_t *c = f->colors[i];
    const int n = i - 1;
    c[3] = 255;
    if (n < 215) {
      c[2] = (uint8_t)(255 - 51 * (n % 6));
      c[1] = (uint8_t)(255 - 51 * (n / 6 % 6));
      c[0] = (uint8_t)(255 - 51 * (n / 36));
    } else {
      const int which = (n - 215) / 10;
      for (int k = 0; k < 3; k++) c[k] = which == 3 || which == k ? ramp[(n - 215) % 10] : 0;
    }
  }
}

// Without a graph the models lie where they are, standing on the ground.
static bool place_plainly(Reader *r, VoxFile *f)
{
  for (uint32_t i = 0; i < f->models.count; i++) {
    const VoxPlace p = {.model = i, .axis = {0, 1, 2}, .sign = {1, 1, 1}, .at = {0, 0, f->models.items[i].size[2] / 2}};
    if (i < MOST_PLACES && !array_push(&f->places, p)) return err_memory(r->err, r->name, sizeof p);
  }
  return true;
}

static bool check_ids(const Reader *r, const Graph *g)
{
  for (size_t i = 1; i < g->nodes.count; i++)
    if (g->nodes.items[i].id == g->nodes.items[i - 1].id) return fail(r, r->end, "two nodes of the scene graph have one number");
  return true;
}

bool vox_read(VoxFile *out, const char *name, Span bytes, Err *err)
{
  Reader r = {name, (const uint8_t *)bytes.data, 8, bytes.size, err};
  Graph g = {0};
  *out = (VoxFile){0};
  standard_colors(out);
  for (int i = 0; i < 256; i++) out->looks[i] = voxel_look_plain();
  if (bytes.size < 8 || memcmp(bytes.data, "VOX ", 4)) {
    r.end = bytes.size;
    return fail(&r, 0, "this is no MagicaVoxel file; one begins with \"VOX \" and a version");
  }
  bool ok = read_chunks(&r, out, &g);
  if (ok && !out->models.count) ok = fail(&r, r.end, "the file holds no model");
  if (ok && g.nodes.count) {
    qsort(g.nodes.items, g.nodes.count, sizeof *g.nodes.items, by_id);
    const Frame3 here = {.axis = {0, 1, 2}, .sign = {1, 1, 1}};
    Walker w = {&r, &g, out, 0};
    ok = check_ids(&r, &g) && walk(&w, g.nodes.items[0].id, &here, 0);
  } else if (ok) {
    ok = place_plainly(&r, out);
  }
  array_finish(&g.nodes);
  array_finish(&g.children);
  if (!ok) vox_finish(out);
  return ok;
}

void vox_finish(VoxFile *f)
{
  array_finish(&f->models);
  array_finish(&f->places);
}

// --- grids --------------------------------------------------------------------------------------------------------
// The palette's entries that the models use, by colour.
static bool add_palette(VoxelEdit *e, const VoxFile *f, uint32_t first, uint32_t count, int32_t entries[256])
{
  bool used[256] = {false};
  for (uint32_t m = first; m < first + count; m++)
    for (uint32_t i = 0; i < f->models.items[m].count; i++) used[f->models.items[m].cells[4 * i + 3]] = true;
  for (int c = 1; c < 256; c++) {
    char name[8];
    float color[3];
    if (!used[c]) continue;
    for (int k = 0; k < 3; k++) color[k] = srgb_from_u8[f->colors[c][k]];
    snprintf(name, sizeof name, "%d", c);
    const int32_t look = voxel_edit_look(e, &f->looks[c]);
    entries[c] = look < 0 ? -1 : voxel_edit_name(e, name, color, (uint32_t)look);
    if (entries[c] < 0) return false;
  }
  return true;
}

Voxels *vox_model(const VoxFile *f, uint32_t model, Err *err)
{
  const VoxModel *m = &f->models.items[model];
  int32_t entries[256] = {0};
  VoxelEdit *e = voxel_edit_create((int32_t[]){m->size[0], m->size[2], m->size[1]}, err);
  bool ok = e && add_palette(e, f, model, 1, entries);
  for (uint32_t i = 0; ok && i < m->count; i++) {
    const uint8_t *c = m->cells + 4 * (size_t)i;
    if (c[3]) ok = voxel_edit_put(e, c[0], c[2], m->size[1] - 1 - c[1], (uint32_t)entries[c[3]]);
  }
  if (ok) return voxel_edit_end(e, err);
  voxel_edit_destroy(e);
  err_memory(err, "voxels", 4ull * m->count);
  return NULL;
}

// The box of a placed model, in the file's axes: cells lo up to, not with, hi.
static void place_box(const VoxFile *f, const VoxPlace *p, int64_t lo[3], int64_t hi[3])
{
  const VoxModel *m = &f->models.items[p->model];
  for (int k = 0; k < 3; k++) {
    const int64_t size = m->size[p->axis[k]], middle = size / 2;
    lo[k] = p->at[k] + (p->sign[k] > 0 ? -middle : middle - size);
    hi[k] = lo[k] + size;
  }
}

Voxels *vox_merge(const VoxFile *f, const char *name, int32_t corner[3], Err *err)
{
  int64_t lo[3] = {INT32_MAX, INT32_MAX, INT32_MAX}, hi[3] = {INT32_MIN, INT32_MIN, INT32_MIN};
  int32_t entries[256] = {0};
  for (size_t i = 0; i < f->places.count; i++) {
    int64_t a[3], b[3];
    place_box(f, &f->places.items[i], a, b);
    for (int k = 0; k < 3; k++) {
      lo[k] = a[k] < lo[k] ? a[k] : lo[k];
      hi[k] = b[k] > hi[k] ? b[k] : hi[k];
    }
  }
  for (int k = 0; k < 3; k++)
    if (hi[k] - lo[k] < 1 || hi[k] - lo[k] > VOXELS_MOST_SIDE) {
      err_set(err, ERR_BAD_SCENE,
              "%s: all models together reach over %lld x %lld x %lld cells, and a grid has at most %d a side; show the file "
              "with shape kind mesh, or by itself, where each model is an object",
              name, (long long)(hi[0] - lo[0]), (long long)(hi[2] - lo[2]), (long long)(hi[1] - lo[1]), VOXELS_MOST_SIDE);
      return NULL;
    }
  VoxelEdit *e = voxel_edit_create((int32_t[]){(int32_t)(hi[0] - lo[0]), (int32_t)(hi[2] - lo[2]), (int32_t)(hi[1] - lo[1])}, err);
  bool ok = e && add_palette(e, f, 0, (uint32_t)f->models.count, entries);
  for (size_t i = 0; ok && i < f->places.count; i++) {
    const VoxPlace *p = &f->places.items[i];
    const VoxModel *m = &f->models.items[p->model];
    int64_t a[3], b[3];
    place_box(f, p, a, b);
    for (uint32_t n = 0; ok && n < m->count; n++) {
      const uint8_t *c = m->cells + 4 * (size_t)n;
      int32_t q[3];
      for (int k = 0; k < 3; k++)
        q[k] = (int32_t)(a[k] - lo[k]) + (p->sign[k] > 0 ? c[p->axis[k]] : m->size[p->axis[k]] - 1 - c[p->axis[k]]);
      if (c[3]) ok = voxel_edit_put(e, q[0], q[2], (int32_t)(hi[1] - lo[1]) - 1 - q[1], (uint32_t)entries[c[3]]);
    }
  }
  for (int k = 0; corner && k < 3; k++) corner[k] = (int32_t)(k == 0 ? lo[0] : k == 1 ? lo[2] : -hi[1]);
  if (ok) return voxel_edit_end(e, err);
  voxel_edit_destroy(e);
  err_memory(err, name, 0);
  return NULL;
}

// --- writing ------------------------------------------------------------------------------------------------------
typedef struct Bytes {
  ARRAY(uint8_t) list;
  bool failed;
} Bytes;

static void put_bytes(Bytes *b, const void *data, size_t size)
{
  b->failed |= !array_reserve(&b->list, b->list.count + size);
  if (b->failed) return;
  memcpy(b->list.items + b->list.count, data, size);
  b->list.count += size;
}

static void put_u32(Bytes *b, uint32_t x)
{
  const uint8_t four[4] = {(uint8_t)x, (uint8_t)(x >> 8), (uint8_t)(x >> 16), (uint8_t)(x >> 24)};
  put_bytes(b, four, 4);
}

static void put_text(Bytes *b, const char *text)
{
  put_u32(b, (uint32_t)strlen(text));
  put_bytes(b, text, strlen(text));
}

static void put_pair(Bytes *b, const char *key, const char *format, double x)
{
  char value[40];
  snprintf(value, sizeof value, format, x);
  put_text(b, key);
  put_text(b, value);
}

static void put_chunk(Bytes *out, const char *id, Bytes *content)
{
  put_bytes(out, id, 4);
  put_u32(out, (uint32_t)content->list.count);
  put_u32(out, 0);
  put_bytes(out, content->list.items, content->list.count);
  out->failed |= content->failed;
  content->list.count = 0;
}

// Entries by how many cells have them; the first 255 keep their colours, the others take the nearest of those.
typedef struct Ranked {
  uint32_t entry;
  uint64_t cells;
} Ranked;

static int by_cells(const void *a, const void *b)
{
  const Ranked *x = a, *y = b;
  return x->cells > y->cells ? -1 : x->cells < y->cells ? 1 : x->entry < y->entry ? -1 : x->entry > y->entry;
}

static float color_off(const VoxelEntry *a, const VoxelEntry *b)
{
  float d = a->look == b->look ? 0 : 1;
  for (int k = 0; k < 3; k++) d += fabsf(srgb_encode(a->color[k]) - srgb_encode(b->color[k]));
  return d;
}

typedef struct Chosen {
  uint8_t *color_of;    // entry -> colour of the file, 1 to 255; owned
  uint32_t entries[256]; // colour -> entry
  uint32_t count, wanted;
} Chosen;

static bool choose_colors(const Voxels *v, Chosen *out)
{
  const uint32_t n = v->palette->entry_count;
  Ranked *ranked = mem_zero(n, sizeof *ranked);
  out->color_of = mem_zero(n, 1);
  if (!ranked || !out->color_of) {
    mem_free(ranked);
    return false;
  }
  for (uint32_t i = 0; i < n; i++) ranked[i].entry = i;
  for (int32_t z = v->lo[2]; z < v->hi[2]; z++)
    for (int32_t y = v->lo[1]; y < v->hi[1]; y++)
      for (int32_t x = v->lo[0]; x < v->hi[0]; x++) ranked[voxels_entry(v, x, y, z)].cells++;
  ranked[0].cells = 0;
  qsort(ranked, n, sizeof *ranked, by_cells);
  for (uint32_t i = 0; i < n && ranked[i].cells; i++) {
    const uint32_t entry = ranked[i].entry;
    out->wanted++;
    if (out->count < 255) {
      out->entries[++out->count] = entry;
      out->color_of[entry] = (uint8_t)out->count;
      continue;
    }
    uint32_t best = 1;
    for (uint32_t c = 2; c <= 255; c++)
      if (color_off(&v->palette->entries[out->entries[c]], &v->palette->entries[entry]) <
          color_off(&v->palette->entries[out->entries[best]], &v->palette->entries[entry]))
        best = c;
    out->color_of[entry] = (uint8_t)best;
  }
  mem_free(ranked);
  return true;
}

static void put_model(Bytes *out, Bytes *content, const Voxels *v, const Chosen *chosen, const int32_t from[3], const int32_t size[3])
{
  put_u32(content, (uint32_t)size[0]);
  put_u32(content, (uint32_t)size[2]);
  put_u32(content, (uint32_t)size[1]);
  put_chunk(out, "SIZE", content);
  put_u32(content, 0);
  uint32_t count = 0;
  for (int32_t y = 0; y < size[1]; y++)
    for (int32_t z = size[2] - 1; z >= 0; z--)
      for (int32_t x = 0; x < size[0]; x++) {
        const uint32_t entry = voxels_entry(v, from[0] + x, from[1] + y, from[2] + z);
        const uint8_t cell[4] = {(uint8_t)x, (uint8_t)(size[2] - 1 - z), (uint8_t)y, chosen->color_of[entry]};
        if (!entry) continue;
        put_bytes(content, cell, 4);
        count++;
      }
  for (int k = 0; !content->failed && k < 4; k++) content->list.items[k] = (uint8_t)(count >> 8 * k);
  put_chunk(out, "XYZI", content);
}

typedef struct Piece {
  int32_t from[3], size[3];
} Piece;
typedef ARRAY(Piece) Pieces;

static bool cut_pieces(const Voxels *v, Pieces *out)
{
  for (int32_t z = v->lo[2]; z < v->hi[2]; z += MODEL_SIDE)
    for (int32_t y = v->lo[1]; y < v->hi[1]; y += MODEL_SIDE)
      for (int32_t x = v->lo[0]; x < v->hi[0]; x += MODEL_SIDE) {
        Piece p = {{x, y, z}, {0}};
        for (int k = 0; k < 3; k++) p.size[k] = v->hi[k] - p.from[k] < MODEL_SIDE ? v->hi[k] - p.from[k] : MODEL_SIDE;
        if (!array_push(out, p)) return false;
      }
  return true;
}

// A move for each model under one group, so that pieces lie where they were.
static void put_graph(Bytes *out, Bytes *c, const Voxels *v, const Pieces *pieces)
{
  put_u32(c, 0), put_u32(c, 0), put_u32(c, 1), put_u32(c, UINT32_MAX), put_u32(c, UINT32_MAX), put_u32(c, 1), put_u32(c, 0);
  put_chunk(out, "nTRN", c);
  put_u32(c, 1), put_u32(c, 0), put_u32(c, (uint32_t)pieces->count);
  for (uint32_t i = 0; i < pieces->count; i++) put_u32(c, 2 + 2 * i);
  put_chunk(out, "nGRP", c);
  for (uint32_t i = 0; i < pieces->count; i++) {
    const Piece *p = &pieces->items[i];
    const int32_t from_y = v->size[2] - (p->from[2] + p->size[2]); // the file's y runs against our z
    char place[60];
    snprintf(place, sizeof place, "%d %d %d", p->from[0] + p->size[0] / 2, from_y + p->size[2] / 2, p->from[1] + p->size[1] / 2);
    put_u32(c, 2 + 2 * i), put_u32(c, 0), put_u32(c, 3 + 2 * i), put_u32(c, UINT32_MAX), put_u32(c, 0), put_u32(c, 1), put_u32(c, 1);
    put_text(c, "_t");
    put_text(c, place);
    put_chunk(out, "nTRN", c);
    put_u32(c, 3 + 2 * i), put_u32(c, 0), put_u32(c, 1), put_u32(c, i), put_u32(c, 0);
    put_chunk(out, "nSHP", c);
  }
}

static void put_palette(Bytes *out, Bytes *c, const Voxels *v, const Chosen *chosen)
{
  for (uint32_t i = 1; i <= 256; i++) {
    uint8_t rgba[4] = {0, 0, 0, 255};
    for (int k = 0; i <= chosen->count && k < 3; k++)
      rgba[k] = (uint8_t)(srgb_encode(v->palette->entries[chosen->entries[i]].color[k]) * 255 + 0.5f);
    put_bytes(c, rgba, 4);
  }
  put_chunk(out, "RGBA", c);
  for (uint32_t i = 1; i <= chosen->count; i++) {
    const VoxelLook *l = &v->palette->looks[v->palette->entries[chosen->entries[i]].look];
    const char *type = l->emission > 0 ? "_emit" : l->transmission > 0 ? "_glass" : l->metallic > 0 ? "_metal" : "_diffuse";
    const float flux = l->emission > 1 ? ceilf(log10f(l->emission)) : 0;
    put_u32(c, i);
    put_u32(c, 7);
    put_text(c, "_type");
    put_text(c, type);
    put_pair(c, "_rough", "%.4g", (double)l->roughness);
    put_pair(c, "_metal", "%.4g", (double)l->metallic);
    put_pair(c, "_ri", "%.4g", (double)l->ior);
    put_pair(c, "_trans", "%.4g", (double)l->transmission);
    put_pair(c, "_flux", "%.0f", (double)fminf(flux, 4));
    put_pair(c, "_emit", "%.6g", (double)(l->emission / powf(10, fminf(flux, 4))));
    put_chunk(out, "MATL", c);
  }
}

bool vox_write(const Voxels *v, const char *path, uint32_t *reduced, Err *err)
{
  Bytes out = {0}, content = {0};
  Chosen chosen = {0};
  Pieces pieces = {0};
  if (v->lo[0] >= v->hi[0]) return err_set(err, ERR_BAD_SCENE, "there are no voxels to write");
  bool ok = choose_colors(v, &chosen) && cut_pieces(v, &pieces);
  if (ok) {
    put_bytes(&out, "VOX ", 4), put_u32(&out, 200), put_bytes(&out, "MAIN", 4), put_u32(&out, 0), put_u32(&out, 0);
    for (size_t i = 0; i < pieces.count; i++) put_model(&out, &content, v, &chosen, pieces.items[i].from, pieces.items[i].size);
    put_graph(&out, &content, v, &pieces);
    put_palette(&out, &content, v, &chosen);
    const uint32_t children = (uint32_t)(out.list.count - 20);
    for (int k = 0; !out.failed && k < 4; k++) out.list.items[16 + k] = (uint8_t)(children >> 8 * k);
  }
  if (!ok || out.failed) ok = err_memory(err, path, out.list.count);
  else if (out.list.count > UINT32_MAX) ok = err_set(err, ERR_IO, "%s: a .vox file holds at most 4 GB", path);
  else ok = file_write_whole(path, (const char *)out.list.items, out.list.count, err);
  *reduced = chosen.wanted > chosen.count ? chosen.wanted : 0;
  array_finish(&out.list);
  array_finish(&content.list);
  array_finish(&pieces);
  mem_free(chosen.color_of);
  return ok;
}
