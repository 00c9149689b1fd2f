// Ray files: the mesh (.rtm) and ray (.rays) files of the yardstick in bench/, described in bench/README.md. Read
// strictly and whole: a size that does not fit, an index out of range or a vertex that is no number is an error that
// says where, and nothing is allocated that the file's own size does not warrant. Little endian, as this program.

#ifndef RAYFOLD_APP_RAY_FILE_H
#define RAYFOLD_APP_RAY_FILE_H

#include "say.h"

#include <stdbool.h>

typedef struct MeshFile {
  unsigned char *bytes;      // owned: the file
  const float *positions;    // into it: 3 a vertex
  const uint32_t *triangles; // into it: 3 a triangle
  size_t vertex_count, triangle_count;
  float diagonal;   // of the box of all triangles
  const char *name; // the path's last part
} MeshFile;

#define RAY_MISS UINT32_MAX

typedef struct RayResult { // as ray files hold it
  float t;
  uint32_t
      prim; // triangle of the mesh file; RAY_MISS: none. For any-hit rays 0 or RAY_MISS, and the rest means nothing
  float u, v;
} RayResult;
_Static_assert(sizeof(RayResult) == 16 && sizeof(rf_ray) == 32, "as in the file");

typedef struct RayFile {
  unsigned char *bytes; // owned: the file
  size_t size;
  bool is_any, is_coherent; // is anything in the way; neighbours are alike (a hint)
  size_t count, triangle_count;
  char name[33];
  const rf_ray *rays;        // into bytes
  const RayResult *expected; // the same
} RayFile;

// EXIT_NO_INPUT when it cannot be read, EXIT_BAD_SCENE when it is broken; both say why.
ExitCode mesh_file_read(MeshFile *m, const char *path);
void mesh_file_finish(MeshFile *m); // accepts zero
ExitCode ray_file_read(RayFile *r, const char *path);
void ray_file_finish(RayFile *r); // accepts zero

// The same rays with other results, whole or not at all.
ExitCode ray_file_write(const RayFile *r, const RayResult *results, const char *path);

typedef struct RayCheck { // results against those of the file
  size_t hits;
  size_t flips; // a hit in one, none in the other
  size_t
      far; // both hit, at distances more than 1e-4 apart, relative (and never less than 1e-7 of the diagonal)
  size_t other; // as far, on another triangle: shared edges, faces that coincide
} RayCheck;

RayCheck ray_file_check(const RayFile *r, const RayResult *results, float diagonal);

#endif
