// See ray_file.h.

#include "ray_file.h"

#include "output.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "the files are read into memory as they are");

enum { MESH_HEAD = 24, RAYS_HEAD = 64, ALIGNMENT = 64 };

// --- a whole file in memory ------------------------------------------------------------------------
static bool read_all(int fd, unsigned char *bytes, size_t size)
{
  while (size) {
    const ssize_t n = read(fd, bytes, size);
    if (n < 0 && errno == EINTR) continue;
    if (n == 0) errno = EIO; // it shrank while we read
    if (n <= 0) return false;
    bytes += n;
    size -= (size_t)n;
  }
  return true;
}

static ExitCode fail_read(const char *path)
{
  return fail(EXIT_NO_INPUT, "cannot read %s: %s", path, strerror(errno));
}

static ExitCode read_file(const char *path, unsigned char **bytes, size_t *size)
{
  struct stat st;
  const int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK); // a pipe must not keep us waiting
  if (fd < 0) return fail_read(path);
  ExitCode code = EXIT_DONE;
  if (fstat(fd, &st)) {
    code = fail_read(path);
  } else if (!S_ISREG(st.st_mode)) {
    code = fail(EXIT_NO_INPUT, "%s is not a file", path);
  } else {
    *size = (size_t)st.st_size;
    *bytes = aligned_alloc(ALIGNMENT, (*size / ALIGNMENT + 1) * ALIGNMENT);
    if (!*bytes)
      code = fail(EXIT_INTERNAL, "%s: not enough memory for its %zu bytes", path, *size);
    else if (!read_all(fd, *bytes, *size))
      code = fail_read(path);
  }
  close(fd);
  return code;
}

static const char *last_part(const char *path)
{
  const char *slash = strrchr(path, '/');
  return slash ? slash + 1 : path;
}

// Does the file have the eight letters, its head, and room for that many things of that size?
static ExitCode check_head(const char *path, const unsigned char *bytes, size_t size, const char *magic,
                           size_t head)
{
  if (size >= 8 && !memcmp(bytes, magic, 8))
    return size >= head ? EXIT_DONE : fail(EXIT_BAD_SCENE, "%s: ends within its first %zu bytes", path, head);
  return fail(EXIT_BAD_SCENE, "%s: does not begin with \"%s\"; bench/README.md describes the format", path,
              magic);
}

static size_t load_count(const unsigned char *at)
{
  uint64_t n;
  memcpy(&n, at, sizeof n);
  return (size_t)n;
}

static uint32_t load_word(const unsigned char *at)
{
  uint32_t n;
  memcpy(&n, at, sizeof n);
  return n;
}

// --- meshes ----------------------------------------------------------------------------------------
static ExitCode check_mesh_sizes(const MeshFile *m, const char *path, size_t size)
{
  const size_t most = size / 12; // vertices and triangles take 12 bytes each
  if (!m->vertex_count || !m->triangle_count) return fail(EXIT_BAD_SCENE, "%s: holds no triangles", path);
  if (m->triangle_count >= RAY_MISS)
    return fail(EXIT_BAD_SCENE, "%s: holds more triangles than can be numbered", path);
  if (m->vertex_count > most || m->triangle_count > most ||
      size != MESH_HEAD + 12 * (m->vertex_count + m->triangle_count))
    return fail(EXIT_BAD_SCENE, "%s: %zu vertices and %zu triangles do not make a file of %zu bytes", path,
                m->vertex_count, m->triangle_count, size);
  return EXIT_DONE;
}

static ExitCode check_mesh_content(MeshFile *m, const char *path)
{
  float lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
  for (size_t i = 0; i < 3 * m->triangle_count; i++) {
    if (m->triangles[i] >= m->vertex_count)
      return fail(EXIT_BAD_SCENE, "%s: triangle %zu names vertex %u, but there are only %zu", path, i / 3,
                  m->triangles[i], m->vertex_count);
    const float *p = m->positions + 3 * (size_t)m->triangles[i];
    for (int k = 0; k < 3; k++) {
      if (!isfinite(p[k])) return fail(EXIT_BAD_SCENE, "%s: vertex %u is not finite", path, m->triangles[i]);
      lo[k] = fminf(lo[k], p[k]);
      hi[k] = fmaxf(hi[k], p[k]);
    }
  }
  const float x = hi[0] - lo[0], y = hi[1] - lo[1], z = hi[2] - lo[2];
  m->diagonal = sqrtf(x * x + y * y + z * z);
  return EXIT_DONE;
}

ExitCode mesh_file_read(MeshFile *m, const char *path)
{
  size_t size = 0;
  *m = (MeshFile){.name = last_part(path)};
  ExitCode code = read_file(path, &m->bytes, &size);
  if (!code) code = check_head(path, m->bytes, size, "RTBMESH1", MESH_HEAD);
  if (code) return code;
  m->vertex_count = load_count(m->bytes + 8);
  m->triangle_count = load_count(m->bytes + 16);
  code = check_mesh_sizes(m, path, size);
  if (code) return code;
  m->positions = (const float *)(const void *)(m->bytes + MESH_HEAD);
  m->triangles = (const uint32_t *)(const void *)(m->bytes + MESH_HEAD + 12 * m->vertex_count);
  return check_mesh_content(m, path);
}

void mesh_file_finish(MeshFile *m)
{
  free(m->bytes);
  *m = (MeshFile){0};
}

// --- rays ------------------------------------------------------------------------------------------
// The name goes into a line whose fields are divided by commas.
static ExitCode take_name(RayFile *r, const char *path, const unsigned char *at)
{
  memcpy(r->name, at, 32);
  for (const char *c = r->name; *c; c++)
    if (*c <= ' ' || *c > '~' || *c == ',')
      return fail(EXIT_BAD_SCENE,
                  "%s: the name of its rays holds something else than letters, digits and signs", path);
  return *r->name ? EXIT_DONE : fail(EXIT_BAD_SCENE, "%s: its rays have no name", path);
}

static ExitCode check_results(const RayFile *r, const char *path)
{
  const size_t end = r->is_any ? 1 : r->triangle_count;
  for (size_t i = 0; i < r->count; i++)
    if (r->expected[i].prim != RAY_MISS && r->expected[i].prim >= end)
      return fail(EXIT_BAD_SCENE, "%s: the result of ray %zu names triangle %u, but there are only %zu", path,
                  i, r->expected[i].prim, end);
  return EXIT_DONE;
}

ExitCode ray_file_read(RayFile *r, const char *path)
{
  *r = (RayFile){0};
  ExitCode code = read_file(path, &r->bytes, &r->size);
  if (!code) code = check_head(path, r->bytes, r->size, "RTBRAYS1", RAYS_HEAD);
  if (code) return code;
  const uint32_t query = load_word(r->bytes + 8), coherent = load_word(r->bytes + 12);
  if (query > 1 || coherent > 1)
    return fail(EXIT_BAD_SCENE, "%s: query %u and hint %u; both are 0 or 1", path, query, coherent);
  r->is_any = query == 1;
  r->is_coherent = coherent == 1;
  r->count = load_count(r->bytes + 16);
  r->triangle_count = load_count(r->bytes + 24);
  if (!r->count) return fail(EXIT_BAD_SCENE, "%s: holds no rays", path);
  if (r->count > r->size / 48 || r->size != RAYS_HEAD + 48 * r->count)
    return fail(EXIT_BAD_SCENE, "%s: %zu rays do not make a file of %zu bytes", path, r->count, r->size);
  r->rays = (const rf_ray *)(const void *)(r->bytes + RAYS_HEAD);
  r->expected = (const RayResult *)(const void *)(r->bytes + RAYS_HEAD + 32 * r->count);
  code = take_name(r, path, r->bytes + 32);
  return code ? code : check_results(r, path);
}

void ray_file_finish(RayFile *r)
{
  free(r->bytes);
  *r = (RayFile){0};
}

ExitCode ray_file_write(const RayFile *r, const RayResult *results, const char *path)
{
  char *copy = malloc(r->size);
  if (!copy) return fail(EXIT_INTERNAL, "%s: not enough memory for its %zu bytes", path, r->size);
  const size_t before = RAYS_HEAD + 32 * r->count;
  memcpy(copy, r->bytes, before);
  memcpy(copy + before, results, 16 * r->count);
  const ExitCode code = output_write(path, copy, r->size);
  free(copy);
  return code;
}

RayCheck ray_file_check(const RayFile *r, const RayResult *results, float diagonal)
{
  RayCheck c = {0};
  for (size_t i = 0; i < r->count; i++) {
    const RayResult *expected = &r->expected[i], *got = &results[i];
    const bool was_hit = expected->prim != RAY_MISS, is_hit = got->prim != RAY_MISS;
    c.hits += is_hit;
    c.flips += was_hit != is_hit;
    if (!was_hit || !is_hit || r->is_any) continue;
    if (fabsf(got->t - expected->t) > 1e-4f * fmaxf(expected->t, 1e-3f * diagonal))
      c.far++;
    else
      c.other += got->prim != expected->prim;
  }
  return c;
}
