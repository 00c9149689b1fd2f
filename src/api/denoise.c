// Denoising through the public interface: which planes, which filter, which weights. The film's sums are never
// touched; the clean picture lies beside them until the film changes.

#include "api/api.h"

#include "base/mem.h"
#include "post/denoise_fast.h"
#include "post/denoise_net.h"
#include "post/weights.h"
#include "scene/kinds.h"

#include <string.h>

_Static_assert(RF_DENOISE_PLANES ==
                   (1 << FILM_ALBEDO | 1 << FILM_NORMAL | 1 << FILM_DEPTH | 1 << FILM_VARIANCE),
               "the planes that guide a denoiser");

static const char *const kinds[] = {
    [DENOISE_OFF] = "off", [DENOISE_FAST] = "fast", [DENOISE_GOOD] = "good", [DENOISE_BEST] = "best"};
enum { KIND_COUNT = sizeof kinds / sizeof *kinds };

rf_denoise_def rf_default_denoise_def(void)
{
  return (rf_denoise_def){.kind = kinds[DENOISE_BEST], .magic = MAGIC_DENOISE};
}

rf_denoise_def rf_scene_denoise_def(const rf_scene *s)
{
  rf_denoise_def def = rf_default_denoise_def();
  def.kind = kinds[s ? s->scene->render.denoise : DENOISE_OFF];
  return def;
}

static bool kind_of(const char *name, DenoiseKind *out)
{
  for (int i = 0; i < KIND_COUNT; i++) {
    *out = (DenoiseKind)i;
    if (name && !strcmp(kinds[i], name)) return true;
  }
  return api_bad_argument("rf_film_denoise", "there is no denoiser \"%s\"; choose off, fast, good or best",
                          name ? name : "(null)");
}

static bool has_guides(const rf_film *f)
{
  static const FilmPlane wanted[] = {FILM_ALBEDO, FILM_NORMAL, FILM_DEPTH, FILM_VARIANCE};
  for (size_t i = 0; i < sizeof wanted / sizeof *wanted; i++)
    if (!film_has(f->film, wanted[i]))
      return api_bad_argument("rf_film_denoise",
                              "this film has no plane \"%s\"; ask for RF_DENOISE_PLANES in "
                              "rf_film_create()",
                              film_plane_names[wanted[i]]);
  return true;
}

// The film's planes as floats, 12 a pixel in one block, which the caller frees.
static float *guided_from(const Film *f, Guided *g)
{
  const size_t n = (size_t)f->width * f->height;
  float *block = mem_alloc(n, 12 * sizeof *block);
  if (!block) return NULL;
  *g = (Guided){f->width, f->height, block, block + 4 * n, block + 7 * n, block + 10 * n, block + 11 * n};
  film_resolve(f, FILM_BEAUTY, block);
  film_resolve(f, FILM_ALBEDO, block + 4 * n);
  film_resolve(f, FILM_NORMAL, block + 7 * n);
  film_resolve(f, FILM_DEPTH, block + 10 * n);
  film_resolve(f, FILM_VARIANCE, block + 11 * n);
  return block;
}

static bool run_net(const rf_engine *e, const Guided *g, DenoiseKind kind, const char *folder, float *out,
                    Err *err)
{
  Unet net;
  const char *name = kind == DENOISE_GOOD ? "rt_hdr_alb_nrm_small.tza" : "rt_hdr_alb_nrm.tza";
  const bool ok = weights_load(&net, folder, name, err) &&
                  denoise_net(g, &net, 0, &e->hot->post, e->jobs, &e->cancel, out, err);
  unet_finish(&net);
  return ok;
}

static bool run_kind(const rf_engine *e, const Guided *g, DenoiseKind kind, const char *folder, float *out,
                     Err *err)
{
  switch (kind) {
  case DENOISE_OFF: return true;
  case DENOISE_FAST: return denoise_fast(g, &e->hot->post, NULL, e->jobs, &e->cancel, out, err);
  case DENOISE_GOOD:
  case DENOISE_BEST: return run_net(e, g, kind, folder, out, err);
  }
  unreachable();
}

bool rf_film_denoise(rf_film *f, const rf_denoise_def *def)
{
  static const char function[] = "rf_film_denoise";
  const rf_denoise_def defaults = rf_default_denoise_def();
  DenoiseKind kind;
  if (!f) return api_bad_argument(function, "the film is NULL");
  if (!def) def = &defaults;
  if (!api_has_magic(def->magic, MAGIC_DENOISE, function, "rf_denoise_def") || !kind_of(def->kind, &kind))
    return false;
  api_film_changed(f);
  if (kind == DENOISE_OFF) return true;
  if (!has_guides(f)) return false;
  const size_t pixels = (size_t)f->film->width * f->film->height;
  Err err = {0};
  Guided g;
  float *out = mem_alloc(pixels, 4 * sizeof *out), *planes = guided_from(f->film, &g);
  if (!out || !planes)
    err_memory(&err, "denoising", pixels * 16 * sizeof *out);
  else if (run_kind(f->engine, &g, kind, def->weights, out, &err)) {
    f->clean = out;
    out = NULL;
  }
  mem_free(planes);
  mem_free(out);
  return api_fail(&err);
}

void api_film_changed(rf_film *f)
{
  mem_free(f->clean);
  f->clean = NULL;
}
