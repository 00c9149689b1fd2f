// See scene.h: a scene's life, and adding to it. Reading, writing and editing are files of their own.

#include "scene/scene.h"

#include "base/mem.h"
#include "base/text.h"
#include "image/voxels.h"
#include "scene/kinds.h"
#include "scene/rig.h"

#include <string.h>

// --- mesh data ------------------------------------------------------------------------------------
MeshData *mesh_data_create(void)
{
  MeshData *m = mem_zero(1, sizeof *m);
  if (m) atomic_init(&m->users, 1);
  return m;
}

MeshData *mesh_data_share(MeshData *m)
{
  atomic_fetch_add_explicit(&m->users, 1, memory_order_relaxed);
  return m;
}

void mesh_data_release(MeshData *m)
{
  // Acquire-release: the last user must see everything the others did before they let go.
  if (!m || atomic_fetch_sub_explicit(&m->users, 1, memory_order_acq_rel) != 1) return;
  if (m->file) {
    shared_file_release(m->file);
  } else {
    mem_free(m->positions);
    mem_free(m->normals);
  }
  if (m->base) {
    mesh_data_release(m->base);
  } else if (!m->file) {
    mem_free(m->texcoords[0]);
    mem_free(m->texcoords[1]);
    mem_free(m->colors);
    mem_free(m->tangents);
    mem_free(m->triangles);
    mem_free(m->material_slots);
  }
  mem_free(m);
}

static float *copy_vectors(const float *from, size_t count)
{
  float *to = from ? mem_alloc(count, 3 * sizeof *to) : NULL;
  if (to) memcpy(to, from, count * 3 * sizeof *to);
  return to;
}

MeshData *mesh_data_move(MeshData *m, const float *positions, const float *normals)
{
  MeshData *moved = mesh_data_create();
  if (!moved) return NULL;
  const MeshData *base = moved->base = mesh_data_share(m->base ? m->base : m);
  moved->vertex_count = base->vertex_count;
  moved->triangle_count = base->triangle_count;
  for (int i = 0; i < 2; i++) moved->texcoords[i] = base->texcoords[i];
  moved->colors = base->colors;
  moved->triangles = base->triangles;
  moved->material_slots = base->material_slots;
  // Tangents would be those of the old surface; without, they follow from positions and texture coordinates.
  moved->positions = copy_vectors(positions, m->vertex_count);
  moved->normals = copy_vectors(normals, m->vertex_count);
  if (moved->positions && (moved->normals || !normals)) return moved;
  mesh_data_release(moved);
  return NULL;
}

static bool all_finite(const float *x, size_t count)
{
  for (size_t i = 0; i < count; i++)
    if (!isfinite(x[i])) return false;
  return true;
}

static void drop_if_not_finite(float **array, size_t count, const char *what, const char *name, Notes *notes)
{
  if (!*array || all_finite(*array, count)) return;
  note_once(notes, "%s: some %s are not finite numbers; all %s are ignored", name, what, what);
  mem_free(*array);
  *array = NULL;
}

// Vertices that no triangle shows any more get the place of one that is shown, so that boxes around all vertices stay as
// they should be and every number of a mesh is finite.
static void mend_positions(MeshData *m)
{
  const float *shown = m->positions + 3 * (size_t)m->triangles[0];
  for (size_t i = 0; i < m->vertex_count; i++)
    if (!all_finite(m->positions + 3 * i, 3)) memcpy(m->positions + 3 * i, shown, 3 * sizeof *shown);
}

// Not-a-number vertices appear in real files, so they cost their triangles, not the model.
static void drop_broken_triangles(MeshData *m, const char *name, Notes *notes)
{
  if (all_finite(m->positions, 3 * m->vertex_count)) return;
  size_t kept = 0;
  for (size_t t = 0; t < m->triangle_count; t++) {
    const uint32_t *v = m->triangles + 3 * t;
    bool ok = true;
    for (int k = 0; k < 3; k++) ok = ok && all_finite(m->positions + 3 * (size_t)v[k], 3);
    if (!ok) continue;
    memmove(m->triangles + 3 * kept, v, 3 * sizeof *v);
    if (m->material_slots) m->material_slots[kept] = m->material_slots[t];
    kept++;
  }
  if (kept < m->triangle_count)
    note_once(notes, "%s: %zu of %zu triangles have vertices that are not finite numbers and are left out", name,
              m->triangle_count - kept, m->triangle_count);
  m->triangle_count = kept;
  if (kept) mend_positions(m);
}

bool mesh_data_check(MeshData *m, const char *name, Notes *notes, Err *err)
{
  for (size_t i = 0; i < 3 * m->triangle_count; i++)
    if (m->triangles[i] >= m->vertex_count)
      return err_set(err, ERR_BAD_SCENE, "%s: triangle %zu names vertex %u, but there are only %zu", name, i / 3,
                     m->triangles[i], m->vertex_count);
  const bool had_triangles = m->triangle_count;
  drop_broken_triangles(m, name, notes);
  if (!m->triangle_count)
    return err_set(err, ERR_BAD_SCENE, "%s: %s", name,
                   had_triangles ? "all its triangles have vertices that are not finite numbers"
                                 : "holds no triangles");
  drop_if_not_finite(&m->normals, 3 * m->vertex_count, "normals", name, notes);
  drop_if_not_finite(&m->texcoords[0], 2 * m->vertex_count, "texture coordinates", name, notes);
  drop_if_not_finite(&m->texcoords[1], 2 * m->vertex_count, "texture coordinates", name, notes);
  drop_if_not_finite(&m->colors, 4 * m->vertex_count, "vertex colours", name, notes);
  drop_if_not_finite(&m->tangents, 4 * m->vertex_count, "tangents", name, notes);
  return true;
}

// --- the scene ------------------------------------------------------------------------------------
Scene *scene_create(Err *err)
{
  Scene *s = mem_zero(1, sizeof *s);
  if (!s) {
    err_memory(err, "a scene", sizeof *s);
    return NULL;
  }
  group_default(&group_render, 0, &s->render);
  group_default(&group_about, 0, &s->about);
  group_default(&group_whitted, 0, &s->whitted);
  group_default(&group_develop, 0, &s->develop);
  group_default(&group_sky, SKY_CONSTANT, &s->sky);
  group_default(&group_camera, CAMERA_PERSPECTIVE, &s->camera);
  group_default(&group_timeline, 0, &s->timeline);
  return s;
}

void scene_destroy(Scene *s)
{
  if (!s) return;
  for (size_t i = 0; i < s->meshes.count; i++) mesh_data_release(s->meshes.items[i].data);
  for (size_t i = 0; i < s->models.count; i++) scene_destroy(s->models.items[i].scene);
  array_finish(&s->cameras);
  array_finish(&s->skies);
  array_finish(&s->cells);
  array_finish(&s->gates);
  array_finish(&s->textures);
  array_finish(&s->materials);
  array_finish(&s->media);
  array_finish(&s->meshes);
  for (size_t i = 0; i < s->voxels.count; i++) voxels_release(s->voxels.items[i].data);
  array_finish(&s->voxels);
  array_finish(&s->models);
  array_finish(&s->objects);
  array_finish(&s->lights);
  array_finish(&s->tracks);
  rig_destroy(s->rig);
  array_finish(&s->sources);
  section_names_finish(s);
  shared_file_release(s->saved);
  notes_finish(&s->notes);
  arena_finish(&s->arena);
  mem_free(s);
}

static const Section *section_of(const Group *g) { return section_find(g->name); }

int32_t scene_find_texture(const Scene *s, const char *name)
{
  return section_index(s, section_of(&group_texture), name);
}

int32_t scene_find_material(const Scene *s, const char *name)
{
  return section_index(s, section_of(&group_material), name);
}

static bool is_full(size_t count) { return count >= INT32_MAX; }

int32_t scene_add_texture(Scene *s, TextureKind kind, const char *name)
{
  Texture t;
  group_default(&group_texture, (int32_t)kind, &t);
  t.name = section_free_name(s, section_of(&group_texture), name);
  if (!t.name || is_full(s->textures.count) || !array_push(&s->textures, t)) return -1;
  return (int32_t)s->textures.count - 1;
}

int32_t scene_add_material(Scene *s, MaterialKind kind, const char *name)
{
  Material m;
  group_default(&group_material, (int32_t)kind, &m);
  m.name = section_free_name(s, section_of(&group_material), name);
  if (!m.name || is_full(s->materials.count) || !array_push(&s->materials, m)) return -1;
  return (int32_t)s->materials.count - 1;
}

int32_t scene_add_medium(Scene *s, MediumKind kind, const char *name)
{
  Medium m;
  group_default(&group_medium, (int32_t)kind, &m);
  m.name = section_free_name(s, section_of(&group_medium), name);
  if (!m.name || is_full(s->media.count) || !array_push(&s->media, m)) return -1;
  return (int32_t)s->media.count - 1;
}

int32_t scene_add_camera(Scene *s, CameraKind kind, const char *name)
{
  Camera c;
  group_default(&group_camera, (int32_t)kind, &c);
  c.name = section_free_name(s, section_of(&group_cameras), name);
  if (!c.name || is_full(s->cameras.count) || !array_push(&s->cameras, c)) return -1;
  return (int32_t)s->cameras.count - 1;
}

int32_t scene_add_object(Scene *s, ShapeKind kind, const char *name)
{
  Object o;
  group_default(&group_object, 0, &o);
  group_default(&group_shape, (int32_t)kind, &o.shape);
  o.id = ++s->last_id;
  o.name = arena_text(&s->arena, name);
  if ((name && !o.name) || is_full(s->objects.count) || !array_push(&s->objects, o)) return -1;
  return (int32_t)s->objects.count - 1;
}

int32_t scene_add_light(Scene *s, LightKind kind, const char *name)
{
  Light l;
  group_default(&group_light, (int32_t)kind, &l);
  l.name = arena_text(&s->arena, name);
  if ((name && !l.name) || is_full(s->lights.count) || !array_push(&s->lights, l)) return -1;
  return (int32_t)s->lights.count - 1;
}

int32_t scene_add_mesh(Scene *s, const char *name, MeshData *data)
{
  const Mesh m = {.name = arena_text(&s->arena, name), .data = data};
  if ((name && !m.name) || is_full(s->meshes.count) || !array_push(&s->meshes, m)) {
    mesh_data_release(data);
    return -1;
  }
  return (int32_t)s->meshes.count - 1;
}

int32_t scene_add_voxels(Scene *s, const SceneVoxels *v)
{
  if (is_full(s->voxels.count) || !array_push(&s->voxels, *v)) {
    voxels_release(v->data);
    return -1;
  }
  return (int32_t)s->voxels.count - 1;
}

Vec3 voxels_origin(const ShapeVoxels *shape, const Voxels *v)
{
  if (!v || shape->origin == VOXELS_CORNER) return v3_all(0);
  const Vec3 half = shape->voxel_size / 2 * v3((float)v->size[0], (float)v->size[1], (float)v->size[2]);
  return shape->origin == VOXELS_CENTER ? -half : -v3(half[0], 0, half[2]);
}

static bool is_given(const float matrix[12])
{
  for (int i = 0; i < 12; i++)
    if (matrix[i] != 0) return true;
  return false;
}

Frame object_frame(const ObjectCommon *o)
{
  if (is_given(o->matrix))
    return (Frame){v3_load(o->matrix), v3_load(o->matrix + 3), v3_load(o->matrix + 6), v3_load(o->matrix + 9)};
  // Cold code: the maths library's sine is good enough, computed in double so that 90 degrees is exact to a float.
  double s[3], c[3];
  for (int i = 0; i < 3; i++) {
    const double a = (double)o->rotate[i] * (3.14159265358979323846 / 180);
    s[i] = sin(a);
    c[i] = cos(a);
    if (fabs(c[i]) < 1e-15) c[i] = 0;
    if (fabs(s[i]) < 1e-15) s[i] = 0;
  }
  // Rz Ry Rx, column by column.
  const Vec3 x = v3((float)(c[1] * c[2]), (float)(c[1] * s[2]), (float)-s[1]);
  const Vec3 y = v3((float)(s[0] * s[1] * c[2] - c[0] * s[2]), (float)(s[0] * s[1] * s[2] + c[0] * c[2]),
                    (float)(s[0] * c[1]));
  const Vec3 z = v3((float)(c[0] * s[1] * c[2] + s[0] * s[2]), (float)(c[0] * s[1] * s[2] - s[0] * c[2]),
                    (float)(c[0] * c[1]));
  return (Frame){x * o->scale[0], y * o->scale[1], z * o->scale[2], v3_load(o->translate)};
}
