// Rig: what a glTF file's clips move. Nodes stand in a tree, each with a place, a turn and a size at rest; a clip's
// channels change those in time; and objects, cameras, lights and the vertices of skinned and morphed meshes follow
// their nodes. To pose a rig is to set fields and vertices of the scene, as edits do, without history.
//
//   Rig
//     nodes[]    parents before children
//     clips[]    channels: curves over the nodes' places, turns, sizes and morph weights
//     skins[]    joints (nodes) with the maps that undo their pose when the mesh was bound
//     shapes[]   meshes that change: influences of joints on vertices, morph targets
//     objects[] lights[] cameras[]   what follows which node; found by identity, as edits move them in their lists
//
// All of it lies in the scene's arena and is immutable.

#ifndef RAYFOLD_SCENE_RIG_H
#define RAYFOLD_SCENE_RIG_H

#include "scene/quaternion.h"
#include "scene/scene.h"

typedef struct RigNode {
  int32_t parent;    // index of one before it; -1: a root
  bool has_matrix;   // the map at rest is matrix, and no channel may name the node
  bool is_driven;    // some clip moves it, or a node above it
  Frame matrix;
  float translation[3], rotation[4], scale[3]; // rotation: a quaternion x, y, z, w
  const float *weights; // of the morph targets of its mesh, at rest
  uint32_t weight_count;
  uint32_t first_weight; // among all nodes' weights
} RigNode;

typedef enum RigPath { RIG_TRANSLATION, RIG_ROTATION, RIG_SCALE, RIG_WEIGHTS } RigPath;
typedef enum RigCurve { RIG_STEP, RIG_LINEAR, RIG_SPLINE } RigCurve;

typedef struct RigChannel {
  uint32_t node;
  RigPath path;
  RigCurve curve;
  uint32_t key_count, width;   // at least 1; numbers a value
  const float *times, *values; // of a spline: in-slope, value and out-slope a key
} RigChannel;

typedef struct RigClip {
  const char *name;
  const RigChannel *channels;
  size_t channel_count;
  float start, end; // s
} RigClip;

typedef struct RigSkin {
  const uint32_t *joints; // nodes
  const Frame *inverse_bind;
  size_t joint_count;
} RigSkin;

typedef struct RigTarget { // added to the rest, times the target's weight
  const float *positions, *normals; // 3 a vertex; may be NULL
} RigTarget;

typedef struct RigShape {
  int32_t mesh_i;            // its vertices at rest are those of its data's origin
  uint32_t node;             // whose weights count
  int32_t skin;              // -1: none
  uint32_t influence_count;  // a vertex
  const uint16_t *joints;    // influence_count a vertex, indices into the skin's joints
  const float *weights;      // likewise; of each vertex they add up to 1
  const RigTarget *targets;
  size_t target_count;
} RigShape;

typedef struct RigObject {
  uint32_t id; // of the object
  uint32_t node;
  bool is_skinned; // its vertices are in the world already
  Frame local;     // of an instance below its node
} RigObject;

typedef struct RigFollower { // a light or a camera
  const char *name; // this very text, as the element has it
  uint32_t node;
  bool is_main;     // of a camera: the scene's main one follows, too
} RigFollower;

typedef struct Rig {
  ARRAY(RigNode) nodes;
  ARRAY(RigClip) clips;
  ARRAY(RigSkin) skins;
  ARRAY(RigShape) shapes;
  ARRAY(RigObject) objects;
  ARRAY(RigFollower) lights, cameras;
  size_t weight_count; // of all nodes
} Rig;

void rig_destroy(Rig *r); // accepts NULL

// Poses the scene. clip: its name, NULL: the first; is_strict: a name that no clip has is an error, not the first.
// is_all: no clip, but
// every skinned and morphed mesh into its shape at rest. moved gets bits of Moved.
bool rig_pose(Scene *s, const char *clip, bool is_strict, bool is_all, double seconds, unsigned *moved, Err *err);

const RigClip *rig_find_clip(const Rig *r, const char *name); // the first if name is NULL or unknown; NULL: no clips

// A camera or light as its node has it, the node's size aside.
void rig_place_camera(Camera *c, const Frame *world);
void rig_place_light(Light *l, const Frame *world);

// One channel's value, `width` numbers.
void rig_channel_value(const RigChannel *c, double seconds, float *out);

#endif
