// See parts.h.

#include "world/parts.h"

#include "accel/saved_tree.h"
#include "base/hash.h"

#include <string.h>
#include <sys/stat.h>

// From this size on a tree is built by all threads together; smaller ones are built side by side.
enum { LARGE_MESH = 1 << 16 };

static void image_part_release(ImagePart *part)
{
  if (!part || atomic_fetch_sub_explicit(&part->users, 1, memory_order_acq_rel) != 1) return;
  image_finish(&part->image);
  mem_free(part->path);
  mem_free(part);
}

void parts_finish(WorldParts *p)
{
  for (size_t i = 0; i < p->meshes.count; i++) {
    mesh_data_release(p->meshes.items[i].data);
    mesh_tree_release(p->meshes.items[i].tree);
    mesh_tree_release(p->meshes.items[i].old);
    tangents_release(p->meshes.items[i].tangents);
  }
  for (size_t i = 0; i < p->images.count; i++) image_part_release(p->images.items[i]);
  array_finish(&p->meshes);
  for (size_t i = 0; i < p->densities.count; i++) density_part_release(p->densities.items[i]);
  array_finish(&p->densities);
  for (size_t i = 0; i < p->voxels.count; i++) voxels_release(p->voxels.items[i]);
  array_finish(&p->voxels);
  for (size_t i = 0; i < p->fields.count; i++) sdf_body_release(p->fields.items[i]);
  array_finish(&p->fields);
  array_finish(&p->images);
  array_finish(&p->seen);
  table_finish(&p->meshes_found);
  table_finish(&p->meshes_alike);
  table_finish(&p->images_found);
  table_finish(&p->seen_found);
  parts_finish_mips(p);
  mesh_data_release(p->unit_box);
  *p = (WorldParts){0};
}

// What was built with other options is of no use.
static MeshTree *share_tree(const WorldParts *p, const WorldParts *previous, int32_t mesh_i)
{
  const bool is_alike =
      mesh_i >= 0 && !memcmp(&previous->tree_options, &p->tree_options, sizeof p->tree_options);
  return is_alike ? mesh_tree_share(previous->meshes.items[mesh_i].tree) : NULL;
}
static uint64_t origin_key(const MeshData *data)
{
  return (uintptr_t)mesh_data_origin(data);
}

static int32_t find_mesh(const WorldParts *p, const MeshData *data)
{
  size_t step = 0;
  for (const int32_t *i; p && (i = table_next(&p->meshes_found, origin_key(data), &step));)
    if (p->meshes.items[*i].data == data) return *i;
  return -1;
}

// Tells most meshes apart by a few triangles of either end.
static uint64_t triangles_key(const MeshData *m)
{
  enum { LOOKED_AT = 16 };
  const size_t counts[2] = {m->vertex_count, m->triangle_count};
  const size_t n = m->triangle_count < LOOKED_AT ? m->triangle_count : LOOKED_AT,
               size = 3 * n * sizeof *m->triangles;
  const uint64_t ends = hash_bytes(hash_bytes(3, counts, sizeof counts), m->triangles, size);
  return hash_bytes(ends, m->triangles + 3 * (m->triangle_count - n), size);
}

static bool has_same_triangles(const MeshData *a, const MeshData *b)
{
  return a->vertex_count == b->vertex_count && a->triangle_count == b->triangle_count &&
         !memcmp(a->triangles, b->triangles, 3 * a->triangle_count * sizeof *a->triangles);
}

// A mesh whose vertices were moved to be this one's: by its origin, or in a scene that was loaded again, by what it
// holds.
static int32_t find_unmoved(const WorldParts *p, const MeshData *data)
{
  size_t step = 0;
  const int32_t *i = p ? table_next(&p->meshes_found, origin_key(data), &step) : NULL;
  if (i || !p) return i ? *i : -1;
  step = 0;
  i = table_next(&p->meshes_alike, triangles_key(data), &step);
  return i && has_same_triangles(p->meshes.items[*i].data, data) ? *i : -1;
}

// The first of a kind will do: thousands of copies would make the table slow.
static bool remember_triangles(WorldParts *p, const MeshData *data, int32_t mesh_i)
{
  size_t step = 0;
  const uint64_t key = triangles_key(data);
  return table_next(&p->meshes_alike, key, &step) || table_add(&p->meshes_alike, key, mesh_i);
}

int32_t parts_add_mesh(WorldParts *p, const WorldParts *previous, MeshData *data)
{
  const int32_t known = find_mesh(p, data), next = (int32_t)p->meshes.count;
  if (known >= 0) return known;
  if (!array_reserve(&p->meshes, p->meshes.count + 1) ||
      !table_add(&p->meshes_found, origin_key(data), next) || !remember_triangles(p, data, next))
    return -1;
  MeshPart part = {.data = mesh_data_share(data)};
  const int32_t same = find_mesh(previous, data), unmoved = same >= 0 ? -1 : find_unmoved(previous, data);
  if (same >= 0) {
    part.tree = share_tree(p, previous, same);
    part.tangents = tangents_share(previous->meshes.items[same].tangents);
  }
  if (unmoved >= 0) part.old = share_tree(p, previous, unmoved);
  array_push(&p->meshes, part);
  return next;
}

static uint64_t image_key(const char *path, const uint8_t *bytes, size_t size)
{
  if (!path) return hash_bytes(1, bytes, size);
  struct stat st = {0};
  (void)stat(path, &st); // a missing file is reported when it is opened
  const uint64_t state[4] = {(uint64_t)st.st_size, (uint64_t)st.st_mtim.tv_sec, (uint64_t)st.st_mtim.tv_nsec,
                             (uint64_t)st.st_ino};
  return hash_bytes(hash_bytes(2, path, strlen(path)), state, sizeof state);
}

static int32_t find_image(const WorldParts *p, uint64_t key)
{
  size_t step = 0;
  const int32_t *i = p ? table_next(&p->images_found, key, &step) : NULL;
  return i ? *i : -1;
}

static int32_t find_seen(const WorldParts *p, const uint8_t *bytes, size_t size)
{
  size_t step = 0;
  for (const int32_t *i; (i = table_next(&p->seen_found, (uintptr_t)bytes, &step));)
    if (p->seen.items[*i].bytes == bytes && p->seen.items[*i].size == size) return p->seen.items[*i].image_i;
  return -1;
}

static ImagePart *image_part_create(uint64_t key, const char *path, const uint8_t *bytes, size_t size)
{
  ImagePart *part = mem_zero(1, sizeof *part);
  if (!part) return NULL;
  atomic_init(&part->users, 1);
  part->key = key;
  part->bytes = bytes;
  part->size = size;
  part->mean = -1;
  if (path) {
    const size_t n = strlen(path) + 1;
    part->path = mem_alloc(n, 1);
    if (!part->path) {
      mem_free(part);
      return NULL;
    }
    memcpy(part->path, path, n);
  }
  return part;
}

static int32_t add_image(WorldParts *p, const WorldParts *previous, uint64_t key, const char *path,
                         const uint8_t *bytes, size_t size)
{
  const int32_t known = find_image(p, key), old = find_image(previous, key), next = (int32_t)p->images.count;
  if (known >= 0) return known;
  if (!array_reserve(&p->images, p->images.count + 1) || !table_add(&p->images_found, key, next)) return -1;
  ImagePart *part =
      old >= 0 && previous->images.items[old]->image.pixels ? previous->images.items[old] : NULL;
  if (part)
    atomic_fetch_add_explicit(&part->users, 1, memory_order_relaxed);
  else
    part = image_part_create(key, path, bytes, size);
  if (!part) return -1;
  array_push(&p->images, part);
  return next;
}

int32_t parts_add_image(WorldParts *p, const WorldParts *previous, const char *path, const uint8_t *bytes,
                        size_t size)
{
  const int32_t known = path ? -1 : find_seen(p, bytes, size);
  if (known >= 0) return known;
  const int32_t i = add_image(p, previous, image_key(path, bytes, size), path, bytes, size);
  if (path || i < 0) return i;
  const SeenBytes seen = {bytes, size, i};
  const bool ok =
      array_push(&p->seen, seen) && table_add(&p->seen_found, (uintptr_t)bytes, (int32_t)p->seen.count - 1);
  return ok ? i : -1;
}

// --- making what is missing -----------------------------------------------------------------------
// Items are images, then meshes. A worker takes them in order, so its first failure is of its lowest item, and the
// lowest of all workers' is that of the first part at fault.
typedef struct Failure {
  size_t item;
  Err err;
} Failure;

typedef struct Making {
  WorldParts *parts;
  const Cancel *cancel;
  Failure *failures; // one a worker
} Making;

static void decode_image(ImagePart *part, Err *err)
{
  if (part->image.pixels) return;
  if (part->path)
    image_read(&part->image, part->path, err);
  else
    image_read_bytes(&part->image, part->bytes, part->size, "a picture inside the model", err);
}

static void build_tree(const WorldParts *p, MeshPart *part, Jobs *jobs, const Cancel *cancel, Err *err)
{
  const MeshData *m = part->data;
  if (part->tree) return;
  if (saved_tree_suits(&m->tree, p->tree_options))
    part->tree = mesh_tree_open(&m->tree, m->triangle_count, m->file, jobs, err);
  else
    part->tree = part->old ? mesh_tree_refit(part->old, m->positions, m->vertex_count, m->triangles,
                                             m->triangle_count, jobs, cancel, err)
                           : mesh_tree_build(m->positions, m->vertex_count, m->triangles, m->triangle_count,
                                             p->tree_options, jobs, cancel, err);
  mesh_tree_release(part->old); // so that it goes with the last world that shows it
  part->old = NULL;
}

static void make_item(void *user, size_t item, int worker)
{
  Making *m = user;
  Failure *f = &m->failures[worker];
  if (f->err.kind) return;
  f->item = item;
  if (item < m->parts->images.count) {
    decode_image(m->parts->images.items[item], &f->err);
    return;
  }
  MeshPart *part = &m->parts->meshes.items[item - m->parts->images.count];
  if (part->data->triangle_count < LARGE_MESH) build_tree(m->parts, part, NULL, m->cancel, &f->err);
}

static const Err *first_failure(const Failure *failures, size_t count)
{
  const Failure *first = NULL;
  for (size_t i = 0; i < count; i++)
    if (failures[i].err.kind && (!first || failures[i].item < first->item)) first = &failures[i];
  return first ? &first->err : NULL;
}

bool parts_make(WorldParts *p, Jobs *jobs, const Cancel *cancel, Err *err)
{
  const size_t count = p->images.count + p->meshes.count, workers = (size_t)jobs_thread_count(jobs);
  if (!count) return true;
  Making m = {p, cancel, mem_zero(workers, sizeof *m.failures)};
  if (!m.failures) return err_memory(err, "messages", workers * sizeof *m.failures);
  bool ok = jobs_run(jobs, count, make_item, &m, cancel);
  const Err *failure = first_failure(m.failures, workers);
  if (!ok) err_set(err, ERR_CANCELLED, "preparing was cancelled");
  if (ok && failure) ok = err_set(err, failure->kind, "%s", failure->text);
  mem_free(m.failures);
  for (size_t i = 0; ok && i < p->meshes.count; i++) {
    if (p->meshes.items[i].data->triangle_count < LARGE_MESH) continue;
    build_tree(p, &p->meshes.items[i], jobs, cancel, err);
    ok = p->meshes.items[i].tree;
  }
  return ok;
}

float image_part_mean(ImagePart *part, bool is_srgb)
{
  if (part->mean >= 0) return part->mean;
  const Image *img = &part->image;
  const bool decode = is_srgb && (img->type == PIXEL_U8 || img->type == PIXEL_U16);
  const float weights[3] = {0.2126f, 0.7152f, 0.0722f};
  double sum = 0;
  for (uint32_t y = 0; y < img->height; y++)
    for (uint32_t x = 0; x < img->width; x++)
      for (uint32_t c = 0; c < 3; c++) {
        const float v = image_value(img, x, y, img->channels >= 3 ? c : 0);
        sum += (double)(weights[c] * (decode ? srgb_decode(v) : v));
      }
  part->mean = (float)(sum / ((double)img->width * img->height));
  return part->mean;
}
