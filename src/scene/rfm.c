// See rfm.h: what reader and writer of saved models share.

#include "scene/rfm.h"

#include "base/hash.h"

#define ARRAY_OF(member, noun, width, values, by_triangle)       \
  {                                                              \
    noun, offsetof(MeshData, member), width, values, by_triangle \
  }

// From RFM_POSITIONS on.
static const RfmArray arrays[] = {
    ARRAY_OF(positions, "positions", 12, RFM_FLOATS, false),
    ARRAY_OF(normals, "normals", 12, RFM_FLOATS, false),
    ARRAY_OF(texcoords[0], "texture coordinates", 8, RFM_FLOATS, false),
    ARRAY_OF(texcoords[1], "second texture coordinates", 8, RFM_FLOATS, false),
    ARRAY_OF(colors, "vertex colours", 16, RFM_FLOATS, false),
    ARRAY_OF(tangents, "tangents", 16, RFM_FLOATS, false),
    ARRAY_OF(triangles, "triangles", 12, RFM_VERTICES, true),
    ARRAY_OF(material_slots, "material slots", 2, RFM_SLOTS, true),
};
_Static_assert(sizeof arrays / sizeof *arrays == RFM_MATERIAL_SLOTS - RFM_POSITIONS + 1, "one a kind");

const RfmArray *rfm_array(uint32_t kind)
{
  return kind >= RFM_POSITIONS && kind <= RFM_MATERIAL_SLOTS ? &arrays[kind - RFM_POSITIONS] : NULL;
}

const char *rfm_noun(uint32_t kind)
{
  if (rfm_array(kind)) return rfm_array(kind)->noun;
  switch (kind) {
  case RFM_SCENE: return "scene";
  case RFM_NOTES: return "notes";
  case RFM_SOURCE: return "sources";
  case RFM_PICTURE: return "picture";
  case RFM_TEXTURES: return "textures";
  case RFM_MESH: return "sizes";
  case RFM_TREE_HEAD:
  case RFM_TREE_NODES:
  case RFM_TREE_LEAVES: return "tree";
  default: return "unknown part";
  }
}

uint64_t rfm_hash_piece(const void *data, size_t size)
{
  return hash_bulk(0, data, size);
}

uint64_t rfm_hash(const void *data, size_t size)
{
  const char *p = data;
  uint64_t h = size;
  for (size_t left = size; left;) {
    const size_t n = left < RFM_PIECE ? left : RFM_PIECE;
    h = hash_u64(h ^ rfm_hash_piece(p, n));
    p += n;
    left -= n;
  }
  return h;
}

uint64_t rfm_hash_head(const RfmHead *head, const RfmSection *sections)
{
  return hash_bulk(hash_bulk(0, head, offsetof(RfmHead, hash)), sections,
                   head->section_count * sizeof *sections);
}
