// Balls that bend light, made ready: the tables of space/radial.h for a scene's wormholes and black holes, and the colours of
// the matter around the latter.

#include "scene/gates.h"
#include "world/prepare.h"

#include <math.h>

// --- colours of heat --------------------------------------------------------------------------------
// The eye's matching functions (Wyman, Sloan and Shirley 2013, "Simple analytic approximations to the CIE XYZ color
// matching functions", the multi-lobe fit), by wavelength in nanometres.
static double lobe(double l, double middle, double before, double after)
{
  const double x = (l - middle) / (l < middle ? before : after);
  return exp(-0.5 * x * x);
}

static void eye_sees(double l, double xyz[3])
{
  xyz[0] = 1.056 * lobe(l, 599.8, 37.9, 31.0) + 0.362 * lobe(l, 442.0, 16.0, 26.7) - 0.065 * lobe(l, 501.1, 20.4, 26.2);
  xyz[1] = 0.821 * lobe(l, 568.8, 46.9, 40.5) + 0.286 * lobe(l, 530.9, 16.3, 31.1);
  xyz[2] = 1.217 * lobe(l, 437.0, 11.8, 36.0) + 0.681 * lobe(l, 459.0, 26.0, 13.8);
}

// Planck's law over its value at the red end, where cold bodies shine most: for them all else is as good as dark.
static double planck(double l, double kelvin)
{
  const double c2 = 1.438776877e7, red = 780; // nm K
  return pow(red / l, 5) * expm1(c2 / (red * kelvin)) / expm1(fmin(c2 / (l * kelvin), 700));
}

// Linear sRGB (IEC 61966-2-1) of luminance 1; what lies outside of its colours is brought to their edge.
static void heat_color(double kelvin, float rgb[3])
{
  static const double from_xyz[3][3] = {{3.2406, -1.5372, -0.4986}, {-0.9689, 1.8758, 0.0415}, {0.0557, -0.2040, 1.0570}};
  static const double luminance[3] = {0.2126, 0.7152, 0.0722};
  double xyz[3] = {0}, c[3], y = 0;
  for (int i = 0; i <= 400; i += 5) {
    double eye[3];
    eye_sees(380 + i, eye);
    for (int k = 0; k < 3; k++) xyz[k] += planck(380 + i, kelvin) * eye[k];
  }
  for (int k = 0; k < 3; k++) {
    c[k] = fmax(from_xyz[k][0] * xyz[0] + from_xyz[k][1] * xyz[1] + from_xyz[k][2] * xyz[2], 0);
    y += luminance[k] * c[k];
  }
  for (int k = 0; k < 3; k++) rgb[k] = (float)(c[k] / y);
}

// Below 500 K expm1 would overflow, and nothing shines.
static void fill_colors(double hottest, BlackHole *out)
{
  for (int i = 0; i <= HEAT_NODES; i++) heat_color(fmax(hottest * HEAT_MOST * i / HEAT_NODES, 500), out->color[i]);
}

// --- balls ------------------------------------------------------------------------------------------
static Mat4_f affine(const Frame *f)
{
  Mat4_f m = {{{0, 0, 0, 0}, {0, 0, 0, 0}, {0, 0, 0, 0}, {0, 0, 0, 1}}};
  for (int k = 0; k < 3; k++) {
    m.m[k][0] = f->x[k];
    m.m[k][1] = f->y[k];
    m.m[k][2] = f->z[k];
    m.m[k][3] = f->p[k];
  }
  return m;
}

static bool make_hole(Prepare *p, const GateBlackHole *g, Ball *ball)
{
  BlackHole *hole = arena_alloc(&p->world->arena, 1, sizeof *hole);
  ball->orbits = arena_alloc(&p->world->arena, 1, sizeof *ball->orbits);
  if (!hole || !ball->orbits) return prepare_failed_memory(p);
  *hole = (BlackHole){.rs = g->horizon, .inner = g->disk_inner, .outer = g->disk_outer, .gain = g->disk_gain};
  for (int k = 0; k < 3; k++) hole->caught[k] = g->caught[k];
  fill_colors((double)g->disk_temperature, hole);
  ball->hole = hole;
  return radial_hole(g->radius, g->horizon, ball->orbits, &ball->radial);
}

static bool make_wormhole(const GateWormhole *g, Ball *ball)
{
  return g->lensing > 0 ? radial_dngr(g->radius, g->throat, g->length / 2, g->lensing, &ball->radial)
                        : radial_ellis(g->radius, g->throat, &ball->radial);
}

bool prepare_ball(Prepare *p, const Gate *g, const GateLink *link, SpaceGate *out)
{
  const bool is_hole = g->kind == GATE_BLACK_HOLE;
  out->size[0] = is_hole ? g->black_hole.radius : g->wormhole.radius;
  if (!link->exists) return true; // the far end of one that is one way
  GateCurve *curve = arena_alloc(&p->world->arena, 1, sizeof *curve);
  Ball *ball = arena_alloc(&p->world->arena, 1, sizeof *ball);
  if (!curve || !ball) return prepare_failed_memory(p);
  *ball = (Ball){.is_mirror = frame_determinant(&link->map) < 0};
  if (!(is_hole ? make_hole(p, &g->black_hole, ball) : make_wormhole(&g->wormhole, ball)))
    return err_set(p->err, ERR_BAD_SCENE, "gate \"%s\" has measures that bend no light", g->name);
  const Frame here = gate_frame(g), there = gate_frame(&p->scene->gates.items[link->gate]), back = frame_inverse(&here);
  *curve = (GateCurve){.map = affine(&back), .map_to = affine(&there), .back = affine(&here), .ball = ball};
  out->side[FRONT].curve = curve;
  out->side[FRONT].is_null = out->side[FRONT].is_shift = out->side[FRONT].is_into = false;
  return true;
}
