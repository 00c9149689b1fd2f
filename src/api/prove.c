// Proofs: ways round, and volumes, measured by the same steps that pictures are made with. What is expected comes from the
// geometry of one cell's curvature alone (the ideal below, in double, which knows no gates); what is found comes from
// rf_walk() and the walls of space.
//
// The ideal space is kept as the walker sees it: he stands at its middle, looking along his frame, and each leg moves all of
// it back. So the frame that is carried along is always the ideal's own.

#include "api/api.h"
#include "base/hash.h"
#include "render/local.h"
#include "space/isometry.h"

#define HOME 1e-3 // of the length: a hundred times what a walk in floats is off by (tests/test_prove.c)

static Vec3 from_public(rf_vec3 v) { return v3(v.x, v.y, v.z); }
static double length_of(rf_vec3 v) { return sqrt((double)v.x * v.x + (double)v.y * v.y + (double)v.z * v.z); }
static bool is_finite(rf_vec3 v) { return v3_is_finite(from_public(v)); }

static uint32_t cell_of(const World *w, int cell) { return cell >= 0 && (size_t)cell < w->cell_count ? (uint32_t)cell : 0; }

rf_vec3 rf_toward(const rf_world *w, int cell, rf_vec3 from, rf_vec3 to)
{
  const float kappa = world_curvature(w->world, cell_of(w->world, cell));
  const Vec3 p = from_public(from), way = from_public(to) - p;
  const float s = v3_length(way);
  if (!(s > 0)) return (rf_vec3){0, 0, 0};
  const Vec3 v = local_vector(kappa, p, way / s) * chart_length(kappa, chart_span(kappa, p, way / s, s));
  return (rf_vec3){v[0], v[1], v[2]};
}

// --- the ideal ----------------------------------------------------------------------------------------
typedef struct Ideal {
  int sign;    // of the curvature
  double unit; // radius of curvature, metres; 1 in flat space
} Ideal;

static Ideal ideal_of(float kappa)
{
  return (Ideal){kappa > 0 ? 1 : kappa < 0 ? -1 : 0, kappa == 0 ? 1 : 1 / sqrt(fabs((double)kappa))};
}

static Mat4_d move_by(const Ideal *m, rf_vec3 leg, double sign)
{
  const double length = length_of(leg), n[3] = {(double)leg.x / length, (double)leg.y / length, (double)leg.z / length};
  return length > 0 ? isometry_move(m->sign, n, sign * length / m->unit) : isometry_identity();
}

static const Vec4_d here = {{0, 0, 0, 1}};

static Vec4_d place_after(const Ideal *m, rf_vec3 leg)
{
  const Mat4_d move = move_by(m, leg, 1);
  return mat4_apply_d(&move, &here);
}

// The straight way to a place.
static rf_vec3 way_to(const Ideal *m, const Vec4_d *p)
{
  const double *v = p->v, s = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  if (!(s > 0)) return (rf_vec3){0, 0, 0};
  const double length = m->sign == 0 ? s : m->sign > 0 ? atan2(s, v[3]) : asinh(s), k = length * m->unit / s;
  return (rf_vec3){(float)(k * v[0]), (float)(k * v[1]), (float)(k * v[2])};
}

static void go(const Ideal *m, rf_vec3 leg, Vec4_d *place)
{
  const Mat4_d back = move_by(m, leg, -1);
  *place = mat4_apply_d(&back, place);
}

// --- one way round --------------------------------------------------------------------------------------
typedef struct Round {
  const rf_world *world;
  Ideal ideal;
  rf_body start, body;
  rf_vec3 normal;  // of its plane, by the frame; zero: it has none
  bool is_planar;
  Vec4_d home;     // where the start is, as it is seen now
  rf_vec3 first, last; // legs
  double turned;   // sum of the outer angles so far
  double area;     // of the ideal's own unit
  rf_round out;
} Round;

static double dot(rf_vec3 a, rf_vec3 b) { return (double)a.x * b.x + (double)a.y * b.y + (double)a.z * b.z; }

static rf_vec3 cross(rf_vec3 a, rf_vec3 b)
{
  return (rf_vec3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static double outer_angle(const Round *r, rf_vec3 a, rf_vec3 b) { return atan2(dot(r->normal, cross(a, b)), dot(a, b)); }

// Of the triangle from the start to both ends of a leg, positive when it is gone round about the normal (van Oosterom and
// Strackee 1983; in hyperbolic space the same with cosh for cos).
static double triangle_area(const Round *r, const Vec4_d *next)
{
  const int sign = r->ideal.sign;
  const double *h = r->home.v, *n = next->v;
  const double across[3] = {n[1] * h[2] - n[2] * h[1], n[2] * h[0] - n[0] * h[2], n[0] * h[1] - n[1] * h[0]};
  const double triple = (double)r->normal.x * across[0] + (double)r->normal.y * across[1] + (double)r->normal.z * across[2];
  if (sign == 0) return 0.5 * triple;
  const double below = 1 + h[3] + n[3] + sign * dot4_d(sign, &r->home, next);
  return 2 * atan2(triple, below);
}

static rf_vec3 out_of(const rf_frame *f, rf_vec3 v)
{
  const Vec3 out = from_public(f->x) * v.x + from_public(f->y) * v.y + from_public(f->z) * v.z;
  return (rf_vec3){out[0], out[1], out[2]};
}

static rf_vec3 into(const rf_frame *f, rf_vec3 v)
{
  return (rf_vec3){(float)dot(f->x, v), (float)dot(f->y, v), (float)dot(f->z, v)};
}

static void walk_leg(Round *r, rf_vec3 leg)
{
  if (!(length_of(leg) > 0)) return;
  const float scale = r->body.scale / r->start.scale;
  const Vec4_d next = place_after(&r->ideal, leg);
  r->area += triangle_area(r, &next);
  if (r->out.sides) r->turned += outer_angle(r, r->last, leg);
  if (!r->out.sides) r->first = leg;
  r->last = leg;
  r->out.length += length_of(leg);
  r->out.sides++;
  const rf_vec3 motion = out_of(&r->body.frame, (rf_vec3){leg.x * scale, leg.y * scale, leg.z * scale});
  r->out.gates += rf_walk(r->world, &r->body, motion, false).gates;
  go(&r->ideal, leg, &r->home);
}

// The frame that came home, by the one that began: a turn, or a turn and a mirror across its axis.
static void measure_turn(Round *r)
{
  const rf_vec3 x = into(&r->start.frame, r->body.frame.x), y = into(&r->start.frame, r->body.frame.y),
                z = into(&r->start.frame, r->body.frame.z);
  const double det = dot(cross(x, y), z);
  const double a[3] = {0.5 * ((double)y.z - z.y), 0.5 * ((double)z.x - x.z), 0.5 * ((double)x.y - y.x)};
  const double sine = sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]), sign = det < 0 ? -1 : 1;
  r->out.is_mirrored = det < 0;
  r->out.turn = atan2(sine, 0.5 * ((double)x.x + y.y + z.z - sign));
  if (sine > 1e-4) {
    r->out.axis = (rf_vec3){(float)(a[0] / sine), (float)(a[1] / sine), (float)(a[2] / sine)};
  } else if (r->out.turn > 1) { // half a turn: its axis is what R + 1 leaves of any vector
    const float k = (float)sign;
    const rf_vec3 columns[3] = {{k * x.x + 1, k * x.y, k * x.z}, {k * y.x, k * y.y + 1, k * y.z}, {k * z.x, k * z.y, k * z.z + 1}};
    const rf_vec3 *longest = &columns[0];
    for (int i = 1; i < 3; i++)
      if (length_of(columns[i]) > length_of(*longest)) longest = &columns[i];
    const float n = (float)length_of(*longest);
    r->out.axis = (rf_vec3){longest->x / n, longest->y / n, longest->z / n};
  }
}

static void arrive(Round *r, bool returns)
{
  rf_round *o = &r->out;
  o->scale = (double)(r->body.scale / r->start.scale);
  o->miss = o->turn = o->angles = o->area = NAN;
  if (r->body.cell == r->start.cell) o->miss = length_of(rf_toward(r->world, r->body.cell, r->start.frame.p, r->body.frame.p));
  o->is_home = o->miss <= HOME * o->length;
  if (!o->is_home) return;
  measure_turn(r);
  if (!returns || !r->is_planar || o->sides < 3) return;
  const rf_vec3 on = into(&r->body.frame, out_of(&r->start.frame, r->first));
  r->turned += outer_angle(r, r->last, on);
  const double way = r->area < 0 ? -1 : 1;
  o->angles = o->sides * M_PI - way * r->turned;
  o->area = way * r->area * r->ideal.unit * r->ideal.unit;
}

// Adds a leg to what the plane is known by; legs are all seen by the frame that is carried along, which keeps a plane's normal.
static void find_plane(Round *r, rf_vec3 first, rf_vec3 leg)
{
  const rf_vec3 n = cross(first, leg);
  const double length = length_of(n), both = length_of(first) * length_of(leg);
  if (length_of(r->normal) > 0) {
    r->is_planar &= fabs(dot(r->normal, leg)) <= 1e-4 * length_of(leg);
  } else if (length > 1e-5 * both) {
    r->normal = (rf_vec3){(float)((double)n.x / length), (float)((double)n.y / length), (float)((double)n.z / length)};
    r->is_planar = true;
  }
}

static bool walk_round(const rf_world *w, const rf_body *body, const rf_vec3 *legs, size_t count, bool returns, rf_round *out)
{
  Round r = {.world = w, .ideal = ideal_of(rf_curvature(w, body->cell)), .start = *body, .body = *body, .home = here};
  Vec4_d home = here;
  for (size_t i = 0; i < count; i++) {
    find_plane(&r, legs[0], legs[i]);
    go(&r.ideal, legs[i], &home);
  }
  const rf_vec3 closing = way_to(&r.ideal, &home);
  if (returns) find_plane(&r, legs[0], closing);
  for (size_t i = 0; i < count; i++) walk_leg(&r, legs[i]);
  if (returns && length_of(closing) > 1e-5 * r.out.length) walk_leg(&r, closing);
  arrive(&r, returns);
  *out = r.out;
  return true;
}

bool rf_walk_round(const rf_world *w, const rf_body *body, const rf_vec3 *legs, size_t count, bool returns, rf_round *out)
{
  if (!w || !body || !legs || !out || !count) return api_bad_argument("rf_walk_round", "world, body and legs must be given");
  bool moves = false;
  for (size_t i = 0; i < count; i++) {
    if (!is_finite(legs[i])) return api_bad_argument("rf_walk_round", "leg %zu is not finite", i);
    moves |= length_of(legs[i]) > 0;
  }
  return moves ? walk_round(w, body, legs, count, returns, out) : api_bad_argument("rf_walk_round", "no leg has a length");
}

bool rf_walk_corners(const rf_world *w, const rf_body *body, const rf_vec3 *corners, size_t count, rf_round *out)
{
  enum { MOST_CORNERS = 64 };
  rf_vec3 legs[MOST_CORNERS];
  if (!w || !body || !corners || !out) return api_bad_argument("rf_walk_corners", "world, body and corners must be given");
  if (count < 3 || count > MOST_CORNERS)
    return api_bad_argument("rf_walk_corners", "%zu corners; there are 3 to %d", count, MOST_CORNERS);
  for (size_t i = 0; i < count; i++)
    if (!is_finite(corners[i])) return api_bad_argument("rf_walk_corners", "corner %zu is not finite", i);
  const Ideal m = ideal_of(rf_curvature(w, body->cell));
  rf_body b = *body;
  if (length_of(corners[0]) > 0) (void)rf_walk(w, &b, out_of(&b.frame, corners[0]), false);
  // Each corner as it is seen from the one before, by the frame that was carried there.
  for (size_t i = 0; i + 1 < count; i++) {
    Vec4_d next = place_after(&m, corners[i + 1]);
    go(&m, corners[0], &next);
    for (size_t k = 0; k < i; k++) go(&m, legs[k], &next);
    legs[i] = way_to(&m, &next);
    if (!(length_of(legs[i]) > 0)) return api_bad_argument("rf_walk_corners", "corners %zu and %zu are one place", i, i + 1);
  }
  return walk_round(w, &b, legs, count - 1, true, out);
}

// --- volume -----------------------------------------------------------------------------------------------
// Of a cone of one steradian, to a length: the integral of S(t)^2. Short ones by the first terms, where the others cancel.
static double cone(const Ideal *m, double length)
{
  const double x = length / m->unit, cube = m->unit * m->unit * m->unit;
  if (m->sign == 0 || x < 0.01) return cube * x * x * x / 3 * (1 - m->sign * x * x / 5);
  return cube * (m->sign > 0 ? x / 2 - sin(2 * x) / 4 : sinh(2 * x) / 4 - x / 2);
}

static bool is_within_walls(const World *w, uint32_t cell, Vec3 p)
{
  for (uint32_t i = w->space.first_wall[cell]; i < w->space.first_wall[cell + 1]; i++) {
    const SpaceGate *g = &w->space.gates[w->space.walls[i]];
    if (v3_dot(g->n, p) < g->c) return false;
  }
  return true;
}

static bool fail(const char *why)
{
  Err err = {0};
  err_set(&err, ERR_BAD_SCENE, "%s", why);
  return api_fail(&err);
}

bool rf_cell_volume(const rf_world *w, int cell, rf_vec3 place, uint32_t rays, uint32_t seed, double *volume, double *error)
{
  if (!w || !volume || !error || rays < 2)
    return api_bad_argument("rf_cell_volume", "world and results must be given, and two rays or more");
  const World *world = w->world;
  const uint32_t c = cell_of(world, cell);
  const float kappa = world_curvature(world, c);
  const Ideal m = ideal_of(kappa);
  const Vec3 p = from_public(place);
  if (!world->space.gate_count) return fail("the cell has no walls of space");
  if (!chart_holds(kappa, p) || !is_within_walls(world, c, p))
    return fail("the place is outside of the cell");
  double sum = 0, squares = 0;
  for (uint32_t i = 0; i < rays; i++) {
    const uint32_t h = hash_combine(hash_combine(0x70c1, seed), i);
    const double z = 2 * (double)unit_float(hash_combine(h, 0)) - 1, turn = 2 * M_PI * (double)unit_float(hash_combine(h, 1));
    const double s = sqrt(fmax(1 - z * z, 0));
    const Vec3 v = v3((float)(s * cos(turn)), (float)(s * sin(turn)), (float)z);
    const Way way = way_begin(c);
    const Ray ray = {p, local_direction(kappa, p, v), 0, INFINITY};
    const SpaceExit end = space_exit(&world->space, &way, &ray);
    if (end.gate == NO_GATE) return fail("the cell goes on for ever on some side: it has no wall of space there");
    const double one = 4 * M_PI * cone(&m, (double)local_length(kappa, &ray, end.t));
    sum += one;
    squares += one * one;
  }
  *volume = sum / rays;
  *error = sqrt(fmax(squares / rays - *volume * *volume, 0) / (rays - 1));
  return true;
}
