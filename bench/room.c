#include "room.h"

#include <math.h>

#define TAU 6.28318531f

// Where a piece stands: turned about the y axis, then moved.
typedef struct Spot {
  rtb_v3 p;
  float turn; // radians
} Spot;

static rtb_v3 spot_point(const Spot *s, rtb_v3 q)
{
  const float c = cosf(s->turn), d = sinf(s->turn);
  return rtb_v(s->p.x + c * q.x + d * q.z, s->p.y + q.y, s->p.z - d * q.x + c * q.z);
}

// A box with its corners on the spot; tilt moves its upper or right end sideways, which makes it a slanted beam.
static void beam(MeshOut *m, const Spot *at, rtb_v3 lo, rtb_v3 hi, rtb_v3 tilt)
{
  uint32_t v[8];
  for (int i = 0; i < 8; i++) {
    const rtb_v3 q = rtb_v(i & 1 ? hi.x : lo.x, i & 2 ? hi.y : lo.y, i & 4 ? hi.z : lo.z);
    const float end = tilt.x != 0 || tilt.z != 0 ? (float)((i & 2) != 0) : (float)(i & 1);
    v[i] = out_vertex(m, spot_point(at, rtb_add(q, rtb_mul(tilt, end))));
  }
  out_hexahedron(m, v);
}

static void block(MeshOut *m, const Spot *at, rtb_v3 lo, rtb_v3 hi)
{
  beam(m, at, lo, hi, rtb_v(0, 0, 0));
}

// A grid of (columns + 1) x (rows + 1) points given by a function of (s, t) in the unit square.
typedef rtb_v3 GridPoint(const void *user, float s, float t);

static void grid(MeshOut *m, int columns, int rows, GridPoint *point, const void *user)
{
  const uint32_t first = (uint32_t)m->mesh.nverts, stride = (uint32_t)columns + 1;
  for (int j = 0; j <= rows; j++)
    for (int i = 0; i <= columns; i++)
      out_vertex(m, point(user, (float)i / (float)columns, (float)j / (float)rows));
  for (uint32_t j = 0; j < (uint32_t)rows; j++)
    for (uint32_t i = 0; i < (uint32_t)columns; i++) {
      const uint32_t a = first + j * stride + i;
      out_quad(m, a, a + 1, a + stride + 1, a + stride);
    }
}

// --- turned pieces: cups, columns, lamps ---
typedef struct Turned {
  Spot at;
  float radius, height, waist, flutes; // waist: how far the profile swings; flutes: ripples around it
} Turned;

static rtb_v3 turned_point(const void *user, float s, float t)
{
  const Turned *c = user;
  const float wave = 1 + c->waist * sinf(TAU * (t + 0.1f)) + c->flutes * cosf(12 * TAU * s);
  const float closing = fminf(1, 40 * fminf(t, 1 - t) + 0.02f);
  const float r = c->radius * wave * closing, a = TAU * s;
  return spot_point(&c->at, rtb_v(r * cosf(a), c->height * t, r * sinf(a)));
}

static void turned(MeshOut *m, Turned c, int detail)
{
  grid(m, detail, detail, turned_point, &c);
}

// --- cloth: curtains hang, carpets lie ---
typedef struct Cloth {
  Spot at;
  float width, length;
  bool lies;
} Cloth;

static rtb_v3 cloth_point(const void *user, float s, float t)
{
  const Cloth *c = user;
  const float x = c->width * s, y = c->length * t;
  if (c->lies) return spot_point(&c->at, rtb_v(x, 0.012f + 0.01f * sinf(9 * x) * sinf(7 * y + x), y));
  return spot_point(&c->at, rtb_v(x, y, (0.03f + 0.05f * (1 - t)) * sinf(40 * s + 2 * sinf(3 * t))));
}

// --- furniture ---
static void table(MeshOut *m, Spot at)
{
  block(m, &at, rtb_v(-0.9f, 0.72f, -0.5f), rtb_v(0.9f, 0.76f, 0.5f));
  for (int i = 0; i < 4; i++) {
    const float x = i & 1 ? 0.82f : -0.86f, z = i & 2 ? 0.42f : -0.46f;
    beam(m, &at, rtb_v(x, 0, z), rtb_v(x + 0.05f, 0.72f, z + 0.05f), rtb_v(i & 1 ? -0.1f : 0.1f, 0, 0));
  }
}

static void chair(MeshOut *m, Spot at)
{
  block(m, &at, rtb_v(-0.2f, 0.42f, -0.2f), rtb_v(0.2f, 0.45f, 0.2f));
  for (int i = 0; i < 4; i++) {
    const float x = i & 1 ? 0.16f : -0.19f, z = i & 2 ? 0.16f : -0.19f;
    block(m, &at, rtb_v(x, 0, z), rtb_v(x + 0.03f, 0.42f, z + 0.03f));
  }
  for (int i = 0; i < 7; i++) { // the back: staves that lean
    const float x = -0.19f + 0.06f * (float)i;
    beam(m, &at, rtb_v(x, 0.45f, 0.17f), rtb_v(x + 0.02f, 0.95f, 0.19f), rtb_v(0, 0, 0.12f));
  }
  block(m, &at, rtb_v(-0.21f, 0.94f, 0.28f), rtb_v(0.21f, 1.0f, 0.31f));
}

static void table_setting(MeshOut *m, Spot at, uint32_t id, int detail)
{
  table(m, at);
  for (uint32_t i = 0; i < 4; i++) {
    const rtb_v3 q = rtb_v(-0.6f + 0.4f * (float)i, 0.76f, 0.3f * (rtb_rnd(21, id, i) - 0.5f));
    const Spot spot = {spot_point(&at, q), 0};
    turned(m, (Turned){spot, 0.06f, 0.12f + 0.15f * rtb_rnd(22, id, i), 0.35f, 0.02f}, detail);
  }
  for (uint32_t i = 0; i < 4; i++) {
    const float side = i & 1 ? 1 : -1, along = i & 2 ? 0.45f : -0.45f;
    const Spot spot = {spot_point(&at, rtb_v(along, 0, 0.75f * side)),
                       at.turn + (side > 0 ? 0 : TAU / 2) + 0.5f * (rtb_rnd(23, id, i) - 0.5f)};
    chair(m, spot);
  }
}

static void shelf(MeshOut *m, Spot at, uint32_t id)
{
  block(m, &at, rtb_v(0, 0, 0), rtb_v(0.03f, 2.4f, 0.3f));
  block(m, &at, rtb_v(1.97f, 0, 0), rtb_v(2, 2.4f, 0.3f));
  for (uint32_t row = 0; row < 7; row++) {
    const float y = 0.05f + 0.37f * (float)row;
    block(m, &at, rtb_v(0.03f, y - 0.02f, 0), rtb_v(1.97f, y, 0.3f));
    float x = 0.04f;
    for (uint32_t book = 0; x < 1.88f; book++) {
      const uint32_t k = row * 64 + book;
      const float w = 0.02f + 0.04f * rtb_rnd(24, id, k), h = 0.2f + 0.1f * rtb_rnd(25, id, k);
      const float lean = rtb_rnd(26, id, k) < 0.2f ? 0.04f : 0;
      beam(m, &at, rtb_v(x, y, 0.02f), rtb_v(x + w, y + h, 0.2f + 0.08f * rtb_rnd(27, id, k)),
           rtb_v(lean, 0, 0));
      x += w + lean + 0.002f;
    }
  }
}

static void plant(MeshOut *m, Spot at, uint32_t id, int detail)
{
  turned(m, (Turned){at, 0.2f, 0.4f, 0.15f, 0}, detail);
  for (uint32_t i = 0; i < 300; i++) {
    const float a = TAU * rtb_rnd(28, id, 3 * i), up = rtb_rnd(28, id, 3 * i + 1),
                r = 0.45f * rtb_rnd(28, id, 3 * i + 2);
    const rtb_v3 root = rtb_v(r * cosf(a), 0.45f + up, r * sinf(a)),
                 side = rtb_v(-0.02f * sinf(a), 0, 0.02f * cosf(a));
    const rtb_v3 tip =
        rtb_add(root, rtb_v(0.16f * cosf(a), 0.1f * (rtb_rnd(29, id, i) - 0.6f), 0.16f * sinf(a)));
    const uint32_t v0 = out_vertex(m, spot_point(&at, rtb_add(root, side)));
    const uint32_t v1 = out_vertex(m, spot_point(&at, rtb_sub(root, side)));
    out_triangle(m, v0, v1, out_vertex(m, spot_point(&at, tip)));
  }
}

static void chandelier(MeshOut *m, Spot at, int detail)
{
  const rtb_v3 p = at.p;
  block(m, &at, rtb_v(-0.01f, 0.3f, -0.01f), rtb_v(0.01f, 5 - p.y, 0.01f));
  for (int i = 0; i < 12; i++) {
    const Spot arm = {p, TAU * (float)i / 12};
    beam(m, &arm, rtb_v(0, 0.28f, -0.008f), rtb_v(0.6f, 0.3f, 0.008f), rtb_v(0, -0.2f, 0));
    const Spot bulb = {spot_point(&arm, rtb_v(0.6f, 0.1f, 0)), 0};
    turned(m, (Turned){bulb, 0.05f, 0.12f, 0.2f, 0}, detail / 2 + 3);
  }
}

// --- the hall itself: 16 x 5 x 10 metres ---
static void shell(MeshOut *m)
{
  out_box(m, rtb_v(0, 0, 0), rtb_v(16, 5, 10));
  const Spot origin = {{0, 0, 0}, 0};
  for (int i = 0; i < 9; i++) { // trusses under the ceiling, slanted both ways
    const float x = 0.8f + 1.8f * (float)i;
    block(m, &origin, rtb_v(x, 4.4f, 0), rtb_v(x + 0.12f, 4.55f, 10));
    for (int k = 0; k < 8; k++) {
      const float z = 0.2f + 1.2f * (float)k, lean = k & 1 ? -1.1f : 1.1f;
      beam(m, &origin, rtb_v(x + 0.03f, 4.55f, z + (k & 1 ? 1.1f : 0)),
           rtb_v(x + 0.09f, 4.98f, z + (k & 1 ? 1.17f : 0.07f)), rtb_v(0, 0, lean));
    }
  }
  for (int j = 0; j < 22; j++) // parquet: strips at 45 degrees
    for (int i = 0; i < 8; i++) {
      const float x = 1 + 0.5f * (float)j + 0.25f * (float)(i & 1), z = 1.1f + 1.0f * (float)i;
      const Spot strip = {{x, 0, z}, TAU / 8};
      block(m, &strip, rtb_v(-0.6f, 0.001f, -0.16f), rtb_v(0.6f, 0.006f, 0.16f));
    }
  for (int k = 0; k < 18; k++) // stairs along the back wall, and a handrail
    block(m, &origin, rtb_v(9.5f + 0.28f * (float)k, 0, 0),
          rtb_v(9.8f + 0.28f * (float)k, 0.17f * (float)(k + 1), 1.2f));
  beam(m, &origin, rtb_v(9.5f, 0.9f, 1.17f), rtb_v(14.5f, 0.95f, 1.22f), rtb_v(0, 3.06f, 0));
  for (int k = 0; k < 36; k++) {
    const float x = 9.55f + 0.14f * (float)k, y = 0.0857f * (float)k;
    block(m, &origin, rtb_v(x, y, 1.18f), rtb_v(x + 0.02f, y + 0.92f, 1.2f));
  }
}

void room_make(MeshOut *m, int detail)
{
  shell(m);
  for (int i = 0; i < 8; i++) {
    const Spot at = {{1.5f + 4.2f * (float)(i / 2), 0, i & 1 ? 7.8f : 2.4f}, 0};
    turned(m, (Turned){at, 0.22f, 4.4f, 0.06f, 0.03f}, 2 * detail);
  }
  for (uint32_t i = 0; i < 8; i++) {
    const Spot at = {{2.8f + 3.1f * (float)(i / 2), 0.006f, i & 1 ? 6.4f : 3.7f},
                     1.4f * (rtb_rnd(20, i, 0) - 0.5f)};
    table_setting(m, at, i, detail);
  }
  for (uint32_t i = 0; i < 6; i++) shelf(m, (Spot){{1.2f + 2.2f * (float)i, 0, 9.65f}, 0}, i);
  for (int i = 0; i < 4; i++) {
    const Cloth curtain = {{{0.15f, 0.1f, 3 + 1.7f * (float)i}, TAU / 4}, 1.5f, 4.1f, false};
    grid(m, 3 * detail, detail, cloth_point, &curtain);
  }
  const Cloth carpet = {{{5, 0.006f, 4}, 0.3f}, 5, 2.4f, true};
  grid(m, 4 * detail, 2 * detail, cloth_point, &carpet);
  for (uint32_t i = 0; i < 6; i++)
    plant(m, (Spot){{1 + 2.7f * (float)i, 0, i & 1 ? 8.9f : 1.9f}, 0}, i, detail);
  for (int i = 0; i < 3; i++) chandelier(m, (Spot){{3.5f + 4 * (float)i, 3.2f, 5}, 0.1f}, detail);
}
