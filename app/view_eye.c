// See view_eye.h. On foot the body is a capsule as a few rays feel it: at the height of shins, hips and eyes, ahead and
// to both sides. They are the tracer's own rays, so walls are where they are seen, behind gates, too. Every step is walked by
// the library, which carries the body through gates; the level turns with it, and then follows what is up in the new cell.

#include "view_eye.h"

#include <math.h>
#include <string.h>

#define PI 3.14159265f
// Of the body, in heights of the eye: half its width, the step it climbs, and where it feels for walls.
#define RADIUS 0.18f
#define STEP   0.28f
static const float feelers[] = {STEP + 0.02f, 0.6f, 1.0f};
#define RIGHTING 8.0f // radians a second: half a turn in 0.4 s
#define LEG_SECONDS 1.6f // from one stored view to the next

float vec_dot(rf_vec3 a, rf_vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
float vec_length(rf_vec3 a) { return sqrtf(vec_dot(a, a)); }
rf_vec3 vec_add(rf_vec3 a, rf_vec3 b, float s) { return (rf_vec3){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z}; }

// From the level into the world.
static rf_vec3 out_of(const Pose *p, rf_vec3 v)
{
  const rf_vec3 zero = {0, 0, 0};
  return vec_add(vec_add(vec_add(zero, p->level.x, v.x), p->level.y, v.y), p->level.z, v.z);
}

static rf_vec3 forward_of(const Pose *p)
{
  return out_of(p, (rf_vec3){-sinf(p->yaw) * cosf(p->pitch), sinf(p->pitch), -cosf(p->yaw) * cosf(p->pitch)});
}

static rf_vec3 right_of(const Pose *p) { return out_of(p, (rf_vec3){cosf(p->yaw), 0, -sinf(p->yaw)}); }

static rf_vec3 above_of(const Pose *p)
{
  const float s = sinf(p->pitch);
  return out_of(p, (rf_vec3){sinf(p->yaw) * s, cosf(p->pitch), cosf(p->yaw) * s});
}

static rf_vec3 cross(rf_vec3 a, rf_vec3 b)
{
  return (rf_vec3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static float held(float x, float low, float high) { return x < low ? low : x > high ? high : x; }

Pose pose_of(const rf_eye *e)
{
  const rf_vec3 z = e->frame.z;
  return (Pose){e->frame.p, atan2f(z.x, z.z), asinf(held(-z.y, -1, 1)), e->fov, e->cell,
                {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}};
}

void walker_set(Walker *w, const rf_eye *eye)
{
  w->lens = *eye;
  w->pose = pose_of(eye);
  w->focus = eye->focus > 0 ? eye->focus : 1;
  w->is_level = false;
  w->stop_count = 0;
  w->on_foot = false;
  if (!(w->speed > 0)) w->speed = 1;
}

rf_eye walker_eye(const Walker *w)
{
  rf_eye e = w->lens;
  e.frame.p = w->pose.place;
  e.fov = w->pose.fov;
  e.cell = w->pose.cell;
  if (!w->is_level) return e;
  const rf_vec3 f = forward_of(&w->pose);
  e.frame.x = right_of(&w->pose);
  e.frame.y = above_of(&w->pose);
  e.frame.z = (rf_vec3){-f.x, -f.y, -f.z};
  return e;
}

void walker_turn(Walker *w, float yaw, float pitch)
{
  w->pose.yaw += yaw;
  w->pose.pitch = held(w->pose.pitch + pitch, -PI / 2 + 1e-3f, PI / 2 - 1e-3f);
  w->is_level = true;
  w->stop_count = 0;
}

void walker_orbit(Walker *w, rf_vec3 centre, float yaw, float pitch)
{
  // The centre keeps its place in the picture: its offset turns with the eye.
  const rf_vec3 to = vec_add(centre, w->pose.place, -1), f = forward_of(&w->pose), r = right_of(&w->pose);
  const rf_vec3 up = above_of(&w->pose);
  const float a = vec_dot(to, r), b = vec_dot(to, up), c = vec_dot(to, f);
  walker_turn(w, yaw, pitch);
  const rf_vec3 f2 = forward_of(&w->pose), r2 = right_of(&w->pose);
  const rf_vec3 up2 = above_of(&w->pose);
  w->pose.place = vec_add(vec_add(vec_add(centre, r2, -a), up2, -b), f2, -c);
  w->on_foot = false;
}

void walker_dolly(Walker *w, float notches)
{
  const float step = w->focus * (1 - powf(0.85f, notches));
  w->pose.place = vec_add(w->pose.place, w->is_level ? forward_of(&w->pose) : w->lens.frame.z, w->is_level ? step : -step);
  w->focus = held(w->focus - step, 1e-3f * w->size, 1e6f * w->size);
  w->stop_count = 0;
}

// --- through gates ----------------------------------------------------------------------------------
static rf_vec3 turned(rf_vec3 v, const rf_frame *from, const rf_frame *to)
{
  const rf_vec3 zero = {0, 0, 0};
  return vec_add(vec_add(vec_add(zero, to->x, vec_dot(v, from->x)), to->y, vec_dot(v, from->y)), to->z, vec_dot(v, from->z));
}

// The arrow takes the same step, from the same place, but is turned by nothing else.
static void carry_arrow(Walker *w, const rf_world *world, rf_vec3 step)
{
  if (!w->carries) return;
  w->carries = world && w->arrow.cell == w->pose.cell && !memcmp(&w->arrow.frame.p, &w->pose.place, sizeof w->pose.place);
  if (!w->carries) return;
  w->carried += (double)(vec_length(step) / w->arrow.scale);
  (void)rf_walk(world, &w->arrow, step, false);
}

void walker_carry(Walker *w, bool on)
{
  const rf_eye e = walker_eye(w);
  w->carries = on;
  w->carried = 0;
  w->arrow = w->arrow_home = (rf_body){.frame = e.frame, .scale = 1, .cell = e.cell};
}

// One straight step, whatever is in the way.
static void step_by(Walker *w, const rf_world *world, rf_vec3 step)
{
  carry_arrow(w, world, step);
  if (!world) {
    w->pose.place = vec_add(w->pose.place, step, 1);
    return;
  }
  const rf_frame before = w->pose.level;
  rf_body b = {.frame = before, .scale = 1, .cell = w->pose.cell};
  b.frame.p = w->pose.place;
  const int gates = rf_walk(world, &b, step, false).gates;
  const rf_frame here = {before.x, before.y, before.z, b.frame.p};
  if (!gates && !memcmp(&here, &b.frame, sizeof here)) { // flat: turned by nothing
    w->pose.place = b.frame.p;
    return;
  }
  rf_frame *lens = &w->lens.frame;
  w->pose.place = b.frame.p;
  w->pose.level = b.frame;
  w->pose.cell = b.cell;
  lens->x = turned(lens->x, &before, &b.frame);
  lens->y = turned(lens->y, &before, &b.frame);
  lens->z = turned(lens->z, &before, &b.frame);
  w->size *= b.scale;
  w->height *= b.scale;
  w->fall *= b.scale;
  w->focus *= b.scale;
}

static rf_vec3 about(rf_vec3 v, rf_vec3 axis, float c, float s)
{
  return vec_add(vec_add((rf_vec3){v.x * c, v.y * c, v.z * c}, cross(axis, v), s), axis, vec_dot(axis, v) * (1 - c));
}

// Turns the level to what is up in the cell. True if it was not yet.
static bool right_itself(Walker *w, const rf_world *world, float seconds)
{
  const rf_vec3 g = rf_gravity(world, w->pose.cell);
  const float pull = vec_length(g);
  rf_frame *l = &w->pose.level;
  if (!(pull > 0)) return false;
  const rf_vec3 up = {-g.x / pull, -g.y / pull, -g.z / pull};
  rf_vec3 axis = cross(l->y, up);
  const float sine = vec_length(axis), angle = atan2f(sine, vec_dot(l->y, up)), turn = fminf(angle, RIGHTING * seconds);
  if (angle < 1e-6f) return false;
  if (sine < 1e-4f) axis = angle > 1 ? l->z : axis; // upside down: over the shoulder
  const float length = vec_length(axis), c = cosf(turn), s = sinf(turn);
  axis = (rf_vec3){axis.x / length, axis.y / length, axis.z / length};
  l->x = about(l->x, axis, c, s);
  l->y = about(l->y, axis, c, s);
  l->z = about(l->z, axis, c, s);
  w->is_level = true;
  return true;
}

// --- on foot --------------------------------------------------------------------------------------
// What lies ahead, and how far; its normal as it is seen from here.
static bool feel(const rf_world *world, const Pose *p, rf_vec3 from, rf_vec3 direction, float reach, float *t, rf_vec3 *normal)
{
  rf_body b = {.frame = p->level, .scale = 1, .cell = p->cell};
  b.frame.p = from;
  const rf_walk_end end = rf_walk(world, &b, vec_add((rf_vec3){0, 0, 0}, direction, reach), true);
  if (!end.is_blocked) return false;
  const rf_vec3 n = end.surface.ng;
  *t = end.done * reach;
  *normal = turned(end.surface.is_back ? (rf_vec3){-n.x, -n.y, -n.z} : n, &b.frame, &p->level);
  return true;
}

static rf_vec3 down_of(const Pose *p) { return out_of(p, (rf_vec3){0, -1, 0}); }

void walker_foot(Walker *w, const rf_world *world, bool on)
{
  float t;
  rf_vec3 n;
  w->on_foot = on;
  w->fall = 0;
  w->stands = false;
  if (!on) return;
  // As tall as the eye is above what it stands over, if that is a person's height in a scene of this size.
  const float tall = held(0.25f * w->size, 1e-3f, 1.65f);
  w->height = world && feel(world, &w->pose, w->pose.place, down_of(&w->pose), 1.3f * tall, &t, &n) && t > 0.4f * tall ? t : tall;
}

// Shortens and bends a step of the feet so that no wall comes nearer than the body's width.
static rf_vec3 collide(const Walker *w, const rf_world *world, rf_vec3 step)
{
  const float radius = RADIUS * w->height;
  const rf_vec3 up = w->pose.level.y;
  for (int round = 0; round < 3; round++) {
    const float length = vec_length(step);
    if (!(length > 1e-7f)) break;
    const rf_vec3 ahead = vec_add((rf_vec3){0, 0, 0}, step, 1 / length), side = cross(up, ahead);
    float nearest = length + radius;
    rf_vec3 wall = {0, 0, 0};
    bool is_blocked = false;
    for (int k = 0; k < 9; k++) {
      float t;
      rf_vec3 n;
      const rf_vec3 from = vec_add(w->pose.place, up, (feelers[k / 3] - 1) * w->height);
      const rf_vec3 way = k % 3 == 0 ? ahead : vec_add(vec_add((rf_vec3){0, 0, 0}, ahead, 0.7071f), side, k % 3 == 1 ? 0.7071f : -0.7071f);
      if (!feel(world, &w->pose, from, way, length + radius, &t, &n)) continue;
      n = vec_add(n, up, -vec_dot(n, up)); // feet stay on the floor
      const float l = vec_length(n);
      if (l < 0.3f || vec_dot(n, ahead) >= 0 || t >= nearest) continue; // a slope, or behind
      nearest = t;
      wall = vec_add((rf_vec3){0, 0, 0}, n, 1 / l);
      is_blocked = true;
    }
    if (!is_blocked) break;
    if (round == 2) return (rf_vec3){0, 0, 0}; // a corner
    step = vec_add(step, wall, -vec_dot(step, wall)); // along the wall
  }
  return step;
}

static bool walk(Walker *w, const Wish *wish, float seconds, const rf_world *world)
{
  const Pose before = w->pose;
  const float scale = w->height / 1.65f, pace = (wish->fast ? 3.5f : 1.6f) * scale * w->speed;
  const rf_vec3 f = out_of(&w->pose, (rf_vec3){-sinf(w->pose.yaw), 0, -cosf(w->pose.yaw)});
  rf_vec3 step = vec_add(vec_add((rf_vec3){0, 0, 0}, f, wish->forward), right_of(&w->pose), wish->right);
  const float l = vec_length(step);
  step = vec_add((rf_vec3){0, 0, 0}, step, pace * seconds / (l > 1 ? l : 1));
  step_by(w, world, collide(w, world, step));
  // Down to the ground, which may be a step up or, in the air, farther than this fall.
  const float size = w->height / 1.65f; // as it is behind a gate
  if (wish->jump && w->stands) w->fall = -3.2f * sqrtf(size) * size;
  w->fall += vec_length(rf_gravity(world, w->pose.cell)) * size * seconds;
  const float reach = w->height + (w->fall > 0 ? w->fall * seconds : 0) + (w->stands && w->fall > 0 ? STEP * w->height : 0);
  float t;
  rf_vec3 n;
  w->stands = w->fall > 0 && feel(world, &w->pose, w->pose.place, down_of(&w->pose), reach, &t, &n);
  if (w->stands) {
    const float rise = w->height - t, most = 4 * w->height * seconds; // steps are climbed, not jumped
    w->fall = 0;
    step_by(w, world, vec_add((rf_vec3){0, 0, 0}, down_of(&w->pose), -(rise > most ? most : rise)));
  } else {
    step_by(w, world, vec_add((rf_vec3){0, 0, 0}, down_of(&w->pose), w->fall * seconds));
    if (w->fall > 60 * size) w->fall = 60 * size; // out of the world: as a skydiver
  }
  return memcmp(&before, &w->pose, sizeof before) != 0;
}

// --- flights --------------------------------------------------------------------------------------
static float nearest_turn(float from, float to) { return to - 2 * PI * roundf((to - from) / (2 * PI)); }

void walker_fly(Walker *w, const Pose *stops, int count)
{
  if (count < 1) return;
  if (count > MOST_STOPS - 1) count = MOST_STOPS - 1;
  w->stops[0] = w->pose;
  memcpy(w->stops + 1, stops, (size_t)count * sizeof *stops);
  for (int i = 1; i <= count; i++) w->stops[i].yaw = nearest_turn(w->stops[i - 1].yaw, w->stops[i].yaw);
  w->stop_count = count + 1;
  w->flown = 0;
  w->is_level = true;
  w->on_foot = false;
}

static float spline(float a, float b, float c, float d, float t)
{
  return b + 0.5f * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)));
}

static Pose between(const Walker *w, float at)
{
  const int last = w->stop_count - 1, i = at < (float)last ? (int)at : last - 1;
  const Pose *b = &w->stops[i], *c = &w->stops[i + 1], *a = i > 0 ? b - 1 : b, *d = i + 1 < last ? c + 1 : c;
  const float t = at - (float)i;
  if (b->cell != c->cell) return t < 0.5f ? *b : *c; // no way but a cut leads from one cell to another
  return (Pose){{spline(a->place.x, b->place.x, c->place.x, d->place.x, t),
                 spline(a->place.y, b->place.y, c->place.y, d->place.y, t),
                 spline(a->place.z, b->place.z, c->place.z, d->place.z, t)},
                spline(a->yaw, b->yaw, c->yaw, d->yaw, t),
                spline(a->pitch, b->pitch, c->pitch, d->pitch, t),
                spline(a->fov, b->fov, c->fov, d->fov, t),
                b->cell,
                b->level};
}

static bool fly_on(Walker *w, float seconds)
{
  const float all = (float)(w->stop_count - 1);
  w->flown += seconds / LEG_SECONDS;
  const float done = held(w->flown / all, 0, 1), eased = done * done * (3 - 2 * done);
  w->pose = done < 1 ? between(w, eased * all) : w->stops[w->stop_count - 1];
  if (done >= 1) w->stop_count = 0;
  return true;
}

// --------------------------------------------------------------------------------------------------
bool walker_move(Walker *w, const Wish *wish, double seconds, const rf_world *world)
{
  const float s = (float)(seconds < 0.1 ? seconds : 0.1); // after a stall, no leap
  const bool is_wished = wish->right != 0 || wish->up != 0 || wish->forward != 0;
  bool moved = wish->turn != 0 || wish->tilt != 0;
  if (moved) walker_turn(w, -2 * s * wish->turn, -1.5f * s * wish->tilt);
  if (is_wished) w->stop_count = 0;
  if (w->stop_count) return fly_on(w, s);
  if (world) moved |= right_itself(w, world, s);
  if (w->on_foot && world) return walk(w, wish, s, world) || moved;
  if (!is_wished) return moved;
  const rf_eye e = walker_eye(w);
  const float pace = 0.25f * w->size * w->speed * (wish->fast ? 4 : wish->slow ? 0.25f : 1) * s;
  const rf_vec3 aside = vec_add((rf_vec3){0, 0, 0}, e.frame.x, pace * wish->right);
  step_by(w, world, vec_add(vec_add(aside, w->pose.level.y, pace * wish->up), e.frame.z, -pace * wish->forward));
  return true;
}
