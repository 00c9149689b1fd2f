// What the tests of saved models and of caches share: models in a folder of their own, with all that may stand in one,
// and the hash of the picture each of them shows.

#ifndef RAYFOLD_TESTS_SAVED_MODEL_H
#define RAYFOLD_TESTS_SAVED_MODEL_H

#include "rayfold/rayfold.h"
#include "tests/model.h"

#include <sys/stat.h>

static inline void saved_copy(const char *from, const char *name)
{
  FileBytes bytes;
  Err err = {0};
  if (!file_read(&bytes, from, &err)) abort();
  model_write(name, bytes.data, bytes.size);
  file_release(&bytes);
}

// A bumpy sheet of 2 n^2 triangles in two materials, one with a texture.
static inline const char *saved_write_obj(int n)
{
  static const char mtl[] = "newmtl red\nKd 0.8 0.1 0.1\nnewmtl papered\nmap_Kd paper.png\nKe 0.1 0.2 0.3\n";
  saved_copy("tests/data/image/palette.png", "paper.png");
  model_write("sheet.mtl", mtl, sizeof mtl - 1);
  Text t = {0};
  text_add(&t, "mtllib sheet.mtl\n");
  for (int j = 0; j <= n; j++)
    for (int i = 0; i <= n; i++)
      text_add(&t, "v %.5f %.5f %.5f\nvt %.5f %.5f\n", (double)i / n, sin(i * 1.3 + j * 0.7) / 4, (double)j / n,
               (double)i / n, (double)j / n);
  for (int k = 0; k < n * n; k++) {
    const int a = k / n * (n + 1) + k % n + 1, b = a + n + 1;
    if (k == 0 || k == n * n / 2) text_add(&t, "usemtl %s\n", k ? "papered" : "red");
    text_add(&t, "f %d/%d %d/%d %d/%d %d/%d\n", a, a, b, b, b + 1, b + 1, a + 1, a + 1);
  }
  const char *path = model_write("sheet.obj", text_get(&t), t.length);
  text_finish(&t);
  return path;
}

// Three placements of one quad, with a picture inside and one beside the file, normals, colours, a camera and a lamp.
static inline const char *saved_write_gltf(void)
{
  static const float vertex[4][12] = {{0, 0, 0, 0, 0, 1, 0, 1, 1, 0, 0, 1},
                                      {1, 0, 0, 0, 0, 1, 1, 1, 0, 1, 0, 1},
                                      {1, 1, 0, 0, 0, 1, 1, 0, 0, 0, 1, 1},
                                      {0, 1, 0, 0, 0, 1, 0, 0, 1, 1, 1, 0.5f}};
  static const uint16_t index[6] = {0, 1, 2, 0, 2, 3};
  FileBytes picture;
  Err err = {0};
  if (!file_read(&picture, "tests/data/image/grey16.png", &err)) abort();
  saved_copy("tests/data/image/palette.png", "paper.png");
  char *bin = calloc(1, 256 + picture.size);
  memcpy(bin, vertex, sizeof vertex);
  memcpy(bin + 192, index, sizeof index);
  memcpy(bin + 256, picture.data, picture.size);
  model_write("quads.bin", bin, 256 + picture.size);
  Text t = {0};
  text_add(&t,
           "{\"asset\":{\"version\":\"2.0\"},\"extensionsUsed\":[\"KHR_lights_punctual\"],"
           "\"extensions\":{\"KHR_lights_punctual\":{\"lights\":[{\"type\":\"point\",\"intensity\":90}]}},"
           "\"buffers\":[{\"uri\":\"quads.bin\",\"byteLength\":%zu}],"
           "\"bufferViews\":[{\"buffer\":0,\"byteLength\":192,\"byteStride\":48},"
           "{\"buffer\":0,\"byteOffset\":192,\"byteLength\":12},"
           "{\"buffer\":0,\"byteOffset\":256,\"byteLength\":%zu}],"
           "\"accessors\":[",
           256 + picture.size, picture.size);
  text_add(&t, "{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\",\"min\":[0,0,0],"
               "\"max\":[1,1,0]},"
               "{\"bufferView\":0,\"byteOffset\":12,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"},"
               "{\"bufferView\":0,\"byteOffset\":24,\"componentType\":5126,\"count\":4,\"type\":\"VEC2\"},"
               "{\"bufferView\":0,\"byteOffset\":32,\"componentType\":5126,\"count\":4,\"type\":\"VEC4\"},"
               "{\"bufferView\":1,\"componentType\":5123,\"count\":6,\"type\":\"SCALAR\"}],");
  text_add(&t, "\"images\":[{\"bufferView\":2,\"mimeType\":\"image/png\"},{\"uri\":\"paper.png\"}],"
               "\"samplers\":[{\"wrapS\":33071}],"
               "\"textures\":[{\"source\":0},{\"source\":1},{\"source\":0,\"sampler\":0}],"
               "\"materials\":[{\"doubleSided\":true,\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":1},"
               "\"metallicRoughnessTexture\":{\"index\":0}},\"emissiveTexture\":{\"index\":2},"
               "\"emissiveFactor\":[0.5,0.25,0]}],"
               "\"meshes\":[{\"name\":\"quad\",\"primitives\":[{\"attributes\":{\"POSITION\":0,\"NORMAL\":1,"
               "\"TEXCOORD_0\":2,\"COLOR_0\":3},\"indices\":4,\"material\":0}]}],"
               "\"cameras\":[{\"type\":\"perspective\",\"perspective\":{\"yfov\":0.9,\"znear\":0.1}}],");
  text_add(&t, "\"nodes\":[{\"mesh\":0},{\"mesh\":0,\"translation\":[-1.5,0.3,-1],\"scale\":[2,1,1]},"
               "{\"mesh\":0,\"translation\":[0,-1,0.2],\"rotation\":[0,0.3826834,0,0.9238795]},"
               "{\"camera\":0,\"translation\":[0.3,0.2,3]},"
               "{\"translation\":[0,2,2],\"extensions\":{\"KHR_lights_punctual\":{\"light\":0}}}],"
               "\"scenes\":[{\"nodes\":[0,1,2,3,4]}],\"scene\":0}");
  const char *path = model_write("quads.gltf", text_get(&t), t.length);
  text_finish(&t);
  file_release(&picture);
  free(bin);
  return path;
}

static inline rf_scene *saved_load(rf_engine *e, const char *path, bool cache)
{
  rf_load_def def = rf_default_load_def();
  def.cache = cache;
  rf_scene *s = rf_scene_load(e, path, &def);
  const char *text;
  const rf_status status = rf_error(e, &text);
  CHECK_MSG(s && status == RF_OK, "%s: %s", path, text);
  return s;
}

static inline uint64_t saved_hash_world(rf_engine *e, const rf_world *w, const rf_eye *eye)
{
  rf_render_def def = rf_default_render_def();
  def.end_sample = 2;
  rf_film *f = rf_film_create(e, 24, 16, RF_BEAUTY);
  CHECK(rf_render(w, eye, &def, f, NULL) == RF_OK);
  const uint64_t hash = rf_film_hash(f);
  rf_film_destroy(f);
  return hash;
}

static inline uint64_t saved_hash_scene(rf_engine *e, rf_scene *s)
{
  rf_world *w = s ? rf_prepare(s, NULL) : NULL;
  rf_eye eye;
  const bool ok = w && rf_camera(s, w, NULL, 1.5f, &eye);
  const char *text = "";
  if (!ok) rf_error(e, &text);
  CHECK_MSG(ok, "%s", text);
  const uint64_t hash = ok ? saved_hash_world(e, w, &eye) : 0;
  rf_world_destroy(w);
  return hash;
}

static inline uint64_t saved_hash(rf_engine *e, const char *path, bool cache)
{
  rf_scene *s = saved_load(e, path, cache);
  const uint64_t hash = saved_hash_scene(e, s);
  rf_scene_destroy(s);
  return hash;
}

static inline bool saved_convert(rf_engine *e, const char *from, const char *to)
{
  rf_scene *s = saved_load(e, from, false);
  const bool ok = s && rf_scene_save(s, to);
  const char *text = "";
  if (!ok) rf_error(e, &text);
  CHECK_MSG(ok, "%s -> %s: %s", from, to, text);
  rf_scene_destroy(s);
  return ok;
}

#endif
