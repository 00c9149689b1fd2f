// Checked allocation: sizes are products of counts that came from files, so every multiplication is checked here
// and nowhere else. All of it may return NULL. Freed with mem_free().

#ifndef RAYFOLD_BASE_MEM_H
#define RAYFOLD_BASE_MEM_H

#include <stdbool.h>
#include <stddef.h>

// count * size bytes, 64-byte aligned, not cleared. NULL on overflow, on no memory, and never for zero bytes.
void *mem_alloc(size_t count, size_t size);
void *mem_zero(size_t count, size_t size); // the same, cleared

// Grows or shrinks to count * size bytes, keeping the content; NULL leaves the old block as it was.
void *mem_resize(void *block, size_t old_count, size_t count, size_t size);
void mem_free(void *block); // accepts NULL

// a * b and a + b in *out; false on overflow.
static inline bool size_mul(size_t a, size_t b, size_t *out) { return !__builtin_mul_overflow(a, b, out); }
static inline bool size_add(size_t a, size_t b, size_t *out) { return !__builtin_add_overflow(a, b, out); }

// For tests: the n-th allocation from now fails (1 = the next one), and all after it; 0 switches that off.
void mem_fail_after(long n);

#endif
