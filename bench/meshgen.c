// Meshgen: benchmark meshes anyone can make again: each is a pure function of its arguments. Usage below.

#include "mesh_out.h"
#include "room.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265f

static const char usage[] = "usage: meshgen KIND N OUT.rtm\n"
                            "  terrain N  fractal height field of N x N cells, 2 N^2 triangles\n"
                            "  sphere N   displaced sphere, 4 N^2 triangles\n"
                            "  hair N     tangle of N strands of 48 triangles\n"
                            "  city N     N x N blocks of buildings with windows, cars and trees\n"
                            "  room N     furnished hall; 106,344 triangles for 19\n"
                            "  subdiv IN  Loop subdivision of a mesh file: each triangle becomes four\n";

// --- value noise on a lattice of whole numbers, blended by Perlin's quintic (2002) -------------------
static float lattice(int x, int y, int z)
{
  const uint32_t h = rtb_hash((uint32_t)x + rtb_hash((uint32_t)y + rtb_hash((uint32_t)z + 77u)));
  return (float)(h >> 8) / 8388608.0f - 1.0f;
}

static float fade(float t)
{
  return t * t * t * (t * (t * 6 - 15) + 10);
}

static float noise(float x, float y, float z)
{
  const int X = (int)floorf(x), Y = (int)floorf(y), Z = (int)floorf(z);
  const float fx = fade(x - (float)X), fy = fade(y - (float)Y), fz = fade(z - (float)Z);
  float layer[2];
  for (int k = 0; k < 2; k++) {
    const float a = lattice(X, Y, Z + k), b = lattice(X + 1, Y, Z + k);
    const float c = lattice(X, Y + 1, Z + k), d = lattice(X + 1, Y + 1, Z + k);
    const float p = a + (b - a) * fx, q = c + (d - c) * fx;
    layer[k] = p + (q - p) * fy;
  }
  return layer[0] + (layer[1] - layer[0]) * fz;
}

static float fractal_noise(float x, float y, float z, int octaves)
{
  float sum = 0, weight = 0.5f;
  for (int i = 0; i < octaves; i++) {
    sum += weight * noise(x, y, z);
    x *= 2.03f;
    y *= 2.03f;
    z *= 2.03f;
    weight *= 0.5f;
  }
  return sum;
}

// --- one surface -----------------------------------------------------------------------------------
static void terrain(MeshOut *m, int n)
{
  for (int j = 0; j <= n; j++)
    for (int i = 0; i <= n; i++) {
      const float x = 100.0f * (float)i / (float)n, z = 100.0f * (float)j / (float)n;
      const float h = fractal_noise(x * 0.06f, z * 0.06f, 0.5f, 9);
      out_vertex(m, rtb_v(x, 18.0f * (1.0f - fabsf(h)) * (1.0f - fabsf(h)), z));
    }
  for (int j = 0; j < n; j++)
    for (int i = 0; i < n; i++) {
      const uint32_t a = (uint32_t)(j * (n + 1) + i), c = a + (uint32_t)n + 1;
      out_quad(m, a, c, c + 1, a + 1);
    }
}

static void sphere(MeshOut *m, int n)
{
  const int columns = 2 * n;
  for (int j = 0; j <= n; j++)
    for (int i = 0; i <= columns; i++) {
      const float theta = PI * (float)j / (float)n, phi = 2 * PI * (float)(i % columns) / (float)columns;
      const rtb_v3 p = rtb_v(sinf(theta) * cosf(phi), cosf(theta), sinf(theta) * sinf(phi));
      const float d = 1.0f + 0.35f * fractal_noise(3 * p.x + 5, 3 * p.y + 5, 3 * p.z + 5, 7);
      out_vertex(m, rtb_mul(p, d));
    }
  for (int j = 0; j < n; j++)
    for (int i = 0; i < columns; i++) {
      const uint32_t a = (uint32_t)(j * (columns + 1) + i), c = a + (uint32_t)columns + 1;
      out_quad(m, a, a + 1, c + 1, c);
    }
}

// --- hair: ribbons 0.0012 wide that wander by noise and are pulled back to a ball --------------------
static void strand(MeshOut *m, uint32_t s)
{
  const float u = rtb_rnd(1, s, 0) * 2 - 1, phi = rtb_rnd(1, s, 1) * 2 * PI;
  const float r = sqrtf(fmaxf(0, 1 - u * u));
  rtb_v3 p = rtb_mul(rtb_v(r * cosf(phi), u, r * sinf(phi)), 0.35f + 0.5f * rtb_rnd(1, s, 2));
  rtb_v3 d = rtb_norm(p);
  uint32_t last_a = 0, last_b = 0;
  for (int k = 0; k <= 24; k++) {
    const rtb_v3 turn = rtb_v(noise(4 * p.x, 4 * p.y, 4 * p.z), noise(4 * p.x + 31, 4 * p.y, 4 * p.z),
                              noise(4 * p.x, 4 * p.y + 57, 4 * p.z));
    d = rtb_norm(rtb_add(d, rtb_mul(turn, 0.9f)));
    d = rtb_norm(rtb_sub(d, rtb_mul(p, 0.10f * rtb_dot(p, p))));
    const rtb_v3 side = rtb_norm(rtb_cross(d, rtb_v(0.3f, 1.0f, 0.17f)));
    const float w = 0.0006f;
    const uint32_t a = out_vertex(m, rtb_v(p.x - w * side.x, p.y - w * side.y, p.z - w * side.z));
    const uint32_t b = out_vertex(m, rtb_v(p.x + w * side.x, p.y + w * side.y, p.z + w * side.z));
    if (k) out_quad(m, last_a, last_b, b, a);
    last_a = a;
    last_b = b;
    p = rtb_add(p, rtb_mul(d, 0.03f));
  }
}

static void hair(MeshOut *m, int n)
{
  for (int s = 0; s < n; s++) strand(m, (uint32_t)s);
}

// --- city ------------------------------------------------------------------------------------------
static void box(MeshOut *m, float x0, float y0, float z0, float x1, float y1, float z1)
{
  out_box(m, rtb_v(x0, y0, z0), rtb_v(x1, y1, z1));
}

// A trunk, and leaves that are single small triangles in a ball.
static void tree(MeshOut *m, float x, float z, float h, uint32_t id)
{
  box(m, x - 0.03f, 0, z - 0.03f, x + 0.03f, h * 0.5f, z + 0.03f);
  for (uint32_t k = 0; k < 260; k++) {
    const float u = rtb_rnd(5, id, 3 * k) * 2 - 1, phi = rtb_rnd(5, id, 3 * k + 1) * 2 * PI;
    const float r = 0.32f * h * cbrtf(rtb_rnd(5, id, 3 * k + 2)), s = sqrtf(fmaxf(0, 1 - u * u)),
                e = 0.05f * h;
    const float cx = x + r * s * cosf(phi), cy = h * 0.75f + r * u, cz = z + r * s * sinf(phi);
    const uint32_t a = out_vertex(m, rtb_v(cx, cy, cz));
    const uint32_t b = out_vertex(m, rtb_v(cx + e * (rtb_rnd(6, id, 4 * k) - 0.5f), cy + e,
                                           cz + e * (rtb_rnd(6, id, 4 * k + 1) - 0.5f)));
    const uint32_t c = out_vertex(m, rtb_v(cx + e, cy + e * (rtb_rnd(6, id, 4 * k + 2) - 0.5f),
                                           cz + e * (rtb_rnd(6, id, 4 * k + 3) - 0.5f)));
    out_triangle(m, a, b, c);
  }
}

typedef struct Plot {
  float x0, z0, x1, z1;
  uint32_t id;
} Plot;

static void park(MeshOut *m, const Plot *p)
{
  for (uint32_t k = 0; k < 12; k++)
    tree(m, p->x0 + (p->x1 - p->x0) * rtb_rnd(3, p->id, 2 * k),
         p->z0 + (p->z1 - p->z0) * rtb_rnd(3, p->id, 2 * k + 1), 0.6f + 0.5f * rtb_rnd(4, p->id, k),
         p->id * 16 + k);
}

// Boxes that stand out a little from all four walls.
static void windows(MeshOut *m, const Plot *p, float height)
{
  const int floors = (int)(height / 0.3f), columns = 8;
  const float o = 0.02f;
  for (int f = 0; f < floors; f++)
    for (int c = 0; c < columns; c++) {
      const float y = 0.1f + 0.3f * (float)f, y1 = y + 0.18f;
      const float t0 = ((float)c + 0.2f) / (float)columns, t1 = ((float)c + 0.8f) / (float)columns;
      const float xa = p->x0 + (p->x1 - p->x0) * t0, xb = p->x0 + (p->x1 - p->x0) * t1;
      const float za = p->z0 + (p->z1 - p->z0) * t0, zb = p->z0 + (p->z1 - p->z0) * t1;
      box(m, xa, y, p->z0 - o, xb, y1, p->z0);
      box(m, xa, y, p->z1, xb, y1, p->z1 + o);
      box(m, p->x0 - o, y, za, p->x0, y1, zb);
      box(m, p->x1, y, za, p->x1 + o, y1, zb);
    }
}

static void building(MeshOut *m, const Plot *p, float height)
{
  box(m, p->x0, 0, p->z0, p->x1, height, p->z1);
  windows(m, p, height);
  for (uint32_t k = 0; k < 6; k++) { // things on the roof, cars
    const float rx = p->x0 + (p->x1 - p->x0) * rtb_rnd(7, p->id, 2 * k);
    const float rz = p->z0 + (p->z1 - p->z0) * rtb_rnd(7, p->id, 2 * k + 1);
    box(m, rx, height, rz, rx + 0.15f, height + 0.1f + 0.2f * rtb_rnd(8, p->id, k), rz + 0.15f);
    const float cx = p->x0 + (p->x1 - p->x0) * rtb_rnd(9, p->id, k), cz = p->z0 - 0.35f;
    box(m, cx, 0.02f, cz, cx + 0.3f, 0.1f, cz + 0.13f);
    box(m, cx + 0.07f, 0.1f, cz, cx + 0.22f, 0.17f, cz + 0.13f);
  }
  tree(m, p->x0 - 0.1f, p->z0 - 0.1f, 0.7f, p->id + 900000u);
}

static void city(MeshOut *m, int n)
{
  const float plot = 4.0f, street = 1.2f, end = (float)n * plot + 2;
  const uint32_t a = out_vertex(m, rtb_v(-2, 0, -2)), b = out_vertex(m, rtb_v(end, 0, -2));
  const uint32_t c = out_vertex(m, rtb_v(end, 0, end)), d = out_vertex(m, rtb_v(-2, 0, end));
  out_quad(m, a, d, c, b); // the ground: two huge triangles
  for (int j = 0; j < n; j++)
    for (int i = 0; i < n; i++) {
      Plot p = {(float)i * plot + street * 0.5f, (float)j * plot + street * 0.5f, 0, 0,
                (uint32_t)(j * n + i)};
      p.x1 = p.x0 + plot - street;
      p.z1 = p.z0 + plot - street;
      const float middle = hypotf((float)i - (float)n * 0.5f, (float)j - (float)n * 0.5f) / (float)n;
      const float h = 1.0f + 9.0f * rtb_rnd(2, p.id, 0) * rtb_rnd(2, p.id, 1) * expf(-3 * middle) * 2.5f;
      box(m, p.x0 - 0.15f, 0, p.z0 - 0.15f, p.x1 + 0.15f, 0.05f, p.z1 + 0.15f);
      if (rtb_rnd(2, p.id, 2) < 0.15f)
        park(m, &p);
      else
        building(m, &p, h);
    }
}

// --- Loop subdivision (Loop 1987); open edges get the plain midpoint and their vertices stay ---------
typedef struct Edge {
  uint32_t a, b, middle, users;
  float opposite[3]; // sum of the vertices across
} Edge;

typedef struct Edges { // hashed by their ends
  Edge *slots;
  uint64_t mask;
} Edges;

static Edge *edge_at(Edges *e, uint32_t a, uint32_t b)
{
  const uint32_t low = a < b ? a : b, high = a < b ? b : a;
  uint64_t i = rtb_hash(low + rtb_hash(high)) & e->mask;
  while (e->slots[i].users && (e->slots[i].a != low || e->slots[i].b != high)) i = (i + 1) & e->mask;
  if (!e->slots[i].users) {
    e->slots[i].a = low;
    e->slots[i].b = high;
  }
  return &e->slots[i];
}

static void *cleared(size_t count, size_t size)
{
  return memset(rtb_alloc(count, size), 0, count * size);
}

static Edges edges_of(const rtb_mesh *s)
{
  Edges e = {0};
  uint64_t room = 1;
  while (room < s->ntris * 4) room *= 2;
  e.slots = cleared(room, sizeof *e.slots);
  e.mask = room - 1;
  for (uint64_t t = 0; t < s->ntris; t++)
    for (int k = 0; k < 3; k++) {
      const uint32_t *v = s->idx + 3 * t;
      const float *across = s->verts + 3 * (uint64_t)v[(k + 2) % 3];
      Edge *edge = edge_at(&e, v[k], v[(k + 1) % 3]);
      edge->users++;
      for (int c = 0; c < 3; c++) edge->opposite[c] += across[c];
    }
  return e;
}

static void subdivide_vertices(MeshOut *m, const rtb_mesh *s, const Edges *e)
{
  float *sum = cleared(s->nverts * 3, sizeof *sum); // of the neighbours
  uint32_t *valence = cleared(s->nverts, sizeof *valence);
  bool *is_open = cleared(s->nverts, sizeof *is_open);
  for (uint64_t i = 0; i <= e->mask; i++) {
    const Edge *edge = &e->slots[i];
    if (!edge->users) continue;
    if (edge->users != 2) is_open[edge->a] = is_open[edge->b] = true;
    for (int k = 0; k < 3; k++) {
      sum[3 * (uint64_t)edge->a + k] += s->verts[3 * (uint64_t)edge->b + k];
      sum[3 * (uint64_t)edge->b + k] += s->verts[3 * (uint64_t)edge->a + k];
    }
    valence[edge->a]++;
    valence[edge->b]++;
  }
  for (uint64_t v = 0; v < s->nverts; v++) {
    const rtb_v3 p = rtb_v(s->verts[3 * v], s->verts[3 * v + 1], s->verts[3 * v + 2]);
    if (is_open[v] || !valence[v]) {
      out_vertex(m, p);
      continue;
    }
    const float n = (float)valence[v], c = 0.375f + 0.25f * cosf(2 * PI / n), beta = (0.625f - c * c) / n;
    out_vertex(m, rtb_add(rtb_mul(p, 1 - n * beta),
                          rtb_mul(rtb_v(sum[3 * v], sum[3 * v + 1], sum[3 * v + 2]), beta)));
  }
  free(sum);
  free(valence);
  free(is_open);
}

static void subdivide_edges(MeshOut *m, const rtb_mesh *s, Edges *e)
{
  for (uint64_t i = 0; i <= e->mask; i++) {
    Edge *edge = &e->slots[i];
    if (!edge->users) continue;
    const float *p = s->verts + 3 * (uint64_t)edge->a, *q = s->verts + 3 * (uint64_t)edge->b,
                *o = edge->opposite;
    float v[3];
    for (int k = 0; k < 3; k++)
      v[k] = edge->users == 2 ? 0.375f * (p[k] + q[k]) + 0.125f * o[k] : 0.5f * (p[k] + q[k]);
    edge->middle = out_vertex(m, rtb_v(v[0], v[1], v[2]));
  }
}

static bool subdivide(MeshOut *m, const char *in)
{
  rtb_mesh s;
  if (!rtb_mesh_read(in, &s)) return false;
  Edges e = edges_of(&s);
  subdivide_vertices(m, &s, &e);
  subdivide_edges(m, &s, &e);
  for (uint64_t t = 0; t < s.ntris; t++) {
    const uint32_t a = s.idx[3 * t], b = s.idx[3 * t + 1], c = s.idx[3 * t + 2];
    const uint32_t x = edge_at(&e, a, b)->middle, y = edge_at(&e, b, c)->middle,
                   z = edge_at(&e, c, a)->middle;
    out_triangle(m, a, x, z);
    out_triangle(m, x, b, y);
    out_triangle(m, z, y, c);
    out_triangle(m, x, y, z);
  }
  free(e.slots);
  free(s.verts);
  free(s.idx);
  return true;
}

// --- the program -----------------------------------------------------------------------------------
static bool make(MeshOut *m, const char *kind, const char *argument)
{
  static const struct {
    const char *name;
    void (*make)(MeshOut *m, int n);
    int most; // so that indices stay below 2^31
  } kinds[] = {{"terrain", terrain, 30000},
               {"sphere", sphere, 20000},
               {"hair", hair, 40000000},
               {"city", city, 400},
               {"room", room_make, 1000}};
  const int n = atoi(argument);
  if (!strcmp(kind, "subdiv")) return subdivide(m, argument);
  for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
    if (!strcmp(kind, kinds[i].name) && n >= 1 && n <= kinds[i].most) {
      kinds[i].make(m, n);
      return true;
    }
  fputs(usage, stderr);
  return false;
}

int main(int argc, char **argv)
{
  MeshOut m = {0};
  if (argc != 4) {
    fputs(usage, stderr);
    return 64;
  }
  if (!make(&m, argv[1], argv[2])) return 64;
  rtb_mesh_bounds(&m.mesh);
  const rtb_v3 lo = m.mesh.lo, hi = m.mesh.hi;
  printf("%s: %llu vertices, %llu triangles, box (%g %g %g) (%g %g %g)\n", argv[3],
         (unsigned long long)m.mesh.nverts, (unsigned long long)m.mesh.ntris, lo.x, lo.y, lo.z, hi.x, hi.y,
         hi.z);
  return rtb_mesh_write(argv[3], &m.mesh) ? 0 : 73;
}
