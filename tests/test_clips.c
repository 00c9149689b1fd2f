// Tests of what glTF clips move, on files written here: joints, morph targets, nodes, cameras and lights against closed
// forms, clips by name, and broken files.

#include "scene/edit.h"
#include "scene/rig.h"
#include "scene/track.h"

#include "tests/model.h"

#include <stdarg.h>

// --- writing files ----------------------------------------------------------------------------------
typedef struct Writer { // one buffer, an accessor for each block put into it
  Text views, accessors;
  uint8_t data[4000];
  size_t size;
  int count;
} Writer;

static int put(Writer *w, const void *data, size_t size, const char *type, int component, size_t count)
{
  const char *comma = w->count ? "," : "";
  text_add(&w->views, "%s{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu}", comma, w->size, size);
  text_add(&w->accessors, "%s{\"bufferView\":%d,\"type\":\"%s\",\"componentType\":%d,\"count\":%zu}", comma, w->count, type,
           component, count);
  memcpy(w->data + w->size, data, size);
  w->size += (size + 3) / 4 * 4;
  return w->count++;
}

#define FLOATS(w, type, count, ...) put(w, (const float[]){__VA_ARGS__}, sizeof((const float[]){__VA_ARGS__}), type, 5126, count)

// body has ' for ". The file is what model_load() takes.
static size_t finish(Writer *w, const char *body, uint8_t out[12000])
{
  Text json = {0};
  text_add(&json, "{\"asset\":{\"version\":\"2.0\"},\"buffers\":[{\"byteLength\":%zu}],\"bufferViews\":[%s],\"accessors\":[%s],",
           w->size, text_get(&w->views), text_get(&w->accessors));
  for (; *body; body++) text_add(&json, "%c", *body == '\'' ? '"' : *body);
  text_add(&json, "}");
  while (json.length % 4) text_add(&json, " ");
  const uint32_t head[5] = {0x46546c67, 2, (uint32_t)(28 + json.length + w->size), (uint32_t)json.length, 0x4e4f534a};
  const uint32_t chunk[2] = {(uint32_t)w->size, 0x004e4942};
  memcpy(out, head, 20);
  memcpy(out + 20, json.data, json.length);
  memcpy(out + 20 + json.length, chunk, 8);
  memcpy(out + 28 + json.length, w->data, w->size);
  const size_t size = 28 + json.length + w->size;
  text_finish(&json);
  text_finish(&w->views);
  text_finish(&w->accessors);
  return size;
}

// Four vertices of a strip that bends at y = 1: two below, one above, one that follows both joints alike.
static size_t build_arm(uint8_t out[12000])
{
  Writer w = {0};
  const uint8_t joints[16] = {0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0};
  FLOATS(&w, "VEC3", 4, 0, 0, 0, 1, 0, 0, 0, 2, 0, 1, 2, 0);                                  // 0 positions
  FLOATS(&w, "VEC3", 4, 0, 0, 1, 0, 0, 1, 1, 0, 0, 0, 0, 1);                                  // 1 normals
  put(&w, joints, 16, "VEC4", 5121, 4);                                                      // 2
  FLOATS(&w, "VEC4", 4, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0.5f, 0.5f, 0, 0);               // 3 weights
  put(&w, (const uint16_t[]){0, 1, 2, 2, 1, 3}, 12, "SCALAR", 5123, 6);                      // 4
  FLOATS(&w, "MAT4", 2, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, -1, 0, 1); // 5
  FLOATS(&w, "SCALAR", 2, 0, 1);                                                              // 6 times
  FLOATS(&w, "VEC4", 2, 0, 0, 0, 1, 0, 0, 0.70710678f, 0.70710678f);                          // 7 a quarter turn about z
  FLOATS(&w, "VEC3", 2, 0, 0, 0, 4, 0, 0);                                                    // 8
  return finish(&w,
                "'meshes':[{'primitives':[{'attributes':{'POSITION':0,'NORMAL':1,'JOINTS_0':2,'WEIGHTS_0':3},'indices':4}]}],"
                "'skins':[{'joints':[1,2],'inverseBindMatrices':5}],"
                "'nodes':[{'mesh':0,'skin':0,'name':'arm','translation':[50,0,0]},{'children':[2]},{'translation':[0,1,0]}],"
                "'animations':[{'name':'bend','samplers':[{'input':6,'output':7}],'channels':[{'sampler':0,'target':{'node':2,"
                "'path':'rotation'}}]},{'name':'walk','samplers':[{'input':6,'output':8}],'channels':[{'sampler':0,'target':{"
                "'node':1,'path':'translation'}}]}]",
                out);
}

static Scene *load_arm(void)
{
  uint8_t file[12000];
  Err err;
  const size_t size = build_arm(file);
  Scene *s = model_load(import_gltf, "arm.glb", file, size, &err);
  if (s) return s;
  fprintf(stderr, "%s\n", err.text);
  exit(99);
}

static void show(Scene *s, double seconds)
{
  Err err = {0};
  CHECK_MSG(scene_set_time(s, seconds, NULL, &err), "%s", err.text);
}

static Vec3 vertex(const Scene *s, size_t i)
{
  const Object *o = &s->objects.items[0];
  const Frame f = object_frame(&o->common);
  return frame_point(&f, v3_load(s->meshes.items[o->shape.mesh_i].data->positions + 3 * i));
}

#define CHECK_VERTEX(v, x, y, z) \
  CHECK_MSG(v3_length((v) - v3((float)(x), (float)(y), (float)(z))) < 1e-5f, "%g %g %g", (double)(v)[0], (double)(v)[1], (double)(v)[2])

// --- joints -----------------------------------------------------------------------------------------
TEST(vertices_follow_their_joints)
{
  Scene *s = load_arm();
  // At rest the joints are where they were bound; the place of the mesh's own node does not count.
  CHECK_VERTEX(vertex(s, 1), 1, 0, 0);
  CHECK_VERTEX(vertex(s, 2), 0, 2, 0);
  for (int i = 0; i <= 10; i++) {
    show(s, i / 10.0);
    const double a = i / 20.0 * 3.14159265358979, c = cos(a), d = sin(a);
    CHECK_VERTEX(vertex(s, 0), 0, 0, 0);
    CHECK_VERTEX(vertex(s, 2), -d, 1 + c, 0);
    CHECK_VERTEX(vertex(s, 3), (1 + c - d) / 2, (2 + 1 + d + c) / 2, 0); // half at rest, half turned
    const float *n = s->meshes.items[s->objects.items[0].shape.mesh_i].data->normals + 6;
    CHECK_VERTEX(v3_load(n), c, d, 0);
  }
  // It goes round, and back to the start.
  show(s, 1.5);
  const Vec3 half = vertex(s, 2);
  show(s, 0.5);
  CHECK_VERTEX(vertex(s, 2), half[0], half[1], half[2]);
  scene_destroy(s);
}

TEST(the_same_triangles_move)
{
  // What prepares the world finds the tree of the frame before by the origin of the data.
  Scene *s = load_arm();
  const int32_t mesh_i = s->objects.items[0].shape.mesh_i;
  const MeshData *origin = mesh_data_origin(s->meshes.items[mesh_i].data);
  show(s, 0.3);
  const MeshData *moved = s->meshes.items[mesh_i].data;
  CHECK(moved != origin && mesh_data_origin(moved) == origin && moved->triangles == origin->triangles);
  unsigned what;
  Err err = {0};
  CHECK(scene_set_time(s, 0.3, &what, &err) && !what && s->meshes.items[mesh_i].data == moved);
  CHECK(scene_set_time(s, 0.4, &what, &err) && what == MOVED_WORLD);
  scene_destroy(s);
}

TEST(clips_are_chosen_by_name)
{
  Scene *s = load_arm();
  double start, end;
  Err err = {0};
  CHECK(s->rig && s->rig->clips.count == 2 && scene_time_range(s, &start, &end) && start == 0 && end == 1);
  CHECK(scene_set(s, "timeline.clip", "walk", &err));
  show(s, 0.25);
  CHECK_VERTEX(vertex(s, 2), 1, 2, 0);
  CHECK_VERTEX(vertex(s, 1), 2, 0, 0);
  CHECK(scene_set(s, "timeline.clip", "null", &err));
  show(s, 1);
  CHECK_VERTEX(vertex(s, 2), -1, 1, 0); // the walk is over, the first clip bends
  CHECK_VERTEX(vertex(s, 1), 1, 0, 0);
  CHECK(scene_set(s, "timeline.clip", "wolk", &err) && !scene_set_time(s, 0, NULL, &err));
  CHECK_TEXT(err.text, "there is no clip \"wolk\"; did you mean \"walk\"");
  scene_destroy(s);
}

// --- morph targets ----------------------------------------------------------------------------------
TEST(half_a_weight_is_half_way)
{
  Writer w = {0};
  uint8_t file[12000];
  Err err;
  FLOATS(&w, "VEC3", 3, 0, 0, 0, 1, 0, 0, 0, 1, 0);
  FLOATS(&w, "VEC3", 3, 0, 0, 2, 0, 0, 0, 0, 3, 0);
  FLOATS(&w, "VEC3", 3, 1, 0, 0, 0, 0, 0, 0, 0, 0);
  FLOATS(&w, "SCALAR", 2, 0, 1);
  FLOATS(&w, "SCALAR", 4, 0, 0.25f, 1, 0.25f);
  const size_t size = finish(&w,
                             "'meshes':[{'weights':[0,0.25],'primitives':[{'attributes':{'POSITION':0},'targets':[{'POSITION':1},{"
                             "'POSITION':2}]}]}],'nodes':[{'mesh':0},{'mesh':0,'weights':[1,0],'translation':[9,0,0]}],"
                             "'animations':[{'samplers':[{'input':3,'output':4}],'channels':[{'sampler':0,'target':{'node':0,'path':"
                             "'weights'}}]}]",
                             file);
  Scene *s = model_load(import_gltf, "morph.glb", file, size, &err);
  CHECK_MSG(s, "%s", err.text);
  if (!s) return;
  CHECK_VERTEX(vertex(s, 0), 0.25, 0, 0); // the mesh's own weights, at rest
  show(s, 0.5);
  CHECK_VERTEX(vertex(s, 0), 0.25, 0, 1);
  CHECK_VERTEX(vertex(s, 2), 0, 2.5, 0);
  show(s, 0.8);
  CHECK_VERTEX(vertex(s, 2), 0, 1 + 0.8 * 3, 0);
  // The other node that shows the mesh has weights of its own, and stands still.
  const Object *other = &s->objects.items[1];
  CHECK(other->shape.mesh_i != s->objects.items[0].shape.mesh_i);
  CHECK_VERTEX(v3_load(s->meshes.items[other->shape.mesh_i].data->positions + 6), 0, 4, 0);
  scene_destroy(s);
}

// --- nodes ------------------------------------------------------------------------------------------
TEST(nodes_carry_objects_cameras_and_lights)
{
  Writer w = {0};
  uint8_t file[12000];
  Err err;
  FLOATS(&w, "VEC3", 3, 0, 0, 0, 1, 0, 0, 0, 1, 0);
  FLOATS(&w, "SCALAR", 2, 1, 3);
  FLOATS(&w, "VEC3", 6, 0, 0, 0, 1, 0, 0, 0.5f, 0, 0, -1, 0, 0, 3, 0, 0, 0, 0, 0); // in, value, out: twice
  FLOATS(&w, "VEC3", 2, 1, 1, 1, 2, 2, 2);
  const size_t size = finish(
      &w,
      "'meshes':[{'primitives':[{'attributes':{'POSITION':0}}]}],'cameras':[{'type':'perspective','perspective':{'yfov':1}}],"
      "'extensions':{'KHR_lights_punctual':{'lights':[{'type':'point','intensity':5}]}},"
      "'nodes':[{'children':[1,2]},{'mesh':0,'translation':[0,1,0]},{'camera':0,'extensions':{'KHR_lights_punctual':{'light':0}}},"
      "{'mesh':0,'name':'still'}],"
      "'animations':[{'samplers':[{'input':1,'output':2,'interpolation':'CUBICSPLINE'},{'input':1,'output':3,'interpolation':"
      "'STEP'}],'channels':[{'sampler':0,'target':{'node':0,'path':'translation'}},{'sampler':1,'target':{'node':1,'path':"
      "'scale'}},{'sampler':0,'target':{'node':0,'path':'pointer'}}]}]",
      file);
  Scene *s = model_load(import_gltf, "nodes.glb", file, size, &err);
  CHECK_MSG(s, "%s", err.text);
  if (!s) return;
  CHECK(has_note(s, "move what is not known here"));
  for (int i = 0; i <= 10; i++) {
    const double u = i / 10.0, d = 2;
    const double x = (2 * u * u * u - 3 * u * u + 1) * 1 + d * (u * u * u - 2 * u * u + u) * 0.5 + (3 * u * u - 2 * u * u * u) * 3 +
                     d * (u * u * u - u * u) * -1;
    show(s, 1 + d * u);
    CHECK_VERTEX(vertex(s, 0), x, 1, 0);
    CHECK_VERTEX(vertex(s, 1), x + (i < 10 ? 1 : 2), 1, 0);
    CHECK_VERTEX(v3_load(s->camera.common.position), x, 0, 0);
    CHECK_VERTEX(v3_load(s->camera.common.target), x, 0, -1);
    CHECK_VERTEX(v3_load(s->cameras.items[0].common.position), x, 0, 0);
    CHECK_VERTEX(v3_load(s->lights.items[0].point.position), x, 0, 0);
  }
  // What no clip names is left to edits.
  CHECK(scene_set(s, "objects.still", "null", &err));
  show(s, 1);
  CHECK(s->objects.count == 1);
  scene_destroy(s);
}

// --- broken files -----------------------------------------------------------------------------------
TEST(broken_rigs_are_told_or_left_out)
{
  uint8_t file[12000];
  const size_t size = build_arm(file);
  model_break(import_gltf, "broken.glb", file, size, TEST_IS_SLOW ? 200 : 600);
  model_starve(import_gltf, model_write("arm.glb", file, size));
  Err err;
  const struct {
    const char *was, *is, *message;
  } slips[] = {
      {"\"joints\":[1,2]", "\"joints\":[1,7]", "a joint must be the number of a node"},
      {"\"input\":6,\"output\":7", "\"input\":7,\"output\":7", "must be float numbers, its times"},
      {"\"input\":6,\"output\":7", "\"input\":6,\"output\":8", "must hold 8 numbers for its 2 times"},
      {"\"joints\":[1,2]", "\"joints\":[1  ]", "a vertex names joint 1, but there are only 1"},
  };
  for (size_t i = 0; i < sizeof slips / sizeof *slips; i++) {
    uint8_t copy[12000];
    memcpy(copy, file, size);
    uint8_t *at = memmem(copy, size, slips[i].was, strlen(slips[i].was));
    CHECK(at && strlen(slips[i].is) == strlen(slips[i].was));
    if (!at) continue;
    memcpy(at, slips[i].is, strlen(slips[i].is));
    Scene *s = model_load(import_gltf, "slip.glb", copy, size, &err);
    CHECK_MSG(!s && strstr(err.text, slips[i].message), "%s", err.text);
    scene_destroy(s);
  }
  model_clean((const char *const[]){"arm.glb", "broken.glb", "slip.glb", "morph.glb", "nodes.glb"}, 5);
}

TEST_MAIN
