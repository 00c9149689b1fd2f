// Rays through the public interface: hits name what was hit, batches answer as single rays do, and the surface of a
// hit is what its shape says, in the world, after the scene is gone.

#include "tests/test.h"

#include "rayfold/rayfold.h"

#include <math.h>
#include <string.h>

typedef struct Stage {
  rf_engine *engine;
  rf_scene *scene;
  rf_object square, ball;
  rf_world *world;
} Stage;

// A square of two triangles, 2 x 2 about (5, 0, 0), facing +z, its shading normals leaning; a ball; a lamp.
static Stage stage_open(void)
{
  static const float positions[] = {-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0};
  static const float texcoords[] = {0, 0, 1, 0, 1, 1, 0, 1};
  static const float normals[] = {0.6f, 0, 0.8f, 0.6f, 0, 0.8f, 0.6f, 0, 0.8f, 0.6f, 0, 0.8f};
  static const uint32_t triangles[] = {0, 1, 2, 0, 2, 3};
  Stage s = {.engine = rf_engine_create(NULL)};
  s.scene = rf_scene_create(s.engine);
  CHECK(rf_set(s.scene, "materials.wood", "{\"kind\": \"lambert\"}"));
  rf_mesh_def def = rf_default_mesh_def();
  def.positions = positions;
  def.texcoords = texcoords;
  def.normals = normals;
  def.triangles = triangles;
  def.vertex_count = 4;
  def.triangle_count = 2;
  def.material = "wood";
  s.square = rf_add_mesh(s.scene, "square", &def);
  CHECK(rf_move(s.scene, s.square, (rf_frame){{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {5, 0, 0}}));
  s.ball = rf_add(s.scene, "sphere", "ball");
  CHECK(rf_set(s.scene, "lights.lamp",
               "{\"kind\": \"rect\", \"position\": [-5, 0, 0], \"target\": [-5, 0, 9]}"));
  s.world = rf_prepare(s.scene, NULL);
  CHECK(s.square.id && s.ball.id && s.world);
  rf_scene_destroy(s.scene); // worlds stand on their own
  return s;
}

static void stage_close(Stage *s)
{
  rf_world_destroy(s->world);
  rf_engine_destroy(s->engine);
}

static rf_ray down(float x, float y)
{
  return (rf_ray){.origin = {x, y, 9}, .direction = {0, 0, -1}, .tmax = INFINITY};
}

static bool is_near(rf_vec3 v, float x, float y, float z)
{
  return fabsf(v.x - x) < 1e-5f && fabsf(v.y - y) < 1e-5f && fabsf(v.z - z) < 1e-5f;
}

TEST(a_hit_names_what_was_hit)
{
  Stage s = stage_open();
  rf_hit hit;
  rf_ray ray = down(5.5f, -0.5f);
  CHECK(rf_intersect(s.world, &ray, &hit));
  CHECK(hit.object.id == s.square.id && hit.part == 0 && hit.t == 9);
  CHECK_NEAR(hit.u, 0.5, 1e-6); // weights of (1, -1) and (1, 1)
  CHECK_NEAR(hit.v, 0.25, 1e-6);
  ray = down(4.5f, 0.5f);
  CHECK(rf_intersect(s.world, &ray, &hit) && hit.part == 1);
  ray = down(0, 0);
  CHECK(rf_intersect(s.world, &ray, &hit) && hit.object.id == s.ball.id && hit.part == 0);
  ray = down(-5, 0);
  CHECK(rf_intersect(s.world, &ray, &hit) && hit.object.id == UINT32_MAX); // the lamp is no object
  ray = down(2, 3);
  ray.tmax = 77;
  CHECK(!rf_intersect(s.world, &ray, &hit) && hit.object.id == 0 && hit.t == 77);
  stage_close(&s);
}

TEST(batches_answer_as_single_rays_do)
{
  enum { COUNT = 3000 }; // more than one block
  static rf_ray rays[COUNT];
  static rf_hit hits[COUNT];
  static uint8_t blocked[COUNT];
  Stage s = stage_open();
  for (int i = 0; i < COUNT; i++) rays[i] = down(-7 + 14.0f * (float)i / COUNT, (float)(i % 7) / 4 - 1);
  rf_intersect_n(s.world, rays, hits, COUNT);
  rf_occluded_n(s.world, rays, blocked, COUNT);
  int count[3] = {0};
  for (int i = 0; i < COUNT; i++) {
    rf_hit one;
    const bool found = rf_intersect(s.world, &rays[i], &one);
    CHECK(!memcmp(&one.t, &hits[i].t, 3 * sizeof(float)) && one.object.id == hits[i].object.id);
    CHECK(!found || (one.part == hits[i].part && one.instance == hits[i].instance));
    CHECK(found == (blocked[i] != 0) && found == rf_occluded(s.world, &rays[i]));
    count[0] += one.object.id == s.square.id;
    count[1] += one.object.id == s.ball.id;
    count[2] += one.object.id == 0;
  }
  CHECK(count[0] > 300 && count[1] > 300 && count[2] > 300);
  rf_intersect_n(s.world, rays, hits, 0); // nothing to do is no error
  stage_close(&s);
}

TEST(the_surface_of_a_mesh)
{
  Stage s = stage_open();
  rf_hit hit;
  rf_ray ray = {.origin = {5.5f, -0.5f, -3}, .direction = {0, 0, 2}, .tmax = INFINITY}; // from behind
  CHECK(rf_intersect(s.world, &ray, &hit) && hit.t == 1.5f);
  const rf_surface at = rf_surface_at(s.world, &ray, &hit);
  CHECK(is_near(at.position, 5.5f, -0.5f, 0) && is_near(at.ng, 0, 0, 1) && is_near(at.n, 0.6f, 0, 0.8f));
  CHECK_NEAR(at.u, 0.75, 1e-6);
  CHECK_NEAR(at.v, 0.25, 1e-6);
  CHECK(at.is_back && at.error > 0 && at.error < 1e-5f);
  CHECK(at.material == 1 && at.material_name && !strcmp(at.material_name, "wood"));
  stage_close(&s);
}

// Anything but the position good to the last bits and the right error would hit the ball again.
TEST(a_ray_that_leaves_a_ball_does_not_meet_it_again)
{
  Stage s = stage_open();
  int wrong = 0, hits = 0;
  for (int i = 0; i < 1000; i++) {
    const float x = -1 + 0.002f * (float)i;
    rf_ray ray = {
        .origin = {3000 * x, 2000, 7000}, .direction = {-3000 * x, -2000.3f, -7000}, .tmax = INFINITY};
    rf_hit hit;
    if (!rf_intersect(s.world, &ray, &hit) || hit.object.id != s.ball.id) continue;
    hits++;
    const rf_surface at = rf_surface_at(s.world, &ray, &hit);
    const rf_vec3 p = at.position, n = at.ng;
    ray = (rf_ray){.origin = {p.x + at.error * n.x, p.y + at.error * n.y, p.z + at.error * n.z},
                   .direction = n,
                   .tmax = 1};
    wrong += rf_occluded(s.world, &ray);
    for (int k = 0; k < 3; k++) { // and one that goes in comes out on the far side, past the middle
      ray.origin = (rf_vec3){p.x - at.error * n.x, p.y - at.error * n.y, p.z - at.error * n.z};
      ray.direction = (rf_vec3){-n.x, -n.y, -n.z};
      ray.tmax = INFINITY;
      wrong += !rf_intersect(s.world, &ray, &hit) || hit.t < 0.5f;
    }
    CHECK(!at.is_back && at.material_name == NULL);
  }
  CHECK_MSG(wrong == 0 && hits == 1000, "%d wrong of %d", wrong, hits);
  stage_close(&s);
}

TEST(stats_tell_trees_from_arrays)
{
  Stage s = stage_open();
  const rf_world_stats stats = rf_world_take_stats(s.world);
  CHECK(stats.triangles == 2 && stats.tree_bytes > 0);
  CHECK(stats.geometry_bytes == stats.tree_bytes + 2 * 12 + 4 * (12 + 12 + 8));
  stage_close(&s);
}

TEST_MAIN
