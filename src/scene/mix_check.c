// See mix_check.h. A walk down all branches, which ends because the way there is as long as MIX_DEEPEST at most.

#include "scene/mix_check.h"

typedef struct MixWalk {
  const Scene *scene;
  const Material *changed; // may be NULL
  int32_t changed_i;
  int32_t chain[MIX_DEEPEST];
  int depth; // of chain
  Err *err;
} MixWalk;

static const Material *material_at(const MixWalk *w, int32_t i)
{
  if (w->changed && i == w->changed_i) return w->changed;
  return i >= 0 && (size_t)i < w->scene->materials.count ? &w->scene->materials.items[i] : NULL;
}

static bool fail(const MixWalk *w, int32_t last, const char *what)
{
  Text chain = {0};
  for (int k = 0; k < w->depth; k++) text_add(&chain, "\"%.60s\" -> ", material_at(w, w->chain[k])->name);
  err_set(w->err, ERR_BAD_SCENE, "%s: %s\"%.60s\"", what, text_get(&chain), material_at(w, last)->name);
  text_finish(&chain);
  return false;
}

// *field: the first step of the way to a fault.
static bool walk(MixWalk *w, int32_t i, const char **field)
{
  const Material *m = material_at(w, i);
  const char *deeper;
  if (!m || m->kind != MATERIAL_MIX) return true;
  for (int k = 0; k < w->depth; k++)
    if (w->chain[k] == i) return fail(w, i, "a mix must not contain itself");
  if (w->depth == MIX_DEEPEST) return fail(w, i, "mixes are nested more than 4 deep");
  w->chain[w->depth++] = i;
  *field = "first";
  bool ok = walk(w, m->mix.first, &deeper);
  if (ok) {
    *field = "second";
    ok = walk(w, m->mix.second, &deeper);
  }
  w->depth--;
  return ok;
}

bool mix_check(const Scene *s, const Material *changed, int32_t changed_i, int32_t *material_i, const char **field,
               Err *err)
{
  MixWalk w = {.scene = s, .changed = changed, .changed_i = changed_i, .err = err};
  const size_t count = s->materials.count + (changed && (size_t)changed_i == s->materials.count);
  const char *ignored;
  for (size_t i = 0; i < count; i++) {
    if (walk(&w, (int32_t)i, field ? field : &ignored)) continue;
    if (material_i) *material_i = (int32_t)i;
    return false;
  }
  return true;
}
