// See pages.h. The schema says what the reader accepts, except for what only the reader can know: that a name is
// defined, that a file exists, and the checks of element_check.c.

#include "base/mem.h"
#include "base/number.h"
#include "scene/json.h"
#include "scene/keys.h"
#include "scene/mesh_json.h"
#include "scene/voxels_json.h"
#include "scene/pages.h"
#include "scene/value.h"

#include <string.h>

static void put_member(Text *out, const char *key, const char *text)
{
  text_add(out, ",\"%s\":", key);
  js_put_text(out, text);
}

static void put_limit(Text *out, const char *key, double x)
{
  if (x >= (double)NO_LIMIT || x <= -(double)NO_LIMIT) return;
  char digits[NUMBER_SIZE];
  number_format(digits, (float)x);
  if (x == (double)(int64_t)x)
    text_add(out, ",\"%s\":%lld", key, (long long)x);
  else
    text_add(out, ",\"%s\":%s", key, digits);
}

static void put_number(Text *out, const Field *f, const char *type)
{
  text_add(out, "\"type\":\"%s\"", type);
  put_limit(out, "minimum", f->low);
  put_limit(out, "maximum", f->high);
}

static void put_list(Text *out, const Field *f, const char *type, int count)
{
  text_add(out, "\"type\":\"array\",\"minItems\":%d,\"maxItems\":%d,\"items\":{", count, count);
  put_number(out, f, type);
  text_add(out, "}");
}

// Forms of a colour or a vec3: alternatives in which exactly one matches.
static void put_three(Text *out, const Field *f)
{
  text_add(out, "\"oneOf\":[{");
  put_list(out, f, "number", 3);
  text_add(out, "},{");
  put_number(out, f, "number");
  text_add(out, "}");
  if (f->type == FIELD_color)
    text_add(out, ",{\"type\":\"string\",\"pattern\":\"^#([0-9a-fA-F]{3}|[0-9a-fA-F]{6})$\"}");
  text_add(out, "]");
}

static void put_choices(Text *out, const Field *f)
{
  char name[40];
  text_add(out, "\"enum\":[");
  for (int32_t i = 0; choice_name(f, i, name); i++) {
    if (i) text_add(out, ",");
    js_put_text(out, name);
  }
  text_add(out, "]");
}

static void put_keys(Text *out)
{
  text_add(out, "\"type\":\"array\",\"minItems\":1,\"items\":{\"type\":\"object\",\"properties\":{");
  for (int i = 0; i < KEY_MEMBER_COUNT; i++) {
    text_add(out, "%s\"%s\":{%s", i ? "," : "", key_members[i].name, key_members[i].schema);
    text_add(out, "%s\"description\":", key_members[i].schema[0] ? "," : "");
    js_put_text(out, key_members[i].sentence);
    text_add(out, "}");
  }
  text_add(out, "},\"required\":[\"time\",\"value\"],\"additionalProperties\":false}");
}

static void put_type(Text *out, const Field *f)
{
  switch (f->type) {
  case FIELD_real: put_number(out, f, "number"); return;
  case FIELD_integer: put_number(out, f, "integer"); return;
  case FIELD_flag: text_add(out, "\"type\":\"boolean\""); return;
  case FIELD_color:
  case FIELD_vec3: put_three(out, f); return;
  case FIELD_vec2: put_list(out, f, "number", 2); return;
  case FIELD_size: put_list(out, f, "integer", 2); return;
  case FIELD_matrix:
    text_add(out, "\"oneOf\":[{\"type\":\"null\"},{");
    put_list(out, f, "number", 12);
    text_add(out, "},{");
    put_list(out, f, "number", 16);
    text_add(out, "}]");
    return;
  case FIELD_keys: put_keys(out); return;
  case FIELD_points:
    text_add(out, "\"type\":[\"array\",\"null\"],\"minItems\":%d,\"maxItems\":%d,\"items\":{\"type\":\"array\","
                  "\"items\":{\"type\":\"number\"},\"minItems\":2,\"maxItems\":2}",
             LEAST_POINTS, MOST_POINTS);
    return;
  case FIELD_text: text_add(out, "\"type\":[\"string\",\"null\"],\"maxLength\":%d", LONGEST_TEXT); return;
  case FIELD_file:
  case FIELD_path:
    text_add(out, "\"type\":\"string\",\"minLength\":1,\"maxLength\":%d", LONGEST_TEXT);
    return;
  case FIELD_choice: put_choices(out, f); return;
  case FIELD_texture:
  case FIELD_object:
  case FIELD_material:
  case FIELD_sky:
  case FIELD_cell:
  case FIELD_gate:
  case FIELD_medium: text_add(out, "\"type\":[\"string\",\"null\"]"); return;
  }
}

static const char *type_name(FieldType type)
{
  switch (type) {
  case FIELD_real: return "real";
  case FIELD_integer: return "integer";
  case FIELD_flag: return "flag";
  case FIELD_color: return "color";
  case FIELD_vec2: return "vec2";
  case FIELD_vec3: return "vec3";
  case FIELD_size: return "size";
  case FIELD_matrix: return "matrix";
  case FIELD_text: return "text";
  case FIELD_file: return "file";
  case FIELD_choice: return "choice";
  case FIELD_texture: return "texture";
  case FIELD_object: return "object";
  case FIELD_material: return "material";
  case FIELD_path: return "path";
  case FIELD_keys: return "keys";
  case FIELD_medium: return "medium";
  case FIELD_sky: return "sky";
  case FIELD_cell: return "cell";
  case FIELD_gate: return "gate";
  case FIELD_points: return "points";
  }
  unreachable();
}

static void put_field(Text *out, const Field *f, const void *at)
{
  js_put_text(out, f->name);
  text_add(out, ":{");
  put_type(out, f);
  text_add(out, ",\"default\":");
  value_write(NULL, f, at, out, NULL);
  const bool has_unit = f->type != FIELD_choice && f->unit[0];
  Text sentence = {0};
  text_add(&sentence, has_unit ? "%s In %s." : "%s", f->sentence, f->unit);
  put_member(out, "description", text_get(&sentence));
  text_finish(&sentence);
  text_add(out, ",\"x-rayfold\":{\"type\":\"%s\"", type_name(f->type));
  if (has_unit) put_member(out, "unit", f->unit);
  text_add(out, "}}");
}

static void put_mesh_keys(Text *out)
{
  for (int i = 0; i < MESH_KEY_COUNT; i++) {
    const MeshKey *k = &mesh_keys[i];
    const char *type = k->is_index ? "integer" : "number";
    text_add(out,
             ",\"%s\":{\"type\":\"array\",\"minItems\":1,\"items\":{\"oneOf\":[{\"type\":\"%s\"},"
             "{\"type\":\"array\",\"minItems\":%d,\"maxItems\":%d,\"items\":{\"type\":\"%s\"}}]}",
             k->name, type, k->per, k->per, type);
    put_member(out, "description", k->sentence);
    text_add(out, "}");
  }
}

static void put_voxel_keys(Text *out)
{
  for (int i = 0; i < VOXEL_KEY_COUNT; i++) {
    const VoxelKey *k = &voxel_keys[i];
    text_add(out, ",\"%s\":{\"type\":\"%s\",%s", k->name, k->type, k->schema);
    put_member(out, "description", k->sentence);
    text_add(out, "}");
  }
}

static void put_required(Text *out, const Group *g, const Kind *k, bool is_mesh)
{
  const char *comma = "";
  text_add(out, ",\"required\":[");
  if (g->has_kind && !(g->kind_optional && k == g->kinds)) text_add(out, "\"kind\""), comma = ",";
  if (g->nested) text_add(out, "%s\"%s\"", comma, g->nested->name), comma = ",";
  for (size_t i = 0; i < k->field_count; i++)
    if (field_is_required(&k->fields[i]) && !is_mesh && g != &group_light && g != &group_shape)
      text_add(out, "%s\"%s\"", comma, k->fields[i].name), comma = ",";
  text_add(out, "]");
  if (!is_mesh) return;
  text_add(out, ",\"oneOf\":[{\"required\":[\"%s\"]},{\"required\":[\"%s\",\"%s\"]}]", k->fields[0].name,
           mesh_keys[0].name, mesh_keys[1].name);
}

static void put_kind(Text *out, const Group *g, int32_t kind, void *object)
{
  const Kind *k = &g->kinds[kind];
  const bool is_mesh = g == &group_shape && kind == SHAPE_MESH;
  group_default(g, kind, object);
  text_add(out, "{\"type\":\"object\"");
  if (k->sentence[0]) put_member(out, "description", k->sentence);
  text_add(out, ",\"properties\":{");
  const char *comma = "";
  if (group_is_listed(g))
    text_add(out, "\"name\":{\"type\":\"string\",\"minLength\":1}"), comma = ",";
  if (g->has_kind) {
    text_add(out, "%s\"kind\":{\"const\":", comma);
    js_put_text(out, k->name);
    text_add(out, "}");
    comma = ",";
  }
  if (g->nested)
    text_add(out, "%s\"%s\":{\"$ref\":\"#/$defs/%s\"}", comma, g->nested->name, g->nested->name), comma = ",";
  const Field *f;
  void *at;
  for (size_t i = 0; (f = group_field_at(g, object, i, &at)); i++, comma = ",") {
    text_add(out, "%s", comma);
    put_field(out, f, at);
  }
  if (is_mesh) put_mesh_keys(out);
  if (g == &group_shape && kind == SHAPE_VOXELS) put_voxel_keys(out);
  text_add(out, "}");
  put_required(out, g, k, is_mesh);
  text_add(out, ",\"additionalProperties\":false}");
}

static bool put_group(Text *out, const Group *g)
{
  void *object = mem_zero(1, g->size);
  if (!object) return false;
  text_add(out, ",\"%s\":", g->name);
  if (g->has_kind) text_add(out, "{\"oneOf\":[");
  for (size_t k = 0; k < g->kind_count; k++) {
    if (k) text_add(out, ",");
    put_kind(out, g, (int32_t)k, object);
  }
  if (g->has_kind) text_add(out, "]}");
  mem_free(object);
  return true;
}

static bool put_groups(Text *out)
{
  bool ok = true;
  text_add(out, ",\"$defs\":{\"rayfold\":{\"const\":1}");
  for (int i = 0; ok && i < SECTION_COUNT; i++) {
    const Group *g = scene_sections[i].group;
    ok = put_group(out, g) && (!g->nested || put_group(out, g->nested));
  }
  ok = ok && put_group(out, &group_voxel) && put_group(out, &group_voxel_step);
  text_add(out, "}");
  return ok;
}

static void put_sections(Text *out)
{
  for (int i = 0; i < SECTION_COUNT; i++) {
    const Group *g = scene_sections[i].group;
    text_add(out, ",\"%s\":{\"description\":", g->name);
    js_put_text(out, g->sentence);
    switch (scene_sections[i].form) {
    case SECTION_ONE: text_add(out, ",\"$ref\":\"#/$defs/%s\"}", g->name); break;
    case SECTION_BY_NAME:
      text_add(out,
               ",\"type\":\"object\",\"propertyNames\":{\"minLength\":1},\"additionalProperties\":{\"$ref\":"
               "\"#/$defs/%s\"}}",
               g->name);
      break;
    case SECTION_LIST:
      text_add(out, ",\"type\":\"array\",\"items\":{\"$ref\":\"#/$defs/%s\"}}", g->name);
      break;
    }
  }
}

bool scene_schema(Text *out)
{
  Text compact = {0};
  text_add(&compact,
           "{\"$schema\":\"https://json-schema.org/draft/2020-12/schema\",\"title\":\"Rayfold scene\","
           "\"type\":\"object\",\"required\":[\"rayfold\"],\"additionalProperties\":false,\"properties\":{"
           "\"rayfold\":{\"const\":1,\"description\":\"The version of the format.\"}");
  put_sections(&compact);
  text_add(&compact, "}");
  const bool ok = put_groups(&compact);
  text_add(&compact, "}");
  js_layout(out, text_get(&compact));
  const bool failed = compact.failed || out->failed;
  text_finish(&compact);
  return ok && !failed;
}
