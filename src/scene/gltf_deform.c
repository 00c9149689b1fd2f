// What changes the shape of a glTF primitive: which joints its vertices follow and how much (JOINTS_n, WEIGHTS_n), and
// its morph targets. Only the span of vertices that the primitive uses is kept, as its mesh has it.

#include "scene/gltf_access.h"
#include "scene/rig.h"

#include <stdio.h>
#include <string.h>

void *gltf_keep(Gltf *g, size_t count, size_t size, const char *what)
{
  if (!gltf_charge(g, count, size, what)) return NULL;
  void *room = arena_alloc(&g->scene->arena, count ? count : 1, size);
  if (!room) err_memory(g->err, what, count * size);
  return room;
}

typedef struct VertexSpan {
  Gltf *g;
  const char *place;
  size_t vertex_count, first, count;
} VertexSpan;

// Four or three numbers a vertex out of a dictionary of attributes; NULL in *out if it has none of that name.
static bool read_span(const VertexSpan *s, const Json *dict, const char *key, int width, const float **out)
{
  Accessor a;
  bool is_given;
  *out = NULL;
  if (!accessor_open(s->g, dict, key, &is_given, &a)) return false;
  if (!is_given) return true;
  if (a.width != width || a.type == GLTF_U32)
    return gltf_fail(s->g, dict, key, "%s: accessors[%zu] is of a type that %s cannot have", s->place, a.index, key);
  if (a.count != s->vertex_count)
    return gltf_fail(s->g, dict, key, "%s: %s has %zu elements for %zu vertices", s->place, key, a.count, s->vertex_count);
  float *values = gltf_keep(s->g, s->count, (size_t)width * sizeof *values, key);
  if (!values) return false;
  accessor_floats(&a, s->first, s->count, width, values);
  for (size_t i = 0; i < s->count * (size_t)width; i++)
    if (!isfinite(values[i])) values[i] = 0;
  *out = values;
  return true;
}

// Files round their weights to bytes: made to add up to 1 again. A vertex that follows nobody follows the first joint.
static void even_weights(float *w, size_t n)
{
  float sum = 0;
  for (size_t k = 0; k < n; k++) sum += w[k] = max_f(w[k], 0);
  if (!(sum > 0)) w[0] = sum = 1;
  for (size_t k = 0; k < n; k++) w[k] /= sum;
}

static bool read_influences(const VertexSpan *s, const Json *attributes, GltfDeform *out)
{
  enum { MOST_SETS = 2 };
  const float *joints[MOST_SETS], *weights[MOST_SETS];
  size_t sets = 0;
  for (; sets < MOST_SETS; sets++) {
    char joint_key[20], weight_key[20];
    snprintf(joint_key, sizeof joint_key, "JOINTS_%zu", sets);
    snprintf(weight_key, sizeof weight_key, "WEIGHTS_%zu", sets);
    if (!read_span(s, attributes, joint_key, 4, &joints[sets]) || !read_span(s, attributes, weight_key, 4, &weights[sets]))
      return false;
    if (!joints[sets] || !weights[sets]) break;
  }
  if (!sets) return true;
  const size_t n = 4 * sets;
  uint16_t *j = gltf_keep(s->g, s->count, n * sizeof *j, "joints");
  float *w = gltf_keep(s->g, s->count, n * sizeof *w, "weights");
  if (!j || !w) return false;
  for (size_t i = 0; i < s->count; i++) {
    for (size_t k = 0; k < n; k++) {
      w[n * i + k] = weights[k / 4][4 * i + k % 4];
      j[n * i + k] = (uint16_t)clamp_f(joints[k / 4][4 * i + k % 4], 0, 65535);
      if (w[n * i + k] <= 0) j[n * i + k] = 0; // counts for nothing, and may name anything
      if (j[n * i + k] >= out->joint_end) out->joint_end = j[n * i + k] + 1u;
    }
    even_weights(w + n * i, n);
  }
  out->influence_count = (uint32_t)n;
  out->joints = j;
  out->weights = w;
  return true;
}

static bool read_targets(const VertexSpan *s, const Json *list, GltfDeform *out)
{
  const size_t count = js_kind(list) == JSON_LIST ? js_count(list) : 0;
  if (!count) return true;
  RigTarget *targets = gltf_keep(s->g, count, sizeof *targets, "morph targets");
  if (!targets) return false;
  for (size_t i = 0; i < count; i++)
    if (!read_span(s, js_at(list, i), "POSITION", 3, &targets[i].positions) ||
        !read_span(s, js_at(list, i), "NORMAL", 3, &targets[i].normals))
      return false;
  out->targets = targets;
  out->target_count = count;
  return true;
}

bool gltf_add_deform(Gltf *g, const Json *primitive, const char *place, size_t vertex_count, size_t first, size_t count,
                     int32_t mesh_i)
{
  const VertexSpan s = {g, place, vertex_count, first, count};
  GltfDeform d = {.mesh_i = mesh_i};
  if (!read_influences(&s, js_get(primitive, "attributes"), &d) || !read_targets(&s, js_get(primitive, "targets"), &d))
    return false;
  if (!d.influence_count && !d.target_count) return true;
  return array_push(&g->deforms, d) || err_memory(g->err, "morph targets", sizeof d);
}
