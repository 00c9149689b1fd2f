// Output: what the program itself writes: text to stdout, and small files. Pictures and models are written by the
// library. A file appears whole under its name or not at all, and a text that could not be written is a failure.

#ifndef RAYFOLD_APP_OUTPUT_H
#define RAYFOLD_APP_OUTPUT_H

#include "say.h"

#include <stdbool.h>

// A program started with stdin, stdout or stderr closed would get a picture file in their place. Fills the gaps so
// that writing to them fails instead. First thing in main().
void stdio_guard(void);

// Everything printed so far has arrived, or EXIT_NO_OUTPUT and why. `what` names it.
ExitCode stdout_finish(const char *what);

// Prints a text made by the library, frees it, and finishes stdout. NULL is the library's failure.
ExitCode stdout_library_text(rf_engine *engine, char *text, const char *what);

// Could a file of this name be made? Looks at the folder; creates nothing.
ExitCode output_check(const char *path);

// Is there a file of this name, and not an empty one? What we write is whole then.
bool output_exists(const char *path);

// Writes the whole text through a temporary name beside the target.
ExitCode output_write(const char *path, const char *text, size_t size);

// The extension from its dot, "" for none; compared without regard to case.
const char *output_extension(const char *path);
bool output_is_any(const char *path, const char *extensions); // extensions: ".png|.exr"

#endif
