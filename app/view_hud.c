// What lies over the picture: figures, the picked object with its values, the keys, and notes. Everything is laid out
// in points and drawn in pixels, so that it has its size on any display. Draws into v->pixels; changes nothing else but
// where rows lie.

#include "view.h"

#include <math.h>
#include <string.h>

#define INK    0xfff1f2f4u
#define DIM    0xffa3a8b3u
#define ACCENT 0xffffb454u
#define BAD    0xffff8177u
#define PANEL  0xff14161bu

enum { LINE = 19, TEXT = 14, SMALL = 12, PAD = 12, MARGIN = 14, ROW = 24 }; // points

// A rectangle with round corners, share of 256 opaque; its edge is smoothed.
static void box(Canvas *c, float x, float y, float w, float h, float radius, uint32_t color, float share)
{
  const int x0 = (int)fmaxf(x, 0), y0 = (int)fmaxf(y, 0);
  const int x1 = (int)fminf(ceilf(x + w), (float)c->width), y1 = (int)fminf(ceilf(y + h), (float)c->height);
  for (int py = y0; py < y1; py++)
    for (int px = x0; px < x1; px++) {
      const float dx = fmaxf(fmaxf(x + radius - (float)px - 0.5f, (float)px + 0.5f - (x + w - radius)), 0);
      const float dy = fmaxf(fmaxf(y + radius - (float)py - 0.5f, (float)py + 0.5f - (y + h - radius)), 0);
      const float inside = fminf(fmaxf(radius - sqrtf(dx * dx + dy * dy) + 0.5f, 0), 1);
      uint32_t *p = c->pixels + (size_t)py * (size_t)c->width + (size_t)px;
      *p = color_mix(*p, color, (uint32_t)(share * inside * 256));
    }
}

static void panel(Canvas *c, float x, float y, float w, float h, float s)
{
  box(c, x, y, w, h, 7 * s, PANEL, 0.87f);
}

static float text_right(Canvas *c, Font *f, float right, float y, float size, uint32_t color, const char *text)
{
  return text_draw(c, f, right - text_width(f, size, text), y, size, color, text);
}

// --- the picked object ----------------------------------------------------------------------------
// A line around what belongs to the object, as wide as a point and a half.
static void outline(Canvas *c, const View *v)
{
  const rf_live_frame *f = &v->frame;
  const int reach = (int)fmaxf(1, 1.5f * v->scale);
  const uint32_t wanted = v->picked.object;
  for (int y = 0; y < c->height; y++) {
    const uint32_t *row = f->objects + (size_t)((long)y * f->render_height / f->height) * (size_t)f->render_width;
    const int other = y + reach < c->height ? y + reach : y;
    const uint32_t *below = f->objects + (size_t)((long)other * f->render_height / f->height) * (size_t)f->render_width;
    for (int x = 0; x < c->width; x++) {
      const long at = (long)x * f->render_width / f->width;
      const long right = (long)(x + reach < c->width ? x + reach : x) * f->render_width / f->width;
      const bool is = row[at] == wanted;
      if (is == (row[right] == wanted) && is == (below[at] == wanted)) continue;
      uint32_t *p = c->pixels + (size_t)y * (size_t)c->width + (size_t)x;
      *p = color_mix(*p, ACCENT, 225);
    }
  }
}

static void value_text(char out[32], const Row *r)
{
  snprintf(out, 32, "%.3f", r->value + 0.0);
}

static void draw_row(Canvas *c, const View *v, Row *r, float x, float y, float width, bool is_held)
{
  const float s = v->scale, label = 92 * s, number = 58 * s;
  char text[32];
  text_draw(c, v->font, x, y + 16 * s, SMALL * s, is_held ? INK : DIM, r->label);
  value_text(text, r);
  text_right(c, v->font, x + width, y + 16 * s, SMALL * s, INK, text);
  const float bar = x + label, bar_width = width - label - number;
  r->x = (int)bar;
  r->y = (int)y;
  r->width = (int)bar_width;
  r->height = (int)(ROW * s);
  const float middle = y + 12 * s;
  box(c, bar, middle - 2 * s, bar_width, 4 * s, 2 * s, 0xff5a6070u, 0.75f);
  if (r->low < r->high) {
    const float part = (float)((r->value - r->low) / (r->high - r->low)), knob = bar + fminf(fmaxf(part, 0), 1) * bar_width;
    box(c, bar, middle - 2 * s, knob - bar, 4 * s, 2 * s, ACCENT, 1);
    box(c, knob - 5 * s, middle - 5 * s, 10 * s, 10 * s, 5 * s, is_held ? 0xffffffffu : INK, 1);
  } else {
    const float knob = bar + bar_width / 2; // without bounds: dragged to either side
    box(c, knob - 9 * s, middle - 5 * s, 18 * s, 10 * s, 5 * s, is_held ? ACCENT : 0xffc9ced8u, 1);
  }
}

static void draw_picked(Canvas *c, View *v)
{
  Picked *p = &v->picked;
  const float s = v->scale, width = 292 * s, inner = width - 2 * PAD * s;
  const float height = (2 * PAD + 24 + 2 * LINE + 6 + (float)p->row_count * ROW) * s;
  const float x = (float)c->width - width - MARGIN * s, left = x + PAD * s;
  float y = MARGIN * s;
  char line[160];
  panel(c, x, y, width, height, s);
  y += (PAD + 14) * s;
  if (*p->name)
    snprintf(line, sizeof line, "%s", p->name);
  else
    snprintf(line, sizeof line, "object %u", p->object - 1);
  text_draw(c, v->font, left, y, 17 * s, INK, line);
  y += 22 * s;
  text_draw(c, v->font, left, y, SMALL * s, DIM, *p->material ? p->material : "no material of its own");
  snprintf(line, sizeof line, "%.2f m", (double)p->distance);
  text_right(c, v->font, left + inner, y, SMALL * s, DIM, line);
  y += LINE * s;
  snprintf(line, sizeof line, "triangle %u", p->triangle);
  text_draw(c, v->font, left, y, SMALL * s, DIM, line);
  snprintf(line, sizeof line, "%.2f, %.2f, %.2f", (double)p->place.x, (double)p->place.y, (double)p->place.z);
  text_right(c, v->font, left + inner, y, SMALL * s, DIM, line);
  y += 12 * s;
  for (int i = 0; i < p->row_count; i++, y += ROW * s) draw_row(c, v, &p->rows[i], left, y, inner, i == p->dragged);
}

// --- figures --------------------------------------------------------------------------------------
static void figure(Canvas *c, const View *v, float x, float *y, const char *label, const char *value)
{
  const float s = v->scale;
  text_draw(c, v->font, x, *y, SMALL * s, DIM, label);
  text_draw(c, v->font, x + 78 * s, *y, SMALL * s, INK, value);
  *y += LINE * s;
}

static void draw_figures(Canvas *c, const View *v)
{
  const rf_live_frame *f = &v->frame;
  const float s = v->scale, x = MARGIN * s, width = 244 * s;
  float y = MARGIN * s;
  char text[80];
  panel(c, x, y, width, (2 * PAD + 26 + 4 * LINE + 6) * s, s);
  y += (PAD + 16) * s;
  const float left = x + PAD * s;
  // A script's clock knows no speed, and its frames are to be the same every time.
  const bool is_timed = !v->script;
  if (f->is_moving)
    snprintf(text, sizeof text, "%.0f fps", is_timed ? v->frames_a_second : 60);
  else
    snprintf(text, sizeof text, f->is_finished ? "Finished" : "Refining");
  text_draw(c, v->font, left, y, 20 * s, f->is_moving ? ACCENT : INK, text);
  text_right(c, v->font, x + width - PAD * s, y, TEXT * s, DIM, v->wanted.render.integrator);
  y += 12 * s;
  // How far the samples are.
  const float done = f->is_moving ? 0 : (float)f->samples / (float)v->wanted.render.end_sample;
  box(c, left, y - 4 * s, width - 2 * PAD * s, 3 * s, 1.5f * s, 0xff5a6070u, 0.6f);
  if (done > 0 && f->render_width == f->width) box(c, left, y - 4 * s, done * (width - 2 * PAD * s), 3 * s, 1.5f * s, ACCENT, 1);
  y += 16 * s;
  snprintf(text, sizeof text, "%d of %d", f->samples, v->wanted.render.end_sample);
  figure(c, v, left, &y, "samples", text);
  snprintf(text, sizeof text, "%d × %d  (1:%d)", f->render_width, f->render_height,
           (f->width + f->render_width - 1) / f->render_width);
  if (f->traced < 1)
    snprintf(text, sizeof text, "%d × %d  %.0f %% traced", f->render_width, f->render_height, 100 * f->traced);
  figure(c, v, left, &y, "pixels", text);
  const double rays = is_timed && f->render_seconds > 0 ? (double)f->rays / f->render_seconds * 1e-6 : 0;
  snprintf(text, sizeof text, is_timed ? "%.1f million/s" : "–", rays);
  figure(c, v, left, &y, "rays", text);
  const double longest = fmax(f->render_seconds, f->denoise_seconds);
  if (is_timed)
    snprintf(text, sizeof text, longest < 0.1 ? "%.1f + %.1f + %.1f ms" : "%.0f + %.0f + %.0f ms",
             1e3 * f->render_seconds, 1e3 * f->denoise_seconds, 1e3 * f->show_seconds);
  else
    snprintf(text, sizeof text, "–");
  figure(c, v, left, &y, "frame", text);
}

// --- proofs -----------------------------------------------------------------------------------------
// A line with round ends, of so many pixels.
static void stroke(Canvas *c, float ax, float ay, float bx, float by, float width, uint32_t color)
{
  const float dx = bx - ax, dy = by - ay, square = fmaxf(dx * dx + dy * dy, 1e-6f), r = width / 2;
  const int x0 = (int)fmaxf(fminf(ax, bx) - r - 1, 0), x1 = (int)fminf(fmaxf(ax, bx) + r + 2, (float)c->width);
  const int y0 = (int)fmaxf(fminf(ay, by) - r - 1, 0), y1 = (int)fminf(fmaxf(ay, by) + r + 2, (float)c->height);
  for (int y = y0; y < y1; y++)
    for (int x = x0; x < x1; x++) {
      const float px = (float)x + 0.5f - ax, py = (float)y + 0.5f - ay, t = fminf(fmaxf((px * dx + py * dy) / square, 0), 1);
      const float far = hypotf(px - t * dx, py - t * dy), share = fminf(fmaxf(r - far + 0.5f, 0), 1);
      uint32_t *p = c->pixels + (size_t)y * (size_t)c->width + (size_t)x;
      *p = color_mix(*p, color, (uint32_t)(share * 256));
    }
}

static void draw_pins(Canvas *c, const View *v)
{
  const Proof *p = &v->proof;
  const float s = v->scale;
  for (int i = 0; i < p->pin_count; i++) {
    char number[4];
    const float x = (float)p->pins[i].x, y = (float)p->pins[i].y;
    snprintf(number, sizeof number, "%d", i + 1);
    stroke(c, x, y, x, y, 11 * s, PANEL);
    stroke(c, x, y, x, y, 7 * s, ACCENT);
    text_draw(c, v->font, x + 8 * s, y - 5 * s, SMALL * s, INK, number);
  }
}

static void draw_proof(Canvas *c, const View *v)
{
  const Proof *p = &v->proof;
  const float s = v->scale, x = MARGIN * s, top = (MARGIN + 2 * PAD + 26 + 4 * LINE + 6 + 8) * s;
  float width = 0;
  for (int i = 0; i < p->line_count; i++) width = fmaxf(width, text_width(v->font, SMALL * s, p->lines[i]));
  panel(c, x, top, fmaxf(width + 2 * PAD * s, 244 * s), (2 * PAD + (float)(p->line_count - 1) * LINE + 12) * s, s);
  for (int i = 0; i < p->line_count; i++)
    text_draw(c, v->font, x + PAD * s, top + (PAD + 10 + (float)i * LINE) * s, SMALL * s, i ? INK : ACCENT, p->lines[i]);
}

// The arrow that is carried, as it points for the eye: seen from behind and above, so that ahead is up.
static void draw_arrow(Canvas *c, const View *v)
{
  const rf_eye e = walker_eye(&v->walker);
  const rf_vec3 z = v->walker.arrow.frame.z;
  const float s = v->scale, r = 34 * s, x = (float)c->width - (MARGIN + 46) * s, y = (float)c->height - (MARGIN + 46) * s;
  const float right = -vec_dot(z, e.frame.x), up = -vec_dot(z, e.frame.y), ahead = vec_dot(z, e.frame.z);
  const float tx = r * right, ty = -r * (0.866f * ahead + 0.5f * up), length = fmaxf(hypotf(tx, ty), 1e-3f);
  const float ux = tx / length, uy = ty / length, head = fminf(10 * s, length);
  box(c, x - 46 * s, y - 46 * s, 92 * s, 92 * s, 46 * s, PANEL, 0.8f);
  stroke(c, x - tx, y - ty, x + tx, y + ty, 3 * s, ACCENT);
  stroke(c, x + tx, y + ty, x + tx - head * (ux + 0.6f * uy), y + ty - head * (uy - 0.6f * ux), 3 * s, ACCENT);
  stroke(c, x + tx, y + ty, x + tx - head * (ux - 0.6f * uy), y + ty - head * (uy + 0.6f * ux), 3 * s, ACCENT);
}

// --- the game ---------------------------------------------------------------------------------------
static void draw_game(Canvas *c, const View *v)
{
  enum { MOST = 6 };
  char title[96], hint[200], lines[MOST][112];
  bool open[MOST];
  const int count = game_lines(v, title, hint, lines, open, MOST);
  if (!count) return;
  float points = fmaxf(text_width(v->font, TEXT, title), text_width(v->font, SMALL, hint)); // without a scale
  for (int i = 0; i < count; i++) points = fmaxf(points, text_width(v->font, SMALL, lines[i]) + 16);
  points += 2 * PAD;
  const float s = fminf(v->scale, (float)c->width / (points + 2 * MARGIN)), width = points * s; // a narrow window has small letters
  const float x = ((float)c->width - width) / 2, left = x + PAD * s;
  float y = MARGIN * s;
  panel(c, x, y, width, ((float)(count + 1) * LINE + 40) * s, s);
  y += 23 * s;
  text_draw(c, v->font, left, y, TEXT * s, INK, title);
  y += LINE * s;
  text_draw(c, v->font, left, y, SMALL * s, DIM, hint);
  for (int i = 0; i < count; i++) {
    y += LINE * s;
    stroke(c, left + 4 * s, y - 4 * s, left + 4 * s, y - 4 * s, 8 * s, open[i] ? 0xff58d68du : BAD);
    text_draw(c, v->font, left + 16 * s, y, SMALL * s, open[i] ? INK : DIM, lines[i]);
  }
}

// --- keys and notes -------------------------------------------------------------------------------
static void draw_help(Canvas *c, const View *v)
{
  const char *key, *what;
  int count = 0;
  while (input_key_line(count, &key, &what)) count++;
  const int half = (count + 1) / 2;
  const float s = fminf(v->scale, (float)c->height / (float)(half * LINE + 110)), column = 372 * s;
  const float width = fminf(2 * column + 2 * 24 * s, (float)c->width), height = ((float)half * LINE + 84) * s;
  const float x = ((float)c->width - width) / 2, y = ((float)c->height - height) / 2;
  box(c, 0, 0, (float)c->width, (float)c->height, 0, 0xff000000u, 0.45f);
  box(c, x, y, width, height, 10 * s, PANEL, 0.95f);
  text_draw(c, v->font, x + 24 * s, y + 38 * s, 20 * s, INK, "Keys");
  text_right(c, v->font, x + width - 24 * s, y + 36 * s, SMALL * s, DIM, "F1 closes this");
  for (int i = 0; i < count; i++) {
    input_key_line(i, &key, &what);
    const float left = x + 24 * s + (float)(i / half) * column, line = y + (68 + (float)(i % half) * LINE) * s;
    text_draw(c, v->font, left, line, SMALL * s, ACCENT, key);
    text_draw(c, v->font, left + 126 * s, line, SMALL * s, INK, what);
  }
}

static void draw_bottom(Canvas *c, const View *v, const char *text, uint32_t color)
{
  const float s = v->scale, most = (float)c->width - 2 * (MARGIN + PAD) * s;
  char line[600];
  snprintf(line, sizeof line, "%s", text);
  line[strcspn(line, "\n")] = 0; // of a message with a picture of the place, what it says
  size_t n = strlen(line);
  while (n > 4 && text_width(v->font, TEXT * s, line) > most) memcpy(line + --n - 3, "...", 4);
  const float width = text_width(v->font, TEXT * s, line) + 2 * PAD * s, height = 32 * s;
  const float x = ((float)c->width - width) / 2, y = (float)c->height - height - MARGIN * s;
  panel(c, x, y, width, height, s);
  text_draw(c, v->font, x + PAD * s, y + 21 * s, TEXT * s, color, line);
}

// As much of a text as fits into a width, up to a space.
static size_t line_end(Font *f, float size, const char *text, float most)
{
  char line[600];
  size_t end = 0;
  for (size_t n = 1; n < sizeof line - 1; n++) {
    if (text[n] && text[n] != ' ') continue;
    memcpy(line, text, n);
    line[n] = 0;
    if (end && text_width(f, size, line) > most) break;
    end = n;
    if (!text[n]) break;
  }
  return end;
}

// What the scene says of itself, above the notes.
static void draw_caption(Canvas *c, const View *v)
{
  enum { LINES = 5 };
  const Caption *p = &v->caption;
  const float s = v->scale, most = fminf(560 * s, (float)c->width - 2 * (MARGIN + PAD) * s);
  char lines[LINES][600];
  int count = 0;
  float width = text_width(v->font, TEXT * s, p->title);
  for (const char *left = p->text; *left && count < LINES; count++) {
    const size_t n = line_end(v->font, SMALL * s, left, most);
    snprintf(lines[count], sizeof *lines, "%.*s", (int)n, left);
    width = fmaxf(width, text_width(v->font, SMALL * s, lines[count]));
    left += n + (left[n] == ' ');
  }
  const float height = ((*p->title ? LINE + 4 : 0) + (float)count * LINE + 14) * s;
  const float x = ((float)c->width - width) / 2 - PAD * s, top = (float)c->height - height - (MARGIN + 40) * s;
  float y = top + 4 * s;
  panel(c, x, top, width + 2 * PAD * s, height, s);
  if (*p->title) text_draw(c, v->font, x + PAD * s, y += LINE * s, TEXT * s, ACCENT, p->title);
  if (*p->title) y += 3 * s;
  for (int i = 0; i < count; i++) text_draw(c, v->font, x + PAD * s, y += LINE * s, SMALL * s, INK, lines[i]);
}

static void draw_list(Canvas *c, View *v)
{
  SceneList *l = &v->list;
  const float s = v->scale, width = fminf(420 * s, (float)c->width - 2 * MARGIN * s);
  const int fits = (int)(((float)c->height - 110 * s) / (LINE * s)), shown = l->count < fits ? l->count : fits > 1 ? fits : 1;
  const int before = l->at - shown / 2, last = l->count - shown;
  const float height = ((float)shown * LINE + 66) * s, x = ((float)c->width - width) / 2, y = ((float)c->height - height) / 2;
  l->first = before < 0 ? 0 : before > last ? last : before;
  l->shown = shown;
  l->row = (int)(LINE * s);
  l->x = (int)x;
  l->y = (int)(y + 50 * s);
  l->width = (int)width;
  box(c, x, y, width, height, 10 * s, PANEL, 0.95f);
  text_draw(c, v->font, x + 20 * s, y + 32 * s, 17 * s, INK, "Scenes");
  text_right(c, v->font, x + width - 20 * s, y + 31 * s, SMALL * s, DIM, "enter opens, F2 closes");
  for (int i = 0; i < shown; i++) {
    const bool is_chosen = l->first + i == l->at;
    const float top = (float)l->y + (float)(i * l->row);
    if (is_chosen) box(c, x + 10 * s, top, width - 20 * s, LINE * s, 4 * s, 0xff5a6070u, 0.7f);
    text_draw(c, v->font, x + 20 * s, top + 14 * s, SMALL * s, is_chosen ? ACCENT : INK, l->names[l->first + i]);
  }
}

static void draw_hint(Canvas *c, const View *v)
{
  const float s = v->scale, y = (float)c->height - MARGIN * s;
  const char *text = "F1 keys";
  panel(c, MARGIN * s, y - 24 * s, text_width(v->font, SMALL * s, text) + 20 * s, 24 * s, s);
  text_draw(c, v->font, (MARGIN + 10) * s, y - 8 * s, SMALL * s, DIM, text);
}

void hud_draw(View *v)
{
  Canvas c = {v->pixels, v->width, v->height};
  if (!v->frame.number) {
    if (v->loader.is_running) {
      char text[200];
      const char *name = strrchr(v->loader.path, '/');
      snprintf(text, sizeof text, "Opening %.150s", name ? name + 1 : v->loader.path);
      draw_bottom(&c, v, text, INK);
    }
    return;
  }
  if (v->picked.object && v->shows_hud && v->frame.width == v->width && v->frame.height == v->height) outline(&c, v);
  if (v->shows_hud && v->font) {
    draw_figures(&c, v);
    if (v->picked.object) draw_picked(&c, v);
    if (v->proof.line_count) draw_proof(&c, v);
    if (prove_sees_pins(v)) draw_pins(&c, v);
    draw_hint(&c, v);
  }
  if (v->font && !v->shows_help) draw_game(&c, v);
  if (v->walker.carries) draw_arrow(&c, v);
  if (v->clock < v->caption.until && v->font && !v->list.is_open) draw_caption(&c, v);
  if (v->list.is_open && v->list.count) draw_list(&c, v);
  if (v->shows_help) draw_help(&c, v);
  if (v->clock < v->note.until)
    draw_bottom(&c, v, v->note.text, v->note.is_bad ? BAD : INK);
  else if (v->shot.is_running && !v->script) {
    char text[80];
    pthread_mutex_lock(&v->shot.mutex);
    snprintf(text, sizeof text, "Screenshot %.0f %%", 100 * v->shot.done);
    pthread_mutex_unlock(&v->shot.mutex);
    draw_bottom(&c, v, text, DIM);
  }
}
