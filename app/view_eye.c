// See view_eye.h. On foot the body is a capsule as a few rays feel it: at the height of shins, hips and eyes, ahead and
// to both sides. They are the tracer's own rays, so walls are where they are seen.

#include "view_eye.h"

#include <math.h>
#include <string.h>

#define PI 3.14159265f
// Of the body, in heights of the eye: half its width, the step it climbs, and where it feels for walls.
#define RADIUS 0.18f
#define STEP   0.28f
static const float feelers[] = {STEP + 0.02f, 0.6f, 1.0f};
#define GRAVITY 9.81f
#define LEG_SECONDS 1.6f // from one stored view to the next

float vec_dot(rf_vec3 a, rf_vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
float vec_length(rf_vec3 a) { return sqrtf(vec_dot(a, a)); }
rf_vec3 vec_add(rf_vec3 a, rf_vec3 b, float s) { return (rf_vec3){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z}; }

static rf_vec3 forward_of(const Pose *p)
{
  return (rf_vec3){-sinf(p->yaw) * cosf(p->pitch), sinf(p->pitch), -cosf(p->yaw) * cosf(p->pitch)};
}

static rf_vec3 right_of(const Pose *p) { return (rf_vec3){cosf(p->yaw), 0, -sinf(p->yaw)}; }

static float held(float x, float low, float high) { return x < low ? low : x > high ? high : x; }

Pose pose_of(const rf_eye *e)
{
  const rf_vec3 z = e->frame.z;
  return (Pose){e->frame.p, atan2f(z.x, z.z), asinf(held(-z.y, -1, 1)), e->fov};
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
  if (!w->is_level) return e;
  const rf_vec3 f = forward_of(&w->pose), r = right_of(&w->pose);
  e.frame.x = r;
  e.frame.y = (rf_vec3){r.y * f.z - r.z * f.y, r.z * f.x - r.x * f.z, r.x * f.y - r.y * f.x};
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
  const rf_vec3 up = {r.y * f.z - r.z * f.y, r.z * f.x - r.x * f.z, r.x * f.y - r.y * f.x};
  const float a = vec_dot(to, r), b = vec_dot(to, up), c = vec_dot(to, f);
  walker_turn(w, yaw, pitch);
  const rf_vec3 f2 = forward_of(&w->pose), r2 = right_of(&w->pose);
  const rf_vec3 up2 = {r2.y * f2.z - r2.z * f2.y, r2.z * f2.x - r2.x * f2.z, r2.x * f2.y - r2.y * f2.x};
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

// --- on foot --------------------------------------------------------------------------------------
static bool feel(const rf_world *world, rf_vec3 from, rf_vec3 direction, float reach, rf_hit *hit, rf_ray *ray)
{
  *ray = (rf_ray){from, 0, direction, reach};
  return rf_intersect(world, ray, hit);
}

static const rf_vec3 down = {0, -1, 0};

void walker_foot(Walker *w, const rf_world *world, bool on)
{
  rf_ray ray;
  rf_hit hit;
  w->on_foot = on;
  w->fall = 0;
  w->stands = false;
  if (!on) return;
  // As tall as the eye is above what it stands over, if that is a person's height in a scene of this size.
  const float tall = held(0.25f * w->size, 1e-3f, 1.65f);
  w->height = world && feel(world, w->pose.place, down, 1.3f * tall, &hit, &ray) && hit.t > 0.4f * tall ? hit.t : tall;
}

// Shortens and bends a step of the feet so that no wall comes nearer than the body's width.
static rf_vec3 collide(const Walker *w, const rf_world *world, rf_vec3 step)
{
  const float radius = RADIUS * w->height;
  for (int round = 0; round < 3; round++) {
    const float length = vec_length(step);
    if (!(length > 1e-7f)) break;
    const rf_vec3 ahead = vec_add((rf_vec3){0, 0, 0}, step, 1 / length), side = {-ahead.z, 0, ahead.x};
    float nearest = length + radius;
    rf_vec3 wall = {0, 0, 0};
    bool is_blocked = false;
    for (int k = 0; k < 9; k++) {
      rf_hit hit;
      rf_ray ray;
      rf_vec3 from = w->pose.place;
      from.y += (feelers[k / 3] - 1) * w->height;
      const rf_vec3 way = k % 3 == 0 ? ahead : vec_add(vec_add((rf_vec3){0, 0, 0}, ahead, 0.7071f), side, k % 3 == 1 ? 0.7071f : -0.7071f);
      if (!feel(world, from, way, length + radius, &hit, &ray)) continue;
      const rf_surface s = rf_surface_at(world, &ray, &hit);
      rf_vec3 n = s.is_back ? (rf_vec3){-s.ng.x, -s.ng.y, -s.ng.z} : s.ng;
      n.y = 0; // feet stay on the floor
      const float l = vec_length(n);
      if (l < 0.3f || vec_dot(n, ahead) >= 0 || hit.t >= nearest) continue; // a slope, or behind
      nearest = hit.t;
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
  const rf_vec3 f = {-sinf(w->pose.yaw), 0, -cosf(w->pose.yaw)};
  rf_vec3 step = vec_add(vec_add((rf_vec3){0, 0, 0}, f, wish->forward), right_of(&w->pose), wish->right);
  const float l = vec_length(step);
  step = vec_add((rf_vec3){0, 0, 0}, step, pace * seconds / (l > 1 ? l : 1));
  step = collide(w, world, step);
  w->pose.place = vec_add(w->pose.place, step, 1);
  // Down to the ground, which may be a step up or, in the air, farther than this fall.
  if (wish->jump && w->stands) w->fall = -3.2f * sqrtf(scale) * scale;
  w->fall += GRAVITY * scale * seconds;
  const float reach = w->height + (w->fall > 0 ? w->fall * seconds : 0) + (w->stands && w->fall > 0 ? STEP * w->height : 0);
  rf_hit hit;
  rf_ray ray;
  w->stands = w->fall > 0 && feel(world, w->pose.place, down, reach, &hit, &ray);
  if (w->stands) {
    const float rise = w->height - hit.t, most = 4 * w->height * seconds; // steps are climbed, not jumped
    w->pose.place.y += rise > most ? most : rise;
    w->fall = 0;
  } else {
    w->pose.place.y -= w->fall * seconds;
    if (w->fall > 60 * scale) w->fall = 60 * scale; // out of the world: as a skydiver
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
  return (Pose){{spline(a->place.x, b->place.x, c->place.x, d->place.x, t),
                 spline(a->place.y, b->place.y, c->place.y, d->place.y, t),
                 spline(a->place.z, b->place.z, c->place.z, d->place.z, t)},
                spline(a->yaw, b->yaw, c->yaw, d->yaw, t),
                spline(a->pitch, b->pitch, c->pitch, d->pitch, t),
                spline(a->fov, b->fov, c->fov, d->fov, t)};
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
  if (w->on_foot && world) return walk(w, wish, s, world) || moved;
  if (!is_wished) return moved;
  const rf_eye e = walker_eye(w);
  const float pace = 0.25f * w->size * w->speed * (wish->fast ? 4 : wish->slow ? 0.25f : 1) * s;
  w->pose.place = vec_add(w->pose.place, e.frame.x, pace * wish->right);
  w->pose.place = vec_add(w->pose.place, (rf_vec3){0, 1, 0}, pace * wish->up);
  w->pose.place = vec_add(w->pose.place, e.frame.z, -pace * wish->forward);
  return true;
}
