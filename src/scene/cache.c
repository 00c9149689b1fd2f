// See cache.h. The list of files that a cache was made of stands in it as RFM_SOURCE sections; names are relative to
// the model's folder, so that model and cache can move together.

#include "scene/cache.h"

#include "base/hash.h"
#include "scene/rfm.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

void cache_path(Text *out, const char *model_path)
{
  text_clear(out);
  text_add(out, "%s.rfm", model_path);
}

// Files outside the root are left out unless allowed, so a model may become something else under another root.
uint64_t cache_key(const char *model_path, const LoadOptions *options)
{
  Text folder = {0};
  char real[PATH_MAX];
  path_folder(&folder, model_path);
  const char *root = options->root ? options->root : text_get(&folder);
  if (realpath(root, real)) root = real;
  const uint64_t key = hash_bytes(options->allow_outside, root, options->allow_outside ? 0 : strlen(root));
  text_finish(&folder);
  return key ? key : 1;
}

// --- noting -----------------------------------------------------------------------------------------
// A file beside or below the model goes by its name from there.
static const char *name_from(const char *folder, const char *file)
{
  const size_t n = strlen(folder);
  return !strncmp(file, folder, n) && file[n] == '/' ? file + n + 1 : file;
}

static bool is_listed(const Scene *s, const char *file, bool is_content)
{
  for (size_t i = 0; i < s->sources.count; i++)
    if (s->sources.items[i].is_content == is_content && !strcmp(s->sources.items[i].file, file)) return true;
  return false;
}

static bool add_source(Scene *s, const char *file, bool is_content, uint64_t hash)
{
  Text folder = {0};
  path_folder(&folder, s->path ? s->path : "");
  const char *name = name_from(text_get(&folder), file);
  bool ok = is_listed(s, name, is_content);
  if (!ok) {
    const SceneSource source = {arena_text(&s->arena, name), is_content, hash};
    ok = source.file && array_push(&s->sources, source);
  }
  text_finish(&folder);
  return ok;
}

static uint64_t hash_content(const FileBytes *bytes)
{
  const uint64_t h = bytes ? rfm_hash(bytes->data, bytes->size) : 0;
  return bytes && !h ? 1 : h;
}

bool cache_add_content(Scene *s, const char *file, const FileBytes *bytes, const LoadOptions *options)
{
  return !options || !options->use_cache || add_source(s, file, true, hash_content(bytes));
}

bool cache_add_name(Scene *s, const char *file, const LoadOptions *options)
{
  return !options || !options->use_cache || add_source(s, file, false, !access(file, R_OK));
}

// --- checking ---------------------------------------------------------------------------------------
static uint64_t hash_now(const char *path, bool is_content)
{
  if (!is_content) return !access(path, R_OK);
  FileBytes bytes;
  if (!file_read(&bytes, path, NULL)) return 0;
  const uint64_t h = hash_content(&bytes);
  file_release(&bytes);
  return h;
}

static bool is_source_same(const char *folder, Span section)
{
  const RfmSource *source = section.data;
  if (section.size <= sizeof *source) return false;
  const char *name = (const char *)(source + 1);
  const int n = (int)(section.size - sizeof *source);
  Text path = {0};
  if (name[0] == '/' || text_equal(folder, "."))
    text_add_n(&path, name, (size_t)n);
  else
    text_add(&path, "%s/%.*s", folder, n, name);
  const bool is_same = !path.failed && hash_now(text_get(&path), source->is_content) == source->hash;
  text_finish(&path);
  return is_same;
}

// Every source is as it was. One without sources was not made as a cache.
static bool is_fresh(const RfmFile *f, const char *model_path)
{
  Text folder = {0};
  size_t sources = 0;
  bool ok = true;
  path_folder(&folder, model_path);
  for (size_t i = 0; ok && i < f->head->section_count; i++) {
    const RfmSection *s = &f->sections[i];
    if (s->kind != RFM_SOURCE) continue;
    sources++;
    ok = rfm_hash(rfm_span(f, s).data, s->size) == s->hash &&
         is_source_same(text_get(&folder), rfm_span(f, s));
  }
  text_finish(&folder);
  return ok && sources;
}

bool cache_load(Scene *s, const char *path, const LoadOptions *options)
{
  Text name = {0};
  RfmFile f = {0};
  cache_path(&name, path);
  const bool ok = !name.failed && rfm_open(&f, text_get(&name), NULL) &&
                  f.head->key == cache_key(path, options) && is_fresh(&f, path) &&
                  rfm_check(&f, options->jobs, NULL) && rfm_fill(&f, s, options, NULL);
  rfm_close(&f);
  text_finish(&name);
  return ok;
}
