// Voxels: a picture in three dimensions, of cells that are empty or hold the number of a palette entry. Immutable and
// counted: an edit makes the next one, which shares every node that it does not touch, so that a stroke costs what it
// touches, undo costs nothing, and the world that is being rendered is never written to.
//
//   Voxels -> nodes[]          64^3 cells each, NULL where all is empty; shared between successive Voxels
//     VoxelNode                one block of memory
//       some[8], full[8]       of its 8^3 bricks: those with a shape of their own, those filled with one entry
//       any[8]                 either
//       masks[]                one a brick in `some`: which of its 8^3 cells are filled
//       at[], data[]           one a brick: where its VoxelRecord is, with the entries of its filled cells; or its one entry
//       full_ids[]             one a brick in `full`
//
// Masks are rows of eight words, one for each z, bit x + 8 y. Things that only some bricks have are found by counting
// the bits before theirs. This file knows neither materials nor rays: geom/voxel_walk.h walks, world/ gives matter.

#ifndef RAYFOLD_IMAGE_VOXELS_H
#define RAYFOLD_IMAGE_VOXELS_H

#include "base/err.h"

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

enum {
  VOXELS_MOST_SIDE = 4096,
  VOXELS_MOST_ENTRIES = 65535, // of the palette, without that for empty cells
  VOXELS_MOST_LOOKS = 255,
  VOXEL_UNIFORM = 1u << 31, // in VoxelNode.at: the brick has one entry, which stands in the low bits
};

// What entries may have beside their colour.
typedef struct VoxelLook {
  char *material;  // owned: a material of the scene, whose colour the entry's multiplies; NULL: the numbers below
  float roughness, metallic;
  float emission;  // radiance is the entry's colour times this
  float transmission, ior;
} VoxelLook;

typedef struct VoxelEntry {
  float color[3];  // linear
  uint8_t look;    // index of the look
  char *name;      // owned; NULL: none
} VoxelEntry;

typedef struct VoxelPalette { // shared by successive Voxels
  atomic_int users;
  uint32_t entry_count, entry_room; // entry 0 stands for empty cells
  uint32_t look_count;     // at least 1: plain
  VoxelEntry *entries;     // owned
  VoxelLook *looks;        // owned
} VoxelPalette;

// The entries of a brick's filled cells, in as many bits as they need: `count` entries of id_bits each, counted from base,
// then, for each filled cell, `bits` that say which of them. bits 0: it has no list, and id_bits a cell. Four bytes can be
// read from where any of them begins.
typedef struct VoxelRecord {
  uint8_t bits, id_bits;
  uint16_t count, base;
} VoxelRecord;

typedef struct VoxelNode {
  atomic_int users;
  uint32_t size;                           // bytes of the whole block
  uint32_t brick_count, full_count;
  uint32_t cell_count;                     // filled
  uint64_t some[8], full[8], any[8];
  uint16_t some_before[8], full_before[8]; // bits set in words before
  uint8_t lo[3], hi[3];                    // of what is filled: first cells, last cells
  const uint64_t (*masks)[8];              // all four point into the block
  const uint32_t *at;
  const uint16_t *full_ids;
  const uint8_t *data;
} VoxelNode;

typedef struct Voxels {
  atomic_int users;
  int32_t size[3];       // cells
  int32_t nodes_size[3]; // nodes
  VoxelNode **nodes;     // owned array of shared nodes, x fastest, then y, then z
  VoxelPalette *palette; // shared
  int32_t lo[3], hi[3];  // of what is filled: first cells, one past the last; lo >= hi: nothing is
  uint64_t cell_count;   // filled
} Voxels;

Voxels *voxels_share(Voxels *v);
void voxels_release(Voxels *v); // accepts NULL
size_t voxels_bytes(const Voxels *v); // of nodes and palette
uint64_t voxels_surface_count(const Voxels *v); // filled cells with a side to an empty one
uint64_t voxels_hash(uint64_t seed, const Voxels *v);

// --- reading cells ------------------------------------------------------------------------------------------------
static inline uint32_t voxel_bits_before(const uint64_t *words, const uint16_t *before, uint32_t word, uint32_t bit)
{
  return before[word] + (uint32_t)__builtin_popcountll(words[word] & ((1ull << bit) - 1));
}

// `bits` bits, up to 16, from bit `at` on.
static inline uint32_t voxel_record_bits(const uint8_t *d, uint32_t at, uint32_t bits)
{
  uint32_t four;
  memcpy(&four, d + (at >> 3), 4);
  return four >> (at & 7) & ((1u << bits) - 1);
}

// The entry of a filled cell of the brick of this rank; cell is x + 8 y + 64 z.
static inline uint32_t voxel_brick_entry(const VoxelNode *n, uint32_t rank, uint32_t cell)
{
  const uint32_t at = n->at[rank];
  if (at & VOXEL_UNIFORM) return at & 0xffff;
  const uint64_t *mask = n->masks[rank];
  uint32_t i = (uint32_t)__builtin_popcountll(mask[cell >> 6] & ((1ull << (cell & 63)) - 1));
  for (uint32_t z = 0; z < 7; z++) i += (uint32_t)__builtin_popcountll(z < cell >> 6 ? mask[z] : 0); // no branches
  const uint8_t *d = n->data + 2 * (size_t)at;
  VoxelRecord r;
  memcpy(&r, d, sizeof r);
  d += sizeof r;
  const uint32_t which = r.bits ? voxel_record_bits(d, r.count * r.id_bits + i * r.bits, r.bits) : i;
  return r.base + voxel_record_bits(d, which * r.id_bits, r.id_bits);
}

// The entry of a cell of a node, 0 to 63 each; 0: empty.
static inline uint32_t voxel_node_entry(const VoxelNode *n, uint32_t x, uint32_t y, uint32_t z)
{
  const uint32_t word = z >> 3, bit = (x >> 3) | (y >> 3) << 3;
  if (n->full[word] >> bit & 1) return n->full_ids[voxel_bits_before(n->full, n->full_before, word, bit)];
  if (!(n->some[word] >> bit & 1)) return 0;
  const uint32_t rank = voxel_bits_before(n->some, n->some_before, word, bit);
  const uint32_t cell = (x & 7) | (y & 7) << 3 | (z & 7) << 6;
  return n->masks[rank][cell >> 6] >> (cell & 63) & 1 ? voxel_brick_entry(n, rank, cell) : 0;
}

static inline const VoxelNode *voxels_node(const Voxels *v, uint32_t x, uint32_t y, uint32_t z)
{
  return v->nodes[(x >> 6) + (size_t)v->nodes_size[0] * ((y >> 6) + (size_t)v->nodes_size[1] * (z >> 6))];
}

// The entry of any cell, also outside, where all is empty.
static inline uint32_t voxels_entry(const Voxels *v, int32_t x, int32_t y, int32_t z)
{
  if ((uint32_t)x >= (uint32_t)v->size[0] || (uint32_t)y >= (uint32_t)v->size[1] || (uint32_t)z >= (uint32_t)v->size[2])
    return 0;
  const VoxelNode *n = voxels_node(v, (uint32_t)x, (uint32_t)y, (uint32_t)z);
  return n ? voxel_node_entry(n, x & 63, y & 63, z & 63) : 0;
}

// --- making the next one ------------------------------------------------------------------------------------------
// Cells are written into bricks that lie open, 16 bits a cell, until voxel_edit_end() packs them. Where too many lie
// open, they are packed in between, so that memory stays small whatever is filled.
typedef struct VoxelEdit VoxelEdit;

// From nothing (sizes are checked, with the memory that a grid of that size begins with), or from another.
VoxelEdit *voxel_edit_create(const int32_t size[3], Err *err);
VoxelEdit *voxel_edit_from(const Voxels *from, Err *err);
const Voxels *voxel_edit_grid(const VoxelEdit *e); // its size and palette; cells may be older
void voxel_edit_destroy(VoxelEdit *e); // accepts NULL

uint32_t voxel_edit_get(const VoxelEdit *e, int32_t x, int32_t y, int32_t z); // 0 outside
bool voxel_edit_is_open(const VoxelEdit *e, int32_t x, int32_t y, int32_t z); // was something written to this cell's node?
// Writes outside are ignored. False when memory is out.
bool voxel_edit_put(VoxelEdit *e, int32_t x, int32_t y, int32_t z, uint32_t entry);
// All cells with lo <= cell < hi, whole bricks at once.
bool voxel_edit_fill(VoxelEdit *e, const int32_t lo[3], const int32_t hi[3], uint32_t entry);

// The number of an entry with this colour and look: one that is there, or a new one. When the palette is full the
// nearest colour of that look. -1: no memory, or nothing of that look in a full palette.
int32_t voxel_edit_color(VoxelEdit *e, const float color[3], uint32_t look);
// A new entry, or the one of that name changed; -1: no memory or no room.
int32_t voxel_edit_name(VoxelEdit *e, const char *name, const float color[3], uint32_t look);
int32_t voxel_edit_find(const VoxelEdit *e, const char *name); // -1: none
// The number of an equal look, or of a new one; -1: no memory or too many.
int32_t voxel_edit_look(VoxelEdit *e, const VoxelLook *look);
VoxelLook voxel_look_plain(void);

// The result, and the end of the edit; NULL when memory is out.
Voxels *voxel_edit_end(VoxelEdit *e, Err *err);

#endif
