// See gltf_access.h. glTF 2.0, section 3.6.2. Data may lie unaligned in broken files, so it is loaded with memcpy(),
// which costs nothing where it is aligned.

#include "scene/gltf_access.h"

#include <string.h>

static size_t type_size(GltfType type)
{
  switch (type) {
  case GLTF_I8:
  case GLTF_U8: return 1;
  case GLTF_I16:
  case GLTF_U16: return 2;
  case GLTF_U32:
  case GLTF_F32: return 4;
  }
  return 0; // not one of the six
}

static bool is_index_type(GltfType type)
{
  return type == GLTF_U8 || type == GLTF_U16 || type == GLTF_U32;
}

static int width_of(const char *type)
{
  static const struct {
    const char *name;
    int width;
  } types[] = {{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT4", 16}};
  for (size_t i = 0; i < sizeof types / sizeof *types; i++)
    if (text_equal(type, types[i].name)) return types[i].width;
  return 0;
}

static bool read_type(Gltf *g, const Json *dict, GltfType *out)
{
  size_t number;
  if (!gltf_size(g, dict, "componentType", 0, &number)) return false;
  *out = (GltfType)(number < 10000 ? number : 0);
  return type_size(*out) ||
         gltf_fail(g, dict, "componentType", "a component type is one of 5120 to 5123, 5125 and 5126");
}

// Where count elements of element_size bytes begin in the view that dict names, all of them inside it.
static bool find_elements(Gltf *g, const Json *dict, size_t accessor_i, size_t count, size_t element_size,
                          const uint8_t **data, size_t *stride)
{
  size_t view_i, offset, last, end;
  GltfView view;
  if (!gltf_index(g, dict, "bufferView", "bufferViews", &view_i) ||
      !gltf_size(g, dict, "byteOffset", 0, &offset))
    return false;
  if (view_i == GLTF_NONE)
    return gltf_fail_item(g, "accessors", accessor_i, "a sparse part names no bufferView");
  if (!gltf_view(g, view_i, &view)) return false;
  *stride = view.stride ? view.stride : element_size;
  if (*stride < element_size)
    return gltf_fail(g, dict, "bufferView",
                     "accessors[%zu]: elements of %zu bytes do not fit bufferViews[%zu], whose "
                     "byteStride is %zu",
                     accessor_i, element_size, view_i, *stride);
  if (!size_mul(count - 1, *stride, &last) || !size_add(last, offset, &last) ||
      !size_add(last, element_size, &end) || end > view.size)
    return gltf_fail(g, dict, "bufferView",
                     "accessors[%zu]: %zu elements do not fit the %zu bytes of bufferViews[%zu]", accessor_i,
                     count, view.size, view_i);
  *data = view.data + offset;
  return true;
}

static size_t load_index(GltfType type, const uint8_t *data, size_t i)
{
  uint16_t u16;
  uint32_t u32;
  switch (type) {
  case GLTF_U8: return data[i];
  case GLTF_U16: memcpy(&u16, data + 2 * i, 2); return u16;
  default: memcpy(&u32, data + 4 * i, 4); return u32;
  }
}

static bool open_sparse(Gltf *g, const Json *json, size_t element_size, Accessor *a)
{
  const Json *sparse = js_get(json, "sparse"), *indices = js_get(sparse, "indices"),
             *values = js_get(sparse, "values");
  if (!sparse) return true;
  if (!gltf_size(g, sparse, "count", 0, &a->sparse_count)) return false;
  if (!a->sparse_count) return true;
  if (a->sparse_count > a->count)
    return gltf_fail(g, sparse, "count", "accessors[%zu]: more sparse elements than elements", a->index);
  size_t stride;
  if (!read_type(g, indices, &a->sparse_type)) return false;
  if (!is_index_type(a->sparse_type))
    return gltf_fail(g, indices, "componentType", "accessors[%zu]: sparse indices must be unsigned",
                     a->index);
  // Strides do not apply to sparse parts; a view that has one is refused by the stride check or read side by side.
  if (!find_elements(g, indices, a->index, a->sparse_count, type_size(a->sparse_type), &a->sparse_indices,
                     &stride) ||
      stride != type_size(a->sparse_type) ||
      !find_elements(g, values, a->index, a->sparse_count, element_size, &a->sparse_values, &stride) ||
      stride != element_size)
    return gltf_fail(g, json, "sparse", "accessors[%zu]: sparse parts must lie without gaps", a->index);
  for (size_t i = 0; i < a->sparse_count; i++)
    if (load_index(a->sparse_type, a->sparse_indices, i) >= a->count)
      return gltf_fail(g, json, "sparse",
                       "accessors[%zu]: sparse index %zu is %zu, but there are only %zu elements", a->index,
                       i, load_index(a->sparse_type, a->sparse_indices, i), a->count);
  return true;
}

bool accessor_open(Gltf *g, const Json *dict, const char *key, bool *is_given, Accessor *out)
{
  *out = (Accessor){0};
  size_t index;
  if (!gltf_index(g, dict, key, "accessors", &index)) return false;
  *is_given = index != GLTF_NONE;
  if (!*is_given) return true;
  Accessor a = {.index = index};
  const Json *json = gltf_item(g, "accessors", index);
  a.width = width_of(js_text(js_get(json, "type")));
  if (!gltf_size(g, json, "count", 0, &a.count) || !read_type(g, json, &a.type) ||
      !gltf_flag(g, json, "normalized", &a.normalized))
    return false;
  if (!a.width) return gltf_fail(g, json, "type", "accessors[%zu]: its \"type\" is of no use here", index);
  if (!a.count) return gltf_fail(g, json, "count", "accessors[%zu]: \"count\" must be at least 1", index);
  const size_t element_size = (size_t)a.width * type_size(a.type);
  if (js_get(json, "bufferView")) {
    if (!find_elements(g, json, index, a.count, element_size, &a.data, &a.stride)) return false;
  } else if (a.count > GLTF_MOST_ZEROS) {
    return gltf_fail(g, json, "count",
                     "accessors[%zu] has no bufferView, so it is all zeros; more than %d of them are "
                     "not taken",
                     index, GLTF_MOST_ZEROS);
  }
  if (!open_sparse(g, json, element_size, &a)) return false;
  *out = a;
  return true;
}

// --- reading --------------------------------------------------------------------------------------
// One component. Normalised integers: section 3.11; the most negative value is clamped to -1.
static float load_float(GltfType type, bool normalized, const uint8_t *p)
{
  int16_t i16;
  uint16_t u16;
  uint32_t u32;
  float f32;
  switch (type) {
  case GLTF_I8: return normalized ? max_f((float)(int8_t)*p / 127, -1) : (float)(int8_t)*p;
  case GLTF_U8: return normalized ? (float)*p / 255 : (float)*p;
  case GLTF_I16: memcpy(&i16, p, 2); return normalized ? max_f((float)i16 / 32767, -1) : (float)i16;
  case GLTF_U16: memcpy(&u16, p, 2); return normalized ? (float)u16 / 65535 : (float)u16;
  case GLTF_U32: memcpy(&u32, p, 4); return (float)u32;
  case GLTF_F32: memcpy(&f32, p, 4); return f32;
  }
  unreachable();
}

static void load_element(const Accessor *a, const uint8_t *p, int width, float *out)
{
  const size_t size = type_size(a->type);
  const int have = width < a->width ? width : a->width;
  for (int k = 0; k < have; k++) out[k] = load_float(a->type, a->normalized, p + (size_t)k * size);
  for (int k = have; k < width; k++) out[k] = 1;
}

// The loop of nearly every large file: floats, as many as wanted.
static void copy_floats(const Accessor *a, size_t first, size_t count, int width, float *out)
{
  const size_t bytes = (size_t)width * sizeof(float);
  const uint8_t *p = a->data + first * a->stride;
  if (a->stride == bytes) {
    memcpy(out, p, count * bytes);
    return;
  }
  for (size_t i = 0; i < count; i++) memcpy(out + i * (size_t)width, p + i * a->stride, bytes);
}

static void apply_sparse(const Accessor *a, size_t first, size_t count, int width, float *out)
{
  const size_t element_size = (size_t)a->width * type_size(a->type);
  for (size_t i = 0; i < a->sparse_count; i++) {
    const size_t at = load_index(a->sparse_type, a->sparse_indices, i);
    if (at < first || at - first >= count) continue;
    load_element(a, a->sparse_values + i * element_size, width, out + (at - first) * (size_t)width);
  }
}

void accessor_floats(const Accessor *a, size_t first, size_t count, int width, float *out)
{
  if (!a->data) {
    for (size_t i = 0; i < count; i++)
      for (int k = 0; k < width; k++) out[i * (size_t)width + (size_t)k] = k < a->width ? 0 : 1;
  } else if (a->type == GLTF_F32 && a->width >= width) {
    copy_floats(a, first, count, width, out);
  } else {
    const uint8_t *p = a->data + first * a->stride;
    for (size_t i = 0; i < count; i++) load_element(a, p + i * a->stride, width, out + i * (size_t)width);
  }
  apply_sparse(a, first, count, width, out);
}

void accessor_indices(const Accessor *a, uint32_t *out)
{
  if (!a->data)
    memset(out, 0, a->count * sizeof *out);
  else if (a->type == GLTF_U32 && a->stride == 4)
    memcpy(out, a->data, a->count * 4);
  else
    for (size_t i = 0; i < a->count; i++) out[i] = (uint32_t)load_index(a->type, a->data + i * a->stride, 0);
  for (size_t i = 0; i < a->sparse_count; i++)
    out[load_index(a->sparse_type, a->sparse_indices, i)] =
        (uint32_t)load_index(a->type, a->sparse_values, i);
}
