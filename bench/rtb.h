// Rtb: what the yardstick's programs share: the formats of mesh and ray files (README.md here), random numbers that
// are a function of their arguments, clocks, and the comparison of hits. Plain C and libc; nothing of Rayfold's.

#ifndef BENCH_RTB_H
#define BENCH_RTB_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct rtb_v3 {
  float x, y, z;
} rtb_v3;

static inline rtb_v3 rtb_v(float x, float y, float z)
{
  return (rtb_v3){x, y, z};
}
static inline rtb_v3 rtb_add(rtb_v3 a, rtb_v3 b)
{
  return rtb_v(a.x + b.x, a.y + b.y, a.z + b.z);
}
static inline rtb_v3 rtb_sub(rtb_v3 a, rtb_v3 b)
{
  return rtb_v(a.x - b.x, a.y - b.y, a.z - b.z);
}
static inline rtb_v3 rtb_mul(rtb_v3 a, float s)
{
  return rtb_v(a.x * s, a.y * s, a.z * s);
}
static inline float rtb_dot(rtb_v3 a, rtb_v3 b)
{
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
static inline float rtb_len(rtb_v3 a)
{
  return sqrtf(rtb_dot(a, a));
}

static inline rtb_v3 rtb_cross(rtb_v3 a, rtb_v3 b)
{
  return rtb_v(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

static inline rtb_v3 rtb_norm(rtb_v3 a)
{
  const float l = rtb_len(a);
  return l > 0 ? rtb_mul(a, 1.0f / l) : a;
}

// One PCG-RXS-M-XS output step (O'Neill 2014) as a 32-bit hash. rnd(seed, i, d) is a pure function of three integers,
// so that every mesh and ray set can be made again.
static inline uint32_t rtb_hash(uint32_t x)
{
  const uint32_t s = x * 747796405u + 2891336453u;
  const uint32_t w = ((s >> ((s >> 28) + 4u)) ^ s) * 277803737u;
  return (w >> 22) ^ w;
}

static inline float rtb_rnd(uint32_t seed, uint32_t i, uint32_t d) // 0 up to 1
{
  return (float)(rtb_hash(i + rtb_hash(d + rtb_hash(seed))) >> 8) * (1.0f / 16777216.0f);
}

// Seconds: a clock that never jumps; processor time of this thread.
double rtb_now(void);
double rtb_cpu(void);
bool rtb_by_cpu(void); // is RTB_CPU set, so that times are the mean processor time of the threads?

// count * size bytes, 64-byte aligned. Ends the program, as nothing here can go on without memory.
void *rtb_alloc(size_t count, size_t size);

// --- meshes ----------------------------------------------------------------------------------------
typedef struct rtb_mesh {
  uint64_t nverts, ntris;
  float *verts;  // owned; room for one vertex more, as Embree reads 16 bytes at the last
  uint32_t *idx; // owned
  rtb_v3 lo, hi;
  float diag; // of the box of all triangles
} rtb_mesh;

// False, and a message: the file is none.
bool rtb_mesh_read(const char *path, rtb_mesh *m);
bool rtb_mesh_write(const char *path, const rtb_mesh *m);
void rtb_mesh_bounds(rtb_mesh *m); // sets lo, hi, diag

// --- rays ------------------------------------------------------------------------------------------
typedef struct rtb_ray {
  float ox, oy, oz, tmin, dx, dy, dz, tmax;
} rtb_ray;

#define RTB_MISS UINT32_MAX

typedef struct rtb_hit {
  float t;
  uint32_t prim; // RTB_MISS: none
  float u, v;
} rtb_hit;

typedef enum rtb_query { RTB_CLOSEST, RTB_ANY } rtb_query;

typedef struct rtb_rays_head {
  char magic[8]; // "RTBRAYS1"
  uint32_t query, coherent;
  uint64_t nrays, ntris;
  char name[32];
} rtb_rays_head;
_Static_assert(sizeof(rtb_rays_head) == 64 && sizeof(rtb_ray) == 32 && sizeof(rtb_hit) == 16,
               "as in the files");

typedef struct rtb_rays {
  rtb_rays_head h;
  rtb_ray *ray; // owned
  rtb_hit *ref; // owned
} rtb_rays;     // zero is none

bool rtb_rays_read(const char *path, rtb_rays *r);
bool rtb_rays_write(const char *path, const rtb_rays *r);
void rtb_rays_free(rtb_rays *r);

typedef struct rtb_check { // README.md says what they mean
  uint64_t hits, flips, far_t, otherprim;
} rtb_check;

rtb_check rtb_compare(const rtb_rays *r, const rtb_hit *got, float diag);

double rtb_median(double *v, int n); // sorts them

#endif
