// See mem.h. The failure counter is the one global of the library: it is a test hook, off in normal use.

#include "base/mem.h"

#include <stdatomic.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

enum { MEM_ALIGN = 64, HUGE_PAGE = 2 << 20 };

static atomic_long fail_after; // 0: never; 1: now; n: in n - 1 allocations

void mem_fail_after(long n) { atomic_store(&fail_after, n); }

static bool must_fail(void)
{
  const long n = atomic_load_explicit(&fail_after, memory_order_relaxed);
  if (n == 0) return false;
  if (n > 1) atomic_fetch_sub(&fail_after, 1);
  return n <= 1;
}

void *mem_alloc(size_t count, size_t size)
{
  size_t bytes;
  if (!size_mul(count, size, &bytes) || bytes > PTRDIFF_MAX - HUGE_PAGE || must_fail()) return NULL;
  // Large blocks ask for 2 MiB pages: tree traversal is bound by address translation otherwise.
  const size_t align = bytes >= 2 * (size_t)HUGE_PAGE ? HUGE_PAGE : MEM_ALIGN;
  bytes = (bytes + MEM_ALIGN - 1) & ~(size_t)(MEM_ALIGN - 1);
  if (!bytes) bytes = MEM_ALIGN;
  void *block = NULL;
  if (posix_memalign(&block, align, bytes)) return NULL;
  if (align == HUGE_PAGE) (void)madvise(block, bytes & ~(size_t)(HUGE_PAGE - 1), MADV_HUGEPAGE);
  return block;
}

void *mem_zero(size_t count, size_t size)
{
  void *block = mem_alloc(count, size);
  if (block) memset(block, 0, count * size);
  return block;
}

void *mem_resize(void *block, size_t old_count, size_t count, size_t size)
{
  size_t bytes;
  if (!size_mul(count, size, &bytes)) return NULL;
  void *grown = mem_alloc(count, size);
  if (!grown) return NULL;
  if (block) memcpy(grown, block, (old_count < count ? old_count : count) * size);
  free(block);
  return grown;
}

void mem_free(void *block) { free(block); }
