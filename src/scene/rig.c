// See rig.h. Linear blend skinning as glTF 2.0 has it (section 3.7.3.3): a vertex goes by the weighted mean of its
// joints' maps, each the joint's place in the world after the inverse of its place when the mesh was bound; the place
// of the mesh's own node does not count. Morph targets are added first (section 3.7.2.2).

#include "scene/rig.h"

#include "scene/kinds.h"
#include "scene/track.h"

#include <string.h>

void rig_destroy(Rig *r)
{
  if (!r) return;
  array_finish(&r->nodes);
  array_finish(&r->clips);
  array_finish(&r->skins);
  array_finish(&r->shapes);
  array_finish(&r->objects);
  array_finish(&r->lights);
  array_finish(&r->cameras);
  mem_free(r);
}

// --- channels -------------------------------------------------------------------------------------
static const float *value_at(const RigChannel *c, size_t key, int part)
{
  return c->values + (c->curve == RIG_SPLINE ? 3 * key + (size_t)part : key) * c->width;
}

static size_t find_key(const RigChannel *c, float t)
{
  size_t low = 0, high = c->key_count - 1;
  while (low < high) {
    const size_t middle = low + (high - low + 1) / 2;
    if (c->times[middle] <= t) low = middle;
    else high = middle - 1;
  }
  return low;
}

static Quaternion load_quaternion(const float *v)
{
  return quaternion_unit((Quaternion){{(double)v[0], (double)v[1], (double)v[2], (double)v[3]}});
}

static void store_quaternion(Quaternion q, float *out)
{
  q = quaternion_unit(q);
  for (int k = 0; k < 4; k++) out[k] = (float)q.v[k];
}

// glTF 2.0, appendix C.5: slopes count a second, so they are scaled by the time between the keys.
static void spline(const RigChannel *c, size_t i, double u, double span, float *out)
{
  const float *a = value_at(c, i, 1), *m = value_at(c, i, 2), *n = value_at(c, i + 1, 0), *b = value_at(c, i + 1, 1);
  const double u2 = u * u, u3 = u2 * u;
  for (size_t k = 0; k < c->width; k++)
    out[k] = (float)((2 * u3 - 3 * u2 + 1) * (double)a[k] + span * (u3 - 2 * u2 + u) * (double)m[k] +
                     (3 * u2 - 2 * u3) * (double)b[k] + span * (u3 - u2) * (double)n[k]);
  if (c->path == RIG_ROTATION) store_quaternion(load_quaternion(out), out);
}

void rig_channel_value(const RigChannel *c, double seconds, float *out)
{
  const size_t i = find_key(c, (float)seconds), middle = c->curve == RIG_SPLINE;
  const float *a = value_at(c, i, (int)middle);
  const bool is_last = i + 1 == c->key_count;
  const double span = is_last ? 0 : (double)c->times[i + 1] - (double)c->times[i];
  const double u = span > 0 ? (seconds - (double)c->times[i]) / span : 0;
  if (!(u > 0) || c->curve == RIG_STEP) {
    memcpy(out, a, c->width * sizeof *out);
  } else if (c->curve == RIG_SPLINE) {
    spline(c, i, u, span, out);
  } else if (c->path == RIG_ROTATION) {
    store_quaternion(quaternion_slerp(load_quaternion(a), load_quaternion(value_at(c, i + 1, 0)), u), out);
  } else {
    const float *b = value_at(c, i + 1, 0);
    for (size_t k = 0; k < c->width; k++) out[k] = (float)((double)a[k] + u * ((double)b[k] - (double)a[k]));
  }
}

const RigClip *rig_find_clip(const Rig *r, const char *name)
{
  for (size_t i = 0; name && i < r->clips.count; i++)
    if (text_equal(r->clips.items[i].name, name)) return &r->clips.items[i];
  return r->clips.count ? &r->clips.items[0] : NULL;
}

static bool fail_clip(const Rig *r, const char *name, Err *err)
{
  const char *names[64];
  size_t count = 0;
  for (size_t i = 0; i < r->clips.count && count < 64; i++) names[count++] = r->clips.items[i].name;
  char hint[120];
  return err_set(err, ERR_BAD_SCENE, "timeline.clip: there is no clip \"%.100s\"%s", name,
                 text_hint(hint, name, names, count));
}

// --- the pose -------------------------------------------------------------------------------------
typedef struct Pose {
  Scene *scene;
  const Rig *rig;
  bool is_all;
  RigNode *nodes; // owned: as at rest, then as the clip has them
  float *weights; // owned: of all nodes
  Frame *worlds;  // owned
  unsigned *moved;
  Err *err;
} Pose;

static void copy_rest(Pose *p)
{
  memcpy(p->nodes, p->rig->nodes.items, p->rig->nodes.count * sizeof *p->nodes);
  for (size_t i = 0; i < p->rig->nodes.count; i++) {
    const RigNode *n = &p->nodes[i];
    if (n->weight_count) memcpy(p->weights + n->first_weight, n->weights, n->weight_count * sizeof *n->weights);
  }
}

// Over its end a clip begins again, so that a walk goes on walking.
static double clip_time(const RigClip *clip, double seconds)
{
  const double start = (double)clip->start, length = (double)clip->end - start;
  if (!(length > 0)) return start;
  if (seconds >= start && seconds <= (double)clip->end) return seconds;
  return seconds - length * floor((seconds - start) / length);
}

static void apply_clip(Pose *p, const RigClip *clip, double seconds)
{
  for (size_t i = 0; clip && i < clip->channel_count; i++) {
    const RigChannel *c = &clip->channels[i];
    RigNode *n = &p->nodes[c->node];
    float *to = NULL;
    switch (c->path) {
    case RIG_TRANSLATION: to = n->translation; break;
    case RIG_ROTATION: to = n->rotation; break;
    case RIG_SCALE: to = n->scale; break;
    case RIG_WEIGHTS: to = p->weights + n->first_weight; break;
    }
    rig_channel_value(c, clip_time(clip, seconds), to);
  }
}

static void find_worlds(Pose *p)
{
  for (size_t i = 0; i < p->rig->nodes.count; i++) {
    const RigNode *n = &p->nodes[i];
    const Frame local = n->has_matrix ? n->matrix
                                      : quaternion_frame(load_quaternion(n->rotation), v3_load(n->scale),
                                                         v3_load(n->translation));
    p->worlds[i] = n->parent >= 0 ? frame_product(&p->worlds[n->parent], &local) : local;
  }
}

static bool is_wanted(const Pose *p, uint32_t node)
{
  return p->is_all || p->rig->nodes.items[node].is_driven;
}

// --- objects, cameras, lights -----------------------------------------------------------------------
static Object *find_object(const Scene *s, uint32_t id)
{
  size_t low = 0, high = s->objects.count; // ids rise along the list
  while (low < high) {
    const size_t middle = low + (high - low) / 2;
    if (s->objects.items[middle].id == id) return &s->objects.items[middle];
    if (s->objects.items[middle].id < id) low = middle + 1;
    else high = middle;
  }
  return NULL;
}

// The map of a node may squeeze a thing flat, which hides it; the engine wants a map that can be turned back.
static void place_object(Pose *p, const RigObject *follower)
{
  Object *o = find_object(p->scene, follower->id);
  if (!o || (p->is_all ? !follower->is_skinned : !is_wanted(p, follower->node))) return;
  Frame f = follower->is_skinned ? frame_identity() : frame_product(&p->worlds[follower->node], &follower->local);
  const Frame inverse = frame_inverse(&f);
  if (v3_is_zero(inverse.x)) f = (Frame){v3(1e-6f, 0, 0), v3(0, 1e-6f, 0), v3(0, 0, 1e-6f), f.p};
  ObjectCommon c = o->common;
  v3_store(c.matrix, f.x);
  v3_store(c.matrix + 3, f.y);
  v3_store(c.matrix + 6, f.z);
  v3_store(c.matrix + 9, f.p);
  for (int k = 0; k < 3; k++) c.translate[k] = c.rotate[k] = 0, c.scale[k] = 1;
  if (memcmp(&c.matrix, &o->common.matrix, sizeof c.matrix)) *p->moved |= MOVED_WORLD;
  o->common = c;
}

void rig_place_camera(Camera *c, const Frame *world)
{
  // The node's scale does not count. A camera squeezed flat looks along -z, as one that says nothing.
  const Vec3 back = v3_normalize(world->z), up = v3_normalize(world->y);
  v3_store(c->common.position, world->p);
  v3_store(c->common.target, world->p - (v3_is_zero(back) ? v3(0, 0, 1) : back));
  v3_store(c->common.up, v3_is_zero(up) ? v3(0, 1, 0) : up);
}

void rig_place_light(Light *l, const Frame *world)
{
  const Vec3 back = v3_normalize(world->z); // light travels along -z
  if (l->kind == LIGHT_POINT) v3_store(l->point.position, world->p);
  if (l->kind == LIGHT_SUN) v3_store(l->sun.direction, back);
  if (l->kind != LIGHT_SPOT) return;
  v3_store(l->spot.position, world->p);
  v3_store(l->spot.target, world->p - back);
}

static void place_camera(Pose *p, const RigFollower *follower)
{
  if (p->is_all || !is_wanted(p, follower->node)) return;
  for (size_t i = 0; i < p->scene->cameras.count; i++)
    if (p->scene->cameras.items[i].name == follower->name)
      rig_place_camera(&p->scene->cameras.items[i], &p->worlds[follower->node]);
  if (follower->is_main) rig_place_camera(&p->scene->camera, &p->worlds[follower->node]);
  *p->moved |= MOVED_CAMERA;
}

static void place_light(Pose *p, const RigFollower *follower)
{
  if (p->is_all || !is_wanted(p, follower->node)) return;
  for (size_t i = 0; i < p->scene->lights.count; i++)
    if (p->scene->lights.items[i].name == follower->name)
      rig_place_light(&p->scene->lights.items[i], &p->worlds[follower->node]);
  *p->moved |= MOVED_WORLD;
}

// --- vertices ---------------------------------------------------------------------------------------
typedef struct Vertices {
  float *positions, *normals; // owned; normals NULL where the mesh has none
  size_t count;
} Vertices;

static void add_target(float *to, const float *delta, float weight, size_t count)
{
  for (size_t i = 0; delta && to && i < 3 * count; i++) to[i] += weight * delta[i];
}

static void morph(const Pose *p, const RigShape *shape, Vertices *v)
{
  const RigNode *n = &p->nodes[shape->node];
  for (size_t i = 0; i < shape->target_count && i < n->weight_count; i++) {
    const float weight = p->weights[n->first_weight + i];
    if (weight == 0) continue;
    add_target(v->positions, shape->targets[i].positions, weight, v->count);
    add_target(v->normals, shape->targets[i].normals, weight, v->count);
  }
}

static Frame blend(const RigShape *shape, const Frame *joints, size_t vertex)
{
  Frame sum = {0};
  const size_t n = shape->influence_count, first = n * vertex;
  for (size_t k = first; k < first + n; k++) {
    const float w = shape->weights[k];
    const Frame *j = &joints[shape->joints[k]];
    if (w == 0) continue;
    sum.x += w * j->x;
    sum.y += w * j->y;
    sum.z += w * j->z;
    sum.p += w * j->p;
  }
  return sum;
}

// A normal goes by the cofactors of the map, which are its inverse transposed but for a factor, and exist even where the
// map cannot be turned back.
static Vec3 cofactor_vector(const Frame *f, Vec3 n)
{
  const Vec3 turned = n[0] * v3_cross(f->y, f->z) + n[1] * v3_cross(f->z, f->x) + n[2] * v3_cross(f->x, f->y);
  return frame_determinant(f) < 0 ? -turned : turned;
}

static bool bend(const Pose *p, const RigShape *shape, Vertices *v)
{
  const RigSkin *skin = &p->rig->skins.items[shape->skin];
  Frame *joints = mem_alloc(skin->joint_count, sizeof *joints);
  if (!joints) return err_memory(p->err, "joints", skin->joint_count * sizeof *joints);
  for (size_t i = 0; i < skin->joint_count; i++)
    joints[i] = frame_product(&p->worlds[skin->joints[i]], &skin->inverse_bind[i]);
  for (size_t i = 0; i < v->count; i++) {
    const Frame f = blend(shape, joints, i);
    v3_store(v->positions + 3 * i, frame_point(&f, v3_load(v->positions + 3 * i)));
    if (v->normals) v3_store(v->normals + 3 * i, cofactor_vector(&f, v3_load(v->normals + 3 * i)));
  }
  mem_free(joints);
  return true;
}

static float *copy(const float *from, size_t count)
{
  float *to = from ? mem_alloc(count, 3 * sizeof *to) : NULL;
  if (to) memcpy(to, from, count * 3 * sizeof *to);
  return to;
}

// Numbers that are not finite would be refused from anyone else: the vertex stays at rest.
static void mend(const MeshData *rest, Vertices *v)
{
  for (size_t i = 0; i < v->count; i++) {
    if (!v3_is_finite(v3_load(v->positions + 3 * i))) memcpy(v->positions + 3 * i, rest->positions + 3 * i, 12);
    if (!v->normals) continue;
    const Vec3 n = v3_normalize(v3_load(v->normals + 3 * i));
    if (v3_is_finite(n) && !v3_is_zero(n)) v3_store(v->normals + 3 * i, n);
    else memcpy(v->normals + 3 * i, rest->normals + 3 * i, 12);
  }
}

static bool give_vertices(Pose *p, Mesh *mesh, const Vertices *v)
{
  if (!memcmp(mesh->data->positions, v->positions, 12 * v->count)) return true;
  MeshData *moved = mesh_data_move(mesh->data, v->positions, v->normals);
  if (!moved) return err_memory(p->err, "moved vertices", 12 * v->count);
  mesh_data_release(mesh->data);
  mesh->data = moved;
  *p->moved |= MOVED_WORLD;
  return true;
}

static bool is_shape_driven(const Pose *p, const RigShape *shape)
{
  if (is_wanted(p, shape->node)) return true;
  const RigSkin *skin = shape->skin >= 0 ? &p->rig->skins.items[shape->skin] : NULL;
  for (size_t i = 0; skin && i < skin->joint_count; i++)
    if (is_wanted(p, skin->joints[i])) return true;
  return false;
}

static bool shape_mesh(Pose *p, const RigShape *shape)
{
  Mesh *mesh = &p->scene->meshes.items[shape->mesh_i];
  const MeshData *rest = mesh_data_origin(mesh->data);
  if (!is_shape_driven(p, shape)) return true;
  Vertices v = {copy(rest->positions, rest->vertex_count), copy(rest->normals, rest->vertex_count), rest->vertex_count};
  bool ok = (v.positions && (v.normals || !rest->normals)) || err_memory(p->err, "moved vertices", 24 * v.count);
  if (ok) {
    morph(p, shape, &v);
    ok = shape->skin < 0 || bend(p, shape, &v);
  }
  if (ok) {
    mend(rest, &v);
    ok = give_vertices(p, mesh, &v);
  }
  mem_free(v.positions);
  mem_free(v.normals);
  return ok;
}

static bool place_all(Pose *p)
{
  const Rig *r = p->rig;
  for (size_t i = 0; i < r->objects.count; i++) place_object(p, &r->objects.items[i]);
  for (size_t i = 0; i < r->cameras.count; i++) place_camera(p, &r->cameras.items[i]);
  for (size_t i = 0; i < r->lights.count; i++) place_light(p, &r->lights.items[i]);
  for (size_t i = 0; i < r->shapes.count; i++)
    if (!shape_mesh(p, &r->shapes.items[i])) return false;
  return true;
}

bool rig_pose(Scene *s, const char *clip, bool is_strict, bool is_all, double seconds, unsigned *moved, Err *err)
{
  const Rig *r = s->rig;
  if (!r) return !clip || !is_strict || err_set(err, ERR_BAD_SCENE, "timeline.clip: this scene has no clips");
  const RigClip *found = rig_find_clip(r, clip);
  if (clip && is_strict && (!found || !text_equal(found->name, clip))) return fail_clip(r, clip, err);
  Pose p = {.scene = s, .rig = r, .is_all = is_all, .moved = moved, .err = err};
  p.nodes = mem_alloc(r->nodes.count + 1, sizeof *p.nodes);
  p.worlds = mem_alloc(r->nodes.count + 1, sizeof *p.worlds);
  p.weights = mem_zero(r->weight_count + 1, sizeof *p.weights);
  bool ok = (p.nodes && p.worlds && p.weights) || err_memory(err, "a pose", r->nodes.count * sizeof *p.nodes);
  if (ok) {
    copy_rest(&p);
    if (!is_all) apply_clip(&p, found, seconds);
    find_worlds(&p);
    ok = place_all(&p);
  }
  mem_free(p.nodes);
  mem_free(p.worlds);
  mem_free(p.weights);
  return ok;
}
