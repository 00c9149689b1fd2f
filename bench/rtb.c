#include "rtb.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static double seconds_of(clockid_t clock)
{
  struct timespec t;
  clock_gettime(clock, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

double rtb_now(void)
{
  return seconds_of(CLOCK_MONOTONIC);
}
double rtb_cpu(void)
{
  return seconds_of(CLOCK_THREAD_CPUTIME_ID);
}
bool rtb_by_cpu(void)
{
  return getenv("RTB_CPU") != NULL;
}

void *rtb_alloc(size_t count, size_t size)
{
  size_t bytes;
  void *p = NULL;
  if (__builtin_mul_overflow(count, size, &bytes) || posix_memalign(&p, 64, bytes ? bytes : 64)) {
    fprintf(stderr, "not enough memory for %zu times %zu bytes\n", count, size);
    exit(70);
  }
  return p;
}

// --- files -----------------------------------------------------------------------------------------
static FILE *open_file(const char *path, const char *mode)
{
  FILE *f = fopen(path, mode);
  if (!f) perror(path);
  return f;
}

// Closes what was written; a file that is not whole is removed.
static bool finish_writing(FILE *f, const char *path)
{
  const bool failed = ferror(f);
  if (!fclose(f) && !failed) return true;
  perror(path);
  remove(path);
  return false;
}

static bool not_usable(FILE *f, const char *path, const char *format)
{
  fprintf(stderr, "%s: not a usable %s file\n", path, format);
  fclose(f);
  return false;
}

static bool has_magic(FILE *f, const char *magic)
{
  char read[8];
  return fread(read, 1, 8, f) == 8 && !memcmp(read, magic, 8);
}

bool rtb_mesh_read(const char *path, rtb_mesh *m)
{
  *m = (rtb_mesh){0};
  FILE *f = open_file(path, "rb");
  if (!f) return false;
  if (!has_magic(f, "RTBMESH1") || fread(&m->nverts, 8, 1, f) != 1 || fread(&m->ntris, 8, 1, f) != 1)
    return not_usable(f, path, "RTBMESH1");
  m->verts = rtb_alloc(m->nverts + 2, 12);
  m->idx = rtb_alloc(m->ntris + 2, 12);
  if (fread(m->verts, 12, m->nverts, f) != m->nverts || fread(m->idx, 12, m->ntris, f) != m->ntris)
    return not_usable(f, path, "RTBMESH1");
  for (uint64_t i = 0; i < m->ntris * 3; i++)
    if (m->idx[i] >= m->nverts) return not_usable(f, path, "RTBMESH1");
  fclose(f);
  rtb_mesh_bounds(m);
  return true;
}

bool rtb_mesh_write(const char *path, const rtb_mesh *m)
{
  FILE *f = open_file(path, "wb");
  if (!f) return false;
  fwrite("RTBMESH1", 1, 8, f);
  fwrite(&m->nverts, 8, 1, f);
  fwrite(&m->ntris, 8, 1, f);
  fwrite(m->verts, 12, m->nverts, f);
  fwrite(m->idx, 12, m->ntris, f);
  return finish_writing(f, path);
}

void rtb_mesh_bounds(rtb_mesh *m)
{
  m->lo = rtb_v(INFINITY, INFINITY, INFINITY);
  m->hi = rtb_v(-INFINITY, -INFINITY, -INFINITY);
  for (uint64_t i = 0; i < m->ntris * 3; i++) {
    const float *p = m->verts + 3 * (uint64_t)m->idx[i];
    m->lo = rtb_v(fminf(m->lo.x, p[0]), fminf(m->lo.y, p[1]), fminf(m->lo.z, p[2]));
    m->hi = rtb_v(fmaxf(m->hi.x, p[0]), fmaxf(m->hi.y, p[1]), fmaxf(m->hi.z, p[2]));
  }
  m->diag = rtb_len(rtb_sub(m->hi, m->lo));
}

bool rtb_rays_read(const char *path, rtb_rays *r)
{
  *r = (rtb_rays){0};
  FILE *f = open_file(path, "rb");
  if (!f) return false;
  if (fread(&r->h, sizeof r->h, 1, f) != 1 || memcmp(r->h.magic, "RTBRAYS1", 8) || !r->h.nrays)
    return not_usable(f, path, "RTBRAYS1");
  r->ray = rtb_alloc(r->h.nrays, sizeof *r->ray);
  r->ref = rtb_alloc(r->h.nrays, sizeof *r->ref);
  if (fread(r->ray, sizeof *r->ray, r->h.nrays, f) != r->h.nrays ||
      fread(r->ref, sizeof *r->ref, r->h.nrays, f) != r->h.nrays)
    return not_usable(f, path, "RTBRAYS1");
  fclose(f);
  return true;
}

bool rtb_rays_write(const char *path, const rtb_rays *r)
{
  FILE *f = open_file(path, "wb");
  if (!f) return false;
  fwrite(&r->h, sizeof r->h, 1, f);
  fwrite(r->ray, sizeof *r->ray, r->h.nrays, f);
  fwrite(r->ref, sizeof *r->ref, r->h.nrays, f);
  return finish_writing(f, path);
}

void rtb_rays_free(rtb_rays *r)
{
  free(r->ray);
  free(r->ref);
  *r = (rtb_rays){0};
}

// --- comparing -------------------------------------------------------------------------------------
rtb_check rtb_compare(const rtb_rays *r, const rtb_hit *got, float diag)
{
  rtb_check c = {0};
  for (uint64_t i = 0; i < r->h.nrays; i++) {
    const bool was_hit = r->ref[i].prim != RTB_MISS, is_hit = got[i].prim != RTB_MISS;
    c.hits += is_hit;
    c.flips += was_hit != is_hit;
    if (!was_hit || !is_hit || r->h.query == RTB_ANY) continue;
    const float t = r->ref[i].t;
    if (fabsf(got[i].t - t) > 1e-4f * fmaxf(t, 1e-3f * diag))
      c.far_t++;
    else
      c.otherprim += got[i].prim != r->ref[i].prim;
  }
  return c;
}

static int by_size(const void *a, const void *b)
{
  const double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

double rtb_median(double *v, int n)
{
  qsort(v, (size_t)n, sizeof *v, by_size);
  return (v[n / 2] + v[(n - 1) / 2]) / 2;
}
