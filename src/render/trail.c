// See trail.h. After "Reverse reprojection caching" (Nehab et al., "Accelerating Real-Time Shading with Reverse
// Reprojection Caching", 2007), with the blend of temporal antialiasing: an average over the last few frames.

#include "render/trail.h"

#include "base/mem.h"

enum { ROWS_AN_ITEM = 16 };
// How far the depth found may be from the depth expected, as a share of it: above the step of a floor seen flat from
// eye height at an eighth of the resolution, below that from a hand to the wall behind it.
#define DEPTH_SHARE 0.05f
#define SKY         1e15f // a distance that stands for it

void trail_finish(Trail *t)
{
  mem_free(t->last.color);
  mem_free(t->last.depth);
  mem_free(t->next.color);
  mem_free(t->next.depth);
  *t = (Trail){0};
}

void trail_forget(Trail *t) { t->last.width = 0; }

typedef struct Work {
  const TrailFrame *last;
  TrailFrame *next; // NULL: not kept
  const Eye *eye;
  uint32_t width, height;
  float *rgba;
  const float *depth;
  float weight;
} Work;

// A place in the world that pixel (x, y) sees, in the frame of the last eye.
static Vec3 place_before(const Work *w, uint32_t x, uint32_t y, float depth)
{
  const float aspect = (float)w->width / (float)w->height, tangent = w->eye->tan_half_fov;
  const float u = 2 * ((float)x + 0.5f) / (float)w->width - 1, v = 1 - 2 * ((float)y + 0.5f) / (float)w->height;
  const Vec3 here = depth * v3(u * tangent * aspect, v * tangent, -1);
  const Frame *then = &w->last->eye.frame;
  const Vec3 way = frame_vector(&w->eye->frame, here) + (depth < SKY ? w->eye->frame.p - then->p : v3_all(0));
  return v3(v3_dot(way, then->x), v3_dot(way, then->y), v3_dot(way, then->z));
}

// Adds one pixel of the last picture if it saw the same: at a depth like the one expected.
static void gather(const TrailFrame *f, long x, long y, float expected, float share, Vec3 *sum, float *age, float *total)
{
  if (x < 0 || y < 0 || x >= (long)f->width || y >= (long)f->height || share <= 0) return;
  const size_t i = (size_t)y * f->width + (size_t)x;
  const float depth = f->depth[i] > 0 ? f->depth[i] : SKY;
  const bool is_same = expected > SKY / 1000 ? depth == SKY : fabsf(depth - expected) <= DEPTH_SHARE * expected;
  if (!is_same) return;
  *sum += share * v3_load(f->color + 4 * i);
  *age += share * f->color[4 * i + 3];
  *total += share;
}

// The last picture at a place that its eye saw at `place`; *age 0: nothing is known of it.
static Vec3 look_up(const TrailFrame *f, Vec3 place, float *age)
{
  *age = 0;
  const float depth = -place[2];
  if (!(depth > 0)) return v3_all(0);
  const float tangent = f->eye.tan_half_fov, aspect = (float)f->width / (float)f->height;
  const float x = (place[0] / (depth * tangent * aspect) + 1) * 0.5f * (float)f->width - 0.5f;
  const float y = (1 - place[1] / (depth * tangent)) * 0.5f * (float)f->height - 0.5f;
  if (!(x > -1 && y > -1 && x < (float)f->width && y < (float)f->height)) return v3_all(0);
  const float bx = floorf(x), by = floorf(y), fx = x - bx, fy = y - by;
  Vec3 sum = v3_all(0);
  float total = 0;
  for (int k = 0; k < 4; k++)
    gather(f, (long)bx + (k & 1), (long)by + (k >> 1), depth, (k & 1 ? fx : 1 - fx) * (k & 2 ? fy : 1 - fy), &sum, age,
           &total);
  if (!(total > 0.01f)) return *age = 0, v3_all(0);
  *age /= total;
  return sum / total;
}

static void blend_pixel(const Work *w, uint32_t x, uint32_t y)
{
  const size_t i = (size_t)y * w->width + x;
  float *p = w->rgba + 4 * i, age = 0;
  const float depth = w->depth[i] > 0 ? w->depth[i] : SKY;
  Vec3 color = v3_load(p);
  if (w->last->width) {
    const Vec3 before = look_up(w->last, place_before(w, x, y, depth), &age);
    age = min_f(age, max_f(TRAIL_MOST - w->weight, 0));
    if (age > 0) color = (age * before + w->weight * color) / (age + w->weight);
  }
  v3_store(p, color);
  if (!w->next) return;
  v3_store(w->next->color + 4 * i, color);
  w->next->color[4 * i + 3] = age + w->weight;
  w->next->depth[i] = w->depth[i];
}

static void blend_rows(void *user, size_t item, int worker)
{
  const Work *w = user;
  (void)worker;
  const uint32_t first = (uint32_t)item * ROWS_AN_ITEM;
  for (uint32_t y = first; y < first + ROWS_AN_ITEM && y < w->height; y++)
    for (uint32_t x = 0; x < w->width; x++) blend_pixel(w, x, y);
}

static bool make_room(TrailFrame *f, uint32_t width, uint32_t height, Err *err)
{
  const size_t pixels = (size_t)width * height;
  f->width = width;
  f->height = height;
  if (pixels <= f->room) return true;
  mem_free(f->color);
  mem_free(f->depth);
  f->color = mem_alloc(pixels, 4 * sizeof *f->color);
  f->depth = mem_alloc(pixels, sizeof *f->depth);
  f->room = f->color && f->depth ? pixels : 0;
  return f->room || err_memory(err, "the last frame", 20ull * pixels);
}

bool trail_blend(Trail *t, const Eye *eye, uint32_t width, uint32_t height, float *rgba, const float *depth,
                 float weight, bool keeps, Jobs *jobs, Err *err)
{
  if (keeps && !make_room(&t->next, width, height, err)) return false;
  if (eye->kind != EYE_PERSPECTIVE || t->last.eye.kind != EYE_PERSPECTIVE) trail_forget(t);
  Work w = {&t->last, keeps ? &t->next : NULL, eye, width, height, rgba, depth, weight};
  jobs_run(jobs, (height + ROWS_AN_ITEM - 1) / ROWS_AN_ITEM, blend_rows, &w, NULL);
  if (!keeps) return true;
  t->next.eye = *eye;
  const TrailFrame made = t->next;
  t->next = t->last;
  t->last = made;
  return true;
}
