#include "mesh_out.h"

#include <stdio.h>
#include <stdlib.h>

static void *grown(void *block, uint64_t count, size_t size)
{
  void *p = realloc(block, (size_t)count * size + 16); // Embree reads 16 bytes at the last vertex
  if (p) return p;
  fprintf(stderr, "not enough memory for a mesh of %llu parts\n", (unsigned long long)count);
  exit(70);
}

uint32_t out_vertex(MeshOut *m, rtb_v3 p)
{
  rtb_mesh *mesh = &m->mesh;
  if (mesh->nverts == m->vertex_room) {
    m->vertex_room = m->vertex_room ? 2 * m->vertex_room : 1 << 16;
    mesh->verts = grown(mesh->verts, m->vertex_room, 12);
  }
  float *v = mesh->verts + 3 * mesh->nverts;
  v[0] = p.x;
  v[1] = p.y;
  v[2] = p.z;
  return (uint32_t)mesh->nverts++;
}

void out_triangle(MeshOut *m, uint32_t a, uint32_t b, uint32_t c)
{
  rtb_mesh *mesh = &m->mesh;
  if (mesh->ntris == m->triangle_room) {
    m->triangle_room = m->triangle_room ? 2 * m->triangle_room : 1 << 16;
    mesh->idx = grown(mesh->idx, m->triangle_room, 12);
  }
  uint32_t *t = mesh->idx + 3 * mesh->ntris++;
  t[0] = a;
  t[1] = b;
  t[2] = c;
}

void out_quad(MeshOut *m, uint32_t a, uint32_t b, uint32_t c, uint32_t d)
{
  out_triangle(m, a, b, c);
  out_triangle(m, a, c, d);
}

void out_hexahedron(MeshOut *m, const uint32_t v[8])
{
  static const uint8_t side[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 4, 6, 2},
                                     {1, 3, 7, 5}, {2, 6, 7, 3}, {0, 1, 5, 4}};
  for (int i = 0; i < 6; i++) out_quad(m, v[side[i][0]], v[side[i][1]], v[side[i][2]], v[side[i][3]]);
}

void out_box(MeshOut *m, rtb_v3 lo, rtb_v3 hi)
{
  uint32_t v[8];
  for (int i = 0; i < 8; i++)
    v[i] = out_vertex(m, rtb_v(i & 1 ? hi.x : lo.x, i & 2 ? hi.y : lo.y, i & 4 ? hi.z : lo.z));
  out_hexahedron(m, v);
}
