// Brushes for voxels: what the mouse points at is found by a ray of the picture, and each stroke is an edit of the live
// picture, so that it can be undone as one step. While a stroke lasts rays see the world as it was before it: a wall that
// is being drawn does not grow towards the eye.

#include "view.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const tool_names[TOOL_COUNT] = {"off", "add", "erase", "paint", "flood", "extrude"};
static const char *const face_names[6] = {"-x", "+x", "-y", "+y", "-z", "+z"};

static void tell(View *v)
{
  const Brush *b = &v->brush;
  if (b->tool == TOOL_OFF) return note_say(v, false, "brush off: clicks pick objects");
  note_say(v, false, "brush: %s, %s, %d wide, colours vary by %.0f %%", tool_names[b->tool], b->is_box ? "square" : "round",
           b->size, (double)(100 * b->randomness));
}

void brush_tool(View *v, int step)
{
  v->brush.tool = (v->brush.tool + step + TOOL_COUNT) % TOOL_COUNT;
  tell(v);
}

void brush_size(View *v, int step)
{
  const int size = v->brush.size + step;
  v->brush.size = size < 1 ? 1 : size > 128 ? 128 : size;
  tell(v);
}

void brush_form(View *v)
{
  v->brush.is_box = !v->brush.is_box;
  tell(v);
}

void brush_randomness(View *v)
{
  v->brush.randomness = v->brush.randomness >= 0.4f ? 0 : v->brush.randomness + 0.1f;
  tell(v);
}

// --- where it points ----------------------------------------------------------------------------------------------
static bool look_at(View *v, rf_world *w, int x, int y, rf_voxel *out, uint32_t *object)
{
  rf_hit hit;
  rf_ray ray = rf_eye_ray(&v->frame.eye, (float)v->width, (float)v->height, (float)x + 0.5f, (float)y + 0.5f);
  if (!w || !v->frame.number) return false;
  for (int tries = 0; tries < 16; tries++) {
    if (!rf_intersect(w, &ray, &hit)) return false;
    if (rf_voxel_at(w, &ray, &hit, out)) {
      *object = hit.object.id;
      return true;
    }
    if (hit.object.id != UINT32_MAX) return false; // something else is in front
    ray.tmin = hit.t * 1.0001f + 1e-5f;            // a lamp that the eye does not see
  }
  return false;
}

void brush_take_color(View *v)
{
  rf_voxel found;
  uint32_t object;
  if (!look_at(v, view_world(v), v->mouse_x, v->mouse_y, &found, &object)) return note_say(v, true, "there is no voxel under the mouse");
  memcpy(v->brush.color, found.color, sizeof v->brush.color);
  snprintf(v->brush.voxel, sizeof v->brush.voxel, "%s", found.name && !strpbrk(found.name, "\"\\") ? found.name : "");
  note_say(v, false, *v->brush.voxel ? "the brush has the voxel \"%s\"" : "the brush has this colour%s", v->brush.voxel);
}

// --- strokes ------------------------------------------------------------------------------------------------------
static int add_look(const Brush *b, char *out, size_t size)
{
  const int n = *b->voxel ? snprintf(out, size, ",\"voxel\":\"%s\"", b->voxel)
                          : snprintf(out, size, ",\"color\":[%.5g,%.5g,%.5g]", (double)b->color[0], (double)b->color[1], (double)b->color[2]);
  return n + snprintf(out + n, size - (size_t)n, ",\"randomness\":%.2g", (double)b->randomness);
}

// From one cell to another; square brushes leave gaps where the mouse moves fast.
static void step_json(const Brush *b, const rf_voxel *at, const int from[3], const int to[3], char out[400])
{
  static const char *const modes[TOOL_COUNT] = {"", "add", "erase", "paint", "paint", ""};
  char look[160] = "";
  if (b->tool != TOOL_ERASE && b->tool != TOOL_EXTRUDE) (void)add_look(b, look, sizeof look);
  const double half = 0.5 * b->size;
  if (b->tool == TOOL_EXTRUDE)
    snprintf(out, 400, "{\"kind\":\"extrude\",\"at\":[%d,%d,%d],\"face\":\"%s\",\"amount\":%d}", at->cell[0], at->cell[1], at->cell[2],
             face_names[at->face], b->is_inward ? -b->size : b->size);
  else if (b->tool == TOOL_FLOOD)
    snprintf(out, 400, "{\"kind\":\"flood\",\"at\":[%d,%d,%d]%s}", at->cell[0], at->cell[1], at->cell[2], look);
  else if (b->is_box || b->size == 1)
    snprintf(out, 400, "{\"kind\":\"box\",\"corner\":[%d,%d,%d],\"size\":%d,\"mode\":\"%s\"%s}", to[0] - b->size / 2, to[1] - b->size / 2,
             to[2] - b->size / 2, b->size, modes[b->tool], look);
  else
    snprintf(out, 400, "{\"kind\":\"line\",\"from\":[%.1f,%.1f,%.1f],\"to\":[%.1f,%.1f,%.1f],\"radius\":%.2f,\"mode\":\"%s\"%s}",
             from[0] + 0.5, from[1] + 0.5, from[2] + 0.5, to[0] + 0.5, to[1] + 0.5, to[2] + 0.5, half, modes[b->tool], look);
}

// The whole stroke is sent again with each step, in the place of what was sent before: so it is one step of undo.
static void send(View *v, const rf_voxel *at)
{
  Brush *b = &v->brush;
  char step[400];
  int to[3];
  for (int k = 0; k < 3; k++) to[k] = b->tool == TOOL_ADD ? at->beside[k] : at->cell[k];
  if (b->has_last && !memcmp(to, b->last, sizeof to)) return;
  step_json(b, at, b->has_last ? b->last : to, to, step);
  const size_t length = strlen(b->json), more = strlen(step);
  if (length + more + 3 > sizeof b->json) return; // very long: it ends here, and the next press goes on
  snprintf(b->json + (length ? length - 1 : 0), sizeof b->json - length, "%s%s]", length ? "," : "[", step);
  rf_live_set(v->live, b->path, b->json, b->has_last);
  memcpy(b->last, to, sizeof to);
  b->has_last = true;
}

bool brush_press(View *v, int x, int y, bool is_inward)
{
  Brush *b = &v->brush;
  rf_voxel at;
  uint32_t object;
  if (b->tool == TOOL_OFF || !v->live) return false;
  rf_world *w = rf_live_world(v->live);
  const uint32_t place = view_object(v, x, y); // 1 + its index in the scene's list
  if (!place || !look_at(v, w, x, y, &at, &object)) {
    rf_world_destroy(w);
    return false;
  }
  snprintf(b->path, sizeof b->path, "objects[%u].shape.stroke", place - 1);
  b->world = w;
  b->object = object;
  b->is_down = true;
  b->is_inward = is_inward;
  b->has_last = false;
  b->json[0] = 0;
  send(v, &at);
  return true;
}

void brush_drag(View *v, int x, int y)
{
  rf_voxel at;
  uint32_t object;
  if (v->brush.tool == TOOL_EXTRUDE || v->brush.tool == TOOL_FLOOD) return; // one at a time
  if (look_at(v, v->brush.world, x, y, &at, &object) && object == v->brush.object) send(v, &at);
}

void brush_release(View *v)
{
  rf_world_destroy(v->brush.world);
  v->brush.world = NULL;
  v->brush.is_down = false;
}
