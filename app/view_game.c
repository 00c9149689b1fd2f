// Parallax Locks in the window: which chamber is played, the lamp in the player's hand, locks as they stand, and what has been
// solved. The game goes in steps of a sixtieth of a second, whatever the frames do, and looks at nothing but the walker and the
// world, so a script plays it again exactly.

#include "view.h"

#include "chamber.h"
#include "output.h"

#include <dirent.h>
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#define STEP (1.0 / 60) // as a frame of a script is
#define NEXT_AFTER 2.5 // seconds from the exit to the next chamber
enum { MOST_CHAMBERS = 64, MOST_PROGRESS = 1 << 16, MOST_CELLS = 32 };

struct Game {
  char folder[1024], names[MOST_CHAMBERS][128]; // without the extension
  char progress_path[1024];
  char *solved; // owned: names, a line each
  int count, at;
  Chamber chamber;
  bool is_begun; // its scene is shown and the player stands in it
  bool is_solved, is_over, has_lamp;
  double left, until; // seconds: not yet played; when the next chamber comes, by the clock
  int lamp_cell;      // of a lamp that hangs somewhere
  rf_vec3 lamp, sent; // sent: where the scene has it
  int sent_cell;
  uint64_t since;  // edit that brought its scene
  uint64_t judged; // edit that the photocells were judged in; 0: none yet
  double light[MOST_LOCKS], got[MOST_LOCKS];
  bool holds[MOST_LOCKS], were_open;
  float size; // of the walker where he began
  char cells[MOST_CELLS][64]; // names, so that moving the lamp waits for nobody
};

// --- which chambers ---------------------------------------------------------------------------------
static bool is_chamber(const char *name)
{
  const size_t n = strlen(name);
  return n > 6 && n < 120 && !strcmp(name + n - 6, ".locks");
}

static int by_name(const void *a, const void *b) { return strcmp(a, b); }

static ExitCode list_chambers(Game *g)
{
  DIR *d = opendir(g->folder);
  if (!d) return fail(EXIT_NO_INPUT, "%s: %s", g->folder, strerror(errno));
  for (struct dirent *e; (e = readdir(d)) && g->count < MOST_CHAMBERS;)
    if (is_chamber(e->d_name)) snprintf(g->names[g->count++], sizeof g->names[0], "%.*s", (int)strlen(e->d_name) - 6, e->d_name);
  closedir(d);
  if (!g->count) return fail(EXIT_NO_INPUT, "%s: there are no chambers in it (files NAME.locks)", g->folder);
  qsort(g->names, (size_t)g->count, sizeof g->names[0], by_name);
  return EXIT_DONE;
}

// --- what has been solved ---------------------------------------------------------------------------
// Folders that are not there are made when there is something to keep.
static void choose_progress(Game *g, const char *wanted)
{
  const char *state = getenv("XDG_STATE_HOME"), *home = getenv("HOME");
  if (wanted)
    snprintf(g->progress_path, sizeof g->progress_path, "%s", wanted);
  else if (state && *state == '/')
    snprintf(g->progress_path, sizeof g->progress_path, "%s/rayfold/locks", state);
  else if (home && *home)
    snprintf(g->progress_path, sizeof g->progress_path, "%s/.local/state/rayfold/locks", home);
}

static ExitCode read_progress(Game *g)
{
  g->solved = calloc(MOST_PROGRESS, 1);
  if (!g->solved) return fail(EXIT_INTERNAL, "not enough memory");
  FILE *in = *g->progress_path ? fopen(g->progress_path, "rb") : NULL;
  if (!in) return EXIT_DONE; // nothing has been solved yet
  const size_t n = fread(g->solved, 1, MOST_PROGRESS - 200, in);
  fclose(in);
  if (strlen(g->solved) != n)
    return fail(EXIT_BAD_SCENE, "%s is no list of solved chambers; remove it to begin anew", g->progress_path);
  return EXIT_DONE;
}

static bool was_solved(const Game *g, const char *name)
{
  const size_t n = strlen(name);
  for (const char *at = g->solved; (at = strstr(at, name)); at += n)
    if ((at == g->solved || at[-1] == '\n') && at[n] == '\n') return true;
  return false;
}

static void keep_progress(View *v)
{
  Game *g = v->game;
  const char *name = g->names[g->at];
  if (was_solved(g, name) || !*g->progress_path) return;
  const size_t n = strlen(g->solved);
  if (n + strlen(name) + 2 > MOST_PROGRESS) return;
  snprintf(g->solved + n, MOST_PROGRESS - n, "%s\n", name);
  for (char *c = g->progress_path + 1; *c; c++) {
    if (*c != '/') continue;
    *c = 0;
    (void)mkdir(g->progress_path, 0777); // what cannot be made is told when the file is written
    *c = '/';
  }
  if (output_write(g->progress_path, g->solved, strlen(g->solved)))
    note_say(v, true, "what is solved could not be kept in %s", g->progress_path);
}

// --- coming and going -------------------------------------------------------------------------------
static ExitCode open_chamber(View *v, int at)
{
  Game *g = v->game;
  char path[1200];
  g->at = at;
  snprintf(path, sizeof path, "%s/%s.locks", g->folder, g->names[at]);
  const ExitCode code = chamber_read(&g->chamber, path);
  if (code) return code;
  g->is_begun = g->is_solved = g->were_open = false;
  g->judged = 0;
  view_open(v, g->chamber.scene);
  return EXIT_DONE;
}

ExitCode game_open(View *v, const char *path)
{
  Game *g = v->game = calloc(1, sizeof *g);
  if (!g) return fail(EXIT_INTERNAL, "not enough memory");
  const bool is_one = is_chamber(path);
  const char *slash = strrchr(path, '/');
  if (strlen(path) > 900) return fail(EXIT_NO_INPUT, "%s: the name is too long", path);
  if (is_one)
    snprintf(g->folder, sizeof g->folder, "%.*s", slash ? (int)(slash - path) : 1, slash ? path : ".");
  else
    snprintf(g->folder, sizeof g->folder, "%s", path);
  ExitCode code = list_chambers(g);
  choose_progress(g, args_text(v->args, "progress"));
  if (!code) code = read_progress(g);
  if (code) return code;
  int first = 0;
  if (is_one) {
    const char *name = slash ? slash + 1 : path;
    while (first < g->count && strncmp(g->names[first], name, strlen(name) - 6)) first++;
    if (first == g->count) return fail(EXIT_NO_INPUT, "%s: no such file", path);
  } else {
    while (first < g->count - 1 && was_solved(g, g->names[first])) first++;
  }
  return open_chamber(v, first);
}

void game_close(View *v)
{
  if (v->game) free(v->game->solved);
  free(v->game);
  v->game = NULL;
}

// The scene is on show: the player stands where it begins.
void game_begin(View *v, uint64_t edit)
{
  Game *g = v->game;
  Walker *w = &v->walker;
  rf_scene *s;
  if (g && strcmp(v->path, g->chamber.scene)) { // another scene was opened
    game_close(v);
    return note_say(v, false, "the game is left; open a chamber to play on");
  }
  if (!g || g->is_begun || !scene_take(v, 5, &s)) return;
  g->since = edit;
  const ExitCode code = chamber_resolve(&g->chamber, s);
  for (int i = 1; i < MOST_CELLS; i++) {
    const char *name = rf_cell_name(s, i);
    snprintf(g->cells[i], sizeof g->cells[0], "%s", name ? name : "");
  }
  rf_live_return(v->live);
  if (code) {
    v->code = code;
    return;
  }
  const Chamber *c = &g->chamber;
  rf_eye eye = w->lens;
  eye.frame = player_begin(c).body.frame;
  eye.cell = c->start.cell_i;
  w->size = 6; // flying, a metre and a half a second
  walker_set(w, &eye);
  w->is_level = true;
  w->on_foot = !c->flies;
  w->stands = false;
  w->fall = 0;
  w->height = 1.65f;
  w->speed = 1;
  g->size = w->size;
  walker_carry(w, c->has_arrow);
  g->has_lamp = false;
  g->lamp = g->sent = c->lamp.place;
  g->lamp_cell = c->lamp.cell_i;
  g->sent_cell = -1;
  g->left = 0;
  g->is_begun = true;
  v->is_asked = true;
}

// --- the lamp ---------------------------------------------------------------------------------------
static Player player_of(const View *v)
{
  const Walker *w = &v->walker;
  Player p = {.arrow = w->arrow, .arrow_home = w->arrow_home};
  p.body = (rf_body){.frame = walker_eye(w).frame, .scale = w->size / v->game->size, .cell = w->pose.cell};
  return p;
}

static void send_lamp(View *v, int cell, rf_vec3 place)
{
  Game *g = v->game;
  char cell_json[140], place_json[100];
  if (g->sent_cell == cell && !memcmp(&g->sent, &place, sizeof place)) return;
  lamp_values(cell > 0 && cell < MOST_CELLS ? g->cells[cell] : NULL, place, cell_json, place_json);
  if (g->sent_cell != cell) rf_live_set(v->live, "lights[0].cell", cell_json, false);
  rf_live_set(v->live, "lights[0].position", place_json, true);
  g->sent_cell = cell;
  g->sent = place;
}

static void carry_lamp(View *v, const rf_world *w)
{
  Game *g = v->game;
  if (!g->chamber.has_lamp) return;
  if (g->has_lamp) {
    const Player p = player_of(v);
    const rf_body hand = player_lamp(w, &p);
    g->lamp = hand.frame.p;
    g->lamp_cell = hand.cell;
  }
  send_lamp(v, g->lamp_cell, g->lamp);
}

void game_lamp(View *v)
{
  Game *g = v->game;
  if (!g || !g->is_begun) return note_say(v, false, "the lamp is for Parallax Locks: rayfold view scenes/locks --game");
  if (!g->chamber.has_lamp) return note_say(v, false, "there is no lamp in this chamber");
  const Player p = player_of(v);
  if (!g->has_lamp && !player_reaches(&p, g->lamp_cell, g->lamp)) return note_say(v, true, "the lamp is too far away");
  g->has_lamp = !g->has_lamp;
  note_say(v, false, g->has_lamp ? "you carry the lamp" : "the lamp hangs here");
}

void game_again(View *v)
{
  Game *g = v->game;
  if (!g) return;
  if (!g->is_begun) return;
  g->is_begun = g->is_solved = false;
  game_begin(v, g->since);
  note_say(v, false, "the chamber begins again");
}

// --- locks ------------------------------------------------------------------------------------------
// Photocells are judged once for each world that came on show, and so after every move of the lamp.
static void judge(View *v, const rf_world *w)
{
  Game *g = v->game;
  const uint64_t edit = v->frame.edit + 1;
  const Player p = player_of(v);
  for (int i = 0; i < g->chamber.lock_count; i++) {
    const Lock *l = &g->chamber.locks[i];
    if (l->kind == LOCK_LIGHT && g->judged != edit) g->light[i] = lock_light(w, l);
    const bool held = g->holds[i];
    g->holds[i] = lock_holds(l, w, &p, g->light[i], &g->got[i]);
    if (held != g->holds[i]) v->is_dirty = true;
  }
  g->judged = edit;
}

static void show_exit(View *v, bool is_open)
{
  if (v->game->were_open == is_open) return;
  v->game->were_open = is_open;
  rf_live_set(v->live, "materials.exit.color", is_open ? "[0.05, 1, 0.2]" : "[1, 0.08, 0.04]", false);
  if (is_open) note_say(v, false, "all locks are open: to the exit");
}

static void solve(View *v)
{
  Game *g = v->game;
  g->is_solved = true;
  g->until = v->clock + NEXT_AFTER;
  keep_progress(v);
  g->is_over = g->at + 1 == g->count;
  note_say(v, false, g->is_over ? "solved, and that was the last chamber" : "solved");
}

static void step(View *v, const rf_world *w)
{
  Game *g = v->game;
  bool all = true;
  carry_lamp(v, w);
  judge(v, w);
  for (int i = 0; i < g->chamber.lock_count; i++) all &= g->holds[i];
  show_exit(v, all);
  const Player p = player_of(v);
  if (all && player_is_at(&p, &g->chamber.exit, g->chamber.exit_radius * (double)(p.body.scale < 1 ? 1 : p.body.scale))) solve(v);
}

// Moves the walker in fixed steps. True if the eye is another.
bool game_turn(View *v, const Wish *wish, double seconds)
{
  Game *g = v->game;
  bool moved = false;
  rf_world *w = g->is_begun && v->frame.number && v->frame.edit >= g->since ? view_world(v) : NULL;
  if (!w) return false;
  if (g->is_solved && !g->is_over && v->clock >= g->until) {
    v->code = open_chamber(v, g->at + 1);
    return true;
  }
  g->left = fmin(g->left + seconds, 0.25); // after a stall, no leap
  for (; g->left >= STEP - 1e-9; g->left -= STEP) {
    moved |= walker_move(&v->walker, wish, STEP, w);
    if (!g->is_solved) step(v, w);
  }
  return moved;
}

int game_lines(const View *v, char title[96], char hint[200], char lines[][112], bool open[], int most)
{
  const Game *g = v->game;
  if (!g || !g->is_begun) return 0;
  snprintf(title, 96, "%d of %d  %.70s%s", g->at + 1, g->count, g->chamber.title, g->is_solved ? "  solved" : "");
  snprintf(hint, 200, "%s", g->chamber.hint);
  int n = 0;
  for (; n < g->chamber.lock_count && n < most; n++) {
    char text[96];
    lock_text(&g->chamber.locks[n], g->got[n], text);
    snprintf(lines[n], 112, "%s", text);
    open[n] = g->holds[n];
  }
  return n;
}

int game_open_locks(const View *v)
{
  int n = 0;
  for (int i = 0; v->game && v->game->is_begun && i < v->game->chamber.lock_count; i++) n += v->game->holds[i];
  return n;
}
