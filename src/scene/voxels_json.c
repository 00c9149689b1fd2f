// See voxels_json.h. What was read is kept as text beside the cells, so that a scene is saved as it was written: a castle
// as forty lines, not as a million cells.

#include "scene/voxels_json.h"

#include "scene/voxel_step.h"

#include <math.h>
#include <string.h>

enum { SIZE, PALETTE, CELLS, FILL };
const VoxelKey voxel_keys[VOXEL_KEY_COUNT] = {
    {"size", "array", "\"minItems\":3,\"maxItems\":3,\"items\":{\"type\":\"integer\",\"minimum\":1,\"maximum\":4096}", "Of the grid in voxels along x, y and z, at most 4096 each; not with a file."},
    {"palette", "object", "\"additionalProperties\":{\"$ref\":\"#/$defs/palette\"}", "Kinds of voxels, by name. Those of a file have their numbers for names."},
    {"cells", "array", "\"items\":{\"type\":\"integer\",\"minimum\":0}", "Cells one after the other, x fastest, then y, then z, as three numbers again and again: how many are empty, how many are then filled, and with which entry of the palette, the first being 1."},
    {"fill", "array", "\"items\":{\"$ref\":\"#/$defs/fill\"}", "Steps that fill the grid, one after the other."},
};

bool voxels_json_is_key(const char *name)
{
  for (int i = 0; i < VOXEL_KEY_COUNT; i++)
    if (!strcmp(voxel_keys[i].name, name)) return true;
  return false;
}

// --- reading ------------------------------------------------------------------------------------------------------
static bool fail_at(const ElementReader *r, const Json *dict, int key, const char *message)
{
  return js_fail(r->doc, dict, voxel_keys[key].name, 0, !js_get(dict, voxel_keys[key].name), r->err, "%s", message);
}

static VoxelEdit *begin(const ElementReader *r, const Json *dict, ElementPlace place, const Shape *shape)
{
  const Json *size = js_get(dict, voxel_keys[SIZE].name);
  const bool has_file = shape->voxels_i >= 0;
  int32_t n[3];
  if (has_file && size) return fail_at(r, dict, SIZE, "the size is the file's; leave it out"), NULL;
  if (has_file) return voxel_edit_from(r->scene->voxels.items[shape->voxels_i].data, r->err);
  if (!size) {
    js_fail(r->doc, place.container, place.key, place.index, false, r->err,
            "voxels need a \"file\", or a \"size\" and \"fill\"");
    return NULL;
  }
  for (size_t k = 0; k < 3; k++) {
    const double x = js_number(js_at(size, k), 0);
    if (js_count(size) != 3 || !(x >= 1 && x <= VOXELS_MOST_SIDE && x == floor(x)))
      return fail_at(r, dict, SIZE, "size must be three whole numbers between 1 and 4096"), NULL;
    n[k] = (int32_t)x;
  }
  return voxel_edit_create(n, r->err);
}

static bool read_palette(const ElementReader *r, const Json *dict, VoxelEdit *e)
{
  const Json *list = js_get(dict, voxel_keys[PALETTE].name);
  if (list && js_kind(list) != JSON_DICT)
    return fail_at(r, dict, PALETTE, "a palette is a dictionary: each key is the name of a voxel");
  for (JsonMember m = js_first(list); m.key; m = js_next(list, m)) {
    VoxelFields f = {0};
    if (!element_read(r, &group_voxel, m.value, (ElementPlace){list, m.key, 0}, &f)) return false;
    const VoxelLook look = {(char *)(size_t)f.material, f.roughness, f.metallic, f.emission, f.transmission, f.ior};
    const int32_t look_i = voxel_edit_look(e, &look);
    if (look_i < 0 || voxel_edit_name(e, m.key, f.color, (uint32_t)look_i) < 0)
      return js_fail(r->doc, list, m.key, 0, true, r->err, "a palette holds at most %d voxels of %d looks", VOXELS_MOST_ENTRIES,
                     VOXELS_MOST_LOOKS);
  }
  return true;
}

static bool fail_cells(const ElementReader *r, const Json *list, size_t i)
{
  return js_fail(r->doc, list, NULL, i, false, r->err,
                 "cells are three whole numbers again and again: how many are empty, how many are filled, and with which "
                 "entry of the palette; they must fit into the grid");
}

static bool read_cells(const ElementReader *r, const Json *dict, VoxelEdit *e)
{
  const Json *list = js_get(dict, voxel_keys[CELLS].name);
  const Voxels *v = voxel_edit_grid(e);
  const uint64_t all = (uint64_t)v->size[0] * (uint64_t)v->size[1] * (uint64_t)v->size[2];
  uint64_t at = 0;
  if (list && js_kind(list) != JSON_LIST) return fail_at(r, dict, CELLS, "cells must be a list of numbers");
  if (js_count(list) % 3) return fail_cells(r, list, js_count(list) - 1);
  for (size_t i = 0; i < js_count(list); i += 3) {
    const double skip = js_number(js_at(list, i), -1), count = js_number(js_at(list, i + 1), -1),
                 entry = js_number(js_at(list, i + 2), -1);
    const bool ok = skip >= 0 && skip == floor(skip) && count >= 0 && count == floor(count) && entry >= 1 &&
                    entry < v->palette->entry_count && entry == floor(entry) && skip + count <= (double)(all - at);
    if (!ok) return fail_cells(r, list, i);
    at += (uint64_t)skip;
    for (uint64_t end = at + (uint64_t)count; at < end; at++) {
      const uint64_t row = at / (uint64_t)v->size[0];
      if (!voxel_edit_put(e, (int32_t)(at % (uint64_t)v->size[0]), (int32_t)(row % (uint64_t)v->size[1]),
                          (int32_t)(row / (uint64_t)v->size[1]), (uint32_t)entry))
        return err_memory(r->err, "voxels", 0);
    }
  }
  return true;
}

static const VoxelText *keep_step(Scene *s, const Json *step, const VoxelText *before, Err *err)
{
  Text t = {0};
  js_put_value(&t, step);
  VoxelText *kept = arena_alloc(&s->arena, 1, sizeof *kept);
  if (kept) *kept = (VoxelText){arena_text(&s->arena, text_get(&t)), before};
  const bool ok = kept && kept->json && !t.failed;
  text_finish(&t);
  return ok ? kept : (err_memory(err, "a step", 0), NULL);
}

static bool read_fill(const ElementReader *r, const Json *dict, VoxelEdit *e, const VoxelText **steps)
{
  const Json *list = js_get(dict, voxel_keys[FILL].name);
  if (list && js_kind(list) != JSON_LIST) return fail_at(r, dict, FILL, "fill must be a list of steps");
  for (size_t i = 0; i < js_count(list); i++) {
    VoxelStep step = {0};
    Err wrong = {0};
    if (!element_read(r, &group_voxel_step, js_at(list, i), (ElementPlace){list, NULL, i}, &step)) return false;
    if (!voxel_step_apply(e, &step, r->scene, r->options, &wrong)) {
      if (wrong.kind == ERR_NO_MEMORY) return err_set(r->err, wrong.kind, "%s", wrong.text);
      js_fail(r->doc, list, NULL, i, false, r->err, "%s", wrong.text);
      if (r->err) r->err->kind = wrong.kind; // a missing file stays a missing file
      return false;
    }
    *steps = keep_step(r->scene, js_at(list, i), *steps, r->err);
    if (!*steps) return false;
  }
  return true;
}

static bool keep_head(const ElementReader *r, const Json *dict, const char **head)
{
  Text t = {0};
  for (int k = SIZE; k < FILL; k++) {
    const Json *v = js_get(dict, voxel_keys[k].name);
    if (!v) continue;
    text_add(&t, ",\"%s\":", voxel_keys[k].name);
    js_put_value(&t, v);
  }
  *head = t.length ? arena_text(&r->scene->arena, text_get(&t)) : NULL;
  const bool ok = !t.failed && (!t.length || *head);
  text_finish(&t);
  return ok || err_memory(r->err, "a program of voxels", 0);
}

bool voxels_json_read(const ElementReader *r, const Json *dict, ElementPlace place, Shape *shape)
{
  bool has_keys = false;
  for (int i = 0; i < VOXEL_KEY_COUNT; i++) has_keys |= js_get(dict, voxel_keys[i].name) != NULL;
  if (!has_keys && shape->voxels_i >= 0) return true;
  SceneVoxels made = {.is_program = true};
  VoxelEdit *e = begin(r, dict, place, shape);
  if (!e) return false;
  if (!read_palette(r, dict, e) || !read_cells(r, dict, e) || !read_fill(r, dict, e, &made.steps) ||
      !keep_head(r, dict, &made.head)) {
    voxel_edit_destroy(e);
    return false;
  }
  made.data = voxel_edit_end(e, r->err);
  if (!made.data) return false;
  shape->voxels_i = scene_add_voxels(r->scene, &made);
  return shape->voxels_i >= 0 || err_memory(r->err, "voxels", 0);
}

static bool do_stroke(const ElementReader *r, const Json *json, ElementPlace place, VoxelEdit *e, const VoxelText **steps)
{
  VoxelStep step = {0};
  if (!element_read(r, &group_voxel_step, json, place, &step) || !voxel_step_apply(e, &step, r->scene, r->options, r->err))
    return false;
  *steps = keep_step(r->scene, json, *steps, r->err);
  return *steps != NULL;
}

bool voxels_json_strokes(const ElementReader *r, const Shape *shape, int32_t *voxels_i)
{
  const Json *root = js_root(r->doc);
  const bool is_list = js_kind(root) == JSON_LIST;
  SceneVoxels next = r->scene->voxels.items[shape->voxels_i];
  VoxelEdit *e = voxel_edit_from(next.data, r->err);
  bool ok = e && (is_list || do_stroke(r, root, (ElementPlace){0}, e, &next.steps));
  for (size_t i = 0; ok && is_list && i < js_count(root); i++)
    ok = do_stroke(r, js_at(root, i), (ElementPlace){root, NULL, i}, e, &next.steps);
  if (!ok) {
    voxel_edit_destroy(e);
    return false;
  }
  next.data = voxel_edit_end(e, r->err);
  if (!next.data) return false;
  *voxels_i = scene_add_voxels(r->scene, &next);
  return *voxels_i >= 0 || err_memory(r->err, "voxels", 0);
}

// --- writing ------------------------------------------------------------------------------------------------------
static void write_palette(const Scene *s, const Voxels *v, Text *out)
{
  text_add(out, ",\"palette\":{");
  for (uint32_t i = 1; i < v->palette->entry_count; i++) {
    const VoxelEntry *e = &v->palette->entries[i];
    const VoxelLook *l = &v->palette->looks[e->look];
    const VoxelFields f = {.color = {e->color[0], e->color[1], e->color[2]}, .roughness = l->roughness, .metallic = l->metallic,
                           .emission = l->emission, .transmission = l->transmission, .ior = l->ior, .material = l->material};
    char number[16];
    snprintf(number, sizeof number, "%u", i);
    if (i > 1) text_add(out, ",");
    js_put_text(out, e->name ? e->name : number);
    text_add(out, ":");
    element_write(s, &group_voxel, &f, false, 0, out, NULL);
  }
  text_add(out, "}");
}

static void write_cells(const Voxels *v, Text *out)
{
  uint64_t empty = 0, filled = 0;
  uint32_t entry = 0;
  const char *comma = "";
  text_add(out, ",\"cells\":[");
  for (int32_t z = 0; z < v->size[2]; z++)
    for (int32_t y = 0; y < v->size[1]; y++)
      for (int32_t x = 0; x < v->size[0]; x++) {
        const uint32_t here = voxels_entry(v, x, y, z);
        if (here != entry && filled) {
          text_add(out, "%s%llu,%llu,%u", comma, (unsigned long long)empty, (unsigned long long)filled, entry);
          comma = ",";
          empty = filled = 0;
        }
        entry = here;
        if (here) filled++;
        else empty++;
      }
  if (filled) text_add(out, "%s%llu,%llu,%u", comma, (unsigned long long)empty, (unsigned long long)filled, entry);
  text_add(out, "]");
}

static void write_steps(const VoxelText *last, Text *out)
{
  size_t count = 0;
  for (const VoxelText *t = last; t; t = t->before) count++;
  const VoxelText **all = mem_alloc(count, sizeof *all);
  if (!all) {
    out->failed = true;
    return;
  }
  for (size_t i = count; i-- > 0; last = last->before) all[i] = last;
  text_add(out, ",\"fill\":[");
  for (size_t i = 0; i < count; i++) text_add(out, "%s%s", i ? "," : "", all[i]->json);
  text_add(out, "]");
  mem_free(all);
}

void voxels_json_write(const Scene *s, const Shape *shape, Text *out)
{
  if (shape->kind != SHAPE_VOXELS || shape->voxels_i < 0) return;
  const SceneVoxels *v = &s->voxels.items[shape->voxels_i];
  if (v->is_program) {
    if (v->head) text_add(out, "%s", v->head);
    if (v->steps) write_steps(v->steps, out);
    return;
  }
  text_add(out, ",\"size\":[%d,%d,%d]", v->data->size[0], v->data->size[1], v->data->size[2]);
  write_palette(s, v->data, out);
  write_cells(v->data, out);
}
