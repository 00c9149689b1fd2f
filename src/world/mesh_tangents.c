// Tangents for meshes that bring none and wear a normal map: made once a mesh, shared with the worlds that follow.

#include "world/prepare.h"

// The set of texture coordinates of the first normal map the instance wears; -1: it needs no tangents made.
static int tangent_set(const Prepare *p, const WorldInstance *w)
{
  if (!w->mesh.normals || w->mesh.tangents) return -1;
  for (uint32_t s = 0; s < w->slot_count; s++) {
    const int32_t map = p->materials.items[w->materials[s]].normal_map.map;
    const int set = map >= 0 ? p->textures.items[map].texcoord & 1 : -1;
    if (set >= 0 && w->mesh.texcoords[set]) return set;
  }
  return -1;
}

static bool make_tangents(Prepare *p, MeshPart *part, const TriangleMesh *mesh, int set)
{
  if (part->tangents && part->tangents->set == set) return true;
  tangents_release(part->tangents);
  part->tangents = tangents_make(mesh, part->data->vertex_count, part->data->triangle_count, set, p->jobs, p->cancel,
                                 p->err);
  return part->tangents;
}

bool prepare_tangents(Prepare *p)
{
  for (size_t i = 0; i < p->shading.count; i++) {
    WorldInstance *w = &p->shading.items[i];
    const int set = p->mesh_parts.items[i] >= 0 ? tangent_set(p, w) : -1;
    if (set < 0) continue;
    MeshPart *part = &p->parts->meshes.items[p->mesh_parts.items[i]];
    if (part->has_set_tangents && part->tangents->set != set) continue; // the mesh's first normal map counts
    if (!make_tangents(p, part, &w->mesh, set)) return false;
    part->has_set_tangents = true;
    w->mesh.tangents = part->tangents->tangents;
    w->mesh.tangent_of = part->tangents->of_corner;
  }
  return true;
}
