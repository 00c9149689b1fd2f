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
  BatchHabit habit = b->habit ? *b->habit : (BatchHabit){0};
  for (size_t at = 0, count; at < b->count; at += count) {
    const size_t most = habit.turns_left ? habit.turns_left : SET_SIZE;
    count = b->count - at < most ? b->count - at : most;
    if (habit.turns_left) {
      const Batch part = batch_part(b, at, count);
      turns_walk(&part);
      habit.turns_left -= count;
    } else if (stream_run(b, at, (int)count) < SHARED_LEAST) {
      habit.turns_left = TURNS_FOR;
    }
  }
  if (b->habit) *b->habit = habit;
}

#endif
