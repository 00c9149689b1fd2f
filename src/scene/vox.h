// MagicaVoxel's files, read and written (github.com/ephtracy/voxel-model: MagicaVoxel-file-format-vox.txt and its
// extension). A file holds models of up to 256^3 cells, a palette of 255 colours with materials, and a scene graph that
// places models, turned by quarters and moved by whole cells. There z is up; here y is, so places come out as
// (x, z, -y). Layers, cameras and settings of its renderer are passed over.

#ifndef RAYFOLD_SCENE_VOX_H
#define RAYFOLD_SCENE_VOX_H

#include "base/array.h"
#include "base/span.h"
#include "image/voxels.h"

typedef struct VoxModel {
  int32_t size[3];      // in the file's axes
  const uint8_t *cells; // x y z colour each, in the file's bytes
  uint32_t count;
} VoxModel;

// A model in its place: cell p, less the model's middle, goes to turned p plus place; in the file's axes.
typedef struct VoxPlace {
  uint32_t model;
  int8_t axis[3], sign[3]; // row k of the turn is sign[k] at column axis[k]
  int64_t at[3];
  const char *name; // in the file's bytes, of name_size
  uint32_t name_size;
} VoxPlace;

typedef struct VoxFile {
  ARRAY(VoxModel) models;
  ARRAY(VoxPlace) places;
  uint8_t colors[256][4];   // by colour, 0 is none
  VoxelLook looks[256];     // likewise
} VoxFile; // zero is none; refers to the bytes it was read from

// name is for messages: "castle.vox: byte 1234: ...".
bool vox_read(VoxFile *out, const char *name, Span bytes, Err *err);
void vox_finish(VoxFile *f); // accepts zero

// One model as a grid with y up, its first corner at the origin; or all places together, moved so that all are inside:
// corner, if not NULL, is where the grid's corner was, in our axes.
Voxels *vox_model(const VoxFile *f, uint32_t model, Err *err);
Voxels *vox_merge(const VoxFile *f, const char *name, int32_t corner[3], Err *err);

// Writes a grid as models of 256^3 at most. More than 255 kinds of voxels become their nearest; *reduced: how many there
// were then, else 0.
bool vox_write(const Voxels *v, const char *path, uint32_t *reduced, Err *err);

#endif
