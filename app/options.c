// See options.h. The forms are those of GNU: "--name value", "--name=value", "-o value", "-ovalue", and "--" ends
// the options. Names are never abbreviated, so that a new option cannot change what an old script means.

#include "options.h"

#include "nearest.h"

#include <assert.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>

const Option common_options[] = {
    {.name = "help", .letter = 'h', .kind = OPTION_FLAG, .sentence = "Print this page and do nothing else."},
    {0},
};

// --- finding ---------------------------------------------------------------------------------------
static const Option *find_in(const Option *table, const char *name, size_t length)
{
  for (const Option *o = table; o->name; o++)
    if (strlen(o->name) == length && !strncmp(o->name, name, length)) return o;
  return NULL;
}

static const Option *find_option(const Command *c, const char *name, size_t length)
{
  const Option *o = find_in(c->options, name, length);
  return o ? o : find_in(common_options, name, length);
}

static const Option *find_letter(const Command *c, char letter)
{
  for (const Option *o = c->options; o->name; o++)
    if (o->letter == letter) return o;
  for (const Option *o = common_options; o->name; o++)
    if (o->letter == letter) return o;
  return NULL;
}

static ExitCode fail_unknown(const Command *c, const char *arg, size_t length)
{
  char word[80], hint[160];
  snprintf(word, sizeof word, "%.*s", (int)(length < 78 ? length : 78), arg);
  Nearest n = nearest_begin(word + strspn(word, "-"));
  for (const Option *o = c->options; o->name; o++) nearest_try(&n, o->name);
  for (const Option *o = common_options; o->name; o++) nearest_try(&n, o->name);
  return fail(EXIT_USAGE, "%s has no option %s%s%s", c->name, word, nearest_hint(&n, "--", hint),
              *hint ? "" : "; `--help` lists them");
}

// --- values ----------------------------------------------------------------------------------------
bool read_integer(const char *text, long *out)
{
  char *end;
  const char *digits = text + (*text == '-');
  if (*digits < '0' || *digits > '9') return false;
  errno = 0;
  *out = strtol(text, &end, 10);
  return !*end && !errno;
}

bool read_real(const char *text, double *out)
{
  if (!*text || text[strspn(text, "+-.0123456789eE")]) return false; // no hex, no nan, no spaces
  char *end;
  errno = 0;
  *out = strtod(text, &end);
  return !*end && !errno;
}

bool next_choice(const char **rest, char out[40])
{
  if (!*rest || !**rest) return false;
  const size_t n = strcspn(*rest, "|");
  snprintf(out, 40, "%.*s", (int)n, *rest);
  *rest += n + ((*rest)[n] == '|');
  return true;
}

static ExitCode check_choice(const Option *o, const char *value)
{
  char name[40];
  for (const char *rest = o->choices; next_choice(&rest, name);)
    if (!strcmp(name, value)) return EXIT_DONE;
  return fail(EXIT_USAGE, "--%s %s: it is one of %s", o->name, value, o->choices);
}

static ExitCode check_range(const Option *o, const char *value, double number)
{
  if (o->low == o->high || (number >= o->low && number <= o->high)) return EXIT_DONE;
  return fail(EXIT_USAGE, "--%s %s: it is from %.10g to %.10g", o->name, value, o->low, o->high);
}

static ExitCode check_value(const Option *o, const char *value)
{
  long i;
  double r;
  switch (o->kind) {
  case OPTION_FLAG:
  case OPTION_TEXT: return EXIT_DONE;
  case OPTION_FILE:
    return *value ? EXIT_DONE : fail(EXIT_USAGE, "--%s needs the name of a file, not \"\"", o->name);
  case OPTION_CHOICE: return check_choice(o, value);
  case OPTION_INTEGER:
    if (!read_integer(value, &i)) return fail(EXIT_USAGE, "--%s %s: it is a whole number", o->name, value);
    return check_range(o, value, (double)i);
  case OPTION_REAL:
    if (!read_real(value, &r)) return fail(EXIT_USAGE, "--%s %s: it is a number", o->name, value);
    return check_range(o, value, r);
  }
  return EXIT_INTERNAL;
}

// --- parsing ---------------------------------------------------------------------------------------
typedef struct Reader {
  int i, argc;
  char **argv;
} Reader;

// The value stands behind the option in the same word, or is the next word.
static ExitCode take_value(Args *a, const Option *o, const char *attached, Reader *in)
{
  const char *value = attached;
  if (o->kind == OPTION_FLAG) {
    if (attached) return fail(EXIT_USAGE, "--%s takes no value", o->name);
  } else if (!value) {
    if (in->i + 1 >= in->argc || !strncmp(in->argv[in->i + 1], "--", 2))
      return fail(EXIT_USAGE, "--%s needs a value: --%s %s", o->name, o->name, o->argument);
    value = in->argv[++in->i];
  }
  if (!o->repeats && args_has(a, o->name))
    return fail(EXIT_USAGE, "--%s is given twice; one must go", o->name);
  const ExitCode code = value ? check_value(o, value) : EXIT_DONE;
  a->given[a->given_count++] = (Given){o, value};
  return code;
}

static ExitCode take_long(Args *a, const char *arg, Reader *in)
{
  const size_t length = strcspn(arg + 2, "=");
  const Option *o = find_option(a->command, arg + 2, length);
  if (!o) return fail_unknown(a->command, arg, length + 2);
  return take_value(a, o, arg[2 + length] == '=' ? arg + 3 + length : NULL, in);
}

static ExitCode take_short(Args *a, const char *arg, Reader *in)
{
  const Option *o = find_letter(a->command, arg[1]);
  if (!o) return fail_unknown(a->command, arg, strlen(arg));
  return take_value(a, o, arg[2] ? arg + 2 : NULL, in);
}

static ExitCode take_words(Args *a, Reader *in)
{
  bool options_ended = false;
  for (; in->i < in->argc; in->i++) {
    const char *arg = in->argv[in->i];
    ExitCode code = EXIT_DONE;
    if (options_ended || arg[0] != '-' || !arg[1])
      a->operands[a->operand_count++] = arg;
    else if (!strcmp(arg, "--"))
      options_ended = true;
    else
      code = arg[1] == '-' ? take_long(a, arg, in) : take_short(a, arg, in);
    if (code) return code;
  }
  return EXIT_DONE;
}

static ExitCode check_operands(const Args *a)
{
  const Command *c = a->command;
  if (args_has(a, "help")) return EXIT_DONE;
  if (a->operand_count < c->least)
    return fail(EXIT_USAGE, "%s needs %s; `rayfold %s --help` tells more", c->name, c->operands, c->name);
  if (a->operand_count > c->most && find_option(c, "output", 6))
    return fail(EXIT_USAGE, "%s: \"%s\" is one word too many; outputs are named by -o", c->name,
                a->operands[c->most]);
  if (a->operand_count > c->most)
    return fail(EXIT_USAGE, "%s: \"%s\" is one word too many; `rayfold %s --help` tells more", c->name,
                a->operands[c->most], c->name);
  return EXIT_DONE;
}

ExitCode args_parse(Args *a, const Command *command, int argc, char **argv)
{
  *a = (Args){.command = command};
  a->given = calloc((size_t)argc + 1, sizeof *a->given);
  a->operands = calloc((size_t)argc + 1, sizeof *a->operands);
  if (!a->given || !a->operands) return fail(EXIT_INTERNAL, "not enough memory to read the command line");
  Reader in = {.argc = argc, .argv = argv};
  const ExitCode code = take_words(a, &in);
  return code ? code : check_operands(a);
}

void args_finish(Args *a)
{
  free(a->given);
  free(a->operands);
  *a = (Args){0};
}

// --- asking ----------------------------------------------------------------------------------------
static const Given *last_given(const Args *a, const char *name)
{
  assert(find_option(a->command, name, strlen(name))); // a name that is in no table is a slip of ours
  for (size_t i = a->given_count; i-- > 0;)
    if (!strcmp(a->given[i].option->name, name)) return &a->given[i];
  return NULL;
}

bool args_know(const Args *a, const char *name)
{
  return find_option(a->command, name, strlen(name)) != NULL;
}

bool args_has(const Args *a, const char *name)
{
  return last_given(a, name) != NULL;
}

const char *args_text(const Args *a, const char *name)
{
  const Given *g = last_given(a, name);
  return g ? g->value : NULL;
}

long args_integer(const Args *a, const char *name, long otherwise)
{
  const char *text = args_text(a, name);
  if (text) read_integer(text, &otherwise);
  return otherwise;
}

double args_real(const Args *a, const char *name, double otherwise)
{
  const char *text = args_text(a, name);
  if (text) read_real(text, &otherwise);
  return otherwise;
}

const char *args_next(const Args *a, const char *name, size_t *i)
{
  while (*i < a->given_count) {
    const Given *g = &a->given[(*i)++];
    if (!strcmp(g->option->name, name)) return g->value;
  }
  return NULL;
}

// --- help ------------------------------------------------------------------------------------------
void print_wrapped(FILE *out, const char *text, int indent, int column)
{
  const int width = 78, first = column;
  while (*text) {
    const int n = (int)strcspn(text, " \n");
    if (column > indent && column + 1 + n > width) {
      fprintf(out, "\n%*s", indent, "");
      column = indent;
    } else if (column > first) {
      fputc(' ', out);
      column++;
    }
    fprintf(out, "%.*s", n, text);
    column += n;
    text += n;
    if (*text == '\n') {
      fprintf(out, "\n%*s", indent, "");
      column = indent;
      text++;
    }
    text += strspn(text, " ");
  }
  fputc('\n', out);
}

static void help_option(FILE *out, const Option *o)
{
  enum { COLUMN = 27 };
  char head[80], text[600];
  int n = o->letter ? snprintf(head, sizeof head, "  -%c, --%s", o->letter, o->name)
                    : snprintf(head, sizeof head, "      --%s", o->name);
  if (o->argument) n += snprintf(head + n, sizeof head - (size_t)n, " %s", o->argument);
  snprintf(text, sizeof text, "%s%s%s%s%s", o->sentence, o->repeats ? " May be repeated." : "",
           o->initial ? " [" : "", o->initial ? o->initial : "", o->initial ? "]" : "");
  if (n + 1 >= COLUMN)
    fprintf(out, "%s\n%*s", head, COLUMN, "");
  else
    fprintf(out, "%-*s", COLUMN, head);
  print_wrapped(out, text, COLUMN, COLUMN);
}

void command_help(FILE *out, const Command *c)
{
  fprintf(out, "Usage: rayfold %s%s%s%s%s\n\n", c->name, *c->operands ? " " : "", c->operands,
          *c->usage ? " " : "", c->usage);
  print_wrapped(out, c->sentence, 0, 0);
  fputs("\nOptions (in brackets: what holds without them):\n", out);
  for (const Option *o = c->options; o->name; o++) help_option(out, o);
  for (const Option *o = common_options; o->name; o++) help_option(out, o);
  if (c->text) {
    fputc('\n', out);
    print_wrapped(out, c->text, 0, 0);
  }
  if (c->example) fprintf(out, "\nExample:\n  %s\n", c->example);
}
