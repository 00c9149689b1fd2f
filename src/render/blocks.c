// See blocks.h.

#include "render/blocks.h"

#include "base/mem.h"
#include "image/image.h"

#include <string.h>

// sRGB codes 0..1 of light by its square root, which is close to them: between two of 1024 entries they are straight to
// 1e-6 but for the darkest, where sRGB's own straight piece makes it 1e-5.
enum { ROOTS = 1024 };

struct Blocks {
  Jobs *jobs;
  const HotTable *hot;
  Subsampler *sampler;  // owned
  WorkerState *workers; // owned, one a thread
  char *scratch;        // owned, look_bytes of each
  Film size;            // holds nothing but how large the picture is
  float codes[ROOTS + 1];

  // of the run
  RenderPass pass;
  const Tone *tone;
};

Blocks *blocks_create(uint32_t width, uint32_t height, Jobs *jobs, const HotTable *hot, Err *err)
{
  Blocks *b = mem_zero(1, sizeof *b);
  if (!b) return err_memory(err, "a picture by blocks", sizeof *b), NULL;
  b->jobs = jobs;
  b->hot = hot;
  b->size.width = width;
  b->size.height = height;
  for (int i = 0; i <= ROOTS; i++) b->codes[i] = srgb_encode(sqr_f((float)i / ROOTS));
  b->workers = mem_zero((size_t)jobs_thread_count(jobs), sizeof *b->workers);
  b->scratch = mem_alloc((size_t)jobs_thread_count(jobs), hot->look_bytes);
  b->sampler = subsampler_create((int)width, (int)height, err);
  if (b->workers && b->scratch && b->sampler) return b;
  if (b->sampler) err_memory(err, "a picture by blocks", sizeof *b->workers);
  blocks_destroy(b);
  return NULL;
}

void blocks_destroy(Blocks *b)
{
  if (!b) return;
  subsampler_destroy(b->sampler);
  mem_free(b->workers);
  mem_free(b->scratch);
  mem_free(b);
}

// at: of ROOTS, the root of light
static float code_of(const Blocks *b, float at)
{
  const int i = at < ROOTS ? (int)at : ROOTS - 1;
  return b->codes[i] + (at - (float)i) * (b->codes[i + 1] - b->codes[i]);
}

static void trace(void *user, const SubsamplePixel *pixels, size_t count, SubsampleResult *out, int worker)
{
  Blocks *b = user;
  HotLook looks[SUBSAMPLE_PACKET];
  float rgba[SUBSAMPLE_PACKET][4] = {{0}};
  b->hot->look_at(&b->pass, pixels, count, looks, &b->workers[worker],
                  b->scratch + (size_t)worker * b->hot->look_bytes);
  for (size_t i = 0; i < count; i++) memcpy(rgba[i], &looks[i].radiance, sizeof rgba[i]);
  tone_pixels(b->tone, rgba[0], count, NULL);
  for (int i = 0; i < SUBSAMPLE_PACKET; i++) // all of them, which compilers do four at a time
    for (int c = 0; c < 4; c++) rgba[i][c] = sqrtf(rgba[i][c]) * ROOTS;
  for (size_t i = 0; i < count; i++)
    out[i] = (SubsampleResult){{code_of(b, rgba[i][0]), code_of(b, rgba[i][1]), code_of(b, rgba[i][2])}, looks[i].signature,
                               looks[i].object};
}

bool blocks_render(Blocks *b, const RenderPass *pass, const SubsampleSettings *settings, const Tone *tone,
                   const Cancel *cancel, uint32_t *pixels, uint32_t *objects, SubsampleStats *stats,
                   RayCounters *rays, Err *err)
{
  const size_t workers = (size_t)jobs_thread_count(b->jobs);
  SubsampleSettings own = *settings;
  own.is_bgr = true;
  b->pass = *pass;
  b->pass.film = &b->size;
  b->tone = tone;
  memset(b->workers, 0, workers * sizeof *b->workers);
  for (size_t i = 0; i < workers; i++) memset(b->scratch + i * b->hot->look_bytes, 0, sizeof(void *));
  const bool ok = subsampler_run(b->sampler, &own, trace, b, b->jobs, cancel, (uint8_t *)pixels, objects, stats);
  *rays = (RayCounters){0};
  for (size_t i = 0; i < workers; i++) {
    rays->camera_rays += b->workers[i].rays.camera_rays;
    rays->bounce_rays += b->workers[i].rays.bounce_rays;
    rays->shadow_rays += b->workers[i].rays.shadow_rays;
  }
  return ok || err_set(err, ERR_CANCELLED, "the frame was cancelled");
}
