// Commands: the list of all commands, each defined in the file of its name.

#ifndef RAYFOLD_APP_COMMANDS_H
#define RAYFOLD_APP_COMMANDS_H

#include "options.h"

extern const Command command_render, command_view, command_merge, command_compare, command_info, command_validate, command_convert,
    command_prove, command_locks, command_schema, command_trace, command_bench, command_manual, command_man, command_completion,
    command_help_page;

extern const Command *const commands[]; // as help lists them; ends with NULL

const Command *command_find(const char *name);
ExitCode fail_unknown_command(const char *name);
void program_help(FILE *out);
// "0.1.0" of the library in use.
const char *program_version(char out[32]);

#endif
