// Looking and walking through gates, piece by piece as render/ways.h goes. A body's place is kept a few roundings away
// from gates, on the side it came to, so that the next step sees on which side of them it is: no step is lost in a gate,
// and none is longer for it than a rounding.
//
// In curved cells rays are straight in the chart, but lengths are metres and vectors those of a place (space/chart.h), which
// are carried along the way.

#include "accel/place.h"
#include "api/api.h"
#include "render/local.h"

#include <string.h>

enum { MOST_GATES_A_STEP = 4096, ORIGIN_AFTER = 32 };

static rf_vec3 to_public(Vec3 v) { return (rf_vec3){v[0], v[1], v[2]}; }
static Vec3 from_public(rf_vec3 v) { return v3(v.x, v.y, v.z); }

static uint32_t cell_of(const World *w, int cell)
{
  return cell >= 0 && (size_t)cell < w->cell_count ? (uint32_t)cell : 0;
}

int rf_find_cell(const rf_scene *s, const char *name)
{
  if (!s) return -1;
  if (!name) return 0;
  for (size_t i = 0; i < s->scene->cells.count; i++)
    if (!strcmp(s->scene->cells.items[i].name, name)) return (int)i + 1;
  return -1;
}

const char *rf_cell_name(const rf_scene *s, int cell)
{
  return s && cell > 0 && (size_t)cell <= s->scene->cells.count ? s->scene->cells.items[cell - 1].name : NULL;
}

rf_vec3 rf_gravity(const rf_world *w, int cell)
{
  if (!w) return (rf_vec3){0, -9.81f, 0};
  return to_public(w->world->cells[cell_of(w->world, cell)].gravity);
}

float rf_curvature(const rf_world *w, int cell) { return w ? world_curvature(w->world, cell_of(w->world, cell)) : 0; }

// --- ways -----------------------------------------------------------------------------------------------
typedef struct Stride { // a way as far as it has come
  Ray ray;    // in the chart of the cell it is in
  Way way;
  float left; // of curved cells: metres still to go at the ray's origin
} Stride;

// The rest of the way in the cell that was come into.
static void aim(const World *w, Stride *s, float left)
{
  const float kappa = world_curvature(w, s->way.cell);
  s->left = left;
  s->ray.tmax = kappa == 0 || !(left < INFINITY) ? left : chart_along(kappa, s->ray.o, s->ray.d, left);
}

// d is a unit vector at the place.
static Stride stride_begin(const World *w, int cell, Vec3 place, Vec3 d, float length)
{
  Stride s = {.way = way_begin(cell_of(w, cell))};
  s.ray = (Ray){place, local_direction(world_curvature(w, s.way.cell), place, d), 0, length};
  aim(w, &s, length);
  return s;
}

static float stride_left(const World *w, const Stride *s, float t)
{
  const float kappa = world_curvature(w, s->way.cell);
  return kappa == 0 ? s->ray.tmax - t : s->left - local_length(kappa, &s->ray, t);
}

static const Ball *ball_of(const SpaceGate *g)
{
  const GateCurve *c = g->side[GATE_FRONT].curve;
  return c ? c->ball : NULL;
}

// False: it ended there.
static bool stride_cross(const World *w, Stride *s, const SpaceExit *end)
{
  const SpaceGate *g = &w->space.gates[end->gate];
  const bool is_curved = g->side[end->side].curve && !ball_of(g);
  const float left = stride_left(w, s, end->t);
  if (!way_cross(&w->space, &s->way, end->gate, end->side, end->t, &s->ray)) return false;
  if (is_curved) aim(w, s, left);
  return true;
}

// A far origin loses digits, which only long ways through small places would notice.
static void move_origin(Ray *ray)
{
  ray->o += ray->tmin * ray->d;
  ray->tmax -= ray->tmin;
  ray->tmin = 0;
}

// --- looking ------------------------------------------------------------------------------------------
bool rf_look(const rf_world *w, int cell, const rf_ray *r, rf_hit *hit, rf_arrival *arrived)
{
  const World *world = w->world;
  const Vec3 d = from_public(r->direction);
  const float length = v3_length(d);
  Stride s = stride_begin(world, cell, from_public(r->origin), d / length, r->tmax * length);
  const float kappa = world_curvature(world, s.way.cell);
  s.ray.tmin = kappa == 0 ? r->tmin * length : chart_along(kappa, s.ray.o, s.ray.d, r->tmin * length);
  Hit found;
  for (;;) {
    SpaceExit end;
    w->engine->hot->piece(world, &s.ray, &s.way, &found, &end);
    if (end.gate == NO_GATE || s.way.crossings >= world->crossings) break;
    if (!stride_cross(world, &s, &end)) break;
  }
  const float scale = s.way.scale, back = 1 / (length * scale), there = length * scale;
  const bool is_hit = found.instance != NO_HIT;
  *hit = (rf_hit){is_hit ? found.t * back : r->tmax, found.u, found.v, found.prim, found.instance, w->objects[found.instance + 1u]};
  if (arrived)
    *arrived = (rf_arrival){{to_public(s.ray.o), s.ray.tmin * back, to_public(s.ray.d * there), s.ray.tmax * back}, (int)s.way.cell,
                            scale, INFINITY, s.way.crossings};
  if (arrived && is_hit)
    arrived->length = (s.way.passed + local_length(world_curvature(world, s.way.cell), &s.ray, found.t)) / scale;
  return is_hit;
}

// --- walking ------------------------------------------------------------------------------------------
// As far as a place may be off for rounding, sixteen times: coordinates of 1 are known to 1e-7, so 2e-6.
static float margin(Vec3 p) { return 0x1p-19f * max_f(v3_max_lane(v3_max(p, -p)), 1e-3f); }

static rf_vec3 *axis_of(rf_body *b, int k)
{
  rf_vec3 *const axes[4] = {&b->frame.x, &b->frame.y, &b->frame.z, &b->velocity};
  return axes[k];
}

static void carry(const GateSide *side, rf_body *b)
{
  for (int k = 0; k < 3; k++) *axis_of(b, k) = to_public(v3_normalize(frame_vector(&side->map, from_public(*axis_of(b, k)))));
  b->velocity = to_public(frame_vector(&side->map, from_public(b->velocity)));
  b->scale *= side->scale;
}

// Along a straight piece of a curved cell.
static void carry_along(float kappa, Vec3 from, Vec3 to, rf_body *b)
{
  if (kappa == 0) return;
  Vec3 v[4];
  for (int k = 0; k < 4; k++) v[k] = chart_carry(kappa, from, to, from_public(*axis_of(b, k)));
  v[2] = v3_normalize(v[2]); // against what many steps add up to
  v[0] = v3_normalize(v[0] - v3_dot(v[0], v[2]) * v[2]);
  v[1] = v3_normalize(v[1] - v3_dot(v[1], v[2]) * v[2] - v3_dot(v[1], v[0]) * v[0]);
  for (int k = 0; k < 4; k++) *axis_of(b, k) = to_public(v[k]);
}

// Through a gate of curved space at p.
static void carry_through(const GateCurve *c, Vec3 p, rf_body *b)
{
  for (int k = 0; k < 4; k++) {
    const Vec3 v = from_public(*axis_of(b, k));
    const float length = v3_length(v);
    if (!(length > 0)) continue;
    Vec3 q = p, u = v / length;
    chart_map(c->kappa, &c->map, &q, &u);
    if (c->is_door) way_door(c, &q, &u);
    *axis_of(b, k) = to_public(length * v3_normalize(u));
  }
}

// Into a ball that bends light, by a ray at p: parallel along the way through it.
static void carry_through_ball(const GateCurve *c, Vec3 p, Vec3 d, rf_body *b)
{
  const Vec3 at = p;
  chart_map(0, &c->map, &p, &d);
  Vec3 p_to = p, d_to = d;
  const BallEnd end = ball_go(c->ball, &p_to, &d_to);
  for (int k = 0; k < 4; k++) {
    const Vec3 v = from_public(*axis_of(b, k));
    const float length = v3_length(v);
    if (!(length > 0)) continue;
    Vec3 from = at, u = v / length, to = p_to;
    chart_map(0, &c->map, &from, &u);
    u = ball_carry(c->ball, end, p, d, d_to, u);
    chart_map(0, end == BALL_PASSED ? &c->map_to : &c->back, &to, &u);
    *axis_of(b, k) = to_public(length * v3_normalize(u));
  }
}

// Nobody is within a ball that bends light who was not. An eye that was put there stays.
static Vec3 keep_off_ball(const SpaceGate *g, Vec3 from, Vec3 p)
{
  const Vec3 middle = frame_inverse(&g->own_from_cell).p;
  const float r = g->size[0] + 2 * margin(v3_abs(middle) + v3_all(g->size[0])), off = v3_length(p - middle);
  const bool was_within = v3_length(from - middle) < 0.999f * g->size[0];
  return off < r && !was_within ? middle + (r / off) * (p - middle) : p;
}

// Keeps p off the flat gates of its cell, on the side of `from`, a place the body was at since it came into the cell; off the
// gate it came out of, on the side it came out at.
static Vec3 keep_off(const World *w, const Way *way, Vec3 from, Vec3 d, Vec3 p)
{
  const float least = margin(p);
  for (size_t i = 0; i < w->space.gate_count; i++) {
    const SpaceGate *g = &w->space.gates[i];
    if (g->cell != way->cell) continue;
    if (ball_of(g)) p = keep_off_ball(g, from, p);
    if (gate_is_closed(g)) continue;
    const float off = v3_dot(g->n, p) - g->c, was = v3_dot(g->n, from) - g->c;
    if (!(fabsf(off) < least) || (!g->is_wall && !gate_has(g, p))) continue;
    const bool in_front = g->is_wall || (i == way->from ? v3_dot(g->n, d) > 0 : was > 0);
    p += ((in_front ? least : -least) - off) * g->n;
  }
  return p;
}

// Takes the body through the gates on its way; what is behind `end` is where it stops: a black hole's ball, too.
static SpaceExit walk_through(const rf_world *w, rf_body *b, Stride *s, Hit *hit, int *gates)
{
  const World *world = w->world;
  for (;;) {
    SpaceExit end;
    w->engine->hot->piece(world, &s->ray, &s->way, hit, &end);
    if (end.gate == NO_GATE || *gates == MOST_GATES_A_STEP) return end;
    const GateSide *side = &world->space.gates[end.gate].side[end.side];
    const Ball *ball = ball_of(&world->space.gates[end.gate]);
    const Vec3 p = s->ray.o + end.t * s->ray.d;
    if (ball && ball->hole) return end;
    if (ball) {
      carry_through_ball(side->curve, p, s->ray.d, b);
    } else if (side->curve) {
      carry_along(side->curve->kappa, s->ray.o, p, b);
      carry_through(side->curve, p, b);
    } else {
      carry(side, b);
    }
    (void)stride_cross(world, s, &end); // which ends in black holes only
    if (++*gates % ORIGIN_AFTER == 0 && !side->curve) move_origin(&s->ray);
  }
}

static rf_surface surface_of(const World *world, const Stride *s, const Hit *hit)
{
  const SurfacePoint p = accel_surface(world->accel, &world->instances[hit->instance].mesh, &s->ray, hit);
  const float kappa = world_curvature(world, s->way.cell);
  const SurfacePoint at = kappa == 0 ? p : local_surface(kappa, &p);
  const uint32_t material = world_material(world, hit);
  return (rf_surface){.position = to_public(at.p), .error = at.error, .ng = to_public(at.ng), .n = to_public(at.n),
                      .u = at.uv[0].x, .v = at.uv[0].y, .is_back = at.is_back, .material = material + 1,
                      .material_name = world->material_names[material]};
}

static bool is_hole(const World *w, uint32_t gate)
{
  const Ball *ball = gate == NO_GATE ? NULL : ball_of(&w->space.gates[gate]);
  return ball && ball->hole;
}

static rf_surface ball_surface(const SpaceGate *g, Vec3 p)
{
  const rf_vec3 n = to_public(v3_normalize(p - frame_inverse(&g->own_from_cell).p));
  return (rf_surface){.position = to_public(p), .error = margin(p), .ng = n, .n = n};
}

// Something is in the way at t, a motion of that length. Where the walk ends.
static float stop_at(const World *w, const Stride *s, float t, float length, rf_walk_end *out)
{
  const float end = max_f(t - margin(from_public(out->surface.position)), s->ray.tmin), left = stride_left(w, s, end);
  out->is_blocked = true;
  out->done = clamp_f(1 - left / (length * s->way.scale), 0, 1);
  out->left = to_public(local_vector(world_curvature(w, s->way.cell), s->ray.o + end * s->ray.d, s->ray.d) * left);
  return end;
}

rf_walk_end rf_walk(const rf_world *w, rf_body *b, rf_vec3 motion, bool stops)
{
  const World *world = w->world;
  const Vec3 m = from_public(motion);
  const float length = v3_length(m);
  rf_walk_end out = {.done = 1};
  if (!(length > 0) || !isfinite(length)) return out;
  Stride s = stride_begin(world, b->cell, from_public(b->frame.p), m / length, length);
  Hit hit;
  SpaceExit hole;
  for (;;) { // a surface that does not stop is passed
    hole = walk_through(w, b, &s, &hit, &out.gates);
    if (hit.instance == NO_HIT || stops) break;
    s.ray.tmin = nextafterf(hit.t, INFINITY);
  }
  const float kappa = world_curvature(world, s.way.cell);
  float end = s.ray.tmax;
  if (hit.instance != NO_HIT) {
    out.surface = surface_of(world, &s, &hit);
    end = stop_at(world, &s, hit.t, length, &out);
  } else if (is_hole(world, hole.gate)) {
    out.surface = ball_surface(&world->space.gates[hole.gate], s.ray.o + hole.t * s.ray.d);
    end = stop_at(world, &s, hole.t, length, &out);
  }
  const Vec3 from = s.ray.o + s.ray.tmin * s.ray.d, p = keep_off(world, &s.way, from, s.ray.d, s.ray.o + end * s.ray.d);
  carry_along(kappa, s.ray.o, p, b);
  b->frame.p = to_public(p);
  b->cell = (int)s.way.cell;
  return out;
}
