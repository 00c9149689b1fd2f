// `rayfold manual`: the reference of the scene file, made from the field tables.

#include "commands.h"
#include "library.h"
#include "output.h"

static ExitCode run_manual(const Args *args)
{
  (void)args;
  rf_engine *engine = NULL;
  ExitCode code = engine_open(&engine, 1, NULL);
  if (!code) code = stdout_library_text(engine, rf_manual(engine), "the manual");
  rf_engine_destroy(engine);
  return code;
}

const Command command_manual = {
    .name = "manual",
    .sentence = "Print the reference of the scene file, in Markdown.",
    .operands = "",
    .usage = "",
    .example = "rayfold manual > manual.md",
    .options = no_options,
    .run = run_manual,
};
