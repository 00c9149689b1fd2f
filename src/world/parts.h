// Parts: what worlds share. A mesh with its tree and a decoded picture cost seconds to make and never change, so the
// next world takes them over from the last. Each is counted; the lists belong to one world.

#ifndef RAYFOLD_WORLD_PARTS_H
#define RAYFOLD_WORLD_PARTS_H

#include "accel/accel.h"
#include "base/array.h"
#include "base/err.h"
#include "base/jobs.h"
#include "base/table.h"
#include "geom/sdf_cells.h"
#include "geom/tangents.h"
#include "image/mips.h"
#include "scene/scene.h"
#include "shade/density.h"

typedef struct MeshPart {
  MeshData *data; // shared
  MeshTree *tree; // shared; NULL until built. A compact one reads the data's arrays, so the two go together
  MeshTree *old;  // shared; of the same triangles in the world before, to be followed by this one's; NULL: none
  Tangents *tangents; // shared; of a mesh that has none and wears a normal map; NULL: none made
  bool has_set_tangents; // by the world being made
} MeshPart;

typedef struct ImagePart {
  atomic_int users;
  uint64_t key;         // of path, size and time of the file, or of the embedded bytes
  char *path;           // owned; NULL for embedded bytes
  const uint8_t *bytes; // embedded, the scene's; only read while decoding
  size_t size;
  Image image;
  float mean;           // mean luminance of its colour as linear light, for choosing lights; -1: not asked for yet
} ImagePart;

typedef struct MipsPart {
  atomic_int users;
  uint64_t key;        // of the picture and the meaning
  int32_t image_i;     // while being made: in the images of the world that makes it
  MipsMeaning meaning;
  Mips mips;
  bool is_made;        // never changes after
} MipsPart;

typedef struct DensityPart {
  atomic_int users;
  uint64_t key;    // of what it is made of
  Density density; // its arrays are owned
} DensityPart;

void density_part_release(DensityPart *part); // accepts NULL

typedef struct SeenBytes { // of an embedded picture, so that thousands of textures of one do not hash it each
  const uint8_t *bytes;
  size_t size;
  int32_t image_i;
} SeenBytes;

typedef struct WorldParts { // what a World's parts member points to
  TreeOptions tree_options; // of all meshes' trees
  ARRAY(MeshPart) meshes;
  ARRAY(ImagePart *) images;
  ARRAY(DensityPart *) densities;
  ARRAY(struct Voxels *) voxels; // shared; each once
  ARRAY(SdfBody *) fields;
  ARRAY(SeenBytes) seen;
  ARRAY(MipsPart *) mips;
  Table meshes_found; // address of the data's origin -> mesh
  Table meshes_alike; // hash of counts and of some triangles -> mesh
  Table images_found; // key -> image
  Table seen_found;   // address of the bytes -> seen
  Table mips_found;   // key -> mips
  MeshData *unit_box; // shared by all worlds of one line
} WorldParts;

void parts_finish(WorldParts *p); // accepts zero

// The index of the part for this data; taken over from `previous` (may be NULL) if that has it. If that has the same
// triangles with their vertices elsewhere, its tree is where this one's starts from. -1: no memory.
int32_t parts_add_mesh(WorldParts *p, const WorldParts *previous, MeshData *data);

// The index of the part for a picture file, or for bytes in memory (path NULL). -1: no memory.
int32_t parts_add_image(WorldParts *p, const WorldParts *previous, const char *path, const uint8_t *bytes,
                        size_t size);

// Builds or refits every tree and decodes every picture that is missing, on all threads. The error is that of the first
// picture or mesh at fault, large meshes last, whichever thread met it.
bool parts_make(WorldParts *p, Jobs *jobs, const Cancel *cancel, Err *err);

// The index of the part for the mips of an image part; taken over from `previous` (may be NULL) if that has it. -1: no
// memory.
int32_t parts_add_mips(WorldParts *p, const WorldParts *previous, int32_t image_i, MipsMeaning meaning);
// Makes those that are missing, on all threads; the pictures must be there.
bool parts_make_mips(WorldParts *p, Jobs *jobs, const Cancel *cancel, Err *err);
void parts_finish_mips(WorldParts *p);

// Mean luminance of a picture, its integer values taken as sRGB or linear.
float image_part_mean(ImagePart *part, bool is_srgb);

#endif
