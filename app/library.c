// See library.h.

#include "library.h"

#include <string.h>
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

ExitCode scene_open(rf_scene **scene, rf_engine *engine, const char *path, const Args *args)
{
  rf_load_def def = rf_default_load_def();
  def.allow_outside = args_has(args, "allow-outside");
  def.cache = args_know(args, "cache") && args_has(args, "cache");
  def.element = args_know(args, "element") ? args_text(args, "element") : NULL;
  *scene = rf_scene_load(engine, path, &def);
  return *scene ? EXIT_DONE : fail_library(engine);
}

// Bytes of the UTF-8 sequence at s, 0 where there is none. File names may hold anything.
static size_t utf8_length(const unsigned char *s)
{
  const size_t n = s[0] < 0x80                   ? 1
                   : s[0] >= 0xc2 && s[0] < 0xe0 ? 2
                   : s[0] >= 0xe0 && s[0] < 0xf0 ? 3
                   : s[0] >= 0xf0 && s[0] < 0xf5 ? 4
                                                 : 0;
  for (size_t i = 1; i < n; i++)
    if ((s[i] & 0xc0) != 0x80) return 0;
  return n;
}

void json_print_text(FILE *out, const char *text)
{
  fputc('"', out);
  for (const unsigned char *c = (const unsigned char *)text; *c;) {
    const size_t n = utf8_length(c);
    if (*c == '"' || *c == '\\')
      fprintf(out, "\\%c", *c);
    else if (*c < 0x20 || n == 0)
      fprintf(out, "\\u%04x", n ? *c : 0xfffdu);
    else
      fwrite(c, 1, n, out);
    c += n ? n : 1;
  }
  fputc('"', out);
}

bool integrator_is_light(const char *name)
{
  return !strcmp(name, "path") || !strcmp(name, "classic") || !strcmp(name, "whitted");
}

double seconds_now(void)
{
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + (double)t.tv_nsec * 1e-9;
}
