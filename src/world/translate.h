// Materials in the words of other programs, translated into those of pbr by fixed formulas. Pure functions of the
// scene's fields; textures of the same meaning are handed on.

#ifndef RAYFOLD_WORLD_TRANSLATE_H
#define RAYFOLD_WORLD_TRANSLATE_H

#include "scene/scene.h"

// Blender's Principled BSDF (version 1, up to Blender 3.6).
Pbr pbr_of_principled(const Principled *m);

// The first studio's sliders. Each is monotone over 0..1 in what it is for, and no place of the cube gains energy.
Pbr pbr_of_studio(const Studio *m);

#endif
