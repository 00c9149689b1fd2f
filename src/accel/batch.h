// Batch: many rays at once, by whichever walk suits them. Rays that go alike are walked as streams of 64, which
// share their visits to nodes; where hardly any visits are shared rays walk in turns. The answers are the same.

#ifndef RAYFOLD_ACCEL_BATCH_H
#define RAYFOLD_ACCEL_BATCH_H

#include "accel/stream.h"
#include "accel/turns.h"

// Rays a visit to a node is for, on average; with fewer a stream is slower than turns. Of 0 to 99, over second bounces,
// occlusion and chords in three scenes, 2.6 to 4 were best.
#define SHARED_LEAST 3.0f

enum { TURNS_FOR = 448 }; // rays walked in turns before a stream is tried again

static inline Batch batch_part(const Batch *b, size_t first, size_t count)
{
  Batch part = *b;
  part.rays += first;
  part.count = count;
  if (b->user) part.user = (const char *)b->user + first * b->user_stride;
  if (b->hits) part.hits += first;
  if (b->blocked) part.blocked += first;
  return part;
}

// Answers all rays: the nearest hit of each in b->hits, or whether there is any in b->blocked.
static inline void accel_ask(const Batch *b)
{
  size_t at = 0;
  while (at < b->count) {
    const size_t count = b->count - at < SET_SIZE ? b->count - at : SET_SIZE;
    const float shared = stream_run(b, at, (int)count);
    at += count;
    if (shared >= SHARED_LEAST || at == b->count) continue;
    const Batch part = batch_part(b, at, b->count - at < TURNS_FOR ? b->count - at : TURNS_FOR);
    turns_walk(&part);
    at += part.count;
  }
}

#endif
