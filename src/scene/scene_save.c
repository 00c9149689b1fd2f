// Saves a scene where it can be loaded again: a copy of it is made whose meshes and embedded pictures are files or
// short lists, and whose file names are relative to the new place; then that copy is written. Files beside the scene
// are named after their content, so that saving never overwrites a file with another's data, and saving again writes
// the same names. Pictures that would be left outside the new folder are copied there. What the forms cannot hold is
// left out: tangents and a mesh's second texture coordinates.
//
// A saved model (rfm.h) is such a copy, too, but with meshes as they are and pictures inside.

#include "base/file.h"
#include "base/hash.h"
#include "base/mem.h"
#include "base/table.h"
#include "image/voxels.h"
#include "scene/export_mesh.h"
#include "scene/kinds.h"
#include "scene/mesh_split.h"

#include <errno.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { INLINE_TRIANGLES = 64 };

typedef struct SavedPart { // of a mesh: a file, or a mesh of the copy
  const char *file;        // NULL: in the copy's meshes
  int32_t mesh_i, material;
} SavedPart;

typedef struct SavedMesh {
  SavedPart *parts; // in the copy's arena; NULL: not saved yet
  size_t count;
} SavedMesh;

typedef struct SavedPicture {
  const uint8_t *bytes; // embedded in the scene
  size_t size;
  const char *file; // in the copy's arena
} SavedPicture;

typedef struct Saver {
  const Scene *scene;
  Scene *copy;
  SavedMesh *meshes; // one for each of the scene's
  ARRAY(SavedPicture) pictures;
  Table pictures_found; // address of the bytes -> picture
  Text folder;          // the new scene's, without links
  Text old_folder;      // the scene's own so far
  Text data_name;       // "castle.data", beside the new scene
  bool has_data;        // that folder is there
  bool is_one_file;     // meshes stay as they are, and pictures go inside
  Err *err;
} Saver;

// --- names of files -------------------------------------------------------------------------------
static bool real_folder(Text *out, const char *path, Err *err)
{
  Text folder = {0};
  char real[PATH_MAX];
  path_folder(&folder, path);
  const bool ok = !folder.failed && realpath(text_get(&folder), real) != NULL;
  if (folder.failed)
    err_memory(err, path, strlen(path));
  else if (ok)
    text_add(out, "%s", real);
  else
    err_set(err, ERR_IO, "cannot write \"%s\": %s", path,
            errno == ENOENT ? "create the folder first" : strerror(errno));
  text_finish(&folder);
  return ok;
}

// Takes "." and "x/.." out of an absolute path, in place.
static void tidy(char *path)
{
  char *to = path;
  for (const char *p = path; *p;) {
    const size_t n = strcspn(p + 1, "/") + 1; // with the slash in front
    if (n == 3 && !memcmp(p, "/..", 3)) {
      while (to > path && *--to != '/') {}
    } else if (n > 1 && !(n == 2 && p[1] == '.')) {
      memmove(to, p, n);
      to += n;
    }
    p += n;
  }
  *to = 0;
}

// The way from a folder to a file, both absolute and tidy.
static void add_relative(Text *out, const char *folder, const char *file)
{
  size_t common = 0, i = 0;
  for (; folder[i] && folder[i] == file[i]; i++)
    if (folder[i] == '/') common = i;
  if (!folder[i] && file[i] == '/') common = i;
  for (const char *p = folder + common; *p; p++)
    if (*p == '/' && p[1]) text_add(out, "../");
  text_add(out, "%s", file + common + 1);
}

// A file the scene names, as the saved scene has to name it.
static const char *moved_name(const Saver *s, const char *file)
{
  if (file[0] == '/' || text_equal(text_get(&s->folder), text_get(&s->old_folder))) return file;
  Text path = {0}, name = {0};
  text_add(&path, "%s/%s", text_get(&s->old_folder), file);
  for (char *p = path.data; p && *p; p++)
    if (*p == '\\') *p = '/';
  if (path.data) tidy(path.data);
  add_relative(&name, text_get(&s->folder), text_get(&path));
  const char *moved = path.failed || name.failed ? NULL : arena_text(&s->copy->arena, text_get(&name));
  text_finish(&path);
  text_finish(&name);
  return moved;
}

// The same for every file of an element.
static bool move_files(Saver *s, const Group *g, void *element)
{
  const Field *f;
  void *at;
  for (size_t i = 0; (f = group_field_at(g, element, i, &at)); i++) {
    const char **file = at;
    if (f->type != FIELD_file || !*file || !**file) continue;
    *file = moved_name(s, *file);
    if (!*file) return err_memory(s->err, "a file name", 0);
  }
  return !g->nested || move_files(s, g->nested, group_nested(g, element));
}

static bool make_data_folder(Saver *s)
{
  if (s->has_data) return true;
  Text path = {0};
  text_add(&path, "%s/%s", text_get(&s->folder), text_get(&s->data_name));
  if (path.failed) return err_memory(s->err, "a folder's name", path.length);
  s->has_data = !mkdir(text_get(&path), 0777) || errno == EEXIST;
  if (!s->has_data)
    err_set(s->err, ERR_IO, "cannot make the folder \"%s\": %s", text_get(&path), strerror(errno));
  text_finish(&path);
  return s->has_data;
}

// "castle.data/bunny-0123456789abcdef.ply" for a thing called bunny, in the copy's arena; NULL when memory is out.
static const char *data_file(const Saver *s, const char *name, uint64_t hash, const char *extension)
{
  enum { LONGEST = 60 };
  char plain[LONGEST + 1];
  size_t n = 0;
  for (; name && name[n] && n < LONGEST; n++) {
    const char c = name[n];
    const bool is_plain =
        (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
    plain[n] = is_plain ? c : '-';
  }
  plain[n] = 0;
  return arena_format(&s->copy->arena, "%s/%s-%016llx%s", text_get(&s->data_name), n ? plain : "mesh",
                      (unsigned long long)hash, extension);
}

static bool data_path(Saver *s, const char *file, Text *out)
{
  if (!file) return err_memory(s->err, "a file name", 0);
  if (!make_data_folder(s)) return false;
  text_add(out, "%s/%s", text_get(&s->folder), file);
  return !out->failed || err_memory(s->err, file, 0);
}

// --- pictures -------------------------------------------------------------------------------------
static const char *picture_extension(const uint8_t *bytes, size_t size)
{
  static const struct {
    const char *magic, *extension;
    size_t length;
  } formats[] = {{"\x89PNG", ".png", 4},
                 {"\xff\xd8\xff", ".jpg", 3},
                 {"RIFF", ".webp", 4},
                 {"#?", ".hdr", 2},
                 {"\x76\x2f\x31\x01", ".exr", 4},
                 {"IESNA", ".ies", 5}};
  for (size_t i = 0; i < sizeof formats / sizeof *formats; i++)
    if (size >= formats[i].length && !memcmp(bytes, formats[i].magic, formats[i].length))
      return formats[i].extension;
  return ".img"; // pictures are known by their first bytes when read
}

static const char *find_picture(const Saver *s, const Texture *t)
{
  size_t step = 0;
  for (const int32_t *i; (i = table_next(&s->pictures_found, (uintptr_t)t->embedded, &step));) {
    const SavedPicture *p = &s->pictures.items[*i];
    if (p->bytes == t->embedded && p->size == t->embedded_size) return p->file;
  }
  return NULL;
}

static const char *write_picture(Saver *s, const Texture *t)
{
  const char *file = data_file(s, t->name, hash_bytes(0, t->embedded, t->embedded_size),
                               picture_extension(t->embedded, t->embedded_size));
  Text path = {0};
  bool ok =
      data_path(s, file, &path) && file_write_whole(text_get(&path), t->embedded, t->embedded_size, s->err);
  text_finish(&path);
  if (!ok) return NULL;
  ok = array_push(&s->pictures, (SavedPicture){t->embedded, t->embedded_size, file}) &&
       table_add(&s->pictures_found, (uintptr_t)t->embedded, (int32_t)s->pictures.count - 1);
  return ok || err_memory(s->err, "the pictures", 0) ? file : NULL;
}

// Textures may share a picture, thousands of them a large one; it is written once, under the name of the first.
static bool save_picture(Saver *s, Texture *t)
{
  if (t->kind != TEXTURE_IMAGE || t->image.file || !t->embedded) return true;
  const char *file = find_picture(s, t);
  t->image.file = file ? file : write_picture(s, t);
  t->embedded = NULL;
  t->embedded_size = 0;
  return t->image.file;
}

static bool is_left_outside(const char *from, const char *file)
{
  return from && file && !strncmp(file, "../", 3) && !text_equal(from, file);
}

// A picture that would lie outside the new scene's folder, from where it may not be read, comes along. One that cannot
// be read stays a name: rendering says what is wrong with it.
static bool bring_picture(Saver *s, const char *name, const char *from, const char **file)
{
  if (!is_left_outside(from, *file)) return true;
  Text old = {0}, path = {0};
  FileBytes bytes;
  text_add(&old, "%s/%s", text_get(&s->folder), *file);
  bool ok = !old.failed || err_memory(s->err, *file, 0);
  if (ok && file_read(&bytes, text_get(&old), NULL)) {
    *file =
        data_file(s, name, hash_bytes(0, bytes.data, bytes.size), picture_extension(bytes.data, bytes.size));
    ok = data_path(s, *file, &path) && file_write_whole(text_get(&path), bytes.data, bytes.size, s->err);
    file_release(&bytes);
  }
  text_finish(&old);
  text_finish(&path);
  return ok;
}

// The same for a scene that becomes one file.
static bool embed_picture(Saver *s, const char *from, Texture *t)
{
  Text path = {0};
  FileBytes bytes;
  if (!is_left_outside(from, t->image.file)) return true;
  text_add(&path, "%s/%s", text_get(&s->folder), t->image.file);
  bool ok = !path.failed || err_memory(s->err, t->image.file, 0);
  if (ok && file_read(&bytes, text_get(&path), NULL)) {
    uint8_t *copy = arena_alloc(&s->copy->arena, bytes.size + 1, 1);
    ok = copy || err_memory(s->err, t->image.file, bytes.size);
    if (copy)
      memcpy(copy, bytes.data,
             bytes.size + 1); // with the zero byte behind, as an empty one must have an address
    t->embedded = copy;
    t->embedded_size = bytes.size;
    t->image.file = NULL;
    file_release(&bytes);
  }
  text_finish(&path);
  return ok;
}

static bool bring_pictures(Saver *s, const Group *g, const void *from, void *to)
{
  if (s->is_one_file && g == &group_texture)
    return ((Texture *)to)->kind != TEXTURE_IMAGE ||
           embed_picture(s, ((const Texture *)from)->image.file, to);
  if (g == &group_texture && ((Texture *)to)->kind == TEXTURE_IMAGE)
    return bring_picture(s, ((Texture *)to)->name, ((const Texture *)from)->image.file,
                         &((Texture *)to)->image.file);
  if (g == &group_sky && ((Sky *)to)->kind == SKY_IMAGE)
    return bring_picture(s, "sky", ((const Sky *)from)->image.file, &((Sky *)to)->image.file);
  if (g == &group_skies && ((NamedSky *)to)->sky.kind == SKY_IMAGE)
    return bring_picture(s, "sky", ((const NamedSky *)from)->sky.image.file, &((NamedSky *)to)->sky.image.file);
  if (g == &group_light && ((Light *)to)->kind == LIGHT_POINT)
    return bring_picture(s, "lamp", ((const Light *)from)->point.ies, &((Light *)to)->point.ies);
  if (g == &group_light && ((Light *)to)->kind == LIGHT_SPOT)
    return bring_picture(s, "lamp", ((const Light *)from)->spot.ies, &((Light *)to)->spot.ies);
  return true;
}

// --- meshes ---------------------------------------------------------------------------------------
static uint64_t mesh_hash(const MeshData *m)
{
  const struct {
    const void *data;
    size_t size;
  } arrays[] = {{m->positions, 12 * m->vertex_count},
                {m->normals, 12 * m->vertex_count},
                {m->texcoords[0], 8 * m->vertex_count},
                {m->colors, 16 * m->vertex_count},
                {m->triangles, 12 * m->triangle_count}};
  uint64_t h = 0;
  for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++)
    h = arrays[i].data ? hash_bytes(h, arrays[i].data, arrays[i].size) : hash_u64(h + i + 1);
  return h;
}

static bool save_part(Saver *s, const char *name, const MeshPart *part, SavedPart *out)
{
  const MeshData *m = part->data;
  *out = (SavedPart){.mesh_i = -1, .material = part->material};
  if (m->triangle_count <= INLINE_TRIANGLES && !m->colors) {
    out->mesh_i = scene_add_mesh(s->copy, name, mesh_data_share(part->data));
    return out->mesh_i >= 0 || err_memory(s->err, "a mesh", 0);
  }
  out->file = data_file(s, name, mesh_hash(m), ".ply");
  Text path = {0};
  const bool ok = data_path(s, out->file, &path) && export_ply(m, text_get(&path), s->err);
  text_finish(&path);
  return ok;
}

static bool save_mesh(Saver *s, int32_t mesh_i)
{
  const Mesh *mesh = &s->scene->meshes.items[mesh_i];
  SavedMesh *saved = &s->meshes[mesh_i];
  if (saved->parts) return true;
  MeshParts parts = {0};
  bool ok = mesh_split(mesh, s->scene->materials.count, &parts, s->err);
  SavedPart *list = ok ? arena_alloc(&s->copy->arena, parts.list.count, sizeof *list) : NULL;
  if (ok && !list) ok = err_memory(s->err, "a mesh", parts.list.count * sizeof *list);
  for (size_t i = 0; ok && i < parts.list.count; i++)
    ok = save_part(s, mesh->name, &parts.list.items[i], &list[i]);
  if (ok) *saved = (SavedMesh){list, parts.list.count};
  mesh_parts_finish(&parts);
  return ok;
}

// --- objects --------------------------------------------------------------------------------------
static bool add_object(Saver *s, const Object *o)
{
  return section_insert(s->copy, section_find(group_object.name), s->copy->objects.count, o) ||
         err_memory(s->err, "the objects", s->copy->objects.count * sizeof *o);
}

// One object of several materials becomes several of one each. The second is named "bunny.2".
static bool add_parts(Saver *s, const Object *o, const SavedMesh *mesh)
{
  const bool has_surface = o->common.medium < 0 || o->common.material >= 0;
  if (o->common.medium >= 0 && mesh->count > 1)
    return err_set(s->err, ERR_BAD_SCENE, "object \"%s\" has a medium inside and several materials, which a scene file can not "
                   "say; give it one material, or keep its mesh as a model file of its own", o->name ? o->name : "");
  for (size_t i = 0; i < mesh->count; i++) {
    Object part = *o;
    part.id = 0;
    if (i && o->name) part.name = arena_format(&s->copy->arena, "%s.%zu", o->name, i + 1);
    if (i && o->name && !part.name) return err_memory(s->err, o->name, 0);
    if (has_surface && part.common.material < 0) part.common.material = mesh->parts[i].material;
    part.shape.mesh.file = mesh->parts[i].file;
    part.shape.mesh_i = mesh->parts[i].mesh_i;
    if (!add_object(s, &part)) return false;
  }
  return true;
}

static bool save_object(Saver *s, const Object *o)
{
  const bool is_mesh = o->shape.kind == SHAPE_MESH && !o->shape.mesh.file && o->shape.mesh_i >= 0;
  if (is_mesh && !s->is_one_file)
    return save_mesh(s, o->shape.mesh_i) && add_parts(s, o, &s->meshes[o->shape.mesh_i]);
  Object moved = *o;
  const int32_t whole = o->common.part_of; // objects before it may have become several
  if (whole >= 0 && (size_t)whole < s->scene->objects.count && s->scene->objects.items[whole].name)
    moved.common.part_of =
        section_index(s->copy, section_find(group_object.name), s->scene->objects.items[whole].name);
  return move_files(s, &group_object, &moved) && add_object(s, &moved);
}

// --- the whole ------------------------------------------------------------------------------------
static bool copy_element(Saver *s, const Section *c, const void *element)
{
  if (c->group == &group_object) return save_object(s, element);
  const size_t i = c->form == SECTION_ONE ? 0 : section_count(s->copy, c);
  if (c->form == SECTION_ONE)
    memcpy(section_at(s->copy, c, 0), element, c->group->size);
  else if (!section_insert(s->copy, c, i, element))
    return err_memory(s->err, c->group->name, c->group->size);
  void *copy = section_at(s->copy, c, i);
  return move_files(s, c->group, copy) && bring_pictures(s, c->group, element, copy) &&
         (c->group != &group_texture || s->is_one_file || save_picture(s, copy));
}

static bool fill_copy(Saver *s)
{
  for (int k = 0; k < SECTION_COUNT; k++) {
    const Section *c = &scene_sections[k];
    if (section_given(s->copy, c)) *section_given(s->copy, c) = *section_given(s->scene, c);
    for (size_t i = 0; i < section_count(s->scene, c); i++)
      if (!copy_element(s, c, section_at(s->scene, c, i))) return false;
  }
  return true;
}

// The copy's texts stay the scene's, which outlives it.
static bool share_voxels(Saver *s)
{
  for (size_t i = 0; i < s->scene->voxels.count; i++) {
    if (s->scene->voxels.items[i].data) (void)voxels_share(s->scene->voxels.items[i].data);
    if (scene_add_voxels(s->copy, &s->scene->voxels.items[i]) < 0) return err_memory(s->err, "voxels", 0);
  }
  return true;
}

static bool prepare(Saver *s, const char *path)
{
  const char *base = path_base(path);
  text_add(&s->data_name, "%.*s.data", (int)(strlen(base) - strlen(path_extension(path))), base);
  Err ignored = {0}; // a folder that is gone: its files are missing anyway
  if (!real_folder(&s->folder, path, s->err)) return false;
  if (!real_folder(&s->old_folder, s->scene->path ? s->scene->path : "", &ignored))
    text_add(&s->old_folder, "%s", text_get(&s->folder));
  s->copy = scene_create(s->err);
  s->meshes = mem_zero(s->scene->meshes.count, sizeof *s->meshes);
  if (!s->copy || !share_voxels(s)) return false;
  if ((s->scene->meshes.count && !s->meshes) || s->folder.failed || s->data_name.failed ||
      s->old_folder.failed)
    return err_memory(s->err, path, s->scene->meshes.count * sizeof *s->meshes);
  return true;
}

static void finish(Saver *s)
{
  text_finish(&s->folder);
  text_finish(&s->old_folder);
  text_finish(&s->data_name);
  mem_free(s->meshes);
  array_finish(&s->pictures);
  table_finish(&s->pictures_found);
}

bool scene_save(const Scene *scene, const char *path, Err *err)
{
  Saver s = {.scene = scene, .err = err};
  Text out = {0};
  const bool ok = prepare(&s, path) && fill_copy(&s) && scene_write(s.copy, &out, err) &&
                  file_write_whole(path, text_get(&out), out.length, err);
  text_finish(&out);
  finish(&s);
  scene_destroy(s.copy);
  return ok;
}

static bool share_meshes(Saver *s)
{
  for (size_t i = 0; i < s->scene->meshes.count; i++) {
    const Mesh *mesh = &s->scene->meshes.items[i];
    const int32_t copy_i = scene_add_mesh(s->copy, mesh->name, mesh_data_share(mesh->data));
    if (copy_i < 0) return err_memory(s->err, "a mesh", 0);
    s->copy->meshes.items[copy_i].slots = mesh->slots;
    s->copy->meshes.items[copy_i].slot_count = mesh->slot_count;
  }
  return true;
}

Scene *scene_move(const Scene *scene, const char *path, Err *err)
{
  Saver s = {.scene = scene, .is_one_file = true, .err = err};
  const bool ok = prepare(&s, path) && share_meshes(&s) && fill_copy(&s);
  finish(&s);
  if (ok) {
    s.copy->is_model = scene->is_model;
    return s.copy;
  }
  scene_destroy(s.copy);
  return NULL;
}
