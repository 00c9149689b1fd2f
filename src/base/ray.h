// Ray, Hit, SurfacePoint: the words geometry, trees, materials and integrators share.

#ifndef RAYFOLD_BASE_RAY_H
#define RAYFOLD_BASE_RAY_H

#include "base/vec.h"

// One straight segment. d need not be unit length; t counts in lengths of d.
typedef struct Ray {
  Vec3 o, d;
  float tmin, tmax; // the open interval that counts; tmin at least 0
} Ray;

// The same as it stands in files and in the public interface.
typedef struct PackedRay {
  float o[3], tmin, d[3], tmax;
} PackedRay;
_Static_assert(sizeof(PackedRay) == 32, "ray files and rf_ray have this layout");

#define NO_HIT UINT32_MAX

typedef struct Hit {
  float t;
  float u, v;         // of a triangle: weights of its second and third vertex; of a shape: its surface parameters 0..1
  uint32_t prim;      // triangle of the mesh; 0 for shapes
  uint32_t instance;  // NO_HIT: nothing was hit
  uint32_t : 32;      // room for the object's public name, which only src/api knows
} Hit;
_Static_assert(sizeof(Hit) == 24, "rf_hit has this layout, so that kernels write it directly");

// Which part of the scene a ray stands for: `width` metres across where it starts, wider by `spread` a metre on its way
// (Akenine-Moller et al., "Texture Level of Detail Strategies for Real-Time Ray Tracing", Ray Tracing Gems 2019).
typedef struct Cone {
  float width, spread;
} Cone;

// What is known of the place a ray hit, in world space. Directions are unit length.
typedef struct SurfacePoint {
  Vec3 p;
  float error;          // metres p may lie off the surface, seen by the next ray: see geom/offset.h
  Vec3 ng;            // geometric normal, by the winding: points to the front side
  Vec3 n;             // shading normal, on ng's side
  Vec3 tangent;       // direction of growing u, perpendicular to n
  float tangent_sign; // bitangent = sign * cross(n, tangent)
  Vec2 uv[2];
  float color[4];     // vertex colour, linear; 1 where there is none
  bool is_back;       // the ray came from behind (against ng's side)
  uint32_t instance, prim, material; // material: index into the world's

  // What only textures ask for (geom/footprint.h); zero: textures are not filtered.
  Vec3 object_p;      // p in the object's own space
  Frame object_frame; // turns directions into that
  float object_scale; // lengths there for one metre, about
  Vec3 grad_u[2], grad_v[2]; // of both uv sets, per metre along the surface
  Vec3 major, minor;  // how far the ray's cone reaches on the surface: the axes of an ellipse from end to end, metres
} SurfacePoint;

// Rays a thing can be seen by; a ray carries one bit, an instance a set of them.
typedef enum RayMask {
  RAY_CAMERA = 1,
  RAY_SHADOW = 2,
  RAY_BOUNCE = 4,
  RAY_ALL = 7,
  // The same for integrators that tell actors from backgrounds.
  RAY_ACTOR_CAMERA = 8,
  RAY_ACTOR_SHADOW = 16,
  RAY_ACTOR_BOUNCE = 32,
  RAY_BACKGROUND_CAMERA = 64,
  RAY_BACKGROUND_BOUNCE = 128,
} RayMask;

// Work done, for reports and the cost view. One per worker, added up at the end.
typedef struct RayCounters {
  uint64_t camera_rays, bounce_rays, shadow_rays;
  uint64_t nodes, prims; // boxes-of-eight and primitives (or blocks of them) tested
} RayCounters;

#endif
