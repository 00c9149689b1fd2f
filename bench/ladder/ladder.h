// The ladder: the history of ray casting as a row of small programs that answer the same question, each a step better
// than the last. A rung is one file: it builds something of a mesh and finds the nearest hits of rays. Rungs exist to
// be read and compared; the library has nothing of them, and only the last one has anything of the library.
//
//   list > groups > fat pointers > lean pointers > array > pairs > SAH > 8 wide > 8 compact > packets > library
//
// Plain C; the wide rungs use the compiler's vectors of eight floats. All rungs share basics.h, so that they do the
// same arithmetic and must find the same hits, to the bit.

#ifndef BENCH_LADDER_LADDER_H
#define BENCH_LADDER_LADDER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

typedef struct LadderMesh {              // owned by someone else, and there as long as any rung's tree
  const float *positions;                // 3 a vertex, finite
  const uint32_t *triangles;             // 3 a triangle, in range
  uint32_t vertex_count, triangle_count; // fewer than 2^28 triangles
} LadderMesh;

typedef struct LadderRay { // as rf_ray
  float o[3], tmin, d[3], tmax;
} LadderRay;

#define LADDER_MISS UINT32_MAX

typedef struct LadderHit {
  float t;       // tmax for a miss
  uint32_t prim; // of equal t the smallest; LADDER_MISS
} LadderHit;

typedef struct LadderCounts { // a test that answers for several rays or boxes at once counts as one
  uint64_t boxes, triangles;
} LadderCounts;

typedef struct Rung {
  const char *name;
  const char *gain; // what the step buys, a sentence
  bool counts;      // does it count?
  // NULL: no memory. *bytes: what it keeps, the mesh's own arrays not counted.
  void *(*build)(const LadderMesh *mesh, size_t *bytes);
  void (*closest)(const void *tree, const LadderRay *rays, LadderHit *hits, size_t count,
                  LadderCounts *counts);
  void (*destroy)(void *tree); // accepts NULL
} Rung;

extern const Rung rung_list, rung_groups, rung_fat, rung_lean, rung_array, rung_pairs, rung_sah, rung_wide,
    rung_compact, rung_packets, rung_library;
extern const Rung *const ladder_rungs[]; // in that order; ends with NULL

// Does this machine have the instructions the ladder was compiled for?
bool ladder_can_run(void);

// --- measuring -------------------------------------------------------------------------------------
typedef struct LadderSet { // rays all rungs are asked about
  const char *name;
  const LadderRay *rays;
  size_t count;
} LadderSet;

enum { LADDER_RUNGS = 11, LADDER_SETS = 4 };

typedef struct RungOnSet {
  size_t rays;                // how many it was given: a slow rung gets only some
  double rate;                // rays a second, best run
  double boxes, triangles;    // a ray
  size_t compared, differing; // hits that an earlier rung had found, too; and those that are not the same
} RungOnSet;

typedef struct RungResult {
  const Rung *rung;
  double build_seconds, bytes_per_triangle;
  RungOnSet on[LADDER_SETS];
} RungResult;

typedef struct Ladder { // what a whole run found
  const LadderMesh *mesh;
  const LadderSet *sets;
  size_t set_count, rung_count;
  RungResult results[LADDER_RUNGS];
} Ladder;

// Builds and times every rung, about `seconds` on each set. Calls said(user, result) after each rung. False: no
// memory.
bool ladder_run(Ladder *ladder, double seconds, void (*said)(void *user, const Ladder *l, size_t rung),
                void *user);

// Did all rungs find the same hits? The rungs may differ in one ray of 100,000, where it grazes a box and a triangle in
// it. The library does another arithmetic, which loses no edge: where triangles are a thousandth of the scene wide, one
// ray in 10,000 is seen to slip through an edge of the others; one in 1000 is too many.
bool ladder_agrees(const Ladder *l);

// --- showing ---------------------------------------------------------------------------------------
void ladder_table_head(FILE *out, const Ladder *l);
void ladder_table_row(FILE *out, const Ladder *l, size_t rung);
void ladder_bars(FILE *out, const Ladder *l); // for a terminal, logarithmic
void ladder_svg(FILE *out, const Ladder *l, const char *title);

#endif
