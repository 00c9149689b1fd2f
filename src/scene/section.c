// See kinds.h, its second half: sections of a scene walked without knowing their types, and the references between
// them kept right when elements come and go.

#include "scene/kinds.h"

#include "base/mem.h"
#include "scene/json.h"

#include <string.h>

#define ONE(g, member)                                 \
  {                                                    \
    &g, SECTION_ONE, offsetof(Scene, member), false, 0 \
  }
#define ONE_GIVEN(g, member)                                                      \
  {                                                                               \
    &g, SECTION_ONE, offsetof(Scene, member), true, offsetof(Scene, has_##member) \
  }
#define MANY(g, form, member)                   \
  {                                             \
    &g, form, offsetof(Scene, member), false, 0 \
  }

const Section scene_sections[SECTION_COUNT] = {
    ONE(group_about, about),
    ONE(group_render, render),
    ONE(group_whitted, whitted),
    ONE(group_develop, develop),
    ONE_GIVEN(group_camera, camera),
    MANY(group_cameras, SECTION_BY_NAME, cameras),
    ONE_GIVEN(group_sky, sky),
    MANY(group_skies, SECTION_BY_NAME, skies),
    MANY(group_cell, SECTION_BY_NAME, cells),
    MANY(group_gate, SECTION_BY_NAME, gates),
    MANY(group_texture, SECTION_BY_NAME, textures),
    MANY(group_material, SECTION_BY_NAME, materials),
    MANY(group_medium, SECTION_BY_NAME, media),
    MANY(group_object, SECTION_LIST, objects),
    MANY(group_light, SECTION_LIST, lights),
    ONE(group_timeline, timeline),
    MANY(group_track, SECTION_LIST, tracks), // last: its paths lead to all the others
};

// Any ARRAY(Type), copied in and out as bytes because its pointer's type differs.
typedef struct AnyArray {
  void *items;
  size_t count, capacity;
} AnyArray;

static AnyArray get_array(const Scene *s, const Section *c)
{
  AnyArray a;
  memcpy(&a, (const char *)s + c->offset, sizeof a);
  return a;
}

static void put_array(Scene *s, const Section *c, const AnyArray *a)
{
  memcpy((char *)s + c->offset, a, sizeof *a);
}

const Section *section_find(const char *name)
{
  for (int i = 0; i < SECTION_COUNT; i++)
    if (!strcmp(scene_sections[i].group->name, name)) return &scene_sections[i];
  return NULL;
}

size_t section_count(const Scene *s, const Section *c)
{
  return c->form == SECTION_ONE ? 1 : get_array(s, c).count;
}

void *section_at(const Scene *s, const Section *c, size_t i)
{
  if (c->form == SECTION_ONE) return (char *)(size_t)s + c->offset;
  char *items = get_array(s, c).items;
  return items ? items + i * c->group->size : NULL; // of an empty section there is no address, not even the first
}

bool *section_given(const Scene *s, const Section *c)
{
  return c->has_given ? (bool *)((char *)(size_t)s + c->given_offset) : NULL;
}

// --- references -----------------------------------------------------------------------------------
const Section *section_of_reference(FieldType type)
{
  if (type == FIELD_texture) return section_find(group_texture.name);
  if (type == FIELD_material) return section_find(group_material.name);
  if (type == FIELD_medium) return section_find(group_medium.name);
  if (type == FIELD_sky) return section_find(group_skies.name);
  if (type == FIELD_cell) return section_find(group_cell.name);
  if (type == FIELD_gate) return section_find(group_gate.name);
  return type == FIELD_object ? section_find(group_object.name) : NULL;
}

// References at or behind `from` move by `by`.
static void shift_in(const Group *g, void *object, const Section *to, int32_t from, int32_t by)
{
  const Field *f;
  void *at;
  for (size_t i = 0; (f = group_field_at(g, object, i, &at)); i++)
    if (section_of_reference(f->type) == to && *(int32_t *)at >= from) *(int32_t *)at += by;
  if (g->nested) shift_in(g->nested, group_nested(g, object), to, from, by);
}

static void shift_slots(Scene *s, int32_t from, int32_t by)
{
  for (size_t i = 0; i < s->meshes.count; i++)
    for (size_t k = 0; k < s->meshes.items[i].slot_count; k++) {
      int32_t *slot = &s->meshes.items[i].slots[k];
      if (by < 0 && *slot == from + by)
        *slot = -1;
      else if (*slot >= from)
        *slot += by;
    }
}

static bool is_referred_to(const Section *c)
{
  return c->group == &group_texture || c->group == &group_material || c->group == &group_medium ||
         c->group == &group_object || c->group == &group_skies || c->group == &group_cell || c->group == &group_gate;
}

static void shift_references(Scene *s, const Section *to, int32_t from, int32_t by)
{
  if (!is_referred_to(to)) return;
  for (int i = 0; i < SECTION_COUNT; i++) {
    const Section *c = &scene_sections[i];
    for (size_t k = 0; k < section_count(s, c); k++) shift_in(c->group, section_at(s, c, k), to, from, by);
  }
  if (to->group == &group_material) shift_slots(s, from, by);
}

bool section_insert(Scene *s, const Section *c, size_t i, const void *element)
{
  AnyArray a = get_array(s, c);
  const size_t size = c->group->size;
  if (a.count >= INT32_MAX) return false;
  if (a.count == a.capacity && !array_grow_to(&a.items, a.count, &a.capacity, a.count + 1, size))
    return false;
  char *at = (char *)a.items + i * size;
  memmove(at + size, at, (a.count - i) * size);
  memcpy(at, element, size);
  if (c->group == &group_object && !((Object *)(void *)at)->id) ((Object *)(void *)at)->id = ++s->last_id;
  const bool is_last = i == a.count++;
  put_array(s, c, &a);
  if (is_last) return true;
  section_names_changed(s, c);
  shift_references(s, c, (int32_t)i, 1);
  return true;
}

void section_remove(Scene *s, const Section *c, size_t i)
{
  AnyArray a = get_array(s, c);
  const size_t size = c->group->size;
  char *at = (char *)a.items + i * size;
  memmove(at, at + size, (a.count - i - 1) * size);
  a.count--;
  put_array(s, c, &a);
  section_names_changed(s, c);
  shift_references(s, c, (int32_t)i + 1, -1);
}

static bool refers_to(const Group *g, const void *object, const Section *to, int32_t index)
{
  const Field *f;
  void *at;
  for (size_t i = 0; (f = group_field_at(g, object, i, &at)); i++)
    if (section_of_reference(f->type) == to && *(int32_t *)at == index) return true;
  return g->nested && refers_to(g->nested, group_nested(g, object), to, index);
}

static bool mesh_uses(const Scene *s, int32_t mesh_i, int32_t material_i)
{
  if (mesh_i < 0) return false;
  const Mesh *m = &s->meshes.items[mesh_i];
  for (size_t k = 0; k < m->slot_count; k++)
    if (m->slots[k] == material_i) return true;
  return false;
}

bool section_user(const Scene *s, const Section *to, size_t index, Text *who)
{
  if (!is_referred_to(to)) return false;
  for (int i = 0; i < SECTION_COUNT; i++) {
    const Section *c = &scene_sections[i];
    for (size_t k = 0; k < section_count(s, c); k++) {
      const void *e = section_at(s, c, k);
      const bool by_mesh = c->group == &group_object && to->group == &group_material &&
                           mesh_uses(s, ((const Object *)e)->shape.mesh_i, (int32_t)index);
      if (!by_mesh && !refers_to(c->group, e, to, (int32_t)index)) continue;
      section_path(s, c, k, who);
      return true;
    }
  }
  return false;
}

static bool is_plain(const char *name)
{
  if (!*name) return false;
  for (const char *p = name; *p; p++)
    if (!((*p >= 'a' && *p <= 'z') || (*p >= 'A' && *p <= 'Z') || (*p >= '0' && *p <= '9') || *p == '_' ||
          *p == '-'))
      return false;
  return true;
}

void section_path(const Scene *s, const Section *c, size_t i, Text *out)
{
  text_add(out, "%s", c->group->name);
  if (c->form == SECTION_ONE) return;
  const char *name = *group_name(c->group, section_at(s, c, i));
  // A name that stands twice in a list reaches the first only.
  if (c->form == SECTION_LIST && (!name || section_index(s, c, name) != (int32_t)i)) {
    text_add(out, "[%zu]", i);
    return;
  }
  text_add(out, ".");
  if (is_plain(name))
    text_add(out, "%s", name);
  else
    js_put_text(out, name);
}
