// Replays tests/data/fuzz/FORMAT/*: files that once crashed, hung or swallowed memory. Whether a file is refused does
// not matter here (the importers' tests say that), only that it is dealt with in bounded time and memory, with a reason
// for each refusal; under the sanitizers, without a report.

#include "tests/fuzz.h"
#include "tests/test.h"

#include <dirent.h>
#include <sys/resource.h>
#include <time.h>

static double seconds(void)
{
  struct timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return (double)t.tv_sec + (double)t.tv_nsec * 1e-9;
}

static void replay(const Fuzz *f, const char *path)
{
  static unsigned char data[1 << 20];
  const char *text = "";
  FILE *in = fopen(path, "rb");
  if (!in) abort();
  const size_t size = fread(data, 1, sizeof data, in);
  fclose(in);
  const double start = seconds();
  const bool ok = fuzz_one(f, data, size, &text);
  CHECK_MSG(seconds() - start < 5, "%s took %.1f s", path, seconds() - start);
  CHECK_MSG(ok || (*text && strlen(text) > 10), "%s was refused without a reason", path);
}

static int replay_folder(const char *format)
{
  char folder[100], path[400];
  snprintf(folder, sizeof folder, "tests/data/fuzz/%s", format);
  DIR *d = opendir(folder);
  if (!d) return 0;
  int count = 0;
  Fuzz f;
  fuzz_begin(&f, format);
  for (struct dirent *e; (e = readdir(d));) {
    if (e->d_name[0] == '.') continue;
    snprintf(path, sizeof path, "%s/%.255s", folder, e->d_name);
    replay(&f, path);
    count++;
  }
  closedir(d);
  fuzz_end(&f);
  return count;
}

TEST(what_fuzzing_found_stays_mended)
{
  int count = 0;
  for (size_t i = 0; i < sizeof fuzz_scenes / sizeof *fuzz_scenes; i++)
    count += replay_folder(fuzz_scenes[i]);
  for (size_t i = 0; i < sizeof fuzz_pictures / sizeof *fuzz_pictures; i++)
    count += replay_folder(fuzz_pictures[i]);
  CHECK(count > 0);
  struct rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  CHECK_MSG(usage.ru_maxrss < 1 << 20, "%ld kB at most", usage.ru_maxrss);
}

TEST_MAIN
