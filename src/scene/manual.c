// See pages.h. The introduction and the example are written by hand; every table is made from the field tables.

#include "base/mem.h"
#include "scene/json.h"
#include "scene/keys.h"
#include "scene/mesh_json.h"
#include "scene/voxels_json.h"
#include "scene/pages.h"
#include "scene/value.h"

#include <string.h>

static const char introduction[] =
    "# The scene file\n"
    "\n"
    "<!-- Made from the field tables of src/scene by `rayfold manual`. Edit those, not this page. -->\n"
    "\n"
    "A scene is one JSON object in a file that ends in `.json`. It says what there is, where it is, what it "
    "is made\n"
    "of, and how to look at it. Everything has a default, so a scene says only what differs:\n"
    "\n"
    "```json\n"
    "{\n"
    "  \"rayfold\": 1,\n"
    "  \"render\": { \"size\": [1280, 720], \"spp\": 256 },\n"
    "  \"camera\": { \"position\": [0, 1, 4], \"target\": [0, 0.5, 0], \"fov\": 45 },\n"
    "  \"sky\": { \"kind\": \"gradient\", \"gain\": 0.5 },\n"
    "  \"materials\": {\n"
    "    \"gold\": { \"kind\": \"pbr\", \"base_color\": \"#ffe29b\", \"metallic\": 1, \"roughness\": 0.2 },\n"
    "    \"floor\": { \"kind\": \"lambert\", \"albedo\": 0.5 }\n"
    "  },\n"
    "  \"objects\": [\n"
    "    { \"name\": \"ball\", \"shape\": { \"kind\": \"sphere\", \"radius\": 0.5 }, \"material\": \"gold\", "
    "\"translate\": [0, 0.5, 0] },\n"
    "    { \"name\": \"ground\", \"shape\": { \"kind\": \"quad\", \"size\": [10, 10] }, \"material\": "
    "\"floor\", \"rotate\": [-90, 0, 0] }\n"
    "  ],\n"
    "  \"lights\": [\n"
    "    { \"kind\": \"rect\", \"position\": [2, 3, 2], \"size\": [1, 1], \"radiance\": 12 }\n"
    "  ]\n"
    "}\n"
    "```\n"
    "\n"
    "Save it as `ball.json`; `rayfold render ball.json -o ball.png` makes the picture. `rayfold validate "
    "ball.json`\n"
    "checks a scene without rendering, and `rayfold schema` prints a JSON Schema that lets an editor "
    "complete and\n"
    "check while you type.\n"
    "\n"
    "## Rules\n"
    "\n"
    "- The file is read strictly. An unknown key, kind or name and a value out of its range are errors that "
    "name the\n"
    "  file, the line and the column, and the nearest name there is.\n"
    "- `\"rayfold\": 1` is the version of the format and must be there. All sections may be absent and may "
    "stand in any\n"
    "  order; a name may be used before it is defined.\n"
    "- Right-handed, y up; a camera without a target of its own looks along -z. Metres, seconds, watts; "
    "angles in\n"
    "  degrees.\n"
    "- Colours are linear Rec.709: `[r, g, b]`, one number for grey, or `\"#rrggbb\"` or `\"#rgb\"` in "
    "sRGB.\n"
    "- A vec3 may be one number for all three. A matrix is 16 numbers, column by column, the last row 0 0 0 "
    "1 (or the\n"
    "  12 that are not fixed); with it, `translate`, `rotate` and `scale` must be absent.\n"
    "- A texture or material is given by its name, `null` is none. Names of objects and lights are "
    "optional.\n"
    "- A file name is relative to the file that names it, and must lie in the folder of the main file or "
    "below it,\n"
    "  unless `--allow-outside` says otherwise. The same model in several objects is loaded once.\n"
    "- The shape of an object may be a whole model or another scene. Such a scene's objects, materials and "
    "lights\n"
    "  come along; a scene cannot contain itself.\n"
    "\n"
    "What it does not do: no expressions, no variables, no comments, no loops. A program that writes JSON "
    "has those.\n"
    "\n"
    "## Edits\n"
    "\n"
    "Each field has a path, and an edit is `path = value`, the same on the command line (`--set`), in the "
    "studio and\n"
    "in the library (`rf_set`):\n"
    "\n"
    "| edit | what it does |\n"
    "|---|---|\n"
    "| `render.spp=16` | sets a field |\n"
    "| `camera.position.1=2.5` | one component; also `.y`, and `.g` of a colour |\n"
    "| `materials.gold.base_color=#ff0000` | text needs no quotes |\n"
    "| `materials.\"my mat\".roughness=0.1` | a name with blanks, dots or quotes is quoted as in JSON |\n"
    "| `objects.ball.shape.radius=1`, `objects[0].translate=[0,1,0]` | things in lists, by name or by number "
    "|\n"
    "| `materials.gold.kind=glass` | another kind; fields of the same name keep their values |\n"
    "| `materials.gold.name=brass` | a new name; all who use it follow |\n"
    "| `objects.cube={\"shape\":{\"kind\":\"box\"}}` | adds a thing, or replaces the one of that name |\n"
    "| `objects.cube=null` | removes it, unless it is still used |\n"
    "| `render.spp=null` | back to the default |\n"
    "\n"
    "An edit that fails changes nothing and says why.\n"
    "\n";

static void put_cell(Text *out, const char *text)
{
  for (; *text; text++) text_add(out, *text == '|' ? "\\|" : "%c", *text);
}

static void put_type(Text *out, const Field *f)
{
  char name[40];
  switch (f->type) {
  case FIELD_real: text_add(out, "number"); return;
  case FIELD_integer: text_add(out, "whole number"); return;
  case FIELD_flag: text_add(out, "`true` or `false`"); return;
  case FIELD_color: text_add(out, "colour"); return;
  case FIELD_vec2: text_add(out, "2 numbers"); return;
  case FIELD_vec3: text_add(out, "vec3"); return;
  case FIELD_size: text_add(out, "2 whole numbers"); return;
  case FIELD_matrix: text_add(out, "matrix"); return;
  case FIELD_text: text_add(out, "text"); return;
  case FIELD_file: text_add(out, "file name"); return;
  case FIELD_texture: text_add(out, "texture"); return;
  case FIELD_object: text_add(out, "object"); return;
  case FIELD_material: text_add(out, "material"); return;
  case FIELD_path: text_add(out, "path"); return;
  case FIELD_keys: text_add(out, "keys"); return;
  case FIELD_medium: text_add(out, "medium"); return;
  case FIELD_sky: text_add(out, "sky"); return;
  case FIELD_cell: text_add(out, "cell"); return;
  case FIELD_gate: text_add(out, "gate"); return;
  case FIELD_points: text_add(out, "list of 2 numbers"); return;
  case FIELD_choice:
    for (int32_t i = 0; choice_name(f, i, name); i++) text_add(out, "%s`%s`", i ? ", " : "", name);
    return;
  }
}

static void put_field(Text *out, const Field *f, const void *at)
{
  text_add(out, "| `%s` | ", f->name);
  put_type(out, f);
  text_add(out, " | ");
  Text value = {0};
  value_write(NULL, f, at, &value, NULL);
  if (strcmp(text_get(&value), "null")) text_add(out, "`%s`", text_get(&value));
  text_finish(&value);
  text_add(out, " | ");
  Text range = {0};
  value_range(f, &range);
  const bool has_unit = f->type != FIELD_choice && f->unit[0];
  text_add(out, "%s", range.length ? text_get(&range) : has_unit ? f->unit : "");
  text_finish(&range);
  text_add(out, " | ");
  put_cell(out, f->sentence);
  text_add(out, " |\n");
}

static void put_table_head(Text *out)
{
  text_add(out, "| field | type | default | range, unit | |\n|---|---|---|---|---|\n");
}

// Rows from one index to another of an object's fields, common ones first.
static void put_fields(Text *out, const Group *g, const void *object, size_t from, size_t to)
{
  if (from == to) return;
  put_table_head(out);
  const Field *f;
  void *at;
  for (size_t i = from; i < to && (f = group_field_at(g, object, i, &at)); i++) put_field(out, f, at);
  text_add(out, "\n");
}

static void put_mesh_keys(Text *out)
{
  text_add(out, "Instead of a file:\n\n| key | numbers an entry | |\n|---|---|---|\n");
  for (int i = 0; i < MESH_KEY_COUNT; i++)
    text_add(out, "| `%s` | %d | %s%s |\n", mesh_keys[i].name, mesh_keys[i].per, mesh_keys[i].sentence,
             mesh_keys[i].is_required ? "" : " Optional.");
  text_add(out, "\nEach is a flat list, or a list of small lists.\n\n");
}

static void put_voxel_keys(Text *out)
{
  text_add(out, "With a file, or instead of one:\n\n| key | |\n|---|---|\n");
  for (int i = 0; i < VOXEL_KEY_COUNT; i++) text_add(out, "| `%s` | %s |\n", voxel_keys[i].name, voxel_keys[i].sentence);
  text_add(out, "\nWhat stands in them is told under [palette](#palette) and [fill](#fill).\n\n");
}

static void put_key_members(Text *out)
{
  text_add(out, "A key is a dictionary:\n\n| member | |\n|---|---|\n");
  for (int i = 0; i < KEY_MEMBER_COUNT; i++) text_add(out, "| `%s` | %s |\n", key_members[i].name, key_members[i].sentence);
  text_add(out, "\nNumbers, vectors and colours go over from key to key; flags, choices and names jump at their key. A moment is shown\n"
                "by setting fields: what the file says of a field that a track moves holds only until then.\n\n");
}

static void put_kind(Text *out, const Group *g, int32_t kind, void *object)
{
  const Kind *k = &g->kinds[kind];
  group_default(g, kind, object);
  if (g->has_kind)
    text_add(out, "### %s: %s%s\n\n%s\n\n", g->noun, k->name,
             g->kind_optional && !kind ? " (the default kind)" : "", k->sentence);
  put_fields(out, g, object, g->common_count, g->common_count + k->field_count);
  if (g == &group_shape && kind == SHAPE_MESH) put_mesh_keys(out);
  if (g == &group_shape && kind == SHAPE_VOXELS) put_voxel_keys(out);
  if (g == &group_track) put_key_members(out);
}

static const char *form_sentence(SectionForm form)
{
  switch (form) {
  case SECTION_ONE: return "One dictionary.";
  case SECTION_BY_NAME: return "A dictionary: each key is a name.";
  case SECTION_LIST: return "A list; each entry may have a `name`.";
  }
  unreachable();
}

static bool put_group(Text *out, const Group *g, const char *form)
{
  void *object = mem_zero(1, g->size);
  if (!object) return false;
  text_add(out, "## %s\n\n%s %s\n\n", g->name, g->sentence, form);
  group_default(g, 0, object);
  if (g->common_count && g->has_kind) text_add(out, "Every kind has these:\n\n");
  put_fields(out, g, object, 0, g->common_count);
  for (size_t k = 0; k < g->kind_count; k++) put_kind(out, g, (int32_t)k, object);
  mem_free(object);
  if (g == &group_shape)
    return put_group(out, &group_voxel, "A dictionary of shapes of kind `voxels`: each key is a name.") &&
           put_group(out, &group_voxel_step, "A list of shapes of kind `voxels`; edits of voxels are such steps, too.");
  return !g->nested || put_group(out, g->nested, "One dictionary, required in each object.");
}

bool scene_manual(Text *out)
{
  text_add(out, "%s", introduction);
  bool ok = true;
  for (int i = 0; ok && i < SECTION_COUNT; i++) {
    const Section *c = &scene_sections[i];
    if (c->group == &group_cameras)
      text_add(out, "## %s\n\n%s %s They have the same fields as `camera`.\n\n", c->group->name,
               c->group->sentence, form_sentence(c->form));
    else
      ok = put_group(out, c->group, form_sentence(c->form));
  }
  while (out->length && out->data[out->length - 1] == '\n' && out->data[out->length - 2] == '\n')
    out->data[--out->length] = 0;
  return ok && !out->failed;
}
