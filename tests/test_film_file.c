// Films in files: what comes back is what went in; what is damaged is refused or the one before is taken; a program
// that is killed while it writes leaves a whole film behind.

#include "tests/test.h"

#include "base/file.h"
#include "base/hash.h"
#include "base/mem.h"
#include "render/film_file.h"

#include <dirent.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

static const char *folder(void)
{
  static char path[200];
  const char *base = getenv("TMPDIR");
  if (*path) return path;
  snprintf(path, sizeof path, "%s/rayfold-film-XXXXXX", base ? base : "/tmp");
  CHECK(mkdtemp(path) != NULL);
  return path;
}

static const char *file_at(const char *name)
{
  static char path[4][260];
  static int next;
  char *p = path[next++ & 3];
  snprintf(p, sizeof path[0], "%s/%s", folder(), name);
  return p;
}

// Every plane filled with numbers that depend on the seed.
static Film *film_of(uint32_t width, uint32_t height, uint32_t planes, uint32_t samples, uint32_t seed)
{
  Film *f = film_create(width, height, planes, NULL);
  CHECK(f && film_claim(f, 2, 2 + samples, NULL) && film_claim(f, 100, 101, NULL));
  for (uint32_t s = 0; s < samples; s++)
    for (uint32_t i = 0; i < width * height; i++) {
      const float x = unit_float(hash_combine(seed, i * 77 + s));
      const FilmSample seen = {.radiance = v3(x, 2 * x, -x),
                               .albedo = v3_all(x),
                               .normal = v3(0, x, 1),
                               .alpha = 1,
                               .position = v3(5 * x, 0, x),
                               .depth = x,
                               .object = i,
                               .material = s,
                               .is_hit = i % 3 != 0};
      film_add(f, i % width, i / width, 2 + s, &seen);
    }
  return f;
}

static void check_same(const Film *a, const Film *b)
{
  CHECK(a && b && film_hash(a) == film_hash(b) && a->planes == b->planes &&
        a->ranges.count == b->ranges.count);
  CHECK(!memcmp(a->ranges.items, b->ranges.items, a->ranges.count * sizeof *a->ranges.items));
}

TEST(what_comes_back_is_what_went_in)
{
  const uint32_t all = (1u << FILM_PLANE_COUNT) - 1,
                 planes[] = {0, all, 1u << FILM_DEPTH, 1u << FILM_VARIANCE};
  for (int i = 0; i < 4; i++) {
    Film *f = film_of(13 + (uint32_t)i, 7, planes[i], 5, (uint32_t)i);
    const char *path = file_at("same.rff");
    FilmLabel label = {0};
    bool is_older;
    Err err = {0};
    CHECK(film_write(f, 0x123456789abcdef0u + (uint64_t)i, i ? "a note\nof two lines" : "", path, &err));
    Film *back = film_read(path, &label, &is_older, &err);
    check_same(f, back);
    CHECK(!is_older && label.key == 0x123456789abcdef0u + (uint64_t)i);
    CHECK(!strcmp(text_get(&label.note), i ? "a note\nof two lines" : ""));
    film_destroy(back);
    film_destroy(f);
    text_finish(&label.note);
  }
}

TEST(a_film_that_was_read_goes_on)
{
  Film *whole = film_of(8, 8, 0, 6, 1), *part = film_of(8, 8, 0, 6, 1);
  const char *path = file_at("on.rff");
  bool is_older;
  FilmLabel label = {0};
  CHECK(film_write(part, 0, "", path, NULL));
  Film *back = film_read(path, &label, &is_older, NULL);
  const FilmSample seen = {.radiance = v3(1, 2, 3), .alpha = 1};
  CHECK(film_claim(back, 8, 9, NULL) && film_claim(whole, 8, 9, NULL));
  CHECK(!film_claim(back, 7, 9, NULL)); // it knows what it has
  film_add(back, 3, 3, 8, &seen);
  film_add(whole, 3, 3, 8, &seen);
  check_same(whole, back);
  film_destroy(whole);
  film_destroy(part);
  film_destroy(back);
  text_finish(&label.note);
}

static ErrKind read_kind(const char *path, char *text)
{
  FilmLabel label = {0};
  Err err = {0};
  bool is_older;
  Film *f = film_read(path, &label, &is_older, &err);
  CHECK((f != NULL) == (err.kind == ERR_NONE));
  film_destroy(f);
  text_finish(&label.note);
  if (text) snprintf(text, 200, "%.199s", err.text);
  return err.kind;
}

// A file of these bytes alone: no older one beside it.
static const char *bytes_at(const char *name, const void *bytes, size_t size)
{
  const char *path = file_at(name);
  char older[300];
  snprintf(older, sizeof older, "%s~", path);
  unlink(older);
  test_put_file(path, bytes, size);
  return path;
}

TEST(damage_is_refused)
{
  Film *f = film_of(3, 2, 1u << FILM_DEPTH, 2, 9);
  const char *path = file_at("whole.rff");
  FileBytes file;
  CHECK(film_write(f, 7, "note", path, NULL) && file_read(&file, path, NULL));
  unsigned char *copy = malloc(file.size + 8);
  for (size_t size = 0; size < file.size; size++)
    CHECK(read_kind(bytes_at("cut.rff", file.data, size), NULL) == ERR_BAD_SCENE);
  for (size_t at = 0; at < file.size; at++) {
    memcpy(copy, file.data, file.size);
    copy[at] ^= (unsigned char)(1u << at % 8);
    const bool is_padding = at >= 56 + 2 * 12 + 4 && at < 56 + 2 * 12 + 8; // behind the note, and of no meaning
    CHECK(read_kind(bytes_at("flip.rff", copy, file.size), NULL) == (is_padding ? ERR_NONE : ERR_BAD_SCENE));
  }
  memcpy(copy, file.data, file.size);
  CHECK(read_kind(bytes_at("long.rff", copy, file.size + 1), NULL) == ERR_BAD_SCENE);
  char text[200];
  CHECK(read_kind(bytes_at("other.rff",
                           "\x89PNG\r\n\x1a\n and more of it, long enough to hold a head of a film", 60),
                  text) == ERR_BAD_SCENE &&
        strstr(text, "is not a film"));
  memcpy(copy, file.data, file.size);
  copy[8] = 9;
  CHECK(read_kind(bytes_at("newer.rff", copy, file.size), text) == ERR_BAD_SCENE &&
        strstr(text, "version 9"));
  CHECK(read_kind(file_at("none.rff"), NULL) == ERR_NOT_FOUND);
  free(copy);
  file_release(&file);
  film_destroy(f);
}

TEST(the_one_before_is_taken_when_the_newest_is_damaged)
{
  Film *first = film_of(5, 5, 0, 2, 1), *second = film_of(5, 5, 0, 3, 1);
  const char *path = file_at("twice.rff");
  CHECK(film_write(first, 1, "", path, NULL) && film_write(second, 1, "", path, NULL));
  FilmLabel label = {0};
  bool is_older;
  Film *back = film_read(path, &label, &is_older, NULL);
  check_same(second, back);
  CHECK(!is_older);
  film_destroy(back);
  CHECK(truncate(path, 100) == 0);
  back = film_read(path, &label, &is_older, NULL);
  check_same(first, back);
  CHECK(is_older);
  film_destroy(back);
  // The damaged file does not push out the sound one when the next is written.
  CHECK(film_write(second, 1, "", path, NULL) && truncate(path, 100) == 0);
  back = film_read(path, &label, &is_older, NULL);
  check_same(first, back);
  film_destroy(back);
  film_destroy(first);
  film_destroy(second);
  text_finish(&label.note);
}

TEST(what_is_not_whole_is_not_kept)
{
  Film *f = film_of(5, 5, 0, 2, 1);
  const char *path = file_at("partial.rff");
  Err err = {0};
  f->is_partial = true;
  CHECK(!film_write(f, 0, "", path, &err) && err.kind == ERR_BAD_ARGUMENT && access(path, F_OK));
  f->is_partial = false;
  err = (Err){0};
  CHECK(!film_write(f, 0, "", "/nowhere/at/all.rff", &err) && err.kind == ERR_IO);
  film_destroy(f);
}

static int temporaries(void)
{
  int n = 0;
  DIR *list = opendir(folder());
  for (const struct dirent *e = readdir(list); e; e = readdir(list)) n += strstr(e->d_name, ".rfpart") != NULL;
  closedir(list);
  return n;
}

// R1, R2: killed at any moment, the old film or the new one is there, whole.
TEST(a_killed_writer_leaves_a_whole_film)
{
  Film *films[2] = {film_of(64, 64, 1u << FILM_NORMAL, 1, 1), film_of(64, 64, 1u << FILM_NORMAL, 2, 1)};
  const char *path = file_at("killed.rff");
  CHECK(film_write(films[0], 0, "", path, NULL));
  int seen[2] = {0};
  const int rounds = (int)fmin(60 * test_intensity(), 1000);
  int orphans = 0;
  for (int round = 0; round < rounds; round++) {
    const pid_t child = fork();
    if (child == 0) {
      for (int i = 1;; i++) film_write(films[i & 1], 0, "", path, NULL);
    }
    usleep(300 + hash_u32((uint32_t)round) % 4000);
    kill(child, SIGKILL);
    waitpid(child, NULL, 0);
    orphans += temporaries();
    FilmLabel label = {0};
    bool is_older = true;
    Film *back = film_read(path, &label, &is_older, NULL);
    CHECK(back && !is_older);
    for (int i = 0; back && i < 2; i++) seen[i] += film_hash(back) == film_hash(films[i]);
    film_destroy(back);
    text_finish(&label.note);
  }
  CHECK(seen[0] + seen[1] == rounds);
  // What the killed ones left is gone with the next writing; what others are at work on, or have named alike, stays.
  FileOut busy = {0};
  const pid_t child = fork();
  if (child == 0) {
    file_begin(&busy, path, NULL);
    kill(getpid(), SIGKILL);
  }
  waitpid(child, NULL, 0);
  CHECK(temporaries() > 0);
  CHECK(file_begin(&busy, path, NULL) && file_write_whole(file_at("killed.rff.backup"), "mine", 4, NULL));
  CHECK(film_write(films[0], 0, "", path, NULL) && temporaries() == 1 && !access(file_at("killed.rff.backup"), F_OK));
  CHECK(file_commit(&busy, NULL) && temporaries() == 0);
  file_finish(&busy);
  printf("  killed %d times at work: %d old, %d new, 0 half; %d temporary files found and removed\n", rounds, seen[0],
         seen[1], orphans);
  film_destroy(films[0]);
  film_destroy(films[1]);
}

TEST_MAIN
