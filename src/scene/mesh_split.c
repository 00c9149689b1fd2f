// See mesh_split.h. Triangles are sorted by material with a counting sort; each part then numbers its vertices anew
// in the order its triangles name them. All of it takes time in proportion to the mesh and its slots, however many parts
// there are and however many materials the scene has.

#include "scene/mesh_split.h"

#include "base/mem.h"

#include <stdlib.h>
#include <string.h>

enum { SHARE_FROM = 65 }; // triangles; smaller ones are worth tidying up

typedef struct Splitter {
  const Mesh *mesh;
  size_t material_count;
  int32_t *materials; // one a part, rising; the first is -1, none
  uint32_t *slots;    // slot -> part
  size_t part_count;
  uint32_t *order;  // triangles, sorted by part
  size_t *start;    // in order, of each part, and the end of the last
  uint32_t *number; // vertex -> its number in the part, UNUSED between parts
  uint32_t *source; // the part's vertex -> the mesh's
} Splitter;

static const uint32_t UNUSED = UINT32_MAX;

static int32_t material_of_slot(const Splitter *s, size_t slot)
{
  const int32_t i = s->mesh->slots[slot];
  return i >= 0 && (size_t)i < s->material_count ? i : -1;
}

static int compare_numbers(const void *a, const void *b)
{
  const int32_t x = *(const int32_t *)a, y = *(const int32_t *)b;
  return (x > y) - (x < y);
}

static bool list_parts(Splitter *s)
{
  const size_t slot_count = s->mesh->slot_count;
  s->materials = mem_alloc(slot_count + 1, sizeof *s->materials);
  s->slots = mem_alloc(slot_count + 1, sizeof *s->slots);
  if (!s->materials || !s->slots) return false;
  s->materials[0] = -1;
  for (size_t i = 0; i < slot_count; i++) s->materials[i + 1] = material_of_slot(s, i);
  qsort(s->materials, slot_count + 1, sizeof *s->materials, compare_numbers);
  s->part_count = 1;
  for (size_t i = 1; i <= slot_count; i++)
    if (s->materials[i] > s->materials[s->part_count - 1]) s->materials[s->part_count++] = s->materials[i];
  for (size_t i = 0; i < slot_count; i++) {
    const int32_t m = material_of_slot(s, i);
    const int32_t *found = bsearch(&m, s->materials, s->part_count, sizeof m, compare_numbers);
    s->slots[i] = (uint32_t)(found - s->materials);
  }
  return true;
}

static uint32_t part_of(const Splitter *s, size_t triangle)
{
  const MeshData *m = s->mesh->data;
  const size_t slot = m->material_slots ? m->material_slots[triangle] : 0;
  return slot < s->mesh->slot_count ? s->slots[slot] : 0;
}

static void sort_by_part(Splitter *s)
{
  const size_t triangles = s->mesh->data->triangle_count;
  for (size_t t = 0; t < triangles; t++) s->start[part_of(s, t) + 1]++;
  for (size_t k = 1; k <= s->part_count; k++) s->start[k] += s->start[k - 1];
  // Each start moves to its end while it is filled, which is the next one's start.
  for (size_t t = 0; t < triangles; t++) s->order[s->start[part_of(s, t)]++] = (uint32_t)t;
  memmove(s->start + 1, s->start, s->part_count * sizeof *s->start);
  s->start[0] = 0;
}

// The rows of `from` that the part uses; false when memory is out, true without doing anything for no array.
static bool copy_rows(const Splitter *s, const float *from, size_t count, size_t per, float **to)
{
  if (!from) return true;
  size_t numbers;
  *to = size_mul(count, per, &numbers) ? mem_alloc(numbers, sizeof **to) : NULL;
  if (!*to) return false;
  for (size_t i = 0; i < count; i++) memcpy(*to + i * per, from + s->source[i] * per, per * sizeof **to);
  return true;
}

static bool copy_vertices(const Splitter *s, MeshData *to)
{
  const MeshData *m = s->mesh->data;
  const size_t n = to->vertex_count;
  return copy_rows(s, m->positions, n, 3, &to->positions) && copy_rows(s, m->normals, n, 3, &to->normals) &&
         copy_rows(s, m->texcoords[0], n, 2, &to->texcoords[0]) &&
         copy_rows(s, m->texcoords[1], n, 2, &to->texcoords[1]) &&
         copy_rows(s, m->colors, n, 4, &to->colors) && copy_rows(s, m->tangents, n, 4, &to->tangents);
}

static MeshData *extract(Splitter *s, size_t from, size_t to)
{
  const MeshData *m = s->mesh->data;
  MeshData *part = mesh_data_create();
  if (!part) return NULL;
  part->triangle_count = to - from;
  part->triangles = mem_alloc(to - from, 3 * sizeof *part->triangles);
  if (!part->triangles) goto failed;
  for (size_t i = from; i < to; i++)
    for (size_t k = 0; k < 3; k++) {
      const uint32_t v = m->triangles[3 * (size_t)s->order[i] + k];
      if (s->number[v] == UNUSED) {
        s->source[part->vertex_count] = v;
        s->number[v] = (uint32_t)part->vertex_count++;
      }
      part->triangles[3 * (i - from) + k] = s->number[v];
    }
  for (size_t i = 0; i < part->vertex_count; i++) s->number[s->source[i]] = UNUSED;
  if (copy_vertices(s, part)) return part;
failed:
  mesh_data_release(part);
  return NULL;
}

static bool add_part(Splitter *s, size_t part_i, MeshParts *out)
{
  const size_t from = s->start[part_i], to = s->start[part_i + 1];
  if (from == to) return true;
  MeshData *m = s->mesh->data;
  const bool is_whole = to - from == m->triangle_count;
  MeshData *data = is_whole && to - from >= SHARE_FROM ? mesh_data_share(m) : extract(s, from, to);
  const MeshPart part = {data, s->materials[part_i]};
  if (data && array_push(&out->list, part)) return true;
  mesh_data_release(data);
  return false;
}

bool mesh_split(const Mesh *mesh, size_t material_count, MeshParts *out, Err *err)
{
  const MeshData *m = mesh->data;
  Splitter s = {.mesh = mesh, .material_count = material_count};
  bool ok = list_parts(&s);
  s.order = mem_alloc(m->triangle_count, sizeof *s.order);
  s.start = mem_zero(s.part_count + 1, sizeof *s.start);
  s.number = mem_alloc(m->vertex_count, sizeof *s.number);
  s.source = mem_alloc(m->vertex_count, sizeof *s.source);
  ok = ok && s.order && s.start && s.number && s.source;
  if (ok) {
    memset(s.number, 0xff, m->vertex_count * sizeof *s.number);
    sort_by_part(&s);
  }
  for (size_t k = 0; ok && k < s.part_count; k++) ok = add_part(&s, k, out);
  mem_free(s.materials);
  mem_free(s.slots);
  mem_free(s.order);
  mem_free(s.start);
  mem_free(s.number);
  mem_free(s.source);
  if (!ok) err_memory(err, mesh->name ? mesh->name : "a mesh", m->triangle_count * 16 + m->vertex_count * 8);
  return ok;
}

void mesh_parts_finish(MeshParts *p)
{
  for (size_t i = 0; i < p->list.count; i++) mesh_data_release(p->list.items[i].data);
  array_finish(&p->list);
}
