// `rayfold man`: the manual page rayfold.1, made from the tables of all commands. The macros are those of man(7).

#include "commands.h"
#include "library.h"
#include "output.h"

#include <string.h>

// Of the interface that the page describes. The day of the build would make two builds differ.
static const char page_date[] = "2026-11-24";

// A text in roff: hyphens that must stay hyphens, backslashes, and no control character at the start of a line.
static void print_text(const char *text, bool is_literal)
{
  int column = 0;
  for (const char *c = text; *c; c++) {
    const int word = (int)strcspn(c, " \n");
    if (*c == '\n') {
      fputs("\n.PP\n", stdout);
      column = 0;
      continue;
    }
    // Words go to a new line where the source line would grow long; roff fills lines itself.
    if (*c == ' ' && !is_literal && column + (int)strcspn(c + 1, " \n") > 76) {
      putchar('\n');
      column = 0;
      continue;
    }
    if (column == 0 && word > 0 && (*c == '.' || *c == '\'')) fputs("\\&", stdout);
    if (*c == '\\')
      fputs("\\e", stdout);
    else if (*c == '-' &&
             (is_literal || c[1] == '-' || (c > text && c[-1] == '-') || c == text || c[-1] == ' '))
      fputs("\\-", stdout);
    else
      putchar(*c);
    column++;
  }
}

static void print_option(const Option *o)
{
  fputs(".TP\n.B ", stdout);
  if (o->letter) printf("\\-%c\\fR, \\fB", o->letter);
  fputs("\\-\\-", stdout);
  print_text(o->name, true);
  if (o->argument) printf(" \\fI%s\\fR", o->argument);
  putchar('\n');
  print_text(o->sentence, false);
  if (o->repeats) fputs("\nMay be repeated.", stdout);
  if (o->initial) {
    fputs("\nDefault: ", stdout);
    print_text(o->initial, false);
    putchar('.');
  }
  putchar('\n');
}

static void print_command(const Command *c)
{
  printf(".SS rayfold %s\n.B rayfold %s", c->name, c->name);
  if (*c->operands) printf(" \\fI%s\\fR", c->operands);
  if (*c->usage) {
    putchar(' ');
    fputs("\\fR", stdout);
    print_text(c->usage, true);
  }
  fputs("\n.PP\n", stdout);
  print_text(c->sentence, false);
  if (c->text) {
    fputs("\n.PP\n", stdout);
    print_text(c->text, false);
  }
  putchar('\n');
  for (const Option *o = c->options; o->name; o++) print_option(o);
  if (!c->example) return;
  fputs(".PP\nExample:\n.PP\n.RS\n.nf\n", stdout);
  print_text(c->example, true);
  fputs("\n.fi\n.RE\n", stdout);
}

static void print_head(void)
{
  char version[32];
  printf(".\\\" Made by `rayfold man` from the tables of the program.\n.TH RAYFOLD 1 %s \"rayfold %s\" "
         "\"User Commands\"\n",
         page_date, program_version(version));
  fputs(".SH NAME\nrayfold \\- a ray tracer\n.SH SYNOPSIS\n.B rayfold\n.I COMMAND\n.RI [ OPERAND ]...\n"
        ".RI [ OPTION ]...\n.br\n.B rayfold \\-\\-version\n.SH DESCRIPTION\n"
        ".B rayfold\nrenders scenes and models into pictures, without a GPU.\n"
        "The same scene and settings give the same picture on any number of threads\n"
        "and on every instruction set.\n.PP\n.B rayfold \\-\\-version\n"
        "prints the version and what this build can read and write.\n",
        stdout);
}

static ExitCode run_man(const Args *args)
{
  (void)args;
  print_head();
  fputs(".SH COMMANDS\nEvery command takes these:\n", stdout);
  for (const Option *o = common_options; o->name; o++) print_option(o);
  for (const Command *const *c = commands; *c; c++) print_command(*c);
  fputs(".SH EXIT STATUS\n", stdout);
  for (const ExitMeaning *m = exit_meanings; m->sentence; m++) {
    printf(".TP\n.B %d\n", m->code);
    print_text(m->sentence, false);
    putchar('\n');
  }
  fputs(".SH ENVIRONMENT\n.TP\n.B NO_COLOR\nIf set and not empty, the progress bar has no colour.\n"
        ".TP\n.B RTB_CPU\nIf set,\n.B rayfold trace\nmeasures processor time instead of wall time.\n",
        stdout);
  return stdout_finish("the manual page");
}

const Command command_man = {
    .name = "man",
    .sentence = "Print this program's manual page, in roff.",
    .operands = "",
    .usage = "",
    .example = "rayfold man | man -l -",
    .options = no_options,
    .run = run_man,
};
