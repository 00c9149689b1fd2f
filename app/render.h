// Render: what one run of `rayfold render` holds, and the steps that its files share. render.c goes from the command line
// to the files of one picture; render_args.c reads what the command line asks for; render_frames.c renders many moments.

#ifndef RAYFOLD_APP_RENDER_H
#define RAYFOLD_APP_RENDER_H

#include "frames.h"
#include "kept_film.h"
#include "progress.h"
#include "stats.h"
#include "video.h"

enum { MOST_VIDEOS = 8 };

typedef struct Render { // all that one run owns
  const Args *args;
  bool is_quiet;
  bool is_bare; // a model that brings neither camera nor light
  Progress progress;
  rf_engine *engine;
  rf_scene *scene;
  rf_world *world;
  rf_shot *shot; // the world in steps, where the shutter is open and something moves; NULL: world and eye are all
  rf_film *film;
  KeptFilm kept;         // path NULL: not kept
  ExitCode kept_code;    // of its last writing
  unsigned planes;       // the film's
  unsigned saved_planes; // those asked for
  rf_eye eye;
  rf_render_def def;
  Range *ranges;
  size_t range_count;
  Range part; // of the picture, of so many parts; 0: all of it
  int parts;
  int samples_wanted; // over all ranges
  rf_progress before; // what earlier ranges brought, for the progress line
  double range_share; // of the whole, of the range being rendered
  double left, later; // samples a pixel still to take of it, and of the ranges after it
  bool is_complete;   // of the range rendered last, nothing is left
  bool is_stop_said;
  Stats stats;
  bool moves;
  bool is_all; // frames: "all", until the scene tells which those are
  Frames frames;
  double fps;
  long frames_done;     // or left out, before the one being rendered
  long frames_rendered; // in this run
  rf_progress frames_before; // what they took: seconds and rays
  Video *videos[MOST_VIDEOS];
  size_t video_count;
} Render;

// render_args.c: what can be known to be wrong before anything is loaded
ExitCode render_read_args(Render *r);
ExitCode render_check_args(Render *r); // the part that asks the library

// render_frames.c
double render_moment(const Render *r, long n); // seconds of the n-th frame that is wanted; of a single picture its moment
long render_frame_number(const Render *r);     // of the frame being rendered
ExitCode render_plan_frames(Render *r);        // which moments there are, and the scene moved to the first of them
void render_add_frames_before(const Render *r, rf_progress *now);
ExitCode render_frames(Render *r);

// render.c
ExitCode render_open_shutter(Render *r, double seconds); // the steps of an open shutter, from the world at its middle
ExitCode render_picture(Render *r);                      // the film of one picture
ExitCode render_denoise(Render *r);
ExitCode render_write_pictures(Render *r);
void render_print_summary(const Render *r);
ExitCode render_fail_stopped(const Render *r);

#endif
