// Voxel steps: what fills and edits grids. A scene file's program is a list of them, a stroke of a brush is one, and the
// text of all that were done is what saves a grid again.

#ifndef RAYFOLD_SCENE_VOXEL_STEP_H
#define RAYFOLD_SCENE_VOXEL_STEP_H

#include "image/voxels.h"
#include "scene/scene.h"

// Does the step. Cells outside the grid are left alone; a step that lies outside altogether is refused, since nobody can
// mean it. scene and options say where a picture lies. On failure the edit is half done and of no use.
bool voxel_step_apply(VoxelEdit *e, const VoxelStep *step, const Scene *scene, const LoadOptions *options, Err *err);

#endif
