// Err: how a failure travels. A function that can fail returns bool and takes an Err; the first cause is kept, and
// callers may add where it was but never replace it. A message says what, where, and how to mend it.

#ifndef RAYFOLD_BASE_ERR_H
#define RAYFOLD_BASE_ERR_H

#include <stdbool.h>

typedef enum ErrKind { // same order as rf_status in rayfold.h
  ERR_NONE,
  ERR_BAD_ARGUMENT, // the calling programmer's fault
  ERR_BAD_SCENE,    // the content of a file or an edit
  ERR_NOT_FOUND,    // an input that is missing or cannot be read
  ERR_IO,           // an output that cannot be written
  ERR_NO_MEMORY,
  ERR_CANCELLED,
} ErrKind;

typedef struct Err {
  ErrKind kind;
  char text[2000];
} Err;

// Records the failure unless one is recorded already; always returns false, so "return err_set(...)" reads well.
// err may be NULL when the caller does not care why.
bool err_set(Err *err, ErrKind kind, const char *format, ...) __attribute__((format(printf, 3, 4)));

// Puts "where: " in front of the recorded message. Returns false.
bool err_where(Err *err, const char *format, ...) __attribute__((format(printf, 2, 3)));

// The usual sentence for a failed allocation of so many bytes for a named thing. Returns false.
bool err_memory(Err *err, const char *what, unsigned long long bytes);

// True: the promise to the compiler that a switch over a closed set has been exhausted; a trap in test builds.
#ifdef NDEBUG
#define unreachable() __builtin_unreachable()
#else
#define unreachable() __builtin_trap()
#endif

#endif
