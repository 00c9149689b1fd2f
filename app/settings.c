// See settings.h.

#include "settings.h"

#include "library.h"

#include <stdlib.h>
#include <string.h>

static bool looks_like_json(const char *value)
{
  double number;
  return value[0] == '"' || value[0] == '[' || value[0] == '{' || read_real(value, &number) ||
         !strcmp(value, "true") || !strcmp(value, "false") || !strcmp(value, "null");
}

// A bare word becomes a text, so that a shell's user need not quote it twice. NULL when memory is out.
static char *value_as_json(const char *value)
{
  char *json = NULL;
  size_t size;
  FILE *out = open_memstream(&json, &size);
  if (!out) return NULL;
  if (looks_like_json(value))
    fputs(value, out);
  else
    json_print_text(out, value);
  if (!fclose(out)) return json;
  free(json);
  return NULL;
}

static ExitCode set_size(rf_engine *engine, rf_scene *scene, const char *value)
{
  char json[64], width[24];
  long w, h;
  const size_t n = strcspn(value, "xX");
  snprintf(width, sizeof width, "%.*s", (int)(n < 23 ? n : 23), value);
  if (!value[n] || !read_integer(width, &w) || !read_integer(value + n + 1, &h))
    return fail(EXIT_USAGE, "--size %s: it is WxH in pixels, as in 1280x720", value);
  snprintf(json, sizeof json, "[%ld, %ld]", w, h);
  return rf_set(scene, "render.size", json) ? EXIT_DONE : fail_usage(engine, "--size %s", value);
}

static ExitCode set_field(rf_engine *engine, rf_scene *scene, const Option *o, const char *path,
                          const char *value)
{
  char *json = value_as_json(value);
  if (!json) return fail(EXIT_INTERNAL, "not enough memory to read --%s", o->name);
  const bool ok = rf_set(scene, path, json);
  free(json);
  return ok ? EXIT_DONE
            : fail_usage(engine, "--%s %s%s%s", o->name, o->path ? "" : path, o->path ? "" : "=", value);
}

static ExitCode set_any(rf_engine *engine, rf_scene *scene, const Option *o, const char *value)
{
  const size_t n = strcspn(value, "=");
  if (!value[n] || n == 0)
    return fail(EXIT_USAGE, "--set %s: it is PATH=VALUE, as in materials.gold.roughness=0.3", value);
  char *path = strndup(value, n);
  if (!path) return fail(EXIT_INTERNAL, "not enough memory to read --set");
  const ExitCode code = set_field(engine, scene, o, path, value + n + 1);
  free(path);
  return code;
}

ExitCode settings_apply(const Args *args, rf_engine *engine, rf_scene *scene, bool with_set)
{
  for (size_t i = 0; i < args->given_count; i++) {
    const Given *g = &args->given[i];
    ExitCode code = EXIT_DONE;
    if (!strcmp(g->option->name, "size"))
      code = set_size(engine, scene, g->value);
    else if (g->option->path)
      code = set_field(engine, scene, g->option, g->option->path, g->value);
    else if (with_set && !strcmp(g->option->name, "set"))
      code = set_any(engine, scene, g->option, g->value);
    if (code) return code;
  }
  return EXIT_DONE;
}
