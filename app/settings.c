// See settings.h.

#include "settings.h"

#include "stage.h"

#include <stdlib.h>
#include <string.h>

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

static ExitCode set_field(rf_engine *engine, rf_scene *scene, const Given *g)
{
  if (rf_set(scene, g->option->path, g->value)) return EXIT_DONE;
  return fail_usage(engine, "--%s %s", g->option->name, g->value);
}

static ExitCode set_any(rf_engine *engine, rf_scene *scene, const char *value)
{
  const size_t n = strcspn(value, "=");
  if (!value[n] || n == 0)
    return fail(EXIT_USAGE, "--set %s: it is PATH=VALUE, as in materials.gold.roughness=0.3", value);
  char *path = strndup(value, n);
  if (!path) return fail(EXIT_INTERNAL, "not enough memory to read --set");
  const bool ok = rf_set(scene, path, value + n + 1);
  free(path);
  return ok ? EXIT_DONE : fail_usage(engine, "--set %s", value);
}

static bool is_set(const Given *g)
{
  return !strcmp(g->option->name, "set");
}

static bool is_in(const Given *g, SettingsPart part)
{
  switch (part) {
  case SETTINGS_PLAIN: return !is_set(g);
  case SETTINGS_ALL: return true;
  case SETTINGS_BEFORE_STAGE: return !is_set(g) || !stage_owns(g->value);
  case SETTINGS_OF_STAGE: return is_set(g) && stage_owns(g->value);
  }
  return false;
}

ExitCode settings_apply(const Args *args, rf_engine *engine, rf_scene *scene, SettingsPart part)
{
  for (size_t i = 0; i < args->given_count; i++) {
    const Given *g = &args->given[i];
    ExitCode code = EXIT_DONE;
    if (!is_in(g, part)) continue;
    if (!strcmp(g->option->name, "size"))
      code = set_size(engine, scene, g->value);
    else if (g->option->path)
      code = set_field(engine, scene, g);
    else if (is_set(g))
      code = set_any(engine, scene, g->value);
    if (code) return code;
  }
  return EXIT_DONE;
}

static bool speaks_of(const char *value, const char *section)
{
  const size_t n = strlen(section);
  return !strncmp(value, section, n) && (value[n] == '.' || value[n] == '=');
}

ExitCode settings_repeat(const Args *args, rf_engine *engine, rf_scene *scene, const char *section)
{
  const char *value;
  ExitCode code = EXIT_DONE;
  for (size_t i = 0; !code && (value = args_next(args, "set", &i));)
    if (speaks_of(value, section)) code = set_any(engine, scene, value);
  return code;
}
