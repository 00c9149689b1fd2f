// Voxels as a scene has them: the field tables of palettes and of the steps that fill grids. Part of scene.h.

#ifndef RAYFOLD_SCENE_VOXEL_KINDS_H
#define RAYFOLD_SCENE_VOXEL_KINDS_H

#include "scene/field.h"

// An entry of a palette.
#define VOXEL_FIELDS(F)                                                                                               \
  F(color, color, (0.8, 0.8, 0.8), 0, 1, "", "Its colour.")                                                           \
  F(real,  roughness, 0.9, 0, 1, "", "0 is polished.")                                                                \
  F(real,  metallic, 0, 0, 1, "", "0 a dielectric, 1 a metal.")                                                       \
  F(real,  emission, 0, 0, NO_LIMIT, "W/m2sr", "Radiance is color times this; such voxels are lights.")               \
  F(real,  transmission, 0, 0, 1, "", "Above 0 it lets light through: glass, and between equal ones there is no wall.") \
  F(real,  ior, 1.5, 1, 5, "", "Index of refraction.")                                                                \
  F(text,  material, NULL, 0, 0, "", "Name of a material of the scene, instead of these numbers; color multiplies its own.")
FIELD_STRUCT(VoxelFields, VOXEL_FIELDS);

// A step of a program that fills a grid, and an edit of one. Places count in voxels from the grid's first corner.
#define VOXEL_STEP_FIELDS(F)                                                                                          \
  F(text,    voxel, NULL, 0, 0, "", "Name of an entry of the palette; none: a plain one of this `color`.")            \
  F(color,   color, (0.8, 0.8, 0.8), 0, 1, "", "Without `voxel`.")                                                    \
  F(choice,  mode, 0, 0, 0, "set|add|paint|erase", "Fill all cells, only empty ones, only filled ones, or empty them.") \
  F(real,    randomness, 0, 0, 1, "", "How far colours differ from cell to cell: 1 is half of the range up and down.") \
  F(integer, seed, 0, 0, 2147483647, "", "Another seed, other colours.")                                              \
  F(integer, repeat, 1, 1, 4096, "", "How often, each time moved on by `offset`.")                                    \
  F(vec3,    offset, (0, 0, 0), -4096, 4096, "voxels", "From one to the next.")
#define VOXEL_BOX_FIELDS(F)                                                                                           \
  F(vec3,    corner, (0, 0, 0), -4096, 4096, "voxels", "Its lowest corner.")                                          \
  F(vec3,    size, (1, 1, 1), 0, 4096, "voxels", "Along x, y and z.")                                                 \
  F(real,    hollow, 0, 0, 4096, "voxels", "Above 0 only a skin this thick.")
#define VOXEL_SPHERE_FIELDS(F)                                                                                        \
  F(vec3,    center, (0, 0, 0), -4096, 8192, "voxels", "The middle of the first cell is 0.5.")                        \
  F(real,    radius, 1, 0, 8192, "voxels", "Cells are in it by their middles.")                                       \
  F(real,    hollow, 0, 0, 4096, "voxels", "Above 0 only a skin this thick.")
#define VOXEL_LINE_FIELDS(F)                                                                                          \
  F(vec3,    from, (0, 0, 0), -4096, 8192, "voxels", "One end.")                                                      \
  F(vec3,    to, (0, 0, 0), -4096, 8192, "voxels", "The other.")                                                      \
  F(real,    radius, 0.87, 0, 4096, "voxels", "Of the round line; 0.87 and above has no gaps.")
#define VOXEL_CYLINDER_FIELDS(F)                                                                                      \
  F(vec3,    base, (0, 0, 0), -4096, 8192, "voxels", "The middle of its bottom.")                                     \
  F(real,    radius, 1, 0, 4096, "voxels", "Of the bottom.")                                                          \
  F(real,    top_radius, -1, -1, 4096, "voxels", "Of the top; below 0 the same, 0 a cone.")                           \
  F(real,    height, 1, 0, 4096, "voxels", "Upwards, along y.")                                                       \
  F(real,    hollow, 0, 0, 4096, "voxels", "Above 0 only a wall this thick, open above and below.")
#define VOXEL_HILLS_FIELDS(F)                                                                                         \
  F(vec3,    corner, (0, 0, 0), -4096, 4096, "voxels", "Its lowest corner.")                                          \
  F(vec3,    size, (1, 1, 1), 0, 4096, "voxels", "Along x and z, and the height of the highest.")                     \
  F(real,    lump, 32, 1, 4096, "voxels", "Width of the largest hills.")                                              \
  F(integer, octaves, 4, 1, 12, "", "Sizes of hills, each half the one before.")
#define VOXEL_HEIGHTS_FIELDS(F)                                                                                       \
  F(file,    file, NULL, 0, 0, "", "A picture: black is no height, white is all of size.y; its bottom row lies at the highest z.") \
  F(vec3,    corner, (0, 0, 0), -4096, 4096, "voxels", "The lowest corner of what it makes.")                         \
  F(vec3,    size, (64, 32, 64), 1, 4096, "voxels", "Along x, the height, and along z.")                              \
  F(flag,    colored, 0, 0, 1, "", "Colour columns as the picture is, and take the mean of its channels for the height.")
#define VOXEL_FLOOD_FIELDS(F)                                                                                         \
  F(vec3,    at, (0, 0, 0), 0, 4095, "voxels", "A cell: all of the same entry that hang together with it by their sides.")
#define VOXEL_EXTRUDE_FIELDS(F)                                                                                       \
  F(vec3,    at, (0, 0, 0), 0, 4095, "voxels", "A cell: its side, and those beside it in the same plane and of the same entry.") \
  F(choice,  face, 3, 0, 0, "-x|+x|-y|+y|-z|+z", "Which side.")                                                       \
  F(integer, amount, 1, -4096, 4096, "voxels", "How far out; below 0 it is cut in.")
#define VOXEL_REPLACE_FIELDS(F)                                                                                       \
  F(text,    what, NULL, 0, 0, "", "Cells of this entry of the palette; none: of `what_color`, or all that are filled.") \
  F(color,   what_color, (-1, -1, -1), -1, 1, "", "Cells of this colour, of any entry.")
FIELD_STRUCT(VoxelStepFields, VOXEL_STEP_FIELDS);
FIELD_STRUCT(VoxelBox, VOXEL_BOX_FIELDS);
FIELD_STRUCT(VoxelSphere, VOXEL_SPHERE_FIELDS);
FIELD_STRUCT(VoxelStroke, VOXEL_LINE_FIELDS);
FIELD_STRUCT(VoxelCylinder, VOXEL_CYLINDER_FIELDS);
FIELD_STRUCT(VoxelHills, VOXEL_HILLS_FIELDS);
FIELD_STRUCT(VoxelHeights, VOXEL_HEIGHTS_FIELDS);
FIELD_STRUCT(VoxelFlood, VOXEL_FLOOD_FIELDS);
FIELD_STRUCT(VoxelExtrude, VOXEL_EXTRUDE_FIELDS);
FIELD_STRUCT(VoxelReplace, VOXEL_REPLACE_FIELDS);
typedef enum { VOXEL_SET, VOXEL_ADD, VOXEL_PAINT, VOXEL_ERASE } VoxelMode;

typedef enum VoxelStepKind { STEP_BOX, STEP_SPHERE, STEP_LINE, STEP_CYLINDER, STEP_HILLS, STEP_HEIGHTS, STEP_FLOOD,
                             STEP_EXTRUDE, STEP_REPLACE } VoxelStepKind;
typedef struct VoxelStep {
  int32_t kind; // VoxelStepKind
  VoxelStepFields common;
  union {
    VoxelBox box;
    VoxelSphere sphere;
    VoxelStroke line;
    VoxelCylinder cylinder;
    VoxelHills hills;
    VoxelHeights heights;
    VoxelFlood flood;
    VoxelExtrude extrude;
    VoxelReplace replace;
  };
} VoxelStep;

// Voxels of the scene, one for each state that an object's had, so that undo finds the last: they share what is the same.
// What they were made of is kept as the text that makes them again.
typedef struct VoxelText {
  const char *json;               // a step, in the arena
  const struct VoxelText *before; // the step before it; NULL: it is the first
} VoxelText;
typedef struct SceneVoxels {
  struct Voxels *data;     // shared; image/voxels.h
  const char *head;        // ,"size":...,"palette":... as it stood in the file, in the arena; NULL: nothing
  const VoxelText *steps;  // the last one; NULL: none
  bool is_program;         // head, steps and the shape's file say all; false: the cells must be written out
} SceneVoxels;

#endif
