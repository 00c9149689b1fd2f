// What a chamber's locks want and whether they have it. See chamber.h.

#include "chamber.h"

#include "arrow.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define DEGREES (180 / 3.14159265358979)

static rf_vec3 add(rf_vec3 a, rf_vec3 b, float s) { return (rf_vec3){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z}; }
static double dot(rf_vec3 a, rf_vec3 b) { return (double)a.x * b.x + (double)a.y * b.y + (double)a.z * b.z; }

static rf_vec3 cross(rf_vec3 a, rf_vec3 b)
{
  return (rf_vec3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// --- the player -------------------------------------------------------------------------------------
Player player_begin(const Chamber *c)
{
  const float s = sinf(c->yaw), k = cosf(c->yaw);
  const rf_body b = {.frame = {{k, 0, -s}, {0, 1, 0}, {s, 0, k}, c->start.place}, .scale = 1, .cell = c->start.cell_i};
  return (Player){b, b, b};
}

// How far a hand reaches: to a wall, but through lamps.
static float reach_of(const rf_world *w, const rf_body *b, rf_vec3 d, float most)
{
  rf_ray ray = {b->frame.p, 0, d, most};
  rf_hit hit;
  rf_arrival at;
  for (int tries = 0; tries < 4 && rf_look(w, b->cell, &ray, &hit, &at); tries++) {
    if (hit.object.id != UINT32_MAX) return at.length;
    ray.tmin = at.length * 1.0001f + 1e-5f;
  }
  return most;
}

rf_body player_lamp(const rf_world *w, const Player *p)
{
  rf_body lamp = p->body;
  const float s = lamp.scale;
  rf_vec3 d = add(add((rf_vec3){0, 0, 0}, lamp.frame.z, -0.93f), lamp.frame.y, -0.37f);
  const float far = reach_of(w, &lamp, d, 0.7f * s) - 0.15f * s;
  if (far > 0) (void)rf_walk(w, &lamp, add((rf_vec3){0, 0, 0}, d, far), false);
  return lamp;
}

bool player_is_left_handed(const Player *p)
{
  return dot(cross(p->body.frame.x, p->body.frame.y), p->body.frame.z) < 0;
}

bool player_is_at(const Player *p, const Spot *s, double radius)
{
  const rf_vec3 off = add(p->body.frame.p, s->place, -1);
  return p->body.cell == s->cell_i && dot(off, off) <= radius * radius;
}

bool player_reaches(const Player *p, int cell, rf_vec3 place)
{
  const rf_vec3 off = add(p->body.frame.p, place, -1);
  const double reach = 1.5 * (double)p->body.scale;
  return p->body.cell == cell && dot(off, off) <= reach * reach;
}

void lamp_values(const char *cell, rf_vec3 place, char cell_json[140], char place_json[100])
{
  if (cell && *cell)
    snprintf(cell_json, 140, "\"%.130s\"", cell);
  else
    snprintf(cell_json, 140, "null");
  snprintf(place_json, 100, "[%.7g, %.7g, %.7g]", (double)place.x, (double)place.y, (double)place.z);
}

// --- locks ------------------------------------------------------------------------------------------
// A picture of 4 x 4 pixels of the cell's face, 4 cm wide, from 10 cm before it; 16 samples of light that came straight from a
// lamp or by one surface more. Enough: what is near a threshold is a chamber badly built (the solver says by what factor).
double lock_light(const rf_world *w, const Lock *l)
{
  rf_engine_def def = rf_default_engine_def();
  def.threads = 1;
  rf_engine *e = rf_engine_create(&def); // its own: the window's has other work
  rf_world *own = e ? rf_world_share(w, e) : NULL;
  rf_film *f = own ? rf_film_create(e, 4, 4, RF_BEAUTY) : NULL;
  const rf_vec3 z = l->normal, up = fabsf(z.y) < 0.9f ? (rf_vec3){0, 1, 0} : (rf_vec3){1, 0, 0};
  rf_vec3 x = cross(up, z);
  const float length = (float)sqrt(dot(x, x));
  x = (rf_vec3){x.x / length, x.y / length, x.z / length};
  const rf_eye eye = {.frame = {x, cross(z, x), z, add(l->at.place, z, 0.1f)}, .lens = RF_ORTHOGRAPHIC,
                      .height = 0.04f, .focus = 0.1f, .fov = 1, .cell = l->at.cell_i};
  rf_render_def r = rf_default_render_def();
  r.integrator = "path";
  r.first_sample = 0;
  r.end_sample = 16;
  r.max_depth = 2;
  double sum = NAN;
  rf_image img;
  if (f && rf_render(own, &eye, &r, f, NULL) == RF_OK && rf_film_plane(f, RF_BEAUTY, &img)) {
    sum = 0;
    for (int i = 0; i < 16; i++)
      for (int k = 0; k < 3; k++) sum += (double)img.pixels[i * img.channels + k] / 48;
    rf_image_free(&img);
  }
  rf_film_destroy(f);
  rf_world_destroy(own);
  rf_engine_destroy(e);
  return sum;
}

bool lock_holds(const Lock *l, const rf_world *w, const Player *p, double light, double *got)
{
  double turn, way;
  switch (l->kind) {
  case LOCK_LIGHT: return *got = light, light >= l->low;
  case LOCK_SIZE: return *got = (double)p->body.scale, *got >= l->low && *got <= l->high;
  case LOCK_HAND: return *got = player_is_left_handed(p) ? -1 : 1, *got >= l->low && *got <= l->high;
  case LOCK_TURN:
    *got = NAN;
    if (!arrow_turn(w, &p->arrow, &p->arrow_home, &turn, &way)) return false;
    return *got = turn * DEGREES, *got >= l->low && *got <= l->high;
  }
  return false; // no other kinds
}

void lock_text(const Lock *l, double got, char out[96])
{
  switch (l->kind) {
  case LOCK_LIGHT: snprintf(out, 96, "light on %s: %.2f of %.2f", l->at.name, got, l->low); return;
  case LOCK_SIZE: snprintf(out, 96, "be %.3g to %.3g of your size: %.3g", l->low, l->high, got); return;
  case LOCK_HAND: snprintf(out, 96, "be %s-handed: %s-handed", l->low < 0 ? "left" : "right", got < 0 ? "left" : "right"); return;
  case LOCK_TURN:
    if (isnan(got))
      snprintf(out, 96, "arrow turned by %.3g to %.3g degrees", l->low, l->high);
    else
      snprintf(out, 96, "arrow turned by %.3g to %.3g degrees: %.1f", l->low, l->high, got);
    return;
  }
}
