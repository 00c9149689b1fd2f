// See subsample.h. The picture is worked on in strips as high as the largest block; a strip's blocks, and what they are
// cut into, stay its own. Only pixels on the line between two strips are asked for by both, and whoever marks them first
// has them traced. A step ends when all strips are through, so that what a step reads was traced in one before:
//
//   corners -> 8 -> 4 -> 2 -> neighbours' edges -> 4 -> 2 -> fill -> put what was traced on top
//
// Looking at edges and cutting are two steps, so that no strip sees what another has just cut.

#include "render/subsample.h"

#include "base/mem.h"
#include "base/wide.h"

#include <string.h>

enum { MOST_BLOCK = 16, LEAST_BLOCK = 4, MOST_LEVEL = 4 };

typedef enum BlockFill { FILL_MIXED, FILL_EQUAL, FILL_CUT } BlockFill;

typedef struct Block {
  uint16_t x, y;
  uint8_t level; // its side is 1 << level
  uint8_t fill;  // BlockFill
} Block;

typedef struct Strip {
  Block *at_level[MOST_LEVEL + 1]; // to be looked at
  uint32_t count[MOST_LEVEL + 1];
  Block *filled;
  uint32_t filled_count;
  SubsamplePixel *asked; // all that this strip has had traced, and from traced_count on is to be
  uint32_t asked_count, traced_count;
} Strip;

struct Subsampler {
  int width, height;
  SubsampleResult *results; // of each pixel, where its mark is set
  atomic_bool *marks;       // of each pixel: it was asked for
  uint8_t *is_cut;          // of each largest block: some of it was cut
  Strip *strips;
  void *lists; // what the strips' arrays lie in
  size_t strip_capacity;

  // of the run
  const SubsampleSettings *settings;
  SubsampleTrace *trace;
  void *user;
  const Cancel *cancel;
  uint8_t *rgba;
  uint32_t *objects; // may be NULL
  int level, columns, strip_count; // level of the largest blocks
};

SubsampleSettings subsample_defaults(void)
{
  return (SubsampleSettings){
      .block = 8, .most_contrast = 8 / 255.0f, .most_error = 5 / 255.0f, .has_probe = true, .has_round = true};
}

// --- memory ---------------------------------------------------------------------------------------
static size_t align_up(size_t n) { return (n + 63) & ~(size_t)63; }

// Bytes of a strip's lists: at worst every block of a level is there, and every pixel and the line below is asked for.
static size_t strip_bytes(int width, int block)
{
  size_t blocks = ((size_t)width + (size_t)block - 1) / (size_t)block;
  size_t sum = align_up(((size_t)block + 1) * (size_t)width * sizeof(SubsamplePixel));
  for (int side = block; side > 1; side /= 2, blocks *= 4) sum += 2 * align_up(blocks * sizeof(Block));
  return sum;
}

static void strip_place(Strip *s, uint8_t *at, int width, int level)
{
  size_t columns = ((size_t)width + ((size_t)1 << level) - 1) >> level, filled = 0;
  for (size_t n = columns; level > 0; level--, n *= 4) {
    s->at_level[level] = (Block *)at;
    at += align_up(n * sizeof(Block));
    filled += align_up(n * sizeof(Block));
  }
  s->filled = (Block *)at;
  s->asked = (SubsamplePixel *)(at + filled);
}

Subsampler *subsampler_create(int width, int height, Err *err)
{
  const size_t pixels = (size_t)width * (size_t)height;
  const size_t strips = ((size_t)height + LEAST_BLOCK - 1) / LEAST_BLOCK;
  size_t bytes = 0;
  for (int block = LEAST_BLOCK; block <= MOST_BLOCK; block *= 2) {
    const size_t b = strip_bytes(width, block) * (((size_t)height + (size_t)block - 1) / (size_t)block);
    bytes = b > bytes ? b : bytes;
  }
  Subsampler *s = mem_zero(1, sizeof *s);
  if (!s) return err_memory(err, "a subsampled picture", sizeof *s), NULL;
  s->width = width;
  s->height = height;
  s->results = mem_alloc(pixels, sizeof *s->results);
  s->marks = mem_alloc(pixels, 1);
  s->is_cut = mem_alloc(strips, ((size_t)width + LEAST_BLOCK - 1) / LEAST_BLOCK);
  s->strips = mem_zero(strips, sizeof *s->strips);
  s->lists = mem_alloc(bytes, 1);
  if (s->results && s->marks && s->is_cut && s->strips && s->lists) return s;
  err_memory(err, "a subsampled picture", pixels * 21 + bytes);
  subsampler_destroy(s);
  return NULL;
}

void subsampler_destroy(Subsampler *s)
{
  if (!s) return;
  mem_free(s->results);
  mem_free((void *)s->marks);
  mem_free(s->is_cut);
  mem_free(s->strips);
  mem_free(s->lists);
  mem_free(s);
}

// --- tracing --------------------------------------------------------------------------------------
static size_t pixel_at(const Subsampler *s, int x, int y) { return (size_t)y * (size_t)s->width + (size_t)x; }

static void ask(Subsampler *s, Strip *strip, int x, int y)
{
  // Relaxed: who is first does not matter, and that it was traced is known by the end of the step.
  atomic_bool *mark = &s->marks[pixel_at(s, x, y)];
  if (atomic_load_explicit(mark, memory_order_relaxed)) return;
  if (atomic_exchange_explicit(mark, true, memory_order_relaxed)) return;
  strip->asked[strip->asked_count++] = (SubsamplePixel){(uint16_t)x, (uint16_t)y};
}

static void trace_asked(Subsampler *s, Strip *strip, int worker)
{
  SubsampleResult results[SUBSAMPLE_PACKET];
  while (strip->traced_count < strip->asked_count && !is_cancelled(s->cancel)) {
    const SubsamplePixel *pixels = strip->asked + strip->traced_count;
    const uint32_t left = strip->asked_count - strip->traced_count;
    const uint32_t count = left < SUBSAMPLE_PACKET ? left : SUBSAMPLE_PACKET;
    s->trace(s->user, pixels, count, results, worker);
    for (uint32_t i = 0; i < count; i++) s->results[pixel_at(s, pixels[i].x, pixels[i].y)] = results[i];
    strip->traced_count += count;
  }
}

// --- blocks ---------------------------------------------------------------------------------------
// The corners of a block; those past the picture's last row and column are taken on it.
typedef struct Corners {
  const SubsampleResult *at[4]; // left and right above, left and right below
  int x, y, right, below;
} Corners;

static Corners corners_of(const Subsampler *s, const Block *b)
{
  const int side = 1 << b->level;
  const int right = b->x + side < s->width ? b->x + side : s->width - 1;
  const int below = b->y + side < s->height ? b->y + side : s->height - 1;
  const SubsampleResult *r = s->results;
  return (Corners){{&r[pixel_at(s, b->x, b->y)], &r[pixel_at(s, right, b->y)], &r[pixel_at(s, b->x, below)],
                    &r[pixel_at(s, right, below)]},
                   b->x, b->y, right, below};
}

static Vec3 color_of(const SubsampleResult *r) { return v3_load(r->rgb); }

static Vec3 edge_mix(const SubsampleResult *a, const SubsampleResult *b, int at, int length)
{
  return length ? v3_mix(color_of(a), color_of(b), (float)at / (float)length) : color_of(a);
}

static Vec3 corners_mix_at(const Corners *c, int x, int y)
{
  const int width = c->right - c->x, height = c->below - c->y;
  const Vec3 above = edge_mix(c->at[0], c->at[1], x - c->x, width), below = edge_mix(c->at[2], c->at[3], x - c->x, width);
  return height ? v3_mix(above, below, (float)(y - c->y) / (float)height) : above;
}

static float distance(Vec3 a, Vec3 b)
{
  const Vec3 d = a - b;
  return max_f(fabsf(d[0]), max_f(fabsf(d[1]), fabsf(d[2])));
}

static BlockFill corners_fill(const Subsampler *s, const Corners *c)
{
  Vec3 low = color_of(c->at[0]), high = low;
  for (int i = 1; i < 4; i++) {
    if (c->at[i]->signature != c->at[0]->signature) return FILL_CUT;
    low = v3_min(low, color_of(c->at[i]));
    high = v3_max(high, color_of(c->at[i]));
  }
  const float contrast = distance(high, low);
  if (!(contrast <= s->settings->most_contrast)) return FILL_CUT; // what is no number is cut, too
  return contrast < 0.5f / 255 ? FILL_EQUAL : FILL_MIXED;
}

static bool pixel_agrees(const Subsampler *s, const Corners *c, int x, int y)
{
  const SubsampleResult *r = &s->results[pixel_at(s, x, y)];
  return r->signature == c->at[0]->signature &&
         distance(color_of(r), corners_mix_at(c, x, y)) <= s->settings->most_error;
}

// Cuts a block in four, which the next level looks at; one of two pixels a side into its pixels.
static void block_cut(Subsampler *s, Strip *strip, const Block *b)
{
  const int half = 1 << b->level >> 1;
  s->is_cut[(size_t)(b->y >> s->level) * (size_t)s->columns + (size_t)(b->x >> s->level)] = 1;
  for (int j = 0; j <= 2; j++)
    for (int i = 0; i <= 2; i++) {
      if (half == 1 && (i == 2 || j == 2)) continue; // of other blocks
      // On the picture's last row and column, blocks that stick out have their corners.
      const int x = b->x + i * half, y = b->y + j * half;
      ask(s, strip, x < s->width ? x : s->width - 1, y < s->height ? y : s->height - 1);
    }
  if (half == 1) return;
  for (int k = 0; k < 4; k++) {
    const Block part = {(uint16_t)(b->x + (k & 1) * half), (uint16_t)(b->y + (k >> 1) * half), (uint8_t)(b->level - 1), 0};
    if (part.x < s->width && part.y < s->height) strip->at_level[part.level][strip->count[part.level]++] = part;
  }
}

// --- steps ----------------------------------------------------------------------------------------
static void step_corners(void *user, size_t item, int worker)
{
  Subsampler *s = user;
  Strip *strip = &s->strips[item];
  const int side = 1 << s->level, y = (int)item << s->level;
  for (int x = 0; x < s->width; x += side) {
    ask(s, strip, x, y);
    strip->at_level[s->level][strip->count[s->level]++] = (Block){(uint16_t)x, (uint16_t)y, (uint8_t)s->level, 0};
  }
  ask(s, strip, s->width - 1, y);
  if (item + 1 == (size_t)s->strip_count) { // the last row has no strip of its own
    for (int x = 0; x < s->width; x += side) ask(s, strip, x, s->height - 1);
    ask(s, strip, s->width - 1, s->height - 1);
  }
  trace_asked(s, strip, worker);
}

static int middle(int from, int to) { return (from + to + 1) / 2; }

// Looks at the blocks of one level: those that may be filled, if their centres agree; the rest is cut.
static void strip_look(Subsampler *s, Strip *strip, int level, int worker)
{
  Block *blocks = strip->at_level[level];
  const uint32_t count = strip->count[level];
  const bool has_probe = s->settings->has_probe && level >= 2;
  for (uint32_t i = 0; i < count; i++) {
    const Corners c = corners_of(s, &blocks[i]);
    blocks[i].fill = (uint8_t)corners_fill(s, &c);
    if (blocks[i].fill == FILL_CUT)
      block_cut(s, strip, &blocks[i]);
    else if (has_probe)
      ask(s, strip, middle(c.x, c.right), middle(c.y, c.below));
  }
  trace_asked(s, strip, worker);
  for (uint32_t i = 0; i < count; i++) {
    if (blocks[i].fill == FILL_CUT) continue;
    const Corners c = corners_of(s, &blocks[i]);
    if (has_probe && !pixel_agrees(s, &c, middle(c.x, c.right), middle(c.y, c.below)))
      block_cut(s, strip, &blocks[i]);
    else
      strip->filled[strip->filled_count++] = blocks[i];
  }
  trace_asked(s, strip, worker);
  strip->count[level] = 0;
}

typedef struct LevelStep {
  Subsampler *s;
  int level;
} LevelStep;

static void step_level(void *user, size_t item, int worker)
{
  const LevelStep *l = user;
  strip_look(l->s, &l->s->strips[item], l->level, worker);
}

// Was anything in or beside the largest block around b cut? Only there lie pixels on its edges.
static bool is_beside_cut(const Subsampler *s, const Block *b)
{
  const int x = b->x >> s->level, y = b->y >> s->level;
  const uint8_t *c = s->is_cut + (size_t)y * (size_t)s->columns + (size_t)x;
  return c[0] || (x > 0 && c[-1]) || (x + 1 < s->columns && c[1]) || (y > 0 && *(c - s->columns)) ||
         (y + 1 < s->strip_count && c[s->columns]);
}

static bool edge_pixel_agrees(const Subsampler *s, const Corners *c, int x, int y)
{
  return !atomic_load_explicit(&s->marks[pixel_at(s, x, y)], memory_order_relaxed) || pixel_agrees(s, c, x, y);
}

static bool edges_agree(const Subsampler *s, const Block *b)
{
  const Corners c = corners_of(s, b);
  for (int x = c.x + 1; x < c.right; x++)
    if (!edge_pixel_agrees(s, &c, x, c.y) || !edge_pixel_agrees(s, &c, x, c.below)) return false;
  for (int y = c.y + 1; y < c.below; y++)
    if (!edge_pixel_agrees(s, &c, c.x, y) || !edge_pixel_agrees(s, &c, c.right, y)) return false;
  return true;
}

// What is cut here is marked only when all have looked: is_cut says what was cut before this step.
static void step_edges(void *user, size_t item, int worker)
{
  Subsampler *s = user;
  Strip *strip = &s->strips[item];
  (void)worker;
  for (uint32_t i = 0; i < strip->filled_count; i++) {
    Block *b = &strip->filled[i];
    if (is_beside_cut(s, b) && !edges_agree(s, b)) b->fill = FILL_CUT;
  }
}

static void step_cut(void *user, size_t item, int worker)
{
  Subsampler *s = user;
  Strip *strip = &s->strips[item];
  uint32_t kept = 0;
  for (uint32_t i = 0; i < strip->filled_count; i++) {
    const Block b = strip->filled[i];
    if (b.fill == FILL_CUT)
      block_cut(s, strip, &b);
    else
      strip->filled[kept++] = b;
  }
  strip->filled_count = kept;
  trace_asked(s, strip, worker);
}

// --- filling --------------------------------------------------------------------------------------
// Two pixels of four channels, each 256 times what a byte holds: adding, shifting and packing are one instruction each
// on every processor, and a slope's rounding of 1/512 is, over a row, a thirtieth of what rounding to bytes is.
typedef uint16_t Pixels __attribute__((vector_size(16)));
typedef uint8_t PixelBytes __attribute__((vector_size(8)));
typedef int32_t Int4 __attribute__((vector_size(16)));

enum { UNIT = 256 };

// A colour as Pixels' numbers, with the half that rounds.
static Vec3 scaled(const Subsampler *s, Vec3 c)
{
  if (s->settings->is_bgr) c = v3(c[2], c[1], c[0]);
  Vec3 v = v3_min(v3_max(c, v3_all(0)), v3_all(1)) * (255 * UNIT) + (float)(UNIT / 2);
  v[3] = 255 * UNIT;
  return v;
}

// Numbers of one pixel and of the one beside it.
static Pixels pixels_of(Vec3 a, Vec3 b)
{
  const Int4 i = __builtin_convertvector(a, Int4), j = __builtin_convertvector(b, Int4);
  return (Pixels){(uint16_t)i[0], (uint16_t)i[1], (uint16_t)i[2], (uint16_t)i[3],
                  (uint16_t)j[0], (uint16_t)j[1], (uint16_t)j[2], (uint16_t)j[3]};
}

// The first count pixels of a row that begins with two and goes on by steps of two.
static void store_row(uint8_t *rgba, Pixels at, Pixels step, int count)
{
  for (; count > 0; count -= 2, at += step, rgba += 8) {
    const PixelBytes bytes = __builtin_convertvector(at >> 8, PixelBytes);
    memcpy(rgba, &bytes, count > 1 ? 8 : 4);
  }
}

// Mixed with the block's kind, for the view.
static Vec3 tinted(const Subsampler *s, const Block *b, Vec3 color)
{
  if (!s->settings->shows_blocks) return color;
  return v3_mix(color, b->fill == FILL_EQUAL ? v3(1, 0, 0) : v3(0, 0.1f, 1), 0.7f);
}

// Rows between the left and the right edge.
static void block_store(const Subsampler *s, const Block *b)
{
  const Corners c = corners_of(s, b);
  const int side = 1 << b->level, width = b->x + side < s->width ? side : s->width - b->x;
  const int end_y = b->y + side < s->height ? b->y + side : s->height;
  const float per_x = c.right > c.x ? 1 / (float)(c.right - c.x) : 0, per_y = c.below > c.y ? 1 / (float)(c.below - c.y) : 0;
  Vec3 at[4];
  for (int i = 0; i < 4; i++) at[i] = scaled(s, tinted(s, b, color_of(c.at[i])));
  const Vec3 left_slope = (at[2] - at[0]) * per_y, right_slope = (at[3] - at[1]) * per_y;
  for (int y = b->y; y < end_y; y++) {
    const float down = (float)(y - b->y);
    const Vec3 from = at[0] + down * left_slope, slope = (at[1] + down * right_slope - from) * per_x;
    const size_t first = pixel_at(s, b->x, y);
    store_row(s->rgba + 4 * first, pixels_of(from, from + slope), pixels_of(2 * slope, 2 * slope), width);
    for (int x = 0; s->objects && x < width; x++) s->objects[first + (size_t)x] = c.at[0]->object;
  }
}

static void step_fill(void *user, size_t item, int worker)
{
  Subsampler *s = user;
  const Strip *strip = &s->strips[item];
  (void)worker;
  for (uint32_t i = 0; i < strip->filled_count; i++) block_store(s, &strip->filled[i]);
}

static inline void store_pixel(const Subsampler *s, size_t at, const SubsampleResult *r)
{
  const Vec3 c = color_of(r), held = lanes_min(lanes_max(c, v3_all(0)), v3_all(1)) * 255 + 0.5f;
  const Int4 i = __builtin_convertvector(held, Int4);
  const int first = s->settings->is_bgr ? i[2] : i[0], third = s->settings->is_bgr ? i[0] : i[2];
  const uint32_t pixel = (uint32_t)(first | i[1] << 8 | third << 16) | 0xff000000u;
  memcpy(s->rgba + 4 * at, &pixel, sizeof pixel);
  if (s->objects) s->objects[at] = r->object;
}

static void step_store(void *user, size_t item, int worker)
{
  Subsampler *s = user;
  const Strip *strip = &s->strips[item];
  (void)worker;
  for (uint32_t i = 0; i < strip->asked_count; i++) {
    const size_t at = pixel_at(s, strip->asked[i].x, strip->asked[i].y);
    store_pixel(s, at, &s->results[at]);
  }
}

// No blocks at all: every pixel, eight by eight, from the trace to the picture.
static void step_all(void *user, size_t item, int worker)
{
  Subsampler *s = user;
  const int side = 1 << s->level, top = (int)item << s->level, end_y = top + side < s->height ? top + side : s->height;
  SubsamplePixel pixels[SUBSAMPLE_PACKET];
  SubsampleResult results[SUBSAMPLE_PACKET];
  for (int left = 0; left < s->width && !is_cancelled(s->cancel); left += side) {
    const int end_x = left + side < s->width ? left + side : s->width;
    size_t count = 0;
    for (int y = top; y < end_y; y++)
      for (int x = left; x < end_x; x++) pixels[count++] = (SubsamplePixel){(uint16_t)x, (uint16_t)y};
    s->trace(s->user, pixels, count, results, worker);
    for (size_t i = 0; i < count; i++) store_pixel(s, pixel_at(s, pixels[i].x, pixels[i].y), &results[i]);
    s->strips[item].traced_count += (uint32_t)count;
  }
}

// --------------------------------------------------------------------------------------------------
static void begin(Subsampler *s)
{
  s->level = 0;
  const int block = s->settings->block < LEAST_BLOCK ? 2 * LEAST_BLOCK : s->settings->block;
  while (1 << s->level < block && s->level < MOST_LEVEL) s->level++;
  const int side = 1 << s->level;
  s->columns = (s->width + side - 1) >> s->level;
  s->strip_count = (s->height + side - 1) >> s->level;
  if (s->settings->block >= LEAST_BLOCK) memset((void *)s->marks, 0, (size_t)s->width * (size_t)s->height);
  memset(s->is_cut, 0, (size_t)s->columns * (size_t)s->strip_count);
  const size_t bytes = strip_bytes(s->width, side);
  for (int i = 0; i < s->strip_count; i++) {
    s->strips[i] = (Strip){0};
    strip_place(&s->strips[i], (uint8_t *)s->lists + (size_t)i * bytes, s->width, s->level);
  }
}

static bool run_step(Subsampler *s, JobWork *work, void *user, Jobs *jobs)
{
  return jobs_run(jobs, (size_t)s->strip_count, work, user, s->cancel);
}

static bool run_levels(Subsampler *s, int from, Jobs *jobs)
{
  for (int level = from; level > 0; level--)
    if (!run_step(s, step_level, &(LevelStep){s, level}, jobs)) return false;
  return true;
}

static bool run_blocks(Subsampler *s, Jobs *jobs)
{
  if (s->settings->block < LEAST_BLOCK) return run_step(s, step_all, s, jobs);
  if (!run_step(s, step_corners, s, jobs) || !run_levels(s, s->level, jobs)) return false;
  if (!s->settings->has_round) return true;
  return run_step(s, step_edges, s, jobs) && run_step(s, step_cut, s, jobs) && run_levels(s, s->level - 1, jobs);
}

static void count_pixels(const Subsampler *s, SubsampleStats *stats)
{
  *stats = (SubsampleStats){0};
  for (int i = 0; i < s->strip_count; i++) {
    const Strip *strip = &s->strips[i];
    stats->traced += strip->traced_count;
    for (uint32_t k = 0; k < strip->filled_count; k++) {
      const Block *b = &strip->filled[k];
      const int side = 1 << b->level;
      const int width = s->width - b->x < side ? s->width - b->x : side, height = s->height - b->y < side ? s->height - b->y : side;
      *(b->fill == FILL_EQUAL ? &stats->equal : &stats->mixed) += (uint64_t)(width * height);
    }
  }
}

bool subsampler_run(Subsampler *s, const SubsampleSettings *settings, SubsampleTrace *trace, void *user, Jobs *jobs,
                    const Cancel *cancel, uint8_t *rgba, uint32_t *objects, SubsampleStats *stats)
{
  s->settings = settings;
  s->trace = trace;
  s->user = user;
  s->cancel = cancel;
  s->rgba = rgba;
  s->objects = objects;
  begin(s);
  const bool ok = run_blocks(s, jobs) && run_step(s, step_fill, s, jobs) && run_step(s, step_store, s, jobs);
  if (stats) count_pixels(s, stats);
  return ok;
}
