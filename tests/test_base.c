// The base room: arenas, errors, text, files that appear whole, the thread pool.

#include "tests/test.h"

#include "base/arena.h"
#include "base/array.h"
#include "base/err.h"
#include "base/file.h"
#include "base/jobs.h"
#include "base/notes.h"
#include "base/table.h"
#include "base/vec.h"

#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

TEST(err_keeps_the_first_cause)
{
  Err e = {0};
  CHECK(!err_set(&e, ERR_IO, "first %d", 1));
  err_set(&e, ERR_BAD_SCENE, "second");
  err_where(&e, "file.json");
  CHECK(e.kind == ERR_IO);
  CHECK(!strcmp(e.text, "file.json: first 1"));
}

TEST(arena_is_cleared_aligned_and_survives_failure)
{
  Arena a = {0};
  for (size_t n = 1; n < 100000; n = n * 3 + 1) {
    unsigned char *p = arena_alloc(&a, n, 1);
    CHECK(p && (uintptr_t)p % 64 == 0);
    unsigned sum = 0;
    for (size_t i = 0; p && i < n; i++) sum += p[i];
    CHECK(sum == 0);
    if (p) memset(p, 0xff, n);
  }
  CHECK(!arena_alloc(&a, (size_t)-1, 2));
  CHECK(a.ran_dry);
  arena_finish(&a);
  CHECK(a.total_size == 0);
}

TEST(array_grows_and_reports_failure)
{
  ARRAY(int) a = {0};
  for (int i = 0; i < 1000; i++) CHECK(array_push(&a, i));
  CHECK(a.count == 1000 && a.items[999] == 999);
  mem_fail_after(1);
  const bool grew = array_reserve(&a, 100000);
  mem_fail_after(0);
  CHECK(!grew && a.count == 1000 && a.items[999] == 999);
  array_finish(&a);
}

TEST(a_table_finds_all_values_of_a_key)
{
  enum { KEYS = 3000, EACH = 3 };
  Table t = {0};
  size_t step = 0;
  CHECK(!table_next(&t, 5, &step));
  for (int i = 0; i < KEYS * EACH; i++) CHECK(table_add(&t, (uint64_t)(i % KEYS) << 32, i));
  CHECK(t.count == KEYS * EACH && t.capacity < 8 * t.count);
  for (int k = 0; k < KEYS; k++) {
    int count = 0, sum = 0;
    step = 0;
    for (int32_t *value; (value = table_next(&t, (uint64_t)k << 32, &step)); count++) sum += *value;
    CHECK_MSG(count == EACH && sum == 3 * k + 3 * KEYS, "key %d: %d values", k, count);
  }
  step = 0;
  CHECK(!table_next(&t, 1, &step));
  table_clear(&t);
  step = 0;
  CHECK(t.count == 0 && !table_next(&t, 0, &step));
  table_finish(&t);
  mem_fail_after(1);
  CHECK(!table_add(&t, 1, 1));
  mem_fail_after(0);
  CHECK(table_add(&t, 1, 7) && *table_next(&t, 1, &(size_t){0}) == 7);
  table_finish(&t);
}

TEST(messages_do_not_command_a_terminal)
{
  Err err = {0};
  err_set(&err, ERR_BAD_SCENE, "%s", "a\033[31mb\177\007\302\233c\303\266 \342\200\246\nd");
  CHECK(!strcmp(err.text, "a?[31mb????c\303\266 \342\200\246\nd"));
  err_where(&err, "%s", "x\033y");
  CHECK(!strncmp(err.text, "x?y: a?", 7));
}

TEST(text_suggests_the_nearest_name)
{
  const char *names[] = {"glass", "gold", "roughness"};
  char hint[120];
  CHECK(text_equal(text_nearest("galss", names, 3), "glass"));
  CHECK(text_equal(text_nearest("Roughness", names, 3), "roughness"));
  CHECK(!text_nearest("xyzzy", names, 3));
  CHECK_TEXT(text_hint(hint, "godl", names, 3), "did you mean \"gold\"?");
}

TEST(notes_are_kept_once)
{
  Notes n = {0};
  note_once(&n, "a %d", 1);
  note_once(&n, "a %d", 1);
  note_once(&n, "b");
  CHECK(n.lines.count == 2);
  notes_finish(&n);
}

static const char *temp_path(const char *name)
{
  static char path[200];
  const char *folder = getenv("TMPDIR");
  snprintf(path, sizeof path, "%s/rayfold-test-%d-%s", folder ? folder : "/tmp", (int)getpid(), name);
  return path;
}

static bool file_has(const char *path, const char *content)
{
  FileBytes f;
  if (!file_read(&f, path, NULL)) return false;
  const bool same = f.size == strlen(content) && !memcmp(f.data, content, f.size);
  file_release(&f);
  return same;
}

TEST(file_appears_whole_or_not_at_all)
{
  const char *path = temp_path("whole");
  Err e = {0};
  CHECK(file_write_whole(path, "old", 3, &e));
  FileOut f;
  CHECK(file_begin(&f, path, &e) && file_write(&f, "half", 4, &e));
  CHECK(file_has(path, "old"));
  file_finish(&f); // never committed
  CHECK(file_has(path, "old"));
  CHECK(file_write_whole(path, "new!", 4, &e) && file_has(path, "new!"));
  unlink(path);
}

TEST(a_replaced_file_stays_as_private_as_it_was)
{
  const char *path = temp_path("private");
  Err e = {0};
  struct stat st;
  const mode_t mask = umask(022);
  CHECK(file_write_whole(path, "1", 1, &e) && !stat(path, &st) && (st.st_mode & 0777) == 0644);
  CHECK(!chmod(path, 0600) && file_write_whole(path, "2", 1, &e) && !stat(path, &st) && (st.st_mode & 0777) == 0600);
  umask(mask);
  unlink(path);
}

TEST(a_full_disk_leaves_the_old_file)
{
  const char *path = temp_path("full");
  Err e = {0};
  CHECK(file_write_whole(path, "old", 3, &e));
  // The size limit stands in for a full disk; SIGXFSZ would end the process, so it is ignored.
  struct rlimit old_limit, limit;
  getrlimit(RLIMIT_FSIZE, &old_limit);
  limit = old_limit;
  limit.rlim_cur = 1000;
  signal(SIGXFSZ, SIG_IGN);
  setrlimit(RLIMIT_FSIZE, &limit);
  char *big = calloc(1, 100000);
  CHECK(!file_write_whole(path, big, 100000, &e));
  setrlimit(RLIMIT_FSIZE, &old_limit);
  CHECK(e.kind == ERR_IO);
  CHECK(file_has(path, "old"));
  free(big);
  unlink(path);
}

TEST(missing_and_odd_files_are_explained)
{
  FileBytes f;
  Err e = {0};
  CHECK(!file_read(&f, "/nonexistent/x", &e) && e.kind == ERR_NOT_FOUND);
  e = (Err){0};
  CHECK(!file_read(&f, "/tmp", &e));
  CHECK_TEXT(e.text, "is a folder");
  e = (Err){0};
  CHECK(!file_read(&f, "/dev/zero", &e));
  CHECK_TEXT(e.text, "not a regular file");
  e = (Err){0};
  CHECK(!file_write_whole("/nonexistent/x", "a", 1, &e) && e.kind == ERR_IO);
}

TEST(files_outside_the_scene_are_refused)
{
  Text t = {0};
  Err e = {0};
  CHECK(path_resolve(&t, "scenes/a.json", "tex/b.png", NULL, false, &e));
  CHECK(text_equal(text_get(&t), "scenes/tex/b.png"));
  CHECK(!path_resolve(&t, "scenes/a.json", "../b.png", NULL, false, &e));
  CHECK_TEXT(e.text, "--allow-outside");
  e = (Err){0};
  CHECK(!path_resolve(&t, "scenes/a.json", "/etc/passwd", NULL, false, &e));
  CHECK(path_resolve(&t, "scenes/a.json", "/etc/passwd", NULL, true, NULL));
  CHECK(path_resolve(&t, "a.obj", "tex\\c.png", NULL, false, NULL));
  CHECK(text_equal(text_get(&t), "tex/c.png"));
  text_finish(&t);
}

typedef struct Sum {
  atomic_ullong total;
  Cancel cancel;
  int worker_limit;
  atomic_int bad_workers;
} Sum;

static void add_item(void *user, size_t item, int worker)
{
  Sum *s = user;
  atomic_fetch_add(&s->total, item);
  if (worker < 0 || worker >= s->worker_limit) atomic_fetch_add(&s->bad_workers, 1);
  if (item == 500) atomic_store(&s->cancel.requested, true);
}

TEST(jobs_do_every_item_once)
{
  for (int threads = 1; threads <= 5; threads++) {
    Jobs *j = jobs_create(threads, NULL);
    CHECK(j && jobs_thread_count(j) == threads);
    for (int round = 0; round < 200; round++) {
      Sum s = {.worker_limit = threads};
      CHECK(jobs_run(j, 100, add_item, &s, &s.cancel));
      CHECK(s.total == 4950 && s.bad_workers == 0);
    }
    Sum s = {.worker_limit = threads};
    CHECK(!jobs_run(j, 1000000, add_item, &s, &s.cancel));
    jobs_destroy(j);
  }
}

TEST(frames_invert)
{
  const Frame f = {v3(2, 0, 1), v3(0, 3, 0), v3(-1, 0, 2), v3(4, 5, 6)};
  const Frame i = frame_inverse(&f);
  const Vec3 p = frame_point(&i, frame_point(&f, v3(1, 2, 3)));
  CHECK_NEAR(v3_length(p - v3(1, 2, 3)), 0, 1e-5);
  const Frame b = frame_around(v3_normalize(v3(1, -2, -3)));
  CHECK_NEAR(v3_dot(b.x, b.y), 0, 1e-6);
  CHECK_NEAR(v3_length(v3_cross(b.x, b.y) - b.z), 0, 1e-6);
}

TEST_MAIN
