// `rayfold schema`: the schema of the scene file, made from the field tables.

#include "commands.h"
#include "library.h"
#include "output.h"

static ExitCode run_schema(const Args *args)
{
  (void)args;
  rf_engine *engine = NULL;
  ExitCode code = engine_open(&engine, 1, NULL);
  if (!code) code = stdout_library_text(engine, rf_schema(engine), "the schema");
  rf_engine_destroy(engine);
  return code;
}

const Command command_schema = {
    .name = "schema",
    .sentence = "Print the scene file's JSON Schema (draft 2020-12), for editors.",
    .operands = "",
    .usage = "",
    .example = "rayfold schema > rayfold.schema.json",
    .options = no_options,
    .run = run_schema,
};
