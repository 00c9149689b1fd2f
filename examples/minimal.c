// The shortest way to a picture: load a scene or a model, make it ready, render, save.
//   cc minimal.c $(pkg-config --cflags --libs rayfold) -o minimal && ./minimal model.glb out.png

#include <rayfold/rayfold.h>

#include <stdio.h>

static int fail(rf_engine *e)
{
  const char *text;
  rf_error(e, &text);
  fprintf(stderr, "minimal: %s\n", text);
  return 1;
}

int main(int argc, char **argv)
{
  if (argc != 3) return fprintf(stderr, "usage: minimal SCENE OUT\n"), 64;
  rf_engine *engine = rf_engine_create(NULL);
  rf_scene *scene = engine ? rf_scene_load(engine, argv[1], NULL) : NULL;
  rf_world *world = scene ? rf_prepare(scene, NULL) : NULL;
  if (!world) return fail(engine);

  int width, height;
  rf_eye eye;
  const rf_render_def render = rf_scene_render_def(scene, &width, &height);
  const rf_develop_def develop = rf_scene_develop_def(scene);
  if (!rf_camera(scene, world, NULL, (float)width / (float)height, &eye)) return fail(engine);
  rf_film *film = rf_film_create(engine, width, height, RF_BEAUTY);
  if (!film || rf_render(world, &eye, &render, film, NULL) != RF_OK) return fail(engine);
  if (!rf_film_save(film, &develop, NULL, argv[2])) return fail(engine);

  rf_film_destroy(film);
  rf_world_destroy(world);
  rf_scene_destroy(scene);
  rf_engine_destroy(engine);
  return 0;
}
