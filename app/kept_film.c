// See kept_film.h.

#include "kept_film.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

// --- which samples --------------------------------------------------------------------------------
static size_t samples_of(const rf_film *film, int (**pairs)[2])
{
  const size_t n = rf_film_samples(film, NULL, 0);
  *pairs = malloc((n + 1) * sizeof **pairs);
  return *pairs ? rf_film_samples(film, *pairs, n) : 0;
}

int film_sample_count(const rf_film *film)
{
  int(*pairs)[2], count = 0;
  const size_t n = samples_of(film, &pairs);
  for (size_t i = 0; pairs && i < n; i++) count += pairs[i][1] - pairs[i][0];
  free(pairs);
  return count;
}

// --- the file -------------------------------------------------------------------------------------
int note_scene_length(const char *note)
{
  return (int)strcspn(note, "\n");
}

static ExitCode make_note(KeptFilm *k, rf_engine *engine, rf_scene *scene, const char *scene_name)
{
  const char *develop = rf_get(scene, "develop");
  if (!develop) return fail_library(engine);
  const size_t size = strlen(scene_name) + strlen(develop) + 2;
  k->note = malloc(size);
  if (!k->note) return fail(EXIT_INTERNAL, "not enough memory for the film's note");
  snprintf(k->note, size, "%s\n%s", scene_name, develop);
  return EXIT_DONE;
}

// Two renders on one film would each write over what the other added. The lock is on a file of its own, since the film
// is replaced at each writing; it may have been removed by a render that ended between open and lock.
static ExitCode lock(KeptFilm *k)
{
  char path[4096];
  struct stat ours, named;
  if (snprintf(path, sizeof path, "%s.lock", k->path) >= (int)sizeof path)
    return fail(EXIT_USAGE, "--film: the name is too long");
  for (;;) {
    const int fd = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (fd < 0) return fail(EXIT_NO_OUTPUT, "cannot write %s: %s", path, strerror(errno));
    if (flock(fd, LOCK_EX | LOCK_NB)) {
      const int why = errno;
      close(fd);
      if (why != EWOULDBLOCK) return EXIT_DONE; // a file system without locks
      return fail(EXIT_NO_OUTPUT,
                  "--film %s: another render is at work on it; name another file, and merge them afterwards",
                  k->path);
    }
    if (!fstat(fd, &ours) && !stat(path, &named) && ours.st_ino == named.st_ino) {
      k->lock = fd;
      return EXIT_DONE;
    }
    close(fd);
  }
}

static ExitCode check_same(const KeptFilm *k, const rf_film *film, const rf_film_label *label,
                           unsigned planes)
{
  if (label->key != k->key)
    return fail(EXIT_USAGE,
                "--film %s: it holds another picture, of %.*s or with other settings; name another file, or "
                "delete it",
                k->path, note_scene_length(label->note), label->note);
  const unsigned lacking = planes & ~rf_film_planes(film);
  if (lacking)
    return fail(EXIT_USAGE,
                "--film %s: it was begun without all the AOVs that are wanted now; ask for fewer with --aov, "
                "or delete it",
                k->path);
  return EXIT_DONE;
}

static ExitCode go_on(const KeptFilm *k, rf_film **film, rf_engine *engine, unsigned planes, bool is_quiet)
{
  rf_film_label label;
  *film = rf_film_open(engine, k->path, &label);
  if (!*film) return fail_library(engine);
  if (label.is_older && !is_quiet)
    say_note("%s is damaged; going on from %s~, the one before", k->path, k->path);
  const ExitCode code = check_same(k, *film, &label, planes);
  rf_free(label.note);
  if (!code && !is_quiet) say("going on from %d samples a pixel in %s", film_sample_count(*film), k->path);
  return code;
}

ExitCode kept_film_open(KeptFilm *k, rf_film **film, rf_engine *engine, rf_scene *scene,
                        const rf_world *world, const rf_eye *eye, const char *scene_name, unsigned planes,
                        bool is_quiet)
{
  int width, height;
  rf_scene_render_def(scene, &width, &height);
  ExitCode code = lock(k);
  if (!code) code = make_note(k, engine, scene, scene_name);
  if (code) return code;
  k->key = rf_picture_key(scene, world, eye);
  if (!k->key) return fail_library(engine);
  if (access(k->path, F_OK) == 0) return go_on(k, film, engine, planes, is_quiet);
  *film = rf_film_create(engine, width, height, planes);
  return *film ? EXIT_DONE : fail_library(engine);
}

ExitCode kept_film_write(const KeptFilm *k, rf_engine *engine, const rf_film *film)
{
  return rf_film_keep(film, k->path, k->key, k->note) ? EXIT_DONE : fail_library(engine);
}

void kept_film_finish(KeptFilm *k)
{
  char path[4096];
  free(k->note);
  if (k->lock) {
    snprintf(path, sizeof path, "%s.lock", k->path);
    unlink(path);
    close(k->lock);
  }
  *k = (KeptFilm){0};
}
