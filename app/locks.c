// `rayfold locks`: proves that chambers of Parallax Locks can be solved. From the spots and ways that a chamber names it searches
// what a player can do, nearest first: every way is walked by rf_walk(), against walls and through gates, and every lock is
// judged as in the window. Prints the shortest solution.

#include "chamber.h"
#include "commands.h"
#include "library.h"
#include "output.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const Option locks_options[] = {
    {.name = "quiet", .letter = 'q', .kind = OPTION_FLAG, .sentence = "Only say which cannot be solved."},
    OPTION_ALLOW_OUTSIDE,
    {0},
};

enum { MOST_STATES = 20000, CARRIED = -1, MOST_LAMPS = 64 };
#define NEAR 0.3 // metres from a spot, times his size, that a way may end

typedef struct State {
  Player player;
  int spot;      // -1: the start
  int lamp_cell; // CARRIED
  rf_vec3 lamp;
  int parent, depth;
  char action[80];
} State;

typedef struct Lit { // what the photocells get from a place of the lamp
  int cell;
  rf_vec3 place;
  double light[MOST_LOCKS];
} Lit;

typedef struct Solver {
  Chamber chamber;
  rf_engine *engine;
  rf_scene *scene;
  rf_world *world;
  State *states; // owned
  int count, at;
  Lit lit[MOST_LAMPS];
  int lit_count;
  double got[MOST_LOCKS]; // at the end
  ExitCode code;
} Solver;

static rf_vec3 add(rf_vec3 a, rf_vec3 b, float s) { return (rf_vec3){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z}; }

// --- light ------------------------------------------------------------------------------------------
static bool put_lamp(Solver *s, int cell, rf_vec3 place)
{
  char cell_json[140], place_json[100];
  lamp_values(rf_cell_name(s->scene, cell), place, cell_json, place_json);
  rf_world *next = rf_set(s->scene, "lights[0].cell", cell_json) && rf_set(s->scene, "lights[0].position", place_json)
                       ? rf_prepare(s->scene, s->world) : NULL;
  if (!next) return s->code = fail_library(s->engine), false;
  rf_world_destroy(s->world);
  s->world = next;
  return true;
}

static const double *light_from(Solver *s, int cell, rf_vec3 place)
{
  for (int i = 0; i < s->lit_count; i++)
    if (s->lit[i].cell == cell && !memcmp(&s->lit[i].place, &place, sizeof place)) return s->lit[i].light;
  Lit *l = &s->lit[s->lit_count < MOST_LAMPS ? s->lit_count++ : MOST_LAMPS - 1];
  *l = (Lit){.cell = cell, .place = place};
  if (!put_lamp(s, cell, place)) return NULL;
  for (int i = 0; i < s->chamber.lock_count; i++)
    if (s->chamber.locks[i].kind == LOCK_LIGHT) l->light[i] = lock_light(s->world, &s->chamber.locks[i]);
  return l->light;
}

// --- what holds -------------------------------------------------------------------------------------
static bool is_solved(Solver *s, const State *t)
{
  static const double dark[MOST_LOCKS];
  const Chamber *c = &s->chamber;
  if (!player_is_at(&t->player, &c->exit, c->exit_radius)) return false;
  const double *light = dark;
  bool wants_light = false;
  for (int i = 0; i < c->lock_count; i++) wants_light |= c->locks[i].kind == LOCK_LIGHT;
  if (wants_light) {
    const rf_body hand = player_lamp(s->world, &t->player);
    light = t->lamp_cell == CARRIED ? light_from(s, hand.cell, hand.frame.p) : light_from(s, t->lamp_cell, t->lamp);
  }
  bool all = light != NULL;
  for (int i = 0; all && i < c->lock_count; i++) all = lock_holds(&c->locks[i], s->world, &t->player, light[i], &s->got[i]);
  return all;
}

static bool is_close(float a, float b) { return fabsf(a - b) < 0.05f; }

// States that a player cannot tell apart: the same spot, size, hand and lamp, and the arrow within 3 degrees.
static bool is_same(const State *a, const State *b, bool has_arrow)
{
  const rf_vec3 x = a->player.arrow.frame.z, y = b->player.arrow.frame.z;
  const rf_vec3 off = add(a->lamp, b->lamp, -1);
  return a->spot == b->spot && is_close(logf(a->player.body.scale), logf(b->player.body.scale)) &&
         player_is_left_handed(&a->player) == player_is_left_handed(&b->player) && a->lamp_cell == b->lamp_cell &&
         off.x * off.x + off.y * off.y + off.z * off.z < 0.01f &&
         (!has_arrow || (is_close(x.x, y.x) && is_close(x.y, y.y) && is_close(x.z, y.z)));
}

static bool add_state(Solver *s, const State *t) // true: it is new, and solves it
{
  for (int i = 0; i < s->count; i++)
    if (is_same(&s->states[i], t, s->chamber.has_arrow)) return false;
  if (s->count == MOST_STATES) return false;
  s->states[s->count++] = *t;
  return is_solved(s, t);
}

// --- what can be done -------------------------------------------------------------------------------
// A leg is written in the coordinates of the cell it begins in; where one flies, as the player has it: right, up, back.
static rf_vec3 leg_of(const Chamber *c, const rf_frame *f, rf_vec3 leg)
{
  const rf_vec3 zero = {0, 0, 0};
  return c->flies ? add(add(add(zero, f->x, leg.x), f->y, leg.y), f->z, leg.z) : leg;
}

static bool walk_way(Solver *s, const ChamberWay *w, State *t)
{
  Player *p = &t->player;
  for (int i = 0; i < w->leg_count; i++) {
    const rf_vec3 leg = leg_of(&s->chamber, &p->body.frame, w->legs[i]);
    rf_body arrow = p->arrow;
    arrow.frame.p = p->body.frame.p;
    arrow.cell = p->body.cell;
    if (rf_walk(s->world, &p->body, leg, true).is_blocked) return false;
    (void)rf_walk(s->world, &arrow, leg, true);
    p->arrow = arrow;
  }
  const Spot *to = &s->chamber.spots[w->to];
  rf_vec3 off = add(p->body.frame.p, to->place, -1);
  if (!s->chamber.flies) off.y = 0; // as high as his eyes are at his size
  t->spot = w->to;
  return p->body.cell == to->cell_i && sqrtf(off.x * off.x + off.y * off.y + off.z * off.z) <= NEAR;
}

static bool try_ways(Solver *s, int at)
{
  for (int i = 0; i < s->chamber.way_count; i++) {
    const ChamberWay *w = &s->chamber.ways[i];
    State t = s->states[at];
    if (w->from != t.spot || !walk_way(s, w, &t)) continue;
    t.parent = at;
    t.depth++;
    snprintf(t.action, sizeof t.action, "go to %s", s->chamber.spots[w->to].name);
    if (add_state(s, &t)) return true;
  }
  return false;
}

static bool try_lamp(Solver *s, int at)
{
  State t = s->states[at];
  if (!s->chamber.has_lamp) return false;
  t.parent = at;
  t.depth++;
  if (t.lamp_cell == CARRIED) {
    const rf_body hand = player_lamp(s->world, &t.player);
    t.lamp_cell = hand.cell;
    t.lamp = hand.frame.p;
    snprintf(t.action, sizeof t.action, "put the lamp down");
  } else {
    if (!player_reaches(&t.player, t.lamp_cell, t.lamp)) return false;
    t.lamp_cell = CARRIED;
    t.lamp = (rf_vec3){0, 0, 0};
    snprintf(t.action, sizeof t.action, "take the lamp");
  }
  return add_state(s, &t);
}

static int spot_of_start(const Chamber *c)
{
  for (int i = 0; i < c->spot_count; i++)
    if (!strcmp(c->spots[i].name, "start")) return i;
  return -1;
}

// Breadth first: the first that is found is the shortest.
static int search(Solver *s)
{
  State first = {.player = player_begin(&s->chamber), .spot = spot_of_start(&s->chamber), .parent = -1,
                 .lamp_cell = s->chamber.has_lamp ? s->chamber.lamp.cell_i : 0, .lamp = s->chamber.lamp.place};
  if (add_state(s, &first)) return 0;
  for (s->at = 0; s->at < s->count && !s->code; s->at++)
    if (try_ways(s, s->at) || try_lamp(s, s->at)) return s->count - 1;
  return -1;
}

// --- the answer -------------------------------------------------------------------------------------
static void print_steps(const Solver *s, int at)
{
  if (s->states[at].parent < 0) return;
  print_steps(s, s->states[at].parent);
  printf("  %d. %s\n", s->states[at].depth, s->states[at].action);
}

static ExitCode print_answer(Solver *s, int end, bool is_quiet)
{
  const Chamber *c = &s->chamber;
  if (end < 0)
    return fail(EXIT_BAD_SCENE, "%s: the exit cannot be reached with all locks open, in any of %d states", c->path, s->count);
  if (end == 0) return fail(EXIT_BAD_SCENE, "%s: it is solved where it begins", c->path);
  if (is_quiet) return EXIT_DONE;
  printf("%s: %s: solved in %d steps (%d states)\n", c->path, c->title, s->states[end].depth, s->count);
  print_steps(s, end);
  for (int i = 0; i < c->lock_count; i++) {
    char text[96];
    lock_text(&c->locks[i], s->got[i], text);
    printf("  open: %s\n", text);
  }
  return EXIT_DONE;
}

static ExitCode solve(Solver *s, const char *path, const Args *args)
{
  ExitCode code = chamber_read(&s->chamber, path);
  if (!code) code = scene_open(&s->scene, s->engine, s->chamber.scene, args);
  if (!code) code = chamber_resolve(&s->chamber, s->scene);
  if (!code && spot_of_start(&s->chamber) < 0)
    code = fail(EXIT_BAD_SCENE, "%s: the solver needs a spot \"start\" and ways from it", path);
  if (!code && !(s->world = rf_prepare(s->scene, NULL))) code = fail_library(s->engine);
  if (!code && !(s->states = malloc(MOST_STATES * sizeof *s->states))) code = fail(EXIT_INTERNAL, "not enough memory");
  if (code) return code;
  const int end = search(s);
  return s->code ? s->code : print_answer(s, end, args_has(args, "quiet"));
}

static ExitCode run_locks(const Args *args)
{
  rf_engine *engine = NULL;
  ExitCode code = engine_open(&engine, 1, NULL);
  for (size_t i = 0; i < args->operand_count && !code; i++) {
    Solver *s = calloc(1, sizeof *s);
    if (!s) {
      code = fail(EXIT_INTERNAL, "not enough memory");
      break;
    }
    s->engine = engine;
    code = solve(s, args->operands[i], args);
    rf_world_destroy(s->world);
    rf_scene_destroy(s->scene);
    free(s->states);
    free(s);
  }
  rf_engine_destroy(engine);
  return code ? code : stdout_finish("the solutions");
}

const Command command_locks = {
    .name = "locks",
    .sentence = "Prove that chambers of the puzzle Parallax Locks can be solved, and tell how.",
    .operands = "CHAMBER...",
    .least = 1,
    .most = 64,
    .operand_kind = OPERAND_FILE,
    .usage = "[OPTION]...",
    .text = "CHAMBER is a .locks file beside its scene; docs/locks.md says what is in it. `rayfold view CHAMBER` plays it. One "
            "that cannot be solved, or is solved where it begins, ends with code 65.",
    .example = "rayfold locks scenes/locks/01_window.locks",
    .options = locks_options,
    .run = run_locks,
};
