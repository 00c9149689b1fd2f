// Textures ready for looking up: decoded pixels, wrap modes, the uv map as a matrix. Hot: lookups allocate nothing
// and touch no file. Pixels belong to whoever prepared the texture.

#ifndef RAYFOLD_SHADE_TEXTURE_H
#define RAYFOLD_SHADE_TEXTURE_H

#include "base/vec.h"
#include "image/image.h"

typedef enum TextureMapKind { TEXTURE_MAP_IMAGE, TEXTURE_MAP_CHECKER } TextureMapKind;
typedef enum TextureWrap { TEXTURE_REPEAT, TEXTURE_CLAMP, TEXTURE_MIRROR } TextureWrap;

typedef struct TextureMap {
  uint8_t kind;         // TextureMapKind
  uint8_t wrap_u, wrap_v;
  bool is_nearest, is_srgb; // is_srgb: integer colour channels are decoded (alpha never is)
  uint8_t texcoord;     // which uv set
  Image image;          // not owned
  float uv_map[2][3];   // u' = m[0][0] u + m[0][1] v + m[0][2], v' likewise
  float gain[3], bias[3];
  float color_a[3], color_b[3]; // checker
} TextureMap;

#endif
