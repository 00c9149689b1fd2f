// Nodes of a glTF file: the hierarchy is walked once, by a stack of our own, for the map of each node to the world;
// then meshes become objects, cameras cameras and lights lights, in the order of the walk. A mesh that several nodes
// name is read once and placed several times. EXT_mesh_gpu_instancing places it once more for each instance.

#include "scene/gltf_access.h"
#include "scene/rig.h"

#include <string.h>

typedef struct Walk {
  Gltf *g;
  size_t node_count;
  uint32_t *parents; // NO_PARENT for roots
  uint32_t *order; // the nodes of the scene, each after its parent; a stack grows down from the end meanwhile
  size_t order_count;
  bool *is_reached;
  Frame *worlds;
  uint32_t *uses; // of each mesh, by nodes so far
} Walk;

#define NO_PARENT UINT32_MAX

// --- one node's map -------------------------------------------------------------------------------
static Frame frame_of(Vec3 translation, const float rotation[4], Vec3 scale)
{
  // Unit quaternion x, y, z, w to axes (Shoemake, "Animating rotation with quaternion curves", 1985).
  const float n = sqrtf(sqr_f(rotation[0]) + sqr_f(rotation[1]) + sqr_f(rotation[2]) + sqr_f(rotation[3]));
  const float inv = n > 0 ? 1 / n : 0;
  const float x = rotation[0] * inv, y = rotation[1] * inv, z = rotation[2] * inv,
              w = n > 0 ? rotation[3] * inv : 1;
  return (Frame){v3(1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)) * scale[0],
                 v3(2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)) * scale[1],
                 v3(2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)) * scale[2],
                 translation};
}

static bool read_frame(Gltf *g, const Json *node, Frame *out)
{
  float m[16] = {0}, t[3] = {0, 0, 0}, r[4] = {0, 0, 0, 1}, s[3] = {1, 1, 1};
  if (js_get(node, "matrix")) {
    if (!gltf_floats(g, node, "matrix", 16, m)) return false;
    *out = (Frame){v3_load(m), v3_load(m + 4), v3_load(m + 8), v3_load(m + 12)};
    return true;
  }
  if (!gltf_floats(g, node, "translation", 3, t) || !gltf_floats(g, node, "rotation", 4, r) ||
      !gltf_floats(g, node, "scale", 3, s))
    return false;
  *out = frame_of(v3_load(t), r, v3_load(s));
  return true;
}

// --- the walk -------------------------------------------------------------------------------------
static bool item_index(Walk *w, const Json *list, size_t i, const char *what, size_t *out)
{
  const double x = js_number(js_at(list, i), -1);
  if (!(x >= 0 && x < (double)w->node_count) || x != floor(x))
    return js_fail(w->g->doc, list, NULL, i, false, w->g->err, "%s must be the number of a node, under %zu",
                   what, w->node_count);
  *out = (size_t)x;
  return true;
}

// glTF asks for trees: a node has one parent at most. Then whatever is not under a root is on a cycle.
static bool find_parents(Walk *w)
{
  for (size_t i = 0; i < w->node_count; i++) w->parents[i] = NO_PARENT;
  for (size_t i = 0; i < w->node_count; i++) {
    const Json *children = js_get(gltf_item(w->g, "nodes", i), "children");
    const size_t count = js_kind(children) == JSON_LIST ? js_count(children) : 0;
    for (size_t k = 0; k < count; k++) {
      size_t child;
      if (!item_index(w, children, k, "a child", &child)) return false;
      if (w->parents[child] != NO_PARENT)
        return js_fail(
            w->g->doc, children, NULL, k, false, w->g->err,
            "nodes[%zu] is a child of both nodes[%u] and nodes[%zu]; a node has one parent at most", child,
            w->parents[child], i);
      w->parents[child] = (uint32_t)i;
    }
  }
  return true;
}

// Everything below a root. The stack lives in the free end of `order`: each node is on it once at most, and nodes
// waiting and nodes done together are never more than all.
static bool walk_from(Walk *w, size_t root)
{
  size_t top = w->node_count;
  if (w->is_reached[root])
    return gltf_fail_item(w->g, "nodes", root,
                          "the scene reaches this node twice; list root nodes only, each once");
  w->is_reached[root] = true;
  w->order[--top] = (uint32_t)root;
  while (top < w->node_count) {
    const uint32_t i = w->order[top++];
    const Json *node = gltf_item(w->g, "nodes", i), *children = js_get(node, "children");
    Frame local;
    if (js_kind(node) != JSON_DICT) return gltf_fail_item(w->g, "nodes", i, "a node must be a dictionary");
    if (!read_frame(w->g, node, &local)) return false;
    w->worlds[i] = i == root ? local : frame_product(&w->worlds[w->parents[i]], &local);
    w->order[w->order_count++] = i;
    // Backwards, so that the first child is taken first.
    for (size_t k = js_kind(children) == JSON_LIST ? js_count(children) : 0; k-- > 0;) {
      const uint32_t child = (uint32_t)js_number(js_at(children, k), 0);
      if (w->is_reached[child])
        return gltf_fail_item(w->g, "nodes", child,
                              "the scene lists this node and one above it; list root nodes only");
      w->is_reached[child] = true;
      w->order[--top] = child;
    }
  }
  return true;
}

static bool check_cycles(Walk *w)
{
  // Steps up from each node, but never over ground already covered; a mark of this round met again is a cycle.
  uint32_t *round = gltf_alloc(w->g, w->node_count, sizeof *round, "nodes");
  if (!round) return false;
  memset(round, 0, w->node_count * sizeof *round);
  bool ok = true;
  for (size_t i = 0; ok && i < w->node_count; i++) {
    uint32_t at = (uint32_t)i;
    while (at != NO_PARENT && !round[at]) {
      round[at] = (uint32_t)i + 1;
      at = w->parents[at];
    }
    if (at != NO_PARENT && round[at] == (uint32_t)i + 1)
      ok = gltf_fail_item(w->g, "nodes", at,
                          "the nodes go round in a circle here; a node cannot be below itself");
  }
  mem_free(round);
  return ok;
}

static bool walk_scene(Walk *w)
{
  size_t scene_i;
  if (!gltf_index(w->g, w->g->root, "scene", "scenes", &scene_i)) return false;
  const Json *scene = gltf_item(w->g, "scenes", scene_i == GLTF_NONE ? 0 : scene_i);
  if (!scene) {
    for (size_t i = 0; i < w->node_count; i++)
      if (w->parents[i] == NO_PARENT && !walk_from(w, i)) return false;
    return true;
  }
  const Json *roots = js_get(scene, "nodes");
  const size_t count = js_kind(roots) == JSON_LIST ? js_count(roots) : 0;
  for (size_t k = 0; k < count; k++) {
    size_t root;
    if (!item_index(w, roots, k, "a node of a scene", &root) || !walk_from(w, root)) return false;
  }
  return true;
}

// --- objects --------------------------------------------------------------------------------------
// A frame that cannot be turned back has squeezed the mesh flat or away, which is how some files hide things.
static bool is_visible(Gltf *g, const Frame *world, const char *name)
{
  const Frame inverse = frame_inverse(world);
  const bool ok = !v3_is_zero(inverse.x) && v3_is_finite(world->x) && v3_is_finite(world->y) &&
                  v3_is_finite(world->z) && v3_is_finite(world->p);
  if (!ok) note_once(&g->scene->notes, "%s: \"%s\" is scaled to nothing and is left out", g->path, name);
  return ok;
}

// Objects of one node: world is where it stands, local the instance's own map below it.
typedef struct Placed {
  uint32_t node; // in the rig
  Frame world, local;
  const char *name;
} Placed;

static bool add_objects(Gltf *g, const GltfMesh *mesh, const Placed *placed)
{
  const Frame world = frame_product(&placed->world, &placed->local);
  const char *name = placed->name;
  if (!is_visible(g, &world, name)) return true;
  if (!gltf_charge(g, mesh->count, sizeof(Object) + GLTF_NAME_SIZE, "objects")) return false;
  for (size_t i = 0; i < mesh->count; i++) {
    const int32_t at = scene_add_object(g->scene, SHAPE_MESH, name);
    if (at < 0) return err_memory(g->err, "objects", sizeof(Object));
    Object *o = &g->scene->objects.items[at];
    o->shape.mesh_i = (int32_t)(mesh->first + i);
    v3_store(o->common.matrix, world.x);
    v3_store(o->common.matrix + 3, world.y);
    v3_store(o->common.matrix + 6, world.z);
    v3_store(o->common.matrix + 9, world.p);
    const bool is_bent = gltf_rig_is_bent(g, placed->node, o->shape.mesh_i);
    if (!gltf_rig_add_object(g, o->id, placed->node, is_bent, &placed->local)) return false;
  }
  return true;
}

// One attribute of EXT_mesh_gpu_instancing; *count takes the first one's count and the others must agree.
static bool open_instances(Gltf *g, const Json *attributes, const char *key, int width, size_t *count,
                           Accessor *a, bool *is_given)
{
  if (!accessor_open(g, attributes, key, is_given, a)) return false;
  if (!*is_given) return true;
  if (a->width != width || (*count && a->count != *count))
    return gltf_fail(g, attributes, key,
                     "accessors[%zu] does not go with the other attributes of the instances", a->index);
  *count = a->count;
  return true;
}

static bool add_instances(Gltf *g, const Json *instancing, const GltfMesh *mesh, const Placed *node)
{
  const Json *attributes = js_get(instancing, "attributes");
  Accessor translations, rotations, scales;
  bool has_t, has_r, has_s;
  size_t count = 0;
  if (!open_instances(g, attributes, "TRANSLATION", 3, &count, &translations, &has_t) ||
      !open_instances(g, attributes, "ROTATION", 4, &count, &rotations, &has_r) ||
      !open_instances(g, attributes, "SCALE", 3, &count, &scales, &has_s))
    return false;
  for (size_t i = 0; i < count; i++) {
    float t[3] = {0, 0, 0}, r[4] = {0, 0, 0, 1}, s[3] = {1, 1, 1};
    if (has_t) accessor_floats(&translations, i, 1, 3, t);
    if (has_r) accessor_floats(&rotations, i, 1, 4, r);
    if (has_s) accessor_floats(&scales, i, 1, 3, s);
    Placed placed = *node;
    placed.local = frame_of(v3_load(t), r, v3_load(s));
    if (!add_objects(g, mesh, &placed)) return false;
  }
  return true;
}

static bool add_mesh_of(Walk *w, const Json *node, uint32_t place, const Frame *world)
{
  Gltf *g = w->g;
  const Json *instancing = gltf_extension(node, "EXT_mesh_gpu_instancing");
  size_t mesh_i, skin_i;
  const GltfMesh *mesh;
  if (!gltf_index(g, node, "mesh", "meshes", &mesh_i) || !gltf_index(g, node, "skin", "skins", &skin_i))
    return false;
  if (mesh_i == GLTF_NONE) return true;
  GltfMesh own;
  if (!gltf_add_mesh(g, mesh_i, &mesh) ||
      !gltf_rig_add_shapes(g, mesh, skin_i, place, w->uses[mesh_i]++ > 0, &own))
    return false;
  char name[GLTF_NAME_SIZE];
  gltf_name(js_get(node, "name") ? node : gltf_item(g, "meshes", mesh_i), "mesh", mesh_i, name);
  const Placed placed = {place, *world, frame_identity(), name};
  return instancing ? add_instances(g, instancing, &own, &placed) : add_objects(g, &own, &placed);
}

// --- cameras --------------------------------------------------------------------------------------
static bool read_lens(Gltf *g, const Json *json, Camera *c)
{
  if (c->kind == CAMERA_ORTHOGRAPHIC) {
    float half_height = 1;
    if (!gltf_floats(g, js_get(json, "orthographic"), "ymag", 1, &half_height)) return false;
    c->orthographic.height = clamp_f(2 * fabsf(half_height), 1e-6f, FLT_MAX);
    return true;
  }
  float yfov = PI / 4;
  if (!gltf_floats(g, js_get(json, "perspective"), "yfov", 1, &yfov)) return false;
  c->perspective.fov = clamp_f(yfov * (180 / PI), 0.01f, 179);
  return true;
}

static bool add_camera_of(Gltf *g, const Json *node, uint32_t place, const Frame *world)
{
  size_t camera_i;
  if (!gltf_index(g, node, "camera", "cameras", &camera_i)) return false;
  if (camera_i == GLTF_NONE) return true;
  const Json *json = gltf_item(g, "cameras", camera_i);
  const bool is_flat = text_equal(js_text(js_get(json, "type")), "orthographic");
  char name[GLTF_NAME_SIZE];
  gltf_name(js_get(json, "name") ? json : node, "camera", camera_i, name);
  if (!gltf_charge(g, 1, sizeof(Camera) + GLTF_NAME_SIZE, "cameras")) return false;
  const int32_t at = scene_add_camera(g->scene, is_flat ? CAMERA_ORTHOGRAPHIC : CAMERA_PERSPECTIVE, name);
  if (at < 0) return err_memory(g->err, "cameras", sizeof(Camera));
  Camera *c = &g->scene->cameras.items[at];
  rig_place_camera(c, world);
  if (!read_lens(g, json, c) || !gltf_rig_add_camera(g, c->name, place, at == 0)) return false;
  if (at == 0) {
    g->scene->camera = *c;
    g->scene->camera.name = NULL;
    g->scene->has_camera = true;
  }
  return true;
}

// --- all of it ------------------------------------------------------------------------------------
static bool add_light_of(Gltf *g, const Json *node, size_t node_i, uint32_t place, const Frame *world)
{
  bool is_added;
  if (!gltf_add_light(g, node, node_i, world, &is_added)) return false;
  return !is_added || gltf_rig_add_light(g, g->scene->lights.items[g->scene->lights.count - 1].name, place);
}

// A number in the rig is one in the order of the walk, where parents come first.
static bool add_rig_nodes(Walk *w)
{
  Gltf *g = w->g;
  for (size_t i = 0; i < w->node_count; i++) g->places[i] = UINT32_MAX;
  for (size_t k = 0; k < w->order_count; k++) g->places[w->order[k]] = (uint32_t)k;
  for (size_t k = 0; k < w->order_count; k++) {
    const uint32_t parent = w->parents[w->order[k]];
    const bool is_root = parent == NO_PARENT || g->places[parent] == UINT32_MAX;
    if (!gltf_rig_add_node(g, w->order[k], is_root ? -1 : (int32_t)g->places[parent])) return false;
  }
  return gltf_rig_add_skins(g);
}

static bool add_things(Walk *w)
{
  for (size_t k = 0; k < w->order_count; k++) {
    const size_t i = w->order[k];
    const Json *node = gltf_item(w->g, "nodes", i);
    const uint32_t place = (uint32_t)k;
    if (!add_mesh_of(w, node, place, &w->worlds[i]) || !add_camera_of(w->g, node, place, &w->worlds[i]) ||
        !add_light_of(w->g, node, i, place, &w->worlds[i]))
      return false;
  }
  return true;
}

bool gltf_add_nodes(Gltf *g)
{
  Walk w = {.g = g, .node_count = gltf_count(g, "nodes")};
  if (w.node_count >= NO_PARENT) return err_set(g->err, ERR_BAD_SCENE, "%s: too many nodes", g->path);
  w.parents = gltf_alloc(g, w.node_count, sizeof *w.parents, "nodes");
  w.order = gltf_alloc(g, w.node_count, sizeof *w.order, "nodes");
  w.worlds = gltf_alloc(g, w.node_count, sizeof *w.worlds, "nodes");
  w.is_reached = gltf_alloc(g, w.node_count, sizeof *w.is_reached, "nodes");
  g->places = gltf_alloc(g, w.node_count, sizeof *g->places, "nodes");
  w.uses = gltf_alloc(g, gltf_count(g, "meshes"), sizeof *w.uses, "meshes");
  bool ok = w.parents && w.order && w.worlds && w.is_reached && g->places && w.uses;
  if (ok) memset(w.is_reached, 0, w.node_count * sizeof *w.is_reached);
  if (ok) memset(w.uses, 0, gltf_count(g, "meshes") * sizeof *w.uses);
  ok = ok && gltf_rig_begin(g) && find_parents(&w) && check_cycles(&w) && walk_scene(&w) && add_rig_nodes(&w) &&
       add_things(&w) && gltf_rig_finish(g);
  mem_free(w.parents);
  mem_free(w.order);
  mem_free(w.worlds);
  mem_free(w.is_reached);
  mem_free(w.uses);
  mem_free(g->places);
  return ok;
}
