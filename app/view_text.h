// Text: letters of a system font, drawn into pixels of 0xffrrggbb.

#ifndef RAYFOLD_APP_VIEW_TEXT_H
#define RAYFOLD_APP_VIEW_TEXT_H

#include <stdbool.h>
#include <stdint.h>

typedef struct Canvas { // what is drawn on; not owned
  uint32_t *pixels;
  int width, height;
} Canvas;

// share of 256 of the upper colour, the rest of the one below
static inline uint32_t color_mix(uint32_t under, uint32_t over, uint32_t share)
{
  const uint32_t rb = (under & 0xff00ff) * (256 - share) + (over & 0xff00ff) * share;
  const uint32_t g = (under & 0x00ff00) * (256 - share) + (over & 0x00ff00) * share;
  return 0xff000000u | (rb >> 8 & 0xff00ff) | (g >> 8 & 0x00ff00);
}

typedef struct Font Font;

// `path` or, if NULL, DejaVu Sans or another common font where systems keep them. NULL: there is none that can be read.
Font *font_open(const char *path);
void font_close(Font *f); // accepts NULL

// Letters of so many pixels, in UTF-8 up to U+00FF and some signs. Returns the x behind them. f NULL draws nothing.
float text_draw(Canvas *c, Font *f, float x, float baseline, float size, uint32_t color, const char *text);
float text_width(Font *f, float size, const char *text);

#endif
