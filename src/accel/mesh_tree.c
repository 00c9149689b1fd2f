// The tree of one mesh: its triangles' boxes go through build.h, and each leaf becomes a Tri8 block of vertices, so
// that a ray needs no look at the mesh's own arrays. Does not keep those arrays.

#include "accel/build.h"
#include "base/mem.h"

enum { CHUNK = 1 << 14 };

// Triangle numbers are child codes and must leave NO_HIT free; the same limit keeps node numbers under LEAF_BIT.
#define MOST_TRIANGLES ((size_t)LEAF_BIT - 2)

typedef struct MeshInput {
  const float *positions;
  size_t vertex_count;
  const uint32_t *triangles;
  size_t triangle_count;
  Build *build;
  size_t *kept; // one a chunk
  MeshTree *tree;
} MeshInput;

// The corners of a triangle; false for one that nothing can hit: of no area, not finite, or with a bad index.
static bool triangle_corners(const MeshInput *in, size_t i, Vec3 v[3])
{
  for (int c = 0; c < 3; c++) {
    const uint32_t vertex = in->triangles[3 * i + c];
    if (vertex >= in->vertex_count) return false;
    v[c] = v3_load(in->positions + 3 * (size_t)vertex);
    if (!v3_is_finite(v[c])) return false;
  }
  double area = 0;
  for (int k = 0; k < 3; k++) {
    const int l = k == 2 ? 0 : k + 1;
    area += fabs(((double)v[1][k] - v[0][k]) * ((double)v[2][l] - v[0][l]) -
                 ((double)v[1][l] - v[0][l]) * ((double)v[2][k] - v[0][k]));
  }
  return area > 0;
}

static void gather_chunk(void *user, size_t chunk, int worker)
{
  (void)worker;
  const MeshInput *in = user;
  BuildRef *out = in->build->refs + chunk * CHUNK;
  const size_t end = (chunk + 1) * CHUNK < in->triangle_count ? (chunk + 1) * CHUNK : in->triangle_count;
  for (size_t i = chunk * CHUNK; i < end; i++) {
    Vec3 v[3];
    if (!triangle_corners(in, i, v)) continue;
    const Bounds box = {lanes_min(lanes_min(v[0], v[1]), v[2]), lanes_max(lanes_max(v[0], v[1]), v[2])};
    *out++ = ref_of(&box, (uint32_t)i);
  }
  in->kept[chunk] = (size_t)(out - (in->build->refs + chunk * CHUNK));
}

// Fills the references chunk by chunk and closes the gaps that left-out triangles leave.
static bool gather(MeshInput *in, Err *err)
{
  Build *b = in->build;
  const size_t chunks = (in->triangle_count + CHUNK - 1) / CHUNK;
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

static uint32_t emit_block(void *user, size_t leaf_i, const uint32_t *prims, uint32_t count)
{
  const MeshInput *in = user;
  Tri8 *block = &in->tree->blocks[leaf_i];
  for (uint32_t lane = 0; lane < 8; lane++) {
    Vec3 v[3] = {v3_all(NAN), v3_all(NAN), v3_all(NAN)};
    block->prim[lane] = lane < count ? prims[lane] : NO_HIT;
    if (lane < count) triangle_corners(in, block->prim[lane], v);
    for (int c = 0; c < 3; c++) {
      for (int k = 0; k < 3; k++) block->v[c][k][lane] = v[c][k];
    }
  }
  return (uint32_t)leaf_i;
}

static bool fill_tree(MeshInput *in, Err *err)
{
  Build *b = in->build;
  if (!build_init(b, in->triangle_count, err) || !gather(in, err) || !build_split(b, err)) return false;
  MeshTree *t = in->tree;
  t->bounds = b->bounds;
  t->triangle_count = b->count;
  t->node_count = b->node_count;
  t->block_count = b->leaf_count;
  if (t->node_count) t->nodes = mem_alloc(t->node_count, sizeof *t->nodes);
  if (t->block_count) t->blocks = mem_alloc(t->block_count, sizeof *t->blocks);
  if ((t->node_count && !t->nodes) || (t->block_count && !t->blocks)) {
    return err_memory(err, "a mesh's tree", mesh_tree_bytes(t));
  }
  t->root = build_emit(b, t->nodes, emit_block, in);
  return true;
}

MeshTree *mesh_tree_build(const float *positions, size_t vertex_count, const uint32_t *triangles,
                          size_t triangle_count, Jobs *jobs, const Cancel *cancel, Err *err)
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
  Build b = {.jobs = jobs, .cancel = cancel};
  MeshInput in = {positions, vertex_count, triangles, triangle_count, &b, NULL, t};
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
  }
  mem_free(t);
}

size_t mesh_tree_bytes(const MeshTree *t)
{
  return sizeof *t + t->node_count * sizeof *t->nodes + t->block_count * sizeof *t->blocks;
}

void mesh_tree_bounds(const MeshTree *t, float lo[3], float hi[3])
{
  v3_store(lo, t->bounds.lo);
  v3_store(hi, t->bounds.hi);
}
