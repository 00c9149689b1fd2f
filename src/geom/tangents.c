// See tangents.h. Vertices are welded by a table; then the corners of each lie together, and every vertex is a work of
// its own: its corners are joined into groups, counted, and once all groups have their place, summed.

#include "geom/tangents.h"

#include "base/fmath.h"
#include "base/hash.h"
#include "base/mem.h"

#include <stdlib.h>
#include <string.h>

enum { CHUNK = 2048 }; // vertices or triangles in one item of work

// A corner in the fan around its vertex.
typedef struct Corner {
  uint32_t corner;     // 3 * triangle + k
  uint32_t next, prev; // welded vertices at the other ends of its edges
  uint32_t parent;     // within the fan, while groups are joined; then the group
} Corner;

typedef enum Turn { TURN_NONE, TURN_PLAIN, TURN_MIRRORED, TURN_DEGENERATE } Turn; // NONE: uv without area

typedef struct Making {
  const TriangleMesh *m;
  size_t vertex_count, triangle_count;
  int set;
  uint32_t *weld;   // vertex -> the first one like it
  uint32_t *start;  // welded vertex -> its first corner; one more at the end
  uint32_t *groups; // welded vertex -> how many groups; then the first one's tangent
  uint8_t *turns;   // triangle -> Turn
  Corner *corners;  // by welded vertex
  Tangents *out;
} Making;

// --- vertices alike -----------------------------------------------------------------------------------
static void vertex_key(const Making *g, size_t v, float key[8])
{
  const float *uv = g->m->texcoords[g->set];
  for (int k = 0; k < 3; k++) key[k] = g->m->positions[3 * v + (size_t)k] + 0.0f; // -0 is 0
  for (int k = 0; k < 3; k++) key[3 + k] = g->m->normals[3 * v + (size_t)k] + 0.0f;
  for (int k = 0; k < 2; k++) key[6 + k] = uv[2 * v + (size_t)k] + 0.0f;
}

static bool weld_vertices(Making *g)
{
  size_t size = 16;
  while (size < 2 * g->vertex_count) size *= 2;
  uint32_t *slots = mem_alloc(size, sizeof *slots);
  if (!slots) return false;
  memset(slots, 0xff, size * sizeof *slots);
  for (size_t v = 0; v < g->vertex_count; v++) {
    float key[8], other[8];
    vertex_key(g, v, key);
    size_t at = (size_t)hash_bytes(1, key, sizeof key) & (size - 1);
    for (; slots[at] != UINT32_MAX; at = (at + 1) & (size - 1)) {
      vertex_key(g, slots[at], other);
      if (!memcmp(key, other, sizeof key)) break;
    }
    if (slots[at] == UINT32_MAX) slots[at] = (uint32_t)v;
    g->weld[v] = slots[at];
  }
  mem_free(slots);
  return true;
}

// --- triangles ------------------------------------------------------------------------------------------
static Vec3 position(const Making *g, uint32_t vertex) { return v3_load(g->m->positions + 3 * (size_t)vertex); }
static Vec2 uv_of(const Making *g, uint32_t vertex)
{
  const float *uv = g->m->texcoords[g->set] + 2 * (size_t)vertex;
  return (Vec2){uv[0], uv[1]};
}

// Twice the signed area of the triangle in uv.
static double uv_area(const Making *g, const uint32_t *v)
{
  const Vec2 a = uv_of(g, v[0]), b = uv_of(g, v[1]), c = uv_of(g, v[2]);
  return ((double)b.x - (double)a.x) * ((double)c.y - (double)a.y) -
         ((double)b.y - (double)a.y) * ((double)c.x - (double)a.x);
}

// The direction of growing u, of length one.
static Vec3 u_direction(const Making *g, const uint32_t *v, Turn turn)
{
  const Vec3 d1 = position(g, v[1]) - position(g, v[0]), d2 = position(g, v[2]) - position(g, v[0]);
  const float up1 = uv_of(g, v[1]).y - uv_of(g, v[0]).y, up2 = uv_of(g, v[2]).y - uv_of(g, v[0]).y;
  return v3_normalize((turn == TURN_MIRRORED ? -1.0f : 1.0f) * (up2 * d1 - up1 * d2));
}

static void turn_chunk(void *user, size_t item, int worker)
{
  (void)worker;
  const Making *g = user;
  const size_t end = (item + 1) * CHUNK < g->triangle_count ? (item + 1) * CHUNK : g->triangle_count;
  for (size_t t = item * CHUNK; t < end; t++) {
    const uint32_t *v = g->m->triangles + 3 * t;
    const Vec3 a = position(g, v[0]), b = position(g, v[1]), c = position(g, v[2]);
    const double area = uv_area(g, v);
    const bool is_line = v3_is_zero(b - a) || v3_is_zero(c - b) || v3_is_zero(a - c);
    g->turns[t] = (uint8_t)(is_line ? TURN_DEGENERATE : area > 0 ? TURN_PLAIN : area < 0 ? TURN_MIRRORED : TURN_NONE);
  }
}

// The corners of each welded vertex, together, in the order of the triangles.
static void gather_corners(Making *g)
{
  const size_t count = 3 * g->triangle_count;
  for (size_t i = 0; i < count; i++) g->start[g->weld[g->m->triangles[i]] + 1]++;
  for (size_t v = 0; v < g->vertex_count; v++) g->start[v + 1] += g->start[v];
  for (size_t i = 0; i < count; i++) {
    const size_t t = i / 3, k = i % 3;
    const uint32_t *v = g->m->triangles + 3 * t, at = g->weld[v[k]];
    g->corners[g->start[at] + g->groups[at]++] =
        (Corner){(uint32_t)i, g->weld[v[(k + 1) % 3]], g->weld[v[(k + 2) % 3]], 0};
  }
}

// --- groups ---------------------------------------------------------------------------------------------
static int by_next(const void *a, const void *b)
{
  const Corner *x = a, *y = b;
  if (x->next != y->next) return x->next < y->next ? -1 : 1;
  return x->corner < y->corner ? -1 : x->corner > y->corner;
}

static uint32_t root_of(Corner *fan, uint32_t i)
{
  while (fan[i].parent != i) i = fan[i].parent = fan[fan[i].parent].parent;
  return i;
}

// The first corner of the fan that begins with the edge another ends with; n if there is none.
static uint32_t first_with_next(const Corner *fan, uint32_t n, uint32_t vertex)
{
  uint32_t low = 0, high = n;
  while (low < high) {
    const uint32_t middle = (low + high) / 2;
    if (fan[middle].next < vertex)
      low = middle + 1;
    else
      high = middle;
  }
  return low;
}

// Joins corner i with the one across its last edge. A surface has one there; of heaps of triangles on one edge the
// first few are looked at.
static void join(const Making *g, Corner *fan, uint32_t n, uint32_t i, bool with_any)
{
  enum { LOOKED_AT = 8 };
  const uint32_t first = first_with_next(fan, n, fan[i].prev);
  for (uint32_t j = first; j < n && j < first + LOOKED_AT && fan[j].next == fan[i].prev; j++) {
    const uint8_t a = g->turns[fan[i].corner / 3], b = g->turns[fan[j].corner / 3];
    if (j == i || a == TURN_DEGENERATE || b == TURN_DEGENERATE) continue;
    const uint32_t ra = root_of(fan, i), rb = root_of(fan, j);
    const bool is_same = a == b && a != TURN_NONE, is_loose = a == TURN_NONE || b == TURN_NONE;
    // One without uv area goes with the first group it is found beside, and ties no two groups together.
    if (is_same || (with_any && is_loose && (a == TURN_NONE ? fan[i].parent == i : fan[j].parent == j))) {
      if (a == TURN_NONE)
        fan[ra].parent = rb;
      else
        fan[rb].parent = ra;
      return;
    }
  }
}

// Numbers the groups in the order of their first triangles; corners of no group go with the first.
static uint32_t number_groups(const Making *g, Corner *fan, uint32_t n)
{
  uint32_t count = 0;
  for (uint32_t i = 0; i < n; i++) fan[i].next = root_of(fan, i); // the edges have served
  for (uint32_t i = 0; i < n; i++) fan[i].prev = UINT32_MAX;
  for (uint32_t i = 0; i < n; i++) {
    if (g->turns[fan[i].corner / 3] == TURN_DEGENERATE) continue;
    uint32_t *number = &fan[fan[i].next].prev;
    if (*number == UINT32_MAX) *number = count++;
  }
  for (uint32_t i = 0; i < n; i++) {
    const uint32_t number = fan[fan[i].next].prev;
    fan[i].parent = number == UINT32_MAX ? 0 : number;
  }
  return count ? count : 1;
}

static void group_chunk(void *user, size_t item, int worker)
{
  (void)worker;
  Making *g = user;
  const size_t end = (item + 1) * CHUNK < g->vertex_count ? (item + 1) * CHUNK : g->vertex_count;
  for (size_t v = item * CHUNK; v < end; v++) {
    Corner *fan = g->corners + g->start[v];
    const uint32_t n = g->start[v + 1] - g->start[v];
    if (n > 1) qsort(fan, n, sizeof *fan, by_next);
    for (uint32_t i = 0; i < n; i++) fan[i].parent = i;
    for (int with_any = 0; with_any < 2; with_any++)
      for (uint32_t i = 0; i < n; i++) join(g, fan, n, i, with_any);
    g->groups[v] = n ? number_groups(g, fan, n) : 0;
  }
}

// --- tangents -------------------------------------------------------------------------------------------
static Vec3 in_plane(Vec3 d, Vec3 n) { return v3_normalize(d - v3_dot(d, n) * n); }

// Adds what the corner says of the direction of u.
static void add_corner(const Making *g, const Corner *c, Vec3 n, float *tangent)
{
  const uint32_t *v = g->m->triangles + 3 * (size_t)(c->corner / 3), k = c->corner % 3;
  const Turn turn = (Turn)g->turns[c->corner / 3];
  if (turn != TURN_PLAIN && turn != TURN_MIRRORED) return;
  const Vec3 p = position(g, v[k]);
  const Vec3 a = in_plane(position(g, v[(k + 1) % 3]) - p, n), b = in_plane(position(g, v[(k + 2) % 3]) - p, n);
  const Vec3 sum = v3_load(tangent) + f_acos(v3_dot(a, b)) * in_plane(u_direction(g, v, turn), n);
  v3_store(tangent, sum);
  tangent[3] = turn == TURN_MIRRORED ? -1 : 1;
}

static void sum_chunk(void *user, size_t item, int worker)
{
  (void)worker;
  Making *g = user;
  const size_t end = (item + 1) * CHUNK < g->vertex_count ? (item + 1) * CHUNK : g->vertex_count;
  for (size_t v = item * CHUNK; v < end; v++) {
    const Corner *fan = g->corners + g->start[v];
    const uint32_t n = g->start[v + 1] - g->start[v];
    const Vec3 normal = v3_normalize(v3_load(g->m->normals + 3 * v));
    for (uint32_t i = 0; i < n; i++) {
      const uint32_t at = g->groups[v] + fan[i].parent;
      g->out->of_corner[fan[i].corner] = at;
      add_corner(g, &fan[i], normal, g->out->tangents + 4 * (size_t)at);
    }
    for (uint32_t at = g->groups[v]; at < g->groups[v + 1]; at++) {
      float *t = g->out->tangents + 4 * (size_t)at;
      Vec3 d = v3_normalize(v3_load(t));
      if (v3_is_zero(d) || !v3_is_finite(d)) d = frame_around(v3_is_zero(normal) ? v3(0, 0, 1) : normal).x;
      v3_store(t, d);
      if (t[3] == 0) t[3] = 1;
    }
  }
}

// --- all of it --------------------------------------------------------------------------------------------
static bool make_room(Making *g)
{
  const size_t corners = 3 * g->triangle_count;
  g->weld = mem_alloc(g->vertex_count, sizeof *g->weld);
  g->start = mem_zero(g->vertex_count + 1, sizeof *g->start);
  g->groups = mem_zero(g->vertex_count + 1, sizeof *g->groups);
  g->turns = mem_alloc(g->triangle_count, sizeof *g->turns);
  g->corners = mem_alloc(corners, sizeof *g->corners);
  g->out = mem_zero(1, sizeof *g->out);
  if (!g->weld || !g->start || !g->groups || !g->turns || !g->corners || !g->out) return false;
  atomic_init(&g->out->users, 1);
  g->out->set = g->set;
  g->out->of_corner = mem_alloc(corners, sizeof *g->out->of_corner);
  return g->out->of_corner && weld_vertices(g);
}

// From how many groups each vertex has to where they begin.
static bool place_groups(Making *g)
{
  uint32_t sum = 0;
  for (size_t v = 0; v <= g->vertex_count; v++) {
    const uint32_t count = v < g->vertex_count ? g->groups[v] : 0;
    g->groups[v] = sum;
    sum += count;
  }
  g->out->count = sum;
  g->out->tangents = mem_zero(sum ? sum : 1, 4 * sizeof(float));
  g->out->size = 12 * g->triangle_count + 16 * (size_t)sum;
  return g->out->tangents;
}

Tangents *tangents_make(const TriangleMesh *m, size_t vertex_count, size_t triangle_count, int set, Jobs *jobs,
                        const Cancel *cancel, Err *err)
{
  Making g = {.m = m, .vertex_count = vertex_count, .triangle_count = triangle_count, .set = set};
  const size_t vertex_items = (vertex_count + CHUNK - 1) / CHUNK, triangle_items = (triangle_count + CHUNK - 1) / CHUNK;
  bool has_room = make_room(&g);
  bool ok = has_room && jobs_run(jobs, triangle_items, turn_chunk, &g, cancel);
  if (ok) gather_corners(&g);
  ok = ok && jobs_run(jobs, vertex_items, group_chunk, &g, cancel);
  if (ok) has_room = place_groups(&g);
  ok = ok && has_room && jobs_run(jobs, vertex_items, sum_chunk, &g, cancel);
  if (!has_room)
    err_memory(err, "a mesh's tangents", 76 * triangle_count);
  else if (!ok)
    err_set(err, ERR_CANCELLED, "preparing was cancelled");
  mem_free(g.weld);
  mem_free(g.start);
  mem_free(g.groups);
  mem_free(g.turns);
  mem_free(g.corners);
  if (ok) return g.out;
  tangents_release(g.out);
  return NULL;
}

Tangents *tangents_share(Tangents *t)
{
  if (t) atomic_fetch_add_explicit(&t->users, 1, memory_order_relaxed);
  return t;
}

void tangents_release(Tangents *t)
{
  if (!t || atomic_fetch_sub_explicit(&t->users, 1, memory_order_acq_rel) != 1) return;
  mem_free(t->of_corner);
  mem_free(t->tangents);
  mem_free(t);
}
