// See film_file.h. A file is believed only if its size is exactly what its head says and its hash is right; then its
// ranges are checked like any other input.

#include "render/film_file.h"

#include "base/file.h"
#include "base/hash.h"
#include "base/mem.h"

#include <fcntl.h>
#include <string.h>
#include <unistd.h>

#define FILM_MAGIC "RFFILM\r\n" // a transfer as text would show
enum { FILM_VERSION = 2 };

typedef struct FilmHead {
  char magic[8];
  uint32_t version, byte_order; // 0x01020304
  uint32_t width, height, planes, range_count;
  uint64_t note_size; // bytes, without padding
  uint64_t key;
  uint64_t hash; // of everything else
} FilmHead;
_Static_assert(sizeof(FilmHead) == 56, "no padding");

#define BYTE_ORDER_MARK 0x01020304u

// Where the parts of a film lie, in a film or in the bytes of a file.
typedef struct FilmParts {
  const void *ranges, *note, *arrays[FILM_ARRAY_COUNT];
  size_t array_size[FILM_ARRAY_COUNT]; // 0: this film lacks it
} FilmParts;

static size_t padded(size_t size)
{
  return (size + 7) & ~(size_t)7;
}

// The arrays may only be read through a film that is const.
static void list_of(const Film *f, FilmArray out[FILM_ARRAY_COUNT])
{
  film_list_arrays((Film *)(uintptr_t)f, out);
}

// Sizes alone; film_bytes() has found that they do not overflow.
static FilmParts parts_by_head(const FilmHead *h)
{
  const Film none = {0};
  FilmArray arrays[FILM_ARRAY_COUNT];
  FilmParts p = {0};
  list_of(&none, arrays);
  for (int i = 0; i < FILM_ARRAY_COUNT; i++)
    if (h->planes >> arrays[i].plane & 1) p.array_size[i] = (size_t)h->width * h->height * arrays[i].pixel_size;
  return p;
}

static uint64_t hash_of(const FilmHead *head, const FilmParts *p)
{
  FilmHead bare = *head;
  bare.hash = 0;
  uint64_t h = hash_bulk(0, &bare, sizeof bare);
  h = hash_bulk(h, p->ranges, head->range_count * sizeof(CellRange));
  h = hash_bulk(h, p->note, (size_t)head->note_size);
  for (int i = 0; i < FILM_ARRAY_COUNT; i++) h = hash_bulk(h, p->arrays[i], p->array_size[i]);
  return h;
}

// --- reading --------------------------------------------------------------------------------------

static bool fail_damaged(const char *path, Err *err)
{
  return err_set(err, ERR_BAD_SCENE,
                 "%s is damaged: its size or its checksum is wrong; delete it and render again", path);
}

static bool check_head(const FilmHead *h, size_t size, const char *path, Err *err)
{
  if (size < sizeof *h || memcmp(h->magic, FILM_MAGIC, sizeof h->magic))
    return err_set(err, ERR_BAD_SCENE, "%s is not a film; `rayfold render --film` makes one", path);
  if (h->version != FILM_VERSION || h->byte_order != BYTE_ORDER_MARK)
    return err_set(err, ERR_BAD_SCENE, "%s is a film of version %u; this program reads version %d", path,
                   h->version, FILM_VERSION);
  size_t bytes;
  if (h->planes >> FILM_PLANE_COUNT || !(h->planes >> FILM_BEAUTY & 1) ||
      !(h->planes >> FILM_SAMPLES & 1) || h->note_size > FILM_MOST_NOTE ||
      !film_bytes(h->width, h->height, h->planes, &bytes))
    return fail_damaged(path, err);
  return true;
}

// Head and parts of a file whose size and hash are right.
static bool find_parts(const FileBytes *file, FilmHead *head, FilmParts *p, const char *path, Err *err)
{
  *head = (FilmHead){0};
  memcpy(head, file->data, file->size < sizeof *head ? file->size : sizeof *head);
  if (!check_head(head, file->size, path, err)) return false;
  *p = parts_by_head(head);
  size_t at = sizeof *head + padded(head->range_count * sizeof(CellRange)) + padded((size_t)head->note_size);
  size_t size = at;
  for (int i = 0; i < FILM_ARRAY_COUNT; i++)
    if (!size_add(size, p->array_size[i], &size)) return fail_damaged(path, err);
  if (size != file->size) return fail_damaged(path, err);
  p->ranges = file->data + sizeof *head;
  p->note = file->data + sizeof *head + padded(head->range_count * sizeof(CellRange));
  for (int i = 0; i < FILM_ARRAY_COUNT; at += p->array_size[i++]) p->arrays[i] = file->data + at;
  return hash_of(head, p) == head->hash || fail_damaged(path, err);
}

// Sorted and apart, so that one look at each is enough.
static bool read_ranges(Film *f, const FilmParts *p, uint32_t count, const char *path, Err *err)
{
  const uint32_t cells = film_cells(f);
  CellRange last = {0};
  uint32_t total = 0;
  if (!array_reserve(&f->ranges, count)) return err_memory(err, "a film", count * sizeof(CellRange));
  for (uint32_t i = 0; i < count; i++) {
    CellRange r;
    memcpy(&r, (const char *)p->ranges + i * sizeof r, sizeof r);
    const bool is_same = i && r.cell == last.cell;
    if (!is_same) total = 0;
    if (r.cell >= cells || (i && r.cell < last.cell) || r.first >= r.end || (is_same && r.first <= last.end) ||
        r.end - r.first > FILM_MOST_SAMPLES - total)
      return fail_damaged(path, err);
    last = r;
    total += r.end - r.first;
    f->ranges.items[f->ranges.count++] = r;
  }
  return true;
}

static bool read_parts(Film *f, const FilmHead *head, const FilmParts *p, FilmLabel *label, const char *path,
                       Err *err)
{
  FilmArray arrays[FILM_ARRAY_COUNT];
  list_of(f, arrays);
  if (!read_ranges(f, p, head->range_count, path, err)) return false;
  text_clear(&label->note);
  text_add_n(&label->note, p->note, (size_t)head->note_size);
  if (label->note.failed) return err_memory(err, "a film's note", (size_t)head->note_size);
  for (int i = 0; i < FILM_ARRAY_COUNT; i++)
    if (p->array_size[i]) memcpy(*arrays[i].data, p->arrays[i], p->array_size[i]);
  label->key = head->key;
  return true;
}

static Film *read_one(const char *path, FilmLabel *label, Err *err)
{
  FileBytes file;
  FilmHead head;
  FilmParts parts;
  Film *f = NULL;
  if (!file_read(&file, path, err)) return NULL;
  // No memory is asked for on the word of a file that is not as long as it says.
  if (find_parts(&file, &head, &parts, path, err)) f = film_create(head.width, head.height, head.planes, err);
  if (f && !read_parts(f, &head, &parts, label, path, err)) {
    film_destroy(f);
    f = NULL;
  }
  file_release(&file);
  return f;
}

static bool name_of_older(Text *out, const char *path, Err *err)
{
  text_add(out, "%s~", path);
  return !out->failed || err_memory(err, "a film's name", strlen(path));
}

Film *film_read(const char *path, FilmLabel *label, bool *is_older, Err *err)
{
  Err first = {0}, second = {0};
  Text older = {0};
  *is_older = false;
  Film *f = read_one(path, label, &first);
  if (!f && first.kind == ERR_BAD_SCENE && name_of_older(&older, path, &second)) {
    f = read_one(text_get(&older), label, &second);
    *is_older = f;
  }
  text_finish(&older);
  if (!f) *err = first; // what is wrong with the one that was asked for
  return f;
}

// --- writing --------------------------------------------------------------------------------------

static bool write_parts(FileOut *out, const FilmHead *head, const FilmParts *p, Err *err)
{
  static const char zeros[8] = {0};
  const size_t size = (size_t)head->note_size, ranges = head->range_count * sizeof(CellRange);
  bool ok = file_write(out, head, sizeof *head, err) &&
            file_write(out, p->ranges, ranges, err) && file_write(out, zeros, padded(ranges) - ranges, err) &&
            file_write(out, p->note, size, err) && file_write(out, zeros, padded(size) - size, err);
  for (int i = 0; i < FILM_ARRAY_COUNT && ok; i++) ok = file_write(out, p->arrays[i], p->array_size[i], err);
  return ok;
}

// A second name for the file of before, so that there is one under PATH at every moment. A damaged one does not push
// out the sound one before it. A file system that knows no second names only has no PATH~.
static void keep_older(const char *path, const char *older)
{
  FileBytes file;
  FilmHead head;
  FilmParts parts;
  Err none = {0};
  if (!file_read(&file, path, &none)) return;
  if (find_parts(&file, &head, &parts, path, &none)) {
    (void)unlink(older);
    (void)!linkat(AT_FDCWD, path, AT_FDCWD, older, AT_SYMLINK_FOLLOW);
  }
  file_release(&file);
}

bool film_write(const Film *f, uint64_t key, const char *note, const char *path, Err *err)
{
  FileOut out = {0};
  Text older = {0};
  const size_t size = strlen(note);
  FilmHead head = {.magic = FILM_MAGIC,
                   .version = FILM_VERSION,
                   .byte_order = BYTE_ORDER_MARK,
                   .width = f->width,
                   .height = f->height,
                   .planes = f->planes,
                   .range_count = (uint32_t)f->ranges.count,
                   .note_size = size,
                   .key = key};
  if (f->is_partial)
    return err_set(err, ERR_BAD_ARGUMENT, "%s: the film was broken off within a pass and cannot be kept",
                   path);
  if (size > FILM_MOST_NOTE)
    return err_set(err, ERR_BAD_ARGUMENT, "%s: a note of %zu bytes; at most %d are kept", path, size,
                   FILM_MOST_NOTE);
  FilmArray arrays[FILM_ARRAY_COUNT];
  FilmParts parts = parts_by_head(&head);
  list_of(f, arrays);
  parts.ranges = f->ranges.items;
  parts.note = note;
  for (int i = 0; i < FILM_ARRAY_COUNT; i++) parts.arrays[i] = *arrays[i].data;
  head.hash = hash_of(&head, &parts);
  bool ok = name_of_older(&older, path, err) && file_begin(&out, path, err) &&
            write_parts(&out, &head, &parts, err) && file_settle(&out, err);
  if (ok) keep_older(path, text_get(&older));
  ok = ok && file_commit(&out, err);
  file_finish(&out);
  text_finish(&older);
  return ok;
}

