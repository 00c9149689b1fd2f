// The network's arithmetic and its files, without anybody's trained weights: a small network of random ones, written as
// a .tza file, runs on every instruction set against the plain definition in double precision; damaged files are
// refused.

#include "tests/test.h"

#include "base/hash.h"
#include "base/mem.h"
#include "post/unet.h"
#include "render/hot.h"

// Channels that fill no block of sixteen, and more than one.
static const struct {
  const char *name;
  uint32_t out, in;
} layers[UNET_LAYERS] = {
    {"enc_conv0", 17, 9},   {"enc_conv1", 33, 17},      {"enc_conv2", 5, 33},   {"enc_conv3", 16, 5},
    {"enc_conv4", 20, 16},  {"enc_conv5a", 32, 20},     {"enc_conv5b", 31, 32}, {"dec_conv4a", 48, 31 + 16},
    {"dec_conv4b", 18, 48}, {"dec_conv3a", 21, 18 + 5}, {"dec_conv3b", 16, 21}, {"dec_conv2a", 35, 16 + 33},
    {"dec_conv2b", 19, 35}, {"dec_conv1a", 34, 19 + 9}, {"dec_conv1b", 15, 34}, {"dec_conv0", 3, 15},
};

static uint32_t state = 1;
static float random_float(void) // -1..1
{
  state = state * 1664525u + 1013904223u;
  return (float)(state >> 8) / 8388608.0f - 1;
}

// --- a .tza file ----------------------------------------------------------------------------------
enum { FILE_MOST = 1 << 20 };
static uint8_t file[FILE_MOST];
static size_t file_size;

static void put(const void *bytes, size_t n)
{
  memcpy(file + file_size, bytes, n); // little-endian machines only, as the rest of the tests
  file_size += n;
}
static void put_number(uint64_t x, size_t n)
{
  put(&x, n);
}

static void put_entry(const char *name, const char *what, const uint32_t *size, uint32_t dims, size_t offset)
{
  char full[40];
  snprintf(full, sizeof full, "%s.%s", name, what);
  put_number(strlen(full), 2);
  put(full, strlen(full));
  put_number(dims, 1);
  put(size, 4 * dims);
  put(dims == 4 ? "oihw" : "x", dims);
  put("f", 1);
  put_number(offset, 8);
}

static void write_network(void)
{
  file_size = 0;
  put_number(0x41d7, 2);
  put_number(2, 2);
  put_number(0, 8);
  for (int i = 0; i < UNET_LAYERS; i++) {
    const float gain =
        sqrtf(2.0f / (9 * (float)layers[i].in)); // keeps the signal's size, so that errors are seen
    for (uint32_t k = 0; k < layers[i].out * layers[i].in * 9; k++)
      put(&(float){1.7f * gain * random_float()}, 4);
    for (uint32_t k = 0; k < layers[i].out; k++) put(&(float){0.2f * random_float()}, 4);
  }
  const uint64_t table = file_size;
  memcpy(file + 4, &table, 8);
  put_number(2 * UNET_LAYERS, 4);
  size_t at = 12;
  for (int i = 0; i < UNET_LAYERS; i++) {
    const uint32_t size[4] = {layers[i].out, layers[i].in, 3, 3};
    put_entry(layers[i].name, "weight", size, 4, at);
    at += 36 * (size_t)layers[i].out * layers[i].in;
    put_entry(layers[i].name, "bias", size, 1, at);
    at += 4 * (size_t)layers[i].out;
  }
}

// --- the plain definition -------------------------------------------------------------------------
typedef struct Plain {
  uint32_t channels, width, height;
  double *data;
} Plain;

static double *plain_at(const Plain *p, uint32_t c, uint32_t x, uint32_t y)
{
  return p->data + ((size_t)c * p->height + y) * p->width + x;
}

static Plain plain_create(uint32_t channels, uint32_t width, uint32_t height)
{
  return (Plain){channels, width, height, mem_zero((size_t)channels * width * height, sizeof(double))};
}

static double plain_pixel(const Plain *in, const TzaTensor *w, const TzaTensor *b, uint32_t o, uint32_t x,
                          uint32_t y)
{
  double sum = (double)tza_value(b, o);
  for (uint32_t c = 0; c < in->channels; c++)
    for (uint32_t ty = 0; ty < 3; ty++)
      for (uint32_t tx = 0; tx < 3; tx++)
        if (x + tx >= 1 && x + tx <= in->width && y + ty >= 1 && y + ty <= in->height)
          sum += (double)tza_value(w, ((o * in->channels + c) * 3 + ty) * 3 + tx) *
                 *plain_at(in, c, x + tx - 1, y + ty - 1);
  return sum > 0 ? sum : 0;
}

static Plain plain_conv(Plain in, const Tza *t, int layer)
{
  char name[40];
  snprintf(name, sizeof name, "%s.weight", layers[layer].name);
  const TzaTensor *w = tza_find(t, name);
  snprintf(name, sizeof name, "%s.bias", layers[layer].name);
  const TzaTensor *b = tza_find(t, name);
  Plain out = plain_create(w->size[0], in.width, in.height);
  for (uint32_t o = 0; o < out.channels; o++)
    for (uint32_t y = 0; y < out.height; y++)
      for (uint32_t x = 0; x < out.width; x++) *plain_at(&out, o, x, y) = plain_pixel(&in, w, b, o, x, y);
  mem_free(in.data);
  return out;
}

static Plain plain_pool(Plain in)
{
  Plain out = plain_create(in.channels, in.width / 2, in.height / 2);
  for (uint32_t c = 0; c < out.channels; c++)
    for (uint32_t y = 0; y < out.height; y++)
      for (uint32_t x = 0; x < out.width; x++)
        for (uint32_t k = 0; k < 4; k++) {
          double *const most = plain_at(&out, c, x, y);
          *most =
              fmax(*most, *plain_at(&in, c, 2 * x + k % 2, 2 * y + k / 2)); // after a ReLU: 0 is the least
        }
  mem_free(in.data);
  return out;
}

static Plain plain_copy(Plain p)
{
  Plain out = plain_create(p.channels, p.width, p.height);
  memcpy(out.data, p.data, (size_t)p.channels * p.width * p.height * sizeof(double));
  return out;
}

// The enlarged picture, and behind it the other's channels.
static Plain plain_join(Plain small, Plain other)
{
  Plain out = plain_create(small.channels + other.channels, other.width, other.height);
  for (uint32_t c = 0; c < out.channels; c++)
    for (uint32_t y = 0; y < out.height; y++)
      for (uint32_t x = 0; x < out.width; x++)
        *plain_at(&out, c, x, y) = c < small.channels ? *plain_at(&small, c, x / 2, y / 2)
                                                      : *plain_at(&other, c - small.channels, x, y);
  mem_free(small.data);
  mem_free(other.data);
  return out;
}

static Plain plain_run(const Tza *t, Plain input)
{
  Plain kept[4] = {plain_copy(input)}, p = plain_conv(input, t, 0);
  for (int i = 1; i <= 4; i++) {
    p = plain_pool(plain_conv(p, t, i));
    if (i < 4) kept[i] = plain_copy(p);
  }
  p = plain_conv(plain_conv(p, t, 5), t, 6);
  for (int i = 3; i >= 0; i--) {
    p = plain_join(p, kept[i]);
    p = plain_conv(p, t, 7 + 2 * (3 - i));
    p = plain_conv(p, t, 8 + 2 * (3 - i));
  }
  return plain_conv(p, t, 15);
}

// --------------------------------------------------------------------------------------------------
static void fill_input(UnetPlan *plan, const Plain *from)
{
  for (uint32_t y = 0; y < from->height; y++)
    for (uint32_t x = 0; x < from->width; x++)
      for (uint32_t c = 0; c < MAP_BLOCK; c++)
        map_at(unet_input(plan), 0, x, y)[c] = c < from->channels ? (float)*plain_at(from, c, x, y) : 0;
}

static void check_size(const Tza *t, const Unet *u, uint32_t width, uint32_t height)
{
  Err err = {0};
  Plain input = plain_create(9, width, height);
  for (size_t i = 0; i < (size_t)9 * width * height; i++) input.data[i] = (double)random_float();
  Plain copy = plain_copy(input), want = plain_run(t, input);
  Jobs *jobs = jobs_create(3, &err);
  for (int level = ISA_REF; level <= (int)cpu_best_isa(); level++) {
    UnetPlan plan;
    CHECK_MSG(unet_plan_init(&plan, u, width, height, jobs_thread_count(jobs), &err), "%s", err.text);
    double worst = 0, most = 0;
    for (int again = 0; again < 2; again++) { // a plan is good for more than one picture
      fill_input(&plan, &copy);
      CHECK(unet_run(&plan, &hot_table((IsaLevel)level)->post, jobs, NULL));
    }
    for (uint32_t y = 0; y < height; y++)
      for (uint32_t x = 0; x < width; x++)
        for (uint32_t c = 0; c < 3; c++) {
          const double w = *plain_at(&want, c, x, y);
          worst = fmax(worst, fabs((double)map_at(unet_output(&plan), 0, x, y)[c] - w));
          most = fmax(most, w);
        }
    CHECK_MSG(most > 0.01 && worst <= 2e-6 * fmax(most, 1), "%s, %u x %u: off by %g of %g", isa_names[level],
              width, height, worst, most);
    unet_plan_finish(&plan);
  }
  jobs_destroy(jobs);
  mem_free(copy.data);
  mem_free(want.data);
}

TEST(all_levels_compute_the_definition)
{
  Tza t;
  Unet u;
  Err err = {0};
  write_network();
  CHECK_MSG(tza_read(&t, file, file_size, &err) && unet_init(&u, &t, &err), "%s", err.text);
  check_size(&t, &u, 16, 16);
  check_size(&t, &u, 48, 16);
  check_size(&t, &u, 80, 48);
  unet_finish(&u);
}

// A file cut off anywhere, or with a byte changed, is refused or gives a network of the same shape; never a crash.
static void try_file(const uint8_t *bytes, size_t size, bool may_pass)
{
  uint8_t *copy = malloc(size + 1); // so that a sanitizer sees a read past the end
  Tza t;
  Unet u = {0};
  Err err = {0};
  memcpy(copy, bytes, size);
  const bool ok = tza_read(&t, copy, size, &err) && unet_init(&u, &t, &err);
  CHECK(ok == (err.kind == ERR_NONE));
  CHECK(may_pass || !ok);
  unet_finish(&u);
  free(copy);
}

TEST(damaged_files_are_refused)
{
  write_network();
  uint64_t table;
  memcpy(&table, file + 4, 8);
  for (size_t size = 0; size < 40; size++) try_file(file, size, false);
  for (size_t size = table; size < file_size; size++) try_file(file, size, false);
  for (size_t i = 0; i < (TEST_IS_SLOW ? 100 : 600); i++) {
    const size_t at = i < 12 ? i : table + (i * 7919) % (file_size - table);
    const uint8_t old = file[at];
    file[at] = (uint8_t)(old ^ (1u << (i % 8)) ^ (i & 64 ? 0xff : 0));
    try_file(file, file_size, true);
    file[at] = old;
  }
}

TEST(no_memory_is_an_error)
{
  Tza t;
  Unet u = {0};
  UnetPlan plan = {0};
  Err err = {0};
  write_network();
  CHECK(tza_read(&t, file, file_size, &err));
  mem_fail_after(1);
  CHECK(!unet_init(&u, &t, &err) && err.kind == ERR_NO_MEMORY);
  mem_fail_after(0);
  unet_finish(&u);
  err = (Err){0};
  CHECK(unet_init(&u, &t, &err));
  mem_fail_after(1);
  CHECK(!unet_plan_init(&plan, &u, 16, 16, 1, &err) && err.kind == ERR_NO_MEMORY);
  mem_fail_after(0);
  unet_plan_finish(&plan);
  unet_finish(&u);
}

TEST_MAIN
