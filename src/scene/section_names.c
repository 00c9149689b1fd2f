// See kinds.h: elements of a section found by name, and names that are not taken yet. Files may hold hundreds of
// thousands of names, so each list of a scene keeps a table of them, made when first asked and brought up to date when asked
// again: elements only ever join at the end, and whoever else changes names says so, which makes the table anew at
// the next question. When memory for a table is out, all elements are compared, which is slow and right.

#include "scene/value.h"

#include "base/hash.h"
#include "base/mem.h"
#include "base/table.h"

#include <stdio.h>
#include <string.h>

typedef struct ListNames {
  Table elements; // hash of a name -> the first element of that name
  size_t known;   // so many elements of the list are in it
  Table suffixes; // hash of a wanted name that was taken -> the number to try next
} ListNames;

enum { MODELS = SECTION_COUNT, LIST_COUNT };
struct SceneNames {
  ListNames lists[LIST_COUNT]; // the sections, and the models by their files
};

// An array whose elements begin with their name.
typedef struct List {
  const char *items;
  size_t count, size;
} List;

static List section_list(const Scene *s, const Section *c)
{
  return (List){section_at(s, c, 0), section_count(s, c), c->group->size};
}

static const char *name_at(const List *l, size_t i)
{
  return *(const char *const *)(const void *)(l->items + i * l->size);
}

static uint64_t key_of(const char *name)
{
  return hash_bytes(0, name, strlen(name));
}

static int32_t find_by_table(const List *l, const ListNames *n, const char *name)
{
  size_t step = 0;
  for (const int32_t *i; (i = table_next(&n->elements, key_of(name), &step));)
    if (text_equal(name_at(l, (size_t)*i), name)) return *i;
  return -1;
}

static int32_t find_by_looking(const List *l, const char *name)
{
  for (size_t i = 0; i < l->count; i++)
    if (text_equal(name_at(l, i), name)) return (int32_t)i;
  return -1;
}

// Enters what has joined since the last time; false when memory is out.
static bool catch_up(const List *l, ListNames *n)
{
  for (; n->known < l->count; n->known++) {
    const char *name = name_at(l, n->known);
    if (!name || find_by_table(l, n, name) >= 0) continue;
    if (!table_add(&n->elements, key_of(name), (int32_t)n->known)) return false;
  }
  return true;
}

static int32_t find(const Scene *s, const List *l, int which, const char *name)
{
  // The tables are a cache: asking changes nothing that can be seen.
  if (!s->names) ((Scene *)(uintptr_t)s)->names = mem_zero(1, sizeof *s->names);
  ListNames *n = s->names ? &s->names->lists[which] : NULL;
  return n && catch_up(l, n) ? find_by_table(l, n, name) : find_by_looking(l, name);
}

static int which_section(const Section *c)
{
  return (int)(c - scene_sections);
}

int32_t section_index(const Scene *s, const Section *c, const char *name)
{
  if (c->form == SECTION_ONE || !name) return -1;
  const List l = section_list(s, c);
  return find(s, &l, which_section(c), name);
}

int32_t scene_find_model(const Scene *s, const char *file)
{
  const List l = {(const char *)s->models.items, s->models.count, sizeof(Model)};
  return find(s, &l, MODELS, file);
}

void section_names_changed(Scene *s, const Section *c)
{
  if (!s->names) return;
  ListNames *n = &s->names->lists[which_section(c)];
  table_clear(&n->elements);
  table_clear(&n->suffixes);
  n->known = 0;
}

void section_names_finish(Scene *s)
{
  for (int i = 0; s->names && i < LIST_COUNT; i++) {
    table_finish(&s->names->lists[i].elements);
    table_finish(&s->names->lists[i].suffixes);
  }
  mem_free(s->names);
  s->names = NULL;
}

// Where the number to try next after this name is kept; NULL when memory is out. Two names of one hash share it,
// which leaves out some numbers and does no harm.
static int32_t *suffix_of(ListNames *n, const char *name)
{
  size_t step = 0;
  const uint64_t key = key_of(name);
  int32_t *number = n ? table_next(&n->suffixes, key, &step) : NULL;
  if (number || !n || !table_add(&n->suffixes, key, 2)) return number;
  return table_next(&n->suffixes, key, &(size_t){0});
}

// So much of a name that it, and a number behind it, can be written to a scene file and read again, and whole
// characters of UTF-8.
static size_t kept_length(const char *name)
{
  enum { LONGEST_SUFFIX = 16 };
  size_t n = strnlen(name, LONGEST_TEXT - LONGEST_SUFFIX + 1);
  if (n <= LONGEST_TEXT - LONGEST_SUFFIX) return n;
  n--;
  while (n && (name[n] & 0xc0) == 0x80) n--;
  return n;
}

// A number is tried once for each wanted name, so a file of n equal names costs n tries in all.
const char *section_free_name(Scene *s, const Section *c, const char *wanted)
{
  if (!wanted || !*wanted) wanted = c->group->noun;
  wanted = arena_text_n(&s->arena, wanted, kept_length(wanted));
  if (!wanted || section_index(s, c, wanted) < 0) return wanted;
  int32_t first = 2, *number = suffix_of(s->names ? &s->names->lists[which_section(c)] : NULL, wanted);
  if (!number) number = &first;
  Text tried = {0};
  do {
    text_clear(&tried);
    text_add(&tried, "%s.%d", wanted, (int)(*number)++);
  } while (!tried.failed && section_index(s, c, text_get(&tried)) >= 0);
  const char *name = tried.failed ? NULL : arena_text(&s->arena, text_get(&tried));
  text_finish(&tried);
  return name;
}
