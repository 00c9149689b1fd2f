// `rayfold view`: a window into a scene. The window opens before the scene is read; then every turn takes what the user
// did, moves the eye, asks the live picture for the view (rf_live_show) and shows its newest frame with the figures on
// top. When nothing moves and the picture is finished, it waits for events and takes no processor time.

#include "view.h"

#include "commands.h"
#include "library.h"
#include "output.h"

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define TURN_SECONDS 0.008 // between two turns while something moves: half a frame at 60 Hz, so that none is missed
#define IDLE_SECONDS 0.5   // the longest sleep: the scene's file may have changed

static const Option view_options[] = {
    {.name = "size", .kind = OPTION_TEXT, .argument = "WxH", .initial = "1280x720", .sentence = "Of the window, in points."},
    {.name = "camera", .kind = OPTION_TEXT, .argument = "NAME", .initial = "the main one",
     .sentence = "Which of the scene's cameras to begin at."},
    {.name = "integrator", .kind = OPTION_TEXT, .argument = "NAME", .initial = "as the scene says", .path = "render.integrator",
     .sentence = "path, classic or whitted, or a view of the scene: normal, depth, albedo, uv, id, bary, cost."},
    {.name = "spp", .kind = OPTION_INTEGER, .argument = "N", .initial = "as the scene says", .path = "render.spp",
     .sentence = "Samples a pixel at which a still picture is finished."},
    {.name = "frame-time", .kind = OPTION_REAL, .argument = "MS", .initial = "16", .low = 1, .high = 1000,
     .sentence = "Milliseconds a frame may take while something moves; the resolution follows from it."},
    {.name = "step", .kind = OPTION_INTEGER, .argument = "N", .initial = "by --frame-time; 4 with --script", .low = 1, .high = 8,
     .sentence = "Width of a rendered pixel while something moves: 1, 2, 4 or 8."},
    {.name = "blocks", .kind = OPTION_CHOICE, .argument = "N", .initial = "8", .choices = "0|4|8|16",
     .sentence = "Side of the blocks of which whitted fills in the middle while something moves; 0: none. B shows them."},
    {.name = "no-denoise", .kind = OPTION_FLAG, .sentence = "Show the samples as they are; N switches it in the window."},
    {.name = "no-hud", .kind = OPTION_FLAG, .sentence = "Begin without figures; Tab brings them back."},
    {.name = "font", .kind = OPTION_FILE, .argument = "FILE", .initial = "DejaVu Sans or the like",
     .sentence = "A TrueType font for the figures."},
    {.name = "threads", .kind = OPTION_INTEGER, .argument = "N", .initial = "all this process may use", .high = 256,
     .sentence = "Threads to work with."},
    {.name = "isa", .kind = OPTION_CHOICE, .argument = "LEVEL", .initial = "auto", .choices = "auto|ref|v2|v3|v4",
     .sentence = "Instruction set to use."},
    {.name = "set", .kind = OPTION_TEXT, .argument = "PATH=VALUE", .repeats = true,
     .sentence = "Change a field of the scene, as materials.gold.roughness=0.3."},
    {.name = "script", .kind = OPTION_FILE, .argument = "FILE",
     .sentence = "Take keys and mouse from FILE instead of a person; see below."},
    {.name = "game", .kind = OPTION_FLAG,
     .sentence = "Play Parallax Locks: SCENE is a folder of chambers, as scenes/locks, begun at the first that is not solved yet."},
    {.name = "progress", .kind = OPTION_FILE, .argument = "FILE", .initial = "rayfold/locks in XDG_STATE_HOME or ~/.local/state",
     .sentence = "Where it is kept which chambers are solved."},
    {.name = "stats", .kind = OPTION_FLAG,
     .sentence = "On leaving, print a line: seconds to the first picture, frames a second and share of pixels rendered while "
                 "something moved, and processor seconds."},
    {.name = "dummy", .kind = OPTION_FLAG, .sentence = "No window: for scripts where there is no display."},
    OPTION_ALLOW_OUTSIDE,
    OPTION_CACHE,
    {0},
};

// --- notes ----------------------------------------------------------------------------------------
void note_say(View *v, bool is_bad, const char *format, ...)
{
  va_list args;
  va_start(args, format);
  vsnprintf(v->note.text, sizeof v->note.text, format, args);
  va_end(args);
  v->note.is_bad = is_bad;
  v->note.until = v->clock + (is_bad ? 8 : 2.5);
  v->is_dirty = true;
}

void note_library(View *v)
{
  const char *text;
  if (rf_error(v->engine, &text) != RF_OK) note_say(v, true, "%s", text);
}

// --- one turn -------------------------------------------------------------------------------------
static void take_frame(View *v)
{
  const uint64_t edit = v->frame.edit;
  if (!v->live || !rf_live_take(v->live, &v->frame)) return;
  v->is_dirty = true;
  const double took = v->clock - v->last_frame;
  if (v->frame.is_moving && took > 0 && took < 0.5) {
    v->moving_frames++;
    v->moving_seconds += took;
    v->moving_pixels += (double)v->frame.render_width * v->frame.render_height / ((double)v->frame.width * v->frame.height);
  }
  if (took > 0 && took < 0.5) v->frames_a_second += 0.15 * (1 / took - v->frames_a_second);
  v->last_frame = v->clock;
  if (v->frame.edit == edit && v->world) return;
  rf_world_destroy(v->world); // rays should meet what is seen
  v->world = NULL;
  if (v->frame.edit != edit) pick_refresh(v);
}

static void ask(View *v)
{
  if (!v->live || (!v->is_asked && v->wanted.width == v->width && v->wanted.height == v->height)) return;
  v->wanted.eye = walker_eye(&v->walker);
  v->wanted.width = v->width;
  v->wanted.height = v->height;
  if (!rf_live_show(v->live, &v->wanted)) note_library(v);
  v->is_asked = false;
}

void view_turn(View *v, double seconds)
{
  const Wish wish = input_wish(v);
  if (v->game ? game_turn(v, &wish, seconds) : walker_move(&v->walker, &wish, seconds, view_world(v))) v->is_asked = true;
  ask(v);
}

static bool make_canvas(View *v)
{
  int width = v->width, height = v->height;
  if (!v->script) v->kind->size(v->screen, &width, &height, &v->scale);
  if (v->pixels && v->canvas_width == width && v->canvas_height == height) return true;
  uint32_t *pixels = realloc(v->pixels, (size_t)width * (size_t)height * sizeof *pixels);
  if (!pixels) return false;
  v->pixels = pixels;
  v->width = v->canvas_width = width;
  v->height = v->canvas_height = height;
  return true;
}

// The newest frame in the middle, whatever the window's size is by now.
static void lay_frame(View *v)
{
  const rf_live_frame *f = &v->frame;
  if (f->number && f->width == v->width && f->height == v->height) {
    memcpy(v->pixels, f->pixels, (size_t)v->width * (size_t)v->height * sizeof *v->pixels);
    return;
  }
  for (int y = 0; y < v->height; y++) // being resized: the last one, stretched
    for (int x = 0; x < v->width; x++)
      v->pixels[(size_t)y * (size_t)v->width + (size_t)x] =
          f->number ? f->pixels[(size_t)((long)y * f->height / v->height) * (size_t)f->width + (size_t)((long)x * f->width / v->width)]
                    : 0xff141518u;
}

void view_show(View *v)
{
  take_frame(v);
  if (v->note.until > 0 && v->clock >= v->note.until) {
    v->note.until = 0;
    v->is_dirty = true;
  }
  if (v->caption.until > 0 && v->clock >= v->caption.until) {
    v->caption.until = 0;
    v->is_dirty = true;
  }
  if (!v->is_dirty || !make_canvas(v)) return;
  lay_frame(v);
  hud_draw(v);
  v->kind->show(v->screen, v->pixels, v->width, v->height);
  v->is_dirty = false;
  if (v->first_picture <= 0 && v->frame.number) v->first_picture = seconds_now();
}

// --- a person's turns -----------------------------------------------------------------------------
static bool is_held(const View *v)
{
  static const int keys[] = {'w', 'a', 's', 'd', 'q', 'e', KEY_LEFT, KEY_RIGHT, KEY_UP, KEY_DOWN};
  for (size_t i = 0; i < sizeof keys / sizeof *keys; i++)
    if (v->down[keys[i]]) return true;
  return false;
}

static double time_to_wait(View *v)
{
  float pad[PAD_AXES];
  v->kind->pad(v->screen, pad);
  for (int i = 0; i < PAD_AXES; i++)
    if (pad[i] != 0) return TURN_SECONDS;
  if (is_held(v) || v->walker.stop_count || (v->walker.on_foot && !v->walker.stands)) return TURN_SECONDS;
  if (v->walker.on_foot || v->shot.is_running || v->game) return 0.05;
  double wait = IDLE_SECONDS;
  const double ends[2] = {v->note.until - v->clock, v->caption.until - v->clock};
  for (int i = 0; i < 2; i++)
    if (ends[i] > 0 && ends[i] < wait) wait = ends[i] + 0.001;
  return wait;
}

static void messages(View *v)
{
  char text[600];
  if (v->live && rf_live_message(v->live, text, sizeof text)) note_say(v, true, "%s", text);
}

static void run_person(View *v)
{
  double last = seconds_now();
  while (!v->is_over && !v->code) {
    Event e;
    double wait = v->is_dirty || (v->is_asked && v->live) ? 0 : time_to_wait(v);
    while (v->kind->next(v->screen, wait, &e)) {
      input_event(v, &e);
      wait = 0;
    }
    v->clock = seconds_now();
    view_check_file(v);
    shot_step(v);
    view_turn(v, v->clock - last);
    last = v->clock;
    messages(v);
    view_show(v);
  }
}

static void run_script(View *v)
{
  while (!v->is_over && !v->code) {
    script_step(v);
    messages(v);
  }
}

// --- coming and going -----------------------------------------------------------------------------
static ExitCode read_size(View *v)
{
  const char *text = args_text(v->args, "size");
  char *end;
  v->width = 1280;
  v->height = 720;
  if (!text) return EXIT_DONE;
  const long w = strtol(text, &end, 10), h = *end == 'x' ? strtol(end + 1, &end, 10) : 0;
  if (*end || w < 16 || h < 16 || w > 8192 || h > 8192)
    return fail(EXIT_USAGE, "--size %s: it is WxH, each 16 to 8192, as in 1280x720", text);
  v->width = (int)w;
  v->height = (int)h;
  return EXIT_DONE;
}

static ExitCode open_screen(View *v)
{
  char error[200] = "";
  v->kind = &screen_dummy;
  if (!args_has(v->args, "dummy")) {
#if RAYFOLD_HAVE_SDL
    v->kind = &screen_sdl;
#else
    return fail(EXIT_USAGE, "this build has no window: install libsdl2-dev and build again, or use --dummy with --script");
#endif
  } else if (!v->script) {
    return fail(EXIT_USAGE, "--dummy shows nothing to anybody; it goes with --script FILE");
  }
  v->screen = v->kind->open("Rayfold", v->width, v->height, error);
  return v->screen ? EXIT_DONE : fail(EXIT_NO_OUTPUT, "cannot open a window: %s; is there a display?", error);
}

static void begin(View *v)
{
  const long step = args_integer(v->args, "step", v->script ? 4 : 0);
  v->wanted = rf_default_live_view();
  v->wanted.frame_seconds = args_real(v->args, "frame-time", 16) * 1e-3;
  v->wanted.step = (int)(step == 3 ? 4 : step > 4 ? 8 : step);
  v->wanted.blocks = args_has(v->args, "blocks") ? atoi(args_text(v->args, "blocks")) : 8;
  v->wanted.denoise = !args_has(v->args, "no-denoise");
  v->shows_hud = !args_has(v->args, "no-hud") && !args_has(v->args, "game") && !output_is_any(v->args->operands[0], ".locks");
  v->picked.dragged = -1;
  v->scale = 1;
  v->is_dirty = true;
  v->font = font_open(args_text(v->args, "font"));
  if (!v->font) say_note("no font found, so no text in the window; install fonts-dejavu-core or give --font FILE");
  v->clock = v->script ? 0 : seconds_now();
}

static void print_stats(const View *v)
{
  if (!args_has(v->args, "stats")) return;
  printf("first %.3f fps %.1f pixels %.3f cpu %.2f\n", v->first_picture > 0 ? v->first_picture - v->begun : 0,
         v->moving_seconds > 0 ? (double)v->moving_frames / v->moving_seconds : 0,
         v->moving_frames ? v->moving_pixels / (double)v->moving_frames : 0, (double)clock() / CLOCKS_PER_SEC);
}

static ExitCode run_view(const Args *args)
{
  const double begun = seconds_now();
  View *v = calloc(1, sizeof *v);
  if (!v) return fail(EXIT_INTERNAL, "not enough memory");
  v->args = args;
  v->begun = begun;
  v->brush = (Brush){.size = 3, .color = {0.6f, 0.1f, 0.05f}, .randomness = 0.1f};
  pthread_mutex_init(&v->loader.mutex, NULL);
  pthread_mutex_init(&v->shot.mutex, NULL);
  v->code = read_size(v);
  if (!v->code && args_has(args, "script")) v->script = script_open(args_text(args, "script"), &v->code);
  if (!v->code) v->code = open_screen(v);
  if (!v->code) v->code = engine_open(&v->engine, (int)args_integer(args, "threads", 0), args_text(args, "isa"));
  if (!v->code) {
    begin(v);
    if (args_has(args, "game") || output_is_any(args->operands[0], ".locks"))
      v->code = game_open(v, args->operands[0]);
    else
      view_open(v, args->operands[0]);
    if (v->script)
      run_script(v);
    else
      run_person(v);
    print_stats(v);
  }
  if (v->engine) view_close_file(v);
  shot_finish(v);
  rf_live_destroy(v->live);
  rf_world_destroy(v->world);
  rf_engine_destroy(v->engine);
  game_close(v);
  if (v->screen) v->kind->close(v->screen);
  font_close(v->font);
  script_finish(v->script);
  list_finish(v);
  free(v->pixels);
  const ExitCode code = v->code ? v->code : stdout_finish("the figures");
  free(v);
  return code;
}

const Command command_view = {
    .name = "view",
    .sentence = "Open a window into a scene or model, or the first of a folder: fly or walk through it, pick objects and change them. F1 shows the keys.",
    .operands = "SCENE",
    .least = 1,
    .most = 1,
    .operand_kind = OPERAND_FILE,
    .usage = "[OPTION]...",
    .text = "A script (--script) is a file of commands, one a line; what follows # is a remark, and a word in single quotes "
            "may hold spaces. Each frame takes a sixtieth of a second of the script's own clock, so its pictures are the same "
            "every time.\n"
            "frame N: go on N frames. settle: until the picture is finished. key K, down K, up K: a key, as w, f1, ctrl+z, "
            "space. mouse X Y; press B, release B: left, middle or right. wheel N. resize W H. drop FILE. save FILE: what "
            "is shown, as a picture. hash: prints that of what is shown. copy FROM TO: a file over another. quit.\n"
            "expect picked NAME, value PATH JSON, note TEXT, proof TEXT, caption TEXT, open N (locks), view NAME, samples N, size W H, file PATH, eye X Y Z NEAR: "
            "ends with code 65 and a message where it is otherwise.",
    .example = "rayfold view scenes/showcase.json",
    .options = view_options,
    .run = run_view,
};
