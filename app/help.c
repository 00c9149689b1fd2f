// `rayfold help`: the list of commands, or one command's page.

#include "commands.h"
#include "library.h"
#include "output.h"

static ExitCode run_help(const Args *args)
{
  if (!args->operand_count) {
    program_help(stdout);
    return stdout_finish("the help");
  }
  const Command *c = command_find(args->operands[0]);
  if (!c) return fail_unknown_command(args->operands[0]);
  command_help(stdout, c);
  return stdout_finish("the help");
}

const Command command_help_page = {
    .name = "help",
    .sentence = "Show what the commands are, or one command's options.",
    .operands = "[COMMAND]",
    .most = 1,
    .operand_kind = OPERAND_COMMAND,
    .usage = "",
    .example = "rayfold help render",
    .options = no_options,
    .run = run_help,
};
