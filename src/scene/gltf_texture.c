// Textures of a glTF file: image + sampler + uv transform (KHR_texture_transform) become one Texture of the scene. A
// glTF texture used with several transforms becomes several, which share the image. Images inside the file are
// copied, still encoded, into the scene's arena. Nothing is decoded here.

#include "scene/gltf.h"

#include "base/hash.h"
#include "scene/import.h"
#include "scene/uri.h"

#include <string.h>

static void note_missing(Gltf *g, size_t image_i, const char *why)
{
  note_once(&g->scene->notes, "%s: images[%zu] is left out: %.300s", g->path, image_i, why);
}

// --- images ---------------------------------------------------------------------------------------
static void find_file(Gltf *g, size_t image_i, const char *uri, GltfImage *image)
{
  Text name = {0};
  Err why = {0};
  if (uri_decode_name(&name, uri, &why))
    image->file = import_find_file(g->scene, g->path, g->path, text_get(&name), g->options);
  else
    note_missing(g, image_i, why.text);
  text_finish(&name);
}

static bool keep_bytes(Gltf *g, const uint8_t *bytes, size_t size, GltfImage *image)
{
  if (!gltf_charge(g, size, 1, "bytes of images")) return false;
  uint8_t *copy = arena_alloc(&g->scene->arena, size ? size : 1, 1);
  if (!copy) return err_memory(g->err, "an image", size);
  memcpy(copy, bytes, size);
  image->bytes = copy;
  image->size = size;
  return true;
}

static bool keep_data_uri(Gltf *g, size_t image_i, const char *uri, GltfImage *image)
{
  Err why = {0};
  uint8_t *bytes;
  size_t size;
  if (!uri_decode_data(uri, &bytes, &size, &why)) {
    note_missing(g, image_i, why.text);
    return true;
  }
  const bool ok = keep_bytes(g, bytes, size, image);
  mem_free(bytes);
  return ok;
}

static bool open_image(Gltf *g, size_t image_i, const GltfImage **out)
{
  GltfImage *image = &g->images[image_i];
  *out = image;
  if (image->is_tried) return true;
  image->is_tried = true;
  const Json *json = gltf_item(g, "images", image_i);
  const char *uri = js_text(js_get(json, "uri"));
  size_t view_i;
  GltfView view;
  if (!gltf_index(g, json, "bufferView", "bufferViews", &view_i)) return false;
  if (view_i != GLTF_NONE) return gltf_view(g, view_i, &view) && keep_bytes(g, view.data, view.size, image);
  if (!uri)
    note_missing(g, image_i, "it has neither a \"uri\" nor a \"bufferView\"");
  else if (uri_is_data(uri))
    return keep_data_uri(g, image_i, uri, image);
  else if (uri_is_remote(uri))
    note_missing(g, image_i, "it lies on a network; download it beside the model");
  else
    find_file(g, image_i, uri, image);
  return true;
}

// Which image a texture shows. A plain source beats one in an extension: every build can read it.
static bool choose_image(Gltf *g, const Json *texture, size_t texture_i, size_t *image_i)
{
  const Json *webp = gltf_extension(texture, "EXT_texture_webp");
  if (!gltf_index(g, texture, "source", "images", image_i)) return false;
  if (*image_i == GLTF_NONE && webp && !gltf_index(g, webp, "source", "images", image_i)) return false;
  if (*image_i == GLTF_NONE && gltf_extension(texture, "KHR_texture_basisu"))
    note_once(&g->scene->notes,
              "%s: KHR_texture_basisu is not supported yet: textures[%zu] is left out; convert the pictures "
              "to PNG, "
              "as with \"gltf-transform ktxdecompress\"",
              g->path, texture_i);
  return true;
}

// --- samplers -------------------------------------------------------------------------------------
static int32_t wrap_of(size_t number)
{
  enum { CLAMP_TO_EDGE = 33071, MIRRORED_REPEAT = 33648 };
  return number == CLAMP_TO_EDGE ? WRAP_CLAMP : number == MIRRORED_REPEAT ? WRAP_MIRROR : WRAP_REPEAT;
}

static bool set_sampler(Gltf *g, const Json *texture, TextureImage *image)
{
  enum { NEAREST = 9728, LINEAR = 9729, REPEAT = 10497 };
  size_t sampler_i, wrap_s, wrap_t, filter;
  if (!gltf_index(g, texture, "sampler", "samplers", &sampler_i)) return false;
  if (sampler_i == GLTF_NONE) return true;
  const Json *sampler = gltf_item(g, "samplers", sampler_i);
  if (!gltf_size(g, sampler, "wrapS", REPEAT, &wrap_s) || !gltf_size(g, sampler, "wrapT", REPEAT, &wrap_t) ||
      !gltf_size(g, sampler, "magFilter", LINEAR, &filter))
    return false;
  image->wrap_u = wrap_of(wrap_s);
  image->wrap_v = wrap_of(wrap_t);
  image->filter = filter == NEAREST ? TEXEL_NEAREST : TEXEL_LINEAR;
  return true;
}

// --- uv transforms --------------------------------------------------------------------------------
// glTF's v runs down from the picture's top, ours up from its bottom: with D = diag(1, -1) and e = (0, 1), our
// uv = D uv_gltf + e, and the same map leads back. Meshes are turned over like that when they are read, so the
// transform must be, too. glTF maps uv_gltf to A S uv_gltf + o, with S = diag(scale), o the offset and
//
//   A = | cos r   sin r |   counter-clockwise on the picture, as v runs down; the extension's example (the lower left
//       |-sin r   cos r |   quadrant by offset (0, 1), scale 0.5 and a quarter turn) settles the sign
//
// Put between two turns-over:  uv -> D (A S (D uv + e) + o) + e = (D A D) S uv + D (A S e + o) + e,  as D S D = S.
// D A D is the rotation by +r counter-clockwise that our textures have, and A S e = scale.y (sin r, cos r). So scale
// and angle stay and the offset becomes (o.x + scale.y sin r, 1 - o.y - scale.y cos r).
static bool read_transform(Gltf *g, const Json *info, TextureCommon *out)
{
  const Json *transform = gltf_extension(info, "KHR_texture_transform");
  size_t texcoord;
  if (!gltf_size(g, info, "texCoord", 0, &texcoord)) return false;
  *out = (TextureCommon){.scale = {1, 1}};
  if (transform) {
    float offset[2] = {0, 0}, angle = 0;
    if (!gltf_floats(g, transform, "offset", 2, offset) ||
        !gltf_floats(g, transform, "scale", 2, out->scale) ||
        !gltf_floats(g, transform, "rotation", 1, &angle) ||
        !gltf_size(g, transform, "texCoord", texcoord, &texcoord))
      return false;
    // In double: a whole turn written in a few digits must not shift a picture by a texel.
    const double s = sin((double)angle), c = cos((double)angle), sy = (double)out->scale[1];
    out->offset[0] = (float)((double)offset[0] + sy * s);
    out->offset[1] = (float)(1 - (double)offset[1] - sy * c);
    out->rotation = (float)((double)angle * (180 / 3.14159265358979323846));
  }
  if (texcoord > 1)
    note_once(&g->scene->notes,
              "%s: texture coordinates beyond the second set are not supported; TEXCOORD_%zu is "
              "taken for TEXCOORD_1",
              g->path, texcoord);
  out->texcoord = texcoord > 0;
  return true;
}

static bool is_same(const TextureCommon *a, const TextureCommon *b)
{
  return a->offset[0] == b->offset[0] && a->offset[1] == b->offset[1] && a->scale[0] == b->scale[0] &&
         a->scale[1] == b->scale[1] && a->rotation == b->rotation && a->texcoord == b->texcoord;
}

static uint64_t use_key(size_t texture_i, const TextureCommon *c)
{
  const float numbers[] = {c->offset[0], c->offset[1], c->scale[0], c->scale[1], c->rotation};
  return hash_bytes(texture_i, numbers, sizeof numbers);
}

static const GltfTextureUse *find_use(const Gltf *g, uint64_t key, size_t texture_i, const TextureCommon *c)
{
  size_t step = 0;
  for (const int32_t *i; (i = table_next(&g->uses_found, key, &step));) {
    const GltfTextureUse *use = &g->uses.items[*i];
    if (use->gltf_i == texture_i && is_same(&use->common, c)) return use;
  }
  return NULL;
}

// --- textures -------------------------------------------------------------------------------------
static bool add_texture(Gltf *g, size_t texture_i, const TextureCommon *common, int32_t *out)
{
  const Json *json = gltf_item(g, "textures", texture_i);
  size_t image_i;
  const GltfImage *image;
  TextureImage sampler = {0};
  if (!choose_image(g, json, texture_i, &image_i) || !set_sampler(g, json, &sampler)) return false;
  if (image_i == GLTF_NONE) return true;
  if (!open_image(g, image_i, &image)) return false;
  if (!image->file && !image->bytes) return true;
  if (!gltf_charge(g, 1, sizeof(Texture) + GLTF_NAME_SIZE, "textures")) return false;
  char name[GLTF_NAME_SIZE];
  const Json *named = js_text(js_get(json, "name")) ? json : gltf_item(g, "images", image_i);
  *out = scene_add_texture(g->scene, TEXTURE_IMAGE, gltf_name(named, "texture", texture_i, name));
  if (*out < 0) return err_memory(g->err, "textures", sizeof(Texture));
  Texture *t = &g->scene->textures.items[*out];
  t->common = *common;
  t->image.wrap_u = sampler.wrap_u;
  t->image.wrap_v = sampler.wrap_v;
  t->image.filter = sampler.filter;
  t->image.file = image->file;
  t->embedded = image->bytes;
  t->embedded_size = image->size;
  return true;
}

bool gltf_texture(Gltf *g, const Json *dict, const char *key, int32_t *texture_i)
{
  const Json *info = js_get(dict, key);
  size_t index;
  TextureCommon common;
  *texture_i = -1;
  if (!info) return true;
  if (js_kind(info) != JSON_DICT) return gltf_fail(g, dict, key, "\"%s\" must be a dictionary", key);
  if (!gltf_index(g, info, "index", "textures", &index) || !read_transform(g, info, &common)) return false;
  if (index == GLTF_NONE) return gltf_fail(g, dict, key, "\"%s\" lacks the \"index\" of a texture", key);
  const uint64_t use = use_key(index, &common);
  const GltfTextureUse *known = find_use(g, use, index, &common);
  if (known) return *texture_i = known->texture_i, true;
  if (!add_texture(g, index, &common, texture_i)) return false;
  // One that could not be had is not kept apart by its transforms: the first finding stands for all.
  if (*texture_i < 0) return true;
  return (array_push(&g->uses, (GltfTextureUse){common, *texture_i, index}) &&
          table_add(&g->uses_found, use, (int32_t)g->uses.count - 1)) ||
         err_memory(g->err, "textures", sizeof(GltfTextureUse));
}
