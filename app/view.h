// The viewer: what `rayfold view` holds while it runs, and the steps of which view.c makes its turns. Each step lies in
// the file of its name; they share this struct and call downwards only: view.c, then view_script.c, view_input.c, the
// rest.

#ifndef RAYFOLD_APP_VIEW_H
#define RAYFOLD_APP_VIEW_H

#include "options.h"
#include "view_eye.h"
#include "view_screen.h"
#include "view_text.h"

#include <pthread.h>

enum { MOST_ROWS = 14 };

typedef struct Row { // a value that can be dragged
  char label[24], path[160];
  double value, low, high; // low == high: without bounds
  int x, y, width, height; // where it was drawn last
} Row;

typedef struct Picked {
  uint32_t object; // 1 + index in the scene; 0: nothing is picked
  char name[64], material[64];
  uint32_t triangle;
  float distance;
  rf_vec3 place;
  Row rows[MOST_ROWS];
  int row_count;
  int dragged;  // row, -1
  bool is_begun; // the drag has set a value already
} Picked;

typedef struct Note { // a line at the bottom of the window
  char text[600];
  double until; // by the viewer's clock
  bool is_bad;
} Note;

typedef struct Caption { // what the scene says of itself
  char title[120], text[600];
  double until; // by the viewer's clock
} Caption;

enum { MOST_SCENES = 400 };

typedef struct SceneList { // of a folder
  char folder[1024], *names[MOST_SCENES]; // owned
  int count, at;                          // at: chosen
  bool is_open;
  int x, y, width, row, first, shown; // where rows were drawn last, and from which on
} SceneList;

typedef struct Stamp { // tells versions of a file apart
  long long seconds, nanoseconds, size;
} Stamp;

typedef struct Loader { // opens files beside everything else
  pthread_t thread;
  bool is_running;
  char path[1024];
  Stamp stamp;   // before it was read, so that a change in between is seen
  bool is_other; // not the file that is shown, so its size is wanted
  pthread_mutex_t mutex; // guards what follows
  bool is_done;
  rf_scene *scene; // NULL: message says why
  rf_world *world; // of another file: for its size and rays; the first live picture takes its trees over
  bool is_missing; // the file, or one that it names
  char message[600];
} Loader;

typedef struct Shot { // a picture being rendered in the background
  pthread_t thread;
  bool is_running;
  rf_engine *engine; // its own: its threads give way to all others
  rf_world *world;
  rf_eye eye;
  rf_render_def render;
  rf_develop_def develop;
  int width, height;
  char path[1024];
  pthread_mutex_t mutex; // guards what follows
  bool is_done;
  double done; // 0..1
  char message[600];
} Shot;

typedef struct Script Script;
typedef struct Game Game;

typedef enum Tool { TOOL_OFF, TOOL_ADD, TOOL_ERASE, TOOL_PAINT, TOOL_FLOOD, TOOL_EXTRUDE, TOOL_COUNT } Tool;

typedef struct Brush { // for voxels
  int tool; // Tool
  int size; // cells
  bool is_box, is_inward;
  float color[3], randomness;
  char voxel[64];   // name in the palette; empty: color
  bool is_down, has_last;
  rf_world *world;  // a use of the one before the stroke; NULL between strokes
  uint32_t object;
  int last[3];
  char path[80], json[30000];
} Brush;

enum { MOST_PINS = 3, PROOF_LINES = 4 };

typedef struct Pin { // a place that was pointed at
  int x, y;
  rf_vec3 way; // by the eye's frame, metres
} Pin;

typedef struct Proof { // what is measured in the window
  rf_eye eye;    // that the pins were seen by
  Pin pins[MOST_PINS];
  int pin_count;
  char lines[PROOF_LINES][96];
  int line_count;
} Proof;

typedef struct View {
  const Args *args;
  const ScreenKind *kind;
  Screen *screen;
  rf_engine *engine;
  rf_live *live; // NULL while the first scene loads
  Font *font;
  Script *script; // NULL: a person
  char path[1024];
  Stamp stamp;         // of the file as it was read or written last
  bool is_overtaken;   // the file has been changed and could not be read
  bool is_save_warned; // saving over such a change has been asked for once
  double next_look; // at the file, by the clock
  int width, height;
  float scale;      // pixels a point
  uint32_t *pixels; // owned: what is shown
  int canvas_width, canvas_height; // of pixels
  rf_live_view wanted;
  rf_develop_def develop; // of the scene; views of numbers are shown as they are
  rf_live_frame frame;    // number 0: none yet
  rf_world *world;        // the newest, for rays; NULL: ask when needed
  Walker walker;
  Picked picked;
  Brush brush;
  Proof proof;
  Game *game; // NULL: none is played
  Note note;
  Caption caption;
  SceneList list;
  Loader loader;
  Shot shot;
  bool down[KEY_COUNT];
  int mouse_x, mouse_y, press_x, press_y, button; // button held; 0: none
  bool is_dragging, is_orbiting;
  rf_vec3 centre; // of the orbit
  bool shows_hud, shows_help;
  bool is_dirty;  // what lies over the picture has changed
  bool is_asked;  // the view has changed since rf_live_show()
  bool is_over;
  double clock;   // seconds; a script's own if there is one
  double frames_a_second;
  double last_frame; // when it came, by the clock
  int shot_number;
  double begun, first_picture; // by the machine's clock: of the program and of its first frame on show; 0: not yet
  long moving_frames;
  double moving_seconds, moving_pixels; // together: what they took from one to the next, what part was rendered
  ExitCode code;
} View;

// view_file.c: loading, reloading, saving
void view_open(View *v, const char *path); // begins it; the old scene stays until it is done
void view_check_file(View *v);                   // takes over what was loaded; looks whether the file has changed
void view_save(View *v);
void view_close_file(View *v);
bool scene_take(View *v, double seconds, rf_scene **out); // rf_live_borrow() with a note when it is busy

// view_list.c: the scenes of a folder, and what each says of itself
void list_step(View *v, int step); // opens the next, the one before
void list_toggle(View *v);
bool list_key(View *v, int key);
bool list_press(View *v, int x, int y);
bool list_first(const char *folder, char out[1024]); // false: it is no folder, or has none
void list_finish(View *v);
void caption_take(View *v, rf_scene *s);

// view_pick.c: the object under the mouse and its values
void pick_at(View *v, int x, int y);
void pick_refresh(View *v); // reads the values again
void pick_clear(View *v);
bool pick_press(View *v, int x, int y); // on a row of the panel?
void pick_drag(View *v, int dx);
rf_world *view_world(View *v);                            // for rays; may be NULL
uint32_t view_object(const View *v, int x, int y); // 1 + index of the object that the picture shows there; 0: none
bool view_look(View *v, int x, int y, rf_vec3 *place, rf_ray *ray, rf_hit *hit, rf_arrival *at); // the same, and how it got there
bool view_hit(View *v, int x, int y, rf_vec3 *place, rf_ray *ray, rf_hit *hit); // what the picture shows there

// view_voxels.c: brushes
void brush_tool(View *v, int step);
void brush_size(View *v, int step);
void brush_form(View *v);
void brush_randomness(View *v);
void brush_take_color(View *v);
bool brush_press(View *v, int x, int y, bool is_inward); // on voxels, with a brush in hand?
void brush_drag(View *v, int x, int y);
void brush_release(View *v);

// view_prove.c: ruler, triangles, the arrow, volumes
void prove_pin(View *v);    // at what the mouse points at
void prove_clear(View *v);
bool prove_sees_pins(const View *v); // the eye has not moved since
void prove_arrow(View *v);  // takes it up, or tells how it is turned and lays it down
void prove_volume(View *v);

// view_game.c: Parallax Locks
ExitCode game_open(View *v, const char *path); // a folder of chambers, or one of them
void game_close(View *v);
void game_begin(View *v, uint64_t edit);       // its scene is on show from this edit on
bool game_turn(View *v, const Wish *wish, double seconds); // instead of walker_move()
void game_lamp(View *v);
void game_again(View *v);
int game_open_locks(const View *v);
// What the window says of it; returns how many lines of locks there are, 0: no game.
int game_lines(const View *v, char title[96], char hint[200], char lines[][112], bool open[], int most);

// view_shot.c: pictures in full quality
void shot_begin(View *v);
void shot_step(View *v);
void shot_finish(View *v);
bool pixels_save(View *v, const uint32_t *pixels, int width, int height, const char *path);

// view_hud.c: everything over the picture
void hud_draw(View *v);

// view_input.c: keys and mouse
void input_event(View *v, const Event *e);
Wish input_wish(View *v);
bool input_key_line(int i, const char **key, const char **what); // for the help; false past the last
void view_integrator(View *v, const char *name);

// view_script.c: a script instead of a person
Script *script_open(const char *path, ExitCode *code);
void script_step(View *v); // the commands up to the next frame
void script_finish(Script *s);

// view.c
void view_turn(View *v, double seconds);                              // moves the eye, asks for and shows a frame
void view_show(View *v);                                              // composes and presents
void note_say(View *v, bool is_bad, const char *format, ...) __attribute__((format(printf, 3, 4)));
void note_library(View *v); // the library's last error

#endif
