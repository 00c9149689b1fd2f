// Opens saved models (rfm.h). A file may come from anyone, and whoever writes one can compute its hashes: a right hash
// tells that nothing was damaged on the way, not that the content is sound. So every number is looked at as well,
// in the same pass, while the hash has it in the cache. Trees are checked by accel/saved_tree.h when they are used.

#include "scene/rfm.h"

#include "base/hash.h"
#include "base/mem.h"

#include <string.h>

#define MEND "convert it again from the model it was made of"

// --- head and section table -------------------------------------------------------------------------
static bool fail_damaged(const RfmFile *f, Err *err, const char *what)
{
  return err_set(err, ERR_BAD_SCENE, "%s: this saved model is damaged: %s; " MEND, f->path, what);
}

static bool check_kind_of_file(const RfmFile *f, size_t size, Err *err)
{
  const RfmHead *head = f->head;
  const size_t n = size < sizeof head->magic ? size : sizeof head->magic;
  if (memcmp(head->magic, RFM_MAGIC, n))
    return err_set(err, ERR_BAD_SCENE,
                   "%s: this is no saved model of rayfold; make one with `rayfold convert MODEL %s`", f->path,
                   path_base(f->path));
  if (size < sizeof *head)
    return err_set(err, ERR_BAD_SCENE,
                   "%s: this saved model is cut short after %zu bytes; copy it again, or " MEND, f->path,
                   size);
  if (head->byte_order == __builtin_bswap32(RFM_BYTE_ORDER))
    return err_set(err, ERR_BAD_SCENE,
                   "%s: this model was saved on a machine with the other byte order; on this one, " MEND,
                   f->path);
  if (head->byte_order != RFM_BYTE_ORDER) return fail_damaged(f, err, "its byte order is none");
  if (head->version != RFM_VERSION)
    return err_set(err, ERR_BAD_SCENE,
                   "%s: this model was saved by another version of rayfold (its format is number %u, this "
                   "program reads %d); with this one, " MEND,
                   f->path, head->version, RFM_VERSION);
  return true;
}

static bool check_head(const RfmFile *f, size_t size, Err *err)
{
  const RfmHead *head = f->head;
  if (!check_kind_of_file(f, size, err)) return false;
  if (size < head->file_size)
    return err_set(err, ERR_BAD_SCENE,
                   "%s: this saved model is cut short: it has %zu bytes of %llu; copy it again, or " MEND,
                   f->path, size, (unsigned long long)head->file_size);
  if (size > head->file_size) return fail_damaged(f, err, "there are bytes behind its end");
  if (head->section_count > (size - sizeof *head) / sizeof *f->sections)
    return fail_damaged(f, err, "its table does not fit in");
  if (head->hash != rfm_hash_head(head, f->sections))
    return fail_damaged(f, err, "the checksum of its head is wrong");
  size_t end = sizeof *head + head->section_count * sizeof *f->sections;
  for (size_t i = 0; i < head->section_count; i++) {
    const RfmSection *s = &f->sections[i];
    // One behind the other: else a small file could be a lot to look at.
    if (s->offset % RFM_ALIGN || s->offset < end || s->offset > size || s->size > size - s->offset)
      return fail_damaged(f, err, "its parts do not lie in a row");
    end = s->offset + s->size;
  }
  return true;
}

bool rfm_open(RfmFile *f, const char *path, Err *err)
{
  *f = (RfmFile){.path = path, .file = shared_file_open(path, err)};
  if (!f->file) return false;
  f->head = (const RfmHead *)(const void *)f->file->bytes.data;
  f->sections = (const RfmSection *)(const void *)(f->head + 1);
  if (check_head(f, f->file->bytes.size, err)) return true;
  rfm_close(f);
  return false;
}

void rfm_close(RfmFile *f)
{
  shared_file_release(f->file);
  *f = (RfmFile){0};
}

// --- sizes of meshes --------------------------------------------------------------------------------
static bool fail_mesh(const RfmFile *f, const RfmSection *s, Err *err, const char *what)
{
  return err_set(err, ERR_BAD_SCENE, "%s: this saved model is damaged: the %s of mesh %u %s; " MEND, f->path,
                 rfm_noun(s->kind), s->owner, what);
}

static bool check_mesh_head(const RfmFile *f, const RfmSection *s, Err *err)
{
  // The limits of triangle and vertex numbers. A mesh without triangles is none.
  const size_t most_triangles = INT32_MAX - 1, most_vertices = UINT32_MAX;
  const RfmMesh *m = rfm_span(f, s).data;
  if (s->size < sizeof *m || s->size - sizeof *m != 4 * (size_t)m->slot_count + m->name_size)
    return fail_mesh(f, s, err, "do not fit together");
  if (!m->triangle_count || m->triangle_count > most_triangles || m->vertex_count > most_vertices)
    return fail_mesh(f, s, err, "are out of range");
  return true;
}

// What stands between a mesh's head and the next one's belongs to it, and has its number.
static bool check_mesh_part(const RfmFile *f, const RfmSection *s, const RfmSection *mesh, Err *err)
{
  const RfmArray *a = rfm_array(s->kind);
  if (!mesh || s->owner != mesh->owner) return fail_mesh(f, s, err, "stand apart from it");
  const RfmMesh *m = rfm_span(f, mesh).data;
  if (a && s->size != (a->by_triangle ? m->triangle_count : m->vertex_count) * a->width)
    return fail_mesh(f, s, err, "have the wrong size");
  return true;
}

// --- hashes and values ------------------------------------------------------------------------------
typedef struct Piece { // a megabyte of one section at most
  const RfmSection *section;
  const char *data;
  size_t size;
  uint64_t limit;     // of vertex or slot numbers
  uint64_t hash;      // found
  bool has_bad_value; // found
} Piece;

typedef ARRAY(Piece) Pieces;

// Eight at a time, so that the compiler makes it wide: all exponent bits are set in what is not finite.
static bool all_finite(const uint32_t *w, size_t count)
{
  enum { EXPONENT = 0x7f800000 };
  uint32_t bad[8] = {0};
  size_t i = 0;
  for (; i + 8 <= count; i += 8)
    for (size_t k = 0; k < 8; k++) bad[k] |= -(uint32_t)((w[i + k] & EXPONENT) == EXPONENT);
  for (; i < count; i++) bad[0] |= -(uint32_t)((w[i] & EXPONENT) == EXPONENT);
  return !(bad[0] | bad[1] | bad[2] | bad[3] | bad[4] | bad[5] | bad[6] | bad[7]);
}

static bool all_below(const uint32_t *w, size_t count, uint64_t limit)
{
  uint32_t most[8] = {0};
  size_t i = 0;
  for (; i + 8 <= count; i += 8)
    for (size_t k = 0; k < 8; k++) most[k] = w[i + k] > most[k] ? w[i + k] : most[k];
  for (; i < count; i++) most[0] = w[i] > most[0] ? w[i] : most[0];
  for (size_t k = 0; k < 8; k++)
    if (most[k] >= limit) return false;
  return true;
}

static bool all_slots_below(const uint16_t *slots, size_t count, uint64_t limit)
{
  uint16_t most = 0;
  for (size_t i = 0; i < count; i++) most = slots[i] > most ? slots[i] : most;
  return most < limit;
}

static void check_piece(void *user, size_t item, int worker)
{
  (void)worker;
  Piece *p = &((Pieces *)user)->items[item];
  const RfmArray *a = rfm_array(p->section->kind);
  const void *data = p->data;
  p->hash = rfm_hash_piece(p->data, p->size);
  if (!a) return;
  switch (a->values) {
  case RFM_FLOATS: p->has_bad_value = !all_finite(data, p->size / 4); return;
  case RFM_VERTICES: p->has_bad_value = !all_below(data, p->size / 4, p->limit); return;
  case RFM_SLOTS: p->has_bad_value = !all_slots_below(data, p->size / 2, p->limit); return;
  }
}

static uint64_t limit_of(const RfmFile *f, const RfmSection *s, const RfmSection *mesh)
{
  const RfmArray *a = rfm_array(s->kind);
  const RfmMesh *m = a ? rfm_span(f, mesh).data : NULL;
  if (!m || a->values == RFM_FLOATS) return 0;
  if (a->values == RFM_VERTICES) return m->vertex_count;
  return m->slot_count ? m->slot_count : 1;
}

static bool add_pieces(const RfmFile *f, const RfmSection *s, uint64_t limit, Pieces *pieces, Err *err)
{
  const char *data = rfm_span(f, s).data;
  for (size_t at = 0; at < s->size; at += RFM_PIECE) {
    const size_t n = s->size - at < RFM_PIECE ? s->size - at : RFM_PIECE;
    const Piece p = {.section = s, .data = data + at, .size = n, .limit = limit};
    if (!array_push(pieces, p)) return err_memory(err, f->path, pieces->count * sizeof p);
  }
  return true;
}

static bool list_pieces(const RfmFile *f, Pieces *pieces, Err *err)
{
  const RfmSection *mesh = NULL;
  for (size_t i = 0; i < f->head->section_count; i++) {
    const RfmSection *s = &f->sections[i];
    if (s->kind == RFM_MESH) {
      if (s->owner != (mesh ? mesh->owner + 1 : 0)) return fail_mesh(f, s, err, "are out of order");
      if (!check_mesh_head(f, s, err)) return false;
      mesh = s;
    } else if (s->kind > RFM_MESH && s->kind <= RFM_TREE_LEAVES && !check_mesh_part(f, s, mesh, err)) {
      return false;
    }
    if (!add_pieces(f, s, limit_of(f, s, mesh), pieces, err)) return false;
  }
  return true;
}

static bool fail_section(const RfmFile *f, const RfmSection *s, Err *err, const char *what)
{
  Text of = {0};
  if (s->kind >= RFM_MESH) text_add(&of, " of mesh %u", s->owner);
  if (s->kind == RFM_PICTURE) text_add(&of, " %u", s->owner);
  err_set(err, ERR_BAD_SCENE, "%s: this saved model is damaged: %s the %s%s; " MEND, f->path, what,
          rfm_noun(s->kind), text_get(&of));
  text_finish(&of);
  return false;
}

// As rfm_hash() puts a section's hash together, from pieces that stand in a row.
static bool judge(const RfmFile *f, const Pieces *pieces, Err *err)
{
  size_t next = 0;
  for (size_t i = 0; i < f->head->section_count; i++) {
    const RfmSection *s = &f->sections[i];
    uint64_t h = s->size;
    bool has_bad_value = false;
    for (; next < pieces->count && pieces->items[next].section == s; next++) {
      h = hash_u64(h ^ pieces->items[next].hash);
      has_bad_value |= pieces->items[next].has_bad_value;
    }
    if (h != s->hash) return fail_section(f, s, err, "the checksum is wrong of");
    if (has_bad_value) return fail_section(f, s, err, "there are impossible numbers among");
  }
  return true;
}

bool rfm_check(const RfmFile *f, Jobs *jobs, Err *err)
{
  Pieces pieces = {0};
  bool ok = list_pieces(f, &pieces, err);
  if (ok) jobs_run(jobs, pieces.count, check_piece, &pieces, NULL);
  ok = ok && judge(f, &pieces, err);
  array_finish(&pieces);
  return ok;
}

// --- into a scene -----------------------------------------------------------------------------------
typedef struct Filling {
  const RfmFile *file;
  Scene *scene;
  ARRAY(Span) pictures;
  Span text, picture_of;
  Err *err;
} Filling;

static bool add_mesh(Filling *f, const RfmSection *s)
{
  Scene *scene = f->scene;
  const char *bytes = rfm_span(f->file, s).data;
  const RfmMesh *head = (const RfmMesh *)(const void *)bytes;
  const size_t slots_size = head->slot_count * sizeof(int32_t);
  MeshData *m = mesh_data_create();
  if (!m) return err_memory(f->err, f->file->path, sizeof *m);
  m->file = shared_file_share(f->file->file);
  m->vertex_count = head->vertex_count;
  m->triangle_count = head->triangle_count;
  const char *name = bytes + sizeof *head + slots_size;
  name = head->name_size ? arena_text_n(&scene->arena, name, head->name_size) : NULL;
  const int32_t mesh_i = scene_add_mesh(scene, name, m); // takes m over, also when it fails
  if (mesh_i < 0 || (head->name_size && !name)) return err_memory(f->err, f->file->path, 0);
  if (!head->slot_count) return true;
  Mesh *mesh = &scene->meshes.items[mesh_i];
  mesh->slots = arena_alloc(&scene->arena, head->slot_count, sizeof *mesh->slots);
  if (!mesh->slots) return err_memory(f->err, f->file->path, slots_size);
  memcpy(mesh->slots, bytes + sizeof *head, slots_size);
  mesh->slot_count = head->slot_count;
  return true;
}

static void add_notes(Filling *f, Span lines)
{
  const char *p = lines.data, *end = p + lines.size;
  for (const char *zero; p < end && (zero = memchr(p, 0, (size_t)(end - p))); p = zero + 1)
    note_once(&f->scene->notes, "%s", p);
}

static bool add_section(Filling *f, const RfmSection *s)
{
  const Span bytes = rfm_span(f->file, s);
  const RfmArray *a = rfm_array(s->kind);
  if (s->kind == RFM_MESH) return add_mesh(f, s);
  if (s->kind == RFM_NOTES) add_notes(f, bytes);
  if (s->kind == RFM_SCENE) f->text = bytes;
  if (s->kind == RFM_TEXTURES) f->picture_of = bytes;
  if (s->kind == RFM_PICTURE && !array_push(&f->pictures, bytes))
    return err_memory(f->err, f->file->path, f->pictures.count * sizeof bytes);
  if (s->kind < RFM_MESH || s->kind > RFM_TREE_LEAVES) return true;
  MeshData *m = f->scene->meshes.items[f->scene->meshes.count - 1].data;
  if (a) memcpy((char *)m + a->offset, &bytes.data, sizeof bytes.data);
  if (s->kind == RFM_TREE_HEAD) m->tree.head = bytes;
  if (s->kind == RFM_TREE_NODES) m->tree.nodes = bytes;
  if (s->kind == RFM_TREE_LEAVES) m->tree.leaves = bytes;
  return true;
}

static bool read_scene(const Filling *f, const LoadOptions *options)
{
  Span text = f->text;
  if (!text.size || ((const char *)text.data)[--text.size])
    return fail_damaged(f->file, f->err, "it holds no scene");
  const RfmPictures pictures = {f->pictures.items, f->picture_of.data, f->pictures.count,
                                f->picture_of.size / 4};
  return scene_read_linked(f->scene, text, f->file->path, &pictures, options, f->err);
}

static bool check_meshes(const Filling *f)
{
  for (size_t i = 0; i < f->scene->meshes.count; i++) {
    const Mesh *mesh = &f->scene->meshes.items[i];
    if (!mesh->data->positions || !mesh->data->triangles)
      return fail_damaged(f->file, f->err, "a mesh has no positions or no triangles");
    for (size_t k = 0; k < mesh->slot_count; k++)
      if (mesh->slots[k] < -1 || mesh->slots[k] >= (int32_t)f->scene->materials.count)
        return fail_damaged(f->file, f->err, "a mesh names a material that is not there");
  }
  return true;
}

bool rfm_fill(const RfmFile *file, Scene *s, const LoadOptions *options, Err *err)
{
  Filling f = {.file = file, .scene = s, .err = err};
  s->saved = shared_file_share(file->file);
  s->is_model = file->head->is_model;
  bool ok = true;
  for (size_t i = 0; ok && i < file->head->section_count; i++) ok = add_section(&f, &file->sections[i]);
  ok = ok && read_scene(&f, options) && check_meshes(&f);
  array_finish(&f.pictures);
  return ok;
}

bool import_rfm(Scene *s, const char *path, const LoadOptions *options, Err *err)
{
  RfmFile f;
  const bool ok = rfm_open(&f, path, err) && rfm_check(&f, options ? options->jobs : NULL, err) &&
                  rfm_fill(&f, s, options, err);
  rfm_close(&f);
  return ok;
}
