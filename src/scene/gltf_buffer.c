// Buffers and buffer views of a glTF file: where bytes lie, and that they are really there. Buffers are opened when
// first used. Files go through path_resolve(), the one door; nothing is fetched from a network.

#include "scene/gltf.h"

#include "scene/cache.h"
#include "scene/uri.h"

#include <string.h>

static bool open_file(Gltf *g, const Json *json, const char *uri, GltfBuffer *b)
{
  Text name = {0}, path = {0};
  const bool allow_outside = g->options && g->options->allow_outside;
  const char *root = g->options ? g->options->root : NULL;
  Err why = {0};
  bool ok = uri_decode_name(&name, uri, &why) &&
            path_resolve(&path, g->path, text_get(&name), root, allow_outside, &why) &&
            file_read(&b->file, text_get(&path), &why) &&
            (cache_add_content(g->scene, text_get(&path), &b->file, g->options) ||
             err_memory(&why, text_get(&path), 0));
  if (ok) {
    b->data = b->file.data;
    g->read_size += b->file.size;
  } else {
    gltf_fail(g, json, "uri", "a buffer cannot be had: %.500s", why.text);
    if (g->err && why.kind != ERR_NONE) g->err->kind = why.kind; // missing stays missing, no memory no memory
  }
  text_finish(&name);
  text_finish(&path);
  return ok;
}

// Fills b->data and *present, the bytes that are there.
static bool open_buffer(Gltf *g, size_t buffer_i, const Json *json, GltfBuffer *b, size_t *present)
{
  const char *uri = js_text(js_get(json, "uri"));
  if (js_get(json, "uri") && !uri) return gltf_fail(g, json, "uri", "\"uri\" must be a text");
  if (!uri) {
    if (buffer_i || !g->bin)
      return gltf_fail_item(g, "buffers", buffer_i,
                            "it has no data: neither a \"uri\" nor a binary chunk; export the model again");
    b->data = g->bin;
    *present = g->bin_size;
    return true;
  }
  if (uri_is_remote(uri))
    return gltf_fail(g, json, "uri",
                     "\"%.100s\" is a network address; download it beside the model and name the file", uri);
  if (!uri_is_data(uri)) {
    const bool ok = open_file(g, json, uri, b);
    *present = b->file.size;
    return ok;
  }
  Err why = {0};
  if (!uri_decode_data(uri, &b->decoded, present, &why)) return gltf_fail(g, json, "uri", "%s", why.text);
  b->data = b->decoded;
  return true;
}

static bool use_buffer(Gltf *g, size_t buffer_i, const GltfBuffer **out)
{
  GltfBuffer *b = &g->buffers[buffer_i];
  *out = b;
  if (b->data) return true;
  const Json *json = gltf_item(g, "buffers", buffer_i);
  size_t length, present = 0;
  if (!gltf_size(g, json, "byteLength", 0, &length) || !open_buffer(g, buffer_i, json, b, &present))
    return false;
  if (length > present)
    return gltf_fail(g, json, "byteLength",
                     "buffers[%zu] says it has %zu bytes, but only %zu are there; the file is "
                     "cut short",
                     buffer_i, length, present);
  b->size = length;
  return true;
}

// A dictionary's byteOffset and byteLength in a buffer.
static bool find_range(Gltf *g, const Json *dict, size_t view_i, GltfView *out)
{
  size_t buffer_i, offset, length, end;
  if (!gltf_index(g, dict, "buffer", "buffers", &buffer_i) || !gltf_size(g, dict, "byteOffset", 0, &offset) ||
      !gltf_size(g, dict, "byteLength", 0, &length))
    return false;
  if (buffer_i == GLTF_NONE) return gltf_fail_item(g, "bufferViews", view_i, "it names no buffer");
  const GltfBuffer *b;
  if (!use_buffer(g, buffer_i, &b)) return false;
  if (!size_add(offset, length, &end) || end > b->size)
    return gltf_fail(g, dict, "byteLength",
                     "bufferViews[%zu] takes bytes %zu to %zu, but buffers[%zu] has only %zu", view_i, offset,
                     offset + length, buffer_i, b->size);
  *out = (GltfView){b->data + offset, length, 0};
  return true;
}

// --- EXT_meshopt_compression ----------------------------------------------------------------------
static int choice_of(const char *name, const char *const *names, int count)
{
  for (int i = 0; i < count; i++)
    if (text_equal(name, names[i])) return i;
  return -1;
}

// What the extension allows; the library asserts it, so it is checked here.
static bool is_allowed(int mode, int filter, size_t count, size_t stride)
{
  if (mode < 0 || filter < 0 || !count || !stride) return false;
  if (mode != MESHOPT_ATTRIBUTES)
    return (stride == 2 || stride == 4) && filter == MESHOPT_NONE &&
           (mode != MESHOPT_TRIANGLES || count % 3 == 0);
  if (stride % 4 || stride > 256) return false;
  if (filter == MESHOPT_OCTAHEDRAL) return stride == 4 || stride == 8;
  return filter != MESHOPT_QUATERNION || stride == 8;
}

static bool decompress(Gltf *g, size_t view_i, const Json *packed, GltfView *out)
{
  static const char *const modes[] = {"ATTRIBUTES", "TRIANGLES", "INDICES"};
  static const char *const filters[] = {"NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL"};
  GltfView source;
  size_t count, stride, bytes;
  if (!find_range(g, packed, view_i, &source) || !gltf_size(g, packed, "count", 0, &count) ||
      !gltf_size(g, packed, "byteStride", 0, &stride))
    return false;
  const int mode = choice_of(js_text(js_get(packed, "mode")), modes, 3);
  const int filter = js_get(packed, "filter") ? choice_of(js_text(js_get(packed, "filter")), filters, 4) : 0;
  if (!is_allowed(mode, filter, count, stride))
    return gltf_fail(g, packed, "mode",
                     "bufferViews[%zu]: this mode, filter, count and byteStride do not go together", view_i);
  // A block of 256 equal bytes packs into 4 and nothing packs tighter, so a larger count is a lie.
  if (!size_mul(count, stride, &bytes) || bytes / 64 > source.size)
    return gltf_fail(g, packed, "count", "bufferViews[%zu]: %zu bytes cannot hold %zu compressed elements",
                     view_i, source.size, count);
  if (!g->views[view_i]) {
    uint8_t *data = gltf_alloc(g, count, stride, "compressed elements");
    if (!data) return false;
    g->views[view_i] = data;
    if (!meshopt_decode((MeshoptMode)mode, (MeshoptFilter)filter, source.data, source.size, count, stride,
                        data)) {
      mem_free(data);
      g->views[view_i] = NULL;
      return gltf_fail(g, packed, "mode",
                       "bufferViews[%zu]: the compressed data is broken; export the model again", view_i);
    }
  }
  *out = (GltfView){g->views[view_i], bytes, mode == MESHOPT_ATTRIBUTES ? stride : 0};
  return true;
}

// --- views ----------------------------------------------------------------------------------------
bool gltf_view(Gltf *g, size_t view_i, GltfView *out)
{
  const Json *json = gltf_item(g, "bufferViews", view_i);
  const Json *packed = gltf_extension(json, "EXT_meshopt_compression");
  if (packed && meshopt_is_built_in()) return decompress(g, view_i, packed, out);
  size_t stride;
  if (!find_range(g, json, view_i, out) || !gltf_size(g, json, "byteStride", 0, &stride)) return false;
  out->stride = stride;
  return true;
}

void gltf_release_buffers(Gltf *g)
{
  for (size_t i = 0; g->buffers && i < gltf_count(g, "buffers"); i++) {
    file_release(&g->buffers[i].file);
    mem_free(g->buffers[i].decoded);
  }
  for (size_t i = 0; g->views && i < gltf_count(g, "bufferViews"); i++) mem_free(g->views[i]);
  mem_free(g->buffers);
  mem_free(g->views);
}
