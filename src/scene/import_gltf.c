// glTF 2.0 import: the entry. Opens .gltf or .glb (told apart by the first bytes), checks version and extensions, and
// has the gltf_*.c files add materials and nodes to the scene. What is not supported is named in the scene's notes;
// what a file says it cannot do without is an error. gltf.h lists the parts.

#include "scene/gltf.h"

#include <string.h>

// --- the container --------------------------------------------------------------------------------
//
//   'glTF' version length | length 'JSON' text... | length 'BIN\0' bytes... | other chunks, skipped
//
// All numbers are 32 bit, little-endian (section 4.4 of the specification).
#define GLB_MAGIC  0x46546c67u
#define CHUNK_JSON 0x4e4f534au
#define CHUNK_BIN  0x004e4942u

static uint32_t load_u32(const uint8_t *p)
{
  return (uint32_t)p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}

static bool find_chunks(Gltf *g, const uint8_t **json, size_t *json_size)
{
  const uint8_t *data = g->file.data;
  if (g->file.size < 20) return err_set(g->err, ERR_BAD_SCENE, "%s: the file is cut short", g->path);
  if (load_u32(data + 4) != 2)
    return err_set(g->err, ERR_BAD_SCENE,
                   "%s: this is version %u of GLB; only 2 is read; export the model again", g->path,
                   load_u32(data + 4));
  const size_t end = load_u32(data + 8);
  if (end > g->file.size)
    return err_set(g->err, ERR_BAD_SCENE, "%s: the file is cut short: %zu of %zu bytes are there", g->path,
                   g->file.size, end);
  size_t at = 12;
  for (size_t i = 0; end >= 8 && at <= end - 8; i++) {
    const size_t size = load_u32(data + at);
    const uint32_t type = load_u32(data + at + 4);
    at += 8;
    if (size > end - at)
      return err_set(g->err, ERR_BAD_SCENE, "%s: chunk %zu has %zu bytes, but only %zu are left", g->path, i,
                     size, end - at);
    if ((type == CHUNK_JSON) != (i == 0))
      return err_set(g->err, ERR_BAD_SCENE, "%s: the first chunk and no other must be JSON", g->path);
    if (type == CHUNK_JSON) {
      *json = data + at;
      *json_size = size;
    } else if (type == CHUNK_BIN && !g->bin) {
      g->bin = data + at;
      g->bin_size = size;
    }
    at += size;
    at += (4 - at % 4) % 4; // chunks begin at multiples of four; their sizes should say so already
  }
  return *json || err_set(g->err, ERR_BAD_SCENE, "%s: there is no JSON chunk", g->path);
}

static bool parse(Gltf *g)
{
  const uint8_t *json = NULL;
  size_t size = 0;
  if (g->file.size >= 4 && load_u32(g->file.data) == GLB_MAGIC) {
    if (!find_chunks(g, &json, &size)) return false;
    // Filled up to four bytes with blanks by the rules, and with zeros by some writers.
    while (size && !json[size - 1]) size--;
  } else {
    json = g->file.data;
    size = g->file.size;
    // A byte order mark is against the rules and common.
    if (size >= 3 && !memcmp(json, "\xef\xbb\xbf", 3)) json += 3, size -= 3;
  }
  g->doc = js_parse((const char *)json, size, g->path, g->err);
  if (!g->doc) return false;
  g->root = js_root(g->doc);
  return js_kind(g->root) == JSON_DICT || err_set(g->err, ERR_BAD_SCENE, "%s: this is no glTF file", g->path);
}

// --- version and extensions -----------------------------------------------------------------------
static bool check_version(Gltf *g)
{
  const Json *asset = js_get(g->root, "asset");
  const char *version = js_text(js_get(asset, "version")), *least = js_text(js_get(asset, "minVersion"));
  if (!version)
    return gltf_fail(g, g->root, "asset", "\"asset\" must give the \"version\" of glTF, as \"2.0\"");
  if (strncmp(version, "2.", 2))
    return gltf_fail(g, asset, "version", "this is glTF %.20s; only 2.0 is read; export the model again",
                     version);
  if (least && !text_equal(least, "2.0"))
    return gltf_fail(g, asset, "minVersion", "this file needs glTF %.20s; only 2.0 is read", least);
  return true;
}

typedef enum Support {
  SUPPORT_NONE, // not known
  SUPPORT_FULL,
  SUPPORT_PARTIAL, // named in notes where it is used; the picture is still worth having
  SUPPORT_DRACO,
  SUPPORT_MESHOPT,
} Support;

static Support support_of(const char *name)
{
  static const struct {
    const char *name;
    Support support;
  } known[] = {
      {"KHR_lights_punctual", SUPPORT_FULL},
      {"KHR_materials_clearcoat", SUPPORT_FULL},
      {"KHR_materials_emissive_strength", SUPPORT_FULL},
      {"KHR_materials_ior", SUPPORT_FULL},
      {"KHR_materials_specular", SUPPORT_FULL},
      {"KHR_materials_transmission", SUPPORT_FULL},
      {"KHR_materials_unlit", SUPPORT_FULL},
      {"KHR_materials_volume", SUPPORT_FULL},
      {"KHR_mesh_quantization", SUPPORT_FULL},
      {"KHR_texture_transform", SUPPORT_FULL},
      {"EXT_mesh_gpu_instancing", SUPPORT_FULL},
      {"EXT_texture_webp", SUPPORT_FULL},
      {"FB_ngon_encoding", SUPPORT_FULL}, // a hint which triangles were polygons
      {"KHR_xmp_json_ld", SUPPORT_FULL},  // says who made it, shows nothing
      {"KHR_materials_anisotropy", SUPPORT_PARTIAL},
      {"KHR_materials_diffuse_transmission", SUPPORT_PARTIAL},
      {"KHR_materials_dispersion", SUPPORT_PARTIAL},
      {"KHR_materials_iridescence", SUPPORT_PARTIAL},
      {"KHR_materials_pbrSpecularGlossiness", SUPPORT_PARTIAL},
      {"KHR_materials_sheen", SUPPORT_PARTIAL},
      {"KHR_materials_variants", SUPPORT_PARTIAL},
      {"KHR_texture_basisu", SUPPORT_PARTIAL},
      {"KHR_draco_mesh_compression", SUPPORT_DRACO},
      {"EXT_meshopt_compression", SUPPORT_MESHOPT},
  };
  for (size_t i = 0; i < sizeof known / sizeof *known; i++)
    if (text_equal(name, known[i].name)) return known[i].support;
  return SUPPORT_NONE;
}

static bool check_required(Gltf *g, const Json *list, size_t i)
{
  const char *name = js_text(js_at(list, i));
  if (!name)
    return gltf_fail(g, g->root, "extensionsRequired", "\"extensionsRequired\" must be a list of names");
  switch (support_of(name)) {
  case SUPPORT_FULL:
  case SUPPORT_PARTIAL: return true;
  case SUPPORT_DRACO:
    return js_fail(g->doc, list, NULL, i, false, g->err,
                   "this file is compressed with Draco, which is not supported; "
                   "unpack it with \"gltf-transform copy IN.glb OUT.glb\"");
  case SUPPORT_MESHOPT:
    return meshopt_is_built_in() ||
           js_fail(g->doc, list, NULL, i, false, g->err,
                   "this file is compressed with meshoptimizer, which this build "
                   "is without; install libmeshoptimizer-dev and build again, or unpack the file with "
                   "\"gltf-transform copy IN.glb OUT.glb\"");
  case SUPPORT_NONE:
    return js_fail(g->doc, list, NULL, i, false, g->err,
                   "this file cannot be shown without the extension \"%.60s\", "
                   "which is not supported; export the model without it",
                   name);
  }
  unreachable();
}

static bool check_extensions(Gltf *g)
{
  const Json *required = js_get(g->root, "extensionsRequired"), *used = js_get(g->root, "extensionsUsed");
  if (js_kind(required) == JSON_LIST)
    for (size_t i = 0; i < js_count(required); i++)
      if (!check_required(g, required, i)) return false;
  if (js_kind(used) == JSON_LIST)
    for (size_t i = 0; i < js_count(used); i++) {
      const char *name = js_text(js_at(used, i));
      if (name && support_of(name) == SUPPORT_NONE)
        note_once(&g->scene->notes, "%s: the extension %.60s is not known; what it adds is ignored", g->path,
                  name);
    }
  if (gltf_extension(g->root, "KHR_materials_variants"))
    note_once(&g->scene->notes, "KHR_materials_variants is not supported yet: the variants of %s are ignored",
              g->path);
  return true;
}

// --- the whole ------------------------------------------------------------------------------------
static void *zeros(Gltf *g, const char *list, size_t size)
{
  const size_t count = gltf_count(g, list);
  void *items = gltf_alloc(g, count, size, list);
  if (items) memset(items, 0, count * size);
  return items;
}

static bool prepare_lists(Gltf *g)
{
  g->buffers = zeros(g, "buffers", sizeof *g->buffers);
  g->views = zeros(g, "bufferViews", sizeof *g->views);
  g->images = zeros(g, "images", sizeof *g->images);
  g->meshes = zeros(g, "meshes", sizeof *g->meshes);
  return g->buffers && g->views && g->images && g->meshes;
}

bool import_gltf(Scene *s, const char *path, const LoadOptions *options, Err *err)
{
  Gltf g = {.scene = s, .path = path, .options = options, .err = err};
  bool ok = file_read(&g.file, path, err);
  g.read_size = g.file.size;
  ok = ok && parse(&g) && check_version(&g) && check_extensions(&g) && prepare_lists(&g);
  if (ok) {
    gltf_choose_light_scale(&g);
    ok = gltf_add_materials(&g) && gltf_add_nodes(&g);
  }
  if (ok && !s->objects.count) note_once(&s->notes, "%s: its scene shows no mesh", path);
  gltf_release_buffers(&g); // while the document still tells how many there are
  mem_free(g.images);
  mem_free(g.meshes);
  array_finish(&g.uses);
  array_finish(&g.deforms);
  table_finish(&g.uses_found);
  js_free(g.doc);
  file_release(&g.file);
  return ok;
}
