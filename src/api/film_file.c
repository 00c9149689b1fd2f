// Films in files through the public interface.

#include "api/api.h"

#include "base/hash.h"
#include "base/mem.h"
#include "render/film_file.h"

#include <stdlib.h>

static uint64_t eye_hash(uint64_t h, const rf_eye *e)
{
  const float axes[12] = {e->frame.x.x, e->frame.x.y, e->frame.x.z, e->frame.y.x, e->frame.y.y, e->frame.y.z,
                          e->frame.z.x, e->frame.z.y, e->frame.z.z, e->frame.p.x, e->frame.p.y, e->frame.p.z};
  const float lens[4] = {e->fov, e->focus, e->aperture, e->height};
  const int kinds[2] = {(int)e->lens, e->blades};
  return hash_bytes(hash_bytes(hash_bytes(h, axes, sizeof axes), lens, sizeof lens), kinds, sizeof kinds);
}

// The scene's text, but for what does not change the samples: how many, and what becomes of them later.
static bool write_what_counts(const Scene *s, Text *out, Err *err)
{
  Scene like = *s;
  like.render.spp = 1;
  like.render.denoise = DENOISE_OFF;
  // Trees of every kind give the same hits; what they cost is a picture of its own.
  if (like.render.integrator != INTEGRATOR_COST) {
    like.render.tree = SCENE_TREE_FAST;
    like.render.compact = false;
  }
  group_default(&group_develop, 0, &like.develop);
  return scene_write(&like, out, err);
}

// What moves while a shutter is open shows more than the moment's own values, which the text has.
static uint64_t moment_hash(uint64_t h, const Scene *s)
{
  bool opens = s->camera.common.shutter > 0;
  for (size_t i = 0; i < s->cameras.count; i++) opens |= s->cameras.items[i].common.shutter > 0;
  return opens && s->has_time ? hash_bytes(h, &s->time, sizeof s->time) : h;
}

uint64_t rf_picture_key(const rf_scene *s, const rf_world *w, const rf_eye *eye)
{
  if (!s || !w || !eye) return api_bad_argument("rf_picture_key", "scene, world and eye must not be NULL"), 0;
  Err err = {0};
  Text text = {0};
  uint64_t h = 0;
  if (write_what_counts(s->scene, &text, &err)) {
    h = hash_bytes(world_content_hash(w->world), text_get(&text), text.length);
    h = eye_hash(moment_hash(h, s->scene), eye);
    h += h == 0;
  }
  text_finish(&text);
  api_fail(&err);
  return h;
}

bool rf_film_keep(const rf_film *f, const char *path, uint64_t key, const char *note)
{
  if (!f || !path) return api_bad_argument("rf_film_keep", "film and path must not be NULL");
  Err err = {0};
  film_write(f->film, key, note ? note : "", path, &err);
  return api_fail(&err);
}

static rf_film *wrap(rf_engine *e, Film *film, Err *err)
{
  rf_film *f = mem_zero(1, sizeof *f);
  if (!f) {
    err_memory(err, "a film", sizeof *f);
    film_destroy(film);
    return NULL;
  }
  *f = (rf_film){.engine = e, .film = film};
  return f;
}

rf_film *rf_film_open(rf_engine *e, const char *path, rf_film_label *out)
{
  if (!e || !path) return api_bad_argument("rf_film_open", "engine and path must not be NULL"), NULL;
  Err err = {0};
  FilmLabel label = {0};
  bool is_older;
  Film *film = film_read(path, &label, &is_older, &err);
  rf_film *f = film ? wrap(e, film, &err) : NULL;
  if (f && out) {
    *out = (rf_film_label){label.key, strdup(text_get(&label.note)), is_older};
    if (!out->note) {
      err_memory(&err, "a film's note", label.note.length);
      rf_film_destroy(f);
      f = NULL;
    }
  }
  text_finish(&label.note);
  api_fail(&err);
  return f;
}

// The lowest sample that some cell has in [from, ...), with the end of what is joined to it; first == end: none.
static CellRange next_samples(const Film *f, uint32_t from)
{
  CellRange found = {0, UINT32_MAX, UINT32_MAX};
  for (size_t i = 0; i < f->ranges.count; i++) {
    const CellRange r = f->ranges.items[i];
    const uint32_t first = r.first > from ? r.first : from;
    if (r.end > from && (first < found.first || (first == found.first && r.end > found.end))) found = (CellRange){0, first, r.end};
  }
  return found;
}

size_t rf_film_samples(const rf_film *f, int (*pairs)[2], size_t most)
{
  size_t n = 0;
  int end = -1;
  if (!f) return api_bad_argument("rf_film_samples", "the film is NULL"), 0;
  for (CellRange r = next_samples(f->film, 0); r.first < r.end; r = next_samples(f->film, r.end)) {
    const bool is_joined = n && (int)r.first == end;
    n += !is_joined;
    end = (int)r.end;
    if (!pairs || n > most) continue;
    if (!is_joined) pairs[n - 1][0] = (int)r.first;
    pairs[n - 1][1] = end;
  }
  return n;
}

unsigned rf_film_planes(const rf_film *f)
{
  return f ? f->film->planes : 0;
}
