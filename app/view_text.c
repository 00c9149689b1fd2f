// See view_text.h. Glyphs are rasterised by stb_truetype the first time they are needed at a size and kept.

#include "view_text.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#if RAYFOLD_HAVE_STB_TRUETYPE
#define STB_TRUETYPE_IMPLEMENTATION
#define STBTT_STATIC
#include <stb/stb_truetype.h>

enum { MOST_GLYPHS = 2048, MOST_FONT = 32 << 20 };

typedef struct Glyph {
  int code;
  float size;
  int width, height, x, y; // of the bitmap, and where it lies from the pen
  float advance;
  uint8_t *coverage; // owned
} Glyph;

struct Font {
  uint8_t *file; // owned
  stbtt_fontinfo info;
  Glyph glyphs[MOST_GLYPHS]; // a table by hash; advance < 0: free
};

static const char *const places[] = {
    "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf", "/usr/share/fonts/dejavu/DejaVuSans.ttf",
    "/usr/share/fonts/dejavu-sans-fonts/DejaVuSans.ttf", "/usr/share/fonts/TTF/DejaVuSans.ttf",
    "/usr/share/fonts/truetype/liberation/LiberationSans-Regular.ttf",
    "/usr/share/fonts/truetype/noto/NotoSans-Regular.ttf", "/usr/share/fonts/noto/NotoSans-Regular.ttf"};

static uint8_t *read_whole(const char *path)
{
  FILE *in = fopen(path, "rb");
  uint8_t *data = NULL;
  long size = 0;
  if (in && !fseek(in, 0, SEEK_END) && (size = ftell(in)) > 12 && size < MOST_FONT && !fseek(in, 0, SEEK_SET))
    data = malloc((size_t)size);
  if (data && fread(data, 1, (size_t)size, in) != (size_t)size) {
    free(data);
    data = NULL;
  }
  if (in) fclose(in);
  return data;
}

static bool open_at(Font *f, const char *path)
{
  f->file = read_whole(path);
  if (f->file && stbtt_InitFont(&f->info, f->file, stbtt_GetFontOffsetForIndex(f->file, 0))) return true;
  free(f->file);
  f->file = NULL;
  return false;
}

Font *font_open(const char *path)
{
  Font *f = calloc(1, sizeof *f);
  bool ok = f && path && open_at(f, path);
  for (size_t i = 0; f && !path && !ok && i < sizeof places / sizeof *places; i++) ok = open_at(f, places[i]);
  if (ok) return f;
  free(f);
  return NULL;
}

void font_close(Font *f)
{
  if (!f) return;
  for (int i = 0; i < MOST_GLYPHS; i++)
    if (f->glyphs[i].coverage) stbtt_FreeBitmap(f->glyphs[i].coverage, NULL);
  free(f->file);
  free(f);
}

static const Glyph *glyph_at(Font *f, int code, float size)
{
  unsigned slot = ((unsigned)code * 2654435761u + (unsigned)(size * 8) * 40503u) % MOST_GLYPHS;
  for (int tries = 0; tries < 64; tries++, slot = (slot + 1) % MOST_GLYPHS) {
    Glyph *g = &f->glyphs[slot];
    if (g->code == code && g->size == size) return g;
    if (g->code) continue;
    const float scale = stbtt_ScaleForPixelHeight(&f->info, size);
    int advance, bearing;
    stbtt_GetCodepointHMetrics(&f->info, code, &advance, &bearing);
    g->code = code;
    g->size = size;
    g->advance = scale * (float)advance;
    g->coverage = stbtt_GetCodepointBitmap(&f->info, scale, scale, code, &g->width, &g->height, &g->x, &g->y);
    return g;
  }
  return NULL;
}

// The next letter of UTF-8 text; what is broken reads as '?'.
static int next_code(const char **text)
{
  const unsigned char *s = (const unsigned char *)*text;
  const int n = s[0] < 0x80 ? 1 : s[0] < 0xe0 ? 2 : s[0] < 0xf0 ? 3 : 4;
  int code = n == 1 ? s[0] : s[0] & (0x7f >> n);
  for (int i = 1; i < n; i++) {
    if ((s[i] & 0xc0) != 0x80) return *text += i, '?';
    code = code << 6 | (s[i] & 0x3f);
  }
  *text += n;
  return code;
}

static void draw_glyph(Canvas *c, const Glyph *g, int x, int y, uint32_t color)
{
  for (int j = 0; j < g->height; j++)
    for (int i = 0; i < g->width; i++) {
      const int px = x + g->x + i, py = y + g->y + j;
      const uint32_t a = g->coverage[j * g->width + i];
      if (!a || px < 0 || py < 0 || px >= c->width || py >= c->height) continue;
      uint32_t *p = c->pixels + (size_t)py * (size_t)c->width + (size_t)px;
      *p = color_mix(*p, color, a + (a >> 7));
    }
}

float text_draw(Canvas *c, Font *f, float x, float baseline, float size, uint32_t color, const char *text)
{
  while (f && *text) {
    const Glyph *g = glyph_at(f, next_code(&text), size);
    if (!g) continue;
    if (c && g->coverage) draw_glyph(c, g, (int)lroundf(x), (int)lroundf(baseline), color);
    x += g->advance;
  }
  return x;
}

float text_width(Font *f, float size, const char *text) { return text_draw(NULL, f, 0, 0, size, 0, text); }

#else
Font *font_open(const char *path)
{
  (void)path;
  return NULL;
}
void font_close(Font *f) { (void)f; }
float text_draw(Canvas *c, Font *f, float x, float baseline, float size, uint32_t color, const char *text)
{
  (void)c, (void)f, (void)baseline, (void)size, (void)color, (void)text;
  return x;
}
float text_width(Font *f, float size, const char *text)
{
  (void)f;
  return size / 2 * (float)strlen(text);
}
#endif
