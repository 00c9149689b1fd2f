// Say: what the program tells its user on stderr, and the exit codes it ends with. Every message begins with
// "rayfold: " and says what, where and how to mend it; notes begin with "note: ". Nothing here writes to stdout.

#ifndef RAYFOLD_APP_SAY_H
#define RAYFOLD_APP_SAY_H

#include <rayfold/rayfold.h>

typedef enum ExitCode { // as sysexits.h numbers them
  EXIT_DONE = 0,
  EXIT_USAGE = 64,
  EXIT_BAD_SCENE = 65,
  EXIT_NO_INPUT = 66,
  EXIT_INTERNAL = 70,
  EXIT_NO_OUTPUT = 73,
  EXIT_STOPPED = 75,
} ExitCode;

typedef struct ExitMeaning {
  ExitCode code;
  const char *sentence;
} ExitMeaning;

extern const ExitMeaning exit_meanings[]; // ends with a NULL sentence

void say(const char *format, ...) __attribute__((format(printf, 1, 2)));

// Says why and returns the code, so that "return fail(EXIT_USAGE, ...)" reads well.
ExitCode fail(ExitCode code, const char *format, ...) __attribute__((format(printf, 2, 3)));

// The same with the library's last error on this thread, whose kind gives the code. engine may be NULL.
ExitCode fail_library(rf_engine *engine);

// The library's last error where the user's words are to blame: always EXIT_USAGE, with those words in front.
ExitCode fail_usage(rf_engine *engine, const char *format, ...) __attribute__((format(printf, 2, 3)));

// "note: " and what; not an error.
void say_note(const char *format, ...) __attribute__((format(printf, 1, 2)));

// What the loader ignored or repaired.
void say_notes(const rf_scene *scene);

#endif
