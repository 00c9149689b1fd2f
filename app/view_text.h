// Text: letters of a system font, drawn into pixels of 0xffrrggbb.

#ifndef RAYFOLD_APP_VIEW_TEXT_H
#define RAYFOLD_APP_VIEW_TEXT_H

#include <stdbool.h>
#include <stdint.h>

typedef struct Canvas { // what is drawn on; not owned
  uint32_t *pixels;
  int width, height;
} Canvas;

typedef struct Font Font;

// `path` or, if NULL, DejaVu Sans or another common font where systems keep them. NULL: there is none that can be read.
Font *font_open(const char *path);
void font_close(Font *f); // accepts NULL

// Letters of so many pixels, in UTF-8 up to U+00FF and some signs. Returns the x behind them. f NULL draws nothing.
float text_draw(Canvas *c, Font *f, float x, float baseline, float size, uint32_t color, const char *text);
float text_width(Font *f, float size, const char *text);

#endif
