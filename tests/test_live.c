// The live picture: that it ends as what rendering offline gives, follows within two frames, keeps its edits in order,
// sleeps when it is done, and that its parts do what they say.

#include "tests/test.h"

#include "base/hash.h"
#include "base/mem.h"
#include "image/image.h"
#include "post/display.h"
#include "rayfold/rayfold.h"
#include "render/trail.h"

#include <pthread.h>
#include <time.h>
#include <unistd.h>

enum { WIDTH = 60, HEIGHT = 44 };

static double now(clockid_t clock)
{
  struct timespec t;
  clock_gettime(clock, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

// --- display --------------------------------------------------------------------------------------
static void show(float *rgba, uint32_t fw, uint32_t fh, uint32_t *out, uint32_t w, uint32_t h)
{
  Display d = {0};
  Jobs *jobs = jobs_create(3, NULL);
  CHECK(display_fit(&d, fw, fh, w, h, jobs, NULL) && display_fit(&d, fw, fh, w, h, jobs, NULL));
  display_show(&d, rgba, out, jobs);
  display_finish(&d);
  jobs_destroy(jobs);
}

TEST(a_picture_of_the_windows_size_is_exact)
{
  float rgba[4 * 256];
  uint32_t out[256];
  for (int i = 0; i < 256; i++)
    for (int k = 0; k < 4; k++) rgba[4 * i + k] = k == 1 ? 0 : srgb_from_u8[i];
  show(rgba, 16, 16, out, 16, 16);
  for (uint32_t i = 0; i < 256; i++) CHECK(out[i] == (0xff000000u | i << 16 | i));
}

TEST(enlarging_keeps_flats_and_never_overshoots)
{
  enum { FW = 13, FH = 7, W = 101, H = 64 };
  float rgba[FW * FH * 4];
  static uint32_t out[W * H];
  for (int code = 0; code < 256; code += 5) { // what is flat stays as it is, to the code
    for (int i = 0; i < FW * FH * 4; i++) rgba[i] = srgb_from_u8[code];
    show(rgba, FW, FH, out, W, H);
    for (int i = 0; i < W * H; i++) CHECK_MSG((int)(out[i] & 255) == code, "%d became %u", code, out[i] & 255);
  }
  for (int i = 0; i < FW * FH; i++) // a step from 40 to 200 has no value outside and rises all the way
    for (int k = 0; k < 4; k++) rgba[4 * i + k] = srgb_from_u8[i % FW < 6 ? 40 : 200];
  show(rgba, FW, FH, out, W, H);
  for (int y = 0; y < H; y++)
    for (int x = 1; x < W; x++) {
      const uint32_t a = out[y * W + x - 1] & 255, b = out[y * W + x] & 255;
      CHECK_MSG(a >= 40 && b <= 200 && a <= b, "%u, %u at %d", a, b, x);
    }
}

// --- the trail ------------------------------------------------------------------------------------
static Eye eye_at(float x, float z)
{
  return (Eye){.kind = EYE_PERSPECTIVE,
               .frame = {v3(1, 0, 0), v3(0, 1, 0), v3(0, 0, 1), v3(x, 0, z)},
               .tan_half_fov = 0.5f,
               .focus = 1};
}

// A wall at z = 0 whose red is x, seen from (x0, 0, 4): what every pixel's middle sees.
static void see_wall(const Eye *e, uint32_t w, uint32_t h, float *rgba, float *depth, float extra)
{
  for (uint32_t i = 0; i < w * h; i++) {
    const float u = 2 * ((float)(i % w) + 0.5f) / (float)w - 1;
    depth[i] = e->frame.p[2];
    rgba[4 * i] = e->frame.p[0] + u * 0.5f * (float)w / (float)h * depth[i] + extra;
    rgba[4 * i + 1] = rgba[4 * i + 2] = 0;
    rgba[4 * i + 3] = 1;
  }
}

TEST(a_trail_finds_the_same_place_again)
{
  enum { W = 40, H = 30 };
  float rgba[W * H * 4], depth[W * H];
  Trail t = {0};
  // An eye that walks sideways and nearer sees the same wall; the pictures say x + 0.3 and x, so their mean x + 0.15.
  const Eye first = eye_at(0, 4), second = eye_at(0.25f, 3.5f);
  see_wall(&first, W, H, rgba, depth, 0.3f);
  CHECK(trail_blend(&t, &first, W, H, rgba, depth, 1, true, NULL, NULL));
  for (int round = 0; round < 2; round++) { // not kept: the same again
    see_wall(&second, W, H, rgba, depth, 0);
    CHECK(trail_blend(&t, &second, W, H, rgba, depth, 1, false, NULL, NULL));
    for (int y = 0; y < H; y++)
      for (int x = 0; x < W; x++) {
        const float u = 2 * ((float)x + 0.5f) / W - 1, place = 0.25f + u * 0.5f * W / H * 3.5f;
        if (fabsf(place) < 2.6f) CHECK_NEAR(rgba[4 * (y * W + x)], place + 0.15f, 1e-4f);
      }
  }
  // Something else stands there now: no history.
  see_wall(&second, W, H, rgba, depth, 0);
  for (int i = 0; i < W * H; i++) depth[i] = 2;
  const float before = rgba[4 * 500];
  CHECK(trail_blend(&t, &second, W, H, rgba, depth, 1, true, NULL, NULL) && rgba[4 * 500] == before);
  trail_finish(&t);
}

// --- the driver -----------------------------------------------------------------------------------
typedef struct Room { // a driver and what it says
  rf_engine *engine;
  rf_live *live;
  rf_live_view view;
  rf_live_frame frame; // the newest
} Room;

static Room room_of(const char *path, bool stepped, int spp)
{
  Room r = {.view = rf_default_live_view()};
  rf_engine_def engine = rf_default_engine_def();
  engine.threads = 2;
  r.engine = rf_engine_create(&engine);
  rf_scene *s = rf_scene_load(r.engine, path, NULL);
  CHECK(s && rf_camera(s, NULL, NULL, 1, &r.view.eye));
  r.view.render = rf_scene_render_def(s, NULL, NULL);
  r.view.develop = rf_scene_develop_def(s);
  r.view.render.end_sample = spp;
  r.view.width = WIDTH;
  r.view.height = HEIGHT;
  rf_live_def def = rf_default_live_def();
  def.stepped = stepped;
  r.live = rf_live_create(s, &def);
  CHECK(r.live);
  return r;
}

static void room_finish(Room *r)
{
  rf_live_destroy(r->live);
  rf_engine_destroy(r->engine);
}

// Takes frames until one shows view and edit and is finished if that is wanted; false after a minute.
static bool wait_for(Room *r, uint64_t view, uint64_t edit, bool finished)
{
  const double start = now(CLOCK_MONOTONIC);
  while (now(CLOCK_MONOTONIC) - start < 60) {
    const bool is_new = rf_live_take(r->live, &r->frame);
    if (r->frame.view >= view && r->frame.edit >= edit && (r->frame.is_finished || !finished) && r->frame.number)
      return true;
    if (!is_new) usleep(500);
  }
  return false;
}

static uint64_t picture_hash(const rf_live_frame *f)
{
  return hash_bytes(0, f->pixels, (size_t)f->width * (size_t)f->height * 4);
}

// The pixels that rendering offline, developing and encoding give.
static bool equals_offline(Room *r)
{
  rf_world *w = rf_live_world(r->live);
  rf_film *f = rf_film_create(r->engine, r->view.width, r->view.height, RF_BEAUTY);
  rf_image img = {0};
  CHECK(rf_render(w, &r->view.eye, &r->view.render, f, NULL) == RF_OK && rf_develop(f, &r->view.develop, &img));
  size_t off = 0;
  for (size_t i = 0; i < (size_t)img.width * (size_t)img.height; i++) {
    const float *p = img.pixels + 4 * i;
    const uint32_t wanted = (uint32_t)srgb_to_u8(p[0]) << 16 | (uint32_t)srgb_to_u8(p[1]) << 8 | srgb_to_u8(p[2]);
    off += (r->frame.pixels[i] & 0xffffff) != wanted;
  }
  rf_image_free(&img);
  rf_film_destroy(f);
  rf_world_destroy(w);
  return off == 0;
}

// D4: however the eye moved before and whatever interrupted it.
TEST(a_still_picture_becomes_the_offline_one)
{
  Room r = room_of("scenes/cornell.json", false, 12);
  r.view.denoise = false;
  const rf_vec3 place = r.view.eye.frame.p;
  uint64_t last = 0;
  for (int i = 0; i < 25; i++) {
    r.view.eye.frame.p.x = place.x + 0.01f * (float)(i % 5);
    r.view.width = WIDTH + i % 3;
    last = rf_live_show(r.live, &r.view);
    CHECK(last);
    usleep(i % 4 * 3000);
  }
  CHECK(wait_for(&r, last, 0, true));
  CHECK(r.frame.samples == 12 && r.frame.render_width == r.view.width && !r.frame.is_moving);
  CHECK(equals_offline(&r));
  // With the trail off and with views, too.
  r.view.reproject = false;
  r.view.render.integrator = "normal";
  CHECK(wait_for(&r, rf_live_show(r.live, &r.view), 0, true) && equals_offline(&r));
  room_finish(&r);
}

TEST(the_same_steps_give_the_same_frames)
{
  uint64_t hashes[2][80] = {{0}};
  int counts[2] = {0};
  for (int run = 0; run < 2; run++) {
    Room r = room_of("scenes/showcase.json", true, 4);
    r.view.step = 4;
    for (int i = 0; i < 6; i++) {
      r.view.eye.frame.p.x += 0.02f;
      r.view.eye.frame.p.y += 0.01f;
      CHECK(rf_live_show(r.live, &r.view));
      if (i == 3) CHECK(rf_live_set(r.live, "sky.gain", "0.7", false));
      for (int steps = 0; i < 5 ? steps < 1 : rf_live_step(r.live); steps++) {
        if (i < 5) CHECK(rf_live_step(r.live));
        if (rf_live_take(r.live, &r.frame)) hashes[run][counts[run]++] = picture_hash(&r.frame);
      }
    }
    CHECK(r.frame.is_finished && r.frame.samples == 4);
    room_finish(&r);
  }
  CHECK_MSG(counts[0] == counts[1] && counts[0] >= 10, "%d and %d frames", counts[0], counts[1]);
  CHECK(!memcmp(hashes[0], hashes[1], sizeof hashes[0]));
  CHECK(hashes[0][0] != hashes[0][1]);
}

// A view that is asked for while one frame is made is in the next but one at the latest.
TEST(a_frame_shows_what_was_asked_two_frames_before)
{
  Room r = room_of("scenes/cornell.json", false, 4096);
  r.view.width = 200;
  r.view.height = 150;
  uint64_t asked[3] = {0}; // when the last three frames appeared
  CHECK(wait_for(&r, rf_live_show(r.live, &r.view), 0, false));
  for (int i = 0; i < 30; i++) {
    const uint64_t before = r.frame.number;
    r.view.eye.frame.p.x += 0.001f;
    const uint64_t newest = rf_live_show(r.live, &r.view);
    while (r.frame.number == before) rf_live_take(r.live, &r.frame);
    if (r.frame.number > before + 1) { // this thread slept over a frame
      asked[0] = asked[1] = 0;
      continue;
    }
    CHECK_MSG(r.frame.view >= asked[1], "it shows %llu, %llu was asked", (unsigned long long)r.frame.view,
              (unsigned long long)asked[1]);
    asked[1] = asked[0];
    asked[0] = newest;
  }
  room_finish(&r);
}

static const char *value_of(Room *r, const char *path, char out[200])
{
  rf_scene *s = rf_live_borrow(r->live, 5);
  CHECK(s);
  const char *json = s ? rf_get(s, path) : NULL;
  snprintf(out, 200, "%s", json ? json : "");
  rf_live_return(r->live);
  return out;
}

static double psnr(const uint32_t *a, const uint32_t *b, size_t pixels)
{
  double sum = 0;
  for (size_t i = 0; i < pixels; i++)
    for (int c = 0; c < 24; c += 8) sum += pow((double)(a[i] >> c & 0xff) - (double)(b[i] >> c & 0xff), 2);
  return 10 * log10(255.0 * 255 * 3 * (double)pixels / fmax(sum, 1e-9));
}

// Frames of whitted that move go past the film: the whole one is the finished picture, one by blocks is near it and knows
// the same objects; their view is all there is to see, and stays.
TEST(whitted_frames_by_blocks)
{
  Room r = room_of("scenes/intro1.json", true, 1);
  r.view.width = 320;
  r.view.height = 240;
  r.view.step = 1;
  static uint32_t whole[320 * 240], objects[320 * 240];
  for (int k = 0; k < 2; k++) {
    r.view.blocks = k ? 8 : 0;
    CHECK(rf_live_show(r.live, &r.view) && rf_live_step(r.live) && rf_live_take(r.live, &r.frame));
    CHECK(r.frame.is_moving && !r.frame.is_finished && r.frame.render_width == 320 && (r.frame.traced < 0.7) == k);
    if (!k) memcpy(whole, r.frame.pixels, sizeof whole);
    if (!k) memcpy(objects, r.frame.objects, sizeof objects);
    const double db = psnr(whole, r.frame.pixels, 320 * 240);
    size_t other = 0;
    for (size_t i = 0; i < 320 * 240; i++) other += r.frame.objects[i] != objects[i];
    CHECK_MSG(db > 50 && other < 320 * 240 / 200, "%d: %g dB, %zu objects differ", k, db, other);
    while (rf_live_step(r.live)) rf_live_take(r.live, &r.frame);
    CHECK(r.frame.is_finished && equals_offline(&r));
    if (!k) CHECK_MSG(psnr(whole, r.frame.pixels, 320 * 240) > 70, "%g dB", psnr(whole, r.frame.pixels, 320 * 240));
  }
  r.view.show_blocks = true;
  CHECK(rf_live_show(r.live, &r.view) && rf_live_step(r.live) && rf_live_take(r.live, &r.frame));
  size_t red = 0, blue = 0;
  for (size_t i = 0; i < 320 * 240; i++) {
    const uint32_t p = r.frame.pixels[i];
    red += (p >> 16 & 0xff) > 3 * (p & 0xff);
    blue += (p & 0xff) > 3 * (p >> 16 & 0xff);
  }
  CHECK_MSG(r.frame.is_finished && red > 1000 && blue > 1000 && !rf_live_step(r.live), "%zu red, %zu blue", red, blue);
  room_finish(&r);
}

TEST(edits_come_in_order_and_a_drag_is_one_step)
{
  Room r = room_of("scenes/cornell.json", false, 4);
  char text[200], message[400] = "";
  CHECK(wait_for(&r, rf_live_show(r.live, &r.view), 0, true));
  const uint64_t plain = picture_hash(&r.frame);
  CHECK(rf_live_set(r.live, "develop.exposure", "0.5", false));
  uint64_t edit = 0;
  for (int i = 1; i <= 20; i++) {
    char json[20];
    snprintf(json, sizeof json, "%d", 2 * i);
    edit = rf_live_set(r.live, "objects[0].translate.0", json, i > 1);
    if (i % 7 == 0) usleep(10000);
  }
  CHECK(wait_for(&r, 0, edit, true) && picture_hash(&r.frame) != plain);
  CHECK(!strcmp(value_of(&r, "objects[0].translate.0", text), "40"));
  // A wrong one changes nothing and says why.
  const rf_live_frame before = r.frame;
  edit = rf_live_set(r.live, "objects[0].translate.0", "\"far\"", true);
  const double start = now(CLOCK_MONOTONIC);
  while (!rf_live_message(r.live, message, sizeof message) && now(CLOCK_MONOTONIC) - start < 60) usleep(1000);
  CHECK_TEXT(message, "far");
  CHECK(!strcmp(value_of(&r, "objects[0].translate.0", text), "40") && r.frame.number == before.number);
  // One undo takes the whole drag back, another the exposure; a camera's edit makes no new picture.
  CHECK(wait_for(&r, 0, rf_live_undo(r.live), true));
  CHECK(wait_for(&r, 0, r.frame.edit, true));
  CHECK(!strcmp(value_of(&r, "objects[0].translate.0", text), "0") && picture_hash(&r.frame) == plain);
  CHECK(rf_live_undo(r.live) && rf_live_redo(r.live) && rf_live_redo(r.live));
  edit = rf_live_undo(r.live);
  CHECK(wait_for(&r, 0, 0, true));
  CHECK(rf_live_set(r.live, "cameras.one", "{\"position\": [1, 2, 3]}", false));
  CHECK(strstr(value_of(&r, "cameras.one", text), "[1"));
  room_finish(&r);
}

TEST(another_scene_takes_the_place_or_the_old_one_stays)
{
  Room r = room_of("scenes/cornell.json", false, 4);
  CHECK(wait_for(&r, rf_live_show(r.live, &r.view), 0, true));
  const uint64_t cornell = picture_hash(&r.frame);
  rf_scene *other = rf_scene_load(r.engine, "scenes/furnace.json", NULL);
  CHECK(wait_for(&r, 0, rf_live_replace(r.live, other), true) && picture_hash(&r.frame) != cornell);
  // A picture that is not there fails in preparing.
  rf_scene *bad = rf_scene_create(r.engine);
  CHECK(rf_set(bad, "sky", "{\"kind\": \"image\", \"file\": \"nowhere.hdr\"}"));
  const uint64_t edit = rf_live_replace(r.live, bad);
  char message[400] = "";
  const double start = now(CLOCK_MONOTONIC);
  while (!rf_live_message(r.live, message, sizeof message) && now(CLOCK_MONOTONIC) - start < 60) usleep(1000);
  CHECK_TEXT(message, "nowhere.hdr");
  CHECK(edit && rf_live_undo(r.live) && !strcmp(r.view.render.integrator, "path"));
  // Several in a row: the last one counts.
  uint64_t last = 0;
  for (int i = 0; i < 5; i++)
    last = rf_live_replace(r.live, rf_scene_load(r.engine, i % 2 ? "scenes/furnace.json" : "scenes/cornell.json", NULL));
  CHECK(wait_for(&r, 0, last, true) && picture_hash(&r.frame) == cornell);
  room_finish(&r);
}

// A formula that makes no sense says where, and the picture goes on with the last one that did.
TEST(a_bad_formula_leaves_the_last_good_field)
{
  char path[100], message[400] = "";
  snprintf(path, sizeof path, "/tmp/rayfold-live-%d.json", (int)getpid());
  FILE *f = fopen(path, "w");
  CHECK(f && fputs("{\"rayfold\": 1, \"camera\": {\"position\": [0, 0, 3]}, \"sky\": {\"kind\": \"gradient\"}, \"objects\": [{\"shape\": {\"kind\": \"formula\","
                   "\"formula\": \"length(x, y, z) - 0.7\"}}]}", f) >= 0);
  if (f) fclose(f);
  Room r = room_of(path, false, 4);
  remove(path);
  CHECK(wait_for(&r, rf_live_show(r.live, &r.view), 0, true));
  const uint64_t ball = picture_hash(&r.frame);
  const double start = now(CLOCK_MONOTONIC);
  CHECK(rf_live_set(r.live, "objects[0].shape.formula", "\"length(x, y\"", false));
  while (!rf_live_message(r.live, message, sizeof message) && now(CLOCK_MONOTONIC) - start < 60) usleep(1000);
  CHECK_TEXT(message, "column");
  r.view.eye.frame.p.z = 2.5f;
  CHECK(wait_for(&r, rf_live_show(r.live, &r.view), 0, true) && picture_hash(&r.frame) != ball);
  r.view.eye.frame.p.z = 3;
  CHECK(wait_for(&r, rf_live_show(r.live, &r.view), 0, true) && picture_hash(&r.frame) == ball);
  const uint64_t edit = rf_live_set(r.live, "objects[0].shape.formula", "\"length(x, y, z) - 0.4\"", false);
  CHECK(wait_for(&r, 0, edit, true) && picture_hash(&r.frame) != ball);
  room_finish(&r);
}

TEST(it_sleeps_when_done_and_ends_at_once)
{
  Room r = room_of("scenes/cornell.json", false, 4);
  CHECK(wait_for(&r, rf_live_show(r.live, &r.view), 0, true));
  usleep(20000);
  const double cpu = now(CLOCK_PROCESS_CPUTIME_ID);
  usleep(300000);
  CHECK_MSG(now(CLOCK_PROCESS_CPUTIME_ID) - cpu < 0.003, "%.4f s of 0.3", now(CLOCK_PROCESS_CPUTIME_ID) - cpu);
  // In the middle of a pass that takes seconds.
  r.view.width = TEST_IS_SLOW ? 400 : 1600;
  r.view.height = TEST_IS_SLOW ? 300 : 1200;
  r.view.render.end_sample = 10000;
  CHECK(wait_for(&r, rf_live_show(r.live, &r.view), 0, false));
  usleep(200000);
  const double start = now(CLOCK_MONOTONIC);
  rf_live_destroy(r.live);
  CHECK_MSG(now(CLOCK_MONOTONIC) - start < (TEST_IS_SLOW ? 3 : 0.25), "%.3f s", now(CLOCK_MONOTONIC) - start);
  rf_engine_destroy(r.engine);
}

// Memory that is out for a larger window: a message, and the window as it was comes back whole.
TEST(a_window_too_large_leaves_the_one_before)
{
  Room r = room_of("scenes/cornell.json", true, 2);
  char message[400] = "";
  r.view.denoise = false;
  r.view.step = 4;
  for (long n = 1; n < 8; n++) {
    CHECK(rf_live_show(r.live, &r.view));
    while (rf_live_step(r.live)) rf_live_take(r.live, &r.frame);
    rf_live_view larger = r.view;
    larger.width += 3 * (int)n;
    CHECK(rf_live_show(r.live, &larger));
    mem_fail_after(n);
    rf_live_step(r.live);
    mem_fail_after(0);
    CHECK(n > 2 || rf_live_message(r.live, message, sizeof message));
    CHECK(rf_live_show(r.live, &r.view));
    while (rf_live_step(r.live)) rf_live_take(r.live, &r.frame);
    CHECK(r.frame.is_finished && r.frame.width == r.view.width && equals_offline(&r));
  }
  CHECK_TEXT(message, "memory");
  room_finish(&r);
}

static float highest(const rf_world *w)
{
  rf_vec3 lo = {0}, hi = {0};
  CHECK(w && rf_world_bounds(w, &lo, &hi));
  return hi.y;
}

// A scene that breaks off what an edit needs and then cannot be shown itself must not swallow the edit.
TEST(an_edit_outlives_a_bad_scene_after_it)
{
  Room r = room_of("scenes/cornell.json", false, 1);
  CHECK(wait_for(&r, rf_live_show(r.live, &r.view), 0, true));
  for (int i = 1; i <= 40; i++) {
    char json[20];
    snprintf(json, sizeof json, "%d", 10 * i);
    rf_scene *bad = rf_scene_create(r.engine);
    CHECK(rf_set(bad, "sky", "{\"kind\": \"image\", \"file\": \"nowhere.hdr\"}"));
    CHECK(rf_live_set(r.live, "objects[0].translate.1", json, false));
    usleep((unsigned)(20 * (i % 20)));
    CHECK(rf_live_replace(r.live, bad));
    rf_scene *s = rf_live_borrow(r.live, 60);
    rf_world *fresh = rf_prepare(s, NULL), *shown = rf_live_world(r.live);
    CHECK_MSG(highest(fresh) == highest(shown), "%g is shown, not %g", (double)highest(shown), (double)highest(fresh));
    rf_world_destroy(fresh);
    rf_world_destroy(shown);
    rf_live_return(r.live);
  }
  room_finish(&r);
}

// R7: destroyed at whatever moment of a large picture it is soon gone.
TEST(it_ends_soon_at_any_moment)
{
  double worst = 0;
  for (int i = 0; i < (TEST_IS_SLOW ? 3 : 12); i++) {
    Room r = room_of("scenes/showcase.json", false, 1000);
    r.view.width = 640;
    r.view.height = 360;
    CHECK(rf_live_show(r.live, &r.view));
    usleep((unsigned)(i * 9000));
    const double start = now(CLOCK_MONOTONIC);
    rf_live_destroy(r.live);
    const double took = now(CLOCK_MONOTONIC) - start;
    if (took > worst) worst = took;
    rf_engine_destroy(r.engine);
  }
  CHECK_MSG(worst < (TEST_IS_SLOW ? 3 : 0.25), "%.3f s", worst);
  printf("  destroyed within %.0f ms\n", 1e3 * worst);
}

TEST(nonsense_is_refused)
{
  Room r = room_of("scenes/cornell.json", true, 4);
  const char *text;
  rf_live_view v = r.view;
  v.width = 0;
  CHECK(!rf_live_show(r.live, &v) && rf_error(r.engine, &text) == RF_BAD_ARGUMENT);
  CHECK_TEXT(text, "size");
  v = r.view;
  v.step = 3;
  CHECK(!rf_live_show(r.live, &v) && rf_error(r.engine, NULL) == RF_BAD_ARGUMENT);
  v = r.view;
  v.eye.frame.p.x = NAN; // would never be the same as before, and so never finished
  CHECK(!rf_live_show(r.live, &v) && rf_error(r.engine, NULL) == RF_BAD_ARGUMENT);
  rf_live_return(r.live); // nothing was borrowed
  v = r.view;
  v.magic = 0;
  CHECK(!rf_live_show(r.live, &v) && rf_error(r.engine, NULL) == RF_BAD_ARGUMENT);
  v = r.view;
  v.render.integrator = "magic";
  CHECK(!rf_live_show(r.live, &v) && rf_error(r.engine, NULL) == RF_BAD_ARGUMENT);
  CHECK(!rf_live_set(r.live, NULL, "1", false) && !rf_live_replace(r.live, NULL) && !rf_live_world(NULL));
  CHECK(!rf_live_step(r.live)); // no view yet
  rf_live_destroy(NULL);
  room_finish(&r);
}

// Any other thread may ask for anything at any time.
typedef struct Asker {
  Room *room;
  uint32_t seed;
} Asker;

static void *ask(void *user)
{
  const Asker *a = user;
  rf_live_view v = a->room->view;
  for (uint32_t i = 0; i < (TEST_IS_SLOW ? 30 : 100); i++) {
    const uint32_t h = hash_u32(a->seed + i);
    char json[40];
    v.eye.frame.p.x += 0.01f * (float)(h % 7) - 0.03f;
    if (h % 11 == 0) v.width = 20 + (int)(h >> 8) % 80;
    if (h % 5 == 0) CHECK(rf_live_show(a->room->live, &v));
    snprintf(json, sizeof json, "%u", h % 1000);
    if (h % 3 == 0) CHECK(rf_live_set(a->room->live, "objects[0].translate.0", json, h % 2));
    if (h % 17 == 0) rf_live_undo(a->room->live);
    if (h % 19 == 0) rf_live_redo(a->room->live);
    if (h % 7 == 0) rf_world_destroy(rf_live_world(a->room->live));
    if (h % 13 == 0 && rf_live_borrow(a->room->live, 0.01)) rf_live_return(a->room->live);
    if (h % 4 == 0) usleep(h >> 8 & 1023);
  }
  return NULL;
}

TEST(many_ask_at_once)
{
  Room r = room_of("scenes/cornell.json", false, 8);
  Asker askers[3];
  pthread_t threads[3];
  char message[100];
  CHECK(rf_live_show(r.live, &r.view));
  for (uint32_t i = 0; i < 3; i++) {
    askers[i] = (Asker){&r, 1000 * i};
    CHECK(!pthread_create(&threads[i], NULL, ask, &askers[i]));
  }
  for (int i = 0; i < 50; i++, usleep(1000)) {
    rf_live_take(r.live, &r.frame);
    rf_live_message(r.live, message, sizeof message);
  }
  for (int i = 0; i < 3; i++) pthread_join(threads[i], NULL);
  r.view.denoise = false;
  const uint64_t edit = rf_live_set(r.live, "objects[0].translate.0", "1", false);
  CHECK(wait_for(&r, rf_live_show(r.live, &r.view), edit, true));
  CHECK(equals_offline(&r));
  room_finish(&r);
}

TEST_MAIN
