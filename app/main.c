// The program: reads the command's name, hands the rest to it, and leaves with its exit code. `rayfold --version`
// and the list of commands are here; everything else is in the file of the command's name.

#include "commands.h"
#include "library.h"
#include "nearest.h"
#include "output.h"
#include "signals.h"

#include <locale.h>
#include <string.h>

const Command *const commands[] = {
    &command_render,
    &command_view,
    &command_merge,
    &command_compare,
    &command_info,
    &command_validate,
    &command_convert,
    &command_prove,
    &command_locks,
    &command_schema,
    &command_trace,
    &command_bench,
    &command_manual,
    &command_man,
    &command_completion,
    &command_help_page,
    NULL,
};

const Command *command_find(const char *name)
{
  for (const Command *const *c = commands; *c; c++)
    if (!strcmp((*c)->name, name)) return *c;
  return NULL;
}

ExitCode fail_unknown_command(const char *name)
{
  char hint[160];
  Nearest n = nearest_begin(name);
  for (const Command *const *c = commands; *c; c++) nearest_try(&n, (*c)->name);
  nearest_hint(&n, "", hint);
  if (output_is_any(name, SCENE_INPUTS))
    return fail(EXIT_USAGE, "first comes what to do with it: `rayfold render %s -o picture.png`", name);
  return fail(EXIT_USAGE, "there is no command \"%s\"%s", name, *hint ? hint : "; `rayfold help` lists them");
}

void program_help(FILE *out)
{
  fputs("Usage: rayfold COMMAND [OPERAND]... [OPTION]...\n       rayfold --version\n\nCommands:\n", out);
  for (const Command *const *c = commands; *c; c++) {
    fprintf(out, "  %-12s", (*c)->name);
    print_wrapped(out, (*c)->sentence, 14, 14);
  }
  fputs("\n`rayfold COMMAND --help` shows every option with its default.\n\nExit codes:\n", out);
  for (const ExitMeaning *m = exit_meanings; m->sentence; m++) {
    fprintf(out, "  %-4d", m->code);
    print_wrapped(out, m->sentence, 6, 6);
  }
  fputs("\nExample:\n  rayfold render scenes/cornell.json -o cornell.png\n", out);
}

const char *program_version(char out[32])
{
  const int v = rf_version();
  snprintf(out, 32, "%d.%d.%d", v / 10000, v / 100 % 100, v % 100);
  return out;
}

static ExitCode print_version(void)
{
  char version[32];
  const char *features = rf_features();
  const size_t n = strlen(features);
  printf("rayfold %s\n%s%s", program_version(version), features, n && features[n - 1] != '\n' ? "\n" : "");
#if RAYFOLD_HAVE_SDL
  puts("windows: SDL 2");
#else
  puts("windows: not in this build (install libsdl2-dev and build again)");
#endif
#if RAYFOLD_HAVE_STB_TRUETYPE
  puts("text in windows: stb_truetype");
#else
  puts("text in windows: not in this build (install libstb-dev and build again)");
#endif
  return stdout_finish("the version");
}

static ExitCode run_command(const Command *c, int argc, char **argv)
{
  Args args;
  ExitCode code = args_parse(&args, c, argc, argv);
  if (!code && args_has(&args, "help")) {
    command_help(stdout, c);
    code = stdout_finish("the help");
  } else if (!code)
    code = c->run(&args);
  args_finish(&args);
  return code;
}

static bool is_any(const char *word, const char *a, const char *b)
{
  return !strcmp(word, a) || !strcmp(word, b);
}

int main(int argc, char **argv)
{
  stdio_guard();
  signals_ignore_broken_outputs();
  setlocale(LC_CTYPE, ""); // only to know whether the terminal shows UTF-8; numbers stay as C writes them
  if (argc < 2) {
    program_help(stderr);
    return EXIT_USAGE;
  }
  if (is_any(argv[1], "--version", "-V")) return print_version();
  if (is_any(argv[1], "--help", "-h")) {
    program_help(stdout);
    return stdout_finish("the help");
  }
  const Command *c = command_find(argv[1]);
  return c ? run_command(c, argc - 2, argv + 2) : fail_unknown_command(argv[1]);
}
