// Live: makes frame after frame of what an eye sees, as a window shows them. While the eye, the window or the world
// changes, each frame keeps to a time: as many pixels as fit are rendered (all, a quarter, a sixteenth or a
// sixty-fourth), helped by the frames before (trail.h), cleaned and enlarged. Once nothing changes the picture is
// rendered finer step by step, then sample by sample in the window's own size, until it has all samples asked for; its
// film then is the one that rendering offline gives, bit by bit. It has no thread and knows no scene: api/live.c does.

#ifndef RAYFOLD_RENDER_LIVE_H
#define RAYFOLD_RENDER_LIVE_H

#include "post/tone.h"
#include "render/render.h"

typedef struct LiveView { // what to show
  Eye eye;
  uint32_t width, height; // pixels of the window
  RenderSettings settings;
  uint64_t seed;
  uint32_t first_sample, end_sample; // of the finished picture
  Tone tone;
  bool denoises;        // the fast denoiser; only where there is noise
  bool reprojects;      // frames before help the next
  double frame_seconds; // what a frame may take while something changes
  int blocks;           // of whitted while something changes: side of the largest blocks that are filled between their
                        // corners (subsample.h); 4, 8, 16; 0: none
  bool shows_blocks;    // a view of them, which is all there is to see
  int step;             // 0: by time; else pixels are this many times as wide, 1, 2, 4 or 8, while something changes,
                        // and no clock is looked at: the same steps give the same frames
} LiveView;

typedef enum LiveOutcome {
  LIVE_IDLE,   // the picture is finished and shown: nothing to do
  LIVE_WORKED, // samples were added, but there is nothing new to show yet, or the pass was interrupted
  LIVE_SHOWN,  // a new picture
  LIVE_FAILED, // err says why
} LiveOutcome;

typedef struct LiveFrame { // the arrays belong to the frame and are made as large as needed
  uint32_t width, height;               // of the window
  uint32_t *pixels;                     // 0xffrrggbb, rows from the top
  uint32_t render_width, render_height; // of what was rendered
  uint32_t *objects;                    // 1 + index of what each rendered pixel shows; 0: nothing
  size_t pixel_room, object_room;
  uint32_t samples; // a rendered pixel
  bool is_moving;   // made while something changed
  bool is_finished; // has all samples
  double render_seconds, denoise_seconds, show_seconds;
  double traced;    // part of the rendered pixels that rays were asked for; the others lie between them
  uint64_t rays;    // traced for it since the frame before
} LiveFrame;

void live_frame_finish(LiveFrame *f);

typedef struct Live Live;
Live *live_create(Jobs *jobs, const HotTable *hot, Err *err);
void live_destroy(Live *l); // accepts NULL

// Would the picture have to begin anew? Otherwise only the way it is shown differs.
bool live_view_differs(const LiveView *a, const LiveView *b);

// Does the next piece of work on a picture of w, which must live until another is given. `interrupt` ends a pass that
// refines, which is then lost; a frame of something that changes is only ended by `abandon`.
LiveOutcome live_step(Live *l, const World *w, const LiveView *view, const Cancel *abandon, const Cancel *interrupt,
                      LiveFrame *out, Err *err);

// The film of the picture in the window's size, with all samples so far; NULL: there is none yet.
const Film *live_film(const Live *l);

#endif
