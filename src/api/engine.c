// The engine: threads, kernels, log and errors. The last error is kept per thread, as a caller's next call on the
// same thread is the one that asks for it; that is the only state not owned by an engine.

#include "api/api.h"

#include "base/mem.h"
#include "base/text.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

_Static_assert((int)RF_CANCELLED == (int)ERR_CANCELLED && (int)RF_IO == (int)ERR_IO, "the two lists are one");

static _Thread_local Err last_error;
static _Thread_local char last_text[sizeof last_error.text];

bool api_fail(const Err *err)
{
  if (err->kind == ERR_NONE) return true;
  last_error = *err;
  return false;
}

bool api_bad_argument(const char *function, const char *format, ...)
{
  char what[400];
  va_list args;
  va_start(args, format);
  vsnprintf(what, sizeof what, format, args);
  va_end(args);
  last_error.kind = ERR_BAD_ARGUMENT;
  snprintf(last_error.text, sizeof last_error.text, "%s: %s", function, what);
  return false;
}

bool api_has_magic(uint32_t magic, uint32_t wanted, const char *function, const char *type)
{
  return magic == wanted ||
         api_bad_argument(function, "the %s was not made by its default function; start from that one", type);
}

rf_status rf_error(rf_engine *e, const char **text)
{
  (void)e;
  const rf_status status = (rf_status)last_error.kind;
  memcpy(last_text, last_error.text, sizeof last_text);
  if (status == RF_OK) last_text[0] = 0;
  if (text) *text = last_text;
  last_error.kind = ERR_NONE;
  return status;
}

int rf_version(void) { return RF_VERSION_MAJOR * 10000 + RF_VERSION_MINOR * 100 + RF_VERSION_PATCH; }

const char *rf_features(void)
{
#define OUT(package)              "not in this build (install " package " and build again)"
  return
#if RAYFOLD_HAVE_PNG
      "PNG: libpng\n"
#else
      "PNG: " OUT("libpng-dev") "\n"
#endif
#if RAYFOLD_HAVE_JPEG
      "JPEG: libturbojpeg\n"
#else
      "JPEG: " OUT("libturbojpeg0-dev") "\n"
#endif
#if RAYFOLD_HAVE_WEBP
      "WebP: libwebp\n"
#else
      "WebP: " OUT("libwebp-dev") "\n"
#endif
#if RAYFOLD_HAVE_OPENEXR
      "OpenEXR: OpenEXRCore\n"
#else
      "OpenEXR: " OUT("libopenexr-dev") "\n"
#endif
#if RAYFOLD_HAVE_STB
      "other pictures: stb_image\n"
#else
      "other pictures: " OUT("libstb-dev") "\n"
#endif
#if RAYFOLD_HAVE_MESHOPT
      "compressed glTF: meshoptimizer\n"
#else
      "compressed glTF: " OUT("libmeshoptimizer-dev") "\n"
#endif
#if RAYFOLD_HAVE_NANOVDB
      "sparse volumes: NanoVDB\n"
#else
      "sparse volumes: " OUT("libnanovdb-dev") "\n"
#endif
      "Radiance HDR, PFM, OBJ, PLY, STL, glTF, saved models: built in\n";
}

rf_engine_def rf_default_engine_def(void) { return (rf_engine_def){.isa = "auto", .magic = MAGIC_ENGINE}; }

// The level asked for, or false with a message if there is none of that name or this machine lacks it.
static bool choose_isa(const char *name, IsaLevel *out, Err *err)
{
  const IsaLevel best = cpu_best_isa();
  *out = best;
  if (!name || !strcmp(name, "auto")) return true;
  for (int i = 0; i < ISA_COUNT; i++) {
    if (strcmp(name, isa_names[i])) continue;
    *out = (IsaLevel)i;
    if (i <= (int)best) return true;
    return err_set(err, ERR_BAD_ARGUMENT, "this processor has no instruction set \"%s\"; its best is \"%s\"", name,
                   isa_names[best]);
  }
  char hint[120];
  return err_set(err, ERR_BAD_ARGUMENT, "there is no instruction set \"%s\": choose auto, ref, v2, v3 or v4%s", name,
                 text_hint(hint, name, isa_names, ISA_COUNT));
}

rf_engine *rf_engine_create(const rf_engine_def *def)
{
  const rf_engine_def defaults = rf_default_engine_def();
  if (!def) def = &defaults;
  if (!api_has_magic(def->magic, MAGIC_ENGINE, "rf_engine_create", "rf_engine_def")) return NULL;
  Err err = {0};
  rf_engine *e = mem_zero(1, sizeof *e);
  if (!e) err_memory(&err, "an engine", sizeof *e);
  if (e && choose_isa(def->isa, &e->isa, &err)) e->jobs = jobs_create(def->threads, &err);
  if (!api_fail(&err)) {
    rf_engine_destroy(e);
    return NULL;
  }
  e->hot = hot_table(e->isa);
  e->log = def->log;
  e->user = def->user;
  return e;
}

void rf_engine_destroy(rf_engine *e)
{
  if (!e) return;
  jobs_destroy(e->jobs);
  mem_free(e);
}

const char *rf_engine_isa(const rf_engine *e) { return e ? isa_names[e->isa] : ""; }
int rf_engine_threads(const rf_engine *e) { return e ? jobs_thread_count(e->jobs) : 0; }

void rf_cancel(rf_engine *e)
{
  if (e) atomic_store(&e->cancel.requested, true);
}

void rf_uncancel(rf_engine *e)
{
  if (e) atomic_store(&e->cancel.requested, false);
}

void api_log_notes(const rf_engine *e, const Notes *notes)
{
  for (size_t i = 0; e->log && i < notes->lines.count; i++) e->log(e->user, RF_LOG_WARNING, notes->lines.items[i]);
}

void rf_free(void *text) { free(text); }
