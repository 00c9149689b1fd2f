// Lights: everything that can be aimed at. Emissive triangles, quads, disks, spheres, point and spot lights
// are chosen among by a tree (light_tree.h). A sun and a sky that varies have groups of their own, each sampled at every vertex: with
// few of them, choosing between sun and sky costs more noise than the extra shadow ray.
//
// This header holds the prepared data and the cold side; shade/light_sample.h is hot.

#ifndef RAYFOLD_SHADE_LIGHT_H
#define RAYFOLD_SHADE_LIGHT_H

#include "base/arena.h"
#include "base/err.h"
#include "base/jobs.h"
#include "base/vec.h"
#include "image/image.h"
#include "shade/light_tree.h"

typedef enum EmitterKind {
  EMITTER_POINT,
  EMITTER_SPOT,
  EMITTER_TRIANGLE,
  EMITTER_QUAD,
  EMITTER_DISK,
  EMITTER_SPHERE,
} EmitterKind;

// A lamp's distribution by angles (degrees, ascending): value[h * vertical_count + v], 1 in the brightest direction.
typedef struct LightProfile {
  uint32_t vertical_count, horizontal_count; // one horizontal angle: all planes are alike
  const float *vertical, *horizontal;        // from the axis; around it
  const float *value;
} LightProfile;

// In world space. Area emitters radiate `color` (times their texture) from the side of their normal
// cross(x, y), or from both if is_two_sided.
typedef struct Emitter {
  uint8_t kind;
  bool is_two_sided;
  bool is_mirrored;   // of points and spots: its profile goes round the other way
  Vec3 p;       // point, spot, disk, sphere: centre; triangle: first vertex; quad: a corner
  Vec3 x, y;    // triangle: edges from p; quad: sides from p; disk: radius vectors; spot, profile: x is the unit axis
                // and y the unit direction of the profile's horizontal angle 0
  Vec3 color;   // radiance, or intensity of points and spots
  float radius; // sphere
  float cos_outer, cos_inner; // spot
  float area;                 // of one side; 0 for points and spots
  int32_t map;                // TextureMap of the radiance, -1 none; a sphere must have none
  // Of a triangle's vertices, for its map (already the map's uv set). A quad's go 0..1 along x and y; a disk's are
  // 0.5 + half its radius vectors' weights.
  float uv[3][2];
  float mean_map; // mean luminance of the map or the profile (1 without one), for the choice by power
  uint32_t profile; // of points and spots: index into the set's profiles plus one, 0 none
  uint32_t image;   // how it is seen, for who put it here; this room only hands it on
} Emitter;

typedef struct Sun {
  Vec3 direction; // unit, towards it
  Vec3 radiance;  // of the disk; for a disk of no size: irradiance at normal incidence
  // 1 - cos of the disk's angular radius; 0: no size, a delta light. Kept in this form because the sun's cosine is
  // within 1e-5 of 1, where a float has lost three digits of the solid angle.
  float one_minus_cos;
  uint32_t image; // as an Emitter's
} Sun;

// Constant: color everywhere. Gradient: from horizon to zenith and ground, linear in |d.y|. Image: the centre is
// at -z, its top at +y, x to the right.
typedef enum SkyMapKind { SKY_MAP_CONSTANT, SKY_MAP_GRADIENT, SKY_MAP_IMAGE } SkyMapKind;
typedef struct SkyMap {
  uint8_t kind;
  bool is_sampled; // it varies, so it is worth aiming at (set by light_set_build); else the BSDF finds it
  Vec3 color, horizon, ground; // constant: color; gradient: color is the zenith
  Image image;                 // equirectangular, float or half rgb, not owned
  float gain;                  // multiplies every kind
  float rotation;              // radians, counter-clockwise seen from above
  // Of an image: 0: its rows are at equal angles; else they crowd at this angle from the zenith (radians), half of
  // them above it, their distance from it growing with the square.
  float horizon_angle;
  // Piecewise-constant density over grid_width x grid_height equal cells of the image's (u, v) rectangle.
  uint32_t grid_width, grid_height;
  float *row_cdf;  // grid_height + 1, owned by the LightSet's arena
  float *cell_cdf; // grid_height rows of grid_width + 1, each from 0 to 1
} SkyMap;

typedef struct LightSet {
  Arena arena;
  Emitter *emitters; // in the arena
  LightTree tree;    // over them
  size_t emitter_count;
  Sun *suns;
  size_t sun_count;
  const LightProfile *profiles; // not owned, set by whoever builds the set
  SkyMap sky;
} LightSet; // zero has no lights and a black sky

// Copies emitters, suns and sky, and makes the tables for sampling. The sky's image must outlive the set. What has no
// finite positive power is never aimed at. Fails only when memory is out or it is cancelled; *out is then
// zero.
bool light_set_build(LightSet *out, const Emitter *emitters, size_t emitter_count, const Sun *suns,
                     size_t sun_count, const SkyMap *sky, const Cancel *cancel, Err *err);
void light_set_finish(LightSet *s); // accepts zero

#endif
