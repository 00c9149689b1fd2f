// What a mix of materials must not do: hold itself, by whatever way around, or nest deeper than shading goes.

#ifndef RAYFOLD_SCENE_MIX_CHECK_H
#define RAYFOLD_SCENE_MIX_CHECK_H

#include "scene/scene.h"

enum { MIX_DEEPEST = 4 }; // mixes in one another

// Looks at all mixes of the scene in their order, with `changed` in place of material changed_i (or behind the last) if
// it is not NULL. *material_i and *field: the one at fault and the name of its field that leads there; may be NULL.
bool mix_check(const Scene *s, const Material *changed, int32_t changed_i, int32_t *material_i, const char **field,
               Err *err);

#endif
