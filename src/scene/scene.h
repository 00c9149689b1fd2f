// Scene: the editable description. Plain structs that name each other by index; names, ranges and defaults come
// from the field tables below. It knows nothing of trees, films or threads: world/ makes it ready to render.
//
//   Scene
//     about, render, develop, sky, camera   one each
//     cameras[] skies[] cells[] gates[] textures[] materials[] media[] objects[] lights[]
//     timeline, animation[]            when, and the tracks that move all of the above
//     models[]   files that objects refer to, each a Scene of its own, loaded once
//     meshes[]   bulk geometry, immutable and counted, shared with worlds
//
// Units: metres, seconds, watts; degrees here, radians in rooms above.

#ifndef RAYFOLD_SCENE_SCENE_H
#define RAYFOLD_SCENE_SCENE_H

#include "base/arena.h"
#include "base/array.h"
#include "base/err.h"
#include "base/file.h"
#include "base/jobs.h"
#include "base/notes.h"
#include "base/span.h"
#include "base/text.h"
#include "base/vec.h"
#include "scene/cell_kinds.h"
#include "scene/field.h"
#include "scene/voxel_kinds.h"

#include <stdatomic.h>

// --- what it is ---------------------------------------------------------------------------------
#define ABOUT_FIELDS(F)                                                                     \
  F(text, title, NULL, 0, 0, "", "What the scene is called.")                               \
  F(text, text, NULL, 0, 0, "", "What there is to see, in a sentence or two.")
FIELD_STRUCT(About, ABOUT_FIELDS);

// --- settings -----------------------------------------------------------------------------------
#define RENDER_FIELDS(F)                                                                                            \
  F(choice,  integrator, 0, 0, 0, "path|normal|depth|albedo|uv|id|bary|cost|classic|whitted", "What a pixel shows: light (`path`; `classic`, mirror chains with scattered rays; `whitted`, direct light, mirrors and glass without chance; these two see no media), or a debug view, which `rayfold render` saves untouched by `develop`.") \
  F(size,    size, (1280, 720), 1, 32768, "px", "Width and height of the picture.")                                 \
  F(integer, spp, 64, 1, 524288, "", "Samples a pixel.")                                                            \
  F(integer, max_depth, 8, 0, 4096, "", "Most bounces of a path; 0 shows emitted light only, 1 direct light.")      \
  F(integer, scatter, 8, 0, 1024, "", "Scattered rays at each surface of a chain, for the integrator `classic` alone.") \
  F(integer, seed, 1, 0, 2147483647, "", "Same seed, same picture.")                                                \
  F(integer, roulette_depth, 3, 0, 4096, "", "Bounces before Russian roulette may end a path.")                     \
  F(choice,  filter, 1, 0, 0, "box|blackman_harris|gaussian", "Shape of the pixel reconstruction filter.")          \
  F(real,    filter_width, 0, 0, 16, "px", "Full width of the filter; 0 takes 1 for box, 3 for the others.")        \
  F(real,    clamp, 0, 0, NO_LIMIT, "", "Largest radiance a bounce may bring to a pixel; 0 is off and unbiased.")   \
  F(flag,    transparent, 0, 0, 1, "", "Leave the sky out of the picture's alpha, for compositing.")                 \
  F(flag,    compact, 0, 0, 1, "", "Keep meshes' trees in an eighth of the memory; same picture, slower.")              \
  F(choice,  tree, 0, 0, 0, "fast|best", "How search trees are built: `best` takes 2 to 7 times as long and pays off in rooms seen with many samples.") \
  F(integer, motion_steps, 16, 1, 64, "", "Moments that the camera's open shutter is cut into, each with a world of its own; `spp` should be a multiple.") \
  F(medium,  atmosphere, -1, 0, 0, "", "A homogeneous medium that fills all space, for lamps to shine in; no light of sky or sun comes through.") \
  F(choice,  volumes, 0, 0, 0, "exact|march", "How light goes through media that differ from place to place: without error, or in steps.") \
  F(integer, volume_steps, 24, 1, 4096, "", "Steps of a march, through each medium.") \
  F(integer, crossings, 64, 1, 256, "", "Most gates that a ray goes through; what lies beyond shows `fade_color`.") \
  F(real,    fade, 0, 0, NO_LIMIT, "m", "With gates: what is this far along a ray is lost in `fade_color`, from four fifths of the way on; 0 is never. A function of length alone, so no gate shows.") \
  F(color,   fade_color, (0, 0, 0), 0, NO_LIMIT, "W/m2sr", "What is seen where rays end that went too far through gates.") \
  F(integer, light_gates, 2, 0, 4, "", "Most gates on the way from a lamp that is aimed at; beyond, only what shines by itself is found, by chance.") \
  F(choice,  denoise, 0, 0, 0, "off|fast|good|best", "How to take the noise out of the finished picture: our own filter, or a small or a full neural network.")
FIELD_STRUCT(RenderSettings, RENDER_FIELDS);
#define WHITTED_FIELDS(F)                                                                                             \
  F(choice,  light_model, 0, 0, 0, "scene|lambert|phong|cook_torrance", "How surfaces are lit: as their materials say, or all in one way.") \
  F(choice,  light_units, 0, 0, 0, "physical|classic", "In `classic` a point's intensity arrives undiminished and matt surfaces show it by their cosine, as in the first ray tracers.") \
  F(color,   ambient, (0, 0, 0), 0, NO_LIMIT, "", "Light from everywhere, which no shadow stops.")                    \
  F(choice,  shadows, 0, 0, 0, "transparent|hard|none", "`transparent`: glass colours the light that goes through it, straight on.") \
  F(flag,    soft_shadows, 0, 0, 1, "", "Aim at all of a lamp, by chance, instead of at its middle: needs many samples.") \
  F(flag,    fresnel, 1, 0, 1, "", "Glass reflects by Fresnel's formulas; false: by fixed weights, `reflect` and `transmit` of phong and cook_torrance.") \
  F(flag,    filter_textures, 1, 0, 1, "", "False: textures are looked up at points, as the first ray tracers did.") \
  F(real,    least_weight, 0.002, 0, 1, "", "A ray that can bring less than this to its pixel is not sent.")
FIELD_STRUCT(WhittedSettings, WHITTED_FIELDS);
typedef enum { LIGHT_MODEL_SCENE, LIGHT_MODEL_LAMBERT, LIGHT_MODEL_PHONG, LIGHT_MODEL_COOK_TORRANCE } LightModel;
typedef enum { LIGHT_UNITS_PHYSICAL, LIGHT_UNITS_CLASSIC } LightUnits;
typedef enum { SHADOWS_TRANSPARENT, SHADOWS_HARD, SHADOWS_NONE } ShadowKind;
typedef enum { INTEGRATOR_PATH, INTEGRATOR_NORMAL, INTEGRATOR_DEPTH, INTEGRATOR_ALBEDO, INTEGRATOR_UV,
               INTEGRATOR_ID, INTEGRATOR_BARY, INTEGRATOR_COST, INTEGRATOR_CLASSIC, INTEGRATOR_WHITTED } Integrator;
typedef enum { SCENE_TREE_FAST, SCENE_TREE_BEST } SceneTree; // accel/ has its own, in the same order
typedef enum { VOLUMES_EXACT, VOLUMES_MARCH } VolumesMode;
typedef enum { DENOISE_OFF, DENOISE_FAST, DENOISE_GOOD, DENOISE_BEST } DenoiseKind;
typedef enum { FILTER_BOX, FILTER_BLACKMAN_HARRIS, FILTER_GAUSSIAN } FilterKind;

#define DEVELOP_FIELDS(F)                                                                                         \
  F(real,   exposure, 0, -32, 32, "stops", "Brightness: each stop doubles it.")                                   \
  F(choice, tone_curve, 1, 0, 0, "linear|filmic|agx|neutral", "From scene light to the screen: sRGB clipped, an ACES fit, AgX, or Khronos PBR Neutral.") \
  F(real,   gamma, 1, 0.1, 10, "", "Extra power on top of the curve; above 1 lifts dark parts.")
FIELD_STRUCT(DevelopSettings, DEVELOP_FIELDS);
typedef enum { TONE_LINEAR, TONE_FILMIC, TONE_AGX, TONE_NEUTRAL } ToneCurve;

// --- cameras ------------------------------------------------------------------------------------
#define CAMERA_FIELDS(F)                                                                     \
  F(vec3, position, (0, 1, 4), -NO_LIMIT, NO_LIMIT, "m", "Where the eye is.")                \
  F(vec3, target, (0, 1, 0), -NO_LIMIT, NO_LIMIT, "m", "The point it looks at.")             \
  F(vec3, up, (0, 1, 0), -NO_LIMIT, NO_LIMIT, "", "The direction that is up in the picture.") \
  F(real, shutter, 0, 0, 1, "frames", "How long light comes in, about the moment shown: 0 is a still, 0.5 what film cameras do.") \
  F(cell, cell, -1, 0, 0, "", "The cell it stands in.")
FIELD_STRUCT(CameraCommon, CAMERA_FIELDS);

#define PERSPECTIVE_FIELDS(F)                                                                                    \
  F(real,    fov, 45, 0.01, 179, "deg", "Vertical field of view.")                                               \
  F(real,    aperture, 0, 0, 1000, "m", "Radius of the lens; 0 is a pinhole with everything sharp.")             \
  F(real,    focus, 0, 0, NO_LIMIT, "m", "Distance of the sharp plane; 0 is the distance to the target.")        \
  F(integer, blades, 0, 0, 16, "", "Blades of the aperture; under 3 it is round.")
#define ORTHOGRAPHIC_FIELDS(F) \
  F(real, height, 2, 1e-6, NO_LIMIT, "m", "Height of the picture in the scene.")
#define PANORAMIC_FIELDS(F) \
  F(real, span, 360, 1, 360, "deg", "Horizontal angle shown; 360 is the whole sphere, as a sky image has it.")
FIELD_STRUCT(Perspective, PERSPECTIVE_FIELDS);
FIELD_STRUCT(Orthographic, ORTHOGRAPHIC_FIELDS);
FIELD_STRUCT(Panoramic, PANORAMIC_FIELDS);

typedef enum CameraKind { CAMERA_PERSPECTIVE, CAMERA_ORTHOGRAPHIC, CAMERA_PANORAMIC } CameraKind;
typedef struct Camera {
  const char *name; // in "cameras"; NULL for "camera"
  int32_t kind;     // CameraKind
  CameraCommon common;
  union {
    Perspective perspective;
    Orthographic orthographic;
    Panoramic panoramic;
  };
} Camera;

// --- sky ----------------------------------------------------------------------------------------
#define SKY_CONSTANT_FIELDS(F)                                                            \
  F(color, color, (0, 0, 0), 0, NO_LIMIT, "W/m2sr", "Radiance from every direction.")     \
  F(real,  gain, 1, 0, NO_LIMIT, "", "Multiplies the colour.")
#define SKY_GRADIENT_FIELDS(F)                                                            \
  F(color, zenith, (0.25, 0.45, 0.9), 0, NO_LIMIT, "W/m2sr", "Radiance straight up.")     \
  F(color, horizon, (0.9, 0.95, 1), 0, NO_LIMIT, "W/m2sr", "Radiance at the horizon.")    \
  F(color, ground, (0.3, 0.28, 0.25), 0, NO_LIMIT, "W/m2sr", "Radiance straight down.")   \
  F(real,  gain, 1, 0, NO_LIMIT, "", "Multiplies all three.")
#define SKY_IMAGE_FIELDS(F)                                                                                          \
  F(file,  file, NULL, 0, 0, "", "A picture of all directions; its centre is at -z.")                                \
  F(choice, layout, 0, 0, 0, "panorama|cross", "An equirectangular picture, twice as wide as high; or the six sides of a cube as a cross, 4:3 lying or 3:4 standing.") \
  F(real,  rotation, 0, -360, 360, "deg", "Turns the sky about the y axis, counter-clockwise seen from above.")      \
  F(real,  gain, 1, 0, NO_LIMIT, "", "Multiplies the picture.")
#define SKY_SUN_FIELDS(F)                                                                                            \
  F(real,  elevation, 35, -90, 90, "deg", "Of the sun's centre above the horizon; below -18 it is night.")           \
  F(real,  azimuth, 45, -360, 360, "deg", "Where the sun stands: 0 is -z, 90 is +x.")                                \
  F(real,  sun_size, 0.53, 0, 90, "deg", "Diameter of the sun's disk; 0 gives hard shadows.")                        \
  F(real,  sun_intensity, 1, 0, NO_LIMIT, "", "Multiplies the sun's own light; 0 leaves the sky alone.")             \
  F(real,  air, 1, 0, 20, "", "Density of air: 0 is a black sky, 1 a clear day.")                                    \
  F(real,  dust, 1, 0, 50, "", "Density of dust and haze: 1 is a clear day, 5 hazy (turbidity).")                    \
  F(real,  ozone, 1, 0, 20, "", "Density of ozone, which keeps the sky blue at dusk.")                               \
  F(real,  altitude, 0, 0, 60000, "m", "Of the eye above the ground.")                                               \
  F(color, albedo, (0.3, 0.3, 0.3), 0, 1, "", "Of the ground, which is seen below the horizon and lights the air.")   \
  F(real,  gain, 1, 0, NO_LIMIT, "", "Multiplies sun and sky; at 1 sunlight is 4 W/m2 above the air.")
FIELD_STRUCT(SkyConstant, SKY_CONSTANT_FIELDS);
FIELD_STRUCT(SkyGradient, SKY_GRADIENT_FIELDS);
FIELD_STRUCT(SkyImage, SKY_IMAGE_FIELDS);
FIELD_STRUCT(SkySun, SKY_SUN_FIELDS);
typedef enum { LAYOUT_PANORAMA, LAYOUT_CROSS } SkyLayout;

typedef enum SkyKind { SKY_CONSTANT, SKY_GRADIENT, SKY_IMAGE, SKY_SUN } SkyKind;
typedef struct Sky {
  int32_t kind; // SkyKind
  union {
    SkyConstant constant;
    SkyGradient gradient;
    SkyImage image;
    SkySun sun;
  };
} Sky;

// A sky that cells name.
typedef struct NamedSky {
  const char *name;
  Sky sky;
} NamedSky;

// --- textures -----------------------------------------------------------------------------------
#define TEXTURE_FIELDS(F)                                                                                     \
  F(vec2,    offset, (0, 0), -NO_LIMIT, NO_LIMIT, "", "Added to uv, after scale and rotation (KHR_texture_transform).") \
  F(vec2,    scale, (1, 1), -NO_LIMIT, NO_LIMIT, "", "Multiplies uv first: 2 shows the picture twice.")       \
  F(real,    rotation, 0, -NO_LIMIT, NO_LIMIT, "deg", "Turns uv, counter-clockwise.")                         \
  F(integer, texcoord, 0, 0, 1, "", "Which set of texture coordinates of the mesh.")
FIELD_STRUCT(TextureCommon, TEXTURE_FIELDS);

#define TEXTURE_IMAGE_FIELDS(F)                                                                                     \
  F(file,   file, NULL, 0, 0, "", "PNG, JPEG, HDR, EXR or WebP. v runs up: the picture's bottom row is at v = 0.")   \
  F(choice, encoding, 0, 0, 0, "auto|srgb|linear", "How 8 and 16 bit values are stored; auto goes by use: colours sRGB, data linear.") \
  F(choice, wrap_u, 0, 0, 0, "repeat|clamp|mirror", "What lies beyond the left and right edges.")                   \
  F(choice, wrap_v, 0, 0, 0, "repeat|clamp|mirror", "What lies beyond the top and bottom edges.")                   \
  F(choice, filter, 0, 0, 0, "linear|nearest", "How texels are mixed where they are larger than pixels.")           \
  F(choice, minify, 0, 0, 0, "anisotropic|trilinear|off", "Where texels are smaller than pixels: their mean over the pixel's ellipse, over a round one around it, or one texel by chance.") \
  F(color,  gain, (1, 1, 1), 0, NO_LIMIT, "", "Multiplies the picture's channels.")                                 \
  F(real,   alpha_gain, 1, 0, NO_LIMIT, "", "Multiplies its alpha.")                                                \
  F(color,  bias, (0, 0, 0), -NO_LIMIT, NO_LIMIT, "", "Added after the gain.")
#define TEXTURE_CHECKER_FIELDS(F)                                                  \
  F(color, color_a, (0.8, 0.8, 0.8), 0, NO_LIMIT, "", "One colour.")               \
  F(color, color_b, (0.2, 0.2, 0.2), 0, NO_LIMIT, "", "The other; a field is half of uv wide.")
#define TEXTURE_NOISE_FIELDS(F)                                                                                  \
  F(choice,  space, 1, 0, 0, "uv|object|world", "What it is laid out in: texture coordinates, or space, which needs none.") \
  F(real,    size, 1, 1e-6, NO_LIMIT, "", "Width of the largest features: metres, or of uv after its map.")         \
  F(integer, octaves, 5, 1, 16, "", "Layers of ever finer features.")                                               \
  F(real,    lacunarity, 2, 1, 8, "", "How much finer each layer is than the last.")                                \
  F(real,    persistence, 0.5, 0, 1, "", "How strong each layer is beside the last.")                               \
  F(real,    contrast, 1.5, 0, 100, "", "Above 1 more of the range from color_a to color_b is used.")               \
  F(integer, seed, 0, 0, 2147483647, "", "Another seed, another noise.")                                            \
  F(color,   color_a, (0, 0, 0), 0, NO_LIMIT, "", "Where it is low.")                                               \
  F(color,   color_b, (1, 1, 1), 0, NO_LIMIT, "", "Where it is high.")
#define TEXTURE_GRADIENT_FIELDS(F)                                                                                \
  F(choice,  shape, 0, 0, 0, "linear|radial", "Along u from 0 to 1, or from the middle of uv's unit square to its sides.") \
  F(choice,  wrap, 1, 0, 0, "repeat|clamp|mirror", "What lies beyond.")                                           \
  F(color,   color_a, (0, 0, 0), 0, NO_LIMIT, "", "Where it begins.")                                             \
  F(color,   color_b, (1, 1, 1), 0, NO_LIMIT, "", "Where it ends.")
#define TEXTURE_BRICK_FIELDS(F)                                                                                   \
  F(real,    length, 2.5, 0.01, 1000, "", "Of a brick with its joint; a course is one of v high, after the uv map.") \
  F(real,    mortar, 0.12, 0, 1, "", "Thickness of the joints.")                                                  \
  F(real,    stagger, 0.5, 0, 1, "", "How far every other course is shifted, in bricks.")                         \
  F(color,   color_a, (0.4, 0.12, 0.07), 0, NO_LIMIT, "", "The bricks.")                                          \
  F(color,   color_b, (0.6, 0.58, 0.55), 0, NO_LIMIT, "", "The mortar.")
#define TEXTURE_WAVE_FIELDS(F)                                                                                    \
  F(color,   color_a, (0, 0, 0), 0, NO_LIMIT, "", "At whole u: one wave is one of u long.")                       \
  F(color,   color_b, (1, 1, 1), 0, NO_LIMIT, "", "Between; smooth, as a cosine.")
FIELD_STRUCT(TextureImage, TEXTURE_IMAGE_FIELDS);
FIELD_STRUCT(TextureChecker, TEXTURE_CHECKER_FIELDS);
FIELD_STRUCT(TextureNoise, TEXTURE_NOISE_FIELDS);
FIELD_STRUCT(TextureGradient, TEXTURE_GRADIENT_FIELDS);
FIELD_STRUCT(TextureBrick, TEXTURE_BRICK_FIELDS);
FIELD_STRUCT(TextureWave, TEXTURE_WAVE_FIELDS);
typedef enum { ENCODING_AUTO, ENCODING_SRGB, ENCODING_LINEAR } Encoding;
typedef enum { WRAP_REPEAT, WRAP_CLAMP, WRAP_MIRROR } Wrap;
typedef enum { TEXEL_LINEAR, TEXEL_NEAREST } TexelFilter;
typedef enum { GRADIENT_LINEAR, GRADIENT_RADIAL } GradientShape;
typedef enum { MINIFY_ANISOTROPIC, MINIFY_TRILINEAR, MINIFY_OFF } Minify; // shade/ has its own, in the same order

typedef enum TextureKind { TEXTURE_IMAGE, TEXTURE_CHECKER, TEXTURE_NOISE, TEXTURE_GRADIENT, TEXTURE_BRICK,
                           TEXTURE_WAVE } TextureKind;
typedef struct Texture {
  const char *name;
  int32_t kind; // TextureKind
  TextureCommon common;
  union {
    TextureImage image;
    TextureChecker checker;
    TextureNoise noise;
    TextureGradient gradient;
    TextureBrick brick;
    TextureWave wave;
  };
  // An image inside a model file (GLB, data URI): its encoded bytes, owned by the scene's arena; file is then NULL.
  const uint8_t *embedded;
  size_t embedded_size;
} Texture;

// --- materials ----------------------------------------------------------------------------------
#define PBR_FIELDS(F)                                                                                               \
  F(color,   base_color, (0.8, 0.8, 0.8), 0, 1, "", "Albedo of dielectrics, reflectance of metals.")               \
  F(texture, base_color_texture, -1, 0, 0, "", "Multiplies base_color (rgb) and opacity (alpha).")                  \
  F(real,    opacity, 1, 0, 1, "", "Coverage, used by alpha_mode mask and blend.")                                  \
  F(texture, opacity_texture, -1, 0, 0, "", "Multiplies opacity.")                                                  \
  F(choice,  opacity_channel, 0, 0, 0, "r|g|b|a", "The channel of opacity_texture that counts.")                    \
  F(choice,  alpha_mode, 0, 0, 0, "opaque|mask|blend", "Ignore opacity, cut at alpha_cutoff, or let light through in part.") \
  F(real,    alpha_cutoff, 0.5, 0, 1, "", "Below it a masked surface is a hole.")                                   \
  F(real,    metallic, 0, 0, 1, "", "0 a dielectric, 1 a metal.")                                                   \
  F(texture, metallic_texture, -1, 0, 0, "", "Multiplies metallic.")                                                \
  F(choice,  metallic_channel, 2, 0, 0, "r|g|b|a", "The channel of metallic_texture that counts.")                  \
  F(real,    roughness, 0.5, 0, 1, "", "0 is polished; GGX width alpha is its square.")                             \
  F(texture, roughness_texture, -1, 0, 0, "", "Multiplies roughness.")                                              \
  F(choice,  roughness_channel, 1, 0, 0, "r|g|b|a", "The channel of roughness_texture that counts.")                \
  F(texture, normal_texture, -1, 0, 0, "", "Tangent-space normals, 0..1 stands for -1..1, green up.")               \
  F(real,    normal_scale, 1, -16, 16, "", "Strength of the normal texture.")                                       \
  F(texture, bump_texture, -1, 0, 0, "", "Heights that bend the normal; the mean of its colour channels.")          \
  F(real,    bump_scale, 0.01, -NO_LIMIT, NO_LIMIT, "m", "How high 1 of bump_texture is.")                          \
  F(color,   emissive, (0, 0, 0), 0, NO_LIMIT, "", "Emitted colour; radiance is this times emissive_strength.")     \
  F(texture, emissive_texture, -1, 0, 0, "", "Multiplies emissive.")                                                \
  F(real,    emissive_strength, 1, 0, NO_LIMIT, "W/m2sr", "Multiplies emissive.")                                   \
  F(real,    ior, 1.5, 1, 5, "", "Index of refraction of the dielectric.")                                          \
  F(real,    specular, 1, 0, 1, "", "Strength of the dielectric reflection (KHR_materials_specular).")              \
  F(texture, specular_texture, -1, 0, 0, "", "Multiplies specular.")                                                \
  F(choice,  specular_channel, 3, 0, 0, "r|g|b|a", "The channel of specular_texture that counts.")                  \
  F(color,   specular_color, (1, 1, 1), 0, NO_LIMIT, "", "Tints the dielectric reflection at normal incidence.")    \
  F(texture, specular_color_texture, -1, 0, 0, "", "Multiplies specular_color.")                                    \
  F(real,    transmission, 0, 0, 1, "", "Part of the base that lets light through instead of scattering it.")       \
  F(texture, transmission_texture, -1, 0, 0, "", "Multiplies transmission.")                                        \
  F(choice,  transmission_channel, 0, 0, 0, "r|g|b|a", "The channel of transmission_texture that counts.")          \
  F(flag,    thin_walled, 0, 0, 1, "", "A sheet without inside: light passes straight on.")                         \
  F(color,   attenuation_color, (1, 1, 1), 0, 1, "", "What is left of white light after attenuation_distance inside.") \
  F(real,    attenuation_distance, 0, 0, NO_LIMIT, "m", "0 is clear.")                                              \
  F(real,    clearcoat, 0, 0, 1, "", "A second, clear layer on top (ior 1.5).")                                     \
  F(texture, clearcoat_texture, -1, 0, 0, "", "Multiplies clearcoat.")                                              \
  F(choice,  clearcoat_channel, 0, 0, 0, "r|g|b|a", "The channel of clearcoat_texture that counts.")                \
  F(real,    clearcoat_roughness, 0, 0, 1, "", "Roughness of that layer.")                                          \
  F(texture, clearcoat_roughness_texture, -1, 0, 0, "", "Multiplies clearcoat_roughness.")                          \
  F(choice,  clearcoat_roughness_channel, 1, 0, 0, "r|g|b|a", "The channel of clearcoat_roughness_texture that counts.") \
  F(color,   sheen_color, (0, 0, 0), 0, 1, "", "Light that fibres on top throw back along the surface: cloth (KHR_materials_sheen).") \
  F(texture, sheen_color_texture, -1, 0, 0, "", "Multiplies sheen_color.")                                          \
  F(real,    sheen_roughness, 0, 0, 1, "", "How far it reaches in from the edge: satin 0.2, velvet 0.5, dust 1.")   \
  F(texture, sheen_roughness_texture, -1, 0, 0, "", "Multiplies sheen_roughness; its alpha channel.")               \
  F(real,    anisotropy, 0, 0, 1, "", "Widens reflections along the tangent, as brushing does (KHR_materials_anisotropy).") \
  F(real,    anisotropy_rotation, 0, -360, 360, "deg", "Turns that direction, from the tangent towards growing v.") \
  F(texture, anisotropy_texture, -1, 0, 0, "", "Red and green: the direction, 0..1 for -1..1; blue multiplies anisotropy.") \
  F(real,    iridescence, 0, 0, 1, "", "Share of a thin film with its colours on top (KHR_materials_iridescence).") \
  F(texture, iridescence_texture, -1, 0, 0, "", "Multiplies iridescence; its red channel.")                         \
  F(real,    iridescence_ior, 1.3, 1, 5, "", "Index of refraction of the film; soap water 1.33.")                   \
  F(real,    iridescence_thickness_min, 100, 0, 10000, "nm", "Thickness where its texture is 0.")                   \
  F(real,    iridescence_thickness_max, 400, 0, 10000, "nm", "Thickness where its texture is 1, and without one.")  \
  F(texture, iridescence_thickness_texture, -1, 0, 0, "", "From min to max; its green channel.")                    \
  F(real,    dispersion, 0, 0, 20, "", "Parts colours in refraction: 20 / Abbe number; diamond 0.36 (KHR_materials_dispersion). The integrator `whitted` does not.") \
  F(flag,    double_sided, 1, 0, 1, "", "False: seen from behind the surface is not there.")
#define LAMBERT_FIELDS(F)                                                              \
  F(color,   albedo, (0.8, 0.8, 0.8), 0, 1, "", "Part of the light that is scattered.") \
  F(texture, albedo_texture, -1, 0, 0, "", "Multiplies albedo.")
#define MIRROR_FIELDS(F)                                       \
  F(color, color, (0.95, 0.95, 0.95), 0, 1, "", "Reflectance.") \
  F(real,  roughness, 0, 0, 1, "", "0 is polished; GGX width alpha is its square. Light that microfacets send to and fro is lost, as in Blender's Glossy BSDF.")
#define GLASS_FIELDS(F)                                                                                          \
  F(color, color, (1, 1, 1), 0, 1, "", "Multiplies what passes the surface.")                                    \
  F(real,  ior, 1.5, 1, 5, "", "Index of refraction.")                                                           \
  F(real,  roughness, 0, 0, 1, "", "0 is polished.")                                                             \
  F(real,  dispersion, 0, 0, 20, "", "Parts colours: 20 / Abbe number; crown glass 0.31, flint 0.55, diamond 0.36. The integrator `whitted` does not.") \
  F(color, attenuation_color, (1, 1, 1), 0, 1, "", "What is left of white light after attenuation_distance.")    \
  F(real,  attenuation_distance, 0, 0, NO_LIMIT, "m", "0 is clear.")
#define PRINCIPLED_FIELDS(F)                                                                                        \
  F(color,   base_color, (0.8, 0.8, 0.8), 0, 1, "", "Albedo of dielectrics, reflectance of metals.")                \
  F(texture, base_color_texture, -1, 0, 0, "", "Multiplies base_color; its alpha multiplies alpha.")                \
  F(real,    subsurface, 0, 0, 1, "", "Only 0: light that wanders below the skin is not supported here.")           \
  F(real,    metallic, 0, 0, 1, "", "0 a dielectric, 1 a metal.")                                                   \
  F(texture, metallic_texture, -1, 0, 0, "", "Multiplies metallic; its red channel.")                               \
  F(real,    specular, 0.5, 0, 1, "", "Dielectric reflection: 8 % of it at normal incidence, so 0.5 is ior 1.5.")   \
  F(real,    specular_tint, 0, 0, 1, "", "Colours that reflection like the base.")                                  \
  F(real,    roughness, 0.5, 0, 1, "", "0 is polished.")                                                            \
  F(texture, roughness_texture, -1, 0, 0, "", "Multiplies roughness; its red channel.")                             \
  F(real,    anisotropic, 0, 0, 1, "", "Stretches highlights, as brushing does.")                                   \
  F(real,    anisotropic_rotation, 0, 0, 1, "turn", "Turns that direction; 1 is once around.")                      \
  F(real,    sheen, 0, 0, 1, "", "Fibres on top, as of velvet: sheen_color of pbr, with a sheen_roughness of 0.5.") \
  F(real,    sheen_tint, 0.5, 0, 1, "", "Colours the sheen like the base.")                                         \
  F(real,    clearcoat, 0, 0, 1, "", "A clear layer on top.")                                                       \
  F(real,    clearcoat_roughness, 0.03, 0, 1, "", "Roughness of that layer.")                                       \
  F(real,    ior, 1.45, 1, 5, "", "Index of refraction of what is transmitted; specular is not changed by it.")     \
  F(real,    transmission, 0, 0, 1, "", "Part of the base that lets light through: glass.")                         \
  F(color,   emission, (0, 0, 0), 0, NO_LIMIT, "", "Emitted colour; radiance is this times emission_strength.")     \
  F(texture, emission_texture, -1, 0, 0, "", "Multiplies emission.")                                                \
  F(real,    emission_strength, 1, 0, NO_LIMIT, "W/m2sr", "Multiplies emission.")                                   \
  F(real,    alpha, 1, 0, 1, "", "Coverage; below 1 light passes in part.")                                         \
  F(texture, alpha_texture, -1, 0, 0, "", "Multiplies alpha; its red channel.")                                     \
  F(texture, normal_texture, -1, 0, 0, "", "Tangent-space normals, 0..1 stands for -1..1, green up.")               \
  F(real,    normal_strength, 1, 0, 16, "", "Strength of the normal texture.")
// What phong and cook_torrance send on; a path tracer does not ask for it.
#define SENT_FIELDS(F)                                                                                                \
  F(color,   reflect, (0, 0, 0), 0, 1, "", "Weight of the mirror ray, for the whitted integrator alone.")             \
  F(color,   transmit, (0, 0, 0), 0, 1, "", "Weight of the refracted ray, for the whitted integrator alone.")         \
  F(real,    ior, 1.5, 1, 5, "", "Index of refraction of what is transmitted.")                                       \
  F(color,   attenuation_color, (1, 1, 1), 0, 1, "", "What is left of transmitted white light after attenuation_distance.") \
  F(real,    attenuation_distance, 0, 0, NO_LIMIT, "m", "0 is clear.")
#define PHONG_FIELDS(F)                                                                                               \
  F(color,   ambient, (0.1, 0.1, 0.1), 0, 1, "", "Times the whitted integrator's ambient light; a path tracer finds out itself.") \
  F(color,   diffuse, (0.6, 0.6, 0.6), 0, 1, "", "Part of the light that is scattered.")                              \
  F(texture, diffuse_texture, -1, 0, 0, "", "Multiplies diffuse.")                                                    \
  F(color,   specular, (0.3, 0.3, 0.3), 0, 1, "", "Part that is reflected; where diffuse + specular exceed 1, both are scaled down.") \
  F(real,    exponent, 50, 0, 10000, "", "Sharpness of the highlight.")                                               \
  SENT_FIELDS(F)
#define COOK_TORRANCE_FIELDS(F)                                                                                       \
  F(color,   ambient, (0.1, 0.1, 0.1), 0, 1, "", "Times the whitted integrator's ambient light; a path tracer finds out itself.") \
  F(color,   diffuse, (0.6, 0.6, 0.6), 0, 1, "", "Part of the light that is scattered.")                              \
  F(texture, diffuse_texture, -1, 0, 0, "", "Multiplies diffuse.")                                                    \
  F(color,   specular, (0.4, 0.4, 0.4), 0, 1, "", "Part that meets the facets; where diffuse + specular exceed 1, both are scaled down.") \
  F(color,   f0, (0.04, 0.04, 0.04), 0, 1, "", "What a facet reflects at normal incidence (Schlick); a metal has its colour here.") \
  F(real,    roughness, 0.3, 0.02, 1, "", "Slope of the facets, the m of Cook and Torrance.")                         \
  F(choice,  distribution, 0, 0, 0, "beckmann|gaussian", "How the facets lie: as a rough surface's, or c exp(-(angle / m)^2).") \
  F(real,    c, 0, 0, 1000, "", "Height of gaussian; 0, and all that would make light, is the most that makes none.") \
  SENT_FIELDS(F)
#define STUDIO_FIELDS(F)                                                                                              \
  F(color,   color, (0.7, 0.7, 0.7), 0, 1, "", "Colour of the body.")                                                 \
  F(texture, color_texture, -1, 0, 0, "", "Multiplies color.")                                                        \
  F(real,    reflection, 0, 0, 1, "", "From matt to a mirror that keeps its colour white.")                           \
  F(real,    direct_to_scatter, 0.5, 0, 1, "", "How much of the light that falls on the body it gives on: half at 0, all at 1.") \
  F(real,    specular, 0.5, 0, 1, "", "Strength of the highlight.")                                                   \
  F(real,    roughness, 0.5, 0, 1, "", "Spread of reflection and highlight.")                                         \
  F(real,    metallic, 0, 0, 1, "", "Colours all reflection like the body, and takes the matt part away.")
#define MIX_FIELDS(F)                                                                                            \
  F(material, first, -1, 0, 0, "", "One material; none: a grey pbr.")                                            \
  F(material, second, -1, 0, 0, "", "The other. Mixes may hold mixes, four deep at most, and never themselves.") \
  F(real,    amount, 0.5, 0, 1, "", "How much of the second. To the integrator `whitted` the larger part is all but what shines.") \
  F(texture, amount_texture, -1, 0, 0, "", "Multiplies amount.")                                                 \
  F(choice,  amount_channel, 0, 0, 0, "r|g|b|a", "The channel of amount_texture that counts.")
#define EMISSION_FIELDS(F)                                                                                 \
  F(color,   color, (1, 1, 1), 0, NO_LIMIT, "", "Emitted colour; radiance is this times strength.")        \
  F(texture, color_texture, -1, 0, 0, "", "Multiplies color.")                                             \
  F(real,    strength, 1, 0, NO_LIMIT, "W/m2sr", "Multiplies color.")                                      \
  F(flag,    double_sided, 0, 0, 1, "", "Shine from the back, too.")                                       \
  F(flag,    lights_others, 1, 0, 1, "", "False: seen, but no light source (KHR_materials_unlit).")
FIELD_STRUCT(Pbr, PBR_FIELDS);
FIELD_STRUCT(Lambert, LAMBERT_FIELDS);
FIELD_STRUCT(Mirror, MIRROR_FIELDS);
FIELD_STRUCT(Glass, GLASS_FIELDS);
FIELD_STRUCT(Emission, EMISSION_FIELDS);
FIELD_STRUCT(Principled, PRINCIPLED_FIELDS);
FIELD_STRUCT(Phong, PHONG_FIELDS);
FIELD_STRUCT(CookTorrance, COOK_TORRANCE_FIELDS);
FIELD_STRUCT(Studio, STUDIO_FIELDS);
FIELD_STRUCT(Mix, MIX_FIELDS);
typedef enum { ALPHA_OPAQUE, ALPHA_MASK, ALPHA_BLEND } AlphaMode;

typedef enum { FACETS_BECKMANN, FACETS_GAUSSIAN } FacetDistribution;

typedef enum MaterialKind { MATERIAL_PBR, MATERIAL_LAMBERT, MATERIAL_MIRROR, MATERIAL_GLASS, MATERIAL_EMISSION,
                            MATERIAL_PRINCIPLED, MATERIAL_PHONG, MATERIAL_COOK_TORRANCE, MATERIAL_STUDIO,
                            MATERIAL_MIX } MaterialKind;
typedef struct Material {
  const char *name;
  int32_t kind; // MaterialKind
  union {
    Pbr pbr;
    Lambert lambert;
    Mirror mirror;
    Glass glass;
    Emission emission;
    Principled principled;
    Phong phong;
    CookTorrance cook_torrance;
    Studio studio;
    Mix mix;
  };
} Material;

// --- media --------------------------------------------------------------------------------------
// Light is scattered and absorbed by the length of its way: the chance a metre is density times scattering or absorption.
#define MEDIUM_FIELDS(F)                                                                                            \
  F(real,  density, 1, 0, NO_LIMIT, "", "Multiplies scattering, absorption and emission.")                          \
  F(color, scattering, (1, 1, 1), 0, NO_LIMIT, "1/m", "Scattering coefficient: light turned aside.")                \
  F(color, absorption, (0, 0, 0), 0, NO_LIMIT, "1/m", "Absorption coefficient: light lost.")                        \
  F(color, emission, (0, 0, 0), 0, NO_LIMIT, "W/m3sr", "Radiance that a metre adds.")                               \
  F(real,  temperature, 0, 0, 1e6, "K", "What absorbs glows as a black body this hot; times the heat of media that have one.") \
  F(real,  glow, 1, 0, NO_LIMIT, "", "How bright that is: of the black body's spectrum, whose peak counts as 1.")   \
  F(real,  anisotropy, 0, -1, 1, "", "Mean cosine g of scattering (Henyey-Greenstein): 0 all ways alike, above it forward; held to 0.99 at most.") \
  F(real,  second_anisotropy, 0, -1, 1, "", "The same of a second lobe.")                                     \
  F(real,  second_part, 0, 0, 1, "", "Part of the light that goes by the second lobe.")
FIELD_STRUCT(MediumCommon, MEDIUM_FIELDS);

#define MEDIUM_GRID_FIELDS(F)                                                                    \
  F(file, file, NULL, 0, 0, "", "A `.grid` (see docs/media.md), or `.nvdb` where this program can read it.") \
  F(file, heat, "", 0, 0, "", "Another one, of how hot it is where; without it 1 everywhere.")  \
  F(real, heat_offset, 0, -NO_LIMIT, NO_LIMIT, "", "The heat of 0 K; what lies above it is multiplied by `temperature`.")
#define MEDIUM_FLAME_FIELDS(F)                                                                   \
  F(vec3,    size, (0.6, 1.6, 0.6), 1e-6, 1e6, "m", "The box it burns in; centred.")              \
  F(real,    lump, 0.35, 1e-6, 1e6, "m", "Size of the whirls.")                                   \
  F(real,    swirl, 1, 0, 16, "", "How far whirls tear it.")                                      \
  F(real,    rise, 0, -1e6, 1e6, "m", "How far it has risen: move it for a flame that burns.")    \
  F(integer, seed, 1, 0, 2147483647, "", "Another number, another flame.")                        \
  F(integer, resolution, 96, 4, 1024, "", "Values along the longest side.")
#define MEDIUM_BALL_FIELDS(F)                                                                    \
  F(real, radius, 0.5, 1e-6, NO_LIMIT, "m", "1 at the origin, falling to 0 here.")                \
  F(real, waves, 0, 0, 1000, "rad/m", "Multiplies by (1 + sin x sin y sin z) / 2, this fast.")    \
  F(vec3, waves_origin, (0, 0, 0), -1e6, 1e6, "m", "Where the waves begin.")
#define MEDIUM_CLOUD_FIELDS(F)                                                                   \
  F(vec3,    size, (2, 1.2, 2), 1e-6, 1e6, "m", "The ellipsoid it fills; centred.")               \
  F(real,    lump, 0.5, 1e-6, 1e6, "m", "Size of the largest lumps.")                             \
  F(real,    raggedness, 0.8, 0, 16, "", "0 is the smooth ellipsoid.")                            \
  F(real,    softness, 0.25, 1e-3, 1e3, "", "Small: the edge is sharp.")                          \
  F(integer, octaves, 5, 1, 12, "", "Sizes of lumps, each half the one before.")                  \
  F(integer, seed, 1, 0, 2147483647, "", "Another number, another cloud.")                        \
  F(integer, resolution, 96, 4, 1024, "", "Values along the longest side.")
#define MEDIUM_WISPS_FIELDS(F)                                                                   \
  F(vec3,    size, (1, 2, 1), 1e-6, 1e6, "m", "The ellipsoid it fills; centred.")                 \
  F(real,    lump, 0.5, 1e-6, 1e6, "m", "Size of the whirls.")                                    \
  F(real,    swirl, 1, 0, 16, "", "How far whirls draw the smoke out.")                           \
  F(integer, seed, 1, 0, 2147483647, "", "Another number, other wisps.")                          \
  F(integer, resolution, 96, 4, 1024, "", "Values along the longest side.")
FIELD_STRUCT(MediumGrid, MEDIUM_GRID_FIELDS);
FIELD_STRUCT(MediumBall, MEDIUM_BALL_FIELDS);
FIELD_STRUCT(MediumCloud, MEDIUM_CLOUD_FIELDS);
FIELD_STRUCT(MediumWisps, MEDIUM_WISPS_FIELDS);
FIELD_STRUCT(MediumFlame, MEDIUM_FLAME_FIELDS);

typedef enum MediumKind { MEDIUM_HOMOGENEOUS, MEDIUM_GRID, MEDIUM_BALL, MEDIUM_CLOUD, MEDIUM_WISPS, MEDIUM_FLAME } MediumKind;
typedef struct Medium {
  const char *name;
  int32_t kind; // MediumKind
  MediumCommon common;
  union {
    MediumGrid grid;
    MediumBall ball;
    MediumCloud cloud;
    MediumWisps wisps;
    MediumFlame flame;
  };
} Medium;

// --- meshes: bulk data --------------------------------------------------------------------------
// Immutable once it is in a scene; counted, so that scenes and worlds share it. All arrays owned (mem_alloc), or all
// of them bytes of `file`, which must not be written to. Any but positions and triangles may be NULL. Moved vertices
// make another one, which owns what moved and has the rest from its base.
typedef struct MeshData {
  atomic_int users;
  size_t vertex_count, triangle_count;
  float *positions;           // 3 a vertex
  float *normals;             // 3 a vertex, unit
  float *texcoords[2];        // 2 a vertex; v runs up
  float *colors;              // 4 a vertex, linear; multiplies the base colour and opacity
  float *tangents;            // 4 a vertex: unit tangent and the bitangent's sign
  uint32_t *triangles;        // 3 vertex indices a triangle, counter-clockwise seen from outside
  uint16_t *material_slots;   // one a triangle: index into the Mesh's slots; NULL: all slot 0
  struct MeshData *base;      // shared; owns all arrays but positions and normals, and has no base; NULL: all are owned
  SharedFile *file;           // a use of the saved model that the arrays lie in; NULL: they are owned
  SavedTree tree;             // its tree, in the same file; empty: to be built
} MeshData;

MeshData *mesh_data_create(void); // users = 1, empty; NULL when memory is out
MeshData *mesh_data_share(MeshData *m);
void mesh_data_release(MeshData *m); // accepts NULL; frees at the last user
// The same triangles at other positions, which must be finite and as many. normals may be NULL: flat. The result keeps
// the first positions alive, too, but all others along the way may go. NULL when memory is out.
MeshData *mesh_data_move(MeshData *m, const float *positions, const float *normals);
// Equal for all that come from one by moving its vertices.
static inline const MeshData *mesh_data_origin(const MeshData *m) { return m->base ? m->base : m; }
// Indices in range, finite positions; reports the first fault with its place. Drops normals that are not finite.
bool mesh_data_check(MeshData *m, const char *name, Notes *notes, Err *err);

typedef struct Mesh {
  const char *name;
  MeshData *data;       // shared
  int32_t *slots;       // slot -> material index of the same scene, -1: the default material; in the arena
  size_t slot_count;    // may be 0
} Mesh;

// --- objects ------------------------------------------------------------------------------------
#define OBJECT_FIELDS(F)                                                                                            \
  F(material, material, -1, 0, 0, "", "Overrides the materials of the shape's file; none: a grey pbr, or the file's own.") \
  F(medium, medium, -1, 0, 0, "", "What fills it; it must be closed. Without a material of its own the object then has no surface. Voxels become smoke.") \
  F(vec3,   translate, (0, 0, 0), -NO_LIMIT, NO_LIMIT, "m", "Moved by this, last.")                                 \
  F(vec3,   rotate, (0, 0, 0), -NO_LIMIT, NO_LIMIT, "deg", "Turned about x, then y, then z, after scaling.")        \
  F(vec3,   scale, (1, 1, 1), -NO_LIMIT, NO_LIMIT, "", "Sized first.")                                              \
  F(matrix, matrix, 0, -NO_LIMIT, NO_LIMIT, "", "The whole map, 16 numbers, column by column; then the three above must be absent.") \
  F(flag,   visible_to_camera, 1, 0, 1, "", "False: only in reflections and shadows.")                              \
  F(flag,   casts_shadow, 1, 0, 1, "", "False: light passes it on the way to a surface.")                            \
  F(choice, role, 0, 0, 0, "actor|background", "For the whitted integrator: a background is not asked where an actor was met, and throws no shadow.") \
  F(cell,   cell, -1, 0, 0, "", "The cell it is in; a part is where its whole is.")                                 \
  F(gate,   through, -1, 0, 0, "", "The flat gate it stands in: what of it is beyond is seen on the other side.")   \
  F(object, part_of, -1, 0, 0, "", "Name of an object of kind csg or field, further up in the list, that this one is a part of; its place is then relative to that.")
FIELD_STRUCT(ObjectCommon, OBJECT_FIELDS);
typedef enum { ROLE_ACTOR, ROLE_BACKGROUND } ObjectRole;

#define SHAPE_MESH_FIELDS(F) \
  F(file, file, NULL, 0, 0, "", "A model (obj, gltf, glb, ply, stl, rfm) or another scene (json), placed as a whole.")
#define SHAPE_SPHERE_FIELDS(F) \
  F(real, radius, 1, 1e-6, NO_LIMIT, "m", "Its centre is the origin.")
#define SHAPE_QUAD_FIELDS(F) \
  F(vec2, size, (1, 1), 1e-6, NO_LIMIT, "m", "Extent along x and y; centred, facing +z.")
#define SHAPE_DISK_FIELDS(F) \
  F(real, radius, 1, 1e-6, NO_LIMIT, "m", "Centred, facing +z.")
#define SHAPE_BOX_FIELDS(F) \
  F(vec3, size, (1, 1, 1), 1e-6, NO_LIMIT, "m", "Extent along x, y and z; centred.")
#define SHAPE_TRIANGLE_FIELDS(F)                                              \
  F(vec3, a, (0, 0, 0), -NO_LIMIT, NO_LIMIT, "m", "First corner; its uv are (0, 0).")  \
  F(vec3, b, (1, 0, 0), -NO_LIMIT, NO_LIMIT, "m", "Second corner; its uv are (1, 0).") \
  F(vec3, c, (0, 1, 0), -NO_LIMIT, NO_LIMIT, "m", "Third corner; its uv are (0, 1).")
#define SHAPE_CYLINDER_FIELDS(F)                                                                        \
  F(real, radius, 1, 1e-6, NO_LIMIT, "m", "Around the y axis.")                                         \
  F(real, height, 2, 0, NO_LIMIT, "m", "From bottom to top, the origin in the middle; 0 has no ends.")  \
  F(flag, capped, 1, 0, 1, "", "False: an open tube, whose inside can be seen.")
#define SHAPE_CONE_FIELDS(F)                                                                            \
  F(real, radius, 1, 0, NO_LIMIT, "m", "At the bottom, y = -height / 2.")                               \
  F(real, top_radius, 0, 0, NO_LIMIT, "m", "At the top; above 0 the cone has lost its tip.")            \
  F(real, height, 2, 1e-6, NO_LIMIT, "m", "From bottom to top, the origin in the middle.")              \
  F(flag, capped, 1, 0, 1, "", "False: open below, and above if it has lost its tip.")
#define SHAPE_ENDLESS_CONE_FIELDS(F) \
  F(real, angle, 30, 0.01, 89.99, "deg", "From the axis to the side; the tip is at the origin, wider below.")
#define SHAPE_TORUS_FIELDS(F)                                                               \
  F(real, radius, 1, 1e-6, NO_LIMIT, "m", "Of the ring around the y axis, to the middle of the tube.") \
  F(real, tube_radius, 0.25, 1e-6, NO_LIMIT, "m", "Of the tube; more than the ring's counts as that.")
#define SHAPE_CSG_FIELDS(F)                                                                                            \
  F(choice, operation, 0, 0, 0, "union|intersection|difference", "All parts together, what they have in common, or the first without the others.")
#define SHAPE_VOXELS_FIELDS(F)                                                                                         \
  F(file,   file, NULL, 0, 0, "", "A MagicaVoxel model (.vox), all of it in one grid. `palette` and `fill` come after it.") \
  F(real,   voxel_size, 0.1, 1e-6, NO_LIMIT, "m", "Side of a voxel.")                                                \
  F(choice, origin, 0, 0, 0, "corner|center|floor", "What of the grid lies at the object's origin: its first corner, its middle, or the middle of its bottom.")
#define SHAPE_ROUND_BOX_FIELDS(F)                                                           \
  F(vec3, size, (1, 1, 1), 1e-6, NO_LIMIT, "m", "Extent along x, y and z, the rounding included; centred.") \
  F(real, round, 0.1, 0, NO_LIMIT, "m", "Radius of its edges; half of the least extent at most.")
#define SHAPE_CAPSULE_FIELDS(F)                                                             \
  F(real, radius, 0.5, 1e-6, NO_LIMIT, "m", "Of the tube and of the balls at its ends.")    \
  F(real, height, 1, 0, NO_LIMIT, "m", "Along y, between the middles of the balls.")
#define SHAPE_ELLIPSOID_FIELDS(F) \
  F(vec3, radius, (1, 0.5, 0.5), 1e-6, NO_LIMIT, "m", "Along x, y and z.")
#define SHAPE_OCTAHEDRON_FIELDS(F) \
  F(real, radius, 1, 1e-6, NO_LIMIT, "m", "From the middle to each corner.")
#define SHAPE_MENGER_FIELDS(F)                                             \
  F(real, size, 2, 1e-6, NO_LIMIT, "m", "Side of the cube it is cut from.") \
  F(integer, levels, 4, 0, 8, "", "How often holes are cut, each time a third as wide.")
#define SHAPE_MANDELBULB_FIELDS(F)                                                             \
  F(real, radius, 1.25, 1e-6, NO_LIMIT, "m", "Of the ball it fits into.")                      \
  F(integer, power, 8, 2, 16, "", "Of the map that is repeated.")                              \
  F(integer, rounds, 8, 1, 64, "", "How often: more show finer parts.")
#define SHAPE_FORMULA_FIELDS(F)                                                                  \
  F(text, formula, "length(x, y, z) - 1", 0, 0, "", "The value at x, y, z, negative inside: see docs/fields.md for the language.") \
  F(vec3, size, (2, 2, 2), 1e-6, NO_LIMIT, "m", "Extent of the box it is cut to; centred.")
#define SHAPE_FIELD_FIELDS(F)                                                                    \
  F(choice, operation, 0, 0, 0, "union|intersection|difference|soft_maximum", "What becomes of the parts: all together, what they have in common, the first without the others; or the logarithm of the sum of their exponentials.") \
  F(real, smooth, 0, 0, NO_LIMIT, "m", "Width over which parts melt together; 0 is hard. Of soft_maximum: its unit of length.") \
  F(choice, mix, 0, 0, 0, "none|color|material", "Where parts melt together: the nearer one's material; its colour mixed with the other's; or either of them, by chance.") \
  F(real, round, 0, 0, NO_LIMIT, "m", "Added all around.")                                       \
  F(real, onion, 0, 0, NO_LIMIT, "m", "Thickness of a shell about the surface, in place of the solid; 0: solid.") \
  F(vec3, elongate, (0, 0, 0), 0, NO_LIMIT, "m", "Cut in the middle and drawn apart by this, along each axis.") \
  F(vec3, repeat, (0, 0, 0), 0, NO_LIMIT, "m", "From copy to copy along each axis; 0: one alone.") \
  F(vec3, copies, (0, 0, 0), 0, 1000000, "", "How many along each axis; 0: without end.")        \
  F(flag, mirrored, 0, 0, 1, "", "Every second copy is seen in a mirror, and parts are cut where copies meet.") \
  F(real, twist, 0, -3600, 3600, "deg/m", "Turns about the y axis, more with the height.")       \
  F(real, bend, 0, -3600, 3600, "deg/m", "Turns about the z axis, more along x.")                \
  F(real, noise, 0, -NO_LIMIT, NO_LIMIT, "m", "Height of waves of noise added to the surface.")  \
  F(real, noise_size, 0.25, 1e-6, NO_LIMIT, "m", "Length of these waves.")                       \
  F(integer, noise_seed, 0, 0, 2147483647, "", "Which waves.")                                   \
  F(real, detail, 0, 0, NO_LIMIT, "m", "Of the outermost field: parts thicker than this are never missed by a ray; 0: a 4000th of its size.")
FIELD_STRUCT(ShapeMesh, SHAPE_MESH_FIELDS);
FIELD_STRUCT(ShapeSphere, SHAPE_SPHERE_FIELDS);
FIELD_STRUCT(ShapeQuad, SHAPE_QUAD_FIELDS);
FIELD_STRUCT(ShapeDisk, SHAPE_DISK_FIELDS);
FIELD_STRUCT(ShapeBox, SHAPE_BOX_FIELDS);
FIELD_STRUCT(ShapeTriangle, SHAPE_TRIANGLE_FIELDS);
FIELD_STRUCT(ShapeCylinder, SHAPE_CYLINDER_FIELDS);
FIELD_STRUCT(ShapeCone, SHAPE_CONE_FIELDS);
FIELD_STRUCT(ShapeEndlessCone, SHAPE_ENDLESS_CONE_FIELDS);
FIELD_STRUCT(ShapeTorus, SHAPE_TORUS_FIELDS);
FIELD_STRUCT(ShapeCsg, SHAPE_CSG_FIELDS);
FIELD_STRUCT(ShapeVoxels, SHAPE_VOXELS_FIELDS);
typedef enum { VOXELS_CORNER, VOXELS_CENTER, VOXELS_FLOOR } VoxelsOrigin;
FIELD_STRUCT(ShapeRoundBox, SHAPE_ROUND_BOX_FIELDS);
FIELD_STRUCT(ShapeCapsule, SHAPE_CAPSULE_FIELDS);
FIELD_STRUCT(ShapeEllipsoid, SHAPE_ELLIPSOID_FIELDS);
FIELD_STRUCT(ShapeOctahedron, SHAPE_OCTAHEDRON_FIELDS);
FIELD_STRUCT(ShapeMenger, SHAPE_MENGER_FIELDS);
FIELD_STRUCT(ShapeMandelbulb, SHAPE_MANDELBULB_FIELDS);
FIELD_STRUCT(ShapeFormula, SHAPE_FORMULA_FIELDS);
FIELD_STRUCT(ShapeField, SHAPE_FIELD_FIELDS);
typedef enum { CSG_UNION, CSG_INTERSECTION, CSG_DIFFERENCE } CsgOperation;
typedef enum { FIELD_MIX_NONE, FIELD_MIX_COLOR, FIELD_MIX_MATERIAL } FieldMix; // geom/ has its own, in the same order

typedef enum ShapeKind { SHAPE_MESH, SHAPE_SPHERE, SHAPE_QUAD, SHAPE_DISK, SHAPE_BOX, SHAPE_PLANE, SHAPE_TRIANGLE,
                         SHAPE_CYLINDER, SHAPE_CONE, SHAPE_ENDLESS_CONE, SHAPE_TORUS, SHAPE_CSG, SHAPE_VOXELS,
                         // Distance fields: a field, and primitives that are fields by themselves.
                         SHAPE_FIELD, SHAPE_ROUND_BOX, SHAPE_CAPSULE, SHAPE_ELLIPSOID, SHAPE_OCTAHEDRON, SHAPE_MENGER,
                         SHAPE_MANDELBULB, SHAPE_FORMULA } ShapeKind;
typedef struct Shape {
  int32_t kind; // ShapeKind
  union {
    ShapeMesh mesh;
    ShapeSphere sphere;
    ShapeQuad quad;
    ShapeDisk disk;
    ShapeBox box;
    ShapeTriangle triangle;
    ShapeCylinder cylinder;
    ShapeCone cone;
    ShapeEndlessCone endless_cone;
    ShapeTorus torus;
    ShapeCsg csg;
    ShapeVoxels voxels;
    ShapeField field;
    ShapeRoundBox round_box;
    ShapeCapsule capsule;
    ShapeEllipsoid ellipsoid;
    ShapeOctahedron octahedron;
    ShapeMenger menger;
    ShapeMandelbulb mandelbulb;
    ShapeFormula formula;
  };
  int32_t mesh_i;  // of SHAPE_MESH: index into scene.meshes for data given inline, by call or by an importer; else -1
  int32_t model_i; // of SHAPE_MESH: index into scene.models for a file; else -1
  int32_t voxels_i; // of SHAPE_VOXELS: index into scene.voxels; else -1
} Shape;

typedef struct Object {
  const char *name; // may be NULL
  uint32_t id;      // stays the same while objects come and go; never 0
  ObjectCommon common;
  Shape shape;
} Object;

// --- lights -------------------------------------------------------------------------------------
#define LIGHT_FIELDS(F) \
  F(cell, cell, -1, 0, 0, "", "The cell it is in.")
FIELD_STRUCT(LightCommon, LIGHT_FIELDS);
#define LIGHT_POINT_FIELDS(F)                                                              \
  F(vec3,  position, (0, 3, 0), -NO_LIMIT, NO_LIMIT, "m", "Where it is.")                  \
  F(color, intensity, (10, 10, 10), 0, NO_LIMIT, "W/sr", "Radiant intensity; with a file, in its brightest direction.") \
  F(file,  ies, NULL, 0, 0, "", "An IES file: a lamp's measured distribution, hanging down.") \
  F(real,  ies_rotation, 0, -360, 360, "deg", "Turns it, counter-clockwise seen from above; at 0 its horizontal angle 0 is at +x.")
#define LIGHT_SPOT_FIELDS(F)                                                               \
  F(vec3,  position, (0, 3, 0), -NO_LIMIT, NO_LIMIT, "m", "Where it is.")                  \
  F(vec3,  target, (0, 0, 0), -NO_LIMIT, NO_LIMIT, "m", "The point it is aimed at.")       \
  F(color, intensity, (10, 10, 10), 0, NO_LIMIT, "W/sr", "Radiant intensity in the middle.") \
  F(real,  angle, 45, 0.01, 90, "deg", "From the middle of the cone to its edge.")         \
  F(real,  inner_angle, 0, 0, 90, "deg", "From the middle to where it begins to fade.") \
  F(file,  ies, NULL, 0, 0, "", "An IES file: a lamp's measured distribution around the aim, within the cone.") \
  F(real,  ies_rotation, 0, -360, 360, "deg", "Turns it about the aim.")
#define LIGHT_SUN_FIELDS(F)                                                                         \
  F(vec3,  direction, (0, 1, 0), -NO_LIMIT, NO_LIMIT, "", "From the scene to the sun.")             \
  F(color, irradiance, (3, 3, 3), 0, NO_LIMIT, "W/m2", "On a surface that faces it.")               \
  F(real,  angle, 0.53, 0, 180, "deg", "Diameter of its disk; 0 gives hard shadows.")
#define LIGHT_RECT_FIELDS(F)                                                               \
  F(vec3,  position, (0, 3, 0), -NO_LIMIT, NO_LIMIT, "m", "Its centre.")                   \
  F(vec3,  target, (0, 0, 0), -NO_LIMIT, NO_LIMIT, "m", "The point it faces.")             \
  F(vec2,  size, (1, 1), 1e-6, NO_LIMIT, "m", "Width and height.")                         \
  F(color, radiance, (10, 10, 10), 0, NO_LIMIT, "W/m2sr", "Emitted on its front.")         \
  F(flag,  visible_to_camera, 1, 0, 1, "", "False: lit by, but not seen.")
#define LIGHT_DISK_FIELDS(F)                                                               \
  F(vec3,  position, (0, 3, 0), -NO_LIMIT, NO_LIMIT, "m", "Its centre.")                   \
  F(vec3,  target, (0, 0, 0), -NO_LIMIT, NO_LIMIT, "m", "The point it faces.")             \
  F(real,  radius, 0.5, 1e-6, NO_LIMIT, "m", "Its radius.")                                \
  F(color, radiance, (10, 10, 10), 0, NO_LIMIT, "W/m2sr", "Emitted on its front.")         \
  F(flag,  visible_to_camera, 1, 0, 1, "", "False: lit by, but not seen.")
#define LIGHT_SPHERE_FIELDS(F)                                                             \
  F(vec3,  position, (0, 3, 0), -NO_LIMIT, NO_LIMIT, "m", "Its centre.")                   \
  F(real,  radius, 0.25, 1e-6, NO_LIMIT, "m", "Its radius.")                               \
  F(color, radiance, (10, 10, 10), 0, NO_LIMIT, "W/m2sr", "Emitted everywhere on it.")     \
  F(flag,  visible_to_camera, 1, 0, 1, "", "False: lit by, but not seen.")
FIELD_STRUCT(LightPoint, LIGHT_POINT_FIELDS);
FIELD_STRUCT(LightSpot, LIGHT_SPOT_FIELDS);
FIELD_STRUCT(LightSun, LIGHT_SUN_FIELDS);
FIELD_STRUCT(LightRect, LIGHT_RECT_FIELDS);
FIELD_STRUCT(LightDisk, LIGHT_DISK_FIELDS);
FIELD_STRUCT(LightSphere, LIGHT_SPHERE_FIELDS);

typedef enum LightKind { LIGHT_POINT, LIGHT_SPOT, LIGHT_SUN, LIGHT_RECT, LIGHT_DISK, LIGHT_SPHERE } LightKind;
typedef struct Light {
  const char *name; // may be NULL
  int32_t kind;     // LightKind
  LightCommon common;
  union {
    LightPoint point;
    LightSpot spot;
    LightSun sun;
    LightRect rect;
    LightDisk disk;
    LightSphere sphere;
  };
} Light;

// --- animation ----------------------------------------------------------------------------------
#define TIMELINE_FIELDS(F)                                                                              \
  F(real, fps, 24, 0.001, 100000, "1/s", "Pictures a second.")                                          \
  F(vec2, range, (0, 0), -1e6, 1e6, "s", "First and last moment; equal: from the first key to the last.") \
  F(text, clip, NULL, 0, 0, "", "The clip that models play, of those they bring; none: their first.")
FIELD_STRUCT(Timeline, TIMELINE_FIELDS);

#define TRACK_FIELDS(F)                                                                                              \
  F(path, path, NULL, 0, 0, "", "The field that moves, as edits name it: `objects.ball.translate`, `camera.fov`, `sky.rotation`.") \
  F(keys, keys, 0, 0, 0, "", "Its values in time: a list of `{ \"time\": seconds, \"value\": as the field has it }`, in order.") \
  F(choice, easing, 1, 0, 0, "step|linear|smooth|cubic", "From key to key: jump, straight, slow at both ends, or one smooth curve through all (Catmull-Rom).") \
  F(choice, turn, 0, 0, 0, "angles|shortest", "Of `rotate`: move the three angles each by itself, or go round one axis by the shortest way (slerp).") \
  F(choice, before, 0, 0, 0, "hold|loop|ping_pong", "Before the first key.")                                          \
  F(choice, after, 0, 0, 0, "hold|loop|ping_pong", "After the last key.")
FIELD_STRUCT(TrackFields, TRACK_FIELDS);
typedef enum { EASING_STEP, EASING_LINEAR, EASING_SMOOTH, EASING_CUBIC } Easing;
typedef enum { TURN_ANGLES, TURN_SHORTEST } TrackTurn;
typedef enum { BEYOND_HOLD, BEYOND_LOOP, BEYOND_PING_PONG } Beyond;

typedef struct Track {
  const char *name; // may be NULL
  TrackFields fields;
  const struct TrackValues *values; // of the keys as the field holds them, in the arena; private to track.c
} Track;

// --- the scene ----------------------------------------------------------------------------------
typedef struct Scene Scene;
typedef struct SceneSource { // a file that a model was made of
  const char *file;          // relative to the model's folder where it can be
  bool is_content;           // its bytes matter; false: only whether it is there
  uint64_t hash;             // of its bytes; 0: it is missing
} SceneSource;

typedef struct Model { // a file that objects refer to
  const char *file;    // resolved path
  Scene *scene;        // owned
} Model;

struct Scene {
  Arena arena;         // owns all texts and slots
  const char *path;    // the file it came from; NULL if made by calls
  const char *root;    // the folder files must lie in, as loaded; NULL: the folder of path
  bool allow_outside;  // as loaded
  About about;
  RenderSettings render;
  WhittedSettings whitted;
  DevelopSettings develop;
  Sky sky;
  bool is_model;       // of a format that describes things, not pictures: no scene file
  bool has_sky, has_camera; // given, not defaulted
  Camera camera;
  ARRAY(Camera) cameras;
  ARRAY(NamedSky) skies;
  ARRAY(Cell) cells;
  ARRAY(Gate) gates;
  ARRAY(Texture) textures;
  ARRAY(Material) materials;
  ARRAY(Medium) media;
  ARRAY(Mesh) meshes;
  ARRAY(SceneVoxels) voxels;
  ARRAY(Model) models;
  ARRAY(Object) objects;
  ARRAY(Light) lights;
  Timeline timeline;
  ARRAY(Track) tracks; // "animation"
  struct Rig *rig;     // owned: what clips of a glTF file move; NULL: nothing
  bool has_time;       // scene_set_time() was called
  double time;         // s, the last it was called with
  uint32_t last_id;    // of an object
  ARRAY(SceneSource) sources; // what a cache beside the model has to watch; only when loaded with use_cache
  SharedFile *saved;   // a use of the saved model it came from, where its pictures lie; NULL: none
  bool wants_cache;    // such a cache is missing or stale
  Notes notes;         // what was ignored or repaired while loading
  struct SceneNames *names; // private, owned: finds elements by their names
};

Scene *scene_create(Err *err); // defaults everywhere
void scene_destroy(Scene *s);  // accepts NULL

// Each appends one with all defaults of its kind and returns its index, or -1 when memory is out.
// Names are copied; NULL is allowed for objects and lights. A taken name gets a number: "wood", "wood.2", ...
int32_t scene_add_texture(Scene *s, TextureKind kind, const char *name);
int32_t scene_add_material(Scene *s, MaterialKind kind, const char *name);
int32_t scene_add_medium(Scene *s, MediumKind kind, const char *name);
int32_t scene_add_object(Scene *s, ShapeKind kind, const char *name);
int32_t scene_add_light(Scene *s, LightKind kind, const char *name);
int32_t scene_add_camera(Scene *s, CameraKind kind, const char *name);
// Takes over one use of data. slots are set by the caller afterwards.
int32_t scene_add_mesh(Scene *s, const char *name, MeshData *data);

// Takes over one use of v->data, also when memory is out; the texts must lie in the scene's arena.
int32_t scene_add_voxels(Scene *s, const SceneVoxels *v);

int32_t scene_find_texture(const Scene *s, const char *name); // -1: none of that name
int32_t scene_find_material(const Scene *s, const char *name);

// The object's map to its parent, from matrix or from scale, rotate, translate.
Frame object_frame(const ObjectCommon *o);

// A .vox file as one grid, a new element of scene.voxels.
bool scene_load_voxels(Scene *s, const char *path, int32_t *voxels_i, Err *err);
// All objects of a scene in one grid, if all are voxels of one size on one lattice. NULL: they are not (err stays as it
// is), or there is no memory for it.
struct Voxels *scene_merge_voxels(const Scene *s, Err *err);
// Voxels with cells this many metres wide as a `.grid`, centred; colours are left out.
bool export_grid(const struct Voxels *v, double cell, const char *path, Err *err);
// Where a grid's first corner lies in the object's space; v may be NULL.
Vec3 voxels_origin(const ShapeVoxels *shape, const struct Voxels *v);

// How files are opened while loading.
typedef struct LoadOptions {
  bool allow_outside; // let files name files outside the folder of the main file
  const char *root;   // that folder; NULL: the folder of the file being loaded
  bool use_cache;     // take a model from the cache beside it, if there is one that fits (scene/cache.h)
  Jobs *jobs;         // to check saved models with; may be NULL
  const char *element; // the file is one of NoEucRT's elements of this kind: "portal", ...; NULL: it is not
  int depth;          // nesting of scenes in scenes, private
  const char *const *open_files; // the chain of files being loaded, `depth` of them, private
  int *nested_count;  // how many files scenes inside scenes have loaded so far, private
} LoadOptions;

// Loads any scene or model by its extension (or its first bytes where that is missing). A model becomes a scene
// with its own objects, materials, lights and cameras; has_camera and has_sky stay false if it has none.
Scene *scene_load(const char *path, const LoadOptions *options, Err *err);

// Where a file named in the scene (an image, a model) lies: relative to the scene's own file and inside its root.
// options NULL: as the scene was loaded. Nothing is opened; the file may be missing.
bool scene_file_path(const Scene *s, const char *file, const LoadOptions *options, Text *out, Err *err);

// Can every file the scene names be read, those of its models too? Reports the first that cannot.
bool scene_check_files(const Scene *s, Err *err);

// The scene as canonical JSON: only what differs from defaults, in a fixed order; reading it back and writing it
// again gives the same bytes. Meshes made by calls or importers are written out in full, without material slots.
// Fails for pictures that live inside a model file, and for numbers that are not finite.
bool scene_write(const Scene *s, Text *out, Err *err);

// The same into a file, whole or not at all; file names are made relative to it. Larger meshes and embedded pictures
// become files of their own in the folder NAME.data beside it, named after their content. An object with several
// materials becomes several objects; tangents and second texture coordinates of meshes are not kept.
bool scene_save(const Scene *s, const char *path, Err *err);

// A copy for being saved at path as one file: file names are made relative to it, and pictures outside its folder
// become embedded ones. Meshes and embedded pictures are shared with the scene, which must outlive the copy.
Scene *scene_move(const Scene *s, const char *path, Err *err);

// The importers: each appends to an empty scene. path is for messages and for finding neighbours.
bool import_obj(Scene *s, const char *path, const LoadOptions *options, Err *err);
bool import_gltf(Scene *s, const char *path, const LoadOptions *options, Err *err); // .gltf and .glb
bool import_ply(Scene *s, const char *path, const LoadOptions *options, Err *err);
bool import_stl(Scene *s, const char *path, const LoadOptions *options, Err *err);
bool import_rfm(Scene *s, const char *path, const LoadOptions *options, Err *err); // our own saved models
bool import_vox(Scene *s, const char *path, const LoadOptions *options, Err *err);
bool import_grid(Scene *s, const char *path, const LoadOptions *options, Err *err);
bool import_json(Scene *s, const char *path, const LoadOptions *options, Err *err); // our own scene file

#endif
