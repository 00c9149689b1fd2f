// Screen: where pictures are shown and input comes from. Each kind is one file and one table of functions: the window of
// SDL, and one of no display at all, whose input is a script's. Sizes and places are in pixels of the screen.

#ifndef RAYFOLD_APP_VIEW_SCREEN_H
#define RAYFOLD_APP_VIEW_SCREEN_H

#include <stdbool.h>
#include <stdint.h>

typedef enum EventKind {
  EVENT_NONE,
  EVENT_QUIT,
  EVENT_WAKE, // somebody called wake()
  EVENT_KEY,
  EVENT_KEY_UP,
  EVENT_PRESS,
  EVENT_RELEASE,
  EVENT_MOVE, // of the mouse
  EVENT_WHEEL,
  EVENT_RESIZE,
  EVENT_DROP,
} EventKind;

// A key is its lower-case letter or sign, or one of these.
enum { KEY_ESCAPE = 256, KEY_TAB, KEY_LEFT, KEY_RIGHT, KEY_UP, KEY_DOWN, KEY_SHIFT, KEY_CTRL, KEY_ALT, KEY_ENTER, KEY_F1, KEY_COUNT = KEY_F1 + 12 };
enum { MOD_SHIFT = 1, MOD_CTRL = 2, MOD_ALT = 4 };
enum { BUTTON_LEFT = 1, BUTTON_MIDDLE, BUTTON_RIGHT };
enum { PAD_LEFT_X, PAD_LEFT_Y, PAD_RIGHT_X, PAD_RIGHT_Y, PAD_DOWN, PAD_UP, PAD_AXES };

typedef struct Event {
  EventKind kind;
  int key, button;
  unsigned mods;
  int x, y;         // of the mouse; of EVENT_RESIZE: the new size
  float wheel;      // notches away from the user
  char path[1024];  // of EVENT_DROP
} Event;

typedef struct Screen Screen;
typedef struct ScreenKind {
  const char *name;
  Screen *(*open)(const char *title, int width, int height, char error[200]);
  void (*close)(Screen *s);
  void (*size)(Screen *s, int *width, int *height, float *scale); // scale: pixels a point, 1 or more
  bool (*next)(Screen *s, double seconds, Event *out); // waits so long for an event; false: none came
  void (*wake)(Screen *s);                             // from any thread
  void (*show)(Screen *s, const uint32_t *pixels, int width, int height);
  bool (*grab)(Screen *s, uint32_t *pixels, int width, int height); // what is on show
  void (*capture)(Screen *s, bool on); // the mouse moves without bounds, unseen
  void (*full)(Screen *s);             // full screen and back
  void (*title)(Screen *s, const char *title);
  void (*pad)(Screen *s, float axes[PAD_AXES]); // -1..1 each
} ScreenKind;

extern const ScreenKind screen_dummy;
#if RAYFOLD_HAVE_SDL
extern const ScreenKind screen_sdl;
#endif

int key_from_name(const char *name); // "w", "f1", "escape"; 0: none of that name

#endif
