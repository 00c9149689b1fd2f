// Rung 3, a tree of fat nodes: boxes around boxes, down to one triangle (Kay and Kajiya 1986). A ray now costs the
// logarithm of the scene. Written as one first writes it: every node is its own allocation, has room for everything a
// node might hold, pointers to its children, and the triangle with its whole material inside, although a walk reads
// the box of most nodes and nothing else.

#include "halves.h"

#include <stdlib.h>

typedef struct FatTriangle {
  Triangle shape;
  float normal[3], colour[3];
  float reflection, roughness, specular, metallic, scatter;
  uint32_t prim;
} FatTriangle;

typedef struct FatNode { // 136 bytes: more than two cache lines
  struct FatNode *left, *right;
  Box box;
  FatTriangle triangle;
  bool is_leaf;
} FatNode;

typedef struct FatTree {
  FatNode *root;
} FatTree;

static FatTriangle fat_triangle(const LadderMesh *m, uint32_t prim)
{
  FatTriangle t = {
      .shape = mesh_triangle(m, prim), .colour = {0.8f, 0.8f, 0.8f}, .roughness = 0.5f, .prim = prim};
  cross3(t.shape.e1, t.shape.e2, t.normal);
  return t;
}

static void free_nodes(FatNode *n)
{
  if (!n) return;
  free_nodes(n->left);
  free_nodes(n->right);
  free(n);
}

// As deep as the logarithm of count.
static FatNode *build_node(const LadderMesh *m, Item *items, uint32_t count, size_t *bytes)
{
  FatNode *n = calloc(1, sizeof *n);
  if (!n) return NULL;
  *bytes += sizeof *n;
  n->box = items_box(items, count);
  n->is_leaf = count == 1;
  if (n->is_leaf) {
    n->triangle = fat_triangle(m, items[0].prim);
    return n;
  }
  items_halve(items, count, count / 2);
  n->left = build_node(m, items, count / 2, bytes);
  n->right = n->left ? build_node(m, items + count / 2, count - count / 2, bytes) : NULL;
  if (n->right) return n;
  free_nodes(n);
  return NULL;
}

static void *fat_build(const LadderMesh *m, size_t *bytes)
{
  Item *items = items_of(m);
  FatTree *tree = malloc(sizeof *tree);
  *bytes = 0;
  if (items && tree) tree->root = build_node(m, items, m->triangle_count, bytes);
  const bool ok = items && tree && tree->root;
  free(items);
  if (ok) return tree;
  free(tree);
  return NULL;
}

static void fat_destroy(void *tree)
{
  if (tree) free_nodes(((FatTree *)tree)->root);
  free(tree);
}

typedef struct Waiting { // a node still to visit, and where the ray enters it
  const FatNode *node;
  float near;
} Waiting;

static void fat_walk(const FatTree *tree, Walk *w, LadderCounts *c)
{
  Waiting stack[64];
  int height = 0;
  stack[height++] = (Waiting){tree->root, w->tmin};
  while (height > 0) {
    const Waiting e = stack[--height];
    if (e.near > w->best.t * SLACK) continue; // something nearer was found since
    const FatNode *n = e.node;
    if (n->is_leaf) {
      c->triangles++;
      walk_triangle(w, &n->triangle.shape, n->triangle.prim);
      continue;
    }
    const Waiting l = {n->left, walk_box(w, &n->left->box)}, r = {n->right, walk_box(w, &n->right->box)};
    c->boxes += 2;
    const bool left_first = l.near <= r.near;
    const Waiting far = left_first ? r : l, near = left_first ? l : r;
    if (far.near < INFINITY) stack[height++] = far;
    if (near.near < INFINITY) stack[height++] = near;
  }
}

static void fat_closest(const void *tree, const LadderRay *rays, LadderHit *hits, size_t count,
                        LadderCounts *c)
{
  for (size_t r = 0; r < count; r++) {
    Walk w = walk_begin(&rays[r]);
    fat_walk(tree, &w, c);
    hits[r] = w.best;
  }
}

const Rung rung_fat = {"tree, fat nodes",
                       "Boxes around boxes: a ray costs the logarithm of the scene.",
                       true,
                       fat_build,
                       fat_closest,
                       fat_destroy};
