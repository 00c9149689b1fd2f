// The scenes that lie beside the one that is shown: the next, the one before, and a list of them to choose from; and
// what a scene says of itself ("about"), under the picture when it is opened. The folder is read when it is asked for.

#include "view.h"

#include "output.h"

#include <dirent.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

enum { CAPTION_SECONDS = 12 };

static int by_name(const void *a, const void *b) { return strcasecmp(*(char *const *)a, *(char *const *)b); }

static void list_clear(SceneList *l)
{
  for (int i = 0; i < l->count; i++) free(l->names[i]);
  l->count = 0;
}

void list_finish(View *v) { list_clear(&v->list); }

// Scenes and models of a folder, by name.
static void list_read(SceneList *l, const char *folder)
{
  list_clear(l);
  snprintf(l->folder, sizeof l->folder, "%s", folder);
  DIR *d = opendir(folder);
  if (!d) return;
  for (const struct dirent *e; l->count < MOST_SCENES && (e = readdir(d));) {
    const bool is_scene = e->d_name[0] != '.' && output_is_any(e->d_name, ".json|.glb|.gltf|.obj|.ply|.stl|.vox|.rfm");
    if (is_scene && (l->names[l->count] = strdup(e->d_name))) l->count++;
  }
  closedir(d);
  qsort(l->names, (size_t)l->count, sizeof *l->names, by_name);
}

static void split(const char *path, char folder[1024], const char **name)
{
  const char *slash = strrchr(path, '/');
  *name = slash ? slash + 1 : path;
  snprintf(folder, 1024, "%.*s", slash ? (int)(slash - path) + (slash == path) : 1, slash ? path : ".");
}

// The folder of what is shown or being opened, and where in it that is.
static void look(View *v)
{
  char folder[1024];
  const char *name;
  SceneList *l = &v->list;
  split(v->loader.path, folder, &name);
  list_read(l, folder);
  l->at = 0;
  for (int i = 0; i < l->count; i++)
    if (!strcmp(l->names[i], name)) l->at = i;
}

static void open_at(View *v, int i)
{
  char path[1024];
  if (i < 0 || i >= v->list.count) return;
  if (snprintf(path, sizeof path, "%s/%s", v->list.folder, v->list.names[i]) >= (int)sizeof path) return;
  view_open(v, path);
}

void list_step(View *v, int step)
{
  if (v->loader.is_running) return;
  look(v);
  if (v->list.count < 2) return note_say(v, true, "no other scene lies in %s", v->list.folder);
  v->list.at = (v->list.at + step + v->list.count) % v->list.count;
  open_at(v, v->list.at);
}

void list_toggle(View *v)
{
  v->list.is_open = !v->list.is_open;
  if (v->list.is_open) look(v);
}

// Keys while the list is open; false: not one of its.
bool list_key(View *v, int key)
{
  SceneList *l = &v->list;
  if (!l->is_open) return false;
  switch (key) {
  case KEY_UP: l->at -= l->at > 0; return true;
  case KEY_DOWN: l->at += l->at + 1 < l->count; return true;
  case KEY_ESCAPE: l->is_open = false; return true;
  case KEY_ENTER:
    l->is_open = false;
    open_at(v, l->at);
    return true;
  default: return false;
  }
}

bool list_press(View *v, int x, int y)
{
  SceneList *l = &v->list;
  if (!l->is_open) return false;
  const bool is_inside = x >= l->x && x < l->x + l->width && y >= l->y && y < l->y + l->shown * l->row;
  l->is_open = false;
  if (is_inside && l->row > 0) open_at(v, l->first + (y - l->y) / l->row);
  return true;
}

bool list_first(const char *folder, char out[1024])
{
  struct stat s;
  if (stat(folder, &s) || !S_ISDIR(s.st_mode)) return false;
  SceneList *l = calloc(1, sizeof *l);
  if (!l) return false;
  list_read(l, folder);
  const bool ok = l->count && snprintf(out, 1024, "%s%s%s", folder, folder[strlen(folder) - 1] == '/' ? "" : "/", l->names[0]) < 1024;
  list_clear(l);
  free(l);
  return ok;
}

// --- what a scene says of itself --------------------------------------------------------------------
// A JSON text without its quotes and escapes; null is empty.
static void unquoted(const char *json, char *out, size_t size)
{
  size_t n = 0;
  for (json += *json == '"'; n + 1 < size && *json && strcmp(json, "\""); json++) {
    const bool is_escaped = *json == '\\' && json[1];
    json += is_escaped;
    out[n++] = is_escaped && (*json == 'n' || *json == 't') ? ' ' : *json;
  }
  out[n] = 0;
}

static void read_text(rf_scene *s, const char *path, char *out, size_t size)
{
  const char *json = rf_get(s, path);
  *out = 0;
  if (json && *json == '"') unquoted(json, out, size);
}

void caption_take(View *v, rf_scene *s)
{
  Caption *c = &v->caption;
  read_text(s, "about.title", c->title, sizeof c->title);
  read_text(s, "about.text", c->text, sizeof c->text);
  c->until = *c->title || *c->text ? v->clock + CAPTION_SECONDS : 0;
}
