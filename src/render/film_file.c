// See film_file.h. A file is believed only if its size is exactly what its head says and its hash is right; then its
// ranges are checked like any other input.

#include "render/film_file.h"

#include "base/file.h"
#include "base/hash.h"
#include "base/mem.h"

#include <string.h>
#include <unistd.h>

#define FILM_MAGIC "RFFILM\r\n" // a transfer as text would show
enum { FILM_VERSION = 1 };

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

static size_t padded(size_t size)
{
  return (size + 7) & ~(size_t)7;
}

static size_t array_size(const Film *f, const FilmArray *a)
{
  return *a->data ? (size_t)f->width * f->height * a->pixel_size : 0;
}

// The arrays may only be read through a film that is const.
static void list_of(const Film *f, FilmArray out[FILM_ARRAY_COUNT])
{
  film_list_arrays((Film *)(uintptr_t)f, out);
}

// --- writing --------------------------------------------------------------------------------------

static uint64_t hash_of(const Film *f, const FilmHead *head, const void *note)
{
  FilmHead bare = *head;
  FilmArray arrays[FILM_ARRAY_COUNT];
  bare.hash = 0;
  list_of(f, arrays);
  uint64_t h = hash_bytes(0, &bare, sizeof bare);
  h = hash_bytes(h, f->ranges.items, f->ranges.count * sizeof *f->ranges.items);
  h = hash_bytes(h, note, (size_t)head->note_size);
  for (int i = 0; i < FILM_ARRAY_COUNT; i++) h = hash_bytes(h, *arrays[i].data, array_size(f, &arrays[i]));
  return h;
}

static bool write_parts(FileOut *out, const Film *f, const FilmHead *head, const char *note, Err *err)
{
  static const char zeros[8] = {0};
  FilmArray arrays[FILM_ARRAY_COUNT];
  const size_t size = (size_t)head->note_size;
  list_of(f, arrays);
  bool ok = file_write(out, head, sizeof *head, err) &&
            file_write(out, f->ranges.items, f->ranges.count * sizeof *f->ranges.items, err) &&
            file_write(out, note, size, err) && file_write(out, zeros, padded(size) - size, err);
  for (int i = 0; i < FILM_ARRAY_COUNT && ok; i++)
    ok = file_write(out, *arrays[i].data, array_size(f, &arrays[i]), err);
  return ok;
}

static bool name_of_older(Text *out, const char *path, Err *err)
{
  text_add(out, "%s~", path);
  return !out->failed || err_memory(err, "a film's name", strlen(path));
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
  head.hash = hash_of(f, &head, note);
  bool ok = name_of_older(&older, path, err) && file_begin(&out, path, err) &&
            write_parts(&out, f, &head, note, err);
  // A second name for the file of before, so that there is one under PATH at every moment. There is none when the film
  // is new; and a file system that knows no second names only has no PATH~.
  if (ok) (void)unlink(text_get(&older));
  if (ok) (void)!link(path, text_get(&older));
  ok = ok && file_commit(&out, err);
  file_finish(&out);
  text_finish(&older);
  return ok;
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
  if (h->planes >> FILM_PLANE_COUNT || !(h->planes >> FILM_BEAUTY & 1) || !(h->planes >> FILM_SAMPLES & 1) ||
      h->note_size > FILM_MOST_NOTE || h->range_count > FILM_MOST_SAMPLES)
    return fail_damaged(path, err);
  return true;
}

static bool read_ranges(Film *f, const uint8_t *data, uint32_t count, const char *path, Err *err)
{
  for (uint32_t i = 0; i < count; i++) {
    SampleRange r;
    memcpy(&r, data + i * sizeof r, sizeof r);
    Err why = {0};
    if (r.first < r.end && film_claim(f, r.first, r.end, &why)) continue;
    return why.kind == ERR_NO_MEMORY ? err_memory(err, "a film", count * sizeof r) : fail_damaged(path, err);
  }
  return true;
}

static bool read_parts(Film *f, const FilmHead *head, const FileBytes *file, FilmLabel *label,
                       const char *path, Err *err)
{
  FilmArray arrays[FILM_ARRAY_COUNT];
  const uint8_t *at = file->data + sizeof *head;
  const size_t ranges = (size_t)head->range_count * sizeof(SampleRange), note = (size_t)head->note_size;
  size_t size = sizeof *head + ranges + padded(note);
  list_of(f, arrays);
  for (int i = 0; i < FILM_ARRAY_COUNT; i++) size += array_size(f, &arrays[i]);
  if (size != file->size) return fail_damaged(path, err);
  if (!read_ranges(f, at, head->range_count, path, err)) return false;
  text_add_n(&label->note, (const char *)at + ranges, note);
  if (label->note.failed) return err_memory(err, "a film's note", note);
  at += ranges + padded(note);
  for (int i = 0; i < FILM_ARRAY_COUNT; i++) {
    if (*arrays[i].data) memcpy(*arrays[i].data, at, array_size(f, &arrays[i]));
    at += array_size(f, &arrays[i]);
  }
  label->key = head->key;
  return hash_of(f, head, text_get(&label->note)) == head->hash || fail_damaged(path, err);
}

static Film *read_one(const char *path, FilmLabel *label, Err *err)
{
  FileBytes file;
  FilmHead head = {0};
  size_t bytes = 0;
  if (!file_read(&file, path, err)) return NULL;
  memcpy(&head, file.data, file.size < sizeof head ? file.size : sizeof head);
  Film *f = NULL;
  text_clear(&label->note);
  bool ok = check_head(&head, file.size, path, err);
  // No more memory than the file itself is long is asked for on its word.
  if (ok && (!film_bytes(head.width, head.height, head.planes, &bytes) || bytes - sizeof(Film) > file.size))
    ok = fail_damaged(path, err);
  if (ok) f = film_create(head.width, head.height, head.planes, err);
  ok = f && read_parts(f, &head, &file, label, path, err);
  file_release(&file);
  if (ok) return f;
  film_destroy(f);
  return NULL;
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
