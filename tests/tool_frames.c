// How long do frames of moving scenes take, and how far are pictures by blocks from whole ones? Not a test: a tool to run
// by hand, or by bench/realtime.sh.
//
//   tool_frames [-t THREADS] [-i ISA] [-s WxH] [-b BLOCK] [-n FRAMES] [-r REPEATS] [-k STEP]
//               [-o BLOCKS.ppm] SCENE.json...
//
// -k: pixels so many times as wide, 1, 2, 4 or 8, which go without blocks. -o: also the view of blocks of the last scene's first frame.
//
// Each scene moves for three times FRAMES sixtieths of a second, from 0, 10 and 20 s on: the intro's two as they do there
// (by the names of their objects), others under an eye that goes around. One line a scene:
//
//   frames,SCENE,SIZE,THREADS,ISA,FULL ms,BLOCKS ms,FULL user ms,BLOCKS user ms,TRACED %,MEAN dB,WORST dB,FLICKERING ppm
//
// Times are the least of REPEATS for each frame, then the mean over frames: on the clock and of all threads together.
// dB: against the whole picture, 8 bits. Flickering: pixels of which what is wrong changes by more than 16/255 in a
// channel from one frame to the next, of a million.

#include "rayfold/rayfold.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

typedef struct Options {
  int threads, width, height, block, frames, repeats, step;
  const char *isa, *blocks;
} Options;

typedef struct Bench {
  rf_engine *engine;
  rf_scene *scene;
  rf_live *live[2]; // whole, by blocks
  rf_live_view view;
  rf_eye eye;       // of the scene's camera
  const char *path;
} Bench;

static void die(const char *what)
{
  const char *text = "";
  rf_error(NULL, &text);
  fprintf(stderr, "tool_frames: %s %s\n", what, text);
  exit(70);
}

static double user(void)
{
  struct rusage r;
  getrusage(RUSAGE_SELF, &r);
  return (double)r.ru_utime.tv_sec + 1e-6 * (double)r.ru_utime.tv_usec;
}

// --- motion ---------------------------------------------------------------------------------------
static void set(rf_live *l, const char *path, double x, double y, double z)
{
  char json[128];
  snprintf(json, sizeof json, "[%.9g, %.9g, %.9g]", x, y, z);
  if (!rf_live_set(l, path, json, false)) die(path);
}

static void move_intro1(rf_live *l, double t)
{
  const double up = 0.25 * fabs(sin(1.3 * t));
  set(l, "objects.ball.translate", 0, 1.78 + up, 0);
  set(l, "objects[3].translate", 0, 3.14 + up + 0.1 * sin(0.7 * t), 0);
  set(l, "objects[4].translate", 1.9 * cos(0.8 * t), 2.35, 1.9 * sin(0.8 * t));
  set(l, "objects[5].translate", -1.9 * cos(0.7 * t), 1.1, 1.9 * sin(0.7 * t));
}

static void move_intro2(rf_live *l, double t)
{
  set(l, "objects[2].translate", -0.72 + 0.3 * sin(1.1 * t), 1.05 + 0.2 * sin(0.9 * t), 0.2 * cos(t));
  set(l, "objects[3].translate", 0.3 + 0.2 * cos(0.8 * t), 1.5 + 0.25 * sin(1.2 * t), 0.15);
  set(l, "objects[4].translate", 0.82 + 0.25 * sin(0.7 * t), 0.85 + 0.1 * cos(t), -0.1);
  set(l, "objects[5].rotate", 10 * sin(t), 40 * t, 14);
  set(l, "objects[6].rotate", 10, 40 * t, -14 + 8 * sin(t));
}

static double dot(rf_vec3 a, rf_vec3 b) { return (double)(a.x * b.x + a.y * b.y + a.z * b.z); }

static rf_vec3 turned(rf_vec3 v, double angle)
{
  const float s = (float)sin(angle), c = (float)cos(angle);
  return (rf_vec3){c * v.x + s * v.z, v.y, c * v.z - s * v.x};
}

// Around the upright axis through the place where the camera looks at the ground, or the world's.
static rf_eye eye_at(const rf_eye *e, double angle)
{
  rf_eye out = *e;
  out.frame.x = turned(e->frame.x, angle);
  out.frame.y = turned(e->frame.y, angle);
  out.frame.z = turned(e->frame.z, angle);
  out.frame.p = turned(e->frame.p, angle);
  return dot(out.frame.x, out.frame.x) > 0 ? out : *e;
}

static void pose(Bench *b, int which, double t)
{
  double angle = 0.15 * t;
  if (strstr(b->path, "intro1")) {
    move_intro1(b->live[which], t);
    angle = 0;
  } else if (strstr(b->path, "intro2")) {
    move_intro2(b->live[which], t);
    angle = 0.2 * sin(0.3 * t);
  }
  b->view.eye = eye_at(&b->eye, angle);
}

// --- frames -----------------------------------------------------------------------------------------
typedef struct Frame {
  rf_live_frame frame;
  double wall, user;
} Frame;

// The same frame REPEATS times: the first makes the world, each of the others is a change of nothing but the seed, which
// whitted does not look at without a filter's width.
static Frame frame_of(Bench *b, const Options *o, int which, double t)
{
  Frame f = {.wall = 1e9, .user = 1e9};
  pose(b, which, t);
  b->view.step = o->step;
  b->view.blocks = which ? o->block : 0;
  for (int i = 0; i <= o->repeats; i++) {
    b->view.eye.focus = 1 + (float)i; // of a pinhole: changes nothing but is a change
    if (!rf_live_show(b->live[which], &b->view)) die("show");
    const double from_user = user();
    if (!rf_live_step(b->live[which]) || !rf_live_take(b->live[which], &f.frame)) die("step");
    const double took = f.frame.render_seconds + f.frame.show_seconds;
    if (i > 0) f.wall = fmin(f.wall, took);
    if (i > 0) f.user = fmin(f.user, user() - from_user);
  }
  return f;
}

typedef struct Sums {
  double wall[2], user[2], traced, db, worst;
  long flickering, pairs;
  int frames;
} Sums;

static int channel(uint32_t p, int c) { return (int)(p >> (8 * c) & 0xff); }

static double psnr(const uint32_t *a, const uint32_t *b, size_t n)
{
  double sum = 0;
  for (size_t i = 0; i < n; i++)
    for (int c = 0; c < 3; c++) {
      const int d = channel(a[i], c) - channel(b[i], c);
      sum += d * d;
    }
  return sum > 0 ? fmin(10 * log10(255.0 * 255 * 3 * (double)n / sum), 99) : 99;
}

static long flicker(const uint32_t *a, const uint32_t *b, int8_t *error, size_t n, int is_first)
{
  long count = 0;
  for (size_t i = 0; i < n; i++) {
    int most = 0;
    for (int c = 0; c < 3; c++) {
      int d = channel(b[i], c) - channel(a[i], c);
      d = d > 127 ? 127 : d < -127 ? -127 : d;
      const int change = abs(d - error[3 * i + c]);
      most = change > most ? change : most;
      error[3 * i + c] = (int8_t)d;
    }
    count += most > 16;
  }
  return is_first ? 0 : count;
}

static Bench open_scene(const Options *o, const char *path)
{
  Bench b = {.view = rf_default_live_view(), .path = path};
  rf_engine_def def = rf_default_engine_def();
  def.threads = o->threads;
  def.isa = o->isa;
  if (!(b.engine = rf_engine_create(&def))) die("engine");
  for (int i = 0; i < 2; i++) {
    rf_live_def live = rf_default_live_def();
    live.stepped = true;
    rf_scene *s = rf_scene_load(b.engine, path, NULL);
    if (!s || !rf_camera(s, NULL, NULL, (float)o->width / (float)o->height, &b.eye)) die(path);
    b.view.render = rf_scene_render_def(s, NULL, NULL);
    b.view.render.integrator = "whitted";
    b.view.develop = rf_scene_develop_def(s);
    if (!(b.live[i] = rf_live_create(s, &live))) die(path);
  }
  b.view.render.first_sample = 0;
  b.view.render.end_sample = 1;
  b.view.width = o->width;
  b.view.height = o->height;
  return b;
}

static void save_blocks(Bench *b, const char *path)
{
  rf_live_frame f;
  pose(b, 1, 0);
  b->view.show_blocks = true;
  FILE *out = fopen(path, "wb");
  if (!rf_live_show(b->live[1], &b->view) || !rf_live_step(b->live[1]) || !rf_live_take(b->live[1], &f) || !out) die(path);
  b->view.show_blocks = false;
  fprintf(out, "P6\n%d %d\n255\n", f.width, f.height);
  for (size_t i = 0; i < (size_t)f.width * (size_t)f.height; i++)
    for (int c = 2; c >= 0; c--) fputc(channel(f.pixels[i], c), out);
  fclose(out);
}

static void run(const Options *o, const char *path)
{
  Bench b = open_scene(o, path);
  const size_t pixels = (size_t)o->width * (size_t)o->height;
  int8_t *error = malloc(3 * pixels);
  uint32_t *whole = malloc(4 * pixels);
  if (!error || !whole) die("memory");
  memset(error, 0, 3 * pixels);
  Sums s = {.worst = 99};
  for (int part = 0; part < 3; part++)
    for (int i = 0; i < o->frames; i++, s.frames++) {
      const double t = 10.0 * part + i / 60.0;
      const Frame full = frame_of(&b, o, 0, t);
      memcpy(whole, full.frame.pixels, 4 * pixels);
      const Frame some = frame_of(&b, o, 1, t);
      const double db = psnr(whole, some.frame.pixels, pixels);
      s.flickering += flicker(whole, some.frame.pixels, error, pixels, i == 0);
      s.pairs += i > 0;
      s.wall[0] += full.wall;
      s.wall[1] += some.wall;
      s.user[0] += full.user;
      s.user[1] += some.user;
      s.traced += some.frame.traced;
      s.db += db;
      s.worst = fmin(s.worst, db);
    }
  const double per = 1e3 / s.frames;
  printf("frames,%s,%dx%d,%d,%s,%.2f,%.2f,%.2f,%.2f,%.1f,%.1f,%.1f,%.2f\n", path, o->width, o->height, o->threads,
         rf_engine_isa(b.engine), s.wall[0] * per, s.wall[1] * per, s.user[0] * per, s.user[1] * per, 100 * s.traced / s.frames,
         s.db / s.frames, s.worst, s.pairs ? 1e6 * (double)s.flickering / (double)s.pairs / (double)pixels : 0);
  fflush(stdout);
  if (o->blocks) save_blocks(&b, o->blocks);
  free(error);
  free(whole);
  rf_live_destroy(b.live[0]);
  rf_live_destroy(b.live[1]);
  rf_engine_destroy(b.engine);
}

int main(int argc, char **argv)
{
  Options o = {.threads = 2, .width = 800, .height = 600, .block = 8, .frames = 32, .repeats = 3, .step = 1, .isa = "auto"};
  for (int c; (c = getopt(argc, argv, "t:i:s:b:n:r:o:k:")) != -1;) {
    switch (c) {
    case 't': o.threads = atoi(optarg); break;
    case 'i': o.isa = optarg; break;
    case 'k': o.step = atoi(optarg); break;
    case 'o': o.blocks = optarg; break;
    case 'b': o.block = atoi(optarg); break;
    case 'n': o.frames = atoi(optarg); break;
    case 'r': o.repeats = atoi(optarg); break;
    case 's':
      if (sscanf(optarg, "%dx%d", &o.width, &o.height) != 2) return 64;
      break;
    default: return 64;
    }
  }
  if (optind == argc) return 64;
  for (int i = optind; i < argc; i++) run(&o, argv[i]);
  return 0;
}
