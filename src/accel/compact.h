// Compact: reads a mesh's compact tree. Walks ask for nodes and leaves by mesh_node and mesh_block: of a tree of
// floats these are where they lie, of a compact one they are unpacked into the walk's own space, and the same code
// goes on. So the compact form has no walks of its own, and 64 rays that visit a node together unpack it once.
//
// A node keeps its children's boxes as bytes on a grid of its own: an origin, and along each axis a step that is a
// power of two (Ylitie, Karras, Laine, "Efficient incoherent ray traversal on GPUs through compressed wide BVHs",
// HPG 2017, section 3.2; Embree's quantized nodes are alike). Unpacked boxes are a little larger than the exact
// ones. That costs 1 to 5 % more visits and nothing else: a hit counts by its own box (accel/step.h), and any box
// that contains that one lets the ray through to it. accel/compact.c sees to that. A leaf keeps numbers of
// triangles; their corners come from the mesh.

#ifndef RAYFOLD_ACCEL_COMPACT_H
#define RAYFOLD_ACCEL_COMPACT_H

#include "accel/tree.h"

// accel/compact.c: the same nodes in the compact form.
void compact_pack(CompactNode *to, const Node8 *from, size_t count, Jobs *jobs);

static inline float compact_step(const CompactNode *c, int axis)
{
  const uint32_t bits = (uint32_t)c->exponent[axis] << 23;
  float step;
  memcpy(&step, &bits, sizeof step);
  return step;
}

// Of children that are there. The arithmetic of node_unpack: what is found out here about a plane holds there.
static inline float compact_plane(const CompactNode *c, int axis, int i)
{
  return (float)c->plane[axis][i] * compact_step(c, axis) + c->origin[axis];
}

// Lanes without a child become boxes that no ray enters, whatever their bytes say.
static inline void node_unpack(const CompactNode *c, Node8 *n)
{
  static const float no_box[16] = {INFINITY,  INFINITY,  INFINITY,  INFINITY,  INFINITY,  INFINITY,
                                   INFINITY,  INFINITY,  -INFINITY, -INFINITY, -INFINITY, -INFINITY,
                                   -INFINITY, -INFINITY, -INFINITY, -INFINITY};
  const unsigned used = ((1u << c->count) - 1) * 0x101;
  float *planes = (float *)(void *)n; // lower and upper of an axis are neighbours
  for (int k = 0; k < 3; k++) {
    const float step = compact_step(c, k);
    for (int i = 0; i < 16; i += WIDEST) {
      const wx at = wx_bytes(c->plane[k] + i) * step + c->origin[k];
      wx_store(planes + 16 * k + i, wx_choose(used >> i & WIDEST_BITS, at, wx_load(no_box + i)));
    }
  }
  memcpy(n->child, c->child, sizeof n->child);
}

static inline void leaf_unpack(const MeshTree *m, const CompactLeaf *l, Tri8 *b)
{
  static const float nowhere[3] = {NAN, NAN, NAN};
  const float *corners[3][8];
  for (int i = 0; i < 8; i++) {
    const bool is_used = l->prim[i] != NO_HIT;
    const uint32_t *t = m->triangles + 3 * (size_t)(is_used ? l->prim[i] : l->prim[0]);
    for (int c = 0; c < 3; c++) corners[c][i] = is_used ? m->positions + 3 * (size_t)t[c] : nowhere;
  }
  for (int c = 0; c < 3; c++) wide_points8(corners[c], b->v[c]);
  memcpy(b->prim, l->prim, sizeof b->prim);
}

// What leaf_unpack will read is fetched ahead in two steps: corners when the leaf is there, points when those are.
// That is worth 1.2 to 1.3 times the speed in scenes of a million triangles, and nothing where caches hold all.
static inline void leaf_fetch_corners(const MeshTree *m, uint32_t leaf_i)
{
  const uint32_t *prims = m->compact_leaves[leaf_i].prim;
  for (int i = 0; i < 8 && prims[i] != NO_HIT; i++) fetch_ahead(m->triangles + 3 * (size_t)prims[i], 1);
}

static inline void leaf_fetch_points(const MeshTree *m, uint32_t leaf_i)
{
  const uint32_t *prims = m->compact_leaves[leaf_i].prim;
  for (int i = 0; i < 8 && prims[i] != NO_HIT; i++)
    for (size_t c = 0; c < 3; c++)
      fetch_ahead(m->positions + 3 * (size_t)m->triangles[3 * (size_t)prims[i] + c], 1);
}

static inline const Node8 *mesh_node(const MeshTree *m, uint32_t node_i, Node8 *space)
{
  if (__builtin_expect(m->layout == TREE_FLOAT, 1)) return &m->nodes[node_i];
  node_unpack(&m->compact_nodes[node_i], space);
  return space;
}

static inline const Tri8 *mesh_block(const MeshTree *m, uint32_t block_i, Tri8 *space)
{
  if (__builtin_expect(m->layout == TREE_FLOAT, 1)) return &m->blocks[block_i];
  leaf_unpack(m, &m->compact_leaves[block_i], space);
  return space;
}

#endif
