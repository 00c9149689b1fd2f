// Our own hundred lines of test framework. A test file includes this, writes TEST(name) { ... } blocks and ends
// with TEST_MAIN. CHECK reports and goes on; the exit code is the number of failed checks (at most 100). A file
// tests/test_NAME.c is built and registered by its name alone.

#ifndef RAYFOLD_TESTS_TEST_H
#define RAYFOLD_TESTS_TEST_H

#include <math.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// 1 under a sanitizer, where a long test does part of its work.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define TEST_IS_SLOW 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define TEST_IS_SLOW 1
#endif
#endif
#ifndef TEST_IS_SLOW
#define TEST_IS_SLOW 0
#endif

typedef void TestFunction(void);
typedef struct TestCase {
  const char *name;
  TestFunction *run;
  struct TestCase *next;
} TestCase;

static TestCase *test_first, **test_tail = &test_first;
static atomic_int test_failures, test_checks; // CHECK may stand in any thread

#define TEST(id)                                                                  \
  static void test_##id(void);                                                    \
  __attribute__((constructor)) static void register_##id(void)                    \
  {                                                                               \
    static TestCase c = {#id, test_##id, NULL};                                   \
    *test_tail = &c;                                                              \
    test_tail = &c.next;                                                          \
  }                                                                               \
  static void test_##id(void)

#define CHECK(condition) CHECK_MSG(condition, "%s", "")

// CHECK with a message that shows the values at fault.
#define CHECK_MSG(condition, ...)                                                 \
  do {                                                                            \
    test_checks++;                                                                \
    if (!(condition)) {                                                           \
      test_failures++;                                                            \
      if (test_failures <= 20) {                                                  \
        fprintf(stderr, "%s:%d: %s is false. ", __FILE__, __LINE__, #condition);  \
        fprintf(stderr, __VA_ARGS__);                                             \
        fputc('\n', stderr);                                                      \
      }                                                                           \
    }                                                                             \
  } while (0)

// Each argument is evaluated once.
#define CHECK_NEAR(a, b, tolerance)                                                                         \
  do {                                                                                                      \
    const double near_a = (double)(a), near_b = (double)(b);                                                \
    CHECK_MSG(fabs(near_a - near_b) <= (double)(tolerance), "%.9g against %.9g, off by %.3g", near_a, near_b, \
              near_a - near_b);                                                                             \
  } while (0)

#define CHECK_TEXT(text, part) CHECK_MSG(strstr((text), (part)), "\"%s\" lacks \"%s\"", (text), (part))

// A test built for one instruction set passes over a processor without it.
static inline bool test_can_run(void)
{
#if defined(__AVX512VL__)
  return __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq");
#elif defined(__AVX2__)
  return __builtin_cpu_supports("avx2");
#elif defined(__SSE4_2__)
  return __builtin_cpu_supports("sse4.2");
#else
  return true;
#endif
}

// How many times as long the long tests run: 1 for every change, more at night (RAYFOLD_INTENSITY=100).
static inline double test_intensity(void)
{
  const char *text = getenv("RAYFOLD_INTENSITY");
  const double x = text ? strtod(text, NULL) : 1;
  return x > 0 && x < 1e9 ? x : 1;
}

// A file as it is wanted, without waiting for the disk as file_write_whole() does: tests write thousands.
static inline void test_put_file(const char *path, const void *data, size_t size)
{
  FILE *f = fopen(path, "wb");
  if (!f || fwrite(data, 1, size, f) != size || fclose(f)) abort();
}

// Runs all tests, or those whose names contain the first argument.
#define TEST_MAIN                                                                                    \
  int main(int argc, char **argv)                                                                    \
  {                                                                                                  \
    if (!test_can_run()) return 77;                                                                  \
    for (const TestCase *c = test_first; c; c = c->next) {                                           \
      if (argc > 1 && !strstr(c->name, argv[1])) continue;                                           \
      const int before = test_failures;                                                              \
      c->run();                                                                                      \
      printf("%s %s\n", test_failures == before ? "ok  " : "FAIL", c->name);                         \
    }                                                                                                \
    printf("%d checks, %d failed\n", test_checks, test_failures);                                    \
    return test_checks == 0 ? 100 : test_failures < 100 ? test_failures : 100;                       \
  }

#endif
