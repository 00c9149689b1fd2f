// See progress.h.

#include "progress.h"

#include <langinfo.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

static bool is_set(const char *variable)
{
  const char *value = getenv(variable);
  return value && *value;
}

Progress progress_begin(bool is_quiet)
{
  Progress p = {.manner = PROGRESS_LINES};
  const char *terminal = getenv("TERM");
  if (isatty(STDERR_FILENO) && terminal && strcmp(terminal, "dumb")) p.manner = PROGRESS_BAR;
  if (is_quiet) p.manner = PROGRESS_NONE;
  p.has_blocks = !strcmp(nl_langinfo(CODESET), "UTF-8");
  p.has_colour = !is_set("NO_COLOR"); // no-color.org: present and not empty
  return p;
}

static int terminal_width(void)
{
  struct winsize size;
  if (!ioctl(STDERR_FILENO, TIOCGWINSZ, &size) && size.ws_col > 0) return size.ws_col;
  const char *columns = getenv("COLUMNS");
  const long n = columns ? strtol(columns, NULL, 10) : 0;
  return n > 0 && n < 10000 ? (int)n : 80;
}

void progress_clear(Progress *p)
{
  if (p->is_drawn) fputs("\r\033[K", stderr);
  p->is_drawn = false;
}

void progress_stage(Progress *p, const char *what, const char *name)
{
  if (p->manner != PROGRESS_BAR) return;
  progress_clear(p);
  const int room = terminal_width() - 3 - (int)strlen(what);
  if (room > 0) fprintf(stderr, "%s %.*s ", what, room, name);
  p->is_drawn = true;
}

// A bar `cells` wide; the blocks show eighths of a cell.
static void draw_bar(const Progress *p, double done, int cells)
{
  static const char *const eighths[] = {"", "▏", "▎", "▍", "▌", "▋", "▊", "▉"};
  const int filled = (int)(done * cells * 8);
  if (p->has_colour) fputs("\033[36m", stderr);
  for (int i = 0; i < cells; i++) {
    const int part = filled - 8 * i;
    if (!p->has_blocks)
      fputc(part >= 8 ? '#' : '.', stderr);
    else
      fputs(part >= 8 ? "█" : part > 0 ? eighths[part] : " ", stderr);
  }
  if (p->has_colour) fputs("\033[0m", stderr);
}

static void print_time(char out[24], double seconds)
{
  const long s = seconds < 359999 ? (long)(seconds + 0.5) : 359999; // 99:59:59
  if (s < 3600)
    snprintf(out, 24, "%ld:%02ld", s / 60, s % 60);
  else
    snprintf(out, 24, "%ld:%02ld:%02ld", s / 3600, s / 60 % 60, s % 60);
}

// The words behind the bar, most wanted first: what does not fit is left out.
static int print_words(const Progress *p, char *out, size_t size, int room, const rf_progress *now,
                       double samples_wanted)
{
  char words[6][48] = {{0}}, eta[24];
  snprintf(words[0], sizeof words[0], " %3.0f%%", floor(now->done * 100));
  if (p->label[0]) snprintf(words[5], sizeof words[5], "  %s", p->label);
  print_time(eta, now->eta);
  if (isfinite(now->eta)) snprintf(words[1], sizeof words[1], "  ETA %s", eta);
  if (samples_wanted > 0)
    snprintf(words[2], sizeof words[2], "  %.0f/%.0f spp", floor(now->samples), samples_wanted);
  else
    snprintf(words[2], sizeof words[2], "  %.0f spp", floor(now->samples));
  if (now->noise > 0) {
    const int n = snprintf(words[3], sizeof words[3], "  noise %.2g%%", now->noise * 100);
    if (now->quiet > 0) snprintf(words[3] + n, sizeof words[3] - (size_t)n, "  tiles %.0f%%", floor(now->quiet * 100));
  }
  if (now->seconds > 0)
    snprintf(words[4], sizeof words[4], "  %.1f Mrays/s", (double)now->rays / now->seconds / 1e6);
  int n = 0;
  out[0] = 0;
  for (int i = 0; i < 6; i++) {
    const int length = (int)strlen(words[i]);
    if (n + length > room || (size_t)(n + length) >= size) break;
    memcpy(out + n, words[i], (size_t)length + 1);
    n += length;
  }
  return n;
}

static void show_bar(Progress *p, const rf_progress *now, double samples_wanted)
{
  enum { SHORTEST = 8, LONGEST = 32 };
  char words[200];
  const int room = terminal_width() - 1; // the last column would wrap on some terminals
  const int length = print_words(p, words, sizeof words, room, now, samples_wanted);
  const int cells = room - length < LONGEST ? room - length : LONGEST;
  fputc('\r', stderr);
  if (cells >= SHORTEST) draw_bar(p, now->done, cells);
  fprintf(stderr, "%s\033[K", words);
  fflush(stderr);
  p->is_drawn = true;
}

void progress_show(Progress *p, const rf_progress *now, double samples_wanted)
{
  if (p->manner == PROGRESS_BAR) show_bar(p, now, samples_wanted);
  if (p->manner != PROGRESS_LINES || now->seconds < p->next_line) return;
  fprintf(stderr, "progress %.2f eta %.0f\n", now->done, isfinite(now->eta) ? ceil(now->eta) : 0.0);
  p->next_line = floor(now->seconds) + 1;
}
