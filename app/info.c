// `rayfold info`: what is in a scene, for people.

#include "commands.h"
#include "library.h"
#include "output.h"

static const Option info_options[] = {OPTION_ALLOW_OUTSIDE, OPTION_QUIET("No notes."), {0}};

static ExitCode run_info(const Args *args)
{
  rf_engine *engine = NULL;
  rf_scene *scene = NULL;
  ExitCode code = engine_open(&engine, 1, NULL);
  if (!code) code = scene_open(&scene, engine, args->operands[0], args);
  if (!code && !args_has(args, "quiet")) say_notes(scene);
  if (!code) code = stdout_library_text(engine, rf_scene_info(scene), "the summary");
  rf_scene_destroy(scene);
  rf_engine_destroy(engine);
  return code;
}

const Command command_info = {
    .name = "info",
    .sentence = "Tell what is in a scene or model.",
    .operands = "SCENE",
    .least = 1,
    .most = 1,
    .operand_kind = OPERAND_FILE,
    .usage = "[OPTION]...",
    .example = "rayfold info scenes/cornell.json",
    .options = info_options,
    .run = run_info,
};
