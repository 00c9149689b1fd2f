// Materials ready for shading: the numbers of a scene's material with textures by index. world/ fills them in;
// shade/bsdf.h turns one of them and a surface point into a Bsdf.

#ifndef RAYFOLD_SHADE_MATERIAL_H
#define RAYFOLD_SHADE_MATERIAL_H

#include "base/vec.h"

#include <stdint.h>

typedef enum SurfaceKind {
  SURFACE_PBR,
  SURFACE_LAMBERT,
  SURFACE_MIRROR,
  SURFACE_GLASS,
  SURFACE_EMISSION,
  SURFACE_PHONG,
  SURFACE_COOK_TORRANCE,
  SURFACE_MIX, // of two others in the same list; material_choose() of bsdf.h picks one
} SurfaceKind;
typedef enum SurfaceAlpha { SURFACE_OPAQUE, SURFACE_MASK, SURFACE_BLEND } SurfaceAlpha;

typedef struct TextureRef {
  int32_t map;     // index into the world's TextureMaps, -1: none (the factor alone counts)
  uint8_t channel; // of scalar uses: 0 r .. 3 a
} TextureRef;

typedef struct SurfaceMaterial {
  uint8_t kind;        // SurfaceKind
  uint8_t alpha_mode;  // SurfaceAlpha
  bool is_double_sided, is_thin_walled;
  bool is_light;       // its emission is sampled as a light
  bool needs_filter;   // some hits on it do not count (alpha, back side)
  bool has_maps;       // so its places want a footprint (geom/footprint.h)
  Vec3 color;          // base colour, albedo, reflectance or glass tint; for emission unused
  Vec3 emission;       // radiance before its texture; zero: none
  Vec3 specular_color;
  Vec3 absorption;     // per metre inside (Beer-Lambert), zero: clear
  float opacity, alpha_cutoff;
  float metallic, roughness, ior, specular, transmission;
  float clearcoat, clearcoat_roughness;
  float normal_scale;
  float bump_scale;    // metres
  TextureRef bump_map;

  // Of few pbr materials; has_extras false: none of it counts.
  bool has_extras;
  Vec3 sheen_color;
  float sheen_roughness;
  float anisotropy, anisotropy_turn; // turn in radians from the tangent
  float iridescence, film_ior, film_least, film_most; // thickness in nanometres
  float dispersion;                  // 20 / Abbe number; of glass, too
  TextureRef sheen_color_map, sheen_roughness_map, anisotropy_map, iridescence_map, film_map;

  // Of phong and cook_torrance. color is the diffuse part, specular_color the glossy one; their sum is 1 at most, which
  // is the scene's less what is too much.
  Vec3 ambient;        // for integrators that add it; a path tracer finds out by itself
  uint8_t distribution; // GlossKind
  Vec3 gloss_f0;       // Fresnel reflectance at normal incidence; phong: 1
  float gloss_width;   // phong: exponent; cook_torrance: m
  float gloss_c;       // gaussian: height of the distribution, 1 over its total cosine at most
  Vec3 mirrored, passed; // weights of rays sent on, for integrators that send both
  float gloss_given_c; // the height as the scene has it; 0: none

  // Of a mix: the two, as distances from this one in the world's list, and how much of the second.
  int32_t mix_first, mix_second;
  float mix_amount;
  TextureRef mix_map;

  TextureRef color_map, opacity_map, metallic_map, roughness_map, normal_map, emission_map, specular_map,
      specular_color_map, transmission_map, clearcoat_map, clearcoat_roughness_map;
} SurfaceMaterial;

#endif
