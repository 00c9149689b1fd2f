// See say.h.

#include "say.h"

#include <stdarg.h>
#include <stdio.h>

const ExitMeaning exit_meanings[] = {
    {EXIT_DONE, "Done."},
    {EXIT_USAGE, "The command line is wrong."},
    {EXIT_BAD_SCENE, "A scene, model or picture is broken."},
    {EXIT_NO_INPUT, "An input is missing or cannot be read."},
    {EXIT_INTERNAL, "A fault of the program itself, or not enough memory."},
    {EXIT_NO_OUTPUT, "An output cannot be written."},
    {EXIT_STOPPED, "Stopped by a signal before it was done; what was finished is saved. Run it again."},
    {EXIT_DONE, NULL},
};

static void say_args(const char *format, va_list args)
{
  fputs("rayfold: ", stderr);
  vfprintf(stderr, format, args);
  fputc('\n', stderr);
}

void say(const char *format, ...)
{
  va_list args;
  va_start(args, format);
  say_args(format, args);
  va_end(args);
}

ExitCode fail(ExitCode code, const char *format, ...)
{
  va_list args;
  va_start(args, format);
  say_args(format, args);
  va_end(args);
  return code;
}

static ExitCode exit_of_status(rf_status status)
{
  switch (status) {
  case RF_OK:
  case RF_BAD_ARGUMENT: // the arguments are this program's, checked before the call
  case RF_NO_MEMORY: return EXIT_INTERNAL;
  case RF_BAD_SCENE: return EXIT_BAD_SCENE;
  case RF_NOT_FOUND: return EXIT_NO_INPUT;
  case RF_IO: return EXIT_NO_OUTPUT;
  case RF_CANCELLED: return EXIT_STOPPED;
  }
  return EXIT_INTERNAL;
}

ExitCode fail_library(rf_engine *engine)
{
  const char *text = "";
  const rf_status status = rf_error(engine, &text);
  return fail(exit_of_status(status), "%s", *text ? text : "failed without a reason; please report it");
}

ExitCode fail_usage(rf_engine *engine, const char *format, ...)
{
  const char *text = "";
  const rf_status status = rf_error(engine, &text);
  va_list args;
  va_start(args, format);
  fputs("rayfold: ", stderr);
  vfprintf(stderr, format, args);
  fprintf(stderr, ": %s\n", text);
  va_end(args);
  return status == RF_NO_MEMORY ? EXIT_INTERNAL : EXIT_USAGE;
}

void say_note(const char *format, ...)
{
  va_list args;
  va_start(args, format);
  fputs("note: ", stderr);
  vfprintf(stderr, format, args);
  fputc('\n', stderr);
  va_end(args);
}

void say_notes(const rf_scene *scene)
{
  const char *line;
  for (size_t i = 0; (line = rf_scene_note(scene, i)); i++) say_note("%s", line);
}
