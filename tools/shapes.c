// Makes the meshes of our sample scenes, so that every model in the repository is ours and can be made again:
//
//   cc -O2 -o shapes tools/shapes.c -lm && ./shapes scenes/meshes
//
// Each is a surface over a grid of (u, v), written as a binary PLY with normals and texture coordinates. A program of
// its own: it uses nothing of the library.

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

typedef struct {
  double x, y, z;
} P;

typedef P Surface(double u, double v); // u, v in 0..1

static const double TAU = 6.28318530717958647692;

static P sub(P a, P b) { return (P){a.x - b.x, a.y - b.y, a.z - b.z}; }
static P cross(P a, P b) { return (P){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }

static P unit(P a)
{
  const double n = sqrt(a.x * a.x + a.y * a.y + a.z * a.z);
  return n > 0 ? (P){a.x / n, a.y / n, a.z / n} : (P){0, 1, 0};
}

// --- the surfaces ---------------------------------------------------------------------------------
static P knot_centre(double t) // a (2, 3) torus knot
{
  const double r = 2 + cos(3 * TAU * t);
  return (P){r * cos(2 * TAU * t), r * sin(2 * TAU * t), -1.15 * sin(3 * TAU * t)};
}

// A tube around the knot with a frame that does not twist where it closes, and a gentle rope-like ripple.
static P knot(double u, double v)
{
  const double e = 1e-4, scale = 0.2;
  const P c = knot_centre(u), t = unit(sub(knot_centre(u + e), knot_centre(u - e)));
  const P a = unit(cross((P){0, 0, 1}, t)), b = cross(t, a);
  const double w = TAU * v, r = 0.46 * (1 + 0.035 * cos(5 * w + 30 * TAU * u));
  const double x = r * cos(w), y = r * sin(w);
  return (P){scale * (c.x + x * a.x + y * b.x), scale * (c.y + x * a.y + y * b.y), scale * (c.z + x * a.z + y * b.z)};
}

static double spow(double x, double p) { return copysign(pow(fabs(x), p), x); }

static P cushion(double u, double v) // a superellipsoid: a cube with soft edges
{
  const double a = TAU * u, b = TAU / 2 * (v - 0.5), p = 0.28;
  return (P){0.5 * spow(cos(b), p) * spow(cos(a), p), 0.5 * spow(sin(b), p), -0.5 * spow(cos(b), p) * spow(sin(a), p)};
}

static P vase(double u, double v) // twisted ribs outside, a smooth inside; turned up over a rolled rim
{
  const bool is_inside = v > 0.55;
  const double h = is_inside ? (1 - v) / 0.45 : v / 0.55; // 0 at the foot, 1 at the rim
  const double belly = 0.17 + 0.16 * sin(TAU / 2 * pow(h, 0.75)) - 0.05 * h * h + 0.09 * pow(h, 8);
  const double ribs = is_inside ? 0 : 0.022 * cos(9 * (TAU * u + 1.1 * h)) * sin(TAU / 2 * h);
  const double foot = fmin(h / 0.03, 1); // closed below
  const double r = foot * (belly + ribs - (is_inside ? 0.022 : 0));
  const double y = is_inside ? 0.03 + 0.87 * h : 0.9 * h;
  return (P){r * cos(TAU * u), y, -r * sin(TAU * u)};
}

static P goblet(double u, double v) // turned on a lathe: outside up, over the rim, inside down
{
  static const double profile[][2] = {{0, 0},        {0.22, 0},     {0.23, 0.012},  {0.21, 0.022}, {0.06, 0.045},
                                      {0.028, 0.09}, {0.022, 0.2},  {0.022, 0.3},   {0.035, 0.36}, {0.12, 0.40},
                                      {0.19, 0.48},  {0.215, 0.58}, {0.205, 0.70},  {0.18, 0.80},  {0.176, 0.805},
                                      {0.172, 0.80}, {0.196, 0.70}, {0.2055, 0.58}, {0.18, 0.487}, {0.11, 0.412},
                                      {0.03, 0.39},  {0, 0.386}};
  const int n = (int)(sizeof profile / sizeof *profile) - 1;
  const double at = v * n;
  int i = (int)at;
  if (i >= n) i = n - 1;
  const double t = at - i;
  double q[2];
  for (int k = 0; k < 2; k++) { // Catmull-Rom
    const double p0 = profile[i > 0 ? i - 1 : 0][k], p1 = profile[i][k], p2 = profile[i + 1][k];
    const double p3 = profile[i + 2 <= n ? i + 2 : n][k];
    q[k] = p1 + 0.5 * t * (p2 - p0 + t * (2 * p0 - 5 * p1 + 4 * p2 - p3 + t * (3 * (p1 - p2) + p3 - p0)));
  }
  if (q[0] < 0) q[0] = 0;
  return (P){q[0] * cos(TAU * u), q[1], -q[0] * sin(TAU * u)};
}

static P plinth(double u, double v) // a round base with a bevelled rim
{
  const double r = 0.5, h = 0.3, bevel = 0.03, a = TAU * u;
  double x, y;
  if (v < 0.25) x = (r - bevel) * v / 0.25, y = 0; // bottom
  else if (v < 0.35) {
    const double t = (v - 0.25) / 0.1 * TAU / 4;
    x = r - bevel + bevel * sin(t), y = bevel - bevel * cos(t);
  } else if (v < 0.55) x = r, y = bevel + (h - 2 * bevel) * (v - 0.35) / 0.2;
  else if (v < 0.65) {
    const double t = (v - 0.55) / 0.1 * TAU / 4;
    x = r - bevel + bevel * cos(t), y = h - bevel + bevel * sin(t);
  } else x = (r - bevel) * (1 - (v - 0.65) / 0.35), y = h;
  return (P){x * cos(a), y, -x * sin(a)};
}

// A Miura-ori sheet, the fold that opens solar sails: u and v count cells. Bent around the scene like a stage set.
enum { MIURA_COLUMNS = 44, MIURA_ROWS = 22 };
static P miura(double u, double v)
{
  const int i = (int)lround(u * MIURA_COLUMNS), j = (int)lround(v * MIURA_ROWS);
  const double s = 0.19, l = 0.21, shift = 0.1, height = 0.12;
  const double along = (i - MIURA_COLUMNS / 2) * s, up = j * l + (i % 2) * shift, out = (j % 2) * height;
  const double radius = 4.2, a = along / radius;
  return (P){(radius - out) * sin(a), up, radius - (radius - out) * cos(a)};
}

static P stage(double u, double v) // a floor that curves up into a wall far behind
{
  const double x = 16 * (u - 0.5), at = 22 * v, flat = 14, r = 3;
  if (at < flat) return (P){x, 0, 8 - at};
  const double a = (at - flat) / r;
  if (a < TAU / 4) return (P){x, r - r * cos(a), 8 - flat - r * sin(a)};
  return (P){x, r + (at - flat - r * TAU / 4), 8 - flat - r};
}

// --- writing --------------------------------------------------------------------------------------
typedef struct {
  const char *name;
  Surface *surface;
  int columns, rows;
  bool is_flat;    // no normals: every face shows
  bool closes_u, closes_v;
} Shape;

static P normal_at(const Shape *s, double u, double v)
{
  const double e = 1e-5;
  const double u0 = s->closes_u ? u - e : fmax(u - e, 0), u1 = s->closes_u ? u + e : fmin(u + e, 1);
  const double v0 = s->closes_v ? v - e : fmax(v - e, 0), v1 = s->closes_v ? v + e : fmin(v + e, 1);
  P n = cross(sub(s->surface(u1, v), s->surface(u0, v)), sub(s->surface(u, v1), s->surface(u, v0)));
  if (n.x * n.x + n.y * n.y + n.z * n.z < 1e-24) { // a pole: look from a little way off
    const double w = v < 0.5 ? v + 1e-3 : v - 1e-3;
    n = cross(sub(s->surface(u1, w), s->surface(u0, w)), sub(s->surface(u, w + e), s->surface(u, w - e)));
  }
  return unit(n);
}

static void put(FILE *f, double x)
{
  const float value = (float)x;
  fwrite(&value, 4, 1, f);
}

static bool write_shape(const char *folder, const Shape *s)
{
  char path[1000];
  snprintf(path, sizeof path, "%s/%s.ply", folder, s->name);
  FILE *f = fopen(path, "wb");
  if (!f) return perror(path), false;
  const int w = s->columns + 1, h = s->rows + 1;
  fprintf(f, "ply\nformat binary_little_endian 1.0\ncomment made by tools/shapes.c\nelement vertex %d\n", w * h);
  fprintf(f, "property float x\nproperty float y\nproperty float z\n");
  if (!s->is_flat) fprintf(f, "property float nx\nproperty float ny\nproperty float nz\n");
  fprintf(f, "property float s\nproperty float t\n");
  fprintf(f, "element face %d\nproperty list uchar int vertex_indices\nend_header\n", 2 * s->columns * s->rows);
  for (int j = 0; j < h; j++)
    for (int i = 0; i < w; i++) {
      const double u = (double)i / s->columns, v = (double)j / s->rows;
      const P p = s->surface(u, v), n = normal_at(s, u, v);
      put(f, p.x), put(f, p.y), put(f, p.z);
      if (!s->is_flat) put(f, n.x), put(f, n.y), put(f, n.z);
      put(f, u), put(f, v);
    }
  for (int j = 0; j < s->rows; j++)
    for (int i = 0; i < s->columns; i++) {
      const int32_t a = j * w + i, quad[2][3] = {{a, a + 1, a + w + 1}, {a, a + w + 1, a + w}};
      for (int k = 0; k < 2; k++) {
        fputc(3, f);
        fwrite(quad[k], 4, 3, f);
      }
    }
  const bool ok = !ferror(f);
  return !fclose(f) && ok;
}

int main(int argc, char **argv)
{
  static const Shape shapes[] = {
      {"knot", knot, 480, 32, false, true, true},
      {"cushion", cushion, 128, 64, false, true, false},
      {"vase", vase, 288, 120, false, true, false},
      {"goblet", goblet, 96, 84, false, true, false},
      {"plinth", plinth, 96, 40, false, true, false},
      {"miura", miura, MIURA_COLUMNS, MIURA_ROWS, true, false, false},
      {"stage", stage, 4, 110, false, false, false},
  };
  if (argc != 2) return fprintf(stderr, "usage: %s FOLDER\n", argv[0]), 64;
  for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++)
    if (!write_shape(argv[1], &shapes[i])) return 73;
  return 0;
}
