// See library.h.

#include "library.h"

#include <time.h>

const Option no_options[] = {{0}};

ExitCode engine_open(rf_engine **engine, int threads, const char *isa)
{
  rf_engine_def def = rf_default_engine_def();
  def.threads = threads;
  if (isa) def.isa = isa;
  *engine = rf_engine_create(&def);
  if (*engine) return EXIT_DONE;
  return isa ? fail_usage(NULL, "--isa %s", isa) : fail_library(NULL);
}

ExitCode scene_open(rf_scene **scene, rf_engine *engine, const char *path, bool allow_outside)
{
  rf_load_def def = rf_default_load_def();
  def.allow_outside = allow_outside;
  *scene = rf_scene_load(engine, path, &def);
  return *scene ? EXIT_DONE : fail_library(engine);
}

void json_print_text(FILE *out, const char *text)
{
  fputc('"', out);
  for (const char *c = text; *c; c++) {
    if (*c == '"' || *c == '\\')
      fprintf(out, "\\%c", *c);
    else if ((unsigned char)*c < 0x20)
      fprintf(out, "\\u%04x", (unsigned)*c);
    else
      fputc(*c, out);
  }
  fputc('"', out);
}

double seconds_now(void)
{
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + (double)t.tv_nsec * 1e-9;
}
