// Saved models, .rfm: a scene with its meshes and their trees as they lie in memory, so that opening one is mapping it.
// docs/rfm.md describes the format for people.
//
//   RfmHead (64 bytes) | RfmSection[section_count] | sections, each at a multiple of 64, zeros between them
//
// The scene is the JSON of a scene file (RFM_SCENE) in the form of edits, "mesh": N, which names the N-th RFM_MESH. All
// numbers are in the byte order of the machine that wrote; another order is refused. A section of a kind that is not
// known is skipped.

#ifndef RAYFOLD_SCENE_RFM_H
#define RAYFOLD_SCENE_RFM_H

#include "scene/json.h"
#include "scene/scene.h"

// Goes up with every change that an older program would misread; a tree's own layout is numbered in its head.
enum { RFM_VERSION = 1, RFM_ALIGN = 64, RFM_BYTE_ORDER = 0x01020304 };
#define RFM_MAGIC "\x89RFM\r\n\x1a\n" // as PNG's: a transfer that takes it for text spoils it at once

typedef struct RfmHead {
  char magic[8];
  uint32_t byte_order, version;
  uint64_t file_size;
  uint32_t section_count;
  uint32_t is_model; // Scene.is_model
  uint64_t key;      // of a cache: the options the model was loaded with; 0: made by `convert`
  uint64_t spare[2];
  uint64_t hash; // of the head up to here, then of the section table
} RfmHead;
_Static_assert(sizeof(RfmHead) == 64, "a cache line, without gaps");

// Written into files: a number once given keeps its meaning.
typedef enum RfmKind {
  RFM_SCENE = 1, // JSON, and a zero byte
  RFM_NOTES,     // of a cache: the lines, each ended by a zero byte
  RFM_SOURCE,    // of a cache: an RfmSource and a file's name
  RFM_PICTURE,   // encoded; owner: its number
  RFM_TEXTURES,  // int32_t a texture: the number of its picture, -1: none in here
  RFM_MESH,      // RfmMesh, its slots as int32_t, its name; owner of this and the following: the mesh
  RFM_POSITIONS, // the arrays of MeshData
  RFM_NORMALS,
  RFM_TEXCOORDS,
  RFM_TEXCOORDS_1,
  RFM_COLORS,
  RFM_TANGENTS,
  RFM_TRIANGLES,
  RFM_MATERIAL_SLOTS,
  RFM_TREE_HEAD, // SavedTree
  RFM_TREE_NODES,
  RFM_TREE_LEAVES,
} RfmKind;

typedef struct RfmSection {
  uint32_t kind, owner;
  uint64_t offset, size;
  uint64_t hash; // rfm_hash() of its bytes
} RfmSection;
_Static_assert(sizeof(RfmSection) == 32, "without gaps");

typedef struct RfmMesh {
  uint64_t vertex_count, triangle_count;
  uint32_t slot_count, name_size; // name_size 0: no name
} RfmMesh;

typedef struct RfmSource {
  uint64_t hash;
  uint32_t is_content, spare;
} RfmSource;

// --- the format -------------------------------------------------------------------------------------
// How an array of MeshData is kept, and what must hold of its values: finite, a vertex or a slot of the mesh.
typedef enum RfmValues { RFM_FLOATS, RFM_VERTICES, RFM_SLOTS } RfmValues;
typedef struct RfmArray {
  const char *noun;
  size_t offset; // of the pointer in MeshData
  size_t width;  // bytes an entry
  RfmValues values;
  bool by_triangle; // an entry a triangle, not a vertex
} RfmArray;
const RfmArray *rfm_array(uint32_t kind); // NULL: none
const char *rfm_noun(uint32_t kind);      // for messages

// Pieces of a megabyte are hashed by themselves, so that threads can share one section; then their hashes are.
enum { RFM_PIECE = 1 << 20 };
uint64_t rfm_hash_piece(const void *data, size_t size);
uint64_t rfm_hash(const void *data, size_t size);
uint64_t rfm_hash_head(const RfmHead *head, const RfmSection *sections);

// --- reading ----------------------------------------------------------------------------------------
typedef struct RfmFile {
  const char *path; // for messages
  SharedFile *file;
  const RfmHead *head;
  const RfmSection *sections;
} RfmFile; // zero is no file

// The head and the section table are right, and all sections lie in the file; their bytes are not looked at yet.
bool rfm_open(RfmFile *f, const char *path, Err *err);
void rfm_close(RfmFile *f); // accepts zero; scenes filled from it keep what they need
// Every hash is right, every number finite, every index in range. At the speed of memory; jobs may be NULL.
bool rfm_check(const RfmFile *f, Jobs *jobs, Err *err);
// Fills an empty scene, after rfm_check(). Meshes and their trees stay where they are in the file.
bool rfm_fill(const RfmFile *f, Scene *s, const LoadOptions *options, Err *err);

static inline Span rfm_span(const RfmFile *f, const RfmSection *s)
{
  return (Span){f->file->bytes.data + s->offset, s->size};
}

// --- writing ----------------------------------------------------------------------------------------
// The scene as it is, file names unchanged, with a tree a mesh (trees[i] of mesh i; may be empty). With is_cache, its
// notes and sources too, under that key. The whole file or none.
bool rfm_write(const Scene *s, const SavedTree *trees, bool is_cache, uint64_t key, const char *path,
               Err *err);

// --- the scene part, by the files that know JSON ----------------------------------------------------
// As scene_write(), with "mesh": N for every mesh and nothing for embedded pictures.
bool scene_write_linked(const Scene *s, Text *out, Err *err);
typedef struct RfmPictures { // those inside, and whose they are; the bytes must live as long as the scene
  const Span *pictures;
  const int32_t *picture_of; // of each texture, -1: none
  size_t picture_count, texture_count;
} RfmPictures;
// Reads that text, which a zero byte must follow, into a scene that has its meshes.
bool scene_read_linked(Scene *s, Span text, const char *path, const RfmPictures *pictures,
                       const LoadOptions *options, Err *err);

#endif
