// World: a scene made ready to render. Immutable: any number of threads may read it, nothing locks. Preparing the
// next world after an edit shares every part that did not change (a mesh's tree, a decoded picture) by counting its
// users; the old world stays whole until its last user lets go.

#ifndef RAYFOLD_WORLD_WORLD_H
#define RAYFOLD_WORLD_WORLD_H

#include "accel/accel.h"
#include "accel/lanes.h"
#include "base/arena.h"
#include "base/hash.h"
#include "base/jobs.h"
#include "base/notes.h"
#include "geom/surface.h"
#include "scene/scene.h"
#include "shade/light.h"
#include "shade/material.h"
#include "shade/texture.h"
#include "shade/volume.h"
#include "space/transport.h"

// Which emitter a face of a shining voxel is part of: open addressing by voxel_light_key().
typedef struct VoxelLights {
  const uint64_t *keys;    // 0: a free place
  const int32_t *emitters;
  uint32_t mask;           // capacity - 1, a power of two less one
} VoxelLights;

static inline uint64_t voxel_light_key(uint32_t face, int32_t x, int32_t y, int32_t z)
{
  return 1 + (face | (uint64_t)x << 3 | (uint64_t)y << 16 | (uint64_t)z << 29);
}

// The shading side of an instance; same index as its accel Instance.
typedef struct WorldInstance {
  TriangleMesh mesh;           // arrays of the shared MeshData; all NULL for shapes
  const uint16_t *slots;       // one a triangle; NULL: slot 0
  const uint32_t *materials;   // slot -> index into World.materials
  uint32_t slot_count;         // at least 1
  uint8_t prim_shift;          // a hit's primitive >> this is what slots are by: 3 of voxels, whose primitives are faces, too
  const int32_t *emitters;     // one a triangle (or one, for a shape): index of its emitter, -1; NULL: none shine
  const VoxelLights *voxel_lights; // of voxels: where those that shine have their emitters; NULL: none shine
  bool is_background;          // by its role
  uint32_t object_i;           // which object of the main scene it came from, for picking and ids
  uint32_t medium;             // what fills it: 1 + index into World.media; 0: nothing
  uint32_t gate;               // it is the surface of a gate: 1 + index into World.space.gates; 0: it is none
  uint32_t clip;               // it is cut off by a plane: 1 + index into World.clips; 0: it is whole
} WorldInstance;

// A medium in its place; same index as the Instance of its boundary in World.media_accel. The atmosphere comes last and
// has no boundary.
typedef struct WorldMedium {
  TriangleMesh mesh; // of the boundary; all NULL for shapes
  uint32_t volume;   // index into World.volumes
  Frame medium_from_world; // into the space its density is given in
  uint32_t object_i;
  bool is_box;       // the boundary is the unit box about its origin, and nothing but a boundary
} WorldMedium;

// A plane that cuts off an instance where it goes through a gate: there is only what has n . p > c.
typedef struct WorldClip {
  Vec3 n;
  float c;
} WorldClip;

// Lamps of some cell as they are seen from another, through the gates that a word of Way names.
typedef struct LightImage {
  uint64_t word;
  uint32_t cell;           // where the lamps are
  Frame to_there;          // from the chart of the cell that looks into theirs
  uint32_t first_sun;      // in the set, as many as their cell has of its own; NO_IMAGE: none
  const int32_t *emitters; // by their number in their cell: index in the set, -1: not aimed at; NULL: none
} LightImage;
#define NO_IMAGE UINT32_MAX

// A space of its own: what is in it, and what lights it. Instances and media are numbered through all cells.
typedef struct WorldCell {
  Accel *accel;           // over the instances in it
  Accel *media_accel;     // over the boundaries in it; NULL: there are none
  const LightSet *lights; // its own lamps first, then images
  size_t own_emitters, own_suns;
  uint32_t first_emitter; // of its own, as instances number emitters
  const LightImage *images;
  uint32_t image_count;
  uint32_t atmosphere;    // 1 + index into World.media; 0: none
  float curvature;        // per square metre; its chart is that of space/chart.h
  Vec3 gravity;
} WorldCell;

typedef struct World World;
struct World {
  atomic_int users;
  Arena arena;                 // owns the arrays below
  Accel *accel;                // of the first cell, and whose instances all others share
  const LaneSet *lanes;        // the same for packets of rays, in worlds of few simple shapes and one cell; else NULL
  const WorldInstance *instances;
  size_t instance_count;
  const SurfaceMaterial *materials; // the last one is the default material
  const char *const *material_names; // as many; NULL for the default material and those of lights
  size_t material_count;
  const TextureMap *textures;
  size_t texture_count;
  const Volume *volumes;
  BlackBody *black_body;       // in the arena; NULL: no medium is hot
  const WorldMedium *media;    // boundaries of media, whether or not a surface is there, too
  size_t media_count;          // 0: no medium anywhere
  const WorldCell *cells;      // the unnamed one first, then as the scene has them
  size_t cell_count;
  Space space;                 // its gates
  const WorldClip *clips;
  int32_t crossings;           // most gates a ray goes through
  float fade;                  // see space_fade()
  Vec3 fade_color;
  size_t light_groups;         // the most that any cell has
  Accel *media_accel;          // likewise, over boundaries of media; NULL: there are none
  bool media_are_boxes;        // few, boxes all, in the one cell there is: faster found one by one than by the tree
  LightSet lights;             // of the first cell
  WhittedSettings whitted;     // as the scene has them
  Vec3 whitted_ambient;
  bool has_background, has_panes; // objects of that role; materials that let light through
  bool has_filters;            // instances some hits on which do not count
  float lo[3], hi[3];          // bounds; lo > hi when there is nothing
  size_t triangle_count, unique_triangle_count, geometry_bytes, texture_bytes;
  size_t tree_bytes;           // of geometry_bytes: without the meshes' own arrays
  Notes notes;                 // what preparing had to leave out
  struct WorldParts *parts;    // private: what is shared with other worlds
};

// The material of a hit.
static inline uint32_t world_material(const World *w, const Hit *hit)
{
  const WorldInstance *i = &w->instances[hit->instance];
  uint32_t slot = i->slots ? i->slots[hit->prim >> i->prim_shift] : 0;
  if (slot >= i->slot_count) slot = 0;
  return i->materials[slot];
}

static inline int32_t voxel_light_find(const VoxelLights *l, uint64_t key)
{
  for (uint32_t i = (uint32_t)hash_u64(key) & l->mask; l->keys[i]; i = (i + 1) & l->mask)
    if (l->keys[i] == key) return l->emitters[i];
  return -1;
}

// The emitter of a place that shines; -1: none, nobody aims at it.
static inline int32_t world_emitter(const World *w, const SurfacePoint *s)
{
  const WorldInstance *i = &w->instances[s->instance];
  if (i->emitters) return i->emitters[s->prim];
  if (!i->voxel_lights) return -1;
  const Vec3 p = frame_point(&accel_instances(w->accel)[s->instance].object_from_world, s->p);
  const uint32_t face = s->prim & 7;
  int32_t c[3];
  for (int k = 0; k < 3; k++)
    c[k] = (int32_t)((uint32_t)k == face >> 1 ? floorf(p[k] + 0.5f) - (float)(face & 1) : floorf(p[k]));
  return voxel_light_find(i->voxel_lights, voxel_light_key(face, c[0], c[1], c[2]));
}

// Makes the scene ready. previous may be NULL. Reads and decodes the pictures it names (options says from where;
// may be NULL). Large models build in parallel on jobs. NULL on error or cancel.
World *world_prepare(const Scene *s, const World *previous, const LoadOptions *options, Jobs *jobs,
                     const Cancel *cancel, Err *err);
World *world_share(World *w);
void world_release(World *w); // accepts NULL

// Of all meshes, pictures and grids of densities, in their order. Reads them all.
uint64_t world_content_hash(const World *w);

// A camera that shows the whole scene well, for models that bring none: from above and to the right of the front,
// which faces +z as in glTF, at the distance where the scene just fills the picture (frame.c).
Camera world_frame_camera(const World *w, float aspect);

#endif
