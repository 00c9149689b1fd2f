// Looking and walking through gates, piece by piece as render/ways.h goes. A body's place is kept a few roundings away
// from gates, on the side it came to, so that the next step sees on which side of them it is: no step is lost in a gate,
// and none is longer for it than a rounding.

#include "accel/place.h"
#include "api/api.h"

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
  Way way = way_begin(cell_of(world, cell));
  Ray ray = {from_public(r->origin), d / length, r->tmin * length, r->tmax * length};
  Hit found;
  for (;;) {
    SpaceExit end;
    w->engine->hot->piece(world, &ray, &way, &found, &end);
    if (end.gate == NO_GATE || way.crossings >= world->crossings) break;
    way_cross(&world->space, &way, end.gate, end.side, end.t, &ray);
  }
  const float back = 1 / (length * way.scale), there = length * way.scale;
  const bool is_hit = found.instance != NO_HIT;
  *hit = (rf_hit){is_hit ? found.t * back : r->tmax, found.u, found.v, found.prim, found.instance, w->objects[found.instance + 1u]};
  if (arrived)
    *arrived = (rf_arrival){{to_public(ray.o), ray.tmin * back, to_public(ray.d * there), ray.tmax * back}, (int)way.cell, way.scale};
  return is_hit;
}

// --- walking ------------------------------------------------------------------------------------------
// As far as a place may be off for rounding, sixteen times: coordinates of 1 are known to 1e-7, so 2e-6.
static float margin(Vec3 p) { return 0x1p-19f * max_f(v3_max_lane(v3_max(p, -p)), 1e-3f); }

static void carry(const GateSide *side, rf_body *b)
{
  rf_vec3 *axes[3] = {&b->frame.x, &b->frame.y, &b->frame.z};
  for (int k = 0; k < 3; k++) *axes[k] = to_public(v3_normalize(frame_vector(&side->map, from_public(*axes[k]))));
  b->velocity = to_public(frame_vector(&side->map, from_public(b->velocity)));
  b->scale *= side->scale;
}

// Keeps p off the flat gates of its cell, on the side of `from`, a place the body was at since it came into the cell; off the
// gate it came out of, on the side it came out at.
static Vec3 keep_off(const World *w, const Way *way, Vec3 from, Vec3 d, Vec3 p)
{
  const float least = margin(p);
  for (size_t i = 0; i < w->space.gate_count; i++) {
    const SpaceGate *g = &w->space.gates[i];
    if (g->cell != way->cell || gate_is_closed(g)) continue;
    const float off = v3_dot(g->n, p) - g->c, was = v3_dot(g->n, from) - g->c;
    if (!(fabsf(off) < least) || (!g->is_wall && !gate_has(g, p))) continue;
    const bool in_front = g->is_wall || (i == way->from ? v3_dot(g->n, d) > 0 : was > 0);
    p += ((in_front ? least : -least) - off) * g->n;
  }
  return p;
}

// Takes the body through the gates on its way; what is behind `end` is where it stops.
static SpaceExit walk_through(const rf_world *w, rf_body *b, Ray *ray, Way *way, Hit *hit, int *gates)
{
  const World *world = w->world;
  for (;;) {
    SpaceExit end;
    w->engine->hot->piece(world, ray, way, hit, &end);
    if (end.gate == NO_GATE || *gates == MOST_GATES_A_STEP) return end;
    carry(&world->space.gates[end.gate].side[end.side], b);
    way_cross(&world->space, way, end.gate, end.side, end.t, ray);
    if (++*gates % ORIGIN_AFTER == 0) move_origin(ray);
  }
}

rf_walk_end rf_walk(const rf_world *w, rf_body *b, rf_vec3 motion, bool stops)
{
  const World *world = w->world;
  const Vec3 m = from_public(motion);
  const float length = v3_length(m);
  rf_walk_end out = {.done = 1};
  if (!(length > 0) || !isfinite(length)) return out;
  Way way = way_begin(cell_of(world, b->cell));
  Ray ray = {from_public(b->frame.p), m / length, 0, length};
  Hit hit;
  float left = 0;
  for (;;) { // a surface that does not stop is passed
    walk_through(w, b, &ray, &way, &hit, &out.gates);
    if (hit.instance == NO_HIT || stops) break;
    ray.tmin = nextafterf(hit.t, INFINITY);
  }
  float end = ray.tmax;
  if (hit.instance != NO_HIT) {
    const SurfacePoint s = accel_surface(world->accel, &world->instances[hit.instance].mesh, &ray, &hit);
    const uint32_t material = world_material(world, &hit);
    out.is_blocked = true;
    out.surface = (rf_surface){.position = to_public(s.p), .error = s.error, .ng = to_public(s.ng), .n = to_public(s.n),
                               .u = s.uv[0].x, .v = s.uv[0].y, .is_back = s.is_back, .material = material + 1,
                               .material_name = world->material_names[material]};
    end = max_f(hit.t - margin(s.p), ray.tmin);
    left = ray.tmax - end;
    out.done = clamp_f(1 - left / (length * way.scale), 0, 1);
    out.left = to_public(ray.d * left);
  }
  const Vec3 from = ray.o + ray.tmin * ray.d, p = keep_off(world, &way, from, ray.d, ray.o + end * ray.d);
  b->frame.p = to_public(p);
  b->cell = (int)way.cell;
  return out;
}
