// Saved models made whole again after a test or the fuzzer has changed them: each checksum is computed anew, as whoever
// wants to do harm would.

#ifndef RAYFOLD_TESTS_SEAL_H
#define RAYFOLD_TESTS_SEAL_H

#include "scene/rfm.h"

#include <string.h>

static inline RfmSection *seal_sections(void *file)
{
  return (RfmSection *)(void *)((char *)file + sizeof(RfmHead));
}

// What cannot be made whole stays as it is.
static inline void seal(void *file, size_t size)
{
  RfmHead *head = file;
  if (size < sizeof *head) return;
  const size_t most = (size - sizeof *head) / sizeof(RfmSection);
  if (head->section_count > most) head->section_count = (uint32_t)most;
  for (size_t i = 0; i < head->section_count; i++) {
    RfmSection *s = &seal_sections(file)[i];
    if (s->offset <= size && s->size <= size - s->offset) s->hash = rfm_hash((char *)file + s->offset, s->size);
  }
  memcpy(head->magic, RFM_MAGIC, sizeof head->magic);
  head->byte_order = RFM_BYTE_ORDER;
  head->version = RFM_VERSION;
  head->file_size = size;
  head->hash = rfm_hash_head(head, seal_sections(file));
}

// The n-th section of a kind, NULL if there are fewer.
static inline RfmSection *seal_find(void *file, RfmKind kind, int n)
{
  const RfmHead *head = file;
  for (size_t i = 0; i < head->section_count; i++)
    if (seal_sections(file)[i].kind == kind && n-- == 0) return &seal_sections(file)[i];
  return NULL;
}

static inline void *seal_bytes(void *file, RfmKind kind)
{
  const RfmSection *s = seal_find(file, kind, 0);
  return s ? (char *)file + s->offset : NULL;
}

#endif
