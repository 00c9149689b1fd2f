// See nearest.h. Names are compared by edit distance (Levenshtein); up to one change in three letters, and one
// more, counts as a slip of the finger.

#include "nearest.h"

#include <stdio.h>
#include <string.h>

enum { LONGEST = 64 };

static size_t least(size_t a, size_t b)
{
  return a < b ? a : b;
}

// One row of the table of distances between prefixes, updated in place.
static size_t edit_distance(const char *a, const char *b)
{
  const size_t n = strlen(a), m = strlen(b);
  if (n > LONGEST || m > LONGEST) return LONGEST;
  size_t row[LONGEST + 1];
  for (size_t j = 0; j <= m; j++) row[j] = j;
  for (size_t i = 1; i <= n; i++) {
    size_t diagonal = row[0];
    row[0] = i;
    for (size_t j = 1; j <= m; j++) {
      const size_t replace = diagonal + (a[i - 1] != b[j - 1]);
      diagonal = row[j];
      row[j] = least(replace, 1 + least(row[j], row[j - 1]));
    }
  }
  return row[m];
}

Nearest nearest_begin(const char *word)
{
  return (Nearest){word, NULL, 2 + strlen(word) / 3};
}

void nearest_try(Nearest *n, const char *candidate)
{
  const size_t distance = edit_distance(n->word, candidate);
  if (distance >= n->distance || distance >= strlen(candidate)) return;
  n->best = candidate;
  n->distance = distance;
}

const char *nearest_hint(const Nearest *n, const char *prefix, char out[160])
{
  out[0] = 0;
  if (n->best) snprintf(out, 160, "; did you mean \"%s%s\"?", prefix, n->best);
  return out;
}
