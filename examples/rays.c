// Only ray casting: a mesh goes in as arrays, hits come out. No scene file, no picture.
//   cc rays.c $(pkg-config --cflags --libs rayfold) -o rays && ./rays

#include <rayfold/rayfold.h>

#include <math.h>
#include <stdio.h>

int main(void)
{
  // A tetrahedron.
  const float positions[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  const uint32_t triangles[] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};

  rf_engine *engine = rf_engine_create(NULL);
  rf_scene *scene = engine ? rf_scene_create(engine) : NULL;
  if (!scene) return 1;
  rf_mesh_def mesh = rf_default_mesh_def();
  mesh.positions = positions;
  mesh.triangles = triangles;
  mesh.vertex_count = mesh.triangle_count = 4;
  const rf_object object = rf_add_mesh(scene, "tetrahedron", &mesh);
  rf_world *world = rf_prepare(scene, NULL);
  if (!world) {
    const char *text;
    rf_error(engine, &text);
    return fprintf(stderr, "rays: %s\n", text), 1;
  }

  const rf_ray ray = {.origin = {0.2f, 0.2f, 5}, .direction = {0, 0, -1}, .tmin = 0, .tmax = INFINITY};
  rf_hit hit;
  if (!rf_intersect(world, &ray, &hit)) return fprintf(stderr, "rays: the ray missed\n"), 1;
  const rf_surface surface = rf_surface_at(world, &ray, &hit);
  printf("hit at t = %g, triangle %u, normal %.3f %.3f %.3f, %s\n", (double)hit.t, hit.part,
         (double)surface.ng.x, (double)surface.ng.y, (double)surface.ng.z,
         hit.object.id == object.id ? "our object" : "something else");

  // A ray on from there, away from the surface, meets nothing more.
  const rf_vec3 p = surface.position, n = surface.ng;
  const float e = surface.error;
  const rf_ray on = {
      .origin = {p.x + e * n.x, p.y + e * n.y, p.z + e * n.z}, .direction = n, .tmax = INFINITY};
  const bool is_right = fabsf(hit.t - 4.4f) < 1e-5f && hit.part == 3 && hit.object.id == object.id &&
                        rf_occluded(world, &ray) && !rf_occluded(world, &on);

  rf_world_destroy(world);
  rf_scene_destroy(scene);
  rf_engine_destroy(engine);
  return is_right ? 0 : 1;
}
