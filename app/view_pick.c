// Picking: what the picture shows under the mouse, and those of its values that can be dragged. Values are read from the
// scene and written by edits of the live picture, so a drag can be undone as one step.

#include "view.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

rf_world *view_world(View *v)
{
  if (!v->world && v->live) v->world = rf_live_world(v->live);
  return v->world;
}

// 1 + index of the object that the picture shows at a place of the window.
uint32_t view_object(const View *v, int x, int y)
{
  const rf_live_frame *f = &v->frame;
  if (!f->number || x < 0 || y < 0 || x >= f->width || y >= f->height) return 0;
  return f->objects[(size_t)((long)y * f->render_height / f->height) * (size_t)f->render_width +
                    (size_t)((long)x * f->render_width / f->width)];
}

// Lights that the eye does not see are in the way of bare rays; these pass them.
bool view_look(View *v, int x, int y, rf_vec3 *place, rf_ray *ray, rf_hit *hit, rf_arrival *at)
{
  rf_world *w = view_world(v);
  if (!w || !v->frame.number) return false;
  rf_ray from = rf_eye_ray(&v->frame.eye, (float)v->width, (float)v->height, (float)x + 0.5f, (float)y + 0.5f);
  for (int tries = 0; tries < 16; tries++) {
    if (!rf_look(w, v->frame.eye.cell, &from, hit, at)) return false;
    *ray = at->ray;
    *place = vec_add(from.origin, from.direction, at->length); // where it seems to be, if there is a gate between
    if (hit->object.id != UINT32_MAX) return true;
    from.tmin = at->length * 1.0001f + 1e-5f;
  }
  return false;
}

bool view_hit(View *v, int x, int y, rf_vec3 *place, rf_ray *ray, rf_hit *hit)
{
  rf_arrival at;
  return view_look(v, x, y, place, ray, hit, &at);
}

// --- values ---------------------------------------------------------------------------------------
typedef struct Field {
  const char *name, *label;
  double low, high;
} Field;

// What is worth dragging, of whatever kind of material has it.
static const Field material_fields[] = {{"base_color.0", "red", 0, 1},
                                        {"base_color.1", "green", 0, 1},
                                        {"base_color.2", "blue", 0, 1},
                                        {"albedo.0", "red", 0, 1},
                                        {"albedo.1", "green", 0, 1},
                                        {"albedo.2", "blue", 0, 1},
                                        {"color.0", "red", 0, 1},
                                        {"color.1", "green", 0, 1},
                                        {"color.2", "blue", 0, 1},
                                        {"roughness", "roughness", 0, 1},
                                        {"metallic", "metallic", 0, 1},
                                        {"clearcoat", "clearcoat", 0, 1},
                                        {"transmission", "transmission", 0, 1},
                                        {"ior", "ior", 1, 3},
                                        {"strength", "strength", 0, 0},
                                        {NULL, NULL, 0, 0}};
static const Field object_fields[] = {{"translate.0", "x", 0, 0},
                                      {"translate.1", "y", 0, 0},
                                      {"translate.2", "z", 0, 0},
                                      {"rotate.1", "turn", -180, 180},
                                      {NULL, NULL, 0, 0}};

static bool read_number(rf_scene *s, const char *path, double *out)
{
  const char *json = rf_get(s, path);
  char *end;
  if (!json) return false;
  *out = strtod(json, &end);
  return end != json && !*end;
}

static void add_rows(Picked *p, rf_scene *s, const char *base, const Field *fields)
{
  for (; fields->name && p->row_count < MOST_ROWS; fields++) {
    Row *r = &p->rows[p->row_count];
    *r = (Row){.low = fields->low, .high = fields->high};
    snprintf(r->label, sizeof r->label, "%s", fields->label);
    snprintf(r->path, sizeof r->path, "%.100s.%s", base, fields->name);
    if (read_number(s, r->path, &r->value)) p->row_count++;
  }
}

// The text of a JSON text without its quotes; what would need more than that stays as it is.
static void unquote(char *out, size_t size, const char *json)
{
  snprintf(out, size, "%s", json && *json == '"' ? json + 1 : "");
  const size_t n = strlen(out);
  if (n && out[n - 1] == '"') out[n - 1] = 0;
}

void pick_refresh(View *v)
{
  Picked *p = &v->picked;
  rf_scene *s;
  char base[120];
  if (!p->object || p->dragged >= 0 || !scene_take(v, 0.05, &s)) return;
  p->row_count = 0;
  if (*p->material) {
    snprintf(base, sizeof base, "materials.\"%.60s\"", p->material);
    add_rows(p, s, base, material_fields);
  }
  snprintf(base, sizeof base, "objects[%u]", p->object - 1);
  add_rows(p, s, base, object_fields);
  snprintf(base, sizeof base, "objects[%u].name", p->object - 1);
  unquote(p->name, sizeof p->name, rf_get(s, base));
  rf_error(v->engine, NULL); // a field that a kind lacks is an answer here
  rf_live_return(v->live);
  v->is_dirty = true;
}

void pick_clear(View *v)
{
  v->picked = (Picked){.dragged = -1};
  v->is_dirty = true;
}

void pick_at(View *v, int x, int y)
{
  rf_ray ray;
  rf_hit hit;
  rf_arrival at;
  rf_vec3 place;
  pick_clear(v);
  Picked *p = &v->picked;
  const uint32_t object = view_object(v, x, y);
  if (!object || !view_look(v, x, y, &place, &ray, &hit, &at)) return;
  const rf_surface s = rf_surface_at(view_world(v), &ray, &hit);
  p->object = object;
  p->triangle = hit.part;
  p->distance = at.length;
  p->place = place;
  v->walker.focus = at.length;
  if (s.material_name) snprintf(p->material, sizeof p->material, "%s", s.material_name);
  pick_refresh(v);
}

// --- dragging -------------------------------------------------------------------------------------
bool pick_press(View *v, int x, int y)
{
  Picked *p = &v->picked;
  for (int i = 0; v->shows_hud && p->object && i < p->row_count; i++) {
    const Row *r = &p->rows[i];
    if (x < r->x || y < r->y || x >= r->x + r->width || y >= r->y + r->height) continue;
    p->dragged = i;
    p->is_begun = false;
    return true;
  }
  return false;
}

void pick_drag(View *v, int dx)
{
  Picked *p = &v->picked;
  Row *r = &p->rows[p->dragged];
  char json[40];
  if (dx == 0 || !v->live) return;
  if (r->low < r->high) {
    r->value += (r->high - r->low) * dx / r->width;
    r->value = r->value < r->low ? r->low : r->value > r->high ? r->high : r->value;
  } else {
    r->value += dx * (double)v->walker.focus / v->height; // as far as the mouse moves over the picture
  }
  snprintf(json, sizeof json, "%.5g", r->value);
  rf_live_set(v->live, r->path, json, p->is_begun);
  p->is_begun = true;
  v->is_dirty = true;
}
