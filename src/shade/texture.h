// Textures ready for looking up: decoded pixels with their mips, patterns, wrap modes, the uv map as a matrix. Pixels
// belong to whoever prepared the texture.

#ifndef RAYFOLD_SHADE_TEXTURE_H
#define RAYFOLD_SHADE_TEXTURE_H

#include "base/vec.h"
#include "image/image.h"

typedef enum TextureMapKind {
  TEXTURE_MAP_IMAGE,
  TEXTURE_MAP_CHECKER,
  TEXTURE_MAP_NOISE,
  TEXTURE_MAP_GRADIENT,
  TEXTURE_MAP_BRICK,
  TEXTURE_MAP_WAVE
} TextureMapKind;
typedef enum TextureWrap { TEXTURE_REPEAT, TEXTURE_CLAMP, TEXTURE_MIRROR } TextureWrap;
typedef enum TextureMinify { TEXTURE_ANISOTROPIC, TEXTURE_TRILINEAR, TEXTURE_UNFILTERED } TextureMinify;
typedef enum TextureSpace { TEXTURE_UV, TEXTURE_OBJECT, TEXTURE_WORLD } TextureSpace;

typedef struct TextureMap {
  uint8_t kind;             // TextureMapKind
  uint8_t wrap_u, wrap_v;   // of pictures; wrap_u also of gradients
  uint8_t minify;           // TextureMinify
  uint8_t space;            // TextureSpace, of noise
  uint8_t texcoord;         // which uv set
  bool is_nearest, is_srgb; // is_srgb: integer colour channels are decoded (alpha never is)
  bool is_coverage;         // some material takes its alpha for coverage
  bool is_radial;           // of gradients
  Image image;              // not owned
  const Image *levels;      // its mips, from half the size on; not owned
  uint32_t level_count;
  float uv_map[2][3];       // u' = m[0][0] u + m[0][1] v + m[0][2], v' likewise
  float gain[3], bias[3], alpha_gain;
  float color_a[3], color_b[3]; // of patterns
  // Noise: features of the first octave per unit; octaves, each `lacunarity` times finer and `persistence` times weaker.
  float frequency, lacunarity, persistence, contrast;
  int32_t octaves;
  uint32_t seed;
  // Bricks: length, mortar and shift of every other course, in courses.
  float length, mortar, stagger;
} TextureMap;

#endif
