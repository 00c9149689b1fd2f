// See parts.h.

#include "world/parts.h"

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
  }
  for (size_t i = 0; i < p->images.count; i++) image_part_release(p->images.items[i]);
  array_finish(&p->meshes);
  array_finish(&p->images);
  mesh_data_release(p->unit_box);
  *p = (WorldParts){0};
}

static const MeshPart *find_mesh(const WorldParts *p, const MeshData *data)
{
  for (size_t i = 0; p && i < p->meshes.count; i++)
    if (p->meshes.items[i].data == data) return &p->meshes.items[i];
  return NULL;
}

int32_t parts_add_mesh(WorldParts *p, const WorldParts *previous, MeshData *data)
{
  const MeshPart *known = find_mesh(p, data);
  if (known) return (int32_t)(known - p->meshes.items);
  if (!array_reserve(&p->meshes, p->meshes.count + 1)) return -1;
  const MeshPart *old = find_mesh(previous, data);
  const MeshPart part = {mesh_data_share(data), old ? mesh_tree_share(old->tree) : NULL};
  return array_push(&p->meshes, part) ? (int32_t)p->meshes.count - 1 : -1;
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

static ImagePart *find_image(const WorldParts *p, uint64_t key, int32_t *index)
{
  for (size_t i = 0; p && i < p->images.count; i++)
    if (p->images.items[i]->key == key) {
      *index = (int32_t)i;
      return p->images.items[i];
    }
  return NULL;
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

int32_t parts_add_image(WorldParts *p, const WorldParts *previous, const char *path, const uint8_t *bytes,
                        size_t size)
{
  const uint64_t key = image_key(path, bytes, size);
  int32_t index = -1;
  if (find_image(p, key, &index)) return index;
  if (!array_reserve(&p->images, p->images.count + 1)) return -1;
  ImagePart *part = find_image(previous, key, &index);
  if (part && part->image.pixels) atomic_fetch_add_explicit(&part->users, 1, memory_order_relaxed);
  else part = image_part_create(key, path, bytes, size);
  if (!part) return -1;
  return array_push(&p->images, part) ? (int32_t)p->images.count - 1 : -1;
}

// --- making what is missing -----------------------------------------------------------------------
typedef struct Making {
  WorldParts *parts;
  const Cancel *cancel;
  Err *errs; // one an item: images, then meshes
} Making;

static void decode_image(ImagePart *part, Err *err)
{
  if (part->image.pixels) return;
  if (part->path) image_read(&part->image, part->path, err);
  else image_read_bytes(&part->image, part->bytes, part->size, "a picture inside the model", err);
}

static void build_tree(MeshPart *part, Jobs *jobs, const Cancel *cancel, Err *err)
{
  const MeshData *m = part->data;
  if (part->tree) return;
  part->tree =
      mesh_tree_build(m->positions, m->vertex_count, m->triangles, m->triangle_count, jobs, cancel, err);
}

static void make_item(void *user, size_t item, int worker)
{
  Making *m = user;
  (void)worker;
  if (item < m->parts->images.count) {
    decode_image(m->parts->images.items[item], &m->errs[item]);
    return;
  }
  MeshPart *part = &m->parts->meshes.items[item - m->parts->images.count];
  if (part->data->triangle_count < LARGE_MESH) build_tree(part, NULL, m->cancel, &m->errs[item]);
}

bool parts_make(WorldParts *p, Jobs *jobs, const Cancel *cancel, Err *err)
{
  const size_t count = p->images.count + p->meshes.count;
  if (!count) return true;
  Making m = {p, cancel, mem_zero(count, sizeof(Err))};
  if (!m.errs) return err_memory(err, "messages", count * sizeof(Err));
  bool ok = jobs_run(jobs, count, make_item, &m, cancel);
  for (size_t i = 0; ok && i < p->meshes.count; i++)
    if (p->meshes.items[i].data->triangle_count >= LARGE_MESH) {
      build_tree(&p->meshes.items[i], jobs, cancel, &m.errs[p->images.count + i]);
      ok = !is_cancelled(cancel);
    }
  if (!ok) err_set(err, ERR_CANCELLED, "preparing was cancelled");
  for (size_t i = 0; ok && i < count; i++)
    if (m.errs[i].kind != ERR_NONE) ok = err_set(err, m.errs[i].kind, "%s", m.errs[i].text);
  mem_free(m.errs);
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
