// Mesh out: a triangle mesh that grows by vertices, triangles and boxes, as the generators make it. Ends the program
// when memory is out.

#ifndef BENCH_MESH_OUT_H
#define BENCH_MESH_OUT_H

#include "rtb.h"

typedef struct MeshOut {
  rtb_mesh mesh; // owned
  uint64_t vertex_room, triangle_room;
} MeshOut; // zero is an empty mesh

uint32_t out_vertex(MeshOut *m, rtb_v3 p); // its index
void out_triangle(MeshOut *m, uint32_t a, uint32_t b, uint32_t c);
void out_quad(MeshOut *m, uint32_t a, uint32_t b, uint32_t c, uint32_t d);
void out_hexahedron(MeshOut *m, const uint32_t v[8]); // corner i: bit 0 is x, bit 1 y, bit 2 z
void out_box(MeshOut *m, rtb_v3 lo, rtb_v3 hi);

#endif
