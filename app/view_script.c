// A script instead of a person, for tests and recordings: lines of commands, a clock of its own that goes on a sixtieth
// of a second a frame, and exactly one frame of the live picture a step. `rayfold view --help` has the commands.

#include "view.h"

#include "library.h"
#include "output.h"

#include <ctype.h>
#include <stdarg.h>
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { MOST_WORDS = 8, MOST_SETTLE = 20000 };

struct Script {
  char *text; // owned
  char *at;
  const char *path;
  int line;
  unsigned mods;
};

// One frame: moves, edits, renders one picture and shows it.
static void frame(View *v)
{
  const double step = 1.0 / 60;
  view_check_file(v);
  v->clock += step;
  view_turn(v, step);
  if (v->live) rf_live_step(v->live);
  view_check_file(v);
  shot_step(v);
  view_show(v);
}

static void settle(View *v)
{
  frame(v);
  if (v->code) return;
  for (int i = 0; i < MOST_SETTLE && v->live && rf_live_step(v->live); i++) continue;
  v->clock += 1.0 / 60;
  view_turn(v, 0);
  pick_refresh(v);
  view_show(v);
}

static void bad(View *v, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void bad(View *v, const char *format, ...)
{
  char text[600];
  va_list args;
  va_start(args, format);
  vsnprintf(text, sizeof text, format, args);
  va_end(args);
  v->code = fail(EXIT_BAD_SCENE, "%s:%d: %s", v->script->path, v->script->line, text);
  v->is_over = true;
}

// --- commands -------------------------------------------------------------------------------------
typedef struct Words {
  char *word[MOST_WORDS];
  int count;
} Words;

// What is far too large, or no number, is as good as its bound.
enum { MOST_NUMBER = 1000000 };
static double real(const Words *w, int i)
{
  const double x = i < w->count ? strtod(w->word[i], NULL) : 0;
  return x < -MOST_NUMBER ? -MOST_NUMBER : x > MOST_NUMBER ? MOST_NUMBER : x == x ? x : 0;
}
static long number(const Words *w, int i) { return (long)real(w, i); }

// "ctrl+shift+z"
static bool read_key(const char *text, Event *e)
{
  static const struct {
    const char *name;
    unsigned mod;
  } mods[] = {{"shift+", MOD_SHIFT}, {"ctrl+", MOD_CTRL}, {"alt+", MOD_ALT}};
  for (size_t i = 0; i < 3;) {
    const size_t n = strlen(mods[i].name);
    if (!strncmp(text, mods[i].name, n)) {
      e->mods |= mods[i].mod;
      text += n;
      i = 0;
    } else {
      i++;
    }
  }
  return e->key = key_from_name(text), e->key != 0;
}

static void do_key(View *v, const Words *w, bool is_down, bool is_up)
{
  Event e = {.kind = EVENT_KEY, .mods = v->script->mods};
  if (w->count < 2 || !read_key(w->word[1], &e)) return bad(v, "there is no key \"%s\"", w->count > 1 ? w->word[1] : "");
  const unsigned mod = e.key == KEY_SHIFT ? MOD_SHIFT : e.key == KEY_CTRL ? MOD_CTRL : e.key == KEY_ALT ? MOD_ALT : 0;
  if (is_down) v->script->mods |= mod;
  if (is_down) input_event(v, &e);
  e.kind = EVENT_KEY_UP;
  if (is_up) v->script->mods &= ~mod;
  if (is_up) input_event(v, &e);
}

static void do_mouse(View *v, const Words *w)
{
  static const char *const buttons[] = {"", "left", "middle", "right"};
  Event e = {.kind = EVENT_MOVE, .mods = v->script->mods, .x = v->mouse_x, .y = v->mouse_y};
  if (!strcmp(w->word[0], "mouse")) {
    if (w->count < 3) return bad(v, "mouse needs X Y");
    e.x = (int)number(w, 1);
    e.y = (int)number(w, 2);
  } else if (!strcmp(w->word[0], "wheel")) {
    e.kind = EVENT_WHEEL;
    e.wheel = (float)fmax(-100, fmin(100, real(w, 1)));
  } else {
    e.kind = !strcmp(w->word[0], "press") ? EVENT_PRESS : EVENT_RELEASE;
    for (int i = 1; i < 4 && w->count > 1; i++)
      if (!strcmp(w->word[1], buttons[i])) e.button = i;
    if (!e.button) return bad(v, "the buttons are left, middle and right");
  }
  input_event(v, &e);
}

static void do_save(View *v, const Words *w)
{
  const size_t n = (size_t)v->width * (size_t)v->height;
  uint32_t *pixels = malloc(n * sizeof *pixels);
  if (w->count < 2 || !pixels || !v->kind->grab(v->screen, pixels, v->width, v->height))
    bad(v, "nothing is shown that could be saved");
  else if (!pixels_save(v, pixels, v->width, v->height, w->word[1]))
    bad(v, "%s cannot be written", w->word[1]);
  free(pixels);
}

// The first megabytes of a file, with a zero behind them; NULL, and a message, if it is longer or cannot be read.
static char *read_text(const char *path, size_t *size, ExitCode *code)
{
  const size_t most = 1 << 22;
  char *text = calloc(most + 1, 1);
  FILE *in = fopen(path, "rb");
  if (text && in) *size = fread(text, 1, most, in);
  if (!text)
    *code = fail(EXIT_INTERNAL, "not enough memory to read %s", path);
  else if (!in || ferror(in))
    *code = fail(EXIT_NO_INPUT, "%s: %s", path, in ? "cannot be read" : "no such file");
  else if (*size == most)
    *code = fail(EXIT_BAD_SCENE, "%s is longer than four megabytes", path);
  if (in) fclose(in);
  if (!*code) return text;
  free(text);
  return NULL;
}

// As an editor would write it: the viewer should see that its file has changed.
static void do_copy(View *v, const Words *w)
{
  size_t size = 0;
  char *text = read_text(w->word[1], &size, &v->code);
  if (text) v->code = output_write(w->word[2], text, size);
  free(text);
}

static void do_hash(View *v)
{
  if (!v->pixels || v->canvas_width != v->width || v->canvas_height != v->height) return bad(v, "nothing is shown yet");
  uint64_t h = 14695981039346656037u; // FNV-1a
  for (size_t i = 0; i < (size_t)v->width * (size_t)v->height; i++) h = (h ^ v->pixels[i]) * 1099511628211u;
  printf("%016" PRIx64 "\n", h);
}

// --- expectations ---------------------------------------------------------------------------------
static void expect_value(View *v, const Words *w)
{
  rf_scene *s;
  if (w->count < 4 || !scene_take(v, 2, &s)) return bad(v, "expect value PATH JSON");
  const char *json = rf_get(s, w->word[2]);
  rf_error(v->engine, NULL);
  char *end;
  const double wanted = strtod(w->word[3], &end), got = json ? strtod(json, NULL) : NAN;
  const bool ok = json && (end != w->word[3] && !*end ? fabs(wanted - got) <= 0.02 * fmax(1, fabs(wanted)) : !strcmp(json, w->word[3]));
  if (!ok) bad(v, "%s is %s, not %s", w->word[2], json ? json : "nothing", w->word[3]);
  rf_live_return(v->live);
}

static void expect_open(View *v, const Words *w)
{
  char title[96], hint[200], lines[1][112] = {""};
  bool open[1];
  (void)game_lines(v, title, hint, lines, open, 1);
  if (number(w, 2) != game_open_locks(v)) bad(v, "%d locks are open; %s", game_open_locks(v), lines[0]);
}

static void expect(View *v, const Words *w)
{
  const char *what = w->count > 2 ? w->word[1] : "";
  const Picked *p = &v->picked;
  const rf_vec3 at = v->walker.pose.place;
  if (!strcmp(what, "picked")) {
    if (strcmp(w->word[2], p->object ? p->name : "nothing"))
      bad(v, "\"%s\" is picked, not %s", p->object ? p->name : "nothing", w->word[2]);
  } else if (!strcmp(what, "value")) {
    expect_value(v, w);
  } else if (!strcmp(what, "note")) {
    if (!strstr(v->note.text, w->word[2])) bad(v, "the note is \"%s\"", v->note.text);
  } else if (!strcmp(what, "proof")) {
    bool is_there = false;
    for (int i = 0; i < v->proof.line_count; i++) is_there |= strstr(v->proof.lines[i], w->word[2]) != NULL;
    if (!is_there) bad(v, "what is measured is \"%s\"", v->proof.line_count ? v->proof.lines[0] : "nothing");
  } else if (!strcmp(what, "caption")) {
    if (!strstr(v->caption.title, w->word[2]) && !strstr(v->caption.text, w->word[2])) bad(v, "the caption is \"%s\"", v->caption.title);
  } else if (!strcmp(what, "open")) {
    expect_open(v, w);
  } else if (!strcmp(what, "view")) {
    if (strcmp(w->word[2], v->wanted.render.integrator)) bad(v, "the view is %s", v->wanted.render.integrator);
  } else if (!strcmp(what, "samples")) {
    if (number(w, 2) != v->frame.samples) bad(v, "there are %d samples", v->frame.samples);
  } else if (!strcmp(what, "size")) {
    if (number(w, 2) != v->frame.width || number(w, 3) != v->frame.height) bad(v, "it is %dx%d", v->frame.width, v->frame.height);
  } else if (!strcmp(what, "file")) {
    if (access(w->word[2], R_OK)) bad(v, "%s is not there", w->word[2]);
  } else if (!strcmp(what, "eye") && w->count == 6) {
    const double x = real(w, 2) - (double)at.x, y = real(w, 3) - (double)at.y, z = real(w, 4) - (double)at.z;
    if (!(sqrt(x * x + y * y + z * z) <= real(w, 5)))
      bad(v, "the eye is at %.4f %.4f %.4f", (double)at.x, (double)at.y, (double)at.z);
  } else {
    bad(v, "expect picked NAME, value PATH JSON, note TEXT, proof TEXT, caption TEXT, open N, view NAME, samples N, size W H, file PATH or eye X Y Z NEAR");
  }
}

// --------------------------------------------------------------------------------------------------
// A word ends at a space, or, begun with a quote, at the next one.
static Words split(char *line)
{
  Words w = {0};
  while (w.count < MOST_WORDS) {
    while (isspace((unsigned char)*line)) line++;
    if (!*line || *line == '#') break;
    const bool is_quoted = *line == '\'';
    w.word[w.count++] = line += is_quoted;
    while (*line && (is_quoted ? *line != '\'' : !isspace((unsigned char)*line))) line++;
    if (*line) *line++ = 0;
  }
  return w;
}

static void run(View *v, const Words *w)
{
  const char *c = w->word[0];
  Event e = {.kind = EVENT_DROP};
  if (!strcmp(c, "frame")) {
    const long n = w->count > 1 ? number(w, 1) : 1;
    for (long i = 0; i < n && !v->is_over && !v->code; i++) frame(v);
  } else if (!strcmp(c, "settle")) {
    settle(v);
  } else if (!strcmp(c, "key")) {
    do_key(v, w, true, true);
  } else if (!strcmp(c, "down")) {
    do_key(v, w, true, false);
  } else if (!strcmp(c, "up")) {
    do_key(v, w, false, true);
  } else if (!strcmp(c, "mouse") || !strcmp(c, "press") || !strcmp(c, "release") || !strcmp(c, "wheel")) {
    do_mouse(v, w);
  } else if (!strcmp(c, "resize") && w->count == 3) {
    e = (Event){.kind = EVENT_RESIZE, .x = (int)number(w, 1), .y = (int)number(w, 2)};
    if (e.x < 16 || e.y < 16 || e.x > 8192 || e.y > 8192) return bad(v, "resize W H: 16 to 8192 each");
    input_event(v, &e);
  } else if (!strcmp(c, "drop") && w->count == 2) {
    snprintf(e.path, sizeof e.path, "%s", w->word[1]);
    input_event(v, &e);
  } else if (!strcmp(c, "save") && w->count == 2) {
    do_save(v, w);
  } else if (!strcmp(c, "copy") && w->count == 3) {
    do_copy(v, w);
  } else if (!strcmp(c, "hash")) {
    do_hash(v);
  } else if (!strcmp(c, "expect")) {
    expect(v, w);
  } else if (!strcmp(c, "quit")) {
    v->is_over = true;
  } else {
    bad(v, "there is no command \"%s\"; `rayfold view --help` lists them", c);
  }
}

void script_step(View *v)
{
  Script *s = v->script;
  if (!*s->at) {
    v->is_over = true;
    return;
  }
  char *line = s->at, *end = strchr(line, '\n');
  s->at = end ? end + 1 : line + strlen(line);
  if (end) *end = 0;
  s->line++;
  const Words w = split(line);
  if (w.count) run(v, &w);
}

Script *script_open(const char *path, ExitCode *code)
{
  size_t size = 0;
  Script *s = calloc(1, sizeof *s);
  if (!s) return *code = fail(EXIT_INTERNAL, "not enough memory"), NULL;
  *s = (Script){.path = path, .text = read_text(path, &size, code)};
  s->at = s->text;
  if (s->text && strlen(s->text) != size) *code = fail(EXIT_BAD_SCENE, "%s is no text", path);
  if (!*code) return s;
  script_finish(s);
  return NULL;
}

void script_finish(Script *s)
{
  if (!s) return;
  free(s->text);
  free(s);
}
