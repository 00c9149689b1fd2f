#include "ray_sets.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979f

// --- cameras ---------------------------------------------------------------------------------------
static bool read_item(RayCamera *c, const char *key, FILE *f)
{
  rtb_v3 v;
  if (!strcmp(key, "fov")) return fscanf(f, "%f", &c->fov) == 1;
  if (!strcmp(key, "size")) return fscanf(f, "%d %d", &c->w, &c->h) == 2 && c->w > 0 && c->h > 0;
  if (fscanf(f, "%f %f %f", &v.x, &v.y, &v.z) != 3) return false;
  if (!strcmp(key, "eye"))
    c->eye = v;
  else if (!strcmp(key, "at"))
    c->at = v;
  else if (!strcmp(key, "up"))
    c->up = v;
  else if (!strcmp(key, "light"))
    c->light = v;
  else
    return false;
  return true;
}

bool ray_camera_read(const char *path, RayCamera *c)
{
  char key[16];
  bool ok = true;
  *c = (RayCamera){.at = {0, 0, 1}, .up = {0, 1, 0}, .fov = 50, .w = 1024, .h = 1024};
  FILE *f = fopen(path, "r");
  if (!f) {
    perror(path);
    return false;
  }
  while (ok && fscanf(f, "%15s", key) == 1) ok = read_item(c, key, f);
  fclose(f);
  if (!ok) fprintf(stderr, "%s: cannot make sense of \"%s\"\n", path, key);
  return ok;
}

// --- camera rays -----------------------------------------------------------------------------------
static rtb_ray ray_of(rtb_v3 o, rtb_v3 d, float tmax)
{
  return (rtb_ray){o.x, o.y, o.z, 0, d.x, d.y, d.z, tmax};
}

static uint32_t even_bits(uint32_t x)
{
  x &= 0x55555555u;
  x = (x | x >> 1) & 0x33333333u;
  x = (x | x >> 2) & 0x0f0f0f0fu;
  x = (x | x >> 4) & 0x00ff00ffu;
  return (x | x >> 8) & 0xffffu;
}

void ray_set_primary(const RayCamera *c, rtb_rays *out)
{
  const rtb_v3 ahead = rtb_norm(rtb_sub(c->at, c->eye)), right = rtb_norm(rtb_cross(ahead, c->up));
  const rtb_v3 up = rtb_cross(right, ahead);
  const float tan_y = tanf(c->fov * 0.5f * PI / 180.0f), tan_x = tan_y * (float)c->w / (float)c->h;
  const bool is_morton = c->w == c->h && (c->w & (c->w - 1)) == 0;
  const uint32_t w = (uint32_t)c->w, count = w * (uint32_t)c->h;
  *out = (rtb_rays){.h.nrays = count, .ray = rtb_alloc(count, sizeof(rtb_ray))};
  for (uint32_t i = 0; i < count; i++) {
    const uint32_t x = is_morton ? even_bits(i) : i % w, y = is_morton ? even_bits(i >> 1) : i / w;
    const float px = (2 * ((float)x + 0.5f) / (float)c->w - 1) * tan_x;
    const float py = (1 - 2 * ((float)y + 0.5f) / (float)c->h) * tan_y;
    const rtb_v3 d = rtb_norm(rtb_add(ahead, rtb_add(rtb_mul(right, px), rtb_mul(up, py))));
    out->ray[i] = ray_of(c->eye, d, INFINITY);
  }
}

// --- rays from hits --------------------------------------------------------------------------------
bool ray_normal(const rtb_mesh *m, uint32_t prim, rtb_v3 d, rtb_v3 *n)
{
  const uint32_t *k = m->idx + 3 * (uint64_t)prim;
  const float *a = m->verts + 3 * (uint64_t)k[0], *b = m->verts + 3 * (uint64_t)k[1];
  const float *c = m->verts + 3 * (uint64_t)k[2];
  const rtb_v3 e1 = rtb_v(b[0] - a[0], b[1] - a[1], b[2] - a[2]);
  const rtb_v3 e2 = rtb_v(c[0] - a[0], c[1] - a[1], c[2] - a[2]);
  const rtb_v3 q = rtb_cross(e1, e2);
  const float length = rtb_len(q);
  if (!(length > 0)) return false;
  *n = rtb_mul(q, (rtb_dot(q, d) > 0 ? -1.0f : 1.0f) / length);
  return true;
}

// Cosine-distributed around n, in the basis of Duff et al., "Building an Orthonormal Basis, Revisited", 2017.
static rtb_v3 cosine_direction(rtb_v3 n, float u1, float u2)
{
  const float sign = copysignf(1.0f, n.z), a = -1.0f / (sign + n.z), b = n.x * n.y * a;
  const rtb_v3 s = rtb_v(1 + sign * n.x * n.x * a, sign * b, -sign * n.x);
  const rtb_v3 t = rtb_v(b, sign + n.y * n.y * a, -n.y);
  const float r = sqrtf(u1), phi = 2 * PI * u2;
  const rtb_v3 flat = rtb_add(rtb_mul(s, r * cosf(phi)), rtb_mul(t, r * sinf(phi)));
  return rtb_norm(rtb_add(flat, rtb_mul(n, sqrtf(fmaxf(0, 1 - u1)))));
}

static rtb_ray leaving_ray(const RaySetFrom *from, uint32_t i, rtb_v3 p, rtb_v3 n)
{
  if (from->kind == RAY_TO_LIGHT) {
    const rtb_v3 way = rtb_sub(from->light, p);
    const float length = rtb_len(way);
    return ray_of(p, rtb_mul(way, 1.0f / length), length * 0.9999f);
  }
  const rtb_v3 d = cosine_direction(n, rtb_rnd(from->seed, i, 0), rtb_rnd(from->seed, i, 1));
  return ray_of(p, d, from->kind == RAY_NEAR ? 0.05f * from->mesh->diag : INFINITY);
}

void ray_set_secondary(const RaySetFrom *from, rtb_rays *out)
{
  const rtb_rays *source = from->source;
  const float off = 1e-5f * from->mesh->diag;
  *out = (rtb_rays){.ray = rtb_alloc(source->h.nrays / from->stride + 1, sizeof(rtb_ray))};
  for (uint64_t i = 0; i < source->h.nrays; i += from->stride) {
    const rtb_hit *hit = &source->ref[i];
    const rtb_ray *q = &source->ray[i];
    const rtb_v3 d = rtb_v(q->dx, q->dy, q->dz);
    rtb_v3 n;
    if (hit->prim == RTB_MISS || !ray_normal(from->mesh, hit->prim, d, &n)) continue;
    const rtb_v3 p = rtb_add(rtb_add(rtb_v(q->ox, q->oy, q->oz), rtb_mul(d, hit->t)), rtb_mul(n, off));
    out->ray[out->h.nrays++] = leaving_ray(from, (uint32_t)i, p, n);
  }
}

void ray_set_chords(const rtb_mesh *m, uint32_t count, rtb_rays *out)
{
  const rtb_v3 e = rtb_sub(m->hi, m->lo);
  *out = (rtb_rays){.h.nrays = count, .ray = rtb_alloc(count, sizeof(rtb_ray))};
  for (uint32_t i = 0; i < count; i++) {
    const rtb_v3 a = rtb_v(e.x * rtb_rnd(4, i, 0), e.y * rtb_rnd(4, i, 1), e.z * rtb_rnd(4, i, 2));
    const rtb_v3 b = rtb_v(e.x * rtb_rnd(4, i, 3), e.y * rtb_rnd(4, i, 4), e.z * rtb_rnd(4, i, 5));
    out->ray[i] = ray_of(rtb_add(m->lo, a), rtb_norm(rtb_sub(b, a)), INFINITY);
  }
}

void ray_set_name(rtb_rays *r, const char *name, rtb_query query, bool is_coherent, const rtb_mesh *m)
{
  memcpy(r->h.magic, "RTBRAYS1", 8);
  r->h.query = (uint32_t)query;
  r->h.coherent = is_coherent;
  r->h.ntris = m->ntris;
  snprintf(r->h.name, sizeof r->h.name, "%s", name);
  r->ref = rtb_alloc(r->h.nrays, sizeof *r->ref);
}
