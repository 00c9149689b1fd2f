// Files: whole reads, and writes that appear whole or not at all (a temporary name beside the target, fsync,
// rename, fsync of the folder). Also the one door through which a scene names other files.

#ifndef RAYFOLD_BASE_FILE_H
#define RAYFOLD_BASE_FILE_H

#include "base/err.h"
#include "base/text.h"

#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

// A file's bytes in memory, mapped when possible. `data` is followed by at least one zero byte.
typedef struct FileBytes {
  const uint8_t *data;
  size_t size;
  void *map;       // private: what to unmap or free
  size_t map_size; // private: 0 when the bytes were read, not mapped
} FileBytes;       // zero is no file

// Reads all of path (a regular file; pipes and devices are refused). ERR_NOT_FOUND with the reason.
bool file_read(FileBytes *out, const char *path, Err *err);
void file_release(FileBytes *f); // accepts zero

// The same for several owners: the bytes stay until the last of them lets go. While they are mapped, the file must not
// be written over in place: a page that is cut off ends the program (SIGBUS). What is written here never does that, a
// new file takes the name and the old one lives on.
typedef struct SharedFile {
  atomic_int users;
  FileBytes bytes;
  char *path; // owned; for messages
} SharedFile;

SharedFile *shared_file_open(const char *path, Err *err); // as file_read(); NULL on failure
SharedFile *shared_file_share(SharedFile *f);
void shared_file_release(SharedFile *f); // accepts NULL

// A file being written. Writes go to a temporary file, PATH.XXXXXX.rfpart in the same folder, until file_commit(). It is
// locked while its writer lives, so the next writer of PATH knows those that a killed one left behind and removes them.
typedef struct FileOut {
  FILE *stream;        // write here (stdio); NULL before begin and after commit
  char *path, *temp;   // owned
  int lock;            // holds the lock of temp until it is renamed; 0: none
} FileOut;             // zero is no file

bool file_begin(FileOut *f, const char *path, Err *err);
bool file_write(FileOut *f, const void *data, size_t size, Err *err);
bool file_settle(FileOut *f, Err *err); // flush, fsync: what can fail for want of room has not. Then only commit
bool file_commit(FileOut *f, Err *err); // settle, rename over the target; the whole file or none
void file_finish(FileOut *f);           // accepts zero; removes what was not committed

// The same in one call.
bool file_write_whole(const char *path, const void *data, size_t size, Err *err);

// Where a file named inside another file lies: `name` (percent-decoded by the caller where its format asks for
// that; '\\' is taken as '/') is relative to the folder of `owner_path`. Unless allow_outside, the result must lie
// inside `root` (a folder; symbolic links resolved), else ERR_BAD_SCENE names --allow-outside as the way out.
// root NULL means the folder of owner_path. The path is put into out (cleared first).
bool path_resolve(Text *out, const char *owner_path, const char *name, const char *root, bool allow_outside,
                  Err *err);

// The folder part of path ("." when there is none), into out (cleared first).
void path_folder(Text *out, const char *path);

#endif
