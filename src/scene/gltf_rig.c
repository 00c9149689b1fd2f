// The rig of a glTF file: its nodes as they stand at rest, the skins, the clips, and which of the scene's things follow
// which node. A file in which nothing can move keeps none. See rig.h for what is done with it.

#include "scene/gltf_access.h"
#include "scene/rig.h"

#include <string.h>

#define PUSH(g, array, ...) (array_push(array, __VA_ARGS__) || err_memory((g)->err, "the rig", sizeof *(array)->items))

bool gltf_rig_begin(Gltf *g)
{
  g->scene->rig = mem_zero(1, sizeof *g->scene->rig);
  return g->scene->rig || err_memory(g->err, "the rig", sizeof *g->scene->rig);
}

// --- nodes ----------------------------------------------------------------------------------------
static bool read_weights(Gltf *g, const Json *node, RigNode *out)
{
  size_t mesh_i;
  if (!gltf_index(g, node, "mesh", "meshes", &mesh_i)) return false;
  if (mesh_i == GLTF_NONE) return true;
  const Json *mesh = gltf_item(g, "meshes", mesh_i), *owner = js_get(node, "weights") ? node : mesh;
  const size_t count = js_count(js_get(js_at(js_get(mesh, "primitives"), 0), "targets"));
  if (!count) return true;
  float *weights = gltf_keep(g, count, sizeof *weights, "weights");
  if (!weights) return false;
  memset(weights, 0, count * sizeof *weights);
  // A list of another length is against the rules; what there is of it counts.
  const Json *list = js_get(owner, "weights");
  for (size_t i = 0; i < count && i < js_count(list); i++) {
    const float w = (float)js_number(js_at(list, i), 0);
    weights[i] = isfinite(w) ? w : 0;
  }
  out->weights = weights;
  out->weight_count = (uint32_t)count;
  return true;
}

bool gltf_rig_add_node(Gltf *g, size_t node_i, int32_t parent)
{
  Rig *r = g->scene->rig;
  const Json *node = gltf_item(g, "nodes", node_i);
  RigNode n = {.parent = parent, .rotation = {0, 0, 0, 1}, .scale = {1, 1, 1}};
  float m[16];
  n.has_matrix = js_get(node, "matrix");
  if (n.has_matrix) {
    if (!gltf_floats(g, node, "matrix", 16, m)) return false;
    n.matrix = (Frame){v3_load(m), v3_load(m + 4), v3_load(m + 8), v3_load(m + 12)};
  } else if (!gltf_floats(g, node, "translation", 3, n.translation) ||
             !gltf_floats(g, node, "rotation", 4, n.rotation) || !gltf_floats(g, node, "scale", 3, n.scale)) {
    return false;
  }
  if (!read_weights(g, node, &n)) return false;
  n.first_weight = (uint32_t)r->weight_count;
  r->weight_count += n.weight_count;
  return gltf_charge(g, 1, sizeof n, "nodes") && PUSH(g, &r->nodes, n);
}

// --- skins ----------------------------------------------------------------------------------------
static bool read_joints(Gltf *g, size_t skin_i, const Json *list, uint32_t *joints, size_t count, bool *is_whole)
{
  const size_t node_count = gltf_count(g, "nodes");
  *is_whole = true;
  for (size_t i = 0; i < count; i++) {
    const double x = js_number(js_at(list, i), -1);
    if (!(x >= 0 && x < (double)node_count) || x != floor(x))
      return gltf_fail_item(g, "skins", skin_i, "a joint must be the number of a node, under %zu", node_count);
    joints[i] = g->places[(size_t)x];
    *is_whole = *is_whole && joints[i] != UINT32_MAX;
  }
  return true;
}

static bool read_inverse_bind(Gltf *g, const Json *skin, Frame *out, size_t count)
{
  Accessor a;
  bool is_given;
  if (!accessor_open(g, skin, "inverseBindMatrices", &is_given, &a)) return false;
  if (is_given && (a.width != 16 || a.type != GLTF_F32))
    return gltf_fail(g, skin, "inverseBindMatrices", "accessors[%zu] does not hold float matrices", a.index);
  if (is_given && a.count < count)
    return gltf_fail(g, skin, "inverseBindMatrices", "accessors[%zu] holds %zu matrices for %zu joints", a.index, a.count,
                     count);
  for (size_t i = 0; i < count; i++) {
    float m[16];
    out[i] = frame_identity();
    if (!is_given) continue;
    accessor_floats(&a, i, 1, 16, m);
    out[i] = (Frame){v3_load(m), v3_load(m + 4), v3_load(m + 8), v3_load(m + 12)};
  }
  return true;
}

// One whose joints are not all in the scene shown has no joints here, and is not used.
static bool add_skin(Gltf *g, size_t skin_i)
{
  const Json *skin = gltf_item(g, "skins", skin_i), *list = js_get(skin, "joints");
  const size_t count = js_kind(list) == JSON_LIST ? js_count(list) : 0;
  if (!count) return gltf_fail_item(g, "skins", skin_i, "it has no joints");
  uint32_t *joints = gltf_keep(g, count, sizeof *joints, "joints");
  Frame *inverse_bind = gltf_keep(g, count, sizeof *inverse_bind, "joints");
  bool is_whole;
  if (!joints || !inverse_bind || !read_joints(g, skin_i, list, joints, count, &is_whole) ||
      !read_inverse_bind(g, skin, inverse_bind, count))
    return false;
  if (!is_whole)
    note_once(&g->scene->notes, "%s: a skin has joints outside of the scene shown; its meshes stay at rest", g->path);
  return PUSH(g, &g->scene->rig->skins, (RigSkin){joints, inverse_bind, is_whole ? count : 0});
}

// --- shapes and followers -------------------------------------------------------------------------
static const GltfDeform *find_deform(const Gltf *g, size_t mesh_i)
{
  size_t low = 0, high = g->deforms.count;
  while (low < high) {
    const size_t middle = low + (high - low) / 2;
    const size_t at = (size_t)g->deforms.items[middle].mesh_i;
    if (at == mesh_i) return &g->deforms.items[middle];
    if (at < mesh_i) low = middle + 1;
    else high = middle;
  }
  return NULL;
}

static bool check_influences(Gltf *g, size_t skin_i, const GltfDeform *d)
{
  const size_t count = g->scene->rig->skins.items[skin_i].joint_count;
  return !count || d->joint_end <= count ||
         gltf_fail_item(g, "skins", skin_i, "a vertex names joint %u, but there are only %zu", d->joint_end - 1, count);
}

// A mesh that changes belongs to its node alone: other nodes that name it get their own.
static bool own_mesh(Gltf *g, bool is_shared, size_t mesh_i, int32_t *out)
{
  *out = (int32_t)mesh_i;
  if (!is_shared) return true;
  const Mesh shared = g->scene->meshes.items[mesh_i];
  *out = scene_add_mesh(g->scene, shared.name, mesh_data_share(shared.data));
  if (*out < 0) return err_memory(g->err, "meshes", sizeof(Mesh));
  g->scene->meshes.items[*out].slots = shared.slots;
  g->scene->meshes.items[*out].slot_count = shared.slot_count;
  return true;
}

bool gltf_rig_add_shapes(Gltf *g, const GltfMesh *mesh, size_t skin_i, uint32_t node, bool is_shared, GltfMesh *own)
{
  Rig *r = g->scene->rig;
  bool is_any = false;
  for (size_t i = 0; i < mesh->count; i++) is_any = is_any || find_deform(g, mesh->first + i);
  *own = *mesh;
  if (!is_any) return true;
  const bool has_skin = skin_i != GLTF_NONE && r->skins.items[skin_i].joint_count;
  for (size_t i = 0; i < mesh->count; i++) {
    int32_t at;
    const GltfDeform *d = find_deform(g, mesh->first + i);
    if (!gltf_charge(g, is_shared, sizeof(Mesh) + GLTF_NAME_SIZE, "meshes") || !own_mesh(g, is_shared, mesh->first + i, &at))
      return false;
    if (!i) own->first = (size_t)at;
    const bool is_bent = has_skin && d && d->influence_count;
    if (!d || (!is_bent && !d->target_count)) continue;
    if (is_bent && !check_influences(g, skin_i, d)) return false;
    const RigShape shape = {.mesh_i = at, .node = node, .skin = is_bent ? (int32_t)skin_i : -1,
                            .influence_count = d->influence_count, .joints = d->joints, .weights = d->weights,
                            .targets = d->targets, .target_count = d->target_count};
    if (!PUSH(g, &r->shapes, shape)) return false;
  }
  return true;
}

bool gltf_rig_is_bent(const Gltf *g, uint32_t node, int32_t mesh_i)
{
  const Rig *r = g->scene->rig;
  for (size_t i = r->shapes.count; i-- > 0 && r->shapes.items[i].node == node;)
    if (r->shapes.items[i].mesh_i == mesh_i) return r->shapes.items[i].skin >= 0;
  return false;
}

bool gltf_rig_add_object(Gltf *g, uint32_t id, uint32_t node, bool is_skinned, const Frame *local)
{
  return PUSH(g, &g->scene->rig->objects, (RigObject){id, node, is_skinned, *local});
}

bool gltf_rig_add_camera(Gltf *g, const char *name, uint32_t node, bool is_main)
{
  return PUSH(g, &g->scene->rig->cameras, (RigFollower){name, node, is_main});
}

bool gltf_rig_add_light(Gltf *g, const char *name, uint32_t node)
{
  return PUSH(g, &g->scene->rig->lights, (RigFollower){name, node, false});
}

// --- clips ----------------------------------------------------------------------------------------
// A channel that cannot be had is left out with a note: the rest of the clip is worth having.
static bool skip(Gltf *g, const char *why, bool *is_usable)
{
  note_once(&g->scene->notes, "%s: some channels of its animations %s and are left out", g->path, why);
  return *is_usable = false, true;
}

static bool read_target(Gltf *g, const Json *target, RigChannel *out, bool *is_usable)
{
  static const char *const paths[] = {"translation", "rotation", "scale", "weights"};
  const char *path = js_text(js_get(target, "path"));
  size_t node, i = 0;
  if (!gltf_index(g, target, "node", "nodes", &node)) return false;
  while (i < 4 && !text_equal(path, paths[i])) i++;
  if (node == GLTF_NONE || i == 4) return skip(g, "move what is not known here", is_usable);
  if (g->places[node] == UINT32_MAX) return *is_usable = false, true; // of another scene of the file
  out->node = g->places[node];
  out->path = (RigPath)i;
  const RigNode *n = &g->scene->rig->nodes.items[out->node];
  if (n->has_matrix && out->path != RIG_WEIGHTS) return skip(g, "move nodes that are given by a matrix", is_usable);
  out->width = out->path == RIG_WEIGHTS ? n->weight_count : out->path == RIG_ROTATION ? 4 : 3;
  return out->width || skip(g, "move weights of meshes without targets", is_usable);
}

static bool read_times(Gltf *g, const Json *sampler, RigChannel *out, bool *is_usable)
{
  Accessor a;
  bool is_given;
  if (!accessor_open(g, sampler, "input", &is_given, &a)) return false;
  if (!is_given || a.width != 1 || a.type != GLTF_F32 || !a.count)
    return gltf_fail(g, sampler, "input", "an animation's \"input\" must be float numbers, its times");
  float *times = gltf_keep(g, a.count, sizeof *times, "keys");
  if (!times) return false;
  accessor_floats(&a, 0, a.count, 1, times);
  for (size_t i = 0; i < a.count; i++)
    if (!isfinite(times[i]) || (i && !(times[i] > times[i - 1]))) return skip(g, "have times that do not rise", is_usable);
  out->times = times;
  out->key_count = (uint32_t)a.count;
  return true;
}

static bool read_values(Gltf *g, const Json *sampler, RigChannel *out, bool *is_usable)
{
  Accessor a;
  bool is_given;
  if (!accessor_open(g, sampler, "output", &is_given, &a)) return false;
  const size_t wanted = (size_t)out->key_count * (out->curve == RIG_SPLINE ? 3 : 1) * out->width;
  const int width = out->path == RIG_WEIGHTS ? 1 : (int)out->width;
  if (!is_given || a.width != width || a.type == GLTF_U32 || a.count * (size_t)width != wanted)
    return gltf_fail(g, sampler, "output", "an animation's \"output\" must hold %zu numbers for its %u times", wanted,
                     out->key_count);
  float *values = gltf_keep(g, wanted, sizeof *values, "keys");
  if (!values) return false;
  accessor_floats(&a, 0, a.count, width, values);
  for (size_t i = 0; i < wanted; i++)
    if (!isfinite(values[i])) return skip(g, "have values that are not finite", is_usable);
  out->values = values;
  return true;
}

static bool read_channel(Gltf *g, const Json *animation, const Json *json, RigChannel *out, bool *is_usable)
{
  const Json *samplers = js_get(animation, "samplers");
  size_t sampler_i;
  *out = (RigChannel){0};
  *is_usable = true;
  if (!read_target(g, js_get(json, "target"), out, is_usable)) return false;
  if (!*is_usable) return true;
  if (!gltf_index_below(g, json, "sampler", js_kind(samplers) == JSON_LIST ? js_count(samplers) : 0, "samplers", &sampler_i))
    return false;
  if (sampler_i == GLTF_NONE) return skip(g, "have no sampler", is_usable);
  const Json *sampler = js_at(samplers, sampler_i);
  const char *curve = js_text(js_get(sampler, "interpolation"));
  out->curve = text_equal(curve, "STEP") ? RIG_STEP : text_equal(curve, "CUBICSPLINE") ? RIG_SPLINE : RIG_LINEAR;
  return read_times(g, sampler, out, is_usable) && (!*is_usable || read_values(g, sampler, out, is_usable));
}

static bool add_clip(Gltf *g, size_t clip_i)
{
  const Json *json = gltf_item(g, "animations", clip_i), *list = js_get(json, "channels");
  const size_t count = js_kind(list) == JSON_LIST ? js_count(list) : 0;
  char name[GLTF_NAME_SIZE];
  RigChannel *channels = gltf_keep(g, count, sizeof *channels, "channels");
  RigClip clip = {.name = arena_text(&g->scene->arena, gltf_name(json, "clip", clip_i, name)), .channels = channels,
                  .start = FLT_MAX, .end = -FLT_MAX};
  if (!channels) return false;
  if (!clip.name) return err_memory(g->err, name, sizeof name);
  for (size_t i = 0; i < count; i++) {
    RigChannel *c = &channels[clip.channel_count];
    bool is_usable;
    if (!read_channel(g, json, js_at(list, i), c, &is_usable)) return false;
    if (!is_usable) continue;
    clip.start = min_f(clip.start, c->times[0]);
    clip.end = max_f(clip.end, c->times[c->key_count - 1]);
    clip.channel_count++;
  }
  return !clip.channel_count || PUSH(g, &g->scene->rig->clips, clip);
}

static void mark_driven(Rig *r)
{
  for (size_t i = 0; i < r->clips.count; i++)
    for (size_t k = 0; k < r->clips.items[i].channel_count; k++) r->nodes.items[r->clips.items[i].channels[k].node].is_driven = true;
  for (size_t i = 0; i < r->nodes.count; i++)
    if (r->nodes.items[i].parent >= 0 && r->nodes.items[r->nodes.items[i].parent].is_driven) r->nodes.items[i].is_driven = true;
}

bool gltf_rig_add_skins(Gltf *g)
{
  for (size_t i = 0; i < gltf_count(g, "skins"); i++)
    if (!add_skin(g, i)) return false;
  return true;
}

bool gltf_rig_finish(Gltf *g)
{
  Rig *r = g->scene->rig;
  for (size_t i = 0; i < gltf_count(g, "animations"); i++)
    if (!add_clip(g, i)) return false;
  mark_driven(r);
  unsigned moved = 0;
  if (r->shapes.count && !rig_pose(g->scene, NULL, false, true, 0, &moved, g->err)) return false;
  if (r->clips.count) return true;
  rig_destroy(r);
  g->scene->rig = NULL;
  return true;
}
