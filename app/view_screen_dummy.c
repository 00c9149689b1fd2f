// The screen of no display: keeps what is shown, and has no input of its own.

#include "view_screen.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct Screen {
  int width, height;
  uint32_t *pixels; // as last shown; NULL: nothing yet
};

static Screen *dummy_open(const char *title, int width, int height, char error[200])
{
  (void)title;
  Screen *s = calloc(1, sizeof *s);
  if (!s) snprintf(error, 200, "not enough memory");
  if (s) *s = (Screen){width, height, NULL};
  return s;
}

static void dummy_close(Screen *s)
{
  free(s->pixels);
  free(s);
}

static void dummy_size(Screen *s, int *width, int *height, float *scale)
{
  *width = s->width;
  *height = s->height;
  *scale = 1;
}

static bool dummy_next(Screen *s, double seconds, Event *out)
{
  (void)s, (void)seconds, (void)out;
  return false;
}

static void dummy_show(Screen *s, const uint32_t *pixels, int width, int height)
{
  uint32_t *kept = realloc(s->pixels, (size_t)width * (size_t)height * sizeof *kept);
  if (!kept) return;
  memcpy(kept, pixels, (size_t)width * (size_t)height * sizeof *kept);
  s->pixels = kept;
  s->width = width;
  s->height = height;
}

static bool dummy_grab(Screen *s, uint32_t *pixels, int width, int height)
{
  if (!s->pixels || s->width != width || s->height != height) return false;
  memcpy(pixels, s->pixels, (size_t)width * (size_t)height * sizeof *pixels);
  return true;
}

static void dummy_wake(Screen *s) { (void)s; }
static void dummy_capture(Screen *s, bool on) { (void)s, (void)on; }
static void dummy_full(Screen *s) { (void)s; }
static void dummy_title(Screen *s, const char *title) { (void)s, (void)title; }
static void dummy_pad(Screen *s, float axes[PAD_AXES])
{
  (void)s;
  memset(axes, 0, PAD_AXES * sizeof *axes);
}

const ScreenKind screen_dummy = {"none",      dummy_open,    dummy_close, dummy_size,  dummy_next, dummy_wake,
                                 dummy_show, dummy_grab, dummy_capture, dummy_full, dummy_title, dummy_pad};

int key_from_name(const char *name)
{
  static const struct {
    const char *name;
    int key;
  } names[] = {{"escape", KEY_ESCAPE}, {"tab", KEY_TAB},     {"left", KEY_LEFT}, {"right", KEY_RIGHT}, {"up", KEY_UP},
               {"down", KEY_DOWN},     {"shift", KEY_SHIFT}, {"ctrl", KEY_CTRL}, {"alt", KEY_ALT},     {"space", ' '},
               {"enter", KEY_ENTER}};
  for (size_t i = 0; i < sizeof names / sizeof *names; i++)
    if (!strcmp(name, names[i].name)) return names[i].key;
  if (name[0] == 'f' && name[1]) {
    const int n = atoi(name + 1);
    return n >= 1 && n <= 12 ? KEY_F1 + n - 1 : 0;
  }
  return name[0] > 32 && name[0] < 127 && !name[1] ? name[0] : 0;
}
