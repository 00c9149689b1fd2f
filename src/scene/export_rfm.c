// Writes saved models (rfm.h). All sections are in memory already, most of them the scene's own arrays: they are listed
// first, so that the table with their places and hashes can go in front of them.

#include "scene/rfm.h"

#include "base/mem.h"
#include "base/table.h"

#include <stdint.h>
#include <string.h>

typedef struct RfmOut {
  const Scene *scene;
  Arena arena; // of what is put together here
  ARRAY(RfmSection) sections;
  ARRAY(Span) spans; // as many
  ARRAY(Span) pictures;
  Table pictures_found; // hash -> picture
  Err *err;
} RfmOut;

static bool no_memory(const RfmOut *o)
{
  return err_memory(o->err, "a saved model", o->sections.count * sizeof(RfmSection));
}

static bool add(RfmOut *o, RfmKind kind, size_t owner, Span bytes)
{
  const RfmSection s = {.kind = kind, .owner = (uint32_t)owner, .size = bytes.size};
  return (array_push(&o->sections, s) && array_push(&o->spans, bytes)) || no_memory(o);
}

static bool add_if_any(RfmOut *o, RfmKind kind, size_t owner, Span bytes)
{
  return !bytes.size || add(o, kind, owner, bytes);
}

// --- the sections -----------------------------------------------------------------------------------
static bool add_mesh(RfmOut *o, size_t mesh_i, const SavedTree *tree)
{
  const Mesh *mesh = &o->scene->meshes.items[mesh_i];
  const MeshData *m = mesh->data;
  const RfmMesh head = {m->vertex_count, m->triangle_count, (uint32_t)mesh->slot_count,
                        mesh->name ? (uint32_t)strlen(mesh->name) : 0};
  const size_t slots_size = mesh->slot_count * sizeof *mesh->slots;
  char *bytes = arena_alloc(&o->arena, sizeof head + slots_size + head.name_size, 1);
  if (!bytes) return no_memory(o);
  memcpy(bytes, &head, sizeof head);
  if (slots_size) memcpy(bytes + sizeof head, mesh->slots, slots_size);
  if (head.name_size) memcpy(bytes + sizeof head + slots_size, mesh->name, head.name_size);
  if (!add(o, RFM_MESH, mesh_i, (Span){bytes, sizeof head + slots_size + head.name_size})) return false;
  for (uint32_t kind = RFM_POSITIONS; kind <= RFM_MATERIAL_SLOTS; kind++) {
    const RfmArray *a = rfm_array(kind);
    const void *data;
    memcpy(&data, (const char *)m + a->offset, sizeof data);
    const size_t count = a->by_triangle ? m->triangle_count : m->vertex_count;
    if (data && !add(o, kind, mesh_i, (Span){data, count * a->width})) return false;
  }
  return !tree->head.size ||
         (add(o, RFM_TREE_HEAD, mesh_i, tree->head) && add_if_any(o, RFM_TREE_NODES, mesh_i, tree->nodes) &&
          add_if_any(o, RFM_TREE_LEAVES, mesh_i, tree->leaves));
}

// The number of a picture's section, added if it is none yet: thousands of textures may share a large one. -1: no
// memory.
static int32_t add_picture(RfmOut *o, Span bytes)
{
  const uint64_t hash = rfm_hash(bytes.data, bytes.size);
  size_t step = 0;
  for (const int32_t *k; (k = table_next(&o->pictures_found, hash, &step));) {
    const Span other = o->pictures.items[*k];
    if (other.size == bytes.size && !memcmp(other.data, bytes.data, bytes.size)) return *k;
  }
  const int32_t next = (int32_t)o->pictures.count;
  const bool ok = table_add(&o->pictures_found, hash, next) && array_push(&o->pictures, bytes);
  if (ok && add(o, RFM_PICTURE, (size_t)next, bytes)) return next;
  no_memory(o);
  return -1;
}

static bool add_pictures(RfmOut *o)
{
  const size_t count = o->scene->textures.count;
  if (!count) return true;
  int32_t *picture_of = arena_alloc(&o->arena, count, sizeof *picture_of);
  if (!picture_of) return no_memory(o);
  for (size_t i = 0; i < count; i++) {
    const Texture *t = &o->scene->textures.items[i];
    const bool is_embedded = t->kind == TEXTURE_IMAGE && !t->image.file && t->embedded;
    picture_of[i] = is_embedded ? add_picture(o, (Span){t->embedded, t->embedded_size}) : -1;
    if (is_embedded && picture_of[i] < 0) return false;
  }
  return add(o, RFM_TEXTURES, 0, (Span){picture_of, count * sizeof *picture_of});
}

static bool add_source(RfmOut *o, const SceneSource *source)
{
  const RfmSource head = {source->hash, source->is_content, 0};
  const size_t n = strlen(source->file);
  char *bytes = arena_alloc(&o->arena, sizeof head + n, 1);
  if (!bytes) return no_memory(o);
  memcpy(bytes, &head, sizeof head);
  memcpy(bytes + sizeof head, source->file, n);
  return add(o, RFM_SOURCE, 0, (Span){bytes, sizeof head + n});
}

static bool add_cache(RfmOut *o, Text *notes)
{
  for (size_t i = 0; i < o->scene->notes.lines.count; i++) {
    const char *line = o->scene->notes.lines.items[i];
    text_add_n(notes, line, strlen(line) + 1);
  }
  if (notes->failed) return no_memory(o);
  for (size_t i = 0; i < o->scene->sources.count; i++)
    if (!add_source(o, &o->scene->sources.items[i])) return false;
  return add_if_any(o, RFM_NOTES, 0, (Span){notes->data, notes->length});
}

// --- the file ---------------------------------------------------------------------------------------
static size_t aligned(size_t offset)
{
  return (offset + RFM_ALIGN - 1) / RFM_ALIGN * RFM_ALIGN;
}

// Places every section. A file of whole pages would have no zero byte behind it and could not be mapped (file_read()),
// so such a one ends with some more.
static uint64_t place_sections(RfmOut *o)
{
  size_t at = sizeof(RfmHead) + o->sections.count * sizeof(RfmSection);
  for (size_t i = 0; i < o->sections.count; i++) {
    RfmSection *s = &o->sections.items[i];
    s->offset = aligned(at);
    s->hash = rfm_hash(o->spans.items[i].data, s->size);
    at = s->offset + s->size;
  }
  at = aligned(at);
  return at % 4096 ? at : at + RFM_ALIGN;
}

static bool write_gap(FileOut *f, size_t *at, size_t to, Err *err)
{
  static const char zeros[2 * RFM_ALIGN];
  const size_t n = to - *at;
  *at = to;
  return file_write(f, zeros, n, err);
}

static bool write_all(const RfmOut *o, const RfmHead *head, FileOut *f, Err *err)
{
  const size_t count = o->sections.count;
  size_t at = sizeof *head + count * sizeof(RfmSection);
  if (!file_write(f, head, sizeof *head, err) ||
      !file_write(f, o->sections.items, count * sizeof(RfmSection), err))
    return false;
  for (size_t i = 0; i < count; i++) {
    const Span bytes = o->spans.items[i];
    if (!write_gap(f, &at, o->sections.items[i].offset, err) || !file_write(f, bytes.data, bytes.size, err))
      return false;
    at += bytes.size;
  }
  return write_gap(f, &at, head->file_size, err);
}

static bool write_file(RfmOut *o, uint64_t key, const char *path)
{
  RfmHead head = {.byte_order = RFM_BYTE_ORDER,
                  .version = RFM_VERSION,
                  .section_count = (uint32_t)o->sections.count,
                  .is_model = o->scene->is_model,
                  .key = key};
  memcpy(head.magic, RFM_MAGIC, sizeof head.magic);
  head.file_size = place_sections(o);
  head.hash = rfm_hash_head(&head, o->sections.items);
  FileOut f;
  const bool ok = file_begin(&f, path, o->err) && write_all(o, &head, &f, o->err) && file_commit(&f, o->err);
  file_finish(&f);
  return ok;
}

bool rfm_write(const Scene *s, const SavedTree *trees, bool is_cache, uint64_t key, const char *path,
               Err *err)
{
  RfmOut o = {.scene = s, .err = err};
  Text json = {0}, notes = {0};
  bool ok = scene_write_linked(s, &json, err) &&
            add(&o, RFM_SCENE, 0, (Span){text_get(&json), json.length + 1}) && add_pictures(&o) &&
            (!is_cache || add_cache(&o, &notes));
  for (size_t i = 0; ok && i < s->meshes.count; i++) ok = add_mesh(&o, i, &trees[i]);
  ok = ok && write_file(&o, key, path);
  text_finish(&json);
  text_finish(&notes);
  array_finish(&o.sections);
  array_finish(&o.spans);
  array_finish(&o.pictures);
  table_finish(&o.pictures_found);
  arena_finish(&o.arena);
  return ok;
}
