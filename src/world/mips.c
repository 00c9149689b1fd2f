// The mips of the world's pictures: parts of their own, since one picture may be colours here and data there. They are
// made level by level, each level of all pictures in strips on all threads, and shared with the worlds that follow.

#include "world/parts.h"

#include "base/hash.h"

enum { STRIPS = 16 }; // of a level: threads enough for one large picture

static void mips_part_release(MipsPart *part)
{
  if (!part || atomic_fetch_sub_explicit(&part->users, 1, memory_order_acq_rel) != 1) return;
  mips_finish(&part->mips);
  mem_free(part);
}

void parts_finish_mips(WorldParts *p)
{
  for (size_t i = 0; i < p->mips.count; i++) mips_part_release(p->mips.items[i]);
  array_finish(&p->mips);
  table_finish(&p->mips_found);
}

static MipsPart *mips_part_create(uint64_t key, int32_t image_i, MipsMeaning meaning)
{
  MipsPart *part = mem_zero(1, sizeof *part);
  if (!part) return NULL;
  atomic_init(&part->users, 1);
  part->key = key;
  part->image_i = image_i;
  part->meaning = meaning;
  return part;
}

static MipsPart *find_mips(const WorldParts *p, uint64_t key)
{
  size_t step = 0;
  const int32_t *i = p ? table_next(&p->mips_found, key, &step) : NULL;
  return i ? p->mips.items[*i] : NULL;
}

int32_t parts_add_mips(WorldParts *p, const WorldParts *previous, int32_t image_i, MipsMeaning meaning)
{
  const uint8_t bits[2] = {meaning.is_srgb, meaning.is_coverage};
  const uint64_t key = hash_bytes(p->images.items[image_i]->key, bits, sizeof bits);
  size_t step = 0;
  const int32_t *known = table_next(&p->mips_found, key, &step), next = (int32_t)p->mips.count;
  if (known) return *known;
  if (!array_reserve(&p->mips, p->mips.count + 1) || !table_add(&p->mips_found, key, next)) return -1;
  MipsPart *part = find_mips(previous, key);
  if (part)
    atomic_fetch_add_explicit(&part->users, 1, memory_order_relaxed);
  else
    part = mips_part_create(key, image_i, meaning);
  if (!part) return -1;
  array_push(&p->mips, part);
  return next;
}

typedef struct Making {
  WorldParts *parts;
  MipsPart **missing;
  uint32_t level;
} Making;

static void make_strip(void *user, size_t item, int worker)
{
  (void)worker;
  const Making *m = user;
  MipsPart *part = m->missing[item / STRIPS];
  if (m->level >= part->mips.count) return;
  const uint32_t height = part->mips.levels[m->level].height, strip = (uint32_t)(item % STRIPS);
  mips_rows(&part->mips, &m->parts->images.items[part->image_i]->image, part->meaning, m->level,
            height * strip / STRIPS, height * (strip + 1) / STRIPS);
}

bool parts_make_mips(WorldParts *p, Jobs *jobs, const Cancel *cancel, Err *err)
{
  size_t count = 0;
  Making m = {p, mem_alloc(p->mips.count ? p->mips.count : 1, sizeof *m.missing), 0};
  bool ok = m.missing;
  for (size_t i = 0; ok && i < p->mips.count; i++) {
    MipsPart *part = p->mips.items[i];
    if (part->is_made) continue;
    ok = mips_begin(&part->mips, &p->images.items[part->image_i]->image);
    m.missing[count++] = part;
  }
  if (!ok) err_set(err, ERR_NO_MEMORY, "not enough memory for the pictures' mips; set their \"minify\" to \"off\"");
  for (; ok && count && m.level < MIPS_MOST; m.level++)
    if (!jobs_run(jobs, count * STRIPS, make_strip, &m, cancel))
      ok = err_set(err, ERR_CANCELLED, "preparing was cancelled");
  for (size_t i = 0; ok && i < count; i++) m.missing[i]->is_made = true;
  mem_free(m.missing);
  return ok;
}
