// Arena: memory that lives and dies with its owner (a scene, a world, a film, a worker's scratch). Blocks are
// chained, nothing is freed singly. Not for two threads at once.
//
//   first block                     next block
//   [ used ......|      free ]  ->  [ used ...|      free ]

#ifndef RAYFOLD_BASE_ARENA_H
#define RAYFOLD_BASE_ARENA_H

#include <stdbool.h>
#include <stddef.h>

typedef struct ArenaBlock ArenaBlock;

typedef struct Arena {
  ArenaBlock *last;  // owned
  size_t total_size; // bytes held, for reports
  bool ran_dry;      // some request was refused since the start; asked once by whoever prepares
} Arena;               // zero is an empty arena

// count * size bytes, 64-byte aligned, cleared. NULL when memory is out (and ran_dry is set).
void *arena_alloc(Arena *a, size_t count, size_t size);
char *arena_text(Arena *a, const char *text);                   // a copy; NULL for NULL
char *arena_text_n(Arena *a, const char *text, size_t length);  // a copy of length bytes, terminated
char *arena_format(Arena *a, const char *format, ...) __attribute__((format(printf, 2, 3)));
void arena_finish(Arena *a); // frees everything; the arena is empty again

#endif
