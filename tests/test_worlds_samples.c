// The sample worlds of scenes/worlds: each loads without a note and renders without a bad sample; and each as a furnace,
// where every surface scatters half and emits half and every sky and end of sight is 1, shows 1 everywhere, whatever
// its gates turn, mirror and scale: L = e / (1 - a). A gate that lost, doubled or scaled light would show.

#include "tests/render_sample.h"

#include <dirent.h>

enum { WIDTH = 32, HEIGHT = 18 };

static double mean_of(Scene *s, const char *name, int spp)
{
  World *w = world_of(s);
  Film *f = film_create(WIDTH, HEIGHT, 1 << FILM_BEAUTY | 1 << FILM_VARIANCE, NULL);
  Eye eye;
  CHECK_MSG(eye_from_camera(&s->camera, &eye, NULL), "%s", name);
  RenderJob job = job_of(s, w, eye, f, (uint32_t)spp);
  RenderStats stats = {0};
  CHECK_MSG(render_run(&job, NULL, hot_table(cpu_best_isa()), NULL, &stats, NULL), "%s", name);
  CHECK_MSG(stats.bad_samples == 0, "%s: %d bad samples", name, (int)stats.bad_samples);
  const double mean = (double)summarize(f).mean[1];
  film_destroy(f);
  world_release(w);
  return mean;
}

static void make_furnace(Scene *s)
{
  const int32_t m = scene_add_material(s, MATERIAL_PBR, "furnace");
  Pbr *p = &s->materials.items[m].pbr;
  set3(p->base_color, 0.5f, 0.5f, 0.5f);
  set3(p->emissive, 0.5f, 0.5f, 0.5f);
  p->roughness = 1;
  p->specular = 0;
  const Material furnace = s->materials.items[m];
  for (size_t i = 0; i < s->materials.count; i++) {
    const char *name = s->materials.items[i].name;
    s->materials.items[i] = furnace;
    s->materials.items[i].name = name;
  }
  for (size_t i = 0; i < s->objects.count; i++) s->objects.items[i].common.material = m;
  s->lights.count = 0;
  for (size_t i = 0; i <= s->skies.count; i++) {
    Sky *sky = i < s->skies.count ? &s->skies.items[i].sky : &s->sky;
    *sky = (Sky){.kind = SKY_CONSTANT};
    set3(sky->constant.color, 1, 1, 1);
    sky->constant.gain = 1;
  }
  set3(s->render.fade_color, 1, 1, 1);
  for (size_t i = 0; i < s->voxels.count; i++) { // which keep colours of their own
    VoxelPalette *palette = s->voxels.items[i].data->palette;
    for (uint32_t k = 0; k < palette->entry_count; k++) set3(palette->entries[k].color, 1, 1, 1);
  }
  for (size_t i = 0; i < s->gates.count; i++) {
    Gate *g = &s->gates.items[i];
    if (g->kind != GATE_BLACK_HOLE) continue;
    g->black_hole.disk_outer = 0; // which shines more on one side
    set3(g->black_hole.caught, 1, 1, 1);
  }
  s->render.max_depth = 24;
  s->render.clamp = 0; // which would take light
}

static void check_world(const char *file)
{
  char path[512];
  Err err = {0};
  snprintf(path, sizeof path, "scenes/worlds/%s", file);
  Scene *s = scene_load(path, NULL, &err);
  CHECK_MSG(s, "%s", err.text);
  if (!s) return;
  CHECK_MSG(!s->notes.lines.count, "%s: %s", file, s->notes.lines.items[0]);
  CHECK_MSG(scene_check_files(s, &err), "%s", err.text);
  s->render.integrator = INTEGRATOR_PATH;
  CHECK_MSG(mean_of(s, file, 1) > 0.01, "%s is dark", file);
  make_furnace(s);
  const double light = mean_of(s, file, TEST_IS_SLOW ? 2 : 8);
  CHECK_MSG(fabs(light - 1) < 0.02, "%s as a furnace shows %g", file, light);
  scene_destroy(s);
}

TEST(every_sample_world_is_whole_and_loses_no_light)
{
  DIR *folder = opendir("scenes/worlds");
  CHECK(folder);
  int count = 0;
  for (const struct dirent *e; folder && (e = readdir(folder));) {
    const size_t n = strlen(e->d_name);
    if (n < 5 || strcmp(e->d_name + n - 5, ".json")) continue;
    check_world(e->d_name);
    count++;
  }
  if (folder) closedir(folder);
  CHECK_MSG(count >= 25, "%d worlds", count);
}

TEST_MAIN
