// See video.h. ffmpeg runs in a process group of its own, so that Ctrl-C reaches us alone and the order in which things
// end stays ours. What it says goes into a temporary file without a name; its last words are told when it fails.

#include "video.h"

#include "output.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

enum { CODE_NO_PROGRAM = 127 };

struct Video {
  const char *path;
  char temp[PATH_MAX + 5]; // "file:" and a path, for without it a dash or colon in the name would tell ffmpeg something
  pid_t child; // 0: it has ended
  int pipe;    // to its standard input; -1: closed
  FILE *words; // what it says
  uint8_t *row;
  int width, height;
};

// --- the program ----------------------------------------------------------------------------------
// Colours as every player takes them: BT.709 with half the chroma, which needs even sides; a GIF's own 256 of all its
// frames. Constant quality: 16 of x264 shows no loss in grain, 24 of VP9 likewise.
static void fill_arguments(const Video *v, const char *size, const char *rate, const char *arguments[48])
{
  static const char *const h264[] = {"-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2,format=yuv420p", "-c:v", "libx264", "-crf", "16",
                                     "-preset", "medium", "-movflags", "+faststart", NULL};
  static const char *const vp9[] = {"-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2,format=yuv420p", "-c:v", "libvpx-vp9",
                                    "-crf", "24", "-b:v", "0", "-row-mt", "1", NULL};
  static const char *const gif[] = {"-filter_complex",
                                    "split[a][b];[a]palettegen=stats_mode=diff[p];[b][p]paletteuse=dither=bayer:bayer_scale=4:diff_mode=rectangle",
                                    "-loop", "0", NULL};
  static const struct {
    const char *extensions, *format;
    const char *const *options;
  } kinds[] = {{".webm", "webm", vp9}, {".gif", "gif", gif}, {".mkv", "matroska", h264}, {".mov", "mov", h264}, {".mp4", "mp4", h264}};
  const char *const head[] = {"ffmpeg", "-hide_banner", "-nostdin", "-loglevel", "error", "-y", "-f", "rawvideo",
                              "-pix_fmt", "rgb24", "-video_size", size, "-framerate", rate, "-i", "pipe:0", "-an"};
  size_t n = 0, kind = 0;
  for (size_t i = 0; i < sizeof head / sizeof *head; i++) arguments[n++] = head[i];
  while (!output_is_any(v->path, kinds[kind].extensions)) kind++;
  for (size_t i = 0; kinds[kind].options[i]; i++) arguments[n++] = kinds[kind].options[i];
  const char *const tail[] = {"-f", kinds[kind].format, v->temp, NULL};
  for (size_t i = 0; i < sizeof tail / sizeof *tail; i++) arguments[n++] = tail[i];
}

static void run_child(const Video *v, int input, const char *const *arguments)
{
  setpgid(0, 0);
  dup2(input, STDIN_FILENO);
  dup2(fileno(v->words), STDOUT_FILENO);
  dup2(fileno(v->words), STDERR_FILENO);
  signal(SIGPIPE, SIG_DFL);
  signal(SIGXFSZ, SIG_DFL);
  // execvp() takes pointers to writable texts for history's sake and writes to none.
  execvp("ffmpeg", (char *const *)(uintptr_t)arguments);
  _exit(errno == ENOENT ? CODE_NO_PROGRAM : 126);
}

static ExitCode start(Video *v, double fps)
{
  char size[40], rate[40];
  const char *arguments[48];
  int ends[2];
  snprintf(size, sizeof size, "%dx%d", v->width, v->height);
  snprintf(rate, sizeof rate, "%.6f", fps);
  fill_arguments(v, size, rate, arguments);
  v->words = tmpfile();
  if (!v->words || pipe2(ends, O_CLOEXEC)) return fail(EXIT_INTERNAL, "cannot start ffmpeg: %s", strerror(errno));
  v->child = fork();
  if (v->child == 0) run_child(v, ends[0], arguments);
  close(ends[0]);
  v->pipe = ends[1];
  if (v->child > 0) return EXIT_DONE;
  v->child = 0;
  return fail(EXIT_INTERNAL, "cannot start ffmpeg: %s", strerror(errno));
}

// --- how it went ----------------------------------------------------------------------------------
static ExitCode fail_with_last_words(Video *v, int status)
{
  char words[400] = "";
  if (WIFEXITED(status) && WEXITSTATUS(status) == CODE_NO_PROGRAM)
    return fail(EXIT_NO_OUTPUT,
                "%s: films are made by the program ffmpeg, which is not there; install it (Debian: apt install ffmpeg), "
                "or write numbered pictures, as -o film_####.png",
                v->path);
  fseek(v->words, 0, SEEK_END);
  const long length = ftell(v->words), most = (long)sizeof words - 1;
  fseek(v->words, length > most ? length - most : 0, SEEK_SET);
  size_t n = fread(words, 1, sizeof words - 1, v->words);
  while (n && strchr("\r\n ", words[n - 1])) n--;
  words[n] = 0;
  for (size_t i = 0; i < n; i++)
    if ((unsigned char)words[i] < ' ') words[i] = words[i] == '\n' ? ';' : ' ';
  return fail(EXIT_NO_OUTPUT, "cannot write %s: ffmpeg failed%s%s", v->path, n ? ": " : "", words);
}

// Closes the pipe, which is the end of the film to ffmpeg, and waits for it.
static ExitCode settle(Video *v)
{
  int status = 0;
  if (v->pipe >= 0) close(v->pipe);
  v->pipe = -1;
  if (!v->child) return EXIT_INTERNAL;
  while (waitpid(v->child, &status, 0) < 0 && errno == EINTR) continue;
  v->child = 0;
  return WIFEXITED(status) && !WEXITSTATUS(status) ? EXIT_DONE : fail_with_last_words(v, status);
}

// --- the pictures ---------------------------------------------------------------------------------
// The sRGB curve of IEC 61966-2-1. Cold: a frame takes far longer to render.
static uint8_t encode(float x)
{
  const double y = x <= 0 ? 0 : x >= 1 ? 1 : (double)x <= 0.0031308 ? 12.92 * (double)x : 1.055 * pow((double)x, 1 / 2.4) - 0.055;
  return (uint8_t)(y * 255 + 0.5);
}

static bool write_all(int fd, const uint8_t *data, size_t size)
{
  while (size) {
    const ssize_t n = write(fd, data, size);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    data += n;
    size -= (size_t)n;
  }
  return true;
}

ExitCode video_add(Video *v, const rf_image *picture)
{
  if (picture->width != v->width || picture->height != v->height)
    return fail(EXIT_BAD_SCENE, "%s: all pictures of a film have one size; render.size must not move", v->path);
  for (int y = 0; y < v->height; y++) {
    const float *p = picture->pixels + (size_t)y * (size_t)v->width * (size_t)picture->channels;
    for (int x = 0; x < v->width; x++, p += picture->channels)
      for (int c = 0; c < 3; c++) v->row[3 * x + c] = encode(p[c]);
    if (write_all(v->pipe, v->row, 3 * (size_t)v->width)) continue;
    // It has ended before its time and can tell why.
    const ExitCode code = settle(v);
    return code ? code : fail(EXIT_NO_OUTPUT, "cannot write %s: ffmpeg ended before the film did", v->path);
  }
  return EXIT_DONE;
}

// --- from beginning to end ------------------------------------------------------------------------
ExitCode video_begin(Video **out, const char *path, int width, int height, double fps)
{
  Video *v = *out = calloc(1, sizeof *v);
  if (!v) return fail(EXIT_INTERNAL, "not enough memory for a film");
  *v = (Video){.path = path, .pipe = -1, .width = width, .height = height};
  v->row = malloc(3 * (size_t)width);
  const int n = snprintf(v->temp, sizeof v->temp, "file:%s.%ld.part", path, (long)getpid());
  ExitCode code = !v->row ? fail(EXIT_INTERNAL, "not enough memory for a film")
                  : n < 0 || (size_t)n >= sizeof v->temp ? fail(EXIT_NO_OUTPUT, "%s: the name is too long", path)
                                                         : start(v, fps);
  if (code) {
    video_drop(v);
    *out = NULL;
  }
  return code;
}

static const char *temp_path(const Video *v) { return v->temp + 5; }

static bool sync_file(const char *path)
{
  const int fd = open(path, O_RDONLY | O_CLOEXEC);
  const bool ok = fd >= 0 && !fsync(fd);
  if (fd >= 0) close(fd);
  return ok;
}

ExitCode video_finish(Video *v)
{
  ExitCode code = settle(v);
  if (!code && (!sync_file(temp_path(v)) || rename(temp_path(v), v->path)))
    code = fail(EXIT_NO_OUTPUT, "cannot write %s: %s", v->path, strerror(errno));
  video_drop(v);
  return code;
}

void video_drop(Video *v)
{
  if (!v) return;
  if (v->child) {
    kill(v->child, SIGKILL);
    while (waitpid(v->child, NULL, 0) < 0 && errno == EINTR) continue;
  }
  if (v->pipe >= 0) close(v->pipe);
  if (v->words) fclose(v->words);
  if (*v->temp) unlink(temp_path(v));
  free(v->row);
  free(v);
}
