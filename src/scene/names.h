// Names: numbers for names in order of first mention, by a hash, for files that repeat a name a million times.

#ifndef RAYFOLD_SCENE_NAMES_H
#define RAYFOLD_SCENE_NAMES_H

#include "base/arena.h"
#include "base/array.h"
#include "base/table.h"

#include <stdint.h>

typedef struct Names {
  ARRAY(const char *) list; // the names, in the arena
  Table table;              // hash of a name -> its number
} Names;                    // zero is none

int32_t names_find(const Names *n, const char *name, size_t length);    // -1: not there
int32_t names_add(Names *n, Arena *a, const char *name, size_t length); // finds or adds; -1: memory is out
static inline size_t names_count(const Names *n)
{
  return n->list.count;
}
static inline const char *names_get(const Names *n, int32_t i)
{
  return n->list.items[i];
}
void names_finish(Names *n);

#endif
