// Names of a scene's things: found whatever edits went before, kept apart, and all that in a time that grows with
// their number, not with its square.

#include "tests/test.h"

#include "base/hash.h"
#include "base/mem.h"
#include "scene/edit.h"
#include "scene/kinds.h"

#include <time.h>

enum { MANY = 200000 };
// Of processor time. Each takes under half a second in release; comparing all with all would take a minute and more.
#define MOST_SECONDS 15

static double seconds(void)
{
  return (double)clock() / CLOCKS_PER_SEC;
}

static int compare_texts(const void *a, const void *b)
{
  return strcmp(*(const char *const *)a, *(const char *const *)b);
}

static void check_all_different(const Scene *s)
{
  const size_t n = s->materials.count;
  const char **names = mem_alloc(n, sizeof *names);
  for (size_t i = 0; i < n; i++) names[i] = s->materials.items[i].name;
  qsort(names, n, sizeof *names, compare_texts);
  size_t equal = 0;
  for (size_t i = 1; i < n; i++) equal += !strcmp(names[i - 1], names[i]);
  CHECK_MSG(equal == 0, "%zu of %zu names are not the only ones", equal, n);
  mem_free(names);
}

TEST(equal_names_get_numbers)
{
  static const char *const wanted[] = {"m", "m.3", "m", "m", "m", "m.3", NULL, "", "material.2", NULL};
  static const char *const given[] = {"m",     "m.3",      "m.2",        "m.4",          "m.5",
                                      "m.3.2", "material", "material.2", "material.2.2", "material.3"};
  Scene *s = scene_create(NULL);
  for (size_t i = 0; i < sizeof wanted / sizeof *wanted; i++) {
    CHECK(scene_add_material(s, MATERIAL_PBR, wanted[i]) == (int32_t)i);
    CHECK_MSG(!strcmp(s->materials.items[i].name, given[i]), "%s, not %s", s->materials.items[i].name,
              given[i]);
  }
  CHECK(scene_find_material(s, "m.5") == 4 && scene_find_material(s, "m.6") == -1);
  CHECK(scene_add_texture(s, TEXTURE_IMAGE, "m") == 0 && !strcmp(s->textures.items[0].name, "m"));
  scene_destroy(s);
}

TEST(names_fit_into_a_scene_file)
{
  char name[6000];
  Scene *s = scene_create(NULL);
  for (int lead = 0; lead < 3; lead++) { // three bytes a character, cut at each of them
    memset(name, 'x', 3);
    for (int i = lead; i + 3 < 5900; i += 3) memcpy(name + i, "\xe2\x82\xac", 4);
    for (int k = 0; k < 3; k++) scene_add_material(s, MATERIAL_PBR, name);
  }
  for (size_t i = 0; i < s->materials.count; i++) {
    const char *cut = s->materials.items[i].name;
    const size_t n = strlen(cut), plain = strcspn(cut, ".");
    CHECK_MSG(n <= 4096 && n > 4000, "%zu bytes", n);
    CHECK((plain - i / 3) % 3 == 0); // whole characters
  }
  check_all_different(s);
  scene_destroy(s);
}

TEST(many_names_take_linear_time)
{
  for (int kind = 0; kind < 4; kind++) {
    const double start = seconds();
    Scene *s = scene_create(NULL);
    for (int i = 0; i < MANY; i++) {
      char name[40];
      // All alike; none; all different; two of each.
      snprintf(name, sizeof name, "%d", kind == 3 ? i / 2 : i);
      CHECK(scene_add_material(s, MATERIAL_PBR, kind == 0 ? "m" : kind == 1 ? NULL : name) == i);
    }
    for (int32_t i = 0; i < MANY; i += 7) CHECK(scene_find_material(s, s->materials.items[i].name) == i);
    CHECK_MSG(seconds() - start < MOST_SECONDS, "kind %d: %.1f s", kind, seconds() - start);
    check_all_different(s);
    scene_destroy(s);
  }
}

// --- after edits ----------------------------------------------------------------------------------
static int32_t look(const Scene *s, const char *name)
{
  for (size_t i = 0; i < s->materials.count; i++)
    if (!strcmp(s->materials.items[i].name, name)) return (int32_t)i;
  return -1;
}

static void check_found(const Scene *s, int step)
{
  for (int n = 0; n < 12; n++) {
    char name[20];
    snprintf(name, sizeof name, n < 8 ? "n%d" : "n%d.2", n % 8);
    CHECK_MSG(scene_find_material(s, name) == look(s, name), "step %d: %s is %d, not %d", step, name,
              (int)scene_find_material(s, name), (int)look(s, name));
  }
  const Section *objects = section_find("objects");
  for (size_t i = 0; i < s->objects.count; i++) {
    const int32_t first = section_index(s, objects, s->objects.items[i].name);
    CHECK(!s->objects.items[i].name ? first == -1
                                    : first >= 0 && (size_t)first <= i &&
                                          !strcmp(s->objects.items[first].name, s->objects.items[i].name));
  }
}

static void edit_at_random(Scene *s, History *h, int step)
{
  const uint32_t r = hash_u32((uint32_t)step), a = r >> 8 & 7, b = r >> 12 & 7;
  char path[60], json[60];
  snprintf(path, sizeof path, "materials.n%u", a);
  snprintf(json, sizeof json, "\"n%u\"", b);
  switch (r % 8) {
  case 0: (void)history_set(h, s, path, "{\"kind\": \"mirror\"}", NULL); break;
  case 1: (void)history_set(h, s, path, "null", NULL); break;
  case 2: strcat(path, ".name"), (void)history_set(h, s, path, json, NULL); break;
  case 3: (void)history_undo(h, s, NULL); break;
  case 4: (void)history_redo(h, s, NULL); break;
  case 5: (void)scene_add_material(s, MATERIAL_PBR, path + 10); break;
  case 6: (void)scene_add_object(s, SHAPE_SPHERE, a ? path + 10 : NULL); break;
  case 7:
    snprintf(path, sizeof path, "objects[%u]", b);
    (void)history_set(h, s, path, a & 1 ? "null" : "{\"name\": \"n3\", \"shape\": {\"kind\": \"disk\"}}",
                      NULL);
    break;
  }
}

TEST(names_are_found_whatever_was_edited)
{
  Scene *s = scene_create(NULL);
  History h = {0};
  for (int step = 0; step < 4000; step++) {
    edit_at_random(s, &h, step);
    if (hash_u32((uint32_t)step + 77) % 3)
      check_found(s, step); // not always, so that some changes go unasked
  }
  CHECK(s->objects.count > 5);
  history_finish(&h);
  scene_destroy(s);
}

TEST(names_are_found_without_memory_too)
{
  Scene *s = scene_create(NULL);
  for (int i = 0; i < 50; i++) scene_add_object(s, SHAPE_SPHERE, i % 2 ? "odd" : "even");
  const Section *objects = section_find("objects");
  for (long n = 1; n < 4; n++) {
    mem_fail_after(n);
    CHECK(section_index(s, objects, "odd") == 1 && section_index(s, objects, "none") == -1);
    mem_fail_after(0);
  }
  CHECK(section_index(s, objects, "even") == 0);
  scene_destroy(s);
}

TEST_MAIN
