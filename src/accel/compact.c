// Packing nodes into the compact form of accel/compact.h. Every plane is rounded outwards as it will be unpacked: it is
// decoded here by the same arithmetic, and moved on until the box it belongs to contains the exact one.

#include "accel/compact.h"

enum { CHUNK = 1 << 10, LAST_STEP = 255 };

static void set_plane(CompactNode *c, int axis, int i, double steps)
{
  c->plane[axis][i] = (uint8_t)(steps < 0 ? 0 : steps > LAST_STEP ? LAST_STEP : steps);
}

// An origin that is not denormal, since a caller's mode may flush it to zero when it is added to.
static float grid_origin(float lo)
{
  return fabsf(lo) >= FLT_MIN ? lo : lo < 0 ? -FLT_MIN : 0;
}

// The finest grid along an axis whose last plane is at hi or beyond.
static void set_grid(CompactNode *c, int axis, float lo, float hi)
{
  c->origin[axis] = grid_origin(lo);
  const double step = ((double)hi - c->origin[axis]) / LAST_STEP;
  const int exponent = step > 0 ? ilogb(step) + 127 : 1;
  c->exponent[axis] = (uint8_t)(exponent > 1 ? exponent : 1);
  c->plane[axis][0] = LAST_STEP;
  while (compact_plane(c, axis, 0) < hi) c->exponent[axis]++;
}

// The first and last planes of the grid are outside or at the node's ends, so that neither search runs off it.
static void set_child(CompactNode *c, int axis, int i, float lo, float hi)
{
  const double origin = c->origin[axis], step = compact_step(c, axis);
  set_plane(c, axis, i, floor((lo - origin) / step));
  while (compact_plane(c, axis, i) > lo) c->plane[axis][i]--;
  set_plane(c, axis, i + 8, ceil((hi - origin) / step));
  while (compact_plane(c, axis, i + 8) < hi) c->plane[axis][i + 8]++;
}

static void pack_node(CompactNode *to, const Node8 *from)
{
  CompactNode c = {.count = 0};
  while (c.count < 8 && from->child[c.count] != EMPTY_TREE) c.count++;
  for (int k = 0; k < 3; k++) {
    float lo = INFINITY, hi = -INFINITY;
    for (int i = 0; i < c.count; i++) {
      lo = min_f(lo, from->box[2 * k][i]);
      hi = max_f(hi, from->box[2 * k + 1][i]);
    }
    set_grid(&c, k, lo, hi);
    c.plane[k][0] = 0;
    for (int i = 0; i < c.count; i++) set_child(&c, k, i, from->box[2 * k][i], from->box[2 * k + 1][i]);
  }
  memcpy(c.child, from->child, sizeof c.child);
  *to = c;
}

typedef struct Packing {
  CompactNode *to;
  const Node8 *from;
  size_t count;
} Packing;

static void pack_chunk(void *user, size_t chunk, int worker)
{
  (void)worker;
  const Packing *p = user;
  const size_t end = (chunk + 1) * CHUNK < p->count ? (chunk + 1) * CHUNK : p->count;
  for (size_t i = chunk * CHUNK; i < end; i++) pack_node(&p->to[i], &p->from[i]);
}

void compact_pack(CompactNode *to, const Node8 *from, size_t count, Jobs *jobs)
{
  Packing p = {to, from, count};
  (void)jobs_run(jobs, (count + CHUNK - 1) / CHUNK, pack_chunk, &p, NULL);
}
