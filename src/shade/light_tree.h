// LightTree: which of many emitters to aim at from a place. A tree of eight children a node over the emitters' boxes,
// walked from the root by chance: each child is as likely as a bound of what it may send to the place (Conty and Kulla,
// "Importance sampling of many lights with adaptive tree splitting", 2018; the bound in cosines alone as in pbrt-v4,
// "BVH light sampling"). Hot; light_tree.c builds it.
//
// Not bounds: how much of a child is hidden, and the fall-off within a spot's cone.

#ifndef RAYFOLD_SHADE_LIGHT_TREE_H
#define RAYFOLD_SHADE_LIGHT_TREE_H

#include "base/hash.h"
#include "base/vec.h"

enum { LIGHT_LEAF = INT32_MIN }; // of a child: an emitter's number is in the other bits
#define LIGHT_ROOT UINT32_MAX    // as a parent

// In lanes: a child's sphere around its box, its power, and the cone its normals lie in. Children that are not there
// have no power. What it sends falls off by the cosine beyond that cone, down to nothing at cos_end.
typedef struct LightNode {
  float x[8], y[8], z[8], radius2[8], power[8];
  float axis_x[8], axis_y[8], axis_z[8], cos_spread[8], sin_spread[8], cos_end[8];
  int32_t child[8];
} LightNode;

typedef struct LightTree {
  LightNode *nodes;  // the root first; in the LightSet's arena, as all here
  uint32_t *parent;  // of each node: node * 8 + lane, or LIGHT_ROOT
  uint32_t *leaf_of; // of each emitter: node * 8 + lane; LIGHT_ROOT: it is never aimed at
  size_t node_count; // 0: no emitter has power
  size_t leaf_count; // emitters that have
} LightTree;

typedef struct LightChances {
  float of[8], sum;
} LightChances;

// Bounds of what each child sends to p, up to one factor for all. n: the normal there, zero if light counts from both
// sides. Every lane does the same arithmetic, so that it can be done in vectors.
static inline LightChances light_node_chances(const LightNode *node, Vec3 p, Vec3 n)
{
  LightChances c;
  const bool has_side = !v3_is_zero(n);
  for (int i = 0; i < 8; i++) {
    const float dx = p[0] - node->x[i], dy = p[1] - node->y[i], dz = p[2] - node->z[i];
    const float d2 = dx * dx + dy * dy + dz * dz, r2 = node->radius2[i];
    const float inv = 1 / sqrtf(max_f(d2, 1e-36f));
    // The half angle of the child's sphere, seen from p.
    const float sin2_u = min_f(r2 * inv * inv, 1), sin_u = sqrtf(sin2_u), cos_u = sqrtf(1 - sin2_u);
    // Between the axis and the way to p; less the spread of normals; less the sphere's half angle.
    const float cos_w =
        clamp_f((node->axis_x[i] * dx + node->axis_y[i] * dy + node->axis_z[i] * dz) * inv, -1, 1);
    const float sin_w = sqrtf(1 - cos_w * cos_w);
    const bool is_within = cos_w >= node->cos_spread[i];
    const float cos_a = is_within ? 1 : cos_w * node->cos_spread[i] + sin_w * node->sin_spread[i];
    const float sin_a = is_within ? 0 : sin_w * node->cos_spread[i] - cos_w * node->sin_spread[i];
    const float cos_b = cos_a >= cos_u ? 1 : cos_a * cos_u + sin_a * sin_u;
    // The same on the side of p. Rounding must not hide what is just in sight.
    const float cos_i = -(n[0] * dx + n[1] * dy + n[2] * dz) * inv,
                sin_i = sqrtf(max_f(1 - cos_i * cos_i, 0));
    const float cos_n = cos_i >= cos_u ? 1 : cos_i * cos_u + sin_i * sin_u;
    const float side = !has_side ? 1 : cos_n > -1e-3f ? max_f(cos_n, 1e-3f) : 0;
    const float sent = cos_b > node->cos_end[i] - 1e-3f ? max_f(cos_b, 1e-3f) : 0;
    const float near = node->power[i] / max_f(d2, r2 * 0.25f);
    c.of[i] = node->power[i] > 0 ? (d2 <= r2 ? near : near * sent * side) : 0;
  }
  c.sum = 0;
  for (int i = 0; i < 8; i++) c.sum += c.of[i];
  return c;
}

// The lane u falls to, never one without a chance; *u is then where in its step it fell.
static inline int light_lane_at(const LightChances *c, double *u)
{
  double at = *u * (double)c->sum, before = 0;
  int last = 0;
  for (int i = 0; i < 8; i++) {
    if (!(c->of[i] > 0)) continue;
    last = i;
    if (at < before + (double)c->of[i]) break;
    before += (double)c->of[i];
  }
  const double rest = (at - before) / (double)c->of[last];
  *u = rest < 0 ? 0 : rest < 1 ? rest : 0x1.fffffffffffffp-1;
  return last;
}

// An emitter for a place and a number in [0, 1), and how likely it was. False: none can send anything there.
static inline bool light_tree_pick(const LightTree *t, Vec3 p, Vec3 n, float choice, uint32_t *emitter,
                                   float *pmf)
{
  // A float has 24 bits, and a deep tree wants more: the rest are made up from them.
  double u = (double)choice + (double)unit_float(hash_u32((uint32_t)(choice * 0x1p24f))) * 0x1p-24;
  *pmf = 1;
  *emitter = t->leaf_count == 1 ? (uint32_t)t->nodes[0].child[0] & ~(uint32_t)LIGHT_LEAF : 0;
  if (t->leaf_count == 1) return true; // nothing to choose
  for (int32_t node = 0; t->node_count;) {
    const LightChances c = light_node_chances(&t->nodes[node], p, n);
    if (!(c.sum > 0)) return false;
    const int lane = light_lane_at(&c, &u);
    *pmf *= c.of[lane] / c.sum;
    node = t->nodes[node].child[lane];
    if (node >= 0) continue;
    *emitter = (uint32_t)node & ~(uint32_t)LIGHT_LEAF;
    return *pmf > 0;
  }
  return false;
}

// How likely light_tree_pick() is to choose this emitter there.
static inline float light_tree_pmf(const LightTree *t, Vec3 p, Vec3 n, uint32_t emitter)
{
  uint32_t path[64];
  int length = 0;
  float pmf = 1;
  for (uint32_t at = t->leaf_of[emitter]; at != LIGHT_ROOT; at = t->parent[at / 8]) path[length++] = at;
  if (!length || t->leaf_count == 1) return length ? 1 : 0;
  // From the root down, so that the product is the same one.
  while (length-- > 0) {
    const LightChances c = light_node_chances(&t->nodes[path[length] / 8], p, n);
    if (!(c.of[path[length] % 8] > 0)) return 0;
    pmf *= c.of[path[length] % 8] / c.sum;
  }
  return pmf;
}

#endif
