// Library: the steps that several commands take with librayfold, each saying what went wrong, and the options that
// belong to them.

#ifndef RAYFOLD_APP_LIBRARY_H
#define RAYFOLD_APP_LIBRARY_H

#include "options.h"

#define OPTION_ALLOW_OUTSIDE                                                                  \
  {                                                                                           \
    .name = "allow-outside", .kind = OPTION_FLAG,                                             \
    .sentence = "Let the scene name files outside its own folder. Only for scenes you trust." \
  }
#define OPTION_QUIET(what)                                                \
  {                                                                       \
    .name = "quiet", .letter = 'q', .kind = OPTION_FLAG, .sentence = what \
  }

// Extensions of what scene_open() takes, as output_is_any() wants them.
#define SCENE_INPUTS ".json|.obj|.gltf|.glb|.ply|.stl|.vox|.grid|.nvdb|.rfm"

#define OPTION_CACHE                                                                             \
  {                                                                                              \
    .name = "cache", .kind = OPTION_FLAG,                                                        \
    .sentence = "Keep each model with its trees beside it, as bunny.obj.rfm, and open that the " \
                "next time. One that no longer fits the model is written anew."                  \
  }

// A command without options of its own.
extern const Option no_options[];

// Opens as --allow-outside and, where the command has it, --cache say.
// threads 0 and isa NULL: the library chooses. A wrong isa is the user's fault: EXIT_USAGE.
ExitCode engine_open(rf_engine **engine, int threads, const char *isa);
ExitCode scene_open(rf_scene **scene, rf_engine *engine, const char *path, const Args *args);

// Does this integrator make pictures of light, which the scene's develop is for, rather than of numbers?
bool integrator_is_light(const char *name);

// "text" in quotes, as JSON writes it.
void json_print_text(FILE *out, const char *text);

double seconds_now(void); // a clock that never jumps

#endif
