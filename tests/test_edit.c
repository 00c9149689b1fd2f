// The edit language: every field set and got back, errors that change nothing, references that stay right, and undo
// that ends where it began.

#include "tests/test.h"

#include "base/hash.h"
#include "scene/edit.h"
#include "tests/scene_sample.h"

static const char part_scene[] = "{\"rayfold\":1,\"objects\":[{\"shape\":{\"kind\":\"box\"}}]}";

static Scene *load_sample(void)
{
  Err err;
  Scene *s = sample_load(sample_scene, &err);
  if (!s) abort();
  return s;
}

static void write_scene(const Scene *s, Text *out)
{
  Err err = {0};
  text_clear(out);
  CHECK_MSG(scene_write(s, out, &err), "%s", err.text);
}

static void check_get(const Scene *s, const char *path, const char *wanted)
{
  Err err = {0};
  Text out = {0};
  CHECK_MSG(scene_get(s, path, &out, &err), "%s", err.text);
  CHECK_MSG(!strcmp(text_get(&out), wanted), "%s is %s, not %s", path, text_get(&out), wanted);
  text_finish(&out);
}

static void check_set(Scene *s, const char *path, const char *json, const char *wanted)
{
  Err err = {0};
  CHECK_MSG(scene_set(s, path, json, &err), "%s = %s: %s", path, json, err.text);
  if (wanted) check_get(s, path, wanted);
}

// The edit is refused with this part in its message, and the scene stays as it was.
static void check_refused(Scene *s, const char *path, const char *json, const char *part)
{
  Text before = {0}, after = {0};
  Err err = {0};
  write_scene(s, &before);
  CHECK_MSG(!scene_set(s, path, json, &err), "%s = %s was accepted", path, json);
  CHECK_MSG(strstr(err.text, part), "%s = %s: \"%s\" lacks \"%s\"", path, json, err.text, part);
  write_scene(s, &after);
  CHECK_MSG(!strcmp(text_get(&before), text_get(&after)), "%s = %s failed and changed the scene", path, json);
  text_finish(&before);
  text_finish(&after);
}

TEST(paths_of_all_forms)
{
  Scene *s = load_sample();
  check_set(s, "render.spp", "7", "7");
  check_set(s, "camera.position", "[1, 2, 3]", "[1,2,3]");
  check_set(s, "camera.position.1", "2.5", "2.5");
  check_get(s, "camera.position", "[1,2.5,3]");
  check_set(s, "camera.position.z", "9", "9");
  check_set(s, "render.size.0", "640", "640");
  check_get(s, "render.size", "[640,200]");
  check_set(s, "materials.gold.base_color.g", "0.5", "0.5");
  check_set(s, "materials.gold.roughness", "0.25", "0.25");
  check_set(s, "materials.\"my mat\".albedo", "0.5", "[0.5,0.5,0.5]");
  check_set(s, "materials.\"a.b\\\"c\".ior", "1.25", "1.25");
  check_set(s, "textures.\"w\\u00f6od\".wrap_u", "clamp", "\"clamp\"");
  check_set(s, "objects.ball.shape.radius", "2", "2");
  check_set(s, "objects[0].translate", "[1,1,1]", "[1,1,1]");
  check_set(s, "lights[0].size.y", "0.125", "0.125");
  check_set(s, "lights.lamp.radiance", "[1,2,3]", "[1,2,3]");
  check_set(s, "cameras.top.height", "5", "5");
  check_set(s, "sky.gain", "2", "2");
  check_set(s, "objects.ball.material", "my mat", "\"my mat\"");
  check_set(s, "objects.ball.material", "null", "null");
  check_set(s, "objects[2].matrix", "[1,0,0,0,0,1,0,0,0,0,1,0,7,8,9,1]", "[1,0,0,0,0,1,0,0,0,0,1,0,7,8,9,1]");
  check_set(s, "objects[2].matrix", "null", "null");
  scene_destroy(s);
}

TEST(text_needs_no_quotes)
{
  Scene *s = load_sample();
  check_set(s, "materials.gold.base_color", "#ff0000", "[1,0,0]");
  check_set(s, "materials.gold.base_color", "\"#00f\"", "[0,0,1]");
  check_set(s, "sky", "{\"kind\": \"image\", \"file\": \"a.exr\"}",
            "{\"kind\":\"image\",\"file\":\"a.exr\"}");
  check_set(s, "sky.file", "my sky.exr", "\"my sky.exr\"");
  check_set(s, "render.filter", "gaussian", "\"gaussian\"");
  scene_destroy(s);
}

TEST(null_is_the_default)
{
  Scene *s = load_sample();
  check_set(s, "materials.gold.roughness", "null", "0.5");
  check_set(s, "render.spp", "null", "64");
  check_set(s, "camera.fov", "null", "45");
  check_set(s, "camera", "null", "{}");
  CHECK(!s->has_camera);
  check_set(s, "camera.fov", "30", "30");
  CHECK(s->has_camera);
  scene_destroy(s);
}

TEST(whole_things_come_and_go)
{
  Scene *s = load_sample();
  check_set(s, "materials.steel", "{\"kind\":\"mirror\"}", "{\"kind\":\"mirror\"}");
  check_set(s, "objects.new", "{\"shape\":{\"kind\":\"disk\"},\"material\":\"steel\"}",
            "{\"name\":\"new\",\"shape\":{\"kind\":\"disk\"},\"material\":\"steel\"}");
  CHECK(s->objects.count == 4 && s->objects.items[3].id > s->objects.items[2].id);
  check_set(s, "objects[4]", "{\"shape\":{\"kind\":\"box\"}}", "{\"shape\":{\"kind\":\"box\"}}");
  const uint32_t id = s->objects.items[0].id;
  check_set(s, "objects.ball", "{\"shape\":{\"kind\":\"quad\"}}",
            "{\"name\":\"ball\",\"shape\":{\"kind\":\"quad\"}}");
  CHECK(s->objects.items[0].id == id);
  check_set(s, "objects[0].shape", "{\"kind\":\"sphere\",\"radius\":3}",
            "{\"kind\":\"sphere\",\"radius\":3}");
  check_set(s, "lights.lamp", "null", NULL);
  CHECK(s->lights.count == 1 && s->lights.items[0].kind == LIGHT_SUN);
  // Removing a material in the middle leaves the others' users right.
  check_set(s, "objects[1].material", "steel", "\"steel\"");
  check_set(s, "materials.\"my mat\"", "null", NULL);
  check_get(s, "objects[1].material", "\"steel\"");
  check_get(s, "objects.new.material", "\"steel\"");
  check_refused(s, "materials.steel", "null",
                "materials.steel: this material is still used by objects.\"my box\"");
  check_refused(s, "textures.tiles", "null", "this texture is still used by materials.gold");
  scene_destroy(s);
}

TEST(names_and_kinds_change)
{
  Scene *s = load_sample();
  check_set(s, "materials.gold.name", "brass", NULL);
  check_get(s, "objects.ball.material", "\"brass\""); // references are by index
  check_refused(s, "materials.brass.name", "my mat", "there is a material \"my mat\" already");
  check_set(s, "objects.ball.name", "null", NULL);
  check_get(s, "objects[0].name", "null");
  // pbr and glass share ior, roughness and the attenuation.
  check_set(s, "materials.brass.ior", "2", "2");
  check_set(s, "materials.brass.kind", "glass", "\"glass\"");
  check_get(s, "materials.brass", "{\"kind\":\"glass\",\"ior\":2,\"roughness\":0.2}");
  check_set(s, "objects[0].shape.kind", "disk", "\"disk\"");
  check_get(s, "objects[0].shape", "{\"kind\":\"disk\",\"radius\":0.5}");
  check_refused(s, "materials.brass.kind", "glas", "did you mean \"glass\"?");
  check_refused(s, "sky.kind", "image", "needs a \"file\"");
  scene_destroy(s);
}

TEST(errors_name_path_and_nearest_name)
{
  Scene *s = load_sample();
  check_refused(s, "", "1", "name one thing");
  check_refused(s, "materials", "{}", "name one thing");
  check_refused(s, "material.gold", "1",
                "material.gold: there is no section \"material\"; did you mean \"materials\"?");
  check_refused(s, "materials.godl.roughness", "1", "there is no material \"godl\"; did you mean \"gold\"?");
  check_refused(s, "materials.gold.rougness", "1",
                "a material of kind \"pbr\" has no field \"rougness\"; did you mean \"roughness\"?");
  check_refused(s, "materials.gold.roughness", "1.5",
                "materials.gold.roughness: roughness must be between 0 and 1, but is 1.5");
  check_refused(s, "materials.gold.roughness", "rough",
                "roughness must be a number, but is the text \"rough\"");
  check_refused(s, "materials.gold.roughness.0", "1", "has no component");
  check_refused(s, "camera.position.3", "1", "position has no component \"3\"");
  check_refused(s, "camera.position.1.1", "1", "goes on");
  check_refused(s, "camera.fov", "200", "camera.fov: fov must be between 0.01 and 179 deg, but is 200");
  check_refused(s, "objects.ball.radius", "1", "\"radius\" is a field of the shape; write shape.radius");
  check_refused(s, "objects.ball.material", "stone", "material \"stone\" is not defined");
  check_refused(s, "objects[9].material", "gold", "there are 3 objects, counted from 0");
  check_refused(s, "objects[0", "1", "an index is written");
  check_refused(s, "objects[-1]", "1", "an index is written");
  check_refused(s, "objects[99999999999999999999]", "null", "there are 3 objects");
  check_refused(s, "materials.\"gold", "1", "closing quote");
  check_refused(s, "materials..gold", "1", "a name is missing");
  check_refused(s, ".render", "1", "a name is missing");
  check_refused(s, "materials.gold", "{\"kind\":\"pbr\",\"ior\":9}", "ior must be between 1 and 5, but is 9");
  check_refused(s, "materials.gold", "{\"kind\":", "not valid JSON");
  check_refused(s, "materials.gold", "7", "must be a dictionary");
  check_refused(s, "materials.none", "null", "no such thing");
  check_refused(s, "objects.ball.scale", "0", "objects.ball.scale: a scale of 0 makes the object flat");
  check_refused(s, "camera.target", "[0,1,5]", "looks nowhere");
  check_refused(s, "objects[1].translate", "[1,0,0]", "must be absent");
  check_refused(s, "objects.ball.shape", "null", "must be a dictionary");
  check_refused(s, "objects.ball.shape", "{\"kind\":\"mesh\",\"file\":\"gone.obj\"}", "cannot");
  check_refused(s, "objects.ball.shape", "{\"kind\":\"mesh\",\"mesh\":4}", "none of them");
  check_refused(s, "camera.name", "x", "has no field \"name\"");
  Err err = {0};
  Text out = {0};
  CHECK(!scene_get(s, "materials.godl", &out, &err) && !out.length);
  scene_destroy(s);
  text_finish(&out);
}

TEST(meshes_and_models_by_edit)
{
  Scene *s = load_sample();
  check_set(s, "objects.copy", "{\"shape\":{\"kind\":\"mesh\",\"mesh\":0}}", NULL);
  CHECK(s->objects.items[3].shape.mesh_i == 0);
  sample_write("part.json", part_scene, strlen(part_scene));
  check_set(s, "objects.copy.shape.file", "part.json", "\"part.json\"");
  CHECK(s->objects.items[3].shape.mesh_i == -1 && s->objects.items[3].shape.model_i == 0);
  check_set(s, "objects.more", "{\"shape\":{\"kind\":\"mesh\",\"file\":\"part.json\"}}", NULL);
  CHECK(s->models.count == 1 && s->objects.items[4].shape.model_i == 0);
  check_refused(s, "objects.more.shape.file", "sample.json", "a scene must not contain itself");
  check_refused(s, "objects.more.shape.file", "null", "needs a \"file\"");
  scene_destroy(s);
}

// --- every field ----------------------------------------------------------------------------------
static uint32_t random_state = 7;
static uint32_t next_random(void)
{
  return random_state = hash_u32(random_state + 0x9e3779b9u);
}

static double random_number(const Field *f, bool is_whole)
{
  const double low = fmax(f->low, -50), high = fmin(f->high, 50);
  const double x = low + (high - low) * (double)unit_float(next_random());
  if (!strcmp(f->name, "scale") && fabs(x) < 0.1) return 0.5; // 0 would make things flat, and is refused
  // + 0 makes -0 the 0 that it is written as.
  return is_whole ? floor(x) : (double)(float)(round(x * 8) / 8 < low ? high : round(x * 8) / 8) + 0.0;
}

// A MagicaVoxel model of one cell.
static const uint8_t part_vox[] = {'V', 'O', 'X', ' ', 150, 0, 0, 0, 'M', 'A', 'I', 'N', 0, 0, 0, 0, 44, 0, 0, 0,
                                   'S', 'I', 'Z', 'E', 12, 0, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0, 2, 0, 0, 0, 2, 0, 0, 0,
                                   'X', 'Y', 'Z', 'I', 8, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 5};

// A value the table allows, as scene_get() would write it.
static void random_value(const Field *f, char out[300])
{
  char name[40];
  int32_t count = 0;
  const bool is_whole = f->type == FIELD_integer || f->type == FIELD_size;
  switch (f->type) {
  case FIELD_real:
  case FIELD_integer: snprintf(out, 300, "%.9g", random_number(f, is_whole)); return;
  case FIELD_flag: strcpy(out, next_random() & 1 ? "true" : "false"); return;
  case FIELD_vec2:
  case FIELD_size:
    snprintf(out, 300, "[%.9g,%.9g]", random_number(f, is_whole), random_number(f, is_whole));
    return;
  case FIELD_color:
  case FIELD_vec3:
    snprintf(out, 300, "[%.9g,%.9g,%.9g]", random_number(f, false), random_number(f, false),
             random_number(f, false));
    return;
  case FIELD_matrix: strcpy(out, "[2,0,0,0,0,3,0,0,0,0.5,1,0,7,8,9,1]"); return;
  case FIELD_text: strcpy(out, strcmp(f->name, "formula") ? "\"a \\\"text\\\"\"" : "\"x * 2\""); return;
  case FIELD_file: strcpy(out, strstr(f->sentence, "(.vox)") ? "\"part.vox\"" : "\"part.json\""); return;
  case FIELD_sky:
  case FIELD_cell:
  case FIELD_gate:
  case FIELD_object: strcpy(out, "null"); return;
  case FIELD_points: strcpy(out, "[[0,0],[1,0],[0.5,2]]"); return;
  case FIELD_path: strcpy(out, "\"objects.ball.rotate\""); return;
  case FIELD_keys:
    strcpy(out, "[{\"time\":0,\"value\":[0,10,0]},{\"time\":1.5,\"value\":[0,90,0],\"easing\":[0.5,0,0.5,1]}]");
    return;
  case FIELD_texture: strcpy(out, next_random() & 1 ? "\"tiles\"" : "null"); return;
  case FIELD_material: strcpy(out, next_random() & 1 ? "\"my mat\"" : "null"); return;
  case FIELD_medium: // not every shape can be filled
    strcpy(out, next_random() & 1 && !strcmp(f->name, "atmosphere") ? "\"fog\"" : "null");
    return;
  case FIELD_choice:
    while (choice_name(f, count, name)) count++;
    choice_name(f, (int32_t)(next_random() % (uint32_t)count), name);
    snprintf(out, 300, "\"%s\"", name);
  }
}

static int set_fields(Scene *s, const char *path, const Field *fields, size_t count)
{
  for (size_t i = 0; i < count; i++)
    for (int round = 0; round < 5; round++) {
      char field[200], value[300];
      snprintf(field, sizeof field, "%s.%s", path, fields[i].name);
      random_value(&fields[i], value);
      if (!strcmp(fields[i].name, "subsurface")) strcpy(value, "0"); // any other is refused (test_materials.c)
      if (!strcmp(fields[i].name, "wall")) strcpy(value, "false");   // as a closed gate's (test_worlds.c)
      if (fields[i].type == FIELD_matrix) { // not beside the parts of a map
        check_set(s, "objects.t", "{\"shape\":{\"kind\":\"sphere\"}}", NULL);
      }
      check_set(s, field, value, value);
      if (fields[i].type == FIELD_matrix) check_set(s, field, "null", "null");
    }
  return (int)count;
}

TEST(every_field_of_every_kind_is_set_and_got_back)
{
  static const char *const paths[SECTION_COUNT] = {"about", "render", "whitted", "develop",   "camera",
                                                   "cameras.t",   "sky",       "skies.t",
                                                   "cells.t",     "gates.t",   "textures.t",
                                                   "materials.t", "media.t",   "objects.t", "lights.t",
                                                   "timeline",    "animation.t"};
  Scene *s = load_sample();
  int fields = 0;
  sample_write("part.json", part_scene, strlen(part_scene));
  sample_write("part.vox", part_vox, sizeof part_vox);
  for (int i = 0; i < SECTION_COUNT; i++) {
    const Group *g = scene_sections[i].group, *inner = g->nested ? g->nested : g;
    char path[100], whole[200];
    snprintf(path, sizeof path, g->nested ? "%s.%s" : "%s", paths[i], g->nested ? g->nested->name : "");
    for (size_t k = 0; k < inner->kind_count; k++) {
      const FieldType first = inner->kinds[k].field_count ? inner->kinds[k].fields[0].type : FIELD_real;
      snprintf(whole, sizeof whole,
               g->nested         ? "{\"shape\":{\"kind\":\"%s\"%s}}"
               : inner->has_kind ? "{\"kind\":\"%s\"%s}"
                                 : "{}",
               inner->kinds[k].name,
               !strcmp(inner->kinds[k].name, "voxels") ? ",\"size\":[4,4,4]"
               : first == FIELD_file                   ? ",\"file\":\"part.json\""
               : first == FIELD_points                 ? ",\"points\":[[0,0],[1,0],[0,1]]"
                                                       : "");
      if (g == &group_track)
        snprintf(whole, sizeof whole,
                 "{\"path\":\"objects.ball.rotate\",\"keys\":[{\"time\":0,\"value\":[0,0,0]}]}");
      check_set(s, paths[i], whole, NULL);
      fields += set_fields(s, path, inner->kinds[k].fields, inner->kinds[k].field_count);
      if (k + 1 == inner->kind_count) fields += set_fields(s, paths[i], g->common, g->common_count);
    }
  }
  CHECK_MSG(fields > 100, "%d fields only", fields);
  scene_destroy(s);
}

// --- undo -----------------------------------------------------------------------------------------
static void random_edit(History *h, Scene *s)
{
  static const char *const edits[][2] = {
      {"materials.gold", "null"},
      {"materials.new", "{\"kind\":\"mirror\"}"},
      {"materials.gold.name", "brass"},
      {"materials.brass.name", "gold"},
      {"objects.ball", "null"},
      {"objects[0]", "null"},
      {"objects[1]", "null"},
      {"objects.x", "{\"shape\":{\"kind\":\"box\"},\"material\":\"my mat\"}"},
      {"materials.\"my mat\"", "null"},
      {"objects.x", "null"},
      {"objects.x.material", "new"},
      {"objects[0].material", "gold"},
      {"materials.new", "null"},
      {"textures.tiles", "null"},
      {"materials.gold.roughness_texture", "null"},
      {"camera", "null"},
      {"sky", "null"},
      {"sky", "{\"kind\":\"gradient\"}"},
      {"materials.gold.kind", "glass"},
      {"materials.gold.kind", "pbr"},
      {"materials.gold.roughness_texture", "tiles"},
      {"camera.fov", "20"},
      {"lights.lamp", "null"},
      {"lights[0].kind", "sphere"},
      {"lights.l", "{\"kind\":\"point\"}"},
      {"objects[0].shape.kind", "disk"},
      {"objects[1].shape", "{\"kind\":\"mesh\",\"mesh\":0}"},
      {"textures.t", "{\"kind\":\"checker\"}"},
      {"textures.t", "null"},
      {"materials.\"my mat\".albedo_texture", "t"},
      {"objects[0].translate.1", "4"},
      {"objects[0].matrix", "null"},
      {"render.spp", "5"},
      {"cameras.top", "null"},
      {"cameras.c", "{\"fov\":3}"}};
  const uint32_t i = next_random() % (sizeof edits / sizeof *edits);
  Err err = {0};
  const bool ok = history_set(h, s, edits[i][0], edits[i][1], &err);
  CHECK(ok == (err.kind == ERR_NONE));
}

TEST(undoing_all_gives_the_first_bytes_and_redoing_all_the_last)
{
  Text start = {0}, end = {0}, now = {0};
  for (int round = 0; round < 60; round++) {
    Scene *s = load_sample();
    History h = {0};
    Err err = {0};
    const uint32_t id = s->objects.items[0].id;
    write_scene(s, &start);
    for (int i = 0; i < 120; i++) {
      random_edit(&h, s);
      if (next_random() % 5 == 0) history_undo(&h, s, NULL);
      if (next_random() % 9 == 0) history_redo(&h, s, NULL);
    }
    const size_t done = h.done;
    CHECK(done > 10);
    write_scene(s, &end);
    while (h.done) {
      if (!history_undo(&h, s, &err)) break;
    }
    CHECK_MSG(!err.kind, "%s", err.text);
    write_scene(s, &now);
    CHECK_MSG(!strcmp(text_get(&start), text_get(&now)), "%s\n%s", text_get(&start), text_get(&now));
    CHECK(s->objects.items[0].id == id && s->has_camera && s->has_sky);
    CHECK(!history_undo(&h, s, &err) && err.kind == ERR_BAD_ARGUMENT);
    while (h.done < done)
      if (!history_redo(&h, s, NULL)) break;
    write_scene(s, &now);
    CHECK(!strcmp(text_get(&end), text_get(&now)));
    history_finish(&h);
    scene_destroy(s);
  }
  text_finish(&start);
  text_finish(&end);
  text_finish(&now);
}

TEST(undo_gives_materials_back_to_meshes_nobody_shows)
{
  Scene *s = load_sample();
  History h = {0};
  int32_t slots[2] = {2, 0};
  s->meshes.items[0].slots = slots;
  s->meshes.items[0].slot_count = 2;
  Err err = {0};
  CHECK(!history_set(&h, s, "materials.\"a.b\\\"c\"", "null", &err));
  CHECK_TEXT(err.text, "still used by objects[2]");
  err = (Err){0};
  CHECK_MSG(history_set(&h, s, "objects[2]", "null", &err), "%s", err.text);
  CHECK_MSG(history_set(&h, s, "materials.\"a.b\\\"c\"", "null", &err), "%s", err.text);
  CHECK(slots[0] == -1 && slots[1] == 0);
  CHECK(history_undo(&h, s, &err) && history_undo(&h, s, &err) && slots[0] == 2 && slots[1] == 0);
  CHECK(s->objects.count == 3 && s->objects.items[2].shape.mesh_i == 0);
  history_finish(&h);
  scene_destroy(s);
}

TEST(history_is_bounded)
{
  Scene *s = load_sample();
  History h = {0};
  char value[20];
  for (int i = 1; i <= 1500; i++) {
    snprintf(value, sizeof value, "%d", i);
    CHECK(history_set(&h, s, "render.spp", value, NULL));
  }
  CHECK(h.changes.count == 1000 && h.done == 1000);
  while (history_undo(&h, s, NULL)) {}
  CHECK(s->render.spp == 500);
  history_finish(&h);
  scene_destroy(s);
}

TEST(edits_without_memory_change_nothing)
{
  static const char *const edits[][2] = {{"materials.gold.roughness", "1"},
                                         {"objects.ball", "null"},
                                         {"materials.new", "{\"kind\":\"mirror\"}"},
                                         {"sky.kind", "constant"}};
  Text before = {0}, after = {0};
  for (size_t i = 0; i < 4; i++) {
    Scene *s = load_sample();
    write_scene(s, &before);
    for (long n = 1; n < 100; n++) {
      Err err = {0};
      History h = {0};
      mem_fail_after(n);
      const bool ok = history_set(&h, s, edits[i][0], edits[i][1], &err);
      mem_fail_after(0);
      history_finish(&h);
      if (ok) break;
      CHECK_MSG(err.kind == ERR_NO_MEMORY, "%s", err.text);
      write_scene(s, &after);
      CHECK(!strcmp(text_get(&before), text_get(&after)));
      CHECK(n < 50);
    }
    scene_destroy(s);
  }
  text_finish(&before);
  text_finish(&after);
}

TEST(clean_up)
{
  sample_remove();
}

TEST_MAIN
