// See file.h.

#include "base/file.h"

#include "base/mem.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

static bool read_all(int fd, FileBytes *out, size_t size, const char *path, Err *err)
{
  uint8_t *data = mem_alloc(size + 1, 1);
  if (!data) return err_memory(err, path, size);
  size_t got = 0;
  while (got < size) {
    const ssize_t n = read(fd, data + got, size - got);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) {
      err_set(err, ERR_NOT_FOUND, "cannot read \"%s\": %s", path, strerror(errno));
      mem_free(data);
      return false;
    }
    if (n == 0) break;
    got += (size_t)n;
  }
  data[got] = 0;
  *out = (FileBytes){.data = data, .size = got, .map = data};
  return true;
}

bool file_read(FileBytes *out, const char *path, Err *err)
{
  enum { MAP_FROM = 1 << 16 };
  *out = (FileBytes){0};
  // O_NONBLOCK: opening a named pipe must not wait for a writer that never comes.
  const int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (fd < 0)
    return err_set(err, ERR_NOT_FOUND, "cannot open \"%s\": %s", path,
                   errno == ENOENT ? "there is no such file; check the name and the folder" : strerror(errno));
  bool ok = false;
  struct stat st;
  if (fstat(fd, &st)) {
    err_set(err, ERR_NOT_FOUND, "cannot read \"%s\": %s", path, strerror(errno));
  } else if (S_ISDIR(st.st_mode)) {
    err_set(err, ERR_NOT_FOUND, "\"%s\" is a folder; name a file in it", path);
  } else if (!S_ISREG(st.st_mode)) {
    err_set(err, ERR_NOT_FOUND, "\"%s\" is not a regular file; save the data to a file first", path);
  } else {
    const size_t size = (size_t)st.st_size, page = (size_t)sysconf(_SC_PAGESIZE);
    // A mapping whose last page is full has no zero byte after it, so such files are read.
    if (size >= MAP_FROM && size % page) {
      void *map = mmap(NULL, size, PROT_READ, MAP_PRIVATE, fd, 0);
      if (map != MAP_FAILED) {
        // A hint: what is not in memory yet comes in pages of 2 MB. A file of 80 MB is read in 20 to 60 ms instead of
        // 140 then, and opened again in 7 ms of CPU time instead of 42.
        (void)madvise(map, size, MADV_HUGEPAGE);
        *out = (FileBytes){.data = map, .size = size, .map = map, .map_size = size};
        ok = true;
      }
    }
    ok = ok || read_all(fd, out, size, path, err);
  }
  close(fd);
  return ok;
}

void file_release(FileBytes *f)
{
  if (f->map_size) munmap(f->map, f->map_size);
  else mem_free(f->map);
  *f = (FileBytes){0};
}

SharedFile *shared_file_open(const char *path, Err *err)
{
  const size_t n = strlen(path) + 1;
  SharedFile *f = mem_zero(1, sizeof *f);
  if (f) {
    atomic_init(&f->users, 1);
    f->path = mem_alloc(n, 1);
  }
  if (!f || !f->path) {
    err_memory(err, path, sizeof *f + n);
    goto failed;
  }
  memcpy(f->path, path, n);
  if (file_read(&f->bytes, path, err)) return f;
failed:
  shared_file_release(f);
  return NULL;
}

SharedFile *shared_file_share(SharedFile *f)
{
  if (f) atomic_fetch_add_explicit(&f->users, 1, memory_order_relaxed);
  return f;
}

void shared_file_release(SharedFile *f)
{
  // Acquire-release: nobody may still be reading when the last user takes the bytes away.
  if (!f || atomic_fetch_sub_explicit(&f->users, 1, memory_order_acq_rel) != 1) return;
  file_release(&f->bytes);
  mem_free(f->path);
  mem_free(f);
}

static bool write_error(Err *err, const char *path, int why)
{
  return err_set(err, ERR_IO, "cannot write \"%s\": %s%s", path, strerror(why),
                 why == ENOSPC   ? "; free some space or write to another disk"
                 : why == EACCES ? "; choose a folder you may write to"
                 : why == ENOENT ? "; create the folder first"
                                 : "");
}

#define TEMP_END ".rfpart"
enum { TEMP_RANDOM = 7 }; // ".XXXXXX"

static bool is_temp_of(const char *name, const char *target)
{
  const size_t n = strlen(target), size = n + TEMP_RANDOM + strlen(TEMP_END);
  return strlen(name) == size && !strncmp(name, target, n) && name[n] == '.' && !strcmp(name + n + TEMP_RANDOM, TEMP_END);
}

// What killed writers of this file left behind. A living writer's is locked.
static void remove_orphans(const char *target)
{
  Text folder = {0};
  path_folder(&folder, target);
  DIR *list = opendir(text_get(&folder));
  for (const struct dirent *e = list ? readdir(list) : NULL; e; e = readdir(list)) {
    if (!is_temp_of(e->d_name, path_base(target))) continue;
    const int fd = openat(dirfd(list), e->d_name, O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOFOLLOW);
    if (fd < 0) continue;
    if (!flock(fd, LOCK_EX | LOCK_NB)) (void)unlinkat(dirfd(list), e->d_name, 0);
    close(fd);
  }
  if (list) closedir(list);
  text_finish(&folder);
}

// Makes f->temp and holds its lock. Between making and locking another writer may have taken it for an orphan: once
// more, then. A file system without locks has no orphans removed either.
static int make_temp(FileOut *f, size_t size)
{
  for (;;) {
    struct stat st;
    snprintf(f->temp, size, "%s.XXXXXX" TEMP_END, f->path);
    const int fd = mkostemps(f->temp, (int)strlen(TEMP_END), O_CLOEXEC);
    if (fd < 0) return fd;
    if (flock(fd, LOCK_EX) || (!fstat(fd, &st) && st.st_nlink)) {
      f->lock = fcntl(fd, F_DUPFD_CLOEXEC, 3);
      return fd;
    }
    close(fd);
  }
}

bool file_begin(FileOut *f, const char *path, Err *err)
{
  *f = (FileOut){0};
  struct stat st;
  if (!stat(path, &st) && !S_ISREG(st.st_mode))
    return err_set(err, ERR_IO, "cannot write \"%s\": it is %s, not a file", path,
                   S_ISDIR(st.st_mode) ? "a folder" : "a device or pipe");
  // A symbolic link is followed: the file it points to is replaced, the link stays.
  char real[PATH_MAX];
  const char *target = realpath(path, real) ? real : path;
  const size_t n = strlen(target) + 1;
  f->path = mem_alloc(n, 1);
  f->temp = mem_alloc(n + 16, 1); // ".XXXXXX.rfpart"
  int fd = -1;
  if (!f->path || !f->temp) {
    err_memory(err, path, 2 * n);
    goto failed;
  }
  memcpy(f->path, target, n);
  remove_orphans(target);
  fd = make_temp(f, n + 16);
  if (fd < 0) {
    write_error(err, path, errno);
    mem_free(f->temp);
    f->temp = NULL; // nothing to remove
    goto failed;
  }
  // As open() would have made it, or as the file that it takes the place of.
  struct stat old;
  const mode_t mask = umask(0);
  umask(mask);
  (void)fchmod(fd, !stat(target, &old) && S_ISREG(old.st_mode) ? old.st_mode & 0777 : 0666 & ~mask);
  f->stream = fdopen(fd, "w+b");
  if (!f->stream) {
    write_error(err, path, errno);
    close(fd);
    goto failed;
  }
  return true;
failed:
  file_finish(f);
  return false;
}

bool file_write(FileOut *f, const void *data, size_t size, Err *err)
{
  if (!size) return true; // data may be NULL
  return fwrite(data, 1, size, f->stream) == size || write_error(err, f->path, errno);
}

// The rename is only durable once the folder is, too.
static void sync_folder(const char *path)
{
  Text folder = {0};
  path_folder(&folder, path);
  const int fd = open(text_get(&folder), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd >= 0) {
    (void)fsync(fd);
    close(fd);
  }
  text_finish(&folder);
}

bool file_settle(FileOut *f, Err *err)
{
  errno = 0;
  bool ok = !ferror(f->stream) && !fflush(f->stream) && !fsync(fileno(f->stream));
  const int why = errno ? errno : EIO;
  if (fclose(f->stream)) ok = false;
  f->stream = NULL;
  return ok || write_error(err, f->path, why);
}

bool file_commit(FileOut *f, Err *err)
{
  if (f->stream && !file_settle(f, err)) return false;
  if (rename(f->temp, f->path)) return write_error(err, f->path, errno);
  mem_free(f->temp);
  f->temp = NULL;
  sync_folder(f->path);
  return true;
}

void file_finish(FileOut *f)
{
  if (f->stream) fclose(f->stream);
  if (f->temp) unlink(f->temp);
  if (f->lock > 0) close(f->lock);
  mem_free(f->path);
  mem_free(f->temp);
  *f = (FileOut){0};
}

bool file_write_whole(const char *path, const void *data, size_t size, Err *err)
{
  FileOut f;
  const bool ok = file_begin(&f, path, err) && file_write(&f, data, size, err) && file_commit(&f, err);
  file_finish(&f);
  return ok;
}

void path_folder(Text *out, const char *path)
{
  text_clear(out);
  const size_t n = (size_t)(path_base(path) - path);
  if (n == 0) text_add(out, ".");
  else if (n == 1) text_add(out, "/");
  else text_add_n(out, path, n - 1);
}

static bool is_inside(const char *root, const char *path)
{
  char real_root[PATH_MAX], real_path[PATH_MAX];
  if (!realpath(root, real_root)) return false;
  if (!realpath(path, real_path)) return true; // a missing file is reported as missing by whoever opens it
  const size_t n = strlen(real_root);
  return !strcmp(real_root, "/") || (!strncmp(real_root, real_path, n) && (real_path[n] == '/' || !real_path[n]));
}

// Whether a name climbs out by itself; needed for files that do not exist, where realpath() says nothing.
static bool climbs_out(const char *name)
{
  int depth = 0;
  for (const char *p = name; *p;) {
    const size_t n = strcspn(p, "/");
    if (n == 2 && !memcmp(p, "..", 2)) depth--;
    else if (n && !(n == 1 && *p == '.')) depth++;
    if (depth < 0) return true;
    p += n + (p[n] == '/');
  }
  return false;
}

bool path_resolve(Text *out, const char *owner_path, const char *name, const char *root, bool allow_outside,
                  Err *err)
{
  text_clear(out);
  Text folder = {0}, clean = {0};
  path_folder(&folder, owner_path);
  text_add(&clean, "%s", name);
  for (char *p = clean.data; p && *p; p++)
    if (*p == '\\') *p = '/';
  const char *file = text_get(&clean), *root_folder = root ? root : text_get(&folder);
  if (file[0] == '/' || text_equal(text_get(&folder), ".")) text_add(out, "%s", file);
  else text_add(out, "%s/%s", text_get(&folder), file);
  bool ok = true;
  if (!file[0]) {
    ok = err_set(err, ERR_BAD_SCENE, "a file name is empty");
  } else if (out->failed || folder.failed || clean.failed || out->length >= PATH_MAX) {
    ok = err_set(err, ERR_BAD_SCENE, "a file name is too long (%zu bytes)", strlen(name));
  } else if (!allow_outside) {
    struct stat st;
    const bool exists = !stat(text_get(out), &st);
    const bool inside = exists ? is_inside(root_folder, text_get(out)) : file[0] != '/' && (root || !climbs_out(file));
    if (!inside)
      ok = err_set(err, ERR_BAD_SCENE,
                   "\"%s\" lies outside the scene's folder \"%s\"; move it inside, or allow it with "
                   "--allow-outside if you trust this scene",
                   name, root_folder);
  }
  text_finish(&folder);
  text_finish(&clean);
  return ok;
}
