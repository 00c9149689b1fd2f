// Stage: a photographer's table for a bare model. A file that brings neither camera nor light is shown on a floor, lit
// by two soft boxes, by an eye that just sees all of it. It is put up by ordinary edits, so `--set` reaches each part.

#ifndef RAYFOLD_APP_STAGE_H
#define RAYFOLD_APP_STAGE_H

#include "library.h"

// Has the scene just loaded from path neither a camera nor a light of its own?
bool stage_is_wanted(rf_engine *engine, rf_scene *scene);

// Stands the model upright if its format usually lays it down, and says so unless quiet. Before any other edit.
void stage_turn(rf_engine *engine, rf_scene *scene, const char *path, bool is_quiet);

// Puts it up around the model, of which `model` is the world: camera, sky, lights.stage_key and lights.stage_rim, and
// objects.stage_floor unless the picture is a debug view or has a transparent background. aspect: of the picture.
ExitCode stage_build(rf_engine *engine, rf_scene *scene, const rf_world *model, float aspect);

// Gives a scene without a camera the one it is seen by now, so that it stands still while things move.
ExitCode stage_hold_camera(rf_engine *engine, rf_scene *scene, const rf_eye *eye);

// Is this the path of something that stage_build() makes? Edits of it come after.
bool stage_owns(const char *path);

#endif
