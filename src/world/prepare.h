// Prepare: the steps from scene to world, shared by the files of this room that do one each.

#ifndef RAYFOLD_WORLD_PREPARE_H
#define RAYFOLD_WORLD_PREPARE_H

#include "scene/gates.h"
#include "world/bend.h"
#include "world/parts.h"
#include "world/world.h"

// A scene that takes part (the main one, or a model's), and where its things lie in the world's arrays.
typedef struct Source {
  const Scene *scene;
  uint32_t model_base; // in the sources: of the scene's first model, the others follow
  uint32_t material_base, volume_base;
  int32_t *color_maps, *data_maps; // texture -> TextureMap index for colours and for other data, -1: not made yet
  int32_t *mesh_parts;             // mesh -> part
  int32_t *first_part, *next_part; // object -> the first of its parts (csg, field); a part -> the next of the same, -1: none
} Source;

typedef struct Prepare {
  const Scene *scene;
  const LoadOptions *options;
  const WorldParts *previous; // may be NULL
  Jobs *jobs;
  const Cancel *cancel;
  Err *err;
  World *world;               // being filled
  WorldParts *parts;
  Arena scratch;
  ARRAY(Source) sources;
  ARRAY(SurfaceMaterial) materials;
  ARRAY(const char *) material_names; // as many; copies in the world's arena, NULL: none
  ARRAY(TextureMap) textures;
  ARRAY(int32_t) texture_parts; // TextureMap -> image part, -1: none
  ARRAY(int32_t) texture_mips;  // TextureMap -> mips part, -1: none
  Bend bend;                    // of the object being added, if its cell is curved
  Frame bend_from_world;        // what is left of its frames
  bool is_bent;
  uint32_t cell;                // of what is added next: 0 the unnamed one, 1 + its index
  ARRAY(Instance) instances;
  ARRAY(uint32_t) instance_cells; // likewise
  ARRAY(WorldInstance) shading;
  ARRAY(int32_t) mesh_parts;    // instance -> mesh part, -1: a shape
  ARRAY(Volume) volumes;
  ARRAY(WorldMedium) media;
  ARRAY(Instance) boundaries;   // of the media, one each
  ARRAY(int32_t) boundary_parts; // likewise: mesh part, -1: a shape
  ARRAY(uint32_t) boundary_cells; // likewise
  ARRAY(WorldClip) clips;
  ARRAY(Emitter) emitters;
  ARRAY(uint32_t) emitter_cells; // as many
  ARRAY(Sun) suns;
  ARRAY(uint32_t) sun_cells;     // as many
  ARRAY(LightProfile) profiles; // in the world's arena
  ARRAY(const char *) profile_paths; // as many, in the scratch arena
  int32_t *sky_parts;           // of the scene's sky, then of its named ones: image part, -1
  uint32_t *atmospheres;        // of each cell: 1 + index into the media, 0: none
  WorldCell *cells;             // the world's, being filled
  bool met_texture;             // by the material being prepared
} Prepare;

bool prepare_failed_memory(Prepare *p); // records "not enough memory" and returns false
// Records what is wrong with the i-th object of a scene, by its place and name, and returns false.
bool prepare_failed_object(Prepare *p, const Scene *s, int32_t i, const char *message);

// Textures: the TextureMap of a scene's texture for colours (sRGB unless told otherwise) or for data; -1 for none.
// Decoding comes later. *ok turns false on error.
int32_t prepare_texture(Prepare *p, Source *source, int32_t texture, bool is_color, bool *ok);
bool prepare_texture_pixels(Prepare *p); // after parts_make: hands the maps their pixels and mips

bool prepare_tangents(Prepare *p);       // of instances that wear normal maps and have none

// Materials of one source, appended in order.
bool prepare_materials(Prepare *p, Source *source);
bool prepare_add_material(Prepare *p, const SurfaceMaterial *m, const char *name); // name may be NULL
SurfaceMaterial surface_default(void);

// Objects of the main scene and all it includes, as instances. Adds sources as it meets them.
bool prepare_objects(Prepare *p);
bool prepare_sources(Prepare *p, const Scene *scene); // the scene and, below it, its models

// Where a csg or a field lies.
typedef struct CsgPlace {
  const Source *source;
  Frame frame;
  int32_t material; // override, index into the world's; -1: none
} CsgPlace;

bool prepare_parts(Prepare *p, Source *source); // finds and checks the parts of all csg and field objects
// The body of the object and its parts as one more instance; its mask and object are given.
bool prepare_csg(Prepare *p, const CsgPlace *place, int32_t object_i, Instance *instance, WorldInstance *shading);
// The object, a field or a primitive that is one, with its parts as one more instance; its place, mask and object are given.
bool prepare_field(Prepare *p, const CsgPlace *place, int32_t object_i, Instance *instance, WorldInstance *shading);
// The shape as a solid, and the map it is to be moved by first; false for shapes that are none.
bool prepare_solid(const Shape *s, Solid *out, Frame *moved);

// The voxels of a shape as one more instance; material: an override, -1: none.
bool prepare_voxels(Prepare *p, const Source *source, const Object *o, int32_t material, Instance *instance, WorldInstance *shading);
bool prepare_voxel_emitters(Prepare *p, size_t index); // of an instance of voxels

// Media of one source, appended in order; places they fill; the tree of those, and the atmosphere.
bool prepare_volumes(Prepare *p, Source *source);
int32_t prepare_voxel_volume(Prepare *p, const char *name, int32_t volume_i, Voxels *v); // the same in voxels' cells; -1: failed
bool prepare_add_medium(Prepare *p, const Instance *boundary, const WorldMedium *medium, int32_t mesh_part);
bool prepare_media(Prepare *p); // after parts_make

// Lights of every source met; area lights become instances, too. Then, once meshes are known, emissive surfaces.
bool prepare_scene_lights(Prepare *p, const Source *source, const Frame *frame, uint32_t object_i);
bool prepare_emitters(Prepare *p);
bool prepare_add_emitter(Prepare *p, const Emitter *e); // in the cell that things are added to
// A sun in a direction (of any length), of this irradiance on a surface that faces it; angle: its diameter in degrees.
bool prepare_add_sun(Prepare *p, const float direction[3], Vec3 irradiance, float angle);
bool prepare_sky(Prepare *p); // before parts_make
bool prepare_light_set(Prepare *p); // after it

// Cells and gates, before and after all objects.
bool prepare_cells(Prepare *p);
bool prepare_gates(Prepare *p);
// A worm- or black hole whose front leads on by `link`: its size, and what it does to light.
bool prepare_ball(Prepare *p, const Gate *g, const GateLink *link, SpaceGate *out);
size_t prepare_form_faces(const Prepare *p); // at most so many walls of cells that are finite spaces,
bool prepare_forms(Prepare *p, SpaceGate *gates, size_t *count); // which are appended
MeshData *prepare_unit_box(Prepare *p); // of the parts; NULL when memory is out

// Appends an instance with one material. False when memory is out.
bool prepare_add_instance(Prepare *p, const Instance *instance, const WorldInstance *shading, int32_t mesh_part);

#endif
