// Proofs in the window, as `rayfold prove` makes them: how far is what the mouse points at, what do the angles of a triangle of
// such places make, by how much is an arrow turned that was carried round, how large is this cell.

#include "view.h"

#include "arrow.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#define DEGREES (180 / 3.14159265358979)

static void line(View *v, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void line(View *v, const char *format, ...)
{
  Proof *p = &v->proof;
  va_list args;
  if (p->line_count == PROOF_LINES) return;
  va_start(args, format);
  vsnprintf(p->lines[p->line_count], sizeof p->lines[0], format, args);
  va_end(args);
  p->line_count++;
}

void prove_clear(View *v)
{
  v->proof.pin_count = v->proof.line_count = 0;
  v->is_dirty = true;
}

static rf_vec3 into(const rf_frame *f, rf_vec3 v) { return (rf_vec3){vec_dot(f->x, v), vec_dot(f->y, v), vec_dot(f->z, v)}; }

bool prove_sees_pins(const View *v)
{
  const rf_eye *a = &v->proof.eye, *b = &v->frame.eye;
  return v->proof.pin_count > 0 && a->cell == b->cell && !memcmp(&a->frame, &b->frame, sizeof a->frame) &&
         !memcmp(&a->fov, &b->fov, sizeof a->fov);
}

// --- pins -------------------------------------------------------------------------------------------
static void measure_triangle(View *v, rf_world *w)
{
  Proof *p = &v->proof;
  rf_vec3 corners[3] = {p->pins[0].way, p->pins[1].way, {0, 0, 0}}; // with two, the eye is the third
  const rf_body body = {.frame = p->eye.frame, .scale = 1, .cell = p->eye.cell};
  rf_round r;
  if (p->pin_count == 3) corners[2] = p->pins[2].way;
  if (!rf_walk_corners(w, &body, corners, 3, &r)) return note_library(v);
  if (!r.is_home || isnan(r.area))
    return line(v, r.is_home ? "no triangle: all in one line" : "no triangle: its sides do not close");
  line(v, "angles %.3f°, area %.4g m²", r.angles * DEGREES, r.area);
  line(v, "180° + area × curvature = %.3f°", 180 + (double)rf_curvature(w, p->eye.cell) * r.area * DEGREES);
  line(v, "carried round, an arrow turns by %.3f°", r.turn * DEGREES);
}

void prove_pin(View *v)
{
  Proof *p = &v->proof;
  rf_world *w = view_world(v);
  rf_vec3 place;
  rf_ray ray;
  rf_hit hit;
  rf_arrival at;
  if (!w || !v->frame.number) return;
  if (!view_look(v, v->mouse_x, v->mouse_y, &place, &ray, &hit, &at))
    return note_say(v, true, "nothing is seen there that could be measured");
  if (p->pin_count == MOST_PINS || !prove_sees_pins(v)) p->pin_count = 0;
  p->eye = v->frame.eye;
  p->line_count = 0;
  const rf_vec3 way = vec_add(place, p->eye.frame.p, -1);
  p->pins[p->pin_count++] = (Pin){v->mouse_x, v->mouse_y, into(&p->eye.frame, way)};
  line(v, "%d: %.4g m, through %d gate%s", p->pin_count, (double)at.length, at.gates, at.gates == 1 ? "" : "s");
  if (p->pin_count > 1) measure_triangle(v, w);
  v->is_dirty = true;
}

// --- the arrow --------------------------------------------------------------------------------------
static void lay_down(View *v, rf_world *w)
{
  const rf_body *home = &v->walker.arrow_home, *arrow = &v->walker.arrow;
  double turn, way;
  if (arrow->cell != home->cell) return note_say(v, true, "the arrow was taken up in another cell; carry it back there");
  if (!arrow_turn(w, arrow, home, &turn, &way))
    return note_say(v, true, "no straight way leads from here to where the arrow was taken up; go nearer");
  prove_clear(v);
  line(v, "arrow: carried %.4g m, the last %.3g m straight home", v->walker.carried + way, way);
  line(v, "turned by %.3f°", turn * DEGREES);
  v->walker.carries = false;
}

void prove_arrow(View *v)
{
  rf_world *w = view_world(v);
  if (!w) return;
  if (v->walker.carries) return lay_down(v, w);
  walker_carry(&v->walker, true);
  note_say(v, false, "the arrow is carried along; come back here and lay it down with H");
}

// --- volume -----------------------------------------------------------------------------------------
void prove_volume(View *v)
{
  rf_world *w = view_world(v);
  double volume, error;
  if (!w) return;
  const float kappa = rf_curvature(w, v->walker.pose.cell);
  if (!rf_cell_volume(w, v->walker.pose.cell, v->walker.pose.place, 200000, 0, &volume, &error)) return note_library(v);
  prove_clear(v);
  line(v, "volume of this cell %.5g ± %.2g m³", volume, error);
  if (kappa != 0) line(v, "with a radius of curvature of one, %.5g", volume * pow(fabs((double)kappa), 1.5));
}
