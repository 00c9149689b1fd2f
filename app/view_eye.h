// The viewer's eye: a place, where it looks, and how it moves: flying, around a point, on foot, and along a path of
// stored views. Every motion is a function of the time that passed, so that a script's clock gives the same way again.

#ifndef RAYFOLD_APP_VIEW_EYE_H
#define RAYFOLD_APP_VIEW_EYE_H

#include <rayfold/rayfold.h>

enum { MOST_STOPS = 16 };

typedef struct Pose {
  rf_vec3 place;
  float yaw, pitch; // radians: to the left from -z, upwards, by the level
  float fov;        // as rf_eye's
  int cell;         // of the world
  rf_frame level;   // what is right, up and back where the head is held straight; gates turn it, gravity rights it
} Pose;

typedef struct Walker {
  rf_eye lens;   // what of the eye does not move
  bool is_level; // the frame follows from the pose; not before the first turn, as a camera may be tilted
  Pose pose;
  float size;    // of the scene, metres: gives speeds; of the walker's own, which gates may change
  float speed;   // factor
  float focus;   // metres to what is looked at
  bool on_foot;
  bool stands;
  float height, fall; // of the eye above its feet, metres; metres a second downwards
  int stop_count;     // of a flight in progress; 0: none
  Pose stops[MOST_STOPS];
  float flown; // stops behind
  bool carries;       // an arrow, by parallel transport along every step; a leap loses it
  rf_body arrow;      // where it is, turned as it is: it points along -z
  rf_body arrow_home; // as it was when it was taken up
  double carried;     // metres
} Walker;

typedef struct Wish { // of the keys and sticks held, each -1..1
  float right, up, forward, turn, tilt;
  bool fast, slow, jump;
} Wish;

void walker_set(Walker *w, const rf_eye *eye);
rf_eye walker_eye(const Walker *w);
Pose pose_of(const rf_eye *eye);
void walker_turn(Walker *w, float yaw, float pitch);
void walker_orbit(Walker *w, rf_vec3 centre, float yaw, float pitch);
void walker_dolly(Walker *w, float notches); // towards what is looked at
void walker_foot(Walker *w, const rf_world *world, bool on);
void walker_fly(Walker *w, const Pose *stops, int count); // from here along them
void walker_carry(Walker *w, bool on); // the arrow
// Moves by `seconds`, through gates if there is a world, which may be NULL. True if the eye is another then.
bool walker_move(Walker *w, const Wish *wish, double seconds, const rf_world *world);

float vec_length(rf_vec3 a);
rf_vec3 vec_add(rf_vec3 a, rf_vec3 b, float scale); // a + scale * b
float vec_dot(rf_vec3 a, rf_vec3 b);

#endif
