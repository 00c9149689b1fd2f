// A table of numbers by 64-bit key, for finding things of an array by what they hold: the key is a hash of that, the
// number an index. Different things may have one key, so the caller compares what it finds. Nothing is taken out
// singly.

#ifndef RAYFOLD_BASE_TABLE_H
#define RAYFOLD_BASE_TABLE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct TableEntry {
  uint64_t key;
  int32_t value; // -1: a free place
} TableEntry;

typedef struct Table {
  TableEntry *entries; // open addressing; the capacity is a power of two and at least twice the count
  size_t count, capacity;
} Table; // zero is empty

// Adds value, 0 or more, under key, whether or not the key is there already. False when memory is out.
bool table_add(Table *t, uint64_t key, int32_t value);

// The values of a key, in no particular order, which may be changed in place:
//   int32_t *value;
//   for (size_t step = 0; (value = table_next(t, key, &step));) ...
int32_t *table_next(const Table *t, uint64_t key, size_t *step);

void table_clear(Table *t); // keeps its memory
void table_finish(Table *t);

#endif
