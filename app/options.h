// Options: the one table per command from which everything about its command line comes: parsing, `--help`, the man
// page and shell completion. A command's own file holds its table; this file reads tables and knows no command.

#ifndef RAYFOLD_APP_OPTIONS_H
#define RAYFOLD_APP_OPTIONS_H

#include "say.h"

#include <stdbool.h>
#include <stdio.h>

typedef enum OptionKind {
  OPTION_FLAG,
  OPTION_TEXT,
  OPTION_INTEGER, // low..high, both 0: whatever path takes
  OPTION_REAL,    // the same
  OPTION_CHOICE,  // one of choices
  OPTION_FILE,
} OptionKind;

typedef struct Option {
  const char *name; // without the dashes
  char letter;      // of the short form; 0: none
  OptionKind kind;
  const char *argument; // as help shows it, "WxH"; NULL for a flag
  const char *initial;  // what holds without the option, as help shows it; NULL for a flag that is off
  const char *sentence;
  const char *choices; // "a|b|c"
  double low, high;
  const char *path; // the scene's field that it sets; its range is that of the field
  bool repeats;
} Option;

typedef struct Args Args;
typedef ExitCode CommandRun(const Args *args);

typedef enum OperandKind { OPERAND_NONE, OPERAND_FILE, OPERAND_CHOICE, OPERAND_COMMAND } OperandKind;

typedef struct Command {
  const char *name, *sentence;
  const char *operands; // as usage shows them, "IN OUT"; "" for none
  size_t least, most;   // how many of them
  OperandKind operand_kind;
  const char *operand_choices; // "a|b|c"
  const char *usage;           // the options that matter most, as usage shows them
  const char *text;            // more about it, paragraphs divided by newlines; may be NULL
  const char *example;         // a line to try
  const Option *options;       // ends with a NULL name
  CommandRun *run;
} Command;

extern const Option common_options[]; // every command has them; ends with a NULL name

typedef struct Given {
  const Option *option;
  const char *value; // NULL for a flag
} Given;

struct Args {
  const Command *command;
  Given *given; // in the order of the command line
  size_t given_count;
  const char **operands;
  size_t operand_count;
};

// Reads argv (without the program and the command) by the command's table. Says what is wrong, EXIT_USAGE.
ExitCode args_parse(Args *a, const Command *command, int argc, char **argv);
void args_finish(Args *a);

// Is it in the command's table? Only such may be asked for below.
bool args_know(const Args *a, const char *name);
// What was given for an option of the command's table; of a repeated one, the last.
bool args_has(const Args *a, const char *name);
const char *args_text(const Args *a, const char *name); // NULL: not given
long args_integer(const Args *a, const char *name, long otherwise);
double args_real(const Args *a, const char *name, double otherwise);
// The values of one that repeats: start with *i = 0; NULL past the last.
const char *args_next(const Args *a, const char *name, size_t *i);

// Whole decimal numbers and nothing behind them.
bool read_integer(const char *text, long *out);
bool read_real(const char *text, double *out);

// Walks "a|b|c": copies the next name to out, false past the last. Start with *rest = choices.
bool next_choice(const char **rest, char out[40]);

// The page `rayfold COMMAND --help` prints.
void command_help(FILE *out, const Command *c);
// Text broken between words at 78 columns, each line indented; starts at the given column.
void print_wrapped(FILE *out, const char *text, int indent, int column);

#endif
