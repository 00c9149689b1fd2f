// See frames.h.

#include "frames.h"

#include "output.h"
#include "pictures.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static ExitCode fail_form(const char *text)
{
  return fail(EXIT_USAGE, "--frames %s: it is A:B or A:B:STEP, whole numbers with A < B and STEP at least 1, or all", text);
}

static bool read_part(const char **at, long *out)
{
  char number[24];
  const size_t n = strcspn(*at, ":");
  if (n >= sizeof number) return false;
  memcpy(number, *at, n);
  number[n] = 0;
  *at += n + ((*at)[n] == ':');
  return read_integer(number, out) && labs(*out) < 100000000;
}

ExitCode frames_read(const Args *a, Frames *out, bool *is_all)
{
  const char *text = args_text(a, "frames"), *at = text;
  *out = (Frames){.is_wanted = text || pictures_have(a, picture_is_video), .step = 1, .at = args_real(a, "at", 0)};
  *is_all = out->is_wanted && (!text || !strcmp(text, "all"));
  if (!out->is_wanted || *is_all) return EXIT_DONE;
  const bool has_step = strchr(text, ':') != strrchr(text, ':');
  if (!strchr(text, ':') || !read_part(&at, &out->first) || !read_part(&at, &out->end) ||
      (has_step && !read_part(&at, &out->step)) || *at || out->end <= out->first || out->step < 1)
    return fail_form(text);
  return EXIT_DONE;
}

void frames_take_all(Frames *f, double start, double end, double fps)
{
  // Moments are floats: what is nearly a whole frame is meant to be one.
  f->first = (long)ceil(start * fps - 1e-3);
  f->end = (long)ceil(end * fps - 1e-3);
  if (f->end <= f->first) f->end = f->first + 1;
}

long frames_count(const Frames *f)
{
  return f->is_wanted ? (f->end - f->first + f->step - 1) / f->step : 1;
}

void frame_name(char out[PATH_MAX], const char *output, long frame)
{
  if (frame == FRAME_NONE || picture_is_hash(output) || picture_is_video(output)) {
    snprintf(out, PATH_MAX, "%s", output);
    return;
  }
  const char *slash = strrchr(output, '/'), *mark = strchr(slash ? slash : output, '#');
  const char *extension = output_extension(output);
  const char *begin = mark ? mark : *extension ? extension : output + strlen(output);
  const char *rest = mark ? mark + strspn(mark, "#") : begin;
  snprintf(out, PATH_MAX, "%.*s%s%0*ld%s", (int)(begin - output), output, mark ? "" : "_", mark ? (int)(rest - mark) : 4,
           frame, rest);
}
