// The tree of one mesh: its triangles' boxes go through build.h, and each leaf becomes a Tri8 block of vertices, so
// that a ray needs no look at the mesh's own arrays; or, in a compact tree, a row of triangle numbers.

#include "accel/build.h"
#include "accel/compact.h"
#include "accel/mesh_input.h"
#include "base/mem.h"

enum { CHUNK = 1 << 14 };

// Triangle numbers are child codes and must leave NO_HIT free; the same limit keeps node numbers under LEAF_BIT.
#define MOST_TRIANGLES ((size_t)LEAF_BIT - 2)

typedef struct MeshInput {
  MeshArrays mesh;
  Build *build;
  size_t *kept; // one a chunk
  MeshTree *tree;
} MeshInput;

static Vec3 corner_of(const MeshInput *in, size_t i, int c)
{
  return v3_load(in->mesh.positions + 3 * (size_t)in->mesh.triangles[3 * i + (size_t)c]);
}

// A RefClip: the corners between the planes, and where edges meet these, widened by the margin of geom/triangle.h.
static Bounds clip_triangle(const void *user, uint32_t prim, int axis, float lo, float hi)
{
  const Vec3 v[3] = {corner_of(user, prim, 0), corner_of(user, prim, 1), corner_of(user, prim, 2)};
  const float planes[2] = {lo, hi};
  Bounds b = bounds_empty();
  for (int i = 0; i < 3; i++) {
    const Vec3 p = v[i], q = v[i == 2 ? 0 : i + 1];
    const float from = p[axis], to = q[axis];
    if (from >= lo && from <= hi) bounds_add_point(&b, p);
    for (int side = 0; side < 2; side++) {
      const float plane = planes[side];
      if ((from < plane) == (to < plane)) continue;
      bounds_add_point(&b, p + (plane - from) / (to - from) * (q - p));
    }
  }
  const Bounds own = corners_bounds(v);
  const float box[6] = {own.lo[0], own.hi[0], own.lo[1], own.hi[1], own.lo[2], own.hi[2]};
  const Vec3 margin = v3_all(tri_margin(box));
  return (Bounds){lanes_max(b.lo - margin, own.lo), lanes_min(b.hi + margin, own.hi)};
}

static void gather_chunk(void *user, size_t chunk, int worker)
{
  (void)worker;
  const MeshInput *in = user;
  BuildRef *out = in->build->refs + chunk * CHUNK;
  const size_t end = (chunk + 1) * CHUNK < in->mesh.triangle_count ? (chunk + 1) * CHUNK : in->mesh.triangle_count;
  for (size_t i = chunk * CHUNK; i < end; i++) {
    Vec3 v[3];
    if (!triangle_corners(&in->mesh, i, v)) continue;
    const Bounds box = corners_bounds(v);
    *out++ = ref_of(&box, (uint32_t)i);
  }
  in->kept[chunk] = (size_t)(out - (in->build->refs + chunk * CHUNK));
}

// Fills the references chunk by chunk and closes the gaps that left-out triangles leave.
static bool gather(MeshInput *in, Err *err)
{
  Build *b = in->build;
  const size_t chunks = (in->mesh.triangle_count + CHUNK - 1) / CHUNK;
  if (chunks == 0) return true;
  in->kept = mem_alloc(chunks, sizeof *in->kept);
  if (!in->kept) return err_memory(err, "building a tree", chunks * sizeof *in->kept);
  const bool ok = jobs_run(b->jobs, chunks, gather_chunk, in, b->cancel);
  b->count = 0;
  for (size_t c = 0; ok && c < chunks; c++) {
    BuildRef *from = b->refs + c * CHUNK, *to = b->refs + b->count;
    if (to != from) memmove(to, from, in->kept[c] * sizeof *from);
    b->count += in->kept[c];
  }
  mem_free(in->kept);
  return ok || err_set(err, ERR_CANCELLED, "building a tree was cancelled");
}

// The triangles of a leaf, each once though several of its pieces may be there; NO_HIT in the lanes left over.
static void own_prims(const uint32_t *prims, uint32_t count, uint32_t out[8])
{
  uint32_t own_count = 0;
  for (uint32_t i = 0; i < count; i++) {
    bool is_new = true;
    for (uint32_t k = 0; k < own_count; k++) is_new &= out[k] != prims[i];
    if (is_new) out[own_count++] = prims[i];
  }
  while (own_count < 8) out[own_count++] = NO_HIT;
}

static uint32_t emit_block(void *user, size_t leaf_i, const uint32_t *prims, uint32_t count)
{
  const MeshInput *in = user;
  uint32_t prim[8];
  own_prims(prims, count, prim);
  block_fill(&in->tree->blocks[leaf_i], &in->mesh, prim);
  return (uint32_t)leaf_i;
}

static uint32_t emit_compact_leaf(void *user, size_t leaf_i, const uint32_t *prims, uint32_t count)
{
  const MeshInput *in = user;
  own_prims(prims, count, in->tree->compact_leaves[leaf_i].prim);
  return (uint32_t)leaf_i;
}

static bool no_memory(const MeshTree *t, Err *err) { return err_memory(err, "a mesh's tree", mesh_tree_bytes(t)); }

static bool fill_float(MeshInput *in, Err *err)
{
  MeshTree *t = in->tree;
  if (t->node_count) t->nodes = mem_alloc(t->node_count, sizeof *t->nodes);
  if (t->block_count) t->blocks = mem_alloc(t->block_count, sizeof *t->blocks);
  if ((t->node_count && !t->nodes) || (t->block_count && !t->blocks)) return no_memory(t, err);
  t->root = build_emit(in->build, t->nodes, emit_block, in);
  return true;
}

// Nodes are emitted as floats, for the time being, and then packed.
static bool fill_compact(MeshInput *in, Err *err)
{
  MeshTree *t = in->tree;
  Node8 *nodes = NULL;
  t->positions = in->mesh.positions;
  t->triangles = in->mesh.triangles;
  if (t->block_count) t->compact_leaves = mem_alloc(t->block_count, sizeof *t->compact_leaves);
  if (t->node_count) t->compact_nodes = mem_alloc(t->node_count, sizeof *t->compact_nodes);
  if (t->node_count) nodes = mem_alloc(t->node_count, sizeof *nodes);
  const bool ok =
      (!t->node_count || (t->compact_nodes && nodes)) && (!t->block_count || t->compact_leaves);
  if (ok) {
    t->root = build_emit(in->build, nodes, emit_compact_leaf, in);
    compact_pack(t->compact_nodes, nodes, t->node_count, in->build->jobs);
  }
  mem_free(nodes);
  return ok || no_memory(t, err);
}

static bool fill_tree(MeshInput *in, Err *err)
{
  Build *b = in->build;
  if (!build_init(b, in->mesh.triangle_count, err) || !gather(in, err) || !build_split(b, err)) return false;
  MeshTree *t = in->tree;
  t->bounds = b->bounds;
  t->triangle_count = b->count;
  t->has_pieces = b->has_pieces;
  t->node_count = b->node_count;
  t->block_count = b->leaf_count;
  return t->layout == TREE_COMPACT ? fill_compact(in, err) : fill_float(in, err);
}

MeshTree *mesh_tree_build(const float *positions, size_t vertex_count, const uint32_t *triangles,
                          size_t triangle_count, TreeOptions options, Jobs *jobs, const Cancel *cancel,
                          Err *err)
{
  if (triangle_count > MOST_TRIANGLES) {
    err_set(err, ERR_BAD_SCENE, "a mesh of %zu triangles; at most %zu are possible, split it", triangle_count,
            MOST_TRIANGLES);
    return NULL;
  }
  MeshTree *t = mem_zero(1, sizeof *t);
  if (!t) {
    err_memory(err, "a mesh's tree", sizeof *t);
    return NULL;
  }
  atomic_init(&t->users, 1);
  t->layout = options.layout;
  t->quality = options.quality;
  Build b = {.jobs = jobs, .cancel = cancel};
  MeshInput in = {{positions, vertex_count, triangles, triangle_count}, &b, NULL, t};
  if (options.quality == TREE_BEST) {
    b.clip = clip_triangle;
    b.clip_user = &in;
  }
  const bool ok = fill_tree(&in, err);
  build_finish(&b);
  if (ok) return t;
  mesh_tree_release(t);
  return NULL;
}

// Counts are relaxed on the way up, since whoever shares already holds a use, and acquire-release on the way down,
// so that the last user frees after all others are done reading.
MeshTree *mesh_tree_share(MeshTree *t)
{
  if (t) atomic_fetch_add_explicit(&t->users, 1, memory_order_relaxed);
  return t;
}

void mesh_tree_release(MeshTree *t)
{
  if (!t || atomic_fetch_sub_explicit(&t->users, 1, memory_order_acq_rel) > 1) return;
  if (t->file) {
    shared_file_release(t->file);
  } else {
    mem_free(t->nodes);
    mem_free(t->blocks);
    mem_free(t->compact_nodes);
    mem_free(t->compact_leaves);
  }
  mem_free(t);
}

size_t mesh_tree_bytes(const MeshTree *t)
{
  if (t->layout == TREE_COMPACT)
    return sizeof *t + t->node_count * sizeof *t->compact_nodes + t->block_count * sizeof *t->compact_leaves;
  return sizeof *t + t->node_count * sizeof *t->nodes + t->block_count * sizeof *t->blocks;
}

void mesh_tree_bounds(const MeshTree *t, float lo[3], float hi[3])
{
  v3_store(lo, t->bounds.lo);
  v3_store(hi, t->bounds.hi);
}
