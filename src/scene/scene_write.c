// Writes the scene file: canonical JSON, made compact by the tables first and laid out afterwards. One text only;
// scene_save.c adds the files that bulk data needs.

#include "scene/element.h"
#include "scene/rfm.h"

#include <stdint.h>

static void write_by_name(const Scene *s, const Section *c, size_t mesh_limit, Text *out, bool *is_finite)
{
  text_add(out, "{");
  for (size_t i = 0; i < section_count(s, c); i++) {
    const void *e = section_at(s, c, i);
    if (i) text_add(out, ",");
    js_put_text(out, *group_name(c->group, e));
    text_add(out, ":");
    element_write(s, c->group, e, false, mesh_limit, out, is_finite);
  }
  text_add(out, "}");
}

// An object squeezed flat (importers meet such) cannot be seen and would not be read back.
static bool is_sound(const Section *c, const void *element)
{
  return c->group != &group_object || element_check(c->group, element, NULL, NULL);
}

static void write_list(const Scene *s, const Section *c, size_t mesh_limit, Text *out, bool *is_finite)
{
  text_add(out, "[");
  for (size_t i = 0, written = 0; i < section_count(s, c); i++) {
    if (!is_sound(c, section_at(s, c, i))) continue;
    if (written++) text_add(out, ",");
    element_write(s, c->group, section_at(s, c, i), true, mesh_limit, out, is_finite);
  }
  text_add(out, "]");
}

static bool is_written(const Scene *s, const Section *c)
{
  if (c->form != SECTION_ONE) return section_count(s, c) > 0;
  if (section_given(s, c)) return *section_given(s, c);
  const Field *f;
  void *at;
  for (size_t i = 0; (f = group_field_at(c->group, section_at(s, c, 0), i, &at)); i++)
    if (!value_is_default(f, at)) return true;
  return false;
}

static void write_section(const Scene *s, const Section *c, size_t mesh_limit, Text *out, bool *is_finite)
{
  switch (c->form) {
  case SECTION_ONE:
    element_write(s, c->group, section_at(s, c, 0), false, mesh_limit, out, is_finite);
    return;
  case SECTION_BY_NAME: write_by_name(s, c, mesh_limit, out, is_finite); return;
  case SECTION_LIST: write_list(s, c, mesh_limit, out, is_finite); return;
  }
}

static bool check_embedded(const Scene *s, Err *err)
{
  for (size_t i = 0; i < s->textures.count; i++) {
    const Texture *t = &s->textures.items[i];
    if (t->kind == TEXTURE_IMAGE && !t->image.file && t->embedded)
      return err_set(
          err, ERR_BAD_SCENE,
          "texture \"%.100s\" lies inside a model file; save the scene to a file, so that the picture can be "
          "written beside it",
          t->name);
  }
  return true;
}

// Meshes of more triangles than mesh_limit are written as "mesh": N.
static bool write_scene(const Scene *s, size_t mesh_limit, Text *out, Err *err)
{
  Text compact = {0};
  bool is_finite = true;
  text_add(&compact, "{\"rayfold\":1");
  for (int i = 0; i < SECTION_COUNT; i++) {
    const Section *c = &scene_sections[i];
    if (!is_written(s, c)) continue;
    text_add(&compact, ",\"%s\":", c->group->name);
    write_section(s, c, mesh_limit, &compact, &is_finite);
  }
  text_add(&compact, "}");
  bool ok = true;
  if (!is_finite) {
    ok = err_set(err, ERR_BAD_SCENE,
                 "the scene holds numbers that are infinite or not numbers, which JSON cannot hold");
  } else {
    js_layout(out, text_get(&compact));
    if (compact.failed || out->failed) ok = err_memory(err, "the scene's text", compact.length * 2);
  }
  text_finish(&compact);
  return ok;
}

bool scene_write(const Scene *s, Text *out, Err *err)
{
  return check_embedded(s, err) && write_scene(s, SIZE_MAX, out, err);
}

bool scene_write_linked(const Scene *s, Text *out, Err *err)
{
  return write_scene(s, 0, out, err);
}
