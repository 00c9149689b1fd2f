// The texts made from the tables: the schema is JSON that knows every field, and the manual in docs is the one that
// this build makes.

#include "tests/test.h"

#include "scene/json.h"
#include "scene/pages.h"
#include "tests/scene_sample.h"

// The schema of one kind: the one of oneOf whose "kind" is this, or the group's own.
static const Json *kind_schema(const Json *defs, const Group *g, const Kind *k)
{
  const Json *group = js_get(defs, g->name), *list = js_get(group, "oneOf");
  if (!g->has_kind) return group;
  for (size_t i = 0; i < js_count(list); i++) {
    const Json *kind = js_get(js_get(js_at(list, i), "properties"), "kind");
    if (text_equal(js_text(js_get(kind, "const")), k->name)) return js_at(list, i);
  }
  return NULL;
}

static void check_fields(const Json *schema, const Field *fields, size_t count)
{
  for (size_t i = 0; i < count; i++) {
    const Json *f = js_get(js_get(schema, "properties"), fields[i].name);
    CHECK_MSG(js_text(js_get(f, "description")), "%s is missing", fields[i].name);
    if (fields[i].type == FIELD_real && fields[i].high < (double)NO_LIMIT)
      CHECK_NEAR(js_number(js_get(f, "maximum"), -1), fields[i].high, 1e-6 * fields[i].high);
  }
}

static void check_group(const Json *defs, const Group *g)
{
  for (size_t k = 0; k < g->kind_count; k++) {
    const Json *schema = kind_schema(defs, g, &g->kinds[k]);
    CHECK_MSG(js_kind(js_get(schema, "additionalProperties")) == JSON_BOOL, "%s %s", g->name,
              g->kinds[k].name);
    check_fields(schema, g->common, g->common_count);
    check_fields(schema, g->kinds[k].fields, g->kinds[k].field_count);
  }
  if (g->nested) check_group(defs, g->nested);
}

TEST(schema_knows_every_field)
{
  Text out = {0};
  Err err = {0};
  CHECK(scene_schema(&out));
  JsonDoc *doc = js_parse(text_get(&out), out.length, "schema", &err);
  CHECK_MSG(doc, "%s", err.text);
  if (doc) {
    CHECK(
        text_equal(js_text(js_get(js_root(doc), "$schema")), "https://json-schema.org/draft/2020-12/schema"));
    for (int i = 0; i < SECTION_COUNT; i++)
      check_group(js_get(js_root(doc), "$defs"), scene_sections[i].group);
  }
  js_free(doc);
  text_finish(&out);
}

TEST(manual_in_docs_is_the_one_made_here)
{
  Text out = {0};
  FileBytes file;
  Err err = {0};
  CHECK(scene_manual(&out));
  CHECK_MSG(file_read(&file, "docs/scene.md", &err), "%s", err.text);
  CHECK_MSG(file.size == out.length && !memcmp(file.data, text_get(&out), out.length),
            "docs/scene.md is old: run `rayfold manual > docs/scene.md`");
  file_release(&file);
  text_finish(&out);
}

TEST(example_of_the_manual_is_read)
{
  Text out = {0};
  Err err;
  CHECK(scene_manual(&out));
  const char *start = strstr(text_get(&out), "```json\n"), *end = start ? strstr(start + 8, "```\n") : NULL;
  CHECK(end);
  if (end) {
    Scene *s = sample_load_n(start + 8, (size_t)(end - start - 8), &err);
    CHECK_MSG(s && s->objects.count == 2, "%s", err.text);
    scene_destroy(s);
  }
  text_finish(&out);
}

TEST(info_counts_and_measures)
{
  Err err;
  sample_write("part.json", sample_scene, strlen(sample_scene));
  Scene *s =
      sample_load("{\"rayfold\":1,\"objects\":["
                  "{\"shape\":{\"kind\":\"mesh\",\"file\":\"part.json\"},\"translate\":[10,0,0]},"
                  "{\"shape\":{\"kind\":\"mesh\",\"file\":\"part.json\"}},{\"shape\":{\"kind\":\"disk\"}}]}",
                  &err);
  Text out = {0};
  CHECK_MSG(s, "%s", err.text);
  if (s) CHECK(scene_info(s, &out));
  CHECK_TEXT(text_get(&out), "objects    3: 2 mesh, 1 disk\n");
  CHECK_TEXT(text_get(&out), "triangles  2 shown, 1 stored (0.0 MB)\n");
  CHECK_TEXT(text_get(&out), "shapes     5 shown\n");
  CHECK_TEXT(text_get(&out), "models     1\n");
  CHECK_TEXT(text_get(&out), "bounds     -1 -1 -0.5 to 14 6 6 m\n");
  scene_destroy(s);
  text_finish(&out);
}

TEST(clean_up)
{
  sample_remove();
}

TEST_MAIN
