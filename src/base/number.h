// Numbers in text: floats and integers read from a bounded range of bytes that need not be terminated, the same
// under every locale, and written so that they read back exactly. Leading blanks are the caller's business.

#ifndef RAYFOLD_BASE_NUMBER_H
#define RAYFOLD_BASE_NUMBER_H

#include <stddef.h>
#include <stdint.h>

// Each reads one number at p and returns the first byte after it, or NULL when there is none (*out is then left as
// it was). A sign, digits with or without a point, and an exponent are understood; so are "nan", "inf", "infinity"
// and Microsoft's "1.#IND". Too large a number gives infinity, too small a one zero: callers decide what they
// think of those. What follows the number is not looked at: "1.5abc" reads as 1.5.
const char *number_float(const char *p, const char *end, float *out);   // nearest float, ties to even
const char *number_double(const char *p, const char *end, double *out); // nearest double

// Digits with a sign. Values beyond 64 bits are held at INT64_MIN and INT64_MAX.
const char *number_int(const char *p, const char *end, int64_t *out);

// The shortest text that reads back as the same float, terminated; returns its length.
enum { NUMBER_SIZE = 32 };
size_t number_format(char out[NUMBER_SIZE], float x);

#endif
