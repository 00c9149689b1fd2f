// Reads a chamber: one word and its values a line; what follows # is a remark. Every fault is told with file and line.

#include "chamber.h"

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_WORDS = 24, LINE = 400 };

typedef struct Reader {
  Chamber *c;
  int line;
  char *word[MOST_WORDS];
  int count;
  ExitCode code;
} Reader;

static void bad(Reader *r, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void bad(Reader *r, const char *format, ...)
{
  char text[300];
  va_list args;
  if (r->code) return;
  va_start(args, format);
  vsnprintf(text, sizeof text, format, args);
  va_end(args);
  r->code = fail(EXIT_BAD_SCENE, "%s:%d: %s", r->c->path, r->line, text);
}

static double number(Reader *r, int i, double low, double high, const char *what)
{
  char *end = NULL;
  const double x = i < r->count ? strtod(r->word[i], &end) : NAN;
  if (i >= r->count || end == r->word[i] || *end || !(x >= low && x <= high)) {
    bad(r, "%s: word %d should be %s, a number from %g to %g%s%s", r->word[0], i, what, low, high,
        i < r->count ? ", and is " : "", i < r->count ? r->word[i] : "");
    return 0;
  }
  return x;
}

static rf_vec3 vector(Reader *r, int i, const char *what)
{
  double v[3];
  for (int k = 0; k < 3; k++) v[k] = number(r, i + k, -1e4, 1e4, what);
  return (rf_vec3){(float)v[0], (float)v[1], (float)v[2]};
}

static void text(Reader *r, char *out, size_t size, int i)
{
  if (i >= r->count) return bad(r, "%s: something is missing after it", r->word[0]);
  if (strlen(r->word[i]) >= size) return bad(r, "%s: \"%s\" is longer than %zu letters", r->word[0], r->word[i], size - 1);
  snprintf(out, size, "%s", r->word[i]);
}

// X Y Z, and the cell's name as the last word if there is one more.
static Spot spot(Reader *r, int i, int after)
{
  Spot s = {.place = vector(r, i, "a place in metres"), .line = r->line};
  if (r->count > after) text(r, s.cell, sizeof s.cell, after);
  if (r->count > after + 1) bad(r, "%s: \"%s\" is one word too many", r->word[0], r->word[after + 1]);
  return s;
}

static int spot_named(Reader *r, int i)
{
  for (int k = 0; i < r->count && k < r->c->spot_count; k++)
    if (!strcmp(r->c->spots[k].name, r->word[i])) return k;
  bad(r, "way: there is no spot \"%s\" above it", i < r->count ? r->word[i] : "");
  return 0;
}

static void read_lock(Reader *r)
{
  Lock l = {0};
  const char *kind = r->count > 1 ? r->word[1] : "";
  if (r->c->lock_count == MOST_LOCKS) return bad(r, "no more than %d locks", MOST_LOCKS);
  if (!strcmp(kind, "light")) {
    l.kind = LOCK_LIGHT;
    l.at = spot(r, 3, 10);
    text(r, l.at.name, sizeof l.at.name, 2);
    l.normal = vector(r, 6, "the way it faces");
    l.low = number(r, 9, 1e-6, 1e6, "a radiance");
    const float n = sqrtf(l.normal.x * l.normal.x + l.normal.y * l.normal.y + l.normal.z * l.normal.z);
    if (!(n > 1e-3f)) return bad(r, "lock light: the way it faces has no length");
    l.normal = (rf_vec3){l.normal.x / n, l.normal.y / n, l.normal.z / n};
  } else if (!strcmp(kind, "size") || !strcmp(kind, "turn")) {
    l.kind = *kind == 's' ? LOCK_SIZE : LOCK_TURN;
    l.low = number(r, 2, 0, l.kind == LOCK_SIZE ? 1e3 : 180, l.kind == LOCK_SIZE ? "a size" : "an angle in degrees");
    l.high = number(r, 3, l.low, l.kind == LOCK_SIZE ? 1e3 : 180, "the largest that opens it");
  } else if (!strcmp(kind, "hand") && r->count == 3 && (!strcmp(r->word[2], "left") || !strcmp(r->word[2], "right"))) {
    l.kind = LOCK_HAND;
    l.low = l.high = *r->word[2] == 'l' ? -1 : 1;
  } else {
    return bad(r, "a lock is one of: light NAME X Y Z NX NY NZ RADIANCE [CELL], size LOW HIGH, hand left, hand right, "
                  "turn LOW HIGH");
  }
  r->c->locks[r->c->lock_count++] = l;
}

static void read_way(Reader *r)
{
  ChamberWay w = {.line = r->line, .leg_count = (r->count - 3) / 3};
  if (r->c->way_count == MOST_WAYS) return bad(r, "no more than %d ways", MOST_WAYS);
  if (r->count < 6 || r->count % 3 || w.leg_count > MOST_LEGS)
    return bad(r, "way FROM TO, and then X Y Z of 1 to %d legs", MOST_LEGS);
  w.from = spot_named(r, 1);
  w.to = spot_named(r, 2);
  for (int i = 0; i < w.leg_count; i++) w.legs[i] = vector(r, 3 + 3 * i, "a leg in metres");
  r->c->ways[r->c->way_count++] = w;
}

static void read_spot(Reader *r)
{
  if (r->c->spot_count == MOST_SPOTS) return bad(r, "no more than %d spots", MOST_SPOTS);
  Spot s = spot(r, 2, 5);
  text(r, s.name, sizeof s.name, 1);
  r->c->spots[r->c->spot_count++] = s;
}

static void read_words(Reader *r)
{
  Chamber *c = r->c;
  const char *w = r->word[0];
  if (!strcmp(w, "lock")) {
    read_lock(r);
  } else if (!strcmp(w, "spot")) {
    read_spot(r);
  } else if (!strcmp(w, "way")) {
    read_way(r);
  } else if (!strcmp(w, "start")) {
    c->start = spot(r, 1, 5);
    c->yaw = (float)(number(r, 4, -360, 360, "where it looks, degrees to the left of -z") * 3.14159265358979 / 180);
    c->has_start = true;
  } else if (!strcmp(w, "lamp")) {
    c->lamp = spot(r, 1, 4);
    c->has_lamp = true;
  } else if (!strcmp(w, "exit")) {
    c->exit = spot(r, 1, 5);
    c->exit_radius = number(r, 4, 1e-3, 1e3, "how near is there, metres");
    c->has_exit = true;
  } else if (!strcmp(w, "arrow") && r->count == 1) {
    c->has_arrow = true;
  } else if (!strcmp(w, "fly") && r->count == 1) {
    c->flies = true;
  } else {
    bad(r, "\"%s\" is none of title, hint, start, lamp, arrow, fly, lock, exit, spot and way, or has too many words", w);
  }
}

// The rest of a line, as it is.
static bool read_sentence(Reader *r, char *line, const char *word, char *out, size_t size)
{
  const size_t n = strlen(word);
  if (strncmp(line, word, n) || !isspace((unsigned char)line[n])) return false;
  line += n + strspn(line + n, " \t");
  line[strcspn(line, "\r\n")] = 0;
  if (strlen(line) >= size) bad(r, "%s: longer than %zu letters", word, size - 1);
  snprintf(out, size, "%s", line);
  return true;
}

static void read_line(Reader *r, char *line)
{
  Chamber *c = r->c;
  line += strspn(line, " \t");
  if (read_sentence(r, line, "title", c->title, sizeof c->title)) return;
  if (read_sentence(r, line, "hint", c->hint, sizeof c->hint)) return;
  line[strcspn(line, "#\r\n")] = 0;
  r->count = 0;
  for (char *w = strtok(line, " \t"); w; w = strtok(NULL, " \t")) {
    if (r->count == MOST_WORDS) return bad(r, "a line has no more than %d words", MOST_WORDS);
    r->word[r->count++] = w;
  }
  if (r->count) read_words(r);
}

static void check_whole(Reader *r)
{
  const Chamber *c = r->c;
  r->line++;
  if (!c->has_start || !c->has_exit || !c->lock_count) bad(r, "a chamber has a start, an exit and a lock at least");
  for (int i = 0; i < c->lock_count; i++) {
    if (c->locks[i].kind == LOCK_LIGHT && !c->has_lamp) bad(r, "a lock wants light, and there is no lamp");
    if (c->locks[i].kind == LOCK_TURN && !c->has_arrow) bad(r, "a lock wants the arrow turned, and there is no arrow");
  }
}

ExitCode chamber_read(Chamber *c, const char *path)
{
  char line[LINE];
  *c = (Chamber){0};
  if (snprintf(c->path, sizeof c->path, "%s", path) >= (int)sizeof c->path)
    return fail(EXIT_NO_INPUT, "%s: the name is too long", path);
  Reader r = {.c = c};
  FILE *in = fopen(path, "r");
  if (!in) return fail(EXIT_NO_INPUT, "%s: %s", path, strerror(errno));
  while (!r.code && fgets(line, sizeof line, in)) {
    r.line++;
    if (strlen(line) == LINE - 1) bad(&r, "longer than %d letters", LINE - 2);
    if (!r.code) read_line(&r, line);
  }
  fclose(in);
  if (!r.code) check_whole(&r);
  const char *dot = strrchr(path, '.'), *slash = strrchr(path, '/');
  const int n = dot && (!slash || dot > slash) ? (int)(dot - path) : (int)strlen(path);
  if (snprintf(c->scene, sizeof c->scene, "%.*s.json", n, path) >= (int)sizeof c->scene)
    return fail(EXIT_NO_INPUT, "%s: the name is too long", path);
  return r.code;
}

static ExitCode resolve(const Chamber *c, const rf_scene *scene, Spot *s)
{
  s->cell_i = *s->cell ? rf_find_cell(scene, s->cell) : 0;
  return s->cell_i >= 0 ? EXIT_DONE : fail(EXIT_BAD_SCENE, "%s:%d: %s has no cell \"%s\"", c->path, s->line, c->scene, s->cell);
}

ExitCode chamber_resolve(Chamber *c, const rf_scene *scene)
{
  ExitCode code = resolve(c, scene, &c->start);
  if (!code) code = resolve(c, scene, &c->exit);
  if (!code && c->has_lamp) code = resolve(c, scene, &c->lamp);
  for (int i = 0; i < c->lock_count && !code; i++) code = resolve(c, scene, &c->locks[i].at);
  for (int i = 0; i < c->spot_count && !code; i++) code = resolve(c, scene, &c->spots[i]);
  return code;
}
