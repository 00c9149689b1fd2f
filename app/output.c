// See output.h.

#include "output.h"

#include "options.h"

#include <errno.h>
#include <fcntl.h>
#include <libgen.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

void stdio_guard(void)
{
  // open() gives the lowest free number, so each gap is filled by its own descriptor. Reading from where one must
  // write, and the other way round, fails with EBADF, which is what the caller of a closed stdout should see.
  for (int fd = 0; fd <= 2; fd++)
    if (fcntl(fd, F_GETFD) < 0 && open("/dev/null", fd == 0 ? O_WRONLY : O_RDONLY) < 0) _exit(EXIT_INTERNAL);
}

ExitCode stdout_finish(const char *what)
{
  if (!fflush(stdout) && !ferror(stdout)) return EXIT_DONE;
  return fail(EXIT_NO_OUTPUT, "cannot write %s to the standard output: %s", what,
              errno ? strerror(errno) : "it is closed");
}

ExitCode stdout_library_text(rf_engine *engine, char *text, const char *what)
{
  if (!text) return fail_library(engine);
  const size_t n = strlen(text);
  fwrite(text, 1, n, stdout);
  if (n && text[n - 1] != '\n') putchar('\n');
  rf_free(text);
  return stdout_finish(what);
}

ExitCode output_check(const char *path)
{
  char folder[PATH_MAX];
  struct stat st;
  if (strlen(path) >= sizeof folder) return fail(EXIT_NO_OUTPUT, "%s: the name is too long", path);
  if (!stat(path, &st) && !S_ISREG(st.st_mode))
    return fail(EXIT_NO_OUTPUT, "%s is not a file that could be written over; choose another name", path);
  memcpy(folder, path, strlen(path) + 1);
  const char *name = dirname(folder);
  if (stat(name, &st) && errno == ENOENT)
    return fail(EXIT_NO_OUTPUT, "%s: there is no folder %s; create it first", path, name);
  if (stat(name, &st)) return fail(EXIT_NO_OUTPUT, "%s: the folder %s: %s", path, name, strerror(errno));
  if (!S_ISDIR(st.st_mode)) return fail(EXIT_NO_OUTPUT, "%s: %s is not a folder", path, name);
  if (access(name, W_OK | X_OK))
    return fail(EXIT_NO_OUTPUT, "%s: the folder %s: %s", path, name, strerror(errno));
  return EXIT_DONE;
}

bool output_exists(const char *path)
{
  struct stat st;
  return !stat(path, &st) && S_ISREG(st.st_mode) && st.st_size > 0;
}

static bool write_all(int fd, const char *text, size_t size)
{
  while (size) {
    const ssize_t n = write(fd, text, size);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    text += n;
    size -= (size_t)n;
  }
  return true;
}

ExitCode output_write(const char *path, const char *text, size_t size)
{
  char temp[PATH_MAX];
  const int n = snprintf(temp, sizeof temp, "%s.%ld.part", path, (long)getpid());
  if (n < 0 || (size_t)n >= sizeof temp) return fail(EXIT_NO_OUTPUT, "%s: the name is too long", path);
  const int fd = open(temp, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (fd < 0) return fail(EXIT_NO_OUTPUT, "cannot write %s: %s", path, strerror(errno));
  bool ok = write_all(fd, text, size) && !fsync(fd);
  ok = !close(fd) && ok;
  if (ok && !rename(temp, path)) return EXIT_DONE;
  const int reason = errno;
  unlink(temp);
  return fail(EXIT_NO_OUTPUT, "cannot write %s: %s", path, strerror(reason));
}

const char *output_extension(const char *path)
{
  const char *slash = strrchr(path, '/');
  const char *base = slash ? slash + 1 : path, *dot = strrchr(base, '.');
  return dot && dot != base ? dot : "";
}

bool output_is_any(const char *path, const char *extensions)
{
  char name[40];
  while (next_choice(&extensions, name))
    if (!strcasecmp(output_extension(path), name)) return true;
  return false;
}
