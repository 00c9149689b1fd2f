// The fuzzer's entry, for clang's libFuzzer (tools/fuzz.sh builds and runs it). The environment names the format.

#include "tests/fuzz.h"

#include <stdint.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static Fuzz fuzz;

static void finish(void)
{
  fuzz_end(&fuzz);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
  const char *text, *format = getenv("RAYFOLD_FUZZ");
  if (!fuzz.engine) {
    if (!format) return fprintf(stderr, "fuzz: RAYFOLD_FUZZ=obj names the format\n"), exit(64), 0;
    fuzz_begin(&fuzz, format);
    atexit(finish);
  }
  fuzz_one(&fuzz, data, size, &text);
  return 0;
}
