// From scene to world: what is laid flat where, what successive worlds share, and that running out of memory at any
// step is an error and not a crash.

#include "tests/test.h"

#include "world/merge.h"
#include "world/parts.h"
#include "world/world.h"

static MeshData *square(void)
{
  static const float positions[] = {-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0};
  static const uint32_t triangles[] = {0, 1, 2, 0, 2, 3};
  MeshData *m = mesh_data_create();
  m->vertex_count = 4;
  m->triangle_count = 2;
  m->positions = mem_alloc(12, sizeof(float));
  m->triangles = mem_alloc(6, sizeof(uint32_t));
  memcpy(m->positions, positions, sizeof positions);
  memcpy(m->triangles, triangles, sizeof triangles);
  return m;
}

static int32_t add_square(Scene *s, int32_t material)
{
  const int32_t mesh = scene_add_mesh(s, "square", square());
  const int32_t object = scene_add_object(s, SHAPE_MESH, NULL);
  s->objects.items[object].shape.mesh_i = mesh;
  s->objects.items[object].common.material = material;
  return object;
}

static void set_scale(Scene *s, int32_t object, float x, float y, float z)
{
  float *scale = s->objects.items[object].common.scale;
  scale[0] = x;
  scale[1] = y;
  scale[2] = z;
}

static int32_t add_emission(Scene *s, float strength)
{
  const int32_t m = scene_add_material(s, MATERIAL_EMISSION, "light");
  s->materials.items[m].emission.strength = strength;
  return m;
}

TEST(an_empty_scene_is_a_world)
{
  Err err = {0};
  Scene *s = scene_create(&err);
  World *w = world_prepare(s, NULL, NULL, NULL, NULL, &err);
  CHECK_MSG(w != NULL, "%s", err.text);
  CHECK(w->instance_count == 0 && w->lo[0] > w->hi[0] && w->material_count == 1);
  world_release(w);
  scene_destroy(s);
}

TEST(the_next_world_shares_what_did_not_change)
{
  Err err = {0};
  Scene *s = scene_create(&err);
  add_square(s, -1);
  World *first = world_prepare(s, NULL, NULL, NULL, NULL, &err);
  s->objects.items[0].common.translate[0] = 5;
  add_square(s, -1);
  World *second = world_prepare(s, first, NULL, NULL, NULL, &err);
  CHECK(first && second);
  CHECK(first->parts->meshes.items[0].tree == second->parts->meshes.items[0].tree);
  CHECK(second->parts->meshes.count == 2);
  CHECK_NEAR(first->hi[0], 1, 1e-5);
  CHECK_NEAR(second->hi[0], 6, 1e-5);
  scene_destroy(s); // worlds stand on their own
  world_release(first);
  CHECK(second->instances[0].mesh.positions[3] == 1);
  world_release(second);
}

TEST(another_kind_of_tree_is_built_anew)
{
  Err err = {0};
  Scene *s = scene_create(&err);
  add_square(s, -1);
  World *first = world_prepare(s, NULL, NULL, NULL, NULL, &err);
  s->render.compact = true;
  World *second = world_prepare(s, first, NULL, NULL, NULL, &err), *third = world_prepare(s, second, NULL, NULL, NULL, &err);
  s->render.tree = SCENE_TREE_BEST;
  World *best = world_prepare(s, third, NULL, NULL, NULL, &err), *again = world_prepare(s, best, NULL, NULL, NULL, &err);
  World *worlds[] = {first, second, third, best, again};
  CHECK(first && second && third && best && again);
  CHECK(second->tree_bytes < first->tree_bytes && third->tree_bytes == second->tree_bytes);
  CHECK(first->parts->meshes.items[0].tree != second->parts->meshes.items[0].tree);
  CHECK(second->parts->meshes.items[0].tree == third->parts->meshes.items[0].tree);
  CHECK(third->parts->meshes.items[0].tree != best->parts->meshes.items[0].tree);
  CHECK(best->parts->meshes.items[0].tree == again->parts->meshes.items[0].tree);
  scene_destroy(s);
  for (int i = 0; i < 5; i++) world_release(worlds[i]);
}

static double merged_area(const MeshData *m)
{
  double area = 0;
  for (size_t t = 0; t < m->triangle_count; t++) {
    const uint32_t *v = m->triangles + 3 * t;
    const Vec3 a = v3_load(m->positions + 3 * v[0]), b = v3_load(m->positions + 3 * v[1]),
               c = v3_load(m->positions + 3 * v[2]), n = v3_cross(b - a, c - a);
    CHECK(v3_dot(n, v3_load(m->normals + 3 * v[0])) > 0); // the winding says the same as the normals
    area += (double)v3_length(n) / 2;
  }
  return area;
}

TEST(merging_lays_down_every_surface)
{
  Err err = {0};
  Scene *s = scene_create(&err);
  add_square(s, -1);                         // of area 4
  set_scale(s, add_square(s, -1), -1, 2, 1); // a mirrored one of 8
  set_scale(s, scene_add_object(s, SHAPE_QUAD, NULL), 3, 1, 1);
  scene_add_object(s, SHAPE_SPHERE, NULL);
  scene_add_light(s, LIGHT_RECT, NULL); // is not a thing
  World *w = world_prepare(s, NULL, NULL, NULL, NULL, &err);
  MeshData *m = w ? world_merge(w, &err) : NULL;
  CHECK_MSG(m, "%s", err.text);
  const float *quad = s->objects.items[2].shape.quad.size;
  const double r = (double)s->objects.items[3].shape.sphere.radius, pi = 3.14159265358979;
  if (m) CHECK_NEAR(merged_area(m), 4 + 8 + 3 * quad[0] * quad[1] + 4 * pi * r * r, 0.03 * r * r);
  mesh_data_release(m);
  world_release(w);
  scene_destroy(s);
}

TEST(models_inside_models_are_laid_flat)
{
  Err err = {0};
  Scene *inner = scene_create(&err);
  const int32_t red = scene_add_material(inner, MATERIAL_LAMBERT, "red");
  add_square(inner, red);
  inner->objects.items[0].common.translate[1] = 2;
  Scene *s = scene_create(&err);
  const Model model = {"inner", inner};
  CHECK(array_push(&s->models, model));
  const int32_t blue = scene_add_material(s, MATERIAL_LAMBERT, "blue");
  for (int i = 0; i < 2; i++) {
    const int32_t o = scene_add_object(s, SHAPE_MESH, NULL);
    s->objects.items[o].shape.model_i = 0;
    s->objects.items[o].common.translate[0] = 10;
    s->objects.items[o].common.scale[1] = 3;
    s->objects.items[o].common.material = i ? blue : -1;
  }
  World *w = world_prepare(s, NULL, NULL, NULL, NULL, &err);
  CHECK_MSG(w != NULL, "%s", err.text);
  CHECK(w->instance_count == 2 && w->parts->meshes.count == 1);
  // Blue is the main scene's first material, red the model's.
  CHECK(w->instances[0].materials[0] == 1 && w->instances[1].materials[0] == 0);
  const Vec3 p = frame_point(&accel_instances(w->accel)[0].world_from_object, v3(0, 0, 0));
  CHECK_NEAR(v3_length(p - v3(10, 6, 0)), 0, 1e-5);
  CHECK(w->instances[1].object_i == 1);
  world_release(w);
  scene_destroy(s);
}

TEST(shining_things_become_emitters)
{
  Err err = {0};
  Scene *s = scene_create(&err);
  const int32_t glow = add_emission(s, 3);
  add_square(s, glow);
  s->objects.items[0].common.scale[0] = -2; // mirrored: its outside stays outside
  const int32_t ball = scene_add_object(s, SHAPE_SPHERE, NULL);
  s->objects.items[ball].common.material = glow;
  scene_add_light(s, LIGHT_POINT, NULL);
  scene_add_light(s, LIGHT_RECT, NULL);
  scene_add_light(s, LIGHT_SUN, NULL);
  World *w = world_prepare(s, NULL, NULL, NULL, NULL, &err);
  CHECK_MSG(w != NULL, "%s", err.text);
  CHECK(w->lights.emitter_count == 5 && w->lights.sun_count == 1);
  int kinds[6] = {0};
  for (size_t i = 0; i < w->lights.emitter_count; i++) kinds[w->lights.emitters[i].kind]++;
  CHECK(kinds[EMITTER_POINT] == 1 && kinds[EMITTER_TRIANGLE] == 2 && kinds[EMITTER_QUAD] == 1 && kinds[EMITTER_SPHERE] == 1);
  for (size_t i = 0; i < w->instance_count; i++) CHECK(w->instances[i].emitters != NULL);
  for (size_t i = 0; i < w->lights.emitter_count; i++) {
    const Emitter *e = &w->lights.emitters[i];
    if (e->kind != EMITTER_TRIANGLE) continue;
    CHECK_NEAR(e->area, 4, 1e-5);
    CHECK(v3_cross(e->x, e->y)[2] > 0);
  }
  // A sun of 3 W/m2; so small a disk gives radiance times solid angle.
  const Sun *sun = &w->lights.suns[0];
  CHECK_NEAR(sun->radiance[0] * 2 * PI * sun->one_minus_cos, 3, 1e-3);
  world_release(w);
  scene_destroy(s);
}

TEST(errors_name_the_thing)
{
  Err err = {0};
  Scene *s = scene_create(&err);
  scene_add_object(s, SHAPE_MESH, "ghost");
  CHECK(!world_prepare(s, NULL, NULL, NULL, NULL, &err));
  CHECK_TEXT(err.text, "ghost");
  scene_destroy(s);
  err = (Err){0};
  s = scene_create(&err);
  const int32_t t = scene_add_texture(s, TEXTURE_IMAGE, "wood"), m = scene_add_material(s, MATERIAL_LAMBERT, "table");
  s->materials.items[m].lambert.albedo_texture = t;
  s->textures.items[t].image.file = "/nonexistent/wood.png";
  const LoadOptions options = {.allow_outside = true};
  CHECK(!world_prepare(s, NULL, &options, NULL, NULL, &err));
  CHECK(err.kind == ERR_NOT_FOUND);
  CHECK_TEXT(err.text, "wood.png");
  scene_destroy(s);
}

// Where a camera of fov 30 sees p: the picture's edges are at -1 and 1.
static void project(const Camera *c, float aspect, Vec3 p, double out[2])
{
  const Vec3 eye = v3_load(c->common.position), back = v3_normalize(eye - v3_load(c->common.target));
  const Vec3 right = v3_normalize(v3_cross(v3_load(c->common.up), back)), up = v3_cross(back, right);
  const double depth = v3_dot(eye - p, back), tangent = tan(15 * 3.14159265358979323846 / 180);
  out[0] = v3_dot(p - eye, right) / (depth * tangent * aspect);
  out[1] = v3_dot(p - eye, up) / (depth * tangent);
}

// All of the scene is inside the picture, with the same small margin on two opposite sides at least.
TEST(the_camera_of_a_bare_model_just_sees_all_of_it)
{
  static const float turns[][3] = {{0, 0, 0}, {35, 80, -20}, {90, 0, 0}, {-60, 10, 130}};
  static const float aspects[] = {1, 16 / 9.0f, 0.5f, 3};
  for (size_t k = 0; k < 16; k++) {
    Err err = {0};
    Scene *s = scene_create(&err);
    for (int i = 0; i < 2; i++) {
      const int32_t object_i = add_square(s, -1);
      ObjectCommon *o = &s->objects.items[object_i].common;
      memcpy(o->rotate, turns[k / 4], sizeof o->rotate);
      o->translate[0] = 500 + 2 * (float)i;
      o->scale[1] = 0.3f;
    }
    World *w = world_prepare(s, NULL, NULL, NULL, NULL, &err);
    const Camera c = world_frame_camera(w, aspects[k % 4]);
    double most[4] = {-9, -9, -9, -9}; // right, left, up, down
    for (size_t i = 0; i < w->instance_count; i++)
      for (size_t v = 0; v < 4; v++) {
        const Frame *f = &accel_instances(w->accel)[i].world_from_object;
        double at[2];
        project(&c, aspects[k % 4], frame_point(f, v3_load(w->instances[i].mesh.positions + 3 * v)), at);
        for (int a = 0; a < 2; a++) {
          most[2 * a] = fmax(most[2 * a], at[a]);
          most[2 * a + 1] = fmax(most[2 * a + 1], -at[a]);
        }
      }
    for (int a = 0; a < 4; a++) CHECK_MSG(most[a] <= 1 / 1.2 + 1e-3, "%zu: %g", k, most[a]);
    const bool fills_width = most[0] > 1 / 1.2 - 1e-3 && most[1] > 1 / 1.2 - 1e-3;
    const bool fills_height = most[2] > 1 / 1.2 - 1e-3 && most[3] > 1 / 1.2 - 1e-3;
    CHECK_MSG(fills_width || fills_height, "%zu: %g %g %g %g", k, most[0], most[1], most[2], most[3]);
    world_release(w);
    scene_destroy(s);
  }
}

TEST(cancel_is_an_error)
{
  Err err = {0};
  Scene *s = scene_create(&err);
  add_square(s, -1);
  Cancel cancel;
  atomic_init(&cancel.requested, true);
  CHECK(!world_prepare(s, NULL, NULL, NULL, &cancel, &err));
  CHECK(err.kind == ERR_CANCELLED);
  scene_destroy(s);
}

// R4: the n-th allocation fails, for every n until none does.
TEST(every_allocation_may_fail)
{
  Scene *s = scene_create(NULL);
  add_square(s, add_emission(s, 1));
  scene_add_object(s, SHAPE_BOX, NULL);
  scene_add_light(s, LIGHT_SPHERE, NULL);
  s->sky.kind = SKY_GRADIENT;
  s->sky.gradient.gain = 1;
  s->sky.gradient.zenith[0] = 1;
  int failures = 0;
  for (long n = 1; n < 1000; n++) {
    Err err = {0};
    mem_fail_after(n);
    World *w = world_prepare(s, NULL, NULL, NULL, NULL, &err);
    mem_fail_after(0);
    if (w) {
      world_release(w);
      break;
    }
    failures++;
    CHECK_MSG(err.kind == ERR_NO_MEMORY, "allocation %ld: %s", n, err.text);
  }
  CHECK(failures > 5 && failures < 900);
  scene_destroy(s);
}

TEST_MAIN
