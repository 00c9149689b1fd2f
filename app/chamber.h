// Chamber: one room of the puzzle "Parallax Locks": a scene, and a text that says where the player begins, what he carries, what
// its locks want and where the exit is. docs/locks.md has the words. The player's body and arrow are moved by rf_walk(), and
// photocells are judged by a picture of them: by the tracer, as everything that is seen.
//
// Does not know windows; the window (view_game.c) and the solver (locks.c) both go by it.

#ifndef RAYFOLD_APP_CHAMBER_H
#define RAYFOLD_APP_CHAMBER_H

#include "say.h"

#include <stdbool.h>

enum { MOST_LOCKS = 6, MOST_SPOTS = 32, MOST_WAYS = 64, MOST_LEGS = 6 };

typedef struct Spot {
  char name[32], cell[64]; // cell: empty is the one without a name
  int cell_i;              // of the scene
  rf_vec3 place;
  int line;
} Spot;

typedef enum LockKind { LOCK_LIGHT, LOCK_SIZE, LOCK_HAND, LOCK_TURN } LockKind;

typedef struct Lock {
  LockKind kind;
  Spot at;        // of a photocell
  rf_vec3 normal; // which way it looks
  double low, high; // light: radiance at least; size: of the player; turn: degrees; hand: -1 or 1
} Lock;

typedef struct ChamberWay { // for the solver: from spot to spot, in straight legs
  int from, to;
  rf_vec3 legs[MOST_LEGS];
  int leg_count, line;
} ChamberWay;

typedef struct Chamber {
  char path[1024], scene[1024], title[64], hint[160];
  Spot start, lamp, exit;
  float yaw; // radians
  double exit_radius;
  bool has_start, has_lamp, has_exit, has_arrow, flies;
  Lock locks[MOST_LOCKS];
  int lock_count;
  Spot spots[MOST_SPOTS];
  int spot_count;
  ChamberWay ways[MOST_WAYS];
  int way_count;
} Chamber;

typedef struct Player {
  rf_body body, arrow, arrow_home; // scale 1 is the size he began with
} Player;

ExitCode chamber_read(Chamber *c, const char *path);
// Finds its cells in the scene; says which one there is not.
ExitCode chamber_resolve(Chamber *c, const rf_scene *scene);

Player player_begin(const Chamber *c);
// Where a lamp hangs that he carries: ahead of him, lower than his eyes, never behind a wall.
rf_body player_lamp(const rf_world *w, const Player *p);
bool player_is_left_handed(const Player *p);
bool player_is_at(const Player *p, const Spot *s, double radius);

// Is the lamp, at a place of a cell, near enough to take?
bool player_reaches(const Player *p, int cell, rf_vec3 place);
// The values of lights[0] of the scene that put the lamp into the cell of that name (NULL: the one without), as rf_set() takes them.
void lamp_values(const char *cell, rf_vec3 place, char cell_json[140], char place_json[100]);

// What a photocell gets: the radiance of its face, seen from right before it. NAN if it could not be rendered.
double lock_light(const rf_world *w, const Lock *l);
// Does it hold, and what has it got? light is what lock_light() said.
bool lock_holds(const Lock *l, const rf_world *w, const Player *p, double light, double *got);
void lock_text(const Lock *l, double got, char out[96]); // for people

#endif
