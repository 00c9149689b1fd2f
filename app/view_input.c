// Keys and mouse. One table holds what a key does and what the help says of it.

#include "view.h"

#include "library.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct Action {
  int key;
  unsigned mods;    // without MOD_SHIFT where the action looks at it
  const char *name; // as the help calls it; NULL: together with the line before
  const char *what;
  void (*run)(View *v, const Event *e);
} Action;

// --- views ----------------------------------------------------------------------------------------
static const char *const integrators[] = {"path", "classic", "whitted", "normal", "depth", "albedo", "uv", "id", "bary", "cost"};
enum { INTEGRATOR_COUNT = sizeof integrators / sizeof *integrators };

// Pictures of numbers are shown as they are, whatever the scene's curve.
void view_integrator(View *v, const char *name)
{
  v->wanted.render.integrator = name;
  v->wanted.develop = v->develop;
  if (!integrator_is_light(name)) {
    v->wanted.develop.tone_curve = "linear";
    v->wanted.develop.exposure = 0;
    v->wanted.develop.gamma = 1;
  }
  v->is_asked = true;
}

static void next_view(View *v, const Event *e)
{
  int i = 0;
  while (i < INTEGRATOR_COUNT - 1 && strcmp(integrators[i], v->wanted.render.integrator)) i++;
  i += e->mods & MOD_SHIFT ? INTEGRATOR_COUNT - 1 : 1;
  view_integrator(v, integrators[i % INTEGRATOR_COUNT]);
}

static void show_view(View *v, const Event *e)
{
  static const char *const shown[] = {"path", "normal", "depth", "albedo", "id", "cost"};
  view_integrator(v, shown[e->key - KEY_F1 - 4]);
}

static void toggle_denoise(View *v, const Event *e)
{
  (void)e;
  v->wanted.denoise = !v->wanted.denoise;
  v->is_asked = true;
  note_say(v, false, v->wanted.denoise ? "denoiser on" : "denoiser off");
}

static void toggle_trail(View *v, const Event *e)
{
  (void)e;
  v->wanted.reproject = !v->wanted.reproject;
  v->is_asked = true;
  note_say(v, false, v->wanted.reproject ? "frames help the next" : "every frame on its own");
}

// Their view; with shift their size.
static void toggle_blocks(View *v, const Event *e)
{
  const int size = v->wanted.blocks;
  if (e->mods & MOD_SHIFT)
    v->wanted.blocks = size == 16 ? 0 : size ? 2 * size : 4;
  else
    v->wanted.show_blocks = !v->wanted.show_blocks;
  v->is_asked = true;
  if (strcmp(v->wanted.render.integrator, "whitted"))
    note_say(v, false, "blocks are for the integrator whitted (V)");
  else if (!v->wanted.blocks)
    note_say(v, false, "every pixel is traced");
  else
    note_say(v, false, v->wanted.show_blocks ? "blocks of %d: red of one colour, blue filled, others traced" : "blocks of %d while it moves",
             v->wanted.blocks);
}

static void change_exposure(View *v, const Event *e)
{
  char json[40];
  v->develop.exposure += e->key == ']' ? 0.25f : -0.25f;
  snprintf(json, sizeof json, "%.4g", (double)v->develop.exposure);
  if (v->live) rf_live_set(v->live, "develop.exposure", json, true);
  view_integrator(v, v->wanted.render.integrator);
  note_say(v, false, "exposure %+.2f", (double)v->develop.exposure);
}

// --- stored views ---------------------------------------------------------------------------------
// The eye as a camera of a scene file.
static void camera_json(View *v, char out[560])
{
  const rf_eye e = walker_eye(&v->walker);
  rf_scene *s;
  char cell[140] = "";
  if (e.cell && scene_take(v, 1, &s)) {
    const char *name = rf_cell_name(s, e.cell);
    if (name && strlen(name) < 100) snprintf(cell, sizeof cell, ", \"cell\": \"%s\"", name);
    rf_live_return(v->live);
  }
  const rf_vec3 p = e.frame.p, t = vec_add(p, e.frame.z, -v->walker.focus);
  snprintf(out, 560,
           "{\"position\": [%.6g, %.6g, %.6g], \"target\": [%.6g, %.6g, %.6g], \"fov\": %.6g, \"aperture\": %.6g, "
           "\"focus\": %.6g, \"blades\": %d%s}",
           (double)p.x, (double)p.y, (double)p.z, (double)t.x, (double)t.y, (double)t.z,
           (double)e.fov * 180 / 3.14159265358979, (double)e.aperture, (double)e.focus, e.blades, cell);
}

static bool stored_eye(View *v, const char *name, rf_eye *out)
{
  rf_scene *s;
  if (!scene_take(v, 1, &s)) return false;
  const bool ok = rf_camera(s, view_world(v), name, (float)v->width / (float)v->height, out);
  rf_error(v->engine, NULL); // that there is none is an answer here
  rf_live_return(v->live);
  return ok;
}

static void store_view(View *v, const Event *e)
{
  char path[40], json[560];
  camera_json(v, json);
  snprintf(path, sizeof path, e->key == '0' ? "camera" : "cameras.view%c", e->key);
  if (!v->live || v->walker.lens.lens != RF_PERSPECTIVE) return;
  if (rf_live_set(v->live, path, json, false)) note_say(v, false, "stored as %s; ctrl+s saves the scene", path);
}

static void go_to_view(View *v, const Event *e)
{
  char name[40];
  rf_eye eye;
  snprintf(name, sizeof name, "view%c", e->key);
  if (!stored_eye(v, e->key == '0' ? NULL : name, &eye))
    return note_say(v, true, "no view is stored as %c; ctrl+%c does that", e->key, e->key);
  const Pose stop = pose_of(&eye);
  walker_fly(&v->walker, &stop, 1);
}

static void fly_all(View *v, const Event *e)
{
  Pose stops[MOST_STOPS];
  int count = 0;
  rf_eye eye;
  (void)e;
  for (char c = '1'; c <= '9'; c++) {
    const char name[] = {'v', 'i', 'e', 'w', c, 0};
    if (stored_eye(v, name, &eye)) stops[count++] = pose_of(&eye);
  }
  if (!count) return note_say(v, true, "no views are stored; ctrl+1 to ctrl+9 do that");
  walker_fly(&v->walker, stops, count);
}

// --- editing --------------------------------------------------------------------------------------
static void undo(View *v, const Event *e)
{
  if (!v->live) return;
  if (e->mods & MOD_SHIFT)
    rf_live_redo(v->live);
  else
    rf_live_undo(v->live);
  pick_refresh(v);
}

static void redo(View *v, const Event *e)
{
  (void)e;
  if (v->live) rf_live_redo(v->live);
  pick_refresh(v);
}

// The scene's first light where the eye is: what it shines on is what is seen.
static void light_to_eye(View *v, const Event *e)
{
  rf_scene *s;
  char kind[40] = "", place[100], target[100];
  (void)e;
  if (!scene_take(v, 1, &s)) return;
  const char *json = rf_get(s, "lights[0].kind");
  snprintf(kind, sizeof kind, "%s", json ? json : "");
  rf_error(v->engine, NULL);
  rf_live_return(v->live);
  if (!*kind) return note_say(v, true, "this scene has no light of its own to move");
  const rf_eye eye = walker_eye(&v->walker);
  const rf_vec3 p = eye.frame.p, b = eye.frame.z, t = vec_add(p, b, -v->walker.focus);
  if (!strcmp(kind, "\"sun\"")) {
    snprintf(place, sizeof place, "[%.6g, %.6g, %.6g]", (double)b.x, (double)b.y, (double)b.z);
    rf_live_set(v->live, "lights[0].direction", place, false);
  } else {
    snprintf(place, sizeof place, "[%.6g, %.6g, %.6g]", (double)p.x, (double)p.y, (double)p.z);
    snprintf(target, sizeof target, "[%.6g, %.6g, %.6g]", (double)t.x, (double)t.y, (double)t.z);
    rf_live_set(v->live, "lights[0].position", place, false);
    if (strcmp(kind, "\"point\"") && strcmp(kind, "\"sphere\""))
      rf_live_set(v->live, "lights[0].target", target, false);
  }
  note_say(v, false, "the light shines from here");
}

static void next_tool(View *v, const Event *e) { brush_tool(v, e->mods & MOD_SHIFT ? -1 : 1); }
static void size_brush(View *v, const Event *e) { brush_size(v, e->key == '.' ? 1 : -1); }

static void form_brush(View *v, const Event *e)
{
  (void)e;
  brush_form(v);
}

static void vary_brush(View *v, const Event *e)
{
  (void)e;
  brush_randomness(v);
}

static void take_color(View *v, const Event *e)
{
  (void)e;
  brush_take_color(v);
}

static void measure(View *v, const Event *e)
{
  if (e->mods & MOD_SHIFT)
    prove_clear(v);
  else
    prove_pin(v);
}

static void arrow(View *v, const Event *e)
{
  (void)e;
  prove_arrow(v);
}

static void volume(View *v, const Event *e)
{
  (void)e;
  prove_volume(v);
}

static void lamp(View *v, const Event *e)
{
  (void)e;
  game_lamp(v);
}

static void again(View *v, const Event *e)
{
  (void)e;
  game_again(v);
}

static void save(View *v, const Event *e)
{
  (void)e;
  view_save(v);
}

// --- the rest -------------------------------------------------------------------------------------
static void toggle_foot(View *v, const Event *e)
{
  (void)e;
  walker_foot(&v->walker, view_world(v), !v->walker.on_foot);
  note_say(v, false, v->walker.on_foot ? "on foot" : "flying");
}

static void toggle_help(View *v, const Event *e)
{
  (void)e;
  v->shows_help = !v->shows_help;
}

static void toggle_hud(View *v, const Event *e)
{
  (void)e;
  v->shows_hud = !v->shows_hud;
}

static void full_screen(View *v, const Event *e)
{
  (void)e;
  v->kind->full(v->screen);
}

static void screenshot(View *v, const Event *e)
{
  (void)e;
  shot_begin(v);
}

static void show_list(View *v, const Event *e)
{
  (void)e;
  list_toggle(v);
}

static void next_scene(View *v, const Event *e) { list_step(v, e->key == KEY_F1 + 3 ? 1 : -1); }

static void escape(View *v, const Event *e)
{
  (void)e;
  if (v->shows_help)
    v->shows_help = false;
  else if (v->picked.object)
    pick_clear(v);
  else
    v->is_over = true;
}

static void quit(View *v, const Event *e)
{
  (void)e;
  v->is_over = true;
}

static const Action actions[] = {
    {0, 0, "W A S D", "move; shift: faster, alt: slower", NULL},
    {0, 0, "Q E", "down and up", NULL},
    {0, 0, "arrows", "look around", NULL},
    {0, 0, "left drag", "look around", NULL},
    {0, 0, "middle drag", "turn around the point (or alt + left)", NULL},
    {0, 0, "wheel", "nearer, farther; ctrl: lens, shift: speed", NULL},
    {'g', 0, "G", "walk or fly; space jumps", toggle_foot},
    {'1', 0, "1 ... 9", "fly to a stored view", go_to_view},
    {'1', MOD_CTRL, "ctrl + 1 ... 9", "store this view", store_view},
    {'0', 0, "0", "back to the scene's camera", go_to_view},
    {'0', MOD_CTRL, "ctrl + 0", "make this the scene's camera", store_view},
    {'p', 0, "P", "fly through all stored views", fly_all},
    {0, 0, "click", "pick an object", NULL},
    {0, 0, "drag a value", "change it", NULL},
    {'z', MOD_CTRL, "ctrl + Z, Y", "undo, redo", undo},
    {'y', MOD_CTRL, NULL, NULL, redo},
    {'k', 0, "K", "brush for voxels: add erase paint flood extrude", next_tool},
    {',', 0, ", .", "smaller, larger brush", size_brush},
    {'.', 0, NULL, NULL, size_brush},
    {'x', 0, "X", "square or round brush", form_brush},
    {'r', 0, "R", "how much its colours vary", vary_brush},
    {'c', 0, "C", "take the colour under the mouse", take_color},
    {'m', 0, "M", "measure to the mouse; 2 or 3: a triangle", measure},
    {'h', 0, "H", "carry an arrow round, and lay it down", arrow},
    {'j', 0, "J", "volume of this cell", volume},
    {'f', 0, "F, O", "Parallax Locks: the lamp; begin again", lamp},
    {'o', 0, NULL, NULL, again},
    {'l', 0, "L", "first light to where I am", light_to_eye},
    {'[', 0, "[ ]", "darker, brighter", change_exposure},
    {']', 0, NULL, NULL, change_exposure},
    {'v', 0, "V", "next integrator; shift: the one before", next_view},
    {KEY_F1 + 4, 0, "F5 ... F10", "path normal depth albedo id cost", show_view},
    {'n', 0, "N", "denoiser on and off", toggle_denoise},
    {'t', 0, "T", "frames help the next, on and off", toggle_trail},
    {'b', 0, "B", "whitted: blocks shown; shift: their size", toggle_blocks},
    {KEY_F1 + 1, 0, "F2", "the scenes of this folder; arrows, enter", show_list},
    {KEY_F1 + 2, 0, "F3, F4", "the scene before, the next", next_scene},
    {KEY_F1 + 3, 0, NULL, NULL, next_scene},
    {KEY_TAB, 0, "Tab", "figures on and off", toggle_hud},
    {KEY_F1 + 10, 0, "F11", "full screen", full_screen},
    {KEY_F1 + 11, 0, "F12", "screenshot in full quality", screenshot},
    {'s', MOD_CTRL, "ctrl + S", "save the scene", save},
    {0, 0, "drop a file", "open it", NULL},
    {KEY_F1, 0, "F1", "these keys", toggle_help},
    {KEY_ESCAPE, 0, "Esc", "close what is open, then leave", escape},
    {'q', MOD_CTRL, NULL, NULL, quit},
};

bool input_key_line(int i, const char **key, const char **what)
{
  for (size_t k = 0; k < sizeof actions / sizeof *actions; k++) {
    if (!actions[k].name || i-- > 0) continue;
    *key = actions[k].name;
    *what = actions[k].what;
    return true;
  }
  return false;
}

// Is the key that of the action? Some actions have a row of keys that follow one another.
static bool is_meant(const Action *a, const Event *e)
{
  if (!a->run || (e->mods & MOD_CTRL) != (a->mods & MOD_CTRL)) return false;
  if (a->key == '1') return e->key >= '1' && e->key <= '9';
  if (a->key == KEY_F1 + 4) return e->key >= KEY_F1 + 4 && e->key <= KEY_F1 + 9;
  return a->key == e->key;
}

static void press_key(View *v, const Event *e)
{
  v->is_dirty |= v->list.is_open;
  if (list_key(v, e->key)) return;
  v->down[e->key] = true;
  for (size_t i = 0; i < sizeof actions / sizeof *actions; i++) {
    if (!is_meant(&actions[i], e)) continue;
    actions[i].run(v, e);
    v->is_dirty = true;
    return;
  }
}

// --- mouse ----------------------------------------------------------------------------------------
enum { CLICK = 4 }; // points that a click may slip

static void press(View *v, const Event *e)
{
  rf_ray ray;
  rf_hit hit;
  v->button = e->button;
  v->press_x = v->mouse_x = e->x;
  v->press_y = v->mouse_y = e->y;
  v->is_dragging = false;
  v->is_orbiting = e->button == BUTTON_MIDDLE || (e->button == BUTTON_LEFT && (e->mods & MOD_ALT));
  if (e->button == BUTTON_LEFT && list_press(v, e->x, e->y)) {
    v->button = 0;
    v->is_dirty = true;
    return;
  }
  if (e->button == BUTTON_LEFT && pick_press(v, e->x, e->y)) return;
  if (e->button == BUTTON_LEFT && !v->is_orbiting && brush_press(v, e->x, e->y, e->mods & MOD_SHIFT)) return;
  if (!v->is_orbiting) return;
  if (v->picked.object) {
    v->centre = v->picked.place;
  } else if (!view_hit(v, e->x, e->y, &v->centre, &ray, &hit)) {
    const rf_eye eye = walker_eye(&v->walker);
    v->centre = vec_add(eye.frame.p, eye.frame.z, -v->walker.focus);
  }
}

static void release(View *v, const Event *e)
{
  if (v->brush.is_down) {
    brush_release(v);
    v->button = 0;
    return;
  }
  if (v->is_dragging && v->picked.dragged < 0) v->kind->capture(v->screen, false);
  if (v->picked.dragged >= 0) {
    v->picked.dragged = -1;
    pick_refresh(v);
  } else if (!v->is_dragging && e->button == BUTTON_LEFT && v->button == BUTTON_LEFT) {
    pick_at(v, e->x, e->y);
  }
  v->button = 0;
  v->is_dirty = true;
}

static void move_mouse(View *v, const Event *e)
{
  const int dx = e->x - v->mouse_x, dy = e->y - v->mouse_y;
  v->mouse_x = e->x;
  v->mouse_y = e->y;
  if (!v->button) return;
  if (v->brush.is_down) return brush_drag(v, e->x, e->y);
  if (v->picked.dragged >= 0) return pick_drag(v, dx);
  if (!v->is_dragging) {
    const int far = abs(e->x - v->press_x) + abs(e->y - v->press_y);
    if ((float)far < CLICK * v->scale) return;
    v->is_dragging = true;
    v->kind->capture(v->screen, true);
    return; // the first jump is no turn
  }
  // The picture follows the mouse: what was under it stays there, in the middle.
  const float angle = v->walker.pose.fov / (float)v->height;
  if (v->is_orbiting)
    walker_orbit(&v->walker, v->centre, -0.006f * (float)dx / v->scale, -0.006f * (float)dy / v->scale);
  else
    walker_turn(&v->walker, angle * (float)dx * 1.5f, angle * (float)dy * 1.5f);
  v->is_asked = true;
}

static void turn_wheel(View *v, const Event *e)
{
  Walker *w = &v->walker;
  if (e->mods & MOD_CTRL) {
    w->pose.fov *= powf(0.94f, e->wheel);
    w->pose.fov = fminf(fmaxf(w->pose.fov, 0.02f), 2.8f);
  } else if (e->mods & MOD_SHIFT) {
    w->speed *= powf(1.2f, e->wheel);
    note_say(v, false, "speed %.2g", (double)w->speed);
  } else {
    walker_dolly(w, e->wheel);
  }
  v->is_asked = true;
}

// --------------------------------------------------------------------------------------------------
void input_event(View *v, const Event *e)
{
  switch (e->kind) {
  case EVENT_NONE:
  case EVENT_WAKE: return;
  case EVENT_QUIT: v->is_over = true; return;
  case EVENT_KEY: press_key(v, e); return;
  case EVENT_KEY_UP: v->down[e->key] = false; return;
  case EVENT_PRESS: press(v, e); return;
  case EVENT_RELEASE: release(v, e); return;
  case EVENT_MOVE: move_mouse(v, e); return;
  case EVENT_WHEEL: turn_wheel(v, e); return;
  case EVENT_RESIZE:
    v->width = e->x;
    v->height = e->y;
    v->is_dirty = v->is_asked = true;
    return;
  case EVENT_DROP: view_open(v, e->path); return;
  }
}

static float axis(const View *v, int plus, int minus) { return (float)(v->down[plus] - v->down[minus]); }

Wish input_wish(View *v)
{
  float pad[PAD_AXES];
  v->kind->pad(v->screen, pad);
  if (v->down[KEY_CTRL]) return (Wish){0}; // letters are commands then
  return (Wish){.right = axis(v, 'd', 'a') + pad[PAD_LEFT_X],
                .up = axis(v, 'e', 'q') + pad[PAD_UP] - pad[PAD_DOWN],
                .forward = axis(v, 'w', 's') - pad[PAD_LEFT_Y],
                .turn = axis(v, KEY_RIGHT, KEY_LEFT) + pad[PAD_RIGHT_X],
                .tilt = axis(v, KEY_DOWN, KEY_UP) + pad[PAD_RIGHT_Y],
                .fast = v->down[KEY_SHIFT],
                .slow = v->down[KEY_ALT],
                .jump = v->down[' ']};
}
