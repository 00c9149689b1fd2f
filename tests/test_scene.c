// The scene file: what is read, what is refused and where, and that writing it again loses nothing. Wrong types and
// ranges are tried for every field of every kind by walking the same tables as the reader.

#include "tests/test.h"

#include "base/hash.h"
#include "scene/element.h"
#include "scene/mesh_json.h"
#include "tests/scene_sample.h"

#include <sys/stat.h>
#include <time.h>

static void write_scene(const Scene *s, Text *out)
{
  Err err = {0};
  CHECK_MSG(scene_write(s, out, &err), "%s", err.text);
}

// --- what is read ---------------------------------------------------------------------------------
TEST(sample_is_read)
{
  Err err;
  Scene *s = sample_load(sample_scene, &err);
  CHECK_MSG(s, "%s", err.text);
  if (!s) return;
  CHECK(s->render.spp == 16 && s->render.size[0] == 320 && s->render.filter == FILTER_BOX &&
        s->render.seed == 1);
  CHECK(s->develop.tone_curve == TONE_AGX && s->develop.exposure == -1.5f);
  CHECK(s->has_camera && s->has_sky && s->camera.perspective.fov == 35.5f);
  CHECK(s->cameras.count == 1 && s->cameras.items[0].kind == CAMERA_ORTHOGRAPHIC);
  CHECK_NEAR(s->sky.gradient.zenith[0], 0.0423114, 1e-6); // 0x3a through IEC 61966-2-1
  CHECK(s->materials.count == 3 && s->materials.items[0].pbr.roughness_texture == 0);
  CHECK(s->materials.items[1].lambert.albedo_texture == 1 &&
        !strcmp(s->textures.items[1].name, "w\303\266od"));
  CHECK(s->materials.items[1].lambert.albedo[0] == 1 && s->materials.items[1].lambert.albedo[2] == 0);
  const Object *o = s->objects.items;
  CHECK(s->objects.count == 3 && o[0].common.material == 0 && o[1].common.material == 1 &&
        o[2].common.material == -1);
  CHECK(o[0].id && o[1].id && o[0].id != o[1].id && o[1].shape.box.size[2] == 2);
  CHECK(o[1].common.matrix[4] == 2 && o[1].common.matrix[11] == 5 && o[2].shape.mesh_i == 0 &&
        o[2].shape.model_i == -1);
  const MeshData *m = s->meshes.items[0].data;
  CHECK(m->vertex_count == 3 && m->triangle_count == 1 && m->normals[5] == 1 && m->texcoords[0][2] == 1);
  CHECK_NEAR(m->normals[7], sqrt(0.5), 1e-7);
  CHECK(s->lights.count == 2 && s->lights.items[0].rect.radiance[1] == 20 && !s->lights.items[1].name);
  scene_destroy(s);
}

TEST(round_trip_is_identical)
{
  Err err;
  Text first = {0}, second = {0};
  Scene *s = sample_load(sample_scene, &err);
  write_scene(s, &first);
  Scene *t = sample_load(text_get(&first), &err);
  CHECK_MSG(t, "%s", err.text);
  if (t) write_scene(t, &second);
  CHECK_MSG(!strcmp(text_get(&first), text_get(&second)), "%s\n%s", text_get(&first), text_get(&second));
  CHECK_TEXT(text_get(&first), "  \"render\": { \"size\": [320, 200], \"spp\": 16, \"filter\": \"box\" },\n");
  CHECK(!strstr(text_get(&first), "seed")); // only what differs from the defaults
  scene_destroy(s);
  scene_destroy(t);
  text_finish(&first);
  text_finish(&second);
}

TEST(empty_scene_and_given_sections_survive)
{
  static const char *const texts[] = {"{\n  \"rayfold\": 1\n}\n",
                                      "{\n  \"rayfold\": 1,\n  \"camera\": {}\n}\n",
                                      "{\n  \"rayfold\": 1,\n  \"sky\": { \"kind\": \"constant\" }\n}\n"};
  for (size_t i = 0; i < 3; i++) {
    Err err;
    Text out = {0};
    Scene *s = sample_load(texts[i], &err);
    CHECK_MSG(s, "%s", err.text);
    if (!s) continue;
    CHECK(s->has_camera == (i == 1) && s->has_sky == (i == 2));
    write_scene(s, &out);
    CHECK_MSG(!strcmp(text_get(&out), texts[i]), "%s", text_get(&out));
    scene_destroy(s);
    text_finish(&out);
  }
}

static uint32_t random_state = 1;
static uint32_t next_random(void)
{
  return random_state = hash_u32(random_state + 0x9e3779b9u);
}

// Any value the table allows, as raw memory.
static void put_random(Scene *s, const Field *f, void *at)
{
  char name[40];
  int32_t count = 0;
  const double low = fmax(f->low, -1e3), high = fmin(f->high, 1e3);
  const int numbers = f->type == FIELD_vec2     ? 2
                      : f->type == FIELD_real   ? 1
                      : f->type == FIELD_matrix ? 12
                                                : 3;
  switch (f->type) {
  case FIELD_flag: *(bool *)at = next_random() & 1; return;
  case FIELD_choice:
    while (choice_name(f, count, name)) count++;
    *(int32_t *)at = (int32_t)(next_random() % (uint32_t)count);
    return;
  case FIELD_integer:
    *(int32_t *)at = (int32_t)(f->low + (f->high - f->low) * (double)unit_float(next_random()));
    return;
  case FIELD_size:
    for (int i = 0; i < 2; i++) ((int32_t *)at)[i] = 1 + (int32_t)(next_random() % 32768);
    return;
  case FIELD_path:
  case FIELD_keys: return; // tracks are made by hand, in test_animation.c
  case FIELD_text: *(const char **)at = arena_text(&s->arena, "a\ttext"); return;
  case FIELD_file: *(const char **)at = arena_text(&s->arena, "some file.png"); return;
  case FIELD_texture:
    *(int32_t *)at = (int32_t)(next_random() % (uint32_t)(s->textures.count + 1)) - 1;
    return;
  case FIELD_sky:
  case FIELD_cell:
  case FIELD_gate: *(int32_t *)at = -1; return; // see test_worlds.c
  case FIELD_points: return;
  case FIELD_object: *(int32_t *)at = -1; return; // must stand further up, see test_shapes.c
  case FIELD_material:
    *(int32_t *)at = (int32_t)(next_random() % (uint32_t)(s->materials.count + 1)) - 1;
    return;
  case FIELD_medium:
    *(int32_t *)at = (int32_t)(next_random() % (uint32_t)(s->media.count + 1)) - 1;
    return;
  case FIELD_real:
  case FIELD_color:
  case FIELD_vec2:
  case FIELD_vec3:
  case FIELD_matrix:
    for (int i = 0; i < numbers; i++) {
      const float x = (float)(low + (high - low) * (double)unit_float(next_random()));
      ((float *)at)[i] = x < (float)f->low ? (float)f->low : x;
    }
  }
}

static void randomise(Scene *s, const Group *g, void *object)
{
  const Field *f;
  void *at;
  for (size_t i = 0; (f = group_field_at(g, object, i, &at)); i++)
    if (f->type != FIELD_matrix) put_random(s, f, at);
}

static void add_random(Scene *s)
{
  int32_t i;
  for (int k = 0; k < 2; k++)
    if ((i = scene_add_texture(s, (TextureKind)k, NULL)) >= 0)
      randomise(s, &group_texture, &s->textures.items[i]);
  for (int k = 0; k <= MATERIAL_MIX; k++) {
    if ((i = scene_add_material(s, (MaterialKind)k, "m")) < 0) continue;
    randomise(s, &group_material, &s->materials.items[i]);
    if (k == MATERIAL_PRINCIPLED) s->materials.items[i].principled.subsurface = 0; // all that is accepted
    if (k == MATERIAL_MIX && s->materials.items[i].mix.first == i) s->materials.items[i].mix.first = -1;
    if (k == MATERIAL_MIX && s->materials.items[i].mix.second == i) s->materials.items[i].mix.second = -1;
  }
  for (int k = 0; k < 5; k++)
    if ((i = scene_add_medium(s, (MediumKind)k, NULL)) >= 0) randomise(s, &group_medium, &s->media.items[i]);
  for (int k = 0; k < 3; k++)
    if ((i = scene_add_camera(s, (CameraKind)k, NULL)) >= 0)
      randomise(s, &group_camera, &s->cameras.items[i]);
  for (int k = 0; k < 6; k++)
    if ((i = scene_add_light(s, (LightKind)k, "l")) >= 0) randomise(s, &group_light, &s->lights.items[i]);
  for (int k = 1; k < 5; k++) {
    if ((i = scene_add_object(s, (ShapeKind)k, "o")) < 0) continue;
    randomise(s, &group_object, &s->objects.items[i]);
    randomise(s, &group_shape, &s->objects.items[i].shape);
    if (k != SHAPE_SPHERE && k != SHAPE_BOX) s->objects.items[i].common.medium = -1; // all that can be filled
  }
}

TEST(every_field_of_every_kind_survives_writing)
{
  for (int round = 0; round < 20; round++) {
    Err err = {0};
    Scene *s = scene_create(&err), *t;
    Text first = {0}, second = {0};
    add_random(s);
    randomise(s, &group_render, &s->render);
    randomise(s, &group_develop, &s->develop);
    s->has_sky = s->has_camera = true;
    s->sky.kind = round % 3;
    randomise(s, &group_sky, &s->sky);
    write_scene(s, &first);
    t = sample_load(text_get(&first), &err);
    CHECK_MSG(t, "%s\n%s", err.text, text_get(&first));
    if (t) {
      write_scene(t, &second);
      CHECK_MSG(!strcmp(text_get(&first), text_get(&second)), "%s\n%s", text_get(&first), text_get(&second));
      CHECK(!memcmp(&s->render, &t->render, sizeof s->render));
      CHECK(!memcmp(&s->materials.items[0].pbr, &t->materials.items[0].pbr, sizeof(Pbr)));
      CHECK(!memcmp(&s->lights.items[3].rect, &t->lights.items[3].rect, sizeof(LightRect)));
    }
    scene_destroy(s);
    scene_destroy(t);
    text_finish(&first);
    text_finish(&second);
  }
}

// --- what is refused ------------------------------------------------------------------------------
static void check_refused(const char *text, const char *part)
{
  Err err;
  Scene *s = sample_load(text, &err);
  CHECK_MSG(!s && err.kind == ERR_BAD_SCENE && strstr(err.text, part),
            "%.300s\ngave \"%s\" instead of \"%s\"", text, s ? "no error" : err.text, part);
  scene_destroy(s);
}

#define SCENE(rest)    "{ \"rayfold\": 1, " rest " }"
#define MATERIAL(rest) SCENE("\"materials\": { \"m\": { " rest " } }")

TEST(messages_have_place_caret_and_nearest_name)
{
  check_refused("{ \"rayfold\": 1,\n  \"materials\": { \"glass\": { \"kind\": \"glass\" } },\n"
                "  \"objects\": [ { \"shape\": { \"kind\": \"sphere\" }, \"material\": \"galss\" } ] }",
                "sample.json:3:61: material \"galss\" is not defined; did you mean \"glass\"?\n"
                "      \"objects\": [ { \"shape\": { \"kind\": \"sphere\" }, \"material\": \"galss\" } ] }\n"
                "                                                                ^");
  check_refused(MATERIAL("\"kind\": \"pbr\", \"roughness\": 1.5"),
                "roughness must be between 0 and 1, but is 1.5");
  check_refused(SCENE("\"camera\": { \"fov\": 200 }"),
                "1:36: fov must be between 0.01 and 179 deg, but is 200");
  check_refused(MATERIAL("\"kind\": \"pbr\", \"rougness\": 1"), "did you mean \"roughness\"?");
  check_refused(MATERIAL("\"kind\": \"lambert\", \"ior\": 1.5"), "it belongs to kind \"pbr\", \"glass\"");
  check_refused(MATERIAL("\"kind\": \"lamber\""), "did you mean \"lambert\"?");
  check_refused(MATERIAL("\"albedo\": 1"), "a material needs a \"kind\"");
  check_refused(MATERIAL("\"kind\": 7"), "kind must be \"pbr\", \"lambert\"");
  check_refused(SCENE("\"material\": {}"), "did you mean \"materials\"?");
  check_refused(SCENE("\"render\": { \"filter\": \"bxo\" }"),
                "filter must be \"box\", \"blackman_harris\" or "
                "\"gaussian\", but is \"bxo\"; did you mean \"box\"?");
  check_refused(SCENE("\"objects\": [ { \"shape\": { \"kind\": \"disk\", \"radius\": 0 } } ]"),
                "radius must be at least 1e-06 m, but is 0");
  check_refused(SCENE("\"lights\": [ { \"kind\": \"point\", \"position\": [0, true, 0] } ]"),
                "1:64: position must be");
  check_refused(SCENE("\"lights\": [ { \"kind\": \"point\", \"position\": [0, 1e39, 0] } ]"),
                "1:64: position must be");
}

TEST(structure_is_checked)
{
  check_refused("", "the file is empty");
  check_refused(" \n\t ", "the file is empty");
  check_refused("[]", "this is not a scene file");
  check_refused("3", "this is not a scene file");
  check_refused("{}", "\"rayfold\": 1 is missing");
  check_refused("{ \"rayfold\": 2 }", "rayfold must be 1");
  check_refused("{ \"rayfold\": 1, \"rayfold\": 1 }", "not valid JSON");
  check_refused("{ \"rayfold\": 1 } x", "not valid JSON");
  check_refused("{ \"rayfold\": 1, ", "not valid JSON");
  check_refused(SCENE("\"render\": []"), "render must be a dictionary");
  check_refused(SCENE("\"objects\": {}"), "objects must be a list");
  check_refused(SCENE("\"objects\": [ 5 ]"), "1:30: the object must be a dictionary");
  check_refused(SCENE("\"objects\": [ {} ]"), "1:30: this object needs a \"shape\"");
  check_refused(SCENE("\"materials\": { \"\": { \"kind\": \"pbr\" } }"), "must have 1 to 4096 bytes");
  check_refused(MATERIAL("\"kind\": \"pbr\", \"kind\": \"glass\""), "not valid JSON");
  check_refused(MATERIAL("\"kind\": \"pbr\", \"roughness\": NaN"), "not valid JSON");
  check_refused(MATERIAL("\"kind\": \"pbr\", \"roughness\": Infinity"), "not valid JSON");
  check_refused(MATERIAL("\"kind\": \"pbr\", \"roughness\": 1e999"), "not valid JSON");
  check_refused(SCENE("\"render\": { \"seed\": 99999999999999999999999 }"), "not valid JSON");
  check_refused(SCENE("\"render\": { \"seed\": 4294967296 }"), "seed must be between 0 and 2147483647");
  check_refused(SCENE("\"render\": { \"seed\": 1.5 }"), "seed must be a whole number");
  check_refused(SCENE("\"sky\": { \"kind\": \"image\" }"), "needs a \"file\"");
  check_refused(SCENE("\"lights\": [ { \"kind\": \"sun\", \"name\": \"\" } ]"), "name");
  check_refused("{ \"asset\": { \"version\": \"2.0\" } }", "glTF");
}

TEST(impossible_geometry_is_refused)
{
#define OBJECT(rest) SCENE("\"objects\": [ { \"shape\": { \"kind\": \"sphere\" }, " rest " } ]")
  check_refused(OBJECT("\"scale\": 0"), "a scale of 0");
  check_refused(OBJECT("\"scale\": [1, 0, 1]"), "a scale of 0");
  check_refused(OBJECT("\"scale\": 1e-20"), "too small");
  check_refused(OBJECT("\"scale\": 1e20"), "too small or large");
  check_refused(OBJECT("\"matrix\": [1,0,0,0, 0,1,0,0, 0,0,0,0, 0,0,0,1]"), "matrix makes the object flat");
  check_refused(OBJECT("\"matrix\": [0,0,0,0, 0,0,0,0, 0,0,0,0, 0,0,0,1]"), "must not be all zeros");
  check_refused(OBJECT("\"matrix\": [1,0,0,0, 0,1,0,0, 0,0,1,1, 0,0,0,1]"), "the last row of matrix");
  check_refused(OBJECT("\"matrix\": [1,2,3]"), "a list of 16 numbers");
  check_refused(OBJECT("\"matrix\": [1,0,0, 0,1,0, 0,0,1, 0,0,0], \"translate\": [1,0,0]"), "must be absent");
  check_refused(SCENE("\"camera\": { \"position\": [1,1,1], \"target\": [1,1,1] }"), "looks nowhere");
  check_refused(SCENE("\"camera\": { \"up\": [0,0,0] }"), "must be a direction");
  check_refused(SCENE("\"camera\": { \"up\": [0,0,-3] }"), "parallel");
  check_refused(SCENE("\"lights\": [ { \"kind\": \"spot\", \"position\": [0,0,0] } ]"), "shines nowhere");
  check_refused(SCENE("\"lights\": [ { \"kind\": \"sun\", \"direction\": [0,0,0] } ]"), "must not be zero");
}

TEST(inline_meshes_are_checked)
{
#define MESH(rest) SCENE("\"objects\": [ { \"shape\": { \"kind\": \"mesh\", " rest " } } ]")
#define TRIANGLE   "\"positions\": [0,0,0, 1,0,0, 0,1,0], \"triangles\": [0,1,2]"
  check_refused(MESH("\"normals\": [0,0,1]"), "needs positions");
  check_refused(MESH("\"positions\": [0,0,0, 1,0,0, 0,1,0]"), "needs triangles");
  check_refused(MESH("\"positions\": [0,0], \"triangles\": [0,1,2]"), "3 an entry");
  check_refused(MESH("\"positions\": [[0,0]], \"triangles\": [0,1,2]"), "a list of 3 numbers");
  check_refused(MESH("\"positions\": [], \"triangles\": []"), "needs positions");
  check_refused(MESH("\"positions\": [0,0,0, 1,0,0, 0,1,null], \"triangles\": [0,1,2]"), "must hold numbers");
  check_refused(MESH("\"positions\": [0,0,0, 1,0,0, 0,1,1e60], \"triangles\": [0,1,2]"), "must hold numbers");
  check_refused(MESH("\"positions\": [0,0,0, 1,0,0, 0,1,0], \"triangles\": [0,1,3]"), "names vertex 3");
  check_refused(MESH("\"positions\": [0,0,0, 1,0,0, 0,1,0], \"triangles\": [0,1,-1]"),
                "must hold vertex numbers");
  check_refused(MESH("\"positions\": [0,0,0, 1,0,0, 0,1,0], \"triangles\": [0,1,0.5]"),
                "must hold vertex numbers");
  check_refused(MESH(TRIANGLE ", \"normals\": [0,0,1]"), "normals are for 1 vertices, but there are 3");
  check_refused(MESH(TRIANGLE ", \"normals\": [0,0,0, 0,0,1, 0,0,1]"), "normal 0 is zero");
  check_refused(MESH(TRIANGLE ", \"file\": \"x.ply\""), "not both");
  check_refused(MESH(TRIANGLE ", \"mesh\": 0"), "not a field");
  check_refused(SCENE("\"objects\": [ { \"shape\": { \"kind\": \"mesh\" } } ]"), "needs a \"file\", or");
  check_refused(SCENE("\"objects\": [ { \"shape\": { \"kind\": \"box\", " TRIANGLE " } } ]"), "not a field");
}

// A dictionary of the kind with every file it needs, up to its closing brace.
static void put_kind(Text *out, const Group *g, const Kind *k)
{
  text_add(out, "{");
  if (g->has_kind) text_add(out, "\"kind\":\"%s\",", k->name);
  for (size_t i = 0; i < k->field_count; i++)
    if (k->fields[i].type == FIELD_file && g != &group_shape)
      text_add(out, "\"%s\":\"x\",", k->fields[i].name);
  if (g->nested) text_add(out, "\"%s\":{\"kind\":\"sphere\"},", g->nested->name);
}

// A whole scene in which one field has this value; *column is where the value stands.
static void put_scene_with(Text *out, const Section *c, const Kind *k, bool in_nested, const Field *f,
                           const char *value, int *column)
{
  const Group *g = c->group;
  text_clear(out);
  text_add(out, "{\"rayfold\":1,\"%s\":%s", g->name,
           c->form == SECTION_LIST ? "["
           : c->form               ? "{\"x\":"
                                   : "");
  if (in_nested) {
    text_add(out, "{\"%s\":", g->nested->name);
    put_kind(out, g->nested, k);
  } else {
    put_kind(out, g, k);
  }
  if (f->type == FIELD_file) { // it stands there already
    while (out->data[out->length - 1] != '{') out->data[--out->length] = 0;
    text_add(out, "\"kind\":\"%s\",", k->name);
  }
  text_add(out, "\"%s\":", f->name);
  *column = (int)out->length + 1;
  text_add(out, "%s}%s%s}", value, in_nested ? "}" : "", c->form == SECTION_LIST ? "]" : c->form ? "}" : "");
}

static void check_value_refused(const Section *c, const Kind *k, bool in_nested, const Field *f,
                                const char *value, bool at_item)
{
  Text text = {0};
  char place[40];
  int column;
  Err err;
  put_scene_with(&text, c, k, in_nested, f, value, &column);
  Scene *s = sample_load(text_get(&text), &err);
  CHECK_MSG(!s, "%s was accepted: %s", value, text_get(&text));
  snprintf(place, sizeof place, "sample.json:1:%d:", column + at_item);
  CHECK_MSG(s || strstr(err.text, place), "%s lacks %s", err.text, place);
  CHECK_MSG(s || strstr(err.text, f->name), "%s", err.text);
  scene_destroy(s);
  text_finish(&text);
}

static void refuse_values(const Section *c, const Kind *k, bool in_nested, const Field *f)
{
  static const char *const wrong[] = {"{}", "true", "\"no such name\"", "7", "[]", "[1,2,3,4,5]"};
  const bool is_number = f->type == FIELD_real || f->type == FIELD_integer;
  const bool is_three = f->type == FIELD_color || f->type == FIELD_vec3;
  const bool is_text = f->type == FIELD_text || f->type == FIELD_file;
  if (f->type == FIELD_path || f->type == FIELD_keys) return; // test_animation.c
  for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
    if ((i == 1 && f->type == FIELD_flag) || (i == 3 && (is_number || is_three)) || (i == 2 && is_text))
      continue;
    check_value_refused(c, k, in_nested, f, wrong[i], f->type == FIELD_points && i == 5); // a list, of what is none
  }
  const bool may_be_null =
      is_text || f->type == FIELD_matrix || f->type == FIELD_texture ||
      f->type == FIELD_material || f->type == FIELD_medium || f->type == FIELD_object ||
      f->type == FIELD_sky || f->type == FIELD_cell || f->type == FIELD_gate;
  if (!may_be_null) check_value_refused(c, k, in_nested, f, "null", false);
  if (!is_number && !is_three && f->type != FIELD_vec2 && f->type != FIELD_size) return;
  const int count = is_number ? 1 : f->type == FIELD_vec2 || f->type == FIELD_size ? 2 : 3;
  const double outside[] = {f->low > -(double)NO_LIMIT ? f->low - 1 : -1e39,
                            f->high < (double)NO_LIMIT ? f->high + 1 : 1e39};
  for (int i = 0; i < 2; i++) {
    char value[100], *at = value;
    if (count > 1) *at++ = '[';
    for (int n = 0; n < count; n++) at += snprintf(at, 30, "%s%.9g", n ? "," : "", outside[i]);
    if (count > 1) snprintf(at, 3, "]");
    check_value_refused(c, k, in_nested, f, value, count > 1);
  }
}

static void refuse_table(const Section *c, const Kind *k, bool in_nested, const Field *fields, size_t count)
{
  for (size_t i = 0; i < count; i++) refuse_values(c, k, in_nested, &fields[i]);
}

TEST(every_field_refuses_wrong_types_and_ranges)
{
  for (int i = 0; i < SECTION_COUNT; i++) {
    const Section *c = &scene_sections[i];
    const Group *g = c->group;
    refuse_table(c, &g->kinds[0], false, g->common, g->common_count);
    for (size_t k = 0; k < g->kind_count; k++)
      refuse_table(c, &g->kinds[k], false, g->kinds[k].fields, g->kinds[k].field_count);
    for (size_t k = 0; g->nested && k < g->nested->kind_count; k++)
      refuse_table(c, &g->nested->kinds[k], true, g->nested->kinds[k].fields,
                   g->nested->kinds[k].field_count);
  }
}

// --- hostile files --------------------------------------------------------------------------------
TEST(missing_file_is_missing)
{
  Err err = {0};
  CHECK(!scene_load(sample_path("nowhere.json"), NULL, &err) && err.kind == ERR_NOT_FOUND);
  CHECK_TEXT(err.text, "there is no such file");
  err = (Err){0};
  const char *text = SCENE("\"objects\": [ { \"shape\": { \"kind\": \"mesh\", \"file\": \"gone.obj\" } } ]");
  CHECK(!sample_load(text, &err) && err.kind == ERR_NOT_FOUND);
  CHECK_TEXT(err.text, "sample.json:1:67: cannot load this model: cannot open");
  CHECK(!sample_load(SCENE("\"objects\": [ { \"shape\": { \"kind\": \"mesh\", \"file\": \"../x.ply\" } } ]"),
                     &err));
  CHECK_TEXT(err.text, "--allow-outside");
}

TEST(deep_nesting_is_refused)
{
  enum { DEPTH = 100000 };
  char *text = malloc(2 * DEPTH);
  Err err;
  memset(text, '[', DEPTH);
  memset(text + DEPTH, ']', DEPTH);
  CHECK(!sample_load_n(text, 2 * DEPTH, &err) && err.kind == ERR_BAD_SCENE);
  for (size_t i = 0; i + 5 <= 2 * DEPTH; i += 5) memcpy(text + i, "{\"a\":", 5);
  CHECK(!sample_load_n(text, 2 * DEPTH, &err) && err.kind == ERR_BAD_SCENE);
  free(text);
}

TEST(every_truncation_is_refused)
{
  Err err;
  const size_t end = strlen(sample_scene) - 2; // the closing brace
  for (size_t n = 0; n <= end; n += 7) {
    Scene *s = sample_load_n(sample_scene, n, &err);
    CHECK_MSG(!s && err.text[0], "cut at %zu", n);
    scene_destroy(s);
  }
}

TEST(random_bytes_do_no_harm)
{
  enum { SIZE = sizeof sample_scene - 1 };
  char *text = malloc(SIZE);
  int accepted = 0;
  for (int round = 0; round < 3000; round++) {
    memcpy(text, sample_scene, SIZE);
    const uint32_t flips = 1 + next_random() % 4;
    for (uint32_t i = 0; i < flips; i++) text[next_random() % SIZE] = (char)next_random();
    Err err;
    Scene *s = sample_load_n(text, SIZE, &err);
    CHECK(s || err.text[0]);
    if (s) {
      Text first = {0}, second = {0};
      accepted++;
      write_scene(s, &first);
      Scene *t = sample_load(text_get(&first), &err);
      CHECK_MSG(t, "%s\n%s", err.text, text_get(&first));
      if (t) write_scene(t, &second);
      CHECK(!strcmp(text_get(&first), text_get(&second)));
      scene_destroy(t);
      text_finish(&first);
      text_finish(&second);
    }
    scene_destroy(s);
  }
  CHECK_MSG(accepted > 10, "%d accepted: the flips are too coarse to test anything", accepted);
  free(text);
}

TEST(huge_text_takes_bounded_time)
{
  enum { SIZE = 50000000 };
  static const char *const heads[] = {"{\"rayfold\":1,\"sky\":{\"kind\":\"image\",\"file\":\"",
                                      "{\"rayfold\":1,\"x", "{\"rayfold\":1,\"materials\":{\"x"};
  char *text = malloc(SIZE);
  const clock_t start = clock();
  for (int i = 0; i < 3; i++) {
    memset(text, 'x', SIZE);
    memcpy(text, heads[i], strlen(heads[i]));
    memcpy(text + SIZE - 8, i == 0 ? "\"     }}" : i == 1 ? "\":0    }" : "\":{}  }}", 8);
    Err err;
    CHECK(!sample_load_n(text, SIZE, &err) && err.kind == ERR_BAD_SCENE);
    CHECK_MSG(strstr(err.text, i == 0   ? "too long"
                               : i == 1 ? "not a section"
                                        : "1 to 4096 bytes"),
              "%.300s", err.text);
    CHECK(strlen(err.text) < 1500);
  }
  CHECK((double)(clock() - start) / CLOCKS_PER_SEC < 20);
  free(text);
}

TEST(bytes_that_are_not_utf8_are_refused)
{
  check_refused(SCENE("\"materials\": { \"\xff\xfe\": { \"kind\": \"pbr\" } }"), "not valid JSON");
  check_refused(SCENE("\"materials\": { \"a\\u0000b\": { \"kind\": \"pbr\" } }"), "not valid JSON");
  // Names from elsewhere may be no UTF-8: what is written must be.
  Err err = {0};
  Text out = {0};
  Scene *s = scene_create(&err);
  scene_add_material(s, MATERIAL_MIRROR, "caf\xe9 \xc3\xa9 \xed\xa0\x80");
  write_scene(s, &out);
  scene_destroy(s);
  s = sample_load(text_get(&out), &err);
  CHECK_MSG(s && !strncmp(s->materials.items[0].name, "caf\xc3\xa9 \xc3\xa9 ", 8), "%s", err.text);
  scene_destroy(s);
  text_finish(&out);
}

TEST(byte_order_mark_is_skipped)
{
  Err err;
  Scene *s = sample_load("\xef\xbb\xbf{ \"rayfold\": 1 }", &err);
  CHECK_MSG(s, "%s", err.text);
  scene_destroy(s);
}

// --- scenes in scenes -----------------------------------------------------------------------------
static void write_text(const char *name, const char *text)
{
  sample_write(name, text, strlen(text));
}

#define INCLUDES(file) "{ \"shape\": { \"kind\": \"mesh\", \"file\": \"" file "\" } }"

TEST(a_scene_is_loaded_once_and_shared)
{
  write_text("part.json", SCENE("\"objects\": [ { \"shape\": { \"kind\": \"sphere\" } } ]"));
  Err err;
  Scene *s =
      sample_load(SCENE("\"objects\": [ " INCLUDES("part.json") ", " INCLUDES("part.json") " ]"), &err);
  CHECK_MSG(s, "%s", err.text);
  if (!s) return;
  CHECK(s->models.count == 1 && s->objects.items[0].shape.model_i == 0 &&
        s->objects.items[1].shape.model_i == 0);
  CHECK(s->models.items[0].scene->objects.count == 1 && !s->models.items[0].scene->has_camera);
  scene_destroy(s);
}

TEST(a_scene_that_contains_itself_is_refused)
{
  Err err;
  CHECK(!sample_load(SCENE("\"objects\": [ " INCLUDES("sample.json") " ]"), &err) &&
        err.kind == ERR_BAD_SCENE);
  CHECK_TEXT(err.text, "a scene must not contain itself");
  write_text("other.json", SCENE("\"objects\": [ " INCLUDES("./link.json") " ]"));
  CHECK(!symlink("sample.json", sample_path("link.json")));
  CHECK(!sample_load(SCENE("\"objects\": [ " INCLUDES("other.json") " ]"), &err));
  CHECK_TEXT(err.text, "sample.json\" -> \"");
  CHECK_TEXT(err.text, "other.json\" -> \"");
}

TEST(deep_and_wide_inclusion_is_bounded)
{
  char name[40], text[400];
  for (int i = 0; i <= 20; i++) { // a chain of 20
    snprintf(name, sizeof name, "chain%d.json", i);
    if (i == 20)
      snprintf(text, sizeof text, "{ \"rayfold\": 1 }");
    else
      snprintf(text, sizeof text,
               "{\"rayfold\":1,\"objects\":[{\"shape\":{\"kind\":\"mesh\",\"file\":\"chain%d.json\"}}]}",
               i + 1);
    write_text(name, text);
  }
  Err err = {0};
  CHECK(!scene_load(sample_path("chain0.json"), NULL, &err));
  CHECK_TEXT(err.text, "nested more than 16 deep");
  for (int i = 0; i < 15; i++) // each of two names the next two: 2^14 loads if nobody counts
    for (int k = 0; k < 2; k++) {
      snprintf(name, sizeof name, "wide%d%c.json", i, 'a' + k);
      if (i == 14)
        snprintf(text, sizeof text, "{ \"rayfold\": 1 }");
      else
        snprintf(text, sizeof text,
                 "{\"rayfold\":1,\"objects\":[{\"shape\":{\"kind\":\"mesh\",\"file\":\"wide%da.json\"}},"
                 "{\"shape\":{\"kind\":\"mesh\",\"file\":\"wide%db.json\"}}]}",
                 i + 1, i + 1);
      write_text(name, text);
    }
  err = (Err){0};
  CHECK(!scene_load(sample_path("wide0a.json"), NULL, &err));
  CHECK_TEXT(err.text, "more than 1000 files");
}

// --- files and formats ----------------------------------------------------------------------------
TEST(formats_are_told_by_content)
{
  Err err = {0};
  Scene *s = scene_load(sample_write("noname", "{ \"rayfold\": 1 }", 16), NULL, &err);
  CHECK_MSG(s, "%s", err.text);
  scene_destroy(s);
  err = (Err){0};
  CHECK(!scene_load(sample_write("what.xyz", "nothing known", 13), NULL, &err) && err.kind == ERR_BAD_SCENE);
  CHECK_TEXT(err.text, ".json .obj .gltf .glb .ply .stl");
  err = (Err){0};
  CHECK(!scene_load(sample_write("wrong.json", "glTF\2\0\0\0", 8), NULL, &err));
  CHECK_TEXT(err.text, "its content looks like a binary glTF model; rename it to end in .glb");
  err = (Err){0};
  CHECK(!scene_load(sample_write("empty.xyz", "", 0), NULL, &err) && err.kind == ERR_BAD_SCENE);
  static const char *const extensions[] = {"json", "obj", "gltf", "glb", "ply", "stl"};
  for (size_t i = 0; i < sizeof extensions / sizeof *extensions; i++) {
    char name[16];
    snprintf(name, sizeof name, "empty.%s", extensions[i]);
    err = (Err){0};
    CHECK(!scene_load(sample_write(name, "", 0), NULL, &err));
    CHECK_TEXT(err.text, "the file is empty");
    err = (Err){0};
    CHECK(!scene_load(sample_write(name, "\xff\xfev\0 \0", 6), NULL, &err));
    CHECK_TEXT(err.text, "UTF-16");
  }
}

TEST(named_files_are_checked_on_demand)
{
  Err err;
  Scene *s = sample_load(sample_scene, &err);
  Text path = {0};
  CHECK(!scene_check_files(s, &err) && err.kind == ERR_NOT_FOUND);
  CHECK_TEXT(err.text, "textures.\"w\303\266od\": cannot open");
  CHECK(scene_file_path(s, "a/b.png", NULL, &path, &err));
  CHECK(!strncmp(text_get(&path), sample_folder, strlen(sample_folder)) &&
        strstr(text_get(&path), "/a/b.png"));
  err = (Err){0};
  CHECK(!scene_file_path(s, "../b.png", NULL, &path, &err));
  write_text("w\303\266od.png", "not looked at");
  err = (Err){0};
  CHECK_MSG(scene_check_files(s, &err), "%s", err.text);
  scene_destroy(s);
  text_finish(&path);
}

// --- memory ---------------------------------------------------------------------------------------
TEST(every_allocation_may_fail)
{
  const char *path = sample_write("memory.json", sample_scene, strlen(sample_scene));
  Err err = {0};
  long n = 1;
  for (;; n++) {
    err = (Err){0};
    Text out = {0};
    mem_fail_after(n);
    Scene *s = scene_load(path, NULL, &err);
    const bool loaded = s != NULL, ok = s && scene_write(s, &out, &err);
    mem_fail_after(0);
    scene_destroy(s);
    text_finish(&out);
    if (ok) break;
    CHECK_MSG(err.kind == ERR_NO_MEMORY, "%ld: %s %s", n, loaded ? "write" : "load", err.text);
    if (n > 2000) break;
  }
  CHECK(n > 20 && n < 2000);
}

TEST(clean_up)
{
  sample_remove();
}

TEST_MAIN
