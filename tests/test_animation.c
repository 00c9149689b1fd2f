// Tests of animation: a track's value at a moment against closed forms, what is refused and where, and that showing a
// moment is nothing but setting fields.

#include "scene/edit.h"
#include "scene/quaternion.h"
#include "scene/track.h"

#include "base/hash.h"

#include "tests/scene_sample.h"
#include "tests/test.h"

#include <math.h>

#define SCENE(more)                                                                                                  \
  "{ \"rayfold\": 1, \"camera\": {}, \"materials\": { \"red\": { \"kind\": \"pbr\" }, \"blue\": { \"kind\": "       \
  "\"lambert\" } },\n"                                                                                               \
  "  \"objects\": [ { \"name\": \"ball\", \"shape\": { \"kind\": \"sphere\" } } ],\n"                                \
  "  \"animation\": [ " more " ] }\n"
#define TRACK(path, more, keys) "{ \"path\": \"" path "\"" more ", \"keys\": [ " keys " ] }"

static Scene *load(const char *text)
{
  Err err;
  Scene *s = sample_load(text, &err);
  CHECK_MSG(s, "%s", err.text);
  return s;
}

static void show(Scene *s, double seconds)
{
  Err err = {0};
  CHECK_MSG(scene_set_time(s, seconds, NULL, &err), "%s", err.text);
}

static const float *translate(Scene *s, double seconds)
{
  show(s, seconds);
  return s->objects.items[0].common.translate;
}

// --- between keys -----------------------------------------------------------------------------------
TEST(keys_are_met_and_joined_as_their_easing_says)
{
  Scene *s = load(SCENE(TRACK("objects.ball.translate", "",
                              "{ \"time\": 1, \"value\": [0, 2, -4] }, { \"time\": 3, \"value\": [1, 0, 4], \"easing\": "
                              "\"step\" },"
                              "{ \"time\": 4, \"value\": 7, \"easing\": \"smooth\" }, { \"time\": 6, \"value\": 8 }")));
  if (!s) return;
  CHECK(translate(s, 0)[1] == 2 && translate(s, 1)[1] == 2 && translate(s, 3)[1] == 0 && translate(s, 4)[1] == 7);
  CHECK(translate(s, 6)[2] == 8 && translate(s, 100)[2] == 8);
  for (int i = 0; i <= 20; i++) {
    const double u = i / 20.0;
    CHECK_NEAR(translate(s, 1 + 2 * u)[1], 2 - 2 * u, 1e-6);
    CHECK_NEAR(translate(s, 1 + 2 * u)[2], -4 + 8 * u, 1e-6);
    if (i < 20) CHECK(translate(s, 3 + u)[0] == 1);
    CHECK_NEAR(translate(s, 4 + 2 * u)[0], 7 + u * u * (3 - 2 * u), 1e-6);
  }
  scene_destroy(s);
}

TEST(catmull_rom_follows_a_parabola)
{
  // Its slope at a key is that of the chord over both neighbours, which for a parabola and keys of one distance is the
  // parabola's own; a cubic with right ends and slopes is then the parabola itself.
  Scene *s = load(SCENE(TRACK("objects.ball.translate", ", \"easing\": \"cubic\"",
                              "{ \"time\": 0, \"value\": [0, 0, 0] }, { \"time\": 1, \"value\": [1, 1, 0] },"
                              "{ \"time\": 2, \"value\": [2, 4, 0] }, { \"time\": 3, \"value\": [3, 9, 0] }, { \"time\": 4, "
                              "\"value\": [4, 16, 0] }")));
  if (!s) return;
  for (int i = 0; i <= 40; i++) {
    const double t = 1 + i / 20.0;
    CHECK_NEAR(translate(s, t)[1], t * t, 1e-5);
    CHECK_NEAR(translate(s, t)[0], t, 1e-6);
  }
  scene_destroy(s);
}

TEST(a_loop_has_no_seam)
{
  // A circle of eight keys, closed: across the seam the curve's slope must not jump.
  Text keys = {0};
  for (int i = 0; i <= 8; i++)
    text_add(&keys, "%s{ \"time\": %d, \"value\": [%.9g, %.9g, 0] }", i ? "," : "", i, cos(i * (double)PI / 4), sin(i * (double)PI / 4));
  Text text = {0};
  text_add(&text, SCENE("{ \"path\": \"objects.ball.translate\", \"easing\": \"cubic\", \"before\": \"loop\", \"after\": "
                        "\"loop\", \"keys\": [%s] }"),
           text_get(&keys));
  Scene *s = load(text_get(&text));
  if (s)
    for (int i = -40; i <= 40; i++) {
      const double t = i / 2.5;
      const float *p = translate(s, t);
      CHECK_NEAR(p[0], cos(t * (double)PI / 4), 0.01);
      CHECK_NEAR(p[1], sin(t * (double)PI / 4), 0.01);
    }
  scene_destroy(s);
  text_finish(&text);
  text_finish(&keys);
}

TEST(a_timing_curve_is_the_bezier_of_css)
{
  Scene *s = load(SCENE(TRACK("objects.ball.translate", "",
                              "{ \"time\": 0, \"value\": 0, \"easing\": [0.25, 0.1, 0.4, 1.5] }, { \"time\": 1, \"value\": "
                              "1 }")));
  if (!s) return;
  for (int i = 1; i < 50; i++) {
    const double b = i / 50.0, r = 1 - b;
    const double x = 3 * r * r * b * 0.25 + 3 * r * b * b * 0.4 + b * b * b;
    const double y = 3 * r * r * b * 0.1 + 3 * r * b * b * 1.5 + b * b * b;
    CHECK_NEAR(translate(s, x)[0], y, 2e-6);
  }
  scene_destroy(s);
}

TEST(a_spline_is_the_formula_of_gltf)
{
  Scene *s = load(SCENE(TRACK("objects.ball.translate", "",
                              "{ \"time\": 1, \"value\": [1, 0, 0], \"out\": [3, 1, 0], \"easing\": \"spline\" },"
                              "{ \"time\": 3, \"value\": [2, 5, 0], \"in\": [-2, 0.5, 0] }")));
  if (!s) return;
  for (int i = 0; i <= 20; i++) {
    const double u = i / 20.0, d = 2;
    const double a = 2 * u * u * u - 3 * u * u + 1, b = d * (u * u * u - 2 * u * u + u), c = -2 * u * u * u + 3 * u * u,
                 e = d * (u * u * u - u * u);
    const float *p = translate(s, 1 + d * u);
    CHECK_NEAR(p[0], a * 1 + b * 3 + c * 2 + e * -2, 1e-5);
    CHECK_NEAR(p[1], b * 1 + c * 5 + e * 0.5, 1e-5);
  }
  scene_destroy(s);
}

// --- beyond keys ------------------------------------------------------------------------------------
TEST(before_and_after_hold_loop_and_swing)
{
  static const char *const names[] = {"hold", "loop", "ping_pong"};
  for (int before = 0; before < 3; before++)
    for (int after = 0; after < 3; after++) {
      Text text = {0};
      text_add(&text, SCENE("{ \"path\": \"camera.fov\", \"before\": \"%s\", \"after\": \"%s\", \"keys\": [ { \"time\": 2, "
                            "\"value\": 20 }, { \"time\": 5, \"value\": 50 } ] }"),
               names[before], names[after]);
      Scene *s = load(text_get(&text));
      for (int i = -60; s && i < 120; i++) {
        const double t = i / 10.0 + 0.05, x = (t - 2) / 3, part = x - floor(x);
        const int beyond = x < 0 ? before : after;
        const double swing = fmod(fabs(floor(x)), 2) == 0 ? part : 1 - part;
        const double u = (x >= 0 && x <= 1) ? x : beyond == 0 ? (x < 0 ? 0 : 1) : beyond == 1 ? part : swing;
        show(s, t);
        CHECK_NEAR(s->camera.perspective.fov, 20 + 30 * u, 1e-4);
      }
      scene_destroy(s);
      text_finish(&text);
    }
}

TEST(a_frame_falls_on_its_key)
{
  // Frame 7 of 24 is at 0.291666...; a key written so must have come by then, and not a frame earlier.
  Scene *s = load(SCENE(TRACK("objects.ball.visible_to_camera", "",
                              "{ \"time\": 0, \"value\": true }, { \"time\": 0.29166667, \"value\": false }")));
  if (!s) return;
  show(s, 6 / 24.0);
  CHECK(s->objects.items[0].common.visible_to_camera);
  show(s, 7 / 24.0);
  CHECK(!s->objects.items[0].common.visible_to_camera);
  scene_destroy(s);
}

// --- turning ----------------------------------------------------------------------------------------
TEST(quaternions_and_angles_are_one_turn)
{
  uint32_t r = 7;
  for (int i = 0; i < 2000; i++) {
    ObjectCommon a = {.scale = {1, 1, 1}}, b = a;
    for (int k = 0; k < 3; k++) a.rotate[k] = unit_float(r = hash_u32(r + 1)) * 720 - 360;
    if (i % 4 == 0) a.rotate[1] = i % 8 ? 90 : -90;
    quaternion_to_angles(quaternion_from_angles(a.rotate), b.rotate);
    const Frame x = object_frame(&a), y = object_frame(&b),
                z = quaternion_frame(quaternion_from_angles(a.rotate), v3_all(1), v3_all(0));
    for (int k = 0; k < 3; k++) {
      CHECK_NEAR(v3_length(frame_vector(&x, v3(k == 0, k == 1, k == 2)) - frame_vector(&y, v3(k == 0, k == 1, k == 2))),
                 0, 1e-5);
      CHECK_NEAR(v3_length(frame_vector(&x, v3(k == 0, k == 1, k == 2)) - frame_vector(&z, v3(k == 0, k == 1, k == 2))),
                 0, 1e-5);
    }
  }
}

TEST(the_shortest_way_round_is_taken_at_even_speed)
{
  Scene *s = load(SCENE(TRACK("objects.ball.rotate", ", \"turn\": \"shortest\"",
                              "{ \"time\": 0, \"value\": [0, 170, 0] }, { \"time\": 1, \"value\": [0, -170, 0] },"
                              "{ \"time\": 2, \"value\": [90, 0, 0] }")));
  if (!s) return;
  for (int i = 0; i <= 10; i++) {
    show(s, i / 10.0);
    const Frame f = object_frame(&s->objects.items[0].common);
    const double angle = (170 + 2.0 * i) * (double)PI / 180;
    CHECK_NEAR(f.z[0], sin(angle), 1e-5);
    CHECK_NEAR(f.z[2], cos(angle), 1e-5);
    CHECK_NEAR(f.y[1], 1, 1e-5);
  }
  // Between any two attitudes each step turns by the same angle about one axis.
  Frame last = {0};
  double step = 0;
  for (int i = 0; i <= 10; i++) {
    show(s, 1 + i / 10.0);
    const Frame f = object_frame(&s->objects.items[0].common);
    const double trace = (double)(v3_dot(f.x, last.x) + v3_dot(f.y, last.y) + v3_dot(f.z, last.z));
    const double angle = acos(fmin((trace - 1) / 2, 1));
    if (i == 1) step = angle;
    if (i > 1) CHECK_NEAR(angle, step, 2e-3);
    last = f;
  }
  scene_destroy(s);
}

// --- all kinds of fields ----------------------------------------------------------------------------
TEST(every_type_moves_in_its_own_way)
{
  Scene *s = load(SCENE(
      TRACK("objects.ball.material", "", "{ \"time\": 0, \"value\": \"red\" }, { \"time\": 1, \"value\": \"blue\" }")
      "," TRACK("objects.ball.casts_shadow", "", "{ \"time\": 0, \"value\": true }, { \"time\": 1, \"value\": false }")
      "," TRACK("materials.red.alpha_mode", "", "{ \"time\": 0, \"value\": \"opaque\" }, { \"time\": 1, \"value\": \"blend\" }")
      "," TRACK("materials.red.base_color", "", "{ \"time\": 0, \"value\": \"#f00\" }, { \"time\": 2, \"value\": 0 }")
      "," TRACK("objects.ball.translate.y", ", \"easing\": \"cubic\"", "{ \"time\": 0, \"value\": 1 }, { \"time\": 1, \"value\": 3 }")
      "," TRACK("render.spp", "", "{ \"time\": 0, \"value\": 10 }, { \"time\": 1, \"value\": 13 }")
      "," TRACK("objects[0].shape.radius", "", "{ \"time\": 0, \"value\": 1 }, { \"time\": 1, \"value\": 2 }")));
  if (!s) return;
  show(s, 0.5);
  const Object *o = &s->objects.items[0];
  CHECK(o->common.material == 0 && o->common.casts_shadow);
  CHECK(s->materials.items[0].pbr.alpha_mode == 0);
  CHECK_NEAR(s->materials.items[0].pbr.base_color[0], 0.75, 1e-6);
  CHECK_NEAR(o->common.translate[1], 2, 1e-6);
  CHECK(o->common.translate[0] == 0 && s->render.spp == 12 && o->shape.sphere.radius == 1.5f);
  show(s, 1);
  CHECK(o->common.material == 1 && !o->common.casts_shadow && s->materials.items[0].pbr.alpha_mode == 2);
  unsigned moved;
  Err err = {0};
  CHECK(scene_set_time(s, 1, &moved, &err) && !moved);
  CHECK(scene_set_time(s, 1.5, &moved, &err) && moved == MOVED_WORLD);
  scene_destroy(s);
}

TEST(a_curve_stays_within_its_field)
{
  Scene *s = load(SCENE(TRACK("materials.red.roughness", ", \"easing\": \"cubic\"",
                              "{ \"time\": 0, \"value\": 1 }, { \"time\": 1, \"value\": 0 }, { \"time\": 2, \"value\": 0 }")));
  if (!s) return;
  float least = 1;
  for (int i = 0; i <= 100; i++) {
    show(s, i / 50.0);
    const float r = s->materials.items[0].pbr.roughness;
    CHECK(r >= 0 && r <= 1);
    least = r < least ? r : least;
  }
  CHECK(least == 0);
  scene_destroy(s);
}

// --- the language -----------------------------------------------------------------------------------
static void check_refused(const char *text, const char *part)
{
  Err err;
  Scene *s = sample_load(text, &err);
  CHECK_MSG(!s && err.kind == ERR_BAD_SCENE, "accepted: %s", text);
  if (!s) CHECK_TEXT(err.text, part);
  scene_destroy(s);
}

TEST(what_is_wrong_is_told_with_its_place)
{
  check_refused(SCENE("{ \"keys\": [ { \"time\": 0, \"value\": 1 } ] }"), "3:18: a track needs a \"path\"");
  check_refused(SCENE("{ \"path\": \"camera.fov\" }"), "3:18: a track needs a \"keys\"");
  check_refused(SCENE(TRACK("camera.fof", "", "{ \"time\": 0, \"value\": 1 }")), "3:28: camera.fof: a camera of kind");
  check_refused(SCENE(TRACK("camera", "", "{ \"time\": 0, \"value\": 1 }")), "3:28: a track moves one field");
  check_refused(SCENE(TRACK("objects.bell.scale", "", "{ \"time\": 0, \"value\": 1 }")), "did you mean \"ball\"");
  check_refused(SCENE(TRACK("objects.bill", "", "{ \"time\": 0, \"value\": 1 }")), "3:28: objects.bill: there is no such object");
  check_refused(SCENE(TRACK("timeline.fps", "", "{ \"time\": 0, \"value\": 1 }")), "cannot be animated");
  check_refused(SCENE(TRACK("camera.fov", "", "{ \"time\": 0, \"value\": 200 }")), "3:74: fov must be between 0.01 and 179");
  check_refused(SCENE(TRACK("camera.fov", "", "{ \"time\": 0, \"value\": \"wide\" }")), "3:74: fov must be a number");
  check_refused(SCENE(TRACK("camera.fov", "", "{ \"time\": 0, \"value\": 20, \"eesing\": 1 }")), "did you mean \"easing\"");
  check_refused(SCENE(TRACK("camera.fov", "", "{ \"time\": 0, \"value\": 20, \"easing\": \"slow\" }")), "easing must be");
  check_refused(SCENE(TRACK("camera.fov", "", "{ \"time\": 0, \"value\": 20, \"easing\": [0, 0, 2, 1] }")), "easing must be");
  check_refused(SCENE(TRACK("camera.fov", "", "{ \"time\": 1, \"value\": 20 }, { \"time\": 1, \"value\": 30 }")),
                "3:80: keys must be in order");
  check_refused(SCENE(TRACK("camera.fov", "", "{ \"value\": 20 }")), "3:52: a key needs \"time\" and \"value\"");
  check_refused(SCENE(TRACK("camera.fov", "", "{ \"time\": 1e9, \"value\": 20 }")), "between -1e6 and 1e6");
  check_refused(SCENE(TRACK("camera.fov", "", "")), "keys must be a list of 1");
  check_refused(SCENE(TRACK("camera.fov", ", \"turn\": \"shortest\"", "{ \"time\": 0, \"value\": 20 }")),
                "3:50: turn \"shortest\" is for fields of three angles");
  check_refused(SCENE(TRACK("camera.fov", ", \"easing\": \"soft\"", "{ \"time\": 0, \"value\": 20 }")),
                "easing must be \"step\", \"linear\", \"smooth\" or \"cubic\"");
  check_refused(SCENE(TRACK("objects.ball.material", "", "{ \"time\": 0, \"value\": \"rad\" }")), "did you mean \"red\"");
}

TEST(an_impossible_moment_names_its_track)
{
  Scene *s = load(SCENE("{ \"name\": \"dive\", \"path\": \"camera.position\", \"keys\": [ { \"time\": 0, \"value\": [0, 1, 4] }, "
                        "{ \"time\": 1, \"value\": [0, 1, -4] } ] }"));
  Err err = {0};
  if (!s) return;
  show(s, 0.25);
  CHECK(!scene_set_time(s, 0.5, NULL, &err));
  CHECK_TEXT(err.text, "animation.dive at 0.5 s: the camera's target is its position");
  show(s, 0.75);
  err = (Err){0};
  CHECK(scene_set(s, "objects.ball.name", "\"bowl\"", &err) && scene_set(s, "animation.roll", "null", &err) == false);
  scene_destroy(s);
}

static void check_same_text(Scene *s, const char *path, const char *wanted)
{
  Text out = {0};
  Err err = {0};
  CHECK_MSG(scene_get(s, path, &out, &err), "%s", err.text);
  CHECK_MSG(!strcmp(text_get(&out), wanted), "%s", text_get(&out));
  text_finish(&out);
}

TEST(a_written_animation_reads_back_the_same)
{
  Scene *s = load(SCENE(
      "{ \"name\": \"up\", \"path\": \"objects.ball.translate\", \"after\": \"loop\", \"keys\": [ { \"time\": 0.1, \"value\": 1 "
      "}, { \"time\": 2, \"value\": [0, 1, 2], \"easing\": [0.5, 0, 0.25, 1] }, { \"time\": 3, \"value\": 0, \"easing\": "
      "\"spline\", \"in\": [1, 2, 3], \"out\": 4 } ] }," TRACK("materials.red.base_color", ", \"easing\": \"step\"",
                                                               "{ \"time\": 0, \"value\": \"#f80\" }")));
  if (!s) return;
  Text first = {0}, second = {0};
  Err err = {0};
  CHECK(scene_write(s, &first, &err));
  Scene *again = load(text_get(&first));
  CHECK(again && scene_write(again, &second, &err) && !strcmp(text_get(&first), text_get(&second)));
  check_same_text(s, "animation.up.keys",
                  "[{\"time\":0.1,\"value\":1},{\"time\":2,\"value\":[0,1,2],\"easing\":[0.5,0,0.25,1]},"
                  "{\"time\":3,\"value\":0,\"easing\":\"spline\",\"in\":[1,2,3],\"out\":4}]");
  scene_destroy(again);
  scene_destroy(s);
  text_finish(&first);
  text_finish(&second);
}

TEST(edits_of_tracks_are_undone_and_moments_are_no_edits)
{
  Scene *s = load(SCENE(TRACK("camera.fov", "", "{ \"time\": 0, \"value\": 20 }, { \"time\": 1, \"value\": 40 }")));
  History h = {0};
  Err err = {0};
  if (!s) return;
  show(s, 0.5);
  CHECK(h.changes.count == 0 && s->camera.perspective.fov == 30);
  CHECK_MSG(history_set(&h, s, "animation[0].keys", "[{\"time\":0,\"value\":50},{\"time\":1,\"value\":60}]", &err), "%s", err.text);
  show(s, 0.5);
  CHECK(s->camera.perspective.fov == 55);
  CHECK(history_undo(&h, s, &err));
  show(s, 0.5);
  CHECK(s->camera.perspective.fov == 30);
  CHECK(history_redo(&h, s, &err));
  show(s, 1);
  CHECK(s->camera.perspective.fov == 60);
  CHECK(!history_set(&h, s, "animation[0].keys", "[{\"time\":0,\"value\":500}]", &err));
  CHECK_TEXT(err.text, "animation[0].keys: key 0: fov must be between");
  err = (Err){0};
  CHECK(history_set(&h, s, "animation.spin", "{\"path\":\"objects.ball.rotate\",\"keys\":[{\"time\":2,\"value\":[0,90,0]}]}", &err));
  show(s, 0);
  CHECK(s->objects.items[0].common.rotate[1] == 90);
  CHECK(history_set(&h, s, "animation.spin", "null", &err) && s->tracks.count == 1);
  // Another kind under a track: the field is found anew, or missed by name.
  CHECK(history_set(&h, s, "camera.kind", "\"orthographic\"", &err));
  CHECK(!scene_set_time(s, 0, NULL, &err));
  CHECK_TEXT(err.text, "animation[0] at 0 s: camera.fov: a camera of kind \"orthographic\" has no field \"fov\"");
  history_finish(&h);
  scene_destroy(s);
}

TEST(scenes_inside_scenes_move_along)
{
  const char *inner = SCENE(TRACK("objects.ball.translate", "", "{ \"time\": 0, \"value\": 0 }, { \"time\": 2, \"value\": 6 }"));
  sample_write("inner.json", inner, strlen(inner));
  Scene *s = load("{ \"rayfold\": 1, \"timeline\": { \"fps\": 30 }, \"objects\": [ { \"shape\": { \"kind\": \"mesh\", \"file\": "
                  "\"inner.json\" } } ] }");
  double start, end;
  if (!s) return;
  CHECK(scene_time_range(s, &start, &end) && start == 0 && end == 2);
  show(s, 1);
  CHECK(s->models.items[0].scene->objects.items[0].common.translate[2] == 3);
  Err err = {0};
  CHECK(scene_set(s, "timeline.range", "[0.5, 4]", &err) && scene_time_range(s, &start, &end) && start == 0.5 && end == 4);
  scene_destroy(s);
  s = load("{ \"rayfold\": 1 }");
  CHECK(s && !scene_time_range(s, &start, &end));
  if (s) show(s, 1);
  scene_destroy(s);
  sample_remove();
}

TEST_MAIN
