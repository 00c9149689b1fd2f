// See import.h.

#include "scene/import.h"

#include "base/file.h"
#include "scene/cache.h"

#include <string.h>
#include <unistd.h>

// "models/bunny.v2.obj" is called "bunny.v2".
static const char *stem(Arena *a, const char *path)
{
  const char *base = path_base(path), *dot = path_extension(path);
  return arena_text_n(a, base, *dot ? (size_t)(dot - base) : strlen(base));
}

bool import_add_mesh(Scene *s, const char *path, const char *name, MeshData *data, const int32_t *slots,
                     size_t slot_count, Err *err)
{
  if (!mesh_data_check(data, path, &s->notes, err)) {
    mesh_data_release(data);
    return false;
  }
  if (!name || !name[0]) name = stem(&s->arena, path);
  const int32_t mesh_i = scene_add_mesh(s, name, data); // takes data over in any case
  const int32_t object_i = mesh_i < 0 ? -1 : scene_add_object(s, SHAPE_MESH, name);
  if (object_i < 0) return err_memory(err, path, 0);
  s->objects.items[object_i].shape.mesh_i = mesh_i;
  if (!slots || !slot_count) return true;
  Mesh *mesh = &s->meshes.items[mesh_i];
  mesh->slots = arena_alloc(&s->arena, slot_count, sizeof *slots);
  if (!mesh->slots) return err_memory(err, path, slot_count * sizeof *slots);
  memcpy(mesh->slots, slots, slot_count * sizeof *slots);
  mesh->slot_count = slot_count;
  return true;
}

static bool is_absolute(const char *name)
{
  const bool has_drive = ((name[0] | 0x20) >= 'a' && (name[0] | 0x20) <= 'z') && name[1] == ':';
  return has_drive || name[0] == '/' || name[0] == '\\';
}

static const char *last_part(const char *name)
{
  const char *part = name;
  for (const char *p = name; *p; p++)
    if (*p == '/' || *p == '\\' || *p == ':') part = p + 1;
  return part;
}

// Resolves and opens to see: a texture that is not there costs the texture, not the model.
static bool is_readable(Scene *s, Text *out, const char *owner_path, const char *name,
                        const LoadOptions *options, const char *root, Err *err)
{
  const bool allow_outside = options && options->allow_outside;
  if (!path_resolve(out, owner_path, name, root, allow_outside, err)) return false;
  if (!cache_add_name(s, text_get(out), options)) return err_memory(err, text_get(out), 0);
  return !access(text_get(out), R_OK) ||
         err_set(err, ERR_NOT_FOUND, "there is no file \"%s\"", text_get(out));
}

const char *import_find_file(Scene *s, const char *path, const char *owner_path, const char *name,
                             const LoadOptions *options)
{
  Text folder = {0}, found = {0};
  Err err = {0};
  const char *result = NULL;
  path_folder(&folder, path);
  const char *root = options && options->root ? options->root : text_get(&folder);
  bool ok = is_readable(s, &found, owner_path, name, options, root, &err);
  if (!ok && is_absolute(name)) ok = is_readable(s, &found, owner_path, last_part(name), options, root, NULL);
  if (ok) {
    const char *file = text_get(&found);
    const size_t n = folder.length;
    const bool is_below = n && !strncmp(file, text_get(&folder), n) && file[n] == '/';
    result = arena_text(&s->arena, is_below ? file + n + 1 : file);
  } else {
    note_once(&s->notes, "%s: a texture is left out: %.400s", owner_path, err.text);
  }
  text_finish(&folder);
  text_finish(&found);
  return result;
}

int32_t import_add_image(Scene *s, const char *file)
{
  const char *name = stem(&s->arena, file);
  const int32_t i = name ? scene_add_texture(s, TEXTURE_IMAGE, name) : -1;
  if (i >= 0) s->textures.items[i].image.file = file;
  return i;
}
