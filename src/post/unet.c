// See unet.h.

#include "post/unet.h"

#include "base/mem.h"

#include <stdio.h>
#include <string.h>

enum { INPUT = UNET_LAYERS, NONE = -1, MOST_CHANNELS = 1024 };

// Layers in the order of running. in and skip are layers too; an "up" layer sees its first input enlarged.
static const struct {
  const char *name;
  int in, skip;
  bool pools, is_up;
  int level; // of the convolution: the picture's sides are divided by 2^level
} steps[UNET_LAYERS] = {
    {"enc_conv0", INPUT, NONE, false, false, 0}, {"enc_conv1", 0, NONE, true, false, 0},
    {"enc_conv2", 1, NONE, true, false, 1},      {"enc_conv3", 2, NONE, true, false, 2},
    {"enc_conv4", 3, NONE, true, false, 3},      {"enc_conv5a", 4, NONE, false, false, 4},
    {"enc_conv5b", 5, NONE, false, false, 4},    {"dec_conv4a", 6, 3, false, true, 3},
    {"dec_conv4b", 7, NONE, false, false, 3},    {"dec_conv3a", 8, 2, false, true, 2},
    {"dec_conv3b", 9, NONE, false, false, 2},    {"dec_conv2a", 10, 1, false, true, 1},
    {"dec_conv2b", 11, NONE, false, false, 1},   {"dec_conv1a", 12, INPUT, false, true, 0},
    {"dec_conv1b", 13, NONE, false, false, 0},   {"dec_conv0", 14, NONE, false, false, 0},
};
// --- weights --------------------------------------------------------------------------------------
static const TzaTensor *find(const Tza *t, int layer, const char *what)
{
  char name[40];
  snprintf(name, sizeof name, "%s.%s", steps[layer].name, what);
  return tza_find(t, name);
}

static bool is_kernel(const TzaTensor *w, const TzaTensor *b)
{
  return w && b && w->dims == 4 && b->dims == 1 && w->size[2] == 3 && w->size[3] == 3 &&
         b->size[0] == w->size[0] && w->size[0] <= MOST_CHANNELS && w->size[1] <= MOST_CHANNELS;
}

static uint32_t channels_of(const Unet *u, int map)
{
  return map == NONE ? 0 : map == INPUT ? u->layers[0].in : u->layers[map].out;
}

static bool read_shapes(Unet *u, const Tza *t, Err *err)
{
  for (int i = 0; i < UNET_LAYERS; i++) {
    const TzaTensor *w = find(t, i, "weight");
    if (!is_kernel(w, find(t, i, "bias")))
      return err_set(err, ERR_BAD_SCENE, "the network has no 3x3 convolution \"%s\"", steps[i].name);
    UnetLayer *l = &u->layers[i];
    l->skip = channels_of(u, steps[i].skip);
    if (i == 0) l->in = w->size[1];
    if (i > 0) l->in = channels_of(u, steps[i].in);
    l->out = w->size[0];
    if (l->in + l->skip != w->size[1])
      return err_set(err, ERR_BAD_SCENE, "layer \"%s\" of the network takes %u channels where there are %u",
                     steps[i].name, w->size[1], l->in + l->skip);
    l->block_size = (size_t)((steps[i].is_up ? 4 : 9) * l->in + 9 * l->skip) * MAP_BLOCK;
    l->phase_size = l->block_size * map_blocks(l->out);
  }
  return true;
}

static size_t layer_floats(const UnetLayer *l, bool is_up)
{
  return (is_up ? 4 : 1) * l->phase_size + (size_t)map_blocks(l->out) * MAP_BLOCK;
}

// One weight: the sum of the 3x3 kernel's rows y0..y1 and columns x0..x1.
static float weight_sum(const TzaTensor *w, uint32_t out, uint32_t in, const int y[2], const int x[2])
{
  float sum = 0;
  if (out >= w->size[0]) return 0; // fills up the last block
  for (int ty = y[0]; ty <= y[1]; ty++)
    for (int tx = x[0]; tx <= x[1]; tx++)
      sum += tza_value(w, ((out * (size_t)w->size[1] + in) * 3 + ty) * 3 + tx);
  return sum;
}

// The rows (or columns) of the kernel that meet tap t of an enlarged input in a pixel of this parity: an even one sees
// its neighbour before once and its own source twice, an odd one its own twice and the next once.
static void taps_of(int parity, int t, int out[2])
{
  out[0] = parity ? 2 * t : t;
  out[1] = parity ? t + 1 : 2 * t;
}

// The weights of `count` input channels from `first` on for a block of outputs; parity NULL: not enlarged.
static float *pack_input(float *to, const TzaTensor *w, uint32_t block, uint32_t first, uint32_t count,
                         const int *parity)
{
  const int taps = parity ? 2 : 3;
  for (uint32_t b = 0; b < count; b += MAP_BLOCK)
    for (int t = 0; t < taps * taps; t++) {
      int y[2] = {t / taps, t / taps}, x[2] = {t % taps, t % taps};
      if (parity) taps_of(parity[0], t / taps, y);
      if (parity) taps_of(parity[1], t % taps, x);
      for (uint32_t c = b; c < count && c < b + MAP_BLOCK; c++)
        for (uint32_t k = 0; k < MAP_BLOCK; k++)
          *to++ = weight_sum(w, block * MAP_BLOCK + k, first + c, y, x);
    }
  return to;
}

static float *pack_layer(UnetLayer *l, float *to, const TzaTensor *w, const TzaTensor *b, bool is_up)
{
  l->bias = to;
  for (uint32_t k = 0; k < map_blocks(l->out) * MAP_BLOCK; k++) *to++ = k < l->out ? tza_value(b, k) : 0;
  l->weights = to;
  for (int phase = 0; phase < (is_up ? 4 : 1); phase++)
    for (uint32_t block = 0; block < map_blocks(l->out); block++) {
      to = pack_input(to, w, block, 0, l->in, is_up ? (const int[2]){phase / 2, phase % 2} : NULL);
      to = pack_input(to, w, block, l->in, l->skip, NULL);
    }
  return to;
}

bool unet_init(Unet *out, const Tza *weights, Err *err)
{
  *out = (Unet){0};
  if (!read_shapes(out, weights, err)) return false;
  size_t count = 0;
  for (int i = 0; i < UNET_LAYERS; i++) count += layer_floats(&out->layers[i], steps[i].is_up);
  float *to = out->memory = mem_alloc(count, sizeof *to);
  if (!to) return err_memory(err, "the weights of the network", count * sizeof *to);
  for (int i = 0; i < UNET_LAYERS; i++)
    to =
        pack_layer(&out->layers[i], to, find(weights, i, "weight"), find(weights, i, "bias"), steps[i].is_up);
  return true;
}

void unet_finish(Unet *u)
{
  mem_free(u->memory);
  *u = (Unet){0};
}

// --- maps -----------------------------------------------------------------------------------------
static size_t map_floats(const Map *m)
{
  return map_blocks(m->channels) * m->block + MAP_SLACK;
}

static Map shape_map(const Unet *u, int map, uint32_t width, uint32_t height)
{
  const int level = map == INPUT ? 0 : steps[map].level + steps[map].pools;
  Map m = {.width = width >> level, .height = height >> level, .channels = channels_of(u, map)};
  m.row = (size_t)(m.width + 2) * MAP_BLOCK;
  m.block = (m.height + 2) * m.row;
  return m;
}

static size_t scratch_size(const Unet *u, uint32_t width)
{
  size_t most = 0;
  for (int i = 0; i < UNET_LAYERS; i++) {
    const size_t size = steps[i].pools ? conv_scratch(width >> steps[i].level, u->layers[i].out) : 0;
    if (size > most) most = size;
  }
  return most;
}

// Layers run one after another; a map is in use from the layer that writes it to the last that reads it. The input is
// there before all, the output after.
typedef struct Life {
  int born, dies;
} Life;

static Life life_of(int map)
{
  Life l = {map == INPUT ? -1 : map, map == UNET_LAYERS - 1 ? UNET_LAYERS : map};
  for (int i = 0; i < UNET_LAYERS; i++)
    if (steps[i].in == map || steps[i].skip == map) l.dies = i;
  return l;
}

static bool are_together(Life a, Life b)
{
  return a.born <= b.dies && b.born <= a.dies;
}

enum { MAP_COUNT = UNET_LAYERS + 1 };

typedef struct Layout {
  size_t offset[MAP_COUNT], size[MAP_COUNT]; // floats
  size_t total;
} Layout;

// The lowest place for a map that no other one of its time touches, among those that have a place.
static size_t place_of(const Layout *l, int map, const bool has_place[MAP_COUNT])
{
  size_t at = 0;
  for (bool moved = true; moved;) {
    moved = false;
    for (int i = 0; i < MAP_COUNT; i++) {
      const bool meets = at < l->offset[i] + l->size[i] && l->offset[i] < at + l->size[map];
      if (!has_place[i] || !meets || !are_together(life_of(i), life_of(map))) continue;
      at = l->offset[i] + l->size[i];
      moved = true;
    }
  }
  return at;
}

// Maps that are never in use together share memory: half of what each on its own would take. The largest first.
static Layout lay_out(const Map maps[MAP_COUNT])
{
  Layout l = {0};
  bool has_place[MAP_COUNT] = {false};
  for (int i = 0; i < MAP_COUNT; i++) l.size[i] = map_floats(&maps[i]);
  for (int n = 0; n < MAP_COUNT; n++) {
    int next = -1;
    for (int i = 0; i < MAP_COUNT; i++)
      if (!has_place[i] && (next < 0 || l.size[i] > l.size[next])) next = i;
    l.offset[next] = place_of(&l, next, has_place);
    has_place[next] = true;
    if (l.offset[next] + l.size[next] > l.total) l.total = l.offset[next] + l.size[next];
  }
  return l;
}

// Zeros around each block, and behind the last. Whoever had the memory before left something there.
static void clear_border(const Map *m)
{
  for (uint32_t b = 0; b < map_blocks(m->channels); b++) {
    memset(map_at(m, b, -1, -1), 0, m->row * sizeof(float));
    memset(map_at(m, b, -1, m->height), 0, m->row * sizeof(float));
    for (uint32_t y = 0; y < m->height; y++) {
      memset(map_at(m, b, -1, y), 0, MAP_BLOCK * sizeof(float));
      memset(map_at(m, b, m->width, y), 0, MAP_BLOCK * sizeof(float));
    }
  }
  memset(map_at(m, map_blocks(m->channels), -1, -1), 0, MAP_SLACK * sizeof(float));
}

bool unet_plan_init(UnetPlan *out, const Unet *u, uint32_t width, uint32_t height, int workers, Err *err)
{
  *out = (UnetPlan){.unet = u, .scratch_size = scratch_size(u, width)};
  for (int i = 0; i < MAP_COUNT; i++) out->maps[i] = shape_map(u, i, width, height);
  const Layout l = lay_out(out->maps);
  const size_t count = l.total + (size_t)workers * out->scratch_size;
  out->memory = mem_alloc(count, sizeof *out->memory);
  if (!out->memory) return err_memory(err, "the maps of the network", count * sizeof *out->memory);
  out->scratch = out->memory + l.total;
  for (int i = 0; i < MAP_COUNT; i++)
    out->maps[i].data = out->memory + l.offset[i] + out->maps[i].row + MAP_BLOCK;
  return true;
}

void unet_plan_finish(UnetPlan *p)
{
  mem_free(p->memory);
  *p = (UnetPlan){0};
}

// --- running --------------------------------------------------------------------------------------
typedef struct LayerWork {
  Conv conv;
  const UnetPlan *plan;
  const PostKernels *kernels;
} LayerWork;

static void layer_item(void *user, size_t item, int worker)
{
  const LayerWork *w = user;
  w->kernels->conv_rows(&w->conv, (uint32_t)item, w->plan->scratch + (size_t)worker * w->plan->scratch_size);
}

static Conv conv_of(const UnetPlan *p, int layer)
{
  const UnetLayer *l = &p->unet->layers[layer];
  Conv c = {.in = {p->maps[steps[layer].in]},
            .in_count = 1,
            .is_up = steps[layer].is_up,
            .pools = steps[layer].pools,
            .out = p->maps[layer],
            .weights = l->weights,
            .bias = l->bias,
            .phase_size = l->phase_size,
            .block_size = l->block_size};
  if (steps[layer].skip != NONE) c.in[c.in_count++] = p->maps[steps[layer].skip];
  c.width = c.out.width << c.pools;
  c.height = c.out.height << c.pools;
  return c;
}

bool unet_run(UnetPlan *p, const PostKernels *kernels, Jobs *jobs, const Cancel *cancel)
{
  clear_border(&p->maps[INPUT]);
  for (int i = 0; i < UNET_LAYERS; i++) {
    clear_border(&p->maps[i]);
    LayerWork work = {conv_of(p, i), p, kernels};
    if (!jobs_run(jobs, (work.conv.height + 1) / 2, layer_item, &work, cancel)) return false;
  }
  return true;
}
