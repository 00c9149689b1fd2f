// Gltf: one glTF 2.0 file while it is being imported, shared by the gltf_*.c files. It holds the parsed JSON, the
// bytes it refers to, and what has been made of them so far. It lives for one import_gltf() call; the scene keeps
// nothing of it.
//
//   import_gltf.c    entry: the GLB container, version, extensions
//   gltf.c           questions to the JSON with errors that name their place
//   gltf_buffer.c    buffers and buffer views
//   gltf_access.c    accessors: numbers out of views
//   gltf_meshopt.c   compressed views, through the meshoptimizer library
//   gltf_texture.c   images, samplers, texture transforms
//   gltf_material.c  materials
//   gltf_mesh.c      primitives to meshes
//   gltf_node.c      nodes to objects, cameras and lights
//   gltf_light.c     lights
//   gltf_deform.c    joints of vertices and morph targets
//   gltf_rig.c       skins, clips, and what follows which node
//
// Functions return false after an error, which then stands in g->err; lists are looked up by their JSON index.

#ifndef RAYFOLD_SCENE_GLTF_H
#define RAYFOLD_SCENE_GLTF_H

#include "base/file.h"
#include "base/table.h"
#include "scene/json.h"
#include "scene/scene.h"

#include <limits.h>

#define GLTF_NONE SIZE_MAX // no index given

// What an import may make in all: so many times the bytes it has read, and this much more. A small file can ask for
// a lot by naming the same data again and again. 64 is a choice with room: the widest plain growth is a byte of a
// strip's indices becoming a triangle of 12 bytes. It has not been tried on a large collection of models.
#define GLTF_GROWTH     64
#define GLTF_HEAD_START ((size_t)64 << 20)

typedef struct GltfBuffer {
  const uint8_t *data; // NULL until first used
  size_t size;         // its byteLength; that many bytes are there
  FileBytes file;      // where data lies, if in a file of its own
  uint8_t *decoded;    // where data lies, if from a data URI; owned
} GltfBuffer;

typedef struct GltfImage {
  bool is_tried;
  const char *file; // in the scene's arena, like bytes; both NULL: it could not be had
  const uint8_t *bytes;
  size_t size;
} GltfImage;

// One of possibly several scene textures made of a glTF texture, which differ in their uv transforms.
typedef struct GltfTextureUse {
  TextureCommon common;
  int32_t texture_i; // in the scene
  size_t gltf_i;
} GltfTextureUse;

typedef struct GltfMesh {
  bool is_loaded;
  size_t first, count; // its primitives, in scene.meshes
} GltfMesh;

// What may change the shape of one of the scene's meshes; all in the scene's arena.
typedef struct GltfDeform {
  int32_t mesh_i;
  uint32_t influence_count; // a vertex
  uint32_t joint_end;       // above all joints named
  const uint16_t *joints;
  const float *weights;
  const struct RigTarget *targets;
  size_t target_count;
} GltfDeform;

typedef struct Gltf {
  Scene *scene;
  const char *path;
  const LoadOptions *options; // may be NULL
  Err *err;                   // takes the first error
  JsonDoc *doc;
  const Json *root;
  FileBytes file;
  const uint8_t *bin; // the GLB's binary chunk, NULL if there is none
  size_t bin_size;
  size_t read_size;    // bytes read from files so far
  size_t made_size;    // bytes made of them
  GltfBuffer *buffers; // one for each in the file, all lists below alike
  uint8_t **views;     // decompressed ones
  GltfImage *images;
  ARRAY(GltfTextureUse) uses;
  Table uses_found; // hash of glTF texture and transform -> use
  GltfMesh *meshes;
  ARRAY(GltfDeform) deforms; // by mesh_i, rising
  uint32_t *places;          // node -> its number in the rig; UINT32_MAX: it is not of the scene
  float light_scale; // candela and lux to watts, see gltf_light.c
} Gltf;

// --- gltf.c: the JSON ---------------------------------------------------------------------------
// Reports an error at a member of a dictionary, or at an item of one of the root's lists. Returns false.
bool gltf_fail(Gltf *g, const Json *dict, const char *key, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
bool gltf_fail_item(Gltf *g, const char *list, size_t i, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

// Makes room for count * size bytes, cleared or not, within what this import may make; `what` is for the message.
// Not to be confused with failure: count 0 gives a block, too. Freed with mem_free().
void *gltf_alloc(Gltf *g, size_t count, size_t size, const char *what);
bool gltf_charge(Gltf *g, size_t count, size_t size,
                 const char *what); // the same account, without the memory

// root[list] and its i-th item; NULL for none.
size_t gltf_count(const Gltf *g, const char *list);
const Json *gltf_item(const Gltf *g, const char *list, size_t i);

// A whole number from 0 up to 2^53; fallback if absent.
bool gltf_size(Gltf *g, const Json *dict, const char *key, size_t fallback, size_t *out);
// An index into root[list], or GLTF_NONE if absent.
bool gltf_index(Gltf *g, const Json *dict, const char *key, const char *list, size_t *out);
// The same with the valid range given.
bool gltf_index_below(Gltf *g, const Json *dict, const char *key, size_t count, const char *noun,
                      size_t *out);
// n numbers (n = 1: the number itself, else a list of n), left as they are if absent; finite as floats.
bool gltf_floats(Gltf *g, const Json *dict, const char *key, size_t n, float *out);
// The same, brought into low..high with a note when they lie outside.
bool gltf_ranged(Gltf *g, const Json *dict, const char *key, size_t n, float low, float high, float *out);
bool gltf_flag(Gltf *g, const Json *dict, const char *key, bool *out);
const Json *gltf_extension(const Json *v, const char *name); // NULL for none

enum { GLTF_NAME_SIZE = 128 };
// The dictionary's name, cut to fit, or fallback and its number.
const char *gltf_name(const Json *dict, const char *fallback, size_t number, char out[GLTF_NAME_SIZE]);

// --- gltf_buffer.c ------------------------------------------------------------------------------
typedef struct GltfView {
  const uint8_t *data;
  size_t size;
  size_t stride; // 0: elements lie side by side
} GltfView;
bool gltf_view(Gltf *g, size_t view_i, GltfView *out);
void gltf_release_buffers(Gltf *g);

// --- gltf_meshopt.c -----------------------------------------------------------------------------
typedef enum { MESHOPT_ATTRIBUTES, MESHOPT_TRIANGLES, MESHOPT_INDICES } MeshoptMode;
typedef enum { MESHOPT_NONE, MESHOPT_OCTAHEDRAL, MESHOPT_QUATERNION, MESHOPT_EXPONENTIAL } MeshoptFilter;
bool meshopt_is_built_in(void);
// Fills out (count * stride bytes); false if the data is broken. Arguments as the extension allows them.
bool meshopt_decode(MeshoptMode mode, MeshoptFilter filter, const uint8_t *data, size_t size, size_t count,
                    size_t stride, uint8_t *out);

// --- gltf_texture.c, gltf_material.c, gltf_mesh.c, gltf_light.c, gltf_node.c --------------------
// The textureInfo dict[key] as a texture of the scene; -1 if absent or not usable (with a note).
bool gltf_texture(Gltf *g, const Json *dict, const char *key, int32_t *texture_i);
bool gltf_add_materials(Gltf *g);                                 // scene index = glTF index
bool gltf_add_mesh(Gltf *g, size_t mesh_i, const GltfMesh **out); // at its first use
void gltf_choose_light_scale(Gltf *g);
bool gltf_add_light(Gltf *g, const Json *node, size_t node_i, const Frame *world, bool *is_added);
bool gltf_add_nodes(Gltf *g);

// --- gltf_deform.c, gltf_rig.c --------------------------------------------------------------------
// Room in the scene's arena, on the import's account.
void *gltf_keep(Gltf *g, size_t count, size_t size, const char *what);
// What the primitive says of its vertices first to first + count, which became the mesh.
bool gltf_add_deform(Gltf *g, const Json *primitive, const char *place, size_t vertex_count, size_t first, size_t count,
                     int32_t mesh_i);
bool gltf_rig_begin(Gltf *g);
bool gltf_rig_add_node(Gltf *g, size_t node_i, int32_t parent); // in the order of the walk
bool gltf_rig_add_skins(Gltf *g);                              // after all nodes
// The meshes that a node with this mesh and skin (GLTF_NONE: none) shows: its own if they change their shape and other
// nodes name them, too.
bool gltf_rig_add_shapes(Gltf *g, const GltfMesh *mesh, size_t skin_i, uint32_t node, bool is_shared, GltfMesh *own);
bool gltf_rig_is_bent(const Gltf *g, uint32_t node, int32_t mesh_i); // of the node just added, is the mesh skinned?
bool gltf_rig_add_object(Gltf *g, uint32_t id, uint32_t node, bool is_skinned, const Frame *local);
bool gltf_rig_add_camera(Gltf *g, const char *name, uint32_t node, bool is_main);
bool gltf_rig_add_light(Gltf *g, const char *name, uint32_t node);
bool gltf_rig_finish(Gltf *g); // clips; puts skinned and morphed meshes into their pose at rest

#endif
