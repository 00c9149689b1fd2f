// See gltf.h: questions to the JSON, each checked, each error with its place.

#include "scene/gltf.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

bool gltf_fail(Gltf *g, const Json *dict, const char *key, const char *format, ...)
{
  char message[700];
  va_list args;
  va_start(args, format);
  vsnprintf(message, sizeof message, format, args);
  va_end(args);
  return js_fail(g->doc, dict, key, 0, false, g->err, "%s", message);
}

bool gltf_fail_item(Gltf *g, const char *list, size_t i, const char *format, ...)
{
  char message[700];
  va_list args;
  va_start(args, format);
  vsnprintf(message, sizeof message, format, args);
  va_end(args);
  return js_fail(g->doc, js_get(g->root, list), NULL, i, false, g->err, "%s[%zu]: %s", list, i, message);
}

bool gltf_charge(Gltf *g, size_t count, size_t size, const char *what)
{
  size_t bytes, allowed, total;
  if (size_mul(count, size, &bytes) && size_add(g->made_size, bytes, &total) &&
      (!size_mul(g->read_size, GLTF_GROWTH, &allowed) || !size_add(allowed, GLTF_HEAD_START, &allowed) ||
       total <= allowed)) {
    g->made_size = total;
    return true;
  }
  return err_set(
      g->err, ERR_BAD_SCENE,
      "%s: %zu %s ask for far more memory than a file of this size can mean; it names the same data again "
      "and again, or its counts are wrong",
      g->path, count, what);
}

void *gltf_alloc(Gltf *g, size_t count, size_t size, const char *what)
{
  if (!gltf_charge(g, count, size, what)) return NULL;
  void *block = mem_alloc(count, size);
  if (!block) err_memory(g->err, what, count * size);
  return block;
}

size_t gltf_count(const Gltf *g, const char *list)
{
  const Json *v = js_get(g->root, list);
  return js_kind(v) == JSON_LIST ? js_count(v) : 0;
}

const Json *gltf_item(const Gltf *g, const char *list, size_t i)
{
  return js_at(js_get(g->root, list), i);
}

bool gltf_size(Gltf *g, const Json *dict, const char *key, size_t fallback, size_t *out)
{
  const Json *v = js_get(dict, key);
  *out = fallback;
  if (!v) return true;
  const double x = js_number(v, -1);
  if (!(x >= 0 && x <= 0x1p53) || x != floor(x))
    return gltf_fail(g, dict, key, "\"%s\" must be a whole number from 0 up", key);
  *out = (size_t)x;
  return true;
}

bool gltf_index_below(Gltf *g, const Json *dict, const char *key, size_t count, const char *noun, size_t *out)
{
  if (!gltf_size(g, dict, key, GLTF_NONE, out)) return false;
  if (*out == GLTF_NONE || *out < count) return true;
  return gltf_fail(g, dict, key, "there is no %s[%zu]; the file has %zu, counted from 0", noun, *out, count);
}

bool gltf_index(Gltf *g, const Json *dict, const char *key, const char *list, size_t *out)
{
  return gltf_index_below(g, dict, key, gltf_count(g, list), list, out);
}

static bool is_float(const Json *v)
{
  return js_kind(v) == JSON_NUMBER && fabs(js_number(v, 0)) <= (double)FLT_MAX;
}

bool gltf_floats(Gltf *g, const Json *dict, const char *key, size_t n, float *out)
{
  const Json *v = js_get(dict, key);
  if (!v) return true;
  if (n == 1) {
    if (!is_float(v)) return gltf_fail(g, dict, key, "\"%s\" must be a number, not %s", key, js_kind_name(v));
    *out = (float)js_number(v, 0);
    return true;
  }
  bool ok = js_kind(v) == JSON_LIST && js_count(v) == n;
  for (size_t i = 0; ok && i < n; i++) ok = is_float(js_at(v, i));
  if (!ok) return gltf_fail(g, dict, key, "\"%s\" must be a list of %zu numbers", key, n);
  for (size_t i = 0; i < n; i++) out[i] = (float)js_number(js_at(v, i), 0);
  return true;
}

bool gltf_ranged(Gltf *g, const Json *dict, const char *key, size_t n, float low, float high, float *out)
{
  if (!gltf_floats(g, dict, key, n, out)) return false;
  for (size_t i = 0; i < n; i++) {
    if (out[i] >= low && out[i] <= high) continue;
    note_once(&g->scene->notes, "%s: \"%s\" of %g lies outside %g..%g and is brought inside", g->path, key,
              (double)out[i], (double)low, (double)high);
    out[i] = clamp_f(out[i], low, high);
  }
  return true;
}

bool gltf_flag(Gltf *g, const Json *dict, const char *key, bool *out)
{
  const Json *v = js_get(dict, key);
  if (!v) return true;
  if (js_kind(v) != JSON_BOOL) return gltf_fail(g, dict, key, "\"%s\" must be true or false", key);
  *out = js_bool(v, false);
  return true;
}

const Json *gltf_extension(const Json *v, const char *name)
{
  const Json *extension = js_get(js_get(v, "extensions"), name);
  return js_kind(extension) == JSON_DICT ? extension : NULL;
}

const char *gltf_name(const Json *dict, const char *fallback, size_t number, char out[GLTF_NAME_SIZE])
{
  const char *name = js_text(js_get(dict, "name"));
  if (!name || !name[0]) {
    snprintf(out, GLTF_NAME_SIZE, "%s %zu", fallback, number);
    return out;
  }
  size_t n = strnlen(name, GLTF_NAME_SIZE - 1);
  // A cut must not leave half a UTF-8 character: 10xxxxxx bytes only continue one.
  if (name[n])
    while (n && ((unsigned char)name[n] & 0xc0) == 0x80) n--;
  memcpy(out, name, n);
  out[n] = 0;
  return out;
}
