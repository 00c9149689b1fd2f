// The window, by SDL. The only file that knows SDL. Frames go up as a streaming texture of the window's own pixels, so
// that on a dense display nothing is enlarged.

#if RAYFOLD_HAVE_SDL

#include "view_screen.h"

#include <SDL2/SDL.h>

struct Screen {
  SDL_Window *window;
  SDL_Renderer *renderer;
  SDL_Texture *texture;
  int width, height; // of the texture
  SDL_GameController *pad;
  Uint32 wake_event;
  bool is_full;
};

static void sdl_close(Screen *s)
{
  if (s->pad) SDL_GameControllerClose(s->pad);
  if (s->texture) SDL_DestroyTexture(s->texture);
  if (s->renderer) SDL_DestroyRenderer(s->renderer);
  if (s->window) SDL_DestroyWindow(s->window);
  SDL_Quit();
  SDL_free(s);
}

static void open_pad(Screen *s)
{
  for (int i = 0; i < SDL_NumJoysticks() && !s->pad; i++)
    if (SDL_IsGameController(i)) s->pad = SDL_GameControllerOpen(i);
}

static bool open_window(Screen *s, const char *title, int width, int height)
{
  SDL_SetHint(SDL_HINT_RENDER_SCALE_QUALITY, "0"); // pixels go one to one
  // Pictures come from the processor, so SDL's plain way to the screen does. Opening OpenGL for it takes 0.35 s of
  // processor time under Xvfb against 0.07 s without; SDL_RENDER_DRIVER=opengl asks for it, with the display's beat.
  const bool is_plain = !SDL_getenv("SDL_RENDER_DRIVER");
  if (is_plain) SDL_SetHint(SDL_HINT_FRAMEBUFFER_ACCELERATION, "0");
  s->window = SDL_CreateWindow(title, SDL_WINDOWPOS_CENTERED, SDL_WINDOWPOS_CENTERED, width, height,
                               SDL_WINDOW_RESIZABLE | SDL_WINDOW_ALLOW_HIGHDPI);
  if (!s->window) return false;
  SDL_SetWindowMinimumSize(s->window, 160, 120);
  if (!is_plain) s->renderer = SDL_CreateRenderer(s->window, -1, SDL_RENDERER_PRESENTVSYNC);
  if (!s->renderer) s->renderer = SDL_CreateRenderer(s->window, -1, SDL_RENDERER_SOFTWARE);
  if (!s->renderer) return false;
  SDL_SetRenderDrawColor(s->renderer, 20, 21, 24, 255);
  SDL_RenderClear(s->renderer);
  SDL_RenderPresent(s->renderer);
  s->wake_event = SDL_RegisterEvents(1);
  return true;
}

static Screen *sdl_open(const char *title, int width, int height, char error[200])
{
  SDL_SetHint(SDL_HINT_NO_SIGNAL_HANDLERS, "1");
  SDL_SetHint(SDL_HINT_MOUSE_FOCUS_CLICKTHROUGH, "1");
  Screen *s = SDL_calloc(1, sizeof *s);
  const bool ok = s && SDL_Init(SDL_INIT_VIDEO) == 0 && open_window(s, title, width, height);
  if (ok) return s;
  snprintf(error, 200, "%s", SDL_GetError());
  if (s) sdl_close(s);
  return NULL;
}

static void sdl_size(Screen *s, int *width, int *height, float *scale)
{
  int points, ignored;
  SDL_GetRendererOutputSize(s->renderer, width, height);
  SDL_GetWindowSize(s->window, &points, &ignored);
  *scale = points > 0 ? (float)*width / (float)points : 1;
}

// --- events ---------------------------------------------------------------------------------------
static int key_of(SDL_Keycode k)
{
  if (k >= SDLK_F1 && k <= SDLK_F12) return KEY_F1 + (int)(k - SDLK_F1);
  switch (k) {
  case SDLK_ESCAPE: return KEY_ESCAPE;
  case SDLK_TAB: return KEY_TAB;
  case SDLK_KP_ENTER:
  case SDLK_RETURN: return KEY_ENTER;
  case SDLK_LEFT: return KEY_LEFT;
  case SDLK_RIGHT: return KEY_RIGHT;
  case SDLK_UP: return KEY_UP;
  case SDLK_DOWN: return KEY_DOWN;
  case SDLK_LSHIFT:
  case SDLK_RSHIFT: return KEY_SHIFT;
  case SDLK_LCTRL:
  case SDLK_RCTRL: return KEY_CTRL;
  case SDLK_LALT:
  case SDLK_RALT: return KEY_ALT;
  default: return k > 31 && k < 127 ? (int)k : 0;
  }
}

static unsigned mods_now(void)
{
  const SDL_Keymod m = SDL_GetModState();
  return (m & KMOD_SHIFT ? MOD_SHIFT : 0u) | (m & KMOD_CTRL ? MOD_CTRL : 0u) | (m & KMOD_ALT ? MOD_ALT : 0u);
}

static int button_of(int b)
{
  return b == SDL_BUTTON_LEFT ? BUTTON_LEFT : b == SDL_BUTTON_MIDDLE ? BUTTON_MIDDLE : BUTTON_RIGHT;
}

// False for what nobody here wants to know.
static bool translate(Screen *s, const SDL_Event *e, Event *out)
{
  int width, height;
  float scale;
  sdl_size(s, &width, &height, &scale);
  *out = (Event){.mods = mods_now()};
  if (e->type == s->wake_event) return out->kind = EVENT_WAKE, true;
  switch (e->type) {
  case SDL_QUIT: out->kind = EVENT_QUIT; return true;
  case SDL_KEYDOWN:
  case SDL_KEYUP:
    out->kind = e->type == SDL_KEYDOWN ? EVENT_KEY : EVENT_KEY_UP;
    out->key = key_of(e->key.keysym.sym);
    return out->key && !e->key.repeat;
  case SDL_MOUSEBUTTONDOWN:
  case SDL_MOUSEBUTTONUP:
    out->kind = e->type == SDL_MOUSEBUTTONDOWN ? EVENT_PRESS : EVENT_RELEASE;
    out->button = button_of(e->button.button);
    out->x = (int)((float)e->button.x * scale);
    out->y = (int)((float)e->button.y * scale);
    return true;
  case SDL_MOUSEMOTION: {
    static float x, y; // in relative mode SDL tells distances only
    if (SDL_GetRelativeMouseMode()) {
      x += (float)e->motion.xrel * scale;
      y += (float)e->motion.yrel * scale;
    } else {
      x = (float)e->motion.x * scale;
      y = (float)e->motion.y * scale;
    }
    out->kind = EVENT_MOVE;
    out->x = (int)x;
    out->y = (int)y;
    return true;
  }
  case SDL_MOUSEWHEEL:
    out->kind = EVENT_WHEEL;
    out->wheel = e->wheel.preciseY;
    return true;
  case SDL_WINDOWEVENT:
    if (e->window.event == SDL_WINDOWEVENT_SIZE_CHANGED || e->window.event == SDL_WINDOWEVENT_EXPOSED) {
      out->kind = EVENT_RESIZE;
      out->x = width;
      out->y = height;
      return true;
    }
    return false;
  case SDL_DROPFILE:
    out->kind = EVENT_DROP;
    snprintf(out->path, sizeof out->path, "%s", e->drop.file);
    SDL_free(e->drop.file);
    return true;
  case SDL_CONTROLLERDEVICEADDED: open_pad(s); return false;
  case SDL_CONTROLLERDEVICEREMOVED:
    if (s->pad && !SDL_GameControllerGetAttached(s->pad)) {
      SDL_GameControllerClose(s->pad);
      s->pad = NULL;
    }
    return false;
  default: return false;
  }
}

static bool sdl_next(Screen *s, double seconds, Event *out)
{
  SDL_Event e;
  if (!SDL_WasInit(SDL_INIT_GAMECONTROLLER)) SDL_InitSubSystem(SDL_INIT_GAMECONTROLLER); // while the scene loads
  while (seconds > 0 ? SDL_WaitEventTimeout(&e, 1 + (int)(seconds * 1000)) : SDL_PollEvent(&e)) {
    if (translate(s, &e, out)) return true;
    seconds = 0;
  }
  return false;
}

static void sdl_wake(Screen *s)
{
  SDL_Event e = {.type = s->wake_event};
  SDL_PushEvent(&e);
}

// --- pictures -------------------------------------------------------------------------------------
static void sdl_show(Screen *s, const uint32_t *pixels, int width, int height)
{
  if (!s->texture || s->width != width || s->height != height) {
    if (s->texture) SDL_DestroyTexture(s->texture);
    s->texture = SDL_CreateTexture(s->renderer, SDL_PIXELFORMAT_ARGB8888, SDL_TEXTUREACCESS_STREAMING, width, height);
    s->width = width;
    s->height = height;
  }
  if (!s->texture) return;
  SDL_UpdateTexture(s->texture, NULL, pixels, width * 4);
  SDL_RenderCopy(s->renderer, s->texture, NULL, NULL);
  SDL_RenderPresent(s->renderer);
}

static bool sdl_grab(Screen *s, uint32_t *pixels, int width, int height)
{
  if (!s->texture) return false;
  SDL_RenderCopy(s->renderer, s->texture, NULL, NULL); // what was presented is not ours any more
  return SDL_RenderReadPixels(s->renderer, &(SDL_Rect){0, 0, width, height}, SDL_PIXELFORMAT_ARGB8888, pixels,
                              width * 4) == 0;
}

static void sdl_capture(Screen *s, bool on)
{
  (void)s;
  SDL_SetRelativeMouseMode(on ? SDL_TRUE : SDL_FALSE);
}

static void sdl_full(Screen *s)
{
  s->is_full = !s->is_full;
  SDL_SetWindowFullscreen(s->window, s->is_full ? SDL_WINDOW_FULLSCREEN_DESKTOP : 0);
}

static void sdl_title(Screen *s, const char *title) { SDL_SetWindowTitle(s->window, title); }

static void sdl_pad(Screen *s, float axes[PAD_AXES])
{
  static const SDL_GameControllerAxis which[PAD_AXES] = {
      SDL_CONTROLLER_AXIS_LEFTX,  SDL_CONTROLLER_AXIS_LEFTY,       SDL_CONTROLLER_AXIS_RIGHTX,
      SDL_CONTROLLER_AXIS_RIGHTY, SDL_CONTROLLER_AXIS_TRIGGERLEFT, SDL_CONTROLLER_AXIS_TRIGGERRIGHT};
  for (int i = 0; i < PAD_AXES; i++) {
    const float a = s->pad ? (float)SDL_GameControllerGetAxis(s->pad, which[i]) / 32767 : 0;
    axes[i] = a > 0.15f || a < -0.15f ? a : 0; // sticks at rest are not quite at 0
  }
}

const ScreenKind screen_sdl = {"sdl",    sdl_open,    sdl_close, sdl_size,  sdl_next, sdl_wake,
                               sdl_show, sdl_grab, sdl_capture, sdl_full, sdl_title, sdl_pad};

#else
typedef int view_screen_sdl_is_not_in_this_build; // C wants something in every file
#endif
