// `rayfold validate`: loads each scene and every file it names, and says what is wrong. It renders nothing.

#include "commands.h"
#include "library.h"
#include "output.h"

#include <limits.h>

static const Option validate_options[] = {
    OPTION_ALLOW_OUTSIDE, OPTION_QUIET("No notes, and no line for good scenes."), {0}};

static ExitCode validate_one(rf_engine *engine, const char *path, const Args *args)
{
  rf_scene *scene = NULL;
  const bool is_quiet = args_has(args, "quiet");
  ExitCode code = scene_open(&scene, engine, path, args);
  if (!code && !is_quiet) say_notes(scene);
  if (!code && !rf_scene_check(scene)) code = fail_library(engine);
  if (!code && !is_quiet) {
    printf("%s: ok\n", path);
    code = stdout_finish("the result");
  }
  rf_scene_destroy(scene);
  return code;
}

// All are looked at; the first failure is the answer.
static ExitCode run_validate(const Args *args)
{
  rf_engine *engine = NULL;
  ExitCode first = engine_open(&engine, 0, NULL);
  if (first) return first;
  for (size_t i = 0; i < args->operand_count; i++) {
    const ExitCode code = validate_one(engine, args->operands[i], args);
    if (!first) first = code;
  }
  rf_engine_destroy(engine);
  return first;
}

const Command command_validate = {
    .name = "validate",
    .sentence = "Check scenes and every file they name.",
    .operands = "SCENE...",
    .least = 1,
    .most = INT_MAX,
    .operand_kind = OPERAND_FILE,
    .usage = "[OPTION]...",
    .text = "Prints \"SCENE: ok\" for each good one, and for a bad one the place and the reason. All are "
            "looked at; "
            "the exit code is that of the first bad one.",
    .example = "rayfold validate scenes/*.json",
    .options = validate_options,
    .run = run_validate,
};
