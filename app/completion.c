// `rayfold completion`: what lets a shell complete commands, options and their values, made from the tables of all
// commands. One function a shell; each walks the same tables.

#include "commands.h"
#include "library.h"
#include "output.h"

#include <string.h>

typedef void OptionVisit(const Command *c, const Option *o);

static void each_option(const Command *c, OptionVisit *visit)
{
  for (const Option *o = c->options; o->name; o++) visit(c, o);
  for (const Option *o = common_options; o->name; o++) visit(c, o);
}

static void print_choices(const char *choices, const char *between)
{
  char name[40];
  const char *gap = "";
  while (next_choice(&choices, name)) {
    printf("%s%s", gap, name);
    gap = between;
  }
}

static void print_commands(const char *between)
{
  for (const Command *const *c = commands; *c; c++) printf("%s%s", c == commands ? "" : between, (*c)->name);
}

// Text inside single quotes of a shell; `also` are further characters to escape with a backslash.
static void print_quoted(const char *text, const char *also)
{
  for (const char *c = text; *c; c++) {
    if (*c == '\'')
      fputs("'\\''", stdout);
    else if (strchr(also, *c))
      printf("\\%c", *c);
    else
      putchar(*c);
  }
}

// --- bash ------------------------------------------------------------------------------------------
static void bash_words(const Command *c, const Option *o)
{
  (void)c;
  if (o->letter) printf("-%c ", o->letter);
  printf("--%s ", o->name);
}

static void bash_value(const Command *c, const Option *o)
{
  (void)c;
  if (o->kind == OPTION_FLAG) return;
  fputs("      ", stdout);
  if (o->letter) printf("-%c|", o->letter);
  printf("--%s) ", o->name);
  if (o->kind == OPTION_CHOICE) {
    fputs("COMPREPLY=($(compgen -W '", stdout);
    print_choices(o->choices, " ");
    fputs("' -- \"$cur\")); ", stdout);
  }
  if (o->kind == OPTION_FILE) fputs("compopt -o filenames; COMPREPLY=($(compgen -f -- \"$cur\")); ", stdout);
  fputs("return ;;\n", stdout);
}

static void bash_operands(const Command *c)
{
  switch (c->operand_kind) {
  case OPERAND_NONE: return;
  case OPERAND_FILE: fputs("compopt -o filenames; COMPREPLY=($(compgen -f -- \"$cur\"))", stdout); return;
  case OPERAND_CHOICE:
    fputs("COMPREPLY=($(compgen -W '", stdout);
    print_choices(c->operand_choices, " ");
    break;
  case OPERAND_COMMAND:
    fputs("COMPREPLY=($(compgen -W '", stdout);
    print_commands(" ");
    break;
  }
  fputs("' -- \"$cur\"))", stdout);
}

static void print_bash(void)
{
  fputs("# Made by `rayfold completion bash`.\n_rayfold()\n{\n  local cur=${COMP_WORDS[COMP_CWORD]} "
        "prev=${COMP_WORDS[COMP_CWORD-1]}\n  COMPREPLY=()\n  if ((COMP_CWORD == 1)); then\n"
        "    COMPREPLY=($(compgen -W '",
        stdout);
  print_commands(" ");
  fputs(" --version --help' -- \"$cur\"))\n    return\n  fi\n  case ${COMP_WORDS[1]} in\n", stdout);
  for (const Command *const *c = commands; *c; c++) {
    printf("  %s)\n    case $prev in\n", (*c)->name);
    each_option(*c, bash_value);
    fputs("    esac\n    if [[ $cur == -* ]]; then COMPREPLY=($(compgen -W '", stdout);
    each_option(*c, bash_words);
    fputs("' -- \"$cur\"))\n    else ", stdout);
    if ((*c)->operand_kind == OPERAND_NONE) fputs(":", stdout);
    bash_operands(*c);
    fputs("; fi ;;\n", stdout);
  }
  fputs("  esac\n}\ncomplete -F _rayfold rayfold\n", stdout);
}

// --- zsh -------------------------------------------------------------------------------------------
static void zsh_option(const Command *c, const Option *o)
{
  (void)c;
  fputs(" \\\n      ", stdout);
  if (o->repeats) fputs("'*'", stdout);
  if (o->letter && o->kind != OPTION_FLAG)
    printf("{-%c+,--%s=}", o->letter, o->name);
  else if (o->letter)
    printf("{-%c,--%s}", o->letter, o->name);
  else
    printf("--%s%s", o->name, o->kind == OPTION_FLAG ? "" : "=");
  fputs("'[", stdout);
  print_quoted(o->sentence, "[]\\");
  fputs("]", stdout);
  if (o->kind != OPTION_FLAG) {
    fputs(":", stdout);
    print_quoted(o->argument, ":\\");
    fputs(o->kind == OPTION_FILE ? ":_files" : ":", stdout);
    if (o->kind == OPTION_CHOICE) {
      fputs("(", stdout);
      print_choices(o->choices, " ");
      fputs(")", stdout);
    }
  }
  fputs("'", stdout);
}

static void zsh_operands(const Command *c)
{
  switch (c->operand_kind) {
  case OPERAND_NONE: return;
  case OPERAND_FILE: fputs(" \\\n      '*:file:_files'", stdout); return;
  case OPERAND_CHOICE:
    fputs(" \\\n      '1:which:(", stdout);
    print_choices(c->operand_choices, " ");
    break;
  case OPERAND_COMMAND:
    fputs(" \\\n      '1:command:(", stdout);
    print_commands(" ");
    break;
  }
  fputs(")'", stdout);
}

static void print_zsh(void)
{
  fputs("#compdef rayfold\n# Made by `rayfold completion zsh`.\n_rayfold() {\n  if (( CURRENT == 2 )); then\n"
        "    local -a list=(\n",
        stdout);
  for (const Command *const *c = commands; *c; c++) {
    printf("      '%s:", (*c)->name);
    print_quoted((*c)->sentence, ":\\");
    fputs("'\n", stdout);
  }
  fputs("    )\n    _describe command list\n    return\n  fi\n  local command=$words[2]\n  shift words\n"
        "  (( CURRENT-- ))\n  case $command in\n",
        stdout);
  for (const Command *const *c = commands; *c; c++) {
    printf("    %s) _arguments -s", (*c)->name);
    each_option(*c, zsh_option);
    zsh_operands(*c);
    fputs(" ;;\n", stdout);
  }
  fputs("  esac\n}\nif [ \"$funcstack[1]\" = _rayfold ]; then _rayfold \"$@\"; else compdef _rayfold "
        "rayfold; fi\n",
        stdout);
}

// --- fish ------------------------------------------------------------------------------------------
static void fish_option(const Command *c, const Option *o)
{
  printf("complete -c rayfold -n '__fish_seen_subcommand_from %s' -l %s", c->name, o->name);
  if (o->letter) printf(" -s %c", o->letter);
  if (o->kind == OPTION_FILE)
    fputs(" -r -F", stdout);
  else if (o->kind != OPTION_FLAG)
    fputs(" -x", stdout);
  if (o->kind == OPTION_CHOICE) {
    fputs(" -a '", stdout);
    print_choices(o->choices, " ");
    fputs("'", stdout);
  }
  fputs(" -d '", stdout);
  for (const char *s = o->sentence; *s; s++) printf(*s == '\'' || *s == '\\' ? "\\%c" : "%c", *s);
  fputs("'\n", stdout);
}

static void print_fish(void)
{
  fputs("# Made by `rayfold completion fish`.\ncomplete -c rayfold -e\n", stdout);
  for (const Command *const *c = commands; *c; c++) {
    printf("complete -c rayfold -f -n __fish_use_subcommand -a %s -d \"%s\"\n", (*c)->name, (*c)->sentence);
    each_option(*c, fish_option);
    if ((*c)->operand_kind != OPERAND_CHOICE && (*c)->operand_kind != OPERAND_COMMAND) continue;
    printf("complete -c rayfold -f -n '__fish_seen_subcommand_from %s' -a '", (*c)->name);
    if ((*c)->operand_kind == OPERAND_CHOICE)
      print_choices((*c)->operand_choices, " ");
    else
      print_commands(" ");
    fputs("'\n", stdout);
  }
}

static ExitCode run_completion(const Args *args)
{
  static const struct {
    const char *shell;
    void (*print)(void);
  } shells[] = {{"bash", print_bash}, {"zsh", print_zsh}, {"fish", print_fish}};
  for (size_t i = 0; i < sizeof shells / sizeof *shells; i++) {
    if (strcmp(args->operands[0], shells[i].shell)) continue;
    shells[i].print();
    return stdout_finish("the completion");
  }
  return fail(EXIT_USAGE, "there is no completion for \"%s\"; it is one of bash, zsh, fish",
              args->operands[0]);
}

const Command command_completion = {
    .name = "completion",
    .sentence = "Print what lets a shell complete this program's command line.",
    .operands = "SHELL",
    .least = 1,
    .most = 1,
    .operand_kind = OPERAND_CHOICE,
    .operand_choices = "bash|zsh|fish",
    .usage = "",
    .text = "SHELL is bash, zsh or fish.",
    .example = "rayfold completion bash > ~/.local/share/bash-completion/completions/rayfold",
    .options = no_options,
    .run = run_completion,
};
