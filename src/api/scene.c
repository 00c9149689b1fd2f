// Scenes through the public interface: load, save, edit, add, describe.

#include "api/api.h"

#include "base/mem.h"
#include "scene/pages.h"
#include "scene/export_mesh.h"
#include "scene/kinds.h"
#include "scene/rig.h"
#include "scene/vox.h"
#include "scene/track.h"
#include "world/merge.h"
#include "world/model_save.h"
#include "world/voxelise.h"

#include <stdio.h>
#include <string.h>

rf_load_def rf_default_load_def(void) { return (rf_load_def){.magic = MAGIC_LOAD}; }

static rf_scene *wrap(rf_engine *e, Scene *scene, const rf_load_def *def)
{
  rf_scene *s = scene ? mem_zero(1, sizeof *s) : NULL;
  if (!s) {
    Err err = {0};
    if (scene) api_fail((err_memory(&err, "a scene", sizeof *s), &err));
    scene_destroy(scene);
    return NULL;
  }
  s->engine = e;
  s->scene = scene;
  s->options.allow_outside = def && def->allow_outside;
  return s;
}

rf_scene *rf_scene_create(rf_engine *e)
{
  if (!e) return api_bad_argument("rf_scene_create", "the engine is NULL"), NULL;
  Err err = {0};
  Scene *scene = scene_create(&err);
  api_fail(&err);
  return wrap(e, scene, NULL);
}

// Shining on its own: a model with lamps in it is meant to be seen by their light. A glowing texture is a detail.
static bool has_lamps(const Scene *s)
{
  for (size_t i = 0; i < s->materials.count; i++) {
    const Material *m = &s->materials.items[i];
    if (m->kind != MATERIAL_PBR || m->pbr.emissive_texture >= 0 || m->pbr.emissive_strength <= 0) continue;
    if (m->pbr.emissive[0] > 0 || m->pbr.emissive[1] > 0 || m->pbr.emissive[2] > 0) return true;
  }
  return false;
}

// A model that brings no light gets a bright sky and a soft sun, so that opening it shows something. The sun stands
// to the side of where rf_camera() puts the eye: light from behind the eye shows no form.
static bool light_model(Scene *s, Err *err)
{
  if (!s->is_model || s->has_sky) return true;
  group_default(&group_sky, SKY_GRADIENT, &s->sky);
  s->has_sky = true;
  s->sky.gradient.gain = 0.3f; // with the sun below, a white matt surface comes out just under white
  if (s->lights.count || has_lamps(s)) return true;
  const int32_t i = scene_add_light(s, LIGHT_SUN, "stage_sun");
  if (i < 0) return err_memory(err, "a light", sizeof(Light));
  LightSun *sun = &s->lights.items[i].sun;
  memcpy(sun->direction, (float[3]){-0.6f, 0.75f, 0.55f}, sizeof sun->direction);
  memcpy(sun->irradiance, (float[3]){2.1f, 2.0f, 1.85f}, sizeof sun->irradiance);
  sun->angle = 6;
  return true;
}

// With caches: whatever has none is saved now, before any edit, and taken from there as it will be from now on.
static Scene *load_scene(rf_engine *e, const char *path, const LoadOptions *options, Err *err)
{
  Scene *scene = scene_load(path, options, err);
  if (!scene || !options->use_cache || !model_save_caches(scene, options, &e->cancel)) return scene;
  Scene *again = scene_load(path, options, NULL);
  scene_destroy(again ? scene : NULL);
  return again ? again : scene;
}

rf_scene *rf_scene_load(rf_engine *e, const char *path, const rf_load_def *def)
{
  if (!e || !path) return api_bad_argument("rf_scene_load", "engine and path must not be NULL"), NULL;
  if (def && !api_has_magic(def->magic, MAGIC_LOAD, "rf_scene_load", "rf_load_def")) return NULL;
  Err err = {0};
  const LoadOptions options = {
      .allow_outside = def && def->allow_outside, .use_cache = def && def->cache, .jobs = e->jobs,
      .element = def ? def->element : NULL};
  Scene *scene = load_scene(e, path, &options, &err);
  if (scene && !light_model(scene, &err)) {
    scene_destroy(scene);
    scene = NULL;
  }
  api_fail(&err);
  if (scene) api_log_notes(e, &scene->notes);
  return wrap(e, scene, def);
}

void rf_scene_destroy(rf_scene *s)
{
  if (!s) return;
  scene_destroy(s->scene);
  history_finish(&s->history);
  text_finish(&s->answer);
  mem_free(s);
}

// All surfaces in one mesh; writers of that kind take nothing else.
static bool save_merged(rf_scene *s, const char *path, bool (*export)(const MeshData *, const char *, Err *), Err *err)
{
  World *w = world_prepare(s->scene, NULL, &s->options, s->engine->jobs, &s->engine->cancel, err);
  MeshData *m = w ? world_merge(w, err) : NULL;
  const bool ok = m && export(m, path, err);
  mesh_data_release(m);
  world_release(w);
  return ok;
}

static bool save_voxels(rf_scene *s, const char *path, Err *err)
{
  uint32_t reduced = 0;
  const bool is_grid = text_ends(path, ".grid");
  Voxels *v = scene_merge_voxels(s->scene, err);
  if (!v && !err->kind)
    return err_set(err, ERR_BAD_SCENE, "\"%s\": the scene is not all voxels on one lattice; make voxels of it first (rf_voxelise, "
                   "`rayfold convert --voxels N`)", path);
  const bool ok = v && (is_grid ? export_grid(v, (double)s->scene->objects.items[0].shape.voxels.voxel_size, path, err)
                                : vox_write(v, path, &reduced, err));
  voxels_release(v);
  if (ok && is_grid)
    note_once(&s->scene->notes, "%s: a grid holds densities and no colours; as smoke in a scene file voxels keep theirs",
              path);
  if (ok && reduced)
    note_once(&s->scene->notes, "%s: %u kinds of voxels became the nearest of 255, which is all a .vox file holds", path, reduced);
  return ok;
}

// One object of voxels, where the surfaces of the world were.
static Scene *voxel_scene(const World *w, int side, bool is_solid, float density, Err *err)
{
  float cell, corner[3];
  Scene *made = scene_create(err);
  SceneVoxels v = {.data = made ? world_voxelise(w, side, is_solid, density, &cell, corner, err) : NULL};
  const int32_t voxels_i = v.data ? scene_add_voxels(made, &v) : -1;
  const int32_t object = voxels_i >= 0 ? scene_add_object(made, SHAPE_VOXELS, "voxels") : -1;
  if (object < 0) {
    if (v.data) err_memory(err, "voxels", 0);
    scene_destroy(made);
    return NULL;
  }
  Object *o = &made->objects.items[object];
  o->shape.voxels_i = voxels_i;
  o->shape.voxels.voxel_size = cell;
  memcpy(o->common.translate, corner, sizeof corner);
  made->is_model = true;
  return made;
}

rf_scene *rf_voxelise(rf_scene *s, int side, bool is_solid, float density)
{
  if (!s) return api_bad_argument("rf_voxelise", "the scene is NULL"), NULL;
  if (side < 0 || side > VOXELS_MOST_SIDE)
    return api_bad_argument("rf_voxelise", "%d cells a side; there are 1 to %d", side, VOXELS_MOST_SIDE), NULL;
  if (!(density >= 0))
    return api_bad_argument("rf_voxelise", "a density of %g; it must not be below 0", (double)density), NULL;
  Err err = {0};
  World *w = world_prepare(s->scene, NULL, &s->options, s->engine->jobs, &s->engine->cancel, &err);
  Scene *made = w ? voxel_scene(w, side, is_solid, density, &err) : NULL;
  world_release(w);
  api_fail(&err);
  return made ? wrap(s->engine, made, NULL) : NULL;
}

bool rf_scene_save(rf_scene *s, const char *path)
{
  if (!s || !path) return api_bad_argument("rf_scene_save", "scene and path must not be NULL");
  Err err = {0};
  if (text_ends(path, ".json")) scene_save(s->scene, path, &err);
  else if (text_ends(path, ".rfm")) model_save(s->scene, path, s->engine->jobs, &s->engine->cancel, &err);
  else if (text_ends(path, ".ply")) save_merged(s, path, export_ply, &err);
  else if (text_ends(path, ".obj")) save_merged(s, path, export_obj, &err);
  else if (text_ends(path, ".stl")) save_merged(s, path, export_stl, &err);
  else if (text_ends(path, ".vox") || text_ends(path, ".grid")) save_voxels(s, path, &err);
  else
    err_set(&err, ERR_BAD_ARGUMENT, "\"%s\": a scene can be saved as .json or .rfm, its triangles as .ply, .obj or .stl, and its "
            "voxels as .vox or .grid",
            path);
  return api_fail(&err);
}

bool rf_scene_check(rf_scene *s)
{
  if (!s) return api_bad_argument("rf_scene_check", "the scene is NULL");
  Err err = {0};
  World *w = scene_check_files(s->scene, &err)
                 ? world_prepare(s->scene, NULL, &s->options, s->engine->jobs, &s->engine->cancel, &err)
                 : NULL;
  world_release(w);
  return api_fail(&err);
}

const char *rf_scene_note(const rf_scene *s, size_t i)
{
  return s && i < s->scene->notes.lines.count ? s->scene->notes.lines.items[i] : NULL;
}

// --- edits ----------------------------------------------------------------------------------------
bool rf_set(rf_scene *s, const char *path, const char *json)
{
  if (!s || !path || !json) return api_bad_argument("rf_set", "scene, path and value must not be NULL");
  Err err = {0};
  history_set(&s->history, s->scene, path, json, &err);
  return api_fail(&err);
}

const char *rf_get(rf_scene *s, const char *path)
{
  if (!s || !path) return api_bad_argument("rf_get", "scene and path must not be NULL"), NULL;
  Err err = {0};
  text_clear(&s->answer);
  scene_get(s->scene, path, &s->answer, &err);
  return api_fail(&err) ? text_get(&s->answer) : NULL;
}

bool rf_undo(rf_scene *s)
{
  if (!s) return api_bad_argument("rf_undo", "the scene is NULL");
  Err err = {0};
  const bool done = history_undo(&s->history, s->scene, &err);
  return api_fail(&err) && done;
}

bool rf_redo(rf_scene *s)
{
  if (!s) return api_bad_argument("rf_redo", "the scene is NULL");
  Err err = {0};
  const bool done = history_redo(&s->history, s->scene, &err);
  return api_fail(&err) && done;
}

// --- animation ------------------------------------------------------------------------------------
bool rf_set_time(rf_scene *s, double seconds)
{
  if (!s) return api_bad_argument("rf_set_time", "the scene is NULL");
  if (!(fabs(seconds) <= 1e9)) return api_bad_argument("rf_set_time", "%g s is no moment", seconds);
  Err err = {0};
  scene_set_time(s->scene, seconds, NULL, &err);
  return api_fail(&err);
}

const char *rf_clip_name(const rf_scene *s, size_t i)
{
  const Rig *r = s ? s->scene->rig : NULL;
  return r && i < r->clips.count ? r->clips.items[i].name : NULL;
}

bool rf_animation_range(const rf_scene *s, double *start, double *end, double *fps)
{
  double a = 0, b = 0;
  const bool moves = s && scene_time_range(s->scene, &a, &b);
  if (start) *start = moves ? a : 0;
  if (end) *end = moves ? b : 0;
  if (fps) *fps = s ? (double)s->scene->timeline.fps : 0;
  return moves;
}

// --- texts ----------------------------------------------------------------------------------------
static char *give(Text *t)
{
  if (!t->failed && t->data) return t->data; // memory of posix_memalign: rf_free() may free it
  Err err = {0};
  err_memory(&err, "a text", t->length);
  api_fail(&err);
  text_finish(t);
  return NULL;
}

char *rf_schema(rf_engine *e)
{
  (void)e;
  Text t = {0};
  scene_schema(&t);
  return give(&t);
}

char *rf_manual(rf_engine *e)
{
  (void)e;
  Text t = {0};
  scene_manual(&t);
  return give(&t);
}

char *rf_scene_info(rf_scene *s)
{
  if (!s) return api_bad_argument("rf_scene_info", "the scene is NULL"), NULL;
  Text t = {0};
  scene_info(s->scene, &t);
  return give(&t);
}

// --- adding ---------------------------------------------------------------------------------------
rf_mesh_def rf_default_mesh_def(void) { return (rf_mesh_def){.magic = MAGIC_MESH}; }

static float *copy_floats(const float *from, size_t count, size_t width)
{
  float *to = from ? mem_alloc(count, width * sizeof *to) : NULL;
  if (to) memcpy(to, from, count * width * sizeof *to);
  return to;
}

static MeshData *copy_mesh(const rf_mesh_def *def, Err *err)
{
  MeshData *m = mesh_data_create();
  if (!m) goto failed;
  m->vertex_count = def->vertex_count;
  m->triangle_count = def->triangle_count;
  m->positions = copy_floats(def->positions, def->vertex_count, 3);
  m->normals = copy_floats(def->normals, def->vertex_count, 3);
  m->texcoords[0] = copy_floats(def->texcoords, def->vertex_count, 2);
  m->triangles = mem_alloc(def->triangle_count, 3 * sizeof *m->triangles);
  if (!m->positions || !m->triangles || (def->normals && !m->normals) || (def->texcoords && !m->texcoords[0]))
    goto failed;
  memcpy(m->triangles, def->triangles, def->triangle_count * 3 * sizeof *m->triangles);
  return m;
failed:
  mesh_data_release(m);
  err_memory(err, "a mesh", 12ull * (def->vertex_count + def->triangle_count));
  return NULL;
}

static rf_object object_handle(const rf_scene *s, int32_t object_i)
{
  return (rf_object){object_i >= 0 ? s->scene->objects.items[object_i].id : 0};
}

rf_object rf_add_mesh(rf_scene *s, const char *name, const rf_mesh_def *def)
{
  const rf_object none = {0};
  if (!s || !def) return api_bad_argument("rf_add_mesh", "scene and definition must not be NULL"), none;
  if (!api_has_magic(def->magic, MAGIC_MESH, "rf_add_mesh", "rf_mesh_def")) return none;
  if (!def->positions || !def->triangles || !def->vertex_count || !def->triangle_count)
    return api_bad_argument("rf_add_mesh", "a mesh needs positions and triangles"), none;
  Err err = {0};
  const int32_t material = def->material ? scene_find_material(s->scene, def->material) : -1;
  if (def->material && material < 0)
    return api_bad_argument("rf_add_mesh", "material \"%s\" is not defined; rf_set(\"materials.%s\", ...) first",
                            def->material, def->material),
           none;
  MeshData *m = copy_mesh(def, &err);
  int32_t object = -1;
  if (m && mesh_data_check(m, name ? name : "mesh", &s->scene->notes, &err)) {
    const int32_t mesh = scene_add_mesh(s->scene, name, m);
    object = mesh >= 0 ? scene_add_object(s->scene, SHAPE_MESH, name) : -1;
    if (object >= 0) {
      s->scene->objects.items[object].shape.mesh_i = mesh;
      s->scene->objects.items[object].common.material = material;
    } else {
      err_memory(&err, "an object", sizeof(Object));
    }
  } else {
    mesh_data_release(m);
  }
  return api_fail(&err) ? object_handle(s, object) : none;
}

rf_object rf_add(rf_scene *s, const char *shape, const char *name)
{
  const rf_object none = {0};
  if (!s || !shape) return api_bad_argument("rf_add", "scene and shape must not be NULL"), none;
  const int32_t kind = group_find_kind(&group_shape, shape);
  if (kind < 0) return api_bad_argument("rf_add", "there is no shape \"%s\"", shape), none;
  if (kind == SHAPE_MESH) return api_bad_argument("rf_add", "use rf_add_mesh() for meshes"), none;
  Err err = {0};
  const int32_t object = scene_add_object(s->scene, (ShapeKind)kind, name);
  if (object < 0) err_memory(&err, "an object", sizeof(Object));
  return api_fail(&err) ? object_handle(s, object) : none;
}

// Ids rise along the list: objects join at its end, and an undo puts one back where it was.
static Object *find_object(const rf_scene *s, uint32_t id)
{
  Object *items = s ? s->scene->objects.items : NULL;
  size_t low = 0, high = s ? s->scene->objects.count : 0;
  while (low < high) {
    const size_t middle = low + (high - low) / 2;
    if (items[middle].id == id) return &items[middle];
    if (items[middle].id < id)
      low = middle + 1;
    else
      high = middle;
  }
  return NULL;
}

rf_object rf_find(const rf_scene *s, const char *name)
{
  return s ? object_handle(s, section_index(s->scene, section_find(group_object.name), name))
           : (rf_object){0};
}

bool rf_move(rf_scene *s, rf_object o, rf_frame f)
{
  Object *object = find_object(s, o.id);
  if (!object) return api_bad_argument("rf_move", "no object with id %u in this scene", o.id);
  const float m[12] = {f.x.x, f.x.y, f.x.z, f.y.x, f.y.y, f.y.z, f.z.x, f.z.y, f.z.z, f.p.x, f.p.y, f.p.z};
  for (int i = 0; i < 12; i++)
    if (!isfinite(m[i])) return api_bad_argument("rf_move", "the frame holds numbers that are not finite");
  const Frame frame = {v3_load(m), v3_load(m + 3), v3_load(m + 6), v3_load(m + 9)};
  if (frame_determinant(&frame) == 0)
    return api_bad_argument("rf_move", "the frame is singular: it would flatten the object");
  memcpy(object->common.matrix, m, sizeof m);
  return true;
}

// Names the first that is not finite.
static bool vectors_are_finite(const float *x, size_t count, const char *what)
{
  for (size_t i = 0; x && i < count; i++)
    if (!isfinite(x[3 * i]) || !isfinite(x[3 * i + 1]) || !isfinite(x[3 * i + 2]))
      return api_bad_argument("rf_move_vertices", "%s %zu is (%g, %g, %g); all must be finite", what, i,
                              (double)x[3 * i], (double)x[3 * i + 1], (double)x[3 * i + 2]);
  return true;
}

bool rf_move_vertices(rf_scene *s, rf_object o, const float *positions, const float *normals, size_t vertex_count)
{
  const Object *object = find_object(s, o.id);
  if (!object) return api_bad_argument("rf_move_vertices", "no object with id %u in this scene", o.id);
  if (!positions) return api_bad_argument("rf_move_vertices", "positions must not be NULL");
  const Shape *shape = &object->shape;
  if (shape->kind != SHAPE_MESH || shape->mesh_i < 0)
    return api_bad_argument("rf_move_vertices", "object %u has no mesh of its own; only one made by rf_add_mesh(), or "
                                                "of a model that is the scene, has vertices to move", o.id);
  Mesh *mesh = &s->scene->meshes.items[shape->mesh_i];
  if (vertex_count != mesh->data->vertex_count)
    return api_bad_argument("rf_move_vertices", "the mesh has %zu vertices, but %zu are given; it keeps their number",
                            mesh->data->vertex_count, vertex_count);
  if (!vectors_are_finite(positions, vertex_count, "position") || !vectors_are_finite(normals, vertex_count, "normal"))
    return false;
  Err err = {0};
  MeshData *moved = mesh_data_move(mesh->data, positions, normals);
  if (!moved) err_memory(&err, "moved vertices", 12ull * vertex_count);
  if (!api_fail(&err)) return false;
  mesh_data_release(mesh->data);
  mesh->data = moved;
  return true;
}

bool rf_remove(rf_scene *s, rf_object o)
{
  Object *object = find_object(s, o.id);
  if (!object) return api_bad_argument("rf_remove", "no object with id %u in this scene", o.id);
  char path[40];
  snprintf(path, sizeof path, "objects[%zu]", (size_t)(object - s->scene->objects.items));
  return rf_set(s, path, "null");
}
