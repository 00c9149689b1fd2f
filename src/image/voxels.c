// See voxels.h: nodes packed and shared, and edits that lay bricks open.

#include "image/voxels.h"

#include "base/array.h"
#include "base/hash.h"
#include "base/table.h"

#include <math.h>

enum {
  BRICKS = 512, // of a node
  CELLS = 512,  // of a brick
  MOST_OPEN = 1 << 16, // bricks, 1 kB each, before they are packed in between
  NEAR_SIDE = 32,      // of the lattice of colours; of 8, 16, 32, 64 this is the fastest for a photograph's colours
};

// --- palettes -----------------------------------------------------------------------------------------------------
VoxelLook voxel_look_plain(void) { return (VoxelLook){.roughness = 0.9f, .ior = 1.5f}; }

static char *copy_text(const char *s)
{
  const size_t n = s ? strlen(s) + 1 : 0;
  char *copy = n ? mem_alloc(n, 1) : NULL;
  if (copy) memcpy(copy, s, n);
  return copy;
}

static void palette_release(VoxelPalette *p)
{
  if (!p || atomic_fetch_sub_explicit(&p->users, 1, memory_order_acq_rel) != 1) return;
  for (uint32_t i = 0; p->entries && i < p->entry_count; i++) mem_free(p->entries[i].name);
  for (uint32_t i = 0; p->looks && i < p->look_count; i++) mem_free(p->looks[i].material);
  mem_free(p->entries);
  mem_free(p->looks);
  mem_free(p);
}

static VoxelPalette *palette_share(VoxelPalette *p)
{
  atomic_fetch_add_explicit(&p->users, 1, memory_order_relaxed);
  return p;
}

static VoxelPalette *palette_create(void)
{
  VoxelPalette *p = mem_zero(1, sizeof *p);
  if (!p) return NULL;
  atomic_init(&p->users, 1);
  p->entries = mem_zero(1, sizeof *p->entries);
  p->looks = mem_zero(1, sizeof *p->looks);
  p->entry_count = p->entry_room = p->entries ? 1 : 0;
  p->look_count = p->looks ? 1 : 0;
  if (p->looks) p->looks[0] = voxel_look_plain();
  if (p->entries && p->looks) return p;
  palette_release(p);
  return NULL;
}

static VoxelPalette *palette_copy(const VoxelPalette *from)
{
  VoxelPalette *p = mem_zero(1, sizeof *p);
  if (!p) return NULL;
  atomic_init(&p->users, 1);
  p->entries = mem_zero(from->entry_count, sizeof *p->entries);
  p->looks = mem_zero(from->look_count, sizeof *p->looks);
  p->entry_room = from->entry_count;
  bool ok = p->entries && p->looks;
  for (; ok && p->entry_count < from->entry_count; p->entry_count++) {
    const VoxelEntry *e = &from->entries[p->entry_count];
    p->entries[p->entry_count] = *e;
    p->entries[p->entry_count].name = copy_text(e->name);
    ok = !e->name || p->entries[p->entry_count].name;
  }
  for (; ok && p->look_count < from->look_count; p->look_count++) {
    const VoxelLook *l = &from->looks[p->look_count];
    p->looks[p->look_count] = *l;
    p->looks[p->look_count].material = copy_text(l->material);
    ok = !l->material || p->looks[p->look_count].material;
  }
  if (ok) return p;
  palette_release(p);
  return NULL;
}

// --- counting users -----------------------------------------------------------------------------------------------
static VoxelNode *node_share(VoxelNode *n)
{
  if (n) atomic_fetch_add_explicit(&n->users, 1, memory_order_relaxed);
  return n;
}

static void node_release(VoxelNode *n)
{
  if (n && atomic_fetch_sub_explicit(&n->users, 1, memory_order_acq_rel) == 1) mem_free(n);
}

static size_t node_count(const Voxels *v)
{
  return (size_t)v->nodes_size[0] * (size_t)v->nodes_size[1] * (size_t)v->nodes_size[2];
}

Voxels *voxels_share(Voxels *v)
{
  atomic_fetch_add_explicit(&v->users, 1, memory_order_relaxed);
  return v;
}

void voxels_release(Voxels *v)
{
  if (!v || atomic_fetch_sub_explicit(&v->users, 1, memory_order_acq_rel) != 1) return;
  for (size_t i = 0; v->nodes && i < node_count(v); i++) node_release(v->nodes[i]);
  mem_free(v->nodes);
  palette_release(v->palette);
  mem_free(v);
}

size_t voxels_bytes(const Voxels *v)
{
  size_t size = sizeof *v + node_count(v) * sizeof *v->nodes;
  for (size_t i = 0; i < node_count(v); i++) size += v->nodes[i] ? v->nodes[i]->size : 0;
  return size + sizeof *v->palette + v->palette->entry_count * sizeof *v->palette->entries +
         v->palette->look_count * sizeof *v->palette->looks;
}

uint64_t voxels_hash(uint64_t h, const Voxels *v)
{
  h = hash_bulk(h, v->size, sizeof v->size);
  for (uint32_t i = 1; i < v->palette->entry_count; i++) {
    const VoxelEntry *e = &v->palette->entries[i];
    const VoxelLook *l = &v->palette->looks[e->look];
    const float numbers[8] = {e->color[0], e->color[1], e->color[2], l->roughness, l->metallic, l->emission,
                              l->transmission, l->ior};
    h = hash_bytes(h, numbers, sizeof numbers);
    if (l->material) h = hash_bytes(h, l->material, strlen(l->material));
  }
  for (size_t i = 0; i < node_count(v); i++) {
    const VoxelNode *n = v->nodes[i];
    const size_t head = n ? (size_t)((const char *)n->masks - (const char *)n) : 0;
    if (!n) continue;
    h = hash_bulk(hash_bytes(h, &i, sizeof i), n->some, sizeof n->some + sizeof n->full);
    h = hash_bulk(h, n->masks, n->size - head);
  }
  return h;
}

static uint64_t brick_mask(const VoxelNode *n, uint32_t bx, uint32_t by, uint32_t bz, uint32_t z)
{
  const uint32_t bit = bx | by << 3;
  if (n->full[bz] >> bit & 1) return ~0ull;
  if (!(n->some[bz] >> bit & 1)) return 0;
  return n->masks[voxel_bits_before(n->some, n->some_before, bz, bit)][z];
}

// A slice of 8 x 8 cells anywhere: bit x + 8 y.
static uint64_t slice_at(const Voxels *v, int32_t bx, int32_t by, int32_t z)
{
  if (bx < 0 || by < 0 || z < 0 || bx >= v->nodes_size[0] * 8 || by >= v->nodes_size[1] * 8 || z >= v->nodes_size[2] * 64)
    return 0;
  const VoxelNode *n = voxels_node(v, (uint32_t)bx * 8, (uint32_t)by * 8, (uint32_t)z);
  return n ? brick_mask(n, (uint32_t)bx & 7, (uint32_t)by & 7, (uint32_t)z >> 3 & 7, (uint32_t)z & 7) : 0;
}

static uint64_t count_slice(const Voxels *v, int32_t bx, int32_t by, int32_t z)
{
  const uint64_t m = slice_at(v, bx, by, z), column0 = 0x0101010101010101ull, row0 = 0xff;
  if (!m) return 0;
  const uint64_t left = slice_at(v, bx - 1, by, z), right = slice_at(v, bx + 1, by, z);
  const uint64_t below = slice_at(v, bx, by - 1, z), above = slice_at(v, bx, by + 1, z);
  const uint64_t west = (m << 1 & ~column0) | (left >> 7 & column0), east = (m >> 1 & ~(column0 << 7)) | (right << 7 & column0 << 7);
  const uint64_t south = m << 8 | (below >> 56 & row0), north = m >> 8 | above << 56;
  const uint64_t inner = west & east & south & north & slice_at(v, bx, by, z - 1) & slice_at(v, bx, by, z + 1);
  return (uint64_t)__builtin_popcountll(m & ~inner);
}

uint64_t voxels_surface_count(const Voxels *v)
{
  uint64_t count = 0;
  for (int32_t z = v->lo[2]; z < v->hi[2]; z++)
    for (int32_t by = v->lo[1] >> 3; by <= (v->hi[1] - 1) >> 3; by++)
      for (int32_t bx = v->lo[0] >> 3; bx <= (v->hi[0] - 1) >> 3; bx++) count += count_slice(v, bx, by, z);
  return count;
}

// --- edits --------------------------------------------------------------------------------------------------------
typedef enum BrickState { BRICK_KEPT, BRICK_FILLED, BRICK_OPEN } BrickState;

typedef struct OpenNode {
  size_t node_i;
  uint8_t state[BRICKS];   // BrickState
  uint16_t fill[BRICKS];   // of BRICK_FILLED
  uint16_t *cells[BRICKS]; // owned, of BRICK_OPEN
} OpenNode;

// What a node is packed from; its bricks in their order.
typedef struct Packing {
  uint64_t masks[BRICKS][8];
  uint32_t at[BRICKS];
  uint16_t full_ids[BRICKS];
  uint8_t data[BRICKS * (sizeof(VoxelRecord) + 2 * CELLS + 4)];
  uint32_t seen[VOXELS_MOST_ENTRIES + 1]; // entry -> brick stamp << 16 | place in the brick's list
  uint32_t stamp;
} Packing;

// The entries of one look in a full palette, sorted into a lattice of the roots of their colours.
typedef struct NearColors {
  uint32_t look;
  bool is_made;
  int32_t first[NEAR_SIDE * NEAR_SIDE * NEAR_SIDE]; // entry; 0: none
  int32_t next[VOXELS_MOST_ENTRIES + 1];
} NearColors;

struct VoxelEdit {
  Voxels *grid;           // nobody else has it yet
  bool has_own_palette;
  OpenNode **open;        // by node
  ARRAY(OpenNode *) list; // the same, in the order they were opened
  size_t open_count;      // bricks
  Table colors;           // hash of colour and look -> entry
  bool has_colors;
  NearColors *near;       // NULL: not needed yet
  Packing *packing;
  size_t last_node;       // the node asked for last is asked for again, mostly
};

const Voxels *voxel_edit_grid(const VoxelEdit *e) { return e->grid; }

static void node_close(VoxelEdit *e, OpenNode *o)
{
  for (int b = 0; b < BRICKS; b++) mem_free(o->cells[b]);
  e->open[o->node_i] = NULL;
  mem_free(o);
}

void voxel_edit_destroy(VoxelEdit *e)
{
  if (!e) return;
  for (size_t i = 0; i < e->list.count; i++) node_close(e, e->list.items[i]);
  array_finish(&e->list);
  table_finish(&e->colors);
  voxels_release(e->grid);
  mem_free(e->open);
  mem_free(e->packing);
  mem_free(e->near);
  mem_free(e);
}

static VoxelEdit *edit_begin(const int32_t size[3], VoxelPalette *palette, Err *err)
{
  VoxelEdit *e = mem_zero(1, sizeof *e);
  if (!e || !(e->grid = mem_zero(1, sizeof *e->grid))) goto failed;
  Voxels *v = e->grid;
  atomic_init(&v->users, 1);
  for (int k = 0; k < 3; k++) {
    v->size[k] = size[k];
    v->nodes_size[k] = (size[k] + 63) / 64;
  }
  v->palette = palette ? palette_share(palette) : palette_create();
  v->nodes = mem_zero(node_count(v), sizeof *v->nodes);
  e->has_own_palette = !palette;
  e->open = mem_zero(node_count(v), sizeof *e->open);
  e->packing = mem_zero(1, sizeof *e->packing);
  if (v->palette && v->nodes && e->open && e->packing) return e;
failed:
  voxel_edit_destroy(e);
  err_memory(err, "voxels", sizeof(Packing));
  return NULL;
}

VoxelEdit *voxel_edit_create(const int32_t size[3], Err *err)
{
  for (int k = 0; k < 3; k++)
    if (size[k] < 1 || size[k] > VOXELS_MOST_SIDE) {
      err_set(err, ERR_BAD_SCENE, "a grid of %d x %d x %d voxels cannot be made; each side is 1 to %d", size[0], size[1],
              size[2], VOXELS_MOST_SIDE);
      return NULL;
    }
  return edit_begin(size, NULL, err);
}

VoxelEdit *voxel_edit_from(const Voxels *from, Err *err)
{
  VoxelEdit *e = edit_begin(from->size, from->palette, err);
  for (size_t i = 0; e && i < node_count(from); i++) e->grid->nodes[i] = node_share(from->nodes[i]);
  return e;
}

static void brick_decode(const VoxelNode *n, uint32_t brick, uint16_t cells[CELLS])
{
  memset(cells, 0, CELLS * sizeof *cells);
  if (!n) return;
  const uint32_t word = brick >> 6, bit = brick & 63;
  const bool is_full = n->full[word] >> bit & 1, is_some = n->some[word] >> bit & 1;
  const uint16_t id = is_full ? n->full_ids[voxel_bits_before(n->full, n->full_before, word, bit)] : 0;
  const uint32_t rank = is_some ? voxel_bits_before(n->some, n->some_before, word, bit) : 0;
  for (uint32_t c = 0; c < CELLS; c++) {
    if (is_full) cells[c] = id;
    else if (is_some && n->masks[rank][c >> 6] >> (c & 63) & 1) cells[c] = (uint16_t)voxel_brick_entry(n, rank, c);
  }
}

static bool pack_all(VoxelEdit *e);

static OpenNode *open_node(VoxelEdit *e, size_t node_i)
{
  OpenNode *o = e->open[node_i];
  if (o) return o;
  if (e->list.count >= MOST_OPEN / 16 && !pack_all(e)) return NULL;
  o = mem_zero(1, sizeof *o);
  if (!o || !array_push(&e->list, o)) {
    mem_free(o);
    return NULL;
  }
  o->node_i = node_i;
  return e->open[node_i] = o;
}

static uint16_t *open_brick(VoxelEdit *e, OpenNode *o, uint32_t brick)
{
  if (o->cells[brick]) return o->cells[brick];
  uint16_t *cells = mem_alloc(CELLS, sizeof *cells);
  if (!cells) return NULL;
  if (o->state[brick] == BRICK_FILLED)
    for (int c = 0; c < CELLS; c++) cells[c] = o->fill[brick];
  else
    brick_decode(e->grid->nodes[o->node_i], brick, cells);
  o->state[brick] = BRICK_OPEN;
  e->open_count++;
  return o->cells[brick] = cells;
}

static size_t node_index(const Voxels *v, int32_t x, int32_t y, int32_t z)
{
  return (size_t)(x >> 6) + (size_t)v->nodes_size[0] * ((size_t)(y >> 6) + (size_t)v->nodes_size[1] * (size_t)(z >> 6));
}

static bool is_inside(const Voxels *v, int32_t x, int32_t y, int32_t z)
{
  return (uint32_t)x < (uint32_t)v->size[0] && (uint32_t)y < (uint32_t)v->size[1] && (uint32_t)z < (uint32_t)v->size[2];
}

static uint32_t brick_index(int32_t x, int32_t y, int32_t z)
{
  return (uint32_t)((x >> 3 & 7) | (y >> 3 & 7) << 3 | (z >> 3 & 7) << 6);
}

static uint32_t cell_index(int32_t x, int32_t y, int32_t z) { return (uint32_t)((x & 7) | (y & 7) << 3 | (z & 7) << 6); }

uint32_t voxel_edit_get(const VoxelEdit *e, int32_t x, int32_t y, int32_t z)
{
  if (!is_inside(e->grid, x, y, z)) return 0;
  const OpenNode *o = e->open[node_index(e->grid, x, y, z)];
  const uint32_t brick = brick_index(x, y, z);
  if (!o || o->state[brick] == BRICK_KEPT) return voxels_entry(e->grid, x, y, z);
  return o->state[brick] == BRICK_FILLED ? o->fill[brick] : o->cells[brick][cell_index(x, y, z)];
}

bool voxel_edit_is_open(const VoxelEdit *e, int32_t x, int32_t y, int32_t z)
{
  return e->open[node_index(e->grid, x, y, z)];
}

bool voxel_edit_put(VoxelEdit *e, int32_t x, int32_t y, int32_t z, uint32_t entry)
{
  if (!is_inside(e->grid, x, y, z)) return true;
  if (e->open_count >= MOST_OPEN && !pack_all(e)) return false;
  OpenNode *o = open_node(e, node_index(e->grid, x, y, z));
  uint16_t *cells = o ? open_brick(e, o, brick_index(x, y, z)) : NULL;
  if (!cells) return false;
  cells[cell_index(x, y, z)] = (uint16_t)entry;
  return true;
}

static bool fill_brick(VoxelEdit *e, int32_t x, int32_t y, int32_t z, uint32_t entry)
{
  OpenNode *o = open_node(e, node_index(e->grid, x, y, z));
  if (!o) return false;
  const uint32_t brick = brick_index(x, y, z);
  if (o->cells[brick]) {
    mem_free(o->cells[brick]);
    o->cells[brick] = NULL;
    e->open_count--;
  }
  o->state[brick] = BRICK_FILLED;
  o->fill[brick] = (uint16_t)entry;
  return true;
}

static int32_t most(int32_t a, int32_t b) { return a > b ? a : b; }
static int32_t least(int32_t a, int32_t b) { return a < b ? a : b; }

bool voxel_edit_fill(VoxelEdit *e, const int32_t lo[3], const int32_t hi[3], uint32_t entry)
{
  int32_t a[3], b[3];
  for (int k = 0; k < 3; k++) {
    a[k] = most(lo[k], 0);
    b[k] = least(hi[k], e->grid->size[k]);
    if (a[k] >= b[k]) return true;
  }
  for (int32_t z = a[2] & ~7; z < b[2]; z += 8)
    for (int32_t y = a[1] & ~7; y < b[1]; y += 8)
      for (int32_t x = a[0] & ~7; x < b[0]; x += 8) {
        const int32_t from[3] = {most(x, a[0]), most(y, a[1]), most(z, a[2])};
        const int32_t to[3] = {least(x + 8, b[0]), least(y + 8, b[1]), least(z + 8, b[2])};
        if ((to[0] - from[0]) * (to[1] - from[1]) * (to[2] - from[2]) == CELLS) {
          if (!fill_brick(e, x, y, z, entry)) return false;
          continue;
        }
        for (int32_t w = from[2]; w < to[2]; w++)
          for (int32_t v = from[1]; v < to[1]; v++)
            for (int32_t u = from[0]; u < to[0]; u++)
              if (!voxel_edit_put(e, u, v, w, entry)) return false;
      }
  return true;
}

// --- packing ------------------------------------------------------------------------------------------------------
// To tell `count` things apart.
static uint32_t bits_for(uint32_t count)
{
  uint32_t bits = 0;
  while (1u << bits < count) bits++;
  return bits;
}

// Even, with three bytes behind the last bits so that four can be read there.
static uint32_t record_size(const VoxelRecord *r, uint32_t filled)
{
  const uint32_t bits = r->bits ? r->count * r->id_bits + filled * r->bits : filled * r->id_bits;
  return ((uint32_t)sizeof *r + (bits + 7) / 8 + 3 + 1) & ~1u;
}

static void put_bits(uint8_t *d, uint32_t at, uint32_t x)
{
  uint32_t four;
  memcpy(&four, d + (at >> 3), 4);
  four |= x << (at & 7);
  memcpy(d + (at >> 3), &four, 4);
}

static uint32_t mask_count(const uint64_t mask[8])
{
  uint32_t n = 0;
  for (int z = 0; z < 8; z++) n += (uint32_t)__builtin_popcountll(mask[z]);
  return n;
}

// A brick's entries in the order in which they are met; p->seen has their places in it.
typedef struct EntryList {
  uint16_t entries[CELLS], least, most;
  uint32_t count, filled;
} EntryList;

static void list_entries(Packing *p, const uint16_t cells[CELLS], EntryList *l)
{
  l->count = l->filled = 0;
  l->least = UINT16_MAX;
  l->most = 0;
  p->stamp = (p->stamp + 1) & 0x7fff;
  if (!p->stamp) {
    memset(p->seen, 0, sizeof p->seen);
    p->stamp = 1;
  }
  for (int c = 0; c < CELLS; c++) {
    const uint16_t entry = cells[c];
    if (!entry) continue;
    l->filled++;
    if (p->seen[entry] >> 16 == p->stamp) continue;
    p->seen[entry] = p->stamp << 16 | l->count;
    l->entries[l->count++] = entry;
    if (entry < l->least) l->least = entry;
    if (entry > l->most) l->most = entry;
  }
}

// With a list, or without if that is smaller.
static VoxelRecord record_for(const EntryList *l)
{
  const uint32_t id_bits = bits_for(l->most - l->least + 1u);
  const VoxelRecord listed = {(uint8_t)bits_for(l->count), (uint8_t)id_bits, (uint16_t)l->count, l->least};
  const VoxelRecord plain = {0, (uint8_t)id_bits, 0, l->least};
  return record_size(&listed, l->filled) < record_size(&plain, l->filled) ? listed : plain;
}

// Appends the entries of filled cells to the data. Returns what stands in VoxelNode.at; *is_one: all are of one entry.
static uint32_t pack_cells(Packing *p, const uint16_t cells[CELLS], uint32_t *used, bool *is_one)
{
  EntryList l;
  list_entries(p, cells, &l);
  *is_one = l.count == 1;
  if (*is_one) return VOXEL_UNIFORM | l.entries[0];
  const VoxelRecord r = record_for(&l);
  const uint32_t at = *used / 2, size = record_size(&r, l.filled);
  uint8_t *d = p->data + *used;
  memset(d, 0, size);
  memcpy(d, &r, sizeof r);
  d += sizeof r;
  for (uint32_t i = 0; i < r.count; i++) put_bits(d, i * r.id_bits, l.entries[i] - (uint32_t)r.base);
  for (uint32_t c = 0, i = 0; c < CELLS; c++) {
    if (!cells[c]) continue;
    if (r.bits) put_bits(d, r.count * r.id_bits + i * r.bits, p->seen[cells[c]] & 0xffff);
    else put_bits(d, i * r.id_bits, cells[c] - (uint32_t)r.base);
    i++;
  }
  *used += size;
  return at;
}

typedef struct PackedNode {
  uint64_t some[8], full[8];
  uint32_t brick_count, full_count, data_size;
} PackedNode;

static void put_full(Packing *p, PackedNode *n, uint32_t brick, uint16_t id)
{
  if (!id) return;
  n->full[brick >> 6] |= 1ull << (brick & 63);
  p->full_ids[n->full_count++] = id;
}

static void pack_open(Packing *p, PackedNode *n, uint32_t brick, const uint16_t cells[CELLS])
{
  uint64_t *mask = p->masks[n->brick_count];
  bool is_one;
  memset(mask, 0, sizeof p->masks[0]);
  for (int c = 0; c < CELLS; c++) mask[c >> 6] |= (uint64_t)(cells[c] != 0) << (c & 63);
  const uint32_t filled = mask_count(mask);
  if (!filled) return;
  const uint32_t at = pack_cells(p, cells, &n->data_size, &is_one);
  if (is_one && filled == CELLS) {
    put_full(p, n, brick, (uint16_t)at);
    return;
  }
  p->at[n->brick_count++] = at;
  n->some[brick >> 6] |= 1ull << (brick & 63);
}

static void pack_kept(Packing *p, PackedNode *n, uint32_t brick, const VoxelNode *old)
{
  const uint32_t word = brick >> 6, bit = brick & 63;
  if (!old) return;
  if (old->full[word] >> bit & 1)
    put_full(p, n, brick, old->full_ids[voxel_bits_before(old->full, old->full_before, word, bit)]);
  if (!(old->some[word] >> bit & 1)) return;
  const uint32_t rank = voxel_bits_before(old->some, old->some_before, word, bit);
  memcpy(p->masks[n->brick_count], old->masks[rank], sizeof p->masks[0]);
  p->at[n->brick_count] = old->at[rank];
  if (!(old->at[rank] & VOXEL_UNIFORM)) {
    const uint8_t *d = old->data + 2 * (size_t)old->at[rank];
    VoxelRecord r;
    memcpy(&r, d, sizeof r);
    const uint32_t size = record_size(&r, mask_count(old->masks[rank]));
    memcpy(p->data + n->data_size, d, size);
    p->at[n->brick_count] = n->data_size / 2;
    n->data_size += size;
  }
  n->brick_count++;
  n->some[word] |= 1ull << bit;
}

static void node_see(VoxelNode *n, uint32_t brick, const uint64_t mask[8])
{
  const uint32_t base[3] = {8 * (brick & 7), 8 * (brick >> 3 & 7), 8 * (brick >> 6)};
  uint64_t all = 0;
  for (uint32_t z = 0; z < 8; z++) {
    if (!mask[z]) continue;
    all |= mask[z];
    if (base[2] + z < n->lo[2]) n->lo[2] = (uint8_t)(base[2] + z);
    if (base[2] + z > n->hi[2]) n->hi[2] = (uint8_t)(base[2] + z);
    n->cell_count += (uint32_t)__builtin_popcountll(mask[z]);
  }
  for (uint32_t c = 0; c < 64; c++) {
    if (!(all >> c & 1)) continue;
    const uint32_t x = base[0] + (c & 7), y = base[1] + (c >> 3);
    if (x < n->lo[0]) n->lo[0] = (uint8_t)x;
    if (x > n->hi[0]) n->hi[0] = (uint8_t)x;
    if (y < n->lo[1]) n->lo[1] = (uint8_t)y;
    if (y > n->hi[1]) n->hi[1] = (uint8_t)y;
  }
}

static void node_measure(VoxelNode *n)
{
  static const uint64_t whole[8] = {~0ull, ~0ull, ~0ull, ~0ull, ~0ull, ~0ull, ~0ull, ~0ull};
  memset(n->lo, 63, sizeof n->lo);
  for (uint32_t b = 0, rank = 0; b < BRICKS; b++) {
    if (n->some[b >> 6] >> (b & 63) & 1) node_see(n, b, n->masks[rank++]);
    if (n->full[b >> 6] >> (b & 63) & 1) node_see(n, b, whole);
  }
  for (int w = 1; w < 8; w++) {
    n->some_before[w] = (uint16_t)(n->some_before[w - 1] + __builtin_popcountll(n->some[w - 1]));
    n->full_before[w] = (uint16_t)(n->full_before[w - 1] + __builtin_popcountll(n->full[w - 1]));
  }
}

static VoxelNode *node_create(const Packing *p, const PackedNode *from)
{
  const size_t masks = from->brick_count * sizeof p->masks[0], at = from->brick_count * sizeof *p->at,
               ids = from->full_count * sizeof *p->full_ids;
  const size_t head = (sizeof(VoxelNode) + 63) & ~(size_t)63, size = head + masks + at + ids + from->data_size;
  VoxelNode *n = mem_alloc(size, 1);
  if (!n) return NULL;
  memset(n, 0, head);
  char *to = (char *)n + head;
  atomic_init(&n->users, 1);
  n->size = (uint32_t)size;
  n->brick_count = from->brick_count;
  n->full_count = from->full_count;
  memcpy(n->some, from->some, sizeof n->some);
  memcpy(n->full, from->full, sizeof n->full);
  for (int w = 0; w < 8; w++) n->any[w] = n->some[w] | n->full[w];
  n->masks = (const uint64_t(*)[8])(void *)memcpy(to, p->masks, masks);
  n->at = memcpy(to + masks, p->at, at);
  n->full_ids = memcpy(to + masks + at, p->full_ids, ids);
  n->data = memcpy(to + masks + at + ids, p->data, from->data_size);
  node_measure(n);
  return n;
}

static bool pack_node(VoxelEdit *e, const OpenNode *o)
{
  VoxelNode **place = &e->grid->nodes[o->node_i];
  PackedNode packed = {0};
  for (uint32_t b = 0; b < BRICKS; b++) switch ((BrickState)o->state[b]) {
    case BRICK_KEPT: pack_kept(e->packing, &packed, b, *place); break;
    case BRICK_FILLED: put_full(e->packing, &packed, b, o->fill[b]); break;
    case BRICK_OPEN: pack_open(e->packing, &packed, b, o->cells[b]); break;
    }
  VoxelNode *n = NULL;
  if ((packed.brick_count || packed.full_count) && !(n = node_create(e->packing, &packed))) return false;
  node_release(*place);
  *place = n;
  return true;
}

static bool pack_all(VoxelEdit *e)
{
  bool ok = true;
  for (size_t i = 0; i < e->list.count; i++) {
    ok = ok && pack_node(e, e->list.items[i]);
    node_close(e, e->list.items[i]);
  }
  e->list.count = 0;
  e->open_count = 0;
  return ok;
}

static void voxels_measure(Voxels *v)
{
  v->cell_count = 0;
  for (int k = 0; k < 3; k++) {
    v->lo[k] = v->size[k];
    v->hi[k] = 0;
  }
  for (size_t i = 0; i < node_count(v); i++) {
    const VoxelNode *n = v->nodes[i];
    const size_t row = i / (size_t)v->nodes_size[0];
    const int32_t at[3] = {(int32_t)(i % (size_t)v->nodes_size[0]), (int32_t)(row % (size_t)v->nodes_size[1]),
                           (int32_t)(row / (size_t)v->nodes_size[1])};
    if (!n) continue;
    v->cell_count += n->cell_count;
    for (int k = 0; k < 3; k++) {
      v->lo[k] = least(v->lo[k], 64 * at[k] + n->lo[k]);
      v->hi[k] = most(v->hi[k], 64 * at[k] + n->hi[k] + 1);
    }
  }
}

Voxels *voxel_edit_end(VoxelEdit *e, Err *err)
{
  Voxels *v = NULL;
  if (pack_all(e)) {
    v = e->grid;
    e->grid = NULL;
    voxels_measure(v);
  } else {
    err_memory(err, "voxels", 0);
  }
  voxel_edit_destroy(e);
  return v;
}

// --- the palette of an edit ---------------------------------------------------------------------------------------
static bool own_palette(VoxelEdit *e)
{
  if (e->has_own_palette) return true;
  VoxelPalette *p = palette_copy(e->grid->palette);
  if (!p) return false;
  palette_release(e->grid->palette);
  e->grid->palette = p;
  return e->has_own_palette = true;
}

static uint64_t color_key(const float color[3], uint32_t look) { return hash_bytes(look, color, 3 * sizeof *color); }

static bool find_colors(VoxelEdit *e)
{
  const VoxelPalette *p = e->grid->palette;
  bool ok = true;
  for (uint32_t i = 1; ok && !e->has_colors && i < p->entry_count; i++)
    ok = table_add(&e->colors, color_key(p->entries[i].color, p->entries[i].look), (int32_t)i);
  return e->has_colors = ok;
}

static int32_t add_entry(VoxelEdit *e, const VoxelEntry *entry)
{
  if (!own_palette(e) || !find_colors(e)) return -1;
  VoxelPalette *p = e->grid->palette;
  if (p->entry_count > VOXELS_MOST_ENTRIES) return -1;
  if (p->entry_count == p->entry_room) {
    VoxelEntry *more = mem_resize(p->entries, p->entry_count, 2 * (size_t)p->entry_count, sizeof *more);
    if (!more) return -1;
    p->entries = more;
    p->entry_room *= 2;
  }
  if (!table_add(&e->colors, color_key(entry->color, entry->look), (int32_t)p->entry_count)) return -1;
  p->entries[p->entry_count] = *entry;
  return (int32_t)p->entry_count++;
}

static void near_cell(const float color[3], int32_t c[3])
{
  for (int k = 0; k < 3; k++) {
    const float at = sqrtf(color[k]) * NEAR_SIDE;
    c[k] = at > 0 ? at < NEAR_SIDE - 1 ? (int32_t)at : NEAR_SIDE - 1 : 0;
  }
}

static int32_t near_index(int32_t x, int32_t y, int32_t z) { return x + NEAR_SIDE * (y + NEAR_SIDE * z); }

static bool near_make(VoxelEdit *e, uint32_t look)
{
  const VoxelPalette *p = e->grid->palette;
  if (!e->near && !(e->near = mem_zero(1, sizeof *e->near))) return false;
  if (e->near->is_made && e->near->look == look) return true;
  e->near->is_made = true;
  e->near->look = look;
  memset(e->near->first, 0, sizeof e->near->first);
  for (uint32_t i = p->entry_count; i-- > 1;) {
    int32_t c[3];
    if (p->entries[i].look != look) continue;
    near_cell(p->entries[i].color, c);
    int32_t *first = &e->near->first[near_index(c[0], c[1], c[2])];
    e->near->next[i] = *first;
    *first = (int32_t)i;
  }
  return true;
}

typedef struct Nearest {
  int32_t entry;
  float off;
} Nearest;

static void near_see(const VoxelEdit *e, int32_t lattice_i, const float color[3], Nearest *best)
{
  for (int32_t i = e->near->first[lattice_i]; i; i = e->near->next[i]) {
    float d = 0;
    for (int k = 0; k < 3; k++) d += fabsf(sqrtf(e->grid->palette->entries[i].color[k]) - sqrtf(color[k]));
    if (d < best->off || (d == best->off && i < best->entry)) *best = (Nearest){i, d};
  }
}

// All cells of the lattice that are `ring` away from c along at least one axis, and no farther along the others.
static void near_ring(const VoxelEdit *e, const int32_t c[3], int32_t ring, const float color[3], Nearest *best)
{
  int32_t lo[3], hi[3];
  for (int k = 0; k < 3; k++) {
    lo[k] = c[k] - ring > 0 ? c[k] - ring : 0;
    hi[k] = c[k] + ring < NEAR_SIDE - 1 ? c[k] + ring : NEAR_SIDE - 1;
  }
  for (int32_t z = lo[2]; z <= hi[2]; z++)
    for (int32_t y = lo[1]; y <= hi[1]; y++) {
      const bool is_side = z == c[2] - ring || z == c[2] + ring || y == c[1] - ring || y == c[1] + ring;
      for (int32_t x = lo[0]; x <= hi[0]; x++)
        if (is_side || x == c[0] - ring || x == c[0] + ring) near_see(e, near_index(x, y, z), color, best);
    }
}

// The first of the nearest; what lies beyond a ring is at least as far off as the ring is wide.
static int32_t nearest_color(VoxelEdit *e, const float color[3], uint32_t look)
{
  Nearest best = {-1, INFINITY};
  int32_t c[3];
  if (!near_make(e, look)) return -1;
  near_cell(color, c);
  for (int32_t ring = 0; ring < NEAR_SIDE && !(best.off < (float)(ring - 1) / NEAR_SIDE); ring++) near_ring(e, c, ring, color, &best);
  return best.entry;
}

int32_t voxel_edit_color(VoxelEdit *e, const float color[3], uint32_t look)
{
  if (!find_colors(e)) return -1;
  const VoxelPalette *p = e->grid->palette;
  size_t step = 0;
  for (const int32_t *i; (i = table_next(&e->colors, color_key(color, look), &step));)
    if (p->entries[*i].look == look && !memcmp(p->entries[*i].color, color, 3 * sizeof *color)) return *i;
  if (p->entry_count > VOXELS_MOST_ENTRIES) return nearest_color(e, color, look);
  return add_entry(e, &(VoxelEntry){{color[0], color[1], color[2]}, (uint8_t)look, NULL});
}

int32_t voxel_edit_find(const VoxelEdit *e, const char *name)
{
  const VoxelPalette *p = e->grid->palette;
  for (uint32_t i = 1; i < p->entry_count; i++)
    if (p->entries[i].name && !strcmp(p->entries[i].name, name)) return (int32_t)i;
  return -1;
}

int32_t voxel_edit_name(VoxelEdit *e, const char *name, const float color[3], uint32_t look)
{
  const int32_t known = voxel_edit_find(e, name);
  if (known >= 0 && own_palette(e)) {
    VoxelEntry *entry = &e->grid->palette->entries[known];
    memcpy(entry->color, color, sizeof entry->color);
    entry->look = (uint8_t)look;
    table_clear(&e->colors);
    e->has_colors = false;
    if (e->near) e->near->is_made = false;
    return known;
  }
  VoxelEntry entry = {{color[0], color[1], color[2]}, (uint8_t)look, copy_text(name)};
  const int32_t i = entry.name ? add_entry(e, &entry) : -1;
  if (i < 0) mem_free(entry.name);
  return i;
}

static bool same_text(const char *a, const char *b) { return a && b ? !strcmp(a, b) : a == b; }

int32_t voxel_edit_look(VoxelEdit *e, const VoxelLook *look)
{
  const VoxelPalette *p = e->grid->palette;
  for (uint32_t i = 0; i < p->look_count; i++) {
    const VoxelLook *l = &p->looks[i];
    if (same_text(l->material, look->material) && l->roughness == look->roughness && l->metallic == look->metallic &&
        l->emission == look->emission && l->transmission == look->transmission && l->ior == look->ior)
      return (int32_t)i;
  }
  if (p->look_count > VOXELS_MOST_LOOKS || !own_palette(e)) return -1;
  VoxelPalette *own = e->grid->palette;
  VoxelLook *more = mem_resize(own->looks, own->look_count, own->look_count + 1, sizeof *more);
  if (!more) return -1;
  own->looks = more;
  more[own->look_count] = *look;
  more[own->look_count].material = copy_text(look->material);
  if (look->material && !more[own->look_count].material) return -1;
  return (int32_t)own->look_count++;
}
