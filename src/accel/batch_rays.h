// Batch: many rays to be asked at once, and where the answers go.

#ifndef RAYFOLD_ACCEL_BATCH_RAYS_H
#define RAYFOLD_ACCEL_BATCH_RAYS_H

#include "accel/step.h"

// Carried from one batch to the next of the same kind: what walk suited the last.
typedef struct BatchHabit {
  size_t turns_left; // rays to be walked in turns before a stream is tried again
} BatchHabit;

// Where rays come from and answers go. Either hits or blocked is NULL. user_stride: bytes from one ray's filter
// argument to the next's. habit may be NULL.
typedef struct Batch {
  const Accel *accel;
  const PackedRay *rays;
  size_t count;
  RayMask mask;
  HitFilter *filter;
  const void *user;
  size_t user_stride;
  RayCounters *counters;
  BatchHabit *habit;
  Hit *hits;
  uint8_t *blocked;
} Batch;

static inline const void *batch_user(const Batch *b, size_t ray_i)
{
  return b->user ? (const char *)b->user + ray_i * b->user_stride : NULL;
}

static inline void batch_answer(const Batch *b, size_t ray_i, const Hit *best, bool found)
{
  if (b->blocked) {
    b->blocked[ray_i] = found;
    return;
  }
  b->hits[ray_i] = found ? *best : (Hit){.t = b->rays[ray_i].tmax, .instance = NO_HIT};
}

#endif
