// Ray sets: the rays that tracers are measured on, made of a mesh, a camera and the hits of the rays before them. All
// of it is a function of its arguments; README.md describes each set. Does not trace: whoever calls finds the hits
// and puts them into rtb_rays.ref before the next set can start from them.

#ifndef BENCH_RAY_SETS_H
#define BENCH_RAY_SETS_H

#include "rtb.h"

typedef struct RayCamera {
  rtb_v3 eye, at, up, light;
  float fov; // degrees, vertical
  int w, h;
} RayCamera;

bool ray_camera_read(const char *path, RayCamera *c); // false, and a message

// Rays through pixel centres; in Morton order when the picture is square and a power of two wide, else row by row.
void ray_set_primary(const RayCamera *c, rtb_rays *out);

typedef enum RayKind {
  RAY_TO_LIGHT,
  RAY_COSINE,
  RAY_NEAR
} RayKind; // RAY_NEAR: cosine, up to 5 % of the diagonal

typedef struct RaySetFrom {
  const rtb_mesh *mesh;
  const rtb_rays *source; // with its hits
  uint32_t stride;        // every so many of its rays that hit start one
  RayKind kind;
  uint32_t seed;
  rtb_v3 light; // of RAY_TO_LIGHT
} RaySetFrom;

void ray_set_secondary(const RaySetFrom *from, rtb_rays *out);
void ray_set_chords(const rtb_mesh *m, uint32_t count, rtb_rays *out);

// Sets the head of a set that has its rays, and makes room for its hits.
void ray_set_name(rtb_rays *r, const char *name, rtb_query query, bool is_coherent, const rtb_mesh *m);

// The triangle's unit normal turned against d. False: the triangle has no area.
bool ray_normal(const rtb_mesh *m, uint32_t prim, rtb_v3 d, rtb_v3 *n);

#endif
